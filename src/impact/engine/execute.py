"""Run a plan: a generator of finished ranges of trajectories, from which progress and storage follow.

A range is integrated here or anywhere else, from numbers, names and source alone, and no more is loaded there than
it needs.
"""

from __future__ import annotations

import socket
import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from .._version import __version__
from ..config.tables import Solver
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..contact.numba.dispatch import is_installed, serves
from ..contact.simulate import TABLE_COLUMNS, CollisionResult, simulate
from ..contact.status import STATUSES
from ..errors import StoreError, UsageError
from ..text import safe_text
from .build_impacts import exponents
from .executors import SERIAL, Backend
from .plan import Plan
from .trajectories import Columns, TrajectoryMap, TrajectoryRange, columns_of

# trajectories of compiled forms from which on numba is faster, though it has to be loaded
NUMBA_MIN_TRAJECTORIES = 200_000
# how often a range is submitted again whose process was killed
MAX_RETRIES = 3
# seconds after which it is looked again whether to stop, and whether there is room
POLL_INTERVAL_S = 0.2

# what a range comes to, and a line for each distinct error that the law raised
Integrated = tuple[CollisionResult, dict[str, str]]
# which trajectories of a range are known already, and what they come to; None where none is
ReusedPart = tuple[NDArray[np.bool_], CollisionResult] | None
FindReused = Callable[[TrajectoryRange], ReusedPart]
# what is being integrated
Running = dict[Future[Integrated], tuple[TrajectoryRange, ReusedPart]]


@dataclass(frozen=True)
class WorkerContext:
    """What a range is integrated with where nothing of its sweep is known: numbers, names and source.

    Parameters
    ----------
    version : of this package
    solver : how
    sources : name and content of the Python files that plug-in models are in
    hashes : key and SHA-256 of the models that are not built in
    """

    version: str
    solver: Solver
    sources: tuple[tuple[str, bytes], ...] = ()
    hashes: tuple[tuple[str, str | None], ...] = ()


def integrate_columns(model: ForceModel, columns: Columns, solver: Solver) -> Integrated:
    """Integrate some trajectories of a model; see `impact.engine.trajectories.columns_of`."""
    errors: dict[str, str] = {}
    values = {name: column for name, column in columns.items() if name not in ("n", "status")}
    rebound = simulate(
        model, columns["n"], values, columns["status"],
        rtol=solver.rtol, max_steps=solver.max_steps, collapse=solver.collapse, core=solver.core, errors=errors,
    )  # fmt: skip
    return rebound, errors


def integrate_remotely(key: str, columns: Columns, context: WorkerContext) -> Integrated:
    """Integrate some trajectories of the model of a key; a pure function, which may run anywhere, and twice.

    Raises
    ------
    UsageError : this place has another version, no numba where that is wanted, or not the same models
    """
    return integrate_columns(_models(context)[key], columns, context.solver)


# the models of the sweeps of which this place was sent something last
@lru_cache(maxsize=4)
def _models(context: WorkerContext) -> Mapping[str, ForceModel]:
    here = socket.gethostname()
    if context.version != __version__:
        raise UsageError(other_version(here, __version__, context.version))
    if context.solver.core == "numba" and not is_installed():
        raise UsageError(
            f'{here}: has no numba, which this sweep needs; install it there, or set solver.core = "numpy"'
        )
    if not context.hashes:
        return catalogue()
    from .plugins import Source, read_plugins

    plugins = read_plugins([Source(*source) for source in context.sources])
    lacking = [key for key, sha256 in context.hashes if plugins.hashes.get(key) != sha256]
    if lacking:
        raise UsageError(
            f"{here}: {safe_text(', '.join(lacking))}: expected the package that has it, in this version"
        )
    return catalogue(plugins.models)


def other_version(place: str, there: str, here: str) -> str:
    """The message about a place that has another version."""
    return f"{place}: has impact {safe_text(there)}, this is {here}; expected the same"


def with_core(plan: Plan, maps: Sequence[TrajectoryMap]) -> Plan:
    """The plan with `core = "auto"` replaced, by what there is to integrate.

    >>> from impact.api import prepare
    >>> from impact.engine.trajectories import trajectory_maps
    >>> plan = prepare("configs/figure6.toml")
    >>> with_core(plan, trajectory_maps(plan)).config.solver.core
    'numpy'
    """
    solver = plan.config.solver
    if solver.core != "auto":
        return plan
    count = sum(own.count for own in maps if _is_compiled(plan, own))
    core = "numba" if is_installed() and count >= NUMBA_MIN_TRAJECTORIES else "numpy"
    return replace(plan, config=replace(plan.config, solver=replace(solver, core=core)))


def _is_compiled(plan: Plan, own: TrajectoryMap) -> bool:
    """Whether a compiled core integrates some phase of a model, at all of its exponents."""
    model = plan.models[own.model]
    return all(any(serves(model, n)) for n in exponents(plan.inputs, model))


def never_stop() -> bool:
    """Do not stop."""
    return False


def integrate_ranges(
    plan: Plan,
    maps: Sequence[TrajectoryMap],
    todo: Iterable[TrajectoryRange],
    *,
    backend: Backend = SERIAL,
    should_stop: Callable[[], bool] = never_stop,
    known: FindReused = lambda part: None,
) -> Iterator[tuple[TrajectoryRange, CollisionResult]]:
    """Integrate range after range; alone in order, with others as they finish.

    Parameters
    ----------
    plan : what to run
    maps : its trajectories
    todo : the ranges of them to be integrated
    backend : who integrates
    should_stop : whether no more are to be begun; those that were are finished
    known : what is known already, and is not integrated again

    Raises
    ------
    UsageError : a model was given as a Python value, which cannot be sent; or those who integrate lack something
    StoreError : they were killed again and again, cannot be reached any more, or return something else

    Warns
    -----
    UserWarning : a law raised an error; once for each law and distinct error
    """
    submit = _submitter(plan, backend)
    left, trials = deque(todo), Counter[int]()
    reported: set[str] = set()
    while True:
        running: Running = {}
        try:
            with backend.executor() as executor:

                def start(part: TrajectoryRange, before: ReusedPart) -> Future[Integrated]:
                    # no more is held of a range than what it is made of
                    columns = columns_of(plan, maps, part)
                    if before is not None:
                        columns = {name: values[~before[0]] for name, values in columns.items()}
                    return submit(executor, plan.models[part.model].key, columns)

                for part, (rebound, errors) in _finished(
                    start, left, running, known, backend.capacity, should_stop
                ):
                    for error in errors.keys() - reported:
                        warnings.warn(errors[error], stacklevel=2)
                    reported |= errors.keys()
                    yield part, rebound
                return
        except BrokenExecutor:
            # which of the ranges it did not live through cannot be known
            begun = [part for part, _ in running.values()]
            left.extendleft(begun)
            trials.update(part.number for part in begun or left)
            if max(trials.values()) > MAX_RETRIES:
                raise StoreError(
                    f"processes were killed {MAX_RETRIES + 1} times at the same trajectories: memory is short; "
                    'or, of a program of your own, it lacks its if __name__ == "__main__":'
                ) from None


def _finished(
    start: Callable[[TrajectoryRange, ReusedPart], Future[Integrated]],
    left: deque[TrajectoryRange],
    running: Running,
    known: FindReused,
    capacity: Callable[[], int],
    should_stop: Callable[[], bool],
) -> Iterator[tuple[TrajectoryRange, Integrated]]:
    """Submit what is left, as many ranges at a time as there is room for, and take them as they finish."""
    try:
        while left or running:
            # asked in every round, also where nothing is left to submit: it raises if nobody answers any more
            most = capacity()
            while left and len(running) < most and not should_stop():
                part, before = left[0], known(left[0])
                if before is not None and before[0].all():
                    left.popleft()
                    yield part, (before[1], {})
                    continue
                running[start(part, before)] = part, before
                left.popleft()
            # what was begun is finished, unless there is nobody left to do it
            if should_stop() and not (running and most):
                return
            if not running:
                # nobody is there yet
                time.sleep(POLL_INTERVAL_S if left else 0.0)
            for future in wait(running, POLL_INTERVAL_S, FIRST_COMPLETED).done:
                (part, before), done = running[future], future.result()
                _check(part, done, part.size if before is None else int(np.count_nonzero(~before[0])))
                del running[future]
                yield part, done if before is None else (_merged(before, done[0]), done[1])
    finally:
        for future in running:
            future.cancel()


def _merged(known: tuple[NDArray[np.bool_], CollisionResult], integrated: CollisionResult) -> CollisionResult:
    """A range of which some trajectories were known."""
    is_known, before = known
    whole = before.take(slice(None))
    whole = CollisionResult(**{name: values.copy() for name, values in vars(whole).items()})
    whole.put(~is_known, integrated)
    return whole


def _check(part: TrajectoryRange, done: object, size: int) -> None:
    """Refuse what cannot be what so many trajectories came to: an executor may return anything.

    Raises
    ------
    StoreError : it has another type, or its arrays another shape or dtype, or hold an unknown status
    """
    where = f"executor: range {part.number}"
    rebound, errors = done if isinstance(done, tuple) and len(done) == 2 else (done, {})
    if not isinstance(rebound, CollisionResult):
        raise StoreError(f"{where}: got {safe_text(type(rebound).__name__)}, expected CollisionResult")
    if not isinstance(errors, dict):
        raise StoreError(f"{where}: got {safe_text(type(errors).__name__)}, expected a dict of errors")
    blank = CollisionResult.blank(size)
    for name in TABLE_COLUMNS:
        got, expected = (_form(getattr(result, name)) for result in (rebound, blank))
        if got != expected:
            raise StoreError(f"{where}: {name}: got {got}, expected {expected}")
    unknown = np.setdiff1d(rebound.status, STATUSES)
    if unknown.size:
        raise StoreError(f"{where}: status: got {unknown[0]}, expected one of {list(STATUSES)}")


def _form(array: object) -> str:
    """The dtype and shape of an array."""
    if not isinstance(array, np.ndarray):
        return safe_text(type(array).__name__)
    return f"{array.dtype} of shape {array.shape}"


def _submitter(plan: Plan, backend: Backend) -> Callable[..., Future[Integrated]]:
    """What submits the trajectories of a plan to an executor of a team."""
    if backend.shares_memory:
        models = {model.key: model for model in plan.models}

        def integrate_here(key: str, columns: Columns) -> Integrated:
            return integrate_columns(models[key], columns, plan.config.solver)

        return lambda executor, key, columns: executor.submit(integrate_here, key, columns)
    values = [plugin.model.key for plugin in plan.plugins.items if plugin.is_value]
    if values:
        raise UsageError(
            f"{safe_text(', '.join(values))} is given as a Python value, which cannot be sent to other processes; "
            "expected the file that it is in, or jobs=1"
        )
    integrate_there = partial(integrate_remotely, context=context_of(plan))
    return lambda executor, key, columns: executor.submit(integrate_there, key, columns)


def context_of(plan: Plan) -> WorkerContext:
    """What the trajectories of a plan are integrated with elsewhere."""
    plugins = plan.plugins
    return WorkerContext(
        __version__,
        plan.config.solver,
        tuple((source.name, source.content) for source in plugins.sources),
        tuple(plugins.hashes.items()),
    )
