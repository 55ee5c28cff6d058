"""Files and output of ``blysk render``, with a compiler and without."""

import contextlib
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.scene import Scene
from blysk.sim.cli.main import main
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.installation import install_extra
from blysk.sim.meshes.mesh import load_mesh

from ..engines.scale import script
from .commandline import CORNERS, DEFAULTS, ERROR_NAMES, SMALL, TINY, files, picture

pytestmark = pytest.mark.usefixtures("folder")


@pytest.mark.long
def test_specialised_pipeline_says_what_it_leaves_out(folder, capsys):
    options = ["--method", "quadratic", "--gate", "--specialise", "--size", "64x48", "--specular", "0"]
    options += ["--engine", "pysim", "--triangles", "64"]
    assert main(["render", "teapot", *options, "-o", "a.png", "--json", "a.json"]) == 0
    output = capsys.readouterr().out
    assert re.search(
        r"^left out +no specular path: every k_s is 0; saves [\d,]+ cells, \d+ mult", output, re.M
    )
    assert re.search(r"^left out +x in 6 bits: 64 columns; saves ", output, re.M)
    assert re.search(
        r"^specialised +[\d,]+ of [\d,]+ cells, \d+ of \d+ multipliers, .* cycles$", output, re.M
    )
    assert re.search(r"^ +the frame equals the frame of the full pipeline, to the bit$", output, re.M)
    fit = json.loads(Path("a.json").read_text())["specialisation"]
    assert (fit["largest_difference"], fit["different_pixels"]) == (0, 0)
    for name, count in fit["specialised"].items():
        saved = sum(reduction["saves"][name] for reduction in fit["reductions"])
        assert count == fit["full"][name] - saved < fit["full"][name]


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """One run of the compiled engine with every output: its folder, and its printed text."""
    folder = tmp_path_factory.mktemp("rendered")
    names = [folder / name for name in ("a.png", "both.png", "a.json")]
    with contextlib.redirect_stdout(io.StringIO()) as output:
        status = main(
            ["render", *SMALL, "-v", "-o", str(names[0]), "--compare", str(names[1]), "--json", str(names[2])]
        )
    assert status == 0
    return folder, output.getvalue()


def test_picture_is_the_simulated_frame(rendered):
    mesh = load_mesh("teapot", triangles=500).mesh
    scene = Scene(
        mesh=mesh,
        camera=Camera.framing(mesh.vertices, (0.4, 0.5, 1), "perspective", 64 / 48),
        width=64,
        height=48,
        **DEFAULTS,
    )
    expected = FrameSimulator(preset(transfer="srgb")).render(scene).image
    folder, _ = rendered
    assert np.array_equal(picture(folder / "a.png"), expected)
    both = picture(folder / "both.png")
    where = np.lib.stride_tricks.sliding_window_view(both, (48, 64, 3))[:, :, 0, 0, 0, 0] == expected[0, 0, 0]
    assert any(np.array_equal(both[y : y + 48, x : x + 64], expected) for y, x in np.argwhere(where).tolist())


def test_figures(rendered):
    folder, output = rendered
    assert sorted(path.name for path in folder.iterdir()) == ["a.json", "a.png", "both.png"]
    figures = json.loads((folder / "a.json").read_text())
    fixed = {
        "mesh": "teapot",
        "method": "quotient",
        "model": "blinn",
        "exponent": 50,
        "lights": 1,
        "engine": "cxxrtl",
        "width": 64,
        "height": 48,
    }
    assert {name: figures[name] for name in fixed} == fixed
    whole = ["triangles", "spans", "pixels", "visible_pixels", "cycles"]
    assert all(type(figures[name]) is int and figures[name] > 0 for name in whole)
    assert figures["triangles"] == len(load_mesh("teapot", triangles=500).mesh.faces)
    assert figures["spans"] <= figures["visible_pixels"] <= figures["pixels"] <= figures["cycles"]
    assert figures["cycles_per_pixel"] == figures["cycles"] / figures["pixels"]
    seconds = figures["seconds"]
    assert {"load", "raster", "golden", "simulate", "total"} <= set(seconds)
    assert figures["simulated_pixels_per_second"] == figures["pixels"] / seconds["simulate"]
    assert sum(seconds.values()) - seconds["total"] <= seconds["total"]
    for name in ("arithmetic_error", "method_error", "total_error"):
        error = figures[name]
        assert list(error) == ERROR_NAMES
        assert 0 < error["rmse_lsb"] <= error["max_lsb"]
        assert error["p999_lsb"] <= error["max_lsb"]
        assert error["psnr_db"] == pytest.approx(20 * np.log10(255 / error["rmse_lsb"]), rel=1e-12)
    # Half an LSB is rounding, and half an LSB arithmetic. The model itself is off by tens of LSB.
    assert figures["arithmetic_error"]["max_lsb"] <= figures["total_error"]["max_lsb"] < 0.75
    assert 0 < figures["nmse"] < 1
    assert figures["mnse_published"] > 0

    # Every figure is printed, and every printed file exists.
    for name in whole:
        assert f"{figures[name]:,}" in output
    assert f"{figures['cycles_per_pixel']:.3f} a pixel" in output
    for name in ("arithmetic", "method", "total"):
        values = [figures[f"{name}_error"][key] for key in ERROR_NAMES[:4]]
        (row,) = re.findall(rf"^  {name} +([\d. ]+?)   [a-z]", output, re.MULTILINE)
        assert [float(value) for value in row.split()] == pytest.approx(values, abs=0.005)
    for name in ("a.png", "both.png", "a.json"):
        assert str(folder / name) in output


def test_default_output_is_named_like_the_mesh(capsys):
    Path("my.leaf.obj").write_bytes(CORNERS + b"f 1 2 3\n")
    assert main(["render", "my.leaf.obj", "--size", "16x12"]) == 0
    assert {str(path) for path in files()} == {"my.leaf.obj", "my.leaf-blysk.png"}
    output, errors = capsys.readouterr()
    assert errors == ""
    assert re.search(r"^frame +my\.leaf-blysk\.png$", output, re.MULTILINE)


def test_repairs_are_counted(capsys):
    rows = ["0 0 0 0 0 1", "1 0 0 0 0 0", "1 1 0 nan 0 1", "0 1 0 0 0.6 0.8", "0 2 0 0 0 1"]
    faces = ["3 0 1 2", "3 0 2 3", "3 0 3 3"]
    names = ("x", "y", "z", "nx", "ny", "nz")
    header = ["ply", "format ascii 1.0", f"element vertex {len(rows)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    Path("a.ply").write_text("\n".join(header + rows + faces) + "\n")
    assert main(["render", "a.ply", "--size", "16x12", "-v", "--json", "a.json"]) == 0
    output, _ = capsys.readouterr()
    counts = json.loads(Path("a.json").read_text())["counts"]
    assert (counts["repaired_normals"], counts["dropped_faces"]) == (2, 1)
    assert re.search(r"^counted +stored normals that were repaired: 2$", output, re.MULTILINE)
    assert re.search(r"^counted +faces without area, dropped: 1$", output, re.MULTILINE)


@pytest.mark.parametrize(
    "options",
    [[], ["-v"], pytest.param(["--frames", "1", "--jobs", "1"], marks=[pytest.mark.ci, pytest.mark.long])],
    ids=["short", "-v", "frames"],
)
def test_what_is_not_read_is_told_in_one_line(capsys, options):
    Path("a.obj").write_bytes(CORNERS + b"usemtl a\ns off\nf 1 2 3\nl 1 2\nSurf 1\n")
    assert main(["render", "a.obj", "--size", "16x12", "--json", "a.json", *options]) == 0
    output, errors = capsys.readouterr()
    told = [
        "smoothing groups (--crease says which edges are sharp)",
        "1 material name without a definition",
        "statements: l, Surf",
    ]
    assert re.findall(r"^ignored +(.*)$", output, re.MULTILINE) == ["; ".join(told)]
    assert json.loads(Path("a.json").read_text())["ignored"] == told
    assert errors == ""


def test_normals_that_turn_a_mesh_black_are_told(capsys):
    """A ball is wound inwards, and its normals point outwards.

    The option that the message names lights it.
    """
    ball = trimesh.creation.icosphere(subdivisions=1)
    trimesh.Trimesh(ball.vertices, ball.faces[:, ::-1], vertex_normals=ball.vertices, process=False).export(
        "a.ply", vertex_normal=True
    )
    light = []
    for options in ([], ["--back-faces", "show"]):
        assert main(["render", "a.ply", "--size", "32x24", "--transfer", "linear", *options]) == 0
        light.append(picture("a-blysk.png")[8:16, 12:20].mean())
    (line,) = re.findall(r"^noticed +(.*)$", capsys.readouterr().out.partition("seconds")[0], re.MULTILINE)
    assert line.startswith("triangles with normals against their winding: 80; --back-faces show takes")
    assert light[1] > 3 * light[0]


def test_no_pixel_shows_the_surface(capsys):
    Path("a.obj").write_bytes(CORNERS + b"f 1 2 3\n")
    options = ["--size", "16x12", "--view", "1,0,0", "--projection", "orthographic"]
    assert main(["render", "a.obj", *options, "--json", "a.json", "--compare", "both.png"]) == 0
    output, errors = capsys.readouterr()
    assert errors == ""
    assert "nan" not in output
    assert "no pixel shows the surface" in output
    figures = json.loads(Path("a.json").read_text())
    assert (figures["spans"], figures["pixels"], figures["cycles_per_pixel"]) == (0, 0, None)
    assert figures["arithmetic_error"] == dict.fromkeys(ERROR_NAMES)
    assert figures["nmse"] is None


@pytest.mark.ci
@pytest.mark.long
def test_waveforms(capsys):
    assert main(["render", *TINY, "--vcd", "a.vcd", "--json", "a.json"]) == 0
    assert capsys.readouterr().err == ""
    figures = json.loads(Path("a.json").read_text())
    assert figures["engine"] == "pysim"
    head, mark, changes = Path("a.vcd").read_text().partition("$enddefinitions $end")
    assert mark
    clock = set(re.findall(r"\$var wire 1 (\S+) clk \$end", head))
    assert len(clock) == 1
    ticks = changes.splitlines().count(f"1{clock.pop()}")
    # To the last pixel, and 64 further cycles to see that no other pixel comes.
    assert figures["cycles"] <= ticks <= figures["cycles"] + 70
    assert set(files()) == {Path("a.vcd"), Path("a.json"), Path("teapot-blysk.png")}


@pytest.fixture
def hidden(monkeypatch, uninstalled):
    """No compiler is found."""
    monkeypatch.setenv("PATH", "")
    uninstalled("ziglang")


@pytest.fixture
def broken(folder, monkeypatch):
    """The compiler fails."""
    text = 'case "$1" in --version) echo 1.0; exit 0;; esac\necho "error: out of luck"; exit 1'
    monkeypatch.setenv("CXX", script(folder, "compiler", text))


@pytest.mark.parametrize("obstacle", [pytest.param("hidden", marks=pytest.mark.long), "broken"])
def test_without_compiler(capsys, request, obstacle):
    request.getfixturevalue(obstacle)
    before = files()
    assert main(["render", *TINY, "--engine", "cxxrtl"]) == 2
    output, line = capsys.readouterr()
    assert output == ""
    assert re.fullmatch(r"blysk: no working C\+\+ compiler \([^\n]+\): [^\n]+\n", line)
    assert install_extra("native") in line
    assert files() == before


@pytest.mark.ci
@pytest.mark.long
def test_fallback_without_compiler(hidden, capsys, monkeypatch):
    """One line, and a smaller picture. If others can write the cache, there is a separate line."""
    Path("shared").mkdir()
    Path("shared").chmod(0o777)
    monkeypatch.setenv("BLYSK_CACHE", "shared")
    monkeypatch.setattr("blysk.sim.api.render.SLOW_SIZE", (24, 18))
    assert main(["render", "teapot", "--triangles", "100", "--size", "48x18", "--json", "a.json"]) == 0
    output, errors = capsys.readouterr()
    warning, line = errors.splitlines()
    assert re.match(
        r"blysk: warning: cache folder \S+/shared can be written by others \(chmod go-w\): ", warning
    )
    assert re.fullmatch(
        r"blysk: warning: pysim at 24x9 instead of cxxrtl, no working C\+\+ compiler .+", line
    )
    figures = json.loads(Path("a.json").read_text())
    assert (figures["engine"], figures["width"], figures["height"]) == ("pysim", 24, 9)
    assert picture("teapot-blysk.png").shape == (9, 24, 3)
    assert re.search(r"^mesh +teapot, \d+ triangles, 24x9$", output, re.MULTILINE)
