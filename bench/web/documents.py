"""Folders of Markdown as pages of the site: theory, guide and the pages of the units."""

import html
import posixpath
import re
from collections.abc import Mapping
from pathlib import Path

from blysk.bench.report.page import environment
from blysk.bench.tools.pages_folder import PROJECT

__all__ = ["DOCUMENTS", "documents", "slug"]

DOCUMENTS = {
    "guide": ("Guide", "how to use and to embed it, and its words"),
    "theory": ("Theory", "models, methods, error bounds, sources"),
    "blocks": ("Units", "equations, formats, structure, timing and errors of each"),
}
"""Folders that a site may have: title, and contents."""

_LINK = re.compile(r'<a href="([^"#:]*)(#[^"]*)?"([^>]*)>(.*?)</a>', re.DOTALL)
_IMAGE = re.compile(r'<img src="(\.\./[^":]*)"')
_HEADING = re.compile(r"<(h[1-6])>(.*?)</\1>", re.DOTALL)


def slug(heading: str) -> str:
    """Anchor of a heading, as hosts of Markdown name it. HTML in the heading is ignored."""
    text = re.sub(r"<[^>]+>|&\w+;", "", heading).strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def documents(folders: Mapping[str, Path]) -> tuple[dict[str, str], dict[str, Path]]:
    """Pages of folders as HTML, and their pictures.

    Links between the folders stay. Links to Python files of the project stay, too, because each file has a
    page in the folder ``source``. Other links become plain text.

    Parameters
    ----------
    folders : mapping of str to Path
        Folders by their names in the site, keys of `DOCUMENTS`.

    Returns
    -------
    pages : dict of str to str
        Pages by file of the site. ``README.md`` is ``index.html``.
    pictures : dict of str to Path
        SVG and PNG files to copy, by file of the site.
    """
    from markdown_it import MarkdownIt

    markdown = MarkdownIt("commonmark").enable("table")
    template = environment(__package__).get_template("web/document.html")
    pages: dict[str, str] = {}
    sources: dict[str, Path] = {}
    pictures: dict[str, Path] = {}
    for name, folder in folders.items():
        for path in sorted(folder.rglob("*.[sp][vn]g")):
            pictures[f"{name}/{path.relative_to(folder).as_posix()}"] = path
        # In a folder without README.md the first page is also ``index.html``.
        first = "README" if (folder / "README.md").exists() else min(p.stem for p in folder.glob("*.md"))
        for path in sorted(folder.glob("*.md")):
            text = path.read_text(encoding="utf-8")
            title = re.search(r"^# (.+)$", text, re.MULTILINE)
            body = _LINK.sub(
                lambda match, name=name: _link(match, name, folders, sources), markdown.render(text)
            )
            body = _HEADING.sub(lambda m: f'<{m[1]} id="{slug(m[2])}">{m[2]}</{m[1]}>', body)
            body = _IMAGE.sub(lambda match, at=(name, folder): _image(match, *at, pictures), body)
            body = body.replace("<img ", '<img loading="lazy" ')
            # The page's security rules allow no style of a single element.
            body = re.sub(r' style="text-align:(left|center|right)"', r' class="\1"', body)
            body = body.replace("<table>", '<div class="scroll"><table>').replace(
                "</table>", "</table></div>"
            )
            page = template.render(
                title=title[1] if title else path.stem, body=body, folder=DOCUMENTS[name][0]
            )
            pages[f"{name}/{path.stem if path.stem != 'README' else 'index'}.html"] = page
            if path.stem == first != "README":
                pages[f"{name}/index.html"] = page
    for name, path in sources.items():
        text = html.escape(path.read_text(encoding="utf-8"))
        body = f"<h1>{name}</h1>\n<pre><code>{text}</code></pre>"
        pages[_page_of(name)] = template.render(title=name, body=body, folder=None)
    return pages, pictures


def _image(match: re.Match, name: str, folder: Path, pictures: dict[str, Path]) -> str:
    """Reference to a picture. A picture from outside the folder is added to the folder's pictures."""
    path = (folder / match[1]).resolve()
    if path.is_file() and path.suffix in (".svg", ".png"):
        pictures[f"{name}/{path.name}"] = path
        return f'<img src="{path.name}"'
    return match[0]


def _link(match: re.Match, name: str, folders: Mapping[str, Path], sources: dict[str, Path]) -> str:
    """A link of a page, changed to the files of the site. If it leads to a source file, the file is added."""
    address, anchor, others, text = match[1], match[2] or "", match[3], match[4]
    if not address:
        return match[0]
    # A link follows the names in the site, or the present places of the files. Pages of the units may be in
    # any folder.
    folder, _, file = posixpath.normpath(posixpath.join(name, address)).partition("/")
    if folder not in folders or not file or not (folders[folder] / file).is_file():
        target = (folders[name] / address).resolve()
        places = {of: place.resolve() for of, place in folders.items()}
        folder = next((of for of, place in places.items() if target.is_relative_to(place)), "")
        if not folder or not target.is_file():
            return _source(match, name, target, sources)
        file = target.relative_to(places[folder]).as_posix()
    stem, suffix = posixpath.splitext(file)
    if suffix in (".svg", ".png"):
        return match[0]
    if suffix != ".md":
        return text
    page = posixpath.relpath(f"{folder}/{'index' if stem == 'README' else stem}.html", name)
    return f'<a href="{page}{anchor}"{others}>{text}</a>'


def _source(match: re.Match, name: str, target: Path, sources: dict[str, Path]) -> str:
    """A link to the page of a Python file of the project. The file is added.

    For another file the result is the text alone.
    """
    if target.suffix != ".py" or not target.is_file() or not target.is_relative_to(PROJECT):
        return match[4]
    file = target.relative_to(PROJECT).as_posix()
    sources[file] = target
    return f'<a href="{posixpath.relpath(_page_of(file), name)}"{match[3]}>{match[4]}</a>'


def _page_of(file: str) -> str:
    """Page of a source file, by its path in the project."""
    return f"source/{file.replace('/', '.')}.html"
