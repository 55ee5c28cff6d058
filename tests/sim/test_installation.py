"""Installations that messages and guides recommend: pip itself is asked whether they are possible."""

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from blysk.sim import installation
from blysk.sim.installation import install_extra, install_package

ROOT = Path(__file__).resolve().parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]

# Nothing is fetched and nothing is changed: pip reads the command and the project that it names.
DRY = ["--dry-run", "--no-deps", "--no-index", "--no-build-isolation", "--disable-pip-version-check"]


def tried(command, folder):
    done = subprocess.run([*command, *DRY], capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.ci
@pytest.mark.long
def test_advice_from_a_clone_works_from_any_folder(tmp_path):
    command = shlex.split(install_extra(",".join(EXTRAS)))
    assert command[0] == sys.executable
    status, said = tried(command, tmp_path)
    assert status == 0, said
    assert "Would install blysk" in said
    assert "does not provide the extra" not in said


@pytest.mark.parametrize(
    ("text", "requirement"),
    [
        (None, "blysk[fpga]"),
        ('{"url": "file:///a/b.whl", "archive_info": {}}', "blysk[fpga] @ file:///a/b.whl"),
        (
            '{"url": "https://a.org/b", "vcs_info": {"vcs": "git", "commit_id": "0f1"}}',
            "blysk[fpga] @ git+https://a.org/b@0f1",
        ),
    ],
    ids=["index", "wheel", "repository"],
)
def test_advice_away_from_a_clone_names_the_origin(monkeypatch, tmp_path, text, requirement):
    class Distribution:
        def read_text(self, name):
            return text

    monkeypatch.setattr(installation, "__file__", str(tmp_path / "blysk" / "sim" / "installation.py"))
    monkeypatch.setattr("importlib.metadata.distribution", lambda name: Distribution())
    assert shlex.split(install_extra("fpga")) == shlex.split(install_package(requirement))
    assert shlex.split(install_package(requirement))[1:] == ["-m", "pip", "install", requirement]


def test_every_extra_that_is_advised_exists():
    asked = set()
    for layer in ("golden", "hdl", "sim", "bench"):
        for path in (ROOT / layer).rglob("*.py"):
            text = path.read_text()
            assert not re.search(r"pip install '?\.?(blysk)?\[", text), path
            asked |= set(re.findall(r"install_extra\(['\"](\w+)['\"]\)", text))
    assert {"fpga", "native", "report"} <= asked <= EXTRAS.keys()


def test_commands_of_the_guides_name_extras_of_the_clone():
    found = set()
    for path in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]:
        text = path.read_text()
        assert "install 'blysk[" not in text, path
        found |= set(re.findall(r"pip install (-e '\.\[[\w,]+\]')", text))
    assert len(found) > 3
    for options in sorted(found):
        assert set(re.findall(r"\w+", options.split("[")[1])) <= EXTRAS.keys()
