"""Frames of simulated pipelines, from a mesh or a scene in one call."""

import base64
import html
import io
import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import Any, Unpack, cast

import numpy as np
from PIL import Image

from blysk.golden.frames.compare import Comparison, FrameErrors, compare, compare_image
from blysk.golden.frames.prepare import constants_of
from blysk.golden.geometry.coarse_depth import CoarseDepth
from blysk.golden.pipeline import Design
from blysk.golden.reference.metrics import error_map
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer
from blysk.sim.api.design import design_of, refused_counts
from blysk.sim.api.options import DESIGN, RENDERING, SCENE, SLOW_SIZE, Engine, RenderOptions, Source
from blysk.sim.api.scene import load, scenes_of
from blysk.sim.api.settings import Settings, check_engine, rendering_settings
from blysk.sim.api.signature import with_options
from blysk.sim.errors import CompilerMissing, OptionError
from blysk.sim.frames.figures import difference_figures, frame_figures, saving_figures, triangle_figures
from blysk.sim.frames.frame import FrameSimulator, SimulatedFrame
from blysk.sim.frames.picture import write_comparison, write_image
from blysk.sim.frames.specialise import Specialisation, specialise
from blysk.sim.frames.summary import frame_lines, specialisation_lines
from blysk.sim.frames.triangles import LARGEST_PICTURE, SimulatedTriangleFrame, TriangleSimulator
from blysk.sim.meshes.mesh import LoadedMesh
from blysk.sim.output import atomic_writer
from blysk.sim.run_files import RunFiles

__all__ = [
    "BUILDING",
    "SPECIALISING",
    "RenderedFrame",
    "Rendering",
    "prepare_rendering",
    "render",
]

SPECIALISING = "finding out what the scene needs"
"""Stage of `prepare_rendering` in which a specialisation is found."""
BUILDING = "building the model"
"""Stage of `prepare_rendering` in which the hardware is compiled; the cause of a long time is appended."""

Progress = Callable[[int, int], object]


@dataclass(frozen=True)
class RenderedFrame:
    """A frame of a simulated pipeline; a notebook shows its picture and its figures.

    Parameters
    ----------
    scene : Scene
        What was drawn.
    design : Design
        The pipeline; if it was specialised, the full pipeline.
    simulated : SimulatedFrame or SimulatedTriangleFrame
        The hardware's frame, by spans or by triangles.
    name : str
        Name of the mesh.
    details : dict
        ``ignored`` and ``counts`` of `LoadedMesh`, ``seconds`` of its parts, perhaps ``specialisation``.
    files : RunFiles
        The files that were read, which `save` does not replace.
    """

    scene: Scene
    design: Design
    simulated: SimulatedFrame | SimulatedTriangleFrame
    name: str
    details: dict[str, Any]
    files: RunFiles = field(default_factory=RunFiles)

    @property
    def image(self) -> np.ndarray:
        """The picture, uint8, shape (height, width, 3)."""
        return self.simulated.image

    @property
    def error(self) -> FrameErrors:
        """Errors against exact normals at every pixel with the same reflection model, in LSB and dB."""
        return self.comparison.method_error

    @property
    def total_error(self) -> FrameErrors:
        """Errors against exact shading by the exact model: a lobe's own, else Blinn's power, see `target_of`.

        That of the reflection model is in it; with a lobe it is `error`.
        """
        return self.comparison.total_error

    @cached_property
    def error_map(self) -> np.ndarray:
        """Largest error of the channels of each pixel, as in `error`, LSB; float64, shape (height, width)."""
        return error_map(self.image, self.comparison.golden)

    @property
    def cycles(self) -> int:
        """Cycles from the first write of a constant to the last pixel; of triangles until all are drawn."""
        return self.simulated.cycles

    @property
    def spans(self) -> int:
        """Number of spans that went into the shading pipeline."""
        return self.simulated.spans

    @property
    def pixels(self) -> int:
        """Number of pixels that came out of it, hidden ones included."""
        return self.simulated.pixels

    @property
    def engine(self) -> str:
        """Simulator that ran: ``"cxxrtl"`` or ``"pysim"``."""
        return self.simulated.engine

    @cached_property
    def comparison(self) -> Comparison:
        """The golden frame, and the errors against three references; by triangles against two."""
        if isinstance(self.simulated, SimulatedTriangleFrame):
            return compare_image(self.scene, self.design, self.simulated.image)
        return compare(self.scene, self.design, self.simulated)

    @cached_property
    def figures(self) -> dict[str, Any]:
        """Every figure that the command line prints, by name."""
        if isinstance(self.simulated, SimulatedTriangleFrame):
            figures = triangle_figures(self.scene, self.design, self.simulated, self.comparison)
        else:
            figures = frame_figures(self.scene, self.design, self.simulated, self.comparison)
        return {
            "mesh": self.name,
            **figures,
            **self.details,
            "counts": {**self.details["counts"], **figures["counts"]},
            "seconds": {**self.details["seconds"], **figures["seconds"]},
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the picture; the suffix chooses the format.

        Raises
        ------
        InputError
            If the suffix names no picture format, or the file cannot be written, or was read for the frame.
        """
        with self.files.active():
            write_image(path, self.image)

    def save_comparison(self, path: str | os.PathLike[str]) -> None:
        """Write one picture of the simulated frame, the golden frame and the error map; see `save`."""
        parameter = self.design.highlight_parameter(self.scene.materials[0])
        name = self.design.specular.model.PARAMETER if self.design.specular else "exponent"
        highlight = "" if name is None else f", {name} {parameter:.4g}"
        subtitle = "no pixel shows the surface"
        if self.figures["visible_pixels"]:
            subtitle = (
                "simulated RTL beside exact normals of every pixel, same model, in float64: largest error "
                f"{self.error.max_lsb:.2f} LSB, {self.cycles:,} cycles for {self.pixels:,} pixels"
            )
        title = f"{self.name}: {self.design.method}, {self.design.model}{highlight}"
        with self.files.active():
            write_comparison(path, self.image, self.comparison.golden, title=title, subtitle=subtitle)

    def lines(self) -> Iterator[str]:
        """The figures as the command line prints them."""
        yield from frame_lines(self.figures)
        if "specialisation" in self.figures:
            yield from specialisation_lines(self.figures["specialisation"])

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __repr__(self) -> str:
        height, width, _ = self.image.shape
        return (
            f"<RenderedFrame {self.name} {width}x{height}, {self.design.method}, {self.design.model}, "
            f"{self.cycles:,} cycles>"
        )

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        Image.fromarray(self.image).save(file, format="PNG")
        return file.getvalue()

    def _repr_html_(self) -> str:
        picture = base64.b64encode(self._repr_png_()).decode()
        rows = {
            "method": f"{self.design.method}, {self.design.model}",
            "cycles": f"{self.cycles:,}",
            "spans": f"{self.spans:,}",
            "pixels": f"{self.pixels:,}",
            "largest error, exact normals, same model": f"{self.error.max_lsb:.3f} LSB",
            "PSNR": f"{self.error.psnr_db:.2f} dB",
        }
        table = "".join(
            f"<tr><th>{key}</th><td>{html.escape(value)}</td></tr>" for key, value in rows.items()
        )
        alternative = html.escape(f"{self.name}, simulated")
        return (
            f'<figure><img alt="{alternative}" src="data:image/png;base64,{picture}">'
            f"<figcaption><table>{table}</table></figcaption></figure>"
        )


@dataclass(frozen=True)
class Rendering:
    """A pipeline that is ready to draw its scenes: one, or those of a turntable.

    Parameters
    ----------
    loaded : LoadedMesh
        The mesh.
    scenes : tuple of Scene
        What is drawn.
    specialisation : Specialisation
        The full pipeline and its reductions; none if no specialisation was asked for.
    is_specialised : bool
        Whether a specialisation was asked for.
    engine : str
        ``"cxxrtl"`` or ``"pysim"``.
    simulator : FrameSimulator or TriangleSimulator or None
        The hardware's simulator; ``None`` where there is no compiler and none is needed.
    seconds : dict
        Seconds of loading and building.
    pipes : int
        Number of pipelines.
    setups : int
        Lanes of triangle setup, of hardware that takes triangles; 0: it takes spans.
    coarse : bool
        Whether that hardware has a coarse depth test.
    """

    loaded: LoadedMesh
    scenes: tuple[Scene, ...]
    specialisation: Specialisation
    is_specialised: bool
    engine: str
    simulator: FrameSimulator | TriangleSimulator | None
    seconds: dict[str, float]
    pipes: int = 1
    setups: int = 0
    coarse: bool = False

    @property
    def design(self) -> Design:
        """The full pipeline."""
        return self.specialisation.full

    @property
    def counts(self) -> dict[str, int]:
        """Counts of the mesh, see `LoadedMesh`."""
        names = ("repaired_normals", "dropped_faces", "opposed_faces")
        return {name: getattr(self.loaded, name) for name in names}

    def render(self, progress: Progress | None = None, vcd: str | None = None) -> RenderedFrame:
        """Draw the first scene.

        Parameters
        ----------
        progress : callable, optional
            Called now and then with the number of pixels so far and in all.
        vcd : str, optional
            File for the waveforms, of the engine ``"pysim"``.
        """
        assert self.simulator is not None
        frame = self.simulator.render(self.specialisation.scenes[0], progress=progress, vcd=vcd)
        details: dict[str, Any] = {"ignored": list(self.loaded.ignored)}
        details |= {"counts": self.counts, "seconds": self.seconds}
        if self.is_specialised:
            details["specialisation"] = {**saving_figures(self.specialisation), "cycles": frame.cycles}
            if vcd is None:
                whole = FrameSimulator(self.design, self.engine, self.pipes).render(self.scenes[0])
                details["specialisation"]["full_cycles"] = whole.cycles
                details["specialisation"] |= difference_figures(cast(SimulatedFrame, frame), whole)
        files = RunFiles.current()
        return RenderedFrame(self.scenes[0], self.design, frame, self.loaded.name, details, files)


def prepare_rendering(
    settings: Settings,
    *,
    design: Design | None = None,
    engine: Engine | str = "auto",
    frames: int = 0,
    remote: bool = False,
    stage: Callable[[str], object] = lambda text: None,
) -> Rendering:
    """Load the mesh, choose the engine, and build the pipeline.

    Parameters
    ----------
    settings : Settings
        Settings of `rendering_settings`.
    design : Design, optional
        The pipeline, in place of the settings' own.
    engine : {"auto", "cxxrtl", "pysim"}
        If ``"auto"`` finds no compiler, pictures are at most `SLOW_SIZE`, with a warning; a given scene keeps
        its size.
    frames : int
        Number of frames of a turntable; 0: a single picture.
    remote : bool
        Whether other machines draw the frames, so that a compiler is not needed on this one.
    stage : callable
        Called with a text before each stage of the work.
    """
    start = perf_counter()
    with settings.located():
        made = design or _design(settings)
        _check_geometry(settings, made)
        stage("loading the mesh")
        loaded = load(settings)
        seconds = {"load": perf_counter() - start}
        simulator, used = None, "cxxrtl"
        while True:
            scenes = tuple(scenes_of(loaded, settings, frames or 1))
            if design is None:
                made = made.for_materials(scenes[0].materials, settings["geometry"] == "software")
            _check_lobes(scenes[0], made, settings)
            constants_of(scenes[0], made)
            stage(SPECIALISING if settings["specialise"] else "")
            smallest = _specialised(scenes, made, settings)
            stage(f"{BUILDING}{_large(smallest.design)}")
            try:
                used = "pysim" if engine == "pysim" else "cxxrtl"
                simulator = _simulator(smallest.design, scenes[0], settings, used)
                break
            except CompilerMissing as error:
                if remote:
                    break
                if engine != "auto":
                    raise
                engine = "pysim"
                _shrink(settings, error)
    seconds["build"] = perf_counter() - start - seconds["load"]
    setups = settings["setups"] if settings["geometry"] == "hardware" else 0
    counts = settings["pipes"], setups, settings["coarse"]
    return Rendering(loaded, scenes, smallest, settings["specialise"], used, simulator, seconds, *counts)


def _large(design: Design) -> str:
    """Text of large counts of a design, for which the first build of its model takes long."""
    counts = ("lights", design.lights), ("materials", design.materials)
    many = ", ".join(f"{count:,} {what}" for what, count in counts if count > 4)
    return f" of {many}: up to a minute the first time" if many else ""


def _simulator(
    design: Design, scene: Scene, settings: Settings, engine: str
) -> FrameSimulator | TriangleSimulator:
    """The simulator of the geometry that is asked for."""
    pipes = settings["pipes"]
    if pipes > scene.height:
        reason = f"the picture has {scene.height} row{'s' * (scene.height > 1)}"
        raise settings.refuse("pipes", reason, "give at most one for each row")
    if settings["geometry"] == "software":
        return FrameSimulator(design, engine, pipes)
    size = scene.width, scene.height
    if scene.width * scene.height > LARGEST_PICTURE:
        reason = f"its simulated memory of depths has at most {LARGEST_PICTURE:,} pixels"
        value = f"hardware at {scene.width}x{scene.height}"
        raise settings.refuse("geometry", reason, "give a smaller size, or use software", value)
    renderer = Renderer(design, coarse=CoarseDepth(*size) if settings["coarse"] else None)
    return TriangleSimulator(renderer, size, engine, setups=settings["setups"])


def _check_geometry(settings: Settings, design: Design) -> None:
    """Refuse options that hardware geometry does not serve, and options that need it."""
    if settings["geometry"] == "software":
        remedy = "give geometry hardware, too"
        if settings["setups"] > 1:
            raise settings.refuse("setups", "spans need no triangle setup", remedy)
        if settings["coarse"]:
            raise settings.refuse("coarse", "software leaves hidden spans out", remedy, "")
        return
    reason = ""
    if settings["specialise"]:
        reason = "a specialised pipeline takes spans; leave out specialise"
    elif settings["pipes"] > 1:
        reason = "triangles go to one pipeline; leave out pipes"
    try:
        Renderer(design)
    except ValueError as error:
        reason = str(error)
    if reason:
        reason, _, remedy = reason.partition("; ")
        raise settings.refuse("geometry", reason, f"{remedy}, or use software")


def _check_lobes(scene: Scene, design: Design, settings: Settings) -> None:
    """Refuse materials with more lobes than the pipeline has tables, or with others than its fixed ones."""
    counted = len(scene.materials) == design.materials and len(scene.lights) <= design.lights
    if not (design.loads_tables and counted):
        return
    try:
        constants_of(scene, design)
    except ValueError as error:
        reason, _, remedy = str(error).partition("; ")
        raise settings.refuse("model", reason, remedy or "build the pipeline for it", design.model) from None


def _design(settings: Settings) -> Design:
    """The design of the settings, for the scene's lights and one material."""
    source, lights = settings.source, settings.lights
    viewer = source.viewer if isinstance(source, Scene) else settings["viewer"]
    made, hardware = design_of(settings, max(1, len(lights))), settings["geometry"] == "hardware"
    local = viewer == "near" or any(light.position is not None for light in lights)
    if local and (hardware or not made.takes_values):
        option, remedy = ("geometry", "use software") if hardware else ("method", "use method chord-local")
        raise settings.refuse(option, "point lights and a near viewer need the values of a span", remedy)
    return replace(made, factors=tuple(index for index, light in enumerate(lights) if light.fades))


def _specialised(scenes: Sequence[Scene], design: Design, settings: Settings) -> Specialisation:
    if settings["specialise"]:
        return specialise(scenes, design, exact=not settings["short_words"])
    return Specialisation(design, (), tuple(scenes))


def _shrink(settings: Settings, error: CompilerMissing) -> None:
    """Reduce the picture to the size of the engine pysim, with a warning; a given scene keeps its size."""
    if isinstance(settings.source, Scene):
        warnings.warn(f"pysim instead of cxxrtl, {error}", RuntimeWarning, stacklevel=4)
        return
    size = settings["size"]
    share = min(1.0, *(most / side for most, side in zip(SLOW_SIZE, size, strict=True)))
    width, height = (max(1, round(side * share)) for side in size)
    settings.values["size"] = width, height
    warnings.warn(f"pysim at {width}x{height} instead of cxxrtl, {error}", RuntimeWarning, stacklevel=4)


@with_options({**SCENE, **DESIGN, **RENDERING}, RenderOptions)
def render(
    source: Source | Scene = "teapot",
    *,
    design: Design | None = None,
    engine: Engine = "auto",
    vcd: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    **options: Unpack[RenderOptions],
) -> RenderedFrame:
    """Draw a mesh or a scene by a simulated pipeline.

    The simulation is checked: a new model gives the pixels of the bit-accurate model for a sample, and the
    frame has no lost or doubled pixel.

    Parameters
    ----------
    source : str or path or Mesh or Scene or trimesh.Trimesh or trimesh.Scene or arrays
        ``"teapot"``, a mesh file, a scene file (``.toml``), a mesh, a scene as `scene` makes it, a mesh of
        trimesh, or ``(vertices, faces)`` or ``(vertices, faces, normals)``, see `given_mesh`.
    design : Design, optional
        The pipeline, as `design` makes it; in place of options of a design.
    engine : {"auto", "cxxrtl", "pysim"}
        Simulator: the compiled one, or Amaranth's own; ``"auto"`` takes the first where a C++ compiler works,
        else the second, with a warning and at most 160 x 120 pixels.
    vcd : path, optional
        File for the waveforms; it sets the engine to ``"pysim"`` and the default size to 160 x 120.
    progress : callable, optional
        Called now and then with the number of pixels so far and in all.
    **options
        Those below, by the names of the command line. Each takes the text of the command line, too:
        ``size="640x480"``, ``lights="0,1,1"``. ``None`` counts as not given.

    Raises
    ------
    InputError
        If the source cannot be read, or a value is not accepted.
    SimulationError
        If the pipeline breaks the rules of its streams; `CompilerMissing` if ``engine="cxxrtl"`` finds no
        compiler.
    """
    if design is not None:
        for name in DESIGN.keys() & options.keys():
            raise OptionError(name, "", "the design has its own", "leave out one of them")
    check_engine(engine)
    if vcd is not None and engine == "cxxrtl":
        raise OptionError("vcd", "", "the engine cxxrtl writes no waveforms", 'use engine="pysim"')
    with RunFiles.current().active(), refused_counts(design):
        settings = rendering_settings(source, dict(options), vcd)
        ready = prepare_rendering(settings, design=design, engine="pysim" if vcd else engine)
        if vcd is None:
            return ready.render(progress)
        with atomic_writer(Path(vcd)) as waves:
            return ready.render(progress, vcd=str(waves))
