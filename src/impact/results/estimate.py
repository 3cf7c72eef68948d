"""Estimate the size and duration of a sweep: count trajectories, and time one range and one slab."""

from __future__ import annotations

import hashlib
import io
import pickle
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..arguments import require_counts
from ..config.grid import MAX_POINTS
from ..contact.model import ForceModel
from ..display import Block, Displayed, Table, Wrapped
from ..engine.checkpoint import write_range
from ..engine.execute import context_of, integrate_columns
from ..engine.plan import Plan
from ..engine.run import Run
from ..engine.trajectories import RANGE_TRAJECTORIES, TrajectoryMap, keys_of
from ..errors import warn
from ..formatting import law_name
from .layouts import file_template
from .schema import dataset_template, stored_variables
from .sweep import check_storable, read_plan
from .trajectory_table import expanded_slabs, table_of_ranges

# numbers of workers for which the time is estimated
WORKER_COUNTS = (1, 2, 8, 32, 128, 512)
# the time of the driver for a range on a remote worker over the time that is measured by `estimate`: the rest is
# spent in dask, see scripts/bench_scaling.py
DASK_OVERHEAD = 2.0

# where equal points are searched for
Scope = Literal["plan", "block", "not"]
# why equal points are not searched for in the whole grid
NOT_IN_PLAN = {
    "block": "too many cells to compare all, equal points are searched for within a block",
    "not": "every point is integrated (solver.collapse = false)",
}


@dataclass(frozen=True)
class ModelCounts:
    """The points and the distinct trajectories of a model.

    Parameters
    ----------
    model : its key
    points : number of points of the model
    cells : number of cells of the axes that the trajectories depend on
    trajectories : number of distinct trajectories, which are integrated
    axes : the axes that the trajectories depend on
    within : scope of deduplication: "plan", "block", or "not" without deduplication
    """

    model: str
    points: int
    cells: int
    trajectories: int
    axes: tuple[str, ...]
    within: Scope

    @property
    def row(self) -> tuple[str, ...]:
        """The model in a table, and why equal points are not searched for in the whole grid."""
        axes = f"depends on {', '.join(self.axes)}" if self.axes else "depends on no axis"
        scope = f"{axes}; {NOT_IN_PLAN[self.within]}" if self.within in NOT_IN_PLAN else axes
        return (self.model, f"{self.points:,}", f"{self.cells:,}", f"{self.trajectories:,}", scope)


@dataclass(frozen=True)
class Estimate(Displayed):
    """The size and the duration of a sweep.

    Parameters
    ----------
    points, trajectories : numbers of all models together
    models : the numbers of each model
    bytes : of the result before compression
    kept : bytes of the work folder
    seconds : without the time of the disk
    core : the core that would integrate
    wire : bytes that are sent to remote workers and back
    by_workers : seconds by number of remote workers; the last number is the largest that helps, since then the
        driver is busy all the time
    """

    points: int
    trajectories: int
    models: tuple[ModelCounts, ...]
    bytes: int
    kept: int
    seconds: float
    core: str
    wire: int
    by_workers: dict[int, float]

    def as_dict(self) -> dict[str, Any]:
        """The estimate as plain data."""
        return asdict(self)

    def records(self) -> Sequence[Mapping[str, Any]]:
        """The numbers of each model."""
        return [asdict(counts) for counts in self.models]

    def sections(self, width: int) -> Iterator[Block]:
        """The points and trajectories of each model, and the size and the time of all together."""
        headings = ("model", "points", "cells", "trajectories", "how the points collapse")
        yield Table([counts.row for counts in self.models], headings, text=(0, -1))
        yield Wrapped(
            f"{self.points:,} points from {self.trajectories:,} trajectories, {self.bytes:,} bytes (and "
            f"{self.kept:,} while it runs), {_duration(self.seconds)} by {self.core} and what the disk takes; "
            "nothing was written"
        )

    @property
    def workers_line(self) -> str:
        """The time by the number of remote workers."""
        *few, most = (f"{_duration(seconds)} by {count:,}" for count, seconds in self.by_workers.items())
        times = "; ".join([*few, f"{most} workers, the most that can be kept busy"])
        return f"dask workers: {times}; {self.wire:,} bytes are sent to them and back"


def _duration(seconds: float) -> str:
    """Write a time in words.

    >>> _duration(0.2), _duration(7), _duration(7500)
    ('under a second', 'about 0:00:07', 'about 2:05:00')
    """
    return "under a second" if seconds < 1.0 else f"about {timedelta(seconds=round(seconds))}"


def estimate(
    source: str | Path | Mapping[str, object],
    *,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    jobs: int = 1,
    max_points: int = MAX_POINTS,
    on_note: Callable[[str], None] | None = None,
) -> Estimate:
    """Count the points and trajectories of a sweep, and estimate its size and time; nothing is written.

    Parameters
    ----------
    source, overrides, plugins, max_points : see `sweep`
    jobs : number of processes or threads that integrate
    on_note : called with a sentence about each implausible value; by default an `ImpactWarning`

    Returns
    -------
    Estimate : counts of points and trajectories, bytes and seconds

    Raises
    ------
    ConfigError, UsageError, ModelError : see `sweep`

    >>> import impact
    >>> impact.estimate("configs/figure6.toml").points
    303
    """
    require_counts(jobs=jobs)
    plan = read_plan(source, overrides, plugins, Run(max_points=max_points, on_note=on_note or warn))
    check_storable(plan)
    # one of the largest ranges, as a few trajectories take as long as many; the middle one avoids extreme values
    largest = max(block.size for block in plan.ranges)
    whole = [block for block in plan.ranges if block.size == largest]
    chosen = whole[len(whole) // 2]
    law = plan.laws[chosen.model]
    # the first run loads or compiles the core
    for _ in range(2):
        begun = time.perf_counter()
        collisions, _ = integrate_columns(law, plan.columns_of(chosen), plan.solver)
    integrated = time.perf_counter()
    sent = len(pickle.dumps((plan.columns_of(chosen), context_of(plan)), pickle.HIGHEST_PROTOCOL))
    back = pickle.dumps(collisions, pickle.HIGHEST_PROTOCOL)
    pickle.loads(back)
    write_range(io.BytesIO(), "", collisions)
    driven = time.perf_counter()
    # the time of a slab does not depend on the values of its trajectories: repeat those of the range
    positions = np.arange(RANGE_TRAJECTORIES) % chosen.size
    blank = {number: trajectory_map.record.blank(chosen.size) for number, trajectory_map in enumerate(plan.maps)}
    blank[chosen.model] = collisions
    table = table_of_ranges(plan, lambda block: blank[block.model].take(positions[: block.size]))
    prepared = time.perf_counter()
    values = next(expanded_slabs(table, stored_variables(plan))).values
    for array in values.values():
        hashlib.sha256(array.tobytes())
    seconds_per_point = (time.perf_counter() - prepared) / values["status"].size
    each = (integrated - begun) / chosen.size
    seconds_per_trajectory_of_driver = DASK_OVERHEAD * (driven - integrated) / chosen.size
    writing_seconds = seconds_per_point * plan.stored_points if plan.layout == "full" else 0.0
    busy = min(max(round(each / seconds_per_trajectory_of_driver), 1), len(plan.ranges))
    work_folder_bytes = sum(
        trajectory_map.count * trajectory_map.record.row_bytes() for trajectory_map in plan.maps
    )
    counts = [*(count for count in WORKER_COUNTS if count < busy), busy]
    return Estimate(
        plan.points,
        plan.trajectories,
        tuple(_model_counts(plan, trajectory_map) for trajectory_map in plan.maps),
        file_template(dataset_template(plan), plan, table).nbytes,
        work_folder_bytes,
        each * plan.trajectories / jobs + writing_seconds,
        plan.solver.core,
        round((sent + len(back)) / chosen.size * plan.trajectories),
        {
            count: max(each / count, seconds_per_trajectory_of_driver) * plan.trajectories + writing_seconds
            for count in counts
        },
    )


def _model_counts(plan: Plan, trajectory_map: TrajectoryMap) -> ModelCounts:
    axes = tuple(plan.config.axes[axis].name for axis in trajectory_map.axes)
    keys = keys_of(plan.laws[trajectory_map.model])
    points, cells, trajectories = plan.inputs.points_of(*keys), trajectory_map.cells, trajectory_map.count
    within: Scope = "plan" if trajectory_map.is_shared else "block" if plan.config.solver.collapse else "not"
    return ModelCounts(law_name(*keys), points, cells, trajectories, axes, within)
