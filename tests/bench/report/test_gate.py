# amaranth: UnusedElaboratable=no
"""The gate table: shares against counts made pixel by pixel, frames and cycles of both pipelines, output."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest

from blysk.bench.accuracy import scene_for
from blysk.bench.report import gate
from blysk.bench.report.gate import (
    GateRow,
    GateUnits,
    Shares,
    frames,
    main,
    same_pixels,
    shares_of,
)
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import prepare
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.meshes.teapot import teapot


def frame(design, triangles, exponent, width, height):
    scene = scene_for(teapot(triangles), exponent, width, height)
    return prepare(scene, design).spans, FrameConstants.of(scene, 1)


def dark_pixels(design, spans, constants, term):
    """Pixels that a term leaves black, in a picture that shows every step of it.

    Ambient light is 1/64 below what is rounded up. A step of a term, 2^-17, times the largest colour operand,
    2048 - 1/64, is just under that; so there are two equal lights.
    """
    full, black = np.full((2, 3), 2**17 - 1), np.zeros((2, 3), dtype=np.int64)
    vectors = {name: np.repeat(getattr(constants, name), 2, axis=0) for name in ("direction", "halfway")}
    colors = {"ambient": np.full(3, 31), "diffuse": black, "specular": black, term: full}
    pixels = dataclasses.replace(design, lights=2).compute(
        spans, dataclasses.replace(constants, **vectors, **colors)
    )
    return ~pixels.color.any(axis=1)


@pytest.mark.parametrize(("model", "exponent"), [("cosquad", 20), ("coscos4", 200), ("blinn_product", 50)])
def test_shares_are_those_of_the_pixels(model, exponent):
    """Counted in pictures of the terms alone, span by span."""
    design = preset("quadratic", model)
    spans, constants = frame(design, 1000, exponent, 160, 120)
    dark = dark_pixels(design, spans, constants, "specular")
    behind = dark_pixels(design, spans, constants, "diffuse")
    lit = design.lit_spans(spans, constants)[:, 0]
    ends = np.cumsum(spans.length)
    expected = dict.fromkeys(("gated_spans", "gated_pixels", "dark_spans", "dark_span_pixels"), 0)
    for end, length, let_through in zip(ends, spans.length, lit, strict=True):
        all_dark = dark[end - length : end].all()
        assert all_dark or let_through
        if not let_through:
            expected["gated_spans"] += 1
            expected["gated_pixels"] += length
        if all_dark:
            expected["dark_spans"] += 1
            expected["dark_span_pixels"] += length
    assert shares_of(design, spans, constants) == Shares(
        spans=len(spans),
        pixels=ends[-1],
        dark_pixels=np.count_nonzero(dark),
        behind_pixels=np.count_nonzero(behind),
        **expected,
    )
    assert 0 < expected["gated_pixels"] < np.count_nonzero(dark) < ends[-1]


def test_empty_spans_do_not_count():
    design = preset("quadratic", "cosquad")
    spans, constants = frame(design, 300, 50, 40, 30)
    longer = spans[np.repeat(np.arange(len(spans)), 2)]
    longer.length[1::2] = 0
    assert shares_of(design, longer, constants) == shares_of(design, spans, constants)
    assert shares_of(design, spans[:0], constants) == Shares(*[0] * 8)


@pytest.mark.long
def test_gate_saves_cycles_of_the_compact_style_and_no_pixel_changes():
    """Blinn's power takes 42 cycles a pixel: a gated pixel takes 3, one a channel of its diffuse term."""
    off, on = (preset("quadratic", "blinn_product", gate=gate) for gate in (False, True))
    spans, constants = frame(off, 300, 200, 10, 8)
    expected = off.compute(spans, constants)
    runs = frames(
        [ShadingPipelineUnit(design.built(style="compact")) for design in (off, on)],
        spans,
        constants,
        "pysim",
    )
    assert all(same_pixels(run, expected) for run in runs)
    shares = shares_of(off, spans, constants)
    assert runs[0].total_cycles > 42 * (shares.pixels - shares.behind_pixels)
    assert runs[1].total_cycles < runs[0].total_cycles


def test_a_pixel_that_differs_is_found():
    design = preset("quadratic", "cosquad")
    pixels = design.compute(*frame(design, 300, 50, 40, 30))
    names = ("x", "y", "r", "g", "b", "last")
    beats = np.zeros(len(pixels.x), [(name, np.int64) for name in names])
    for name, codes in zip(names, (pixels.x, pixels.y, *pixels.color.T, pixels.last), strict=True):
        beats[name] = codes
    assert same_pixels(SimpleNamespace(beats=beats), pixels)
    for name in names:
        wrong = beats.copy()
        wrong[name][-1] ^= 1
        assert not same_pixels(SimpleNamespace(beats=wrong), pixels)
    assert not same_pixels(SimpleNamespace(beats=beats[:-1]), pixels)


SHARES = Shares(100, 1000, 40, 500, 45, 600, 700, 100)
ROW = GateRow(
    "teapot",
    "blinn_product",
    50,
    SHARES,
    cycles=(1100, 1100),
    compact_cycles=(42000, 21000),
    identical=True,
)


@pytest.fixture
def counted(monkeypatch):
    """Rows without a simulation; what they were asked for."""
    asked = {}

    def measured(meshes, models, exponents, width, height, method):
        asked.update(models=tuple(models), exponents=tuple(exponents), size=(width, height))
        asked["method"] = method
        asked["meshes"] = [loaded.name for loaded in meshes]
        for loaded in meshes:
            yield dataclasses.replace(ROW, mesh=loaded.name, identical=asked.get("identical", True))

    monkeypatch.setattr(gate, "measure", measured)
    return asked


def test_tables(counted, capsys):
    assert main([]) == 0
    assert counted["meshes"] == ["teapot"]
    assert (counted["models"], counted["exponents"]) == (gate.MODELS, gate.EXPONENTS)
    assert counted["method"] == gate.METHOD
    assert counted["size"] == (320, 240)
    lines = capsys.readouterr().out.splitlines()
    rows = [line.strip("| ").split(" | ") for line in lines if line.startswith("| teapot")]
    head = ["teapot", "blinn_product", "50"]
    assert rows == [
        [*head, "100", "1,000", "40.0%", "50.0%", "60.0%", "70.0%", "10.0%"],
        [*head, "42,000", "21,000", "50.0%", "1,100", "1,100", "0.0%"],
    ]
    assert lines[-1] == "1 of 1 frames are equal to the bit with the gate off and on."


def test_json(counted, capsys, tmp_path):
    path = tmp_path / "gate.json"
    arguments = ["teapot", "--size", "64x48", "--model", "blinn_product", "--exponent", "7"]
    arguments += ["--json", str(path), "--method", "angular"]
    assert main(arguments) == 0
    assert (counted["models"], counted["exponents"], counted["size"]) == (("blinn_product",), (7,), (64, 48))
    figures = json.loads(path.read_text())
    assert (figures["method"], figures["width"], figures["height"]) == ("angular", 64, 48)
    [row] = figures["frames"]
    assert row["shares"] == dataclasses.asdict(SHARES)
    assert row["compact_cycles"] == [42000, 21000]


def test_a_frame_that_differs_fails(counted, capsys):
    counted["identical"] = False
    assert main([]) == 1
    assert capsys.readouterr().out.splitlines()[-1].startswith("0 of 1 frames are equal")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["missing.obj"], "missing.obj: "),
        (["--size", "640"], "--size 640: not a size; give WIDTHxHEIGHT"),
        (["--size", "0x9"], "--size 0x9: out of range"),
        (["--exponent", "1001"], "Invalid value for '--exponent'"),
        (["--model", "phong"], "Invalid value for '--model'"),
        (["--method", "quotient"], "Invalid value for '--method'"),
        (["--json", "no/such/folder.json"], "no/such/folder.json: "),
    ],
)
def test_bad_input_is_one_line(arguments, message, capsys):
    assert main(arguments) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith(f"blysk.bench.report.gate: {message}")
    assert output.err.count("\n") == 1


@pytest.mark.long
def test_measures_what_the_gate_saves():
    """Real frames: the gate takes no cycles of the throughput style, and saves some of the compact one."""
    units = GateUnits("cosquad")
    for exponent in (10, 200):
        row = units.compare("teapot", scene_for(teapot(1000), exponent, 160, 120))
        assert row.identical
        assert row.exponent == exponent
        (off, on), (small_off, small_on) = row.cycles, row.compact_cycles
        assert off <= on <= off + 8
        assert small_on <= small_off
