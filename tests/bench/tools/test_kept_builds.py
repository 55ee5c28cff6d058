"""What an interrupted build has done is kept, and what a long step tells."""

import pytest

from blysk.bench.tools import board_build, tool_runner
from blysk.bench.tools.absorb_registers import Absorbed
from blysk.bench.tools.board_build import Clock, build
from blysk.bench.tools.kept_builds import KeptBuild
from blysk.bench.tools.tool_runner import GivenUp, ToolError, ToolRunner, Watch


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / "cache"))
    made = tmp_path / "work"
    made.mkdir()
    return made


def test_files_of_a_build(folder):
    (folder / "a").write_text("1")
    KeptBuild(["net", b"list"]).keep(folder, "a", "missing")
    (folder / "a").unlink()
    assert not KeptBuild(["netl", b"ist"]).take(folder, "a")
    assert not KeptBuild(["net", b"list"]).take(folder, "a", "missing")
    assert not (folder / "a").exists()
    assert KeptBuild(["net", b"list"]).take(folder, "a")
    assert (folder / "a").read_text() == "1"


def test_the_newest_builds_stay(folder):
    for number in range(KeptBuild.MOST + 3):
        KeptBuild([str(number)])
    assert len(list((folder.parent / "cache" / "builds").iterdir())) == KeptBuild.MOST


def test_a_build_that_was_replaced_meanwhile_keeps_what_it_has_done(folder):
    (folder / "a").write_text("1")
    slow = KeptBuild(["slow"])
    for number in range(KeptBuild.MOST):
        KeptBuild([str(number)])
    slow.keep(folder, "a")
    assert KeptBuild(["slow"]).take(folder, "a")


def test_temporary_files_of_a_killed_tool_go_with_its_folder(tmp_path):
    """A tool in a sandbox leaves a folder for each run that is killed."""
    code = "import os, tempfile; tempfile.mkdtemp(); os.kill(os.getpid(), 9)"
    with pytest.raises(ToolError):
        ToolRunner().run("tool", code, [], tmp_path)
    assert len(list(tmp_path.iterdir())) == 1


def test_a_watch_tells_the_last_round(monkeypatch):
    now, told = [100.0], []
    monkeypatch.setattr(tool_runner.time, "monotonic", lambda: now[0])
    watch = Watch("placement 2", told.append, lambda said: "stuck" if "iter=3" in said else "")
    log = "Info:     iter=1 wires=9 overused=41\nInfo:     iter=2 wires=9 overused=7\n"
    assert [watch(log), told] == ["", []]
    now[0] += 90
    assert [watch(log), told] == ["", ["placement 2: round 2, 7 wires used twice, 1:30 min"]]
    now[0] += 10
    assert [watch(f"{log}Info: iter=3"), len(told)] == ["stuck", 1]
    now[0] += 20
    watch("Info: overlap: COMB=69.2%, FF=64.6%\nInfo: overlap: COMB=5.0%, FF=64.6%\n")
    assert told.pop() == "placement 2: placer's round 2, 5.0 % overlap, 2:00 min"
    now[0] += 30
    watch("")
    assert told[1:] == ["placement 2: 2:30 min"]


class Platform:
    """A platform whose plan is a netlist, and whose board has room for it."""

    name, options, luts, block_rams, multipliers = "board", (), 1, 1, 1

    @property
    def files(self):
        return {"top.il": "netlist", "top.lpf": b"pins"}

    def make(self):
        return self

    def prepare(self, *arguments, **options):
        return self


def test_an_interrupted_build_goes_on(folder, monkeypatch):
    """Mapping, a placement that was given up and a routed placement are not repeated."""
    called, interrupts = [], [KeyboardInterrupt]

    def run(self, name, code, arguments, folder, text="", watch=None):
        called.append(name)
        if name == "Yosys":
            (folder / "netlist.json").write_text('{"modules": {"top": {"cells": {}, "ports": {}}}}')
        elif name == "ecppack" and interrupts:
            raise interrupts.pop()
        elif name == "nextpnr" and arguments[arguments.index("--seed") + 1] == "1":
            raise GivenUp("8 wires are used twice")
        elif name == "nextpnr":
            for ending in ("config", "json"):
                (folder / f"2.{ending}").write_text("{}")
        for file in ("top.bit", "again.bit", "back.config"):
            (folder / file).write_text("")

    monkeypatch.setattr(ToolRunner, "run", run)
    monkeypatch.setattr(board_build, "packages_missing", lambda: None)
    monkeypatch.setattr(board_build, "absorb_registers", lambda mapped: (mapped, Absorbed()))
    monkeypatch.setattr(board_build, "_clocks", lambda report, rates: (Clock("sync", 50, 60, ""),))
    monkeypatch.setattr(board_build, "_used", lambda report, kind: (0, 1))
    monkeypatch.setattr(board_build, "versions_of", lambda family: {})
    with pytest.raises(KeyboardInterrupt):
        build(Platform(), None, {"sync": 50}, seeds=2)
    assert called == ["Yosys", "nextpnr", "nextpnr", "ecppack"]
    called.clear()
    assert build(Platform(), None, {"sync": 50}, seeds=2).seed == 2
    assert called == ["ecppack", "ecpunpack", "ecppack"]
    called.clear()
    assert build(Platform(), None, {"sync": 40}, seeds=2).seed == 2
    assert called[0] == "Yosys"
