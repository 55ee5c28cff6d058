"""The command line: ``blysk render`` and ``blysk verilog``, and the commands of installed packages."""

import dataclasses
import math
import os
import re
import sys
import warnings
from collections.abc import Sequence
from contextlib import nullcontext
from importlib.metadata import entry_points, version
from pathlib import Path
from time import perf_counter

import click
import numpy as np
from tqdm import tqdm

from golden.camera import PROJECTIONS, Camera
from golden.frame_constants import FrameConstants, address_table
from golden.intensity import MAX_LIGHTS
from golden.lighting import Light, Material
from golden.pipeline import METHODS, ShadingPipeline
from golden.reflection import REFLECTION_MODELS
from golden.scene import BACK_FACES, LARGEST_SIDE, Scene
from golden.specular import MAX_EXPONENT
from hdl.pipeline import PORT_DESCRIPTIONS, ShadingPipelineUnit
from hdl.verilog import emit
from sim.engine import CompilerMissing, SimulationError
from sim.errors import InputError
from sim.frame import Comparison, FrameSimulator, SimulatedFrame, compare
from sim.mesh import load_mesh
from sim.output import atomic_writer, check_writable, write_json, write_text
from sim.picture import check_image_path, write_comparison, write_image

__all__ = ["main"]

ENGINES = ("auto", "cxxrtl", "pysim")

DEFAULT_SIZE = (640, 480)

SLOW_SIZE = (160, 120)
"""Largest picture of the slow engine when it stands in for the compiled one, or writes waveforms unasked."""


class _Choice(click.ParamType):
    """One of a few names."""

    def __init__(self, kind: str, names: Sequence[str]):
        self.name = kind
        self.names = tuple(names)

    def get_metavar(self, param, ctx):
        return f"[{'|'.join(self.names)}]"

    def convert(self, value, param, ctx):
        if value not in self.names:
            raise InputError(
                f"{param.opts[0]} {value}", f"unknown {self.name}", f"use one of {', '.join(self.names)}"
            )
        return value


class _Whole(click.ParamType):
    """A whole number in a range."""

    name = "number"

    def __init__(self, least: int, most: int):
        self.least, self.most = least, most

    def convert(self, value, param, ctx):
        remedy = f"give a whole number from {self.least} to {self.most}"
        if isinstance(value, str) and not re.fullmatch(r"[+-]?[0-9]{1,18}", value):
            raise InputError(f"{param.opts[0]} {value}", "not a whole number", remedy)
        if not self.least <= int(value) <= self.most:
            raise InputError(f"{param.opts[0]} {value}", "out of range", remedy)
        return int(value)


class _Size(click.ParamType):
    """Width and height of a picture."""

    name = "WIDTHxHEIGHT"

    def get_metavar(self, param, ctx):
        return self.name

    def convert(self, value, param, ctx):
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


def _design_options(command):
    """Options of the pipeline's design, shared by the commands."""
    served = "; ".join(f"{method} serves {', '.join(models)}" for method, models in METHODS.items())
    command = click.option(
        "--model",
        type=_Choice("reflection model", REFLECTION_MODELS),
        default="cosquad",
        show_default=True,
        help=f"Reflection model; {served}.",
    )(command)
    return click.option(
        "--method",
        type=_Choice("method", METHODS),
        default="quadratic",
        show_default=True,
        help="Normal interpolation along a span.",
    )(command)


def _design(method: str, model: str, lights: int) -> ShadingPipeline:
    if model not in METHODS[method]:
        served = ", ".join(METHODS[method])
        raise InputError(f"--model {model}", f"method {method} cannot serve it", f"use one of {served}")
    return ShadingPipeline(method, model, lights)


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


@cli.command(short_help="Render a mesh through the simulated pipeline.")
@click.argument("mesh")
@_design_options
@click.option(
    "--exponent", type=_Whole(1, MAX_EXPONENT), default=50, show_default=True, help="Of the highlight."
)
@click.option("--size", type=_Size(), help="Of the picture.  [default: 640x480; 160x120 with --vcd]")
@click.option(
    "--engine",
    type=_Choice("engine", ENGINES),
    default="auto",
    show_default=True,
    help="auto: compiled or, without a C++ compiler, pysim at a smaller size.",
)
@click.option(
    "--projection",
    type=_Choice("projection", PROJECTIONS),
    default="perspective",
    show_default=True,
    help="Of the camera.",
)
@click.option("--triangles", type=_Whole(64, 4_000_000), help="Of the teapot, about.  [default: 10000]")
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
@click.option("--ambient", type=_Color(), default="0.08,0.05,0.03", show_default=True, help="Reflection k_a.")
@click.option("--diffuse", type=_Color(), default="0.75,0.42,0.2", show_default=True, help="Reflection k_d.")
@click.option("--specular", type=_Color(), default="0.6", show_default=True, help="Reflection k_s.")
@click.option(
    "--background", type=_Color(), default="#1a1c20", show_default=True, help="Where no surface is."
)
@click.option(
    "--back-faces",
    type=_Choice("treatment of back faces", BACK_FACES),
    default="flip",
    show_default=True,
    help="Shade them with their normals turned, as they are, or not at all.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(),
    help="Picture of the simulated frame.  [default: MESH's name, -blysk.png]",
)
@click.option("--compare", "comparison", type=click.Path(), help="Picture: simulated, golden, error map.")
@click.option("--json", "figures", type=click.Path(), help="Every printed figure.")
@click.option("--vcd", type=click.Path(), help="Waveforms; implies --engine pysim.")
def render(
    mesh, method, model, exponent, size, engine, triangles, output, comparison, figures, vcd, **options
):
    """Render MESH through the simulated pipeline: a file (OBJ, PLY, STL, GLB, glTF), or `teapot`.

    \b
    Examples:
        blysk render teapot -o teapot.png
        blysk render model.obj --model cosquad_lin --exponent 200 --size 1280x720 --compare both.png
    """
    start = perf_counter()
    if vcd and engine == "cxxrtl":
        raise InputError("--vcd", "the engine cxxrtl writes no waveforms", "use --engine pysim")
    if not any(options["view"]):
        raise InputError("--view 0,0,0", "no direction", "give a vector other than 0")
    crease = _angle(options["crease"][0])
    lights = [_light(numbers) for numbers in options["lights"] or ((-0.5, 0.8, 0.7),)]
    if len(lights) > MAX_LIGHTS:
        raise InputError("--light", f"{len(lights)} lights", f"give at most {MAX_LIGHTS}")
    design = _design(method, model, len(lights))
    if not Path(mesh).stem:
        raise InputError(f"MESH {mesh!r}", "is no file's name", "give a mesh file, or teapot")
    if triangles is not None and mesh != "teapot":
        raise InputError(
            f"--triangles {triangles}", "only the teapot is tessellated", "leave it out for a file"
        )
    if not (output or comparison):
        output = f"{Path(mesh).stem}-blysk.png"
    _check_outputs(mesh, pictures=[output, comparison], others=[figures, vcd])
    with tqdm(bar_format="{desc}", leave=False, disable=None) as stage:
        stage.set_description_str("loading the mesh")
        loaded = load_mesh(mesh, triangles=triangles or 10_000, crease_angle=crease)
        loading = perf_counter() - start
        size = size or (SLOW_SIZE if vcd else DEFAULT_SIZE)
        scene = _scene(loaded.mesh, size, exponent, lights, options)
        stage.set_description_str("building the model")
        simulator, note = _simulator(design, "pysim" if vcd else engine)
        if note:
            size = _at_most(size, SLOW_SIZE)
            scene = _scene(loaded.mesh, size, exponent, lights, options)
            tqdm.write(f"blysk: pysim at {size[0]}x{size[1]} instead of cxxrtl, {note}", file=sys.stderr)
        stage.set_description_str("rasterising and simulating")
        with (
            atomic_writer(vcd) if vcd else nullcontext() as waves,
            tqdm(unit=" pixels", unit_scale=True, delay=1, leave=False, disable=None) as bar,
        ):
            frame = simulator.render(
                scene,
                progress=lambda done, count: _show(bar, done, count),
                vcd=waves and str(waves),
            )
        stage.set_description_str("comparing with the golden renderer")
        result = compare(scene, design, frame)
        seconds = {
            "load": loading,
            "raster": frame.seconds["raster"],
            "golden": result.seconds,
            "build": simulator.build_seconds,
            "simulate": frame.seconds["simulate"],
        }
        report = _report(loaded, design, scene, frame, result, seconds)
        stage.set_description_str("writing")
        if output:
            write_image(output, frame.image)
        if comparison:
            write_comparison(comparison, frame.image, result.golden, **_captions(report))
        report["seconds"]["total"] = perf_counter() - start
        if figures:
            write_json(figures, report)
    _print_report(report)
    for name, path in (("frame", output), ("comparison", comparison), ("figures", figures), ("waves", vcd)):
        if path:
            print(f"{name:<12}{path}")


@cli.command(short_help="Emit the pipeline as Verilog.")
@_design_options
@click.option("--lights", type=_Whole(1, MAX_LIGHTS), default=1, show_default=True, help="Number of lights.")
@click.option("--name", default="blysk", show_default=True, help="Name of the top module.")
@click.option("-o", "--output", type=click.Path(), help="Verilog file.  [default: standard output]")
def verilog(method, model, lights, name, output):
    """Emit the pipeline as Verilog-2001 for synthesis, with a table of its ports.

    \b
    Example:
        blysk verilog --model cosquad_lin --lights 2 -o core.v
    """
    if not re.fullmatch("[a-zA-Z][a-zA-Z0-9_]*", name):
        raise InputError(f"--name {name}", "no Verilog name", "use letters, digits and underscores")
    design = _design(method, model, lights)
    if output:
        check_writable(output)
    unit = ShadingPipelineUnit(design)
    header = [
        f"blysk {version('blysk')} shading pipeline",
        f"method {method}, model {model}, lights {lights}",
        f"latency {unit.latency} clocks, one pixel a clock",
        f"a span takes at most max(length, {unit.setup_interval}) clocks",
        "",
        "Frame constants, through the write port:",
        *address_table(lights),
    ]
    try:
        text = emit(unit, name, header=header, descriptions=PORT_DESCRIPTIONS)
    except ValueError as error:
        raise InputError(f"--name {name}", str(error), "choose another name") from None
    if output:
        write_text(output, text)
    else:
        click.echo(text, nl=False)


def _light(numbers: tuple[float, ...]) -> Light:
    try:
        return Light(numbers[:3], numbers[3:] or (1.0, 1.0, 1.0))
    except ValueError as error:
        text = ",".join(f"{number:g}" for number in numbers)
        raise InputError(
            f"--light {text}", str(error), "give a direction other than 0 and colours of 0 or more"
        ) from None


def _angle(degrees: float) -> float:
    if not 0 <= degrees <= 180:
        raise InputError(f"--crease {degrees:g}", "out of range", "give 0 to 180 degrees")
    return degrees


def _check_outputs(mesh: str, pictures: list[str | None], others: list[str | None]) -> None:
    seen = {os.path.realpath(mesh)}
    for path in [*pictures, *others]:
        if path:
            if os.path.realpath(path) in seen:
                raise InputError(path, "is the mesh or another output", "choose another file")
            seen.add(os.path.realpath(path))
            (check_image_path if path in pictures else check_writable)(path)


def _simulator(design: ShadingPipeline, engine: str) -> tuple[FrameSimulator, str]:
    """The frame simulator, and why it is not the compiled one where that was wanted."""
    try:
        return FrameSimulator(design, "pysim" if engine == "pysim" else "cxxrtl"), ""
    except CompilerMissing as error:
        if engine != "auto":
            raise
        return FrameSimulator(design, "pysim"), str(error)


def _at_most(size: tuple[int, int], largest: tuple[int, int]) -> tuple[int, int]:
    share = min(1.0, *(most / side for most, side in zip(largest, size, strict=True)))
    return tuple(max(1, round(side * share)) for side in size)


def _scene(mesh, size: tuple[int, int], exponent: int, lights: list[Light], options: dict) -> Scene:
    width, height = size
    # The camera frames the mesh whatever its unit is; products of huge or tiny coordinates would overflow.
    largest = np.frexp(np.abs(mesh.vertices).max())[1]
    mesh = dataclasses.replace(mesh, vertices=np.ldexp(mesh.vertices, -largest))
    scene = Scene(
        mesh=mesh,
        camera=Camera.framing(mesh.vertices, options["view"], options["projection"], width / height),
        width=width,
        height=height,
        material=Material(options["ambient"], options["diffuse"], options["specular"], exponent),
        lights=lights,
        background=options["background"],
        back_faces=options["back_faces"],
    )
    try:
        FrameConstants.of(scene)
    except ValueError as error:
        raise InputError("--light", str(error), "make the light darker") from None
    return scene


def _show(bar: tqdm, done: int, count: int) -> None:
    bar.total = count
    bar.update(done - bar.n)


def _captions(report: dict) -> dict[str, str]:
    """Title and subtitle of the comparison."""
    return {
        "title": f"{report['mesh']}: {report['method']} normals, {report['model']}, "
        f"exponent {report['exponent']}",
        "subtitle": (
            f"simulated RTL beside normalised Phong interpolation in float64: largest error "
            f"{report['method_error']['max_lsb']:.2f} LSB, {report['clocks']:,} clocks for "
            f"{report['pixels']:,} pixels"
            if report["visible_pixels"]
            else "no pixel shows the surface"
        ),
    }


def _report(
    loaded, design: ShadingPipeline, scene: Scene, frame: SimulatedFrame, result: Comparison, seconds: dict
) -> dict:
    raster = frame.raster
    return {
        "mesh": loaded.name,
        "method": design.method,
        "model": design.model,
        "exponent": scene.material.exponent,
        "lights": design.lights,
        "engine": frame.engine,
        "width": scene.width,
        "height": scene.height,
        "triangles": raster.triangles,
        "spans": frame.spans,
        "pixels": frame.pixels,
        "visible_pixels": int(np.count_nonzero(frame.cut_raster.visible)),
        "clocks": frame.clocks,
        "clocks_per_pixel": frame.clocks / frame.pixels if frame.pixels else math.nan,
        "simulated_pixels_per_second": frame.pixels / seconds["simulate"],
        "arithmetic_error": dataclasses.asdict(result.arithmetic_error),
        "method_error": dataclasses.asdict(result.method_error),
        "total_error": dataclasses.asdict(result.total_error),
        "nmse": result.nmse,
        "mnse_printed": result.mnse_printed,
        "mnse_printed_share": result.mnse_printed_share,
        "counts": {
            "repaired_normals": loaded.repaired_normals,
            "dropped_faces": loaded.dropped_faces,
            "degenerate_triangles": raster.degenerate,
            "culled_triangles": raster.culled,
            "outside_triangles": raster.outside,
            "uncovered_triangles": raster.uncovered,
            "repaired_span_normals": raster.repaired_normals,
            "hidden_spans": raster.hidden_spans,
            "cut_spans": frame.spans_cut,
            "wide_spans": frame.wide_spans,
        },
        "seconds": seconds,
    }


_COUNTS = {
    "repaired_normals": "stored normals repaired",
    "dropped_faces": "faces without area dropped",
    "degenerate_triangles": "triangles without area on the screen",
    "culled_triangles": "back faces left out",
    "outside_triangles": "triangles outside the picture",
    "uncovered_triangles": "triangles that hold no pixel centre",
    "repaired_span_normals": "span ends whose normal was 0",
    "hidden_spans": "spans wholly hidden, left out",
    "cut_spans": "spans over 45 degrees, cut",
    "wide_spans": "spans flagged as too wide by the pipeline",
}


def _print_report(report: dict) -> None:
    size = f"{report['width']}x{report['height']}"
    rows = {
        "mesh": f"{report['mesh']}, {size}",
        "model": f"{report['model']}, exponent {report['exponent']}, lights {report['lights']}",
        "method": report["method"],
        "engine": report["engine"],
        "triangles": f"{report['triangles']:,}",
        "spans": f"{report['spans']:,}",
        "pixels": f"{report['pixels']:,} shaded, {report['visible_pixels']:,} visible",
        "clocks": f"{report['clocks']:,}",
    }
    if report["pixels"]:
        rows["clocks"] += f", {report['clocks_per_pixel']:.3f} a pixel"
        rows["simulated"] = f"{report['simulated_pixels_per_second']:,.0f} pixels a second"
    for name, value in rows.items():
        print(f"{name:<12}{value}")
    if report["visible_pixels"]:
        _print_errors(report)
    else:
        print(f"{'error':<12}none, no pixel shows the surface")
    for key, text in _COUNTS.items():
        if report["counts"][key]:
            print(f"{'counted':<12}{text}: {report['counts'][key]:,}")
    times = ", ".join(f"{name} {value:.2f}" for name, value in report["seconds"].items())
    print(f"{'seconds':<12}{times}")


def _print_errors(report: dict) -> None:
    print(f"{'error, LSB':<12}{'largest':>9}{'99.9 %':>9}{'RMSE':>9}{'PSNR, dB':>10}   against")
    for name, against in (
        ("arithmetic", "the same method and model in float64"),
        ("method", "exactly normalised Phong interpolation, same model"),
        ("total", "the exact Blinn frame, one viewing direction"),
    ):
        error = report[f"{name}_error"]
        print(
            f"  {name:<10}{error['max_lsb']:>9.3f}{error['p999_lsb']:>9.3f}{error['rmse_lsb']:>9.3f}"
            f"{error['psnr_db']:>10.2f}   {against}"
        )
    print(
        f"{'NMSE':<12}{report['nmse']:.3g} (MNSE as printed {report['mnse_printed']:.3g}, "
        f"defined for {report['mnse_printed_share']:.1%})"
    )


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

    0: done. 1: a simulation went wrong. 2: bad input, in one line on standard error. 130: interrupted.
    """

    def show(message, *_):
        tqdm.write(f"blysk: warning: {message}", file=sys.stderr)

    try:
        with warnings.catch_warnings():
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
        print(f"blysk: {error.format_message().rstrip('.')}; see blysk --help", file=sys.stderr)
        return 2
    except CompilerMissing as error:
        print(f"blysk: {error}", file=sys.stderr)
        return 2
    except SimulationError as error:
        print(f"blysk: {error}", file=sys.stderr)
        return 1
    except MemoryError:
        print("blysk: out of memory; use a smaller --size or mesh", file=sys.stderr)
        return 2
    except BrokenPipeError:
        _give_up_output()
        return 141
    except OSError as error:
        print(
            f"blysk: {error.filename or 'standard output'}: {error.strerror or error}; "
            "free some space or send it elsewhere",
            file=sys.stderr,
        )
        _give_up_output()
        return 2


def _give_up_output() -> None:
    """Keep what is left in the buffer of standard output from raising again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
