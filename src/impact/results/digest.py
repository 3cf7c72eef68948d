"""The content digest: what a result holds, in one number that any change of it changes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

# attributes that may differ between installations that compute the same; the digest cannot contain itself
NOT_DIGESTED = ("content_digest", "packages")


def content_digest(dataset: xr.Dataset, taken: Mapping[str, str] | None = None) -> str:
    """SHA-256 over names, dimensions, values and attributes of all variables and coordinates, in canonical form.

    Numbers as little-endian bytes with one NaN, text as UTF-8; the order of the variables does not count, nor do
    the versions of the packages.

    Parameters
    ----------
    dataset : what is digested
    taken : by name, the digests of values that were taken before, by `Taken`; those in the dataset do not count
    """
    own = {str(name): value for name, value in dataset.attrs.items() if name not in NOT_DIGESTED}
    total = hashlib.sha256(_canonical(own))
    for name in sorted(str(name) for name in dataset.variables):
        variable = dataset.variables[name]
        kind = _kind(variable.dtype)
        if taken and name in taken:
            one = taken[name]
        elif kind == "text":
            one = hashlib.sha256(json.dumps(np.asarray(variable.values, object).tolist()).encode()).hexdigest()
        else:
            one = Taken().add(variable.values).hexdigest()
        total.update(_canonical([name, list(variable.dims), list(variable.shape), kind, one]))
        total.update(_canonical({str(key): value for key, value in variable.attrs.items()}))
    return total.hexdigest()


class Taken:
    """The digest of the values of a variable, taken part after part in C order."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()

    def add(self, values: NDArray[Any]) -> Taken:
        if values.dtype.kind == "f" and np.isnan(values).any():
            # there are many that are not a number
            values = np.where(np.isnan(values), np.asarray(np.nan, values.dtype), values)
        self._hash.update(np.ascontiguousarray(values, dtype=_kind(values.dtype)).data)
        return self

    def hexdigest(self) -> str:
        return self._hash.hexdigest()


def _kind(dtype: np.dtype[Any]) -> str:
    return dtype.newbyteorder("<").str if dtype.kind in "fiub" else "text"


def _canonical(value: object) -> bytes:
    """JSON in which an array of one is its element, as netCDF has it."""

    def plain(one: object) -> object:
        if isinstance(one, dict):
            return {key: plain(inner) for key, inner in one.items()}
        array = np.asarray(one)
        return array.item() if array.size == 1 else array.tolist()

    found = value if isinstance(value, list) else plain(value)
    return json.dumps(found, sort_keys=True).encode()
