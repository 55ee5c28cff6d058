"""What the paper takes from the pages of docs: tables and references, as texts of Typst."""

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from blysk.sim.errors import InputError

__all__ = ["checkers_of", "cited", "columns", "documents_table", "materials_of", "reference_texts"]


def cited(text: str) -> list[str]:
    """Keys of references that a text of Typst cites by ``#cite("Key", ...)``, sorted, each once."""
    calls = re.findall(r'#cite\(((?:"\w+"(?:,\s*)?)+)\)', text)
    return sorted({key for call in calls for key in re.findall(r'"(\w+)"', call)}, key=str.lower)


def _typst(text: str) -> str:
    """Text of Markdown as Typst: emphasis and code stay, links become their words."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", " ".join(text.split())).replace("\\|", "|")
    parts = re.split(r"(`[^`]*`|\*[^*]+\*|https?://[^\s,]*[^\s,.])", text)
    for k, part in enumerate(parts):
        if k % 2 == 0:
            parts[k] = re.sub(r"([#$@<>\[\]_*=~])", r"\\\1", part)
        elif part[0] == "*":
            parts[k] = "_" + re.sub(r"([#$@<>\[\]_])", r"\\\1", part[1:-1]) + "_"
    return "".join(parts)


def reference_texts(keys: Sequence[str], page: str) -> Iterator[dict[str, str]]:
    """Entries of docs/theory/references.md.

    Parameters
    ----------
    keys : sequence of str
        Keys of the entries.
    page : str
        The page.

    Yields
    ------
    dict of str to str
        ``key``, and ``text`` in Typst.

    Raises
    ------
    InputError
        If the page has no entry of a key.
    """
    entries = dict(re.findall(r"^### \[(\w+)\]\n\n(.*?)(?=\n\n|\Z)", page, re.MULTILINE | re.DOTALL))
    for key in keys:
        if key not in entries:
            raise InputError(f"[{key}]", "docs/theory/references.md has no entry of it", "write the entry")
        yield {"key": key, "text": _typst(entries[key])}


def documents_table(page: str, first: str) -> dict[str, Any]:
    """A table of a page in Markdown, so that its figures stand in one place.

    Parameters
    ----------
    page : str
        The page.
    first : str
        Beginning of the table's first line.

    Returns
    -------
    dict
        ``header`` and ``rows``, lists of texts in Typst.

    Raises
    ------
    InputError
        If the page has no such table.
    """
    _, found, rest = page.partition(f"\n{first}")
    if not found:
        raise InputError(first, "no table of the page begins with this line", "name the table's first line")
    lines = itertools.takewhile(lambda line: line.startswith("|"), (found.strip() + rest).splitlines())
    rows = [[_typst(cell.strip()) for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]
    return {"header": rows[0], "rows": rows[2:]}


def columns(table: Mapping[str, Any], *numbers: int) -> dict[str, Any]:
    """Some columns of a table of `documents_table`, by their numbers from 0 on."""
    rows = [[row[k] for k in numbers] for row in (table["header"], *table["rows"])]
    return {"header": rows[0], "rows": rows[1:]}


def checkers_of(table: Mapping[str, Any]) -> dict[str, float]:
    """Largest errors and bounds of the floors with checkers, from a table of `documents_table`."""
    rows = [row[1:] for row in table["rows"] if row[0].startswith("floor")]
    names = "linear", "linear_bound", "srgb", "srgb_bound"
    return {name: max(map(float, of)) for name, of in zip(names, zip(*rows, strict=True), strict=True)}


def materials_of(page: str) -> list[list[str]]:
    """Rows of the table of measured materials, from docs/theory/measured.md.

    A row has the material, the errors of its table and its frame, the frame's bound, and the mean and the
    largest difference between the lobe and the whole fit.
    """
    errors = documents_table(page, "| material | `quotient`: table |")["rows"]
    left_out = documents_table(page, "| material | mean |")["rows"]
    return [[*a[:4], b[1], b[3]] for a, b in zip(errors, left_out, strict=True)]
