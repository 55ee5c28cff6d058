# amaranth: UnusedElaboratable=no
"""The shading pipeline: cycles, cost, build options and refusals. `test_units` checks its pixels."""

import gc
import math
import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from amaranth.hdl import UnusedElaboratable

from blysk.bench.units.operands import pairs_at
from blysk.bench.units.pipeline import RECORD, case_of
from blysk.bench.units.pipeline_spans import any_constants, any_spans, operands_of
from blysk.golden.build import STYLES, Build
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.unit_vector import quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import METHODS, PUBLISHED, preset
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.methods.registry import unit_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.vectors import pixel_beats

from ..checks import assert_beats_equal
from ..lists import KINDS

FROM_NORMALS = [name for name, of in METHODS.items() if of.brings_ends]


def shade(unit, spans, constants, pixels=None, engine="auto", **stalls):
    """Run spans, and check that their pixels are the model's, or given pixels."""
    case = case_of(unit, spans, constants)
    expected = RECORD.expect(unit, case) if pixels is None else pixel_beats(pixels)
    options = {"write": case.write, "engine": engine, **stalls}
    found = simulate(unit, case.beats, count=len(expected["x"]), **options)
    assert_beats_equal(found.beats, expected)
    assert {name: found.status[name] for name in RECORD.status(unit, case)} == RECORD.status(unit, case)
    return found


def spans_in_range(rng, design, lengths, largest=None):
    """Spans with such lengths that the method serves them, and constants."""
    largest = design.interpolator.MAX_ANGLE - 0.01 if largest is None else largest
    left, right = pairs_at(rng, len(lengths), rng.uniform(0, largest, len(lengths)))
    x, y = rng.integers(0, (1 << design.x_bits) - lengths), rng.integers(0, 1 << design.y_bits, len(lengths))
    spans = Spans(x, y, lengths, quantise(left), quantise(right))
    return spans, any_constants(rng, design, spans)


# Cycles.


def intervals():
    """For one method of each unit: the shortest, the longest and the default setup interval."""
    for method in FROM_NORMALS:
        choice = unit_of(METHODS[method]).setup_intervals(METHODS[method])
        choice = [*choice[:2], *choice[2:][-1:]]
        if method in ("linear", "quadratic", "angular", "recurrence"):
            for interval in choice:
                quick = interval == choice[-1] and method == "linear"
                marks = () if quick else pytest.mark.long
                yield pytest.param(method, interval, marks=marks)
        quick = method == "renormalise"
        yield pytest.param(method, None, marks=() if quick else pytest.mark.long)


@pytest.mark.parametrize(("method", "interval"), list(intervals()))
def test_cycles(method, interval):
    """One pixel a cycle: a span takes its number of pixels or the setup interval, whichever is larger, and no
    more.

    The first pixel leaves `latency` cycles after an empty pipeline has accepted its span.
    """
    rng = np.random.default_rng(interval)
    design = preset(method, "cosquad", setup_interval=interval)
    unit = ShadingPipelineUnit(design)
    lengths = np.r_[5, rng.integers(1, 12, 20), np.full(40, 1), 40, 1, 1]
    found = shade(unit, *spans_in_range(rng, design, lengths), engine="pysim")
    first = found.cycles[np.cumsum(lengths) - lengths]
    taken, length = np.diff(first), lengths[:-1]
    within = np.delete(np.diff(found.cycles), np.cumsum(length) - 1)
    assert np.all(taken >= length * unit.cycles_per_pixel)
    if method == "bisection":
        # Spans that are divided take longer.
        assert first[0] >= found.input_cycles[0] + unit.latency
        return
    assert first[0] == found.input_cycles[0] + unit.latency
    assert np.all(within == unit.cycles_per_pixel)
    assert np.all(taken <= np.maximum(length * unit.cycles_per_pixel, unit.setup_interval))
    if interval is not None:
        # In a run of single pixels each pixel takes the interval.
        assert unit.setup_interval == interval
        assert np.all(taken[26:31] == interval)


@pytest.mark.parametrize("lights", [1, pytest.param(3, marks=pytest.mark.long)])
@pytest.mark.parametrize(
    ("method", "latency", "interval"),
    [
        pytest.param("quadratic", 73, 4, marks=pytest.mark.long),
        ("renormalise", 67, 3),
    ],
)
def test_cycles_of_long_spans(method, latency, interval, lights):
    """A span that is set up while the span before is shaded takes only its own length."""
    rng = np.random.default_rng(7)
    lengths = np.r_[rng.integers(interval, 40, 300), [4095, 4095, interval]]
    design = preset(method, "cosquad", lights=lights)
    unit = ShadingPipelineUnit(design)
    found = shade(unit, *spans_in_range(rng, design, lengths, 40.0))
    assert unit.latency == latency + math.ceil(math.log2(2 * lights + 1))
    assert unit.setup_interval == interval
    np.testing.assert_array_equal(np.diff(found.cycles[np.cumsum(lengths) - lengths]), lengths[:-1])


INTERVALS = {
    "linear": range(1, 8),
    "bisection": (),
    "quadratic": range(1, 8),
    "quadratic-eval": (),
    "quadratic-horner": (),
    "angular": range(1, 7),
    "renormalise": (1, 2, 3, 4, 5, 9),
    "chord-local": (1, 2, 3, 6),
    "recurrence": range(1, 47),
}


@pytest.fixture
def never_built():
    """These pipelines are refused, or only asked for their figures, and never elaborated."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusedElaboratable)
        yield
        gc.collect()


@pytest.mark.usefixtures("never_built")
@pytest.mark.parametrize(
    "method",
    [m if m in ("renormalise", "linear") else pytest.param(m, marks=pytest.mark.long) for m in INTERVALS],
)
def test_setup_intervals(method):
    """The intervals of a method are 1 to its largest.

    The default is the largest up to 4, for renormalise 3. Others are refused.
    """
    interpolator, choice = METHODS[method], INTERVALS[method]
    assert tuple(unit_of(interpolator).setup_intervals(interpolator)) == tuple(choice)
    if choice:
        assert ShadingPipelineUnit(preset(method, "cosquad")).setup_interval == max(
            k for k in choice if k <= (3 if method == "renormalise" else 4)
        )
    spelled = {
        "renormalise": "1, 2, 3, 4, 5 or 9",
        "chord-local": "1, 2, 3 or 6",
    }
    words = spelled.get(method) or (f"{choice[0]} to {choice[-1]}" if choice else "left out")
    between = {"renormalise": 6, "chord-local": 5}.get(method, 0)
    for interval in (0, between, choice[-1] + 1 if choice else 4):
        text = f"setup_interval of {method} must be {words}, not {interval}"
        with pytest.raises(ValueError, match=f"^{text}$"):
            ShadingPipelineUnit(preset(method, "cosquad", setup_interval=interval))


@pytest.mark.long
@pytest.mark.parametrize(("method", "interval"), [("quadratic", 4), ("quadratic", 7)])
def test_gate_costs_no_cycle(method, interval):
    """Decisions come in time for spans of every length, however many single pixels are inside."""
    rng = np.random.default_rng(interval)
    design = preset(method, "cosquad", setup_interval=interval)
    lengths = np.r_[rng.integers(1, 40, 200), np.full(150, 1), np.full(60, 5)]
    spans, constants = spans_in_range(rng, design, lengths, 20.0)
    without, found = (
        shade(ShadingPipelineUnit(replace(design, gate=gate)), spans, constants) for gate in (False, True)
    )
    late = (found.cycles - found.cycles[0]) - (without.cycles - without.cycles[0])
    assert late[-1] == 0
    assert late.max() <= 3 * (interval > 3)


@pytest.mark.long
def test_compact_style_takes_three_cycles_a_term():
    """Highlights take cycles, and pixels without a highlight do not."""
    rng = np.random.default_rng(1)
    design = preset("renormalise", "cosquad", style="compact")
    spans, (constants,) = spans_in_range(rng, design, np.full(30, 60), 20.0)
    constants = replace(constants, exponent=3)
    cosine, highlight, dark = operands_of(design, spans, constants)
    specular = design.specular.compute(highlight, dark, constants.exponent)
    cycles = Intensity().cycles(Diffuse(cosine.format).compute(cosine), specular)
    assert set(cycles.tolist()) == {3, 6}
    unit = ShadingPipelineUnit(design)
    np.testing.assert_array_equal(np.diff(shade(unit, spans, constants).cycles), cycles[1:])
    assert unit.cycles_per_pixel == 6


@pytest.mark.long
def test_gate_spares_the_compact_style_cycles():
    """A power takes 42 cycles a pixel.

    Pixels behind the light, and spans without a highlight, do not take them.
    """
    rng = np.random.default_rng(3)
    design = preset("quadratic", "blinn_product", style="compact")
    spans, (constants,) = spans_in_range(rng, design, np.full(30, 40), 20.0)
    constants.direction[:] = constants.halfway
    constants = replace(constants, exponent=300)
    behind = operands_of(design, spans, constants)[2][:, 0]
    cycles = []
    for gate in (False, True):
        gated = replace(design, gate=gate)
        found = shade(ShadingPipelineUnit(gated), spans, constants, design.compute(spans, constants))
        dark = behind | ~np.repeat(gated.lit_spans(spans, constants)[:, 0], 40) if gate else behind
        # Few pixels can wait beside the power unit, so dark pixels take their three cycles between powers.
        expected = np.where(dark, 3, 42).sum()
        assert expected * 0.95 <= found.total_cycles <= expected * 1.05
        cycles.append(found.total_cycles)
    assert cycles[1] < cycles[0] / 2


# Pixels of every method with every model, and flags.


def pairs():
    """Renormalise with a model of each kind of specular unit, another method with two models, and a published
    method.

    `test_units` checks each method with its own model, and the specular unit of every model.
    """
    for index, method in enumerate(FROM_NORMALS):
        kinds = KINDS if method == "renormalise" else (KINDS[index % len(KINDS)], "blinn_product")
        yield from ((method, model) for model in dict.fromkeys(kinds))
    for method in PUBLISHED:
        yield method, "cosquad"


@pytest.mark.long
@pytest.mark.parametrize(("method", "model"), list(pairs()))
def test_methods_with_models(method, model):
    rng = np.random.default_rng(len(model))
    design = preset(method, model)
    spans = any_spans(rng, design, np.r_[1, 2, 3, 16, 0, rng.integers(1, 41, 19)])
    unit, constants = ShadingPipelineUnit(design), any_constants(rng, design, spans)
    shade(unit, spans, constants, engine="pysim", output_stalls=rng.random(101) < 0.3)


@pytest.mark.parametrize(("x", "flagged"), [(4086, 0), (4087, 1)])
def test_span_past_the_last_column_is_flagged(x, flagged):
    rng = np.random.default_rng(10)
    spans, constants = spans_in_range(rng, preset("linear", "cosquad"), np.array([10, 10]))
    spans.x[:] = x
    found = shade(ShadingPipelineUnit(preset("linear", "cosquad")), spans, constants, engine="pysim")
    assert found.status["overrun"] == flagged


# Cost.

LEFT_OUT = {
    "specular": {"specular": None},
    "exponent": {"build": Build(exponent=20)},
    "channels": {"grey": True},
    "widths": {"x_bits": 9, "y_bits": 8, "length_bits": 5},
    "all": {"specular": None, "grey": True, "x_bits": 9, "y_bits": 8, "length_bits": 5},
}


FULL = preset("quadratic", "cosquad", lights=2, gate=True)


@cache
def cost_of_full(style):
    return cost_of(ShadingPipelineUnit(FULL.built(style=style)))


@pytest.mark.long
@pytest.mark.parametrize(
    ("part", "style"),
    [(part, style) for part in LEFT_OUT for style in STYLES if style == "throughput" or part == "all"],
)
def test_less_hardware_shades_the_same(part, style):
    """If a scene does not need a part, the pipeline without this part gives the same pixels and costs
    less."""
    rng = np.random.default_rng(5)
    full = FULL
    design = replace(full, gate="specular" not in LEFT_OUT[part], **LEFT_OUT[part])
    small = replace(full, **LEFT_OUT["widths"])
    spans, (constants,) = spans_in_range(rng, small, rng.integers(0, 32, 30), 20.0)
    constants = replace(constants, exponent=20)
    if design.model is None:
        constants.specular[:] = 0
    if design.grey:
        for colors in (constants.ambient, constants.diffuse, constants.specular):
            colors[...] = colors[..., :1]
    pixels = full.compute(spans, constants)
    assert len(np.unique(pixels.color)) > 50
    shade(ShadingPipelineUnit(design.built(style=style)), spans, constants, pixels, engine="pysim")
    less, more = cost_of(ShadingPipelineUnit(design.built(style=style))), cost_of_full(style)
    assert less.register_bits < more.register_bits
    assert less.multiplier_count <= more.multiplier_count
    if part in ("specular", "exponent", "channels") and style == "throughput":
        assert less.multiplier_count < more.multiplier_count


# Refusals.


@pytest.mark.usefixtures("never_built")
def test_without_lights_there_is_no_setup():
    with pytest.raises(ValueError, match=r"^without lights there is no setup, and no setup_interval$"):
        ShadingPipelineUnit(preset(model="cosquad", lights=0, setup_interval=4))


def test_unknown_style():
    with pytest.raises(ValueError, match=r"^style must be one of throughput, compact, not 'small'$"):
        preset(model="cosquad", style="small")
