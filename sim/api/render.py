"""Frames of simulated pipelines, from a mesh or a scene in one call."""

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any, Unpack, cast

from blysk.golden.build import BuildError
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import constants_of
from blysk.golden.frames.surface import design_for, with_albedo
from blysk.golden.geometry.scene_triangles import check_texels
from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import METHODS, MIRROR_LOBES, PUBLISHED
from blysk.golden.reference.divide import divided
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer
from blysk.sim.api.design import built, design_of, refused_counts
from blysk.sim.api.options import BUILD, DESIGN, RENDERING, SCENE, SLOW_SIZE, Engine, RenderOptions, Source
from blysk.sim.api.rendered_frame import RenderedFrame
from blysk.sim.api.scene import load, scenes_of
from blysk.sim.api.settings import Settings, check_engine, rendering_settings
from blysk.sim.api.signature import with_options
from blysk.sim.errors import CompilerMissing, InputError, OptionError
from blysk.sim.frames.figures import difference_figures, saving_figures
from blysk.sim.frames.frame import FrameSimulator, SimulatedFrame
from blysk.sim.frames.specialise import Specialisation, specialise
from blysk.sim.frames.triangles import LARGEST_PICTURE, TriangleSimulator
from blysk.sim.meshes.loaded_mesh import LoadedMesh
from blysk.sim.output import atomic_writer
from blysk.sim.run_files import RunFiles

__all__ = [
    "BUILDING",
    "SPECIALISING",
    "Rendering",
    "prepare_rendering",
    "prepared",
    "render",
]

SPECIALISING = "finding what the scene needs"
"""Stage of `prepare_rendering` in which a specialisation is found."""
BUILDING = "building the model"
"""Stage of `prepare_rendering` in which the hardware is compiled.

If the build takes long, the cause follows the text.
"""

Progress = Callable[[int, int], object]


@dataclass(frozen=True)
class Rendering:
    """A pipeline that is ready to draw a scene or the scenes of a turntable.

    Parameters
    ----------
    loaded : LoadedMesh
        The mesh.
    scenes : tuple of Scene
        Scenes to be drawn.
    specialisation : Specialisation
        The full pipeline and its reductions. Without a specialisation there are no reductions.
    is_specialised : bool
        Whether a specialisation was asked for.
    engine : str
        ``"cxxrtl"`` or ``"pysim"``.
    simulator : FrameSimulator or TriangleSimulator or None
        The hardware's simulator. ``None`` if there is no compiler and no compiler is needed.
    seconds : dict
        Seconds of loading the mesh and of building the simulator.
    """

    loaded: LoadedMesh
    scenes: tuple[Scene, ...]
    specialisation: Specialisation
    is_specialised: bool
    engine: str
    simulator: FrameSimulator | TriangleSimulator | None
    seconds: dict[str, float]

    @property
    def design(self) -> ShadingPipeline:
        """The full pipeline."""
        return self.specialisation.full

    @property
    def counts(self) -> dict[str, int]:
        """Counts of the mesh, see `LoadedMesh`."""
        names = ("repaired_normals", "dropped_faces", "opposed_faces")
        return {name: getattr(self.loaded, name) for name in names}

    def render(
        self, progress: Progress | None = None, vcd: str | None = None, index: int = 0
    ) -> RenderedFrame:
        """Draw a scene.

        Parameters
        ----------
        progress : callable, optional
            Called during the simulation with the number of pixels drawn so far and the number of all pixels.
        vcd : str, optional
            File for the waveforms; needs the engine ``"pysim"``.
        index : int
            Number of the scene; by default the first.
        """
        assert self.simulator is not None
        frame = self.simulator.render(self.specialisation.scenes[index], progress=progress, vcd=vcd)
        details: dict[str, Any] = {"ignored": list(self.loaded.ignored)}
        details |= {"counts": self.counts, "seconds": self.seconds}
        if self.is_specialised:
            details["specialisation"] = {**saving_figures(self.specialisation), "cycles": frame.cycles}
            if vcd is None:
                whole = FrameSimulator(self.design, self.engine).render(self.scenes[index])
                details["specialisation"]["full_cycles"] = whole.cycles
                details["specialisation"] |= difference_figures(cast(SimulatedFrame, frame), whole)
        files = RunFiles.current()
        return RenderedFrame(self.scenes[index], self.design, frame, self.loaded.name, details, files)


def prepare_rendering(
    settings: Settings,
    *,
    design: ShadingPipeline | None = None,
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
        The pipeline, which replaces the pipeline of the settings.
    engine : {"auto", "cxxrtl", "pysim"}
        If ``"auto"`` finds no compiler, there is a warning, and the picture shrinks to `SLOW_SIZE`. A given
        scene keeps its size.
    frames : int
        Number of frames of a turntable. 0 stands for a single picture.
    remote : bool
        Whether other machines draw the frames. Then this machine needs no compiler.
    stage : callable
        Called with a text before each stage of the work.
    """
    start = perf_counter()
    with settings.located():
        made = _built(settings, design or _design(settings))
        software = settings["geometry"] == "software"
        stage("loading the mesh")
        most = MAX_LIGHTS if design is None else design.lights
        local = design is None and _serves_local(settings)
        albedo = design is None or design.albedo is not None
        loaded = load(settings, lights=most, local=local, albedo=albedo, cutoffs=software)
        if loaded.lights and design is None:
            made = _built(settings, _design(settings))
        seconds = {"load": perf_counter() - start}
        simulator, used = None, "cxxrtl"
        while True:
            scenes = tuple(scenes_of(loaded, settings, frames or 1))
            if not software:
                scenes = tuple(map(divided, scenes))
            made = _built(settings, made)
            if design is None:
                made = _fitted(made, scenes[0], settings)
            _check_scene(scenes[0], made, settings)
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
    return Rendering(loaded, scenes, smallest, settings["specialise"], used, simulator, seconds)


def _fitted(design: ShadingPipeline, scene: Scene, settings: Settings) -> ShadingPipeline:
    """The design for the materials, colours of vertices and textures of a scene."""
    hardware = settings["geometry"] == "hardware"
    if scene.has_albedo and hardware:
        if not design.interpolator.geometry(design.lights).vectors:
            reason = "hardware geometry gives vertex colours and textures to method quotient alone"
            raise settings.refuse("method", reason, "use quotient, or geometry software", design.method)
        if scene.textures:
            try:
                check_texels(scene)
            except ValueError as error:
                reason, _, remedy = str(error).partition("; ")
                raise settings.refuse("geometry", reason, f"{remedy}, or use software") from None
    if scene.cutoffs and hardware:
        raise settings.refuse("geometry", "hardware geometry drops no pixels by alpha", "use software")
    try:
        fitted = design_for(design, scene, not hardware, hardware)
    except ValueError as error:
        reason, _, remedy = str(error).partition("; ")
        raise InputError("textures", reason, remedy) from None
    if fitted.albedo is not None and hardware:
        try:
            Renderer(fitted)
        except BuildError as error:
            raise settings.refuse(error.option, error.reason, error.remedy) from None
    if fitted.albedo is not None:
        constants = [FrameConstants.of(scene, index=index) for index in range(len(scene.materials))]
        try:
            with_albedo(constants, scene, fitted)
        except ValueError as error:
            raise settings.refuse("lights", str(error), "make the light darker", "") from None
    return fitted


def _large(design: ShadingPipeline) -> str:
    """Text with the counts of lights and materials that make a first build slow. Empty if they are small."""
    counts = ("lights", design.lights), ("materials", design.materials)
    many = ", ".join(f"{count:,} {what}" for what, count in counts if count > 4)
    return f" of {many}: up to a minute the first time" if many else ""


def _simulator(
    design: ShadingPipeline, scene: Scene, settings: Settings, engine: str
) -> FrameSimulator | TriangleSimulator:
    """The simulator for the geometry option."""
    if settings["pipes"] > scene.height:
        reason = f"the picture has {scene.height} row{'s' * (scene.height > 1)}"
        raise settings.refuse("pipes", reason, "give at most one for each row")
    if settings["geometry"] == "software":
        return FrameSimulator(design, engine)
    size = scene.width, scene.height
    if scene.width * scene.height > LARGEST_PICTURE:
        reason = f"its simulated memory of depths has at most {LARGEST_PICTURE:,} pixels"
        value = f"hardware at {scene.width}x{scene.height}"
        raise settings.refuse("geometry", reason, "give a smaller size, or use software", value)
    return TriangleSimulator(Renderer(design), size, engine)


def _built(settings: Settings, design: ShadingPipeline) -> ShadingPipeline:
    """The design with the build options of the settings.

    Raises
    ------
    OptionError
        If an option needs hardware geometry, or hardware geometry excludes an option or the design.
    """
    hardware, source = settings["geometry"] == "hardware", settings.source
    if hardware and settings["specialise"]:
        reason, remedy = "a specialised pipeline takes spans", "leave out specialise, or use software"
        raise settings.refuse("geometry", reason, remedy)
    given = {name: settings[name] for name in BUILD if name in RENDERING}
    if given.pop("coarse"):
        given["coarse"] = (source.width, source.height) if isinstance(source, Scene) else settings["size"]
    try:
        # The caller's design may have build options of a core. The settings replace them.
        return built(replace(design, build=design.build.shading), given)
    except OptionError as error:
        if error.option in ("geometry", "lanes") or (error.option == "pipes" and not hardware):
            raise
        if hardware:
            remedy = f"leave out {error.option}, or use software"
            raise settings.refuse("geometry", error.reason, remedy) from None
        remedy = "also give geometry hardware"
        raise settings.refuse(error.option, error.reason, remedy, error.value) from None


def _check_scene(scene: Scene, design: ShadingPipeline, settings: Settings) -> None:
    """Refuse a scene that the pipeline does not serve, before hardware is built for it.

    Raises
    ------
    OptionError
        If the materials have more lobes than the pipeline has tables, or a lobe that no fixed table has.
    ValueError
        If `constants_of` refuses the scene for another reason.
    """
    try:
        constants_of(scene, design)
    except ValueError as error:
        counted = len(scene.materials) == design.materials and len(scene.lights) <= design.lights
        if not (design.loads_tables and counted):
            raise
        reason, _, remedy = str(error).partition("; ")
        raise settings.refuse("model", reason, remedy or "build the pipeline for it", design.model) from None


def _design(settings: Settings) -> ShadingPipeline:
    """The design of the settings, for the scene's lights and one material."""
    source, lights = settings.source, settings.lights
    viewer = source.viewer if isinstance(source, Scene) else settings["viewer"]
    made, hardware = design_of(settings, max(1, len(lights))), settings["geometry"] == "hardware"
    local = viewer == "near" or any(light.is_local for light in lights)
    if local and (hardware or not made.interpolator.serves_local):
        option, remedy = ("geometry", "use software") if hardware else ("method", "use method chord-local")
        raise settings.refuse(option, "point lights and a near viewer need the values of a span", remedy)
    return replace(made, factors=tuple(index for index, light in enumerate(lights) if light.fades))


def _serves_local(settings: Settings) -> bool:
    """Whether the method serves lights with a position, or may still become ``chord-local``."""
    if settings["geometry"] == "hardware" or settings["model"] in MIRROR_LOBES:
        return False
    if "method" in settings.given:
        return bool((METHODS | PUBLISHED)[settings["method"]].serves_local)
    return not (settings["gate"] or settings["operand"] or settings["setup_interval"])


def _specialised(scenes: Sequence[Scene], design: ShadingPipeline, settings: Settings) -> Specialisation:
    if settings["specialise"]:
        return specialise(scenes, design, exact=not settings["short_words"])
    return Specialisation(design, (), tuple(scenes))


def _shrink(settings: Settings, error: CompilerMissing) -> None:
    """Reduce the picture to `SLOW_SIZE` for pysim, with a warning. A given scene keeps its size."""
    if isinstance(settings.source, Scene):
        warnings.warn(f"pysim instead of cxxrtl, {error}", RuntimeWarning, stacklevel=4)
        return
    size = settings["size"]
    share = min(1.0, *(most / side for most, side in zip(SLOW_SIZE, size, strict=True)))
    width, height = (max(1, round(side * share)) for side in size)
    settings.values["size"] = width, height
    warnings.warn(f"pysim at {width}x{height} instead of cxxrtl, {error}", RuntimeWarning, stacklevel=4)


def prepared(
    source: Source | Scene,
    design: ShadingPipeline | None,
    engine: str,
    options: Mapping[str, Any],
    *,
    vcd: str | os.PathLike[str] | None = None,
    frames: int = 0,
) -> Rendering:
    """`prepare_rendering` with the arguments of `render`, for a picture or ``frames`` of a turntable."""
    if design is not None:
        for name in DESIGN.keys() & options.keys():
            raise OptionError(name, "", "the design has its own", "leave out one of them")
    check_engine(engine)
    settings = rendering_settings(source, dict(options), vcd)
    return prepare_rendering(settings, design=design, engine="pysim" if vcd else engine, frames=frames)


@with_options({**SCENE, **DESIGN, **RENDERING}, RenderOptions)
def render(
    source: Source | Scene = "teapot",
    *,
    design: ShadingPipeline | None = None,
    engine: Engine = "auto",
    vcd: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    **options: Unpack[RenderOptions],
) -> RenderedFrame:
    """Draw a mesh or a scene by a simulated pipeline.

    The simulation is checked. Before its first frame, a new simulation model must draw a sample of the spans
    like the bit-accurate model. No pixel of the frame may be lost or doubled.

    Parameters
    ----------
    source : str or path or Mesh or Scene or trimesh.Trimesh or trimesh.Scene or arrays
        ``"teapot"``, a mesh file, a scene file (``.toml``), a mesh, a scene as `scene` makes it, a mesh of
        trimesh, or ``(vertices, faces)`` or ``(vertices, faces, normals)``, see `given_mesh`.
    design : Design, optional
        The pipeline, as `design` makes it. It replaces the options of a design.
    engine : {"auto", "cxxrtl", "pysim"}
        Simulator: the compiled simulator, or Amaranth's own. ``"auto"`` takes the compiled simulator if a C++
        compiler works. Else it takes Amaranth's own, with a warning and at most 160 x 120 pixels.
    vcd : path, optional
        File for the waveforms; it sets the engine to ``"pysim"`` and the default size to 160 x 120.
    progress : callable, optional
        Called during the simulation with the number of pixels drawn so far and the number of all pixels.
    **options
        The options below, by the names of the command line. Each also takes the text of the command line:
        ``size="640x480"``, ``lights="0,1,1"``. ``None`` counts as not given.

    Raises
    ------
    InputError
        If the source cannot be read, or a value is not accepted.
    SimulationError
        If the pipeline breaks the rules of its streams; `CompilerMissing` if ``engine="cxxrtl"`` finds no
        compiler.
    """
    if vcd is not None and engine == "cxxrtl":
        raise OptionError("vcd", "", "the engine cxxrtl writes no waveforms", 'use engine="pysim"')
    with RunFiles.current().active(), refused_counts(design):
        ready = prepared(source, design, engine, options, vcd=vcd)
        if vcd is None:
            return ready.render(progress)
        with atomic_writer(Path(vcd)) as waves:
            return ready.render(progress, vcd=str(waves))
