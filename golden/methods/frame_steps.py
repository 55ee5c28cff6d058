"""Steps of a frame: ways to cut, fill, shade exactly and bound spans, among which a method chooses.

`blysk.golden.frames` gives a method an object of each interface, for its scene and design. The method calls
the step that suits it.
"""

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.reference.raster import Raster

__all__ = ["Bound", "ErrorBounds", "ExactShading", "SpanCutter", "SpanFiller"]


class SpanCutter(Protocol):
    """Ways to cut the spans of a frame. Each gives the new spans, and how many given spans were cut."""

    def by_error(self) -> tuple[Raster, int]:
        """Cut until the method's curve keeps its tolerance, see `cut_by_error`."""

    def by_angle(self) -> tuple[Raster, int]:
        """Cut until no span is wider than `Interpolator.widest_span`, see `cut_by_angle`."""

    def by_length(self, largest_ratio: float) -> tuple[Raster, int]:
        """Cut until no pixel's N/W is too short compared with the longer end's N/W, see `cut_by_length`."""

    def by_ends(self, largest_ratio: float) -> tuple[Raster, int]:
        """Cut until the two ends of each span are alike, see `cut_by_ends`."""

    def uncut(self) -> Raster:
        """Leave the spans as they are given."""

    def split_pairs(self) -> Raster:
        """Divide each span of two pixels into two spans of one pixel. The other spans stay."""

    def missed(self, cut: Raster) -> int:
        """Number of cut spans that `by_error` would cut further, see `missed_spans`."""


class SpanFiller(Protocol):
    """Ways to fill the beats of cut spans."""

    def with_normals(self) -> Spans:
        """Unit normals at both ends."""

    def with_lines(self) -> Spans:
        """Ends of the true line, with their lengths."""

    def with_values(self) -> Spans:
        """Values of N·L, of u and of the factors at three places."""

    def with_vectors(self) -> Spans:
        """Vectors ``N/W`` in the frames of the lights; none without lights."""


class ExactShading(Protocol):
    """Ways to shade a frame by a method in exact arithmetic; float64 arrays, shape (height, width, 3)."""

    def by_normals(self) -> np.ndarray:
        """Shade by `Interpolator.exact_normals` of the unit normals at both ends."""

    def by_lines(self) -> np.ndarray:
        """Shade by `Interpolator.exact_normals` of the ends of the true line."""

    def by_values(self, exact_operands: Callable[..., tuple[np.ndarray, ...]]) -> np.ndarray:
        """Shade by operands from the values of spans, see `LocalChordInterpolator.exact_operands`."""


Bound = TypeVar("Bound", covariant=True)
"""Bound of a frame, or of each of its pixels."""


class ErrorBounds(Protocol[Bound]):
    """Ways to bound the error of a frame or of its pixels, in LSB; ``None`` where no bound is known."""

    def by_tolerance(self) -> Bound | None:
        """Bound from the tolerances of cut spans, see `error_bound`."""

    def by_budget(self) -> Bound | None:
        """Bound from the budgets that every pixel of cut spans keeps, see `error_bound`."""

    def by_vectors(self) -> Bound | None:
        """Bound from the vectors of the spans, see `quotient_bound`."""
