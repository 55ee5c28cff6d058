"""The vector adapter: N/W at the first pixel of a span and its step, for methods that take vectors."""

from itertools import pairwise

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.span_attributes import SPAN_NORMAL, SPAN_STEP
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.hdl.core.bits import select
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import PipelinedUnit, stop_output
from blysk.hdl.geometry.span_halver import halved_spans_shape

__all__ = ["SerialVectorAdapterUnit", "VectorAdapterUnit", "vector_spans_shape"]


def vector_spans_shape(components: int = 3) -> data.StructLayout:
    """Shape of a span: its first vector, step and exponent, first pixel, length, depth and material."""
    vector = data.ArrayLayout(FixedShape(VectorAdapter.FORMAT), components)
    exponent = unsigned(VectorAdapter.LARGEST_EXPONENT.bit_length())
    given = halved_spans_shape().members
    words = {name: given[name] for name in ("x", "y", "length", "depth", "depth_step", "material")}
    return data.StructLayout({"start": vector, "step": vector, "exponent": exponent} | words)


class VectorAdapterUnit(PipelinedUnit):
    """Vectors and steps for a method that takes them: `VectorAdapter` is the bit-accurate model.

    The latency is 4 cycles (the shift of all; the margin to 1, and the bits that the step uses; its own
    shift; sign and rounding), the initiation interval 1. No multipliers.

    Parameters
    ----------
    parameters : VectorAdapter
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(halved_spans_shape()))`
        Pieces of `SpanHalverUnit`.
    o : :py:`Out(stream.Signature(vector_spans_shape()))`
        The same with words of `SpanVectors`.

    Source: docs/theory/geometry.md#composition; not in the documents.
    """

    def __init__(self, parameters: VectorAdapter | None = None):
        self.parameters = parameters or VectorAdapter()
        super().__init__(halved_spans_shape(), vector_spans_shape(), latency=4)

    def datapath(self, m, operands):
        """Shared shift; margin; the step's bits and shift; sign, rounding."""
        p, bits = self.parameters, SPAN_NORMAL.fraction_bits
        start, step = (
            [Value.cast(operands[name][k]).as_signed() for k in range(3)] for name in ("start", "step")
        )
        names = [name for name in self.o.payload.shape().members if name not in ("start", "step", "exponent")]
        words = {name: Value.cast(operands[name]) for name in names}
        words |= {"flip": operands.flip, "step_flip": operands.flip ^ operands.turned}
        for age in range(1, self.latency):
            words = {name: self.register(m, word, f"{name}_{age}") for name, word in words.items()}
        flips = words.pop("flip"), words.pop("step_flip")
        words = {name: self.register(m, word, f"{name}_{self.latency}") for name, word in words.items()}

        # Modulo 2, see the model.
        step = [code[: p.STEP_BITS + 1] for code in step]
        shift = operands.shift
        if p.rotates:
            shift = (shift - shift.any())[: len(shift)]
        for k in reversed(range(len(shift))):
            chosen, places = shift[k], 1 << k
            start = [Mux(chosen, code << places, code)[: bits + 1].as_signed() for code in start]
            step = [Mux(chosen, code << places, code)[: p.STEP_BITS + 1].as_signed() for code in step]
        start = [self.register(m, code, f"shifted_{k}") for k, code in enumerate(start)]
        step = [self.register(m, code, f"shifted_step_{k}") for k, code in enumerate(step)]

        # So many places at most: lower bits do not count.
        used = self.register(m, _used(p, step), "step_used")
        step = [self.register(m, _smaller(p, code), f"small_step_{k}") for k, code in enumerate(step)]
        start = [self.register(m, _smaller(p, code), f"small_{k}") for k, code in enumerate(start)]
        exponent = _exponent(used)
        for k in reversed(range(len(exponent))):
            step = [Mux(exponent[k], code << (1 << k), code)[: p.STEP_BITS + 1].as_signed() for code in step]
        step = [self.register(m, code, f"large_step_{k}") for k, code in enumerate(step)]
        exponent = self.register(m, exponent, "exponent_3")
        start = [self.register(m, code, f"vector_{k}") for k, code in enumerate(start)]

        result = Signal(self.o.payload.shape(), name="result")
        m.d.comb += [Value.cast(result[name]).eq(word) for name, word in words.items()]
        m.d.comb += result.exponent.eq(self.register(m, exponent, "exponent"))
        vectors = ("start", start, bits), ("step", step, p.STEP_BITS)
        for (name, codes, point), flip in zip(vectors, flips, strict=True):
            for k, code in enumerate(codes):
                word = self.register(m, _rounded(code, flip, point), f"{name}_{k}")
                m.d.comb += Value.cast(result[name][k]).eq(word)
        return result


class SerialVectorAdapterUnit(wiring.Component):
    """The words of `VectorAdapterUnit`, one component a cycle through one shifter.

    A span takes nine turns: its steps, for the exponent; its start; its steps again, for their words. The
    span is accepted with the last turn, and its words are on the output `latency` cycles later. All stops
    for a cycle at least while they are there, so that a span comes every `initiation_interval` cycles at
    most. No multipliers.

    Parameters
    ----------
    parameters : VectorAdapter
        Bit-accurate model.

    Members
    -------
    i, o
        Those of `VectorAdapterUnit`. A payload has to stay from the first cycle on which it is valid.

    Source: docs/theory/geometry.md#composition; not in the documents.
    """

    latency = 5

    initiation_interval = 10

    def __init__(self, parameters: VectorAdapter | None = None):
        self.parameters = parameters or VectorAdapter()
        shapes = {
            "i": In(stream.Signature(halved_spans_shape())),
            "o": Out(stream.Signature(vector_spans_shape())),
        }
        super().__init__(shapes)

    def elaborate(self, platform):
        """Turns; the stages of a component; the exponent, and the words that pass."""
        m = Module()
        p, given = self.parameters, self.i.payload
        bits, low = p.STEP_BITS + 1, SPAN_STEP.fraction_bits - SPAN_NORMAL.fraction_bits
        moves = Signal(name="moves")

        def register(value, name):
            signal = Signal(Value.cast(value).shape(), name=name, reset_less=True)
            with m.If(moves):
                m.d.sync += signal.eq(value)
            return signal

        # Three rounds of three components: for the exponent, of the start, of the step.
        turn = data.StructLayout({"finds": 1, "is_start": 1, "first": 1, "last": 1})
        place, round_ = Signal(2, name="component"), Signal(2, name="round")
        ends = place[1]
        turns = [Signal(turn, name=f"turn_{stage}") for stage in range(self.latency)]
        now = turns[0]
        m.d.comb += [
            now.finds.eq(round_ == 0),
            now.is_start.eq(round_[0]),
            now.first.eq(place == 0),
            now.last.eq(self.i.valid & ends & round_[1]),
            self.i.ready.eq(moves & ends & round_[1]),
        ]
        with m.If(moves):
            m.d.sync += [after.eq(before) for before, after in pairwise(turns)]
            with m.If(self.i.valid):
                m.d.sync += place.eq(Mux(ends, 0, place + 1))
                with m.If(ends):
                    m.d.sync += round_.eq(Mux(round_[1], 0, round_ + 1))

        # All with the step's fraction bits, and modulo 2, see the model.
        start, step = (
            select([Value.cast(word).as_unsigned() for word in given[name]], place)
            for name in ("start", "step")
        )
        code = register(Mux(now.is_start, Cat(Const(0, low), start), step[:bits])[:bits], "chosen")
        shift = given.shift
        if p.rotates:
            shift = (shift - shift.any())[: len(shift)]
        shift = register(shift, "shift")
        for k in reversed(range(len(shift))):
            code = Mux(shift[k], code << (1 << k), code)[:bits]
        code = register(code.as_signed(), "shifted")
        part = code >> p.margin_shift
        part = Cat(Mux(turns[2].is_start, 0, part[:low]), part[low:]).as_signed()
        small = register((code - part)[:bits].as_signed(), "small")

        # The exponent follows from the first round, and stands until that of the next span.
        used, exponent = Signal(p.LARGEST_EXPONENT, name="used"), Signal(4, name="exponent")
        with m.If(moves & turns[2].finds):
            found = _used(p, [code])
            m.d.sync += used.eq(Mux(turns[2].first, 0, used) | found)
        with m.If(moves & turns[2].is_start):
            m.d.sync += exponent.eq(_exponent(used))
        code = small
        for k in reversed(range(len(exponent))):
            code = Mux(exponent[k] & ~turns[3].is_start, code << (1 << k), code)[:bits]
        code = register(code.as_signed(), "large")

        # The flags of the next span come behind the last component of this one.
        flip, step_flip = Signal(name="flip"), Signal(name="step_flip")
        with m.If(moves & now.is_start):
            m.d.sync += [flip.eq(given.flip), step_flip.eq(given.flip ^ given.turned)]
        word = _rounded(code, Mux(turns[4].is_start, flip, step_flip), p.STEP_BITS)
        result = Signal(self.o.payload.shape(), name="result", reset_less=True)
        words = [Value.cast(result[name][k]) for name in ("start", "step") for k in range(3)]
        with m.If(moves & ~turns[4].finds):
            m.d.sync += [target.eq(source) for target, source in zip(words, [*words[1:], word], strict=True)]
        with m.If(moves & now.last):
            passed = (name for name in result.shape().members if name not in ("start", "step", "exponent"))
            m.d.sync += [result[name].eq(given[name]) for name in passed]
        payload = Signal.like(result, name="payload")
        m.d.comb += [payload.eq(result), payload.exponent.eq(exponent)]
        m.d.comb += moves.eq(stop_output(m, self.o, turns[4].last, payload))
        return m


def _rounded(code: Value, flip: Value, point: int) -> Value:
    """A code with ``point`` fraction bits, negated where told, and rounded."""
    format = VectorAdapter.FORMAT
    cut = point - format.fraction_bits
    # The 1 that completes the negation is added together with the half step of the rounding.
    turned = (code[:] ^ flip.replicate(len(code))).as_signed() + flip + (1 << (cut - 1))
    return (turned >> cut)[: format.width]


def _exponent(used: Value) -> Value:
    """Places by which a step may be shifted, from its first bits below the sign that are used."""
    places = []
    for size in (8, 4, 2, 1):
        empty = ~used[-size:].any()
        used = Mux(empty, used << size, used)[: VectorAdapter.LARGEST_EXPONENT]
        places.insert(0, empty)
    return Cat(places)


def _smaller(parameters: VectorAdapter, code: Value) -> Value:
    """A code with a margin to 1."""
    return (code - (code >> parameters.margin_shift))[: len(code)].as_signed()


def _used(parameters: VectorAdapter, codes: list[Value]) -> Value:
    """First bits below the sign that a code of a shifted step uses: where it differs from its sign."""
    p, used = parameters, 0
    for code in codes:
        used = used | (code[: p.STEP_BITS] ^ code[-1].replicate(p.STEP_BITS))[-p.LARGEST_EXPONENT :]
    # For other frames a place less, but for none.
    return Cat(1, used[:-2], used[-2:].any()) if p.rotates else used
