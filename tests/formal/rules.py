"""Claims about streams: a beat that waits does not change, and beats keep their order and number."""

from collections.abc import Callable

from amaranth.hdl import Mux, Signal, Value
from amaranth.lib import stream

from .prover import Harness

__all__ = ["answers", "follows", "never_resumes", "pixels_follow", "stays", "taken"]


def taken(channel: stream.Interface) -> Value:
    """Whether a beat is transferred in this cycle."""
    return channel.valid & channel.ready


def stays(harness: Harness, channel: stream.Interface) -> Signal:
    """Claim that an offered beat does not change until it is taken. The result tells whether a beat waits."""
    waits, payload = Signal(name="waits"), Value.cast(channel.payload).as_unsigned()
    before = Signal(len(payload), name="before")
    harness.m.d.sync += [waits.eq(channel.valid & ~channel.ready), before.eq(payload)]
    harness.claim(~waits | (channel.valid & (payload == before)))
    return waits


def never_resumes(harness: Harness) -> None:
    """Claim that no beat leaves after one beat has waited and another has come. This claim is to be refuted.

    If the claim held for the cycles of a proof, the proof would be empty: in its runs no beat that waited
    could leave, be lost or be dropped.
    """
    unit, waited, came = harness.unit, Signal(name="waited"), Signal(name="came")
    harness.m.d.sync += [
        waited.eq(waited | (unit.o.valid & ~unit.o.ready)),
        came.eq(came | (waited & taken(unit.i))),
    ]
    harness.claim(~(came & taken(unit.o)))


def answers(harness: Harness, due: Value, answer: Value, cycles: int, when: Value) -> None:
    """Claim that an answer that is due is missing in at most some cycles in a row.

    Only cycles with ``when`` count.
    """
    missed = Signal(range(cycles + 2), name="missed")
    harness.m.d.sync += missed.eq(Mux(due & ~answer & when & (missed <= cycles), missed + 1, 0))
    harness.claim(missed <= cycles)


def follows(
    harness: Harness,
    source: stream.Interface,
    sink: stream.Interface,
    capacity: int,
    image: Callable[[Value, Value], Value] | None = None,
) -> Signal:
    """Claim that beats leave in order and once each, that no other beat leaves, and that few are inside.

    A counter holds the number of beats inside. A free input chooses any beat. For this beat the model knows
    how many beats are ahead of it. When these have left, the next beat that leaves must be the image of the
    chosen beat.

    Parameters
    ----------
    harness : Harness
        Harness of the unit.
    source, sink : stream.Interface
        Streams on which beats come and leave. A beat leaves at least one cycle after it came.
    capacity : int
        Largest number of beats inside.
    image : callable
        Takes a payload that came and a payload that leaves, and tells whether the second is the image of the
        first. ``None``: beats are only counted.

    Returns
    -------
    Signal
        Number of beats inside.
    """
    m = harness.m
    inside = Signal(range(capacity + 2), name="inside")
    comes, leaves = taken(source), taken(sink)
    m.d.sync += inside.eq(inside + comes - leaves)
    harness.claim(~leaves | inside.any())
    harness.claim(inside <= capacity)
    if image is not None:
        chosen = harness.free(name="chosen")
        watched, ahead = Signal(name="watched"), Signal.like(inside, name="ahead")
        payload = Signal(len(Value.cast(source.payload)), name="chosen_payload")
        with m.If(~watched), m.If(comes & chosen):
            m.d.sync += [watched.eq(1), ahead.eq(inside - leaves), payload.eq(source.payload)]
        with m.Elif(leaves):
            # After the chosen beat has left, another may be chosen.
            m.d.sync += [ahead.eq(ahead - 1), watched.eq(ahead != 0)]
        of_kind = source.payload.shape()
        came = of_kind(payload) if callable(of_kind) else payload
        harness.claim(~(watched & leaves & (ahead == 0)) | image(came, sink.payload))
        harness.claim(~watched | (ahead < inside))
    return inside


def pixels_follow(
    harness: Harness,
    source: stream.Interface,
    sink: stream.Interface,
    length: Value,
    capacity: int,
    image: Callable[[Value, Value, Value, Value], Value] | None = None,
) -> Signal:
    """Claim that the pixels of spans leave in order.

    It is `follows` for units with an output beat for each pixel.

    Parameters
    ----------
    harness, source, sink
        As for `follows`.
    length : Value
        Number of pixels of the offered span.
    capacity : int
        Largest number of pixels inside.
    image : callable
        Takes a span's payload, a pixel's place in the span from 0, whether it is the last pixel, and the
        pixel's payload. It tells whether the pixel's payload is right. ``None``: pixels are only counted.

    Returns
    -------
    Signal
        Number of pixels that have not left yet.
    """
    m = harness.m
    owed = Signal(range(capacity + (1 << len(length)) + 1), name="owed")
    comes, leaves = taken(source), taken(sink)
    m.d.sync += owed.eq(owed + Mux(comes, length, 0) - leaves)
    harness.claim(~leaves | owed.any())
    harness.claim(owed <= capacity)
    if image is not None:
        chosen = harness.free(name="chosen")
        watched, ahead = Signal(name="watched"), Signal.like(owed, name="ahead")
        place, pixels = Signal(len(length), name="place"), Signal(len(length), name="pixels")
        payload = Signal(len(Value.cast(source.payload)), name="chosen_payload")
        last = place + 1 == pixels
        with m.If(~watched), m.If(comes & chosen):
            m.d.sync += [
                watched.eq(length != 0),
                ahead.eq(owed - leaves),
                place.eq(0),
                pixels.eq(length),
                payload.eq(source.payload),
            ]
        with m.Elif(leaves & ahead.any()):
            m.d.sync += ahead.eq(ahead - 1)
        with m.Elif(leaves):
            m.d.sync += [place.eq(place + 1), watched.eq(~last)]
        of_kind = source.payload.shape()
        came = of_kind(payload) if callable(of_kind) else payload
        harness.claim(~(watched & leaves & ~ahead.any()) | image(came, place, last, sink.payload))
        harness.claim(~watched | ((place < pixels) & (ahead + pixels <= owed + place)))
    return owed
