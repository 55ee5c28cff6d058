"""Conversion of the project's docstrings to Markdown."""

import re
from collections.abc import Sequence
from itertools import pairwise

__all__ = [
    "inline",
    "markdown",
    "markdown_table",
]


# Docstrings as Markdown.


def inline(text: str) -> str:
    """A text as Markdown. Literals get backticks, and characters of Markdown's syntax are escaped."""
    parts = re.split(r"(``.+?``|:\w+:`[^`]+`|`[^`]+`)", text)
    for k, part in enumerate(parts):
        if k % 2:
            parts[k] = "`" + re.sub(r"^:\w+:", "", part).strip("`") + "`"
        else:
            # Stars that multiply are escaped. Stars of emphasis stay.
            part = re.sub(r"([<\\])", r"\\\1", part)
            parts[k] = re.sub(r"(?<=\w)\*(?=\w)|(?<=\s)\*(?=\s)", r"\\*", part)
    return "".join(parts)


def _table(lines: Sequence[str]) -> list[str]:
    """A table in Markdown, from a table whose columns are marked by runs of ``=``."""
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
    return markdown_table(titles, rows)


def markdown_table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table in Markdown."""

    def line(row):
        return "| " + " | ".join(inline(cell).replace("|", "\\|") for cell in row) + " |"

    return [line(titles), "|" + " --- |" * len(titles), *map(line, rows)]


_SECTIONS = {"Parameters", "Members", "Attributes", "Raises", "Returns", "Yields"}
"""Sections that are lists of names. Other sections are text."""


def markdown(text: str) -> str:
    """Markdown of a docstring in the project's form.

    Parameters
    ----------
    text : str
        Cleaned docstring. It may have paragraphs, lists, tables with rules of ``=``, and numpydoc sections.
    """
    # A literal may not break into two lines.
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
            kind = inline(kind)
            names = ", ".join(f"`{part.strip()}`" for part in name.split(","))
            body = []
            while k + 1 < len(lines) and (lines[k + 1].startswith("    ") or not lines[k + 1].strip()):
                if not lines[k + 1].strip() and not (k + 2 < len(lines) and lines[k + 2].startswith("    ")):
                    break
                k += 1
                body.append(lines[k].strip())
            entry = f"- {names}" + (f" ({kind})" if kind else "")
            # A list inside the text stays a list.
            parts = re.split(r"\n+- ", "\n".join(body))
            found.append(f"{entry}: {inline(' '.join(parts[0].split()))}" if body else entry)
            found += [f"  - {inline(' '.join(part.split()))}" for part in parts[1:]]
        else:
            if line.startswith("Source:"):
                in_section = False
            found.append(inline(line))
        k += 1
    return "\n".join(found)
