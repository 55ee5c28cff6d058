"""Record of the specular unit, and parts that the records of all units of highlights share."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import exponents, highlight_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.lighting.specular import Specular
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.reflection import BLINN, REFLECTION_MODELS
from blysk.hdl.lighting.specular import SpecularUnit

__all__ = [
    "EXPONENT",
    "HIGHLIGHTS",
    "RECORD",
    "any_exponent",
    "exponent_of",
    "highlights",
    "measure_highlights",
]

EXPONENT = 60
"""Exponent of a run that needs only one exponent."""

HIGHLIGHTS = "n 1 to 1000, N.H 0 to 1"


def measure_highlights(rng, count, model):
    """Terms of cosines in the highlight, near its end, and anywhere. The exact term is Blinn's power."""

    def samples():
        for exponent, share in exponents(rng, count):
            distance = rng.uniform(0, 1, share)
            distance[::2] = np.minimum(rng.uniform(0, 16, len(distance[::2])) / exponent, 1)
            distance[: share // 20] = 0
            codes = np.floor(ONE_SQUARED.codes * (1 - distance)).astype(np.int64)
            cosine = codes / ONE_SQUARED.codes
            found = model.compute(Fixed(model.operand_format, codes), np.zeros(share, bool), exponent)
            exact, formula = (
                reflection.reflect(cosine, exponent) for reflection in (BLINN, model.reflection)
            )
            yield Sample(found.values, exact, formula, exponent * (1 - cosine))

    return Sample.joined(samples())


def any_exponent(rng) -> int:
    """An exponent: a power of two, the largest exponent, or any exponent."""
    return int(rng.choice([1 << rng.integers(10), 1000, rng.integers(1, 1001)], p=[0.45, 0.1, 0.45]))


def exponent_of(unit, constants) -> int:
    """Exponent of a run. It is fixed at build time, or follows from the constants: exponent or slope."""
    if constants is None:
        return unit.exponent
    if "exponent" in constants:
        return constants["exponent"]
    slopes = _slopes(unit.model, np.arange(1, 1001))
    return 1 + int(np.argmax(np.all([slopes[name] == constants[name] for name in slopes], axis=0)))


def _slopes(model, exponent):
    scale, shift = model.scale(exponent)
    return {"scale": scale.codes, "shift": shift + 1, "boundary": model.boundaries.codes[exponent]}


def highlights(unit, rng, count, exponent=None):
    """Operands in the highlight, at its end and anywhere, for one exponent. A tenth of the beats is dark."""
    exponent = getattr(unit, "exponent", None) or exponent or EXPONENT
    constants = {"exponent": exponent}
    if "constants" not in unit.signature.members:
        constants = None
    elif "exponent" not in unit.constants.shape().members:
        constants = _slopes(unit.model, exponent)
    codes = highlight_codes(rng, unit.model, count, exponent)
    return Case({"operand": codes, "dark": rng.random(count) < 0.1}, constants)


def exponent_bits(unit, rng, count):
    """Operands with another exponent in each run: a power of two, the largest or any exponent."""
    return highlights(unit, rng, count, any_exponent(rng))


def expect(unit, case):
    """Terms of the bit-accurate model."""
    p = unit.model
    operand, dark = Fixed(p.operand_format, case.beats["operand"]), case.beats["dark"]
    return p.compute(operand, dark, exponent_of(unit, case.constants)).codes


_SERVED = tuple(model for model in REFLECTION_MODELS.values() if isinstance(model, Specular.SERVED))
_PUBLISHED = ("cosquad", "cosquad7", "cosquad_lin")
_QUICK = ("cosquad", "exp")
"""Models of the short run, one for each structure. A variant below has another number of squares."""


def _models():
    for model in _SERVED:
        p = Specular(model)
        yield (
            model.name,
            Variant(
                partial(SpecularUnit, p),
                partial(measure_highlights, model=p),
                HIGHLIGHTS,
                source=model.source,
                long=model.name not in _QUICK,
            ),
        )


def _others():
    p = Specular()
    yield (
        f"{p.name}, interval 2",
        Variant(
            partial(SpecularUnit, p, initiation_interval=2),
            partial(measure_highlights, model=p),
            HIGHLIGHTS,
            source=p.reflection.source,
            long=True,
        ),
    )
    for name in _PUBLISHED:
        p = Specular(REFLECTION_MODELS[name], as_published=True)
        yield (
            f"{name}, as published",
            Variant(
                partial(SpecularUnit, p),
                partial(measure_highlights, model=p),
                HIGHLIGHTS,
                note="the comparator reads the square, so the second lobe of the parabola shows",
                source=p.reflection.source,
                as_published=True,
                long=name != "cosquad",
            ),
        )
    for name, as_published in (("lyon3", False), ("cosquad_lin", True)):
        p = Specular(REFLECTION_MODELS[name], "one_minus_cosine", as_published)
        unit = partial(SpecularUnit, p)
        yield (
            f"{name}, of a chord" + ", as published" * as_published,
            Variant(unit, as_published=as_published, long=as_published),
        )
    for name, interval, as_published in (
        ("cosquad", 3, False),
        ("lyon3", 3, False),
        ("exp", 4, False),
        ("coscos4", 2, False),
        ("cosquad", 2, True),
    ):
        p = Specular(REFLECTION_MODELS[name], as_published=as_published)
        unit = partial(SpecularUnit, p, initiation_interval=interval)
        variant = f"{name}, interval {interval}" + ", as published" * as_published
        is_long = name != "coscos4"
        yield variant, Variant(unit, as_published=as_published, long=is_long)
    for name, interval in (("cosquad", 1), ("coscos4", 3)):
        p = Specular(REFLECTION_MODELS[name])
        unit = partial(SpecularUnit, p, initiation_interval=interval, shares_slope=True)
        yield f"{name}, interval {interval}, shared slope", Variant(unit, long=interval == 1)
    for name, exponent, interval in (
        ("cosquad", 20, 1),
        ("cosquad", 1, 2),
        ("cosquad_lin", 1000, 1),
        ("exp", 57, 1),
        ("coscos2", 300, 4),
    ):
        p = Specular(REFLECTION_MODELS[name])
        unit = partial(SpecularUnit, p, initiation_interval=interval, exponent=exponent)
        yield (
            f"{name}, interval {interval}, exponent {exponent}",
            Variant(unit, long=exponent not in (20, 300)),
        )


_VARIANTS = dict(_models()) | dict(_others())

RECORD = Record(
    name="specular",
    title="Specular term of the cosine-quadratic model and of related models",
    source="docs/theory/units.md#specular-unit; [T] figures 3.6 and 3.7; [C]",
    variants=_VARIANTS,
    expect=expect,
    stimuli={
        "highlights": Stimulus(highlights, 1000),
        "exponents": Stimulus(
            exponent_bits,
            1000,
            stalled=False,
            repeats=12,
            variants=tuple(v for v in _VARIANTS if "exponent" not in v),
        ),
        "last bits": Stimulus(exponent_bits, 4000, stalled=False, repeats=40, variants=(_SERVED[0].name,)),
    },
    axis="n (1 - cos γ)",
    logarithmic=True,
    still={
        "a slope is n/2 with n of 10 bits, normalised to 17 bits, so it ends in seven zeros": (
            "datapath.slope.slope_word[0-16] datapath.slope.scale[0-6] datapath.product[0-6]"
        ),
        "the exponent is constant in a run, so no bit of its slope and boundary falls": (
            "slope_word[17-26] slope.scale[7-16] slope.shift[0-3] slope.{read,boundary}[0-16] "
            "boundaries.port__data[0-16]"
        ),
        "a square is 0 or 1 modulo 4": "datapath.square[1]",
    },
    waivers={
        "argument": "An argument of 1 or more is lit only at an exponent of 1. Then the bit is cut off.",
        "slope_word": "The slope is n/2. Its lowest bit is not among the 17 bits that the unit uses.",
    },
)
