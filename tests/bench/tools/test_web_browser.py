# amaranth: UnusedElaboratable=no
"""The live page as a visitor uses it: in a browser, from disk; its frames against the engines and golden."""

import base64
import dataclasses
import hashlib
import json
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest

from blysk.bench.store import results_of
from blysk.bench.tools import web, web_data
from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.frames.frame import frame_buffer
from blysk.golden.frames.prepare import prepare
from blysk.golden.number.unit_vector import ONE
from blysk.golden.reference.metrics import error_figures
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import shade_spans
from blysk.sim.engines.beats import pack, unpack
from blysk.sim.engines.cxxrtl import find_compilers
from blysk.sim.engines.engine import Stimulus
from blysk.sim.engines.probes import ObservedPipeline
from blysk.sim.engines.pysim import Model
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import FrameSimulator, beats_of

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytest.importorskip("ziglang", reason="ziglang is not installed")
pytestmark = pytest.mark.long


def has_compiler():
    return next(find_compilers(), None) is not None


WIDTHS = {"desktop": (1280, 800), "phone": (375, 740)}
DESIGNS = [("chord", "cosquad"), ("chord", "exp"), ("linear", "cosquad")]
VIEWS = {"teapot": 2, "square": 1}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A site of three modules and three views."""
    folder = tmp_path_factory.mktemp("web") / "site"
    work = web.tasks(DESIGNS, VIEWS)
    web.write_site(folder, work, results_of(work))
    return folder


@pytest.fixture
def open_page(watching, site):
    """Open the page and wait for its first frame; afterwards there was no error, and no request left it."""
    folders = []
    with watching() as (new_page, errors, requests):

        def open_page(width="desktop", script=None, waits=True, folder=site, **options):
            page = new_page(WIDTHS[width], 30, **options)
            if script:
                page.add_init_script(script)
            folders.append(folder.as_uri())
            page.goto((folder / "index.html").as_uri())
            if waits:
                page.wait_for_selector("body[data-frame]")
            return page

        open_page.allowed = "none"
        yield open_page
    assert [text for text in errors if open_page.allowed not in text] == []
    asked = [url for url in requests if not url.startswith("blob:")]
    assert all(url.startswith(tuple(folders)) for url in asked)


def settle(page):
    """Wait until the frame is that of the page's settings."""
    page.wait_for_function(
        "() => blysk.latest && JSON.stringify(blysk.latest.settings) === JSON.stringify(blysk.settingsNow())"
    )


def change(page, control, value):
    box = page.locator(f"#{control}")
    if box.evaluate("box => box.localName") == "select":
        box.select_option(str(value))
    else:
        box.evaluate(
            "(box, value) => { box.value = value; box.dispatchEvent(new Event('input', {bubbles: true})); }",
            str(value),
        )
    settle(page)


def state_of(page):
    return page.evaluate("() => ({...blysk.state})")


def picture_of(page, name="frame"):
    """Red, green and blue as the canvas shows them."""
    script = """name => {
        const canvas = document.getElementById(name);
        const copy = new OffscreenCanvas(canvas.width, canvas.height);
        const context = copy.getContext('2d', {willReadFrequently: true});
        context.drawImage(canvas, 0, 0);
        const {data} = context.getImageData(0, 0, canvas.width, canvas.height);
        let text = '';
        const letters = (k) => String.fromCharCode(...data.subarray(k, k + 4096));
        for (let k = 0; k < data.length; k += 4096) text += letters(k);
        return btoa(text);
    }"""
    data = np.frombuffer(base64.b64decode(page.evaluate(script, name)), dtype=np.uint8)
    return data.reshape(web_data.HEIGHT, web_data.WIDTH, 4)[..., :3]


def digest(image):
    return hashlib.sha256(np.ascontiguousarray(image).tobytes()).hexdigest()


def prepared(state):
    """Scene, design and spans of the page's settings."""
    design = web_data.design_of(state["method"], state["model"])
    band = next(most for most in web_data.BANDS if state["exponent"] <= most)
    return web_data.scene_of(state), design, prepare(web_data.scene_of(state | {"exponent": band}), design)


UNITS = {}


def natively(state):
    """Frame and run of the native engine."""
    scene, design, frame = prepared(state)
    unit = UNITS.setdefault((design.method, design.model), ObservedPipeline(design))
    run = simulate(
        unit,
        beats_of(unit.unit, frame.spans),
        count=len(frame.cut_raster.span),
        write=writes_of([FrameConstants.of(scene, 1)]),
        engine="auto",
    )
    colors = np.stack([run.beats[name] for name in "rgb"], axis=-1)
    return frame_buffer(scene, frame.cut_raster, colors), run


def by_model(state):
    scene, design, frame = prepared(state)
    pixels = design.compute(frame.spans, FrameConstants.of(scene, 1))
    return frame_buffer(scene, frame.cut_raster, pixels.color)


def figure(page, name):
    return float(page.locator(f"[data-figure={name}]").get_attribute("data-value"))


def test_first_frame_is_that_of_the_native_engine(open_page):
    page = open_page()
    state = state_of(page)
    assert (state["mesh"], state["method"], state["model"]) == ("teapot", "chord", "cosquad")
    image, run = natively(state)
    assert len(np.unique(image)) > 100
    assert digest(picture_of(page)) == digest(image)
    assert figure(page, "cycles") == run.total_cycles
    assert figure(page, "gated") == run.status["gated_spans"] > 0
    # What the gate does not prove may have no highlight either.
    assert page.locator("[data-figure=gated]").inner_text().startswith("≥ ")
    assert 0.3 < figure(page, "largest") < 1


@pytest.mark.skipif(not has_compiler(), reason="no C++ compiler: pysim would take hours")
def test_every_module_gives_the_frame_of_the_native_engine(open_page, tmp_path):
    """All that the command builds by itself: fourteen modules to compile, in both engines."""
    work = web.tasks(web_data.DESIGNS, {"teapot": 1})
    web.write_site(tmp_path / "site", work, results_of(work))
    page = open_page(folder=tmp_path / "site")
    assert page.evaluate("() => Object.keys(blysk.site.designs)") == [
        "-".join(pair) for pair in web_data.DESIGNS
    ]
    digests = set()
    for method, model in web_data.DESIGNS:
        page.locator("#method").select_option(method)
        change(page, "model", model)
        state = state_of(page)
        assert (state["method"], state["model"]) == (method, model)
        image, run = natively(state)
        shown = digest(picture_of(page))
        assert shown == digest(image), (method, model)
        assert figure(page, "cycles") == run.total_cycles, (method, model)
        assert figure(page, "gated") == run.status["gated_spans"], (method, model)
        digests.add(shown)
    # Those that differ by their arithmetic do so in some pixel: none is shown for another.
    assert len(digests) > len(web_data.DESIGNS) // 2


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
    axes = web_data.streams_of("teapot", 0, ["chord"])["axes"]
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
        *(("exponent", 100), ("ambient", 0.3), ("diffuse", 0.5), ("specular", 0.9)),
        *(("color", "#3366cc"), ("light", "#ffddaa"), ("model", "exp"), ("view-number", 1)),
        *(("exponent", 700), ("mesh", "square"), ("method", "linear")),
    ]:
        change(page, control, value)
        image = picture_of(page)
        assert digest(image) not in digests, control
        digests.add(digest(image))
        state = state_of(page)
        assert state["view" if control == "view-number" else control] == value
        assert digest(by_model(state)) == digest(image), control
    # A method without the model takes one that it has; the page offers no other.
    assert state["model"] == "cosquad"
    assert page.locator("#model option[value=exp]").is_disabled()
    assert page.locator("#view-number").is_hidden()
    for control in ("exponent", "ambient"):
        assert page.locator(f"output[for={control}]").inner_text() == f"{state[control]:g}"
    page.locator("#again").click()
    settle(page)
    assert digest(picture_of(page)) == digest(by_model(state_of(page)))


def test_same_frame_as_the_command_renders(open_page):
    """Where the exponent is that of the spans, the frame is that of `blysk render` for the scene."""
    page = open_page()
    change(page, "exponent", web_data.BANDS[0])
    state = state_of(page)
    frame = FrameSimulator(
        web_data.design_of("chord", "cosquad"), engine="cxxrtl" if has_compiler() else "pysim"
    )
    rendered = frame.render(web_data.scene_of(state))
    assert digest(rendered.image) == digest(picture_of(page))
    assert figure(page, "cycles") == rendered.cycles


def test_constants_are_those_of_python(open_page):
    """Quantised vectors, colours and the words of the write port, to the bit."""
    page = open_page()
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
    # A light straight behind: there is no half-way vector.
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
    kept = {"method": "chord", "model": "cosquad", "reference": "method"}
    found = page.evaluate(script, [json.loads(json.dumps(state | kept, default=float)) for state in states])
    shape = ObservedPipeline(web_data.design_of("chord", "cosquad")).write.payload.shape()
    for state, of_page in zip(states, found, strict=True):
        expected = FrameConstants.of(web_data.scene_of(state), 1)
        for name, codes in of_page["constants"].items():
            np.testing.assert_array_equal(np.ravel(getattr(expected, name)), codes, err_msg=name)
        np.testing.assert_array_equal(pack(shape, writes_of([expected]))[:, 0], of_page["words"])
    assert not np.any(found[-1]["constants"]["halfway"])


@pytest.mark.parametrize("reference", web_data.REFERENCES)
def test_reference_is_that_of_golden(open_page, reference):
    page = open_page()
    for method, model, exponent in (
        ("chord", "cosquad", 60),
        ("chord", "exp", 300),
        ("linear", "cosquad", 9),
    ):
        change(page, "method", method)
        change(page, "model", model)
        change(page, "exponent", exponent)
        change(page, "reference", reference)
        state = state_of(page)
        scene, design, frame = prepared(state)
        entry = web_data.REFERENCES[reference]
        raster = dataclasses.replace(
            frame.cut_raster,
            normal_left=frame.spans.normal_left / ONE,
            normal_right=frame.spans.normal_right / ONE,
        )
        curve = entry["curve"] or design.interpolator.exact_normals
        golden = shade_spans(
            scene, raster, curve, REFLECTION_MODELS[entry["model"] or model], design.interpolator.uses_chord
        )
        mask = np.zeros((web_data.HEIGHT, web_data.WIDTH), dtype=bool)
        mask.reshape(-1)[raster.pixel[raster.visible]] = True
        figures = error_figures(picture_of(page), golden * 255, mask)
        assert figure(page, "largest") == pytest.approx(figures.max_lsb, abs=1e-9)
        assert figure(page, "p999") == pytest.approx(figures.p999_lsb, abs=1e-9)
        shown = picture_of(page, "golden").astype(float)
        assert np.abs(shown - golden * 255)[mask].max() <= 0.5 + 1e-9
        errors = np.abs(picture_of(page) - golden * 255).max(axis=-1)
        colors = np.array(web.map_colors())[np.searchsorted(web.STEPS, errors)]
        np.testing.assert_array_equal(picture_of(page, "errors")[mask], colors[mask])


def test_every_curve_and_model_in_float64(open_page):
    """Also those whose modules this site has not got."""
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
    for model in MODELS:
        for exponent in (1, 7, 100, 1000):
            found = page.evaluate(script, [web_data.model_table(model), cosine.tolist(), exponent])
            np.testing.assert_allclose(
                found, REFLECTION_MODELS[model].reflect(cosine, exponent), atol=1e-9, err_msg=model
            )


def test_error_figures_of_few_and_equal_values(open_page):
    page = open_page()
    rng = np.random.default_rng(2)
    for errors in ([0.0], [1.5, 255.0], [0.25] * 5000, rng.exponential(0.3, 4000) % 255, [0.0] * 999 + [3.0]):
        found = page.evaluate("errors => blysk.core.errorFigures(Float64Array.from(errors))", list(errors))
        assert found["largest"] == max(errors)
        assert found["p999"] == pytest.approx(np.percentile(errors, 99.9), abs=1e-12)


def looked_at(page):
    """Look inside a pixel of a bright place; the page's words about it."""
    frame = picture_of(page).sum(axis=-1).astype(float)
    y, x = np.unravel_index(frame.argmax(), frame.shape)
    page.locator("#frame").scroll_into_view_if_needed()
    box = page.locator("#frame").bounding_box()
    at = (
        box["x"] + (x + 0.5) * box["width"] / web_data.WIDTH,
        box["y"] + (y + 0.5) * box["height"] / web_data.HEIGHT,
    )
    page.mouse.click(*at)
    page.wait_for_selector(f'body[data-inside^="{x},{y},"]')
    return int(x), int(y)


def traced(page, component):
    """Status of pysim on the cycles of the page's trace."""
    inside = page.evaluate(
        """() => {
            const {from, to, span, start, length, firstClock, lastClock, clock} = blysk.inside;
            return {from, to, span, start, length, firstClock, lastClock, clock};
        }"""
    )
    scene, _, frame = prepared(state_of(page))
    spans = frame.spans[inside["from"] : inside["to"]]
    none = np.zeros(1, dtype=bool)
    stimulus = Stimulus(
        input=pack(component.i.payload.shape(), beats_of(component.unit, spans)),
        write=pack(component.write.payload.shape(), writes_of([FrameConstants.of(scene, 1)])),
        constants=np.zeros((0, 0), dtype=np.uint32),
        input_stalls=none,
        output_stalls=none,
        count=int(spans.length.sum()),
        idle_timeout=1000,
        settle=64,
    )

    def status(clock):
        trace = Model(component).run(dataclasses.replace(stimulus, limit=clock))
        return unpack(component.status.shape(), trace.status)[0]

    return inside, stimulus, status


def test_waveform_is_that_of_pysim(open_page):
    page = open_page()
    x, y = looked_at(page)
    component = ObservedPipeline(web_data.design_of("chord", "cosquad"))
    inside, stimulus, status = traced(page, component)
    run = Model(component).run(stimulus)
    own = slice(inside["start"], inside["start"] + inside["length"])
    assert inside["lastClock"] == run.cycles[own][-1]
    assert inside["firstClock"] == run.input_cycles[inside["span"] - inside["from"]]
    cells = "row => Object.fromEntries([...row.cells].slice(1).map(c => [c.dataset.clock, c.dataset.code]))"
    for clock in (inside["clock"], inside["clock"] + 2, inside["lastClock"]):
        row = status(clock)
        for name in (
            "diffuse_0_sum",
            "highlight_0_step",
            "cosine",
            "highlight",
            "gated",
            "base",
            "square",
            "r",
        ):
            shown = page.locator(f"#wave tr[data-word={name}]").evaluate(cells)
            assert int(shown[str(clock)]) == int(row[name]), (clock, name)
    # The pixel that was clicked comes out with the colour that the picture has.
    pixel = picture_of(page)[y, x]
    place = page.evaluate("([x, y]) => blysk.inside.spans.codes.x[blysk.inside.span]", [x, y])
    clock = int(run.cycles[own][x - place])
    for name, value in zip("rgb", pixel, strict=True):
        assert int(page.locator(f"#wave tr[data-word={name}]").evaluate(cells)[str(clock)]) == value
    assert int(page.locator("#wave tr[data-word=x]").evaluate(cells)[str(clock)]) == x


def test_exact_values_are_near(open_page):
    """On every clock, each word that belongs to a pixel is what its exact value says, to some steps."""
    page = open_page()
    for method, model in (("chord", "cosquad"), ("chord", "exp"), ("linear", "cosquad")):
        change(page, "method", method)
        change(page, "model", model)
        looked_at(page)
        script = """() => {
            const {inside} = blysk;
            const found = [];
            for (const probe of inside.design.probes)
                for (let clock = inside.firstClock; clock <= inside.lastClock; clock++) {
                    const word = blysk.wordAt(inside, probe, clock);
                    const {value, exact, pixel} = word;
                    if (exact !== null) found.push([probe.name, clock, pixel, value, exact]);
                }
            return found;
        }"""
        found = page.evaluate(script)
        names = {name for name, *_ in found}
        sums = "highlight_0_sum" if method == "chord" else "normal_2_sum"
        assert {
            "cosine",
            "highlight",
            "argument",
            "product",
            "diffuse",
            "specular",
            "red",
            "r",
            sums,
        } <= names
        assert ("square" in names) == (model == "cosquad")
        assert max(row[4] for row in found if row[0] == "specular") > 0.5
        for name, clock, pixel, value, exact in found:
            # What a step of a normal's component makes of a word, at the exponent of the page.
            limit = 1.0 if name in "rgb" else 0.3 if name.startswith("red") else 1e-4
            if name in ("product", "base", "square", "specular"):
                limit = 1e-3
            assert abs(value - exact) < limit, (method, model, name, clock, pixel, value, exact)
        page.locator("#again").click()
        settle(page)


def test_step_through_a_span(open_page):
    page = open_page()
    looked_at(page)
    shown = page.locator("#clock-text")
    start = page.evaluate("() => blysk.inside.clock")
    chips = page.locator("[data-stage=light] .track i.own")
    before = chips.evaluate_all(
        "dots => Object.fromEntries(dots.map(d => [d.textContent, parseFloat(d.style.left)]))"
    )
    assert before
    page.locator("#step").click()
    assert shown.inner_text().startswith(f"{start + 1} ")
    after = chips.evaluate_all(
        "dots => Object.fromEntries(dots.map(d => [d.textContent, parseFloat(d.style.left)]))"
    )
    moved = set(before) & set(after)
    assert moved
    assert all(after[name] > before[name] for name in moved)
    code = page.locator("#pipeline tr[data-word=cosine] td[data-code]")
    same = page.locator(f"#wave tr[data-word=cosine] td[data-clock='{start + 1}']")
    assert code.get_attribute("data-code") == same.get_attribute("data-code")
    assert page.locator("#wave td.now").count() == page.locator("#wave tbody tr").count()
    page.locator("#back").click()
    page.locator("#back").press("Enter")
    assert shown.inner_text().startswith(f"{start - 1} ")
    page.locator("#first").click()
    assert page.locator("#back").is_disabled()
    assert page.locator("[data-stage=setup] .track i.token").count() == 1
    page.locator("#wave").press("ArrowRight")
    first = page.evaluate("() => blysk.inside.firstClock")
    assert shown.inner_text().startswith(f"{first + 1} ")
    page.locator(f"#wave th button[data-clock='{first + 5}']").click()
    assert shown.inner_text().startswith(f"{first + 5} ")
    page.locator("#play").click()
    page.wait_for_function(f"() => blysk.inside.clock > {first + 6}")
    page.locator("#play").click()
    # Another light is another frame: what was inside is gone.
    change(page, "ambient", 0.2)
    assert page.locator("#inside").is_hidden()


def test_keyboard(open_page):
    page = open_page()
    before = state_of(page)["direction"]
    page.locator("#frame").focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowDown"):
        page.keyboard.press(key)
    settle(page)
    assert state_of(page)["direction"] != before
    assert digest(picture_of(page)) == digest(by_model(state_of(page)))
    page.keyboard.press("Enter")
    page.wait_for_selector("body[data-inside]")
    assert page.locator("#inside").is_visible()
    # All that can be done is reached by the Tab key.
    reached = set()
    for _ in range(40):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("() => document.activeElement.id"))
    assert {
        "method",
        "model",
        "mesh",
        "exponent",
        "color",
        "orbit",
        "slow",
        "step",
        "clock",
        "wave",
    } <= reached


def test_empty_place(open_page):
    page = open_page()
    page.evaluate("() => blysk.look(2, 3)")
    assert "no surface at column 2, row 3" in page.locator("#inside-title").inner_text()
    page.evaluate("() => blysk.setClock(4)")


def test_light_goes_round(open_page):
    page = open_page()
    count = page.evaluate("() => blysk.frames")
    page.locator("#orbit").click()
    page.wait_for_function(f"() => blysk.frames > {count + 5}")
    assert page.locator("#orbit").get_attribute("aria-pressed") == "true"
    page.locator("#orbit").click()
    settle(page)
    assert digest(picture_of(page)) == digest(by_model(state_of(page)))


def test_page_stays_free_while_the_worker_simulates(open_page):
    """The browser draws all through one long frame: that of fifty times the spans."""
    page = open_page()
    assert len(page.workers) == 1
    _, _, frame = prepared(state_of(page))
    often = np.tile(np.arange(len(frame.spans)), 50)
    data = web_data.encode(frame.spans[often], np.tile(frame.cut_raster.visible, 50))
    script = """async data => {
        const bytes = await blysk.core.unpacked(data);
        await blysk.ask('spans', {name: 'long', bytes});
        const settings = {...blysk.settingsNow(), spans: 'long'};
        const model = {kind: 'exp'};
        let [last, longest, drawn, busy] = [performance.now(), 0, 0, true];
        const draw = () => {
            const now = performance.now();
            [longest, last, drawn] = [Math.max(longest, now - last), now, drawn + 1];
            if (busy) requestAnimationFrame(draw);
        };
        requestAnimationFrame(draw);
        const {figures} = await blysk.ask('frame', {settings, model});
        busy = false;
        longest = Math.max(longest, performance.now() - last);
        return {longest, drawn, pixels: figures.pixels, job: figures.milliseconds};
    }"""
    found = page.evaluate(script, base64.b64encode(data).decode())
    assert found["pixels"] == 50 * len(frame.cut_raster.span)
    assert found["longest"] < found["job"] / 4, found
    assert found["drawn"] > 4


COARSE = """
    const told = performance.now.bind(performance);
    performance.now = () => Math.floor(told() / 100) * 100;
"""


def test_coarse_clock(open_page):
    """A browser that tells the time in steps of 100 ms, in the worker too."""
    in_worker = """
        const Plain = Blob;
        window.Blob = class extends Plain {
            constructor(parts, options) {
                super(options?.type === 'text/javascript' ? [coarse, ...parts] : parts, options);
            }
        };
    """
    page = open_page(script=f"{COARSE} const coarse = {json.dumps(COARSE)}; {in_worker}")
    seconds = []
    for step in range(40):
        change(page, "ambient", step / 100)
        seconds.append(page.evaluate("() => blysk.latest.figures.seconds"))
        texts = page.locator("#figures dd").all_inner_texts()
        assert not any("NaN" in text or "∞" in text or "Infinity" in text for text in texts)
        if not seconds[-1]:
            break
    assert not np.any(np.round(10 * np.array(seconds), 6) % 1)
    assert seconds[-1] == 0
    assert page.locator("[data-figure=speed]").inner_text() == "–"
    assert page.locator("#failure").is_hidden()
    page.locator("#orbit").click()
    count = page.evaluate("() => blysk.frames")
    page.wait_for_function(f"() => blysk.frames > {count + 30}")
    page.locator("#orbit").click()
    settle(page)
    rate = page.locator("[data-figure=rate]").inner_text()
    assert rate == "–" or 0 < float(rate) < 1000
    assert digest(picture_of(page)) == digest(by_model(state_of(page)))


def test_watch_it_being_shaded(open_page):
    page = open_page()
    whole = digest(picture_of(page))
    page.locator("#slow").click()
    page.wait_for_timeout(300)
    part = picture_of(page)
    assert digest(part) != whole
    page.locator("#slow").click()
    page.wait_for_timeout(50)
    assert digest(picture_of(page)) == whole


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_fits_its_window(open_page, width, scheme):
    page = open_page(width, color_scheme=scheme)
    looked_at(page)
    overflow = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert page.evaluate(overflow) <= 0
    for name in ("method", "exponent", "orbit", "step", "wave"):
        box = page.locator(f"#{name}").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= WIDTHS[width][0]
        assert name == "exponent" or box["height"] >= 24
    background = page.evaluate("() => getComputedStyle(document.body).backgroundColor")
    dark = sum(map(int, background[4:-1].split(","))) < 3 * 128
    assert dark == (scheme == "dark")


def test_from_a_web_server(browser, site):
    """A static host, which sends files as they are."""

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *arguments):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=site)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        context = browser.new_context()
        page = context.new_page()
        errors = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
        page.wait_for_selector("body[data-frame]", timeout=30_000)
        image = picture_of(page)
        state = state_of(page)
        context.close()
        server.shutdown()
    assert errors == []
    assert digest(image) == digest(by_model(state))


def test_without_webassembly(open_page):
    page = open_page(script="delete window.WebAssembly", waits=False)
    assert page.locator("#failure").inner_text().startswith("This browser has no WebAssembly")
    assert page.locator("#view").is_hidden()
    assert page.get_by_text("To install it").is_visible()


def test_without_scripts(open_page):
    page = open_page(waits=False, java_script_enabled=False)
    assert page.get_by_text("The live view needs JavaScript and WebAssembly.").is_visible()


def test_missing_file_is_told(open_page, site):
    kept = site / "models" / "exp.js"
    text = kept.read_text()
    kept.unlink()
    try:
        page = open_page(waits=True)
        # The browser says so on its console, too.
        open_page.allowed = "ERR_FILE_NOT_FOUND"
        page.locator("#model").select_option("exp")
        page.wait_for_selector("#failure:not([hidden])")
        assert "models/exp.js is missing" in page.locator("#failure").inner_text()
    finally:
        kept.write_text(text)
