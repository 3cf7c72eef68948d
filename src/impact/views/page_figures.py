"""The figures of a page about a result: which there are, over what, and at which point."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

from ..contact.status import FIRST_FAILURE, NO_IMPACT
from ..errors import ImpactError
from ..results.schema import is_input
from ..results.select import places_of
from ..results.slabs import distinct, is_computed, slabs
from ..text import safe_text
from .kinds import Choice, Numbers, draw
from .look import METADATA, STYLE
from .markup import Markup, picture, tag
from .names import WIDTHS

if TYPE_CHECKING:
    import xarray as xr

# of more than MANY models the figures show the BEST
MANY, BEST = 12, 8
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


def figures_of(
    dataset: xr.Dataset, keys: list[str], figures: Callable[[str, Choice], Numbers]
) -> Iterator[Markup]:
    """The figures; of those that cannot be drawn, the reason."""
    if len(keys) > MANY:
        yield tag("p", f"The figures show {BEST} of the {len(keys)} models: {', '.join(keys[:BEST])}.")
        shown = keys[:BEST]
    else:
        shown = [str(key) for key in dataset["model"].values]
    drawn, reasons = [], []
    for kind, choice in _choices(dataset, shown):
        try:
            drawn.append(_figure(kind, figures(kind, choice), str(dataset.attrs.get("title", ""))))
        except ImpactError as error:
            reason = "; ".join(str(error).splitlines())
            reasons.append(tag("p", f"The figure {kind} is left out: {reason}"))
    yield tag("div", *drawn, class_="figures")
    yield from reasons


def _choices(dataset: xr.Dataset, keys: list[str]) -> Iterator[tuple[str, Choice]]:
    """The figures of a result: over e, else the first axis of several numbers; the loop is at the middle of it."""
    along = {name: dataset[name] for name in varying(dataset) if dataset[name].ndim == 1}
    along = {name: one for name, one in along.items() if one.dtype.kind == "f" and _different(one.values) > 1}
    x = "e" if "e" in along else next(iter(along), None)
    y = next((name for name in along if x and along[name].dims != along[x].dims), None)
    for kind in FIGURES:
        drawn = [along[name].dims[0] for name in ((x, y) if kind in PLANES else (x,)) if name]
        at = _answered(dataset, keys, drawn)
        if kind == "loop" and x:
            values, dim = along[x].values, str(drawn[0])
            at[dim] = dataset[dim].values[np.argsort(values, kind="stable")[values.size // 2]].item()
            # a parameter of one model is no input of the others
            at = {name: value for name, value in at.items() if "." not in name or len(keys) == 1}
        if y or kind not in PLANES:
            yield kind, Choice(None if kind == "loop" else x, y if kind in PLANES else None, sel=at, models=keys)


def _different(values: NDArray[Any]) -> int:
    return np.unique(values[np.isfinite(values)]).size


def _answered(dataset: xr.Dataset, keys: list[str], drawn: Sequence[Hashable]) -> dict[str, float | str]:
    """Values of the axes that are not drawn over: the first at which the balls meet and a model has an answer."""
    if "status" not in dataset:
        return {}
    axes = [dim for dim in dataset["status"].dims if dim not in ("model", *drawn)]
    first: tuple[int, ...] | None = None
    for place in places_of(keys, dataset):
        answered = _first_answered(dataset.isel(model=place), axes)
        first = min(filter(None, (first, answered)), default=None)
        if first is not None and not any(first):
            break
    places = first or (0,) * len(axes)
    return {str(dim): dataset[dim].values[at].item() for dim, at in zip(axes, places, strict=True)}


def _first_answered(of_model: xr.Dataset, axes: Sequence[Hashable]) -> tuple[int, ...] | None:
    """The first place along some axes at which a model has an answer for balls that meet; None where it has none.

    Where the status of more than MAX_SEARCHED points would have to be computed, those of a coarser grid are.
    """
    status, _ = distinct(of_model, "status")
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


def _figure(kind: str, numbers: Numbers, title: str) -> Markup:
    """A figure of the page, and what it shows in words, without the title of them all."""
    buffer = io.BytesIO()
    with matplotlib.rc_context(fname=str(STYLE)):
        # narrow, so that its text is legible on a phone; a wider page has two beside each other
        draw(numbers, WIDTHS["single"]).savefig(buffer, format="svg", metadata=METADATA["svg"])
    conditions = numbers.conditions.removeprefix(f"{safe_text(title, 140)}: ")
    told = [FIGURES[kind], *([f"At {conditions}."] if conditions else [])]
    told += [f"Not drawn: {'; '.join(numbers.not_drawn)}."] if numbers.not_drawn else []
    return tag("figure", picture(buffer.getvalue(), kind, FIGURES[kind]), tag("figcaption", " ".join(told)))


def varying(dataset: xr.Dataset) -> list[str]:
    """The inputs that vary: the axes, each with what varies along it, then what varies along several."""
    found = {str(name): one.dims for name, one in dataset.coords.items()
             if one.ndim and "model" not in one.dims and is_input(str(name))}  # fmt: skip
    along = [name for dim in dataset.dims for name in (str(dim), *found) if found.get(name) == (dim,)]
    return list(dict.fromkeys([*along, *found]))
