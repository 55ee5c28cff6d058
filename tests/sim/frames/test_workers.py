"""Executors of this machine and of a cluster: their work and their end."""

import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from blysk.sim.engines.cache import cache_folder
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import check_address, cluster_executor, local_executor, processors
from blysk.sim.installation import install_extra


def test_processors():
    assert 1 <= processors() <= (os.cpu_count() or 1)


_given = []


def _keep(*values):
    _given.extend(values)


def _told():
    return _given, os.environ["BLYSK_CACHE"], os.getpid()


def test_processes_are_told_once_and_share_the_cache():
    children = set(multiprocessing.active_children())
    with local_executor(1, _keep, (3, "four")) as executor:
        answers = [executor.submit(_told).result() for _ in range(2)]
    assert [answer[0] for answer in answers] == [[3, "four"]] * 2
    assert {answer[1] for answer in answers} == {str(cache_folder())}
    assert os.getpid() not in {answer[2] for answer in answers}
    assert set(multiprocessing.active_children()) == children


KILLED = """
import os, signal, sys
from blysk.hdl.emit.processes import run_program
from blysk.sim.frames.workers import local_executor

if __name__ == "__main__":
    with local_executor(1) as executor:
        print(executor.submit(os.getpid).result(), flush=True)
        executor.submit(run_program, ["sh", "-c", "echo $$ & sleep 300 & echo $!; wait"])
        sys.stdin.read()
"""


def _runs(number):
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_workers_and_their_programs_end_with_a_killed_parent(tmp_path):
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    command = [sys.executable, str(script)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as parent:
        started = [int(parent.stdout.readline()) for _ in range(3)]
        os.kill(parent.pid, signal.SIGKILL)
        # At once, because the programs would end by themselves after 300 s.
        deadline = time.monotonic() + 60
        while any(map(_runs, started)):
            assert time.monotonic() < deadline
            time.sleep(0.02)
        # Reading ends when nobody holds the pipe: neither the worker nor one of its programs.
        assert parent.stdout.read() == b""


def test_an_error_of_the_work_is_passed_on():
    with pytest.raises(ValueError, match="invalid literal"), local_executor(1) as executor:
        executor.submit(int, "x").result()


@pytest.mark.parametrize(
    "address", ["", "foo", "tcp://", "zzz://a:1", "tcp://a", "tcp://a:b", "a b:1", "http://a:1"]
)
def test_no_address(address):
    with pytest.raises(InputError, match="not the address of a Dask scheduler"):
        check_address(address)


def test_without_dask(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name, *rest: None)
    with pytest.raises(InputError, match=re.escape(f"Dask is not installed; {install_extra('cluster')}")):
        check_address("tcp://127.0.0.1:8786")


@pytest.mark.ci
@pytest.mark.long
def test_a_cluster_works():
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0", host="127.0.0.1"
        ) as local,
        cluster_executor(local.scheduler_address) as executor,
    ):
        assert [executor.submit(pow, 2, k).result() for k in range(3)] == [1, 2, 4]
