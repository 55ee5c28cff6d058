"""The chord method: scalar forward differences of N·L and of the squared chord from N to H (chord.md)."""

from amaranth.hdl import Module
from amaranth.lib import wiring

from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.hdl.core.stream import SLICE_LATENCY, connect, connect_slice
from blysk.hdl.cosines.chord_setup import ChordSetupUnit, chord_differences_shape
from blysk.hdl.methods.interpolator import InterpolatorUnit, operands_shape
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit

__all__ = ["ChordAccumulatorUnit", "ChordInterpolatorUnit"]


class ChordAccumulatorUnit(AccumulatorUnit):
    """``N . L`` and u of each light, two quadratics a light; see `AccumulatorUnit`.

    Parameters
    ----------
    lights : int
        Number of lights, at least 1.
    highlights : bool
        Whether there is u.
    parameters : ChordInterpolator
        Formats.
    """

    def __init__(self, lights: int, highlights: bool = True, parameters: ChordInterpolator | None = None):
        self.parameters = p = parameters or ChordInterpolator()
        self.functions = ("diffuse", "highlight") if highlights else ("diffuse",)
        super().__init__(
            chord_differences_shape(lights, highlights, p.setup), operands_shape(p, lights, highlights)
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


class ChordInterpolatorUnit(InterpolatorUnit):
    """Chord setup, then accumulators; `ChordInterpolator` is the twin.

    No multiplier a pixel; those of the setup are ``ceil((7 + 19 lights) / setup_interval)``, without
    highlights ``ceil((7 + 9 lights) / setup_interval)``.

    Parameters
    ----------
    parameters : ChordInterpolator
        Twin.
    lights : int
        Number of lights, at least 1.
    setup_interval : int
        Clocks from a span to the next at the closest, at least 1.
    options
        As for `InterpolatorUnit`.

    Source: chord.md.
    """

    @classmethod
    def setup_intervals(cls, parameters):
        """What the setup can be built for."""
        return range(1, 27)

    def __init__(self, parameters: ChordInterpolator, lights: int, setup_interval: int = 4, **options):
        super().__init__(parameters, lights, **options)
        self.setup_interval = setup_interval
        self._setup = ChordSetupUnit(
            parameters.setup,
            lights,
            initiation_interval=setup_interval,
            length_bits=self.length_bits,
            highlights=self.highlights,
        )
        self._accumulator = ChordAccumulatorUnit(lights, self.highlights, parameters)
        self.latency = self._setup.latency + SLICE_LATENCY + self._accumulator.latency

    def elaborate(self, platform):
        """Registers between the two hold spans ready, so that a long one pays for short ones after it."""
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
