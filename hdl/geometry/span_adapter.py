"""The span adapter: the part of geometry's spans that the shading pipeline reads."""

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import data

from blysk.golden.geometry.span_adapter import LineAdapter
from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.geometry.span_attributes import pieces_shape, span_words_shape

__all__ = ["LineAdapterUnit", "connect_shading_span", "line_spans_shape"]


def line_spans_shape() -> data.StructLayout:
    """Shape of a span: the ends of its true line, ``SQ(1, 22)``, and `span_words_shape` without ``flip``."""
    end = data.ArrayLayout(FixedShape(LineAdapter.FORMAT), 3)
    words = {name: shape for name, shape in span_words_shape().items() if name != "flip"}
    return data.StructLayout({"normal_left": end, "normal_right": end} | words)


class LineAdapterUnit(PipelinedUnit):
    """Ends of true lines for a method that takes them. `LineAdapter` is the bit-accurate model.

    The latency is 3 cycles (the used bits; the shift; sign and rounding), the initiation interval 1. The unit
    has no multipliers.

    Members
    -------
    i : :py:`In(stream.Signature(pieces_shape()))`
        Spans of `SpanAttributesUnit`.
    o : :py:`Out(stream.Signature(line_spans_shape()))`
        The same spans, with ends in ``SQ(1, 22)``.

    Source: docs/theory/geometry.md#composition; not in the documents.
    """

    def __init__(self):
        super().__init__(pieces_shape(), line_spans_shape(), latency=3)

    def datapath(self, m, operands):
        """Three stages: used bits of the components, shared shift, sign and rounding."""
        p, bits = LineAdapter(), SPAN_NORMAL.fraction_bits
        codes = [Value.cast(operands[side][k]).as_signed() for side in ("left", "right") for k in range(3)]
        names = [name for name in self.o.payload.shape().members if not name.startswith("normal")]
        words = {name: Value.cast(operands[name]) for name in names}
        for age in range(1, 4):
            words = {name: self.register(m, word, f"{name}_{age}") for name, word in words.items()}
        used = 0
        for code in codes:
            used = used | (code[:bits] ^ code[-1].replicate(bits))
        used = self.register(m, used, "used")
        codes = [self.register(m, code, f"vector_{k}") for k, code in enumerate(codes)]
        flip = self.register(m, operands.flip, "flip_1")
        for step in (4, 2, 1):
            empty = ~used[-step:].any()
            used = Mux(empty, used << step, used)[:bits]
            codes = [Mux(empty, code << step, code)[: bits + 1].as_signed() for code in codes]
        codes = [self.register(m, code, f"shifted_{k}") for k, code in enumerate(codes)]
        flip = self.register(m, flip, "flip_2")
        result = Signal(self.o.payload.shape(), name="result")
        m.d.comb += [Value.cast(result[name]).eq(word) for name, word in words.items()]
        cut, most = bits - p.FORMAT.fraction_bits, p.FORMAT.max_code
        for k, code in enumerate(codes):
            # The 1 that completes the negation is added together with the half step of the rounding.
            turned = (code[:] ^ flip.replicate(bits + 1)).as_signed() + flip + (1 << (cut - 1))
            rounded = turned >> cut
            clipped = Mux(rounded > most, most, Mux(rounded < -most, -most, rounded))
            end = result.normal_left if k < 3 else result.normal_right
            word = self.register(m, clipped[: p.FORMAT.width], f"end_{k}")
            m.d.comb += Value.cast(end[k % 3]).eq(word)
        return result


def connect_shading_span(m: Module, span: data.View, shaded: data.View) -> None:
    """Wire a span of geometry to a span of the shading pipeline, as `shading_spans` does.

    Coordinates and lengths are cut to the pipeline's widths, which hold them in any of its pictures. A
    material without a code in the pipeline gets the largest code.

    Parameters
    ----------
    m : Module
        Module that gets the wires.
    span : View
        Span in `true_spans_shape`, `line_spans_shape` or `vector_spans_shape`.
    shaded : View
        Span in `blysk.hdl.pipeline.span_shape`.

    Raises
    ------
    TypeError
        If a normal or a vector has different formats in the two spans.
    """
    given = span.shape().members
    for name, shape in shaded.shape().members.items():
        if name.startswith(("normal", "start", "step")) and shape != given[name]:
            raise TypeError(f"{name} is {given[name]!r} on one side, {shape!r} on the other")
        code, width = Value.cast(span[name]), len(Value.cast(shaded[name]))
        if name == "material":
            code = code | code[width:].any().replicate(width)
        m.d.comb += Value.cast(shaded[name]).eq(code)
