"""Frames from triangles: scenes through simulated geometry, shading and depth test."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.frame_constants import writes_of
from blysk.golden.frames.missed import missed_pieces
from blysk.golden.frames.triangle_frame import frame_of_pixels, sent_triangles, triangle_constants
from blysk.golden.geometry.light_adapter import LightAdapter
from blysk.golden.geometry.scene_triangles import SceneTriangles
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.geometry.triangles import ATTRIBUTE, DEPTH, FrameSettings, Triangles
from blysk.golden.geometry.vertex_sort import VertexSort
from blysk.golden.number.fixed import Fixed
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer
from blysk.hdl.core.stream import connect
from blysk.hdl.geometry.triangles import counters_shape
from blysk.hdl.geometry.vertex_sort import WAITING_TRIANGLES
from blysk.hdl.render import STATUS, RendererUnit, waiting_spans
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import sample_constants, single_pixels

__all__ = [
    "LARGEST_PICTURE",
    "SimulatedTriangleFrame",
    "TriangleSimulator",
    "sample_triangles",
    "with_surface",
]

LARGEST_PICTURE = 1 << 21
"""Pixels of the largest simulated memory of depths. Each takes 3 kB while the model is built."""

_IN_UNITS = 26
"""Largest number of triangles inside the hardware for each lane of setup, except in FIFOs of the throughput
style."""

_PAUSE = 10_000
"""Cycles without a beat after which a picture counts as finished, if no triangle is hidden."""


class _Timed(wiring.Component):
    """A `RendererUnit` with one more counter: ``busy`` counts the cycles in which the unit is not empty."""

    def __init__(self, unit: RendererUnit):
        self._unit = unit
        super().__init__(dict(unit.signature.members) | {"status": Out(counters_shape(*STATUS, "busy"))})

    def elaborate(self, platform):
        """The unit, and the counter."""
        m = Module()
        m.submodules.render = unit = self._unit
        connect(m, wiring.flipped(self.i), unit.i)
        connect(m, wiring.flipped(self.write), unit.write)
        connect(m, unit.o, wiring.flipped(self.o))
        m.d.comb += [
            unit.constants.eq(self.constants),
            *(self.status[name].eq(unit.status[name]) for name in STATUS),
        ]
        m.d.sync += self.status.busy.eq(self.status.busy + ~unit.idle)
        return m


@dataclass(frozen=True)
class SimulatedTriangleFrame:
    """A frame of simulated hardware that takes triangles.

    Parameters
    ----------
    image : uint8 array, shape (height, width, 3)
        The frame buffer.
    sent : SceneTriangles
        The triangles that were sent, and the frame's constants.
    counts : dict of str to int
        `RendererUnit`'s counters, and `missed_pieces`.
    written : int
        Number of pixels written, including pixels that a nearer surface replaced later.
    visible : int
        Number of pixels of the picture that show the surface.
    cycles : int
        Cycles from the first triangle until the hardware is empty.
    input_cycles : int
        Cycles until the last triangle was taken.
    engine : {"cxxrtl", "pysim"}
        The simulator.
    seconds : dict
        Seconds of each step. ``triangles``: the triangles are transformed, clipped and checked. ``simulate``:
        the simulation runs.
    """

    image: np.ndarray
    sent: SceneTriangles
    counts: dict[str, int]
    written: int
    visible: int
    cycles: int
    input_cycles: int
    engine: str
    seconds: dict[str, float]

    @property
    def spans(self) -> int:
        """Number of spans that were shaded."""
        return self.counts["spans"]

    @property
    def pixels(self) -> int:
        """Number of pixels that were shaded, including hidden pixels."""
        return self.counts["pixels"]


def sample_triangles(renderer: Renderer, size: tuple[int, int]) -> Triangles:
    """Some triangles around the top left corner of a picture, inside the grid, for the check of a new model.

    Parameters
    ----------
    renderer : Renderer
        Geometry and shading.
    size : (int, int)
        Width and height of the picture, 1 to 4095.
    """
    rng, grid, count = np.random.default_rng(2025), renderer.geometry.grid, 12
    frame, steps = FrameSettings.centred(*size), grid.steps
    near = np.minimum(size, 16) * steps
    middle = np.array([frame.left, frame.top]) * steps + rng.integers(0, near, (count, 1, 2))
    corner = middle + rng.integers(-8 * steps, 8 * steps, (count, 3, 2))
    # The largest pictures reach to the ends of the grid.
    corner = np.clip(corner, grid.coordinate.min_code, grid.coordinate.max_code)
    most = ATTRIBUTE.max_code
    triangles = Triangles(
        x=corner[..., 0],
        y=corner[..., 1],
        depth=rng.integers(0, DEPTH.max_code, (count, 3)),
        # No vertex normal is longer than 1. A design with several lights turns normals, and needs this
        # length.
        normal=most // 3 + rng.integers(-most // 6, most // 6, (count, 3, 3)),
        material=np.arange(count) * renderer.design.materials // count,
        two_sided=np.arange(count) % 2,
    )
    return with_surface(triangles, renderer.geometry.surface, rng)


def with_surface(triangles: Triangles, surface: AttributeSpans | None, rng: np.random.Generator) -> Triangles:
    """Triangles with attributes of a surface: depths to 1:8, colours from 0 to 1, any texture coordinates.

    Parameters
    ----------
    triangles : Triangles
        The triangles.
    surface : AttributeSpans or None
        The attributes. ``None``: the triangles do not change.
    rng : Generator
        Of the random numbers.
    """
    if surface is None:
        return triangles
    count = len(triangles)
    weight = 2.0 ** -rng.uniform(0, 3, (count, 3, 1))
    weight *= SurfaceWords.LARGEST / weight.max(axis=1, keepdims=True)
    low = np.repeat([0, -1], [3 * surface.colors, 2 * surface.coordinates])
    attributes = rng.uniform(low, 1, (count, 3, surface.attributes))
    attributes[::4] = np.rint(attributes[::4])
    words = np.concatenate((attributes * weight, weight), axis=2)
    places = {}
    if surface.coordinates:
        for name, format, *shape in (
            ("base", surface.BASE_FORMAT, 2),
            ("range", surface.RANGE_FORMAT),
            ("level", surface.LEVEL_FORMAT),
        ):
            places[name] = rng.integers(format.min_code, format.max_code + 1, (count, *shape))
    return replace(triangles, surface=Fixed.round(ATTRIBUTE, words).codes, **places)


class TriangleSimulator:
    """Simulator of the hardware from triangles to pixels, built once for a size of pictures.

    Parameters
    ----------
    renderer : Renderer
        Geometry and shading.
    size : (int, int)
        Width and height of the depth memory.
    engine : str
        ``"auto"``, ``"cxxrtl"`` or ``"pysim"``, see `simulate`.
    angle : float, optional
        Largest angle of a piece of a span in degrees, by default `SPAN_ANGLE`.

    Raises
    ------
    SimulationError
        If the pixels of the new model differ from the pixels of the bit-accurate model.
    CompilerMissing
        If the engine is ``"cxxrtl"`` and no C++ compiler works.
    """

    def __init__(
        self,
        renderer: Renderer,
        size: tuple[int, int],
        engine: str = "auto",
        angle: float | None = None,
    ):
        self.renderer, self.size, self.engine, self.angle = renderer, size, engine, angle
        self._origin = renderer, size
        self._render = RendererUnit(*self._origin)
        self._unit = _Timed(self._render)
        self._check()

    def _check(self) -> None:
        """Draw some triangles with the new simulation model, and compare with the bit-accurate model."""
        triangles, frame = sample_triangles(self.renderer, self.size), FrameSettings.centred(*self.size)
        constants = sample_constants(self.renderer.design)
        if self.renderer.rows:
            given = np.random.default_rng(2026).uniform(-0.5, 0.5, (self.renderer.design.lights - 1, 3, 3))
            axes = LightAdapter.codes_of(given[:, : len(self.renderer.axes)])
            constants[0] = replace(constants[0], axes=axes)
        expected = self.renderer.compute(triangles, frame, constants)
        run = simulate(
            self._unit,
            triangles.beats,
            count=len(expected.beats["x"]),
            constants=self._constants(frame),
            write=writes_of(constants),
            engine=self.engine,
            origin=self._origin,
        )
        # Later runs name the engine that "auto" chose, so the warning comes once.
        self.engine = run.engine
        if not all(np.array_equal(run.beats[name], value) for name, value in expected.beats.items()):
            raise SimulationError("the pixels of the simulated hardware differ from its bit-accurate model")

    def _constants(self, frame: FrameSettings) -> dict[str, int]:
        """Codes of the frame's constants for the first picture."""
        return frame.codes | ({} if self.renderer.coarse is None else {"picture": 0})

    def render(
        self,
        scene: Scene,
        progress: Callable[[int, int], object] | None = None,
        vcd: str | None = None,
    ) -> SimulatedTriangleFrame:
        """Send a scene's triangles, and collect its pixels.

        Parameters
        ----------
        scene : Scene
            The scene, of the simulator's size.
        progress : callable, optional
            Called during the run. Both arguments are the number of pixels written so far, because the number
            of all pixels is unknown.
        vcd : str, optional
            File for the waveforms. Only for the engine ``"pysim"``.

        Raises
        ------
        SimulationError
            If the hardware breaks the rules of streams, or stops.
        ValueError
            If the scene has another size, point lights or a near viewer, or does not fit the design.
        """
        if (scene.width, scene.height) != self.size:
            width, height = self.size
            raise ValueError(f"the scene is {scene.width}x{scene.height}, the memory {width}x{height}")
        start = perf_counter()
        sent = sent_triangles(scene, self.renderer, self.angle)
        missed = missed_pieces(scene, self.renderer, sent)
        ready = perf_counter()
        if not len(sent.triangles):
            none = *np.zeros((2, 0), dtype=int), np.zeros((0, 3), dtype=np.uint8)
            image = frame_of_pixels(scene, *none, self.renderer.design.transfer)
            seconds = {"triangles": ready - start, "simulate": 0.0}
            return SimulatedTriangleFrame(
                image,
                sent,
                dict.fromkeys(STATUS, 0) | missed,
                0,
                0,
                0,
                0,
                self.engine,
                seconds,
            )
        run = simulate(
            self._unit,
            sent.triangles.beats,
            count=None,
            constants=self._constants(sent.frame),
            write=writes_of(triangle_constants(scene, self.renderer)),
            engine=self.engine,
            origin=self._origin,
            progress=None if progress is None else lambda done: progress(done, done),
            vcd=vcd,
            idle_timeout=self._longest_silence(sent),
        )
        counts = {name: int(run.status[name]) for name in STATUS}
        beats = run.beats if self.renderer.design.build.lanes == 1 else single_pixels(run.beats)
        if counts["pixels"] - counts["hidden"] != len(beats):
            raise SimulationError("the hardware's counters and its output differ in the number of pixels")
        color = np.stack([beats[channel] for channel in "rgb"], axis=-1)
        return SimulatedTriangleFrame(
            image=frame_of_pixels(scene, beats["x"], beats["y"], color, self.renderer.design.transfer),
            sent=sent,
            counts=counts | missed,
            written=len(beats),
            visible=len(np.unique(beats["y"].astype(np.int64) * scene.width + beats["x"])),
            cycles=int(run.status["busy"]),
            input_cycles=int(run.input_cycles[-1] - run.input_cycles[0] + 1),
            engine=run.engine,
            seconds={"triangles": ready - start, "simulate": perf_counter() - ready},
        )

    def _longest_silence(self, sent: SceneTriangles) -> int:
        """Upper bound of the cycles without a beat, if all triangles inside the hardware are hidden.

        A triangle has at most as many pixels as the sum of its area, half its perimeter and 1. The triangles
        inside are consecutive drawn triangles.
        """
        geometry, frame, steps = self._render.geometry, sent.frame, self.renderer.geometry.grid.steps
        drawn, _ = VertexSort(geometry.grid, geometry.model.tested).compute(sent.triangles, frame)
        triangles = drawn.triangles
        build = self.renderer.design.build
        inside = _IN_UNITS * build.setups + waiting_spans(build)
        inside += 0 if geometry.compact else WAITING_TRIANGLES
        sides = []
        for values, first, end in (
            (triangles.x, frame.left, frame.right),
            (triangles.y, frame.top, frame.bottom),
        ):
            low, high = (f(values, axis=1) / steps for f in (np.min, np.max))
            sides.append(np.maximum(np.minimum(high, end) - np.maximum(low, first), 0) + 2)
        width, height = sides
        pixels = np.minimum(width * height, drawn.area / (2 * steps**2) + width + height + 1)
        cycles = geometry.interval + geometry.row_cycles * np.ptp(triangles.y, axis=1) / steps
        cycles += (self._render.pipeline.cycles_per_pixel + 1) * pixels
        total = np.append(np.cumsum(cycles), np.full(inside, cycles.sum()))
        return _PAUSE + int((total[inside:] - total[:-inside]).max(initial=total[inside - 1]))
