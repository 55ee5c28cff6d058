"""The vector adapter: N/W at the first pixel of a span and its step, for methods that take vectors."""

from amaranth.hdl import Cat, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import PipelinedUnit
from blysk.hdl.geometry.span_attributes import pieces_shape, span_words_shape

__all__ = ["VectorAdapterUnit", "vector_spans_shape"]


def vector_spans_shape() -> data.StructLayout:
    """Shape of a span: its first vector, step and exponent, and `span_words_shape` without ``flip``."""
    vector = data.ArrayLayout(FixedShape(VectorAdapter.FORMAT), 3)
    exponent = unsigned(VectorAdapter.LARGEST_EXPONENT.bit_length())
    words = {name: shape for name, shape in span_words_shape().items() if name != "flip"}
    return data.StructLayout({"start": vector, "step": vector, "exponent": exponent} | words)


class VectorAdapterUnit(PipelinedUnit):
    """Vectors and steps for a method that takes them: `VectorAdapter` is the bit-accurate model.

    The latency is 5 cycles (the bits that are used; the shift of all; the margin to 1, and the bits that the
    step uses; its own shift; sign and rounding), the initiation interval 1. No multipliers.

    Members
    -------
    i : :py:`In(stream.Signature(pieces_shape(steps=True)))`
        Spans of `SpanAttributesUnit` with ``steps``.
    o : :py:`Out(stream.Signature(vector_spans_shape()))`
        The same with words of `SpanVectors`.

    Source: docs/theory/geometry.md#composition; not in the documents.
    """

    def __init__(self):
        super().__init__(pieces_shape(steps=True), vector_spans_shape(), latency=5)

    def datapath(self, m, operands):
        """Shared bits, shared shift; margin; the step's bits and shift; sign, rounding."""
        p, bits = VectorAdapter(), SPAN_NORMAL.fraction_bits
        left, right, step = (
            [Value.cast(operands[name][k]).as_signed() for k in range(3)]
            for name in ("left", "right", "step")
        )
        names = [name for name in self.o.payload.shape().members if name not in ("start", "step", "exponent")]
        words = {name: Value.cast(operands[name]) for name in [*names, "flip"]}
        for age in range(1, self.latency):
            words = {name: self.register(m, word, f"{name}_{age}") for name, word in words.items()}
        flip = words.pop("flip")
        words = {name: self.register(m, word, f"{name}_{self.latency}") for name, word in words.items()}

        used = self.register(m, _used([*left, *right], bits), "used")
        start = [self.register(m, code, f"vector_{k}") for k, code in enumerate(left)]
        step = [self.register(m, code[: p.STEP_BITS + 1], f"gradient_{k}") for k, code in enumerate(step)]
        for places in (4, 2, 1):
            empty = ~used[-places:].any()
            used = Mux(empty, used << places, used)[:bits]
            start = [Mux(empty, code << places, code)[: bits + 1].as_signed() for code in start]
            step = [Mux(empty, code << places, code)[: p.STEP_BITS + 1].as_signed() for code in step]
        start = [self.register(m, code, f"shifted_{k}") for k, code in enumerate(start)]
        step = [self.register(m, code, f"shifted_step_{k}") for k, code in enumerate(step)]

        # So many places at most: lower bits do not count.
        used = self.register(m, _used(step, p.STEP_BITS)[-p.LARGEST_EXPONENT :], "step_used")
        step = [self.register(m, self._smaller(code), f"small_step_{k}") for k, code in enumerate(step)]
        start = [self.register(m, self._smaller(code), f"small_{k}") for k, code in enumerate(start)]
        exponent = []
        for places in (8, 4, 2, 1):
            empty = ~used[-places:].any()
            used = Mux(empty, used << places, used)[: p.LARGEST_EXPONENT]
            step = [Mux(empty, code << places, code)[: p.STEP_BITS + 1].as_signed() for code in step]
            exponent.insert(0, empty)
        step = [self.register(m, code, f"large_step_{k}") for k, code in enumerate(step)]
        exponent = self.register(m, Cat(exponent), "exponent_4")
        start = [self.register(m, code, f"vector_{k}_4") for k, code in enumerate(start)]

        result = Signal(self.o.payload.shape(), name="result")
        m.d.comb += [Value.cast(result[name]).eq(word) for name, word in words.items()]
        m.d.comb += result.exponent.eq(self.register(m, exponent, "exponent"))
        for name, codes, point in (("start", start, bits), ("step", step, p.STEP_BITS)):
            for k, code in enumerate(codes):
                word = self.register(m, self._rounded(code, flip, point), f"{name}_{k}")
                m.d.comb += Value.cast(result[name][k]).eq(word)
        return result

    @staticmethod
    def _rounded(code: Value, flip: Value, point: int) -> Value:
        """A code with ``point`` fraction bits, negated where told, and rounded."""
        format = VectorAdapter.FORMAT
        cut = point - format.fraction_bits
        # The 1 that completes the negation is added together with the half step of the rounding.
        turned = (code[:] ^ flip.replicate(len(code))).as_signed() + flip + (1 << (cut - 1))
        return (turned >> cut)[: format.width]

    @staticmethod
    def _smaller(code: Value) -> Value:
        """A code with a margin to 1."""
        return (code - (code >> VectorAdapter.MARGIN_SHIFT))[: len(code)].as_signed()


def _used(codes: list[Value], bits: int) -> Value:
    """Bits below the sign that one of the codes uses: where it differs from its sign."""
    used = 0
    for code in codes:
        used = used | (code[:bits] ^ code[-1].replicate(bits))
    return used
