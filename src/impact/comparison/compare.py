"""Judge a result by a baseline, as the SCHEMA says: the guard of stored datasets against silent changes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..errors import UsageError
from ..results.attributes import json_object, json_table
from ..results.backend import load
from ..results.replay import repeats
from ..results.schema import ABOUT_A_MODEL, SCHEMA, SCHEMA_VERSION, is_input
from ..text import safe_text
from .align import align, along
from .judge import judge
from .tolerances import ALL, Tolerances, in_effect
from .verdict import Fault, Judged, Verdict

# what varies with the model
OF_A_MODEL = ("model", "exponent", *ABOUT_A_MODEL, *(one.name for one in SCHEMA if one.per == "model"))


def compare(
    new: str | Path | xr.Dataset,
    baseline: str | Path | xr.Dataset,
    *,
    tol: float | Tolerances | None = None,
    subset: bool = False,
) -> Verdict:
    """Judge a result by another one, each variable as docs/schema.md says, at the points of equal labels.

    A value is equal where |new - baseline| <= tolerance x scale, the scale being that of the baseline's point. NaN
    equals NaN where both points have the same status and no such answer, or the law has no such quantity.

    Parameters
    ----------
    new, baseline : results, or their files
    tol : one tolerance for all variables, relative to the scale of a point, or by name, "all" for the others; by
        default what the baseline carries, else 10 times its solver's rtol
    subset : judge what both have, and do not mind what only one has

    Raises
    ------
    ResultError : a file is not a readable result
    UsageError : a dataset is no result of a sweep, or a tolerance is not right

    >>> import impact
    >>> result = impact.sweep("configs/figure6.toml")
    >>> print(impact.compare(result, result))
    equal: 19 variables, 5,353 values, none differs
    >>> print(impact.compare(result.isel(e=slice(50)), result))
    not equal: labels (e)
    labels: e: 51 of 101 in BASELINE only: 0.5, 0.51, 0.52, ...
    """
    files = [str(one) if isinstance(one, str | Path) else "" for one in (new, baseline)]
    names = files[0] or "NEW", files[1] or "BASELINE"
    a, b = (load(one) if isinstance(one, str | Path) else one for one in (new, baseline))
    for dataset, name in zip((a, b), names, strict=True):
        check_result(dataset, name)
    strange = sorted({*_strange(a), *_strange(b)})
    a, b = _known(a), _known(b)
    tolerances = in_effect(tol, b.attrs)
    aligned = align(a, b, subset=subset)
    faults = [*aligned.faults, *_materials(a, b), *_units(a, b)]
    notes = [*_notes(a, b), *_texts(aligned.new, aligned.baseline)]
    notes += [safe_text(f"not judged: {', '.join(strange)}")] if strange else []
    if any(fault.kind == "labels" for fault in faults) and not subset:
        notes.append("--subset judges what both have")
    judged: list[Judged] = []
    ratios: dict[str, xr.Variable] = {}
    for one in SCHEMA:
        sides = [side for side, dataset in (("NEW", a), ("BASELINE", b)) if one.name in dataset]
        if len(sides) == 1 and subset:
            notes.append(f"{one.name} is in {sides[0]} only")
        elif len(sides) == 1:
            faults.append(Fault("missing variable", one.name, f"{one.name} is in {sides[0]} only"))
        elif one.name not in aligned.baseline:
            continue
        elif set(aligned.new[one.name].dims) != set(aligned.baseline[one.name].dims):
            faults.append(Fault("labels", one.name, f"{one.name} varies along other axes"))
        else:
            found, ratio = judge(one, aligned.new, aligned.baseline, tolerances.get(one.name, tolerances[ALL]))
            judged.append(found)
            ratios[one.name] = ratio
    if not judged and not faults:
        faults.append(Fault("nothing in common", "", "the two have no variable in common"))
    return Verdict(
        new=names[0], baseline=names[1], faults=tuple(faults), variables=tuple(judged), notes=tuple(notes),
        repeats=repeats(files[0], a) or repeats(files[1], b),
        ratios=xr.Dataset(ratios, aligned.baseline.coords),
    )  # fmt: skip


def check_result(dataset: xr.Dataset, name: str) -> None:
    """Refuse what is no result of a sweep.

    Raises
    ------
    UsageError : it is a time history, or lacks what every result has
    """
    shown = safe_text(name)
    is_current = _alike(dataset.attrs.get("schema_version"), SCHEMA_VERSION)
    if not is_current or "rtol" not in dataset.attrs:
        about = "a time history" if "t" in dataset.coords else "not a result"
        raise UsageError(f"{shown}: is {about}; compare takes results of a sweep")
    for coordinate in ("model", "v1", "v2", "m1", "m2"):
        if coordinate not in dataset.coords:
            raise UsageError(f"{shown}: has no coordinate {coordinate}; compare takes whole results")
        if coordinate != "model" and dataset[coordinate].dtype.kind not in "fiu":
            raise UsageError(f"{shown}: {coordinate} holds {dataset[coordinate].dtype}, wants numbers")
    axes = {dim for name, v in dataset.variables.items() if is_input(str(name)) for dim in v.dims}
    for one in SCHEMA:
        if one.name in dataset and dataset[one.name].dtype.kind not in "fiu":
            raise UsageError(f"{shown}: {one.name} holds {dataset[one.name].dtype}, wants numbers")
        if one.name in dataset and not axes <= set(dataset[one.name].dims):
            raise UsageError(f"{shown}: {one.name} does not vary along all axes; compare takes whole results")


def _strange(dataset: xr.Dataset) -> list[str]:
    """The variables that no result has."""
    known = {*OF_A_MODEL, *(one.name for one in SCHEMA)}
    return [str(name) for name in dataset.variables if name not in known and not is_input(str(name))]


def _known(dataset: xr.Dataset) -> xr.Dataset:
    """A result without what no result has, and with an axis of models, also where one model was picked out."""
    dataset = dataset.drop_vars(_strange(dataset))
    if "model" in dataset.dims:
        return dataset
    return along(dataset, "model", [name for name in OF_A_MODEL if name in dataset.variables])


def _materials(new: xr.Dataset, baseline: xr.Dataset) -> list[Fault]:
    """Properties that differ between materials of the same name."""
    own, other = (json_table(dataset, "materials") for dataset in (new, baseline))
    found = []
    for name in own.keys() & other.keys():
        for field in own[name].keys() | other[name].keys():
            a, b = own[name].get(field), other[name].get(field)
            if a != b:
                path = f"materials.{name}.{field}"
                a, b = (f"{one:.12g}" if isinstance(one, float) else one for one in (a, b))
                found.append(Fault("physics config", path, safe_text(f"{path} is {a}, in BASELINE {b}")))
    return sorted(found, key=lambda fault: fault.name)


def _units(new: xr.Dataset, baseline: xr.Dataset) -> list[Fault]:
    found = []
    for name in [str(name) for name in baseline.variables if name in new.variables]:
        a, b = (dataset.variables[name].attrs.get("units") for dataset in (new, baseline))
        if not _alike(a, b):
            text = f"{name} is in {a}, in BASELINE in {b}"
            found.append(Fault("units", name, safe_text(text)))
    return found


def _notes(new: xr.Dataset, baseline: xr.Dataset) -> list[str]:
    """What may explain a difference, and is no difference by itself."""
    found = []
    for name in ("rtol", "max_steps", "impact_version"):
        a, b = (dataset.attrs.get(name) for dataset in (new, baseline))
        if not _alike(a, b):
            found.append(safe_text(f"{name} is {a}, in BASELINE {b}", 400))
    for name in ("packages", "plugins"):
        own, other = (json_object(dataset, name) for dataset in (new, baseline))
        found += [
            safe_text(f"{key} is {own.get(key)}, in BASELINE {other.get(key)}", 400)
            for key in sorted(own.keys() | other.keys())
            if own.get(key) != other.get(key)
        ]
    return found


def _alike(a: Any, b: Any) -> bool:
    """Whether two attributes are equal; from elsewhere, they may be arrays."""
    return bool(np.array_equal(a, b))


def _texts(new: xr.Dataset, baseline: xr.Dataset) -> list[str]:
    """Models about which another thing is said."""
    found = []
    for name in ABOUT_A_MODEL:
        if name in new.coords and name in baseline.coords:
            told = (np.ravel(one) for one in (baseline["model"], new[name], baseline[name]))
            for key, a, b in zip(*told, strict=True):
                if a != b:
                    found.append(safe_text(f"the {name} of {key} reads {a}, in BASELINE {b}", 600))
    return found
