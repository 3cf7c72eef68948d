"""Align two results by their labels, and list the differences between their inputs.

Sweeps are aligned axis by axis, calibrations law by law, and boards of `impact conform` engine by engine and check
by check.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from ..array_types import Array
from ..config.input_names import InputName, is_input
from ..contact.variables import LAW_DIMS, OUTPUTS
from ..formatting import number, safe_text
from ..results.attributes import read_attribute
from ..results.calibration import fit_status
from ..results.schema import BOARD, CALIBRATION, MODEL_METADATA, columns_along, is_case
from ..results.selection import LABEL_RTOL, NUMBER_DTYPE_KINDS, IndexArray, Labels, match_labels
from .verdict import Difference, DifferenceKind

MAX_NAMED_LABELS = 3  # labels of one side that a message lists
# coordinates that vary with the model
MODEL_COORDINATES = ("model", "exponent", *MODEL_METADATA)
# coordinates along the measured values, which have to be equal
DATA_COORDINATES = ("output", "measured", "sigma")


@dataclass(frozen=True)
class Alignment:
    """Two results at their common points, and the differences between their inputs.

    Parameters
    ----------
    new, baseline : the results at their common points, in the order of the baseline; an input that only the other
        result varies has an axis of length one; the coordinates are in memory, the variables may be lazy
    dims : by common variable, its axes in the order of the baseline, without variables that vary along different
        axes; empty if the results have no common point
    scales : by variable of a calibration, the scale of each value; NaN if the data do not determine the value
    notes : on what differs and does not affect equality
    """

    new: xr.Dataset
    baseline: xr.Dataset
    dims: Mapping[str, tuple[str, ...]]
    faults: tuple[Difference, ...]
    scales: Mapping[str, Array] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def align_sweeps(new: xr.Dataset, baseline: xr.Dataset, *, subset: bool) -> Alignment:
    """Align two results of sweeps by their coordinates; values of variables are not read."""
    new, baseline = _drop_foreign_axes(new, baseline), _drop_foreign_axes(baseline, new)
    a, b = _comparable_coordinates(new, baseline), _comparable_coordinates(baseline, new)
    one_sided = (name for name in sorted(map(str, a.coords.keys() ^ b.coords.keys())) if is_input(name))
    sides = {name: "NEW" if name in a.coords else "BASELINE" for name in one_sided}
    faults = [
        Difference("physics config", n, f"{safe_text(n)} is given in {side} only") for n, side in sides.items()
    ]
    positions: dict[str, tuple[IndexArray, IndexArray]] = {}
    for axis in map(str, dict.fromkeys((*b.dims, *baseline.dims, *a.dims, *new.dims))):
        columns = _label_columns(a, axis), _label_columns(b, axis)
        if columns[0] != columns[1] or not columns[0]:
            got, expected = (safe_text(", ".join(names)) or "nothing" for names in columns)
            text = f"what varies along the axis {safe_text(axis)} is {got}, in BASELINE {expected}"
            faults.append(Difference("nothing in common", axis, text))
            continue
        # the column that gives the axis its name comes first
        names = sorted(columns[0], key=lambda name: name != axis)
        labels = [[coords[name].values for name in names] for coords in (a, b)]
        positions[axis] = match_labels(*labels)
        faults += _unmatched_labels(labels, names, positions[axis], subset=subset)
    faults += _changed_scalars(a, b, "nothing in common" if subset else "physics config")
    if any(fault.kind == "nothing in common" for fault in faults):
        return Alignment(xr.Dataset(), xr.Dataset(), {}, tuple(faults))
    a, b = (
        _select_points(result, coords, {axis: pair[side] for axis, pair in positions.items()})
        for side, (result, coords) in enumerate(((new, a), (baseline, b)))
    )
    faults += _changed_columns(a, b)
    dims = {}
    for name in (name for name in OUTPUTS if name in new and name in baseline):
        axes = _axes_of_both(name, baseline, new)
        if set(axes) == set(_axes_of_both(name, new, baseline)):
            dims[name] = axes
        else:
            faults.append(Difference("labels", name, f"{name} varies along other axes"))
    return Alignment(a, b, dims, tuple(faults))


def _select_points(result: xr.Dataset, coords: xr.Dataset, positions: Mapping[str, IndexArray]) -> xr.Dataset:
    """Select points by their positions along each axis; neighbours by a slice, which files read faster."""
    index: dict[Hashable, IndexArray | slice] = {}
    for axis, along in positions.items():
        neighbours = slice(int(along[0]), int(along[0]) + len(along))
        index[axis] = neighbours if np.array_equal(along, np.arange(neighbours.start, neighbours.stop)) else along
    variables = {name: result.variables[name] for name in result.data_vars}
    return coords.isel(index).assign({n: v.isel({d: index[d] for d in v.dims}) for n, v in variables.items()})


def unknown_variables(dataset: xr.Dataset) -> list[str]:
    """List the variables that are not part of a result."""
    standard_names = {*MODEL_COORDINATES, *LAW_DIMS, *OUTPUTS}
    names = [str(name) for name in dataset.variables if name not in standard_names]
    return [name for name in names if not (is_input(name) or is_case(name))]


def _drop_foreign_axes(result: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """Drop the parameters of laws that either result lacks; other laws do not depend on them."""
    laws = [
        {str(key) for dim in LAW_DIMS if dim in each.coords for key in np.ravel(each[dim].values)}
        for each in (result, other)
    ]
    names = {str(name): InputName.parse(name) for name in result.coords}
    common = laws[0] & laws[1] | {""}
    foreign = [name for name, parsed in names.items() if not {parsed.model, parsed.friction} <= common]
    for axis in [name for name in foreign if name in result.dims]:
        # an axis that has inputs of other laws as well is theirs
        shared = [name for name in columns_along(result, axis) if name not in foreign]
        result = result.swap_dims({axis: shared[0]}) if shared else result.isel({axis: 0})
    return result.drop_vars(foreign)


def _comparable_coordinates(result: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """Load the coordinates of a result; a single value that the other varies becomes an axis of length one."""
    coords, materials = result.coords.to_dataset().compute(), read_attribute(result.attrs, "materials")
    # the properties of materials that are coordinates of the other result only
    for name, of_other in other.coords.items():
        parsed = InputName.parse(name)
        value = materials.get(parsed.material, {}).get(parsed.key)
        if name not in coords and isinstance(value, float):
            coords = coords.assign_coords({name: xr.Variable((), value, of_other.attrs)})
    # the key of a law that was selected is still a label
    for axis in map(str, dict.fromkeys((*LAW_DIMS, *other.dims))):
        if axis not in coords.dims and axis in coords and coords[axis].ndim == 0:
            along = [name for name in other.coords if axis in other.variables[name].dims]
            names = MODEL_COORDINATES if axis == "model" else (axis, *along)
            labels = {name: coords[name].expand_dims(axis).variable for name in names if name in coords}
            coords = coords.assign_coords(labels)
    # an input that varies with a zip group in the other result only: repeat it along their common axis
    repeated = {
        name: coords[name].expand_dims({dim: coords.sizes[dim] for dim in other[name].dims}).variable
        for name in coords.coords.keys() & other.coords.keys()
        if coords[name].ndim == 0 and other[name].ndim == 1 and other[name].dims[0] in coords.dims
    }
    return coords.assign_coords(repeated)


def _axes_of_both(name: str, result: xr.Dataset, other: xr.Dataset) -> tuple[str, ...]:
    """List the axes of a variable, after axes of length one along which only the other result varies."""
    added = [str(dim) for dim in dict.fromkeys(("model", *other.dims)) if dim not in result.dims]
    of_variable = [dim for dim in added if dim not in LAW_DIMS or dim in OUTPUTS[name].dims]
    return (*reversed(of_variable), *map(str, result.variables[name].dims))


def _changed_scalars(new: xr.Dataset, baseline: xr.Dataset, kind: DifferenceKind) -> Iterator[Difference]:
    """List the inputs with one value in each result that differ."""
    for name in sorted(str(name) for name in new.coords.keys() & baseline.coords.keys() if is_input(name)):
        a, b = new[name], baseline[name]
        if a.ndim == b.ndim == 0 and not _labels_agree(a.values, b.values):
            text = f"{safe_text(name)} is {_format_value(a.values)}, in BASELINE {_format_value(b.values)}"
            yield Difference(kind, name, text)


def _label_columns(dataset: xr.Dataset, axis: str) -> list[str]:
    """List the coordinates that identify the points of an axis: their numbers, or all columns of the axis."""
    if axis == "model" or ((axis == "friction" or is_case(axis)) and axis in dataset.coords):
        return [axis]
    return sorted(columns_along(dataset, axis))


def _unmatched_labels(
    labels: Sequence[Sequence[Labels]], names: Sequence[str], positions: Sequence[IndexArray], *, subset: bool
) -> list[Difference]:
    """List the labels of an axis that only one of two results has; labels of a zip group with all columns."""
    axis = names[0]
    if not len(positions[0]):
        sides = ", in BASELINE ".join(_first_labels(columns, names) for columns in labels)
        return [Difference("nothing in common", axis, f"no value of {safe_text(axis)} is in both: {sides}")]
    if subset:
        return []
    texts = []
    for columns, common, side in zip(labels, positions, ("NEW", "BASELINE"), strict=True):
        unmatched = [np.delete(values, common) for values in columns]
        if len(unmatched[0]):
            texts.append(
                f"{len(unmatched[0])} of {len(columns[0])} in {side} only: {_first_labels(unmatched, names)}"
            )
    return [Difference("labels", axis, f"{safe_text(axis)}: {'; '.join(texts)}")] if texts else []


def _changed_columns(new: xr.Dataset, baseline: xr.Dataset) -> Iterator[Difference]:
    """List the coordinates along several axes or models that differ: e from alpha, the exponent."""
    for name in sorted(str(name) for name in new.coords.keys() & baseline.coords.keys()):
        if name == "exponent" or (is_input(name) and baseline[name].ndim):
            a, b = new[name], baseline[name]
            # e = 1 - alpha v0 has the absolute rounding error of 1
            rounding = LABEL_RTOL if name == "e" else 0.0
            if set(a.dims) != set(b.dims) or not _labels_agree(a.transpose(*b.dims).values, b.values, rounding):
                yield _changed_values(name, a, b)


def _changed_values(name: str, new: xr.DataArray, baseline: xr.DataArray) -> Difference:
    """Describe how a coordinate differs; of an input of numbered points, with the values."""
    axis = str(baseline.dims[0])
    if not is_case(axis) or new.dims != (axis,) or baseline.dims != (axis,):
        return Difference("labels", name, f"the coordinate {safe_text(name)} has other values")
    pairs = zip(new.values, baseline.values, strict=True)
    differ = [index for index, (a, b) in enumerate(pairs) if not _labels_agree(np.asarray(a), np.asarray(b))]
    shown = "; ".join(
        f"{_format_value(new.values[index])} at {axis} {_format_value(baseline[axis].values[index])}, "
        f"in BASELINE {_format_value(baseline.values[index])}"
        for index in differ[:MAX_NAMED_LABELS]
    )
    more = f"; and {len(differ) - MAX_NAMED_LABELS} more" if len(differ) > MAX_NAMED_LABELS else ""
    return Difference("physics config", name, f"{safe_text(name)} is {shown}{more}")


def _labels_agree(a: Labels, b: Labels, rounding: float = 0.0) -> bool:
    """Return whether all labels agree within their relative tolerance, and an absolute tolerance `rounding`."""
    if a.dtype.kind in NUMBER_DTYPE_KINDS and b.dtype.kind in NUMBER_DTYPE_KINDS:
        return bool(np.isclose(a, b, rtol=LABEL_RTOL, atol=rounding, equal_nan=True).all())
    return bool(np.all(a.astype(str) == b.astype(str)))


def _first_labels(columns: Sequence[Labels], names: Sequence[str]) -> str:
    """List the first few labels, with all columns."""
    shown = []
    for first, *others in zip(*(values[:MAX_NAMED_LABELS] for values in columns), strict=True):
        more = (f" with {safe_text(n)}={_format_value(v)}" for n, v in zip(names[1:], others, strict=True))
        shown.append(_format_value(first) + "".join(more))
    return ", ".join(shown) + (", ..." if len(columns[0]) > MAX_NAMED_LABELS else "")


def _format_value(value: Any) -> str:
    """Write a label."""
    return safe_text(number(np.asarray(value).item(), 12), 60)


def align_calibrations(new: xr.Dataset, baseline: xr.Dataset, *, subset: bool) -> Alignment:
    """Align two calibrations by their laws and parameters, whose order does not matter."""
    common = common_labels(new, baseline, "model")
    faults = []
    for study, side in ((new, "NEW"), (baseline, "BASELINE")):
        only = ", ".join(key for key in map(str, study["model"].values) if key not in common)
        if only and not subset:
            faults.append(Difference("labels", "model", f"model: in {side} only: {safe_text(only, 400)}"))
    if not common:
        faults.append(Difference("nothing in common", "", "the two have no law in common"))
    new, baseline = (_of_laws(study, common, subset=subset) for study in (new, baseline))
    data_faults = [*_data_faults(new, baseline)]
    is_same_data = all(fault.kind != "labels" for fault in data_faults)
    faults = [*data_faults, *faults]
    if is_same_data:
        new = new.sel({dim: baseline[dim].values for dim in ("parameter", "other_parameter")})
        for dim in sorted({"output_name", "grid"} & {*new.dims} & {*baseline.dims}):
            labels = [new[dim].values], [baseline[dim].values]
            positions = match_labels(*labels)
            faults += _unmatched_labels(labels, [dim], positions, subset=subset)
            new, baseline = new.isel({dim: positions[0]}), baseline.isel({dim: positions[1]})
    both = [name for name in CALIBRATION if name in new and name in baseline] if is_same_data else []
    names = [name for name in both if new[name].size]
    scales = {name: _scale(name, baseline) for name in names}
    return _align((new, baseline), scales, faults, _fit_notes(new, baseline))


def _of_laws(study: xr.Dataset, keys: Sequence[str], *, subset: bool) -> xr.Dataset:
    """Select laws of a calibration; of a subset, without parameters of other laws and weights among other laws."""
    study = study.sel(model=keys)
    if not subset:
        return study
    parameters = study["parameter"].values[(study["identifiable"] >= 0).any("model").values]
    is_whole = np.isclose(study["weight"].sum().item(), 1.0)
    return study.sel(parameter=parameters, other_parameter=parameters).drop_vars([] if is_whole else "weight")


def align_boards(new: xr.Dataset, baseline: xr.Dataset, *, subset: bool) -> Alignment:
    """Align two boards by the labels of engines and checks, whose order does not matter."""
    faults = []
    suites = [dataset.attrs["suite"] for dataset in (new, baseline)]
    if suites[0] != suites[1]:
        faults.append(changed_config("suite", "suite is", *suites))
    common = {dim: common_labels(new, baseline, dim) for dim in ("engine", "check")}
    for dim in common:
        for study, side in ((new, "NEW"), (baseline, "BASELINE")):
            only = [label for label in map(str, study[dim].values) if label not in common[dim]]
            if only and not subset:
                named = ", ".join(only[:MAX_NAMED_LABELS]) + (", ..." if len(only) > MAX_NAMED_LABELS else "")
                text = f"{dim}: {len(only)} of {study.sizes[dim]} in {side} only: {named}"
                faults.append(Difference("labels", dim, safe_text(text, 400)))
        if not common[dim]:
            faults.append(Difference("nothing in common", dim, f"the two have no {dim} in common"))
    names = list(BOARD) if all(common.values()) and suites[0] == suites[1] else []
    new, baseline = (dataset.sel(common) for dataset in (new, baseline))
    # all numbers are dimensionless; what is not supported in one of them differs by its status
    scales = {name: np.maximum(1.0, np.abs(np.nan_to_num(baseline[name].values.astype(float)))) for name in names}
    return _align((new, baseline), scales, faults, _version_notes(new, baseline))


def _version_notes(new: xr.Dataset, baseline: xr.Dataset) -> Iterator[str]:
    """Name the engines whose version or kind differs."""
    for engine in common_labels(new, baseline, "engine"):
        for name in ("engine_version", "engine_kind"):
            a, b = (str(dataset[name].sel(engine=engine).item()) for dataset in (new, baseline))
            if a != b:
                word = name.removeprefix("engine_")
                yield safe_text(f"the {word} of {engine} is {a or 'unknown'}, in BASELINE {b or 'unknown'}")


def _align(
    studies: Sequence[xr.Dataset], scales: Mapping[str, Array], faults: Iterable[Difference], notes: Iterable[str]
) -> Alignment:
    """Align two studies whose points are in the same order; the variables that have a scale are compared."""
    baseline = studies[1]
    labels = {dim: baseline.variables[dim] for dim in baseline.dims if dim in baseline.coords}
    coords = xr.Coordinates(labels, indexes={})
    a, b = (xr.Dataset({name: study.variables[name] for name in scales}, coords) for study in studies)
    dims = {name: tuple(map(str, baseline[name].dims)) for name in scales}
    return Alignment(a, b, dims, tuple(faults), scales, tuple(notes))


def common_labels(new: xr.Dataset, baseline: xr.Dataset, dim: str) -> list[str]:
    """List the laws, engines or checks that two studies have, in the order of the baseline."""
    return [label for label in map(str, baseline[dim].values) if label in new[dim].values]


def changed_config(name: str, label: str, new: Any, baseline: Any) -> Difference:
    """Describe an input or a setting that differs."""
    return Difference("physics config", name, safe_text(f"{label} {new}, in BASELINE {baseline}"))


def _data_faults(new: xr.Dataset, baseline: xr.Dataset) -> Iterator[Difference]:
    """List the differences between the measurements, the parameters, their bounds and the noise."""
    bounds = [read_attribute(dataset.attrs, "fit_bounds") for dataset in (new, baseline)]
    parameters = [list(map(str, dataset["parameter"].values)) for dataset in (new, baseline)]
    if sorted(parameters[0]) != sorted(parameters[1]):
        got, expected = (safe_text(", ".join(names), 400) for names in parameters)
        yield Difference("labels", "parameter", f"parameter: {got}, in BASELINE {expected}")
    else:
        for name in parameters[0]:
            a, b = (table.get(name) for table in bounds)
            if a != b:
                yield changed_config(name, f"bounds of {name}:", a, b)
    # version 1.0 had no other loss
    for key, default in (("noise", None), ("loss", "linear")):
        a, b = (dataset.attrs.get(key, default) for dataset in (new, baseline))
        if a != b:
            yield changed_config(key, f"{key} is", a, b)
    columns = [
        {str(name): v.values for name, v in dataset.coords.items() if v.dims == ("point",)}
        for dataset in (new, baseline)
    ]
    inputs = [name for name in columns[1] if name not in ("point", "line", *DATA_COORDINATES)]
    for name in (*DATA_COORDINATES, *inputs):
        first, second = (column.get(name, np.array([])) for column in columns)
        if not np.array_equal(first, second, equal_nan=first.dtype.kind == second.dtype.kind == "f"):
            yield Difference("labels", name, f"{name}: the measured points differ")
    for name in sorted(map(str, baseline.coords.keys() & new.coords.keys())):
        scalars = new.coords[name], baseline.coords[name]
        if is_input(name) and scalars[0].ndim == scalars[1].ndim == 0 and scalars[0].item() != scalars[1].item():
            yield changed_config(name, f"{name} is", scalars[0].item(), scalars[1].item())


def _scale(name: str, baseline: xr.Dataset) -> Array:
    """Compute the scale of each value of a variable; NaN if the data do not determine the value."""
    variable, values = CALIBRATION[name], abs(baseline[name])
    match variable.scale:
        case "exact":
            scale = xr.zeros_like(values)
        case "itself + interval":
            interval = (baseline["upper"] - baseline["lower"]).fillna(0.0)
            scale = (abs(baseline["estimate"]) + interval).where(baseline["identifiable"] == 1)
        case "deviations":
            deviation = np.sqrt(np.diagonal(values, axis1=-2, axis2=-1))
            scale = values.copy(data=deviation[..., :, None] * deviation[..., None, :])
        case "measured":
            largest = abs(baseline["measured"]).groupby("output").max()
            scale = largest.sel(output=baseline["output" if "point" in variable.dims else "output_name"])
        case "max(1, itself)":
            scale = values.where(values > 1.0, 1.0)
        case _:
            scale = values
    return np.asarray(scale.where(np.isfinite(scale)).broadcast_like(values).transpose(*values.dims), float)


def _fit_notes(new: xr.Dataset, baseline: xr.Dataset) -> Iterator[str]:
    """Name the laws whose fits ended with another status."""
    for key in common_labels(new, baseline, "model"):
        a, b = (fit_status(dataset.sel(model=key)) for dataset in (new, baseline))
        if a != b:
            yield f"the fit of {key} is {a}, in BASELINE {b}"
