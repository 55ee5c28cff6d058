"""Direct renormaliser: RTL against its twin, clock by clock."""

import numpy as np
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.hdl.normals.renormaliser import RenormaliserUnit
from blysk.sim.engines.simulate import simulate


def test_equals_twin(verify):
    rng = np.random.default_rng(1)
    vectors = rng.normal(size=(4000, 3))
    vectors *= rng.uniform(0.6, 1.1, (4000, 1)) / np.linalg.norm(vectors, axis=1, keepdims=True)
    codes = np.floor(vectors / COMPONENT.step).astype(np.int64)
    any_size = rng.integers(COMPONENT.min_code, COMPONENT.max_code + 1, (1000, 3))
    ends = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (300, 3))
    codes = np.clip(np.vstack([codes, any_size, ends]), COMPONENT.min_code, COMPONENT.max_code)
    codes = rng.permutation(codes)
    normals, outside = Renormaliser().compute(Fixed(COMPONENT, codes))
    assert 0 < outside.sum() < len(codes)
    verify(RenormaliserUnit(), codes, {"normal": normals.codes, "outside": outside})


def test_every_segment_and_its_ends(verify):
    # Vectors (x, y, 0) with x^2 + y^2 next below and next above every border of a segment.
    parameters = Renormaliser()
    borders = (parameters.LOW + np.arange(parameters.SEGMENTS + 1) / 32) * 2.0**34
    x = np.floor(np.sqrt(borders) * 0.7).astype(np.int64)
    y = np.sqrt(borders - x * x).astype(np.int64)
    near = [np.stack([x, y + offset, np.zeros_like(x)], axis=1) for offset in (-1, 0, 1, 2)]
    codes = np.vstack(near)
    normals, outside = parameters.compute(Fixed(COMPONENT, codes))
    assert set(outside.tolist()) == {True, False}
    verify(RenormaliserUnit(), codes, {"normal": normals.codes, "outside": outside})


def test_every_bit_counts():
    """The last bits of the products are rounded off: each decides once in many thousands."""
    rng = np.random.default_rng(2)
    vectors = rng.normal(size=(300_000, 3))
    vectors *= rng.uniform(0.68, 1.02, (len(vectors), 1)) / np.linalg.norm(vectors, axis=1, keepdims=True)
    codes = np.clip(np.floor(vectors / COMPONENT.step), COMPONENT.min_code, COMPONENT.max_code).astype(int)
    # Along an axis the sum may come to 1, and saturates.
    along = np.arange(90_000, COMPONENT.max_code, 3)[:, np.newaxis]
    codes = np.vstack([codes, *(along * axis for axis in np.eye(3, dtype=int))])
    normals, outside = Renormaliser().compute(Fixed(COMPONENT, codes))
    run = simulate(RenormaliserUnit(), codes, count=len(codes), engine="auto")
    np.testing.assert_array_equal(run.beats["normal"], normals.codes)
    np.testing.assert_array_equal(run.beats["outside"], outside)


def test_stiff_words_and_lengths(verify):
    """Length 0, 1 +- 1/256, one code off every border, every corner of the word; twice in opposite signs."""
    low, high = COMPONENT.min_code, COMPONENT.max_code
    corners = np.array(np.meshgrid(*[[low, -1, 0, 1, high]] * 3)).reshape(3, -1).T
    axes = ONE * np.vstack([np.eye(3, dtype=int), -np.eye(3, dtype=int)])
    slanted = np.round(ONE * np.array([[0.6, 0.8, 0], [0.48, 0.6, 0.64]])).astype(int)
    near = [np.round(slanted * scale).astype(int) for scale in (1 - 1 / 256, 1, 1 + 1 / 256)]
    codes = np.vstack([corners, axes, *near, *(-v for v in near), axes - np.sign(axes)])
    normals, outside = Renormaliser().compute(Fixed(COMPONENT, codes))
    assert outside[(codes == 0).all(axis=1)].all()
    verify(RenormaliserUnit(), codes, {"normal": normals.codes, "outside": outside})


def test_stiff_reset_leaves_nothing():
    """Reset with 1 to 13 vectors taken in: none of them comes out, and the next one does, at its clock."""
    unit = RenormaliserUnit()
    reset = Signal()
    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    expected = Renormaliser().compute(Fixed(COMPONENT, np.array([[80000, -60000, 50000]])))[0].codes[0]

    async def send(context, codes):
        for c in range(3):
            context.set(Value.cast(unit.i.payload[c]), codes[c])
        context.set(unit.i.valid, 1)
        assert context.get(unit.i.ready)
        await context.tick()
        context.set(unit.i.valid, 0)

    async def drive(context):
        context.set(unit.o.ready, 1)
        for before in range(1, 14):
            for k in range(before):
                await send(context, (90000, 70000, k))
            context.set(reset, 1)
            await context.tick()
            context.set(reset, 0)
            await send(context, (80000, -60000, 50000))
            for _ in range(unit.latency - 1):
                assert not context.get(unit.o.valid)
                await context.tick()
            assert context.get(unit.o.valid)
            found = [context.get(Value.cast(unit.o.payload.normal[c]).as_signed()) for c in range(3)]
            assert found == expected.tolist()
            assert not context.get(unit.o.payload.outside)
            await context.tick()
            assert not context.get(unit.o.valid)

    simulator.add_testbench(drive)
    simulator.run()
