"""Each act with a meaning for friction takes friction laws: run, solve, recommend, calibrate, sensitivity."""

from __future__ import annotations

import json
import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact
from impact.errors import ConfigError, UsageError
from impact.results.schema import FIT_STATUSES

from .conftest import ROOT, Run

ANGLE = math.radians(60.0)
# like solid spheres of the linear or Hertzian contact: m_t/m is 2/7
CONFIG: dict[str, Any] = {
    "models": ["hertz", "tsuji-1992"],
    "frictions": ["coulomb-1785", "lammps-mindlin"],
    "sweep": {
        "v1": 1.0,
        "angle": ANGLE,
        "mu": 0.1,
        "m1": 1.0,
        "m2": 1.0,
        "R1": 0.1,
        "R2": 0.1,
        "K": 1e6,
        "e": 0.8,
    },
    "friction": {"lammps-mindlin": {"kt_over_kn": 0.8, "xt": 0.0}},
}


def config(**changes: Any) -> dict[str, Any]:
    """CONFIG with other values of [sweep]; a key of another table is that table."""
    tables = {name: changes.pop(name) for name in ("models", "frictions", "friction", "design") if name in changes}
    return {**CONFIG, **tables, "sweep": {**CONFIG["sweep"], **changes}}


def pair_at(source: dict[str, Any], model: str, friction: str, **at: float) -> impact.Impact:
    return impact.run(source, model=model, friction=friction, at=at)


# ---- run

LAWS = {
    "coulomb-1785": {},
    "lammps-mindlin": {"kt_over_kn": 0.8, "xt": 0.0},
    "lammps-mindlin-rescale": {"kt_over_kn": 0.8, "xt": 0.5},
    "lammps-linear-nohistory": {"xt": 1.0},
    "drake-regularized": {"v_s": 0.01},
}


# a small angle sticks and slides, a large one slides throughout
@pytest.mark.slow
@pytest.mark.parametrize(
    ("friction", "angle"), [*((friction, 10.0) for friction in LAWS), ("lammps-mindlin", 60.0)]
)
def test_the_history_of_slip_and_friction_is_that_of_the_outputs(friction: str, angle: float) -> None:
    source = config(frictions=[friction], friction={friction: LAWS[friction]} if LAWS[friction] else {})
    shot = pair_at(source, "tsuji-1992", friction, angle=math.radians(angle))
    assert shot.history is not None
    history, m_t = shot.history, shot.derived["m_t"]
    assert history["slip"].values[0] == pytest.approx(shot.derived["slip"], rel=1e-12)
    assert history["slip"].values[-1] == pytest.approx(shot.values["slip_post"], rel=1e-6, abs=1e-9)
    # the impulse of friction changes the slip: by the trapezoidal rule, across the corners of the force
    impulse = np.trapezoid(history["f"].values, history["t"].values)
    assert impulse == pytest.approx(m_t * (shot.derived["slip"] - shot.values["slip_post"]), rel=5e-3)
    # near first contact and release the force of the dashpot x^(1/4) is steep in time
    limit = 0.1 * np.abs(history["F"].values)
    assert (np.abs(history["f"].values) <= limit * (1.0 + 1e-6) + 1e-3 * limit.max()).all()
    slides = np.abs(history["mode"].values) == 1
    if friction != "drake-regularized":
        np.testing.assert_allclose(
            np.abs(history["f"].values[slides]), limit[slides], rtol=1e-4, atol=1e-3 * limit.max()
        )
    assert {*np.unique(history["mode"].values)} <= {-2, -1, 0, 1, 2}


@pytest.mark.parametrize("v1", [0.5, 2.0])
def test_the_history_of_sliding_ends_with_the_slip_of_the_outputs_at_any_speed(v1: float) -> None:
    shot = impact.run(config(frictions=["coulomb-1785"], friction={}), at={"v1": v1, "angle": math.radians(60.0)})
    assert shot.history is not None
    assert shot.history["slip"].values[0] == pytest.approx(v1 * math.tan(math.radians(60.0)), rel=1e-12)
    assert shot.history["slip"].values[-1] == pytest.approx(shot.values["slip_post"], rel=1e-6)


def test_a_law_with_other_parameters_in_its_restitution_has_a_history_of_slip() -> None:
    """The elastic-plastic law of Johnson has an unloading branch, whose parameters the approach does not have."""
    source = config(models="johnson-1985", frictions=["lammps-mindlin"], K=None)
    source["sweep"] = {k: v for k, v in source["sweep"].items() if k not in ("K", "e")} | {"material": "steel"}
    shot = impact.run(source)
    assert shot.history is not None
    assert shot.values["permanent_indentation"] > 0.0
    assert shot.history["slip"].values[-1] == pytest.approx(shot.values["slip_post"], rel=1e-6)
    # a trapezoid of the friction is the change of the slip, to the accuracy of its steps
    change = np.trapezoid(shot.history["f"].values, shot.history["t"].values) / shot.derived["m_t"]
    slip = shot.history["slip"].values
    assert abs(change) == pytest.approx(abs(slip[-1] - slip[0]), rel=1e-3)


def test_the_history_of_a_spring_that_stays_at_its_limit_is_that_of_the_outputs() -> None:
    source = config(frictions=["yade-mindlin"], friction={"yade-mindlin": {"kt_over_kn": 0.8, "betas": 0.3}})
    shot = impact.run(source, at={"angle": math.atan(0.5), "mu": 0.1})
    assert shot.history is not None
    t, slip, f, mode = (shot.history[name].values for name in ("t", "slip", "f", "mode"))
    held = np.abs(mode) == 2
    assert np.ptp(t[held]) > 0.1 * t[-1]
    assert slip[-1] == pytest.approx(shot.values["slip_post"], rel=1e-6)
    impulses = np.concatenate([[0.0], np.cumsum(0.5 * (f[1:] + f[:-1]) * np.diff(t))])
    np.testing.assert_allclose(slip[0] - impulses / shot.derived["m_t"], slip, atol=1e-3 * abs(slip[0]))


def test_the_history_has_the_mirrored_slip_of_a_mirrored_impact() -> None:
    source = config(frictions=["lammps-mindlin"])
    del source["sweep"]["angle"]
    left, right = (impact.run(source, at={"u1": u1}, times=50).history for u1 in (-0.7, 0.7))
    assert left is not None
    assert right is not None
    for name in ("slip", "f", "mode"):
        np.testing.assert_array_equal(left[name].values, -right[name].values)
    np.testing.assert_array_equal(left["F"].values, right["F"].values)


@pytest.mark.slow
def test_a_run_is_the_point_of_the_sweep_of_its_pair() -> None:
    source = config(angle=[0.2, ANGLE], mu=[0.1, 0.3])
    result = impact.sweep(source)
    point = {"angle": ANGLE, "mu": 0.3}
    for model in CONFIG["models"]:
        for friction in CONFIG["frictions"]:
            shot = impact.run(result, model=model, friction=friction, at=point)
            pair = result.sel(model=model, friction=friction, **point)
            for name in ("beta", "omega1_post", "rebound_angle", "e_out", "friction_status"):
                assert shot.values[name] == pair[name].item(), (model, friction, name)
    assert impact.run(source).as_dict()["friction"] == "coulomb-1785"
    assert "friction" not in impact.run().as_dict()
    central = impact.run().history
    assert central is not None
    assert not {"slip", "f", "mode"} & {*map(str, central)}


@pytest.mark.slow
def test_the_command_runs_an_oblique_impact_without_a_config(cli: Run, tmp_path: Path) -> None:
    words = ("run", "--friction", "coulomb-1785", "--at", "mu=0.3", "--at", "angle=30 deg")
    text = cli(*words).stdout
    # two thirds of the tangential velocity of rolling without sliding remain: 5/7
    assert "e_t                          0.714286 " in text
    assert "angle                        30° " in text
    assert "sticks and slides" in text
    data = json.loads(cli(*words, "--json").stdout)
    assert data["friction"] == "coulomb-1785"
    assert data["outputs"]["friction_status"] == "ok"
    assert data["inputs"]["friction.coulomb-1785.limit"] == "abs"
    for suffix in ("csv", "h5"):
        path = tmp_path / f"history.{suffix}"
        assert f"{path}: " in cli(*words, "--history", str(path)).stderr
    assert ",slip [m/s],f [N],mode\n" in (tmp_path / "history.csv").read_text(encoding="utf-8")
    assert impact.load(tmp_path / "history.h5")["f"].attrs["units"] == "N"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("run", "--friction", "coulom"), 'no friction law "coulom"; did you mean "coulomb-1785"?'),
        (("run", "--at", "mu=0.3"), "sweep.mu: set without a friction law, expected --friction KEY\n"),
        (
            ("run", "--model", "bilinear", "--friction", "lammps-linear-nohistory", "--at", "mu=0.3"),
            "the contact force has no dashpot",
        ),
        (
            ("solve", "--model", "hertz", "--for", "mu", "--target", "e_out=1"),
            'hertz has no parameter "mu"; expected --friction KEY',
        ),
        (
            ("solve", "--model", "hertz", "--for", "mu", "--target", "beta=0", "--friction", "coulomb-1785"),
            "no beta at any value of mu: -g1/g0 has no value at these inputs",
        ),
        (("solve", "--model", "tsuji-1992", "--for", "e", "--target", "beta=0"), "expected --friction KEY"),
        (("recommend", "central.h5", "--target", "beta=0"), "its sweep has no frictions"),
        (("recommend", "central.h5", "--target", "v1_post=0"), "expected an output of the order of 1"),
        (("recommend", "central.h5", "--friction", "coulomb-1785"), "expected a --target"),
        (("sensitivity", "central.toml", "--of", "beta"), "got no friction law"),
        (("calibrate", "fit.toml"), "got a measured beta without a friction law"),
    ],
)
def test_a_mistake_is_an_error_of_one_line(cli: Run, tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    central = 'models = "hertz"\n[sweep]\nv1 = 1.0\nm1 = 1.0\nm2 = 1.0\nK = 1e6\ne = { fit = [0.1, 1.0] }\n'
    (tmp_path / "fit.toml").write_text(central + "[data.columns]\nbeta = [0.1]\nangle = [0.1]\n", encoding="utf-8")
    (tmp_path / "central.toml").write_text(central.replace("{ fit = [0.1, 1.0] }", "0.5"), encoding="utf-8")
    if "central.h5" in words:
        impact.sweep(tmp_path / "central.toml", output=tmp_path / "central.h5")
    result = cli(*words, cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


# ---- solve


@pytest.mark.slow
def test_solve_finds_the_mu_that_slides_with_a_given_beta() -> None:
    # Hertz, e = 1, slides throughout: beta = 2/G0 - 1, G0 = (2/7) tan(angle)/mu
    found = impact.solve("hertz", "mu", {"beta": -0.5}, friction="coulomb-1785", source=CONFIG)
    assert [root.value for root in found.roots] == [pytest.approx(math.tan(ANGLE) / 14.0, rel=1e-8)]
    assert found.as_dict()["friction"] == "coulomb-1785"
    sticks = impact.solve("hertz", "mu", {"beta": 0.4}, friction="coulomb-1785", source=CONFIG)
    assert sticks.status == "no_root"
    assert str(sticks).startswith("hertz with coulomb-1785: no value of mu gives beta = 0.4; beta is from -1 to 0")


def test_the_end_of_the_scan_is_no_root_where_every_larger_value_gives_the_target() -> None:
    """With this mu or more the slip stops before the balls separate: mu (7/2)(1 + e_out) = tan(angle)."""
    result = impact.solve("hertz", "mu", {"beta": 0.0}, friction="coulomb-1785", source=CONFIG)
    assert [root.value for root in result.roots] == pytest.approx([math.tan(ANGLE) / 7.0], rel=1e-8)


def test_each_root_has_the_target_variable_beside_e_out() -> None:
    result = impact.solve("hertz", "mu", {"beta": -0.5}, friction="coulomb-1785", source=CONFIG)
    (root,) = result.as_dict()["roots"]
    # Hertz, e = 1, slides throughout: beta = 2/G0 - 1, G0 = (2/7) tan(angle)/mu
    expected = {"value": math.tan(ANGLE) / 14.0, "e_out": 1.0, "beta": -0.5}
    assert root == pytest.approx(expected, rel=1e-8)
    assert list(result.to_dataframe()) == ["value", "e_out", "beta"]


@pytest.mark.slow
@pytest.mark.parametrize("xt", [0.0, 1.0])
def test_solve_warns_of_a_limit_that_no_time_step_delivers(xt: float) -> None:
    source = {
        "models": "tsuji-1992",
        "frictions": "lammps-mindlin",
        "sweep": {
            "e": 0.8,
            "speed": 1.0,
            "angle": "30 deg",
            "m1": 1.0,
            "m2": 1.0,
            "R1": 0.01,
            "R2": 0.01,
            "K": 1e9,
        },
        "friction": {"lammps-mindlin": {"kt_over_kn": 0.8, "xt": xt}},
        "solver": {"rtol": 1e-6},
    }
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert impact.solve("tsuji-1992", "mu", {"beta": 0.1}, source=source).roots
    expected = ["tsuji-1992 with lammps-mindlin: beta is the limit of small steps, "] if xt else []
    assert [str(warning.message)[:66] for warning in caught] == expected


def test_solve_writes_a_target_with_its_unit() -> None:
    steep = impact.solve("hertz", "mu", {"rebound_angle": "20 deg"}, friction="coulomb-1785", source=CONFIG)
    text = str(steep)
    assert "no value of mu gives rebound_angle = 20°; rebound_angle is from " in text
    assert text.endswith("to 60°")


@pytest.mark.slow
def test_a_target_of_the_command_may_have_a_unit(cli: Run) -> None:
    words = ("solve", "--model", "hertz", "--friction", "coulomb-1785", "--for", "mu", "--at", "angle=60 deg")
    (root,) = json.loads(cli(*words, "--target", "rebound_angle=55 deg", "--json").stdout)["roots"]
    # elastic balls that slide throughout lose 2 mu v0 of their tangential velocity
    assert root["value"] == pytest.approx((math.tan(ANGLE) - math.tan(math.radians(55.0))) / 2.0)


@pytest.mark.slow
def test_solve_finds_the_values_beside_an_extremum_between_those_of_its_scan() -> None:
    at = {"angle": "45 deg", "omega1": 0}
    result = impact.solve(
        "exact-dashpot-no-tension",
        "kt_over_kn",
        {"e_t": 0.7405},
        friction="cundall-strack-1979",
        source=ROOT / "docs" / "spin.toml",
        at=at,
    )
    # beside the soft spring the scan has 2.74 and 3.16, of a smaller e_t
    assert [root.value for root in result.roots] == pytest.approx([0.077158, 2.753365, 3.107913], rel=1e-5)
    assert result.attainable == pytest.approx((0.282051, 1.0), abs=1e-6)


@pytest.mark.slow
def test_solve_finds_a_slip_speed_of_a_friction_law() -> None:
    """Its natural size is a speed, that of the impact, and not a number of the contact law."""
    law = {"drake-regularized": {"v_s": 0.01}}
    source = config(frictions="drake-regularized", friction=law, angle=0.7, mu=0.3, v1=1e-3)
    found = impact.solve("hertz", "v_s", {"beta": -0.4}, source=source)
    assert found.as_dict()["unit"] == "m/s"
    (root,) = found.roots
    assert 1e-6 < root.value < 1e-2
    at = {"friction.drake-regularized.v_s": root.value}
    assert impact.run(source, model="hertz", at=at).values["beta"] == pytest.approx(-0.4, abs=1e-8)


@pytest.mark.long
@pytest.mark.parametrize("name", ["kt_over_kn", "friction.lammps-mindlin.kt_over_kn"])
def test_solve_finds_a_friction_parameter_that_gives_the_output_again(name: str) -> None:
    source = config(frictions="lammps-mindlin", friction={"lammps-mindlin": {"xt": 0.0}}, mu=0.5)
    found = impact.solve("tsuji-1992", name, {"omega1_post": -5.5}, source=source)
    assert found.roots
    for root in found.roots:
        at = {"friction.lammps-mindlin.kt_over_kn": root.value}
        again = impact.run(source, model="tsuji-1992", at=at).values["omega1_post"]
        assert again == pytest.approx(-5.5, rel=1e-7)


# ---- recommend


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> dict[str, xr.Dataset]:
    source = config(
        models=["hertz", "tsuji-1992", "lankarani-nikravesh-1994"],
        angle={"linspace": [0.0, 1.4, 8]},
        mu=[0.1, 0.3],
        friction={"lammps-mindlin": {"kt_over_kn": [0.8, 1.2], "xt": 0.0}},
    ) | {"solver": {"rtol": 1e-6}}
    folder = tmp_path_factory.mktemp("recommend")
    layouts = ("full", "factored")
    return {
        layout: impact.sweep(source, output=folder / f"{layout}.h5", overrides=[f'output.layout="{layout}"'])
        for layout in layouts
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("layout", "output", "target"),
    [
        ("full", "beta", 0.1),
        ("factored", "beta", 0.1),
        ("factored", "e_t", 0.7),
        ("full", "impulse_ratio", 0.1),
    ],
)
def test_pairs_are_ranked_by_their_distance_from_the_target(
    swept: dict[str, xr.Dataset], layout: str, output: str, target: float
) -> None:
    result = swept[layout]
    ranking = impact.recommend(result, target={output: target}, tol=0.2)
    shares = [law.share for law in ranking.models]
    assert shares == sorted(shares, reverse=True)
    assert {(law.model, law.friction) for law in ranking.models} == {
        (model, friction) for model in result["model"].values for friction in result["friction"].values
    }
    for law in ranking.models:
        parameters = {name: float(value) for name, value in law.parameters.items()}
        pair = result.sel(model=law.model, friction=law.friction, **parameters)
        if not parameters:
            pair = pair.isel({"friction.lammps-mindlin.kt_over_kn": 0})
        # without a slip there is no such output
        distance = np.abs(pair[output].values - target)
        distance = distance[~np.isnan(distance)]
        assert law.within == np.count_nonzero(distance <= 0.2)
        assert law.points == distance.size
        assert law.max_error == distance.max()
        assert law.mean_error == pytest.approx(distance.mean(), rel=1e-12)
        assert bool(law.parameters) == (law.friction == "lammps-mindlin")


@pytest.mark.slow
def test_the_ranking_by_e_error_has_no_word_of_friction(swept: dict[str, xr.Dataset], cli: Run) -> None:
    path = swept["factored"].encoding["source"]
    default = cli("recommend", path, "--json").stdout
    assert "friction" not in default.replace("friction.lammps", "")
    assert {"target", "friction"}.isdisjoint(json.loads(default))
    pairs = json.loads(
        cli("recommend", path, "--target", "beta=0.1", "--friction", "coulomb-1785", "--json").stdout
    )
    assert pairs["target"] == {"beta": 0.1}
    assert {law["friction"] for law in pairs["models"]} == {"coulomb-1785"}
    assert "beta" in pairs["models"][0]
    e_out = impact.recommend(swept["factored"], target={"e_out": 0.8})
    assert [law.name for law in e_out.best] == ["tsuji-1992", "lankarani-nikravesh-1994"]


def test_angles_of_a_ranking_are_in_degrees() -> None:
    one_pair = {"models": ["hertz"], "frictions": ["coulomb-1785"], "friction": {}}
    source = config(**one_pair, angle={"linspace": ["10 deg", "60 deg", 6]})
    result = impact.sweep(source)
    target = {"rebound_angle": "20 deg"}
    ranking = impact.recommend(result, target=target, tol="0.5 deg")
    assert ranking.tol == math.radians(0.5)
    assert ranking.headline.startswith("no pair gives rebound_angle = 20° within 0.5°")
    assert ranking.headings[:2] == ("pair", "points within 0.5°")
    law = ranking.models[0]
    assert law.row[2] == f"{math.degrees(law.max_error):.3g}°"
    assert law.row[5].endswith(f"rebound_angle {math.degrees(law.e_out):.4g}°")
    with pytest.raises(impact.ImpactError, match=re.escape('tol: got "1 m", expected a unit of rad')):
        impact.recommend(result, target=target, tol="1 m")
    with pytest.raises(impact.UsageError, match=re.escape('got 20 rad; did you mean "20 deg"?')):
        impact.recommend(result, target={"rebound_angle": 20})


# ---- calibrate


@pytest.mark.long
def test_calibrate_recovers_mu_and_the_stiffness_and_finds_the_law(tmp_path: Path) -> None:
    angles = [10.0, 20.0, 30.0, 45.0, 60.0, 75.0]
    truth = config(models="tsuji-1992", frictions="lammps-mindlin", angle=[math.radians(a) for a in angles])
    measured = impact.sweep(truth).isel(model=0, friction=0)
    fit = config(models="tsuji-1992", mu={"fit": [0.01, 0.5]})
    del fit["sweep"]["angle"]
    fit["friction"] = {"lammps-mindlin": {"kt_over_kn": {"fit": [0.3, 2.0]}, "xt": 0.0}}
    fit["data"] = {
        "columns": {
            "angle": np.radians(angles).tolist(),
            **{name: measured[name].values.tolist() for name in ("e_t", "omega1_post")},
            "sigma_e_t": [0.01] * 6,
            "sigma_omega1_post": [0.1] * 6,
        }
    }
    best = tmp_path / "best.toml"
    result = impact.calibrate(fit, best=best)
    assert result["model"].values.tolist() == ["tsuji-1992 with lammps-mindlin", "tsuji-1992 with coulomb-1785"]
    assert result["friction"].values.tolist() == ["lammps-mindlin", "coulomb-1785"]
    estimates = result["estimate"].isel(model=0)
    assert estimates.sel(parameter="mu").item() == pytest.approx(0.1, rel=1e-5)
    assert estimates.sel(parameter="friction.lammps-mindlin.kt_over_kn").item() == pytest.approx(0.8, rel=1e-4)
    # Coulomb's friction does not have the parameter
    assert result["identifiable"].isel(model=1).values.tolist() == [1, -1]
    assert "  kt_over_kn" in str(impact.describe(result))
    again = impact.sweep(best).isel(model=0, friction=0)
    np.testing.assert_allclose(again["e_t"].values, measured["e_t"].values, rtol=1e-4)
    impact.save(result, tmp_path / "fit.h5")
    xr.testing.assert_equal(impact.load(tmp_path / "fit.h5").load(), result)


@pytest.mark.slow
def test_calibrate_says_which_pair_cannot_be_combined_and_why() -> None:
    source: dict[str, Any] = {
        "models": ["kelvin-voigt", "tsuji-1992"],
        "frictions": ["lammps-mindlin"],
        "sweep": {"e": 0.8, "v1": 1.0, "u1": 0.5, "m1": 0.1, "m2": 0.2, "R1": 0.01, "mu": {"fit": [0.05, 0.6]}},
        "model": {"kelvin-voigt": {"C": 1000.0}},
        "data": {"columns": {"beta": [0.1, 0.12]}},
        "solver": {"rtol": 1e-5},
    }
    source["sweep"] |= {"material": "steel"}
    source["materials"] = {"steel": {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}}
    reason = "kelvin-voigt with lammps-mindlin: 8 G* a needs a contact force of n = 1.5; set k_t"
    with pytest.warns(impact.ImpactWarning, match=re.escape(f"{reason}; these points are NaN")):
        result = impact.calibrate(source)
    statuses = dict(zip(result["model"].values.tolist(), result["fit_status"].values.tolist(), strict=True))
    no_prediction = list(FIT_STATUSES).index("no_prediction")
    assert [law for law, status in statuses.items() if status == no_prediction] == [reason.partition(":")[0]]
    with pytest.raises(impact.ConfigError, match=re.escape(f"config: frictions: {reason}")):
        impact.calibrate({**source, "models": ["kelvin-voigt"]})


@pytest.mark.slow
def test_a_fit_at_a_speed_has_no_v1_which_follows_from_the_measured_angle() -> None:
    sweep = {"e": 0.8, "speed": 1.0, "m1": 0.1, "m2": 0.2, "R1": 0.01, "K": 1e7, "mu": {"fit": [0.05, 0.6]}}
    columns = {"angle": [0.5, 0.6], "beta": [-0.5, -0.4]}
    source = {"models": "hertz", "frictions": "coulomb-1785", "sweep": sweep, "data": {"columns": columns}}
    coordinates = impact.calibrate(source).coords
    assert {"speed", "m1", "m2", "R1", "K"} <= set(coordinates)
    assert "v1" not in coordinates


@pytest.mark.parametrize(
    "velocities", [{"speed": 2.0}, {"v1": 2.0, "u2": 0.5}], ids=["a speed", "a sideways velocity of ball 2"]
)
def test_the_best_config_of_an_oblique_fit_repeats_the_predictions(
    velocities: dict[str, float], tmp_path: Path
) -> None:
    """With a speed both sideways velocities follow from it, and neither is in the config."""
    sweep = {"e": 0.8, "m1": 0.1, "m2": 0.2, "R1": 0.01, "K": 1e7, "mu": {"fit": [0.05, 0.06]}} | velocities
    columns = {"angle": [0.9, 1.0], "beta": [-0.8, -0.9]}
    source = {"models": "hertz", "frictions": "coulomb-1785", "sweep": sweep, "data": {"columns": columns}}
    result = impact.calibrate({**source, "solver": {"rtol": 1e-4}}, best=tmp_path / "best.toml")
    again = impact.sweep(tmp_path / "best.toml")
    assert {name: again[name].item() for name in velocities} == velocities
    np.testing.assert_allclose(again["beta"].values.ravel(), result["predicted"].values.ravel(), atol=1e-3)


@pytest.fixture(scope="module")
def fitted() -> xr.Dataset:
    """A calibration of a pair of laws by two measured values."""
    fit = config(models="hertz", frictions="coulomb-1785", mu={"fit": [0.01, 0.5]}, friction={})
    return impact.calibrate({**fit, "data": {"columns": {"beta": [-0.6, -0.59]}}})


@pytest.mark.slow
def test_a_calibration_of_pairs_is_repeated_from_its_file(fitted: xr.Dataset, tmp_path: Path) -> None:
    impact.save(fitted, tmp_path / "fit.h5")
    assert impact.rerun(tmp_path / "fit.h5").equal


@pytest.mark.slow
def test_the_picture_of_a_calibration_names_both_laws_of_a_pair(fitted: xr.Dataset) -> None:
    legend = [text.get_text() for text in impact.plot(fitted).legends[0].get_texts()]
    assert legend[0] == "Hertz (1882) with Coulomb, too few points"


@pytest.mark.long
def test_calibrate_has_the_same_bits_in_any_number_of_processes() -> None:
    fit = config(models="hertz", frictions=["coulomb-1785", "drake-regularized"], mu={"fit": [0.01, 0.5]})
    fit["friction"] = {"drake-regularized": {"v_s": 0.01}}
    fit["data"] = {"columns": {"beta": [-0.6, -0.59]}}
    assert impact.compare(impact.calibrate(fit), impact.calibrate(fit, jobs=2), tol=0.0).equal


# ---- sensitivity


@pytest.mark.slow
def test_each_pair_has_a_study_and_one_without_meaning_has_not_failed() -> None:
    source = config(
        models=["hertz", "lankarani-nikravesh-1994"],
        mu={"uniform": [0.01, 0.05]},
        e={"uniform": [0.7, 0.9]},
        K=None,
        friction={"lammps-mindlin": {"xt": 0.0}},
        design={"n": 64},
    )
    source["sweep"] = {k: v for k, v in source["sweep"].items() if k != "K"} | {"material": "table1"}
    source["materials"] = {"table1": {"E": 5.6e10, "nu": 0.3}}
    study = impact.sensitivity(source, of="beta")
    assert study["total"].dims == ("model", "friction", "input")
    # Hertz, slides throughout: beta is linear in mu, and independent of e
    slides = study.sel(model="hertz", friction="coulomb-1785")
    assert slides["total"].values.tolist() == [pytest.approx(1.0, abs=0.02), 0.0]
    mean = 7.0 * 0.03 / math.tan(ANGLE) - 1.0
    assert slides["mean"].item() == pytest.approx(mean, rel=1e-3)
    meaningless = study.sel(model="lankarani-nikravesh-1994", friction="lammps-mindlin")
    assert meaningless["failed"].item() == 0
    assert np.isnan(meaningless["mean"].item())
    reason = "beta: the law has none, or the friction law is not combinable with the model"
    assert reason in str(impact.describe(study))
    assert impact.describe(study).as_dict()["studies"][0]["friction"] == "coulomb-1785"
    # the picture has a panel for each pair
    pair = [study.sel(model="hertz", friction="lammps-mindlin")[name].values for name in ("first", "total")]
    panels = impact.plot(study).axes
    assert [panel.get_title(loc="left").replace("\xa0", " ") for panel in panels] == [
        "Hertz (1882) with Coulomb",
        "Hertz (1882) with LAMMPS mindlin, $x_t$ = 0",
        "Lankarani and Nikravesh, permanent indentation (1994) with Coulomb",
    ]
    np.testing.assert_allclose([bar.get_width() for bar in panels[1].patches], np.ravel(pair))
    figure = impact.plot(study, models="hertz", frictions=["lammps-mindlin"])
    assert len(figure.axes) == 1
    np.testing.assert_allclose([bar.get_width() for bar in figure.axes[0].patches], np.ravel(pair))
    assert "Hertz (1882)" in figure.texts[1].get_text()
    assert "0 sticks" not in figure.texts[0].get_text()


def test_no_sample_of_a_pair_without_meaning_has_failed_whatever_the_order_of_the_laws() -> None:
    source = config(
        models=["lankarani-nikravesh-1994", "hertz"],
        mu={"uniform": [0.01, 0.05]},
        friction={"lammps-mindlin": {"kt_over_kn": 0.8}},
        design={"n": 2},
    )
    study = impact.sensitivity(source, of="beta")
    assert study["failed"].values.tolist() == [[0, 0], [0, 0]]
    assert np.isnan(study["mean"]).values.tolist() == [[False, True], [False, False]]


@pytest.mark.slow
def test_an_uncertain_angle_is_described_in_degrees() -> None:
    source = config(frictions="coulomb-1785", friction={}, design={"n": 2})
    for angle, text in (
        ({"normal": ["30 deg", "2 deg"]}, "normal(30, 2)°"),
        ({"lognormal": ["30 deg", 1.2]}, "lognormal(30, 1.2)°"),
    ):
        source["sweep"]["angle"] = angle
        assert text in str(impact.describe(impact.sensitivity(source))).replace("\xa0", " ")


# ---- the sweep


@pytest.mark.slow
def test_a_pair_without_meaning_is_noted_and_a_failed_pair_has_the_command_that_repeats_it(tmp_path: Path) -> None:
    source = config(
        models=["tsuji-1992", "lankarani-nikravesh-1994"],
        frictions=["lammps-mindlin", "drake-regularized"],
        mu=[0.1, 0.3],
        # a dynamic friction above the static one at the first mu
        friction={"lammps-mindlin": {"kt_over_kn": 0.8}, "drake-regularized": {"v_s": 0.01, "mu_d": 0.2}},
    )
    notes: list[str] = []
    output = tmp_path / "failed.h5"
    outcome = impact.sweep_to_file(source, output, on_note=notes.append)
    reason = "lankarani-nikravesh-1994 with lammps-mindlin: the contact force has no dashpot"
    assert sum(reason in note for note in notes) == 1
    assert {*outcome.summary.counts} == {1}
    failures = outcome.records()
    assert [failure["status"] for failure in failures] == ["invalid_parameter"] * 2
    assert [failure["at"]["model"] for failure in failures] == source["models"]
    for failure in failures:
        assert failure["at"]["mu"] == 0.1
        assert "--friction drake-regularized --at mu=0.1" in failure["replay"]
    shot = impact.run(output, model="tsuji-1992", friction="drake-regularized", at={"mu": 0.1})
    assert shot.friction_status == 14
    assert "mu_d above mu" in str(shot)
    assert shot.failed
    with pytest.raises(UsageError, match="failed, the first at model=tsuji-1992, friction=drake-regularized"):
        impact.bless(output, tmp_path / "baseline.h5", reason="test")
    with pytest.raises(ConfigError, match=reason):
        impact.sweep(
            config(
                models="lankarani-nikravesh-1994",
                frictions="lammps-mindlin",
                friction={"lammps-mindlin": {"kt_over_kn": 0.8}},
            )
        )


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["full", "factored"])
def test_info_counts_the_points_of_pairs_and_writes_words(swept: dict[str, xr.Dataset], layout: str) -> None:
    described = impact.info(swept[layout].encoding["source"])
    # 8 angles, 2 mu and, for one law, 2 stiffnesses
    assert described["friction_status"] == {"ok": 3 * (16 + 32)}
    assert re.search(r"^friction\.coulomb-1785\.limit +abs *$", str(described), re.MULTILINE)
