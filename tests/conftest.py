"""Parts that all tests share: the order of their groups, interrupts, compiled models."""

import gc
import importlib.util
import re
import signal
import subprocess
import threading
from collections import Counter
from pathlib import Path

import hypothesis
import pytest
from xdist.scheduler import LoadScopeScheduling

from blysk.hdl.emit.processes import Process

from .decided import Decided
from .lists import OF_DOCUMENTS

# A test that is killed leaves no program behind. Neither does a run of tests with its workers.
subprocess.Popen = Process

BY_UNIT = ("tests/test_units.py", "tests/formal/test_units.py", "tests/bench/tools/test_pages.py")
"""Files in which the tests of a unit are a group."""

BESIDE = {
    "tests/bench/report/test_report_browser.py": "tests/bench/report/test_report.py",
    "tests/bench/web/test_documents_browser.py": "tests/bench/web/test_documents.py",
    "tests/bench/web/test_web_inside.py": "tests/bench/web/test_web_browser.py",
    "tests/test_citations.py": "tests/test_house.py",
}
"""Files in the group of another file, because both share a report, a site, or parsed sources."""

LONGEST = (
    "tests/sim/cli/test_bad_input.py",
    "tests/test_supply.py",
    *(f"tests/test_units.py[{unit}" for unit in ("geometry", "pipeline", "pixel_pipelines", "render")),
    *(f"tests/sim/engines/test_{name}.py" for name in ("cache", "compilers")),
    *("tests/sim/frames/test_animation.py", "tests/sim/frames/test_frame.py", "tests/sim/api/test_api.py"),
    *(f"tests/simulators/test_{name}.py" for name in ("mapped", "pipelines", "units")),
    *(f"tests/bench/report/test_{name}.py" for name in ("report", "points")),
    "tests/bench/web/test_web_browser.py",
    "tests/bench/tools/test_place_and_route.py",
    "tests/bench/quality/test_mutants.py",
)
"""Beginnings of the names of the groups that take longest. Workers begin with them."""


def group_of(nodeid):
    """The group of a test.

    One worker runs a group, because its tests share what they make: those of a file or two, or of a unit.
    """
    group, _, test = nodeid.partition("::")
    group = BESIDE.get(group, group)
    return group + re.sub(r"^\w+(\[\w+)?.*", r"\1", test) if group in BY_UNIT else group


class Groups(LoadScopeScheduling):
    """Give whole groups to each worker."""

    def _split_scope(self, nodeid):
        return group_of(nodeid)


SELDOM = (
    *OF_DOCUMENTS,
    *("highlight_cosine", "specular", "power", "stiff_interpolators", "highlight_gate_lengths"),
)
"""Units of the documents' methods and models, which change seldom."""


def pytest_itemcollected(item):
    """Leave the tests of the units in `SELDOM` to CI, by the names of their files; `make test` does not run
    them."""
    given = {mark.name for mark in item.iter_markers()}
    if item.path.stem.removeprefix("test_") in SELDOM and not given & {"long", "prove"}:
        item.add_marker("long")
        item.add_marker("ci")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Sort tests: first the groups in `LONGEST`, then the groups with most tests, so that no worker waits for
    another at the end.

    Workers collect files in two orders, and run tests in this order.
    """
    count = Counter(group_of(item.nodeid) for item in items)

    def place(item):
        group = group_of(item.nodeid)
        return not group.startswith(LONGEST), -count[group], group, item.nodeid.partition("::")[0]

    items.sort(key=place)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Let one of two workers begin with the last file, so that each makes the bytecode of other files."""
    report = yield
    worker = getattr(collector.config, "workerinput", {}).get("workerid", "gw0")
    if isinstance(collector, pytest.Dir) and int(worker[2:]) % 2:
        report.result.reverse()
    return report


def pytest_collection_finish():
    """Exclude modules and tests, which stay until the end, from the collection of garbage.

    A pipeline is many objects, which all live until it is translated. A tenth of that time was collection.
    """
    gc.freeze()
    gc.set_threshold(50_000)


# Examples are random, and the same in every run.
hypothesis.settings.register_profile("blysk", derandomize=True, database=None)
hypothesis.settings.load_profile("blysk")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    return Groups(config, log)


def pytest_configure():
    """Take interrupts as at a terminal, also in workers, because a shell starts background jobs that ignore
    them."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def model_cache(tmp_path_factory, worker_id, pytestconfig):
    """Folder of the compiled models of this run, which its workers share."""
    shared = tmp_path_factory.getbasetemp()
    if worker_id != "master":
        shared = shared.parent
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BLYSK_CACHE", str(Path(shared) / "models"))
        # In runs of few cycles the compiler takes most of the time. A model compiled with -O1 is as fast as
        # with -O2.
        patch.setenv("CXXFLAGS", "-O0" if "not long" in pytestconfig.option.markexpr else "-O1")
        yield


@pytest.fixture(scope="session")
def decided():
    """Statements that were decided before, and need not be decided again."""
    decided = Decided.read()
    yield decided
    decided.keep()


@pytest.fixture
def uninstalled(monkeypatch):
    """Make a package look as if it were not installed, for code that searches for it."""

    def uninstalled(package):
        find = importlib.util.find_spec
        monkeypatch.setattr(
            importlib.util, "find_spec", lambda name, *rest: None if name == package else find(name, *rest)
        )

    return uninstalled
