"""Assembly: the finished trajectories of a plan become the values of its result, box after box."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..contact.strike import Rebound
from ..engine.finished import Finished
from ..engine.plan import Plan
from ..engine.points import Box, Rows, boxes, contact_at
from ..engine.trajectories import Stretch, Trajectories, stretches
from .digest import content_digest
from .schema import outline, stored


@dataclass(frozen=True)
class Part:
    """The values of some points of one model, by variable, each of the box's shape.

    What depends on the axes alone is there once, with the first model. `radius` is that of the smaller ball [m],
    NaN where it is not known, of a shape that broadcasts to the box's.
    """

    box: Box
    values: dict[str, NDArray[Any]]
    radius: NDArray[Any] | None = None

    def where(self, along_model: bool) -> tuple[int | slice, ...]:
        """The place of the values in the whole of a variable."""
        return (self.box.model, *self.box.where) if along_model else self.box.where


def parts(
    plan: Plan, found: Sequence[Trajectories], rows: Rows, of: Iterable[Box] | None = None
) -> Iterator[Part]:
    """The values of a plan, box after box.

    Parameters
    ----------
    plan : the plan
    found : its trajectories
    rows : what became of them
    of : the boxes; by default all in C order
    """
    for box in boxes(len(plan.models), plan.shape) if of is None else of:
        yield part_at(plan, found, rows, box)


def parts_as_finished(
    plan: Plan, found: Sequence[Trajectories], finished: Iterable[tuple[Stretch, Rebound]]
) -> Iterator[Part]:
    """The values of a plan while its blocks are finished: those of a model when all of its blocks are.

    Parameters
    ----------
    plan : the plan
    found : its trajectories
    finished : all its blocks, in any order; between two of them no more than one box is made, so that no process
        waits for its next, and the blocks of a model are let go with its last box
    """
    left = Counter(stretch.model for stretch in stretches(found))
    todo = {model: deque(of) for model, of in groupby(boxes(len(plan.models), plan.shape), lambda one: one.model)}
    whole = [model for model in todo if not left[model]]
    held: dict[int, Rebound] = {}
    rows = Finished(found, held.__getitem__).rows

    def next_part() -> Part:
        model = whole[0]
        part = part_at(plan, found, rows, todo[model].popleft())
        if not todo[model]:
            whole.remove(model)
            for stretch in stretches(found):
                if stretch.model == model:
                    del held[stretch.number]
        return part

    for stretch, rebound in finished:
        held[stretch.number] = rebound
        left[stretch.model] -= 1
        if not left[stretch.model]:
            whole.append(stretch.model)
        if whole:
            yield next_part()
    while whole:
        yield next_part()


def part_at(plan: Plan, found: Sequence[Trajectories], rows: Rows, box: Box) -> Part:
    """The values of one box."""
    contact = contact_at(plan, found, rows, box)
    values = {}
    for one in stored(plan):
        if one.per == "model" or box.model == 0:
            values[one.name] = np.empty(box.shape, one.dtype)
            # of a plan without axes the only point has an axis
            natural = getattr(contact, one.name)
            values[one.name][...] = natural if box.shape else natural.reshape(())
    return Part(box, values, np.fmin(contact.lanes.R1, contact.lanes.R2))


def assemble(plan: Plan, made: Iterator[Part]) -> xr.Dataset:
    """The dataset of a plan, in memory, from the parts of it in any order."""
    dataset = outline(plan)
    arrays = {str(name): np.empty(one.shape, one.dtype) for name, one in dataset.data_vars.items()}
    for part in made:
        for name, values in part.values.items():
            arrays[name][part.where("model" in dataset[name].dims)] = values
    dataset = dataset.assign({name: dataset[name].copy(data=array) for name, array in arrays.items()})
    for dim in map(str, dataset.dims):
        dataset = dataset.set_xindex(dim)
    dataset.attrs["content_digest"] = content_digest(dataset)
    return dataset
