"""Ways in software against float64 mathematics and counts by hand; measurements of [T]'s claims."""

import math
from collections import Counter

import numpy as np
import pytest

from blysk.bench.accuracy import scene_for
from blysk.bench.report import counted as counting
from blysk.bench.report.counted import Counted, fastest
from blysk.bench.report.errata import FACTOR_PUBLISHED, ROOT_PUBLISHED
from blysk.bench.report.thesis import (
    SPEEDS,
    UNITS,
    hardware,
    shading_share,
    square_errors,
)
from blysk.bench.report.thesis_software import counted, price, prices, software
from blysk.bench.report.thesis_ways import SPANS, WAYS, random_operands
from blysk.bench.speed.renderer_times import Timing
from blysk.bench.tools.blocks import entry_of
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.renderer import render
from blysk.sim.meshes.teapot import teapot

LEFT, RIGHT, VECTORS = random_operands()
COSINE = (LEFT * RIGHT).sum(axis=0)


def results(way, pixels):
    return np.array(list(WAYS[way](LEFT, RIGHT, VECTORS, pixels)))


def curve(name, t):
    """Normals of a curve at places t, shape (places, 3, spans)."""
    return np.array([interpolate(name, LEFT.T, RIGHT.T, np.full(SPANS, place)).T for place in t])


def test_operands():
    for vectors in (LEFT, RIGHT, *VECTORS):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=0), 1, atol=1e-14)
    angles = np.degrees(np.arccos(COSINE))
    assert 0.09 < angles.min() < 1
    assert 44 < angles.max() <= 45.01


@pytest.mark.parametrize("kind", ["three divisions", "one division"])
def test_classical_ways(kind):
    t = np.arange(9) / 8
    lines = curve("normalised", t)
    np.testing.assert_allclose(results(f"line, normalised, {kind}", 9), lines, atol=1e-14)
    cosines = np.einsum("pis,vij->pvs", lines, VECTORS)
    np.testing.assert_allclose(results(f"line, normalised, {kind}, N·L and N·H", 9), cosines, atol=1e-14)
    np.testing.assert_allclose(results(f"middle, normalised, {kind}", 1), curve("slerp", [0.5]), atol=1e-14)
    circle = curve("slerp", np.arange(1, 16) / 16)
    np.testing.assert_allclose(results(f"bisection, normalised, {kind}", 16), circle, atol=1e-13)


@pytest.mark.parametrize("way", ["recurrence", "a cosine of each angle"])
def test_ways_by_angles(way):
    cosines = np.einsum("pis,vij->pvs", curve("slerp", np.arange(64) / 63), VECTORS)
    np.testing.assert_allclose(results(way, 64), cosines, atol=1e-10)


def test_middle_by_the_polynomial():
    """The middle has the length of the published polynomial, and the right direction."""
    (found,) = results("middle by h(r)", 1)
    length = np.polynomial.polynomial.polyval(COSINE, FACTOR_PUBLISHED) * np.sqrt(2 + 2 * COSINE)
    np.testing.assert_allclose(found, curve("slerp", [0.5])[0] * length, atol=1e-14)


@pytest.mark.parametrize("way", ["bisection, a factor each", "bisection, a factor a level"])
def test_bisection_by_the_polynomial(way):
    """The first middle has the polynomial's length, by z. The others nearly point along the circle."""
    found = results(way, 16)
    z = 2 * COSINE
    length = np.polynomial.polynomial.polyval(z, ROOT_PUBLISHED[2]) * np.sqrt(2 + z)
    np.testing.assert_allclose(np.linalg.norm(found[7], axis=0), length, atol=1e-14)
    # The published digits make each of the four levels up to 0.2 % shorter or longer.
    assert np.abs(found - curve("slerp", np.arange(1, 16) / 16)).max() < 4 * 0.0021


def test_forward_differences():
    """The quadratic through both ends and the polynomial's middle."""
    t = np.arange(65) / 64
    found = results("forward differences", 65)
    middle = results("middle by h(r)", 1)[0]
    at = t[:, np.newaxis, np.newaxis]
    # Lagrange's form, from 0, 1/2 and 1.
    quadratic = LEFT * (2 * at - 1) * (at - 1) + 4 * middle * at * (1 - at) + RIGHT * at * (2 * at - 1)
    np.testing.assert_allclose(found, quadratic, atol=1e-13)


def test_counted():
    counts = Counter()
    a = Counted.of(np.arange(1.0, 7).reshape(2, 3), counts)
    b = a[0] * 2 + 1
    result = -np.sqrt(np.stack([b, a[1]]) / 3)
    assert counts == {"multiplications": 3, "additions": 3 + 6, "divisions": 6, "roots": 6}
    np.testing.assert_array_equal(np.asarray(result), -np.sqrt(np.array([[3, 5, 7], [4, 5, 6]]) / 3))
    with pytest.raises(KeyError):
        np.tan(a)


def test_operations():
    """Counts by hand: the operations of a middle normal, and of a long span's pixel without its setup."""
    assert counted("middle, normalised, one division", 1) == {
        "multiplications": 6,
        "additions": 5,
        "divisions": 1,
        "roots": 1,
    }
    # Sum 3, dot product 3 and 2, cubic 3 and 3, scaling 3.
    assert counted("middle by h(r)", 1) == {"multiplications": 9, "additions": 8}
    long = counted("forward differences", 256)
    assert long["additions"] == pytest.approx(6, abs=0.2)
    assert long["multiplications"] == pytest.approx(0, abs=0.2)
    assert "roots" not in long
    assert counted("recurrence", 256)["multiplications"] == pytest.approx(2, abs=0.1)
    assert counted("a cosine of each angle", 256)["functions"] == pytest.approx(2, abs=0.1)


def test_software():
    turns = software("recurrence", "a cosine of each angle", 64, 1.7, 1)
    assert turns["difference"] < 1e-10
    assert 0 < turns["ratio"] < math.inf
    assert "functions 2." in turns["other"]


def test_price_of_a_root():
    """With this price of roots and divisions the counts give the printed ratio.

    If a way has more of them, no price does.
    """
    own, other = {"additions": 6.0, "divisions": 0.5}, {"multiplications": 7.0, "roots": 1.0, "divisions": 3}
    cost = price(3.6, own, other)
    assert (7 + 4 * cost) / (6 + 0.5 * cost) == pytest.approx(3.6)
    assert price(1.0, own, other) == 0
    assert price(2.0, other, own) is None


def test_fastest_runs_in_turn(monkeypatch):
    """The least processor time of each way counts, whatever the clock says."""
    order, cpu = [], iter([3.0, 20.0, 2.0, 30.0, 4.0, 10.0])

    def timed(action, repeats):
        return Timing(99.0, next(cpu)), action()

    monkeypatch.setattr(counting, "timed", timed)
    assert fastest([lambda: order.append("a"), lambda: order.append("b")], 3) == [2.0, 10.0]
    assert order == ["a", "b"] * 3


def test_prices():
    found = prices(2)
    assert list(found) == ["a division", "a root", "a cosine"]
    assert min(found.values()) > 0


@pytest.mark.long
def test_hardware():
    """The renormaliser gives a normal a cycle with 8 multipliers, and forward differences without
    multipliers."""
    found = hardware("forward differences", "renormaliser")
    assert found["interval"] == 1
    assert found["multipliers"] is None
    assert found["cells"] > 1
    found = hardware("renormaliser", "renormaliser")
    assert found == {"interval": 1, "multipliers": 1, "cells": 1, "register_bits": 1}


def test_units_are_in_the_table():
    for name in UNITS:
        entry = entry_of(*UNITS[name])
        assert (entry.record.name, entry.name) == UNITS[name]
    for speed in SPEEDS:
        assert {*speed.units} <= UNITS.keys()
        assert {*speed.ways, *speed.baselines} <= WAYS.keys()


def test_shading_share():
    found = shading_share(100, 64, 48, 1)
    assert 0 < found["gouraud"] < 1
    assert 0 < found["phong"] < 1


def test_square_errors():
    """By the definitions, for the same reference."""
    scene = scene_for(teapot(200), 50, 96, 72)
    frame = render(scene)
    reference = frame.image[frame.mask].ravel() * 255
    distance = (reference - reference.mean()) ** 2
    linear, renormalised = (square_errors(method, 200, 96, 72) for method in ("linear", "renormalise"))
    for found in (linear, renormalised):
        assert found["step"] == pytest.approx([distance.max() / distance.min(), 1], rel=1e-6)
        assert 0.01 < found["nearest"] <= 1
        assert found["p999_lsb"] <= found["max_lsb"]
        # Errors of at most this many LSB, divided by the spread of the reference.
        assert 0 < found["nmse"] <= found["max_lsb"] ** 2 / distance.mean()
        assert found["defined"] <= 1
    assert linear["nmse"] > renormalised["nmse"]
