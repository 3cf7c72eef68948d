"""`impact calibrate` ranks laws by how they fit measurements, and says what the data cannot tell."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact
from impact.errors import UsageError

from .conftest import ROOT, Run, assert_same_output

FOLDER = ROOT / "docs" / "calibrate"
ONE_LAW = ("--set", 'models=["anagnostopoulos-1988"]')
# a linear spring and dashpot that was asked for a restitution of 0.5
LINEAR: dict[str, Any] = {
    "models": "anagnostopoulos-1988",
    "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "e": {"fit": [0.1, 1.0]}},
    "data": {"columns": {"e_out": [0.49, 0.5, 0.51], "sigma": [0.01, 0.01, 0.01]}},
}


@pytest.fixture(scope="module")
def drops() -> xr.Dataset:
    # a coarser solver is faster, and two of the laws are enough
    models = 'models=["hunt-crossley-1975", "kuwabara-kono-1987"]'
    return impact.calibrate(FOLDER / "drops.toml", overrides=[models, "solver.rtol=1e-6"])


def test_the_law_that_made_the_data_is_first_with_its_parameter_in_the_interval(drops: xr.Dataset) -> None:
    first = drops.isel(model=0).sel(parameter="kuwabara-kono-1987.A")
    assert drops["model"].values[0] == "kuwabara-kono-1987"
    assert first["lower"] < 3e-5 < first["upper"]
    assert 0.2 < first["chi2_reduced"] < 2.0
    assert drops["weight"].values[0] > 0.999


def test_a_fit_at_a_bound_is_ranked_last_and_has_no_weight(drops: xr.Dataset) -> None:
    last = drops.isel(model=-1)
    meanings = drops["fit_status"].attrs["flag_meanings"].split()
    assert meanings[int(last["fit_status"])] == "at_bound"
    assert last["weight"] == 0.0


def test_curves_and_bands_pass_through_the_predictions(drops: xr.Dataset) -> None:
    law = drops.isel(model=0, output_name=0)
    at_points = np.interp(drops["v1"], drops["grid"], law["curve"])
    # between 101 points of a curve, lines are this near to it
    np.testing.assert_allclose(at_points, law["predicted"], atol=5e-4)
    assert (law["curve_lower"] < law["curve"]).all()
    assert (law["curve"] < law["curve_upper"]).all()
    np.testing.assert_allclose(law["residual"], drops["measured"] - law["predicted"], atol=1e-15)


def test_the_estimate_of_a_constant_is_the_mean() -> None:
    """With the interval of normal errors, 0.5 -+ 1.96 0.01/sqrt(3)."""
    fit = impact.calibrate(LINEAR).isel(model=0, parameter=0)
    assert fit["estimate"] == pytest.approx(0.5, abs=1e-9)
    half = 1.959964 * 0.01 / np.sqrt(3.0)
    assert fit["lower"] == pytest.approx(0.5 - half, abs=1e-7)
    assert fit["upper"] == pytest.approx(0.5 + half, abs=1e-7)


def test_measured_beads_have_the_statistics_that_their_authors_print() -> None:
    """Mean 0.8217, standard deviation 0.0155, and 0.0044 on both sides of the interval."""
    fit = impact.calibrate(FOLDER / "hdpe.toml", overrides=[ONE_LAW[1]]).sel(
        model="anagnostopoulos-1988", parameter="e"
    )
    assert round(float(fit["estimate"]), 4) == 0.8217
    assert round(float(np.sqrt(fit["chi2_reduced"])), 4) == 0.0155
    assert round(float(fit["upper"] - fit["lower"]) / 2.0, 4) == 0.0044


@pytest.mark.slow
def test_several_outputs_identify_the_spring_and_the_dashpot() -> None:
    """The contact time adds what restitutions alone do not tell."""
    truth = {"K": 2e6, "C": 300.0}
    source: dict[str, Any] = {
        "models": "kelvin-voigt",
        "sweep": {"v1": [0.5, 1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": truth["K"], "n": 1.0},
        "model": {"kelvin-voigt": {"C": truth["C"]}},
    }
    swept = impact.sweep(source).isel(model=0)
    columns = {name: swept[name].values.tolist() for name in ("v1", "e_out", "contact_time")}
    columns |= {"sigma_e_out": [1e-3] * 3, "sigma_contact_time": [1e-6] * 3}
    source["sweep"] = {"m1": 1.0, "m2": 1.0, "n": 1.0, "K": {"fit": [1e4, 1e8]}}
    source["model"] = {"kelvin-voigt": {"C": {"fit": [1.0, 1e5]}}}
    fit = impact.calibrate(source | {"data": {"columns": columns}}).isel(model=0)
    assert fit["identifiable"].values.tolist() == [1, 1]
    for name, value in (("K", truth["K"]), ("kelvin-voigt.C", truth["C"])):
        assert float(fit["estimate"].sel(parameter=name)) == pytest.approx(value, rel=1e-8)


def test_the_json_has_the_names_of_the_contract(cli: Run) -> None:
    data = json.loads(cli("calibrate", FOLDER / "dashpot.toml", "--set", "solver.rtol=1e-6", "--json").stdout)
    (law,) = data["models"]
    assert {"model", "rank", "status", "parameters", "chi2_reduced", "aicc", "weight", "loo"} <= law.keys()
    assert law["parameters"].keys() == {"sweep.K", "model.kelvin-voigt.C"}
    of_spring = law["parameters"]["sweep.K"]
    assert of_spring.keys() == {"estimate", "lower", "upper", "identifiable"}
    assert (of_spring["lower"], of_spring["upper"], of_spring["identifiable"]) == (None, None, False)
    assert law["determined"] == ["C/sqrt(m K)"]


@pytest.mark.slow
def test_the_bytes_of_a_result_do_not_depend_on_the_number_of_processes(cli: Run, tmp_path: Path) -> None:
    laws = ("--set", 'models=["anagnostopoulos-1988", "hunt-crossley-1975"]', "--set", "solver.rtol=1e-6")
    for name, jobs in (("a.h5", "1"), ("b.h5", "2")):
        done = cli("calibrate", FOLDER / "drops.toml", *laws, "-j", jobs, "-o", tmp_path / name)
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_a_rerun_repeats_a_calibration_and_names_what_changed(cli: Run, tmp_path: Path) -> None:
    impact.calibrate(LINEAR, output=tmp_path / "a.h5")
    done = cli("rerun", "a.h5", cwd=tmp_path)
    assert (done.returncode, done.stdout.split(",")[-1].strip()) == (0, "none differs")
    stored = impact.load(tmp_path / "a.h5")
    changed = {
        # the first is a 300th of the interval
        "values (estimate)": stored.assign(estimate=stored["estimate"] + 7e-5),
        "values (fit_status)": stored.assign(fit_status=stored["fit_status"] + np.int8(1)),
        "labels (measured)": stored.assign_coords(measured=stored["measured"] + 1e-12),
        "physics config (v1)": stored.assign_coords(v1=2.0),
        "physics config (noise)": stored.assign_attrs(noise="scale"),
        "physics config (e)": stored.assign_attrs(fit_bounds=json.dumps({"e": [0.1, 0.9]})),
    }
    for headline, dataset in changed.items():
        assert impact.compare(dataset, stored).headline == f"not equal: {headline}"
    assert impact.compare(changed["values (estimate)"], stored, tol=1e-3).equal
    with pytest.raises(UsageError, match="expected the result of a sweep"):
        impact.compare(stored, ROOT / "tests" / "data" / "figure6.h5")


def test_laws_are_compared_by_name_whatever_their_rank(drops: xr.Dataset) -> None:
    assert impact.compare(drops.isel(model=[1, 0]), drops).equal
    only_one = impact.compare(drops.isel(model=[0]), drops)
    assert only_one.headline == "not equal: labels (model)"
    assert impact.compare(drops.isel(model=[0]), drops, subset=True).equal


def test_the_value_of_a_parameter_that_is_not_identified_is_not_judged() -> None:
    fit = impact.calibrate(FOLDER / "dashpot.toml", overrides=["solver.rtol=1e-6"])
    moved = fit.assign(estimate=fit["estimate"] * 1.5)
    assert fit["identifiable"].values.tolist() == [[0, 0]]
    assert impact.compare(moved, fit).equal


@pytest.mark.slow
def test_a_result_is_stored_and_read_again(cli: Run, tmp_path: Path) -> None:
    done = cli("calibrate", FOLDER / "hdpe.toml", *ONE_LAW, "-o", tmp_path / "a.h5")
    assert done.returncode == 0, done.stderr
    stored = impact.load(tmp_path / "a.h5")
    assert stored["estimate"].sel(parameter="e").item() == pytest.approx(0.82166, abs=1e-5)
    again = cli("calibrate", FOLDER / "hdpe.toml", *ONE_LAW, "-o", tmp_path / "a.h5")
    assert again.returncode == 2
    assert "exists" in again.stderr


def test_the_best_config_gives_the_predictions(cli: Run, tmp_path: Path) -> None:
    words = ("--set", 'models=["kuwabara-kono-1987"]', "--set", "solver.rtol=1e-8")
    done = cli(
        "calibrate", FOLDER / "drops.toml", *words, "--best", tmp_path / "best.toml", "-o", tmp_path / "fit.h5"
    )
    assert done.returncode == 0, done.stderr
    fit, swept = impact.load(tmp_path / "fit.h5").isel(model=0), impact.sweep(tmp_path / "best.toml")
    assert swept["model"].values.tolist() == ["kuwabara-kono-1987"]
    np.testing.assert_allclose(swept["e_out"].values.ravel(), fit["predicted"], atol=1e-7)


@pytest.mark.slow
def test_the_law_that_made_the_data_is_ranked_first_in_nine_of_ten_sets() -> None:
    """Or within 2 of the least AICc; 200 sets of 20 points of three laws, within four standard errors."""
    from impact.config.load import read_config
    from impact.config.measurements import fitted_parameters
    from impact.inverse.calibrate import prediction
    from impact.inverse.fit import Bounds, DataPoints, Problem, fit_all

    speeds = np.geomspace(0.1, 3.0, 20)
    config = read_config(FOLDER / "drops.toml", purpose="calibrate")
    models = [model for model in config.models if model.key != "hunt-crossley-1975"]
    names = {model.key: fitted_parameters(config.fits, model) for model in models}
    functions = {
        model.key: prediction(config, model, names[model.key], {"v1": speeds.tolist()}, speeds.size)
        for model in models
    }
    random = np.random.default_rng(20261123)
    truths = {"kuwabara-kono-1987": 3e-5, "anagnostopoulos-1988": 0.4, "kelvin-voigt": 40.0}
    values = {key: functions[key](np.array([[value]]))[0] for key, value in truths.items()}
    sets = [(key, values[key] + 0.01 * random.standard_normal(speeds.size)) for key in [*truths] * 67]
    problems = [
        Problem(
            model.key,
            Bounds(*np.array([config.fits[name] for name in names[model.key]]).T),
            DataPoints(measured, np.full(speeds.size, 0.01), "given"),
        )
        for _, measured in sets
        for model in models
    ]
    aicc = np.array([fit.aicc for fit in fit_all(problems, functions, leave_one_out=False)]).reshape(-1, 3)
    truth = np.array([[model.key for model in models].index(key) for key, _ in sets])
    near = aicc[np.arange(truth.size), truth] <= aicc.min(axis=1) + 2.0
    print(f"ranked first or within 2: {near.mean():.3f} of {truth.size}")
    assert near.mean() >= 0.9 - 4.0 * np.sqrt(0.9 * 0.1 / truth.size)


EXAMPLES = re.findall(
    r"\$ impact (.*)\n((?:.*\n)+?)```", (ROOT / "docs" / "calibrate.md").read_text(encoding="utf-8")
)


@pytest.mark.slow
@pytest.mark.parametrize(("command", "printed"), EXAMPLES, ids=[command for command, _ in EXAMPLES])
def test_the_page_prints_what_the_commands_print(cli: Run, command: str, printed: str) -> None:
    assert_same_output(cli(*shlex.split(command)).stdout, printed, rel=2e-3, abs=2e-3)
