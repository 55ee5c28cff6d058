"""The report's section on word lengths: the error against each word of ``quotient`` and of ``chord-local``.

A word is cut by low bits that become 0, in the bit-accurate models. Everything else keeps its length. So a
figure shows the part of each word in the error.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.report import short_words
from blysk.bench.report.section import Cell, Drawing, Section, Table
from blysk.bench.ring import ring
from blysk.bench.store import Task
from blysk.bench.svg import panels, svg
from blysk.golden.cosines.chord_setup import ChordSetup, Differences, SpanValues
from blysk.golden.cosines.quotient import Quotient
from blysk.golden.cosines.quotient_spans import MARGIN, QuotientSpans, QuotientWords, SpanVectors
from blysk.golden.frames.prepare import prepare
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.lobe import Lobe, LobeTable
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.presets import preset
from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import halfway_vector
from blysk.golden.reference.reflection import BLINN
from blysk.sim.meshes.teapot import teapot

__all__ = ["METHODS", "Word", "error_of", "measure", "section", "shortest", "tasks"]

EXPONENTS = (10, 100, 1000)

MOST_DROPPED = 8
"""Most bits by which a word is cut."""

FREE_LSB = 0.01
"""A word may be cut as long as the largest error grows by no more than this, in LSB."""


class Word(NamedTuple):
    """A word of a method.

    Parameters
    ----------
    name : str
        Name in the models' tables.
    bits : int
        Bits by default.
    what : str
        The word's place, and the parts that depend on it.
    """

    name: str
    bits: int
    what: str


_COMMON = (
    Word("entries", 17, "values in the lobe's table"),
    Word("terms", 17, "diffuse and specular term, operands of the multipliers of colours"),
)

METHODS: dict[str, tuple[Word, ...]] = {
    "quotient": (
        Word("v", 18, "vector at the first pixel, multiplier operand"),
        Word("d", 18, "step to the next pixel, multiplier operand"),
        Word("differences of m, w", 49, "accumulators of squares, 4 adders of this width"),
        Word("difference of l", 38, "accumulator of the line"),
        Word("difference of z", 30, "accumulator of the sign"),
        Word("m", 42, "square of a pixel, input of the first shifter"),
        Word("w", 42, "square of a pixel"),
        Word("q", 36, "sum of squares, input of the second shifter"),
        Word("q shifted", 21, "address and place in the table of the root"),
        Word("slope", 12, "product in the table of the root"),
        Word("r", 17, "root, multiplier operand"),
        Word("r^2", 17, "multiplier operand"),
        Word("line", 18, "multiplier operand"),
        Word("N·L", 20, "input of the diffuse unit"),
        Word("numerator", 17, "multiplier operand"),
        Word("place", 21, "address and place in the lobe's table"),
        *_COMMON,
    ),
    "chord-local": (
        Word("u", 27, "given values of 1 - N·H, bits of a beat"),
        Word("f", 26, "given values of N·L, bits of a beat"),
        Word("G", 18, "curvature, multiplier operand"),
        Word("P of u", 26, "slope of u, operand of two multipliers"),
        Word("P of f", 18, "slope of N·L, multiplier operand"),
        Word("dt", 17, "reciprocal and its square, multiplier operands"),
        Word("differences", 47, "accumulators, 4 adders of about this width"),
        Word("N·L", 27, "input of the diffuse unit"),
        Word("operand", 26, "1 - N·H of a pixel, address and place in the lobe's table"),
        *_COMMON,
    ),
}
"""Words of each method that can be cut."""


def _cut(codes: np.ndarray, dropped: int) -> np.ndarray:
    """Codes whose low bits are 0."""
    return codes >> dropped << dropped if dropped else codes


def _shorter(vectors: SpanVectors, cut: Mapping[str, int]) -> SpanVectors:
    """Nearest vectors whose words are shorter.

    The margin of the largest component is `MARGIN` steps of the shorter word. So the scale is smaller.
    """
    dropped = [cut.get(name, 0) for name in ("v", "d")]
    if not any(dropped):
        return vectors
    scale = (1 - (MARGIN << max(dropped)) * 2.0**-17) / (1 - MARGIN * 2.0**-17)
    start, step = (
        np.rint(codes * (scale * 0.5**bits)).astype(np.int64) << bits
        for codes, bits in zip((vectors.start, vectors.step), dropped, strict=True)
    )
    return SpanVectors(start, step, vectors.exponent)


def _of(name: str) -> property:
    """A format of `ChordSetup` whose fraction is cut by the bits of a word."""
    format = {
        "G": ChordSetup.CURVATURE_FORMAT,
        "P of u": ChordSetup.SLOPE_FORMAT,
        "P of f": ChordSetup.DIFFUSE_SLOPE_FORMAT,
        "low": ChordSetup.LOW_FORMAT,
    }[name]
    word = "P of u" if name == "low" else name
    return property(lambda self: replace(format, fraction_bits=format.fraction_bits - self.cut.get(word, 0)))


@dataclass(frozen=True)
class _Spans(QuotientSpans):
    """`QuotientSpans` with words that are cut."""

    cut: Mapping[str, int] = field(default_factory=dict)

    def differences(self, vectors: SpanVectors, direction: np.ndarray | None = None) -> QuotientWords:
        found = super().differences(_shorter(vectors, self.cut), direction)
        squares, line, height = (
            self.cut.get(name, 0) for name in ("differences of m, w", "difference of l", "difference of z")
        )
        return QuotientWords(
            (found.squares[0], *(_cut(codes, squares) for codes in found.squares[1:])),
            (found.lines[0], _cut(found.lines[1], line)),
            (found.heights[0], _cut(found.heights[1], height)),
        )


@dataclass(frozen=True)
class _Quotient(Quotient):
    """`Quotient` with words that are cut."""

    cut: Mapping[str, int] = field(default_factory=dict)

    def word(self, name: str, codes: np.ndarray) -> np.ndarray:
        return _cut(codes, self.cut.get(name, 0))


@dataclass(frozen=True)
class _Setup(ChordSetup):
    """`ChordSetup` with words that are cut."""

    cut: Mapping[str, int] = field(default_factory=dict)

    CURVATURE_FORMAT = _of("G")
    SLOPE_FORMAT = _of("P of u")
    DIFFUSE_SLOPE_FORMAT = _of("P of f")
    LOW_FORMAT = _of("low")

    def differences(
        self,
        start: Fixed,
        slope: Fixed,
        curvature: Fixed,
        reciprocal: Fixed,
        shift: np.ndarray,
        square: Fixed,
        square_shift: np.ndarray,
    ) -> Differences:
        dropped = self.cut.get("dt", 0)
        reciprocal, square = (Fixed(of.format, _cut(of.codes, dropped)) for of in (reciprocal, square))
        found = super().differences(start, slope, curvature, reciprocal, shift, square, square_shift)
        dropped = self.cut.get("differences", 0)
        first, second = (Fixed(of.format, _cut(of.codes, dropped)) for of in found[1:])
        return Differences(found.start, first, second)


@dataclass(frozen=True)
class _Chord(LocalChordInterpolator):
    """`LocalChordInterpolator` with words that are cut."""

    cut: Mapping[str, int] = field(default_factory=dict)

    @property
    def setup(self) -> ChordSetup:
        return _Setup(self.fraction_bits, self.cut)


class _Case(NamedTuple):
    """Spans, as a function from cut words to the operands of their pixels, and the exact cosines.

    N·L and N·H are of every pixel off the border of the light; ``kept`` has the pixels.
    """

    operands: Callable[[Mapping[str, int]], tuple[Fixed, Fixed]]
    cosine: np.ndarray
    highlight: np.ndarray
    kept: np.ndarray


def _case(
    operands: Callable[[Mapping[str, int]], tuple[Fixed, Fixed]], cosine: np.ndarray, highlight: np.ndarray
) -> _Case:
    kept = np.flatnonzero(np.abs(cosine) > 0.002)
    return _Case(operands, cosine[kept], highlight[kept], kept)


def _quotient_case(
    left: np.ndarray, right: np.ndarray, length: np.ndarray, sine: float, cosine: float
) -> _Case:
    """Spans by the vectors at their ends, in the frame of a light."""
    vectors = SpanVectors.quantise(left, right, length)
    span, index = pixels_of(length)
    t = (index / np.maximum(length - 1, 1)[span])[:, np.newaxis]
    unit = normalise((1 - t) * left[span] + t * right[span])
    model = QuotientSpans()
    direction = model.codes_of(np.array([sine]), np.array([cosine]))

    def operands(cut: Mapping[str, int]) -> tuple[Fixed, Fixed]:
        spans = _Spans(cut=cut)
        return _Quotient(spans, cut).compute(spans.compute(vectors, length, direction))[:2]

    return _case(operands, unit[:, 0] * sine + unit[:, 2] * cosine, unit[:, 2])


def _random_spans(count: int, longest: int, shortest: int = 1) -> _Case:
    """Spans as the cuts of ``quotient`` allow them: ends up to 90 degrees and a factor of 2 apart."""
    rng = np.random.default_rng(20)
    left, other = normalise(rng.normal(size=(2, count, 3)))
    left[::2] = normalise(left[::2] * [0.3, 0.3, 1] + [0, 0, 1])
    across = normalise(other - (other * left).sum(axis=1, keepdims=True) * left)
    angle = (np.pi / 2 * rng.random(count) ** 2)[:, np.newaxis]
    right = (np.cos(angle) * left + np.sin(angle) * across) * 2.0 ** rng.uniform(-1, 1, count)[:, np.newaxis]
    length = np.rint(shortest * (longest / shortest) ** rng.random(count)).astype(np.int64)
    length[length == 2] = 3
    return _quotient_case(left, right, length, np.sin(0.5), np.cos(0.5))


@lru_cache(maxsize=8)
def _cases(method: str, size: tuple[int, int], random: int, exponent: int) -> list[_Case]:
    """The fixed set: a coarse teapot and a coarse ring, and for ``quotient`` random spans.

    The exponent counts for ``chord-local``, which cuts spans by the error of the highlight.
    """
    found = []
    for mesh in (teapot(1000), ring()):
        scene = scene_for(mesh, exponent, *size)
        design = preset(method)
        prepared = prepare(scene, design)
        spans, raster = prepared.spans, prepared.cut_raster
        length = np.asarray(spans.length)
        normals = fragment_normals(scene, raster, np.arange(len(raster.span)))
        towards = scene.lights[0].towards()
        exact = normals @ towards, normals @ halfway_vector(towards, scene.camera.viewer)
        found.append(_case(_of_spans(method, spans, length, prepared.constants[0]), *exact))
    if method == "quotient":
        found += [_random_spans(random, 257), _random_spans(max(random // 50, 2), 4095, 2048)]
    return found


def _of_spans(
    method: str, spans: Any, length: np.ndarray, constants: Any
) -> Callable[[Mapping[str, int]], tuple[Fixed, Fixed]]:
    """Operands of a design's spans, by cut words."""
    direction = np.asarray(constants.direction)[:, ::2]

    def quotient(cut: Mapping[str, int]) -> tuple[Fixed, Fixed]:
        model = _Spans(cut=cut)
        return _Quotient(model, cut).compute(model.compute(spans.vectors, length, direction))[:2]

    def chord(cut: Mapping[str, int]) -> tuple[Fixed, Fixed]:
        values = SpanValues(
            _cut(spans.values.diffuse, cut.get("f", 0)), _cut(spans.values.highlight, cut.get("u", 0))
        )
        found = _Chord(cut=cut).compute_values(values, length)
        cosine, operand = (
            Fixed(of.format, _cut(of.codes, cut.get(name, 0)))
            for of, name in ((found.cosine, "N·L"), (found.highlight, "operand"))
        )
        return cosine, operand

    return quotient if method == "quotient" else chord


@lru_cache(maxsize=64)
def _table(method: str, exponent: int, dropped: int) -> tuple[Lobe, LobeTable]:
    lobe = QuotientLobe(BLINN) if method == "quotient" else Lobe(BLINN, "one_minus_cosine")
    table = lobe.table(exponent)
    return lobe, LobeTable(lobe, Fixed(table.values.format, _cut(table.values.codes, dropped)), exponent)


def error_of(
    method: str,
    cut: Mapping[str, int],
    size: Sequence[int],
    random: int,
    exponents: Sequence[int] = EXPONENTS,
) -> dict[str, float]:
    """Largest errors of both terms over the fixed set, at full intensity and before rounding of a pixel.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    cut : dict of str to int
        Bits by which words are shorter, by name.
    size : sequence of int
        Width and height of the pictures.
    random : int
        Number of random spans.
    exponents : sequence of int
        Exponents of the highlight.

    Returns
    -------
    dict
        Largest error in LSB: ``diffuse``, and of the highlight by exponent, as a text.
    """
    found = dict.fromkeys(["diffuse", *map(str, exponents)], 0.0)
    dropped = cut.get("terms", 0)
    for exponent in exponents:
        for case in _cases(method, tuple(size), random, exponent if method == "chord-local" else 1):
            cosine, operand = (of[case.kept, 0] for of in case.operands(cut))
            unit = Diffuse(cosine.format)
            diffuse = _cut(unit.compute(cosine).codes, dropped) * 2.0**-17
            exact = np.maximum(case.cosine, 0)
            found["diffuse"] = max(found["diffuse"], 255 * float(np.abs(diffuse - exact).max()))
            lobe, table = _table(method, exponent, cut.get("entries", 0))
            term = _cut(lobe.compute(operand, unit.dark(cosine), table).codes, dropped) * 2.0**-17
            exact = np.where(case.cosine > 0, BLINN.reflect(case.highlight, exponent), 0)
            error = 255 * float(np.abs(term - exact).max())
            found[str(exponent)] = max(found[str(exponent)], error)
    return found


def measure(method: str, word: str, size: Sequence[int], random: int) -> list[dict[str, float]]:
    """Errors with a word at its full length, then shorter by 1 to `MOST_DROPPED` bits; see `error_of`."""
    return [error_of(method, {word: dropped}, size, random) for dropped in range(MOST_DROPPED + 1)]


def shortest(found: Sequence[Mapping[str, float]]) -> int:
    """Bits by which a word may be cut, so that no error grows by more than `FREE_LSB`."""
    for dropped, errors in enumerate(found):
        if any(error > found[0][name] + FREE_LSB for name, error in errors.items()):
            return dropped - 1
    return len(found) - 1


_SETTINGS: dict[bool, dict[str, Any]] = {
    True: {"size": [80, 60], "random": 60},
    False: {"size": [320, 240], "random": 1000},
}


def tasks(quick: bool) -> list[Task]:
    """The errors against each word of each method, and those of short words.

    A quick report has small pictures and few spans.
    """
    found = [
        Task(measure, {"method": method, "word": word.name} | _SETTINGS[quick])
        for method, words in METHODS.items()
        for word in words
    ]
    return found + short_words.tasks(quick)


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: a drawing and a table for each method, and a table of exact normals in short words."""
    parts: list[Table | Drawing] = []
    found_of = list(zip(tasks, results, strict=True))
    short = [of for of in found_of if of[0].function is short_words.measure_short]
    cut_words = [of for of in found_of if of[0].function is measure]
    text = [
        "Each word of a method is cut bit by bit, while all others keep their lengths. The figures are the "
        "largest errors of the diffuse term and of the highlight at full intensity, before a pixel is "
        "rounded. They are measured on a coarse teapot and a coarse ring. For `quotient` there are also "
        "random spans up to 257 pixels, and of 2048 to 4095 pixels. Their ends are up to 90 degrees and a "
        "factor of 2 apart.",
    ]
    for method, words in METHODS.items():
        found = {
            task.settings["word"]: result for task, result in cut_words if task.settings["method"] == method
        }
        settings = next(task.settings for task, _ in cut_words if task.settings["method"] == method)
        free = {word.name: shortest(found[word.name]) for word in words}
        cut = {name: dropped for name, dropped in free.items() if dropped}
        whole = found[words[0].name][0]
        all_cut = error_of(method, cut, settings["size"], settings["random"])
        names = ", ".join(f"{name} by {dropped}" for name, dropped in cut.items())
        text.append(
            f"`{method}`: the largest error of a highlight is {_highlight(whole):.3f} LSB, and of the "
            f"diffuse term {whole['diffuse']:.3f} LSB. Each of these words alone can be cut by some bits, "
            f"and no error grows by more than {FREE_LSB} LSB: {names or 'none'}. If all are cut at once, "
            f"the errors are {_highlight(all_cut):.3f} LSB and {all_cut['diffuse']:.3f} LSB."
        )
        parts += [_drawing(method, words, found), _word_table(method, words, found, free)]
    parts.append(short_words.table_of(*zip(*short, strict=True)))
    return Section("words", "Word lengths", text, parts)


def _highlight(errors: Mapping[str, float]) -> float:
    return max(error for name, error in errors.items() if name != "diffuse")


_COLUMNS = 6
"""Panels in a row of the drawing."""


def _drawing(
    method: str, words: Sequence[Word], found: Mapping[str, Sequence[Mapping[str, float]]]
) -> Drawing:
    rows = -(-len(words) // _COLUMNS)
    figure, first = panels(2.4 * _COLUMNS, 1.9 * rows, 1)
    first[0].remove()
    axes = figure.subplots(rows, _COLUMNS, sharey=True, squeeze=False)
    colors = {"diffuse": "#6e6e6e", "10": "#009e73", "100": "#0072b2", "1000": "#d55e00"}
    for panel, word in zip(axes.flat, words, strict=False):
        errors = found[word.name]
        bits = [word.bits - dropped for dropped in range(len(errors))]
        for name, color in colors.items():
            label = "N·L" if name == "diffuse" else f"highlight, n = {name}"
            panel.plot(bits, [max(of[name], 1e-3) for of in errors], color=color, lw=1.1, label=label)
        panel.axvline(word.bits, color="#1c2126", lw=0.8, ls=":")
        panel.set(yscale="log", title=word.name)
        panel.grid(True, color="#dddddd", lw=0.5)
    for panel in list(axes.flat)[len(words) :]:
        panel.remove()
    figure.legend(
        *axes.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, frameon=False
    )
    figure.supylabel("largest error, LSB")
    figure.supxlabel("bits of the word")
    note = "The dotted line is the length by default. A flat line means that the word has bits to spare."
    return Drawing(f"words-{method}", f"Error against the length of each word of {method}", svg(figure), note)


def _word_table(
    method: str,
    words: Sequence[Word],
    found: Mapping[str, Sequence[Mapping[str, float]]],
    free: Mapping[str, int],
) -> Table:
    columns = ["word", "place", "bits", "bits that can go"]
    columns += [f"error with {dropped} bits less, LSB" for dropped in (0, 1, 2, 4, 6, 8)]
    rows: list[list[Cell]] = [
        [
            *(word.name, word.what, word.bits, free[word.name]),
            *(max(found[word.name][dropped].values()) for dropped in (0, 1, 2, 4, 6, 8)),
        ]
        for word in words
    ]
    note = (
        "Largest error of both terms over exponents 10, 100 and 1000. Bits that can go: with this word alone "
        f"shorter, no error grows by more than {FREE_LSB} LSB. Software rounds `v` and `d`; all other words "
        "are cut."
    )
    return Table(f"words-{method}", f"Words of {method}", columns, rows, note)
