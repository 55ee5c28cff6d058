"""A file that a run reads is never written, under whatever name and in whatever order."""

import os

import pytest

from blysk.sim.errors import InputError
from blysk.sim.output import atomic_writer, check_writable, write_text
from blysk.sim.run_files import MARK, OutputIsInput, RunFiles, check_beside, reads, writes


def names(path):
    """Other names of a file."""
    os.link(path, path.with_name("hard"))
    path.with_name("soft").symlink_to(path.name)
    path.with_name("folder").symlink_to(".")
    yield path
    yield from (path.with_name(name) for name in ("hard", "soft"))
    yield path.parent / "folder" / path.name
    yield path.parent / "." / path.name
    yield os.path.relpath(path)


def test_every_name_of_a_file_in_both_orders(tmp_path):
    path = tmp_path / "a.mtl"
    path.write_text("kept")
    for name in names(path):
        with RunFiles().active():
            reads(path)
            for refused in (check_writable, writes, lambda name: write_text(name, "")):
                with pytest.raises(OutputIsInput, match="is a file that this run reads; choose another file"):
                    refused(name)
        with RunFiles().active():
            check_writable(name)
            check_writable(tmp_path / "other")
            with pytest.raises(OutputIsInput) as caught:
                reads(path)
            # The error names the output, whatever file was read.
            assert caught.value.thing == str(name)
    assert path.read_text() == "kept"


def test_a_file_that_is_read_while_it_is_written(tmp_path):
    """The old file stays."""
    path = tmp_path / "a"
    path.write_text("kept")
    with pytest.raises(OutputIsInput), RunFiles().active(), atomic_writer(path):
        reads(path)
    assert path.read_text() == "kept"


def test_other_files_and_other_runs(tmp_path):
    path = tmp_path / "a"
    path.write_text("old")
    with RunFiles().active() as run:
        reads(path)
        write_text(tmp_path / "b", "new")
        assert RunFiles.current() is run
        reads("/dev/null")
        check_writable("/dev/null")
    with RunFiles().active():
        write_text(path, "new")
    reads(path)
    write_text(path, "newer")
    assert path.read_text() == "newer"


def test_files_beside(tmp_path):
    ours, others = tmp_path / "ours", tmp_path / "others"
    ours.write_text(f"/* {MARK} */")
    check_beside([ours, tmp_path / "none"])
    others.write_text("# Mine")
    with pytest.raises(InputError, match="others: would be replaced, and blysk did not write it; move it"):
        check_beside([ours, others])
    with pytest.raises(InputError, match=r"cannot be read \(Is a directory\)"):
        check_beside([tmp_path])
