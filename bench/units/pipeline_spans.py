"""Spans and constants for the pipeline. Some are arbitrary. For others, last bits decide a pixel."""

from dataclasses import replace

import numpy as np

from blysk.bench.units.albedo.albedo import any_attributes
from blysk.bench.units.albedo.texel_memory import loaded_words
from blysk.bench.units.cosines.chord_setup import any_factors, any_values
from blysk.bench.units.cosines.quotient_spans import line_directions
from blysk.bench.units.methods.quotient_interpolator import any_span_vectors
from blysk.bench.units.operands import pairs_at, pairs_chosen, turned, unit_codes
from blysk.golden.albedo.texel_memory import LoadedTextures, TextureDescriptor
from blysk.golden.cosines.quotient_spans import QuotientSpans, SpanVectors
from blysk.golden.frame_constants import (
    BANK_ADDRESS,
    EMISSION_ADDRESS,
    FIELDS_OF_A_FRAME,
    FIELDS_OF_A_LIGHT,
    LIGHT_STRIDE,
    LOBE_ADDRESS,
    MATERIAL_ADDRESS,
    TEXEL_ADDRESS,
    TEXELS_ADDRESS,
    TEXTURE_ADDRESS,
    THRESHOLD_ADDRESS,
    TINTED_ADDRESS,
    FrameConstants,
)
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.lobe import LobeTable
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light_frame import light_frame
from blysk.hdl.pipeline import span_shape
from blysk.sim.frames.frame import sample_textures

__all__ = [
    "LANE_DESIGNS",
    "any_constants",
    "any_spans",
    "axes_about",
    "constants_written",
    "ends_for",
    "flat_spans",
    "joined",
    "operands_of",
    "spans_about",
    "spans_at_rounding",
    "spans_in_frame",
    "spans_in_highlight",
    "spans_near_terminator",
    "tabled",
    "vectors_for",
    "with_lines",
]

_LONG_AND_SHORT = ((200, 4095), (3000, 12))
"""Number of spans and their largest length, for long and for short spans."""

LANE_DESIGNS: dict[str, ShadingPipeline] = {
    name: design.built(lanes=int(name[0]))
    for name, design in (
        ("2 lanes", preset()),
        ("2 lanes, phong, srgb, 3 materials", preset(model="phong", materials=3, transfer="srgb")),
        (
            "2 lanes, no specular light, grey, few bits",
            preset("quotient", None, 2, grey=True, x_bits=9, y_bits=8, length_bits=5),
        ),
        ("2 lanes, 2 lights", preset(lights=2)),
        ("2 lanes, without lights, srgb", preset(lights=0, transfer="srgb")),
        ("4 lanes", preset()),
        (
            "4 lanes, phong, 2 lights, grey, few bits",
            preset(model="phong", lights=2, grey=True, length_bits=5),
        ),
        ("4 lanes, without lights, few bits", preset(lights=0, length_bits=2)),
    )
}
"""Pipelines with several lanes, by name."""


# Constants.


def any_constants(
    rng: np.random.Generator, design: ShadingPipeline, spans: Spans, brightness: float = 1.0
) -> list[FrameConstants]:
    """Constants of each material. L and H are normals of spans, so that some pixels have a highlight."""
    lights = design.lights
    direction, halfway = (unit_codes(rng, lights) for _ in range(2))
    members = span_shape(design).members
    if "step" in members:
        direction = np.insert(line_directions(rng, lights), 1, 0, axis=1)
    elif "normal_left" in members and len(spans):
        direction[:] = spans.normal_right[rng.integers(0, len(spans), lights)]
        halfway[:] = spans.normal_left[rng.integers(0, len(spans), lights)]
    found = []
    for _ in range(design.materials):
        chosen = [1, 20, 200, 1000, rng.integers(1, 1001), 513 + 2 * rng.integers(243)]
        exponent = design.build.exponent or int(rng.choice(chosen))
        # The codes are odd, so the last bits of their products count.
        colors = [Intensity.color(rng.uniform(0, brightness, (lights, 3))) | 1 for _ in range(2)]
        if design.specular is None:
            colors[1][:] = 0
        # Without lights the ambient term is the whole colour.
        ambient = Intensity.color(rng.uniform(0, 0.2 if lights else 1, 3))
        found.append(FrameConstants(exponent, ambient, direction, halfway, *colors))
    if design.loads_tables:
        lobe = design.specular
        rough = lobe.reflection.PARAMETER == "roughness"
        any_of = rng.uniform(0.05, 1, lobe.banks) if rough else rng.integers(1, 1001, lobe.banks)
        of_bank = lobe.fixed or any_of.tolist()
        banks = rng.integers(0, lobe.banks, design.materials).tolist()
        found = [tabled(design, of, of_bank[bank], bank) for of, bank in zip(found, banks, strict=True)]
    return sample_textures(design, found, rng) if design.albedo else found


def tabled(
    design: ShadingPipeline, constants: FrameConstants, parameter: float | None = None, bank: int = 0
) -> FrameConstants:
    """Constants, with the table of a parameter if the pipeline loads tables.

    The default parameter is the exponent of the constants.
    """
    if not design.loads_tables:
        return constants
    table = design.specular.table(constants.exponent if parameter is None else parameter)
    threshold = design.threshold_of(table).codes.item() if design.has_threshold else None
    return replace(constants, lobe=table, bank=bank, threshold=threshold)


def _tables_written(design: ShadingPipeline, write: dict[str, np.ndarray]) -> list[LobeTable]:
    """Table of each bank after the writes."""
    lobe = design.specular
    if lobe.fixed is not None:
        return lobe.fixed_tables
    values = np.zeros((lobe.banks, lobe.entries + 1), dtype=np.int64)
    data = write["data"][write["address"] == LOBE_ADDRESS]
    starts = np.flatnonzero(data >> 17)
    for start, end in zip(starts, [*starts[1:], len(data)], strict=True):
        # The unit drops values for a bank that does not exist, and values past the end of a table.
        if data[start] - (1 << 17) < lobe.banks:
            loaded = data[start + 1 : end][: values.shape[1]]
            values[data[start] - (1 << 17), : len(loaded)] = loaded
    return [LobeTable(lobe, Fixed(lobe.VALUE_FORMAT, row)) for row in values]


def constants_written(design: ShadingPipeline, write: dict[str, np.ndarray]) -> list[FrameConstants]:
    """Constants of each material after the writes to a pipeline. Before the writes all constants are 0."""
    words = np.zeros((design.materials, (design.lights + 1) * LIGHT_STRIDE), dtype=np.int64)
    index = 0
    for address, data in zip(write["address"].tolist(), write["data"].tolist(), strict=True):
        if design.materials > 1 and address == MATERIAL_ADDRESS:
            index = data
        elif address < words.shape[1]:
            # L and H belong to the frame, not to a material.
            of_frame = address >= LIGHT_STRIDE and address % LIGHT_STRIDE < FIELDS_OF_A_LIGHT["diffuse"][0]
            words[slice(None) if of_frame else index, address] = data
    by_light = words.reshape(design.materials, -1, LIGHT_STRIDE)[:, 1:]
    found = []
    for material, lights in zip(words, by_light, strict=True):
        fields = {name: lights[:, first : first + n] for name, (first, n) in FIELDS_OF_A_LIGHT.items()}
        for name in ("direction", "halfway"):
            fields[name] = (fields[name] ^ 1 << 17) - (1 << 17)
        for name in ("diffuse", "specular"):
            fields[name] = fields[name] & Intensity.COLOR_FORMAT.max_code
        first, count = FIELDS_OF_A_FRAME["ambient"]
        ambient = material[first : first + count] & Intensity.COLOR_FORMAT.max_code
        found.append(FrameConstants(int(material[0]) & 0x3FF, ambient, **fields))
    if design.albedo is not None:
        found = _colored(design, found, words, write)
    if not design.loads_tables:
        return found
    tables, banks = _tables_written(design, write), words[:, BANK_ADDRESS].tolist()
    thresholds: list[int | None] = [None] * len(found)
    if design.has_threshold:
        thresholds = (words[:, THRESHOLD_ADDRESS] & design.threshold_format.max_code).tolist()
    return [
        replace(of, lobe=tables[bank], bank=bank, threshold=threshold)
        for of, bank, threshold in zip(found, banks, thresholds, strict=True)
    ]


def _colored(
    design: ShadingPipeline, found: list[FrameConstants], words: np.ndarray, write: dict[str, np.ndarray]
) -> list[FrameConstants]:
    """Constants with the fields of an albedo, from the words of each material and the writes of texels."""
    albedo = design.albedo
    emission = words[:, EMISSION_ADDRESS : EMISSION_ADDRESS + 3] & Intensity.COLOR_FORMAT.max_code
    tinted = words[:, TINTED_ADDRESS] & 1
    found = [
        replace(of, emission=e, tinted=bool(t) if albedo.tints else None)
        for of, e, t in zip(found, emission, tinted, strict=True)
    ]
    if albedo.texture is None:
        return found
    address = write["address"]
    of_texels = np.isin(address, (TEXELS_ADDRESS, TEXEL_ADDRESS))
    beats = {"value": write["data"][of_texels], "begins": address[of_texels] == TEXELS_ADDRESS}
    texels = LoadedTextures(loaded_words(albedo.texture.memory, beats), ())
    found = [
        replace(of, texture=TextureDescriptor.of_words(*pair))
        for of, pair in zip(found, words[:, TEXTURE_ADDRESS : TEXTURE_ADDRESS + 2].tolist(), strict=True)
    ]
    return [replace(found[0], texels=texels), *found[1:]]


# Spans.


def any_spans(rng: np.random.Generator, design: ShadingPipeline, length: np.ndarray) -> Spans:
    """Spans of given lengths and any material. Some have equal normals. Some are too wide for the method."""
    count = len(length)
    largest = min(design.interpolator.MAX_ANGLE, 179.0)
    angles = np.where(rng.random(count) < 0.1, rng.uniform(largest, 180, count), largest * rng.random(count))
    angles[::20] = 0
    left, right = (quantise(normals) for normals in pairs_at(rng, count, angles))
    length, members = length % (1 << design.length_bits), span_shape(design).members
    return Spans(
        x=rng.integers(0, np.maximum((1 << design.x_bits) - length, 1)),
        y=rng.integers(0, 1 << design.y_bits, count),
        length=length,
        normal_left=left,
        normal_right=right,
        material=np.sort(rng.integers(0, design.materials, count)),
        values=any_values(rng, count, design.lights) if "values" in members else None,
        factors=any_factors(rng, count, len(design.factors)) if design.factors else None,
        vectors=vectors_for(rng, design, length) if "step" in members else None,
        attributes=any_attributes(rng, design.albedo, length) if design.albedo else None,
    )


def vectors_for(rng: np.random.Generator, design: ShadingPipeline, length: np.ndarray) -> SpanVectors:
    """Any vectors that spans with given numbers of pixels bring, for a method that takes vectors."""
    highlights = design.specular is not None
    vectors = any_span_vectors(rng, design.interpolator, design.lights, highlights, length)
    if design.interpolator.pairs:
        # In a pair the step is a vector. Some vectors are too short.
        pair = np.flatnonzero(length == 2)
        vectors.step[pair] = vectors.start[rng.permutation(len(length))[: len(pair)]]
    return vectors


def with_lines(design: ShadingPipeline, spans: Spans, constants: list[FrameConstants]) -> Spans:
    """Spans with the lines that a pipeline with several lanes takes, from the constants of each material."""
    if design.build.lanes == 1 or design.specular is None or not design.lights:
        return spans
    direction = np.stack([of.direction[:, ::2] for of in constants])[spans.material]
    return replace(spans, vectors=design.interpolator.with_lines(spans.vectors, direction, True))


def spans_in_frame(spans: Spans, light: np.ndarray, halfway: np.ndarray) -> tuple[Spans, np.ndarray]:
    """Spans between unit normals with their vectors in the frame of a light.

    The second result is the direction to the light in this frame, as codes, shape (1, 3). No source gives a
    span of two pixels, so such a span gets a third pixel.

    Parameters
    ----------
    spans : Spans
        Spans with codes of unit normals.
    light, halfway : int arrays, shape (1, 3)
        Codes of L and H.
    """
    direction, peak = normalise(light[0]), normalise(halfway[0])
    frame = light_frame(direction, 2 * (direction @ peak) * peak - direction)
    ends = (normalise(normals) @ frame.axes.T for normals in (spans.normal_left, spans.normal_right))
    length = np.where(spans.length == 2, 3, spans.length)
    vectors = SpanVectors.quantise(*ends, length)
    given = np.rint(frame.direction * QuotientSpans.ONE).astype(np.int64)
    return replace(spans, length=length, vectors=vectors), given[np.newaxis]


def ends_for(design: ShadingPipeline, spans: Spans) -> Spans:
    """Spans whose ends are changed from the format of unit normals to the format of the method."""
    shift = design.interpolator.END_FORMAT.fraction_bits - COMPONENT.fraction_bits
    if not shift:
        return spans
    return replace(spans, normal_left=spans.normal_left << shift, normal_right=spans.normal_right << shift)


def flat_spans(normals: np.ndarray) -> Spans:
    """Spans of one pixel, with normals of these codes."""
    zero = np.zeros(len(normals), dtype=np.int64)
    return Spans(zero, zero, zero + 1, normals, normals)


def joined(rng: np.random.Generator, *kinds: Spans) -> Spans:
    """All spans of several kinds, in random order."""
    names = ("x", "y", "length", "normal_left", "normal_right")
    spans = Spans(*(np.concatenate([getattr(kind, name) for kind in kinds]) for name in names))
    return spans[rng.permutation(len(spans))]


def spans_about(
    rng: np.random.Generator, largest: float, middles: np.ndarray, longest: int, decades: int = 4
) -> Spans:
    """Spans with given middle normals. Angles and lengths have a uniform logarithm.

    Parameters
    ----------
    rng : Generator
        Generator of the random numbers.
    largest : float
        Largest angle, degrees.
    middles : array, shape (spans, 3)
        Unit vectors.
    longest : int
        Largest length in pixels.
    decades : int
        Number of decades of the angles.
    """
    count = len(middles)
    across = normalise(np.cross(middles, rng.normal(size=middles.shape)))
    angles = np.radians(largest * 10.0 ** rng.uniform(-decades, 0, (count, 1)))
    left, right = (
        quantise(middles * np.cos(angles / 2) + side * across * np.sin(angles / 2)) for side in (-1, 1)
    )
    length = ((longest + 1) ** rng.uniform(0, 1, count)).astype(int)
    return Spans(rng.integers(0, 4097 - length), rng.integers(0, 4096, count), length, left, right)


def spans_near_terminator(rng: np.random.Generator, largest: float, code: np.ndarray) -> Spans:
    """Spans on the terminator, the border of light and shade. ``code`` has the codes of L.

    The sign of N·L decides whether there is a highlight. N·L has 34 fraction bits, or is rounded to 25. So
    some spans start within a few last bits of the terminator. Some spans cross the terminator as slowly as
    possible. Along some spans N·L rises by half a step of 2^-18 more than a whole number of these steps.
    """
    light = normalise(code)

    def normals(count, least=0.0, most=0.0):
        height = rng.uniform(least, most, (count, 1))
        return normalise(normalise(np.cross(rng.normal(size=(count, 3)), light)) + height * light)

    moves = np.stack(np.mgrid[-30:31, -30:31, -30:31], axis=-1).reshape(-1, 3)
    moves = moves[np.argsort(moves @ code)]
    rises = moves @ code
    border, tie = (spans_about(rng, 0.1, normals(count), 60) for count in (6000, 1500))
    crossing = spans_about(rng, 0.01, normals(250), 4095, decades=1)
    away = rng.choice([0, 1 << 8], len(border)) + rng.integers(-16, 17, len(border))
    away -= border.normal_left @ code
    nearest = np.searchsorted(rises[:-1], away)
    border.normal_left[:] += moves[nearest]
    border = border[np.argsort(np.abs(away - rises[nearest]))[:600]]
    halves = np.argsort(np.abs((rises & 0xFFFF) - 0x8000))[:40]
    tie.normal_right[:] = tie.normal_left + moves[rng.choice(halves, len(tie))]
    # Some of the short spans are out of range.
    lit = (
        spans_about(rng, most, normals(count, -0.02, 0.12), longest)
        for most, (count, longest) in zip((largest, 180.0), _LONG_AND_SHORT, strict=True)
    )
    return joined(rng, *lit, border, tie, crossing)


def spans_at_rounding(rng: np.random.Generator, largest: float, light: np.ndarray) -> Spans:
    """Spans along the terminator whose 1 - cosine depends on last bits.

    For some spans 1 - cosine is at the border of its rounding. For the other spans 1 - cosine
    is at a border where the number of segments of bisection changes.
    """
    normaliser = AdaptiveNormaliser()
    across = normalise(np.cross(light, rng.normal(size=3)))
    angle = np.radians(rng.uniform(-largest / 2, largest / 2, (3000, 1)))
    height = rng.uniform(0, 0.1, (3000, 1))
    arc = np.cos(angle) * across + np.sin(angle) * np.cross(light, across) + height * light
    left, right = np.split(quantise(normalise(arc)), 2)

    def levels(u, move):
        return normaliser.levels(
            Fixed(normaliser.bisection.ANGLE_FORMAT, (u + (1 << 16) >> 17) + move), False
        )

    chosen = (
        (500, lambda u: abs((u + (1 << 15)) % (1 << 16) - (1 << 15)) < 8),
        (200, lambda u: levels(u, -1) != levels(u, 1)),
    )
    kinds = []
    for count, choose in chosen:
        pairs = np.stack(pairs_chosen(left, right, choose), axis=1)
        kinds.append(rng.choice(pairs, count))
    first, second = np.concatenate(kinds).swapaxes(0, 1)
    length, (x, y) = rng.integers(3, 60, len(first)), rng.integers(0, 4000, (2, len(first)))
    return Spans(x, y, length, first, second)


def spans_in_highlight(rng: np.random.Generator, largest: float, halfway: np.ndarray, exponent: int) -> Spans:
    """Spans inside a highlight, with 1 - N.H up to 2/n.

    Most spans are in the part with an eighth of the peak or less. For some the logarithm of 1 - N·H is
    uniform.
    """
    kinds = []
    for count, longest in _LONG_AND_SHORT:
        share = np.where(
            rng.random(count) < 0.2, 10.0 ** rng.uniform(-7, 0, count), rng.uniform(0.6, 0.9, count)
        )
        cosine = 1 - share * 2 / exponent
        middles = turned(rng, np.tile(halfway, (count, 1)), np.degrees(np.arccos(cosine)))
        kinds.append(spans_about(rng, largest, middles, longest))
    return joined(rng, *kinds)


def axes_about(rng: np.random.Generator, largest: float) -> Spans:
    """Spans near the axes. On an axis a component of the normal is 1, and is rounded to the largest code."""
    axes = np.repeat(np.concatenate([np.eye(3), -np.eye(3)]), 40, axis=0)
    return spans_about(rng, largest, axes, 60)


# Operands.


def operands_of(
    design: ShadingPipeline, spans: Spans, constants: FrameConstants
) -> tuple[Fixed, Fixed, np.ndarray]:
    """N.L, the specular operand, and a flag for a light behind the surface, by the bit-accurate model."""
    operands = design.operands(ends_for(design, spans), constants)
    return operands.cosine, operands.highlight, Diffuse(operands.cosine.format).dark(operands.cosine)
