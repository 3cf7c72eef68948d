"""Slabs: parts of a large result that fit in memory; the axes along which a variable varies.

The variables of a large result are computed or read when they are indexed. A computed variable lists in
`encoding["varies_along"]`, by model, the axes along which it varies. It is constant along the others, so that a
count over all points is a count over these axes times the size of the others.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

# points of a slab: enough to amortize Python's overhead, few enough to fit in cache
SLAB_POINTS = 2**17
# lazy variables with more points are not evaluated for a summary; this many take a few seconds
MAX_SUMMARY_POINTS = 2**26
VARIES_ALONG, ORIGINAL_DIMS = "varies_along", "axes"

Slab = dict[Hashable, slice]


def slabs(
    sizes: Mapping[Hashable, int], points: int = SLAB_POINTS, *, chunks: Sequence[int] | None = None
) -> Iterator[Slab]:
    """Divide all points, in C order, into slabs of about `points` points, of whole chunks if these have lengths.

    >>> list(slabs({"e": 2, "v1": 3}, 2))[:2]
    [{'e': slice(0, 1, None), 'v1': slice(0, 2, None)}, {'e': slice(0, 1, None), 'v1': slice(2, 3, None)}]
    >>> list(slabs({}))
    [{}]
    >>> [where["v1"] for where in slabs({"e": 2, "v1": 4}, 4, chunks=(2, 2))]
    [slice(0, 2, None), slice(2, 4, None)]
    """
    shape = tuple(sizes.values())
    lengths = [*(chunks or (1,) * len(shape))]
    # the last axes are whole in every slab
    for axis in reversed(range(len(shape))):
        lengths[axis] = min(lengths[axis] * max(1, points // math.prod(lengths)), max(1, shape[axis]))
    # an empty axis has no slab
    steps = [range(0, size, length) for size, length in zip(shape, lengths, strict=True)]
    for starts in itertools.product(*steps):
        yield {
            dim: slice(start, min(start + length, size))
            for (dim, size), start, length in zip(sizes.items(), starts, lengths, strict=True)
        }


def is_lazy(variable: xr.Variable) -> bool:
    """Whether the values of a variable are computed, or read, when they are indexed."""
    return not variable._in_memory


def is_computed(variable: xr.Variable) -> bool:
    """Whether a variable is computed when it is indexed, and the axes along which it varies are known."""
    return is_lazy(variable) and VARIES_ALONG in variable.encoding


def is_large(variable: xr.Variable) -> bool:
    """Whether a variable is lazy and has more values than one slab."""
    return is_lazy(variable) and variable.size > SLAB_POINTS


def varying_dims(dataset: xr.Dataset, name: str) -> tuple[Hashable, ...]:
    """Name the dimensions along which a variable of one model varies, as far as known; all of one in memory."""
    variable = dataset.variables[name]
    if not is_computed(variable) or "model" not in dataset.coords:
        return variable.dims
    by_model = variable.encoding[VARIES_ALONG]
    keys = [str(key) for key in np.ravel(dataset["model"].values)]
    # nothing is known about a model whose key was changed
    along = {"model", *(dim for key in keys for dim in by_model.get(key, variable.dims))}
    # nothing is known about an axis that was renamed
    along |= {*variable.dims} - {*variable.encoding.get(ORIGINAL_DIMS, variable.dims)}
    return tuple(dim for dim in variable.dims if dim in along)


def distinct_points(dataset: xr.Dataset, name: str, *more: Hashable) -> tuple[xr.Variable, int]:
    """Reduce a variable to the points at which it, or what lies along `more`, differs; with the weight of each."""
    varying, variable = {*more, *varying_dims(dataset, name)}, dataset.variables[name]
    fixed = [dim for dim in variable.dims if dim not in varying]
    weight = math.prod(variable.sizes[dim] for dim in fixed)
    return variable.isel(dict.fromkeys(fixed, slice(0, 1))), weight


def read_slab(dataset: xr.Dataset, name: str, slab: Mapping[Any, slice]) -> NDArray[Any]:
    """Read the values of a variable in a slab, along its dimensions; of length one along those that it lacks."""
    variable = dataset.variables[name]
    # loaded before it is transposed: a transposed lazy array would be read point by point
    part = variable.isel({dim: slab[dim] for dim in variable.dims}).load()
    values = part.transpose(*(dim for dim in slab if dim in part.dims)).values
    return np.expand_dims(values, [axis for axis, dim in enumerate(slab) if dim not in part.dims])
