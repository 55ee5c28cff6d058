"""Proof of the compact intensity unit: the sum of a channel holds every term that there can be."""

import pytest
from amaranth.hdl import Array, Mux, Signal, Value

from golden.intensity import Intensity
from hdl.intensity import IntensityUnit

from .prover import Harness

pytestmark = pytest.mark.prove


def of_sums(lights):
    """A sum with bits to spare moves beside the unit's; products may be any, constants and terms too."""
    unit = IntensityUnit(Intensity(lights), "compact")
    h = Harness(unit)
    total, product, note = (Value.cast(h.register(name)) for name in ("total", "product", "note_1"))
    live, first, channel = note[0], note[1], note[3:5]
    fraction = Intensity.TERM_FORMAT.fraction_bits
    ambient = Array(Value.cast(unit.constants.ambient[min(k, 2)]) << fraction for k in range(4))[channel]
    wide, terms = Signal(len(total) + 4, name="wide"), Signal(range(2 * lights + 3), name="terms")
    with h.m.If(~h.register("held") & live):
        h.m.d.sync += [
            wide.eq(Mux(first, ambient, wide) + product),
            terms.eq(Mux(first, 1, terms + (terms <= 2 * lights))),
        ]
    h.claim(total == wide)
    # What leads there: ambient light and each term have 11 bits before the point.
    h.claim(terms <= 2 * lights)
    h.claim(wide <= (terms + 1) << len(product))
    return h


@pytest.mark.parametrize("lights", [1, 2, 4, 16])
def test_sums_do_not_wrap(prove, lights):
    """Inductive: the sum is the exact one, of ambient light and two terms a light at most."""
    prove(of_sums(lights))


def test_bug_is_found(refute, plant):
    """A bit less, planted in the unit."""
    plant(IntensityUnit, "_compact", "UQ(11 + self._terms.bit_length(), 23)", "UQ(12, 23)")
    refute(of_sums(1))
