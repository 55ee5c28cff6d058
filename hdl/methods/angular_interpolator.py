"""The angular method ([T] 3.1, 3.2): cosines of angles that grow evenly along the great circle."""

from amaranth.hdl import Module
from amaranth.lib import stream

from blysk.golden.methods.angular_interpolator import AngularInterpolator
from blysk.golden.number.fixed import UQ
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.stream import SLICE_LATENCY, connect_slice
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit, highlight_shape
from blysk.hdl.methods.interpolator import InterpolatorUnit

__all__ = ["AngularInterpolatorUnit"]


class AngularInterpolatorUnit(InterpolatorUnit):
    """Angular setup and highlight cosine, once for L and once for H of each light, side by side.

    `AngularInterpolator` is the twin. All chains are equal, are offered the same
    spans and taken from on the same cycles, so what holds of one handshake holds of the others. Two
    multipliers a vector, and those of the angular setup.

    Parameters
    ----------
    parameters : AngularInterpolator
        Twin.
    lights : int
        Number of lights, at least 1.
    setup_interval : int
        Clocks from a span to the next at the closest, 1 to 6.
    options
        As for `InterpolatorUnit`.

    Source: [T] 3.1, 3.2.
    """

    @classmethod
    def setup_intervals(cls, parameters):
        """What the setup can be built for."""
        return range(1, 7)

    def __init__(self, parameters: AngularInterpolator, lights: int, setup_interval: int = 4, **options):
        super().__init__(parameters, lights, **options)
        self.setup_interval = setup_interval
        self._chains = {
            (light, name): (AngularSetupUnit(parameters.setup, setup_interval), HighlightCosineUnit())
            for light in range(lights)
            for name in (("direction", "halfway") if self.highlights else ("direction",))
        }
        setup, cosine = self._chains[0, "direction"]
        self.latency = setup.latency + SLICE_LATENCY + cosine.latency

    def elaborate(self, platform):
        """Chains in lockstep, each with registers that hold spans ready."""
        m = Module()
        one = FixedValue.constant(UQ(1, 25), 1)
        for (light, name), (setup, cosine) in self._chains.items():
            m.submodules[f"setup_{name}_{light}"] = setup
            m.submodules[f"cosine_{name}_{light}"] = cosine
            prepared = stream.Signature(highlight_shape()).create(path=(f"prepared_{name}_{light}",))
            m.d.comb += [
                setup.i.payload.normal_left.eq(self.i.payload.normal_left),
                setup.i.payload.normal_right.eq(self.i.payload.normal_right),
                setup.i.payload.length.eq(self.i.payload.length),
                setup.i.payload.vector.eq(self.constants[light][name]),
                setup.i.valid.eq(self.i.valid),
                *(
                    prepared.payload[field].eq(setup.o.payload[field])
                    for field in ("phase", "step", "cos_beta", "length")
                ),
                prepared.valid.eq(setup.o.valid),
                setup.o.ready.eq(prepared.ready),
                cosine.o.ready.eq(self.o.ready),
            ]
            connect_slice(m, prepared, cosine.i)
            result = self.o.payload[light]
            if name == "halfway":
                m.d.comb += result.highlight.eq(cosine.o.payload)
            else:
                m.d.comb += result.cosine.eq(one - cosine.o.payload)
        setup, cosine = self._chains[0, "direction"]
        m.d.comb += [
            self.i.ready.eq(setup.i.ready),
            self.o.valid.eq(cosine.o.valid),
            self.out_of_range.eq(setup.o.valid & setup.o.ready & setup.o.payload.out_of_range),
        ]
        return m
