"""Both engines on components of many kinds, and on components that break the rules of a stream."""

import numpy as np
import pytest
from amaranth.hdl import Module, signed, unsigned
from amaranth.lib import data, stream
from amaranth.lib.wiring import Component, In, Out

from blysk.sim.engines.engine import CompilerMissing, Ports, SimulationError
from blysk.sim.engines.simulate import simulate

from .components import (
    ALL,
    PAIR,
    Accumulator,
    Expander,
    Faulty,
    Lookup,
    Plain,
    Register,
    assert_equal,
    both,
    pairs,
    refused,
)


def stall_patterns(seed):
    rng = np.random.default_rng(seed)
    patterns = {
        "free": (None, None),
        "both": (rng.random(61) < 0.3, rng.random(53) < 0.7),
        "alternating": (np.array([True, False]), np.array([False, True])),
    }
    return [
        pytest.param(dict(zip(("input_stalls", "output_stalls"), pattern, strict=True)), id=name)
        for name, pattern in patterns.items()
    ]


@pytest.mark.parametrize("stalls", stall_patterns(5))
@pytest.mark.parametrize("kind", ALL)
def test_engines_agree_with_each_other_and_with_arithmetic(kind, stalls):
    beats = pairs(120)
    expected = kind.model(beats)
    run = both(kind(), beats, len(expected), **stalls)
    assert run.beats.tolist() == expected.tolist()
    assert len(run.cycles) == len(expected)
    assert len(run.input_cycles) == 120


def test_clocks_of_a_register():
    """Without stalls a beat taken at cycle k comes out at k + 1. Cycle 0 is the first."""
    run = both(Register(), pairs(9), 9)
    np.testing.assert_array_equal(run.input_cycles, np.arange(9))
    np.testing.assert_array_equal(run.cycles, np.arange(1, 10))
    assert run.total_cycles == 10


def test_stall_patterns_are_by_clock_and_an_offer_is_held():
    # Offers start at cycles 1, 4, 7 ... (stall 1, 0, 1). The sink is ready at cycles 0, 5, 10, 15 ...
    run = both(
        Register(),
        pairs(3),
        3,
        input_stalls=np.array([True, False, True]),
        output_stalls=np.array([False, True, True, True, True]),
    )
    # Offered at 1 and taken, out from 2, taken at 5. Offered at 4, taken at 5 when the register is free, out
    # at 10. Offered at 7, held until 10, out at 15.
    np.testing.assert_array_equal(run.input_cycles, [1, 5, 10])
    np.testing.assert_array_equal(run.cycles, [5, 10, 15])


@pytest.mark.parametrize("stalls", stall_patterns(6))
def test_constants_writes_and_status(stalls):
    beats = pairs(50)
    rows = {"row": np.array([3, 0, 1, 2, 0]), "value": np.array([-2048, 5, 2047, -1, 99])}
    constants = {"scale": np.array([-256, 255]), "unused": (1 << 40) - 1}
    run = both(Accumulator(), beats, 50, constants=constants, write=rows, **stalls)
    x = beats["x"]
    memory = np.array([99, 2047, -1, -2048])
    scale = np.where(x & 4, 255, -256)
    np.testing.assert_array_equal(run.beats, scale * memory[x % 4] + beats["y"])
    assert run.status["writes"] == 5
    assert run.status["total"] == beats["y"].sum()
    assert run.status["busy"] == 0
    # Writes go at cycles 1, 3, 5, 7, 9, before any input beat.
    assert run.input_cycles[0] > 9


def test_plain_signed_members():
    beats = pairs(30)["y"]
    run = both(Plain(), beats, 30, constants=-32768, write=np.array([7, -16]))
    np.testing.assert_array_equal(run.beats, beats * -32768 - 16)
    assert run.status == -16


def test_writes_between_beats():
    """A write is offered after some beats were taken, beside the next beat, which Plain takes at once."""
    beats, write, after = pairs(30)["y"], np.array([7, -16, 5, 3, -1]), np.array([0, 10, 10, 20, 30])
    run = both(Plain(), beats, 30, constants=-32768, write=write, write_after=after)
    # Beat k is taken at cycle k + 1, the writes at cycles 0, 11, 12, 21 and 31.
    np.testing.assert_array_equal(run.input_cycles, np.arange(30) + 1)
    np.testing.assert_array_equal(run.beats - beats * -32768, [7] * 11 + [-16] + [5] * 9 + [3] * 9)
    assert (run.status, run.total_cycles) == (-1, 32)


def test_members_without_bits():
    class Empty(Register):
        constants: In(data.StructLayout({}))
        status: Out(unsigned(0))

    assert both(Empty(), pairs(5), 5, constants={}).status == 0


def test_count_none_takes_what_comes():
    beats = pairs(40)
    run = both(Expander(), beats, None, idle_timeout=50)
    assert run.beats.tolist() == Expander.model(beats).tolist()


def test_no_beats():
    run = both(Register(), pairs(0), 0)
    assert (len(run.beats), len(run.cycles), run.total_cycles, run.status) == (0, 0, 0, None)


def test_one_component_many_runs():
    """Every run starts from power-up."""
    component = Accumulator()
    arguments = {"count": 20, "constants": {"scale": np.array([1, 2]), "unused": 0}}
    rows = {"row": np.array([0]), "value": np.array([7])}
    first = simulate(component, pairs(20), write=rows, **arguments)
    simulate(component, pairs(20), **arguments)
    assert_equal(first, simulate(component, pairs(20), write=rows, **arguments))


ONE_STALL = np.arange(20) == 13

FAULTS = {
    # Beat k waits in the register from cycle k + 1 on. The sink stalls at cycle 13.
    "drops": "at clock 14, output beat 12: valid went low while the beat waited for ready",
    "changes": "at clock 14, output beat 12: the payload changed while the beat waited for ready",
    "loses": "nothing moved for 100 cycles up to clock 122: 19 of 20 output beats came, "
    "20 of 20 input beats and 0 of 0 writes were taken",
    "deadlocks": "nothing moved for 100 cycles up to clock 108: 7 of 20 output beats came, "
    "7 of 20 input beats and 0 of 0 writes were taken",
    "invents": "at clock 22, output beat 20: a beat more than the 20 expected",
}


@pytest.mark.parametrize(
    ("fault", "engine"),
    [
        pytest.param(
            *(fault, engine),
            # Each is a model of its own.
            marks=[pytest.mark.ci, pytest.mark.long] * (engine == "cxxrtl" and fault != "drops"),
        )
        for fault in FAULTS
        for engine in ("pysim", "cxxrtl")
    ],
)
def test_faults_are_caught(fault, engine):
    with pytest.raises(SimulationError) as caught:
        simulate(Faulty(fault), pairs(20), count=20, engine=engine, output_stalls=ONE_STALL, idle_timeout=100)
    assert str(caught.value) == FAULTS[fault]


def test_no_fault_is_no_error():
    run = both(Faulty(None), pairs(20), 20, output_stalls=ONE_STALL, idle_timeout=100)
    np.testing.assert_array_equal(run.beats, pairs(20)["y"])


@pytest.mark.parametrize("engine", ["pysim", "cxxrtl"])
def test_a_late_extra_beat_needs_enough_settle_cycles(engine):
    """The invented beat appears at cycle 22, one cycle after the last of the 20 beats."""
    arguments = {"count": 20, "engine": engine, "output_stalls": ONE_STALL}
    assert len(simulate(Faulty("invents"), pairs(20), settle=0, **arguments).beats) == 20
    with pytest.raises(SimulationError, match="a beat more"):
        simulate(Faulty("invents"), pairs(20), settle=1, **arguments)


class Members(Component):
    def __init__(self, **members):
        super().__init__({"i": In(stream.Signature(4)), "o": Out(stream.Signature(4))} | members)

    def elaborate(self, platform):
        m = Module()
        if not hasattr(self, "combinational"):
            m.d.sync += self.o.valid.eq(self.i.valid)
        return m


def test_members():
    ports = Ports(refused(Accumulator()))
    assert (ports.i, ports.o) == (PAIR, signed(40))
    assert list(ports.status.members) == ["writes", "total", "busy"]
    ports = Ports(refused(Members(extra=Out(3))))
    assert (ports.constants, ports.write, ports.status) == (None, None, None)
    for member, message in {
        "i=Out(stream.Signature(4))": r"member i must be In\(stream.Signature\)",
        "o=Out(4)": r"member o must be Out\(stream.Signature\)",
        "o=Out(stream.Signature(4, always_valid=True))": r"member o must be Out\(stream.Signature\)",
        "constants=Out(4)": r"member constants must be In\(shape\)",
        "constants=In(4).array(2)": r"member constants must be In\(shape\)",
        "i=In(stream.Signature(0))": "the payload of stream i has no bits",
        "extra=In(1)": "Members has members that nothing drives: extra",
    }.items():
        component = refused(eval(f"Members({member})"))
        with pytest.raises(ValueError, match=message):
            Ports(component)
    with pytest.raises(ValueError, match="Table has no stream i"):
        Ports(refused(Lookup.Table()))
    with pytest.raises(TypeError, match=r"component must be a wiring\.Component, not Module"):
        Ports(refused(Module()))


@pytest.mark.parametrize("engine", ["pysim", "cxxrtl"])
def test_a_component_without_registers_is_refused(engine):
    component = Members()
    component.combinational = True
    with pytest.raises(ValueError, match="Members has nothing in the clock domain sync"):
        simulate(component, np.arange(3), count=3, engine=engine)


def test_arguments():
    beats = pairs(2)
    for arguments, message in (
        ({"engine": "verilator"}, "engine must be 'cxxrtl', 'pysim' or 'auto', not 'verilator'"),
        ({"vcd": "x.vcd"}, "waveforms need engine 'pysim', not 'cxxrtl'"),
        ({"input_stalls": np.array([True])}, "input_stalls must leave at least one clock free"),
        ({"output_stalls": np.array([], dtype=bool)}, "output_stalls must leave at least one clock free"),
        (
            {"output_stalls": np.array([0, 1])},
            r"output_stalls must be a bool array of one dimension, not int64 \(2,\)",
        ),
        ({"idle_timeout": 0}, "idle_timeout must be at least 1, not 0"),
        ({"settle": -1}, "settle must be at least 0, not -1"),
        ({"idle_timeout": 9, "settle": 10}, "settle must be at most idle_timeout, 9, not 10"),
        ({"count": -1}, "count must be at least 0, not -1"),
        ({"constants": {}}, "the component has no constants"),
        ({"write": beats}, "the component has no stream write"),
        ({"write_after": np.array([0])}, r"write_after must be 0 integers, not int64 \(1,\)"),
    ):
        with pytest.raises(ValueError, match=message):
            simulate(refused(Register()), beats, **{"count": 2} | arguments)
    for places, message in (
        ([0.0, 1.0], r"write_after must be 2 integers, not float64 \(2,\)"),
        ([-1, 0], "write_after must not decrease, and be 0 to 2, the number of beats"),
        ([1, 0], "write_after must not decrease"),
        ([0, 3], "write_after must not decrease"),
    ):
        arguments = {"constants": 1, "write": np.array([1, 2]), "write_after": np.array(places)}
        with pytest.raises(ValueError, match=message):
            simulate(refused(Plain()), beats["y"], count=2, **arguments)
    with pytest.raises(ValueError, match="the component has constants, and none are given"):
        simulate(refused(Accumulator()), beats, count=2)
    with pytest.raises(ValueError, match=r"y of beat 1 is 131072, outside -131072 to 131071"):
        simulate(refused(Register()), {"x": [0, 0], "y": [0, 1 << 17]}, count=2)


def test_auto_falls_back_to_pysim(monkeypatch):
    assert simulate(Register(), pairs(3), count=3, engine="auto").engine == "cxxrtl"

    def broken(component, origin):
        raise CompilerMissing("no compiler")

    monkeypatch.setattr("blysk.sim.engines.cxxrtl.Compiled", broken)
    with pytest.warns(RuntimeWarning, match="^no compiler; using pysim, about a hundred times slower$"):
        run = simulate(Register(), pairs(3), count=3, engine="auto")
    assert run.engine == "pysim"
    np.testing.assert_array_equal(run.beats, Register.model(pairs(3)))
    with pytest.raises(CompilerMissing, match="no compiler"):
        simulate(refused(Register()), pairs(3), count=3)
