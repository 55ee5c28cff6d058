"""Pixels a cycle of several pipelines: what is measured, and the table of the report."""

from dataclasses import replace

import pytest

from blysk.bench.report import several_pipelines as report
from blysk.bench.speed.pipes import Rate, measure, times

ONE = Rate("ring", 324, 1, 100, 800, 1000, True)


@pytest.mark.long
@pytest.mark.parametrize(("method", "size"), [("linear", (64, 48)), ("quotient", (240, 180))])
def test_measured_is_simulated(method, size):
    """Two pipelines halve the cycles of long spans, and draw the same picture."""
    one, two = (next(measure(n, ["ring"], *size, method)) for n in (1, 2))
    assert one.same
    assert two.same
    assert (one.pixels, one.spans, one.triangles) == (two.pixels, two.spans, 324)
    assert 1.7 < times([one, two], two) <= 2


@pytest.mark.parametrize("quick", [True, False])
def test_section(quick):
    tasks = report.tasks(quick)
    rates = [
        [vars(replace(ONE, mesh=mesh, pipes=task.settings["count"])) for mesh in task.settings["meshes"]]
        for task in tasks
    ]
    made = report.section(tasks, rates)
    (part,) = made.parts
    assert len(part.rows) == len(tasks) * len(tasks[0].settings["meshes"])
    assert f"{len(part.rows)} of {len(part.rows)} pictures" in made.text[0]
