"""Chain of bisections: RTL against its twin, clock by clock."""

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED, quantise
from blysk.hdl.normals.bisection_chain import BisectionChainUnit
from blysk.sim.engines.simulate import simulate


def spans(normal_pairs, parameters, seed, count):
    rng = np.random.default_rng(seed)
    angles = np.r_[0, 45, 90, 180, 10.0 ** rng.uniform(-4, 0, count // 4), rng.uniform(0, 100, count)]
    left, right = (quantise(normals) for normals in normal_pairs(rng, len(angles), angles))
    corners = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (count // 4, 6))
    left, right = np.vstack([left, corners[:, :3]]), np.vstack([right, corners[:, 3:]])
    order = rng.permutation(len(left))
    left, right = left[order], right[order]
    level = rng.integers(1, 16, len(left))
    normal, out_of_range = parameters.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right), level)
    assert out_of_range.any()
    assert not out_of_range.all()
    return {"normal_left": left, "normal_right": right, "level": level}, normal.codes, out_of_range


@pytest.mark.parametrize(
    "bisection", [Bisection(), Bisection(1, 45), Bisection(2, as_published=True)], ids=str
)
def test_equals_twin(normal_pairs, bisection):
    parameters = BisectionChain(bisection)
    unit = BisectionChainUnit(parameters)
    beats, normal, out_of_range = spans(normal_pairs, parameters, 3, 400)
    count = len(out_of_range)
    run = simulate(unit, beats, count=count, engine="auto")
    np.testing.assert_array_equal(run.beats["normal"], normal)
    np.testing.assert_array_equal(run.beats["out_of_range"], out_of_range)
    latency = np.array([unit.latency(k) for k in beats["level"].tolist()])
    np.testing.assert_array_equal(run.cycles - run.input_cycles, latency)
    np.testing.assert_array_equal(run.input_cycles[1:], run.cycles[:-1] + 1)

    rng = np.random.default_rng(4)
    stalls = {"input_stalls": rng.random(997) < 0.4, "output_stalls": rng.random(1009) < 0.7}
    run = simulate(unit, beats, count=count, engine="auto", **stalls)
    np.testing.assert_array_equal(run.beats["normal"], normal)
    few = {name: value[:8] for name, value in beats.items()}
    slow, fast = (simulate(unit, few, count=8, engine=engine, **stalls) for engine in ("pysim", "auto"))
    np.testing.assert_array_equal(slow.beats["normal"], normal[:8])
    np.testing.assert_array_equal(slow.cycles, fast.cycles)
    np.testing.assert_array_equal(slow.input_cycles, fast.input_cycles)
    # A 4-bit counter that starts at 0 goes round.
    zero = {name: value[:1] for name, value in beats.items()} | {"level": [0]}
    run = simulate(unit, zero, count=1, engine="auto")
    assert run.cycles[0] - run.input_cycles[0] == unit.latency(16)


def test_every_bit_counts(normal_pairs):
    """The last bits of the products and of the sums are rounded off: each decides once in thousands."""
    beats, normal, out_of_range = spans(normal_pairs, BisectionChain(), 5, 2000)
    run = simulate(BisectionChainUnit(), beats, count=len(out_of_range), engine="auto")
    np.testing.assert_array_equal(run.beats["normal"], normal)
    np.testing.assert_array_equal(run.beats["out_of_range"], out_of_range)


def test_last_bits_of_all_count(normal_pairs, one_minus_cosines):
    """Spans at the borders of roundings, where a single step of a product decides."""
    rng, parameters = np.random.default_rng(6), BisectionChain()
    # Of all pairs of these ends those to 90 degrees whose u is at a border of both its roundings.
    ends = [quantise(normals) for normals in normal_pairs(rng, 2000, 90)]
    u = one_minus_cosines(*ends)
    border = abs((u - (7 << 13) + 20) % (1 << 17) - 20) < 20
    first = [end[k] for end, k in zip(ends, np.nonzero(border & (u < ONE_SQUARED.codes)), strict=True)]
    # Level 1 is the sum of the ends times f: those with a component at the border of its rounding.
    ends = [quantise(normals) for normals in normal_pairs(rng, 50_000, rng.uniform(0, 90, 50_000))]
    u = (ONE_SQUARED - DotProduct().compute(*(Fixed(COMPONENT, end) for end in ends))).round_half_up(20)
    e, _ = parameters.bisection.factor(u.round_half_up(17).wrap(Bisection.ANGLE_FORMAT))
    f = (e.codes + (1 << 18) + 2) >> 2
    border = abs(f[:, np.newaxis] * (ends[0] + ends[1]) % (1 << 17) - (1 << 16)) < 20
    left, right = (np.vstack([a, end[border.any(axis=1)]]) for a, end in zip(first, ends, strict=True))
    level = np.ones(len(left), dtype=int)
    normal, _ = parameters.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right), level)
    beats = {"normal_left": left, "normal_right": right, "level": level}
    run = simulate(BisectionChainUnit(), beats, count=len(level), engine="auto")
    np.testing.assert_array_equal(run.beats["normal"], normal.codes)


@pytest.mark.parametrize("clock", [0, 3, 8, 20, 33, 42, 50, 51, 52])
def test_reset_in_mid_span_leaves_nothing(normal_pairs, clock):
    """In every state, the wait for a ready sink included; the next span comes out as if it were the first."""
    parameters = BisectionChain()
    unit, reset = BisectionChainUnit(parameters), Signal()
    left, right = (quantise(normals) for normals in normal_pairs(np.random.default_rng(5), 2, [80.0, 30.0]))
    level = [2, 3]
    expected, _ = parameters.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right), np.array(level))
    assert unit.latency(2) == 51
    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    found = []

    def skid_buffer(context, index):
        span = unit.i.payload
        context.set(span.level, level[index])
        for c in range(3):
            context.set(Value.cast(span.normal_left[c]), left[index, c].item())
            context.set(Value.cast(span.normal_right[c]), right[index, c].item())
        context.set(unit.i.valid, 1)

    async def drive(context):
        skid_buffer(context, 0)
        await context.tick().repeat(1 + clock)
        assert context.get(unit.o.valid) == (clock >= 50)
        context.set(unit.i.valid, 0)
        context.set(reset, 1)
        await context.tick()
        context.set(reset, 0)
        context.set(unit.o.ready, 1)
        # Longer than a span takes: the one that was inside must not come out.
        for _ in range(60):
            assert not context.get(unit.o.valid)
            assert context.get(unit.i.ready)
            await context.tick()
        skid_buffer(context, 1)
        await context.tick()
        context.set(unit.i.valid, 0)
        cycles = 1
        while not context.get(unit.o.valid):
            await context.tick()
            cycles += 1
        found.append((cycles, [context.get(Value.cast(unit.o.payload.normal[c])) for c in range(3)]))

    simulator.add_testbench(drive)
    simulator.run()
    assert found == [(unit.latency(3), expected.codes[1].tolist())]
