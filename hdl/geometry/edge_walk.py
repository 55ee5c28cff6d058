"""Edge walk ([T] figure 4.10, rasteriser): the first and the last covered pixel of each scanline, exactly."""

from amaranth.hdl import Const, Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.edge_setup import X_BITS
from blysk.golden.geometry.triangles import GRID, Grid
from blysk.hdl.core.stream import skid_buffer, stop_output
from blysk.hdl.geometry.triangles import frame_shape, tag_shape

__all__ = ["EdgeWalkUnit", "rows_shape", "walk_shape"]


def walk_shape(grid: Grid = GRID) -> data.StructLayout:
    """Shape of the input of the walk: three edges, scanlines, and the tag."""

    def three(shape):
        return data.ArrayLayout(shape, 3)

    return data.StructLayout(
        {
            "x": three(signed(X_BITS)),
            "error": three(unsigned(grid.bits)),
            "step": three(signed(X_BITS)),
            "error_step": three(unsigned(grid.bits)),
            "height": three(unsigned(grid.bits)),
            "first": signed(X_BITS),
            "upper": unsigned(X_BITS),
            "lower": unsigned(X_BITS),
            "flat": unsigned(1),
        }
        | tag_shape()
    )


def rows_shape() -> data.StructLayout:
    """Shape of `Rows.beats`: columns of a scanline, the long edge's carry, and the tag."""
    return data.StructLayout(
        {
            "y": signed(X_BITS),
            "begin": signed(X_BITS),
            "end": signed(X_BITS),
            "carry": unsigned(1),
            "last": unsigned(1),
        }
        | tag_shape()
    )


class EdgeWalkUnit(wiring.Component):
    """Walks two edges side by side, a scanline a cycle. `EdgeWalk` is the bit-accurate model.

    The first scanline of a triangle is offered `latency` cycles, 2, after the triangle is taken in. The
    others follow on the next cycles, unless the output waits. Triangles follow each other without a gap: a
    triangle of n scanlines takes n cycles. Scanlines above the picture are walked, scanlines below it are
    left out. The unit has no multipliers.

    Parameters
    ----------
    grid : Grid
        Fraction bits of the coordinates.
    skid : bool
        Whether the output has a skid buffer. If not, a scanline takes two cycles.

    Members
    -------
    i : :py:`In(stream.Signature(walk_shape(grid)))`
        Edges of triangles.
    o : :py:`Out(stream.Signature(rows_shape()))`
        Scanlines.
    constants : :py:`In(frame_shape())`
        The frame, of which the unit reads ``bottom``. Constant while triangles are inside.

    Source: docs/theory/geometry.md#coverage; [T] figure 4.10.
    """

    latency = 2

    def __init__(self, grid: Grid = GRID, skid: bool = True):
        self.grid, self._skid = grid, skid
        super().__init__(
            {
                "i": In(stream.Signature(walk_shape(grid))),
                "o": Out(stream.Signature(rows_shape())),
                "constants": In(frame_shape()),
            }
        )

    def elaborate(self, platform):
        """Long edge, short edge, the lower edge that waits, counters, and a register for the result."""
        m = Module()
        triangle, advance, load = self.i.payload, Signal(), Signal()
        active, last = Signal(name="active"), Signal(name="last_row", init=1)
        left, seen = (Signal(signed(X_BITS + 1), name=name) for name in ("left", "seen"))
        upper = Signal(X_BITS, name="upper")
        y, valid = Signal(signed(X_BITS), name="y"), Signal(name="valid")
        tag = Signal(data.StructLayout(tag_shape()), name="tag")
        row = Signal(self.o.payload.shape(), name="row")
        m.d.comb += [
            advance.eq(
                skid_buffer(m, self.o, valid, row) if self._skid else stop_output(m, self.o, active, row)
            ),
            self.i.ready.eq(advance & last),
            # An invalid input makes no scanline active.
            load.eq(self.i.ready),
        ]

        low_is_next = Signal(name="low_is_next")
        lower = self._edge(m, "lower", load, [(Const(1), 2)], None)
        long = self._edge(m, "long", last, [(Const(1), 0)], advance)
        flat = triangle.flat
        short = self._edge(m, "short", last, [(flat, 2), (~flat, 1)], advance, low_is_next, lower)

        # Scanlines left in the triangle, and left in the picture. The walk ends with the smaller number.
        total = (triangle.upper + triangle.lower - 2).as_signed()
        inside = self.constants.bottom - triangle.first - 2
        with m.If(advance):
            m.d.sync += valid.eq(active)
            with m.If(last):
                m.d.sync += [active.eq(self.i.valid), left.eq(total), seen.eq(inside)]
                m.d.sync += last.eq(~self.i.valid | total[-1] | inside[-1])
                m.d.sync += [upper.eq(triangle.upper - 1), low_is_next.eq(triangle.upper == 1)]
                m.d.sync += [y.eq(triangle.first), *(tag[name].eq(triangle[name]) for name in tag_shape())]
            with m.Else():
                m.d.sync += [left.eq(left - 1), seen.eq(seen - 1), y.eq(y + 1)]
                m.d.sync += last.eq((left - 1)[-1] | (seen - 1)[-1])
                m.d.sync += [upper.eq(upper - 1), low_is_next.eq(upper == 1)]
            m.d.sync += [
                row.y.eq(y),
                row.begin.eq(Mux(tag.right, short.x, long.x)),
                row.end.eq(Mux(tag.right, long.x, short.x)),
                row.carry.eq(long.carry),
                row.last.eq(last),
                *(row[name].eq(tag[name]) for name in tag_shape()),
            ]
        return m

    def _edge(self, m: Module, name: str, last, sources, advance, turns=None, lower=None):
        """Registers of an edge. They are loaded while ``last`` is high, and else stepped with ``advance``.

        ``sources`` are conditions, each with the index of the edge to load. On ``turns`` the registers take
        the words of the edge ``lower``. An edge without ``advance`` is loaded, and not stepped.
        """
        triangle, bits = self.i.payload, self.grid.bits
        edge = _Edge(name, bits)
        # Both sums are computed, so the remainder is compared before it is reduced.
        more = edge.error + edge.error_step
        less = (edge.error - edge.lack).as_signed()
        m.d.comb += edge.carry.eq(less >= 0)

        def loads():
            for when, k in sources:
                with m.If(when):
                    m.d.sync += [
                        edge.x.eq(triangle.x[k]),
                        edge.error.eq(triangle.error[k]),
                        edge.step.eq(triangle.step[k]),
                        edge.error_step.eq(triangle.error_step[k]),
                        edge.lack.eq(triangle.height[k] - triangle.error_step[k]),
                    ]

        if advance is None:
            with m.If(last):
                loads()
            return edge

        def walk():
            m.d.sync += [
                edge.x.eq(Mux(edge.carry, edge.x + edge.step + 1, edge.x + edge.step)),
                edge.error.eq(Mux(edge.carry, less, more)),
            ]

        with m.If(advance):
            with m.If(last):
                loads()
            if turns is not None:
                with m.Elif(turns):
                    m.d.sync += [
                        word.eq(of_lower) for word, of_lower in zip(edge.words, lower.words, strict=True)
                    ]
            with m.Else():
                walk()
        return edge


class _Edge:
    """Registers of an edge. ``lack`` is the height minus the step of the error."""

    def __init__(self, name: str, bits: int):
        self.x, self.step = (Signal(signed(X_BITS), name=f"{name}_{word}") for word in ("x", "step"))
        self.error, self.error_step, self.lack = (
            Signal(bits, name=f"{name}_{word}") for word in ("error", "error_step", "lack")
        )
        self.carry = Signal(name=f"{name}_carry")

    @property
    def words(self) -> tuple[Signal, ...]:
        """Registers with the words of the edge, without the carry."""
        return self.x, self.step, self.error, self.error_step, self.lack
