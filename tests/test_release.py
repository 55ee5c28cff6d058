"""``make release`` in a copy of the committed files, with a stand-in for the commands that take hours.

The stand-in answers in place of ``blysk board``, ``pages`` and ``web``, and writes small files where they
write theirs. make, the page of the boards, Sphinx, the source archive, the wheel and the checksums are real.
Left out are the contents of bitstreams, of the units' pages and of the live page. Other tests make them.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from blysk.sim.cli.main import cli

from .test_supply import PROJECT, committed, metadata

VERSION = metadata()["version"]
BOARD = "ulx3s-25f"
PACKAGES = {f"blysk-{VERSION}-py3-none-any.whl", f"blysk-{VERSION}.tar.gz"}
SITE, BITSTREAM = f"blysk-{VERSION}-site.tar.gz", f"blysk-{VERSION}-{BOARD}.bit"
BITS = bytes(range(256)) * 8

_BLYSK = f"""#!{sys.executable}
import json, os, sys
from pathlib import Path

words = sys.argv[1:]
with open("calls", "a") as calls:
    print(json.dumps(words), file=calls)
if " ".join(words).startswith(os.environ.get("FAILING", "nothing")):
    sys.exit("the stand-in fails")
if words[0] == "board":
    output, record = (Path(words[words.index(option) + 1]) for option in ("-o", "--record"))
    if "--simulate" in words:
        from PIL import Image
        Image.new("RGB", (640, 480)).save(output / "frame-0001.png")
        figures = {{"simulated": {{"cycles": 423411, "clock": 52.5, "late_bands": 0}}}}
    else:
        output.write_bytes(bytes(range(256)) * 8)
        figures = json.loads(record.read_text())["teapot, 992 triangles"]
        figures["built"] = {{"bytes": 2048, "parts": {{"PLLs": [1, 2]}}, "clocks": {{}}}}
    record.write_text(json.dumps({{"teapot, 992 triangles": figures}}))
elif words[0] == "pages":
    # The first page names every unit.
    Path(words[1], "README.md").write_text("# Units\\n")
else:
    import shutil
    output, documents = (Path(words[words.index(option) + 1]) for option in ("-o", "--docs"))
    shutil.copytree(documents, output / "docs")
    (output / "index.html").write_text("live")
"""

_DOCUMENTS = """
import os, sys
from pathlib import Path
if os.environ.get("FAILING") == "docs":
    sys.exit("the stand-in fails")
Path("build/docs").mkdir()
Path("build/docs/index.html").write_text(" ".join(sys.argv[1:]))
"""
"""In place of Sphinx, where the documents do not count."""


@pytest.fixture
def project(tmp_path):
    """A copy of the committed files, with an environment whose ``blysk`` is the stand-in.

    An earlier release lies in ``dist``.
    """
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    for package in ("build", "yaml"):
        pytest.importorskip(package, reason=f"{package} is not installed")
    folder = tmp_path / "project"
    for name in committed():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(PROJECT / name, folder / name)
    programs = folder / ".venv" / "bin"
    programs.mkdir(parents=True)
    (programs / "blysk").write_text(_BLYSK)
    (programs / "python").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    for program in programs.iterdir():
        program.chmod(0o755)
    for kind in ("", "-docs", "-web", "-release"):
        (programs.parent / f".installed{kind}").touch()
    (folder / "dist").mkdir()
    (folder / "dist" / "SHA256SUMS").write_text("of an earlier release")
    return folder


def release(project, *variables, failing="nothing"):
    """Run ``make release``. The result has its status and its output."""
    command = ["make", "release", f"BOARDS={BOARD}", "BUILD_OPTIONS=--no-isolation", *variables]
    environment = os.environ | {"FAILING": failing}
    # Of a run of make that began the tests.
    for name in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS"):
        environment.pop(name, None)
    return subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True)


def summed(folder):
    """Names in ``SHA256SUMS``, whose sums are compared with those of the files."""
    lines = [line.split("  ") for line in (folder / "SHA256SUMS").read_text().splitlines()]
    for digest, name in lines:
        assert digest == hashlib.sha256((folder / name).read_bytes()).hexdigest(), name
    return {name for _, name in lines}


@pytest.mark.ci
@pytest.mark.long
def test_release_has_every_file_and_its_sum(project, monkeypatch):
    for package in ("sphinx", "furo", "myst_parser"):
        pytest.importorskip(package, reason=f"{package} is not installed")
    done = release(project)
    assert done.returncode == 0, done.stderr
    dist = project / "dist"
    assert {path.name for path in dist.iterdir()} == {*PACKAGES, SITE, BITSTREAM, "SHA256SUMS"}
    assert summed(dist) == {*PACKAGES, SITE, BITSTREAM}
    assert (dist / BITSTREAM).read_bytes() == BITS
    with tarfile.open(dist / SITE) as files:
        names = files.getnames()
        page = files.extractfile("site/docs/latest/boards/index.html").read().decode()
    assert {"site/index.html", f"site/docs/{VERSION}/guide/board.html"} <= set(names)
    assert BITSTREAM in page
    assert hashlib.sha256(BITS).hexdigest() in page
    # The commands themselves take these words.
    monkeypatch.chdir(project)
    calls = [json.loads(line) for line in Path("calls").read_text().splitlines()]
    assert [name for name, *_ in calls] == ["board", "board", "pages", "web"]
    for name, *words in calls:
        cli.get_command(None, name).make_context(name, words)


@pytest.mark.parametrize(
    "failing",
    [
        f"board {BOARD} --simulate",
        f"board {BOARD} -o",
        *(pytest.param(step, marks=pytest.mark.long) for step in ("pages", "docs", "web")),
    ],
)
def test_a_step_that_fails_leaves_no_release(project, failing):
    """Neither a new release nor an earlier one, which would look new."""
    (project / "docs" / "site" / "make.py").write_text(_DOCUMENTS)
    done = release(project, failing=failing)
    assert done.returncode != 0
    assert "the stand-in fails" in done.stderr
    assert not (project / "dist").exists()


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize("variable", ["BUILD_OPTIONS=--no-option", "SHA256=false"])
def test_a_last_step_that_fails_leaves_no_release(project, variable):
    (project / "docs" / "site" / "make.py").write_text(_DOCUMENTS)
    done = release(project, "BUILD_OPTIONS=--no-isolation --sdist", variable)
    assert re.search(r"\*\*\* .*Makefile:\d+: release\]", done.stderr), done.stderr
    assert not (project / "dist").exists()


@pytest.mark.ci
@pytest.mark.long
def test_release_without_bitstreams(project):
    (project / "docs" / "site" / "make.py").write_text(_DOCUMENTS)
    done = release(project, "BUILD_OPTIONS=--no-isolation --sdist", "BOARDS=")
    assert done.returncode == 0, done.stderr
    assert summed(project / "dist") == {f"blysk-{VERSION}.tar.gz", SITE}
    with tarfile.open(project / "dist" / SITE) as files:
        words = files.extractfile("site/docs/index.html").read().decode()
    assert words == "build/docs --pages build/pages"
