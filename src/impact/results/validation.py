"""Validate a dataset as a result or a time history: its names, axes, types and attributes.

`load` ignores other names, `save` refuses them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence

import numpy as np
import xarray as xr

from ..config.input_names import InputName
from ..config.tables import MATERIAL_KEYS, MATERIAL_QUANTITIES, SWEEP_QUANTITIES
from ..contact.simulate import TABLE_COLUMNS
from ..contact.status import FRICTION_STATUSES, STATUSES
from ..contact.tangential import TangentialResult
from ..contact.variables import AXES, OUTPUTS
from ..errors import ResultError
from ..formatting import safe_text
from .attributes import ATTRIBUTE_TYPES, read_attribute
from .kinds import Kind, kind_of
from .schema import (
    CALIBRATION_TEXTS,
    CHECK_STATUSES,
    FIT_STATUSES,
    MODEL_METADATA,
    SCHEMA,
    STUDY_COORDINATES,
    is_case,
)
from .slabs import VARIES_ALONG, is_lazy, slabs

TEXT_COORDINATES = frozenset(
    {"model", "friction", *MODEL_METADATA, *MATERIAL_KEYS, *CALIBRATION_TEXTS, "input"} - {"year"}
).union(STUDY_COORDINATES["board"])
# the trajectory table of a factored file, see `impact.results.factored`
TABLE_VARIABLES = frozenset(
    {
        *(f"trajectory_{name}" for name in TABLE_COLUMNS),
        *(f"tangential_{name}" for name in TangentialResult.columns()),
        "trajectory_of_cell",
        "law_stiffness",
        "witness_index",
        "witness_pair_index",
        *(f"witness_{name}" for name in OUTPUTS),
    }
)
ALLOWED_NAMES = TEXT_COORDINATES.union(
    TABLE_VARIABLES,
    *SCHEMA.values(),
    *STUDY_COORDINATES.values(),
    ("t", "year", "exponent", *SWEEP_QUANTITIES),
)
# a parameter of one model or friction law: the key of the law, and a Python identifier
PARAMETER_NAME = re.compile(r"(friction\.)?[a-z0-9]+(-[a-z0-9]+)*\.[^\W\d]\w*")


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
    kinds = {kind for kind, variables in SCHEMA.items() if name in variables}
    return bool(kinds - {"history"}) or (bool(kinds) and axes == ("t",))


# required attributes of a result: text, in part JSON, and numbers
TEXT_ATTRIBUTES = ("title", "config", "config_set", "fingerprint", "impact_version", "packages", "plugins")
NUMBER_ATTRIBUTES = ("rtol", "max_steps")
BOARD_ATTRIBUTES = ("title", "suite", "impact_version", "packages")
CALIBRATION_ATTRIBUTES = ("noise", "data_file", "varied", "fit_paths", "fit_bounds")
# attributes of factored files, which a dataset does not have
FACTORED_ATTRIBUTES = ("laws", "axes", "summary", "pairs", "frictions")
# statuses that are checked at a time
STATUS_SLAB_POINTS = 2**22


def schema_violation(dataset: xr.Dataset) -> str | None:
    """The first reason why a dataset is neither a result nor a time history, or None."""
    checks = (
        _name_violations,
        _axis_violations,
        _type_violations,
        _attribute_violations,
        FORM_VIOLATIONS.get(kind_of(dataset), _result_violations),
        _study_violations,
    )
    return next((safe_text(fault) for check in checks for fault in check(dataset)), None)


def _name_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Names that no result has."""
    unknown = sorted({str(name) for name in (*dataset.variables, *dataset.dims) if not is_name(str(name))})
    if unknown:
        yield f"{', '.join(unknown)}: not a variable of a result"


def _axis_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Axes without values."""
    for name, size in dataset.sizes.items():
        if name not in dataset.coords or not size:
            yield f"its axis {name} has no values"


def _type_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Variables of another type than that of the SCHEMA, and units or meanings that are not text."""
    declared = {**OUTPUTS, **SCHEMA[kind_of(dataset)]}
    for name, variable in dataset.variables.items():
        if variable.dtype.kind not in ("UO" if name in TEXT_COORDINATES else "iuf"):
            yield f"{name}: expected numbers or labels of the right type"
        if name in declared and name not in dataset.coords:
            dtype = declared[str(name)].dtype
            allowed = [np.dtype(code) for code in (("f8", "f4") if dtype == "f8" else (dtype,))]
            if variable.dtype not in allowed:
                yield f"{name}: got {variable.dtype}, expected {' or '.join(map(str, allowed))}"
        if not all(isinstance(variable.attrs.get(key, ""), str) for key in ("units", "long_name")):
            yield f"{name}: units or long_name is not text"


def _attribute_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Attributes of files only, and JSON of another type than expected."""
    for key in FACTORED_ATTRIBUTES:
        if key in dataset.attrs:
            yield f"{key}: an attribute of files in layout factored"
    for key in ATTRIBUTE_TYPES:
        try:
            read_attribute(dataset.attrs, key)
        except ResultError as error:
            yield str(error)


def _history_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Variables of a time history along other axes than t."""
    for name, variable in dataset.variables.items():
        if variable.dims != (() if name in ("model", "friction") else ("t",)):
            yield f"{name}: expected t as its only axis"


def _result_violations(dataset: xr.Dataset) -> Iterator[str]:
    """What every result has: models with metadata, known statuses and attributes."""
    if "model" not in dataset.dims:
        yield "model is not an axis; select models as a list, sel(model=[...])"
    elif not dataset.indexes["model"].is_unique:
        yield "a model occurs twice"
    for name in MODEL_METADATA:
        if name not in dataset or dataset[name].dims != ("model",):
            yield f"{name} of the models is missing"
    for name, variable in OUTPUTS.items():
        if name in dataset and not variable.per_model and "model" in dataset[name].dims:
            yield f"{name}: lies along model"
    for name, statuses in (("status", STATUSES), ("friction_status", FRICTION_STATUSES)):
        if name in dataset and _has_unknown_status(dataset[name], statuses):
            yield f"{name}: got a number that is no status"
    yield from _missing_texts(dataset, TEXT_ATTRIBUTES)
    for key in NUMBER_ATTRIBUTES:
        if not isinstance(dataset.attrs.get(key), int | float | np.number):
            yield f"no {key}, or not as a number"


def _board_violations(dataset: xr.Dataset) -> Iterator[str]:
    """What every board has: unique labels, known statuses and attributes."""
    for name in ("engine", "check"):
        if name in dataset.dims and not dataset.indexes[name].is_unique:
            yield f"{name}: a label occurs twice"
    if "check_status" in dataset and not np.isin(dataset["check_status"], [*CHECK_STATUSES.values()]).all():
        yield "check_status: got a number that is no outcome of a check"
    yield from _missing_texts(dataset, BOARD_ATTRIBUTES)


def _missing_texts(dataset: xr.Dataset, keys: Iterable[str]) -> Iterator[str]:
    """Attributes that are missing or not text."""
    for key in keys:
        if not isinstance(dataset.attrs.get(key), str):
            yield f"no {key}, or not as text"


def _study_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Faults of a calibration or a sensitivity study: it has all of its variables, on their own axes."""
    kind = kind_of(dataset)
    for study, coordinates in STUDY_COORDINATES.items():
        names = sorted((SCHEMA[study].keys() | coordinates.keys()) & set(dataset.variables))
        if study != kind and names:
            yield f"{', '.join(names)}: of a {study}, which has the axis {next(iter(coordinates))}"
    if kind not in STUDY_COORDINATES:
        return
    # what a study may lack
    absent = {"specimen"} | (set() if dataset.attrs.get("varied") else {"grid", "output_name"})
    points: tuple[Hashable, ...] = () if kind == "board" else ("model",)
    points = dataset["mean"].dims if "mean" in dataset else points
    for name, variable in SCHEMA[kind].items():
        if absent & {*variable.dims} or (variable.is_new and name not in dataset):
            continue
        dims = (*points, *(dim for dim in variable.dims if dim not in ("model", AXES)))
        if name not in dataset or dataset[name].dims != dims:
            got = "none" if name not in dataset else ", ".join(map(str, dataset[name].dims)) or "no axes"
            yield f"{name}: got {got}, expected {', '.join(map(str, dims))}"
    for name, dim in STUDY_COORDINATES[kind].items():
        if name not in absent and (name not in dataset.coords or dataset[name].dims != (dim,)):
            yield f"{name}: expected a coordinate along {dim}"
    if kind == "calibration":
        yield from _calibration_violations(dataset)
    elif kind == "sensitivity study":
        yield from _sensitivity_violations(dataset)


def _calibration_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Attributes and outcomes of fits that a calibration does not have."""
    yield from _missing_texts(dataset, CALIBRATION_ATTRIBUTES)
    if len(read_attribute(dataset.attrs, "fit_paths")) != dataset.sizes.get("parameter"):
        yield "fit_paths: expected a config path for each parameter"
    if "fit_status" in dataset and not np.isin(dataset["fit_status"].values, range(len(FIT_STATUSES))).all():
        yield "fit_status: got a number that is no outcome of a fit"


def _sensitivity_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Attributes that a sensitivity study does not have."""
    if dataset.attrs.get("of") not in OUTPUTS:
        yield "of: expected the name of an output"
    if not read_attribute(dataset.attrs, "design"):
        yield "no design"


# what a dataset has that is not the result of a sweep, or of a study that has its coordinates
FORM_VIOLATIONS: Mapping[Kind, Callable[[xr.Dataset], Iterator[str]]] = {
    "history": _history_violations,
    "board": _board_violations,
}


def _has_unknown_status(status: xr.DataArray, known: Sequence[int]) -> bool:
    """Whether a status is unknown; computed statuses are always known."""
    if is_lazy(status.variable) and VARIES_ALONG in status.encoding:
        return False
    parts = (status.isel(where).values for where in slabs(status.sizes, STATUS_SLAB_POINTS))
    return any(not np.isin(np.unique(part), known).all() for part in parts)
