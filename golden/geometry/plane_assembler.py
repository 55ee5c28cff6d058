"""Plane assembler: the gradients of a triangle's attributes, and the longest piece of its spans."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.gradient_setup import Gradients
from blysk.golden.geometry.triangles import FrameSettings

__all__ = ["PlaneAssembler", "Planes"]


@dataclass(frozen=True)
class Planes:
    """Planes of triangles: gradients of their attributes, and the largest length of a piece.

    Parameters
    ----------
    gradients : Gradients, shape (T, 4 + S)
        Gradients of the components of N/W, of the depth, and of the surface's attributes.
    piece : int64 array, shape (T,)
        A piece of a span has at most ``2^piece`` pixels; 0 to 12.
    """

    gradients: Gradients
    piece: np.ndarray

    def __len__(self) -> int:
        return len(self.piece)

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        gradients = self.gradients.beats
        del gradients["size"]
        return gradients | {"piece": self.piece}


@dataclass(frozen=True)
class PlaneAssembler:
    """Finds the largest power of two of pixels over which the unit normal turns by at most a limit.

    Unit vectors along a and b are at most ``2 |a - b| / (|a| + |b|)`` apart (Dunkl and Williams). Let g be
    the step of N/W per pixel, and m the least length of N/W in the triangle. Over p pixels of a scanline the
    chord is at most ``p |g| / m``. Both are bounded:

    - ``|g| <= (largest + sum) / 2``, where ``largest`` and ``sum`` are the largest and the sum of the
      absolute values of g's three components. This is at most ``sqrt(3/2) < 1.23`` times too large;
    - ``m >= least`` of `AttributeSerialiser`.

    ``piece`` is the largest number from 1 to 12 for which ``2^piece (largest + sum) / 2`` is at most
    ``least`` times the frame's limit. It is 0 if there is no such number. A piece of one pixel has no chord,
    so every triangle can be cut to the limit.

    Parameters
    ----------
    cuts : bool
        Whether spans are cut. If not, ``piece`` is 12: a span has fewer than 2^12 pixels.

    Source: docs/theory/geometry.md#normals; C. F. Dunkl, K. S. Williams, *A simple norm inequality*, 1964.
    """

    cuts: bool = True

    LARGEST = 12

    def compute(self, gradients: Gradients, least: np.ndarray, frame: FrameSettings) -> Planes:
        """Bit-accurate planes.

        Parameters
        ----------
        gradients : Gradients, shape (T, 4 + S)
            From `GradientSetup`.
        least : int64 array, shape (T,)
            From `AttributeSerialiser`, in 2^-11.
        frame : FrameSettings
            Settings of the frame. Only ``limit`` is used.
        """
        if not self.cuts:
            return Planes(gradients, np.full(len(least), self.LARGEST))
        size = gradients.size[:, :3]
        norm = size.max(axis=1) + size.sum(axis=1)
        allowed = least * frame.limit
        exponents = np.arange(1, self.LARGEST + 1)
        piece = (norm[:, np.newaxis] << exponents <= allowed[:, np.newaxis]).sum(axis=1)
        return Planes(gradients, piece)
