"""Run a plan: a generator of finished blocks, from which progress, storage and pictures fall out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

from ..contact.compiled import is_installed, serves
from ..contact.strike import Rebound
from ..errors import UsageError
from .blocks import Block, integrated
from .impacts import exponents
from .plan import Plan
from .trajectories import Stretch, Trajectories, block_of

# impacts of compiled forms from which on numba is sooner done, though it has to be loaded
WORTH = 200_000


def settled(plan: Plan, found: Sequence[Trajectories]) -> Plan:
    """The plan with its core decided, by what there is to integrate.

    >>> from impact.api import prepare
    >>> from impact.sweeps.trajectories import trajectories
    >>> plan = prepare("configs/figure6.toml")
    >>> settled(plan, trajectories(plan)).config.solver.core
    'numpy'
    """
    solver = plan.config.solver
    if solver.core != "auto":
        return plan
    is_worth = is_installed() and sum(one.count for one in found if _is_served(plan, one)) >= WORTH
    return replace(
        plan, config=replace(plan.config, solver=replace(solver, core="numba" if is_worth else "numpy"))
    )


def _is_served(plan: Plan, own: Trajectories) -> bool:
    """Whether a compiled core integrates some phase of a model, at all of its exponents."""
    model = plan.models[own.model]
    return all(any(serves(model, n)) for n in exponents(plan, model))


def never() -> bool:
    """Do not stop."""
    return False


def run(
    plan: Plan,
    found: Sequence[Trajectories],
    todo: Iterable[Stretch],
    *,
    jobs: int = 1,
    threads: int = 1,
    stopping: Callable[[], bool] = never,
) -> Iterator[tuple[Stretch, Rebound]]:
    """Integrate block after block; with one process and thread in order, with more as they finish.

    Parameters
    ----------
    plan : what to run
    found : its trajectories
    todo : the stretches of them to be integrated
    jobs : how many processes
    threads : how many threads, of one process
    stopping : whether no more are to be begun

    Raises
    ------
    UsageError : both are more than one
    """
    begun: dict[int, Stretch] = {}

    def blocks() -> Iterator[Block]:
        for stretch in todo:
            begun[stretch.number] = stretch
            yield block_of(plan, found, stretch)

    if jobs > 1 and threads > 1:
        raise UsageError(f"jobs: got {jobs} beside {threads} threads, wants one of the two")
    if jobs > 1:
        from .workers import spread

        for number, rebound in spread(plan, blocks(), jobs, stopping):
            yield begun.pop(number), rebound
        return
    if threads > 1:
        from .threads import spread_over_threads

        for number, rebound in spread_over_threads(plan, blocks(), threads, stopping):
            yield begun.pop(number), rebound
        return
    for stretch in todo:
        if stopping():
            return
        yield stretch, integrated(plan.models[stretch.model], block_of(plan, found, stretch), plan.config.solver)
