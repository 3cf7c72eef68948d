"""Outputs of oblique impacts where a quantity is zero, infinite, unknown or not defined."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact
from impact.contact.status import FrictionStatus

BALL = {"e": 0.8, "m1": 0.2, "m2": 0.5, "R1": 0.03, "R2": 0.04, "K": 1e6, "v1": 2.0, "v2": -1.0, "mu": 0.3}
SPRING = "cundall-strack-1979"


def oblique(output: Mapping[str, Any] | None = None, **sweep: Any) -> xr.Dataset:
    """The impact of two balls by Coulomb's friction and a spring, some inputs replaced; None removes one."""
    inputs = {name: value for name, value in (BALL | sweep).items() if value is not None}
    return impact.sweep(
        {
            "models": sweep.pop("models", "tsuji-1992"),
            "frictions": ["coulomb-1785", SPRING],
            "sweep": {name: value for name, value in inputs.items() if name != "models"},
            "friction": {SPRING: {"k_t": 3e3}},
            "output": output or {},
        }
    )


def values(result: xr.Dataset, name: str) -> list[float]:
    return list(result[name].values.ravel().tolist())


def test_without_friction_nothing_but_the_normal_velocities_changes() -> None:
    result = oblique(mu=0.0, u1=1.0, omega1=20.0)
    central = impact.sweep({"models": "tsuji-1992", "sweep": {name: BALL[name] for name in BALL if name != "mu"}})
    for name in ("v1_post", "v2_post", "e_out"):
        assert result[name].values.tobytes() == central[name].values.tobytes()
    assert values(result, "beta") == [-1.0, -1.0]
    assert values(result, "u1_post") == [1.0, 1.0]
    assert values(result, "omega1_post") == [20.0, 20.0]
    assert values(result, "impulse_ratio") == values(result, "friction_loss") == [0.0, 0.0]
    assert values(result, "contact_regime") == [2, 2]
    assert values(result, "friction_status") == [1, 1]


def test_without_a_slip_there_is_no_impulse_and_no_tangential_restitution() -> None:
    # the spin turns the contact point as fast as the centre moves
    result = oblique(u1=1.5, omega1=-50.0)
    assert values(result, "u1_post") == [1.5, 1.5]
    assert values(result, "omega1_post") == [-50.0, -50.0]
    assert values(result, "slip_post") == values(result, "impulse_ratio") == [0.0, 0.0]
    assert np.isnan(values(result, "beta")).all()
    assert values(result, "contact_regime") == [1, 1]
    assert values(result, "e_t") == [1.0, 1.0]


def test_a_spin_that_cancels_the_slip_of_an_angle_up_to_rounding_leaves_a_number() -> None:
    random = np.random.default_rng(0)
    v1, angle, R1 = random.uniform(0.1, 10.0, 200), random.uniform(0.05, 1.4, 200), random.uniform(0.001, 1.0, 200)
    spin = -v1 * np.tan(angle) / R1
    cases = {"v1": v1.tolist(), "angle": angle.tolist(), "R1": R1.tolist(), "omega1": spin.tolist()}
    result = oblique(v1=None, v2=0.0, R1=None, cases=cases)
    assert (result["friction_status"] == FrictionStatus.OK).all()
    np.testing.assert_allclose(result["omega1_post"].values[0, 0], spin, rtol=1e-12)
    assert np.all(np.abs(result["slip_post"].values) < 1e-12)
    assert set(values(result, "contact_regime")) <= {1, 3}


def test_the_rebound_angle_and_the_ratio_of_impulses_are_those_of_the_velocities_at_any_speed() -> None:
    result = oblique(v1=[0.5, 4.0], v2=0.0, u1=1.0)
    apart = result["v2_post"] - result["v1_post"]
    angle = np.arctan2(result["u1_post"] - result["u2_post"], apart)
    np.testing.assert_allclose(result["rebound_angle"].values, angle.values, rtol=1e-12)
    ratio = (1.0 - result["u1_post"]) / (result["v1"] - result["v1_post"])
    np.testing.assert_allclose(result["impulse_ratio"].values, ratio.transpose(*angle.dims).values, rtol=1e-9)


def test_a_spin_alone_has_no_restitution_of_the_centres() -> None:
    result = oblique(omega1=30.0)
    assert np.isnan(values(result, "e_t")).all()
    assert np.all(np.abs(values(result, "u1_post")) > 0.0)
    assert np.isfinite(values(result, "beta")).all()


def test_a_ball_of_unknown_radius_has_an_unknown_spin_and_a_known_velocity() -> None:
    result = oblique(R1=None, R2=None, u1=1.0)
    assert np.isnan([values(result, "omega1_post"), values(result, "omega2_post")]).all()
    assert np.isfinite([values(result, "u1_post"), values(result, "beta")]).all()


@pytest.mark.parametrize("body", [{"m2": math.inf}, {"R2": math.inf}])
def test_a_wall_and_a_plane_do_not_turn(body: dict[str, float]) -> None:
    result = oblique(u1=1.0, **body)
    assert values(result, "omega2_post") == [0.0, 0.0]
    # the slip after the impact is that of the velocities after it
    slip = result["u1_post"] + 0.03 * result["omega1_post"] - result["u2_post"]
    assert slip.values.ravel() == pytest.approx(values(result, "slip_post"), rel=1e-14)


@pytest.mark.parametrize("mass", [0.2, math.inf], ids=["balls", "walls"])
def test_balls_that_do_not_meet_keep_their_motion(mass: float) -> None:
    result = oblique(m1=mass, m2=mass, v1=-2.0, u1=1.0, omega1=5.0 if mass < 1.0 else 0.0)
    assert values(result, "friction_status") == [2, 2]
    assert values(result, "u1_post") == [1.0, 1.0]
    assert values(result, "omega1_post") == 2 * [result["omega1"].item()]
    assert values(result, "friction_loss") == [0.0, 0.0]
    assert values(result, "contact_regime") == [0, 0]
    assert np.isnan(values(result, "beta")).all()


def test_at_a_limit_of_the_normal_motion_only_coulomb_has_an_answer() -> None:
    # with e = 0 the damping is infinite and the balls stay together
    result = oblique(models="gharib-hurmuzlu-2012", e=0.0, u1=9.0)
    assert values(result, "status") == [3]
    assert values(result, "friction_status") == [3, 3]
    beta, ratio = values(result, "beta"), values(result, "impulse_ratio")
    assert ratio[0] == pytest.approx(0.3, rel=1e-14)
    assert math.isnan(beta[1])
    # nothing rebounds along the normal
    assert values(result, "rebound_angle")[0] == pytest.approx(0.5 * math.pi, rel=1e-15)


def test_a_slip_that_is_not_known_has_no_regime() -> None:
    """With e = 0 this contact is damped critically, and its balls never separate; without a slip it sticks."""
    result = oblique(e=0.0, u1=[0.0, 0.1, 9.0])
    assert set(values(result, "friction_status")) == {3}
    assert np.isnan(values(result, "beta")).all()
    assert values(result, "contact_regime") == 2 * [1, 0, 0]


def test_coulomb_is_its_closed_form() -> None:
    result = oblique(u1=[0.1, 9.0])
    beta = result["beta"].sel(friction="coulomb-1785").values.ravel()
    m_t = 1.0 / (3.5 / 0.2 + 3.5 / 0.5)
    m = 1.0 / (1.0 / 0.2 + 1.0 / 0.5)
    # sticks in the end; slides throughout with an impulse above mu (1 + e_out), since the force pulls in the end
    assert beta[0] == 0.0
    assert result["contact_regime"].sel(friction="coulomb-1785").values.ravel().tolist() == [3, 2]
    rigid = 0.3 * 1.8 * m * 3.0 / (m_t * 9.0) - 1.0
    assert 0.0 < beta[1] - rigid < 0.01
    ratio = result["impulse_ratio"].sel(friction="coulomb-1785").values.ravel()[1]
    assert 0.3 < ratio < 0.303
    # without tension Lambda is 1 + e exactly
    elastic = oblique(models="hertz", u1=[0.1, 9.0]).sel(friction="coulomb-1785")
    assert elastic["beta"].values.ravel()[1] == pytest.approx(0.3 * 2.0 * m * 3.0 / (m_t * 9.0) - 1.0, rel=1e-9)
    assert np.abs(elastic["beta_error"].values).max() < 1e-9


def test_a_contact_of_coulomb_changes_once_and_a_spring_twice() -> None:
    result = impact.sweep(
        {
            "models": "hertz",
            "frictions": ["coulomb-1785", SPRING],
            "sweep": BALL | {"u1": [0.1, 9.0]},
            "friction": {SPRING: {"k_t": 3e3}},
            "output": {"variables": ["contact_regime", "slip_changes"]},
        }
    )
    assert values(result, "contact_regime") == [3, 2, 3, 3]
    assert values(result, "slip_changes") == [1, 0, 2, 2]


@pytest.mark.parametrize("change", [{"mu": 0.0, "u1": 1.0}, {"u1": 1.5, "omega1": -50.0}, {"u1": 1.0, "v1": -2.0}])
@pytest.mark.parametrize("integrator", ["exact", "kick-drift"])
def test_where_no_friction_acts_all_works_are_zero_and_psi_is_not_defined(
    integrator: str, change: dict[str, float]
) -> None:
    works = ["slip_work", "tangential_damping_work", "memory_work", "elastic_left"]
    steps = {} if integrator == "exact" else {"steps_per_contact": 20.0}
    result = impact.sweep(
        {
            "models": "hertz",
            "frictions": ["coulomb-1785", "lammps-mindlin-force"],
            "sweep": {**BALL, **change, **steps},
            "friction": {"lammps-mindlin-force": {"kt_over_kn": 0.8, "xt": 0.0}},
            "output": {"variables": [*works, "friction_loss", "psi1", "psi2"]},
            "solver": {"integrator": integrator},
        }
    )
    for name in [*works, "friction_loss"]:
        assert values(result, name) == [0.0, 0.0]
    assert np.isnan(values(result, "psi1") + values(result, "psi2")).all()


def test_works_make_up_the_loss_and_momenta_are_kept() -> None:
    rng = np.random.default_rng(1)
    u1, omega1, omega2 = rng.uniform(-3.0, 3.0, 20), rng.uniform(-100.0, 100.0, 20), rng.uniform(-100.0, 100.0, 20)
    cases = {"u1": u1.tolist(), "omega1": omega1.tolist(), "omega2": omega2.tolist()}
    result = oblique(cases=cases)
    assert np.nanmax(np.abs(result["friction_residual"].values)) < 1e-8
    m1, m2, I1, I2 = 0.2, 0.5, 0.4 * 0.2 * 0.03**2, 0.4 * 0.5 * 0.04**2
    before = m1 * u1**2 + I1 * omega1**2 + I2 * omega2**2
    weights = {"u1_post": m1, "u2_post": m2, "omega1_post": I1, "omega2_post": I2}
    after = sum(weight * np.square(result[name].values) for name, weight in weights.items())
    names = ["slip_work", "tangential_damping_work", "memory_work", "elastic_left"]
    works = oblique(cases=cases, output={"variables": names})[names].to_dataarray().sum("variable")
    loss = 0.5 * (before - after)
    assert works.transpose(*result["u1_post"].dims).values == pytest.approx(loss, abs=1e-8 * before.max())
    impulse = m1 * (u1 - result["u1_post"].values)
    largest = np.abs(impulse).max()
    assert m2 * result["u2_post"].values == pytest.approx(impulse, abs=1e-14 * max(largest, m1 * 3.0))
    for spin, name, R, inertia in ((omega1, "omega1_post", 0.03, I1), (omega2, "omega2_post", 0.04, I2)):
        change = inertia * (spin - result[name].values)
        assert change == pytest.approx(R * impulse, abs=1e-14 * inertia * 100.0 + 1e-14 * R * m1 * 3.0)


def test_works_make_up_the_loss_where_the_force_pulls_only_in_a_part_of_a_step() -> None:
    config = {
        "models": "kuwabara-kono-1987",
        "frictions": "lammps-mindlin",
        "sweep": BALL | {"K": 1.0, "v1": 1.0, "v2": 0.0, "m1": 1.0, "m2": math.inf, "u1": 0.2},
        "model": {"kuwabara-kono-1987": {"A": {"geomspace": [1e-5, 1e-2, 50]}}},
        "friction": {"lammps-mindlin": {"k_t": 0.3, "xt": 0.0}},
    }
    residual = impact.sweep(config)["friction_residual"].values
    assert np.abs(residual).max() < 1e-8


@pytest.mark.parametrize("friction", ["lammps-mindlin", "lammps-mindlin-force", "liggghts-history"])
def test_tiny_slips_and_tiny_frictions_are_their_limits(friction: str) -> None:
    """The slip after over that before has a limit for g0/mu to 0, and none changes for mu to 0."""
    law = "liggghts-hertz" if "liggghts" in friction else "lammps-coeff-restitution-hertz"
    balls = {"R1": 0.01, "R2": 0.01, "v1": 1.0, "e": 0.8, "material": "steel"}
    laws = {"models": law, "frictions": friction}
    tiny = impact.sweep({**laws, "sweep": {**balls, "mu": 0.3, "u1": [1e-11, 1e-14, 1e-16, 1e-25]}})
    np.testing.assert_allclose(tiny["beta"].values.ravel(), tiny["beta"].values.flat[0], rtol=0, atol=1e-9)
    assert (np.abs(tiny["friction_residual"]) < 1e-9).all()
    smooth = impact.sweep({**laws, "sweep": {**balls, "mu": [1e-15, 1e-16, 1e-18, 1e-20], "u1": 1.0}})
    assert (smooth["friction_status"] < 10).all()
    np.testing.assert_allclose(smooth["beta"].values.ravel(), -1.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("friction", ["lammps-mindlin", "lammps-mindlin-rescale-force"])
def test_a_tiny_friction_is_integrated_with_other_contact_forces(friction: str) -> None:
    balls = {"m1": 1.0, "m2": [1.0, np.inf], "R1": 0.05, "R2": 0.05, "v1": 1.0, "material": "steel"}
    sweep = {**balls, "e": [0.1, 0.6, 0.95], "angle": [0.1, 0.7, 1.4], "mu": [1e-14, 1e-15, 1e-16, 1e-17]}
    result = impact.sweep(
        {"models": ["lammps-tsuji", "gharib-hurmuzlu-2012"], "frictions": friction, "sweep": sweep}
    )
    assert set(np.unique(result["friction_status"])) <= {FrictionStatus.OK, FrictionStatus.SLOW_LIMIT}
    np.testing.assert_allclose(result["beta"].values, -1.0, rtol=0, atol=1e-11)


@pytest.mark.parametrize("friction", ["lammps-mindlin", "lammps-mindlin-force"])
def test_the_force_of_a_tiny_friction_is_mu_times_the_contact_force(friction: str) -> None:
    point = {"R1": 0.01, "R2": 0.01, "v1": 1.0, "u1": 1.0, "mu": 1e-19, "e": 0.8, "material": "steel"}
    history = impact.run(model="lammps-coeff-restitution-hertz", friction=friction, at=point).history
    assert history is not None
    np.testing.assert_allclose(np.abs(history["f"]).max(), 1e-19 * np.abs(history["F"]).max(), rtol=1e-6)
