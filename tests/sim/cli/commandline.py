"""Helpers of the tests of the command line."""

import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image

from blysk.golden.reference.lighting import Light, Material

_MAIN = "import sys; from blysk.sim.cli import main, progress; progress.SECONDS = 3600; sys.exit(main.main())"

PROGRAM = [sys.executable, "-c", _MAIN]
"""The command. It shows no step, however busy the machine is."""

SMALL = ["teapot", "--triangles", "500", "--size", "64x48"]

TINY = ["teapot", "--triangles", "100", "--size", "16x12"]

DEFAULTS = {
    "material": Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0.6, 0.6, 0.6), 50),
    "lights": [Light((-0.5, 0.8, 0.7))],
    "background": "#1a1c20",
}
"""The size of a scene for which no size is given."""

ERROR_NAMES = ["max_lsb", "p999_lsb", "rmse_lsb", "psnr_db", "steady_lsb", "border_lsb"]


def picture(path):
    with Image.open(path) as image:
        return np.asarray(image)


def files():
    return {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}


def wait(process, happens, seconds=120):
    """Wait until something happens while a process runs."""
    deadline = time.monotonic() + seconds
    while not happens():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.02)


CORNERS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
