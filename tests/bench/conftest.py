"""Shared fixtures: a browser, a command that is stopped, and a report of made-up figures."""

import base64
import contextlib
import io
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.figure import Figure
from PIL import Image

from blysk.bench.cli.bench import command
from blysk.bench.report import criteria, frames, geometry, needs, points, stability
from blysk.bench.report.section import Drawing, Section, Table
from blysk.bench.store import Task
from blysk.bench.svg import svg
from blysk.golden.presets import METHODS
from blysk.sim.cli.main import main

DESIGNS = [*points.DESIGNS[:10], ("renormalise", "exp"), ("renormalise", "blinn_product"), points.DESIGNS[-1]]
EXPONENTS = [10, 100]
BROWSER = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
)
"""Options of the browser."""


@pytest.fixture
def refused(capsys, tmp_path, monkeypatch):
    """Run ``blysk`` with bad input in an empty folder: status 2, one line, and no file is left."""

    def refused(*arguments, line):
        monkeypatch.chdir(tmp_path)
        before = sorted(tmp_path.rglob("*"))
        assert main([*arguments]) == 2
        output, errors = capsys.readouterr()
        assert output == ""
        assert errors.startswith(f"blysk: {line}")
        assert errors.count("\n") == 1
        assert sorted(tmp_path.rglob("*")) == before

    return refused


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    names = "chromium", "chromium-browser", "google-chrome"
    chromium = next(filter(None, map(shutil.which, names)), None)
    if chromium is None:
        pytest.skip("no Chromium on this machine")
    with playwright.sync_playwright() as tools:
        browser = tools.chromium.launch(executable_path=chromium, args=list(BROWSER))
        yield browser
        browser.close()


@pytest.fixture
def watching(browser):
    """Open pages without a network. Afterwards no page may have had an error or a request."""

    @contextlib.contextmanager
    def watching():
        contexts, errors, requests = [], [], []

        def new_page(size, seconds, **options):
            context = browser.new_context(
                viewport=dict(zip(("width", "height"), size, strict=True)), **options
            )
            contexts.append(context)
            context.set_offline(True)
            page = context.new_page()
            page.set_default_timeout(1000 * seconds)
            page.on("console", lambda message: errors.append(message.text))
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.on("request", lambda request: requests.append(request.url))
            return page

        yield new_page, errors, requests
        for context in contexts:
            context.close()

    return watching


def session_of(process):
    """Running processes of the session that a process began: their names by number."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            start, _, rest = path.read_text().rpartition(")")
        except OSError:
            continue
        state, _, _, session = rest.split()[:4]
        if int(session) == process.pid and state != "Z":
            found[int(path.parent.name)] = start.partition("(")[2]
    return found


@pytest.fixture
def interrupted(tmp_path):
    """Interrupt a script when a process that it began is called ``sleep``.

    The result has its status and its output.

    Neither a process nor a file of the script may be left.
    """
    if not Path("/proc/self/stat").exists():
        pytest.skip("needs /proc")

    def interrupted(code):
        script = tmp_path / "script.py"
        script.write_text(code)
        process = subprocess.Popen(
            [sys.executable, str(script)],
            start_new_session=True,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            env=os.environ | {"TMPDIR": str(tmp_path)},
        )
        try:
            deadline = time.monotonic() + 60
            while "sleep" not in session_of(process).values():
                assert time.monotonic() < deadline
                assert process.poll() is None, process.stderr.read()
                time.sleep(0.1)
            process.send_signal(signal.SIGINT)
            _, text = process.communicate(timeout=30)
            deadline = time.monotonic() + 10
            while session_of(process):
                assert time.monotonic() < deadline, session_of(process)
                time.sleep(0.1)
        finally:
            for number in session_of(process):
                os.kill(number, signal.SIGKILL)
        assert list(tmp_path.iterdir()) == [script]
        return process.returncode, text

    return interrupted


def picture(value):
    buffer = io.BytesIO()
    Image.fromarray(np.full((12, 16), value, dtype=np.uint8)).save(buffer, "png")
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"


def frame(rng, task, exponent, simulated):
    """The result that `frames` would give, with random figures."""
    settings = task.settings
    errors = {axis["key"]: float(10 ** rng.uniform(-1.5, 2)) for axis in frames.ERRORS}
    if exponent == 10 and settings.get("model") == "exp":
        errors |= {"arithmetic_max_lsb": 0.0, "arithmetic_rmse_lsb": 0.0}
    for key in [key for key in errors if key.endswith("psnr_db")]:
        rmse = errors[key.replace("psnr_db", "rmse_lsb")]
        errors[key] = 20 * math.log10(255 / rmse) if rmse else None
    pixels = int(rng.integers(5000, 9000))
    return {
        "settings": {
            **settings["view"],
            "exponent": exponent,
            **{"ambient": 0.1, "diffuse": 0.4, "specular": 0.5, "light": [0.0, 0.6, 0.8]},
            "method": settings.get("method", settings.get("shading")),
            "model": settings.get("model", "blinn"),
            "engine": "cxxrtl" if simulated else "model",
        },
        "errors": errors,
        "verdicts": {
            kind: errors[f"{kind}_max_lsb"] < 1 for kind in ("total", "method", "arithmetic", "model")
        },
        "border": {"pixels": 12, "lsb": 3.5},
        "pictures": {name: picture(value) for name, value in (("frame", 90), ("error", 20), ("total", 200))},
        "pixels": pixels,
        "shown": pixels - 100,
        "spans": 700,
        "out_of_range_spans": 0,
        "cycles": int(pixels * rng.uniform(1, 3)) if simulated else None,
    }


@pytest.fixture(scope="session")
def points_section():
    """The section of the points, from made-up results."""
    rng = np.random.default_rng(3)
    view = {"source": "teapot", "triangles": 100, "digest": "0" * 64, "width": 160, "height": 120}
    where = {"view": view, "exponents": EXPONENTS}
    tasks, results = [], []
    for k, (method, model) in enumerate(DESIGNS):
        simulated = k % 4 != 3
        settings = {"method": method, "model": model, **where, "simulated": simulated}
        tasks += [Task(frames.frames, settings), Task(frames.speeds, settings, timed=True)]
        tasks.append(Task(frames.hardware, {"method": method, "model": model}))
        results.append([frame(rng, tasks[-3], exponent, simulated) for exponent in EXPONENTS])
        speed = rng.uniform(1e5, 1e7, (2, 2)) if simulated else [[None, 1.5e3]] * 2
        names = ("simulated_pixels_per_second", "golden_ns_per_pixel")
        results.append([dict(zip(names, map_, strict=True)) for map_ in np.asarray(speed).tolist()])
        counts = {"multipliers": int(rng.integers(9, 30)), "cells": 900, "register_bits": 4000}
        results.append({**counts, "memory_bits": 20_000})
    return points.section(tasks, results)


@pytest.fixture(scope="session")
def plain_section():
    """A section with text, a drawing, a table with grades and a long table."""
    figure = Figure(figsize=(5, 2.5))
    figure.subplots().plot([0, 1, 2], [0, 1, 4])
    grades = [["", "good", "fair"], ["", "bad", ""]]
    return Section(
        "plain",
        "A <plain> section",
        ["Some *text* with `code` and a <b>tag</b>."],
        [
            Drawing("squares", "Squares against numbers", svg(figure), "As *published*."),
            Table(
                "graded",
                "Grades",
                ["method", "a, LSB", "b"],
                [("one", 0.25, 3), ("two", None, True)],
                "",
                grades,
            ),
            Table(
                "long",
                "Long & wide",
                ["n", "square", "<text>"],
                [(n, n * n / 7, f"</t{n}>") for n in range(30)],
            ),
        ],
    )


FEW_METHODS = "quotient", "renormalise", "linear"
FEW = {
    points: {
        "DESIGNS": [("quotient", "blinn"), ("renormalise", "cosquad"), ("angular-published", "cosquad")],
        "METHODS": {name: METHODS[name] for name in FEW_METHODS},
        "BEST": ["linear"],
        "QUICK_SIMULATED": [("quotient", "blinn")],
    },
    stability: {"METHODS": {name: METHODS[name] for name in FEW_METHODS}},
    needs: {"QUICK_SCENES": ("teapot in ambient light",)},
    criteria: {
        "METHODS": {name: METHODS[name] for name in FEW_METHODS[:2]},
        "_TRIANGLES": criteria._TRIANGLES[:3],
    },
    geometry: {"_QUICK": geometry._QUICK[:1]},
}
"""The results that the sections of `quick_report` measure. Other tests measure the rest."""


@pytest.fixture(scope="session")
def quick_report(tmp_path_factory):
    """Folder of ``blysk bench --quick`` with all sections and kinds of measurement, for few designs each."""
    folder = tmp_path_factory.mktemp("quick") / "report"
    with pytest.MonkeyPatch.context() as patch:
        for section, values in FEW.items():
            for name, value in values.items():
                patch.setattr(section, name, value)
        result = CliRunner().invoke(command, [str(folder), "--quick"], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return folder
