"""Proofs of the compact intensity unit: no sum wraps, and each pixel leaves as the sum of its own terms."""

import pytest
from amaranth.hdl import Array, Cat, Mux, Signal, Value

from blysk.golden.lighting.intensity import Intensity
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.lighting.intensity import CompactIntensityUnit

from .prover import Harness
from .rules import answers, follows, stays, taken

pytestmark = pytest.mark.prove


def of_sums(lights):
    """A sum with bits to spare moves beside the unit's; products may be any, constants and terms too."""
    unit = CompactIntensityUnit(Intensity(lights))
    h = Harness(unit)
    total, product, note = (Value.cast(h.register(name)) for name in ("total", "product", "note_1"))
    live, first, channel = note[0], note[1], note[3:5]
    fraction = Intensity.TERM_FORMAT.fraction_bits
    ambient = Array(Value.cast(unit.constants.ambient[min(k, 2)]) << fraction for k in range(4))[channel]
    out_of_range, terms = (
        Signal(len(total) + 4, name="out_of_range"),
        Signal(range(2 * lights + 3), name="terms"),
    )
    with h.m.If(~h.register("held") & live):
        h.m.d.sync += [
            out_of_range.eq(Mux(first, ambient, out_of_range) + product),
            terms.eq(Mux(first, 1, terms + (terms <= 2 * lights))),
        ]
    h.claim(total == out_of_range)
    # What leads there: ambient light and each term have 11 bits before the point.
    h.claim(terms <= 2 * lights)
    h.claim(out_of_range <= (terms + 1) << len(product))
    return h


@pytest.mark.parametrize("lights", [1, 2, 4, 16])
def test_sums_do_not_wrap(prove, lights):
    """Inductive: the sum is the exact one, of ambient light and two terms a light at most."""
    prove(of_sums(lights))


def test_bug_is_found(refute, inject):
    """A bit less, injected in the unit."""
    inject(CompactIntensityUnit, "elaborate", "UQ(11 + self._terms.bit_length(), 23)", "UQ(12, 23)")
    refute(of_sums(1))


@pytest.fixture
def choices(monkeypatch):
    """The product with a term of a half or of none, exact; products of any terms would be cut."""

    def half(term, color):
        format = term.format * color.format
        code = Mux(Value.cast(term)[-1], Value.cast(color) << (Intensity.TERM_FORMAT.fraction_bits - 1), 0)
        return FixedValue(format, code[: format.width])

    monkeypatch.setattr(FixedValue, "__mul__", half)


def of_pixels(channels):
    """Each term is a half or nothing; half of its colour is a bit of its own in the channel."""
    unit = CompactIntensityUnit(Intensity(channels=channels))
    h = Harness(unit)
    terms = [Value.cast(term) for kind in unit.kinds for term in unit.i.payload[kind]]
    colors = [color for kind in unit.kinds for color in unit.constants[kind]]
    for term in terms:
        h.assume(term[:-1] == 0)
    for channel in range(channels):
        h.assume(Value.cast(unit.constants.ambient[channel]) == 0)
        for place, color in enumerate(colors):
            bit = 1 << (place + channel) + 1 + Intensity.COLOR_FORMAT.fraction_bits
            h.assume(Value.cast(color[channel]) == bit)

    def image(came, leaves):
        bits = Cat(Value.cast(term)[-1] for kind in unit.kinds for term in came[kind])
        return Cat(leaves["rgb"[k]] == bits << k for k in range(channels)).all()

    stays(h, unit.o)
    inside = follows(h, unit.i, unit.o, 3 if channels == 3 else 7, image)
    answers(h, inside.any(), taken(unit.o), unit.latency - 1, unit.o.ready)
    answers(h, unit.i.valid, unit.i.ready, unit.initiation_interval, unit.o.ready)
    return h


# One channel: no invariant is found in time.
PIXELS_CLOCKS = {3: None, 1: 16}


@pytest.mark.parametrize("channels", PIXELS_CLOCKS)
def test_pixels(prove, choices, channels):
    """Inductive, but for `PIXELS_CLOCKS`, one light: what waits stays; pixels leave in order, each once, each
    as the sum of its own terms; while the output is ready, one leaves in the cycles of a pixel with every
    term, and one is taken in as many as that has products, and one."""
    prove(of_pixels(channels), PIXELS_CLOCKS[channels])


PIXEL_BUGS = {
    "a pixel is accepted while it is stalled": (
        "_issue",
        "m.Elif(advance & busy)",
        "m.Elif(busy)",
    ),
    "it moves while it is stalled": ("elaborate", "m.If(advance)", "m.If(1)"),
    "a pixel ends with a channel": (
        "_issue",
        "ends_channel & (channel == self.model.channels - 1)",
        "ends_channel",
    ),
    "a term is left out": (
        "_issue",
        "remain = Mux(ends_channel, used, rest)",
        "remain = Mux(ends_channel, used, 0)",
    ),
    "a sum goes on": ("elaborate", "Mux(multiplied.first, ", "Mux(multiplied.first & ~valid, "),
}


@pytest.mark.parametrize("bug", PIXEL_BUGS)
def test_bugs_of_pixels_are_found(refute, inject, choices, bug):
    """Injected in the unit, each refutes the claims on pixels."""
    inject(CompactIntensityUnit, *PIXEL_BUGS[bug])
    refute(of_pixels(3), 24)
