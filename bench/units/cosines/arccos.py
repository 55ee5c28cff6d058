"""Record of the arccos unit."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.arccos import ARCCOS_TABLES, Arccos
from blysk.golden.number.fixed import Fixed
from blysk.hdl.cosines.arccos import ArccosUnit

__all__ = ["RECORD"]

FORMAT = Arccos.OPERAND_FORMAT
FORMS = ("pipelined", "sequential")


def _measure(rng, count, table):
    unit = Arccos(table)
    one = unit.MAGNITUDE_FORMAT.code(1)
    x = Fixed(FORMAT, np.arange(-one, one + 1))
    return Sample(unit.compute(x)[0].values, np.arccos(x.values), unit.polynomial(x.values), x.values)


def _expect(unit, case):
    angle, outside = unit.model.compute(Fixed(FORMAT, case.beats))
    return {"angle": angle.codes, "outside": outside}


def _cosines(unit, rng, count):
    """Operands of every size, in range and out of range."""
    return Case(any_codes(rng, FORMAT, count))


def _corners(unit, rng, count):
    """Operands next to bounds of segments and next to 0, 1 and -1; extreme codes; any operands in range."""
    one, bounds = unit.model.MAGNITUDE_FORMAT.code(1), unit.model.bounds
    ends = np.r_[0, 1, bounds - 1, bounds, bounds + 1, one - 1, one, one + 1, FORMAT.max_code]
    return Case(np.r_[ends, -ends, FORMAT.min_code, rng.integers(-one, one + 1, count)])


def _every(unit, rng, count):
    """Every operand."""
    return Case(np.arange(FORMAT.min_code, FORMAT.max_code + 1))


def _thirteenth(unit, rng, count):
    """Every thirteenth operand. So each segment gets all values of the lower bits."""
    return Case(np.arange(FORMAT.min_code, FORMAT.max_code + 1, 13))


NAMES = [f"{table}, {form}" for table in reversed(ARCCOS_TABLES) for form in FORMS]

RECORD = Record(
    name="arccos",
    title="Arccosine by quadratics in five segments",
    source="docs/theory/interpolation.md#arccos; [T] 3.3, table 3.1",
    variants={
        f"{table}, {form}": Variant(
            partial(ArccosUnit, Arccos(table), form=form),
            partial(_measure, table=table),
            "x -1 to 1",
            "rad",
            exhaustive=True,
            as_published=table == "as_published",
        )
        for table in reversed(ARCCOS_TABLES)
        for form in FORMS
    },
    expect=_expect,
    stimuli={
        "cosines": Stimulus(_cosines, 1000),
        "corners": Stimulus(_corners, 800, variants=tuple(NAMES[:2])),
        "every operand": Stimulus(_every, stalled=False, variants=tuple(NAMES[:1])),
        "every thirteenth operand": Stimulus(_thirteenth, stalled=False, variants=tuple(NAMES[2:])),
        "every operand, other variants": Stimulus(
            _every, stalled=False, long=True, variants=tuple(NAMES[1:])
        ),
    },
    axis="x",
    waivers={
        "c1": "The bit is 0 in every coefficient of the table.",
        "total": "The bit is 0 in the sum of every operand. A stimulus sends every operand.",
    },
    still={
        "a segment's number is 0 to 4": "segment[3-4]",
        "all coefficients of the same power agree in this bit": (
            "c0[18] c1[1] c1[16] c2[0] c2[13-14] c2[17]"
        ),
        "the arccosine of a magnitude is 0 to 1.6": "total[33-42]",
        "an angle is 0 to 3.15": "angle_exact[34-42] angle_rounded[18-27]",
    },
)
