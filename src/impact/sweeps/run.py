"""Run a plan: a generator of finished blocks, from which progress, storage and pictures fall out."""

from __future__ import annotations

import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import replace
from functools import partial

from ..contact.compiled import is_installed, serves
from ..contact.strike import Rebound
from ..errors import StoreError, UsageError
from ..text import safe_text
from .blocks import Block, Kit, integrated, work
from .impacts import exponents
from .plan import Plan
from .teams import ALONE, Team
from .trajectories import Stretch, Trajectories, block_of

# impacts of compiled forms from which on numba is sooner done, though it has to be loaded
WORTH = 200_000
# how often a block is given out again
AGAIN = 3
# seconds after which it is looked again whether to stop, and whether there is room
MOMENT = 0.2

# what comes back of a block: see `impact.sweeps.blocks.integrated`
Done = tuple[Rebound, dict[str, str]]


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
    team: Team = ALONE,
    stopping: Callable[[], bool] = never,
) -> Iterator[tuple[Stretch, Rebound]]:
    """Integrate block after block; alone in order, with others as they finish.

    Parameters
    ----------
    plan : what to run
    found : its trajectories
    todo : the stretches of them to be integrated
    team : who integrates
    stopping : whether no more are to be begun; those that were are finished

    Raises
    ------
    UsageError : a model was given as a Python value, which cannot be sent; or those who integrate lack something
    StoreError : they were killed again and again, or cannot be reached any more

    Warns
    -----
    UserWarning : a law raised an error; once for each law and distinct error
    """
    integrate = _integrator(plan, team)
    left, trials = deque(todo), Counter[int]()
    reported: set[str] = set()
    while True:
        given: dict[Future[Done], Stretch] = {}
        try:
            with team.executor() as executor:

                def give(stretch: Stretch) -> Future[Done]:
                    # no more is held of a block than what it is made of
                    return executor.submit(integrate, block_of(plan, found, stretch))

                for stretch, (rebound, errors) in _finished(give, left, given, team.room, stopping):
                    for error in errors.keys() - reported:
                        warnings.warn(errors[error], stacklevel=2)
                    reported |= errors.keys()
                    yield stretch, rebound
                return
        except BrokenExecutor:
            # which of the blocks it did not live through cannot be known
            left.extendleft(given.values())
            trials.update(stretch.number for stretch in given.values() or left)
            if max(trials.values()) > AGAIN:
                raise StoreError(
                    f"processes were killed {AGAIN + 1} times at the same trajectories: memory is short; or, of a "
                    'program of your own, it lacks its if __name__ == "__main__":'
                ) from None


def _finished(
    give: Callable[[Stretch], Future[Done]],
    left: deque[Stretch],
    given: dict[Future[Done], Stretch],
    room: Callable[[], int],
    stopping: Callable[[], bool],
) -> Iterator[tuple[Stretch, Done]]:
    """Give what is left, as many blocks at a time as there is room for, and take them as they finish."""
    try:
        while left or given:
            # asked in every round, also where nothing is left to give: it raises if nobody answers any more
            most = room()
            while left and len(given) < most and not stopping():
                given[give(left[0])] = left[0]
                left.popleft()
            # what was begun is finished, unless there is nobody left to do it
            if stopping() and not (given and most):
                return
            if not given:
                # nobody is there yet
                time.sleep(MOMENT)
            for future in wait(given, MOMENT, FIRST_COMPLETED).done:
                done = future.result()
                yield given.pop(future), done
    finally:
        for future in given:
            future.cancel()


def _integrator(plan: Plan, team: Team) -> Callable[[Block], Done]:
    """What integrates a block of a plan, where the team is."""
    if team.is_here:
        models = {model.key: model for model in plan.models}
        return lambda block: integrated(models[block.key], block, plan.config.solver)
    values = [one.model.key for one in plan.plugins.items if one.is_value]
    if values:
        raise UsageError(
            f"{safe_text(', '.join(values))} is given as a Python value, which cannot be sent to other processes; "
            "wants the file that it is in, or jobs=1"
        )
    return partial(work, kit=kit_of(plan))


def kit_of(plan: Plan) -> Kit:
    """What the blocks of a plan are integrated with elsewhere."""
    from .. import __version__

    plugins = plan.plugins
    return Kit(
        __version__,
        plan.config.solver,
        tuple((one.name, one.content) for one in plugins.sources),
        tuple(plugins.hashes.items()),
    )
