"""Record of the linear interpolator."""

from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.sim.units.methods.interpolator import STIMULI, expect, measured, options, status
from blysk.sim.units.record import Record

__all__ = ["RECORD"]

_LINE, _RENORMALISED = LinearInterpolator(), LinearInterpolator(renormalised=True)

RECORD = Record(
    name="linear_interpolator",
    title="Normals on a straight line, as they are or brought to unit length",
    source="docs/theory/interpolation.md#spans; [T] 2.1",
    variants={
        "linear": measured(_LINE),
        "renormalise": measured(_RENORMALISED, source="docs/theory/interpolation.md#renormaliser"),
        "linear, interval 1, of a chord": options(
            LinearInterpolator("one_minus_cosine"), 2, setup_interval=1, length_bits=9
        ),
        "linear, interval 7, no highlights": options(_LINE, setup_interval=7, highlights=False),
        "renormalise, interval 1": options(_RENORMALISED, setup_interval=1),
        "renormalise, interval 7, compact": options(_RENORMALISED, 2, setup_interval=7, product_interval=3),
    },
    expect=expect,
    status=status,
    stimuli=STIMULI,
)
