"""The chord method: forward differences of N·L and of half the squared chord from N to H."""

from amaranth.hdl import Module
from amaranth.lib import wiring

from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.hdl.core.stream import SLICE_LATENCY, connect, connect_slice
from blysk.hdl.cosines.chord_setup import ChordSetupUnit, chord_differences_shape
from blysk.hdl.methods.interpolator import InterpolatorUnit
from blysk.hdl.methods.light_products import operands_shape
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit

__all__ = ["ChordAccumulatorUnit", "ChordInterpolatorUnit"]


class ChordAccumulatorUnit(AccumulatorUnit):
    """``N . L`` and u of each light, two quadratics a light; see `AccumulatorUnit`.

    Parameters
    ----------
    parameters : ChordInterpolator
        Formats.
    lights : int
        Number of lights, at least 1.
    highlights : bool
        Whether there is u.
    """

    def __init__(
        self, parameters: ChordInterpolator | None = None, lights: int = 1, *, highlights: bool = True
    ):
        self.parameters = p = parameters or ChordInterpolator()
        self.functions = ("diffuse", "highlight") if highlights else ("diffuse",)
        super().__init__(
            chord_differences_shape(lights, highlights, p.setup),
            operands_shape(p, lights, highlights=highlights),
        )

    def quadratics(self, values):
        """Those of each light."""
        for index, light in enumerate(self.i.payload.lights):
            result = values[index]
            for name in self.functions:
                span = light[name]
                parameters = self.parameters.accumulators[name]
                value = result["cosine" if name == "diffuse" else name]
                yield f"{name}_{index}", parameters, (span.start, span.first, span.second), value


class ChordInterpolatorUnit(InterpolatorUnit, parameters=ChordInterpolator):
    """Chord setup, then accumulators; `ChordInterpolator` is the bit-accurate model.

    No multiplier a pixel; those of the setup are ``ceil((7 + 19 lights) / setup_interval)``, without
    highlights ``ceil((7 + 9 lights) / setup_interval)``.

    Parameters
    ----------
    parameters : ChordInterpolator
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`; ``setup_interval`` is 1 to 26.

    Source: docs/theory/chord.md#differences.
    """

    @classmethod
    def setup_intervals(cls, parameters):
        """Initiation intervals of the chord setup that save multipliers of one light."""
        return range(1, 27)

    def __init__(self, parameters: ChordInterpolator, lights: int, **options):
        super().__init__(parameters, lights, **options)
        self._setup = ChordSetupUnit(
            parameters.setup,
            lights,
            initiation_interval=self.setup_interval,
            length_bits=self.length_bits,
            highlights=self.highlights,
        )
        self._accumulator = ChordAccumulatorUnit(parameters, lights, highlights=self.highlights)
        self.latency = self._setup.latency + SLICE_LATENCY + self._accumulator.latency

    def elaborate(self, platform):
        """A register slice between the two holds spans, so that short spans after a long one are ready."""
        m = Module()
        m.submodules.chord_setup = setup = self._setup
        m.submodules.chord_accumulator = accumulator = self._accumulator
        connect(m, wiring.flipped(self.i), setup.i)
        connect_slice(m, setup.o, accumulator.i)
        connect(m, accumulator.o, wiring.flipped(self.o))
        m.d.comb += [
            setup.constants.eq(self.constants),
            self.out_of_range.eq(setup.o.valid & setup.o.ready & setup.o.payload.out_of_range),
        ]
        return m
