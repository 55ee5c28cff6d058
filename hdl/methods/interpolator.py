"""Interpolators: from spans to what shading needs at every pixel, whatever the method."""

from amaranth.hdl import Module, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.interpolator import Interpolator, NormalInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.dataflow import Dataflow, dot
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.shapes import light_vectors_shape, normal_shape, span_normals_shape
from blysk.hdl.core.stream import PipelinedUnit, connect
from blysk.hdl.cosines.chord import chord

__all__ = [
    "InterpolatorUnit",
    "LightProductsUnit",
    "NormalInterpolatorUnit",
    "operands_shape",
    "span_words",
]


def span_words(span: data.View) -> list[tuple[str, Value]]:
    """Names and values of a span's members; a shorter length is taken for one of 12 bits."""
    return [(name, span[name]) for name in ("normal_left", "normal_right", "length")]


def operands_shape(parameters: Interpolator, lights: int, highlights: bool = True) -> data.ArrayLayout:
    """Shape of what an interpolator gives for a pixel: for each light N·L, and N·H or 1 - N·H."""
    operands = {"cosine": FixedShape(parameters.COSINE_FORMAT)}
    if highlights:
        operands["highlight"] = FixedShape(Specular(operand=parameters.operand).operand_format)
    return data.ArrayLayout(data.StructLayout(operands), lights)


class InterpolatorUnit(wiring.Component):
    """A method of the pipeline: spans in, the operands of their pixels out, first pixel first.

    One subclass a method, whose bit-true twin is the subclass of `Interpolator` of the
    same name. It sets `latency`, cycles from a span to its first pixel when nothing waits;
    `setup_interval`, cycles from a span to the next at the closest; and `cycles_per_pixel`.

    Parameters
    ----------
    parameters : Interpolator
        Twin.
    lights : int
        Number of lights, at least 1.
    highlights : bool
        Whether there is specular light; else there are no operands of it.
    length_bits : int
        Bits of the length.

    Members
    -------
    i : :py:`In(stream.Signature(span_normals_shape(length_bits)))`
        Spans of length 1 or more.
    o : :py:`Out(stream.Signature(operands_shape(parameters, lights, highlights)))`
        Operands of the pixels.
    constants : :py:`In(light_vectors_shape(lights))`
        L and H of each light; stay while spans are inside.
    wide : :py:`Out(1)`
        High for one clock for each span that is too wide for the method.
    """

    cycles_per_pixel = 1

    @classmethod
    def setup_intervals(cls, parameters: Interpolator) -> range:
        """Values of a constructor argument ``setup_interval`` that there may be; none by default."""
        return range(0)

    def __init__(
        self,
        parameters: Interpolator,
        lights: int,
        *,
        highlights: bool = True,
        length_bits: int = LENGTH_BITS,
    ):
        self.parameters = parameters
        self.lights = lights
        self.highlights = highlights
        self.length_bits = length_bits
        super().__init__(
            {
                "i": In(stream.Signature(span_normals_shape(length_bits))),
                "o": Out(stream.Signature(operands_shape(parameters, lights, highlights))),
                "constants": In(light_vectors_shape(lights)),
                "out_of_range": Out(1),
            }
        )


class LightProductsUnit(PipelinedUnit):
    """Products of a normal with L and H of every light: ``N . L``, and ``N . H`` or the chord.

    With an initiation interval of 1 the latency is 7 cycles (operands, four for the products, two sums), with
    the chord 11. Six products a light, three without highlights; with a longer interval they take turns at
    fewer multipliers.

    Parameters
    ----------
    parameters : NormalInterpolator
        Which specular operand.
    lights : int
        Number of lights, at least 1.
    highlights : bool
        Whether there is specular light.
    initiation_interval : int
        Distance in cycles of two inputs, at least 1.

    Members
    -------
    i : :py:`In(stream.Signature(ArrayLayout(SQ(1, 17), 3)))`
        Normals.
    o : :py:`Out(stream.Signature(operands_shape(parameters, lights, highlights)))`
        Operands.
    constants : :py:`In(light_vectors_shape(lights))`
        L and H; stay while beats are inside.
    """

    def __init__(
        self,
        parameters: NormalInterpolator,
        lights: int,
        highlights: bool = True,
        initiation_interval: int = 1,
    ):
        self._graph = graph = Dataflow(initiation_interval, (6 if highlights else 3) * lights)
        normal = graph.input("normal", lambda operands: operands)
        self._words = []
        for i in range(lights):
            words = {"cosine": dot(graph, f"cosine_{i}", normal, lambda _, i=i: self.constants[i].direction)}
            if highlights:
                product = dot if parameters.operand == "cosine" else chord
                vector = lambda *_, i=i: self.constants[i].halfway  # noqa: E731
                words["highlight"] = product(graph, f"highlight_{i}", normal, vector)
            self._words.append(words)
        super().__init__(
            normal_shape(),
            operands_shape(parameters, lights, highlights),
            latency=max(word.stage for word in words.values()),
            initiation_interval=initiation_interval,
            constants=light_vectors_shape(lights),
        )

    def datapath(self, m, operands):
        """The graph; the chord in the specular unit's format."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for light, words in zip(result, self._words, strict=True):
            m.d.comb += light.cosine.eq(value(words["cosine"], self.latency))
            if "highlight" in words:
                highlight, format = value(words["highlight"], self.latency), light.highlight.format
                m.d.comb += light.highlight.eq(highlight.truncate(format.fraction_bits).saturate(format))
        return result


class NormalInterpolatorUnit(InterpolatorUnit):
    """A method that finds normals, before the products with L and H of every light.

    A subclass makes, in `source`, what takes spans to normals, and sets `latency` with `product_latency`
    added. ``ceil(6 lights / product_interval)`` multipliers for the products, half as many without
    highlights.

    Parameters
    ----------
    parameters, lights, options
        As for `InterpolatorUnit`.
    product_interval : int
        Clocks from a pixel to the next at the closest, at least 1.
    """

    def __init__(self, parameters: NormalInterpolator, lights: int, *, product_interval: int = 1, **options):
        super().__init__(parameters, lights, **options)
        self.product_interval = product_interval
        self._products = LightProductsUnit(parameters, lights, self.highlights, product_interval)
        self.product_latency = self._products.latency

    def source(self, m: Module) -> tuple[stream.Interface, Value]:
        """Make in ``m`` what takes ``self.i`` to normals: their stream, and the flag for wide spans."""
        raise NotImplementedError

    def elaborate(self, platform):
        """Normals, then products."""
        m = Module()
        normals, out_of_range = self.source(m)
        m.submodules.products = products = self._products
        connect(m, normals, products.i)
        connect(m, products.o, wiring.flipped(self.o))
        m.d.comb += [products.constants.eq(self.constants), self.out_of_range.eq(out_of_range)]
        return m
