"""Record of the factor unit."""

from functools import partial

from blysk.bench.units.operands import any_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.lighting.factor import Factor
from blysk.golden.number.fixed import Fixed
from blysk.hdl.lighting.factor import FactorUnit

__all__ = ["RECORD"]

FORMAT = Factor.FORMAT


def _measure(rng, count):
    """Products of words of every size."""
    specular, factor = (Fixed(FORMAT, rng.integers(0, FORMAT.max_code + 1, count)) for _ in range(2))
    exact = specular.values * factor.values
    return Sample(Factor().compute(specular, factor).values, exact, exact, factor.values)


def _expect(unit, case):
    beats = case.beats
    specular = beats["specular"]
    if unit.has_factor:
        specular = unit.model.compute(Fixed(FORMAT, specular), Fixed(FORMAT, beats["factor"])).codes
    return {"diffuse": beats["diffuse"], "specular": specular}


def _words(unit, rng, count):
    """Words of every size, with extreme codes. Some factors are 0 or 1."""
    beats = {name: any_codes(rng, FORMAT, count) for name in unit.i.payload.shape().members}
    if unit.has_factor:
        beats["factor"][::8] = FORMAT.max_code
        beats["factor"][1::8] = 0
    return Case(beats)


RECORD = Record(
    name="factor",
    title="Specular term of a light that fades, times its factor",
    source="docs/theory/chord.md#local-lights",
    variants={
        "": Variant(FactorUnit, _measure, "factor a and specular term S 0 to 1"),
        "without a factor": Variant(partial(FactorUnit, has_factor=False), long=True),
    },
    expect=_expect,
    stimuli={"words": Stimulus(_words, 1500)},
    axis="factor a",
)
