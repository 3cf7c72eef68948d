"""Teams: who integrates the blocks of a sweep. All of them take it as an executor of concurrent.futures does."""

from __future__ import annotations

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

from ..errors import UsageError

# blocks that a worker has before it: the one it works at, and those it goes on with while the driver is busy
BLOCKS_IN_FLIGHT = 3
# blocks that are given to an executor of which nothing else is known
SOME = 64


@dataclass(frozen=True)
class Backend:
    """Who integrates.

    Parameters
    ----------
    executor : makes the executor, and again where it was broken (`concurrent.futures.BrokenExecutor`)
    capacity : how many blocks may be given to it before one is finished, at the moment; none if nobody is there
    shares_memory : whether it shares our memory; to others numbers, names and source are sent
    """

    executor: Callable[[], AbstractContextManager[Executor]]
    capacity: Callable[[], int]
    shares_memory: bool = False


class _AtOnce(Executor):
    """An executor that does what it is given before it returns."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


SERIAL = Backend(_AtOnce, lambda: 1, shares_memory=True)


def choose_backend(jobs: int = 1, threads: int = 1, executor: Executor | None = None) -> Backend:
    """The team of some processes, of some threads, or of an executor of any kind.

    Raises
    ------
    UsageError : it is asked for more than one of the three
    """
    asked = {f"jobs = {jobs}": jobs > 1, f"threads = {threads}": threads > 1, "an executor": executor is not None}
    several = [name for name, wanted in asked.items() if wanted]
    if len(several) > 1:
        raise UsageError(f"got {' and '.join(several)}, wants one of them")
    if executor is not None:
        return Backend(lambda: nullcontext(executor), lambda: SOME, isinstance(executor, ThreadPoolExecutor))
    if threads > 1:
        return Backend(lambda: ThreadPoolExecutor(threads), lambda: BLOCKS_IN_FLIGHT * threads, shares_memory=True)
    return Backend(lambda: _processes(jobs), lambda: BLOCKS_IN_FLIGHT * jobs) if jobs > 1 else SERIAL


class _Processes(ProcessPoolExecutor):
    """Processes that get no SIGINT, which a terminal sends to all: it is the driver's, later."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        # it may begin a process
        with _interrupts_held():
            return super().submit(fn, *args, **kwargs)


@contextlib.contextmanager
def _processes(jobs: int) -> Iterator[Executor]:
    pool = _Processes(jobs, multiprocessing.get_context("spawn"), _begin)
    try:
        yield pool
    except BaseException as error:
        # a force that never returns would be waited for
        if not isinstance(error, Exception | GeneratorExit):
            for process in list(getattr(pool, "_processes", None) or {}):
                os.kill(process, signal.SIGKILL)
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold back SIGINT: what begins here never gets it, we do later."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """What a process does first: leave signals to the driver, and end when that does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    driver = multiprocessing.parent_process()
    if driver is not None:

        def follow() -> None:
            multiprocessing.connection.wait([driver.sentinel])
            os._exit(1)

        threading.Thread(target=follow, daemon=True).start()
