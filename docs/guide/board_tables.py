"""Fill in the tables of ``board.md`` from ``board.json`` (of ``blysk board --record``) and from `BOARDS`.

python docs/guide/board_tables.py            # write the tables
python docs/guide/board_tables.py --check    # change nothing; fail if the page has other tables
"""

import argparse
import json
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from blysk.bench.tools.boards import BOARDS

GUIDE = Path(__file__).parent
PAGE, FIGURES = GUIDE / "board.md", GUIDE / "board.json"
_TABLE = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)

_LIGHT = "normal and highlight of every pixel"
_OTHERS = (
    ("pico-gs", "ECP5-25K, 100 MHz", "640 to 960", "60, by its SPI port", "by the host, at vertices"),
    (
        "Raster I",
        "Artix-7 100T, 100 MHz",
        "3,000",
        "about 30 at 1024x768",
        "Phong of every pixel, deferred",
    ),
    ("PixelForge", "Cyclone V", "500 to 1,000", "60 at 640x480", "at vertices, no highlight"),
    ("OpenGlory", "XCKU040, 175 MHz", "Quake", "about 15", "none"),
)
"""Figures of other designs as their authors publish them, see theory/references.md#other-hardware."""


def main(arguments: Sequence[str]) -> int:
    """Write the tables, or check them."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args(arguments).check
    entries = json.loads(FIGURES.read_text(encoding="utf-8"))
    tables = {"board-known": _known, "board-parts": _parts, "board-frames": _frames, "board-others": _others}
    text = PAGE.read_text(encoding="utf-8")
    made = _TABLE.sub(lambda m: "".join((m[1], "\n".join(tables[m[2]](entries)), "\n", m[3])), text)
    if check:
        return int(made != text)
    PAGE.write_text(made, encoding="utf-8")
    return 0


def _rows(head: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> Iterator[str]:
    """A table in Markdown. The first columns are aligned left, the others right."""
    yield f"| {' | '.join(head)} |"
    yield f"| {' | '.join('---' if k < left else '---:' for k in range(len(head)))} |"
    yield from (f"| {' | '.join(row)} |" for row in rows)


def _named(entry: str) -> tuple[str, str]:
    """Board, and number of triangles as text, from the name of an entry."""
    board, _, triangles = entry.split(", ")
    return board, triangles.removesuffix(" triangles")


def _known(entries: dict) -> Iterator[str]:
    """Table of what is known of each board's bitstream."""
    return _rows(["board", "bitstream"], [[name, board.known] for name, board in BOARDS.items()], left=2)


def _parts(entries: dict) -> Iterator[str]:
    """Table of parts and clocks of the bitstreams."""
    built = {_named(entry)[0]: values["built"] for entry, values in entries.items() if "built" in values}
    if not built:
        return iter(["(no bitstream is recorded)"])
    names = {"sync": "drawing clock", "serial": "serial clock", "pixel": "pixel clock"}
    rows = [
        [part, *(f"{used:,} of {most:,}" for used, most in (each["parts"][part] for each in built.values()))]
        for part in next(iter(built.values()))["parts"]
    ]
    rows += [
        [told, *(f"{clock['reached']:.1f} MHz, needed {clock['needed']:.1f}" for clock in clocks)]
        for name, told in names.items()
        for clocks in [[each["clocks"][name] for each in built.values()]]
    ]
    rows.append(["bitstream, bytes", *(f"{each['bytes']:,}" for each in built.values())])
    rows.append(["number of the placement", *(f"{each['seed']}" for each in built.values())])
    return _rows(["", *built], rows)


def _simulated(entries: dict) -> Iterator[tuple[str, str, dict, float]]:
    """For each simulation: board, triangles, figures, and the cycles that 60 Hz leave for a frame."""
    for entry, values in entries.items():
        if "simulated" in values:
            figures = values["simulated"]
            # 800 x 525 pixels at 25.2 MHz.
            yield *_named(entry), figures, figures["clock"] / 25.2 * 800 * 525


def _frames(entries: dict) -> Iterator[str]:
    """Table of cycles and frames a second."""
    rows = [
        [
            *(board, triangles, f"{figures['clock']:.1f} MHz", f"{figures['cycles']:,}"),
            *(f"{figures['cycles'] / most:.0%}".replace("%", " %"), str(figures["late_bands"])),
            f"{1e6 * figures['clock'] / figures['cycles']:.0f}",
        ]
        for board, triangles, figures, most in _simulated(entries)
    ]
    head = [
        "board",
        "triangles",
        "drawing clock",
        "cycles a frame",
        "share of a frame at 60 Hz",
        "late bands",
        "frames a second",
    ]
    return _rows(head, rows)


def _others(entries: dict) -> Iterator[str]:
    """Table of frames a second of this design and of other designs."""
    rows = [
        [
            *("this design", f"{board}, {figures['clock']:.1f} MHz", triangles),
            f"{1e6 * figures['clock'] / figures['cycles']:.0f} at 640x480",
            _LIGHT,
        ]
        for board, triangles, figures, _ in _simulated(entries)
        if board != "icepi-zero"
    ]
    return _rows(["", "device", "triangles", "frames a second", "light"], [*rows, *_OTHERS], left=2)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
