"""The event of a phase in parts is that of the phase or a breakpoint, whichever comes first."""

from __future__ import annotations

import numpy as np
import pytest

from impact.contact.piecewise import _first_event
from impact.ode.problem import Problem

# the event function of the phase and its rate; the distance to a breakpoint, with the rate -1; which is first
CASES = {
    "the event is nearer": (0.5, -1.0, 1.0, "event"),
    "the breakpoint is nearer": (1.0, -1.0, 0.5, "breakpoint"),
    "the breakpoint is reached, the event is ahead": (1.0, -1.0, 0.0, "breakpoint"),
    "the event is crossed, the breakpoint is ahead": (-0.5, -1.0, 1.0, "event"),
    "the event is crossed, the breakpoint is reached": (-0.5, -1.0, 0.0, "event"),
    "the breakpoint is crossed, the event is ahead": (1.0, -1.0, -0.5, "breakpoint"),
    "the breakpoint is crossed, the trajectory leaves the event": (0.0, 1.0, -0.5, "breakpoint"),
    "both are crossed, the event was first": (-0.5, -1.0, -0.2, "event"),
    "both are crossed, the breakpoint was first": (-0.2, -1.0, -0.5, "breakpoint"),
}


@pytest.mark.parametrize("case", CASES)
def test_the_first_of_event_and_breakpoint_ends_the_part(case: str) -> None:
    g, dg, distance, first = CASES[case]
    phase = Problem(
        rates=lambda y, params, out=None: y,
        event=lambda y, k, params: (np.array([g]), np.array([dg])),
        unreachable=lambda y, k, params: np.array([False]),
        floor=(1.0, 1.0),
    )
    # at y0 = 1/2, which moves at rate 1, the trajectory is on the positive side
    event = _first_event(phase, [lambda y, params: distance - (y[0] - 0.5)])
    value, rate = event(np.array([[0.5], [0.0]]), np.array([[1.0], [0.0]]), (np.ones(1),))
    if first == "event":
        assert (value.item(), rate.item()) == (g, dg)
    else:
        assert value.item() == distance
        assert rate.item() == pytest.approx(-1.0, rel=1e-6)
