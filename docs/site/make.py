"""Build the documents as a site: guide, theory and Python interface, with search and versions.

python docs/site/make.py build/docs
python docs/site/make.py build/docs --pages build/pages --boards build/boards

The site opens from disk. Sphinx makes it, and a warning of Sphinx is an error. Each version has a folder.
``latest`` is a copy of the version that was made last. Folders of other versions stay.
"""

import argparse
import inspect
import json
import posixpath
import re
import shutil
import sys
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import blysk

HERE = Path(__file__).resolve().parent
DOCS, PROJECT = HERE.parent, HERE.parents[1]

LATEST = "latest"
"""Folder with a copy of the version that was made last."""

FOLDERS = {
    "guide": "Guide",
    "api": "Python interface",
    "theory": "Theory",
    "blocks": "Units",
    "boards": "Boards",
}
"""Folders of a version, and titles of those without a first page in Markdown."""

_PICTURES = (".png", ".svg")
_LINK = re.compile(r"(\]\(|^\[[^\]]+\]:\s*)([^)\s#]+)", re.MULTILINE)

_FIRST = """\
<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="refresh" content="0; url=latest/index.html">
<title>blysk: documents</title>
</head>
<body>
<ul>
{items}
</ul>
</body>
</html>
"""

_VERSIONS = """\
// Adds the versions of these documents to the list of a page.
{{
  const list = document.getElementById("versions");
  for (const name of {names}) {{
    const link = document.createElement("a");
    link.className = "reference";
    link.href = new URL(`${{name}}/index.html`, document.currentScript.src);
    link.textContent = name;
    list.appendChild(document.createElement("li")).appendChild(link);
  }}
}}
"""

_LIVE = "// `blysk web` writes a link to the live page into this file.\n"


def main(arguments: Sequence[str]) -> int:
    """Build the site. The exit status is 1 if Sphinx warns."""
    parser = argparse.ArgumentParser(description="Build the documents as a site that opens from disk.")
    parser.add_argument("folder", type=Path, help="folder of all versions")
    parser.add_argument("--pages", type=Path, help="pages of the units, which `blysk pages` makes")
    parser.add_argument("--boards", type=Path, help="page of the boards, which docs/site/boards.py makes")
    given = parser.parse_args(arguments)
    folders = {"guide": DOCS / "guide", "theory": DOCS / "theory"}
    for name, folder in (("blocks", given.pages), ("boards", given.boards)):
        if folder is not None:
            if not (folder / "README.md").is_file():
                parser.error(f"{folder}: has no README.md; give the folder of its command")
            folders[name] = folder.resolve()
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    with tempfile.TemporaryDirectory(prefix="blysk-") as temporary:
        source, made = Path(temporary, "source"), Path(temporary, "html")
        for place, content in staged(folders).items():
            (source / place).parent.mkdir(parents=True, exist_ok=True)
            (source / place).write_bytes(content)
        # After the checks of the arguments, which then need no Sphinx.
        from sphinx.cmd.build import main as sphinx

        if sphinx(["-q", "-W", "-c", str(HERE), "-d", f"{temporary}/trees", str(source), str(made)]):
            return 1
        for name in (project["version"], LATEST):
            shutil.rmtree(given.folder / name, ignore_errors=True)
            shutil.copytree(made, given.folder / name, ignore=shutil.ignore_patterns(".*", "_sources"))
    names = versions(given.folder)
    items = "\n".join(f'<li><a href="{name}/index.html">{name}</a></li>' for name in names)
    for name, text in (
        ("index.html", _FIRST.format(items=items)),
        ("versions.js", _VERSIONS.format(names=json.dumps(names))),
        ("live.js", _LIVE),
    ):
        (given.folder / name).write_text(text, encoding="utf-8")
    print(f"{'documents':<12}{given.folder / 'index.html'}")
    return 0


def versions(folder: Path) -> list[str]:
    """Names of the versions in a folder: `LATEST`, then the others, the newest first."""
    names = [path.parent.name for path in folder.glob("*/index.html")]
    numbers = {name: [int(part) for part in re.findall(r"\d+", name)] for name in names}
    return sorted(names, key=lambda name: (name == LATEST, numbers[name]), reverse=True)


# The source of Sphinx.


def staged(folders: Mapping[str, Path]) -> dict[str, bytes]:
    """Files of the source of Sphinx, by place. The links of a page lead to the places.

    Parameters
    ----------
    folders : mapping of str to Path
        Folders of Markdown by their names in the site. ``README.md`` becomes ``index.md``.
    """
    places = {path: path.name for path in DOCS.iterdir() if path.suffix in _PICTURES}
    places[PROJECT / "README.md"] = "index.md"
    for name, folder in folders.items():
        for path in sorted(folder.rglob("*")):
            if path.suffix in (".md", *_PICTURES):
                file = path.relative_to(folder).as_posix()
                places[path] = f"{name}/{'index.md' if file == 'README.md' else file}"
    pictures = {place: path.read_bytes() for path, place in places.items() if path.suffix in _PICTURES}
    sources: dict[str, Path] = {}
    texts = {
        place: _linked(path, place, places, sources) for path, place in places.items() if path.suffix == ".md"
    }
    texts |= {place: _source_page(path) for place, path in sources.items()}
    texts |= interface()
    for name in folders:
        pages = [posixpath.basename(place)[:-3] for place in texts if posixpath.dirname(place) == name]
        if f"{name}/index.md" not in texts:
            texts[f"{name}/index.md"] = f"# {FOLDERS[name]}\n" + _contents(_in_order(pages), "")
        else:
            texts[f"{name}/index.md"] += _contents(sorted(set(pages) - {"index"}))
    texts["index.md"] += _contents([f"{name}/index" for name in FOLDERS if name in {*folders, "api"}])
    return pictures | {place: text.encode() for place, text in texts.items()}


def _in_order(pages: Sequence[str]) -> list[str]:
    """Pages of the guide: in the order in which the README names them, then the others."""
    named = re.findall(r"docs/guide/(\w+)\.md", (PROJECT / "README.md").read_text(encoding="utf-8"))
    table = list(dict.fromkeys(reversed(named)))[::-1]
    return sorted(pages, key=lambda page: (page not in table, table.index(page) if page in table else page))


def _contents(pages: Sequence[str], options: str = ":hidden:\n") -> str:
    """A table of contents in Markdown."""
    return "\n".join(("\n```{toctree}", f"{options}", *pages, "```\n"))


def _linked(path: Path, place: str, places: Mapping[Path, str], sources: dict[str, Path]) -> str:
    """Text of a page, with links to the places of other pages.

    A Python file of the project that the page links to is added to ``sources``, by the place of its page.
    """

    def link(match: re.Match) -> str:
        target = (path.parent / match[2]).resolve()
        to = places.get(target)
        if to is None and target.suffix == ".py" and target.is_file():
            to = f"source/{target.relative_to(PROJECT).as_posix().replace('/', '.')}.md"
            sources[to] = target
        return f"{match[1]}{posixpath.relpath(to, posixpath.dirname(place)) if to else match[2]}"

    return _LINK.sub(link, path.read_text(encoding="utf-8"))


def _source_page(path: Path) -> str:
    """Page of a Python file. The search leaves it out."""
    name = path.relative_to(PROJECT).as_posix()
    text = path.read_text(encoding="utf-8")
    return f"---\norphan: true\nno-search: true\n---\n# {name}\n\n~~~~~python\n{text}~~~~~\n"


# The Python interface.


def page_of(name: str) -> str:
    """Name of the page of a public name. It differs from others also where capitals do not count."""
    of = getattr(blysk, name)
    return f"{_kind(of)}-{name.lower()}"


def _kind(of: object) -> str:
    if isinstance(of, dict):
        return "data"
    if inspect.isclass(of):
        return "exception" if issubclass(of, Exception) else "class"
    return "function"


_LISTS = {
    "METHODS": "Names of the methods, with a line about each.",
    "MODELS": "Names of the reflection models, with a line about each.",
}
"""Descriptions of dictionaries, which have no docstrings."""


def interface() -> dict[str, str]:
    """Pages of the public names of ``blysk``, in reStructuredText, by place."""
    pages = {f"api/{page_of(name)}.rst": _page(name, getattr(blysk, name)) for name in blysk.__all__}
    lines = [FOLDERS["api"], "=" * len(FOLDERS["api"]), "", inspect.getdoc(blysk) or "", ""]
    for kind, title in (
        ("function", "Functions"),
        ("class", "Classes"),
        ("exception", "Errors"),
        ("data", "Lists"),
    ):
        lines += [title, "-" * len(title), ""]
        for name in blysk.__all__:
            of = getattr(blysk, name)
            if _kind(of) == kind:
                text = _LISTS.get(name) or (inspect.getdoc(of) or "").partition("\n\n")[0]
                lines.append(f"- :doc:`{name} <{page_of(name)}>`: {' '.join(text.split())}")
        lines.append("")
    lines += [".. toctree::", "   :hidden:", "", *(f"   {page_of(name)}" for name in blysk.__all__)]
    return pages | {"api/index.rst": "\n".join([*lines, ""])}


def _page(name: str, of: object) -> str:
    """Page of a public name."""
    head = [name, "=" * len(name), "", ".. currentmodule:: blysk", ""]
    if isinstance(of, dict):
        lines = [f".. py:data:: {name}", "   :type: dict[str, str]", "", f"   {_LISTS[name]}", ""]
        lines += [line for key, text in of.items() for line in (f"   ``{key}``", f"      {text}", "")]
    else:
        members = [] if _kind(of) != "class" else ["   :members:", "   :inherited-members: Sequence"]
        lines = [f".. auto{_kind(of)}:: {name}", *members]
    return "\n".join([*head, *lines, ""])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
