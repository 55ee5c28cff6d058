"""Adaptive normaliser: a span is bisected until straight lines are good enough ([T] figure 2.7)."""

from dataclasses import dataclass, field

import numpy as np

from blysk.golden.normals.bisection import Bisection
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.reciprocal import reciprocal_address, reciprocal_table
from blysk.golden.number.spans import LENGTH_BITS, checked_lengths, pixels_of
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["AdaptiveNormaliser"]


@dataclass(frozen=True)
class AdaptiveNormaliser:
    """Normals of a span of m pixels, by linear interpolation over ``2^k`` equal arcs of its great circle.

    **Number of levels.** Points of a chord are too short by at most its sagitta. For ``2^k`` segments this is
    ``d_k = 1 - cos(psi/2^(k+1))``, and ``d_(k+1)`` is about ``d_k/4``. With ``q = (1 - cos psi)/4`` from the
    bisection unit, ``d_k <= (q + q^2) / 4^k``. This takes one square and wired shifts. The right side is too
    large by at most 6.7 % (k = 0 at 90 degrees), and never too small. k is the least number with
    ``(q + q^2) / 4^k <= threshold``. `depth` is k at 90 degrees.

    **Segment ends.** The bisection unit gives ``E_j`` at ``psi j / 2^k``, level by level.

    **Linear interpolators.** Pixel i lies at ``i 2^k / (m - 1)`` of a segment's length. The integer part is
    its segment j, computed in integers and exact for every m. The first pixel of a segment starts at
    ``E_j + phi (E_(j+1) - E_j)``, where phi is the fractional part, and every further pixel adds
    ``(E_(j+1) - E_j) 2^k/(m - 1)``. The last pixel is a segment of its own, so that both ends are exact.

    The published design extrapolates the end of the span instead. That design is not offered here;
    docs/theory/bounds.md#adaptive-normaliser gives three reasons.

    A span wider than the bisection's `max_angle` is flagged and stays undivided. Its normals lie on the
    straight line between its ends. (If the ends differ by more than 1 in a component, they lie near the left
    end.) Only its first and last pixel are defined.

    Ends must be of unit length, to 1/256 or so. A middle normal is made for unit ends, so normals between
    other ends are off by as much. An end of length 0 counts as 90 degrees away, and is not flagged.

    ================ ========== ==================================================================
    word             format     why
    ================ ========== ==================================================================
    q + q^2          SQ(2, 20)  a threshold of 2^-14 has 6 bits
    E_j              SQ(1, 17)  the bisection's results
    E_(j+1) - E_j    SQ(1, 17)  operand; saturates, but never with a threshold up to 1/8
    1/(m - 1)        UQ(0, 17)  table, with the shift of `reciprocal_address`
    phi              UQ(0, 17)  operand; cut
    N                SQ(2, 32)  cut; half a step of the result is added at the start; never wraps
    step             SQ(1, 32)  cut: 2^-32 a pixel, 9.5e-7 after 4095
    normal           SQ(1, 17)  rounded half up, saturates
    ================ ========== ==================================================================

    Against the great circle a normal is too short by at most ``threshold`` (plus 2^-19 by the rounding of q).
    It is never too long. For a segment of angle theta, ``theta^2 <= 8.1 threshold``, its direction is off by
    at most ``0.017 theta^3``. Against straight lines between the exact ends, `error` bounds the error of a
    component. The first and the last normal of a span are exact. Both bounds are derived in
    docs/theory/bounds.md#adaptive-normaliser.

    Parameters
    ----------
    threshold : float
        Largest length error, 2^-14 to 1/8; cut to 20 fraction bits.
    bisection : Bisection
        Model of the bisection unit.

    Raises
    ------
    ValueError
        If the threshold is out of range.

    Source: docs/theory/interpolation.md#adaptive-normaliser; [T] 2.1, figure 2.7, appendix Г.
    """

    threshold: float = 2.0**-10
    bisection: Bisection = field(default_factory=Bisection)

    SAGITTA_FORMAT = SQ(2, 20)
    ACCUMULATOR_FORMAT = SQ(2, 32)
    STEP_FORMAT = SQ(1, 32)
    RESULT_FORMAT = COMPONENT
    LENGTH_BITS = LENGTH_BITS

    def __post_init__(self) -> None:
        if not 2.0**-14 <= self.threshold <= 1 / 8:
            raise ValueError(f"threshold must be 2^-14 to 1/8, not {self.threshold!r}")

    @property
    def limits(self) -> Fixed:
        """Limits ``threshold 4^k``, k under `depth`. A span has a level for each limit under ``q + q^2``."""
        code = int(np.floor(np.ldexp(self.threshold, self.SAGITTA_FORMAT.fraction_bits)))
        q = (1 - np.cos(np.radians(self.bisection.max_angle))) / 4
        largest = (q + q * q) / self.SAGITTA_FORMAT.step
        count = 0
        while code << (2 * count) < largest:
            count += 1
        return Fixed(self.SAGITTA_FORMAT, code << (2 * np.arange(count, dtype=np.int64)))

    @property
    def depth(self) -> int:
        """Largest number of levels k."""
        return len(self.limits.codes)

    def end_error(self, levels: int, first_step: bool) -> float:
        """Error bound of a segment end's components, in a span with ``levels`` levels."""
        p = self.bisection
        length = 0.0
        for level in range(1, levels + 1):
            # Widest span of this level: the angle of a segment, doubled once for each level that follows.
            widest = np.degrees(np.sqrt(8.1 * self.threshold)) * 2.0 ** (levels - level + 1)
            first = first_step and level == 1
            length = max(length, 2 * p.model_error(first, widest) + 0.586 * length)
        return (
            length
            + 1.12 * (levels and p.arithmetic_error(first_step))
            + 1.12 * max(levels - 1, 0) * p.arithmetic_error(False)
        )

    def error(self, levels: int, first_step: bool) -> float:
        """Bound on the error of a component of a normal against straight lines between the exact ends."""
        difference = min(0.77, np.sqrt(8.1 * self.threshold))
        found: float = self.end_error(levels, first_step) + difference * 2.0**-16 + 4096 * 2.0**-32 + 2.0**-18
        return found

    def levels(self, one_minus_cosine: Fixed, out_of_range: np.ndarray) -> np.ndarray:
        """Number of levels k of spans, from results of the bisection unit.

        Parameters
        ----------
        one_minus_cosine : Fixed, any shape, SQ(2, 17)
            ``1 - cos psi``.
        out_of_range : bool array, same shape
            Whether the span is too wide to be divided.

        Returns
        -------
        int array, same shape
            0 to `depth`; 0 where ``out_of_range``.
        """
        operand = one_minus_cosine.saturate(COMPONENT)
        square = (operand * operand).scale(-4).truncate(20)
        sagitta = one_minus_cosine.scale(-2).extend(SQ(1, 20)) + square
        codes = sagitta.saturate(self.SAGITTA_FORMAT).codes[..., np.newaxis]
        return np.where(out_of_range, 0, (codes > self.limits.codes).sum(axis=-1))

    def compute(
        self, normal_left: Fixed, normal_right: Fixed, length: np.ndarray
    ) -> tuple[Fixed, np.ndarray, np.ndarray]:
        """Bit-accurate normals, in raster order.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (spans, 3), SQ(1, 17)
            Unit normals of the spans' ends.
        length : int array, shape (spans,)
            Pixels, 0 to 4095.

        Returns
        -------
        normal : Fixed, shape (pixels, 3), SQ(1, 17)
            Normals of all spans, one after the other.
        out_of_range : bool array, shape (spans,)
            Whether the span is wider than the bisection's `max_angle`.
        levels : int array, shape (spans,)
            Number of levels k.

        Raises
        ------
        ValueError
            If an operand has another format or a length is out of range.
        """
        length = checked_lengths(length, 0)
        whole = 1 << self.depth
        ends = np.zeros((len(length), whole + 1, 3), dtype=np.int64)
        ends[:, 0], ends[:, -1] = normal_left.codes, normal_right.codes
        _, u, out_of_range = self.bisection.compute(normal_left, normal_right)
        levels = self.levels(u, out_of_range)
        for level in range(1, self.depth + 1):
            active = np.flatnonzero(levels >= level)
            half = whole >> level
            before, after = ends[active, : -1 : 2 * half], ends[active, 2 * half :: 2 * half]
            middle, _, _ = self.bisection.compute(Fixed(COMPONENT, before), Fixed(COMPONENT, after))
            ends[active, half :: 2 * half] = middle.codes

        span, segment, offset, index = self.positions(length, levels)
        spacing = whole >> levels[span]
        left = Fixed(COMPONENT, ends[span, segment * spacing])
        right = Fixed(COMPONENT, ends[span, np.minimum((segment + 1) * spacing, whole)])
        difference = (right - left).saturate(COMPONENT)
        normal = self.walk(left, difference, length, levels, span, offset, index)
        return normal.truncate(COMPONENT.fraction_bits).saturate(COMPONENT), out_of_range, levels

    def positions(
        self, length: np.ndarray, levels: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Positions of pixels on the segments of their spans, in raster order.

        Parameters
        ----------
        length, levels : int array, shape (spans,)
            m and k.

        Returns
        -------
        span, segment : int array, shape (pixels,)
            Span of each pixel, and j, 0 to ``2^k``.
        offset : int array, shape (pixels,)
            ``phi (m - 1)`` of the first pixel of the segment.
        index : int array, shape (pixels,)
            Index of the pixel in its segment, from 0 on.
        """
        span, pixel = pixels_of(length)
        steps, level = np.maximum(length - 1, 1)[span], levels[span]
        segment = (pixel << level) // steps
        first_pixel = -((-segment * steps) >> level)
        return span, segment, (first_pixel << level) - segment * steps, pixel - first_pixel

    def walk(
        self,
        left: Fixed,
        difference: Fixed,
        length: np.ndarray,
        levels: np.ndarray,
        span: np.ndarray,
        offset: np.ndarray,
        index: np.ndarray,
    ) -> Fixed:
        """Bit-accurate sums of pixels along their segments.

        Parameters
        ----------
        left, difference : Fixed, shape (pixels, components), SQ(1, 17)
            ``E_j``, and ``E_(j+1) - E_j``.
        length, levels, span, offset, index
            Parameters and results of `positions`.

        Returns
        -------
        Fixed, shape (pixels, components), SQ(2, 32)
            Values before their last bits are dropped, with half a step of the result added.
        """
        reciprocal, shift = (x[span] for x in self.reciprocal(np.maximum(length - 1, 1)))
        phi = Fixed(COMPONENT, ((offset * reciprocal) << 1 >> shift)[:, np.newaxis])
        start = left + (difference * phi).truncate(32) + self.half_step
        steep = (difference * Fixed(COMPONENT, reciprocal[:, np.newaxis])).codes
        slope = Fixed(SQ(2, 34), steep >> np.maximum(shift - 1 - levels[span], 0)[:, np.newaxis]).truncate(32)
        walked = start.codes + index[:, np.newaxis] * slope.wrap(self.STEP_FORMAT).codes
        return Fixed(self.ACCUMULATOR_FORMAT, self.ACCUMULATOR_FORMAT.wrap(walked))

    @property
    def half_step(self) -> Fixed:
        """Half a step of the result. When it is added, a cut rounds half up."""
        return Fixed.round(self.ACCUMULATOR_FORMAT, COMPONENT.step / 2)

    def reciprocal(self, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Code of the reciprocal and shift s in ``1/steps = 2 reciprocal 2^-s``, for 1 to 4094 steps."""
        address, shift = reciprocal_address(steps)
        return reciprocal_table().codes[address], shift
