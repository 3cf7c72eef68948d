"""Blocks integrated by several processes: each is sent as numbers and names, and what became of it comes back."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from pathlib import Path

from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..contact.strike import Rebound
from ..errors import StoreError, UsageError
from ..text import safe_text
from .config import Solver
from .plan import Plan
from .plugins import read_plugins
from .trajectories import Block, integrated

# blocks a process has before it: the one it works at, and the next
AHEAD = 2
# how often a block is given out again
AGAIN = 3

# the models of a worker process, by key; they are made there, since functions cannot be sent
_models: dict[str, ForceModel] = {}


def begin(files: Sequence[Path], hashes: dict[str, str]) -> None:
    """What a worker does first: learn the models, leave signals to the driver, and end when that does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    driver = multiprocessing.parent_process()
    if driver is not None:

        def follow() -> None:
            multiprocessing.connection.wait([driver.sentinel])
            os._exit(1)

        threading.Thread(target=follow, daemon=True).start()
    plugins = read_plugins(files)
    if plugins.hashes != hashes:
        raise UsageError("a plug-in was changed while the sweep ran")
    _models.update(catalogue(plugins.models))


def work(block: Block, solver: Solver) -> Rebound:
    """What becomes of a block; a pure function of it."""
    return integrated(_models[block.key], block, solver)


def spread(
    plan: Plan, blocks: Iterator[Block], jobs: int, stopping: Callable[[], bool]
) -> Iterator[tuple[int, Rebound]]:
    """Integrate blocks in several processes, and give the number of each and what became of it as they finish.

    Parameters
    ----------
    plan : what they are of
    blocks : made one after the other, as there is need
    jobs : how many processes
    stopping : whether no more are to be begun; those that were are finished

    Raises
    ------
    UsageError : a model was given as a Python value, which cannot be sent
    StoreError : processes were killed again and again
    """
    values = [one.model.key for one in plan.plugins.items if one.file is None]
    if values:
        raise UsageError(
            f"jobs: got {jobs}, but {safe_text(', '.join(values))} is given as a Python value, which cannot be "
            "sent to other processes; wants the file that it is in, or jobs=1"
        )
    trials: dict[int, int] = {}
    waiting: list[Block] = []
    while True:
        begun: dict[Future[Rebound], Block] = {}
        pool = ProcessPoolExecutor(
            jobs, multiprocessing.get_context("spawn"), begin, (plan.plugins.files, plan.plugins.hashes)
        )
        try:
            while True:
                while len(begun) < AHEAD * jobs and not stopping():
                    if not waiting:
                        waiting += islice(blocks, 1)
                    if not waiting:
                        break
                    begun[pool.submit(work, waiting[-1], plan.config.solver)] = waiting[-1]
                    waiting.pop()
                if not begun:
                    return
                done, _ = wait(begun, return_when=FIRST_COMPLETED)
                for future in done:
                    rebound = future.result()
                    yield begun.pop(future).number, rebound
        except BrokenProcessPool:
            # which of the blocks its process did not live through cannot be known
            for block in begun.values():
                trials[block.number] = trials.get(block.number, 0) + 1
            waiting += begun.values()
            if max(trials.values(), default=0) > AGAIN:
                why = "as happens where memory is short"
                raise StoreError(
                    f"processes were killed {AGAIN + 1} times at the same trajectories, {why}"
                ) from None
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
