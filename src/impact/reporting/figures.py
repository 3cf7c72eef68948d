"""The figures of a report: their kinds, axes, and the point they are drawn at."""

from __future__ import annotations

import base64
import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..config.grid import SAMPLE
from ..config.input_names import InputName, is_input
from ..contact.model import ForceModel
from ..contact.status import FIRST_FAILURE, NO_IMPACT
from ..errors import ImpactError
from ..formatting import label
from ..plots.curves import MAX_RESTITUTIONS, STEP_AXES
from ..plots.draw import draw, get_plot_data
from ..plots.kinds import MAP_KINDS, Choice, Look
from ..plots.style import encoded
from ..results.kinds import has_fixed_steps, is_calibration, is_sensitivity
from ..results.schema import columns_along, plain_unit
from ..results.selection import model_positions
from ..results.slabs import distinct_points, is_computed, slabs

if TYPE_CHECKING:
    import xarray as xr

# kinds of figure, and what each shows
FIGURES = {
    "final-velocities": "Velocities after the impact, and the impulse-momentum solution.",
    "restitution": "Delivered over requested restitution.",
    "error": "Error of the restitution: signed above, absolute below.",
    "timestep": "Restitution at fixed steps: mean, least and largest over the phase.",
    "map": "Error of the restitution over two axes, a panel for each model.",
    "validity": "Model with the smallest error, and that error.",
    "calibration": "Measured values, the laws that fit them with their bands of 95 %, and residuals.",
    "uncertainty": "Delivered restitution: median, and 5 to 95 % of the samples of uncertain inputs.",
    "sensitivity": "First-order and total Sobol indices of the uncertain inputs, with intervals of 95 %.",
    "loop": "Force over indentation at one point: the area of a loop is the energy loss.",
}
# points that are searched for the first one with an answer, at which the figures are drawn
MAX_SEARCHED = 2**18


@dataclass(frozen=True)
class Figure:
    """A figure of a report.

    Parameters
    ----------
    label : what it shows
    caption : the same, the point where it is drawn, and what is left out
    source : the picture as a data URL
    """

    label: str
    caption: str
    source: str


def figures_of(
    dataset: xr.Dataset, keys: Sequence[str], plugins: Sequence[ForceModel | str | Path]
) -> tuple[list[Figure], list[str]]:
    """Draw the figures of a result; returns them, and a sentence for each figure that cannot be drawn."""
    drawn, reasons = [], []
    for kind, choice, position in iterate_choices(dataset, keys):
        try:
            plot_data = get_plot_data(dataset, kind, choice, plugins)
            # title and conditions are in the caption; the figure is narrow, so that its text is legible on a phone
            figure = draw(plot_data, Look(width="single", title=False))
        except ImpactError as error:
            reasons.append(f"The figure {kind} is left out: {'; '.join(error.problems)}")
            continue
        # transparent, because the page may be dark
        for background in (figure.patch, *(axes.patch for axes in figure.axes)):
            background.set_visible(False)
        source = f"data:image/svg+xml;base64,{base64.b64encode(encoded(figure, 'svg')).decode()}"
        sentences = [FIGURES[kind], *_condition_sentences(dataset, position, keys)]
        sentences += [f"Not drawn: {'; '.join(plot_data.not_drawn)}."] if plot_data.not_drawn else []
        drawn.append(Figure(FIGURES[kind], " ".join(sentences), source))
    return drawn, reasons


def _condition_sentences(
    dataset: xr.Dataset, position: Mapping[Hashable, int], keys: Sequence[str]
) -> Iterator[str]:
    """Sentences with the values of the inputs that vary in the sweep and not in the figure.

    A sentence for all models comes first, then one for the parameters of each model.
    """
    point, inputs = dataset.isel(position), varying(dataset)
    for key in ("", *keys):
        values = at_text(point, [name for name in inputs if InputName.parse(name).model == key])
        if values:
            yield f"{'With' if key else 'At'} {values}."


def at_text(point: xr.Dataset, names: Sequence[str]) -> str:
    """Names and values of the inputs that have a single value at a point; no line break separates the two."""
    values = (f"{name} = {coordinate_text(point[name])}" for name in names if point[name].ndim == 0)
    return ", ".join(value.replace(" ", "\u00a0") for value in values)


def iterate_choices(dataset: xr.Dataset, keys: Sequence[str]) -> Iterator[tuple[str, Choice, dict[Hashable, int]]]:
    """The figures of a result: over e, else the first axis of several numbers; the loop is at its middle.

    Returns
    -------
    (kind, Choice, position) : of each figure; the position has an index for each axis that is not drawn
    """
    for own, is_own in (("calibration", is_calibration), ("sensitivity", is_sensitivity)):
        if is_own(dataset):
            yield own, Choice(models=keys if own == "sensitivity" else None), {}
            return
    along = {name: dataset[name] for name in varying(dataset) if dataset[name].ndim == 1}
    along = {
        name: coordinate
        for name, coordinate in along.items()
        if coordinate.dtype.kind == "f" and _count_different(coordinate.values) > 1
    }
    x = "e" if "e" in along else next(iter(along), None)
    # a parameter of a single model is not an axis of a map of several models
    across = [name for name in along if len(keys) == 1 or not InputName.parse(name).model]
    # an uncertain input is no axis of a map
    across = [name for name in across if along[name].dims != (SAMPLE,)]
    y = next((name for name in across if x and along[name].dims != along[x].dims), None)
    few_e = ("e",) if "e" in along and along["e"].size <= MAX_RESTITUTIONS else ()
    steps = next((name for name in STEP_AXES if name in along), None)
    for kind in FIGURES:
        if kind in ("calibration", "sensitivity") or (kind in MAP_KINDS and not y):
            continue
        if kind == "uncertainty" and SAMPLE not in dataset.dims:
            continue
        if (kind == "timestep" and not steps) or (kind == "loop" and has_fixed_steps(dataset)):
            continue
        names = (x, y) if kind in MAP_KINDS else (steps, "phase", *few_e) if kind == "timestep" else (x,)
        drawn = list(dict.fromkeys(along[name].dims[0] for name in names if name in along))
        position = _first_answered_index(dataset, keys, drawn)
        if kind != "loop":
            sel = {str(dim): dataset[dim].values[index].item() for dim, index in position.items()}
            if kind == "uncertainty":
                sel.pop(SAMPLE, None)
                position.pop(SAMPLE, None)
            # bands are over an axis, not over an uncertain input
            is_uncertain = x is not None and along[x].dims == (SAMPLE,)
            shown_x = steps if kind == "timestep" else None if kind == "uncertainty" and is_uncertain else x
            yield kind, Choice(shown_x, y if kind in MAP_KINDS else None, sel=sel, models=keys), position
            continue
        if x:
            position[drawn[0]] = int(np.argsort(along[x].values, kind="stable")[along[x].size // 2])
        yield kind, Choice(sel=_inputs_at(dataset, position), models=keys), position


def _inputs_at(dataset: xr.Dataset, position: Mapping[Hashable, int]) -> dict[str, float | str]:
    """The inputs that select a point: the label of each axis, or all columns of an axis of cases or samples."""
    names = {dim: [str(dim)] if is_input(dim) else columns_along(dataset, dim) for dim in position}
    at = {name: dataset[name].values[position[dim]].item() for dim in names for name in names[dim]}
    # a missing number is not an input
    return {name: value for name, value in at.items() if value == value}


def _count_different(values: NDArray[Any]) -> int:
    return np.unique(values[np.isfinite(values)]).size


def _first_answered_index(
    dataset: xr.Dataset, keys: Sequence[str], drawn: Sequence[Hashable]
) -> dict[Hashable, int]:
    """Index along each axis that is not drawn: of the first impact that a model has an answer for."""
    dims = dataset["status"].dims if "status" in dataset else dataset.dims
    axes = [dim for dim in dims if dim not in ("model", *drawn)]
    first: tuple[int, ...] | None = None
    for index in model_positions(keys, dataset) if "status" in dataset else ():
        answered = _first_answered_of_model(dataset.isel(model=index), axes)
        first = min(filter(None, (first, answered)), default=None)
        if first is not None and not any(first):
            break
    return dict(zip(axes, first or (0,) * len(axes), strict=True))


def _first_answered_of_model(of_model: xr.Dataset, axes: Sequence[Hashable]) -> tuple[int, ...] | None:
    """Index along some axes of the first impact that a model has an answer for; None if there is none.

    If the status of more than MAX_SEARCHED points would be computed, a coarser grid is searched.
    """
    status, _ = distinct_points(of_model, "status")
    ordered = [*axes, *(dim for dim in status.dims if dim not in axes)]
    steps = dict.fromkeys(ordered, 1)
    if is_computed(status):
        while math.prod(-(-status.sizes[dim] // step) for dim, step in steps.items()) > MAX_SEARCHED:
            steps[max(steps, key=lambda dim: status.sizes[dim] / steps[dim])] *= 2
    status = status.isel({dim: slice(None, None, step) for dim, step in steps.items()})
    for where in slabs({dim: status.sizes[dim] for dim in ordered}):
        part = status.isel(where)
        values = part.values.transpose([part.dims.index(dim) for dim in ordered])
        answered = (values < FIRST_FAILURE) & (values != NO_IMPACT)
        if answered.any():
            first = np.unravel_index(int(np.argmax(answered)), answered.shape)
            return tuple(
                (where[dim].start + int(index)) * steps[dim] for dim, index in zip(axes, first, strict=False)
            )
    return None


def varying(dataset: xr.Dataset) -> list[str]:
    """The inputs that vary: each axis with the inputs along it, then the inputs that vary along several axes."""
    dims_of = {
        str(name): coordinate.dims
        for name, coordinate in dataset.coords.items()
        if coordinate.ndim and "model" not in coordinate.dims and is_input(name)
    }
    along = [name for dim in dataset.dims for name in (str(dim), *dims_of) if dims_of.get(name) == (dim,)]
    return list(dict.fromkeys([*along, *dims_of]))


def coordinate_text(coordinate: xr.DataArray) -> str:
    """The value of a scalar coordinate with its unit."""
    unit = unit_of(coordinate)
    return label(coordinate.values.item()) + (f" {unit}" if unit else "")


def unit_of(coordinate: xr.DataArray) -> str:
    """The unit of a coordinate; empty if it has none."""
    unit = plain_unit(str(coordinate.attrs.get("units", "")))
    return "" if unit == "1" else unit
