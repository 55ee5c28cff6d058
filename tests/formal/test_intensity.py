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
    """A sum with spare bits moves beside the sum of the unit.

    Products, constants and terms may have any value.
    """
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
    # Bounds that make the proof inductive: ambient light and each term have 11 bits before the point.
    h.claim(terms <= 2 * lights)
    h.claim(out_of_range <= (terms + 1) << len(product))
    return h


@pytest.mark.parametrize("lights", [1, 2, 4, 16])
def test_sums_do_not_wrap(prove, lights):
    """By induction: the sum is the exact sum of ambient light and at most two terms a light."""
    prove(of_sums(lights))


def test_bug_is_found(refute, inject):
    """A sum with a bit less, injected in the unit, is found."""
    inject(CompactIntensityUnit, "elaborate", "UQ(11 + self._terms.bit_length(), 23)", "UQ(12, 23)")
    refute(of_sums(1))


@pytest.fixture
def choices(monkeypatch):
    """Exact product with a term of 1/2 or 0. Products of other terms would be cut."""

    def half(term, color):
        format = term.format * color.format
        code = Mux(Value.cast(term)[-1], Value.cast(color) << (Intensity.TERM_FORMAT.fraction_bits - 1), 0)
        return FixedValue(format, code[: format.width])

    monkeypatch.setattr(FixedValue, "__mul__", half)


def of_pixels(channels):
    """Claims on pixels. Each term is 1/2 or 0, and half of its colour is a separate bit of the channel."""
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


# Only one channel, because otherwise no invariant is found in time.
PIXELS_CLOCKS = {3: None, 1: 16}


@pytest.mark.parametrize("channels", PIXELS_CLOCKS)
def test_pixels(prove, choices, channels):
    """By induction (`PIXELS_CLOCKS` cycles for one light): pixels leave in order and once each, as sums of
    their terms.

    A pixel that waits does not change. While the output is ready, a pixel leaves within the cycles of a pixel
    with every term. A pixel is taken within one cycle more than its number of products.
    """
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
    """Each bug, injected in the unit, refutes a claim on pixels."""
    inject(CompactIntensityUnit, *PIXEL_BUGS[bug])
    refute(of_pixels(3), 24)
