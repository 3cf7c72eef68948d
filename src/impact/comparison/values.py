"""Compare the values of one variable of two aligned results: differences in tolerances, and the worst point.

A difference is divided by the tolerance times the scale of the point: values agree up to a ratio of 1. Results of
any size are read in slabs; where the axes along which a variable varies are known, only representative points are.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..contact.status import FIRST_FAILURE, Status
from ..contact.variables import Variable
from ..errors import UsageError
from ..results import slabs
from ..results.provenance import inputs_of_model
from ..results.schema import columns_along, inputs_of_scale, is_case, scale_of
from .align import Alignment
from .verdict import VariableComparison

# slices of the common points, by axis; along axes that are not in it, the first point represents all
Region = Mapping[str, slice]

# at most this many points of a variable are compared, which takes an hour
MAX_COMPARED_POINTS = 10**10
# the largest ratios along longer axes are those of groups of neighbours, enough for a picture
MAX_RATIO_GROUPS = 2**14
# |difference|/scale is that of a trajectory: |Delta v1_post|/v0 = (m/m1) |Delta e_out| <= |Delta e_out|
DIMENSIONLESS_SCALES = ("v0", "the peak", "itself", "m v0^2/2")


def representative_regions(variables: Sequence[Variable], aligned: Alignment) -> dict[str, list[Region]]:
    """Choose by variable the regions whose points represent all common points; see `compare` for the rule."""
    results = (aligned.new, aligned.baseline)
    known = [v.name for v in variables if any(slabs.is_computed(r.variables[v.name]) for r in results)]
    sizes = aligned.baseline.sizes
    models = range(sizes["model"] if known else 0)
    datasets_by_model = [[result.isel(model=slice(model, model + 1)) for result in results] for model in models]
    regions: dict[str, list[Region]] = {}
    for variable in variables:
        dims = aligned.dims[variable.name]
        whole = {dim: slice(0, sizes[dim]) for dim in dims}
        parts: list[Region] = [whole]
        if variable.name in known:
            parts = [
                {
                    dim: slice(model, model + 1) if dim == "model" else whole[dim]
                    for dim in _representative_dims(variable, aligned, datasets)
                }
                for model, datasets in enumerate(datasets_by_model if "model" in dims else [results])
            ]
        points = sum(math.prod(part.stop - part.start for part in region.values()) for region in parts)
        if points > MAX_COMPARED_POINTS:
            expected = f"expected at most {MAX_COMPARED_POINTS:,}; select a part of the results"
            raise UsageError(f"{variable.name}: got {points:,} points to compare, {expected}")
        regions[variable.name] = parts
    return regions


def _representative_dims(
    variable: Variable, aligned: Alignment, datasets: Sequence[xr.Dataset]
) -> tuple[str, ...]:
    """Choose the axes of a variable whose points represent all others, from the datasets of one model."""

    def varying(*names: str) -> set[Hashable]:
        present = [(dataset, name) for dataset in datasets for name in names if name in dataset]
        return {dim for dataset, name in present for dim in slabs.varying_dims(dataset, name)}

    inputs = [name for name in inputs_of_scale(variable) if name in datasets[1]]
    full = varying(variable.name).union(*(slabs.varying_dims(datasets[1], name) for name in inputs))
    candidates = [full]
    if variable.per_model and variable.has_tolerance:
        # the status decides whether a NaN is an answer
        candidates.insert(0, full | varying(variable.status))
    if variable.scale in DIMENSIONLESS_SCALES and all("e_out" in dataset for dataset in datasets):
        candidates.append(varying("e_out"))

    def points(dims: Iterable[str]) -> int:
        """Count those of one model."""
        return math.prod(aligned.baseline.sizes[dim] for dim in dims if dim != "model")

    chosen = [tuple(d for d in aligned.dims[variable.name] if d in dims or d == "model") for dims in candidates]
    return next((dims for dims in chosen if points(dims) <= slabs.MAX_SUMMARY_POINTS), min(chosen, key=points))


class Worst(NamedTuple):
    """The worst point of a region, the largest tuple; `place` is its negative index, so that the first wins."""

    ratio: float = 0.0
    size: float = 0.0
    place: tuple[int, ...] = ()
    difference: float = 0.0
    new: float = math.nan
    baseline: float = math.nan


def compare_values(
    variable: Variable, aligned: Alignment, tol: float, regions: Iterable[Region]
) -> tuple[VariableComparison, dict[str, NDArray[Any]]]:
    """Compare one variable at the points of some regions, each of which counts for all that it represents.

    Returns also, by axis, the largest ratio at each of its points, or of groups of neighbours if there are more
    than `MAX_RATIO_GROUPS` points; constant along an axis of which the first point represents all.
    """
    dims = aligned.dims[variable.name]
    shape = tuple(aligned.baseline.sizes[dim] for dim in dims)
    largest = {dim: np.zeros(-(-size // group_size(size))) for dim, size in zip(dims, shape, strict=True)}
    different = 0
    worst = Worst()
    for region in regions:
        weight = math.prod(aligned.baseline.sizes[dim] for dim in dims if dim not in region)
        for slab in _slabs(variable.name, aligned, region):
            part = {dim: slab.get(dim, slice(0, 1)) for dim in dims}
            sides = [slabs.read_slab(result, variable.name, part) for result in (aligned.new, aligned.baseline)]
            if np.array_equal(sides[0], sides[1]):
                continue
            ratio, difference = _ratio(variable, aligned, part, sides, tol)
            different += int(np.count_nonzero(ratio > 1.0)) * weight
            if not ratio.max():
                continue
            # the largest ratio, then the largest difference (except of flags), then the first point
            sizes = np.ones_like(ratio) if variable.scale == "exact" else np.nan_to_num(difference, nan=np.inf)
            index = np.unravel_index(int(np.argmax(np.where(ratio == ratio.max(), sizes, -1.0))), ratio.shape)
            place = tuple(-part[dim].start - int(offset) for dim, offset in zip(dims, index, strict=True))
            values = (float(array[index]) for array in (difference, *sides))
            worst = max(worst, Worst(float(ratio[index]), float(sizes[index]), place, *values))
            for axis, dim in enumerate(dims):
                maxima = ratio.max(axis=tuple(other for other in range(len(dims)) if other != axis))
                if dim in slab:
                    groups = np.arange(slab[dim].start, slab[dim].stop) // group_size(aligned.baseline.sizes[dim])
                    np.maximum.at(largest[dim], groups, maxima)
                else:
                    np.maximum(largest[dim], maxima, out=largest[dim])
    undetermined = np.isnan(aligned.scales[variable.name]).sum() if aligned.scales else 0
    return VariableComparison(
        name=variable.name,
        judged=variable.judged,
        tolerance=tol if variable.has_tolerance else math.nan,
        points=math.prod(shape) - int(undetermined),
        different=different,
        worst=worst.difference,
        ratio=worst.ratio,
        at=_inputs_of_point(aligned.new, dims, worst.place) if worst.place else {},
        new=worst.new,
        baseline=worst.baseline,
    ), largest


def group_size(size: int) -> int:
    """Count the neighbouring points of an axis that share one largest ratio.

    >>> group_size(101), group_size(10**6)
    (1, 62)
    """
    return -(-size // MAX_RATIO_GROUPS)


def _slabs(name: str, aligned: Alignment, region: Region) -> Iterator[dict[str, slice]]:
    """Split a region into slabs; of a file with chunks, into slabs of whole chunks, so that each is read once."""
    sizes: dict[Hashable, int] = {dim: part.stop - part.start for dim, part in region.items()}
    variable = aligned.baseline.variables[name]
    chunks = dict(zip(variable.dims, variable.encoding.get("chunksizes") or (), strict=False))
    if not slabs.is_lazy(variable) or math.prod(chunks.values()) > slabs.SLAB_POINTS:
        chunks = {}
    for slab in slabs.slabs(sizes, chunks=[chunks.get(dim, 1) for dim in sizes]):
        yield {
            dim: slice(part.start + slab[dim].start, part.start + slab[dim].stop) for dim, part in region.items()
        }


def _ratio(
    variable: Variable, aligned: Alignment, region: Region, sides: Sequence[NDArray[Any]], tol: float
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Compute the differences over the tolerance, inf if none is allowed or a NaN is unexplained, and in SI."""
    a, b = sides
    missing = np.isnan(a.astype(float)), np.isnan(b.astype(float))
    with np.errstate(all="ignore"):
        difference = np.where(a == b, 0.0, np.abs(a.astype(float) - b.astype(float)))
        largest = np.maximum(np.abs(a), np.abs(b))
        if aligned.scales:
            scale = aligned.scales[variable.name][tuple(region.values())]
        else:
            read = partial(slabs.read_slab, aligned.baseline, slab=region)
            scale = scale_of(variable, read, has_peak="peak_indentation" in aligned.baseline)
        # allow for the rounding of values that were stored in single precision
        lost = sum(float(np.finfo(values.dtype).eps) for values in sides if values.dtype == np.float32)
        allowed = tol * scale + (lost * largest if lost else 0.0)
        # a residual is noise: any value within its bound is accepted
        counted = np.minimum(difference, largest) if variable.scale == "bounded by 10 rtol" else difference
        if not variable.has_tolerance:
            ratio = np.where(difference == 0.0, 0.0, np.inf)
        else:
            # with an infinite scale every difference would be accepted
            has_measure = (allowed > 0.0) & np.isfinite(scale) & np.isfinite(counted)
            ratio = np.where(counted == 0.0, 0.0, np.where(has_measure, counted / allowed, np.inf))
    ratio = np.where(missing[0] | missing[1], np.inf, ratio)
    if (missing[0] & missing[1]).any():
        ratio = np.where(missing[0] & missing[1] & _may_be_missing(variable, aligned, region), 0.0, ratio)
    if aligned.scales:
        # values of a calibration that the data do not determine are arbitrary
        ratio = np.where(np.isnan(scale), 0.0, ratio)
    return ratio, difference


def _may_be_missing(variable: Variable, aligned: Alignment, region: Region) -> NDArray[Any] | bool:
    """Find where NaNs in both are equal: the same status explains them, or the law if neither has failed."""
    results = (aligned.new, aligned.baseline)
    if not variable.per_model or not all(variable.status in result for result in results):
        return True
    new, baseline = (slabs.read_slab(result, variable.status, region) for result in results)
    # a point that xarray left out, such as by `where`, has no status
    is_explained = (new == baseline) & (baseline != Status.OK) | np.isnan(new) & np.isnan(baseline)
    return np.asarray(is_explained | (variable.may_be_nan & (np.maximum(new, baseline) < FIRST_FAILURE)))


def _inputs_of_point(coords: xr.Dataset, dims: Sequence[str], place: Sequence[int]) -> dict[str, float | str]:
    """Look up the inputs with which the config of the new result gives a point again."""
    inputs = {
        name: coords.variables[name].values[-position].item()
        for dim, position in zip(dims, place, strict=True)
        for name in dict.fromkeys([dim, *columns_along(coords, dim)])
    }
    return {
        name: value if is_case(name) else float(value) if isinstance(value, int | float) else str(value)
        for name, value in inputs_of_model(inputs).items()
    }
