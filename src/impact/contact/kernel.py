"""The core compiled by numba: the pair, controller and landing of `impact.ode.rk45`, for the forms of `compiled`.

Lanes advance in lockstep, `LANES` at a time, each by its own step; some that have ended make room for others. All
loops over lanes have a fixed length and no branch, so that they become vector instructions, and a lane has the
same bits in whatever company. A row of the workspace is one number of every lane. Numba finds the types.
"""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
from numba.extending import overload

from ..ode import event as landing
from ..ode import maximum, rk45
from ..ode.lanes import FIRST_STEP
from ..ode.problem import End
from ..ode.tableau import A as FRACTIONS
from ..ode.tableau import E as DIFFERENCES
from . import forms, momentum, motion
from .compiled import FORCE, GAP, LOG, NO_FORCE, STOP, V
from .vectors import bits, exponential, from_bits, inlined, kept_on_disk, whole_power

LANES = 64
# so many lanes that have ended make room at a time
ENOUGH = 4
# rows of the workspace: the state, its rates and the watched quantity, the event and its rate
(
    S, Y, T, WORK, RATE_S, RATE_Y, WATCHED, G, RATE_G,
    # the step, the one before, the stiffness, the damping in its two forms, the bound of those that creep
    H, LAST, STIFF, CHI, DRAG, BOUND,
    # the largest watched value at a step's end, where that was, and the steps beside it
    BEST, TOP_S, TOP_Y, BEHIND, AHEAD,
    STEPS, TRIALS, HALVED, ENDED,
) = range(24)  # fmt: skip
ROWS = 24
# those that begin at zero
BLANK = (T, WORK, LAST, BEHIND, AHEAD, STEPS, TRIALS, HALVED, ENDED, BOUND)

A = tuple(tuple(map(float, row)) for row in FRACTIONS)
E = tuple(map(float, DIFFERENCES))
SAFETY, SMALLEST, LARGEST, FIFTH = rk45.SAFETY, rk45.SMALLEST, rk45.LARGEST, rk45.FIFTH
SAFETY_BITS = int(np.float64(SAFETY).view(np.int64))
LAST_STEP, HALVINGS = rk45.LAST_STEP, float(rk45.HALVINGS)
LANDING, NEAR, SHORT, CLOSE = landing.LANDING, landing.NEAR, landing.SHORT, landing.CLOSE
SLOPE, FLAT, GUESSES = maximum.DIFFERENCE, maximum.FLAT, maximum.GUESSES
FAR, FLOOR, DIFFERENCE = motion.FAR, motion.FLOOR, motion.DIFFERENCE
RUNNING, LANDED, LOST, MAX_STEPS = (float(end) for end in (End.RUNNING, End.LANDED, End.LOST, End.MAX_STEPS))
STEP_UNDERFLOW, NOT_FINITE = float(End.STEP_UNDERFLOW), float(End.NOT_FINITE)

# numba's cache looks at this file alone; that of a kernel is told by this number what else it was compiled from
_HOUSE = Path(__file__).parent.parent
_SOURCES = sorted((*(_HOUSE / "ode").glob("*.py"), *(_HOUSE / "contact").glob("*.py")))
VERSION = zlib.crc32(b"".join(one.read_bytes() for one in _SOURCES))

damped, dragged = inlined(forms.damped), inlined(forms.dragged)
rate_of_log, rate_of_force = inlined(momentum.rate_of_log), inlined(momentum.rate_of_force)
velocity_of_force = inlined(momentum.velocity_of_force)


@overload(landing.choose, jit_options={"forceinline": True})
def _choose(condition, this, other):
    return lambda condition, this, other: this if condition else other


beyond_end, release = inlined(landing.beyond_end), inlined(motion.release)


@inlined
def solution(k1, k3, k4, k5, k6):
    """The weighted sum of the rates, of order five."""
    return A[6][0] * k1 + A[6][2] * k3 + A[6][3] * k4 + A[6][4] * k5 + A[6][5] * k6


@inlined
def difference(k1, k3, k4, k5, k6, k7):
    """What it differs by from that of order four."""
    return E[0] * k1 + E[2] * k3 + E[3] * k4 + E[4] * k5 + E[5] * k6 + E[6] * k7


@inlined
def rates(coordinate, s, y, stiff, chi, c, p, k, d, g):
    # p and the exponents of s: k of the spring, d of the drag, and g of what w has beside v
    weight = p * whole_power(s, p - 1)
    elastic = stiff * whole_power(s, k)
    if coordinate == FORCE:
        v = velocity_of_force(y, whole_power(s, g), c)
        force = c * whole_power(s, d) * y
        return v, rate_of_force(v, whole_power(s, g - 1), g / c, weight, force), weight, weight * force * v, force
    if coordinate == LOG:
        v = (exponential(y) - 1.0) / chi
        force = damped(elastic, v, 1.0, chi)
        return v, rate_of_log(weight, elastic, chi), weight, weight * force * v, force
    v = y
    force = dragged(damped(elastic, v, 1.0, chi), whole_power(s, d), v, c)
    return v, -(weight * force), weight, weight * force * v, force


@inlined
def attempt(coordinate, s, y, s1, y1, watched, h, stiff, chi, c, p, k, d, g):
    """One step: components at its end and what is added to the others, rates there, the local error."""
    t1 = p * whole_power(s, p - 1)
    work1 = t1 * watched * s1
    s2, y2, _, _, _ = rates(coordinate, s + h * (A[1][0] * s1), y + h * (A[1][0] * y1), stiff, chi, c, p, k, d, g)
    s3, y3, t3, work3, _ = rates(
        coordinate, s + h * (A[2][0] * s1 + A[2][1] * s2), y + h * (A[2][0] * y1 + A[2][1] * y2),
        stiff, chi, c, p, k, d, g,
    )  # fmt: skip
    s4, y4, t4, work4, _ = rates(
        coordinate, s + h * (A[3][0] * s1 + A[3][1] * s2 + A[3][2] * s3),
        y + h * (A[3][0] * y1 + A[3][1] * y2 + A[3][2] * y3), stiff, chi, c, p, k, d, g,
    )  # fmt: skip
    s5, y5, t5, work5, _ = rates(
        coordinate, s + h * (A[4][0] * s1 + A[4][1] * s2 + A[4][2] * s3 + A[4][3] * s4),
        y + h * (A[4][0] * y1 + A[4][1] * y2 + A[4][2] * y3 + A[4][3] * y4), stiff, chi, c, p, k, d, g,
    )  # fmt: skip
    s6, y6, t6, work6, _ = rates(
        coordinate, s + h * (A[5][0] * s1 + A[5][1] * s2 + A[5][2] * s3 + A[5][3] * s4 + A[5][4] * s5),
        y + h * (A[5][0] * y1 + A[5][1] * y2 + A[5][2] * y3 + A[5][3] * y4 + A[5][4] * y5),
        stiff, chi, c, p, k, d, g,
    )  # fmt: skip
    new_s = s + h * solution(s1, s3, s4, s5, s6)
    new_y = y + h * solution(y1, y3, y4, y5, y6)
    more_t, more_work = h * solution(t1, t3, t4, t5, t6), h * solution(work1, work3, work4, work5, work6)
    s7, y7, t7, work7, watched = rates(coordinate, new_s, new_y, stiff, chi, c, p, k, d, g)
    off_s, off_y = abs(difference(s1, s3, s4, s5, s6, s7)), abs(difference(y1, y3, y4, y5, y6, y7))
    scale_s, scale_y = max(abs(s), abs(new_s), FLOOR[0]), max(abs(y), abs(new_y), FLOOR[1])
    # the larger of two quotients by one division; a sum, since a number that is none has to stay none
    off_s, off_y = off_s * scale_y, off_y * scale_s
    worst = abs(h) * (max(off_s, off_y) + 0.0 * (off_s + off_y)) / (scale_s * scale_y)
    return new_s, new_y, more_t, more_work, s7, y7, t7, work7, watched, worst


@inlined
def slope_of_force(coordinate, s, y, rate_s, rate_y, force, small, stiff, chi, c, p, k, d, g):
    """The slope of the force along the trajectory, by a small step."""
    ahead = rates(coordinate, s + small * rate_s, y + small * rate_y, stiff, chi, c, p, k, d, g)
    return (ahead[4] - force) / small


@inlined
def event(coordinate, s, y, rate_s, rate_y, rate_t, force, ending, stiff, chi, c, p, k, d, g):
    """What falls to zero at the end of the phase, and its rate."""
    if ending == GAP:
        return s, rate_s
    if ending == NO_FORCE:
        small = DIFFERENCE * min(abs(s), 1.0)
        slope = slope_of_force(coordinate, s, y, rate_s, rate_y, force, small, stiff, chi, c, p, k, d, g)
        return release(s, rate_s, force, slope)
    if coordinate == FORCE:
        return rate_s, -rate_t * force
    return y, rate_y


@inlined
def advance(coordinate, w, ending, p, k, d, g, m, rtol, rtol_bits, max_steps):
    """Try one step in every lane; accept, land or shorten it."""
    for j in range(LANES):
        s, y, h = w[S * LANES + j], w[Y * LANES + j], w[H * LANES + j]
        stiff, chi, c = w[STIFF * LANES + j], w[CHI * LANES + j], w[DRAG * LANES + j]
        rate_s, rate_y, seen = w[RATE_S * LANES + j], w[RATE_Y * LANES + j], w[WATCHED * LANES + j]
        new_s, new_y, more_t, more_work, new_rate_s, new_rate_y, new_rate_t, new_rate_work, watched, worst = (
            attempt(coordinate, s, y, rate_s, rate_y, seen, h, stiff, chi, c, p, k, d, g)
        )
        gap, rate_of_gap = event(
            coordinate,
            new_s,
            new_y,
            new_rate_s,
            new_rate_y,
            new_rate_t,
            watched,
            ending,
            stiff,
            chi,
            c,
            p,
            k,
            d,
            g,
        )

        running = w[ENDED * LANES + j] == RUNNING
        within, finite = running and worst <= rtol, worst < np.inf
        factor = from_bits(SAFETY_BITS + (rtol_bits >> 8) * FIFTH - (bits(worst) >> 8) * FIFTH)
        following = h * (max(min(factor, LARGEST), SMALLEST) if finite else 0.5)
        halved = w[HALVED * LANES + j] + (0.0 if finite else 1.0)
        ended = NOT_FINITE if halved > HALVINGS else RUNNING

        at = within and min(gap + following * rate_of_gap, gap) < 0.0
        beyond, sure = beyond_end(gap, rate_of_gap, w[G * LANES + j], w[RATE_G * LANES + j], h)
        reach = (beyond if beyond <= CLOSE * h else SHORT * beyond) if sure else np.inf
        following = reach if at and reach < following else following
        landed = at and abs(beyond) <= LANDING * h + NEAR
        crossed = at and gap < 0.0 and not landed
        onto = SHORT * (h + beyond)
        back = onto if 0.0 < onto < h else 0.5 * h
        following = back if crossed else following
        within = within and not crossed
        ended = LANDED if landed else ended
        rest = beyond if landed else 0.0
        new_s, new_y = new_s + rest * new_rate_s, new_y + rest * new_rate_y

        last = w[LAST * LANES + j]
        if ending == STOP:
            best = w[BEST * LANES + j]
            falls = within and watched < seen and seen > best
            best = seen if falls else best
            highest = landed and watched > best
            w[BEST * LANES + j] = watched if highest else best
            w[TOP_S * LANES + j] = new_s if highest else s if falls else w[TOP_S * LANES + j]
            w[TOP_Y * LANES + j] = new_y if highest else y if falls else w[TOP_Y * LANES + j]
            w[BEHIND * LANES + j] = h if highest else last if falls else w[BEHIND * LANES + j]
            w[AHEAD * LANES + j] = 0.0 if highest else h if falls else w[AHEAD * LANES + j]

        away = new_s > FAR if ending == STOP else -new_rate_s <= w[BOUND * LANES + j] * whole_power(new_s, m)
        ended = LOST if within and ended == RUNNING and away else ended
        ended = STEP_UNDERFLOW if ended == RUNNING and following < LAST_STEP else ended
        trials = w[TRIALS * LANES + j] + 1.0
        ended = MAX_STEPS if ended == RUNNING and trials >= max_steps else ended
        w[ENDED * LANES + j] = ended if running else w[ENDED * LANES + j]
        w[TRIALS * LANES + j], w[HALVED * LANES + j] = trials, halved
        w[STEPS * LANES + j] += 1.0 if within else 0.0

        w[S * LANES + j], w[Y * LANES + j] = new_s if within else s, new_y if within else y
        w[T * LANES + j] += more_t + rest * new_rate_t if within else 0.0
        w[WORK * LANES + j] += more_work + rest * new_rate_work if within else 0.0
        w[RATE_S * LANES + j] = new_rate_s if within else rate_s
        w[RATE_Y * LANES + j] = new_rate_y if within else rate_y
        w[WATCHED * LANES + j] = watched if within else seen
        w[G * LANES + j] = gap if within else w[G * LANES + j]
        w[RATE_G * LANES + j] = rate_of_gap if within else w[RATE_G * LANES + j]
        w[LAST * LANES + j], w[H * LANES + j] = h if within else last, following


@inlined
def count_ended(w):
    """How many lanes have ended."""
    count = 0
    for j in range(LANES):
        count += 0 if w[ENDED * LANES + j] == RUNNING else 1
    return count


@inlined
def begin(coordinate, w, j, s, y, stiff, chi, c, p, k, d, g):
    """Put an impact into a lane; its rate of the time is given."""
    for row in BLANK:
        w[row * LANES + j] = 0.0
    w[S * LANES + j], w[Y * LANES + j] = s, y
    w[STIFF * LANES + j], w[CHI * LANES + j], w[DRAG * LANES + j] = stiff, chi, c
    rate_s, rate_y, rate_t, _, watched = rates(coordinate, s, y, stiff, chi, c, p, k, d, g)
    w[RATE_S * LANES + j], w[RATE_Y * LANES + j], w[WATCHED * LANES + j] = rate_s, rate_y, watched
    return rate_t


@inlined
def search(coordinate, w, lanes, best, top, stiff, chi, c, p, k, d, g):
    """Raise the largest watched values to the maxima beside them; see `impact.ode.maximum.search`."""
    # rows of the same numbers by other names: the span of the search, the step of the difference, both ends
    span, small, right, slope_right = T, LAST, TOP_S, G
    for first in range(0, lanes, LANES):
        for j in range(LANES):
            i = min(first + j, lanes - 1)
            w[S * LANES + j], w[Y * LANES + j] = top[0, i], top[1, i]
            w[BEHIND * LANES + j], w[AHEAD * LANES + j], w[BEST * LANES + j] = top[2, i], top[3, i], best[i]
            w[STIFF * LANES + j], w[CHI * LANES + j], w[DRAG * LANES + j] = stiff[i], chi[i], c[i]
        for j in range(LANES):
            rate_s, rate_y, _, _, watched = rates(
                coordinate, w[S * LANES + j], w[Y * LANES + j], w[STIFF * LANES + j], w[CHI * LANES + j],
                w[DRAG * LANES + j], p, k, d, g,
            )  # fmt: skip
            w[RATE_S * LANES + j], w[RATE_Y * LANES + j], w[WATCHED * LANES + j] = rate_s, rate_y, watched
            step = SLOPE * max(w[BEHIND * LANES + j], w[AHEAD * LANES + j])
            slope = slope_of_force(
                coordinate, w[S * LANES + j], w[Y * LANES + j], rate_s, rate_y, watched, step,
                w[STIFF * LANES + j], w[CHI * LANES + j], w[DRAG * LANES + j], p, k, d, g,
            )  # fmt: skip
            reach = w[AHEAD * LANES + j] if slope > 0.0 else -w[BEHIND * LANES + j]
            reach = reach if abs(slope * reach) > FLAT * abs(w[BEST * LANES + j]) else 0.0
            w[small * LANES + j], w[slope_right * LANES + j] = step, slope
            w[span * LANES + j], w[H * LANES + j], w[right * LANES + j] = reach, reach, 0.0
        for count in range(GUESSES + 1):
            for j in range(LANES):
                stiff_j, chi_j, c_j = w[STIFF * LANES + j], w[CHI * LANES + j], w[DRAG * LANES + j]
                s, y, _, _, rate_s, rate_y, _, _, watched, _ = attempt(
                    coordinate, w[S * LANES + j], w[Y * LANES + j], w[RATE_S * LANES + j], w[RATE_Y * LANES + j],
                    w[WATCHED * LANES + j], w[H * LANES + j], stiff_j, chi_j, c_j, p, k, d, g,
                )  # fmt: skip
                slope = slope_of_force(
                    coordinate,
                    s,
                    y,
                    rate_s,
                    rate_y,
                    watched,
                    w[small * LANES + j],
                    stiff_j,
                    chi_j,
                    c_j,
                    p,
                    k,
                    d,
                    g,
                )
                reach, found = w[span * LANES + j], w[BEST * LANES + j]
                w[BEST * LANES + j] = watched if reach != 0.0 and watched > found else found
                here = 1.0 if count == 0 else w[H * LANES + j] / reach
                before, slope_before = w[right * LANES + j], w[slope_right * LANES + j]
                w[right * LANES + j], w[slope_right * LANES + j] = here, slope
                guess = here - slope * (here - before) / (slope - slope_before)
                w[H * LANES + j] = (guess if 0.0 <= guess <= 1.0 else here) * reach
        for j in range(min(LANES, lanes - first)):
            best[first + j] = w[BEST * LANES + j]


def _kernel(coordinate: int, ending: int, version: int):
    """The integrator of a phase in a coordinate, numbers that are constants in it, and by which it is kept."""

    @kept_on_disk
    def integrate(
        start, stiff, chi, c, bound, p, k, d, g, m, rtol, rtol_bits, max_steps,
        state, best, top, steps, end,
    ):  # fmt: skip
        lanes = start.shape[1] if version >= 0 else 0
        w = np.zeros(ROWS * LANES)
        index = np.full(LANES, -1)
        waiting, living, ended_lanes = 0, 0, LANES
        w[ENDED * LANES : (ENDED + 1) * LANES] = LANDED
        while True:
            if ended_lanes - (LANES - living) >= ENOUGH or ended_lanes == LANES:
                living = 0
                for j in range(LANES):
                    i = index[j]
                    if i >= 0 and w[ENDED * LANES + j] != RUNNING:
                        landed = w[ENDED * LANES + j] == LANDED
                        for row in range(4):
                            state[row, i] = w[(S + row) * LANES + j] if landed else np.nan
                            top[row, i] = w[(TOP_S + row) * LANES + j]
                        best[i] = w[BEST * LANES + j] if landed else np.nan
                        steps[i], end[i] = int(w[STEPS * LANES + j]), int(w[ENDED * LANES + j])
                        index[j] = -1
                    if index[j] < 0 and waiting < lanes:
                        i = index[j] = waiting
                        waiting += 1
                        s, y, stiff_i, chi_i, c_i = start[0, i], start[1, i], stiff[i], chi[i], c[i]
                        rate_t = begin(coordinate, w, j, s, y, stiff_i, chi_i, c_i, p, k, d, g)
                        w[BOUND * LANES + j], w[H * LANES + j], w[BEST * LANES + j] = bound[i], FIRST_STEP, -np.inf
                        w[TOP_S * LANES + j], w[TOP_Y * LANES + j] = s, y
                        w[G * LANES + j], w[RATE_G * LANES + j] = event(
                            coordinate, s, y, w[RATE_S * LANES + j], w[RATE_Y * LANES + j], rate_t,
                            w[WATCHED * LANES + j], ending, stiff_i, chi_i, c_i, p, k, d, g,
                        )  # fmt: skip
                    living += index[j] >= 0
                if not living:
                    break
            advance(coordinate, w, ending, p, k, d, g, m, rtol, rtol_bits, max_steps)
            ended_lanes = count_ended(w)
        if ending == STOP:
            search(coordinate, w, lanes, best, top, stiff, chi, c, p, k, d, g)

    return integrate


# by the coordinate of the velocity and what ends the phase; each is compiled when it is first called
KERNELS = {(one, end): _kernel(one, end, VERSION) for one in (V, LOG, FORCE) for end in (STOP, GAP, NO_FORCE)}
