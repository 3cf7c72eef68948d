"""The schemes of Drake's discrete solvers: a backward Euler step of the law's own force, clamped at zero."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

import impact
from impact.contact.fixed_step import LAWS_OF_SCHEME, collide_at_fixed_step, default_scheme, has_scheme
from impact.contact.models import catalogue, find
from impact.contact.status import Status
from impact.errors import ConfigError, UsageError

from .conftest import Run, assert_refused

POINT, LINEAR = "drake-point-contact", "kelvin-voigt-no-tension"
BALLS = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0}


def tamsi_force(x: float, u: float, chi: float) -> float:
    return max(0.0, x) * max(0.0, 1.0 + chi * u)


def sap_force(x: float, u: float, c: float) -> float:
    return max(0.0, x + c * u)


def step_by_step(force: Callable[..., float], damping: float, h: float, phase: float) -> float:
    """The restitution, from a plain loop that finds the velocity at the end of each step by bracketing."""
    x, u = phase * h, 1.0
    while x > 0.0:

        def imbalance(new: float, x: float = x, u: float = u) -> float:
            return new - u + h * force(x + h * new, new, damping)

        # at this velocity or below there is no force
        least = min(u, -x / h, -1.0 / damping) - 1.0
        u = float(brentq(imbalance, least, u, xtol=1e-16, rtol=1e-15)) if imbalance(u) > 0.0 else u
        x += h * u
    return -u


@pytest.mark.parametrize(
    ("scheme", "force", "model", "parameter"),
    [("drake-tamsi", tamsi_force, POINT, "d"), ("drake-sap", sap_force, LINEAR, "C")],
)
def test_the_loop_agrees_with_a_search_for_each_velocity_in_random_cases(
    scheme: str, force: Callable[..., float], model: str, parameter: str
) -> None:
    random = np.random.default_rng(20260725)
    count = 300
    damping, steps = 10.0 ** random.uniform(-3.0, 1.0, count), random.uniform(2.0, 80.0, count)
    h, phase = np.pi / steps, random.uniform(1e-3, 1.0, count)
    result = collide_at_fixed_step(find(model), 1.0, {parameter: damping}, h, phase, 10**6, scheme)
    expected = [step_by_step(force, *case) for case in zip(damping, h, phase, strict=True)]
    worst = np.max(np.abs(result.e_out - expected))
    print(scheme, "worst difference", worst)
    assert worst < 1e-12
    assert (result.status == Status.OK).all()


@pytest.mark.parametrize(("steps", "mean"), [(20, 0.722), (100, 0.859)])
def test_tamsi_asked_for_nine_tenths_gives_less(steps: int, mean: float) -> None:
    solved = impact.solve(POINT, "d", {"e_out": 0.9}, at=BALLS)
    at = BALLS | {f"{POINT}.d": solved.roots[0].value}
    result = impact.timestep(POINT, at=at, steps_per_contact=[steps])
    assert result.scheme == "drake-tamsi"
    assert result.e_continuous == pytest.approx(0.9, abs=1e-8)
    assert result.rows[0].e_mean == pytest.approx(mean, abs=5e-4)


@pytest.mark.parametrize(
    ("model", "at", "scheme"),
    [(POINT, {"d": 0.3}, "drake-tamsi"), (LINEAR, {"C": 200.0}, "drake-sap")],
)
def test_the_error_of_the_mean_is_of_first_order(model: str, at: dict[str, float], scheme: str) -> None:
    inputs = BALLS | {f"{model}.{name}": value for name, value in at.items()}
    result = impact.timestep(model, at=inputs, steps_per_contact=[400, 800], phases=40, scheme=scheme)
    errors = [result.e_continuous - row.e_mean for row in result.rows]
    assert 0.0 < errors[1] < 0.02
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["drake-tamsi", "drake-sap"])
def test_small_steps_give_the_continuous_law_for_every_law_that_a_scheme_takes(scheme: str) -> None:
    keys = [
        key
        for key, law in catalogue().items()
        if has_scheme(law, law.exponent or 1.0, scheme)
        and all(parameter.default is not None for parameter in law.parameters)
    ]
    materials = {"ball": {"E": 1e9, "nu": 0.3, "rho": 1000.0}}
    sweep = BALLS | {"e": 0.8, "material": "ball"}
    config: dict[str, object] = {"models": keys, "sweep": sweep, "materials": materials}
    if scheme == "drake-tamsi":
        config["model"] = {POINT: {"d": 0.3}, f"{POINT}-mixed": {"d1": 0.3, "d2": 0.1}}
    exact = impact.sweep(config)["e_out"]
    fixed = {"steps_per_contact": 2000}
    fine = impact.sweep(config | {"sweep": sweep | fixed, "solver": {"integrator": scheme}})["e_out"]
    assert len(keys) > 8
    np.testing.assert_allclose(fine, exact, atol=5e-3)


def test_an_unloading_branch_is_not_taken_by_a_scheme_of_drake() -> None:
    laws = [law for law in catalogue().values() if law.unloading is not None]
    assert any(law.velocity_coordinate == "log" for law in laws)
    assert not any(has_scheme(law, 1.0, scheme) for law in laws for scheme in LAWS_OF_SCHEME)


@pytest.mark.parametrize(
    ("scheme", "model", "parameter"), [("drake-tamsi", POINT, "d"), ("drake-sap", LINEAR, "C")]
)
def test_a_collision_without_end_or_without_numbers_has_a_status(scheme: str, model: str, parameter: str) -> None:
    damping, step = np.array([1.0, 1.0, np.nan]), np.array([1e-4, 0.1, 0.1])
    limits = np.array([100, 1000, 1000])
    result = collide_at_fixed_step(find(model), 1.0, {parameter: damping}, step, np.full(3, 0.5), limits, scheme)
    assert result.status.tolist() == [Status.NOT_SEPARATED, Status.OK, Status.NOT_FINITE]
    assert np.isfinite(result.e_out).tolist() == [False, True, False]


def test_only_laws_of_drake_have_a_scheme_of_drake_by_default() -> None:
    schemes = {key: default_scheme(model) for key, model in catalogue().items()}
    assert {key for key, scheme in schemes.items() if scheme == "drake-tamsi"} == {POINT, f"{POINT}-mixed"}
    assert set(schemes.values()) == {"kick-drift", "drake-tamsi"}


def test_a_sweep_has_the_schemes_of_drake() -> None:
    config = {
        "models": LINEAR,
        "sweep": BALLS | {"steps_per_contact": [12.0, 30.0], "phase": [0.125, 0.375, 0.625, 0.875]},
        "model": {LINEAR: {"C": 200.0}},
        "solver": {"integrator": "drake-sap"},
    }
    swept = impact.sweep(config)["e_out"].isel(model=0).mean("phase")
    predicted = impact.timestep(
        LINEAR, at=BALLS | {f"{LINEAR}.C": 200.0}, steps_per_contact=[12, 30], phases=4, scheme="drake-sap"
    )
    np.testing.assert_allclose(swept, [row.e_mean for row in predicted.rows], rtol=1e-9)


def test_the_command_has_the_scheme(cli: Run) -> None:
    done = cli(
        "timestep", "--model", LINEAR, "--at", "n=1", "--at", f"{LINEAR}.C=100", "--scheme", "drake-sap", "--json"
    )
    assert '"scheme": "drake-sap"' in done.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("hertz", "--scheme", "drake-tamsi"),
            'scheme "drake-tamsi" does not take hertz, expected a law F = K δ (1',
        ),
        (
            ("hunt-crossley-1975", "--scheme", "drake-tamsi"),
            'scheme "drake-tamsi" does not take hunt-crossley-1975, expected a law F = K δ (1 + χ δ̇/v₀), n = 1',
        ),
        (
            ("kelvin-voigt", "--at", "kelvin-voigt.C=9", "--at", "n=1", "--scheme", "drake-sap"),
            "does not take kelvin-voigt, expected a law F = K δ + C δ̇ to F",
        ),
        ((POINT, "--scheme", "drake-sap"), f"does not take {POINT}, expected a law F = K δ + C δ̇ to F = 0"),
        (("hertz", "--scheme", "drake"), 'no scheme "drake"; did you mean "drake-sap"?'),
        (("drake-sap",), "such as kelvin-voigt-no-tension, beside --scheme drake-sap"),
        (("kick-drift",), 'got the scheme "kick-drift", expected a law such as hertz, beside --scheme kick-drift'),
    ],
)
def test_a_scheme_that_does_not_take_the_law_is_one_line(cli: Run, words: tuple[str, ...], message: str) -> None:
    assert_refused(cli("timestep", "--model", *words), message)


@pytest.mark.parametrize("n", [1.5, [1.0, 1.5]])
def test_a_sweep_of_a_law_that_the_scheme_does_not_take_is_a_config_error(n: object) -> None:
    config = {
        "models": ["hunt-crossley-1975", POINT],
        "sweep": BALLS | {"n": n, "e": 0.5, "steps_per_contact": 20},
        "solver": {"integrator": "drake-tamsi"},
    }
    with pytest.raises(
        ConfigError, match=r'solver\.integrator: scheme "drake-tamsi" does not take hunt-crossley-1975'
    ):
        impact.sweep(config)


@pytest.mark.slow
def test_a_hunt_crossley_law_with_n_1_is_taken() -> None:
    at = BALLS | {"e": 0.8}
    row = impact.timestep(
        "exact-hysteresis", at=at, steps_per_contact=[2000], phases=8, scheme="drake-tamsi"
    ).rows[0]
    assert row.e_mean == pytest.approx(0.8, abs=5e-3)
    assert math.isfinite(row.e_to_ask)


def test_a_scheme_refuses_a_law_in_the_loop_as_well() -> None:
    one = np.ones(1)
    with pytest.raises(UsageError, match="does not take hertz"):
        collide_at_fixed_step(find("hertz"), 1.5, {}, one, one, 10, "drake-sap")
