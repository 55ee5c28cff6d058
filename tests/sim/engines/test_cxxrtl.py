"""The compiled engine in batches, interrupts, and room for its output."""

import gc
import signal
import threading
import time

import numpy as np
import pytest
from amaranth.hdl import Signal

import blysk.sim.engines.simulate
from blysk.sim.engines import cxxrtl, cxxrtl_source
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import simulate

from .scale import BEATS, Scale, scaled

pytestmark = pytest.mark.usefixtures("cache")


def test_batches_leave_no_trace(filled, monkeypatch):
    beats = np.random.default_rng(4).integers(-100, 100, 300)
    stalls = np.random.default_rng(5).random((2, 23)) < 0.5
    component = Scale()
    arguments = {"count": 300, "input_stalls": stalls[0], "output_stalls": stalls[1]}
    whole = simulate(component, beats, **arguments)
    monkeypatch.setattr(cxxrtl, "_BATCH", 7)
    seen = []
    for count in (300, None):
        parts = simulate(
            component, beats, **arguments | {"count": count, "progress": seen.append, "idle_timeout": 90}
        )
        np.testing.assert_array_equal(parts.beats, whole.beats)
        np.testing.assert_array_equal(parts.cycles, whole.cycles)
        np.testing.assert_array_equal(parts.input_cycles, whole.input_cycles)
        assert parts.total_cycles == whole.total_cycles
    assert seen[0] <= 7
    assert 300 in seen


@pytest.mark.parametrize("end", ["drops", "stuck"])
def test_errors_are_the_same_in_batches(monkeypatch, end):
    class Faulty(Scale):
        def elaborate(self, platform):
            m = super().elaborate(platform)
            age = Signal(8)
            m.d.sync += age.eq(age + (age != 255))
            with m.If(age == 60 if end == "drops" else age >= 60):
                m.d.sync += self.o.valid.eq(0)
            return m

    stalls = np.arange(64) == 60
    messages = []
    for batch in (1000, 1, 61):
        monkeypatch.setattr(cxxrtl, "_BATCH", batch)
        with pytest.raises(SimulationError) as caught:
            simulate(Faulty(), np.arange(500), count=500, output_stalls=stalls, idle_timeout=600)
        messages.append(str(caught.value))
    with pytest.raises(SimulationError) as caught:
        simulate(Faulty(), np.arange(500), count=500, output_stalls=stalls, idle_timeout=600, engine="pysim")
    assert messages == [str(caught.value)] * 3


def test_interrupt_between_batches(filled):
    """Ctrl-C ends a run that would take for ever, within about a batch."""
    if threading.current_thread() is not threading.main_thread():
        pytest.skip("signals go to the main thread")
    component = Scale()
    simulate(component, BEATS, count=4)
    beats = np.zeros(100, dtype=int)
    # One beat in 100 million cycles.
    stalls = np.ones(10**8, dtype=bool)
    stalls[5] = False
    started = time.monotonic()
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        simulate(component, beats, count=100, input_stalls=stalls, idle_timeout=10**10)
    assert time.monotonic() - started < 5
    timer.join()
    assert simulate(component, BEATS, count=4).beats.tolist() == (3 * BEATS).tolist()


def test_an_exception_in_progress_ends_the_run(filled):
    def stop(done):
        raise RuntimeError(f"stop at {done}")

    with pytest.raises(RuntimeError, match=r"^stop at 4$"):
        scaled(progress=stop)


@pytest.mark.parametrize("enabled", [True, False])
def test_garbage_collection_is_as_before(enabled, filled, monkeypatch):
    """Collection is off while a netlist is made, and afterwards as the caller had it, also if that fails."""
    seen = []
    convert = cxxrtl_source.rtlil.convert

    def watched(*arguments, **options):
        seen.append(gc.isenabled())
        return convert(*arguments, **options)

    monkeypatch.setattr(cxxrtl_source.rtlil, "convert", watched)
    before = gc.isenabled()
    try:
        (gc.enable if enabled else gc.disable)()
        assert scaled() == (3 * BEATS).tolist()
        assert gc.isenabled() == enabled
        with pytest.raises(ZeroDivisionError), cxxrtl_source._without_collection():
            raise ZeroDivisionError
        assert gc.isenabled() == enabled
    finally:
        (gc.enable if before else gc.disable)()
    assert seen == [False]


@pytest.mark.parametrize("count", [None, 300])
@pytest.mark.parametrize(("batch", "room"), [(1, 1), (7, 2), (1000, 1), (50, 1 << 24)])
def test_room_for_the_output_grows(filled, monkeypatch, count, batch, room):
    monkeypatch.setattr(cxxrtl, "_BATCH", batch)
    monkeypatch.setattr(cxxrtl, "_ROOM", room)
    beats = np.arange(-150, 150)
    run = simulate(Scale(), beats, count=count, idle_timeout=100)
    assert run.beats.tolist() == (3 * beats).tolist()
    assert run.cycles.tolist() == list(range(1, 301))


@pytest.mark.parametrize("piece", [1, 7, 300, 301])
def test_beats_are_unpacked_in_pieces(filled, monkeypatch, piece):
    monkeypatch.setattr(blysk.sim.engines.simulate, "_PIECE", piece)
    beats = np.arange(-150, 150)
    assert simulate(Scale(), beats, count=300).beats.tolist() == (3 * beats).tolist()
    assert simulate(Scale(), beats[:0], count=0).beats.tolist() == []
