"""A bitstream with another scene in its memories, made from a routed bitstream without place and route."""

import contextlib
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from blysk.bench.tools.board_build import BoardNetlist, pack, run_tool
from blysk.bench.tools.memory_map import MemoryMap, carried, changed_words, memory_words, without_words
from blysk.bench.tools.tool_runner import ToolError, ToolRunner
from blysk.golden.video.draw_unit import Drawing, Room
from blysk.sim.errors import InputError

__all__ = ["Rewritten", "RoutedBitstream", "changed_lines", "rewrite"]

_REMEDIES = {
    "materials": "give --materials one, or build without --from",
    "board": "name the board of the bitstream, or build without --from",
    "surface": "give a mesh with vertex colours or textures like the first, or build without --from",
}
"""Remedies for facts that differ."""

_REMEDY = "give the options with which it was built, or build without --from"


@dataclass(frozen=True)
class RoutedBitstream:
    """A bitstream of ``blysk board``, read back.

    Parameters
    ----------
    path : str
        Name of the file.
    configuration : str
        The configuration in text.
    facts : dict of str to str
        Facts about the design, by name.
    room : Room
        Words that the memories have room for.
    lines : int
        Lines of a band.
    netlist : str
        Digest of the netlist, `BoardNetlist.digest`.
    memories : MemoryMap
        Where the memories of the scene are.
    """

    path: str
    configuration: str
    facts: Mapping[str, str]
    room: Room
    lines: int
    netlist: str
    memories: MemoryMap

    @classmethod
    def read(cls, path: str) -> "RoutedBitstream":
        """Read a bitstream.

        Raises
        ------
        InputError
            If the file cannot be read, is no bitstream of an ECP5, or carries no map of its memories.
        """
        thing = f"--from {path}"
        another = "give a bitstream of blysk board"
        try:
            given = Path(path).read_bytes()
        except OSError as error:
            raise InputError(thing, f"cannot be read ({error.strerror})", another) from None
        with _folder() as (runner, folder):
            (folder / "from.bit").write_bytes(given)
            try:
                run_tool(runner, folder, "ecpunpack", "from.bit", "--textcfg", "from.config")
                text = (folder / "from.config").read_text(encoding="utf-8")
            except (ToolError, OSError, UnicodeDecodeError):
                raise InputError(thing, "is no bitstream of an ECP5", another) from None
        return cls.of(path, text)

    @classmethod
    def of(cls, path: str, configuration: str) -> "RoutedBitstream":
        """The bitstream of a configuration in text; see `read`."""
        comment = carried(configuration)
        try:
            if comment is None:
                raise KeyError
            memories = MemoryMap.from_json(comment["memories"])
            facts, room = dict(comment["facts"]), Room(*comment["room"])
            lines, netlist = int(comment["lines"]), str(comment["netlist"])
        except (AttributeError, KeyError, TypeError, ValueError, IndexError):
            reason = "does not carry a map of its memories"
            remedy = "build it anew with this version of blysk board, without --from"
            raise InputError(f"--from {path}", reason, remedy) from None
        if not memories.blocks.keys() <= memory_words(configuration).keys():
            raise InputError(f"--from {path}", "lacks block RAMs of its map", "build it anew, without --from")
        return cls(path, configuration, facts, room, lines, netlist, memories)

    def check_facts(self, facts: Mapping[str, str]) -> None:
        """Refuse a design with other facts.

        Parameters
        ----------
        facts : dict of str to str
            Facts about the design.

        Raises
        ------
        InputError
            If a fact differs. The message names it.
        """
        for name in {**self.facts, **facts}:
            there, here = (known.get(name, "none") for known in (self.facts, facts))
            if there != here:
                raise InputError(
                    f"--from {self.path}",
                    f"{name} of its design: {there}; of this design: {here}",
                    _REMEDIES.get(name, _REMEDY),
                )

    def check_room(self, mesh: str, drawing: Drawing) -> None:
        """Refuse a mesh, named ``mesh``, whose words do not fit the memories.

        Raises
        ------
        InputError
            If the words do not fit. The message says how many fit.
        """
        room, given, commands = self.room, drawing.mesh, drawing.commands.longest
        if given.triangles > room.triangles or given.vertices > room.vertices:
            raise InputError(
                f"--mesh {mesh}",
                f"its {given.triangles:,} triangles with {given.vertices:,} vertices do not fit the memories "
                f"of {self.path}",
                f"use a mesh of at most {room.triangles:,} triangles and {room.vertices:,} vertices, or "
                "build without --from",
            )
        if commands > room.commands:
            raise InputError(
                f"--mesh {mesh}",
                f"its materials and lights take {commands:,} commands, and {self.path} has memory for "
                f"{room.commands:,}",
                "use fewer different materials, or build without --from",
            )

    def check_netlist(self, netlist: BoardNetlist) -> None:
        """Refuse a netlist that differs from the bitstream's in more than the words of its memories.

        Raises
        ------
        InputError
            If it differs.
        """
        sizes = {name: (len(words), width) for name, (width, words) in netlist.patterns.words.items()}
        if netlist.digest != self.netlist or sizes != self.memories.sizes:
            raise InputError(
                f"--from {self.path}",
                "its netlist differs in more than memories: built with other options, or by another version "
                "of blysk",
                _REMEDY,
            )

    @property
    def contents(self) -> dict[str, list[int]]:
        """Words of the scene's memories, by name."""
        return self.memories.contents(self.configuration)


@dataclass(frozen=True)
class Rewritten:
    """A bitstream with other words in its memories.

    Parameters
    ----------
    bitstream : bytes
        Bitstream that the FPGA loads.
    changed : dict of str to (int, int, int)
        Of each memory the number of words, their bits, and the number of words that changed.
    blocks : (int, int)
        Number of block RAMs that changed, and number of block RAMs.
    """

    bitstream: bytes
    changed: Mapping[str, tuple[int, int, int]]
    blocks: tuple[int, int]


def rewrite(
    source: RoutedBitstream,
    contents: Mapping[str, list[int]],
    progress: Callable[[str], object] = lambda step: None,
) -> Rewritten:
    """Write other words into the memories of a routed bitstream, pack it, and read it back.

    Parameters
    ----------
    source : RoutedBitstream
        The bitstream.
    contents : dict of str to list of int
        Words of every memory of the scene.
    progress : callable
        Called with the name of each step.

    Raises
    ------
    ToolError
        If a tool fails. If other words are read back, or more than words of memories has changed.
    """
    old = source.contents
    with _folder() as (runner, folder):
        progress("bitstream")
        filled = source.memories.replaced(source.configuration, contents)
        (folder / "filled.config").write_text(filled, encoding="utf-8")
        pack(runner, folder, "filled.config")
        back = (folder / "back.config").read_text(encoding="utf-8")
        bitstream = (folder / "top.bit").read_bytes()
    if source.memories.contents(back) != dict(contents):
        raise ToolError("the memories read back with other words")
    if without_words(back) != without_words(source.configuration):
        raise ToolError("more than words of memories has changed in the bitstream")
    before, after = memory_words(source.configuration), memory_words(back)
    changed = {
        name: (*source.memories.sizes[name], changed_words(old[name], words))
        for name, words in contents.items()
    }
    blocks = sum((before[number] != after[number]).any() for number in before)
    return Rewritten(bitstream, changed, (int(blocks), len(before)))


def changed_lines(rewritten: Rewritten) -> Iterator[str]:
    """Lines about the words that have changed, and about all that has not."""
    for name, (words, bits, changed) in rewritten.changed.items():
        yield f"{name:<13}{changed:,} of {words:,} words of {bits} bits changed"
    changed, blocks = rewritten.blocks
    yield f"{'unchanged':<13}{blocks - changed} of {blocks} block RAMs, and everything that is no memory"


@contextlib.contextmanager
def _folder() -> Iterator[tuple[ToolRunner, Path]]:
    """A runner of tools, and its temporary folder."""
    runner = ToolRunner()
    with tempfile.TemporaryDirectory(prefix="blysk-") as name:
        try:
            yield runner, Path(name)
        finally:
            runner.stop()
