"""The reference solver for friction agrees with known numbers, closed forms and the time steps of codes.

The numbers are of a prototype and of a second, independent solver; all have K = m = v0 = 1, m_t = 2/7, mu = 0.3.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from .friction_reference import Friction, NormalLaw, beta, bilinear, kick_drift, solve, spring_dashpot

MU, M_T = 0.3, 2.0 / 7.0


def damping_ratio(e: float) -> float:
    """ζ of e, for a dashpot that acts until the indentation is zero."""
    return -math.log(e) / math.hypot(math.pi, math.log(e))


C = 2.0 * damping_ratio(0.7)
ELASTIC, HERTZ = spring_dashpot(1.0), spring_dashpot(1.5)
DAMPED, LIMITED = spring_dashpot(1.0, C, 0.0), spring_dashpot(1.0, C, 0.0, "force")
TSUJI = spring_dashpot(1.5, math.sqrt(5.0) * damping_ratio(0.8), 0.25)
MINDLIN = 2.0 * 1.5 * (1.0 - 0.3) / (2.0 - 0.3)


def spring(k_t: float, **changes: object) -> Friction:
    return replace(Friction("spring", MU, M_T, k_t), **changes)


def mindlin(*memory: int, **changes: object) -> Friction:
    return spring(MINDLIN, kp=0.5, memory=memory, **changes)


def drake(g: float) -> float:
    y = g / 0.01
    return MU * (y**3 * (10.0 - 15.0 * y + 6.0 * y * y) if y < 1.0 else 1.0)


DAMPED_SPRING = spring(2 / 7, c_t=C)
CAPPED_SPRING = spring(2 / 7, c_t=C, cap="spring")
DASHPOT = Friction("dashpot", MU, M_T, c_t=C)
# normal law, friction, and beta by g0
TABLE: list[tuple[NormalLaw, Friction, dict[float, float]]] = [
    (ELASTIC, spring(0.8), {0.2: -0.2755047382, 1.0: 0.4769459935}),
    (ELASTIC, spring(2 / 7), {0.5: 1.0, 1.5: 0.4, 3.0: -0.3}),
    (DAMPED, spring(2 / 7), {0.2: 0.9460191833, 1.0: 0.6169228848}),
    (LIMITED, spring(2 / 7), {0.2: 0.9710510743, 1.0: 0.6332468100}),
    (DAMPED, DAMPED_SPRING, {0.2: 0.3349560103, 1.0: 0.2487924863}),
    (DAMPED, CAPPED_SPRING, {0.2: 0.2843498352, 1.0: 0.3383276283}),
    (DAMPED, replace(CAPPED_SPRING, positive=True), {0.2: 0.349907081229, 1.0: 0.416329528871}),
    (DAMPED, DASHPOT, {0.2: -0.0837190762}),
    (DAMPED, replace(DASHPOT, positive=True), {0.2: -0.099380624399}),
    (DAMPED, Friction("coulomb", MU, M_T), {3.0: -0.3922590473}),
    (LIMITED, Friction("coulomb", MU, M_T), {3.0: -0.3986295236}),
    (bilinear(0.7), spring(2 / 7), {0.2: 0.8754247215, 1.0: 0.7250747576}),
    (HERTZ, mindlin(1, 1), {0.2: -0.9382452227, 0.6: 0.1381289427, 1.2: 0.3494952312}),
    (HERTZ, mindlin(0, 0), {0.2: -0.6550129277, 0.6: 0.0878103927, 1.2: 0.3899764294}),
    (HERTZ, mindlin(1, 2), {0.2: -0.6235853858, 0.6: 0.1460639875, 1.2: 0.3168336644}),
    (HERTZ, mindlin(0, 1), {0.2: -0.4813614900, 0.6: 0.0954038379, 1.2: 0.3494952312}),
    (TSUJI, mindlin(0, 0), {0.6: 0.1853585578}),
    (TSUJI, mindlin(0, 1), {0.6: 0.1906659020}),
    (ELASTIC, Friction("regularized", MU, M_T, coefficient=drake), {0.5: -0.0003627776}),
]


@pytest.mark.parametrize(("normal", "friction", "expected"), TABLE)
def test_the_table(normal: NormalLaw, friction: Friction, expected: dict[float, float]) -> None:
    for g0, value in expected.items():
        outcome = solve(normal, friction, g0)
        assert beta(outcome, g0) == pytest.approx(value, abs=2e-10)
        if friction.kind != "coulomb":
            loss = 0.5 * M_T * (g0**2 - outcome.g**2)
            work = outcome.slip_and_memory + outcome.damping_work + outcome.elastic_left
            assert work == pytest.approx(loss, abs=1e-14)


def test_a_slip_within_one_step_is_found() -> None:
    friction = Friction("spring", 0.23993550754806486, M_T, 4.547180681446862, kp=0.5, memory=(1, 2))
    g0 = math.tan(math.radians(27.12447285847138))
    outcome = solve(HERTZ, friction, g0)
    assert beta(outcome, g0) == pytest.approx(-0.113860514635, abs=1e-11)
    assert [mode for _, mode in outcome.modes] == [1, 0, 0, -1, 0, 1]


@pytest.mark.parametrize(
    ("q", "mu", "xt", "g0", "expected"),
    [
        (0.25, 0.3, 1.0, 1.0, 0.2192436193264),
        (0.25, 0.63, 0.656, 1.1 * 0.63 / 0.656, 0.3544288604517),
        (0.5, 0.3, 1.0, 1.0, 0.1758545196360),
    ],
)
def test_the_slow_limit(q: float, mu: float, xt: float, g0: float, expected: float) -> None:
    friction = mindlin(1, 1, mu=mu, c_t=0.3 * xt, q=q)
    outcome = solve(spring_dashpot(1.5, 0.3, q, "force"), friction, g0)
    assert beta(outcome, g0) == pytest.approx(expected, abs=1e-11)
    assert outcome.slow == (q < 0.5)
    assert outcome.modes[0][1] == (-1 if q < 0.5 else 1)


def test_a_spring_that_keeps_its_displacement_makes_energy() -> None:
    friction = Friction("spring", 0.5, M_T, 0.617647, kp=0.5, memory=(1, 1))
    outcome = solve(spring_dashpot(1.5, 0.491935, 0.25, "force"), friction, 0.796214)
    assert beta(outcome, 0.796214) == pytest.approx(1.0288303, abs=1e-7)
    assert outcome.memory_work < 0.0


@pytest.mark.parametrize(("positive", "expected"), [(False, -0.0827963), (True, -0.0948511)])
def test_pulling_empties_the_spring_at_zero_force(positive: bool, expected: float) -> None:
    normal, w = spring_dashpot(1.0, 0.3, 0.0), math.sqrt(0.8 / M_T)
    turn = math.sqrt(1.0 - 0.15**2)
    t_end = math.pi / turn
    # F = x + C v of exp(-0.15 t) sin(turn t)
    t_zero = (math.pi - math.atan2(0.3 * turn, 1.0 - 0.3 * 0.15)) / turn
    closed = -math.cos(w * t_zero) * (1.0 if positive else math.cos(w * (t_end - t_zero)))
    outcome = solve(normal, spring(0.8, mu=1e6, positive=positive), 1.0)
    assert closed == pytest.approx(expected, abs=5e-8)
    assert beta(outcome, 1.0) == pytest.approx(closed, abs=1e-5)
    to_force = solve(replace(normal, release="force"), spring(0.8, mu=1e6, positive=positive), 1.0)
    assert beta(to_force, 1.0) == pytest.approx(-math.cos(w * t_zero), abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("kappa", [0.7, 4.0])
@pytest.mark.parametrize("memory", [(0, 0), (1, 1), (0, 1), (1, 2)])
@pytest.mark.parametrize("normal", [ELASTIC, HERTZ])
def test_it_slides_throughout_from_a_known_slip(
    normal: NormalLaw, memory: tuple[float, float], kappa: float
) -> None:
    """kappa is the stiffness over that of the normal law, times m/m_t."""
    least = max(1.0 / kappa, 2.0 - 1.0 / kappa)
    friction = spring(kappa * M_T, memory=memory)
    if normal is HERTZ:
        factor = 1.5 if memory[0] == 1 else 1.0
        # the indentation's own rate carries a part of the spring's force
        least = max(1.0 / (factor * kappa), 2.0 - (1.0 - memory[1] / 3.0) / kappa)
        friction = spring(1.5 * kappa * M_T, kp=0.5, memory=memory)
    for share, regime in ((1.001, 2), (0.999, 3)):
        g0 = share * least * MU / M_T
        outcome = solve(normal, friction, g0)
        assert outcome.regime == regime
        if regime == 2:
            assert beta(outcome, g0) == pytest.approx(2.0 * MU / (M_T * g0) - 1.0, abs=1e-13)


@pytest.mark.parametrize(
    ("e", "k_t", "c_t", "g0"), [(0.3, 1.8, 2.0, 0.6), (0.2, 0.6, 2.5, 1.5), (0.8, 1.6, 0.7, 0.6)]
)
def test_the_third_regime_forgets_the_past(e: float, k_t: float, c_t: float, g0: float) -> None:
    normal = spring_dashpot(1.0, 2.0 * damping_ratio(e), 0.0, "force")
    friction = spring(k_t, mu=0.1, c_t=c_t, cap="spring")
    outcome = solve(normal, friction, g0)
    assert outcome.modes[-1][1] == 2
    assert outcome.g == pytest.approx(-0.1 / k_t * outcome.e_out, abs=1e-12)


@pytest.mark.slow
def test_time_steps_of_codes_tend_to_the_same_slip() -> None:
    random = np.random.default_rng(39)
    for _ in range(25):
        zeta, release = damping_ratio(random.uniform(0.3, 1.0)), str(random.choice(["gap", "force"]))
        damping, q, kp, memory = 2.0 * zeta, 0.0, 0.0, (0, 0)
        normal = spring_dashpot(1.0, damping, 0.0, release)
        if random.integers(2):
            damping, q, kp = math.sqrt(5.0) * zeta, 0.25, 0.5
            normal = spring_dashpot(1.5, damping, q, release)
            memory = [(0, 0), (1, 1), (0, 1), (1, 2)][random.integers(4)]
        cap = str(random.choice(["total", "spring"]))
        xt = random.uniform(0.0, 1.0)
        friction = Friction(
            "spring",
            random.uniform(0.1, 1.0),
            random.uniform(0.2, 1.0),
            10.0 ** random.uniform(-0.5, 0.7),
            kp,
            memory,
            xt * damping,
            q,
            cap,
            bool(random.integers(2)),
        )
        # below the slow limit
        g0 = random.uniform(0.1, 1.0) * friction.mu / max(xt, 0.1)
        outcome = solve(normal, friction, g0)
        coarse, fine = (kick_drift(normal, friction, g0, h) for h in (2e-3, 1e-3))
        assert outcome.g == pytest.approx(2.0 * fine - coarse, abs=2e-3 * max(g0, friction.mu / friction.m_t))
