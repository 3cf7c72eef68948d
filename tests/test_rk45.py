"""The integrator has the order of its tableau, locates events, and integrates a trajectory as if it were alone."""

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from impact.contact import motion
from impact.contact.models import find
from impact.ode import events, maximum, rk45, tableau
from impact.ode.problem import Problem, Solution, Termination
from impact.ode.rk45 import integrate, rk_step
from impact.ode.state import Workspace

from .problems import OSCILLATOR, PROBLEMS, SPRINGS, TANH, SolvedProblem

RTOLS = 10.0 ** -np.arange(4, 13)


def solve_problem(solved: SolvedProblem, rtol: float, record: bool = False) -> Solution:
    start = np.array(solved.initial_state).reshape(2, 1)
    return integrate(solved.problem, start, (), rtol=rtol, max_steps=1000, record=record)


def solve_springs(rows: np.ndarray, max_steps: int = 1000, rtol: float = 1e-9) -> Solution:
    """Trajectories of `SPRINGS` from (0, 1), each a row (k, c, q)."""
    params = tuple(np.ascontiguousarray(np.array(rows, float).reshape(-1, 3).T))
    start = np.array([np.zeros(params[0].size), np.ones(params[0].size)])
    return integrate(SPRINGS, start, params, rtol=rtol, max_steps=max_steps)


def bits_of(solution: Solution, index: int) -> bytes:
    arrays = (solution.state, solution.maximum, solution.steps, solution.termination)
    return b"".join(array[..., index].tobytes() for array in arrays)


def fixed_step_error(solved: SolvedProblem, count: int, embedded: bool) -> float:
    """The error at the end after equal steps with the solution of order 5, or with the embedded one of order 4."""
    rates, h = solved.problem.rates, np.array([solved.event_time / count])
    y = np.zeros((4, 1))
    y[:2, 0] = solved.initial_state
    k = rates(y[:2], ())
    for _ in range(count):
        y, stages = rk_step(solved.problem, y, k, h, (), Workspace.of(solved.problem, h.size))
        k = stages[-1]
        if embedded:
            y = y - h * sum(float(e) * stage[:4] for e, stage in zip(tableau.E, stages, strict=True))
            k = rates(y[:2], ())
    return np.abs(y[:2, 0] - solved.exact(solved.event_time)).max()


@pytest.mark.parametrize("solved", [OSCILLATOR, TANH], ids=str)
@pytest.mark.parametrize(("embedded", "order"), [(False, 5), (True, 4)])
def test_the_error_converges_with_the_order_of_the_method(solved, embedded, order):
    errors = [fixed_step_error(solved, count, embedded) for count in (16, 32, 64)]
    slopes = -np.diff(np.log2(errors))
    assert np.all(np.abs(slopes - order) < 0.35), slopes


@pytest.mark.parametrize("solved", PROBLEMS, ids=str)
def test_the_error_is_proportional_to_the_tolerance(solved):
    errors = [abs(solve_problem(solved, rtol).state[0, 0] - solved.exact(solved.event_time)[0]) for rtol in RTOLS]
    assert np.all(np.diff(errors) < 0.0)
    assert np.all(errors < 3.0 * RTOLS)
    assert np.all(errors > 0.03 * RTOLS)


@pytest.mark.parametrize("solved", PROBLEMS, ids=str)
def test_state_quadratures_and_maximum_at_the_event_are_accurate(solved):
    solution = solve_problem(solved, 1e-11)
    assert solution.termination[0] == Termination.EVENT_REACHED
    assert solution.state[:, 0] == pytest.approx(
        [*solved.exact(solved.event_time), solved.event_time, solved.quadrature], rel=0, abs=1e-10
    )
    assert solution.maximum[0] == pytest.approx(solved.maximum, rel=1e-10)


@pytest.mark.parametrize("solved", PROBLEMS, ids=str)
def test_the_event_is_located_to_rounding(solved):
    assert solve_problem(solved, 1e-6).state[1, 0] == pytest.approx(
        solved.exact(solved.event_time)[1], rel=0, abs=1e-15
    )


@pytest.mark.parametrize("solved", PROBLEMS, ids=str)
def test_recorded_interpolant_matches_the_solution_between_steps(solved):
    solution = solve_problem(solved, 1e-10, record=True)
    assert len(solution.recorded) == solution.steps[0]
    for step in solution.recorded:
        for part in (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0):
            y0, y1, t, _ = step.at(step.end * part)[:, 0]
            assert (y0, y1) == pytest.approx(solved.exact(t), rel=0, abs=1e-9)
    assert step.at(step.end)[:, 0] == pytest.approx(solution.state[:, 0], rel=0, abs=1e-12)


@pytest.mark.parametrize("solved", PROBLEMS, ids=str)
def test_recording_changes_no_bit(solved):
    assert bits_of(solve_problem(solved, 1e-8, record=True), 0) == bits_of(solve_problem(solved, 1e-8), 0)


# trajectories whose durations differ by factors of up to 100000
trajectories = st.tuples(st.floats(-6.0, 4.0).map(lambda x: 10.0**x), st.floats(0.0, 0.5), st.floats(-1.0, 0.5))


@settings(max_examples=10, deadline=None)
@given(rows=st.lists(trajectories, min_size=1, max_size=8), seed=st.integers(0, 999))
def test_a_trajectory_has_the_same_bits_alone_and_in_any_batch(rows, seed):
    # the bits are compared, not the accuracy
    solve = partial(solve_springs, rtol=1e-6)
    batch = solve(rows)
    order = np.random.default_rng(seed).permutation(len(rows))
    permuted = solve([rows[index] for index in order])
    for index, row in enumerate(rows):
        alone = bits_of(solve([row]), 0)
        assert bits_of(batch, index) == alone
        assert bits_of(permuted, int(np.flatnonzero(order == index)[0])) == alone


def test_a_trajectory_has_the_same_bits_among_others_that_end_much_later():
    solution = solve_springs([(1.0, 0.1, 0.0), *[(1e-11, 0.0, -1e-3)] * 40])
    assert solution.steps[0] * 3 < solution.steps[1]
    assert bits_of(solution, 0) == bits_of(solve_springs([(1.0, 0.1, 0.0)]), 0)


FAILURES = {
    "a rate is not a number": ((np.nan, 0.0, 0.0), Termination.NOT_FINITE),
    "a rate is infinite": ((1.0, np.inf, 0.0), Termination.NOT_FINITE),
    "the event is never reached": ((1.0, 1e6, 0.0), Termination.MAX_STEPS),
    "the event cannot be reached": ((-1.0, 0.0, 0.0), Termination.EVENT_UNREACHABLE),
    "the solution diverges": ((0.0, 0.0, 1.0), Termination.STEP_UNDERFLOW),
}


@pytest.mark.parametrize(("row", "end"), FAILURES.values(), ids=FAILURES)
def test_a_failure_is_reported_and_changes_no_other_trajectory(row, end):
    other_rows = [(0.5 + 0.1 * index, 0.1, 0.0) for index in range(9)]
    alone, batch = solve_springs(other_rows), solve_springs([*other_rows[:4], row, *other_rows[4:]])
    assert batch.termination[4] == end
    assert np.isnan(batch.state[:, 4]).all()
    assert np.isnan(batch.maximum[4])
    for index in range(9):
        assert batch.termination[index + (index >= 4)] == Termination.EVENT_REACHED
        assert bits_of(batch, index + (index >= 4)) == bits_of(alone, index)


@pytest.mark.parametrize("limit", [0.1, 0.3, 0.5, 0.777, 0.99])
def test_a_rate_that_becomes_nan_during_the_integration_is_reported_as_not_finite(limit):
    def rates(y, params, out=None):
        return OSCILLATOR.problem.rates(y, params) * np.where(y[0] > limit, np.nan, 1.0)

    oscillator = OSCILLATOR.problem
    problem = Problem(rates, oscillator.event, oscillator.unreachable, oscillator.floor)
    solution = integrate(problem, np.array([[0.0], [1.0]]), (), rtol=1e-9, max_steps=1000)
    assert solution.termination[0] == Termination.NOT_FINITE


def test_the_integration_stops_after_max_steps_attempts():
    # attempts include rejected steps, so that the sufficient number is searched for
    sufficient = next(
        count
        for count in range(1, 200)
        if solve_springs([(1.0, 0.0, 0.0)], count).termination[0] == Termination.EVENT_REACHED
    )
    reference = solve_springs([(1.0, 0.0, 0.0)])
    assert sufficient >= reference.steps[0]
    assert bits_of(solve_springs([(1.0, 0.0, 0.0)], sufficient), 0) == bits_of(reference, 0)
    assert solve_springs([(1.0, 0.0, 0.0)], sufficient - 1).termination[0] == Termination.MAX_STEPS


@pytest.mark.parametrize("rtol", [1e-7, 1e-8])
def test_at_most_one_step_of_an_approach_is_rejected(rtol):
    law = motion.MotionLaw.of(find("hunt-crossley-1975"), 1.5, strong=False)
    for chi in np.linspace(0.0, 2.0, 9):
        start = motion.components_at(law, (), np.zeros(1), 1.0)
        integrate_approach = partial(integrate, motion.approach_problem(law), start, (np.array([chi]),), rtol=rtol)
        steps = int(integrate_approach(max_steps=1000).steps[0])
        assert integrate_approach(max_steps=steps + 1).termination[0] == Termination.EVENT_REACHED


def test_an_empty_batch_gives_an_empty_solution():
    assert solve_springs(np.empty((0, 3))).state.shape == (4, 0)


# ---- formulas that the NumPy and the compiled core share


@pytest.mark.parametrize("root", [-0.8, -0.2, -1e-4, 1e-4, 0.3, 0.6])
def test_the_event_of_a_parabola_is_located_exactly(root):
    # g = (root − t)(2 + t)/3 over a step of length 1 that ends at t = 0
    def g(t):
        return (root - t) * (2.0 + t) / 3.0, (root - 2.0 - 2.0 * t) / 3.0

    offset, is_certain = events.event_offset(*map(np.asarray, (*g(0.0), *g(-1.0), 1.0)))
    assert offset == pytest.approx(root, rel=1e-12)
    assert is_certain


def test_the_event_of_a_cubic_is_located_more_accurately_than_by_its_parabola():
    # g = −t − t³/2 + c over a step of length 1 that ends at t = 0, with its roots to 17 digits
    for c, root, tolerance in ((0.3, 0.28804985959466517, 1e-4), (0.1, 0.09950735335435984, 1e-7)):
        g = (np.asarray(c), np.asarray(-1.0), np.asarray(c + 1.5), np.asarray(-2.5), np.asarray(1.0))
        assert events.event_offset(*g)[0] == pytest.approx(root, abs=tolerance)


def test_a_rising_event_function_has_no_event_and_a_decaying_one_no_certain_event():
    with np.errstate(all="ignore"):
        rising = events.event_offset(*map(np.asarray, (1.0, 0.5, 0.5, 0.5, 1.0)))
        # exp(−t) has no zero
        decaying = events.event_offset(*map(np.asarray, (1.0, -1.0, np.e, -np.e, 1.0)))
    assert rising[0] == np.inf
    assert not decaying[1]


def test_a_step_is_shortened_to_a_certain_event_unless_it_is_near():
    h = 2.0
    at_bound = events.NEAR_EVENT * h + events.EVENT_ATOL
    offset = np.array([at_bound, np.nextafter(at_bound, 1.0), -at_bound, 5.0])
    near, h_next = events.before_event(offset, np.array([True, True, False, True]), h, 3.0)
    assert near.tolist() == [True, False, True, False]
    assert h_next.tolist() == [offset[0], offset[1], 3.0, 3.0]


def test_a_step_across_the_event_is_repeated_up_to_it():
    near, remaining = np.array([True, False, False, False]), np.zeros(4)
    g, offset = np.array([-1.0, -1.0, -1.0, 1.0]), np.array([-1e-4, -0.5, -3.0, 0.5])
    located, crossed, h_next = events.at_event(near, remaining, g, offset, 2.0, 7.0)
    assert located.tolist() == [True, False, False, False]
    assert crossed.tolist() == [False, True, True, False]
    # it is halved if the event is not within the step
    assert h_next.tolist() == [7.0, 1.5, 1.0, 7.0]


def test_an_event_is_located_if_the_remaining_offset_is_at_most_its_bound():
    h, g = 2.0, np.ones(3)
    bound = events.EVENT_RTOL * h + events.EVENT_ATOL
    remaining = np.array([bound, -bound, np.nextafter(bound, 1.0)])
    located, crossed, _ = events.at_event(np.full(3, True), remaining, g, remaining, h, 7.0)
    assert located.tolist() == [True, True, False]
    assert not crossed.any()


@pytest.mark.parametrize(("ended", "is_compacted"), [(2, False), (3, True)])
def test_ended_trajectories_are_removed_if_they_exceed_a_fraction(monkeypatch, ended, is_compacted):
    # two of sixteen do not exceed the fraction
    assert rk45.COMPACT_ABOVE == 2 / 16
    sizes = []
    advance = rk45._advance

    def recorded(problem, state, *arguments):
        sizes.append(state.y.shape[1])
        return advance(problem, state, *arguments)

    monkeypatch.setattr(rk45, "_advance", recorded)
    solution = solve_springs([(1.0, 0.1, 0.0)] * ended + [(1e-6, 0.0, 0.0)] * (16 - ended))
    assert np.all(solution.termination == Termination.EVENT_REACHED)
    assert set(sizes) == ({16, 16 - ended} if is_compacted else {16})


def test_the_step_size_follows_the_error_within_bounds():
    rtol = 1e-9
    grow, stay, shrink = rk45.next_step(np.array([2.0, 2.0, 2.0]), rtol * np.array([1e-30, 1.0, 1e30]), rtol)
    assert (grow, shrink) == (2.0 * rk45.MAX_FACTOR, 2.0 * rk45.MIN_FACTOR)
    assert stay == 2.0 * rk45.SAFETY
    errors = rtol * np.geomspace(1e-2, 1e2, 50)
    exact = rk45.SAFETY * (rtol / errors) ** (rk45.CONTROLLER_EXPONENT / 256)
    assert rk45.next_step(np.ones(50), errors, rtol) == pytest.approx(exact, rel=0.05)


def test_the_norm_is_the_larger_relative_error_and_propagates_nan():
    def norm(first, second):
        y = np.array([0.5, -2.0, 1.0, -3.0])
        return rk45.error_norm(*map(np.asarray, (first, second, *y)), (1e-200, 1e-200))

    # relative to the larger of the values at both ends: 1 and 3
    assert norm(-2.0, 3.0) == 2.0
    assert norm(0.5, -6.0) == 2.0
    assert np.isnan(norm(np.nan, 1.0))
    assert np.isnan(norm(1.0, np.nan))


def test_the_secant_method_finds_the_root_of_a_line_but_stays_within_the_step():
    left, right = np.zeros(3), np.ones(3)
    slopes = np.array([1.0, 1.0, 3.0]), np.array([-1.0, -3.0, 1.0])
    assert maximum.secant_update(left, slopes[0], right, slopes[1]).tolist() == [0.5, 0.25, 1.0]


@pytest.mark.parametrize("solved", PROBLEMS, ids=str)
def test_every_recorded_step_begins_at_the_end_of_the_previous_step(solved):
    # at this tolerance each problem has a step across its event, which is rejected and not recorded
    steps = solve_problem(solved, 1e-3, record=True).recorded
    for before, step in pairwise(steps):
        assert step.start == pytest.approx(before.at(1.0), abs=1e-14)


def test_the_maximum_is_located_only_if_it_is_watched():
    unwatched = replace(OSCILLATOR.problem, watch=False)
    start = np.array(OSCILLATOR.initial_state).reshape(2, 1)
    assert integrate(unwatched, start, (), rtol=1e-9, max_steps=1000).maximum.tolist() == [-np.inf]
