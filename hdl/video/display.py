"""Display: from the pixels of bands to pairs of bits on four lanes."""

from amaranth.hdl import Cat, Const, DomainRenamer, Module
from amaranth.lib import data, wiring
from amaranth.lib.wiring import Out

from blysk.golden.video.band_buffer import BandBuffer
from blysk.golden.video.display_timing import DisplayTiming
from blysk.golden.video.serialiser import LANES, Serialiser
from blysk.golden.video.tmds_encoder import BITS, CLOCK_WORD
from blysk.hdl.video.band_buffer import BandBufferUnit
from blysk.hdl.video.display_timing import DisplayTimingUnit
from blysk.hdl.video.serialiser import SerialiserUnit
from blysk.hdl.video.tmds_encoder import TmdsEncoderUnit
from blysk.hdl.video.word_crossing import WordCrossing

__all__ = ["DisplayUnit"]


class DisplayUnit(wiring.Component):
    """Bands, timing, three encoders and the serialiser of four lanes. `Display` is the bit-accurate model.

    There are three clocks: ``sync`` draws, ``pixel`` shows, ``serial`` sends at five times the rate of
    ``pixel``. Lane 0 is blue with both sync signals, lane 1 green, lane 2 red, lane 3 the pixel clock.

    Parameters
    ----------
    model : BandBuffer
        Bit-accurate model, with mode, lines of a band, and colours.

    Members
    -------
    request, pixels, done, status
        As for `BandBufferUnit`.
    pairs : :py:`Out(data.ArrayLayout(2, 4))`
        Domain ``serial``: two bits of each lane, bit 0 first, for `OutputCells`.

    Source: docs/theory/video.md#display.
    """

    def __init__(self, model: BandBuffer | None = None):
        self.model = model or BandBuffer()
        self.bands = BandBufferUnit(self.model)
        members = dict(self.bands.signature.members)
        del members["timing"], members["shown"]
        super().__init__(members | {"pairs": Out(data.ArrayLayout(2, LANES))})

    def elaborate(self, platform):
        """The units in a row."""
        m = Module()
        to_pixel, to_serial = DomainRenamer("pixel"), DomainRenamer("serial")
        bands, timing = self.bands, DisplayTimingUnit(DisplayTiming(self.model.mode))
        m.submodules.bands, m.submodules.timing = bands, to_pixel(timing)
        for name in ("request", "pixels", "done"):
            wiring.connect(m, getattr(bands, name), wiring.flipped(getattr(self, name)))
        m.d.comb += [bands.timing.eq(timing.o), self.status.eq(bands.status)]

        shown = bands.shown
        crossing = WordCrossing(data.ArrayLayout(BITS, LANES))
        serialiser = SerialiserUnit(Serialiser(LANES))
        m.submodules.crossing, m.submodules.serialiser = crossing, to_serial(serialiser)
        controls = (Cat(shown.hsync, shown.vsync), Const(0, 2), Const(0, 2))
        for k, (channel, control) in enumerate(zip("bgr", controls, strict=True)):
            encoder = TmdsEncoderUnit()
            m.submodules[f"encoder_{channel}"] = to_pixel(encoder)
            m.d.comb += [
                encoder.i.payload.data.eq(shown[channel]),
                encoder.i.payload.control.eq(control),
                encoder.i.payload.active.eq(shown.active),
                encoder.i.valid.eq(1),
                encoder.o.ready.eq(1),
                crossing.i[k].eq(encoder.o.payload),
            ]
        m.d.comb += [
            crossing.i[LANES - 1].eq(CLOCK_WORD),
            serialiser.i.payload.eq(crossing.o),
            serialiser.i.valid.eq(crossing.valid),
            serialiser.o.ready.eq(1),
            self.pairs.eq(serialiser.o.payload),
        ]
        return m
