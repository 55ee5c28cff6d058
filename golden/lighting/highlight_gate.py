"""Bit-accurate model of the highlight gate, which stops spans without a visible highlight."""

from dataclasses import dataclass, field

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.lighting.gate import Gate
from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.specular import Specular
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED

__all__ = ["GateLimits", "HighlightGate"]


@dataclass(frozen=True)
class GateLimits:
    """Bounds of a method, for its spans up to an angle. A highlight gate relies on them.

    Let c be the largest cosine to H on the arc of the great circle from N_l to N_r, in units of
    `ONE_SQUARED`. No pixel has an N·H over ``c + excess``, or a 1 - N·H under ``shortest (1 - c) - excess``.

    Parameters
    ----------
    excess : float
        Bound of the excess of N·H over the N·H of the great circle.
    shortest : float
        Least length of a normal on the method's curve. It is 1 without chords to H.
    angle : float
        Largest angle of a span, in degrees, for which both bounds hold, up to 45.
    """

    excess: float
    shortest: float
    angle: float


@dataclass(frozen=True)
class HighlightGate(Gate):
    """Decides whether a span may be lit, from ``a = N_l . H``, ``b = N_r . H`` and ``u = 1 - N_l . N_r``.

    The largest ``N . H`` along the great circle from ``N_l`` to ``N_r``, psi apart, is inside the arc if
    ``b > a cos psi`` and ``a > b cos psi``. Else it is at an end. Inside it is
    ``M = sqrt(a^2 + b^2 - 2 a b cos psi) / sin psi``. With ``cos psi = 1 - u`` and d = a - b this is
    ``M^2 = (d^2 + 2 a b u) / (u (2 - u))``. Nothing cancels there as psi tends to 0. The condition is
    ``max(a, b) u > |d|``. A span is lit if

    - it is wider than 45 degrees or than `GateLimits.angle`, or
    - ``max(a, b)^2 >= T``, or
    - ``max(a, b) u > |d|`` and ``d^2 >= u w``, with ``w = 2 T - 2 a b - T u``: that is ``M^2 >= T``.

    T is the square of a threshold on N·H, from a PROM addressed by the exponent. The unit needs no root and
    no division.

    ======== ============= ===============================================================================
    word     format        why
    ======== ============= ===============================================================================
    a, b     UQ(0, F)      cut, one step added; 0 where negative, saturated at the top
    u        UQ(-1, F+1)   cut, three steps added
    T        UQ(0, F)      cut; 0: every span is lit
    w        UQ(1, F-1)    cut; if it is not positive, ``d^2 >= u w`` holds
    products F + F bits    exact, like the comparisons
    ======== ============= ===============================================================================

    F is 17. Smaller words serve to check the decision exhaustively.

    **No pixel of a span that is not lit has a specular term other than 0**, for unit normals and H from
    `quantise`. A term of 0 changes no channel, so the picture is the same to the bit.
    docs/theory/bounds.md#gate-of-unit-normals proves it, with `GateLimits.excess` rounded up to whole steps
    (`margin`).

    The margins cost little: with quadratic normals a span is lit only if
    ``M^2 >= tau^2 - 10 * 2^-17``. Ends must be unit vectors from `quantise`;
    docs/theory/bounds.md#gate-of-unit-normals describes other vectors.

    If an exponent has terms over 0 down to N·H = tau <= 0, T is 0 and every span is lit. This holds for
    exponent 1, and for 2 and 3 with models of wide highlights.

    Parameters
    ----------
    limits : GateLimits
        Bounds of the method that computes the operands of the pixels.
    specular : Specular or Power
        Model of the gated unit.
    fraction_bits : int
        F, 5 to 17.

    Raises
    ------
    ValueError
        If the number of bits is out of range.

    Source: docs/theory/units.md#highlight-gate; [T] 4.2 and figure 4.10.
    """

    limits: GateLimits
    specular: HighlightOperand = field(default_factory=Specular)
    fraction_bits: int = 17

    def __post_init__(self) -> None:
        if not 5 <= self.fraction_bits <= 17:
            raise ValueError(f"fraction_bits must be 5 to 17, not {self.fraction_bits}")

    @property
    def margin(self) -> float:
        """Excess of the method, rounded up to whole steps of 2^-17."""
        return float(np.ceil(self.limits.excess * 2.0**17) * 2.0**-17)

    @property
    def component_format(self) -> Format:
        """Format of the components of normals and H."""
        return SQ(1, self.fraction_bits)

    @property
    def dot_product(self) -> DotProduct:
        """Parameters of the dot products."""
        return DotProduct(self.component_format, self.component_format)

    @property
    def one_squared(self) -> Fixed:
        """Dot product of a unit vector with itself."""
        one = Fixed(self.component_format, self.component_format.max_code)
        return one * one

    @property
    def level_format(self) -> Format:
        """Format of a, b and T."""
        return UQ(0, self.fraction_bits)

    @property
    def angle_format(self) -> Format:
        """Format of u."""
        return UQ(-1, self.fraction_bits + 1)

    @property
    def widest(self) -> Fixed:
        """Largest cut ``u`` for which the exact u is surely less than u of `GateLimits.angle`."""
        limit = self.one_squared.values * (1 - np.cos(np.radians(self.limits.angle)))
        return Fixed(self.angle_format, int(limit / self.angle_format.step) - 1)

    @property
    def threshold_format(self) -> Format:
        """Format of T, see `level_format`."""
        return self.level_format

    def thresholds_of(self, last_lit_arguments: np.ndarray) -> Fixed:
        """T from the largest arguments with a term over 0, in steps of 2^-25; see also `LobeTable`."""
        nearest = (np.asarray(last_lit_arguments) + 1) * 2.0**-25
        level = float(ONE_SQUARED.values) - (nearest + self.margin) / self.limits.shortest
        # The level is in steps of 2^-34. A step is subtracted, because the level's quotient is not exact.
        steps = np.floor(level * 2.0**34).astype(np.int64) - 1
        # Squares of 34 bits outgrow an int64.
        codes = [max(code, 0) ** 2 >> (68 - self.fraction_bits) for code in steps.tolist()]
        return Fixed(self.level_format, codes)

    def decide(self, a: Fixed, b: Fixed, u: Fixed, threshold: Fixed) -> np.ndarray:
        """Whether the maximum over the arc may reach the threshold, by the comparisons alone.

        Parameters
        ----------
        a, b : Fixed, any shape, UQ(0, F)
            N·H at the ends, rounded up.
        u : Fixed, same shape, UQ(-1, F+1)
            One minus the cosine of the angle between the normals at the ends, rounded up.
        threshold : Fixed, same shape, UQ(0, F)
            T.

        Returns
        -------
        bool array, same shape
        """
        f = self.fraction_bits
        large = np.maximum(a.codes, b.codes)
        difference = np.abs(a.codes - b.codes)
        inside = large * u.codes > difference << (f + 1)
        slack = (threshold.codes << (f + 2)) - threshold.codes * u.codes - (a.codes * b.codes << 2)
        slack = slack >> (f + 2)
        reached = (slack <= 0) | (difference * difference >= u.codes * slack)
        found: np.ndarray = (large * large >= threshold.codes << f) | (inside & reached)
        return found

    def compute(
        self, normal_left: Fixed, normal_right: Fixed, halfway: Fixed, exponent: int | np.ndarray
    ) -> np.ndarray:
        """Bit-accurate decisions.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (spans, 3), SQ(1, F)
            Unit normals of the ends.
        halfway : Fixed, shape (3,) or (spans, 3), SQ(1, F)
            Unit half-way vector.
        exponent : int or int array, shape (spans,)
            1 to 1000.

        Returns
        -------
        bool array, shape (spans,)
            False: every pixel of the span has a specular term of 0.

        Raises
        ------
        ValueError
            If an operand has another format or an exponent is out of range.
        """
        return self.compute_by(normal_left, normal_right, halfway, self.thresholds_at(exponent))

    def lit(self, spans: Spans, halfway: np.ndarray, threshold: Fixed) -> np.ndarray:
        """Bit-accurate decisions from the unit normals of spans, see `Gate.lit`."""
        left, right = (Fixed(COMPONENT, codes) for codes in (spans.normal_left, spans.normal_right))
        lit = [self.compute_by(left, right, Fixed(COMPONENT, codes), threshold) for codes in halfway]
        return np.stack(lit, axis=-1)

    def compute_by(
        self, normal_left: Fixed, normal_right: Fixed, halfway: Fixed, threshold: Fixed
    ) -> np.ndarray:
        """Decisions as by `compute`, from thresholds T in place of exponents, of shape () or (spans,)."""
        dot = self.dot_product.compute
        cosine = dot(normal_left, normal_right)
        return self.decide_by(cosine, dot(normal_left, halfway), dot(normal_right, halfway), threshold)

    def decide_by(self, cosine: Fixed, left: Fixed, right: Fixed, threshold: Fixed) -> np.ndarray:
        """Decisions from dot products: of both normals, of the left normal and H, of the right normal and H.

        Parameters
        ----------
        cosine, left, right : Fixed, any shape
            Dot products from `dot_product`.
        threshold : Fixed, shape () or the same, UQ(0, F)
            T.

        Returns
        -------
        bool array, same shape
        """
        angle = self.angle_format
        cut = (self.one_squared - cosine).truncate(angle.fraction_bits).saturate(angle)
        u = Fixed(angle, np.minimum(cut.codes + 3, angle.max_code))
        found: np.ndarray = (cut > self.widest) | self.decide(
            self._level(left), self._level(right), u, threshold
        )
        return found

    def _level(self, cosine: Fixed) -> Fixed:
        step = Fixed(self.level_format, 1)
        return (cosine.truncate(self.fraction_bits) + step).saturate(self.level_format)
