"""What a sweep would take: counted before anything is made, and timed on one block."""

from __future__ import annotations

import time
from dataclasses import dataclass, fields, replace
from typing import Literal

from ..sweeps.blocks import integrated
from ..sweeps.plan import Plan
from ..sweeps.points import boxes
from ..sweeps.run import settled
from ..sweeps.trajectories import Trajectories, block_of, stretches, trajectories
from .assembly import part_at
from .digest import Taken
from .results import outline


@dataclass(frozen=True)
class Collapse:
    """How the points of a model collapse.

    Parameters
    ----------
    model : its key
    points, cells, trajectories : of the grid; of the product of the axes that its values come from; integrated
    axes : those axes
    within : where equal values are found: over the whole "plan", within a "block" only, or "not" at all
    """

    model: str
    points: int
    cells: int
    trajectories: int
    axes: tuple[str, ...]
    within: Literal["plan", "block", "not"]


@dataclass(frozen=True)
class Estimate:
    """What a sweep would take: bytes of the result before it is packed, and of what is kept while it runs.

    The writing to the disk comes on top of the seconds. `core` is what would integrate.
    """

    points: int
    trajectories: int
    models: tuple[Collapse, ...]
    bytes: int
    kept: int
    seconds: float
    core: str


def estimate(plan: Plan, jobs: int = 1) -> Estimate:
    """Count a sweep, and time one block of its trajectories and one box of its points.

    Parameters
    ----------
    plan : the sweep
    jobs : processes or threads that integrate
    """
    found = trajectories(plan)
    plan = settled(plan, found)
    total = sum(one.count for one in found)
    blocks = list(stretches(found))
    # one in the middle is neither the first values nor the last
    chosen = blocks[len(blocks) // 2]
    # the first time loads, or even compiles, what integrates
    for _ in range(2):
        begun = time.perf_counter()
        rebound = integrated(plan.models[chosen.model], block_of(plan, found, chosen), plan.config.solver)
        seconds = (time.perf_counter() - begun) / chosen.size * total / jobs
    # what became of the trajectories of a box does not matter for its time: those of the block, again and again
    box = replace(next(boxes(1, plan.shape)), model=chosen.model)
    begun = time.perf_counter()
    part = part_at(plan, found, lambda _, numbers: rebound.take(numbers % chosen.size), box)
    for values in part.values.values():
        Taken().add(values)
    seconds += (time.perf_counter() - begun) / box.size * plan.points
    kept = total * sum(getattr(rebound, one.name).itemsize for one in fields(rebound))
    models = tuple(_collapse(plan, one) for one in found)
    return Estimate(plan.points, total, models, outline(plan).nbytes, kept, seconds, plan.config.solver.core)


def _collapse(plan: Plan, own: Trajectories) -> Collapse:
    axes = tuple(plan.config.axes[axis].name for axis in own.axes)
    within: Literal["plan", "block", "not"] = "block" if own.first is None else "plan"
    if not plan.config.solver.collapse:
        within = "not"
    return Collapse(plan.models[own.model].key, plan.grid, own.cells, own.count, axes, within)
