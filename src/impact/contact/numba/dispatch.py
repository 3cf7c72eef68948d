"""Which phases of which laws the compiled core integrates, and the call of its kernel."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from typing import NamedTuple

import numpy as np

from ...array_types import Array
from ...ode import rk45
from ...ode.problem import Params, Problem, Solution
from .. import force_expressions, motion
from ..model import ForceModel
from ..powers import integer_power, power
from ..velocity_coordinates import ForceCoordinate, LogCoordinate, force_form

# the equations of motion: of A xⁿ, of xⁿ (1 + χ v) in v and in "log", of xⁿ + c x^q v in v and in "force"
EQ_SPRING, EQ_DAMPED, EQ_LOG, EQ_DRAGGED, EQ_FORCE = range(5)
# the end of a phase: the largest indentation, zero indentation, zero force
END_AT_PEAK, END_AT_GAP, END_AT_NO_FORCE = range(3)
# largest power of s in a form
MAX_WHOLE_POWER = 15


@cache
def is_installed() -> bool:
    """Whether numba is installed; it is not imported."""
    return find_spec("numba") is not None


class Form(NamedTuple):
    """A phase of a law in whole powers of s: x = sᵖ, xⁿ = s^spring, x^q = s^drag.

    `extra` is the power of s that the coordinate "force" adds to v, `bound_power` the one in the bound on the
    speed of overdamped balls.
    """

    equation: int
    ending: int
    coordinate_power: int
    spring: int
    drag: int = 0
    extra: int = 0
    bound_power: int = 0


def approach_form(law: motion.MotionLaw) -> Form | None:
    """The form of the approach, None if the compiled core cannot integrate it."""
    return None if law.model.breakpoints else _form_of_force(law, END_AT_PEAK)


def restitution_form(law: motion.MotionLaw) -> Form | None:
    """The form of the restitution phase, None if the compiled core cannot integrate it."""
    model = law.model
    ending = END_AT_NO_FORCE if model.release == "force" else END_AT_GAP
    if model.unloading is None:
        return None if model.breakpoints else _form_of_force(law, ending)
    if model.unloading in force_expressions.POWER_LAWS and not model.unloading_breakpoints:
        return _form_of_whole_powers(EQ_SPRING, ending, model.coordinate_power, model.coordinate_power * law.n)
    return None


def serves(model: ForceModel, n: float) -> tuple[bool, bool]:
    """Whether the compiled core integrates the approach, and the restitution phase, of a law."""
    laws = [motion.MotionLaw.of(model, n, strong) for strong in (False, True)]
    restitution_laws = [motion.restitution_law(law) for law in laws]
    return all(map(approach_form, laws)), all(map(restitution_form, restitution_laws))


def _form_of_force(law: motion.MotionLaw, ending: int) -> Form | None:
    model, p = law.model, law.model.coordinate_power
    if model.velocity_coordinate == "force":
        form = force_form(model, law.n)
        q = form.drag / p
        if ending == END_AT_GAP and law.n != 2.0 * q + 1.0:
            return None
        equation = EQ_FORCE if isinstance(law.coordinate, ForceCoordinate) else EQ_DRAGGED
        return _form_of_whole_powers(equation, ending, p, p * law.n, form.drag, form.spring, p * (q + 1.0))
    if model.velocity_coordinate == "log":
        return _form_of_whole_powers(
            EQ_LOG if isinstance(law.coordinate, LogCoordinate) else EQ_DAMPED, ending, p, p * law.n
        )
    return (
        _form_of_whole_powers(EQ_SPRING, ending, p, p * law.n) if model.force is force_expressions.spring else None
    )


def _form_of_whole_powers(equation: int, ending: int, *exponents: float) -> Form | None:
    if not all(float(exponent).is_integer() and 0.0 <= exponent <= MAX_WHOLE_POWER for exponent in exponents):
        return None
    return Form(equation, ending, *map(int, exponents))


def integrate_compiled(
    form: Form,
    law: motion.MotionLaw,
    problem: Problem,
    start: Array,
    params: Params,
    *,
    rtol: float,
    max_steps: int,
) -> Solution:
    """Integrate a phase as `impact.ode.rk45.integrate` does, without its record."""
    from .kernel import kernel

    n = start.shape[1]
    law_values = dict(zip(law.names, params, strict=False))
    bound = np.zeros(n)
    if form.equation != EQ_SPRING:
        strength = law_values["chi" if form.equation in (EQ_DAMPED, EQ_LOG) else "c"]
    elif law.model.unloading is not None and form.ending != END_AT_PEAK:
        # the factor of a power law is the same at every stretch
        stretch = power(integer_power(start[0], form.coordinate_power), law.n)
        strength = problem.rates(start, params)[4] / stretch
    else:
        strength = np.ones(n)
    if form.ending == END_AT_GAP and motion.may_be_overdamped(law.model):
        bound = motion.overdamped_speed(strength, law.n, form.drag / form.coordinate_power)
    solution = Solution.blank(n)
    rows = (np.ascontiguousarray(start), np.ascontiguousarray(strength), np.ascontiguousarray(bound))
    ends = (solution.state, solution.maximum, solution.steps, solution.termination)
    kernel(form)(*rows, rk45.first_step(problem, rtol), rtol, max_steps, *ends)
    return solution
