"""Products of a normal with the vectors of every light."""

from amaranth.hdl import Signal
from amaranth.lib import data

from blysk.golden.lighting.factor import Factor
from blysk.golden.methods.interpolator import Interpolator
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.methods.normal_interpolator import NormalInterpolator
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.dot import dot
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import light_vectors_shape, normal_shape
from blysk.hdl.cosines.chord import chord

__all__ = ["LightProductsUnit", "operands_shape"]


def operands_shape(
    model: Interpolator,
    lights: int,
    *,
    highlights: bool = True,
    factored: bool = False,
) -> data.ArrayLayout:
    """Shape of the operands of a pixel: for each light N·L, and N·H or 1 - N·H.

    Parameters
    ----------
    model : Interpolator
        Bit-accurate model, with the formats.
    lights : int
        Number of lights.
    highlights : bool
        Whether there is specular light.
    factored : bool
        Whether factors of the lights that fade come with the operands. Other lights have the factor 0, which
        has no use.
    """
    operands = {"cosine": FixedShape(model.COSINE_FORMAT)}
    if highlights:
        operands["highlight"] = FixedShape(model.highlight_format)
    if factored:
        operands["factor"] = FixedShape(Factor.FORMAT)
    return data.ArrayLayout(data.StructLayout(operands), lights)


class LightProductsUnit(PipelinedUnit):
    """Products of a normal for every light: ``N . L``, and ``N . H`` or half the squared chord.

    `NormalInterpolator.products` is the bit-accurate model. With an initiation interval of 1 the latency is 5
    cycles (operands, two for the products, two sums). With the chord it is 8 cycles. There are six products
    for each light, or three without highlights. They share ``ceil(6 lights / initiation_interval)``
    multipliers of 18 by 18 bits, or ``ceil(3 lights / initiation_interval)`` without highlights.

    Parameters
    ----------
    model : NormalInterpolator
        Bit-accurate model, with the operand of the specular unit.
    lights : int
        Number of lights, at least 1.
    highlights : bool
        Whether there is specular light.
    initiation_interval : int
        Least cycles from an input to the next, at least 1.

    Members
    -------
    i : :py:`In(stream.Signature(ArrayLayout(SQ(1, 17), 3)))`
        Normals.
    o : :py:`Out(stream.Signature(operands_shape(model, lights, highlights=highlights)))`
        Operands.
    constants : :py:`In(light_vectors_shape(lights))`
        L and H, constant while beats are inside.

    Source: docs/theory/interpolation.md#dot-product, docs/theory/chord.md#the-chord; [T] figure 2.5.
    """

    def __init__(
        self,
        model: NormalInterpolator | None = None,
        lights: int = 1,
        *,
        highlights: bool = True,
        initiation_interval: int = 1,
    ):
        self.model = model = model or LinearInterpolator()
        self.lights = lights
        self.highlights = highlights
        self._graph = graph = Dataflow(initiation_interval)
        normal = graph.input("normal", lambda operands: operands)
        self._words = []
        for i in range(lights):
            words = {
                "cosine": dot(
                    graph, f"cosine_{i}", normal, lambda _, i=i: self.constants[i].direction, symbol=f"L_{i}"
                )
            }
            if highlights:
                product = chord if model.uses_chord else dot
                vector = lambda *_, i=i: self.constants[i].halfway  # noqa: E731
                words["highlight"] = product(graph, f"highlight_{i}", normal, vector, symbol=f"H_{i}")
            self._words.append(words)
        super().__init__(
            normal_shape(),
            operands_shape(model, lights, highlights=highlights),
            latency=max(word.stage for word in words.values()),
            initiation_interval=initiation_interval,
            constants=light_vectors_shape(lights),
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph. The chord is brought into the specular unit's format."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for light, words in zip(result, self._words, strict=True):
            m.d.comb += light.cosine.eq(value(words["cosine"], self.latency))
            if self.highlights:
                highlight, format = value(words["highlight"], self.latency), light.highlight.format
                m.d.comb += light.highlight.eq(highlight.truncate(format.fraction_bits).saturate(format))
        return result
