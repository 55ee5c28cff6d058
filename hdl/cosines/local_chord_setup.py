"""Local chord setup: forward differences of N·L and of half the squared chord, from three values a span."""

from amaranth.hdl import Cat, unsigned
from amaranth.lib import data

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.cosines.local_chord_setup import LocalChordSetup
from blysk.golden.number.fixed import Format
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.dataflow import Dataflow, Word
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.reciprocal import checked_length_bits
from blysk.hdl.cosines.chord_setup import (
    ChordDifferencesUnit,
    chord_differences_shape,
    difference_words,
    shared_shifters,
    step_words,
)

__all__ = ["LocalChordSetupUnit", "span_values_shape"]


def span_values_shape(
    lights: int, highlights: bool = True, length_bits: int = LENGTH_BITS
) -> data.StructLayout:
    """Shape of a span that carries, for each light, N·L and u at its first pixel, middle and last pixel."""
    light = {"diffuse": data.ArrayLayout(FixedShape(LocalChordSetup.DIFFUSE_FORMAT), 3)}
    if highlights:
        light["highlight"] = data.ArrayLayout(FixedShape(LocalChordSetup.HIGHLIGHT_FORMAT), 3)
    return data.StructLayout(
        {"values": data.ArrayLayout(data.StructLayout(light), lights), "length": unsigned(length_bits)}
    )


class LocalChordSetupUnit(ChordDifferencesUnit):
    """Differences of ``f = N·L`` and ``u = |N - H|^2 / 2`` along a span, from three values of each.

    Formats and error bounds are those of `LocalChordSetup`, the bit-true twin.

    One product of a span, 3 of each u and 2 of each f take turns at ``ceil((1 + 5 lights) / I)`` multipliers
    of 18x18 bits, I the initiation interval: 2 for one light and an interval of 4. Without highlights there
    are 2 products a light. A table of ``2^(length_bits - 1)`` words of 17 bits holds the reciprocals. The
    latency, `latency`, follows from the turns.

    Parameters
    ----------
    lights : int
        Number of lights, 1 or more.
    initiation_interval : int
        Distance in cycles of two inputs, at least 1.
    length_bits : int
        Bits of the length, 2 to 12: spans have at most ``2^length_bits - 1`` pixels.
    highlights : bool
        Whether there is u.

    Raises
    ------
    ValueError
        If `initiation_interval` or `length_bits` is none of those.

    Members
    -------
    i : :py:`In(stream.Signature(span_values_shape(lights, highlights, length_bits)))`
        Spans; their length is at least 1.
    o : :py:`Out(stream.Signature(chord_differences_shape(lights, highlights)))`
        Starts and differences; the length; ``out_of_range``: a word does not fit, and they mean nothing.

    Source: chord.md.
    """

    def __init__(
        self,
        lights: int = 1,
        initiation_interval: int = 4,
        length_bits: int = LENGTH_BITS,
        highlights: bool = True,
    ):
        self.parameters = LocalChordSetup()
        self.highlights = highlights
        self.lights = lights
        self.length_bits = checked_length_bits(length_bits)
        self._graph = Dataflow(initiation_interval, 1 + (5 if highlights else 2) * lights)
        self.multipliers = self._graph.multiplier.count
        self._shifters = shared_shifters(self._graph, (4 if highlights else 2) * lights, ChordSetup())
        self._results = self._describe()
        super().__init__(
            span_values_shape(lights, highlights, length_bits),
            chord_differences_shape(lights, highlights),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
        )

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, self.parameters
        length = g.input("length", lambda operands: operands.length)
        steps = step_words(g, length, self.length_bits)
        functions = [("diffuse", p.DIFFUSE_SLOPE_FORMAT)]
        if self.highlights:
            functions.insert(0, ("highlight", p.SLOPE_FORMAT))
        results, flags = {"length": length}, []
        for i in range(self.lights):
            for function, slope_format in functions:
                start, slope, bend = self._quadratic(i, function, slope_format, flags)
                words = difference_words(
                    g,
                    self._shifters,
                    f"{function}_{i}",
                    start,
                    slope,
                    bend,
                    steps,
                    has_low=slope_format.width > ChordSetup.HIGH_FORMAT.width,
                    parameters=ChordSetup(),
                )
                results.update({(i, function, name): word for name, word in words.items()})
        results["out_of_range"] = g.register("out_of_range", lambda *flags: Cat(flags).any(), *flags)
        return results

    def _quadratic(self, i: int, function: str, slope_format: Format, flags: list[Word]):
        """``v_l``, P and G of a function; what does not fit is flagged."""
        g, p = self._graph, self.parameters
        name = f"{function}_{i}"
        values = g.input(name, lambda operands: operands["values"][i][function])
        start = g.wire(f"{name}_start", lambda v: v[0], values)
        ends = g.register(f"{name}_ends", lambda v: v[0] + v[2], values)
        rise = g.register(f"{name}_rise", lambda v: v[2] - v[0], values)
        exact = g.register(
            f"{name}_bend_exact", lambda ends, v: (ends - v[1].scale(1)).scale(1), ends, values
        )
        exact = g.register(
            f"{name}_bend_rounded", lambda x: x.round_half_up(p.BEND_FORMAT.fraction_bits), exact
        )
        bend = g.register(f"{name}_bend", lambda x: x.saturate(p.BEND_FORMAT), exact)
        flags.append(g.register(f"{name}_bend_wide", lambda x: _exceeds(x, p.BEND_FORMAT), exact))
        exact = g.register(f"{name}_slope_exact", lambda rise, bend: rise - bend, rise, bend)
        exact = g.register(
            f"{name}_slope_rounded", lambda x: x.round_half_up(slope_format.fraction_bits), exact
        )
        slope = g.register(f"{name}_slope", lambda x: x.saturate(slope_format), exact)
        flags.append(g.register(f"{name}_slope_wide", lambda x: _exceeds(x, slope_format), exact))
        return start, slope, bend


def _exceeds(x, format: Format):
    """Whether a signed format of the same fraction bits does not hold a value."""
    above = x.as_value()[format.width - 1 :]
    return above.any() & ~above.all()
