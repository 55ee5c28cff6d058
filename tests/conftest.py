"""What the tests of every hardware unit share: one way to hold RTL against its bit-accurate model."""

import re
import signal
import threading
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator
from xdist.scheduler import LoadScopeScheduling

from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED, quantise
from blysk.sim.engines.beats import dtype_of, pack
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


@pytest.fixture(scope="session")
def one_minus_cosines():
    """One minus the dot product of every vector of codes with every other; float64 has all bits of these."""

    def one_minus_cosines(left, right):
        return ONE_SQUARED.codes - (left.astype(float) @ right.T.astype(float)).astype(int)

    return one_minus_cosines


@pytest.fixture(scope="session")
def setup_spans(normal_pairs):
    """Make spans for a setup: equal normals, every angle, some too wide, ends of the words; all lengths."""

    def setup_spans(rng, count, widest, too_wide):
        angles = np.r_[np.zeros(20), 10.0 ** rng.uniform(-4, 0, 80), rng.uniform(0, widest, count - 160)]
        angles = np.r_[angles, rng.uniform(too_wide, 180, 59), 180]
        left, right = (quantise(v) for v in normal_pairs(rng, count, angles))
        ends = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (40, 6))
        left, right = np.vstack([left, ends[:, :3]]), np.vstack([right, ends[:, 3:]])
        length = rng.integers(1, 4096, len(left))
        length[::2] = rng.integers(1, 20, len(length[::2]))
        length[:12] = [1, 2, 3, 4, 5, 16, 17, 2048, 2049, 2050, 4094, 4095]
        order = rng.permutation(len(left))
        return {"normal_left": left[order], "normal_right": right[order], "length": length[order]}

    return setup_spans


@pytest.fixture(scope="session")
def light_constants():
    """Make the constants of a unit with L and H of each light."""

    def light_constants(unit, direction, halfway):
        constants = np.zeros(unit.lights, dtype_of(unit.constants.shape().elem_shape))
        constants["direction"], constants["halfway"] = direction, halfway
        return constants

    return light_constants


@pytest.fixture(scope="session")
def verify_pauses():
    """Hold beats that come one by one, long after each other, against those that come together."""

    def verify_pauses(unit, beats, expected, pause, constants=None):
        count = length_of(beats)
        stalls = np.arange(pause * count) % pause != 0
        run = simulate(unit, beats, count=count, constants=constants, engine="auto", input_stalls=stalls)
        assert_beats_equal(run.beats, expected)
        np.testing.assert_array_equal(run.cycles, run.input_cycles + unit.latency)

    return verify_pauses


@pytest.fixture(scope="session")
def verify_reset():
    """Reset a unit with beats inside: it then answers as from power-up, on the same cycles."""

    def verify_reset(unit, beats, befores, cycles, constants=None):
        """Clocks and payloads of what the first six beats give; the others are inside on the reset."""
        packed = [
            int.from_bytes(row.astype("<u4").tobytes(), "little")
            for row in pack(unit.i.payload.shape(), beats)
        ]
        if constants is not None:
            rows = pack(unit.constants.shape().elem_shape, constants)
            width = unit.constants.shape().elem_shape.size
            words = (int.from_bytes(row.astype("<u4").tobytes(), "little") for row in rows)
            constants = sum(word << width * k for k, word in enumerate(words))
        reset, found = Signal(), []

        async def send(context, words, cycles):
            sent, taken = 0, []
            for clock in range(cycles):
                context.set(unit.i.valid, sent < len(words))
                context.set(Value.cast(unit.i.payload).as_unsigned(), words[min(sent, len(words) - 1)])
                accepted = context.get(unit.i.valid & unit.i.ready)
                if context.get(unit.o.valid):
                    taken.append((clock, context.get(Value.cast(unit.o.payload).as_unsigned())))
                await context.tick()
                sent += accepted
            return taken

        async def bench(context):
            if constants is not None:
                context.set(Value.cast(unit.constants).as_unsigned(), constants)
            context.set(unit.o.ready, 1)
            for before in (0, *befores):
                await send(context, packed[6:], before)
                context.set(reset, before > 0)
                await context.tick()
                context.set(reset, 0)
                assert not context.get(unit.o.valid)
                found.append(await send(context, packed[:6], cycles))

        simulator = Simulator(ResetInserter(reset)(unit))
        simulator.add_clock(1e-6)
        simulator.add_testbench(bench)
        simulator.run()
        assert all(run == found[0] for run in found[1:])
        return found[0]

    return verify_reset
