"""Two results laid point on point by their labels, and what keeps them from fitting."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from ..results.schema import is_input
from ..results.select import NUMBERS, ROUNDING, Places, Values, matched
from ..text import safe_text
from .verdict import Fault, Kind

NAMED = 3  # labels of one side that a message names


@dataclass(frozen=True)
class Aligned:
    """Two results at their common points, in the order of the baseline, and in what their inputs differ.

    Both are empty where they have no point in common.
    """

    new: xr.Dataset
    baseline: xr.Dataset
    faults: tuple[Fault, ...]


def align(new: xr.Dataset, baseline: xr.Dataset, *, subset: bool) -> Aligned:
    """Lay two results point on point; what only one of them varies is an axis of length one in the other.

    Parameters
    ----------
    new, baseline : results
    subset : points that only one of them has are no fault
    """
    new, baseline = _without_foreign_axes(new, baseline), _without_foreign_axes(baseline, new)
    new, baseline = _stretched(new, baseline), _stretched(baseline, new)
    faults = _inputs_of_one_side(new, baseline)
    places: dict[str, tuple[Places, Places]] = {}
    for axis in map(str, dict.fromkeys((*baseline.dims, *new.dims))):
        columns = _columns(new, axis), _columns(baseline, axis)
        if columns[0] != columns[1] or not columns[0]:
            own, other = _listed(columns[0]), _listed(columns[1])
            text = f"what varies along the axis {safe_text(axis)} is {own}, in BASELINE {other}"
            faults.append(Fault("nothing in common", axis, text))
            continue
        places[axis] = matched([new[n].values for n in columns[0]], [baseline[n].values for n in columns[0]])
        # the axis has its first column's name
        names = [*(n for n in columns[0] if n == axis), *(n for n in columns[0] if n != axis)]
        rows = [[dataset[name].values for name in names] for dataset in (new, baseline)]
        faults += _labels(rows[0], rows[1], names, places[axis], subset=subset)
    for name in sorted(str(name) for name in new.coords.keys() & baseline.coords.keys() if is_input(str(name))):
        if new[name].ndim == baseline[name].ndim == 0 and not _same(new[name].values, baseline[name].values):
            kind: Kind = "nothing in common" if subset else "physics config"
            text = f"{safe_text(name)} is {_shown(new[name].values)}, in BASELINE {_shown(baseline[name].values)}"
            faults.append(Fault(kind, name, text))
    if any(fault.kind == "nothing in common" for fault in faults):
        return Aligned(xr.Dataset(), xr.Dataset(), tuple(faults))
    new = new.isel({axis: own for axis, (own, _) in places.items()})
    baseline = baseline.isel({axis: other for axis, (_, other) in places.items()})
    return Aligned(new.transpose(*baseline.dims), baseline, (*faults, *_derived(new, baseline)))


def _without_foreign_axes(own: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """A result without the parameters of models that the other has not got; the others do not vary with them."""
    models = {str(key) for key in np.ravel(other["model"].values)}
    foreign = [str(n) for n in own.coords if "." in str(n) and str(n).rpartition(".")[0] not in models]
    return own.isel({name: 0 for name in foreign if name in own.dims}).drop_vars(foreign)


def _stretched(own: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """A result in which a single value that the other varies is an axis of length one."""
    for axis in map(str, other.dims):
        if axis not in own.dims and axis in own.coords and own[axis].ndim == 0:
            varying = [n for n in own.variables if n in other.variables and axis in other.variables[n].dims]
            own = along(own, axis, varying)
    # a member of a zip group in the other, which here does not vary along their common axis
    constant = {
        name: other[name].dims
        for name in own.coords.keys() & other.coords.keys()
        if own[name].ndim == 0 and other[name].ndim == 1 and other[name].dims[0] in own.dims
    }
    repeated = {
        n: (dims, np.repeat(own[n].values, own.sizes[dims[0]]), own[n].attrs) for n, dims in constant.items()
    }
    return own.assign_coords(repeated)


def along(own: xr.Dataset, axis: str, names: Iterable[Hashable]) -> xr.Dataset:
    """A result in which some variables have one more axis, of length one."""
    changed = {
        n: xr.Variable((axis, *own.variables[n].dims), own.variables[n].values[np.newaxis], own.variables[n].attrs)
        for n in names
    }
    own = own.assign_coords({n: v for n, v in changed.items() if n in own.coords})
    return own.assign({n: v for n, v in changed.items() if n not in own.coords})


def _inputs_of_one_side(new: xr.Dataset, baseline: xr.Dataset) -> list[Fault]:
    found = []
    for name in sorted(str(name) for name in new.coords.keys() ^ baseline.coords.keys()):
        if is_input(name):
            side = "NEW" if name in new.coords else "BASELINE"
            found.append(Fault("physics config", name, f"{safe_text(name)} is given in {side} only"))
    return found


def _columns(dataset: xr.Dataset, axis: str) -> list[str]:
    """The coordinates that tell the places on an axis: its own, and the others of its zip group."""
    if axis == "model":
        return ["model"]
    derived = {"e"} if "alpha" in dataset.coords else set()
    along = [str(name) for name, one in dataset.coords.items() if one.dims == (axis,)]
    return sorted(name for name in along if is_input(name) and name not in derived)


def _labels(
    new: Sequence[Values],
    baseline: Sequence[Values],
    names: Sequence[str],
    places: tuple[Places, Places],
    *,
    subset: bool,
) -> list[Fault]:
    """The labels of an axis that only one side has; those of a zip group with all their columns."""
    axis = names[0]
    if not len(places[0]):
        sides = f"{_some(new, names)}, in BASELINE {_some(baseline, names)}"
        return [Fault("nothing in common", axis, f"no value of {safe_text(axis)} is in both: {sides}")]
    if subset:
        return []
    told = []
    for columns, own, side in ((new, places[0], "NEW"), (baseline, places[1], "BASELINE")):
        alone = [np.delete(values, own) for values in columns]
        if len(alone[0]):
            told.append(f"{len(alone[0])} of {len(columns[0])} in {side} only: {_some(alone, names)}")
    return [Fault("labels", axis, f"{safe_text(axis)}: {'; '.join(told)}")] if told else []


def _derived(new: xr.Dataset, baseline: xr.Dataset) -> list[Fault]:
    """Coordinates along several axes, or along models, that have other values: e by alpha, the exponent."""
    found = []
    for name in sorted(str(name) for name in new.coords.keys() & baseline.coords.keys()):
        if name == "exponent" or (is_input(name) and baseline[name].ndim):
            a, b = new[name], baseline[name]
            # e = 1 - alpha v0 is rounded as 1 is
            rounding = ROUNDING if name == "e" else 0.0
            if set(a.dims) != set(b.dims) or not _same(a.transpose(*b.dims).values, b.values, rounding):
                found.append(Fault("labels", name, f"the coordinate {safe_text(name)} has other values"))
    return found


def _same(a: Values, b: Values, rounding: float = 0.0) -> bool:
    """Whether all are the same but for rounding, relative, and to so much where they are computed."""
    if a.dtype.kind in NUMBERS and b.dtype.kind in NUMBERS:
        return bool(np.isclose(a, b, rtol=ROUNDING, atol=rounding, equal_nan=True).all())
    return bool(np.all(a.astype(str) == b.astype(str)))


def _some(columns: Sequence[Values], names: Sequence[str]) -> str:
    """The first few labels."""
    shown = []
    for first, *others in zip(*(values[:NAMED] for values in columns), strict=True):
        more = (f" with {safe_text(n)}={_shown(v)}" for n, v in zip(names[1:], others, strict=True))
        shown.append(_shown(first) + "".join(more))
    return ", ".join(shown) + (", ..." if len(columns[0]) > NAMED else "")


def _shown(value: Any) -> str:
    plain = np.asarray(value).item()
    return f"{plain:.12g}" if isinstance(plain, float) else safe_text(str(plain), 60)


def _listed(names: Sequence[str]) -> str:
    return safe_text(", ".join(names)) or "nothing"
