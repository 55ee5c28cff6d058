"""The device table: what every device and variant errs by, how fast it is and what it costs.

``blysk blocks`` prints it. Nothing in it is written down beforehand: errors come from the bit-true twins and
float64 mathematics, times from the units or a simulation of them, parts from their netlists.
"""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import click
import numpy as np
from amaranth.lib.wiring import Component
from tqdm import tqdm

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import ARCCOS_TABLES, SEGMENT_BOUNDS, Arccos
from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.cosines.local_chord_setup import LocalChordSetup
from blysk.golden.cosines.recurrence import RECURRENCE_FORMS, Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import MAX_EXPONENT, Specular
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator, SpanValues
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE, MIDDLE_NORMAL_FITS, MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS, QuadraticEvaluator
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import METHODS, MODELS, preset
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.arccos import ArccosUnit
from blysk.hdl.cosines.chord import ChordUnit
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.hdl.cosines.half_chord import HalfChordUnit
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit
from blysk.hdl.cosines.local_chord_setup import LocalChordSetupUnit
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.hdl.cosines.recurrence_setup import RecurrenceSetupUnit
from blysk.hdl.emit.cost import Cost, cost_of
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.lighting.intensity import CompactIntensityUnit, IntensityUnit
from blysk.hdl.lighting.light import LightUnit
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit
from blysk.hdl.methods.registry import unit_of
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.hdl.normals.bisection import BisectionUnit
from blysk.hdl.normals.bisection_chain import BisectionChainUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.dot_product import DotProductUnit
from blysk.hdl.normals.gpq import GPQUnit
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit
from blysk.hdl.normals.renormaliser import RenormaliserUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.cli.main import OutputFile
from blysk.sim.engines.beats import dtype_of
from blysk.sim.engines.simulate import simulate
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import local_executor
from blysk.sim.output import check_writable, write_json

__all__ = [
    "BLOCKS",
    "Block",
    "Decisions",
    "Row",
    "Sample",
    "cells_of",
    "command",
    "row_of",
    "rows",
    "sample_of",
    "table",
]

SAMPLES = 1_000_000
SEED = 1

_CHUNK = 1 << 17
"""Samples that are measured at once; bounds the memory."""

_MOST_JOBS = 64
_GROUPS = 8
"""Of spans, each with lights of its own, in a chunk of whole spans."""

_STEP = COMPONENT.step
_SCALE = ONE * _STEP
"""Length of a unit vector, read as a number."""


@dataclass(frozen=True)
class Sample:
    """What a device gave, and what it should have given.

    Parameters
    ----------
    found : array
        Values of the bit-true twin.
    exact : array, same shape
        The exact function of the same operands in float64.
    formula : array, same shape, optional
        The formula that the device approximates it by, in float64; `None` where its tables cannot be told
        from its arithmetic.
    at : array, broadcast to the same shape, optional
        The operand that an error is drawn against, named by the entry's ``axis``.
    """

    found: np.ndarray
    exact: np.ndarray
    formula: np.ndarray | None = None
    at: np.ndarray | None = None

    @property
    def errors(self) -> tuple[float | None, float | None, float]:
        """Largest model, arithmetic and total error."""
        total = self._size(self.found, self.exact)
        if self.formula is None:
            return None, None, total
        return self._size(self.formula, self.exact), self._size(self.found, self.formula), total

    @staticmethod
    def _size(a, b) -> float:
        return float(np.abs(np.subtract(a, b)).max())

    @property
    def extremes(self) -> "Sample":
        """The three results or fewer that `errors` come from."""
        pairs = [(self.found, self.exact)]
        if self.formula is not None:
            pairs += [(self.formula, self.exact), (self.found, self.formula)]
        worst = [int(np.abs(np.subtract(a, b)).argmax()) for a, b in pairs]
        parts = (self.found, self.exact, self.formula)
        return Sample(*(None if part is None else np.ravel(part)[worst] for part in parts))


class Decisions(Sample):
    """Yes, 1, or no, 0, and what it should have been. Errors are their share of all.

    The formula is yes where either is: a model error is a yes for nothing, a waste; an arithmetic one a no
    by mistake.
    """

    @classmethod
    def of(cls, found: np.ndarray, exact: np.ndarray, at: np.ndarray | None = None) -> "Decisions":
        """Decisions and what they should have been, as booleans."""
        found, exact = (np.asarray(decision, dtype=np.int8) for decision in (found, exact))
        return cls(found, exact, np.maximum(found, exact), at)

    @staticmethod
    def _size(a, b):
        return float(np.abs(np.subtract(a, b)).mean())

    @property
    def extremes(self) -> "Decisions":
        """All of them."""
        return replace(self, at=None)


@dataclass(frozen=True)
class Block:
    """An entry of the table: a device in one variant.

    Parameters
    ----------
    device, variant : str
        Names.
    source : str
        Document and figure.
    unit : callable
        Makes the unit.
    measure : callable
        Takes a random generator and a number of samples, gives a `Sample`. For methods of whole spans a
        sample is a pixel.
    domain : str
        Operands over which errors are measured.
    scale : str
        Unit of the errors: nothing (1 is a full term or the length of a vector), ``rad``, ``turn``, ``LSB``
        or ``rate``, a share of the decisions.
    exhaustive : bool
        Every operand of the domain is measured, whatever the number of samples.
    beat : dict
        Fields of the input beats of the simulation that finds the times, where the unit does not state
        them; others are 0.
    note : str
        What else there is to say.
    axis : str
        What errors are drawn against, the ``at`` of the sample; empty for nothing.
    logarithmic : bool
        It is drawn on a logarithmic axis.
    """

    device: str
    variant: str
    source: str
    unit: Callable[[], Component]
    measure: Callable[[np.random.Generator, int], Sample]
    domain: str
    scale: str = ""
    exhaustive: bool = False
    beat: dict[str, Any] = field(default_factory=dict)
    note: str = ""
    axis: str = ""
    logarithmic: bool = False


@dataclass(frozen=True)
class Row:
    """A line of the table.

    Parameters
    ----------
    block : Block
        The entry.
    samples : int
        Results that were compared, a component of a vector being one.
    errors : tuple of float or None
        Model, arithmetic and total error.
    latency : int
        Clocks from an input to its first result.
    interval : int
        Clocks from a result to the next.
    cost : Cost
        Parts.
    """

    block: Block
    samples: int
    errors: tuple[float | None, float | None, float | None]
    latency: int
    interval: int
    cost: Cost

    def as_dict(self) -> dict[str, Any]:
        """The line under stable names."""
        block, cost = self.block, self.cost
        model, arithmetic, total = self.errors
        return {
            "device": block.device,
            "variant": block.variant,
            "source": block.source,
            "domain": block.domain,
            "exhaustive": block.exhaustive,
            "samples": self.samples,
            "error_unit": block.scale or "1",
            "model_error": model,
            "arithmetic_error": arithmetic,
            "total_error": total,
            "latency": self.latency,
            "initiation_interval": self.interval,
            "multipliers": {f"{a}x{b}": count for (a, b), count in sorted(cost.multipliers.items())},
            "constant_multipliers": cost.constant_multipliers,
            "rom_bits": cost.rom_bits,
            "ram_bits": cost.ram_bits,
            "register_bits": cost.register_bits,
            "note": block.note,
        }


# Operands.


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", a, b)


def _sphere(rng: np.random.Generator, count: int) -> np.ndarray:
    return normalise(rng.normal(size=(count, 3)))


def _turned(rng: np.random.Generator, vectors: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Vectors at given angles from others, in any direction."""
    across = rng.normal(size=vectors.shape)
    across = normalise(across - _dot(across, vectors)[:, np.newaxis] * vectors)
    angle = np.radians(degrees)[:, np.newaxis]
    return vectors * np.cos(angle) + across * np.sin(angle)


def _angles(rng: np.random.Generator, count: int, widest: float) -> np.ndarray:
    """Degrees: both ends, half spread evenly, half by their logarithm."""
    angles = rng.uniform(0, widest, count)
    angles[::2] = widest * 10.0 ** rng.uniform(-6, 0, len(angles[::2]))
    angles[: count // 20] = 0
    angles[count // 20 : count // 10] = widest
    return angles


def _ends(rng: np.random.Generator, count: int, widest: float) -> tuple[np.ndarray, np.ndarray]:
    """Codes of the ends of spans up to ``widest`` degrees, some along an axis."""
    left = _sphere(rng, count)
    left[: count // 20] = np.eye(3)[np.arange(count // 20) % 3]
    right = _turned(rng, left, rng.permutation(_angles(rng, count, widest)))
    return quantise(left), quantise(right)


def _vectors(*codes: np.ndarray) -> tuple[Fixed, ...]:
    return tuple(Fixed(COMPONENT, vector) for vector in codes)


def _lengths(rng: np.random.Generator, count: int, least: int = 1) -> np.ndarray:
    lengths = np.floor(least * (4096 / least) ** rng.random(count)).astype(np.int64)
    edges = [least, least + 1, 4094, 4095]
    lengths[: len(edges)] = edges[:count]
    return lengths


def _span_lengths(rng: np.random.Generator, pixels: int, least: int = 1) -> np.ndarray:
    """Lengths of spans that have about so many pixels or a few more, in any order."""
    return rng.permutation(_lengths(rng, max(pixels // 450, 2 * _GROUPS), least))


def _vectors_near(rng: np.random.Generator, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Codes of a unit vector for each span: anywhere, and for every second near the span's normals."""
    vector = _sphere(rng, len(left))
    vector[::2] = normalise((0.7 * left + 0.3 * right)[::2] / ONE + vector[::2] * 1e-3)
    return quantise(vector)


def _pixels(rng: np.random.Generator, length: np.ndarray) -> np.ndarray:
    """A pixel of each span; of every fourth the last."""
    pixel = np.floor(rng.random(len(length)) * length).astype(np.int64)
    pixel[::4] = length[::4] - 1
    return pixel


def _curves(rng: np.random.Generator, count: int) -> tuple[Fixed, Fixed, Fixed]:
    """Coefficients of the quadratic curves of spans."""
    left, right = _vectors(*_ends(rng, count, MAX_SPAN_ANGLE))
    return GPQ().compute(left, MiddleNormal().compute(left, right)[0], right)


def _exponents(rng: np.random.Generator, count: int) -> Iterator[tuple[int, int]]:
    """Exponents, and how many samples each has."""
    exponents = [1, 2, 3, 10, 100, 500, 999, MAX_EXPONENT]
    exponents += rng.integers(1, MAX_EXPONENT + 1, 32).tolist()
    for exponent in exponents:
        yield exponent, max(count // len(exponents), 16)


def _joined(samples: Iterable[Sample]) -> Sample:
    samples = [
        s if s.at is None else replace(s, at=np.broadcast_to(s.at, np.shape(s.found))) for s in samples
    ]
    parts = [
        None
        if any(getattr(s, name) is None for s in samples)
        # A sample may have its own shape.
        else np.concatenate([np.ravel(getattr(s, name)) for s in samples])
        for name in ("found", "exact", "formula", "at")
    ]
    return type(samples[0])(*parts)


# What is measured: `rng, count -> Sample`, a function a device.


def _dot_product(rng, count):
    a, b = (rng.integers(-ONE - 1, ONE + 1, (count, 3)) for _ in range(2))
    edges = [-ONE - 1, ONE, 0]
    a[:3], b[:3] = np.transpose([edges] * 3), -ONE - 1
    exact = _dot(a * _STEP, b * _STEP)
    return Sample(DotProduct().compute(*_vectors(a, b)).values, exact, exact, exact)


def _degrees(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Angles between code vectors, as a column."""
    sine = np.linalg.norm(np.cross(left / ONE, right / ONE), axis=1)
    return np.degrees(np.arctan2(sine, _dot(left, right) / ONE**2))[:, np.newaxis]


def _halves(left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact middle of code vectors as long as a unit vector, and their cosine."""
    cosine = _dot(left, right) / ONE**2
    return (left + right) * _STEP / np.sqrt(2 + 2 * cosine)[:, np.newaxis], cosine


def _middle_normal(rng, count, unit):
    left, right = _ends(rng, count, MAX_SPAN_ANGLE)
    found, _ = unit.compute(*_vectors(left, right))
    exact, cosine = _halves(left, right)
    u = (1 - cosine) * _SCALE**2
    factor = np.polynomial.polynomial.polyval(u, np.r_[0.5 + unit.constant.values, unit.coefficients.values])
    # A factor that is too large takes a component near 1 out of the word.
    formula = np.clip(
        (left + right) * _STEP * factor[:, np.newaxis], -1, unit.FORMAT.max_code * unit.FORMAT.step
    )
    return Sample(found.values, exact, formula, _degrees(left, right))


def _gpq(rng, count):
    left, right = _vectors(*_ends(rng, count, MAX_SPAN_ANGLE))
    middle, _ = MiddleNormal().compute(left, right)
    found = GPQ().compute(left, middle, right)
    n_l, n_c, n_r = left.values, middle.values, right.values
    exact = np.stack([2 * n_r - 4 * n_c + 2 * n_l, 4 * n_c - n_r - 3 * n_l, n_l])
    return Sample(np.stack([word.values for word in found]), exact, exact, _degrees(left.codes, right.codes))


def _difference_setup(rng, count, unit):
    g, p, _ = _curves(rng, count)
    length = _lengths(rng, count, 2)
    first, second = unit.compute(g, p, length)
    k = _pixels(rng, length)[:, np.newaxis]
    t = k / (length - 1)[:, np.newaxis]
    exact = (g.values * t + p.values) * t
    return Sample(k * first.values + k * (k - 1) / 2 * second.values, exact, exact, k)


def _difference_accumulator(rng, count):
    g, p, q = _curves(rng, count)
    length = _lengths(rng, count)
    first, second = DifferenceSetup().compute(g, p, length)
    pixel = _pixels(rng, length)
    found = DifferenceAccumulator().compute(q, first, second, np.arange(count), pixel)
    k = pixel[:, np.newaxis]
    exact = q.values + k * first.values + k * (k - 1) / 2 * second.values
    return Sample(found.values, exact, exact, k)


def _quadratic_evaluator(rng, count, form):
    g, p, q = _curves(rng, count)
    length = _lengths(rng, count, 2)
    pixel = _pixels(rng, length)
    found = QuadraticEvaluator(form).compute(g, p, q, length, np.arange(count), pixel)
    t = (pixel / (length - 1))[:, np.newaxis]
    exact = (g.values * t + p.values) * t + q.values
    return Sample(found.values, exact, exact, pixel[:, np.newaxis])


def _cosines(rng: np.random.Generator, count: int, exponent: int) -> np.ndarray:
    """Codes of cosines from 0 to 1: of the highlight, about where it ends, and anywhere."""
    away = rng.uniform(0, 1, count)
    away[::2] = np.minimum(rng.uniform(0, 16, len(away[::2])) / exponent, 1)
    away[: count // 20] = 0
    return np.floor(ONE_SQUARED.codes * (1 - away)).astype(np.int64)


def _highlight(rng, count, unit, model):
    def samples():
        for exponent, share in _exponents(rng, count):
            codes = _cosines(rng, share, exponent)
            cosine = codes / ONE_SQUARED.codes
            found = unit.compute(Fixed(unit.operand_format, codes), np.zeros(share, bool), exponent)
            exact = REFLECTION_MODELS["blinn"].reflect(cosine, exponent)
            yield Sample(
                found.values,
                exact,
                REFLECTION_MODELS[model].reflect(cosine, exponent),
                exponent * (1 - cosine),
            )

    return _joined(samples())


def _diffuse(rng, count):
    unit = Diffuse()
    codes = rng.integers(-ONE * ONE, ONE * ONE + 1, count)
    codes[:3] = -ONE * ONE, 0, ONE * ONE
    cosine = Fixed(unit.operand_format, codes)
    return Sample(
        unit.compute(cosine).values,
        np.maximum(codes / ONE**2, 0),
        np.maximum(cosine.values, 0),
        codes / ONE**2,
    )


def _intensity(rng, count):
    unit = Intensity()
    colors = rng.random((3, 64, 3))
    pick = rng.integers(0, 64, count)
    terms = rng.integers(0, 1 << 17, (2, count))
    terms[:, :2] = 0, (1 << 17) - 1
    found = np.empty((count, 3))
    for k, color in enumerate(colors.transpose(1, 0, 2)):
        ambient, diffuse, specular = (Fixed(unit.COLOR_FORMAT, unit.color(c)) for c in color)
        chosen = pick == k
        found[chosen] = unit.compute(
            ambient,
            diffuse[np.newaxis],
            specular[np.newaxis],
            *(Fixed(unit.TERM_FORMAT, term[chosen][:, np.newaxis]) for term in terms),
        )
    weights = np.stack([np.ones(count), *(terms * 2.0**-17)])
    exact = np.minimum(255 * np.einsum("wp,wpc->pc", weights, colors[:, pick]), 255)
    return Sample(found, exact, exact, exact)


def _light(rng, count, model):
    unit, dot = Specular(REFLECTION_MODELS[model]), DotProduct()

    def samples():
        for exponent, share in _exponents(rng, count):
            viewer, light = _sphere(rng, share), _sphere(rng, share)
            halfway = normalise(viewer + light)
            normal = _turned(rng, halfway, np.minimum(_angles(rng, share, 90), 89))
            # A viewer sees the front: N.V > 0, and so N.H > 0 wherever there is light.
            kept = _dot(normal, viewer) > 0.01
            normal, light, halfway = (quantise(v[kept]) for v in (normal, light, halfway))
            cosine = dot.compute(*_vectors(normal, light))
            dark = Diffuse().dark(cosine)
            specular = unit.compute(dot.compute(*_vectors(normal, halfway)), dark, exponent)
            diffuse = np.maximum(_dot(normal, light) / ONE**2, 0)
            exact, formula = (
                np.stack(
                    [
                        diffuse,
                        REFLECTION_MODELS[name].reflect(_dot(normal, halfway) / ONE**2, exponent) * ~dark,
                    ]
                )
                for name in ("blinn", model)
            )
            found = np.stack([Diffuse().compute(cosine).values, specular.values])
            yield Sample(found, exact, formula, exponent * (1 - _dot(normal, halfway) / ONE**2))

    return _joined(samples())


def _factor(p: Bisection, cosine: np.ndarray, one_minus: np.ndarray, first_step: np.ndarray) -> np.ndarray:
    """``e`` of the bisection's polynomials in float64."""
    parts = []
    for first in (False, True):
        constant, rest = p.polynomial(first)
        x = (cosine if p.reads_cosine(first) else one_minus) * _SCALE**2
        parts.append(np.polynomial.polynomial.polyval(x, np.r_[constant.values, rest.values]))
    return np.where(first_step, parts[1], parts[0])


def _bisection(rng, count, p):
    left, right = _ends(rng, count, p.max_angle)
    found, u, _ = p.compute(*_vectors(left, right))
    exact, cosine = _halves(left, right)
    first_step = (u > p.widest_narrow) & (p.max_angle == 90)
    formula = (left + right) * _STEP * (0.5 + _factor(p, cosine, 1 - cosine, first_step))[:, np.newaxis]
    # A factor that is too large takes a component near 1 out of the word.
    return Sample(found.values, exact, np.clip(formula, -1, _SCALE), _degrees(left, right))


def _chain_weights(chain: BisectionChain, cosine: np.ndarray, level: np.ndarray, limit: float):
    """Weights ``l`` and ``m`` by the polynomials in float64; beyond the limit of u that of wide spans."""
    p = chain.bisection
    u = 1 - cosine
    weight_l, weight_m = np.zeros(len(u)), np.ones(len(u))
    for k in range(1, 1 << chain.LEVEL_BITS):
        e = _factor(p, cosine, u, (u * _SCALE**2 > limit) & (p.max_angle == 90))
        weight_l = np.where(k <= level, (weight_l + 1) * (0.5 + e), weight_l)
        weight_m = np.where(k <= level, weight_m * (0.5 + e), weight_m)
        u = u / 2 - (1 + cosine) * e
        cosine = 1 - u
    return weight_l, weight_m


def _bisection_chain(rng, count, chain):
    p = chain.bisection
    left, right = _ends(rng, count, p.max_angle)
    level = rng.integers(1, 1 << chain.LEVEL_BITS, count)
    found, _ = chain.compute(*_vectors(left, right), level)
    a, b = left / ONE, right / ONE

    def vectors(of_left, of_right):
        return _SCALE * (of_left[:, np.newaxis] * a + of_right[:, np.newaxis] * b)

    # Slerp by the chain's own weights, as code vectors are not quite as long as each other.
    psi = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), _dot(a, b))
    part = psi * 2.0**-level
    apart = psi > 0
    sine = np.where(apart, np.sin(psi), 1)
    exact = vectors(
        np.where(apart, np.sin(psi - part) / sine, 1 - 2.0**-level),
        np.where(apart, np.sin(part) / sine, 2.0**-level),
    )
    # At the limit between the polynomials rounding decides, and the one that the unit took counts.
    limits = p.widest_narrow.values + np.array([-8, 8]) * p.ANGLE_FORMAT.step
    early, late = (
        np.clip(vectors(*_chain_weights(chain, _dot(a, b), level, limit)), -1, _SCALE) for limit in limits
    )
    of_early, of_late = (np.abs(found.values - formula).max(axis=1) for formula in (early, late))
    formula = np.where((of_early < of_late)[:, np.newaxis], early, late)
    return Sample(found.values, exact, formula, _degrees(left, right))


def _adaptive_normaliser(rng, count, p):
    length = _span_lengths(rng, count)
    left, right = _ends(rng, len(length), p.bisection.max_angle)
    found, out_of_range, levels = p.compute(*_vectors(left, right), length)
    span, pixel = pixels_of(length)
    t = pixel / np.maximum(length - 1, 1)[span]
    parts = 2.0 ** levels[span]
    a, b = left[span] / ONE, right[span] / ONE
    segment = np.minimum(np.floor(t * parts), parts - 1)
    before, after = (interpolate("slerp", a, b, (segment + k) / parts) for k in (0, 1))
    after = np.where((segment + 1 == parts)[:, np.newaxis], b, after)
    lines = before + (t * parts - segment)[:, np.newaxis] * (after - before)
    # slerp has the length of its left end; the last pixel has that of the right one.
    exact = np.where((t == 1)[:, np.newaxis], b, interpolate("slerp", a, b, t))
    kept = ~out_of_range[span]
    angle = _degrees(left, right)[span[kept]]
    return Sample(found.values[kept], exact[kept] * _SCALE, lines[kept] * _SCALE, angle)


def _recurrence(rng, count, unit, shortcut=False):
    length = _lengths(rng, max(count // 450, 8), 2)
    psi = np.radians(rng.permutation(_angles(rng, len(length), 90.0)))
    psi[2:4] = np.pi / 2  # The longest spans are the widest, too.
    step = psi / (length - 1)
    phase = rng.uniform(-np.pi, np.pi, len(length))
    amplitude = rng.uniform(0, 1 - 2.0**-16, len(length))
    # The shortcut for cos d, by its half angle: near d = 0 a cosine has lost its digits.
    taken = 2 * np.arcsin(np.sin(psi / 2) / (length - 1)) if shortcut else step
    states = unit.states(*unit.start(amplitude, phase, step), *unit.coefficient(taken), int(length.max()))
    k = np.arange(len(states.codes))[:, np.newaxis]
    inside = k < length
    exact = formula = (amplitude * np.cos(phase - k * step))[inside]
    if shortcut:
        first, second = (amplitude * np.cos(phase - n * step) for n in (0, 1))
        rise = second - first + 2 * first * np.square(np.sin(taken / 2))
        turns = k * np.sinc(k * taken / np.pi) / np.sinc(taken / np.pi)
        # Up to 1.1 where the span is wide: out of the result's word.
        limit = unit.result_format.max_code * unit.result_format.step
        formula = np.clip((first * np.cos(k * taken) + rise * turns)[inside], -1, limit)
    pixel = np.broadcast_to(k, inside.shape)[inside]
    return Sample(unit.result(states).values[inside], exact, formula, pixel)


def _renormaliser(rng, count):
    unit = Renormaliser()
    longest = np.sqrt(unit.HIGH) - 2.0**-15
    length = rng.uniform(np.sqrt(unit.LOW) + 2.0**-15, longest, count)
    vector = np.clip(np.rint(_sphere(rng, count) * (length / _STEP)[:, np.newaxis]), -ONE - 1, ONE)
    vector = vector.astype(np.int64)
    found, outside = unit.compute(*_vectors(vector))
    value = vector * _STEP
    square = _dot(value, value)
    place = (square - unit.LOW) * 2**unit.SEGMENT_BITS
    segment = np.clip(np.floor(place).astype(np.int64), 0, unit.SEGMENTS - 1)
    u = (place - segment) / 2**unit.SEGMENT_BITS
    c0, c1, c2 = (c.values[segment] for c in unit.coefficients)
    formula = value * (1 + c0 - u * (c1 - u * c2))[:, np.newaxis]
    exact = value * (_SCALE / np.sqrt(square))[:, np.newaxis]
    kept = ~outside
    return Sample(found.values[kept], exact[kept], formula[kept], np.sqrt(square)[kept, np.newaxis])


def _arccos(rng, count, table):
    unit = Arccos(table)
    one = unit.MAGNITUDE_FORMAT.code(1)
    x = Fixed(unit.OPERAND_FORMAT, np.arange(-one, one + 1))
    return Sample(unit.compute(x)[0].values, np.arccos(x.values), unit.polynomial(x.values), x.values)


def _half_chord(rng, count):
    left, right = _ends(rng, count, 180.0)
    obtuse = _dot(left, right) < 0
    across = np.where(obtuse[:, np.newaxis], left + right, left - right)
    chord = np.minimum(_dot(across, across), 2 << 34)
    unit = HalfChord()
    found = unit.compute(Fixed(unit.OPERAND_FORMAT, chord), obtuse)
    # The table's lines and the polynomial, in words of the hardware, without further rounding.
    z = chord * 2.0**-36
    halvings = np.clip(np.floor(-np.frexp(z)[1] / 2), 0, 17)
    place = z * 4.0**halvings * 2**unit.ADDRESS_BITS
    address = np.minimum(np.floor(place), 2**unit.ADDRESS_BITS - 1).astype(np.int64)
    value, slope = (word.values[address] for word in unit.roots)
    root = value + slope * (place - address) / 2**unit.ADDRESS_BITS
    factor = np.polynomial.polynomial.polyval(z, np.r_[unit.constant.values, unit.coefficients.values])
    turns = np.stack([np.arcsin(np.sqrt(chord) / (2 * ONE)) / np.pi, root * factor / 2 * 2.0**-halvings])
    exact, formula = np.where(obtuse, 0.5 - turns, turns)
    return Sample(found.values, exact, formula, 360 * exact)


def _highlight_cosine(rng, count, unit):
    length = _lengths(rng, count)
    pixel = _pixels(rng, length)
    phase = rng.integers(-(1 << 39), 1 << 39, count)
    step = np.floor(rng.uniform(0, 0.5, count) / np.maximum(length - 1, 1) * 2**40).astype(np.int64)
    beta = rng.integers(0, (1 << 25) + 1, count)
    beta[::4] = 1 << 25
    phase[::8] = (pixel * step)[::8] % (1 << 39)
    words = (
        Fixed(unit.PHASE_FORMAT, phase),
        Fixed(unit.STEP_FORMAT, step),
        Fixed(unit.COS_BETA_FORMAT, beta),
    )
    found = unit.compute(*words, np.arange(count), pixel)
    turns = (phase - pixel * step) / 2.0**40
    # The table's lines, in its words.
    quarters = np.abs(turns - np.rint(turns)) * 4
    back = quarters > 1
    place = np.where(back, 2 - quarters, quarters) * 2**unit.address_bits
    address = np.minimum(np.floor(place), 2**unit.address_bits - 1).astype(np.int64)
    value, rise = (word.values[address] for word in unit.table)
    line = value + rise * (place - address)
    beta = beta * 2.0**-25
    largest = unit.RESULT_FORMAT.max_code * unit.RESULT_FORMAT.step
    exact, formula = (
        np.minimum(1 - beta * cosine, largest)
        for cosine in (np.cos(2 * np.pi * turns), np.where(back, line - 1, 1 - line))
    )
    return Sample(found.values, exact, formula, 360 * (turns % 1))


def _angular_setup(rng, count, unit):
    left, right = _ends(rng, count, 150.0)
    vector = _vectors_near(rng, left, right)
    length = _lengths(rng, count, 2)
    pixel = _pixels(rng, length)
    _, phase, step, cos_beta, _ = unit.compute(*_vectors(left, right, vector), length)
    found = cos_beta.values * np.cos(2 * np.pi * (phase.values - pixel * step.values))
    a, b = (_dot(normal, vector) / ONE**2 for normal in (left, right))
    chord, across = (_dot(v, v) / ONE**2 for v in (right - left, right + left))
    # Of the two half-angle functions the smaller is the well-conditioned one.
    acute = across >= chord
    sine = np.where(acute, np.sqrt(chord) / 2, np.sqrt(np.maximum(1 - across / 4, 0)))
    cosine = np.where(acute, np.sqrt(np.maximum(1 - chord / 4, 0)), np.sqrt(across) / 2)
    x = (a + b) / 2 / cosine
    y = np.divide(_dot(right - left, vector) / ONE**2 / 2, sine, out=np.zeros(count), where=sine > 0)
    angle = 2 * np.arctan2(sine, cosine)
    early = late = angle
    if unit.angle == "arccos":
        cross = _dot(left, right) / ONE**2
        at_bound = np.abs(np.abs(cross)[:, np.newaxis] - SEGMENT_BOUNDS[1:-1]).min(axis=1) < 2.0**-16
        early, late = (
            unit.arccos.polynomial(np.clip(cross + at_bound * way, -1, 1)) for way in (-(2.0**-16), 2.0**-16)
        )
    turned = (pixel / (length - 1) - 0.5) * np.stack([angle, early, late])
    exact, early, late = x * np.cos(turned) + y * np.sin(turned)
    # At the bound of two segments rounding decides, and the one that the unit took counts.
    formula = np.where(np.abs(found - early) < np.abs(found - late), early, late)
    return Sample(found, exact, formula, _degrees(left, right)[:, 0])


def _chord(rng, count):
    left, right = _ends(rng, count, 180.0)
    exact = _dot(right - left, right - left) / 2 * _STEP**2
    found = Chord().operand(*_vectors(left, right)).values
    limit = Chord.ARGUMENT_FORMAT.max_code * Chord.ARGUMENT_FORMAT.step
    exact = np.minimum(exact, limit)
    return Sample(found, exact, exact, _degrees(left, right)[:, 0])


def _interpolator(rng, count, method):
    """N.L and ``1 - N.H`` along spans; 1 is the product of two unit vectors."""
    p = METHODS[method]
    one = 1.0 if method in _IN_TURNS else ONE_SQUARED.values

    def samples():
        for length in np.array_split(_span_lengths(rng, count), _GROUPS):
            spans = len(length)
            light, halfway = _sphere(rng, 1), _sphere(rng, 1)
            around = np.repeat(halfway, spans, axis=0)
            left = _turned(rng, around, rng.permutation(_angles(rng, spans, 180.0)))
            angles = rng.permutation(_angles(rng, spans, min(p.MAX_ANGLE, 45.0)))
            left, right = quantise(left), quantise(_turned(rng, left, angles))
            light, halfway = quantise(light), quantise(halfway)
            operands = p.compute(*_vectors(left, right), length, *_vectors(light, halfway))
            highlight = operands.highlight.values[:, 0] / one
            if p.operand == "cosine":
                highlight = 1 - highlight
            found = np.stack([operands.cosine.values[:, 0] / one, highlight])
            span, pixel = pixels_of(length)
            t = pixel / np.maximum(length - 1, 1)[span]
            left, right, light, halfway = (normalise(v / ONE) for v in (left, right, light, halfway))
            exact, formula = (
                np.stack([normals @ light[0], 1 - normals @ halfway[0]])
                for normals in (
                    interpolate("normalised", left[span], right[span], t),
                    p.exact_normals(left[span], right[span], t),
                )
            )
            kept = ~operands.out_of_range[span]
            angle = _degrees(left * ONE, right * ONE)[span[kept], 0]
            yield Sample(found[:, kept], exact[:, kept], formula[:, kept], angle)

    return _joined(samples())


def _chord_setup(rng, count):
    """N.L and u at any pixel that the differences lead to; 1 is the product of two unit vectors."""
    length = _lengths(rng, count, 2)
    left, right = _ends(rng, count, ChordSetup.MAX_ANGLE)
    light, halfway = quantise(_sphere(rng, count)), _vectors_near(rng, left, right)
    pixel = _pixels(rng, length)
    # Each span has lights of its own.
    lights = (vector[:, np.newaxis] for vector in (light, halfway))
    diffuse, highlight, _ = ChordSetup().compute(*_vectors(left, right, *lights), length)
    t = pixel / (length - 1)
    normals = interpolate("quadratic", *(normalise(end / ONE) for end in (left, right)), t)
    exact = np.stack([_dot(normals, normalise(light / ONE)), 1 - _dot(normals, normalise(halfway / ONE))])
    k = pixel.astype(np.float64)
    found = [
        w.start.values[:, 0] + k * w.first.values[:, 0] + k * (k - 1) / 2 * w.second.values[:, 0]
        for w in (diffuse, highlight)
    ]
    return Sample(np.stack(found) / ONE_SQUARED.values, exact, exact, _degrees(left, right)[:, 0])


def _local_curves(rng: np.random.Generator, spans: int) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """N.L and ``1 - N.H`` at places of so many spans, whose lights and viewer are near."""
    start = rng.normal(size=(spans, 3))
    step = rng.uniform(0, 0.3, (spans, 1)) * _sphere(rng, spans)
    to_viewer = _sphere(rng, spans)
    to_light = _turned(rng, to_viewer, rng.uniform(0, 120, spans))
    viewer, light = (start + rng.uniform(2, 4, (spans, 1)) * way for way in (to_viewer, to_light))
    left = _turned(rng, normalise(to_viewer + to_light), rng.permutation(_angles(rng, spans, 90.0)))
    right = _turned(rng, left, rng.permutation(_angles(rng, spans, 15.0)))

    def at(span, t):
        place = start[span] + t[:, np.newaxis] * step[span]
        ways = [normalise(point[span] - place) for point in (light, viewer)]
        normal = interpolate("normalised", left[span], right[span], t)
        return np.stack([_dot(normal, ways[0]), 1 - _dot(normal, normalise(ways[0] + ways[1]))])

    return at


def _three_values(at, spans: int) -> tuple[np.ndarray, SpanValues]:
    """Exact values at the ends and the middle, shape (2, spans, 3), and their codes for one light."""
    exact = np.stack([at(np.arange(spans), np.full(spans, t)) for t in (0.0, 0.5, 1.0)], axis=-1)
    return exact, SpanValues.quantise(*exact[:, :, np.newaxis])


def _parabola(values: np.ndarray, t: np.ndarray) -> np.ndarray:
    left, middle, right = np.moveaxis(values, -1, 0)
    return left + t * (4 * middle - right - 3 * left + t * 2 * (left + right - 2 * middle))


def _local_chord_setup(rng, count):
    """N.L and u at any pixel that the differences lead to; 1 is the product of two unit vectors."""
    length = _lengths(rng, count, 2)
    pixel = _pixels(rng, length)
    values, codes = _three_values(_local_curves(rng, count), count)
    unit = LocalChordSetup()
    *words, out_of_range = unit.compute(
        Fixed(unit.DIFFUSE_FORMAT, codes.diffuse), Fixed(unit.HIGHLIGHT_FORMAT, codes.highlight), length
    )
    k = pixel.astype(np.float64)
    found = [
        w.start.values[:, 0] + k * w.first.values[:, 0] + k * (k - 1) / 2 * w.second.values[:, 0]
        for w in words
    ]
    kept = ~out_of_range
    exact = _parabola(values, pixel / (length - 1))[:, kept]
    return Sample(np.stack(found)[:, kept] / ONE_SQUARED.values, exact, exact, pixel[kept])


def _local_chord_interpolator(rng, count):
    """N.L and ``1 - N.H`` along spans; 1 is the product of two unit vectors."""
    length = _span_lengths(rng, count)
    curves = _local_curves(rng, len(length))
    values, codes = _three_values(curves, len(length))
    operands = LocalChordInterpolator().compute_values(codes, length)
    span, pixel = pixels_of(length)
    t = pixel / np.maximum(length - 1, 1)[span]
    found = np.stack([operands.cosine.values[:, 0], operands.highlight.values[:, 0]]) / ONE_SQUARED.values
    kept = ~operands.out_of_range[span]
    exact, formula = curves(span, t), _parabola(values[:, span], t)
    # Between its three values a parabola may dip under 0, which is the least that the word holds.
    formula[1] = np.maximum(formula[1], 0)
    return Sample(found[:, kept], exact[:, kept], formula[:, kept], pixel[kept])


def _recurrence_setup(rng, count):
    """Cosine at any pixel that the start values and the coefficient lead to."""
    length = _lengths(rng, count)
    left, right = _ends(rng, count, 90.0)
    vector = _vectors_near(rng, left, right)
    pixel = _pixels(rng, length)
    first, second, coefficient, shift, _ = RecurrenceSetup().compute(*_vectors(left, right, vector), length)
    steps, phase = np.divmod(pixel, 4)
    start, rise = (word.values[np.arange(count), phase] for word in (first, second))
    bend = coefficient.values * 4 * 2.0**-shift
    turn = 2 * np.arcsin(np.sqrt(bend) / 2)
    turns = steps * np.sinc(steps * turn / np.pi) / np.sinc(turn / np.pi)
    found = start * np.cos(steps * turn) + (rise + start * bend / 2) * turns
    a, b = (_dot(normal, vector) / ONE**2 for normal in (left, right))
    psi = 2 * np.arcsin(np.sqrt(_dot(right - left, right - left)) / (2 * ONE))
    t = pixel / np.maximum(length - 1, 1)
    weights = (part * np.sinc(part * psi / np.pi) / np.sinc(psi / np.pi) for part in (1 - t, t))
    exact = sum(end * weight for end, weight in zip((a, b), weights, strict=True))
    return Sample(found, exact, exact, np.degrees(psi))


def _highlight_gate(rng, count):
    """Whether a span is let through, and whether any of its pixels has a term."""
    gate, interpolator = HighlightGate(), QuadraticInterpolator()

    def samples():
        for exponent, share in _exponents(rng, count):
            edge = np.degrees(np.arccos(np.sqrt(gate.thresholds.values[exponent])))
            halfway = _sphere(rng, share)
            left = _turned(rng, halfway, rng.uniform(0, 2, share) * edge)
            right = _turned(rng, left, rng.permutation(_angles(rng, share, MAX_SPAN_ANGLE)))
            left, right, halfway = (quantise(v) for v in (left, right, halfway))
            length = np.floor(17 ** rng.random(share)).astype(np.int64)
            right[length == 1] = left[length == 1]
            lit = gate.compute(*_vectors(left, right, halfway), exponent)
            normals, out_of_range = interpolator.normals(*_vectors(left, right), length)
            span, pixel = pixels_of(length)
            cosine = DotProduct().compute(normals, *_vectors(halfway[span]))
            term = gate.specular.compute(cosine, np.zeros(len(span), bool), exponent)
            shows = np.maximum.reduceat(term.codes, np.flatnonzero(pixel == 0)) > 0
            kept = ~out_of_range
            yield Decisions.of(lit[kept], shows[kept], _degrees(left, right)[kept, 0])

    return _joined(samples())


def _pipeline(rng, count, method, model):
    design = preset(method, model)
    interpolator = design.interpolator
    reflection = {"ambient": 0.1, "diffuse": 0.5, "specular": 0.4}
    ambient, k_d, k_s = reflection.values()
    grey = {name: np.tile(Intensity.color(k), 3) for name, k in reflection.items()}
    exponents = [1, 10, 100, MAX_EXPONENT]
    exponents += np.floor((MAX_EXPONENT + 1) ** rng.random(_GROUPS - len(exponents))).astype(int).tolist()

    def samples():
        lengths = np.array_split(_span_lengths(rng, count), _GROUPS)
        for exponent, length in zip(exponents, lengths, strict=True):
            viewer = _sphere(rng, 1)
            light = _turned(rng, viewer, rng.uniform(0, 120, 1))
            halfway = normalise(light + viewer)
            widest = min(interpolator.widest_span(exponent), MAX_SPAN_ANGLE)
            around = np.repeat(halfway, len(length), axis=0)
            left = _turned(rng, around, rng.permutation(_angles(rng, len(length), 60.0)))
            right = _turned(rng, left, rng.permutation(_angles(rng, len(length), widest)))
            left, right, light, halfway = (quantise(v) for v in (left, right, light, halfway))
            constants = FrameConstants(
                exponent,
                grey["ambient"],
                light,
                halfway,
                grey["diffuse"][np.newaxis],
                grey["specular"][np.newaxis],
            )
            place = np.zeros_like(length)
            found = design.compute(Spans(place, place, length, left, right), constants).color[:, 0]
            span, pixel = pixels_of(length)
            t = pixel / np.maximum(length - 1, 1)[span]
            ends = [normalise(end / ONE)[span] for end in (left, right)]
            shades = []
            for normal, name in (
                (interpolate("normalised", *ends, t), "blinn"),
                (interpolator.exact_normals(*ends, t), model),
            ):
                cosine = normal @ light[0] / ONE
                highlight = REFLECTION_MODELS[name].reflect(normal @ halfway[0] / ONE, exponent) * (
                    cosine > 0
                )
                shades.append(255 * np.minimum(ambient + k_d * np.maximum(cosine, 0) + k_s * highlight, 1))
            # Behind the light the highlight is cut off at once, wherever rounding puts that.
            kept = cosine > 1 / 16
            angle = _degrees(left, right)[span[kept], 0]
            yield Sample(found[kept].astype(np.float64), shades[0][kept], shades[1][kept], angle)

    return _joined(samples())


# The table.

_PUBLISHED_MODELS = ("cosquad", "cosquad7", "cosquad_lin")
_SPANS_45 = "spans to 45 degrees"
_HIGHLIGHTS = "n 1 to 1000, N.H 0 to 1"
_LONG = "2 to 4095 pixels"
_Z_AXIS = [0, 0, ONE]
_SPAN = {"normal_left": _Z_AXIS, "normal_right": _Z_AXIS, "length": 64}
_METHOD_SOURCES = dict.fromkeys(METHODS, "[T] 2.2") | {
    "linear": "[T] 2.1",
    "bisection": "[T] 2.7",
    "angular": "[T] 3.1",
    "recurrence": "[T] 3.3",
    "renormalise": "numbers",
    "chord": "chord.md",
}
_IN_TURNS = ("angular", "recurrence")
"""Methods of which 1 is 1; of the others 1 is the product of two unit vectors' codes."""

_AXES = {
    "dot_product": ("a · b", False),
    "difference_setup": ("pixel of the span", True),
    "difference_accumulator": ("pixel of the span", True),
    "quadratic_evaluator": ("pixel of the span", True),
    "recurrence": ("pixel of the span", True),
    "local_chord_setup": ("pixel of the span", True),
    "local_chord_interpolator": ("pixel of the span", True),
    "renormaliser": ("length of the vector", False),
    "arccos": ("x", False),
    "half_chord": ("angle, degrees", False),
    "highlight_cosine": ("angle, degrees", False),
    "diffuse": ("N · L", False),
    "specular": ("n (1 - cos γ)", True),
    "power": ("n (1 - cos γ)", True),
    "light": ("n (1 - cos γ)", True),
    "intensity": ("exact sum, LSB", False),
}
"""What errors are drawn against, and whether by its logarithm; where nothing is said, the span's angle."""


def _blocks() -> Iterator[Block]:
    yield Block(
        "dot_product", "", "[T] 2.5", DotProductUnit, _dot_product, "all vectors of SQ(1, 17)", note="exact"
    )
    for fit in MIDDLE_NORMAL_FITS:
        unit = MiddleNormal(fit)
        yield Block(
            "middle_normal",
            fit,
            "[T] 2.2",
            partial(MiddleNormalUnit, unit),
            partial(_middle_normal, unit=unit),
            _SPANS_45,
        )
    yield Block(
        "middle_normal",
        "exact, interval 1",
        "[T] 2.2",
        partial(MiddleNormalUnit, initiation_interval=1),
        partial(_middle_normal, unit=MiddleNormal()),
        _SPANS_45,
    )
    yield Block("gpq", "", "[T] 2.8", GPQUnit, _gpq, _SPANS_45, note="exact")
    for variant, published, interval in (
        ("", False, None),
        ("interval 1", False, 1),
        ("as published", True, None),
    ):
        unit = DifferenceSetup(published)
        yield Block(
            "difference_setup",
            variant,
            "[T] 2.11",
            partial(DifferenceSetupUnit, unit, initiation_interval=interval),
            partial(_difference_setup, unit=unit),
            f"{_SPANS_45}, {_LONG}",
            note="of the curve at any pixel that the differences lead to",
        )
    yield Block(
        "difference_accumulator",
        "",
        "[T] 2.10",
        DifferenceAccumulatorUnit,
        _difference_accumulator,
        f"{_SPANS_45}, 1 to 4095 pixels",
        beat={"length": 64},
    )
    for form, figure in zip(QUADRATIC_FORMS, "ab", strict=True):
        yield Block(
            "quadratic_evaluator",
            form,
            f"[T] 2.9 {figure}",
            partial(QuadraticEvaluatorUnit, QuadraticEvaluator(form)),
            partial(_quadratic_evaluator, form=form),
            f"{_SPANS_45}, {_LONG}",
            beat={"length": 64},
        )
    for degree in (1, 2):
        for max_angle, published in ((90, False), (45, False), (90, True), (45, True)):
            p = Bisection(degree, max_angle, published)
            yield Block(
                "bisection",
                f"{degree}, {max_angle}" + ", as published" * published,
                "[T] 2.6",
                partial(BisectionUnit, p),
                partial(_bisection, p=p),
                f"spans to {max_angle} degrees",
                note=f"degree {degree}",
            )
    for published in (False, True):
        chain = BisectionChain(Bisection(as_published=published))
        yield Block(
            "bisection_chain",
            "as published" if published else "",
            "[T] 2.1",
            partial(BisectionChainUnit, chain),
            partial(_bisection_chain, chain=chain),
            "spans to 90 degrees, levels 1 to 15",
            beat={"normal_left": _Z_AXIS, "normal_right": _Z_AXIS, "level": 1},
            note="times of level 1",
        )
    for exponent, published in ((6, False), (10, False), (14, False), (10, True)):
        p = AdaptiveNormaliser(2.0**-exponent, Bisection(as_published=published))
        yield Block(
            "adaptive_normaliser",
            f"threshold 2^-{exponent}" + ", as published" * published,
            "[T] 2.7",
            partial(AdaptiveNormaliserUnit, p),
            partial(_adaptive_normaliser, p=p),
            "spans to 90 degrees, 1 to 4095 pixels",
            beat=_SPAN,
            note="model: straight lines; the bisection's fit counts as arithmetic; latency of equal normals",
        )
    yield Block("renormaliser", "", "numbers", RenormaliserUnit, _renormaliser, "lengths 0.685 to 1.0155")
    for table in ARCCOS_TABLES:
        for form in ("pipelined", "sequential"):
            yield Block(
                "arccos",
                f"{table}, {form}",
                "[T] 3.3",
                partial(ArccosUnit, Arccos(table), form=form),
                partial(_arccos, table=table),
                "x -1 to 1",
                "rad",
                exhaustive=True,
            )
    yield Block(
        "half_chord",
        "",
        "[T] 3.3",
        HalfChordUnit,
        _half_chord,
        "angles 0 to 180 degrees",
        "turn",
        note="model: the root by lines, the factor by its polynomial",
    )
    for interpolated in (True, False):
        unit = HighlightCosine(interpolated=interpolated)
        yield Block(
            "highlight_cosine",
            "interpolated" if interpolated else "table alone",
            "[T] 3.2",
            partial(HighlightCosineUnit, unit),
            partial(_highlight_cosine, unit=unit),
            "all angles, cos beta 0 to 1",
            beat={"length": 64},
            note="model: the cosine by the table's lines" if interpolated else "model: the table",
        )
    setups = {"half chord": AngularSetup()}
    setups |= {f"arccos {table}": AngularSetup("arccos", Arccos(table)) for table in ARCCOS_TABLES}
    for variant, unit in setups.items():
        yield Block(
            "angular_setup",
            variant,
            "[T] 3.1",
            partial(AngularSetupUnit, unit),
            partial(_angular_setup, unit=unit),
            f"spans to 150 degrees, {_LONG}",
            note="of cos gamma at any pixel; the tables count as arithmetic, but not that of arccos",
        )
    recurrences = [(form, interleave, False) for form in RECURRENCE_FORMS for interleave in (1, 4)]
    for form, interleave, shortcut in [*recurrences, ("reinsch", 1, True)]:
        unit = Recurrence(form, interleave=interleave)
        yield Block(
            "recurrence",
            form + ", interleaved" * (interleave > 1) + ", shortcut" * shortcut,
            "[T] 3.3" if shortcut else "[T] 3.5",
            partial(RecurrenceUnit, unit),
            partial(_recurrence, unit=unit, shortcut=shortcut),
            f"spans to 90 degrees, {_LONG}",
            beat={"length": 64},
            note="the same unit, given cos d = 1 - (1 - cos psi)/(m - 1)^2" if shortcut else "",
        )
    yield Block("diffuse", "", "[B] 4", DiffuseUnit, _diffuse, "N.L -1 to 1")
    served = {name: p for name, p in MODELS.items() if isinstance(p, Specular)}
    sources = {name: p.model.source for name, p in served.items()}
    for model, source in sources.items():
        yield Block(
            "specular",
            model,
            source,
            partial(SpecularUnit, Specular(REFLECTION_MODELS[model])),
            partial(_highlight, unit=Specular(REFLECTION_MODELS[model]), model=model),
            _HIGHLIGHTS,
        )
    yield Block(
        "specular",
        "cosquad, interval 2",
        sources["cosquad"],
        partial(SpecularUnit, initiation_interval=2),
        partial(_highlight, unit=Specular(), model="cosquad"),
        _HIGHLIGHTS,
    )
    for model in _PUBLISHED_MODELS:
        unit = Specular(REFLECTION_MODELS[model], as_published=True)
        yield Block(
            "specular",
            f"{model}, as published",
            sources[model],
            partial(SpecularUnit, unit),
            partial(_highlight, unit=unit, model=model),
            _HIGHLIGHTS,
            note="comparator on the square, so that the parabola's second lobe shows",
        )
    for form in ("pipelined", "sequential"):
        yield Block(
            "power",
            form,
            "[B] 3",
            partial(PowerUnit, form=form),
            partial(_highlight, unit=Power(), model="blinn"),
            _HIGHLIGHTS,
        )
    yield Block(
        "light", "cosquad", "[T] 4.10", LightUnit, partial(_light, model="cosquad"), "n 1 to 1000, N.V > 0"
    )
    yield Block(
        "highlight_gate",
        "conservative",
        "[T] 4.10",
        HighlightGateUnit,
        _highlight_gate,
        "spans to 45 degrees, 1 to 16 pixels, N_l within twice the highlight's radius of H, n 1 to 1000",
        "rate",
        note="of all spans; model: let through for nothing; arithmetic: stopped though a pixel has a term",
    )
    for style, unit in (("throughput", IntensityUnit), ("compact", CompactIntensityUnit)):
        yield Block(
            "intensity",
            f"1 light, {style}",
            "[T] 4.10",
            unit,
            _intensity,
            "all terms",
            "LSB",
        )
    yield Block("chord", "", "chord.md", ChordUnit, _chord, "angles 0 to 180 degrees")
    for interval in (1, 4, 26):
        yield Block(
            "chord_setup",
            f"interval {interval}",
            "chord.md",
            partial(ChordSetupUnit, initiation_interval=interval),
            _chord_setup,
            f"spans to 22.5 degrees, {_LONG}",
            note="of N.L and u at any pixel that the differences lead to; exact: the quadratic",
        )
    yield Block(
        "recurrence_setup",
        "interval 4",
        "[T] 3.3",
        RecurrenceSetupUnit,
        _recurrence_setup,
        "spans to 90 degrees, 1 to 4095 pixels",
        note="of cos gamma at any pixel that its words lead to; the tables count as arithmetic",
    )
    local = "lights and viewer 2 to 4 away, spans to 0.3 and 15 degrees"
    yield Block(
        "local_chord_setup",
        "interval 4",
        "chord.md",
        LocalChordSetupUnit,
        _local_chord_setup,
        f"{local}, {_LONG}",
        note="of N.L and u at any pixel that the differences lead to; exact: the quadratic",
    )
    yield Block(
        "local_chord_interpolator",
        "chord-local",
        "chord.md",
        partial(LocalChordInterpolatorUnit, LocalChordInterpolator(), 1),
        _local_chord_interpolator,
        f"{local}, 1 to 4095 pixels",
        beat={"length": 64},
        note="of N.L and 1 - N.H; exact: normalised interpolation, L and H of the pixel",
    )
    methods = {name: p for name, p in METHODS.items() if not isinstance(p, LocalChordInterpolator)}
    for method, p in methods.items():
        unit = unit_of(p)
        yield Block(
            unit.__module__.rpartition(".")[2],
            method,
            _METHOD_SOURCES[method],
            partial(unit, p, 1),
            partial(_interpolator, method=method),
            f"spans to {min(p.MAX_ANGLE, 45):g} degrees, 1 to 4095 pixels",
            beat=_SPAN,
            note="of N.L and 1 - N.H; exact: normalised interpolation"
            + "; the bisection's fit counts as arithmetic" * (method == "bisection"),
        )
    designs = [("quadratic", model) for model in _PUBLISHED_MODELS]
    designs += [(method, "cosquad") for method in methods if method != "quadratic"]
    designs += [("chord", "exp"), ("chord", "blinn")]
    for method, model in designs:
        yield Block(
            "pipeline",
            f"{method}, {model}",
            "[T] 4.10",
            partial(ShadingPipelineUnit, preset(method, model)),
            partial(_pipeline, method=method, model=model),
            "spans to what the method asks for, 45 degrees at most, 1 to 4095 pixels, n 1 to 1000, "
            "N.L > 1/16",
            "LSB",
            beat=_SPAN,
            note="one light, against normalised Phong interpolation with Blinn's power"
            + "; the bisection's fit counts as arithmetic" * (method == "bisection"),
        )


def _with_axis(block: Block) -> Block:
    axis, logarithmic = _AXES.get(block.device, ("angle of the span, degrees", False))
    return replace(block, axis=axis, logarithmic=logarithmic)


BLOCKS: tuple[Block, ...] = tuple(map(_with_axis, _blocks()))
"""Every device and variant, in the order of the table."""


def _times(block: Block, unit: Component) -> tuple[int, int]:
    """Latency, and cycles from a result to the next: stated by the unit, else found by simulation."""
    latency = getattr(unit, "latency", None)
    interval = getattr(unit, "initiation_interval", getattr(unit, "cycles_per_pixel", None))
    if isinstance(latency, int) and isinstance(interval, int):
        return latency, interval
    beats = np.zeros(3, dtype_of(unit.i.payload.shape()))
    for name, value in block.beat.items():
        beats[name] = value
    run = simulate(unit, beats, count=3 * block.beat.get("length", 1), engine="pysim")
    return int(run.cycles[0] - run.input_cycles[0]), int(np.median(np.diff(run.cycles)))


def rows(
    blocks: Sequence[Block] = BLOCKS, samples: int = SAMPLES, seed: int = SEED, jobs: int = 1
) -> Iterator[Row]:
    """Lines of the table, one after the other.

    Parameters
    ----------
    blocks : sequence of Block
        Entries.
    samples : int
        About how many random operands; 40 or more.
    seed : int
        Of the operands. Every entry starts from it, so that a line does not depend on the others.
    jobs : int
        Processes that the entries are spread over. The lines are the same, and in the same order.
    """
    if jobs == 1 or len(blocks) < 2:
        for block in blocks:
            yield _row(block, samples, seed)
        return
    with local_executor(min(jobs, len(blocks))) as pool:
        waiting = [pool.submit(_row, block, samples, seed) for block in blocks]
        for block, row in zip(blocks, waiting, strict=True):
            yield replace(row.result(), block=block)


def _row(block: Block, samples: int, seed: int) -> Row:
    """Line of an entry, of whose results only the worst are kept."""
    count, worst = 0, []
    for sample in _chunks(block, samples, seed):
        count += np.size(sample.found)
        worst.append(sample.extremes)
    return replace(row_of(block, _joined(worst)), samples=count)


def _chunks(block: Block, samples: int, seed: int) -> Iterator[Sample]:
    rng = np.random.default_rng(seed)
    parts = 1 if block.exhaustive else -(-samples // _CHUNK)
    for part in range(parts):
        yield block.measure(rng, samples * (part + 1) // parts - samples * part // parts)


def sample_of(block: Block, samples: int = SAMPLES, seed: int = SEED) -> Sample:
    """Measure an entry."""
    chunks = list(_chunks(block, samples, seed))
    return chunks[0] if len(chunks) == 1 else _joined(chunks)


def row_of(block: Block, sample: Sample | None) -> Row:
    """Line of an entry whose errors have been measured; `None`: they have not."""
    count, errors = (0, (None, None, None)) if sample is None else (np.size(sample.found), sample.errors)
    unit = block.unit()
    return Row(block, count, errors, *_times(block, unit), cost_of(unit))


_HEAD = (
    "device",
    "variant",
    "source",
    "",
    "model",
    "arithm",
    "total",
    "lat",
    "int",
    "ROM",
    "regs",
    "multipliers",
)


def _figure(error: float | None) -> str:
    if error is None:
        return "-"
    if 10 <= error < 1000:
        return f"{error:.0f}"
    if error == 0 or 0.1 <= error < 10:
        return f"{error:.2g}"
    return f"{error:.1e}".replace("e-0", "e-")


def cells_of(row: Row) -> tuple[str, ...]:
    """A line's cells, as the printed table has them."""
    cost = row.cost
    errors = map(_figure, row.errors)
    widths = sorted(cost.multipliers.items(), reverse=True)
    multipliers = [f"{count}*{a}" if a == b else f"{count}*{a}x{b}" for (a, b), count in widths]
    if cost.constant_multipliers:
        multipliers.append(f"{cost.constant_multipliers}*c")
    return (
        row.block.device,
        row.block.variant,
        row.block.source,
        row.block.scale,
        *errors,
        *map(str, (row.latency, row.interval, cost.rom_bits, cost.register_bits)),
        " ".join(multipliers) or "-",
    )


def table(lines: Sequence[Row]) -> str:
    """The table as aligned text."""
    cells = [_HEAD, *map(cells_of, lines)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    left = {0, 1, 2, 3, len(_HEAD) - 1}
    return "\n".join(
        " ".join(
            text.ljust(width) if k in left else text.rjust(width)
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in cells
    )


class _Count(click.ParamType):
    """A whole number in a range."""

    name = "number"

    def __init__(self, least: int, most: int):
        self.least, self.most = least, most

    def convert(self, value, param, ctx):
        remedy = f"give a whole number from {self.least} to {self.most}"
        if not re.fullmatch("[+-]?[0-9]{1,18}", str(value)):
            raise InputError(f"{param.opts[0]} {value}", "not a whole number", remedy)
        if not self.least <= int(value) <= self.most:
            raise InputError(f"{param.opts[0]} {value}", "out of range", remedy)
        return int(value)


@click.command(short_help="Table of the devices: errors, times, parts.")
@click.option(
    "--samples", type=_Count(1000, 10_000_000), default=SAMPLES, show_default=True, help="Of each device."
)
@click.option("--seed", type=_Count(0, 2**32 - 1), default=SEED, show_default=True, help="Of the operands.")
@click.option(
    "--jobs",
    type=_Count(1, _MOST_JOBS),
    default=lambda: min(os.cpu_count() or 1, 4),
    show_default="number of cores, 4 at most",
    help="Processes, of a quarter of a GB each.",
)
@click.option("--json", "figures", type=OutputFile(), help="Every figure, with domains and notes.")
def command(samples, seed, jobs, figures):
    """Measure every device and variant, and print a table.

    Errors are the largest found: of the model, the device's formula in float64 against the exact function;
    of the arithmetic, the device against that formula; and in total. They are in units of a full term or a
    vector's length, or as the fourth column says; rate: of a gate's decisions, those that let a dark span
    through, those that stop a lit one, and both. For methods of whole spans a sample is a pixel. lat: cycles
    from an input to its first result; int: cycles from a result to the next; ROM and regs in bits;
    multipliers: 3*18 are three of 18x18 bits, 1*c is one by a constant. Of a bisection the variant is the
    degree and the widest span in degrees.

    \b
    Example:
        blysk blocks --jobs 4 --json blocks.json
    """
    if figures:
        check_writable(figures)
    lines = list(
        tqdm(rows(BLOCKS, samples, seed, jobs), total=len(BLOCKS), unit=" rows", leave=False, disable=None)
    )
    if figures:
        write_json(figures, {"samples": samples, "seed": seed, "blocks": [row.as_dict() for row in lines]})
    click.echo(table(lines))
