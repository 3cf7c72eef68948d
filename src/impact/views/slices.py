"""Which part of a result a picture shows: one axis to draw over, a value for every other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import UsageError, did_you_mean
from ..results.select import places_of, select
from ..text import safe_text

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Slice:
    """One line through a result: the dataset along it, the coordinate drawn over, and the values of the rest."""

    dataset: xr.Dataset
    x: str
    fixed: Mapping[str, float | str]


def take_slice(
    dataset: xr.Dataset,
    x: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
) -> Slice:
    """Cut a line through a result.

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
    axes = [str(dim) for dim in dataset.sizes if dim != "model"]
    dataset = select(dataset, sel or {})
    x = x_axis(dataset, x)
    (along,) = dataset[x].dims
    others = [dim for dim in dataset.sizes if dim not in ("model", along)]
    dataset = dataset.isel(dict.fromkeys(others, 0))
    fixed = {name: dataset[name].values.item() for name in axes if name != along}
    return Slice(dataset, x, fixed)


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
