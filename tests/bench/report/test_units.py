"""The report's table of units: the lines of ``blysk blocks``."""

import pytest

from blysk.bench.report.units import QUICK_SAMPLES, measure, section, tasks
from blysk.bench.tools.blocks import ENTRIES, entry_of, row_of, sample_of


def names(tasks):
    return [(task.settings["unit"], task.settings["variant"]) for task in tasks]


def test_a_line_is_that_of_the_table_of_units():
    entry = entry_of("specular", "cosquad")
    line = measure("specular", "cosquad", 2000)
    expected = row_of(entry, sample_of(entry, 2000)).as_dict()
    assert {**line, "samples": expected["samples"]} == expected


def test_every_unit_is_measured():
    assert names(tasks(False)) == [(entry.record.name, entry.name) for entry in ENTRIES]
    quick = tasks(True)
    assert {task.settings["samples"] for task in quick} == {QUICK_SAMPLES}
    assert ("middle_normal", "as_published") in names(quick)


@pytest.mark.long
def test_section():
    lines = [("dot_product", ""), ("middle_normal", "exact"), ("middle_normal", "as_published")]
    chosen = [task for task in tasks(True) if names([task])[0] in lines]
    results = [measure(*pair, 1000) for pair in names(chosen)]
    found = section(chosen, results)
    (table,) = found.parts
    lines = table.records()
    assert [line["as published"] for line in lines] == [False, False, True]
    assert [line["total error"] for line in lines] == [result["total_error"] for result in results]
    # What is published is worse by far.
    assert lines[0]["total error"] == 0
    assert lines[2]["total error"] > 100 * lines[1]["total error"]
    assert lines[0]["multipliers"] == "3 of 18x18"
    assert any("3 of the" in paragraph for paragraph in found.text)
