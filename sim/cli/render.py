"""``blysk render``: a mesh or a scene file through the simulated pipeline."""

from pathlib import Path
from time import perf_counter
from typing import get_args

import click

from blysk.golden.presets import METHOD_LINES, MODEL_LINES
from blysk.sim.api.options import DESIGN, MAX_FRAMES, RENDERING, SCENE, Engine
from blysk.sim.api.scene_file import key_lines
from blysk.sim.api.settings import check_mesh, rendering_settings
from blysk.sim.cli.options import given_options, options_of
from blysk.sim.errors import InputError
from blysk.sim.run_files import check_beside
from blysk.sim.value_types import Choice, OutputFile, Whole

__all__ = ["command"]


def _described(lines: dict[str, str]) -> str:
    width = max(map(len, lines)) + 2
    return "\n".join(f"    {name:<{width}}{text}" for name, text in lines.items())


_KEYS = "\n".join(f"    {line}" for line in key_lines())
_HELP = f"""Render MESH through the simulated pipeline.

MESH is a mesh file (OBJ, PLY, STL, GLB, glTF), the word `teapot`, or a scene file (TOML). A scene file
names a mesh and sets camera, lights, material, size and method. Options given here override the scene file.

\b
Examples:
    blysk render teapot -o teapot.png
    blysk render model.obj --model cosquad_lin --exponent 200 --size 1280x720 --compare both.png
    blysk render scene.toml --exponent 100
    blysk render scene.toml --gate --specialise
    blysk render teapot --point-light 3,4,5 --viewer near
    blysk render teapot --spot-light 3,6,5,-3,-5,-5,8,14
    blysk render scene.toml --frames 36 -o turntable.gif

\b
Methods:
{_described(METHOD_LINES)}

\b
Models:
{_described(MODEL_LINES)}

\b
Keys of a scene file (only mesh.file is required):
{_KEYS}
"""


@click.command(help=_HELP)
@click.argument("mesh")
@options_of(DESIGN)
@options_of(SCENE)
@click.option(
    "--engine",
    type=Choice("engine", get_args(Engine)),
    default="auto",
    show_default=True,
    help="Simulator. cxxrtl: compiled. pysim: Amaranth's own. auto: cxxrtl, or pysim at a smaller size if no "
    "C++ compiler works.",
)
@click.option(
    "-o",
    "--output",
    type=OutputFile(),
    help="Picture of the simulated frame.  [default: name of MESH with -blysk.png; none with --compare]",
)
@click.option(
    "--compare",
    "comparison",
    type=OutputFile(),
    help="Picture with the simulated frame, the golden frame and the error map.",
)
@click.option("--json", "figures", type=OutputFile(), help="JSON file with every figure.")
@options_of(RENDERING)
@click.option(
    "--vcd", type=OutputFile(), help="Write waveforms of the engine pysim. The default size is then 160x120."
)
@click.option(
    "--frames",
    type=Whole(1, MAX_FRAMES),
    help="Draw a turntable of this many frames: OUTPUT-0001.png and so on, and OUTPUT.gif.",
)
@click.option(
    "--jobs", type=Whole(1, 1024), help="Processes that draw the frames.  [default: number of cores]"
)
@click.option(
    "--cluster",
    "address",
    metavar="ADDRESS",
    help="Dask scheduler whose workers draw the frames: tcp://host:8786.",
)
@click.option("-v", "--verbose", is_flag=True, help="Print every figure.")
@click.pass_context
def command(context, mesh, engine, output, comparison, figures, vcd, frames, jobs, address, verbose, **_):
    """Render a mesh or a scene file. Users see the text `_HELP`."""
    start = perf_counter()
    if not Path(mesh).stem:
        raise InputError(f"MESH {mesh!r}", "is not a file name", "give a mesh file, a scene file, or teapot")
    given = given_options(context, {**SCENE, **DESIGN, **RENDERING})
    if vcd and engine == "cxxrtl":
        raise InputError("--vcd", "the engine cxxrtl writes no waveforms", "use --engine pysim")
    settings = rendering_settings(mesh, given, vcd)
    # After the checks of options, because these imports take long.
    from blysk.sim.cli.outputs import animation_paths, check_outputs
    from blysk.sim.frames.workers import check_address

    if not (output or comparison):
        output = f"{Path(mesh).stem}-blysk.{'gif' if frames else 'png'}"
    inputs = [mesh, str(settings.source)]
    if frames:
        pictures, gif = animation_paths(output, frames, {"--compare": comparison, "--vcd": vcd})
        if address is not None:
            check_address(address)
        if jobs and address:
            raise InputError("--jobs", "a cluster has its own workers", "leave out --jobs or --cluster")
        check_outputs(inputs, pictures=[gif, *pictures], others=[figures])
        check_beside(path for path in (gif, *pictures) if path != output)
        written = {"frames": f"{pictures[0]} to {pictures[-1]}", "animation": gif}
    elif jobs or address is not None:
        raise InputError(
            "--jobs" if jobs else "--cluster", "is only for several frames", "also give --frames"
        )
    else:
        check_outputs(inputs, pictures=[output, comparison], others=[figures, vcd])
        written = {"frame": output, "comparison": comparison}
    check_mesh(settings)
    from blysk.sim.cli.draw import draw_frame, draw_turntable

    if frames:
        lines = draw_turntable(settings, engine, pictures, gif, figures, jobs, address, start)
    else:
        lines = draw_frame(settings, engine, output, comparison, figures, vcd, verbose, start)
    for line in lines:
        print(line)
    for name, path in {**written, "figures": figures, "waves": vcd}.items():
        if path:
            print(f"{name:<12}{path}")
