"""Motion: the matrices of meshes that turn, by a table of sines."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import normalise
from blysk.golden.video.mesh_memory import MeshMemory
from blysk.golden.video.vertex_unit import ENTRY, OFFSET, Matrix, VertexTransform

__all__ = ["ANGLE_BITS", "ENTRIES", "Motion", "rotation"]

ANGLE_BITS = 12
"""Number of bits of an angle; ``2^12`` codes are a whole turn."""

ENTRIES = 21
"""Words of a matrix: nine of positions, three offsets, nine of normals."""


def rotation(axis: Sequence[float], angle: float) -> np.ndarray:
    """Matrix of a rotation in radians, anticlockwise if the axis points to the viewer; float64."""
    constant, cosine, sine = _turns(axis)
    found: np.ndarray = constant + np.cos(angle) * cosine + np.sin(angle) * sine
    return found


def _turns(axis: Sequence[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrices of an axis, a of length 1: ``a a^T``, ``1 - a a^T``, and the cross product with a."""
    x, y, z = a = normalise(axis)
    along = np.outer(a, a)
    return along, np.eye(3) - along, np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


@dataclass(frozen=True)
class Motion:
    """Entries ``c0 + c1 cos a + c2 sin a`` of the matrices of turning meshes.

    With any axis and camera, every entry of the product of camera and rotation has this form. So has every
    entry of the product of the normals' axes and the rotation. A table of a quarter turn, 1024 words in
    ``SQ(2, 16)``, has the sines of ``(k + 1/2) 2 pi / 2^12``. Due to the half step the other quarters are its
    mirror images. An entry takes two products. Their sum with c0 is rounded to 20 fraction bits for offsets,
    to 16 for the other entries.

    The error of an entry is at most `ENTRY_ERROR`. It is the sum of:

    - 2^-17 for the sine and 2^-17 for the cosine, times coefficients below 2;
    - 2^-17 for c1, 2^-17 for c2, and 2^-21 for c0;
    - half a step for the rounding.

    Parameters
    ----------
    constant : int64 array, shape (S, 21)
        c0 of each slot, codes of `OFFSET`.
    cosine, sine : int64 arrays, shape (S, 21)
        c1 and c2 of each slot, codes of `ENTRY`.

    Attributes
    ----------
    ROOM : int
        Number of slots in the 512 words of a block RAM.

    Raises
    ------
    ValueError
        If a coefficient is out of range.

    Source: docs/theory/video.md#vertices; not in the documents.
    """

    constant: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray

    ROOM = 512 // ENTRIES
    TABLE_BITS = ANGLE_BITS - 2
    WORD_BITS = OFFSET.width + 2 * ENTRY.width
    ENTRY_ERROR = 2 * 2 * 2.0**-17 + 2 * 2.0**-17 + 2.0**-21 + 2.0**-17

    @classmethod
    def of(
        cls,
        mesh: MeshMemory,
        camera: Camera,
        size: tuple[int, int],
        axis: Sequence[float] = (0.0, 1.0, 0.0),
        unit: VertexTransform | None = None,
        normal_axes: Sequence[np.ndarray] = (np.eye(3),),
    ) -> "Motion":
        """Motion of a memory's parts: each turns around an axis through its own middle.

        Each set of axes for normals has a slot for each part. The slots of the first set come first.

        Parameters
        ----------
        mesh : MeshMemory
            The parts.
        camera : Camera
            Perspective camera.
        size : (int, int)
            Width and height of the picture, which is in the middle of the grid.
        axis : three floats
            Axis of the rotation.
        unit : VertexTransform, optional
            Vertex unit. Only its ``scale_bits`` matter.
        normal_axes : sequence of float64 arrays, shape (3, 3)
            Sets of axes, by rows. Normals come out in their frame. By default the world's frame.

        Raises
        ------
        ValueError
            If the camera is orthographic, or a coefficient is out of range.
        """
        if camera.projection != "perspective":
            raise ValueError("turning meshes need a perspective camera, not an orthographic camera")
        pixels = 1 << (unit or VertexTransform()).scale_bits
        width, height = size
        frame = FrameSettings.centred(width, height)
        points = np.vstack([np.zeros(3), np.eye(3)])
        rows = camera.homogeneous(points, width, height)[:, :3]
        rows = rows + rows[:, 2:] * [frame.left, frame.top, 0]
        rows = rows / camera.near / [pixels, pixels, 1]
        offset, linear = rows[0], (rows[1:] - rows[0]).T
        turns = _turns(axis)
        made: list[list[np.ndarray]] = [[], [], []]
        for axes, part in product(normal_axes, mesh.parts):
            for k, turn in enumerate(turns):
                position = (linear @ turn * part.scale).ravel()
                moved = linear @ part.centre + offset if k == 0 else np.zeros(3)
                made[k].append(np.concatenate([position, moved, (axes @ turn).ravel()]))
        try:
            return cls(
                Fixed.round(OFFSET, made[0]).codes,
                Fixed.round(ENTRY, made[1]).codes,
                Fixed.round(ENTRY, made[2]).codes,
            )
        except ValueError as error:
            raise ValueError(f"the camera is too near to a mesh, or too far from it: {error}") from None

    def padded(self, slots: int) -> "Motion":
        """The motion with slots of zeros behind its own, up to a number of slots."""
        rows = [np.pad(c, ((0, slots - len(c)), (0, 0))) for c in (self.constant, self.cosine, self.sine)]
        return Motion(*rows)

    @property
    def slots(self) -> int:
        """Number of matrices."""
        return len(self.constant)

    @property
    def words(self) -> list[int]:
        """Words of the memory, 21 for each slot. From the lowest bit up: c0, c1, c2."""
        columns = zip(self.constant.ravel(), self.cosine.ravel(), self.sine.ravel(), strict=True)
        widths = OFFSET.width, ENTRY.width, ENTRY.width
        shifts = 0, widths[0], widths[0] + widths[1]
        return [
            sum(
                (int(code) & (1 << width) - 1) << shift
                for code, width, shift in zip(row, widths, shifts, strict=True)
            )
            for row in columns
        ]

    @cached_property
    def table(self) -> Fixed:
        """Sines of the first quarter turn, ``SQ(2, 16)``."""
        count = 1 << self.TABLE_BITS
        return Fixed.round(ENTRY, np.sin((np.arange(count) + 0.5) * (np.pi / 2 / count)))

    @staticmethod
    def radians(angle: int) -> float:
        """The angle of a code, in radians."""
        return (angle + 0.5) * 2 * np.pi / (1 << ANGLE_BITS)

    def turn(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bit-accurate cosine and sine of angles."""
        quarter = 1 << self.TABLE_BITS

        def sine(code: np.ndarray) -> np.ndarray:
            code = code % (4 * quarter)
            low = code % quarter
            value = self.table.codes[np.where(code // quarter % 2, quarter - 1 - low, low)]
            return np.where(code // (2 * quarter), -value, value)

        return sine(np.asarray(angle) + quarter), sine(np.asarray(angle))

    def compute(self, slot: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Bit-accurate entries, shape (..., 21): codes of `OFFSET` for the offsets, else of `ENTRY`.

        Parameters
        ----------
        slot, angle : int64 arrays
            Indices of slots; codes of angles.

        Raises
        ------
        ValueError
            If an index is out of range.
        """
        if np.size(slot) and not 0 <= np.min(slot) <= np.max(slot) < self.slots:
            raise ValueError(f"slots are 0 to {self.slots - 1}, not {np.min(slot)} to {np.max(slot)}")
        cosine, sine = (Fixed(ENTRY, value[..., np.newaxis]) for value in self.turn(angle))
        total = Fixed(OFFSET, self.constant[slot]) + (
            Fixed(ENTRY, self.cosine[slot]) * cosine + Fixed(ENTRY, self.sine[slot]) * sine
        )
        fine = total.round_half_up(OFFSET.fraction_bits).saturate(SQ(5, 20)).codes
        coarse = total.round_half_up(ENTRY.fraction_bits).saturate(ENTRY).codes
        is_offset = np.isin(np.arange(ENTRIES), (9, 10, 11))
        found: np.ndarray = np.where(is_offset, fine, coarse)
        return found

    def matrix(self, slot: int, angle: int) -> Matrix:
        """The matrix of a slot at an angle."""
        entries = self.compute(np.asarray(slot), np.asarray(angle))
        return Matrix(entries[:9].reshape(3, 3), entries[9:12], entries[12:].reshape(3, 3))
