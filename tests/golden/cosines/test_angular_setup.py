"""Angular setup against float64 mathematics."""

import numpy as np
import pytest

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import ARCCOS_TABLES, Arccos
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.reference.curves import interpolate

UNIT = AngularSetup()
ANGLES = [0, 1e-4, 1e-3, 0.01, 0.1, 1, 5, 10, 30, 45, 60, 89.9, 90, 91, 120, 150, 179, 179.9, 179.999, 180]


def dot(a, b):
    return np.einsum("...i,...i->...", a, b)


def operands(normal_pairs, seed, degrees, count=2000):
    """Codes of normals an angle apart; vectors anywhere, and half of them near the span; lengths."""
    rng = np.random.default_rng(seed)
    left, right = normal_pairs(rng, count, degrees)
    vector = rng.normal(size=(count, 3))
    near = 0.7 * left + 0.3 * right
    vector[::2] = near[::2] + vector[::2] * 10.0 ** rng.uniform(-6, 0, (len(vector[::2]), 1))
    vector /= np.linalg.norm(vector, axis=1, keepdims=True)
    length = rng.integers(2, 4096, count)
    length[:5] = [2, 3, 16, 4094, 4095]
    return *(quantise(v) for v in (left, right, vector)), length


def setup(left, right, vector, length, unit=UNIT):
    return unit.compute(*(Fixed(COMPONENT, codes) for codes in (left, right, vector)), length)


def pixels(length, seed=1):
    """Some pixels of each span, both ends among them; shape (9, spans)."""
    pixel = (np.random.default_rng(seed).random((9, len(length))) * length).astype(np.int64)
    pixel[0], pixel[1] = 0, length - 1
    return pixel


def cosines(result, pixel):
    _, phase, step, cos_beta, _ = result
    return cos_beta.values * np.cos(2 * np.pi * (phase.values - pixel * step.values))


def exact(left, right, vector, t):
    """The formula of the docstring on the same codes."""
    to_left, to_right = dot(left, vector) / ONE**2, dot(right, vector) / ONE**2
    chord, sum_ = (dot(v, v) / ONE**2 for v in (right - left, right + left))
    acute = sum_ >= chord
    sine = np.where(acute, np.sqrt(chord) / 2, np.sqrt(np.maximum(1 - sum_ / 4, 0)))
    cosine = np.where(acute, np.sqrt(np.maximum(1 - chord / 4, 0)), np.sqrt(sum_) / 2)
    psi = 2 * np.arctan2(sine, cosine)
    zero = np.zeros(len(left))
    x = np.divide((to_left + to_right) / 2, cosine, out=zero.copy(), where=cosine > 0)
    y = np.divide(dot(right - left, vector) / ONE**2 / 2, sine, out=zero.copy(), where=sine > 0)
    return x * np.cos((t - 0.5) * psi) + y * np.sin((t - 0.5) * psi)


@pytest.mark.parametrize("degrees", ANGLES)
def test_stiff_span_angles_keep_the_bound(degrees, normal_pairs):
    left, right, vector, length = operands(normal_pairs, 3, degrees)
    pixel = pixels(length)
    found = cosines(setup(left, right, vector, length), pixel)
    error = np.abs(found - exact(left, right, vector, pixel / (length - 1))).max()
    bound = UNIT.error(degrees)
    assert error <= bound
    if degrees > 20:
        assert error > 0.2 * bound


@pytest.mark.parametrize("degrees", ANGLES)
@pytest.mark.parametrize("table", ARCCOS_TABLES)
def test_stiff_span_angles_by_arccos(degrees, table, normal_pairs):
    unit = AngularSetup("arccos", Arccos(table))
    left, right, vector, length = operands(normal_pairs, 3, degrees)
    pixel = pixels(length)
    found = cosines(setup(left, right, vector, length, unit), pixel)
    error = np.abs(found - exact(left, right, vector, pixel / (length - 1))).max()
    assert error <= unit.arccos_error(degrees)


# The table of the docstring: 1e-4, 1, 10 and 45 degrees.
@pytest.mark.parametrize(
    ("unit", "stated"),
    [
        (UNIT, [5.0e-7, 7.4e-7, 3.8e-6, 1.3e-5]),
        (AngularSetup("arccos"), [0.0095, 0.0012, 0.0049, 2.6e-4]),
        (AngularSetup("arccos", Arccos("corrected")), [0.042, 0.034, 3.5e-4, 5.0e-4]),
        (AngularSetup("arccos", Arccos("as_published")), [0.088, 0.078, 0.045, 5.0e-4]),
    ],
    ids=["half_chord", "refitted", "corrected", "as_published"],
)
def test_error_by_where_psi_comes_from(unit, stated, normal_pairs):
    for degrees, largest in zip((1e-4, 1, 10, 45), stated, strict=True):
        left, right, vector, length = operands(normal_pairs, 3, degrees, count=20000)
        pixel = pixels(length)
        found = cosines(setup(left, right, vector, length, unit), pixel)
        error = np.abs(found - exact(left, right, vector, pixel / (length - 1))).max()
        assert error == pytest.approx(largest, rel=0.06)


@pytest.mark.parametrize("degrees", [1e-4, 1, 45, 90, 150])
@pytest.mark.parametrize("unit", [UNIT, AngularSetup("arccos")], ids=["half_chord", "arccos"])
def test_stiff_peaks(degrees, unit):
    """On a pixel, between two, and at an end; the highlight wholly inside the span."""
    psi, length = np.radians(degrees), 17
    bound = unit.error(degrees) if unit is UNIT else unit.arccos_error(degrees)
    for place in (8, 7.5, 0, 16):
        turn = place / (length - 1) * psi
        vectors = [[np.cos(a), np.sin(a), 0] for a in (0, psi, turn)]
        codes = quantise(np.array(vectors))[:, np.newaxis]
        result = setup(*codes, np.array([length]), unit)
        pixel = np.arange(length)[:, np.newaxis]
        found = cosines(result, pixel)
        assert np.abs(found - exact(*codes, pixel / (length - 1))).max() <= bound
        # A code is off by under a step in each component, its length by 2^-18; see also test_each_figure.
        ideal = np.cos(pixel / (length - 1) * psi - turn)
        assert np.abs(found - ideal).max() <= bound + 4 * 2.0**-17 / np.cos(psi / 2)


def test_stiff_normals_of_no_unit_length():
    """Of length 0 both N.H are 0, and so is cos gamma; by 1 +- 1/256 too long, the ends still hold."""
    zero = np.zeros((1, 3), dtype=np.int64)
    halfway = quantise(np.array([[0.6, 0, 0.8]]))
    for unit in (UNIT, AngularSetup("arccos")):
        result = setup(zero, zero, halfway, np.array([16]), unit)
        assert np.abs(cosines(result, np.arange(16)[:, np.newaxis])).max() == 0
    rng = np.random.default_rng(12)
    for scale in (1 - 1 / 256, 1 + 1 / 256):
        # Off the axes, so that no component saturates.
        middle = np.array([1, 1, 1]) / np.sqrt(3) + rng.uniform(-0.2, 0.2, (500, 3))
        left = middle / np.linalg.norm(middle, axis=1, keepdims=True)
        right = left + rng.uniform(-0.1, 0.1, (500, 3))
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        codes = [np.rint(scale * v * ONE).astype(np.int64) for v in (left, right)]
        result = setup(*codes, halfway, np.full(500, 16))
        for end, pixel in zip(codes, (0, 15), strict=True):
            assert np.abs(cosines(result, pixel) - dot(end, halfway) / ONE**2).max() <= UNIT.error(20)


def test_stiff_words_at_their_ends():
    """Every corner of the words gives something in range, none an exception."""
    ends = np.array([COMPONENT.min_code, 0, COMPONENT.max_code])
    corners = np.stack(np.meshgrid(*[ends] * 9), axis=-1).reshape(-1, 9)[::7]
    for unit in (UNIT, AngularSetup("arccos", Arccos("as_published"))):
        result = setup(
            corners[:, :3],
            corners[:, 3:6],
            corners[:, 6:],
            np.resize([1, 2, 3, 16, 4095], len(corners)),
            unit,
        )
        assert result[0].values.max() < 1
        assert np.abs(result[1].values).max() <= 0.5


@pytest.mark.parametrize("degrees", ANGLES)
def test_goes_through_both_ends(degrees, normal_pairs):
    """However small psi: cos gamma is N_l.H at the first pixel and N_r.H at the last."""
    left, right, vector, length = operands(normal_pairs, 4, degrees)
    result = setup(left, right, vector, length)
    for normal, pixel in ((left, 0 * length), (right, length - 1)):
        error = np.abs(cosines(result, pixel) - dot(normal, vector) / ONE**2)
        assert error.max() <= UNIT.error(degrees)


@pytest.mark.parametrize("degrees", [angle for angle in ANGLES if angle <= 150])
def test_follows_slerp(degrees, normal_pairs):
    """Against the great circle through the directions of the quantised normals."""
    left, right, vector, length = operands(normal_pairs, 5, degrees)
    pixel = pixels(length)
    found = cosines(setup(left, right, vector, length), pixel)
    ends = [codes / np.linalg.norm(codes, axis=1, keepdims=True) for codes in (left, right)]
    normals = interpolate(
        "slerp", *(np.broadcast_to(end, (9, *end.shape)) for end in ends), pixel / (length - 1)
    )
    # Either end is as long as its code, to 2^-18; half-way a wide span feels it 1/cos(psi/2) times.
    lengths = 2.0**-17 / np.cos(np.radians(degrees) / 2)
    assert np.abs(found - dot(normals, vector / ONE)).max() <= UNIT.error(degrees) + lengths


@pytest.mark.parametrize("degrees", [1e-3, 1, 10, 45, 90, 150])
def test_each_figure(degrees, normal_pairs):
    """psi, lambda and cos beta by the printed formulas in float64, on exact vectors."""
    rng = np.random.default_rng(6)
    count, psi = 2000, np.radians(degrees)
    left, right = normal_pairs(rng, count, degrees)
    vector, _ = normal_pairs(rng, count, 0)
    length = rng.integers(2, 4096, count)
    angle, phase, step, cos_beta, out_of_range = setup(*(quantise(v) for v in (left, right, vector)), length)
    to_left, to_right = dot(left, vector), dot(right, vector)
    side = (to_right - np.cos(psi) * to_left) / np.sin(psi)
    # Codes are off by under a step in each component; sin psi turns that into an angle of the plane.
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


def test_stiff_equal_normals(normal_pairs):
    left, _, vector, length = operands(normal_pairs, 7, 0)
    result = setup(left, left, vector, length)
    angle, _, step, _, out_of_range = result
    assert not angle.codes.any()
    assert not step.codes.any()
    assert not out_of_range.any()
    assert np.abs(cosines(result, 0) - dot(left, vector) / ONE**2).max() <= UNIT.error(0)


def test_stiff_normals_one_step_apart(normal_pairs):
    """The difference of such normals may point along them; cos beta then goes past 1 and saves the ends."""
    left, _, vector, length = operands(normal_pairs, 8, 0)
    right = left.copy()
    rows, axis = np.arange(len(left)), np.abs(left).argmax(axis=1)
    right[rows, axis] -= np.sign(left[rows, axis])
    vector[::2] = left[::2]
    result = setup(left, right, vector, length)
    assert 1.41 < result[3].values.max() <= np.sqrt(2) + 1e-5
    for normal, pixel in ((left, 0 * length), (right, length - 1)):
        assert np.abs(cosines(result, pixel) - dot(normal, vector) / ONE**2).max() <= UNIT.error(0.001)


def test_stiff_wide_spans_are_flagged(normal_pairs):
    left, right, vector, length = operands(normal_pairs, 9, 180)
    right = -left
    result = setup(left, right, vector, length)
    assert result[4].all()
    assert np.all(result[0].values == 0.5)
    for degrees, flagged in ((150.0, False), (150.01, True), (179.9, True)):
        result = setup(*operands(normal_pairs, 9, degrees))
        assert (result[4] == flagged).all()


@pytest.mark.parametrize("degrees", [0.5, 10, 60])
def test_highlight_inside_the_span(degrees):
    """The peak on the middle pixel of an odd span is 1, and lambda half of psi."""
    half = np.radians(degrees) / 2
    ends = quantise(
        np.array([[np.cos(half), -np.sin(half), 0], [np.cos(half), np.sin(half), 0], [1.0, 0, 0]])
    )
    result = setup(*ends[:, np.newaxis], np.array([17]))
    angle, phase, _, cos_beta, _ = result
    assert phase.values == pytest.approx(angle.values / 2, abs=1e-7)
    assert cos_beta.values == pytest.approx(1, abs=UNIT.error(degrees))
    assert cosines(result, 8) == pytest.approx(1, abs=UNIT.error(degrees))


def test_vector_at_right_angles_to_the_circle():
    ends = np.array([[[ONE, 0, 0]], [[0, ONE, 0]], [[0, 0, ONE]]])
    _, _, _, cos_beta, _ = setup(*ends, np.array([5]))
    assert cos_beta.codes == 0


def test_stiff_short_and_long_spans():
    ends = quantise(np.array([[1.0, 0, 0], [np.cos(0.3), np.sin(0.3), 0], [0, 0, 1.0]]))
    for length, share in ((1, 1), (2, 1), (3, 2), (16, 15), (4095, 4094)):
        angle, _, step, _, _ = setup(*ends[:, np.newaxis], np.array([length]))
        assert step.values * share == pytest.approx(angle.values, rel=2.1e-5)


def test_better_than_by_arccos(normal_pairs):
    """At 1 degree the printed way, with the corrected table, misses by degrees of lambda."""
    left, right, vector, length = operands(normal_pairs, 10, 1.0)
    pixel = pixels(length)
    t = pixel / (length - 1)
    target = exact(left, right, vector, t)
    to_left, to_right, cross = (
        dot(a, b) / ONE**2 for a, b in ((left, vector), (right, vector), (left, right))
    )
    psi = Arccos("corrected").compute(Fixed.round(SQ(2, 16), cross))[0].values
    phase = np.arctan2((to_right - np.cos(psi) * to_left) / np.sin(psi), to_left)
    printed = to_left / np.cos(phase) * np.cos(phase - t * psi)
    ours = cosines(setup(left, right, vector, length), pixel)
    # The ends are met all the same: between them the curve bulges with the square of psi.
    assert np.abs(printed - target).max() > 200 * np.abs(ours - target).max()


@pytest.mark.parametrize("degrees", [0, 1e-3, 1, 10, 45, 90, 150])
def test_with_the_highlight_cosine_unit(degrees, normal_pairs):
    left, right, vector, length = operands(normal_pairs, 11, degrees, count=400)
    _, phase, step, cos_beta, _ = setup(left, right, vector, length)
    span = np.tile(np.arange(len(length)), 9)
    pixel = pixels(length)
    found = HighlightCosine().compute(phase, step, cos_beta, span, pixel.ravel()).values
    target = 1 - exact(left, right, vector, pixel / (length - 1)).ravel()
    bound = HighlightCosine.ERROR * max(1, cos_beta.values.max()) + UNIT.error(degrees)
    assert np.abs(found - target).max() <= bound
    bright = target < 1 / 40
    assert bright.sum() > 100
    assert np.abs(found - target)[bright].max() <= 0.5 * HighlightCosine.ERROR + UNIT.error(degrees)


def test_gain():
    gain = np.prod(np.sqrt(1 + 4.0 ** -np.arange(22)))
    assert sum(sign / 2.0**shift for sign, shift in UNIT.gain_terms) == pytest.approx(1 / gain, abs=2.0**-28)


def test_tables_fit_a_block_ram():
    for values, changes in (UNIT.corrections, UNIT.reciprocals):
        assert len(values.codes) == len(changes.codes) == 512
        assert values.format.width + changes.format.width <= 36


@pytest.mark.parametrize("length", [0, 4096])
def test_length_out_of_range(length):
    vector = np.array([[ONE, 0, 0]])
    with pytest.raises(ValueError, match="lengths must be 1 to 4095"):
        setup(vector, vector, vector, np.array([length]))


def test_unknown_angle():
    with pytest.raises(ValueError, match=r"^angle must be half_chord or arccos, not 'arcsin'$"):
        AngularSetup("arcsin")


def test_wrong_format():
    vector = Fixed(SQ(1, 16), [[0, 0, 1]])
    with pytest.raises(ValueError, match=r"operands must be SQ\(1, 17\)"):
        UNIT.compute(vector, vector, vector, np.array([1]))
