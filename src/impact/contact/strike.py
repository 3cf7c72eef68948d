"""Strike: impacts in the contact's own units through approach and restitution, by one law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..ode.problem import Columns, End, Outcome
from ..ode.rk45 import integrate
from ..ode.step import Space
from . import compiled, motion
from .creeping import may_creep, never_part
from .momentum import Momentum
from .phases import in_parts
from .power import Array
from .status import LIMIT, OK, Status

# the status of each end, by its number; no lane ends running
STATUS_OF_END = np.zeros(len(End), np.int8)
STATUS_OF_END[End.LANDED] = Status.OK
STATUS_OF_END[End.LOST] = Status.NOT_SEPARATED
STATUS_OF_END[End.MAX_STEPS] = Status.MAX_STEPS
STATUS_OF_END[End.STEP_UNDERFLOW] = Status.STEP_UNDERFLOW
STATUS_OF_END[End.NOT_FINITE] = Status.NOT_FINITE
LANDED, LOST, MAX_STEPS, STEP_UNDERFLOW = map(int, (End.LANDED, End.LOST, End.MAX_STEPS, End.STEP_UNDERFLOW))

# places of impacts; a slice where it is all of them, so that nothing is copied
Places = NDArray[np.intp] | slice


def places(chosen: NDArray[np.bool_]) -> Places:
    """The places of those that are chosen."""
    return slice(None) if chosen.all() else np.flatnonzero(chosen)


@dataclass(frozen=True)
class Rebound:
    """What a law does with impacts, in the contact's own units; arrays of shape (n,).

    `approach_work` and `restitution_work` are twice the works done against the force in the two phases, 1 and
    -e_out^2 up to the solver's error; `chi` is the law's damping ratio and `exact` its restitution in closed form,
    where it has them.
    """

    e_out: Array
    peak: Array
    permanent: Array
    force: Array
    contact_time: Array
    approach_work: Array
    restitution_work: Array
    steps: NDArray[np.int32]
    status: NDArray[np.int8]
    chi: Array
    exact: Array

    @classmethod
    def blank(cls, n: int) -> Rebound:
        """n impacts with nothing known of them."""
        return cls(
            e_out=np.full(n, np.nan),
            peak=np.full(n, np.nan),
            permanent=np.full(n, np.nan),
            force=np.full(n, np.nan),
            contact_time=np.full(n, np.nan),
            approach_work=np.full(n, np.nan),
            restitution_work=np.full(n, np.nan),
            steps=np.zeros(n, np.int32),
            status=np.full(n, Status.OK, np.int8),
            chi=np.full(n, np.nan),
            exact=np.full(n, np.nan),
        )

    def put(self, where: Places | NDArray[np.bool_], part: Rebound) -> None:
        """Write a part's arrays at their places."""
        for field in fields(self):
            getattr(self, field.name)[where] = getattr(part, field.name)

    @classmethod
    def joined(cls, n: int, status: NDArray[np.int8], parts: Sequence[tuple[Places, Rebound]]) -> Rebound:
        """n impacts, parts of them at their places; those that are in none have their status, and nothing else."""
        if parts and isinstance(parts[0][0], slice):
            return parts[0][1]
        rebound = cls.blank(n)
        rebound.status[:] = status
        for where, part in parts:
            rebound.put(where, part)
        return rebound

    def take(self, where: Places) -> Rebound:
        """The impacts at some places."""
        return Rebound(**{field.name: getattr(self, field.name)[where] for field in fields(self)})


@dataclass(frozen=True)
class Struck:
    """Impacts integrated through both phases: where they ended, and each phase's outcome.

    `columns` are those of the restitution phase, of the impacts that entered it.
    """

    rebound: Rebound
    inward: Outcome
    outward: Outcome | None
    columns: Columns


def strike(
    law: motion.Law,
    columns: Columns,
    n: int,
    rtol: float,
    max_steps: int,
    record: bool = False,
    sticks: NDArray[np.bool_] | bool = False,
    core: str = "numpy",
) -> Struck:
    """Integrate n impacts through approach and restitution.

    Parameters
    ----------
    law : the law at one exponent and in one coordinate of the velocity
    columns : its values per impact, each of shape (n,)
    rtol, max_steps, record : see `impact.ode.rk45.integrate`
    sticks : which are known to stay together, where they do not part
    core : "numba" integrates the phases that have a form for it compiled, unless they are recorded
    """
    run_form = partial(compiled.integrate, rtol=rtol, max_steps=max_steps)
    is_compiled = core == "numba" and not record
    back = motion.of_restitution(law)
    form = compiled.of_approach(law) if is_compiled else None
    form_back = compiled.of_restitution(back) if is_compiled else None
    space = None if form and form_back else Space.of(n)
    run = partial(integrate, rtol=rtol, max_steps=max_steps, record=record, space=space)
    start = motion.start_of_approach(law, columns, n)
    if form is not None:
        inward = run_form(form, law, motion.approach(law), start, columns)
    else:
        among, bends = motion.bends(law, columns, start)
        inward = in_parts(run, motion.approach(law), bends, start, among)
    peak = motion.indentation(law, inward.state[0])
    at_peak = motion.force_at_peak(law, inward.state[0], columns)
    residual, recovered, columns = motion.turn(law, columns, peak, at_peak)
    unknown = np.full(n, np.nan)
    rebound = Rebound(
        e_out=unknown.copy(), peak=peak, permanent=residual.copy(), force=np.maximum(inward.maximum, at_peak),
        contact_time=inward.state[2].copy(), approach_work=2.0 * inward.state[3], restitution_work=np.zeros(n),
        steps=inward.steps.copy(), status=_status(inward), chi=unknown, exact=unknown,
    )  # fmt: skip

    # nothing is given back where the balls stay at their peak
    stays = (rebound.status == OK) & (recovered <= 0.0)
    if stays.any():
        rebound.status[stays], rebound.e_out[stays] = LIMIT, 0.0

    parts = places(rebound.status == OK)
    columns = tuple(column[parts] for column in columns)
    if not recovered[parts].size:
        return Struck(rebound, inward, None, columns)
    start = motion.start_of_restitution(back, columns, recovered[parts])
    if form_back is not None:
        outward = run_form(form_back, back, motion.restitution(back), start, columns)
    else:
        among, bends = motion.bends(back, columns, start, residual[parts])
        outward = in_parts(run, motion.restitution(back), bends, start, among)
    _judge_unfinished(back, outward, columns, recovered[parts])
    e_out, work, status = -back.velocity(outward.state, columns), 2.0 * outward.state[3], _status(outward)
    # held, or parting with no speed in an infinite time: all the energy of such balls is lost
    held = outward.end == LOST
    if held.any():
        held &= may_creep(back.model) | np.broadcast_to(sticks, n)[parts]
        e_out[held], work[held], status[held] = 0.0, 0.0, LIMIT
    rebound.e_out[parts] = e_out
    rebound.contact_time[parts] += outward.state[2]
    rebound.restitution_work[parts] = work
    rebound.steps[parts] += outward.steps
    rebound.status[parts] = status
    if law.model.release == "force":
        rebound.permanent[parts] += motion.indentation(law, outward.state[0])
    return Struck(rebound, inward, outward, columns)


def _judge_unfinished(law: motion.Law, outward: Outcome, columns: Columns, recovered: Array) -> None:
    """Mark trajectories that never separate, unlike those that only take too many steps."""
    left = np.flatnonzero((outward.end == MAX_STEPS) | (outward.end == STEP_UNDERFLOW))
    if not left.size or law.model.release != "gap":
        return
    rates = motion.restitution(replace(law, momentum=Momentum())).rates
    never = never_part(rates, tuple(column[left] for column in columns), recovered[left], law.model.smooth)
    outward.end[left[never]] = LOST


def _status(outcome: Outcome) -> NDArray[np.int8]:
    if (outcome.end == LANDED).all():
        return np.full(outcome.end.size, OK, np.int8)
    return STATUS_OF_END.take(outcome.end)
