"""The arithmetic of the live page's script, without a browser, equals that of Python to the bit."""

import json
import shutil
import subprocess
from importlib import resources

import numpy as np
import pytest

from blysk.bench.web import web_data
from blysk.golden.frames.prepare import constants_of
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import intensity
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.transfer import color_of_text, encode


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
        start, step, exponent = tuple(web_data.with_vectors(some, scene, design).vectors)
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
