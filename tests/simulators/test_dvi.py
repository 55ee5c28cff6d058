# amaranth: UnusedElaboratable=no
"""Verilog of the display in Icarus Verilog.

cocotbext-dvi, which shares no code with the project, decodes its lanes.
"""

from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from amaranth.back import verilog
from PIL import Image

from blysk.golden.video.band_buffer import BandBuffer
from blysk.golden.video.display_timing import Axis, DisplayMode

from ..hdl.video.pattern import PatternTop, picture
from .verilog_bench import missing_tool

pytestmark = pytest.mark.long

MODE = DisplayMode(Axis(24, 2, 3, 11), Axis(16, 1, 2, 3))
PARAMETERS = BandBuffer(MODE, 4, background=(40, 200, 7))
FOLDER = Path(__file__).parent


def decode(folder, image, monkeypatch):
    """Tests that failed, and their messages."""
    if missing_tool("icarus") or not all(map(find_spec, ("cocotb", "cocotbext.dvi"))):
        pytest.skip(missing_tool("icarus") or "the Python package cocotbext-dvi is not installed")
    from cocotb_tools.runner import get_runner

    Image.fromarray(image.astype(np.uint8)).save(folder / "image.png")
    top = PatternTop(PARAMETERS, pause=9, moves=False)
    (folder / "top.v").write_text(verilog.convert(top, name="dvi_top", emit_src=False))
    runner = get_runner("icarus")
    runner.build(
        sources=[folder / "top.v", FOLDER / "dvi_bench.v"],
        hdl_toplevel="bench",
        build_dir=folder,
        timescale=("1ps", "1fs"),
        log_file=folder / "build.log",
    )
    monkeypatch.syspath_prepend(str(FOLDER))
    line = MODE.horizontal.total
    settings = {
        "DVI_SIZE": "x".join(map(str, MODE.size)),
        "DVI_DRAW": "13000",
        # The frame is between the first and the last pixel of the pulse, because the encoder and the crossing
        # are some cycles behind.
        "DVI_START": str(MODE.vertical.front * line),
        "DVI_IMAGE": str(folder / "image.png"),
    }
    # The runner ends the process if a test fails; its file of results tells the reason.
    results = folder / "results.xml"
    with suppress(SystemExit):
        runner.test(
            hdl_toplevel="bench",
            test_module="dvi_bench",
            build_dir=folder,
            test_dir=folder,
            extra_env=settings,
            log_file=folder / "run.log",
            results_xml=str(results),
        )
    cases = ElementTree.parse(results).findall(".//testcase")
    assert len(cases) == 1
    return [str(found.attrib) for case in cases for found in case.findall("failure") + case.findall("error")]


def test_an_independent_decoder_sees_the_frames(tmp_path, monkeypatch):
    """Every pixel of two frames is right."""
    image = PARAMETERS.compute(picture(PARAMETERS, 0))
    assert decode(tmp_path, image, monkeypatch) == []


def test_it_sees_a_wrong_pixel(tmp_path, monkeypatch):
    """A picture that differs from the display's is found."""
    image = PARAMETERS.compute(picture(PARAMETERS, 0))
    image[9, 13, 1] ^= 4
    (failure,) = decode(tmp_path, image, monkeypatch)
    assert "[9][13][1]" in failure
