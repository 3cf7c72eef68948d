"""Every number of the paper comes out: Table 1, what its laws deliver, their limits and its conclusions.

Gharib and Hurmuzlu (2012), J. Appl. Mech. 79, 064506; equation numbers are the paper's.
"""

import math

import numpy as np
import pytest

from impact.contact.closed_forms import contact_time_ratio, peak_indentation
from impact.contact.history import follow
from impact.contact.impacts import Impacts
from impact.contact.impulse import velocities_after, velocities_at
from impact.contact.materials import hertz_stiffness, sphere_radius
from impact.contact.models import find
from impact.contact.outputs import Outputs, collide
from impact.contact.status import Status

from .problems import EACH_LAW, table1_impacts, with_parameters

RTOL, MAX_STEPS = 1e-10, 100_000
HYSTERESIS = {
    "hunt-crossley-1975": 19,
    "herbert-mcwhannell-1977": 20,
    "lee-wang-1983": 21,
    "lankarani-nikravesh-1990": 22,
    "exact-hysteresis": 23,
    "gharib-hurmuzlu-2012": 28,
}
PERMANENT = ("lankarani-nikravesh-1994", "gharib-hurmuzlu-2012-energetic", "bilinear")
# Table 1: K [N/m^1.5], effective mass [kg], peak indentation [m] and force [N], contact time [s]
STIFFNESS, MASS, PEAK, FORCE, TIME = 6.118486349e9, 0.5, 1.008542975e-4, 6197.0587, 2.968420e-4


def struck(key: str, lanes: Impacts) -> Outputs:
    return collide(find(key), lanes, rtol=RTOL, max_steps=MAX_STEPS)


def at(key: str, e: object) -> Outputs:
    """The case of Table 1 at these restitutions; a linear law has its own n."""
    return struck(key, table1_impacts(find(key).exponent or 1.5, e=np.asarray(e, float)))


def error_of(key: str, e: object) -> np.ndarray:
    return np.abs(at(key, np.atleast_1d(e))["e_error"])


# ---- Table 1


def test_radius_of_table_1():
    assert sphere_radius(np.array([1.0]), np.array([2712.0]))[0] == pytest.approx(0.0444843486, rel=1e-9)


def test_stiffness_and_effective_mass_of_table_1():
    lanes = table1_impacts()
    assert lanes.K[0] == pytest.approx(STIFFNESS, rel=1e-9)
    assert lanes.m[0] == MASS


def test_peak_and_time_of_table_1_in_closed_form():
    lanes = table1_impacts()
    peak = peak_indentation(lanes.m, lanes.v0, lanes.K, 1.5)[0]
    assert peak == pytest.approx(PEAK, rel=1e-9)
    assert lanes.K[0] * peak**1.5 == pytest.approx(FORCE, rel=1e-8)
    assert contact_time_ratio(1.5) * peak / lanes.v0[0] == pytest.approx(TIME, rel=3e-7)


def test_peak_and_time_of_table_1_come_out_of_the_integration():
    contact = struck("hertz", table1_impacts(e=1.0))
    assert contact["peak_indentation"][0] == pytest.approx(PEAK, rel=1e-9)
    assert contact["peak_force"][0] == pytest.approx(FORCE, rel=1e-8)
    assert contact["contact_time"][0] == pytest.approx(TIME, rel=3e-7)


def test_reference_velocities_of_table_1():
    e = np.linspace(0.0, 1.0, 11)
    contact = at("gharib-hurmuzlu-2012-energetic", e)
    assert contact["v1_reference"] == pytest.approx((1.0 - e) / 2.0, rel=1e-15, abs=1e-16)
    assert contact["v2_reference"] == pytest.approx((1.0 + e) / 2.0, rel=1e-15)


def test_velocity_error_is_half_the_error_of_the_restitution_for_equal_masses():
    contact = at("lankarani-nikravesh-1990", np.linspace(0.1, 1.0, 10))
    assert contact["v2_error"] == pytest.approx(contact["e_error"] / 2.0, rel=1e-12, abs=1e-15)
    assert contact["v1_error"] == pytest.approx(-contact["e_error"] / 2.0, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(("R1", "R2", "radius"), [(0.1, 0.3, 0.075), (0.1, np.inf, 0.1), (np.inf, np.inf, np.inf)])
def test_stiffness_of_unlike_balls_and_planes(R1, R2, radius):
    E1, nu1, E2, nu2, R1, R2 = np.array([[210e9], [0.3], [70e9], [0.4], [R1], [R2]])
    k1, k2 = (1.0 - nu1**2) / E1, (1.0 - nu2**2) / E2
    assert hertz_stiffness(E1, nu1, E2, nu2, R1, R2) == pytest.approx(
        4.0 / 3.0 / (k1 + k2) * math.sqrt(radius), rel=1e-14
    )


# ---- impulse and momentum

PAIRS = [(1.0, 1.0), (2.0, 0.3), (1e-3, 1e3), (5.0, np.inf), (np.inf, 5.0)]


@pytest.mark.parametrize(("m1", "m2"), PAIRS)
@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_impulse_and_momentum(m1, m2, e):
    v1, v2 = 3.0, -1.5
    lanes = table1_impacts(e=e, m1=m1, m2=m2, v1=v1, v2=v2, R1=0.1, R2=0.1)
    (after1,), (after2,) = velocities_after(lanes, lanes.e)
    # (5), and a wall moves on as it did
    assert after2 - after1 == pytest.approx(e * (v1 - v2), rel=1e-14, abs=1e-14)
    if math.isinf(m2):
        assert (after1, after2) == pytest.approx((v2 - e * (v1 - v2), v2), rel=1e-14)
    elif math.isinf(m1):
        assert (after1, after2) == pytest.approx((v1, v1 + e * (v1 - v2)), rel=1e-14)
    else:
        # (4), (6), (7)
        assert m1 * after1 + m2 * after2 == pytest.approx(m1 * v1 + m2 * v2, rel=1e-13)
        total = m1 + m2
        assert after1 == pytest.approx(((m1 - e * m2) * v1 + (1 + e) * m2 * v2) / total, rel=1e-12, abs=1e-12)
        assert after2 == pytest.approx(((m2 - e * m1) * v2 + (1 + e) * m1 * v1) / total, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("m1", "m2"), PAIRS[:3])
def test_impulse_velocity_diagram(m1, m2):
    # (8), (9): the lines meet at tau_c = m v0 and end at tau_c (1 + e)
    e, lanes = 0.4, table1_impacts(e=0.4, m1=m1, m2=m2, v2=-0.5)
    tau = lanes.m * lanes.v0
    (stopped1,), (stopped2,) = velocities_at(lanes, tau)
    common = (m1 * lanes.v1[0] + m2 * lanes.v2[0]) / (m1 + m2)
    assert (stopped1, stopped2) == pytest.approx((common, common), rel=1e-12, abs=1e-12)
    # straight lines: halfway along the impulse, halfway between the velocities
    (half1,), (half2,) = velocities_at(lanes, 0.5 * tau)
    assert half1 == pytest.approx(0.5 * (lanes.v1[0] + stopped1), rel=1e-12, abs=1e-12)
    assert half2 == pytest.approx(0.5 * (lanes.v2[0] + stopped2), rel=1e-12, abs=1e-12)
    (end1,), (end2,) = velocities_at(lanes, tau * (1 + e))
    (after1,), (after2,) = velocities_after(lanes, lanes.e)
    assert (end1, end2) == pytest.approx((after1, after2), rel=1e-12, abs=1e-12)
    assert end2 - end1 == pytest.approx(e * lanes.v0[0], rel=1e-12)


@pytest.mark.parametrize("key", EACH_LAW)
def test_kinematic_kinetic_and_energetic_restitution_are_one_number(key):
    lanes = with_parameters(find(key), table1_impacts(find(key).exponent or 1.5, e=0.2), 0.5)
    history = follow(find(key), lanes, rtol=RTOL, max_steps=MAX_STEPS)
    kinematic = -history.v[-1] / history.v[0]
    assert kinematic == pytest.approx(struck(key, lanes)["e_out"][0], rel=1e-12, abs=RTOL)
    assert history.e_kinetic == pytest.approx(kinematic, rel=1e-8, abs=1e-9)
    assert history.e_energetic == pytest.approx(kinematic, rel=1e-8, abs=1e-9)


# ---- what (22) and (28) deliver

DELIVERED = {
    0.1: (0.665265, 0.0999816),
    0.2: (0.672262, 0.196980),
    0.3: (0.684225, 0.281877),
    0.5: (0.725241, 0.410720),
    0.7: (0.795973, 0.500779),
    0.9: (0.913177, 0.566812),
    1.0: (1.0, 0.593624),
}


@pytest.mark.parametrize("e", DELIVERED)
def test_delivered_restitution(e):
    lankarani_nikravesh, gharib_hurmuzlu = DELIVERED[e]
    assert at("lankarani-nikravesh-1990", [e])["e_out"][0] == pytest.approx(lankarani_nikravesh, rel=0, abs=5.1e-7)
    assert at("gharib-hurmuzlu-2012", [e])["e_out"][0] == pytest.approx(gharib_hurmuzlu, rel=0, abs=5.1e-7)


@pytest.mark.parametrize(
    ("key", "chi"),
    [
        ("hunt-crossley-1975", lambda e: 3 / 2 * (1 - e)),
        ("herbert-mcwhannell-1977", lambda e: 6 * (1 - e) / ((2 * e - 1) ** 2 + 3)),
        ("lee-wang-1983", lambda e: 3 / 4 * (1 - e)),
        ("lankarani-nikravesh-1990", lambda e: 3 / 4 * (1 - e**2)),
        ("gharib-hurmuzlu-2012", lambda e: 1 / e),
    ],
)
def test_damping_ratio_of_a_law(key, chi):
    e = np.linspace(0.1, 1.0, 10)
    assert at(key, e)["damping_ratio"] == pytest.approx(chi(e), rel=1e-14, abs=1e-16)


# ---- the limits

AT_ZERO = {
    "hunt-crossley-1975": (1.5, 0.487741256015),
    "herbert-mcwhannell-1977": (1.5, 0.487741256015),
    "lee-wang-1983": (0.75, 0.662962200002),
    "lankarani-nikravesh-1990": (0.75, 0.662962200002),
}
TOGETHER = 0.5  # the common velocity of Table 1, v1/2


@pytest.mark.parametrize("key", AT_ZERO)
def test_damped_law_with_a_finite_coefficient_rebounds_at_e_0(key):
    chi, e_out = AT_ZERO[key]
    contact = at(key, [0.0])
    assert contact["status"][0] == Status.OK
    assert contact["damping_ratio"][0] == chi
    assert contact["e_out"][0] == pytest.approx(e_out, rel=0, abs=1e-9)


def test_undamped_law_is_elastic_at_e_0():
    assert at("hertz", [0.0])["e_out"][0] == pytest.approx(1.0, rel=0, abs=1e-9)


@pytest.mark.parametrize("key", ["exact-hysteresis", "gharib-hurmuzlu-2012", *PERMANENT])
def test_plastic_limit_at_e_0(key):
    contact = at(key, [0.0])
    assert contact["status"][0] == Status.LIMIT
    assert contact["e_out"][0] == 0.0
    assert contact["e_error"][0] == 0.0
    assert contact["closed_form_error"][0] == 0.0
    assert (contact["v1_post"][0], contact["v2_post"][0]) == (TOGETHER, TOGETHER)
    assert (contact["v1_error"][0], contact["v2_error"][0]) == (0.0, 0.0)
    assert contact["energy_loss"][0] == pytest.approx(MASS / 2.0, rel=1e-15)


@pytest.mark.parametrize("key", ["exact-hysteresis", "gharib-hurmuzlu-2012"])
def test_infinite_damping_has_no_indentation_and_no_finite_force_and_time(key):
    contact = at(key, [0.0])
    assert contact["peak_indentation"][0] == 0.0
    assert contact["permanent_indentation"][0] == 0.0
    for name in ("peak_force", "contact_time", "damping_ratio", "energy_residual"):
        assert np.isnan(contact[name][0])


@pytest.mark.parametrize("key", PERMANENT)
def test_infinite_unloading_stiffness_keeps_the_peak_and_half_the_time(key):
    contact, lanes = at(key, [0.0]), table1_impacts(find(key).exponent or 1.5)
    n = lanes.n[0]
    peak = peak_indentation(MASS, 1.0, lanes.K[0], n)
    assert contact["peak_indentation"][0] == pytest.approx(peak, rel=1e-9)
    assert contact["permanent_indentation"][0] == contact["peak_indentation"][0]
    assert contact["peak_force"][0] == pytest.approx(lanes.K[0] * peak**n, rel=1e-9)
    assert contact["contact_time"][0] == pytest.approx(contact_time_ratio(n) * peak / 2.0, rel=1e-9)
    assert np.isnan(contact["damping_ratio"][0])
    assert abs(contact["energy_residual"][0]) <= 10 * RTOL


@pytest.mark.parametrize("key", ["hertz", *HYSTERESIS, *PERMANENT])
def test_elastic_limit_at_e_1(key):
    contact = at(key, [1.0])
    delivered = 0.593624260040 if key == "gharib-hurmuzlu-2012" else 1.0
    assert contact["status"][0] == Status.OK
    assert contact["e_out"][0] == pytest.approx(delivered, rel=0, abs=1e-9)
    if key in HYSTERESIS:
        assert contact["damping_ratio"][0] == (1.0 if key == "gharib-hurmuzlu-2012" else 0.0)
    for known in (contact["peak_indentation"], contact["peak_force"], contact["contact_time"], contact["v1_post"]):
        assert np.isfinite(known[0])


@pytest.mark.parametrize("key", ["exact-hysteresis", "gharib-hurmuzlu-2012"])
def test_indentation_falls_as_the_damping_to_the_power_0_4(key):
    first, second = at(key, [1e-4, 1e-6])["peak_indentation"]
    assert math.log(first / second) / math.log(100.0) == pytest.approx(0.4, rel=1e-3)


# ---- the conclusions


def test_22_is_good_above_e_0_9():
    errors = error_of("lankarani-nikravesh-1990", np.linspace(0.9, 1.0, 101))
    assert 0.0131 < errors.max() < 0.0132


def test_28_is_good_below_e_0_3():
    errors = error_of("gharib-hurmuzlu-2012", np.linspace(0.001, 0.3, 101))
    assert 0.0181 < errors.max() < 0.0182


@pytest.mark.parametrize(
    ("key", "threshold", "error", "side"),
    [
        ("lankarani-nikravesh-1990", 0.9136, 0.01, -1),
        ("lankarani-nikravesh-1990", 0.7932, 0.05, -1),
        ("gharib-hurmuzlu-2012", 0.2581, 0.01, 1),
        ("gharib-hurmuzlu-2012", 0.4065, 0.05, 1),
    ],
)
def test_error_passes_a_bound_at_its_threshold(key, threshold, error, side):
    # the threshold is given to a unit of its last digit; the error grows to one side of it
    assert error_of(key, threshold + side * 1e-4) > error
    end = 1.0 if side < 0 else 0.001
    assert np.all(error_of(key, np.linspace(threshold - side * 1e-4, end, 50)) < error)


def test_both_errors_are_equal_at_e_0_61302():
    e = [0.613015, 0.61302, 0.613025]
    low, middle, high = error_of("gharib-hurmuzlu-2012", e) - error_of("lankarani-nikravesh-1990", e)
    assert low < 0.0 < high
    assert abs(middle) < max(abs(low), abs(high))
    assert error_of("gharib-hurmuzlu-2012", 0.61302)[0] == pytest.approx(0.1478, abs=5e-5)


@pytest.mark.parametrize("key", PERMANENT)
def test_permanent_indentation_is_identical_to_the_reference(key):
    assert error_of(key, np.linspace(0.001, 1.0, 100)).max() < 1e-9


def test_both_permanent_laws_are_the_same_force_history():
    # (29)-(32) and (33)-(42), with their indentations (32) = (37) = (41)
    e = np.linspace(0.05, 1.0, 20)
    first, second = at(PERMANENT[0], e), at(PERMANENT[1], e)
    for name in ("e_out", "peak_indentation", "permanent_indentation", "peak_force", "contact_time"):
        assert first[name] == pytest.approx(second[name], rel=1e-9, abs=1e-20)
    assert first["permanent_indentation"] == pytest.approx(PEAK * (1.0 - e * e), rel=1e-9)
    equation_32 = 2.5 * MASS * (1.0 - e * e) / (2.0 * FORCE)
    assert first["permanent_indentation"] == pytest.approx(equation_32, rel=1e-7)
    Kr = STIFFNESS / e**3
    assert PEAK * (1.0 - (STIFFNESS / Kr) ** (1.0 / 1.5)) == pytest.approx(equation_32, rel=1e-7)


@pytest.mark.parametrize("gamma", [1.0, 2.0, 10.0])
def test_43_delivers_the_reciprocal_of_gamma(gamma):
    contact = struck("ismail-stronge-2008", table1_impacts(1.0, parameters={"gamma": gamma}))
    assert contact["e_out"][0] == pytest.approx(1.0 / gamma, rel=0, abs=1e-9)


@pytest.mark.parametrize("key", HYSTERESIS)
def test_restitution_of_the_hysteresis_family_depends_on_the_damping_ratio_alone(key):
    lanes = table1_impacts(m1=[1.0, 7.0, 1e-3], v1=[1.0, 20.0, 0.3], E2=[56e9, 2e6, 210e9])
    assert np.unique(struck(key, lanes)["e_out"]).size == 1
