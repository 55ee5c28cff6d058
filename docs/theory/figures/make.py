"""Fill in the tables of the theory pages and draw their figure, from the project's own code.

    python docs/theory/figures/make.py            # write tables and figure
    python docs/theory/figures/make.py --check    # change nothing; fail where a page is not what comes out

A table stands in a page between ``<!-- table: name -->`` and ``<!-- end -->``. Sentences with numbers in them
are not written, they are checked: each module below lists the words of a page with the numbers computed, and
the page has to have them.
"""

import argparse
import importlib
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from blysk.sim.cli.progress import steps

PAGES = Path(__file__).parents[1]
_NUMBER = re.compile(r"(-?[\d,]*\.?\d+)(e[+-]\d+)?(\D*)")
_TABLE = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)

MODULES: dict[str, tuple[str, ...]] = {
    "models_numbers": ("models.md",),
    "interpolation_numbers": ("interpolation.md",),
    "chord_numbers": ("chord.md",),
    "units_numbers": ("units.md",),
    "measured_numbers": ("measured.md",),
    "published_numbers": ("errata.md", "figures.md"),
}
"""Pages of each module of numbers."""


def filled(text: str, tables: dict[str, Callable[[], str]]) -> str:
    """A page with its tables computed anew.

    Parameters
    ----------
    text : str
        The page.
    tables : dict
        What computes a table, by name.

    Raises
    ------
    KeyError
        If the page has a table that nothing computes.
    """
    return _TABLE.sub(lambda m: f"{m[1]}{tables[m[2]]().strip()}\n{m[3]}", text)


def same(one: str, other: str) -> bool:
    """Whether two tables agree, numbers to one unit of the last digit shown.

    Libraries of other versions may round a last digit the other way.
    """
    cells, others = (re.findall(r"[^\s|]+", text) for text in (one, other))
    return len(cells) == len(others) and all(map(_near, cells, others))


def _near(one: str, other: str) -> bool:
    if one == other:
        return True
    parts = [_NUMBER.fullmatch(cell) for cell in (one, other)]
    if not all(parts) or parts[0][3] != parts[1][3]:
        return False
    first, second = (float(part[1].replace(",", "") + (part[2] or "")) for part in parts)
    unit = 10.0 ** (int((parts[0][2] or "e0")[1:]) - len(parts[0][1].partition(".")[2]))
    return abs(first - second) <= 1.001 * unit


def missing(text: str, sentences: list[str]) -> list[str]:
    """Sentences that a page does not have, however its lines are broken."""
    words = " ".join(text.split())
    return [sentence for sentence in sentences if " ".join(sentence.split()) not in words]


def work(module: ModuleType, pages: tuple[str, ...], check: bool) -> list[str]:
    """Fill in or check the pages of a module; what is wrong with them, one line each."""
    wrong = []
    for name in pages:
        path = PAGES / name
        text = path.read_text(encoding="utf-8")
        new = filled(text, module.TABLES)
        if check and not same(new, text):
            wrong.append(f"{name}: a table is not what comes out; run python {Path(__file__).name}")
        elif not check and new != text:
            path.write_text(new, encoding="utf-8")
        wrong += [f"{name}: should say: {sentence}" for sentence in missing(new, module.SENTENCES[name]())]
    for name, draw in getattr(module, "FIGURES", {}).items():
        path = Path(__file__).parent / name
        if not check:
            path.write_text(draw(), encoding="utf-8")
        elif not path.exists():
            wrong.append(f"{name}: missing")
    return wrong


def main() -> int:
    """Work through all pages; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="change nothing, fail where something differs")
    parser.add_argument("pages", nargs="*", help="pages, such as chord.md; all by default")
    chosen = parser.parse_args()
    wrong = []
    with steps() as show:
        for name, pages in MODULES.items():
            if not chosen.pages or set(pages) & set(chosen.pages):
                show(f"computing {', '.join(pages)}")
                wrong += work(importlib.import_module(name), pages, chosen.check)
    for line in wrong:
        print(line, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
