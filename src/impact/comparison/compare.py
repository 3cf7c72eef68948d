"""Compare a result with a baseline, each variable as its entry in the SCHEMA prescribes.

A tolerance is that of the caller, else the baseline's, else a multiple of its rtol.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, SupportsFloat, TypeGuard

import numpy as np
import xarray as xr

from ..config.files import read_number
from ..config.input_names import is_input
from ..config.quantities import Quantity
from ..contact.fixed_step import EXACT
from ..contact.variables import OUTPUTS
from ..errors import ResultError, UsageError, did_you_mean
from ..formatting import argument, number, safe_text
from ..results.attributes import read_attribute
from ..results.provenance import command_start
from ..results.schema import (
    DEFAULT_RTOL_FACTOR,
    MODEL_METADATA,
    SCHEMA,
    SCHEMA_VERSION,
    kind_of,
    numbered_unit,
    require_sweep,
    unit_of,
)
from ..results.xarray_backend import load, result_of
from .align import Alignment, align_boards, align_calibrations, align_sweeps, changed_config, unknown_variables
from .values import compare_values, group_size, representative_regions
from .verdict import DIFFERENCE_KINDS, Difference, Verdict

# those that a caller passes; the name "all" is that of the variables that have none of their own
Tolerances = Mapping[str, SupportsFloat | str]
ALL_VARIABLES = "all"
# ten times the relative accuracy of the ends of profile intervals
CALIBRATION_TOLERANCE = 1e-5
TOLERANCE_VARIABLES = [name for name, variable in OUTPUTS.items() if variable.has_tolerance]


def compare(
    new: str | Path | xr.Dataset,
    baseline: str | Path | xr.Dataset,
    *,
    tol: SupportsFloat | str | Tolerances | None = None,
    subset: bool = False,
) -> Verdict:
    """Compare a result with a baseline, each variable as docs/schema.md states, at points of equal labels.

    Two calibrations are compared law by law, see docs/calibrate.md, and two boards check by check, see
    docs/conform.md.

    Values are equal if |new - baseline| <= tolerance x scale, where the scale is that of the baseline's point.
    NaNs are equal if both points have the same status and that status explains them, or if the law lacks the
    quantity.

    Datasets may be lazy and of any size: they are read in slabs. If the axes along which variables vary are known
    (`impact.results.slabs`), only representative points are read, and each counts for all points that it
    represents. Per model, these are the points along the axes along which the variable, its scale or the status
    varies in either result. If they are more than 2^26, and the scale is v0, the peak, the value itself or m
    v0^2/2, they are the points along the axes along which e_out varies, at the first position of the others: then
    |new - baseline|/scale depends on the trajectory only. For v1_post it is (m/m1) |difference of e_out|, which is
    at most |difference of e_out|.

    Parameters
    ----------
    new, baseline : results, or their files
    tol : one tolerance for all variables, relative to the scale of a point, such as 1e-8 or "1%", or by name,
        "all" for the others; by default what the baseline carries, else 10 times its solver's rtol
    subset : compare what both have, and ignore what only one has

    Returns
    -------
    Verdict : `equal`, the differences by variable, and what explains them; `print` shows it

    Raises
    ------
    ResultError : a file is not a readable result
    UsageError : a dataset is not the result of a sweep, a tolerance is invalid, or a variable has more than 10^10
        points to read

    >>> import impact
    >>> result = impact.sweep("configs/figure6.toml")
    >>> print(impact.compare(result, result))
    equal: 19 variables, 5,353 values, none differs
    >>> print(impact.compare(result.isel(e=slice(50)), result))
    not equal: labels (e)
    labels: e: 51 of 101 in BASELINE only: 0.5, 0.51, 0.52, ...
    """
    files = [str(source) if isinstance(source, str | Path) else "" for source in (new, baseline)]
    names = files[0] or "NEW", files[1] or "BASELINE"
    a, b = (load(source) if isinstance(source, str | Path) else source for source in (new, baseline))
    repeats: tuple[str, ...] = ()
    kind = kind_of(b)
    is_study = kind_of(a) == kind and kind in ("calibration", "board")
    if is_study:
        a, b = map(result_of, (a, b))
        tolerances = calibration_tolerances(tol)
        align = align_calibrations if kind == "calibration" else align_boards
        aligned = align(a, b, subset=subset)
        faults = [*aligned.faults]
        notes = [*_attribute_notes(a.attrs, b.attrs, {"rtol": None, "impact_version": None})]
        notes += [*_changed_code(a, b), *aligned.notes]
    else:
        for dataset, name in zip((a, b), names, strict=True):
            check_comparable(dataset, name)
        unknown = sorted({*unknown_variables(a), *unknown_variables(b)})
        a, b = (dataset.drop_vars(unknown, errors="ignore") for dataset in (a, b))
        tolerances = effective_tolerances(tol, b.attrs)
        aligned = align_sweeps(a, b, subset=subset)
        faults = [*aligned.faults, *_material_faults(a, b), *_unit_faults(a, b)]
        notes = [*_sweep_notes(a, b, aligned)]
        notes += [safe_text(f"not judged: {', '.join(unknown)}")] if unknown else []
        if any(fault.kind == "labels" for fault in faults) and not subset:
            notes.append(f"{argument('subset', True)} compares only what both results contain")
        missing = [
            Difference("missing variable", name, f"{name} is in {'NEW' if name in a else 'BASELINE'} only")
            for name in OUTPUTS
            if (name in a) != (name in b)
        ]
        notes += [fault.text for fault in missing] if subset else []
        faults += [] if subset else missing
        repeats = command_start(files[0], a) or command_start(files[1], b)
    schema = SCHEMA[kind]
    variables = [schema[name] for name in schema if name in aligned.dims]
    # for all variables before the first comparison, so that a refusal comes early
    regions = representative_regions(variables, aligned)
    compared = {
        v.name: compare_values(v, aligned, tolerances.get(v.name, tolerances[ALL_VARIABLES]), regions[v.name])
        for v in variables
    }
    if not compared and not faults:
        faults.append(Difference("nothing in common", "", "the two have no variable in common"))
    return Verdict(
        new=names[0],
        baseline=names[1],
        faults=tuple(sorted(faults, key=lambda fault: DIFFERENCE_KINDS.index(fault.kind))),
        variables=tuple(comparison for comparison, _ in compared.values()),
        notes=tuple(notes),
        repeats=repeats,
        worst_along=_along_axes({name: ratios for name, (_, ratios) in compared.items()}, aligned.baseline),
    )


def _along_axes(largest: Mapping[str, Mapping[str, np.ndarray]], baseline: xr.Dataset) -> dict[str, xr.Dataset]:
    """Collect the largest ratios along each axis, by variable, with the labels of the baseline."""
    along = {}
    # the covariance of a calibration is symmetric
    for axis in {axis: None for by_axis in largest.values() for axis in by_axis if axis != "other_parameter"}:
        columns = {name: (axis, by_axis[axis]) for name, by_axis in largest.items() if axis in by_axis}
        # a group of neighbours has the label of the first
        first = {axis: slice(None, None, group_size(baseline.sizes[axis]))}
        labels = {n: v.isel(first) for n, v in baseline.coords.variables.items() if v.dims == (axis,)}
        # n is not among the labels
        if axis in labels and (unit := numbered_unit(baseline, axis)) != unit_of(labels[axis]):
            labels[axis].attrs["units"] = unit
        along[axis] = xr.Dataset(columns, labels)
    return along


def check_comparable(dataset: xr.Dataset, name: str) -> None:
    """Refuse a time history, and a dataset without the coordinates or axes that every result of a sweep has."""
    require_sweep(dataset, name)
    is_current = _attributes_equal(dataset.attrs.get("schema_version"), SCHEMA_VERSION)
    if not is_current or "rtol" not in dataset.attrs:
        description = "a time history" if "t" in dataset.coords else "not a result"
        raise UsageError(f"{name}: is {description}, expected the result of a sweep")
    for coordinate in ("model", "v1", "v2", "m1", "m2"):
        if coordinate not in dataset.coords:
            raise UsageError(f"{name}: has no coordinate {coordinate}, expected a whole result")
    if not {*dataset["model"].dims} <= {"model"}:
        raise UsageError(f"{name}: model is not an axis, expected a whole result")
    axes = {dim for key, v in dataset.variables.items() if is_input(key) for dim in v.dims}
    for variable in (variable for variable in ("v1", "v2", "m1", "m2", *OUTPUTS) if variable in dataset):
        if dataset[variable].dtype.kind not in "fiu":
            raise UsageError(f"{name}: {variable}: got {dataset[variable].dtype}, expected numbers")
        if variable in OUTPUTS and not axes <= set(dataset[variable].dims):
            raise UsageError(f"{name}: {variable} does not vary along all axes, expected a whole result")


def _material_faults(new: xr.Dataset, baseline: xr.Dataset) -> list[Difference]:
    """List the properties that differ between materials of the same name."""
    materials = [read_attribute(dataset.attrs, "materials") for dataset in (new, baseline)]
    faults = []
    for name in materials[0].keys() & materials[1].keys():
        a, b = (table[name] for table in materials)
        for field in a.keys() | b.keys():
            path = f"materials.{name}.{field}"
            # a property that one of them varies is a coordinate
            if a.get(field) != b.get(field) and not (path in new.coords or path in baseline.coords):
                shown = (number(v, 12) for v in (a.get(field), b.get(field)))
                faults.append(changed_config(path, f"{path} is", *shown))
    return sorted(faults, key=lambda fault: fault.name)


def _unit_faults(new: xr.Dataset, baseline: xr.Dataset) -> Iterator[Difference]:
    """List the variables whose units differ."""
    for name in [str(name) for name in baseline.variables if name in new.variables]:
        a, b = (dataset.variables[name].attrs.get("units") for dataset in (new, baseline))
        if not _attributes_equal(a, b):
            yield Difference("units", name, safe_text(f"{name} is in {a}, in BASELINE in {b}"))


def _sweep_notes(new: xr.Dataset, baseline: xr.Dataset, aligned: Alignment) -> Iterator[str]:
    """List what may explain differences between values: solver, versions, and metadata of models."""
    # results of the continuous law have no attribute `integrator`
    defaults = {"rtol": None, "max_steps": None, "integrator": EXACT, "impact_version": None}
    yield from _attribute_notes(new.attrs, baseline.attrs, defaults)
    a, b = (read_attribute(dataset.attrs, "packages") for dataset in (new, baseline))
    yield from _attribute_notes(a, b, dict.fromkeys(sorted({*a, *b})))
    yield from _changed_code(new, baseline)
    a, b = (read_attribute(dataset.attrs, "plugins") for dataset in (new, baseline))
    yield from _attribute_notes(a, b, dict.fromkeys(sorted(a.keys() ^ b.keys())))
    for name in MODEL_METADATA:
        if name in aligned.new.coords and name in aligned.baseline.coords:
            of_models = aligned.baseline["model"], aligned.new[name], aligned.baseline[name]
            for key, x, y in zip(*map(np.ravel, of_models), strict=True):
                if x != y:
                    yield safe_text(f"the {name} of {key} reads {x}, in BASELINE {y}", 600)


def _changed_code(new: xr.Dataset, baseline: xr.Dataset) -> Iterator[str]:
    """Name the laws of the user whose code differs; records of files and hashes say nothing to a reader."""
    a, b = (read_attribute(dataset.attrs, "plugins") for dataset in (new, baseline))
    changed = (key for key in sorted(a.keys() & b.keys()) if a[key] != b[key])
    yield from (f"the code of {safe_text(key, 60)} changed" for key in changed)


def _attribute_notes(
    new: Mapping[Any, Any], baseline: Mapping[Any, Any], defaults: Mapping[str, object]
) -> Iterator[str]:
    """List the attributes that differ, of some with their defaults."""
    for name, default in defaults.items():
        a, b = (attributes.get(name, default) for attributes in (new, baseline))
        if not _attributes_equal(a, b):
            yield safe_text(f"{name} is {a}, in BASELINE {b}", 400)


def _attributes_equal(a: Any, b: Any) -> bool:
    """Return whether two attributes, which may be arrays, are equal."""
    return bool(np.array_equal(a, b))


def effective_tolerances(
    tol: SupportsFloat | str | Tolerances | None, attributes: Mapping[str, Any]
) -> dict[str, float]:
    """Find the tolerances by variable, "all" for the others: the caller's, else the baseline's, else its solver's.

    >>> effective_tolerances({"e_out": 1e-6}, {"rtol": 1e-10, "tolerances": '{"all": 1e-8}'})
    {'all': 1e-08, 'e_out': 1e-06}
    >>> effective_tolerances("1%", {"rtol": 1e-10})
    {'all': 0.01}
    >>> effective_tolerances(1e-7, {"rtol": 1e-10, "tolerances": '{"v1_post": 1e-8}'})
    {'all': 1e-07}
    >>> effective_tolerances(None, {"rtol": 1e-10})
    {'all': 1e-09}
    """
    requested = _by_variable(tol)
    _check_tolerances(requested)
    if ALL_VARIABLES in requested:
        return requested
    rtol = attributes["rtol"]
    if not _is_number(rtol) or not 0.0 < rtol <= 1.0:
        raise ResultError("the attribute rtol of the baseline is invalid")
    try:
        stored = read_attribute(attributes, "tolerances")
        _check_tolerances(stored)
    except (ResultError, UsageError):
        raise ResultError("the attribute tolerances of the baseline is invalid") from None
    return {ALL_VARIABLES: DEFAULT_RTOL_FACTOR * float(rtol), **stored, **requested}


def calibration_tolerances(tol: SupportsFloat | str | Tolerances | None) -> dict[str, float]:
    """Choose the tolerance of all variables of a calibration or a board, relative to their scales."""
    requested = _by_variable(tol)
    for name, value in requested.items():
        if name != ALL_VARIABLES:
            expected = "expected one for all, such as 1e-5"
            raise UsageError(f"{argument('tol', key=name)}: got a tolerance for one variable, {expected}")
        if not _is_number(value) or not 0.0 <= value < math.inf:
            raise UsageError(f"{argument('tol', value)}: expected a number >= 0, such as 1e-5")
    return {ALL_VARIABLES: CALIBRATION_TOLERANCE} | requested


def _by_variable(tol: SupportsFloat | str | Tolerances | None) -> dict[str, float]:
    """Convert what a caller passed to tolerances by name."""
    by_name = dict(tol or {}) if isinstance(tol, Mapping) or tol is None else {ALL_VARIABLES: tol}
    return {name: _as_number(value) for name, value in by_name.items()}


def _as_number(value: Any) -> Any:
    """Convert a text, which may be in percent, or a value of another library; what is no number is unchanged."""
    try:
        return read_number(value, Quantity("1", ""), "tol")
    except UsageError:
        return value


def _check_tolerances(tolerances: Mapping[str, Any]) -> None:
    """Refuse names without a tolerance, and values that are not a number >= 0."""
    for name, value in tolerances.items():
        if name != ALL_VARIABLES and name not in TOLERANCE_VARIABLES:
            has_none = {
                "exact": "has no tolerance, it is judged exactly;",
                "reported": "has no tolerance, it is not judged;",
            }
            how = has_none[OUTPUTS[name].scale] if name in OUTPUTS else "not a variable of a result;"
            raise UsageError(
                f"{argument('tol', key=str(name))}: {how} {did_you_mean(str(name), TOLERANCE_VARIABLES)}"
            )
        if not _is_number(value) or not 0.0 <= value <= sys.float_info.max:
            shown = value if name == ALL_VARIABLES else {name: value}
            raise UsageError(f"{argument('tol', shown)}: expected a number >= 0, such as 1e-8")


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)
