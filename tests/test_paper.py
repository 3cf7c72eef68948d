"""The numbers of the paper are reproduced: Table 1, restitutions of its laws, their limits and its conclusions.

Gharib and Hurmuzlu (2012), J. Appl. Mech. 79, 064506; equation numbers are the paper's.
"""

import math

import numpy as np
import pytest

from impact.contact.closed_forms.hysteresis import peak_indentation
from impact.contact.history import history_of
from impact.contact.impacts import Impacts
from impact.contact.materials import hertz_stiffness, sphere_radius
from impact.contact.models import find
from impact.contact.output_formulas import Outputs, collide
from impact.contact.rigid import velocities_after, velocities_at
from impact.contact.status import Status

from .problems import LAWS, contact_time_ratio, table1_impacts, with_parameters

RTOL, MAX_STEPS = 1e-10, 100_000
HYSTERESIS_LAWS = {
    "hunt-crossley-1975": 19,
    "herbert-mcwhannell-1977": 20,
    "lee-wang-1983": 21,
    "lankarani-nikravesh-1990": 22,
    "exact-hysteresis": 23,
    "gharib-hurmuzlu-2012": 28,
}
PERMANENT_LAWS = ("lankarani-nikravesh-1994", "gharib-hurmuzlu-2012-energetic", "bilinear")
# Table 1: K [N/m^1.5], effective mass [kg], peak indentation [m] and force [N], contact time [s]
STIFFNESS, MASS, PEAK, FORCE, TIME = 6.118486349e9, 0.5, 1.008542975e-4, 6197.0587, 2.968420e-4


def outputs_of(key: str, impacts: Impacts) -> Outputs:
    return collide(find(key), impacts, rtol=RTOL, max_steps=MAX_STEPS)


def table1_outputs(key: str, e: object) -> Outputs:
    """Outputs of the impact of Table 1 at values of e, with n = 3/2 or the fixed exponent of the law."""
    return outputs_of(key, table1_impacts(find(key).exponent or 1.5, e=np.asarray(e, float)))


def restitution_errors(key: str, e: object) -> np.ndarray:
    return np.abs(table1_outputs(key, np.atleast_1d(e))["e_error"])


# ---- Table 1


def test_radius_of_table_1():
    assert sphere_radius(np.array([1.0]), np.array([2712.0]))[0] == pytest.approx(0.0444843486, rel=1e-9)


def test_stiffness_and_effective_mass_of_table_1():
    impacts = table1_impacts()
    assert impacts.K[0] == pytest.approx(STIFFNESS, rel=1e-9)
    assert impacts.m[0] == MASS


def test_peak_and_time_of_table_1_in_closed_form():
    impacts = table1_impacts()
    peak = peak_indentation(impacts.m, impacts.v0, impacts.K, 1.5)[0]
    assert peak == pytest.approx(PEAK, rel=1e-9)
    assert impacts.K[0] * peak**1.5 == pytest.approx(FORCE, rel=1e-8)
    assert contact_time_ratio(1.5) * peak / impacts.v0[0] == pytest.approx(TIME, rel=3e-7)


def test_integration_gives_the_peak_and_time_of_table_1():
    outputs = outputs_of("hertz", table1_impacts(e=1.0))
    assert outputs["peak_indentation"][0] == pytest.approx(PEAK, rel=1e-9)
    assert outputs["peak_force"][0] == pytest.approx(FORCE, rel=1e-8)
    assert outputs["contact_time"][0] == pytest.approx(TIME, rel=3e-7)


def test_reference_velocities_of_table_1():
    e = np.linspace(0.0, 1.0, 11)
    outputs = table1_outputs("gharib-hurmuzlu-2012-energetic", e)
    assert outputs["v1_reference"] == pytest.approx((1.0 - e) / 2.0, rel=1e-15, abs=1e-16)
    assert outputs["v2_reference"] == pytest.approx((1.0 + e) / 2.0, rel=1e-15)


def test_velocity_error_is_half_the_error_of_the_restitution_for_equal_masses():
    outputs = table1_outputs("lankarani-nikravesh-1990", np.linspace(0.1, 1.0, 10))
    assert outputs["v2_error"] == pytest.approx(outputs["e_error"] / 2.0, rel=1e-12, abs=1e-15)
    assert outputs["v1_error"] == pytest.approx(-outputs["e_error"] / 2.0, rel=1e-12, abs=1e-15)


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
    impacts = table1_impacts(e=e, m1=m1, m2=m2, v1=v1, v2=v2, R1=0.1, R2=0.1)
    (v1_after,), (v2_after,) = velocities_after(impacts, impacts.e)
    # (5), and a wall keeps its velocity
    assert v2_after - v1_after == pytest.approx(e * (v1 - v2), rel=1e-14, abs=1e-14)
    if math.isinf(m2):
        assert (v1_after, v2_after) == pytest.approx((v2 - e * (v1 - v2), v2), rel=1e-14)
    elif math.isinf(m1):
        assert (v1_after, v2_after) == pytest.approx((v1, v1 + e * (v1 - v2)), rel=1e-14)
    else:
        # (4), (6), (7)
        assert m1 * v1_after + m2 * v2_after == pytest.approx(m1 * v1 + m2 * v2, rel=1e-13)
        total = m1 + m2
        assert v1_after == pytest.approx(((m1 - e * m2) * v1 + (1 + e) * m2 * v2) / total, rel=1e-12, abs=1e-12)
        assert v2_after == pytest.approx(((m2 - e * m1) * v2 + (1 + e) * m1 * v1) / total, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("m1", "m2"), PAIRS[:3])
def test_impulse_velocity_diagram(m1, m2):
    # (8), (9): the lines meet at tau_c = m v0 and end at tau_c (1 + e)
    e, impacts = 0.4, table1_impacts(e=0.4, m1=m1, m2=m2, v2=-0.5)
    tau = impacts.m * impacts.v0
    (v1_stopped,), (v2_stopped,) = velocities_at(impacts, tau)
    common = (m1 * impacts.v1[0] + m2 * impacts.v2[0]) / (m1 + m2)
    assert (v1_stopped, v2_stopped) == pytest.approx((common, common), rel=1e-12, abs=1e-12)
    # straight lines: halfway along the impulse, halfway between the velocities
    (v1_half,), (v2_half,) = velocities_at(impacts, 0.5 * tau)
    assert v1_half == pytest.approx(0.5 * (impacts.v1[0] + v1_stopped), rel=1e-12, abs=1e-12)
    assert v2_half == pytest.approx(0.5 * (impacts.v2[0] + v2_stopped), rel=1e-12, abs=1e-12)
    (v1_end,), (v2_end,) = velocities_at(impacts, tau * (1 + e))
    (v1_after,), (v2_after,) = velocities_after(impacts, impacts.e)
    assert (v1_end, v2_end) == pytest.approx((v1_after, v2_after), rel=1e-12, abs=1e-12)
    assert v2_end - v1_end == pytest.approx(e * impacts.v0[0], rel=1e-12)


# the laws of the paper and the first law of each other family; the rest are slow tests
FIRST_OF_FAMILY = {find(key).family: key for key in reversed(LAWS)}
FAST = {"hertz", *HYSTERESIS_LAWS, *PERMANENT_LAWS, *FIRST_OF_FAMILY.values()}


@pytest.mark.parametrize("key", [pytest.param(key, marks=() if key in FAST else pytest.mark.slow) for key in LAWS])
def test_kinematic_kinetic_and_energetic_restitution_of_a_time_history_are_equal(key):
    impacts = with_parameters(find(key), table1_impacts(find(key).exponent or 1.5, e=0.2), 0.5)
    recorded = []
    collision = collide(find(key), impacts, rtol=RTOL, max_steps=MAX_STEPS, recorded=recorded)
    history = history_of(*recorded, impacts)
    kinematic = -history.v[-1] / history.v[0]
    assert kinematic == pytest.approx(collision["e_out"][0], rel=1e-12, abs=RTOL)
    assert history.e_kinetic == pytest.approx(kinematic, rel=1e-8, abs=1e-9)
    assert history.e_energetic == pytest.approx(kinematic, rel=1e-8, abs=1e-9)


# ---- restitutions delivered by (22) and (28)

DELIVERED_RESTITUTION = {
    0.1: (0.665265, 0.0999816),
    0.2: (0.672262, 0.196980),
    0.3: (0.684225, 0.281877),
    0.5: (0.725241, 0.410720),
    0.7: (0.795973, 0.500779),
    0.9: (0.913177, 0.566812),
    1.0: (1.0, 0.593624),
}


@pytest.mark.parametrize("e", DELIVERED_RESTITUTION)
def test_delivered_restitution(e):
    lankarani_nikravesh, gharib_hurmuzlu = DELIVERED_RESTITUTION[e]
    assert table1_outputs("lankarani-nikravesh-1990", [e])["e_out"][0] == pytest.approx(
        lankarani_nikravesh, rel=0, abs=5.1e-7
    )
    assert table1_outputs("gharib-hurmuzlu-2012", [e])["e_out"][0] == pytest.approx(
        gharib_hurmuzlu, rel=0, abs=5.1e-7
    )


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
    assert table1_outputs(key, e)["damping_ratio"] == pytest.approx(chi(e), rel=1e-14, abs=1e-16)


# ---- the limits

AT_ZERO = {
    "hunt-crossley-1975": (1.5, 0.487741256015),
    "herbert-mcwhannell-1977": (1.5, 0.487741256015),
    "lee-wang-1983": (0.75, 0.662962200002),
    "lankarani-nikravesh-1990": (0.75, 0.662962200002),
}
COMMON_VELOCITY = 0.5  # the common velocity of Table 1, v1/2


@pytest.mark.parametrize("key", AT_ZERO)
def test_damped_law_with_a_finite_coefficient_rebounds_at_e_0(key):
    chi, e_out = AT_ZERO[key]
    outputs = table1_outputs(key, [0.0])
    assert outputs["status"][0] == Status.OK
    assert outputs["damping_ratio"][0] == chi
    assert outputs["e_out"][0] == pytest.approx(e_out, rel=0, abs=1e-9)


def test_undamped_law_is_elastic_at_e_0():
    assert table1_outputs("hertz", [0.0])["e_out"][0] == pytest.approx(1.0, rel=0, abs=1e-9)


@pytest.mark.parametrize("key", ["exact-hysteresis", "gharib-hurmuzlu-2012", *PERMANENT_LAWS])
def test_balls_move_on_together_at_e_0(key):
    outputs = table1_outputs(key, [0.0])
    assert outputs["status"][0] == Status.LIMIT
    assert outputs["e_out"][0] == 0.0
    assert outputs["e_error"][0] == 0.0
    assert outputs["closed_form_error"][0] == 0.0
    assert (outputs["v1_post"][0], outputs["v2_post"][0]) == (COMMON_VELOCITY, COMMON_VELOCITY)
    assert (outputs["v1_error"][0], outputs["v2_error"][0]) == (0.0, 0.0)
    assert outputs["energy_loss"][0] == pytest.approx(MASS / 2.0, rel=1e-15)


@pytest.mark.parametrize("key", ["exact-hysteresis", "gharib-hurmuzlu-2012"])
def test_infinite_damping_has_no_indentation_and_no_finite_force_and_time(key):
    outputs = table1_outputs(key, [0.0])
    assert outputs["peak_indentation"][0] == 0.0
    assert outputs["permanent_indentation"][0] == 0.0
    for name in ("peak_force", "contact_time", "damping_ratio", "energy_residual"):
        assert np.isnan(outputs[name][0])


@pytest.mark.parametrize("key", PERMANENT_LAWS)
def test_infinite_unloading_stiffness_keeps_the_peak_and_half_the_time(key):
    outputs, impacts = table1_outputs(key, [0.0]), table1_impacts(find(key).exponent or 1.5)
    n = impacts.n[0]
    peak = peak_indentation(MASS, 1.0, impacts.K[0], n)
    assert outputs["peak_indentation"][0] == pytest.approx(peak, rel=1e-9)
    assert outputs["permanent_indentation"][0] == outputs["peak_indentation"][0]
    assert outputs["peak_force"][0] == pytest.approx(impacts.K[0] * peak**n, rel=1e-9)
    assert outputs["contact_time"][0] == pytest.approx(contact_time_ratio(n) * peak / 2.0, rel=1e-9)
    assert np.isnan(outputs["damping_ratio"][0])
    assert abs(outputs["energy_residual"][0]) <= 10 * RTOL


@pytest.mark.parametrize("key", ["hertz", *HYSTERESIS_LAWS, *PERMANENT_LAWS])
def test_elastic_limit_at_e_1(key):
    outputs = table1_outputs(key, [1.0])
    e_out = 0.593624260040 if key == "gharib-hurmuzlu-2012" else 1.0
    assert outputs["status"][0] == Status.OK
    assert outputs["e_out"][0] == pytest.approx(e_out, rel=0, abs=1e-9)
    if key in HYSTERESIS_LAWS:
        assert outputs["damping_ratio"][0] == (1.0 if key == "gharib-hurmuzlu-2012" else 0.0)
    for value in (outputs["peak_indentation"], outputs["peak_force"], outputs["contact_time"], outputs["v1_post"]):
        assert np.isfinite(value[0])


@pytest.mark.parametrize("key", ["exact-hysteresis", "gharib-hurmuzlu-2012"])
def test_indentation_falls_as_the_damping_to_the_power_0_4(key):
    first, second = table1_outputs(key, [1e-4, 1e-6])["peak_indentation"]
    assert math.log(first / second) / math.log(100.0) == pytest.approx(0.4, rel=1e-3)


# ---- the conclusions


def test_the_error_of_22_is_below_0_0132_above_e_0_9():
    errors = restitution_errors("lankarani-nikravesh-1990", np.linspace(0.9, 1.0, 101))
    assert 0.0131 < errors.max() < 0.0132


def test_the_error_of_28_is_below_0_0182_below_e_0_3():
    errors = restitution_errors("gharib-hurmuzlu-2012", np.linspace(0.001, 0.3, 101))
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
def test_the_error_exceeds_a_bound_at_its_threshold(key, threshold, error, side):
    # the threshold is exact to a unit of its last digit; the error increases to one side of it
    assert restitution_errors(key, threshold + side * 1e-4) > error
    end = 1.0 if side < 0 else 0.001
    assert np.all(restitution_errors(key, np.linspace(threshold - side * 1e-4, end, 50)) < error)


def test_both_errors_are_equal_at_e_0_61302():
    e = [0.613015, 0.61302, 0.613025]
    low, middle, high = restitution_errors("gharib-hurmuzlu-2012", e) - restitution_errors(
        "lankarani-nikravesh-1990", e
    )
    assert low < 0.0 < high
    assert abs(middle) < max(abs(low), abs(high))
    assert restitution_errors("gharib-hurmuzlu-2012", 0.61302)[0] == pytest.approx(0.1478, abs=5e-5)


@pytest.mark.parametrize("key", PERMANENT_LAWS)
def test_laws_of_permanent_indentation_agree_with_the_reference(key):
    assert restitution_errors(key, np.linspace(0.001, 1.0, 100)).max() < 1e-9


def test_both_laws_of_permanent_indentation_give_the_same_collision():
    # (29)-(32) and (33)-(42), with their indentations (32) = (37) = (41)
    e = np.linspace(0.05, 1.0, 20)
    first, second = table1_outputs(PERMANENT_LAWS[0], e), table1_outputs(PERMANENT_LAWS[1], e)
    for name in ("e_out", "peak_indentation", "permanent_indentation", "peak_force", "contact_time"):
        assert first[name] == pytest.approx(second[name], rel=1e-9, abs=1e-20)
    assert first["permanent_indentation"] == pytest.approx(PEAK * (1.0 - e * e), rel=1e-9)
    equation_32 = 2.5 * MASS * (1.0 - e * e) / (2.0 * FORCE)
    assert first["permanent_indentation"] == pytest.approx(equation_32, rel=1e-7)
    Kr = STIFFNESS / e**3
    assert PEAK * (1.0 - (STIFFNESS / Kr) ** (1.0 / 1.5)) == pytest.approx(equation_32, rel=1e-7)


@pytest.mark.parametrize("gamma", [1.0, 2.0, 10.0])
def test_43_delivers_the_reciprocal_of_gamma(gamma):
    outputs = outputs_of("ismail-stronge-2008", table1_impacts(1.0, parameters={"gamma": gamma}))
    assert outputs["e_out"][0] == pytest.approx(1.0 / gamma, rel=0, abs=1e-9)


@pytest.mark.parametrize("key", HYSTERESIS_LAWS)
def test_restitution_of_the_hysteresis_family_depends_only_on_the_damping_ratio(key):
    impacts = table1_impacts(m1=[1.0, 7.0, 1e-3], v1=[1.0, 20.0, 0.3], E2=[56e9, 2e6, 210e9])
    assert np.unique(outputs_of(key, impacts)["e_out"]).size == 1
