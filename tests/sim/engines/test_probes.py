# amaranth: UnusedElaboratable=no
"""Watched words equal those of the bit-accurate model, at their ages, and the pipeline does not change."""

import numpy as np
import pytest
from amaranth.hdl import Fragment, Value
from amaranth.sim import Simulator

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.cosines.quotient_spans import SpanVectors
from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.lighting.specular import Specular
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import normalise
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import pack, unpack, word_count
from blysk.sim.engines.probes import ObservedPipeline, probes_of
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import beats_of, sample_attributes, sample_constants

DESIGN = preset("quadratic", "cosquad", operand="one_minus_cosine", gate=True)


def spans_near(rng, count):
    """Spans that turn by some degrees, most of them lit."""
    length = rng.integers(3, 9, count)
    left = normalise(rng.normal(size=(count, 3)) * 0.5 + (0, 0, 1))
    right = normalise(left + rng.normal(size=(count, 3)) * 0.03)
    return Spans(np.arange(count) * 10, np.arange(count), length, quantise(left), quantise(right))


def constants_of(exponent=20):
    vectors = [quantise(normalise(np.array([v], dtype=float))) for v in ((0.2, 0.3, 1), (0.1, 0.15, 1))]
    colors = [np.array([[c * 64] * 3]) for c in (120, 90)]
    return FrameConstants(exponent, np.array([64 * 9, 64 * 5, 0]), *vectors, *colors)


@pytest.fixture(scope="module")
def observed():
    component = ObservedPipeline(DESIGN)
    Fragment.get(component, None)
    return component


def rows_of(component, spans, constants, cycles):
    """The status in every cycle, as its registers are before the edge."""
    queue = []
    for stream, beats in (
        (component.write, writes_of([constants])),
        (component.i, beats_of(component.unit, spans)),
    ):
        words = pack(stream.payload.shape(), beats).astype("<u4")
        queue += [(stream, int.from_bytes(row.tobytes(), "little")) for row in words]
    status = Value.cast(component.status).as_unsigned()
    codes = []

    async def bench(context):
        context.set(component.o.ready, 1)
        for _ in range(cycles):
            stream, word = queue[0] if queue else (component.i, 0)
            context.set(Value.cast(stream.payload).as_unsigned(), word)
            context.set(stream.valid, bool(queue))
            moves = queue and context.get(stream.ready)
            codes.append(context.get(status))
            await context.tick()
            context.set(stream.valid, 0)
            if moves:
                queue.pop(0)

    simulator = Simulator(component)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    size = 4 * word_count(component.status.shape())
    raw = b"".join(code.to_bytes(size, "little") for code in codes)
    return unpack(component.status.shape(), np.frombuffer(raw, "<u4").reshape(cycles, -1).astype(np.uint32))


@pytest.mark.long
def test_beats_are_those_without_probes(observed):
    spans, constants = spans_near(np.random.default_rng(4), 6), constants_of()
    options = {"count": int(spans.length.sum()), "write": writes_of([constants]), "engine": "pysim"}
    plain = ShadingPipelineUnit(DESIGN)
    runs = [simulate(component, beats_of(plain, spans), **options) for component in (observed, plain)]
    np.testing.assert_array_equal(runs[0].beats, runs[1].beats)
    np.testing.assert_array_equal(runs[0].cycles, runs[1].cycles)
    for name in runs[1].status.dtype.names:
        assert runs[0].status[name] == runs[1].status[name]
    gated = ~DESIGN.lit_spans(spans, constants)[:, 0]
    assert runs[0].status["gated_pixels"] == spans.length[gated].sum()


def test_needs_one_light():
    with pytest.raises(ValueError, match="one light"):
        ObservedPipeline(preset("linear", "cosquad", lights=2, gate=True))


@pytest.mark.parametrize(
    ("method", "model"),
    [
        *(("linear", "cosquad"), ("linear", "lyon3_refitted"), ("linear", "exp")),
        *(("quadratic", "coscos4"), ("quadratic", "blinn_product")),
    ],
)
def test_formats_fit(method, model):
    unit = ShadingPipelineUnit(preset(method, model, gate=True))
    probes = {probe.name: probe for probe in probes_of(unit)}
    assert {"cosine", "highlight", "gated", "diffuse", "specular", "red", "r", "x", "last"} <= set(probes)
    assert isinstance(probes["specular"].shape, FixedShape)
    assert "normal_2_sum" in probes
    assert ("argument" in probes) == (model != "blinn_product")
    assert ("base" in probes) == (model in ("cosquad", "lyon3_refitted"))
    assert ("square_3" in probes) == (model == "lyon3_refitted")


def test_words_are_those_of_the_model(observed):
    """Every word of every pixel, at its age after the cycle in which the lights take the pixel."""
    spans, constants = spans_near(np.random.default_rng(5), 5), constants_of(4)
    count = int(spans.length.sum())
    rows = rows_of(observed, spans, constants, 200)
    taken = np.flatnonzero(rows["taken"]).tolist()
    assert len(taken) == count
    numbers = dict(zip(taken, range(count), strict=True))

    vectors = [Fixed(COMPONENT, v) for v in (constants.direction, constants.halfway)]
    ends = [Fixed(COMPONENT, codes) for codes in (spans.normal_left, spans.normal_right)]
    operands = DESIGN.interpolator.compute(*ends, spans.length, *vectors)
    normals, _ = DESIGN.interpolator.normals(*ends, spans.length)
    lit = np.repeat(DESIGN.lit_spans(spans, constants)[:, 0], spans.length)
    cosine, u = operands.cosine.codes[:, 0], operands.highlight.codes[:, 0]
    dark = (cosine <= 0) | ~lit
    specular = DESIGN.specular.compute(operands.highlight[:, 0], dark, constants.exponent)
    pixels = DESIGN.compute(spans, constants)
    expected = {
        "cosine": cosine,
        "highlight": u,
        "gated": ~lit,
        "argument": np.where(dark, 0, u),
        "specular": specular.codes,
        "r": pixels.color[:, 0],
        "b": pixels.color[:, 2],
        "x": pixels.x,
        "last": pixels.last,
        **{f"normal_{c}_sum": normals.codes[:, c] for c in range(3)},
    }
    for probe in probes_of(observed.unit):
        if probe.name not in expected:
            continue
        for clock, n in numbers.items():
            code = int(rows[clock + probe.age][probe.name])
            if probe.name.endswith("_sum"):
                # It has the half step with which a cut rounds.
                code >>= DifferenceAccumulator().format.fraction_bits - COMPONENT.fraction_bits
            assert code == int(expected[probe.name][n]), (probe.name, clock, n)

    # The words that follow from another word.
    ages = {probe.name: probe.age for probe in probes_of(observed.unit)}
    one = Specular.BASE_FORMAT.max_code
    followed = 0
    for clock in numbers:

        def code(name, clock=clock):
            return int(rows[clock + ages[name]][name])

        if code("specular"):
            assert code("base") == one - (code("product") >> 33 - 17)
            assert code("square") == code("base") ** 2
            assert code("specular") == code("square") >> 17
            followed += 1
        assert code("red_diffuse") == code("diffuse") * constants.diffuse[0, 0]
        assert code("red_specular") == code("specular") * constants.specular[0, 0]
        assert code("red") == code("red_diffuse") + code("red_specular") + (constants.ambient[0] << 17)
    assert 3 <= followed < count


@pytest.mark.ci
@pytest.mark.long
def test_words_of_an_albedo_are_those_of_the_model():
    """If terms wait for their albedo, words behind them keep their distance from ``shaded``."""
    design = preset("quotient", "blinn", albedo=Albedo.of_parts(("colors",)), transfer="srgb")
    component = ObservedPipeline(design)
    rng = np.random.default_rng(6)
    length = np.array([5, 1, 9, 3, 4])
    ends = rng.normal(size=(2, len(length), len(design.vector_spans.components)))
    normals = np.zeros((len(length), 3), dtype=np.int64)
    spans = Spans(
        *(10 * np.arange(5), np.arange(5), length, normals, normals),
        vectors=SpanVectors.quantise(*ends, length),
        attributes=sample_attributes(design.albedo, length, rng),
    )
    (constants,) = sample_constants(design, rng)
    rows = rows_of(component, spans, constants, len(constants.writes()["data"]) + 150)
    taken, shaded = (np.flatnonzero(rows[name]) for name in ("taken", "shaded"))
    assert len(taken) == len(shaded) == length.sum()
    ages = {probe.name: probe.age for probe in probes_of(component.unit)}
    assert (shaded - taken >= ages["diffuse"]).all()
    # Pixels that are held before their last word here. A span of one pixel makes its successor wait.
    last = ages["red"] - ages["diffuse"]
    free = np.flatnonzero([not rows["held"][clock : clock + last].any() for clock in shaded])
    assert 5 < len(free) < len(shaded)
    shaded = shaded[free]
    word = {name: rows[name][shaded + age - ages["diffuse"]] for name, age in ages.items() if age > 0}
    albedo = design.albedo.compute(spans.attributes, length, spans.material).codes[free, 0]
    np.testing.assert_array_equal(word["albedo"], albedo)
    light = word["diffuse"].astype(np.int64) * constants.diffuse[0, 0]
    np.testing.assert_array_equal(word["red_diffuse"], light)
    surface = light + (constants.ambient[0] << 17) + (1 << 16) >> 17
    np.testing.assert_array_equal(word["red_surface"], surface)
    shine = word["specular"].astype(np.int64) * constants.specular[0, 0]
    total = (surface * albedo << 1) + shine + (int(constants.emission[0]) << 17)
    np.testing.assert_array_equal(word["red"], total)
    assert (surface > 0).any()
