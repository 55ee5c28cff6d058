"""Record of the shading pipeline."""

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from blysk.bench.units.albedo.albedo import attributes_in
from blysk.bench.units.cosines.chord_setup import values_of
from blysk.bench.units.methods.interpolator import SPAN
from blysk.bench.units.operands import (
    degrees_between,
    short_lengths,
    span_lengths,
    sphere,
    spread_angles,
    turned,
)
from blysk.bench.units.pipeline_spans import (
    LANE_DESIGNS,
    any_constants,
    any_spans,
    axes_about,
    constants_written,
    ends_for,
    flat_spans,
    joined,
    operands_of,
    spans_about,
    spans_at_rounding,
    spans_in_frame,
    spans_in_highlight,
    spans_near_terminator,
    tabled,
    with_lines,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant, first, once, together
from blysk.bench.units.sample import Sample
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.build import Build
from blysk.golden.cosines.quotient_spans import SpanVectors
from blysk.golden.frame_constants import (
    BANK_ADDRESS,
    LOBE_ADDRESS,
    TEXEL_ADDRESS,
    TEXELS_ADDRESS,
    FrameConstants,
    writes_of,
)
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.frame import beats_of
from blysk.sim.frames.vectors import pixel_beats

__all__ = ["DESIGNS", "LONG_DESIGNS", "RECORD", "case_of", "spans_of"]

_GROUPS = 8
"""Number of exponents of a measurement. The spans are divided into as many parts, with an exponent each."""

_COUNTED = (1 << 16) + 2
"""Number of spans that is larger than the largest value of a counter of 16 bits."""


# Errors.


def _measure(rng, count, design):
    """A channel of grey pixels, 0 to 255."""
    interpolator, model = design.interpolator, design.specular.reflection
    reflection = {"ambient": 0.1, "diffuse": 0.5, "specular": 0.4}
    ambient, k_d, k_s = reflection.values()
    grey = {name: np.tile(Intensity.color(k), 3) for name, k in reflection.items()}
    exponents = [1, 10, 100, MAX_EXPONENT]
    exponents += np.floor((MAX_EXPONENT + 1) ** rng.random(_GROUPS - len(exponents))).astype(int).tolist()

    def samples():
        for exponent, length in zip(
            exponents, np.array_split(span_lengths(rng, count), _GROUPS), strict=True
        ):
            viewer = sphere(rng, 1)
            light = turned(rng, viewer, rng.uniform(0, 120, 1))
            halfway = normalise(light + viewer)
            largest = min(interpolator.widest_span(exponent), 45.0)
            around = np.repeat(halfway, len(length), axis=0)
            left = turned(rng, around, rng.permutation(spread_angles(rng, len(length), 60.0)))
            right = turned(rng, left, rng.permutation(spread_angles(rng, len(length), largest)))
            left, right, light, halfway = (quantise(v) for v in (left, right, light, halfway))
            colors = (grey[name][np.newaxis] for name in ("diffuse", "specular"))
            zero = np.zeros_like(length)
            spans, direction = ends_for(design, Spans(zero, zero, length, left, right)), light
            if not interpolator.brings_ends:
                spans, direction = spans_in_frame(spans, light, halfway)
            constants = FrameConstants(exponent, grey["ambient"], direction, halfway, *colors)
            found = design.compute(spans, tabled(design, constants)).color[:, 0]
            span, pixel = pixels_of(spans.length)
            t = pixel / np.maximum(spans.length - 1, 1)[span]
            ends = [normalise(end / ONE)[span] for end in (left, right)]
            shades = []
            for normal, reflect, by_chord in (
                (interpolate("normalised", *ends, t), REFLECTION_MODELS["blinn"].reflect, False),
                (interpolator.exact_normals(*ends, t), model.reflect, interpolator.uses_chord),
            ):
                cosine, highlight = normal @ light[0] / ONE, normal @ halfway[0] / ONE
                if by_chord:
                    highlight = 1 - np.square(normal - halfway[0] / ONE).sum(axis=-1) / 2
                highlight = reflect(highlight, exponent) * (cosine > 0)
                shades.append(255 * np.minimum(ambient + k_d * np.maximum(cosine, 0) + k_s * highlight, 1))
            # The highlight is cut off where N.L changes its sign. Rounding decides this place.
            kept = cosine > 1 / 16
            angle = degrees_between(left, right)[span[kept], 0]
            yield Sample(found[kept].astype(np.float64), shades[0][kept], shades[1][kept], angle)

    return Sample.joined(samples())


# Expected results.


def spans_of(design: ShadingPipeline, beats) -> Spans:
    """Spans from the input beats of a pipeline."""
    none = np.zeros((len(beats["length"]), 3), dtype=np.int64)
    normals = (beats.get(name, none) for name in ("normal_left", "normal_right"))
    values = values_of(beats) if "values" in beats else None
    of_span = (beats[name] for name in ("x", "y", "length"))
    further = beats.get("material", np.zeros(0, dtype=np.int64)), values, beats.get("factors")
    vectors = attributes = None
    if "attributes" in beats:
        attributes = attributes_in(design.albedo, beats["attributes"])
    if "step" in beats:
        vectors = SpanVectors(*(beats.get(name) for name in SpanVectors._fields))
    return Spans(*of_span, *normals, *further, vectors, attributes)


@once
def _frames_of(unit, case):
    """Pixels by frame. A frame has the spans between writes, and all constants written before them."""
    design, spans = unit.model, spans_of(unit.model, case.beats)
    after = np.zeros(len(case.write["address"]), int) if case.write_after is None else case.write_after
    starts = np.unique(np.r_[0, after])
    return [
        design.compute(
            spans[start:stop],
            constants_written(design, first(case.write, np.searchsorted(after, start, "right"))),
        )
        for start, stop in pairwise((*starts, len(spans)))
    ]


def _expect(unit, case):
    lanes = unit.model.build.lanes
    return together([pixel_beats(pixels, lanes) for pixels in _frames_of(unit, case)])


def _status(unit, case):
    length, frames, most = case.beats["length"], _frames_of(unit, case), 65535
    return {
        "out_of_range_spans": min(sum(frame.out_of_range_spans for frame in frames), most),
        "empty_spans": min(int(np.count_nonzero(length == 0)), most),
        "overrun": int(np.any(case.beats["x"] + length > 1 << unit.model.x_bits)),
    }


# Stimuli.


_ORDERED = LOBE_ADDRESS, BANK_ADDRESS, TEXELS_ADDRESS, TEXEL_ADDRESS
"""Addresses of tables and texels. The order of their writes matters."""


def case_of(unit, spans: Spans, constants, *before: int) -> Case:
    """Input of spans and constants of each material. First all constants get each of the codes ``before``."""
    write = writes_of(constants := constants if isinstance(constants, list) else [constants])
    kept = np.isin(write["address"], _ORDERED)
    parts = [{"address": write["address"], "data": np.where(kept, write["data"], code)} for code in before]
    spans = with_lines(unit.model, ends_for(unit.model, spans), constants)
    return Case(beats_of(unit, spans), write=together([*parts, write]))


def _spans(unit, rng, count):
    """Spans of every length and angle. Some are empty, some are out of range, and some have a highlight."""
    design = unit.model
    spans = any_spans(rng, design, short_lengths(rng, count))
    return case_of(unit, spans, any_constants(rng, design, spans, rng.choice([1.0, 8.0])))


def _every_setup(unit, rng, count):
    """Many spans of one pixel, which wait for the setup, and then long spans."""
    design = unit.model
    length = np.r_[np.full(count, 1), rng.integers(1, 12, count), rng.integers(600, 4096, 8), np.full(9, 1)]
    spans = any_spans(rng, design, length)
    return case_of(unit, spans, any_constants(rng, design, spans))


def _border(design, rng):
    """Constants of a light of eight full channels, and its vector L. The light is steep at the terminator."""
    light, peak = (quantise(v)[np.newaxis] for v in sphere(rng, 2))
    colors = (Intensity.color(np.array([color])) for color in ((8, 7, 6), (0.03, 0.5, 0.1)))
    constants = FrameConstants(1, np.zeros(3, dtype=int), light, peak, *colors)
    return tabled(design, constants), light[0]


def _terminator(unit, rng, count):
    """Spans on the terminator of a light of eight full channels. There the last bits of N·L change pixels."""
    constants, light = _border(unit.model, rng)
    spans = spans_near_terminator(rng, unit.model.interpolator.MAX_ANGLE - 0.01, light)
    return case_of(unit, spans, constants, 0x3FFFF)


def _roundings(unit, rng, count):
    """Spans whose 1 - cosine is next to the border of a rounding, and normals along the axes."""
    constants, light = _border(unit.model, rng)
    largest = unit.model.interpolator.MAX_ANGLE - 0.01
    spans = joined(rng, spans_at_rounding(rng, largest, normalise(light)), axes_about(rng, largest))
    return case_of(unit, spans, constants, 0x3FFFF)


def _long_spans(unit, rng, count):
    """Long spans of large angles on the terminator, one after the other.

    Setups wait, and the last bits of differences change pixels.
    """
    constants, light = _border(unit.model, rng)
    largest = unit.model.interpolator.MAX_ANGLE - 0.01
    normals = normalise(np.cross(rng.normal(size=(304, 3)), light))
    row = spans_about(rng, largest, normals[4:], 4095, decades=1)
    farthest = spans_about(rng, largest, normals[:4], 4095, decades=0)
    farthest.x[:], farthest.length[:] = 0, 4095
    return case_of(unit, joined(rng, row[row.length > 600][:60], farthest), constants, 0x3FFFF)


def _highlights(unit, rng, count, *, exponent, invert, brightness=8):
    """Spans inside a steep highlight around H. All bits of L and H are inverted if ``invert`` is 1."""
    peak = sphere(rng, 1)[0]
    direction = normalise(sphere(rng, 1)[0] + 3 * peak)
    peak, direction = (quantise(v) ^ -invert for v in (peak, direction))
    bright = brightness * np.array([1, 0.9, 0.8])
    colors = (Intensity.color(np.array([color])) for color in ((0, 0.01, 0), bright))
    vectors = direction[np.newaxis], peak[np.newaxis]
    constants = tabled(unit.model, FrameConstants(exponent, np.zeros(3, dtype=int), *vectors, *colors))
    largest = unit.model.interpolator.MAX_ANGLE - 0.01
    spans = spans_in_highlight(rng, largest, normalise(peak), exponent)
    return case_of(unit, spans, constants, 0x3FFFF)


def _halves(unit, rng, count):
    """Channels that end in half an LSB, or in a step less. Every bit of both products counts."""
    # A pixel has the terms d and s and the diffuse colour c. The specular colour is
    # (2^22 - b - 2^17 ambient - c d) / s modulo 2^23, with b = 0 or 1, if this is a colour.
    design, candidates = unit.model, 32_768
    halfway = sphere(rng, 1)[0]
    spans = flat_spans(quantise(halfway)[np.newaxis])
    constants = replace(
        any_constants(rng, design, spans, 0.5)[0],
        exponent=int(1000 ** rng.uniform()),
        direction=quantise(normalise(halfway + 0.2 * rng.normal(size=3)))[np.newaxis],
    )
    constants = tabled(design, constants)
    away = rng.normal(size=(candidates, 3)) / np.sqrt(constants.exponent)
    flat = flat_spans(quantise(normalise(halfway + away)))
    cosine, highlight, dark = operands_of(design, flat, constants)
    d = Diffuse(cosine.format).compute(cosine).codes
    s = design.specular.compute(highlight, dark, constants.highlight).codes
    # The inverse of an odd number. At first its last 3 bits are right, then 6, 12 and 24.
    inverse = s
    for _ in range(3):
        inverse = inverse * (2 - s * inverse % (1 << 23)) % (1 << 23)
    others = (constants.ambient << 17) + constants.diffuse * d
    half = (1 << 22) - rng.integers(0, 2, (candidates, 3))
    color = (half - others) * inverse % (1 << 23)
    fits = (s % 2 == 1) & (color <= Intensity.color(8.0)) & (others + color * s < 255 << 23)
    chosen = [rng.choice(np.flatnonzero(fits[:, channel])) for channel in range(3)]
    constants.specular[0] = color[chosen, range(3)]
    return case_of(unit, flat[np.repeat(chosen, -(-count // 3))], constants)


def _brightest(unit, rng, count):
    """Three terms of eight full channels each. Earlier writes set every bit of a constant to 1 and to 0."""
    design = unit.model
    spans = any_spans(rng, design, short_lengths(rng, count))
    (constants,) = any_constants(rng, design, spans)
    constants.direction[:] = constants.halfway
    for color in (constants.ambient, constants.diffuse, constants.specular):
        color[...] = Intensity.color(np.array(8.0))
    return case_of(unit, spans, constants, 0x3FFFF, 0, 0x15555, 0x2AAAA, 20, 0x3FFFF)


_LOST = 700
"""Number of values that no table takes. It is larger than a table."""


def _disordered(rng, write, share):
    """A share of the words of a frame, in any order. Words of tables are left out."""
    kept = ~np.isin(write["address"], _ORDERED) & (rng.random(len(write["data"])) < share)
    order = rng.permutation(np.flatnonzero(kept))
    return {name: words[order] for name, words in write.items()}


def _lost(rng, design):
    """Values past the end of a table, and values for a missing bank."""
    data = rng.integers(0, 1 << 17, 2 * _LOST)
    data[_LOST] = (1 << 17) + design.specular.banks
    return {"address": np.full(len(data), LOBE_ADDRESS), "data": data}


def _frames(unit, rng, count):
    """Spans, with writes of some or all constants between them. A frame may have one pixel or no pixel."""
    design, frames, writes, after = unit.model, [], [], [0]
    while after[-1] < count:
        length = short_lengths(rng, int(rng.choice([1, 2, 5, 20, 80])))
        frame = any_spans(rng, design, length if 2 < len(length) < 80 else length % 3)
        constants = any_constants(rng, design, frame, rng.choice([1.0, 8.0]))
        if rng.random() < 0.3:
            # This word of L is equal to the value that begins a table.
            constants[0].direction[:, 0] = -ONE
        write = [writes_of(constants)]
        write += [_lost(rng, design)] if design.loads_tables and rng.random() < 0.2 else []
        if writes and rng.random() < 0.6:
            write = [_disordered(rng, write[0], rng.choice([0.3, 1.0, 1.0]))]
        frames.append(with_lines(design, ends_for(design, frame), constants))
        writes.append(together(write))
        after.append(after[-1] + len(frame))
    places = np.repeat(after[:-1], [len(write["data"]) for write in writes])
    return Case(together([beats_of(unit, of) for of in frames]), write=together(writes), write_after=places)


def _counters(unit, rng, count):
    """More empty spans, and more spans out of range, than the counters hold.

    The last span goes past the last column.
    """
    design = unit.model
    kinds = any_spans(rng, design, np.array([4, 0, 2]))
    kinds.normal_right[:] = -kinds.normal_left
    if kinds.vectors is not None:
        kinds.vectors.start[:] = kinds.vectors.step[:] = 0
    kinds.x[2] = (1 << design.x_bits) - 1
    spans = kinds[np.r_[np.repeat([0, 1], _COUNTED), 2]]
    return case_of(unit, spans, any_constants(rng, design, kinds))


# Variants.

_VALUES = preset("chord-local", "cosquad", lights=2)
_FULL = preset("quadratic", "cosquad", lights=2, gate=True)
_BOTH = ("renormalise, blinn", "quadratic, cosquad")
"""Variants that get every stimulus: with the table of the default model, and with a model of the documents.

Both take normals at the ends of spans.
"""
_ALL = ("quotient, blinn", *_BOTH)
"""Variants that get the stimuli of arbitrary spans. The first variant is the default design."""
_LESS = {"x_bits": 9, "y_bits": 8, "length_bits": 5}

DESIGNS: dict[str, ShadingPipeline] = {
    "3 lights": preset(model="cosquad7", lights=3),
    "3 materials": preset(model="cosquad", lights=2, materials=3, operand="one_minus_cosine"),
    "compact": preset(style="compact"),
    "compact, normals and a power": preset("linear", "blinn_product", style="compact"),
    "gate": preset("quadratic", "coscos2", gate=True),
    "gate, compact": preset("quadratic", "lyon3", gate=True, style="compact"),
    "exponent": preset("renormalise", "coscos4", 2, exponent=60),
    "values, the second of 2 lights fades": preset("chord-local", "blinn", 2, factors=(1,)),
    "no specular light, grey, few bits": replace(_VALUES, specular=None, grey=True, **_LESS),
    "without lights": preset(model="cosquad", lights=0, materials=2),
    "srgb": preset(transfer="srgb"),
    "srgb, without lights": preset(lights=0, materials=2, transfer="srgb"),
}
"""Further pipelines by name, with other numbers of lights and materials, styles, gates or formats."""

LONG_DESIGNS: dict[str, ShadingPipeline] = {
    "16 lights": preset(model="cosquad", lights=16),
    "linear of a chord": preset("linear", "lyon3", operand="one_minus_cosine"),
    "bisection of a chord": preset("bisection", "cosquad", lights=2, operand="one_minus_cosine"),
    "quadratic of a chord": preset("quadratic", "coscos2", 2, operand="one_minus_cosine"),
    "quadratic-eval of a chord": preset("quadratic-eval", "exp", operand="one_minus_cosine"),
    "quadratic-horner of a chord": preset("quadratic-horner", "cosquad", operand="one_minus_cosine"),
    "renormalise, N.H": preset("renormalise", "cosquad", lights=2, operand="cosine"),
    "renormalise, power, compact": preset("renormalise", "blinn_product", style="compact"),
    "values, 2 lights": _VALUES,
    "sharp lobe": preset("chord-local", "ggx", 2, scale=6),
    "values, 2 lights, one fades, compact": preset("chord-local", "lyon3", 2, factors=(0,), style="compact"),
    "values, compact, 3 materials": preset("chord-local", "cosquad", materials=3, style="compact"),
    "compact, 2 lights": preset("quadratic", "lyon3", 2, style="compact"),
    "compact, exponent": preset("quadratic", "exp", exponent=20, style="compact"),
    "gate, 2 lights, compact": _FULL.built(style="compact"),
    "gate, 2 lights": _FULL,
    "gate, linear of a chord": preset("linear", "lyon3", operand="one_minus_cosine", gate=True),
    "gate, bisection": preset("bisection", "exp", gate=True),
    "gate, angular": preset("angular", "cosquad", gate=True),
    "gate, recurrence": preset("recurrence", "cosquad", lights=2, gate=True),
    "gate, compact, power": preset("quadratic-horner", "blinn_product", gate=True, style="compact"),
    "gate, exponent": replace(_FULL, build=Build(exponent=20)),
    "grey": preset("renormalise", None, grey=True),
    "srgb, compact": preset(style="compact", transfer="srgb"),
    "srgb, without lights, grey": preset(lights=0, grey=True, transfer="srgb"),
    "few bits": replace(_VALUES, **_LESS),
}
"""Further pipelines by name, for the long run."""


_OF_VECTORS = {
    "quotient, phong": preset("quotient", "phong"),
    "quotient, 2 lights": preset("quotient", "ggx", lights=2, materials=3, banks=2),
    "quotient, no specular light, grey, few bits": preset("quotient", None, lights=2, grey=True, **_LESS),
}


_TEXTURE = TextureSampler(TexelMemory(104))
_COLORED = {
    "albedo": replace(preset("quotient"), albedo=Albedo()),
    "albedo, textures, compact, 2 materials": replace(
        preset("quotient", materials=2, style="compact"), albedo=Albedo(False, _TEXTURE)
    ),
    "albedo, both, tints, chord-local, 2 lights, srgb": replace(
        preset("chord-local", "blinn", 2), albedo=Albedo(texture=_TEXTURE, tints=True), transfer="srgb"
    ),
    "albedo, orthographic, compact, grey": replace(
        preset("renormalise", style="compact", grey=True), albedo=Albedo(perspective=False)
    ),
    "albedo, both, without lights, 2 materials": replace(
        preset("quotient", lights=0, materials=2), albedo=Albedo(texture=_TEXTURE)
    ),
}
"""Pipelines with an albedo path, by name."""


def _variants():
    designs = [("quotient", "blinn"), ("renormalise", "blinn")]
    designs += [("quadratic", model) for model in ("cosquad", "cosquad7", "cosquad_lin")]
    others = "quotient", "renormalise", "quadratic", "chord-local"
    designs += [(method, "cosquad") for method in METHODS if method not in others]
    designs += [("renormalise", "exp"), ("renormalise", "blinn_product")]
    for method, model in designs:
        design = preset(method, model)
        note = "; the bisection's fit counts as arithmetic error" * (method == "bisection")
        yield (
            f"{method}, {model}",
            Variant(
                partial(ShadingPipelineUnit, design),
                partial(_measure, design=design),
                "spans as wide as the method takes, at most 45 degrees, 1 to 4095 pixels, n 1 to 1000, "
                "N.L > 1/16",
                "LSB",
                beat=SPAN if design.interpolator.brings_ends else {"length": SPAN["length"]},
                note=f"one light, against normalised Phong interpolation with Blinn's power{note}",
                long=model not in ("blinn", "cosquad"),
            ),
        )
    for name, design in _OF_VECTORS.items():
        yield name, Variant(partial(ShadingPipelineUnit, design), long=True)
    yield "chord-local", Variant(partial(ShadingPipelineUnit, preset("chord-local", "cosquad")))
    for name, design in (LANE_DESIGNS | _COLORED).items():
        yield name, Variant(partial(ShadingPipelineUnit, design), long=True)
    for name, design in (DESIGNS | LONG_DESIGNS).items():
        yield name, Variant(partial(ShadingPipelineUnit, design), long=name in LONG_DESIGNS)


RECORD = Record(
    name="pipeline",
    title="Raster spans to pixels: an interpolator, light units and colours",
    source="docs/theory/units.md#pipeline; [T] figure 4.10",
    variants=dict(_variants()),
    expect=_expect,
    status=_status,
    stimuli={
        "spans": Stimulus(_spans, 3000, repeats=3),
        "frames": Stimulus(_frames, 400, variants=(*_ALL, "srgb, without lights", "2 lanes", "4 lanes")),
        "setups": Stimulus(_every_setup, 60, stalled=False, variants=_ALL),
        "terminator": Stimulus(_terminator, variants=_BOTH),
        "roundings": Stimulus(_roundings, variants=_BOTH),
        "long spans": Stimulus(_long_spans, stalled=False, variants=_BOTH),
        "highlights": Stimulus(partial(_highlights, exponent=997, invert=0), variants=_BOTH),
        "highlights, inverted": Stimulus(partial(_highlights, exponent=30, invert=1), variants=_BOTH),
        "peaks": Stimulus(partial(_highlights, exponent=997, invert=0, brightness=1), variants=_BOTH),
        "halves": Stimulus(_halves, 30, repeats=12, variants=_BOTH),
        "brightest": Stimulus(_brightest, 800, stalled=False, variants=_ALL),
        "counters": Stimulus(_counters, stalled=False, variants=_ALL),
    },
    waivers={
        "tables.read": "No table is written while beats read it, so the register may change on a write.",
        "multiplier_0_product": "Reciprocals and their squares are normalised: their first bits are 1.",
    },
    still={
        "a counter stays at its largest value, and a flag stays 1": "top.status[15] top.status[31-32]",
        "with one bank the last address is the same for every table": "tables.last[0-8]",
        "the FIFO of coordinates has room for all spans inside": "coordinates_room[0]",
    },
)
