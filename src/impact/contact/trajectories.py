"""Trajectories: what a law does with impacts in the contact's own units, each kind of impact integrated once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from . import motion
from .deduplicate import deduplicate
from .formula import explained, wishes
from .model import ForceModel
from .momentum import is_strong
from .power import Array, distinct
from .status import LIMIT, OK, Status
from .strike import Places, Rebound, Struck, places, strike
from .values import Values, chi_of, exact_restitution, with_coefficients, with_units

Given = Mapping[str, Array]


def integrate_all(
    model: ForceModel,
    n: Array,
    given: Given,
    status: NDArray[np.int8],
    *,
    rtol: float,
    max_steps: int,
    collapse: bool = True,
    core: str = "numpy",
    errors: dict[str, str] | None = None,
) -> Rebound:
    """Integrate impacts by the law of a model.

    Parameters
    ----------
    model : the law
    n : their compliance exponents, shape (k,)
    given : what the law asks for, by name, in the contact's own units, each of shape (k,)
    status : what is known of them before; those that are not OK are left alone
    rtol, max_steps, collapse, core, errors : see `impact.contact.collide.collide`

    Returns
    -------
    Rebound : arrays of shape (k,); an impact that fails has a status, and disturbs no other
    """
    parts: list[tuple[Places, Rebound]] = []
    strike_at = partial(strike, rtol=rtol, max_steps=max_steps, core=core)
    with np.errstate(all="ignore"):
        for one in distinct(n):
            chosen = (status == OK) & (n == one)
            count, where = int(np.count_nonzero(chosen)), places(chosen)
            if count:
                found = {} if errors is None else errors
                own = _halving(model, float(one), _at(given, where), count, strike_at, collapse, found)
                parts.append((where, own))
    return Rebound.joined(n.size, status, parts)


def _at(given: Given, where: Places) -> Given:
    return {name: values[where] for name, values in given.items()}


def _halving(
    model: ForceModel,
    n: float,
    given: Given,
    count: int,
    strike_at: Callable[..., Struck],
    collapse: bool,
    errors: dict[str, str],
) -> Rebound:
    """What impacts that share n do.

    A law that raises is tried again on the two halves, so that only the impacts that make it raise fail. A single
    impact is tried beside its double: a result of the wrong shape, or an `if`, does not show at one.
    """
    try:
        if count == 1:
            double = _at(given, np.array([0, 0]))
            return _struck(model, n, double, 2, strike_at, collapse=False).take(np.array([0]))
        return _struck(model, n, given, count, strike_at, collapse)
    except ModelError as error:
        rebound = Rebound.blank(count)
        if count == 1:
            rebound.status[:] = Status.MODEL_ERROR
            errors.setdefault(*explained(model.key, error))
            return rebound
        for half in np.array_split(np.arange(count), 2):
            part = _halving(model, n, _at(given, half), half.size, strike_at, collapse, errors)
            rebound.put(half, part)
        return rebound


def _struck(
    model: ForceModel, n: float, given: Given, count: int, strike_at: Callable[..., Struck], collapse: bool
) -> Rebound:
    values = with_coefficients(model, with_units(given, n), count)
    status = _second_look(model, values, given, count)
    exact = exact_restitution(model, values, count)
    chi = chi_of(values, count)
    strong = is_strong(model, values, count)
    parts: list[tuple[Places, Rebound]] = []
    for side in (False, True):
        chosen = (status == OK) & (strong if side else ~strong)
        if not chosen.any():
            continue
        where = places(chosen)
        law = motion.Law.of(model, n, side)
        columns = tuple(np.asarray(values[name])[where] for name in law.names)
        count_chosen = int(np.count_nonzero(chosen))
        first, back = deduplicate(columns, (count_chosen,)) if collapse else (slice(None), slice(None))
        sticks = exact[where][first] == 0.0
        struck = strike_at(law, tuple(c[first] for c in columns), sticks.size, sticks=sticks)
        parts.append((where, struck.rebound.take(back)))
    rebound = replace(Rebound.joined(count, status, parts), chi=chi, exact=exact)
    held = status == LIMIT
    if held.any():
        for known in (rebound.e_out, rebound.peak, rebound.permanent):
            known[held] = 0.0
    return rebound


def _second_look(model: ForceModel, values: Values, given: Given, count: int) -> NDArray[np.int8]:
    """What can be said of impacts once their coefficients are known, before they are integrated."""
    status = np.full(count, Status.OK, np.int8)
    coefficients = {name: np.asarray(values[name]) for name in model.coefficients}
    if all(np.isfinite(one).all() for one in coefficients.values()):
        return status
    plastic = given.get("e", np.full(count, np.nan)) == 0.0
    for one in coefficients.values():
        status[np.isinf(one) & ~plastic] = Status.OUT_OF_RANGE
    for one in coefficients.values():
        status[np.isnan(one)] = Status.INVALID_PARAMETER
    # an infinite damping lets the balls neither in nor out: the force and the time have no finite limit
    for name in coefficients.keys() & wishes(model.force):
        status[np.isinf(coefficients[name]) & plastic] = Status.LIMIT
    return status
