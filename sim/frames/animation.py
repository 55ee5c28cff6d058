"""Animations: a camera that goes round its target, and frames rendered by processes or machines."""

import functools
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

from blysk.golden.frames.compare import compare, compare_triangles
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.divide import divided
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer
from blysk.sim.frames.figures import frame_figures, triangle_figures
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.frames.triangles import TriangleSimulator
from blysk.sim.frames.workers import cluster_client, local_executor
from blysk.sim.output import atomic_writer
from blysk.sim.run_files import MARK

__all__ = [
    "Animation",
    "AnimationFrame",
    "FrameExecutor",
    "dask_executor",
    "equal_distance",
    "process_executor",
    "render_frame",
    "render_frames",
    "turned",
    "turntable",
    "write_gif",
]

# The camera's way.


def turned(vector: ArrayLike, axis: ArrayLike, count: int) -> np.ndarray:
    """A vector at equal steps of a full turn about an axis, counter-clockwise as seen from the axis' tip.

    Step k is ``v cos a + (u x v) sin a + u (u·v) (1 - cos a)`` (Rodrigues). Here u is the axis' unit vector,
    and ``a = 2 pi k / count``. Step 0 is the vector itself, to the bit.

    Parameters
    ----------
    vector, axis : three floats
        The axis must not be 0.
    count : int
        Number of steps, at least 1.

    Returns
    -------
    float64 array, shape (count, 3)

    Raises
    ------
    ValueError
        If ``count`` is over 1 and the vector lies along the axis. All steps would then be equal, except for
        rounding.
    """
    vector, unit = np.asarray(vector, dtype=np.float64), normalise(axis)
    if count > 1 and np.linalg.norm(np.cross(normalise(vector), unit)) < 1e-6:
        raise ValueError("the camera looks along the axis that it would turn about")
    angle = 2 * np.pi / count * np.arange(count)[:, np.newaxis]
    parallel = unit * (unit @ vector)
    return vector * np.cos(angle) + np.cross(unit, vector) * np.sin(angle) + parallel * (1 - np.cos(angle))


def turntable(camera: Camera, count: int) -> list[Camera]:
    """Cameras that go once round the target of a camera, about the axis ``up``, in equal steps.

    The first camera is the given camera. The lights do not move.

    Raises
    ------
    ValueError
        If ``count`` is over 1 and the camera looks along the axis.
    """
    offset = np.subtract(camera.position, camera.target)
    positions = np.add(camera.target, turned(offset, camera.up, count)[1:])
    return [camera, *(replace(camera, position=tuple(position)) for position in positions.tolist())]


def equal_distance(cameras: Sequence[Camera]) -> list[Camera]:
    """Cameras of `Camera.framing` with the same target, moved to the largest distance among them.

    Without this move the camera of a turntable would come nearer at angles where the mesh is narrow. All
    cameras get the largest height of picture and the nearest near plane among them.
    """
    if len(cameras) == 1:
        return list(cameras)
    target = np.asarray(cameras[0].target)
    distance = max(float(np.linalg.norm(np.subtract(camera.position, target))) for camera in cameras)
    height = max(camera.height for camera in cameras)
    near = min(camera.near for camera in cameras)
    return [
        replace(camera, position=tuple(target + distance * camera.viewer), height=height, near=near)
        for camera in cameras
    ]


# The frames, in a worker.


@dataclass(frozen=True)
class Animation:
    """Common settings of all frames of an animation.

    Parameters
    ----------
    scene : Scene
        The scene. Each frame has a camera of its own.
    design : ShadingPipeline
        The pipeline.
    engine : str
        ``"cxxrtl"`` or ``"pysim"``.
    full : ShadingPipeline, optional
        The full pipeline, if ``design`` is its specialisation. The errors of frames refer to the method and
        model of the full pipeline. By default ``design``.
    """

    scene: Scene
    design: ShadingPipeline
    engine: str = "cxxrtl"
    full: ShadingPipeline | None = None


@dataclass(frozen=True)
class AnimationFrame:
    """A frame of an animation.

    Parameters
    ----------
    image : uint8 array, shape (height, width, 3)
        The frame buffer.
    figures : dict
        Figures of `frame_figures`.
    """

    image: np.ndarray
    figures: dict[str, Any]


_ONE_AT_A_TIME = threading.Lock()
_animation: Animation | None = None


@functools.lru_cache(maxsize=1)
def _simulator(design: ShadingPipeline, engine: str) -> FrameSimulator:
    return FrameSimulator(design, engine)


@functools.lru_cache(maxsize=1)
def _triangle_simulator(design: ShadingPipeline, engine: str, size: tuple[int, int]) -> TriangleSimulator:
    return TriangleSimulator(Renderer(design), size, engine)


def render_frame(animation: Animation, camera: Camera) -> AnimationFrame:
    """Render one frame, and compare it with the frame of the golden renderer.

    A process builds or loads its model at the first frame. Threads of a process share one model. They render
    one after the other.
    """
    with _ONE_AT_A_TIME:
        scene = replace(animation.scene, camera=camera)
        if animation.design.build.takes_triangles:
            scene = divided(scene)
            design, size = animation.design, (scene.width, scene.height)
            simulator = _triangle_simulator(design, animation.engine, size)
            drawn = simulator.render(scene)
            comparison = compare_triangles(scene, simulator.renderer, drawn.sent, drawn.image)
            return AnimationFrame(drawn.image, triangle_figures(scene, design, drawn, comparison))
        frame = _simulator(animation.design, animation.engine).render(scene)
        full = animation.full or animation.design
        return AnimationFrame(frame.image, frame_figures(scene, full, frame, compare(scene, full, frame)))


def _begin(animation: Animation) -> None:
    """First call in a process of the pool. The process keeps the animation for all of its frames."""
    global _animation
    _animation = animation


def _render_frame(camera: Camera) -> AnimationFrame:
    assert _animation is not None
    return render_frame(_animation, camera)


# The frames, over workers.


@dataclass(frozen=True)
class FrameExecutor:
    """Workers that render frames of an animation.

    Parameters
    ----------
    submit : callable
        Function from a camera to the `concurrent.futures.Future` of its `AnimationFrame`.
    workers : int
        Number of frames rendered at a time.
    name : str
        Text for the report: ``"4 processes"``.
    """

    submit: Callable[[Camera], Future[AnimationFrame]]
    workers: int
    name: str


@contextmanager
def process_executor(animation: Animation, jobs: int) -> Iterator[FrameExecutor]:
    """Processes on this machine that render frames, see `local_executor`.

    If the model is not in the cache, each process builds it for itself.

    Parameters
    ----------
    animation : Animation
        Common settings of all frames.
    jobs : int
        Number of processes.
    """
    with local_executor(jobs, _begin, (animation,)) as executor:
        submit = functools.partial(executor.submit, _render_frame)
        yield FrameExecutor(submit, jobs, f"{jobs} process{'es' * (jobs > 1)}")


@contextmanager
def dask_executor(animation: Animation, address: str) -> Iterator[FrameExecutor]:
    """Workers of a Dask scheduler that render frames, see `cluster_client`.

    Parameters
    ----------
    animation : Animation
        Common settings of all frames. They are sent to each worker once.
    address : str
        Address of the scheduler, ``tcp://host:8786``.
    """
    with cluster_client(address) as client:
        workers = len(client.nthreads())
        shared = client.scatter(animation, broadcast=True, hash=False)
        executor = client.get_executor(pure=False)
        try:
            submit = functools.partial(executor.submit, render_frame, shared)
            yield FrameExecutor(submit, workers, f"{workers} worker{'s' * (workers > 1)} at {address}")
        finally:
            executor.shutdown(wait=False)


def render_frames(executor: FrameExecutor, cameras: Sequence[Camera]) -> Iterator[tuple[int, AnimationFrame]]:
    """Render a frame for each camera, and yield pairs of index and frame in order of completion.

    At most two frames for each worker are submitted at a time, so that finished frames do not fill the
    memory.

    Parameters
    ----------
    executor : FrameExecutor
        The workers.
    cameras : sequence of Camera
        A camera for each frame.
    """
    waiting = iter(enumerate(cameras))
    pending: dict[Future[AnimationFrame], int] = {}
    try:
        while True:
            while len(pending) < 2 * executor.workers and (entry := next(waiting, None)) is not None:
                index, camera = entry
                pending[executor.submit(camera)] = index
            if not pending:
                return
            done, _ = wait(pending, return_when=FIRST_COMPLETED)
            # Finished frames come before a frame that failed at the same time.
            for future in sorted(done, key=lambda future: future.exception() is not None):
                yield pending.pop(future), future.result()
                del future
    finally:
        for future in pending:
            future.cancel()


# The file.


def write_gif(path: str | os.PathLike, frames: Iterable[str | os.PathLike], milliseconds: int = 50) -> None:
    """Write pictures of one size as an animated GIF that repeats for ever. The file is whole or not there.

    A GIF has 256 colours. All frames share one palette, so that no colour flickers. Pillow's maximum coverage
    finds the palette among the colours of a regular sample of about a million pixels. Each colour counts
    once, so that a wide background does not take most of the palette.

    Parameters
    ----------
    path : path
        The output file.
    frames : paths
        The pictures.
    milliseconds : int
        Time that each picture is shown, in steps of 10.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    frames = [Path(frame) for frame in frames]
    sample = []
    for frame in frames:
        with Image.open(frame) as image:
            pixels = np.asarray(image.convert("RGB")).reshape(-1, 3)
        sample.append(pixels[:: 1 + len(pixels) * len(frames) // 1_000_000])
    colors = np.unique(np.concatenate(sample), axis=0)
    palette = Image.fromarray(colors[np.newaxis]).quantize(256, Image.Quantize.MAXCOVERAGE)

    def indexed(frame: Path) -> Image.Image:
        with Image.open(frame) as image:
            return image.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)

    with atomic_writer(path) as temporary:
        indexed(frames[0]).save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=(indexed(frame) for frame in frames[1:]),
            duration=milliseconds,
            loop=0,
            comment=MARK,
        )
