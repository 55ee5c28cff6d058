"""Ways in software against float64 mathematics, counts by hand, and the tables against the results."""

import json
import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from amaranth.hdl import Fragment

from blysk.bench.accuracy import scene_for
from blysk.bench.report import thesis, thesis_figures, thesis_ways
from blysk.bench.report.errata import FACTOR_PUBLISHED, ROOT_PUBLISHED
from blysk.bench.report.thesis import section, tasks
from blysk.bench.report.thesis_figures import (
    UNITS,
    _entry,
    clock_rate,
    fastest,
    frame_cycles,
    hardware,
    prices,
    shading_share,
    software,
    square_errors,
)
from blysk.bench.report.thesis_ways import CLAIMS, SPANS, WAYS, Counted
from blysk.bench.speed.renderer import Timing
from blysk.bench.tools.tool_runner import TooLarge
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.renderer import render
from blysk.sim.installation import install_extra
from blysk.sim.meshes.teapot import teapot

LEFT, RIGHT, VECTORS = thesis_ways.random_operands()
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
    """As long as the published polynomial makes it, in the right direction."""
    (found,) = results("middle by h(r)", 1)
    length = np.polynomial.polynomial.polyval(COSINE, FACTOR_PUBLISHED) * np.sqrt(2 + 2 * COSINE)
    np.testing.assert_allclose(found, curve("slerp", [0.5])[0] * length, atol=1e-14)


@pytest.mark.parametrize("way", ["bisection, a factor each", "bisection, a factor a level"])
def test_bisection_by_the_polynomial(way):
    """The first middle has the polynomial's length, by z; the others point along the circle, nearly."""
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
    """By hand: what a middle normal takes, and what a long span's pixel takes without its setup."""
    middle = software("middle by h(r)", "middle, normalised, one division", 1, 1)
    assert middle["baseline_operations"] == {"multiplications": 6, "additions": 5, "divisions": 1, "roots": 1}
    # Sum 3, dot product 3 and 2, cubic 3 and 3, scaling 3.
    assert middle["operations"] == {"multiplications": 9, "additions": 8}
    long = software("forward differences", "line, normalised, three divisions", 256, 1)
    assert long["operations"]["additions"] == pytest.approx(6, abs=0.2)
    assert long["operations"]["multiplications"] == pytest.approx(0, abs=0.2)
    assert "roots" not in long["operations"]
    turns = software("recurrence", "a cosine of each angle", 256, 1)
    assert turns["operations"]["multiplications"] == pytest.approx(2, abs=0.1)
    assert turns["baseline_operations"]["functions"] == pytest.approx(2, abs=0.1)
    assert turns["difference"] < 1e-10
    for result in (middle, long, turns):
        assert 0 < result["ratio"] < math.inf


def test_fastest_runs_in_turn(monkeypatch):
    """The least processor time of each, whatever the clock says."""
    order, cpu = [], iter([3.0, 20.0, 2.0, 30.0, 4.0, 10.0])

    def timed(action, repeats):
        return Timing(99.0, next(cpu)), action()

    monkeypatch.setattr(thesis_figures, "timed", timed)
    assert fastest([lambda: order.append("a"), lambda: order.append("b")], 3) == [2.0, 10.0]
    assert order == ["a", "b"] * 3


def test_prices():
    found = prices(2)
    assert list(found) == ["a division", "a root", "a cosine"]
    assert min(found.values()) > 0


@pytest.mark.long
def test_hardware():
    """The direct renormaliser gives a normal a cycle and has 8 multipliers."""
    found = hardware("renormaliser")
    assert (found["interval"], found["multipliers"]) == (1, 8)
    found = hardware("forward differences")
    assert (found["interval"], found["multipliers"]) == (1, 0)
    assert found["cells"] > 0
    # Three components, each a sum and a difference of 44 bits at least.
    assert found["register_bits"] >= 3 * 2 * 44


@pytest.mark.long
def test_frame_cycles():
    """A pixel a cycle at most, and spans of one pixel four cycles at most."""
    assert 1 < frame_cycles("renormalise interpolator", 500, 64, 48) < 5


def test_units_are_in_the_table():
    for name in UNITS:
        assert (_entry(name).record.name, _entry(name).name) == UNITS[name]
    for claim in CLAIMS:
        assert {*claim.units, *claim.baseline_units} <= UNITS.keys()
        assert {*claim.ways, *claim.baselines} <= WAYS.keys()


def test_without_place_and_route(monkeypatch):
    found = clock_rate("forward differences", 1, {"pyosys": None})
    assert found["fmax"] is None
    assert install_extra("fpga") in found["reason"]

    def refused(name, unit, seeds):
        # A unit that nothing elaborates gives a warning.
        Fragment.get(unit, None)
        raise TooLarge("does not fit")

    monkeypatch.setattr(thesis_figures, "lay_out", refused)
    assert clock_rate("forward differences", 1, {"pyosys": "1"}) == {"fmax": None, "reason": "does not fit"}


def test_shading_share():
    found = shading_share(100, 64, 48, 1)
    assert 0 < found["gouraud"] < 1
    assert 0 < found["phong"] < 1
    scene = scene_for(teapot(100), 50, 64, 48)
    assert found["triangles"] == len(scene.mesh.faces)
    assert found["pixels"] == render(scene).mask.sum()


def test_square_errors():
    """By the definitions, on the same reference: what 1 LSB in one value gives, at most and at least."""
    scene = scene_for(teapot(200), 50, 96, 72)
    frame = render(scene)
    reference = frame.image[frame.mask].ravel() * 255
    distance = (reference - reference.mean()) ** 2
    linear, renormalised = (square_errors(method, 200, 96, 72) for method in ("linear", "renormalise"))
    for found in (linear, renormalised):
        assert found["worst"] == pytest.approx(1 / distance.min() / len(reference), rel=1e-6)
        assert found["least"] == pytest.approx(1 / distance.max() / len(reference), rel=1e-6)
        assert found["one"] == pytest.approx(1 / distance.sum(), rel=1e-6)
        assert 0.01 < found["nearest"] <= 1
        assert found["p999_lsb"] <= found["max_lsb"]
        # Errors of that many LSB at most, over the spread of the reference.
        assert 0 < found["nmse"] <= found["max_lsb"] ** 2 / distance.mean()
        assert found["defined"] <= 1
    assert linear["nmse"] > renormalised["nmse"]


@pytest.fixture(scope="module")
def made():
    """The quick section, of fewer units and smaller frames."""
    chosen = []
    for task in tasks(quick=True):
        settings = dict(task.settings)
        if "repeats" in settings:
            settings["repeats"] = 1
        if "width" in settings:
            settings |= {"triangles": 100, "width": 48, "height": 36}
        if settings.get("name") in (None, "renormaliser", "forward differences"):
            chosen.append(replace(task, settings=settings))
    found = [json.loads(json.dumps(task.run())) for task in chosen]
    return chosen, found, section(chosen, found)


@pytest.mark.long
def test_software_table(made):
    chosen, found, whole = made
    by_name = {part.name: part for part in whole.parts}
    table = by_name["thesis-software"]
    speeds = [result for task, result in zip(chosen, found, strict=True) if task.function is software]
    assert len(table.rows) == len(speeds)
    published = {claim.name: claim.published for claim in CLAIMS}
    assert sorted(published.values()) == [1.7, 2.4, 2.5, 3.6]
    for row, grades, result in zip(table.records(), table.grades, speeds, strict=True):
        assert row["measured ratio"] == result["ratio"]
        assert row["published ratio"] == published[row["claim"]]
        assert row["reaches it"] == (result["ratio"] >= row["published ratio"])
        good, fair = result["ratio"] >= row["published ratio"], result["ratio"] > 1
        assert grades[6] == ("good" if good else "fair" if fair else "bad")
    for claim in CLAIMS:
        ratios = [row["measured ratio"] for row in table.records() if row["claim"] == claim.name]
        assert f"measured {min(ratios):.2f} to {max(ratios):.2f}" in whole.text[0]


@pytest.mark.long
def test_price_of_a_root(made):
    """With roots and divisions at that price the counts give the published ratio."""
    for task, result in zip(*made[:2], strict=True):
        if task.function is not software:
            continue
        claim = thesis._CLAIM_OF[task.settings["way"], task.settings["baseline"]]
        price = thesis._price(claim.published, result)
        costs = [
            sum(
                count * (1 if kind in ("multiplications", "additions") else price)
                for kind, count in of.items()
            )
            for of in (result["operations"], result["baseline_operations"])
        ]
        if price > 0:
            assert costs[1] / costs[0] == pytest.approx(claim.published)
        else:
            assert costs[1] / costs[0] >= claim.published


@pytest.mark.long
def test_hardware_tables(made):
    by_name = {part.name: part for part in made[2].parts}
    units = {row["unit"]: row for row in by_name["thesis-units"].records()}
    assert units.keys() == {"renormaliser", "forward differences"}
    (row,) = by_name["thesis-hardware"].records()
    assert row["cycles a result"] == 1
    # A unit without multipliers has no ratio.
    assert row["multipliers"] is None
    assert row["cells"] == units["renormaliser"]["cells"] / units["forward differences"]["cells"]
    assert "place and route" in by_name["thesis-units"].note


def test_ratios_of_interpolators():
    """The baseline's cycles a pixel over the unit's; no figure without both."""
    one = {"interval": 1, "multipliers": 2, "cells": 3, "register_bits": 4}
    units = {
        "quadratic interpolator": {**one, "frame": 2.0},
        "bisection interpolator": {**one, "frame": None},
        "renormalise interpolator": {**one, "frame": 1.5},
    }
    rates = {name: {"fmax": fmax} for name, fmax in zip(units, (90.0, None, 120.0), strict=True)}
    rows = {row["unit"]: row for row in thesis._ratios_table(units, rates).records()}
    assert rows["quadratic interpolator"]["cycles a pixel of a frame"] == 0.75
    assert rows["quadratic interpolator"]["Fmax (unit over baseline)"] == 0.75
    assert rows["bisection interpolator"]["cycles a pixel of a frame"] is None
    assert rows["bisection interpolator"]["Fmax (unit over baseline)"] is None


def test_where_a_claim_is_reached():
    """Nowhere, everywhere, or against whom and on which spans."""
    claim = CLAIMS[2]

    def told(*ratios):
        results = [
            (
                {"way": claim.ways[0], "baseline": baseline, "pixels": pixels},
                {"ratio": ratio, "operations": {}, "baseline_operations": {"roots": 1}, "difference": 0},
            )
            for (baseline, pixels), ratio in zip(
                [(baseline, pixels) for baseline in claim.baselines for pixels in (8, 64)],
                ratios,
                strict=True,
            )
        ]
        return thesis._reached(claim, thesis._software_table(results))

    assert told(1, 2, 3, 3.5).endswith("measured 1.00 to 3.50, reached nowhere.")
    assert told(4, 4, 4, 4).endswith("reached everywhere.")
    assert told(1, 4, 3, 3.5).endswith(
        "reached in 1 of 4 comparisons: against line, normalised, three divisions, on spans of 64 pixels."
    )


def test_a_turned_order_is_told():
    def squares(*rows):
        return thesis._squares_table(
            [
                ({"method": name}, {"published": p, "defined": 1, "nmse": n, "max_lsb": 9, "p999_lsb": 8})
                for name, p, n in rows
            ]
        )

    assert "same order" in thesis._turned(squares(("a", 0.1, 0.1), ("b", 0.2, 0.2)))
    assert "puts `b` (0.1) before `a` (0.2)" in thesis._turned(squares(("a", 0.2, 0.1), ("b", 0.1, 0.2)))


def test_tasks():
    """Whatever measures a time does so by itself."""
    for quick in (True, False):
        chosen = tasks(quick)
        assert {task.function for task in chosen if task.timed} == {software, prices, shading_share}
    full = {task.function for task in tasks(quick=False)}
    assert {clock_rate, frame_cycles, hardware} < full
