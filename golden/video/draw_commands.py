"""Draw commands: lists of commands, made from a mesh and executed for every band."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.video.mesh_memory import BLOCK_WORDS, MeshMemory, block_rams

__all__ = ["COMMAND_BITS", "KINDS", "DrawCommands"]

KINDS = ("end", "transform", "frame_constant", "constant", "draw")
"""Kinds of commands by their codes."""

_FIELDS = {"kind": 3, "index": 9, "first": 12, "count": 12}

COMMAND_BITS = sum(_FIELDS.values())
"""Bits of a command. From the lowest bit up: kind, index, first, count."""

_ONCE = (KINDS.index("transform"), KINDS.index("frame_constant"))


@dataclass(frozen=True)
class DrawCommands:
    """Lists of commands in one memory. Each ends with ``end``.

    ================== ======================= ================== ============= =======================
    kind               index                   first              count         does
    ================== ======================= ================== ============= =======================
    end                                                                         ends the band
    transform          slot of a matrix        first vertex       vertices      in the first band only
    frame_constant     address of a write      low 12 bits        next 6 bits   in the first band only
    constant           address of a write      low 12 bits        next 6 bits   in every band
    draw               material                first triangle     triangles     in every band
    ================== ======================= ================== ============= =======================

    Parameters
    ----------
    words : int64 array, shape (C, 4)
        Kind, index, first, count.
    starts : tuple of int
        Index of each list's first command.

    Raises
    ------
    ValueError
        If a field outgrows its word, a kind is unknown, the last command is not ``end``, or a list begins at
        no command.

    Source: docs/theory/video.md#bands; [T] chapter 4.
    """

    words: np.ndarray
    starts: tuple[int, ...]

    def __post_init__(self) -> None:
        for column, (name, bits) in enumerate(_FIELDS.items()):
            values = self.words[:, column]
            if values.min() < 0 or values.max() >= 1 << bits:
                raise ValueError(f"a command's {name} must be 0 to {(1 << bits) - 1}, not {values.max()}")
        if self.words[-1, 0] != KINDS.index("end") or self.words[:, 0].max() >= len(KINDS):
            raise ValueError("commands must be known, and the last must be an end")
        for wrong in set(self.starts) - set(range(len(self.words))):
            raise ValueError(f"a list must begin at a command, 0 to {len(self.words) - 1}, not {wrong}")

    def check(self, kind: str, **most: int) -> None:
        """Refuse commands of a kind with an index or a range past the end of its elements.

        Parameters
        ----------
        kind : str
            One of `KINDS`.
        **most : int
            ``index``: number of indices. ``range``: number of elements that a range may take.

        Raises
        ------
        ValueError
            If a command goes past the end.
        """
        rows = self.words[self.words[:, 0] == KINDS.index(kind)]
        for name, past in (("index", rows[:, 1] + 1), ("range", rows[:, 2] + rows[:, 3])):
            for wrong in past[past > most[name]][:1]:
                raise ValueError(f"a command {kind} has {name} up to {wrong - 1}, past {most[name] - 1}")

    @classmethod
    def of(
        cls,
        mesh: MeshMemory,
        presets: Sequence[Sequence[FrameConstants]],
        cull: Sequence[int] = (),
        sets: Sequence[int] | None = None,
    ) -> "DrawCommands":
        """A list for each preset: constants, a transform of each part by the part's own slot, draws.

        Parameters
        ----------
        mesh : MeshMemory
            Meshes to draw.
        presets : sequence of sequence of FrameConstants
            For each preset, the constants of every material.
        cull : sequence of int
            Indices of parts that are left out.
        sets : sequence of int, optional
            For each preset, the index of its set of slots, see `Motion.of`. By default all presets have the
            first set.
        """
        rows: list[list[int]] = []
        starts = []
        for constants, of_preset in zip(presets, sets or [0] * len(presets), strict=True):
            first_slot = of_preset * len(mesh.parts)
            starts.append(len(rows))
            writes = writes_of(constants)
            data = np.asarray(writes["data"])
            kind = np.full(len(data), KINDS.index("frame_constant"))
            rows += np.stack([kind, writes["address"], data & 0xFFF, data >> 12], axis=1).tolist()
            kept = [(index, part) for index, part in enumerate(mesh.parts) if index not in cull]
            rows += [
                [KINDS.index("transform"), first_slot + index, part.first, part.count] for index, part in kept
            ]
            rows += [
                [KINDS.index("draw"), material, first, count]
                for _, part in kept
                for material, first, count in part.draws
            ]
            rows.append([KINDS.index("end"), 0, 0, 0])
        return cls(np.array(rows, dtype=np.int64), tuple(starts))

    @property
    def longest(self) -> int:
        """Number of commands of the longest list."""
        return max(len(self.compute(start, True)) for start in self.starts)

    @property
    def room(self) -> int:
        """Most commands of a list in as many block RAMs as the lists take."""
        blocks = block_rams(len(self.words), COMMAND_BITS)
        return max(blocks * BLOCK_WORDS // len(self.starts), self.longest)

    def padded(self, room: int) -> "DrawCommands":
        """The same lists, each followed by ``end`` up to a number of commands.

        Raises
        ------
        ValueError
            If a list is longer.
        """
        if self.longest > room:
            raise ValueError(f"a list of {self.longest:,} commands does not fit a memory for {room:,}")
        end = np.array([[KINDS.index("end"), 0, 0, 0]])
        lists = [self.compute(start, True) for start in self.starts]
        rows = [row for words in lists for row in (words, end.repeat(room - len(words), axis=0))]
        return DrawCommands(np.concatenate(rows), tuple(range(0, room * len(lists), room)))

    @property
    def codes(self) -> list[int]:
        """Words of the memory."""
        shift = np.cumsum([0, *_FIELDS.values()])[:-1]
        found: list[int] = (self.words << shift).sum(axis=1).tolist()
        return found

    def compute(self, start: int, first_band: bool) -> np.ndarray:
        """Commands of a band from a list's start to its end, shape (C, 4)."""
        end = start + int(np.argmax(self.words[start:, 0] == KINDS.index("end"))) + 1
        words = self.words[start:end]
        return words if first_band else words[~np.isin(words[:, 0], _ONCE)]
