"""Bands of simulated hardware against the model: frames in turn, stalls, bands left out, buttons."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.surface import fixed_albedo_of
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture
from blysk.golden.video.controls import BUTTONS, Controls
from blysk.golden.video.draw_unit import Drawing, board_design
from blysk.hdl.video.draw_unit import COUNTERS, RENDERED
from blysk.sim.meshes.teapot import teapot

from .drawing import DrawingSimulator

LAMPS = (Light((0.5, 0.8, 1)), Light((-1, 0.3, 0.4), (0.3, 0.9, 0.9)))


def drawing_of(triangles, size, design, **options):
    mesh = teapot(triangles)
    camera = Camera.framing(mesh.vertices, (0.3, 0.5, 1), "perspective", size[0] / size[1], margin=0.12)
    red = Material((0.1, 0.05, 0.05), (0.6, 0.3, 0.2), (0.7, 0.7, 0.7), 60)
    blue = Material((0, 0, 0.1), (0.2, 0.3, 0.8), (0.5, 0.5, 0.5), 15)
    material = (red, blue)[: design.materials]
    faces = np.arange(len(mesh.faces)) % design.materials
    mesh = Mesh(mesh.vertices, mesh.faces, mesh.normals, faces)
    scenes = [
        Scene(mesh, camera, *size, of, lamps[: design.lights], back_faces="cull")
        for lamps in (LAMPS, LAMPS[::-1])
        for of in (material, material[::-1])
    ]
    controls = Controls(materials=2, lights=2, step=300, debounce_bits=2)
    return Drawing.of(scenes, design, controls=controls, **options)


@pytest.fixture(scope="module")
def simulator():
    """Memories have room for more than this mesh, as on a board."""
    drawing = drawing_of(120, (96, 64), board_design(materials=2))
    return DrawingSimulator(drawing.padded(drawing.room))


def expected(drawing, bands, buttons=None):
    """Pixels of each band, and the counters."""
    controls, state, before, down = drawing.controls, drawing.controls.start, drawing.bands, 0
    made = []
    for index, band in enumerate(bands):
        now = 0 if buttons is None else buttons[index]
        if band <= before:
            state = controls.advance(state)
            frame = state
        # The press counts some cycles later, when this frame has begun.
        for k, button in enumerate(BUTTONS):
            if (now & ~down) >> k & 1:
                state = controls.press(state, button)
        made.append(drawing.band(band, frame.angle, controls.list_of(frame)))
        before, down = band, now
    return made


def assert_equal(found, made):
    for pixels, band in zip(found.pixels, made, strict=True):
        for name, value in {"x": band.x, "y": band.y, **dict(zip("rgb", band.color.T, strict=True))}.items():
            np.testing.assert_array_equal(pixels[name], value, err_msg=f"band {band.band}: {name}")


@pytest.mark.ci
@pytest.mark.long
def test_frames_equal_model(simulator):
    """Two frames equal the model. Every counter is the sum over the bands."""
    drawing = simulator.drawing
    bands = [*range(drawing.bands)] * 2
    found, made = simulator.run(bands), expected(drawing, bands)
    np.testing.assert_array_equal(found.band, bands)
    assert_equal(found, made)
    counted = [name for name in (*COUNTERS, *RENDERED) if name in made[0].counts]
    assert len(counted) >= 9
    assert {name: found.counts[name] for name in counted} == {
        name: sum(band.counts[name] for band in made) for name in counted
    }
    assert (found.counts["frames"], found.counts["bands"]) == (2, len(bands))
    assert sum(len(pixels) for pixels in found.pixels) > 2000


@pytest.mark.long
def test_stalls_change_no_pixel_and_no_band_after_them(simulator):
    """There are stalls on both sides, and then none.

    The last half of the remaining bands takes as many cycles as from a reset.
    """
    bands, rng = [*range(simulator.drawing.bands)] * 6, np.random.default_rng(5)
    free = simulator.run(bands)
    end = int(free.cycles.sum()) // 2
    stalls = {
        name: np.r_[rng.random(end) < share, np.zeros(4 * end, dtype=bool)]
        for name, share in (("input_stalls", 0.7), ("output_stalls", 0.6))
    }
    found = simulator.run(bands, **stalls)
    assert_equal(found, expected(simulator.drawing, bands))
    left = np.count_nonzero(np.cumsum(found.cycles) - found.cycles >= end)
    assert left >= 8
    np.testing.assert_array_equal(found.cycles[-(left // 2) :], free.cycles[-(left // 2) :])


@pytest.mark.long
def test_bands_may_be_left_out(simulator):
    """A band whose number does not follow the band before begins a frame. So does the first band of all."""
    bands = [2, 3, 1, 3, 3, 0, 2]
    found = simulator.run(bands)
    assert_equal(found, expected(simulator.drawing, bands))
    assert found.counts["frames"] == 4


@pytest.mark.long
def test_buttons_count_from_the_next_frame_on(simulator):
    """Each button is pressed in turn, in the second band of a frame.

    While the motion is stopped, a press makes a step.
    """
    count = simulator.drawing.bands
    presses = ["light", "material", "step", "pause", "step", "light"]
    buttons = np.zeros((len(presses) + 1, count), dtype=int)
    for frame, name in enumerate(presses):
        buttons[frame, 1:-1] = 1 << BUTTONS.index(name)
    bands = [*range(count)] * len(buttons)
    buttons = buttons.ravel().tolist()
    assert_equal(simulator.run(bands, buttons), expected(simulator.drawing, bands, buttons))


@pytest.mark.long
@pytest.mark.parametrize("lights", [1, 2])
def test_highlights_of_phong_follow_the_light(lights):
    """The light changes after the first frame.

    L and the axes of the new light are there before the first triangle.
    """
    drawing = drawing_of(64, (48, 32), preset("quotient", "phong", lights=lights, materials=2))
    bands = [*range(drawing.bands)] * 3
    buttons = [0, 1 << BUTTONS.index("light"), *[0] * (len(bands) - 2)]
    found = DrawingSimulator(drawing).run(bands, buttons)
    assert_equal(found, expected(drawing, bands, buttons))
    assert sum(len(pixels) for pixels in found.pixels) > 500


@pytest.mark.long
@pytest.mark.parametrize("style", [pytest.param("throughput", marks=pytest.mark.ci), "compact"])
def test_vertex_colours_and_a_texture(style):
    """Two materials have images of different sizes, fixed in the texel memory. Two frames equal the model."""
    rng, mesh = np.random.default_rng(6), teapot(64)
    camera = Camera.framing(mesh.vertices, (0.3, 0.5, 1), "perspective", 1.5, margin=0.12)
    mesh = replace(
        mesh,
        material=np.arange(len(mesh.faces)) % 2,
        colors=rng.random((len(mesh.vertices), 3)),
        coordinates=mesh.vertices[:, :2],
    )
    images = (
        Texture(rng.random((8, 16, 3)), ("repeat", "mirror"), mipmapped=False),
        Texture(rng.random((4, 4, 3)), ("clamp", "clamp"), "nearest", mipmapped=False),
    )
    materials = tuple(Material((0.1,) * 3, (0.7,) * 3, (0.5,) * 3, 40, texture=image) for image in images)
    shown = Scene(mesh, camera, 48, 32, materials, LAMPS[:1], back_faces="cull")
    design = replace(board_design(materials=2), transfer="srgb", albedo=fixed_albedo_of(shown))
    design = design.built(top="render", geometry_style=style)
    drawing = Drawing.of([shown, shown], design, controls=Controls(materials=2, step=300))
    bands = [*range(drawing.bands)] * 2
    found = DrawingSimulator(drawing).run(bands)
    assert_equal(found, expected(drawing, bands))
    assert sum(len(pixels) for pixels in found.pixels) > 500


@pytest.mark.long
def test_a_teapot_of_1000_triangles_at_640_by_480():
    """Whole frames as the board shows them.

    Their cycles are enough for twice 60 frames a second at 75 MHz.
    """
    drawing = drawing_of(1000, (640, 480), board_design())
    drawing = replace(drawing, controls=replace(drawing.controls, step=1))
    bands = [*range(drawing.bands)] * 2
    simulator = DrawingSimulator(drawing)
    found = simulator.run(bands)
    assert_equal(found, expected(drawing, bands))
    assert found.cycles[drawing.bands :].sum() < 75e6 / 60 / 2
