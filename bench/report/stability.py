"""Stiff and extreme cases: every method in each, as a section of the report (pipeline.md).

A case is a scene and its spans. Every method shades it twice: with the spans as they come, which is what the
pipeline does to somebody who prepares spans without `spans`, and cut first, which is what `blysk` does.
The same functions grade the cases for the report and for the tests.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from amaranth.hdl import Array, Module, ResetInserter, Signal, Value
from amaranth.lib import wiring

from blysk.bench.report.section import Drawing, Grade, Section, Table
from blysk.bench.store import Task
from blysk.bench.tools.pages import svg
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.cut import cut_spans
from blysk.golden.frames.local import local_values
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.methods.interpolator import Operands
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import LENGTH_BITS, pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.pipeline import Design, Spans
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material, halfway_vector, intensity_of_cosines, saturate
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import shade_operands, shade_spans
from blysk.golden.reference.scene import Scene
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import pack
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import beats_of
from blysk.sim.meshes.mesh import load_mesh

__all__ = [
    "ANGLES",
    "EXPONENTS",
    "FACTORS",
    "GOOD",
    "GROUPS",
    "LENGTHS",
    "LENGTH_TOLERANCE",
    "MODEL",
    "QUICK_METHODS",
    "RANGE_EXPONENTS",
    "STREAM_GROUP",
    "SWEEP",
    "SWEEP_EXPONENT",
    "Case",
    "arcs",
    "cases_of",
    "grade_of",
    "measure",
    "measure_case",
    "measure_ranges",
    "measure_stream",
    "section",
    "stream_patterns",
    "tasks",
    "widest_span",
]

GROUPS = {
    1: "exponents",
    2: "angle of a span",
    3: "length of a span",
    4: "the highlight's peak",
    5: "light at the terminator, behind, at the viewer",
    6: "normals that are not of unit length",
    7: "4095 pixels, sums at their largest",
    8: "stalls, back to back, empty spans, reset",
    9: "triangles without area, slivers, at the edges",
    10: "intensities over 1, many lights",
}
"""The groups of pipeline.md."""

STREAM_GROUP = 8
"""The group that is simulated."""

EXPONENTS = (1, 2, 3, 10, 100, 500, 1000)
ANGLES = (0.0, 1e-4, 1.0, 45.0, 89.9, 90.0, 120.0, 180.0)
LENGTHS = (1, 2, 3, 16, 4095)

RANGE_EXPONENTS = (1, 10, 100, 1000)
"""Exponents of the table of safe ranges."""

MODEL = "cosquad"

QUICK_METHODS = ("linear", "quadratic", "chord")
"""Methods of the quick report, and the last of them in simulation."""

SWEEP_EXPONENT = 50
"""Exponent of the spans of `measure_ranges`."""

SWEEP = tuple(np.geomspace(1, 180, 40).round(2).tolist())
"""Their angles in degrees."""

FACTORS = (1.0, 1.2, 2.0)
"""Multiples of the widest span at which a method is tried."""

GOOD = 1.0
"""Largest error in LSB that is good."""

LENGTH_TOLERANCE = 1 / 256
"""How far the length of a normal may be from 1, by the methods' documentation."""

_STYLES = {
    "linear": ("#777777", "-"),
    "bisection": ("#8c564b", "-"),
    "quadratic": ("#1f77b4", "-"),
    "quadratic-eval": ("#17a2c8", "--"),
    "quadratic-horner": ("#0b3d91", ":"),
    "angular": ("#2ca02c", "-"),
    "recurrence": ("#7fb800", "--"),
    "renormalise": ("#9467bd", "-"),
    "chord": ("#d62728", "-"),
    "chord-local": ("#ff7f0e", "--"),
}
"""Colour and dashes of each method's line."""

_LIGHT = normalise((0.3, 0.5, 0.8))
_VIEWER = normalise((-0.2, 0.1, 1.0))
_HALFWAY = halfway_vector(_LIGHT, _VIEWER)
_COLORS = (0.05,) * 3, (0.4,) * 3, (0.55,) * 3
_STEP = COMPONENT.step
# Degrees by which rounding makes a span wider.
_SLACK = 1e-3
# LSB: rounding of an ambient, diffuse and specular colour operand.
_COLOR_ERROR = 3 * Intensity.COLOR_FORMAT.step / 2


@dataclass(frozen=True)
class Case:
    """Spans to be shaded, and in what light.

    Parameters
    ----------
    group : int
        One of `GROUPS`.
    name : str
        What is extreme about it.
    scene : Scene
        Size, material, lights and viewer.
    raster : Raster
        The spans; a reference picture of them has every pixel once.
    codes : pair of int arrays, shape (spans, 3), optional
        Normals that the pipeline gets as they are, where those of the raster, which then are their values,
        are not of unit length.
    """

    group: int
    name: str
    scene: Scene
    raster: Raster
    codes: tuple[np.ndarray, np.ndarray] | None = None


class _Shaded(NamedTuple):
    """By pixel that shows: largest error of a channel in LSB, what is stated, span; by span: flagged."""

    error: np.ndarray
    stated: np.ndarray
    span: np.ndarray
    out_of_range: np.ndarray


def arcs(
    rng: np.random.Generator,
    centre: np.ndarray,
    degrees: np.ndarray,
    at: np.ndarray = 0.5,
    off: np.ndarray = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Ends of spans on great circles, in random planes about a vector.

    Parameters
    ----------
    rng : Generator
        Of the planes.
    centre : array, shape (3,)
        Unit vector.
    degrees : array, shape (spans,)
        Angle between the ends.
    at : array, shape (spans,)
        Share of the span at which it is nearest to the vector; under 0 and over 1 before and behind it.
    off : array, shape (spans,)
        Angle, in degrees, at which it is there.

    Returns
    -------
    left, right : float64 arrays, shape (spans, 3)
    """
    psi, at, off = np.broadcast_arrays(np.radians(degrees), at, np.radians(off))
    side = normalise(np.cross(centre, rng.normal(size=(psi.size, 3))))
    nearest = np.cos(off)[:, np.newaxis] * centre + np.sin(off)[:, np.newaxis] * np.cross(centre, side)
    angles = np.stack([-at * psi, (1 - at) * psi])[..., np.newaxis]
    left, right = nearest * np.cos(angles) + side * np.sin(angles)
    return left, right


def _case(
    group: int,
    name: str,
    ends: tuple[np.ndarray, np.ndarray],
    length: np.ndarray | int,
    exponent: int,
    lights: Sequence[Light] = (Light(tuple(_LIGHT)),),
    viewer: np.ndarray = _VIEWER,
    colors: tuple = _COLORS,
    codes: tuple[np.ndarray, np.ndarray] | None = None,
) -> Case:
    """A case of single spans, each in a row of its own."""
    left, right = ends
    count = len(left)
    length = np.broadcast_to(length, count).astype(np.int32)
    # A pixel alone has one normal.
    right = np.where(length[:, np.newaxis] == 1, left, right)
    span, offset = pixels_of(length)
    width = int(length.max())
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]), np.eye(3))
    scene = Scene(
        mesh, Camera(tuple(viewer), (0, 0, 0)), width, count, Material(*colors, exponent), tuple(lights)
    )
    corner = np.zeros((2, count, 3))
    corner[0, :, 0] = corner[1, :, 1] = 1
    ones, none = np.ones(count), np.zeros(count, dtype=np.int32)
    raster = Raster(
        x=none,
        y=np.arange(count, dtype=np.int32),
        length=length,
        triangle=none,
        normal_left=left,
        normal_right=right,
        magnitude_left=ones,
        magnitude_right=ones,
        weights_left=corner[0],
        weights_right=corner[1],
        back=none.astype(bool),
        span=span.astype(np.int32),
        offset=offset.astype(np.int16),
        pixel=(span * width + offset).astype(np.int32),
        visible=np.ones(len(span), dtype=bool),
        triangles=1,
        **dict.fromkeys(("degenerate", "culled", "outside", "uncovered", "hidden_spans"), 0),
        repaired_normals=0,
    )
    return Case(group, name, scene, raster, codes)


def cases_of(group: int) -> Iterator[Case]:
    """The cases of a group but `STREAM_GROUP`, the same on every call.

    Parameters
    ----------
    group : int
        One of `GROUPS`.
    """
    rng = np.random.default_rng(group)

    def about(degrees, off):
        count = len(degrees)
        return arcs(rng, _HALFWAY, degrees, rng.uniform(0, 1, count), rng.uniform(0, off, count))

    match group:
        case 1:
            for exponent in EXPONENTS:
                # To where the highlight ends.
                off = rng.uniform(0, min(60, 120 / exponent**0.5), 100)
                ends = arcs(rng, _HALFWAY, rng.uniform(0, 44.9, 100), rng.uniform(-0.5, 1.5, 100), off)
                yield _case(1, f"exponent {exponent}", ends, rng.integers(2, 41, 100), exponent)
        case 2:
            for degrees in ANGLES:
                # Of an even number of pixels none is in the middle, where opposite normals have no normal.
                yield _case(2, f"{degrees:g} degrees", about(np.full(60, degrees), 30), 16, 50)
        case 3:
            for length in LENGTHS:
                name = f"{length} pixels" if length > 1 else "1 pixel"
                yield _case(3, name, about(rng.uniform(0, 44.9, 8), 9), length, 100)
        case 4:
            for name, length, at, degrees in (
                ("on a pixel", 17, 0.5, 20),
                ("between two pixels", 16, 0.5, 20),
                ("on the last pixel", 17, 1.0, 20),
                ("narrower than a pixel, on one", 3, 0.5, 40),
                ("narrower than a pixel, between two", 4, 0.5, 40),
                ("highlight inside one span", 65, 0.4, 30),
            ):
                ends = arcs(rng, _HALFWAY, np.full(40, degrees), at)
                yield _case(4, name, ends, length, MAX_EXPONENT)
        case 5:
            yield from _light_cases(rng)
        case 6:
            yield from _length_cases(rng)
        case 7:
            for degrees in (1, 20, 44.9):
                name = f"4095 pixels, {degrees:g} degrees"
                yield _case(7, name, about(np.full(4, degrees), 0), 4095, MAX_EXPONENT)
            axis = np.array([0.0, 0.0, 1.0])
            for name, centre in (("N along L and H", axis), ("N against L and H: 1 - N.H is 2", -axis)):
                ends = arcs(rng, centre, np.full(4, 44.9), (0.0, 0.5, 0.5, 1.0))
                yield _case(7, name, ends, 4095, MAX_EXPONENT, [Light(tuple(axis))], axis)
        case 9:
            yield from _triangle_cases(rng)
        case 10:
            ends = about(rng.uniform(0, 40, 60), 20)
            over = (0.5,) * 3, (0.9,) * 3, (0.8,) * 3
            yield _case(10, "k_a + k_d + k_s = 2.2", ends, 20, 20, colors=over)
            yield _case(10, "light of intensity 3", ends, 20, 20, [Light(tuple(_LIGHT), (3.0,) * 3)])
            around = normalise(_LIGHT + rng.uniform(-0.7, 0.7, (16, 3)))
            for name, share in (("16 lights of intensity 1/16", 1 / 16), ("16 lights of intensity 1", 1.0)):
                yield _case(10, name, ends, 20, 20, [Light(tuple(v), (share,) * 3) for v in around])
        case _:
            raise ValueError(f"group {group} has no spans of its own")


def _light_cases(rng) -> Iterator[Case]:
    viewer = np.array([0.0, 0.0, 1.0])
    side = np.array([1.0, 0.0, 0.0])
    for degrees in (1e-3, 20):
        for exponent in (1, 100):
            # Most normals turn from the light's side, through right angles with it, away.
            ends = arcs(rng, viewer, np.full(40, degrees))
            light = normalise(side + np.radians(degrees / 8) * viewer)
            name = f"terminator in a span of {degrees:g} degrees, exponent {exponent}"
            yield _case(5, name, ends, 64, exponent, [Light(tuple(light))], viewer)
    ends = arcs(rng, viewer, rng.uniform(0, 40, 40), 0.5, rng.uniform(0, 30, 40))
    for name, light in (
        ("light behind", normalise((0.1, 0.2, -1))),
        ("L = -V, no half-way vector", -viewer),
        ("L = V", viewer),
    ):
        yield _case(5, name, ends, 33, 10, [Light(tuple(light))], viewer)


def _length_cases(rng) -> Iterator[Case]:
    def of_codes(name, left, right):
        ends = left / ONE, right / ONE
        return _case(6, name, ends, 9, 10, codes=(left, right))

    ends = arcs(rng, _HALFWAY, rng.uniform(0, 44, 60), rng.uniform(0, 1, 60), rng.uniform(0, 20, 60))
    inside = np.maximum(*np.abs(ends)).max(axis=1) < 0.99
    ends = [end[inside] for end in ends]
    codes = [_codes(end) for end in ends]
    nothing = np.zeros_like(codes[0])
    yield of_codes("both normals 0", nothing, nothing)
    yield of_codes("one normal 0", nothing, codes[1])
    for name, scales in (
        ("length 1 - 1/256", (255 / 256, 255 / 256)),
        ("length 1 + 1/256", (257 / 256, 257 / 256)),
        ("length 1 - 1/256 and 1 + 1/256", (255 / 256, 257 / 256)),
    ):
        yield of_codes(name, *(_codes(end * scale) for end, scale in zip(ends, scales, strict=True)))
    axes = np.vstack([COMPONENT.max_code * np.eye(3, dtype=int), COMPONENT.min_code * np.eye(3, dtype=int)])
    yield of_codes("largest and smallest code of a component", axes, axes)
    pairs = [axes[k] for k in np.nonzero(~np.eye(6, dtype=bool))]
    yield of_codes("the same, 90 and 180 degrees apart", *pairs)
    full = COMPONENT.max_code * np.array([[1, 1, 1], [0, 1, 1], [1, 0, 1]])
    yield of_codes("length sqrt 2 and sqrt 3", full, full[[1, 2, 0]])
    yield _mended_mesh()


def _codes(vectors: np.ndarray) -> np.ndarray:
    """Codes of vectors of any length."""
    return np.floor(vectors * ONE + 0.5).astype(np.int64)


def _mended_mesh() -> Case:
    """A file with normals that are no number, 0 and too long; what the loader makes of them."""
    text = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn nan 0 1\nvn 0 0 0\nvn 0.3 0 3\nvn 0 0.2 1\n"
    with TemporaryDirectory() as folder:
        path = Path(folder, "broken.obj")
        path.write_text(f"{text}f 1//1 2//2 3//3\nf 1//1 3//3 4//4\n", encoding="ascii")
        mesh = load_mesh(str(path)).mesh
    return _scene_case(6, "a mesh with normals NaN, 0 and 3 long", mesh)


def _scene_case(group: int, name: str, mesh: Mesh, camera: Camera | None = None) -> Case:
    camera = camera or Camera.framing(mesh.vertices, tuple(_VIEWER), "perspective", 1.0)
    scene = Scene(mesh, camera, 64, 64, Material(*_COLORS, 50), [Light(tuple(_LIGHT))])
    return Case(group, name, scene, rasterise(scene))


def _triangle_cases(rng) -> Iterator[Case]:
    def bent(vertices, faces):
        vertices = np.array(vertices, dtype=np.float64)
        return Mesh(vertices, np.array(faces), normalise(vertices * (0.5, 0.5, 0) + (0, 0, 1)))

    plate = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    yield _scene_case(9, "two triangles that share an edge", bent(plate, [(0, 1, 2), (0, 2, 3)]))
    flat = bent([*plate, (0, 0, 0)], [(0, 1, 2), (0, 4, 2), (0, 0, 3), (1, 1, 1)])
    yield _scene_case(9, "triangles without area beside one", flat)
    slivers = [(-1, y / 10, 0) for y in range(-9, 10)], [(1, y / 10 + 0.011, 0) for y in range(-9, 10)]
    tips = [(1, y / 10 + 0.012, 0) for y in range(-9, 10)]
    faces = [(k, 19 + k, 38 + k) for k in range(19)]
    yield _scene_case(9, "slivers of under a pixel", bent([*slivers[0], *slivers[1], *tips], faces))
    tall = [(x + dx, y, 0) for x in (-0.8, 0.1, 0.7) for dx, y in ((0, -1), (0.03, -1), (0.3, 1))]
    yield _scene_case(9, "spans of a pixel", bent(tall, np.arange(9).reshape(3, 3)))
    dots = np.add(rng.uniform(-1, 1, (60, 1, 2)), [(0, 0), (0.04, 0), (0, 0.04)])
    dots = np.dstack([dots, np.zeros((60, 3))]).reshape(-1, 3)
    yield _scene_case(9, "triangles of one pixel", bent(dots, np.arange(180).reshape(60, 3)))
    large = bent(np.multiply(plate, 400), [(0, 1, 2), (0, 2, 3)])
    large = replace(large, normals=bent(plate, [(0, 1, 2)]).normals)
    straight = Camera((0, 0, 4), (0, 0, 0), projection="perspective")
    yield _scene_case(9, "mostly off the picture", large, straight)
    low = Camera((0, -0.5, 0.05), (0, 0.5, 0), projection="perspective", field_of_view=90)
    yield _scene_case(9, "through the near plane", bent(plate, [(0, 1, 2), (0, 2, 3)]), low)


def _design(case: Case, method: str) -> Design:
    return preset(method, MODEL, lights=len(case.scene.lights))


def _spans(case: Case, design: Design, raster: Raster, codes: Sequence[np.ndarray]) -> Spans:
    spans = Spans(raster.x, raster.y, raster.length, *codes)
    return replace(spans, values=local_values(case.scene, raster)) if design.takes_values else spans


def _operands(design: Design, spans: Spans, constants: FrameConstants) -> Operands:
    if design.takes_values:
        return design.interpolator.compute_values(spans.values, spans.length)
    vectors = (spans.normal_left, spans.normal_right, constants.direction, constants.halfway)
    left, right, direction, halfway = (Fixed(COMPONENT, codes) for codes in vectors)
    return design.interpolator.compute(left, right, spans.length, direction, halfway)


def _shade(case: Case, design: Design, raster: Raster, codes: Sequence[np.ndarray]) -> _Shaded:
    """Errors of the twin against exactly normalised interpolation in float64."""
    scene, material = case.scene, case.scene.materials[0]
    spans, constants = _spans(case, design, raster, codes), FrameConstants.of(scene)
    color = design.compute(spans, constants).color
    out_of_range = _operands(design, spans, constants).out_of_range

    degrees = np.minimum(_angles(raster), design.interpolator.MAX_ANGLE).max(initial=0)
    error = design.interpolator.operand_error(int(raster.length.max(initial=1)), float(degrees))
    error += min(_length_excess(codes), LENGTH_TOLERANCE)
    shown, whole = raster.visible, case.raster
    t = whole.offset / np.maximum(whole.length[whole.span] - 1, 1)
    normals = interpolate("normalised", whole.normal_left[whole.span], whole.normal_right[whole.span], t)
    direction = np.array([light.direction for light in scene.lights])
    halfway = halfway_vector(direction, scene.camera.viewer)
    cosine, highlight = (normals[shown] @ vectors.T for vectors in (direction, halfway))
    # Where N·L is 0 but for the arithmetic, either side of the terminator is right.
    near = np.abs(cosine) <= error + 3 * _STEP
    exact = [
        saturate(
            intensity_of_cosines(
                material,
                scene.lights,
                scene.ambient_light,
                np.where(near, side, cosine),
                highlight,
                REFLECTION_MODELS[MODEL],
            )
        )
        for side in (0.0, 2.0**-60)
    ]

    if design.takes_values:
        cosine, u = design.interpolator.exact_operands(spans.values, spans.length)
        own = shade_operands(scene, raster, cosine, 1 - u, REFLECTION_MODELS[MODEL])
    else:
        # From the codes on.
        given = replace(raster, normal_left=normalise(codes[0]), normal_right=normalise(codes[1]))
        uses_chord = design.interpolator.uses_chord
        own = shade_spans(
            scene, given, design.interpolator.exact_normals, REFLECTION_MODELS[MODEL], uses_chord
        )
    own = own.reshape(-1, 3)[raster.pixel[shown]] * 255
    light = np.sum([light.color for light in scene.lights], axis=0)
    terms = np.multiply(material.diffuse, error)
    terms = terms + np.multiply(material.specular, material.exponent * error + design.specular.error)
    arithmetic = 0.5 + _COLOR_ERROR * len(direction) + 255 * (light * terms).max()
    found, stated = (
        np.min([np.abs(of - one * 255).max(axis=1) for one in exact], axis=0) for of in (color[shown], own)
    )
    return _Shaded(found, stated + arithmetic, raster.span[shown], out_of_range)


def _angles(raster: Raster) -> np.ndarray:
    """Angles of spans in degrees."""
    half = np.linalg.norm(raster.normal_right - raster.normal_left, axis=1) / 2
    return np.degrees(2 * np.arcsin(np.minimum(half, 1)))


def _length_excess(codes: Sequence[np.ndarray]) -> float:
    """How far the length of a normal is from 1, but for its rounding."""
    lengths = np.linalg.norm(np.concatenate(codes) / ONE, axis=1)
    excess = float(np.abs(lengths - 1).max(initial=0))
    return excess if excess > 2 * _STEP else 0.0


def grade_of(grades: Sequence[Grade]) -> Grade:
    """The worst of some grades; none, of none."""
    order: tuple[Grade, ...] = ("bad", "fair", "good", "")
    return min(grades, key=order.index, default="")


def _figures(shaded: _Shaded, inside: np.ndarray) -> dict[str, Any]:
    """Largest error of a case, that in spans that are not flagged, and its grades."""
    flagged, served = shaded.out_of_range[shaded.span], inside[shaded.span]
    large = shaded.error > GOOD
    bad = large & ~flagged & (~served | (shaded.error > shaded.stated))

    def grade(chosen) -> Grade:
        if not chosen.any():
            return ""
        return "bad" if (bad & chosen).any() else "fair" if (large & chosen).any() else "good"

    return {
        "error": float(shaded.error.max(initial=0)),
        "silent": float(shaded.error[~flagged].max(initial=0)),
        "safe": float(shaded.error[served].max(initial=0)),
        "flagged": int(np.count_nonzero(shaded.out_of_range)),
        "grade": grade(np.ones_like(large)),
        "safe_grade": grade(served),
    }


def measure_case(case: Case, method: str) -> dict[str, Any]:
    """Errors of a method in a case, by the bit-true twin.

    The error is the largest of a channel against exactly normalised interpolation in float64 with the same
    model, in LSB; 0.5 is a correctly rounded pixel. Where N·L is 0 but for the stated errors, lit and dark
    are both right. An error is

    - good to `GOOD`;
    - fair where it is larger but the pipeline flags the span, or the method serves the span and states such
      an error: its own curve in float64 is as far off, and the error bounds of its devices, times the
      exponent in a highlight, come to the rest;
    - bad otherwise: nothing tells of it.

    A method serves spans that `spans` leaves whole, with normals of length 1 within `LENGTH_TOLERANCE`.

    Returns
    -------
    dict
        ``case``; ``spans``; ``inside``, how many of them the method serves; ``cut``, how many are cut; for
        the spans ``given`` as they are, and ``prepared``, cut where need be, dictionaries of ``error``,
        ``silent``, that in spans without a flag, ``safe``, that in the spans that the method serves,
        ``flagged`` spans, ``grade`` and ``safe_grade``, that of the spans that the method serves.
        ``prepared`` is ``None`` where the spans are refused.
    """
    design = _design(case, method)
    # The normals along a span are those of its ends, whatever the perspective.
    ones = np.ones(len(case.raster.length))
    raster = replace(case.raster, magnitude_left=ones, magnitude_right=ones)
    cut, _ = cut_spans(case.scene, case.raster, design)
    first = np.flatnonzero(cut.offset == 0)
    parts = np.bincount(raster.span[first], minlength=len(raster.length))
    codes = case.codes or (quantise(raster.normal_left), quantise(raster.normal_right))
    lengths = np.stack([np.linalg.norm(end / ONE, axis=1) for end in codes])
    inside = parts == 1
    if not design.takes_values:
        widest = design.interpolator.widest_span(case.scene.materials[0].exponent)
        inside = _angles(raster) <= widest + _SLACK
    inside &= (np.abs(lengths - 1) <= LENGTH_TOLERANCE + _STEP).all(axis=0)
    prepared = None
    if case.codes is None:
        ends = quantise(cut.normal_left), quantise(cut.normal_right)
        prepared = _figures(_shade(case, design, cut, ends), np.ones(len(cut.length), dtype=bool))
    return {
        "case": case.name,
        "spans": len(raster.length),
        "inside": int(np.count_nonzero(inside)),
        "cut": int(np.count_nonzero(parts > 1)),
        "given": _figures(_shade(case, design, raster, codes), inside),
        "prepared": prepared,
    }


class _Interrupted(wiring.Component):
    """A pipeline that shades other spans first, and is reset while they are inside."""

    def __init__(self, unit: wiring.Component, before: dict[str, Sequence[int]], cycles: int):
        """Words of ``write`` and ``i`` before the reset, which comes after so many cycles."""
        super().__init__(dict(unit.signature.members))
        self._unit, self._before, self._cycles = unit, before, cycles

    def elaborate(self, platform):
        m = Module()
        reset, begun = Signal(), Signal()
        clock = Signal(range(self._cycles + 1))
        m.submodules.unit = ResetInserter(reset)(self._unit)
        m.d.comb += [begun.eq(clock == self._cycles), reset.eq(clock == self._cycles - 1)]
        with m.If(~begun):
            m.d.sync += clock.eq(clock + 1)
        written = Signal()
        for name, ready in (("write", 1), ("i", written)):
            words, inner, outer = self._before[name], getattr(self._unit, name), getattr(self, name)
            index = Signal(range(len(words) + 1))
            done = index == len(words)
            if name == "write":
                m.d.comb += written.eq(done)
            own = Array(words)[index]
            m.d.comb += [
                Value.cast(inner.payload).eq(Value.cast(outer.payload)),
                inner.valid.eq(begun & outer.valid),
                outer.ready.eq(begun & inner.ready),
            ]
            with m.If(~begun):
                m.d.comb += [Value.cast(inner.payload).eq(own), inner.valid.eq(~done & ready)]
                with m.If(inner.valid & inner.ready):
                    m.d.sync += index.eq(index + 1)
        m.d.comb += [
            Value.cast(self.o.payload).eq(Value.cast(self._unit.o.payload)),
            self.o.valid.eq(begun & self._unit.o.valid),
            self._unit.o.ready.eq(~begun | self.o.ready),
            Value.cast(self.status).eq(Value.cast(self._unit.status)),
        ]
        return m


def _words(shape, beats) -> list[int]:
    return [int.from_bytes(row.astype("<u4").tobytes(), "little") for row in pack(shape, beats)]


def stream_patterns(unit: ShadingPipelineUnit) -> Iterator[tuple[str, dict[str, Any]]]:
    """Names and stalls of the runs of `STREAM_GROUP`: options of `simulate`.

    Random stalls, and a single one on each clock on which something of `measure_stream` moves.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        A pipeline.
    """
    rng = np.random.default_rng(STREAM_GROUP)
    yield "back to back, empty spans between", {}
    for name, shares in (
        ("random stalls on both sides", (0.4, 0.4)),
        ("input mostly stalled", (0.9, 0.1)),
        ("output mostly stalled", (0.1, 0.9)),
    ):
        sides = ("input_stalls", "output_stalls")
        yield name, {side: rng.random(997) < share for side, share in zip(sides, shares, strict=True)}
    cycles = unit.latency + 150
    for side in ("input", "output"):
        for clock in range(cycles):
            yield f"a single stall of the {side}", {f"{side}_stalls": np.arange(1 << 14) == clock}


def measure_stream(method: str, quick: bool) -> list[dict[str, Any]]:
    """Pixels of the simulated pipeline under stalls, between empty spans and after a reset.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    quick : bool
        Whether it is Amaranth's own simulator that takes some patterns; else compiled RTL takes all.

    Returns
    -------
    list of dict
        ``case``; ``runs``; ``pixels`` of a run; ``wrong``, pixels of all runs that are not the twin's, or
        ``None`` where a run came to a halt.
    """
    design = preset(method, MODEL)
    unit = ShadingPipelineUnit(design)
    rng = np.random.default_rng(STREAM_GROUP)
    lengths = np.array([5, 0, 1, 1, 0, 0, 9, 2, 3, 0])
    ends = arcs(rng, _HALFWAY, rng.uniform(0, 8, 10), 0.5, rng.uniform(0, 20, 10))
    case = _case(STREAM_GROUP, "", ends, np.maximum(lengths, 1), 20)
    codes = [quantise(end) for end in ends]
    spans = replace(_spans(case, design, case.raster, codes), length=lengths)
    constants = FrameConstants.of(case.scene)
    expected = design.compute(spans, constants)
    beats, write = beats_of(unit, spans), constants.writes()
    engine = "pysim" if quick else "auto"

    def wrong(component, **options) -> tuple[int | None, str]:
        try:
            run = simulate(component, beats, count=len(expected.x), write=write, **options)
        except SimulationError:
            return None, ""
        pairs = [(run.beats[name], getattr(expected, name)) for name in ("x", "y", "last")]
        pairs += [(run.beats[name], expected.color[:, k]) for k, name in enumerate("rgb")]
        return int(np.count_nonzero(np.any([found != codes for found, codes in pairs], axis=0))), run.engine

    found: dict[str, list[int | None]] = {}
    used = ""
    for name, stalls in stream_patterns(unit):
        # Without a compiler a run takes a second.
        if "single" not in name or used == "cxxrtl":
            count, used = wrong(unit, engine=engine, **stalls)
            found.setdefault(name, []).append(count)
    before = {"write": _words(unit.write.payload.shape(), write)}
    before["i"] = _words(unit.i.payload.shape(), beats) * 8
    loaded = len(before["write"])
    for cycles in (unit.latency + 40,) if quick else (3, unit.latency // 2, unit.latency, unit.latency + 40):
        interrupted = _Interrupted(unit, before, loaded + cycles)
        found.setdefault("reset in mid span", []).append(wrong(interrupted, engine="pysim")[0])
    return [
        {
            "case": name,
            "runs": len(counts),
            "pixels": len(expected.x),
            "wrong": None if None in counts else sum(counts),
        }
        for name, counts in found.items()
    ]


def measure(method: str) -> dict[str, list[dict[str, Any]]]:
    """`measure_case` of a method in the cases of every group but `STREAM_GROUP`, by group."""
    return {
        str(group): [measure_case(case, method) for case in cases_of(group)]
        for group in GROUPS
        if group != STREAM_GROUP
    }


def _span_case(degrees: float, exponent: int, count: int = 30) -> Case:
    rng = np.random.default_rng(exponent)
    off = rng.uniform(0, 100 / exponent**0.5, count) * (exponent > 10)
    ends = arcs(rng, _HALFWAY, np.full(count, degrees), rng.uniform(0, 1, count), off)
    return _case(2, f"{degrees:g} degrees", ends, 16, exponent)


def _flags(method: str, degrees: np.ndarray) -> np.ndarray:
    """Which spans of such angles the pipeline flags."""
    rng = np.random.default_rng(0)
    ends = arcs(rng, _HALFWAY, degrees, rng.uniform(0, 1, len(degrees)), rng.uniform(0, 30, len(degrees)))
    case = _case(2, "", ends, 5, SWEEP_EXPONENT)
    design = _design(case, method)
    spans = _spans(case, design, case.raster, [quantise(end) for end in ends])
    return _operands(design, spans, FrameConstants.of(case.scene)).out_of_range


def widest_span(method: str, exponent: int) -> float:
    """Widest span in degrees that is left whole: of ``chord-local``, none of a sample is cut."""
    if not preset(method, MODEL).takes_values:
        return METHODS[method].widest_span(exponent)
    low, high = 0.0, 45.0
    while high - low > 0.05:
        middle = (low + high) / 2
        case = _span_case(middle, exponent)
        _, cut = cut_spans(case.scene, case.raster, _design(case, method))
        low, high = (low, middle) if cut else (middle, high)
    return low


def measure_ranges(method: str) -> dict[str, Any]:
    """Which spans a method serves, and what it does with wider ones.

    Returns
    -------
    dict
        ``widest``, the widest span by each of `RANGE_EXPONENTS`; ``none_flagged`` and ``all_flagged``, the
        last whole number of degrees to which no span is flagged, and the first from which all are; ``sweep``,
        for each angle of `SWEEP`, `measure_case` of spans at `SWEEP_EXPONENT`; ``outside``, the same at
        `FACTORS` times the widest span, with ``factor`` and ``degrees``.
    """
    sweep = [measure_case(_span_case(degrees, SWEEP_EXPONENT), method) for degrees in SWEEP]
    angles = np.arange(181)
    flagged = np.count_nonzero(_flags(method, np.repeat(angles, 20)).reshape(-1, 20), axis=1)
    widest = {str(exponent): widest_span(method, exponent) for exponent in RANGE_EXPONENTS}
    outside = []
    for factor in FACTORS:
        degrees = factor * widest_span(method, SWEEP_EXPONENT)
        if degrees <= 180:
            found = measure_case(_span_case(degrees, SWEEP_EXPONENT), method)
            outside.append({"factor": factor, "degrees": degrees} | found)
    return {
        "widest": widest,
        "none_flagged": int(np.argmax(flagged > 0)) - 1,
        "all_flagged": int(angles[flagged < 20].max()) + 1,
        "sweep": sweep,
        "outside": outside,
    }


def tasks(quick: bool) -> list[Task]:
    """Every method in every case; a few methods, and one in simulation, if it is to be quick."""
    methods = QUICK_METHODS if quick else METHODS
    simulated = QUICK_METHODS[-1:] if quick else METHODS
    settings = [{"method": method} for method in methods]
    result = [Task(function, each) for function in (measure, measure_ranges) for each in settings]
    return result + [Task(measure_stream, {"method": method, "quick": quick}) for method in simulated]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The grades of every method in every group, its safe range, and every case."""
    found: dict[str, dict[str, Any]] = {}
    for task, result in zip(tasks, results, strict=True):
        found.setdefault(task.function.__name__, {})[task.settings["method"]] = result
    cases, ranges, streams = (
        found.get(function.__name__, {}) for function in (measure, measure_ranges, measure_stream)
    )
    methods = list(cases)
    worst = {
        way: {
            (group, method): _worst([case[way] for case in cases[method][str(group)] if case[way]], way)
            for group in GROUPS
            if group != STREAM_GROUP
            for method in methods
        }
        for way in ("prepared", "given")
    }
    for of in worst.values():
        of.update({(STREAM_GROUP, method): _stream_cell(streams.get(method)) for method in methods})
    tables = [
        _matrix(
            "stability",
            "Largest error of a pixel, LSB: spans cut where need be, as `blysk` does",
            methods,
            worst["prepared"],
            "Of normals that are not of unit length the preparation refuses all but those of a mesh, which "
            "are mended when it is read.",
        ),
        _matrix(
            "stability-as-given",
            "Largest error of a pixel in spans without a flag, LSB: every span as it comes",
            methods,
            worst["given"],
            "What somebody gets who sends spans to the pipeline without cutting them. Bad cells are outside "
            "of the ranges below.",
        ),
    ]
    bad = [grade for _, grade in worst["prepared"].values() if grade == "bad"]
    silent = [method for (_, method), (_, grade) in worst["given"].items() if grade == "bad"]
    everything = [case for method in methods for group in cases[method].values() for case in group]
    safe = [case["given"] for case in everything if case["inside"]]
    unsafe = sum(case["safe_grade"] == "bad" for case in safe)
    runs = [case for method in streams for case in streams[method]]
    text = [
        f"{len(methods)} methods in {sum(map(len, cases[methods[0]].values()))} stiff and extreme cases of "
        f"{len(GROUPS)} groups. The pixels are those of the bit-true twin, which the simulated hardware "
        f"equals to the bit, with the model `{MODEL}`; group {STREAM_GROUP} is simulated hardware. Each is "
        "held against exactly normalised interpolation in float64 with the same model; 0.5 LSB is a "
        "correctly rounded pixel. Where N.L is 0 but for the arithmetic, lit and dark are both right.",
        f"*Good* is an error to {GOOD:g} LSB. *Fair* is a larger one of which the user is told: the pipeline "
        "flags the span, or the method serves it and its documentation states such an error (its own curve "
        "in float64 is as far from exact normals, and its devices' error bounds, times the exponent in a "
        "highlight, come to the rest). *Bad* is any other: silently wrong.",
        "Where N.L changes its sign a highlight goes out at once, however bright it is. At exponent 1 it is "
        "bright there, and a method whose N.L is off by a part of an LSB puts it out a pixel early or late: "
        "the error of group 5 can be as large as the highlight.",
        f"Bad cells with spans cut: {len(bad)} of {len(worst['prepared'])}. With spans as they come: "
        f"{len(silent)}"
        + (f", of {_listed(sorted(set(silent), key=methods.index))}" if silent else "")
        + f"; of the {len(safe)} cases with spans that the method serves, {unsafe} are bad there.",
        f"In simulation {sum(case['runs'] for case in runs)} runs with stalls, empty spans and resets gave "
        f"{sum(case['runs'] * case['pixels'] for case in runs):,} pixels, "
        f"{sum(case['wrong'] or 0 for case in runs):,} of them wrong"
        + (f"; {halted} came to a halt." if (halted := sum(case["wrong"] is None for case in runs)) else "."),
    ]
    parts = [*tables, _range_table(ranges), _drawing(ranges), _case_table(cases), _stream_table(streams)]
    return Section("stability", "Numerical stability on stiff and extreme cases", text, parts)


def _listed(methods: Sequence[str]) -> str:
    return ", ".join(f"`{method}`" for method in methods)


def _worst(figures: Sequence[dict], way: str) -> tuple[float | None, Grade]:
    name = "error" if way == "prepared" else "silent"
    return max((of[name] for of in figures), default=None), grade_of([of["grade"] for of in figures])


def _stream_cell(cases: Sequence[dict] | None) -> tuple[float | None, Grade]:
    """Pixels of another colour are no small error: their number, in place of LSB."""
    if cases is None:
        return None, ""
    if any(case["wrong"] is None for case in cases):
        return None, "bad"
    wrong = sum(case["wrong"] for case in cases)
    return wrong, "bad" if wrong else "good"


def _matrix(name, title, methods, worst, note) -> Table:
    return Table(
        name,
        title,
        ["group", "what is extreme", *methods],
        [[group, text, *(worst[group, method][0] for method in methods)] for group, text in GROUPS.items()],
        f"Worst case of each group; green is good, yellow fair, red bad. Group {STREAM_GROUP}: simulated "
        f"pixels that are not the twin's; none where it was not simulated. {note}",
        [["", "", *(worst[group, method][1] for method in methods)] for group in GROUPS],
    )


def _range_table(ranges: dict[str, dict]) -> Table:
    rows, grades = [], []
    for method, found in ranges.items():
        row: list = [method, *(found["widest"][str(exponent)] for exponent in RANGE_EXPONENTS)]
        off = [of["given"]["error"] > GOOD for of in found["sweep"]]
        good = off.index(True) if True in off else len(off)
        row += [SWEEP[good - 1] if good else None, found["none_flagged"], found["all_flagged"]]
        grade: list[Grade] = [""] * len(row)
        by_factor = {of["factor"]: of for of in found["outside"]}
        for factor in FACTORS:
            of = by_factor.get(factor)
            cells: list = [None] * 3
            own: list[Grade] = [""] * 3
            if of:
                given, prepared = of["given"], of["prepared"]
                silent = given["silent"] if given["flagged"] < of["spans"] else None
                cells = [silent, given["flagged"] / of["spans"], prepared["error"]]
                own = [given["grade"], "", prepared["grade"]]
            # What is not too wide is not cut.
            row += cells if factor > 1 else cells[:2]
            grade += own if factor > 1 else own[:2]
        row += [f"1 to {(1 << LENGTH_BITS) - 1}", f"1 to {MAX_EXPONENT}"]
        rows.append(row)
        grades.append([*grade, "", ""])
    columns = ["method", *(f"widest span at n = {exponent}, degrees" for exponent in RANGE_EXPONENTS)]
    columns += [f"error to {GOOD:g} LSB up to, degrees"]
    columns += ["no span flagged to, degrees", "every span flagged from, degrees"]
    for factor in FACTORS:
        at = f"at {factor:g} of the widest" if factor != 1 else "at the widest"
        columns += [f"error without a flag {at}, LSB", f"spans flagged {at}, share"]
        columns += [f"error {at}, cut, LSB"] * (factor > 1)
    note = (
        "`blysk` cuts wider spans before the pipeline, and counts them; the pipeline counts those that it "
        f"gets and can tell, some or all. Errors at exponent {SWEEP_EXPONENT}, spans of 16 pixels with the "
        "highlight in them; no figure where every span is flagged. Of `chord-local` the widest span is "
        "measured: it depends on the light, and is that of which none of a sample is cut."
    )
    title = "Range of each method: served whole, exact to a step, flagged; and what it does outside"
    return Table("safe-ranges", title, [*columns, "pixels of a span", "exponents"], rows, note, grades)


def _case_table(cases: dict[str, dict]) -> Table:
    columns = ["method", "group", "case", "spans", "served", "cut", "flagged", "error as given, LSB"]
    columns += [
        "error without a flag, LSB",
        "error in served spans, LSB",
        "error cut, LSB",
        "flagged when cut",
    ]
    rows, grades = [], []
    for method, groups in cases.items():
        for group, found in groups.items():
            for of in found:
                given, prepared = of["given"], of["prepared"] or {}
                row = [method, int(group), of["case"], of["spans"], of["inside"], of["cut"]]
                row += [given["flagged"], given["error"]]
                row += [given["silent"] if given["flagged"] < of["spans"] else None]
                row += [given["safe"] if of["inside"] else None]
                rows.append([*row, prepared.get("error"), prepared.get("flagged")])
                shown = [given["grade"], given["safe_grade"], prepared.get("grade", ""), ""]
                grades.append([""] * 8 + shown)
    note = "A case without figures for cut spans is refused when they are prepared."
    return Table("stability-cases", "Every case", columns, rows, note, grades)


def _stream_table(streams: dict[str, list]) -> Table:
    rows = [
        [method, of["case"], of["runs"], of["runs"] * of["pixels"], of["wrong"]]
        for method, found in streams.items()
        for of in found
    ]
    note = "Simulated hardware against the twin: place, colour and mark of the span's end of each pixel."
    columns = ["method", "case", "runs", "pixels", "pixels that differ"]
    grades = [["", "", "", "", "good" if row[4] == 0 else "bad"] for row in rows]
    title = f"Group {STREAM_GROUP}: {GROUPS[STREAM_GROUP]}"
    return Table("stability-stream", title, columns, rows, note, grades)


def _drawing(ranges: dict[str, dict]) -> Drawing:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 4.0), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    titles = ("as they come, spans without a flag", "wide ones cut")
    ways = ("given", "silent"), ("prepared", "error")
    for panel, (way, key), title in zip(panels, ways, titles, strict=True):
        for method, found in ranges.items():
            shown = [of[way]["flagged"] < of["spans"] or way == "prepared" for of in found["sweep"]]
            errors = [
                of[way][key] if show else np.nan for of, show in zip(found["sweep"], shown, strict=True)
            ]
            color, dash = _STYLES[method]
            panel.plot(SWEEP, errors, color=color, linestyle=dash, linewidth=1.4, label=method)
        panel.axhline(0.5, color="#888888", linewidth=0.8, linestyle=":")
        panel.set(xscale="log", yscale="log", title=title, xlabel="angle of the span, degrees")
        panel.grid(True, color="#dddddd", linewidth=0.5)
        panel.set_xticks((1, 3, 10, 30, 90, 180), ("1", "3", "10", "30", "90", "180"), minor=False)
        panel.set_xticks((), minor=True)
        panel.set_yticks((0.5, 1, 10, 100), ("0.5", "1", "10", "100"))
        panel.title.set_fontsize(9)
    panels[0].set_ylabel("largest error, LSB")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center", frameon=False)
    note = (
        f"Exponent {SWEEP_EXPONENT}, 16 pixels a span. A line ends where every span is flagged. Dotted: "
        "half a step, a correctly rounded pixel. A span that is cut is cut until the angle grows evenly in "
        "each part, which leaves parts that are narrower than a span that is left whole."
    )
    return Drawing("stability-angles", "Error against the angle of a span", svg(figure), note)
