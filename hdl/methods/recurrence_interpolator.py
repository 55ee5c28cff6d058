"""The recurrence method ([T] 3.3): cosines of equal steps on the great circle, one product each."""

from amaranth.hdl import Module

from blysk.golden.methods.recurrence_interpolator import RecurrenceInterpolator
from blysk.golden.number.fixed import UQ
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.stream import SLICE_LATENCY, connect_slice
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.hdl.cosines.recurrence_setup import RecurrenceSetupUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit, span_words

__all__ = ["RecurrenceInterpolatorUnit"]


class RecurrenceInterpolatorUnit(InterpolatorUnit, model=RecurrenceInterpolator):
    """Recurrence setup, then recurrence units for L and H of each light.

    `RecurrenceInterpolator` is the bit-accurate model. All recurrence units are equal and have the same input
    and the same ready of the output. So they are in the same state on every cycle. There are two multipliers
    for each light, and ``ceil((14 + 32 lights) / setup_interval)`` in the setup. Without highlights the units
    are the same, and the results of H are not used.

    Parameters
    ----------
    model : RecurrenceInterpolator
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`, with a ``setup_interval`` of 1 to 46.

    Source: docs/theory/interpolation.md#recurrence; [T] 3.1, 3.3, figure 3.5.
    """

    @classmethod
    def setup_intervals(cls, model):
        """Initiation intervals of the recurrence setup that save multipliers with one light."""
        return range(1, 47)

    def __init__(self, model: RecurrenceInterpolator, lights: int, **options):
        super().__init__(model, lights, **options)
        self._setup = RecurrenceSetupUnit(model.setup, lights, initiation_interval=self.setup_interval)
        self._recurrences = [RecurrenceUnit(model.setup.recurrence) for _ in range(lights)]
        unit = self._recurrences[0]
        self.latency = self._setup.latency + SLICE_LATENCY + unit.latency

    def elaborate(self, platform):
        """Setup, slice and recurrence units. The slice holds a prepared span, which waits for its turn."""
        m = Module()
        m.submodules.recurrence_setup = setup = self._setup
        m.d.comb += [
            *(setup.i.payload[name].eq(word) for name, word in span_words(self.i.payload)),
            setup.i.valid.eq(self.i.valid),
            self.i.ready.eq(setup.i.ready),
        ]
        prepared = setup.o.signature.create(path=("prepared",))
        connect_slice(m, setup.o, prepared)
        one = FixedValue.constant(UQ(1, 25), 1)
        for light, unit in enumerate(self._recurrences):
            m.submodules[f"recurrence_{light}"] = unit
            starts, result = prepared.payload.lights[light], self.o.payload[light]
            m.d.comb += [
                *copy_fields(unit.i.payload, starts, ("diffuse", "highlight")),
                *(
                    unit.i.payload[name].eq(prepared.payload[name])
                    for name in ("coefficient", "shift", "length")
                    if name in unit.i.payload.shape().members
                ),
                unit.i.valid.eq(prepared.valid),
                unit.o.ready.eq(self.o.ready),
                result.cosine.eq(unit.o.payload.diffuse),
            ]
            if self.highlights:
                highlight = one - unit.o.payload.highlight
                m.d.comb += result.highlight.eq(highlight.saturate(result.highlight.format))
        m.d.comb += [
            prepared.ready.eq(self._recurrences[0].i.ready),
            self.o.valid.eq(self._recurrences[0].o.valid),
            copy(setup.constants, self.constants),
            self.out_of_range.eq(setup.o.valid & setup.o.ready & setup.o.payload.out_of_range),
        ]
        return m
