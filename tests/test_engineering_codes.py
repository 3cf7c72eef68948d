"""Laws of engineering codes agree with numbers of the codes, with a second integrator and with closed forms."""

from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import impact
from impact.contact.closed_forms.dashpot import approach_restitution, force_restitution, limited_restitution
from impact.contact.closed_forms.hysteresis import delivered_restitution
from impact.contact.dimensionless import delivered
from impact.contact.models import find
from impact.contact.output_formulas import Outputs, collide
from impact.contact.rigid import velocities_after
from impact.contact.status import Status
from impact.errors import ConfigError

from .problems import table1_impacts

SPEEDS = np.geomspace(1e-3, 10.0, 9)


def struck(key: str, n: float = 1.5, **inputs) -> Outputs:
    contact = collide(find(key), table1_impacts(n, **inputs), rtol=1e-10, max_steps=10_000)
    assert np.all(contact["status"] == Status.OK)
    return contact


def state_at_event(event, acceleration, start=(0.0, 1.0), *, atol=1e-15, first_step=1e-6):
    """Indentation and rate where a function of them falls to zero after the start, by another integrator."""

    def crossing(t, y):
        return event(*y) if t > 0.0 else 1.0

    crossing.terminal, crossing.direction = True, -1
    solution = solve_ivp(
        lambda t, y: (y[1], acceleration(*y)),
        (0.0, 1e3),
        start,
        "DOP853",
        events=crossing,
        rtol=1e-12,
        atol=atol,
        first_step=first_step,
    )
    return solution.y_events[0][-1]


def gap(x, v):
    return x


def restitution_by_scipy(force, m: float, v0: float) -> float:
    """The restitution of a force F(δ, v) in SI, to F = 0, by another integrator in other coordinates."""
    atol = (1e-18, 1e-14 * v0)
    state = state_at_event(force, lambda x, v: -force(x, v) / m, (0.0, v0), atol=atol, first_step=1e-9)
    return float(-state[1] / v0)


def cubic(t: float) -> float:
    t = min(t, 1.0)
    return 3.0 * t**2 - 2.0 * t**3


# ---- Adams IMPACT, in its own units: N, mm, s


@pytest.mark.parametrize(("speed", "e_out"), [(100, 0.18893), (500, 0.06484), (1000, 0.04858), (5000, 0.07702)])
def test_adams_with_its_defaults(speed, e_out):
    # k = 1e5 N/mm^2.2, e = 2.2, c = 10 N s/mm, d = 0.1 mm, between balls of 0.5 kg together, at mm/s
    parameters = {"c": 1e4, "d": 1e-4}
    contact = struck("adams-impact", 2.2, v1=speed / 1e3, K=1e5 * 1e3**2.2, parameters=parameters)
    assert f"{contact['e_out'][0]:.5f}" == f"{e_out:.5f}"


@pytest.mark.parametrize("n", [2.0, 2.2, 3.0])
def test_adams_agrees_with_a_second_integrator(n):
    K, c, d, speeds = 1e7 * 1e3 ** (n - 1.5), 3e3, 3e-4, [0.02, 0.3, 3.0]
    contact = struck("adams-impact", n, v1=speeds, K=K, parameters={"c": c, "d": d})

    def force(x, v):
        return K * max(x, 0.0) ** n + c * cubic(max(x, 0.0) / d) * v

    expected = [restitution_by_scipy(force, 0.5, speed) for speed in speeds]
    assert contact["e_out"] == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("n", [1.0, 1.5, 1.7])
@pytest.mark.parametrize("damping", [1.0, 3.0])
def test_the_spring_of_adams_pushes_again_after_the_force_was_zero(n, damping):
    # below n = 2 the spring outlasts the damping: after its zero the force is positive again. In the contact's own
    # units, with full damping at a depth of 0.3: to the zero, in free flight until the spring prevails, to the end
    def raw_force(x, v):
        return max(x, 0.0) ** n + damping * cubic(max(x, 0.0) / 0.3) * v

    def acceleration(x, v):
        return -raw_force(x, v)

    x, v = state_at_event(raw_force, acceleration)
    x_again = brentq(lambda x: raw_force(x, v), 1e-12, x * (1 - 1e-6), xtol=1e-15)
    assert x_again > 1e-6
    _, v_end = state_at_event(gap, acceleration, (x_again, v))
    impacts = table1_impacts(n)
    parameters = {"c": damping * impacts.m * impacts.v0 / impacts.length, "d": 0.3 * impacts.length}
    contact = struck("adams-impact", n, parameters=parameters)
    assert contact["e_out"][0] == pytest.approx(-v_end, abs=1e-9)
    assert -v_end > -v


# ---- Modelica and MapleSim: a damping limited by the spring


@pytest.mark.parametrize(
    ("damping", "e_out"), [(0.1, 0.856085), (0.5, 0.560826), (1.0, 0.406197), (2.0, 0.269006), (10.0, 0.072049)]
)
def test_elastogap_at_dampings_in_the_units_of_the_contact(damping, e_out):
    impacts = table1_impacts()
    contact = struck("modelica-elastogap", parameters={"d": damping * impacts.m * impacts.v0 / impacts.length})
    assert f"{contact['e_out'][0]:.6f}" == f"{e_out:.6f}"


def test_the_earlier_of_peak_and_breakpoint_in_a_step_ends_the_phase():
    impacts = table1_impacts(2.0, e=np.full(400, 0.5))
    parameters = {
        "c": np.full(400, 0.27) * impacts.K * impacts.length**2 / impacts.v0,
        "d": np.geomspace(0.5, 1.5, 400) * impacts.length,
    }
    impacts = table1_impacts(2.0, e=np.full(400, 0.5), parameters=parameters)
    loose, fine = (collide(find("adams-impact"), impacts, rtol=rtol, max_steps=10**4) for rtol in (1e-4, 1e-8))
    assert loose["peak_indentation"] == pytest.approx(fine["peak_indentation"], rel=1e-3)


def test_a_release_is_located_where_the_force_hardly_falls_below_zero():
    impacts = table1_impacts(1.5, e=[1.0])
    coarse, fine = (
        collide(find("lammps-tsuji-without-root-limit"), impacts, rtol=rtol, max_steps=10**5)
        for rtol in (1e-10, 1e-12)
    )
    assert coarse["contact_time"] == pytest.approx(fine["contact_time"], rel=1e-11)
    assert coarse["permanent_indentation"] == pytest.approx(fine["permanent_indentation"], rel=1e-6)


@pytest.mark.parametrize(
    "n", [pytest.param(1.0, marks=pytest.mark.slow), 1.5, pytest.param(2.5, marks=pytest.mark.slow)]
)
def test_elastogap_locates_the_end_of_its_limited_damping(n):
    impacts = table1_impacts(n, e=np.full(20, 0.5))
    parameters = {"d": np.geomspace(1e-3, 30.0, 20) * impacts.m * impacts.v0 / impacts.length}
    contacts = [
        collide(
            find("modelica-elastogap"),
            table1_impacts(n, e=np.full(20, 0.5), parameters=parameters),
            rtol=rtol,
            max_steps=10**5,
        )
        for rtol in (1e-10, 1e-12)
    ]
    for name in ("e_out", "contact_time", "peak_indentation", "peak_force"):
        coarse, fine = (contact[name] for contact in contacts)
        assert coarse == pytest.approx(fine, rel=1e-9), name


def test_a_limited_damper_on_a_linear_spring_has_a_closed_form():
    zeta = np.unique([0.0, 1.0, *np.geomspace(1e-3, 100.0, 60), *(1.0 + np.geomspace(1e-12, 0.1, 8))])
    with mp.workdps(40):
        for z, restitution in zip(map(mp.mpf, zeta.tolist()), limited_restitution(zeta).tolist(), strict=True):
            if z == 1:
                exact = mp.exp(mp.mpf(2) / 3 - 2)
            else:
                w = mp.sqrt(1 - z * z)
                first = mp.atan(2 * z * w / (1 + 2 * z * z)) / w
                exact = mp.exp(-z * (2 * mp.acos(z) / w - first)).real
            assert restitution == pytest.approx(float(exact), rel=3e-14)
    impacts = table1_impacts(1.0, e=np.full(zeta.size, 0.5))
    parameters = {"d": 2.0 * zeta * np.sqrt(impacts.m * impacts.K)}
    contact = struck("maplesim-linear-limited", 1.0, e=np.full(zeta.size, 0.5), parameters=parameters)
    assert np.abs(contact["closed_form_error"]).max() <= 1e-9
    # the part of the damping that is cut off at the start would have dissipated energy
    assert np.all(contact["e_out"] >= force_restitution(zeta) - 1e-9)


# ---- LAMMPS: damping by a rate


# by law: the exponent q of the damping force g x^q v, the parameter, and its value in SI
LAMMPS_RATES = {
    "lammps-velocity-hertz": (0.0, "C", lambda g, impacts: g * impacts.m * impacts.v0 / impacts.length),
    "lammps-mass-velocity-hertz": (0.0, "gamma", lambda g, impacts: g * impacts.v0 / impacts.length),
    "lammps-viscoelastic-hertz": (
        0.5,
        "eta",
        lambda g, impacts: (
            g * impacts.v0 / impacts.length / np.sqrt(impacts.length / (1 / impacts.R1 + 1 / impacts.R2))
        ),
    ),
}


def struck_at_rates(key: str, g: np.ndarray) -> Outputs:
    """Impacts by a law of LAMMPS with the damping g in the contact's own units."""
    _, name, parameter = LAMMPS_RATES[key.removesuffix("-limit")]
    impacts = table1_impacts(1.5, e=np.full(g.size, 0.5))
    impacts = replace(impacts, parameters={name: parameter(g, impacts)})
    return collide(find(key), impacts, rtol=1e-10, max_steps=10_000)


def speed_at_the_gap(q: float, g: float) -> float:
    """The speed at which x'' = -x^1.5 - g x^q x' closes the gap, by an integrator of another order."""

    def acceleration(x, v):
        return -(max(x, 0.0) ** 1.5) - g * max(x, 0.0) ** q * v

    return float(-state_at_event(gap, acceleration, atol=1e-14, first_step=1e-9)[1])


@pytest.mark.parametrize("key", LAMMPS_RATES)
def test_damping_by_a_rate_agrees_with_a_second_integrator(key):
    g = np.array([0.01, 0.1, 0.3, 0.6, 1.0])
    contact = struck_at_rates(key, g)
    assert np.all(contact["status"] == Status.OK)
    expected = [speed_at_the_gap(LAMMPS_RATES[key][0], rate) for rate in g.tolist()]
    assert contact["e_out"] == pytest.approx(expected, abs=1e-9)
    # without tension the restitution is larger
    assert np.all(struck_at_rates(f"{key}-limit", g)["e_out"] > contact["e_out"])


def test_strong_damping_at_zero_indentation_holds_the_balls():
    g = np.unique([*np.linspace(1.0, 3.0, 41), 10.0, 1e3, 1e6])
    contact = struck_at_rates("lammps-velocity-hertz", g)
    held = contact["status"] == Status.LIMIT
    assert np.all(held | (contact["status"] == Status.OK))
    # one threshold, below which the rebound falls to zero
    assert np.all(np.diff(held.astype(int)) >= 0)
    assert not held[0]
    assert held[-3:].all()
    assert np.all(np.diff(contact["e_out"][~held]) < 0.0)
    assert np.all(contact["e_out"][held] == 0.0)
    assert np.all(np.isnan(contact["contact_time"][held]))
    # by another integrator the indentation is positive after a thousand times the time of an elastic contact
    solution = solve_ivp(
        lambda t, y: (y[1], -(max(y[0], 0.0) ** 1.5) - g[held][0] * y[1]),
        (0.0, 3e3),
        (0.0, 1.0),
        "LSODA",
        rtol=1e-10,
        atol=1e-14,
    )
    assert solution.y[0, -1] > 0.0


@pytest.mark.parametrize("largest", [30.0, pytest.param(200.0, marks=pytest.mark.slow)])
def test_damping_that_vanishes_at_zero_indentation_releases_the_balls(largest):
    g = np.geomspace(1.0, largest, 12)
    contact = struck_at_rates("lammps-viscoelastic-hertz", g)
    assert np.all(contact["status"] == Status.OK)
    assert np.all(contact["e_out"] > 0.0)
    # from some g on the restitution is reported as 0; it is less than 107/g^5
    beyond = struck_at_rates("lammps-viscoelastic-hertz", np.array([260.0, 1e4]))
    assert np.all(beyond["status"] == Status.LIMIT)
    assert np.all(beyond["e_out"] == 0.0)
    assert np.all(contact["e_out"][g > 10.0] < 107.0 / g[g > 10.0] ** 5)


# ---- Simscape


@pytest.mark.parametrize(("damping", "e_out"), [(0.2, 0.744835), (1.0, 0.299933)])
def test_simscape_at_a_narrow_transition(damping, e_out):
    # b = damping √(m K), w a hundredth of v₀ √(m/K)
    K, m, v0 = 1e6, 0.5, 1.0
    parameters = {"b": damping * np.sqrt(m * K), "w": 0.01 * v0 * np.sqrt(m / K)}
    contact = struck("simscape-contact", 1.0, K=K, parameters=parameters)
    assert f"{contact['e_out'][0]:.6f}" == f"{e_out:.6f}"
    other = restitution_by_scipy(
        lambda x, v: cubic(max(x, 0.0) / parameters["w"]) * (K * x + parameters["b"] * v), m, v0
    )
    assert contact["e_out"][0] == pytest.approx(other, abs=1e-8)


@pytest.mark.parametrize("b", [0.0, 1e-4, 1e-2, 1.0, 100.0])
def test_simscape_ends_where_its_damping_would_pull(b: float) -> None:
    contact = struck("simscape-contact", 1.0, K=1e6, parameters={"b": b, "w": 1e-4})
    speed = contact["v2_post"] - contact["v1_post"]
    assert contact["permanent_indentation"] == pytest.approx(b * speed / 1e6, rel=1e-6, abs=1e-18)


def test_simscape_without_a_transition_is_kelvin_and_voigt():
    K, b = 1e6, 300.0
    narrow = struck("simscape-contact", 1.0, K=K, parameters={"b": b, "w": 1e-9})
    other = struck("kelvin-voigt-no-tension", 1.0, K=K, parameters={"C": b})
    assert narrow["e_out"] == pytest.approx(other["e_out"], abs=1e-5)


# ---- the form of Hunt and Crossley, in other parameters


def chi_of(key: str, parameters: dict[str, float], v0: np.ndarray, K: float, e: np.ndarray) -> np.ndarray:
    """The damping ratio χ by the formula of each code."""
    vs = parameters.get("vs", 1.0)
    asked = e + (0.01 - e) * np.exp(np.log(0.01) * v0 / vs)
    divisor = np.where(v0 >= vs, v0, v0 * (v0 / vs) * (1.0 - v0 / vs / 3.0) + vs / 3.0)
    return {
        "recurdyn": parameters.get("c", 0.0) * v0 / K,
        "simbody-hunt-crossley": 1.5 * parameters.get("c", 0.0) * v0,
        "drake-point-contact": parameters.get("d", 0.0) * v0,
        "drake-point-contact-mixed": (3e6 * parameters.get("d1", 0.0) + 1e6 * parameters.get("d2", 0.0))
        / 4e6
        * v0,
        "simbody-hunt-crossley-mixed": 1.5 * (parameters.get("c1", 0.0) + parameters.get("c2", 0.0)) / 2 * v0,
        "modia3d": np.where(
            v0 > vs, np.minimum(parameters.get("d", 0.0), 8 * (1 - e) / (5 * e * v0)), parameters.get("d", 0.0)
        )
        * v0,
        "modia3d-exponential": np.minimum(parameters.get("d", 0.0), 8 * (1 - asked) / (5 * asked * divisor)) * v0,
        "chrono-smc-flores": 8
        * (1 - np.maximum(e, 0.01))
        / (5 * np.maximum(e, 0.01))
        / parameters.get("vc", 1.0)
        * v0,
    }[key]


@pytest.mark.parametrize(
    ("key", "parameters"),
    [
        ("recurdyn", {"c": 3e9}),
        ("simbody-hunt-crossley", {"c": 0.3}),
        ("drake-point-contact", {"d": 20.0}),
        ("drake-point-contact-mixed", {"d1": 10.0, "d2": 40.0, "k1": 1e6, "k2": 3e6}),
        ("simbody-hunt-crossley-mixed", {"c1": 0.1, "c2": 0.5}),
        ("modia3d", {"vs": 0.01, "d": 2000.0}),
        ("modia3d", {"vs": 0.5, "d": 2.0}),
        ("modia3d-exponential", {"vs": 0.01, "d": 1000.0}),
        ("modia3d-exponential", {"vs": 0.5, "d": 2.0}),
        ("chrono-smc-flores", {"vc": 0.7}),
    ],
)
def test_the_form_of_hunt_and_crossley(key, parameters):
    n, K = find(key).exponent or 1.5, 6e9
    e, speeds = (grid.ravel() for grid in np.meshgrid([0.001, 0.4, 0.9], SPEEDS))
    contact = struck(key, n, v1=speeds, e=e, K=K, parameters=parameters)
    chi = chi_of(key, parameters, speeds, K, e)
    assert contact["damping_ratio"] == pytest.approx(chi, rel=1e-12)
    assert contact["e_out"] == pytest.approx(delivered_restitution(chi), abs=1e-9)


@pytest.mark.parametrize("n", [1.0, 1.5, 2.2])
def test_recurdyn_with_exponents_where_it_has_closed_forms(n):
    damping, speeds = (grid.ravel() for grid in np.meshgrid([0.0, 0.1, 1.0, 10.0], SPEEDS))
    impacts = table1_impacts(n, v1=speeds)
    for m2, e_out in ((1.0, delivered_restitution(damping)), (2.0, 1 / np.sqrt(1 + damping))):
        parameters = {
            "c": damping * impacts.K / impacts.v0**m2,
            "damping_exponent": m2,
            "indentation_exponent": n,
        }
        contact = struck("recurdyn-exponents", n, v1=speeds, parameters=parameters)
        assert contact["e_out"] == pytest.approx(e_out, abs=1e-9)


@pytest.mark.parametrize("m2", [1.0, 1.3, 3.0])
@pytest.mark.parametrize("m3", [1.0, 1.5, 2.0])
def test_recurdyn_with_exponents_agrees_with_a_second_integrator(m2, m3):
    # in the contact's own units, to the gap; the unit of c depends on the exponents
    def acceleration(x, v):
        x = max(x, 0.0)
        return -(x**1.5) - 0.4 * np.sign(v) * abs(v) ** m2 * x**m3

    _, v_end = state_at_event(gap, acceleration)
    impacts = table1_impacts(v1=SPEEDS)
    parameters = {
        "c": 0.4 * impacts.m * impacts.v0 ** (2 - m2) / impacts.length ** (1 + m3),
        "damping_exponent": m2,
        "indentation_exponent": m3,
    }
    contact = struck("recurdyn-exponents", v1=SPEEDS, parameters=parameters)
    assert contact["e_out"] == pytest.approx(np.full(SPEEDS.size, -v_end), abs=1e-9)


def test_a_parameter_whose_unit_depends_on_exponents_is_a_number_without_unit():
    sweep = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6}
    parameters = {"recurdyn-exponents": {"c": "3 N s/m"}}
    with pytest.raises(ConfigError, match=r"a bare number: .* depends on damping_exponent and indentation_"):
        impact.sweep({"models": "recurdyn-exponents", "sweep": sweep, "model": parameters})


def test_drake_rebounds_slower_than_one_over_its_dissipation():
    # equation (26) is a bound: above it the force would pull
    contact = struck("drake-point-contact", 1.0, v1=np.geomspace(0.01, 1e3, 20), K=1e6, parameters={"d": 20.0})
    rebound = contact["v2_post"] - contact["v1_post"]
    assert np.all(rebound <= 1 / 20.0 * (1 + 1e-9))
    assert rebound[-1] == pytest.approx(1 / 20.0, rel=1e-6)


def test_modia3d_is_flores_at_speed_and_stiff_when_slow():
    contact = struck("modia3d", v1=np.array([1e-4, 0.01, 10.0]), e=0.5, parameters={"vs": 0.01, "d": 2000.0})
    assert contact["e_out"][2] == pytest.approx(delivered(find("flores-2011"), np.array([0.5]))[0], abs=1e-9)
    # up to v_s, e is 0 and the damping has its upper limit
    slow = delivered_restitution(2000.0 * np.array([1e-4, 0.01]))
    assert contact["e_out"][:2] == pytest.approx(slow, abs=1e-9)


# ---- dashpots


def test_mujoco_depends_on_its_damping_ratio_alone():
    ratio, speeds = (grid.ravel() for grid in np.meshgrid([0.1, 0.5, 1.0, 2.0], SPEEDS))
    for timeconst in (1e-3, 0.02):
        parameters = {"timeconst": timeconst, "dampratio": ratio}
        contact = struck("mujoco-solref", 1.0, v1=speeds, K=1e5, parameters=parameters)
        assert contact["e_out"] == pytest.approx(force_restitution(ratio), abs=1e-9)
        # the stiffness follows from τ, whatever K is
        other = struck("mujoco-solref", 1.0, v1=speeds, K=1e7, parameters=parameters)
        assert other["contact_time"] == pytest.approx(contact["contact_time"], rel=1e-7)
        assert other["peak_indentation"] == pytest.approx(contact["peak_indentation"], rel=1e-7)


def test_mujoco_needs_neither_a_stiffness_nor_a_material():
    config = {"models": "mujoco-solref", "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0}}
    result = impact.sweep(config, overrides=["model.mujoco-solref.dampratio=0.18"])
    assert result["e_out"].item() == pytest.approx(0.601, abs=5e-4)
    assert result["stiffness"].item() == pytest.approx(0.5 / (0.02 * 0.18) ** 2, rel=1e-12)


def test_mujoco_direct_is_a_spring_and_a_damping_per_mass():
    k, b = np.array([1e4, 1e4, 1e6, 1e4]), np.array([0.0, 50.0, 2e3, 300.0])
    parameters = {"k": np.repeat(k, SPEEDS.size), "b": np.repeat(b, SPEEDS.size)}
    contact = struck("mujoco-solref-direct", 1.0, v1=np.tile(SPEEDS, k.size), K=1e5, parameters=parameters)
    expected = np.repeat(force_restitution(b / (2 * np.sqrt(k))), SPEEDS.size)
    assert contact["e_out"] == pytest.approx(expected, abs=1e-9)
    undamped = contact["contact_time"][parameters["b"] == 0.0]
    assert undamped == pytest.approx(np.full(SPEEDS.size, np.pi / np.sqrt(1e4)), rel=1e-8)


def test_mujoco_with_its_defaults_has_a_restitution_of_exp_minus_2():
    assert struck("mujoco-solref", 1.0, K=1e5, parameters={"timeconst": 0.02, "dampratio": 1.0})["e_out"][0] == (
        pytest.approx(np.exp(-2.0), abs=1e-9)
    )


@pytest.mark.parametrize(
    ("key", "e", "e_out"),
    [
        ("lammps-tsuji-without-root", 0.5, "0.616"),
        ("lammps-tsuji-limit", 0.5, "0.550"),
        ("yade-betan-pulling", 0.5, "0.466"),
        # the traditional formula with release at F = 0, as in YADE since 2013
        ("yade-betan", 0.5, "0.523"),
        # 0.725 by Lankarani and Nikravesh, which OpenSees does not have
        ("opensees-hertzdamp", 0.5, "0.470"),
        ("yade-en", 0.5, "0.500"),
        ("yade-en", 1.0, "1.000"),
        ("yade-en-clamped", 0.5, "0.550"),
        ("yade-en-pulling", 0.5, "0.500"),
        # with 2 instead of √5
        ("mfix-hertz", 0.1, "0.141"),
        ("mfix-hertz", 0.3, "0.346"),
        ("mfix-hertz", 0.5, "0.540"),
        ("mfix-hertz", 0.7, "0.727"),
        ("mfix-hertz", 0.9, "0.910"),
        ("kratos-hertz", 0.5, "0.500"),
        ("kratos-hertz", 1.0, "1.000"),
        ("demlab-tti", 0.5, "0.550"),
        ("chrono-smc-hertz", 0.5, "0.550"),
        ("mbdyn-flores", 0.5, "0.470"),
    ],
)
def test_restitution_that_laws_of_codes_deliver(key, e, e_out):
    assert f"{struck(key, e=e)['e_out'][0]:.3f}" == e_out


def test_tsujis_fit_in_lammps_is_within_two_thousandths_of_e():
    e = np.linspace(0.05, 1.0, 96)
    assert f"{np.abs(struck('lammps-tsuji', e=e)['e_out'] - e).max():.4f}" == "0.0019"


@pytest.mark.parametrize(
    ("key", "e_out"),
    [
        ("lammps-tsuji-hooke", "0.458"),
        ("lammps-tsuji-hooke-limit", "0.517"),
        ("lammps-tsuji-hooke-without-root", "0.581"),
        ("lammps-tsuji-hooke-without-root-limit", "0.616"),
        ("mfix-lsd", "0.500"),
        ("kratos-linear", "0.500"),
    ],
)
def test_restitution_that_linear_springs_of_codes_deliver(key, e_out):
    assert f"{struck(key, 1.0, e=0.5)['e_out'][0]:.3f}" == e_out


@pytest.mark.parametrize(("betan", "e_out"), [(0.0, 1.0), (1.0, 0.1196), (2.0, 0.0410)])
def test_yade_takes_any_betan(betan, e_out):
    contact = struck("yade-betan-direct", parameters={"betan": betan})
    assert contact["e_out"][0] == pytest.approx(e_out, abs=5e-5)


def test_viscoelastic_hooke_of_lammps_agrees_with_a_second_integrator():
    impacts = table1_impacts(1.0)
    root = np.sqrt(1 / (1 / impacts.R1[0] + 1 / impacts.R2[0]))
    K, m, v0, eta = 1e7, 0.5, 1.0, 2e6
    expected = restitution_by_scipy(
        lambda x, v: K * max(x, 0.0) + eta * m * root * np.sqrt(max(x, 0.0)) * v, m, v0
    )
    limited = struck("lammps-viscoelastic-hooke-limit", 1.0, K=K, parameters={"eta": eta})
    assert limited["e_out"][0] == pytest.approx(expected, abs=1e-8)
    assert struck("lammps-viscoelastic-hooke", 1.0, K=K, parameters={"eta": eta})["e_out"][0] < expected - 0.01


def test_dissipation_of_each_material_is_weighted_by_the_stiffness_of_the_other():
    soft, hard = 2e6, 200e9
    parameters = {"c1": 0.4, "c2": 0.1}
    contact = struck("simbody-hunt-crossley-mixed", E1=soft, E2=hard, K=1e9, parameters=parameters)
    k1, k2 = (soft / 0.91) ** (2 / 3), (hard / 0.91) ** (2 / 3)
    assert contact["damping_ratio"][0] == pytest.approx(1.5 * (k2 * 0.4 + k1 * 0.1) / (k1 + k2), rel=1e-12)
    # the soft body deforms, and dissipates
    assert contact["damping_ratio"][0] == pytest.approx(1.5 * 0.4, rel=1e-3)


def test_velocities_follow_from_the_restitution():
    contact = struck("drake-point-contact", 1.0, v1=SPEEDS, v2=-0.1, m2=3.0, K=1e6, parameters={"d": 1.0})
    v1, v2 = velocities_after(table1_impacts(1.0, v1=SPEEDS, v2=-0.1, m2=3.0, K=1e6), contact["e_out"])
    assert contact["v1_post"].tobytes() == v1.tobytes()
    assert contact["v2_post"].tobytes() == v2.tobytes()


# ---- stiffness by the rule of a code, where the config has none

BALLS = {"E": 56e9, "nu": 0.3, "rho": 2712.0}
SOFT = {"E": 2e9, "nu": 0.4, "rho": 1000.0}
MATERIALS = {"hard": BALLS, "soft": SOFT}
# the stiffness does not depend on the integration
LOOSE = {"rtol": 1e-4}


def effective_modulus() -> float:
    return 1 / sum((1 - material["nu"] ** 2) / material["E"] for material in (BALLS, SOFT))


def stiffness(key: str, **sweep_inputs) -> np.ndarray:
    sweep = {
        "e": 0.5,
        "v1": 1.0,
        "m1": 1.0,
        "m2": 2.0,
        "R1": 0.04,
        "R2": 0.06,
        "material1": "hard",
        "material2": "soft",
        **sweep_inputs,
    }
    parameters = {"model": {key: {"c": 0.1}}} if key == "simbody-hunt-crossley" else {}
    config = {"models": key, "sweep": sweep, "materials": MATERIALS, "solver": LOOSE, **parameters}
    return impact.sweep(config)["stiffness"].values.squeeze()


def test_stiffness_of_simbody():
    # (4/3) √R k^(3/2), k of two springs in series whose moduli are to the power 2/3
    R = 0.04 * 0.06 / 0.1
    k1, k2 = ((material["E"] / (1 - material["nu"] ** 2)) ** (2 / 3) for material in (BALLS, SOFT))
    expected = 4 / 3 * np.sqrt(R) * (k1 * k2 / (k1 + k2)) ** 1.5
    assert stiffness("simbody-hunt-crossley") == pytest.approx(expected, rel=1e-12)
    assert stiffness("simbody-hunt-crossley", K=1e9) == 1e9


@pytest.mark.parametrize("key", ["liggghts-hooke", "chrono-smc-hooke", "liggghts-hooke-limit-force"])
def test_stiffness_of_a_characteristic_speed(key):
    R, m, E = 0.04 * 0.06 / 0.1, 2.0 / 3.0, effective_modulus()
    expected = 16 / 15 * np.sqrt(R) * E * (15 * m / (16 * np.sqrt(R) * E)) ** 0.2
    # by v_c = 1 m/s, not by the speed of the impact
    assert stiffness(key) == pytest.approx(expected, rel=1e-12)
    assert stiffness(key, v1=[1.0, 5.0]) == pytest.approx(np.full(2, expected), rel=1e-12)
    assert stiffness(key, m1=[1.0, 3.0])[1] > expected


def test_stiffness_of_drake_is_that_of_two_springs_in_series():
    sweep = {"v1": 1.0, "m1": 1.0, "m2": 1.0}
    parameters = {"drake-point-contact": {"k1": "3 MN/m", "k2": 1e6}}
    result = impact.sweep({"models": "drake-point-contact", "sweep": sweep, "model": parameters, "solver": LOOSE})
    assert result["stiffness"].item() == pytest.approx(0.75e6, rel=1e-12)


def test_stiffness_of_a_linear_spring_of_kratos_differs_at_a_wall():
    R, E = 0.04 * 0.06 / 0.1, effective_modulus()
    assert stiffness("kratos-linear") == pytest.approx(1.432 * np.pi * 0.31225 * E * R, rel=1e-12)
    wall = stiffness("kratos-linear", m2=np.inf, R2=np.inf)
    assert wall == pytest.approx(np.pi * 0.31225 * E * 0.04, rel=1e-12)


def test_stiffness_without_a_radius():
    expected = np.full(2, 4 / 3 * effective_modulus())
    assert stiffness("chrono-smc-plaincoulomb", R1=[0.01, 1.0]) == pytest.approx(expected, rel=1e-12)


def test_deduplicated_points_have_the_bits_of_separate_ones_where_a_code_sets_the_stiffness():
    # two laws have a characteristic speed: v0 counts for the motion, but not for the stiffness
    sweep = {"e": [0.3, 0.6], "v1": [1.0, 2.0], "m1": [1.0, 3.0], "m2": 1.0, "material": ["hard", "soft"]}
    models = ["liggghts-hooke", "chrono-smc-plaincoulomb", "simbody-hunt-crossley"]
    config = {
        "models": models,
        "sweep": sweep,
        "materials": MATERIALS,
        "model": {"simbody-hunt-crossley": {"c": 0.1}},
    }
    deduplicated, separate = (
        impact.sweep(config | {"solver": LOOSE | {"collapse": collapse}}) for collapse in (True, False)
    )
    for name in ("stiffness", "peak_indentation", "contact_time", "e_out", "peak_force"):
        assert deduplicated[name].values.tobytes() == separate[name].values.tobytes()


@pytest.mark.parametrize("m2", [1.0, 4.0, np.inf])
def test_newton_damps_the_approach_by_kd_over_twice_the_root_of_mass_and_stiffness(m2):
    m, K, ratio = 1.0 if np.isinf(m2) else m2 / (1.0 + m2), 1e6, 0.3
    kd = 2.0 * ratio * np.sqrt(m * K)
    balls = {"v1": 1.0, "m1": 1.0, "m2": m2, "K": K, "n": 1.0}
    config = {"models": "newton-semi-implicit", "sweep": balls, "model": {"newton-semi-implicit": {"kd": kd}}}
    assert impact.sweep(config)["e_out"].item() == pytest.approx(approach_restitution(np.array(ratio)), rel=1e-9)
