"""Chord values unit: N·L and half the squared chord from N to H of a normal, for every light."""

from amaranth.hdl import Mux, Signal
from amaranth.lib import data

from blysk.golden.cosines.chord_values import ChordValues
from blysk.hdl.core.dataflow import Dataflow, dot
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import light_vectors_shape, normal_shape
from blysk.hdl.core.stream import PipelinedUnit
from blysk.hdl.cosines.chord import chord_exact

__all__ = ["ChordValuesUnit", "light_values_shape"]


def light_values_shape(lights: int, *, highlights: bool = True) -> data.ArrayLayout:
    """Shape of N·L and u of each light at one place.

    Parameters
    ----------
    lights : int
        Number of lights.
    highlights : bool
        Whether there is u.
    """
    light = {"diffuse": FixedShape(ChordValues.DIFFUSE_FORMAT)}
    if highlights:
        light["highlight"] = FixedShape(ChordValues.HIGHLIGHT_FORMAT)
    return data.ArrayLayout(data.StructLayout(light), lights)


class ChordValuesUnit(PipelinedUnit):
    """``f = N·L`` and ``u = |N - H|^2 / 2`` of a unit normal; `ChordValues` is the bit-accurate model.

    Six products a light, three without highlights, share multipliers of 18x18 bits: ``ceil(6 lights / I)`` of
    them, I the initiation interval, or one or two more. With I = 1 the latency is 9 cycles. Beats come at
    any distance from I on.

    Parameters
    ----------
    parameters : ChordValues
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    initiation_interval : int
        Least cycles from an input to the next, at least 1.
    highlights : bool
        Whether there is u.

    Members
    -------
    i : :py:`In(stream.Signature(ArrayLayout(SQ(1, 17), 3)))`
        Unit normals.
    o : :py:`Out(stream.Signature(light_values_shape(lights, highlights=highlights)))`
        Values.
    constants : :py:`In(light_vectors_shape(lights))`
        Unit vectors L and H, constant while beats are inside.

    Source: docs/theory/chord.md#differences; [Lyon93].
    """

    def __init__(
        self,
        parameters: ChordValues | None = None,
        lights: int = 1,
        *,
        initiation_interval: int = 1,
        highlights: bool = True,
    ):
        self.parameters = p = parameters or ChordValues()
        self.lights = lights
        self.highlights = highlights
        self._graph = g = Dataflow(initiation_interval, spaced=True)
        normal = g.input("normal", lambda operands: operands)
        self._words = []
        for i in range(lights):
            cosine = dot(
                g, f"f_{i}_exact", normal, lambda _, i=i: self.constants[i].direction, symbol=f"L_{i}"
            )
            words = {"diffuse": self._rounded(f"f_{i}", cosine, p.DIFFUSE_FORMAT)}
            if highlights:
                u = chord_exact(g, f"u_{i}_exact", normal, lambda i=i: self.constants[i].halfway, f"H_{i}")
                words["highlight"] = self._rounded(f"u_{i}", u, p.HIGHLIGHT_FORMAT, p.scale)
            self._words.append(words)
        self.multipliers = g.multiplier.count
        super().__init__(
            normal_shape(),
            light_values_shape(lights, highlights=highlights),
            latency=max(word.stage for words in self._words for word in words.values()),
            initiation_interval=initiation_interval,
            constants=light_vectors_shape(lights),
            spaced=True,
        )

    def _rounded(self, name, word, format, scale=0):
        """A word, times ``2^scale``, rounded to a format of fewer bits; if scaled, at most 1: two cycles."""

        def limited(value):
            value = value.saturate(format)
            if not scale:
                return value
            one, code = 1 << format.fraction_bits, value.as_value()
            return FixedValue(format, Mux(code[-1], one, code)[: format.width])

        rounded = self._graph.register(
            f"{name}_rounded", lambda value: value.scale(scale).round_half_up(format.fraction_bits), word
        )
        return self._graph.register(name, limited, rounded)

    def datapath(self, m, operands):
        """Describe the registers of the graph."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for light, words in zip(result, self._words, strict=True):
            m.d.comb += [light[name].eq(value(word, self.latency)) for name, word in words.items()]
        return result
