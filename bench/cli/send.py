"""``blysk send``: another mesh for a board that runs; see `blysk.bench.tools.send`."""

import click

from blysk.bench.tools.board_options import COLOURS, DEFAULT_COLOURS, DEFAULTS, LOADERS, OPTIONS
from blysk.bench.tools.boards import BOARDS, board_named
from blysk.sim.api.options import DESIGN, SCENE
from blysk.sim.api.settings import check_mesh, read_settings
from blysk.sim.cli.options import given_options, options_of
from blysk.sim.errors import InputError
from blysk.sim.value_types import Choice, Number, OutputFile

__all__ = ["command"]


@click.command()
@click.argument("mesh")
@click.option("--board", "board_name", metavar="BOARD", help=f"Board: {', '.join(BOARDS)}.")
@click.option(
    "--made-for",
    default="teapot",
    show_default=True,
    metavar="MESH",
    help="Mesh for which the bitstream on the board was made.",
)
@click.option("--port", metavar="PORT", help="Serial port of the board, such as /dev/ttyUSB0.")
@click.option("-o", "--output", type=OutputFile(), help="File for the bytes, in place of a port.")
@click.option(
    "--loader",
    type=Choice("loader", LOADERS),
    default="uart",
    show_default=True,
    help="As the bitstream was made.",
)
@click.option(
    "--colours",
    type=Choice("colours", COLOURS),
    default=DEFAULT_COLOURS,
    show_default=True,
    help="As the bitstream was made.",
)
@click.option(
    "--clock",
    type=Number(1, 126, "MHz"),
    show_default=", ".join(f"{board.name} {board.clock:g}" for board in BOARDS.values()),
    help="As the bitstream was made.",
)
@options_of(OPTIONS)
@click.pass_context
def command(context, mesh, board_name, made_for, port, output, loader, colours, clock, **_):
    """Send MESH (a mesh file, a scene file, or teapot) to a board that runs.

    The bitstream on the board has a loader (blysk board --loader). Name the mesh for which it was made by
    --made-for, and give its options. Material, light and camera may differ. The command
    refuses what does not fit the memories of the bitstream.

    With --output the bytes are written to a file. Send this file by any program, or write it into the flash
    of a board with --loader flash.

    \b
    Examples:
        blysk send bunny.obj --board ulx3s-25f --port /dev/ttyUSB0
        blysk send bunny.obj --board ulx3s-25f -o bunny.packets
    """
    if board_name is None:
        raise InputError("--board", "missing", f"give one of {', '.join(BOARDS)}")
    board = board_named(board_name)
    if (port is None) == (output is None):
        reason = "nothing to send to" if port is None else "one of both is enough"
        raise InputError("--port, --output", reason, "give --port PORT, or --output FILE")
    given = given_options(context, OPTIONS)
    settings = read_settings(mesh, given, {**SCENE, **DESIGN}, **DEFAULTS)
    check_mesh(settings)
    from blysk.bench.tools import board as work
    from blysk.bench.tools.board_loader import sent_by
    from blysk.bench.tools.send import send, serial_library
    from blysk.sim.cli.outputs import check_outputs
    from blysk.sim.output import atomic_writer

    if output is None:
        serial_library()
    else:
        check_outputs([], pictures=[], others=[output])
    gpu, *_ = work.planned(board, mesh, given, colours, clock, None, loader, made_for)
    data = sent_by(gpu)
    words = ", ".join(f"{len(of.words):,} {of.name}" for of in gpu.drawing.memories)
    click.echo(f"{'words':<12}{words}")
    if output is not None:
        with atomic_writer(output) as temporary:
            temporary.write_bytes(data)
        click.echo(f"{'written':<12}{output}, {len(data):,} bytes")
        return
    send(port, data)
    click.echo(f"{'sent':<12}{len(data):,} bytes to {port}")
