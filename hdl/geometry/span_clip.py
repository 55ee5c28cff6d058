"""Span clip ([T] figure 4.10, screen coordinates): scanlines of triangles cut to the picture."""

from amaranth.hdl import Mux, Signal, unsigned
from amaranth.lib import data

from blysk.golden.geometry.triangles import PIXEL_BITS
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.geometry.edge_walk import rows_shape
from blysk.hdl.geometry.triangles import frame_shape, tag_shape

__all__ = ["SpanClipUnit", "clipped_rows_shape"]


def clipped_rows_shape() -> data.StructLayout:
    """Shape of `ClippedRows.beats`: pixels in the picture, number of pixels cut off, flags, and the tag."""
    words = {name: unsigned(PIXEL_BITS) for name in ("x", "y", "length", "skip")}
    flags = {name: unsigned(1) for name in ("covered", "skips", "carry", "last")}
    return data.StructLayout(words | flags | tag_shape())


class SpanClipUnit(PipelinedUnit):
    """Scanlines cut to the picture. `SpanClip` is the bit-accurate model.

    The latency is 2 cycles (borders, differences) and the initiation interval is 1. The unit has no
    multipliers.

    Parameters
    ----------
    skid : bool
        As in `PipelinedUnit`.

    Members
    -------
    i : :py:`In(stream.Signature(rows_shape()))`
        Scanlines.
    o : :py:`Out(stream.Signature(clipped_rows_shape()))`
        The same scanlines, cut to the picture.
    constants : :py:`In(frame_shape())`
        The frame, constant while scanlines are inside.

    Source: docs/theory/geometry.md#coverage; [T] figure 4.10.
    """

    def __init__(self, skid: bool = True):
        super().__init__(rows_shape(), clipped_rows_shape(), latency=2, constants=frame_shape(), skid=skid)

    def datapath(self, m, operands):
        """First the borders, then the pixels between them."""
        frame, result = self.constants, Signal(self.o.payload.shape(), name="result")
        first, last = operands.begin < frame.left, operands.end > frame.right
        begin = self.register(m, Mux(first, frame.left, operands.begin), "begin")
        end = self.register(m, Mux(last, frame.right, operands.end), "end")
        cut = Mux(
            operands.right,
            Mux(last, operands.end - frame.right, 0),
            Mux(first, frame.left - operands.begin, 0),
        )
        cut = self.register(m, cut[:PIXEL_BITS], "cut")
        # Both columns are also compared with the opposite borders, so a scanline beside the picture has no
        # pixel.
        inside = (operands.y >= frame.top) & (operands.end > frame.left) & (operands.begin < frame.right)
        inside = self.register(m, inside, "inside")
        y = self.register(m, (operands.y - frame.top)[:PIXEL_BITS], "line")
        rest = {name: operands[name] for name in ("carry", "last", *tag_shape())}
        for name, value in rest.items():
            m.d.sync += result[name].eq(self.register(m, value, name))
        pixels, covered = end - begin, inside & (begin < end)
        m.d.sync += [
            result.x.eq(Mux(covered, begin - frame.left, 0)),
            result.y.eq(Mux(covered, y, 0)),
            result.length.eq(Mux(covered, pixels, 0)),
            result.skip.eq(Mux(covered, cut, 0)),
            result.covered.eq(covered),
            result.skips.eq(covered & cut.any()),
        ]
        return result
