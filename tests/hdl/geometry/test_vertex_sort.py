"""Vertex sort: cycles by the model, and differences of coordinates at both ends of a factor."""

import numpy as np

from blysk.bench.units.registry import RECORDS
from blysk.golden.geometry.triangles import FrameSettings, Triangles
from blysk.golden.geometry.vertex_sort import FACTOR_BITS, VertexSort
from blysk.hdl.geometry.vertex_sort import WAITING_TRIANGLES, VertexSortUnit
from blysk.sim.engines.simulate import simulate

from ...checks import assert_beats_equal


def test_cycles():
    """Without stalls triangles are taken as the model says. A wide triangle delays the second after it."""
    unit, record = VertexSortUnit(), RECORDS["vertex_sort"]
    case = record.stimuli["whole"].make(unit, np.random.default_rng(1), 300)
    triangles, half = Triangles(**case.beats), 1 << (FACTOR_BITS - 1)
    # Differences at the ends of a factor of 18 bits, and one step beyond.
    triangles.x[:4], triangles.y[:4] = 0, [0, 256, 512]
    triangles.x[:4, 1] = -half, -half - 1, half - 1, half
    cycles = VertexSort().cycles(triangles)
    assert cycles[:4].tolist() == [1, 4, 1, 4]
    found = simulate(unit, triangles.beats, count=None, idle_timeout=100, **case.sent)
    np.testing.assert_array_equal(np.diff(found.input_cycles)[1:], cycles[:-2])


def test_the_memory_of_triangles_fills():
    """While a drawn triangle waits, dropped triangles fill the memory. Then the unit stops, and goes on."""
    unit = VertexSortUnit()
    case = RECORDS["vertex_sort"].stimuli["whole"].make(unit, np.random.default_rng(2), 2 * WAITING_TRIANGLES)
    triangles, frame = Triangles(**case.beats), FrameSettings(-8, -8, 8, 8)
    # A triangle of 64 in 65 has its corners in the same place.
    triangles.x[:], triangles.y[:] = [-512, 512, 0], [-512, -512, 512]
    triangles.x[np.arange(len(triangles)) % 65 != 0] = 0
    triangles.y[np.arange(len(triangles)) % 65 != 0] = 0
    expected, counts = VertexSort().compute(triangles, frame)
    waits = np.arange(2048) < 700
    found = simulate(
        unit,
        triangles.beats,
        count=len(expected),
        constants=frame.codes,
        idle_timeout=3000,
        output_stalls=waits,
    )
    assert_beats_equal(found.beats, expected.beats)
    assert {name: found.status[name] for name in counts} == counts
    before = np.count_nonzero(found.input_cycles < 700)
    # The first triangle was read, and waits at the output. The second is triangle 65.
    assert WAITING_TRIANGLES - 4 <= before - 65 < WAITING_TRIANGLES
