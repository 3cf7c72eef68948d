"""The figures of a report: their kinds, axes, and the point they are drawn at."""

from __future__ import annotations

import base64
import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..config.grid import SAMPLE
from ..config.input_names import InputName, is_input
from ..contact.model import ForceModel
from ..contact.status import FIRST_FAILURE, NO_IMPACT
from ..errors import ImpactError
from ..formatting import degrees, label
from ..plots.draw import draw, get_plot_data
from ..plots.kinds import STUDIES, Choice, Kind, Look, kinds_of
from ..plots.slices import numeric_axes, unit_of, varying_inputs
from ..plots.style import encoded
from ..results.schema import columns_along
from ..results.selection import law_positions
from ..results.slabs import distinct_points, is_computed, slabs

if TYPE_CHECKING:
    import xarray as xr

# points that are searched for the first one with an answer, at which the figures are drawn
MAX_SEARCHED = 2**18


@dataclass(frozen=True)
class Figure:
    """A figure of a report: what it shows, a caption with its point, and the picture as a data URL."""

    label: str
    caption: str
    source: str
    of_friction: bool


def figures_of(
    dataset: xr.Dataset, keys: Sequence[str], plugins: Sequence[ForceModel | str | Path]
) -> tuple[list[Figure], list[str]]:
    """Draw the figures of a result; returns them, and a sentence for each figure that cannot be drawn."""
    drawn, reasons = [], []
    for kind, choice, position in iterate_choices(dataset, keys):
        try:
            plot_data = get_plot_data(dataset, kind.name, choice, plugins)
            # title and conditions are in the caption; the figure is narrow, so that its text is legible on a phone
            figure = draw(plot_data, Look(width="single", title=False))
        except ImpactError as error:
            reasons.append(f"The figure {kind.name} is left out: {'; '.join(error.problems)}")
            continue
        # transparent, because the page may be dark
        for background in (figure.patch, *(axes.patch for axes in figure.axes)):
            background.set_visible(False)
        source = f"data:image/svg+xml;base64,{base64.b64encode(encoded(figure, 'svg')).decode()}"
        sentences = [kind.caption, *_condition_sentences(dataset, position, keys)]
        sentences += [f"Not drawn: {'; '.join(plot_data.not_drawn)}."] if plot_data.not_drawn else []
        drawn.append(Figure(kind.caption, " ".join(sentences), source, kind.of_friction))
    return drawn, reasons


def _condition_sentences(
    dataset: xr.Dataset, position: Mapping[Hashable, int], keys: Sequence[str]
) -> Iterator[str]:
    """Write the inputs that vary in the sweep and not in the figure: for all models, and for each model."""
    point, inputs = dataset.isel(position), varying_inputs(dataset)
    for key in ("", *keys):
        values = at_text(point, [name for name in inputs if InputName.parse(name).model == key])
        if values:
            yield f"{'With' if key else 'At'} {values}."


def at_text(point: xr.Dataset, names: Sequence[str]) -> str:
    """Write the inputs that have a single value at a point; no line break separates a name from its value."""
    values = (f"{name} = {coordinate_text(point[name])}" for name in names if point[name].ndim == 0)
    return ", ".join(value.replace(" ", "\u00a0") for value in values)


def iterate_choices(
    dataset: xr.Dataset, keys: Sequence[str]
) -> Iterator[tuple[Kind, Choice, dict[Hashable, int]]]:
    """Choose the figures of a result: their kinds, what each shows, and an index for each axis it does not draw.

    A motion comes last, at the middle of the axis of other figures.
    """
    axes = numeric_axes(dataset)
    for kind in sorted(kinds_of(dataset), key=lambda kind: kind.source == "history"):
        choice = kind.default(dataset, keys) if kind.in_report else None
        if choice is None:
            continue
        if kind.source in STUDIES:
            yield kind, choice, {}
            continue
        is_motion = kind.source == "history"
        inputs = [choice.x] if is_motion else kind.inputs_along(choice.x, choice.y)
        dims = [axes[name].dims[0] for name in inputs if name in axes and name not in (choice.sel or {})]
        position = _first_answered_index(dataset, keys, [*dims, *({SAMPLE} & {*kind.along})])
        if not is_motion:
            sel = {str(dim): dataset[dim].values[index].item() for dim, index in position.items()}
            yield kind, replace(choice, sel=sel), position
            continue
        if choice.x:
            values = axes[choice.x].values
            position[dims[0]] = int(np.argsort(values, kind="stable")[values.size // 2])
        yield kind, replace(choice, x=None, sel=_inputs_at(dataset, position)), position


def _inputs_at(dataset: xr.Dataset, position: Mapping[Hashable, int]) -> dict[str, float | str]:
    """Find the inputs that select a point: the label of an axis, or all columns of an axis of cases or samples."""
    names = {dim: [str(dim)] if is_input(dim) else columns_along(dataset, dim) for dim in position}
    inputs = {name: dataset[name].values[position[dim]].item() for dim in names for name in names[dim]}
    # a missing number is not an input
    return {name: value for name, value in inputs.items() if value == value}


def _first_answered_index(
    dataset: xr.Dataset, keys: Sequence[str], drawn: Sequence[Hashable]
) -> dict[Hashable, int]:
    """Find the first impact that a model has an answer for: its index along each axis that is not drawn."""
    dims = dataset["status"].dims if "status" in dataset else dataset.dims
    axes = [dim for dim in dims if dim not in ("model", "friction", *drawn)]
    first: tuple[int, ...] | None = None
    for index in law_positions(keys, dataset) if "status" in dataset else ():
        answered = _first_answered_of_model(dataset.isel(model=index), axes)
        first = min(filter(None, (first, answered)), default=None)
        if first is not None and not any(first):
            break
    return dict(zip(axes, first or (0,) * len(axes), strict=True))


def _first_answered_of_model(model_data: xr.Dataset, axes: Sequence[Hashable]) -> tuple[int, ...] | None:
    """Find the first impact that a model has an answer for: its index along some axes; None without one.

    If the status of more than MAX_SEARCHED points would be computed, a coarser grid is searched.
    """
    status, _ = distinct_points(model_data, "status")
    ordered = [*axes, *(dim for dim in status.dims if dim not in axes)]
    steps = dict.fromkeys(ordered, 1)
    if is_computed(status):
        while math.prod(-(-status.sizes[dim] // step) for dim, step in steps.items()) > MAX_SEARCHED:
            steps[max(steps, key=lambda dim: status.sizes[dim] / steps[dim])] *= 2
    status = status.isel({dim: slice(None, None, step) for dim, step in steps.items()})
    for region in slabs({dim: status.sizes[dim] for dim in ordered}):
        part = status.isel(region)
        values = part.values.transpose([part.dims.index(dim) for dim in ordered])
        answered = (values < FIRST_FAILURE) & (values != NO_IMPACT)
        if answered.any():
            first = np.unravel_index(int(np.argmax(answered)), answered.shape)
            return tuple(
                (region[dim].start + int(index)) * steps[dim] for dim, index in zip(axes, first, strict=False)
            )
    return None


def coordinate_text(coordinate: xr.DataArray) -> str:
    """Write the value of a scalar coordinate with its unit."""
    unit = unit_of(coordinate)
    if unit == "rad":
        return degrees(coordinate.values.item())
    return label(coordinate.values.item()) + (f" {unit}" if unit not in ("", "1") else "")
