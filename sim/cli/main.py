"""The command line: ``blysk render`` and ``blysk verilog``, and the commands of installed packages."""

import dataclasses
import math
import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from importlib.metadata import entry_points, version
from pathlib import Path
from time import perf_counter
from typing import Any

import click
import numpy as np
from click.core import ParameterSource
from tqdm import tqdm

from blysk.golden.frame_constants import MAX_MATERIALS, FrameConstants, address_table
from blysk.golden.frames.compare import compare
from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.pipeline import STYLES, Design
from blysk.golden.presets import METHODS, MODELS, PUBLISHED, preset
from blysk.golden.reference.camera import PROJECTIONS, Camera
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.scene import BACK_FACES, LARGEST_SIDE, VIEWERS, Scene
from blysk.hdl.emit.verilog import emit
from blysk.hdl.emit.yosys import NetlistError
from blysk.hdl.methods.registry import unit_of
from blysk.hdl.pipeline import PORT_DESCRIPTIONS, ShadingPipelineUnit
from blysk.sim.cli.scene_file import HIGHLIGHTS, read_scene_file
from blysk.sim.engines.engine import CompilerMissing, SimulationError
from blysk.sim.errors import InputError, one_line
from blysk.sim.frames.animation import (
    Animation,
    dask_executor,
    equal_distance,
    process_executor,
    render_frames,
    turned,
    turntable,
    write_gif,
)
from blysk.sim.frames.figures import animation_figures, difference_figures, frame_figures, saving_figures
from blysk.sim.frames.frame import FrameSimulator, SimulatedFrame
from blysk.sim.frames.picture import check_image_path, write_comparison, write_image
from blysk.sim.frames.specialise import Specialisation, specialise
from blysk.sim.frames.summary import animation_lines, frame_lines, specialisation_lines
from blysk.sim.frames.testbench import check_folder, write_testbench
from blysk.sim.frames.workers import check_address, processors
from blysk.sim.meshes.mesh import LoadedMesh, load_mesh, surfaces
from blysk.sim.output import atomic_writer, check_writable, write_json, write_text

__all__ = ["Choice", "OutputFile", "Settings", "Size", "Whole", "chosen_design", "design_options", "main"]

ENGINES = ("auto", "cxxrtl", "pysim")

DEFAULT_SIZE = (640, 480)

SLOW_SIZE = (160, 120)
"""Largest picture of the slow engine when it stands in for the compiled one, or writes waveforms unasked."""

DEFAULT_LIGHTS = (Light((-0.5, 0.8, 0.7)),)

MAX_FRAMES = 9999
"""Most frames of a turntable: four digits in their names."""


class Choice(click.ParamType):
    """One of a few names.

    Parameters
    ----------
    kind : str
        What they are names of, for the message.
    names : sequence of str
        The names.
    """

    def __init__(self, kind: str, names: Sequence[str]):
        self.name = kind
        self.names = tuple(names)

    def get_metavar(self, param, ctx):
        """What help shows for a value."""
        return f"[{'|'.join(self.names)}]"

    def convert(self, value, param, ctx):
        """The value of a text."""
        if value not in self.names:
            raise InputError(
                f"{param.opts[0]} {value}", f"unknown {self.name}", f"use one of {', '.join(self.names)}"
            )
        return value


class Whole(click.ParamType):
    """A whole number in a range."""

    name = "number"

    def __init__(self, least: int, most: int):
        self.least, self.most = least, most

    def convert(self, value, param, ctx):
        """The number, or one line that refuses it."""
        remedy = f"give a whole number from {self.least} to {self.most}"
        if isinstance(value, str) and not re.fullmatch(r"[+-]?[0-9]{1,18}", value):
            raise InputError(f"{param.opts[0]} {value}", "not a whole number", remedy)
        if not self.least <= int(value) <= self.most:
            raise InputError(f"{param.opts[0]} {value}", "out of range", remedy)
        return int(value)


class OutputFile(click.Path):
    """Name of a file to write; an empty one, as of a shell's variable that is not set, is none."""

    def convert(self, value, param, ctx):
        """The name."""
        if not value:
            raise InputError(f"{param.opts[-1]} ''", "is no file's name", "give one, or leave it out")
        return super().convert(value, param, ctx)


class Size(click.ParamType):
    """Width and height of a picture."""

    name = "WIDTHxHEIGHT"

    def get_metavar(self, param, ctx):
        """What help shows for a value."""
        return self.name

    def convert(self, value, param, ctx):
        """The value of a text."""
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"([0-9]{1,9})x([0-9]{1,9})", value)
        remedy = f"give WIDTHxHEIGHT, 1 to {LARGEST_SIDE} each, as in 640x480"
        if not match:
            raise InputError(f"{param.opts[0]} {value}", "not a size", remedy)
        size = int(match[1]), int(match[2])
        if not all(1 <= side <= LARGEST_SIDE for side in size):
            raise InputError(f"{param.opts[0]} {value}", "out of range", remedy)
        return size


class _Numbers(click.ParamType):
    """Numbers with commas between them."""

    def __init__(self, name: str, counts: Sequence[int], what: str):
        self.name, self.counts, self.what = name, counts, what

    def get_metavar(self, param, ctx):
        return self.name

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(part) for part in value.split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in self.counts or not all(math.isfinite(number) for number in numbers):
            raise InputError(f"{param.opts[0]} {value}", f"not {self.what}", f"give {self.name}")
        return numbers


class _Color(_Numbers):
    """``#rrggbb``, three numbers or one, as three numbers."""

    def __init__(self):
        super().__init__("#rrggbb, R,G,B or one number", (1, 3), "a colour")

    def get_metavar(self, param, ctx):
        return "COLOR"

    def convert(self, value, param, ctx):
        if isinstance(value, str) and re.fullmatch("#[0-9a-fA-F]{6}", value):
            return tuple(int(value[k : k + 2], 16) / 255 for k in (1, 3, 5))
        numbers = super().convert(value, param, ctx)
        if not all(0 <= number <= 1 for number in numbers):
            raise InputError(f"{param.opts[0]} {value}", "out of range", "give numbers from 0 to 1")
        return numbers * 3 if len(numbers) == 1 else numbers


_OPERANDS = dict(zip(HIGHLIGHTS, ("cosine", "one_minus_cosine"), strict=True))


def design_options(command):
    """Options of the pipeline's design, shared by the commands."""
    for option in (
        click.option(
            "--style",
            type=Choice("style", STYLES),
            default="throughput",
            show_default=True,
            help="One pixel a clock, or few multipliers.",
        ),
        click.option(
            "--setup-interval",
            type=Whole(1, 46),
            help="Clocks from a span to the next at the closest; less takes more multipliers.  "
            "[default: 4; compact: the most]",
        ),
        click.option(
            "--gate/--no-gate",
            default=False,
            show_default=True,
            help="A highlight gate: spans without a highlight pass the specular units by.",
        ),
        click.option(
            "--highlight",
            type=Choice("form", HIGHLIGHTS),
            help="Form of the specular argument, for methods that find normals.  [default: dot]",
        ),
        click.option(
            "--model",
            type=Choice("reflection model", REFLECTION_MODELS),
            default="cosquad",
            show_default=True,
            help="Reflection model; every method serves all but phong.",
        ),
        click.option(
            "--method",
            type=Choice("method", METHODS | PUBLISHED),
            default="quadratic",
            show_default=True,
            help="Interpolation along a span.",
        ),
    ):
        command = option(command)
    return command


class Settings(dict):
    """What to render, by the names of the options, and where each value comes from.

    Parameters
    ----------
    values : dict
        The values.
    origins : dict
        What a message calls those that do not come from the option of the same name.
    """

    def __init__(self, values: Mapping[str, Any], origins: Mapping[str, str] | None = None):
        super().__init__(values)
        self.origins = origins or {}

    def place(self, name: str) -> str:
        """What a message calls a value: the option, or the file and the key."""
        option = "light" if name == "lights" else name.replace("_", "-")
        return self.origins.get(name, f"--{option}")

    def refuse(self, name: str, reason: str, remedy: str, value: str | None = None) -> InputError:
        """The error that names the value and where it stands."""
        place = self.place(name)
        if value is None:
            value = self[name]
            value = ",".join(f"{part:g}" for part in value) if isinstance(value, tuple) else str(value)
        thing = place if name in self.origins or not value else f"{place} {value}"
        return InputError(thing, reason, remedy)


def _read_settings(context: click.Context, mesh: str, options: dict) -> Settings:
    """The options, over those of the scene file if MESH is one, over the defaults."""
    if not Path(mesh).stem:
        raise InputError(f"MESH {mesh!r}", "is no file's name", "give a mesh or scene file, or teapot")
    if not any(options["view"]):
        raise InputError("--view 0,0,0", "no direction", "give a vector other than 0")
    count = len(options["lights"]) + len(options["point_lights"])
    if count > MAX_LIGHTS:
        raise InputError("--light", f"{count} lights", f"give at most {MAX_LIGHTS}")
    lights = tuple(_light(numbers) for numbers in options["lights"])
    lights += tuple(_light(numbers, "position") for numbers in options["point_lights"])
    options = {**options, "crease": _angle(options["crease"][0]), "lights": lights or DEFAULT_LIGHTS}
    settings = _over_file(context, mesh, options)
    if settings["viewer"] == "near" and settings["projection"] != "perspective":
        raise settings.refuse("viewer", "an orthographic camera is distant", "use a perspective one")
    local = settings["viewer"] == "near" or any(light.position for light in settings["lights"])
    if local and settings["method"] != "chord-local":
        what = "point lights and a near viewer need the values of a span"
        raise settings.refuse("method", what, "use chord-local")
    if settings["triangles"] is not None and settings["mesh"] != "teapot":
        raise settings.refuse("triangles", "only the teapot is tessellated", "leave it out for a file")
    return settings


def _over_file(context: click.Context, mesh: str, options: dict) -> Settings:
    given = {name for name in options if context.get_parameter_source(name) is not ParameterSource.DEFAULT}
    if Path(mesh).suffix.lower() != ".toml":
        return Settings({**options, "mesh": mesh, "given": given})
    file = read_scene_file(mesh)
    if "view" in given:
        given |= {"position", "target"}
    if given & {"lights", "point_lights"}:
        given |= {"lights", "point_lights"}
    values = {name: value for name, value in file.values.items() if name not in given}
    if "lights" in values:
        at = values.pop("point_lights", ())
        values["lights"] = tuple(Light(numbers[:3], numbers[3:]) for numbers in values["lights"])
        values["lights"] += tuple(Light(color=numbers[3:], position=numbers[:3]) for numbers in at)
    if "position" in values:
        options = {**options, "view": None}
    origins = {name: f"{mesh}, {file.keys[name]}" for name in values}
    return Settings({**options, **values, "given": given | set(file.values)}, origins)


def chosen_design(settings: Settings, lights: int) -> Design:
    """The pipeline that the design options describe, with one material.

    Parameters
    ----------
    settings : Settings
        Values of `design_options`.
    lights : int
        Number of lights.

    Raises
    ------
    InputError
        If there is no such pipeline.
    """
    if settings["model"] not in MODELS:
        raise settings.refuse("model", "the pipeline finds N.H, not R.V", f"use one of {', '.join(MODELS)}")
    if settings["gate"] and not (METHODS | PUBLISHED)[settings["method"]].serves_gate:
        lacks = "error bound" if settings["method"] in PUBLISHED else "normals"
        raise settings.refuse("gate", f"{settings['method']} has no {lacks} for one", "leave it out", "")
    try:
        design = preset(
            settings["method"],
            settings["model"],
            lights,
            operand=_OPERANDS.get(settings["highlight"]),
            gate=settings["gate"],
            style=settings["style"],
            setup_interval=settings["setup_interval"],
        )
    except ValueError as error:
        raise settings.refuse("highlight", str(error), "leave it out") from None
    served = unit_of(design.interpolator).setup_intervals(design.interpolator)
    if settings["setup_interval"] not in (None, *served):
        remedy = f"give 1 to {max(served)}" if served else "leave it out"
        raise settings.refuse("setup_interval", f"method {design.method} is not built for it", remedy)
    return design


class _Group(click.Group):
    """The commands here, and those that an installed package registers under ``blysk.commands``.

    Layers above this one add theirs so; nothing of them is imported before it is asked for.
    """

    def list_commands(self, ctx):
        return sorted({*super().list_commands(ctx), *entry_points(group="blysk.commands").names})

    def get_command(self, ctx, cmd_name):
        command = super().get_command(ctx, cmd_name)
        if command is None:
            for entry in entry_points(group="blysk.commands", name=cmd_name):
                command = entry.load()
        return command


@click.group(cls=_Group, no_args_is_help=False, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(version("blysk"), "--version", prog_name="blysk", message="%(prog)s %(version)s")
def cli():
    """Phong and Blinn shading by simulated hardware.

    \b
    Example:
        blysk render teapot --exponent 100 --compare teapot.png
    """


@cli.command(short_help="Render a mesh or a scene file through the simulated pipeline.")
@click.argument("mesh")
@design_options
@click.option(
    "--exponent", type=Whole(1, MAX_EXPONENT), default=50, show_default=True, help="Of the highlight."
)
@click.option("--size", type=Size(), help="Of the picture.  [default: 640x480; 160x120 with --vcd]")
@click.option(
    "--engine",
    type=Choice("engine", ENGINES),
    default="auto",
    show_default=True,
    help="auto: compiled or, without a C++ compiler, pysim at a smaller size.",
)
@click.option(
    "--projection",
    type=Choice("projection", PROJECTIONS),
    default="perspective",
    show_default=True,
    help="Of the camera.",
)
@click.option("--triangles", type=Whole(64, 4_000_000), help="Of the teapot, about.  [default: 10000]")
@click.option(
    "--crease",
    type=_Numbers("ANGLE", (1,), "an angle"),
    default="40",
    show_default=True,
    help="Degrees over which an edge is sharp, in a mesh without normals.",
)
@click.option(
    "--view",
    type=_Numbers("X,Y,Z", (3,), "a direction"),
    default="0.4,0.5,1",
    show_default=True,
    help="Direction from the mesh to the viewer; y is up.",
)
@click.option(
    "--light",
    "lights",
    multiple=True,
    type=_Numbers("X,Y,Z or X,Y,Z,R,G,B", (3, 6), "a light"),
    help="Direction to a light, and its colour, 1,1,1 if left out; repeat for more lights.  "
    "[default: -0.5,0.8,0.7]",
)
@click.option(
    "--point-light",
    "point_lights",
    multiple=True,
    type=_Numbers("X,Y,Z or X,Y,Z,R,G,B", (3, 6), "a light"),
    help="Place of a light in the mesh's units, and its colour; repeat for more. Needs --method chord-local.",
)
@click.option(
    "--viewer",
    type=Choice("viewer", VIEWERS),
    default="distant",
    show_default=True,
    help="Highlights as seen from one direction, or from the camera: near needs --method chord-local.",
)
@click.option(
    "--materials",
    type=Choice("source of materials", ("file", "one")),
    default="file",
    show_default=True,
    help="Colours of the mesh file, where it has some and no option gives them, or of the options alone.",
)
@click.option("--ambient", type=_Color(), default="0.08,0.05,0.03", show_default=True, help="Reflection k_a.")
@click.option("--diffuse", type=_Color(), default="0.75,0.42,0.2", show_default=True, help="Reflection k_d.")
@click.option("--specular", type=_Color(), default="0.6", show_default=True, help="Reflection k_s.")
@click.option(
    "--background", type=_Color(), default="#1a1c20", show_default=True, help="Where no surface is."
)
@click.option(
    "--back-faces",
    type=Choice("treatment of back faces", BACK_FACES),
    default="flip",
    show_default=True,
    help="Shade them with their normals turned, as they are, or not at all.",
)
@click.option(
    "-o",
    "--output",
    type=OutputFile(),
    help="Picture of the simulated frame.  [default: MESH's name, -blysk.png]",
)
@click.option("--compare", "comparison", type=OutputFile(), help="Picture: simulated, golden, error map.")
@click.option("--json", "figures", type=OutputFile(), help="Every printed figure.")
@click.option(
    "--fit/--full",
    default=False,
    show_default=True,
    help="Build only what the scene needs, say what is left out, and compare with the full pipeline.",
)
@click.option(
    "--words/--no-words",
    default=False,
    show_default=True,
    help="With --fit: also shorter words, where the error bound stays; pixels may change by a step.",
)
@click.option("--vcd", type=OutputFile(), help="Waveforms; implies --engine pysim.")
@click.option(
    "--frames",
    type=Whole(1, MAX_FRAMES),
    help="Turntable: so many pictures, OUTPUT-0001.png and on, and OUTPUT.gif.",
)
@click.option("--jobs", type=Whole(1, 1024), help="Processes that draw the frames.  [default: processors]")
@click.option(
    "--cluster", "address", metavar="ADDRESS", help="Dask scheduler whose workers draw them: tcp://host:8786."
)
@click.pass_context
def render(context, mesh, output, comparison, figures, vcd, frames, jobs, address, **options):
    """Render MESH through the simulated pipeline.

    MESH is a file (OBJ, PLY, STL, GLB, glTF), or `teapot`, or a scene file (TOML) that names one beside
    camera, lights, material, size and method; options given here go before those of the file.

    \b
    Examples:
        blysk render teapot -o teapot.png
        blysk render model.obj --model cosquad_lin --exponent 200 --size 1280x720 --compare both.png
        blysk render scene.toml --exponent 100
        blysk render scene.toml --gate --fit
        blysk render teapot --method chord-local --point-light 3,4,5 --viewer near
        blysk render scene.toml --frames 36 -o turntable.gif

    \b
    Keys of a scene file, all but mesh.file optional:
        size, background, ambient_light, back_faces
        [mesh]      file, triangles, crease, materials
        [camera]    projection, view or position and target, up, field_of_view, viewer
        [[lights]]  direction or position, color
        [material]  ambient, diffuse, specular, exponent
        [pipeline]  method, model, highlight, setup_interval, style, gate, fit, words
    """
    start = perf_counter()
    settings = _read_settings(context, mesh, options)
    if vcd and settings["engine"] == "cxxrtl":
        raise InputError("--vcd", "the engine cxxrtl writes no waveforms", "use --engine pysim")
    if vcd:
        settings["engine"] = "pysim"
    design = chosen_design(settings, max(1, len(settings["lights"])))
    if not (output or comparison):
        output = f"{Path(mesh).stem}-blysk.{'gif' if frames else 'png'}"
    inputs = [mesh, settings["mesh"]]
    if frames:
        pictures, gif = _animation_paths(output, frames, {"--compare": comparison, "--vcd": vcd})
        if address is not None:
            check_address(address)
        if jobs and address:
            raise InputError("--jobs", "a cluster has its own workers", "leave out --jobs or --cluster")
        _check_outputs(inputs, pictures=[gif, *pictures], others=[figures])
    elif jobs or address is not None:
        raise InputError("--jobs" if jobs else "--cluster", "is for many frames", "give --frames, too")
    else:
        _check_outputs(inputs, pictures=[output, comparison], others=[figures, vcd])
    if settings["words"] and not settings["fit"]:
        raise settings.refuse("words", "nothing is fitted", "give --fit, too", "")
    settings["size"] = settings["size"] or (SLOW_SIZE if vcd else DEFAULT_SIZE)
    with tqdm(bar_format="{desc}", leave=False, disable=None) as stage:
        stage.set_description_str("loading the mesh")
        loaded = _load(settings)
        design = dataclasses.replace(design, materials=len(loaded.materials))
        seconds = {"load": perf_counter() - start}
        scenes = _scenes(loaded, settings, frames or 1)
        stage.set_description_str("finding out what the scene needs" if settings["fit"] else "")
        fit = _fitted(scenes, design, settings)
        stage.set_description_str("building the model")
        size = settings["size"]
        simulator = _simulator(fit.design, settings, address)
        if settings["size"] != size:
            # The slow engine's own size.
            scenes = _scenes(loaded, settings, frames or 1)
            fit = _fitted(scenes, design, settings)
            simulator = _simulator(fit.design, settings, address)
        seconds["build"] = perf_counter() - start - seconds["load"]
        stage.set_description_str("rasterising and simulating")
        if frames:
            animation = Animation(fit.scenes[0], fit.design, settings["engine"], design)
            cameras = [scene.camera for scene in scenes]
            report = _render_animation(loaded, animation, cameras, pictures, seconds, jobs, address)
            stage.set_description_str("writing the animation")
            write_gif(gif, pictures)
            seconds["animation"] = perf_counter() - start - sum(seconds.values())
        else:
            frame = _simulate(simulator, fit.scenes[0], vcd)
            stage.set_description_str("comparing with the golden renderer")
            result = compare(scenes[0], design, frame)
            report = _with_mesh(loaded, frame_figures(scenes[0], design, frame, result), seconds)
            if settings["fit"]:
                stage.set_description_str("comparing with the full pipeline")
                whole = None if vcd else _simulate(_simulator(design, settings), scenes[0], None)
                report["specialisation"] = {**saving_figures(fit), "cycles": frame.cycles}
                if whole is not None:
                    report["specialisation"]["full_cycles"] = whole.cycles
                    report["specialisation"] |= difference_figures(frame, whole)
            stage.set_description_str("writing")
            if output:
                write_image(output, frame.image)
            if comparison:
                write_comparison(comparison, frame.image, result.golden, **_captions(report))
        report["seconds"]["total"] = perf_counter() - start
        if figures:
            write_json(figures, report)
    if frames:
        lines = animation_lines(report)
        written = {"frames": f"{pictures[0]} to {pictures[-1]}", "animation": gif}
    else:
        lines = [*frame_lines(report)]
        if settings["fit"]:
            lines += specialisation_lines(report["specialisation"])
        lines += [f"{'ignored':<12}{text}" for text in loaded.ignored]
        written = {"frame": output, "comparison": comparison}
    for line in lines:
        print(line)
    for name, path in {**written, "figures": figures, "waves": vcd}.items():
        if path:
            print(f"{name:<12}{path}")


def _fitted(scenes: Sequence[Scene], design: Design, settings: Settings) -> Specialisation:
    if settings["fit"]:
        return specialise(scenes, design, exact=not settings["words"])
    return Specialisation(design, (), tuple(scenes))


@cli.command(short_help="Emit the pipeline as Verilog.")
@design_options
@click.option("--lights", type=Whole(1, MAX_LIGHTS), default=1, show_default=True, help="Number of lights.")
@click.option(
    "--materials",
    type=Whole(1, MAX_MATERIALS),
    default=1,
    show_default=True,
    help="Number of materials.",
)
@click.option("--name", default="blysk", show_default=True, help="Name of the top module.")
@click.option(
    "-o", "--output", type=OutputFile(), help="Verilog file.  [default: standard output; --testbench: none]"
)
@click.option(
    "--testbench",
    metavar="DIR",
    type=click.Path(),
    help="New or empty folder for the Verilog with a cocotb test bench, which needs nothing of blysk.",
)
def verilog(lights, materials, name, output, testbench, **settings):
    """Emit the pipeline as Verilog-2001 for synthesis, with a table of its ports.

    A test bench holds it against the pixels of a small frame, in Icarus Verilog or Verilator: pip install
    cocotb, then python DIR/run.py. DIR/README.md tells the rest.

    \b
    Examples:
        blysk verilog --model cosquad_lin --lights 2 -o core.v
        blysk verilog --method chord --testbench bench
    """
    if not re.fullmatch("[a-zA-Z][a-zA-Z0-9_]*", name):
        raise InputError(f"--name {name}", "no Verilog name", "use letters, digits and underscores")
    design = chosen_design(Settings(settings), lights)
    design = dataclasses.replace(design, materials=materials)
    _check_outputs([testbench] if testbench else [], pictures=[], others=[output])
    if testbench is not None:
        check_folder(testbench)
    unit = ShadingPipelineUnit(design)
    header = [
        f"blysk {version('blysk')} shading pipeline",
        f"method {design.method}, model {design.model}, lights {lights}, materials {materials}, "
        f"{design.build.style} style" + (", highlight gate" if design.gate else ""),
        f"latency {unit.latency} cycles, {unit.cycles_per_pixel} a pixel",
        f"a span takes at most max({unit.cycles_per_pixel} length, {unit.setup_interval}) cycles",
        "",
        "Frame constants, through the write port:",
        *address_table(lights, materials),
    ]
    fields = {f"i_{name}" for name in unit.i.payload.shape().members}
    descriptions = {
        port: text for port, text in PORT_DESCRIPTIONS.items() if not port.startswith("i_") or port in fields
    }
    try:
        text = emit(unit, name, header=header, descriptions=descriptions)
    except ValueError as error:
        raise InputError(f"--name {name}", str(error), "choose another name") from None
    if output:
        write_text(output, text)
    if testbench is not None:
        write_testbench(testbench, unit, name, text, header[:4])
    elif not output:
        click.echo(text, nl=False)


def _light(numbers: tuple[float, ...], kind: str = "direction") -> Light:
    try:
        return Light(color=numbers[3:] or (1.0, 1.0, 1.0), **{kind: numbers[:3]})
    except ValueError as error:
        text = ",".join(f"{number:g}" for number in numbers)
        option = "--light" if kind == "direction" else "--point-light"
        raise InputError(
            f"{option} {text}", str(error), "give a direction other than 0 and colours of 0 or more"
        ) from None


def _angle(degrees: float) -> float:
    if not 0 <= degrees <= 180:
        raise InputError(f"--crease {degrees:g}", "out of range", "give 0 to 180 degrees")
    return degrees


def _check_outputs(inputs: list[str], pictures: list[str | None], others: list[str | None]) -> None:
    seen = {os.path.realpath(path) for path in inputs}
    for path in [*pictures, *others]:
        if path:
            if os.path.realpath(path) in seen:
                raise InputError(path, "is the mesh or another output", "choose another file")
            seen.add(os.path.realpath(path))
            (check_image_path if path in pictures else check_writable)(path)


def _animation_paths(
    output: str | None, count: int, others: Mapping[str, str | None]
) -> tuple[list[str], str]:
    """Files of the frames and of the animation."""
    for option, path in others.items():
        if path:
            raise InputError(f"{option} {path}", "is for one frame", "leave it out, or --frames")
    stem, suffix = os.path.splitext(output)
    if suffix.lower() not in (".gif", ".png"):
        raise InputError(output, "the frames are PNG, the animation GIF", "use .gif or .png")
    return [f"{stem}-{number:04}.png" for number in range(1, count + 1)], f"{stem}.gif"


def _load(settings: Settings) -> LoadedMesh:
    try:
        return load_mesh(
            settings["mesh"],
            triangles=settings["triangles"] or 10_000,
            crease_angle=settings["crease"],
            materials=settings["materials"] == "file",
        )
    except InputError as error:
        if "mesh" not in settings.origins:
            raise
        raise settings.refuse("mesh", f"{error.thing}, {error.reason}", error.remedy) from error


def _simulator(design: Design, settings: Settings, address: str | None = None) -> FrameSimulator | None:
    """The frame simulator; ``None`` if only a cluster's workers can build it.

    Where the slow engine stands in, the settings become its own.
    """
    if settings["engine"] == "pysim":
        return FrameSimulator(design, "pysim")
    try:
        simulator = FrameSimulator(design, "cxxrtl")
    except CompilerMissing as error:
        if address:
            simulator = None
        elif settings["engine"] == "auto":
            settings["size"] = width, height = _at_most(settings["size"], SLOW_SIZE)
            settings["engine"] = "pysim"
            tqdm.write(f"blysk: pysim at {width}x{height} instead of cxxrtl, {error}", file=sys.stderr)
            return FrameSimulator(design, "pysim")
        else:
            raise
    settings["engine"] = "cxxrtl"
    return simulator


def _at_most(size: tuple[int, int], largest: tuple[int, int]) -> tuple[int, int]:
    share = min(1.0, *(most / side for most, side in zip(largest, size, strict=True)))
    return tuple(max(1, round(side * share)) for side in size)


def _materials(loaded: LoadedMesh, settings: Settings) -> tuple[Material, ...]:
    """Those of the file, but for what an option or the scene file gives."""
    names = ("ambient", "diffuse", "specular", "exponent")
    default = Material(*(settings[name] for name in names))
    return surfaces(loaded.materials, default, settings["given"].intersection(names))


def _scenes(loaded: LoadedMesh, settings: Settings, count: int = 1) -> list[Scene]:
    """The scene, or those of a turntable, which differ in the camera only."""
    # The camera frames the mesh whatever its unit is; products of huge or tiny coordinates would overflow.
    mesh = loaded.mesh
    shift = -int(np.frexp(np.abs(mesh.vertices).max())[1])
    mesh = dataclasses.replace(mesh, vertices=np.ldexp(mesh.vertices, shift))
    width, height = settings["size"]
    cameras = _cameras(mesh.vertices, shift, settings, count)
    scene = Scene(
        mesh=mesh,
        camera=cameras[0],
        width=width,
        height=height,
        material=_materials(loaded, settings),
        lights=[_scaled(light, shift) for light in settings["lights"]],
        viewer=settings["viewer"],
        background=settings["background"],
        back_faces=settings["back_faces"],
        ambient_light=settings.get("ambient_light", (1.0, 1.0, 1.0)),
    )
    try:
        for index in range(len(scene.materials)):
            FrameConstants.of(scene, index=index)
    except ValueError as error:
        raise settings.refuse("lights", str(error), "make the light darker", "") from None
    return [dataclasses.replace(scene, camera=camera) for camera in cameras]


def _scaled(light: Light, shift: int) -> Light:
    """A light in a mesh whose unit has been multiplied by ``2**shift``."""
    if light.position is None:
        return light
    return dataclasses.replace(light, position=tuple(np.ldexp(light.position, shift).tolist()))


def _cameras(vertices: np.ndarray, shift: int, settings: Settings, count: int) -> list[Camera]:
    """Cameras of a mesh whose unit has been multiplied by ``2**shift``."""
    width, height = settings["size"]
    projection = settings["projection"]
    field_of_view, up = settings.get("field_of_view", 30.0), settings.get("up", (0.0, 1.0, 0.0))
    name = "position" if settings.get("position") else "view"
    try:
        if name == "view":
            view = settings["view"]
            # The first direction is the same to the bit, however many there are.
            views = [view, *turned(normalise(view), up, count)[1:].tolist()]
            return equal_distance(
                [
                    Camera.framing(vertices, view, projection, width / height, field_of_view, up=up)
                    for view in views
                ]
            )
        position = tuple(math.ldexp(value, shift) for value in settings["position"])
        if "target" in settings:
            target = tuple(math.ldexp(value, shift) for value in settings["target"])
        else:
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            target = tuple((low + (high - low) / 2).tolist())
        distance = math.dist(position, target)
        if not 1e-12 < distance < 1e12:
            raise ValueError(
                "the camera is at its target" if distance < 1 else "the camera is too far away for the mesh"
            )
        camera = Camera(
            position,
            target,
            up,
            projection,
            height=2 * distance * math.tan(math.radians(field_of_view) / 2),
            field_of_view=field_of_view,
            near=distance / 1000,
        )
        return turntable(camera, count)
    except OverflowError:
        raise settings.refuse(name, "the camera is too far away for the mesh", "move it nearer") from None
    except ValueError as error:
        raise settings.refuse(name, str(error), "choose another direction or place for the camera") from None


def _render_animation(
    loaded: LoadedMesh,
    animation: Animation,
    cameras: list[Camera],
    pictures: list[str],
    seconds: dict[str, float],
    jobs: int | None,
    address: str | None,
) -> dict:
    """Render and write the frames; the figures of all."""
    start = perf_counter()
    done = {}
    if address:
        workers = dask_executor(animation, address)
    else:
        workers = process_executor(animation, min(jobs or processors(), len(cameras)))
    with workers as executor, tqdm(total=len(cameras), unit=" frames", leave=False, disable=None) as bar:
        for index, frame in render_frames(executor, cameras):
            write_image(pictures[index], frame.image)
            done[index] = {"picture": pictures[index], **_with_mesh(loaded, frame.figures, {})}
            bar.update()
        name = executor.name
    seconds["frames"] = perf_counter() - start
    figures = animation_figures([done[index] for index in range(len(cameras))])
    figures["counts"] |= _mesh_counts(loaded)
    return {"mesh": loaded.name, **figures, "workers": name, "seconds": seconds}


def _simulate(simulator: FrameSimulator, scene: Scene, vcd: str | None) -> SimulatedFrame:
    with (
        atomic_writer(vcd) if vcd else nullcontext() as waves,
        tqdm(unit=" pixels", unit_scale=True, delay=1, leave=False, disable=None) as bar,
    ):
        return simulator.render(
            scene, progress=lambda done, count: _show(bar, done, count), vcd=waves and str(waves)
        )


def _show(bar: tqdm, done: int, count: int) -> None:
    bar.total = count
    bar.update(done - bar.n)


def _captions(report: dict) -> dict[str, str]:
    """Title and subtitle of the comparison."""
    return {
        "title": f"{report['mesh']}: {report['method']}, {report['model']}, exponent {report['exponent']}",
        "subtitle": (
            f"simulated RTL beside normalised Phong interpolation in float64: largest error "
            f"{report['method_error']['max_lsb']:.2f} LSB, {report['cycles']:,} cycles for "
            f"{report['pixels']:,} pixels"
            if report["visible_pixels"]
            else "no pixel shows the surface"
        ),
    }


def _with_mesh(loaded: LoadedMesh, figures: dict, seconds: Mapping[str, float]) -> dict:
    """Figures of a frame, with what is known of its mesh and the time spent before it."""
    return {
        "mesh": loaded.name,
        **figures,
        "counts": {**_mesh_counts(loaded), **figures["counts"]},
        "seconds": {**seconds, **figures["seconds"]},
    }


def _mesh_counts(loaded: LoadedMesh) -> dict[str, int]:
    return {"repaired_normals": loaded.repaired_normals, "dropped_faces": loaded.dropped_faces}


def _run(arguments: list[str]) -> int:
    """`cli.main` without its own ways with an interrupt and a closed pipe."""
    try:
        with cli.make_context("blysk", arguments) as context:
            cli.invoke(context)
    except click.exceptions.Exit as stop:
        return stop.exit_code
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status.

    0: done. 1: a simulation went wrong. 2: bad input, in one line on standard error. 130: interrupted, by a
    terminal or by SIGTERM.
    """

    def show(message, *_):
        tqdm.write(f"blysk: warning: {one_line(str(message))}", file=sys.stderr)

    # A file's name may have letters that the terminal's encoding lacks, or bytes that are none.
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        with _termination_as_interrupt(), warnings.catch_warnings():
            warnings.simplefilter("default", RuntimeWarning)
            warnings.showwarning = show
            status = _run(sys.argv[1:] if arguments is None else list(arguments))
        # A closed pipe or full disk behind standard output is found out here, not at exit.
        print(end="", flush=True)
        return status
    except (click.Abort, KeyboardInterrupt):
        print("blysk: interrupted", file=sys.stderr)
        return 130
    except InputError as error:
        print(f"blysk: {error}", file=sys.stderr)
        return 2
    except click.ClickException as error:
        print(f"blysk: {one_line(error.format_message().rstrip('.'))}; see blysk --help", file=sys.stderr)
        return 2
    except CompilerMissing as error:
        print(f"blysk: {error}", file=sys.stderr)
        return 2
    except (NetlistError, SimulationError) as error:
        print(f"blysk: {one_line(str(error))}", file=sys.stderr)
        return 1
    except MemoryError:
        print("blysk: out of memory; use a smaller --size or mesh", file=sys.stderr)
        return 2
    except BrokenPipeError:
        _give_up_output()
        return 141
    except OSError as error:
        text = one_line(f"{error.filename or 'standard output'}: {error.strerror or error}")
        print(f"blysk: {text}; free some space or send it elsewhere", file=sys.stderr)
        _give_up_output()
        return 2


@contextmanager
def _termination_as_interrupt() -> Iterator[None]:
    """Else workers would outlive this process, and half-written files stay."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _give_up_output() -> None:
    """Keep what is left in the buffer of standard output from raising again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
