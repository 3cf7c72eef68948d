"""The numbers of pictures over two axes: a variable of each model, and which model is closest to e."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError, did_you_mean
from ..results.select import places_of, select
from ..text import safe_text
from .look import axis_label, is_geometric
from .over import conditions_of, label_of
from .slices import read, sorted_along, x_axis

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Rows = tuple[tuple[float, ...], ...]
# at most so many panels are drawn
PANELS = 12
# errors this close are equal; one below the second is the solver's, and has no place on a logarithmic scale
TIE, SMALLEST = 1e-9, 1e-9


@dataclass(frozen=True)
class Panel:
    """One panel: its title, the model's key (None for the reference), and a value by y and x."""

    label: str
    model: str | None
    values: Rows


@dataclass(frozen=True)
class Grids:
    """The numbers of a picture: panels over the same two axes, and what is not drawn.

    `labels` are those of x, y and the variable; `left_out` the models without a panel. `closest` has by y and x
    the key of the model with the smallest |e_error|, `distance` that number; a map has neither.
    """

    title: str
    conditions: str
    variable: str
    x: str
    y: str
    labels: tuple[str, str, str]
    x_values: tuple[float, ...]
    y_values: tuple[float, ...]
    x_log: bool
    y_log: bool
    signed: bool
    panels: tuple[Panel, ...]
    not_drawn: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    closest: tuple[tuple[str | None, ...], ...] = ()
    distance: Rows = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of what `rows` gives."""
        return ("model", self.x, self.y, self.variable, *(("closest", "abs_e_error") if self.closest else ()))

    @property
    def shares(self) -> dict[str | None, float]:
        """The part of all cells [%] where each model is closest, in the result's order; None is where none is."""
        count = Counter(key for row in self.closest for key in row)
        keys = (*(panel.model for panel in self.panels), None)
        return {key: 100.0 * count[key] / count.total() for key in keys if count[key]}

    def rows(self) -> Iterator[tuple[str | float, ...]]:
        """The numbers behind the picture, one point a row."""
        for panel in self.panels:
            for i, x in enumerate(self.x_values):
                for j, y in enumerate(self.y_values):
                    best = (self.closest[j][i] or "", self.distance[j][i]) if self.closest else ()
                    yield (panel.model or "", x, y, panel.values[j][i], *best)


def field_map(
    dataset: xr.Dataset, *, variable: str = "e_error", x: str | None = None, y: str | None = None,
    sel: Mapping[str, float | str] | None = None, models: Sequence[str] | None = None, log: str = "",
) -> Grids:  # fmt: skip
    """A variable over two axes, for each model.

    Parameters
    ----------
    dataset : a result
    variable : its name
    x, y : the axes; by default e, else the first numeric axis, and the next one
    sel : values of other axes, by name; an axis that is not named shows its first value
    models : keys of the models to show; by default all, of which the first 12 are drawn
    log : axes that are logarithmic, of "x" and "y"; one that is spaced so is in any case

    Raises
    ------
    UsageError : the result has not got what is asked for, or not two axes
    """
    numbers = _numbers("map", dataset, variable, x, y, sel, models, log, PANELS)
    if not numbers.left_out:
        return numbers
    count = f"the first {PANELS} of {PANELS + len(numbers.left_out)} models"
    return replace(numbers, conditions="; ".join(filter(None, (numbers.conditions, count))))


def validity(
    dataset: xr.Dataset, *, x: str | None = None, y: str | None = None,
    sel: Mapping[str, float | str] | None = None, models: Sequence[str] | None = None, log: str = "",
) -> Grids:  # fmt: skip
    """Over two axes, which model has the smallest |e_error|, and how small it is; see `field_map`.

    Of models that are equally close (to 1e-9) it is the first in the result.
    """
    numbers = _numbers("validity", dataset, "e_error", x, y, sel, models, log)
    error = np.abs([panel.values for panel in numbers.panels])
    error[np.isnan(error)] = np.inf
    # the first place where it is so
    place = np.argmax(error <= error.min(axis=0) + TIE, axis=0)
    closest = np.array([panel.model for panel in numbers.panels], object)[place]
    distance = np.take_along_axis(error, place[None], axis=0)[0]
    unknown = np.isinf(distance)
    closest[unknown], distance[unknown] = None, np.nan
    return replace(numbers, closest=_rows(closest), distance=_rows(distance))


def _rows(values: NDArray[Any]) -> tuple[Any, ...]:
    return tuple(map(tuple, values.tolist()))


def _numbers(
    kind: str, dataset: xr.Dataset, variable: str, x: str | None, y: str | None,
    sel: Mapping[str, float | str] | None, models: Sequence[str] | None, log: str, most: int | None = None,
) -> Grids:  # fmt: skip
    """The panels of the models, at most so many; of the others nothing is read."""
    if "model" not in dataset.dims:
        raise UsageError("this is a time history, not the result of a sweep; draw it with --kind loop, or history")
    if variable not in dataset.data_vars:
        known = did_you_mean(variable, [str(name) for name in dataset.data_vars])
        raise UsageError(f'no variable "{safe_text(variable)}" in this result; {known}')
    data, x, y, not_drawn = take_plane(dataset, kind, x, y, sel, models)
    field, plane = data[variable], (*data[y].dims, *data[x].dims)
    left_out: tuple[str, ...] = ()
    if "model" in field.dims:
        left_out = tuple(map(str, field["model"].values[most:].tolist())) if most is not None else ()
        field = field.isel(model=slice(most))
    what = safe_text(f"{variable} over {x} and {y}")
    if field.dtype.kind not in "iuf" or not set(plane) <= set(field.dims):
        raise UsageError(f"no picture of {what}: it is not a number at each point")
    # of shape (models, y, x); the reference has no models
    in_memory = read(field.to_dataset(name=variable), [variable])[variable]
    values = np.asarray(in_memory.transpose(..., *plane).values, float)
    values = values.reshape(-1, *values.shape[-2:])
    finite = values[np.isfinite(values)]
    if not finite.size:
        raise UsageError(f"no picture of {what}: it has no value there")
    for letter, name in (("x", x), ("y", y)):
        if letter in log and data[name].values[0] <= 0.0:
            raise UsageError(f"--log {letter}: {safe_text(name)} has values that are not above 0")
    names: list[tuple[str, str | None]] = [("Impulse-momentum (6), (7)", None)]
    if "model" in field.dims:
        by_model = (data.isel(model=place) for place in range(field.sizes["model"]))
        names = [(label_of(of_model), str(of_model["model"].item())) for of_model in by_model]
    title = what if kind == "map" else safe_text(f"Closest model over {x} and {y}")
    own = safe_text(str(dataset.attrs.get("title", "")), 140)
    return Grids(
        f"{title}: {own}" if own else title, conditions_of(data, x, y), variable, x, y,
        labels=(axis_label(data[x]), axis_label(data[y]), axis_label(field)),
        x_values=tuple(data[x].values.tolist()),
        y_values=tuple(data[y].values.tolist()),
        x_log="x" in log or is_geometric(data[x].values),
        y_log="y" in log or is_geometric(data[y].values),
        # errors, and what has values of both signs, not by rounding alone
        signed=variable.endswith(("_error", "energy_residual")) or bool(-finite.min() > 1e-3 * finite.max() > 0.0),
        panels=tuple(Panel(*name, _rows(one)) for name, one in zip(names, values, strict=True)),
        not_drawn=not_drawn,
        left_out=left_out,
    )  # fmt: skip


def take_plane(
    dataset: xr.Dataset, kind: str, x: str | None = None, y: str | None = None,
    sel: Mapping[str, float | str] | None = None, models: Sequence[str] | None = None,
) -> tuple[xr.Dataset, str, str, tuple[str, ...]]:  # fmt: skip
    """Cut a plane through a result: the dataset over two sorted axes, their names, and values without a place.

    For the parameters and errors see `field_map`; `kind` is what wants the plane.
    """
    if models:
        dataset = dataset.isel(model=places_of(models, dataset))
    dataset = select(dataset, sel or {})
    along = [x_axis(dataset, name) for name in (x, y) if name is not None]
    dims = [dataset[name].dims[0] for name in along]
    # by default nothing is drawn over an axis of one value, nor over what varies along several
    plain = dataset.drop_vars([name for name, coordinate in dataset.coords.items() if coordinate.ndim > 1])
    while len(along) < 2:
        taken = [dim for dim, size in plain.sizes.items() if dim != "model" and (size == 1 or dim in dims)]
        try:
            along.append(x_axis(plain.isel(dict.fromkeys(taken, 0)), None))
        except UsageError:
            has = f"{safe_text(along[0])} alone; sweep a second" if along else "none; sweep e and another"
            raise UsageError(f"{kind} wants two axes; this result has {has}, or use --kind restitution") from None
        dims.append(dataset[along[-1]].dims[0])
    if dims[0] == dims[1]:
        raise UsageError(f"{kind} wants two axes; {safe_text(f'{along[0]} and {along[1]} vary together')}")
    dataset = dataset.isel({dim: 0 for dim in dataset.sizes if dim not in ("model", *dims)})
    not_drawn: list[str] = []
    for name in along:
        values = dataset[name].values
        finite = np.isfinite(values)
        not_drawn += [f"{name} = {value}" for value in values[~finite].tolist()]
        different = np.unique(values[finite]).size
        if different < max(2, int(finite.sum())):
            has = "has a value twice" if different > 1 else f"has {different} that can be drawn"
            raise UsageError(f"{kind} wants different values along each axis; {safe_text(name)} {has}")
        dataset = sorted_along(dataset, name)
    first, second = along if x is not None or y is None else along[::-1]
    return dataset, first, second, tuple(not_drawn)
