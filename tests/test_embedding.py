"""The examples of embedding draw the triangle that the bit-accurate model draws."""

import runpy
import subprocess
from pathlib import Path

import numpy as np
import pytest

import blysk
from blysk.golden.cosines.quotient_spans import SpanVectors
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.geometry.triangles import FrameSettings, Triangles
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light_frame import light_frame
from blysk.golden.render import Renderer

from .simulators.verilog_bench import missing_tool

FOLDER = Path(__file__).parents[1] / "examples" / "embedding"
WIDTH, HEIGHT, BACKGROUND = 32, 24, (0x1A, 0x1C, 0x20)


@pytest.fixture(scope="module")
def example():
    return runpy.run_path(str(FOLDER / "triangle.py"))


@pytest.fixture(scope="module")
def expected(example):
    """The picture of the model, from the numbers of the example and the constants of its description."""
    design = blysk.design(model="cosquad")
    triangle = Triangles(**{name: np.array(value)[np.newaxis] for name, value in example["TRIANGLE"].items()})
    towards = np.array([[0, 0, (1 << 17) - 1]])
    ambient, diffuse, specular = (np.full((1, 3), round(255 * 64 * level)) for level in (0.05, 0.4, 0.55))
    constants = FrameConstants(50, ambient[0], towards, towards, diffuse, specular)
    drawn = Renderer(design).compute(triangle, FrameSettings.centred(WIDTH, HEIGHT, limit=178), constants)
    picture = np.tile(np.array(BACKGROUND, dtype=np.uint8), (HEIGHT, WIDTH, 1))
    picture[drawn.y, drawn.x] = drawn.color
    assert len(drawn.x) > 150
    assert len(np.unique(drawn.color[:, 0])) > 50
    return picture


def test_beat_of_the_guide():
    """The guide's code gives the codes of the model, for spans of 1 to 4095 pixels."""
    guide = (FOLDER.parents[1] / "docs" / "guide" / "embedding.md").read_text(encoding="utf-8")
    (text,) = (part for part in guide.split("```") if "def beat(" in part)
    made: dict = {}
    exec(text.removeprefix("python"), made)
    rng = np.random.default_rng(1)
    for length in (1, 3, 17, 400, 4095):
        light, viewer = normalise(rng.normal(size=(2, 3)))
        axes = light_frame(light, viewer).axes
        left = rng.normal(size=3)
        right = left + rng.normal(size=3)
        expected = SpanVectors.quantise(
            *(np.array([end @ axes.T]) for end in (left, right)), np.array([length])
        )
        for found, codes in zip(
            made["beat"](left, right, length, light, viewer), tuple(expected)[:3], strict=True
        ):
            np.testing.assert_allclose(found, codes[0], rtol=0, atol=1)
        assert made["beat"](left, right, length, light, viewer)[2] == expected.exponent[0]


@pytest.mark.ci
@pytest.mark.long
def test_amaranth(example, expected):
    np.testing.assert_array_equal(example["picture"](), expected)


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.skipif(bool(missing_tool("icarus")), reason="Icarus Verilog is not installed")
def test_verilog(tmp_path, expected):
    text = blysk.verilog(blysk.design(model="cosquad"), top="render")
    (tmp_path / "core.v").write_text(text)
    sources = ["core.v", FOLDER / "triangle.v", FOLDER / "bench.v"]
    subprocess.run(["iverilog", "-g2001", "-Wall", "-o", "bench", *sources], cwd=tmp_path, check=True)
    subprocess.run(["vvp", "-n", "bench"], cwd=tmp_path, check=True, timeout=300)
    words = (tmp_path / "picture.hex").read_text().split("\n")
    found = bytes.fromhex("".join(word for word in words if not word.startswith("//")))
    np.testing.assert_array_equal(np.frombuffer(found, np.uint8).reshape(HEIGHT, WIDTH, 3), expected)
