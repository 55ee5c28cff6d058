"""The chord method for point lights and a near viewer: three values of N·L and of the chord a span."""

from amaranth.hdl import Module
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.stream import SLICE_LATENCY, connect, connect_slice
from blysk.hdl.cosines.local_chord_setup import LocalChordSetupUnit, span_values_shape
from blysk.hdl.methods.chord_interpolator import ChordAccumulatorUnit
from blysk.hdl.methods.interpolator import operands_shape

__all__ = ["LocalChordInterpolatorUnit"]


class LocalChordInterpolatorUnit(wiring.Component):
    """Local chord setup, then accumulators: spans with values in, the operands of their pixels out.

    `LocalChordInterpolator` is the twin. No multiplier a pixel; those of the
    setup are ``ceil((1 + 5 lights) / setup_interval)``, without highlights ``ceil((1 + 2 lights) /
    setup_interval)``.

    An `InterpolatorUnit` but for its input, which has values in place of normals, and the
    vectors of the lights, which it does not need.

    Parameters
    ----------
    parameters : LocalChordInterpolator
        Twin.
    lights : int
        Number of lights, at least 1.
    setup_interval : int
        Clocks from a span to the next at the closest, at least 1.
    highlights : bool
        Whether there is specular light; else there are no values and no operands of it.
    length_bits : int
        Bits of the length.

    Members
    -------
    i : :py:`In(stream.Signature(span_values_shape(lights, highlights, length_bits)))`
        Spans of length 1 or more.
    o : :py:`Out(stream.Signature(operands_shape(parameters, lights, highlights)))`
        Operands of the pixels.
    wide : :py:`Out(1)`
        High for one clock for each span of which a word does not fit.

    Source: chord.md.
    """

    cycles_per_pixel = 1

    @classmethod
    def setup_intervals(cls, parameters):
        """What the setup can be built for."""
        return range(1, 7)

    def __init__(
        self,
        parameters: LocalChordInterpolator,
        lights: int,
        setup_interval: int = 4,
        *,
        highlights: bool = True,
        length_bits: int = LENGTH_BITS,
    ):
        self.parameters = parameters
        self.lights = lights
        self.setup_interval = setup_interval
        self.highlights = highlights
        self.length_bits = length_bits
        self._setup = LocalChordSetupUnit(lights, setup_interval, length_bits, highlights)
        self._accumulator = ChordAccumulatorUnit(lights, highlights)
        self.latency = self._setup.latency + SLICE_LATENCY + self._accumulator.latency
        super().__init__(
            {
                "i": In(stream.Signature(span_values_shape(lights, highlights, length_bits))),
                "o": Out(stream.Signature(operands_shape(parameters, lights, highlights))),
                "out_of_range": Out(1),
            }
        )

    def elaborate(self, platform):
        """Registers between the two hold spans ready, so that a long one pays for short ones after it."""
        m = Module()
        m.submodules.local_chord_setup = setup = self._setup
        m.submodules.chord_accumulator = accumulator = self._accumulator
        connect(m, wiring.flipped(self.i), setup.i)
        connect_slice(m, setup.o, accumulator.i)
        connect(m, accumulator.o, wiring.flipped(self.o))
        m.d.comb += self.out_of_range.eq(setup.o.valid & setup.o.ready & setup.o.payload.out_of_range)
        return m
