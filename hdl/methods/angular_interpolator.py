"""The angular method ([T] 3.1, 3.2): cosines of angles in equal steps on the great circle."""

from amaranth.hdl import Module
from amaranth.lib import stream

from blysk.golden.methods.angular_interpolator import AngularInterpolator
from blysk.golden.number.fixed import UQ
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.stream import SLICE_LATENCY, connect_slice
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit, highlight_shape
from blysk.hdl.methods.interpolator import InterpolatorUnit

__all__ = ["AngularInterpolatorUnit"]


class AngularInterpolatorUnit(InterpolatorUnit, model=AngularInterpolator):
    """Angular setup and highlight cosine in series, for L and for H of each light in parallel.

    `AngularInterpolator` is the bit-accurate model. All series are equal and have the same input and the same
    ready of the output. So they are in the same state on every cycle, and the handshake of one series stands
    for all. There are two multipliers for each vector, and the multipliers of the angular setup.

    Parameters
    ----------
    model : AngularInterpolator
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`, with a ``setup_interval`` of 1 to 6.

    Source: docs/theory/interpolation.md#angular-method; [T] 3.1, 3.2.
    """

    @classmethod
    def setup_intervals(cls, model):
        """Initiation intervals of the angular setup."""
        return range(1, 7)

    def __init__(self, model: AngularInterpolator, lights: int, **options):
        super().__init__(model, lights, **options)
        self._chains = {
            (light, name): (
                AngularSetupUnit(model.setup, initiation_interval=self.setup_interval),
                HighlightCosineUnit(),
            )
            for light in range(lights)
            for name in (("direction", "halfway") if self.highlights else ("direction",))
        }
        setup, cosine = self._chains[0, "direction"]
        self.latency = setup.latency + SLICE_LATENCY + cosine.latency

    def elaborate(self, platform):
        """Setup, register slice and cosine for each vector."""
        m = Module()
        one = FixedValue.constant(UQ(1, 25), 1)
        for (light, name), (setup, cosine) in self._chains.items():
            m.submodules[f"setup_{name}_{light}"] = setup
            m.submodules[f"cosine_{name}_{light}"] = cosine
            prepared = stream.Signature(highlight_shape()).create(path=(f"prepared_{name}_{light}",))
            m.d.comb += [
                copy(setup.i.payload.normal_left, self.i.payload.normal_left),
                copy(setup.i.payload.normal_right, self.i.payload.normal_right),
                setup.i.payload.length.eq(self.i.payload.length),
                copy(setup.i.payload.vector, self.constants[light][name]),
                setup.i.valid.eq(self.i.valid),
                *copy_fields(prepared.payload, setup.o.payload, ("phase", "step", "cos_beta", "length")),
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
