"""Progress on standard error: bars, lines and steps."""

import re
import time

from blysk.sim.cli import progress


def test_progress_without_a_terminal_is_a_line_now_and_then(capsys, monkeypatch):
    monkeypatch.setattr(progress, "SECONDS", 0.3)
    for _ in progress.progress(range(8), total=8, unit="parts"):
        time.sleep(0.15)
    output, errors = capsys.readouterr()
    assert output == ""
    lines = errors.splitlines()
    assert 1 <= len(lines) <= 6
    assert all(re.match(r" *\d+% \d/8 \[.* parts/s\]$", line) for line in lines)


def test_steps_without_a_terminal_are_lines(capsys):
    with progress.steps() as show:
        show("mapping")
        show("placement 1")
    assert capsys.readouterr() == ("", "blysk: mapping\nblysk: placement 1\n")


def test_progress_of_short_work_says_nothing(capsys):
    with progress.progress(total=2, unit="parts") as bar:
        bar.set_description_str("first")
        bar.update(2)
    assert capsys.readouterr() == ("", "")


def test_late_steps(capsys, monkeypatch):
    """Without a terminal the steps of the first seconds are not shown, and an empty step never is."""
    for seconds, shown in ((3600, ""), (0, "blysk: simulating\n")):
        monkeypatch.setattr(progress, "SECONDS", seconds)
        with progress.steps(late=True) as show:
            show("")
            show("simulating")
        assert capsys.readouterr() == ("", shown)


def test_a_long_step_is_told_again(capsys, monkeypatch):
    """With its own time, until the work ends."""
    monkeypatch.setattr(progress, "TOLD", 0.1)
    with progress.steps() as show:
        time.sleep(0.25)
        show("writing")
        time.sleep(0.25)
    time.sleep(0.2)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "blysk: writing"
    assert 1 <= lines[1:].count("blysk: writing: 0:00 min") == len(lines) - 1 <= 3
    with progress.steps(repeat=False) as show:
        show("mapping")
        time.sleep(0.2)
    assert capsys.readouterr().err == "blysk: mapping\n"


def test_unknown_total(capsys, monkeypatch):
    """The number of pixels is known only when the simulation runs."""
    monkeypatch.setattr(progress, "SECONDS", 0)
    with progress.progress(total=None, unit="pixels", scaled=True) as bar:
        bar.total = 4_000
        time.sleep(0.15)
        bar.update(2_000)
    output, errors = capsys.readouterr()
    assert output == ""
    assert re.search(r"50% 2.00k/4.00k \[.* pixels/s\]\n", errors), errors
