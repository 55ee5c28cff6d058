"""A page a device: what it computes, its ports, its variants, and drawings of what it is and does.

``blysk pages`` writes them. Text comes from the docstrings of the unit and its twin, figures from the device
table, drawings from the netlist, from a simulation and from the measured errors.
"""

import hashlib
import inspect
import pydoc
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from io import StringIO
from itertools import groupby, pairwise
from pathlib import Path

import click
import numpy as np
from amaranth.hdl import Fragment, Shape
from amaranth.lib import stream, wiring
from amaranth.lib.data import StructLayout
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from tqdm import tqdm

from blysk.bench.tools.blocks import BLOCKS, SEED, Block, Row, Sample, cells_of, row_of, sample_of
from blysk.bench.tools.drawing import draw_structure
from blysk.bench.tools.structure import Graph, describe_shape, graph_of
from blysk.bench.tools.timing import draw_timing, waves_of
from blysk.sim.errors import InputError
from blysk.sim.output import check_writable, write_text

__all__ = [
    "DEVICES",
    "SAMPLES",
    "closing",
    "command",
    "draw_errors",
    "index_page",
    "likeness",
    "markdown",
    "opening",
    "page",
    "pictures",
    "svg",
    "variants_table",
    "write_pages",
]

PROJECT = Path(__file__).parents[2]

SAMPLES = 100_000
"""Random operands of each entry: enough for the drawings, and few enough to check all pages often."""

DEVICES: dict[str, tuple[Block, ...]] = {
    device: tuple(blocks) for device, blocks in groupby(BLOCKS, lambda block: block.device)
}
"""Entries of the table, by device."""

_STYLE = {"svg.fonttype": "none", "svg.hashsalt": "blysk", "font.family": ["DejaVu Sans"], "font.size": 8}


_DEPTH = 1e-7
"""Errors under this share of the largest are not drawn."""

_DOCUMENTED = "total, as documented"

_LIKENESS_DEPTH = 8
"""Arrows from a box to those that tell it from another."""


# Docstrings as Markdown.


def _inline(text: str) -> str:
    """Inline literals, and what Markdown would take for its own."""
    parts = re.split(r"(``.+?``|:\w+:`[^`]+`|`[^`]+`)", text)
    for k, part in enumerate(parts):
        if k % 2:
            parts[k] = "`" + re.sub(r"^:\w+:", "", part).strip("`") + "`"
        else:
            # Stars that multiply, not those of emphasis.
            part = re.sub(r"([<\\])", r"\\\1", part)
            parts[k] = re.sub(r"(?<=\w)\*(?=\w)|(?<=\s)\*(?=\s)", r"\\*", part)
    return "".join(parts)


def _table(lines: Sequence[str]) -> list[str]:
    """A table whose columns are marked by runs of ``=``, as one of Markdown."""
    starts = [match.start() for match in re.finditer("=+", lines[0])]
    spans = list(pairwise([*starts, None]))
    rules = [k for k, line in enumerate(lines) if set(line.strip()) <= {"=", " "}]
    head, body = lines[1 : rules[1]], lines[rules[1] + 1 :]
    if len(rules) == 2:
        head, body = [], lines[1:]
    body = [line for line in body if set(line.strip()) - {"=", " "}]

    def cells(line: str) -> list[str]:
        return [line[a:b].strip() for a, b in spans]

    rows: list[list[str]] = []
    for line in body:
        row = cells(line)
        if rows and not row[0]:
            rows[-1] = [f"{above} {more}".strip() for above, more in zip(rows[-1], row, strict=True)]
        else:
            rows.append(row)
    titles = [" ".join(parts).strip() for parts in zip(*map(cells, head), strict=True)] or [""] * len(starts)
    return _markdown_table(titles, rows)


def _markdown_table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    def line(row):
        return "| " + " | ".join(_inline(cell).replace("|", "\\|") for cell in row) + " |"

    return [line(titles), "|" + " --- |" * len(titles), *map(line, rows)]


_SECTIONS = {"Parameters", "Members", "Attributes", "Raises", "Returns", "Yields"}
"""Sections that are lists of names; others are text."""


def markdown(text: str) -> str:
    """A docstring in the project's manner as Markdown.

    Parameters
    ----------
    text : str
        Cleaned docstring: paragraphs, lists, tables with ``=`` rules, numpydoc sections.
    """
    # A literal stays on a line.
    text = re.sub(r"``[^`]+``", lambda match: re.sub(r"\s*\n\s*", " ", match[0]), text)
    lines = text.splitlines()
    found: list[str] = []
    in_section = False
    k = 0
    while k < len(lines):
        line = lines[k]
        following = lines[k + 1] if k + 1 < len(lines) else ""
        if re.fullmatch(r"=+( +=+)+ *", line):
            ends = [
                n
                for n in range(k + 1, len(lines))
                if set(lines[n].strip()) <= {"=", " "} and lines[n].strip()
            ]
            blank = next((n for n in range(k, len(lines)) if not lines[n].strip()), len(lines))
            end = max(n for n in ends if n < blank)
            found += _table(lines[k : end + 1])
            k = end
        elif line and re.fullmatch("-{3,}", following) and len(following) >= len(line):
            found += [f"**{line}**", ""]
            in_section = line in _SECTIONS
            k += 1
        elif in_section and line and not line.startswith((" ", "Source:")):
            name, _, kind = line.partition(" : ")
            kind = _inline(kind)
            names = ", ".join(f"`{part.strip()}`" for part in name.split(","))
            body = []
            while k + 1 < len(lines) and (lines[k + 1].startswith("    ") or not lines[k + 1].strip()):
                if not lines[k + 1].strip() and not (k + 2 < len(lines) and lines[k + 2].startswith("    ")):
                    break
                k += 1
                body.append(lines[k].strip())
            entry = f"- {names}" + (f" ({kind})" if kind else "")
            found.append(f"{entry}: {_inline(' '.join(body))}" if body else entry)
        else:
            if line.startswith("Source:"):
                in_section = False
            found.append(_inline(line))
        k += 1
    return "\n".join(found)


# Parts of a page.


def _title(device: str) -> str:
    text = device.replace("_", " ")
    return text.upper() if len(text) <= 3 else text[0].upper() + text[1:]


@cache
def _unit(device: str) -> wiring.Component:
    """A device's unit in its first variant, to be looked at only."""
    unit = DEVICES[device][0].unit()
    # A unit that nothing elaborates gives a warning.
    Fragment.get(unit, None)
    return unit


def _documented(unit: wiring.Component) -> tuple[type, type | None]:
    """Class of a unit, and that of its twin."""
    kind = type(unit)
    module = kind.__module__.replace("hdl.", "golden.")
    return kind, pydoc.locate(f"{module}.{kind.__name__.removesuffix('Unit')}")


def _summary(kind: type) -> str:
    """First sentence or line of a docstring."""
    first = inspect.getdoc(kind).split("\n\n")[0].replace("\n", " ")
    # The page says where the twin is.
    return _inline(re.sub(r"; `golden\.[^;]*twin\.$", ".", first))


def _files(kind: type, twin: type | None) -> str:
    place = "/".join(kind.__module__.split(".")[2:])
    golden = "/".join(twin.__module__.split(".")[2:]) if twin else place
    paths = [f"hdl/{place}.py", f"golden/{golden}.py"]
    paths += [
        f"tests/{layer}/{place}".replace(place.split("/")[-1], f"test_{place.split('/')[-1]}") + ".py"
        for layer in ("hdl", "golden")
    ]
    links = [f"[`{path}`](../../{path})" for path in paths if (PROJECT / path).exists()]
    return " · ".join(links)


def _ports(unit: wiring.Component) -> list[str]:
    rows = []
    for name, member in unit.signature.members.items():
        flow = "in" if member.flow == wiring.In else "out"
        is_stream = member.is_signature and isinstance(member.signature, stream.Signature)
        shape = member.signature.members["payload"].shape if is_stream else member.shape
        kind = f"stream {flow}" if is_stream else flow
        fields = [("payload" if is_stream else "", shape)]
        if isinstance(shape, StructLayout):
            fields = list(shape.members.items())
        for field_name, field_shape in fields:
            width = Shape.cast(field_shape).width
            rows.append(
                (
                    f"`{name}`",
                    kind,
                    f"`{field_name}`" if field_name else "",
                    describe_shape(field_shape),
                    str(width),
                )
            )
    return _markdown_table(("port", "kind", "field", "format", "bits"), rows)


_VARIANT_HEAD = (
    "variant",
    "model error",
    "arithmetic error",
    "total error",
    "latency",
    "interval",
    "multipliers",
    "ROM bits",
    "RAM bits",
    "register bits",
    "domain",
    "note",
)


def variants_table(rows: Sequence[Row]) -> list[str]:
    """Lines of the table of a device's entries."""
    table = []
    for row in rows:
        cells = cells_of(row)
        unit = f" {row.block.scale}" if row.block.scale else ""
        errors = [cell if cell in ("-", "0") else cell + unit for cell in cells[4:7]]
        table.append(
            (
                row.block.variant or "-",
                *errors,
                str(row.latency),
                str(row.interval),
                cells[-1],
                str(row.cost.rom_bits),
                str(row.cost.ram_bits),
                str(row.cost.register_bits),
                row.block.domain + (" (every one)" if row.block.exhaustive else ""),
                row.block.note,
            )
        )
    kept = [k for k in range(len(_VARIANT_HEAD)) if any(line[k] not in ("", "0") for line in table) or k < 9]
    return _markdown_table([_VARIANT_HEAD[k] for k in kept], [[line[k] for k in kept] for line in table])


@cache
def _graph(device: str, place: int) -> Graph:
    """Structure of a device's entry."""
    return graph_of(DEVICES[device][place].unit())


def likeness(graph: Graph) -> str:
    """A text that graphs share if they are alike but for widths, registers' names and constants."""
    labels = {
        number: repr(
            (
                node.kind,
                node.name if node.kind in ("input", "output") else "",
                node.detail if node.kind == "unit" else "",
                sorted((s, n) for s, n in node.operations.items() if n and not s.endswith("c")),
                node.copies,
                node.stages,
            )
        )
        for number, node in graph.nodes.items()
    }
    sources, targets = graph.neighbours()
    # A box is told by its neighbours, theirs, and so on.
    for _ in range(_LIKENESS_DEPTH):
        labels = {
            number: _digest(
                label,
                sorted((labels[other], graph.edges[other, number]) for other in sources[number]),
                sorted((labels[other], graph.edges[number, other]) for other in targets[number]),
            )
            for number, label in labels.items()
        }
    return _digest(sorted(labels.values()))


def _digest(*parts) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()


@cache
def _structures(device: str) -> list[tuple[str, list[int]]]:
    """Entries of one structure, and the suffix of its drawing's name."""
    blocks = DEVICES[device]
    if len(blocks) == 1:
        return [("", [0])]
    groups: dict[str, list[int]] = {}
    for place in range(len(blocks)):
        groups.setdefault(likeness(_graph(device, place)), []).append(place)
    return _suffixed(groups.values())


def _timings(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    """Rows of one interval, and the suffix of their drawing's name."""
    groups: dict[int, list[Row]] = {}
    for row in rows:
        groups.setdefault(row.interval, []).append(row)
    return _suffixed(groups.values())


def _suffixed(groups: Iterable[list]) -> list[tuple[str, list]]:
    return [(f"-{k + 1}" if k else "", group) for k, group in enumerate(groups)]


# Pictures.


def _with_classes(text: str) -> str:
    """Styles that are used more than once as classes."""
    found = Counter(re.findall(r' style="([^"]*)"', text))
    names = {style: f"s{k}" for k, (style, uses) in enumerate(found.items()) if uses > 1}
    rules = "".join(f".{name}{{{style}}}\n" for style, name in names.items())
    text = re.sub(r' style="([^"]*)"', lambda m: f' class="{names[m[1]]}"' if m[1] in names else m[0], text)
    return text.replace("</style>", f"\n{rules}</style>", 1)


_NUMBER = re.compile(r"(?<![\w#.])-?\d+\.\d{2,}(?![\w.])")


def _rounded(number: re.Match) -> str:
    return f"{float(number[0]):.1f}".rstrip("0").rstrip(".")


def svg(figure: Figure) -> str:
    """A figure as SVG, the same text every time: without date, indentation, clipping and needless digits."""
    buffer = StringIO()
    with rc_context(_STYLE):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, facecolor="white")
    text = re.sub(r"<metadata>.*?</metadata>", "", buffer.getvalue(), flags=re.DOTALL)
    text = re.sub(r"<!DOCTYPE.*?>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r' clip-path="url\([^"]*"', "", text)
    text = re.sub(r"<clipPath.*?</clipPath>", "", text, flags=re.DOTALL)
    # Numbers of strokes and places, not those that are written.
    text = re.sub(r"<[^>]*>", lambda tag: _NUMBER.sub(_rounded, tag[0]), text)
    text = re.sub(r'"([\d.]+)pt"', lambda m: f'"{float(m[1]) * 4 / 3:.0f}"', text)
    text = _with_classes(text)
    used = set(re.findall(r"#([\w-]+)", text))
    text = re.sub(r' id="([\w-]+)"', lambda m: m[0] if m[1] in used else "", text)
    text = re.sub(r"font-family: 'DejaVu Sans'", "font-family: 'DejaVu Sans', Verdana, sans-serif", text)
    return re.sub(r"\s*\n\s*", "\n", text).strip() + "\n"


def _envelope(at: np.ndarray, errors: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Largest error in each interval; NaN where there is none."""
    place = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, len(edges) - 2)
    largest = np.full(len(edges) - 1, -1.0)
    np.maximum.at(largest, place, errors)
    return np.where(largest < 0, np.nan, largest)


def _shares(at: np.ndarray, errors: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Share of errors in each interval; NaN where there is nothing."""
    counts, wrong = np.histogram(at.ravel(), edges)[0], np.histogram(at.ravel()[errors], edges)[0]
    return np.divide(wrong, counts, out=np.full(len(counts), np.nan), where=counts > 0)


@dataclass(frozen=True)
class _Measured:
    label: str
    block: Block
    sample: Sample


def _distinct(blocks: Sequence[Block], samples: Sequence[Sample | None]) -> list[_Measured]:
    """Entries that were measured, those of equal results as one."""
    found: list[_Measured] = []
    for block, sample in zip(blocks, samples, strict=True):
        if sample is None:
            continue
        for k, other in enumerate(found):
            if np.array_equal(other.sample.found, sample.found):
                common = [part for part in other.label.split(", ") if part in block.variant.split(", ")]
                found[k] = _Measured(", ".join(common), other.block, other.sample)
                break
        else:
            found.append(_Measured(block.variant, block, sample))
    return found


def _with_documented(measured: Sequence[_Measured]) -> list[tuple[_Measured, _Measured | None]]:
    """Panels: each default variant with its documented one, if there are both."""

    def parts(label):
        return set(label.split(", ")) - {"documented", ""}

    found: list[tuple[_Measured, _Measured | None]] = []
    for m in measured:
        places = [
            k
            for k, (other, documented) in enumerate(found)
            if documented is None and parts(other.label) == parts(m.label)
        ]
        if "documented" in m.label.split(", ") and places:
            found[places[0]] = (found[places[0]][0], m)
        else:
            found.append((m, None))
    return found


def draw_errors(blocks: Sequence[Block], samples: Sequence[Sample | None]) -> Figure:
    """Largest errors against the entries' own axis, a panel a variant, with the one as documented in it."""
    panels = _with_documented(_distinct(blocks, samples))
    columns = 2 if len(panels) == 4 else min(len(panels), 3)
    lines = -(-len(panels) // columns)
    single = len(panels) == 1
    figure = Figure(figsize=(5.6 if single else 2.9 * columns + 0.4, 2.9 if single else 1.9 * lines + 0.7))
    FigureCanvasAgg(figure)
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    measured = [m for panel in panels for m in panel if m]
    block = measured[0].block
    at = {id(m): np.broadcast_to(m.sample.at, np.shape(m.sample.found)).ravel() for m in measured}
    # Pixels of a span share its angle: an interval of one span would show that span's chance.
    bins = min(90 if len(panels) <= 4 else 50, *(max(len(np.unique(a)) // 8, 2) for a in at.values()))
    low, high = min(a.min() for a in at.values()), max(a.max() for a in at.values())
    if block.logarithmic:
        first = at[id(measured[0])]
        low = 1.0 if low == 0 and np.all(first == np.rint(first)) else max(low, 1e-3)
        edges = np.geomspace(low, high, bins + 1)
        middles = np.sqrt(edges[1:] * edges[:-1])
    else:
        edges = np.linspace(low, high, bins + 1)
        middles = (edges[1:] + edges[:-1]) / 2
    decides = np.asarray(measured[0].sample.found).dtype == bool
    floor = 0.0 if decides else max(m.sample.errors[2] for m in measured) * _DEPTH
    handles = {}
    for panel, (m, documented) in zip(axes.flat, panels, strict=False):
        curves = [(name, errors, m) for name, errors in _curves_of(m.sample)]
        if documented:
            curves.append((_DOCUMENTED, _curves_of(documented.sample)[-1][1], documented))
        for name, errors, of in curves:
            values = (_shares if decides else _envelope)(at[id(of)], errors, edges)
            # Intervals between whole numbers are empty.
            has_any = ~np.isnan(values)
            values = values[has_any]
            # Errors of nearly nothing would take up the whole of a logarithmic axis.
            values[values < floor] = np.nan
            (handles[name],) = panel.plot(middles[has_any], values, label=name, **_CURVES[name])
        if m.label:
            panel.set_title(m.label, fontsize=8)
        # A picture of many panels is kept small.
        panel.grid(True, axis="both" if len(panels) <= 8 else "y", color="#dddddd", linewidth=0.5)
    for panel in axes.flat[len(panels) :]:
        panel.set_visible(False)
    for panel in axes.flat[max(len(panels) - columns, 0) : len(panels)]:
        panel.tick_params(labelbottom=True)
    if block.logarithmic:
        axes[0, 0].set_xscale("log")
    if not decides:
        axes[0, 0].set_yscale("log")
    for panel in axes.flat:
        panel.minorticks_off()
        if block.logarithmic:
            panel.xaxis.set_major_locator(LogLocator(numticks=5))
            panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        if not decides:
            panel.yaxis.set_major_locator(LogLocator(numticks=5))
            panel.yaxis.set_major_formatter(lambda value, _: re.sub("e([+-])0", r"e\1", f"{value:.0e}"))
    figure.supxlabel(block.axis, fontsize=8)
    label = f"largest error{', ' + block.scale if block.scale else ''}"
    figure.supylabel("share of all results" if decides else label, fontsize=8)
    if len(handles) > 1:
        shown = [name for name in _CURVES if name in handles]
        figure.legend(
            [handles[name] for name in shown], shown, fontsize=7, loc="upper right", ncols=4, frameon=False
        )
    figure.tight_layout(
        rect=(0, 0, 1, 1 - 0.22 / figure.get_figheight()) if len(handles) > 1 else (0, 0, 1, 1)
    )
    return figure


_CURVES = {
    "model": {"color": "#e3a376", "linewidth": 2.6},
    "arithmetic": {"color": "#5b8c3a", "linewidth": 0.9},
    "total": {"color": "#1f4e79", "linewidth": 1.3},
    _DOCUMENTED: {"color": "#b03a2e", "linewidth": 1.1, "linestyle": (0, (4, 2))},
    "yes by mistake": {"color": "#1f4e79", "linewidth": 1.3},
    "no by mistake": {"color": "#b03a2e", "linewidth": 1.3},
}


def _curves_of(sample: Sample) -> list[tuple[str, np.ndarray]]:
    """Names of the curves of an entry, and the errors of every result; the last is the total error."""
    found, exact = np.asarray(sample.found), sample.exact
    if found.dtype == bool:
        return [("yes by mistake", found & ~exact), ("no by mistake", exact & ~found)]
    curves = [("total", found - exact)]
    if sample.errors[0]:
        curves = [("model", sample.formula - exact), ("arithmetic", found - sample.formula), *curves]
    return [(name, np.abs(errors).ravel()) for name, errors in curves]


_STRUCTURE_NOTE = (
    "Generated from the netlist. A box with the clock's mark is a register, with the operations in front of "
    "it; orange: a multiplier, yellow: an adder or a product by a constant, green: a memory, blue: a unit of "
    "its own, white: a port. A dashed arrow chooses, a red one leads back. A wide drawing is in bands: an "
    "arrow that ends at a numbered tag goes on at the tags of that number. Left out: the control by valid "
    "and ready, enables, saturation, constants; in a large unit choices and comparisons too, then plain "
    "registers, then adders. Variants that differ in words and constants alone share a drawing, of the "
    "first."
)
_TIMING_NOTE = (
    "From a simulation, clock by clock as read just before the rising edge. A, B, C are the input beats, A0, "
    "A1 the results of A where it has several; the source pauses before the last beat, the sink stalls at a "
    "first result. Dots stand for cycles without a change. A drawing for each interval; the latencies of all "
    "variants are in the table above."
)


def opening(device: str) -> str:
    """What a page says before its measured part: names, docstring of the unit, ports."""
    unit = _unit(device)
    kind, twin = _documented(unit)
    sources = ", ".join(dict.fromkeys(block.source for block in DEVICES[device]))
    lines = [f"# {_title(device)}", "", f"`{kind.__module__}.{kind.__name__}`, source: {sources}.", ""]
    lines += [_files(kind, twin), "", markdown(inspect.getdoc(kind)), ""]
    return "\n".join([*lines, "## Ports", "", *_ports(unit), "", ""])


def closing(device: str) -> str:
    """What a page says after its measured part: the docstring of the twin, if there is one."""
    _, twin = _documented(_unit(device))
    if twin is None:
        return ""
    return f"## Arithmetic: `{twin.__module__}.{twin.__name__}`\n\n{markdown(inspect.getdoc(twin))}\n"


def page(device: str, rows: Sequence[Row]) -> str:
    """Text of a device's page.

    Parameters
    ----------
    device : str
        A key of `DEVICES`.
    rows : sequence of Row
        Lines of the table of all its entries.
    """
    block = rows[0].block
    lines = ["## Variants", "", *variants_table(rows), ""]
    lines += [
        f"Made by `blysk pages` of {SAMPLES:,} random operands; the columns are those of `blysk blocks`.",
        "",
    ]
    title = _title(device).lower()
    lines += ["## Structure", "", _STRUCTURE_NOTE, ""]
    structures = _structures(device)
    for suffix, places in structures:
        named = "; ".join(rows[k].block.variant for k in places if rows[k].block.variant) or "default"
        named = named if len(structures) > 1 else ""
        lines += [f"{_inline(named)}:", ""] if named else []
        lines += [
            f"![Structure of the {title}{', ' * bool(named)}{named}]({device}-structure{suffix}.svg)",
            "",
        ]
    lines += ["## Timing", "", _TIMING_NOTE, ""]
    for suffix, (row, *others) in _timings(rows):
        named = f"{row.block.variant or 'default'}: " if len(rows) > 1 else ""
        times = f"latency {row.latency}, interval {row.interval}"
        more = f"; {len(others)} more of this interval" if others else ""
        lines += [f"{_inline(named)}{times}{more}.", ""]
        lines += [f"![Timing of the {title}, {named}{times}]({device}-timing{suffix}.svg)", ""]
    if block.measure and not any(row.errors[2] for row in rows):
        lines += ["## Errors", "", "None were found: the device is exact.", ""]
    elif block.measure:
        unit = f"In {block.scale}." if block.scale else "1 is a full term, or the length of a unit vector."
        text = f"Largest errors found, against: {_inline(block.axis)}. {unit}"
        if block.scale == "share":
            text = (
                "Shares of the decisions that are yes by mistake (the first error column) and no by mistake "
                f"(the second), against: {_inline(block.axis)}."
            )
        lines += ["## Errors", "", text, ""]
        lines += [f"![Errors of the {title}]({device}-errors.svg)", ""]
    return (opening(device) + "\n".join([*lines, ""]) + closing(device)).rstrip() + "\n"


def pictures(device: str, rows: Sequence[Row], samples: Sequence[Sample | None]) -> Iterator[tuple[str, str]]:
    """Names and texts of the pictures of a device's page."""
    with rc_context(_STYLE):
        for suffix, places in _structures(device):
            yield f"{device}-structure{suffix}.svg", svg(draw_structure(_graph(device, places[0])))
        for suffix, (row, *_) in _timings(rows):
            block = row.block
            yield f"{device}-timing{suffix}.svg", svg(draw_timing(waves_of(block.unit(), block.beat)))
    if any(sample is not None and sample.errors[2] for sample in samples):
        with rc_context(_STYLE):
            yield f"{device}-errors.svg", svg(draw_errors([row.block for row in rows], samples))


_STAGES: dict[str, dict[str, str]] = {
    "Normals of a span from its ends": {
        "dot_product": "cosine of the angle between two vectors",
        "middle_normal": "normal in the middle of a span, by a square root's polynomial",
        "gpq": "coefficients of the quadratic curve through both ends and the middle",
        "difference_setup": "forward differences of that curve, for a span's number of pixels",
        "difference_accumulator": "normals on that curve, by two additions a pixel",
        "quadratic_evaluator": "normals on that curve, by products instead",
        "renormaliser": "makes any normal a unit vector: the rival of all that avoids it",
    },
    "Normals by bisection": {
        "bisection": "normal half-way between two others, of unit length",
        "bisection_chain": "normals at a half, a quarter, an eighth of a span",
        "adaptive_normaliser": "a span's normals by bisection as deep as its angle asks for, lines between",
    },
    "Cosines without normals": {
        "arccos": "angle of a cosine",
        "half_chord": "angle between two vectors from their distance, well-conditioned near 0",
        "angular_setup": "angles of a span and a vector, and the step from a pixel to the next",
        "highlight_cosine": "cosine of a span's angles, from a table",
        "recurrence_setup": "start values and coefficient of the recurrence",
        "recurrence": "cosines along a span by a product and two additions a pixel",
        "chord": "half the square of the distance of two unit vectors, which is 1 less their cosine",
        "chord_setup": "differences of the cosines along a span",
        "local_chord_setup": "the same from three values a span, for lights or a viewer that are near",
    },
    "A whole method": {
        "linear_interpolator": "normals on a straight line, not of unit length: Phong's own",
        "quadratic_interpolator": "normals on a quadratic curve",
        "bisection_interpolator": "normals by bisection",
        "angular_interpolator": "cosines by their angles",
        "recurrence_interpolator": "cosines by recurrence",
        "chord_interpolator": "cosines by forward differences",
        "local_chord_interpolator": "cosines by forward differences, for lights or a viewer that are near",
    },
    "Light": {
        "highlight_gate": "tells from its ends that a span has no highlight",
        "diffuse": "diffuse term of a cosine",
        "specular": "highlight term, by a model in the place of a power",
        "power": "highlight term, by the power itself",
        "light": "both terms of a light for a normal",
        "intensity": "colour of a pixel from the terms of its lights",
    },
    "All of it": {"pipeline": "from spans to coloured pixels"},
}
"""Devices in the order in which a pixel passes them, and what each is for."""


def _in_order() -> list[tuple[str, list[tuple[str, str]]]]:
    """Parts of the index: devices and what they are for; new ones are in a last part."""
    parts = [
        (title, [(device, purpose) for device, purpose in devices.items() if device in DEVICES])
        for title, devices in _STAGES.items()
    ]
    known = {device for _, devices in parts for device, _ in devices}
    others = [(device, "") for device in DEVICES if device not in known]
    return parts + [("Others", others)] * bool(others)


def index_page() -> str:
    """Text of the folder's first page: the devices in the order of the pipeline."""
    lines = [
        "# The devices",
        "",
        "One page a device, made by `blysk pages docs/blocks` from the code itself: text from the "
        "docstrings, figures as `blysk blocks` measures them, drawings from netlists and simulations. "
        "The devices are in the order in which a span passes them; of those that do the same a pipeline has "
        "one.",
        "",
        "[![The pipeline with the quadratic method](pipeline-structure.svg)](pipeline.md)",
    ]
    for title, devices in _in_order():
        lines += ["", f"## {title}", ""]
        rows = []
        for device, purpose in devices:
            blocks = DEVICES[device]
            kind, _ = _documented(_unit(device))
            sources = dict.fromkeys(block.source for block in blocks)
            summary = _summary(kind).replace("|", "\\|")
            link = f"[{_title(device)}]({device}.md)"
            picture = f'<img src="{device}-structure.svg" alt="" height="90">'
            text = f"{purpose[:1].upper()}{purpose[1:]}.<br>{summary}" if purpose else summary
            count = f"{len(blocks)} variant{'s' * (len(blocks) > 1)}"
            rows.append(f"| {link} | {text} | {', '.join(sources)}<br>{count} | {picture} |")
        lines += ["| device | what it does | source | structure |", "| --- | --- | --- | --- |", *rows]
    return "\n".join([*lines, ""])


def write_pages(
    folder: Path,
    devices: Sequence[str] = tuple(DEVICES),
    samples: int = SAMPLES,
    progress: Callable[[str], object] | None = None,
) -> None:
    """Write the pages of devices, their pictures and the index.

    A page's files are written when all of them are made; pictures that it no longer has are removed.

    Parameters
    ----------
    folder : Path
        An existing folder, such as ``docs/blocks``: pages link to files two levels up.
    devices : sequence of str
        Keys of `DEVICES`.
    samples : int
        Random operands of each entry.
    progress : callable, optional
        Called with a device's name before its work.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    check_writable(folder / "README.md")
    for device in devices:
        if progress:
            progress(device)
        blocks = DEVICES[device]
        measured = [sample_of(block, samples, SEED) for block in blocks]
        rows = [row_of(block, sample) for block, sample in zip(blocks, measured, strict=True)]
        files = {f"{device}.md": page(device, rows), **dict(pictures(device, rows, measured))}
        for name, text in files.items():
            write_text(folder / name, text)
        for path in folder.glob(f"{device}-*.svg"):
            of_this_page = re.fullmatch(rf"{device}-(structure|timing|errors)(-\d+)?\.svg", path.name)
            if of_this_page and path.name not in files:
                path.unlink()
    write_text(folder / "README.md", index_page())


class _Device(click.ParamType):
    """A name of a device."""

    name = "device"

    def convert(self, value, param, ctx):
        if value not in DEVICES:
            raise InputError(f"--device {value}", "unknown device", f"use one of {', '.join(DEVICES)}")
        return value


@click.command(short_help="Pages of the devices, with drawings.")
@click.argument("folder", type=click.Path(path_type=Path), default="docs/blocks")
@click.option("--device", "devices", type=_Device(), multiple=True, help="This page alone; repeat for more.")
def command(folder, devices):
    """Write a page a device, with drawings of structure, timing and errors, into FOLDER.

    FOLDER is docs/blocks if left out. It has to be there. Pictures that a page no longer has are removed,
    other files are left alone.

    \b
    Example:
        blysk pages docs/blocks --device bisection
    """
    devices = devices or tuple(DEVICES)
    with tqdm(total=len(devices), unit=" pages", leave=False, disable=None) as bar:

        def show(device):
            bar.set_postfix_str(device)
            bar.update(devices.index(device) - bar.n)

        write_pages(folder, devices, progress=show)
    click.echo(f"{'pages':<12}{folder}")
