"""The kernel that numba compiles: the loops of `impact.ode.rk45` over trajectories, for the forms of `dispatch`.

Trajectories advance in groups of LANES, each lane with its own step; a group is refilled when all of its lanes
have ended. Several groups are advanced in turn, so that the processor can work on one while it waits for another.
All loops over the lanes of a group have a fixed length and no branch, so that they become vector instructions, and
a lane has the same bits in any group. Rare operations, such as the location of an event, have their own loop. A
row of the workspace holds one number of every lane. Numba infers the types.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...ode.events import at_event, before_event, event_offset, is_event_ahead, linear_offset, trapezoid
from ...ode.maximum import FLAT_SLOPE, SECANT_STEPS, SLOPE_STEP, begins_to_fall, secant_update
from ...ode.problem import Termination
from ...ode.rk45 import MAX_HALVINGS, MIN_STEP, next_step
from .compile_cache import compiled
from .dispatch import END_AT_PEAK, Form
from .expressions import event, force, is_unreachable, rates, rk_step, slope_of_force
from .simd_math import OPTIONS, inlined

# lanes of a group, and groups advanced in turn
LANES, GROUPS = 32, 2
# where the rows of the workspace begin: the state, its rates and the watched quantity, the next step, the last one
(
    S, Y, TIME, WORK, RATE_S, RATE_Y, WATCHED, H, H_LAST,
    # the same before the last trial step
    S_0, Y_0, TIME_0, WORK_0, RATE_S_0, RATE_Y_0, WATCHED_0, H_0, H_LAST_0,
    # the coefficient of the form, the bound of overdamped balls; the local error, and whether `finish_steps` has
    # to process the lane
    STRENGTH, BOUND, LOCAL_ERROR, MARKED,
    # the largest watched value at a step's end, its components, and the adjacent steps
    LARGEST_WATCHED, PEAK_S, PEAK_Y, STEP_BEHIND, STEP_AHEAD,
    STEPS, HALVINGS, ENDED,
) = range(0, 30 * LANES, LANES)  # fmt: skip

# numbers of the workspace
RUNNING, EVENT_REACHED, EVENT_UNREACHABLE, TOO_MANY_STEPS, STEP_UNDERFLOW, NOT_FINITE = map(float, Termination)

# numba's cache checks this file alone; this number, a constant of the kernel, represents the other source files
_FOLDERS = (Path(__file__).parents[2] / folder for folder in ("ode", "contact", "contact/numba"))
_SOURCES = sorted(path for folder in _FOLDERS for path in folder.glob("*.py"))
SOURCE_CRC = zlib.crc32(b"".join(path.read_bytes() for path in _SOURCES))


@inlined
def state_at(w, row, j):
    """s, y, their rates and the watched quantity of lane j: with row S the current ones, with S_0 those before."""
    row = row + j
    return w[row], w[row + Y], w[row + RATE_S], w[row + RATE_Y], w[row + WATCHED]


@inlined
def advance(form, w, rtol):
    """Try a step in every lane of a group. Returns the number of lanes that `finish_steps` has to process."""
    marks = 0
    for j in range(LANES):
        s, y, rate_s, rate_y, watched = state_at(w, S, j)
        t, work, h, h_last = w[TIME + j], w[WORK + j], w[H + j], w[H_LAST + j]
        strength = w[STRENGTH + j]
        end_s, end_y, more_t, more_work, end_rate_s, end_rate_y, end_watched, error = rk_step(
            form, s, y, rate_s, rate_y, watched, h, strength
        )
        running = w[ENDED + j] == RUNNING
        accepted, finite = running and error <= rtol, error < np.inf
        h_next = next_step(h, error, rtol) if finite else 0.5 * h

        gap, rate_of_gap = event(form, end_s, end_y, end_rate_s, end_rate_y, end_watched, strength)
        marked = not finite or is_event_ahead(gap, rate_of_gap, h_next) or h_next < MIN_STEP
        marked = marked or is_unreachable(form, end_s, end_rate_s, w[BOUND + j])
        if form.ending == END_AT_PEAK:
            marked = marked or begins_to_fall(watched, end_watched, w[LARGEST_WATCHED + j])
        marked = running and marked
        marks += 1 if marked else 0
        w[MARKED + j], w[LOCAL_ERROR + j] = 1.0 if marked else 0.0, error

        w[S_0 + j], w[Y_0 + j], w[TIME_0 + j], w[WORK_0 + j] = s, y, t, work
        w[RATE_S_0 + j], w[RATE_Y_0 + j], w[WATCHED_0 + j] = rate_s, rate_y, watched
        w[H_0 + j], w[H_LAST_0 + j] = h, h_last
        w[S + j], w[Y + j] = end_s if accepted else s, end_y if accepted else y
        w[TIME + j] = t + more_t if accepted else t
        w[WORK + j] = work + more_work if accepted else work
        w[RATE_S + j] = end_rate_s if accepted else rate_s
        w[RATE_Y + j] = end_rate_y if accepted else rate_y
        w[WATCHED + j] = end_watched if accepted else watched
        w[H_LAST + j], w[H + j] = h if accepted else h_last, h_next
        w[STEPS + j] += 1.0 if accepted else 0.0
    return marks


@inlined
def step_to_event(form, s, y, rate_s, rate_y, offset, strength):
    """The state at the event, by a step of order two over an offset and a linear one.

    Returns s, y, the increments of time and work, and the offset of the linear step.
    """
    _, _, rate_t, rate_work = rates(form, s, y, strength)
    rate_s_1, rate_y_1, rate_t_1, rate_work_1 = rates(form, s + offset * rate_s, y + offset * rate_y, strength)
    s, y = s + trapezoid(offset, rate_s, rate_s_1), y + trapezoid(offset, rate_y, rate_y_1)
    more_t, more_work = trapezoid(offset, rate_t, rate_t_1), trapezoid(offset, rate_work, rate_work_1)
    rate_s, rate_y, rate_t, rate_work = rates(form, s, y, strength)
    watched = force(form, s, y, rate_s, strength)
    gap, rate_of_gap = event(form, s, y, rate_s, rate_y, watched, strength)
    remaining = linear_offset(gap, rate_of_gap)
    s, y = s + remaining * rate_s, y + remaining * rate_y
    return s, y, more_t + remaining * rate_t, more_work + remaining * rate_work, remaining


@inlined
def locate_event(form, start, end, h, h_next, strength, accepted):
    """As `impact.ode.events.locate_event`, for the step of a lane between two states, see `state_at`.

    Returns whether the event is located, whether the step crossed it, s and y at the event, the increments of time
    and work up to it, and the length of the next step.
    """
    gap_before, rate_before = event(form, start[0], start[1], start[2], start[3], start[4], strength)
    gap, rate_of_gap = event(form, end[0], end[1], end[2], end[3], end[4], strength)
    ahead = accepted and is_event_ahead(gap, rate_of_gap, h_next)
    offset, sure = event_offset(gap, rate_of_gap, gap_before, rate_before, h)
    near, shorter = before_event(offset, sure, h, h_next)
    near = ahead and near
    s, y, more_t, more_work, remaining = step_to_event(
        form, end[0], end[1], end[2], end[3], offset if near else 0.0, strength
    )
    located, crossed, shorter = at_event(near, remaining, gap, offset, h, shorter)
    return located, ahead and crossed, s, y, more_t, more_work, shorter if ahead else h_next


@inlined
def update_peak(w, j, falls, highest, start, end, s, y):
    """Update the peak where the watched quantity begins to fall, or is highest where the lane ends."""
    h, h_last = w[H_0 + j], w[H_LAST_0 + j]
    best, peak_s, peak_y = w[LARGEST_WATCHED + j], w[PEAK_S + j], w[PEAK_Y + j]
    behind, ahead = w[STEP_BEHIND + j], w[STEP_AHEAD + j]
    w[LARGEST_WATCHED + j] = end[4] if highest else start[4] if falls else best
    w[PEAK_S + j] = s if highest else start[0] if falls else peak_s
    w[PEAK_Y + j] = y if highest else start[1] if falls else peak_y
    w[STEP_BEHIND + j] = h if highest else h_last if falls else behind
    w[STEP_AHEAD + j] = 0.0 if highest else h if falls else ahead


@inlined
def finish_steps(form, w, rtol, is_last):
    """End trajectories, shorten steps before an event, update peaks. Returns the number of running lanes."""
    still_running = 0
    for j in range(LANES):
        # everything is read first, also what is not used below, so that the loop has no branch
        start, end = state_at(w, S_0, j), state_at(w, S, j)
        t_0, work_0, h_last_0 = w[TIME_0 + j], w[WORK_0 + j], w[H_LAST_0 + j]
        t, work, h, h_last = w[TIME + j], w[WORK + j], w[H_0 + j], w[H_LAST + j]
        strength, bound, best = w[STRENGTH + j], w[BOUND + j], w[LARGEST_WATCHED + j]
        marked, error, ended = w[MARKED + j] != 0.0, w[LOCAL_ERROR + j], w[ENDED + j]
        halvings = w[HALVINGS + j] + (1.0 if marked and not error < np.inf else 0.0)
        ended = NOT_FINITE if halvings > MAX_HALVINGS else ended
        accepted = marked and error <= rtol
        located, crossed, s, y, more_t, more_work, h_next = locate_event(
            form, start, end, h, w[H + j], strength, accepted
        )
        accepted = accepted and not crossed
        ended = EVENT_REACHED if located else ended
        s, y = s if located else end[0], y if located else end[1]
        if form.ending == END_AT_PEAK:
            falls = accepted and begins_to_fall(start[4], end[4], best)
            highest = located and end[4] > (start[4] if falls else best)
            update_peak(w, j, falls, highest, start, end, s, y)

        unreachable = accepted and is_unreachable(form, s, end[2], bound)
        ended = EVENT_UNREACHABLE if unreachable and ended == RUNNING else ended
        ended = STEP_UNDERFLOW if ended == RUNNING and h_next < MIN_STEP else ended
        ended = TOO_MANY_STEPS if ended == RUNNING and is_last else ended
        still_running += 1 if ended == RUNNING else 0
        w[ENDED + j], w[HALVINGS + j], w[H + j] = ended, halvings, h_next
        w[S + j], w[Y + j] = start[0] if crossed else s, start[1] if crossed else y
        w[TIME + j] = t_0 if crossed else t + (more_t if located else 0.0)
        w[WORK + j] = work_0 if crossed else work + (more_work if located else 0.0)
        w[RATE_S + j] = start[2] if crossed else end[2]
        w[RATE_Y + j] = start[3] if crossed else end[3]
        w[WATCHED + j] = start[4] if crossed else end[4]
        w[H_LAST + j] = h_last_0 if crossed else h_last
        w[STEPS + j] -= 1.0 if crossed else 0.0
    return still_running


@inlined
def begin(form, w, first, count, start, strength, bound, first_step):
    """Fill a group with the trajectories from `first` on; the last one is repeated where too few are left."""
    for j in range(LANES):
        i = min(first + j, count - 1)
        s, y = start[0, i], start[1, i]
        rate_s, rate_y, _, _ = rates(form, s, y, strength[i])
        watched = force(form, s, y, rate_s, strength[i])
        w[S + j], w[Y + j], w[TIME + j], w[WORK + j] = s, y, 0.0, 0.0
        w[RATE_S + j], w[RATE_Y + j], w[WATCHED + j] = rate_s, rate_y, watched
        w[H + j], w[H_LAST + j] = first_step, 0.0
        w[STRENGTH + j], w[BOUND + j] = strength[i], bound[i]
        w[LARGEST_WATCHED + j], w[PEAK_S + j], w[PEAK_Y + j] = -np.inf, s, y
        w[STEP_BEHIND + j], w[STEP_AHEAD + j] = 0.0, 0.0
        w[STEPS + j], w[HALVINGS + j], w[ENDED + j] = 0.0, 0.0, RUNNING


@inlined
def refine_maximum(form, w):
    """Raise the largest watched values to the maxima near them; see `impact.ode.maximum.refine_maximum`."""
    # rows that are reused: the length of the search, the step of the difference quotient, a point, its slope
    span, small, right, slope_right = TIME, H_LAST, WORK, H_0
    unrefined = 0
    for j in range(LANES):
        s, y, strength = w[PEAK_S + j], w[PEAK_Y + j], w[STRENGTH + j]
        rate_s, rate_y, _, _ = rates(form, s, y, strength)
        watched = force(form, s, y, rate_s, strength)
        w[RATE_S + j], w[RATE_Y + j], w[WATCHED + j] = rate_s, rate_y, watched
        step = SLOPE_STEP * max(w[STEP_BEHIND + j], w[STEP_AHEAD + j])
        slope = slope_of_force(form, s, y, rate_s, rate_y, watched, step, strength)
        reach = w[STEP_AHEAD + j] if slope > 0.0 else -w[STEP_BEHIND + j]
        reach = reach if abs(slope * reach) > FLAT_SLOPE * abs(w[LARGEST_WATCHED + j]) else 0.0
        unrefined += 1 if reach != 0.0 else 0
        w[small + j], w[slope_right + j] = step, slope
        w[span + j], w[H + j], w[right + j] = reach, reach, 0.0
    for count in range(SECANT_STEPS + 1 if unrefined else 0):
        for j in range(LANES):
            s, y, strength = w[PEAK_S + j], w[PEAK_Y + j], w[STRENGTH + j]
            s, y, _, _, rate_s, rate_y, watched, _ = rk_step(
                form, s, y, w[RATE_S + j], w[RATE_Y + j], w[WATCHED + j], w[H + j], strength
            )
            slope = slope_of_force(form, s, y, rate_s, rate_y, watched, w[small + j], strength)
            reach, best = w[span + j], w[LARGEST_WATCHED + j]
            w[LARGEST_WATCHED + j] = watched if reach != 0.0 and watched > best else best
            fraction = 1.0 if count == 0 else w[H + j] / reach
            fraction_before, slope_before = w[right + j], w[slope_right + j]
            w[right + j], w[slope_right + j] = fraction, slope
            w[H + j] = secant_update(fraction_before, slope_before, fraction, slope) * reach


@inlined
def end_all(form, w, first, count, state, best, steps, end):
    """Write the results of the trajectories of a group."""
    for j in range(min(LANES, count - first)):
        i, reached = first + j, w[ENDED + j] == EVENT_REACHED
        for row in range(4):
            state[row, i] = w[S + row * LANES + j] if reached else np.nan
        steps[i], end[i] = int(w[STEPS + j]), int(w[ENDED + j])
    if form.ending == END_AT_PEAK:
        refine_maximum(form, w)
    for j in range(min(LANES, count - first)):
        best[first + j] = w[LARGEST_WATCHED + j] if w[ENDED + j] == EVENT_REACHED else np.nan


def _kernel(form: Form, version: int):
    """The integrator of a form; the form and the number of the source files are constants in it."""

    def integrate(start, strength, bound, first_step, rtol, max_steps, state, best, steps, end):
        count = start.shape[1] if version >= 0 else 0
        w = np.zeros((GROUPS, ENDED + LANES))
        # the first trajectory of each group, and the number of trial steps
        first, trials = np.arange(0, GROUPS * LANES, LANES), np.zeros(GROUPS, np.int64)
        for group in range(GROUPS):
            begin(form, w[group], first[group], count, start, strength, bound, first_step)
        next_trajectory, active = GROUPS * LANES, min(GROUPS, -(-count // LANES))
        while active:
            for group in range(GROUPS):
                if first[group] >= count:
                    continue
                rows = w[group]
                trials[group] += 1
                is_last = trials[group] >= max_steps
                if (advance(form, rows, rtol) or is_last) and not finish_steps(form, rows, rtol, is_last):
                    end_all(form, rows, first[group], count, state, best, steps, end)
                    first[group], trials[group] = next_trajectory, 0
                    next_trajectory += LANES
                    if first[group] < count:
                        begin(form, rows, first[group], count, start, strength, bound, first_step)
                    else:
                        active -= 1

    return compiled(integrate, nogil=True, **OPTIONS)


# by form; each is compiled at its first call
KERNELS: dict[Form, Callable[..., None]] = {}


def kernel(form: Form) -> Callable[..., None]:
    """The integrator of a form."""
    if form not in KERNELS:
        # threads that arrive at the same time all use the first one
        KERNELS.setdefault(form, _kernel(form, SOURCE_CRC))
    return KERNELS[form]
