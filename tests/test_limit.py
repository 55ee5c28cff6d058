"""The limit of time of a run: what would start too late is skipped, and counted."""

from pathlib import Path

import pytest

from .conftest import Limit

pytest_plugins = "pytester"

LATE = """
def test_in_time():
    pass

def test_takes_all_the_time(request):
    (limit,) = (p for p in request.config.pluginmanager.get_plugins() if type(p).__name__ == "Limit")
    limit.end = 0

def test_late():
    pass

def test_later():
    pass
"""


@pytest.fixture
def run(pytester, monkeypatch):
    """Outcome of a run of some files, with the project's conftest and options."""
    pytester.makeconftest(Path(__file__).with_name("conftest.py").read_text(encoding="utf-8"))
    monkeypatch.setenv("PYTEST_ADDOPTS", "")

    def run(*options, day="2026-01-01", **files):
        monkeypatch.setenv("BLYSK_TEST_DAY", day)
        pytester.makepyfile(**files)
        return pytester.runpytest_subprocess("-v", *options)

    return run


def test_late_tests_are_skipped(run):
    result = run("--minutes", "60", "-rs", test_file=LATE)
    result.assert_outcomes(passed=2, skipped=2)
    result.stdout.fnmatch_lines(["SKIPPED*not started within 60 minutes"])


def test_without_a_limit_all_run(run):
    run(test_file="def test_one(): pass").assert_outcomes(passed=1)


@pytest.mark.parametrize("workers", [[], ["-n", "2"]])
def test_the_order_of_files_is_that_of_the_day(run, workers):
    files = {f"test_{k}": "def test_one(): pass" for k in range(8)}
    orders = []
    for day in ("2026-01-01", "2026-01-02", "2026-01-01"):
        result = run("--minutes", "60", *workers, day=day, **files)
        result.assert_outcomes(passed=8)
        orders.append([line.split("::")[0][-9:] for line in result.outlines if "PASSED" in line])
    if not workers:
        assert orders[0] == orders[2] != orders[1]


def test_some_files_come_first_on_every_day(run, pytester):
    for file in Limit.EVERY_DAY:
        assert (Path(__file__).parents[1] / file).exists()
    pytester.mkdir("tests")
    Path("tests/test_supply.py").write_text("def test_one(): pass")
    others = {f"test_{k}": "def test_one(): pass" for k in range(4)}
    for day in ("2026-01-01", "2026-01-02", "2026-01-03"):
        lines = run("--minutes", "60", day=day, **others).outlines
        assert next(line for line in lines if "PASSED" in line).startswith("tests/test_supply.py::")
