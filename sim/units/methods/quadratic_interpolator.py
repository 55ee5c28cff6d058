"""Record of the quadratic interpolator."""

from dataclasses import replace

from blysk.golden.methods.quadratic_interpolator import METHODS, PUBLISHED, QuadraticInterpolator
from blysk.sim.units.methods.interpolator import STIMULI, expect, measured, options, status
from blysk.sim.units.methods.light_products import COSINES
from blysk.sim.units.record import Record

__all__ = ["RECORD", "STILL"]

_CURVE = QuadraticInterpolator()
_OF_CHORD = QuadraticInterpolator("one_minus_cosine")

STILL = {
    "the polynomial's products are at most 0.0127 and 0.0293": "rounded_2[13-16] rounded_1[14-16]",
    "its inner sums are 0.0458 to 0.0586 and 0.1250 to 0.1544": "middle_normal.datapath.total[14-16]",
    "twice a number is even": (
        "{spare,payload,difference_setup.spare}[186] {spare,payload,difference_setup.spare}[230] "
        "{spare,payload,difference_setup.spare}[274] second_{0-2}[0] *_second_difference[0]"
    ),
    "a reciprocal is normalised, and so is its square, so that the first bit is 1": (
        "reciprocal[16] reciprocals.port__data[16] square[16] square_rounded[16] "
        "difference_setup.datapath.multiplier_?_a[16] difference_setup.datapath.multiplier_?[16]"
    ),
    "the largest square in the table is under 1 by 62 steps": "square_rounded[17]",
    "a length of 12 bits takes shifts up to 12, and its square up to 25": "shift[4] square_shift[5]",
}
"""Register bits of the method's setup, which do not toggle, by reason."""


def _variants():
    figures = {"direct": "[T] figure 2.9 a", "horner": "[T] figure 2.9 b"}
    for method in METHODS:
        facts = {}
        if method.form in figures:
            source = f"docs/theory/interpolation.md#quadratic-normals; {figures[method.form]}"
            facts = {"source": source, "long": True}
        yield method.name, measured(method, **facts)
    yield "quadratic, interval 1, of a chord", options(_OF_CHORD, 2, setup_interval=1, length_bits=9)
    yield "quadratic, interval 3, no highlights", options(_CURVE, setup_interval=3, highlights=False)
    yield "quadratic, interval 7, compact", options(_CURVE, setup_interval=7, product_interval=3)
    for method in METHODS[1:]:
        yield f"{method.name}, of a chord", options(replace(method, operand="one_minus_cosine"), 2)
    yield "quadratic-published", options(PUBLISHED[0], as_published=True)


RECORD = Record(
    name="quadratic_interpolator",
    title="Normals on a quadratic through the exact middle normal",
    source="docs/theory/interpolation.md#quadratic-normals; [T] 2.2, figures 2.8, 2.10 and 2.11",
    variants=dict(_variants()),
    expect=expect,
    status=status,
    stimuli=STIMULI,
    waivers={
        "values": "It is for the saturation below -1, which no component reaches, as normals are not longer.",
        "square": "It is for the saturation at 1, and the largest word of the table is 2048/2049.",
        "first_order_0": "While the output is stalled, the register holds no word that is still read.",
        "middle_2": "It counts at 2 and more, and a middle normal is at most 1 and a rounding long.",
    },
    still=COSINES | STILL,
)
