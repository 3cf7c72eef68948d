"""A cluster: the workers of a scheduler of dask.distributed as a team, wherever they are."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, InvalidStateError, wait
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from .._version import __version__
from ..errors import ImpactError, StoreError, UnfinishedError, UsageError
from ..text import safe_text
from .execute import never_stop, other_version
from .executors import BLOCKS_IN_FLIGHT, Backend

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

LOCAL = "local"
ADDRESS = "the address of a scheduler of dask, such as tcp://host:8786"
# blocks given to all workers together, at most: the driver's memory is the same for any number of them
MOST = 256
# seconds between two questions to the scheduler, and after which nobody is waited for any more
MOMENT, PATIENCE = 1.0, 10.0
# seconds without an answer after which no block is given out and a signal ends the sweep at once, and that the end
# of a connection may take
SILENCE_S, CLOSE_TIMEOUT_S = 3.0, 2.0
# the setting of dask's configuration for how long a connection, and any later answer, may take
TIMEOUT = "distributed.comm.timeouts.connect"
# seconds without a worker of our own, which are begun again when they die, after which there will be none
AWAY = 60.0
# asks in words that a worker of any version understands
VERSION = "__import__('impact').__version__"
# of a scheduler of our own: a block whose worker died comes back to us, to be given out again; and a worker that
# is dead when it is looked at is begun again all the same
OWN = {"distributed.scheduler.allowed-failures": 0, "distributed.deploy.lost-worker-timeout": "1000 days"}
# what workers of our own do first: a terminal sends SIGINT to all, and it is the driver's; so is what is told
DEAF = "import logging, signal; logging.disable(); signal.signal(signal.SIGINT, signal.SIG_IGN)"


Result = TypeVar("Result")


class Cluster(NamedTuple):
    """A team, the address of the scheduler's dashboard if it has one, and how many workers there are at first."""

    backend: Backend
    dashboard: str | None
    workers: int


@contextlib.contextmanager
def cluster(place: str | Path, should_stop: Callable[[], bool] = never_stop) -> Iterator[Cluster]:
    """The workers of a scheduler.

    Parameters
    ----------
    place : its address, such as "tcp://host:8786"; the path of its scheduler file; or "local", for one of our own
        with a worker for each processor of this machine, which ends with us
    should_stop : whether to give up while it is connected to

    Raises
    ------
    UsageError : it cannot be reached or does not answer, dask.distributed is missing, or a worker has another
        version of this package
    UnfinishedError : `should_stop` became true
    """
    shown = safe_text(str(place))
    if find_spec("distributed") is None:
        extra = 'pip install "impact-sweep[distributed]"'
        raise UsageError(f"--scheduler {shown}: wants dask.distributed, which is not installed: {extra}")
    if isinstance(place, str) and place != LOCAL and "://" not in place:
        raise UsageError(f"{shown}: wants {ADDRESS}; or {LOCAL}")
    with contextlib.ExitStack() as stack:
        # what becomes of the scheduler and its workers is told by the sweep
        stack.callback(logging.disable, logging.root.manager.disable)
        logging.disable()
        limit = _timeout()
        own = _local_cluster(stack) if place == LOCAL else None
        try:
            client, info, workers = _within(limit, partial(_connected, own or place, shown, limit), should_stop)
        except TimeoutError:
            raise UsageError(
                f"{shown}: no answer within {limit:g} s; expected {ADDRESS} (dask: {TIMEOUT})"
            ) from None
        stack.callback(_close, client)
        backend = Backend(lambda: _executor(client, shown), _room(client, shown))
        yield Cluster(backend, client.dashboard_link if "dashboard" in info["services"] else None, workers)


def _timeout() -> float:
    """Seconds that an answer may take, by dask's configuration, to which distributed adds its own on import."""
    import dask.config
    import distributed  # noqa: F401
    from dask.utils import parse_timedelta

    return float(parse_timedelta(dask.config.get(TIMEOUT)))


def _within(limit: float, action: Callable[[], Result], should_stop: Callable[[], bool] = never_stop) -> Result:
    """The result of an action that may wait forever: it runs in a thread, which is left behind if it does.

    Raises
    ------
    TimeoutError : it takes longer than `limit` seconds
    UnfinishedError : `should_stop` became true
    """
    future: Future[Result] = Future()

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


def _local_cluster(stack: contextlib.ExitStack) -> LocalCluster:
    """A scheduler of our own, which other machines cannot reach; it ends with the stack."""
    import dask.config
    from distributed import LocalCluster

    dask.config.set(OWN)
    loopback = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}
    return stack.enter_context(LocalCluster(threads_per_worker=1, memory_limit=0, preload=[DEAF], **loopback))


def _connected(place: str | Path | LocalCluster, shown: str, limit: float) -> tuple[Client, dict[str, Any], int]:
    """A client of a scheduler and workers of this version, what the scheduler is, and how many workers it has."""
    from distributed import Client

    patience = min(PATIENCE, limit)
    try:
        if isinstance(place, Path):
            _wait_for(place, shown)
            client = Client(scheduler_file=str(place), set_as_default=False, timeout=patience)
        else:
            client = Client(place, set_as_default=False, timeout=patience)
    except (OSError, ValueError, TypeError, ImportError) as error:
        told = safe_text(str(error), 300)
        raise UsageError(f"{shown}: {told}; wants {ADDRESS}") from None
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


def _wait_for(file: Path, shown: str) -> None:
    """A scheduler that was started just now may still be about to write its file."""
    begun = time.monotonic()
    while not file.is_file():
        if time.monotonic() - begun > PATIENCE:
            wants = "the file that dask scheduler --scheduler-file makes"
            raise UsageError(f"{shown}: is not there after {PATIENCE:.0f} s, wants {wants}")
        time.sleep(0.1)


def _check_versions(client: Client) -> None:
    """Refuse a scheduler and workers that have another version of this package, or none: all read what is sent."""
    try:
        places = {"the scheduler": client.run_on_scheduler(eval, VERSION)}
    except ImportError as error:
        places = {"the scheduler": error}
    for place, found in (places | client.run(eval, VERSION, on_error="return")).items():
        if isinstance(found, BaseException):
            raise UsageError(f"{place}: has no impact: {safe_text(str(found))}; wants impact {__version__}")
        if found != __version__:
            raise UsageError(other_version(place, str(found), __version__))


def _room(client: Client, shown: str) -> Callable[[], int]:
    """How many blocks may be given at the moment: workers come and go; those of our own are to stay.

    A thread asks the scheduler, who may never answer.
    """
    limit = _timeout()
    answers = seen = workers = 0
    silent = alone = 0.0
    last = time.monotonic()

    def ask() -> None:
        nonlocal answers, workers
        while client.status not in ("closing", "closed"):
            with contextlib.suppress(OSError, ValueError, CancelledError):
                workers = sum(client.nthreads().values())
                answers += 1
            time.sleep(MOMENT)

    threading.Thread(target=ask, daemon=True).start()

    def of_now() -> int:
        nonlocal seen, silent, alone, last
        # a time in which this process was suspended does not count
        passed = min(time.monotonic() - last, MOMENT)
        last = time.monotonic()
        silent = 0.0 if answers > seen else silent + passed
        alone = 0.0 if workers or not answers else alone + passed
        seen = answers
        if silent > limit:
            raise StoreError(f"{shown}: the scheduler has not answered for {limit:g} s")
        if shown == LOCAL and alone > AWAY:
            raise StoreError(f"{shown}: all workers are gone")
        return 0 if silent > SILENCE_S else min(BLOCKS_IN_FLIGHT * workers, MOST)

    return of_now


class _Tasks(Executor):
    """An executor of dask whose futures can be cancelled without an answer of the scheduler."""

    def __init__(self, tasks: Executor) -> None:
        self._tasks = tasks

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()

        def hand_on(done: Future[Any]) -> None:
            with contextlib.suppress(InvalidStateError):
                if done.cancelled():
                    future.cancel()
                    future.set_running_or_notify_cancel()
                elif error := done.exception():
                    future.set_exception(error)
                else:
                    future.set_result(done.result())

        self._tasks.submit(fn, *args, **kwargs).add_done_callback(hand_on)
        return future


@contextlib.contextmanager
def _executor(client: Client, shown: str) -> Iterator[Executor]:
    from distributed import KilledWorker
    from distributed.client import ClosedClientError

    tasks = client.get_executor(pure=False)
    try:
        yield _Tasks(tasks)
    except KilledWorker as error:
        # all that was given out is given out again
        with contextlib.suppress(TimeoutError):
            _within(CLOSE_TIMEOUT_S, partial(tasks.shutdown, wait=False))
        raise BrokenExecutor from error
    except (CancelledError, ClosedClientError, OSError) as error:
        raise StoreError(f"{shown}: the scheduler is gone") from error
    except ImpactError:
        raise
    except Exception:
        # one that joined with another version may not even understand what it is sent
        _within(_timeout(), partial(_check_versions, client))
        raise
