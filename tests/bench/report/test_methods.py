"""The section on methods: its designs, and its rows from made-up frames and the store of placements."""

import pytest

from blysk.bench.report import points
from blysk.bench.report.frames import frames, hardware
from blysk.bench.report.methods import COLUMNS, section, tasks
from blysk.bench.report.section import Table
from blysk.golden.presets import METHODS
from blysk.sim.api.placed import read_store


@pytest.mark.parametrize("quick", [True, False])
def test_every_method_has_its_documented_form_and_its_best_form(quick):
    chosen = [task.settings for task in tasks(quick) if task.function is frames]
    found = [(of["method"], of["model"], of.get("operand")) for of in chosen]
    best = {
        (method, "blinn", "one_minus_cosine" if of.operand == "cosine" else None)
        for method, of in METHODS.items()
    }
    documented = {(method, model, None) for method, model in points.DESIGNS if model == "cosquad"}
    documented = {of for of in documented if of[0] in METHODS}
    assert len(documented) > 5
    assert len(found) == len(set(found))
    assert set(found) == best | documented | {("quotient", "phong", None)}
    assert all(of["exponents"] == [100] for of in chosen)
    assert len(tasks(quick)) == 2 * len(found)


def test_a_quick_report_measures_nothing_twice():
    keys = {task.key for task in points.tasks(True)}
    assert keys >= {task.key for task in tasks(True)}


def made_up(task, error, cycles):
    """Result of a task."""
    settings = task.settings
    if task.function is hardware:
        return {"multipliers": 16, "cells": 1, "register_bits": 1, "memory_bits": 1, "latency": 40}
    names = {name: settings[name] for name in ("method", "model", "operand") if name in settings}
    view = settings["view"] | {"engine": "cxxrtl", "exponent": 100, "ambient": 0, "diffuse": 1, "specular": 0}
    frame = dict.fromkeys(("shown", "spans", "out_of_range_spans"), 1)
    frame |= {"pixels": 1000, "cycles": cycles, "settings": view | names}
    frame |= {"verdicts": {}, "border": {}, "pictures": {}, "errors": {"method_max_lsb": error}}
    return [frame]


def test_rows():
    """The smallest error is first. Parts are those of a placed design with the same operand and interval."""
    chosen = tasks(True)
    results = [made_up(task, 1 - k / 100, 1000 + k) for k, task in enumerate(chosen)]
    found = section(chosen, results)
    rows = found.figures["rows"]
    assert [row["error"] for row in rows] == sorted(row["error"] for row in rows)
    assert found.figures["scene"] == {"triangles": 992, "size": "160x120", "exponent": 100}
    named = {(row["method"], row["model"]): row for row in rows}
    assert len(named) == len(rows) == len(chosen) // 2
    own = named["quotient", "blinn"]
    assert (own["operand"], own["seeds"], own["multipliers"]) == ("place", 3, 16)
    luts = {entry["design"]: entry["luts"] for entry in read_store()}
    assert named["linear", "cosquad"]["luts"] == luts["pipeline linear, cosquad, 1 light"]
    assert named["linear", "blinn"]["luts"] == luts["pipeline linear, blinn, 1 light, one_minus_cosine"]
    # It was placed with another setup interval than the report has.
    other = named["renormalise", "cosquad"]
    assert [other[name] for name in ("operand", "luts", "mhz", "seeds")] == ["one_minus_cosine", *[None] * 3]
    (table,) = (part for part in found.parts if isinstance(part, Table))
    assert table.rows[0] == [rows[0][name] for name in COLUMNS]
