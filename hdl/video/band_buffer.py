"""Band buffer: draws a band of lines while another band is shown, and chooses the next band."""

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.cdc import FFSynchronizer, PulseSynchronizer
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.video.band_buffer import BandBuffer
from blysk.hdl.core.bits import times_constant
from blysk.hdl.core.views import copy_fields
from blysk.hdl.geometry.depth_tester import is_inside
from blysk.hdl.geometry.triangles import count_events, counters_shape
from blysk.hdl.video.display_timing import timing_shape

__all__ = ["BandBufferUnit", "band_pixel_shape", "shown_shape"]


def band_pixel_shape(model: BandBuffer) -> data.StructLayout:
    """Shape of a drawn pixel: column, line inside the band, colour."""
    width, lines = model.mode.horizontal.visible, model.lines
    place = {"x": unsigned((width - 1).bit_length()), "y": unsigned((lines - 1).bit_length())}
    return data.StructLayout(place | {channel: unsigned(8) for channel in "rgb"})


def shown_shape(model: BandBuffer) -> data.StructLayout:
    """Shape of a cycle of the pixel clock: the timing, and the colour."""
    timing = timing_shape(model.mode).members
    return data.StructLayout(dict(timing) | {channel: unsigned(8) for channel in "rgb"})


class BandBufferUnit(wiring.Component):
    """Two bands in a memory with two clocks. `BandBuffer` is the bit-accurate model.

    The domain ``sync`` draws, and the domain ``pixel`` shows. A slot is the time of one band on the display.
    Pixels of a free buffer are written as they come, one in each cycle. With ``done`` the buffer goes to the
    display. The display reads each word, and clears it on the same cycle and port, because the memory reads
    before it writes. After the last line of the band it gives the buffer back. A buffer that came too late is
    given back uncleared, at the beginning of the next slot. The drawing side clears an uncleared buffer, and
    each buffer after a reset. It clears a word in each cycle, while the band is already requested. The
    display's addresses follow from the timing alone. So the display does not depend on the time of drawing. A
    colour leaves a cycle after its timing. The unit has no multipliers.

    Toggles cross between the clocks, each through two flip-flops. Each buffer has two toggles: one tells that
    it is filled, the other tells that it is free. A toggle marks the beginning of a slot, and another marks a
    late band. The numbers of bands and of the slot cross beside the toggles. A bit that tells whether a free
    buffer was shown crosses in the same way. Each of these words is written with its toggle or a cycle
    before. It is read at least two cycles of the reader's clock later. The constraint is that the words'
    paths take less than one period of the reader's clock. A slot lasts longer than a crossing, because its
    lines have 800 pixels each by default.

    Parameters
    ----------
    model : BandBuffer
        Bit-accurate model.

    Members
    -------
    request : :py:`Out(stream.Signature(band))`
        Bands to draw, in the order of the picture. A band whose slot has begun is left out.
    pixels : :py:`In(stream.Signature(band_pixel_shape(model)))`
        Pixels of the last requested band. A pixel outside the band is lost.
    done : :py:`In(stream.Signature(band))`
        Number of the last requested band, when all its pixels have been taken.
    timing : :py:`In(timing_shape(model.mode))`
        Timing of the display, in the domain ``pixel``.
    shown : :py:`Out(shown_shape(model))`
        Domain ``pixel``: the timing a cycle later, and the colour.
    status : :py:`Out(counters_shape("late_bands", "frames"))`
        Number of bands replaced by the background, and number of frames begun, since the reset.

    Source: docs/theory/video.md#bands.
    """

    latency = 1

    def __init__(self, model: BandBuffer | None = None):
        self.model = model or BandBuffer()
        self._band = unsigned((self.model.bands - 1).bit_length())
        super().__init__(
            {
                "request": Out(stream.Signature(self._band)),
                "pixels": In(stream.Signature(band_pixel_shape(self.model))),
                "done": In(stream.Signature(self._band)),
                "timing": In(timing_shape(self.model.mode)),
                "shown": Out(shown_shape(self.model)),
                "status": Out(counters_shape("late_bands", "frames")),
            }
        )

    def elaborate(self, platform):
        """The memory, both its sides, and the signals that cross between the sides."""
        m = Module()
        model, width = self.model, sum(self.model.colour_bits)
        m.submodules.colours = memory = Memory(shape=width, depth=2 * model.pixels, init=[])
        # `sync` writes that a buffer is filled, and its band. `pixel` writes that a buffer is free, whether
        # it was not shown, the slot, and the slot's beginning.
        self._filled, self._bands = Signal(2, name="filled"), [self._number(f"band_{k}") for k in range(2)]
        self._freed, self._slot = Signal(2, name="freed"), self._number("slot", model.bands - 1)
        self._unseen = Signal(2, name="unseen", init=0b11)
        self._begun = Signal(name="begun")
        m.submodules.late = self._late = PulseSynchronizer("pixel", "sync")
        self._draw(m, memory.write_port())
        self._show(m, memory.read_port(domain="pixel"), memory.write_port(domain="pixel"))
        return m

    def _number(self, name: str, init: int = 0) -> Signal:
        return Signal(self._band, name=name, init=init)

    def _plus_one(self, band: Value) -> Value:
        return Mux(band == self.model.bands - 1, 0, band + 1)

    @property
    def _clear(self) -> int:
        """Word of the background. All words are XORed with it, so a memory of zeros is a cleared memory."""
        return sum(
            int(code) << sum(self.model.colour_bits[:k])
            for k, code in enumerate(self.model.kept(self.model.background))
        )

    def _draw(self, m: Module, write) -> None:
        """Clear a free buffer that was not shown, ask for its band, write its pixels, pass it on."""
        model = self.model
        freed, begun = Signal(2, name="freed_seen"), Signal(name="begun_seen")
        m.submodules += [FFSynchronizer(self._freed, freed), FFSynchronizer(self._begun, begun)]
        before, slot = Signal(name="begun_before"), self._number("slot_seen", model.bands - 1)
        m.d.sync += before.eq(begun)
        with m.If(begun != before):
            m.d.sync += slot.eq(self._slot)
        which, last = Signal(name="which"), self._number("last", model.bands - 1)
        busy, asked = Signal(2, name="busy"), Signal(name="asked")
        m.d.comb += busy.eq(self._filled ^ freed)
        address = Signal(range(model.pixels), name="address")

        coming, after_slot = self._plus_one(last), self._plus_one(slot)
        worth = (coming == after_slot) | (coming == self._plus_one(after_slot))
        pixel, size = self.pixels.payload, (model.mode.horizontal.visible, model.lines)
        place = Signal(range(2 * model.pixels), name="place")
        word = Cat(pixel[channel][8 - bits :] for channel, bits in zip("rgb", model.colour_bits, strict=True))
        m.d.comb += self.request.payload.eq(last)
        with m.FSM(name="draw"):
            with m.State("wait"), m.If(~Array(busy)[which]):
                m.d.sync += [last.eq(Mux(worth, coming, after_slot)), address.eq(0), asked.eq(0)]
                m.next = "draw"
                with m.If(Array(self._unseen)[which]):
                    m.next = "clear"
            with m.State("clear"):
                m.d.comb += [place.eq(address), write.en.eq(1), self.request.valid.eq(~asked)]
                m.d.sync += [address.eq(address + 1), asked.eq(asked | self.request.ready)]
                with m.If(address == model.pixels - 1):
                    m.next = "draw"
            with m.State("draw"):
                m.d.comb += [
                    self.request.valid.eq(~asked),
                    self.pixels.ready.eq(1),
                    self.done.ready.eq(1),
                    place.eq(times_constant(pixel.y, model.mode.horizontal.visible) + pixel.x),
                    write.en.eq(self.pixels.valid & is_inside(pixel, size)),
                    write.data.eq(word ^ self._clear),
                ]
                m.d.sync += asked.eq(asked | self.request.ready)
                with m.If(self.done.valid):
                    m.d.sync += which.eq(~which)
                    for k, band in enumerate(self._bands):
                        with m.If(which == k):
                            m.d.sync += [self._filled[k].eq(~self._filled[k]), band.eq(last)]
                    m.next = "wait"
        m.d.comb += write.addr.eq(place + Mux(which, model.pixels, 0))
        first = (begun != before) & (self._slot == 0)
        count_events(m, self.status, late_bands=self._late.o, frames=first)

    def _show(self, m: Module, read, clear) -> None:
        """Choose the buffer of each slot, read and clear it along with the timing, and give it back."""
        model, timing = self.model, self.timing
        line, frame = model.mode.horizontal, model.mode.vertical
        filled = Signal(2, name="filled_seen")
        m.submodules += FFSynchronizer(self._filled, filled, o_domain="pixel")
        full, fits, stays = (Signal(2, name=name) for name in ("full", "fits", "stays"))
        coming = self._number("coming")
        m.d.comb += [full.eq(filled ^ self._freed), coming.eq(self._plus_one(self._slot))]
        for k, band in enumerate(self._bands):
            m.d.comb += [
                fits[k].eq(full[k] & (band == coming)),
                stays[k].eq(band == self._plus_one(coming)),
            ]
        last_line = (timing.y & model.lines - 1 == model.lines - 1) & (timing.y < frame.visible)
        is_shown, which = Signal(name="is_shown"), Signal(name="which_shown")
        place = Signal(range(2 * model.pixels), name="place_shown")
        with m.If(timing.active):
            m.d.pixel += place.eq(place + 1)
        with m.If(last_line & (timing.x == line.visible)):
            shown = Cat(is_shown & ~which, is_shown & which)
            m.d.pixel += [
                is_shown.eq(0),
                self._freed.eq(self._freed ^ shown),
                self._unseen.eq(self._unseen & ~shown),
            ]
        begins = (timing.y == frame.total - 1) | (last_line & (timing.y != frame.visible - 1))
        missed = full & ~fits & ~stays
        with m.If(begins & (timing.x == line.total - 1)):
            m.d.pixel += [
                self._slot.eq(coming),
                self._begun.eq(~self._begun),
                is_shown.eq(fits.any()),
                which.eq(fits[1]),
                place.eq(Mux(fits[1], model.pixels, 0)),
                self._freed.eq(self._freed ^ missed),
                self._unseen.eq(self._unseen | missed),
            ]
            m.d.comb += self._late.i.eq(~fits.any())
        m.d.comb += [read.addr.eq(place), read.en.eq(1)]
        m.d.comb += [clear.addr.eq(place), clear.en.eq(timing.active & is_shown), clear.data.eq(0)]

        later = Signal.like(timing, name="timing_shown")
        coloured = Signal(name="coloured")
        m.d.pixel += [later.eq(timing), coloured.eq(is_shown)]
        m.d.comb += copy_fields(self.shown, later, timing.shape().members)
        word = Mux(coloured, read.data, Const(0, len(read.data))) ^ self._clear
        for channel, bits in zip("rgb", model.colour_bits, strict=True):
            code, word = word[:bits], word[bits:]
            m.d.comb += self.shown[channel].eq(Cat(code[2 * bits - 8 :], code) if bits < 8 else code)
