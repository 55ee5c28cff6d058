# amaranth: UnusedElaboratable=no
"""A live page in a browser: its controls, its pictures, and the expected pictures."""

import base64
import hashlib

import numpy as np

from blysk.bench.web import web_data, web_meshes
from blysk.golden.frame_constants import writes_of
from blysk.golden.frames.frame import frame_buffer
from blysk.golden.frames.prepare import PreparedFrame, constants_of
from blysk.sim.engines.compilers import find_compilers
from blysk.sim.engines.probes import ObservedPipeline
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import beats_of


def has_compiler():
    return next(find_compilers(), None) is not None


WIDTHS = {"desktop": (1280, 800), "phone": (375, 740)}

DESIGNS = [("quotient", "blinn"), ("quotient", "phong"), ("quadratic", "cosquad"), ("renormalise", "exp")]
DESIGNS += [("linear", "cosquad"), ("renormalise", "ggx")]

VIEWS = {"teapot": 2, "square": 1, "colored": 1, "textured": 1}

MODULES = [*map("-".join, DESIGNS), "quotient-blinn-albedo"]
"""Modules of the site."""


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


def use(page, method, model):
    """Choose a design of the page."""
    change(page, "method", method)
    change(page, "model", model)


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
    albedo = web_meshes.MESHES[state["mesh"]].albedo
    design = web_data.design_of(state["method"], state["model"], albedo)
    exponent = web_data.BANDS[-1] if state["model"] == "ggx" else state["exponent"]
    band = next(most for most in web_data.BANDS if exponent <= most)
    cut, spans = web_data.spans_of(state["mesh"], state["view"], band, design)
    scene = web_data.scene_of(state)
    spans = web_data.with_vectors(spans, scene, design)
    return scene, design, PreparedFrame(cut, cut, 0, spans, constants_of(scene, design))


UNITS = {}


def natively(state):
    """Frame and run of the native engine."""
    scene, design, frame = prepared(state)
    key = design.method, design.model, design.albedo is None
    unit = UNITS.setdefault(key, ObservedPipeline(design))
    run = simulate(
        unit,
        beats_of(unit.unit, frame.spans),
        count=len(frame.cut_raster.span),
        write=writes_of(constants_of(scene, design)),
        engine="auto",
    )
    colors = np.stack([run.beats[name] for name in "rgb"], axis=-1)
    return frame_buffer(scene, frame.cut_raster, colors, design.transfer), run


def by_model(state):
    scene, design, frame = prepared(state)
    pixels = design.compute(frame.spans, constants_of(scene, design))
    return frame_buffer(scene, frame.cut_raster, pixels.color, design.transfer)


def figure(page, name):
    return float(page.locator(f"[data-figure={name}]").get_attribute("data-value"))


def looked_at(page):
    """Look inside a pixel of a bright place; the words that the page shows for it."""
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
