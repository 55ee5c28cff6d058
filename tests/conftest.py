"""What all tests share: what one worker runs, interrupts, the cache of compiled models, pairs of normals."""

import re
import signal
import threading
from pathlib import Path

import numpy as np
import pytest
from xdist.scheduler import LoadScopeScheduling


class Groups(LoadScopeScheduling):
    """What one worker runs: the tests of a file, or of the tests of every unit those of a unit.

    A worker compiles a unit once.
    """

    def _split_scope(self, nodeid):
        group, _, test = nodeid.partition("::")
        return group + re.sub(r"^\w+(\[\w+)?.*", r"\1", test) if group == "tests/test_units.py" else group


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    return Groups(config, log)


def pytest_collection_modifyitems(items):
    """The tests of every unit first: the longest tests do not come last."""
    items.sort(key=lambda item: not item.nodeid.startswith("tests/test_units.py"))


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
        if "not long" in pytestconfig.option.markexpr:
            # Of few cycles the compiler takes most of the time.
            patch.setenv("CXXFLAGS", "-O0")
        yield


@pytest.fixture(scope="session")
def normal_pairs():
    """Make pairs of unit normals, uniform over the sphere, a given angle apart."""

    def normal_pairs(rng, count, angle):
        left = rng.normal(size=(count, 3))
        left /= np.linalg.norm(left, axis=1, keepdims=True)
        across = rng.normal(size=(count, 3))
        across -= np.einsum("ij,ij->i", across, left)[:, None] * left
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        angle = np.radians(np.broadcast_to(angle, count))[:, None]
        return left, left * np.cos(angle) + across * np.sin(angle)

    return normal_pairs
