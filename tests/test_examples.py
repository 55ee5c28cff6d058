"""The examples run, and show what they state."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from blysk.bench.tools.board_design import gpu_of
from blysk.bench.tools.boards import BOARDS
from blysk.golden.albedo.attribute_spans import AttributeSpans

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.mark.ci
@pytest.mark.long
def test_script(tmp_path):
    done = subprocess.run(
        [sys.executable, EXAMPLES / "render.py", tmp_path], capture_output=True, text=True, check=True
    )
    cycles, error = re.match(r"([\d,]+) cycles, largest error ([\d.]+) LSB", done.stdout).groups()
    assert int(cycles.replace(",", "")) > 20_000
    assert float(error) < 1
    with Image.open(tmp_path / "teapot.png") as picture:
        assert picture.size == (320, 240)
    assert "\nmodule teapot_core (" in (tmp_path / "core.v").read_text()


def test_colours(tmp_path):
    """The mesh fits a board with a 25F, and its colours are drawn there."""
    subprocess.run([sys.executable, EXAMPLES / "colours.py", tmp_path], capture_output=True, check=True)
    gpu, _ = gpu_of(BOARDS["ulx3s-25f"], str(tmp_path / "colours.ply"), {})
    assert gpu.drawing.mesh.surface == AttributeSpans()
    assert gpu.drawing.lines == 8


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda path: path.name)
def test_notebook(path, capsys):
    """Run code cells in one namespace, without a kernel.

    `nbclient` would need a kernel and thirty packages.
    """
    document = json.loads(path.read_text(encoding="utf-8"))
    cells = ["".join(cell["source"]) for cell in document["cells"] if cell["cell_type"] == "code"]
    assert not any(cell.get("outputs") for cell in document["cells"])
    namespace = {}
    for cell in cells:
        exec(compile(cell, path.name, "exec"), namespace)
    frame = namespace["frame"]
    assert frame.cycles > frame.pixels > frame.spans > 0
    assert frame.error.max_lsb < 1
    assert frame.image.shape == (240, 320, 3)
    assert frame._repr_png_().startswith(b"\x89PNG")
    assert "data:image/png;base64," in frame._repr_html_()
    drawn = capsys.readouterr().out
    rows = [line.split()[0] for line in drawn.splitlines() if "cycles, largest" in line]
    assert rows == ["linear", "quotient"]
    assert namespace["text"].startswith("//")
    assert namespace["scene"].width == 160
    assert np.unique(frame.image.reshape(-1, 3), axis=0).shape[0] > 100
