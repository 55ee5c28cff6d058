"""Bad meshes, options, designs and output files: one line each, and no file touched."""

import re
from pathlib import Path

import pytest

from blysk.golden.presets import LOBES, METHODS, PUBLISHED
from blysk.sim.cli.main import main

from .commandline import CORNERS, TINY, files

pytestmark = pytest.mark.usefixtures("folder")


def test_bad_mesh(refused):
    """The tests of meshes check the message of each kind."""
    Path("a.obj").write_bytes(CORNERS + b"v nan 0 0\nf 1 2 4\n")
    refused("render", "a.obj", "-o", "out.png", "--json", "out.json", thing="a.obj", says="NaN or infinite")
    refused("render", "nowhere.obj", thing="nowhere.obj", says="there is no such file")
    refused("render", "", thing="MESH ''", says="is not a file name")
    refused("render", "/", thing="MESH '/'")


KNOWN_METHODS = f"unknown method; use one of {', '.join(METHODS | PUBLISHED)}"
KNOWN_LOBES = f"use one of {', '.join(LOBES)}, "


@pytest.mark.parametrize(
    ("options", "thing", "says"),
    [
        (["--exponent", "0"], "--exponent 0", "from 1 to 1000"),
        (["--exponent", "1001"], "--exponent 1001", "from 1 to 1000"),
        (["--exponent", "-3"], "--exponent -3", "from 1 to 1000"),
        (["--exponent", "2.5"], "--exponent 2.5", "not a whole number"),
        (["--exponent", "x"], "--exponent x", "not a whole number"),
        (["--exponent", ""], "--exponent ", "not a whole number"),
        (["--size", "0x0"], "--size 0x0", "1 to 4095 each"),
        (["--size", "5000x10"], "--size 5000x10", "1 to 4095 each"),
        (["--size", "10x4096"], "--size 10x4096", "1 to 4095 each"),
        (["--size", "abc"], "--size abc", "not a size"),
        (["--size", "-1x5"], "--size -1x5", "not a size"),
        (["--method", "slurp"], "--method slurp", KNOWN_METHODS),
        (["--model", "shiny"], "--model shiny", KNOWN_LOBES),
        (["--engine", "steam"], "--engine steam", "use one of auto, cxxrtl, pysim"),
        (["--projection", "flat"], "--projection flat", "orthographic"),
        (["--back-faces", "hide"], "--back-faces hide", "flip, show, cull"),
        (["--triangles", "63"], "--triangles 63", "from 64 to 4000000"),
        (["--crease", "181"], "--crease 181", "0 to 180"),
        (["--crease", "sharp"], "--crease sharp", "not a number"),
        (["--view", "0,0,0"], "--view 0,0,0", "not a direction"),
        (["--view", "1,2"], "--view 1,2", "not a direction; give X,Y,Z"),
        (["--view", "1,nan,2"], "--view 1,nan,2", "out of range"),
        (["--light", "0,0,0"], "--light 0,0,0", "a direction other than 0"),
        (["--light", "1,2,3,4"], "--light 1,2,3,4", "give X,Y,Z or X,Y,Z,R,G,B"),
        (["--light", "1,1,1,-1,0,0"], "--light 1,1,1,-1,0,0", "colours of 0 or more"),
        (["--light", "1,1,1,0,0,50"], "--light", "make the light darker"),
        (["--light", "1,1,1"] * 17, "--light", "17 lights; give at most 16"),
        (["--ambient", "1.5"], "--ambient 1.5", "from 0 to 1"),
        (["--diffuse", "0,0,-0.1"], "--diffuse 0,0,-0.1", "from 0 to 1"),
        (["--specular", "0.1,0.2"], "--specular 0.1,0.2", "not a colour; give #rrggbb"),
        (["--background", "#12345"], "--background #12345", "not a colour"),
        (["--vcd", "a.vcd", "--engine", "cxxrtl"], "--vcd", "use --engine pysim"),
        (["--operand", "cross"], "--operand cross", "use one of cosine, one_minus_cosine"),
        (["--setup-interval", "0"], "--setup-interval 0", "from 1 to 46"),
        (["--frames", "0"], "--frames 0", "from 1 to 9999"),
        (["--frames", "2", "--jobs", "0"], "--jobs 0", "from 1 to 1024"),
        (["--jobs", "2"], "--jobs", "also give --frames"),
        (["--cluster", ""], "--cluster", "also give --frames"),
        (["--frames", "2", "--cluster", ""], "--cluster ", "as tcp://host:8786"),
        (["--frames", "2", "--cluster", "a:1", "--jobs", "2"], "--jobs", "leave out --jobs or --cluster"),
        (["--frames", "2", "--compare", "a.png"], "--compare a.png", "is for one frame"),
        (["--frames", "2", "--vcd", "a.vcd"], "--vcd a.vcd", "is for one frame"),
        (["--frames", "2", "-o", "a.jpg"], "a.jpg", "use .gif or .png"),
        (["--frames", "2", "-o", "no/a.gif"], "no/a.gif", "there is no folder no"),
        (["--frames", "2", "-o", "a.gif", "--json", "a-0002.png"], "a-0002.png", "another output"),
        (["--frames", "2", "--view", "0,1,0"], "--view 0,1,0", "looks along the axis"),
        (["--point-light", "1,2,3,1,1,1,1,-1,0"], "--point-light 1,2,3,1,1,1,1,-1,0", "coefficients of 0 or"),
        (["--spot-light", "1,2,3,0,0,0,10,20"], "--spot-light 1,2,3,0,0,0,10,20", "spot must not be 0, 0, 0"),
        (["--spot-light", "1,2,3,0,1,0,20,10"], "--spot-light 1,2,3,0,1,0,20,10", "give an axis other than"),
        (
            ["--spot-light", "1,2,3,0,1,0,10,20", "--method", "quotient"],
            "--method quotient",
            "use method chord-local",
        ),
        (["--roughness", "0.3"], "--roughness 0.3", "leave it out, or give exponent"),
    ],
)
def test_bad_option(refused, options, thing, says):
    refused("render", "teapot", *options, thing=thing, says=says)


@pytest.mark.parametrize("command", [["render", "teapot"], ["verilog", "-o", "core.v"]])
def test_design_that_cannot_be(refused, command):
    says = "finds N.H, not R.V; use method quotient; or phong_coplanar, "
    refused(*command, "--method", "linear", "--model", "phong", thing="--model phong", says=says)
    says = "quotient has no error bound for a gate; leave it out"
    refused(*command, "--gate", "--model", "phong", thing="--gate", says=says)
    says = "method angular finds no normals"
    refused(*command, "--method", "angular", "--operand", "cosine", thing="--operand cosine", says=says)
    says = "method linear is not built for it; "
    refused(*command, "--method", "linear", "--setup-interval", "26", thing="--setup-interval 26", says=says)
    if command[0] == "verilog":
        refused(*command, "--factors", "1", thing="--factors 1", says="need the method chord-local")
        local = ["--method", "chord-local", "--factors", "2"]
        refused(*command, *local, thing="--factors 2", says="and at most as many factors as lights")


@pytest.mark.parametrize(
    ("options", "thing", "says"),
    [
        (["--lights", "0"], "--lights 0", "from 1 to 16"),
        (["--lights", "17"], "--lights 17", "from 1 to 16"),
        (["--name", "1up"], "--name 1up", "letters, digits and underscores"),
        (["--name", "module", "--method", "linear"], "--name module", "choose another name"),
        (["-o", "no/such/folder.v"], "no/such/folder.v", "there is no folder no/such"),
    ],
)
def test_bad_option_of_verilog(refused, options, thing, says):
    refused("verilog", *options, thing=thing, says=says)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "Missing command"),
        (["paint"], "No such command 'paint'"),
        (["render"], "Missing argument 'MESH'"),
        (["render", "teapot", "kettle"], "unexpected extra argument (kettle)"),
        (["render", "teapot", "--shiny"], "No such option"),
        (["render", "teapot", "--size"], "'--size' requires an argument"),
        (["--shiny"], "No such option"),
    ],
)
def test_wrong_command(capsys, arguments, says):
    assert main(arguments) == 2
    output, line = capsys.readouterr()
    assert (output, files()) == ("", {})
    assert re.fullmatch(r"blysk: [^\n]+; see blysk --help\n", line)
    assert says in line


@pytest.mark.parametrize("option", ["-o", "--compare", "--json", "--vcd"])
def test_unwritable_output(refused, option):
    """The output is checked before the mesh is searched."""
    suffix = {"--json": "json", "--vcd": "vcd"}.get(option, "png")
    name, says = f"nowhere/a.{suffix}", "there is no folder nowhere; make the folder first"
    refused("render", "missing.obj", option, name, thing=name, says=says)


def test_wrong_suffix_of_picture(refused):
    refused("render", *TINY, "-o", "a.obj", thing="a.obj", says="use .png")
    refused("render", *TINY, "--compare", "a", thing="a", says="the name has no suffix")


def test_output_over_the_mesh_or_another_output(refused):
    says = "is also another output; choose another file"
    refused("render", *TINY, "-o", "a.png", "--compare", "./a.png", thing="./a.png", says=says)
    refused("render", *TINY, "--json", "a", "--vcd", "a", thing="a", says=says)
    Path("link.png").symlink_to("a.png")
    refused("render", *TINY, "-o", "a.png", "--compare", "link.png", thing="link.png", says=says)
    Path("a.obj").write_bytes(CORNERS + b"f 1 2 3\n")
    refused("render", "a.obj", "--json", "a.obj", thing="a.obj", says="is a file that this run reads")
