"""Clock counts of the pipeline, which are exact, and the tables made of them."""

import json
import math

import numpy as np
import pytest

from blysk.bench.accuracy import scene_for
from blysk.bench.speed import throughput
from blysk.bench.speed.throughput import BINS, Lengths, Throughput, main, measure, spans_of
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.pipeline import Spans
from blysk.golden.presets import preset
from blysk.golden.reference.raster import rasterise
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.meshes.teapot import teapot

ZEROS = np.zeros((1, 3), dtype=np.int64)
CONSTANTS = FrameConstants(20, ZEROS[0], ZEROS, ZEROS, ZEROS, ZEROS)


def spans(lengths):
    """Spans of those lengths, all with one normal."""
    lengths = np.asarray(lengths)
    normal = np.tile([0, 0, 131071], (len(lengths), 1))
    places = np.zeros(len(lengths), dtype=np.int64)
    return Spans(places, places, lengths, normal, normal)


@pytest.mark.long
def test_cycles_are_those_of_the_arithmetic(monkeypatch):
    """A span takes the larger of its pixels and the setup interval, one pixel a cycle."""
    runs, interval = [], 7

    def simulated(*arguments, **options):
        runs.append(simulate(*arguments, **options))
        return runs[-1]

    monkeypatch.setattr(throughput, "simulate", simulated)
    count = 70
    lengths = np.repeat([12, 1, 9, 3, interval], count)
    # A long span pays for a short one after it.
    lengths = np.append(lengths, [1, 2 * interval - 1] * 8)
    unit = ShadingPipelineUnit(preset("quadratic", "cosquad", setup_interval=interval))
    pixels, total = measure(unit, spans(lengths), CONSTANTS, engine="pysim")
    assert pixels == lengths.sum()
    ends = runs[0].cycles[np.cumsum(lengths) - 1]
    assert total == ends[-1] + 1
    # By then those of the lengths before are paid for, and FIFOs are empty.
    for group in range(5):
        last = ends[count * group + count - 5 : count * (group + 1)]
        assert np.diff(last).tolist() == [max(lengths[count * group], interval)] * 4
    assert np.diff(ends[-7::2]).tolist() == [2 * interval] * 3


def test_no_spans_take_no_clock():
    assert measure(None, spans([]), CONSTANTS) == (0, 0)


def test_lengths():
    length = [1, 1, 2, 3, 4, 7, 8, 15, 16, 31, 32, 4095]
    row = Lengths.of(5, "renormalise", np.array(length))
    assert (row.spans, row.pixels) == (12, sum(length))
    members = [[1, 1], [2], [3], [4, 7], [8, 15], [16, 31], [32, 4095]]
    assert len(members) == len(BINS)
    assert row.span_share == pytest.approx([len(group) / 12 for group in members])
    assert row.pixel_share == pytest.approx([sum(group) / sum(length) for group in members])


def test_lengths_of_nothing():
    row = Lengths.of(5, "renormalise", np.array([], dtype=int))
    assert (row.spans, row.pixels, row.span_share) == (0, 0, (0.0,) * len(BINS))


def test_spans_hold_the_frame():
    """Cutting moves no pixel; renormalise, which has the true line, needs fewer spans."""
    scene = scene_for(teapot(1000), 1000, 160, 120)
    pixels = len(rasterise(scene).span)
    count = {}
    for method in ("renormalise", "quadratic"):
        found = spans_of(scene, method)
        assert found.length.sum() == pixels
        count[method] = len(found)
    assert count["renormalise"] < count["quadratic"]


def test_figures():
    row = Throughput(1000, "renormalise", 4, pixels=900, cycles=1000, long_pixels=800, long_cycles=820)
    assert row.cycles_per_pixel == pytest.approx(10 / 9)
    assert row.setup_share == pytest.approx(0.1)
    assert row.long_cycles_per_pixel == pytest.approx(1.025)
    none = Throughput(1000, "renormalise", 4, pixels=0, cycles=1, long_pixels=0, long_cycles=0)
    assert math.isnan(none.cycles_per_pixel)
    assert none.long_cycles_per_pixel is None


@pytest.fixture
def counted(monkeypatch):
    """A pipeline of so many cycles a pixel, without the run."""
    rate = {"cycles": 1.04}

    def measured(unit, some, constants):
        pixels = int(np.sum(some.length))
        return pixels, math.ceil(pixels * rate["cycles"])

    monkeypatch.setattr(throughput, "measure", measured)
    monkeypatch.setattr(throughput, "ShadingPipelineUnit", lambda design: None)
    return rate


SMALL = ["300", "--width", "160", "--height", "120", "--intervals", "3", "9"]


def test_tables(counted, capsys):
    assert main(SMALL) == 0
    lines = capsys.readouterr().out.splitlines()
    table = [line.split(" | ") for line in lines if line.startswith("| ")]
    assert table[0][4:] == ["1", "2", "3", "4-7", "8-15", "16-31", "32+ |"]
    assert [cells[1:3] for cells in table[5:]] == [
        ["quotient", "-"],
        ["renormalise", "3"],
        ["renormalise", "9"],
        ["quadratic", "3"],
    ]
    assert all(cells[4] == "1.040" for cells in table[5:])


def test_json(counted, capsys):
    assert main([*SMALL, "--json", "--methods", "renormalise"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert [row["setup_interval"] for row in figures["cycles"]] == [3, 9]
    assert sum(figures["lengths"][0]["span_share"]) == pytest.approx(1)
    for row in figures["cycles"]:
        assert row["cycles_per_pixel"] == row["cycles"] / row["pixels"]


def test_target(counted, capsys):
    counted["cycles"] = 1.06
    assert main([*SMALL, "--methods", "renormalise"]) == 1
    assert capsys.readouterr().err.count("cycles a pixel, spans of 16+: renormalise, setup interval") == 2
