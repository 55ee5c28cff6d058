"""Turntables: the way of the camera, the executors, and frames that equal those drawn one by one."""

import multiprocessing
import random
import time
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from blysk.golden.frames.compare import compare
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.sim.errors import InputError
from blysk.sim.frames.animation import (
    Animation,
    FrameExecutor,
    dask_executor,
    equal_distance,
    process_executor,
    render_frame,
    render_frames,
    turned,
    turntable,
    write_gif,
)
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.frames.picture import write_image
from blysk.sim.meshes.mesh import load_mesh

COUNT = 5


@pytest.mark.parametrize("axis", [(0, 1, 0), (0, 3.0, 0), (1, 2, -3)])
def test_turned_is_a_rotation(axis):
    vector = np.array([0.3, 0.5, -2.0])
    angles = 2 * np.pi * np.arange(7) / 7
    expected = Rotation.from_rotvec(angles[:, np.newaxis] * axis / np.linalg.norm(axis)).apply(vector)
    actual = turned(vector, axis, 7)
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-14)
    assert np.array_equal(actual[0], vector)


def test_a_view_along_the_axis_does_not_turn():
    for vector in ([0, 2, 0], [0, -1, 0], [1e-8, 1, 0]):
        with pytest.raises(ValueError, match="looks along the axis"):
            turned(vector, [0, 1, 0], 2)
    assert turned([0, 2, 0], [0, 1, 0], 1).tolist() == [[0, 2, 0]]


def test_turntable_goes_once_round():
    camera = Camera((1.0, 2.0, 3.0), (0.5, 0.0, -0.5), (0.0, 1.0, 0.0), "perspective", near=0.1)
    cameras = turntable(camera, 12)
    assert len(cameras) == 12
    assert cameras[0] is camera
    offsets = np.array([np.subtract(one.position, one.target) for one in cameras])
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=1), np.linalg.norm(offsets[0]), rtol=1e-14)
    np.testing.assert_allclose(offsets[:, 1], 2, rtol=1e-14)
    bearings = np.unwrap(np.arctan2(offsets[:, 0], offsets[:, 2]))
    np.testing.assert_allclose(np.diff(bearings), np.pi / 6, rtol=1e-12)
    assert {(one.target, one.up, one.near, one.field_of_view) for one in cameras} == {
        (camera.target, camera.up, camera.near, camera.field_of_view)
    }


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_equal_distance_shows_all_of_the_mesh_from_every_side(projection):
    vertices = np.random.default_rng(3).normal(size=(200, 3)) * [5, 1, 0.2]
    views = turned([0.4, 0.5, 1], [0, 1, 0], 8)
    framing = [Camera.framing(vertices, view, projection, 4 / 3) for view in views]
    cameras = equal_distance(framing)
    assert equal_distance(framing[:1]) == framing[:1]
    distances = [np.linalg.norm(np.subtract(camera.position, camera.target)) for camera in cameras]
    np.testing.assert_allclose(distances, max(distances), rtol=1e-14)
    assert len({(camera.height, camera.near, camera.target) for camera in cameras}) == 1
    fills = []
    for camera, near in zip(cameras, framing, strict=True):
        np.testing.assert_allclose(camera.viewer, near.viewer, rtol=0, atol=1e-12)
        places = camera.project(vertices, 400, 300)
        assert (places[:, 2] > camera.near).all()
        share = np.abs(places[:, :2] / [400, 300] - 0.5).max()
        assert share <= 0.45 + 1e-9
        fills.append(share)
    # At least one frame fills the picture up to its margin. Otherwise all could be nearer.
    if projection == "orthographic":
        assert max(fills) == pytest.approx(0.45)


# The order of the work.


def test_frames_come_in_any_order_and_none_twice():
    rng = random.Random(4)
    waiting = []

    def work(camera):
        time.sleep(rng.random() / 100)
        return camera * 10

    with ThreadPoolExecutor(3) as executor:

        def submit(camera):
            waiting.append(camera)
            return executor.submit(work, camera)

        done = []
        for index, result in render_frames(FrameExecutor(submit, 3, "threads"), range(40)):
            assert result == index * 10
            done.append(index)
            # Two tasks a worker are under way, and no more, because the memory holds no more.
            assert len(waiting) - len(done) <= 6
    assert sorted(done) == list(range(40))
    assert waiting == list(range(40))


def test_what_waits_is_taken_back():
    futures = []

    def submit(camera):
        futures.append(Future())
        return futures[-1]

    frames = render_frames(FrameExecutor(submit, 1, "nobody"), range(5))
    with ThreadPoolExecutor(1) as helper:
        first = helper.submit(next, frames)
        while len(futures) < 2:
            time.sleep(0.001)
        futures[0].set_exception(ValueError("broken"))
        with pytest.raises(ValueError, match="broken"):
            first.result(timeout=10)
    assert len(futures) == 2
    assert futures[1].cancelled()


# The frames.


@pytest.fixture(scope="module")
def animation():
    mesh = load_mesh("teapot", triangles=100).mesh
    scene = Scene(
        mesh=mesh,
        camera=Camera.framing(mesh.vertices, (0.4, 0.5, 1), "perspective", 4 / 3),
        width=32,
        height=24,
        material=Material((0.1, 0.1, 0.1), (0.6, 0.5, 0.4), (0.5, 0.5, 0.5), 30),
        lights=[Light((-0.5, 0.8, 0.7))],
    )
    return Animation(scene, preset())


@pytest.fixture(scope="module")
def cameras(animation):
    return turntable(animation.scene.camera, COUNT)


@pytest.fixture(scope="module")
def singly(animation, cameras):
    """Each frame by itself: the pictures, and the errors."""
    simulator = FrameSimulator(animation.design)
    frames = []
    for camera in cameras:
        scene = replace(animation.scene, camera=camera)
        frame = simulator.render(scene)
        frames.append((frame.image, frame.cycles, compare(scene, animation.design, frame)))
    assert len({image.tobytes() for image, *_ in frames}) == COUNT
    return frames


def assert_the_same(frame, expected):
    image, cycles, comparison = expected
    assert np.array_equal(frame.image, image)
    assert frame.figures["cycles"] == cycles
    for name in ("arithmetic_error", "method_error", "total_error"):
        assert frame.figures[name]["max_lsb"] == getattr(comparison, name).max_lsb
        assert frame.figures[name]["rmse_lsb"] == getattr(comparison, name).rmse_lsb


def test_processes_end_with_the_block(animation, cameras):
    children = set(multiprocessing.active_children())

    def interrupted():
        with process_executor(animation, 2) as executor:
            executor.submit(cameras[0])
            assert len(set(multiprocessing.active_children()) - children) >= 1
            raise KeyboardInterrupt

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert set(multiprocessing.active_children()) == children
    assert time.monotonic() - start < 10


def test_a_process_that_dies(animation, cameras):
    def killed():
        with process_executor(animation, 1) as executor:
            executor.submit(cameras[0])
            for child in set(multiprocessing.active_children()) - children:
                child.kill()
            list(render_frames(executor, cameras))

    children = set(multiprocessing.active_children())
    with pytest.raises(InputError, match=r"--jobs 1: a process died, .*; use fewer jobs"):
        killed()
    # The pool itself reaps a process that was killed while the pool was sending to it.
    deadline = time.monotonic() + 20
    while set(multiprocessing.active_children()) != children and time.monotonic() < deadline:
        time.sleep(0.05)
    assert set(multiprocessing.active_children()) == children


# A cluster.


@pytest.fixture(scope="module")
def scheduler():
    """A scheduler and two worker processes on this machine."""
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    ) as local:
        yield local


@pytest.mark.long
@pytest.mark.parametrize("who", [pytest.param("processes", marks=pytest.mark.ci), "cluster"])
def test_frames_are_those_drawn_singly(animation, cameras, singly, request, who):
    """Two workers draw in an order of their own. No process is left."""
    order = [3, 0, 4, 2, 1]
    address = who == "cluster" and request.getfixturevalue("scheduler").scheduler_address
    children = set(multiprocessing.active_children())
    with dask_executor(animation, address) if address else process_executor(animation, 2) as executor:
        assert executor.workers == 2
        assert executor.name == "2 processes" or address
        frames = dict(render_frames(executor, [cameras[index] for index in order]))
    assert set(multiprocessing.active_children()) == children
    for place, index in enumerate(order):
        assert_the_same(frames[place], singly[index])


def test_a_cluster_without_workers(animation):
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0", host="127.0.0.1") as empty,
        pytest.raises(InputError, match="the scheduler has no workers; start some: dask worker tcp://"),
        dask_executor(animation, empty.scheduler_address),
    ):
        pass


def test_nobody_at_the_address(animation, monkeypatch):
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    monkeypatch.setattr("blysk.sim.frames.workers._CONNECT_SECONDS", 1)
    with (
        pytest.raises(
            InputError, match=r"no Dask scheduler answers \(.*; start a scheduler with `dask scheduler`"
        ),
        dask_executor(animation, "tcp://127.0.0.1:1"),
    ):
        pass


@pytest.mark.ci
@pytest.mark.long
def test_an_error_on_a_cluster_is_that_of_the_frame(animation, scheduler):
    with (
        pytest.raises(AttributeError, match="'NoneType' object has no attribute 'projection'"),
        dask_executor(animation, scheduler.scheduler_address) as executor,
    ):
        list(render_frames(executor, [None]))


def test_the_same_process_draws_the_same(animation, cameras, singly):
    """The work of a worker, without a worker."""
    for index in (1, 0):
        assert_the_same(render_frame(animation, cameras[index]), singly[index])


# The animation.


def test_gif(tmp_path):
    """Up to 256 colours are kept to the bit. Every frame and its time are there."""
    rng = np.random.default_rng(6)
    colors = rng.integers(0, 256, (200, 3), dtype=np.uint8)
    images = colors[rng.integers(0, 200, (4, 30, 40))]
    names = [tmp_path / f"{number}.png" for number in range(4)]
    for name, image in zip(names, images, strict=True):
        write_image(name, image)
    write_gif(tmp_path / "a.gif", names, milliseconds=70)
    with Image.open(tmp_path / "a.gif") as animation:
        assert animation.n_frames == 4
        assert animation.info["loop"] == 0
        for number, image in enumerate(images):
            animation.seek(number)
            assert animation.info["duration"] == 70
            assert np.array_equal(np.asarray(animation.convert("RGB")), image)


def test_gif_of_many_colors(tmp_path):
    """A smooth highlight on a wide background: the background does not take the highlight's colours."""
    y, x = np.mgrid[:60, :80] / 80
    light = np.exp(-((x - 0.5) ** 2 + (y - 0.4) ** 2) / 0.01)
    image = np.full((60, 80, 3), (26, 28, 32), dtype=np.uint8)
    inside = light > 0.02
    image[inside] = (np.array([60, 40, 20]) + light[inside][:, np.newaxis] * [190, 180, 160]).astype(np.uint8)
    write_image(tmp_path / "a.png", image)
    write_gif(tmp_path / "a.gif", [tmp_path / "a.png"])
    with Image.open(tmp_path / "a.gif") as animation:
        error = np.abs(np.asarray(animation.convert("RGB")).astype(int) - image)
    assert error[~inside].max() == 0
    assert error.max() <= 8


@pytest.mark.ci
@pytest.mark.long
def test_gif_is_whole_or_not_there(tmp_path):
    write_image(tmp_path / "a.png", np.zeros((4, 4, 3), dtype=np.uint8))
    with pytest.raises(FileNotFoundError):
        write_gif(tmp_path / "a.gif", [tmp_path / "a.png", tmp_path / "b.png"])
    with pytest.raises(InputError, match="there is no folder"):
        write_gif(tmp_path / "no" / "a.gif", [tmp_path / "a.png"])
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
