"""A live page in a browser."""

import pytest

from blysk.bench.store import results_of
from blysk.bench.web import web

from .live_page import DESIGNS, VIEWS, WIDTHS


@pytest.fixture(scope="session")
def live_site(tmp_path_factory):
    """A site of seven modules and five views."""
    folder = tmp_path_factory.mktemp("web") / "site"
    work = web.tasks(DESIGNS, VIEWS)
    web.write_site(folder, work, results_of(work))
    return folder


@pytest.fixture
def open_page(watching, live_site):
    """Open the page and wait for its first frame.

    Afterwards there may be no error, and no request may have left the page.
    """
    folders = []
    with watching() as (new_page, errors, requests):

        def open_page(width="desktop", script=None, waits=True, folder=live_site, **options):
            # Otherwise the light turns.
            page = new_page(WIDTHS[width], 30, **{"reduced_motion": "reduce"} | options)
            if script:
                page.add_init_script(script)
            folders.append(folder.as_uri())
            page.goto((folder / "index.html").as_uri())
            if waits:
                page.wait_for_selector("body[data-frame]")
                page.locator(".further").evaluate("fold => (fold.open = true)")
            return page

        open_page.allowed = "none"
        yield open_page
    assert [text for text in errors if open_page.allowed not in text] == []
    asked = [url for url in requests if not url.startswith("blob:")]
    assert all(url.startswith(tuple(folders)) for url in asked)
