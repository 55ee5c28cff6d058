"""The speed of the live page: what is told where it cannot be measured. Figures are no test's matter."""

import sys

import pytest

from blysk.bench.speed import web_speed
from blysk.sim.installation import install_package


@pytest.fixture
def site(tmp_path):
    """Files by which a site is known, with nothing in them."""
    (tmp_path / "modules").mkdir()
    for name in ("index.html", "modules/angular-exp.js", "modules/linear-exp.js"):
        (tmp_path / name).write_text("")
    return tmp_path


def test_help(capsys):
    assert web_speed.main(["--help"]) == 0
    assert "[SITE] [MODULE ...]" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["{0}/site"], "{0}/site: is not a site; make one with `blysk web -o FOLDER`"),
        (
            ["{0}", "angular-exp", "angular-exq"],
            "angular-exq: is not a module of {0}; choose from angular-exp, linear-exp",
        ),
        (["{0}"], f"browser: playwright is not installed; {install_package('playwright')}"),
    ],
    ids=["no site", "no module", "no playwright"],
)
def test_bad_input_is_one_line(arguments, says, site, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "playwright.sync_api", None)
    assert web_speed.main([argument.format(site) for argument in arguments]) == 2
    assert capsys.readouterr().err == f"blysk.bench.speed.web_speed: {says.format(site)}\n"


def test_needs_a_browser(site, capsys, monkeypatch):
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    monkeypatch.setattr(web_speed, "find_chromium", lambda: None)
    assert web_speed.main([str(site)]) == 2
    line = capsys.readouterr().err
    assert line == "blysk.bench.speed.web_speed: browser: there is no Chromium; install one\n"
