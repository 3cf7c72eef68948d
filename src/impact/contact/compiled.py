"""Which phases of which laws a compiled core integrates, and how they are handed to it."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from typing import NamedTuple

import numpy as np

from ..ode import rk45
from ..ode.problem import Array, Columns, Outcome, Problem
from . import forms, motion
from .creeping import creeping_speed, may_creep
from .model import ForceModel
from .momentum import Force, Log, force_form
from .power import integer_power, power
from .turns import aside

# the equations of motion: of A xⁿ, of xⁿ (1 + χ v) in v and in "log", of xⁿ + c x^q v in v and in "force"
SPRING, DAMPED, LOG, DRAGGED, FORCE = range(5)
# what ends a phase: the largest indentation, the gap, no force
STOP, GAP, NO_FORCE = range(3)
# largest power of s
MOST = 15


@cache
def is_installed() -> bool:
    """Whether numba is there, of which no more is loaded for that."""
    return find_spec("numba") is not None


class Form(NamedTuple):
    """A phase of a law in whole powers of s: x = sᵖ, xⁿ = s^spring, x^q = s^drag.

    `extra` is the power of s that the coordinate "force" has beside v, `creep` that which bounds the speed of
    balls that part with none.
    """

    equation: int
    ending: int
    smooth: int
    spring: int
    drag: int = 0
    extra: int = 0
    creep: int = 0


def of_approach(law: motion.Law) -> Form | None:
    """The form of the approach, None where it has none."""
    return None if law.model.bends else _of_force(law, STOP)


def of_restitution(law: motion.Law) -> Form | None:
    """The form of the restitution phase, None where it has none."""
    model = law.model
    ending = NO_FORCE if model.release == "force" else GAP
    if model.unloading is None:
        return None if model.bends else _of_force(law, ending)
    if model.unloading in forms.POWER_LAWS and not model.unloading_bends:
        return _whole(SPRING, ending, model.smooth, model.smooth * law.n)
    return None


def serves(model: ForceModel, n: float) -> tuple[bool, bool]:
    """Whether the compiled core integrates the approach, and the restitution phase, of a law."""
    laws = [motion.Law.of(model, n, strong) for strong in (False, True)]
    back = [motion.of_restitution(law) for law in laws]
    return all(map(of_approach, laws)), all(map(of_restitution, back))


def _of_force(law: motion.Law, ending: int) -> Form | None:
    model, p = law.model, law.model.smooth
    if model.momentum == "force":
        form = force_form(model, law.n)
        q = form.drag / p
        if ending == GAP and law.n != 2.0 * q + 1.0:
            return None
        equation = FORCE if isinstance(law.momentum, Force) else DRAGGED
        return _whole(equation, ending, p, p * law.n, form.drag, form.spring, p * (q + 1.0))
    if model.momentum == "log":
        return _whole(LOG if isinstance(law.momentum, Log) else DAMPED, ending, p, p * law.n)
    return _whole(SPRING, ending, p, p * law.n) if model.force is forms.spring else None


def _whole(equation: int, ending: int, *exponents: float) -> Form | None:
    if not all(float(one).is_integer() and 0.0 <= one <= MOST for one in exponents):
        return None
    return Form(equation, ending, *map(int, exponents))


def integrate(
    form: Form, law: motion.Law, problem: Problem, start: Array, columns: Columns, *, rtol: float, max_steps: int
) -> Outcome:
    """Integrate a phase as `impact.ode.rk45.integrate` does, without its record.

    Parameters
    ----------
    form : of the phase
    law, problem, columns : of the phase; columns each of shape (n,)
    start : components at the start, shape (2, n)
    rtol, max_steps : see there
    """
    from .kernel import kernel

    n = start.shape[1]
    known = dict(zip(law.names, columns, strict=False))
    bound = np.zeros(n)
    if form.equation != SPRING:
        strength = known["chi" if form.equation in (DAMPED, LOG) else "c"]
    elif law.model.unloading is not None and form.ending != STOP:
        # what a power law is times is the same at every stretch
        stretch = power(integer_power(start[0], form.smooth), law.n)
        strength = problem.rates(start, columns)[4] / stretch
    else:
        strength = np.ones(n)
    if form.ending == GAP and may_creep(law.model):
        bound = creeping_speed(strength, law.n, form.drag / form.smooth)
    outcome = Outcome.unwritten(n)
    rows = (np.ascontiguousarray(start), np.ascontiguousarray(strength), np.ascontiguousarray(bound))
    with aside():
        kernel(form)(
            *rows, rk45.first_step(problem, rtol), rtol, int(np.float64(rtol).view(np.int64)), max_steps,
            outcome.state, outcome.maximum, outcome.steps, outcome.end,
        )  # fmt: skip
    return outcome
