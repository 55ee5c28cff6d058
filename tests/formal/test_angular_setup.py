"""Proof that no word of the angular setup wraps, except angles. Angles count turns and have to wrap."""

from fnmatch import fnmatchcase

import numpy as np
import pytest
from amaranth.hdl import Mux, Signal, signed

import blysk.hdl.cosines.angular_setup
from blysk.bench.units.operands import pairs_at
from blysk.golden.cosines.angular_setup import SPAN_ANGLES, AngularSetup
from blysk.golden.cosines.arccos import Arccos
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.reciprocal import reciprocal_address
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.half_chord import HalfChordUnit
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit

from .bounds import Bounds, cut_by, registers_of, unknown, word, wrapped_by
from .prover import Harness

pytestmark = [pytest.mark.prove, pytest.mark.seldom]

LONGEST = 1.01 * ONE
"""Largest length of vectors, in codes. Unit vectors are longer than `ONE` by less than 0.001 %."""

WIDEST = 2 * LONGEST**2
"""Largest w: the squared distance of N_l to N_r or to -N_r, whichever is nearer."""

TURNS = (AngularSetup.DIRECTION_FORMAT, AngularSetup.PHASE_FORMAT)


@pytest.fixture(autouse=True)
def but_turns(wraps, monkeypatch):
    """Formats as of `wraps`, where formats of angles may wrap."""
    checked = Format.wrap

    def wrap(format, codes):
        if format not in TURNS:
            return checked(format, codes)
        wraps.append(format)
        return word(format, *codes.shape).codes

    monkeypatch.setattr(Format, "wrap", wrap)
    return wraps


def pieces(codes):
    return np.array_split(codes, len(codes) // (1 << 18) + 1)


def largest_major(chord):
    """Bound of the operand with the other square, from w, which is one of the two squares.

    ``|N_l + N_r|^2 + |N_l - N_r|^2`` is exactly twice the sum of both squared lengths.
    """
    return np.sqrt(np.maximum(2 * WIDEST - chord, 0)) * LONGEST


def largest_minor(chord):
    """Bound of the other operand. It is a product of H and the vector whose square is w."""
    return np.sqrt(chord) * LONGEST


def of_major():
    """Check every word of w that addresses the table, with the smallest w of that word."""
    unit = AngularSetup()
    unread = 35 - unit.ADDRESS_BITS - unit.FRACTION_BITS
    for chord in pieces(np.arange(0, int(WIDEST), 1 << unread)):
        most = largest_major(chord)
        unit._major(Fixed(unit.CHORD_FORMAT, chord), Fixed(SQ(6, 34), Bounds(-most, most)))


def of_minor():
    """Check every word of v that addresses the table, with the largest w of that word.

    The unit reads only ``v = z 4^j`` and ``minor 2^j``. Their bounds do not depend on j, so j is 1 here.
    """
    unit = AngularSetup()
    unread = 34 - unit.ADDRESS_BITS - unit.FRACTION_BITS
    for chord in pieces(np.r_[0, np.arange(1 << 32, 1 << 34, 1 << unread)]):
        most = largest_minor(chord + (1 << unread))
        unit._minor(Fixed(unit.CHORD_FORMAT, chord), Fixed(SQ(6, 34), Bounds(-most, most)), 1)


def of_shift():
    """Check the ends of each shift, and psi for w beyond 2.

    Vectors of unit length have w up to 2, which `test_widths` checks in the half chord.
    """
    for j in range(18):
        chord = np.array([1 << 34 - 2 * j, (1 << 36 - 2 * j) - 1])
        shift = HalfChord.shift(Fixed(AngularSetup.CHORD_FORMAT, chord))
        assert (shift == j).all()
        Fixed(V_FORMAT, Bounds.of(chord << 2 * shift))
    chord = np.arange(1 << 35, int(WIDEST), 1 << 13)
    HalfChord().compute(Fixed(AngularSetup.CHORD_FORMAT, chord), np.ones(chord.shape, bool))


def of_rotation():
    """Check any two words of x and y: a bound of both after all CORDIC steps, whichever way each step turns.

    A step is a turn, times ``sqrt(1 + 4^-i)``, and the cuts of two shifts; this is read off the model's sums.
    So a step makes the length of (x, y) larger by at most that factor and the length of (1, 1).
    """
    unit, pairs, unknowns = AngularSetup(), [], []

    def either(_, a, b):
        """Replacement of `numpy.where`."""
        if not (isinstance(a, Bounds) and a.parts):
            # This choice is for the direction.
            a, b = Bounds.of(a), Bounds.of(b)
            return Bounds(np.minimum(a.low, b.low), np.maximum(a.high, b.high))
        pairs.append((a, b))
        unknowns.append(unknown(-1, 1)[:, 0])
        return unknowns[-1]

    first = [unknown(-1, 1)[:, 0] for _ in range(2)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Bounds, "__array_function__", lambda _, where, types, args, kwargs: either(*args))
        unit._polar(*first)
    assert len(pairs) == 2 * (unit.CORDIC_STEPS + 1)
    unknowns = [*first, *unknowns]
    largest = -np.sqrt(2) * unit.AXIS_FORMAT.min_code
    for k in range(unit.CORDIC_STEPS + 1):
        # The first step is the half turn of vectors that point backwards.
        growth = 1 + 4.0 ** (1 - k) if k else 1
        before = [next(iter(number.parts)) for number in unknowns[2 * k : 2 * k + 2]]
        for sums in zip(*pairs[2 * k : 2 * k + 2], strict=True):
            assert all(set(total.parts) <= set(before) for total in sums)
            matrix = np.array([[np.sum(total.parts.get(number, 0)) for number in before] for total in sums])
            np.testing.assert_array_equal(matrix.T @ matrix, growth * np.eye(2))
            assert all(np.abs(total.rest).max() <= 1 for total in sums)
        largest = np.sqrt(growth) * largest + np.sqrt(2)
        format = unit.ROTATED_FORMAT
        assert largest <= format.max_code, f"x to {largest:.0f} wraps in {format} in step {k}"
    return largest


def of_results(monkeypatch, largest):
    """Check the product that removes the gain, for any x up to its bound, and its terms in any order."""
    unit = AngularSetup()
    x = unknown(-largest, largest)[:, 0]
    monkeypatch.setattr(AngularSetup, "_polar", lambda *_: (x, word(unit.DIRECTION_FORMAT, 1)))
    vector = Fixed(COMPONENT, np.array([[ONE, 0, 0]]))
    unit.compute(vector, vector, vector, np.array([2]))
    Fixed(GAIN_FORMAT, sum(x << 4 >> places for _, places in unit.gain_terms))


def of_step():
    """Check the largest psi of every shift, and every length."""
    unit = AngularSetup()
    length = np.arange(1, 1 << LENGTH_BITS)
    _, halvings = reciprocal_address(length - 1)
    for shift in range(18):
        # Only psi of the half chord is shifted. By arccos, and beyond 90 degrees, psi is not shifted.
        most = HalfChord.ROOT_FORMAT.max_code * HalfChord.FACTOR_FORMAT.max_code << 1 >> shift
        psi = Bounds(0, most if shift else unit.ANGLE_FORMAT.max_code)
        Fixed(unit.ANGLE_FORMAT, psi << shift)
        unit._step(Fixed(unit.ANGLE_FORMAT, psi), np.full(length.shape, shift), length)
        Fixed(PLACES_FORMAT, Bounds.of(shift + halvings))


def of_cosine(monkeypatch):
    """Check any code of the dot product, and of psi by arccos.

    The arccos unit equals its model for every operand.
    """
    dot = DotProduct().compute(word(COMPONENT, 1, 3), word(COMPONENT, 1, 3))
    for sign in (-1, 1):
        Fixed(SIZE_FORMAT, dot.codes * sign)
    monkeypatch.setattr(Arccos, "compute", lambda *_: (word(Arccos.RESULT_FORMAT, 1), None))
    AngularSetup("arccos")._by_arccos(dot)


def of_adders():
    """Prove CORDIC's adder and shifts: if the model's sum fits the format, the hardware gives this sum."""
    h, format = Harness(), AngularSetup.ROTATED_FORMAT
    a, b = (Signal(signed(format.width), name=name) for name in "ab")
    h.m.d.sync += [a.eq(h.free(format.width, "any_a")), b.eq(h.free(format.width, "any_b"))]
    negate = h.free()
    total = Mux(negate, a - b, a + b)
    fits = (total >= format.min_code) & (total <= format.max_code)
    h.claim(~fits | (blysk.hdl.cosines.angular_setup._added(a, b, negate).as_signed() == total))
    for step in range(AngularSetup.CORDIC_STEPS):
        h.claim(blysk.hdl.cosines.angular_setup._halved(b, step).as_signed() == b >> step)
    return h


def of_registers(angle):
    """Claim that raw slices leave as many bits as words have that are proved not to wrap."""
    registers = registers_of(AngularSetupUnit(AngularSetup(angle)))
    for name, format in (REGISTERS | REGISTERS_BY_ANGLE[angle]).items():
        widths = {len(register) for register in registers if fnmatchcase(register.name, name)}
        assert widths == {format.width}, f"{name} has {widths} bits, not those of {format}"


V_FORMAT, PLACES_FORMAT = UQ(0, 36), UQ(5, 0)
SIZE_FORMAT, GAIN_FORMAT = SQ(5, 34), SQ(4, AngularSetup.GAIN_BITS)

CUTS = {
    "blysk.hdl.cosines.half_chord.normalised_words",
    "blysk.hdl.core.reciprocal.reciprocal_words",
    *(
        f"blysk.hdl.cosines.angular_setup.{name}"
        for name in ("_sum", "AngularSetupUnit._minor", "AngularSetupUnit._polar")
    ),
}
CUTS_BY_ANGLE = {
    "half_chord": {
        "blysk.hdl.cosines.angular_setup.AngularSetupUnit._step",
        "blysk.hdl.cosines.half_chord.half_chord_words",
    },
    "arccos": {
        "blysk.hdl.cosines.angular_setup.AngularSetupUnit._by_arccos",
        *(
            f"blysk.hdl.cosines.arccos.{name}"
            for name in ("_rounded", "ArccosUnit._aligned", "ArccosUnit._pipelined")
        ),
        "blysk.hdl.cosines.arccos.ArccosUnit.datapath",
    },
}
"""Checks of this file cover these words, or `reciprocal_words` of `test_widths`, or the arccos unit."""

REGISTERS = {
    "cross": SIZE_FORMAT,
    "v": V_FORMAT,
    "v_coarse": V_FORMAT,
    "minor_coarse": SQ(3, 34),
    "minor_shifted": SQ(3, 34),
    "[xy]_exchanged": AngularSetup.ROTATED_FORMAT,
    "cordic_x*": AngularSetup.ROTATED_FORMAT,
    "cordic_y*": AngularSetup.ROTATED_FORMAT,
    "direction*": AngularSetup.DIRECTION_FORMAT,
    "gain_*": GAIN_FORMAT,
    "phase": AngularSetup.PHASE_FORMAT,
    "step_shift*": PLACES_FORMAT,
    "step_coarse": AngularSetup.STEP_FORMAT,
    "step": AngularSetup.STEP_FORMAT,
}

REGISTERS_BY_ANGLE = {
    "half_chord": {
        "psi": AngularSetup.ANGLE_FORMAT,
        "angle_shift*": PLACES_FORMAT,
        "psi_coarse": AngularSetup.ANGLE_FORMAT,
        "psi_shifted": AngularSetup.ANGLE_FORMAT,
    },
    "arccos": {"cosine_exact": DotProduct().result_format},
}


def test_no_word_wraps(monkeypatch, but_turns):
    """No word wraps for vectors up to 1.01 long, at any angle up to 180 degrees, and 1 to 4095 pixels.

    x and y are checked for every word of w, and CORDIC for any x and y. lambda and its direction count turns,
    and wrap.
    """
    of_major()
    of_minor()
    of_shift()
    of_results(monkeypatch, of_rotation())
    of_step()
    of_cosine(monkeypatch)
    for angle in SPAN_ANGLES:
        formats = wrapped_by(AngularSetupUnit(AngularSetup(angle)))
        assert {AngularSetup.AXIS_FORMAT, AngularSetup.PHASE_FORMAT} <= formats
        assert formats - wrapped_by(HalfChordUnit()) <= set(but_turns)


@pytest.mark.parametrize("angle", SPAN_ANGLES)
def test_registers_have_the_words_that_are_proved(angle):
    """The hardware cuts bits by slices only for v, ``minor 2^j``, CORDIC, its gain, psi and its step."""
    of_registers(angle)
    assert cut_by(AngularSetupUnit(AngularSetup(angle))) == CUTS | CUTS_BY_ANGLE[angle]


def test_bounds_hold(monkeypatch):
    """Operands of x and y that the model finds are within their bounds, and near the bounds."""
    rng, shares = np.random.default_rng(1), {}

    def note(name, largest):
        function, shares[name] = getattr(AngularSetup, name), 0

        def noted(unit, chord, operand, *shift):
            share = (np.abs(operand.codes) / np.maximum(largest(chord.codes), 1)).max()
            shares[name] = max(shares[name], share)
            return function(unit, chord, operand, *shift)

        monkeypatch.setattr(AngularSetup, name, noted)

    note("_major", largest_major)
    note("_minor", largest_minor)
    for degrees in (0, 1e-4, 0.01, 1, 45, 90, 150, 179.9, 180):
        left, right = pairs_at(rng, 10_000, degrees)
        vector = np.where(rng.random((len(left), 1)) < 0.5, left + right, left - right)
        vector = np.where(np.abs(vector).max(axis=1, keepdims=True) > 1e-9, vector, left)
        vector /= np.linalg.norm(vector, axis=1, keepdims=True)
        vectors = (Fixed(COMPONENT, quantise(v)) for v in (left, right, vector))
        AngularSetup().compute(*vectors, np.full(len(left), 2))
    assert all(0.98 < share <= 1 for share in shares.values())


def test_adders_of_cordic_are_those_of_the_model(prove):
    """By SAT. One adder serves the sum and the difference."""
    prove(of_adders())


def test_bug_of_an_adder_is_found(refute, inject):
    """A carry that is lost, injected in the hardware, is found."""
    inject(blysk.hdl.cosines.angular_setup, "_added", "Cat(negate, b", "Cat(~negate, b")
    refute(of_adders(), 4)


def test_angle_of_the_highlight_cosine_alone_wraps():
    """This angle counts turns. All other words have formats that hold them, or saturate."""
    assert wrapped_by(HighlightCosineUnit()) == {HighlightCosine.PHASE_FORMAT}


SHORTER_FORMATS = {
    "x": (of_major, "AXIS_FORMAT", SQ(1, 26)),
    "y": (of_minor, "AXIS_FORMAT", SQ(1, 26)),
    "x and y of CORDIC": (of_rotation, "ROTATED_FORMAT", SQ(3, 26)),
    # Both words stay under 1/2.
    "psi": (of_step, "ANGLE_FORMAT", UQ(-2, 36)),
    "step": (of_step, "STEP_FORMAT", UQ(-2, 40)),
}


@pytest.mark.parametrize("word", SHORTER_FORMATS)
def test_formats_too_short_are_found(monkeypatch, word):
    """One integer bit fewer than needed, injected in the parameters, is found; two for psi and its step."""
    prove, name, format = SHORTER_FORMATS[word]
    monkeypatch.setattr(AngularSetup, name, format)
    with pytest.raises(AssertionError, match=" wraps in "):
        prove()


@pytest.mark.parametrize(
    ("prove", "name", "format"), [(of_shift, "V_FORMAT", UQ(-1, 36)), (of_step, "PLACES_FORMAT", UQ(4, 0))]
)
def test_words_of_shifts_too_short_are_found(monkeypatch, prove, name, format):
    """The same for v and for the number of places by which psi's step is shifted."""
    monkeypatch.setitem(globals(), name, format)
    with pytest.raises(AssertionError, match=" wraps in "):
        prove()


def test_minor_operand_too_short_is_found(inject):
    """The same for ``minor 2^j``."""
    inject(AngularSetup, "_minor", "wrap(SQ(3, 34))", "wrap(SQ(2, 34))")
    with pytest.raises(AssertionError, match=" wraps in "):
        of_minor()


def test_cos_beta_too_short_is_found(inject, monkeypatch):
    """The same with two bits fewer, because sums have the format of CORDIC's x."""
    inject(AngularSetup, "compute", "Fixed(SQ(4, self.GAIN_BITS)", "Fixed(SQ(2, self.GAIN_BITS)")
    with pytest.raises(AssertionError, match=" wraps in "):
        of_results(monkeypatch, of_rotation())


def test_cosine_for_arccos_too_short_is_found(inject, monkeypatch):
    """The same with two bits fewer, because the dot product has the format of three largest products."""
    inject(AngularSetup, "_by_arccos", "Fixed(cross.format", "Fixed(SQ(2, 34)")
    with pytest.raises(AssertionError, match=" wraps in "):
        of_cosine(monkeypatch)


BUGS = {
    "x turns the other way": ("x - (y >> i), x + (y >> i)", "x + (y >> i), x + (y >> i)"),
    "y is shifted too little": ("y + (x >> i), y - (x >> i)", "y + (x >> i), y - (x >> i - 1)"),
    "x grows": ("-x, x), np.where(behind", "-x, x << 1), np.where(behind"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_of_cordic_are_found(inject, bug):
    """Each bug, injected in the model, breaks a statement about a step."""
    inject(AngularSetup, "_polar", *BUGS[bug])
    with pytest.raises(AssertionError):
        of_rotation()


SHORTER_REGISTERS = {
    "v": (blysk.hdl.cosines.angular_setup, "normalised_words", "shift[2:]))[:36]", "shift[2:]))[:35]"),
    "minor 2^j": (AngularSetupUnit, "_minor", "shift[2:]))[:37]", "shift[2:]))[:36]"),
    "half turn": (AngularSetupUnit, "_polar", "-value, value)[:width]", "-value, value)[: width - 1]"),
    "steps of CORDIC": (AngularSetupUnit, "_polar", "else below).as", "else below)[: width - 1].as"),
    "direction": (
        AngularSetupUnit,
        "_polar",
        "min_code, 0)[:direction_width]",
        "min_code, 0)[: direction_width - 1]",
    ),
    "shift of psi": (AngularSetupUnit, "_step", "Mux(obtuse, 0, shift)[:5]", "Mux(obtuse, 0, shift)[:4]"),
    "psi": (AngularSetupUnit, "_step", "shift[2:]))[:36]", "shift[2:]))[:35]"),
    "places": (AngularSetupUnit, "_step", "(a + b)[:5]", "(a + b)[:4]"),
}


@pytest.mark.parametrize("word", SHORTER_REGISTERS)
def test_registers_a_bit_too_short_are_found(inject, word):
    """A slice with one bit fewer, injected in the hardware, is found.

    Other slices are read in a format that refuses them.
    """
    inject(*SHORTER_REGISTERS[word])
    with pytest.raises(AssertionError, match="not those of"):
        of_registers("half_chord")
