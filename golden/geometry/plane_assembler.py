"""Plane assembler: the gradients of a triangle's attributes, and the longest piece of its spans."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.gradient_setup import Gradients
from blysk.golden.geometry.triangles import Frame

__all__ = ["PlaneAssembler", "Planes"]


@dataclass(frozen=True)
class Planes:
    """Triangles ready to be walked.

    Parameters
    ----------
    gradients : Gradients, shape (T, 4)
        Of the components of N/W and of the depth.
    piece : int64 array, shape (T,)
        Exponent of the pixels that a piece of a span has at most, 0 to 12.
    """

    gradients: Gradients
    piece: np.ndarray

    def __len__(self) -> int:
        return len(self.piece)

    @property
    def beats(self) -> dict:
        """What the hardware gives."""
        gradients = self.gradients.beats
        del gradients["size"]
        return gradients | {"piece": self.piece}


@dataclass(frozen=True)
class PlaneAssembler:
    """The largest power of two of pixels over which no unit normal of a triangle turns by more than a limit.

    Unit vectors along a and b are at most ``2 |a - b| / (|a| + |b|)`` apart (Dunkl and Williams), so that
    over p pixels of a scanline the chord is at most ``p |g| / m``, g the step of N/W per pixel and m its
    least length in the triangle. With

    - ``|g| <= (largest + sum) / 2`` of the sizes of its components, less than 1.16 times too much,
    - m at least what `AttributeSerialiser` gives,

    p is ``2^piece`` with the largest ``piece`` of 0 to 12 for which ``2^piece (largest + sum) / 2`` is at
    most that bound times the frame's limit. Single pixels have no chord, so that there is nothing that a
    triangle could not be cut to.

    Parameters
    ----------
    cuts : bool
        Whether spans are cut; else ``piece`` is 12, more pixels than a span has.

    Source: docs/theory/geometry.md#normals; C. F. Dunkl, K. S. Williams, *A simple norm inequality*, 1964.
    """

    cuts: bool = True

    LARGEST = 12

    def compute(self, gradients: Gradients, least: np.ndarray, frame: Frame) -> Planes:
        """Bit-accurate planes.

        Parameters
        ----------
        gradients : Gradients, shape (T, 4)
            From `GradientSetup`.
        least : int64 array, shape (T,)
            From `AttributeSerialiser`, in 2^-11.
        frame : Frame
            Its ``limit``.
        """
        if not self.cuts:
            return Planes(gradients, np.full(len(least), self.LARGEST))
        size = gradients.size[:, :3]
        norm = size.max(axis=1) + size.sum(axis=1)
        allowed = least * frame.limit
        exponents = np.arange(1, self.LARGEST + 1)
        piece = (norm[:, np.newaxis] << exponents <= allowed[:, np.newaxis]).sum(axis=1)
        return Planes(gradients, piece)
