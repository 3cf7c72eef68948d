"""A cluster: the workers of a scheduler of dask.distributed as a team, wherever they are."""

from __future__ import annotations

import contextlib
import logging
import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..errors import ImpactError, StoreError, UsageError
from ..text import safe_text
from .blocks import other_version
from .teams import AHEAD, Team

if TYPE_CHECKING:
    from distributed import Client

LOCAL = "local"
ADDRESS = "the address of a scheduler of dask, such as tcp://host:8786"
# blocks given to all workers together, at most: the driver's memory is the same for any number of them
MOST = 256
# seconds for which a number of workers is taken to hold, and after which nobody is waited for any more
MOMENT, PATIENCE = 1.0, 10.0
# seconds without a worker of our own, which are begun again when they die, after which there will be none
AWAY = 60.0
# asks in words that a worker of any version understands
VERSION = "__import__('impact').__version__"
# of a scheduler of our own: a block whose worker died comes back to us, to be given out again; and a worker that
# is dead when it is looked at is begun again all the same
OWN = {"distributed.scheduler.allowed-failures": 0, "distributed.deploy.lost-worker-timeout": "1000 days"}
# what workers of our own do first: a terminal sends SIGINT to all, and it is the driver's; so is what is told
DEAF = "import logging, signal; logging.disable(); signal.signal(signal.SIGINT, signal.SIG_IGN)"


class Cluster(NamedTuple):
    """A team, the address of the scheduler's dashboard if it has one, and how many workers there are at first."""

    team: Team
    dashboard: str | None
    workers: int


@contextlib.contextmanager
def cluster(place: str | Path) -> Iterator[Cluster]:
    """The workers of a scheduler.

    Parameters
    ----------
    place : its address, such as "tcp://host:8786"; the path of its scheduler file; or "local", for one of our own
        with a worker for each processor of this machine, which ends with us

    Raises
    ------
    UsageError : it cannot be reached, dask.distributed is missing, or a worker has another version of this package
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
        client = _connected(place, shown, stack)
        _check_versions(client)
        team = Team(lambda: _executor(client, shown), _room(client, shown))
        is_seen = "dashboard" in client.scheduler_info()["services"]
        yield Cluster(team, client.dashboard_link if is_seen else None, len(client.nthreads()))


def _connected(place: str | Path, shown: str, stack: contextlib.ExitStack) -> Client:
    """A client of the scheduler; it is closed with the stack, and a scheduler of our own with it."""
    import dask.config
    from distributed import Client, LocalCluster

    try:
        if place == LOCAL:
            dask.config.set(OWN)
            own = stack.enter_context(
                LocalCluster(threads_per_worker=1, dashboard_address="127.0.0.1:0", memory_limit=0, preload=[DEAF])
            )
            return stack.enter_context(Client(own, set_as_default=False))
        if isinstance(place, Path):
            _wait_for(place, shown)
            return stack.enter_context(Client(scheduler_file=str(place), set_as_default=False, timeout=PATIENCE))
        return stack.enter_context(Client(place, set_as_default=False, timeout=PATIENCE))
    except (OSError, ValueError, TypeError, ImportError) as error:
        told = safe_text(str(error), 300)
        raise UsageError(f"{shown}: {told}; wants {ADDRESS}") from None


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
    from .. import __version__

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
    """How many blocks may be given at the moment: workers come and go; those of our own are to stay."""
    asked = seen = -math.inf
    workers = 0

    def of_now() -> int:
        nonlocal asked, seen, workers
        now = time.monotonic()
        if now - asked > MOMENT:
            asked = now
            with contextlib.suppress(OSError, ValueError):
                workers = sum(client.nthreads().values())
            seen = now if workers or seen == -math.inf else seen
            if shown == LOCAL and now - seen > AWAY:
                raise StoreError(f"{shown}: all workers are gone")
        return min(AHEAD * workers, MOST)

    return of_now


@contextlib.contextmanager
def _executor(client: Client, shown: str) -> Iterator[Executor]:
    from distributed import KilledWorker
    from distributed.client import ClosedClientError

    try:
        yield client.get_executor(pure=False)
    except KilledWorker as error:
        raise BrokenExecutor from error
    except (CancelledError, ClosedClientError, OSError) as error:
        raise StoreError(f"{shown}: the scheduler is gone") from error
    except ImpactError:
        raise
    except Exception:
        # one that joined with another version may not even understand what it is sent
        _check_versions(client)
        raise
