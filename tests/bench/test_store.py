"""Measurements are made once, kept at once, and made again if anything changes."""

import json
import math
import os
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from blysk.bench import store
from blysk.bench.store import Task, results_of
from blysk.sim.frames.workers import local_executor

made = []


def square(number, offset=0):
    if number < 0:
        raise ValueError("number must not be negative")
    made.append(number)
    return {"square": number * number + offset}


def odd():
    return {"pair": (1, 2), "none": math.nan, 7: np.float64(0.1)}


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


@pytest.mark.parametrize("threads", [0, 2])
def test_what_is_asked_for_twice_is_measured_once(tmp_path, threads):
    tasks = [Task(square, {"number": number}) for number in (3, 1, 3, 3)]
    executor = ThreadPoolExecutor(threads) if threads else None
    assert results_of(tasks, executor) == [{"square": 9}, {"square": 1}, {"square": 9}, {"square": 9}]
    assert sorted(made) == [1, 3]
    assert results_of(tasks, executor)[3] == {"square": 9}


def test_what_changes_a_result_changes_its_key(monkeypatch):
    keys = {Task(square, {"number": 1}).key, Task(square, {"number": 2}).key}
    keys |= {Task(square, {"number": 1, "offset": 0}).key, Task(process, {"number": 1}).key}
    monkeypatch.setattr(store, "code_version", lambda *libraries: "other code")
    keys.add(Task(square, {"number": 1}).key)
    monkeypatch.setattr(store, "_bench", lambda file: "other file")
    keys.add(Task(square, {"number": 1}).key)
    assert len(keys) == 6
    assert Task(square, {"number": 1}).key in keys
    assert Task(square, {"number": 1}, timed=True).key in keys


def test_key_depends_on_the_modules_that_are_imported(tmp_path, monkeypatch):
    monkeypatch.setattr("blysk.bench.__path__", [str(tmp_path)])
    texts = {"a": "from blysk.bench.b import x\n", "b": "from blysk.bench import c\n", "c": "", "d": ""}
    for name, text in texts.items():
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
    results_of([task])
    (path,) = entries(tmp_path)
    whole = path.read_text()
    spoilt = ["", "{", "[]", '{"result": null}', '"x"', "[" * 100_000, whole[:-3], whole.replace("49", "48")]
    for text in spoilt:
        path.write_text(text)
        assert results_of([task]) == [{"square": 49}]
    path.unlink()
    path.mkdir()
    assert results_of([task]) == [{"square": 49}]
    path.rmdir()
    assert results_of([task]) == [{"square": 49}]
    assert made == [7] * (len(spoilt) + 3)
    assert json.loads(entries(tmp_path)[0].read_text())["settings"] == {"number": 7}


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_changed_byte_is_measured_again_or_changes_nothing(tmp_path, data):
    task = Task(square, {"number": 7})
    results_of([task])
    (path,) = entries(tmp_path)
    content = bytearray(path.read_bytes())
    content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    assert results_of([task]) == [{"square": 49}]


def test_results_that_are_no_finite_numbers_are_kept():
    task = Task(odd)
    assert results_of([task])[0]["pair"] == (1, 2)
    assert results_of([task]) == [{"pair": [1, 2], "none": None, "7": 0.1}]


def test_what_is_done_beside_a_failure_is_kept(tmp_path):
    """All run at once, so chance decides which is checked first."""
    tasks = [Task(square, {"number": number}) for number in range(20)]
    futures = [Future() for _ in tasks]
    for number, future in enumerate(futures):
        if number == 7:
            future.set_exception(BrokenProcessPool("gone"))
        else:
            future.set_result({"square": number * number})
    waiting = iter(futures)
    executor = SimpleNamespace(submit=lambda run: next(waiting))
    counted = []
    with pytest.raises(BrokenProcessPool):
        results_of(tasks, executor, lambda: counted.append(1))
    assert len(entries(tmp_path)) == len(counted) == 19
    assert results_of(tasks) == [{"square": number * number} for number in range(20)]
    assert made == [7]


def test_a_cache_without_room_for_results(tmp_path):
    (tmp_path / "results").write_text("a file in the way")
    for _ in range(2):
        assert results_of([Task(square, {"number": 3})]) == [{"square": 9}]
    assert made == [3, 3]


def test_two_at_once(tmp_path):
    """Both measure, and each finds only whole entries."""
    tasks = [Task(square, {"number": number}) for number in range(30)]
    with ThreadPoolExecutor(2) as executor:
        first, second = (executor.submit(results_of, tasks) for _ in range(2))
    assert first.result() == second.result() == [{"square": number * number} for number in range(30)]
    assert 30 <= len(made) <= 60
    assert entries(tmp_path) == sorted((tmp_path / "results").iterdir())
    assert len(entries(tmp_path)) == 30


def test_times_are_measured_here_and_the_rest_elsewhere():
    tasks = [Task(process, {"number": 1}), Task(process, {"number": 2}, timed=True)]
    with local_executor(1) as executor:
        (first, there), (second, here) = results_of(tasks, executor)
    assert (first, second, here) == (1, 2, os.getpid())
    assert there != here
