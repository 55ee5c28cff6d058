"""Random pixels of pipelines, and random beats of units, compared with the bit-accurate models."""

import functools
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from amaranth.lib.wiring import Component

from blysk.bench.speed.verilator import Verilated, free_stimulus
from blysk.bench.store import Task
from blysk.bench.units.pipeline_spans import ends_for, tabled, vectors_for
from blysk.bench.units.record import Beats, length_of
from blysk.bench.units.registry import RECORDS
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.geometry import normalise
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import unpack
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import simulate, stimulus_of
from blysk.sim.frames.frame import beats_of
from blysk.sim.frames.vectors import pixel_beats

__all__ = [
    "DESIGNS",
    "WIDEST",
    "measure",
    "measure_unit",
    "random_constants",
    "random_spans",
    "table",
    "tasks",
    "tasks_of_unit",
]

_MODELS = {
    "linear": "cosquad7",
    "quadratic-eval": "lyon3",
    "quadratic-horner": "exp",
    "angular": "coscos2",
    "recurrence": "coscos4",
    "renormalise": "blinn_product",
    "quotient": "phong",
}
"""Reflection models by method. Other methods have ``cosquad``."""

DESIGNS = (
    *(
        (name, _MODELS.get(name, "cosquad"), name == "quadratic-horner")
        for name, method in METHODS.items()
        if name != "bisection" and not method.given_values
    ),
    ("quadratic", "cosquad", True),
    ("renormalise", "cosquad_q", False),
    ("quadratic", "blinn", True),
    ("quotient", "blinn", False),
)
"""Method, model and gate of each design.

Every specular unit has a design. Every method that takes normals or vectors, and gives a pixel a cycle, has a
design, too. In the default design each batch writes the table of another lobe.
"""

WIDEST = 44
"""Largest angle between the normals of a span, in degrees. Methods for angles under 45 degrees accept it."""

_PART, _BATCH = 10**7, 250_000
"""Largest numbers of pixels of a task and of a batch. The last span of each may go beyond."""

_IDLE_TIMEOUT = 10_000

_LENGTH_SEED = 2026
"""Seed of the beats from which the length of a unit's runs is estimated."""

# Approximate number of beats of a unit's task, and of cycles of a simulation. Verilator is slow, so it runs
# only every `_UNIT_BASELINE`-th task.
_UNIT_PART, _CLOCKS, _UNIT_BASELINE = 10**5, 500_000, 4
# A geometry unit takes 4096 cycles for a triangle of 4096 scanlines without pixels. A compact geometry unit
# takes 16384 cycles. Several of these triangles may follow each other. The longest pause in 800,000 triangles
# was 28,724 cycles.
_UNIT_IDLE_TIMEOUT = 200_000


def random_spans(rng: np.random.Generator, pixels: int, towards: np.ndarray) -> Spans:
    """Random spans. Most are short, some are empty, and a few have up to 4095 pixels.

    Half of the left normals are near a vector, at distances of about 10^-4 to 1, so that highlights occur.
    The other normals have any direction. Half of the angles between the ends are uniform from 0 to `WIDEST`
    degrees. The logarithms of the other angles are uniform over the six decades up to `WIDEST`.

    Parameters
    ----------
    rng : Generator
        Random generator of all values.
    pixels : int
        Approximate number of pixels. The last span may go beyond this number. A small number may not be
        reached.
    towards : float array, shape (3,)
        Vector near which half of the left normals are.
    """
    count = pixels // 20 + 1
    length = np.where(rng.random(count) < 0.002, rng.integers(0, 4096, count), rng.geometric(1 / 32, count))
    length[rng.random(count) < 0.001] = 0
    length = length[: np.searchsorted(np.cumsum(length), pixels) + 1]
    count = len(length)
    left = rng.normal(size=(count, 3))
    near = towards + left * 10.0 ** rng.uniform(-4, 0, (count, 1))
    left = normalise(np.where(rng.random((count, 1)) < 0.5, near, left))
    normal = normalise(np.cross(left, rng.normal(size=(count, 3))))
    angle = WIDEST * np.where(rng.random(count) < 0.5, rng.random(count), 10.0 ** rng.uniform(-6, 0, count))
    angle = np.radians(angle)[:, None]
    return Spans(
        x=rng.integers(0, 4096, count),
        y=rng.integers(0, 4096, count),
        length=length,
        normal_left=quantise(left),
        normal_right=quantise(left * np.cos(angle) + normal * np.sin(angle)),
    )


def random_constants(rng: np.random.Generator) -> FrameConstants:
    """Constants of a light with random L and H, and colours that may saturate.

    The exponent is 1 to 1000, and its logarithm is uniform.
    """
    vectors = normalise(rng.normal(size=(2, 1, 3)))
    brightness = rng.choice([0.5, 1.0, 8.0])
    return FrameConstants(
        exponent=round(MAX_EXPONENT ** rng.random()),
        ambient=Intensity.color(rng.uniform(0, 0.2, 3)),
        direction=quantise(vectors[0]),
        halfway=quantise(vectors[1]),
        diffuse=Intensity.color(rng.uniform(0, brightness, (1, 3))),
        specular=Intensity.color(rng.uniform(0, brightness, (1, 3))),
    )


@functools.cache
def _models(design: ShadingPipeline, baseline: bool) -> tuple[ShadingPipelineUnit, Verilated | None]:
    """The pipeline, and with ``baseline`` Verilator's model of the pipeline. A process builds them once."""
    unit = ShadingPipelineUnit(design)
    return unit, Verilated(unit, Path(tempfile.mkdtemp(prefix="blysk-"))) if baseline else None


def _hold(engine: str, where: str, found: Mapping | np.ndarray, expected: Mapping[str, np.ndarray]) -> None:
    """Raise `SimulationError` if a beat differs from the bit-accurate model. The message names this beat."""
    for name, values in expected.items():
        differs = np.unique(np.nonzero(found[name] != values)[0])
        if len(differs):
            at = differs[0]
            text = f"{name} is {found[name][at]}, not {values[at]}, in {len(differs)} beats"
            raise SimulationError(f"{engine}: {where}: beat {at}: {text}")


def measure(
    method: str, model: str, gate: bool, pixels: int, seed: int, part: int, baseline: str | None
) -> dict[str, int]:
    """Send random spans through a pipeline, and compare beats and status with the bit-accurate model.

    Parameters
    ----------
    method, model, gate
        The design, as in `preset`.
    pixels : int
        Least number of pixels.
    seed, part : int
        Seeds of the random generator.
    baseline : str or None
        Version of Verilator. Its model then runs the same spans. ``None``: without Verilator.

    Returns
    -------
    dict
        ``pixels``, ``spans`` and ``cycles`` of the compiled engine; ``stalled``, the number of its pixels in
        batches with stalls; and ``baseline_pixels``, pixels of Verilator's model.

    Raises
    ------
    SimulationError
        If a beat or the status differs, or an engine fails.
    """
    design = preset(method, model, gate=gate)
    unit, verilated = _models(design, baseline is not None)
    rng = np.random.default_rng([seed, part])
    totals = dict.fromkeys(("pixels", "spans", "cycles", "stalled", "baseline_pixels"), 0)
    while totals["pixels"] < pixels:
        constants = tabled(design, random_constants(rng))
        spans = random_spans(rng, min(_BATCH, pixels - totals["pixels"]), constants.halfway[0] / ONE)
        spans = ends_for(design, spans)
        if not design.interpolator.brings_ends:
            spans = replace(spans, vectors=vectors_for(rng, design, spans.length))
        shaded = design.compute(spans, constants)
        expected, beats = pixel_beats(shaded), beats_of(unit, spans)
        shares = rng.choice([0.0, 0.5], 2) * rng.random(2)
        found = simulate(
            unit,
            beats,
            count=len(shaded.x),
            write=constants.writes(),
            input_stalls=rng.random(997) < shares[0],
            output_stalls=rng.random(1009) < shares[1],
        )
        where = f"{method}, {model}, part {part} of seed {seed}, from pixel {totals['pixels']}"
        _hold("cxxrtl", where, found.beats, expected)
        status = {
            "out_of_range_spans": shaded.out_of_range_spans,
            "empty_spans": np.count_nonzero(spans.length == 0),
            "overrun": np.any((spans.x + spans.length > 4096) & (spans.length > 0)),
        }
        _hold("cxxrtl", f"{where}, status", found.status[None], {k: np.array([v]) for k, v in status.items()})
        if verilated is not None:
            stimulus = free_stimulus(verilated.ports, beats, constants.writes(), len(shaded.x), _IDLE_TIMEOUT)
            output, _ = verilated.run(stimulus)
            _hold("verilator", where, unpack(verilated.ports.o, output), expected)
            totals["baseline_pixels"] += len(shaded.x)
        totals["pixels"] += len(shaded.x)
        totals["spans"] += len(spans)
        totals["cycles"] += int(found.total_cycles)
        totals["stalled"] += len(shaded.x) * int(shares.any())
    return totals


def measure_unit(unit: str, beats: int, seed: int, part: int, baseline: str | None) -> dict[str, int]:
    """Send every stimulus of a unit's record, with new random numbers, and compare outputs with the model.

    The stimuli take about equal numbers of cycles. So there are many small triangles and few large triangles.

    Parameters
    ----------
    unit : str
        A key of `RECORDS`. Its default variant is tested.
    beats : int
        Least number of input beats of all stimuli together.
    seed, part : int
        Seeds of the random generator.
    baseline : str or None
        Version of Verilator. Its model then runs the same beats without stalls. ``None``: without Verilator.

    Returns
    -------
    dict
        ``beats``, input beats; ``outputs``, output beats compared; ``cycles`` and ``stalled``, outputs in
        runs with stalls, of the compiled engine; and ``baseline_outputs``, outputs of Verilator's model.

    Raises
    ------
    SimulationError
        If a beat or the port ``status`` differs, or an engine fails.
    """
    record = RECORDS[unit]
    component = _unit(unit)
    verilated = _verilated(unit) if baseline else None
    rng = np.random.default_rng([seed, part])
    totals = dict.fromkeys(("beats", "outputs", "cycles", "stalled", "baseline_outputs"), 0)
    shares_of = _beats_of_runs(unit)
    while totals["beats"] < beats:
        share = min(1, (beats - totals["beats"]) / sum(shares_of.values()))
        for name, stimulus in record.stimuli_of(record.default).items():
            case = stimulus.make(component, rng, max(stimulus.count, round(share * shares_of[name])))
            expected = dict(_fields(record.expect(component, case), "beat"))
            count = len(next(iter(expected.values())))
            shares = rng.choice([0.0, 0.5], 2) * rng.random(2) * stimulus.stalled
            found = simulate(
                component,
                case.beats,
                count=count,
                **case.sent,
                input_stalls=rng.random(997) < shares[0],
                output_stalls=rng.random(1009) < shares[1],
                idle_timeout=_UNIT_IDLE_TIMEOUT,
            )
            where = f"{unit}, {name}, part {part} of seed {seed}, from beat {totals['beats']}"
            _hold("cxxrtl", where, dict(_fields(found.beats, "beat")), expected)
            if verilated is not None:
                free = stimulus_of(
                    component,
                    case.beats,
                    count=count,
                    **case.sent,
                    idle_timeout=_UNIT_IDLE_TIMEOUT,
                )
                output = unpack(verilated.ports.o, verilated.run(free)[0])
                _hold("verilator", where, dict(_fields(output, "beat")), expected)
                totals["baseline_outputs"] += count
            if record.status and "status" in component.signature.members:
                status = record.status(component, case)
                expected = {key: np.array([value]) for key, value in status.items()}
                _hold("cxxrtl", f"{where}, status", {key: [found.status[key]] for key in status}, expected)
            totals["beats"] += length_of(case.beats)
            totals["outputs"] += count
            totals["cycles"] += int(found.total_cycles)
            totals["stalled"] += count * int(shares.any())
    return totals


@functools.cache
def _beats_of_runs(unit: str) -> dict[str, int]:
    """Number of beats of each stimulus for about `_CLOCKS` cycles, at least as many as in a test."""
    record, component = RECORDS[unit], _unit(unit)
    beats = {}
    for name, stimulus in record.stimuli_of(record.default).items():
        case = stimulus.make(component, np.random.default_rng(_LENGTH_SEED), stimulus.count)
        found = simulate(
            component,
            case.beats,
            count=length_of(record.expect(component, case)),
            **case.sent,
            idle_timeout=_UNIT_IDLE_TIMEOUT,
        )
        beats[name] = max(stimulus.count, _CLOCKS * stimulus.count // max(1, found.total_cycles))
    return beats


@functools.cache
def _verilated(unit: str) -> Verilated:
    """Verilator's model of a unit, built once in a process."""
    return Verilated(_unit(unit), Path(tempfile.mkdtemp(prefix="blysk-")))


@functools.cache
def _unit(name: str) -> Component:
    record = RECORDS[name]
    return record.variants[record.default].unit()


def _fields(beats: Beats, path: str) -> Iterator[tuple[str, np.ndarray]]:
    """Path and array of every field of beats, nested fields among them."""
    if isinstance(beats, Mapping):
        for name, value in beats.items():
            yield from _fields(value, f"{path}.{name}")
    elif isinstance(beats, np.ndarray) and beats.dtype.names:
        for name in beats.dtype.names:
            yield from _fields(beats[name], f"{path}.{name}")
    else:
        yield path, np.asarray(beats)


def tasks(pixels: int, seed: int, baseline: str | None) -> list[Task]:
    """Tasks of the run. Tasks of one design follow each other.

    Parameters
    ----------
    pixels : int
        Least number of pixels of all tasks together. Each of `DESIGNS` has the same number.
    seed, baseline
        As in `measure`.
    """
    each = -(-pixels // len(DESIGNS))
    parts = -(-each // _PART)
    return [
        Task(
            measure,
            {
                **dict(zip(("method", "model", "gate"), design, strict=True)),
                "pixels": -(-each // parts),
                "seed": seed,
                "part": number * parts + part,
                "baseline": baseline,
            },
        )
        for number, design in enumerate(DESIGNS)
        for part in range(parts)
    ]


def tasks_of_unit(unit: str, beats: int, seed: int, baseline: str | None) -> list[Task]:
    """Tasks of the run of a unit. Verilator runs in every `_UNIT_BASELINE`-th task.

    Parameters
    ----------
    unit, seed, baseline
        As in `measure_unit`.
    beats : int
        Least number of input beats of all tasks together.
    """
    parts = -(-beats // _UNIT_PART)
    each = -(-beats // parts)
    common = {"unit": unit, "beats": each, "seed": seed}
    return [
        Task(measure_unit, common | {"part": part, "baseline": None if part % _UNIT_BASELINE else baseline})
        for part in range(parts)
    ]


def table(tasks: Sequence[Task], results: Sequence[Mapping[str, int]]) -> list[dict[str, Any]]:
    """A row for each design or unit, and a row for all, with the sums of the counts.

    Parameters
    ----------
    tasks, results : sequences
        Tasks of `tasks` or `tasks_of_unit`, and the result of each task.
    """
    rows: dict[str, dict[str, Any]] = {}
    for task, result in zip(tasks, results, strict=True):
        name = _name(task.settings)
        for key in (name, "all"):
            row = rows.setdefault(key, {"design": key, **dict.fromkeys(result, 0)})
            for figure, value in result.items():
                row[figure] += value
    rows["all"] = rows.pop("all")
    return list(rows.values())


def _name(settings: Mapping[str, Any]) -> str:
    if "unit" in settings:
        return settings["unit"]
    return f"{settings['method']}, {settings['model']}{', gate' if settings['gate'] else ''}"
