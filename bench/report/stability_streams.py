"""Simulated pipelines under stalls, between empty spans and after a reset."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from amaranth.hdl import Array, Module, ResetInserter, Signal, Value
from amaranth.lib import wiring

from blysk.bench.accuracy import model_of
from blysk.bench.report.stability_cases import HALFWAY, STREAM_GROUP, arcs, single_spans
from blysk.bench.report.stability_errors import spans_of
from blysk.golden.frames.prepare import constants_of
from blysk.golden.presets import preset
from blysk.hdl.core.views import copy
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import pack
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import beats_of

__all__ = [
    "measure_stream",
    "stream_patterns",
]


class _Interrupted(wiring.Component):
    """A pipeline that takes other spans first, and is reset while these spans are inside."""

    def __init__(self, unit: wiring.Component, before: dict[str, Sequence[int]], cycles: int):
        """``before`` has the words of ``write`` and ``i`` before the reset.

        ``cycles`` is the number of cycles until the reset ends.
        """
        super().__init__(dict(unit.signature.members))
        self._unit, self._before, self._cycles = unit, before, cycles

    def elaborate(self, platform):
        m = Module()
        reset, begun = Signal(), Signal()
        clock = Signal(range(self._cycles + 1))
        m.submodules.unit = ResetInserter(reset)(self._unit)
        m.d.comb += [begun.eq(clock == self._cycles), reset.eq(clock == self._cycles - 1)]
        with m.If(~begun):
            m.d.sync += clock.eq(clock + 1)
        written = Signal()
        for name, ready in (("write", 1), ("i", written)):
            words, inner, outer = self._before[name], getattr(self._unit, name), getattr(self, name)
            index = Signal(range(len(words) + 1))
            done = index == len(words)
            if name == "write":
                m.d.comb += written.eq(done)
            own = Array(words)[index]
            m.d.comb += [
                copy(inner.payload, outer.payload),
                inner.valid.eq(begun & outer.valid),
                outer.ready.eq(begun & inner.ready),
            ]
            with m.If(~begun):
                m.d.comb += [Value.cast(inner.payload).eq(own), inner.valid.eq(~done & ready)]
                with m.If(inner.valid & inner.ready):
                    m.d.sync += index.eq(index + 1)
        m.d.comb += [
            copy(self.o.payload, self._unit.o.payload),
            self.o.valid.eq(begun & self._unit.o.valid),
            self._unit.o.ready.eq(~begun | self.o.ready),
            copy(self.status, self._unit.status),
        ]
        return m


def _words(shape, beats) -> list[int]:
    return [int.from_bytes(row.astype("<u4").tobytes(), "little") for row in pack(shape, beats)]


def stream_patterns(unit: ShadingPipelineUnit) -> Iterator[tuple[str, dict[str, Any]]]:
    """Names and stalls of the runs of `STREAM_GROUP`: options of `simulate`.

    One run has no stalls, and three runs have random stalls. For each side and cycle of the stream of
    `measure_stream` there is a run with a single stall.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        A pipeline.
    """
    rng = np.random.default_rng(STREAM_GROUP)
    yield "no stalls, with empty spans", {}
    for name, shares in (
        ("random stalls on both sides", (0.4, 0.4)),
        ("input mostly stalled", (0.9, 0.1)),
        ("output mostly stalled", (0.1, 0.9)),
    ):
        sides = ("input_stalls", "output_stalls")
        yield name, {side: rng.random(997) < share for side, share in zip(sides, shares, strict=True)}
    cycles = unit.latency + 150
    for side in ("input", "output"):
        for clock in range(cycles):
            yield f"a single stall of the {side}", {f"{side}_stalls": np.arange(1 << 14) == clock}


def measure_stream(method: str, quick: bool) -> list[dict[str, Any]]:
    """Pixels of the simulated pipeline under stalls, between empty spans and after a reset.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    quick : bool
        Whether Amaranth's own simulator runs some of the patterns. Else compiled RTL runs all patterns.

    Returns
    -------
    list of dict
        ``case``; number of ``runs``; ``pixels`` of a run; ``wrong``, pixels of all runs that differ from the
        bit-accurate model's, or ``None`` if a run stopped early.
    """
    design = preset(method, model_of(method))
    unit = ShadingPipelineUnit(design)
    rng = np.random.default_rng(STREAM_GROUP)
    lengths = np.array([5, 0, 1, 1, 0, 0, 9, 2, 3, 0])
    ends = arcs(rng, HALFWAY, rng.uniform(0, 8, 10), 0.5, rng.uniform(0, 20, 10))
    case = single_spans(STREAM_GROUP, "", ends, np.maximum(lengths, 1), 20)
    spans = replace(spans_of(case, design, case.raster), length=lengths)
    (constants,) = constants_of(case.scene, design)
    expected = design.compute(spans, constants)
    beats, write = beats_of(unit, spans), constants.writes()
    engine = "pysim" if quick else "auto"

    def wrong(component, **options) -> tuple[int | None, str]:
        try:
            run = simulate(component, beats, count=len(expected.x), write=write, **options)
        except SimulationError:
            return None, ""
        pairs = [(run.beats[name], getattr(expected, name)) for name in ("x", "y", "last")]
        pairs += [(run.beats[name], expected.color[:, k]) for k, name in enumerate("rgb")]
        return int(np.count_nonzero(np.any([found != codes for found, codes in pairs], axis=0))), run.engine

    found: dict[str, list[int | None]] = {}
    used = ""
    for name, stalls in stream_patterns(unit):
        # Without a compiler a run takes a second.
        if "single" not in name or used == "cxxrtl":
            count, used = wrong(unit, engine=engine, **stalls)
            found.setdefault(name, []).append(count)
    before = {"write": _words(unit.write.payload.shape(), write)}
    before["i"] = _words(unit.i.payload.shape(), beats) * 8
    loaded = len(before["write"])
    for cycles in (unit.latency + 40,) if quick else (3, unit.latency // 2, unit.latency, unit.latency + 40):
        interrupted = _Interrupted(unit, before, loaded + cycles)
        found.setdefault("reset within a span", []).append(wrong(interrupted, engine="pysim")[0])
    return [
        {
            "case": name,
            "runs": len(counts),
            "pixels": len(expected.x),
            "wrong": None if None in counts else sum(counts),
        }
        for name, counts in found.items()
    ]
