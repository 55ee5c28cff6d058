"""Edge normals ([T] figure 4.10): unit normals at both ends of every piece of a span."""

from amaranth.hdl import Cat, Module, Signal, Value
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.edge_normals import EdgeNormals
from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.core.views import choose, copy, copy_fields
from blysk.hdl.geometry.span_attributes import pieces_shape, span_words_shape
from blysk.hdl.geometry.triangles import count_events, counters_shape
from blysk.hdl.geometry.vector_normaliser import SharedVectorNormaliserUnit, VectorNormaliserUnit

__all__ = ["EdgeNormalsUnit", "true_spans_shape"]


def true_spans_shape() -> data.StructLayout:
    """Shape of `TrueSpans.beats`: a span with its two unit normals, and N/W at both ends."""
    line = data.ArrayLayout(FixedShape(SPAN_NORMAL), 3)
    normals = {name: normal_shape() for name in ("normal_left", "normal_right")}
    return data.StructLayout(normals | {"line_left": line, "line_right": line} | span_words_shape())


class EdgeNormalsUnit(wiring.Component):
    """Normalises the ends of a piece one after the other. `EdgeNormals` is the bit-accurate model.

    A piece of one pixel takes one cycle. A longer piece takes two cycles, one for each normal. A span of one
    pixel is offered `latency` cycles, 20, after its piece is taken in. A longer span is offered one cycle
    later. The six multipliers are those of `VectorNormaliserUnit`.

    In the *compact* style a normal takes `COMPACT_INTERVAL` cycles and the latency is 32. The three
    multipliers are those of `SharedVectorNormaliserUnit`. The other words of a span stay in a FIFO until the
    span is taken.

    Parameters
    ----------
    model : EdgeNormals
        Bit-accurate model.
    compact : bool
        Whether the unit has the compact style.

    Members
    -------
    i : :py:`In(stream.Signature(pieces_shape()))`
        Pieces of spans.
    o : :py:`Out(stream.Signature(true_spans_shape()))`
        The same pieces, with unit normals.
    status : :py:`Out(counters_shape("repaired"))`
        Number of lost normals that were replaced, since the reset. Each is counted one cycle later.

    Source: docs/theory/geometry.md#normals; [T] figure 4.10 (normals along the edges).
    """

    COMPACT_INTERVAL = 3

    def __init__(self, model: EdgeNormals | None = None, compact: bool = False):
        self.model, self.compact = model or EdgeNormals(), compact
        given = self.model.normaliser
        self._normaliser = (
            SharedVectorNormaliserUnit(given, self.COMPACT_INTERVAL)
            if compact
            else VectorNormaliserUnit(given)
        )
        self.multipliers = self._normaliser.multipliers
        self.latency = self._normaliser.latency + 2
        super().__init__(
            {
                "i": In(stream.Signature(pieces_shape())),
                "o": Out(stream.Signature(true_spans_shape())),
                "status": Out(counters_shape("repaired")),
            }
        )

    def elaborate(self, platform):
        """Send a piece's vectors one after the other, and collect its normals.

        Other words wait in a FIFO.
        """
        m = Module()
        m.submodules.normaliser = normaliser = self._normaliser
        rest_shape = _rest_shape()
        inside = normaliser.latency // normaliser.initiation_interval
        m.submodules.rest = rest = fifo.SyncFIFOBuffered(width=rest_shape.as_shape().width, depth=inside + 4)
        self._send(m, normaliser, rest)
        collect = self._collect_in_place if self.compact else self._collect
        repaired = collect(m, normaliser, data.View(rest_shape, rest.r_data), rest)
        counted = Signal(name="counted")
        m.d.sync += counted.eq(repaired)
        count_events(m, self.status, repaired=counted)
        return m

    def _send(self, m: Module, normaliser, rest) -> None:
        """Send the left vector of the piece in the register.

        If the piece has several pixels, also send the right vector.
        """
        busy, turn, last = Signal(name="busy"), Signal(name="turn"), Signal(name="last_turn")
        piece, moves = Signal(self.i.payload.shape(), name="piece"), Signal(name="moves")
        m.d.comb += [
            last.eq(turn | (piece.length == 1)),
            normaliser.i.valid.eq(busy & (turn | rest.w_rdy)),
            moves.eq(normaliser.i.valid & normaliser.i.ready),
            self.i.ready.eq(~busy if self.compact else ~busy | (moves & last)),
            rest.w_data.eq(
                Cat(*(Value.cast(piece[name]) for name in ("left", "right", *span_words_shape())))
            ),
            normaliser.i.payload.flip.eq(piece.flip),
        ]
        begins = moves & ~turn
        if self.compact:
            # The FIFO is written a cycle late. The piece stays in its register for at least this cycle.
            begun = Signal(name="begun")
            m.d.sync += begun.eq(begins)
            begins = begun
        m.d.comb += rest.w_en.eq(begins)
        for k in range(3):
            chosen = choose(turn, piece.right[k], piece.left[k])
            m.d.comb += copy(normaliser.i.payload.vector[k], chosen)
        with m.If(self.i.ready):
            m.d.sync += [busy.eq(self.i.valid), turn.eq(0), copy(piece, self.i.payload)]
        with m.Elif(moves):
            m.d.sync += turn.eq(1)
            if self.compact:
                m.d.sync += busy.eq(~last)

    def _collect(self, m: Module, normaliser, words, rest) -> Value:
        """Collect normals, and replace lost normals. Returns whether a normal is replaced on this cycle."""
        valid, result = Signal(name="valid"), Signal(self.o.payload.shape(), name="result")
        good = Signal(normal_shape(), name="good", init=_init())
        left = Signal(normal_shape(), name="left_normal")
        turn, last, moves, advance = Signal(), Signal(), Signal(name="takes"), Signal(name="advance")
        lost = normaliser.o.payload.lost
        normal = Signal(normal_shape(), name="normal")
        m.d.comb += [
            advance.eq(skid_buffer(m, self.o, valid, result)),
            last.eq(turn | (words.length == 1)),
            normaliser.o.ready.eq(advance & rest.r_rdy),
            moves.eq(normaliser.o.valid & normaliser.o.ready),
            rest.r_en.eq(moves & last),
            copy(normal, choose(lost, good, normaliser.o.payload.normal)),
        ]
        with m.If(moves):
            m.d.sync += [copy(good, normal), turn.eq(~last)]
            with m.If(~turn):
                m.d.sync += copy(left, normal)
        with m.If(advance):
            m.d.sync += [
                valid.eq(moves & last),
                copy(result.normal_left, choose(turn, left, normal)),
                copy(result.normal_right, normal),
                copy(result.line_left, words.left),
                copy(result.line_right, words.right),
                *copy_fields(result, words, span_words_shape()),
            ]
        return moves & lost

    def _collect_in_place(self, m: Module, normaliser, words, rest) -> Value:
        """Collect without a register for the result. The other words of a span come from the FIFO itself."""
        valid, result = Signal(name="valid"), self.o.payload
        good = Signal(normal_shape(), name="good", init=_init())
        left = Signal(normal_shape(), name="left_normal")
        turn, last, moves = Signal(name="turn"), Signal(name="last_normal"), Signal(name="takes")
        # The FIFO moves on in the cycle after the span is taken.
        gone = Signal(name="gone")
        m.d.sync += gone.eq(self.o.valid & self.o.ready)
        lost = normaliser.o.payload.lost
        normal = Signal(normal_shape(), name="normal")
        m.d.comb += [
            last.eq(turn | (words.length == 1)),
            normaliser.o.ready.eq(~valid & ~gone & rest.r_rdy),
            moves.eq(normaliser.o.valid & normaliser.o.ready),
            rest.r_en.eq(gone),
            copy(normal, choose(lost, good, normaliser.o.payload.normal)),
            self.o.valid.eq(valid),
            *(copy(result.normal_left, left), copy(result.normal_right, good)),
            *(copy(result.line_left, words.left), copy(result.line_right, words.right)),
            *copy_fields(result, words, span_words_shape()),
        ]
        with m.If(moves):
            m.d.sync += [copy(good, normal), turn.eq(~last), valid.eq(last)]
            with m.If(~turn):
                m.d.sync += copy(left, normal)
        with m.Elif(self.o.ready):
            m.d.sync += valid.eq(0)
        return moves & lost


def _rest_shape() -> data.StructLayout:
    line = data.ArrayLayout(FixedShape(SPAN_NORMAL), 3)
    return data.StructLayout({"left": line, "right": line} | span_words_shape())


def _init() -> list:
    return [value * 2.0**-17 for value in EdgeNormals.FIRST]
