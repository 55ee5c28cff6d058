"""The frame runner: a scene through the simulated pipeline, and its errors against the golden renderer."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import NamedTuple

import numpy as np

from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.methods.local_chord_interpolator import SpanValues
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.pipeline import Design, Spans
from blysk.golden.reference.metrics import ErrorFigures, error_figures, mnse_published, nmse
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.reflection import BLINN
from blysk.golden.reference.renderer import render, shade_operands, shade_spans
from blysk.golden.reference.scene import Scene
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import dtype_of
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.spans import (
    cut_local_spans,
    cut_wide_spans,
    local_values,
    quantise_spans,
    sort_by_material,
)

__all__ = [
    "Comparison",
    "FrameSimulator",
    "PreparedFrame",
    "SimulatedFrame",
    "beats_of",
    "compare",
    "cut_spans",
    "method_in_float64",
    "model_frame",
    "prepare",
]


@dataclass(frozen=True)
class SimulatedFrame:
    """A frame that came out of the simulated pipeline.

    Parameters
    ----------
    image : uint8 array, shape (height, width, 3)
        The frame buffer, after the depth test.
    raster : Raster
        The rasteriser's spans.
    cut_raster : Raster
        The spans that went into the pipeline, before quantisation: as the former, wide ones cut, and in
        the order of their materials.
    spans_cut : int
        How many were cut.
    cycles : int
        Clocks from the first write of a constant to the last pixel.
    out_of_range_spans : int
        Spans that the pipeline flagged as wider than it can shade.
    engine : str
        ``"cxxrtl"`` or ``"pysim"``; ``"twin"`` for a frame that was not simulated.
    seconds : dict
        Of ``raster`` (rasterise, cut, quantise) and ``simulate`` (the stream in and out).
    """

    image: np.ndarray
    raster: Raster
    cut_raster: Raster
    spans_cut: int
    cycles: int
    out_of_range_spans: int
    engine: str
    seconds: dict[str, float]

    @property
    def spans(self) -> int:
        """Spans that went into the pipeline."""
        return len(self.cut_raster.length)

    @property
    def pixels(self) -> int:
        """Pixels that came out of it, hidden ones included."""
        return len(self.cut_raster.span)


class PreparedFrame(NamedTuple):
    """What a pipeline is given for a frame.

    Parameters
    ----------
    raster : Raster
        The rasteriser's spans.
    cut_raster : Raster
        The same fragments in spans that are narrow enough for the method.
    spans_cut : int
        Spans of the former that were cut.
    spans : Spans
        The latter, quantised.
    """

    raster: Raster
    cut_raster: Raster
    spans_cut: int
    spans: Spans


def beats_of(unit: ShadingPipelineUnit, spans: Spans) -> dict[str, np.ndarray]:
    """Input beats of a pipeline, as `simulate` takes them.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        The pipeline, or what has its ports.
    spans : Spans
        What it is to shade.
    """
    members = unit.i.payload.shape().members
    beats = {name: getattr(spans, name) for name in members if name != "values"}
    if "values" in members:
        beats["values"] = values = np.zeros(len(spans), dtype_of(members["values"]))
        for name in members["values"].elem_shape.members:
            values[name] = getattr(spans.values, name)
    return beats


def prepare(scene: Scene, design: Design) -> PreparedFrame:
    """Rasterise a scene, and cut and quantise its spans for a pipeline.

    Raises
    ------
    ValueError
        If the scene has point lights or a near viewer, and the method does not take values.
    """
    if scene.local and not design.takes_values:
        raise ValueError("point lights and a near viewer need the method chord-local")
    raster = rasterise(scene)
    cut, count = cut_spans(scene, raster, design)
    cut = sort_by_material(cut, scene.mesh.material)
    spans = quantise_spans(cut, scene.mesh.material)
    if design.takes_values:
        spans = dataclasses.replace(spans, values=local_values(scene, cut, design.lights))
    return PreparedFrame(raster, cut, count, spans)


def cut_spans(scene: Scene, raster: Raster, design: Design) -> tuple[Raster, int]:
    """Cut spans as the method of a pipeline needs it: the cut ones, and how many were cut."""
    interpolator = design.interpolator
    if design.takes_values:
        return cut_local_spans(scene, raster, interpolator)
    exponents = [material.exponent for material in scene.materials]
    widest = min(map(interpolator.widest_span, exponents))
    return cut_wide_spans(raster, widest, min(map(interpolator.largest_deviation, exponents)))


def model_frame(scene: Scene, design: Design) -> SimulatedFrame:
    """A frame by the bit-true twin: the simulated one to the bit, without cycles, which are 0.

    Parameters
    ----------
    scene, design
        As `FrameSimulator` takes them.

    Raises
    ------
    ValueError
        As `FrameSimulator.render` does.
    """
    start = perf_counter()
    raster, cut_raster, spans_cut, spans = prepare(scene, design)
    prepared = perf_counter()
    pixels = design.compute(spans, _constants_of(scene, design))
    return SimulatedFrame(
        image=_picture(scene, cut_raster, pixels.color),
        raster=raster,
        cut_raster=cut_raster,
        spans_cut=spans_cut,
        cycles=0,
        out_of_range_spans=pixels.out_of_range_spans,
        engine="twin",
        seconds={"raster": prepared - start, "simulate": perf_counter() - prepared},
    )


def _constants_of(scene: Scene, design: Design) -> list[FrameConstants]:
    if len(scene.materials) != design.materials:
        raise ValueError(f"the pipeline has {design.materials} materials, the scene {len(scene.materials)}")
    return [FrameConstants.of(scene, design.lights, index=index) for index in range(design.materials)]


def _picture(scene: Scene, raster: Raster, colors: np.ndarray) -> np.ndarray:
    """Frame buffer with the colours of the fragments that are seen."""
    image = np.empty((scene.height, scene.width, 3), dtype=np.uint8)
    image[...] = np.floor(np.multiply(scene.background, 255) + 0.5)
    image.reshape(-1, 3)[raster.pixel[raster.visible]] = colors[raster.visible]
    return image


class FrameSimulator:
    """A pipeline, built once, that renders any number of frames.

    Parameters
    ----------
    design : Design
        Method, reflection model, number of lights.
    engine : str
        ``"cxxrtl"`` or ``"pysim"``.

    Attributes
    ----------
    build_seconds : float
        Time to build or load the model, its check included.

    Raises
    ------
    SimulationError
        If the new model's pixels are not those of the twin.
    CompilerMissing
        If the engine is ``"cxxrtl"`` and no C++ compiler works.
    """

    def __init__(self, design: Design, engine: str = "cxxrtl"):
        start = perf_counter()
        self.design = design
        self.engine = engine
        self._unit = ShadingPipelineUnit(design)
        spans, constants = _sample(design)
        expected = design.compute(spans, constants)
        run = self._run(spans, constants, len(expected.x))
        if not np.array_equal(_colors(run.beats), expected.color):
            raise SimulationError("the simulated pipeline's pixels are not those of its twin")
        self.build_seconds = perf_counter() - start

    def _run(self, spans: Spans, constants: Sequence[FrameConstants], count: int, **options):
        return simulate(
            self._unit,
            beats_of(self._unit, spans),
            count=count,
            write=writes_of(constants),
            engine=self.engine,
            **options,
        )

    def render(
        self,
        scene: Scene,
        progress: Callable[[int, int], object] | None = None,
        vcd: str | None = None,
    ) -> SimulatedFrame:
        """Send a scene's spans through the pipeline, and its pixels into a frame buffer.

        Parameters
        ----------
        scene : Scene
            What to draw; at most as many lights as the design has.
        progress : callable, optional
            Called now and then with the pixels done and all pixels.
        vcd : str, optional
            File for the waveforms; engine ``"pysim"`` only.

        Raises
        ------
        SimulationError
            If the pipeline breaks the stream's rules, stops, or answers with other pixels than asked for.
        ValueError
            If the scene has more lights or other materials than the design, or a term is brighter than 8.
        """
        start = perf_counter()
        constants = _constants_of(scene, self.design)
        raster, cut_raster, spans_cut, spans = prepare(scene, self.design)
        rastered = perf_counter()
        count = len(cut_raster.span)
        report = None if progress is None else lambda done: progress(done, count)
        run = self._run(spans, constants, count, progress=report, vcd=vcd)
        pixel = run.beats["y"].astype(np.int64) * scene.width + run.beats["x"]
        if not np.array_equal(pixel, cut_raster.pixel):
            raise SimulationError("the simulated pipeline answered with other pixels than it was asked for")
        return SimulatedFrame(
            image=_picture(scene, cut_raster, _colors(run.beats)),
            raster=raster,
            cut_raster=cut_raster,
            spans_cut=spans_cut,
            cycles=run.total_cycles,
            out_of_range_spans=int(run.status["out_of_range_spans"]),
            engine=run.engine,
            seconds={"raster": rastered - start, "simulate": perf_counter() - rastered},
        )


@dataclass(frozen=True)
class Comparison:
    """Errors of a simulated frame over the pixels that show the surface.

    Parameters
    ----------
    golden : float64 array, shape (height, width, 3)
        Exactly normalised Phong interpolation along the spans with the frame's model, in [0, 1].
    arithmetic_error : ErrorFigures
        Against the same method and model in float64.
    method_error : ErrorFigures
        Against ``golden``.
    total_error : ErrorFigures
        Against the exact frame: Phong shading as on a GPU, Blinn's model.
    nmse : float
        Against the exact frame.
    mnse_published, mnse_published_share : float
        MNSE as [T] prints it, against the exact frame, and the share of values where it is defined.
    seconds : float
        Time of the three golden frames.
    """

    golden: np.ndarray
    arithmetic_error: ErrorFigures
    method_error: ErrorFigures
    total_error: ErrorFigures
    nmse: float
    mnse_published: float
    mnse_published_share: float
    seconds: float


def method_in_float64(scene: Scene, design: Design, raster: Raster) -> np.ndarray:
    """A frame by the method and the model of a pipeline, in exact arithmetic.

    Parameters
    ----------
    scene, design
        What is drawn, and by what.
    raster : Raster
        The spans, wide ones cut.

    Returns
    -------
    float64 array, shape (height, width, 3)
        In [0, 1].
    """
    interpolator = design.interpolator
    if design.takes_values:
        values = local_values(scene, raster)
        cosine, one_minus_cosine = interpolator.exact_operands(values, raster.length)
        return shade_operands(scene, raster, cosine, 1 - one_minus_cosine, design.specular.model)
    return shade_spans(
        scene, raster, interpolator.exact_normals, design.specular.model, interpolator.uses_chord
    )


def compare(scene: Scene, design: Design, frame: SimulatedFrame) -> Comparison:
    """Hold a simulated frame against the golden renderer.

    Of a frame that shows no surface every figure is NaN.
    """
    start = perf_counter()
    same_method = method_in_float64(scene, design, frame.cut_raster)
    golden = shade_spans(scene, frame.raster, "normalised", design.specular.model)
    exact = render(scene, "phong", BLINN, raster=frame.raster)
    seconds = perf_counter() - start
    if exact.mask.any():
        figures = [
            error_figures(frame.image, reference * 255, exact.mask)
            for reference in (same_method, golden, exact.image)
        ]
        shown, reference = frame.image[exact.mask], exact.image[exact.mask] * 255
        squares = (nmse(shown, reference), *mnse_published(shown, reference))
    else:
        figures = [ErrorFigures(*[math.nan] * len(dataclasses.fields(ErrorFigures)))] * 3
        squares = (math.nan,) * 3
    return Comparison(golden, *figures, *squares, seconds)


def _colors(beats: np.ndarray) -> np.ndarray:
    return np.stack([beats[channel] for channel in "rgb"], axis=-1)


def _sample(design: Design) -> tuple[Spans, list[FrameConstants]]:
    """A few spans of every kind, lights from all sides and materials, to check a model with."""
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
    if design.takes_values:
        start, step = rng.uniform(0, 0.3, (2, 2, len(length), design.lights, 1))
        spans = dataclasses.replace(spans, values=SpanValues.quantise(*(start + step * (0, 0.4, 1))))
    half = COMPONENT.max_code // 2
    vectors = rng.integers(-half, half, (2, design.lights, 3))
    constants = []
    for index in range(design.materials):
        colors = rng.integers(0, 255 * 64, (2, design.lights, 3))
        exponent = design.build.exponent or 7 + index
        ambient = rng.integers(0, 255 * 8, 3)
        constants.append(FrameConstants(exponent, ambient, vectors[0], vectors[1], colors[0], colors[1]))
    return spans, constants
