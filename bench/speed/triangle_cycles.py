"""Cycles of a frame of triangles by hardware geometry, for choices that take long to simulate."""

import numpy as np

from blysk.golden.build import Build
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.triangles import FrameSettings, Triangles
from blysk.golden.geometry.vertex_sort import VertexSort
from blysk.hdl.geometry.vertex_sort import WAITING_TRIANGLES
from blysk.hdl.render import waiting_spans

__all__ = ["triangle_cycles"]

_SORT, _READ = 8, 3
"""Cycles from a triangle to its result, and from the result to a lane."""

_DRAWN = 15
"""Drawn triangles that wait in the sort."""

_LANE, _INSIDE = 75, 5
"""Cycles from a lane's input to the walk, and triangles inside a lane meanwhile."""

_SPAN = 20
"""Cycles from a scanline to its first pixel."""


def triangle_cycles(
    geometry: Geometry,
    triangles: Triangles,
    frame: FrameSettings,
    setups: int = 1,
    interval: int = 16,
    lanes: int = 1,
) -> int:
    """Cycles of a frame in the throughput style, from the first triangle to the last pixel.

    The model follows each drawn triangle through sort, lane and walk, and each span to its last pixel. A
    stage takes a triangle when the stage before has it, when its own interval is over, and when the next
    stage has room. Spans are not halved. With two lanes at 640x480, the result for the teapot of 102,080
    triangles is 1 % short of the simulation, and with four lanes 2 %. For 10,712 triangles it is 4 % short.

    Parameters
    ----------
    geometry : Geometry
        Bit-accurate model.
    triangles : Triangles
        In the order of drawing.
    frame : FrameSettings
        The picture, and the treatment of back faces.
    setups : int
        Lanes of triangle setup.
    interval : int
        Least cycles from a triangle to the next in a lane.
    lanes : int
        Pixels of a beat of the shading. With several lanes a span of two pixels or more takes at least two
        cycles.
    """
    waiting = waiting_spans(Build(top="render", setups=setups))
    drawn, rows, owner, _ = geometry.rows(triangles, frame)
    length = rows.length.tolist()
    shading = np.maximum(-(-rows.length // lanes), np.minimum(rows.length, min(lanes, 2))).tolist()
    ends = np.searchsorted(owner, np.arange(len(drawn)), side="right").tolist()
    # Cycle in which each drawn triangle would come to the sort if the sort never waited.
    cycles = VertexSort(geometry.grid).cycles(triangles)
    place = (np.cumsum(cycles) - cycles)[drawn.source].tolist()
    index = drawn.source.tolist()
    entered, walked, shaded = [], [], []
    delay = done = free = row = oldest = 0
    for k, at in enumerate(place):
        came = at + delay
        # The word of the first of `WAITING_TRIANGLES` triangles must be free.
        while oldest < k and index[k] - index[oldest] >= WAITING_TRIANGLES - 4:
            came = max(came, entered[oldest])
            oldest += 1
        found = came + _SORT
        if k >= _DRAWN:
            found = max(found, entered[k - _DRAWN])
        delay = found - _SORT - at
        enters = max(found + _READ, entered[-1] + 1 if k else 0)
        if k >= setups:
            enters = max(enters, entered[k - setups] + interval)
        if k >= _INSIDE * setups:
            enters = max(enters, walked[k - _INSIDE * setups])
        entered.append(enters)
        now = max(enters + _LANE, free)
        walked.append(now)
        while row < ends[k]:
            pixels = length[row]
            if pixels:
                if len(shaded) >= waiting:
                    now = max(now, shaded[-waiting])
                shaded.append(max(now + _SPAN, done))
                done = shaded[-1] + shading[row]
            now += max(1, (pixels - 1).bit_length() if pixels else 1)
            row += 1
        # The planes of the next triangle are read for a cycle.
        free = now + 1
    return done
