"""A result from a file that was looked at: what was found there is read, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, BinaryIO

import h5py
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .guard import NETCDF, is_in_pieces
from .heap import labels, texts
from .names import is_quantity
from .pieces import count, find, read_pieces


def read(
    file: h5py.File, stream: BinaryIO, axes: Mapping[str, tuple[str, ...]], *, outline: bool = False
) -> xr.Dataset:
    """The dataset in a file.

    Numbers are as they are stored, whatever an attribute says of scales, fill values and times.

    Parameters
    ----------
    file, stream : the file, and its bytes
    axes : the names to read, each with its axes
    outline : leave the values of what was computed, which then are ones, of no memory
    """
    data = {name: file[name] for name in axes}
    found = {name: labels(stream, one.id.get_offset(), one.id.get_storage_size())
             for name, one in data.items() if one.dtype.kind == "O"}  # fmt: skip
    packed = {name: count(one.id) for name, one in data.items() if not outline and is_in_pieces(one.id)}
    pieces = find(file.filename, packed)
    given = [name for name in axes if not is_quantity(name, axes[name])]

    def numbers(name: str, one: h5py.Dataset) -> NDArray[Any]:
        skipped = outline and name not in given
        if skipped:
            return np.broadcast_to(np.ones((), one.dtype), one.shape)
        return read_pieces(one.id, stream, pieces[name]) if name in pieces else np.asarray(one[()])

    values = {name: np.array(words).reshape(data[name].shape) for name, words in texts(stream, found).items()}
    variables = {
        name: xr.Variable(axes[name], values[name] if name in values else numbers(name, one), _attributes(one))
        for name, one in data.items()
    }
    return xr.Dataset(variables, attrs=_attributes(file)).set_coords(given)


def _attributes(holder: h5py.File | h5py.Dataset) -> dict[str, object]:
    """Attributes as they were before they were stored."""
    found: dict[str, object] = {}
    for name in holder.attrs:
        if name not in NETCDF:
            value = holder.attrs[name]
            array = np.ravel(value)
            found[name] = value.decode() if isinstance(value, bytes) else array[0] if array.size == 1 else value
    return found
