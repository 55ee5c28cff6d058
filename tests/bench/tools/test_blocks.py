"""The table of the units has every unit, measures what it prints, and errors are within the stated bounds."""

import ast
import json
import re
from pathlib import Path

import numpy as np
import pytest

from blysk.bench.tools import blocks
from blysk.bench.tools.blocks import ENTRIES, Entry, entry_of, rows, sample_of, table
from blysk.bench.units.record import Record, Variant
from blysk.bench.units.registry import RECORDS
from blysk.bench.units.sample import Decisions, Sample
from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.number.fixed import Fixed
from blysk.sim.cli.main import main

PROJECT = Path(__file__).parents[3]
FEW = 4000
# Classes of `hdl` without a record: parts that compute nothing, base classes, and parts of a unit with a
# record.
PARTS = {
    "FrameConstantsUnit": "registers behind a write port",
    "PixelAssemblerUnit": "joins two streams",
    "PixelJoinerUnit": "a register of the pixels of several pipelines",
    "PixelMergerUnit": "in the pixel pipelines, takes turns",
    "PixelPipelinesUnit": "the same without the merger, which gives the streams a record needs",
    "WidePipelinesUnit": "the same with wide beats, whose order depends on the cycles",
    "PipelinedUnit": "base class of units",
    "AccumulatorUnit": "base class of difference accumulators",
    "InterpolatorUnit": "base class of methods",
    "NormalInterpolatorUnit": "base class of methods that find normals",
    "ChordAccumulatorUnit": "difference accumulators, in the local chord interpolator",
    "ChordSpansUnit": "three values a span and their differences, in the local chord interpolator",
    "LineAccumulatorUnit": "difference accumulators, in the renormalising interpolator",
    "LineAdapterUnit": "true lines of spans, in the render unit",
    "SlopeUnit": "in every specular unit",
    "AxiLiteUnit": "a bus on one side",
    "WishboneUnit": "a bus on one side",
    "BusUnit": "framing and registers around a core",
    "BandBufferUnit": "memories between two clocks",
    "BandDepthUnit": "a memory, no streams",
    "ClockUnit": "cells of the vendor",
    "ControlsUnit": "buttons, no streams",
    "DisplayTimingUnit": "counters, no streams",
    "DisplayUnit": "bands to a monitor, in the GPU",
    "DrawUnit": "a mesh to bands, in the GPU",
    "GpuUnit": "a mesh to a monitor",
    "FlashReaderUnit": "pins of a flash, no stream at the input",
    "LoaderUnit": "a receiver, a flash reader and a decoder, in the GPU",
}
# Units with every kind of cell that are quickly measured.
FEW_ENTRIES = [
    *map(entry_of, ("dot_product", "difference_accumulator"), ("", "")),
    *map(entry_of, ("bisection", "recurrence"), ("1, 45", "direct")),
    *map(entry_of, ("specular", "intensity"), ("cosquad7, as published", "1 light, compact")),
]


def errors(unit, variant="", samples=FEW, seed=1):
    return sample_of(entry_of(unit, variant), samples, seed).errors


def check_json_equals_the_table(entries, folder):
    """Run the command for some entries. Every cell of the text equals that of the file."""
    path = folder / "blocks.json"
    with pytest.MonkeyPatch.context() as patch:
        lines = []
        patch.setattr(blocks, "ENTRIES", tuple(entries))
        patch.setattr("click.echo", lambda text, **_: lines.append(text))
        options = ["--samples", "1000", "--seed", "7", "--jobs", "1", "--json", str(path)]
        assert main(["blocks", *options]) == 0
    report, text = json.loads(path.read_text()), "\n".join(lines)
    assert (report["samples"], report["seed"]) == (1000, 7)
    head, *lines = text.splitlines()
    assert len(lines) == len(report["blocks"]) == len(entries)
    assert max(map(len, text.splitlines())) <= 132
    # Columns end, or start, with the columns of the head.
    starts = [head.index(word) for word in ("unit", "variant", "model", "multipliers")]
    for line, entry, row in zip(lines, entries, report["blocks"], strict=True):
        assert (row["unit"], row["variant"]) == (entry.record.name, entry.name)
        assert line[: starts[1]].strip() == row["unit"]
        names, cells = line[starts[1] : starts[3]], line[starts[3] :]
        assert names.startswith(row["variant"])
        # After the variant come the unit of the errors, if there is one, and then numbers.
        figures = names[len(row["variant"]) :].split()
        unit = figures.pop(0) if len(figures) == 8 else "1"
        assert unit == row["error_unit"]
        for cell, key in zip(figures[:3], ("model_error", "arithmetic_error", "total_error"), strict=True):
            expected = row[key]
            assert (
                cell == "-" if expected is None else float(cell) == pytest.approx(expected, rel=0.051, abs=0)
            )
        keys = ("latency", "initiation_interval", "rom_bits", "register_bits")
        assert [int(cell) for cell in figures[3:]] == [row[key] for key in keys]
        found = {width: int(count) for count, width in re.findall(r"(\d+)\*(\S+)", cells)}
        assert found.pop("c", 0) == row["constant_multipliers"]
        assert {w if "x" in w else f"{w}x{w}": count for w, count in found.items()} == row["multipliers"]


def test_every_unit_has_a_record():
    units = set()
    for path in (PROJECT / "hdl").rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and re.fullmatch("[A-Z].*(?<!Functional)Unit", node.name):
                units.add(node.name)
    makers = [
        getattr(variant.unit, "func", variant.unit)
        for record in RECORDS.values()
        for variant in record.variants.values()
    ]
    found = {maker.__name__ for maker in makers if isinstance(maker, type)}
    assert not found & set(PARTS)
    assert units == found | set(PARTS)


@pytest.mark.ci
@pytest.mark.long
def test_json_equals_the_table(tmp_path):
    """For units with every kind of cell, and for those with the longest names."""
    others = (entry for entry in ENTRIES if entry not in FEW_ENTRIES)
    longest = sorted(others, key=lambda entry: len(entry.title))[-3:]
    check_json_equals_the_table([*FEW_ENTRIES, *longest], tmp_path)


@pytest.mark.long
def test_rows_do_not_depend_on_each_other_or_on_the_number_of_processes():
    few = [entry_of("gpq", ""), entry_of("diffuse", ""), entry_of("chord", "")]
    lines = list(rows(few, 1000, 5))
    alone = list(rows(few[1:2], 1000, 5))
    spread = list(rows(few, 1000, 5, jobs=2))
    assert lines[1].as_dict() == alone[0].as_dict()
    assert table(lines).splitlines()[2].split() == table(alone).splitlines()[1].split()
    assert [row.as_dict() for row in spread] == [row.as_dict() for row in lines]
    assert [row.entry for row in spread] == few


@pytest.mark.parametrize(("kind", "share"), [(Sample, 0.25), (Decisions, 1)])
def test_chunks_are_of_bounded_size_and_lose_no_error(kind, share, monkeypatch):
    sizes = []

    def measure(rng, count):
        sizes.append(count)
        found, exact = rng.integers(0, 2, (2, count))
        return kind(found, exact, found * 0.75 + exact * 0.25)

    entry = entry_of("diffuse", "")
    variant = Variant(entry.variant.unit, measure, "all")
    record = Record("diffuse", "", "", {"": variant}, entry.record.expect, {})
    monkeypatch.setattr(blocks, "_CHUNK", 1000)
    monkeypatch.setattr(blocks, "entry_of", None)
    whole = sample_of(Entry(record, ""), 3500)
    assert sizes == [875] * 4
    (row,) = rows([Entry(record, "")], 3500)
    assert row.errors == whole.errors
    assert (row.samples, np.size(whole.found)) == (3500, 3500)
    if kind is Sample:
        assert row.errors == (0.75, 0.25, 1)


def test_samples_and_decisions():
    sample = Sample(np.array([1.0, 2.0, 3.0]), np.array([1.5, 2.0, 3.0]), np.array([1.25, 2.5, 3.0]))
    assert sample.errors == sample.extremes.errors == (0.5, 0.5, 0.5)
    assert Sample(np.array([1.0, 2.0]), np.array([1.5, 2.0])).errors == (None, None, 0.5)
    # Wrong yes, wrong no, and both, as shares of all decisions.
    decisions = Decisions.of(np.array([1, 1, 1, 0, 0]) > 0, np.array([1, 0, 0, 0, 1]) > 0)
    assert decisions.errors == decisions.extremes.errors == pytest.approx((0.4, 0.2, 0.6))


# Errors: measured, published, and none by a word that wraps. Tests of the models check their bounds.

UNITS = [entry for entry in ENTRIES if entry.record.name != "pipeline"]
QUICK = [e for e in UNITS if "interpolator" not in e.record.name and not e.variant.exhaustive]
PIPELINES = [entry.name for entry in ENTRIES if entry.record.name == "pipeline"]


@pytest.mark.long
@pytest.mark.parametrize("entry", UNITS, ids=lambda entry: entry.title)
def test_errors_are_measured(entry):
    """The total error is 0 only for an exact unit.

    It is at most the sum of model error and arithmetic error.
    """
    model, arithmetic, total = sample_of(entry, FEW, 3).errors
    assert (model is None) == (arithmetic is None)
    assert np.isfinite(total)
    assert (total == 0) == (entry.variant.note == "exact")
    assert model is None or total <= model + arithmetic + 1e-12


@pytest.mark.parametrize("samples", [300, pytest.param(200_000, marks=pytest.mark.long)])
def test_no_word_wraps_in_its_domain(monkeypatch, samples):
    """Exceptions are phases of the angular setup, where 1 is a turn, and steps of attributes, which are
    modulo 4."""
    wraps, found = Fixed.wrap, set()

    def watched(number, format):
        result = wraps(number, format)
        if not np.array_equal(result.codes, number.codes):
            found.add((entry.record.name, format))
        return result

    monkeypatch.setattr(Fixed, "wrap", watched)
    for entry in ENTRIES if samples > FEW else QUICK:
        sample_of(entry, samples)
    units, formats = (set(names) for names in zip(*found, strict=True))
    assert units <= {"angular_setup", "angular_interpolator", "pipeline", "gradient_setup"}
    assert formats == {AngularSetup.PHASE_FORMAT, AngularSetup.DIRECTION_FORMAT, GradientSetup.FORMAT}


@pytest.mark.parametrize(
    "unit",
    [
        pytest.param(name, marks=() if name in ("diffuse", "arccos") else pytest.mark.long)
        for name in dict.fromkeys(entry.record.name for entry in ENTRIES)
    ],
)
def test_same_seed_same_figures(unit):
    entry = next(entry for entry in ENTRIES if entry.record.name == unit)
    first, again, other = (sample_of(entry, 1000, seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.found, again.found)
    assert first.errors == again.errors
    if entry.variant.exhaustive:
        # Every operand is there, and some of the arc cosine's.
        assert unit != "arccos" or np.size(first.found) == 2**17 + 1
        np.testing.assert_array_equal(first.found, other.found)
    else:
        assert first.found.shape != other.found.shape or np.any(first.found != other.found)


@pytest.mark.long
@pytest.mark.parametrize("variant", PIPELINES)
def test_pipeline(variant):
    _, arithmetic, total = errors("pipeline", variant)
    # Half a step of the channel; steep highlights of n up to 1000 add to it.
    assert 0.4 < arithmetic < 4
    if variant == "quotient, blinn":
        # The model is that of the reference, so only the method and the arithmetic make errors.
        assert total < 1


def test_gate_lets_something_through_for_nothing():
    wasted, _, _ = errors("highlight_gate", "conservative", 100_000)
    assert 0.005 < wasted < 0.05
