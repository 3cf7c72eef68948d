"""Adhesive laws: the neck and sticking speed of JKR, and the Edinburgh law against the time steps of LIGGGHTS."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import impact
from impact.contact.closed_forms.plastic import jkr_root
from impact.contact.impacts import Impacts
from impact.contact.models import find
from impact.contact.output_formulas import Outputs, collide
from impact.contact.status import FrictionStatus, Status

from .problems import table1_impacts

GAMMA = 0.2
# balls of 10 and 20 µg, which lose much energy by adhesion at some centimetres a second
SMALL = {"m1": 1e-8, "m2": 2e-8, "E1": 2e9, "E2": 56e9}


def struck(key: str, n: float = 1.5, **inputs) -> Outputs:
    return collide(find(key), table1_impacts(n, **inputs), rtol=1e-10, max_steps=10_000)


def sticking_speed(impacts: Impacts) -> float:
    """Thornton and Ning (1998), equation (54)."""
    R, E = 1 / (1 / impacts.R1[0] + 1 / impacts.R2[0]), 1 / (0.91 / impacts.E1[0] + 0.91 / impacts.E2[0])
    return float(np.sqrt(14.18 / impacts.m[0]) * (GAMMA**5 * R**4 / E**2) ** (1 / 6))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "parameters", "speeds"),
    [
        ("jkr-1971", {"gamma": 0.05}, [0.001, 0.2]),
        ("luding-2008", {"k2": 5.0, "kc": 3.0, "phi": 1e-3}, [0.001, 5.0]),
    ],
)
def test_friction_of_balls_that_adhesion_holds_is_at_its_limit_and_no_failure(
    key: str, parameters: dict[str, float], speeds: list[float]
) -> None:
    swept = impact.sweep(
        {
            "models": key,
            "frictions": "coulomb-1785",
            "sweep": {"v1": speeds, "R1": 1e-4, "R2": 1e-4, "mu": 0.3, "angle": "40 deg", "material": "soft"},
            "materials": {"soft": {"E": 1e6, "nu": 0.3, "rho": 1000.0}},
            "model": {key: parameters},
            "friction": {"coulomb-1785": {"limit": "positive"}},
        }
    )
    assert swept["status"].values.ravel().tolist() == [Status.LIMIT, Status.OK]
    assert swept["friction_status"].values.ravel().tolist() == [FrictionStatus.LIMIT, FrictionStatus.OK]


def test_balls_with_a_neck_rebound_by_thornton_and_ning_and_stick_below_a_speed():
    vs = sticking_speed(table1_impacts(v1=1.0, **SMALL))
    ratio = np.array([0.1, 0.5, 0.99, 1.01, 1.1, 2.0, 10.0, 1e3])
    contact = struck("jkr-1971", v1=ratio * vs, parameters={"gamma": GAMMA}, **SMALL)
    expected = np.sqrt(np.maximum(1 - 1 / ratio**2, 0.0))
    # 14.18 has four digits
    assert contact["e_out"] == pytest.approx(expected, abs=2e-3)
    assert contact["closed_form_error"] == pytest.approx(np.zeros(8), abs=1e-9)
    assert contact["status"].tolist() == [Status.LIMIT] * 3 + [Status.OK] * 5
    assert np.isnan(contact["contact_time"]).tolist() == [True] * 3 + [False] * 5


def test_the_pull_of_a_neck_is_eight_ninths_of_its_largest_at_first_and_five_ninths_at_last():
    config = {
        "models": "jkr-1971",
        "sweep": {"v1": 1.0, "m1": 1e-8, "m2": 2e-8, "material": "soft"},
        "materials": {"soft": {"E": 2e9, "nu": 0.3, "rho": 2712.0}},
        "model": {"jkr-1971": {"gamma": GAMMA}},
    }
    single = impact.run(config)
    force, delta = single.history["F"].values, single.history["delta"].values
    R1, R2 = ((3 * m / (4 * np.pi * 2712.0)) ** (1 / 3) for m in (1e-8, 2e-8))
    R, E = R1 * R2 / (R1 + R2), 2e9 / (2 * 0.91)
    pull = 1.5 * np.pi * GAMMA * R
    assert force[0] == pytest.approx(-8 / 9 * pull, rel=1e-9)
    assert force[-1] == pytest.approx(-5 / 9 * pull, rel=1e-4)
    assert force.min() == pytest.approx(-pull, rel=1e-2)
    assert delta[-1] == pytest.approx(-0.75 * (np.pi**2 * GAMMA**2 * R / E**2) ** (1 / 3), rel=1e-9)
    assert single.values["permanent_indentation"] == pytest.approx(delta[-1], rel=1e-12)


def test_jkr_without_adhesion_is_hertz():
    neck = struck("jkr-1971", v1=[0.01, 1.0], parameters={"gamma": 0.0})
    hertz = struck("hertz", v1=[0.01, 1.0])
    assert neck["e_out"] == pytest.approx([1.0, 1.0], abs=1e-9)
    assert neck["peak_indentation"] == pytest.approx(hertz["peak_indentation"], rel=1e-9)
    assert neck["contact_time"] == pytest.approx(hertz["contact_time"], rel=1e-9)


def test_the_contact_radius_of_a_neck_is_the_largest_root():
    b, R = 0.3, 2.0
    least = -0.75 * b * (0.25 * b * R) ** (1 / 3)
    x = np.concatenate([least * (1 - np.geomspace(1e-9, 1.0, 50)), np.geomspace(1e-9, 1e6, 100)])
    y = jkr_root(x, R, b)
    scale = np.maximum(np.abs(x), -least)
    assert np.abs(y**4 / R - b * y - x).max(initial=0.0, where=x < 1e3) < 1e-12
    assert np.all(np.abs(y**4 / R - b * y - x) < 1e-13 * scale + 1e-15)
    # on the branch where the contact radius grows with the indentation
    assert np.all(4 * y**3 / R >= b * (1 - 1e-6))


def edinburgh(n: float, K: float, k2: float, gamma: float, chi: float, R1: float, R2: float, m: float, v0: float):
    """The restitution by the steps of normal_model_edinburgh.h, e = 1, fixKc off, in 400,000 steps of leapfrog."""
    lam = (1 - 1 / k2) ** (1 / n)
    dt = 2.94 * ((n + 1) * m * v0**2 / (2 * K)) ** (1 / (n + 1)) / v0 / 400_000
    x, v, p = 0.0, v0, 0.0
    adhesion = 0.0
    for _ in range(1_600_000):
        x += dt * v
        if x <= 0.0:
            break
        if lam * x > p:
            p = lam * x
            distance = R1 + R2 - p
            square = 4 * distance**2 * R1**2 - (distance**2 - R2**2 + R1**2) ** 2
            pull, most = 1.5 * np.pi * gamma * np.sqrt(max(square, 0.0)) / (2 * distance), K * k2 * p**n / 2
            depth = p / 2 if pull > most else ((K * k2 * p**n - pull) / (K * k2)) ** (1 / n)
            adhesion = min(pull, most) / depth**chi
        force = min(K * x**n, max(K * k2 * (x**n - p**n), -adhesion * x**chi))
        v -= dt * force / m
    return max(-v / v0, 0.0) if x <= 0.0 else 0.0


@pytest.mark.slow
@pytest.mark.parametrize("n", [1.0, 1.5])
@pytest.mark.parametrize(("k2", "chi"), [(2.0, 1.0), (5.0, 1.0), (3.0, 1.5)])
@pytest.mark.parametrize("gamma", [0.0, 40.0])
def test_the_edinburgh_law_agrees_with_the_time_steps_of_liggghts(n, k2, chi, gamma):
    K, m1, m2, v0, R = 1e5 * 1e3 ** (n - 1), 0.01, 0.02, 0.5, 0.01
    parameters = {"k2": k2, "gamma": gamma, "adhesion_exponent": chi}
    contact = struck("liggghts-edinburgh", n, v1=v0, m1=m1, m2=m2, K=K, R1=R, R2=2 * R, parameters=parameters)
    m = m1 * m2 / (m1 + m2)
    assert contact["e_out"][0] == pytest.approx(edinburgh(n, K, k2, gamma, chi, R, 2 * R, m, v0), abs=2e-5)
    assert abs(contact["closed_form_error"][0]) < 1e-9
    # with n = 1 and without surface energy it is the bilinear law
    if gamma == 0.0 and n == 1.0:
        assert contact["e_out"][0] == pytest.approx(np.sqrt(1 / k2), abs=1e-9)


def edinburgh_by_quadrature(n: float, K: float, k2: float, gamma: float, R: float, m: float, v0: float) -> float:
    """The restitution by the equation of the catalogue with χ = 1, for two balls of one radius."""
    peak = ((n + 1) / 2 * m * v0**2 / K) ** (1 / (n + 1))
    plastic = (1 - 1 / k2) ** (1 / n) * peak
    a = np.sqrt(R**2 - (R - plastic / 2) ** 2)
    pull, limit = 1.5 * np.pi * gamma * a, K * k2 * plastic**n / 2
    d = plastic / 2 if pull > limit else (plastic**n - pull / (K * k2)) ** (1 / n)
    k_a = min(pull, limit) / d

    def force(x: float) -> float:
        return max(K * k2 * (x**n - plastic**n), -k_a * x)

    meeting = brentq(lambda x: K * k2 * (x**n - plastic**n) + k_a * x, 0.0, peak, xtol=1e-18)
    work = quad(force, 0.0, meeting, epsrel=1e-12)[0] + quad(force, meeting, peak, epsrel=1e-12)[0]
    return float(np.sqrt(max(2 * work / (m * v0**2), 0.0)))


@pytest.mark.parametrize(
    ("n", "K", "k2", "gamma", "e_out"),
    [
        (1.5, 3.162e7, 2.0, 24848.94, 0.213703),
        # just beyond the limit of f, where d is half of the permanent indentation and e jumps
        (1.5, 3.162e7, 2.0, 24848.95, 0.0),
        (1.5, 3.162e7, 2.0, 5e4, 0.0),
        (2.0, 3.162e7, 1.5, 5e4, 0.549263),
        (1.25, 1e6, 2.0, 5e6, 0.340371),
        # with n = 1 both values of d are the same
        (1.0, 1e6, 2.0, 1e9, 0.5),
    ],
)
def test_the_edinburgh_law_is_its_equation_where_the_adhesion_is_limited(
    n: float, K: float, k2: float, gamma: float, e_out: float
) -> None:
    parameters = {"k2": k2, "gamma": gamma, "adhesion_exponent": 1.0}
    contact = struck("liggghts-edinburgh", n, v1=1.0, m1=1.0, m2=1.0, K=K, R1=0.02, R2=0.02, parameters=parameters)
    assert contact["e_out"][0] == pytest.approx(e_out, abs=1e-6)
    assert contact["e_out"][0] == pytest.approx(edinburgh_by_quadrature(n, K, k2, gamma, 0.02, 0.5, 1.0), abs=1e-9)
    equation = " ".join(find("liggghts-edinburgh").equation.split())
    assert "d = δₚ/2 where f is limited to k₂ δₚⁿ/2, else (δₚⁿ − f/k₂)^(1/n)" in equation


def test_the_edinburgh_law_sticks_at_low_speed_and_releases_at_zero_indentation():
    speeds = np.geomspace(0.003, 1.0, 12)
    parameters = {"k2": 3.0, "gamma": 40.0, "adhesion_exponent": 1.0}
    impacts = table1_impacts(1.5, v1=speeds, m1=0.01, m2=0.02, K=1e7, parameters=parameters)
    sticky = collide(find("liggghts-edinburgh"), impacts, rtol=1e-10, max_steps=10_000)
    assert sticky["status"][0] == Status.LIMIT
    assert sticky["status"][-1] == Status.OK
    assert np.all(np.diff(sticky["e_out"]) >= 0.0)
    assert np.abs(sticky["closed_form_error"]).max() < 1e-9
    released = sticky["status"] == Status.OK
    assert sticky["permanent_indentation"][released] == pytest.approx(0.0, abs=1e-12)
    dry = struck(
        "liggghts-edinburgh", v1=0.5, K=1e7, parameters={"k2": 3.0, "gamma": 0.0, "adhesion_exponent": 1.0}
    )
    assert dry["permanent_indentation"] / dry["peak_indentation"] == pytest.approx([(2 / 3) ** (2 / 3)], rel=1e-9)


@pytest.mark.parametrize(("exponent", "shown"), [(0.9, "0.9"), (10.5, "10.5")])
def test_the_exponent_of_the_adhesive_branch_is_from_1_to_10(exponent: float, shown: str) -> None:
    config = {
        "models": "liggghts-edinburgh",
        "sweep": {"v1": 0.1, "m1": 1.0, "m2": 1.0, "R1": 0.02, "R2": 0.06, "K": 1e6},
        "model": {"liggghts-edinburgh": {"k2": 2.0, "gamma": 1.0, "adhesion_exponent": exponent}},
    }
    with pytest.raises(impact.errors.ConfigError, match=f"got {shown}, expected a number from 1 to 10$"):
        impact.sweep(config)


def test_the_stiffness_of_the_edinburgh_law_depends_on_its_exponent():
    config = {
        "models": "liggghts-edinburgh",
        "sweep": {"v1": 0.1, "m1": 1.0, "m2": 1.0, "R1": 0.02, "R2": 0.06, "material": "soft", "n": [1.0, 1.5]},
        "materials": {"soft": {"E": 2e9, "nu": 0.3, "rho": 2712.0}},
        "model": {"liggghts-edinburgh": {"k2": 2.0, "gamma": 1.0}},
        "solver": {"rtol": 1e-4},
    }
    R, E = 0.015, 2e9 / (2 * 0.91)
    assert impact.sweep(config)["stiffness"].values.ravel() == pytest.approx(
        [2 * E * R, 4 / 3 * E * np.sqrt(R)], rel=1e-12
    )
