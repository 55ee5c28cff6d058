"""Record of the intensity unit."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.fixed import Fixed
from blysk.hdl.lighting.colored_intensity import ColoredIntensityUnit, CompactColoredIntensityUnit
from blysk.hdl.lighting.intensity import CompactIntensityUnit, IntensityUnit

__all__ = ["RECORD"]

_COLOR, _TERM = Intensity.COLOR_FORMAT, Intensity.TERM_FORMAT
_FULL = 255 << _COLOR.fraction_bits
"""Colour operand of a full channel."""

_COLORED = {
    "albedo": Intensity(has_albedo=True),
    "albedo, tints, 2 lights": Intensity(2, has_albedo=True, tints=True),
    "albedo, 16 lights": Intensity(16, has_albedo=True),
    "albedo, 6 fraction bits": Intensity(2, has_albedo=True, fraction_bits=6),
    "albedo, no highlights, 1 channel": Intensity(2, has_specular=False, channels=1, has_albedo=True),
    "albedo, without lights": Intensity(0, has_albedo=True),
}
"""Models of pixels with an albedo, by name."""


def _measure(rng, count, model):
    unit = model
    colors = rng.random((3, 64, 3))
    pick = rng.integers(0, 64, count)
    terms = rng.integers(0, 1 << 17, (2, count))
    terms[:, :2] = 0, (1 << 17) - 1
    if unit.has_albedo:
        albedo = Fixed(unit.ALBEDO_FORMAT, rng.integers(0, 1 << 16, (count, 3), endpoint=True))
        emissions = rng.random((64, 3))
    found = np.empty((count, 3))
    for k, color in enumerate(colors.transpose(1, 0, 2)):
        ambient, diffuse, specular = (Fixed(_COLOR, unit.color(c)) for c in color)
        chosen = pick == k
        colored = (albedo[chosen], Fixed(_COLOR, unit.color(emissions[k]))) if unit.has_albedo else ()
        found[chosen] = unit.compute(
            ambient,
            diffuse[np.newaxis],
            specular[np.newaxis],
            *(Fixed(_TERM, term[chosen][:, np.newaxis]) for term in terms),
            *colored,
        )
    weights = np.stack([np.ones(count), *(terms * 2.0**-17)])
    parts = weights[:, :, np.newaxis] * colors[:, pick]
    if unit.has_albedo:
        parts[:2] *= albedo.values
        parts[2] += emissions[pick]
    exact = np.minimum(255 * parts.sum(axis=0), 255)
    return Sample(found, exact, exact, exact)


def _expect(unit, case):
    colors = (Fixed(_COLOR, case.constants[name]) for name in ("ambient", "diffuse", "specular"))
    diffuse = case.beats["diffuse"]
    terms = (Fixed(_TERM, codes) for codes in (diffuse, case.beats.get("specular", np.zeros_like(diffuse))))
    colored = {}
    if unit.model.has_albedo:
        colored["albedo"] = Fixed(unit.model.ALBEDO_FORMAT, case.beats["albedo"])
        colored["emission"] = Fixed(_COLOR, case.constants["emission"])
        colored["tinted"] = bool(case.constants.get("tinted", False))
    return dict(zip("rgb", unit.model.compute(*colors, *terms, **colored).T, strict=True))


def _case(unit, rng, terms, ambient, colors):
    beats = dict(zip(unit.kinds, terms, strict=False))
    constants = {"ambient": ambient, "diffuse": colors[0], "specular": colors[1]}
    if unit.model.has_albedo:
        # Albedos of any size. Some are black, and some are white.
        albedo = rng.integers(0, 1 << 16, (len(terms[0]), 3)) >> rng.integers(0, 12, (len(terms[0]), 1))
        albedo[::8] = rng.choice([0, 1 << 16], albedo[::8].shape)
        beats["albedo"] = albedo
        constants["emission"] = rng.integers(0, _FULL, 3) >> rng.integers(0, 8)
    if unit.model.tints:
        constants["tinted"] = int(rng.integers(2))
    return Case(beats, constants)


def _terms(unit, rng, count, brightness=1):
    """Any terms of all lights, with colours up to a full channel.

    In some pixels some or all terms are 0, or all terms have the largest code.
    """
    lights = unit.model.lights
    terms = rng.integers(0, _TERM.max_code, (2, count, lights), endpoint=True)
    terms *= rng.random(terms.shape) < rng.random((1, count, 1))
    terms[:, ::32] = _TERM.max_code
    terms[:, 1::32] = 0
    terms[1, 2::32] = 0
    ambient, *colors = (rng.integers(0, _FULL * brightness, (n, 3)) for n in (1, lights, lights))
    return _case(unit, rng, rng.permutation(terms, axis=1), ambient[0], colors)


def _bright(unit, rng, count):
    """Any terms of all lights, with colours up to eight full channels.

    Channels saturate, and every bit of a colour is used.
    """
    return _terms(unit, rng, count, 8)


def _colors(unit, rng, count):
    """Light that exceeds its limit, with colours up to eight full channels, on surfaces of every albedo."""
    return _terms(unit, rng, count, 8)


def _sizes(unit, rng, count):
    """Many terms and colours of every size, because the last bits of products rarely change a channel."""
    terms = rng.integers(0, _TERM.max_code, (2, count, 1), endpoint=True)
    terms >>= rng.integers(0, 12, terms.shape)
    ambient, *colors = rng.integers(0, _FULL * rng.choice([1, 2, 8]), (3, 1, 3))
    return _case(unit, rng, terms, ambient[0], colors)


def _halves(unit, rng, count):
    """Sums that end in half an LSB, or a step less. Every bit of products and sum changes a channel."""
    colors = np.repeat([[[8191]], [[6003]]], 3, axis=-1)
    ambient = np.array([3, 100, 40]) * 64 + 5
    wanted = (1 << 22) - np.arange(2)[:, np.newaxis]
    # About 1 in 64 specular terms has a diffuse term that gives the wanted sum.
    specular = rng.integers(0, _TERM.max_code, (2, 40 * count), endpoint=True)
    # The term of an odd colour can give any bits below the bits of the ambient light.
    diffuse = (wanted - 6003 * specular) * pow(8191, -1, 1 << 17) % (1 << 17)
    chosen = ((5 << 17) + 8191 * diffuse + 6003 * specular) % (1 << 23) == wanted
    terms = np.stack([diffuse[chosen], specular[chosen]])[:, :, np.newaxis]
    return _case(unit, rng, rng.permutation(terms, axis=1)[:, :count], ambient, colors)


def _variants():
    styles = {"throughput": IntensityUnit, "compact": CompactIntensityUnit}
    for style, unit in styles.items():
        measure = partial(_measure, model=Intensity())
        yield f"1 light, {style}", Variant(unit, measure, "all terms", "LSB")
    for style, unit in styles.items():
        for lights in (2, 3, 16):
            is_long = (lights, style) != (3, "compact")
            yield f"{lights} lights, {style}", Variant(partial(unit, Intensity(lights)), long=is_long)
        p = Intensity(2, channels=1)
        yield f"1 channel, {style}", Variant(partial(unit, p), long=style != "compact")
        p = Intensity(fraction_bits=6)
        yield f"6 fraction bits, {style}", Variant(partial(unit, p), long=style != "compact")
        p = Intensity(2, has_specular=False)
        yield f"no highlights, {style}", Variant(partial(unit, p), long=style != "throughput")
    for style in styles:
        for name, p in _COLORED.items():
            measure = partial(_measure, model=p) if p == Intensity(has_albedo=True) else None
            domain = "all terms and colours" if measure else ""
            kind = ColoredIntensityUnit if style == "throughput" else CompactColoredIntensityUnit
            make = partial(kind, p)
            yield f"{name}, {style}", Variant(make, measure, domain, "LSB" if measure else "")


_VARIANTS = dict(_variants())

RECORD = Record(
    name="intensity",
    title="Ambient, diffuse and specular light of a pixel in three channels",
    source="docs/theory/units.md#intensity; [T] figure 4.10; [B] 4 and 5",
    variants=_VARIANTS,
    expect=_expect,
    stimuli={
        "terms": Stimulus(_terms, 400),
        "bright": Stimulus(_bright, 400, repeats=12),
        "sizes": Stimulus(_sizes, 5000, stalled=False, repeats=40),
        "colors": Stimulus(
            _colors, 400, variants=tuple(name for name in _VARIANTS if name.startswith("albedo"))
        ),
        "halves": Stimulus(_halves, 1000, variants=("1 light, throughput", "1 light, compact")),
    },
    axis="exact sum, LSB",
    waivers={
        "diffuse_0_r_?": (
            "If the controlling bit is 1, the product is 256 or more, and the channel saturates."
        ),
        "specular_0_b_?": (
            "If the controlling bit is 1, the product is 1024 or more, and the channel saturates."
        ),
    },
    still={
        "the largest sum, of three terms of 8 full channels, is 6120": "rounded_{r,g,b}[13]",
        "a colour is a constant of the run, written once": "color_{diffuse,specular}_0_{r,g,b}[0-16]",
    },
)
