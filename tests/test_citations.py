"""Citations: every page, section and key that code, tests and pages cite exists, and so does every link."""

import ast
import io
import os
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from .sources import statements

PROJECT = Path(__file__).parents[1]
THEORY = PROJECT / "docs" / "theory"

OLD = ("blocks.md", "chord.md", "models.md", "numbers.md", "pipeline.md")
"""Documents that are not in the project and are still cited; `old_citations` lists the places."""

ANCHORS = {
    "models.md": "lighting reflection-models energy-normalised-forms shading-methods image-metrics "
    "worked-example",
    "interpolation.md": "spans dot-product middle-normal bisection adaptive-normaliser quadratic-normals "
    "forward-differences angular-method arccos half-chord recurrence renormaliser true-spans",
    "chord.md": "the-chord differences error-bound where-spans-are-cut local-lights",
    "quotient.md": "frame identities span pixel bound counted",
    "rivals.md": "words six-points duff bishop-and-weimer loisel abbas",
    "bus.md": "streams registers",
    "bounds.md": "bisection middle-normal recurrence gate-of-unit-normals lobe-tables specular-terms",
    "video.md": "vertices bands display tmds",
    "units.md": "specular-unit exact-power highlight-gate intensity pipeline frame-constants lobe",
}
"""Sections that docstrings may cite. They must exist, also if no docstring cites them."""

_PATH = re.compile(r"(?<![\w/])docs/[\w./-]*\.md(?:#[\w-]+)?")
_KEY = re.compile(r"\[([A-Z][A-Za-z]*\d{0,2})\]")
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)[^)]*\)|^\[[^\]]+\]:\s*(\S+)", re.MULTILINE)
_OTHERS = {"build", "dist", "report", "site", "node_modules"}


class Text(NamedTuple):
    """A docstring, a comment, or a page, and the line where it starts."""

    path: Path
    line: int
    text: str

    def __str__(self):
        return f"{self.path.relative_to(PROJECT)}:{self.line}"


def files(suffix: str) -> list[Path]:
    """Files of the project, without generated and hidden files."""
    found = []
    for folder, inner, names in os.walk(PROJECT):
        # An environment in the clone has as many files as a hundred projects.
        at = Path(folder).relative_to(PROJECT).parts
        inner[:] = [
            name
            for name in inner
            if not (name.startswith(".") or name.endswith(".egg-info"))
            and not (not at and name in _OTHERS)
            and (*at, name) != ("docs", "blocks")
        ]
        found += [Path(folder, name) for name in names if name.endswith(suffix) and not name.startswith(".")]
    return sorted(found)


def prose_of(path: Path, source: str, comments: bool = True) -> Iterator[Text]:
    """Docstrings and comments of a Python source, without strings that are values."""
    for node in statements(source):
        if isinstance(node, ast.Expr) and isinstance(getattr(node.value, "value", None), str):
            yield Text(path, node.lineno, node.value.value)
    if comments:
        for token in tokenize.generate_tokens(io.StringIO(source).readline):
            if token.type == tokenize.COMMENT:
                yield Text(path, token.start[0], token.string)


@cache
def texts() -> list[Text]:
    """All texts that may cite: docstrings and comments of the code, and the pages."""
    found = []
    for path in files(".py"):
        source = path.read_text(encoding="utf-8")
        # Tokens take long, and most files have no comment that cites.
        found += prose_of(path, source, re.search(r"#.*(\.md|Source)", source) is not None)
    return found + [Text(path, 1, path.read_text(encoding="utf-8")) for path in files(".md")]


def slug(heading: str) -> str:
    """The anchor that GitHub makes from a heading."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[^\w\- ]", "", plain.strip().lower()).replace(" ", "-")


def without_code(page: str) -> str:
    """A page without its code, because brackets in code are no links."""
    page = re.sub(r"^```.*?^```", "", page, flags=re.DOTALL | re.MULTILINE)
    page = re.sub(r"^ {4}.*$", "", page, flags=re.MULTILINE)
    return re.sub(r"`[^`]*`", "``", page)


@cache
def anchors(path: Path) -> frozenset[str]:
    """Anchors of a page."""
    found: list[str] = []
    page = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for heading in re.findall(r"^#+ +(.*)$", page, re.MULTILINE):
        name = slug(heading)
        same = sum(re.fullmatch(rf"{re.escape(name)}(-\d+)?", other) is not None for other in found)
        found.append(f"{name}-{same}" if same else name)
    return frozenset(found)


@cache
def keys() -> frozenset[str]:
    """Keys that references.md explains."""
    page = (THEORY / "references.md").read_text(encoding="utf-8")
    return frozenset(re.findall(r"^#+ \[(\w+)\]$", page, re.MULTILINE))


def wrong_citations(text: str) -> list[str]:
    """Pages and sections that a text names and that do not exist."""
    wrong = []
    for name in _PATH.findall(text):
        page, _, anchor = name.partition("#")
        path = PROJECT / page
        if not path.is_file() or (anchor and anchor not in anchors(path)):
            wrong.append(name)
    return wrong


def sources(text: str) -> list[str]:
    """The ``Source:`` paragraphs of a text."""
    return re.findall(r"^\s*#?\s*Source[\w ]*:.*?(?=\n\s*\n|\Z)", text, re.DOTALL | re.MULTILINE)


def wrong_keys(text: str) -> list[str]:
    """Keys that the sources of a text cite and that references.md does not explain."""
    return [key for source in sources(text) for key in _KEY.findall(source) if key not in keys()]


def wrong_links(path: Path, page: str) -> list[str]:
    """Relative links of a page that lead nowhere."""
    wrong = []
    for match in _LINK.findall(without_code(page)):
        target = match[0] or match[1]
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        other = (path.parent / name).resolve() if name else path
        if not other.exists() or (anchor and other.suffix == ".md" and anchor not in anchors(other)):
            wrong.append(target)
    return wrong


def undefined_keys(page: str) -> list[str]:
    """Keys in brackets on a page that have no link at its end."""
    plain = without_code(page)
    defined = set(re.findall(r"^\[(\w+)\]:", plain, re.MULTILINE))
    used = {key for key in re.findall(r"\[(\w+)\](?![(:\]\[])", plain) if key in keys()}
    return sorted(used - defined)


def old_citations() -> list[str]:
    """Places that still cite a document of `OLD`, one in each line."""
    name = re.compile(rf"(?<![\w/])(?:{'|'.join(re.escape(old) for old in OLD)})\b(?!#)")
    found = []
    for text in texts():
        if text.path.is_relative_to(PROJECT / "docs"):
            continue
        for number, line in enumerate(text.text.splitlines()):
            if name.search(line):
                place = f"{text.path.relative_to(PROJECT)}:{text.line + number}"
                found.append(f"{place}: {line.strip()}")
    return found


def every_wrong_name() -> dict[str, list[str]]:
    """Wrong names, with the text that has them."""
    found: dict[str, list[str]] = {}
    for text in texts():
        wrong = wrong_citations(text.text) + wrong_keys(text.text)
        if text.path.suffix == ".md":
            wrong += wrong_links(text.path, text.text)
        if wrong:
            found[str(text)] = wrong
    return found


def test_citations_and_links_lead_somewhere():
    assert every_wrong_name() == {}


def test_no_citation_is_old():
    assert old_citations() == []


@pytest.mark.parametrize("page", ANCHORS)
def test_pages_have_their_sections(page):
    assert set(ANCHORS[page].split()) <= anchors(THEORY / page)


@pytest.mark.parametrize("page", sorted(path.name for path in THEORY.glob("*.md")))
def test_keys_of_a_page_are_links(page):
    text = (THEORY / page).read_text(encoding="utf-8")
    assert page == "references.md" or undefined_keys(text) == []


def test_the_index_has_every_page():
    index = (THEORY / "README.md").read_text(encoding="utf-8")
    pages = {path.name for path in THEORY.glob("*.md")} - {"README.md"}
    assert {page for page in pages if f"({page})" not in index} == set()


def test_there_is_something_to_check():
    """Source lines are found with their keys, and citations are found in docstrings and in comments."""
    found = [source for text in texts() if text.path.suffix == ".py" for source in sources(text.text)]
    assert len(found) > 50
    assert {"T", "C", "B"} <= {key for source in found for key in _KEY.findall(source)}
    assert any(_PATH.search(text.text) for text in texts())


@pytest.mark.parametrize(
    ("heading", "anchor"),
    [
        ("Reflection models", "reflection-models"),
        ("[T]", "t"),
        ("[T]: speed in software", "t-speed-in-software"),
        ("Energy-normalised forms", "energy-normalised-forms"),
        ("The `linear` method, [in short](x.md)", "the-linear-method-in-short"),
    ],
)
def test_anchors_are_those_of_github(heading, anchor):
    assert slug(heading) == anchor


def test_a_second_heading_of_the_same_name_is_numbered(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# One\n## One\n```\n# no heading\n```\n## Two\n## One\n", encoding="utf-8")
    assert anchors(page) == {"one", "one-1", "one-2", "two"}


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("Source: docs/theory/models.md#lighting; [T] 6.", []),
        ("Source: docs/theory/models.md#nowhere; [T] 6.", ["docs/theory/models.md#nowhere"]),
        ("see docs/theory/nothing.md.", ["docs/theory/nothing.md"]),
        ("Source: [T] 2.1, [Nobody99];\n    [Lyon93].\n\n[Unread]", ["Nobody99"]),
        ("# Source: [X] 1", ["X"]),
        ("a list[Task] in [T]", []),
    ],
)
def test_wrong_names_are_found(text, wrong):
    assert wrong_citations(text) + wrong_keys(text) == wrong


@pytest.mark.parametrize(
    ("page", "wrong"),
    [
        ("[a](models.md) [b](models.md#lighting) ![c](figures/linear-error.svg) [d](#own)\n# Own", []),
        ("[a](nothing.md)", ["nothing.md"]),
        ("[a](models.md#nowhere)", ["models.md#nowhere"]),
        ("[T]\n\n[T]: references.md#tt", ["references.md#tt"]),
        ("`[a](nothing.md)`, https://example.org, [a](https://example.org)\n\n    [a](nothing.md)", []),
    ],
)
def test_wrong_links_are_found(page, wrong, tmp_path):
    for name in ("models.md", "references.md"):
        (tmp_path / name).write_text((THEORY / name).read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "linear-error.svg").touch()
    path = tmp_path / "page.md"
    path.write_text(page, encoding="utf-8")
    assert wrong_links(path, page) == wrong


def test_prose_is_docstrings_and_comments():
    source = '"""One."""\nx = "two"  # three\n"""Four."""\ndef f():\n    "five"\n    return "six"\n'
    found = {text.text for text in prose_of(PROJECT / "x.py", source)}
    assert found == {"One.", "# three", "Four.", "five"}


@pytest.mark.ci
@pytest.mark.long
def test_numbers_of_the_theory_pages_come_out():
    """Tables of the pages, and numbers in their sentences, are those that the code computes now."""
    command = [sys.executable, str(THEORY / "figures" / "make.py"), "--check"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
