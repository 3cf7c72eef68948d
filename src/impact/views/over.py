"""Pictures over one axis of a result: velocities, restitution and its error."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError
from ..results.schema import exponents_of, plain_unit
from ..text import safe_text, with_year
from .lines import Curve, Lines, Panel
from .look import axis_label, is_geometric
from .slices import read, sorted_along, take_slice

if TYPE_CHECKING:
    import xarray as xr

FIGURE_6 = "Final velocities comparison"
Array = NDArray[np.float64]
# what is called near, and nearer
BANDS = (0.05, 0.01)
# an error below this is the solver's, and has no place on a logarithmic axis
SMALLEST = 1e-9


def final_velocities(
    dataset: xr.Dataset,
    x: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
    log: str = "",
) -> Lines:
    """Figure 6 of the paper: post-impact velocities of every model and of the impulse-momentum solution.

    Parameters
    ----------
    dataset : a result
    x, sel, models : see `impact.views.slices.take_slice`
    log : axes that are logarithmic, of "x" and "y"; an x that is spaced so is in any case

    Raises
    ------
    UsageError : the result has not got what is asked for
    """
    data, x, not_drawn = _along(dataset, x, sel, models, "v1_post", "v2_post", "v1_reference", "v2_reference")
    references = [
        _curve("Impulse-momentum (6), (7)", None, data, x, data[f"v{ball}_reference"], end)
        for ball, end in ((1, "v₁⁺"), (2, "v₂⁺"))
    ]
    curves = [
        _curve(label_of(one), str(one["model"].item()), data, x, one[f"v{ball}_post"], end)
        for one in _models(data)
        for ball, end in ((1, "v₁⁺"), (2, "v₂⁺"))
    ]
    panel = Panel(axis_label(data[x]), "velocity after the impact [m/s]", (*_known(references), *curves))
    return _lines(dataset, data, x, FIGURE_6, [panel], not_drawn, log)


def restitution(
    dataset: xr.Dataset,
    x: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
    log: str = "",
) -> Lines:
    """The delivered restitution of every model, beside what was asked for; see `final_velocities`."""
    data, x, not_drawn = _along(dataset, x, sel, models, "e_out")
    asked = _known([_curve("as asked for, e_out = e", None, data, x, data["e"])]) if "e" in data.coords else []
    curves = [_curve(label_of(one), str(one["model"].item()), data, x, one["e_out"]) for one in _models(data)]
    panel = Panel(axis_label(data[x]), "restitution delivered, e_out", (*asked, *curves))
    return _lines(dataset, data, x, "Restitution delivered", [panel], not_drawn, log)


def error(
    dataset: xr.Dataset,
    x: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
    log: str = "",
) -> Lines:
    """What every model's restitution is off by, signed and absolute; see `final_velocities`."""
    data, x, not_drawn = _along(dataset, x, sel, models, "e_error")
    ones = [(label_of(one), str(one["model"].item()), one["e_error"]) for one in _models(data)]
    if not any(np.isfinite(values).any() for _, _, values in ones):
        raise UsageError("this result has no restitution asked for, from which an error could be told; sweep e")
    signed = [_curve(label, model, data, x, values) for label, model, values in ones]
    absolute = [
        _curve(label, model, data, x, np.maximum(np.abs(values), SMALLEST)) for label, model, values in ones
    ]
    panels = [
        Panel(axis_label(data[x]), "e_out − e", tuple(signed), bands=BANDS),
        Panel(axis_label(data[x]), "|e_out − e|", tuple(absolute), y_log=True, bands=BANDS),
    ]
    return _lines(dataset, data, x, "Error of the restitution", panels, not_drawn, log)


def _along(
    dataset: xr.Dataset,
    x: str | None,
    sel: Mapping[str, float | str] | None,
    models: Sequence[str] | None,
    *names: str,
) -> tuple[xr.Dataset, str, tuple[str, ...]]:
    """The line of a result that is drawn, sorted, with its variables in memory; over what; what is not drawn."""
    if "model" not in dataset.dims:
        raise UsageError("this is a time history, not the result of a sweep; draw it with --kind loop, or history")
    missing = [name for name in names if name not in dataset]
    if missing:
        raise UsageError(f"this result has no {', '.join(missing)}; sweep without [output] variables, or add them")
    line, x = take_slice(dataset, x, sel, models)
    along = line[x].values
    data = sorted_along(line, x)
    if not data[x].size:
        raise UsageError(f"{safe_text(x)} has no finite value to draw over")
    return read(data, names), x, tuple(f"{x} = {value}" for value in along[~np.isfinite(along)].tolist())


def _models(data: xr.Dataset) -> list[xr.Dataset]:
    return [data.isel(model=place) for place in range(data.sizes["model"])]


def _curve(
    label: str, model: str | None, data: xr.Dataset, x: str, values: xr.DataArray | Array, end: str = ""
) -> Curve:
    along = data[x].values
    drawn = np.broadcast_to(np.asarray(values, float), along.shape)
    return Curve(label, model, tuple(along.tolist()), tuple(drawn.tolist()), end)


def _known(references: list[Curve]) -> list[Curve]:
    """Without a restitution asked for there is no reference."""
    return [one for one in references if np.isfinite(one.y).any()]


def _lines(
    dataset: xr.Dataset,
    data: xr.Dataset,
    x: str,
    title: str,
    panels: Sequence[Panel],
    not_drawn: tuple[str, ...],
    log: str,
) -> Lines:
    own, conditions = safe_text(str(dataset.attrs.get("title", "")), 140), conditions_of(data, x)
    if own and title != FIGURE_6:
        own, conditions = title, f"{own}: {conditions}"
    x_log = is_geometric(data[x].values) or ("x" in log and bool(np.all(data[x].values > 0.0)))
    panels = [replace(one, x_log=x_log, y_log=one.y_log or "y" in log) for one in panels]
    empty = {c.model: None for panel in panels for c in panel.curves if c.model and not np.isfinite(c.y).any()}
    return Lines(
        own or title,
        conditions,
        tuple(panels),
        (*not_drawn, *(f"{key}, which has no point here" for key in empty)),
    )


def label_of(one: xr.Dataset) -> str:
    """Title, year and equation number of a model of a result."""
    return title_of(str(one["title"].values), int(one["year"].values), str(one["equation"].values))


def title_of(title: str, year: int, equation: str) -> str:
    """Title, year and equation number of a model."""
    number = re.search(r"\(\d+\)(?:-\(\d+\))?$", equation)
    name = with_year(title, year)
    return safe_text(f"{name}, {number[0]}" if number else name, 80)


def conditions_of(data: xr.Dataset, *drawn: str) -> str:
    """The values of everything that is not drawn over."""
    parts = []
    for name, coordinate in data.coords.items():
        model, _, own = str(name).rpartition(".")
        of_a_model_not_shown = own != name and model not in data["model"].values
        if coordinate.ndim == 0 and name not in ("model", *drawn) and not of_a_model_not_shown:
            value = coordinate.values.item()
            unit = plain_unit(str(coordinate.attrs.get("units", "1")))
            text = f"{value:g}" if isinstance(value, float) else str(value)
            if name == "n":
                text = exponents_of(data) or text
            parts.append(safe_text(f"{name} = {text}" + (f" {unit}" if unit != "1" else ""), 60))
    # each stays on its line
    return ", ".join(part.replace(" ", "\u00a0") for part in parts)
