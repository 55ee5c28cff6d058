"""The documents in a browser, from disk: every page fits a phone, search and links work."""

import shutil

import pytest

from blysk.bench.web import web

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

pytestmark = pytest.mark.long

TOO_WIDE = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"


def test_every_page_fits_a_phone(watching, documents):
    """No line is wider than the window, except inside its own box. Nothing is loaded from elsewhere."""
    with watching() as (new_page, errors, requests):
        page, wide = new_page((390, 844), 30), {}
        for path in sorted((documents / "latest").rglob("*.html")):
            page.goto(path.as_uri())
            wide[path.relative_to(documents).as_posix()] = page.evaluate(TOO_WIDE)
    assert len(wide) > 50
    assert {name: by for name, by in wide.items() if by > 0} == {}
    assert errors == []
    assert all(url.startswith((documents.as_uri(), "data:")) for url in requests)


def test_search_versions_and_the_live_page(watching, documents, tmp_path):
    site = tmp_path / "site"
    shutil.copytree(documents, site / "docs")
    (site / "docs" / "live.js").write_text(web.LIVE)
    (site / "index.html").write_text("<title>live</title>")
    with watching() as (new_page, errors, _):
        page = new_page((1280, 800), 30)
        page.goto((site / "docs" / "latest" / "search.html").as_uri() + "?q=turntable")
        page.wait_for_selector("ul.search li a[href*='function-turntable']")
        names = page.locator("#versions a").all_text_contents()
        assert names[0] == "latest"
        page.locator("#versions a").nth(1).click()
        assert page.url == (site / "docs" / names[1] / "index.html").as_uri()
        page.locator("#live a").click()
        assert page.title() == "live"
    assert errors == []
