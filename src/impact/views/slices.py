"""Which part of a result a picture shows: one axis to draw over, a value for every other."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError, did_you_mean
from ..text import safe_text

if TYPE_CHECKING:
    import xarray as xr

Mask = NDArray[np.bool_]

# a value given by hand matches one that was computed when it differs by rounding only
SAME = 1e-9


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
        known = [str(key) for key in dataset["model"].values]
        for key in models:
            if key not in known:
                raise UsageError(f'no model "{safe_text(key)}" in this result; {did_you_mean(key, known)}')
        dataset = dataset.sel(model=list(dict.fromkeys(models)))
    axes = [str(dim) for dim in dataset.sizes if dim != "model"]
    dataset = _select(dataset, sel or {}, axes)
    x = _x_axis(dataset, x)
    (along,) = dataset[x].dims
    others = [dim for dim in dataset.sizes if dim not in ("model", along)]
    dataset = dataset.isel(dict.fromkeys(others, 0))
    fixed = {name: dataset[name].values.item() for name in axes if name != along}
    return Slice(dataset, x, fixed)


def _select(dataset: xr.Dataset, sel: Mapping[str, float | str], axes: list[str]) -> xr.Dataset:
    """The dataset at values of axes, or of coordinates along an axis; several along one have to agree."""
    masks: dict[Hashable, Mask] = {}
    for name, value in sel.items():
        if name not in dataset.coords or len(dataset[name].dims) != 1 or dataset[name].dims == ("model",):
            raise UsageError(f'no axis "{safe_text(name)}" in this result; {did_you_mean(name, axes)}')
        (dim,) = dataset[name].dims
        values = dataset[name].values
        same = _same(values, value)
        if dim in masks and same.any():
            same &= masks[dim]
        if not same.any():
            shown = ", ".join(f"{one:g}" if values.dtype.kind == "f" else str(one) for one in values[:8].tolist())
            has = safe_text(shown + (", ..." if values.size > 8 else ""))
            raise UsageError(f"no {safe_text(f'{name} = {value}')} in this result; {safe_text(name)} is {has}")
        masks[dim] = same
    return dataset.isel({dim: int(np.argmax(same)) for dim, same in masks.items()})


def _same(values: np.ndarray, value: float | str) -> Mask:
    """Which values are the one asked for."""
    if values.dtype.kind != "f":
        return np.asarray(values.astype(str) == str(value))
    number = _number(value)
    return np.asarray(np.isclose(values, np.nan if number is None else number, rtol=SAME, atol=0.0))


def _number(value: float | str) -> float | None:
    try:
        return float(value)
    except ValueError:
        return None


def _x_axis(dataset: xr.Dataset, x: str | None) -> str:
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
