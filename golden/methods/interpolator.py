"""Interpolators: models of the methods that compute the operands of the pixels of a span."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.lighting.gate import Gate
from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.frame_steps import ErrorBounds, ExactShading, SpanCutter, SpanFiller
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE
from blysk.golden.number.fixed import Fixed, Format
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR, COMPONENT, ONE_SQUARED
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = ["Interpolator", "NormalInterpolator", "Operand", "Operands", "difference_rounding"]

Operand = Literal["cosine", "one_minus_cosine"]
"""Kind of the operand of a specular unit, for methods that find normals: N·H, or 1 - N·H."""


def difference_rounding(pixel: int) -> float:
    """Bound of the rounding error of a normal by forward differences: of the result and of both differences.

    ``sqrt(3) (2^-18 + 2^-42 (k + k^2/2))`` at pixel k, as derived in `DifferenceSetup`.

    Parameters
    ----------
    pixel : int
        Index k of the pixel, from 0 on.
    """
    return float(np.sqrt(3) * (2.0**-18 + 2.0**-42 * (pixel + pixel**2 / 2)))


class Operands(NamedTuple):
    """Operands of the diffuse and the specular unit of each light, for every pixel.

    Parameters
    ----------
    cosine : Fixed, shape (pixels, lights)
        N·L.
    highlight : Fixed, shape (pixels, lights)
        N·H, 1 - N·H, or the place in a lobe's table.
    out_of_range : bool array, shape (spans,)
        Whether the angle of the span is larger than the method serves: its operands mean nothing.
    factor : Fixed, shape (pixels, fading lights), optional
        Factor of each light that fades, of methods with `Interpolator.TAKES_VALUES`.
    """

    cosine: Fixed
    highlight: Fixed
    out_of_range: np.ndarray
    factor: Fixed | None = None


@dataclass(frozen=True)
class Interpolator:
    """A method that computes the operands of the pixels of spans; each method is a subclass.

    A subclass states its formats; `compute` is its bit-accurate model, `exact_normals` its curve in float64.

    Attributes
    ----------
    COSINE_FORMAT : Format
        Format of N·L.
    COSINE_OF_ZERO : float
        N·L of equal unit vectors in exact arithmetic: 1, or `ONE_SQUARED`, the product of the codes of length
        1.
    MAX_ANGLE : float
        Largest angle, in degrees, of a span that the method serves. Most methods flag every span over it. The
        linear method flags a span in which a component of ``N_r - N_l`` is 1 or more: none under 60 degrees,
        half of the spans at 75.
    CURVE : str
        The curve of `CURVES` on which the method's normals lie in exact arithmetic.
    ORIGIN : str
        ``"documents"``, ``"own"``, or ``"baseline"``: where the method comes from, for tables.
    TAKES_VALUES : bool
        Whether spans carry values of N·L and 1 - N·H of each light in place of normals, so that L and H may
        differ from pixel to pixel.
    TAKES_VECTORS : bool
        Whether spans carry vectors ``N/W`` at the first pixel and their step, in the frame of each light.
    CUT_BY_ERROR : bool
        Whether spans are cut until the curve keeps its tolerance, a quarter of an LSB, where checked; else
        they are cut by their angle alone.
    END_FORMAT : Format
        Format of the normals at a span's ends: ``SQ(1, 17)`` for unit normals; another format for ends of the
        true line, which have lengths, relative to the larger one.
    CHECKED_AT : tuple of float
        Places t in a span at which the method's curve is compared with exact normals, to decide whether the
        span is cut.
    """

    COSINE_FORMAT: ClassVar[Format] = DotProduct().result_format
    COSINE_OF_ZERO: ClassVar[float] = float(ONE_SQUARED.values)
    MAX_ANGLE: ClassVar[float] = MAX_SPAN_ANGLE
    CURVE: ClassVar[str] = "normalised"
    ORIGIN: ClassVar[Literal["documents", "own", "baseline"]] = "own"
    TAKES_VALUES: ClassVar[bool] = False
    TAKES_VECTORS: ClassVar[bool] = False
    END_FORMAT: ClassVar[Format] = COMPONENT
    CUT_BY_ERROR: ClassVar[bool] = True
    CHECKED_AT: ClassVar[tuple[float, ...]] = (0.25, 0.5, 0.75)

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        raise NotImplementedError

    @property
    def operand(self) -> Any:
        """Operand of the specular unit: ``"cosine"``, ``"one_minus_cosine"`` or ``"place"``."""
        raise NotImplementedError

    @property
    def scale(self) -> int:
        """Scale s of the operand, see `Lobe`; if it is over 0, the specular unit takes ``min(2^s u, 1)``."""
        return 0

    @property
    def value_setup(self) -> ChordSetup | None:
        """Setup of the quadratics through three values of N·L and u; ``None``: the method finds normals."""
        return None

    @property
    def highlight_format(self) -> Format:
        """Format of the operand of the specular unit."""
        return Specular(operand=self.operand).operand_format

    @property
    def serves_gate(self) -> bool:
        """Whether a highlight gate can foresee the method's highlights: it has normals and an error bound."""
        return True

    @property
    def takes_line(self) -> bool:
        """Whether a span carries the ends of the true line, which have lengths, in place of unit normals."""
        return self.END_FORMAT != COMPONENT

    @property
    def gate_angle(self) -> float:
        """Largest angle of a span, in degrees, for `highlight_excess`: 45, or `MAX_ANGLE` if less."""
        return min(self.MAX_ANGLE, MAX_SPAN_ANGLE)

    @property
    def highlight_excess(self) -> float:
        """Bound of the excess of N·H over that of the great circle, for spans up to `gate_angle`.

        With c the largest cosine to H on the arc of the great circle from N_l to N_r, in units of
        `ONE_SQUARED`, no pixel has an N·H over ``c + highlight_excess``, or a 1 - N·H under ``shortest_normal
        (1 - c) - highlight_excess``. A highlight gate relies on it.
        """
        raise NotImplementedError

    @property
    def shortest_normal(self) -> float:
        """Least length of a normal on the curve, for spans up to `gate_angle`; 1 without chords to H."""
        return 1.0

    @property
    def uses_chord(self) -> bool:
        """Whether, in exact arithmetic, the specular operand is ``|N - H|^2 / 2`` of the curve's normals."""
        return False

    def with_operand(self, operand: Operand) -> "Interpolator":
        """The method with another operand of the specular unit.

        Raises
        ------
        ValueError
            If the method has one operand.
        """
        raise ValueError(f"method {self.name} finds no normals, so it has one operand")

    def matched(self, specular: HighlightOperand | None) -> "Interpolator":
        """The method for a specular unit; ``None``: without specular light.

        Raises
        ------
        ValueError
            If the method cannot feed the unit.
        """
        return self

    def unit_for(self, specular: HighlightOperand) -> HighlightOperand:
        """The specular unit that takes the method's operand, in its scale, with the model of a given unit.

        Raises
        ------
        ValueError
            If no unit of the model takes the operand.
        """
        return specular.for_operand(self.operand, self.scale)

    def fitted(self, lobe: Lobe, parameters: Sequence[float | None]) -> "Interpolator":
        """The method for a lobe and the parameters of its tables, where spans are cut for the method.

        Parameters
        ----------
        lobe : Lobe
            Specular unit.
        parameters : sequence of float or None
            Exponent or roughness of each table.
        """
        return self

    def gate(self, specular: HighlightOperand, by_normals: Callable[..., Gate]) -> Gate:
        """Model of the gate that foresees the method's highlights.

        Parameters
        ----------
        specular : HighlightOperand
            Model of the unit that is gated.
        by_normals : callable
            `HighlightGate`: makes a gate of unit normals from ``specular`` and ``interpolator``.

        Raises
        ------
        ValueError
            If the method does not serve a gate.
        """
        if not self.serves_gate:
            raise ValueError(f"method {self.name} has no error bound for a gate")
        return by_normals(specular, interpolator=self)

    def spans(self, lights: int, highlights: bool) -> QuotientSpans:
        """Model of the setup of spans of vectors.

        Parameters
        ----------
        lights : int
            Number of lights.
        highlights : bool
            Whether there is specular light.

        Raises
        ------
        ValueError
            If spans carry no vectors.
        """
        raise ValueError(f"method {self.name} takes no vectors")

    def check(self, spans: Spans, lights: int, factors: int) -> None:
        """Refuse spans that lack what the method takes.

        Parameters
        ----------
        spans : Spans
            The spans.
        lights, factors : int
            Number of lights, 1 at least, and of those that fade.

        Raises
        ------
        ValueError
            If values, factors or vectors are missing, or are for another number of lights.
        """

    def operands(self, spans: Spans, constants: FrameConstants, highlights: bool) -> Operands:
        """Bit-accurate operands of every pixel, in the order of the spans.

        Parameters
        ----------
        spans : Spans
            Spans of one pixel or more, as `check` accepts them.
        constants : FrameConstants
            L and H of each light.
        highlights : bool
            Whether there is specular light.
        """
        left, right = (Fixed(self.END_FORMAT, codes) for codes in (spans.normal_left, spans.normal_right))
        vectors = [Fixed(COMPONENT, codes) for codes in (constants.direction, constants.halfway)]
        return self.compute(left, right, np.asarray(spans.length), *vectors)

    def geometry(self, lights: int) -> Geometry:
        """Geometry that makes the method's spans from triangles, for a number of lights.

        Raises
        ------
        ValueError
            If triangles do not give what the method takes.
        """
        return Geometry()

    def constants_for(self, scene: Scene, constants: Sequence[FrameConstants]) -> list[FrameConstants]:
        """Frame constants of each material, with L and H in the frame that the method takes."""
        return list(constants)

    def cut(self, cutter: SpanCutter) -> tuple[Raster, int]:
        """The spans of a frame, cut as the method needs them, and how many of those given were cut."""
        return cutter.by_error()

    def filled(self, filler: SpanFiller) -> Spans:
        """The beats of cut spans, with what the method takes."""
        return filler.with_normals()

    def exact_frame(self, shading: ExactShading) -> np.ndarray:
        """A frame by the method in exact arithmetic: float64 array, shape (height, width, 3)."""
        return shading.by_normals()

    def bound(self, bounds: ErrorBounds) -> float | None:
        """Bound of the error of a frame against exact normals, in LSB; ``None``: no bound is known."""
        return None

    def widest_span(self, exponent: int) -> float:
        """Largest angle of a span, in degrees, for good highlights at a specular exponent."""
        return self.MAX_ANGLE

    def operand_error(self, length: int, degrees: float) -> float:
        """Bound of the error of N·L and of N·H against the method's own curve in float64.

        Parameters
        ----------
        length : int
            Pixels of the span.
        degrees : float
            Angle of the span, up to `MAX_ANGLE`.
        """
        raise NotImplementedError

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
        raise NotImplementedError

    def exact_normals(self, normal_left: np.ndarray, normal_right: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Normals of the method's curve in float64, as `interpolate` gives them.

        Parameters
        ----------
        normal_left, normal_right : arrays, shape (..., 3)
            Unit normals of the span of each pixel.
        t : array, shape (...)
            Position of the pixel in its span, 0 to 1.
        """
        return interpolate(self.CURVE, normal_left, normal_right, t)


@dataclass(frozen=True)
class NormalInterpolator(Interpolator):
    """A method that computes normals, and the products of these with L and H.

    Parameters
    ----------
    operand : str
        ``"cosine"``: the operand of the specular unit is N·H. ``"one_minus_cosine"``: it is half the squared
        chord, ``|N - H|^2 / 2`` of `Chord`, in which the length of N counts only at second order.

    Raises
    ------
    ValueError
        If the operand is neither.
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
        """`normal_error`; with half the squared chord, as ``|N - H| <= 2``, twice the error, and the cut.

        On a curve of length r, where c is the cosine to H, half the squared chord is ``(1 - r)^2/2 + r (1 -
        c)``, which is at least ``r (1 - c)``. The lengths of the codes of N_l and H differ from 1.
        """
        if not self.uses_chord:
            return self.normal_error
        return 2 * (self.normal_error + 2 * CODE_LENGTH_ERROR) + Specular.ARGUMENT_FORMAT.step

    @property
    def shortest_normal(self) -> float:
        """`shortest_length` if the operand is half the squared chord, else 1."""
        return self.shortest_length if self.uses_chord else 1.0

    def normals(
        self, normal_left: Fixed, normal_right: Fixed, length: np.ndarray
    ) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate normals of every pixel, and which spans are out of range.

        Parameters
        ----------
        normal_left, normal_right, length
            As for `compute`.

        Returns
        -------
        normals : Fixed, shape (pixels, 3), SQ(1, 17)
        out_of_range : bool array, shape (spans,)
        """
        raise NotImplementedError

    def products(self, normals: Fixed, direction: Fixed, halfway: Fixed) -> tuple[Fixed, Fixed]:
        """N·L, exact, and the operand of the specular unit.

        This is N·H, exact, or half the squared chord, cut to 25 fraction bits.

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
        """Bit-accurate operands: products of the normals."""
        normals, out_of_range = self.normals(normal_left, normal_right, length)
        return Operands(*self.products(normals, direction, halfway), out_of_range)
