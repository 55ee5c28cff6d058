# amaranth: UnusedElaboratable=no
# The register is Verilog text, and never elaborated; the line above switches off the warning.
"""The bench itself: it drives and reads as the engine does, and finds injected faults."""

import numpy as np
import pytest
from amaranth.hdl import Module, Mux, signed
from amaranth.lib import data, stream
from amaranth.lib.wiring import Component, In, Out

from blysk.sim.engines.simulate import simulate

from .verilog_bench import BenchError, VerilogBench, missing_tool, pauses


class Sums(Component):
    """Running sums of words that cross the 32-bit boundaries of a beat, from a written start."""

    i: In(stream.Signature(data.StructLayout({"a": 13, "b": signed(50), "c": data.ArrayLayout(7, 3)})))
    o: Out(stream.Signature(data.StructLayout({"sum": signed(64), "a": 13, "c": 7})))
    write: In(stream.Signature(data.StructLayout({"data": 40})))
    constants: In(data.StructLayout({"added": 5, "far": data.ArrayLayout(signed(30), 2)}))
    status: Out(data.StructLayout({"taken": 20, "last": signed(50)}))

    def elaborate(self, platform):
        m = Module()
        given, sums = self.i.payload, self.o.payload
        move = ~self.o.valid | self.o.ready
        m.d.comb += [self.write.ready.eq(~self.o.valid), self.i.ready.eq(move & ~self.write.valid)]
        with m.If(move):
            m.d.sync += self.o.valid.eq(self.i.valid & self.i.ready)
        with m.If(self.write.valid & self.write.ready):
            m.d.sync += sums.sum.eq(sums.sum + self.write.payload.data)
        with m.Elif(self.i.valid & self.i.ready):
            m.d.sync += [
                sums.a.eq(sums.a + given.a + self.constants.added),
                sums.sum.eq(sums.sum + Mux(given.a[0], given.b, self.constants.far[1])),
                sums.c.eq(given.c[2]),
                self.status.taken.eq(self.status.taken + 1),
                self.status.last.eq(given.b),
            ]
        return m


class Register(Component):
    """A beat waits in a register. The tests have the text of its Verilog."""

    i: In(stream.Signature(8))
    o: Out(stream.Signature(8))

    def elaborate(self, platform):
        raise NotImplementedError


REGISTER = """\
module core (clk, rst, i, i_valid, i_ready, o, o_valid, o_ready);
  input clk;
  input rst;
  input [7:0] i;
  input i_valid;
  output i_ready;
  output [7:0] o;
  output o_valid;
  input o_ready;
  reg [7:0] held;
  reg full = 0;
  reg [7:0] count = 0, idle = 0;
  assign o = PAYLOAD;
  assign o_valid = VALID;
  assign i_ready = READY;
  always @(posedge clk) begin
    count <= count + 1;
    idle <= full ? 0 : idle + 1;
    if (o_ready) full <= 0;
    if (i_valid && i_ready) begin
      full <= 1;
      held <= i;
    end
    if (rst) full <= 0;
  end
endmodule
"""
GOOD = {"PAYLOAD": "held", "VALID": "full", "READY": "!full || o_ready"}


def register(**injected):
    text = REGISTER
    for name, value in (GOOD | injected).items():
        text = text.replace(name, value)
    return text


STALLS = pauses(np.random.default_rng(1), 0.4, 0.4)


@pytest.fixture
def icarus():
    if missing_tool("icarus"):
        pytest.skip(missing_tool("icarus"))


@pytest.fixture(params=["icarus", pytest.param("verilator", marks=pytest.mark.long)])
def simulator(request):
    if missing_tool(request.param):
        pytest.skip(missing_tool(request.param))
    return request.param


def test_beats_clocks_and_status_are_those_of_the_engine(simulator, tmp_path):
    rng = np.random.default_rng(3)
    beats = {
        "a": rng.integers(0, 1 << 13, 400),
        "b": rng.integers(-(1 << 49), 1 << 49, 400),
        "c": rng.integers(0, 128, (400, 3)),
    }
    others = {
        "write": {"data": rng.integers(0, 1 << 40, 5)},
        "constants": {"added": 3, "far": np.array([5, -(1 << 29)])},
    }
    component = Sums()
    bench = VerilogBench(component, tmp_path)
    for stalls in ({}, STALLS, pauses(np.random.default_rng(2), 0.9, 0.1)):
        expected = simulate(component, beats, count=400, engine="pysim", **others, **stalls)
        found = bench.run(simulator, beats, 400, **others, **stalls)
        np.testing.assert_array_equal(found.beats, expected.beats)
        np.testing.assert_array_equal(found.cycles, expected.cycles)
        assert found.status == expected.status
        assert found.status["taken"] == 400


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ({"PAYLOAD": "held ^ (!o_ready && count[3:0] == 0)"}, "changed"),
        ({"VALID": "full && count[3:0] != 0"}, "withdrawn"),
        ({"VALID": "full || idle == 40"}, "extra"),
        ({"READY": "(!full || o_ready) && held !== 30"}, "stuck"),
        ({"PAYLOAD": "{held[7:1], 1'bx}"}, "undefined"),
        ({"VALID": "full || 1'bx"}, "undefined"),
        ({"READY": "full ? o_ready : 1'bx"}, "undefined"),
    ],
)
def test_breaks_of_the_rules_end_a_run(icarus, tmp_path, fault, says):
    """Breaks of the rules end a run in Icarus Verilog, whose bits may be undefined.

    The bench is the same in Verilator.
    """
    bench = VerilogBench(Register(), tmp_path, register(**fault))
    with pytest.raises(BenchError, match=rf"^{says} at clock \d+, output beat \d+ of 100$"):
        bench.run("icarus", np.arange(100), 100, idle_timeout=500, **STALLS)


def test_the_register_itself_is_right(icarus, tmp_path):
    found = VerilogBench(Register(), tmp_path, register()).run("icarus", np.arange(100), 100, **STALLS)
    np.testing.assert_array_equal(found.beats, np.arange(100))


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ({"VALID": "nowhere + ("}, r"^iverilog ends with status \d+: "),
        ({"PAYLOAD": "held, unknown = held"}, r"^iverilog warns: .*implicit definition of wire 'unknown'"),
    ],
)
def test_says_what_failed(icarus, tmp_path, fault, says):
    bench = VerilogBench(Register(), tmp_path, register(**fault))
    with pytest.raises(BenchError, match=says):
        bench.run("icarus", np.arange(2), 2)
