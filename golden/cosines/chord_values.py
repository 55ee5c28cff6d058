"""Chord values: N·L and half the squared chord from a normal N to H, for every light."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR, COMPONENT

__all__ = ["ChordValues"]


@dataclass(frozen=True)
class ChordValues:
    """``f = N·L`` and ``u = |N - H|^2 / 2`` of a unit normal, in the formats of `ChordSetup`.

    f is the exact dot product and u comes from `Chord`; both are rounded half up, and saturate. This takes
    six products a light, three without highlights.

    ====== ========== ==========================================
    word   format     why
    ====== ========== ==========================================
    f      SQ(1, 25)  rounded from 34 fraction bits
    u      UQ(1, 26)  rounded from 35 fraction bits; 2 saturates
    ====== ========== ==========================================

    `diffuse_error` and `highlight_error` bound the errors against the exact values of the vectors'
    directions, in units of `ONE_SQUARED`.

    Parameters
    ----------
    scale : int
        s, 0 to `ChordSetup.MOST_SCALE`. If over 0, the word of u is ``min(2^s u, 1)``, for lobes that are 0
        from ``u = 2^-s`` on: a small u keeps s bits more, at the cost of wires alone.

    Raises
    ------
    ValueError
        If the scale is out of range.

    Source: docs/theory/chord.md#differences; [Lyon93].
    """

    scale: int = 0

    DIFFUSE_FORMAT = ChordSetup.DIFFUSE_FORMAT
    HIGHLIGHT_FORMAT = ChordSetup.HIGHLIGHT_FORMAT

    def __post_init__(self):
        ChordSetup.check_scale(self.scale)

    def compute(self, normal: Fixed, direction: Fixed, halfway: Fixed) -> tuple[Fixed, Fixed]:
        """Bit-accurate f and u.

        Parameters
        ----------
        normal : Fixed, shape (normals, 3), SQ(1, 17)
            Unit normals.
        direction, halfway : Fixed, shape (lights, 3), SQ(1, 17)
            Unit vectors L and H of each light.

        Returns
        -------
        diffuse : Fixed, shape (normals, lights), SQ(1, 25)
        highlight : Fixed, shape (normals, lights), UQ(1, 26)

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        if {v.format for v in (normal, direction, halfway)} != {COMPONENT}:
            raise ValueError(f"operands must be {COMPONENT}")
        normal = Fixed(COMPONENT, normal.codes[:, None])
        diffuse, highlight = self.DIFFUSE_FORMAT, self.HIGHLIGHT_FORMAT
        cosine, chord = DotProduct().compute(normal, direction), Chord().compute(normal, halfway)
        u = chord.scale(self.scale).round_half_up(highlight.fraction_bits).saturate(highlight)
        if self.scale:
            u = Fixed(highlight, np.minimum(u.codes, 1 << highlight.fraction_bits))
        return cosine.round_half_up(diffuse.fraction_bits).saturate(diffuse), u

    @classmethod
    def diffuse_error(cls) -> float:
        """Largest error of f: ``2 d + d^2`` by the length error d of a vector, plus half a step."""
        d = CODE_LENGTH_ERROR
        return 2 * d + d**2 + cls.DIFFUSE_FORMAT.step / 2

    @classmethod
    def highlight_error(cls, u: float) -> float:
        """Largest error of u up to a value.

        It is ``(d_N - d_H)^2 / 2 + (d_N + d_H) u`` by the length errors of N and H, plus half a step, plus a
        step for u = 2, which saturates, plus from ``u = 1/2`` on the cut of `Chord`.

        Parameters
        ----------
        u : float
            Largest value, 0 to 2.
        """
        d = CODE_LENGTH_ERROR
        error = 2 * d**2 + 2 * d * (1 + d) * u + cls.HIGHLIGHT_FORMAT.step * 1.5
        if u >= 0.5 - 2.0**-15:
            error += 3**0.5 * COMPONENT.step * 2 + 3 * 2.0**-35
        return error
