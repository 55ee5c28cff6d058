"""Cycles of a frame from the lengths of its spans, for pictures that take long to simulate."""

import warnings

import numpy as np
from amaranth.hdl import UnusedElaboratable

from blysk.bench.accuracy import scene_for
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.hdl.cosines.quotient_lanes import QuotientLanesUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.teapot import teapot

__all__ = ["WAITING", "beat_cycles", "compare", "frame_cycles", "span_cycles", "steady_cycles", "unit_of"]

_NEVER = -(1 << 40)
"""This number stands for minus infinity in sums of cycles."""

WAITING = InterpolatorUnit.room_after
"""`InterpolatorUnit.room_after` of most methods."""

_CHUNK = 1 << 16


def span_cycles(length: np.ndarray, interval: np.ndarray, waiting: int = WAITING) -> int:
    """Cycles from the first pixel of a sequence of spans to the last pixel.

    At most two prepared spans wait before the accumulators. Span k is prepared in cycle

    ``r_k = max(r_{k-1} + I_k, s_{k-2} + w)``,

    and its first pixel is in cycle

    ``s_k = max(s_{k-1} + l_{k-1}, r_k)``.

    I_k is the interval of span k, l_k is the cycles of its pixels, and w is ``waiting``.

    In the max-plus algebra this is a product of matrices. The product is computed in pairs.

    Parameters
    ----------
    length, interval : int arrays, shape (spans,)
        Cycles of the pixels of each span, and least cycles from the previous span to this span.
    waiting : int
        See `WAITING`.
    """
    begin = -int(interval[0]) if len(length) else 0
    state = np.array([0, begin, -waiting, -waiting], dtype=np.int64)
    for first in range(0, len(length), _CHUNK):
        part = slice(first, first + _CHUNK)
        state = (_product(_matrices(length[part], interval[part], waiting)) + state).max(axis=1)
    return int(state[0])


def _matrices(length: np.ndarray, interval: np.ndarray, waiting: int) -> np.ndarray:
    """Max-plus matrices, shape (spans, 4, 4). Matrix k leads from the state of span k - 1 to that of span k.

    The state of span k has four numbers: the cycle after its last pixel, r_k, s_k, and s_{k-1}.
    """
    found = np.full((len(length), 4, 4), _NEVER, dtype=np.int64)
    found[:, :3, 1] = np.asarray(interval)[:, np.newaxis]
    found[:, :3, 3] = waiting
    found[:, 0, 0] = found[:, 2, 0] = 0
    found[:, 0] += np.asarray(length)[:, np.newaxis]
    found[:, 3, 2] = 0
    return found


def _product(matrices: np.ndarray) -> np.ndarray:
    """Max-plus product of all matrices. The last matrix is the left factor."""
    while len(matrices) > 1:
        odd = matrices[-1:] if len(matrices) % 2 else matrices[:0]
        early, late = matrices[: len(matrices) - len(odd)].reshape(-1, 2, 4, 4).swapaxes(0, 1)
        pairs = (late[:, :, :, np.newaxis] + early[:, np.newaxis]).max(axis=2)
        matrices = np.concatenate([pairs, odd])
    return matrices[0]


def beat_cycles(length: np.ndarray, lanes: int, pairs: bool = True) -> int:
    """Cycles from the first beat of a sequence of spans to the last beat, of `QuotientLanesUnit`.

    Span k has b_k beats, and its start is taken in cycle s_k. Its turns begin in cycle t_k. Spans of two
    pixels or more have first differences. Let p be the span with first differences before span k, and f_p the
    cycle in which they are taken. Spans of three pixels or more have second differences. Let q be the span
    with second differences before span k, and e_q the cycle in which they are taken.

    - The last turn of span k is in ``g_k = t_k`` if it has one pixel or is a pair, else in ``g_k = t_k + 1``.
      Then ``t_(k+1) = g_k + 1``.
    - ``e_k = max(t_k + 5, s_q + b_q - 2, s_q)``, and ``t_k >= e_q - 3``, because one second difference waits.
    - ``f_k = max(g_k + 5, e_k + 1, s_p + b_p - 1)``. It is ``s_p + 1`` or more if p has second differences.
    - ``s_k = max(s_(k-1) + b_(k-1), g_k + 5, f_k + 1)``
    - `QuotientLanesUnit.DEPTH` limits the starts that wait: ``t_k >= s_(k-14) - 1``.

    Parameters
    ----------
    length : int array, shape (spans,)
        Pixels of each span, 1 or more.
    lanes : int
        Pixels of a beat.
    pairs : bool
        Whether spans of two pixels are pairs, see `QuotientLanes`.
    """
    waiting = QuotientLanesUnit.DEPTH - 2
    starts: list[int] = []
    turn, free, second, may_second, may_first, first = 0, 0, -8, -8, -8, None
    for pixels, beats in zip(length.tolist(), (-(-length // lanes)).tolist(), strict=True):
        if len(starts) >= waiting:
            turn = max(turn, starts[-waiting] - 1)
        is_long = pixels > (2 if pairs else 1)
        if is_long:
            turn = max(turn, second - 3)
            second = max(turn + 5, may_second)
        last = turn + is_long
        start = max(free, last + 5)
        if pixels > 1:
            start = max(start, last + 6, may_first + 1, second + 2 if is_long else 0)
            may_first = start + max(beats - 1, is_long)
        if is_long:
            may_second = start + max(beats - 2, 0)
        first = start if first is None else first
        starts.append(start)
        turn, free = last + 1, start + beats
    return free - (first or 0)


def frame_cycles(unit: ShadingPipelineUnit, spans: Spans, writes: int) -> int:
    """Cycles of a frame of one material without stalls, from the first write of a constant to the last pixel.

    If the interval of spans is constant, the result is equal to the cycles of a simulation. `compare` finds
    equal cycles for ``quotient``, too. The result is within 3 % of the cycles for ``chord-local``,
    ``bisection`` and ``quadratic-eval``, and within 12 % for ``quadratic-horner``.

    With vertex colours, or with the filter ``nearest``, the result for ``quotient`` stays equal. Texels of
    ``bilinear`` come some cycles after the light, and spans of few pixels wait for them. In a frame of 2.5
    pixels a span the result is 4 % short.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        The pipeline in throughput style.
    spans : Spans
        Spans of the frame. No span may be empty.
    writes : int
        Number of writes of constants before the frame.
    """
    return 1 + writes + unit.latency + _cycles(unit, spans, 1)


def steady_cycles(unit: ShadingPipelineUnit, spans: Spans) -> int:
    """Cycles of a frame behind an equal frame, so without the filling of the pipeline.

    Parameters
    ----------
    unit, spans
        As in `frame_cycles`.
    """
    return _cycles(unit, spans, 2) - _cycles(unit, spans, 1)


def _cycles(unit: ShadingPipelineUnit, spans: Spans, frames: int) -> int:
    """Cycles from the first pixel of equal frames to the last pixel."""
    method, lanes = unit._interpolator, unit.model.build.lanes
    if lanes > 1:
        sent = np.asarray(unit.model.interpolator.sent(spans).length, dtype=np.int64)
        return beat_cycles(np.tile(sent, frames), lanes)
    length = np.asarray(spans.length, dtype=np.int64) * unit.cycles_per_pixel
    interval = method.span_intervals(spans)
    return span_cycles(np.tile(length, frames), np.tile(interval, frames), method.room_after)


def unit_of(design: ShadingPipeline) -> ShadingPipelineUnit:
    """The pipeline of a design, for its figures only. Amaranth does not warn that it is never elaborated."""
    warnings.simplefilter("ignore", UnusedElaboratable)
    return ShadingPipelineUnit(design)


def compare(design: ShadingPipeline, triangles: int, size: tuple[int, int]) -> tuple[int, int]:
    """Cycles of a teapot's frame by simulation and by the cycle model."""
    scene = scene_for(teapot(triangles), 50, *size)
    frame = FrameSimulator(design).render(scene)
    prepared = frame.prepared
    return frame.cycles, frame_cycles(unit_of(design), prepared.spans, prepared.writes)
