"""Every device with beats for it, and what its twin makes of them."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from amaranth.lib.wiring import Component

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import Arccos
from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.cosines.local_chord_setup import LocalChordSetup
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator, SpanValues
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed, Format
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED, quantise
from blysk.golden.presets import METHODS
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
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.lighting.intensity import CompactIntensityUnit, IntensityUnit
from blysk.hdl.lighting.light import LightUnit
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.lighting.specular import SpecularUnit
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
from blysk.sim.engines.beats import dtype_of

from ..lists import FURTHER_MODELS, SPECULAR_MODELS

__all__ = ["DEVICES", "Case"]

_EXPONENT = 60
_LIGHTS = 2


class Case(NamedTuple):
    """A unit, its input beats and constants, and the output beats of its twin, as mappings or arrays."""

    unit: Component
    beats: dict | np.ndarray
    expected: dict | np.ndarray
    constants: dict | np.ndarray | None = None


# Operands.


def _codes(rng: np.random.Generator, format: Format, *shape: int) -> np.ndarray:
    """Anywhere in a word; of every size; at its ends."""
    codes = rng.integers(format.min_code, format.max_code, shape, endpoint=True)
    codes[1::3] >>= rng.integers(0, format.width, codes[1::3].shape)
    ends = [format.min_code, format.max_code, 0, 1]
    codes[::16] = rng.choice(ends, codes[::16].shape)
    return rng.permutation(codes)


def _normals(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of unit normals at any angle, of any size; of every sixteenth any words."""
    left = normalise(rng.normal(size=(count, 3)))
    right = normalise(left + 10.0 ** rng.uniform(-5, 1, (count, 1)) * rng.normal(size=(count, 3)))
    left, right = quantise(left), quantise(right)
    for ends in (left, right):
        ends[::16] = _codes(rng, COMPONENT, *ends[::16].shape)
    return left, right


def _vectors(rng: np.random.Generator, count: int) -> np.ndarray:
    return quantise(normalise(rng.normal(size=(count, 3))))


def _lengths(rng: np.random.Generator, pixels: int, least: int = 0) -> np.ndarray:
    """Lengths of spans that have so many pixels; most are short."""
    longest = min(4096, 2 + pixels // 16)
    lengths = np.floor(longest ** rng.random(pixels // 8) ** 3).astype(np.int64)
    lengths = np.maximum(lengths - (1 - least), least)
    lengths = lengths[np.cumsum(lengths) <= pixels]
    rest = pixels - int(lengths.sum())
    return np.r_[lengths, [4095] * (rest // 4095), [rest % 4095] if rest % 4095 else []].astype(np.int64)


def _any_lengths(rng: np.random.Generator, count: int) -> np.ndarray:
    """Lengths of as many spans: short ones as often as long ones."""
    lengths = np.floor(4096 ** rng.random(count)).astype(np.int64)
    lengths[:: count // 4] = 4095
    return lengths


def _fixed(*codes: np.ndarray) -> tuple[Fixed, ...]:
    return tuple(Fixed(COMPONENT, code) for code in codes)


# `rng, count -> Case`, a function a device.


def _dot_product(rng, count):
    a, b = (_codes(rng, COMPONENT, count, 3) for _ in range(2))
    return Case(DotProductUnit(), {"a": a, "b": b}, DotProduct().compute(*_fixed(a, b)).codes)


def _middle_normal(rng, count, fit, interval):
    twin = MiddleNormal(fit)
    left, right = _normals(rng, count)
    beats = {"normal_left": left, "normal_right": right}
    middle, out_of_range = twin.compute(*_fixed(left, right))
    return Case(
        MiddleNormalUnit(twin, initiation_interval=interval),
        beats,
        {**beats, "normal_middle": middle.codes, "out_of_range": out_of_range},
    )


def _gpq(rng, count):
    left, right = _normals(rng, count)
    middle = _codes(rng, MiddleNormal.FORMAT, count, 3)
    middle[::2] = MiddleNormal().compute(*_fixed(left, right))[0].codes[::2]
    words = GPQ().compute(Fixed(COMPONENT, left), Fixed(MiddleNormal.FORMAT, middle), Fixed(COMPONENT, right))
    return Case(
        GPQUnit(),
        {"normal_left": left, "normal_middle": middle, "normal_right": right},
        {name: word.codes for name, word in zip("gpq", words, strict=True)},
    )


def _curves(rng, count) -> dict[str, Fixed]:
    formats = {"g": GPQ.G_FORMAT, "p": GPQ.P_FORMAT, "q": COMPONENT}
    return {name: Fixed(format, _codes(rng, format, count, 3)) for name, format in formats.items()}


def _difference_setup(rng, count, twin, interval):
    curves, length = _curves(rng, count), _any_lengths(rng, count)
    first, second = twin.compute(curves["g"], curves["p"], length)
    return Case(
        DifferenceSetupUnit(twin, initiation_interval=interval),
        {name: word.codes for name, word in curves.items()} | {"length": length},
        {"start": curves["q"].codes, "first": first.codes, "second": second.codes, "length": length},
    )


def _difference_accumulator(rng, count):
    length, twin = _lengths(rng, count), DifferenceAccumulator()
    formats = {"start": COMPONENT, "first": twin.format, "second": twin.format}
    words = {name: Fixed(format, _codes(rng, format, len(length), 3)) for name, format in formats.items()}
    normals = twin.compute(*words.values(), *pixels_of(length))
    beats = {name: word.codes for name, word in words.items()} | {"length": length}
    return Case(DifferenceAccumulatorUnit(), beats, normals.codes)


def _quadratic_evaluator(rng, count, form):
    length, twin = _lengths(rng, count), QuadraticEvaluator(form)
    curves = _curves(rng, len(length))
    normals = twin.compute(*curves.values(), np.maximum(length, 1), *pixels_of(length))
    beats = {name: word.codes for name, word in curves.items()} | {"length": length}
    return Case(QuadraticEvaluatorUnit(twin), beats, normals.codes)


def _bisection(rng, count, twin):
    left, right = _normals(rng, count)
    middle, u, out_of_range = twin.compute(*_fixed(left, right))
    return Case(
        BisectionUnit(twin),
        {"normal_a": left, "normal_b": right},
        {"normal_middle": middle.codes, "one_minus_cosine": u.codes, "out_of_range": out_of_range},
    )


def _bisection_chain(rng, count):
    left, right = _normals(rng, count)
    # Most are short, as a level takes 17 cycles.
    level = 1 + (rng.zipf(2, count) - 1) % ((1 << BisectionChain.LEVEL_BITS) - 1)
    normal, out_of_range = BisectionChain().compute(*_fixed(left, right), level)
    return Case(
        BisectionChainUnit(),
        {"normal_left": left, "normal_right": right, "level": level},
        {"normal": normal.codes, "out_of_range": out_of_range},
    )


def _adaptive_normaliser(rng, count):
    length = _lengths(rng, count)
    left, right = _normals(rng, len(length))
    normal, out_of_range, _ = AdaptiveNormaliser().compute(*_fixed(left, right), length)
    span, pixel = pixels_of(length)
    return Case(
        AdaptiveNormaliserUnit(),
        {"normal_left": left, "normal_right": right, "length": length},
        {"normal": normal.codes, "out_of_range": out_of_range[span], "last": pixel == length[span] - 1},
    )


def _renormaliser(rng, count):
    vector = np.rint(_vectors(rng, count) * rng.uniform(0.5, 1, (count, 1))).astype(np.int64)
    vector[::8] = _codes(rng, COMPONENT, *vector[::8].shape)
    normal, out_of_range = Renormaliser().compute(*_fixed(vector))
    return Case(RenormaliserUnit(), vector, {"normal": normal.codes, "out_of_range": out_of_range})


def _arccos(rng, count, form):
    x = _codes(rng, Arccos.OPERAND_FORMAT, count)
    angle, outside = Arccos().compute(Fixed(Arccos.OPERAND_FORMAT, x))
    return Case(ArccosUnit(form=form), x, {"angle": angle.codes, "outside": outside})


def _half_chord(rng, count):
    # A chord is at most that of a right angle; the supplement stands for wider ones.
    chord = np.minimum(_codes(rng, HalfChord.OPERAND_FORMAT, count), 1 << 35)
    supplement = rng.random(count) < 0.5
    expected = HalfChord().compute(Fixed(HalfChord.OPERAND_FORMAT, chord), supplement)
    return Case(HalfChordUnit(), {"chord_squared": chord, "supplement": supplement}, expected.codes)


def _highlight_cosine(rng, count, interpolated):
    length, twin = _lengths(rng, count), HighlightCosine(interpolated=interpolated)
    words = {
        name: Fixed(format, _codes(rng, format, len(length)))
        for name, format in (
            ("phase", twin.PHASE_FORMAT),
            ("step", twin.STEP_FORMAT),
            ("cos_beta", twin.COS_BETA_FORMAT),
        )
    }
    expected = twin.compute(*words.values(), *pixels_of(length))
    beats = {name: word.codes for name, word in words.items()} | {"length": length}
    return Case(HighlightCosineUnit(twin), beats, expected.codes)


def _angular_setup(rng, count, twin):
    (left, right), vector, length = _normals(rng, count), _vectors(rng, count), _any_lengths(rng, count)
    angle, phase, step, cos_beta, out_of_range = twin.compute(*_fixed(left, right, vector), length)
    words = {"angle": angle, "phase": phase, "step": step, "cos_beta": cos_beta}
    return Case(
        AngularSetupUnit(twin),
        {"normal_left": left, "normal_right": right, "vector": vector, "length": length},
        {name: word.codes for name, word in words.items()} | {"length": length, "out_of_range": out_of_range},
    )


def _recurrence(rng, count, twin):
    length = _lengths(rng, count)
    step = np.radians(rng.uniform(0, 89, len(length))) / np.maximum(length - 1, 1)
    coefficient, shift = twin.coefficient(step)
    beats, expected = {"coefficient": coefficient.codes, "length": length}, {}
    if twin.form == "reinsch":
        beats["shift"] = shift
    span, pixel = pixels_of(length)
    for name in ("diffuse", "highlight"):
        words = twin.start(rng.uniform(-1, 1, len(length)), rng.uniform(-np.pi, np.pi, len(length)), step)
        beats[name] = dict(zip(("first", "second"), (word.codes for word in words), strict=True))
        expected[name] = twin.compute(*words, coefficient, shift, span, pixel).codes
    expected["last"] = pixel == length[span] - 1
    return Case(RecurrenceUnit(twin), beats, expected)


def _diffuse(rng, count):
    cosine = Fixed(Diffuse().operand_format, _codes(rng, Diffuse().operand_format, count))
    return Case(DiffuseUnit(), cosine.codes, Diffuse().compute(cosine).codes)


def _cosines(rng, count, twin) -> Fixed:
    """Operands of a specular unit: half of them where the highlight is, the others anywhere."""
    codes = _codes(rng, twin.operand_format, count)
    size = np.floor(rng.uniform(0, 4 / _EXPONENT, count) * ONE_SQUARED.codes).astype(np.int64)
    near = ONE_SQUARED.codes - size if twin.operand == "cosine" else size >> 9
    return Fixed(twin.operand_format, np.where(rng.random(count) < 0.5, near, codes))


def _specular(rng, count, twin, unit):
    operand, dark = _cosines(rng, count, twin), rng.random(count) < 0.1
    return Case(
        unit(twin),
        {"operand": operand.codes, "dark": dark},
        twin.compute(operand, dark, _EXPONENT).codes,
        {"exponent": _EXPONENT},
    )


def _light(rng, count):
    twin = Specular()
    cosine = Fixed(Diffuse().operand_format, _codes(rng, Diffuse().operand_format, count))
    highlight = _cosines(rng, count, twin)
    specular = twin.compute(highlight, Diffuse.dark(cosine), _EXPONENT)
    return Case(
        LightUnit(twin),
        {"cosine": cosine.codes, "highlight": highlight.codes},
        {"diffuse": Diffuse().compute(cosine).codes, "specular": specular.codes},
        {"exponent": _EXPONENT},
    )


def _highlight_gate(rng, count):
    twin, (left, right), halfway = HighlightGate(), _normals(rng, count), _vectors(rng, 1)
    near = normalise(halfway + 20000 * rng.normal(size=left[::2].shape))
    left[::2] = quantise(near)
    lit = twin.compute(*_fixed(left, right, halfway[0]), _EXPONENT)
    return Case(
        HighlightGateUnit(twin),
        {"normal_left": left, "normal_right": right},
        lit,
        {"halfway": halfway, "exponent": _EXPONENT},
    )


def _intensity(rng, count, unit):
    twin = Intensity(_LIGHTS)
    terms = rng.integers(0, twin.TERM_FORMAT.max_code, (2, count, _LIGHTS), endpoint=True)
    terms *= rng.random(terms.shape) < rng.random((1, count, 1))
    ambient, *colors = (rng.integers(0, 255 * 64, shape) for shape in ((3,), (_LIGHTS, 3), (_LIGHTS, 3)))
    channels = twin.compute(
        *(Fixed(twin.COLOR_FORMAT, color) for color in (ambient, *colors)),
        *(Fixed(twin.TERM_FORMAT, term) for term in terms),
    )
    return Case(
        unit(twin),
        {"diffuse": terms[0], "specular": terms[1]},
        dict(zip("rgb", channels.T, strict=True)),
        {"ambient": ambient, "diffuse": colors[0], "specular": colors[1]},
    )


def _chord(rng, count):
    left, right = _normals(rng, count)
    return Case(ChordUnit(), {"a": left, "b": right}, Chord().operand(*_fixed(left, right)).codes)


def _constants(unit, direction, halfway) -> np.ndarray:
    constants = np.zeros(len(direction), dtype_of(unit.constants.shape().elem_shape))
    constants["direction"], constants["halfway"] = direction, halfway
    return constants


def _differences(unit, words, length, out_of_range) -> np.ndarray:
    """Output beats of a setup of differences."""
    expected = np.zeros(len(length), dtype_of(unit.o.payload.shape()))
    for name, differences in zip(("diffuse", "highlight"), words, strict=True):
        for field in ("start", "first", "second"):
            expected["lights"][name][field] = getattr(differences, field).codes
    expected["length"], expected["out_of_range"] = length, out_of_range
    return expected


def _chord_setup(rng, count, interval):
    unit = ChordSetupUnit(None, _LIGHTS, initiation_interval=interval)
    (left, right), length = _normals(rng, count), _any_lengths(rng, count)
    vectors = [_vectors(rng, _LIGHTS) for _ in range(2)]
    *words, out_of_range = ChordSetup().compute(*_fixed(left, right, *vectors), length)
    return Case(
        unit,
        {"normal_left": left, "normal_right": right, "length": length},
        _differences(unit, words, length, out_of_range),
        _constants(unit, *vectors),
    )


def _recurrence_setup(rng, count):
    unit, twin = RecurrenceSetupUnit(lights=_LIGHTS), RecurrenceSetup()
    (left, right), length = _normals(rng, count), _any_lengths(rng, count)
    vectors = [_vectors(rng, _LIGHTS) for _ in range(2)]
    expected = np.zeros(count, dtype_of(unit.o.payload.shape()))
    for name, of_lights in zip(("diffuse", "highlight"), vectors, strict=True):
        for light, vector in enumerate(of_lights):
            first, second, coefficient, shift, out_of_range = twin.compute(
                *_fixed(left, right, vector), length
            )
            expected["lights"][name]["first"][:, light] = first.codes
            expected["lights"][name]["second"][:, light] = second.codes
    expected["coefficient"], expected["shift"] = coefficient.codes, shift
    expected["length"], expected["out_of_range"] = length, out_of_range
    beats = {"normal_left": left, "normal_right": right, "length": length}
    return Case(unit, beats, expected, _constants(unit, *vectors))


def _values(rng, count) -> SpanValues:
    """N.L and 1 - N.H at three places: a part of them anywhere, the others on a curve that fits."""
    values = []
    for format in (LocalChordSetup.DIFFUSE_FORMAT, LocalChordSetup.HIGHLIGHT_FORMAT):
        codes = _codes(rng, format, count, _LIGHTS, 3)
        bend = 10.0 ** rng.uniform(-5, -0.5, (count, 1, 1)) * rng.uniform(-0.3, 0.3, (count, _LIGHTS, 3))
        curve = np.clip(codes[..., :1] + bend * format.max_code, format.min_code, format.max_code)
        values.append(np.where(np.arange(count)[:, None, None] % 8, curve.astype(np.int64), codes))
    return SpanValues(*values)


def _value_beats(unit, values, length) -> np.ndarray:
    beats = np.zeros(len(length), dtype_of(unit.i.payload.shape()))
    beats["values"]["diffuse"], beats["values"]["highlight"] = values
    beats["length"] = length
    return beats


def _local_chord_setup(rng, count):
    unit, twin = LocalChordSetupUnit(None, _LIGHTS), LocalChordSetup()
    values, length = _values(rng, count), _any_lengths(rng, count)
    formats = twin.DIFFUSE_FORMAT, twin.HIGHLIGHT_FORMAT
    *words, out_of_range = twin.compute(*map(Fixed, formats, values), length)
    return Case(unit, _value_beats(unit, values, length), _differences(unit, words, length, out_of_range))


def _operands(unit, operands) -> np.ndarray:
    expected = np.zeros(operands.cosine.codes.shape, dtype_of(unit.o.payload.shape().elem_shape))
    expected["cosine"], expected["highlight"] = operands.cosine.codes, operands.highlight.codes
    return expected


def _interpolator(rng, count, method):
    twin = METHODS[method]
    unit = unit_of(twin)(twin, _LIGHTS)
    length = _lengths(rng, count, 1)
    if isinstance(twin, LocalChordInterpolator):
        values = _values(rng, len(length))
        expected = _operands(unit, twin.compute_values(values, length))
        return Case(unit, _value_beats(unit, values, length), expected)
    left, right = _normals(rng, len(length))
    vectors = [_vectors(rng, _LIGHTS) for _ in range(2)]
    operands = twin.compute(*_fixed(left, right), length, *_fixed(*vectors))
    return Case(
        unit,
        {"normal_left": left, "normal_right": right, "length": length},
        _operands(unit, operands),
        _constants(unit, *vectors),
    )


DEVICES: dict[str, Callable[[np.random.Generator, int], Case]] = {
    "dot_product": _dot_product,
    "middle_normal": partial(_middle_normal, fit="exact", interval=6),
    "middle_normal, interval 1": partial(_middle_normal, fit="minimax_3", interval=1),
    "gpq": _gpq,
    "difference_setup": partial(_difference_setup, twin=DifferenceSetup(), interval=7),
    "difference_setup, as published": partial(_difference_setup, twin=DifferenceSetup(True), interval=1),
    "difference_accumulator": _difference_accumulator,
    "quadratic_evaluator": partial(_quadratic_evaluator, form="direct"),
    "quadratic_evaluator, horner": partial(_quadratic_evaluator, form="horner"),
    "bisection": partial(_bisection, twin=Bisection()),
    "bisection, degree 1 to 45": partial(_bisection, twin=Bisection(1, 45)),
    "bisection_chain": _bisection_chain,
    "adaptive_normaliser": _adaptive_normaliser,
    "renormaliser": _renormaliser,
    "arccos": partial(_arccos, form="pipelined"),
    "arccos, sequential": partial(_arccos, form="sequential"),
    "half_chord": _half_chord,
    "highlight_cosine": partial(_highlight_cosine, interpolated=True),
    "highlight_cosine, table alone": partial(_highlight_cosine, interpolated=False),
    "angular_setup": partial(_angular_setup, twin=AngularSetup()),
    "angular_setup, arccos": partial(_angular_setup, twin=AngularSetup("arccos")),
    "recurrence": partial(_recurrence, twin=Recurrence()),
    "recurrence, direct": partial(_recurrence, twin=Recurrence("direct")),
    "recurrence, interleaved": partial(_recurrence, twin=Recurrence(interleave=4)),
    "diffuse": _diffuse,
    **{
        f"specular, {model}": partial(_specular, twin=Specular(REFLECTION_MODELS[model]), unit=SpecularUnit)
        for model in SPECULAR_MODELS + FURTHER_MODELS
    },
    "specular, as published": partial(
        _specular, twin=Specular(REFLECTION_MODELS["cosquad"], as_published=True), unit=SpecularUnit
    ),
    "specular, interval 2": partial(
        _specular, twin=Specular(), unit=partial(SpecularUnit, initiation_interval=2)
    ),
    "specular, of a chord": partial(
        _specular, twin=Specular(REFLECTION_MODELS["lyon3"], "one_minus_cosine"), unit=SpecularUnit
    ),
    "power": partial(_specular, twin=Power(), unit=PowerUnit),
    "power, sequential": partial(_specular, twin=Power(), unit=partial(PowerUnit, form="sequential")),
    "light": _light,
    "highlight_gate": _highlight_gate,
    "intensity": partial(_intensity, unit=IntensityUnit),
    "intensity, compact": partial(_intensity, unit=CompactIntensityUnit),
    "chord": _chord,
    "chord_setup": partial(_chord_setup, interval=4),
    "chord_setup, interval 1": partial(_chord_setup, interval=1),
    "recurrence_setup": _recurrence_setup,
    "local_chord_setup": _local_chord_setup,
    **{
        f"{unit_of(twin).__module__.rpartition('.')[2]}, {method}": partial(
            _interpolator, method=method
        )
        for method, twin in METHODS.items()
    },
}
"""Devices and variants, named as in `BLOCKS`: every structure, but for the pipelines."""
