"""The content digest: what a result holds, in one number that any change of it changes."""

from __future__ import annotations

import hashlib
import json

import numpy as np
import xarray as xr

# attributes that may differ between installations that compute the same; the digest cannot contain itself
NOT_DIGESTED = ("content_digest", "packages")


def content_digest(dataset: xr.Dataset) -> str:
    """SHA-256 over names, dimensions, values and attributes of all variables and coordinates, in canonical form.

    Numbers as little-endian bytes with one NaN, text as UTF-8; the order of the variables does not count, nor do
    the versions of the packages.
    """
    own = {str(name): value for name, value in dataset.attrs.items() if name not in NOT_DIGESTED}
    total = hashlib.sha256(_canonical(own))
    for name in sorted(str(name) for name in dataset.variables):
        variable = dataset.variables[name]
        values = variable.values
        if values.dtype.kind in "fiub":
            kind = values.dtype.newbyteorder("<").str
            if values.dtype.kind == "f":
                values = np.where(np.isnan(values), np.nan, values)
            data = np.ascontiguousarray(values, dtype=kind).tobytes()
        else:
            kind = "text"
            data = json.dumps(np.asarray(values, object).tolist()).encode()
        one = hashlib.sha256(data).hexdigest()
        total.update(_canonical([name, list(variable.dims), list(variable.shape), kind, one]))
        total.update(_canonical({str(key): value for key, value in variable.attrs.items()}))
    return total.hexdigest()


def _canonical(value: object) -> bytes:
    """JSON in which an array of one is its element, as netCDF has it."""

    def plain(one: object) -> object:
        if isinstance(one, dict):
            return {key: plain(inner) for key, inner in one.items()}
        array = np.asarray(one)
        return array.item() if array.size == 1 else array.tolist()

    found = value if isinstance(value, list) else plain(value)
    return json.dumps(found, sort_keys=True).encode()
