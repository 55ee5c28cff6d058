"""Interpolators: from spans to what shading needs at every pixel, whatever the method."""

from amaranth.hdl import Module, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from golden.difference_setup import LENGTH_BITS
from golden.interpolator import Interpolator, NormalInterpolator
from golden.specular import Specular

from .chord import chord
from .dataflow import Dataflow, dot
from .fixed import FixedShape
from .middle_normal import normal_shape
from .stream import PipelinedUnit, connect

__all__ = [
    "InterpolatorUnit",
    "LightProductsUnit",
    "NormalInterpolatorUnit",
    "light_vectors_shape",
    "operands_shape",
    "span_normals_shape",
]


def light_vectors_shape(lights: int) -> data.ArrayLayout:
    """Shape of the vectors of each light: direction L and half-way vector H."""
    vectors = data.StructLayout({"direction": normal_shape(), "halfway": normal_shape()})
    return data.ArrayLayout(vectors, lights)


def span_normals_shape() -> data.StructLayout:
    """Shape of what an interpolator needs of a span: the normals at its ends, and its length in pixels."""
    return data.StructLayout(
        {"normal_left": normal_shape(), "normal_right": normal_shape(), "length": unsigned(LENGTH_BITS)}
    )


def operands_shape(parameters: Interpolator, lights: int) -> data.ArrayLayout:
    """Shape of what an interpolator gives for a pixel: for each light N·L, and N·H or 1 - N·H."""
    operands = {
        "cosine": FixedShape(parameters.COSINE_FORMAT),
        "highlight": FixedShape(Specular(operand=parameters.operand).operand_format),
    }
    return data.ArrayLayout(data.StructLayout(operands), lights)


class InterpolatorUnit(wiring.Component):
    """A method of the pipeline: spans in, the operands of their pixels out, first pixel first.

    One subclass a method, whose bit-true twin is the subclass of `golden.interpolator.Interpolator` of the
    same name. It sets `latency`, clocks from a span to its first pixel when nothing waits;
    `setup_interval`, clocks from a span to the next at the closest; and `clocks_per_pixel`.

    Parameters
    ----------
    parameters : Interpolator
        Twin.
    lights : int
        Number of lights, at least 1.

    Members
    -------
    i : :py:`In(stream.Signature(span_normals_shape()))`
        Spans of length 1 to 4095.
    o : :py:`Out(stream.Signature(operands_shape(parameters, lights)))`
        Operands of the pixels.
    constants : :py:`In(light_vectors_shape(lights))`
        L and H of each light; stay while spans are inside.
    wide : :py:`Out(1)`
        High for one clock for each span that is too wide for the method.
    """

    clocks_per_pixel = 1

    @classmethod
    def setup_intervals(cls, parameters: Interpolator) -> range:
        """Values of a constructor argument ``setup_interval`` that there may be; none by default."""
        return range(0)

    def __init__(self, parameters: Interpolator, lights: int):
        self.parameters = parameters
        self.lights = lights
        super().__init__(
            {
                "i": In(stream.Signature(span_normals_shape())),
                "o": Out(stream.Signature(operands_shape(parameters, lights))),
                "constants": In(light_vectors_shape(lights)),
                "wide": Out(1),
            }
        )


class LightProductsUnit(PipelinedUnit):
    """Products of a normal with L and H of every light: ``N . L``, and ``N . H`` or the chord.

    The latency is 4 clocks (operands, products, two sums), with the chord 8; the initiation interval is 1.
    Six multipliers a light.

    Parameters
    ----------
    parameters : NormalInterpolator
        Which specular operand.
    lights : int
        Number of lights, at least 1.

    Members
    -------
    i : :py:`In(stream.Signature(ArrayLayout(SQ(1, 17), 3)))`
        Normals.
    o : :py:`Out(stream.Signature(operands_shape(parameters, lights)))`
        Operands.
    constants : :py:`In(light_vectors_shape(lights))`
        L and H; stay while beats are inside.
    """

    def __init__(self, parameters: NormalInterpolator, lights: int):
        self._graph = graph = Dataflow(1, 6 * lights)
        normal = graph.input("normal", lambda operands: operands)
        self._words = []
        for i in range(lights):
            cosine = dot(graph, f"cosine_{i}", normal, lambda _, i=i: self.constants[i].direction)
            if parameters.operand == "cosine":
                highlight = dot(graph, f"highlight_{i}", normal, lambda _, i=i: self.constants[i].halfway)
            else:
                highlight = chord(graph, f"highlight_{i}", normal, lambda i=i: self.constants[i].halfway)
            self._words.append({"cosine": cosine, "highlight": highlight})
        super().__init__(
            normal_shape(),
            operands_shape(parameters, lights),
            latency=highlight.age,
            constants=light_vectors_shape(lights),
        )

    def datapath(self, m, operands):
        """The graph; the chord in the specular unit's format."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for light, words in zip(result, self._words, strict=True):
            highlight, format = value(words["highlight"], self.latency), light.highlight.format
            m.d.comb += [
                light.cosine.eq(value(words["cosine"], self.latency)),
                light.highlight.eq(highlight.truncate(format.fraction_bits).saturate(format)),
            ]
        return result


class NormalInterpolatorUnit(InterpolatorUnit):
    """A method that finds normals, before the products with L and H of every light.

    A subclass makes, in `source`, what takes spans to normals, and sets `latency` with `product_latency`
    added. Six multipliers a light for the products.

    Parameters
    ----------
    parameters : NormalInterpolator
        Twin.
    lights : int
        Number of lights, at least 1.
    """

    def __init__(self, parameters: NormalInterpolator, lights: int):
        super().__init__(parameters, lights)
        self._products = LightProductsUnit(parameters, lights)
        self.product_latency = self._products.latency

    def source(self, m: Module) -> tuple[stream.Interface, Value]:
        """Make in ``m`` what takes ``self.i`` to normals: their stream, and the flag for wide spans."""
        raise NotImplementedError

    def elaborate(self, platform):
        """Normals, then products."""
        m = Module()
        normals, wide = self.source(m)
        m.submodules.products = products = self._products
        connect(m, normals, products.i)
        connect(m, products.o, wiring.flipped(self.o))
        m.d.comb += [products.constants.eq(self.constants), self.wide.eq(wide)]
        return m
