"""Blocks integrated by several threads of one process: a compiled core lets them run side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait

from ..contact.strike import Rebound
from .blocks import Block, integrated
from .plan import Plan

# blocks a thread has before it: the one it works at, and one more
AHEAD = 2


def spread_over_threads(
    plan: Plan, blocks: Iterator[Block], threads: int, stopping: Callable[[], bool]
) -> Iterator[tuple[int, Rebound]]:
    """Integrate blocks in several threads, and give the number of each and what became of it as they finish.

    Parameters
    ----------
    plan : what they are of
    blocks : made one after the other, as there is need
    threads : how many
    stopping : whether no more are to be begun; those that were are finished
    """
    models = {model.key: model for model in plan.models}
    begun: dict[Future[Rebound], int] = {}
    with ThreadPoolExecutor(threads) as pool:
        while True:
            while len(begun) < AHEAD * threads and not stopping():
                block = next(blocks, None)
                if block is None:
                    break
                begun[pool.submit(integrated, models[block.key], block, plan.config.solver)] = block.number
            if not begun:
                return
            for future in wait(begun, return_when=FIRST_COMPLETED).done:
                yield begun.pop(future), future.result()
