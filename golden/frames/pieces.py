"""Pieces of spans, and the distance of a method's curve from the exact values along a piece."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

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
        setup = interpolator.value_setup
        if setup is None:
            return self._miss(interpolator, limits, material)
        return self._miss_of_values(setup, interpolator.scale, limits, material)

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
            wrong = off["diffuse"] > limits.DIFFUSE_TOLERANCE / limits.slope
            wrong = wrong | (off["highlight"] > limits.tolerance(material, least))
            found: np.ndarray = wrong & (curves["diffuse"].largest + off["diffuse"] >= 0)
            return found

        by_words = too_far(words, words["highlight"]) & (turn > limits.turn(material)[:, np.newaxis])
        if interpolator.curve_is_exact:
            return np.zeros(len(turn), dtype=bool), np.logical_or.reduce(by_words, axis=1)
        both = {name: curve[name] + words[name] for name in curves}
        inner = margin / HighlightLimits.MARGIN * misses["highlight"] + words["highlight"]
        by_curve = too_far(both, inner).any(axis=1)
        by_curve |= self.places[0].turned(self.places[-1], limits)
        return by_curve & (self.last - self.first >= 2), np.logical_or.reduce(by_words, axis=1)

    def _miss(self, interpolator: Interpolator, limits: HighlightLimits, material: np.ndarray) -> np.ndarray:
        """Result of `miss` for a method of normals."""
        between = self.last - self.first >= 2
        curves = {name: _Quadratic.of(self.places, name) for name in ("diffuse", "highlight")}
        wrong = between & self.places[0].turned(self.places[-1], limits)
        misses, margin = self._misses_of_normals(interpolator), self._margin()[:, np.newaxis]
        errors = {name: margin * miss for name, miss in misses.items()}
        in_front = curves["diffuse"].largest + errors["diffuse"] >= 0
        nearer = margin / HighlightLimits.MARGIN * misses["highlight"]
        least = np.maximum(curves["highlight"].least - nearer, 0)
        too_far = errors["diffuse"] > limits.DIFFUSE_TOLERANCE / limits.slope
        too_far |= errors["highlight"] > limits.tolerance(material, least)
        found: np.ndarray = wrong | ((too_far & in_front).any(axis=1) & between)
        return found

    def _miss_of_values(
        self, setup: ChordSetup, scale: int, limits: HighlightLimits, material: np.ndarray
    ) -> np.ndarray:
        """Result of `miss` for a method of values, by every pixel of the pieces.

        The places at t = 1/4 and 3/4 find most of the pieces that are off. The other pieces are checked pixel
        by pixel.
        """
        places = tuple(place.scaled(scale) for place in self.places)
        fading = any(light.fades for light in self.scene.lights)
        names = ("diffuse", "highlight", "factor") if fading else ("diffuse", "highlight")
        curves = {name: _Quadratic.of(places, name) for name in names}
        wrong = self._flagged(setup, curves)
        judge = _Judge.of(self.scene, setup, curves, limits, material, scale)
        every, long = np.arange(len(wrong)), self.last - self.first >= 4
        for k, share in ((1, 0.25), (3, 0.75)):
            wrong |= long & judge.rejects(every, places[k], np.full(len(wrong), share))
        left = np.flatnonzero(~wrong)
        pixels = _pixels_of(
            self.scene, self.raster, *(of[left] for of in (self.origin, self.first, self.last))
        )
        for of_pixel, exact, t in pixels:
            off = judge.rejects(left[of_pixel], exact.scaled(scale), t)
            wrong[left[of_pixel[off]]] = True
        return wrong

    def _margin(self) -> np.ndarray:
        """Bound of the largest error on each piece, as a multiple of the error at its quarters.

        This is the largest of three numbers: `HighlightLimits.MARGIN`, the ratio of the interpolated
        normals' lengths at the two ends, and the ratio of the weights there. If a ratio is large, nearly all
        change is near one end.
        """
        ends, steps = [], np.maximum(self.raster.length[self.origin] - 1, 1)
        for place in (self.first, self.last):
            at = self.raster, self.origin, place / steps
            ends.append([np.linalg.norm(lines_along(*at), axis=1), weights_along(*at).sum(axis=1)])
        smaller, larger = np.sort(ends, axis=0)
        ratio = np.divide(larger, smaller, out=np.full_like(larger, 1e9), where=smaller > 0).max(axis=0)
        found: np.ndarray = np.maximum(ratio, HighlightLimits.MARGIN)
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

    def at(self, piece: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Values at t of pieces, shape (count, lights)."""
        t = t[:, np.newaxis]
        found: np.ndarray = self.left[piece] + t * (self.slope[piece] + t * self.curvature[piece])
        return found

    @property
    def sizes(self) -> tuple[np.ndarray, np.ndarray]:
        """Absolute values of the slope and curvature terms P and G."""
        return np.abs(self.slope), np.abs(self.curvature)


@dataclass(frozen=True)
class _Judge:
    """Tells at which places of pieces the light of ``chord-local`` may be off by more than its budgets.

    ``words`` bounds the errors of the words of each quadratic, shape (pieces, lights). ``brightness`` of a
    light multiplies its errors.
    """

    curves: Mapping[str, "_Quadratic"]
    words: Mapping[str, np.ndarray]
    limits: HighlightLimits
    material: np.ndarray
    fading: np.ndarray
    brightness: np.ndarray
    scale: int

    @classmethod
    def of(
        cls,
        scene: Scene,
        setup: ChordSetup,
        curves: Mapping[str, "_Quadratic"],
        limits: HighlightLimits,
        material: np.ndarray,
        scale: int,
    ) -> "_Judge":
        """Judge of the pieces with these curves and materials, and this scale of u."""
        words = {name: setup.diffuse_error(*curve.sizes) for name, curve in curves.items()}
        words["highlight"] = setup.highlight_error(*curves["highlight"].sizes)
        # A result is cut to the words of a pixel.
        words = {name: error + LocalChordInterpolator.COSINE_FORMAT.step for name, error in words.items()}
        fading = np.array([light.fades for light in scene.lights], dtype=bool)
        # A light that fades may be brighter than white where it is near.
        bright = [max(1.0, *light.color) if light.fades else 1.0 for light in scene.lights]
        return cls(curves, words, limits, material, fading, np.array(bright), scale)

    def rejects(self, piece: np.ndarray, exact: SurfacePoints, t: np.ndarray) -> np.ndarray:
        """Whether a light at t of pieces may be off by more than a budget; bool, shape (count,)."""
        method, share = LocalChordInterpolator, 1 / (255 * self.limits.slope * self.brightness)
        fit, words = self._fit("diffuse", piece, t), self.words["diffuse"][piece]
        off = np.abs(np.maximum(fit, 0) - np.maximum(exact.diffuse, 0)) + words
        found: np.ndarray = (off > method.DIFFUSE_BUDGET * share).any(axis=1)
        found |= (self._specular(piece, exact, t, fit, words) > method.HIGHLIGHT_BUDGET * share).any(axis=1)
        return found

    def _fit(self, name: str, piece: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Values of a quadratic in the unit of the words."""
        found: np.ndarray = float(ONE_SQUARED.values) * self.curves[name].at(piece, t)
        return found

    def _specular(
        self, piece: np.ndarray, exact: SurfacePoints, t: np.ndarray, cosine: np.ndarray, error: np.ndarray
    ) -> np.ndarray:
        """Largest errors of the specular terms, shape (count, lights); ``cosine`` is the fit of N·L."""
        material = self.material[piece]
        fit, words = self._fit("highlight", piece, t), self.words["highlight"][piece]
        term, near, far = (
            self.limits.reflect(material, np.ldexp(u, -self.scale))
            for u in (exact.highlight, fit - words, fit + words)
        )
        off = np.maximum(np.abs(near - term), np.abs(far - term))
        # Nearer to 0 than a step, words do not tell the sign of N·L.
        sure = np.abs(exact.diffuse) > ChordSetup.DIFFUSE_FORMAT.step
        off = np.where(sure & (cosine <= error), np.maximum(off, term), off)
        behind = np.where(sure & (cosine > -error), near, 0)
        off = np.where(exact.diffuse > 0, off, behind)
        if not self.fading.any():
            return off
        way = np.abs(self._fit("factor", piece, t) - exact.factor) + self.words["factor"][piece]
        largest = np.where((exact.diffuse > 0) | (behind > 0), np.maximum(term, np.maximum(near, far)), 0)
        whole: np.ndarray = exact.factor * off + np.where(self.fading, way * largest, 0)
        return whole


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
