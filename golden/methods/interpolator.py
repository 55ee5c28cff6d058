"""Interpolators: what shading needs of a span at every pixel, whatever the method that finds it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from blysk.golden.cosines.chord import Chord
from blysk.golden.lighting.specular import Specular
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE
from blysk.golden.number.fixed import Fixed, Format
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR, COMPONENT
from blysk.golden.reference.curves import interpolate

__all__ = ["Interpolator", "NormalInterpolator", "Operand", "Operands", "pixels_of", "runs_of"]

Operand = Literal["cosine", "one_minus_cosine"]
"""What the specular unit may be given."""


class Operands(NamedTuple):
    """What the shading of a light starts from.

    Parameters
    ----------
    cosine : Fixed, shape (pixels, lights)
        N·L.
    highlight : Fixed, shape (pixels, lights)
        N·H, or 1 - N·H.
    wide : bool array, shape (spans,)
        Whether the span is wider than the method can shade: its operands mean nothing.
    """

    cosine: Fixed
    highlight: Fixed
    out_of_range: np.ndarray


def pixels_of(length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Span of each pixel, and its place in the span, for spans of so many pixels each."""
    span = np.repeat(np.arange(len(length)), length)
    return span, np.arange(len(span)) - np.repeat(np.cumsum(length) - length, length)


def runs_of(length: np.ndarray, most: int = 1 << 18) -> Iterator[slice]:
    """Runs of spans with so many pixels or fewer, or of one span: bounds the memory of what is done at once.

    Parameters
    ----------
    length : int array, shape (spans,)
        Pixels of each.
    most : int
        Pixels of a run.
    """
    ends = np.cumsum(length)
    start = 0
    while start < len(length):
        before = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, before + most, side="right")), start + 1)
        yield slice(start, stop)
        start = stop


@dataclass(frozen=True)
class Interpolator:
    """A method that takes spans to the operands of their pixels, one subclass a method.

    A subclass states its formats, and has the bit-true `compute` and, in float64, what it stands for.

    Attributes
    ----------
    operand : str
        ``"cosine"`` or ``"one_minus_cosine"``: what the specular unit is given.
    COSINE_FORMAT : Format
        Of N·L.
    MAX_ANGLE : float
        Widest span in degrees for which the method is meant. It flags wider ones as far as it can tell them:
        most from there on; straight lines where a component of ``N_r - N_l`` is 1 or more, which takes 60
        degrees and happens to half of the spans at 75; ``renormalise`` besides every span with a normal that
        its unit does not serve (unit normals: over 94 degrees).
    CURVE : str
        The curve of `CURVES` on which the method's normals lie in exact arithmetic.
    """

    COSINE_FORMAT: ClassVar[Format] = DotProduct().result_format
    MAX_ANGLE: ClassVar[float] = MAX_SPAN_ANGLE
    CURVE: ClassVar[str] = "normalised"

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        raise NotImplementedError

    @property
    def serves_gate(self) -> bool:
        """Whether a highlight gate can tell what the method's pixels will be: it has normals and a bound."""
        return True

    @property
    def gate_angle(self) -> float:
        """Widest span, in degrees, for which `highlight_excess` is stated: 45, or `MAX_ANGLE` if less."""
        return min(self.MAX_ANGLE, MAX_SPAN_ANGLE)

    @property
    def highlight_excess(self) -> float:
        """How far a highlight may be brighter than the great circle says, for spans to `gate_angle`.

        With c the largest cosine to H on the arc of the great circle from N_l to N_r, in units of
        `ONE_SQUARED`, no pixel has an N·H over ``c + highlight_excess``, or a 1 - N·H under
        ``shortest_normal (1 - c) - highlight_excess``. A highlight gate counts on it.
        """
        raise NotImplementedError

    @property
    def shortest_normal(self) -> float:
        """Least length of a normal on the way, for spans to `gate_angle`, where the chord is taken to it."""
        return 1.0

    @property
    def uses_chord(self) -> bool:
        """Whether, in exact arithmetic, the specular operand is ``|N - H|^2 / 2`` of its normals."""
        return False

    def widest_span(self, exponent: int) -> float:
        """Widest span, in degrees, that should be given to the method at a specular exponent."""
        return self.MAX_ANGLE

    def largest_bend(self, exponent: int) -> float:
        """How far, in radians, the middle of a part of a span may lie from the middle normal of its ends.

        Wider parts should be cut again before they are given to the method, which takes every span to bend
        evenly. It is what costs 0.15 LSB: the cosine-quadratic model changes by ``0.77 sqrt(n)`` a radian at
        most.
        """
        return 0.15 / (255 * 0.77 * exponent**0.5)

    def compute(
        self,
        normal_left: Fixed,
        normal_right: Fixed,
        length: np.ndarray,
        direction: Fixed,
        halfway: Fixed,
    ) -> Operands:
        """Bit-true operands of every pixel, in the order of the spans.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (spans, 3), SQ(1, 17)
            Unit normals of the first and last pixel centre.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.
        direction, halfway : Fixed, shape (lights, 3), SQ(1, 17)
            Unit vectors L and H of each light.
        """
        raise NotImplementedError

    def exact_normals(self, normal_left: np.ndarray, normal_right: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Normals that the method stands for, in float64, as `interpolate` gives them.

        Parameters
        ----------
        normal_left, normal_right : arrays, shape (..., 3)
            Unit normals of the span of each pixel.
        t : array, shape (...)
            Place of the pixel in its span, 0 to 1.
        """
        return interpolate(self.CURVE, normal_left, normal_right, t)


@dataclass(frozen=True)
class NormalInterpolator(Interpolator):
    """A method that finds normals; products with L and H follow.

    Parameters
    ----------
    operand : str
        ``"cosine"``: the specular unit is given N·H. ``"one_minus_cosine"``: it is given the chord
        ``|N - H|^2 / 2`` of `Chord`, which feels the length of N only at second order.

    Raises
    ------
    ValueError
        If the operand is none of those.
    """

    operand: Operand = "cosine"

    def __post_init__(self):
        if self.operand not in ("cosine", "one_minus_cosine"):
            raise ValueError(f"operand must be 'cosine' or 'one_minus_cosine', not {self.operand!r}")

    @property
    def uses_chord(self):
        """With ``operand="one_minus_cosine"``."""
        return self.operand == "one_minus_cosine"

    @property
    def normal_error(self) -> float:
        """Largest distance of a normal from the method's curve, which keeps inside the unit circle."""
        raise NotImplementedError

    @property
    def shortest_length(self) -> float:
        """Least length of a normal on the method's curve, for spans to `gate_angle`."""
        return 1.0

    @property
    def highlight_excess(self):
        """`normal_error` along H; of the chord, ``|N - H| <= 2``, twice that and its cut.

        On a curve of length r, c away from H, half the squared chord is ``(1 - r)^2/2 + r (1 - c)``, which is
        at least ``r (1 - c)``. The directions of N_l and H differ from their codes in length.
        """
        if not self.uses_chord:
            return self.normal_error
        return 2 * (self.normal_error + 2 * CODE_LENGTH_ERROR) + Specular.ARGUMENT_FORMAT.step

    @property
    def shortest_normal(self):
        """`shortest_length`, of the chord."""
        return self.shortest_length if self.uses_chord else 1.0

    def normals(
        self, normal_left: Fixed, normal_right: Fixed, length: np.ndarray
    ) -> tuple[Fixed, np.ndarray]:
        """Bit-true normals of every pixel, shape (pixels, 3), SQ(1, 17), and which spans are too wide."""
        raise NotImplementedError

    def compute(self, normal_left, normal_right, length, direction, halfway) -> Operands:
        """Bit-true operands: exact products of the normals."""
        normals, out_of_range = self.normals(normal_left, normal_right, length)
        normals = Fixed(COMPONENT, normals.codes[:, np.newaxis])
        product = DotProduct().compute if self.operand == "cosine" else Chord().operand
        return Operands(DotProduct().compute(normals, direction), product(normals, halfway), out_of_range)
