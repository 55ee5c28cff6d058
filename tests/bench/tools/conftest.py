"""Stubs of the tools of place and route, and a live page in a browser."""

import json

import pytest

from blysk.bench.store import results_of
from blysk.bench.tools import fpga, place_and_route, web

from .live_page import DESIGNS, VIEWS, WIDTHS
from .stubs import NEXUS_REPORT, REPORT, netlist


class Calls(list):
    """Tools that were called, each with its last argument; the cells that Yosys finds, all arguments."""

    cells = (("TRELLIS_FF", {}, 3, 4),)
    arguments = ()


@pytest.fixture
def calls(monkeypatch):
    """Stands for the tools: writes what they would, notes what was called."""
    calls = Calls()

    def run(self, name, code, arguments, folder, text="", given_up=None):
        calls.append((name, *arguments[-1:]))
        calls.arguments = arguments
        if name == "Yosys":
            (folder / "netlist.json").write_text(json.dumps(netlist(*calls.cells)))
        else:
            seed = int(arguments[-1])
            report = {
                **REPORT,
                "fmax": {"clk": {"achieved": 100.0 + seed}},
                "utilization": REPORT["utilization"] | NEXUS_REPORT["utilization"],
            }
            (folder / f"{seed}.json").write_text(json.dumps(report))

    monkeypatch.setattr(place_and_route.ToolRunner, "run", run)
    for module in (fpga, place_and_route):
        monkeypatch.setattr(module, "versions_of", lambda family: {"pyosys": "1", family.package: "2"})
    return calls


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "fpga"


@pytest.fixture(scope="session")
def live_site(tmp_path_factory):
    """A site of three modules and three views."""
    folder = tmp_path_factory.mktemp("web") / "site"
    work = web.tasks(DESIGNS, VIEWS)
    web.write_site(folder, work, results_of(work))
    return folder


@pytest.fixture
def open_page(watching, live_site):
    """Open the page and wait for its first frame; afterwards there was no error, and no request left it."""
    folders = []
    with watching() as (new_page, errors, requests):

        def open_page(width="desktop", script=None, waits=True, folder=live_site, **options):
            # Else the light turns.
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
