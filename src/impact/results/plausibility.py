"""Notes on values that are valid but probably not intended."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..contact.status import Status
from ..engine.build_impacts import smaller_radius_at
from ..engine.trajectories import axes_of_arrays, probe_index
from ..errors import ModelError, ResultError
from ..formatting import number, safe_text
from .factored import read_inputs
from .schema import parts_of_models
from .slabs import MAX_SUMMARY_POINTS, is_computed, over_varying_dims, slabs
from .summary import MAX_SMALL_INDENTATION, Summary

if TYPE_CHECKING:
    import xarray as xr

# Young's moduli outside these limits are probably in another unit: gels have 1e3 Pa, diamond has 1e12 Pa
MIN_MODULUS_PA, MAX_MODULUS_PA = 1e3, 1e13


def material_notes(
    materials: Mapping[str, Mapping[str, object]], axes: Mapping[str, Sequence[object]]
) -> Iterator[str]:
    """Yield a sentence for each material whose Young's modulus E [Pa], or a value of its axis, is implausible.

    >>> list(material_notes({"steel": {"E": 210.0}, "rubber": {"E": 5e6}}, {}))
    ['materials.steel.E: got 210 Pa; did you mean 210 GPa?']
    >>> list(material_notes({"glass": {"E": None}}, {"materials.glass.E": [6e10, 72.0]}))
    ['materials.glass.E: got 72 Pa; did you mean 72 GPa?']
    """
    for name, material in materials.items():
        for modulus in axes.get(f"materials.{name}.E", [material.get("E")]):
            if isinstance(modulus, float) and (modulus < MIN_MODULUS_PA or modulus > MAX_MODULUS_PA):
                too_small = modulus < MIN_MODULUS_PA
                hint = f"did you mean {number(modulus)} GPa?" if too_small else "no material is as stiff"
                yield f"materials.{safe_text(name)}.E: got {number(modulus)} Pa; {hint}"
                break


def result_notes(summary: Summary) -> Iterator[str]:
    """Yield a sentence for each implausible property of a sweep's outcome."""
    if summary.points and not summary.not_counted and summary.counts.keys() == {Status.NO_IMPACT}:
        yield f"none of {summary.points:,} points is an impact: v1 <= v2, the balls do not approach"
    if summary.deep:
        many = f"{summary.deep:,} of {summary.points:,} points"
        limit = f"{MAX_SMALL_INDENTATION:.0%} of the smaller radius"
        yield (
            f"peak indentation above {limit} at {many}, at most {summary.deepest:.0%}; Hertz theory assumes small "
            "indentation"
        )


def with_depths(summary: Summary, dataset: xr.Dataset) -> Summary:
    """Add `deep` and `deepest` of a dataset to its summary."""
    depths = _depth_summary(dataset)
    return replace(summary, deep=depths.deep, deepest=depths.deepest)


def _depth_summary(dataset: xr.Dataset) -> Summary:
    """Find `deep` and `deepest` from the radii, without models of more computed points than a summary has."""
    summary = Summary()
    axes = [str(dim) for dim in dataset.sizes if dim != "model"]
    try:
        inputs = read_inputs(dataset, axes)
        varied = axes_of_arrays([smaller_radius_at(inputs, probe_index(inputs))])
    except (ResultError, ModelError, KeyError):
        # a part of a result, or one that was changed, may lack what the radii follow from
        return summary
    radius_dims = [axis.name for number, axis in enumerate(inputs.axes) if number in varied]
    for model, part in enumerate(parts_of_models(dataset) if "peak_indentation" in dataset else ()):
        points, weight = over_varying_dims(part, ["peak_indentation"], *radius_dims)
        dims = [axis.name for axis in inputs.axes if axis.name in points.dims]
        depth = points.variables["peak_indentation"].transpose(*dims)
        if depth.size > MAX_SUMMARY_POINTS and is_computed(depth):
            continue
        for slab in slabs(depth.sizes):
            radius = smaller_radius_at(inputs, inputs.index([slab.get(a.name, slice(1)) for a in inputs.axes]))
            absent = tuple(number for number, axis in enumerate(inputs.axes) if axis.name not in dims)
            values = {"peak_indentation": depth.isel(slab).values}
            summary.add(values, model, (), radius.squeeze(absent) if inputs.axes else radius, weight)
    return summary
