"""``blysk board``: a mesh on a monitor; see `blysk.bench.tools.board`."""

import json
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from blysk.bench.tools.board_options import COLOURS, DEFAULT_COLOURS, DEFAULTS, LOADERS, OPTIONS
from blysk.bench.tools.boards import BOARDS, board_named, packages_missing
from blysk.sim.api.options import DESIGN, SCENE
from blysk.sim.api.settings import check_mesh, read_settings
from blysk.sim.cli.options import given_options, options_of
from blysk.sim.errors import InputError
from blysk.sim.installation import install_package
from blysk.sim.output import check_writable, write_json
from blysk.sim.value_types import Choice, Number, OutputFile, Whole

__all__ = ["command"]

_MOST_FRAMES = 60


@click.command()
@click.argument("board_name", metavar="BOARD")
@click.option(
    "--mesh", default="teapot", show_default=True, help="Mesh file (OBJ, PLY, ...), scene file, or teapot."
)
@click.option(
    "-o", "--output", type=OutputFile(), help="Bitstream file; with --simulate the folder for the frames."
)
@click.option(
    "--simulate",
    type=Whole(1, _MOST_FRAMES),
    help="Simulate this many frames, down to the bits of the monitor connector's lanes.",
)
@click.option(
    "--colours",
    type=Choice("colours", COLOURS),
    default=DEFAULT_COLOURS,
    show_default=True,
    help="Bits of a pixel in the band buffer. rgb565 leaves block RAMs for a larger mesh.",
)
@click.option(
    "--clock",
    type=Number(1, 126, "MHz"),
    show_default=", ".join(f"{board.name} {board.clock:g}" for board in BOARDS.values()),
    help="Wanted drawing clock in MHz. The highest possible rate up to this value is used.",
)
@click.option(
    "--toggles",
    is_flag=True,
    help="With --simulate: count the register bits that toggle, a proxy for energy.",
)
@click.option(
    "--seeds", type=Whole(1, 20), default=4, show_default=True, help="Largest number of placements to try."
)
@click.option(
    "--from",
    "routed",
    metavar="FILE",
    help="Bitstream of this command, of the same design. Only the words of its memories are rewritten, for "
    "--mesh, materials, lights and motion. Nothing is placed or routed. With --simulate: simulate the words "
    "of its memories.",
)
@click.option(
    "--loader",
    type=Choice("loader", LOADERS),
    help="Add a loader, which takes other meshes of blysk send: from the serial port, from the flash after "
    "power-up, or both.  [default: none]",
)
@click.option("--record", type=OutputFile(), help="JSON file to which the figures of this run are added.")
@click.option("--load", is_flag=True, help="Load the bitstream with openFPGALoader.")
@options_of(OPTIONS)
@click.pass_context
def command(
    context,
    board_name,
    mesh,
    output,
    simulate,
    colours,
    clock,
    toggles,
    seeds,
    routed,
    loader,
    record,
    load,
    **_,
):
    """Show a turning mesh on the monitor of BOARD: ulx3s-25f, ulx3s-85f or icepi-zero.

    Without --simulate the command makes a bitstream. It first prints results of earlier bitstreams for this
    board. Then it prints used and available FPGA resources, and reached and needed clock rates. The exit
    status is 1 if a clock is not met.

    With --simulate the command decodes frames from the simulated lanes of the monitor connector. It compares
    the frames with the bit-accurate model. The exit status is 1 if a frame differs, or if the frames are too
    heavy for 60 Hz.

    With --from nothing is placed, and the command takes seconds. It refuses what would change more than the
    words of memories.

    Vertex colours, and on an 85F textures, are drawn if there is room for them. A warning says what is left
    out, and why.

    The buttons of the board stop the motion, reverse it, and change the material and the light.

    \b
    Examples:
        blysk board ulx3s-25f --mesh teapot -o teapot.bit
        blysk board ulx3s-25f --mesh new.glb --from teapot.bit -o new.bit
        blysk board ulx3s-85f --exponent 200 --simulate 2 -o frames/
    """
    board = board_named(board_name)
    if output is None:
        raise InputError("board", "nothing to write", "give -o FILE.bit, or --simulate N -o FOLDER")
    given = given_options(context, OPTIONS)
    program = _loader() if load else ""
    if toggles and not simulate:
        raise InputError("--toggles", "counts bits of a simulation", "also give --simulate N")
    if simulate and load:
        raise InputError("--load", "there is no bitstream of a simulation", "leave out --simulate or --load")
    if routed is not None:
        _refuse_unused(context, () if simulate else ("seeds", "record"))
    if routed is not None or not simulate:
        packages_missing()
    if not simulate:
        from blysk.sim.cli.outputs import check_outputs

        check_outputs([routed] if routed else [], pictures=[], others=[output, record])
    recorded = _recorded(record)
    settings = read_settings(mesh, given, {**SCENE, **DESIGN}, **DEFAULTS)
    check_mesh(settings)
    from blysk.bench.tools import board as work
    from blysk.bench.tools.board_from import RoutedBitstream

    source = None if routed is None else RoutedBitstream.read(routed)
    gpu, scenes, plan = work.planned(board, mesh, given, colours, clock, source, loader)
    click.echo("\n".join(work.design_lines(board, mesh, gpu, plan)))
    if source is not None and not simulate:
        work.write_rewritten(work.rewritten_from(source, board, gpu, plan), output)
        if load:
            work.load_bitstream(program, board, output)
        return
    if not simulate:
        click.echo(f"{'bitstream':<12}of the default design: {board.known}")
    figures = recorded.setdefault(f"{board.name}, {mesh}, {gpu.drawing.mesh.triangles:,} triangles", {})
    if simulate:
        figures["simulated"] = work.simulated(board, gpu, scenes, plan, simulate, Path(output), source)
        if toggles:
            figures["toggles"] = work.toggled(board, gpu, plan, simulate)
        if record:
            write_json(record, recorded)
        return
    built = work.bitstream_of(board, gpu, plan, seeds)
    click.echo("\n".join(work.built_lines(built)))
    figures["built"] = work.figures_of(built)
    if record:
        write_json(record, recorded)
    work.write_bitstream(built, output)
    if load:
        work.load_bitstream(program, board, output)


def _refuse_unused(context: click.Context, names: Iterable[str]) -> None:
    """Refuse options that a run with --from would not read.

    Raises
    ------
    InputError
        If one of these options is given.
    """
    if context.params["toggles"]:
        raise InputError("--toggles", "counts bits of the mesh itself", "leave out --from or --toggles")
    for name in names:
        if context.get_parameter_source(name) is not ParameterSource.DEFAULT:
            raise InputError(f"--{name}", "nothing is placed with --from", f"leave out --{name}")


def _recorded(path: str | None) -> dict[str, Any]:
    """Figures of a JSON file, checked before long work. Empty if the file does not exist yet."""
    if path is None:
        return {}
    check_writable(path)
    try:
        known = json.loads(Path(path).read_text(encoding="utf-8"))
        return {entry: dict(figures) for entry, figures in known.items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, TypeError, AttributeError) as error:
        raise InputError(path, "is not a JSON file of figures", "choose another file for --record") from error


def _loader() -> str:
    """Path of the executable of openFPGALoader.

    Raises
    ------
    InputError
        If openFPGALoader is not installed.
    """
    found = shutil.which("openFPGALoader")
    if found is None:
        raise InputError(
            "--load",
            "openFPGALoader is not installed",
            f"{install_package('openfpgaloader')}, or leave it out",
        )
    return found
