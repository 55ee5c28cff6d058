"""Proofs of fixed-point arithmetic: saturation never wraps, and rounding errs by at most half a step."""

import pytest
from amaranth.hdl import Mux, Shape, Signal, Value

from blysk.golden.number.fixed import SQ, UQ
from blysk.hdl.core.fixed import FixedValue

from .prover import Harness

pytestmark = pytest.mark.prove

# Pairs of formats, from and to. Units use pairs of these kinds: each combination of signs, and equal numbers
# of bits.
PAIRS = [
    (SQ(3, 17), SQ(1, 17)),
    (SQ(4, 34), UQ(1, 34)),
    (SQ(5, 25), UQ(1, 25)),
    (UQ(10, 16), UQ(1, 16)),
    (UQ(13, 0), UQ(8, 0)),
    (UQ(2, 17), SQ(1, 17)),
    (SQ(1, 17), UQ(0, 17)),
]
# The format, and the number of fraction bits that stay.
CUTS = [(SQ(4, 34), 17), (UQ(1, 25), 17), (SQ(2, 20), 0)]


def any_code(source):
    """A register with any code of a format."""
    h = Harness()
    code = Signal(Shape(source.width, source.signed))
    h.m.d.sync += code.eq(h.free(source.width, "given"))
    return h, code


def of_saturation(source, target):
    """Claim that saturation gives what comparisons of the codes give."""
    h, code = any_code(source)
    result = Value.cast(FixedValue(source, code).saturate(target))
    raised = Mux(code < target.min_code, target.min_code, code)
    h.claim(result == Mux(raised > target.max_code, target.max_code, raised))
    return h


def of_rounding(source, bits):
    """Claim that twice the error is more than -1 step and at most 1 step."""
    h, code = any_code(source)
    dropped = source.fraction_bits - bits
    error = (Value.cast(FixedValue(source, code).round_half_up(bits)) << dropped) - code
    h.claim((error << 1 > -(1 << dropped)) & (error << 1 <= 1 << dropped))
    return h


def of_cutting(source, bits):
    """Claim that the error is more than -1 step and at most 0."""
    h, code = any_code(source)
    dropped = source.fraction_bits - bits
    error = (Value.cast(FixedValue(source, code).truncate(bits)) << dropped) - code
    h.claim((error > -(1 << dropped)) & (error <= 0))
    return h


@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_saturation_never_wraps(prove, source, target):
    """For every code, saturation gives the nearest code of the format."""
    prove(of_saturation(source, target))


@pytest.mark.parametrize(("source", "bits"), CUTS)
def test_rounding_errs_by_half_a_step(prove, source, bits):
    """For every code, rounding half up errs by at most half a step."""
    prove(of_rounding(source, bits))


@pytest.mark.parametrize(("source", "bits"), CUTS)
def test_cutting_errs_by_less_than_a_step(prove, source, bits):
    """For every code, truncation never rounds upwards."""
    prove(of_cutting(source, bits))


BUGS = {
    "negatives saturate upwards": (
        (SQ(4, 34), UQ(1, 34)),
        "(~negative).replicate(format.width)",
        "Const(1, 1).replicate(format.width)",
    ),
    "the top bit is forgotten": (
        (UQ(10, 16), UQ(1, 16)),
        "self._code[format.width :]",
        "self._code[format.width : -1]",
    ),
    "the wrong end": (
        (SQ(3, 17), SQ(1, 17)),
        "(~negative).replicate(format.width - 1)",
        "negative.replicate(17)",
    ),
    "it wraps": ((SQ(3, 17), SQ(1, 17)), "Mux(fits, low, end)", "low"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_of_saturation_are_found(refute, inject, bug):
    """Each bug, injected in `FixedValue.saturate`, refutes the claim for a pair of formats."""
    formats, *change = BUGS[bug]
    inject(FixedValue, "saturate", *change)
    refute(of_saturation(*formats), 4)


def test_bug_of_rounding_is_found(refute, inject):
    """A cut in place of rounding half up is found."""
    inject(FixedValue, "round_half_up", "self._code[dropped - 1]", "0")
    refute(of_rounding(SQ(4, 34), 17), 4)


def test_bug_of_cutting_is_found(refute, inject):
    """Rounding towards 0 is found, because negative codes go up."""
    kept = "self._code[self.format.fraction_bits - fraction_bits :]"
    inject(FixedValue, "truncate", kept, f"({kept} + self._code[-1])[: format.width]")
    refute(of_cutting(SQ(4, 34), 17), 4)
