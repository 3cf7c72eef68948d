"""Blocks integrated by several processes: each is sent as numbers and names, and what became of it comes back."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice

from ..contact.strike import Rebound
from ..errors import StoreError, UsageError
from ..text import safe_text
from .blocks import Block, begin, work
from .plan import Plan

# blocks a process has before it: the one it works at, and those it goes on with while the driver is busy
AHEAD = 3
# how often a block is given out again
AGAIN = 3


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold back SIGINT, which a terminal sends to all: a process that begins here never gets it, we do later."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


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
    values = [one.model.key for one in plan.plugins.items if one.is_value]
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
                    with _interrupts_held():
                        future = pool.submit(work, waiting[-1], plan.config.solver)
                    begun[future] = waiting[-1]
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
                raise StoreError(
                    f"processes were killed {AGAIN + 1} times at the same trajectories: memory is short; or, of a "
                    'program of your own, it lacks its if __name__ == "__main__":'
                ) from None
        except BaseException as error:
            # a force that never returns would be waited for
            if not isinstance(error, Exception | GeneratorExit):
                for process in list(getattr(pool, "_processes", None) or {}):
                    os.kill(process, signal.SIGKILL)
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
