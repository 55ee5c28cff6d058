"""Pixels a cycle of several pipelines: what is measured, the table, and the targets."""

import json
from dataclasses import replace

import pytest

from blysk.bench.report import several_pipelines as report
from blysk.bench.speed import pipes
from blysk.bench.speed.pipes import Rate, main, measure, missed, table, times

ONE = Rate("ring", 324, 1, 100, 800, 1000, True)
FOUR = replace(ONE, pipes=4, cycles=260)


def test_table_and_targets():
    assert times([ONE, FOUR], FOUR) == 1000 / 260
    assert table([ONE, FOUR]).splitlines() == [
        "| mesh | triangles | pixels a span | N = 1 | N = 4 |",
        "|---|---:|---:|---:|---:|",
        "| ring | 324 | 8.00 | 0.800 (1.00x) | 3.077 (3.85x) |",
    ]
    assert missed([ONE, FOUR]) == []
    slow = replace(FOUR, cycles=300)
    assert missed([ONE, slow]) == ["ring: 3.33 times with 4 pipelines, not 3.6"]
    # Of spans of fewer pixels nobody can ask for that.
    short = [replace(rate, spans=400) for rate in (ONE, slow)]
    assert missed(short) == []
    assert missed([replace(ONE, same=False)]) == ["ring, 1 pipelines: the picture is another"]


@pytest.mark.long
@pytest.mark.parametrize(("method", "size"), [("linear", (64, 48)), ("quotient", (240, 180))])
def test_measured_is_simulated(method, size):
    """Two pipelines halve the cycles of long spans, and draw the same picture."""
    one, two = (next(measure(n, ["ring"], *size, method)) for n in (1, 2))
    assert one.same
    assert two.same
    assert (one.pixels, one.spans, one.triangles) == (two.pixels, two.spans, 324)
    assert 1.7 < times([one, two], two) <= 2


def test_command(monkeypatch, capsys):
    monkeypatch.setattr(pipes, "measure", lambda count, *_: iter([{1: ONE, 4: FOUR}[count]]))
    assert main(["--pipes", "1", "4"]) == 0
    assert capsys.readouterr().out == table([ONE, FOUR]) + "\n"
    assert main(["--pipes", "1", "4", "--json"]) == 0
    assert [rate["pixels_a_cycle"] for rate in json.loads(capsys.readouterr().out)] == [0.8, 800 / 260]
    monkeypatch.setattr(pipes, "measure", lambda count, *_: iter([replace(ONE, same=False)]))
    assert main(["--pipes", "1"]) == 1
    assert "another" in capsys.readouterr().err


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
