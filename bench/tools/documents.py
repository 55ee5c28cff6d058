"""Folders of Markdown as pages of the site: theory, guide and the pages of the units."""

import posixpath
import re
from collections.abc import Mapping
from pathlib import Path

from blysk.bench.report.page import environment

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
    """Anchor of a heading, as hosts of Markdown name it; HTML in the heading is ignored."""
    text = re.sub(r"<[^>]+>|&\w+;", "", heading).strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def documents(folders: Mapping[str, Path]) -> tuple[dict[str, str], dict[str, Path]]:
    """Pages of folders as HTML, and their pictures.

    Links between the folders stay; those that lead out of them become plain text.

    Parameters
    ----------
    folders : mapping of str to Path
        Folders by their names in the site, keys of `DOCUMENTS`.

    Returns
    -------
    pages : dict of str to str
        By file of the site; ``README.md`` is ``index.html``.
    pictures : dict of str to Path
        SVG and PNG files to copy, by file of the site.
    """
    from markdown_it import MarkdownIt

    markdown = MarkdownIt("commonmark").enable("table")
    template = environment().get_template("web/document.html")
    pages: dict[str, str] = {}
    pictures: dict[str, Path] = {}
    for name, folder in folders.items():
        for path in sorted(folder.rglob("*.[sp][vn]g")):
            pictures[f"{name}/{path.relative_to(folder).as_posix()}"] = path
        # Without a page of its own, the first one is that of the folder.
        first = "README" if (folder / "README.md").exists() else min(p.stem for p in folder.glob("*.md"))
        for path in sorted(folder.glob("*.md")):
            text = path.read_text(encoding="utf-8")
            title = re.search(r"^# (.+)$", text, re.MULTILINE)
            body = _LINK.sub(lambda match, name=name: _link(match, name, folders), markdown.render(text))
            body = _HEADING.sub(lambda m: f'<{m[1]} id="{slug(m[2])}">{m[2]}</{m[1]}>', body)
            body = _IMAGE.sub(lambda match, at=(name, folder): _image(match, *at, pictures), body)
            body = body.replace("<img ", '<img loading="lazy" ')
            # The page's rules let no element have a style of its own.
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
    return pages, pictures


def _image(match: re.Match, name: str, folder: Path, pictures: dict[str, Path]) -> str:
    """Reference to a picture; one from outside the folder is added to the folder's pictures."""
    path = (folder / match[1]).resolve()
    if path.is_file() and path.suffix in (".svg", ".png"):
        pictures[f"{name}/{path.name}"] = path
        return f'<img src="{path.name}"'
    return match[0]


def _link(match: re.Match, name: str, folders: Mapping[str, Path]) -> str:
    """A link of a page, changed to the files of the site."""
    address, anchor, others, text = match[1], match[2] or "", match[3], match[4]
    if not address:
        return match[0]
    target = posixpath.normpath(posixpath.join(name, address))
    folder, _, file = target.partition("/")
    if folder not in folders or not file or not (folders[folder] / file).is_file():
        return text
    stem, suffix = posixpath.splitext(file)
    if suffix in (".svg", ".png"):
        return match[0]
    if suffix != ".md":
        return text
    page = posixpath.relpath(f"{folder}/{'index' if stem == 'README' else stem}.html", name)
    return f'<a href="{page}{anchor}"{others}>{text}</a>'
