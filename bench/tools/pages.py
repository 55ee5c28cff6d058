"""Pages of units: function, ports and variants of each, and drawings of structure, timing and errors.

``blysk pages`` writes the pages, from the records of `blysk.bench.units`. Text comes from docstrings of the
unit and its bit-accurate model. Figures come from the table of the units. Drawings come from the netlist, a
simulation and the measured errors. The list of tests comes from the stimuli of the record.
"""

import inspect
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path

from amaranth.hdl import Fragment, Shape
from amaranth.lib import stream, wiring
from amaranth.lib.data import StructLayout
from matplotlib import rc_context

from blysk.bench.svg import STYLE, svg
from blysk.bench.tools.blocks import Row, cells_of, entries_shown, row_of, sample_of
from blysk.bench.tools.defaults import SEED
from blysk.bench.tools.docstrings import inline, markdown, markdown_table
from blysk.bench.tools.drawing import draw_structure
from blysk.bench.tools.error_plot import draw_errors
from blysk.bench.tools.graph import Graph, likeness
from blysk.bench.tools.netlist import describe_shape
from blysk.bench.tools.pages_folder import MADE, PROJECT, check_folder
from blysk.bench.tools.structure import graph_of
from blysk.bench.tools.timing import draw_timing, waves_of
from blysk.bench.units.names import ROOMS
from blysk.bench.units.record import Record
from blysk.bench.units.registry import RECORDS
from blysk.bench.units.sample import Sample
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.sim.output import write_text

__all__ = [
    "SAMPLES",
    "index_page",
    "page",
    "pictures",
    "test_command",
    "write_pages",
]

SAMPLES = 100_000
"""Random operands of each variant, enough for the drawings."""

_TITLES = {
    "geometry": "Triangles to spans",
    "normals": "Normals of a span",
    "cosines": "Cosines without normals",
    "methods": "Whole methods",
    "albedo": "Colour of a pixel",
    "lighting": "Light",
    "video": "From a mesh in memory to a monitor",
    "bus": "Buses of other designs",
    "": "Whole cores",
}
"""Titles of the folders of units."""


# Parts of a page.


def _title(unit: str) -> str:
    text = unit.replace("_", " ")
    return text.upper() if len(text) <= 3 else text[0].upper() + text[1:]


@cache
def _component(unit: str) -> wiring.Component:
    """A unit in its first variant, to read its ports."""
    component = entries_shown(unit)[0].variant.unit()
    # Amaranth warns of a component that is never elaborated.
    Fragment.get(component, None)
    return component


def _model(unit: str) -> type | None:
    """Class of the bit-accurate model. ``None`` if the unit has no model of the same name."""
    component = _component(unit)
    model = type(getattr(component, "model", None))
    return model if model.__name__ == type(component).__name__.removesuffix("Unit") else None


def _link(text: str, path: str, folder: Path) -> str:
    """A text with a link from a page to a file of the project. Without a checkout it has no link."""
    file, _, anchor = path.partition("#")
    if not (PROJECT / file).exists():
        return text
    address = Path(os.path.relpath(PROJECT / file, folder.resolve())).as_posix()
    return f"[{text}]({address}{'#' * bool(anchor)}{anchor})"


def _files(unit: str, folder: Path) -> str:
    """Links to the files of a unit."""
    path = "/".join(type(_component(unit)).__module__.split(".")[2:])
    room, _, name = path.rpartition("/")
    paths = [f"golden/{path}.py", f"hdl/{path}.py", f"bench/units/{path}.py"]
    paths += [f"tests/{layer}/{room}/test_{name}.py".replace("//", "/") for layer in ("golden", "hdl")]
    return " · ".join(_link(f"`{path}`", path, folder) for path in paths if (PROJECT / path).exists())


def _with_links(text: str, folder: Path) -> str:
    """A text in Markdown. Its citations of the theory become links."""
    return re.sub(r"docs/theory/\w+\.md(#[\w-]+)?", lambda cited: _link(cited[0], cited[0], folder), text)


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
    return markdown_table(("port", "kind", "field", "format", "bits"), rows)


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
    """Table of the measured variants of a unit, in Markdown."""
    table = []
    for row in rows:
        cells, variant = cells_of(row), row.entry.variant
        unit = f" {variant.scale}" if variant.scale else ""
        errors = [cell if cell in ("-", "0") else cell + unit for cell in cells[3:6]]
        table.append(
            (
                row.entry.name or "-",
                *errors,
                str(row.latency),
                str(row.interval),
                cells[-1],
                str(row.cost.rom_bits),
                str(row.cost.ram_bits),
                str(row.cost.register_bits),
                variant.domain + (" (every one)" if variant.exhaustive else ""),
                variant.note,
            )
        )
    kept = [k for k in range(len(_VARIANT_HEAD)) if any(line[k] not in ("", "0") for line in table) or k < 9]
    return markdown_table([_VARIANT_HEAD[k] for k in kept], [[line[k] for k in kept] for line in table])


@cache
def _graph(unit: str, number: int) -> Graph:
    """Structure of variant ``number`` of a unit's page."""
    return graph_of(entries_shown(unit)[number].variant.unit())


@cache
def _structures(unit: str) -> list[tuple[str, list[int]]]:
    """Groups of variants with equal structure, each with the suffix of its drawing's name."""
    entries = entries_shown(unit)
    if len(entries) == 1:
        return [("", [0])]
    groups: dict[str, list[int]] = {}
    for number in range(len(entries)):
        groups.setdefault(likeness(_graph(unit, number)), []).append(number)
    return _suffixed(groups.values())


def _timings(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    """Groups of rows with equal interval, each with the suffix of its drawing's name."""
    groups: dict[int, list[Row]] = {}
    for row in rows:
        groups.setdefault(row.interval, []).append(row)
    return _suffixed(groups.values())


def _suffixed(groups: Iterable[list]) -> list[tuple[str, list]]:
    return [(f"-{k + 1}" if k else "", group) for k, group in enumerate(groups)]


_STRUCTURE_NOTE = (
    "The drawing is generated from the netlist. A box with the clock's mark is a register, with the "
    "operations in front of the register.\n\n"
    "- Orange: a multiplier. Yellow: an adder, or a product by a constant. Green: a memory. Blue: a unit "
    "inside. White: a port.\n"
    "- A dashed arrow carries a choice. A red arrow leads back.\n"
    "- A wide drawing is in bands. An arrow that ends at a numbered tag continues at the tags of the same "
    "number.\n"
    "- A formula in bold is the value of a register. A shared register has several formulas, and holds "
    "their values in turn. The name of the register is below the formulas.\n"
    "- The drawing leaves out control by valid and ready, enables, saturation and constants. For a large "
    "unit it also leaves out comparisons and choices, then plain registers.\n\n"
    "Variants that differ only in words and constants share the drawing of the first variant."
)

_TIMING_NOTE = (
    "The drawing shows a simulation, cycle by cycle, with the levels just before the rising edge. A, B and C "
    "are the input beats. If a beat has several results, the results of A are A0, A1 and so on. If the beats "
    "have different numbers of results, all results are 1, 2, 3 and so on. The source pauses before the last "
    "beat. The sink stalls at a first result. Dots stand for cycles without a change. Each interval has a "
    "drawing. The table above has the latencies of all variants."
)


def _opening(unit: str, folder: Path) -> list[str]:
    """First part of a page, before the measured part: names, docstring of the unit, ports."""
    component, record = _component(unit), RECORDS[unit]
    kind = type(component)
    sources = dict.fromkeys(record.source_of(name) for name in (entry.name for entry in entries_shown(unit)))
    lines = [f"# {_title(unit)}", "", f"{inline(record.title)}. `{kind.__module__}.{kind.__name__}`", ""]
    lines += [
        f"Source: {'; '.join(sources)}",
        "",
        _files(unit, folder),
        "",
        markdown(inspect.getdoc(kind)),
        "",
    ]
    return [*lines, "## Ports", "", *_ports(component), ""]


def _variants(unit: str, rows: Sequence[Row]) -> list[str]:
    lines = ["## Variants", "", *variants_table(rows), ""]
    lines += [
        f"Made by `blysk pages` with {SAMPLES:,} random operands. The columns are those of `blysk blocks`.",
        "",
    ]
    others = [name for name in RECORDS[unit].variants if name not in [row.entry.name for row in rows]]
    if others:
        lines += [f"Also tested: {inline('; '.join(others))}.", ""]
    return lines


def _drawings(unit: str, rows: Sequence[Row]) -> list[str]:
    """Drawings of structure and timing, with their explanations."""
    title = _title(unit).lower()
    lines = ["## Structure", "", _STRUCTURE_NOTE, ""]
    structures = _structures(unit)
    for suffix, numbers in structures:
        named = "; ".join(rows[k].entry.name for k in numbers if rows[k].entry.name) or "default"
        named = named if len(structures) > 1 else ""
        lines += [f"{inline(named)}:", ""] if named else []
        lines += [f"![Structure of the {title}{', ' * bool(named)}{named}]({unit}-structure{suffix}.svg)", ""]
    lines += ["## Timing", "", _TIMING_NOTE, ""]
    for suffix, (row, *others) in _timings(rows):
        named = f"{row.entry.name or 'default'}: " if len(rows) > 1 else ""
        times = f"latency {row.latency}, interval {row.interval}"
        more = f"; {len(others)} more with this interval" if others else ""
        lines += [f"{inline(named)}{times}{more}.", ""]
        lines += [f"![Timing of the {title}, {named}{times}]({unit}-timing{suffix}.svg)", ""]
    return lines


def _errors(unit: str, rows: Sequence[Row]) -> list[str]:
    """The drawing of the errors, with an explanation of its axes."""
    if rows[0].entry.variant.measure is None:
        return []
    if not any(row.errors[2] for row in rows):
        return ["## Errors", "", "No errors were found. The unit is exact.", ""]
    record, scale = rows[0].entry.record, rows[0].entry.variant.scale
    words = f"Errors are in {scale}." if scale else "1 is a full term, or the length of a unit vector."
    text = f"Largest errors found, against: {inline(record.axis)}. {words}"
    if scale == "rate":
        text = (
            "Shares of decisions that are yes by mistake (first error column), and no by mistake (second "
            f"error column), against: {inline(record.axis)}."
        )
    return ["## Errors", "", text, "", f"![Errors of the {_title(unit).lower()}]({unit}-errors.svg)", ""]


def test_command(unit: str) -> str:
    """The shell command that tests the RTL of a unit, from the folder of a clone."""
    return f".venv/bin/python -m pytest -m '' tests/test_units.py -k {unit}"


def _tests(record: Record) -> list[str]:
    """Stimuli with their corner cases, waivers and idle registers, from the record."""
    rows = [
        (
            name,
            given.covers,
            f"{given.count:,}" + (f", {given.repeats} times" if given.repeats > 1 else ""),
            "yes" if given.stalled else "no",
            "long" if given.long else "always",
        )
        for name, given in record.stimuli.items()
    ]
    lines = ["## Stimuli and corner cases", ""]
    lines += ["With each stimulus, a test compares the RTL with the bit-accurate model, beat by beat.", ""]
    lines += ["Run the tests in a clone, after `make test`:", ""]
    lines += [f"    {test_command(record.name)}", ""]
    lines += [*markdown_table(("stimulus", "cases covered", "beats or pixels", "stalls", "run"), rows), ""]
    if record.waivers:
        lines += [
            "Signals at which a fault may stay unseen. Some faults invert a bit only while another bit of "
            "the same word, the *controlling bit*, has a certain value:",
            "",
        ]
        lines += [
            *markdown_table(("signal", "reason"), [(f"`{s}`", why) for s, why in record.waivers.items()])
        ]
        lines += [""]
    if record.still:
        lines += ["Register bits that never change:", ""]
        still = [(why, f"`{bits}`") for why, bits in record.still.items()]
        lines += [*markdown_table(("reason", "bits"), still), ""]
    return lines


def page(unit: str, rows: Sequence[Row], folder: Path) -> str:
    """Text of the page of a unit.

    Parameters
    ----------
    unit : str
        A key of `RECORDS`.
    rows : sequence of Row
        Rows of `entries_shown`.
    folder : Path
        Folder of the page, from which its links lead.
    """
    lines = [*_opening(unit, folder), *_variants(unit, rows), *_drawings(unit, rows), *_errors(unit, rows)]
    lines += _tests(RECORDS[unit])
    if model := _model(unit):
        title = f"## Arithmetic: `{model.__module__}.{model.__name__}`"
        lines += [title, "", markdown(inspect.getdoc(model))]
    return _with_links("\n".join(lines), folder).rstrip() + "\n"


def pictures(unit: str, rows: Sequence[Row], samples: Sequence[Sample | None]) -> Iterator[tuple[str, str]]:
    """Names and texts of the pictures of the page of a unit."""
    with rc_context(STYLE):
        for suffix, numbers in _structures(unit):
            yield f"{unit}-structure{suffix}.svg", svg(draw_structure(_graph(unit, numbers[0])))
        for suffix, (row, *_) in _timings(rows):
            entry, component = row.entry, row.entry.variant.unit()
            # A unit with a result for each beat shows its latency and interval with any operands.
            alone = entry.variant.beat or isinstance(component, PipelinedUnit)
            example = None if alone else entry.record.example(entry.name, component)
            waves = waves_of(component, entry.variant.beat, example)
            yield f"{unit}-timing{suffix}.svg", svg(draw_timing(waves))
        if any(sample is not None and sample.errors[2] for sample in samples):
            yield f"{unit}-errors.svg", svg(draw_errors([row.entry for row in rows], samples))


def _room(record: Record) -> str:
    """Room of a unit, by the folder of its file."""
    parts = record.kind.__module__.split(".")
    return parts[2] if len(parts) > 3 else ""


def index_page(folder: Path) -> str:
    """Text of the first page of the folder: the units in the order of the pipeline."""
    lines = [
        "# The units",
        "",
        f"Each unit has a page, {MADE} from the code. Text comes from the docstrings, figures are those of "
        "`blysk blocks`, and drawings come from netlists and simulations. The units are in the order in "
        "which a span passes through them. If several units have the same function, a pipeline has only one "
        "of them.",
    ]
    if "pipeline" in RECORDS:
        lines += ["", "[![Structure of the pipeline](pipeline-structure.svg)](pipeline.md)"]
    for room in ROOMS:
        rows = []
        for unit, record in RECORDS.items():
            if _room(record) != room:
                continue
            count = len(record.variants)
            sources = dict.fromkeys(record.source_of(name) for name in record.variants)
            picture = f'<img src="{unit}-structure.svg" alt="" height="90">'
            text = f"{record.title}<br>{count} variant{'s' * (count > 1)}".replace("|", "\\|")
            source = _with_links("<br>".join(sources), folder)
            rows.append(f"| [{_title(unit)}]({unit}.md) | {text} | {source} | {picture} |")
        if rows:
            lines += ["", f"## {_TITLES[room]}", ""]
            lines += ["| unit | function | source | structure |", "| --- | --- | --- | --- |", *rows]
    return "\n".join([*lines, ""])


def write_pages(
    folder: Path,
    units: Sequence[str] = tuple(RECORDS),
    samples: int = SAMPLES,
    progress: Callable[[str], object] | None = None,
) -> None:
    """Write the pages of units, their pictures and the index.

    The files of a page are written after all of them are made. Pictures that the page no longer has are
    removed.

    Parameters
    ----------
    folder : Path
        Folder of the pages, such as ``docs/blocks``. The folder is made if it does not exist. Links lead from
        the folder to the files of the project.
    units : sequence of str
        Keys of `RECORDS`.
    samples : int
        Random operands of each variant.
    progress : callable, optional
        Called with the name of a unit before its work.

    Raises
    ------
    InputError
        If the folder or a file cannot be written, or if a file that is no page would be replaced.
    """
    check_folder(folder, units)
    # The first page marks the folder as a folder of pages, even if the command is interrupted later.
    write_text(folder / "README.md", index_page(folder))
    for unit in units:
        if progress:
            progress(unit)
        entries = entries_shown(unit)
        measured = [sample_of(e, samples, SEED) if e.variant.measure else None for e in entries]
        rows = [row_of(entry, sample) for entry, sample in zip(entries, measured, strict=True)]
        files = {f"{unit}.md": page(unit, rows, folder), **dict(pictures(unit, rows, measured))}
        for name, text in files.items():
            write_text(folder / name, text)
        for path in folder.glob(f"{unit}-*.svg"):
            of_this_page = re.fullmatch(rf"{unit}-(structure|timing|errors)(-\d+)?\.svg", path.name)
            if of_this_page and path.name not in files:
                path.unlink()
