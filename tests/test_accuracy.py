"""At the default tolerance every law delivers its exact restitution to 1e-9, and its other outputs to 1e-8."""

import functools

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from impact.config.load import DEFAULT_RTOL
from impact.contact import motion
from impact.contact.closed_forms import contact_time_ratio, damped_peak_indentation, peak_indentation
from impact.contact.impacts import Impacts
from impact.contact.models import find
from impact.contact.models.hysteresis import hysteresis
from impact.contact.outputs import Outputs, collide
from impact.contact.simulate import RecordedCollision, integrate_phases
from impact.contact.status import Status
from impact.contact.velocity_coordinates import STRONG_DAMPING

from .problems import LAWS, hysteresis_reference, table1_impacts, with_parameters

EXPONENTS = (1.0, 1.3, 1.5, 2.0, 3.0)
E = np.unique([*np.geomspace(0.001, 0.1, 60), *np.linspace(0.05, 1.0, 191)])
CASES = [(key, n) for key in LAWS for n in EXPONENTS if find(key).exponent in (None, n)]
PERMANENT = [(key, n) for key, n in CASES if find(key).family == "permanent"]
UNDAMPED = [(key, n) for key, n in CASES if find(key).family in ("permanent", "elastic")]

# a law of the hysteresis family with any damping ratio: e from 0 to 1 is χ from 0 to 1000
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


def struck(model, lanes: Impacts) -> Outputs:
    return collide(model, lanes, rtol=DEFAULT_RTOL, max_steps=100_000)


@functools.cache
def over_e(key: str, n: float) -> tuple[Impacts, Outputs]:
    # the restitution of Ismail and Stronge is that of E, the damping of others falls from 1.1 to 0.1
    values = 1.0 / E - 1.0 if key == "ismail-stronge-2008" else 1.1 - E
    lanes = with_parameters(find(key), table1_impacts(n, e=E), values)
    return lanes, struck(find(key), lanes)


def worst(values: np.ndarray) -> float:
    return float(np.max(np.abs(values)))


@pytest.mark.parametrize(
    ("key", "n"),
    [
        pytest.param(key, n, marks=pytest.mark.slow) if find(key).family == "codes" else (key, n)
        for key, n in CASES
    ],
)
def test_restitution_is_exact_to_1e_9_and_work_balances_energy(key, n):
    lanes, contact = over_e(key, n)
    assert np.all(contact["status"] == Status.OK)
    if find(key).oracle is None:
        assert np.all(np.isnan(contact["closed_form_error"]))
    else:
        assert worst(contact["closed_form_error"]) <= 1e-9
    assert worst(contact["energy_residual"]) <= 10 * DEFAULT_RTOL
    # it measures the integration: a tolerance ten thousand times looser shows
    loose = collide(find(key), lanes, rtol=1e4 * DEFAULT_RTOL, max_steps=10_000)
    assert worst(loose["energy_residual"]) > 100 * worst(contact["energy_residual"])


@pytest.mark.parametrize(("key", "n"), UNDAMPED)
def test_undamped_approach_has_the_peak_and_force_of_its_closed_form(key, n):
    lanes, contact = over_e(key, n)
    peak = peak_indentation(lanes.m, lanes.v0, lanes.K, n)
    assert worst(contact["peak_indentation"] / peak - 1.0) <= 1e-8
    assert worst(contact["peak_force"] / (lanes.K * peak**n) - 1.0) <= 1e-8


@pytest.mark.parametrize(("key", "n"), UNDAMPED)
def test_undamped_contact_has_the_time_of_its_closed_form(key, n):
    # unloading is the elastic motion made faster by 1/e and shorter by e², so that it lasts e of the approach
    lanes, contact = over_e(key, n)
    elastic = contact_time_ratio(n) * peak_indentation(lanes.m, lanes.v0, lanes.K, n) / lanes.v0
    share = (1.0 + E) / 2.0 if find(key).family == "permanent" else 1.0
    assert worst(contact["contact_time"] / (share * elastic) - 1.0) <= 1e-8


@pytest.mark.parametrize(("key", "n"), PERMANENT)
def test_permanent_indentation_is_that_of_its_closed_form(key, n):
    lanes, contact = over_e(key, n)
    peak = peak_indentation(lanes.m, lanes.v0, lanes.K, n)
    assert worst(contact["permanent_indentation"] / peak - (1.0 - E * E)) <= 1e-8


@functools.cache
def over_chi(n: float) -> tuple[Impacts, Outputs]:
    lanes = table1_impacts(n, e=np.array(CHI) / 1e3)
    return lanes, struck(ANY_CHI, lanes)


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("place", range(len(CHI)), ids=map(str, CHI))
def test_damped_contact_agrees_with_quadrature(place, n):
    lanes, contact = over_chi(n)
    chi, length, v0 = contact["damping_ratio"][place], lanes.length[place], lanes.v0[place]
    e_out, time, force = hysteresis_reference(chi, n)
    assert contact["e_out"][place] == pytest.approx(e_out, rel=0, abs=1e-9)
    assert contact["contact_time"][place] * v0 / length == pytest.approx(time, rel=1e-8)
    assert contact["peak_force"][place] * length / (lanes.m[place] * v0**2) == pytest.approx(force, rel=1e-8)
    peak = float(damped_peak_indentation(chi, n))
    assert contact["peak_indentation"][place] / length == pytest.approx(peak, rel=1e-8)


@pytest.mark.parametrize("key", ["gharib-hurmuzlu-2012", "exact-hysteresis"])
def test_extreme_damping_is_accurate_and_not_stiff(key):
    contact = struck(find(key), table1_impacts(e=[1e-6, 0.1]))
    assert np.all(contact["status"] == Status.OK)
    assert contact["e_out"][0] == pytest.approx(1e-6, rel=1e-9)
    assert worst(contact["energy_residual"]) <= 10 * DEFAULT_RTOL
    assert contact["steps"][0] <= 3 * contact["steps"][1]
    lanes = table1_impacts(e=[1e-6, 0.1])
    for place in range(2):
        _, time, force = hysteresis_reference(contact["damping_ratio"][place], 1.5)
        length, v0 = lanes.length[place], lanes.v0[place]
        assert contact["contact_time"][place] * v0 / length == pytest.approx(time, rel=1e-8)
        assert contact["peak_force"][place] * length / (lanes.m[place] * v0**2) == pytest.approx(force, rel=1e-8)


def largest_force(chi: float, n: float) -> float:
    """Peak force of F = xⁿ (1 + χ v) with m = v₀ = 1: x^(n+1)/(n+1) is the integral of v/(1 + χ v) up to v = 1."""

    def force(v: float) -> float:
        work = (1.0 - v) / chi - np.log((1.0 + chi) / (1.0 + chi * v)) / chi**2
        return float(((n + 1.0) * work) ** (n / (n + 1.0)) * (1.0 + chi * v))

    found = minimize_scalar(lambda v: -force(v), bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-10})
    return force(float(found.x))


@pytest.mark.parametrize(
    ("n", "rtol", "bound"), [(1.5, DEFAULT_RTOL, 1e-9), (1.0, DEFAULT_RTOL, 1e-9), (1.5, 1e-6, 1e-5)]
)
def test_peak_force_is_found_between_the_steps_wherever_it_falls(n, rtol, bound):
    # many values, because it depends on where the steps end how far the peak is from one
    e = np.linspace(0.02, 0.999, 600)
    lanes = table1_impacts(n, e=e)
    contact = collide(find("hunt-crossley-1975"), lanes, rtol=rtol, max_steps=10_000)
    own = contact["peak_force"] * lanes.length / (lanes.m * lanes.v0**2)
    exact = np.array([largest_force(chi, n) for chi in contact["damping_ratio"].tolist()])
    assert np.abs(own / exact - 1.0).max() <= bound


@functools.cache
def in_coordinate(log: bool) -> RecordedCollision:
    chi = np.geomspace(0.05, 50.0, 60)
    law = motion.MotionLaw.of(ANY_CHI, 1.5, log)
    assert law.names == ("chi",)
    return integrate_phases(law, (chi,), chi.size, DEFAULT_RTOL, 100_000)


@pytest.mark.parametrize("name", ["e_out", "peak", "force", "contact_time", "approach_work", "restitution_work"])
def test_both_momentum_coordinates_agree(name):
    plain, log = (getattr(in_coordinate(which).result, name) for which in (False, True))
    assert not np.array_equal(plain, log)
    # the work is in units of the energy before, of which little is lost where the damping is small
    scale = 1.0 if name.endswith("work") else log
    assert worst((plain - log) / scale) <= 10 * DEFAULT_RTOL


@pytest.mark.parametrize(
    "key", ["hertz", "lankarani-nikravesh-1990", "gharib-hurmuzlu-2012", "bilinear", "exact-dashpot-no-tension"]
)
def test_the_error_is_below_the_tolerance_and_falls_with_it(key):
    lanes = table1_impacts(find(key).exponent or 1.5, e=np.linspace(0.05, 1.0, 40))
    tolerances = np.array([1e-5, 1e-7, 1e-9, 1e-11])
    errors = [
        worst(collide(find(key), lanes, rtol=rtol, max_steps=100_000)["closed_form_error"]) for rtol in tolerances
    ]
    assert np.all(errors < tolerances), errors
    assert np.all(np.diff(errors) < 0.0), errors
