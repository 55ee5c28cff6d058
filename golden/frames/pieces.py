"""Pieces of spans, and the distance of a method's curve from the exact values along a piece."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.frames.highlight_limits import HighlightLimits
from blysk.golden.frames.local import CHUNK, SurfacePoints, lines_along, weights_along
from blysk.golden.methods.interpolator import Interpolator
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.spans import pixels_of, runs_of
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = ["Pieces"]


@dataclass(frozen=True)
class Pieces:
    """Pixels ``first`` to ``last`` of spans ``origin``, with points of the surface."""

    scene: Scene
    raster: Raster
    origin: np.ndarray
    first: np.ndarray
    last: np.ndarray
    places: tuple[SurfacePoints, ...]
    """Points of each piece at t = 0, 1/4, 1/2, 3/4 and 1."""

    @classmethod
    def of(
        cls, scene: Scene, raster: Raster, origin: np.ndarray, first: np.ndarray, last: np.ndarray
    ) -> "Pieces":
        """Pieces with their points of the surface."""
        steps = np.maximum(raster.length[origin] - 1, 1)
        at = [(first + (last - first) * k / 4) / steps for k in range(5)]
        places = tuple(SurfacePoints.at(scene, raster, origin, t) for t in at)
        return cls(scene, raster, origin, first, last, places)

    def miss(self, interpolator: Interpolator, limits: HighlightLimits, material: np.ndarray) -> np.ndarray:
        """Whether the curve of a method is too far from the exact curve; bool, shape (pieces,)."""
        return self._scaled(interpolator)._miss(interpolator, limits, material)

    def off(
        self, interpolator: Interpolator, limits: HighlightLimits, material: np.ndarray, turn: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Whether the curve with its words is too far off, and whether the words alone are too far off."""
        turn = turn[:, np.newaxis]
        curves = {name: _Quadratic.of(self.places, name) for name in ("diffuse", "highlight")}
        words = {
            "diffuse": turn,
            "highlight": np.sqrt(2 * np.maximum(curves["highlight"].largest, 0)) * turn + turn**2 / 2,
        }
        if interpolator.curve_is_exact:
            misses = dict.fromkeys(curves, np.zeros_like(turn))
        else:
            misses = self._misses_of_normals(interpolator)
        margin = self._margin()[:, np.newaxis]
        curve = {name: margin * misses[name] for name in curves}

        def too_far(off: Mapping[str, np.ndarray], inner: np.ndarray) -> np.ndarray:
            least = np.maximum(curves["highlight"].least - inner, 0)
            wrong = off["diffuse"] > LocalChordInterpolator().diffuse_tolerance / limits.slope
            wrong = wrong | (off["highlight"] > limits.tolerance(material, least))
            found: np.ndarray = wrong & (curves["diffuse"].largest + off["diffuse"] >= 0)
            return found

        by_words = too_far(words, words["highlight"]) & (turn > limits.turn(material)[:, np.newaxis])
        if interpolator.curve_is_exact:
            return np.zeros(len(turn), dtype=bool), np.logical_or.reduce(by_words, axis=1)
        both = {name: curve[name] + words[name] for name in curves}
        inner = margin / LocalChordInterpolator.MARGIN * misses["highlight"] + words["highlight"]
        by_curve = too_far(both, inner).any(axis=1)
        by_curve |= self.places[0].turned(self.places[-1], LocalChordInterpolator())
        return by_curve & (self.last - self.first >= 2), np.logical_or.reduce(by_words, axis=1)

    def _scaled(self, interpolator: Interpolator) -> "Pieces":
        """The pieces with u of their places in the scale of the method's words."""
        scale = interpolator.scale
        return replace(self, places=tuple(place.scaled(scale) for place in self.places)) if scale else self

    def _miss(self, interpolator: Interpolator, limits: HighlightLimits, material: np.ndarray) -> np.ndarray:
        """Result of `miss`; u of the places has the scale of the method's words."""
        pixels = (self.last - self.first + 1)[:, np.newaxis]
        setup = interpolator.value_setup
        # Whether the span has pixels between the three (or two) places whose values its curve has.
        between = pixels > (3 if setup else 2)
        fading = np.array([light.fades for light in self.scene.lights], dtype=bool)
        names = ("diffuse", "highlight", "factor") if fading.any() else ("diffuse", "highlight")
        curves = {name: _Quadratic.of(self.places, name) for name in names}
        diffuse, highlight = curves["diffuse"], curves["highlight"]
        if setup:
            wrong = self._flagged(setup, curves)
            misses = {name: curve.miss(self.places, name) for name, curve in curves.items()}
        else:
            wrong = np.zeros(len(self.origin), dtype=bool)
            misses = self._misses_of_normals(interpolator)
        wrong |= between[:, 0] & self.places[0].turned(self.places[-1], LocalChordInterpolator())
        margin = self._margin()[:, np.newaxis]
        errors = {name: margin * miss for name, miss in misses.items()}
        if setup:
            errors["diffuse"] += setup.diffuse_error(*diffuse.sizes)
            errors["highlight"] += setup.highlight_error(*highlight.sizes)
        in_front = diffuse.largest + errors["diffuse"] >= 0
        least = np.maximum(highlight.least - margin / LocalChordInterpolator.MARGIN * misses["highlight"], 0)
        too_far = errors["diffuse"] > LocalChordInterpolator().diffuse_tolerance / limits.slope
        tolerance, lit = limits.tolerance(material, least), limits.is_lit(material, least)
        # If a light fades, every pixel is checked below.
        too_far |= (errors["highlight"] > tolerance) & ~fading
        wrong |= (too_far & in_front & between).any(axis=1)
        if fading.any():
            chosen = np.flatnonzero(between[:, 0] & ~wrong)
            shares = errors["highlight"][chosen] / tolerance[chosen], lit[chosen]
            wrong[chosen] = (self._fades_wrong(chosen, curves, *shares, limits.slope) & fading).any(axis=1)
        turns_dark = in_front & (diffuse.least - errors["diffuse"] <= 0) & lit
        chosen = np.flatnonzero(turns_dark.any(axis=1) & ~wrong)
        if setup:
            kept = self.origin, self.first, self.last, turns_dark
            curve = diffuse.left, diffuse.slope, diffuse.curvature
            given = (field[chosen] for field in (*kept, *curve))
            wrong[chosen] = _mistakes_sign(self.scene, self.raster, limits.slope, *given)
        return wrong

    def _fades_wrong(
        self,
        chosen: np.ndarray,
        curves: "Mapping[str, _Quadratic]",
        highlight_share: np.ndarray,
        lit: np.ndarray,
        slope: float,
    ) -> np.ndarray:
        """Whether a light's factor, or the factor times N·L, is too far off at any pixel of a piece.

        Parameters
        ----------
        chosen : int array
            Pieces.
        curves : dict of _Quadratic
            Curves ``diffuse`` and ``factor`` of all pieces.
        highlight_share : float64 array, shape (chosen, lights)
            Error of u as a share of its tolerance.
        lit : bool array, shape (chosen, lights)
            Whether a light may have a highlight.
        slope : float
            `HighlightLimits.slope`.

        Returns
        -------
        bool array, shape (chosen, lights)
        """
        method = LocalChordInterpolator()
        names = ("diffuse", "factor")
        curves = {name: curves[name].part(chosen) for name in names}
        origin, first, last = (field[chosen] for field in (self.origin, self.first, self.last))
        misses, largest = _misses_of_pixels(self.scene, self.raster, origin, first, last, curves)
        words = {name: method.setup.diffuse_error(*curve.sizes) for name, curve in curves.items()}
        # A light that fades may be brighter than white where it is near.
        bright = np.array([max(1.0, *light.color) for light in self.scene.lights])
        factor = np.where(lit, 255 * slope * bright * (misses["factor"] + words["factor"]), 0)
        total = factor + method.HIGHLIGHT_BUDGET * highlight_share * largest * bright
        wrong = slope * bright * (misses["diffuse"] + words["diffuse"]) > method.diffuse_tolerance
        found: np.ndarray = wrong | ((factor > method.FACTOR_BUDGET) | (total > method.HIGHLIGHT_BUDGET)) & (
            largest > 0
        )
        return found

    def _margin(self) -> np.ndarray:
        """Bound of the largest error on each piece, as a multiple of the error at its quarters.

        This is the largest of three numbers: `LocalChordInterpolator.MARGIN`, the ratio of the interpolated
        normals' lengths at the two ends, and the ratio of the weights there. If a ratio is large, nearly all
        change is near one end.
        """
        ends, steps = [], np.maximum(self.raster.length[self.origin] - 1, 1)
        for place in (self.first, self.last):
            at = self.raster, self.origin, place / steps
            ends.append([np.linalg.norm(lines_along(*at), axis=1), weights_along(*at).sum(axis=1)])
        smaller, larger = np.sort(ends, axis=0)
        ratio = np.divide(larger, smaller, out=np.full_like(larger, 1e9), where=smaller > 0).max(axis=0)
        found: np.ndarray = np.maximum(ratio, LocalChordInterpolator.MARGIN)
        return found

    def _flagged(self, setup: ChordSetup, curves: "Mapping[str, _Quadratic]") -> np.ndarray:
        """Whether ``chord-local`` may flag a piece. If ``False``, ``chord-local`` does not flag the piece."""
        one = float(ONE_SQUARED.values)
        formats = {"diffuse": setup.DIFFUSE_SLOPE_FORMAT, "highlight": setup.SLOPE_FORMAT}
        formats["factor"] = setup.DIFFUSE_SLOPE_FORMAT
        flagged = np.zeros(len(self.origin), dtype=bool)
        for name, curve in curves.items():
            slope, curvature = (one * size for size in curve.sizes)
            # One rounding step less than the words hold.
            flagged |= (curvature > 2.0 ** (setup.CURVATURE_FORMAT.integer_bits - 1) - 2.0**-19).any(axis=1)
            flagged |= (slope > 2.0 ** (formats[name].integer_bits - 1) - 2.0**-17).any(axis=1)
        return flagged

    def _misses_of_normals(self, interpolator: Interpolator) -> dict[str, np.ndarray]:
        """Largest errors of N·L and u of a method's normals, at the places `Interpolator.CHECKED_AT`."""
        left, right = self.places[0].normal, self.places[-1].normal
        misses = dict.fromkeys(("diffuse", "highlight"), np.zeros(()))
        known = {k / 4: place for k, place in enumerate(self.places)}
        steps = np.maximum(self.raster.length[self.origin] - 1, 1)
        for t in interpolator.CHECKED_AT:
            exact = known.get(t)
            if exact is None:
                at = (self.first + (self.last - self.first) * t) / steps
                exact = SurfacePoints.at(self.scene, self.raster, self.origin, at)
            normal = interpolator.exact_normals(left, right, np.full(len(left), t))
            own = exact.with_normal(normal, interpolator.uses_chord)
            for name in misses:
                misses[name] = np.maximum(misses[name], np.abs(getattr(own, name) - getattr(exact, name)))
        return misses


@dataclass(frozen=True)
class _Quadratic:
    """Quadratics ``left + t slope + t^2 curvature``, shape (pieces, lights), through three exact values."""

    left: np.ndarray
    slope: np.ndarray
    curvature: np.ndarray
    least: np.ndarray
    largest: np.ndarray

    @classmethod
    def of(cls, places: Sequence[SurfacePoints], name: str) -> "_Quadratic":
        """Quadratics through the values at t = 0, 1/2 and 1."""
        left, middle, right = (getattr(places[k], name) for k in (0, 2, 4))
        curvature = 2 * (left + right - 2 * middle)
        slope = right - left - curvature
        # The quadratic at its vertex, if the vertex is on the span.
        t = np.clip(-slope / np.where(curvature, 2 * curvature, 1.0), 0, 1)
        vertex = left + t * (slope + t * curvature)
        three = left, right, vertex
        return cls(left, slope, curvature, np.minimum.reduce(three), np.maximum.reduce(three))

    def part(self, chosen: np.ndarray) -> "_Quadratic":
        """The quadratics of some pieces."""
        kept = self.left, self.slope, self.curvature, self.least, self.largest
        return _Quadratic(*(field[chosen] for field in kept))

    def at(self, piece: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Values at t of pieces, shape (count, lights)."""
        t = t[:, np.newaxis]
        found: np.ndarray = self.left[piece] + t * (self.slope[piece] + t * self.curvature[piece])
        return found

    @property
    def sizes(self) -> tuple[np.ndarray, np.ndarray]:
        """Absolute values of the slope and curvature terms P and G."""
        return np.abs(self.slope), np.abs(self.curvature)

    def miss(self, places: Sequence[SurfacePoints], name: str) -> np.ndarray:
        """Largest distance from the exact values at t = 1/4 and 3/4."""
        found: np.ndarray = np.maximum.reduce(
            [
                np.abs(self.left + t * (self.slope + t * self.curvature) - getattr(places[k], name))
                for k, t in ((1, 0.25), (3, 0.75))
            ]
        )
        return found


def _pixels_of(
    scene: Scene, raster: Raster, origin: np.ndarray, first: np.ndarray, last: np.ndarray
) -> Iterator[tuple[np.ndarray, SurfacePoints, np.ndarray]]:
    """Index of the piece, exact values and t for every pixel of pieces, in chunks."""
    for run in runs_of(last - first + 1, CHUNK):
        span, step = pixels_of((last - first + 1)[run])
        of_pixel = run.start + span
        place = (first[of_pixel] + step) / (raster.length[origin[of_pixel]] - 1)
        exact = SurfacePoints.at(scene, raster, origin[of_pixel], place)
        yield of_pixel, exact, step / (last - first)[of_pixel]


def _misses_of_pixels(
    scene: Scene,
    raster: Raster,
    origin: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    curves: Mapping[str, _Quadratic],
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Largest distance of curves from the exact values at the pixels of pieces.

    Returns
    -------
    misses : dict of float64 array, shape (pieces, lights)
        Errors of ``diffuse``, where values under 0 count as 0. Errors of ``factor`` at pixels where the light
        is not behind the surface.
    largest : float64 array, shape (pieces, lights)
        Largest factor at these pixels; 0 without these pixels.
    """
    shape = len(origin), len(scene.lights)
    misses, largest = {name: np.zeros(shape) for name in curves}, np.zeros(shape)
    for of_pixel, exact, t in _pixels_of(scene, raster, origin, first, last):
        starts = np.flatnonzero(np.r_[True, of_pixel[1:] != of_pixel[:-1]])
        pieces = of_pixel[starts]
        fit = {name: curve.at(of_pixel, t) for name, curve in curves.items()}
        reached = exact.diffuse > -ChordSetup.DIFFUSE_FORMAT.step
        for values, of_all in (
            (np.abs(np.maximum(fit["diffuse"], 0) - np.maximum(exact.diffuse, 0)), misses["diffuse"]),
            (np.where(reached, np.abs(fit["factor"] - exact.factor), 0), misses["factor"]),
            (np.where(reached, exact.factor, 0), largest),
        ):
            of_all[pieces] = np.maximum.reduceat(values, starts)
    return misses, largest


def _mistakes_sign(
    scene: Scene,
    raster: Raster,
    transfer_slope: float,
    origin: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    lights: np.ndarray,
    left: np.ndarray,
    slope: np.ndarray,
    curvature: np.ndarray,
) -> np.ndarray:
    """Whether N·L of a pixel of a span might have the wrong sign, for the lights in ``lights``."""
    result = np.zeros(len(origin), dtype=bool)
    bound = ChordSetup().diffuse_error(np.abs(slope), np.abs(curvature))
    for of_pixel, exact, t in _pixels_of(scene, raster, origin, first, last):
        t = t[:, np.newaxis]
        fit = left[of_pixel] + t * (slope[of_pixel] + t * curvature[of_pixel])
        wrong = np.where(exact.diffuse > 0, fit <= bound[of_pixel], fit > -bound[of_pixel])
        # Nearer to 0, words do not tell the sign. A pixel that a fading light hardly reaches may be lit or
        # not.
        wrong &= np.abs(exact.diffuse) > ChordSetup.DIFFUSE_FORMAT.step
        least = LocalChordInterpolator.FACTOR_BUDGET / (255 * transfer_slope)
        wrong &= (exact.factor > least) & lights[of_pixel]
        result |= np.bincount(of_pixel, wrong.any(axis=1), len(origin)) > 0
    return result
