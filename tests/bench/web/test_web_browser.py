# amaranth: UnusedElaboratable=no
"""The live page as a visitor uses it: in a browser, from disk; its frames against the engines and golden."""

import dataclasses
import json

import numpy as np
import pytest

from blysk.bench.web import web, web_data, web_meshes
from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.number.unit_vector import ONE
from blysk.golden.reference.metrics import error_figures
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render, shade_spans, visible_mask
from blysk.golden.reference.transfer import encode
from blysk.sim.engines.beats import pack
from blysk.sim.engines.probes import ObservedPipeline

from .live_page import (
    DESIGNS,
    MODULES,
    by_model,
    change,
    digest,
    figure,
    has_compiler,
    natively,
    picture_of,
    prepared,
    settle,
    state_of,
    use,
)

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

pytest.importorskip("ziglang", reason="ziglang is not installed")

pytestmark = pytest.mark.long


def test_first_frame_is_that_of_the_native_engine(open_page):
    page = open_page()
    state = state_of(page)
    assert (state["mesh"], state["method"], state["model"]) == ("teapot", "quotient", "blinn")
    image, run = natively(state)
    assert len(np.unique(image)) > 100
    assert digest(picture_of(page)) == digest(image)
    assert figure(page, "cycles") == run.total_cycles
    assert page.locator("[data-figure=gated]").inner_text() == "no gate"
    assert 0.3 < figure(page, "largest") < 0.65


def test_true_phong_follows_the_light(open_page):
    """For a light that moves, the vectors of all spans change. No spans are loaded again."""
    page = open_page()
    blinn = digest(picture_of(page))
    use(page, "quotient", "phong")
    viewer = web_data.scene_of(state_of(page)).camera.viewer
    digests = {blinn}
    for direction in ([-0.5, 0.8, 0.7], [0.9, 0.1, -0.2], list(viewer), list(-viewer)):
        page.evaluate("d => { blysk.state.direction = d; return blysk.refresh(); }", direction)
        settle(page)
        shown = digest(picture_of(page))
        assert shown == digest(by_model(state_of(page)))
        digests.add(shown)
        assert figure(page, "largest") < 0.65
    assert len(digests) == 5
    assert len(page.evaluate("() => [...document.querySelectorAll('script[src^=spans]')]")) == 1


def test_a_gate_is_counted(open_page):
    page = open_page()
    use(page, "quadratic", "cosquad")
    state = state_of(page)
    image, run = natively(state)
    assert digest(picture_of(page)) == digest(image)
    assert figure(page, "gated") == run.status["gated_pixels"] > 0
    assert figure(page, "gated") < len(prepared(state)[2].cut_raster.span)


@pytest.mark.skipif(not has_compiler(), reason="no C++ compiler: pysim would take hours")
def test_every_module_gives_the_frame_of_the_native_engine(open_page):
    """Designs of six kinds, in both engines. The units' tests compile the other methods."""
    page = open_page()
    assert page.evaluate("() => Object.keys(blysk.site.designs)") == MODULES
    digests = set()
    for method, model in DESIGNS:
        use(page, method, model)
        state = state_of(page)
        assert (state["method"], state["model"]) == (method, model)
        image, run = natively(state)
        shown = digest(picture_of(page))
        assert shown == digest(image), (method, model)
        assert figure(page, "cycles") == run.total_cycles, (method, model)
        if web_data.design_of(method, model).gate:
            assert figure(page, "gated") == run.status["gated_pixels"], (method, model)
        digests.add(shown)
    # Designs that differ in their arithmetic differ in some pixel, so none is shown for another.
    assert len(digests) > len(DESIGNS) // 2


def test_drag_moves_the_light(open_page):
    page = open_page()
    before = picture_of(page)
    box = page.locator("#frame").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x - 60, y)
    page.mouse.down()
    page.mouse.move(x + 30, y - 20)
    page.mouse.move(x + 90, y - 50, steps=4)
    page.mouse.up()
    settle(page)
    state = state_of(page)
    assert not page.locator("#inside").is_visible()
    axes = web_data.streams_of("teapot", 0, ["quotient"])["axes"]
    right, up, towards = np.array(axes) @ state["direction"]
    assert right > 0.4
    assert up > 0.2
    assert towards > 0
    image, _ = natively(state)
    assert digest(image) == digest(picture_of(page)) != digest(before)
    sun = page.locator("#sun").bounding_box()
    assert sun["x"] + sun["width"] / 2 == pytest.approx(x + 90, abs=2)
    assert sun["y"] + sun["height"] / 2 == pytest.approx(y - 50, abs=2)


def test_every_control_changes_the_frame(open_page):
    page = open_page()
    digests = {digest(picture_of(page))}
    for control, value in [
        *(
            ("exponent", 100),
            ("model", "phong"),
            ("method", "renormalise"),
            ("ambient", 0.3),
            ("diffuse", 0.5),
            ("specular", 0.9),
        ),
        *(("color", "#3366cc"), ("light", "#ffddaa"), ("model", "ggx"), ("view-number", 1)),
        *(("roughness", 0.55), ("roughness", 0.12), ("model", "exp"), ("exponent", 700)),
        *(("mesh", "square"), ("method", "linear")),
    ]:
        change(page, control, value)
        image = picture_of(page)
        assert digest(image) not in digests, control
        digests.add(digest(image))
        state = state_of(page)
        assert state["view" if control == "view-number" else control] == value
        assert digest(by_model(state)) == digest(image), control
    # If a method does not have the model, the page takes a model that it has, and offers no other.
    assert state["model"] == "cosquad"
    assert page.locator("#model option[value=exp]").is_disabled()
    assert page.locator("#view-number").is_hidden()
    for control in ("exponent", "ambient"):
        assert page.locator(f"output[for={control}]").inner_text() == f"{state[control]:g}"
    page.locator("#again").click()
    settle(page)
    assert digest(picture_of(page)) == digest(by_model(state_of(page)))


def test_constants_are_those_of_python(open_page):
    """Quantised vectors, colours and the words of the write port are equal to the bit."""
    page = open_page()
    use(page, "quadratic", "cosquad")
    rng = np.random.default_rng(8)
    vectors = [*np.eye(3), *-np.eye(3), *rng.normal(size=(60, 3)), *rng.normal(size=(20, 3)) * 1e-3]
    states = []
    for k, vector in enumerate(vectors):
        colors = [f"#{rng.integers(0, 1 << 24):06x}" for _ in range(2)]
        ks = rng.integers(0, 101, 3) / 100
        states.append(
            web_data.START
            | {
                "mesh": "teapot",
                "view": k % 2,
                "direction": list(vector),
                "color": colors[0],
                "light": colors[1],
            }
            | {"exponent": int(rng.integers(1, 1001)), "ambient": ks[0], "diffuse": ks[1], "specular": ks[2]}
        )
    # A light straight behind has no half-way vector.
    viewer = web_data.scene_of(states[0]).camera.viewer
    states.append(states[0] | {"direction": list(-viewer)})
    script = """async states => {
        const found = [];
        const design = blysk.latest.settings.design;
        for (const state of states) {
            Object.assign(blysk.state, state);
            const settings = blysk.settingsNow();
            const constants = blysk.core.constantsOf(settings, settings.viewer, blysk.site.tables);
            const port = {words: 1, fields: {address: {offset: 0, width: 9}, data: {offset: 9, width: 18}}};
            const {words} = blysk.core.writesOf(constants, blysk.site.tables, port);
            found.push({constants, words: [...words]});
        }
        return found;
    }"""
    kept = {"method": "quadratic", "model": "cosquad", "reference": "method"}
    found = page.evaluate(script, [json.loads(json.dumps(state | kept, default=float)) for state in states])
    shape = ObservedPipeline(web_data.design_of("quadratic", "cosquad")).write.payload.shape()
    for state, of_page in zip(states, found, strict=True):
        expected = FrameConstants.of(web_data.scene_of(state), 1)
        for name, codes in of_page["constants"].items():
            np.testing.assert_array_equal(np.ravel(getattr(expected, name)), codes, err_msg=name)
        np.testing.assert_array_equal(pack(shape, writes_of([expected]))[:, 0], of_page["words"])
    assert not np.any(found[-1]["constants"]["halfway"])


@pytest.mark.skipif(not has_compiler(), reason="no C++ compiler: pysim would take hours")
@pytest.mark.parametrize("mesh", ["colored", "textured"])
def test_colours_and_textures(open_page, mesh):
    """Pixels and cycles are those of the native engine. The page takes the module that draws the mesh."""
    page = open_page()
    use(page, "linear", "cosquad")
    change(page, "mesh", mesh)
    state = state_of(page)
    assert (state["method"], state["model"], state["color"]) == ("quotient", "blinn", "#ffffff")
    assert page.locator("#mesh-text").inner_text() == web_meshes.MESHES[mesh].text
    for box, option in (("method", "linear"), ("model", "cosquad"), ("compare", "rival")):
        assert page.locator(f"#{box} option[value={option}]").is_disabled()
    image, run = natively(state)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 1000
    assert digest(picture_of(page)) == digest(image) == digest(by_model(state))
    assert figure(page, "cycles") == run.total_cycles
    golden, mask = exact_of(state, "method")
    figures = error_figures(picture_of(page), golden * 255, mask)
    # The page finds the albedo from the words of the spans.
    assert figure(page, "largest") == pytest.approx(figures.max_lsb, abs=0.01)
    assert figure(page, "p999") == pytest.approx(figures.p999_lsb, abs=0.01)
    assert 0.5 < figure(page, "largest") < 0.7
    page.evaluate("d => { blysk.state.direction = d; return blysk.refresh(); }", [0.9, 0.3, 0.4])
    change(page, "color", "#88ccff")
    assert digest(picture_of(page)) == digest(by_model(state_of(page))) != digest(image)
    change(page, "mesh", "square")
    state = state_of(page)
    assert state["color"] == web_data.START["color"]
    assert page.locator("#method option[value=linear]").is_enabled()
    assert digest(picture_of(page)) == digest(by_model(state))


def exact_of(state, reference):
    """The page's reference by golden, encoded, and the pixels with a surface."""
    scene, design, frame = prepared(state)
    entry = web_data.REFERENCES[reference]
    raster = dataclasses.replace(
        frame.cut_raster,
        normal_left=frame.spans.normal_left / ONE,
        normal_right=frame.spans.normal_right / ONE,
    )
    if design.interpolator.curve_is_exact:
        # The codes have the lengths of the true line.
        ones = np.ones(len(frame.spans))
        raster = dataclasses.replace(raster, magnitude_left=ones, magnitude_right=ones)
    reflection = REFLECTION_MODELS[(state["model"] != "phong" and entry["model"]) or state["model"]]
    if entry["curve"] == "exact":
        golden = encode(render(scene, "phong", reflection, raster=raster).image)
    else:
        golden = encode(shade_spans(scene, raster, design.interpolator.exact_normals, reflection))
    return golden, visible_mask(scene, raster)


@pytest.mark.parametrize("reference", web_data.REFERENCES)
def test_reference_is_that_of_golden(open_page, reference):
    page = open_page()
    for method, model, exponent in (
        ("quadratic", "cosquad", 60),
        ("renormalise", "exp", 300),
        ("linear", "cosquad", 9),
        ("quotient", "blinn", 80),
        ("quotient", "phong", 15),
    ):
        change(page, "method", method)
        change(page, "model", model)
        change(page, "exponent", exponent)
        change(page, "reference", reference)
        golden, mask = exact_of(state_of(page), reference)
        figures = error_figures(picture_of(page), golden * 255, mask)
        # The lengths of exact normals are sent with 19 bits of their logarithm.
        assert figure(page, "largest") == pytest.approx(figures.max_lsb, abs=2e-4)
        assert figure(page, "p999") == pytest.approx(figures.p999_lsb, abs=2e-4)
        shown = picture_of(page, "golden").astype(float)
        assert np.abs(shown - golden * 255)[mask].max() <= 0.5 + 2e-4
        errors = np.abs(picture_of(page) - golden * 255).max(axis=-1)
        colors = np.array(web.map_colors())
        # Equal steps up to the largest error of the frame. An error near the end of a step may be on either
        # side.
        steps = np.array([[errors + d] for d in (-1e-3, 1e-3)]) / figures.max_lsb * len(colors)
        low, high = np.clip(np.ceil(steps[:, 0]).astype(int) - 1, 0, len(colors) - 1)
        shown = picture_of(page, "errors")
        either = (shown == colors[low]).all(axis=-1) | (shown == colors[high]).all(axis=-1)
        assert either[mask].all()
        assert (
            page.locator("#ramp-high").inner_text()
            == page.locator("[data-figure=largest]").inner_text().split()[0]
        )


def test_every_curve_and_model_in_float64(open_page):
    """Also curves and models whose modules this site does not have."""
    page = open_page()
    from blysk.golden.presets import MODELS
    from blysk.golden.reference.curves import CURVES, interpolate

    rng = np.random.default_rng(3)
    ends = rng.normal(size=(2, 20, 3))
    ends[1] = ends[0] + rng.normal(size=(20, 3)) * rng.uniform(0, 2, (20, 1))
    ends /= np.linalg.norm(ends, axis=-1, keepdims=True)
    ends[1, 0] = ends[0, 0]
    codes = np.rint(ends * ONE).astype(int)
    t = np.linspace(0, 1, 7)
    script = """([left, right, t, curve]) => left.map((_, span) => {
        const codes = {};
        for (const c of [0, 1, 2]) {
            codes[`normal_left.${c}`] = left.map(n => n[c]);
            codes[`normal_right.${c}`] = right.map(n => n[c]);
        }
        const normal = [0, 0, 0];
        const along = blysk.core.curveOf(curve, {codes}, span, blysk.site.tables.one, normal);
        return t.map(t => { along(t); return [...normal]; });
    })"""
    for curve in CURVES:
        found = page.evaluate(script, [*codes.tolist(), t.tolist(), curve])
        left, right = (codes / ONE)[..., np.newaxis, :]
        np.testing.assert_allclose(found, interpolate(curve, left, right, t[np.newaxis]), atol=1e-12)
    cosine = np.r_[1, np.linspace(-1, 1, 41), 1 - np.geomspace(1e-6, 0.1, 20)]
    script = """([table, cosine, exponent]) => {
        const reflect = blysk.core.reflection(table, exponent);
        return cosine.map(reflect);
    }"""
    for name, unit in MODELS.items():
        for exponent in (1, 7, 100, 1000):
            found = page.evaluate(script, [web_data.model_table(name), cosine.tolist(), exponent])
            np.testing.assert_allclose(
                found, unit.reflection.reflect(cosine, exponent), atol=1e-9, err_msg=name
            )


def test_error_figures_of_few_and_equal_values(open_page):
    page = open_page()
    rng = np.random.default_rng(2)
    for errors in ([0.0], [1.5, 255.0], [0.25] * 5000, rng.exponential(0.3, 4000) % 255, [0.0] * 999 + [3.0]):
        found = page.evaluate("errors => blysk.core.errorFigures(Float64Array.from(errors))", list(errors))
        assert found["largest"] == max(errors)
        assert found["p999"] == pytest.approx(np.percentile(errors, 99.9), abs=1e-12)
