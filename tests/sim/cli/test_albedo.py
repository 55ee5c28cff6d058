"""``--albedo``: ports of Verilog with colours of pixels, and refusals."""

import re
from pathlib import Path

import pytest

import blysk
from blysk.sim.cli.main import main

pytestmark = pytest.mark.usefixtures("folder")

SMALL = "--method", "linear", "--model", "cosquad"
TRIANGLES = "--geometry", "hardware", "--albedo", "colors"


@pytest.mark.long
@pytest.mark.ci
def test_verilog():
    """Its words are those of Python. Attributes of spans, and texels outside, have described ports."""
    assert main(["verilog", *SMALL, "--albedo", "colors,nearest,outside", "-o", "core.v"]) == 0
    text = Path("core.v").read_text()
    design = blysk.design(method="linear", model="cosquad", albedo=["outside", "colors", "nearest"])
    assert blysk.verilog(design) == text
    for port in ("i_attributes_start_coordinates_1", "i_attributes_step_weight", "texel_request_3"):
        assert re.search(rf"^// {port}\w* +(?:in|out)put +[0-9]+ ", text, re.MULTILINE), port


@pytest.mark.parametrize(
    ("options", "thing", "says"),
    [
        (["--albedo", "pink"], "--albedo pink", "unknown part; give one or more of colors, nearest, "),
        (["--albedo", "colors,colors"], "--albedo colors,colors", "a name comes twice"),
        (["--albedo", "tinted"], "--albedo tinted", "also give colors, nearest or bilinear"),
        (["--albedo", "nearest,outside", "--testbench", "bench"], "--testbench", "leave out outside"),
        (
            ["--albedo", "nearest,outside", "--package", "fusesoc", "a"],
            "--package fusesoc",
            "leave out outside",
        ),
        (["--albedo", "nearest,outside", "--pipes", "2"], "--pipes 2", "a single native core"),
        (["--albedo", "nearest,outside", "--bus", "axi"], "--bus axi", "a single native core"),
        (
            [*TRIANGLES, "--method", "renormalise"],
            "--geometry hardware",
            "use quotient, or spans from software",
        ),
        ([*TRIANGLES, "--setups", "2"], "--setups 2", "one lane of triangle setup; leave out setups"),
        ([*TRIANGLES[:-1], "colors,orthographic"], "--albedo", "1/W of every pixel; leave out orthographic"),
        ([*TRIANGLES[:-1], "nearest,outside"], "--albedo", "needs its texels inside; leave out outside"),
    ],
)
def test_refused(refused, options, thing, says):
    refused("verilog", *options, thing=thing, says=says)
