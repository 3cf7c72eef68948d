"""Validate a dataset as a result or a time history: its names, axes, types and attributes.

`load` ignores other names, `save` refuses them.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterator, Mapping, Sequence

import numpy as np
import xarray as xr

from ..config.input_names import InputName
from ..config.tables import MATERIAL_KEYS, MATERIAL_QUANTITIES, SWEEP_QUANTITIES
from ..contact.records import CollisionResult, Record
from ..contact.tangential import TangentialResult
from ..contact.variables import AXES, LAW_DIMS, OUTPUTS
from ..errors import ResultError
from ..formatting import safe_text
from .attributes import ATTRIBUTE_TYPES, read_attribute
from .schema import CALIBRATION_TEXTS, MODEL_METADATA, SCHEMA, STUDIES, STUDY_COORDINATES, Kind, is_case, kind_of
from .slabs import is_computed, slabs

TEXT_COORDINATES = frozenset(
    {"model", "friction", *MODEL_METADATA, *MATERIAL_KEYS, *CALIBRATION_TEXTS, "input"} - {"year"}
).union(STUDY_COORDINATES["board"])
# what the variables of each type of trajectories begin with, which is also the name of their dimension
PREFIXES: Mapping[type[Record], str] = {CollisionResult: "trajectory", TangentialResult: "tangential"}
# by whether they are of pairs, the dimension of witnesses and the variable of their places
WITNESSES = {False: ("witness", "witness_index"), True: ("pair_witness", "witness_pair_index")}
# the trajectory table of a factored file, see `impact.results.layouts`
TABLE_VARIABLES = frozenset(
    {
        *(f"{prefix}_{name}" for record, prefix in PREFIXES.items() for name in record.columns()),
        "trajectory_of_cell",
        "law_stiffness",
        *(places for _, places in WITNESSES.values()),
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


# required attributes by kind: text, in part JSON; and numbers of results
_SWEEP_TEXTS = ("title", "config", "config_set", "fingerprint", "impact_version", "packages", "plugins")
TEXT_ATTRIBUTES: Mapping[Kind, Sequence[str]] = {
    "sweep": _SWEEP_TEXTS,
    "sensitivity study": _SWEEP_TEXTS,
    "calibration": (*_SWEEP_TEXTS, "noise", "data_file", "varied", "fit_paths", "fit_bounds"),
    "board": ("title", "suite", "impact_version", "packages"),
    "history": (),
}
NUMBER_ATTRIBUTES = ("rtol", "max_steps")
# axes whose labels differ, and statuses, with what each is called in a message
UNIQUE_LABELS = {"model": "a model", "engine": "an engine", "check": "a check"}
STATUS_NOUNS = {
    "status": "status",
    "friction_status": "status",
    "fit_status": "outcome of a fit",
    "check_status": "outcome of a check",
}
# attributes of factored files, which a dataset does not have
FACTORED_ATTRIBUTES = ("laws", "axes", "summary", "pairs", "frictions")
# statuses that are checked at a time
STATUS_SLAB_POINTS = 2**22


def schema_violation(dataset: xr.Dataset) -> str | None:
    """The first reason why a dataset is neither a result nor a time history, or None."""
    kind = kind_of(dataset)
    checks = [_name_violations, _type_violations, _attribute_violations, _status_violations]
    if kind != "board":
        checks.append(_history_violations if kind == "history" else _result_violations)
    checks.append(_study_violations)
    return next((safe_text(fault) for check in checks for fault in check(dataset)), None)


def _name_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Names that no result has, and axes without values, or with a label that occurs twice."""
    unknown = sorted({str(name) for name in (*dataset.variables, *dataset.dims) if not is_name(str(name))})
    if unknown:
        yield f"{', '.join(unknown)}: not a variable of a result"
    for name, size in dataset.sizes.items():
        if name not in dataset.coords or not size:
            yield f"its axis {name} has no values"
    for label, noun in UNIQUE_LABELS.items():
        if label in dataset.indexes and not dataset.indexes[label].is_unique:
            yield f"{noun} occurs twice"


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
    """Attributes of files only, JSON of another type than expected, and missing texts."""
    for key in FACTORED_ATTRIBUTES:
        if key in dataset.attrs:
            yield f"{key}: an attribute of files in layout factored"
    for key in ATTRIBUTE_TYPES:
        try:
            read_attribute(dataset.attrs, key)
        except ResultError as error:
            yield str(error)
    for key in TEXT_ATTRIBUTES[kind_of(dataset)]:
        if not isinstance(dataset.attrs.get(key), str):
            yield f"no {key}, or not as text"


def _status_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Numbers that are no status; computed statuses always are one."""
    for name, noun in STATUS_NOUNS.items():
        if name in dataset and not is_computed(dataset[name].variable):
            known = [*next(table[name] for table in SCHEMA.values() if name in table).flags.values()]
            parts = (dataset[name].isel(where).values for where in slabs(dataset[name].sizes, STATUS_SLAB_POINTS))
            if any(not np.isin(np.unique(part), known).all() for part in parts):
                yield f"{name}: got a number that is no {noun}"


def _history_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Variables of a time history along other axes than t."""
    for name, variable in dataset.variables.items():
        if variable.dims != (() if name in LAW_DIMS else ("t",)):
            yield f"{name}: expected t as its only axis"


def _result_violations(dataset: xr.Dataset) -> Iterator[str]:
    """What every result has: models with metadata, and numbers of the solver."""
    if "model" not in dataset.dims:
        yield "model is not an axis; select models as a list, sel(model=[...])"
    for name in MODEL_METADATA:
        if name not in dataset or dataset[name].dims != ("model",):
            yield f"{name} of the models is missing"
    for name, variable in OUTPUTS.items():
        if name in dataset and not variable.per_model and "model" in dataset[name].dims:
            yield f"{name}: lies along model"
    for key in NUMBER_ATTRIBUTES:
        if not isinstance(dataset.attrs.get(key), int | float | np.number):
            yield f"no {key}, or not as a number"


def _study_violations(dataset: xr.Dataset) -> Iterator[str]:
    """Faults of a calibration or a sensitivity study: it has all of its variables, on their own axes."""
    kind = kind_of(dataset)
    for study, coordinates in STUDY_COORDINATES.items():
        names = sorted((SCHEMA[study].keys() | coordinates.keys()) & set(dataset.variables))
        if study != kind and names:
            yield f"{', '.join(names)}: of a {study}, which has the axis {STUDIES[study]}"
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
    if kind == "calibration" and len(read_attribute(dataset.attrs, "fit_paths")) != dataset.sizes["parameter"]:
        yield "fit_paths: expected a config path for each parameter"
    if kind == "sensitivity study" and dataset.attrs.get("of") not in OUTPUTS:
        yield "of: expected the name of an output"
    if kind == "sensitivity study" and not read_attribute(dataset.attrs, "design"):
        yield "no design"
