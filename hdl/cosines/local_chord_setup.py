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
    """Shape of a span with N·L and u of each light at the first pixel, in the middle, at the last pixel."""
    light = {"diffuse": data.ArrayLayout(FixedShape(LocalChordSetup.DIFFUSE_FORMAT), 3)}
    if highlights:
        light["highlight"] = data.ArrayLayout(FixedShape(LocalChordSetup.HIGHLIGHT_FORMAT), 3)
    return data.StructLayout(
        {"values": data.ArrayLayout(data.StructLayout(light), lights), "length": unsigned(length_bits)}
    )


class LocalChordSetupUnit(ChordDifferencesUnit):
    """Differences of ``f = N·L`` and ``u = |N - H|^2 / 2`` along a span, from three values of each.

    `LocalChordSetup` is the bit-accurate model; it has formats and error bounds.

    One product of a span, 3 of each u and 2 of each f share ``ceil((1 + 5 lights) / I)`` multipliers of 18x18
    bits, I the initiation interval: 2 multipliers for one light and I = 4. Without highlights a light has 2
    products. A table of ``2^(length_bits - 1)`` words of 17 bits holds the reciprocals. The attribute
    ``latency`` depends on how the products share the multipliers.

    Parameters
    ----------
    parameters : LocalChordSetup
        Bit-accurate model.
    lights : int
        Number of lights, 1 or more.
    initiation_interval : int
        Cycles from an input to the next, at least 1.
    length_bits : int
        Bits of the length, 2 to 12: spans have at most ``2^length_bits - 1`` pixels.
    highlights : bool
        Whether there are differences of u.

    Raises
    ------
    ValueError
        If ``initiation_interval`` or ``length_bits`` is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(span_values_shape(lights, highlights, length_bits)))`
        Spans; the length is at least 1.
    o : :py:`Out(stream.Signature(chord_differences_shape(lights, highlights)))`
        Starts and differences; the length; ``out_of_range``: P or G does not fit its word, and the
        differences are invalid.

    Source: docs/theory/chord.md#local-lights.
    """

    def __init__(
        self,
        parameters: LocalChordSetup | None = None,
        lights: int = 1,
        *,
        initiation_interval: int = 4,
        length_bits: int = LENGTH_BITS,
        highlights: bool = True,
    ):
        self.parameters = parameters or LocalChordSetup()
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
                start, slope, curvature = self._quadratic(i, function, slope_format, flags)
                words = difference_words(
                    g,
                    self._shifters,
                    f"{function}_{i}",
                    start,
                    slope,
                    curvature,
                    steps,
                    has_low=slope_format.width > ChordSetup.HIGH_FORMAT.width,
                    parameters=ChordSetup(),
                )
                results.update({(i, function, name): word for name, word in words.items()})
        results["out_of_range"] = g.register("out_of_range", lambda *flags: Cat(flags).any(), *flags)
        return results

    def _quadratic(self, i: int, function: str, slope_format: Format, flags: list[Word]):
        """Words of ``v_l``, P and G of f or u; the flags get a word where P or G is out of range."""
        g, p = self._graph, self.parameters
        name = f"{function}_{i}"
        values = g.input(name, lambda operands: operands["values"][i][function])
        start = g.wire(f"{name}_start", lambda v: v[0], values)
        ends = g.register(f"{name}_ends", lambda v: v[0] + v[2], values)
        rise = g.register(f"{name}_rise", lambda v: v[2] - v[0], values)
        exact = g.register(
            f"{name}_curvature_exact", lambda ends, v: (ends - v[1].scale(1)).scale(1), ends, values
        )
        exact = g.register(
            f"{name}_curvature_rounded", lambda x: x.round_half_up(p.CURVATURE_FORMAT.fraction_bits), exact
        )
        curvature = g.register(f"{name}_curvature", lambda x: x.saturate(p.CURVATURE_FORMAT), exact)
        flags.append(self._flag(f"{name}_curvature", exact, p.CURVATURE_FORMAT))
        exact = g.register(f"{name}_slope_exact", lambda a, b: a - b, rise, curvature)
        exact = g.register(
            f"{name}_slope_rounded", lambda x: x.round_half_up(slope_format.fraction_bits), exact
        )
        slope = g.register(f"{name}_slope", lambda x: x.saturate(slope_format), exact)
        flags.append(self._flag(f"{name}_slope", exact, slope_format))
        return start, slope, curvature

    def _flag(self, name: str, exact: Word, format: Format) -> Word:
        """Whether a signed format of the same fraction bits does not hold a value."""

        def exceeds(value):
            above = value.as_value()[format.width - 1 :]
            return above.any() & ~above.all()

        return self._graph.register(f"{name}_out_of_range", exceeds, exact)
