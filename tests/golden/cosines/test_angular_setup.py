"""Angular setup: the bit-accurate model against float64."""

import numpy as np
import pytest

from blysk.bench.units.cosines.angular_setup import half_angles
from blysk.bench.units.operands import component_words, dot, pairs_at, pairs_of_length, sphere
from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import ARCCOS_TABLES, Arccos
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise

UNIT = AngularSetup()
BY_ARCCOS = {table: AngularSetup("arccos", Arccos(table)) for table in ARCCOS_TABLES}
ANGLES = [0, 1e-4, 1e-3, 0.01, 0.1, 1, 5, 10, 30, 45, 60, 89.9, 90, 91, 120, 150, 179, 179.9, 179.999, 180]


def operands(seed, degrees, count=2000):
    """Codes of normals at an angle, codes of vectors, and lengths. Half of the vectors are near the span."""
    rng = np.random.default_rng(seed)
    left, right = pairs_at(rng, count, degrees)
    vector = rng.normal(size=(count, 3))
    near = 0.7 * left + 0.3 * right
    vector[::2] = near[::2] + vector[::2] * 10.0 ** rng.uniform(-6, 0, (len(vector[::2]), 1))
    length = rng.integers(2, 4096, count)
    length[:5] = [2, 3, 16, 4094, 4095]
    return *(quantise(v) for v in (left, right, normalise(vector))), length


def setup(left, right, vector, length, unit=UNIT):
    return unit.compute(*component_words(left, right, vector), length)


def pixels(length, seed=1):
    """Some pixels of each span, both ends among them; shape (9, spans)."""
    pixel = (np.random.default_rng(seed).random((9, len(length))) * length).astype(np.int64)
    pixel[0], pixel[1] = 0, length - 1
    return pixel


def cosines(result, pixel):
    _, phase, step, cos_beta, _ = result
    return cos_beta.values * np.cos(2 * np.pi * (phase.values - pixel * step.values))


def exact(left, right, vector, t):
    """The formula of the docstring, for the same codes."""
    sine, cosine = half_angles(left, right)
    psi, zero = 2 * np.arctan2(sine, cosine), np.zeros(len(left))
    x = np.divide(dot(left + right, vector) / ONE**2 / 2, cosine, out=zero.copy(), where=cosine > 0)
    y = np.divide(dot(right - left, vector) / ONE**2 / 2, sine, out=zero.copy(), where=sine > 0)
    return x * np.cos((t - 0.5) * psi) + y * np.sin((t - 0.5) * psi)


def error_of(unit, degrees, count=2000):
    """Largest error at some pixels of spans at an angle."""
    *vectors, length = operands(3, degrees, count)
    pixel = pixels(length)
    found = cosines(setup(*vectors, length, unit), pixel)
    return np.abs(found - exact(*vectors, pixel / (length - 1))).max()


def end_errors(unit, vectors, length):
    """Errors at the first pixel against N_l.H, and at the last pixel against N_r.H."""
    *normals, vector = vectors
    result = setup(*normals, vector, length, unit)
    for normal, pixel in zip(normals, (0 * length, length - 1), strict=True):
        yield np.abs(cosines(result, pixel) - dot(normal, vector) / ONE**2).max()


@pytest.mark.parametrize("degrees", ANGLES)
def test_stiff_span_angles_keep_the_bound(degrees):
    error, bound = error_of(UNIT, degrees), UNIT.error(degrees)
    assert error <= bound
    assert degrees <= 20 or error > 0.2 * bound
    # However small psi is, cos gamma is N_l.H at the first pixel and N_r.H at the last.
    *vectors, length = operands(4, degrees)
    assert all(error <= bound for error in end_errors(UNIT, vectors, length))
    for unit in BY_ARCCOS.values():
        assert error_of(unit, degrees, 500) <= unit.arccos_error(degrees)


# These are the angles in the table of the docstring: 1e-4, 1, 10 and 45 degrees.
@pytest.mark.parametrize(
    ("unit", "stated"),
    [
        (UNIT, [5.0e-7, 7.4e-7, 3.8e-6, 1.3e-5]),
        (BY_ARCCOS["refitted"], [0.0095, 0.0012, 0.0049, 2.6e-4]),
        (BY_ARCCOS["corrected"], [0.042, 0.034, 3.5e-4, 5.0e-4]),
        (BY_ARCCOS["as_published"], [0.088, 0.078, 0.045, 5.0e-4]),
    ],
    ids=["half_chord", "refitted", "corrected", "as_published"],
)
def test_error_by_the_source_of_psi(unit, stated):
    for degrees, largest in zip((1e-4, 1, 10, 45), stated, strict=True):
        assert error_of(unit, degrees, 20_000) == pytest.approx(largest, rel=0.06)


@pytest.mark.parametrize(("degrees", "largest"), [(0.1, 6.4e-7), (90, 3.3e-5)])
def test_stated_errors_of_the_half_chord(degrees, largest):
    """The errors are those of the docstring. The figure for 90 degrees holds up to 150 degrees."""
    assert error_of(UNIT, degrees, 20_000) == pytest.approx(largest, rel=0.06)
    if degrees == 90:
        assert error_of(UNIT, 120, 20_000) < largest > error_of(UNIT, 150, 20_000)


@pytest.mark.parametrize("degrees", [1e-4, 1, 45, 90, 150])
@pytest.mark.parametrize("unit", [UNIT, BY_ARCCOS["refitted"]], ids=["half_chord", "arccos"])
def test_stiff_peaks(degrees, unit):
    """The peak is on a pixel, between two pixels, and at an end.

    The highlight lies wholly inside the span.
    """
    psi, length = np.radians(degrees), np.array([17])
    bound = unit.error(degrees) if unit is UNIT else unit.arccos_error(degrees)
    pixel = np.arange(17)[:, np.newaxis]
    for peak in (8, 7.5, 0, 16):
        turn = peak / 16 * psi
        codes = quantise(np.array([[[np.cos(a), np.sin(a), 0]] for a in (0, psi, turn)]))
        found = cosines(setup(*codes, length, unit), pixel)
        assert np.abs(found - exact(*codes, pixel / 16)).max() <= bound
        # Each component of a code is off by less than a step, and its length by 2^-18; see also
        # test_each_figure.
        ideal = np.cos(pixel / 16 * psi - turn)
        assert np.abs(found - ideal).max() <= bound + 4 * 2.0**-17 / np.cos(psi / 2)


@pytest.mark.parametrize("degrees", [0.5, 10, 60])
def test_peak_on_the_middle_pixel(degrees):
    """At the peak cos gamma is 1, and lambda is half of psi."""
    half, bound = np.radians(degrees) / 2, UNIT.error(degrees)
    ends = quantise(np.array([[[np.cos(a), np.sin(a), 0]] for a in (-half, half, 0)]))
    angle, phase, _, cos_beta, _ = result = setup(*ends, np.array([17]))
    assert phase.values == pytest.approx(angle.values / 2, abs=1e-7)
    assert cos_beta.values == pytest.approx(1, abs=bound)
    assert cosines(result, 8) == pytest.approx(1, abs=bound)


def test_stiff_normals_of_no_unit_length():
    """With normals of length 0 both N.H and cos gamma are 0.

    With lengths of 1 +- 1/256 the ends still have their N.H.
    """
    zero, halfway = np.zeros((1, 3), dtype=np.int64), quantise(np.array([[0.6, 0, 0.8]]))
    for unit in (UNIT, BY_ARCCOS["refitted"]):
        result = setup(zero, zero, halfway, np.array([16]), unit)
        assert np.abs(cosines(result, np.arange(16)[:, np.newaxis])).max() == 0
    for length in (1 - 1 / 256, 1 + 1 / 256):
        left, right = pairs_of_length(np.random.default_rng(12), 500, 10.0, length)
        vectors = left, right, np.tile(halfway, (len(left), 1))
        assert all(error <= UNIT.error(20) for error in end_errors(UNIT, vectors, np.full(len(left), 16)))


@pytest.mark.parametrize("degrees", [angle for angle in ANGLES if angle <= 150])
def test_follows_slerp(degrees):
    """The curve is compared with the great circle through the directions of the quantised normals."""
    left, right, vector, length = operands(5, degrees)
    pixel = pixels(length)
    found = cosines(setup(left, right, vector, length), pixel)
    ends = (np.broadcast_to(normalise(codes / ONE), (9, *codes.shape)) for codes in (left, right))
    normals = interpolate("slerp", *ends, pixel / (length - 1))
    # Each end is as long as its code, to 2^-18. In the middle of a wide span this counts 1/cos(psi/2) times.
    lengths = 2.0**-17 / np.cos(np.radians(degrees) / 2)
    assert np.abs(found - dot(normals, vector / ONE)).max() <= UNIT.error(degrees) + lengths


@pytest.mark.parametrize("degrees", [1e-3, 1, 10, 45, 90, 150])
def test_each_figure(degrees):
    """psi, lambda and cos beta are compared with the published formulas in float64, on exact vectors."""
    rng = np.random.default_rng(6)
    count, psi = 2000, np.radians(degrees)
    left, right = pairs_at(rng, count, degrees)
    vector, length = sphere(rng, count), rng.integers(2, 4096, count)
    angle, phase, step, cos_beta, out_of_range = setup(*(quantise(v) for v in (left, right, vector)), length)
    to_left, to_right = dot(left, vector), dot(right, vector)
    side = (to_right - np.cos(psi) * to_left) / np.sin(psi)
    # Each component of a code is off by less than a step. Divided by sin psi this is an angle of the plane.
    plane = 4 * np.sqrt(3) * 2.0**-17 / np.sin(psi) + UNIT.error(degrees) / np.sin(psi / 2)
    assert np.abs(2 * np.pi * angle.values - psi).max() <= 2 * np.sqrt(3) * 2.0**-17 + 3e-5 * psi
    if degrees >= 1:
        radius = np.hypot(to_left, side)
        assert np.abs(cos_beta.values - radius).max() <= plane
        turn = np.angle(np.exp(1j * (2 * np.pi * phase.values - np.arctan2(side, to_left))))
        assert np.abs(turn * radius).max() <= 2 * plane
    off = np.abs(step.values * (length - 1) - angle.values)
    assert np.all(off <= (2.0**-19 / 0.159 + 2.0**-17) * angle.values + 4095 * 2.0**-40)
    assert not out_of_range.any()


def test_stiff_equal_normals():
    left, _, vector, length = operands(7, 0)
    angle, _, step, _, out_of_range = result = setup(left, left, vector, length)
    for word in (angle.codes, step.codes, out_of_range):
        assert not word.any()
    assert np.abs(cosines(result, 0) - dot(left, vector) / ONE**2).max() <= UNIT.error(0)


def test_stiff_normals_one_step_apart():
    """The difference of normals one step apart may point along them.

    Then cos beta is over 1, and the curve still meets the ends.
    """
    left, _, vector, length = operands(8, 0)
    right = left.copy()
    rows, axis = np.arange(len(left)), np.abs(left).argmax(axis=1)
    right[rows, axis] -= np.sign(left[rows, axis])
    vector[::2] = left[::2]
    assert 1.41 < setup(left, right, vector, length)[3].values.max() <= np.sqrt(2) + 1e-5
    assert all(error <= UNIT.error(0.001) for error in end_errors(UNIT, (left, right, vector), length))


def test_stiff_spans_out_of_range_are_flagged():
    left, _, vector, length = operands(9, 180)
    angle, *_, out_of_range = setup(left, -left, vector, length)
    assert out_of_range.all()
    assert np.all(angle.values == 0.5)
    for degrees, flagged in ((150.0, False), (150.01, True), (179.9, True)):
        assert (setup(*operands(9, degrees))[4] == flagged).all()


def test_vector_at_right_angles_to_the_circle():
    ends = np.array([[[ONE, 0, 0]], [[0, ONE, 0]], [[0, 0, ONE]]])
    assert setup(*ends, np.array([5]))[3].codes == 0


@pytest.mark.parametrize(("length", "share"), [(1, 1), (2, 1), (3, 2), (16, 15), (4095, 4094)])
def test_stiff_short_and_long_spans(length, share):
    ends = quantise(np.array([[1.0, 0, 0], [np.cos(0.3), np.sin(0.3), 0], [0, 0, 1.0]]))
    angle, _, step, _, _ = setup(*ends[:, np.newaxis], np.array([length]))
    assert step.values * share == pytest.approx(angle.values, rel=2.1e-5)


@pytest.mark.parametrize("degrees", [0, 1e-3, 1, 10, 45, 90, 150])
def test_with_the_highlight_cosine_unit(degrees):
    *vectors, length = operands(11, degrees, count=400)
    _, phase, step, cos_beta, _ = setup(*vectors, length)
    span, pixel = np.tile(np.arange(len(length)), 9), pixels(length)
    found = HighlightCosine().compute(phase, step, cos_beta, span, pixel.ravel()).values
    target = 1 - exact(*vectors, pixel / (length - 1)).ravel()
    bound = HighlightCosine.ERROR * max(1, cos_beta.values.max()) + UNIT.error(degrees)
    assert np.abs(found - target).max() <= bound
    bright = target < 1 / 40
    assert bright.sum() > 100
    assert np.abs(found - target)[bright].max() <= 0.5 * HighlightCosine.ERROR + UNIT.error(degrees)


def test_constants():
    """The gain of 22 steps of CORDIC is a sum of powers of two. Each table takes one block RAM."""
    gain = np.prod(np.sqrt(1 + 4.0 ** -np.arange(22)))
    assert sum(sign / 2.0**shift for sign, shift in UNIT.gain_terms) == pytest.approx(1 / gain, abs=2.0**-28)
    for values, changes in (UNIT.corrections, UNIT.reciprocals):
        assert len(values.codes) == len(changes.codes) == 512
        assert values.format.width + changes.format.width <= 36


def test_refuses():
    vector = np.array([[ONE, 0, 0]])
    for length in (0, 4096):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            setup(vector, vector, vector, np.array([length]))
    with pytest.raises(ValueError, match=r"^angle must be half_chord or arccos, not 'arcsin'$"):
        AngularSetup("arcsin")
    other = Fixed(SQ(1, 16), [[0, 0, 1]])
    with pytest.raises(ValueError, match=r"operands must be SQ\(1, 17\)"):
        UNIT.compute(other, other, other, np.array([1]))
