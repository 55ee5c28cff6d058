"""The speed of the live page: what is told where it cannot be measured. Figures are no test's matter."""

import sys

import pytest

from blysk.bench.speed import web_speed


@pytest.fixture
def site(tmp_path):
    """Files by which a site is known, with nothing in them."""
    (tmp_path / "modules").mkdir()
    for name in ("index.html", "modules/chord-exp.js", "modules/linear-exp.js"):
        (tmp_path / name).write_text("")
    return tmp_path


def test_help(capsys):
    assert web_speed.main(["--help"]) == 0
    assert "[SITE] [MODULE ...]" in capsys.readouterr().out


def test_needs_a_site(tmp_path, capsys):
    assert web_speed.main([str(tmp_path / "site")]) == 2
    line = capsys.readouterr().err
    assert (
        line == f"blysk.bench.speed.web_speed: {tmp_path / 'site'}: is no site; "
        "make one with `blysk web -o FOLDER`\n"
    )


def test_needs_modules_of_the_site(site, capsys):
    assert web_speed.main([str(site), "chord-exp", "chord-exq"]) == 2
    line = capsys.readouterr().err
    reason = f"is no module of {site}; choose from chord-exp, linear-exp"
    assert line == f"blysk.bench.speed.web_speed: chord-exq: {reason}\n"


def test_needs_playwright(site, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "playwright.sync_api", None)
    assert web_speed.main([str(site)]) == 2
    line = capsys.readouterr().err
    assert (
        line == "blysk.bench.speed.web_speed: browser: playwright is not installed; pip install playwright\n"
    )


def test_needs_a_browser(site, capsys, monkeypatch):
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    monkeypatch.setattr(web_speed, "find_chromium", lambda: None)
    assert web_speed.main([str(site)]) == 2
    line = capsys.readouterr().err
    assert line == "blysk.bench.speed.web_speed: browser: there is no Chromium; install one\n"
