"""The vector adapter: N/W at the first pixel of a span and its step, for methods that take vectors."""

from amaranth.hdl import Cat, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.hdl.albedo.attribute_spans import span_attributes_shape
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.geometry.span_halver import halved_spans_shape
from blysk.hdl.geometry.surface_words import placement_of, surface_exponent, surface_step, used_step

__all__ = ["VectorAdapterUnit", "exponent_of", "rounded", "shift_of", "used_bits", "vector_spans_shape"]


def vector_spans_shape(surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of a span: its first vector, step and exponent, first pixel, length, depth and material.

    With ``surface`` there are also its ``attributes``, of `span_attributes_shape`.
    """
    vector = data.ArrayLayout(FixedShape(VectorAdapter.FORMAT), 3)
    exponent = unsigned(VectorAdapter.LARGEST_EXPONENT.bit_length())
    given = halved_spans_shape().members
    words = {name: given[name] for name in ("x", "y", "length", "depth", "depth_step", "material")}
    if surface is not None:
        words["attributes"] = span_attributes_shape(surface)
    return data.StructLayout({"start": vector, "step": vector, "exponent": exponent} | words)


class VectorAdapterUnit(PipelinedUnit):
    """Vectors and steps for a method that takes them. `VectorAdapter` is the bit-accurate model.

    The latency is 4 cycles: the shared shift; the margin to 1 with the bits that the step uses; the step's
    own shift; sign and rounding. The initiation interval is 1. The unit has no multipliers.

    Parameters
    ----------
    model : VectorAdapter
        Bit-accurate model.
    surface : AttributeSpans or None
        Attributes of the surface that triangles bring.

    Members
    -------
    i : :py:`In(stream.Signature(halved_spans_shape(surface)))`
        Pieces of `SpanHalverUnit`.
    o : :py:`Out(stream.Signature(vector_spans_shape(surface)))`
        The same pieces, with words of `SpanVectors`, and of `SurfaceWords`.

    Source: docs/theory/geometry.md#composition; not in the documents.
    """

    def __init__(self, model: VectorAdapter | None = None, surface: AttributeSpans | None = None):
        self.model, self._surface = model or VectorAdapter(), surface
        super().__init__(halved_spans_shape(surface), vector_spans_shape(surface), latency=4)

    def datapath(self, m, operands):
        """Four stages: shared shift; margin and the step's used bits; the step's shift; sign and rounding."""
        p, bits = self.model, SPAN_NORMAL.fraction_bits
        start, step = (
            [Value.cast(operands[name][k]).as_signed() for k in range(3)] for name in ("start", "step")
        )
        made = "start", "step", "exponent", "attributes"
        names = [name for name in self.o.payload.shape().members if name not in made]
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
        if self._surface is not None:
            self._surface_words(m, operands, result.attributes)
        return result

    def _surface_words(self, m, operands, result) -> None:
        """Used bits of the surface's steps; their shift; registers up to the latency."""
        starts, steps = operands.surface_start, operands.surface_step
        words = {name: Value.cast(operands[name]) for name in placement_of(self._surface)}
        words |= {f"surface_{k}": start for k, start in enumerate(starts)}
        for age in range(1, self.latency + 1):
            words = {name: self.register(m, word, f"{name}_{age}") for name, word in words.items()}
        used = 0
        for step in steps:
            used = used | used_step(step)
        used = self.register(m, used, "surface_used")
        exponent = surface_exponent(used)
        steps = [self.register(m, step, f"surface_step_{k}") for k, step in enumerate(steps)]
        steps = [surface_step(step, exponent) for step in steps]
        for age in range(2, self.latency + 1):
            steps = [self.register(m, step, f"surface_step_{k}_{age}") for k, step in enumerate(steps)]
            exponent = self.register(m, exponent, f"surface_exponent_{age}")
        lines = [words.pop(f"surface_{k}") for k in range(len(starts))]
        m.d.comb += [
            Value.cast(result.start).eq(Cat(lines)),
            Value.cast(result.step).eq(Cat(steps)),
            result.exponent.eq(exponent),
            *(Value.cast(result[name]).eq(word) for name, word in words.items()),
        ]


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
