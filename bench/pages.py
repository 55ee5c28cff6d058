"""A page a device: what it computes, its ports, its variants, and drawings of what it is and does.

``blysk pages`` writes them. Text comes from the docstrings of the unit and its twin, figures from the device
table, drawings from the netlist, from a simulation and from the measured errors.
"""

import inspect
import pydoc
import re
from collections.abc import Callable, Iterator, Sequence
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

from sim.errors import InputError
from sim.output import check_writable, write_text

from .blocks import BLOCKS, SAMPLES, SEED, Block, Row, Sample, cells_of, row_of, sample_of
from .drawing import draw_structure
from .structure import describe_shape, graph_of
from .timing import draw_timing, waves_of

__all__ = [
    "DEVICES",
    "closing",
    "command",
    "draw_errors",
    "index_page",
    "markdown",
    "opening",
    "page",
    "pictures",
    "svg",
    "write_pages",
]

PROJECT = Path(__file__).parents[1]

DEVICES: dict[str, tuple[Block, ...]] = {
    device: tuple(blocks) for device, blocks in groupby(BLOCKS, lambda block: block.device)
}
"""Entries of the table, by device."""

_STYLE = {"svg.fonttype": "none", "svg.hashsalt": "blysk", "font.family": ["DejaVu Sans"], "font.size": 8}


_DEPTH = 1e-7
"""Errors under this share of the largest are not drawn."""


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
    return _inline(first)


def _files(kind: type, twin: type | None) -> str:
    name = kind.__module__.split(".")[-1]
    twins = [f"golden/{twin.__module__.split('.')[-1]}.py"] if twin else []
    paths = [f"hdl/{name}.py", *twins, f"tests/hdl/test_{name}.py", f"tests/golden/test_{name}.py"]
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


def _variants(rows: Sequence[Row]) -> list[str]:
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


def _alike(rows: Sequence[Row], with_parts: bool) -> list[tuple[str, list[Row]]]:
    """Rows that share a drawing, by times and multipliers, and the suffix of its name; the first kinds."""
    groups: dict[tuple, list[Row]] = {}
    for row in rows:
        key = (row.latency, row.interval, row.cost.multiplier_count if with_parts else None)
        groups.setdefault(key, []).append(row)
    kinds = list(groups.values())[:_MOST_DRAWINGS]
    return [(f"-{k + 1}" if k else "", group) for k, group in enumerate(kinds)]


def _named(rows: Sequence[Row]) -> str:
    return "; ".join(row.block.variant for row in rows if row.block.variant)


# Pictures.


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
    text = re.sub(
        r"(?<![\w#.])(-?\d+\.\d{2,})(?![\w.])", lambda m: f"{float(m[1]):.1f}".rstrip("0").rstrip("."), text
    )
    text = re.sub(r'"([\d.]+)pt"', lambda m: f'"{float(m[1]) * 4 / 3:.0f}"', text)
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


def draw_errors(blocks: Sequence[Block], samples: Sequence[Sample | None]) -> Figure:
    """Largest errors against the entries' own axis, a panel a variant."""
    measured = _distinct(blocks, samples)
    columns = min(len(measured), 3)
    lines = -(-len(measured) // columns)
    single = len(measured) == 1
    figure = Figure(figsize=(5.6 if single else 2.9 * columns + 0.4, 2.9 if single else 1.9 * lines + 0.7))
    FigureCanvasAgg(figure)
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    block = measured[0].block
    bins = 90 if len(measured) <= 4 else 50
    at = [np.broadcast_to(m.sample.at, np.shape(m.sample.found)).ravel() for m in measured]
    low, high = min(a.min() for a in at), max(a.max() for a in at)
    if block.logarithmic:
        low = 1.0 if low == 0 and np.all(at[0] == np.rint(at[0])) else max(low, 1e-3)
        edges = np.geomspace(low, high, bins + 1)
        middles = np.sqrt(edges[1:] * edges[:-1])
    else:
        edges = np.linspace(low, high, bins + 1)
        middles = (edges[1:] + edges[:-1]) / 2
    largest = max(m.sample.errors[2] for m in measured)
    floor = largest * _DEPTH
    for panel, m, where in zip(axes.flat, measured, at, strict=False):
        sample = m.sample
        curves = [("total", "#1f4e79", 1.3, sample.found, sample.exact)]
        if sample.errors[0]:
            curves = [
                ("model", "#e3a376", 2.6, sample.formula, sample.exact),
                ("arithmetic", "#5b8c3a", 0.9, sample.found, sample.formula),
                *curves,
            ]
        for name, color, width, a, b in curves:
            values = _envelope(where, np.abs(np.asarray(a) - b).ravel(), edges)
            # Errors of nearly nothing would take up the whole of a logarithmic axis.
            values[values < floor] = np.nan
            panel.plot(middles, values, color=color, linewidth=width, label=name)
        if m.label:
            panel.set_title(m.label, fontsize=8)
        # A picture of many panels is kept small.
        if len(measured) <= 8:
            panel.grid(True, color="#dddddd", linewidth=0.5)
    for panel in axes.flat[len(measured) :]:
        panel.set_visible(False)
    for panel in axes[0]:
        if block.logarithmic:
            panel.set_xscale("log")
    axes[0, 0].set_yscale("log")
    for panel in axes.flat:
        panel.minorticks_off()
        if block.logarithmic:
            panel.xaxis.set_major_locator(LogLocator(numticks=5))
            panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        panel.yaxis.set_major_locator(LogLocator(numticks=5))
        panel.yaxis.set_major_formatter(lambda value, _: re.sub("e([+-])0", r"e\1", f"{value:.0e}"))
    figure.supxlabel(block.axis, fontsize=8)
    figure.supylabel(f"largest error{', ' + block.scale if block.scale else ''}", fontsize=8)
    if len(axes[0, 0].lines) > 1:
        axes[0, 0].legend(fontsize=7, loc="best")
    figure.tight_layout()
    return figure


_MOST_DRAWINGS = 3
"""Of a kind and device."""

_STRUCTURE_NOTE = (
    "Generated from the netlist. A box with the clock's mark is a register, with the operations in front of "
    "it; orange: a multiplier, yellow: an adder, green: a memory, blue: a unit of its own, white: a port. A "
    "dashed arrow chooses, a red one leads back. Left out: the control by valid and ready, enables, "
    "saturation, constants; in a large unit choices and comparisons too, then plain registers, then adders. "
    f"Of variants of more than {_MOST_DRAWINGS} kinds the first {_MOST_DRAWINGS} are drawn."
)
_TIMING_NOTE = (
    "From a simulation, clock by clock as read just before the rising edge. A, B, C are the input beats; the "
    "source pauses before the last, the sink stalls at a first result."
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
    lines = ["## Variants", "", *_variants(rows), ""]
    lines += ["Made by `blysk pages`; the columns are those of `blysk blocks`.", ""]
    for heading, note, kind_of_picture, with_parts in (
        ("Structure", _STRUCTURE_NOTE, "structure", True),
        ("Timing", _TIMING_NOTE, "timing", False),
    ):
        lines += [f"## {heading}", "", note, ""]
        groups = _alike(rows, with_parts)
        for suffix, group in groups:
            named = _named(group) if len(groups) > 1 else ""
            if named:
                lines += [f"{_inline(named)}:", ""]
            text = f"{heading} of the {_title(device).lower()}{', ' * bool(named)}{named}"
            lines += [f"![{text}]({device}-{kind_of_picture}{suffix}.svg)", ""]
    if block.measure and not any(row.errors[2] for row in rows):
        lines += ["## Errors", "", "None were found: the device is exact.", ""]
    elif block.measure:
        lines += ["## Errors", "", f"Largest errors found, against: {_inline(block.axis)}.", ""]
        lines += [f"![Errors of the {_title(device).lower()}]({device}-errors.svg)", ""]
    return (opening(device) + "\n".join([*lines, ""]) + closing(device)).rstrip() + "\n"


def pictures(device: str, rows: Sequence[Row], samples: Sequence[Sample | None]) -> Iterator[tuple[str, str]]:
    """Names and texts of the pictures of a device's page."""
    with rc_context(_STYLE):
        for suffix, group in _alike(rows, with_parts=True):
            yield f"{device}-structure{suffix}.svg", svg(draw_structure(graph_of(group[0].block.unit())))
        for suffix, group in _alike(rows, with_parts=False):
            block = group[0].block
            yield f"{device}-timing{suffix}.svg", svg(draw_timing(waves_of(block.unit(), block.beat)))
    if any(sample is not None and sample.errors[2] for sample in samples):
        with rc_context(_STYLE):
            yield f"{device}-errors.svg", svg(draw_errors([row.block for row in rows], samples))


def index_page() -> str:
    """Text of the folder's first page: the table of the devices."""
    rows = []
    for device, blocks in DEVICES.items():
        sources = dict.fromkeys(block.source for block in blocks)
        kind, _ = _documented(_unit(device))
        link = f"[{_title(device)}]({device}.md)"
        rows.append((link, ", ".join(sources), _summary(kind), str(len(blocks))))
    head = ("device", "source", "what it computes", "variants")
    body = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(
        [
            "# The devices",
            "",
            "One page a device, made by `blysk pages docs/blocks` from the code itself: text from the "
            "docstrings, figures as `blysk blocks` measures them, drawings from netlists and simulations.",
            "",
            "| " + " | ".join(head) + " |",
            "|" + " --- |" * len(head),
            *body,
            "",
        ]
    )


def write_pages(
    folder: Path,
    devices: Sequence[str] = tuple(DEVICES),
    samples: int = SAMPLES,
    progress: Callable[[str], object] | None = None,
) -> None:
    """Write the pages of devices, their pictures and the index.

    A page's files are written when all of them are made.

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

    FOLDER is docs/blocks if left out. It has to be there; other files in it are left alone.

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
