"""Which model gives the restitution asked for, over all points of a result, and how wrong the others are."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..contact.status import FIRST_FAILURE, Status
from ..errors import UsageError
from ..text import safe_text
from .replay import own
from .schema import is_input
from .select import places_of, select

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Ranked:
    """How well one model gives the restitution asked for.

    Parameters
    ----------
    model : its key
    points : those judged, where an e was asked for and the balls meet
    within : those of them where |e_out - e| is within the tolerance
    failed : those of them that failed, which are not within it
    mean_error, max_error : of |e_out - e| over those that did not fail; NaN where all did
    at : the point with the largest error: what is swept, by config name, and e; empty where all failed
    e_out : the restitution delivered there
    served : the ranges of e, least and greatest, in which all points are within the tolerance; None where e does
        not vary along one axis
    """

    model: str
    points: int
    within: int
    failed: int
    mean_error: float
    max_error: float
    at: Mapping[str, float | str]
    e_out: float
    served: tuple[tuple[float, float], ...] | None

    @property
    def share(self) -> float:
        """The part of the points within the tolerance, from 0 to 1."""
        return self.within / self.points if self.points else 0.0

    @property
    def serves_everywhere(self) -> bool:
        return 0 < self.points == self.within

    @property
    def percent(self) -> str:
        """The share as text, which is 0 or 100 only where none or all are within the tolerance.

        >>> nan = math.nan
        >>> [Ranked("hertz", 3000, n, 0, nan, nan, {}, nan, None).percent for n in (0, 1, 2000, 2999, 3000)]
        ['0%', '<0.1%', '66.7%', '>99.9%', '100%']
        """
        if self.within == 0 or self.serves_everywhere:
            return f"{100.0 * self.share:.0f}%"
        if self.share < 0.001:
            return "<0.1%"
        return ">99.9%" if self.share > 0.999 else f"{100.0 * self.share:.1f}%"


@dataclass(frozen=True)
class Ranking:
    """The models of a result, the best first: by their share of points within the tolerance, then by their errors.

    Parameters
    ----------
    tol : the tolerance of |e_out - e|
    models : those judged, the best first; among equals in the order of the result
    """

    tol: float
    models: tuple[Ranked, ...]

    @property
    def best(self) -> tuple[Ranked, ...]:
        """The models that are within the tolerance at all points."""
        return tuple(one for one in self.models if one.serves_everywhere)

    @property
    def headline(self) -> str:
        """The answer in a sentence."""
        first = self.models[0]
        key, tol, points = safe_text(first.model, 60), f"{self.tol:g}", f"{first.points:,} points"
        alone = "the only point" if first.points == 1 else ""
        if self.best:
            others = len(self.best) - 1
            who = f"{key} and {others} more give" if others else f"{key} gives"
            return f"{who} e within {tol} at {alone or f'all {points}'}"
        if first.within:
            return f"no model gives e within {tol} everywhere; {key} is nearest: {first.percent} of {points}"
        return f"no model gives e within {tol} at {alone or f'any of {points}'}"


def ranking(
    dataset: xr.Dataset,
    tol: float = 0.01,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
) -> Ranking:
    """Rank the models of a result by how well they give the restitution asked for.

    Judged is |e_out - e| at all points where an e was asked for and the balls meet. A point that failed, or that
    no restitution can have (1 - alpha v0 below 0), is judged too: it is not within the tolerance.

    Parameters
    ----------
    dataset : a result
    tol : what |e_out - e| may be
    sel : values of axes, by name; all points of the others are judged
    models : keys of the models to rank; by default all

    Raises
    ------
    UsageError : the result has no errors of e to judge by, or has not got what is asked for; tol is not positive
    """
    _check(dataset, tol)
    chosen = places_of(models, dataset) if models else range(dataset.sizes["model"])
    # one model after another: what is computed of all together would take several times their memory
    held = select(dataset[["e_error", "status"]], sel or {})
    found = [_ranked(held.isel(model=place), tol) for place in chosen]
    if not any(one.points for one in found):
        raise UsageError("there is nothing to judge: at no point is an e asked for of balls that meet")
    return Ranking(tol, tuple(sorted(found, key=_order)))


def _check(dataset: xr.Dataset, tol: float) -> None:
    """Refuse what cannot be ranked."""
    if not 0.0 < tol < math.inf:
        raise UsageError(f"tol: got {tol:g}, wants a positive finite number")
    if "t" in dataset.dims:
        raise UsageError("this is a time history; models are ranked by the result of a sweep")
    if "model" not in dataset.dims:
        raise UsageError("model is no axis of this result; select models as a list, sel(model=[...])")
    missing = [name for name in ("e_error", "status") if name not in dataset]
    if missing:
        raise UsageError(f"this result has no {', '.join(missing)}; sweep without [output] variables, or add them")
    if "e" not in dataset.coords or np.isnan(dataset["e"].values).all():
        raise UsageError("this sweep asks for no e, by which models are ranked; give it e or alpha")
    dims = set(dataset["e_error"].dims)
    if "model" not in dims or dims != set(dataset["status"].dims) or not dims.issuperset(dataset["e"].dims):
        raise UsageError("e_error, status and e of this result do not lie along the axes of a sweep")


def _order(one: Ranked) -> tuple[float, ...]:
    # a model that failed everywhere has no errors
    return (-one.share, *(math.inf if math.isnan(error) else error for error in (one.max_error, one.mean_error)))


def _ranked(one: xr.Dataset, tol: float) -> Ranked:
    """How well a model does, from its e_error and status, of the shape of the axes, and the e asked for."""
    error = one.variables["e_error"]

    def laid_out(name: str) -> NDArray[Any]:
        return np.asarray(one.variables[name].set_dims(dict(error.sizes)).values)  # type: ignore[no-untyped-call]

    asked, status = laid_out("e"), laid_out("status")
    distance = np.abs(np.asarray(error.values, float))
    judged = ~np.isnan(asked) & (status != Status.NO_IMPACT)
    failed = judged & (status >= FIRST_FAILURE)
    known = judged & ~failed & ~np.isnan(distance)
    within = known & (distance <= tol)
    at: dict[str, float | str] = {}
    mean_error = max_error = e_out = math.nan
    if known.any():
        index = np.unravel_index(int(np.argmax(np.where(known, distance, -1.0))), distance.shape)
        mean_error, max_error = float(distance.mean(where=known)), float(distance[index])
        e = float(asked[index])
        e_out = e + float(error.values[index])
        at = {**_inputs(one, dict(zip(error.dims, index, strict=True))), "e": e}
    return Ranked(
        str(one["model"].item()), int(judged.sum()), int(within.sum()), int(failed.sum()), mean_error, max_error,
        at, e_out, _served(one.variables["e"], error.dims, judged, within),
    )  # fmt: skip


def _inputs(one: xr.Dataset, places: Mapping[Hashable, np.intp]) -> dict[str, float | str]:
    """What is swept, at a place along each axis, without the parameters of other models."""
    found = {
        str(name): one.variables[name].values[place].item()
        for dim, place in places.items()
        for name in (dim, *(name for name in one.coords if name != dim and is_input(str(name))))
        if one.variables[name].dims == (dim,)
    }
    found = own({"model": str(one["model"].item()), **found})
    del found["model"]
    return found


def _served(
    e: xr.Variable, dims: tuple[Hashable, ...], judged: Mask, within: Mask
) -> tuple[tuple[float, float], ...] | None:
    """The ranges of neighbouring values of e at which every judged point is within the tolerance."""
    if e.ndim != 1:
        return None
    others = tuple(place for place, dim in enumerate(dims) if dim not in e.dims)
    asked, missed = (np.logical_or.reduce(mask, axis=others) for mask in (judged, judged & ~within))
    # in order, each value once: that of alpha and of speeds that vary with it may come again
    values, place = np.unique(e.values[asked], return_inverse=True)
    served = np.bincount(place, missed[asked], values.size) == 0
    edges = np.diff(np.concatenate(([0], served, [0])))
    return tuple(zip(values[edges[:-1] == 1].tolist(), values[edges[1:] == -1].tolist(), strict=True))
