"""Slips at a fixed step: what LAMMPS delivered, the limit of small steps, and what schemes refuse."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import impact
from impact.errors import ConfigError, UsageError

MATERIALS = {"soft": {"E": 1e9, "nu": 0.3, "rho": 1000.0}}
HOOKE = {"e": 0.7, "K": 1e6, "n": 1.0}
WALL = {"v1": 1.0, "m1": 1.0, "R1": 0.05, "m2": math.inf, "R2": math.inf, "angle": "45 deg", "mu": 0.5}


def sweep(model: str, friction: str, values: dict[str, Any], inputs: dict[str, Any], scheme: str) -> Any:
    config = {
        "models": model,
        "frictions": friction,
        "sweep": {**WALL, **inputs},
        "materials": MATERIALS,
        "friction": {friction: values},
    }
    return impact.sweep(config if scheme == "exact" else config | {"solver": {"integrator": scheme}})


STEP = {"steps_per_contact": 12, "phase": 0.625}
LINEAR, HERTZ = "lammps-coeff-restitution-hooke", "lammps-coeff-restitution-hertz"
# u1 [m/s] and omega1 [rad/s] after the impact by LAMMPS of 22 July 2025, fix wall/gran granular
BY_LAMMPS = [
    ("lammps-linear-history", LINEAR, {"k_t": 2e5, "xt": 0.0}, (0.5287211865822689, -23.563940670886524)),
    ("lammps-linear-history", LINEAR, {"k_t": 8e5, "xt": 1.0}, (0.7023689870302408, -14.88155064848795)),
    ("lammps-linear-nohistory", LINEAR, {"xt": 0.5}, (0.7926429450536526, -10.367852747317375)),
    ("lammps-mindlin", HERTZ, {"xt": 0.0}, (0.6418830484545257, -17.90584757727369)),
    ("lammps-mindlin", HERTZ, {"xt": 0.6}, (0.698822212875429, -15.058889356228544)),
    ("lammps-mindlin-force", HERTZ, {"xt": 0.0}, (0.6523448008847127, -17.382759955764342)),
    ("lammps-mindlin-rescale", HERTZ, {"xt": 0.6}, (0.701104507704072, -14.944774614796373)),
    ("lammps-mindlin-rescale-force", HERTZ, {"xt": 0.0}, (0.6534224235967255, -17.328878820163702)),
]


@pytest.mark.filterwarnings("ignore::impact.ImpactWarning")
@pytest.mark.parametrize(("friction", "model", "values", "expected"), BY_LAMMPS)
def test_lammps_delivered_these_velocities(
    friction: str, model: str, values: dict[str, float], expected: tuple[float, float]
) -> None:
    inputs = HOOKE if model == LINEAR else {"e": 0.7, "material": "soft"}
    result = sweep(model, friction, values, inputs | STEP, "kick-drift")
    delivered = [float(result[name].squeeze()) for name in ("u1_post", "omega1_post")]
    assert delivered == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("friction", "values"),
    [
        ("cundall-strack-1979", {"k_t": 3e5}),
        ("lammps-linear-history", {"k_t": 3e5, "xt": 0.3}),
        ("liggghts-history", {"tangential_reduce": "on"}),
        ("liggghts-no-history", {}),
        ("yade-viscoelastic", {"k_t": 3e5, "c_t": 10.0}),
        ("yade-cundall-strack", {"k_t": 3e5}),
    ],
)
def test_small_steps_come_to_the_continuous_law(friction: str, values: dict[str, float]) -> None:
    angles = {"angle": ["10 deg", "45 deg", "80 deg"], "mu": 0.3}
    exact = sweep(LINEAR, friction, values, HOOKE | angles, "exact").beta
    errors = []
    for steps in (200, 2000):
        step = {"steps_per_contact": steps, "phase": 0.5}
        at_step = sweep(LINEAR, friction, values, HOOKE | angles | step, "kick-drift").beta
        errors.append(float(np.abs(at_step - exact).max()))
    # of first order where friction is continuous; where it jumps at the end of the contact, more slowly
    assert errors[1] < min(errors[0], 1e-3)


def test_the_restitution_at_a_fixed_step_does_not_depend_on_friction() -> None:
    result = sweep(LINEAR, "cundall-strack-1979", {"k_t": 3e5}, HOOKE | STEP | {"mu": [0.1, 0.5]}, "kick-drift")
    central = impact.sweep(
        {
            "models": LINEAR,
            "sweep": {**{name: WALL[name] for name in ("v1", "m1", "R1", "m2", "R2")}, **HOOKE, **STEP},
            "solver": {"integrator": "kick-drift"},
        }
    )
    assert (result.e_out.values == float(central.e_out.squeeze())).all()
    # without friction nothing changes along the plane
    free = sweep(LINEAR, "cundall-strack-1979", {"k_t": 3e5}, HOOKE | STEP | {"mu": 0.0}, "kick-drift")
    assert float(free.u1_post.squeeze()) == pytest.approx(1.0, rel=1e-15)
    assert float(free.beta.squeeze()) == -1.0


def test_tamsi_slides_by_the_impulse_of_its_own_restitution() -> None:
    step = {"steps_per_contact": 12, "phase": 0.3, "angle": "80 deg", "mu": 0.3, "K": 1e6, "n": 1.0}
    config = {
        "models": "drake-point-contact",
        "frictions": "coulomb-1785",
        "sweep": {**WALL, **step},
        "solver": {"integrator": "drake-tamsi"},
    }
    result = impact.sweep(config)
    e_out, g0 = float(result.e_out.squeeze()), math.tan(math.radians(80.0))
    # (7/2) mu (1 + e_out) v0 of a solid sphere that slides
    assert float(result.slip_post.squeeze()) == pytest.approx(g0 - 3.5 * 0.3 * (1.0 + e_out), rel=1e-12)


@pytest.mark.parametrize(
    ("scheme", "friction", "expected"),
    [
        ("kick-drift", "coulomb-1785", "one with a spring or a dashpot, such as cundall-strack-1979"),
        ("kick-drift", "drake-regularized", "one with a spring or a dashpot"),
        ("drake-sap", "coulomb-1785", "none: friction changes the restitution that it delivers"),
    ],
)
def test_a_scheme_refuses_friction_of_which_no_code_was_run(scheme: str, friction: str, expected: str) -> None:
    model = LINEAR if scheme == "kick-drift" else "kelvin-voigt-no-tension"
    with pytest.raises(
        ConfigError, match=f'scheme "{scheme}" does not take the friction law {friction}, expected {expected}'
    ):
        sweep(model, friction, {}, HOOKE | STEP, scheme)


def test_timestep_has_the_tangential_restitution_of_a_sweep_over_the_phases() -> None:
    inputs = {**HOOKE, "v1": 1.0, "mu": 0.3, "angle": "45 deg", "friction.cundall-strack-1979.k_t": 3e5}
    friction = "cundall-strack-1979"
    result = impact.timestep(LINEAR, at=inputs, friction=friction, steps_per_contact=[12, 31], phases=4)
    phases = [0.125, 0.375, 0.625, 0.875]
    config = {
        "models": LINEAR,
        "frictions": friction,
        "sweep": {**HOOKE, "v1": 1.0, "mu": 0.3, "angle": "45 deg", "m1": 1.0, "m2": 1.0, "R1": 0.02, "R2": 0.02,
                  "steps_per_contact": [12, 31], "phase": phases},
        "friction": {friction: {"k_t": 3e5}},
        "solver": {"integrator": "kick-drift"},
    }  # fmt: skip
    beta = impact.sweep(config).beta.squeeze().transpose("steps_per_contact", "phase").values
    assert [row.beta_mean for row in result.rows] == pytest.approx(beta.mean(axis=1), rel=1e-12)
    assert [row.beta_least for row in result.rows] == pytest.approx(beta.min(axis=1), rel=1e-12)
    assert [row.beta_largest for row in result.rows] == pytest.approx(beta.max(axis=1), rel=1e-12)
    data = result.as_dict()
    assert data["friction"] == friction
    exact = impact.run(model=LINEAR, at=inputs, friction=friction).values["beta"]
    assert data["beta_continuous"] == pytest.approx(exact, rel=1e-9)
    assert {"beta_mean", "beta_least", "beta_largest"} <= data["rows"][0].keys()
    central = impact.timestep(LINEAR, at={**HOOKE, "v1": 1.0}, steps_per_contact=[12], phases=4).as_dict()
    assert "friction" not in central
    assert "beta_mean" not in central["rows"][0]


def test_timestep_without_friction_is_smooth_and_refuses_what_its_scheme_does_not_take() -> None:
    inputs = {**HOOKE, "v1": 1.0, "mu": 0.0, "angle": "45 deg", "friction.cundall-strack-1979.k_t": 3e5}
    (row,) = impact.timestep(LINEAR, at=inputs, friction="cundall-strack-1979", steps_per_contact=[12]).rows
    assert row.beta_mean == -1.0
    with pytest.raises(UsageError, match='scheme "kick-drift" does not take the friction law coulomb-1785'):
        impact.timestep("hertz", at={"mu": 0.3, "angle": "45 deg"}, friction="coulomb-1785")
