"""Words of a narrow stream: gathered into the payloads of a wide stream, and made of them."""

from amaranth.hdl import Const, Module, Mux, Signal, Value

from blysk.golden.bus.stream_width import MISSING

__all__ = ["gather_words", "split_words"]


def gather_words(m: Module, words, payloads) -> None:
    """Gather the words of a stream into payloads, the lowest bytes first, a word in each cycle.

    `gathered` is the bit-accurate model. If a frame ends within a payload, each missing byte is
    `MISSING`. No valid depends on a ready.

    Parameters
    ----------
    m : Module
        Gets the registers: a payload, the place of the next word, ``full``.
    words : AxiStream
        The narrow stream.
    payloads : stream of `given_shape`
        The wide stream.
    """
    width, wide = len(words.tdata), Value.cast(payloads.payload.data)
    count = len(wide) // width
    held, last = Signal(len(wide), name="gathered", reset_less=True), Signal(name="gathered_last")
    full, place = Signal(name="gathered_full"), Signal(range(max(count, 2)), name="gathered_words")
    missing = Const(int.from_bytes(bytes([MISSING]) * (width // 8), "little"), width)
    m.d.comb += [
        words.tready.eq(~full | payloads.ready),
        payloads.valid.eq(full),
        wide.eq(held),
        payloads.payload.last.eq(last),
    ]
    with m.If(payloads.ready):
        m.d.sync += full.eq(0)
    with m.If(words.tvalid & words.tready):
        ends = (place == count - 1) | words.tlast
        m.d.sync += [
            full.eq(ends),
            last.eq(words.tlast),
            place.eq(Mux(ends, 0, place + 1)),
        ]
        for k in range(count):
            part = held[k * width : (k + 1) * width]
            with m.If(place == k):
                m.d.sync += part.eq(words.tdata)
            if k:
                with m.Elif(place == 0):
                    m.d.sync += part.eq(missing)


def split_words(m: Module, payloads, words) -> None:
    """Give the words of payloads, the lowest bytes first, a word in each cycle; `split` is the model.

    The payload waits in its source until its last word is taken. No valid depends on a ready.

    Parameters
    ----------
    m : Module
        Gets a register, the place of the word.
    payloads : stream of `made_shape`
        The wide stream.
    words : AxiStream
        The narrow stream, with two bits of TUSER.
    """
    width, wide = len(words.tdata), Value.cast(payloads.payload.data)
    count, marks = len(wide) // width, payloads.payload
    place, final = Signal(range(max(count, 2)), name="split_words"), Signal(name="split_last")
    m.d.comb += [
        final.eq(place == count - 1),
        words.tvalid.eq(payloads.valid),
        words.tdata.eq(wide.word_select(place, width)),
        words.tkeep.eq(~0),
        words.tlast.eq(marks.last & final),
        words.tuser[0].eq(marks.first & (place == 0)),
        words.tuser[1].eq(marks.end & final),
        payloads.ready.eq(words.tready & final),
    ]
    with m.If(words.tvalid & words.tready):
        m.d.sync += place.eq(Mux(final, 0, place + 1))
