"""A prepared problem gives what a run gives, for numbers and arrays, with and without friction."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pandas as pd
import pint
import pytest

import impact
from impact.contact.interpolant import CHECK_TOLERANCE

unit = pint.get_application_registry()
BALLS: dict[str, Any] = {"v1": 1.0, "m1": 1.0, "m2": 2.0, "R1": 0.01, "R2": 0.02, "K": 1e9, "e": 0.5}
FRICTION = {"models": "hertz", "frictions": "coulomb-1785", "sweep": {**BALLS, "u1": 0.3, "mu": 0.2}}
# inputs that vary, for laws whose motion depends on one, two and no dimensionless numbers
CASES = {
    "kuwabara-kono-1987": {"A": (1e-5, 3e-5), "v1": (0.5, 2.0)},
    "tsuji-1992": {"e": (0.2, 0.9), "m2": (0.5, 3.0)},
    "simbody-hunt-crossley": {"c": (0.1, 1.0), "v1": (0.5, 2.0)},
    "hertz": {"v1": (0.5, 2.0), "K": (1e8, 1e10)},
}


@pytest.mark.parametrize("model", CASES)
def test_a_prepared_problem_gives_what_a_run_gives(model: str) -> None:
    spans = CASES[model]
    config = {"models": model, "sweep": BALLS}
    parameters = {name: span[0] for name, span in spans.items() if name not in BALLS}
    if parameters:
        config["model"] = {model: parameters}
    problem = impact.prepare(config)
    generator = np.random.default_rng(7)
    points = {name: generator.uniform(*span, 5) for name, span in spans.items()}
    together = problem(points)
    for position in range(5):
        point = {name: float(values[position]) for name, values in points.items()}
        expected = impact.run(config, at=point).values
        for got in (problem(**point), {name: values[position] for name, values in together.items()}):
            for name in ("e_out", "v1_post", "peak_indentation", "peak_force", "contact_time"):
                assert got[name] == pytest.approx(expected[name], rel=10 * CHECK_TOLERANCE), name
            assert got["status"] == 1


def test_a_pair_with_friction_gives_what_a_run_gives() -> None:
    problem = impact.prepare(FRICTION, outputs=("beta", "e_out"))
    got = problem(mu=[[0.05], [0.2]], u1=[0.1, 0.3, 0.9])
    assert got["beta"].shape == got["friction_status"].shape == (2, 3)
    expected = impact.run(FRICTION, at={"mu": 0.05, "u1": 0.9}).values
    assert got["beta"][0, 2] == pytest.approx(expected["beta"], rel=1e-12)
    assert got["beta"][0, 2] != got["beta"][1, 2]


def test_a_parameter_that_the_config_does_not_have_is_an_input_by_its_name_alone() -> None:
    law = "lammps-mindlin"
    at = {"R1": 0.01, "R2": 0.02, "u1": 0.3, "mu": 0.2}
    problem = impact.prepare(model="hertz", friction=law, at=at, outputs=("beta",))
    chosen = problem(k_t=1e6)["beta"]
    assert chosen == problem(**{f"friction.{law}.k_t": 1e6})["beta"]
    assert chosen != pytest.approx(problem()["beta"], abs=1e-3)


def test_a_call_may_not_set_what_a_config_may_not_set_together() -> None:
    at = {"R1": 0.01, "R2": 0.02, "u1": 0.3, "mu": 0.2}
    law = "lammps-mindlin"
    chosen = impact.prepare(model="hertz", friction=law, at={**at, "kt_over_kn": 0.5})
    with pytest.raises(impact.UsageError, match="k_t: set together with kt_over_kn"):
        chosen(k_t=[1e6, 1e9])
    assert chosen(K=1e6)["friction_status"] == 1
    with pytest.raises(impact.UsageError, match="K is set, so that 8 G"):
        impact.prepare(model="hertz", friction=law, at=at)(K=1e6)


def test_a_pair_that_cannot_be_combined_is_refused() -> None:
    at = {"R1": 0.01, "R2": 0.02, "u1": 0.3, "mu": 0.2, "C": 10.0}
    for function in (impact.run, impact.prepare):
        with pytest.raises(impact.ConfigError, match="needs a contact force of n = 1"):
            function(model="kelvin-voigt", friction="lammps-mindlin", at=at)


@pytest.mark.parametrize(
    "half", ["50 %", np.float32(0.5), 0.5 * unit.dimensionless, pd.Series([0.5]), np.array([[0.5]]), [0.5]]
)
def test_inputs_are_those_of_any_library(half: Any) -> None:
    problem = impact.prepare(model="tsuji-1992", outputs="e_out")
    e = problem(e=half, v1="100 cm/s")["e_out"]
    assert np.shape(e) == np.shape(getattr(half, "magnitude", half))
    assert float(np.ravel(e)[0]) == pytest.approx(0.5, rel=1e-9)


def test_the_columns_of_a_data_frame_are_inputs() -> None:
    problem = impact.prepare(model="kuwabara-kono-1987", at={"A": 2e-5}, outputs="e_out")
    frame = pd.DataFrame({"A": [1e-5, 3e-5], "v1": [1, 2]})
    assert problem(frame)["e_out"].tolist() == problem(A=[1e-5, 3e-5], v1=[1.0, 2.0])["e_out"].tolist()


def test_a_problem_without_changes_is_the_impact_of_the_config_and_can_be_pickled() -> None:
    problem = impact.prepare(model="gharib-hurmuzlu-2012", at={"e": 0.5})
    expected = impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.5}).values["e_out"]
    assert problem()["e_out"] == pytest.approx(expected, rel=1e-14)
    problem(e=[0.2, 0.4])
    copy = pickle.loads(pickle.dumps(problem))
    assert copy(e=0.3)["e_out"] == problem(e=0.3)["e_out"]
    assert problem({"materials.table1.E": "70 GPa"})["contact_time"] < problem()["contact_time"]


def test_where_there_is_no_rebound_outputs_are_nan() -> None:
    got = impact.prepare(model="tsuji-1992")(v1=[1.0, -1.0])
    assert (got["status"].tolist(), np.isnan(got["e_out"]).tolist()) == ([1, 2], [False, True])


def test_a_spin_of_a_plane_has_no_result_and_a_status_that_says_so() -> None:
    sweep = {**BALLS, "u1": 0.3, "mu": 0.2, "m2": np.inf, "R2": np.inf}
    got = impact.prepare({**FRICTION, "sweep": sweep}, outputs="beta")(omega2=[0.0, 3.0])
    assert (got["friction_status"].tolist(), np.isnan(got["beta"]).tolist()) == ([1, 15], [False, True])


def test_balls_that_adhesion_holds_are_at_the_limit_as_in_a_run() -> None:
    sweep = {"v1": 0.01, "m1": 1e-3, "m2": np.inf, "R1": 0.01, "R2": np.inf, "material": "soft"}
    soft = {"E": 1e6, "nu": 0.3}
    problem = impact.prepare(
        {"models": "jkr-1971", "sweep": sweep, "materials": {"soft": soft}, "model": {"jkr-1971": {"gamma": 1.0}}}
    )
    for got in (problem(), problem(v1=0.01)):
        assert (got["status"], got["e_out"], got["v1_post"]) == (3, 0.0, 0.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"w1": 1.0}, 'no input "w1" of this law; known: K, R1, R2, e, m1, m2, '),
        ({"e": 2}, "e: got 2, expected a number from 0 to 1"),
        ({"e": "half"}, 'e: got "half", expected a number from 0 to 1'),
        ({"e": [-0.1, 0.5]}, "e: got -0.1, expected a number from 0 to 1"),
        ({"e": []}, "e: got no value, expected one or more"),
        ({"e": None}, "e: got nothing, expected a number from 0 to 1"),
        ({"e": [0.1, np.nan]}, "e: got nan, expected a number from 0 to 1"),
        (
            {"e": [0.1, 0.2], "v1": [1.0, 2.0, 3.0]},
            "got the shapes e (2,), v1 (3,), expected shapes that broadcast",
        ),
        ({"tsuji-1992.K": 1e9, "K": 1e9, "model.tsuji-1992.K": 1e9}, "got tsuji-1992.K twice, expected it once"),
        ({"e": True}, "e: got true, expected a number from 0 to 1"),
        ({"e": [[0.1], [0.1, 0.2]]}, "e: got a list, expected a number from 0 to 1"),
        ({"angle": 0.1}, 'no input "angle" of this law; '),
        ({"gharib-hurmuzlu-2012.K": 1e9}, 'no input "gharib-hurmuzlu-2012.K" of this law; '),
        (0.5, "values: got a float, expected Mapping[str, Any] | pd.DataFrame | None"),
    ],
)
def test_an_input_that_is_none_is_refused(values: Any, message: str) -> None:
    problem = impact.prepare(model="tsuji-1992", outputs="e_out")
    with pytest.raises(impact.UsageError) as refusal:
        problem(values)
    assert message in str(refusal.value)


def test_an_e_beside_an_alpha_is_refused() -> None:
    balls = {name: value for name, value in BALLS.items() if name != "e"}
    problem = impact.prepare({"models": "tsuji-1992", "sweep": {**balls, "alpha": 0.1}})
    with pytest.raises(impact.UsageError, match='no input "e" of this law'):
        problem(e=0.5)


def test_impacts_of_several_exponents_are_those_of_each_and_arrays_are_of_the_caller() -> None:
    problem = impact.prepare(
        {"models": "hunt-crossley-1975", "sweep": {**BALLS, "n": 1.0}}, outputs="contact_time"
    )
    e = np.array([0.5, 0.7, 0.9])
    for _ in range(2):
        both = problem(e=e, n=[[1.0], [1.5]])["contact_time"]
        assert both[0] == pytest.approx(problem(e=e)["contact_time"])
        single = impact.prepare({"models": "hunt-crossley-1975", "sweep": {**BALLS, "n": 1.5}})
        assert both[1] == pytest.approx(single(e=e)["contact_time"])
        both *= 2.0


def test_an_output_that_the_law_lacks_is_refused() -> None:
    with pytest.raises(impact.UsageError, match='no output "beta" of this law'):
        impact.prepare(model="hertz", outputs="beta")
    with pytest.raises(impact.UsageError, match='got the integrator "kick-drift", expected "exact"'):
        impact.prepare({"models": "hertz", "sweep": {**BALLS, "dt": 1e-6}, "solver": {"integrator": "kick-drift"}})


def test_an_exponent_that_the_law_fixes_is_no_input() -> None:
    with pytest.raises(impact.UsageError, match='no input "n" of this law'):
        impact.prepare(model="tsuji-1992", at={"v1": 1.0})(n=1.5)


def test_a_pair_takes_arrays_of_inputs_on_which_its_tangential_problem_does_not_depend() -> None:
    sweep = {"e": 0.5, "speed": 1.0, "angle": [0.1, 0.9], "mu": 0.1, "m1": 1.0, "m2": 1.0, "R1": 0.02, "R2": 0.02}
    source = {"models": "hertz", "frictions": "coulomb-1785", "sweep": {**sweep, "K": 1e6}}
    beta = impact.prepare(source, at={"angle": 0.1}, outputs="beta")(angle=[0.1, 0.9])["beta"]
    np.testing.assert_array_equal(beta, impact.sweep(source)["beta"].values.ravel())


@pytest.mark.parametrize("has_parameter", [False, True])
def test_a_law_with_a_branch_on_an_array_has_no_result_as_in_a_sweep(has_parameter: bool) -> None:
    def branching(elastic: Any, v: Any) -> Any:
        return elastic if v > 0.0 else 0.5 * elastic

    def with_parameter(elastic: Any, v: Any, share: Any) -> Any:
        return elastic if v > 0.0 else share * elastic

    own = (impact.Parameter("share", "1", "kept on restitution", default=0.5),) if has_parameter else ()
    force = with_parameter if has_parameter else branching
    law = impact.ForceModel("branching", "Branching", 2026, "F = K δ^(3/2)", "", force=force, parameters=own)
    config = {"models": "branching", "sweep": BALLS}
    problem = impact.prepare(config, plugins=[law], outputs="e_out")
    with pytest.warns(impact.ImpactWarning, match="formulas work on arrays: use np.where instead of if"):
        assert problem()["status"] == 16
    with pytest.warns(impact.ImpactWarning, match="formulas work on arrays"):
        assert impact.sweep(config, plugins=[law])["status"].item() == 16
