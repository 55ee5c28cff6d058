"""Guide, theory and pages of units on a phone: no line is wider than the window, except inside its own
box."""

from pathlib import Path

import pytest

from blysk.bench.tools.pages import write_pages
from blysk.bench.web import web, web_folder
from blysk.bench.web.documents import documents

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

pytestmark = pytest.mark.long

TOO_WIDE = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"


def test_every_page_fits_a_phone(watching, tmp_path):
    """A page of a unit and a page of a source, too."""
    write_pages(tmp_path / "pages", ["dot_product"], samples=500)
    texts, pictures = documents(web_folder.folders_of(tmp_path / "pages"))
    texts["style.css"] = web._read("report.css") + web._read("web/site.css")
    for name in dict.fromkeys(Path(name).parent for name in [*texts, *pictures]):
        (tmp_path / "site" / name).mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (tmp_path / "site" / name).write_text(text, encoding="utf-8")
    for name, path in pictures.items():
        (tmp_path / "site" / name).write_bytes(path.read_bytes())
    with watching() as (new_page, errors, _):
        page, wide = new_page((390, 844), 30), {}
        for name in texts:
            if name.endswith(".html"):
                page.goto((tmp_path / "site" / name).as_uri())
                wide[name] = page.evaluate(TOO_WIDE)
    assert len(wide) > 25
    assert any(name.startswith("source/") for name in wide)
    assert not {name: by for name, by in wide.items() if by > 0}
    # The index shows a picture of every unit, and here there is one unit.
    assert all("ERR_FILE_NOT_FOUND" in error for error in errors)
