"""Record of the interpolator by bisection."""

from blysk.golden.methods.bisection_interpolator import PUBLISHED, BisectionInterpolator
from blysk.sim.units.methods.interpolator import STIMULI, expect, measured, options, status
from blysk.sim.units.methods.light_products import COSINES
from blysk.sim.units.record import Record

__all__ = ["RECORD"]

RECORD = Record(
    name="bisection_interpolator",
    title="Normals on straight lines between points of the great circle",
    source="docs/theory/interpolation.md#adaptive-normaliser; [T] 2.1, figure 2.7",
    variants={
        "bisection": measured(BisectionInterpolator(), "; the bisection's fit counts as arithmetic"),
        "bisection, of a chord, compact": options(
            BisectionInterpolator("one_minus_cosine"), 2, length_bits=9, product_interval=3
        ),
        "bisection, coarse": options(BisectionInterpolator(threshold=2.0**-8), highlights=False),
        "bisection-published": options(PUBLISHED[0], as_published=True),
    },
    expect=expect,
    status=status,
    stimuli=STIMULI,
    waivers={
        "middle_0": "Inverted every second cycle, and read in those cycles only.",
        "half_sum_1": "Inverted every second cycle, and read in those cycles only.",
        "span": "Inverted every second cycle, and the right normal is read two cycles after it comes.",
    },
    still=COSINES
    | {
        "half of 128 segments is the most that ends are apart or written last": "half[7] write_index[7]",
        "fewer than 32 spans fit into the normaliser": "ready_spans[5-8]",
        "a reciprocal is normalised and not negative, so that its first bits are 01": (
            "reciprocal[16-17] reciprocals.table_port__data[16]"
        ),
        "a segment has at most 4095 pixels, and they take 4094 steps and 127": (
            "available[13] advance[13-23]"
        ),
        "a segment of 4096 steps is divided": "adaptive_normaliser.count[12]",
        "a fraction is not negative": "phi[17]",
        "the bisection's results are taken at once": "bisection.held[0]",
        "the first sum of its polynomials is 0.056, or 0.136 to 0.303": "bisection.datapath.total_2[17]",
    },
)
