"""What all tests share: the order of their groups, a limit of time, interrupts, compiled models."""

import importlib.util
import os
import re
import signal
import threading
import time
from collections import Counter
from datetime import date
from hashlib import sha256
from pathlib import Path

import pytest
from xdist.scheduler import LoadScopeScheduling

BY_UNIT = ("tests/test_units.py", "tests/formal/test_units.py", "tests/bench/tools/test_pages.py")
"""Files whose tests of a unit are a group."""


def group_of(nodeid):
    """Tests that one worker runs, as they share what they make: those of a file, or of a unit."""
    group, _, test = nodeid.partition("::")
    return group + re.sub(r"^\w+(\[\w+)?.*", r"\1", test) if group in BY_UNIT else group


class Groups(LoadScopeScheduling):
    """Whole groups to each worker."""

    def _split_scope(self, nodeid):
        return group_of(nodeid)


class Durations:
    """Seconds that each test took when it ran last, kept in pytest's cache."""

    KEY, UNKNOWN = "blysk/durations", 1.0

    def __init__(self, cache):
        self.cache, self.last, self.found = cache, cache.get(self.KEY, {}), {}

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items):
        """The longest groups first: at the end no worker waits for another. Without figures, the largest."""
        seconds = Counter()
        for item in items:
            seconds[group_of(item.nodeid)] += self.last.get(item.nodeid, self.UNKNOWN)
        order = {group: place for place, (group, _) in enumerate(seconds.most_common())}
        items.sort(key=lambda item: order[group_of(item.nodeid)])

    def pytest_runtest_logreport(self, report):
        self.found[report.nodeid] = round(self.found.get(report.nodeid, 0) + report.duration, 2)

    def pytest_sessionfinish(self, session):
        if not hasattr(session.config, "workerinput"):
            self.cache.set(self.KEY, self.last | self.found)


class Limit:
    """Skips tests that would start late; the order of groups is another every day, so that all get a turn.

    Those that hold the whole project, its wheel, types and examples, come first on every day.
    """

    DAY = "BLYSK_TEST_DAY"
    EVERY_DAY = tuple(f"tests/test_{name}.py" for name in ("supply", "embedding", "examples", "citations"))

    def __init__(self, minutes):
        self.minutes, self.end = minutes, time.monotonic() + 60 * minutes
        # Workers have that of the process that starts them.
        self.day = os.environ.setdefault(self.DAY, date.today().isoformat())

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items):
        def place(item):
            group = group_of(item.nodeid)
            return group not in self.EVERY_DAY, sha256(f"{self.day} {group}".encode()).digest()

        items.sort(key=place)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item):
        if time.monotonic() > self.end:
            pytest.skip(f"not started within {self.minutes:g} minutes")


def pytest_addoption(parser):
    parser.addoption(
        "--minutes",
        type=float,
        metavar="NUMBER",
        help="start no test after so many minutes; those left out are skipped, and are others every day",
    )


def pytest_configure(config):
    if config.option.minutes is not None:
        config.pluginmanager.register(Limit(config.option.minutes))
    elif hasattr(config, "cache"):
        config.pluginmanager.register(Durations(config.cache))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    return Groups(config, log)


@pytest.fixture(scope="session", autouse=True)
def interrupts():
    """Interrupts as at a terminal: a shell starts its background jobs with them ignored."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def model_cache(tmp_path_factory, worker_id, pytestconfig):
    """Compiled models of this run, shared by its workers."""
    shared = tmp_path_factory.getbasetemp()
    if worker_id != "master":
        shared = shared.parent
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BLYSK_CACHE", str(Path(shared) / "models"))
        # Of few cycles the compiler takes most of the time; with -O1 a model runs as fast as with -O2.
        patch.setenv("CXXFLAGS", "-O0" if "not long" in pytestconfig.option.markexpr else "-O1")
        yield


@pytest.fixture
def uninstalled(monkeypatch):
    """Let a package be not installed, as far as a search for it tells."""

    def uninstalled(package):
        find = importlib.util.find_spec
        monkeypatch.setattr(
            importlib.util, "find_spec", lambda name, *rest: None if name == package else find(name, *rest)
        )

    return uninstalled
