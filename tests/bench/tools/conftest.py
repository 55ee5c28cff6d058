"""Stubs of the tools of place and route."""

import json

import pytest

from blysk.bench.tools import fpga, place_and_route

from .stubs import NEXUS_REPORT, REPORT, netlist


class Calls(list):
    """The tools that were called, each with its last argument; and the cells that Yosys finds, with all
    arguments."""

    cells = (("TRELLIS_FF", {}, 3, 4),)
    arguments = ()


@pytest.fixture
def calls(monkeypatch):
    """Stubs of the tools, which write the same files and note their calls."""
    calls = Calls()

    def run(self, name, code, arguments, folder, text="", watch=None):
        calls.append((name, *arguments[-1:]))
        calls.arguments = arguments
        if name == "Yosys":
            (folder / "netlist.json").write_text(json.dumps(netlist(*calls.cells)))
        else:
            seed = int(arguments[-1])
            report = {
                **REPORT,
                "fmax": {"clk": {"achieved": 100.0 + seed}},
                "utilization": REPORT["utilization"] | NEXUS_REPORT["utilization"],
            }
            (folder / f"{seed}.json").write_text(json.dumps(report))

    monkeypatch.setattr(place_and_route.ToolRunner, "run", run)
    for module in (fpga, place_and_route):
        monkeypatch.setattr(module, "versions_of", lambda family: {"pyosys": "1", family.package: "2"})
    return calls


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "fpga"
