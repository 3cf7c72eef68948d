"""At the default tolerance restitutions are within 1e-9 of their closed forms, and other outputs within 1e-8."""

import functools
import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import impact
from impact.config.tables import DEFAULT_RTOL
from impact.contact import motion
from impact.contact.closed_forms.hysteresis import peak_indentation
from impact.contact.impacts import Impacts
from impact.contact.models import find
from impact.contact.models.hysteresis import hysteresis
from impact.contact.output_formulas import Outputs, collide
from impact.contact.records import CollisionResult
from impact.contact.simulate import integrate_collisions
from impact.contact.status import Status
from impact.contact.velocity_coordinates import STRONG_DAMPING

from .problems import (
    LAWS,
    contact_time_ratio,
    damped_peak_indentation,
    hysteresis_reference,
    table1_impacts,
    with_parameters,
)

EXPONENTS = (1.0, 1.3, 1.5, 2.0, 3.0)
E_GRID = np.unique([*np.geomspace(0.001, 0.1, 60), *np.linspace(0.05, 1.0, 191)])
LAWS_AND_EXPONENTS = [(key, n) for key in LAWS for n in EXPONENTS if find(key).exponent in (None, n)]
# these are tested with all exponents, other laws with one; the rest are slow tests
WITH_EACH_EXPONENT = {"hertz", "hunt-crossley-1975", "gharib-hurmuzlu-2012", "gharib-hurmuzlu-2012-energetic"}
PERMANENT = [(key, n) for key, n in LAWS_AND_EXPONENTS if find(key).family == "permanent"]
UNDAMPED = [(key, n) for key, n in LAWS_AND_EXPONENTS if find(key).family in ("permanent", "elastic")]

# a law of the hysteresis family with any damping ratio: e from 0 to 1 gives χ from 0 to 1000
ANY_CHI = hysteresis("any-chi", title="", year=2026, equation="χ = 1000 e", reference="", chi=lambda e: 1e3 * e)
CHI = (
    0.05,
    0.3,
    1.0,
    1.9,
    STRONG_DAMPING["log"],
    float(np.nextafter(STRONG_DAMPING["log"], 9.0)),
    10.0,
    100.0,
    1e3,
)


def outputs_of(model, impacts: Impacts) -> Outputs:
    return collide(model, impacts, rtol=DEFAULT_RTOL, max_steps=100_000)


@functools.cache
def sweep_e(key: str, n: float) -> tuple[Impacts, Outputs]:
    # gamma of Ismail and Stronge is 1/e, the damping parameters of other laws fall from 1.1 to 0.1
    values = 1.0 / E_GRID - 1.0 if key == "ismail-stronge-2008" else 1.1 - E_GRID
    impacts = with_parameters(find(key), table1_impacts(n, e=E_GRID), values)
    return impacts, outputs_of(find(key), impacts)


def max_abs(values: np.ndarray) -> float:
    return float(np.max(np.abs(values)))


def is_slow(key: str, n: float) -> bool:
    model = find(key)
    return model.family == "codes" or (n not in (model.exponent, 1.5) and key not in WITH_EACH_EXPONENT)


@pytest.mark.parametrize(
    ("key", "n"),
    [
        pytest.param(key, n, marks=pytest.mark.slow) if is_slow(key, n) else (key, n)
        for key, n in LAWS_AND_EXPONENTS
    ],
)
def test_restitution_is_within_1e_9_of_its_closed_form_and_work_balances_energy(key, n):
    impacts, outputs = sweep_e(key, n)
    assert np.all(outputs["status"] == Status.OK)
    if find(key).oracle is None:
        assert np.all(np.isnan(outputs["closed_form_error"]))
    else:
        assert max_abs(outputs["closed_form_error"]) <= 1e-9
    assert max_abs(outputs["energy_residual"]) <= 10 * DEFAULT_RTOL
    # the residual measures the error of the integration: it grows with the tolerance
    loose = collide(find(key), impacts, rtol=1e4 * DEFAULT_RTOL, max_steps=10_000)
    assert max_abs(loose["energy_residual"]) > 100 * max_abs(outputs["energy_residual"])


@pytest.mark.parametrize(("key", "n"), UNDAMPED)
def test_peak_indentation_and_force_of_an_undamped_approach_agree_with_their_closed_forms(key, n):
    impacts, outputs = sweep_e(key, n)
    peak = peak_indentation(impacts.m, impacts.v0, impacts.K, n)
    assert max_abs(outputs["peak_indentation"] / peak - 1.0) <= 1e-8
    assert max_abs(outputs["peak_force"] / (impacts.K * peak**n) - 1.0) <= 1e-8


@pytest.mark.parametrize(("key", "n"), UNDAMPED)
def test_the_time_of_an_undamped_contact_agrees_with_its_closed_form(key, n):
    # unloading is the elastic motion, faster by 1/e and shorter by e², so that it lasts e times the approach
    impacts, outputs = sweep_e(key, n)
    elastic = contact_time_ratio(n) * peak_indentation(impacts.m, impacts.v0, impacts.K, n) / impacts.v0
    fraction = (1.0 + E_GRID) / 2.0 if find(key).family == "permanent" else 1.0
    assert max_abs(outputs["contact_time"] / (fraction * elastic) - 1.0) <= 1e-8


@pytest.mark.parametrize(("key", "n"), PERMANENT)
def test_permanent_indentation_agrees_with_its_closed_form(key, n):
    impacts, outputs = sweep_e(key, n)
    peak = peak_indentation(impacts.m, impacts.v0, impacts.K, n)
    assert max_abs(outputs["permanent_indentation"] / peak - (1.0 - E_GRID * E_GRID)) <= 1e-8


@pytest.mark.parametrize("A", np.geomspace(1e-12, 1e-5, 8).tolist())
def test_a_contact_ends_at_zero_force_however_weak_the_damping(A: float) -> None:
    """K δ^(3/2) + (3/2) A K δ^(1/2) δ̇ vanishes at δ = (3/2) A e_out v0; before, it pulls."""
    law, balls = "kuwabara-kono-1987", {"K": 1e6, "m1": 1.0, "m2": 1.0, "v1": 1.0}
    outputs, elastic = (impact.run(model=law, at={**balls, "A": value}).values for value in (A, 0.0))
    indentation = 1.5 * A * outputs["e_out"]
    assert outputs["permanent_indentation"] == pytest.approx(indentation, rel=1e-12)
    # it is linear in a weak damping
    strong = impact.run(model=law, at={**balls, "A": 1e-5}).values["contact_time"]
    shorter, slope = elastic["contact_time"] - outputs["contact_time"], (elastic["contact_time"] - strong) / 1e-5
    assert shorter == pytest.approx(slope * A, rel=0.01, abs=1e-9 * elastic["contact_time"])


@pytest.mark.parametrize("K", [1e3, 1e9, 1e15])
def test_a_contact_ends_at_zero_force_where_another_stiffness_than_K_counts(K: float) -> None:
    """k δ + b δ̇ vanishes at δ = b e_out v0/k, whatever the K of other laws is."""
    law = "mujoco-solref-direct"
    at = {"K": K, "m1": 1.0, "m2": 1.0, "R1": 10.0, "v1": 1.0, f"{law}.k": 100.0, f"{law}.b": 1e-4}
    outputs = impact.run(model=law, at=at).values
    assert outputs["permanent_indentation"] == pytest.approx(1e-6 * outputs["e_out"], rel=1e-12)


def test_a_history_ends_where_the_contact_does() -> None:
    law, balls = "kuwabara-kono-1987", {"K": 1e6, "m1": 1.0, "m2": 1.0, "v1": 1.0}
    impact_run = impact.run(model=law, at={**balls, "A": 1e-7})
    history, outputs = impact_run.history, impact_run.values
    assert history["t"].values[-1] == pytest.approx(outputs["contact_time"], rel=1e-12)
    assert history["delta"].values[-1] == pytest.approx(outputs["permanent_indentation"], rel=1e-5)
    # the force pulls nowhere
    assert history["F"].values.min() >= -1e-12 * history["F"].values.max()


@pytest.mark.parametrize("law", ["lammps-viscoelastic-hooke-limit", "lammps-viscoelastic-hertz-limit"])
def test_a_force_that_pulls_in_a_part_of_a_long_step_ends_the_contact(law: str) -> None:
    config = {
        "models": law,
        "sweep": {"v1": 1.0, "m1": 1.0, "R1": 1.0, "m2": math.inf, "R2": math.inf},
        "model": {law: {"K": 1.0, "eta": {"geomspace": [1e-2, 0.5, 100]}}},
    }
    exact, *results = (impact.sweep(config | {"solver": {"rtol": rtol}}) for rtol in (1e-12, 1e-9, 1e-6, 1e-5))
    for result in results:
        bound = 10 * result.attrs["rtol"]
        for name in ("e_out", "contact_time"):
            assert result[name].values == pytest.approx(exact[name].values, rel=bound)
        assert np.abs(result["energy_residual"].values).max() <= bound


@functools.cache
def sweep_chi(n: float) -> tuple[Impacts, Outputs]:
    impacts = table1_impacts(n, e=np.array(CHI) / 1e3)
    return impacts, outputs_of(ANY_CHI, impacts)


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("index", range(len(CHI)), ids=map(str, CHI))
def test_damped_contact_agrees_with_quadrature(index, n):
    impacts, outputs = sweep_chi(n)
    chi, length, v0 = outputs["damping_ratio"][index], impacts.length[index], impacts.v0[index]
    e_out, time, force = hysteresis_reference(chi, n)
    assert outputs["e_out"][index] == pytest.approx(e_out, rel=0, abs=1e-9)
    assert outputs["contact_time"][index] * v0 / length == pytest.approx(time, rel=1e-8)
    assert outputs["peak_force"][index] * length / (impacts.m[index] * v0**2) == pytest.approx(force, rel=1e-8)
    peak = float(damped_peak_indentation(chi, n))
    assert outputs["peak_indentation"][index] / length == pytest.approx(peak, rel=1e-8)


@pytest.mark.parametrize("key", ["gharib-hurmuzlu-2012", "exact-hysteresis"])
def test_extreme_damping_is_accurate_and_not_stiff(key):
    outputs = outputs_of(find(key), table1_impacts(e=[1e-6, 0.1]))
    assert np.all(outputs["status"] == Status.OK)
    assert outputs["e_out"][0] == pytest.approx(1e-6, rel=1e-9)
    assert max_abs(outputs["energy_residual"]) <= 10 * DEFAULT_RTOL
    assert outputs["steps"][0] <= 3 * outputs["steps"][1]
    impacts = table1_impacts(e=[1e-6, 0.1])
    for index in range(2):
        _, time, force = hysteresis_reference(outputs["damping_ratio"][index], 1.5)
        length, v0 = impacts.length[index], impacts.v0[index]
        assert outputs["contact_time"][index] * v0 / length == pytest.approx(time, rel=1e-8)
        assert outputs["peak_force"][index] * length / (impacts.m[index] * v0**2) == pytest.approx(force, rel=1e-8)


def exact_peak_force(chi: float, n: float) -> float:
    """Peak force of F = xⁿ (1 + χ v) with m = v₀ = 1: x^(n+1)/(n+1) is the integral of v/(1 + χ v) up to v = 1."""

    def force(v: float) -> float:
        work = (1.0 - v) / chi - np.log((1.0 + chi) / (1.0 + chi * v)) / chi**2
        return float(((n + 1.0) * work) ** (n / (n + 1.0)) * (1.0 + chi * v))

    minimum = minimize_scalar(lambda v: -force(v), bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-10})
    return force(float(minimum.x))


@pytest.mark.parametrize(
    ("n", "rtol", "bound"), [(1.5, DEFAULT_RTOL, 1e-9), (1.0, DEFAULT_RTOL, 1e-9), (1.5, 1e-6, 1e-5)]
)
def test_the_peak_force_is_located_between_the_ends_of_steps(n, rtol, bound):
    # many values, because the distance of the peak from the end of a step depends on where the steps end
    e = np.linspace(0.02, 0.999, 600)
    impacts = table1_impacts(n, e=e)
    outputs = collide(find("hunt-crossley-1975"), impacts, rtol=rtol, max_steps=10_000)
    ratio = outputs["peak_force"] * impacts.length / (impacts.m * impacts.v0**2)
    exact = np.array([exact_peak_force(chi, n) for chi in outputs["damping_ratio"].tolist()])
    assert np.abs(ratio / exact - 1.0).max() <= bound


@functools.cache
def integrate_in_coordinate(log: bool) -> CollisionResult:
    chi = np.geomspace(0.05, 50.0, 60)
    law = motion.MotionLaw.of(ANY_CHI, 1.5, log)
    assert law.names == ("chi",)
    return integrate_collisions(law, (chi,), chi.size, rtol=DEFAULT_RTOL, max_steps=100_000)


@pytest.mark.parametrize("name", ["e_out", "peak", "force", "contact_time", "approach_work", "restitution_work"])
def test_both_velocity_coordinates_agree(name):
    plain, log = (getattr(integrate_in_coordinate(is_log), name) for is_log in (False, True))
    assert not np.array_equal(plain, log)
    # works are in units of the initial energy, and may be close to zero
    scale = 1.0 if name.endswith("work") else log
    assert max_abs((plain - log) / scale) <= 10 * DEFAULT_RTOL


@pytest.mark.parametrize(
    "key", ["hertz", "lankarani-nikravesh-1990", "gharib-hurmuzlu-2012", "bilinear", "exact-dashpot-no-tension"]
)
def test_the_error_is_below_the_tolerance_and_decreases_with_it(key):
    impacts = table1_impacts(find(key).exponent or 1.5, e=np.linspace(0.05, 1.0, 40))
    tolerances = np.array([1e-5, 1e-7, 1e-9, 1e-11])
    errors = [
        max_abs(collide(find(key), impacts, rtol=rtol, max_steps=100_000)["closed_form_error"])
        for rtol in tolerances
    ]
    assert np.all(errors < tolerances), errors
    assert np.all(np.diff(errors) < 0.0), errors
