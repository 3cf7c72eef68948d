"""Lines and planes through a result that a picture shows, and the values of all other inputs."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import xarray as xr

from ..config.grid import SAMPLE
from ..config.input_names import InputName, is_input
from ..config.tables import OBLIQUE_DEFAULTS
from ..contact.units import names_in, with_numbers
from ..errors import UsageError, did_you_mean
from ..formatting import NO_BREAK, argument, prefixed, safe_text
from ..results.schema import exponents_of, unit_of
from ..results.selection import require_outputs, select, select_laws
from .kinds import Choice

# values in a picture, which are held as Python objects
MAX_DRAWN = 2**24
# values of inputs by name, each with its unit
Inputs: TypeAlias = Mapping[str, tuple[object, str]]
# values that go without saying: no spin, no tangential velocity, the inertia of solid spheres
UNSAID = {**OBLIQUE_DEFAULTS, "u1": 0.0, "u2": 0.0}


def not_a_sweep() -> UsageError:
    """The error of a picture of a sweep for a time history."""
    kind = argument("kind", "loop")
    return UsageError(f"this is a time history, not the result of a sweep; draw it with {kind}, or history")


class Line(NamedTuple):
    """A line through a result: the sorted data, the coordinate to draw over, and values without a position."""

    data: xr.Dataset
    x: str
    not_drawn: tuple[str, ...]
    is_ordered: bool  # so that a line may join its points

    @property
    def coordinate(self) -> xr.DataArray:
        return self.data[self.x]


def varying_inputs(dataset: xr.Dataset) -> list[str]:
    """List the inputs that vary: each axis with the inputs along it, then those that vary along several axes."""
    dims_of = {
        str(name): coordinate.dims
        for name, coordinate in dataset.coords.items()
        if coordinate.ndim and "model" not in coordinate.dims and is_input(name)
    }
    along = [name for dim in dataset.dims for name in (str(dim), *dims_of) if dims_of.get(name) == (dim,)]
    return list(dict.fromkeys([*along, *dims_of]))


def numeric_axes(dataset: xr.Dataset) -> dict[str, xr.DataArray]:
    """Find the inputs that have several numbers along one axis."""
    along = {name: dataset[name] for name in varying_inputs(dataset) if dataset[name].ndim == 1}
    return {
        name: coordinate
        for name, coordinate in along.items()
        if coordinate.dtype.kind == "f" and np.unique(coordinate.values[np.isfinite(coordinate.values)]).size > 1
    }


def choose_line(dataset: xr.Dataset, keys: Sequence[str] | None, preferred: str = "e") -> Choice:
    """Choose to draw models over an input, else over the first axis of several numbers."""
    axes = numeric_axes(dataset)
    return Choice(preferred if preferred in axes else next(iter(axes), None), models=keys)


def choose_plane(dataset: xr.Dataset, keys: Sequence[str]) -> Choice | None:
    """Choose a second axis as well; None without one."""
    axes, x = numeric_axes(dataset), choose_line(dataset, keys).x
    for name, coordinate in axes.items():
        # neither a parameter of one model of several nor an uncertain input is an axis of a map
        is_common = len(keys) == 1 or not InputName.parse(name).model
        if x and is_common and coordinate.dims not in ((SAMPLE,), axes[x].dims):
            return Choice(x, name, models=keys)
    return None


def read_line(dataset: xr.Dataset, choice: Choice, *names: str, keep: Sequence[str] = ()) -> Line:
    """Cut a line through a result, and read some of its variables.

    Parameters
    ----------
    dataset : a result
    choice : its x is by default e, else the first numeric axis; an axis without a selected value shows its first
    names : of the variables
    keep : names of coordinates whose axes, where they vary along a single one, are kept

    Raises
    ------
    UsageError : an axis, a value, a model or a variable is not in the result
    """
    dataset = _select(dataset, choice)
    x = x_axis(dataset, choice.x)
    kept = [dataset[name].dims[0] for name in keep if name in dataset.coords and dataset[name].ndim == 1]
    line, not_drawn = _sorted_along(_drop_other_axes(dataset, [dataset[x].dims[0], *kept]), x)
    if not line[x].size:
        raise UsageError(f"{x} has no finite value to draw over")
    require_outputs(dataset, names)
    # in the order of the result; e of an alpha has one axis only after a selection
    return Line(read(line, names), x, not_drawn, _is_ordered(dataset, x))


def take_plane(
    dataset: xr.Dataset, kind: str, choice: Choice, keep: Sequence[str]
) -> tuple[xr.Dataset, str, str, tuple[str, ...]]:
    """Cut a plane through a result for a kind of picture, as `read_line` does a line, with two coordinates."""
    dataset = _select(dataset, choice)
    along = [x_axis(dataset, name) for name in (choice.x, choice.y) if name is not None]
    dims = [dataset[name].dims[0] for name in along]
    # the default is neither an axis of a single value nor a coordinate that varies along several axes
    plain = dataset.drop_vars([name for name, coordinate in dataset.coords.items() if coordinate.ndim > 1])
    while len(along) < 2:
        taken = [dim for dim, size in plain.sizes.items() if dim != "model" and (size == 1 or dim in dims)]
        try:
            along.append(x_axis(plain.isel(dict.fromkeys(taken, 0)), None))
        except UsageError:
            kind_option = argument("kind", "restitution")
            has = f"{along[0]} alone" if along else "none"
            has += " left beside the selected values" if choice.sel else ""
            has += "; sweep a second" if along else "; sweep e and another"
            raise UsageError(f"{kind} needs two axes; this result has {has}, or use {kind_option}") from None
        dims.append(dataset[along[-1]].dims[0])
    if dims[0] == dims[1]:
        raise UsageError(f"{kind} needs two axes; {along[0]} and {along[1]} vary together")
    plane = _drop_other_axes(dataset, [*dims, *keep])
    not_drawn: tuple[str, ...] = ()
    for name in along:
        values = plane[name].values
        finite = values[np.isfinite(values)]
        different = np.unique(finite).size
        if different < max(2, finite.size):
            has = "has a value twice" if different > 1 else f"has {different} that can be drawn"
            raise UsageError(f"{kind} needs different values along each axis; {name} {has}")
        plane, left_out = _sorted_along(plane, name)
        not_drawn += left_out
    first, second = along if choice.x is not None or choice.y is None else along[::-1]
    return plane, first, second, not_drawn


def _select(dataset: xr.Dataset, choice: Choice) -> xr.Dataset:
    """Select the chosen models, friction laws and values of a result."""
    if "model" not in dataset.dims:
        raise not_a_sweep()
    return _marked(select(select_laws(dataset, choice.models, choice.frictions), choice.sel or {}), dataset)


def _drop_other_axes(dataset: xr.Dataset, dims: Sequence[object]) -> xr.Dataset:
    """Reduce a result to the first value of every axis that is not drawn."""
    others = {dim: 0 for dim in dataset.sizes if dim != "model" and dim not in dims}
    return _marked(dataset.isel(others), dataset)


def _marked(part: xr.Dataset, whole: xr.Dataset) -> xr.Dataset:
    """Mark inputs of `UNSAID` of which a part has fewer values than the whole, so that a picture names them."""
    chosen = [name for name in UNSAID if name in whole.coords and whole[name].size > part[name].size]
    return part.assign_coords({name: part[name].assign_attrs(chosen=1) for name in chosen})


def _sorted_along(dataset: xr.Dataset, name: str) -> tuple[xr.Dataset, tuple[str, ...]]:
    """Sort along a coordinate; also returns its infinite values, which have no position on an axis."""
    values = dataset[name].values
    order = np.argsort(values, kind="stable")
    order = order[np.isfinite(values[order])]
    not_drawn = tuple(f"{name} = {value}" for value in values[~np.isfinite(values)].tolist())
    # without a selection a file is read in one piece
    in_order = np.array_equal(order, np.arange(values.size))
    return (dataset if in_order else dataset.isel({dataset[name].dims[0]: order})), not_drawn


def _is_ordered(dataset: xr.Dataset, name: str) -> bool:
    """Whether the points along a coordinate have an order."""
    (dim,) = dataset[name].dims
    # the dimension of cases and samples only numbers them
    if dim not in dataset.coords or dataset[dim].dtype.kind in "iu":
        return False
    values = np.asarray(dataset[name].values, float)
    values = values[np.isfinite(values)]
    together = [other for other, coord in dataset.coords.items() if coord.dims == (dim,) and is_input(other)]
    steps = np.diff(values)
    # values that vary together with others have an order if they are monotonic
    return (dim == name and len(together) <= 1) or bool(np.all(steps > 0.0) or np.all(steps < 0.0))


def read(data: xr.Dataset, names: Sequence[str]) -> xr.Dataset:
    """Read some variables of a line or a plane into memory, unless they are too many to draw."""
    numbers = sum(data[name].size for name in names)
    if numbers > MAX_DRAWN:
        raise UsageError(
            f"got {numbers:,} numbers to draw, expected at most {MAX_DRAWN:,}; take a shorter axis or fewer models"
        )
    return data.assign({name: data[name].compute() for name in names})


def x_axis(dataset: xr.Dataset, x: str | None) -> str:
    """Find the coordinate to draw over: `x`, else e, else the first axis of numbers."""
    lines = [
        str(name)
        for name, coord in dataset.coords.items()
        if coord.ndim == 1 and coord.dims != ("model",) and coord.dtype.kind in "fiu"
    ]
    if x is not None and x in lines:
        return x
    if x is not None:
        if x in dataset.coords and dataset[x].ndim > 1:
            dims = ", ".join(map(str, dataset[x].dims))
            raise UsageError(f"cannot draw over {x}, which varies over {dims}; select one with {argument('sel')}")
        raise UsageError(f'cannot draw over "{x}"; {did_you_mean(x, lines)}')
    # prefer floats: an integer axis only numbers the points; axes come before parameters of single laws
    floats = [name for name in lines if dataset[name].dtype.kind == "f"]
    preferred = [name for name in ("e", *map(str, dataset.sizes)) if name in floats]
    if lines:
        return (preferred or floats or lines)[0]
    raise UsageError(
        "this result has no numeric axis left to draw over; sweep one, such as e, or draw a point with "
        f"{argument('kind', 'loop')}"
    )


def conditions_of(dataset: xr.Dataset, *drawn: str) -> str:
    """Write the values of all inputs that are not drawn, without the parameters of laws."""
    inputs = {name: quantity for name, quantity in scalars_of(dataset).items() if name not in drawn}
    chosen = [name for name in UNSAID if name in inputs and "chosen" in dataset.variables[name].attrs]
    return described_inputs(inputs, exponents_of(dataset), chosen)


def scalars_of(dataset: xr.Dataset, start: str = "") -> dict[str, tuple[object, str]]:
    """Find the inputs that have one value, and a name that begins with `start`; each with its unit."""
    # of a variable alone: to make an array finds its coordinates among all others, a thousand times for a report
    names = (name for name in dataset.coords if str(name).startswith(start) and is_input(name))
    variables = {str(name): dataset.variables[name] for name in names}
    return {name: (each.values.item(), unit_of(each)) for name, each in variables.items() if each.ndim == 0}


def described_inputs(inputs: Inputs, exponent: str | None = None, chosen: Collection[str] = ()) -> str:
    """Write inputs with their units; `exponent` is the text for n if the laws shown fix their exponent.

    Unknown values and those of `UNSAID` are left out, but for inputs of `chosen`; inputs of one quantity stand
    before their common value.

    >>> inputs = {"m1": (2e-4, "kg"), "m2": (2e-4, "kg"), "e": (0.5, "1"), "R2": (math.inf, "m")}
    >>> described_inputs(inputs).replace(NO_BREAK, " ")
    'm1 = m2 = 0.2 g, e = 0.5, R2 = ∞'
    """
    names: dict[tuple[str, str], list[str]] = {}
    n, _ = inputs.get("n", (None, ""))
    for name, (value, unit) in inputs.items():
        is_said = value == value and (name in chosen or value != UNSAID.get(name))
        if is_said and InputName.parse(name).table in ("sweep", "materials"):
            unit = with_numbers(unit, {"n": n}) if isinstance(n, float) else unit
            text = "∞" if value == math.inf else prefixed(value, unit, 6)
            if name == "n" and exponent:
                text = exponent
            # numbers without a unit are of different quantities
            alone = name if unit == "1" and isinstance(value, float) else ""
            names.setdefault((text, alone), []).append(name)
    parts = (" = ".join([*sorted(together), text]) for (text, _), together in names.items())
    return ", ".join(safe_text(part, 60).replace(" ", NO_BREAK) for part in parts)


def parameter_text(key: str, inputs: Inputs) -> str:
    """Write the parameters of a law among some inputs, for its name; a unit of unknown exponents is left out.

    >>> inputs = {"bilinear.K": (1e9, "N/m^n"), "bilinear.C": (2e-3, "N s^p/m^n"), "n": (1.5, "1")}
    >>> parameter_text("bilinear", inputs).replace(NO_BREAK, " ")
    'K = 1 GN/m^1.5, C = 0.002'
    """
    own = {name.removeprefix(f"{key}."): each for name, each in inputs.items() if name.startswith(f"{key}.")}
    known = {name: each for name, each in inputs.items() if name == "n"} | own
    numbers = {name: value for name, (value, _) in known.items() if isinstance(value, float)}
    parts = []
    for name, (value, unit) in own.items():
        unit = with_numbers(unit, numbers) if names_in(unit) <= numbers.keys() else "1"
        parts.append(safe_text(f"{name} = {prefixed(value, unit, 6)}", 60).replace(" ", NO_BREAK))
    return ", ".join(parts)
