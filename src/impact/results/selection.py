"""Select parts of a result: models by key, points by values of axes; match the labels of two results."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..array_types import Mask
from ..config.files import to_plain_data, to_plain_value
from ..config.input_names import InputName
from ..config.quantities import Quantity
from ..config.tables import SWEEP_QUANTITIES
from ..contact.variables import LAW_DIMS, OUTPUTS
from ..errors import UsageError, did_you_mean, require_known
from ..formatting import argument, prefixed, safe_text
from .schema import numbered_unit

# relative tolerance by which a value from a user matches a computed label
SELECTION_RTOL = 1e-9
# relative tolerance of equal labels: powers and logarithms of ranges differ in their last bits between processors
LABEL_RTOL = 1e-12
NUMBER_DTYPE_KINDS = "fiu"
# values of an axis that a message lists
MAX_LISTED_VALUES = 8

Labels = NDArray[Any]
IndexArray = NDArray[np.intp]


LawDim = Literal["model", "friction"]


def as_keys(names: object, option: str) -> list[str]:
    """List one key or name or several, in a sequence of any library; none for None, never for an empty one."""
    plain, _ = to_plain_data(names)
    keys = [plain] if isinstance(plain, str) else list(plain or ())
    if names is not None and not keys:
        raise UsageError(f"{argument(option)}: got an empty list, expected one name or more")
    return keys


def chosen_laws(laws: object, dataset: xr.Dataset, dim: LawDim = "model") -> list[str]:
    """List the models or friction laws of a result that are named, each once; all if none is."""
    noun = "friction law" if dim == "friction" else dim
    wanted = as_keys(laws, f"{dim}s")
    keys = [str(key) for key in dataset[dim].values.ravel()] if dim in dataset.coords else []
    if wanted and not keys:
        raise UsageError(f'no {noun} "{wanted[0]}" in this result, which has none; sweep a config with {dim}s')
    require_known(wanted, keys, f"no {noun}", " in this result")
    return list(dict.fromkeys(wanted or keys))


def law_positions(laws: object, dataset: xr.Dataset, dim: LawDim = "model") -> list[int]:
    """Find the positions of the `chosen_laws`, in the order in which they are named."""
    keys = chosen_laws(None, dataset, dim)
    return [keys.index(key) for key in chosen_laws(laws, dataset, dim)]


def require_outputs(dataset: xr.Dataset, names: Iterable[str]) -> None:
    """Refuse a result that lacks some outputs, with what stores them."""
    missing = [name for name in names if name not in dataset]
    if missing:
        is_requested = any(OUTPUTS[name].on_request for name in missing)
        advice = (
            "list them in [output] variables" if is_requested else "sweep without [output] variables, or add them"
        )
        raise UsageError(f"this result has no {', '.join(missing)}; {advice}")


def select_laws(dataset: xr.Dataset, models: object = None, frictions: object = None) -> xr.Dataset:
    """Select the models and friction laws that are named; all if none is."""
    wanted: dict[LawDim, object] = {"model": models, "friction": frictions}
    for dim, laws in wanted.items():
        positions = law_positions(laws, dataset, dim) if as_keys(laws, f"{dim}s") else []
        # the law of a part of a result may be no dimension
        if positions and dim in dataset.dims:
            dataset = dataset.isel({dim: positions})
    return dataset


def select(dataset: xr.Dataset, sel: Mapping[str, object]) -> xr.Dataset:
    """Select at values of coordinates; an axis is dropped, unless several of its points have the value."""
    axes = [str(dim) for dim in dataset.sizes if dim not in LAW_DIMS]
    masks: dict[Hashable, Mask] = {}
    for name, value in sel.items():
        if name not in dataset.coords or len(dataset[name].dims) != 1 or dataset[name].dims == ("model",):
            raise UsageError(f'no axis "{name}" in this result; {did_you_mean(name, axes)}')
        (dim,) = dataset[name].dims
        values = dataset[name].values
        plain = to_plain_value(value)
        if not isinstance(plain, float | int | str):
            raise UsageError(f"{argument('sel', {name: plain})}: got no single value, expected one")
        number = in_si(dataset, name, plain)
        if values.dtype.kind in NUMBER_DTYPE_KINDS:
            same = np.isclose(values, _as_number(number), rtol=SELECTION_RTOL, atol=0.0)
        else:
            same = values.astype(str) == str(number)
        if dim in masks and same.any():
            same &= masks[dim]
        angle = SWEEP_QUANTITIES["angle"]
        if name == "angle" and not angle.allows(_as_number(number)):
            raise UsageError(f"{argument('sel', {name: plain})}: {angle.refusal(plain, _as_number(number))}")
        if not same.any():
            # where what varies with it is selected, that leaves some of its values
            at, left = ("there", masks[dim]) if dim in masks else ("in this result", slice(None))
            shown = safe_text(_nearest_values(dataset[name][left], number))
            raise UsageError(f"no {name} = {plain} {at}; {shown}")
        masks[dim] = same
    # a value of the axis itself selects the first of those that differ by rounding
    positions: dict[Hashable, int | IndexArray] = {
        dim: int(np.argmax(same)) if dim in sel or np.count_nonzero(same) == 1 else np.flatnonzero(same)
        for dim, same in masks.items()
    }
    return dataset.isel(positions)


def in_si(dataset: xr.Dataset, name: str, value: float | str) -> float | str:
    """Convert a text with a unit, such as "30 deg", to that of a coordinate, and a word to its number."""
    words = InputName.parse(name).words
    if value in words:
        return float(words.index(str(value)))
    if not isinstance(value, str):
        return value
    number = Quantity(numbered_unit(dataset, name), "").read_or_nan(value)
    return value if np.isnan(number) else number


def _nearest_values(coordinate: xr.DataArray, value: float | str) -> str:
    """List the values of an axis if they are few, the next ones to a number, or the first; angles in degrees."""
    name, values = coordinate.name, coordinate.values
    unit = "rad" if coordinate.attrs.get("units") == "rad" else "1"
    number = _as_number(value) if values.dtype.kind in NUMBER_DTYPE_KINDS else np.nan
    if np.isnan(number) or values.size <= MAX_LISTED_VALUES:
        shown = ", ".join(
            prefixed(InputName.parse(name).word(value), unit) for value in values[:MAX_LISTED_VALUES].tolist()
        )
        return f"{name} is {shown}{', ...' if values.size > MAX_LISTED_VALUES else ''}"
    distinct = np.unique(values)
    below = int(np.clip(np.searchsorted(distinct, number) - 1, 0, max(distinct.size - 2, 0)))
    nearest = distinct[below : below + 2]
    return f"the nearest are {' and '.join(prefixed(label, unit) for label in nearest.tolist())}"


def _as_number(value: float | str) -> float:
    try:
        return float(value)
    except ValueError:
        return np.nan


def match_labels(new: Sequence[Labels], baseline: Sequence[Labels]) -> tuple[IndexArray, IndexArray]:
    """Find the positions of equal labels of an axis in two results, in the order of the baseline."""
    pairs = list(zip(new, baseline, strict=True))
    numeric = (a for a, _ in pairs if a.dtype.kind in NUMBER_DTYPE_KINDS)
    if all(np.array_equal(a, b) for a, b in pairs) and any((a[1:] > a[:-1]).all() for a in numeric):
        # the usual case; sorting a long axis takes ten times its memory
        positions = np.arange(len(new[0]))
        return positions, positions
    for rounding in (LABEL_RTOL, 0.0):
        rows = np.stack([_number_labels(a, b, rounding) for a, b in zip(new, baseline, strict=True)], axis=1)
        # labels are unique on an axis: if rounding merges some, compare them exactly
        _, row = np.unique(rows, axis=0, return_inverse=True)
        new_rows, baseline_rows = row[: len(new[0])], row[len(new[0]) :]
        if len(np.unique(new_rows)) == len(new_rows) and len(np.unique(baseline_rows)) == len(baseline_rows):
            break
    else:
        raise UsageError("an axis has two points with the same labels; expected the result of a sweep")
    _, new_positions, baseline_positions = np.intersect1d(new_rows, baseline_rows, return_indices=True)
    order = np.argsort(baseline_positions, kind="stable")
    return new_positions[order], baseline_positions[order]


def _number_labels(new: Labels, baseline: Labels, rounding: float) -> IndexArray:
    """Number the labels of both results; equal labels have equal numbers."""
    numbers = new.dtype.kind in NUMBER_DTYPE_KINDS and baseline.dtype.kind in NUMBER_DTYPE_KINDS
    new, baseline = (labels.astype(float if numbers else str) for labels in (new, baseline))
    values, number = np.unique(np.concatenate([new, baseline]), return_inverse=True)
    if numbers:
        another = ~np.isclose(values[1:], values[:-1], rtol=rounding, atol=0.0)
        number = np.concatenate([[0], np.cumsum(another)])[number]
    return np.asarray(number, np.intp)
