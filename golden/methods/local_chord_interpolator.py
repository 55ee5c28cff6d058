"""The chord method for point lights and a near viewer: three values of N·L and of the chord a span."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.cosines.chord_setup import ChordSetup, SpanValues
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.factor import Factor
from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.frame_steps import Bound, ErrorBounds, ExactShading, SpanCutter, SpanFiller
from blysk.golden.methods.interpolator import Interpolator, Operands
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.raster import Raster

if TYPE_CHECKING:
    from blysk.golden.geometry.geometry import Geometry

__all__ = ["METHODS", "LocalChordInterpolator"]


@dataclass(frozen=True)
class LocalChordInterpolator(Interpolator):
    """Operands ``N . L`` and ``u = |N - H|^2 / 2`` with L and H of the pixel itself, by two additions each.

    A span brings three values of N·L and three of u: at the first pixel centre, in the middle and at the last
    pixel centre. The source of the spans, which knows positions, computes these values. `ChordSetup` computes
    the quadratics through them, with a bound of the drift. Accumulators of 49 bits compute the pixels. The
    specular unit takes u as its ``1 - cos gamma``. In a span of one or two pixels each pixel has its own
    values, and needs no setup.

    The quadratic is good only for short spans. Cut spans until

    - the normals at their ends are at most 30 degrees apart;
    - at every pixel of a span of three pixels or more, and for every light, the errors are within the
      budgets.

    Each error is of the quadratic and its words together, at full reflection:

    - the error of N·L is within `DIFFUSE_BUDGET`;
    - the error of the specular term S is within `HIGHLIGHT_BUDGET`. S is computed at both ends of the
      interval in which the word of u may be;
    - where the word of N·L may have the wrong sign, the whole term S counts as error. Exact values within
      2^-25 of 0 are left out.

    The reference is exactly normalised interpolation. As every pixel is checked, no error exceeds its budget.
    `blysk.golden.frames.error_bound` has the bound of a frame.

    A light that fades, by its distance or as a spot, has a factor a. Its values of N·L contain the factor,
    ``a N·L``. At each pixel the factor multiplies the specular term of its light (`Factor`). The factor is a
    third quadratic of the light, in the formats of N·L. Its specular error is ``a |dS| + S |da|``. A light
    that fades may be brighter than white. If the largest channel of its colour is over 1, this channel
    multiplies all errors.

    ========== ========== ========================================
    word       format     why
    ========== ========== ========================================
    sums       SQ(3, 46)  hold u up to 2
    N·L        SQ(2, 25)  cut
    u          UQ(1, 25)  cut, saturates
    ========== ========== ========================================

    Parameters
    ----------
    fraction_bits : int
        Fraction bits of the setup's words.
    scale : int
        s. The words of u are ``min(2^s u, 1)``, for a lobe that is 0 from ``2^-s`` on. A small u keeps s bits
        more, at the cost of wires alone; see `Lobe.scale_of`.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Source: docs/theory/chord.md#local-lights, docs/theory/chord.md#differences.
    """

    fraction_bits: int = 46
    scale: int = 0

    operand: ClassVar = "one_minus_cosine"
    COSINE_FORMAT = SQ(2, 25)
    CURVE = "quadratic"
    HIGHLIGHT_BUDGET: ClassVar[float] = 0.2
    DIFFUSE_BUDGET: ClassVar[float] = 0.12

    def __post_init__(self) -> None:
        _ = self.setup
        ChordSetup.check_scale(self.scale)

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        return "chord-local"

    @cached_property
    def setup(self) -> ChordSetup:
        """Model of the setup."""
        return ChordSetup(self.fraction_bits)

    @property
    def value_setup(self) -> ChordSetup:
        """The setup of the method, see `setup`."""
        return self.setup

    def matched(self, specular: HighlightOperand | None) -> "LocalChordInterpolator":
        """The method itself.

        Raises
        ------
        ValueError
            If it has a scale, and the unit has no table.
        """
        if self.scale and not (specular and specular.has_table):
            raise ValueError("a scale of 1 - N·H needs a lobe with a table")
        return self

    def fitted(self, lobe: Lobe, parameters: Sequence[float | None]) -> "LocalChordInterpolator":
        """The method with the scale that suits sharp lobes, see `Lobe.scale_of`."""
        return replace(self, scale=lobe.scale_of(parameters))

    @property
    def serves_local(self) -> bool:
        """``True``: spans bring values of N·L and u of each light."""
        return True

    @property
    def given_values(self) -> bool:
        """``True``: spans bring three values of N·L and u of each light."""
        return True

    @property
    def word_choices(self) -> Sequence[int]:
        """Fraction bits of the differences."""
        return range(36, 47, 2)

    def with_words(self, fraction_bits: int) -> "LocalChordInterpolator":
        """The method with other differences, see `Interpolator.with_words`."""
        return replace(self, fraction_bits=fraction_bits)

    def shortest_words(self, longest: int) -> int | None:
        """Fraction bits of the differences that are enough, see `Interpolator.shortest_words`."""
        serving = (bits for bits in self.word_choices if longest <= ChordSetup(bits).longest)
        bits = min(serving, default=self.fraction_bits)
        return bits if bits < self.fraction_bits else None

    def input_lines(self, lights: int, highlights: bool, factors: Sequence[int]) -> list[str]:
        """Lines that describe the values of a span, see `Interpolator.input_lines`."""
        diffuse, highlight = ChordSetup.DIFFUSE_FORMAT, ChordSetup.HIGHLIGHT_FORMAT
        lines = [
            f"i_values: for each light three codes of N.L in {diffuse}, and three of 1 - N.H in {highlight},",
            "each times (1 - 2^-17)^2, at the first pixel, the middle, the last pixel; L and H are not read",
        ]
        if self.scale:
            lines.append(f"1 - N.H is times {1 << self.scale}, at most 1, also as argument of the table")
        if factors:
            one = len(factors) == 1
            lines += [
                f"i_factors: three codes of the factor a, 0 to 1, in {diffuse}, times (1 - 2^-17)^2, of "
                f"light{'' if one else 's'} {', '.join(map(str, factors))}, which fade{'s' if one else ''};",
                "their N.L in i_values is multiplied by a",
            ]
        return lines

    @property
    def lights_cut(self) -> bool:
        """``True``: a light cuts spans where its quadratics miss their tolerances."""
        return True

    def geometry(self, lights: int) -> "Geometry":
        """Raise `ValueError`, because triangles give no values."""
        raise ValueError(f"triangles give normals, and {self.name} takes values; use another method")

    def cut(self, cutter: SpanCutter) -> tuple[Raster, int]:
        """Spans cut until the quadratics keep their tolerances."""
        return cutter.by_error()

    def filled(self, filler: SpanFiller) -> Spans:
        """Spans with values of each light."""
        return filler.with_values()

    def exact_frame(self, shading: ExactShading) -> np.ndarray:
        """A frame by the quadratics through the values of spans, in exact arithmetic."""
        return shading.by_values(self.exact_operands)

    def bound(self, bounds: ErrorBounds[Bound]) -> Bound | None:
        """Bound from the budgets of every pixel."""
        return bounds.by_budget()

    def check(self, spans: Spans, lights: int, factors: int) -> None:
        """Refuse spans without values or factors for every light, see `Interpolator.check`."""
        if spans.values is None or spans.values.diffuse.shape != (len(spans), lights, 3):
            raise ValueError(f"method {self.name} takes spans with values for {lights} lights")
        shape = (len(spans), 0, 3) if spans.factors is None else spans.factors.shape
        if shape != (len(spans), factors, 3):
            raise ValueError(f"the design takes spans with factors for {factors} lights")

    def operands(self, spans: Spans, constants: FrameConstants, highlights: bool) -> Operands:
        """Bit-accurate operands from the values of spans, see `compute_values`.

        Without specular light u counts as 0. So no u is out of range.
        """
        if spans.values is None:
            raise ValueError(f"method {self.name} takes spans with values")
        values = spans.values
        if not highlights:
            values = values._replace(highlight=np.zeros_like(values.highlight))
        return self.compute_values(values, spans.length, spans.factors)

    @property
    def accumulators(self) -> dict[str, DifferenceAccumulator]:
        """Models of the accumulators: ``diffuse`` for N·L, ``highlight`` for u, ``factor`` for a."""
        format, difference = SQ(3, self.fraction_bits), self.setup.format
        starts = {"diffuse": ChordSetup.DIFFUSE_FORMAT, "highlight": ChordSetup.HIGHLIGHT_FORMAT}
        starts["factor"] = ChordSetup.DIFFUSE_FORMAT
        results = {"diffuse": self.COSINE_FORMAT, "highlight": Specular.ARGUMENT_FORMAT}
        results["factor"] = Factor.FORMAT
        return {
            name: DifferenceAccumulator(start, format, difference, results[name])
            for name, start in starts.items()
        }

    def widest_span(self, exponent: int) -> float:
        """Largest angle of a span, in degrees, for every light."""
        return 30.0

    def operand_error(self, length: int, degrees: float) -> float:
        """Error of the setup, for slopes up to 1/2 and squares up to 1/8, plus the results' dropped bits."""
        slope, curvature = np.asarray(0.5), np.asarray(0.125)
        errors = (f(slope, curvature) for f in (self.setup.highlight_error, self.setup.diffuse_error))
        return float(max(errors)) + Specular.ARGUMENT_FORMAT.step

    def compute_values(
        self, values: SpanValues, length: np.ndarray, factors: np.ndarray | None = None
    ) -> Operands:
        """Bit-accurate operands of every pixel, in the order of the spans.

        Parameters
        ----------
        values : SpanValues
            Values of each span and light. The values in the middle have an effect from 3 pixels on, the
            values at the end from 2.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.
        factors : int64 array, shape (spans, fading lights, 3), optional
            Codes of the factors of lights that fade, in the format of N·L.

        Raises
        ------
        ValueError
            If a code or a length is out of range.
        """
        length = np.asarray(length)
        given = tuple(values) if factors is None else (*values, factors)
        *quadratics, out_of_range = self.setup.compute(
            Fixed(ChordSetup.DIFFUSE_FORMAT, values.diffuse),
            Fixed(ChordSetup.HIGHLIGHT_FORMAT, values.highlight),
            length,
            None if factors is None else Fixed(ChordSetup.DIFFUSE_FORMAT, factors),
        )
        # Each pixel of a span of one or two pixels is treated as a span of its own.
        short = length < 3
        pieces, place = pixels_of(np.where(short, length, 1))
        pieces_short = short[pieces]
        pixels = pixels_of(np.where(pieces_short, 1, length[pieces]))
        results = []
        for quadratic, codes, model in zip(quadratics, given, self.accumulators.values(), strict=False):
            start = np.where(place[:, np.newaxis], codes[pieces, :, 2], codes[pieces, :, 0])
            first, second = (
                Fixed(word.format, np.where(pieces_short[:, np.newaxis], 0, word.codes[pieces]))
                for word in (quadratic.first, quadratic.second)
            )
            results.append(model.compute(Fixed(model.start_format, start), first, second, *pixels))
        cosine, highlight, *factor = results
        return Operands(cosine, highlight, out_of_range & ~short, *factor)

    def exact_operands(
        self, values: SpanValues, length: np.ndarray, factors: np.ndarray | None = None
    ) -> tuple[np.ndarray, ...]:
        """The quadratics through the values of spans, at every pixel; float64 in units of 1.

        Parameters
        ----------
        values : SpanValues
            Values of each span and light.
        length : int array, shape (spans,)
            Pixels.
        factors : int64 array, shape (spans, fading lights, 3), optional
            As for `compute_values`.

        Returns
        -------
        cosine, one_minus_cosine : float64 arrays, shape (pixels, lights)
            1 - N·H without the scale. The scale limits the values to ``2^-s``.
        factor : float64 array, shape (pixels, fading lights)
            Only if ``factors`` are given.
        """
        span, step = pixels_of(length)
        t = (step / np.maximum(length - 1, 1)[span])[:, np.newaxis]
        formats = [ChordSetup.DIFFUSE_FORMAT, ChordSetup.HIGHLIGHT_FORMAT, ChordSetup.DIFFUSE_FORMAT]
        results = []
        for codes, format in zip((*values, factors), formats, strict=True):
            if codes is None:
                continue
            left, middle, right = np.moveaxis(codes * (format.step / float(ONE_SQUARED.values)), 2, 0)
            square = 2 * (left + right - 2 * middle)
            slope = right - left - square
            results.append(left[span] + t * (slope[span] + t * square[span]))
        results[1] = np.ldexp(results[1], -self.scale)
        return tuple(results)


METHODS = {
    LocalChordInterpolator(): "no normals: N.L and 1 - N.H as quadratics; for point lights, a near viewer"
}
"""The method of this module, and a line about it."""
