"""Turntables: a camera that goes once round, and its frames, spread over processes or machines."""

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
from PIL import Image

from blysk.golden.pipeline import Design
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.scene import Scene
from blysk.sim.cli.printing import frame_figures
from blysk.sim.frames.frame import FrameSimulator, compare
from blysk.sim.frames.workers import cluster_client, local_executor
from blysk.sim.output import atomic_writer

__all__ = [
    "Crew",
    "Film",
    "Shot",
    "cluster",
    "equal_distance",
    "process_pool",
    "shoot",
    "shot",
    "turned",
    "turntable",
    "write_gif",
]

# Where the camera goes.


def turned(vector: Sequence[float], axis: Sequence[float], count: int) -> np.ndarray:
    """A vector turned once round an axis, in equal steps, counter-clockwise seen against the axis.

    Step k is ``v cos a + (u x v) sin a + u (u·v) (1 - cos a)`` with the axis' unit vector u and
    ``a = 2 pi k / count`` (Rodrigues). The first is the vector itself, to the bit.

    Parameters
    ----------
    vector, axis : three floats
        The axis not 0.
    count : int
        Steps, at least 1.

    Returns
    -------
    float64 array, shape (count, 3)

    Raises
    ------
    ValueError
        If there are several and the vector lies along the axis: they would be the same but for rounding.
    """
    vector, unit = np.asarray(vector, dtype=np.float64), normalise(axis)
    if count > 1 and np.linalg.norm(np.cross(normalise(vector), unit)) < 1e-6:
        raise ValueError("the camera looks along the axis that it would turn about")
    angle = 2 * np.pi / count * np.arange(count)[:, np.newaxis]
    along = unit * (unit @ vector)
    return vector * np.cos(angle) + np.cross(unit, vector) * np.sin(angle) + along * (1 - np.cos(angle))


def turntable(camera: Camera, count: int) -> list[Camera]:
    """Cameras that go once round their target, about the axis ``up``, from a camera on.

    The lights stay where they are. The first camera is the given one.

    Raises
    ------
    ValueError
        If there are several and the camera looks along the axis.
    """
    offset = np.subtract(camera.position, camera.target)
    places = np.add(camera.target, turned(offset, camera.up, count)[1:])
    return [camera, *(replace(camera, position=tuple(place)) for place in places.tolist())]


def equal_distance(cameras: Sequence[Camera]) -> list[Camera]:
    """Cameras with one target, as `Camera.framing` gives them, all as far away as the furthest.

    A turntable of framing cameras would come nearer wherever the mesh is narrow. The height of the picture
    becomes the largest, the near plane the nearest.
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


# What a worker does.


@dataclass(frozen=True)
class Film:
    """What all frames of an animation have in common.

    Parameters
    ----------
    scene : Scene
        What is drawn; its camera counts for nothing.
    design : Design
        The pipeline.
    engine : str
        ``"cxxrtl"`` or ``"pysim"``.
    full : Design, optional
        What the pipeline was fitted from, whose method and model the frames are held against. ``None``: the
        pipeline itself.
    """

    scene: Scene
    design: Design
    engine: str = "cxxrtl"
    full: Design | None = None


@dataclass(frozen=True)
class Shot:
    """A frame of an animation.

    Parameters
    ----------
    image : uint8 array, shape (height, width, 3)
        The frame buffer.
    figures : dict
        Of `frame_figures`.
    """

    image: np.ndarray
    figures: dict[str, Any]


_ONE_AT_A_TIME = threading.Lock()
_film: Film | None = None


@functools.lru_cache(maxsize=1)
def _simulator(design: Design, engine: str) -> FrameSimulator:
    return FrameSimulator(design, engine)


def shot(film: Film, camera: Camera) -> Shot:
    """Render one frame and hold it against the golden renderer.

    A process builds or loads its model at the first frame. A model has one state: threads take turns.
    """
    with _ONE_AT_A_TIME:
        scene = replace(film.scene, camera=camera)
        frame = _simulator(film.design, film.engine).render(scene)
        full = film.full or film.design
        return Shot(frame.image, frame_figures(scene, full, frame, compare(scene, full, frame)))


def _begin(film: Film) -> None:
    """First thing in a process of the pool: the film crosses once, not with every frame."""
    global _film
    _film = film


def _shot(camera: Camera) -> Shot:
    return shot(_film, camera)


# Who does it.


@dataclass(frozen=True)
class Crew:
    """Workers that wait for cameras.

    Parameters
    ----------
    submit : callable
        Takes a camera, returns the `concurrent.futures.Future` of its `Shot`.
    workers : int
        Frames at a time.
    name : str
        For the report.
    """

    submit: Callable[[Camera], Future]
    workers: int
    name: str


@contextmanager
def process_pool(film: Film, jobs: int) -> Iterator[Crew]:
    """A crew of processes on this machine, see `local_executor`.

    The model must be in the cache, or each process builds it for itself.

    Parameters
    ----------
    film : Film
        What they draw.
    jobs : int
        How many processes.
    """
    with local_executor(jobs, _begin, (film,)) as executor:
        yield Crew(functools.partial(executor.submit, _shot), jobs, f"{jobs} process{'es' * (jobs > 1)}")


@contextmanager
def cluster(film: Film, address: str) -> Iterator[Crew]:
    """A crew of the workers of a Dask scheduler, see `cluster_client`.

    Parameters
    ----------
    film : Film
        What they draw; it crosses to each worker once.
    address : str
        Of the scheduler, ``tcp://host:8786``.
    """
    with cluster_client(address) as client:
        workers = len(client.nthreads())
        shared = client.scatter(film, broadcast=True, hash=False)
        executor = client.get_executor(pure=False)
        try:
            yield Crew(
                functools.partial(executor.submit, shot, shared),
                workers,
                f"{workers} worker{'s' * (workers > 1)} at {address}",
            )
        finally:
            executor.shutdown(wait=False)


def shoot(crew: Crew, cameras: Sequence[Camera]) -> Iterator[tuple[int, Shot]]:
    """Frames as they are done, in any order, with the index of each.

    At most two frames a worker are under way, so that finished ones do not fill the memory.

    Parameters
    ----------
    crew : Crew
        Who draws them.
    cameras : sequence of Camera
        One a frame.
    """
    waiting = iter(enumerate(cameras))
    pending: dict[Future, int] = {}
    try:
        while True:
            while len(pending) < 2 * crew.workers and (entry := next(waiting, None)) is not None:
                index, camera = entry
                pending[crew.submit(camera)] = index
            if not pending:
                return
            done, _ = wait(pending, return_when=FIRST_COMPLETED)
            # What is finished comes before what failed beside it.
            for future in sorted(done, key=lambda future: future.exception() is not None):
                yield pending.pop(future), future.result()
                del future
    finally:
        for future in pending:
            future.cancel()


# What comes of it.


def write_gif(path: str | os.PathLike, frames: Iterable[str | os.PathLike], milliseconds: int = 50) -> None:
    """Write pictures of one size as an animated GIF without end; whole or not at all.

    GIF has 256 colours. The same serve all frames, so that none flickers: those of Pillow's maximum coverage
    over the frames' colours, each counted once, or else a wide background would take most. They are found in
    a regular sample of about a million pixels.

    Parameters
    ----------
    path : path
        The output file.
    frames : paths
        The pictures.
    milliseconds : int
        Time of each, in steps of 10.

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
        )
