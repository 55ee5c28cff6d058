"""Interpolators: models of the methods that compute the operands of the pixels of a span."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.build import BuildError
from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.frame_constants import NOT_READ, FrameConstants, LightMeanings
from blysk.golden.lighting.gate import Gate
from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.frame_steps import Bound, ErrorBounds, ExactShading, SpanCutter, SpanFiller
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE
from blysk.golden.number.fixed import Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

if TYPE_CHECKING:
    from blysk.golden.geometry.geometry import Geometry

__all__ = ["Interpolator", "Operand", "Operands"]

Operand = Literal["cosine", "one_minus_cosine"]
"""Kind of the operand of a specular unit, for methods that find normals: N·H, or 1 - N·H."""


class Operands(NamedTuple):
    """Operands of the diffuse and the specular unit of each light, for every pixel.

    Parameters
    ----------
    cosine : Fixed, shape (pixels, lights)
        N·L.
    highlight : Fixed, shape (pixels, lights)
        N·H, 1 - N·H, or the place in a lobe's table.
    out_of_range : bool array, shape (spans,)
        Whether the angle of the span is larger than the method serves. Then the operands of the span have no
        meaning.
    factor : Fixed, shape (pixels, fading lights), optional
        Factor of each light that fades, of methods with `Interpolator.serves_local`.
    """

    cosine: Fixed
    highlight: Fixed
    out_of_range: np.ndarray
    factor: Fixed | None = None


@dataclass(frozen=True)
class Interpolator(ABC):
    """A method that computes the operands of the pixels of spans. Each method is a subclass.

    A subclass states its formats; `compute` is its bit-accurate model, `exact_normals` its curve in float64.

    Attributes
    ----------
    COSINE_FORMAT : Format
        Format of N·L.
    COSINE_OF_ZERO : float
        N·L of equal unit vectors in exact arithmetic: 1, or `ONE_SQUARED`, the product of the codes of length
        1.
    MAX_ANGLE : float
        Largest angle, in degrees, of a span that the method serves. Most methods flag every span with a
        larger angle. The linear method flags a span with a component of ``N_r - N_l`` of 1 or more: none
        under 60 degrees, half of the spans at 75.
    CURVE : str
        The curve of `CURVES` on which the method's normals lie in exact arithmetic.
    ORIGIN : str
        Origin of the method, for tables: ``"documents"``, ``"own"``, or ``"baseline"``.
    END_FORMAT : Format
        Format of the normals at a span's ends: ``SQ(1, 17)`` for unit normals. Ends of the true line have
        lengths, relative to the larger length, and another format.
    CHECKED_AT : tuple of float
        Places t in a span at which the method's curve is compared with exact normals. The comparison decides
        whether the span is cut.
    """

    COSINE_FORMAT: ClassVar[Format] = DotProduct().result_format
    COSINE_OF_ZERO: ClassVar[float] = float(ONE_SQUARED.values)
    MAX_ANGLE: ClassVar[float] = MAX_SPAN_ANGLE
    CURVE: ClassVar[str] = "normalised"
    ORIGIN: ClassVar[Literal["documents", "own", "baseline"]] = "own"
    END_FORMAT: ClassVar[Format] = COMPONENT
    CHECKED_AT: ClassVar[tuple[float, ...]] = (0.25, 0.5, 0.75)

    @property
    @abstractmethod
    def name(self) -> str:
        """Name on the command line and in tables."""

    @property
    @abstractmethod
    def operand(self) -> Any:
        """Operand of the specular unit: ``"cosine"``, ``"one_minus_cosine"`` or ``"place"``."""

    @property
    def scale(self) -> int:
        """Scale s of the operand, see `Lobe`. If it is over 0, the specular unit takes ``min(2^s u, 1)``."""
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
        """Whether a gate can foresee the method's highlights; see `gate`."""
        return False

    @property
    def curve_is_exact(self) -> bool:
        """Whether the curve is exact, with perspective-correct normals. Then spans bring the true line."""
        return False

    @property
    def lights_cut(self) -> bool:
        """Whether each light that is on may cut spans, even if it lights no pixel: the curve has an error."""
        return False

    @property
    def lights_share_words(self) -> bool:
        """Whether the last bits of a light's operands depend on the other lights and on their highlights."""
        return False

    @property
    def serves_local(self) -> bool:
        """Whether L and H may differ from pixel to pixel: point lights, a near viewer, lights that fade."""
        return False

    @property
    def given_values(self) -> bool:
        """Whether spans bring values of each light. Then the pipeline does not compute these values."""
        return False

    @property
    def brings_ends(self) -> bool:
        """Whether spans bring normals at both ends, of length 1 or along the true line."""
        return False

    @property
    def serves_mirror(self) -> bool:
        """Whether the method finds highlights of R·V, and not of N·H alone."""
        return False

    @property
    def needs_table(self) -> bool:
        """Whether highlights come from a lobe's table, whatever the reflection model."""
        return False

    @property
    def divides_spans(self) -> bool:
        """Whether the cycles of a span depend on its normals."""
        return False

    @property
    def degrees(self) -> Sequence[int]:
        """Degrees that the method's polynomial can have, see `with_degree`; empty without a choice."""
        return ()

    @property
    def word_choices(self) -> Sequence[int]:
        """Fraction bits that the method's words can have, see `with_words`; empty without a choice."""
        return ()

    @property
    def light_meanings(self) -> LightMeanings:
        """Meaning of the vectors of a light among the frame constants."""
        return NOT_READ

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

    def with_degree(self, degree: int) -> "Interpolator":
        """The method with a polynomial of another degree.

        Raises
        ------
        ValueError
            If the degree is not one of `degrees`.
        """
        raise ValueError(f"method {self.name} has no polynomial of degree {degree}")

    def with_words(self, fraction_bits: int) -> "Interpolator":
        """The method with words of other fraction bits.

        Raises
        ------
        ValueError
            If the method has no `word_choices`.
        """
        raise ValueError(f"method {self.name} has no choice of words")

    def shortest_words(self, longest: int) -> int | None:
        """Fraction bits that are enough for spans up to a length.

        ``None`` if the method's words cannot be shortened.
        """
        return None

    def input_lines(self, lights: int, highlights: bool, factors: Sequence[int]) -> list[str]:
        """Lines for the header of the Verilog, which describe the contents of a span.

        Parameters
        ----------
        lights : int
            Number of lights, at least 1.
        highlights : bool
            Whether there is specular light.
        factors : sequence of int
            Indices of the lights that fade.
        """
        return []

    def matched(self, specular: HighlightOperand | None) -> "Interpolator":
        """The method for a specular unit; ``None``: without specular light.

        Raises
        ------
        ValueError
            If the method cannot feed the unit.
        """
        return self

    @property
    def serves_lanes(self) -> bool:
        """Whether a pipeline of the method can have several lanes."""
        return False

    def for_lanes(self, lanes: int, pairs: bool = True) -> "Interpolator":
        """The method for a pipeline with a number of lanes.

        Parameters
        ----------
        lanes : int
            Number of lanes.
        pairs : bool
            Whether spans come from software, which makes pairs for several lanes, see `QuotientLanes`.

        Raises
        ------
        BuildError
            If the method does not serve several lanes.
        """
        if lanes > 1:
            raise BuildError("lanes", f"method {self.name} makes single pixels", "take the method quotient")
        return self

    def sent(self, spans: Spans, constants: Sequence[FrameConstants] = (), highlights: bool = True) -> Spans:
        """Spans as the pipeline takes them, with the same pixels in the same order.

        With several lanes neighbouring spans may become one span, and spans may bring more words.

        Parameters
        ----------
        spans : Spans
            The spans.
        constants : sequence of FrameConstants
            Constants of each material, for words that depend on them. Empty: these words are left out.
        highlights : bool
            Whether there is specular light.
        """
        return spans

    def unit_for(self, specular: HighlightOperand) -> HighlightOperand:
        """The specular unit that has the model of a given unit and takes the method's operand, in its scale.

        Raises
        ------
        ValueError
            If no unit of the model takes the operand.
        """
        return specular.for_operand(self.operand, self.scale)

    def fitted(self, lobe: Lobe, parameters: Sequence[float | None]) -> "Interpolator":
        """The method for a lobe and the parameters of its tables, for spans that are cut for the method.

        Parameters
        ----------
        lobe : Lobe
            Specular unit.
        parameters : sequence of float or None
            Exponent or roughness of each table.
        """
        return self

    def gate(self, specular: HighlightOperand) -> Gate:
        """Model of the gate that foresees the method's highlights.

        Parameters
        ----------
        specular : HighlightOperand
            Model of the gated unit.

        Raises
        ------
        ValueError
            If the method does not serve a gate.
        """
        raise ValueError(f"method {self.name} has no error bound for a gate")

    def spans(self, lights: int, highlights: bool) -> QuotientSpans:
        """Model of the setup for spans with vectors.

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
        """Refuse spans that lack operands of the method.

        Parameters
        ----------
        spans : Spans
            The spans.
        lights, factors : int
            Number of lights, 1 at least, and number of fading lights.

        Raises
        ------
        ValueError
            If values, factors or vectors are missing, or are for another number of lights.
        """
        return None

    @abstractmethod
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

    def geometry(self, lights: int) -> "Geometry":
        """Geometry that makes the method's spans from triangles, for a number of lights.

        Raises
        ------
        ValueError
            If triangles cannot give the operands of the method.
        """
        raise ValueError(f"triangles do not give the operands of {self.name}; use another method")

    def constants_for(self, scene: Scene, constants: Sequence[FrameConstants]) -> list[FrameConstants]:
        """Frame constants of each material, with L and H in the frame that the method takes."""
        return list(constants)

    @abstractmethod
    def cut(self, cutter: SpanCutter) -> tuple[Raster, int]:
        """The spans of a frame, cut for the method, and the number of given spans that were cut."""

    def least_cut(self, cutter: SpanCutter) -> Raster:
        """The spans of a frame with as few cuts as the method's hardware can take, whatever the errors."""
        return cutter.uncut()

    def missed(self, cutter: SpanCutter, cut: Raster) -> int:
        """Number of spans after `cut` whose curve is off by more than a quarter of an LSB.

        It is 0 for a method whose `cut` looks at the error, or whose curve is exact.
        """
        return 0

    @abstractmethod
    def filled(self, filler: SpanFiller) -> Spans:
        """The beats of cut spans, with the operands of the method."""

    @abstractmethod
    def exact_frame(self, shading: ExactShading) -> np.ndarray:
        """A frame by the method in exact arithmetic: float64 array, shape (height, width, 3)."""

    def bound(self, bounds: ErrorBounds[Bound]) -> Bound | None:
        """Bound of the error of a frame or its pixels against exact normals, in LSB; ``None``: unknown."""
        return None

    def triangle_axes(self, scene: Scene, lights: int, highlights: bool) -> np.ndarray | None:
        """Axes of the frame for normals of triangles, by rows; ``None``: the axes of the scene.

        Parameters
        ----------
        scene : Scene
            Lights and viewer.
        lights : int
            Number of lights of the design.
        highlights : bool
            Whether there is specular light.

        Returns
        -------
        float64 array, shape (3, 3), or None
        """
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

    def highlight_error(
        self, unit: HighlightOperand, parameter: float | None, length: int, error: float
    ) -> float:
        """Bound of the error of a specular term against the method's own curve in float64.

        Parameters
        ----------
        unit : HighlightOperand
            The specular unit.
        parameter : float or None
            Exponent or roughness.
        length : int
            Pixels of the span.
        error : float
            Bound of the error of N·H, of `operand_error`.
        """
        return (parameter or 0) * error + unit.error

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
