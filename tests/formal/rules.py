"""What is claimed of streams: what waits stays, and nothing is lost, invented, out of order or stuck."""

from collections.abc import Callable

from amaranth.hdl import Mux, Signal, Value
from amaranth.lib import stream

from .prover import Harness

__all__ = ["answers", "follows", "never_resumes", "pixels_follow", "stays", "taken"]


def taken(channel: stream.Interface) -> Value:
    """Whether a beat goes over on this cycle."""
    return channel.valid & channel.ready


def stays(harness: Harness, channel: stream.Interface) -> Signal:
    """Claim that a beat once offered stays as it is until it is taken; the result: whether one waits."""
    waits, payload = Signal(name="waits"), Value.cast(channel.payload).as_unsigned()
    before = Signal(len(payload), name="before")
    harness.m.d.sync += [waits.eq(channel.valid & ~channel.ready), before.eq(payload)]
    harness.claim(~waits | (channel.valid & (payload == before)))
    return waits


def never_resumes(harness: Harness) -> None:
    """Claim that of the harness's unit no beat leaves once one has waited and another come: to be refuted.

    If that holds for so many cycles, a proof of so many has seen no beat lost, or dropped, that waited.
    """
    unit, waited, came = harness.unit, Signal(name="waited"), Signal(name="came")
    harness.m.d.sync += [
        waited.eq(waited | (unit.o.valid & ~unit.o.ready)),
        came.eq(came | (waited & taken(unit.i))),
    ]
    harness.claim(~(came & taken(unit.o)))


def answers(harness: Harness, due: Value, answer: Value, cycles: int, when: Value) -> None:
    """Claim that what is due fails to come on at most so many cycles in a row, all of them ``when``."""
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
    """Claim that beats leave in order, each once, none that has not come, and at most so many are inside.

    A counter holds how many are inside. Of any one beat, which a free input chooses, the model knows how many
    are ahead; when these have left, the next that leaves must be its image.

    Parameters
    ----------
    harness : Harness
        Of the unit.
    source, sink : stream.Interface
        Where beats come and leave, a cycle later at the earliest.
    capacity : int
        Beats inside at most.
    image : callable
        Whether a payload that leaves is the image of one that came. ``None``: they are only counted.

    Returns
    -------
    Signal
        How many are inside.
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
            # Once it has left, another may be chosen.
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
    """Claim that spans leave as their pixels, in order: `follows` for units with a beat for each pixel.

    Parameters
    ----------
    harness, source, sink
        As for `follows`.
    length : Value
        Pixels of the span that is offered.
    capacity : int
        Pixels inside at most.
    image : callable
        Of a span's payload, a pixel's place in it from 0, whether it is the last, and its payload: whether
        that is right. ``None``: they are only counted.

    Returns
    -------
    Signal
        How many pixels are still to leave.
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
