"""Methods whose spans carry normals at their ends, and methods that find the normal of each pixel."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.cosines.chord import Chord
from blysk.golden.frame_constants import UNIT_VECTORS, FrameConstants, LightMeanings
from blysk.golden.lighting.gate import Gate
from blysk.golden.lighting.highlight_gate import GateLimits, HighlightGate
from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.frame_steps import ExactShading, SpanCutter, SpanFiller
from blysk.golden.methods.interpolator import Interpolator, Operand, Operands
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR, COMPONENT
from blysk.golden.reference.raster import Raster

if TYPE_CHECKING:
    from blysk.golden.geometry.geometry import Geometry

__all__ = ["EndNormalInterpolator", "NormalInterpolator", "difference_rounding"]


def difference_rounding(pixel: int) -> float:
    """Bound of the rounding error of a normal by forward differences, of the result and of both differences.

    ``sqrt(3) (2^-18 + 2^-42 (k + k^2/2))`` at pixel k, see `DifferenceSetup` and `DifferenceAccumulator`.

    Parameters
    ----------
    pixel : int
        Index k of the pixel, from 0 on.
    """
    return float(np.sqrt(3) * (2.0**-18 + 2.0**-42 * (pixel + pixel**2 / 2)))


@dataclass(frozen=True)
class EndNormalInterpolator(Interpolator):
    """A method whose spans carry normals at both ends; `compute` is its bit-accurate model.

    Its spans are cut until the curve keeps its tolerance, and filled with unit normals. Triangles give them.
    A `HighlightGate` can foresee its highlights.
    """

    @property
    def serves_gate(self) -> bool:
        """``True``: the method has a bound of `highlight_excess`."""
        return True

    @property
    def gate_angle(self) -> float:
        """Largest angle of a span, in degrees, for `highlight_excess`: 45, or `MAX_ANGLE` if less."""
        return min(self.MAX_ANGLE, MAX_SPAN_ANGLE)

    @property
    def highlight_excess(self) -> float:
        """Bound of the excess of N·H over N·H of the great circle, for spans up to `gate_angle`.

        Let c be the largest cosine to H on the arc of the great circle from N_l to N_r, in units of
        `ONE_SQUARED`. No pixel has an N·H over ``c + highlight_excess``, or a 1 - N·H under
        ``shortest_normal (1 - c) - highlight_excess``. A highlight gate relies on this.
        """
        raise NotImplementedError

    @property
    def shortest_normal(self) -> float:
        """Least length of a normal on the curve, for spans up to `gate_angle`.

        It is 1 if no chords to H are used.
        """
        return 1.0

    @property
    def gate_limits(self) -> GateLimits:
        """`highlight_excess`, `shortest_normal` and `gate_angle`, for a highlight gate."""
        return GateLimits(self.highlight_excess, self.shortest_normal, self.gate_angle)

    @property
    def brings_ends(self) -> bool:
        """``True``: spans bring unit normals at both ends."""
        return True

    def input_lines(self, lights: int, highlights: bool, factors: Sequence[int]) -> list[str]:
        """Line that describes the codes of unit vectors, see `Interpolator.input_lines`."""
        return ["i_normal_*, L and H: unit vectors in SQ(1, 17), code = component (2^17 - 1)"]

    @property
    def lights_cut(self) -> bool:
        """``True``: the curve has an error, so each light may cut spans."""
        return True

    @property
    def light_meanings(self) -> LightMeanings:
        """Texts for L and H: unit vectors."""
        return UNIT_VECTORS

    def gate(self, specular: HighlightOperand) -> Gate:
        """Model of the gate by unit normals, see `Interpolator.gate`."""
        return HighlightGate(self.gate_limits, specular) if self.serves_gate else super().gate(specular)

    def operands(self, spans: Spans, constants: FrameConstants, highlights: bool) -> Operands:
        """Bit-accurate operands by `compute`, from the normals of spans, see `Interpolator.operands`."""
        left, right = (Fixed(self.END_FORMAT, codes) for codes in (spans.normal_left, spans.normal_right))
        vectors = [Fixed(COMPONENT, codes) for codes in (constants.direction, constants.halfway)]
        return self.compute(left, right, np.asarray(spans.length), *vectors)

    def geometry(self, lights: int) -> "Geometry":
        """Geometry that makes unit normals."""
        # Commands that build no geometry start without its files.
        from blysk.golden.geometry.geometry import Geometry

        return Geometry()

    def cut(self, cutter: SpanCutter) -> tuple[Raster, int]:
        """Spans cut until the curve keeps its tolerance."""
        return cutter.by_error()

    def filled(self, filler: SpanFiller) -> Spans:
        """Spans with unit normals."""
        return filler.with_normals()

    def exact_frame(self, shading: ExactShading) -> np.ndarray:
        """A frame by the normals of the curve, in exact arithmetic."""
        return shading.by_normals()

    @abstractmethod
    def compute(
        self,
        normal_left: Fixed,
        normal_right: Fixed,
        length: np.ndarray,
        direction: Fixed,
        halfway: Fixed,
    ) -> Operands:
        """Bit-accurate operands of every pixel, in the order of the spans.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (spans, 3), SQ(1, 17)
            Unit normals of the first and last pixel centre.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.
        direction, halfway : Fixed, shape (lights, 3), SQ(1, 17)
            Unit vectors L and H of each light.
        """


@dataclass(frozen=True)
class NormalInterpolator(EndNormalInterpolator):
    """A method that computes normals, and their products with L and H.

    Parameters
    ----------
    operand : str
        Operand of the specular unit. ``"cosine"``: N·H. ``"one_minus_cosine"``: half the squared chord,
        ``|N - H|^2 / 2`` of `Chord`. The length of N then counts only at second order.

    Raises
    ------
    ValueError
        If the operand is unknown.
    """

    operand: Operand = "cosine"

    def __post_init__(self) -> None:
        if self.operand not in ("cosine", "one_minus_cosine"):
            raise ValueError(f"operand must be 'cosine' or 'one_minus_cosine', not {self.operand!r}")

    def with_operand(self, operand: Operand) -> "NormalInterpolator":
        """The method with another operand of the specular unit."""
        return replace(self, operand=operand)

    @property
    def uses_chord(self) -> bool:
        """Whether ``operand`` is ``"one_minus_cosine"``."""
        return self.operand == "one_minus_cosine"

    @property
    def normal_error(self) -> float:
        """Largest distance of a normal from the method's curve; the curve stays inside the unit circle."""
        raise NotImplementedError

    @property
    def shortest_length(self) -> float:
        """Least length of a normal on the method's curve, for spans to `gate_angle`."""
        return 1.0

    @property
    def highlight_excess(self) -> float:
        """Bound of the excess of N·H: `normal_error`, or more with half the squared chord.

        With half the squared chord it is twice `normal_error`, because ``|N - H| <= 2``, plus the error of
        the dropped bits. Let r be the length of a normal on the curve and c its cosine to H. Half the squared
        chord is ``(1 - r)^2/2 + r (1 - c)``, at least ``r (1 - c)``. The lengths of the codes of N_l and H
        differ from 1.
        """
        if not self.uses_chord:
            return self.normal_error
        return 2 * (self.normal_error + 2 * CODE_LENGTH_ERROR) + Specular.ARGUMENT_FORMAT.step

    @property
    def shortest_normal(self) -> float:
        """`shortest_length` if the operand is half the squared chord, else 1."""
        return self.shortest_length if self.uses_chord else 1.0

    @abstractmethod
    def normals(
        self, normal_left: Fixed, normal_right: Fixed, length: np.ndarray
    ) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate normals of every pixel, and flags of spans out of range.

        Parameters
        ----------
        normal_left, normal_right, length
            As for `compute`.

        Returns
        -------
        normals : Fixed, shape (pixels, 3), SQ(1, 17)
        out_of_range : bool array, shape (spans,)
        """

    def products(self, normals: Fixed, direction: Fixed, halfway: Fixed) -> tuple[Fixed, Fixed]:
        """N·L, exact, and the operand of the specular unit.

        The operand is N·H, exact, or half the squared chord, cut to 25 fraction bits.

        Parameters
        ----------
        normals : Fixed, shape (pixels, 3), SQ(1, 17)
            Normal of each pixel.
        direction, halfway : Fixed, shape (lights, 3), SQ(1, 17)
            L and H of each light.

        Returns
        -------
        cosine, highlight : Fixed, shape (pixels, lights)
        """
        normals = Fixed(COMPONENT, normals.codes[:, np.newaxis])
        product = Chord().operand if self.uses_chord else DotProduct().compute
        return DotProduct().compute(normals, direction), product(normals, halfway)

    def compute(
        self,
        normal_left: Fixed,
        normal_right: Fixed,
        length: np.ndarray,
        direction: Fixed,
        halfway: Fixed,
    ) -> Operands:
        """Bit-accurate operands of every pixel: products of the normals with L and H."""
        normals, out_of_range = self.normals(normal_left, normal_right, length)
        return Operands(*self.products(normals, direction, halfway), out_of_range)
