"""Settings of Sphinx for `make.py`, which stages the pages and calls it."""

import inspect
import re
import tomllib
from pathlib import Path

_PROJECT = Path(__file__).resolve().parents[2]
_METADATA = tomllib.loads((_PROJECT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

project = _METADATA["name"]
version = release = _METADATA["version"]
language = "en"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
# Names in single backquotes are Python objects, as in the docstrings.
default_role = "py:obj"

# Pictures with a height, which the first page of the units has.
myst_enable_extensions = ["html_image"]

# Anchors of headings as hosts of Markdown name them.
myst_heading_anchors = 6

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
napoleon_google_docstring = False
maximum_signature_line_length = 88
add_module_names = False

smartquotes = False

html_theme = "furo"
html_title = f"{project} {version}"
html_copy_source = False
html_static_path = ["static"]
html_css_files = ["site.css"]
# The summaries would be fetched, which pages from disk cannot do.
html_show_search_summary = False
html_show_sphinx = False
html_show_copyright = False
html_theme_options = {"top_of_page_buttons": []}
templates_path = ["templates"]
html_sidebars = {
    "**": [
        *("sidebar/brand.html", "sidebar/search.html", "sidebar/scroll-start.html"),
        *("sidebar/navigation.html", "versions.html", "sidebar/scroll-end.html"),
    ]
}

_PAGE = re.compile(r"\bdocs/((?:guide|theory)/[\w-]+)\.md(#[\w-]+)?")


def _fewer_defaults(app, what, name, of, options, signature, returned):
    """``...`` in place of the default that a dataclass makes anew, which is no Python."""
    return signature and signature.replace("<factory>", "..."), returned


def _docstring(app, what, name, of, options, lines) -> None:
    """Docstring of a property as it is, and links in place of the names of pages that docstrings cite."""
    if what == "property":
        # napoleon takes the words before a colon for a type.
        lines[:] = [*inspect.getdoc(of).splitlines(), ""]
    lines[:] = [
        _PAGE.sub(lambda match: f"`{match[0]} <../{match[1]}.html{match[2] or ''}>`__", line)
        for line in lines
    ]


def setup(app) -> None:
    """Add the handlers of docstrings, behind napoleon's, and of signatures."""
    app.connect("autodoc-process-docstring", _docstring, priority=900)
    app.connect("autodoc-process-signature", _fewer_defaults)
