"""Collide: from the impacts of a block to where each ball leaves, by one law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ode.problem import Columns
from . import motion
from .impulse import velocities_after
from .lanes import Lanes
from .model import ForceModel, wishes
from .power import Array
from .status import FIRST_FAILURE, Status
from .strike import Rebound, strike


@dataclass(frozen=True)
class Contact:
    """The outputs of a struck block, in SI, under the names of the result file; arrays of shape (n,)."""

    v1_post: Array
    v2_post: Array
    v1_reference: Array
    v2_reference: Array
    v1_error: Array
    v2_error: Array
    e_out: Array
    e_error: Array
    peak_indentation: Array
    permanent_indentation: Array
    peak_force: Array
    duration: Array
    energy_loss: Array
    stiffness: Array
    damping_ratio: Array
    residual: Array
    oracle_error: Array
    status: NDArray[np.int8]
    in_domain: NDArray[np.int8]
    steps: NDArray[np.int32]


def collide(model: ForceModel, lanes: Lanes, *, rtol: float, max_steps: int, collapse: bool = True) -> Contact:
    """Let every pair of balls collide by the law of a model.

    Parameters
    ----------
    model : the law
    lanes : the impacts, n of them
    rtol : local error of a step of the integrator, relative
    max_steps : attempted steps per phase after which an impact is given up
    collapse : integrate impacts that are the same in the contact's own units once; changes no bit

    Returns
    -------
    Contact : arrays of shape (n,); an impact that fails has NaN and a status, and disturbs no other
    """
    rebound, chi, exact = Rebound.blank(len(lanes)), np.full(len(lanes), np.nan), np.full(len(lanes), np.nan)
    with np.errstate(all="ignore"):
        rebound.status[:] = _first_look(model, lanes)
        for n in np.unique(lanes.n):
            where = np.flatnonzero((rebound.status == Status.OK) & (lanes.n == n))
            if where.size:
                part, chi[where], exact[where] = _strike(model, lanes[where], float(n), rtol, max_steps, collapse)
                rebound.put(where, part)
        return _in_si(model, lanes, rebound, chi, exact)


def _first_look(model: ForceModel, lanes: Lanes) -> NDArray[np.int8]:
    """What can be said of an impact before it is integrated."""
    sizes = [lanes.m, lanes.K, lanes.length, lanes.m * lanes.v0 * lanes.v0, lanes.length / lanes.v0]
    in_range = np.all([np.isfinite(size) & (size > 0.0) for size in sizes], axis=0)
    driven = "e" in model.quantities
    valid_e = (lanes.e >= 0.0) & (lanes.e <= 1.0)
    status = np.where(in_range, Status.OK, Status.OUT_OF_RANGE)
    status = np.where(driven & ~valid_e, Status.INVALID_PARAMETER, status)
    return np.where(lanes.v0 > 0.0, status, Status.NO_IMPACT).astype(np.int8)


def _strike(
    model: ForceModel, lanes: Lanes, n: float, rtol: float, max_steps: int, collapse: bool
) -> tuple[Rebound, Array, Array]:
    """Rebound, damping ratio and exact restitution of impacts that share n.

    A law that raises is tried again on the two halves, so that only the impacts that make it raise fail.
    """
    try:
        return _struck(model, lanes, n, rtol, max_steps, collapse)
    except Exception:
        rebound, chi, exact = (
            Rebound.blank(len(lanes)),
            np.full(len(lanes), np.nan),
            np.full(len(lanes), np.nan),
        )
        if len(lanes) == 1:
            rebound.status[:] = Status.MODEL_ERROR
            return rebound, chi, exact
        for half in np.array_split(np.arange(len(lanes)), 2):
            part, chi[half], exact[half] = _strike(model, lanes[half], n, rtol, max_steps, collapse)
            rebound.put(half, part)
        return rebound, chi, exact


def _struck(
    model: ForceModel, lanes: Lanes, n: float, rtol: float, max_steps: int, collapse: bool
) -> tuple[Rebound, Array, Array]:
    values = own_values(model, lanes, n)
    full = {name: np.broadcast_to(np.asarray(value, float), len(lanes)) for name, value in values.items()}
    chi = full.get("chi", np.full(len(lanes), np.nan))
    exact = np.full(len(lanes), np.nan)
    if model.oracle is not None:
        exact[:] = model.oracle(*(values[wish] for wish in wishes(model.oracle)))

    rebound = Rebound.blank(len(lanes))
    coefficients = np.array([full[name] for name in model.coefficients]).reshape(-1, len(lanes))
    infinite = np.isinf(coefficients).any(axis=0)
    plastic = infinite & (lanes.e == 0.0)
    rebound.status[infinite & ~plastic] = Status.OUT_OF_RANGE
    rebound.status[np.isnan(coefficients).any(axis=0)] = Status.INVALID_PARAMETER
    if model.unloading is None:
        # an infinite damping lets the balls neither in nor out: the force and the time have no finite limit
        rebound.status[plastic] = Status.LIMIT
        for known in (rebound.e_out, rebound.peak, rebound.permanent):
            known[plastic] = 0.0

    log = takes_log(model, chi)
    for is_log in (False, True):
        where = np.flatnonzero((rebound.status == Status.OK) & (log == is_log))
        if not where.size:
            continue
        law = motion.Law.of(model, n, is_log)
        columns = tuple(full[name][where] for name in law.names)
        first, back = _distinct(columns, where.size) if collapse else (np.arange(where.size),) * 2
        struck = strike(law, tuple(c[first] for c in columns), first.size, rtol, max_steps)
        rebound.put(where, struck.rebound.take(back))
    return rebound, chi, exact


def takes_log(model: ForceModel, chi: Array) -> NDArray[np.bool_]:
    """Which impacts are integrated in the log coordinate: by their own damping ratio, never by their company."""
    return np.full(chi.shape, model.momentum == "log") & (chi > motion.LOG_ABOVE)


def own_values(model: ForceModel, lanes: Lanes, n: float) -> dict[str, Array | float]:
    """What the formulas of a law may ask for once per impact, in the contact's own units."""
    values = {name: lanes.own_units(model, name, n) for name in sorted({*model.quantities, "K", "m", "v0", "n"})}
    for name, formula in model.coefficients.items():
        values[name] = np.asarray(formula(*(values[wish] for wish in wishes(formula))), float) + 0.0
    return values


def _distinct(columns: Columns, n: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Places of one impact of each kind, and for every impact the number of its kind."""
    if not columns:
        return np.zeros(1, np.intp), np.zeros(n, np.intp)
    rows = columns[0] if len(columns) == 1 else np.array(columns).T
    _, first, back = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, back.reshape(-1)


def _in_si(model: ForceModel, lanes: Lanes, rebound: Rebound, chi: Array, exact: Array) -> Contact:
    """Back from the contact's own units, against the impulse-momentum solution."""
    failed = rebound.status >= FIRST_FAILURE
    missed = rebound.status == Status.NO_IMPACT
    e_out = np.where(failed | missed, np.nan, rebound.e_out)
    asked = np.where((lanes.e >= 0.0) & (lanes.e <= 1.0), lanes.e, np.nan)
    v1_post, v2_post = velocities_after(lanes, e_out)
    v1_reference, v2_reference = velocities_after(lanes, asked)
    energy = 0.5 * lanes.m * lanes.v0 * lanes.v0

    def si(value: Array, unit: Array) -> Array:
        return np.where(missed, 0.0, np.where(failed, np.nan, value * unit))

    inside = np.ones(len(lanes), np.int8)
    for name, (low, high) in model.domain.items():
        value = chi if name == "chi" else lanes.quantity(name)
        inside[(value < low) | (value > high)] = 0
    return Contact(
        v1_post=v1_post,
        v2_post=v2_post,
        v1_reference=v1_reference,
        v2_reference=v2_reference,
        v1_error=v1_post - v1_reference,
        v2_error=v2_post - v2_reference,
        e_out=e_out,
        e_error=e_out - asked,
        peak_indentation=si(rebound.peak, lanes.length),
        permanent_indentation=si(rebound.permanent, lanes.length),
        peak_force=si(rebound.force, 2.0 * energy / lanes.length),
        duration=si(rebound.duration, lanes.length / lanes.v0),
        energy_loss=si(1.0 - rebound.e_out * rebound.e_out, energy),
        stiffness=lanes.K,
        damping_ratio=np.where(np.isfinite(chi), chi, np.nan),
        residual=np.where(failed, np.nan, rebound.work - (1.0 - rebound.e_out * rebound.e_out)),
        oracle_error=e_out - exact,
        status=rebound.status,
        in_domain=inside,
        steps=rebound.steps,
    )
