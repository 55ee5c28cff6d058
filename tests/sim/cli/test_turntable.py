"""Turntables: files, figures, and an interrupt."""

import contextlib
import io
import json
import os
import re
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from blysk.sim.cli.main import main

from .commandline import ERROR_NAMES, PROGRAM, TINY, files, picture, wait

pytestmark = pytest.mark.usefixtures("folder")


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """One turntable with its figures: its folder, and its printed text."""
    folder = tmp_path_factory.mktemp("turned")
    arguments = ["render", *TINY, "--frames", "5", "--jobs", "1", "--method", "linear"]
    with contextlib.redirect_stdout(io.StringIO()) as output:
        assert main([*arguments, "-o", str(folder / "a.gif"), "--json", str(folder / "a.json")]) == 0
    return folder, output.getvalue()


def test_files_of_a_turntable(turned):
    folder, output = turned
    names = [f"a-000{number}.png" for number in range(1, 6)]
    assert sorted(path.name for path in folder.iterdir()) == sorted(["a.gif", "a.json", *names])
    frames = [picture(folder / name) for name in names]
    assert {frame.shape for frame in frames} == {(12, 16, 3)}
    assert len({frame.tobytes() for frame in frames}) == 5
    with Image.open(folder / "a.gif") as animation:
        assert (animation.n_frames, animation.size) == (5, (16, 12))
    for name in ("a-0001.png", "a-0005.png", "a.gif", "a.json"):
        assert str(folder / name) in output


def test_figures_of_a_turntable(turned):
    folder, output = turned
    figures = json.loads((folder / "a.json").read_text())
    frames = figures["frames"]
    assert [Path(frame["picture"]).name for frame in frames] == [
        f"a-000{number}.png" for number in range(1, 6)
    ]
    for name in ("pixels", "visible_pixels", "cycles"):
        assert figures[name] == sum(frame[name] for frame in frames)
        assert f"{figures[name]:,}" in output
    for name in ("arithmetic", "method", "total"):
        errors = [frame[f"{name}_error"] for frame in frames]
        worst = figures[f"{name}_error"]
        for key in ("max_lsb", "p999_lsb", "rmse_lsb"):
            assert worst[key] == max(error[key] for error in errors) > min(error[key] for error in errors)
        assert worst["psnr_db"] == min(error["psnr_db"] for error in errors)
        (row,) = re.findall(rf"^  {name} +([\d. ]+?)   [a-z]", output, re.MULTILINE)
        values = [worst[key] for key in ERROR_NAMES[:4]]
        assert [float(value) for value in row.split()] == pytest.approx(values, abs=0.005)


@pytest.mark.long
def test_a_turntable_of_one_frame_is_the_frame(capsys):
    linear = [*TINY, "--method", "linear"]
    assert main(["render", *linear, "--frames", "1", "--jobs", "1", "-o", "a.gif"]) == 0
    assert main(["render", *linear, "-o", "b.png"]) == 0
    assert capsys.readouterr().err == ""
    assert Path("a-0001.png").read_bytes() == Path("b.png").read_bytes()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a disk that is full")
def test_failed_figures_leave_no_frames(capsys):
    """The figures of a turntable cannot be written. Files of others stay."""
    Path("a-0003.png").write_text("another's")
    options = ["--method", "linear", "--frames", "2", "--jobs", "1", "-o", "a.gif", "--json", "/dev/full"]
    assert main(["render", *TINY, *options]) == 2
    assert capsys.readouterr().err.startswith("blysk: /dev/full: cannot be written, the disk is full; ")
    assert [path.name for path in files()] == ["a-0003.png"]


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("way", ["interrupt", "termination", "kill"])
def test_end_of_a_turntable(way):
    """Finished frames stay whole, and no process goes on.

    Ctrl-C reaches all processes, other signals one process.
    """
    arguments = ["render", "teapot", "--triangles", "100", "--size", "32x24", "--engine", "pysim"]
    process = subprocess.Popen(
        [*PROGRAM, *arguments, "--frames", "200", "--jobs", "2", "-o", "a.gif"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        wait(process, Path("a-0001.png").exists)
        if way == "interrupt":
            os.killpg(process.pid, signal.SIGINT)
        else:
            os.kill(process.pid, signal.SIGKILL if way == "kill" else signal.SIGTERM)
        # This returns when nobody holds the pipes any more: neither the program nor one of its workers.
        output, errors = process.communicate(timeout=60)
        if way == "kill":
            # Python's own tracker of semaphores prints that it cleans up.
            assert (process.returncode, output) == (-signal.SIGKILL, "")
            assert "Traceback" not in errors
        else:
            assert (process.returncode, output, errors) == (130, "", "blysk: interrupted\n")
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    names = sorted(str(path) for path in files())
    assert all(re.fullmatch(r"a-\d{4}\.png", name) for name in names), names
    assert 1 <= len(names) < 200
    for name in names:
        assert picture(name).shape == (24, 32, 3)


@pytest.mark.long
def test_specialised_turntable(folder, capsys):
    options = ["--method", "renormalise", "--specialise", "--size", "32x24", "--frames", "2", "--jobs", "1"]
    assert main(["render", "teapot", *options, "-o", "a.gif"]) == 0
    assert main(["render", "teapot", *[o for o in options if o != "--specialise"], "-o", "b.gif"]) == 0
    for number in (1, 2):
        np.testing.assert_array_equal(picture(f"a-000{number}.png"), picture(f"b-000{number}.png"))
