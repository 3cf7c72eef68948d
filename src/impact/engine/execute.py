"""Run a plan: a generator of finished blocks, from which progress, storage and pictures fall out."""

from __future__ import annotations

import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import fields, replace
from functools import partial

import numpy as np

from ..contact.compiled import is_installed, serves
from ..contact.status import Status
from ..contact.strike import Rebound
from ..errors import StoreError, UsageError
from ..text import safe_text
from .blocks import Block, Kit, integrated, work
from .build_impacts import exponents
from .executors import ALONE, Team
from .plan import Plan
from .trajectories import Stretch, Trajectories, block_of

# impacts of compiled forms from which on numba is sooner done, though it has to be loaded
WORTH = 200_000
# how often a block is given out again
AGAIN = 3
# seconds after which it is looked again whether to stop, and whether there is room
MOMENT = 0.2

# what comes back of a block: see `impact.engine.blocks.integrated`
Done = tuple[Rebound, dict[str, str]]
STATUSES = [int(status) for status in Status]


def settled(plan: Plan, found: Sequence[Trajectories]) -> Plan:
    """The plan with its core decided, by what there is to integrate.

    >>> from impact.api import prepare
    >>> from impact.engine.trajectories import trajectories
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
    StoreError : they were killed again and again, cannot be reached any more, or return what is no block

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
                stretch, done = given[future], future.result()
                _check(stretch, done)
                del given[future]
                yield stretch, done
    finally:
        for future in given:
            future.cancel()


def _check(stretch: Stretch, done: object) -> None:
    """Refuse a block that cannot be what its trajectories came to: an executor may return anything.

    Raises
    ------
    StoreError : it is no block, or its arrays have another shape or dtype, or hold an unknown status
    """
    where = f"executor: block {stretch.number}"
    rebound, errors = done if isinstance(done, tuple) and len(done) == 2 else (done, {})
    if not isinstance(rebound, Rebound):
        raise StoreError(f"{where}: got {safe_text(type(rebound).__name__)}, expected Rebound")
    if not isinstance(errors, dict):
        raise StoreError(f"{where}: got {safe_text(type(errors).__name__)}, expected a dict of errors")
    blank = Rebound.blank(stretch.size)
    for field in fields(Rebound):
        got, expected = (_form(getattr(one, field.name)) for one in (rebound, blank))
        if got != expected:
            raise StoreError(f"{where}: {field.name}: got {got}, expected {expected}")
    unknown = np.setdiff1d(rebound.status, STATUSES)
    if unknown.size:
        raise StoreError(f"{where}: status: got {unknown[0]}, expected one of {STATUSES}")


def _form(array: object) -> str:
    """The dtype and shape of an array."""
    if not isinstance(array, np.ndarray):
        return safe_text(type(array).__name__)
    return f"{array.dtype} of shape {array.shape}"


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
