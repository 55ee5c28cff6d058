"""The vector adapter: N/W at the first pixel of a span and its step, for methods that take vectors."""

from amaranth.hdl import Cat, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.geometry.span_halver import halved_spans_shape

__all__ = ["VectorAdapterUnit", "exponent_of", "rounded", "shift_of", "used_bits", "vector_spans_shape"]


def vector_spans_shape(components: int = 3) -> data.StructLayout:
    """Shape of a span: its first vector, step and exponent, first pixel, length, depth and material."""
    vector = data.ArrayLayout(FixedShape(VectorAdapter.FORMAT), components)
    exponent = unsigned(VectorAdapter.LARGEST_EXPONENT.bit_length())
    given = halved_spans_shape().members
    words = {name: given[name] for name in ("x", "y", "length", "depth", "depth_step", "material")}
    return data.StructLayout({"start": vector, "step": vector, "exponent": exponent} | words)


class VectorAdapterUnit(PipelinedUnit):
    """Vectors and steps for a method that takes them. `VectorAdapter` is the bit-accurate model.

    The latency is 4 cycles: the shared shift; the margin to 1 with the bits that the step uses; the step's
    own shift; sign and rounding. The initiation interval is 1. The unit has no multipliers.

    Parameters
    ----------
    model : VectorAdapter
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(halved_spans_shape()))`
        Pieces of `SpanHalverUnit`.
    o : :py:`Out(stream.Signature(vector_spans_shape()))`
        The same pieces, with words of `SpanVectors`.

    Source: docs/theory/geometry.md#composition; not in the documents.
    """

    def __init__(self, model: VectorAdapter | None = None):
        self.model = model or VectorAdapter()
        super().__init__(halved_spans_shape(), vector_spans_shape(), latency=4)

    def datapath(self, m, operands):
        """Shared shift; margin; the step's bits and shift; sign, rounding."""
        p, bits = self.model, SPAN_NORMAL.fraction_bits
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

        # The step is kept modulo 2, see the model.
        step = [code[: p.STEP_BITS + 1] for code in step]
        shift = shift_of(p, operands.shift)
        for k in reversed(range(len(shift))):
            chosen, places = shift[k], 1 << k
            start = [Mux(chosen, code << places, code)[: bits + 1].as_signed() for code in start]
            step = [Mux(chosen, code << places, code)[: p.STEP_BITS + 1].as_signed() for code in step]
        start = [self.register(m, code, f"shifted_{k}") for k, code in enumerate(start)]
        step = [self.register(m, code, f"shifted_step_{k}") for k, code in enumerate(step)]

        # A step is shifted by at most `LARGEST_EXPONENT` places, so lower bits do not count.
        used = self.register(m, used_bits(p, step), "step_used")
        step = [self.register(m, _smaller(p, code), f"small_step_{k}") for k, code in enumerate(step)]
        start = [self.register(m, _smaller(p, code), f"small_{k}") for k, code in enumerate(start)]
        exponent = exponent_of(used)
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
                word = self.register(m, rounded(code, flip, point), f"{name}_{k}")
                m.d.comb += Value.cast(result[name][k]).eq(word)
        return result


def rounded(code: Value, flip: Value, point: int) -> Value:
    """A code with ``point`` fraction bits, negated by ``flip``, and rounded to `VectorAdapter.FORMAT`."""
    format = VectorAdapter.FORMAT
    cut = point - format.fraction_bits
    kept, half, rest = code[cut:], code[cut - 1], code[: cut - 1].any()
    # The negative of a code is its inverted bits plus 1. The 1 reaches the kept bits unless more than half a
    # step is cut.
    return ((kept ^ flip.replicate(len(kept))) + Mux(flip, ~(half & rest), half))[: format.width]


def exponent_of(used: Value) -> Value:
    """Places by which a step may be shifted, from its used bits below the sign."""
    places = []
    for size in (8, 4, 2, 1):
        empty = ~used[-size:].any()
        used = Mux(empty, used << size, used)[: VectorAdapter.LARGEST_EXPONENT]
        places.insert(0, empty)
    return Cat(places)


def _smaller(model: VectorAdapter, code: Value) -> Value:
    """A code made smaller, so that it has a margin to 1."""
    return (code - (code >> model.margin_shift))[: len(code)].as_signed()


def shift_of(model: VectorAdapter, shift: Value) -> Value:
    """Places by which a vector is shifted: one less if the vector will turn, so its length stays under 1."""
    return (shift - shift.any())[: len(shift)] if model.rotates else shift


def used_bits(model: VectorAdapter, codes: list[Value]) -> Value:
    """First bits below the sign of a shifted step that a code uses: bits that differ from the sign."""
    p, used = model, 0
    for code in codes:
        used = used | (code[: p.STEP_BITS] ^ code[-1].replicate(p.STEP_BITS))[-p.LARGEST_EXPONENT :]
    # If vectors turn into other frames, a step is shifted by one place less, and at least by 0 places.
    return Cat(1, used[:-2], used[-2:].any()) if p.rotates else used
