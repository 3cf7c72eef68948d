"""Which part of a result a picture shows: one axis to draw over, a value for every other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..errors import UsageError, did_you_mean
from ..results.select import places_of, select
from ..text import safe_text

if TYPE_CHECKING:
    import xarray as xr


# numbers of a picture: enough for any that can be looked at, few enough to be held one by one
MAX_DRAWN = 2**24


def take_slice(
    dataset: xr.Dataset,
    x: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
) -> tuple[xr.Dataset, str]:
    """Cut a line through a result: the dataset along it, of which nothing is read yet, and what to draw over.

    Parameters
    ----------
    dataset : a result
    x : the coordinate to draw over; by default e, else the first numeric axis
    sel : values of other axes, by name; an axis that is not named shows its first value
    models : keys of the models to show; by default all

    Raises
    ------
    UsageError : an axis, a value or a model is not in the result
    """
    if models:
        dataset = dataset.isel(model=places_of(models, dataset))
    dataset = select(dataset, sel or {})
    x = x_axis(dataset, x)
    (along,) = dataset[x].dims
    others = [dim for dim in dataset.sizes if dim not in ("model", along)]
    return dataset.isel(dict.fromkeys(others, 0)), x


def sorted_along(dataset: xr.Dataset, name: str) -> xr.Dataset:
    """The part of a result at the finite values of a coordinate along one axis, in their order.

    A wall, or a plane, has no place on an axis.
    """
    values = dataset[name].values
    order = np.argsort(values, kind="stable")
    order = order[np.isfinite(values[order])]
    # a file is read in one go where nothing is left out or moved
    in_order = np.array_equal(order, np.arange(values.size))
    return dataset if in_order else dataset.isel({dataset[name].dims[0]: order})


def read(data: xr.Dataset, names: Sequence[str]) -> xr.Dataset:
    """Some variables of a slice or a plane, in memory, with the coordinates.

    Raises
    ------
    UsageError : they are more than a picture shows
    """
    numbers = sum(data[name].size for name in names)
    if numbers > MAX_DRAWN:
        raise UsageError(
            f"got {numbers:,} numbers to draw, expected at most {MAX_DRAWN:,}; take a shorter axis or fewer models"
        )
    return data.assign({name: data[name].compute() for name in names})


def x_axis(dataset: xr.Dataset, x: str | None) -> str:
    lines = [
        str(name) for name, coord in dataset.coords.items()
        if coord.ndim == 1 and coord.dims != ("model",) and coord.dtype.kind == "f"
    ]  # fmt: skip
    if x is not None:
        if x not in lines:
            if x in dataset.coords and dataset[x].ndim > 1:
                dims = ", ".join(str(dim) for dim in dataset[x].dims)
                raise UsageError(
                    f"cannot draw over {safe_text(x)}, which varies over {dims}; select one with --sel"
                )
            raise UsageError(f'cannot draw over "{safe_text(x)}"; {did_you_mean(x, lines)}')
        return x
    for name in ("e", *(dim for dim in dataset.sizes if dim in lines), *lines):
        if name in lines:
            return str(name)
    raise UsageError("this result has no numeric axis left to draw over; sweep one, such as e")
