"""Frames one after the other through a core on a bus: each frame is drawn as if it were the first."""

import numpy as np
import pytest

from blysk.bench.units.operands import unit_codes
from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.geometry.coarse_depth import CoarseDepth
from blysk.golden.geometry.triangles import FrameSettings, Triangles
from blysk.golden.presets import preset
from blysk.golden.render import Renderer
from blysk.hdl.bus.framing import FramingUnit
from blysk.sim.engines.simulate import simulate

pytestmark = [pytest.mark.long, pytest.mark.ci]

SIZE = 16, 8
STEPS = 256
DESIGN = preset("linear", "cosquad", x_bits=4, y_bits=4, materials=3).built(
    top="render", coarse=CoarseDepth(*SIZE, tag_bits=2)
)


@pytest.fixture(scope="module")
def unit():
    """The unit has both memories of depths: of the pixels, and of the coarse test."""
    return FramingUnit(DESIGN, size=SIZE)


def triangles(count, depth, right=40, material=0):
    """Triangles over most of the picture, the first at a depth and the others behind it; or triangles beside
    the picture."""
    x, y = np.array([-40, right, -40]) * STEPS, np.array([-40, -40, 40]) * STEPS
    every = np.ones((count, 1), dtype=np.int64)
    return Triangles(
        x=every * x,
        y=every * y,
        depth=every * depth + (np.arange(count) << 16)[:, np.newaxis] + np.zeros(3, dtype=np.int64),
        normal=np.tile(np.array([0, 0, 1 << 22]), (count, 3, 1)),
        material=np.full(count, material),
        two_sided=np.zeros(count, dtype=bool),
    )


def constants():
    """Each material has a colour of its own."""
    rng = np.random.default_rng(1)
    direction, halfway = (unit_codes(rng, 1) for _ in range(2))
    return [
        FrameConstants(
            9 + index, rng.integers(0, 255 * 8, 3), direction, halfway, *rng.integers(0, 9000, (2, 1, 3))
        )
        for index in range(DESIGN.materials)
    ]


def run(unit, frames, keep, expected):
    """The output of the unit for frames of triangles.

    ``expected`` has the triangles of each frame as they are drawn.
    """
    frame, codes = FrameSettings.centred(*SIZE), constants()
    layouts = unit.model
    data, ends = [], []
    for each in frames:
        columns = each.beats
        # The index is sent as a driver might send it, outside the range that the layout packs.
        words = np.zeros(len(each), layouts.given.dtype)
        for name in words.dtype.names:
            words[name] = columns[name]
        data.append(words.view(np.uint8).reshape(len(each), -1))
        ends += [0] * (len(each) - 1) + [1]
    made = [Renderer(DESIGN.built(coarse=None)).compute(each, frame, codes).beats for each in expected]
    wanted = np.concatenate([layouts.made.pack(each) for each in made])
    found = simulate(
        unit,
        {"data": np.concatenate(data), "last": np.array(ends)},
        count=len(wanted),
        constants=frame.codes | {"keep": keep},
        write=writes_of(codes),
        engine="auto",
    )
    np.testing.assert_array_equal(found.beats["data"], wanted)
    assert found.status["frames"] == len(frames)
    return found.status


@pytest.mark.ci
@pytest.mark.long
def test_depths_begin_anew_with_each_frame(unit):
    """Far triangles come after near triangles, also with an empty frame between them."""
    near, far, beside = triangles(9, 100), triangles(9, 1 << 20), triangles(1, 100, right=-20)
    frames = [near, far, beside, near, beside, far, beside, beside, far]
    status = run(unit, frames, 0, frames)
    assert status["dropped"] > 0
    assert status["misfits"] == 0


def test_a_frame_that_keeps_adds_to_the_picture(unit):
    near, far, beside = triangles(2, 1 << 20), triangles(9, 1 << 22), triangles(1, 100, right=-20)
    nearest = triangles(1, 100, material=1)
    run(unit, [near, far, beside, far, nearest], 1, [near, nearest])


def test_a_material_past_the_last_counts_as_the_last(unit):
    """There are three materials.

    The misfits count the index. The low bits of 4, 5 and 1021 are those of other materials.
    """
    given = [triangles(1, 100, material=index) for index in (0, 1, 2, 3, 4, 5, 1021)]
    drawn = [triangles(1, 100, material=index) for index in (0, 1, 2, 2, 2, 2, 2)]
    assert run(unit, given, 0, drawn)["misfits"] == 4
