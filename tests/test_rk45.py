"""The integrator has the order of its tableau, finds where lanes end, and computes a lane as if it were alone."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from impact.contact import motion
from impact.contact.models import find
from impact.ode import tableau
from impact.ode.problem import End, Outcome, Problem
from impact.ode.rk45 import integrate
from impact.ode.step import Space, attempt

from .problems import OSCILLATOR, PROBLEMS, SPRINGS, TANH, Known

RTOLS = 10.0 ** -np.arange(4, 13)


def solve(known: Known, rtol: float, record: bool = False) -> Outcome:
    start = np.array(known.start).reshape(2, 1)
    return integrate(known.problem, start, (), rtol=rtol, max_steps=1000, record=record)


def springs(rows: np.ndarray, max_steps: int = 1000) -> Outcome:
    """Lanes of `SPRINGS` from (0, 1), one a row (k, c, q)."""
    columns = tuple(np.ascontiguousarray(np.array(rows, float).reshape(-1, 3).T))
    start = np.array([np.zeros(columns[0].size), np.ones(columns[0].size)])
    return integrate(SPRINGS, start, columns, rtol=1e-9, max_steps=max_steps)


def bits(outcome: Outcome, place: int) -> bytes:
    arrays = (outcome.state, outcome.maximum, outcome.steps, outcome.end)
    return b"".join(array[..., place].tobytes() for array in arrays)


def fixed_step_error(known: Known, count: int, embedded: bool) -> float:
    """The error at the end after equal steps, advanced by the solution or by the embedded one."""
    rates, h = known.problem.rates, np.array([known.ends / count])
    y = np.zeros((4, 1))
    y[:2, 0] = known.start
    k = rates(y[:2], ())
    for _ in range(count):
        y, stages = attempt(known.problem, y, k, h, (), Space.of(h.size))
        k = stages[-1]
        if embedded:
            y = y - h * sum(float(e) * stage[:4] for e, stage in zip(tableau.E, stages, strict=True))
            k = rates(y[:2], ())
    return np.abs(y[:2, 0] - known.exact(known.ends)).max()


@pytest.mark.parametrize("known", [OSCILLATOR, TANH], ids=str)
@pytest.mark.parametrize(("embedded", "order"), [(False, 5), (True, 4)])
def test_halved_steps_have_the_slope_of_the_order(known, embedded, order):
    errors = [fixed_step_error(known, count, embedded) for count in (16, 32, 64)]
    slopes = -np.diff(np.log2(errors))
    assert np.all(np.abs(slopes - order) < 0.35), slopes


@pytest.mark.parametrize("known", PROBLEMS, ids=str)
def test_tighter_tolerance_lowers_the_error_in_proportion(known):
    errors = [abs(solve(known, rtol).state[0, 0] - known.exact(known.ends)[0]) for rtol in RTOLS]
    assert np.all(np.diff(errors) < 0.0)
    assert np.all(errors < 3.0 * RTOLS)
    assert np.all(errors > 0.03 * RTOLS)


@pytest.mark.parametrize("known", PROBLEMS, ids=str)
def test_ends_with_its_quadratures_and_maximum_at_the_event(known):
    outcome = solve(known, 1e-11)
    assert outcome.end[0] == End.LANDED
    assert outcome.state[:, 0] == pytest.approx(
        [*known.exact(known.ends), known.ends, known.quadrature], rel=0, abs=1e-10
    )
    assert outcome.maximum[0] == pytest.approx(known.highest, rel=1e-10)


@pytest.mark.parametrize("known", PROBLEMS, ids=str)
def test_event_is_met_to_rounding(known):
    assert solve(known, 1e-6).state[1, 0] == pytest.approx(known.exact(known.ends)[1], rel=0, abs=1e-15)


@pytest.mark.parametrize("known", PROBLEMS, ids=str)
def test_recorded_interpolant_matches_the_solution_between_steps(known):
    outcome = solve(known, 1e-10, record=True)
    assert len(outcome.recorded) == outcome.steps[0]
    for step in outcome.recorded:
        for part in (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0):
            y0, y1, t, _ = step.at(step.end * part)[:, 0]
            assert (y0, y1) == pytest.approx(known.exact(t), rel=0, abs=1e-9)
    assert step.at(step.end)[:, 0] == pytest.approx(outcome.state[:, 0], rel=0, abs=1e-12)


@pytest.mark.parametrize("known", PROBLEMS, ids=str)
def test_recording_changes_no_bit(known):
    assert bits(solve(known, 1e-8, record=True), 0) == bits(solve(known, 1e-8), 0)


# a lane that ends at once, a lane that ends after a thousand times as long, and everything between
lanes = st.tuples(st.floats(-6.0, 4.0).map(lambda x: 10.0**x), st.floats(0.0, 0.5), st.floats(-1.0, 0.5))


@settings(max_examples=30, deadline=None)
@given(rows=st.lists(lanes, min_size=1, max_size=24), seed=st.integers(0, 999))
def test_lane_has_the_same_bits_alone_and_in_any_crowd(rows, seed):
    crowd = springs(rows)
    order = np.random.default_rng(seed).permutation(len(rows))
    permuted = springs([rows[place] for place in order])
    for place, row in enumerate(rows):
        alone = bits(springs([row]), 0)
        assert bits(crowd, place) == alone
        assert bits(permuted, int(np.flatnonzero(order == place)[0])) == alone


def test_lane_has_the_same_bits_among_lanes_that_end_much_later():
    outcome = springs([(1.0, 0.1, 0.0), *[(1e-11, 0.0, -1e-3)] * 40])
    assert outcome.steps[0] * 3 < outcome.steps[1]
    assert bits(outcome, 0) == bits(springs([(1.0, 0.1, 0.0)]), 0)


FAILURES = {
    "a rate is not a number": ((np.nan, 0.0, 0.0), End.NOT_FINITE),
    "a rate is infinite": ((1.0, np.inf, 0.0), End.NOT_FINITE),
    "it never ends": ((1.0, 1e6, 0.0), End.MAX_STEPS),
    "it runs away": ((-1.0, 0.0, 0.0), End.LOST),
    "it blows up": ((0.0, 0.0, 1.0), End.STEP_UNDERFLOW),
}


@pytest.mark.parametrize(("row", "end"), FAILURES.values(), ids=FAILURES)
def test_failure_is_told_and_leaves_the_other_lanes_alone(row, end):
    others = [(0.5 + 0.1 * place, 0.1, 0.0) for place in range(9)]
    whole, crowd = springs(others), springs([*others[:4], row, *others[4:]])
    assert crowd.end[4] == end
    assert np.isnan(crowd.state[:, 4]).all()
    assert np.isnan(crowd.maximum[4])
    for place in range(9):
        assert crowd.end[place + (place >= 4)] == End.LANDED
        assert bits(crowd, place + (place >= 4)) == bits(whole, place)


@pytest.mark.parametrize("wall", [0.1, 0.3, 0.5, 0.777, 0.99])
def test_rate_that_becomes_nan_on_the_way_is_not_finite(wall):
    def rates(y, columns, out=None):
        return OSCILLATOR.problem.rates(y, columns) * np.where(y[0] > wall, np.nan, 1.0)

    other = OSCILLATOR.problem
    problem = Problem(rates, other.event, other.lost, other.floor)
    outcome = integrate(problem, np.array([[0.0], [1.0]]), (), rtol=1e-9, max_steps=1000)
    assert outcome.end[0] == End.NOT_FINITE


def test_given_up_after_max_steps_attempts():
    # attempts are accepted steps and those tried again, so that the number of them that suffices is found
    enough = next(count for count in range(1, 200) if springs([(1.0, 0.0, 0.0)], count).end[0] == End.LANDED)
    reference = springs([(1.0, 0.0, 0.0)])
    assert enough >= reference.steps[0]
    assert bits(springs([(1.0, 0.0, 0.0)], enough), 0) == bits(reference, 0)
    assert springs([(1.0, 0.0, 0.0)], enough - 1).end[0] == End.MAX_STEPS


@pytest.mark.parametrize("rtol", [1e-7, 1e-8])
def test_hardly_a_step_of_an_impact_is_tried_again(rtol):
    law = motion.Law.of(find("hunt-crossley-1975"), 1.5, strong=False)
    for chi in np.linspace(0.0, 2.0, 9):
        start = motion.start_of_approach(law, (), 1)
        into = partial(integrate, motion.approach(law), start, (np.array([chi]),), rtol=rtol)
        assert into(max_steps=int(into(max_steps=1000).steps[0]) + 1).end[0] == End.LANDED


def test_no_lanes_give_no_outcome():
    assert springs(np.empty((0, 3))).state.shape == (4, 0)
