"""Reset with beats inside: units of the angular family do afterwards as from power-up."""

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Shape, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.number.unit_vector import quantise
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.arccos import ArccosUnit
from blysk.hdl.cosines.half_chord import HalfChordUnit
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.sim.engines.beats import pack

UNITS = {
    "arccos": ArccosUnit,
    "arccos_sequential": lambda: ArccosUnit(form="sequential"),
    "half_chord": HalfChordUnit,
    "angular_setup": AngularSetupUnit,
    "angular_setup_by_arccos": lambda: AngularSetupUnit(AngularSetup("arccos"), initiation_interval=4),
    "highlight_cosine": HighlightCosineUnit,
    "highlight_gate": HighlightGateUnit,
    "highlight_gate_every_4_cycles": lambda: HighlightGateUnit(initiation_interval=4),
    "recurrence": RecurrenceUnit,
    "recurrence_direct": lambda: RecurrenceUnit(Recurrence("direct")),
    "recurrence_interleaved": lambda: RecurrenceUnit(Recurrence(interleave=4)),
    "adaptive_normaliser": lambda: AdaptiveNormaliserUnit(AdaptiveNormaliser(2.0**-8)),
}


def random_beats(rng, shape, count):
    """Words of any size, but unit normals a few degrees apart and short spans; packed."""
    width = Shape.cast(shape).width
    words = rng.integers(0, 2**32, (count, -(-width // 32)), dtype=np.uint32)
    codes = [int.from_bytes(row.astype("<u4").tobytes(), "little") & ((1 << width) - 1) for row in words]
    members = getattr(shape, "members", {})
    fields = {}
    if "length" in members:
        fields["length"] = rng.integers(1, 12, count)
    if "normal_left" in members:
        middle = rng.normal(size=(count, 3))
        for name in ("normal_left", "normal_right"):
            normal = middle + 0.2 * rng.normal(size=(count, 3))
            fields[name] = quantise(normal / np.linalg.norm(normal, axis=1, keepdims=True))
    for name, values in fields.items():
        field = shape[name]
        packed = pack(field.shape, values)
        mask = ((1 << field.width) - 1) << field.offset
        for place, row in enumerate(packed):
            value = int.from_bytes(row.astype("<u4").tobytes(), "little")
            codes[place] = codes[place] & ~mask | value << field.offset
    return codes


class Driver:
    """A unit that can be reset, and what comes out of it clock by clock."""

    def __init__(self, unit):
        self.unit, self.reset = unit, Signal()
        self.simulator = Simulator(ResetInserter(self.reset)(unit))
        self.simulator.add_clock(1e-6)

    async def run(self, context, codes, cycles, stalls):
        """Clock and payload of every beat taken from the output."""
        unit, found, sent = self.unit, [], 0
        for clock in range(cycles):
            context.set(unit.o.ready, not stalls[clock % len(stalls)])
            context.set(unit.i.valid, sent < len(codes))
            if sent < len(codes):
                context.set(Value.cast(unit.i.payload).as_unsigned(), codes[sent])
            taken = context.get(unit.i.valid & unit.i.ready)
            if context.get(unit.o.valid & unit.o.ready):
                found.append((clock, context.get(Value.cast(unit.o.payload).as_unsigned())))
            await context.tick()
            sent += taken
        return found


@pytest.mark.parametrize("name", UNITS)
def test_reset_in_mid_span_leaves_nothing_behind(name):
    unit = UNITS[name]()
    rng = np.random.default_rng(len(name))
    shape = unit.i.payload.shape()
    codes, others = random_beats(rng, shape, 6), random_beats(rng, shape, 200)
    stalls = (rng.random(31) < 0.3).tolist()
    latency = getattr(unit, "latency", 100)
    cycles = {"adaptive_normaliser": 900}.get(name, 3 * latency + 250)
    runs = {}

    async def bench(context):
        if hasattr(unit, "constants"):
            # A half-way vector and an exponent that light about half of the spans.
            halfway = pack(unit.constants.shape()["halfway"].shape, quantise(np.array([[[0.6, 0, 0.8]]])))
            context.set(
                Value.cast(unit.constants.halfway),
                int.from_bytes(halfway[0].astype("<u4").tobytes(), "little"),
            )
            context.set(unit.constants.exponent, 4)
        for reset_at in (None, 1, latency // 2, latency, latency + 3, 2 * latency + 5):
            if reset_at is not None:
                await driver.run(context, others, reset_at, [False])
            context.set(driver.reset, reset_at is not None)
            await context.tick()
            context.set(driver.reset, 0)
            assert not context.get(unit.o.valid)
            runs[reset_at] = await driver.run(context, codes, cycles, stalls)

    driver = Driver(unit)
    driver.simulator.add_testbench(bench)
    driver.simulator.run()
    fresh = runs.pop(None)
    assert len(fresh) >= 6
    assert len({payload for _, payload in fresh}) > 1
    for reset_at, found in runs.items():
        assert found == fresh, reset_at
