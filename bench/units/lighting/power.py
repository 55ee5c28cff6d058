"""Record of the exact power unit."""

from dataclasses import replace
from functools import partial

from blysk.bench.units.lighting.specular import (
    HIGHLIGHTS,
    expect,
    exponent_bits,
    highlights,
    measure_highlights,
)
from blysk.bench.units.record import Record, Stimulus, Variant
from blysk.golden.lighting.power import Power
from blysk.golden.number.fixed import Fixed
from blysk.hdl.lighting.power import PowerUnit

__all__ = ["RECORD"]


def _last_bits(unit, rng, count):
    """Many operands, because the last bits of products change a rounded result only once in thousands."""
    return exponent_bits(unit, rng, count)


def _ties(unit, rng, count):
    """Operands, chosen from many. Their complement is within 4 of its own steps of a code of the result."""
    p = unit.model
    case = highlights(unit, rng, count, int(rng.integers(1, 1001)))
    operand = Fixed(p.operand_format, case.beats["operand"])
    codes = p.complement(operand, case.beats["dark"], case.constants["exponent"]).codes
    # Codes in the middle of a highlight and outside of a highlight are left out.
    kept = ((codes + 4) % (1 << 17) < 8) & (codes > 8) & (codes < p.COMPLEMENT_FORMAT.max_code - 8)
    return replace(case, beats={name: beats[kept] for name, beats in case.beats.items()})


def _variants():
    measure = partial(measure_highlights, model=Power())
    for form in ("pipelined", "sequential"):
        unit = partial(PowerUnit, form=form)
        yield form, Variant(unit, measure, HIGHLIGHTS, long=form == "sequential")
    for form in ("pipelined", "sequential"):
        unit = partial(PowerUnit, Power("one_minus_cosine"), form=form)
        yield f"{form}, of a chord", Variant(unit, long=form == "pipelined")


_VARIANTS = dict(_variants())

RECORD = Record(
    name="power",
    title="Exact power of N·H by square and multiply",
    source="docs/theory/units.md#exact-power; [B] 3",
    variants=_VARIANTS,
    expect=expect,
    stimuli={
        "highlights": Stimulus(highlights, 500),
        "exponents": Stimulus(exponent_bits, 200, stalled=False, repeats=20, variants=tuple(_VARIANTS)),
        "last bits": Stimulus(_last_bits, 100_000, stalled=False, repeats=4, variants=("pipelined",)),
        "ties": Stimulus(_ties, 1_000_000, stalled=False, repeats=4, variants=("pipelined",)),
    },
    axis="n (1 - cos γ)",
    logarithmic=True,
    waivers=dict.fromkeys(
        ("s_*", "x_?_sum", "x_?_difference"),
        "The bit is the lowest of 17 bits that are cut off. Its carry changes a kept bit in 1 of 2^17 terms.",
    )
    | {"x_9": "The bit decides whether p + q - p q saturates, and p + q - p q never saturates."},
    still={
        "a square is 0 or 1 modulo 4": "x_{0-8}_product[1]",
        "the sum of two equal numbers is even": "x_{0-8}_sum[0]",
    },
)
