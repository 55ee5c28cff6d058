"""Malformed meshes and scenes, and bad values of every option: one line, and no files left."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="forks, and looks into /proc")

MEMORY = 1 << 30
TOO_LONG = (-signal.SIGALRM, -signal.SIGXCPU, -signal.SIGKILL)


def attempts(folder, seed, files, every):
    """Outcomes of the good files, of some malformed files, and of every so-many-th bad option."""
    program = Path(__file__).with_name("trial.py")
    numbers = [str(number) for number in (seed, files, every)]
    done = subprocess.run(
        [sys.executable, str(program), str(folder), *numbers],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


def fault(row):
    """The fault of an outcome, or ``None``."""
    if row["status"] == 0:
        if row["must_fail"]:
            return "it is accepted"
        if row["says"]:
            return "it is drawn, with words on standard error"
        if len(row["changed"]) != 1 or not row["changed"][0].endswith("-blysk.png"):
            return "it is drawn into something else than one picture"
    elif row["status"] == 2:
        if not re.fullmatch(r"blysk: [^\n]+; [^\n]+\n", row["says"]) or not row["says"][:-1].isprintable():
            return "it says something else than one line of reason and remedy"
        if len(row["says"]) > 2500:
            return "the line is too long"
        if any(text in row["says"] for text in ("MemoryError", "out of memory", "allocate")):
            return "it ran out of memory"
        if row["prints"]:
            return "it is refused, with words on standard output"
        if row["changed"]:
            return "something is left behind"
    else:
        return "it takes too long" if row["status"] in TOO_LONG else "it is neither drawn nor refused"
    return None if row["memory"] < MEMORY else "it takes too much memory"


def check(rows):
    faults = [{"fault": fault(row), **row} for row in rows if fault(row)]
    assert not faults, f"{len(faults)} of {len(rows)}: {json.dumps(faults[:5], indent=1)}"
    # Some input is refused, and some is drawn.
    assert {row["status"] for row in rows if not row["must_fail"]} == {0, 2}
    assert all(row["status"] == 0 for row in rows if row["name"].startswith("good "))


@pytest.mark.long
@pytest.mark.parametrize(
    ("files", "every", "least"), [pytest.param(120, 4, 350, marks=pytest.mark.ci), (20, 1, 900)]
)
def test_much_malformed_input(tmp_path, files, every, least):
    """CI has the files and every fourth bad option. The long run has every option."""
    rows = attempts(tmp_path, seed=2026, files=files, every=every)
    assert len(rows) > least
    check(rows)


ROW = {"status": 2, "must_fail": True, "says": "blysk: a: b; c\n", "prints": 0, "changed": [], "memory": 0}


@pytest.mark.parametrize(
    "change",
    [
        {"status": 0},
        {"status": 0, "must_fail": False, "says": "", "changed": []},
        {"status": 0, "must_fail": False, "says": "", "changed": ["a-blysk.png", "b"]},
        {"status": 0, "must_fail": False, "says": "oh\n", "changed": ["a-blysk.png"]},
        {"status": 1},
        {"status": 99, "says": "Traceback\n"},
        {"status": -signal.SIGALRM},
        {"status": -signal.SIGXCPU},
        {"says": ""},
        {"says": "blysk: a: b; c\nd\n"},
        {"says": "blysk: a\x1b: b; c\n"},
        {"says": "blysk: a: b; " + 3000 * "c" + "\n"},
        {"says": "blysk: a: cannot be read (MemoryError); c\n"},
        {"says": "blysk: out of memory; use a smaller --size or mesh\n"},
        {"prints": 1},
        {"changed": ["a"]},
        {"memory": MEMORY},
    ],
    ids=str,
)
def test_faults_are_found(change):
    assert fault(ROW) is None
    assert fault(ROW | change)
