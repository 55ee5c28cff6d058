"""What the tests of every hardware unit share: one way to hold RTL against its bit-accurate model."""

import re
import signal
import threading
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from xdist.scheduler import LoadScopeScheduling

from blysk.sim.engines.simulate import simulate


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
def model_cache(tmp_path_factory, worker_id):
    """Compiled models of this run, shared by its workers."""
    shared = tmp_path_factory.getbasetemp()
    if worker_id != "master":
        shared = shared.parent
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BLYSK_CACHE", str(Path(shared) / "models"))
        yield


def take(beats, count):
    """First beats of a (nested) mapping of arrays."""
    if isinstance(beats, Mapping):
        return {name: take(value, count) for name, value in beats.items()}
    return beats[:count]


def length_of(beats) -> int:
    return length_of(next(iter(beats.values()))) if isinstance(beats, Mapping) else len(beats)


def assert_beats_equal(actual, expected, path="beat"):
    if isinstance(expected, Mapping):
        for name, value in expected.items():
            assert_beats_equal(actual[name], value, f"{path}.{name}")
    else:
        np.testing.assert_array_equal(actual, expected, err_msg=path)


@pytest.fixture
def verify():
    """Hold a unit of fixed latency against its bit-accurate model: beats, cycles, both engines, stalls."""

    def verify(unit, beats, expected, *, constants=None, seed=2026):
        rng = np.random.default_rng(seed)
        count = length_of(beats)
        run = simulate(unit, beats, count=count, constants=constants, engine="auto")
        assert_beats_equal(run.beats, expected)
        np.testing.assert_array_equal(run.input_cycles, np.arange(count) * unit.initiation_interval)
        np.testing.assert_array_equal(run.cycles, run.input_cycles + unit.latency)
        for input_share, output_share in ((0.4, 0.4), (0.9, 0.1), (0.1, 0.9)):
            stalls = {
                "input_stalls": rng.random(997) < input_share,
                "output_stalls": rng.random(1009) < output_share,
            }
            run = simulate(unit, beats, count=count, constants=constants, engine="auto", **stalls)
            assert_beats_equal(run.beats, expected)
            few = min(count, 60)
            slow, fast = (
                simulate(unit, take(beats, few), count=few, constants=constants, engine=engine, **stalls)
                for engine in ("pysim", "auto")
            )
            assert_beats_equal(slow.beats, take(expected, few))
            np.testing.assert_array_equal(slow.cycles, fast.cycles)
            np.testing.assert_array_equal(slow.input_cycles, fast.input_cycles)

    return verify


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
