"""The figures of a page about a result: which there are, over what, and at which point."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..contact.status import FIRST_FAILURE, NO_IMPACT
from ..engine.plan import owner_of
from ..errors import ImpactError
from ..formatting import label
from ..plots.kinds import WIDTHS, Choice, draw
from ..plots.style import encoded
from ..results.schema import columns_along, is_input, plain_unit
from ..results.selection import model_positions
from ..results.slabs import distinct_points, is_computed, slabs

if TYPE_CHECKING:
    import xarray as xr

    from ..plots.kinds import Numbers

# the figures, and what each shows
FIGURES = {
    "final-velocities": "Velocities after the impact, beside the impulse-momentum solution.",
    "restitution": "Restitution delivered, beside what was asked for.",
    "error": "Error of the restitution: signed above, absolute below.",
    "map": "Error of the restitution over two axes, a panel for each model.",
    "validity": "Which model is closest to what was asked for, and how close it is.",
    "loop": "Force over indentation at one point: the area of a loop is the energy that is lost.",
}
PLANES = ("map", "validity")
# points of which a figure's conditions are the first with an answer
MAX_SEARCHED = 2**18


@dataclass(frozen=True)
class Figure:
    """A figure of a report.

    Parameters
    ----------
    label : what it shows
    caption : the same, with the point where it is drawn and what is left out of it
    source : the picture, as the URL of an image that holds it
    """

    label: str
    caption: str
    source: str


def figures_of(
    dataset: xr.Dataset, keys: Sequence[str], figures: Callable[[str, Choice], Numbers]
) -> tuple[list[Figure], list[str]]:
    """The figures of a result, and a sentence for each one that cannot be drawn.

    Parameters
    ----------
    dataset : a result
    keys : of the models that are shown
    figures : the numbers of a figure, of its kind and of what it shows
    """
    drawn, reasons = [], []
    for kind, choice, places in choices(dataset, keys):
        try:
            numbers = figures(kind, choice)
            # its title and conditions are the caption; narrow, so that its text is legible on a phone
            figure = draw(replace(numbers, title="", conditions=""), WIDTHS["single"])
        except ImpactError as error:
            reasons.append(f"The figure {kind} is left out: {'; '.join(str(error).splitlines())}")
            continue
        # nothing is behind it but the page, which may be dark
        for background in (figure.patch, *(axes.patch for axes in figure.axes)):
            background.set_visible(False)
        source = f"data:image/svg+xml;base64,{base64.b64encode(encoded(figure, 'svg')).decode()}"
        sentences = [FIGURES[kind], *_conditions(dataset, places, keys)]
        sentences += [f"Not drawn: {'; '.join(numbers.not_drawn)}."] if numbers.not_drawn else []
        drawn.append(Figure(FIGURES[kind], " ".join(sentences), source))
    return drawn, reasons


def _conditions(dataset: xr.Dataset, places: Mapping[Hashable, int], keys: Sequence[str]) -> Iterator[str]:
    """Where a figure is drawn: the values of what varies in the sweep and not in the figure.

    A parameter of a model stands with that model, and not at all where it is not shown.
    """
    point, inputs = dataset.isel(places), varying(dataset)
    for key in ("", *keys):
        values = at_text(point, [name for name in inputs if owner_of(name) == key])
        if values:
            yield f"{'With' if key else 'At'} {values}."


def at_text(point: xr.Dataset, names: Sequence[str]) -> str:
    """Those of some inputs that have a single value at a point, each of them on one line."""
    values = (f"{name} = {quantity(point[name])}" for name in names if point[name].ndim == 0)
    return ", ".join(value.replace(" ", "\u00a0") for value in values)


def choices(dataset: xr.Dataset, keys: Sequence[str]) -> Iterator[tuple[str, Choice, dict[Hashable, int]]]:
    """The figures of a result: over e, else the first axis of several numbers; the loop is at the middle of it.

    Returns
    -------
    (kind, Choice, places) : of each figure, the last along the axes that are not drawn over
    """
    along = {name: dataset[name] for name in varying(dataset) if dataset[name].ndim == 1}
    along = {name: one for name, one in along.items() if one.dtype.kind == "f" and _different(one.values) > 1}
    x = "e" if "e" in along else next(iter(along), None)
    # a parameter of one of several models is no axis of a map of them all
    across = [name for name in along if len(keys) == 1 or not owner_of(name)]
    y = next((name for name in across if x and along[name].dims != along[x].dims), None)
    for kind in FIGURES:
        if kind in PLANES and not y:
            continue
        drawn = [along[name].dims[0] for name in ((x, y) if kind in PLANES else (x,)) if name]
        places = _answered(dataset, keys, drawn)
        if kind != "loop":
            sel = {str(dim): dataset[dim].values[place].item() for dim, place in places.items()}
            yield kind, Choice(x, y if kind in PLANES else None, sel=sel, models=keys), places
            continue
        if x:
            places[drawn[0]] = int(np.argsort(along[x].values, kind="stable")[along[x].size // 2])
        yield kind, Choice(sel=_inputs(dataset, places), models=keys), places


def _inputs(dataset: xr.Dataset, places: Mapping[Hashable, int]) -> dict[str, float | str]:
    """The inputs that name a point: the label of each axis, or all columns of one whose labels only number it."""
    names = {dim: [str(dim)] if is_input(str(dim)) else columns_along(dataset, dim) for dim in places}
    at = {name: dataset[name].values[places[dim]].item() for dim in names for name in names[dim]}
    # a number that is missing is no input there
    return {name: value for name, value in at.items() if value == value}


def _different(values: NDArray[Any]) -> int:
    return np.unique(values[np.isfinite(values)]).size


def _answered(dataset: xr.Dataset, keys: Sequence[str], drawn: Sequence[Hashable]) -> dict[Hashable, int]:
    """Places along the axes that are not drawn over: the first where the balls meet and a model has an answer."""
    dims = dataset["status"].dims if "status" in dataset else dataset.dims
    axes = [dim for dim in dims if dim not in ("model", *drawn)]
    first: tuple[int, ...] | None = None
    for place in model_positions(keys, dataset) if "status" in dataset else ():
        answered = _first_answered(dataset.isel(model=place), axes)
        first = min(filter(None, (first, answered)), default=None)
        if first is not None and not any(first):
            break
    return dict(zip(axes, first or (0,) * len(axes), strict=True))


def _first_answered(of_model: xr.Dataset, axes: Sequence[Hashable]) -> tuple[int, ...] | None:
    """The first place along some axes at which a model has an answer for balls that meet; None where it has none.

    Where the status of more than MAX_SEARCHED points would have to be computed, those of a coarser grid are.
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
                (where[dim].start + int(place)) * steps[dim] for dim, place in zip(axes, first, strict=False)
            )
    return None


def varying(dataset: xr.Dataset) -> list[str]:
    """The inputs that vary: the axes, each with what varies along it, then what varies along several."""
    found = {str(name): one.dims for name, one in dataset.coords.items()
             if one.ndim and "model" not in one.dims and is_input(str(name))}  # fmt: skip
    along = [name for dim in dataset.dims for name in (str(dim), *found) if found.get(name) == (dim,)]
    return list(dict.fromkeys([*along, *found]))


def quantity(coordinate: xr.DataArray) -> str:
    """The value of a coordinate that has one, with its unit."""
    unit = unit_of(coordinate)
    return label(coordinate.values.item()) + (f" {unit}" if unit else "")


def unit_of(coordinate: xr.DataArray) -> str:
    """The unit of a coordinate; empty of what has none."""
    unit = plain_unit(str(coordinate.attrs.get("units", "")))
    return "" if unit == "1" else unit
