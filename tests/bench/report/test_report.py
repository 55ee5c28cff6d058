"""The report: its page, its files, its command."""

import contextlib
import csv
import json
import os
import re
import sys
from concurrent.futures import Executor, Future

import pytest
from click.testing import CliRunner

from blysk.bench.cli.bench import command
from blysk.bench.lobe_errors import errors_of_size
from blysk.bench.report import frames, report, sections
from blysk.bench.report.page import AXES, environment, page, shown
from blysk.bench.report.report import about, check_folder, write_report
from blysk.bench.report.section import Section, Table
from blysk.bench.report.sections import SECTIONS, load
from blysk.bench.store import Task
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra

from ..reader import Reader

ABOUT = about(True, [], ["points"])


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (True, "yes"),
        (False, "no"),
        ("as it is", "as it is"),
        (9999, "9999"),
        (12345678, "12\u202f345\u202f678"),
        (0.0, "0"),
        (1.0, "1"),
        (0.123456, "0.1235"),
        (-0.123456, "−0.1235"),
        (1.2, "1.2"),
        (9.9999, "10"),
        (99.996, "100"),
        (123.456, "123.5"),
        (1234.5, "1234"),
        (123456.0, "123\u202f500"),
        (0.00123456, "0.001235"),
        (0.000123456, "1.235·10⁻⁴"),
        (4.2e9, "4.200·10⁹"),
        (float("inf"), "∞"),
        (float("nan"), "nan"),
    ],
)
def test_numbers_are_rounded(value, text):
    assert shown(value) == text


def test_page_has_everything(points_section, plain_section):
    text = page([points_section, plain_section], ABOUT)
    reader = Reader(text)
    assert len(reader.ids) == len(set(reader.ids))
    # The page contains everything except the files beside it.
    outside = {address for address in reader.addresses if not address.startswith(("data:", "#"))}
    assert outside == {"report.json", "points.csv", "front.csv", "fronts.csv", "graded.csv", "long.csv"}
    assert all(address[1:] in reader.ids for address in reader.addresses if address.startswith("#"))
    for section in (points_section, plain_section):
        for part in section.parts:
            if isinstance(part, Table):
                found = reader.tables[f"part-{part.name}"]
                assert found[0] == list(part.columns)
                plain = [[cell.lstrip("✓~✗ ") for cell in row] for row in found[1:]]
                assert plain == [[shown(cell) for cell in row] for row in part.rows]
    assert [row[1] for row in reader.tables["part-graded"]] == ["a, LSB", "✓ 0.25", "✗ –"]
    assert "<b>" not in text
    assert "&lt;b&gt;tag&lt;/b&gt;" in text
    assert "<em>text</em> with <code>code</code>" in text


def test_page_without_points(plain_section):
    text = page([plain_section], ABOUT)
    Reader(text)
    assert 'id="explorer"' not in text


def test_figures_cannot_end_their_script(points_section):
    figures = {**points_section.figures, "groups": [{"key": "own", "title": "</script><script>alert(1)"}]}
    section = Section("points", "Points", [], [], figures)
    text = page([section], ABOUT)
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1]
    assert json.loads(data)["figures"]["groups"] == figures["groups"]
    # Pictures are there once, and not among the figures.
    assert "data:" not in data


def test_every_axis_is_explained():
    for axis in frames.ERRORS:
        kind, figure = axis["key"].split("_", 1)
        assert {kind, figure} <= set(AXES)
    assert {axis["key"] for axis in frames.TIMES} <= set(AXES)
    assert all(text.endswith(".") and "\n" not in text for text in AXES.values())


def test_files(tmp_path, points_section, plain_section):
    folder = tmp_path / "report"
    write_report(folder, [points_section, plain_section], ABOUT)
    tables = {"points.csv", "front.csv", "fronts.csv", "graded.csv", "long.csv"}
    names = {"index.html", "report.json", "front.svg", *tables}
    assert {path.name for path in folder.iterdir()} == names
    with (folder / "graded.csv").open(newline="") as file:
        assert list(csv.reader(file)) == [
            ["method", "a, LSB", "b"],
            ["one", "0.25", "3"],
            ["two", "", "True"],
        ]
    figures = json.loads((folder / "report.json").read_text())
    assert figures["sections"]["plain"]["tables"]["graded"]["rows"][0] == {
        "method": "one",
        "a, LSB": 0.25,
        "b": 3,
    }
    assert set(figures["files"]) == names
    assert {"processor", "cores"} <= set(figures["machine"])
    assert figures["versions"]["blysk"]
    found = figures["sections"]["points"]["figures"]["points"]
    assert [point["errors"] for point in found] == [
        point["errors"] for point in points_section.figures["points"]
    ]
    assert "data:image" not in (folder / "report.json").read_text()


def test_an_earlier_report_is_replaced(tmp_path, points_section, plain_section):
    write_report(tmp_path, [points_section, plain_section], ABOUT)
    (tmp_path / "mine.csv").write_text("kept")
    write_report(tmp_path, [plain_section], ABOUT)
    names = {"index.html", "report.json", "graded.csv", "long.csv", "mine.csv"}
    assert {path.name for path in tmp_path.iterdir()} == names
    # A table of the other section would have the name of a file that no report wrote.
    other = json.loads((tmp_path / "report.json").read_text())["files"]
    tables = (f"{part.name}.csv" for part in points_section.parts if hasattr(part, "rows"))
    clash = next(name for name in tables if name not in other)
    (tmp_path / clash).write_text("kept")
    with pytest.raises(InputError, match=f"{clash}: is not part of a report, and would be replaced; move it"):
        write_report(tmp_path, [points_section], ABOUT)
    assert (tmp_path / clash).read_text() == "kept"


@pytest.mark.parametrize("name", ["notes.txt", "index.html", "report.json", "a.csv"])
def test_a_folder_with_other_things_is_refused(tmp_path, name):
    (tmp_path / name).write_text("{}")
    with pytest.raises(
        InputError, match=rf"holds {name}, which is not part of a report; give a new or empty folder"
    ):
        check_folder(tmp_path)


def test_what_is_no_folder_is_refused(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(InputError, match="it is a file; give the name of a folder"):
        check_folder(file)
    with pytest.raises(InputError, match="there is no folder"):
        check_folder(tmp_path / "missing" / "report")
    check_folder(tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_folder_that_may_not_be_written_is_refused(tmp_path, monkeypatch):
    # Root may write anywhere.
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(InputError, match="permission denied"):
        check_folder(tmp_path)
    with pytest.raises(InputError, match="permission denied"):
        check_folder(tmp_path / "new")


class Fake:
    """A section's module: the errors of a small table, and some times."""

    def __init__(self, section, count=2):
        self._section, self._count = section, count

    def tasks(self, quick, **further):
        assert further in ({}, {"meshes": ("a.obj", "b.obj")})
        settings = {"octaves": 2, "steps": 2}
        return [Task(errors_of_size, {**settings, "samples": 2 + k}) for k in range(self._count)]

    def section(self, tasks, results):
        assert [task.settings["samples"] for task in tasks] == [2 + k for k in range(self._count)]
        assert [len(result) for result in results] == [3] * self._count
        return self._section


def replace_sections(monkeypatch, modules):
    monkeypatch.setattr(sections, "SECTIONS", modules)
    monkeypatch.setattr(sections, "load", modules.__getitem__)


@pytest.fixture
def run(monkeypatch, plain_section):
    """Run the command with one or two sections of little work."""
    other = Section("other", "Another", [], [Table("other", "Other", ["a"], [(1,)])])
    replace_sections(monkeypatch, {"plain": Fake(plain_section), "other": Fake(other, 1)})
    return lambda *arguments: CliRunner().invoke(command, [str(argument) for argument in arguments])


@pytest.mark.ci
@pytest.mark.long
def test_command(run, tmp_path):
    folder = tmp_path / "report"
    result = run(folder, "--jobs", 1, "--quick")
    assert result.exit_code == 0, result.output
    assert result.output.split() == ["report", str(folder / "index.html")]
    figures = json.loads((folder / "report.json").read_text())
    assert list(figures["sections"]) == figures["chosen"] == ["plain", "other"]
    assert figures["quick"] is True
    result = run(folder, "--only", "other", "--jobs", 1)
    assert result.exit_code == 0, result.output
    assert {path.name for path in folder.iterdir()} == {"index.html", "report.json", "other.csv"}


def test_a_cluster_measures_what_is_no_time(run, tmp_path, monkeypatch):
    asked = []

    class Here(Executor):
        def submit(self, function, /, *arguments, **named):
            asked.append(function.__self__.timed)
            future = Future()
            future.set_result(function(*arguments, **named))
            return future

    @contextlib.contextmanager
    def workers(address):
        assert address == "tcp://a:1"
        yield Here()

    monkeypatch.setattr("blysk.bench.cli.bench.check_address", lambda address: None)
    monkeypatch.setattr(report, "cluster_executor", workers)
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "report"
    result = run(folder, "--cluster", "tcp://a:1")
    assert result.exit_code == 0, result.output
    assert asked
    assert not any(asked)
    assert json.loads((folder / "report.json").read_text())["cluster"] == "tcp://a:1"
    assert "The workers of tcp://a:1 measured the rest" in (folder / "index.html").read_text()


def test_meshes_go_to_the_points(monkeypatch, tmp_path, plain_section):
    replace_sections(monkeypatch, {"points": Fake(plain_section), "other": Fake(plain_section)})
    folder = tmp_path / "report"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.obj").touch()
    (tmp_path / "b.obj").touch()
    options = ["--mesh", "a.obj", "--mesh", "b.obj", "--jobs", "1", "--only", "points"]
    result = CliRunner().invoke(command, [str(folder), *options], catch_exceptions=False)
    assert result.exit_code == 0
    assert json.loads((folder / "report.json").read_text())["meshes"] == ["a.obj", "b.obj"]
    assert "teapot, a.obj, b.obj" in (folder / "index.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--only", "nothing"], "--only nothing: unknown section; use one of plain, other"),
        (["--jobs", "0"], "--jobs 0: out of range"),
        (["--cluster", "nowhere"], "--cluster nowhere: not the address of a Dask scheduler"),
        (["--cluster", "tcp://a:1", "--jobs", "2"], "--jobs: a cluster has its own workers"),
        (
            ["--cluster", "tcp://a:1", "--mesh", "a.obj"],
            "--mesh: the workers of a cluster do not have the file",
        ),
    ],
)
def test_bad_options(run, tmp_path, arguments, message):
    result = run(tmp_path / "report", *arguments)
    assert isinstance(result.exception, InputError)
    assert str(result.exception).startswith(message)
    assert not (tmp_path / "report").exists()


@pytest.mark.parametrize("module", ["jinja2", "markdown_it", "flip_evaluator", "skimage"])
def test_missing_library_is_named_before_the_work(run, tmp_path, monkeypatch, uninstalled, module):
    environment.cache_clear()
    uninstalled(module)
    if module in ("jinja2", "markdown_it"):
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr(report, "results_of", lambda *_: pytest.fail("work was begun"))
    result = run(tmp_path / "report")
    assert str(result.exception) == f"bench: {module} is not installed; {install_extra('report')}"
    environment.cache_clear()


def test_folder_is_checked_before_the_work(run, tmp_path, monkeypatch):
    monkeypatch.setattr(report, "results_of", lambda *_: pytest.fail("work was begun"))
    file = tmp_path / "file"
    file.write_text("kept")
    result = run(file)
    assert "it is a file" in str(result.exception)
    assert file.read_text() == "kept"


def test_interrupt_says_what_is_kept(run, tmp_path, monkeypatch):
    def stopped(tasks, executor, progress):
        progress()
        raise KeyboardInterrupt

    monkeypatch.setattr(report, "results_of", stopped)
    result = run(tmp_path / "report")
    assert result.exit_code == 130
    assert result.stderr == "blysk: stopped; 1 of 3 measurements are kept, run again to continue\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_interrupt_leaves_nothing_behind(interrupted):
    """A worker is interrupted in the midst of a program of its own."""
    status, text = interrupted(
        "import subprocess, sys, blysk.bench.report.sections as r\n"
        "def sleep(seconds): subprocess.run(['sleep', str(seconds)])\n"
        "if __name__ == '__main__':\n"
        "    from blysk.bench.store import Task\n"
        "    class Slow:\n"
        "        def tasks(self, quick): return [Task(sleep, {'seconds': 300})]\n"
        "    from blysk.bench.cli.bench import command\n"
        "    r.SECTIONS, r.load = {'slow': ''}, lambda name: Slow()\n"
        "    sys.exit(command.main(['report', '--jobs', '1'], standalone_mode=False))\n"
    )
    assert status == 130
    assert text == "blysk: stopped; 0 of 1 measurements are kept, run again to continue\n"


@pytest.mark.parametrize("name", SECTIONS)
def test_sections_have_tasks(name):
    assert name == SECTIONS[name].rpartition(".")[2].replace("_", "-")
    for quick in (True, False):
        tasks = load(name).tasks(quick)
        for task in tasks:
            assert json.loads(json.dumps(task.settings)) == task.settings
            assert getattr(sys.modules[task.function.__module__], task.function.__name__) is task.function
        # No value is measured twice.
        keys = {(task.name, json.dumps(task.settings, sort_keys=True)) for task in tasks}
        assert len(keys) == len(tasks)


def test_committed_rates_place_nothing():
    placing = load("place-and-route").measure
    names = ["points", "place-and-route"]
    every, kept = (
        [tasks for _, tasks in report.chosen_tasks(False, names=names, places=places)]
        for places in (True, False)
    )
    assert all(task.function is placing for task in every[1])
    assert every[1]
    assert kept == [[task for task in every[0] if task.function is not placing], []]


@pytest.mark.long
def test_quick_report(quick_report):
    figures = json.loads((quick_report / "report.json").read_text())
    assert list(figures["sections"]) == list(SECTIONS)
    assert {path.name for path in quick_report.iterdir()} == set(figures["files"])
    tables = [name for section in figures["sections"].values() for name in section["tables"]]
    assert len(tables) == len(set(tables))
    assert sorted(f"{name}.csv" for name in tables) == sorted(
        f for f in figures["files"] if f.endswith(".csv")
    )
    assert {"index.html", "report.json"} < set(figures["files"])
    for section in figures["sections"].values():
        assert section["text"]
        assert all(table["rows"] for table in section["tables"].values())
    reader = Reader((quick_report / "index.html").read_text(encoding="utf-8"))
    assert len(reader.ids) == len(set(reader.ids))
