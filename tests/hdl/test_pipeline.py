# amaranth: UnusedElaboratable=no
"""The shading pipeline: RTL against its twin, pixel by pixel and clock by clock."""

import gc
import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, UnusedElaboratable, Value
from amaranth.sim import Simulator

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.methods.local_chord_interpolator import SpanValues
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.pipeline import STYLES, Build, Spans
from blysk.golden.presets import METHODS, MODELS, preset
from blysk.golden.reference.geometry import normalise
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.methods.registry import unit_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import dtype_of, pack, unpack
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import beats_of

from ..lists import SPECULAR_MODELS
from .pixels import assert_pixels

FROM_NORMALS = [method for method in METHODS if method != "chord-local"]


def make_spans(rng, lengths, normal_pairs, largest_angle=44.0):
    lengths = np.asarray(lengths)
    left, right = normal_pairs(rng, len(lengths), rng.uniform(0, largest_angle, len(lengths)))
    return Spans(
        x=rng.integers(0, 4096 - lengths + (lengths == 0) * -1),
        y=rng.integers(0, 4096, len(lengths)),
        length=lengths,
        normal_left=quantise(left),
        normal_right=quantise(right),
    )


def make_constants(rng, lights, exponent=20, brightness=1.0):
    vectors = rng.normal(size=(2, lights, 3))
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return FrameConstants(
        exponent=exponent,
        ambient=Intensity.color(rng.uniform(0, 0.2, 3)),
        direction=quantise(vectors[0]),
        halfway=quantise(vectors[1]),
        diffuse=Intensity.color(rng.uniform(0, brightness, (lights, 3))),
        specular=Intensity.color(rng.uniform(0, brightness, (lights, 3))),
    )


def run(unit, spans, constants, pixels, **options):
    options.setdefault("engine", "auto")
    return simulate(unit, beats_of(unit, spans), count=len(pixels.x), write=constants.writes(), **options)


def run_under_stalls(rng, unit, spans, constants, pixels):
    """Without stalls, then with stalls of either side and of both; the pixels are those of the twin."""
    results = []
    for input_share, output_share in ((0, 0), (0.5, 0.5), (0.95, 0), (0, 0.7)):
        stalls = {
            "input_stalls": rng.random(997) < input_share,
            "output_stalls": rng.random(1009) < output_share,
        }
        results.append(run(unit, spans, constants, pixels, **stalls))
        assert_pixels(results[-1], pixels)
        assert results[-1].status["out_of_range_spans"] == pixels.out_of_range_spans == 0
        assert results[-1].status["empty_spans"] == np.count_nonzero(spans.length == 0)
        assert not results[-1].status["overrun"]
    return results


@pytest.mark.parametrize(
    ("model", "lights"),
    [
        ("cosquad", 1),
        ("cosquad7", 3),
        *(
            pytest.param(model, lights, marks=pytest.mark.long)
            for model in SPECULAR_MODELS
            for lights in (1, 3)
            if (model, lights) not in (("cosquad", 1), ("cosquad7", 3))
        ),
    ],
)
def test_equals_twin_under_stalls(model, lights, normal_pairs):
    rng = np.random.default_rng(lights)
    parameters = preset(model=model, lights=lights)
    unit = ShadingPipelineUnit(parameters)
    for exponent in (1, 30, 1000):
        spans = make_spans(rng, rng.integers(0, 60, 600), normal_pairs)
        constants = make_constants(rng, lights, exponent, brightness=rng.choice([1.0, 8.0]))
        pixels = parameters.compute(spans, constants)
        assert len(np.unique(pixels.color)) > 100
        run_under_stalls(rng, unit, spans, constants, pixels)


@pytest.mark.long
def test_sixteen_lights(normal_pairs):
    rng = np.random.default_rng(16)
    parameters = preset(lights=16)
    spans = make_spans(rng, rng.integers(1, 60, 100), normal_pairs)
    constants = make_constants(rng, 16, brightness=0.1)
    pixels = parameters.compute(spans, constants)
    assert_pixels(run(ShadingPipelineUnit(parameters), spans, constants, pixels), pixels)


@pytest.mark.parametrize("lights", [1, pytest.param(3, marks=pytest.mark.long)])
def test_cycles(lights, normal_pairs):
    """One pixel a clock; a span costs its length or the setup interval, whichever is more, and no more.

    Spans that the buffer holds ready cost their length alone.
    """
    rng = np.random.default_rng(7)
    lengths = np.r_[rng.integers(1, 40, 500), np.full(50, 1), np.full(50, 7), [4095, 4095, 1, 1]]
    parameters = preset(lights=lights)
    unit = ShadingPipelineUnit(parameters)
    spans = make_spans(rng, lengths, normal_pairs)
    constants = make_constants(rng, lights)
    pixels = parameters.compute(spans, constants)
    result = run(unit, spans, constants, pixels)
    starts = np.cumsum(lengths) - lengths
    first_pixels = result.cycles[starts]
    assert first_pixels[0] == result.input_cycles[0] + unit.latency
    assert unit.latency == 94 + math.ceil(math.log2(2 * lights + 1))
    assert unit.setup_interval == 4
    taken = np.diff(first_pixels)
    assert np.all(taken >= lengths[:-1])
    assert np.all(taken <= np.maximum(lengths[:-1], unit.setup_interval))
    long_enough = lengths[:-1] >= unit.setup_interval
    np.testing.assert_array_equal(taken[long_enough], lengths[:-1][long_enough])
    # In a long run of short spans each costs the setup interval.
    assert np.all(taken[510:548] == unit.setup_interval)
    within = np.delete(np.diff(result.cycles), starts[1:] - 1)
    assert np.all(within == 1)


@pytest.mark.long
def test_engines_agree(normal_pairs):
    rng = np.random.default_rng(8)
    parameters = preset(model="cosquad_lin", lights=2)
    spans = make_spans(rng, rng.integers(0, 12, 60), normal_pairs, largest_angle=90)
    constants = make_constants(rng, 2)
    pixels = parameters.compute(spans, constants)
    assert pixels.out_of_range_spans > 10
    stalls = {"input_stalls": rng.random(97) < 0.5, "output_stalls": rng.random(89) < 0.4}
    unit = ShadingPipelineUnit(parameters)
    slow, fast = (
        run(unit, spans, constants, pixels, engine=engine, **stalls) for engine in ("pysim", "auto")
    )
    assert_pixels(slow, pixels)
    assert_pixels(fast, pixels)
    np.testing.assert_array_equal(slow.cycles, fast.cycles)
    np.testing.assert_array_equal(slow.input_cycles, fast.input_cycles)
    assert slow.status == fast.status
    assert slow.status["out_of_range_spans"] == pixels.out_of_range_spans


def test_wide_spans_are_counted(normal_pairs):
    rng = np.random.default_rng(9)
    parameters = preset()
    for angle, out_of_range in ((0.0, False), (44.99, False), (45.1, True), (90.0, True), (180.0, True)):
        left, right = normal_pairs(rng, 50, angle)
        spans = Spans(np.zeros(50, int), np.zeros(50, int), np.full(50, 9), quantise(left), quantise(right))
        constants = make_constants(rng, 1)
        pixels = parameters.compute(spans, constants)
        result = run(ShadingPipelineUnit(parameters), spans, constants, pixels)
        assert_pixels(result, pixels)
        assert result.status["out_of_range_spans"] == pixels.out_of_range_spans == 50 * out_of_range


def test_span_past_the_last_column_is_flagged(normal_pairs):
    rng = np.random.default_rng(10)
    parameters = preset()
    spans = make_spans(rng, [10, 10], normal_pairs)
    for x, flagged in ((4086, 0), (4087, 1)):
        spans.x[:] = x
        constants = make_constants(rng, 1)
        pixels = parameters.compute(spans, constants)
        result = run(ShadingPipelineUnit(parameters), spans, constants, pixels)
        assert_pixels(result, pixels)
        assert result.status["overrun"] == flagged


# Every method.


@pytest.fixture
def never_built():
    """Pipelines that are refused, or only asked for their figures, are never elaborated."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusedElaboratable)
        yield
        gc.collect()


# A model, lights and operand for each method; all models and both operands are there, each for some method.
DESIGNS = [
    ("linear", "cosquad", 1, "cosine"),
    pytest.param("linear", "lyon3", 1, "one_minus_cosine", marks=pytest.mark.long),
    ("bisection", "exp", 1, "cosine"),
    pytest.param("bisection", "cosquad", 2, "one_minus_cosine", marks=pytest.mark.long),
    ("quadratic", "blinn", 1, "cosine"),
    pytest.param("quadratic", "coscos2", 2, "one_minus_cosine", marks=pytest.mark.long),
    pytest.param("quadratic-eval", "lyon3", 2, "cosine", marks=pytest.mark.long),
    pytest.param("quadratic-eval", "exp", 1, "one_minus_cosine", marks=pytest.mark.long),
    pytest.param("quadratic-horner", "coscos2", 1, "cosine", marks=pytest.mark.long),
    pytest.param("quadratic-horner", "cosquad", 1, "one_minus_cosine", marks=pytest.mark.long),
    ("renormalise", "blinn", 1, "cosine"),
    pytest.param("renormalise", "cosquad", 2, "one_minus_cosine", marks=pytest.mark.long),
    pytest.param("angular", "lyon3", 1, None, marks=pytest.mark.long),
    ("chord", "cosquad", 1, None),
    pytest.param("chord", "exp", 2, None, marks=pytest.mark.long),
]


def spans_of_every_kind(rng, design, count, normal_pairs):
    """Lengths 1 to 40, among them 1, 2, 3, 16 and 0; angles 0 to the widest that the method takes."""
    lengths = np.r_[1, 2, 3, 16, 0, rng.integers(1, 41, count - 5)]
    spans = make_spans(rng, lengths, normal_pairs, design.interpolator.MAX_ANGLE - 0.01)
    flat = rng.random(count) < 0.05
    spans.normal_right[flat] = spans.normal_left[flat]
    return spans


def lit_constants(rng, spans, lights, exponent):
    """Half-way vectors that are normals of the spans: the peaks are on the picture."""
    constants = make_constants(rng, lights, exponent)
    constants.halfway[:] = spans.normal_left[rng.integers(0, len(spans), lights)]
    constants.direction[:] = spans.normal_right[rng.integers(0, len(spans), lights)]
    return constants


@pytest.mark.parametrize(("method", "model", "lights", "operand"), DESIGNS)
def test_every_method_equals_its_twin_under_stalls(method, model, lights, operand, normal_pairs):
    rng = np.random.default_rng(lights + len(method))
    design = preset(method, model, lights, operand=operand)
    unit = ShadingPipelineUnit(design)
    spans = spans_of_every_kind(rng, design, 250, normal_pairs)
    constants = lit_constants(rng, spans, lights, 20)
    pixels = design.compute(spans, constants)
    assert len(np.unique(pixels.color)) > 100
    cycles = run_under_stalls(rng, unit, spans, constants, pixels)
    # The first span and the cycles of each, without stalls.
    starts = np.cumsum(spans.length) - spans.length
    full = np.flatnonzero(spans.length)
    first = cycles[0].cycles[starts[full]]
    started = first[0] - cycles[0].input_cycles[full[0]]
    taken, length = np.diff(first), spans.length[full][:-1]
    assert np.all(taken >= length * unit.cycles_per_pixel)
    if method == "bisection":
        # Spans that are divided take longer.
        assert started >= unit.latency
    else:
        assert started == unit.latency
        assert np.all(taken <= np.maximum(length * unit.cycles_per_pixel, unit.setup_interval))


@pytest.mark.long
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("method", FROM_NORMALS)
def test_every_method_with_every_model(method, model, normal_pairs):
    rng = np.random.default_rng(MODELS.index(model))
    design = preset(method, model)
    spans = spans_of_every_kind(rng, design, 24, normal_pairs)
    constants = lit_constants(rng, spans, 1, 5)
    pixels = design.compute(spans, constants)
    result = run(
        ShadingPipelineUnit(design),
        spans,
        constants,
        pixels,
        engine="pysim",
        output_stalls=rng.random(101) < 0.3,
    )
    assert_pixels(result, pixels)


def intervals():
    """Every setup interval of one method of each unit; the ones that say most are not long."""
    often = {"linear": (1, 7), "quadratic": (1, 3, 7), "angular": (1, 6), "chord": (1, 2, 3, 7, 26)}
    often |= {"recurrence": (1,)}
    for method, soon in often.items():
        interpolator = METHODS[method]
        for interval in unit_of(interpolator).setup_intervals(interpolator):
            marks = () if interval in soon else (pytest.mark.long,)
            yield pytest.param(method, interval, marks=marks)


@pytest.mark.parametrize(("method", "interval"), list(intervals()))
def test_setup_interval(method, interval, normal_pairs):
    """The pixels do not depend on it; a span takes its pixels' cycles or the interval, and no more."""
    rng = np.random.default_rng(interval)
    design = preset(method)
    unit = ShadingPipelineUnit(design.built(setup_interval=interval))
    assert unit.setup_interval == interval
    lengths = np.r_[rng.integers(1, 12, 40), np.full(12, 1), 40, 1, 1]
    spans = make_spans(rng, lengths, normal_pairs, design.interpolator.MAX_ANGLE - 0.01)
    constants = make_constants(rng, 1)
    pixels = design.compute(spans, constants)
    result = run(unit, spans, constants, pixels, engine="pysim")
    assert_pixels(result, pixels)
    first = result.cycles[np.cumsum(lengths) - lengths]
    assert first[0] == result.input_cycles[0] + unit.latency
    taken = np.diff(first)
    assert np.all(taken >= lengths[:-1])
    assert np.all(taken <= np.maximum(lengths[:-1], interval))
    # In a run of single pixels each costs the interval.
    assert np.all(taken[46:51] == interval)


def methods_with_intervals():
    return {method: unit_of(twin).setup_intervals(twin) for method, twin in METHODS.items()}


def test_intervals_that_there_are(never_built):
    none = range(0)
    assert (
        methods_with_intervals().items()
        >= {
            "linear": range(1, 8),
            "bisection": none,
            "quadratic": range(1, 8),
            "quadratic-eval": none,
            "quadratic-horner": none,
            "angular": range(1, 7),
            "renormalise": range(1, 8),
            "chord": range(1, 27),
            "recurrence": range(1, 47),
        }.items()
    )
    for method, allowed in methods_with_intervals().items():
        if 4 in allowed:
            assert ShadingPipelineUnit(preset(method)).setup_interval == 4


# Just within, and beyond, what each method takes. Linear normals of 45 degrees differ by less than 1 in every
# component, of 120 degrees by 1.7 in length: by 1 in some.
@pytest.mark.parametrize(
    ("method", "narrow", "out_of_range", "flagged"),
    [
        ("linear", 45.0, 140.0, 20),
        ("renormalise", 45.0, 140.0, 20),
        ("bisection", 89.99, 90.1, 50),
        ("quadratic-eval", 44.99, 45.1, 50),
        ("quadratic-horner", 44.99, 45.1, 50),
        ("angular", 150.0, 180.0, 50),
        ("chord", 22.49, 22.52, 50),
    ],
)
def test_wide_spans_of_every_method_are_counted(method, narrow, out_of_range, flagged, normal_pairs):
    rng = np.random.default_rng(9)
    design = preset(method)
    left, right = (
        np.vstack(v) for v in zip(*(normal_pairs(rng, 50, a) for a in (narrow, out_of_range)), strict=True)
    )
    left, right = quantise(left), quantise(right)
    if out_of_range == 180.0:
        right[50:] = -left[50:]
    spans = Spans(np.zeros(100, int), np.zeros(100, int), rng.integers(1, 4, 100), left, right)
    constants = make_constants(rng, 1)
    pixels = design.compute(spans, constants)
    # Other tests compile these.
    engine = "auto" if method in ("linear", "bisection", "chord") else "pysim"
    result = run(ShadingPipelineUnit(design), spans, constants, pixels, engine=engine)
    assert_pixels(result, pixels)
    assert flagged <= pixels.out_of_range_spans <= 50
    assert result.status["out_of_range_spans"] == pixels.out_of_range_spans


# How many spans, and the longest, for `test_every_bit_counts`.
LONG_AND_SHORT = ((200, 4095), (3000, 12))


def spans_about(rng, widest, middles, longest, orders=4):
    """Spans whose middle normals are given; as many of each order of width, and of length."""
    across = normalise(np.cross(middles, rng.normal(size=middles.shape)))
    angles = np.radians(widest * 10.0 ** rng.uniform(-orders, 0, (len(middles), 1)))
    left, right = (
        quantise(middles * np.cos(angles / 2) + side * across * np.sin(angles / 2)) for side in (-1, 1)
    )
    length = ((longest + 1) ** rng.uniform(0, 1, len(middles))).astype(int)
    return Spans(rng.integers(0, 4097 - length), rng.integers(0, 4096, len(middles)), length, left, right)


def spans_at_rim(rng, widest, code):
    """Spans on the border of light and shade of a light with a vector of this code.

    Among them those that start within some last bits of it, as whether there is a highlight hangs on the
    sign of N.L, of 34 bits or rounded to 25; those that cross it as slowly as they can; and those along which
    N.L rises by half a step of 18 bits more than a whole number of them, to which the chord method rounds.
    """
    light = normalise(code)

    def normals(count, least=0.0, most=0.0):
        height = rng.uniform(least, most, (count, 1))
        return normalise(normalise(np.cross(rng.normal(size=(count, 3)), light)) + height * light)

    moves = np.stack(np.mgrid[-30:31, -30:31, -30:31], axis=-1).reshape(-1, 3)
    moves = moves[np.argsort(moves @ code)]
    rises = moves @ code
    edge, tie = (spans_about(rng, 0.1, normals(count), 60) for count in (6000, 1500))
    crossing = spans_about(rng, 0.01, normals(250), 4095, orders=1)
    assert np.gcd.reduce(code) == 1
    away = rng.choice([0, 1 << 8], len(edge)) + rng.integers(-16, 17, len(edge)) - edge.normal_left @ code
    nearest = np.searchsorted(rises[:-1], away)
    edge.normal_left[:] += moves[nearest]
    edge = edge[np.argsort(np.abs(away - rises[nearest]))[:600]]
    halves = np.argsort(np.abs((rises & 0xFFFF) - 0x8000))[:40]
    tie.normal_right[:] = tie.normal_left + moves[rng.choice(halves, len(tie))]
    # Among short ones some are too wide.
    lit = (
        spans_about(rng, most, normals(count, -0.02, 0.12), longest)
        for most, (count, longest) in zip((widest, 180.0), LONG_AND_SHORT, strict=True)
    )
    return joined(rng, [*lit, edge, tie, crossing])


def spans_at_tie(rng, widest, light, one_minus_cosines):
    """Spans along the border of light and shade whose 1 - cosine hangs on its last bits.

    Either it is at the border of its rounding, or the number of segments into which bisection divides the
    span is about to change.
    """
    normaliser = METHODS["bisection"].normaliser
    across = normalise(np.cross(light, rng.normal(size=3)))
    turn = np.radians(rng.uniform(-widest / 2, widest / 2, (3000, 1)))
    height = rng.uniform(0, 0.1, (3000, 1))
    arc = np.cos(turn) * across + np.sin(turn) * np.cross(light, across) + height * light
    left, right = np.split(quantise(normalise(arc)), 2)
    u = one_minus_cosines(left, right)
    nearer, wider = (
        normaliser.levels(Fixed(normaliser.bisection.ANGLE_FORMAT, (u + (1 << 16) >> 17) + move), False)
        for move in (-1, 1)
    )
    tie = abs((u + (1 << 15)) % (1 << 16) - (1 << 15)) < 8
    pairs = [rng.choice(np.argwhere(chosen), count) for chosen, count in ((tie, 500), (nearer != wider, 200))]
    first, second = np.concatenate(pairs).T
    length, (x, y) = rng.integers(3, 60, len(first)), rng.integers(0, 4000, (2, len(first)))
    return Spans(x, y, length, left[first], right[second])


def joined(rng, kinds):
    """All spans of several kinds, mixed."""
    names = ("x", "y", "length", "normal_left", "normal_right")
    spans = Spans(*(np.concatenate([getattr(kind, name) for kind in kinds]) for name in names))
    return spans[rng.permutation(len(spans))]


def spans_at_peak(rng, widest, halfway, exponent):
    """Spans inside a highlight, 1 - N.H up to 2/n; most where it is an eighth of its peak and less."""
    kinds = []
    for count, longest in LONG_AND_SHORT:
        outside = np.where(rng.random((count, 1)) < 0.2, 0.0, 0.6)
        cosine = 1 - rng.uniform(outside, 0.9) * 2 / exponent
        across = normalise(np.cross(rng.normal(size=(count, 3)), halfway))
        middles = cosine * halfway + np.sqrt(1 - cosine**2) * across
        kinds.append(spans_about(rng, widest, middles, longest))
    return joined(rng, kinds)


def operands_of(design, spans, constants):
    """N.L and what the highlight is worked out from, by the twin; and where the light is behind."""
    vectors = (spans.normal_left, spans.normal_right, constants.direction, constants.halfway)
    left, right, direction, halfway = (Fixed(COMPONENT, codes) for codes in vectors)
    operands = design.interpolator.compute(left, right, spans.length, direction, halfway)
    return operands.cosine, operands.highlight, Diffuse(operands.cosine.format).dark(operands.cosine)


@pytest.mark.parametrize("method", ["linear", "bisection", "quadratic", "angular", "recurrence", "chord"])
def test_every_bit_counts(method, one_minus_cosines):
    """What is worked out for a span shows in some pixel, to the last bit.

    It does where colours are far from their ends and steep: on the border of light and shade with eight times
    the full light, and in a narrow highlight; and at the ends of the longest spans.
    """
    rng = np.random.default_rng(15)
    design = preset(method)
    unit = ShadingPipelineUnit(design)
    widest = design.interpolator.MAX_ANGLE - 0.01
    light, halfway = normalise(rng.normal(size=(2, 3)))
    vectors = light, normalise(light + 3 * halfway), halfway
    light_code, near_code, peak_code = (quantise(vector) for vector in vectors)
    rim = spans_at_rim(rng, widest, light_code)
    border = light_code, peak_code, 1, (8, 7, 6), (0.03, 0.5, 0.1)
    frames = [(rim, *border, 0.3)]
    # Then a direction and its opposite, so that every bit is 0 once, and 1 once.
    for direction, peak, exponent, share in (
        (near_code, peak_code, 1000, 0),
        (~near_code, ~peak_code, 30, 0.3),
    ):
        spans = spans_at_peak(rng, widest, normalise(peak), exponent)
        frames.append((spans, direction, peak, exponent, (0, 0.01, 0), (8, 7, 6), share))
    # Components of 1 are rounded to the largest word; of long and wide spans in a row setups wait for room.
    axes = np.repeat(np.concatenate([np.eye(3), -np.eye(3)]), 40, axis=0)
    more = np.random.default_rng(16)
    exact = joined(
        more, [spans_at_tie(more, widest, light, one_minus_cosines), spans_about(more, widest, axes, 60)]
    )
    row = spans_about(more, widest, normalise(rim.normal_left[:300]), 4095, orders=1)
    farthest = spans_about(more, widest, normalise(rim.normal_left[:4]), 4095, orders=0)
    farthest.x[:], farthest.length[:] = 0, 4095
    row = joined(more, [row[row.length > 600][:60], farthest])
    frames += [(exact, *border, 0.3), (row, *border, 0)]
    for spans, direction, peak, exponent, diffuse, specular, share in frames:
        colors = (Intensity.color(np.array([color])) for color in (diffuse, specular))
        constants = FrameConstants(
            exponent, np.zeros(3, dtype=int), direction[np.newaxis], peak[np.newaxis], *colors
        )
        pixels = design.compute(spans, constants)
        # The constants over others with all bits 1.
        write = {name: np.tile(beats, 2) for name, beats in constants.writes().items()}
        write["data"][: len(write["data"]) // 2] = 0x3FFFF
        result = simulate(
            unit,
            beats_of(unit, spans),
            count=len(pixels.x),
            write=write,
            engine="auto",
            input_stalls=rng.random(997) < share,
            output_stalls=rng.random(1009) < share,
        )
        assert_pixels(result, pixels)
        assert result.status["out_of_range_spans"] == pixels.out_of_range_spans


def test_halves_round_up():
    """Channels of a half, and of the least step less: there every bit of either term's product counts.

    For a pixel's terms d and s and a diffuse colour c the specular colour is
    (2^22 - 0 or 1 - 2^17 ambient - c d) / s modulo 2^23, where it is a colour.
    """
    rng = np.random.default_rng(22)
    design = preset()
    unit = ShadingPipelineUnit(design)
    count = 8192
    for share in np.repeat([0.0, 0.5], 12):
        halfway = normalise(rng.normal(size=3))
        constants = make_constants(rng, 1, int(1000 ** rng.uniform()), brightness=0.5)
        constants.halfway[:] = quantise(halfway)
        constants.direction[:] = quantise(normalise(halfway + 0.5 * rng.normal(size=3)))
        away = rng.normal(size=(count, 3)) / np.sqrt(constants.exponent)
        normal, zero = quantise(normalise(halfway + away)), np.zeros(count, dtype=int)
        flat = Spans(zero, zero, zero + 1, normal, normal)
        cosine, highlight, dark = operands_of(design, flat, constants)
        d = Diffuse(cosine.format).compute(cosine).codes
        s = design.specular.compute(highlight, dark, constants.exponent).codes
        # The inverse of an odd number: each step doubles its bits, of which three are right at the start.
        inverse = s
        for _ in range(3):
            inverse = inverse * (2 - s * inverse % (1 << 23)) % (1 << 23)
        others = (constants.ambient << 17) + constants.diffuse * d
        half = (1 << 22) - rng.integers(0, 2, (count, 3))
        color = (half - others) * inverse % (1 << 23)
        total = others + color * s
        fits = (s % 2 == 1) & (color <= Intensity.color(8.0)) & (total < 255 << 23)
        chosen = [rng.choice(np.flatnonzero(fits[:, channel])) for channel in range(3)]
        constants.specular[0] = color[chosen, range(3)]
        np.testing.assert_array_equal(total[chosen, range(3)] % (1 << 23), half[chosen, range(3)])
        spans = flat[np.repeat(chosen, 10)]
        pixels = design.compute(spans, constants)
        lit = (total[chosen, range(3)] >> 23) + (half[chosen, range(3)] == 1 << 22)
        np.testing.assert_array_equal(pixels.color[::10].diagonal(), lit)
        stalls = {"input_stalls": rng.random(97) < share, "output_stalls": rng.random(89) < share}
        assert_pixels(run(unit, spans, constants, pixels, **stalls), pixels)


def test_brightest_light_saturates(normal_pairs):
    """Three terms of eight times the full channel are white, and in the dark the ambient term alone is.

    The constants are written over others with all bits 1, and again over such with all bits 0.
    """
    rng = np.random.default_rng(16)
    design = preset()
    spans = make_spans(rng, rng.integers(1, 30, 60), normal_pairs)
    constants = lit_constants(rng, spans, 1, 30)
    constants.direction[:] = constants.halfway
    brightest = Intensity.color(np.array(8.0))
    for color in (constants.ambient, constants.diffuse, constants.specular):
        color[...] = brightest
    pixels = design.compute(spans, constants)
    assert np.all(pixels.color == 255)
    unit = ShadingPipelineUnit(design)
    write = {name: np.tile(beats, 4) for name, beats in constants.writes().items()}
    write["data"].reshape(4, -1)[[0, 2]] = [[0x3FFFF], [0]]
    found = simulate(unit, beats_of(unit, spans), count=len(pixels.x), write=write, engine="auto")
    assert_pixels(found, pixels)


def test_counters_stop_at_their_largest_value(normal_pairs):
    rng = np.random.default_rng(17)
    design = preset()
    kinds = make_spans(rng, [1, 0], normal_pairs, 0)
    kinds.normal_right[0] = -kinds.normal_left[0]
    spans = kinds[np.repeat([0, 1], (1 << 16) + 2)]
    constants = make_constants(rng, 1)
    pixels = design.compute(spans, constants)
    result = run(ShadingPipelineUnit(design), spans, constants, pixels)
    assert_pixels(result, pixels)
    assert pixels.out_of_range_spans == (1 << 16) + 2
    assert result.status["out_of_range_spans"] == result.status["empty_spans"] == 65535


def words(layout, beats):
    return [int.from_bytes(row.astype("<u4").tobytes(), "little") for row in pack(layout, beats)]


class Driver:
    """A pipeline in Amaranth's simulator, with a reset and writes at any time."""

    def __init__(self, unit):
        self.unit, self.reset = unit, Signal()
        self.shapes = {name: getattr(unit, name).payload.shape() for name in ("i", "o", "write")}

    def simulate(self, bench):
        simulator = Simulator(ResetInserter(self.reset)(self.unit))
        simulator.add_clock(1e-6)
        simulator.add_testbench(bench)
        simulator.run()

    async def clock(self, context, beats):
        """Offer beats of ``i`` and ``write`` (None: nothing) for one clock; which were taken, and a pixel."""
        unit = self.unit
        context.set(unit.o.ready, 1)
        for name, beat in beats.items():
            port = getattr(unit, name)
            context.set(port.valid, beat is not None)
            context.set(Value.cast(port.payload).as_unsigned(), beat or 0)
        taken = {name: context.get(getattr(unit, name).valid & getattr(unit, name).ready) for name in beats}
        pixel = context.get(Value.cast(unit.o.payload).as_unsigned()) if context.get(unit.o.valid) else None
        await context.tick()
        return taken, pixel

    async def run(self, context, writes, spans, cycles=10**6, pixels=10**6):
        """Writes, then spans, until so many cycles or pixels; the pixels and the clock of each."""
        writes, spans, found = list(writes), list(spans), []
        for clock in range(cycles):
            beats = {"write": writes[0] if writes else None, "i": spans[0] if spans else None}
            if writes:
                beats["i"] = None
            taken, pixel = await self.clock(context, beats)
            if taken["write"]:
                writes.pop(0)
            if taken["i"]:
                spans.pop(0)
            if pixel is not None:
                found.append((clock, pixel))
            if len(found) == pixels:
                break
        return found

    def beats(self, found):
        codes = [pixel for _, pixel in found]
        size = -(-self.unit.o.payload.shape().size // 32)
        rows = [[code >> 32 * k & 0xFFFFFFFF for k in range(size)] for code in codes]
        return unpack(self.shapes["o"], np.array(rows, dtype=np.uint32))


def assert_colors(beats, pixels):
    for channel, name in enumerate("rgb"):
        np.testing.assert_array_equal(beats[name], pixels.color[:, channel])
    np.testing.assert_array_equal(beats["last"], pixels.last)


@pytest.mark.parametrize("method", FROM_NORMALS)
def test_reset_in_mid_span(method, normal_pairs):
    """After a reset with spans inside: the pixels and cycles are those from power-up."""
    rng = np.random.default_rng(12)
    design = preset(method)
    unit = ShadingPipelineUnit(design)
    driver = Driver(unit)
    spans = make_spans(rng, [5, 1, 9, 3], normal_pairs, 20)
    others = make_spans(rng, rng.integers(1, 30, 40), normal_pairs, 60)
    constants = make_constants(rng, 1)
    pixels = design.compute(spans, constants)
    codes, other_codes = (words(driver.shapes["i"], beats_of(unit, s)) for s in (spans, others))
    writes = words(driver.shapes["write"], constants.writes())
    runs = []

    async def bench(context):
        for before in (0, len(writes) + 3, len(writes) + unit.latency // 2, len(writes) + unit.latency + 40):
            if before:
                await driver.run(context, writes, other_codes, cycles=before)
                context.set(driver.reset, 1)
                await driver.clock(context, {"write": None, "i": None})
                context.set(driver.reset, 0)
                assert not context.get(unit.o.valid)
            runs.append(await driver.run(context, writes, codes, pixels=len(pixels.x)))
            # Nothing comes after the last pixel; the pipeline is empty for the next round.
            assert not await driver.run(context, [], [], cycles=unit.latency + 10)
            context.set(driver.reset, 1)
            await driver.clock(context, {"write": None, "i": None})
            context.set(driver.reset, 0)

    driver.simulate(bench)
    assert_colors(driver.beats(runs[0]), pixels)
    assert len(runs) == 4
    assert all(found == runs[0] for found in runs[1:])


@pytest.mark.parametrize("method", ["bisection", "quadratic-horner", "angular", "chord"])
def test_constants_never_change_under_a_span(method, normal_pairs):
    """Writes that wait while spans go by: each span has the constants of before, or all of the new ones."""
    rng = np.random.default_rng(13)
    design = preset(method)
    unit = ShadingPipelineUnit(design)
    driver = Driver(unit)
    before, after = (make_spans(rng, rng.integers(1, 20, 8), normal_pairs, 20) for _ in range(2))
    frames = [make_constants(rng, 1, exponent) for exponent in (3, 200)]
    expected = [
        design.compute(spans, constants) for spans, constants in zip((before, after), frames, strict=True)
    ]
    codes = [words(driver.shapes["i"], beats_of(unit, s)) for s in (before, after)]
    writes = [words(driver.shapes["write"], constants.writes()) for constants in frames]
    found = []

    async def bench(context):
        await driver.run(context, writes[0], [], cycles=len(writes[0]) + 5)
        waiting, late, spans = list(codes[0]), list(writes[1]), list(codes[1])
        out = 0
        while len(found) < sum(len(pixels.x) for pixels in expected):
            # Writes are offered from the clock on which the last span of before is taken.
            beats = {
                "i": waiting[0] if waiting else (spans[0] if spans else None),
                "write": late[0] if late and not waiting else None,
            }
            taken, pixel = await driver.clock(context, beats)
            if pixel is not None:
                found.append((0, pixel))
                out += 1
            if taken["write"]:
                assert out == len(expected[0].x)
                late.pop(0)
            if taken["i"]:
                assert not late or waiting
                (waiting or spans).pop(0)

    driver.simulate(bench)
    beats, count = driver.beats(found), len(expected[0].x)
    assert_colors(beats[:count], expected[0])
    assert_colors(beats[count:], expected[1])


@pytest.mark.parametrize(
    ("method", "interval", "choice"),
    [
        ("quadratic", 0, "1 to 7"),
        ("linear", 8, "1 to 7"),
        ("angular", 7, "1 to 6"),
        ("chord", 27, "1 to 26"),
        ("bisection", 4, "left out"),
        ("quadratic-eval", 7, "left out"),
    ],
)
def test_refuses_a_setup_interval(method, interval, choice, never_built):
    text = f"setup_interval of {method} must be {choice}, not {interval}"
    with pytest.raises(ValueError, match=f"^{text}$"):
        ShadingPipelineUnit(preset(method, setup_interval=interval))


@pytest.mark.parametrize("method", ["bisection", "quadratic-eval", "quadratic-horner"])
def test_method_without_a_choice_of_interval(method, never_built):
    assert ShadingPipelineUnit(preset(method)).setup_interval > 4
    assert len(methods_with_intervals()[method]) == 0


@pytest.mark.parametrize(
    ("method", "model", "lights"),
    [
        ("chord", "lyon3", 2),
        pytest.param("linear", "blinn", 1, marks=pytest.mark.long),
        pytest.param("chord", "cosquad", 1, marks=pytest.mark.long),
        pytest.param("quadratic", "exp", 1, marks=pytest.mark.long),
    ],
)
def test_compact_style_equals_twin_under_stalls(method, model, lights, normal_pairs):
    rng = np.random.default_rng(lights)
    design = preset(method, model, lights)
    spans = make_spans(rng, rng.integers(0, 24, 40), normal_pairs, 20.0)
    constants = make_constants(rng, lights)
    pixels = design.compute(spans, constants)
    unit = ShadingPipelineUnit(design.built(style="compact"))
    for share in (0, 0.4):
        stalls = {"input_stalls": rng.random(97) < share, "output_stalls": rng.random(89) < share}
        assert_pixels(run(unit, spans, constants, pixels, **stalls), pixels)


@pytest.mark.long
def test_compact_style_takes_three_clocks_a_term(normal_pairs):
    """Highlights cost cycles, and what has none does not."""
    rng = np.random.default_rng(1)
    design = preset("chord")
    spans = make_spans(rng, np.full(30, 60), normal_pairs, 20.0)
    constants = make_constants(rng, 1, exponent=3)
    cosine, highlight, dark = operands_of(design, spans, constants)
    specular = design.specular.compute(highlight, dark, constants.exponent)
    cycles = Intensity().cycles(Diffuse(cosine.format).compute(cosine), specular)
    assert set(cycles.tolist()) == {3, 6}
    unit = ShadingPipelineUnit(design.built(style="compact"))
    found = run(unit, spans, constants, design.compute(spans, constants))
    np.testing.assert_array_equal(np.diff(found.cycles), cycles[1:])
    assert unit.cycles_per_pixel == 6
    assert cost_of(unit).multiplier_count == 3


@pytest.mark.long
@pytest.mark.parametrize(("lights", "style", "materials"), [(2, "throughput", 1), (1, "compact", 3)])
def test_spans_with_values(lights, style, materials):
    """The local chord method: its spans carry values of each light, and no normals."""
    rng = np.random.default_rng(lights)
    design = preset("chord-local", lights=lights, materials=materials)
    unit = ShadingPipelineUnit(design.built(style=style))
    lengths = np.r_[0, 1, 2, 3, 16, rng.integers(1, 40, 150)]
    count = len(lengths)
    start, step = rng.uniform(0.41, 0.6, (2, count, lights, 1)), rng.uniform(-0.2, 0.2, (2, count, lights, 1))
    ends = start + step * (0, 1, 2) + rng.uniform(-0.01, 0.01, (2, count, lights, 1)) * (0, 1, 0)
    ends[0] -= rng.choice([0, 0.5], (count, lights, 1))
    values = SpanValues.quantise(ends[0], ends[1] / 4)
    zero = np.zeros((count, 3), dtype=int)
    x, y = rng.integers(0, 4000, (2, count))
    material = np.sort(rng.integers(0, materials, count))
    spans = Spans(x, y, lengths, zero, zero, material, values)
    constants = [make_constants(rng, lights, exponent) for exponent in (20, 3, 100)[:materials]]
    pixels = design.compute(spans, constants)
    assert len(np.unique(pixels.color)) > 100
    assert pixels.out_of_range_spans == 0
    beats = {name: getattr(spans, name) for name in unit.i.payload.shape().members}
    beats["values"] = np.zeros((count, lights), dtype_of(unit.i.payload.shape()["values"].shape).base)
    for name in ("diffuse", "highlight"):
        beats["values"][name] = getattr(values, name)
    writes = [of.writes(k if materials > 1 else None) for k, of in enumerate(constants)]
    write = {name: np.concatenate([beat[name] for beat in writes]) for name in ("address", "data")}
    for share in (0, 0.4):
        stalls = {"input_stalls": rng.random(97) < share, "output_stalls": rng.random(89) < share}
        result = simulate(unit, beats, count=len(pixels.x), write=write, engine="auto", **stalls)
        assert_pixels(result, pixels)
        if not share and style == "throughput":
            assert result.cycles[0] == result.input_cycles[1] + unit.latency
    with pytest.raises(ValueError, match=r"^method chord-local has no normals for a gate$"):
        preset("chord-local", gate=True)
    with pytest.raises(
        ValueError, match=rf"^method chord-local takes spans with values for {lights} lights$"
    ):
        design.compute(replace(spans, values=None), constants)


GATED = [
    ("chord", "coscos2", 1, None, "throughput"),
    pytest.param("chord", "cosquad", 2, None, "compact", marks=pytest.mark.long),
    pytest.param("quadratic", "cosquad", 2, "cosine", "throughput", marks=pytest.mark.long),
    pytest.param("linear", "lyon3", 1, "one_minus_cosine", "throughput", marks=pytest.mark.long),
    pytest.param("bisection", "exp", 1, "cosine", "throughput", marks=pytest.mark.long),
    pytest.param("angular", "cosquad", 1, None, "throughput", marks=pytest.mark.long),
    pytest.param("recurrence", "cosquad", 2, None, "throughput", marks=pytest.mark.long),
    pytest.param("renormalise", "blinn", 1, "cosine", "throughput", marks=pytest.mark.long),
    pytest.param("quadratic-horner", "blinn", 1, "cosine", "compact", marks=pytest.mark.long),
]


@pytest.mark.parametrize(("method", "model", "lights", "operand", "style"), GATED)
def test_gate_changes_no_pixel(method, model, lights, operand, style, normal_pairs):
    """The twin without a gate says what the pixels are."""
    rng = np.random.default_rng(lights + len(method))
    design = preset(method, model, lights, operand=operand)
    gated = replace(design, gate=True)
    unit = ShadingPipelineUnit(gated.built(style=style))
    spans = spans_of_every_kind(rng, design, 250, normal_pairs)
    for exponent in (2, 50, 1000):
        constants = lit_constants(rng, spans, lights, exponent)
        pixels = design.compute(spans, constants)
        lit = gated.lit_spans(spans, constants)
        assert 0 < lit.mean() < 1 or exponent == 2
        for share in (0, 0.5):
            stalls = {"input_stalls": rng.random(997) < share, "output_stalls": rng.random(1009) < share}
            result = run(unit, spans, constants, pixels, **stalls)
            assert_pixels(result, pixels)
            if style == "throughput" and method != "bisection" and not share:
                assert result.cycles[0] == result.input_cycles[0] + unit.latency


@pytest.mark.long
@pytest.mark.parametrize(
    ("method", "interval"),
    [("chord", 4), ("chord", 1), pytest.param("quadratic", 7, marks=pytest.mark.long)],
)
def test_gate_costs_no_clock(method, interval, normal_pairs):
    """Decisions come in time for spans of every length, however many single pixels are on the way."""
    rng = np.random.default_rng(interval)
    design = preset(method, gate=True)
    unit = ShadingPipelineUnit(design.built(setup_interval=interval))
    lengths = np.r_[rng.integers(1, 40, 200), np.full(150, 1), np.full(60, 5)]
    spans = make_spans(rng, lengths, normal_pairs, 20.0)
    constants = lit_constants(rng, spans, 1, 20)
    pixels = design.compute(spans, constants)
    result = run(unit, spans, constants, pixels)
    assert_pixels(result, pixels)
    first = result.cycles[np.cumsum(lengths) - lengths]
    assert np.all(np.diff(first) <= np.maximum(lengths[:-1], interval))


@pytest.mark.long
def test_gate_spares_the_compact_style_cycles(normal_pairs):
    """A power takes 42 cycles a pixel, but for pixels behind the light and in spans without a highlight."""
    rng = np.random.default_rng(3)
    design = preset("chord", "blinn")
    spans = make_spans(rng, np.full(30, 40), normal_pairs, 20.0)
    constants = make_constants(rng, 1, exponent=300)
    constants.halfway[:] = spans.normal_left[:1]
    constants.direction[:] = constants.halfway
    behind = operands_of(design, spans, constants)[2][:, 0]
    pixels = design.compute(spans, constants)
    cycles = []
    for gate in (False, True):
        gated = replace(design, gate=gate)
        found = run(ShadingPipelineUnit(gated.built(style="compact")), spans, constants, pixels)
        assert_pixels(found, pixels)
        dark = behind | ~np.repeat(gated.lit_spans(spans, constants)[:, 0], 40) if gate else behind
        # Few pixels wait beside the power unit, so that dark ones take their three cycles between powers.
        expected = np.where(dark, 3, 42).sum()
        assert expected * 0.95 <= found.total_cycles <= expected * 1.05
        cycles.append(found.total_cycles)
    assert cycles[1] < cycles[0] / 3


LEFT_OUT = {
    "specular": {"specular": None},
    "exponent": {"build": Build(exponent=20)},
    "channels": {"grey": True},
    "widths": {"x_bits": 9, "y_bits": 8, "length_bits": 5},
    "all": {"specular": None, "grey": True, "x_bits": 9, "y_bits": 8, "length_bits": 5},
}


@pytest.mark.parametrize(
    ("what", "style"),
    [
        ("all", "throughput"),
        *(
            pytest.param(what, "throughput", marks=pytest.mark.long)
            for what in ("specular", "exponent", "channels", "widths")
        ),
        *(pytest.param(what, "compact", marks=pytest.mark.long) for what in LEFT_OUT),
    ],
)
def test_less_hardware_shades_the_same(what, style, normal_pairs):
    """A scene that does not need a part has the pixels of the full pipeline without it, and it costs less."""
    rng = np.random.default_rng(5)
    full = preset("chord", lights=2, gate=True)
    design = replace(full, gate=full.gate and "specular" not in LEFT_OUT[what], **LEFT_OUT[what])
    spans = make_spans(rng, rng.integers(0, 32, 60), normal_pairs, 20.0)
    spans.x[:] = rng.integers(0, 480, 60)
    spans.y[:] = rng.integers(0, 256, 60)
    constants = lit_constants(rng, spans, 2, 20)
    if design.model is None:
        constants.specular[:] = 0
    if design.grey:
        for colors in (constants.ambient, constants.diffuse, constants.specular):
            colors[...] = colors[..., :1]
    pixels = full.compute(spans, constants)
    assert len(np.unique(pixels.color)) > 50
    unit = ShadingPipelineUnit(design.built(style=style))
    stalls = {"input_stalls": rng.random(97) < 0.3, "output_stalls": rng.random(89) < 0.3}
    assert_pixels(run(unit, spans, constants, pixels, **stalls), pixels)
    assert_pixels(run(unit, spans, constants, pixels), pixels)
    less, more = (cost_of(ShadingPipelineUnit(each.built(style=style))) for each in (design, full))
    assert less.register_bits < more.register_bits
    assert less.multiplier_count <= more.multiplier_count
    if what in ("specular", "exponent", "channels") and style == "throughput":
        assert less.multiplier_count < more.multiplier_count


@pytest.mark.parametrize("materials", [1, 3])
def test_without_lights_there_is_ambient_light(materials, normal_pairs, never_built):
    rng = np.random.default_rng(1)
    design = preset(lights=0, materials=materials)
    unit = ShadingPipelineUnit(design)
    spans = make_spans(rng, rng.integers(0, 20, 50), normal_pairs)
    spans.material[:] = np.sort(rng.integers(0, materials, 50))
    constants = [make_constants(rng, 0) for _ in range(materials)]
    result = simulate(
        unit,
        beats_of(unit, spans),
        count=int(spans.length.sum()),
        write={
            name: np.concatenate(
                [of.writes(index if materials > 1 else None)[name] for index, of in enumerate(constants)]
            )
            for name in ("address", "data")
        },
        output_stalls=rng.random(89) < 0.3,
    )
    expected = np.array([np.floor(of.ambient / 64 + 0.5) for of in constants])
    colors = np.stack([result.beats[name] for name in "rgb"], axis=-1)
    np.testing.assert_array_equal(colors, expected[np.repeat(spans.material, spans.length)])
    np.testing.assert_array_equal(colors, design.compute(spans, constants).color)
    cost = cost_of(unit)
    assert cost.multiplier_count == 0
    with pytest.raises(ValueError, match=r"^without lights there is no setup, and no setup_interval$"):
        ShadingPipelineUnit(design.built(setup_interval=4))


@pytest.mark.parametrize(("method", "lights"), [("quadratic", 1), ("renormalise", 2)])
def test_products_with_normals_share_multipliers_in_the_compact_style(method, lights, never_built):
    full, compact = (ShadingPipelineUnit(preset(method, lights=lights, style=s)) for s in STYLES)
    counts = [cost_of(unit._interpolator._products).multiplier_count for unit in (full, compact)]
    assert counts == [6 * lights, 2 * lights]


def test_unknown_style(never_built):
    with pytest.raises(ValueError, match=r"^style must be one of throughput, compact, not 'small'$"):
        preset(style="small")
