"""No output of a command replaces a file that the run reads, or a file beside it that blysk did not write."""

import json
from pathlib import Path

import numpy as np
import pytest

from blysk.sim.cli.main import main
from blysk.sim.run_files import MARK

from .commandline import files

pytestmark = pytest.mark.usefixtures("folder")

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.fixture
def sources():
    """A mesh with material files and textures, a glTF mesh with its buffer and image, a curve, a scene."""
    Path("m.obj").write_text(f"mtllib m.mtl m.json.png\n{CORNERS}usemtl a\nf 1 2 3\n")
    Path("m.mtl").write_text("newmtl a\nKd 1 0 0\nmap_Kd -s 1 1 1 texture.png\n")
    Path("m.json.png").write_text("newmtl b\n")
    for name in ("texture.png", "image one.png"):
        Path(name).write_bytes(b"a picture")
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes()
    Path("buffer.bin").write_bytes(corners)
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"uri": "buffer.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "images": [{"uri": "image%20one.png"}],
    }
    Path("m.gltf").write_text(json.dumps(document))
    Path("c.csv").write_text("0,0\n1,1\n")
    Path("s.toml").write_text('[mesh]\nfile = "m.obj"\n')


@pytest.mark.parametrize(
    ("mesh", "read"),
    [
        ("m.obj", ("m.obj", "m.mtl", "m.json.png", "texture.png")),
        ("m.gltf", ("m.gltf", "buffer.bin", "image one.png")),
        ("s.toml", ("s.toml", "m.obj", "m.mtl")),
    ],
)
def test_render_replaces_nothing_that_it_reads(sources, mesh, read, capsys):
    """No output option replaces an input, or a file that the mesh names and the run does not read."""
    before = files()
    for name in read:
        options = ["--json", "--vcd"] + ["-o", "--compare"] * name.endswith(".png")
        for option in options:
            command = ["render", mesh, option, f"./{name}", "--size", "16x12"]
            if option == "--vcd" and name != "texture.png":
                command += ["--materials", "one"]
            assert main(command) == 2, command
            says = f"blysk: ./{name}: is a file that this run reads; choose another file\n"
            assert capsys.readouterr().err == says
    assert files() == before


def test_no_command_replaces_a_curve(sources, capsys):
    before = files()
    for command in (["render", "teapot", "--json"], ["verilog", "-o"], ["fpga", "--json"]):
        assert main([*command, "c.csv", "--model", "c.csv"]) == 2
        assert "c.csv: is a file that this run reads" in capsys.readouterr().err
    assert files() == before


def test_verilog_replaces_no_file_beside_it(capsys):
    """A file that blysk wrote is replaced."""
    small = ["verilog", "--method", "linear", "--model", "cosquad", "--bus", "wishbone", "-o"]
    for suffix in ("md", "svd"):
        path = Path(f"README.{suffix}")
        path.write_text("# My project\n")
        assert main([*small, "README.v"]) == 2
        says = "would be replaced, and blysk did not write it; move it, or choose another output"
        assert capsys.readouterr().err == f"blysk: README.{suffix}: {says}\n"
        assert {name.name: text for name, text in files().items()} == {path.name: b"# My project\n"}
        path.unlink()
    assert main([*small, "core.v"]) == main([*small, "core.v"]) == 0
    written = [path for path in files() if path.suffix != ".v"]
    assert len(written) == 3
    assert all(MARK in path.read_text() for path in written)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ("--testbench bench -o bench/blysk.v", "bench/blysk.v: lies in the folder of --testbench"),
        ("--package fusesoc bench -o bench/blysk.v", "bench/blysk.v: lies in the folder of --package"),
        ("--testbench bench --package fusesoc bench/a", "--package: its folder lies in the folder of --test"),
        ("--testbench bench --package fusesoc bench", "its folder lies in the folder of"),
    ],
)
def test_outputs_inside_each_other(capsys, options, says):
    Path("bench").mkdir()
    assert main(["verilog", *options.split()]) == 2
    assert says in capsys.readouterr().err
    assert files() == {}


@pytest.mark.parametrize("output", ["a.gif", "a.png"])
def test_turntable_replaces_no_file_beside_it(output, capsys):
    """Frames that blysk wrote are replaced, and files that the user names."""
    turntable = ["render", "teapot", "--triangles", "100", "--size", "16x12", "--engine", "pysim"]
    turntable += ["--method", "linear", "--frames", "1", "--jobs", "1", "-o", output]
    for name in ("a-0001.png", "a.gif"):
        if name == output:
            continue
        Path(name).write_bytes(b"mine")
        assert main(turntable) == 2
        assert f"{name}: would be replaced, and blysk did not write it" in capsys.readouterr().err
        assert Path(name).read_bytes() == b"mine"
        Path(name).unlink()
