"""Measurements are made once, kept as soon as they are there, and made again when anything changes."""

import json
import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from bench import store
from bench.store import Task, results_of
from sim.workers import local_executor

made = []


def square(number, offset=0):
    if number < 0:
        raise ValueError("number must not be negative")
    made.append(number)
    return {"square": number * number + offset}


def process(number):
    return [number, os.getpid()]


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path))
    made.clear()


def entries(tmp_path):
    return sorted((tmp_path / "results").glob("*.json"))


@pytest.mark.parametrize("threads", [0, 2])
def test_results_are_in_the_order_of_the_tasks_and_kept(tmp_path, threads):
    tasks = [Task(square, {"number": number}) for number in (3, 1, 2)]
    counted = []
    for _ in range(2):
        executor = ThreadPoolExecutor(threads) if threads else None
        found = results_of(tasks, executor, lambda: counted.append(1))
        assert found == [{"square": 9}, {"square": 1}, {"square": 4}]
    assert sorted(made) == [1, 2, 3]
    assert len(counted) == 6
    assert len(entries(tmp_path)) == 3


def test_what_changes_a_result_changes_its_key(monkeypatch):
    keys = {Task(square, {"number": 1}).key, Task(square, {"number": 2}).key}
    keys |= {Task(square, {"number": 1, "offset": 0}).key, Task(process, {"number": 1}).key}
    monkeypatch.setattr(store, "_code", lambda: "other code")
    keys.add(Task(square, {"number": 1}).key)
    monkeypatch.setattr(store, "_bench", lambda file: "other file")
    keys.add(Task(square, {"number": 1}).key)
    assert len(keys) == 6
    assert Task(square, {"number": 1}).key in keys
    assert Task(square, {"number": 1}, timed=True).key in keys


def test_key_depends_on_the_modules_that_are_imported(tmp_path):
    for name, text in (("a", "from .b import x\n"), ("b", "from . import c\n"), ("c", ""), ("d", "")):
        (tmp_path / f"{name}.py").write_text(text)
    digests = set()
    for changed in "xabcd":
        with (tmp_path / f"{changed}.py").open("a") as file:
            file.write("# changed\n")
        store._bench.cache_clear()
        digests.add(store._bench(tmp_path / "a.py"))
    assert len(digests) == 4  # a, b and c count, d does not


def test_a_failure_keeps_what_is_done(tmp_path):
    tasks = [Task(square, {"number": number}) for number in (5, -1, 6)]
    with pytest.raises(ValueError, match="must not be negative"):
        results_of(tasks)
    assert made == [5]
    assert results_of(tasks[:1]) == [{"square": 25}]
    assert made == [5]


def test_a_spoilt_entry_is_measured_again(tmp_path):
    task = Task(square, {"number": 7})
    for text in ("", "{", "[]", '{"result": null}', '"x"'):
        results_of([task])
        (path,) = entries(tmp_path)
        path.write_text(text)
    assert results_of([task]) == [{"square": 49}]
    assert made == [7] * 6
    assert json.loads(entries(tmp_path)[0].read_text())["settings"] == {"number": 7}


def test_times_are_measured_here_and_the_rest_elsewhere():
    tasks = [Task(process, {"number": 1}), Task(process, {"number": 2}, timed=True)]
    with local_executor(1) as executor:
        (first, there), (second, here) = results_of(tasks, executor)
    assert (first, second, here) == (1, 2, os.getpid())
    assert there != here
