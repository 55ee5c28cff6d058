"""Proofs of the parts that all streaming units share: skid buffers, register slices, FIFOs, pixel
counters."""

import itertools

import pytest
from amaranth.hdl import Cat, Module, Mux, Signal, unsigned
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

import blysk.hdl.core.memory
import blysk.hdl.core.pipelined_unit
import blysk.hdl.core.serial_fifo
import blysk.hdl.core.stream
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.stream import connect_slice

from .prover import Harness
from .rules import answers, follows, stays, taken

pytestmark = pytest.mark.prove

TAG = unsigned(2)


class Delay(PipelinedUnit):
    """A unit that sends a tag through registers, one for each cycle of latency; if the result stands, one for
    each interval."""

    def __init__(self, latency, initiation_interval=1, stands=False):
        super().__init__(TAG, TAG, latency=latency, initiation_interval=initiation_interval, stands=stands)

    def datapath(self, m, operands):
        if self.stands:
            stage = 0
            while stage + self.initiation_interval <= self.latency:
                stage = min(stage + self.initiation_interval, self.latency - 1)
                operands = self.register(m, operands, f"late_{stage}", when=self.at(stage))
            return operands
        stages = self.latency
        if self.initiation_interval > 1:
            # The register is read as late as the operand stays.
            stage = min(self.initiation_interval, self.latency - 1)
            if stage:
                operands = self.register(m, operands, "late", when=self.at(stage))
            stages -= stage + 1
        for stage in range(stages):
            operands = self.register(m, operands, f"stage_{stage}")
        return operands


class Chain(wiring.Component):
    """Streams in a row. A function of the module, the number and both streams connects each pair."""

    def __init__(self, connect, count=1):
        self.connect, self.count = connect, count
        super().__init__({"i": In(stream.Signature(TAG)), "o": Out(stream.Signature(TAG))})

    def elaborate(self, platform):
        m = Module()
        between = [stream.Signature(TAG).create(path=(str(k),)) for k in range(self.count - 1)]
        streams = [wiring.flipped(self.i), *between, wiring.flipped(self.o)]
        for number, (source, sink) in enumerate(itertools.pairwise(streams)):
            self.connect(m, number, source, sink)
        return m


def registered(m, number, source, sink):
    connect_slice(m, source, sink)


def buffered(depth):
    return lambda m, number, source, sink: blysk.hdl.core.stream.connect_fifo(
        m, f"buffer_{number}", source, sink, depth
    )


def kept(depth):
    return lambda m, number, source, sink: blysk.hdl.core.memory.connect_wide_fifo(
        m, f"kept_{number}", source, sink, depth
    )


def late(depth):
    return lambda m, number, source, sink: blysk.hdl.core.memory.connect_late_fifo(
        m, f"late_{number}", source, sink, depth
    )


def in_parts(words):
    return lambda m, number, source, sink: blysk.hdl.core.serial_fifo.connect_serial_fifo(
        m, f"parts_{number}", source, sink, words, 1
    )


def equal(came, leaves):
    return came == leaves


def of_stream(unit, capacity, latency, distance):
    """Claims on every stream: a beat leaves within ``latency`` cycles, and a beat is taken within
    ``distance`` cycles."""
    h = Harness(unit)
    stays(h, unit.o)
    inside = follows(h, unit.i, unit.o, capacity, equal)
    answers(h, inside.any(), taken(unit.o), latency, unit.o.ready)
    answers(h, unit.i.valid, unit.i.ready, distance, unit.o.ready)
    return h


TIMINGS = [(1, 1), (2, 1), (4, 1), (1, 2), (2, 2), (5, 2), (3, 4), (9, 4), (10, 7)]


STANDING = [(2, 2, True), (3, 2, True), (3, 4, True), (9, 4, True), (10, 7, True)]
"""Timings of results that stand for one further cycle, without a spare register."""


def of_delay(*timing):
    """The claims of a stream, and the claims on turns."""
    unit = Delay(*timing)
    latency, interval = unit.latency, unit.initiation_interval
    h = of_stream(unit, -(-latency // interval) + 1, latency - 1, interval)
    m, stages, came = h.m, Signal(latency), Signal()
    lifetime, turn = Signal(), Signal(range(interval))
    m.d.sync += [
        lifetime.eq(unit.o.valid & ~unit.o.ready),
        stages.eq(unit._stages),
        came.eq(taken(unit.i)),
    ]
    stood = Signal()
    m.d.sync += stood.eq(lifetime)
    h.claim(unit._stages == Mux(stood, stages, Cat(came, stages)[:latency]))
    # Enabled cycles since the last beat was taken, modulo the interval.
    with m.If(taken(unit.i)):
        m.d.sync += turn.eq(1 % interval)
    with m.Elif(~lifetime):
        m.d.sync += turn.eq(Mux(turn == interval - 1, 0, turn + 1))
    h.claim(~(taken(unit.i) & unit._stages[:-1].any()) | (turn == 0))
    return h


@pytest.mark.parametrize("timing", [*TIMINGS, *STANDING])
def test_pipelined_unit(prove, timing):
    """By induction: the claims of a stream, and the claims on turns.

    A unit holds a beat for each interval of its latency, and one that waits. While the output is ready, a
    beat inside leaves after at most ``latency`` cycles, and an offered beat is taken after at most
    ``initiation_interval`` cycles. Cycles count for all ages, except a cycle after a beat was not taken.
    While a beat is inside, the next beat comes a whole multiple of the interval later, in cycles that count.
    """
    prove(of_delay(*timing))


def test_a_result_that_does_not_stand_is_found(refute, inject):
    """A register whose last cycle is that of the output is found: the next beat replaces a beat that
    waits."""
    inject(Delay, "datapath", "<= self.latency", "< self.latency")
    refute(of_delay(4, 2, True))


def of_registers(count):
    """Claims on a chain of register slices.

    Each holds two beats and takes one cycle; its ready also takes a cycle back.
    """
    return of_stream(Chain(registered, count), 2 * count, count - 1, count)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_registers(prove, count):
    """By induction, for some slices in a row: the claims of a stream."""
    prove(of_registers(count))


@pytest.mark.parametrize("depth", [3, 4, 6])
def test_buffer(prove, depth):
    """By induction: the claims of a stream, with ``depth`` beats inside and two cycles of latency."""
    prove(of_stream(Chain(buffered(depth)), depth, 1, 1))


BUFFER_BUGS = {
    "what waits is dropped": ("buffer.r_en.eq(sink.ready)", "buffer.r_en.eq(1)"),
    "it takes in what it has no room for": ("source.ready.eq(buffer.w_rdy)", "source.ready.eq(1)"),
    "a beat is given again": ("buffer.r_en.eq(sink.ready)", "buffer.r_en.eq(sink.ready & source.valid)"),
    "any beat is taken in": ("buffer.w_en.eq(source.valid)", "buffer.w_en.eq(1)"),
}


@pytest.mark.parametrize("bug", BUFFER_BUGS)
def test_bugs_of_a_buffer_are_found(refute, inject, bug):
    """Each bug, injected in `connect_fifo`, refutes a claim of a stream."""
    inject(blysk.hdl.core.stream, "connect_fifo", *BUFFER_BUGS[bug])
    refute(of_stream(Chain(buffered(3)), 3, 1, 1))


@pytest.mark.parametrize("depth", [2, 3, 4])
def test_wide_buffer(prove, depth):
    """By induction: the claims of a stream, with ``depth`` beats inside and one cycle of latency."""
    prove(of_stream(Chain(kept(depth)), depth, 0, 1))


WIDE_BUFFER_BUGS = {
    "what waits is dropped": ("some & sink.ready", "some"),
    "it takes in what it has no room for": ("room.eq(following != depth)", "room.eq(1)"),
    "what waits is written over": ("write.en.eq(room)", "write.en.eq(1)"),
    "a beat is given that was not taken in": ("source.valid & room", "room"),
}


@pytest.mark.parametrize("bug", WIDE_BUFFER_BUGS)
def test_bugs_of_a_wide_buffer_are_found(refute, inject, bug):
    """Each bug, injected in `connect_wide_fifo`, refutes a claim of a stream."""
    inject(blysk.hdl.core.memory, "connect_wide_fifo", *WIDE_BUFFER_BUGS[bug])
    refute(of_stream(Chain(kept(2)), 2, 0, 1))


def of_late_buffer():
    """Four beats in the memory, of which three may be on their way, and two beats behind it."""
    return of_stream(Chain(late(4)), 6, 4, 7)


def test_late_buffer(prove):
    """By induction: the claims of a stream, with four cycles of latency, and one more if another beat is
    written."""
    prove(of_late_buffer())


LATE_BUFFER_BUGS = {
    "what waits is dropped": ("wanted & some", "some"),
    "it takes in what it has no room for": ("room.eq(level < depth - UNCOUNTED)", "room.eq(level < depth)"),
    "what was read is read again": ("(one & ~reads)", "one"),
}


@pytest.mark.parametrize("bug", LATE_BUFFER_BUGS)
def test_bugs_of_a_late_buffer_are_found(refute, inject, bug):
    """Each bug, injected in `connect_late_fifo`, refutes a claim of a stream."""
    inject(blysk.hdl.core.memory, "connect_late_fifo", *LATE_BUFFER_BUGS[bug])
    refute(of_late_buffer(), 14)


def of_serial_buffer(words):
    """Beats of two parts: as many in the memory as it has room for, and one behind it."""
    return of_stream(Chain(in_parts(words)), words // 2 + 1, 6, 10)


@pytest.mark.parametrize("words", [4, 8])
def test_serial_buffer(prove, words):
    """By induction: the claims of a stream, with six cycles of latency."""
    prove(of_serial_buffer(words))


SERIAL_BUFFER_BUGS = {
    "what waits is written over": ("level < room - 1", "level < room"),
    "a beat is read before its last part is written": ("turn == parts - 1", "turn == 0"),
    "a beat is given without its last part": ("ends = step == parts", "ends = step == parts - 1"),
    "a beat is given before it is there": ("~there & level.any()", "~there"),
}


@pytest.mark.parametrize("bug", SERIAL_BUFFER_BUGS)
def test_bugs_of_a_serial_buffer_are_found(refute, inject, bug):
    """Each bug, injected in `connect_serial_fifo`, refutes a claim of a stream."""
    inject(blysk.hdl.core.serial_fifo, "connect_serial_fifo", *SERIAL_BUFFER_BUGS[bug])
    refute(of_serial_buffer(4))


def test_a_proof_of_too_few_cycles_is_found(prove):
    """In 6 cycles of a unit with 4 cycles of latency, no beat that waited can leave.

    So a proof of 6 cycles would not see a lost beat.
    """
    with pytest.raises(AssertionError, match="nothing moves on in 6 cycles"):
        prove(of_stream(Delay(4), 5, 3, 1), 6)


SKID_BUFFER_BUGS = {
    "drops what it holds": ("Mux(held, spare, Value.cast(payload))", "payload"),
    "moves while it holds": ("return moves", "return Value.cast(1)"),
    "forgets that it holds": ("held | valid", "valid"),
    "takes in while it holds": ("m.If(moves)", "m.If(1)"),
    "holds what was taken": ("output.valid & ~output.ready", "output.valid"),
    "holds through a reset": ('name="held"', 'name="held", reset_less=True'),
}


@pytest.mark.parametrize("bug", SKID_BUFFER_BUGS)
@pytest.mark.parametrize("make", [lambda: of_delay(2, 1), lambda: of_registers(2)])
def test_bugs_of_a_skid_buffer_are_found(refute, inject, make, bug):
    """Each bug, injected in `skid_buffer`, refutes a claim of a stream."""
    for user in (blysk.hdl.core.stream, blysk.hdl.core.pipelined_unit):
        inject(user, "skid_buffer", *SKID_BUFFER_BUGS[bug])
    refute(make())


@pytest.mark.parametrize("bug", ["moves while it holds", "forgets that it holds", "holds what was taken"])
def test_bugs_without_a_spare_register_are_found(refute, inject, bug):
    """The same bugs are found if the result stands."""
    inject(blysk.hdl.core.pipelined_unit, "skid_buffer", *SKID_BUFFER_BUGS[bug])
    refute(of_delay(3, 2, True))


UNIT_BUGS = {
    "a beat is lost": (
        (4, 1),
        "elaborate",
        "Cat(accept, self._stages[:-1])",
        "Cat(accept, self._stages[:-1]) & ~4",
    ),
    "the control moves while the data is stalled": ((4, 1), "elaborate", "m.If(advance)", "m.If(1)"),
    "the data moves while it should be stalled": (
        (4, 1),
        "elaborate",
        "Inserter(advance)",
        "Inserter(Value.cast(1))",
    ),
    "any operand is taken in": ((10, 4), "elaborate", "when=self.i.ready", "when=Value.cast(1)"),
    "the slot is a cycle short": ((10, 4), "_turn", "self.initiation_interval - 1", "2"),
    "the slot goes on": ((10, 4), "_turn", "opens, turn == 0", "opens, opens"),
    "ready while it is stalled": ((10, 4), "_turn", "~waits & ", ""),
}


@pytest.mark.parametrize("bug", UNIT_BUGS)
def test_bugs_of_a_pipelined_unit_are_found(refute, inject, bug):
    """Each bug, injected in `PipelinedUnit`, refutes a claim of a stream or a claim on turns."""
    timing, *change = UNIT_BUGS[bug]
    inject(PipelinedUnit, *change)
    refute(of_delay(*timing))


def of_counter():
    """Claims on a counter of pixels.

    A span of up to 7 pixels begins at any allowed time, and a model counts its pixels that are left.
    """
    h = Harness()
    length, valid, advance = h.free(3, "length"), h.free(name="valid"), h.free(name="advance")
    active, ends = blysk.hdl.core.stream.count_down(h.m, valid, length, advance)
    left = Signal(3)
    with h.m.If(valid & advance & (left <= 1)):
        h.m.d.sync += left.eq(length)
    with h.m.Elif(advance & left.any()):
        h.m.d.sync += left.eq(left - 1)
    h.claim((active == left.any()) & (ends == (left <= 1)))
    return h


def test_pixel_counter(prove):
    """By induction, for lengths 0 to 7: active and ends are those of the model, whatever the stalls."""
    prove(of_counter())


COUNTER_BUGS = {
    "a span of no pixels ends never": ("~(valid & length[1:].any())", "(length == 1)"),
    "a span of no pixels has one": ("valid & length.any()", "valid"),
    "it counts while it is stalled": ("m.If(advance)", "m.If(1)"),
    "it ends a pixel early": ("remaining == 2", "remaining == 3"),
    "it never stops": ("active.eq(valid & length.any())", "active.eq(active | valid)"),
}


@pytest.mark.parametrize("bug", COUNTER_BUGS)
def test_bugs_of_a_pixel_counter_are_found(refute, inject, bug):
    inject(blysk.hdl.core.stream, "count_down", *COUNTER_BUGS[bug])
    refute(of_counter())
