"""Crossing of words from the pixel clock to the serial clock, which is five times as fast."""

from amaranth.hdl import Module, Mux, ShapeLike, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

__all__ = ["WordCrossing"]


class WordCrossing(wiring.Component):
    """Brings a word of each ``pixel`` cycle into the domain ``serial``, where every fifth cycle is valid.

    A bit that toggles with each word goes through two flip-flops. Its first edge sets a counter of five
    cycles. If the edges of both clocks lie close together, later edges may come a cycle early or late. They
    do not move the counter. So every word is taken at the same distance from its edge, two or three cycles.
    The constraint is that the words' paths take less than two periods of the serial clock. The words stay for
    five periods.

    Both clocks come from one source, at 1 : 5. The phase does not matter.

    Parameters
    ----------
    shape : ShapeLike
        Shape of a word.

    Members
    -------
    i : :py:`In(shape)`
        Word, in the domain ``pixel``.
    o, valid : :py:`Out(shape)`, :py:`Out(1)`
        Domain ``serial``: the word, and the cycle on which it has to be taken.

    Source: docs/theory/video.md#tmds.
    """

    RATIO = 5

    def __init__(self, shape: ShapeLike):
        super().__init__({"i": In(shape), "o": Out(shape), "valid": Out(1)})

    def elaborate(self, platform):
        """The toggle, its synchroniser, and the counter that it sets."""
        m = Module()
        word, toggle = Signal(self.i.shape(), name="word"), Signal(name="toggle")
        m.d.pixel += [word.eq(self.i), toggle.eq(~toggle)]
        seen, before = Signal(name="seen"), Signal(name="before")
        m.submodules += FFSynchronizer(toggle, seen, o_domain="serial")
        phase = Signal(range(self.RATIO), name="phase")
        m.d.serial += [before.eq(seen), phase.eq(Mux(phase == self.RATIO - 1, 0, phase + 1))]
        aligned = Signal(name="aligned")
        with m.If((seen != before) & (~aligned | (phase == 2) | (phase == 3))):
            m.d.serial += [phase.eq(1), aligned.eq(1)]
        m.d.comb += [self.o.eq(word), self.valid.eq(phase == 0)]
        return m
