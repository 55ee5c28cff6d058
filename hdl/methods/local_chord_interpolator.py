"""The chord method for point lights and a near viewer: three values of N·L and of the chord a span."""

from amaranth.hdl import Module
from amaranth.lib import wiring

from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.stream import SLICE_LATENCY, connect, connect_slice
from blysk.hdl.cosines.local_chord_setup import LocalChordSetupUnit, span_values_shape
from blysk.hdl.methods.chord_interpolator import ChordAccumulatorUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit

__all__ = ["LocalChordInterpolatorUnit"]


class LocalChordInterpolatorUnit(InterpolatorUnit, parameters=LocalChordInterpolator):
    """Local chord setup, then accumulators: spans with values in, the operands of their pixels out.

    `LocalChordInterpolator` is the bit-accurate model. No multiplier a pixel; those of the setup are
    ``ceil((1 + 5 lights) / setup_interval)``, without highlights ``ceil((1 + 2 lights) / setup_interval)``.

    Spans carry values in place of normals, so there are no vectors of lights. A span is flagged if one of its
    words does not fit.

    Parameters
    ----------
    parameters : LocalChordInterpolator
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`; ``setup_interval`` is 1 to 6.

    Source: docs/theory/chord.md#local-lights.
    """

    @classmethod
    def setup_intervals(cls, parameters):
        """Initiation intervals of the local chord setup that save multipliers of one light."""
        return range(1, 7)

    @classmethod
    def span_shape(cls, lights, *, highlights=True, length_bits=LENGTH_BITS):
        """Three values of each operand of each light, and the length."""
        return span_values_shape(lights, highlights, length_bits)

    def __init__(self, parameters: LocalChordInterpolator, lights: int, **options):
        super().__init__(parameters, lights, **options)
        self._setup = LocalChordSetupUnit(
            None,
            lights,
            initiation_interval=self.setup_interval,
            length_bits=self.length_bits,
            highlights=self.highlights,
        )
        self._accumulator = ChordAccumulatorUnit(lights=lights, highlights=self.highlights)
        self.latency = self._setup.latency + SLICE_LATENCY + self._accumulator.latency

    def elaborate(self, platform):
        """A register slice between the two holds spans, so that short spans after a long one are ready."""
        m = Module()
        m.submodules.local_chord_setup = setup = self._setup
        m.submodules.chord_accumulator = accumulator = self._accumulator
        connect(m, wiring.flipped(self.i), setup.i)
        connect_slice(m, setup.o, accumulator.i)
        connect(m, accumulator.o, wiring.flipped(self.o))
        m.d.comb += self.out_of_range.eq(setup.o.valid & setup.o.ready & setup.o.payload.out_of_range)
        return m
