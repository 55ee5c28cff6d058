"""Duff 1979: N·L and the highlight of every pixel as quotients of forms over a triangle, by one root."""

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from blysk.golden.cosines.quotient import Quotient
from blysk.golden.cosines.quotient_spans import MARGIN, PixelWords, QuotientSpans
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.rivals.rival import Rival, directions_of
from blysk.golden.rivals.shades import Shades, shaded
from blysk.golden.rivals.trace import Trace
from blysk.golden.rivals.triangles import (
    ScreenTriangles,
    Surfaces,
    at_origin,
    dot,
    gradients,
    screen_triangles,
)

__all__ = ["Duff", "TracedQuotient", "TriangleWords"]

_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True)
class TracedQuotient(Quotient):
    """`Quotient` whose words and products are counted.

    Parameters
    ----------
    spans : QuotientSpans
        As for `Quotient`.
    trace : Trace
        Gets the parts.
    seen : dict
        Words of the last `compute`, by name.
    """

    trace: Trace = field(default_factory=Trace)
    seen: dict[str, np.ndarray] = field(default_factory=dict)

    def word(self, name: str, codes: np.ndarray) -> np.ndarray:
        """A word, see `Quotient.word`; kept for `count`."""
        self.seen[name] = codes if codes.ndim > 1 else codes[:, np.newaxis]
        return codes

    def count(self) -> None:
        """Count the parts of a pixel, from the words of the last `compute`."""
        trace, words = self.trace, self.seen

        def word(name: str, bits: int, signed: bool = False) -> Fixed:
            format = SQ(bits, 0) if signed else UQ(bits, 0)
            return Fixed(format, format.wrap(words[name]))

        trace.added(word("q", 36))
        step = 21 - self.TABLE_BITS
        normal = words["q shifted"]
        base, slope = (of[normal >> step] for of in self.table)
        trace.read(3 * 2 ** (self.TABLE_BITS - 2) * (base.format.width + slope.format.width), base, slope)
        trace.product(slope, Fixed(UQ(step, 0), normal & ((1 << step) - 1)))
        root = word("r", 17)
        trace.added(root)
        trace.product(root, root)
        trace.product(word("line", 18, True), root)
        trace.product(word("numerator", 17), word("r^2", 17))
        trace.added(word("place", self.place_format.width))


class TriangleWords(NamedTuple):
    """Words of triangles: vectors at the origin and their steps, by component.

    Parameters
    ----------
    start, across, down : int64 arrays, shape (triangles, components)
        Codes of ``SQ(1, 17)``. The components are v, then ``v x H`` of each light.
    columns, rows : int64 arrays, shape (triangles,)
        Exponents of both steps, `Duff.LOWEST` to 15.
    out_of_range : bool array, shape (triangles,)
        Whether a step outgrows its word.
    """

    start: np.ndarray
    across: np.ndarray
    down: np.ndarray
    columns: np.ndarray
    rows: np.ndarray
    out_of_range: np.ndarray


@dataclass(frozen=True)
class Duff(Rival):
    """N·L as ``v·L/|v|`` and ``sin^2 gamma`` as ``|v x H|^2/|v|^2``, with v linear over the triangle.

    ``|v|^2`` and ``|v x H|^2`` are quadratics of the pixel's place, ``v·L`` and ``v·H`` lines. They are
    carried by forward differences over the whole triangle. A pixel takes one root. The path of a pixel and
    the lobe's table are those of `Quotient`, so only the frame and the setup differ: words of v and
    ``v x H`` are those of a span of the quotient method, for a triangle, and no triangle is cut.

    ========= ========= =====================================================================
    word      format    why
    ========= ========= =====================================================================
    v, v x H  SQ(1, 17) multiplier operands; one factor scales a triangle
    squares   SQ(3, 47) ``|v|^2`` under 2; differences are cut to 13 bits below the products
    lines     SQ(2, 36) as for the quotient method
    ========= ========= =====================================================================

    Source: docs/theory/rivals.md#duff; [Duff79].
    """

    NAME: ClassVar = "duff"
    TITLE: ClassVar = "Duff 1979, a root a pixel over a triangle"
    SPAN_CYCLES: ClassVar = 1
    SETUP_CYCLES: ClassVar = 8
    SQUARES: ClassVar[Surfaces] = Surfaces(SQ(3, 47))
    LOWEST: ClassVar[int] = -2
    """Least exponent of a step. A step of four widths of the word only occurs in slivers."""
    LARGEST: ClassVar[float] = 1.99
    """Largest ``|v|^2`` of a corner."""

    def host(self, scene: Scene, triangles: ScreenTriangles) -> list[np.ndarray]:
        """Planes of v and ``v x H``, scaled: three arrays of shape (components, triangles)."""
        corners = [triangles.normal[k] * triangles.weight[k] for k in range(3)]
        vectors = []
        for vector in corners:
            x, y, z = vector
            components = [vector]
            for light in directions_of(scene, triangles.point[0]):
                a, b, c = light.halfway
                components.append(np.stack([y * c - z * b, z * a - x * c, x * b - y * a]))
            vectors.append(np.concatenate(components))
        largest = np.max([np.abs(np.asarray(of)).max(axis=0) for of in vectors], axis=0)
        scale = (1 - MARGIN * 2.0**-17) / largest
        # A pixel's word of |v|^2 - |v x H|^2 is under 2, and |v|^2 may be 3.
        square = np.max([np.asarray(dot(of, of)) for of in corners], axis=0) * scale * scale
        scale = scale * np.where(square > self.LARGEST, 0.8, 1.0)
        return list(at_origin(np.stack([of * scale for of in vectors]), gradients(triangles)))

    def beat_bits(self, lights: int) -> int:
        """Three vectors of 18 bits a component, and two exponents of 5 bits."""
        return 3 * (3 + 3 * lights) * 18 + 10

    def words(self, scene: Scene, triangles: ScreenTriangles) -> TriangleWords:
        """Nearest codes of the planes."""
        start, across, down = (of.T for of in self.host(scene, triangles))
        most = QuotientSpans.COMPONENT_FORMAT.max_code
        codes = [np.clip(np.rint(start * 2.0**17), -most, most).astype(np.int64)]
        exponents = []
        wrong = np.zeros(len(start), dtype=bool)
        for step, distance in ((across, triangles.columns), (down, triangles.rows)):
            step = np.where(distance[:, np.newaxis] > 0, step, 0)
            largest = np.maximum(np.abs(step).max(axis=1), 2.0**-40)
            fits = np.floor(np.log2(most * 2.0**-17 / largest)).astype(np.int64)
            finest = np.ceil(np.log2(np.maximum(distance, 1))).astype(np.int64) + 3
            exponent = np.clip(np.minimum(fits, finest), self.LOWEST, 15)
            exact = np.rint(np.ldexp(step, 17 + exponent[:, np.newaxis]))
            wrong |= (np.abs(exact) > most).any(axis=1)
            codes.append(np.clip(exact, -most, most).astype(np.int64))
            exponents.append(exponent)
        return TriangleWords(codes[0], codes[1], codes[2], exponents[0], exponents[1], wrong)

    def pixels(self, scene: Scene, triangles: ScreenTriangles, trace: Trace) -> PixelWords:
        """Bit-accurate words of every fragment, as `Quotient` takes them."""
        words = self.words(scene, triangles)
        groups = range(1 + len(scene.lights))
        squares = [self._square(words, slice(3 * k, 3 * k + 3), trace) for k in groups]
        found = self.SQUARES.compute(Fixed(self.SQUARES.format, np.stack(squares, axis=1)), triangles, trace)
        rest = found[:, 0] - found[:, 1]
        trace.added(Fixed(rest.format, rest.codes[:, np.newaxis]))
        lights = directions_of(scene, triangles.point[0])
        towards, halfway = (
            np.stack([np.rint(of[:, 0] * QuotientSpans.ONE).astype(np.int64) for of in vectors])
            for vectors in ([of.towards for of in lights], [of.halfway for of in lights])
        )
        line = self._line(words, towards, triangles, trace)
        height = self._line(words, halfway, triangles, trace)
        return PixelWords(found[:, 1:], rest, line, height.codes < 0)

    def shade(self, scene: Scene, raster: Raster, trace: Trace) -> Shades:
        """Bit-accurate light of every fragment, see `Rival.shade`.

        Raises
        ------
        ValueError
            If a light or the viewer is near.
        """
        if scene.local:
            raise ValueError("Duff's forms need distant lights and a distant viewer")
        unit = TracedQuotient(QuotientSpans(len(scene.lights)), trace)
        cosine, place, _ = unit.compute(self.pixels(scene, screen_triangles(scene, raster), trace))
        unit.count()
        return shaded(scene, cosine, place, QuotientLobe(self.REFLECTION), trace)

    def _square(self, words: TriangleWords, group: slice, trace: Trace) -> np.ndarray:
        """Words of the square of three components, see `Surfaces`, cut: shape (triangles, 6)."""
        format = QuotientSpans.COMPONENT_FORMAT
        vectors = [Fixed(format, of[:, group]) for of in (words.start, words.across, words.down)]
        shifts = [np.zeros_like(words.columns), words.columns, words.rows]
        products = {}
        for first, second in _PAIRS:
            exact = trace.summed(trace.product(vectors[first], vectors[second], "triangle"), "triangle").codes
            # Exact: a sum of three products has 36 bits.
            places = self.SQUARES.format.fraction_bits - 34 - shifts[first] - shifts[second]
            products[first, second] = np.ldexp(exact.astype(np.float64), places)
        x, y = products[1, 1], products[2, 2]
        found = [
            products[0, 0],
            2 * products[0, 1] + x,
            2 * products[0, 2] + y,
            2 * x,
            2 * products[1, 2],
            2 * y,
        ]
        return np.stack([self.SQUARES.format.wrap(np.floor(of).astype(np.int64)) for of in found], axis=1)

    @staticmethod
    def _line(words: TriangleWords, direction: np.ndarray, triangles: ScreenTriangles, trace: Trace) -> Fixed:
        """Lines ``v·d`` of each light at every fragment: Fixed, shape (pixels, lights)."""
        format, component = QuotientSpans.LINE_FORMAT, QuotientSpans.COMPONENT_FORMAT
        other = Fixed(component, direction[np.newaxis])
        found = []
        for codes, shift in zip(words[:3], (None, words.columns, words.rows), strict=True):
            vector = Fixed(component, codes[:, np.newaxis, :3])
            product = trace.summed(trace.product(vector, other, "triangle"), "triangle")
            exact = product.codes.astype(np.float64)
            places = format.fraction_bits - 34 - (0 if shift is None else shift[:, np.newaxis])
            found.append(np.floor(np.ldexp(exact, places)).astype(np.int64))
        start, across, down = (of[triangles.triangle] for of in found)
        value = start + triangles.i[:, np.newaxis] * across + triangles.j[:, np.newaxis] * down
        values = Fixed(format, format.wrap(value))
        trace.added(values[triangles.first], "span")
        return trace.added(values)
