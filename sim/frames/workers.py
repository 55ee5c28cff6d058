"""Executors of independent tasks: processes of this machine, or the workers of a cluster."""

import contextlib
import importlib.util
import logging
import multiprocessing
import multiprocessing.connection
import os
import re
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from blysk.sim.engines.cache import cache_folder
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["check_address", "cluster_client", "cluster_executor", "local_executor", "processors"]

_CONNECT_SECONDS = 10
_START = "start a scheduler with `dask scheduler`, and give its address, as tcp://host:8786"


def processors() -> int:
    """Number of processors that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1


@contextmanager
def local_executor(
    jobs: int, begin: Callable[..., object] | None = None, arguments: tuple[Any, ...] = ()
) -> Iterator[Executor]:
    """Processes on this machine, which share the cache of this process.

    An exception in the block, such as an interrupt, ends the processes at once.

    Parameters
    ----------
    jobs : int
        Number of processes.
    begin : callable, optional
        Called first in each process, with ``arguments``. The arguments are sent once, not with every task.
    arguments : tuple
        Arguments of ``begin``.

    Raises
    ------
    InputError
        If a process dies.
    """
    with warnings.catch_warnings():  # The warning comes where a model is built.
        warnings.simplefilter("ignore", RuntimeWarning)
        cache = str(cache_folder())
    # Other threads run in this process, so processes are not forked.
    context = multiprocessing.get_context("spawn")
    before = set(multiprocessing.active_children())
    executor = _Pool(jobs, context, initializer=_begin, initargs=(cache, begin, arguments))
    try:
        yield executor
        executor.shutdown()
    except BrokenProcessPool:
        reason = "a process died, perhaps because memory ran out"
        raise InputError(f"--jobs {jobs}", reason, "use fewer jobs, or smaller pictures") from None
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()
            child.join()
            # The executor's own thread may have seen the end first, but may not have recorded it yet.
            while child.is_alive():
                time.sleep(0.01)


class _Pool(ProcessPoolExecutor):
    def submit(self, *arguments, **named):
        with _interrupts_blocked():  # The first calls start the processes, which inherit the blocked signal.
            return super().submit(*arguments, **named)


def _end_with_parent() -> None:
    """Wait until the parent process is gone, then end. A parent that gets SIGKILL cannot tell its workers."""
    multiprocessing.connection.wait([multiprocessing.parent_process().sentinel])
    os._exit(1)


def _begin(cache: str, begin: Callable[..., object] | None, arguments: tuple[Any, ...]) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # The parent stops its workers. If it could not block the signal for them, the workers ignore it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ["BLYSK_CACHE"] = cache
    if begin is not None:
        begin(*arguments)


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def check_address(address: str) -> None:
    """Check, before long work, that a text has the form of a scheduler's address, and that Dask is installed.

    Raises
    ------
    InputError
        If the text has another form, or Dask is missing.
    """
    option = f"--cluster {address}"
    # For a text that is no address Dask would leave a half-built client behind.
    if not re.fullmatch(r"((tcp|tls|wss?)://)?([^\s/:@\[\]]+|\[[0-9a-fA-F:.%]+\]):[0-9]{1,5}", address):
        raise InputError(option, "not the address of a Dask scheduler", _START)
    if importlib.util.find_spec("distributed") is None:
        raise InputError(option, "Dask is not installed", install_extra("cluster"))


@contextmanager
def cluster_client(address: str) -> Iterator["Client"]:
    """Dask's client of a scheduler whose workers have this version of blysk.

    Each worker builds its models in its own cache. An exception in the block cancels the waiting tasks; Dask
    cannot stop running tasks. Dask's messages are pickled Python, so use only an address that you trust.

    Parameters
    ----------
    address : str
        Address of the scheduler, ``tcp://host:8786``.

    Raises
    ------
    InputError
        If Dask is not installed, no scheduler answers, or the scheduler has no workers. Also if its workers
        have another version of blysk or are lost.
    """
    option = f"--cluster {address}"
    check_address(address)
    from distributed import Client, KilledWorker
    from distributed.comm import CommClosedError

    with contextlib.ExitStack() as stack:
        stack.enter_context(_quiet_dask())
        try:
            client = stack.enter_context(Client(address, timeout=_CONNECT_SECONDS, set_as_default=False))
        except (OSError, ValueError, TypeError) as error:
            text = str(error).strip().split("\n")[0]
            reason = f"no Dask scheduler answers ({text or type(error).__name__})"
            raise InputError(option, reason, _START) from None
        if not client.nthreads():
            raise InputError(option, "the scheduler has no workers", f"start some: dask worker {address}")
        _check_workers(client, option)
        try:
            yield client
        except (CommClosedError, KilledWorker, CancelledError) as error:
            raise InputError(
                option,
                f"lost its workers ({type(error).__name__})",
                "see their log; smaller pictures take less memory",
            ) from None


@contextmanager
def cluster_executor(address: str) -> Iterator[Executor]:
    """The workers of a Dask scheduler, through Dask's own executor.

    Parameters and errors are those of `cluster_client`.
    """
    with cluster_client(address) as client:
        executor = client.get_executor(pure=False)
        try:
            yield executor
        finally:
            executor.shutdown(wait=False)


@contextmanager
def _quiet_dask() -> Iterator[None]:
    """Keep Dask's log of a lost connection off the terminal. Our own message has one line."""
    # The second logger has a level of its own.
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _check_workers(client: "Client", option: str) -> None:
    here = version("blysk")
    remedy = f"install blysk {here} where they run"
    try:
        versions = set(client.run(version, "blysk").values())
    # A worker without the package may raise any error.
    except Exception as error:
        text = str(error).strip().split("\n")[0]
        raise InputError(option, f"its workers have no blysk ({text})", remedy) from None
    if versions != {here}:
        raise InputError(option, f"its workers have blysk {', '.join(sorted(versions - {here}))}", remedy)
