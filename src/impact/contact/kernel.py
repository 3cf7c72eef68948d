"""The core compiled by numba: the pair, controller and landing of `impact.ode.rk45`, for the forms of `compiled`.

Lanes advance in units that begin together and make room together, each lane by its own step. Several units are
side by side, since a processor that waits for one can go on with the next. All loops over the lanes of a unit have
a fixed length and no branch, so that they become vector instructions, and a lane has the same bits in whatever
company; what is seldom, such as a landing, has a loop of its own. A row of the workspace is one number of every
lane. Numba finds the types.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..ode import event as landing
from ..ode import maximum, rk45
from ..ode.problem import End
from .compiled import STOP, Form
from .equations import attempt, beyond_end, event, force, is_lost, linear, rates, slope_of_force
from .vectors import bits, from_bits, inlined, kept_on_disk

# lanes of a unit, and units side by side
UNIT, UNITS = 32, 2
# rows of the workspace: the state, its rates and the watched quantity, the step and the one before
(
    S, Y, T, WORK, RATE_S, RATE_Y, WATCHED, H, LAST,
    # the same before the step
    S_0, Y_0, T_0, WORK_0, RATE_S_0, RATE_Y_0, WATCHED_0, H_0, LAST_0,
    # the coefficient of the form, the bound of those that creep; the error, and whether `settle` has to see it
    STRENGTH, BOUND, WORST, ODD,
    # the largest watched value at a step's end, where that was, and the steps beside it
    BEST, TOP_S, TOP_Y, BEHIND, AHEAD,
    STEPS, HALVED, ENDED,
) = range(30)  # fmt: skip
ROWS = 30

SAFETY, SMALLEST, LARGEST, GAIN = rk45.SAFETY, rk45.SMALLEST, rk45.LARGEST, rk45.GAIN
SAFETY_BITS = int(np.float64(SAFETY).view(np.int64))
LAST_STEP, HALVINGS = rk45.LAST_STEP, float(rk45.HALVINGS)
REST, LANDING, NEAR = landing.REST, landing.LANDING, landing.NEAR
SLOPE, FLAT, GUESSES = maximum.DIFFERENCE, maximum.FLAT, maximum.GUESSES
RUNNING, LANDED, LOST, MAX_STEPS = (float(end) for end in (End.RUNNING, End.LANDED, End.LOST, End.MAX_STEPS))
STEP_UNDERFLOW, NOT_FINITE = float(End.STEP_UNDERFLOW), float(End.NOT_FINITE)

# numba's cache looks at this file alone; that of a kernel is told by this number what else it was compiled from
_HOUSE = Path(__file__).parent.parent
_SOURCES = sorted((*(_HOUSE / "ode").glob("*.py"), *(_HOUSE / "contact").glob("*.py")))
VERSION = zlib.crc32(b"".join(one.read_bytes() for one in _SOURCES))


@inlined
def advance(form, w, rtol, rtol_bits):
    """Try one step in every lane of a unit; accept or shorten it. Returns how many lanes `settle` has to see."""
    more = 0
    for j in range(UNIT):
        s, y, h, strength = w[S * UNIT + j], w[Y * UNIT + j], w[H * UNIT + j], w[STRENGTH * UNIT + j]
        rate_s, rate_y, seen = w[RATE_S * UNIT + j], w[RATE_Y * UNIT + j], w[WATCHED * UNIT + j]
        t, work, last = w[T * UNIT + j], w[WORK * UNIT + j], w[LAST * UNIT + j]
        new_s, new_y, more_t, more_work, new_rate_s, new_rate_y, watched, worst = attempt(
            form, s, y, rate_s, rate_y, seen, h, strength
        )
        running = w[ENDED * UNIT + j] == RUNNING
        within, finite = running and worst <= rtol, worst < np.inf
        factor = from_bits(SAFETY_BITS + (rtol_bits >> 8) * GAIN - (bits(worst) >> 8) * GAIN)
        following = h * (max(min(factor, LARGEST), SMALLEST) if finite else 0.5)

        gap, rate_of_gap = event(form, new_s, new_y, new_rate_s, new_rate_y, watched, strength)
        odd = not finite or min(gap + following * rate_of_gap, gap) < 0.0 or following < LAST_STEP
        odd = odd or is_lost(form, new_s, new_rate_s, w[BOUND * UNIT + j])
        if form.ending == STOP:
            odd = odd or (watched < seen and seen > w[BEST * UNIT + j])
        odd = running and odd
        more += 1 if odd else 0
        w[ODD * UNIT + j], w[WORST * UNIT + j] = 1.0 if odd else 0.0, worst

        w[S_0 * UNIT + j], w[Y_0 * UNIT + j], w[T_0 * UNIT + j], w[WORK_0 * UNIT + j] = s, y, t, work
        w[RATE_S_0 * UNIT + j], w[RATE_Y_0 * UNIT + j], w[WATCHED_0 * UNIT + j] = rate_s, rate_y, seen
        w[H_0 * UNIT + j], w[LAST_0 * UNIT + j] = h, last
        w[S * UNIT + j], w[Y * UNIT + j] = new_s if within else s, new_y if within else y
        w[T * UNIT + j] = t + more_t if within else t
        w[WORK * UNIT + j] = work + more_work if within else work
        w[RATE_S * UNIT + j] = new_rate_s if within else rate_s
        w[RATE_Y * UNIT + j] = new_rate_y if within else rate_y
        w[WATCHED * UNIT + j] = watched if within else seen
        w[LAST * UNIT + j], w[H * UNIT + j] = h if within else last, following
        w[STEPS * UNIT + j] += 1.0 if within else 0.0
    return more


@inlined
def settle(form, w, rtol, is_last):
    """Land, shorten the step before the event, note the largest force, give up. Returns how many lanes go on."""
    going = 0
    for j in range(UNIT):
        odd, ended, strength = w[ODD * UNIT + j] != 0.0, w[ENDED * UNIT + j], w[STRENGTH * UNIT + j]
        s, y, h, last = w[S_0 * UNIT + j], w[Y_0 * UNIT + j], w[H_0 * UNIT + j], w[LAST_0 * UNIT + j]
        rate_s, rate_y, seen = w[RATE_S_0 * UNIT + j], w[RATE_Y_0 * UNIT + j], w[WATCHED_0 * UNIT + j]
        new_s, new_y, following = w[S * UNIT + j], w[Y * UNIT + j], w[H * UNIT + j]
        new_rate_s, new_rate_y, watched = w[RATE_S * UNIT + j], w[RATE_Y * UNIT + j], w[WATCHED * UNIT + j]
        _, _, rate_t, rate_work = rates(form, new_s, new_y, strength)
        within, finite = odd and w[WORST * UNIT + j] <= rtol, w[WORST * UNIT + j] < np.inf
        halved = w[HALVED * UNIT + j] + (0.0 if finite or not odd else 1.0)
        ended = NOT_FINITE if halved > HALVINGS else ended

        gap, rate_of_gap = event(form, new_s, new_y, new_rate_s, new_rate_y, watched, strength)
        gap_0, rate_of_gap_0 = event(form, s, y, rate_s, rate_y, seen, strength)
        at = within and min(gap + following * rate_of_gap, gap) < 0.0
        beyond, sure = beyond_end(gap, rate_of_gap, gap_0, rate_of_gap_0, h)
        following = beyond if at and sure and beyond < following else following
        landed = at and abs(beyond) <= REST * h + NEAR
        rest = beyond if landed else 0.0
        there_s, there_y, there_t, there_work = rates(
            form, new_s + rest * new_rate_s, new_y + rest * new_rate_y, strength
        )
        end_s = new_s + 0.5 * rest * (new_rate_s + there_s)
        end_y = new_y + 0.5 * rest * (new_rate_y + there_y)
        end_rate_s, end_rate_y, end_t, end_work = rates(form, end_s, end_y, strength)
        pushed = force(form, end_s, end_y, end_rate_s, strength)
        end_gap, rate_of_end_gap = event(form, end_s, end_y, end_rate_s, end_rate_y, pushed, strength)
        more = linear(end_gap, rate_of_end_gap)
        landed = landed and abs(more) <= LANDING * h + NEAR
        crossed = at and gap < 0.0 and not landed
        onto = h + beyond
        back = onto if 0.0 < onto < h else 0.5 * h
        following = back if crossed else following
        within = within and not crossed
        ended = LANDED if landed else ended
        new_s = end_s + more * end_rate_s if landed else new_s
        new_y = end_y + more * end_rate_y if landed else new_y
        rest_t = 0.5 * rest * (rate_t + there_t) + more * end_t if landed else 0.0
        rest_work = 0.5 * rest * (rate_work + there_work) + more * end_work if landed else 0.0

        if form.ending == STOP:
            best = w[BEST * UNIT + j]
            falls = within and watched < seen and seen > best
            best = seen if falls else best
            highest = landed and watched > best
            w[BEST * UNIT + j] = watched if highest else best
            w[TOP_S * UNIT + j] = new_s if highest else s if falls else w[TOP_S * UNIT + j]
            w[TOP_Y * UNIT + j] = new_y if highest else y if falls else w[TOP_Y * UNIT + j]
            w[BEHIND * UNIT + j] = h if highest else last if falls else w[BEHIND * UNIT + j]
            w[AHEAD * UNIT + j] = 0.0 if highest else h if falls else w[AHEAD * UNIT + j]

        lost = within and is_lost(form, new_s, new_rate_s, w[BOUND * UNIT + j])
        ended = LOST if lost and ended == RUNNING else ended
        ended = STEP_UNDERFLOW if ended == RUNNING and following < LAST_STEP else ended
        ended = MAX_STEPS if ended == RUNNING and is_last else ended
        going += 1 if ended == RUNNING else 0
        w[ENDED * UNIT + j], w[HALVED * UNIT + j], w[H * UNIT + j] = ended, halved, following

        w[S * UNIT + j], w[Y * UNIT + j] = s if crossed else new_s, y if crossed else new_y
        w[T * UNIT + j] = w[T_0 * UNIT + j] if crossed else w[T * UNIT + j] + rest_t
        w[WORK * UNIT + j] = w[WORK_0 * UNIT + j] if crossed else w[WORK * UNIT + j] + rest_work
        w[RATE_S * UNIT + j] = rate_s if crossed else new_rate_s
        w[RATE_Y * UNIT + j] = rate_y if crossed else new_rate_y
        w[WATCHED * UNIT + j] = seen if crossed else watched
        w[LAST * UNIT + j] = last if crossed else w[LAST * UNIT + j]
        w[STEPS * UNIT + j] -= 1.0 if crossed else 0.0
    return going


@inlined
def begin(form, w, first, lanes, start, strength, bound, first_step):
    """Put the impacts from the first into a unit; where there are too few, the last one again."""
    for j in range(UNIT):
        i = min(first + j, lanes - 1)
        s, y = start[0, i], start[1, i]
        rate_s, rate_y, _, _ = rates(form, s, y, strength[i])
        watched = force(form, s, y, rate_s, strength[i])
        w[S * UNIT + j], w[Y * UNIT + j], w[T * UNIT + j], w[WORK * UNIT + j] = s, y, 0.0, 0.0
        w[RATE_S * UNIT + j], w[RATE_Y * UNIT + j], w[WATCHED * UNIT + j] = rate_s, rate_y, watched
        w[H * UNIT + j], w[LAST * UNIT + j] = first_step, 0.0
        w[STRENGTH * UNIT + j], w[BOUND * UNIT + j] = strength[i], bound[i]
        w[BEST * UNIT + j], w[TOP_S * UNIT + j], w[TOP_Y * UNIT + j] = -np.inf, s, y
        w[BEHIND * UNIT + j], w[AHEAD * UNIT + j] = 0.0, 0.0
        w[STEPS * UNIT + j], w[HALVED * UNIT + j], w[ENDED * UNIT + j] = 0.0, 0.0, RUNNING


@inlined
def search(form, w):
    """Raise the largest watched values to the maxima beside them; see `impact.ode.maximum.search`."""
    # rows of the same numbers by other names: the span of the search, the step of the difference, both ends
    span, small, right, slope_right = T, LAST, WORK, H_0
    some = 0
    for j in range(UNIT):
        s, y, strength = w[TOP_S * UNIT + j], w[TOP_Y * UNIT + j], w[STRENGTH * UNIT + j]
        rate_s, rate_y, _, _ = rates(form, s, y, strength)
        watched = force(form, s, y, rate_s, strength)
        w[RATE_S * UNIT + j], w[RATE_Y * UNIT + j], w[WATCHED * UNIT + j] = rate_s, rate_y, watched
        step = SLOPE * max(w[BEHIND * UNIT + j], w[AHEAD * UNIT + j])
        slope = slope_of_force(form, s, y, rate_s, rate_y, watched, step, strength)
        reach = w[AHEAD * UNIT + j] if slope > 0.0 else -w[BEHIND * UNIT + j]
        reach = reach if abs(slope * reach) > FLAT * abs(w[BEST * UNIT + j]) else 0.0
        some += 1 if reach != 0.0 else 0
        w[small * UNIT + j], w[slope_right * UNIT + j] = step, slope
        w[span * UNIT + j], w[H * UNIT + j], w[right * UNIT + j] = reach, reach, 0.0
    for count in range(GUESSES + 1 if some else 0):
        for j in range(UNIT):
            s, y, _, _, rate_s, rate_y, watched, _ = attempt(
                form, w[TOP_S * UNIT + j], w[TOP_Y * UNIT + j], w[RATE_S * UNIT + j], w[RATE_Y * UNIT + j],
                w[WATCHED * UNIT + j], w[H * UNIT + j], w[STRENGTH * UNIT + j],
            )  # fmt: skip
            slope = slope_of_force(
                form, s, y, rate_s, rate_y, watched, w[small * UNIT + j], w[STRENGTH * UNIT + j]
            )
            reach, found = w[span * UNIT + j], w[BEST * UNIT + j]
            w[BEST * UNIT + j] = watched if reach != 0.0 and watched > found else found
            here = 1.0 if count == 0 else w[H * UNIT + j] / reach
            before, slope_before = w[right * UNIT + j], w[slope_right * UNIT + j]
            w[right * UNIT + j], w[slope_right * UNIT + j] = here, slope
            guess = here - slope * (here - before) / (slope - slope_before)
            w[H * UNIT + j] = (guess if 0.0 <= guess <= 1.0 else here) * reach


@inlined
def end_all(form, w, first, lanes, state, best, steps, end):
    """Write down how the impacts of a unit have ended."""
    for j in range(min(UNIT, lanes - first)):
        i, landed = first + j, w[ENDED * UNIT + j] == LANDED
        for row in range(4):
            state[row, i] = w[(S + row) * UNIT + j] if landed else np.nan
        steps[i], end[i] = int(w[STEPS * UNIT + j]), int(w[ENDED * UNIT + j])
    if form.ending == STOP:
        search(form, w)
    for j in range(min(UNIT, lanes - first)):
        best[first + j] = w[BEST * UNIT + j] if w[ENDED * UNIT + j] == LANDED else np.nan


def _kernel(form: Form, version: int):
    """The integrator of a form, whose numbers are constants in it, and the number by which it is kept."""

    @kept_on_disk
    def integrate(start, strength, bound, first_step, rtol, rtol_bits, max_steps, state, best, steps, end):
        lanes = start.shape[1] if version >= 0 else 0
        w = np.zeros((UNITS, ROWS * UNIT))
        # the first impact of each unit, and how often a step of it was tried
        first, trials = np.arange(0, UNITS * UNIT, UNIT), np.zeros(UNITS, np.int64)
        for unit in range(UNITS):
            begin(form, w[unit], first[unit], lanes, start, strength, bound, first_step)
        waiting, living = UNITS * UNIT, min(UNITS, -(-lanes // UNIT))
        while living:
            for unit in range(UNITS):
                if first[unit] >= lanes:
                    continue
                mine = w[unit]
                trials[unit] += 1
                is_last = trials[unit] >= max_steps
                if (advance(form, mine, rtol, rtol_bits) or is_last) and not settle(form, mine, rtol, is_last):
                    end_all(form, mine, first[unit], lanes, state, best, steps, end)
                    first[unit], trials[unit] = waiting, 0
                    waiting += UNIT
                    if first[unit] < lanes:
                        begin(form, mine, first[unit], lanes, start, strength, bound, first_step)
                    else:
                        living -= 1

    return integrate


# each is compiled when it is first called
KERNELS: dict[Form, Callable[..., None]] = {}


def kernel(form: Form) -> Callable[..., None]:
    """The integrator of a form."""
    if form not in KERNELS:
        # threads that come at once all take the first one's
        KERNELS.setdefault(form, _kernel(form, VERSION))
    return KERNELS[form]
