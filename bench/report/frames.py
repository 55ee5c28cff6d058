"""Frames of methods, baselines and variants as published: errors, run times and pictures."""

import base64
import hashlib
import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache, partial
from typing import Any

import numpy as np
from PIL import Image

from blysk.bench import accuracy
from blysk.bench.accuracy import scene_for
from blysk.bench.report.perception import (
    identical_to_the_eye,
    perceived,
)
from blysk.bench.speed.cycle_model import frame_cycles, unit_of
from blysk.bench.speed.renderer_times import timed
from blysk.golden.frames.border import border_mask
from blysk.golden.frames.compare import method_in_float64
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.prepare import prepare
from blysk.golden.methods.interpolator import Operand
from blysk.golden.presets import LOBES, MIRROR_LOBES, MODELS, preset
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.metrics import error_figures
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import encode
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.errors import InputError
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.mesh import load_mesh

__all__ = [
    "ERRORS",
    "EXPONENTS",
    "STEPS",
    "TIMES",
    "frames",
    "hardware",
    "map_colors",
    "scenes_of",
    "software_frames",
    "software_speeds",
    "speeds",
    "view_of",
]


EXPONENTS = accuracy.EXPONENTS
"""Exponents of the full report."""

_KINDS = {
    "model": "model error",
    "arithmetic": "arithmetic error",
    "method": "method error",
    "total": "total error",
}

_FIGURES = {
    "max_lsb": ("largest", "LSB", "less"),
    "p999_lsb": ("99.9th percentile", "LSB", "less"),
    "rmse_lsb": ("RMSE", "LSB", "less"),
    "psnr_db": ("PSNR", "dB", "more"),
}

_PERCEIVED = {
    "flip_p99": ("FLIP, 99th percentile", "", "less"),
    "flip_max": ("FLIP, largest", "", "less"),
    "ciede2000_p99": ("CIEDE2000, 99th percentile", "", "less"),
    "ciede2000_max": ("CIEDE2000, largest", "", "less"),
}


def _axes(kinds: Iterable[str], figures: Mapping[str, tuple[str, str, str]]) -> Iterator[dict[str, str]]:
    for kind in kinds:
        for key, (title, unit, better) in figures.items():
            yield {
                "key": f"{kind}_{key}",
                "title": f"{_KINDS[kind]}, {title}",
                "unit": unit,
                "better": better,
            }


ERRORS = [*_axes(("total", "method", "arithmetic", "model"), _FIGURES | _PERCEIVED)]
"""Measures of error: key, title, unit, and whether ``"less"`` or ``"more"`` is better."""

TIMES = [
    {"key": key, "title": title, "unit": unit, "better": better}
    for key, title, unit, better in (
        ("cycles_per_pixel", "hardware, cycles", "cycles a pixel", "less"),
        ("ns_per_pixel", "hardware, at the clock rate after place and route", "ns a pixel", "less"),
        ("multipliers", "multipliers of 18x18 bits", "", "less"),
        ("luts", "look-up tables after place and route", "LUT", "less"),
        ("simulated_pixels_per_second", "simulation of the hardware", "pixels a second", "more"),
        ("golden_ns_per_pixel", "method and model in float64 NumPy", "ns a pixel", "less"),
    )
]
"""Measures of run time and cost, in the form of `ERRORS`."""

_REPEATS = 3

_SIDE = 280
"""Largest width of the embedded pictures."""

STEPS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 255.0)
"""Largest error, in LSB, of each colour of an error map. The first is the error of correct rounding."""


# Measurements.


@lru_cache(maxsize=2)
def _mesh(source: str, triangles: int | None) -> Mesh:
    options = {} if triangles is None else {"triangles": triangles}
    return load_mesh(source, materials=False, **options).mesh


def _digest(mesh: Mesh) -> str:
    parts = (mesh.vertices, mesh.faces, mesh.normals)
    return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).hexdigest()


def scenes_of(view: Mapping[str, Any], exponents: Sequence[int]) -> list[Scene]:
    """Scenes of `scene_for` for a view of `view_of`, one for each exponent."""
    mesh = _mesh(view["source"], view["triangles"])
    return [scene_for(mesh, exponent, view["width"], view["height"]) for exponent in exponents]


def frames(
    method: str,
    model: str,
    view: Mapping[str, Any],
    exponents: Sequence[int],
    simulated: bool,
    operand: Operand | None = None,
    lanes: int = 1,
) -> list[dict[str, Any]]:
    """Frames of a design: their errors, cycles and pictures.

    Frames have codes of linear light, and errors are differences of these codes. Verdicts and perceived
    differences are of the frames encoded as sRGB. Each error is between two images, over the pixels that show
    the surface:

    - ``model``: Phong shading with the design's model, against Phong shading with Blinn's model, both in
      float64. Phong shading interpolates normals over the triangle, and normalises them at every pixel, as on
      a GPU. The error does not depend on the arithmetic. A model of R·V approximates no other model, so its
      error is 0;
    - ``arithmetic``: the frame against the same method and model in float64. Errors from coefficients as
      published count as arithmetic error;
    - ``method``: the frame against Phong shading with the same model;
    - ``total``: the frame against the exact frame. This is Phong shading with Blinn's model. For a model of
      R·V it is Phong shading with the design's own model.

    Parameters
    ----------
    method, model : str
        Method and model of a `ShadingPipeline`.
    view : dict
        ``source`` and ``triangles`` of the mesh (see `load_mesh`; ``None`` for a file), and ``width`` and
        ``height`` of the picture. ``digest`` is a hash of the arrays of the mesh. It is a part of the key of
        the result in the cache.
    exponents : sequence of int
        Exponents, with a frame for each.
    simulated : bool
        Whether the frames are simulated. Else the bit-accurate model computes the same frames.
    operand : str, optional
        Operand of the specular unit, if it is not the method's operand.
    lanes : int
        Lanes of the pipeline.

    Returns
    -------
    list of dict
        For each exponent:

        - ``settings``;
        - ``errors``, with the keys of `ERRORS`. Equal images have no PSNR;
        - ``verdicts``: whether both images look identical, by kind of error;
        - ``border``: ``pixels`` of `border_mask`, and ``lsb``, the largest total error of these pixels;
        - ``pictures``, see `section`;
        - ``pixels``: shaded pixels, ``shown``: shown pixels, ``spans`` and ``out_of_range_spans``;
        - ``cycles``: ``None`` if not simulated, and ``modelled_cycles``: by `frame_cycles`.
    """
    design = preset(method, model, operand=operand).built(lanes=lanes)
    simulator = FrameSimulator(design, "cxxrtl") if simulated else None
    results = []
    for scene in scenes_of(view, exponents):
        frame = simulator.render(scene) if simulator else model_frame(scene, design)
        same_method = method_in_float64(scene, design, frame.cut_raster)
        writes = frame.prepared.writes
        names = {"method": method, "model": model, "engine": simulator.engine if simulator else "model"}
        names |= {"operand": operand} if operand else {}
        names |= {"lanes": lanes} if lanes > 1 else {}
        results.append(
            {
                "settings": {**_settings(view, scene), **names},
                **_judged(view, scene, frame.raster, frame.image, same_method, model),
                "pixels": frame.pixels,
                "spans": frame.spans,
                "out_of_range_spans": frame.out_of_range_spans,
                "cycles": frame.cycles if simulated else None,
                "modelled_cycles": frame_cycles(unit_of(design), frame.prepared.spans, writes),
            }
        )
    return results


def software_frames(shading: str, view: Mapping[str, Any], exponents: Sequence[int]) -> list[dict[str, Any]]:
    """Frames of the golden renderer with Blinn's model, rounded to 8 bits: errors and pictures.

    The errors are as in `frames`. The model error is 0. The arithmetic error is the rounding of the frame.

    Parameters
    ----------
    shading : str
        One of `SHADINGS`.
    view, exponents
        As in `frames`.

    Returns
    -------
    list of dict
        As from `frames`, without cycles.
    """
    results = []
    for scene in scenes_of(view, exponents):
        raster = rasterise(scene)
        own = render(scene, shading, REFLECTION_MODELS["blinn"], raster=raster)
        image = np.floor(own.image * 255 + 0.5).astype(np.uint8)
        names = {"method": shading, "model": "blinn", "engine": "float64"}
        results.append(
            {
                "settings": {**_settings(view, scene), **names},
                **_judged(view, scene, raster, image, own.image, "blinn"),
                "pixels": len(raster.span),
                "spans": len(raster.length),
                "out_of_range_spans": 0,
                "cycles": None,
            }
        )
    return results


def _settings(view: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    return {
        **view,
        "exponent": scene.material.exponent,
        "ambient": scene.material.ambient[0],
        "diffuse": scene.material.diffuse[0],
        "specular": scene.material.specular[0],
        "light": list(scene.lights[0].direction),
        "camera": asdict(scene.camera),
        "background": list(scene.background),
        "back_faces": scene.back_faces,
    }


def _judged(
    view: Mapping[str, Any],
    scene: Scene,
    raster: Raster,
    image: np.ndarray,
    same_method: np.ndarray,
    model: str,
) -> dict[str, Any]:
    """Every error of a frame, its verdicts and its pictures."""
    own = (MODELS | LOBES | MIRROR_LOBES)[model].reflection
    exact = render(scene, "phong", own if own.MIRROR else REFLECTION_MODELS["blinn"], raster=raster)
    if not exact.mask.any():
        size = f"{scene.width}x{scene.height}"
        raise InputError(view["source"], f"no pixel shows the surface at {size}", "choose another mesh")
    golden = render(scene, "phong", own, raster=raster).image
    pairs = {
        "model": (golden * 255, exact.image),
        "arithmetic": (image, same_method),
        "method": (image, golden),
        "total": (image, exact.image),
    }
    border = border_mask(scene, raster, own)
    at_border = np.abs(image[border] - 255 * exact.image[border])
    values, verdicts = {}, {}
    for kind, (shown, reference) in pairs.items():
        figures = error_figures(shown, reference * 255, exact.mask)
        values |= {f"{kind}_{key}": value for key, value in asdict(figures).items()}
        # A monitor takes codes of sRGB.
        codes = [255 * encode(light) for light in (shown / 255, reference)]
        difference = perceived(*codes, exact.mask)
        values |= {f"{kind}_{key}": value for key, value in asdict(difference).items()}
        verdicts[kind] = identical_to_the_eye(error_figures(*codes, exact.mask).max_lsb, difference)
    return {
        "errors": {key: value if math.isfinite(value) else None for key, value in values.items()},
        "verdicts": verdicts,
        "border": {"pixels": int(np.count_nonzero(border)), "lsb": float(at_border.max(initial=0))},
        "pictures": _pictures(image, {"error": golden, "total": exact.image}, exact.mask),
        "shown": int(np.count_nonzero(exact.mask)),
    }


def hardware(method: str, model: str, operand: Operand | None = None, lanes: int = 1) -> dict[str, int]:
    """Resources of a design's pipeline before technology mapping, and its ``latency`` in cycles.

    Returns
    -------
    dict
        See `Cost.totals`.
    """
    unit = ShadingPipelineUnit(preset(method, model, operand=operand).built(lanes=lanes))
    return cost_of(unit).totals | {"latency": unit.latency}


def speeds(
    method: str,
    model: str,
    view: Mapping[str, Any],
    exponents: Sequence[int],
    simulated: bool,
    operand: Operand | None = None,
    lanes: int = 1,
) -> list[dict[str, float | None]]:
    """Run times of a design in software, the best of three.

    Parameters
    ----------
    method, model, view, exponents, simulated, operand, lanes
        As in `frames`.

    Returns
    -------
    list of dict
        For each exponent:

        - ``simulated_pixels_per_second``: output pixels of the simulated pipeline in a second of simulation,
          hidden pixels among them. ``None`` if not simulated;
        - ``golden_ns_per_pixel``: nanoseconds a shown pixel to shade the same spans by the same method and
          model in float64 NumPy.
    """
    design = preset(method, model, operand=operand).built(lanes=lanes)
    simulator = FrameSimulator(design, "cxxrtl") if simulated else None
    results = []
    for scene in scenes_of(view, exponents):
        prepared = prepare(scene, design)
        rates = []
        for _ in range(_REPEATS if simulator else 0):
            frame = simulator.render(scene)
            rates.append(frame.pixels / frame.seconds["simulate"])
        timing, _ = timed(partial(method_in_float64, scene, design, prepared.cut_raster), _REPEATS)
        results.append(
            {
                "simulated_pixels_per_second": max(rates, default=None),
                "golden_ns_per_pixel": _ns(timing.one_core, prepared.raster),
            }
        )
    return results


def software_speeds(
    shading: str, view: Mapping[str, Any], exponents: Sequence[int]
) -> list[dict[str, float | None]]:
    """Run times of `software_frames`, in the form of `speeds`."""
    results = []
    for scene in scenes_of(view, exponents):
        raster = rasterise(scene)
        timing, _ = timed(
            partial(render, scene, shading, REFLECTION_MODELS["blinn"], raster=raster), _REPEATS
        )
        results.append(
            {
                "simulated_pixels_per_second": None,
                "golden_ns_per_pixel": _ns(timing.one_core, raster),
            }
        )
    return results


def _ns(seconds: float, raster: Raster) -> float:
    return seconds * 1e9 / int(np.count_nonzero(raster.visible))


# Pictures.


def _png(picture: Image.Image, **options: Any) -> str:
    buffer = io.BytesIO()
    picture.save(buffer, "png", optimize=True, **options)
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"


def map_colors() -> list[list[int]]:
    """Red, green and blue of each of `STEPS`."""
    from matplotlib import colormaps

    return (colormaps["viridis"](np.linspace(0, 1, len(STEPS)))[:, :3] * 255).round().astype(int).tolist()


def _pictures(image: np.ndarray, references: Mapping[str, np.ndarray], mask: np.ndarray) -> dict[str, Any]:
    """The frame and its error maps, cropped to the object, and at most `_SIDE` wide."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    shown = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    factor = -(-(columns[-1] + 1 - columns[0]) // _SIDE)
    # `scene_for` has white light on a grey surface, so all channels are equal.
    pictures = {"frame": _png(Image.fromarray(image[shown]).convert("L").reduce(factor))}
    inside = _largest(mask[shown].astype(np.float64), factor) > 0
    for name, reference in references.items():
        error = _largest(np.abs(image - reference * 255).max(axis=-1)[shown] * mask[shown], factor)
        codes = np.where(inside, np.searchsorted(STEPS, error), len(STEPS)).astype(np.uint8)
        picture = Image.fromarray(codes).convert("P")
        picture.putpalette(np.ravel([*map_colors(), [0, 0, 0]]).tolist())
        pictures[name] = _png(picture, transparency=len(STEPS), bits=4)
    return pictures


def _largest(values: np.ndarray, factor: int) -> np.ndarray:
    """Largest value of each square of pixels. So an error stays visible in a smaller picture."""
    height, width = (-(-side // factor) for side in values.shape)
    padded = np.zeros((height * factor, width * factor))
    padded[: values.shape[0], : values.shape[1]] = values
    return padded.reshape(height, factor, width, factor).max(axis=(1, 3))


def view_of(source: str, triangles: int, width: int, height: int) -> dict[str, Any]:
    """View of frames, as settings of a `Task`: a mesh, its hash, and a size.

    Parameters
    ----------
    source : str
        ``"teapot"`` or a mesh file.
    triangles : int
        Approximate number of triangles of the teapot.
    width, height : int
        Size of the picture.

    Raises
    ------
    InputError
        If the mesh cannot be read.
    """
    triangles = triangles if source == "teapot" else None
    digest = _digest(_mesh(source, triangles))
    return {"source": source, "triangles": triangles, "digest": digest, "width": width, "height": height}
