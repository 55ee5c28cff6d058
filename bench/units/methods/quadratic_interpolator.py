"""Record of the quadratic interpolator."""

from dataclasses import replace

from blysk.bench.units.methods.interpolator import STIMULI, expect, measured, options, status
from blysk.bench.units.record import Record
from blysk.golden.methods.quadratic_interpolator import METHODS, PUBLISHED, QuadraticInterpolator

__all__ = ["RECORD"]

_CURVE = QuadraticInterpolator()
_OF_CHORD = QuadraticInterpolator("one_minus_cosine")


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
    for method in (method for method in METHODS if method.form in figures):
        yield f"{method.name}, of a chord", options(replace(method, operand="one_minus_cosine"), 2)
    yield from ((method.name, options(method, as_published=True)) for method in PUBLISHED)


RECORD = Record(
    name="quadratic_interpolator",
    title="Normals on a quadratic through the exact middle normal",
    source="docs/theory/interpolation.md#quadratic-normals; [T] 2.2, figures 2.8, 2.10 and 2.11",
    variants=dict(_variants()),
    expect=expect,
    status=status,
    stimuli=STIMULI,
    waivers={
        "values": (
            "The bit decides whether a word saturates at -1. No component of a unit normal is less than -1."
        ),
        "square": (
            "The bit decides whether a word saturates at 1. The largest word of the table is 2048/2049."
        ),
        "first_order_0": (
            "The fault changes the register only while the output is stalled. Its word is not read any more."
        ),
        "middle_2": "The bit is 1 only in a word of 2 or more. A middle normal has length 1.",
    },
    still={
        "at most 8 spans are in the middle normal and 2 in GPQ; 3 of the 10 are not in the inner FIFO": (
            "lengths.inner_level[3]"
        ),
    },
)
