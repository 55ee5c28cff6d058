"""The speed of the live page: what is told where it cannot be measured. Figures are no test's matter."""

import sys

from bench import web_speed


def test_needs_a_site(tmp_path, capsys):
    assert web_speed.main([str(tmp_path / "site")]) == 2
    line = capsys.readouterr().err
    assert line == f"web_speed: {tmp_path / 'site'}: is no site; make one with `blysk web -o FOLDER`\n"


def test_needs_a_browser(tmp_path, capsys, monkeypatch):
    (tmp_path / "index.html").write_text("")
    monkeypatch.setattr(web_speed, "find_chromium", lambda: None)
    monkeypatch.setitem(sys.modules, "playwright.sync_api", None)
    assert web_speed.main([str(tmp_path)]) == 2
    assert "playwright is not installed; pip install playwright" in capsys.readouterr().err
