"""Data of the live page: meshes and views, spans, WebAssembly modules, tables of formats and models."""

import base64
import inspect
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from blysk.bench import accuracy
from blysk.bench.web.web_designs import ALBEDO, COLORED
from blysk.bench.web.web_meshes import MESHES
from blysk.bench.web.web_spans import encode
from blysk.golden.cosines.quotient_spans import MARGIN, QuotientSpans, SpanVectors
from blysk.golden.frame_constants import (
    EMISSION_ADDRESS,
    FIELDS_OF_A_FRAME,
    FIELDS_OF_A_LIGHT,
    LIGHT_STRIDE,
    LOBE_ADDRESS,
    TEXEL_ADDRESS,
    TEXELS_ADDRESS,
    TEXTURE_ADDRESS,
    THRESHOLD_ADDRESS,
    FrameConstants,
)
from blysk.golden.frames.cut import cut_spans
from blysk.golden.frames.local import line_ends
from blysk.golden.frames.prepare import quantise_spans, spans_for, with_tables
from blysk.golden.frames.surface import span_attributes, with_albedo
from blysk.golden.frames.vector_axes import vector_axes
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.normals.line_setup import quantise_line
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.presets import LOBES, METHODS, MIRROR_LOBES, MODELS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.lobes import GGX
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.reflection import (
    AngleCosine,
    PolynomialModel,
    PowerModel,
)
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import color_of_text
from blysk.sim.engines.engine import StopReason
from blysk.sim.engines.probes import ObservedPipeline, probes_of
from blysk.sim.engines.wasm import build, format_of, ports_of
from blysk.sim.frames.animation import turntable

__all__ = [
    "BACKGROUND",
    "BANDS",
    "HEIGHT",
    "REFERENCES",
    "RIVAL",
    "ROUGHNESSES",
    "START",
    "WIDTH",
    "design_of",
    "lobe_of",
    "method",
    "model_table",
    "module_of",
    "scene_of",
    "spans_of",
    "streams_of",
    "tables",
    "texture_of",
    "with_vectors",
]


WIDTH, HEIGHT = 320, 240
"""Size of the pictures."""

BANDS = (100, MAX_EXPONENT)
"""Exponents for which spans are cut. A frame uses the smallest exponent that is at least its own."""

ROUGHNESSES = tuple(round(step / 100, 2) for step in range(10, 101))
"""Roughnesses that a model with a roughness may have."""

BACKGROUND = "#1a1c20"

START = {
    "mesh": "teapot",
    "view": 0,
    "method": "quotient",
    "model": "blinn",
    "reference": "method",
    "compare": "exact",
    "direction": [-0.5, 0.8, 0.7],
    "exponent": 50,
    "roughness": 0.3,
    "ambient": 0.08,
    "diffuse": 0.75,
    "specular": 0.6,
    "color": "#ff8f44",
    "light": "#ffffff",
}
"""Settings of the page at its start."""

RIVAL = "linear"
"""Method that the page compares a frame with. It also runs as simulated hardware."""

REFERENCES = {
    "method": {
        "title": "exact normals, same model",
        "text": "The reference has the exact, perspective-correct normal of every pixel and the same "
        "reflection model. The error is the error of the method and of its arithmetic.",
        "curve": "exact",
        "model": None,
    },
    "arithmetic": {
        "title": "same method and model",
        "text": "The reference is the same method and model in float64. The error comes from the limited "
        "widths of the words. Correct rounding gives up to 0.5 LSB.",
        "curve": None,
        "model": None,
    },
    "total": {
        "title": "exact normals, exact model",
        "text": "The reference has the exact normal of every pixel and an exact model. Designs with phong or "
        "ggx are compared with their own model, all other designs with Blinn's power.",
        "curve": "exact",
        "model": "blinn",
    },
}
"""References for comparison with the frame. ``None`` stands for the design's own curve or model."""


def design_of(method: str, model: str, albedo: bool = False) -> ShadingPipeline:
    """The pipeline of a module: one light, sRGB, and a highlight gate if the method can have one.

    With ``albedo`` it also has the path `ALBEDO`.
    """
    gate = METHODS[method].serves_gate
    return preset(method, model, gate=gate, transfer="srgb", albedo=ALBEDO if albedo else None)


@cache
def _cameras(mesh: str) -> list[Camera]:
    body = MESHES[mesh]
    camera = Camera.framing(
        body.make().vertices, (0.4, 0.5, 1.0), "perspective", WIDTH / HEIGHT, margin=body.margin
    )
    return turntable(camera, body.views)


def _channels(color: str) -> tuple[float, ...]:
    return tuple(color_of_text(color))


def scene_of(settings: Mapping[str, Any]) -> Scene:
    """Scene of the page's settings.

    Parameters
    ----------
    settings : mapping
        Settings in the form of `START`.
    """
    color = np.array(_channels(settings["color"]))
    return Scene(
        mesh=MESHES[settings["mesh"]].make(),
        camera=_cameras(settings["mesh"])[settings["view"]],
        width=WIDTH,
        height=HEIGHT,
        material=Material(
            tuple(settings["ambient"] * color),
            tuple(settings["diffuse"] * color),
            (settings["specular"],) * 3,
            settings["exponent"],
            settings["roughness"],
            texture=MESHES[settings["mesh"]].texture,
        ),
        lights=[Light(tuple(settings["direction"]), _channels(settings["light"]))],
        background=_channels(BACKGROUND),
    )


# Data of the page.


def spans_of(mesh: str, view: int, exponent: int, design: ShadingPipeline) -> tuple[Raster, Spans]:
    """Spans of a view for a light that moves, as float64 raster and with rounded normals.

    The spans are cut for the light of `START`. If the method takes vectors, the spans have the ends of the
    true line in the scene's frame; see `with_vectors`.

    Parameters
    ----------
    mesh, view
        As in `streams_of`.
    exponent : int
        One of `BANDS`.
    design : ShadingPipeline
        The pipeline.
    """
    scene = scene_of(START | {"mesh": mesh, "view": view, "exponent": exponent})
    raster = rasterise(scene)
    cut, _ = cut_spans(scene, raster, design)
    if design.interpolator.brings_ends:
        return cut, spans_for(scene, cut, design)
    left, right = quantise_line(*line_ends(cut))
    spans = replace(quantise_spans(cut, scene.mesh.material), normal_left=left, normal_right=right)
    if design.albedo is not None:
        spans = replace(spans, attributes=span_attributes(scene, cut, design.albedo))
    return cut, spans


def with_vectors(spans: Spans, scene: Scene, design: ShadingPipeline) -> Spans:
    """Spans of `spans_of` for the light of a scene. If the method takes vectors, the vectors are added.

    The page's script computes the same vectors in JavaScript. The order of products and sums here is the
    script's order, so that both round alike.
    """
    if design.interpolator.brings_ends:
        return spans
    axes = vector_axes(scene, design)
    ends = []
    for codes in (spans.normal_left, spans.normal_right):
        x, y, z = (component[:, np.newaxis] for component in codes.astype(np.float64).T)
        ends.append(x * axes[:, 0] + y * axes[:, 1] + z * axes[:, 2])
    return replace(spans, vectors=SpanVectors.quantise(*ends, spans.length))


def streams_of(mesh: str, view: int, methods: Sequence[str]) -> dict[str, Any]:
    """Spans of a view for methods and `BANDS` of exponents.

    Parameters
    ----------
    mesh : str
        One of `MESHES`.
    view : int
        Number of the camera on its turntable.
    methods : sequence of str
        Some of `METHODS`.

    Returns
    -------
    dict
        - ``axes``: axes of the camera, to the right, up, and to the viewer;
        - ``streams``: a list for each method, with an index into ``data`` for each of `BANDS`;
        - ``data``: results of `encode`, in base 64.
    """
    camera = _cameras(mesh)[view]
    found: list[str] = []
    streams: dict[str, list[int]] = {}
    for method in methods:
        albedo = ALBEDO if MESHES[mesh].albedo else None
        design = preset(method, accuracy.model_of(method), transfer="srgb", albedo=albedo)
        streams[method] = []
        for exponent in BANDS:
            cut, spans = spans_of(mesh, view, exponent, design)
            if design.interpolator.curve_is_exact:
                cut = replace(cut, magnitude_left=cut.magnitude_right)
            ratio = cut.magnitude_right / np.where(cut.magnitude_left, cut.magnitude_left, 1.0)
            data = encode(spans, cut.visible, np.where(ratio, ratio, 1.0))
            text = base64.b64encode(data).decode()
            if text not in found:
                found.append(text)
            streams[method].append(found.index(text))
    axes = [*camera.axes[:2].tolist(), camera.viewer.tolist()]
    return {"axes": axes, "streams": streams, "data": found}


def module_of(method: str, model: str, albedo: bool = False) -> dict[str, Any]:
    """The WebAssembly module of a pipeline, and the values needed to use it.

    Parameters
    ----------
    method, model, albedo
        As for `design_of`.

    Returns
    -------
    dict
        - ``wasm``: the module, compressed by zlib, in base 64;
        - ``bytes``: its number of bytes before compression;
        - ``ports``: see `ports_of`;
        - ``probes``: see `probes_of`;
        - ``stages``: name and title of each stage, and a pixel's ages at its entry and exit;
        - ``lobe``: see `lobe_of`;
        - ``vectors``: components of the vectors that spans bring, or ``None``.
    """
    design = design_of(method, model, albedo)
    component = ObservedPipeline(design)
    binary, ports, probes = build(component), ports_of(component), probes_of(component.unit)
    ages = {probe.name: probe.age for probe in probes}
    first, lit, done = min(0, *ages.values()), ages["diffuse"], ages["r"]
    stages = (
        ("interpolator", "Interpolator: normals, or N·L and N·H", first - 1, 0),
        ("light", "Light: diffuse and specular term", 0, lit),
        ("intensity", "Intensity: products, sums, codes of sRGB", lit, done - 1),
        ("output", "Pixel", done - 1, done),
    )
    return {
        "wasm": base64.b64encode(zlib.compress(binary, 9)).decode(),
        "bytes": len(binary),
        "ports": ports,
        "probes": [
            {name: getattr(probe, name) for name in ("name", "title", "block", "age", "exact", "unit")}
            for probe in probes
        ],
        "stages": [dict(zip(("name", "title", "from", "to"), stage, strict=True)) for stage in stages],
        "lobe": lobe_of(design),
        "vectors": None if design.interpolator.brings_ends else list(design.vector_spans.components),
    }


def texture_of(mesh: str) -> dict[str, Any]:
    """The texture of a mesh with an albedo. A mesh without a texture gets a white texel.

    Returns
    -------
    dict
        - ``width`` and ``height`` of the picture;
        - ``picture``: its codes of sRGB, row by row, red, green, blue;
        - ``descriptor``: the two words of `TextureDescriptor`;
        - ``halves``: values of `LoadedTextures.writes`, without the first, which is 0: each 18 bits in 3
          bytes, the lowest first.

        ``picture`` and ``halves`` are compressed by zlib, in base 64.
    """
    scene, design = scene_of(START | {"mesh": mesh}), design_of(*COLORED, albedo=True)
    (constants,) = with_albedo([FrameConstants.of(scene)], scene, design)
    picture = MESHES[mesh].picture
    codes = np.full((1, 1, 3), 255, dtype=np.uint8) if picture is None else picture()
    assert constants.texels is not None
    assert constants.texture is not None
    halves = constants.texels.writes()["value"][1:].astype("<u4").view(np.uint8).reshape(-1, 4)[:, :3]
    packed = {"picture": codes, "halves": np.ascontiguousarray(halves)}
    return {
        **{"width": codes.shape[1], "height": codes.shape[0], "descriptor": constants.texture.words},
        **{name: base64.b64encode(zlib.compress(of.tobytes(), 9)).decode() for name, of in packed.items()},
    }


def lobe_of(design: ShadingPipeline) -> dict[str, Any] | None:
    """Values from which the page makes the table of a lobe. ``None`` if the design loads no table.

    Returns
    -------
    dict
        - ``model``: see `model_table`;
        - ``entries`` and ``middles``: cosines at the entries and in the middle of steps;
        - ``border``: entry at which the second part of a table begins, or ``None``;
        - ``parameter``: name of the model's parameter, and ``parameters``: its possible values;
        - ``exponents`` and ``thresholds``: these fields of `FrameConstants` for each possible value.
    """
    if not design.loads_tables:
        return None
    lobe = design.lobe
    name = lobe.reflection.PARAMETER or "exponent"
    parameters = ROUGHNESSES if name == "roughness" else range(1, MAX_EXPONENT + 1)
    scene = scene_of(START)
    (material,) = scene.materials
    plain = FrameConstants.of(scene)
    found = [with_tables([plain], [replace(material, **{name: of})], design)[0] for of in parameters]
    entries, middles = (cosines.tolist() for cosines in lobe.cosines)
    return {
        "model": model_table(design.model or ""),
        "entries": entries,
        "middles": middles,
        "border": len(lobe.knots) - 1 if lobe.parts == 2 else None,
        "parameter": name,
        "parameters": list(parameters),
        "exponents": [of.exponent for of in found],
        "thresholds": [of.threshold for of in found],
    }


@cache
def model_table(model: str) -> dict[str, Any]:
    """Values of a reflection model in float64: its ``kind``, and slopes or scales for exponents 1 to 1000.

    A power has ``mirror``: whether its base is R·V.
    """
    exponents = range(1, MAX_EXPONENT + 1)
    unit = (MODELS | LOBES | MIRROR_LOBES)[model]
    reflection = unit.reflection
    if isinstance(reflection, PowerModel):
        return {"kind": "power", "mirror": reflection.MIRROR}
    if reflection is GGX:
        return {"kind": "ggx", "parameter": "roughness"}
    if isinstance(reflection, PolynomialModel):
        slopes = [reflection.slope(exponent) for exponent in exponents]
        return {"kind": "line", "power": 1 << unit.squarings, "slopes": slopes}
    found = {"slopes": unit.slopes.values[1 : MAX_EXPONENT + 1].tolist()}
    if isinstance(reflection, AngleCosine):
        scales = [reflection.scale(exponent) for exponent in exponents]
        return found | {"kind": "coscos", "power": reflection.power, "scales": scales}
    return found | {"kind": "exp"}


def tables() -> dict[str, Any]:
    """Formats and addresses of the frame constants, as JSON."""
    return {
        "one": ONE,
        "component": format_of(COMPONENT),
        "color": format_of(Intensity.COLOR_FORMAT),
        "frame": FIELDS_OF_A_FRAME,
        "light": FIELDS_OF_A_LIGHT,
        "stride": LIGHT_STRIDE,
        "lobe": LOBE_ADDRESS,
        "threshold": THRESHOLD_ADDRESS,
        "emission": EMISSION_ADDRESS,
        "texture": TEXTURE_ADDRESS,
        "texels": TEXELS_ADDRESS,
        "texel": TEXEL_ADDRESS,
        "done": int(StopReason.DONE),
        "vector": {
            "fraction": QuotientSpans.COMPONENT_FORMAT.fraction_bits,
            "margin": MARGIN,
            "one": QuotientSpans.ONE,
        },
    }


def method(name: str) -> dict[str, Any]:
    """Values of a method for the page: curve, whether it uses the chord, and a text."""
    interpolator = METHODS[name]
    text = inspect.getdoc(type(interpolator)).split("\n\n")[0]
    return {"curve": interpolator.CURVE, "chord": interpolator.uses_chord, "text": " ".join(text.split())}
