"""Frames of the simulated pipeline against its bit-accurate model, float64 and each other."""

import dataclasses
import functools
import math
from pathlib import Path

import numpy as np
import pytest

import blysk.sim.frames.frame
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.compare import compare
from blysk.golden.frames.cut import cut_spans
from blysk.golden.frames.prepare import prepare, spans_for
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import shade_spans
from blysk.golden.reference.scene import Scene
from blysk.sim.engines.engine import SimulationError
from blysk.sim.frames.frame import FrameSimulator, sample_constants
from blysk.sim.meshes.mesh import load_mesh
from blysk.sim.meshes.teapot import teapot

DESIGN = preset("quadratic", "cosquad", lights=3)
LIGHTS = (
    Light((-0.5, 0.8, 0.7)),
    Light((0.9, 0.1, 0.4), (0.2, 0.3, 0.9)),
    Light((-0.2, -1.0, 0.3), (0.5, 0.1, 0.0)),
)
BACKGROUND = (0.11, 0.2, 0.72)


@functools.cache
def mesh_of(name):
    if name == "teapot992":
        return load_mesh(str(Path(__file__).parents[2] / "data" / "teapot992.obj")).mesh
    return load_mesh("teapot", triangles=int(name)).mesh


def scene_of(mesh, size=(64, 48), exponent=50, lights=LIGHTS, view=(0.4, 0.5, 1.0), **material):
    mesh = mesh_of(mesh) if isinstance(mesh, str) else mesh
    colors = {"ambient": (0.08, 0.05, 0.03), "diffuse": (0.75, 0.42, 0.2), "specular": (0.6, 0.6, 0.6)}
    return Scene(
        mesh=mesh,
        camera=Camera.framing(mesh.vertices, view, "orthographic", size[0] / size[1]),
        width=size[0],
        height=size[1],
        material=Material(**{**colors, **material}, exponent=exponent),
        lights=lights,
        background=BACKGROUND,
    )


@pytest.fixture(scope="module")
def simulator():
    return FrameSimulator(DESIGN)


def model_pixels(scene):
    cut, _ = cut_spans(scene, rasterise(scene), DESIGN)
    return cut, DESIGN.compute(spans_for(scene, cut, DESIGN), FrameConstants.of(scene, DESIGN.lights))


def test_frame_is_the_model_after_a_depth_test(simulator):
    scene = scene_of("500")
    frame = simulator.render(scene)
    cut, pixels = model_pixels(scene)
    assert frame.pixels == len(pixels.x) == len(cut.span)
    assert frame.spans == len(cut.length)
    # Depth of each fragment from the plane through its triangle's corners on the screen.
    corners = scene.camera.project(scene.mesh.vertices, scene.width, scene.height)[scene.mesh.faces]
    corners[..., :2] = np.rint(corners[..., :2] * 256) / 256
    corners = corners[cut.triangle[cut.span]]
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    place = np.stack([pixels.x, pixels.y], axis=-1) + 0.5
    slope = normal[:, :2] / normal[:, 2:]
    depth = corners[:, 0, 2] - ((place - corners[:, 0, :2]) * slope).sum(axis=-1)
    expected = np.empty((scene.height, scene.width, 3), dtype=np.uint8)
    expected[...] = np.rint(np.multiply(BACKGROUND, 255))
    # The farthest fragment is written first. At equal depths the triangle with the lower number wins.
    order = np.lexsort((-cut.triangle[cut.span], -np.round(depth, 9)))
    expected[pixels.y[order], pixels.x[order]] = pixels.color[order]
    assert np.array_equal(frame.image, expected)
    assert len(np.unique(frame.image.reshape(-1, 3), axis=0)) > 100


@pytest.mark.long
def test_engines_give_the_same_frame(simulator):
    scene = scene_of("240", (24, 18))
    slow, fast = FrameSimulator(DESIGN, "pysim").render(scene), simulator.render(scene)
    assert (slow.engine, fast.engine) == ("pysim", "cxxrtl")
    assert np.array_equal(slow.image, fast.image)
    assert (slow.cycles, slow.out_of_range_spans) == (fast.cycles, fast.out_of_range_spans)


@pytest.mark.parametrize("mesh", ["2000", "teapot992"])
@pytest.mark.parametrize(("exponent", "bound"), [(1, 1.0), (10, 1.0), (100, 1.0), (1000, 1.7)])
def test_arithmetic_error(simulator, mesh, exponent, bound):
    # Rounding is 0.5. The highlight is 0.6 * 255 LSB high, and its slope is at most the exponent. At 1000, a
    # step of a unit vector, 2**-17, in the cosine makes 1.2 LSB.
    scene = scene_of(mesh, (160, 120), exponent)
    frame = simulator.render(scene)
    assert frame.out_of_range_spans == 0
    cut = frame.cut_raster
    reference = shade_spans(scene, cut, "quadratic", REFLECTION_MODELS["cosquad"])
    error = np.abs(frame.image - 255 * reference).max(axis=-1).reshape(-1)

    span, t = cut.span, cut.offset / np.maximum(cut.length[cut.span] - 1, 1)
    normals = interpolate("quadratic", cut.normal_left[span], cut.normal_right[span], t)
    cosines = normals @ np.transpose([light.direction for light in LIGHTS])
    # On the terminator the sign of N.L decides about the highlight.
    terminator = cut.visible & (np.abs(cosines).min(axis=-1) < 2.0**-15)
    shown = cut.pixel[cut.visible & ~terminator]
    assert len(shown) > 3000
    assert np.count_nonzero(terminator) <= 5
    assert error[shown].max() <= bound
    # The other figures are of the same frame.
    result = compare(scene, DESIGN, frame)
    assert result.arithmetic_error.max_lsb == error[cut.pixel[cut.visible]].max()
    assert result.arithmetic_error.p999_lsb <= result.arithmetic_error.max_lsb


def test_no_light_leaves_the_ambient(simulator):
    scene = scene_of("500", lights=())
    frame = simulator.render(scene)
    shown = frame.raster.pixel[frame.raster.visible]
    expected = np.floor(np.multiply(scene.material.ambient, 255) + 0.5)
    assert len(shown) > 500
    assert (frame.image.reshape(-1, 3)[shown] == expected).all()


@pytest.mark.long
def test_unused_lights_are_black(simulator):
    # One light of three, against a simulator with a single light.
    scene = scene_of("240", (24, 18), lights=LIGHTS[:1])
    single = FrameSimulator(preset(model="cosquad", lights=1), "pysim").render(scene)
    assert np.array_equal(single.image, simulator.render(scene).image)


def test_too_many_lights(simulator):
    with pytest.raises(ValueError, match="the pipeline has 3 lights, the scene 4"):
        simulator.render(scene_of("240", (8, 6), lights=(*LIGHTS, LIGHTS[0])))


def test_light_straight_behind(simulator):
    """``L = -V`` has no half-way vector.

    There is no specular light, and no diffuse light where the surface faces the viewer.
    """
    base = scene_of("500")
    behind = Light(tuple(-np.array(base.camera.viewer)))
    scene = dataclasses.replace(base, lights=(behind,))
    frame = simulator.render(scene)
    matt = dataclasses.replace(scene, material=dataclasses.replace(scene.material, specular=(0, 0, 0)))
    assert np.array_equal(frame.image, simulator.render(matt).image)
    assert compare(scene, DESIGN, frame).arithmetic_error.max_lsb <= 1
    cut = frame.cut_raster
    cosine = np.minimum(cut.normal_left @ base.camera.viewer, cut.normal_right @ base.camera.viewer)
    facing = cut.visible & (cosine[cut.span] > 0.01)
    ambient = np.floor(np.multiply(scene.material.ambient, 255) + 0.5)
    assert np.count_nonzero(facing) > 500
    assert (frame.image.reshape(-1, 3)[cut.pixel[facing]] == ambient).all()


def sheet(width):
    """A triangle in the plane z = 0."""
    vertices = np.array([[0.0, 0, 0], [width, 0, 0], [0, 1, 0]])
    return Mesh(vertices, np.array([[0, 1, 2]]), np.array([[0.0, 0, 1]] * 3))


@pytest.mark.parametrize(
    ("mesh", "size", "view"),
    [(sheet(1.0), (20, 20), (1, 0, 0)), (sheet(1e-3), (1, 1), (0, 0, 1))],
    ids=["edge-on", "between the pixel centres"],
)
def test_no_visible_pixel(simulator, mesh, size, view):
    scene = scene_of(mesh, size, view=view)
    frame = simulator.render(scene)
    assert (frame.spans, frame.pixels, frame.out_of_range_spans) == (0, 0, 0)
    assert (frame.image == np.rint(np.multiply(BACKGROUND, 255))).all()
    result = compare(scene, DESIGN, frame)
    for figures in (result.arithmetic_error, result.method_error, result.total_error):
        assert all(math.isnan(value) for value in dataclasses.astuple(figures))
    assert math.isnan(result.nmse)
    assert math.isnan(result.mnse_published)


def test_one_pixel(simulator):
    scene = scene_of("500", (1, 1))
    frame = simulator.render(scene)
    assert (frame.image.shape, frame.pixels) == ((1, 1, 3), 1)
    assert compare(scene, DESIGN, frame).arithmetic_error.max_lsb <= 1


def test_frames_one_after_the_other(simulator):
    """A run starts from power-up. Nothing of the frame before is left, in whatever order the frames come."""
    scenes = [scene_of("500"), scene_of("240", (30, 40), 7, LIGHTS[:2]), scene_of("500", lights=())]
    first = [simulator.render(scene) for scene in scenes]
    again = [simulator.render(scene) for scene in reversed(scenes)][::-1]
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one.image, other.image)
        assert (one.cycles, one.out_of_range_spans) == (other.cycles, other.out_of_range_spans)


def test_progress(simulator):
    calls = []
    frame = simulator.render(scene_of("240", (24, 18)), progress=lambda *call: calls.append(call))
    assert calls[-1] == (frame.pixels, frame.pixels)
    assert {count for _, count in calls} == {frame.pixels}


def changed(monkeypatch, field):
    """An engine whose answers are wrong in one bit of one beat."""
    simulate = blysk.sim.frames.frame.simulate

    def wrong(*arguments, **options):
        run = simulate(*arguments, **options)
        beats = run.beats.copy()
        beats[field][-1] ^= 1
        return dataclasses.replace(run, beats=beats)

    monkeypatch.setattr(blysk.sim.frames.frame, "simulate", wrong)


def test_simulation_that_is_not_the_model(monkeypatch):
    changed(monkeypatch, "g")
    with pytest.raises(
        SimulationError, match="pixels of the simulated pipeline differ from its bit-accurate model"
    ):
        FrameSimulator(preset(), "pysim")


def test_pixels_that_were_not_asked_for(simulator, monkeypatch):
    changed(monkeypatch, "x")
    with pytest.raises(SimulationError, match="gave pixels at other coordinates"):
        simulator.render(scene_of("240", (24, 18)))


MATERIALS = (
    Material((0.1, 0, 0), (0.7, 0.1, 0.1), (0.2, 0.3, 0.4), 5),
    Material((0, 0.1, 0), (0.1, 0.5, 0.2), (0.5, 0.5, 0.5), 50),
    Material((0, 0, 0.1), (0.2, 0.1, 0.6), (0.3, 0.2, 0.1), 400),
)


@pytest.mark.long
@pytest.mark.parametrize("engine", ["cxxrtl", "pysim"])
def test_frame_of_three_materials(engine):
    """By the bit-accurate model each pixel equals that of a frame with its triangle's material alone.

    The materials are scattered over the triangles, so the spans are in another order than without materials.
    """
    several = preset(model="cosquad", lights=1, materials=3)
    lone = scene_of("240", (40, 30) if engine == "cxxrtl" else (20, 15), lights=LIGHTS[:1])
    faces = len(lone.mesh.faces)
    mesh = dataclasses.replace(lone.mesh, material=np.random.default_rng(3).integers(0, 3, faces))
    scene = dataclasses.replace(lone, mesh=mesh, material=MATERIALS)
    frame = FrameSimulator(several, engine).render(scene)
    assert frame.out_of_range_spans == 0
    raster = frame.raster
    owner = np.full(scene.width * scene.height, -1)
    owner[raster.pixel[raster.visible]] = mesh.material[raster.triangle[raster.span[raster.visible]]]
    owner = owner.reshape(scene.height, scene.width)
    assert np.bincount(owner[owner >= 0], minlength=3).min() > 20
    one = preset(model="cosquad", lights=1)
    for index, material in enumerate(MATERIALS):
        alone = dataclasses.replace(lone, material=material)
        # Spans are cut by the exponents of their own materials.
        cut, _ = cut_spans(scene, rasterise(alone), several)
        pixels = one.compute(spans_for(alone, cut, one), FrameConstants.of(alone, 1))
        image = np.zeros((scene.height * scene.width, 3), dtype=np.uint8)
        image[cut.pixel[cut.visible]] = pixels.color[cut.visible]
        own = owner == index
        assert np.array_equal(frame.image[own], image.reshape(frame.image.shape)[own])
    assert (frame.image[owner < 0] == np.rint(np.multiply(BACKGROUND, 255))).all()
    # The figures are also those of a frame with its own materials.
    result = compare(scene, several, frame)
    assert result.arithmetic_error.max_lsb <= 1
    in_one = dataclasses.replace(scene, material=(MATERIALS[0],) * 3)
    assert compare(in_one, several, frame).arithmetic_error.max_lsb > 20


def test_other_numbers_of_materials(simulator):
    scene = dataclasses.replace(scene_of("240", (8, 6)), material=MATERIALS)
    with pytest.raises(ValueError, match="the pipeline has 1 materials, the scene 3"):
        simulator.render(scene)


@pytest.mark.long
@pytest.mark.parametrize("exponent", [10, 1000])
def test_point_light_and_near_viewer(exponent):
    """The frame is within an LSB of the frame with L, H and N at every pixel.

    The light is as near as the pot is large.
    """
    mesh = teapot(1000)
    scene = Scene(
        mesh,
        Camera.framing(mesh.vertices, (0.4, 0.5, 1), "perspective", 4 / 3),
        160,
        120,
        Material((0.05,) * 3, (0.4,) * 3, (0.55,) * 3, exponent),
        [Light(position=(-2, 4, 3)), Light((0.5, 0.2, 1), (0.2, 0.3, 0.4))],
        viewer="near",
    )
    design = preset("chord-local", "cosquad", lights=2)
    simulator = FrameSimulator(design)
    frame = simulator.render(scene)
    assert frame.out_of_range_spans == 0
    errors = compare(scene, design, frame)
    assert errors.method_error.max_lsb < 1
    # Two terms of full brightness, and the last rounding.
    assert errors.arithmetic_error.max_lsb < 0.6
    far = dataclasses.replace(scene, viewer="distant", lights=[Light((-2, 4, 3)), scene.lights[1]])
    assert np.abs(simulator.render(far).image.astype(int) - frame.image).max() > 20
    with pytest.raises(ValueError, match=r"^point lights and a near viewer need the method chord-local$"):
        prepare(scene, preset("renormalise", "cosquad", lights=2))


@pytest.mark.parametrize("model", ["blinn", "cosquad"])
def test_model_is_checked_with_as_many_materials_as_there_may_be(model):
    constants = sample_constants(preset(model=model, materials=1024))
    assert len(constants) == 1024
    assert all(1 <= of.exponent <= 1000 for of in constants)
