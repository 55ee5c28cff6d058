"""Texture filter unit: a weighted mean of four texels, in three channels."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.albedo.texel_memory import BANKS, TexelMemory
from blysk.golden.albedo.texture_filter import TextureFilter
from blysk.golden.number.fixed import UQ
from blysk.hdl.albedo.texel_memory import texels_shape
from blysk.hdl.core.bits import select
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.word import Word

__all__ = ["TextureFilterUnit", "albedo_shape", "weighted_texels_shape"]

_CHANNEL, _VALUE = TexelMemory.CHANNEL_BITS, TexelMemory.VALUE_FORMAT.width
_ROW, _MEAN = TextureFilter.ROW_FORMAT.width, TextureFilter.MEAN_FORMAT.width


def albedo_shape() -> data.ArrayLayout:
    """Shape of an albedo: red, green, blue in ``UQ(1, 16)``."""
    return data.ArrayLayout(FixedShape(TextureFilter.COLOR_FORMAT), 3)


def weighted_texels_shape(model: TextureFilter) -> data.StructLayout:
    """Shape of the texels of four banks, with the weights of odd columns and of odd rows.

    Parameters
    ----------
    model : TextureFilter
        Bit-accurate model, with the bits of a weight.
    """
    weight = FixedShape(UQ(1, model.share_bits if model.bilinear else 0))
    return data.StructLayout({"texels": texels_shape(), "weight": data.ArrayLayout(weight, 2)})


class TextureFilterUnit(PipelinedUnit):
    """Mean of four texels, first along two rows, then from row to row.

    Formats and error are those of `TextureFilter`, the bit-accurate model. With an initiation interval of 1
    there are nine multipliers. With a longer interval the six means of rows share ``ceil(6 / interval)``
    multipliers, and the three means of columns share ``ceil(3 / interval)``. For ``nearest`` alone there is
    no multiplier. The latency is 9 cycles at an interval of 1, and 3 for ``nearest`` alone.

    Parameters
    ----------
    model : TextureFilter
        Bit-accurate model.
    initiation_interval : int
        Cycles from an input to the next, at least 1.

    Members
    -------
    i : :py:`In(stream.Signature(weighted_texels_shape(model)))`
        Texels and weights.
    o : :py:`Out(stream.Signature(albedo_shape()))`
        Colours.

    Source: docs/theory/textures.md#filter.
    """

    def __init__(self, model: TextureFilter | None = None, initiation_interval: int = 1):
        self.model = p = model or TextureFilter()
        self._graph = Dataflow(initiation_interval, memories=True)
        self._colors = self._means() if p.bilinear else self._nearest()
        super().__init__(
            weighted_texels_shape(p),
            albedo_shape(),
            latency=max(word.stage for word in self._colors),
            initiation_interval=initiation_interval,
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        at = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        m.d.comb += [
            found.eq(at(word, self.latency)) for found, word in zip(result, self._colors, strict=True)
        ]
        return result

    def _texels(self, channel: int) -> list[Word]:
        return [
            self._graph.input(
                f"texel_{bank}_{'rgb'[channel]}",
                lambda operands, bank=bank: operands.texels[bank][channel],
                f"c_{bank}",
            )
            for bank in range(BANKS)
        ]

    def _weight(self, axis: int) -> Word:
        return self._graph.input(
            f"weight_{'uv'[axis]}", lambda operands: operands.weight[axis], f"w_{'uv'[axis]}"
        )

    def _means(self) -> list[Word]:
        """Words of the colours by nine means."""
        g = self._graph
        share = unsigned(self.model.share_bits + 1)
        rows = g.share("row", (unsigned(_CHANNEL), unsigned(_CHANNEL), share), 3, self._row)
        means = g.share("mean", (unsigned(_ROW), unsigned(_ROW), share), 3, self._mean)
        across, down = (self._weight(axis) for axis in (0, 1))
        colors = []
        for channel, name in enumerate("rgb"):
            texels = self._texels(channel)
            of_rows = [
                g.use(
                    rows,
                    f"{place}_{name}",
                    (*texels[2 * k : 2 * k + 2], across),
                    lambda a, b, w: (a, b, w),
                    lambda total: total[1:],
                    formula=f"c_{2 * k} + w_u·(c_{2 * k + 1} − c_{2 * k})",
                )
                for k, place in enumerate(("even", "odd"))
            ]
            mean = g.use(
                means,
                f"mean_{name}",
                (*of_rows, down),
                lambda a, b, w: (a, b, w),
                formula="a + w_v·(b − a)",
            )
            colors.append(g.register(f"color_{name}", _color, mean, formula="mean"))
        return colors

    def _nearest(self) -> list[Word]:
        """Words of the colours: one texel is chosen."""
        g = self._graph
        across, down = (self._weight(axis) for axis in (0, 1))
        colors = []
        for channel, name in enumerate("rgb"):
            chosen = g.register(
                f"chosen_{name}",
                lambda *words: select(words[:BANKS], Cat(Value.cast(word) for word in words[BANKS:])),
                *self._texels(channel),
                across,
                down,
            )
            value = g.register(f"value_{name}", _value, chosen)
            colors.append(
                g.register(f"color_{name}", lambda value: _color(Cat(Const(2, 4), value)), value, formula="c")
            )
        return colors

    def _row(self, register, a, b, weight):
        """Mean of two texels with 18 fraction bits, plus half a step of the colour and of a row."""
        a, b = _value(a), _value(b)
        difference = register((b - a).as_signed(), "difference")
        start = Cat(Const(3, 4), register(register(a, "start"), "start_behind"))
        return self._sum(register, difference, weight, start, _VALUE)

    def _mean(self, register, a, b, weight):
        """Mean of two rows."""
        difference = register((b - a).as_signed(), "difference")
        start = Cat(Const(0, 1), register(register(a, "start"), "start_behind"))
        return self._sum(register, difference, weight, start, _ROW)

    def _sum(self, register, difference, weight, start, fraction_bits):
        """Sum ``start + w difference``, where w is the weight. The difference has ``fraction_bits``."""
        weight = register(weight, "weight")
        cut = fraction_bits + self.model.share_bits - _MEAN
        product = register((difference * weight)[cut : cut + _MEAN + 1].as_signed(), "product")
        return register((start + product)[:_MEAN], "sum")


def _value(code: Value) -> Value:
    """Code of a channel in `TexelMemory.VALUE_FORMAT`."""
    number = code[:-1]
    shift = TexelMemory.COARSE_SHIFT
    return Mux(code[-1], Cat(Const((1 << shift) - 1, shift), number), number)[:_VALUE]


def _color(mean: Value) -> FixedValue:
    """Colour of a mean. In the mean the largest code stands for 1."""
    total = mean + mean[_VALUE:]
    return FixedValue(TextureFilter.COLOR_FORMAT, total[2 : 2 + TextureFilter.COLOR_FORMAT.width])
