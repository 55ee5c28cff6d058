"""Methods with hardware in this project, counted by the rules of the rivals."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.cosines.quotient_spans import QuotientSpans, SpanVectors
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.cut import cut_spans
from blysk.golden.frames.prepare import constants_of, spans_for
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.methods.angular_interpolator import AngularInterpolator
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.methods.renormalise_interpolator import RenormaliseInterpolator
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.line_setup import LineSetup
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import UQ, Fixed, Format
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import preset
from blysk.golden.reference.light_frame import light_frames
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.reflection import BLINN, PHONG, ReflectionModel
from blysk.golden.reference.scene import Scene
from blysk.golden.rivals.duff import TracedQuotient
from blysk.golden.rivals.rival import Rival, directions_of, unit
from blysk.golden.rivals.shades import Shades, shaded
from blysk.golden.rivals.trace import Trace
from blysk.golden.rivals.triangles import ScreenTriangles, at_origin, dot, gradients

__all__ = ["ChordLocal", "KuijkBlake", "QuotientMethod", "Renormalise", "SpanDesign"]


@dataclass(frozen=True)
class SpanDesign(Rival):
    """Base of methods with hardware, whose beats bring spans.

    `shade` gives the pixels of `ShadingPipeline`, and counts its words.
    """

    CUTS: ClassVar[bool] = True
    """Whether spans are cut for the method."""
    COUNTS_SETUP: ClassVar[bool] = True
    """Whether the trace has the products of spans."""
    SETUP_INTERVAL: ClassVar[int | None] = None
    """Setup interval of the design, if it is not the method's own."""

    def host(self, scene: Scene, triangles: ScreenTriangles) -> Sequence[np.ndarray]:
        """Planes of N/W: value at the origin and two gradients, each of shape (components, triangles)."""
        scaled = np.stack([triangles.normal[k] * triangles.weight[k] for k in range(3)])
        return at_origin(scaled, gradients(triangles))

    @abstractmethod
    def host_span(
        self, scene: Scene, planes: Sequence[np.ndarray], place: Sequence[np.ndarray], point: np.ndarray
    ) -> Sequence[np.ndarray]:
        """What software computes for each span, in float64, by single operations that may be counted.

        Parameters
        ----------
        scene : Scene
            Lights and viewer.
        planes : sequence of arrays, shape (components, spans)
            Result of `host` for the triangle of each span.
        place : three arrays, shape (spans,)
            Column and row of the first pixel from the origin, and pixels less 1.
        point : array, shape (3, spans)
            A position on each span, for near lights.
        """

    def design(self, lights: int) -> ShadingPipeline:
        """The pipeline of the method."""
        return preset(self.HARDWARE, self.REFLECTION.name, lights, setup_interval=self.SETUP_INTERVAL)

    def prepared(self, scene: Scene, raster: Raster) -> tuple[Raster, Spans, FrameConstants]:
        """Spans of a raster, cut if the method cuts, and their input beats."""
        design = self.design(len(scene.lights))
        cut = cut_spans(scene, raster, design)[0] if self.CUTS else raster
        return cut, spans_for(scene, cut, design), constants_of(scene, design)[0]


def _along(planes: Sequence[np.ndarray], i: np.ndarray, j: np.ndarray) -> np.ndarray:
    start, across, down = planes
    found: np.ndarray = start + across * i + down * j
    return found


def _sums(
    trace: Trace, format: Format, words: Sequence[np.ndarray], length: np.ndarray, counted: int = 2
) -> np.ndarray:
    """Codes of forward differences of the first or second order at every pixel, counted.

    Parameters
    ----------
    trace : Trace
        Gets the additions.
    format : Format
        Format of the sums and differences.
    words : two or three int64 arrays, shape (spans, words)
        Start, first difference, and second difference.
    length : int array, shape (spans,)
        Pixels.
    counted : int
        Additions a pixel, 1 for words without second difference.
    """
    span, index = pixels_of(length)
    index = index[:, np.newaxis]
    start, first = (of[span] for of in words[:2])
    second = words[2][span] if len(words) > 2 else np.zeros_like(first)
    if counted > 1:
        trace.added(Fixed(format, format.wrap(first + index * second)))
    value = Fixed(format, format.wrap(start + index * first + index * (index - 1) // 2 * second))
    return trace.added(value).codes


@dataclass(frozen=True)
class QuotientMethod(SpanDesign):
    """The method ``quotient``, with a highlight of N·H, or of R·V.

    Parameters
    ----------
    mirror : bool
        Whether the highlight is of R·V.

    Source: docs/theory/quotient.md.
    """

    mirror: bool = False

    NAME: ClassVar = "quotient"
    TITLE: ClassVar = "quotient, this project"
    HARDWARE: ClassVar = "quotient"

    @property
    def REFLECTION(self) -> ReflectionModel:  # type: ignore[override]
        """Blinn's power of N·H, or Phong's of R·V."""
        return PHONG if self.mirror else BLINN

    def host(self, scene: Scene, triangles: ScreenTriangles) -> Sequence[np.ndarray]:
        """Planes of N/W in the frames of the lights; with ``mirror`` y is ``y cos a``, and s0 comes last."""
        scaled = [triangles.normal[k] * triangles.weight[k] for k in range(3)]
        axes = []
        for frame in light_frames(scene, len(scene.lights)):
            x, y, z = frame.axes
            axes += [x, frame.cosine * y if self.mirror else y, z]
        if self.mirror:
            first = light_frames(scene, 1)[0]
            axes.append(first.sine * first.axes[1])
        turned = [np.stack([dot(axis, vector) for axis in axes]) for vector in scaled]
        return at_origin(np.stack(turned), gradients(triangles))

    def host_span(
        self, scene: Scene, planes: Sequence[np.ndarray], place: Sequence[np.ndarray], point: np.ndarray
    ) -> Sequence[np.ndarray]:
        """Vector at the first pixel and its step, scaled by the larger end; comparisons are not counted."""
        i, j, last = place
        start, step = _along(planes, i, j), planes[1]
        end = start + step * last
        largest = np.maximum(*(np.abs(np.asarray(of)).max(axis=0) for of in (start, end)))
        scale = np.ones_like(i, dtype=np.float64) / largest
        return start * scale, step * scale

    def beat_bits(self, lights: int) -> int:
        """Two vectors of 18 bits a component, and an exponent of 4 bits."""
        components = QuotientSpans(lights, mirror=self.mirror).components
        return 2 * 18 * len(components) + QuotientSpans.EXPONENT_FORMAT.width

    def shade(self, scene: Scene, raster: Raster, trace: Trace) -> Shades:
        """Bit-accurate light of every fragment, see `Rival.shade`."""
        _, spans, constants = self.prepared(scene, raster)
        assert spans.vectors is not None
        model = QuotientSpans(len(scene.lights), mirror=self.mirror)
        direction = np.asarray(constants.direction)[:, ::2]
        self._products(model, spans.vectors, direction, np.asarray(spans.length), trace)
        words = model.differences(spans.vectors, direction)
        _sums(trace, model.square_format, words.squares, spans.length)
        _sums(trace, model.LINE_FORMAT, words.lines, spans.length, 1)
        if model.takes_heights:
            _sums(trace, model.HEIGHT_FORMAT, words.heights, spans.length, 1)
        quotient = TracedQuotient(model, trace)
        cosine, place, _ = quotient.compute(model.compute(spans.vectors, spans.length, direction))
        quotient.count()
        return shaded(scene, cosine, place, QuotientLobe(self.REFLECTION), trace)

    @staticmethod
    def _products(
        model: QuotientSpans, vectors: SpanVectors, direction: np.ndarray, length: np.ndarray, trace: Trace
    ) -> None:
        """Count the products of spans; a span of one pixel needs the products of its start alone."""
        names = list(model.components)
        format, longer = model.COMPONENT_FORMAT, length > 1
        start = Fixed(format, vectors.start)
        pairs = [start[longer], Fixed(format, vectors.step[longer])]
        for group in model.squares:
            which = [names.index(name) for name in group]
            for one, other in ((start, start), (pairs[0], pairs[1]), (pairs[1], pairs[1])):
                trace.summed(trace.product(one[:, which], other[:, which], "span"), "span")
        for light, (sine, cosine) in enumerate(direction):
            which = [names.index(f"{axis}{light}") for axis in "xz"]
            towards = Fixed(format, np.array([[sine, cosine]]))
            for vector in (start, pairs[1]):
                trace.summed(trace.product(vector[:, which], towards, "span"), "span")


@dataclass(frozen=True)
class ChordLocal(SpanDesign):
    """The method ``chord-local``, for lights and a viewer that may be near.

    Source: docs/theory/chord.md.
    """

    NAME: ClassVar = "chord-local"
    TITLE: ClassVar = "chord-local, this project"
    HARDWARE: ClassVar = "chord-local"

    def host_span(
        self, scene: Scene, planes: Sequence[np.ndarray], place: Sequence[np.ndarray], point: np.ndarray
    ) -> Sequence[np.ndarray]:
        """N·L and u of each light at the first pixel, the middle and the last pixel."""
        i, j, last = place
        start = _along(planes, i, j)
        step = planes[1] * last
        found = []
        for vector in (start, start + step * 0.5, start + step):
            normal = unit(vector)
            for light in directions_of(scene, point):
                away = normal - light.halfway
                found += [dot(normal, light.towards), dot(away, away) * 0.5]
        return found

    def beat_bits(self, lights: int) -> int:
        """Three words of N·L in 26 bits, and three of u in 27 bits, for each light."""
        return 3 * (26 + 27) * lights

    def shade(self, scene: Scene, raster: Raster, trace: Trace) -> Shades:
        """Bit-accurate light of every fragment, see `Rival.shade`."""
        _, spans, _ = self.prepared(scene, raster)
        assert spans.values is not None
        method = LocalChordInterpolator()
        setup, length = method.setup, np.asarray(spans.length)
        diffuse, highlight = (
            Fixed(format, codes)
            for format, codes in zip(
                (setup.DIFFUSE_FORMAT, setup.HIGHLIGHT_FORMAT), spans.values, strict=True
            )
        )
        # Spans of one or two pixels use no product.
        longer = length > 2
        reciprocal, _, square, _ = setup.steps(length[longer])
        trace.product(reciprocal, reciprocal, "span")
        for values, slope_format in ((diffuse, setup.DIFFUSE_SLOPE_FORMAT), (highlight, setup.SLOPE_FORMAT)):
            left, middle, right = (values[longer][..., k] for k in range(3))
            exact = (left + right - middle.scale(1)).scale(1)
            curvature = exact.round_half_up(setup.CURVATURE_FORMAT.fraction_bits).saturate(
                setup.CURVATURE_FORMAT
            )
            trace.product(trace.added(curvature, "span"), square, "span")
            slope = (
                (right - left - curvature).round_half_up(slope_format.fraction_bits).saturate(slope_format)
            )
            trace.product(trace.added(slope, "span"), reciprocal, "span")
        *quadratics, _ = setup.compute(diffuse, highlight, length)
        operands = method.compute_values(spans.values, length)
        for words, bits in zip(quadratics, (46 - 25, 46 - 26), strict=True):
            parts = [words.start.codes << bits, words.first.codes, words.second.codes]
            _sums(trace, method.accumulators["diffuse"].format, parts, length)
        return shaded(scene, operands.cosine, operands.highlight, Lobe(BLINN, "one_minus_cosine"), trace)


@dataclass(frozen=True)
class Renormalise(SpanDesign):
    """The method ``renormalise``: a normal for every pixel, divided by its length.

    Parameters
    ----------
    interval : int
        Cycles of a span in the setup, 3, 2 or 1, among which its products share multipliers.

    Source: docs/theory/interpolation.md#renormaliser.
    """

    interval: int = 3

    NAME: ClassVar = "renormalise"
    TITLE: ClassVar = "a normal for every pixel, divided by its length"
    HARDWARE: ClassVar = "renormalise"

    @property
    def SPAN_CYCLES(self) -> int:  # type: ignore[override]
        """The interval."""
        return self.interval

    @property
    def SETUP_INTERVAL(self) -> int | None:  # type: ignore[override]
        """The interval."""
        return self.interval

    def host_span(
        self, scene: Scene, planes: Sequence[np.ndarray], place: Sequence[np.ndarray], point: np.ndarray
    ) -> Sequence[np.ndarray]:
        """Vectors at the first and the last pixel, divided by the longer length."""
        i, j, last = place
        start = _along(planes, i, j)
        end = start + planes[1] * last
        scale = 1 / np.sqrt(np.maximum(dot(start, start), dot(end, end)))
        return start * scale, end * scale

    def beat_bits(self, lights: int) -> int:
        """Two vectors of 23 bits a component."""
        return 2 * 3 * Renormaliser.VECTOR_FORMAT.width

    def shade(self, scene: Scene, raster: Raster, trace: Trace) -> Shades:
        """Bit-accurate light of every fragment, see `Rival.shade`."""
        _, spans, constants = self.prepared(scene, raster)
        method, unit_ = RenormaliseInterpolator(), Renormaliser()
        length = np.asarray(spans.length)
        left, right = (Fixed(method.END_FORMAT, of) for of in (spans.normal_left, spans.normal_right))
        setup = LineSetup()
        difference = trace.added(right - left, "span")
        high = Fixed(setup.HIGH_FORMAT, difference.codes >> setup.LOW_FORMAT.width)
        low = Fixed(setup.LOW_FORMAT, difference.codes & setup.LOW_FORMAT.max_code)
        ones = Fixed(
            setup.RECIPROCAL_HIGH_FORMAT, np.maximum((1 << 17) // np.maximum(length, 2), 1)[:, np.newaxis]
        )
        for word, other in ((high, ones), (high, ones), (low, ones)):
            trace.product(word, other, "span")
        first = setup.compute(left, right, length)
        shift = method.accumulator.format.fraction_bits - method.END_FORMAT.fraction_bits
        _sums(trace, method.accumulator.format, [left.codes << shift, first.codes], length, 1)
        span, index = pixels_of(length)
        none = Fixed(first.format, np.zeros_like(first.codes))
        line = method.accumulator.compute(left, first, none, span, index)
        word = trace.added(unit_.scaled(line)[0])
        square = trace.summed(trace.product(word, word))
        r = unit_.factor(square)
        # The quadratic of the root takes two products, of words like these.
        trace.read(
            64 * (19 + 17 + 12), *(of[np.zeros(len(r.codes), dtype=np.int64)] for of in unit_.coefficients)
        )
        offset = Fixed(UQ(0, 17), square.codes >> 19 & (1 << 17) - 1)
        trace.product(offset, Fixed(unit_.C2_FORMAT, np.full(len(r.codes), 1 << 10)))
        trace.product(offset, r)
        factor = Fixed(r.format, r.codes[:, np.newaxis])
        trace.product(word, factor)
        normal = trace.added(unit_.compute(line)[0])
        cosines, operands = [], []
        for direction, halfway in zip(constants.direction, constants.halfway, strict=True):
            vectors = [Fixed(COMPONENT, np.asarray(of)[np.newaxis]) for of in (direction, halfway)]
            trace.summed(trace.product(normal, vectors[0]))
            away = trace.added((normal - vectors[1]).wrap(COMPONENT))
            trace.summed(trace.product(away, away))
            every = [Fixed(COMPONENT, np.broadcast_to(of.codes, normal.shape)) for of in vectors]
            cosines.append(DotProduct().compute(normal, every[0]).codes)
            operands.append(Chord().operand(normal, every[1]).codes)
        cosine = Fixed(DotProduct().result_format, np.stack(cosines, axis=-1))
        operand = Fixed(Chord.ARGUMENT_FORMAT, np.stack(operands, axis=-1))
        return shaded(scene, cosine, operand, Lobe(BLINN, "one_minus_cosine"), trace)


@dataclass(frozen=True)
class KuijkBlake(SpanDesign):
    """The method ``angular`` without cuts: cosines of angles in equal steps along each span.

    The trace has the parts of a pixel alone. The netlist of ``angular`` has those of the setup, too.

    Source: docs/theory/rivals.md#kuijk-and-blake; [Kuijk89].
    """

    NAME: ClassVar = "kuijk-blake"
    TITLE: ClassVar = "Kuijk and Blake 1989, angles in equal steps"
    HARDWARE: ClassVar = "angular"
    CUTS: ClassVar = False
    COUNTS_SETUP: ClassVar = False

    def host_span(
        self, scene: Scene, planes: Sequence[np.ndarray], place: Sequence[np.ndarray], point: np.ndarray
    ) -> Sequence[np.ndarray]:
        """Unit normals at the first and the last pixel."""
        i, j, last = place
        start = _along(planes, i, j)
        return unit(start), unit(start + planes[1] * last)

    def beat_bits(self, lights: int) -> int:
        """Two unit vectors of 18 bits a component."""
        return 2 * 3 * COMPONENT.width

    def shade(self, scene: Scene, raster: Raster, trace: Trace) -> Shades:
        """Bit-accurate light of every fragment, see `Rival.shade`."""
        _, spans, constants = self.prepared(scene, raster)
        method, length = AngularInterpolator(), np.asarray(spans.length)
        left, right = (Fixed(COMPONENT, np.asarray(of)) for of in (spans.normal_left, spans.normal_right))
        vectors = [Fixed(COMPONENT, np.asarray(of)) for of in (constants.direction, constants.halfway)]
        operands = method.compute(left, right, length, *vectors)
        for vector in (of for pair in zip(*(of.codes for of in vectors), strict=True) for of in pair):
            every = Fixed(COMPONENT, np.broadcast_to(vector, left.shape))
            _, phase, step, cos_beta, _ = method.setup.compute(left, right, every, length)
            self._count(HighlightCosine(), phase, step, cos_beta, length, trace)
        return shaded(scene, operands.cosine, operands.highlight, Lobe(BLINN, "one_minus_cosine"), trace)

    @staticmethod
    def _count(
        of: HighlightCosine, phase: Fixed, step: Fixed, cos_beta: Fixed, length: np.ndarray, trace: Trace
    ) -> None:
        """Count the angle, the table with its product, the product with cos beta, and the result."""
        words = [phase.codes[:, np.newaxis], -step.codes[:, np.newaxis]]
        angle = _sums(trace, of.PHASE_FORMAT, words, length, 1)
        span = pixels_of(length)[0]
        address = np.abs(angle) >> 29 & (1 << of.address_bits) - 1
        value, rise = (table[address] for table in of.table)
        trace.read(36 << of.address_bits, value, rise)
        trace.product(rise, Fixed(UQ(0, of.FRACTION_BITS), angle >> 15 & (1 << of.FRACTION_BITS) - 1))
        wave = Fixed(of.FAR_FORMAT, np.clip(value.codes >> 5, 0, of.FAR_FORMAT.max_code))
        beta = np.clip(cos_beta.codes[span] >> 9, 0, of.FACTOR_FORMAT.max_code)[:, np.newaxis]
        trace.product(wave, Fixed(of.FACTOR_FORMAT, beta))
        trace.added(of.compute(phase, step, cos_beta, *pixels_of(length))[:, np.newaxis])
