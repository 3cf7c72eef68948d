"""A result as netCDF-4 in HDF5: its outline, and its values part after part."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import h5netcdf
import h5py
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..atomic import Sink
from ..sweeps.config import Output

Where = tuple[int | slice, ...]
Put = Callable[[str, Where, NDArray[Any]], None]
# values of a piece of a compressed variable, where none is asked for
PIECE = 2**16


@contextmanager
def writing(sink: Sink, outline: xr.Dataset, output: Output) -> Iterator[tuple[Put, Callable[[str], None]]]:
    """Write a dataset into a sink: its coordinates and attributes at once, its variables as they come.

    Parameters
    ----------
    sink : the file
    outline : the dataset; the values of its variables do not count
    output : how it is stored

    Yields
    ------
    (put, seal) : functions that write the values of a variable at a place, and the content digest
    """
    # variables in the order in which they are made
    with h5py.File(sink, "w", track_order=True) as plain, h5netcdf.File(plain, "w") as file:
        file.dimensions = {str(name): size for name, size in outline.sizes.items()}
        coordinates = [str(name) for name in outline.coords if name not in outline.dims]
        for name, one in outline.coords.items():
            text = one.dtype.kind not in "fiu"
            values = np.asarray(one.values, object) if text else one.values
            kind = h5py.string_dtype() if text else one.dtype
            _describe(file.create_variable(str(name), one.dims, kind, data=values), one.attrs)
        for name, one in outline.data_vars.items():
            added = file.create_variable(str(name), one.dims, one.dtype, **_storage(outline, str(name), output))
            about = [other for other in coordinates if set(outline[other].dims) <= set(one.dims)]
            _describe(added, {**one.attrs, "coordinates": " ".join(about)})
        _describe(file, {name: value for name, value in outline.attrs.items() if name != "content_digest"})
        sink.check()

        # written to by h5py itself, which asks less each time
        made = {str(name): plain[str(name)] for name in outline.data_vars}

        def put(name: str, where: Where, values: NDArray[Any]) -> None:
            made[name][where or ...] = values
            sink.check()

        yield put, lambda digest: _describe(file, {"content_digest": digest})
    sink.check()


def _describe(holder: Any, attributes: dict[Any, Any]) -> None:
    """Attributes, those of text as so many bytes, a number that a reader knows beforehand."""
    for name, value in attributes.items():
        if isinstance(value, str):
            written = value.encode()
            value = np.array(written, h5py.string_dtype("utf-8", max(len(written), 1)))
        holder.attrs[str(name)] = value


def _storage(outline: xr.Dataset, name: str, output: Output) -> dict[str, Any]:
    """How a variable is stored: in one piece unless it is compressed, or pieces are asked for."""
    one = outline[name]
    if not one.ndim or (output.compression == "none" and not output.chunks):
        return {}
    if output.chunks:
        lengths = {"model": 1, **output.chunks}
        chunks = tuple(min(lengths.get(str(dim), size), size) for dim, size in one.sizes.items())
    else:
        # whole along the last axes, one place along the first
        chunks, room = (), PIECE
        for dim, size in reversed(list(one.sizes.items())):
            length = 1 if dim == "model" else max(min(size, room), 1)
            chunks = (length, *chunks)
            room //= size
    packed = (
        {"compression": "gzip", "compression_opts": 4, "shuffle": True} if output.compression == "gzip" else {}
    )
    return {"chunks": chunks, **packed}
