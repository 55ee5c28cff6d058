"""The arithmetic of the live page's script, without a browser, equals that of Python to the bit."""

import base64
import json
import shutil
import subprocess
import zlib
from importlib import resources

import numpy as np
import pytest

from blysk.bench.web import web_data, web_spans
from blysk.golden.frame_constants import writes_of
from blysk.golden.frames.prepare import constants_of
from blysk.golden.reference.albedo import fragment_albedo
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import intensity
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.transfer import color_of_text, encode
from blysk.hdl.frame_constants import write_shape
from blysk.sim.engines.beats import pack, word_count
from blysk.sim.engines.wasm import fields_of


def by_script(call, **given):
    """Value of an expression by the script's core, in which ``given`` has these names."""
    folder = resources.files("blysk.bench.web").joinpath("templates", "web")
    script = folder.joinpath("core.js").read_text(encoding="utf-8")
    names = f"const {{{', '.join(given)}}} = JSON.parse(require('fs').readFileSync(0, 'utf8'));"
    text = f"{script}\nconst core = blyskCore();\n{names}\nconsole.log(JSON.stringify({call}));"
    found = subprocess.run(
        ["node", "-e", text], input=json.dumps(given), capture_output=True, text=True, check=True
    )
    return json.loads(found.stdout)


def lights():
    """Directions: any, at the viewer, behind, at right angles, and along axes."""
    rng = np.random.default_rng(5)
    viewer = web_data.scene_of(web_data.START).camera.viewer
    across = np.cross(viewer, [0, 1, 0])
    return [
        *rng.normal(size=(12, 3)),
        viewer,
        -viewer,
        across,
        -viewer + 1e-7 * across,
        *np.eye(3),
        *-np.eye(3),
    ]


needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")


@needs_node
@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_vectors_and_constants_of_quotient_are_those_of_python(model, monkeypatch):
    """To the bit, in the frame of every light: short and long spans, directions of L, tables."""
    monkeypatch.setattr(web_data, "MAX_EXPONENT", 30)
    design = web_data.design_of("quotient", model)
    _, spans = web_data.spans_of("square", 3, 100, design)
    some = spans[:: max(len(spans) // 150, 1)]
    some.length[::7] = 1
    codes = {
        f"normal_{side}.{c}": getattr(some, f"normal_{side}")[:, c].tolist()
        for side in ("left", "right")
        for c in range(3)
    }
    codes["length"] = some.length.tolist()
    states = [
        web_data.START | {"mesh": "square", "view": 3, "model": model, "direction": list(light)}
        for light in lights()
    ]
    settings = [
        {**state, "color": color_of_text("#ff8033"), "light": [1, 1, 1], "exponent": 1 + k}
        for k, state in enumerate(states)
    ]
    scenes = [
        web_data.scene_of(state | {"color": "#ff8033", "exponent": own["exponent"]})
        for state, own in zip(states, settings, strict=True)
    ]
    found, tables = by_script(
        """[settings.map((own) => {
            const frame = core.lightFrame(core.normalised(own.direction), viewer);
            const vectors = core.vectorsOf(codes, 0, codes.length.length, components, frame, tables.vector);
            const constants = core.constantsOf(own, viewer, tables, lobe, components);
            return {...constants, vectors: vectors.map((words) => [...words])};
        }), exponents.map((exponent) => core.tableOf(lobe, exponent))]""",
        settings=settings,
        codes=codes,
        viewer=scenes[0].camera.viewer.tolist(),
        components=list(design.vector_spans.components),
        tables=web_data.tables(),
        lobe=web_data.lobe_of(design),
        exponents=[1, 2, 100, 999, 1000],
    )
    for scene, of_script in zip(scenes, found, strict=True):
        start, step, exponent, *_ = tuple(web_data.with_vectors(some, scene, design).vectors)
        np.testing.assert_array_equal(of_script["vectors"], [*start.T, *step.T, exponent])
        (constants,) = constants_of(scene, design)
        for name in ("direction", "halfway", "diffuse", "specular"):
            np.testing.assert_array_equal(of_script[name], getattr(constants, name)[0], err_msg=name)
        np.testing.assert_array_equal(of_script["lobe"], constants.lobe.values.codes)
    for exponent, codes in zip((1, 2, 100, 999, 1000), tables, strict=True):
        np.testing.assert_array_equal(codes, design.specular.table(exponent).values.codes)


@needs_node
def test_phong_in_float64_is_that_of_golden():
    rng = np.random.default_rng(6)
    normals = normalise(rng.normal(size=(400, 3)))
    states = [web_data.START | {"direction": list(direction), "exponent": 9} for direction in lights()]
    color = color_of_text(web_data.START["color"])
    scenes = [web_data.scene_of(state) for state in states]
    viewer = scenes[0].camera.viewer
    found = by_script(
        """states.map((state) => {
            const own = {...state, color, light: [1, 1, 1]};
            const shade = core.shader(own, viewer, model, false);
            const all = core.reference(Float64Array.from(normals.flat()), own, viewer, model, false);
            return [[...all], normals.flatMap((normal) => [...shade(normal).color])];
        })""",
        states=states,
        color=color,
        viewer=viewer.tolist(),
        model=web_data.model_table("phong"),
        normals=normals.tolist(),
    )
    for scene, (limited, whole) in zip(scenes, found, strict=True):
        given = scene.materials[0], scene.lights, scene.ambient_light, viewer, REFLECTION_MODELS["phong"]
        exact = intensity(normals, *given)
        np.testing.assert_allclose(limited, 255 * encode(exact).ravel(), atol=1e-9)
        np.testing.assert_allclose(whole, exact.ravel(), atol=1e-12)


def unpacked(text):
    return list(zlib.decompress(base64.b64decode(text)))


@needs_node
@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize("mesh", ["colored", "textured"])
def test_albedo_and_texels_are_those_of_python(mesh, monkeypatch):
    """The albedo of fragments as near as the words of their spans, and all words of the write port."""
    monkeypatch.setattr(web_data, "MAX_EXPONENT", 50)
    design = web_data.design_of(*web_data.COLORED, albedo=True)
    state = web_data.START | {"mesh": mesh, "color": "#ffffff"}
    scene = web_data.scene_of(state)
    cut, spans = web_data.spans_of(mesh, 0, 100, design)
    chosen = np.arange(0, len(spans), 8)
    some, fragments = spans[chosen], np.isin(cut.span, chosen)
    texture, shape = web_data.texture_of(mesh), write_shape()
    found, words = by_script(
        """(() => {
            const texture = core.textureOf(given, picture, halves);
            const spans = core.spansOf(Uint8Array.from(bytes), columns);
            const constants = core.constantsOf(settings, viewer, tables, lobe, components, texture);
            const {words} = core.writesOf(constants, tables, port);
            return [[...core.albedosOf(spans, texture)], [...words]];
        })()""",
        given={name: texture[name] for name in ("width", "height", "descriptor")},
        picture=unpacked(texture["picture"]),
        halves=unpacked(texture["halves"]),
        bytes=list(zlib.decompress(web_spans.encode(some, cut.visible[fragments]))),
        columns=web_spans.COLUMNS,
        settings={**state, "color": [1, 1, 1], "light": [1, 1, 1]},
        viewer=scene.camera.viewer.tolist(),
        tables=web_data.tables(),
        lobe=web_data.lobe_of(design),
        components=list(design.vector_spans.components),
        port={"words": word_count(shape), "fields": fields_of(shape)},
    )
    np.testing.assert_array_equal(words, pack(shape, writes_of(constants_of(scene, design)))[:, 0])
    exact = fragment_albedo(scene, cut, fragments & cut.visible)
    # Lines are off by the errors of their words. Colours differ by at most 1 from texel to texel.
    model = design.albedo.spans
    bound = 2 * model.errors(some.attributes, some.length)
    bound /= model.compute(some.attributes, some.length).weight.values
    if mesh == "textured":
        bound *= np.repeat(2.0 ** (1 + some.attributes.range), some.length)
        assert len(np.unique(some.attributes.level)) > 1
    bound = bound[cut.visible[fragments], np.newaxis] + 1e-12
    assert bound.max() < 2**-14
    assert (np.abs(np.reshape(found, (-1, 3)) - exact) <= bound).all()
    assert np.ptp(exact) > 0.5
