"""Errors of every method in stiff and extreme cases, and their grades."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from blysk.bench.accuracy import model_of
from blysk.bench.report.section import Grade
from blysk.bench.report.stability_cases import (
    GROUPS,
    HALFWAY,
    Case,
    arcs,
    cases_of,
    single_spans,
)
from blysk.golden.frames.cut import cut_spans, cutter_of
from blysk.golden.frames.local import line_ends, local_values
from blysk.golden.frames.prepare import constants_of, span_vectors, spans_for
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import halfway_vector, intensity_of_cosines, saturate
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.renderer import shade_operands, shade_spans

__all__ = [
    "FACTORS",
    "GOOD",
    "LENGTH_TOLERANCE",
    "RANGE_EXPONENTS",
    "SWEEP",
    "SWEEP_EXPONENT",
    "grade_of",
    "measure",
    "measure_case",
    "measure_ranges",
    "spans_of",
    "widest_span",
]


RANGE_EXPONENTS = (1, 10, 100, 1000)
"""Exponents of the table of safe ranges."""

SWEEP_EXPONENT = 50
"""Exponent of the spans of `measure_ranges`."""

SWEEP = tuple(np.geomspace(1, 180, 40).round(2).tolist())
"""Angles of the spans of `measure_ranges`, in degrees."""

FACTORS = (1.0, 1.2, 2.0)
"""Multiples of the widest span, for the angles of a method's cases."""

GOOD = 1.0
"""Largest good error, in LSB."""

LENGTH_TOLERANCE = 1 / 256
"""Largest distance of a normal's length from 1 that the documentation of the methods allows."""

_STEP = COMPONENT.step

# Degrees by which rounding makes a span wider.
_SLACK = 1e-3

# Error in LSB that comes from the rounding of three colour operands: ambient, diffuse and specular.
_COLOR_ERROR = 3 * Intensity.COLOR_FORMAT.step / 2


class _Shaded(NamedTuple):
    """Results of a case.

    Each shown pixel has the largest error of a channel and the stated error, in LSB, and the index of its
    span. Each span has a flag if it is out of range.
    """

    error: np.ndarray
    stated: np.ndarray
    span: np.ndarray
    out_of_range: np.ndarray


def _design(case: Case, method: str) -> ShadingPipeline:
    return preset(method, model_of(method), lights=len(case.scene.lights))


def spans_of(case: Case, design: ShadingPipeline, raster: Raster) -> Spans:
    """Spans of a case for a design. They have the codes of the case. Without codes `spans_for` makes them."""
    if case.codes is None:
        return spans_for(case.scene, raster, design)
    return design.interpolator.filled(_OfCodes(case, design, raster))


@dataclass(frozen=True)
class _OfCodes:
    """Fills spans with the codes of normals of a case, see `SpanFiller`."""

    case: Case
    design: ShadingPipeline
    raster: Raster

    def with_normals(self) -> Spans:
        raster = self.raster
        return Spans(raster.x, raster.y, raster.length, *self.case.codes)

    def with_lines(self) -> Spans:
        # The shifted codes stand for the same numbers in the format of the ends.
        shift = self.design.interpolator.END_FORMAT.fraction_bits - COMPONENT.fraction_bits
        left, right = self.case.codes
        return replace(self.with_normals(), normal_left=left << shift, normal_right=right << shift)

    def with_values(self) -> Spans:
        return replace(self.with_normals(), values=local_values(self.case.scene, self.raster))

    def with_vectors(self) -> Spans:
        given = _between(self.raster, *self.case.codes)
        return replace(self.with_normals(), vectors=span_vectors(self.case.scene, given, self.design))


def _between(raster: Raster, left: np.ndarray, right: np.ndarray) -> Raster:
    """The same spans with other end normals."""
    return replace(raster, normal_left=left.astype(np.float64), normal_right=right.astype(np.float64))


@dataclass(frozen=True)
class _OwnCurve:
    """Shades a case by the method's curve in float64, from the codes of the spans. See `ExactShading`."""

    case: Case
    design: ShadingPipeline
    raster: Raster
    spans: Spans

    def by_normals(self) -> np.ndarray:
        ends = self.spans.normal_left, self.spans.normal_right
        return self._between(*(normalise(codes.astype(np.float64)) for codes in ends))

    def by_lines(self) -> np.ndarray:
        if self.spans.vectors is None:
            return self._between(self.spans.normal_left, self.spans.normal_right)
        return self._between(*(self.case.codes or line_ends(self.raster)))

    def by_values(self, exact_operands: Callable[..., tuple[np.ndarray, ...]]) -> np.ndarray:
        cosine, u = exact_operands(self.spans.values, self.spans.length)
        return shade_operands(self.case.scene, self.raster, cosine, 1 - u, self.design.specular.reflection)

    def _between(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        method, given = self.design.interpolator, _between(self.raster, left, right)
        model = self.design.specular.reflection
        return shade_spans(self.case.scene, given, method.exact_normals, model, method.uses_chord)


def _shade(case: Case, design: ShadingPipeline, raster: Raster) -> _Shaded:
    """Errors of the bit-accurate model against exact normals.

    Exact normals are perspective-correct, and normalised at every pixel.
    """
    scene, material = case.scene, case.scene.materials[0]
    spans, (constants,) = spans_of(case, design, raster), constants_of(scene, design)
    color = design.compute(spans, constants).color
    out_of_range = design.operands(spans, constants).out_of_range

    method = design.interpolator
    by_codes = method.curve_is_exact and method.brings_ends
    degrees = _line_angles(spans) if by_codes else _angles(raster)
    degrees = np.minimum(degrees, method.MAX_ANGLE).max(initial=0)
    error = method.operand_error(int(raster.length.max(initial=1)), float(degrees))
    if method.brings_ends and not method.curve_is_exact:
        error += min(_length_excess((spans.normal_left, spans.normal_right)), LENGTH_TOLERANCE)
    shown = raster.visible
    normals = fragment_normals(scene, case.raster, shown)
    direction = np.array([light.direction for light in scene.lights])
    halfway = halfway_vector(direction, scene.camera.viewer)
    cosine, highlight = (normals @ vectors.T for vectors in (direction, halfway))
    # If N·L is 0 within the error of the arithmetic, both sides of the terminator are right.
    near = np.abs(cosine) <= error + 3 * _STEP
    exact = [
        saturate(
            intensity_of_cosines(
                material,
                scene.lights,
                scene.ambient_light,
                np.where(near, side, cosine),
                highlight,
                design.specular.reflection,
            )
        )
        for side in (0.0, 2.0**-60)
    ]

    own = method.exact_frame(_OwnCurve(case, design, raster, spans)).reshape(-1, 3)[raster.pixel[shown]] * 255
    light = np.sum([light.color for light in scene.lights], axis=0)
    terms = np.multiply(material.diffuse, error)
    longest = int(raster.length.max(initial=1))
    highlight_error = method.highlight_error(design.specular, material.exponent, longest, error)
    terms = terms + np.multiply(material.specular, highlight_error)
    arithmetic = 0.5 + _COLOR_ERROR * len(direction) + 255 * (light * terms).max()
    found, stated = (
        np.min([np.abs(of - one * 255).max(axis=1) for one in exact], axis=0) for of in (color[shown], own)
    )
    return _Shaded(found, stated + arithmetic, raster.span[shown], out_of_range)


def _angles(raster: Raster) -> np.ndarray:
    """Angles of spans in degrees."""
    half = np.linalg.norm(raster.normal_right - raster.normal_left, axis=1) / 2
    return np.degrees(2 * np.arcsin(np.minimum(half, 1)))


def _line_angles(spans: Spans) -> np.ndarray:
    """Angle in degrees of each line: the angle of a chord of the unit sphere at the same distance from 0."""
    left, right = (
        codes / Renormaliser.VECTOR_FORMAT.max_code for codes in (spans.normal_left, spans.normal_right)
    )
    chord = right - left
    square = np.einsum("ij,ij->i", chord, chord)
    t = np.clip(-np.einsum("ij,ij->i", left, chord) / np.where(square, square, 1.0), 0, 1)
    nearest = np.linalg.norm(left + t[:, np.newaxis] * chord, axis=1)
    return 2 * np.degrees(np.arccos(np.minimum(nearest, 1)))


def _has_unit_length(design: ShadingPipeline, codes: Sequence[np.ndarray]) -> np.ndarray:
    """Whether both normals at the ends of a span have length 1 within `LENGTH_TOLERANCE`.

    Of a line only the longer normal has to have this length.
    """
    lengths = np.linalg.norm(np.stack(codes) / ONE, axis=2)
    if design.interpolator.curve_is_exact:
        lengths = lengths.max(axis=0, keepdims=True)
    return (np.abs(lengths - 1) <= LENGTH_TOLERANCE + _STEP).all(axis=0)


def _length_excess(codes: Sequence[np.ndarray]) -> float:
    """Largest distance of a normal's length from 1. The result is 0 if rounding explains the distance."""
    lengths = np.linalg.norm(np.concatenate(codes) / ONE, axis=1)
    excess = float(np.abs(lengths - 1).max(initial=0))
    return excess if excess > 2 * _STEP else 0.0


def grade_of(grades: Sequence[Grade]) -> Grade:
    """The worst of some grades. Empty if there are no grades."""
    order: tuple[Grade, ...] = ("bad", "fair", "good", "")
    return min(grades, key=order.index, default="")


def _figures(shaded: _Shaded, inside: np.ndarray) -> dict[str, Any]:
    """Figures of a case: largest error, largest error in spans without a flag, and grades."""
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
    """Errors of a method in a case, by the bit-accurate model.

    The error is the largest error of a channel in LSB. The reference has exact normals of each pixel in
    float64, with the same model. A correctly rounded pixel has 0.5 LSB. Where N·L is 0 within the stated
    errors, lit and dark are both right. An error is

    - good up to `GOOD`;
    - fair if it is larger, but the pipeline flags the span, or the method serves the span and states the
      error. A stated error is at most the error of the method's curve in float64, plus the error bounds of
      its units. In a highlight the bounds count times the exponent;
    - bad if it is larger, and neither a flag nor a stated error tells of it.

    A method serves a span that `cut_spans` leaves whole. A method that takes two normals and has no span
    limit serves spans up to its `Interpolator.widest_span`. Normals have length 1 within `LENGTH_TOLERANCE`.
    If the method takes vectors, a span of two pixels is divided into two spans of one pixel.

    Returns
    -------
    dict
        - ``case``: its name;
        - ``spans``: number of spans, ``inside``: number of spans that the method serves, ``cut``: number of
          spans that are cut;
        - ``given`` and ``prepared``: dictionaries for the spans as given, and for the spans after cuts.
          ``prepared`` is ``None`` if the case has codes.

        These dictionaries have ``error``; ``silent``, the error in spans without a flag; ``safe``, the error
        in served spans; ``flagged``, the number of flagged spans; ``grade``; and ``safe_grade`` of the served
        spans.
    """
    design = _design(case, method)
    by_angle = design.interpolator.brings_ends and not design.interpolator.curve_is_exact
    raster = design.interpolator.least_cut(cutter_of(case.scene, case.raster, design))
    cut, _ = cut_spans(case.scene, raster, design)
    first = np.flatnonzero(cut.offset == 0)
    parts = np.bincount(raster.span[first], minlength=len(raster.length))
    if by_angle:
        widest = design.interpolator.widest_span(case.scene.materials[0].exponent)
        inside = _angles(raster) <= widest + _SLACK
    else:
        inside = parts == 1
    if case.codes is not None:
        inside &= _has_unit_length(design, case.codes)
    prepared = None
    if case.codes is None:
        prepared = _figures(_shade(case, design, cut), np.ones(len(cut.length), dtype=bool))
    return {
        "case": case.name,
        "spans": len(raster.length),
        "inside": int(np.count_nonzero(inside)),
        "cut": int(np.count_nonzero(parts > 1)),
        "given": _figures(_shade(case, design, raster), inside),
        "prepared": prepared,
    }


def measure(method: str) -> dict[str, list[dict[str, Any]]]:
    """Results of `measure_case` for a method and all cases, by group."""
    return {str(group): [measure_case(case, method) for case in cases_of(group)] for group in GROUPS}


def _span_case(degrees: float, exponent: int, count: int = 30) -> Case:
    rng = np.random.default_rng(exponent)
    off = rng.uniform(0, 100 / exponent**0.5, count) * (exponent > 10)
    ends = arcs(rng, HALFWAY, np.full(count, degrees), rng.uniform(0, 1, count), off)
    return single_spans(2, f"{degrees:g} degrees", ends, 16, exponent)


def _flags(method: str, degrees: np.ndarray) -> np.ndarray:
    """Whether the pipeline flags spans of the given angles."""
    rng = np.random.default_rng(0)
    ends = arcs(rng, HALFWAY, degrees, rng.uniform(0, 1, len(degrees)), rng.uniform(0, 30, len(degrees)))
    case = single_spans(2, "", ends, 5, SWEEP_EXPONENT)
    design = _design(case, method)
    (constants,) = constants_of(case.scene, design)
    return design.operands(spans_of(case, design, case.raster), constants).out_of_range


def widest_span(method: str, exponent: int) -> float:
    """Widest span in degrees that a method serves.

    For ``chord-local`` and ``quotient`` this is the widest angle at which no span of a sample is cut. For
    other methods it is the widest span that is not cut.
    """
    design = preset(method, model_of(method))
    if design.interpolator.brings_ends:
        return METHODS[method].widest_span(exponent)
    low, high = 0.0, METHODS[method].MAX_ANGLE
    while high - low > 0.05:
        middle = (low + high) / 2
        case = _span_case(middle, exponent)
        _, cut = cut_spans(case.scene, case.raster, _design(case, method))
        low, high = (low, middle) if cut else (middle, high)
    return low


def measure_ranges(method: str) -> dict[str, Any]:
    """Range of spans that a method serves, and its errors inside and outside.

    Returns
    -------
    dict
        - ``widest``: widest span in degrees at each of `RANGE_EXPONENTS`;
        - ``none_flagged``: largest whole number of degrees up to which no span is flagged;
        - ``all_flagged``: least whole number of degrees from which all spans are flagged;
        - ``sweep``: `measure_case` of spans at each angle of `SWEEP` and `SWEEP_EXPONENT`;
        - ``outside``: `measure_case` of spans of `FACTORS` times the widest span, with ``factor`` and
          ``degrees``.
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
