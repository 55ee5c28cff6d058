"""Record of the angular interpolator."""

from blysk.golden.methods.angular_interpolator import PUBLISHED, AngularInterpolator
from blysk.sim.units.methods.interpolator import STIMULI, expect, measured, options, status
from blysk.sim.units.record import Record

__all__ = ["RECORD"]

_ANGULAR = AngularInterpolator()


def _variants():
    yield "angular", measured(_ANGULAR)
    yield "angular, interval 1", options(_ANGULAR, 2, setup_interval=1)
    yield "angular, interval 6, no highlights", options(_ANGULAR, setup_interval=6, highlights=False)
    for method in PUBLISHED:
        yield method.name, options(method, as_published=True)


RECORD = Record(
    name="angular_interpolator",
    title="Cosines of angles in equal steps on the great circle",
    source="docs/theory/interpolation.md#angular-method; [T] 3.1, 3.2",
    variants=dict(_variants()),
    expect=expect,
    status=status,
    stimuli=STIMULI,
)
