"""Serialiser: words of several lanes, two bits of each a cycle."""

from amaranth.hdl import Module, Mux, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.video.serialiser import Serialiser
from blysk.golden.video.tmds_encoder import BITS
from blysk.hdl.core.stream import skid_buffer

__all__ = ["SerialiserUnit"]


class SerialiserUnit(wiring.Component):
    """Sends each word as five pairs of bits. `Serialiser` is the bit-accurate model.

    The unit takes a word every 5 cycles. The first pair leaves a cycle after the word was taken in. The clock
    is the serial clock. The unit has no multipliers.

    Parameters
    ----------
    model : Serialiser
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(data.ArrayLayout(10, lanes)))`
        Words.
    o : :py:`Out(stream.Signature(data.ArrayLayout(2, lanes)))`
        Pairs of bits. Bit 0 is sent first.

    Source: docs/theory/video.md#tmds.
    """

    latency = 1

    def __init__(self, model: Serialiser | None = None):
        self.model = model or Serialiser()
        lanes = self.model.lanes
        super().__init__(
            {
                "i": In(stream.Signature(data.ArrayLayout(unsigned(BITS), lanes))),
                "o": Out(stream.Signature(data.ArrayLayout(unsigned(2), lanes))),
            }
        )

    def elaborate(self, platform):
        """A shift register for each lane, and a bit that marks the last pair."""
        m = Module()
        pairs = self.model.PAIRS
        # One bit for each pair that is left. A word is taken in if the register is empty, or at the last
        # pair.
        left = Signal(pairs, name="left")
        lanes = [Signal(BITS, name=f"lane_{k}", reset_less=True) for k in range(self.model.lanes)]
        payload = Signal(self.o.payload.shape(), name="pair")
        m.d.comb += [payload[k].eq(lane[:2]) for k, lane in enumerate(lanes)]
        advance = skid_buffer(m, self.o, left[0], payload)
        takes = advance & ~left[1]
        m.d.comb += self.i.ready.eq(takes)
        with m.If(advance):
            m.d.sync += left.eq(left >> 1)
            m.d.sync += [lane.eq(lane >> 2) for lane in lanes]
        with m.If(takes):
            m.d.sync += left.eq(Mux(self.i.valid, (1 << pairs) - 1, 0))
            m.d.sync += [lane.eq(self.i.payload[k]) for k, lane in enumerate(lanes)]
        return m
