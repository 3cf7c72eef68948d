"""Which part of a result a picture shows: one axis to draw over, a value for every other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import UsageError, did_you_mean
from ..text import safe_text

if TYPE_CHECKING:
    import xarray as xr

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
        dataset = dataset.sel(model=list(models))
    axes = [str(dim) for dim in dataset.sizes if dim != "model"]
    for name, value in (sel or {}).items():
        dataset = _select(dataset, name, value, axes)
    x = _x_axis(dataset, x)
    (along,) = dataset[x].dims
    others = [dim for dim in dataset.sizes if dim not in ("model", along)]
    dataset = dataset.isel(dict.fromkeys(others, 0))
    fixed = {name: dataset[name].values.item() for name in axes if name != along}
    return Slice(dataset, x, fixed)


def _select(dataset: xr.Dataset, name: str, value: float | str, axes: list[str]) -> xr.Dataset:
    """The dataset at one value of an axis, or of a coordinate along an axis."""
    if name not in dataset.coords or len(dataset[name].dims) != 1 or name == "model":
        if name in axes:
            raise UsageError(f"{safe_text(name)}: given twice")
        raise UsageError(f'no axis "{safe_text(name)}" in this result; {did_you_mean(name, axes)}')
    (dim,) = dataset[name].dims
    values = dataset[name].values
    if values.dtype.kind == "f":
        number = _number(value)
        same = np.isclose(values, np.nan if number is None else number, rtol=SAME, atol=0.0)
    else:
        same = values.astype(str) == str(value)
    if not same.any():
        shown = ", ".join(
            f"{one:g}" if values.dtype.kind == "f" else safe_text(str(one), 40) for one in values[:8]
        )
        more = ", ..." if values.size > 8 else ""
        raise UsageError(f"no {safe_text(name)} = {safe_text(str(value))} in this result; it has {shown}{more}")
    return dataset.isel({dim: int(np.argmax(same))})


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
            raise UsageError(f'cannot draw over "{safe_text(x)}"; {did_you_mean(x, lines)}')
        return x
    for name in ("e", *(dim for dim in dataset.sizes if dim in lines), *lines):
        if name in lines:
            return str(name)
    raise UsageError("this result has no numeric axis left to draw over; sweep one, such as e")
