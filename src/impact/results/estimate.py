"""What a sweep would take: counted before anything is made, and timed on one block."""

from __future__ import annotations

import io
import pickle
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from typing import Literal

from ..engine.blocks import integrated
from ..engine.execute import kit_of, settled
from ..engine.packing import pack
from ..engine.plan import Plan
from ..engine.points import boxes
from ..engine.trajectories import Trajectories, block_of, stretches, trajectories
from .assembly import part_at
from .digest import Taken
from .schema import outline

# numbers of workers of which the time is told
WORKERS = (1, 2, 8, 32, 128, 512)
# what the driver does for a block that goes elsewhere is about so many times what is timed here: the rest is that
# of dask, as scripts/bench_scaling.py measures it
DASK = 2.0


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

    The writing to the disk comes on top of the seconds. `core` is what would integrate; `wire` are the bytes that
    go to workers elsewhere and come back, `by_workers` the seconds with some of them; the last number is the
    largest that is of use, because then the driver is busy.
    """

    points: int
    trajectories: int
    models: tuple[Collapse, ...]
    bytes: int
    kept: int
    seconds: float
    core: str
    wire: int
    by_workers: dict[int, float]


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
        with _timed() as integrating:
            rebound, _ = integrated(plan.models[chosen.model], block_of(plan, found, chosen), plan.config.solver)
    with _timed() as driving:
        sent = len(pickle.dumps((block_of(plan, found, chosen), kit_of(plan)), pickle.HIGHEST_PROTOCOL))
        back = pickle.dumps(rebound, pickle.HIGHEST_PROTOCOL)
        pickle.loads(back)
        pack(io.BytesIO(), "", rebound)
    # what became of the trajectories of a box does not matter for its time: those of the block, again and again
    box = replace(next(boxes(1, plan.shape)), model=chosen.model)
    with _timed() as assembling:
        part = part_at(plan, found, lambda _, numbers: rebound.take(numbers % chosen.size), box)
        for values in part.values.values():
            Taken().add(values)
    each, own = integrating() / chosen.size, DASK * driving() / chosen.size
    after = assembling() / box.size * plan.points
    busy = min(max(round(each / own), 1), len(blocks))
    counts = [*(count for count in WORKERS if count < busy), busy]
    return Estimate(
        plan.points,
        total,
        tuple(_collapse(plan, one) for one in found),
        outline(plan).nbytes,
        total * sum(getattr(rebound, one.name).itemsize for one in fields(rebound)),
        each * total / jobs + after,
        plan.config.solver.core,
        round((sent + len(back)) / chosen.size * total),
        {count: max(each / count, own) * total + after for count in counts},
    )


@contextmanager
def _timed() -> Iterator[Callable[[], float]]:
    """How many seconds it took, when it is over."""
    begun = time.perf_counter()
    ended = begun
    yield lambda: ended - begun
    ended = time.perf_counter()


def _collapse(plan: Plan, own: Trajectories) -> Collapse:
    axes = tuple(plan.config.axes[axis].name for axis in own.axes)
    within: Literal["plan", "block", "not"] = "block" if own.first is None else "plan"
    if not plan.config.solver.collapse:
        within = "not"
    return Collapse(plan.models[own.model].key, plan.grid, own.cells, own.count, axes, within)
