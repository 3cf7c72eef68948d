"""A collision ends with the right status; its outputs depend on no other impact of a batch and on no unit."""

import gc
import sys
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import impact
from impact.contact.closed_forms.hysteresis import delivered_restitution
from impact.contact.impacts import Impacts
from impact.contact.model import ForceModel, Parameter
from impact.contact.models import find
from impact.contact.output_formulas import Outputs, collide
from impact.contact.status import FIRST_FAILURE, Status
from impact.contact.variables import CENTRAL_OUTPUTS
from impact.errors import ConfigError

from .conftest import new_law
from .problems import LAWS, table1_impacts, with_parameters

RTOL, MAX_STEPS = 1e-10, 10_000
# where bits or statuses are compared, and not accuracy
LOOSE_RTOL = 1e-5
NAMES = list(CENTRAL_OUTPUTS)


def outputs_of(model: ForceModel, impacts: Impacts, collapse: bool = True, rtol: float = RTOL) -> Outputs:
    return collide(model, impacts, rtol=rtol, max_steps=MAX_STEPS, collapse=collapse)


def differing_outputs(whole: Outputs, part: Outputs, indices: object = slice(None)) -> list[str]:
    """The outputs whose bits differ between `part` and the impacts of `whole` with these indices."""
    return [
        name
        for name in NAMES
        if broadcast_output(whole, name)[indices].tobytes() != broadcast_output(part, name).tobytes()
    ]


def broadcast_output(outputs: Outputs, name: str) -> np.ndarray:
    """An output of every impact; the array of an output that is the same for all of them has length one."""
    return np.broadcast_to(outputs[name], outputs["e_out"].shape)


def user_law(force, *names: str, **fields_of_model) -> ForceModel:
    """A user-defined law with dimensionless parameters of these names."""
    parameters = tuple(Parameter(name, "1", name) for name in names)
    return new_law("user", force, parameters=parameters, **fields_of_model)


# ---- statuses that are known without an integration

NO_IMPACT = {
    "they separate": {"v1": 1.0, "v2": 2.0},
    "they move together": {"v1": 1.5, "v2": 1.5},
    "they separate, and e is invalid": {"v1": 1.0, "v2": 2.0, "e": 1.2},
}


@pytest.mark.parametrize("inputs", NO_IMPACT.values(), ids=NO_IMPACT)
@pytest.mark.parametrize("key", ["hertz", "gharib-hurmuzlu-2012", "bilinear"])
def test_balls_that_do_not_approach_keep_their_velocities(key, inputs):
    outputs = outputs_of(find(key), table1_impacts(find(key).exponent or 1.5, **inputs))
    assert outputs["status"][0] == Status.NO_IMPACT
    for velocities in (outputs["v1_post"], outputs["v1_reference"]):
        assert velocities[0] == inputs["v1"]
    for velocities in (outputs["v2_post"], outputs["v2_reference"]):
        assert velocities[0] == inputs["v2"]
    for name in (
        "v1_error",
        "v2_error",
        "peak_indentation",
        "permanent_indentation",
        "peak_force",
        "contact_time",
        "energy_loss",
        "steps",
    ):
        assert outputs[name][0] == 0.0
    for name in ("e_out", "e_error", "energy_residual", "closed_form_error"):
        assert np.isnan(outputs[name][0])


NAN_IF_FAILED = (
    "v1_post",
    "v2_post",
    "v1_error",
    "v2_error",
    "e_out",
    "e_error",
    "peak_indentation",
    "contact_time",
    "permanent_indentation",
    "peak_force",
    "energy_loss",
    "energy_residual",
    "closed_form_error",
)
NO_RESULT = {
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


@pytest.mark.parametrize(("inputs", "status"), NO_RESULT.values(), ids=NO_RESULT)
@pytest.mark.parametrize("key", ["gharib-hurmuzlu-2012", "lankarani-nikravesh-1994"])
def test_an_impact_without_a_result_has_a_status_and_is_nan(key, inputs, status):
    outputs = outputs_of(find(key), table1_impacts(**inputs))
    assert outputs["status"][0] == status
    for name in NAN_IF_FAILED:
        assert np.isnan(outputs[name][0]), name


def test_there_is_no_reference_velocity_if_the_impulse_overflows():
    outputs = outputs_of(find("hertz"), table1_impacts(e=0.5, v1=1e10, m1=1e300, m2=1e300))
    assert np.isnan([outputs["v1_reference"][0], outputs["v2_reference"][0]]).all()


@pytest.mark.parametrize("e", [-0.1, 1.2, np.nan])
def test_a_law_without_e_accepts_any_e_but_has_no_reference_for_an_invalid_one(e):
    outputs = outputs_of(find("hertz"), table1_impacts(e=e))
    assert outputs["status"][0] == Status.OK
    assert outputs["e_out"][0] == pytest.approx(1.0, rel=0, abs=1e-9)
    assert np.isnan(outputs["v1_reference"][0])
    assert np.isnan(outputs["v1_error"][0])


@pytest.mark.parametrize(
    ("value", "status"), [(np.nan, Status.INVALID_PARAMETER), (np.inf, Status.OUT_OF_RANGE), (2.0, Status.OK)]
)
def test_a_coefficient_that_is_not_finite_fails_its_impact_only(value, status):
    def force(elastic, v, damping):
        return elastic * (1.0 + damping * v)

    model = user_law(force, "c", coefficients={"damping": lambda c: np.where(c == 2.0, value, c)})
    impacts = table1_impacts(e=[0.5, 0.5], parameters={"c": [0.5, 2.0]})
    assert outputs_of(model, impacts)["status"].tolist() == [Status.OK, status]


# ---- one failing impact among 200: the law misbehaves where chi == POISON

COUNT, POISONED, POISON = 200, 117, 2.0


def _raise_at_poison(elastic, chi):
    if np.any(chi == POISON):
        raise ValueError("chi is the poison")
    return elastic


def _nan(elastic, v, chi):
    return np.where(chi == POISON, np.nan, elastic * (1.0 + chi * v))


def _becomes_nan(elastic, v, chi, x):
    return np.where((chi == POISON) & (x > 0.3), np.nan, elastic * (1.0 + chi * v))


def _never_separates(elastic, v, chi):
    return np.where((chi == POISON) & (v < 0.0), -elastic, elastic * (1.0 + chi * v))


def _vanishes(elastic, v, chi):
    return np.where(chi == POISON, 0.0, elastic * (1.0 + chi * v))


def _diverges(elastic, v, chi):
    return np.where(chi == POISON, -v * v, elastic * (1.0 + chi * v))


def _raises(elastic, v, chi):
    return _raise_at_poison(elastic, chi) * (1.0 + chi * v)


def _exits(elastic, v, chi):
    if np.any(chi == POISON):
        sys.exit(0)
    return elastic * (1.0 + chi * v)


def _extra_axis(elastic, v, chi):
    force = elastic * (1.0 + chi * v)
    return force[..., None] if np.any(chi == POISON) else force


def _too_few_values(elastic, v, chi):
    force = elastic * (1.0 + chi * v)
    return force[1:] if np.any(chi == POISON) else force


POISONS = {
    "the force is nan": (_nan, {Status.NOT_FINITE}),
    "the force becomes nan on the way": (_becomes_nan, {Status.NOT_FINITE}),
    # no step is small enough for a force that jumps where the balls are at rest
    "the balls never separate": (_never_separates, {Status.NOT_SEPARATED, Status.STEP_UNDERFLOW}),
    "the force vanishes": (_vanishes, {Status.NOT_SEPARATED}),
    "the force diverges": (_diverges, {Status.NOT_SEPARATED, Status.STEP_UNDERFLOW}),
    "the force raises": (_raises, {Status.MODEL_ERROR}),
    "the force exits the program": (_exits, {Status.MODEL_ERROR}),
    "the force has one axis too many": (_extra_axis, {Status.MODEL_ERROR}),
    "the force has one value too few": (_too_few_values, {Status.MODEL_ERROR}),
}


@pytest.mark.parametrize("collapse", [True, False])
@pytest.mark.parametrize(("force", "statuses"), POISONS.values(), ids=POISONS)
def test_an_impact_at_which_the_law_misbehaves_fails_alone(force, statuses, collapse):
    # the other impacts have 40 values of chi, each five times
    chi = np.tile(np.linspace(0.01, 1.5, COUNT // 5), 5)
    chi[POISONED] = POISON
    model = user_law(force, "chi", oracle=lambda chi: delivered_restitution(chi))
    impacts = table1_impacts(e=0.5, m1=np.linspace(1.0, 2.0, COUNT), parameters={"chi": chi})
    poisoned = outputs_of(model, impacts, collapse, LOOSE_RTOL)
    assert Status(poisoned["status"][POISONED]) in statuses
    for name in NAN_IF_FAILED:
        assert np.isnan(poisoned[name][POISONED]), name

    others = np.delete(np.arange(COUNT), POISONED)
    without = outputs_of(model, impacts[others], collapse, LOOSE_RTOL)
    assert np.all(without["status"] == Status.OK)
    assert differing_outputs(poisoned, without, others) == []


def test_a_law_that_always_raises_fails_at_every_impact():
    def force(elastic):
        raise ZeroDivisionError

    assert (
        outputs_of(user_law(force), table1_impacts(e=np.linspace(0, 1, 7)))["status"].tolist()
        == [Status.MODEL_ERROR] * 7
    )


# ---- deduplication and batches

typical_restitutions = st.sampled_from([0.0, 0.01, 0.2, 0.5, 0.9, 1.0])
restitutions = st.one_of(typical_restitutions, st.floats(0.005, 1.0), st.sampled_from([-0.1, 1.2]))
speeds = st.sampled_from([-0.5, -0.0, 0.0, 1.0, 1.25, 1e-3, 30.0])


@settings(max_examples=12, deadline=None)
@given(
    key=st.sampled_from(sorted(LAWS)),
    rows=st.lists(
        st.tuples(restitutions, speeds, speeds, st.sampled_from([0.5, 1.0, 7.0])), min_size=1, max_size=12
    ),
)
def test_deduplication_changes_no_bit(key, rows):
    e, v1, v2, m1 = np.array(rows).T
    model = find(key)
    impacts = table1_impacts(model.exponent or 1.5, e=e, v1=v1, v2=v2, m1=m1)
    impacts = replace(impacts, parameters={parameter.name: 1.0 + np.abs(e) for parameter in model.parameters})
    deduplicated, separate = (outputs_of(model, impacts, collapse, LOOSE_RTOL) for collapse in (True, False))
    assert differing_outputs(deduplicated, separate) == []


@settings(max_examples=10, deadline=None)
@given(key=st.sampled_from(sorted(LAWS)), seed=st.integers(0, 999), size=st.integers(5, 20))
def test_trajectory_has_the_same_bits_in_any_order_and_block(key, seed, size):
    rng, model = np.random.default_rng(seed), find(key)
    e = rng.uniform(0.0, 1.0, 20)
    impacts = table1_impacts(model.exponent or 1.5, e=e, v1=rng.uniform(0.1, 10.0, 20))
    impacts = with_parameters(model, impacts, 1.0 - e)
    whole = outputs_of(model, impacts, rtol=LOOSE_RTOL)
    order = rng.permutation(20)
    for start in range(0, 20, size):
        block = order[start : start + size]
        assert differing_outputs(whole, outputs_of(model, impacts[block], rtol=LOOSE_RTOL), block) == []


def test_impacts_of_different_exponents_do_not_affect_each_other():
    first, second = table1_impacts(1.5, e=[0.3, 0.6]), table1_impacts(2.5, e=[0.3, 0.6])
    both = Impacts(
        **{
            field.name: np.concatenate([getattr(first, field.name), getattr(second, field.name)])
            for field in fields(Impacts)
            if field.name != "parameters"
        }
    )
    for key in ("gharib-hurmuzlu-2012", "lankarani-nikravesh-1994"):
        outputs = outputs_of(find(key), both)
        assert differing_outputs(outputs, outputs_of(find(key), first), slice(0, 2)) == []
        assert differing_outputs(outputs, outputs_of(find(key), second), slice(2, 4)) == []


# ---- releases and coordinates that no built-in law uses


def kelvin_voigt(release: str) -> ForceModel:
    def force(K, m, x, v, zeta):
        return K * x + 2.0 * zeta * np.sqrt(K * m) * v

    return user_law(force, "zeta", exponent=1.0, release=release)


ZETA = np.array([0.0, 1e-18, 1e-16, 1e-12, 1e-8, 1e-3, 0.05, 0.2, 0.5, 0.8, 0.95])
ROOT = np.sqrt(1.0 - ZETA * ZETA)


@pytest.mark.parametrize(
    ("release", "e_out", "contact_time"),
    [
        ("force", np.exp(-2.0 * ZETA * np.arccos(ZETA) / ROOT), 2.0 * np.arccos(ZETA) / ROOT),
        ("gap", np.exp(-np.pi * ZETA / ROOT), np.pi / ROOT),
    ],
)
def test_a_linear_damped_contact_ends_at_its_release(release, e_out, contact_time):
    impacts = table1_impacts(1.0, parameters={"zeta": ZETA})
    outputs = outputs_of(kelvin_voigt(release), impacts)
    assert np.all(outputs["status"] == Status.OK)
    assert outputs["e_out"] == pytest.approx(e_out, rel=0, abs=1e-9)
    assert outputs["contact_time"] * impacts.v0 / impacts.length == pytest.approx(contact_time, rel=1e-8)
    # the force vanishes while the balls still overlap, where K x = 2 zeta v
    final_indentation = 2.0 * ZETA * e_out if release == "force" else 0.0 * ZETA
    assert outputs["permanent_indentation"] / impacts.length == pytest.approx(final_indentation, rel=0, abs=1e-9)
    assert np.abs(outputs["energy_residual"]).max() <= 10 * RTOL


@pytest.mark.parametrize(("release", "separates"), [("force", True), ("gap", False)])
def test_an_overdamped_contact_separates_only_if_it_ends_at_zero_force(release, separates):
    impacts = table1_impacts(1.0, parameters={"zeta": [1.5]})
    outputs = collide(kelvin_voigt(release), impacts, rtol=RTOL, max_steps=1000)
    if separates:
        root = np.sqrt(1.5**2 - 1.0)
        assert outputs["e_out"][0] == pytest.approx(np.exp(-3.0 * np.arccosh(1.5) / root), rel=0, abs=1e-9)
    else:
        assert outputs["status"][0] >= FIRST_FAILURE


@pytest.mark.parametrize("zeta", [0.01, 0.1, 0.3, 0.6, 0.9])
def test_damping_with_a_quarter_power_is_accurate_in_its_smooth_coordinate(zeta):
    # F = x^1.5 + alpha x^0.25 v is the linear damped motion in x^1.25, with zeta = alpha/sqrt(5)
    def force(K, m, x, v, elastic, alpha):
        return elastic + alpha * np.sqrt(m * K) * np.sqrt(np.sqrt(x)) * v

    outputs = outputs_of(
        user_law(force, "alpha", coordinate_power=4), table1_impacts(parameters={"alpha": [zeta * np.sqrt(5.0)]})
    )
    exact = np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta * zeta))
    assert outputs["e_out"][0] == pytest.approx(exact, rel=0, abs=1e-9)
    assert abs(outputs["energy_residual"][0]) <= 10 * RTOL


# ---- scaling

LOGS = np.array([-30.0, -12.0, 0.0, 12.0, 30.0])
# two parameters with dimensions: a damping, and a gap that closes before the force begins
DAMPED = new_law(
    "damped",
    lambda K, x, v, n, c, gap: (K + c * v) * np.maximum(x - gap, 0.0) ** n,
    parameters=(Parameter("c", "N s/m^(n+1)", "damping"), Parameter("gap", "m", "gap")),
)


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0])
def test_masses_moduli_and_speeds_of_any_size_give_the_same_dimensionless_answer(n):
    mass, modulus, speed = (10.0 ** grid.ravel() for grid in np.meshgrid(LOGS, LOGS, LOGS))
    inputs = {"e": 0.3, "v1": speed, "m1": mass, "m2": 3.0 * mass, "E1": modulus, "E2": modulus}
    impacts = table1_impacts(n, **inputs)
    impacts = replace(impacts, parameters={"c": 0.4 * impacts.K / impacts.v0, "gap": 0.05 * impacts.length})
    outputs = outputs_of(DAMPED, impacts)
    assert np.all(outputs["status"] == Status.OK)
    time, force = impacts.length / impacts.v0, impacts.m * impacts.v0**2 / impacts.length
    for values in (
        outputs["e_out"],
        outputs["v1_post"] / impacts.v0,
        outputs["v2_post"] / impacts.v0,
        outputs["peak_indentation"] / impacts.length,
        outputs["peak_force"] / force,
        outputs["contact_time"] / time,
        outputs["energy_loss"] / (impacts.m * impacts.v0**2),
    ):
        assert values == pytest.approx(np.full_like(values, np.median(values)), rel=1e-9)
    # the gap only adds time at full speed before the damped contact
    assert outputs["e_out"] == pytest.approx(float(delivered_restitution(0.4)), rel=0, abs=1e-8)


# radii or a yield strength are a second length scale
WITHOUT_LENGTH_SCALE = [
    key for key in LAWS if find(key).quantities.isdisjoint({"R1", "R2", "R_eff", "yield_strength1", "Y_min"})
]


@pytest.mark.parametrize("key", WITHOUT_LENGTH_SCALE)
def test_built_in_laws_do_not_depend_on_masses_moduli_and_speeds_of_any_size(key):
    n = find(key).exponent or 1.5
    mass, modulus, speed = (10.0 ** grid.ravel() for grid in np.meshgrid(LOGS, LOGS, LOGS))
    impacts = table1_impacts(n, e=0.3, v1=speed, m1=mass, m2=mass, E1=modulus, E2=modulus)
    impacts = with_parameters(find(key), impacts, 1.0)
    outputs = outputs_of(find(key), impacts, rtol=LOOSE_RTOL)
    # converting parameters with a unit rounds them
    assert np.ptp(outputs["e_out"]) <= (1e-12 if impacts.parameters else 0.0)
    assert outputs["contact_time"] * impacts.v0 / impacts.length == pytest.approx(
        np.full(len(impacts), outputs["contact_time"][0] * impacts.v0[0] / impacts.length[0]), rel=1e-12
    )


# ---- laws whose balls never separate

DAMPING = impact.Parameter("c", "N s/m", "damping", least=0.0)
OVERDAMPED = {
    # formulas, values of c at which the balls separate, and values at which they never do
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


@pytest.mark.slow
@pytest.mark.parametrize(("formulas", "separating", "creeping"), OVERDAMPED.values(), ids=OVERDAMPED)
def test_overdamped_user_laws_are_reported_as_not_separated(formulas, separating, creeping):
    texts = {"title": "", "year": 2026, "equation": "", "reference": ""}
    model = impact.ForceModel("overdamped", parameters=(DAMPING,), **texts, **formulas)
    sweep = {"v1": 1.0, "m1": 2.0, "m2": 2.0}
    # K of the sweep belongs to its n, which is 3/2
    parameters = {"K": 1.0} if model.exponent == 1.0 else {}
    config = {
        "models": "overdamped",
        "sweep": sweep if parameters else {**sweep, "K": 1.0},
        "model": {"overdamped": {"c": [*separating, *creeping], **parameters}},
        "solver": {"max_steps": 1000},
    }
    status = impact.sweep(config, plugins=[model])["status"].values[0].tolist()
    assert status == [Status.OK] * len(separating) + [Status.NOT_SEPARATED] * len(creeping)


def test_balls_that_separate_slowly_are_not_reported_as_not_separated():
    # below an indentation of (c/2)^-2 the spring is stronger than the damping
    model = new_law("slow", lambda elastic, x, v: elastic + 100.0 * np.sqrt(x) * v, exponent=1.0)
    config = {"models": "slow", "sweep": {"v1": 1.0, "m1": 2.0, "m2": 2.0, "n": 1.0, "K": 1.0}}
    few, many = (
        impact.sweep({**config, "solver": {"max_steps": steps}}, plugins=[model]) for steps in (100, 100_000)
    )
    assert (few["status"].item(), many["status"].item()) == (Status.MAX_STEPS, Status.OK)
    assert 0.0 < many["e_out"].item() < 1e-3


# ---- effective quantities of both balls


def test_a_law_may_use_effective_radius_and_modulus_and_the_lower_yield_strength():
    impacts = table1_impacts(m2=[1.0, 5.0, np.inf], E2=[56e9, 2e6, 210e9])
    in_effective = user_law(lambda x, E_eff, R_eff: 4 / 3 * E_eff * np.sqrt(R_eff) * x**1.5)
    outputs, hertz = outputs_of(in_effective, impacts), outputs_of(find("hertz"), impacts)
    assert outputs["peak_indentation"] == pytest.approx(hertz["peak_indentation"], rel=1e-9)
    impacts = replace(impacts, yield_strength1=np.full(3, 3e8), yield_strength2=np.array([2e8, 4e8, np.nan]))
    assert impacts.Y_min.tolist()[:2] == [2e8, 3e8]
    # an unknown strength may be the lower one
    assert np.isnan(impacts.Y_min[2])


def test_a_law_that_uses_an_effective_quantity_needs_the_materials():
    model = user_law(lambda elastic, Y_min: elastic + 0 * Y_min)
    config = {
        "models": "user",
        "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "n": 1.5, "material": "soft"},
        "materials": {"soft": {"E": 2e9, "nu": 0.3, "rho": 2712.0}},
    }
    with pytest.raises(ConfigError, match=r"materials.soft.yield_strength: missing.*used by user"):
        impact.sweep(config, plugins=[model])


def test_a_sweep_leaves_no_array_in_a_reference_cycle() -> None:
    sweep = {"e": [0.2, 0.8], "v1": [0.5, 1.0], "m1": 1.0, "m2": 1.0, "K": 6e9}
    config = {"models": ["gharib-hurmuzlu-2012", "kuwabara-kono-1987"], "sweep": sweep}
    impact.sweep(config, overrides=["model.kuwabara-kono-1987.A=1e-6"])
    gc.collect()
    gc.disable()
    try:
        impact.sweep(config, overrides=["model.kuwabara-kono-1987.A=1e-6"])
        gc.set_debug(gc.DEBUG_SAVEALL)
        gc.collect()
        kept = [value for item in gc.garbage for value in gc.get_referents(item) if isinstance(value, np.ndarray)]
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()
    assert kept == []
