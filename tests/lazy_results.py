"""Lazy results of any size whose values are computed when they are read, and a record of the reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

Values = NDArray[Any]
# numbers in a read: many times a slab, and little memory
MAX_READ = 2**22


@dataclass
class Reads:
    """Numbers read of each variable: in total and in the largest read."""

    total: dict[str, int] = field(default_factory=dict)
    largest: dict[str, int] = field(default_factory=dict)

    def add(self, name: str, size: int) -> None:
        assert size <= MAX_READ, f"got a read of {size:,} numbers of {name}, expected at most {MAX_READ:,}"
        self.total[name] = self.total.get(name, 0) + size
        self.largest[name] = max(self.largest.get(name, 0), size)

    def clear(self) -> None:
        self.total.clear()
        self.largest.clear()


class Computed(BackendArray):
    """A function of the indices along each axis, passed as arrays that broadcast."""

    def __init__(
        self, name: str, shape: tuple[int, ...], dtype: np.dtype[Any], values: Callable[..., Values], reads: Reads
    ) -> None:
        self.name, self.shape, self.dtype, self.values, self.reads = name, shape, dtype, values, reads

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Values:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._read)

    def _read(self, key: tuple[int | slice | Values, ...]) -> Values:
        indices = [np.arange(size)[part] for size, part in zip(self.shape, key, strict=True)]
        shape = tuple(part.size for part in indices)
        self.reads.add(self.name, prod(shape))
        values = np.broadcast_to(self.values(*np.ix_(*map(np.atleast_1d, indices))), shape)
        return np.array(values.reshape([part.size for part in indices if part.ndim]), self.dtype)


def computed(
    name: str,
    sizes: Mapping[str, int],
    values: Callable[..., Values],
    reads: Reads,
    *,
    dtype: np.dtype[Any],
    varies_along: Mapping[str, Sequence[str]] | None,
    attrs: Mapping[str, Any],
) -> xr.Variable:
    """A computed variable; without `varies_along` it is like a variable read from a file."""
    array = Computed(name, tuple(sizes.values()), dtype, values, reads)
    variable = xr.Variable(tuple(sizes), indexing.LazilyIndexedArray(array), attrs)
    if varies_along is not None:
        variable.encoding["varies_along"] = {key: tuple(dims) for key, dims in varies_along.items()}
    return variable


def stretched(
    small: xr.Dataset,
    axes: Mapping[str, Sequence[float]],
    *,
    known: bool = True,
    added: Mapping[str, Sequence[str]] | None = None,
    order: Sequence[str] | None = None,
) -> tuple[xr.Dataset, Reads]:
    """A small result over additional axes, along which nothing varies, with values computed when they are read.

    Parameters
    ----------
    small : a result, whose inputs of these names have a single value
    axes : name and values of each axis that is added
    known : whether the axes along which each variable varies are known
    added : for some variables, the added axes along which they vary: by 0.25 at the second half of each
    order : of all axes but the model; by default the added axes come first
    """
    reads, added = Reads(), added or {}
    small_axes = [str(dim) for dim in small.sizes if dim != "model"]
    dims = ["model", *(order or [*axes, *small_axes])]
    sizes = {
        **{str(dim): size for dim, size in small.sizes.items()},
        **{name: len(of) for name, of in axes.items()},
    }
    variables = {}
    for name, variable in small.data_vars.items():
        along = [dim for dim in dims if dim == "model" or dim in sizes]
        if "model" not in variable.dims:
            along.remove("model")
        extras = added.get(str(name), ())

        def values(
            *indices: Values,
            along: list[str] = along,
            variable: xr.DataArray = variable,
            extras: Sequence[str] = extras,
        ) -> Values:
            at = dict(zip(along, indices, strict=True))
            result = variable.values[tuple(at[str(dim)] for dim in variable.dims)]
            for extra in extras:
                result = result + 0.25 * (at[extra] >= sizes[extra] // 2)
            return result

        varies = [*small_axes, *extras]
        variables[str(name)] = computed(
            str(name),
            {dim: sizes[dim] for dim in along},
            values,
            reads,
            dtype=variable.dtype,
            varies_along={str(key): varies for key in small["model"].values} if known else None,
            attrs=variable.attrs,
        )
    coords = {
        **{name: coordinate.variable for name, coordinate in small.coords.items() if name not in axes},
        **{name: (name, np.asarray(of, float), small[name].attrs) for name, of in axes.items()},
    }
    return xr.Dataset(variables, coords, small.attrs), reads
