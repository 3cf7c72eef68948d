"""Collide: from the impacts of a block to where each ball leaves, by one law."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from ..ode.problem import Columns
from . import motion
from .impulse import velocities_after
from .lanes import Lanes
from .model import ForceModel
from .power import Array
from .status import FIRST_FAILURE, Status
from .strike import Rebound, strike
from .values import chi_of, exact_restitution, own_values, takes_log


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
    rebound = Rebound.blank(len(lanes))
    with np.errstate(all="ignore"):
        rebound.status[:] = _first_look(model, lanes)
        for n in np.unique(lanes.n):
            where = np.flatnonzero((rebound.status == Status.OK) & (lanes.n == n))
            if where.size:
                rebound.put(where, _strike(model, lanes[where], float(n), rtol, max_steps, collapse))
        return _in_si(model, lanes, rebound)


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
    model: ForceModel, lanes: Lanes, n: float, rtol: float, max_steps: int, collapse: bool, halved: bool = False
) -> Rebound:
    """What impacts that share n do.

    A law that raises is tried again on the two halves, so that only the impacts that make it raise fail; one that
    is left alone is tried beside its double, since a result of the wrong shape does not show at one.
    """
    try:
        if halved and len(lanes) == 1:
            both = _struck(model, lanes[np.array([0, 0])], n, rtol, max_steps, collapse=False)
            return both.take(np.array([0]))
        return _struck(model, lanes, n, rtol, max_steps, collapse)
    except ModelError:
        rebound = Rebound.blank(len(lanes))
        if len(lanes) == 1:
            rebound.status[:] = Status.MODEL_ERROR
            return rebound
        for half in np.array_split(np.arange(len(lanes)), 2):
            rebound.put(half, _strike(model, lanes[half], n, rtol, max_steps, collapse, halved=True))
        return rebound


def _struck(model: ForceModel, lanes: Lanes, n: float, rtol: float, max_steps: int, collapse: bool) -> Rebound:
    values = own_values(model, lanes, n)
    rebound = Rebound.blank(len(lanes))
    coefficients = np.array([values[name] for name in model.coefficients]).reshape(-1, len(lanes))
    infinite = np.isinf(coefficients).any(axis=0)
    plastic = infinite & (lanes.e == 0.0)
    rebound.status[infinite & ~plastic] = Status.OUT_OF_RANGE
    rebound.status[np.isnan(coefficients).any(axis=0)] = Status.INVALID_PARAMETER
    if model.unloading is None:
        # an infinite damping lets the balls neither in nor out: the force and the time have no finite limit
        rebound.status[plastic] = Status.LIMIT
        for known in (rebound.e_out, rebound.peak, rebound.permanent):
            known[plastic] = 0.0

    chi = chi_of(values, len(lanes))
    log = takes_log(model, chi)
    for is_log in (False, True):
        where = np.flatnonzero((rebound.status == Status.OK) & (log == is_log))
        if not where.size:
            continue
        law = motion.Law.of(model, n, is_log)
        columns = tuple(np.asarray(values[name])[where] for name in law.names)
        first, back = _distinct(columns, where.size) if collapse else (np.arange(where.size),) * 2
        struck = strike(law, tuple(c[first] for c in columns), first.size, rtol, max_steps)
        rebound.put(where, struck.rebound.take(back))
    return replace(rebound, chi=chi, exact=exact_restitution(model, values, len(lanes)))


def _distinct(columns: Columns, n: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Places of one impact of each kind, and for every impact the number of its kind."""
    if not columns:
        return np.zeros(1, np.intp), np.zeros(n, np.intp)
    rows = columns[0] if len(columns) == 1 else np.array(columns).T
    _, first, back = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, back.reshape(-1)


def _in_si(model: ForceModel, lanes: Lanes, rebound: Rebound) -> Contact:
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
        value = rebound.chi if name == "chi" else lanes.quantity(name)
        # what is not known, such as an e that was not asked for, is not claimed
        inside[~((value >= low) & (value <= high))] = 0
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
        stiffness=np.where(failed, np.nan, lanes.K),
        damping_ratio=np.where(np.isfinite(rebound.chi), rebound.chi, np.nan),
        residual=np.where(failed, np.nan, rebound.work - (1.0 - rebound.e_out * rebound.e_out)),
        oracle_error=e_out - rebound.exact,
        status=rebound.status,
        in_domain=inside,
        steps=rebound.steps,
    )
