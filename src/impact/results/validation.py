"""Validate a dataset as a result or a time history: its names, axes, types and attributes.

`load` ignores other names, `save` refuses them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import xarray as xr

from ..config.input_names import InputName
from ..config.tables import MATERIAL_KEYS, MATERIAL_QUANTITIES, SWEEP_QUANTITIES
from ..contact.simulate import TABLE_COLUMNS
from ..contact.status import STATUSES
from ..errors import ResultError
from ..text import safe_text
from .attributes import ATTRIBUTE_TYPES, read_attribute
from .calibration import (
    CALIBRATION_COORDINATES,
    CALIBRATION_TEXTS,
    CALIBRATION_VARIABLES,
    FIT_STATUSES,
)
from .kinds import is_calibration, is_sensitivity
from .schema import HISTORY_VARIABLES, MODEL_METADATA, SCHEMA, is_case
from .sensitivity import SENSITIVITY_COORDINATES, SENSITIVITY_VARIABLES
from .slabs import VARIES_ALONG, is_lazy, slabs

RESULT_VARIABLES = frozenset(variable.name for variable in SCHEMA)
HISTORY_NAMES = frozenset(name for name, _, _ in HISTORY_VARIABLES)  # over the time t
TEXT_COORDINATES = frozenset({"model", *MODEL_METADATA, *MATERIAL_KEYS, *CALIBRATION_TEXTS, "input"} - {"year"})
# the trajectory table of a factored file, see `impact.results.factored`
TABLE_VARIABLES = frozenset(
    {
        *(f"trajectory_{name}" for name in TABLE_COLUMNS),
        "trajectory_of_cell",
        "law_stiffness",
        "witness_index",
        *(f"witness_{name}" for name in RESULT_VARIABLES),
    }
)
ALLOWED_NAMES = (
    RESULT_VARIABLES
    | HISTORY_NAMES
    | TEXT_COORDINATES
    | TABLE_VARIABLES
    | CALIBRATION_VARIABLES.keys()
    | CALIBRATION_COORDINATES
    | SENSITIVITY_VARIABLES.keys()
    | frozenset(SENSITIVITY_COORDINATES)
    | {"t", "year", "exponent", *SWEEP_QUANTITIES}
)
# a parameter of one model: the key of the model, and a Python identifier
PARAMETER_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*\.[^\W\d]\w*")


def is_name(name: str) -> bool:
    """Whether a variable of a result may have this name.

    >>> is_name("e_out"), is_name("ismail-stronge-2008.gamma"), is_name("materials.steel.E"), is_name("twice")
    (True, True, True, False)
    """
    if name in ALLOWED_NAMES or PARAMETER_NAME.fullmatch(name) or is_case(name):
        return True
    parsed = InputName.parse(name)
    # netCDF separates names by spaces, HDF5 separates groups by slashes
    is_legal = parsed.material.isprintable() and re.fullmatch(r"[^\s/]+", parsed.material) is not None
    return parsed.key in MATERIAL_QUANTITIES and is_legal


def is_quantity(name: str, axes: tuple[str, ...]) -> bool:
    """Whether a variable is an output; inputs are coordinates. The velocity of a ball may be either."""
    of_study = name in CALIBRATION_VARIABLES or name in SENSITIVITY_VARIABLES
    return name in RESULT_VARIABLES or of_study or (name in HISTORY_NAMES and axes == ("t",))


# required attributes of a result: text, in part JSON, and numbers
TEXT_ATTRIBUTES = ("title", "config", "config_set", "fingerprint", "impact_version", "packages", "plugins")
NUMBER_ATTRIBUTES = ("rtol", "max_steps")
# attributes of factored files, which a dataset does not have
FACTORED_ATTRIBUTES = ("laws", "axes", "summary")
# statuses that are checked at a time
STATUS_SLAB_POINTS = 2**22
# by name of a variable of a result
ALLOWED_DTYPES = {
    variable.name: [np.dtype(variable.dtype)] if variable.dtype != "f8" else [np.dtype("f8"), np.dtype("f4")]
    for variable in SCHEMA
}


def schema_violation(dataset: xr.Dataset) -> str | None:
    """The first reason why a dataset is neither a result nor a time history, or None."""
    checks = (
        _name_violations,
        _axis_violations,
        _type_violations,
        _attribute_violations,
        _history_violations if "t" in dataset.dims else _result_violations,
        _calibration_violations,
        _sensitivity_violations,
    )
    return next((safe_text(fault) for check in checks for fault in check(dataset)), None)


def _name_violations(dataset: xr.Dataset) -> Iterator[str]:
    unknown = sorted({str(name) for name in (*dataset.variables, *dataset.dims) if not is_name(str(name))})
    if unknown:
        yield f"{', '.join(unknown)}: not a variable of a result"


def _axis_violations(dataset: xr.Dataset) -> Iterator[str]:
    for name, size in dataset.sizes.items():
        if name not in dataset.coords or not size:
            yield f"its axis {name} has no values"


def _type_violations(dataset: xr.Dataset) -> Iterator[str]:
    for name, variable in dataset.variables.items():
        if variable.dtype.kind not in ("UO" if name in TEXT_COORDINATES else "iuf"):
            yield f"{name}: expected numbers or labels of the right type"
        wrong = name in ALLOWED_DTYPES and variable.dtype not in ALLOWED_DTYPES[str(name)]
        if wrong:
            yield f"{name}: got {variable.dtype}, expected {' or '.join(map(str, ALLOWED_DTYPES[str(name)]))}"
        if not all(isinstance(variable.attrs.get(about, ""), str) for about in ("units", "long_name")):
            yield f"{name}: units or long_name is not text"


def _attribute_violations(dataset: xr.Dataset) -> Iterator[str]:
    for key in FACTORED_ATTRIBUTES:
        if key in dataset.attrs:
            yield f"{key}: an attribute of files in layout factored"
    for key in ATTRIBUTE_TYPES:
        try:
            read_attribute(dataset.attrs, key)
        except ResultError as error:
            yield str(error)


def _history_violations(dataset: xr.Dataset) -> Iterator[str]:
    for name, variable in dataset.variables.items():
        if variable.dims != (() if name == "model" else ("t",)):
            yield f"{name}: expected t as its only axis"


def _result_violations(dataset: xr.Dataset) -> Iterator[str]:
    if "model" not in dataset.dims:
        yield "model is not an axis; select models as a list, sel(model=[...])"
    elif not dataset.indexes["model"].is_unique:
        yield "a model occurs twice"
    for name in MODEL_METADATA:
        if name not in dataset or dataset[name].dims != ("model",):
            yield f"{name} of the models is missing"
    for variable in SCHEMA:
        if variable.name in dataset and variable.per == "axes" and "model" in dataset[variable.name].dims:
            yield f"{variable.name}: lies along model"
    if "status" in dataset and _has_unknown_status(dataset["status"]):
        yield "status: got a number that is no status"
    for key in TEXT_ATTRIBUTES:
        if not isinstance(dataset.attrs.get(key), str):
            yield f"no {key}, or not as text"
    for key in NUMBER_ATTRIBUTES:
        if not isinstance(dataset.attrs.get(key), int | float | np.number):
            yield f"no {key}, or not as a number"


# coordinates of a calibration with their dimension
CALIBRATION_AXES = {
    "parameter": "parameter",
    "other_parameter": "other_parameter",
    "point": "point",
    "line": "point",
    "output": "point",
    "measured": "point",
    "sigma": "point",
    "determined": "model",
}
CALIBRATION_ATTRIBUTES = ("noise", "data_file", "varied", "fit_paths", "fit_bounds")


def _calibration_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Faults of a calibration: it has all of its variables, on their own axes."""
    if not is_calibration(dataset):
        strange = sorted((CALIBRATION_VARIABLES.keys() | CALIBRATION_COORDINATES) & set(dataset.variables))
        if strange:
            yield f"{', '.join(strange)}: of a calibration, which has the axis parameter"
        return
    grid = bool(dataset.attrs.get("varied"))
    for name, variable in CALIBRATION_VARIABLES.items():
        dims = variable.dims
        if ("grid" in dims and not grid) or (variable.is_new and name not in dataset):
            continue
        if name not in dataset or dataset[name].dims != dims:
            found = "none" if name not in dataset else ", ".join(map(str, dataset[name].dims)) or "no axes"
            yield f"{name}: got {found}, expected {', '.join(dims)}"
        else:
            kinds = "i" if name in ("identifiable", "fit_status") else "f"
            if dataset[name].dtype.kind != kinds:
                yield f"{name}: got {dataset[name].dtype}, expected {'int8' if kinds == 'i' else 'float64'}"
    for name, dim in CALIBRATION_AXES.items() | (
        {("grid", "grid"), ("output_name", "output_name")} if grid else set()
    ):
        if name not in dataset.coords or dataset[name].dims != (dim,):
            yield f"{name}: expected a coordinate along {dim}"
    for key in CALIBRATION_ATTRIBUTES:
        if not isinstance(dataset.attrs.get(key), str):
            yield f"no {key}, or not as text"
    paths = read_attribute(dataset.attrs, "fit_paths")
    if len(paths) != dataset.sizes.get("parameter"):
        yield "fit_paths: expected a config path for each parameter"
    if "fit_status" in dataset and not np.isin(dataset["fit_status"].values, range(len(FIT_STATUSES))).all():
        yield "fit_status: got a number that is no outcome of a fit"


def _sensitivity_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Faults of a sensitivity study: it has all of its variables, along the models and the same axes."""
    if not is_sensitivity(dataset):
        strange = sorted((SENSITIVITY_VARIABLES.keys() | {*SENSITIVITY_COORDINATES}) & set(dataset.variables))
        if strange:
            yield f"{', '.join(strange)}: of a sensitivity study, which has the axis input"
        return
    if "mean" not in dataset:
        yield "mean: got none"
        return
    common = dataset["mean"].dims
    for name, (own, _) in SENSITIVITY_VARIABLES.items():
        dims = (*common, own) if own else common
        if name not in dataset or dataset[name].dims != dims:
            found = "none" if name not in dataset else ", ".join(map(str, dataset[name].dims)) or "no axes"
            yield f"{name}: got {found}, expected {', '.join(map(str, dims))}"
    for name in SENSITIVITY_COORDINATES:
        if name not in dataset.coords or dataset[name].dims != (name,):
            yield f"{name}: expected a coordinate along {name}"
    if dataset.attrs.get("of") not in RESULT_VARIABLES:
        yield "of: expected the name of an output"
    if not read_attribute(dataset.attrs, "design"):
        yield "no design"


def _has_unknown_status(status: xr.DataArray) -> bool:
    """Whether a status is unknown; computed statuses are always known."""
    if is_lazy(status.variable) and VARIES_ALONG in status.encoding:
        return False
    parts = (status.isel(where).values for where in slabs(status.sizes, STATUS_SLAB_POINTS))
    return any(not np.isin(np.unique(part), STATUSES).all() for part in parts)
