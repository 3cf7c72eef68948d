"""Run a plan: a generator of finished blocks, from which progress, storage and pictures fall out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from ..contact.strike import Rebound
from .blocks import Block, integrated
from .plan import Plan
from .trajectories import Stretch, Trajectories, block_of


def never() -> bool:
    """Do not stop."""
    return False


def run(
    plan: Plan,
    found: Sequence[Trajectories],
    todo: Iterable[Stretch],
    *,
    jobs: int = 1,
    stopping: Callable[[], bool] = never,
) -> Iterator[tuple[Stretch, Rebound]]:
    """Integrate block after block; with one process in order, with more as they finish.

    Parameters
    ----------
    plan : what to run
    found : its trajectories
    todo : the stretches of them to be integrated
    jobs : how many processes
    stopping : whether no more are to be begun
    """
    if jobs > 1:
        from .workers import spread

        begun: dict[int, Stretch] = {}

        def blocks() -> Iterator[Block]:
            for stretch in todo:
                begun[stretch.number] = stretch
                yield block_of(plan, found, stretch)

        for number, rebound in spread(plan, blocks(), jobs, stopping):
            yield begun.pop(number), rebound
        return
    for stretch in todo:
        if stopping():
            return
        yield stretch, integrated(plan.models[stretch.model], block_of(plan, found, stretch), plan.config.solver)
