# amaranth: UnusedElaboratable=no
"""Place and route: counts, times, stored results, and refusals."""

import json
import os
import signal
import subprocess
from pathlib import Path

import pytest

from blysk.bench.tools import fpga, place_and_route
from blysk.bench.tools.families import ECP5, ECP5_85F, FAMILIES, NEXUS, Parts, Place
from blysk.bench.tools.fpga import run_again, table, untimed
from blysk.bench.tools.place_and_route import Layout, lay_out
from blysk.bench.tools.tool_runner import TooLarge
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.hdl.render import RendererUnit
from blysk.sim.cli.main import main
from blysk.sim.installation import install_extra

from ...sim.cli.commandline import PROGRAM, wait
from .test_place_and_route import tools


def test_command_goes_on_after_what_does_not_fit(calls, cache, tmp_path, capsys, monkeypatch):

    def refuses(name, *arguments):
        layout = lay_out(name, *arguments)
        if name == "diffuse":
            raise TooLarge("does not fit: 30 multipliers")
        return layout

    monkeypatch.setattr(fpga, "lay_out", refuses)
    path = tmp_path / "out.json"
    assert main(["fpga", "--unit", "diffuse", "--unit", "gpq", "--seeds", "1", "--json", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].startswith("gpq ")
    assert lines[3] == "diffuse: does not fit: 30 multipliers"
    assert json.loads(path.read_text())["too_large"] == {"diffuse": "does not fit: 30 multipliers"}
    # Alone it is an error.
    assert main(["fpga", "--unit", "diffuse", "--seeds", "1"]) == 1
    assert capsys.readouterr().err == "blysk: does not fit: 30 multipliers\n"


@pytest.mark.long
def test_cores_that_take_triangles(calls, cache, capsys, monkeypatch):
    """Each core is named by its function."""
    placed = []

    def place(name, unit, *others):
        placed.append(type(unit))
        return lay_out(name, unit, *others)

    monkeypatch.setattr(fpga, "lay_out", place)
    for top in ("geometry", "render"):
        assert main(["fpga", "--top", top, "--method", "linear", "--seeds", "1"]) == 0
        assert capsys.readouterr().out.splitlines()[2].startswith(f"{top} linear, blinn, 1 light ")
    assert placed == [GeometryUnit, RendererUnit]


def test_table():
    def place(seed, fmax):
        return Place(seed, fmax, "a", f"b.{seed}", 4.0, 3.25, {})

    layouts = [
        Layout("short", Parts(1, 2, 3, 4, 5), (place(1, 130.0), place(2, 120.04), place(3, 125.0))),
        Layout("longer", Parts(10000, 2, 0, 0, 0), (place(1, 99.96),)),
    ]
    assert table(layouts, NEXUS).splitlines() == [
        "design                              LUT    FF mult BRAM LUTRAM   min median   max slowest path, ns",
        "LIFCL-40, CABGA400, speed grade 7 32256 32256   56   84   4032",
        "short                                 1     2    3    4      5 120.0  125.0 130.0 4.0+3.2 a -> b.2",
        "longer                            10000     2    0    0      0 100.0  100.0 100.0 4.0+3.2 a -> b.1",
    ]
    figures = layouts[0].as_dict()
    assert [figures[f"fmax_{name}_mhz"] for name in ("min", "median", "max")] == [120.04, 125.0, 130.0]
    assert figures["seeds"][1]["end"] == "b.2"


def test_designs_with_an_untimed_interior_are_named():
    places = [Place(1, 250.0, "a", "b", 1.0, 1.0, {}, closed) for closed in (0, 3)]
    layouts = [Layout(f"closed {place.closed}", Parts(1, 2, 4, 0, 0), (place,)) for place in places]
    (line,) = untimed(layouts, ECP5)
    assert line.startswith("closed 3: 3 of 4 multipliers have registers inside on both sides")
    assert line.endswith("No clock rate above 250 MHz is quoted.")
    assert [layout.as_dict()["closed_multipliers"] for layout in layouts] == [0, 3]


def test_designs_far_from_the_target_are_named():
    places = [Place(seed, 90.0, "a", "b", 1.0, 1.0, {}, 0, seed > 1) for seed in (1, 2, 3)]
    layouts = [Layout(f"{count} seeds", Parts(1, 2, 4, 0, 0), tuple(places[:count])) for count in (1, 3)]
    (line,) = run_again(layouts)
    assert line.startswith("3 seeds: with seed 2, 3 the target was out of reach")


def test_designs_with_another_placer_are_named():
    places = [Place(seed, 90.0, "a", "b", 1.0, 1.0, {}, default_placer=seed > 1) for seed in (1, 2)]
    layouts = [Layout(f"{count} seeds", Parts(1, 2, 4, 0, 0), tuple(places[:count])) for count in (1, 2)]
    (line,) = run_again(layouts)
    assert line.startswith("2 seeds: with seed 2 the static placer found no place for block RAMs")


@pytest.mark.parametrize("options", [[], ["--keep-registers"]])
def test_registers_stay_outside_where_asked_for(options, calls, cache, monkeypatch):
    given = []
    monkeypatch.setattr(fpga, "lay_out", lambda *a: given.append(a[-1]) or lay_out(*a))
    assert main(["fpga", "--unit", "diffuse", "--seeds", "1", *options]) == 0
    assert given == [not options]


@pytest.mark.parametrize(("options", "target"), [([], 150), (["--target", "113"], 113)])
def test_target_of_the_router(options, target, calls, cache, tmp_path):
    path = tmp_path / "out.json"
    assert main(["fpga", "--unit", "diffuse", "--seeds", "1", *options, "--json", str(path)]) == 0
    assert calls.arguments[calls.arguments.index("--freq") + 1] == str(target)
    assert json.loads(path.read_text())["target_mhz"] == target


@pytest.mark.parametrize(("options", "family"), [([], ECP5), (["--family", "nexus"], NEXUS)])
def test_command(options, family, calls, cache, tmp_path, capsys):
    path = tmp_path / "out.json"
    arguments = ["--unit", "diffuse", "--unit", "gpq", "--seeds", "2", "--json", str(path)]
    assert main(["fpga", *options, *arguments]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith(f"{family.device} ")
    assert [line.split()[0] for line in lines[::2]] == ["design", "diffuse"]
    assert lines[3].startswith("gpq ")
    report = json.loads(path.read_text())
    assert report["device"] == family.device
    assert report["capacity"]["multipliers"] == family.capacity.multipliers
    assert report["tools"] == {"pyosys": "1", family.package: "2"}
    assert [design["design"] for design in report["designs"]] == ["diffuse", "gpq"]
    for design in report["designs"]:
        assert design["fmax_median_mhz"] == 101.5
        assert [place["seed"] for place in design["seeds"]] == [1, 2]


@pytest.mark.parametrize(
    ("options", "device"),
    [
        ([], ECP5),
        (["--pipes", "2", "--family", "ecp5"], ECP5),
        (["--pipes", "4"], ECP5_85F),
        (["--method", "quotient", "--lanes", "2"], ECP5),
        (["--method", "quotient", "--lanes", "4"], ECP5_85F),
        (["--family", "ecp5-85f"], ECP5_85F),
    ],
)
def test_device_by_the_number_of_pipelines(options, device, capsys, monkeypatch):
    """Several pipelines and four lanes take the larger device, unless another is given."""

    def lays_out(name, unit, seeds, jobs, progress, tell, family, absorb):
        return Layout(name, Parts(1, 2, 3, 4, 5), (Place(1, 130.0, "a", "b", 4.0, 3.0, {}),))

    monkeypatch.setattr(fpga, "lay_out", lays_out)
    monkeypatch.setattr(fpga, "versions_of", lambda family: {})
    assert main(["fpga", "--method", "linear", *options]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith(device.device)
    assert ("pipelines" in lines[2]) == ("--pipes" in options)


def test_designs():
    def names(designs):
        return [name for name, _ in designs]

    gates = ["middle_normal exact", "diffuse"]
    assert names(fpga.units_of(gates)) == gates
    forms = names(fpga.units_of(["quadratic_evaluator"]))
    assert forms == [f"quadratic_evaluator {form}" for form in QUADRATIC_FORMS]
    full = {"method": "quadratic", "style": "compact", "setup_interval": 7, "gate": True}
    whole = "pipeline quadratic, blinn, 2 lights, gate, compact, interval 7"
    assert names(fpga.pipelines_of({**full, "lights": 2}, False)) == [whole]
    assert names(fpga.pipelines_of({}, False)) == ["pipeline quotient, blinn, 1 light"]
    textured = {"albedo": "colors,bilinear", "transfer": "srgb"}
    whole = "pipeline quotient, blinn, 1 light, colors and bilinear, srgb"
    assert names(fpga.pipelines_of(textured, False)) == [whole]
    few = {"grey": True, "x_bits": 9, "length_bits": 5}
    whole = "pipeline quotient, blinn, 1 light, grey, x in 9 bits, length in 5 bits, memories synchronous"
    assert names(fpga.pipelines_of(few, False, {"memories": "synchronous"})) == [whole]
    assert names(fpga.pipelines_of({"model": "exp"}, False)) == ["pipeline renormalise, exp, 1 light"]
    assert names(fpga.pipelines_of({}, True)) == [f"pipeline {m}, blinn, 1 light" for m in fpga.METHODS]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--top", "render", "--pipes", "2"], "--pipes 2: triangles go to one pipeline"),
        (["--by-unit", "--seeds", "2"], "--seeds: nothing is placed; leave it out, or leave out --by-unit\n"),
        (["--pipes", "3"], "--pipes 3: not one of the choices; give one of 1, 2, 4, 8"),
        (["--unit", "gpq", "--pipes", "2"], "--pipes: is for the pipeline; leave out --pipes or --unit"),
        (
            ["--setups", "2"],
            "--setups 2: spans need no triangle setup; use top geometry or render",
        ),
        (["--length-bits", "1"], "--length-bits 1: out of range; give a whole number from 2 to 12\n"),
        (
            ["--memories", "fast"],
            "--memories fast: unknown kind of memories; use one of asynchronous, synchronous\n",
        ),
        (["--seeds", "0"], "--seeds 0: out of range; give a whole number from 1 to 100"),
        (["--jobs", "no"], "--jobs no: not a whole number; give"),
        (["--unit", "fuse"], "--unit fuse: unknown unit; use attribute_serialiser, coarse_depth, "),
        (["--unit", "gpq x"], "--unit gpq x: unknown variant; use gpq\n"),
        (
            ["--unit", "gpq", "--method", "renormalise"],
            "--method: is for the pipeline; leave out --method or",
        ),
        (
            ["--unit", "gpq", "--every-method"],
            "--every-method: is for the pipeline; leave out --every-method or --unit",
        ),
        (
            ["--method", "renormalise", "--every-method"],
            "--method: every method is placed; leave out --method",
        ),
        (["--family", "ice40"], "--family ice40: unknown family; use one of ecp5, nexus"),
        (["--method", "none"], "--method none: unknown method; use one of"),
        (
            ["--method", "renormalise", "--model", "phong"],
            "--model phong: method renormalise finds N.H, not R.V; use method quotient; or phong_coplanar",
        ),
        (["--json", "nowhere/x"], "nowhere/x: cannot be written, there is no folder nowhere; make"),
    ],
)
def test_bad_input_is_one_line(arguments, line, refused):
    refused("fpga", *arguments, line=line)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("which", [(0,), (1,), (0, 1)])
def test_missing_tools_are_one_line_that_names_the_extra(which, family, refused, monkeypatch):
    # Whether or not they are installed here.
    missing = [("pyosys", FAMILIES[family].package)[k] for k in which]
    monkeypatch.setattr(place_and_route, "version_of", lambda package: None if package in missing else "1")
    text = f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} not installed"
    refused("fpga", "--unit", "gpq", "--family", family, line=f"fpga: {text}; {install_extra('fpga')}\n")


@pytest.mark.long
@tools
@pytest.mark.skipif(os.name != "posix", reason="a signal to a process")
def test_interrupt_leaves_nothing_behind(cache, tmp_path):
    folder = tmp_path / "temporary"
    folder.mkdir()
    process = subprocess.Popen(
        [*PROGRAM, "fpga", "--method", "renormalise"],
        env={**os.environ, "TMPDIR": str(folder)},
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
    )
    wait(process, lambda: list(folder.glob("blysk-*/top.il")))
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == "blysk: interrupted"
    assert not list(folder.iterdir())
    assert not list(cache.glob("*"))
