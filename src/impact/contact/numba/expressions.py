"""The equations of motion of the forms, and a Runge-Kutta step of them, for a single trajectory.

Every function is compiled into its caller, for the constants of a form, and has no branch that depends on a value.
It shares formulas with the NumPy back end.
"""

from __future__ import annotations

from ...ode.events import at_event, before_event, event_offset, is_event_ahead, linear_offset, trapezoid
from ...ode.maximum import begins_to_fall, secant_update
from ...ode.rk45 import error_norm, next_step, step_factor
from ...ode.tableau import A as FRACTIONS, E as DIFFERENCES
from ..force_expressions import damped, dragged
from ..motion import ERROR_FLOOR, MAX_S, MIN_RELEASE_S, RELEASE_STEP, release_event
from ..velocity_coordinates import rate_of_force, rate_of_log, velocity_of_force
from .dispatch import END_AT_GAP, END_AT_NO_FORCE, END_AT_PEAK, EQ_DAMPED, EQ_DRAGGED, EQ_FORCE, EQ_LOG, EQ_SPRING
from .simd_math import exponential, inlined, share, whole_power

A = tuple(tuple(map(float, row)) for row in FRACTIONS)
E = tuple(map(float, DIFFERENCES))

for formula in (
    *(damped, dragged, rate_of_log, rate_of_force, velocity_of_force, release_event),
    *(step_factor, next_step, error_norm, begins_to_fall, secant_update),
    *(is_event_ahead, event_offset, before_event, at_event, linear_offset, trapezoid),
):
    share(formula)


@inlined
def solution(k1, k3, k4, k5, k6):
    """The weighted sum of the rates, of order five."""
    return A[6][0] * k1 + A[6][2] * k3 + A[6][3] * k4 + A[6][4] * k5 + A[6][5] * k6


@inlined
def difference(k1, k3, k4, k5, k6, k7):
    """The difference of the weighted sum of order five from that of order four."""
    return E[0] * k1 + E[2] * k3 + E[3] * k4 + E[4] * k5 + E[5] * k6 + E[6] * k7


@inlined
def rates(form, s, y, strength):
    """Rates of the two components and the two quadratures."""
    weight = form.coordinate_power * whole_power(s, form.coordinate_power - 1)
    # the weight times K δⁿ: a shorter chain of products than weight times force
    weighted = form.coordinate_power * whole_power(s, form.spring + form.coordinate_power - 1)
    if form.equation == EQ_FORCE:
        v = velocity_of_force(y, whole_power(s, form.extra), strength)
        force = strength * whole_power(s, form.drag) * y
        rate_y = rate_of_force(v, whole_power(s, form.extra - 1), form.extra / strength, weight, force)
        return v, rate_y, weight, weight * force * v
    if form.equation == EQ_LOG:
        # the quotient is the same in all stages, so that it is divided once
        v = (exponential(y) - 1.0) * (1.0 / strength)
        return v, rate_of_log(weighted, 1.0, strength), weight, damped(weighted, v, 1.0, strength) * v
    v = y
    if form.equation == EQ_SPRING:
        pushed = strength * weighted
    elif form.equation == EQ_DAMPED:
        pushed = damped(weighted, v, 1.0, strength)
    else:
        pushed = dragged(
            weighted, form.coordinate_power * whole_power(s, form.drag + form.coordinate_power - 1), v, strength
        )
    return v, -pushed, weight, pushed * v


@inlined
def force(form, s, y, v, strength):
    """The force."""
    elastic = whole_power(s, form.spring)
    if form.equation == EQ_FORCE:
        return strength * whole_power(s, form.drag) * y
    if form.equation == EQ_SPRING:
        return strength * elastic
    if form.equation == EQ_DRAGGED:
        return dragged(elastic, whole_power(s, form.drag), v, strength)
    return damped(elastic, v, 1.0, strength)


@inlined
def rk_step(form, s, y, s1, y1, watched, h, strength):
    """A step: components at its end, increments of the quadratures, rates and force there, the local error."""
    t1 = form.coordinate_power * whole_power(s, form.coordinate_power - 1)
    work1 = t1 * watched * s1
    s2, y2, _, _ = rates(form, s + (h * A[1][0]) * s1, y + (h * A[1][0]) * y1, strength)
    # the latest stage is added last and alone, since the next one depends on it
    s3, y3, t3, work3 = rates(
        form, s + h * (A[2][0] * s1) + (h * A[2][1]) * s2, y + h * (A[2][0] * y1) + (h * A[2][1]) * y2, strength
    )
    s4, y4, t4, work4 = rates(
        form,
        s + h * (A[3][0] * s1 + A[3][1] * s2) + (h * A[3][2]) * s3,
        y + h * (A[3][0] * y1 + A[3][1] * y2) + (h * A[3][2]) * y3,
        strength,
    )
    s5, y5, t5, work5 = rates(
        form,
        s + h * (A[4][0] * s1 + A[4][1] * s2 + A[4][2] * s3) + (h * A[4][3]) * s4,
        y + h * (A[4][0] * y1 + A[4][1] * y2 + A[4][2] * y3) + (h * A[4][3]) * y4,
        strength,
    )
    s6, y6, t6, work6 = rates(
        form,
        s + h * (A[5][0] * s1 + A[5][1] * s2 + A[5][2] * s3 + A[5][3] * s4) + (h * A[5][4]) * s5,
        y + h * (A[5][0] * y1 + A[5][1] * y2 + A[5][2] * y3 + A[5][3] * y4) + (h * A[5][4]) * y5,
        strength,
    )
    new_s = s + h * solution(s1, s3, s4, s5, s6)
    new_y = y + h * solution(y1, y3, y4, y5, y6)
    more_t, more_work = h * solution(t1, t3, t4, t5, t6), h * solution(work1, work3, work4, work5, work6)
    s7, y7, _, _ = rates(form, new_s, new_y, strength)
    watched = force(form, new_s, new_y, s7, strength)
    error_s, error_y = h * difference(s1, s3, s4, s5, s6, s7), h * difference(y1, y3, y4, y5, y6, y7)
    worst = error_norm(error_s, error_y, s, y, new_s, new_y, ERROR_FLOOR)
    return new_s, new_y, more_t, more_work, s7, y7, watched, worst


@inlined
def slope_of_force(form, s, y, rate_s, rate_y, current_force, small, strength):
    """The slope of the force along the trajectory, by a small step."""
    ahead_s, ahead_y = s + small * rate_s, y + small * rate_y
    v, _, _, _ = rates(form, ahead_s, ahead_y, strength)
    return (force(form, ahead_s, ahead_y, v, strength) - current_force) / small


@inlined
def event(form, s, y, rate_s, rate_y, watched, strength):
    """The event function, which falls to zero at the end of the phase, and its rate."""
    if form.ending == END_AT_GAP:
        return s, rate_s
    if form.ending == END_AT_NO_FORCE:
        small = RELEASE_STEP * min(max(abs(s), MIN_RELEASE_S), 1.0)
        slope = slope_of_force(form, s, y, rate_s, rate_y, watched, small, strength)
        return release_event(s, rate_s, watched, slope)
    if form.equation == EQ_FORCE:
        return rate_s, -form.coordinate_power * whole_power(s, form.coordinate_power - 1) * watched
    return y, rate_y


@inlined
def is_unreachable(form, s, rate_s, bound):
    """Whether the event can no longer be reached."""
    if form.ending == END_AT_PEAK:
        return s > MAX_S
    return -rate_s <= (bound * whole_power(s, form.bound_power) if form.equation >= EQ_DRAGGED else 0.0)
