# amaranth: UnusedElaboratable=no
"""Stiff and extreme cases: in each, every method keeps the promises of its documentation."""

import dataclasses
import json
from functools import lru_cache

import numpy as np
import pytest

from blysk.bench.report.section import Drawing, Table
from blysk.bench.report.stability import section, tasks
from blysk.bench.report.stability_cases import (
    ANGLES,
    EXPONENTS,
    GROUPS,
    LENGTHS,
    Case,
    arcs,
    cases_of,
)
from blysk.bench.report.stability_conclusion import conclusion
from blysk.bench.report.stability_errors import (
    GOOD,
    RANGE_EXPONENTS,
    SWEEP,
    grade_of,
    measure,
    measure_case,
    measure_ranges,
)
from blysk.bench.store import Task
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.cut import split_pairs
from blysk.golden.number.unit_vector import quantise
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import shade_spans

QUICK = ("quotient", "chord-local")
NAMES = [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in METHODS]


@lru_cache(maxsize=1)
def cases(group: int) -> list[Case]:
    return list(cases_of(group))


@pytest.mark.parametrize("method", NAMES)
@pytest.mark.parametrize("group", GROUPS)
def test_keeps_what_is_promised(group, method):
    """No error is silent: neither in spans that are cut, nor in the safe range of spans that are not cut."""
    for case in cases(group):
        found = measure_case(case, method)
        assert found["given"]["safe_grade"] != "bad", case.name
        if found["inside"]:
            assert found["given"]["safe_grade"] in ("good", "fair")
        if case.codes is not None:
            assert found["prepared"] is None
            continue
        prepared = found["prepared"]
        assert prepared["grade"] in ("good", "fair"), case.name
        assert prepared["flagged"] == 0, case.name
        # The local chord method states less than 1 LSB for every exponent. The quotient is exact.
        if method in ("chord-local", "quotient"):
            assert prepared["error"] <= GOOD, case.name


def test_what_is_cut_before_is_not_served():
    """For renormalise lengths count, and no angle. A line to a normal of 0 has no length at one end."""
    [case] = [case for case in cases(6) if case.name == "one normal 0"]
    found = measure_case(case, "renormalise")
    assert (found["inside"], found["cut"]) == (0, found["spans"])
    assert (found["given"]["flagged"], found["given"]["safe"]) == (found["spans"], 0)


def test_quotient_is_given_pairs_as_two():
    """The step of a span of two pixels may not fit. Longer spans and single pixels are unchanged."""
    [case] = [case for case in cases(1) if case.name == "exponent 100"]
    raster = case.raster
    split = split_pairs(raster)
    pairs = int(np.count_nonzero(raster.length == 2))
    assert pairs > 0
    assert len(split.length) == len(raster.length) + pairs == measure_case(case, "quotient")["spans"]
    assert measure_case(case, "renormalise")["spans"] == len(raster.length)
    assert not np.any(split.length == 2)
    np.testing.assert_array_equal(
        np.sort(split.length[split.length > 2]), np.sort(raster.length[raster.length > 2])
    )
    np.testing.assert_array_equal(split.pixel, raster.pixel)


@pytest.mark.parametrize("places", [slice(None), slice(0, 1)])
def test_an_error_that_nothing_tells_of_is_bad(places, monkeypatch):
    """The error is a step more than the worst of a frame may be, in one pixel or in all."""
    [case] = [case for case in cases(1) if case.name == "exponent 10"]
    compute = ShadingPipeline.compute
    right = measure_case(case, "renormalise")
    assert right["prepared"]["grade"] == "good"

    def brighter(self, spans, constants):
        pixels = compute(self, spans, constants)
        color = pixels.color.astype(int)
        color[places] += np.where(color[places] < 128, 2, -2)
        return dataclasses.replace(pixels, color=color)

    monkeypatch.setattr(ShadingPipeline, "compute", brighter)
    found = measure_case(case, "renormalise")
    for way in ("given", "prepared"):
        assert found[way]["grade"] == "bad"
        assert 1.4 < found[way]["error"] <= right[way]["error"] + 2


def test_error_is_that_of_the_pictures():
    """The error is compared with the golden renderer's picture of the spans, without pixels at the
    terminator."""
    [case] = [case for case in cases(1) if case.name == "exponent 100"]
    raster, design = case.raster, preset("quadratic", "cosquad")
    spans = Spans(
        raster.x, raster.y, raster.length, quantise(raster.normal_left), quantise(raster.normal_right)
    )
    pixels = design.compute(spans, FrameConstants.of(case.scene))
    picture = shade_spans(case.scene, raster, "normalised", REFLECTION_MODELS["cosquad"]) * 255
    error = np.abs(pixels.color - picture[pixels.y, pixels.x]).max()
    assert measure_case(case, "quadratic")["given"]["error"] == pytest.approx(error, abs=1e-9)


def test_wide_spans_are_told():
    """Of spans over the widest, some are flagged and some are not.

    An error that is not flagged is silent, unless it is small.
    """
    by_angle = {case.name: measure_case(case, "linear")["given"] for case in cases(2)}
    out_of_range = by_angle["90 degrees"]
    assert out_of_range["grade"] == "bad"
    assert 0 < out_of_range["flagged"] < 60
    assert 100 < out_of_range["silent"] <= out_of_range["error"]
    assert (by_angle["120 degrees"]["grade"], by_angle["120 degrees"]["flagged"]) == ("fair", 60)
    assert by_angle["0 degrees"]["grade"] == "good"


def test_every_case_is_there():
    names = [case.name for group in GROUPS for case in cases(group)]
    assert len(set(names)) == len(names)
    for texts in (
        [f"exponent {n}" for n in EXPONENTS],
        [f"{angle:g} degrees" for angle in ANGLES],
        [f"{m} pixels" for m in LENGTHS if m > 1],
        ["between two pixels", "L = V", "light behind", "both normals 0", "through the near plane"],
    ):
        assert set(texts) <= set(names)
    for group in GROUPS:
        # The same spans again, and every pixel is once in the picture with which they are compared.
        for case, again in zip(cases(group), cases_of(group), strict=True):
            np.testing.assert_array_equal(case.raster.normal_right, again.raster.normal_right)
            shown = case.raster.pixel[case.raster.visible]
            assert case.group == group
            assert 0 < len(np.unique(shown)) == len(shown)
    # Along the shared edge no pixel is drawn twice, and none is missing.
    [shared] = [case for case in cases(9) if "share an edge" in case.name]
    pixels = np.zeros(64 * 64, dtype=int)
    np.add.at(pixels, shared.raster.pixel, 1)
    rows = pixels.reshape(64, 64)
    assert pixels.max() == 1
    assert all(np.count_nonzero(np.diff(np.r_[0, row, 0])) in (0, 2) for row in rows)
    with pytest.raises(ValueError, match="there is no group 10"):
        list(cases_of(10))


def test_arcs():
    rng = np.random.default_rng(1)
    centre = np.array([0.0, 0.6, 0.8])
    degrees, at, off = rng.uniform(0, 180, 50), rng.uniform(-1, 2, 50), rng.uniform(0, 40, 50)
    left, right = arcs(rng, centre, degrees, at, off)
    np.testing.assert_allclose(np.linalg.norm([left, right], axis=2), 1)
    np.testing.assert_allclose(np.degrees(np.arccos((left * right).sum(axis=1))), degrees, atol=1e-5)
    # On the circle through both ends the cosine to the centre is largest at the share.
    expected = np.cos(np.radians(off)) * np.cos(np.radians(at * degrees))
    np.testing.assert_allclose(left @ centre, expected, atol=1e-12)
    expected = np.cos(np.radians(off)) * np.cos(np.radians((1 - at) * degrees))
    np.testing.assert_allclose(right @ centre, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("grades", "worst"),
    [((), ""), (("good", ""), "good"), (("good", "fair"), "fair"), (("fair", "bad", "good"), "bad")],
)
def test_worst_grade(grades, worst):
    assert grade_of(grades) == worst


@pytest.mark.parametrize(
    "method",
    [
        name if name in ("linear", "renormalise", "quotient") else pytest.param(name, marks=pytest.mark.long)
        for name in METHODS
    ],
)
def test_ranges(method):
    """Spans are flagged where the docstrings say so, and every range is good or fair to its end."""
    found = measure_ranges(method)
    interpolator = METHODS[method]
    if interpolator.CURVE == "linear":
        # A component of N_r - N_l is over 1.
        assert found["none_flagged"] >= 60
        assert found["all_flagged"] > interpolator.MAX_ANGLE
    elif method != "chord-local":
        # A line through 0, or the method's widest span.
        last = {"renormalise": 179, "quotient": 179}.get(method, interpolator.MAX_ANGLE)
        assert found["none_flagged"] == int(last)
        assert found["all_flagged"] == found["none_flagged"] + 1
    assert list(found["widest"]) == [str(exponent) for exponent in RANGE_EXPONENTS]
    assert all(0 < angle <= interpolator.MAX_ANGLE for angle in found["widest"].values())
    inside, *outside = found["outside"]
    assert inside["given"]["grade"] in ("good", "fair")
    assert outside or method == "renormalise"
    for of in (inside, *outside):
        assert of["prepared"]["grade"] in ("good", "fair")
        assert of["prepared"]["flagged"] == 0


@pytest.mark.long
def test_section():
    """Made from measurements of the method, which pass through JSON as from the cache."""
    chosen = [task for task in tasks(quick=True) if task.settings["method"] == "quotient"]
    assert [task.function for task in chosen] == [measure, measure_ranges]
    results = [json.loads(json.dumps(task.run())) for task in chosen]
    made = section(chosen, results)
    assert made.name == "stability"
    tables = {part.name: part for part in made.parts if isinstance(part, Table)}
    assert [part.name for part in made.parts if isinstance(part, Drawing)] == ["stability-angles"]
    for name in ("stability", "stability-as-given"):
        assert [row["group"] for row in tables[name].records()] == list(GROUPS)
    cells = zip(tables["stability"].records(), tables["stability"].grades, strict=True)
    for row, grades in cells:
        if row["group"] != 5:
            assert row["quotient"] <= GOOD
            assert grades[-1] == "good"
    # Colours follow the error. Marks tell which errors are stated and which are silent.
    cases_of_method = tables["stability-cases"]
    column = list(cases_of_method.columns).index("error cut, LSB")
    for row, grades, marks in zip(
        cases_of_method.rows, cases_of_method.grades, cases_of_method.marks, strict=True
    ):
        if row[column] is not None:
            assert (grades[column] == "good") == (row[column] <= GOOD)
            assert (marks[column] == "") == (row[column] <= GOOD)
    assert "`quotient`" in made.conclusion.sentence
    assert "silently wrong in" in made.conclusion.sentence
    assert len(tables["stability-cases"].rows) == sum(len(cases(group)) for group in GROUPS)
    [row] = tables["safe-ranges"].records()
    assert row["method"] == "quotient"
    # It halves spans from 90 degrees on. The search stops within 0.05 degrees.
    assert 89.95 <= row["widest span at n = 1, degrees"] <= 90
    errors = dict(zip(SWEEP, (of["given"]["error"] for of in results[1]["sweep"]), strict=True))
    up_to = row["angle up to which the error is at most 1 LSB, degrees"]
    assert max(error for angle, error in errors.items() if angle <= up_to) <= 1
    wider = [angle for angle in SWEEP if angle > up_to]
    assert not wider or errors[wider[0]] > 1


@pytest.mark.parametrize(
    ("error", "grade", "end"),
    [
        (0.9, "good", "a range is 0.9 LSB (`linear`, wide)."),
        (12.3, "fair", "The documentation of this method states an error of this size."),
        (12.3, "bad", "The documentation of this method states no error of this size."),
    ],
)
def test_conclusion_follows_the_grade_of_the_largest_error(error, grade, end):
    narrow = {"case": "narrow", "inside": 1, "prepared": {"silent": 0.5, "grade": "good"}}
    wide = {"case": "wide", "inside": 1, "prepared": {"silent": error, "grade": grade}}
    given = {"silent": 0.5, "safe": 0.5, "safe_grade": "good"}
    cases = {"linear": {"1": [narrow | {"given": given}, wide | {"given": given}]}}
    assert conclusion(cases, {}).sentence.endswith(end)


def test_tasks():
    full = tasks(quick=False)
    assert all(isinstance(task, Task) and not task.timed for task in full)
    assert {task.settings["method"] for task in full} == set(METHODS)
    quick = tasks(quick=True)
    assert {task.settings["method"] for task in quick} == set(METHODS)
