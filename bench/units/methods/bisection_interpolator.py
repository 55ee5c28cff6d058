"""Record of the interpolator by bisection."""

from blysk.bench.units.methods.interpolator import STIMULI, expect, measured, options, status
from blysk.bench.units.record import Record
from blysk.golden.methods.bisection_interpolator import PUBLISHED, BisectionInterpolator

__all__ = ["RECORD"]

RECORD = Record(
    name="bisection_interpolator",
    title="Normals on straight lines between points of the great circle",
    source="docs/theory/interpolation.md#adaptive-normaliser; [T] 2.1, figure 2.7",
    variants={
        "bisection": measured(BisectionInterpolator(), "; the bisection's fit counts as arithmetic error"),
        "bisection, of a chord, compact": options(
            BisectionInterpolator("one_minus_cosine"), 2, length_bits=9, product_interval=3
        ),
        "bisection, coarse": options(BisectionInterpolator(threshold=2.0**-8), highlights=False),
        **{method.name: options(method, as_published=True) for method in PUBLISHED},
    },
    expect=expect,
    status=status,
    stimuli=STIMULI,
)
