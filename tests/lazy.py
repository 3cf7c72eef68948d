"""Results of any size whose values are computed when they are indexed, and a record of what was asked of them."""

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
# numbers that a read may have: many times a slab, and no burden
MAX_READ = 2**22


@dataclass
class Reads:
    """How many numbers were read, of each variable: all together, and at once."""

    total: dict[str, int] = field(default_factory=dict)
    largest: dict[str, int] = field(default_factory=dict)

    def add(self, name: str, size: int) -> None:
        assert size <= MAX_READ, f"{size:,} numbers of {name} are read at once"
        self.total[name] = self.total.get(name, 0) + size
        self.largest[name] = max(self.largest.get(name, 0), size)

    def clear(self) -> None:
        self.total.clear()
        self.largest.clear()


class Computed(BackendArray):
    """A function of the places along each axis, given as arrays that broadcast."""

    def __init__(
        self, name: str, shape: tuple[int, ...], dtype: np.dtype[Any], values: Callable[..., Values], reads: Reads
    ) -> None:
        self.name, self.shape, self.dtype, self.values, self.reads = name, shape, dtype, values, reads

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Values:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._read)

    def _read(self, key: tuple[int | slice | Values, ...]) -> Values:
        places = [np.arange(size)[one] for size, one in zip(self.shape, key, strict=True)]
        shape = tuple(one.size for one in places)
        self.reads.add(self.name, prod(shape))
        values = np.broadcast_to(self.values(*np.ix_(*map(np.atleast_1d, places))), shape)
        return np.array(values.reshape([one.size for one in places if one.ndim]), self.dtype)


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
    """A variable that is computed; without `varies_along` it is like one that is read from a file."""
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
    """A small result over more axes, along which nothing varies, with its values computed when they are indexed.

    Parameters
    ----------
    small : a result, whose inputs of these names have a single value
    axes : name and values of each axis that is added
    known : whether each variable says along which axes it varies
    added : for some variables, the added axes along which they vary: by 0.25 at the second half of each
    order : of all axes but the model; by default those that are added come first
    """
    reads, added = Reads(), added or {}
    own_axes = [str(dim) for dim in small.sizes if dim != "model"]
    dims = ["model", *(order or [*axes, *own_axes])]
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
            *places: Values,
            along: list[str] = along,
            variable: xr.DataArray = variable,
            extras: Sequence[str] = extras,
        ) -> Values:
            at = dict(zip(along, places, strict=True))
            found = variable.values[tuple(at[str(dim)] for dim in variable.dims)]
            for extra in extras:
                found = found + 0.25 * (at[extra] >= sizes[extra] // 2)
            return found

        varies = [*own_axes, *extras]
        variables[str(name)] = computed(
            str(name), {dim: sizes[dim] for dim in along}, values, reads, dtype=variable.dtype,
            varies_along={str(key): varies for key in small["model"].values} if known else None,
            attrs=variable.attrs,
        )  # fmt: skip
    coords = {
        **{name: coordinate.variable for name, coordinate in small.coords.items() if name not in axes},
        **{name: (name, np.asarray(of, float), small[name].attrs) for name, of in axes.items()},
    }
    return xr.Dataset(variables, coords, small.attrs), reads
