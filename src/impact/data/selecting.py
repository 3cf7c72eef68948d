"""Which part of a result is asked for: models by their keys, points by values of the axes."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
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


def places_of(models: Sequence[str], dataset: xr.Dataset) -> list[int]:
    """The places of models along `model`, in the order of their keys; one that is named twice counts once.

    Raises
    ------
    UsageError : a model is not in the result
    """
    known = [str(key) for key in dataset["model"].values]
    for key in models:
        if key not in known:
            raise UsageError(f'no model "{safe_text(key)}" in this result; {did_you_mean(key, known)}')
    return [known.index(key) for key in dict.fromkeys(models)]


def select(dataset: xr.Dataset, sel: Mapping[str, float | str]) -> xr.Dataset:
    """The result at values of axes, or of coordinates along an axis; several along one have to agree.

    Parameters
    ----------
    dataset : a result
    sel : the values, by name; an axis that has its value is none any more

    Raises
    ------
    UsageError : an axis or a value is not in the result
    """
    axes = [str(dim) for dim in dataset.sizes if dim != "model"]
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
