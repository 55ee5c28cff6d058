"""Boards with an ECP5 and a connector for a monitor, and the tools that their bitstreams need."""

import importlib
from dataclasses import dataclass
from typing import Any

from blysk.bench.tools.families import ECP5
from blysk.sim.engines.cache import version_of
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra

__all__ = ["BOARDS", "Board", "board_named", "packages_missing"]


@dataclass(frozen=True)
class Board:
    """A board that has an ECP5 and a connector for a monitor.

    Parameters
    ----------
    name : str
        Name on the command line.
    revisions : str
        Revisions of the board that have the pins of the platform.
    module, platform : str
        Module and class in `amaranth_boards`.
    options : tuple of str
        Options of nextpnr: device, package, speed grade.
    reference : int
        Rate of the board's clock, Hz.
    buttons : tuple of (str, int)
        Names and numbers of up to six button resources, in the order of the drawing's inputs.
    luts, block_rams, multipliers : int
        Parts of the device. There are as many flip-flops as look-up tables.
    lines : int
        Lines of a band, limited by the memory of the device. On a small device a mesh with colours may have
        half as many.
    loader : str
        Name of the board for openFPGALoader.
    flash : str
        Name of the flash's resource.
    compact : bool
        Whether the device is small. A small device gets geometry of compact style. It gets setup interval 9
        if the method has this interval.
    clock : float
        Usual rate of the drawing clock, MHz.
    known : str
        Facts about the bitstream of the board's default design, with commits. The command prints them before
        a build. The guide's table is made from them.
    """

    name: str
    revisions: str
    module: str
    platform: str
    options: tuple[str, ...]
    reference: int
    buttons: tuple[tuple[str, int], ...]
    luts: int
    block_rams: int
    multipliers: int
    lines: int
    loader: str
    flash: str
    compact: bool
    clock: float
    known: str

    def make(self) -> Any:
        """The platform of amaranth-boards.

        Raises
        ------
        InputError
            If amaranth-boards is not installed.
        """
        try:
            module = importlib.import_module(f"amaranth_boards.{self.module}")
        except ModuleNotFoundError as error:
            raise InputError("board", f"{error.name} is not installed", install_extra("board")) from error
        return getattr(module, self.platform)(toolchain="Trellis")


_ULX3S_BUTTONS = tuple(
    (f"button_{name}", number)
    for name, number in (("fire", 0), ("fire", 1), ("up", 0), ("down", 0), ("left", 0), ("right", 0))
)

BOARDS = {
    board.name: board
    for board in (
        Board(
            *("ulx3s-25f", "2.x and 3.0", "ulx3s", "ULX3S_25F_Platform"),
            options=("--25k", "--package", "CABGA381", "--speed", "6"),
            reference=25_000_000,
            buttons=_ULX3S_BUTTONS,
            luts=24_288,
            block_rams=56,
            multipliers=28,
            lines=8,
            loader="ulx3s",
            flash="spi_flash",
            compact=True,
            clock=52.5,
            known="made on commit 74e18f0f by the first placement, with 15,900 of 24,288 look-up tables and "
            "all 56 block RAMs. All steps take 5 minutes of one core. The bitstream meets every clock",
        ),
        Board(
            *("ulx3s-85f", "2.x and 3.0", "ulx3s", "ULX3S_85F_Platform"),
            options=("--85k", "--package", "CABGA381", "--speed", "6"),
            reference=25_000_000,
            buttons=_ULX3S_BUTTONS,
            luts=83_640,
            block_rams=208,
            multipliers=156,
            lines=16,
            loader="ulx3s",
            flash="spi_flash",
            compact=False,
            clock=52.5,
            known="made on commit 4a8415c4 by the first placement, with 19,609 of 83,640 look-up tables and "
            "106 of 208 block RAMs. The bitstream meets every clock",
        ),
        Board(
            *("icepi-zero", "1.3 and 1.4", "icepi_zero", "IcepiZero1_3Platform"),
            options=("--25k", "--package", "CABGA256", "--speed", "6"),
            reference=50_000_000,
            buttons=(("button", 0), ("button", 1)),
            luts=24_288,
            block_rams=56,
            multipliers=28,
            lines=8,
            loader="icepi-zero",
            flash="spi_flash_1x",
            compact=True,
            clock=52.5,
            known="made on commit 9337e58d by the first placement, with 15,895 of 24,288 look-up tables and "
            "all 56 block RAMs. All steps take 6 minutes of one core. The bitstream meets every clock",
        ),
    )
}
"""Boards by name."""


def board_named(name: str) -> Board:
    """A board by its name.

    Raises
    ------
    InputError
        If there is no board of this name. The message lists the names.
    """
    if name not in BOARDS:
        raise InputError(f"board {name}", "unknown", f"use {', '.join(BOARDS)}")
    return BOARDS[name]


def packages_missing() -> None:
    """Check that every tool of a bitstream is installed.

    Raises
    ------
    InputError
        If tools are missing. The message names all of them.
    """
    needed = ("amaranth-boards", "pyosys", ECP5.package)
    missing = [package for package in needed if version_of(package) is None]
    if missing:
        verb = "is" if len(missing) == 1 else "are"
        raise InputError("board", f"{' and '.join(missing)} {verb} not installed", install_extra("board"))
