"""The command `info`: what is in a file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..formatting import label, number
from .console import cell, console, dump, print_rows, table
from .options import JsonOption

if TYPE_CHECKING:
    import xarray as xr

# how a result is stored, where it was read from a file
STORED = ("layout", "seal")


def info(
    file: Annotated[Path, typer.Argument(help="A result or a time history.")],
    as_json: JsonOption = False,
) -> None:
    """What is in a file: axes, variables, worst errors, and where it came from."""
    from .. import api

    dataset = api.load(file)
    if as_json:
        print(dump(info_json(dataset)))
    else:
        print_info(dataset, file)


def info_json(dataset: xr.Dataset) -> dict[str, Any]:
    """What is in a file as plain data; its layout and its seal are null where they are not known."""
    import numpy as np

    from ..results.schema import count_points

    return {
        "points": count_points(dataset),
        **{name: dataset.encoding.get(name) for name in STORED},
        "dimensions": {str(name): size for name, size in dataset.sizes.items()},
        "coordinates": [str(name) for name in dataset.coords],
        "variables": {str(n): {"units": v.attrs.get("units"), "dims": list(v.dims)} for n, v in dataset.items()},
        "attributes": {
            str(n): v if isinstance(v, str) else np.asarray(v).tolist() for n, v in dataset.attrs.items()
        },
    }


def print_info(dataset: xr.Dataset, path: Path) -> None:
    """What is in a file, of any size; "–" where more would have to be evaluated than a summary is worth."""
    from ..results.attributes import read_attribute
    from ..results.schema import count_points, exponents_of, plain_unit
    from ..results.summary import counts_by_name, extremes_of, summarize
    from .summary import worst_errors

    attributes = dataset.attrs
    tally = summarize(dataset) if "model" in dataset.dims else None
    sizes = " × ".join(f"{name} {size}" for name, size in dataset.sizes.items())
    rows: dict[str, Any] = {"file": path, "title": attributes.get("title", ""), "dimensions": sizes}
    rows["points"] = f"{count_points(dataset):,}"
    rows |= {name: dataset.encoding[name] for name in STORED if dataset.encoding.get(name) is not None}
    for name, coordinate in dataset.coords.items():
        if name in ("title", "equation", "reference", "doi", "year"):
            continue
        text = _values_text(dataset, str(name))
        if name == "n" and coordinate.ndim == 0:
            text = exponents_of(dataset) or text
        unit = plain_unit(str(coordinate.attrs.get("units", "1")))
        rows[str(name)] = text + ("" if unit == "1" else f" [{unit}]")
    for name in (
        "rtol",
        "materials",
        "impact_version",
        "schema_version",
        "fingerprint",
        "plugins",
        "tolerances",
        "reason",
    ):
        if attributes.get(name, "{}") != "{}":
            rows[name] = attributes[name]
    if read_attribute(attributes, "config_set"):
        rows["config_set"] = attributes["config_set"]
    if tally and tally.counts:
        rows["status"] = ", ".join(f"{count:,} {name}" for name, count in counts_by_name(tally.counts).items())
    if tally and tally.not_counted:
        rows["not evaluated"] = f"the status of {tally.not_counted:,} points"
    print_rows(rows)
    out = console(sys.stdout)
    out.print()
    listed = table("variable", "unit", "dimensions", "smallest", "largest", "missing")
    for name, variable in dataset.items():
        extremes = extremes_of(dataset, str(name))
        ends = [number(end) for end in extremes[:2]] if extremes else ["–", "–"]
        listed.add_row(
            cell(name),
            cell(variable.attrs.get("units", "")),
            cell(", ".join(map(str, variable.dims))),
            *ends,
            f"{extremes.missing:,}" if extremes else "–",
        )
    out.print(listed)
    if tally and tally.worst:
        out.print()
        out.print(worst_errors(dataset, tally))


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
    if values.dtype.kind == "f" and len(distinct) > 4:
        return f"{number(values.min())} … {number(values.max())}, {values.size} values"
    return ", ".join(label(value) for value in distinct)
