"""Record of the light unit."""

from functools import partial

import numpy as np

from blysk.bench.units.lighting.specular import any_exponent, exponent_of, highlights
from blysk.bench.units.operands import (
    any_codes,
    component_words,
    dot,
    exponents,
    sphere,
    spread_angles,
    turned,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.factor import Factor
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import BLINN, REFLECTION_MODELS
from blysk.hdl.lighting.factor import FactorUnit
from blysk.hdl.lighting.light import LightUnit

__all__ = ["RECORD"]


def _measure(rng, count):
    """Diffuse and specular term of normals near H. The exact specular term is Blinn's power."""
    unit, product = Specular(), DotProduct()

    def samples():
        for exponent, share in exponents(rng, count):
            viewer, light = sphere(rng, share), sphere(rng, share)
            halfway = normalise(viewer + light)
            normal = turned(rng, halfway, np.minimum(spread_angles(rng, share, 90), 89))
            # A viewer sees the front. So N.V > 0, and N.H > 0 wherever there is light.
            kept = dot(normal, viewer) > 0.01
            normal, light, halfway = (quantise(v[kept]) for v in (normal, light, halfway))
            cosine = product.compute(*component_words(normal, light))
            dark = Diffuse().dark(cosine)
            specular = unit.compute(product.compute(*component_words(normal, halfway)), dark, exponent)
            diffuse = np.maximum(dot(normal, light) / ONE**2, 0)
            nearness = dot(normal, halfway) / ONE**2
            exact, formula = (
                np.stack([diffuse, model.reflect(nearness, exponent) * ~dark])
                for model in (BLINN, unit.reflection)
            )
            found = np.stack([Diffuse().compute(cosine).values, specular.values])
            yield Sample(found, exact, formula, exponent * (1 - nearness))

    return Sample.joined(samples())


def _cosine_format(unit):
    return unit.i.payload.shape()["cosine"].shape.number_format


def _expect(unit, case):
    format, p = _cosine_format(unit), unit.model
    cosine = Fixed(format, case.beats["cosine"])
    dark = Diffuse.dark(cosine) | np.asarray(case.beats.get("gated", 0), dtype=bool)
    specular = p.compute(
        Fixed(p.operand_format, case.beats["highlight"]), dark, exponent_of(unit, case.constants)
    )
    if unit.fades:
        specular = Factor().compute(specular, Fixed(Factor.FORMAT, case.beats["factor"]))
    return {"diffuse": Diffuse(format).compute(cosine).codes, "specular": specular.codes}


def _operands(unit, rng, count, exponent=None):
    """Any N·L and any specular operand. A quarter of N·L is near 0.

    If there is a gate, it turns off the highlight in runs of 20 beats.
    """
    case = highlights(unit, rng, count, exponent)
    cosine = any_codes(rng, _cosine_format(unit), count)
    cosine[::4] >>= 20
    beats = {"cosine": cosine, "highlight": case.beats["operand"]}
    if "gated" in unit.i.payload.shape().members:
        beats["gated"] = np.repeat(rng.random(-(-count // 20)) < 0.4, 20)[:count]
    if unit.fades:
        beats["factor"] = any_codes(rng, Factor.FORMAT, count)
    return Case(beats, case.constants)


def _exponents(unit, rng, count):
    """Any operands, with another exponent in each run: a power of two, the largest or any exponent."""
    return _operands(unit, rng, count, any_exponent(rng))


def _terminator(unit, rng, count):
    """Operands at the peak of a highlight. N·L is 0, a power of two of either sign, or the least code."""
    bits = 1 << np.arange(34)
    cosine = rng.permutation(np.r_[0, bits, -bits, _cosine_format(unit).min_code])
    highlight = np.full(len(cosine), ONE**2)
    return Case({"cosine": cosine, "highlight": highlight}, {"exponent": int(rng.integers(1, 1001))})


def _black(unit, rng, count):
    """A light whose L and H are 0."""
    zero = np.zeros(count, dtype=np.int64)
    return Case({"cosine": zero, "highlight": zero}, {"exponent": 1})


_CHORD = Diffuse(SQ(2, 25))
"""Diffuse model with the format of N·L in methods that give 1 - N·H."""


def _with_factor(interval, fades):
    return LightUnit(initiation_interval=interval, gated=True, factor=FactorUnit(has_factor=fades))


def _variants():
    yield "cosquad", Variant(LightUnit, _measure, "n 1 to 1000, N.V > 0")
    for gated in (False, True):
        unit = partial(LightUnit, initiation_interval=3, gated=gated)
        yield "cosquad, interval 3" + ", gated" * gated, Variant(unit, long=not gated)
    for name, interval, gated in (("cosquad", 1, False), ("coscos2", 1, True), ("coscos4", 6, True)):
        p = Specular(REFLECTION_MODELS[name], "one_minus_cosine")
        unit = partial(LightUnit, p, _CHORD, initiation_interval=interval, gated=gated)
        yield f"{name} of a chord, interval {interval}" + ", gated" * gated, Variant(unit, long=True)
    for interval, gated in ((1, False), (42, True)):
        unit = partial(
            LightUnit, Power("one_minus_cosine"), _CHORD, initiation_interval=interval, gated=gated
        )
        variant = f"exact power of a chord, interval {interval}" + ", gated" * gated
        yield variant, Variant(unit, long=not gated)
    for interval, fades in ((1, True), (3, True), (1, False)):
        unit = partial(_with_factor, interval, fades)
        yield f"interval {interval}, {'fades' if fades else 'waits'}", Variant(unit, long=interval == 1)
    for name, p in (("cosquad", Specular()), ("exact power", Power())):
        yield f"{name}, exponent 77", Variant(partial(LightUnit, p, exponent=77), long=True)


RECORD = Record(
    name="light",
    title="Diffuse and specular term of one light",
    source="docs/theory/models.md#lighting; [T] figure 4.10; [B] 4",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "operands": Stimulus(_operands, 600),
        "exponents": Stimulus(_exponents, 1500, stalled=False, repeats=110),
        "terminator": Stimulus(_terminator, 70),
        "black": Stimulus(_black, 100),
    },
    axis="n (1 - cos γ)",
    logarithmic=True,
    waivers={
        "lit": "The bit is 1 only if all bits of the boundary are 1. No exponent has this boundary.",
        "product": (
            "The slope is n of 10 bits, normalised to 17 bits. So slope and product end in seven zeros."
        ),
        "argument": (
            "The bit decides whether the argument saturates at 2. An argument of 2 is dark at every exponent."
        ),
        "stages": (
            "The fault reads the table while the output is stalled, too. The exponent stays, so the word "
            "stays."
        ),
        "shifted": (
            "The bit decides whether the word saturates at 2. A word of 2 is over the boundary of every "
            "exponent, so its product is not read."
        ),
    },
)
