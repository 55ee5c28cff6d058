"""The limit of time of a run: what would start too late is skipped, and counted."""

from pathlib import Path

import pytest

pytest_plugins = "pytester"

SLOW = """
import time
import pytest

@pytest.mark.parametrize("number", range(4))
def test_slow(number):
    time.sleep(0.3)
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
    result = run("--minutes", "0.01", "-rs", test_slow=SLOW)
    counts = result.parseoutcomes()
    assert counts["passed"] + counts["skipped"] == 4
    assert 1 <= counts["passed"] < 4
    result.stdout.fnmatch_lines(["SKIPPED*not started within 0.01 minutes"])


def test_without_a_limit_all_run(run):
    run(test_slow=SLOW).assert_outcomes(passed=4)


@pytest.mark.parametrize("workers", [[], ["-n", "2"]])
def test_the_order_of_files_is_that_of_the_day(run, workers):
    files = {f"test_{k}": "def test_one(): pass" for k in range(8)}
    orders = []
    for day in ("2026-01-01", "2026-01-02", "2026-01-01"):
        result = run("--minutes", "1", *workers, day=day, **files)
        result.assert_outcomes(passed=8)
        orders.append([line.split("::")[0][-9:] for line in result.outlines if "PASSED" in line])
    if not workers:
        assert orders[0] == orders[2] != orders[1]
