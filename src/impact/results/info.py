"""The contents of a result or a time history, and what a study or a law says, as plain data and as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..config.input_names import InputName
from ..contact.friction import FrictionLaw
from ..contact.model import ForceModel
from ..display import PIPE_WIDTH, Block, Displayed, Table
from ..engine.law_catalogue import FrictionDescription, ModelDescription
from ..errors import UsageError
from ..formatting import number
from .attributes import read_attribute
from .board import Board
from .calibration import Fits
from .schema import MODEL_METADATA, count_points, exponents_of, kind_of, numbered_unit
from .sensitivity import Studies
from .slabs import is_large
from .summary import Extremes, Summary, error_table, extremes_of, summarize
from .xarray_backend import open_result, result_of, result_to_show

# attributes that are shown if they are set
SHOWN_ATTRIBUTES = (
    "rtol",
    "integrator",
    "materials",
    "impact_version",
    "schema_version",
    "fingerprint",
    "plugins",
    "tolerances",
    "reason",
    "design",
)
# the variables with a value for each point of a study: the measured values of a calibration, the studies of a
# sensitivity study, and the checks of a board
POINTS_OF_STUDIES = {"calibration": "measured", "sensitivity study": "mean", "board": "check_status"}
# longer lists of numbers are abbreviated
MAX_LISTED_NUMBERS = 4


class Info(dict[str, Any], Displayed):
    """The contents of a result, which a notebook shows as tables."""

    def __init__(self, description: Mapping[str, Any], tables: Sequence[Block]) -> None:
        super().__init__(description)
        self.tables = tables

    def as_dict(self) -> dict[str, Any]:
        """The contents as plain data."""
        return dict(self)

    def records(self) -> Sequence[Mapping[str, Any]]:
        """The variables."""
        return [{"variable": name, **variable} for name, variable in self["variables"].items()]

    def sections(self, width: int) -> Sequence[Block]:
        """The axes and attributes, the variables, and the largest errors or what was calibrated or studied."""
        return self.tables


def info(result: xr.Dataset | str | Path) -> Info:
    """The contents of a result or a time history of any size, as plain data.

    Returns
    -------
    Info : a dict of points; layout and seal of the file, None in memory; dimensions; coordinates; units, dims,
        smallest and largest value and number of missing values of each variable; counts of points by status;
        largest errors by variable and model; attributes. A value is None, or missing, where a summary would
        evaluate too many points; `not_evaluated` counts the points without a status

    Raises
    ------
    ResultError : the file is not a readable result

    >>> import impact
    >>> impact.info(impact.sweep("configs/figure6.toml"))["status"]
    {'ok': 301, 'limit': 2}
    """
    if isinstance(result, str | Path):
        # not loaded, so that a summary in the file is used
        with open_result(result) as opened:
            return _describe(opened, str(result))
    with result_to_show(result) as dataset:
        return _describe(dataset)


def _describe(result: xr.Dataset, name: str = "") -> Info:
    """Describe a dataset, of the file of a name."""
    summary = summarize(result) if "model" in result.dims else Summary()
    counted, variables = POINTS_OF_STUDIES.get(kind_of(result)), dict[str, Any]()
    for variable_name, variable in result.items():
        extremes = extremes_of(result, str(variable_name))
        variables[str(variable_name)] = {
            "units": variable.attrs.get("units"),
            "dims": list(variable.dims),
            **(extremes._asdict() if extremes else dict.fromkeys(Extremes._fields)),
        }
    description = {
        "points": count_points(result) if counted is None else int(result[counted].size),
        # of a result in memory neither is known
        **{name: result.encoding.get(name) for name in ("layout", "seal")},
        "dimensions": {str(name): size for name, size in result.sizes.items()},
        "coordinates": [str(name) for name in result.coords],
        "variables": variables,
        **summary.by_status,
        "not_evaluated": summary.not_counted,
        "worst": summary.worst,
        "attributes": {
            str(name): value if isinstance(value, str) else np.asarray(value).tolist()
            for name, value in result.attrs.items()
        },
    }
    return Info(description, _tables(result, name, description))


def _tables(result: xr.Dataset, name: str, description: Mapping[str, Any]) -> list[Block]:
    """Tabulate the contents of a dataset; "–" where a summary would evaluate too many points."""
    attributes = result.attrs
    sizes = " × ".join(f"{dim} {size}" for dim, size in description["dimensions"].items())
    rows: dict[str, Any] = {"file": name} if name else {}
    rows |= {"title": attributes.get("title", ""), "dimensions": sizes, "points": f"{description['points']:,}"}
    rows |= {key: description[key] for key in ("layout", "seal") if description[key] is not None}
    for coordinate in result.coords.values():
        if coordinate.name not in MODEL_METADATA:
            rows[str(coordinate.name)] = _values_text(result, str(coordinate.name))
    rows |= {key: attributes[key] for key in SHOWN_ATTRIBUTES if attributes.get(key, "{}") != "{}"}
    if read_attribute(attributes, "config_set"):
        rows["config_set"] = attributes["config_set"]
    for name in ("status", "friction_status"):
        if counts := description.get(name):
            rows[name] = ", ".join(f"{count:,} {status}" for status, count in counts.items())
    if description["not_evaluated"]:
        rows["not evaluated"] = f"the status of {description['not_evaluated']:,} points"
    headings = ("variable", "unit", "dimensions", "smallest", "largest", "missing")
    variables = []
    for key, variable in description["variables"].items():
        numbers: tuple[object, ...] = ("–",) * 3
        if variable["missing"] is not None:
            numbers = (variable["smallest"], variable["largest"], f"{variable['missing']:,}")
        variables.append((key, variable["units"] or "", ", ".join(variable["dims"]), *numbers))
    tables: list[Block] = [Table(list(rows.items())), "", Table(variables, headings)]
    if description["worst"]:
        tables += ["", error_table(description["worst"])]
    if kind_of(result) in POINTS_OF_STUDIES:
        tables += ["", *describe(result).sections(PIPE_WIDTH)]
    return tables


def _values_text(dataset: xr.Dataset, name: str) -> str:
    """List the values of a coordinate with its unit; of many numbers the range and the number."""
    coordinate = dataset[name]
    unit = numbered_unit(dataset, name)
    suffix = "" if unit == "1" else f" [{unit}]"
    if name == "n" and coordinate.ndim == 0 and (exponents := exponents_of(dataset)):
        return exponents + suffix
    if is_large(coordinate.variable):
        extremes = extremes_of(dataset, name)
        ends = f"{number(extremes.smallest)} … {number(extremes.largest)}, " if extremes else ""
        return f"{ends}{coordinate.size} values{suffix}"
    array = coordinate.values.reshape(-1)
    distinct = list(dict.fromkeys(array.tolist()))
    if array.dtype.kind in "fi" and len(distinct) > MAX_LISTED_NUMBERS:
        return f"{number(array.min())} … {number(array.max())}, {array.size} values{suffix}"
    return ", ".join(number(InputName.parse(name).word(value), None) or "–" for value in distinct) + suffix


def describe(
    item: xr.Dataset | str | Path | ForceModel | FrictionLaw,
) -> Fits | Studies | Board | ModelDescription | FrictionDescription:
    """Describe a calibration, a sensitivity study, a board or a law, as its command prints it and a notebook does.

    Returns
    -------
    Fits, Studies, Board, ModelDescription or FrictionDescription : with `records`, `as_dict` and `to_dataframe`

    Raises
    ------
    UsageError : the dataset is another result

    >>> import impact
    >>> study = impact.sensitivity({
    ...     "models": "hertz",
    ...     "sweep": {"v1": {"uniform": [0.8, 1.2]}, "m1": 1.0, "m2": 1.0, "K": {"uniform": [5e5, 1.5e6]}},
    ...     "design": {"n": 1024},
    ... }, of="peak_force")
    >>> impact.describe(study).to_dataframe()[["input", "first", "total"]].round(2).values.tolist()
    [['sweep.v1', 0.56, 0.57], ['sweep.K', 0.43, 0.44]]
    """
    if isinstance(item, ForceModel):
        return ModelDescription(item)
    if isinstance(item, FrictionLaw):
        return FrictionDescription(item)
    result = result_of(item)
    match kind_of(result):
        case "calibration":
            return Fits(result)
        case "sensitivity study":
            return Studies(result)
        case "board":
            return Board(result)
    raise UsageError("expected the result of a calibration, of a sensitivity study, or a board")
