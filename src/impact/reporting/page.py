"""A result to look at in a browser: one file of HTML, with what was integrated and no law and no integrator.

The outputs follow from it by a few formulas, in `page.js`; `page.html.j2` is the template.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from markupsafe import Markup
from numpy.typing import NDArray

from .._version import __version__
from ..array_types import Array
from ..atomic import write_file
from ..config.grid import SAMPLE, Axis
from ..config.input_names import InputName
from ..contact.status import FIRST_FAILURE
from ..contact.variables import OUTPUTS
from ..engine.inputs import Inputs, build_impacts, input_at
from ..errors import UsageError
from ..formatting import argument, scaled_unit
from ..plots.explore import axes_of, axis_label, shown_values
from ..plots.labels import LawPart, mark_slow_limit, split_by_law, with_model
from ..plots.slices import conditions_of
from ..plots.style import is_geometric, model_styles
from ..results.layouts import read_inputs
from ..results.schema import is_case, numbered_unit, require_axes
from ..results.selection import law_positions
from ..results.trajectory_table import TrajectoryTable, table_of_result
from ..results.xarray_backend import open_result, result_of
from .report import check_page_path, page_title, template

SHOWN = ("e_out", "e_error", "v1_post", "v2_post", "v1_error", "v2_error", "peak_force", "contact_time")
SHOWN_OF_PAIRS = (
    *("beta", "e_t", "rebound_angle", "impulse_ratio"),
    *("u1_post", "u2_post", "omega1_post", "omega2_post"),
)
NO_OUTPUT = "e_out is not in this result; sweep with it in output.variables"
# columns of a trajectory, in the contact's own units, by the names of the outputs that follow from them
TRAJECTORY = {"e_out": "e_out", "peak_force": "force", "contact_time": "contact_time", "status": "status"}
# inputs that the outputs depend on besides the trajectory
INPUTS = ("v1", "v2", "m1", "m2", "e")
MAX_BYTES = 10_000_000
VALUE_BYTES = 8
# pixels of a line of one point of the plots
DASH_PIXELS = 1.6


def page(
    dataset: xr.Dataset | str | Path,
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
    models: Sequence[str] | None = None,
) -> str:
    """Write a result as one page of HTML with controls, which needs neither Python nor a network.

    It draws the restitution, velocities after the impact, their errors, the peak force and the contact time over
    any axis, with a slider for each other one; of pairs with friction the tangential restitution, the angle of the
    rebound and the tangential velocities. Values at points of the grid are those of the result.

    Parameters
    ----------
    dataset : a result, or the file of one
    output : file to write the page to as well, whose name ends in .html
    overwrite : replace the output if it exists
    models : keys of the models to show; by default all

    Returns
    -------
    str : the page

    Raises
    ------
    UsageError, ResultError : it is not the result of a sweep with an axis, it takes more than 10 MB, there is no
        such model; the output exists, or has another ending

    >>> import impact
    >>> result = impact.sweep("configs/figure6.toml", overrides=["models=hertz", "sweep.e=[0.5, 1.0]"])
    >>> "<h1>Final velocities comparison</h1>" in impact.page(result)
    True
    """
    check_page_path(output, [dataset], overwrite=overwrite)
    # of a file, values of a trajectory table are not computed
    with open_result(dataset) if isinstance(dataset, str | Path) else nullcontext(result_of(dataset)) as result:
        text = _page_of(result, models)
    if output is not None:
        write_file(Path(output), text.encode(), overwrite=overwrite)
    return text


def _page_of(dataset: xr.Dataset, models: Sequence[str] | None) -> str:
    require_axes(dataset)
    if "model" not in dataset.dims or SAMPLE in dataset.dims or not axes_of(dataset):
        raise UsageError(
            "expected the result of a sweep over an axis; impact report takes other results, but no time history"
        )
    positions, table = law_positions(models, dataset), table_of_result(dataset)
    dataset = dataset.isel(model=positions)
    if table is None:
        inputs = read_inputs(dataset, axes_of(dataset))
        arrays = [*_stored_values(dataset, inputs)]
    else:
        inputs = table.inputs
        arrays = [*_trajectories(table, positions)]
    names = [name for name in SHOWN if name in dataset]
    if not names:
        raise UsageError(NO_OUTPUT)
    parts = [*split_by_law(dataset[names], numbered=False)]
    of_pairs = [name for name in SHOWN_OF_PAIRS if name in dataset and "friction" in dataset.coords]
    if of_pairs:
        # before they are computed
        _check_size(sum(dataset[name].size for name in of_pairs) * VALUE_BYTES)
        of_friction = dataset[[name for name in (*of_pairs, "friction_status") if name in dataset]]
        # selected by its key, a friction law is no dimension
        of_friction = of_friction if "friction" in dataset.dims else of_friction.expand_dims("friction")
        pairs = [*map(mark_slow_limit, split_by_law(of_friction, numbered=False))]
        arrays += [_values(pair.data, of_pairs, inputs) for pair in pairs]
        parts, names = [*parts, *pairs], [*names, *of_pairs]
    laws = [{**law, **columns} for law, columns in zip(_laws(parts), arrays, strict=True)]
    axes = [_axis(dataset, axis) for axis in inputs.axes]
    swept = [name for axis in inputs.axes for name in axis.columns]
    content = {
        # one line, which is a comment of the CSV
        "title": " ".join(page_title(dataset).split()),
        "reference": "Impulse-momentum",
        "first_failure": FIRST_FAILURE,
        "first_axis": _first_axis(axes),
        "axes": axes,
        "inputs": {name: _array(input_at(inputs, name, inputs.index())) for name in INPUTS},
        "outputs": [_output(name) for name in names],
        "laws": laws,
    }
    # no text of a result ends the script
    data = json.dumps(content, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    _check_size(len(data))
    return template("page.html.j2").render(
        title=content["title"],
        summary=with_model(conditions_of(dataset, *swept), dataset, numbered=False),
        data=Markup(data),
        version=__version__,
    )


def _laws(parts: Sequence[LawPart]) -> Iterator[dict[str, Any]]:
    """Name models and pairs, and their style in pictures."""
    styles = model_styles([part.law for part in parts])
    for part in parts:
        style = styles[part.law]
        dashes = [DASH_PIXELS * length for length in style["linestyle"][1]] if style["linestyle"] != "-" else []
        yield {
            "key": part.law,
            "label": part.label,
            "is_pair": bool(part.friction),
            "color": style["color"],
            "marker": style["marker"],
            "dashes": " ".join(map("{:g}".format, dashes)) or "none",
        }


def _check_size(size: int) -> None:
    """Refuse more bytes than a page has."""
    if size > MAX_BYTES:
        raise UsageError(
            f"its values take more than {MAX_BYTES / 1e6:g} MB; take a part first, by {argument('models')} or "
            "impact expand RESULT --sel AXIS=VALUE"
        )


def _trajectories(table: TrajectoryTable, positions: Sequence[int]) -> Iterator[dict[str, Any]]:
    """Collect the trajectories of laws, and what converts them to SI."""
    index = table.inputs.index()
    for position in positions:
        law, trajectory_map = table.laws[position], table.maps[position]
        # before they are read
        _check_size(trajectory_map.count * len(TRAJECTORY) * VALUE_BYTES)
        rows = table.take(position, np.arange(trajectory_map.count))
        impacts = build_impacts(table.inputs, law, index)
        _check_size(impacts.K.size * VALUE_BYTES)
        columns = {
            name: {**_encoded(getattr(rows, column)), "axes": list(trajectory_map.axes), "is_shared": True}
            for name, column in TRAJECTORY.items()
        }
        cells = trajectory_map.of_cell
        yield {
            "is_table": True,
            "asks_for_e": "e" in law.quantities,
            "cells": None if cells is None else _encoded(cells.astype(np.int32)),
            "columns": {**columns, "K": _array(impacts.K), "n": _array(impacts.n)},
        }


def _stored_values(dataset: xr.Dataset, inputs: Inputs) -> Iterator[dict[str, Any]]:
    """Collect the values of laws that a result stores; outputs that it lacks are left out."""
    if "e_out" not in dataset:
        raise UsageError(NO_OUTPUT)
    names = [name for name in TRAJECTORY if name in dataset and name != "status"]
    others = {*dataset["e_out"].dims} - {"model", *(axis.name for axis in inputs.axes)}
    if others:
        raise UsageError(f"e_out depends on {', '.join(map(str, others))} in this result; select one value of it")
    _check_size(dataset["e_out"].size * len(names) * VALUE_BYTES)
    if dataset["e_out"].dtype == np.float32 and {"e", "e_error"} <= {*dataset.variables}:
        # errors follow from e_out, whose last digits are lost
        exact = (dataset["e"] + dataset["e_error"].astype(float)).fillna(dataset["e_out"])
        dataset = dataset.assign(e_out=exact)
    for position in range(dataset.sizes["model"]):
        yield _values(dataset.isel(model=position), names, inputs)


def _values(of_law: xr.Dataset, names: Sequence[str], inputs: Inputs) -> dict[str, Any]:
    """Collect outputs of a law, or of a pair, over the grid; angles in degrees."""
    dims, columns = [axis.name for axis in inputs.axes], {}
    for name in names:
        values = of_law[name].transpose(*dims, missing_dims="ignore")
        numbers = np.asarray(values.values, float)
        encoded = _encoded(np.degrees(numbers) if OUTPUTS[name].unit == "rad" else numbers)
        columns[name] = {**encoded, "axes": [dims.index(str(dim)) for dim in values.dims]}
    return {"is_table": False, "cells": None, "columns": columns}


def _array(values: Array) -> dict[str, Any]:
    """Encode values over the grid, without the axes along which they do not vary."""
    axes = [axis for axis, size in enumerate(values.shape) if size > 1]
    return {**_encoded(np.asarray(values, float)), "axes": axes}


def _encoded(values: NDArray[Any]) -> dict[str, Any]:
    """Encode an array in C order, little-endian."""
    little = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    return {"type": little.dtype.str[1:], "base64": base64.b64encode(little.tobytes()).decode()}


def _output(name: str) -> dict[str, Any]:
    output, meaning = OUTPUTS[name], OUTPUTS[name].short_meaning
    unit = "°" if output.unit == "rad" else output.unit
    label = meaning[:1].upper() + meaning[1:]
    return {"name": name, "label": label, "unit": unit, "of_friction": output.of_friction}


def _axis(dataset: xr.Dataset, axis: Axis) -> dict[str, Any]:
    """Describe an axis of the grid: its values, null where infinite, and their texts with the other columns."""
    coordinate, word = dataset[axis.name], InputName.parse(axis.name).word
    # a number of a case is a name: nothing lies between two cases
    has_words = is_case(axis.name) or any(isinstance(word(value), str) for value in coordinate.values.tolist())
    numbers = np.arange(coordinate.size, dtype=float) if has_words else np.asarray(coordinate.values, float)
    is_log, unit = not has_words and is_geometric(np.sort(numbers)), numbered_unit(dataset, axis.name)
    # of the unit of the picture, without a prefix beside powers of ten
    size, shown = scaled_unit(unit, 1.0 if is_log else max(map(abs, filter(math.isfinite, numbers)), default=1.0))
    names = [text for text, _ in shown_values(dataset, axis.name)]
    texts = names
    for name in axis.columns:
        if name != axis.name:
            along = [f"{axis_label(name)} = {text}" for text, _ in shown_values(dataset, name)]
            texts = [f"{text}, {other}" for text, other in zip(texts, along, strict=True)]
    return {
        "name": axis.name,
        "label": axis_label(axis.name),
        "unit": unit,
        "scaled": (size, "" if unit == "1" else shown),
        "values": [value if math.isfinite(value) else None for value in numbers.tolist()],
        "names": names,
        "texts": texts,
        "has_words": has_words,
        "is_log": is_log,
    }


def _first_axis(axes: Sequence[Mapping[str, Any]]) -> int:
    """Choose e to draw over, else the first axis with several numbers."""
    several = [number for number, axis in enumerate(axes) if len(axis["values"]) > 1 and not axis["has_words"]]
    return min(several, key=lambda number: axes[number]["name"] != "e", default=0)
