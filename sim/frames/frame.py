"""The frame runner: scenes through the simulated pipeline."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from amaranth.lib import data

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.attribute_spans import SpanAttributes
from blysk.golden.cosines.chord_setup import SpanValues
from blysk.golden.cosines.quotient_spans import SpanVectors
from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.frames.frame import Picture, frame_buffer
from blysk.golden.frames.prepare import prepare, with_tables
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import FILTERS, Texture
from blysk.hdl.pipeline import ShadingPipelineUnit, span_shape
from blysk.hdl.pixel_pipelines import WidePipelinesUnit
from blysk.sim.engines.beats import dtype_of
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import Run, simulate
from blysk.sim.frames.outside_texels import PipelineWithTexels

__all__ = [
    "FrameSimulator",
    "SimulatedFrame",
    "attribute_beats",
    "beats_of",
    "sample_attributes",
    "sample_constants",
    "sample_material",
    "sample_textures",
    "single_pixels",
]


@dataclass(frozen=True)
class SimulatedFrame(Picture):
    """A frame of the simulated pipeline, with the time that the hardware takes.

    Parameters
    ----------
    cycles : int
        Cycles from the first write of a constant to the last pixel.
    engine : {"cxxrtl", "pysim"}
        The simulator.
    """

    cycles: int
    engine: str


_IDLE = 1000
"""Idle timeout of several pipelines: cycles without a beat after which they are done.

A pixel takes fewer cycles.
"""


def beats_of(
    unit: ShadingPipelineUnit | WidePipelinesUnit | PipelineWithTexels, spans: Spans
) -> dict[str, np.ndarray]:
    """Input beats of a pipeline, as `simulate` takes them.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        The pipeline, or a unit with its input ports.
    spans : Spans
        The spans to shade.
    """
    members = unit.i.payload.shape().members
    vectors = {} if spans.vectors is None else spans.vectors._asdict()
    given = {name: vectors[name] for name in members if name in vectors}
    others = [name for name in members if name not in ("values", "attributes") and name not in given]
    beats = {name: getattr(spans, name) for name in others} | given
    if "values" in members:
        beats["values"] = values = np.zeros(len(spans), dtype_of(members["values"]))
        for name in members["values"].elem_shape.members:
            values[name] = getattr(spans.values, name)
    if "attributes" in members:
        beats["attributes"] = attribute_beats(members["attributes"], spans.attributes)
    return beats


def attribute_beats(layout: data.StructLayout, attributes: SpanAttributes) -> np.ndarray:
    """Attributes of spans as beats.

    Parameters
    ----------
    layout : StructLayout
        Layout of the beats, see `span_attributes_shape`. Further members stay 0.
    attributes : SpanAttributes
        The attributes.
    """
    beats = np.zeros(len(attributes.exponent), dtype_of(layout))
    weights = attributes.weight_start, attributes.weight_step
    for member, codes, weight in zip(
        ("start", "step"), (attributes.start, attributes.step), weights, strict=True
    ):
        for name in beats[member].dtype.names:
            if name == "weight":
                beats[member]["weight"] = weight
            else:
                beats[member][name] = codes[:, :3] if name == "colors" else codes[:, -2:]
    for name in ("exponent", "base", "range", "level"):
        if name in beats.dtype.names:
            beats[name] = getattr(attributes, name)
    return beats


def _in_order(beats: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Pixels of beats that hold several pixels, put into the order of a single pipeline.

    ``y`` has the scanline of each pixel in this order. Within a scanline both orders follow the order of the
    spans.
    """
    lanes = beats["pixels"].shape[1]
    pixels = beats["pixels"][(beats["present"][:, np.newaxis] >> np.arange(lanes) & 1).astype(bool)]
    if len(pixels) != len(y):
        raise SimulationError(f"the simulated pipelines gave {len(pixels)} pixels of {len(y)}")
    ordered = np.empty_like(pixels)
    ordered[np.argsort(y, kind="stable")] = pixels[np.argsort(pixels["y"], kind="stable")]
    return ordered


def single_pixels(beats: np.ndarray) -> np.ndarray:
    """Places and colours of the pixels in beats of several lanes, in their order.

    Parameters
    ----------
    beats : structured array
        Output beats of a pipeline or of a `RendererUnit`, with the fields of `beat_shape`.
    """
    lanes = beats["colors"].shape[1]
    lane = np.arange(lanes)
    present = (beats["present"][:, np.newaxis] >> lane & 1).astype(bool)
    fields = [(name, np.int64) for name in ("x", "y")] + [(name, np.uint8) for name in "rgb"]
    pixels = np.zeros(present.shape, dtype=fields)
    pixels["x"], pixels["y"] = beats["x"][:, np.newaxis] + lane, beats["y"][:, np.newaxis]
    for name in "rgb":
        pixels[name] = beats["colors"][name]
    return pixels[present]


class FrameSimulator:
    """Simulator of one or several pipelines. It is built once, and renders any number of frames.

    Parameters
    ----------
    design : ShadingPipeline
        The pipeline: method, reflection model, number of lights and so on. Its `Build` has the number of
        pipelines. Texels outside of the pipeline are in a test memory, see `PipelineWithTexels`.
    engine : str
        ``"auto"``, ``"cxxrtl"`` or ``"pysim"``, see `simulate`.

    Attributes
    ----------
    engine : str
        The engine in use: ``"cxxrtl"`` or ``"pysim"``.
    build_seconds : float
        Seconds to build or load the model, and to check it.

    Raises
    ------
    SimulationError
        If the pixels of the new model differ from the pixels of the bit-accurate model.
    CompilerMissing
        If the engine is ``"cxxrtl"`` and no C++ compiler works.
    """

    def __init__(self, design: ShadingPipeline, engine: str = "auto"):
        start = perf_counter()
        self.design = design
        self.engine = engine
        self._pipes, self._lanes = design.build.pipes, design.build.lanes
        self._unit = _unit_of(design)
        spans, constants = _sample(design)
        expected = design.compute(spans, constants)
        run, beats = self._run(spans, constants, expected.y)
        # Later runs name the engine that "auto" chose, so the warning comes once.
        self.engine = run.engine
        if not np.array_equal(_colors(beats), expected.color):
            raise SimulationError("the pixels of the simulated pipeline differ from its bit-accurate model")
        self.build_seconds = perf_counter() - start

    def _run(
        self, spans: Spans, constants: Sequence[FrameConstants], y: np.ndarray, **options
    ) -> tuple[Run, np.ndarray]:
        """A simulation, and its pixels in the order of the spans. ``y`` has the pixels' scanlines."""
        # The number of wide beats depends on the number of pixels that leave on each cycle.
        spans = self.design.sent(spans, constants)
        beats = int((-(-np.asarray(spans.length) // self._lanes)).sum())
        ends = {"count": beats} if self._pipes == 1 else {"count": None, "idle_timeout": _IDLE}
        run = simulate(
            self._unit,
            beats_of(self._unit, spans),
            write=writes_of(constants),
            engine=self.engine,
            origin=self.design,
            **ends,
            **options,
        )
        if self._lanes > 1:
            return run, single_pixels(run.beats)
        return run, run.beats if self._pipes == 1 else _in_order(run.beats, y)

    def render(
        self,
        scene: Scene,
        progress: Callable[[int, int], object] | None = None,
        vcd: str | None = None,
    ) -> SimulatedFrame:
        """Send a scene's spans through the pipeline, and write the pixels into a frame buffer.

        Parameters
        ----------
        scene : Scene
            The scene, with at most as many lights as the design has.
        progress : callable, optional
            Called during the run with the number of pixels drawn so far and the number of all pixels.
        vcd : str, optional
            File for the waveforms. Only for the engine ``"pysim"``.

        Raises
        ------
        SimulationError
            If the pipeline breaks the rules of streams, stops, or gives pixels at wrong coordinates.
        ValueError
            If the scene has more lights or other materials than the design, or a term is brighter than 8.
        """
        start = perf_counter()
        prepared = prepare(scene, self.design)
        rastered = perf_counter()
        raster = prepared.cut_raster
        count, at_once = len(raster.span), self._pipes * self._lanes
        report = None if progress is None else lambda done: progress(min(done * at_once, count), count)
        y = raster.pixel // scene.width
        run, beats = self._run(prepared.spans, prepared.constants, y, progress=report, vcd=vcd)
        assert run.status is not None
        pixel = beats["y"].astype(np.int64) * scene.width + beats["x"]
        if not np.array_equal(pixel, raster.pixel):
            raise SimulationError(
                "the simulated pipeline gave pixels at other coordinates than its spans have"
            )
        return SimulatedFrame(
            image=frame_buffer(scene, raster, _colors(beats), self.design.transfer),
            prepared=prepared,
            out_of_range_spans=int(run.status["out_of_range_spans"]),
            seconds={"raster": rastered - start, "simulate": perf_counter() - rastered},
            cycles=run.total_cycles,
            engine=run.engine,
        )


def _unit_of(design: ShadingPipeline) -> ShadingPipelineUnit | WidePipelinesUnit | PipelineWithTexels:
    if design.build.pipes > 1:
        return WidePipelinesUnit(PixelPipelines(design))
    return PipelineWithTexels(design) if design.texels_outside else ShadingPipelineUnit(design)


def _colors(beats: np.ndarray) -> np.ndarray:
    return np.stack([beats[channel] for channel in "rgb"], axis=-1)


def _sample(design: ShadingPipeline) -> tuple[Spans, list[FrameConstants]]:
    """Some spans of every kind, and constants with lights from all sides, to check a new model with."""
    rng = np.random.default_rng(2025)
    length = np.r_[1, 2, 3, rng.integers(0, min(24, 1 << design.length_bits), 37)]
    normals = rng.normal(size=(len(length), 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    turned = normals + rng.uniform(-0.3, 0.3, normals.shape)
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    spans = Spans(
        x=rng.integers(0, 4000, len(length)) >> (12 - design.x_bits),
        y=rng.integers(0, 4096, len(length)) >> (12 - design.y_bits),
        length=length,
        normal_left=quantise(normals),
        normal_right=quantise(turned),
        material=np.arange(len(length)) // 5 % design.materials,
    )
    members = span_shape(design).members
    if "step" in members:
        ends = rng.normal(size=(2, len(length), members["step"].length))
        # The ends are random. So the step of a span of two pixels would not fit its word. An empty span has
        # no step.
        vectors = SpanVectors.quantise(*ends, np.where(length > 2, length, 1))
        spans = replace(spans, vectors=vectors)
    if "values" in members:
        start, step = rng.uniform(0, 0.3, (2, 2, len(length), design.lights, 1))
        spans = replace(spans, values=SpanValues.quantise(*(start + step * (0, 0.4, 1))))
        if design.factors:
            spans = replace(spans, factors=spans.values.diffuse[:, list(design.factors)])
    if design.albedo is not None:
        spans = replace(spans, attributes=sample_attributes(design.albedo, length, rng))
    return spans, sample_constants(design, rng)


def sample_attributes(albedo: Albedo, length: np.ndarray, rng: np.random.Generator) -> SpanAttributes:
    """Random attributes of some spans, to check a new model with: colours and texture coordinates."""
    shape = (2, len(length), albedo.spans.attributes)
    ends = rng.random(shape)
    ends[:, :, 3 * albedo.colors :] = rng.uniform(-40, 40, ends[:, :, 3 * albedo.colors :].shape)
    weights = rng.uniform(0.5, 1, (2, len(length))) if albedo.perspective else None
    level = rng.integers(0, 4, len(length))
    given = None if weights is None else (weights[0], weights[1])
    return SpanAttributes.quantise(
        albedo.spans, *ends, np.maximum(length, 1), weights=given, level=level, periodic=True
    )


def sample_textures(
    design: ShadingPipeline, constants: Sequence[FrameConstants], rng: np.random.Generator
) -> list[FrameConstants]:
    """Constants with emission, tints and textures of 8x8 texels or fewer, for a design with an albedo."""
    albedo = design.albedo
    assert albedo is not None
    found = [
        replace(of, emission=rng.integers(0, 255 * 8, 3), tinted=bool(index % 2) if albedo.tints else None)
        for index, of in enumerate(constants)
    ]
    if albedo.texture is not None:
        memory = albedo.texture.memory
        side = min(memory.fitting(), 8)
        images = [Texture(rng.random((side, side, 3)), filter=name) for name in FILTERS]
        loaded = memory.load(images if side == 8 else images[:1])
        count = len(loaded.descriptors)
        found = [replace(of, texture=loaded.descriptors[k % count]) for k, of in enumerate(found)]
        found[0] = replace(found[0], texels=loaded)
    return found


def sample_constants(design: ShadingPipeline, rng: np.random.Generator | None = None) -> list[FrameConstants]:
    """Frame constants of each material of a design, with lights from all sides, to check a new model with."""
    rng = np.random.default_rng(2025) if rng is None else rng
    half = COMPONENT.max_code // 2
    vectors = rng.integers(-half, half, (2, design.lights, 3))
    constants = []
    for index in range(design.materials):
        colors = rng.integers(0, 255 * 64, (2, design.lights, 3))
        exponent = design.build.exponent or 7 + index % 64
        ambient = rng.integers(0, 255 * 8, 3)
        constants.append(FrameConstants(exponent, ambient, vectors[0], vectors[1], colors[0], colors[1]))
    if design.loads_tables:
        materials = [sample_material(design, index) for index in range(design.materials)]
        constants = with_tables(constants, materials, design)
    return constants if design.albedo is None else sample_textures(design, constants, rng)


def sample_material(design: ShadingPipeline, index: int) -> Material:
    """Sample material number ``index``, with an exponent or lobe that the pipeline serves."""
    material = Material((0.08, 0.05, 0.03), (0.5,) * 3, (0.6,) * 3, design.build.exponent or 7 + index % 64)
    if not design.loads_tables:
        return material
    lobe = design.specular
    if lobe.fixed is None:
        return replace(material, exponent=7 + index % lobe.banks)
    name, value = lobe.reflection.PARAMETER, lobe.fixed[index % lobe.banks]
    return replace(material, **({} if name is None else {name: value}))
