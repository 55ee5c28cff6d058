import errno
import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from blysk.sim.errors import InputError
from blysk.sim.output import all_or_none, atomic_writer, check_writable, write_json, write_text


@pytest.fixture
def umask():
    """Set the umask of the process, and put it back."""
    before = os.umask(0o022)
    yield os.umask
    os.umask(before)


def test_writes_and_replaces(tmp_path):
    path = tmp_path / "a.txt"
    for text in ("one\n", "zwei ż\n"):
        write_text(path, text)
        assert path.read_bytes() == text.encode()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_permissions_are_those_of_a_new_file(tmp_path, umask, mask, mode):
    umask(mask)
    write_text(tmp_path / "a", "x")
    assert (tmp_path / "a").stat().st_mode & 0o777 == mode


def test_permissions_of_a_replaced_file_stay(tmp_path, umask):
    path = tmp_path / "a"
    path.write_text("old")
    path.chmod(0o640)
    write_text(path, "new")
    assert path.stat().st_mode & 0o777 == 0o640


def test_link_is_followed(tmp_path):
    (tmp_path / "target").write_text("old")
    (tmp_path / "link").symlink_to("target")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "new"


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, SystemExit])
@pytest.mark.parametrize("existing", [True, False])
def test_nothing_is_left_by_a_failure(tmp_path, error, existing):
    path = tmp_path / "a.png"
    if existing:
        path.write_text("old")

    def fail():
        with atomic_writer(path) as temporary:
            assert temporary.parent == tmp_path
            assert temporary.suffix == ".png"
            temporary.write_text("half")
            raise error

    with pytest.raises(error):
        fail()
    assert [item.name for item in tmp_path.iterdir()] == (["a.png"] if existing else [])
    if existing:
        assert path.read_text() == "old"


def test_old_file_is_there_until_the_end(tmp_path):
    path = tmp_path / "a"
    path.write_text("old")
    with atomic_writer(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"


def test_unwritable_paths(tmp_path):
    (tmp_path / "file").write_text("")
    cases = {
        tmp_path / "no" / "a": f"cannot be written, there is no folder {tmp_path}/no; make the folder first",
        tmp_path: "cannot be written, it is a folder; give the name of a file",
        tmp_path / "file" / "a": f"cannot be written, {tmp_path}/file is not a folder; choose another folder",
        tmp_path / ("x" * 300): "cannot be written, the name is too long; choose a shorter name",
    }
    for path, message in cases.items():
        for attempt in (check_writable, lambda path: write_text(path, "")):
            with pytest.raises(InputError) as caught:
                attempt(path)
            assert str(caught.value) == f"{path}: {message}"
    assert [item.name for item in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("denied", ["folder", "file"])
def test_permission_denied(tmp_path, monkeypatch, denied):
    """The answer of the operating system is replaced, because the test may be run by root."""
    path = tmp_path / "a"
    path.write_text("old")
    target = tmp_path if denied == "folder" else path
    monkeypatch.setattr(os, "access", lambda item, mode: Path(item) != target)
    with pytest.raises(InputError) as caught:
        check_writable(path)
    reason = "cannot be written, permission denied; choose a folder that you may write to"
    assert str(caught.value) == f"{path}: {reason}"


def test_check_writes_nothing(tmp_path):
    check_writable(tmp_path / "a")
    check_writable(str(tmp_path / "a"))
    assert not list(tmp_path.iterdir())


def test_full_disk(tmp_path):
    path = tmp_path / "a"
    path.write_text("old")

    def fill():
        with atomic_writer(path) as temporary:
            temporary.write_text("half")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(InputError) as caught:
        fill()
    reason = "cannot be written, the disk is full; free some space or choose another disk"
    assert str(caught.value) == f"{path}: {reason}"
    assert [item.name for item in tmp_path.iterdir()] == ["a"]
    assert path.read_text() == "old"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_device_is_written_directly():
    with pytest.raises(InputError, match="the disk is full"):
        write_text("/dev/full", "x")
    assert Path("/dev/full").is_char_device()


def test_error_about_another_file_is_not_ours(tmp_path):
    with pytest.raises(FileNotFoundError), atomic_writer(tmp_path / "a"):
        (tmp_path / "missing").read_text()
    assert not list(tmp_path.iterdir())


def test_two_writers_at_once(tmp_path):
    path = tmp_path / "a"
    texts = [letter * 100_000 for letter in "abcdefgh"]
    threads = [threading.Thread(target=write_text, args=(path, text)) for text in texts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert path.read_text() in texts
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("existing", [True, False])
def test_all_or_none(tmp_path, existing):
    first, second = tmp_path / "a", tmp_path / "b"
    if existing:
        first.write_text("old")

    def fail():
        with all_or_none():
            write_text(first, "new")
            assert first.exists() == existing
            write_text(second, "new")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"] * existing
    with all_or_none():
        write_text(first, "1")
        write_text(second, "2")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "1", "b": "2"}
    write_text(first, "3")
    assert first.read_text() == "3"


def test_all_or_none_with_a_name_that_was_taken(tmp_path):
    def take():
        with all_or_none():
            write_text(tmp_path / "b", "new")
            (tmp_path / "b").mkdir()

    with pytest.raises(InputError, match="b: cannot be written, "):
        take()
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc")
def test_folder_that_takes_no_files():
    """For the superuser its permissions allow files."""
    with pytest.raises(InputError, match=r"^/proc/a: cannot be written, .*; choose a(nother)? folder"):
        check_writable("/proc/a")


def test_pipe(tmp_path):
    program = "from blysk.sim.output import write_text; write_text('/dev/stdout', 'x\\n')"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=Path(__file__).parents[2]
    )
    assert (done.stdout, done.stderr) == ("x\n", "")


def test_json(tmp_path):
    path = tmp_path / "a.json"
    value = {
        "b": [np.float64(0.5), float("nan"), np.inf],
        "a": (np.int64(3), np.array([1.0, -np.inf]), True, None, "ż"),
    }
    write_json(path, value)
    assert json.loads(path.read_text(), parse_constant=pytest.fail) == {
        "b": [0.5, None, None],
        "a": [3, [1.0, None], True, None, "ż"],
    }
    assert path.read_text().startswith('{\n  "b"')
    with pytest.raises(TypeError):
        write_json(path, {"a": object()})
    assert json.loads(path.read_text())["a"][0] == 3
