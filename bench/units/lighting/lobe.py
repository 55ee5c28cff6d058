"""Record of the lobe unit."""

from dataclasses import replace
from functools import partial

import numpy as np

from blysk.bench.units.lighting.specular import any_exponent
from blysk.bench.units.operands import any_codes, exponents
from blysk.bench.units.record import Case, Record, Stimulus, Variant, together
from blysk.bench.units.sample import Sample
from blysk.golden.lighting.lobe import Lobe, LobeTable
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.lobes import BECKMANN, COPLANAR_PHONG, GGX, TabulatedModel
from blysk.golden.reference.reflection import BLINN, PHONG
from blysk.hdl.lighting.lobe import LobeUnit

__all__ = ["RECORD"]

_USUAL = {"exponent": 60, "roughness": 0.4, None: None}
"""Parameter of a run that needs only one parameter."""

_TENT = TabulatedModel.of_points("tent", [0, 0.3, 0.9, 1], [0.2, 1, 0.1, 0.6])
_STEP = TabulatedModel("step", function=lambda cosine: (cosine > 0.7).astype(float))


def _parameters(rng, model, count):
    """Parameters over the range of a model, and the number of samples of each."""
    if model.PARAMETER == "exponent":
        yield from exponents(rng, count)
    else:
        for roughness in np.r_[0.05, 1 if model is GGX else 0.84, rng.uniform(0.05, 0.84, 30)].tolist():
            yield roughness, count // 32


def _measure(rng, count, lobe):
    """Terms over all octaves of 1 - N·H. The reflection model in float64 gives the exact terms."""

    def samples():
        for parameter, share in _parameters(rng, lobe.reflection, count):
            distance = np.where(
                rng.random(share) < 0.5, rng.uniform(0, 1, share), 2 ** -rng.uniform(0, 20, share)
            )
            codes = np.floor((1 - distance) * ONE_SQUARED.codes).astype(np.int64)
            operand = Fixed(lobe.operand_format, codes)
            found = lobe.compute(operand, np.zeros(share, bool), lobe.table(parameter))
            exact = lobe.reflection.reflect(codes / ONE_SQUARED.codes, parameter)
            yield Sample(found.values, exact, None, np.maximum(1 - codes / ONE_SQUARED.codes, 2.0**-34))

    return Sample.joined(samples())


def _operands(model, rng, count):
    """``count`` operands: corner cases, any codes, both ends of each step of the table, and every octave."""
    if model.operand == "place":
        return _places(model, rng, count)
    format, bits = model.operand_format, model.fraction_bits
    knots = np.ldexp(model.knots, bits).astype(np.int64)
    u = np.r_[knots, knots - 1, (2.0 ** (bits - rng.uniform(-1, bits, count))).astype(np.int64)]
    codes, corners = u, [0, 1, 2, format.max_code - 1, 1 << bits, (1 << bits) + 1]
    if model.operand == "cosine":
        one = ONE_SQUARED.codes.item()
        codes = one - (u << 34 - bits) - rng.integers(0, 1 << 34 - bits, len(u))
        corners = [one, one - 1, one + 1, one + 10**6, 0, 1, -1, -one, one - (1 << 34), format.min_code]
        corners = np.r_[corners, 1 << np.arange(34)]
    codes = np.r_[corners, format.max_code, any_codes(rng, format, count // 8), codes][:count]
    return np.clip(rng.permutation(codes), format.min_code, format.max_code)


def _places(model, rng, count):
    """``count`` places: both ends of each step of the table, any places, and places past its end."""
    format, rows = model.operand_format, model.rows * model.steps
    steps = np.arange(rows) << model.fraction_format.width
    past = (rows << model.fraction_format.width) + np.r_[0, 1, 1 << rng.integers(0, 12, 6)]
    codes = np.r_[steps, steps[1:] - 1, past, format.max_code, any_codes(rng, format, count)]
    return rng.permutation(np.clip(codes[:count], 0, format.max_code))


def _case(unit, rng, count, tables):
    """A run: writes of all tables, unless they are fixed, and beats that read one of the banks.

    A tenth of the beats is dark.
    """
    codes = _operands(unit.model, rng, count)
    beats = {"operand": codes, "dark": (rng.random(len(codes)) < 0.1).astype(np.uint8)}
    write = None
    if unit.tables is None:
        order = rng.permutation(len(tables)).tolist()
        write = together([tables[bank].writes(bank) for bank in order])
    constants = None
    if unit.model.banks > 1:
        constants = {"bank": int(rng.integers(unit.model.banks))}
    return Case(beats, constants, write)


def _highlights(unit, rng, count):
    """Operands at every step of the table, in all octaves and at the ends of their format.

    A tenth of the beats is dark.
    """
    p = unit.model
    first = _USUAL[p.reflection.PARAMETER]
    tables = [p.table(first if first is None else first / (1 + bank)) for bank in range(p.banks)]
    return _case(unit, rng, count, tables)


def _tables(unit, rng, count):
    """Tables of any curve, with other tables in each run. Further writes come before and after the tables.

    A table before is replaced. The writes after change no table.
    """
    p = unit.model
    tables = []
    for _ in range(p.banks):
        kinds = (
            (BLINN, any_exponent(rng)),
            (GGX, rng.uniform(0.05, 1)),
            (BECKMANN, 1.0),
            (_TENT, None),
            (_STEP, None),
        )
        model, parameter = kinds[rng.integers(len(kinds))]
        tables.append(LobeTable(p, Lobe(model, p.operand, p.octaves, p.steps).table(parameter).values))
    case = _case(unit, rng, count, tables)
    if case.write is None:
        return case
    lost = rng.integers(0, 1 << Lobe.VALUE_FORMAT.width, 700)
    parts = (
        # The tables of the run replace this table.
        tables[0].writes(),
        case.write,
        # The unit drops all values past the end of a table, and all values for a bank that does not exist.
        {"value": np.r_[lost, p.banks, lost], "begins": np.arange(1401) == 700},
        # A word needs two values. Each of these tables has a single value.
        {"value": np.r_[0, lost[:1], 0, lost[1:2]], "begins": [1, 0, 1, 0]},
    )
    return replace(case, write=together(parts))


def _loaded(unit, case):
    """The table of each bank: fixed, or loaded by the writes of the run."""
    if unit.tables is not None:
        return dict(enumerate(unit.tables))
    p = unit.model
    starts = np.flatnonzero(case.write["begins"])
    values = case.write["value"]
    return {
        int(values[at]): LobeTable(p, Fixed(p.VALUE_FORMAT, values[at + 1 : at + p.entries + 2]))
        for at, count in zip(starts, np.diff(np.r_[starts, len(values)]), strict=True)
        if values[at] < p.banks and count > p.entries + 1
    }


def _expect(unit, case):
    """Terms of the bit-accurate model."""
    p = unit.model
    table = _loaded(unit, case)[case.constants["bank"] if case.constants else 0]
    operand, dark = Fixed(p.operand_format, case.beats["operand"]), case.beats["dark"]
    return p.compute(operand, dark, table).codes


def _fixed(lobe, interval=1):
    return LobeUnit(lobe, interval, tables=lobe.fixed_tables)


def _variants():
    domains = {"exponent": "n 1 to 1000, N.H 0 to 1", "roughness": "roughness 0.05 to 1, N.H 0 to 1"}
    for model in (BLINN, COPLANAR_PHONG, BECKMANN, GGX):
        domain = (
            domains[model.PARAMETER].replace("to 1,", "to 0.84,")
            if model is BECKMANN
            else domains[model.PARAMETER]
        )
        lobe = Lobe(model)
        yield (
            model.name,
            Variant(partial(LobeUnit, lobe), partial(_measure, lobe=lobe), domain, source=model.source),
        )
    chord = partial(Lobe, operand="one_minus_cosine")
    yield "blinn, of a chord", Variant(partial(LobeUnit, chord()))
    yield "blinn, interval 3, of a chord", Variant(partial(LobeUnit, chord(), 3))
    yield "blinn, 3 banks", Variant(partial(LobeUnit, Lobe(banks=3)))
    for octaves, steps in ((15, 32), (3, 256), (1, 2)):
        lobe = chord(octaves=octaves, steps=steps)
        yield f"blinn, {octaves} octaves of {steps} steps", Variant(partial(LobeUnit, lobe), long=steps == 2)
    yield (
        "blinn, 30 octaves, 34 fraction bits",
        Variant(partial(LobeUnit, Lobe(octaves=30, fraction_bits=34))),
    )
    yield "blinn, of a quotient", Variant(partial(LobeUnit, QuotientLobe()))
    mirrored = QuotientLobe(PHONG, banks=2)
    yield "phong, 2 banks, interval 3, of a quotient", Variant(partial(LobeUnit, mirrored, 3), long=True)
    fixed = {
        "ggx, fixed": (Lobe(GGX, fixed=(0.3,)), 1),
        "blinn, 2 banks, fixed, interval 2": (chord(banks=2, fixed=(7, 1000)), 2),
    }
    for name, (lobe, interval) in fixed.items():
        yield name, Variant(partial(_fixed, lobe, interval))


_VARIANTS = dict(_variants())

RECORD = Record(
    name="lobe",
    title="Any curve of N·H from a table addressed by octaves",
    source="docs/theory/units.md#lobe",
    variants=_VARIANTS,
    expect=_expect,
    stimuli={
        "highlights": Stimulus(_highlights, 1300),
        "tables": Stimulus(
            _tables,
            1300,
            stalled=False,
            repeats=12,
            variants=("blinn", "blinn, of a chord", "blinn, 3 banks"),
        ),
    },
    axis="1 - cos γ",
    logarithmic=True,
    waivers=dict.fromkeys(
        ("last", "active"),
        "The fault lets a table end too late. With one bank the memory has no word for further values.",
    )
    | {
        "memory.follows": "In a run writes come without gaps. A test of the unit has writes with gaps.",
        "memory.$signature__addr": (
            "The fault changes the address after the number of a missing bank. No word is written then."
        ),
        "table__word": "No bank is written while beats read it, so the register may change on a write.",
    },
    still={"with one bank the last address is the same for every table": "memory.last[0-8]"},
)
