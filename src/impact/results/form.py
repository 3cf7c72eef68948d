"""What a result has to be like for the commands to make sense of it, checked when it is stored and when read."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

import numpy as np
import xarray as xr

from ..contact.status import Status
from ..text import safe_text
from .names import ABOUT_MODELS, TEXTS, is_name
from .schema import SCHEMA
from .slabs import MAX_SUMMARY_POINTS, distinct, is_computed, slabs

# attributes of a result that the program reads: text, numbers, and text that is JSON of a kind
TEXT = ("title", "config", "config_set", "fingerprint", "impact_version", "packages", "plugins")
NUMBERS = ("rtol", "max_steps")
JSON: Mapping[str, type] = {
    "config_set": list, "packages": dict, "plugins": dict, "materials": dict, "tolerances": dict, "inputs": dict,
}  # fmt: skip
KNOWN = [int(status) for status in Status]


def misfit(dataset: xr.Dataset) -> str | None:
    """The first reason why a dataset is no result and no time history, or None."""
    checks = (_names, _axes, _kinds, _json, _history if "t" in dataset.dims else _result)
    return next((safe_text(fault) for check in checks for fault in check(dataset)), None)


def _names(dataset: xr.Dataset) -> Iterator[str]:
    unknown = sorted({str(name) for name in (*dataset.variables, *dataset.dims) if not is_name(str(name))})
    if unknown:
        yield f"{', '.join(unknown)}: no name of a result"


def _axes(dataset: xr.Dataset) -> Iterator[str]:
    for name, size in dataset.sizes.items():
        if name not in dataset.coords or not size:
            yield f"its axis {name} has no values"


def _kinds(dataset: xr.Dataset) -> Iterator[str]:
    for name, one in dataset.variables.items():
        if one.dtype.kind not in ("UO" if name in TEXTS else "iuf"):
            yield f"{name}: neither numbers nor labels, or one for the other"
        if not all(isinstance(one.attrs.get(about, ""), str) for about in ("units", "long_name")):
            yield f"{name}: units or long_name that are no text"


def _json(dataset: xr.Dataset) -> Iterator[str]:
    for key, kind in JSON.items():
        if key in dataset.attrs and not isinstance(_parsed(dataset.attrs[key]), kind):
            yield f"{key}: no JSON of the right kind"


def _parsed(text: object) -> object:
    try:
        return json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        return None


def _history(dataset: xr.Dataset) -> Iterator[str]:
    for name, one in dataset.variables.items():
        if one.dims != (() if name == "model" else ("t",)):
            yield f"{name}: does not lie along t alone"


def _result(dataset: xr.Dataset) -> Iterator[str]:
    if "model" not in dataset.dims:
        yield "model is no axis; select models as a list, sel(model=[...])"
    elif not dataset.indexes["model"].is_unique:
        yield "a model stands twice in it"
    for name in ABOUT_MODELS:
        if name not in dataset or dataset[name].dims != ("model",):
            yield f"{name} of the models is missing"
    for one in SCHEMA:
        if one.name in dataset and one.per == "axes" and "model" in dataset[one.name].dims:
            yield f"{one.name}: lies along model"
    if "status" in dataset and not _has_known_statuses(dataset):
        yield "status: a number without a meaning"
    for key in TEXT:
        if not isinstance(dataset.attrs.get(key), str):
            yield f"no {key}, or not as text"
    for key in NUMBERS:
        if not isinstance(dataset.attrs.get(key), int | float | np.number):
            yield f"no {key}, or not as a number"


def _has_known_statuses(dataset: xr.Dataset) -> bool:
    """Whether each status has a meaning, as far as it is read from a file, or evaluated for a summary."""
    models = [dataset.isel(model=model) for model in range(dataset.sizes.get("model", 0))] or [dataset]
    variables = (distinct(of_model, "status")[0] for of_model in models)
    return all(
        np.isin(variable.isel(where).values, KNOWN).all()
        for variable in variables
        if variable.size <= MAX_SUMMARY_POINTS or not is_computed(variable)
        for where in slabs(variable.sizes)
    )
