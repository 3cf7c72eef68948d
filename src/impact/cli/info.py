"""The command `info`: the contents of a file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import impact

from ..display import show
from ..formatting import label, number
from .console import cell, console, dump, print_rows, table
from .options import JsonOption

if TYPE_CHECKING:
    import xarray as xr

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
# longer lists of numbers are abbreviated
MAX_LISTED_NUMBERS = 4


def info(
    file: Annotated[Path, typer.Argument(help="A result or a time history.")],
    as_json: JsonOption = False,
) -> None:
    """Show the axes, variables, largest errors and provenance of a file."""
    from ..results.xarray_backend import open_result

    # not loaded, so that a summary in the file is used
    with open_result(file) as dataset:
        if as_json:
            print(dump(impact.info(dataset)))
        else:
            print_info(dataset, file)


def print_info(dataset: xr.Dataset, path: Path) -> None:
    """Print the contents of a file of any size; "–" where a summary would evaluate too many points."""
    from ..results.attributes import read_attribute
    from ..results.kinds import is_calibration, is_sensitivity
    from ..results.schema import exponents_of, plain_unit
    from .summary import worst_errors

    description = impact.info(dataset)
    attributes = dataset.attrs
    sizes = " × ".join(f"{name} {size}" for name, size in description["dimensions"].items())
    rows: dict[str, Any] = {"file": path, "title": attributes.get("title", ""), "dimensions": sizes}
    rows["points"] = f"{description['points']:,}"
    rows |= {name: description[name] for name in ("layout", "seal") if description[name] is not None}
    for name, coordinate in dataset.coords.items():
        if name in ("title", "equation", "reference", "doi", "year"):
            continue
        text = _values_text(dataset, str(name))
        if name == "n" and coordinate.ndim == 0:
            text = exponents_of(dataset) or text
        unit = plain_unit(str(coordinate.attrs.get("units", "1")))
        rows[str(name)] = text + ("" if unit == "1" else f" [{unit}]")
    for name in SHOWN_ATTRIBUTES:
        if attributes.get(name, "{}") != "{}":
            rows[name] = attributes[name]
    if read_attribute(attributes, "config_set"):
        rows["config_set"] = attributes["config_set"]
    if description["status"]:
        rows["status"] = ", ".join(f"{count:,} {name}" for name, count in description["status"].items())
    if description["not_evaluated"]:
        rows["not evaluated"] = f"the status of {description['not_evaluated']:,} points"
    print_rows(rows)
    out = console(sys.stdout)
    out.print()
    listed = table("variable", "unit", "dimensions", "smallest", "largest", "missing")
    for name, variable in description["variables"].items():
        evaluated = variable["missing"] is not None
        listed.add_row(
            cell(name),
            cell(variable["units"] or ""),
            cell(", ".join(map(str, variable["dims"]))),
            *(number(variable[end]) if evaluated else "–" for end in ("smallest", "largest")),
            f"{variable['missing']:,}" if evaluated else "–",
        )
    out.print(listed)
    if description["worst"]:
        out.print()
        out.print(worst_errors(description["worst"]))
    if is_calibration(dataset) or is_sensitivity(dataset):
        out.print()
        show(impact.describe(dataset))


def _values_text(dataset: xr.Dataset, name: str) -> str:
    """The values of a coordinate: a list of a few values, or the range and number of many."""
    from ..results.slabs import is_large
    from ..results.summary import extremes_of

    coordinate = dataset[name]
    if is_large(coordinate.variable):
        extremes = extremes_of(dataset, name)
        ends = f"{number(extremes.smallest)} … {number(extremes.largest)}, " if extremes else ""
        return f"{ends}{coordinate.size} values"
    values = coordinate.values.reshape(-1)
    distinct = list(dict.fromkeys(values.tolist()))
    if values.dtype.kind in "fi" and len(distinct) > MAX_LISTED_NUMBERS:
        return f"{number(values.min())} … {number(values.max())}, {values.size} values"
    return ", ".join(label(value) for value in distinct)
