"""Run a plan: a generator of finished ranges of trajectories, which callers store and count.

A range is integrated in this process or in a worker. A worker receives only numbers, names and the source of
plug-ins, and imports no more than it needs.
"""

from __future__ import annotations

import socket
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import asdict, dataclass
from functools import lru_cache

import numpy as np

from .._version import __version__
from ..config.tables import Solver
from ..contact.friction import Pair
from ..contact.frictions import find_friction
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..contact.numba.dispatch import is_installed
from ..contact.records import Record, positions
from ..contact.simulate import simulate
from ..contact.status import STATUS_OK
from ..contact.tangential import simulate_friction
from ..errors import StoreError, UsageError, warn
from .executors import ExecutorSpec
from .plan import Plan
from .run import Run
from .trajectories import Columns, PlanLaw, ReusedPart, TrajectoryRange, keys_of

# how often a range whose process was killed is submitted again
MAX_RETRIES = 3
# seconds between two checks of `should_stop` and of the capacity of the executor
POLL_INTERVAL_S = 0.2

# the results of a range, and a line for each distinct error that the law raised
Integrated = tuple[Record, dict[str, str]]
# the ranges that are being integrated
Running = dict[Future[Integrated], tuple[TrajectoryRange, ReusedPart]]


@dataclass(frozen=True)
class WorkerContext:
    """What a worker needs to integrate ranges of a sweep."""

    version: str
    solver: Solver
    # name and content of the Python files of plug-in models
    sources: tuple[tuple[str, bytes], ...] = ()
    # key and SHA-256 of the models that are not built in
    hashes: tuple[tuple[str, str | None], ...] = ()


def integrate_columns(law: PlanLaw, columns: Columns, solver: Solver) -> Integrated:
    """Integrate trajectories of a law; see `impact.engine.plan.Plan.columns_of`."""
    errors: dict[str, str] = {}
    values = {name: column for name, column in columns.items() if name not in ("n", "status")}
    simulate_law: Callable[..., Record] = simulate_friction if isinstance(law, Pair) else simulate
    return simulate_law(law, columns["n"], values, columns["status"], errors=errors, **asdict(solver)), errors


def integrate_remotely(keys: Sequence[str], columns: Columns, context: WorkerContext) -> Integrated:
    """Integrate trajectories of the law of some keys, in any process, and with the same bits if repeated."""
    model = models_of_context(context)[keys[0]]
    law = Pair(model, find_friction(keys[1])) if len(keys) > 1 else model
    return integrate_columns(law, columns, context.solver)


@lru_cache(maxsize=4)
def models_of_context(context: WorkerContext) -> Mapping[str, ForceModel]:
    """Collect all models of a sweep by key, cached for the most recent sweeps."""
    host = socket.gethostname()
    if context.version != __version__:
        raise UsageError(other_version(host, __version__, context.version))
    if context.solver.core == "numba" and not is_installed():
        raise UsageError(
            f'{host}: has no numba, which this sweep needs; install it there, or set solver.core = "numpy"'
        )
    if not context.hashes:
        return catalogue()
    from .plugins import PythonFile, read_plugins

    plugins = read_plugins([PythonFile(*source) for source in context.sources])
    missing_models = [key for key, sha256 in context.hashes if plugins.hashes.get(key) != sha256]
    if missing_models:
        raise UsageError(f"{host}: {', '.join(missing_models)}: expected their package in the same version")
    return catalogue(plugins.models)


def other_version(location: str, location_version: str, this_version: str) -> str:
    """State that a worker or scheduler has another version."""
    return f"{location}: has impact {location_version}, this is {this_version}; expected the same"


def integrate_ranges(
    plan: Plan, todo: Iterable[TrajectoryRange], run: Run
) -> Iterator[tuple[TrajectoryRange, Record]]:
    """Integrate ranges of trajectories, and yield each when it is finished: in order in this process alone.

    What the plan reuses is not integrated. A killed process gets its ranges again, a few times; a warning states
    each distinct error that a law raised.
    """
    remaining, attempts = deque(todo), Counter[int]()
    reported: set[str] = set()
    with run.executor as spec:
        values = [plugin.model.key for plugin in plan.plugins.items if not (plugin.source or plugin.package)]
        if values and not spec.shares_memory:
            raise UsageError(
                f"{', '.join(values)} is given as a Python value, which cannot be sent to other "
                "processes; expected the file that it is in, or jobs=1"
            )
        while True:
            running: Running = {}
            try:
                with spec.start() as executor:
                    for trajectory_range, (collisions, errors) in _submit_and_collect(
                        plan, spec, executor, remaining, running, run.should_stop
                    ):
                        warn(*(line for error, line in errors.items() if error not in reported))
                        reported |= errors.keys()
                        yield trajectory_range, collisions
                    return
            except BrokenExecutor:
                # it is unknown which of the running ranges killed the worker
                interrupted = [trajectory_range for trajectory_range, _ in running.values()]
                remaining.extendleft(interrupted)
                attempts.update(trajectory_range.number for trajectory_range in interrupted or remaining)
                if max(attempts.values()) > MAX_RETRIES:
                    raise StoreError(
                        f"processes were killed {MAX_RETRIES + 1} times at the same trajectories: too little "
                        'memory, or a script without if __name__ == "__main__":'
                    ) from None


def _submit_and_collect(
    plan: Plan,
    spec: ExecutorSpec,
    executor: Executor,
    remaining: deque[TrajectoryRange],
    running: Running,
    should_stop: Callable[[], bool],
) -> Iterator[tuple[TrajectoryRange, Integrated]]:
    """Submit the remaining ranges, as many at a time as the executor takes, and yield each when it is finished."""
    try:
        while remaining or running:
            # called in every round, even if no range remains: it raises if the workers cannot be reached any more
            limit = spec.capacity()
            while remaining and len(running) < limit and not should_stop():
                trajectory_range, reused = remaining[0], plan.reused(remaining[0])
                if reused[0].all():
                    remaining.popleft()
                    yield trajectory_range, (reused[1], {})
                    continue
                # columns are built here, so that waiting ranges take no memory
                rows, law = positions(~reused[0]), plan.laws[trajectory_range.model]
                columns = {name: values[rows] for name, values in plan.columns_of(trajectory_range).items()}
                if spec.shares_memory:
                    future = executor.submit(integrate_columns, law, columns, plan.solver)
                else:
                    future = executor.submit(integrate_remotely, keys_of(law), columns, context_of(plan))
                running[future] = trajectory_range, reused
                remaining.popleft()
            # ranges already started are finished, unless no worker is left
            if should_stop() and not (running and limit):
                return
            if not running:
                # no worker has joined yet
                time.sleep(POLL_INTERVAL_S if remaining else 0.0)
            for future in wait(running, POLL_INTERVAL_S, FIRST_COMPLETED).done:
                (trajectory_range, (is_reused, reused_part)), integrated = running[future], future.result()
                _check_integrated(trajectory_range, integrated, int(np.count_nonzero(~is_reused)))
                del running[future]
                collisions, errors = integrated
                parts = [(positions(~is_reused), collisions), (np.flatnonzero(is_reused), reused_part)]
                yield trajectory_range, (trajectory_range.record.joined(is_reused.size, STATUS_OK, parts), errors)
    finally:
        for future in running:
            future.cancel()


def _check_integrated(trajectory_range: TrajectoryRange, integrated: object, size: int) -> None:
    """Refuse a return value of an executor that cannot be the results of `size` trajectories."""
    prefix, kind = f"executor: range {trajectory_range.number}", trajectory_range.record
    collisions, errors = integrated if isinstance(integrated, tuple) and len(integrated) == 2 else (integrated, {})
    if not isinstance(collisions, kind):
        raise StoreError(f"{prefix}: got {type(collisions).__name__}, expected {kind.__name__}")
    if not isinstance(errors, dict):
        raise StoreError(f"{prefix}: got {type(errors).__name__}, expected a dict of errors")
    if misfit := collisions.misfit(size):
        raise StoreError(f"{prefix}: {misfit}")
    statuses = [int(status) for status in kind.statuses]
    unknown = np.setdiff1d(collisions.status, statuses)
    if unknown.size:
        raise StoreError(f"{prefix}: status: got {unknown[0]}, expected one of {statuses}")


def context_of(plan: Plan) -> WorkerContext:
    """Collect what workers need to integrate trajectories of a plan."""
    sources = tuple((source.name, source.content) for source in plan.plugins.sources)
    return WorkerContext(__version__, plan.solver, sources, tuple(plan.plugins.hashes.items()))
