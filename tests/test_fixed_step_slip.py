"""Slips at a fixed step: what LAMMPS delivered, the limit of small steps, and what schemes refuse."""

from __future__ import annotations

import itertools
import math
import warnings
from typing import Any

import numpy as np
import pytest

import impact
from impact.config.tables import expand_laws
from impact.contact.frictions import frictions
from impact.errors import ConfigError, UsageError

# hard: so stiff that the lever arm of a code is the radius but for a ten-thousandth
MATERIALS = {"soft": {"E": 1e9, "nu": 0.3, "rho": 1000.0}, "hard": {"E": 1e15, "nu": 0.3, "rho": 1000.0}}
HOOKE = {"e": 0.7, "K": 1e6, "n": 1.0}
# parameters of the contact forces
OF_MODEL = ("gamma", "eta", "k", "b")
WALL = {"v1": 1.0, "m1": 1.0, "R1": 0.05, "m2": math.inf, "R2": math.inf, "angle": "45 deg", "mu": 0.5}


def sweep(
    model: str,
    friction: str,
    values: dict[str, Any],
    inputs: dict[str, Any],
    scheme: str,
    solver: dict[str, Any] | None = None,
) -> Any:
    of_model = {name: inputs[name] for name in OF_MODEL if name in inputs}
    inputs = {name: value for name, value in inputs.items() if name not in of_model}
    wall = {name: value for name, value in WALL.items() if name != "angle" or "u1" not in inputs}
    config = {
        "models": model,
        "model": {model: of_model},
        "frictions": friction,
        "sweep": {**wall, **inputs},
        "materials": MATERIALS,
        "friction": {friction: values},
    }
    return impact.sweep(
        config if scheme == "exact" else config | {"solver": {"integrator": scheme} | (solver or {})}
    )


STEP = {"steps_per_contact": 12, "phase": 0.625}
LINEAR, HERTZ = "lammps-coeff-restitution-hooke", "lammps-coeff-restitution-hertz"
CLASSIC_HOOKE, CLASSIC_HERTZ = "lammps-mass-velocity-hooke", "lammps-viscoelastic-hertz"
INPUTS = {
    LINEAR: HOOKE,
    HERTZ: {"e": 0.7, "material": "soft"},
    CLASSIC_HOOKE: {"K": 1e6, "n": 1.0, "gamma": 200.0},
    CLASSIC_HERTZ: {"K": 1e9 * math.sqrt(0.05), "eta": 1e4},
}
# u1 [m/s] and omega1 [rad/s] after the impact by LAMMPS of 22 July 2025, fix wall/gran granular, and for the
# classic law hooke/history and hertz/history
BY_LAMMPS = [
    ("lammps-linear-history", LINEAR, {"k_t": 2e5, "xt": 0.0}, (0.5287211865822689, -23.563940670886524)),
    ("lammps-linear-history", LINEAR, {"k_t": 8e5, "xt": 1.0}, (0.7023689870302408, -14.88155064848795)),
    ("lammps-linear-nohistory", LINEAR, {"xt": 0.5}, (0.7926429450536526, -10.367852747317375)),
    ("lammps-mindlin", HERTZ, {"xt": 0.0}, (0.6418830484545257, -17.90584757727369)),
    ("lammps-mindlin", HERTZ, {"xt": 0.6}, (0.698822212875429, -15.058889356228544)),
    ("lammps-mindlin-force", HERTZ, {"xt": 0.0}, (0.6523448008847127, -17.382759955764342)),
    ("lammps-mindlin-rescale", HERTZ, {"xt": 0.6}, (0.701104507704072, -14.944774614796373)),
    ("lammps-mindlin-rescale-force", HERTZ, {"xt": 0.0}, (0.6534224235967255, -17.328878820163702)),
    ("lammps-classic-2025", CLASSIC_HOOKE, {"k_t": 2e9, "xt": 0.1}, (0.7175790955746306, -14.121045221268464)),
    ("lammps-classic-2025", CLASSIC_HOOKE, {"k_t": 2e7, "xt": 0.5}, (0.626538088605045, -18.673095569747733)),
    ("lammps-classic-2025", CLASSIC_HERTZ, {"k_t": 8e8}, (0.5860993731371921, -20.695031343140396)),
]
SOLREF, CONE = "mujoco-solref-direct", "mujoco-elliptic"
# so stiff that the indentation is a ten-millionth of the radius, which is then the lever arm
STIFF = 1.0 / (1e-7 * 0.05)
# u1, mu, the parameters of the cone, and v1, u1 and omega1 after the impact by MuJoCo 4.0.0
BY_MUJOCO = [
    (1.0, 0.5, {}, (-0.7485100766704116, 0.8650182177976603, -6.749088916013032)),
    (-3.0, 0.1, {}, (-0.7509110022969537, -2.8249088997703042, 8.754554731520887)),
    (1.0, 0.5, {"b_t": 0.5 * STIFF, "impratio": 3.0, "impedance": 0.6},
     (-0.7394711221128126, 0.7375540964602079, -13.12229482644479)),
    (-3.0, 0.1, {"b_t": 0.5 * STIFF, "impratio": 3.0, "impedance": 0.6},
     (-0.7611465953487432, -2.823885340465126, 8.80573272224132)),
]  # fmt: skip
# inputs, and v1, u1 and omega1 after the impact by Kratos 10.4.4; the dashpot of the first turns a spring that is
# beyond its limit, and the ratio of the second is found by Kratos to 1e-4
BY_KRATOS = [
    ("kratos-hertz", {"e": 0.2, "mu": 1.0, "u1": 2.75, "steps_per_contact": 6, "phase": 0.1},
     (-0.15436224917916147, 1.9008281705263241, -42.45817096045887)),
    ("kratos-hertz", {"e": 0.7, "u1": 1.0} | STEP, (-0.6972116521589995, 0.708957120885341, -14.55172321405081)),
    ("kratos-linear", {"e": 0.7, "u1": 1.0} | STEP, (-0.7003235304133743, 0.6667266265724976, -16.66362894704565)),
]  # fmt: skip


@pytest.mark.filterwarnings("ignore::impact.ImpactWarning")
@pytest.mark.parametrize(("model", "inputs", "expected"), BY_KRATOS)
def test_kratos_delivered_these_velocities(
    model: str, inputs: dict[str, float], expected: tuple[float, float, float]
) -> None:
    result = sweep(model, "kratos-viscous-coulomb", {}, inputs | {"material": "hard"}, "kick-drift")
    delivered = [float(result[name].squeeze()) for name in ("v1_post", "u1_post", "omega1_post")]
    assert delivered == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::impact.ImpactWarning")
@pytest.mark.parametrize(("friction", "model", "values", "expected"), BY_LAMMPS)
def test_lammps_delivered_these_velocities(
    friction: str, model: str, values: dict[str, float], expected: tuple[float, float]
) -> None:
    result = sweep(model, friction, values, INPUTS[model] | STEP, "kick-drift")
    delivered = [float(result[name].squeeze()) for name in ("u1_post", "omega1_post")]
    assert delivered == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("u1", "mu", "values", "expected"), BY_MUJOCO)
def test_mujoco_delivered_these_velocities(
    u1: float, mu: float, values: dict[str, float], expected: tuple[float, float, float]
) -> None:
    inputs = {"k": STIFF**2, "b": 0.2 * STIFF, "mu": mu, "u1": u1}
    result = sweep(SOLREF, CONE, values, inputs | STEP, "mujoco-cone")
    delivered = [float(result[name].squeeze()) for name in ("v1_post", "u1_post", "omega1_post")]
    assert delivered == pytest.approx(expected, rel=1e-6)


def cone(
    u1: float,
    omega1: float,
    mu: float,
    h: float,
    phase: float,
    k: float,
    b: float,
    b_t: float,
    d: float,
    ratio: float,
    shortening: float = 0.0,
) -> tuple[float, float, float]:
    """A solid sphere of unit mass on a plane, as MuJoCo moves it; its lever arm is R, or R - shortening x."""
    x, u, R = phase * h, 1.0, WALL["R1"]
    while x > 0.0:
        arm = R - shortening * x
        g = u1 + arm * omega1
        a_n, a_t = (k * x + b * u) / d, b_t * abs(g) / d
        A_n, A_t = 1.0 / d, 1.0 + arm**2 / (0.4 * R**2) + (1.0 - d) / (d * ratio)
        f_n, f_t = a_n / A_n, a_t / A_t
        if f_t > mu * f_n:
            f_n = max(0.0, (a_n + mu * a_t) / (A_n + mu * mu * A_t))
            f_t = mu * f_n
        push = math.copysign(f_t, g) * h
        u, u1, omega1 = u - h * f_n, u1 - push, omega1 - push * arm / (0.4 * R**2)
        x += h * u
    return u, u1, omega1


def test_the_cone_is_that_of_a_plain_loop() -> None:
    axes = {
        "mu": [0.0, 0.1, 0.5], "u1": [-3.0, 0.2, 1.0], "omega1": [-10.0, 0.0, 25.0], "dt": [1e-3, 2e-3],
        "phase": [0.125, 0.7], "friction.mujoco-elliptic.impratio": [0.2, 1.0, 5.0],
    }  # fmt: skip
    k, b, b_t, d = 1e4, 30.0, 80.0, 0.6
    inputs = {name: value for name, value in axes.items() if "." not in name} | {"k": k, "b": b}
    values = {"b_t": b_t, "impedance": d, "impratio": axes["friction.mujoco-elliptic.impratio"]}
    result = sweep(SOLREF, CONE, values, inputs, "mujoco-cone")
    ours = [result[name].squeeze().transpose(*axes).values for name in ("v1_post", "u1_post", "omega1_post")]
    theirs = [
        cone(u1, omega1, mu, h, phase, k, b, b_t, d, ratio)
        for mu, u1, omega1, h, phase, ratio in itertools.product(*axes.values())
    ]
    np.testing.assert_allclose(np.stack(ours, axis=-1).reshape(-1, 3), theirs, rtol=1e-12, atol=1e-11)
    separate = sweep(SOLREF, CONE, values, inputs, "mujoco-cone", {"collapse": False})
    assert (separate.v1_post.transpose(*result.v1_post.dims).values == result.v1_post.values).all()
    # the restitution depends on friction, but not that without it
    assert float(result.e_out.max()) > 1.2 * float(result.e_out.min())
    assert float(result.e_out.sel(mu=0.0).std("u1").max()) == 0.0


def test_the_cone_without_friction_is_the_scheme_kick_drift() -> None:
    inputs = {"k": 1e4, "b": 30.0, "steps_per_contact": [12.0, 31.0], "phase": [0.2, 0.8]}
    result = sweep(SOLREF, CONE, {}, inputs | {"mu": 0.0}, "mujoco-cone")
    for scheme in ("kick-drift", "mujoco-cone"):
        config = {"models": SOLREF, "model": {SOLREF: {"k": 1e4, "b": 30.0}}, "solver": {"integrator": scheme}}
        central = {name: value for name, value in (WALL | inputs).items() if name not in ("angle", "mu", "k", "b")}
        assert (impact.sweep(config | {"sweep": central}).e_out.values == result.e_out.values).all()


@pytest.mark.parametrize(
    ("friction", "scheme"),
    [("lammps-classic-2025", "kick-drift"), ("kratos-viscous-coulomb", "kick-drift"), (CONE, "mujoco-cone")],
)
def test_a_friction_law_of_a_scheme_has_no_continuous_answer(friction: str, scheme: str) -> None:
    message = (
        f"the friction law {friction} is that of a scheme, without a continuous answer, expected solver.integ"
    )
    with pytest.raises(ConfigError, match=f'{message}rator = "{scheme}"'):
        sweep(SOLREF, friction, {"k_t": 1e9} if "lammps" in friction else {}, {"k": 1e4, "b": 30.0}, "exact")


def test_a_pattern_does_not_select_a_friction_law_of_a_scheme() -> None:
    for selection, one in (("lammps-*", "lammps-mindlin"), ("all", "coulomb-1785")):
        keys = [law.key for law in expand_laws(selection, frictions(), "friction law")[0]]
        assert one in keys
        assert not {"lammps-classic-2025", CONE} & {*keys}
    named, _ = expand_laws(["lammps-classic-2025", "mujoco-*"], frictions(), "friction law")
    assert [law.key for law in named] == ["lammps-classic-2025", CONE]


def test_timestep_has_the_restitution_of_the_cone() -> None:
    inputs = {"k": 1e4, "b": 60.0, "v1": 1.0, "mu": 0.5, "angle": "80 deg", "impratio": 4.0}
    result = impact.timestep(SOLREF, at=inputs, friction=CONE, steps_per_contact=[12], phases=2)
    of_sweep = {"k": 1e4, "b": 60.0, "mu": 0.5, "angle": "80 deg", "steps_per_contact": 12, "phase": [0.25, 0.75]}
    swept = sweep(SOLREF, CONE, {"impratio": 4.0}, of_sweep | {"m2": 1.0, "R2": 0.05}, "mujoco-cone")
    assert result.scheme == "mujoco-cone"
    (row,) = result.rows
    assert row.e_mean == pytest.approx(float(swept.e_out.mean()), rel=1e-12)
    assert row.beta_mean == pytest.approx(float(swept.beta.mean()), rel=1e-12)
    assert math.isnan(result.beta_continuous)
    assert row.e_mean > 1.1 * result.e_continuous


@pytest.mark.slow
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


def test_psi1_does_not_depend_on_the_step_and_psi2_is_the_slip_in_its_unit() -> None:
    config: dict[str, Any] = {
        "models": HERTZ,
        "frictions": "lammps-mindlin",
        "sweep": WALL | INPUTS[HERTZ],
        "materials": MATERIALS,
        "output": {"variables": ["psi1", "psi2", "beta"]},
    }
    exact = impact.sweep(config)
    at_step = impact.sweep(config | {"sweep": config["sweep"] | STEP, "solver": {"integrator": "kick-drift"}})
    assert at_step.psi1.item() == pytest.approx(exact.psi1.item(), rel=1e-12)
    assert at_step.psi2.item() == pytest.approx(-at_step.beta.item() * at_step.psi1.item(), rel=1e-12)


def test_the_steps_for_a_tolerance_are_said_to_be_those_of_e_alone() -> None:
    """Far from 2 % of beta, and from 0.24, that of the continuous law."""
    inputs = {"angle": "20 deg", "mu": 0.3, "e": 0.7, "v1": 1.0}
    result = impact.timestep(
        "tsuji-1992", at=inputs, friction="lammps-mindlin", tol=0.02, steps_per_contact=[16], phases=8
    )
    assert result.needed is not None
    assert result.needed.steps_per_contact == 16
    assert result.rows[0].beta_largest < -0.1 < 0.2 < result.beta_continuous
    assert str(result).splitlines()[-1].startswith("the tolerance is that of e alone")


@pytest.mark.parametrize(("friction", "notes"), [("lammps-mindlin", 1), ("lammps-mindlin-force", 0)])
def test_timestep_notes_a_limit_that_fixed_steps_reach_slowly(friction: str, notes: int) -> None:
    inputs = {"angle": "20 deg", "mu": 0.3, "e": 0.7, "v1": 1.0}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        impact.timestep("tsuji-1992", at=inputs, friction=friction, steps_per_contact=[16], phases=1)
    note = "beta is the limit of small steps, which a code with fixed steps reaches slowly"
    assert [str(warning.message) for warning in caught] == [f"tsuji-1992 with {friction}: {note}"] * notes


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


@pytest.mark.parametrize(
    ("scheme", "model"),
    [
        ("kick-drift", "newton-semi-implicit"),
        ("drake-tamsi", "drake-point-contact"),
        ("pybullet", "kelvin-voigt-no-tension"),
    ],
)
def test_coulomb_friction_slides_by_the_impulse_of_the_restitution_of_the_scheme(scheme: str, model: str) -> None:
    """And stops the slip where that is enough."""
    damping = {"drake-point-contact": "d", "kelvin-voigt-no-tension": "C", "newton-semi-implicit": "kd"}[model]
    angles = [40.0, 80.0]
    step = {"steps_per_contact": 12, "phase": 0.3, "angle": [f"{angle} deg" for angle in angles], "mu": 0.3}
    config = {
        "models": model,
        "frictions": "coulomb-1785",
        "sweep": {**WALL, **step, "K": 1e6, "n": 1.0},
        "model": {model: {damping: 0.5 if damping == "d" else 300.0}},
        "solver": {"integrator": scheme},
    }
    result = impact.sweep(config)
    e_out, g0 = float(result.e_out.squeeze().max()), np.tan(np.radians(angles))
    assert e_out < 0.9
    # (7/2) mu (1 + e_out) v0 of a solid sphere that slides
    expected = np.maximum(g0 - 3.5 * 0.3 * (1.0 + e_out), 0.0)
    assert expected[0] == 0.0
    np.testing.assert_allclose(result.slip_post.squeeze(), expected, rtol=1e-12)


def test_coulomb_friction_of_a_contact_force_that_pulls_slides_by_the_sum_of_its_size() -> None:
    """As docs/timestep.md says, with N of each step: for |F| more than by the impulse of the restitution."""
    e, h, mu = 0.3, 0.05, 0.01
    step = {"m2": math.inf, "R1": 0.05, "m1": 1.0, "K": 1.0, "n": 1.0, "v1": 1.0, "dt": h, "phase": 0.5}
    zeta = -math.log(e) / math.hypot(math.pi, math.log(e))
    x, u, pressing, pulling = 0.5 * h, 1.0, 0.0, 0.0
    while x > 0.0:
        force = x + 2.0 * zeta * u
        pressing, pulling = pressing + h * max(force, 0.0), pulling + h * max(-force, 0.0)
        u -= h * force
        x += h * u
    assert pulling > 0.1
    for limit, impulse in (("abs", pressing + pulling), ("positive", pressing)):
        result = impact.sweep(
            {
                "models": "anagnostopoulos-1988",
                "frictions": "coulomb-1785",
                "friction": {"coulomb-1785": {"limit": limit}},
                "sweep": step | {"e": e, "mu": mu, "u1": 1.0},
                "solver": {"integrator": "kick-drift"},
            }
        )
        assert result.slip_post.item() == pytest.approx(1.0 - 3.5 * mu * impulse, rel=1e-13)


@pytest.mark.parametrize(
    ("scheme", "friction", "expected"),
    [
        ("kick-drift", "drake-regularized", "coulomb-1785 or one with a spring or a dashpot, such as cundall-"),
        ("kick-drift", CONE, "coulomb-1785 or one with a spring or a dashpot"),
        ("pybullet", "cundall-strack-1979", "coulomb-1785"),
        ("mujoco-cone", "lammps-classic-2025", CONE),
        ("drake-sap", "coulomb-1785", "none: friction changes the restitution that it delivers"),
    ],
)
def test_a_scheme_refuses_friction_of_which_no_code_was_run(scheme: str, friction: str, expected: str) -> None:
    models = {"kick-drift": LINEAR, "mujoco-cone": "mujoco-solref"}
    with pytest.raises(
        ConfigError, match=f'scheme "{scheme}" does not take the friction law {friction}, expected {expected}'
    ):
        sweep(models.get(scheme, "kelvin-voigt-no-tension"), friction, {}, HOOKE | STEP, scheme)


@pytest.mark.slow
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
    # a line of the printed table for each row of the result
    lines = [line.split() for line in str(result).splitlines()]
    for row in result.rows:
        (cells,) = (line for line in lines if line[:1] == [f"{row.steps_per_contact:g}"])
        assert [*map(float, cells[-3:])] == pytest.approx(
            [row.beta_mean, row.beta_least, row.beta_largest], rel=1e-3
        )
    central = impact.timestep(LINEAR, at={**HOOKE, "v1": 1.0}, steps_per_contact=[12], phases=4).as_dict()
    assert "friction" not in central
    assert "beta_mean" not in central["rows"][0]


def test_timestep_without_friction_is_smooth_and_refuses_what_its_scheme_does_not_take() -> None:
    inputs = {**HOOKE, "v1": 1.0, "mu": 0.0, "angle": "45 deg", "friction.cundall-strack-1979.k_t": 3e5}
    (row,) = impact.timestep(LINEAR, at=inputs, friction="cundall-strack-1979", steps_per_contact=[12]).rows
    assert row.beta_mean == -1.0
    with pytest.raises(UsageError, match='scheme "kick-drift" does not take the friction law drake-regularized'):
        impact.timestep("hertz", at={"mu": 0.3, "angle": "45 deg"}, friction="drake-regularized")


def test_timestep_says_what_a_friction_law_lacks_with_a_contact_force() -> None:
    inputs = {**HOOKE, "mu": 0.3, "angle": "45 deg"}
    message = rf"{LINEAR} with lammps-mindlin: 8 G\* a needs a contact force of n = 1.5; set k_t"
    with pytest.raises(ConfigError, match=message):
        impact.timestep(LINEAR, at=inputs, friction="lammps-mindlin")


def test_a_contact_at_fixed_steps_sticks_slips_or_does_both() -> None:
    config = {
        "models": SOLREF,
        "model": {SOLREF: {"k": STIFF**2, "b": 0.2 * STIFF}},
        "frictions": CONE,
        "sweep": {name: value for name, value in WALL.items() if name != "angle"}
        | {"mu": [0.1, 0.6, 5.0], "u1": -3.0}
        | STEP,
        "solver": {"integrator": "mujoco-cone"},
        "output": {"variables": ["contact_regime", "slip_changes"]},
    }
    result = impact.sweep(config)
    assert result["contact_regime"].values.ravel().tolist() == [2, 3, 1]
    # the first mode is no change
    assert result["slip_changes"].values.ravel().tolist() == [0, 1, 0]
