# amaranth: UnusedElaboratable=no
# Above: a component that is refused is never elaborated.
"""Highlight gate unit: RTL against its twin, clock by clock, at full and at reduced width."""

import numpy as np
import pytest

from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.specular import Specular
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.sim.engines.simulate import simulate

ANGLES = [0, 1e-3, 1, 10, 30, 44.9, 45.1, 90]


def spans(rng, normal_pairs, count, halfway, cosine, spread=1e-3, angles=ANGLES):
    """Spans about a cosine to H, so that the comparisons are decided late, and corners of the words."""
    left, right = normal_pairs(rng, count, rng.choice(angles, count))
    axis = np.cross(left, right) + 1e-9
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    # Turned so that H stands where the maximum over the arc is about the threshold.
    middle = left + right * rng.uniform(0.2, 2, (count, 1)) + 1e-12
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    near = np.clip(cosine + rng.normal(size=(count, 1)) * spread, -1, 1)
    target = middle * near + axis * np.sqrt(1 - near**2)
    # A rotation that takes each target to H.
    mirror = target - halfway
    size = np.maximum((mirror**2).sum(axis=1, keepdims=True), 1e-30)
    left, right = (
        n - 2 * mirror * np.einsum("ij,ij->i", n, mirror)[:, np.newaxis] / size for n in (left, right)
    )
    return left, right


@pytest.mark.parametrize(
    ("model", "interval"), [("cosquad", None), ("lyon2", 4), *(("cosquad", k) for k in (1, 2, 3, 5, 8, 15))]
)
def test_equals_twin(verify, normal_pairs, model, interval):
    parameters = HighlightGate(Specular(REFLECTION_MODELS[model]))
    unit = HighlightGateUnit(parameters, initiation_interval=interval)
    rng = np.random.default_rng(11)
    halfway = np.array([1.0, 2.0, 2.0]) / 3
    code = quantise(halfway)
    shares = []
    for exponent in (1, 10, 1000):
        cosine = np.sqrt(parameters.thresholds.values[exponent])
        left, right = (quantise(n) for n in spans(rng, normal_pairs, 600, halfway, cosine))
        corners = rng.choice([-(2**17), 2**17 - 1, 0, 1, -1], (100, 6))
        left, right = np.vstack([left, corners[:, :3]]), np.vstack([right, corners[:, 3:]])
        format = parameters.component_format
        expected = parameters.compute(*(Fixed(format, n) for n in (left, right, code)), exponent)
        shares.append(expected[:600].mean())
        beats = {"normal_left": left, "normal_right": right}
        constants = {"halfway": code[np.newaxis], "exponent": exponent}
        verify(unit, beats, expected.astype(np.uint8), constants=constants)
    assert shares[0] == 1
    assert min(shares) > 0.3
    assert max(shares[1:]) < 0.9


def lit_by(unit, left, right, halfway, exponent, **stalls):
    """What the unit says of spans under one light."""
    beats = {"normal_left": left, "normal_right": right}
    constants = {"halfway": halfway[np.newaxis], "exponent": exponent}
    return simulate(unit, beats, count=len(left), constants=constants, engine="auto", **stalls).beats


def test_every_bit_counts(normal_pairs):
    """Every bit of the exponent and of its threshold; of words that wait; of products those rounded off.

    Spans of all angles, of which the maximum is the threshold but for the rounding of the normals.
    """
    parameters = HighlightGate(Specular(REFLECTION_MODELS["cosquad"]))
    unit = HighlightGateUnit(parameters)
    rng = np.random.default_rng(12)
    for exponent in [*1 << np.arange(10), *rng.integers(1, 1001, 20)]:
        halfway = rng.normal(size=3)
        halfway /= np.linalg.norm(halfway)
        code = quantise(halfway)
        cosine = np.sqrt(parameters.thresholds.values[exponent])
        near = spans(rng, normal_pairs, 3000, halfway, cosine, 1e-5, np.geomspace(0.1, 45, 400))
        left, right = (quantise(n) for n in near)
        operands = (Fixed(COMPONENT, n) for n in (left, right, code))
        lit = lit_by(unit, left, right, code, exponent, output_stalls=rng.random(1009) < 0.3)
        np.testing.assert_array_equal(lit, parameters.compute(*operands, exponent))


@pytest.mark.parametrize("fraction_bits", [5, 6, 9])
def test_equals_twin_at_reduced_width(fraction_bits):
    parameters = HighlightGate(fraction_bits=fraction_bits)
    unit = HighlightGateUnit(parameters)
    rng = np.random.default_rng(fraction_bits)
    format = parameters.component_format
    shares = []
    for exponent in (2, 4, 20, 300):
        # Neighbouring codes of about unit length.
        left = rng.normal(size=(2500, 3))
        right = left + rng.normal(size=left.shape) * 0.3
        halfway = left[0] + rng.normal(size=3) * 0.3
        left, right, halfway = (
            np.rint(v / np.linalg.norm(v, axis=-1, keepdims=True) * format.max_code).astype(np.int64)
            for v in (left, right, halfway)
        )
        left *= np.sign(left @ halfway)[:, np.newaxis] | 1
        right *= np.sign(right @ halfway)[:, np.newaxis] | 1
        expected = parameters.compute(*(Fixed(format, v) for v in (left, right, halfway)), exponent)
        shares.append(expected.mean())
        np.testing.assert_array_equal(lit_by(unit, left, right, halfway, exponent), expected)
    assert 0.01 < min(shares) < 0.8


@pytest.mark.long
def test_times_and_multipliers_as_stated():
    units = [HighlightGateUnit(initiation_interval=interval) for interval in range(1, 16)]
    assert [unit.latency for unit in units] == [25, 29, 28, 26, 31, 29, 26, 30, 32, 34, 36, 37, 33, 28, 49]
    counts = [cost_of(unit).multiplier_count for unit in units]
    assert counts == [15, 8, 5, 4, 3, 3, 3, *[2] * 7, 1]
    assert HighlightGateUnit().initiation_interval == 6
    with pytest.raises(ValueError, match=r"^initiation_interval must be 1 to 15, not 16$"):
        HighlightGateUnit(initiation_interval=16)


@pytest.mark.parametrize(
    ("lights", "exponent", "interval"),
    [(2, 60, 27), *(pytest.param(*p, marks=pytest.mark.long) for p in ((3, None, 4), (1, 60, 6)))],
)
def test_several_lights_or_an_exponent_for_good(verify, normal_pairs, lights, exponent, interval):
    parameters = HighlightGate()
    unit = HighlightGateUnit(parameters, lights, initiation_interval=interval, exponent=exponent)
    rng = np.random.default_rng(lights)
    halfway = rng.normal(size=(lights, 3)) * 0.3 + [0, 0, 1]
    halfway /= np.linalg.norm(halfway, axis=1, keepdims=True)
    cosine = np.sqrt(parameters.thresholds.values[60])
    parts = [spans(rng, normal_pairs, 150, h, cosine) for h in halfway]
    left, right = (quantise(np.concatenate(ends)) for ends in zip(*parts, strict=True))
    codes = quantise(halfway)
    operands = [Fixed(COMPONENT, n) for n in (left, right)]
    lit = np.stack([parameters.compute(*operands, Fixed(COMPONENT, code), 60) for code in codes], axis=-1)
    assert np.all((lit.mean(axis=0) > 0.1) & (lit.mean(axis=0) < 0.9))
    constants = {"halfway": codes} | ({"exponent": 60} if exponent is None else {})
    verify(
        unit,
        {"normal_left": left, "normal_right": right},
        lit @ (1 << np.arange(lights)),
        constants=constants,
    )
    cost = cost_of(unit)
    assert cost.multiplier_count == -(-(3 + 12 * lights) // interval)
    assert cost.rom_bits == (1024 * 17 if exponent is None else 0)


def test_exponents_out_of_range_are_refused():
    for exponent in (0, 1001):
        with pytest.raises(ValueError, match=rf"^exponent must be 1 to 1000, not {exponent}$"):
            HighlightGateUnit(exponent=exponent)
