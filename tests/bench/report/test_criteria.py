"""The documents' criteria: frames by the cycle model, bad input through the command line, the table."""

import json

from blysk.bench.report import energy
from blysk.bench.report.criteria import section, tasks
from blysk.bench.report.criteria_figures import BAD_INPUT, frame, refused, resources, simulated
from blysk.bench.store import Task
from blysk.golden.presets import METHODS

COUNTED = {"multipliers": 17, "register_bits": 5000, "cells": 900, "memory_bits": 0}


def test_frame():
    found = frame(100, (64, 48), ["quotient", "linear"])
    assert set(found) == {"triangles", "quotient", "linear"}
    for method in ("quotient", "linear"):
        of = found[method]
        assert of["cycles"] >= of["pixels"] + of["latency"]
        assert of["spans"] >= of["uncut_spans"]


def test_bad_input_is_one_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = refused()
    assert [of["what"] for of in found] == [what for what, _ in BAD_INPUT]
    assert all(of["status"] == 2 and of["lines"] == 1 and not of["traceback"] for of in found)
    assert list(tmp_path.iterdir()) == []


def test_section():
    made_up = {"cycles": 7000, "pixels": 6000, "spans": 900, "uncut_spans": 800, "latency": 50}
    results = []
    chosen = tasks(quick=True)
    for task in chosen:
        if task.function is frame:
            settings = task.settings
            results.append(
                {"triangles": settings["triangles"], **dict.fromkeys(settings["methods"], made_up)}
            )
        elif task.function is simulated:
            results.append(
                {"simulated": 1000, "modelled": 1000 + 10 * (task.settings["method"] == "quotient")}
            )
        elif task.function is resources:
            results.append(COUNTED)
        elif task.function is energy.measure:
            results.append([{"toggles": {"a": 100, "b": 50}, "pixels": 50}])
        else:
            results.append([{"what": "this", "status": 2, "lines": 1, "traceback": False}])
    made = section(chosen, json.loads(json.dumps(results)))
    table, drawing, by_triangles, deviations = made.parts
    rows = {row["criterion"]: row for row in table.records()}
    assert rows["energy proxy of a pixel"]["figure"] == 3
    assert rows["bad input"]["figure"] is None
    assert rows["scaling with pixels"]["figure"] == 1
    assert "frames a second" in rows
    assert f"{len(METHODS) - 1} of {len(METHODS)} methods" in made.text[1]
    assert "+1.0%" in made.text[1]
    assert len(deviations.rows) == len(METHODS)
    assert drawing.svg.count("<path") > len(METHODS)
    assert by_triangles.rows
    assert all(isinstance(task, Task) for task in chosen)
