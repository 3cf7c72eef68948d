"""What integrates the trajectories of a sweep: this process, others or threads, by `concurrent.futures`."""

from __future__ import annotations

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

from ..arguments import require_counts
from ..errors import UsageError

# ranges submitted for each worker: the one being integrated, and those that follow while the driver is busy
RANGES_IN_FLIGHT = 3
# ranges submitted at a time to an executor with an unknown number of workers
EXECUTOR_RANGES = 64


@dataclass(frozen=True)
class ExecutorSpec(AbstractContextManager["ExecutorSpec"]):
    """What integrates the ranges of a sweep; as a context manager, itself.

    Parameters
    ----------
    start : creates the executor; called again after `concurrent.futures.BrokenExecutor`
    capacity : returns how many unfinished ranges the executor may have at the moment; 0 without workers
    shares_memory : whether it runs in this process; otherwise ranges are sent as numbers, names and source
    """

    start: Callable[[], AbstractContextManager[Executor]]
    capacity: Callable[[], int]
    shares_memory: bool = False

    def __exit__(self, *error: object) -> None:
        pass


class _SerialExecutor(Executor):
    """Runs a function during `submit`."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


SERIAL = ExecutorSpec(_SerialExecutor, lambda: 1, shares_memory=True)


def choose_executor(jobs: int = 1, threads: int = 1, executor: Executor | None = None) -> ExecutorSpec:
    """Choose by a number of processes, a number of threads, or an executor of `concurrent.futures`."""
    require_counts(jobs=jobs, threads=threads)
    is_set = {f"jobs = {jobs}": jobs > 1, f"threads = {threads}": threads > 1, "an executor": executor is not None}
    arguments = [argument for argument, is_requested in is_set.items() if is_requested]
    if len(arguments) > 1:
        raise UsageError(f"got {' and '.join(arguments)}, expected one of them")
    if executor is not None:
        shares_memory = isinstance(executor, ThreadPoolExecutor)
        return ExecutorSpec(lambda: nullcontext(executor), lambda: EXECUTOR_RANGES, shares_memory)
    if threads > 1:
        return ExecutorSpec(partial(ThreadPoolExecutor, threads), lambda: RANGES_IN_FLIGHT * threads, True)
    return ExecutorSpec(partial(_process_pool, jobs), lambda: RANGES_IN_FLIGHT * jobs) if jobs > 1 else SERIAL


class _ProcessPool(ProcessPoolExecutor):
    """Processes that receive no SIGINT, which a terminal sends to all: only the driver handles it."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if not hasattr(signal, "pthread_sigmask"):
            return super().submit(fn, *args, **kwargs)
        # a process that is started here inherits the block; this process receives the signal afterwards
        previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            return super().submit(fn, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


@contextlib.contextmanager
def _process_pool(jobs: int) -> Iterator[Executor]:
    # a semaphore counts no further, and Windows waits for at most 63 handles, two of which are not of processes
    most = 61 if sys.platform == "win32" else 2**30
    pool = _ProcessPool(min(jobs, most), multiprocessing.get_context("spawn"), _initialize_worker)
    try:
        yield pool
    except BaseException as error:
        # shutdown would wait for a force law that never returns
        if not isinstance(error, Exception | GeneratorExit):
            for process in list((getattr(pool, "_processes", None) or {}).values()):
                process.kill()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _initialize_worker() -> None:
    """Initialize a worker process: it ignores SIGINT, and ends when the driver ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    driver = multiprocessing.parent_process()
    if driver is not None:

        def exit_with_driver() -> None:
            multiprocessing.connection.wait([driver.sentinel])
            os._exit(1)

        threading.Thread(target=exit_with_driver, daemon=True).start()
