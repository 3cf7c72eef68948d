"""Integrate on the workers of a scheduler of dask.distributed."""

from __future__ import annotations

import contextlib
import logging
import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, InvalidStateError, wait
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from .._version import __version__
from ..errors import ImpactError, StoreError, UnfinishedError, UsageError
from .execute import other_version
from .executors import RANGES_IN_FLIGHT, ExecutorSpec
from .run import ignore, never

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

LOCAL = "local"
ADDRESS_EXPECTED = "the address of a scheduler of dask, such as tcp://host:8786"
# unfinished ranges of all workers together, which bounds the memory of the driver for any number of workers
MAX_RANGES_IN_FLIGHT = 256
# seconds between two requests to the scheduler, and to wait for a connection or a scheduler file
SCHEDULER_POLL_S, CONNECT_TIMEOUT_S = 1.0, 10.0
# seconds without an answer of the scheduler after which no range is submitted and a signal ends the sweep at once
SILENCE_LIMIT_S = 3.0
# seconds that closing a connection may take
CLOSE_TIMEOUT_S = 2.0
# the setting in dask's configuration for how long a connection, and any later answer, may take
TIMEOUT_SETTING = "distributed.comm.timeouts.connect"
# seconds after which a local cluster without workers, which it restarts when they die, is given up
NO_WORKERS_LIMIT_S = 60.0
# an expression that a worker with any version of this package can evaluate
VERSION_EXPRESSION = "__import__('impact').__version__"
# of a local scheduler: a range whose worker died is returned to the driver, which submits it again; and a worker
# that died is restarted whenever that is noticed
LOCAL_SCHEDULER_SETTINGS = {
    "distributed.scheduler.allowed-failures": 0,
    "distributed.deploy.lost-worker-timeout": "1000 days",
}
# run first by local workers: only the driver logs, and handles SIGINT, which a terminal sends to all
WORKER_PRELOAD = "import logging, signal; logging.disable(); signal.signal(signal.SIGINT, signal.SIG_IGN)"


ResultT = TypeVar("ResultT")


@contextlib.contextmanager
def cluster(
    scheduler: str | Path, should_stop: Callable[[], bool] = never, on_note: Callable[[str], None] = ignore
) -> Iterator[ExecutorSpec]:
    """Connect to a scheduler by its address or file, or start a "local" one; `on_note` gets its size."""
    scheduler_name = str(scheduler)
    if find_spec("distributed") is None:
        extra = 'pip install "impact-sweep[distributed]"'
        raise UsageError(
            f"--scheduler {scheduler_name}: expected dask.distributed, which is not installed: {extra}"
        )
    if isinstance(scheduler, str) and scheduler != LOCAL and "://" not in scheduler:
        raise UsageError(f"{scheduler_name}: expected {ADDRESS_EXPECTED}; or {LOCAL}")
    with contextlib.ExitStack() as stack:
        # the sweep reports what happens to the scheduler and its workers
        stack.callback(logging.disable, logging.root.manager.disable)
        logging.disable()
        limit = _answer_timeout()
        local_cluster = _start_local_cluster(stack) if scheduler == LOCAL else None
        try:
            client, info, workers = _run_with_timeout(
                limit, partial(_connect, local_cluster or scheduler, scheduler_name, limit), should_stop
            )
        except TimeoutError:
            raise UsageError(
                f"{scheduler_name}: no answer within {limit:g} s; "
                f"expected {ADDRESS_EXPECTED} (dask: {TIMEOUT_SETTING})"
            ) from None
        stack.callback(_close, client)
        executor = ExecutorSpec(lambda: _open_executor(client, scheduler_name), _capacity(client, scheduler_name))
        count = f"{workers} worker{'' if workers == 1 else 's'}{'' if workers else ', waits for some'}"
        has_dashboard = "dashboard" in info["services"]
        on_note(f"{count}; dashboard: {client.dashboard_link}" if has_dashboard else count)
        yield executor


def _answer_timeout() -> float:
    """Seconds that an answer may take, from dask's configuration."""
    import dask.config
    import distributed  # noqa: F401 (adds its settings to the configuration)
    from dask.utils import parse_timedelta

    return float(parse_timedelta(dask.config.get(TIMEOUT_SETTING)))


def _run_with_timeout(
    limit: float, action: Callable[[], ResultT], should_stop: Callable[[], bool] = never
) -> ResultT:
    """Run an action that may never return in a daemon thread, which is abandoned after `limit` seconds."""
    future: Future[ResultT] = Future()

    def run() -> None:
        try:
            future.set_result(action())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    deadline = time.monotonic() + limit
    while not wait([future], 0.1).done:
        if should_stop():
            raise UnfinishedError("nothing was integrated")
        if time.monotonic() > deadline:
            raise TimeoutError
    return future.result()


def _start_local_cluster(stack: contextlib.ExitStack) -> LocalCluster:
    """Start a temporary scheduler that other machines cannot reach; the stack closes it."""
    import dask.config
    from distributed import LocalCluster

    dask.config.set(LOCAL_SCHEDULER_SETTINGS)
    loopback = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}
    return stack.enter_context(
        LocalCluster(threads_per_worker=1, memory_limit=0, preload=[WORKER_PRELOAD], **loopback)
    )


def _connect(
    scheduler: str | Path | LocalCluster, scheduler_name: str, limit: float
) -> tuple[Client, dict[str, Any], int]:
    """Connect to a scheduler with workers of this version; returns its info and the number of workers as well."""
    from distributed import Client

    target: dict[str, Any] = {"address": scheduler}
    if isinstance(scheduler, Path):
        _wait_for_file(scheduler, scheduler_name)
        target = {"scheduler_file": str(scheduler)}
    try:
        client = Client(**target, set_as_default=False, timeout=min(CONNECT_TIMEOUT_S, limit))
    except (OSError, ValueError, TypeError, ImportError) as error:
        raise UsageError(f"{scheduler_name}: {error}; expected {ADDRESS_EXPECTED}") from None
    try:
        _check_versions(client)
        return client, client.scheduler_info(), len(client.nthreads())
    except BaseException:
        _close(client)
        raise


def _close(client: Client) -> None:
    """Close a client; the connection to a scheduler that does not answer is dropped."""
    try:
        client.close(timeout=CLOSE_TIMEOUT_S)
    except TimeoutError:
        client.loop.add_callback(client.scheduler_comm.abort)
        with contextlib.suppress(TimeoutError):
            client.close(timeout=CLOSE_TIMEOUT_S)


def _wait_for_file(file: Path, scheduler_name: str) -> None:
    """Wait for the file of a scheduler, which may have been started just now."""
    start = time.monotonic()
    while not os.path.isfile(file):
        if time.monotonic() - start > CONNECT_TIMEOUT_S:
            expected = "the file that dask scheduler --scheduler-file makes"
            raise UsageError(
                f"{scheduler_name}: does not exist after {CONNECT_TIMEOUT_S:.0f} s, expected {expected}"
            )
        time.sleep(0.1)


def _check_versions(client: Client) -> None:
    """Refuse a scheduler and workers with another version of this package, or none: all deserialize the ranges."""
    try:
        versions = {"the scheduler": client.run_on_scheduler(eval, VERSION_EXPRESSION)}
    except ImportError as error:
        versions = {"the scheduler": error}
    for location, version in (versions | client.run(eval, VERSION_EXPRESSION, on_error="return")).items():
        if isinstance(version, BaseException):
            raise UsageError(f"{location}: has no impact: {version}; expected impact {__version__}")
        if version != __version__:
            raise UsageError(other_version(location, str(version), __version__))


def _capacity(client: Client, scheduler_name: str) -> Callable[[], int]:
    """Build the function that returns how many unfinished ranges the workers may have: workers join and leave.

    A thread polls the scheduler, which may never answer. All workers of a local cluster must not be gone for long.
    """
    limit = _answer_timeout()
    n_answers = n_seen = n_workers = 0
    silence_s = without_workers_s = 0.0
    last_call = time.monotonic()

    def poll_scheduler() -> None:
        nonlocal n_answers, n_workers
        while client.status not in ("closing", "closed"):
            with contextlib.suppress(OSError, ValueError, CancelledError):
                n_workers = sum(client.nthreads().values())
                n_answers += 1
            time.sleep(SCHEDULER_POLL_S)

    threading.Thread(target=poll_scheduler, daemon=True).start()

    def current_capacity() -> int:
        nonlocal n_seen, silence_s, without_workers_s, last_call
        # time during which this process was suspended does not count
        elapsed = min(time.monotonic() - last_call, SCHEDULER_POLL_S)
        last_call = time.monotonic()
        silence_s = 0.0 if n_answers > n_seen else silence_s + elapsed
        without_workers_s = 0.0 if n_workers or not n_answers else without_workers_s + elapsed
        n_seen = n_answers
        if silence_s > limit:
            raise StoreError(f"{scheduler_name}: the scheduler has not answered for {limit:g} s")
        if scheduler_name == LOCAL and without_workers_s > NO_WORKERS_LIMIT_S:
            raise StoreError(f"{scheduler_name}: all workers were lost")
        return 0 if silence_s > SILENCE_LIMIT_S else min(RANGES_IN_FLIGHT * n_workers, MAX_RANGES_IN_FLIGHT)

    return current_capacity


class _CancellableExecutor(Executor):
    """Wraps an executor of dask so that futures can be cancelled without an answer of the scheduler."""

    def __init__(self, dask_executor: Executor) -> None:
        self._dask_executor = dask_executor

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()

        def copy_outcome(dask_future: Future[Any]) -> None:
            with contextlib.suppress(InvalidStateError):
                if dask_future.cancelled():
                    future.cancel()
                    future.set_running_or_notify_cancel()
                elif error := dask_future.exception():
                    future.set_exception(error)
                else:
                    future.set_result(dask_future.result())

        self._dask_executor.submit(fn, *args, **kwargs).add_done_callback(copy_outcome)
        return future


@contextlib.contextmanager
def _open_executor(client: Client, scheduler_name: str) -> Iterator[Executor]:
    from distributed import KilledWorker
    from distributed.client import ClosedClientError

    dask_executor = client.get_executor(pure=False)
    try:
        yield _CancellableExecutor(dask_executor)
    except KilledWorker as error:
        # all unfinished ranges are submitted again
        with contextlib.suppress(TimeoutError):
            _run_with_timeout(CLOSE_TIMEOUT_S, partial(dask_executor.shutdown, wait=False))
        raise BrokenExecutor from error
    except (CancelledError, ClosedClientError, OSError) as error:
        raise StoreError(f"{scheduler_name}: the connection to the scheduler was lost") from error
    except ImpactError:
        raise
    except Exception:
        # a worker that joined with another version may fail to deserialize a range
        _run_with_timeout(_answer_timeout(), partial(_check_versions, client))
        raise
