"""The quotient method: exact highlights and N·L from quotients of quadratics, without a unit normal."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.cosines.quotient import Quotient
from blysk.golden.cosines.quotient_lanes import QuotientLanes, separate_pairs
from blysk.golden.cosines.quotient_spans import MARGIN, QuotientSpans, SpanVectors
from blysk.golden.frame_constants import NOT_READ, FrameConstants, LightMeanings
from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.methods.frame_steps import Bound, ErrorBounds, ExactShading, SpanCutter, SpanFiller
from blysk.golden.methods.interpolator import Interpolator, Operands
from blysk.golden.number.fixed import Format
from blysk.golden.number.spans import pixels_of
from blysk.golden.reference.light_frame import light_frames
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.reflection import ReflectionModel
from blysk.golden.reference.scene import Scene

if TYPE_CHECKING:
    from blysk.golden.geometry.geometry import Geometry

__all__ = ["METHODS", "QuotientErrors", "QuotientInterpolator"]


@dataclass(frozen=True)
class QuotientInterpolator(Interpolator):
    """Exact N·L and highlights from ``v = N/W``, without a unit normal: quotients of quadratics.

    v is linear on the screen. A highlight is the place of ``sin^2 gamma`` in a lobe's table. `QuotientSpans`
    computes the words of each pixel by forward differences, `Quotient` the operands. The curve is exact:
    normals are those of a perspective-correct interpolation, at every angle and width.

    A source of spans has to halve a span of three pixels or more, and to split a span of two pixels, if

    - the lengths of v at its ends differ by more than a factor of `ENDS_RATIO`;
    - or the angle between the ends is over 90 degrees.

    Then ``|v|`` is at least ``1/(2 sqrt(5))`` at every pixel, in the scale of the words. `SpanHalver` cuts by
    another rule, with the same promise.

    Parameters
    ----------
    mirror : bool
        Whether the highlight is Phong's, of R·V, in place of N·H.
    pairs : bool
        Whether a span of two pixels is a pair, see `QuotientLanes`. A pipeline with several lanes takes
        pairs from software, and spans without pairs from hardware geometry.

    Source: docs/theory/quotient.md.
    """

    mirror: bool = False
    pairs: bool = False

    operand: ClassVar = "place"
    COSINE_FORMAT = Quotient.COSINE_FORMAT
    MAX_ANGLE = 180.0
    CURVE = "normalised"
    ENDS_RATIO: ClassVar[float] = 2.0
    SHORTEST: ClassVar[float] = 1 / (2 * 5**0.5)

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        return "quotient"

    @property
    def highlight_format(self) -> Format:
        """Format of a place in a lobe's table."""
        return Quotient(self.spans(1, True)).place_format

    @property
    def curve_is_exact(self) -> bool:
        """``True``: vectors have the lengths of the true line."""
        return True

    @property
    def serves_mirror(self) -> bool:
        """``True``: `matched` takes the kind of highlight from the unit's model."""
        return True

    @property
    def needs_table(self) -> bool:
        """``True``: the operand is a place in the table."""
        return True

    @property
    def serves_lanes(self) -> bool:
        """``True``, with pairs."""
        return True

    @property
    def lights_share_words(self) -> bool:
        """``True``: vectors of all lights have one exponent, and q of the first light serves all."""
        return True

    @property
    def light_meanings(self) -> LightMeanings:
        """Texts for L in the frame of the light, where H is z."""
        if self.pairs:
            return NOT_READ
        return LightMeanings("sin a, 0, cos a of the light's frame", "not read", "2^17 - 2")

    def matched(self, specular: HighlightOperand | None) -> "QuotientInterpolator":
        """The method with the kind of highlight of a unit's model."""
        mirror = specular is not None and specular.reflection.MIRROR
        return self if mirror == self.mirror else replace(self, mirror=mirror)

    def for_lanes(self, lanes: int, pairs: bool = True) -> "QuotientInterpolator":
        """The method, with pairs for several lanes, if the source of spans makes pairs."""
        pairs = pairs and lanes > 1
        return self if pairs == self.pairs else replace(self, pairs=pairs)

    def sent(self, spans: Spans, constants: Sequence[FrameConstants] = (), highlights: bool = True) -> Spans:
        """Spans with pairs and lines, if the pipeline takes pairs.

        Two neighbours of one pixel each become a pair. Each span brings its lines, see `QuotientLanes`.
        """
        if not self.pairs or spans.vectors is None:
            return spans
        joined = self._joined(spans)
        if not len(constants) or joined.vectors is None:
            return joined
        direction = np.stack([np.asarray(of.direction)[:, ::2] for of in constants])
        return replace(
            joined, vectors=self.with_lines(joined.vectors, direction[joined.material], highlights)
        )

    def with_lines(self, vectors: SpanVectors, direction: np.ndarray, highlights: bool) -> SpanVectors:
        """Vectors with the lines that a pipeline with several lanes takes, if there are highlights.

        ``direction`` has codes of sin a and cos a, shape (lights, 2) or (spans, lights, 2).
        """
        lights = direction.shape[-2]
        return QuotientLanes(lights, highlights, self.mirror and highlights).with_lines(vectors, direction)

    def _joined(self, spans: Spans) -> Spans:
        """Spans in which two neighbours of one pixel each are a pair."""
        assert spans.vectors is not None
        after = [np.asarray(column)[1:] for column in (spans.x, spans.y, spans.length, spans.material)]
        x, y, length, material = (
            np.asarray(column)[:-1] for column in (spans.x, spans.y, spans.length, spans.material)
        )
        joins = (length == 1) & (after[2] == 1) & (after[0] == x + 1)
        joins &= (after[1] == y) & (after[3] == material)
        # Of a row of neighbours the first two are a pair, then the next two.
        begins = np.flatnonzero(joins & ~np.r_[False, joins[:-1]])
        place = np.arange(len(joins))
        place -= begins[np.maximum(np.searchsorted(begins, place, "right") - 1, 0)] if len(begins) else 0
        first = np.flatnonzero(joins & (place % 2 == 0))
        given = spans.vectors
        vectors = SpanVectors(given.start.copy(), given.step.copy(), given.exponent.copy())
        vectors.step[first], vectors.exponent[first] = vectors.start[first + 1], 0
        lengths = np.array(spans.length)
        lengths[first] = 2
        kept = np.ones(len(spans), dtype=bool)
        kept[first + 1] = False
        return replace(spans, length=lengths, vectors=vectors)[kept]

    def unit_for(self, specular: HighlightOperand) -> HighlightOperand:
        """The unit, if it takes places. Else a `QuotientLobe` of its model, with the same tables."""
        if specular.operand == self.operand:
            return specular
        return QuotientLobe(specular.reflection, **specular.table_options)

    def input_lines(self, lights: int, highlights: bool, factors: Sequence[int]) -> list[str]:
        """Lines that describe vectors and their frames, see `Interpolator.input_lines`."""
        model, written = self.spans(lights, highlights), highlights and not self.pairs
        mirrored = (
            ["i_start: y_k is times cos a of light k; s0 is y of light 0 times its sin a"]
            if model.mirror
            else []
        )
        axes = (
            [
                "Frame of light k, L and V unit vectors to it and to the viewer: z = (L + V)/|L + V|,",
                "x = (L - V)/|L - V|, y = cross product z x x. "
                "So L = (sin a, 0, cos a), V = (-sin a, 0, cos a).",
                "L = V: any x across z, sin a = 0. L = -V: x = L, any z across x, cos a = 0"
                + ("." if model.mirror else ", specular colour 0."),
            ]
            if highlights
            else [
                "Frame of light 0: z = L, x and y across it. "
                "Of a further light z = L alone. L, H are not read."
            ]
        )
        # The header of a core that takes triangles leaves out lines that begin with ``i_``.
        return [
            *axes,
            "v = N/W, linear on the screen: each corner's normal divided by its W, interpolated.",
            f"i_start: components {', '.join(model.components)} of v at the first pixel centre, "
            f"in {model.COMPONENT_FORMAT}, above -1",
            *mirrored,
            "i_start: scale both ends of a span by one factor, so that the largest component at an end is "
            f"1/2 to 1 - {MARGIN} 2^-17; at 1 it would wrap",
            "i_step: the same components of (v at the last pixel - v at the first)/(length - 1), "
            "times 2^i_exponent",
            "i_exponent: the largest with which i_step fits, at most ceil(log2(length - 1)) + 3",
            "i_length: halve a span if |v| at its ends differs by a factor over 2, or if the ends are over "
            "90 degrees apart",
            *(
                [
                    "i_length 2 is a pair: i_start and i_step are v at both pixels, each in a scale of its "
                    "own; i_exponent is not read",
                    *self._line_lines(highlights),
                ]
                if self.pairs
                else ["i_length: divide a span of two pixels into two spans of one pixel, whose step is 0"]
            ),
            "i_length: after these cuts no |v| is under 1/128; a span with a shorter v is wrong, "
            "and counted in status_out_of_range_spans",
            *([f"constants: as L write sin a, 0, cos a, times {model.ONE}; H is not read"] * written),
        ]

    @staticmethod
    def _line_lines(highlights: bool) -> list[str]:
        """Lines that describe the lines that spans bring, for several lanes."""
        if not highlights:
            return []
        model = QuotientLanes()
        return [
            f"sine, cosine: sin a and cos a of light k, times {model.ONE}, rounded; L, H are not read",
            "i_line: for light k the exact number x_k sine + z_k cosine, with the codes of i_start, "
            f"in {model.EXACT_LINE_FORMAT}",
            "i_line_step: the same number, with the codes of i_step",
        ]

    def geometry(self, lights: int) -> "Geometry":
        """Geometry that makes vectors. With several lights it turns them."""
        # Commands that build no geometry start without its files.
        from blysk.golden.geometry.geometry import Geometry

        return Geometry(vectors=True, rotates=lights > 1)

    def constants_for(self, scene: Scene, constants: Sequence[FrameConstants]) -> list[FrameConstants]:
        """Constants with L in the frame of each light, and without H. L of a light that is off is 0."""
        lights = len(constants[0].direction)
        codes = np.zeros((lights, 3), dtype=np.int64)
        for index, frame in enumerate(light_frames(scene, lights)[: len(scene.lights)]):
            if scene.lights[index].is_on:
                codes[index] = np.rint(frame.direction * QuotientSpans.ONE)
        return [replace(of, direction=codes, halfway=np.zeros_like(codes)) for of in constants]

    def triangle_axes(self, scene: Scene, lights: int, highlights: bool) -> np.ndarray | None:
        """x, y and z of the first light's frame; without highlights z is along the light."""
        return light_frames(scene, 1)[0].axes_for(highlights) if lights else None

    def cut(self, cutter: SpanCutter) -> tuple[Raster, int]:
        """Spans cut until N/W at one end is at most `ENDS_RATIO` times as long as at the other end."""
        return cutter.by_ends(self.ENDS_RATIO)

    def least_cut(self, cutter: SpanCutter) -> Raster:
        """Spans of two pixels become two spans of one pixel, because their step would not fit."""
        return cutter.split_pairs()

    def filled(self, filler: SpanFiller) -> Spans:
        """Spans with vectors in the frame of each light."""
        return filler.with_vectors()

    def exact_frame(self, shading: ExactShading) -> np.ndarray:
        """A frame by normals on the true line, in exact arithmetic."""
        return shading.by_lines()

    def bound(self, bounds: ErrorBounds[Bound]) -> Bound | None:
        """Bound from the vectors of the spans, see `QuotientErrors`."""
        return bounds.by_vectors()

    def check(self, spans: Spans, lights: int, factors: int) -> None:
        """Refuse spans without vectors, see `Interpolator.check`."""
        if spans.vectors is None:
            raise ValueError(f"method {self.name} takes spans with vectors")

    def operands(self, spans: Spans, constants: FrameConstants, highlights: bool) -> Operands:
        """Bit-accurate operands from the vectors of spans, see `compute_vectors`."""
        if spans.vectors is None:
            raise ValueError(f"method {self.name} takes spans with vectors")
        direction = np.asarray(constants.direction)
        model = self.spans(len(direction), highlights)
        return self.compute_vectors(model, spans.vectors, np.asarray(spans.length), direction)

    def spans(self, lights: int, highlights: bool) -> QuotientSpans:
        """Model of the setup, for a number of lights, with or without specular light."""
        return QuotientSpans(lights, highlights, self.mirror and highlights)

    def compute_vectors(
        self, spans: QuotientSpans, vectors: SpanVectors, length: np.ndarray, direction: np.ndarray
    ) -> Operands:
        """Bit-accurate operands of every pixel, in the order of the spans.

        Parameters
        ----------
        spans : QuotientSpans
            From `spans`.
        vectors : SpanVectors
            Vectors of the spans.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.
        direction : int64 array, shape (lights, 3)
            Codes of L in the frame of each light; y has no effect.
        """
        span, spans_given = pixels_of(length)[0], len(length)
        if self.pairs:
            vectors, length, _ = separate_pairs(vectors, length)
        pixels = spans.compute(vectors, length, direction[:, ::2])
        cosine, place, too_small = Quotient(spans).compute(pixels)
        return Operands(cosine, place, np.bincount(span, too_small, spans_given) > 0)

    def highlight_error(
        self, unit: HighlightOperand, parameter: float | None, length: int, error: float
    ) -> float:
        """Bound from the words of the worst span and of the table, see `QuotientErrors.highlight`."""
        own = QuotientErrors.worst(length, self.mirror).highlight(unit.reflection, parameter)
        return own + unit.line_error(parameter) + unit.error

    def errors(self, vectors: SpanVectors, length: np.ndarray) -> "QuotientErrors":
        """Bounds of the errors of spans, see `QuotientErrors`."""
        return QuotientErrors.of(vectors, length, self.mirror)

    def operand_error(self, length: int, degrees: float) -> float:
        """Bound of the error of N·L for every span that is cut for the method."""
        return QuotientErrors.worst(length, self.mirror).cosine


@dataclass(frozen=True)
class QuotientErrors:
    """Bounds of the errors of the quotient method, for spans of exact vectors at their ends.

    i is the pixel. D is the largest component of the difference of the ends. D and eps are in units of 2^-17:

    - A component of v is off by at most ``eps = 1/2 + max(1/16, D 2^-17)``.
    - So the direction of v is off by at most ``asin(sqrt(3) eps / |v|)``.
    - The accumulators are off by at most ``(i + i^2/2) 2^-47``, and s by twice this, divided by q.
    - Words of a further light are rounded by themselves, and q comes from the first light. So q differs from
      ``|v|^2`` of the further light's words by the sum of both errors.

    docs/theory/quotient.md#bound proves these bounds.

    Parameters
    ----------
    angle : float
        Largest error of a normal's direction, in radians.
    turn : float
        Largest error of the highlight angle gamma (of N·H, or of R·V), in radians.
    drift : float
        Largest error of s by the accumulators.
    mismatch : float
        Largest relative difference of q from ``|v|^2`` of a light's own words. It is 0 for the first light.

    Source: docs/theory/quotient.md#bound.
    """

    angle: float
    turn: float
    drift: float
    mismatch: float = 0.0

    @classmethod
    def of(
        cls, vectors: SpanVectors, length: np.ndarray, mirror: bool = False, further: bool = False
    ) -> "QuotientErrors":
        """The largest bounds of some spans. At least one span is needed.

        Parameters
        ----------
        vectors : SpanVectors
            Vectors of the spans, one at least.
        length : int array, shape (spans,)
            Pixels.
        mirror : bool
            Whether the highlight is of R·V.
        further : bool
            Whether the bounds are for a further light.
        """
        # The components whose squares are q, in the frame of the first light.
        places = [0, 1, 2, -1] if mirror else [0, 1, 2]
        start = vectors.start[:, places].astype(np.float64)
        last = np.asarray(length, dtype=np.float64) - 1
        way = vectors.step * np.ldexp(last, -vectors.exponent)[:, np.newaxis]
        difference = np.where(last > 0, np.maximum(np.abs(way).max(axis=1) * 2.0**-17, 1 / 16), 0)
        way = way[:, places]
        # The shortest vector on the segment between the ends.
        square = np.einsum("si,si->s", way, way)
        t = np.clip(-np.einsum("si,si->s", start, way) / np.where(square, square, 1), 0, 1)
        shortest = np.linalg.norm(start + t[:, np.newaxis] * way, axis=1)
        component = 0.5 + difference
        own = component if further else None
        return cls.of_words(component, np.maximum(shortest - 3, 1), last, mirror, own)

    @classmethod
    def worst(cls, length: int, mirror: bool = False) -> "QuotientErrors":
        """Bounds that hold for every span up to a length, if the span is cut for the method.

        Parameters
        ----------
        length : int
            Pixels.
        mirror : bool
            Whether the highlight is of R·V.
        """
        shortest = QuotientInterpolator.SHORTEST * 2.0**17 - 3
        component, least, last = (np.array([value]) for value in (2.5, shortest, length - 1.0))
        return cls.of_words(component, least, last, mirror)

    @classmethod
    def of_words(
        cls,
        component: np.ndarray,
        shortest: np.ndarray,
        last: np.ndarray,
        mirror: bool = False,
        first: np.ndarray | None = None,
    ) -> "QuotientErrors":
        """The largest bounds of spans whose words have further errors besides their rounding.

        Parameters
        ----------
        component : float array, shape (spans,)
            Largest error of a component of v at any pixel, in steps of 2^-17.
        shortest : float array, shape (spans,)
            Lower bound of ``|v|`` of the words, in the same steps.
        last : float array, shape (spans,)
            Pixels less 1.
        mirror : bool
            Whether the highlight is of R·V.
        first : float array, shape (spans,), optional
            For a further light: ``component`` of the first light, whose words make q.
        """
        angle = np.arcsin(np.minimum(np.sqrt(3) * component / shortest, 1))
        # The angle between R and V changes twice as fast. The word of y cos a is rounded once more.
        turn = 2 * angle + 2 * np.sqrt(2) * (component + 0.5) / shortest if mirror else angle
        drift = 2 * (last + last**2 / 2) * 2.0**-13 / shortest**2
        mismatch = np.zeros(1)
        if first is not None:
            # Both y cos a and y sin a of the first light are rounded.
            longer = shortest + np.sqrt(3) * first + np.sqrt(0.5) * mirror
            mismatch = (longer / np.maximum(shortest - np.sqrt(3) * component, 1)) ** 2 - 1
        return cls(*(float(bound.max(initial=0)) for bound in (angle, turn, drift, mismatch)))

    @property
    def cosine(self) -> float:
        """Largest error of N·L, from the normal, the codes of L, and the words of a pixel."""
        words = 2.0**-16 + 2.0**-17.5 + Quotient.COSINE_ERROR
        found: float = self.angle + self.drift + self.mismatch / 2 + words
        return found

    def highlight(self, model: ReflectionModel, parameter: float | None) -> float:
        """Largest error of the specular term, without the error of the lobe's table.

        It is the sum of

        - the lobe's steepest slope a radian times the error of its angle;
        - its largest ``|dS/ds|`` times the drift, but at most the error by the angle ``asin(sqrt(drift))``;
        - the part from the relative error of s;
        - for a further light, the change by the error of q.

        Parameters
        ----------
        model : ReflectionModel
            The lobe.
        parameter : float or None
            Its exponent or roughness.
        """
        # The angles are dense near the peak. The lobe ends at a right angle.
        angle = np.linspace(0, 1, 1 << 16)[:-1] ** 2 * np.pi / 2
        value = model.reflect(np.cos(angle), parameter)
        sine = np.sin(angle / 2 if model.MIRROR else angle) ** 2
        rise = np.abs(np.diff(value))
        slope, steepness = (rise / np.diff(angle)).max(), (rise / np.diff(sine)).max()
        # If s is over 1/2, errors of 1 - s take the place of errors of s.
        relative = (rise / np.diff(sine) * np.minimum(sine, 1 - sine)[1:]).max()
        by_drift = min(steepness * self.drift, slope * (1 + model.MIRROR) * np.arcsin(np.sqrt(self.drift)))
        by_square = 0.0
        if self.mismatch:
            moved = np.minimum(np.outer([1 - self.mismatch, 1 + self.mismatch], sine), 1)
            turned = np.arcsin(np.sqrt(moved)) * (1 + model.MIRROR)
            beside = model.reflect(np.cos(np.minimum(turned, np.pi / 2)), parameter)
            by_square = np.abs(beside - value).max()
        return float(slope * self.turn + by_drift + by_square + relative * Quotient.SINE_ERROR)


METHODS = {
    QuotientInterpolator(): "no unit normals: highlights of N.H or R.V by quotients of quadratics; exact"
}
"""The method of this module, and a line about it."""
