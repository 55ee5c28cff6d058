"""A live page in a browser."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from blysk.bench.store import results_of
from blysk.bench.tools.pages import write_pages
from blysk.bench.web import web

from .live_page import DESIGNS, VIEWS, WIDTHS

SCRIPTS = Path(__file__).parents[3] / "docs" / "site"


@pytest.fixture(scope="session")
def board_page(tmp_path_factory):
    """Folder of `make boards`, for one board, with made-up figures."""
    pytest.importorskip("yaml", reason="pyyaml is not installed")
    folder = tmp_path_factory.mktemp("boards")
    (folder / "ulx3s-25f").mkdir()
    clock = {"name": "sync", "needed": 52.5, "reached": 65.0, "path": "a -> b"}
    built = {"seed": 1, "bytes": 4, "parts": {"PLLs": [1, 2]}, "clocks": {"sync": clock}}
    simulated = {"frames": 1, "clock": 52.5, "cycles": 423411, "late_bands": 0}
    entry = {"ulx3s-25f, teapot, 992 triangles": {"simulated": simulated, "built": built}}
    (folder / "ulx3s-25f" / "figures.json").write_text(json.dumps(entry))
    (folder / "ulx3s-25f" / "blysk-0-ulx3s-25f.bit").write_bytes(b"bits")
    Image.fromarray(np.full((480, 640, 3), 90, np.uint8)).save(folder / "ulx3s-25f" / "frame-0001.png")
    subprocess.run([sys.executable, SCRIPTS / "boards.py", folder, "ulx3s-25f"], check=True)
    return folder


@pytest.fixture(scope="session")
def documents(tmp_path_factory, board_page):
    """Documents of `make docs`, with the page of a unit and the page of a board."""
    for package in ("sphinx", "furo", "myst_parser"):
        pytest.importorskip(package, reason=f"{package} is not installed")
    pages, folder = tmp_path_factory.mktemp("pages"), tmp_path_factory.mktemp("documents") / "docs"
    write_pages(pages, ["dot_product"], samples=500)
    # The first page names every unit.
    row = '| [dot_product](dot_product.md) | <img src="dot_product-structure.svg" alt="" height="90"> |'
    (pages / "README.md").write_text(f"# Units\n\n| unit | structure |\n|---|---|\n{row}\n")
    command = [sys.executable, SCRIPTS / "make.py", folder, "--pages", pages, "--boards", board_page]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return folder


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
