"""The cache of compiled models: entries, damage, and folders that are not used."""

import os
import re
import stat
from pathlib import Path

import numpy as np
import pytest

from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.sim.engines import cache as cache_module
from blysk.sim.engines import cxxrtl, cxxrtl_source
from blysk.sim.engines.simulate import simulate

from .scale import BEATS, Scale, entries, scaled, script, start

pytestmark = [pytest.mark.usefixtures("cache"), pytest.mark.long, pytest.mark.ci]


def _mode(folder):
    return stat.S_IMODE(folder.stat().st_mode)


def test_second_model_comes_from_the_cache(filled, builds):
    cache = filled
    assert len(entries(cache)) == 1
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 0
    for _ in range(2):
        assert scaled(5) == (5 * BEATS).tolist()
        assert builds() == 1
    assert len(entries(cache)) == len(list(cache.iterdir())) == 2
    assert _mode(cache) == 0o700


def test_cached_model_needs_neither_yosys_nor_pysim(filled, monkeypatch):
    def never(*arguments):
        raise AssertionError("the model is in the cache")

    monkeypatch.setattr(cxxrtl_source.AmaranthYosys, "run", never)
    monkeypatch.setattr(cxxrtl, "Interpreted", never)
    assert scaled() == (3 * BEATS).tolist()
    with pytest.raises(AssertionError, match="the model is in the cache"):
        scaled(5)


@pytest.mark.parametrize("what", ["compiler", "script", "rewriting"])
def test_another_compiler_or_script_is_another_entry(filled, builds, monkeypatch, what):
    if what == "compiler":
        monkeypatch.setenv("CXX", f"{os.environ['CXX']} -DOTHER")
    elif what == "rewriting":
        source = cxxrtl.text_of
        monkeypatch.setattr(cxxrtl, "text_of", lambda name: source(name) + "\n")
    else:
        monkeypatch.setattr(cxxrtl, "SCRIPT", cxxrtl.SCRIPT.replace("flatten;", "flatten; opt_expr;"))
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 1
    assert len(entries(filled)) == 2


@pytest.mark.parametrize(
    "damage", ["flip", *(pytest.param(damage, marks=pytest.mark.long) for damage in ("cut", "empty"))]
)
def test_corrupted_entry_is_built_again(filled, builds, damage):
    (entry,) = entries(filled)
    content = bytearray(entry.read_bytes())
    if damage == "flip":
        content[len(content) // 2] ^= 1
    elif damage == "cut":
        del content[-100:]
    else:
        content = b""
    # This is a new file, because the loaded file stays mapped.
    entry.unlink()
    entry.write_bytes(content)
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 1
    (again,) = entries(filled)
    assert again.read_bytes() != content


def test_entry_with_a_true_checksum_that_does_not_load_is_built_again(filled, builds):
    (entry,) = entries(filled)
    key = entry.stem.split("-")[0]
    entry.unlink()
    other = filled / "other"
    other.write_bytes(b"not a library")
    other.rename(filled / f"{key}-{cxxrtl._digest(other)}.model")
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 1
    assert [path.stem.split("-")[0] for path in entries(filled)] == [key]


def test_model_of_another_key_is_not_taken(filled, builds):
    (three,) = entries(filled)
    scaled(5)
    (five,) = set(entries(filled)) - {three}
    key, digest = three.stem.split("-")[0], five.stem.split("-")[1]
    three.unlink()
    (filled / f"{key}-{digest}.model").write_bytes(five.read_bytes())
    assert scaled(3) == (3 * BEATS).tolist()
    assert builds() == 2


def test_cache_that_others_can_write_is_not_used(filled, builds):
    cache = filled
    for mode in (0o770, 0o702):
        cache.chmod(mode)
        (planted,) = entries(cache)
        before = planted.read_bytes()
        built = builds()
        cache_module.private_folder.cache_clear()
        warning = (
            rf"^cache folder {re.escape(str(cache))} can be written by others \(chmod go-w\): compiled models"
        )
        with pytest.warns(RuntimeWarning, match=warning):
            assert scaled() == (3 * BEATS).tolist()
        assert builds() == built + 1
        assert [path.read_bytes() for path in entries(cache)] == [before]


def test_cache_of_another_user_is_not_used(cache, monkeypatch):
    cache.mkdir(mode=0o700)
    owner = cache.stat().st_uid
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)
    with pytest.warns(
        RuntimeWarning, match="belongs to another user: compiled models are kept for this run only"
    ):
        assert scaled() == (3 * BEATS).tolist()
    assert entries(cache) == []


def test_cache_that_cannot_be_made(cache, monkeypatch):
    cache.write_text("a file in the way")
    monkeypatch.setenv("BLYSK_CACHE", str(cache / "folder"))
    with pytest.warns(RuntimeWarning, match=r"cannot be made \(Not a directory\): compiled models are kept"):
        assert scaled() == (3 * BEATS).tolist()


def test_cache_that_cannot_be_written(cache, monkeypatch):
    cache.mkdir(mode=0o500)
    # The superuser may write anywhere, so only the answer can be tested.
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != cache and access(path, mode))
    with pytest.warns(RuntimeWarning, match="cannot be written: compiled models are kept for this run only"):
        assert (scaled(), _mode(cache_module.cache_folder())) == ((3 * BEATS).tolist(), 0o700)
    assert entries(cache) == []


def test_cache_that_fills_up_meanwhile(cache, monkeypatch):
    def full(source, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    component = Scale()
    for _ in range(2):
        assert simulate(component, BEATS, count=4).beats.tolist() == (3 * BEATS).tolist()
    assert entries(cache) == []


def test_relative_paths(monkeypatch, tmp_path):
    script(tmp_path, "compiler", 'exec c++ "$@"')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BLYSK_CACHE", "models")
    monkeypatch.setenv("CXX", "./compiler")
    assert scaled() == (3 * BEATS).tolist()
    assert len(entries(tmp_path / "models")) == 1


def test_default_cache_is_the_users(monkeypatch, tmp_path):
    monkeypatch.delenv("BLYSK_CACHE")
    monkeypatch.setattr(cache_module.platformdirs, "user_cache_path", lambda name: tmp_path / "home" / name)
    assert cache_module.cache_folder() == tmp_path / "home" / "blysk"


def test_two_processes_at_once(builds, cache):
    """Both processes find the cache empty and build. One whole entry is left, and nothing beside it."""
    program = "print(simulate(Triple(), np.arange(5), count=5).beats.tolist())"
    # The hash seeds differ: the netlist, and so the key, must not depend on the order of sets.
    processes = [start(program, PYTHONHASHSEED=seed) for seed in ("1", "2")]
    for process in processes:
        output, errors = process.communicate(timeout=60)
        assert (process.returncode, errors) == (0, "")
        assert output == "[0, 3, 6, 9, 12]\n"
    assert 1 <= builds() <= 2
    keys = {path.name.split("-")[0] for path in cache.iterdir()}
    assert len(keys) == 1
    assert entries(cache) == sorted(cache.iterdir())
    count = builds()
    process = start(program, PYTHONHASHSEED="3")
    assert process.communicate(timeout=60)[0] == "[0, 3, 6, 9, 12]\n"
    assert builds() == count


class Elsewhere:
    """The version of a module whose version is unknown."""


def diffuse(latency, origin):
    """A unit with a latency of this many cycles."""
    run = simulate(DiffuseUnit(latency=latency), np.arange(3), count=3, origin=origin)
    return int(run.cycles[0] - run.input_cycles[0])


@pytest.fixture
def netlists(monkeypatch):
    """Components from which netlists were made."""
    found, netlist_of = [], cxxrtl.netlist_of
    monkeypatch.setattr(cxxrtl, "netlist_of", lambda unit: found.append(unit) or netlist_of(unit))
    return found


def test_an_origin_spares_the_netlist(builds, netlists, cache):
    assert [diffuse(latency, latency) for latency in (4, 4, 5, 4)] == [4, 4, 5, 4]
    assert (builds(), len(netlists)) == (2, 2)
    assert diffuse(4, None) == 4
    assert (builds(), len(netlists)) == (2, 3)
    # Another origin of the same netlist has its own note, and the same model.
    assert diffuse(4, "another") == 4
    assert (builds(), len(netlists), len(entries(cache))) == (2, 4, 2)


def test_what_an_origin_names_may_be_gone(builds, netlists, cache):
    assert diffuse(4, 4) == 4
    (note,) = entries(cache, ".origin")
    for count, text in enumerate((b"", b"0" * 64, b"\xff"), 2):
        note.write_bytes(text)
        assert [diffuse(4, 4), diffuse(4, 4)] == [4, 4]
        assert (builds(), len(netlists)) == (1, count)
    entries(cache)[0].unlink()
    assert [diffuse(4, 4), diffuse(4, 4)] == [4, 4]
    assert (builds(), len(netlists)) == (2, 5)


def test_what_may_change_unseen_is_no_origin(builds, netlists, cache):
    unseen = Elsewhere, Elsewhere(), [Elsewhere], lambda: 0, diffuse, os.getpid
    for count, origin in enumerate(unseen, 1):
        assert [diffuse(4, origin), diffuse(4, origin)] == [4, 4]
        assert (builds(), len(netlists), entries(cache, ".origin")) == (1, 2 * count, [])


def test_other_code_is_another_origin(builds, netlists, cache, monkeypatch):
    assert diffuse(4, 4) == 4
    monkeypatch.setattr(cxxrtl, "code_version", lambda *libraries: "other")
    assert diffuse(4, 4) == 4
    assert (builds(), len(netlists), len(entries(cache, ".origin"))) == (1, 2, 2)


def test_code_version_tells_libraries_apart(monkeypatch):
    known = cache_module.code_version("numpy")
    assert known == cache_module.code_version("numpy")
    assert known != cache_module.code_version("amaranth")
    assert known == cache_module.code_version.__wrapped__("numpy", "not-installed")
    monkeypatch.setattr(cache_module, "version_of", lambda package: "another")
    assert known != cache_module.code_version.__wrapped__("numpy")


def test_text_of_every_rewriting_module_is_in_the_key():
    """If the text of a rewriting module changes, the model is not taken from the cache."""
    seen, imported = [], re.compile(r"^from blysk\.sim\.engines\.(\w+) import", re.MULTILINE)
    waiting = ["parts", "guards", "words"]
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.append(name)
            waiting += imported.findall(cxxrtl.text_of(f"{name}.py"))
    assert sorted(seen) == sorted(cxxrtl._REWRITING)
