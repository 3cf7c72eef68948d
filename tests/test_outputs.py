"""An impact ends with the right status, and its numbers depend on nothing but itself: no company, no units."""

import sys
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import impact
from impact.contact.closed_forms import delivered_restitution
from impact.contact.impacts import Impacts
from impact.contact.model import ForceModel, Parameter
from impact.contact.models import find
from impact.contact.outputs import OUTPUTS, Outputs, collide
from impact.contact.status import FIRST_FAILURE, Status
from impact.errors import ConfigError

from .problems import LAWS, table1_impacts, with_parameters

RTOL, MAX_STEPS = 1e-10, 10_000
NAMES = list(OUTPUTS)


def struck(model: ForceModel, lanes: Impacts, collapse: bool = True) -> Outputs:
    return collide(model, lanes, rtol=RTOL, max_steps=MAX_STEPS, collapse=collapse)


def differences(one: Outputs, other: Outputs, places: object = slice(None)) -> list[str]:
    """The outputs of which the bits differ, at some places of the first."""
    return [name for name in NAMES if every(one, name)[places].tobytes() != every(other, name).tobytes()]


def every(contact: Outputs, name: str) -> np.ndarray:
    """An output of every impact: one that is the same for all of them has length one."""
    return np.broadcast_to(contact[name], contact["e_out"].shape)


def law(force, *parameters: str, **given) -> ForceModel:
    """A law of one's own with dimensionless parameters."""
    own = tuple(Parameter(name, "1", name) for name in parameters)
    return ForceModel("own", "Own", 2026, equation="", reference="", force=force, parameters=own, **given)


# ---- statuses that need no integration

MISSING = {
    "they part": {"v1": 1.0, "v2": 2.0},
    "they move together": {"v1": 1.5, "v2": 1.5},
    "they part, and e is invalid": {"v1": 1.0, "v2": 2.0, "e": 1.2},
}


@pytest.mark.parametrize("given", MISSING.values(), ids=MISSING)
@pytest.mark.parametrize("key", ["hertz", "gharib-hurmuzlu-2012", "bilinear"])
def test_balls_that_do_not_approach_keep_their_velocities(key, given):
    contact = struck(find(key), table1_impacts(find(key).exponent or 1.5, **given))
    assert contact["status"][0] == Status.NO_IMPACT
    for velocities in (contact["v1_post"], contact["v1_reference"]):
        assert velocities[0] == given["v1"]
    for velocities in (contact["v2_post"], contact["v2_reference"]):
        assert velocities[0] == given["v2"]
    for none in ("v1_error", "v2_error", "peak_indentation", "permanent_indentation", "peak_force", "contact_time",
                 "energy_loss", "steps"):  # fmt: skip
        assert contact[none][0] == 0.0
    for unknown in ("e_out", "e_error", "energy_residual", "closed_form_error"):
        assert np.isnan(contact[unknown][0])


FAILED = ("v1_post", "v2_post", "v1_error", "v2_error", "e_out", "e_error", "peak_indentation", "contact_time",
          "permanent_indentation", "peak_force", "energy_loss", "energy_residual",
          "closed_form_error")  # fmt: skip
HOPELESS = {
    "e above 1": ({"e": 1.2}, Status.INVALID_PARAMETER),
    "e below 0": ({"e": -0.1}, Status.INVALID_PARAMETER),
    "no e": ({"e": np.nan}, Status.INVALID_PARAMETER),
    "two planes": ({"R1": np.inf, "R2": np.inf}, Status.OUT_OF_RANGE),
    "two walls": ({"m1": np.inf, "m2": np.inf, "R1": 0.1, "R2": 0.1}, Status.OUT_OF_RANGE),
    "an energy that overflows": ({"v1": 1e200}, Status.OUT_OF_RANGE),
    "an energy that underflows": ({"v1": 1e-200}, Status.OUT_OF_RANGE),
    "no stiffness": ({"K": 0.0}, Status.OUT_OF_RANGE),
    "unknown stiffness": ({"K": np.nan}, Status.OUT_OF_RANGE),
}


@pytest.mark.parametrize(("given", "status"), HOPELESS.values(), ids=HOPELESS)
@pytest.mark.parametrize("key", ["gharib-hurmuzlu-2012", "lankarani-nikravesh-1994"])
def test_impact_without_an_answer_says_why_and_is_nan(key, given, status):
    contact = struck(find(key), table1_impacts(**given))
    assert contact["status"][0] == status
    for name in FAILED:
        assert np.isnan(contact[name][0]), name


def test_an_impulse_too_large_for_a_number_gives_no_reference():
    contact = struck(find("hertz"), table1_impacts(e=0.5, v1=1e10, m1=1e300, m2=1e300))
    assert np.isnan([contact["v1_reference"][0], contact["v2_reference"][0]]).all()


@pytest.mark.parametrize("e", [-0.1, 1.2, np.nan])
def test_law_that_is_not_driven_by_e_does_not_mind_it(e):
    contact = struck(find("hertz"), table1_impacts(e=e))
    assert contact["status"][0] == Status.OK
    assert contact["e_out"][0] == pytest.approx(1.0, rel=0, abs=1e-9)
    assert np.isnan(contact["v1_reference"][0])
    assert np.isnan(contact["v1_error"][0])


@pytest.mark.parametrize(
    ("value", "status"), [(np.nan, Status.INVALID_PARAMETER), (np.inf, Status.OUT_OF_RANGE), (2.0, Status.OK)]
)
def test_coefficient_out_of_its_range(value, status):
    def force(elastic, v, damping):
        return elastic * (1.0 + damping * v)

    model = law(force, "c", coefficients={"damping": lambda c: np.where(c == 2.0, value, c)})
    lanes = table1_impacts(e=[0.5, 0.5], parameters={"c": [0.5, 2.0]})
    assert struck(model, lanes)["status"].tolist() == [Status.OK, status]


# ---- one poisoned lane among a thousand

COUNT, POISONED, POISON = 1000, 617, 2.0


def _refuses(elastic, chi):
    if np.any(chi == POISON):
        raise ValueError("this law does not like one lane")
    return elastic


def _not_finite(elastic, v, chi):
    return np.where(chi == POISON, np.nan, elastic * (1.0 + chi * v))


def _becomes_nan(elastic, v, chi, x):
    return np.where((chi == POISON) & (x > 0.3), np.nan, elastic * (1.0 + chi * v))


def _holds(elastic, v, chi):
    return np.where((chi == POISON) & (v < 0.0), -elastic, elastic * (1.0 + chi * v))


def _lets_through(elastic, v, chi):
    return np.where(chi == POISON, 0.0, elastic * (1.0 + chi * v))


def _pulls_ever_harder(elastic, v, chi):
    return np.where(chi == POISON, -v * v, elastic * (1.0 + chi * v))


def _raises(elastic, v, chi):
    return _refuses(elastic, chi) * (1.0 + chi * v)


def _ends_the_program(elastic, v, chi):
    if np.any(chi == POISON):
        sys.exit(0)
    return elastic * (1.0 + chi * v)


def _wrong_shape(elastic, v, chi):
    whole = elastic * (1.0 + chi * v)
    return whole[..., None] if np.any(chi == POISON) else whole


def _too_short(elastic, v, chi):
    whole = elastic * (1.0 + chi * v)
    return whole[1:] if np.any(chi == POISON) else whole


POISONS = {
    "the force is nan": (_not_finite, {Status.NOT_FINITE}),
    "the force becomes nan on the way": (_becomes_nan, {Status.NOT_FINITE}),
    # a force that jumps where the balls are at rest leaves no step that is small enough
    "the force holds the balls": (_holds, {Status.NOT_SEPARATED, Status.STEP_UNDERFLOW}),
    "the force is too weak": (_lets_through, {Status.NOT_SEPARATED}),
    "the force pulls ever harder": (_pulls_ever_harder, {Status.NOT_SEPARATED, Status.STEP_UNDERFLOW}),
    "the force raises": (_raises, {Status.MODEL_ERROR}),
    "the force ends the program": (_ends_the_program, {Status.MODEL_ERROR}),
    "the force has one axis too many": (_wrong_shape, {Status.MODEL_ERROR}),
    "the force has one value too few": (_too_short, {Status.MODEL_ERROR}),
}


@pytest.mark.parametrize("collapse", [True, False])
@pytest.mark.parametrize(("force", "statuses"), POISONS.values(), ids=POISONS)
def test_poisoned_lane_fails_alone(force, statuses, collapse):
    # the others are 200 kinds of impact, five of each
    chi = np.tile(np.linspace(0.01, 1.5, 200), COUNT // 200)
    chi[POISONED] = POISON
    model = law(force, "chi", oracle=lambda chi: delivered_restitution(chi))
    lanes = table1_impacts(e=0.5, m1=np.linspace(1.0, 2.0, COUNT), parameters={"chi": chi})
    poisoned = struck(model, lanes, collapse)
    assert Status(poisoned["status"][POISONED]) in statuses
    for name in FAILED:
        assert np.isnan(poisoned[name][POISONED]), name

    others = np.delete(np.arange(COUNT), POISONED)
    without = struck(model, lanes[others], collapse)
    assert np.all(without["status"] == Status.OK)
    assert differences(poisoned, without, others) == []


def test_law_that_always_raises_fails_everywhere():
    def force(elastic):
        raise ZeroDivisionError

    assert (
        struck(law(force), table1_impacts(e=np.linspace(0, 1, 7)))["status"].tolist() == [Status.MODEL_ERROR] * 7
    )


# ---- collapse

ordinary = st.sampled_from([0.0, 0.01, 0.2, 0.5, 0.9, 1.0])
restitution = st.one_of(ordinary, st.floats(0.005, 1.0), st.sampled_from([-0.1, 1.2]))
speed = st.sampled_from([-0.5, -0.0, 0.0, 1.0, 1.25, 1e-3, 30.0])


@settings(max_examples=12, deadline=None)
@given(
    key=st.sampled_from(sorted(LAWS)),
    rows=st.lists(st.tuples(restitution, speed, speed, st.sampled_from([0.5, 1.0, 7.0])), min_size=1, max_size=12),
)
def test_collapse_changes_no_bit(key, rows):
    e, v1, v2, m1 = np.array(rows).T
    model = find(key)
    lanes = table1_impacts(model.exponent or 1.5, e=e, v1=v1, v2=v2, m1=m1)
    lanes = replace(lanes, parameters={one.name: 1.0 + np.abs(e) for one in model.parameters})
    assert differences(struck(find(key), lanes), struck(find(key), lanes, collapse=False)) == []


@settings(max_examples=10, deadline=None)
@given(key=st.sampled_from(sorted(LAWS)), seed=st.integers(0, 999), size=st.integers(5, 20))
def test_trajectory_has_the_same_bits_in_any_order_and_block(key, seed, size):
    chance = np.random.default_rng(seed)
    e, n = chance.uniform(0.0, 1.0, 20), find(key).exponent or 1.5
    lanes = with_parameters(find(key), table1_impacts(n, e=e, v1=chance.uniform(0.1, 10.0, 20)), 1.0 - e)
    whole = struck(find(key), lanes)
    order = chance.permutation(20)
    for start in range(0, 20, size):
        places = order[start : start + size]
        assert differences(whole, struck(find(key), lanes[places]), places) == []


def test_exponents_do_not_mix():
    first, second = table1_impacts(1.5, e=[0.3, 0.6]), table1_impacts(2.5, e=[0.3, 0.6])
    both = Impacts(
        **{f.name: np.concatenate([getattr(first, f.name), getattr(second, f.name)])
           for f in fields(Impacts) if f.name != "parameters"}
    )  # fmt: skip
    for key in ("gharib-hurmuzlu-2012", "lankarani-nikravesh-1994"):
        contact = struck(find(key), both)
        assert differences(contact, struck(find(key), first), slice(0, 2)) == []
        assert differences(contact, struck(find(key), second), slice(2, 4)) == []


# ---- releases and coordinates that the built-in laws do not use


def kelvin_voigt(release: str) -> ForceModel:
    def force(K, m, x, v, zeta):
        return K * x + 2.0 * zeta * np.sqrt(K * m) * v

    return law(force, "zeta", exponent=1.0, release=release)


ZETA = np.array([0.0, 1e-18, 1e-16, 1e-12, 1e-8, 1e-3, 0.05, 0.2, 0.5, 0.8, 0.95])
ROOT = np.sqrt(1.0 - ZETA * ZETA)


@pytest.mark.parametrize(
    ("release", "e_out", "contact_time"),
    [
        ("force", np.exp(-2.0 * ZETA * np.arccos(ZETA) / ROOT), 2.0 * np.arccos(ZETA) / ROOT),
        ("gap", np.exp(-np.pi * ZETA / ROOT), np.pi / ROOT),
    ],
)
def test_linear_damped_contact_ends_at_its_release(release, e_out, contact_time):
    lanes = table1_impacts(1.0, parameters={"zeta": ZETA})
    contact = struck(kelvin_voigt(release), lanes)
    assert np.all(contact["status"] == Status.OK)
    assert contact["e_out"] == pytest.approx(e_out, rel=0, abs=1e-9)
    assert contact["contact_time"] * lanes.v0 / lanes.length == pytest.approx(contact_time, rel=1e-8)
    # the force vanishes while the balls still overlap: K x = 2 zeta v there
    left = 2.0 * ZETA * e_out if release == "force" else 0.0 * ZETA
    assert contact["permanent_indentation"] / lanes.length == pytest.approx(left, rel=0, abs=1e-9)
    assert np.abs(contact["energy_residual"]).max() <= 10 * RTOL


@pytest.mark.parametrize(("release", "delivered"), [("force", True), ("gap", False)])
def test_overdamped_contact_parts_only_where_its_force_vanishes(release, delivered):
    lanes = table1_impacts(1.0, parameters={"zeta": [1.5]})
    contact = collide(kelvin_voigt(release), lanes, rtol=RTOL, max_steps=1000)
    if delivered:
        root = np.sqrt(1.5**2 - 1.0)
        assert contact["e_out"][0] == pytest.approx(np.exp(-3.0 * np.arccosh(1.5) / root), rel=0, abs=1e-9)
    else:
        assert contact["status"][0] >= FIRST_FAILURE


@pytest.mark.parametrize("zeta", [0.01, 0.1, 0.3, 0.6, 0.9])
def test_damping_with_a_quarter_power_is_exact_in_its_smooth_coordinate(zeta):
    # F = x^1.5 + alpha x^0.25 v is the linear damped motion in x^1.25, with zeta = alpha/sqrt(5)
    def force(K, m, x, v, elastic, alpha):
        return elastic + alpha * np.sqrt(m * K) * np.sqrt(np.sqrt(x)) * v

    contact = struck(
        law(force, "alpha", coordinate_power=4), table1_impacts(parameters={"alpha": [zeta * np.sqrt(5.0)]})
    )
    exact = np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta * zeta))
    assert contact["e_out"][0] == pytest.approx(exact, rel=0, abs=1e-9)
    assert abs(contact["energy_residual"][0]) <= 10 * RTOL


# ---- scaling

LOGS = np.array([-30.0, -12.0, 0.0, 12.0, 30.0])
# two numbers with a dimension each: a damping, and a gap that is closed before the force sets in
DAMPED = ForceModel(
    "own", "Own", 2026, equation="", reference="",
    force=lambda K, x, v, n, c, gap: (K + c * v) * np.maximum(x - gap, 0.0) ** n,
    parameters=(Parameter("c", "N s/m^(n+1)", "damping"), Parameter("gap", "m", "gap")),
)  # fmt: skip


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0])
def test_masses_moduli_and_speeds_of_any_size_give_the_same_dimensionless_answer(n):
    mass, modulus, speed = (10.0 ** grid.ravel() for grid in np.meshgrid(LOGS, LOGS, LOGS))
    given = {"e": 0.3, "v1": speed, "m1": mass, "m2": 3.0 * mass, "E1": modulus, "E2": modulus}
    lanes = table1_impacts(n, **given)
    lanes = replace(lanes, parameters={"c": 0.4 * lanes.K / lanes.v0, "gap": 0.05 * lanes.length})
    contact = struck(DAMPED, lanes)
    assert np.all(contact["status"] == Status.OK)
    time, force = lanes.length / lanes.v0, lanes.m * lanes.v0**2 / lanes.length
    for values in (
        contact["e_out"],
        contact["v1_post"] / lanes.v0,
        contact["v2_post"] / lanes.v0,
        contact["peak_indentation"] / lanes.length,
        contact["peak_force"] / force,
        contact["contact_time"] / time,
        contact["energy_loss"] / (lanes.m * lanes.v0**2),
    ):
        assert values == pytest.approx(np.full_like(values, np.median(values)), rel=1e-9)
    # a gap only adds time at full speed before the damped contact
    assert contact["e_out"] == pytest.approx(float(delivered_restitution(0.4)), rel=0, abs=1e-8)


# a law that asks for radii or a strength has a size of its own
OF_NO_SIZE = [
    key for key in LAWS if find(key).quantities.isdisjoint({"R1", "R2", "R_eff", "yield_strength1", "Y_min"})
]


@pytest.mark.parametrize("key", OF_NO_SIZE)
def test_built_in_laws_scale_as_well(key):
    n = find(key).exponent or 1.5
    mass, modulus, speed = (10.0 ** grid.ravel() for grid in np.meshgrid(LOGS, LOGS, LOGS))
    lanes = table1_impacts(n, e=0.3, v1=speed, m1=mass, m2=mass, E1=modulus, E2=modulus)
    lanes = with_parameters(find(key), lanes, 1.0)
    contact = struck(find(key), lanes)
    # parameters that have a unit are rounded where they are converted
    assert np.ptp(contact["e_out"]) <= (1e-12 if lanes.parameters else 0.0)
    assert contact["contact_time"] * lanes.v0 / lanes.length == pytest.approx(
        np.full(len(lanes), contact["contact_time"][0] * lanes.v0[0] / lanes.length[0]), rel=1e-12
    )


# ---- laws that never part

DAMPING = impact.Parameter("c", "N s/m", "damping", least=0.0)
OVERDAMPED = {
    # law, the c at which balls part, and at which they creep apart for ever
    "linear": (
        {"force": lambda elastic, v, c: elastic + c * v, "exponent": 1.0},
        [1.0, 1.9],
        [2.0, 2.1, 10.0, 1e3],
    ),
    "Hertz": ({"force": lambda elastic, v, c: elastic + c * v, "exponent": 1.5}, [0.1, 1.0], [3.0, 30.0, 1e3]),
    "constant ratio": (
        {"force": lambda elastic, x, v, c: elastic + c * np.sqrt(np.sqrt(x)) * v, "exponent": 1.5},
        [1.0, 2.2],
        [2.3, 3.0, 100.0],
    ),
    "unloading branch": (
        {
            "force": lambda elastic: elastic,
            "unloading": lambda stretch, v, c: stretch + c * v,
            "residual": lambda peak: 0.3 * peak,
            "exponent": 1.0,
        },
        [1.0, 1.9],
        [2.1, 10.0],
    ),
    # the force vanishes before the indentation does
    "to zero force": (
        {"force": lambda elastic, v, c: elastic + c * v, "exponent": 1.0, "release": "force"},
        [1.0, 3.0, 30.0],
        [],
    ),
}


@pytest.mark.parametrize(("formulas", "part", "creep"), OVERDAMPED.values(), ids=OVERDAMPED)
def test_overdamped_laws_of_ones_own_are_not_separated(formulas, part, creep):
    texts = {"title": "", "year": 2026, "equation": "", "reference": ""}
    model = impact.ForceModel("overdamped", parameters=(DAMPING,), **texts, **formulas)
    sweep = {"v1": 1.0, "m1": 2.0, "m2": 2.0}
    # K of the sweep is for its n, which is 3/2
    own = {"K": 1.0} if model.exponent == 1.0 else {}
    source = {"models": "overdamped", "sweep": sweep if own else {**sweep, "K": 1.0},
              "model": {"overdamped": {"c": [*part, *creep], **own}},
              "solver": {"max_steps": 1000}}  # fmt: skip
    status = impact.sweep(source, plugins=[model])["status"].values[0].tolist()
    assert status == [Status.OK] * len(part) + [Status.NOT_SEPARATED] * len(creep)


def test_balls_that_part_slowly_only_lack_steps():
    # below an indentation of (c/2)^-2 the spring is stronger than the drag
    texts = {"title": "", "year": 2026, "equation": "", "reference": ""}
    model = impact.ForceModel(
        "slow", force=lambda elastic, x, v: elastic + 100.0 * np.sqrt(x) * v, exponent=1.0, **texts
    )
    source = {"models": "slow", "sweep": {"v1": 1.0, "m1": 2.0, "m2": 2.0, "n": 1.0, "K": 1.0}}
    few, many = (
        impact.sweep({**source, "solver": {"max_steps": steps}}, plugins=[model]) for steps in (100, 100_000)
    )
    assert (few["status"].item(), many["status"].item()) == (Status.MAX_STEPS, Status.OK)
    assert 0.0 < many["e_out"].item() < 1e-3


# ---- quantities of both balls together


def test_a_law_may_ask_for_effective_radius_and_modulus_and_the_lower_yield_strength():
    lanes = table1_impacts(m2=[1.0, 5.0, np.inf], E2=[56e9, 2e6, 210e9])
    in_effective = law(lambda x, E_eff, R_eff: 4 / 3 * E_eff * np.sqrt(R_eff) * x**1.5)
    contact, hertz = struck(in_effective, lanes), struck(find("hertz"), lanes)
    assert contact["peak_indentation"] == pytest.approx(hertz["peak_indentation"], rel=1e-9)
    lanes = replace(lanes, yield_strength1=np.full(3, 3e8), yield_strength2=np.array([2e8, 4e8, np.nan]))
    assert lanes.Y_min.tolist()[:2] == [2e8, 3e8]
    # of what is not known nothing is claimed
    assert np.isnan(lanes.Y_min[2])


def test_a_law_that_asks_for_an_effective_quantity_asks_for_the_materials():
    strength = law(lambda elastic, Y_min: elastic + 0 * Y_min)
    tables = {"models": "own", "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "n": 1.5, "material": "soft"},
              "materials": {"soft": {"E": 2e9, "nu": 0.3, "rho": 2712.0}}}  # fmt: skip
    with pytest.raises(ConfigError, match=r"materials.soft.yield_strength: missing.*asked for by own"):
        impact.sweep(tables, plugins=[strength])
