"""`impact calibrate` ranks laws by how they fit measurements, and says what the data cannot tell."""

from __future__ import annotations

import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import impact
from impact.config.load import read_config
from impact.contact.models import find
from impact.errors import ConfigError, UsageError
from impact.inverse.calibrate import determined_groups
from impact.inverse.fit import Bounds, DataPoints, FitProblem, fit_all
from impact.results.calibration import fit_rows, fit_status, unidentified_notes

from .conftest import ROOT, Run

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


@pytest.mark.slow
def test_the_law_that_made_the_data_is_first_with_its_parameter_in_the_interval(drops: xr.Dataset) -> None:
    first = drops.isel(model=0).sel(parameter="kuwabara-kono-1987.A")
    assert drops["model"].values[0] == "kuwabara-kono-1987"
    assert first["lower"] < 3e-5 < first["upper"]
    assert 0.2 < first["chi2_reduced"] < 2.0
    assert drops["weight"].values[0] > 0.999


@pytest.mark.slow
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


def test_each_of_several_outputs_has_a_curve_through_its_own_predictions() -> None:
    columns = {"v1": [1.0, 2.0], "e_out": [0.5, 0.5], "sigma_e_out": [0.01, 0.01]}
    columns |= {"contact_time": [3e-3, 3e-3], "sigma_contact_time": [1e-3, 1e-3]}
    sweep = {name: value for name, value in LINEAR["sweep"].items() if name != "v1"}
    fit = impact.calibrate({**LINEAR, "sweep": sweep, "data": {"columns": columns}}).isel(model=0)
    assert fit["output_name"].values.tolist() == ["e_out", "contact_time"]
    for output, curve in zip(fit["output_name"].values, fit["curve"].values, strict=True):
        np.testing.assert_allclose(curve[[0, -1]], fit["predicted"][fit["output"] == output], rtol=1e-9)


def test_the_estimate_of_a_constant_is_the_mean() -> None:
    """With the interval of normal errors, 0.5 -+ 1.96 0.01/sqrt(3)."""
    fit = impact.calibrate(LINEAR).isel(model=0, parameter=0)
    assert fit["estimate"] == pytest.approx(0.5, abs=1e-9)
    half = 1.959964 * 0.01 / np.sqrt(3.0)
    assert fit["lower"] == pytest.approx(0.5 - half, abs=1e-7)
    assert fit["upper"] == pytest.approx(0.5 + half, abs=1e-7)


@pytest.mark.slow
def test_one_point_more_than_parameters_is_enough_for_a_reduced_chi2() -> None:
    for values, expected in (([0.49, 0.51], 2.0), ([0.5], np.nan)):
        fit = impact.calibrate(LINEAR | {"data": {"columns": {"e_out": values}, "sigma": 0.01}, "solver": QUICK})
        assert fit["chi2_reduced"].item() == pytest.approx(expected, rel=1e-3, nan_ok=True)


@pytest.mark.slow
def test_measured_beads_have_the_statistics_that_their_authors_print() -> None:
    """Mean 0.8217, standard deviation 0.0155, and 0.0044 on both sides of the interval."""
    fit = impact.calibrate(FOLDER / "hdpe.toml", overrides=[ONE_LAW[1]]).sel(
        model="anagnostopoulos-1988", parameter="e"
    )
    assert round(float(fit["estimate"]), 4) == 0.8217
    assert round(float(np.sqrt(fit["chi2_reduced"])), 4) == 0.0155
    assert round(float(fit["upper"] - fit["lower"]) / 2.0, 4) == 0.0044


# a coarser solver, which is faster
QUICK = {"rtol": 1e-6}
# contact times of equal balls, which get shorter with the speed
TIMES = {"columns": {"v1": [1.0, 1.5, 2.0, 2.5], "contact_time": [0.0072, 0.0068, 0.0065, 0.0063]}}


def test_a_law_is_not_charged_for_parameters_that_it_does_not_have() -> None:
    """Hertz' law has no e, and so no alpha, the factor of a law that computes e from the speed."""
    sweep = {"m1": 1.0, "m2": 1.0, "K": {"fit": [1e5, 1e8]}}
    alone = impact.calibrate({"models": "hertz", "sweep": sweep, "data": TIMES, "solver": QUICK})
    sweep |= {"alpha": {"fit": [0.01, 0.3]}}
    models = ["hertz", "hunt-crossley-1975"]
    both = impact.calibrate({"models": models, "sweep": sweep, "data": TIMES, "solver": QUICK}).sel(model="hertz")
    assert both["identifiable"].values.tolist() == [1, -1]
    assert both["aicc"].item() == alone["aicc"].item() == pytest.approx(-44.557, abs=1e-3)


@pytest.mark.parametrize("stiffness", [1e6, {"fit": [1e5, 1e8]}])
def test_a_law_with_a_stiffness_of_its_own_is_not_charged_for_that_of_the_sweep(stiffness: object) -> None:
    sweep = {"m1": 1.0, "m2": 1.0, "K": {"fit": [1e5, 1e8]}, "e": 0.5}
    model = {"anagnostopoulos-1988": {"K": stiffness}}
    config = {"models": ["hertz", "anagnostopoulos-1988"], "sweep": sweep, "model": model, "data": TIMES}
    both = impact.calibrate({**config, "solver": QUICK}).sel(model="anagnostopoulos-1988")
    assert both["identifiable"].values.tolist() == [-1, *[1] * isinstance(stiffness, dict)]
    assert both["determined"].item() == ""


def test_a_parameter_that_no_law_takes_is_noted() -> None:
    sweep = {"m1": 1.0, "m2": 1.0, "K": {"fit": [1e5, 1e8]}, "e": {"fit": [0.1, 0.9]}}
    with pytest.warns(impact.ImpactWarning, match=r"config: sweep\.e: no law takes it"):
        impact.calibrate({"models": "hertz", "sweep": sweep, "data": TIMES, "solver": QUICK})


def test_the_natural_range_of_a_stiffness_is_about_that_of_the_materials() -> None:
    sweep = {"m1": 1.0, "m2": math.inf, "R1": 0.1, "R2": math.inf, "e": 0.5, "v1": 1.0}
    bare = {"models": "anagnostopoulos-1988", "materials": {"rubber": {"E": 5e6, "nu": 0.49}}}
    config = {**bare, "sweep": {**sweep, "material": "rubber"}}
    size = float(impact.run(config).values["stiffness"])
    fitted = {"model": {"anagnostopoulos-1988": {"K": {"fit": True}}}, "solver": QUICK}
    data = {"data": {"columns": {"contact_time": [0.09, 0.091, 0.092]}}}
    fit = impact.calibrate({**config, **fitted, **data})
    bounds = json.loads(fit.attrs["fit_bounds"])["anagnostopoulos-1988.K"]
    assert bounds == pytest.approx([size / 1e4, size * 1e4])
    assert fit_status(fit.isel(model=0)) == "ok"
    with pytest.raises(ConfigError, match=r"anagnostopoulos-1988\.K: got fit = true, .* without a material"):
        impact.calibrate({**bare, "sweep": sweep, **fitted, **data})


def test_a_law_with_a_stiffness_of_its_own_is_not_charged_for_that_of_its_materials() -> None:
    sweep = {"m1": 1.0, "m2": 1.0, "R1": 0.02, "R2": 0.02, "material": "ball", "e": 0.5}
    materials = {"ball": {"E": {"fit": [1e8, 1e10]}, "nu": 0.3}}
    model = {"anagnostopoulos-1988": {"K": {"fit": [1e5, 1e8]}}}
    config = {"models": ["hertz", "anagnostopoulos-1988"], "sweep": sweep, "model": model, "data": TIMES}
    both = impact.calibrate({**config, "materials": materials, "solver": QUICK})
    identifiable = both["identifiable"].sel(parameter="materials.ball.E")
    assert identifiable.sel(model=["hertz", "anagnostopoulos-1988"]).values.tolist() == [1, -1]
    # a spring of friction with a stiffness of its own does not use them either
    spring = {"frictions": ["cundall-strack-1979"], "friction": {"cundall-strack-1979": {"k_t": 1e5}}}
    oblique = {**config, **spring, "models": ["anagnostopoulos-1988"], "sweep": {**sweep, "mu": 0.3, "angle": 0.5}}
    with pytest.warns(impact.ImpactWarning, match=r"materials\.ball\.E: no law takes it"):
        alone = impact.calibrate({**oblique, "materials": materials, "solver": QUICK})
    assert alone["identifiable"].sel(parameter="materials.ball.E").item() == -1


@pytest.mark.parametrize("friction", [{}, {"k_t": 1e5}])
def test_a_law_with_the_stiffness_of_the_sweep_is_not_charged_for_that_of_its_materials(
    friction: dict[str, float],
) -> None:
    sweep = {"m1": 1.0, "m2": 1.0, "R1": 0.02, "R2": 0.02, "material": "ball", "K": {"fit": [1e5, 1e8]}, "e": 0.5}
    config = {"models": "tsuji-1992", "sweep": sweep, "data": TIMES, "solver": QUICK}
    if friction:
        oblique = {"frictions": "lammps-mindlin", "friction": {"lammps-mindlin": friction}}
        config |= oblique | {"sweep": {**sweep, "mu": 0.3, "angle": 0.5}}
    materials = {"ball": {"E": {"fit": [1e8, 1e10]}, "nu": 0.3}}
    with pytest.warns(impact.ImpactWarning, match=r"materials\.ball\.E: no law takes it"):
        fit = impact.calibrate({**config, "materials": materials})
    assert fit["identifiable"].sel(parameter="materials.ball.E").item() == -1


def test_a_profile_with_several_minima_ends_in_an_interval() -> None:
    """The chi2 of this fit has two valleys, and a search for its end falls from one into the other."""
    sweep = {"m1": 1.0, "m2": 1.0, "K": {"fit": [1e5, 1e7]}, "alpha": {"fit": [0.01, 0.3]}}
    fit = impact.calibrate({"models": "hunt-crossley-1975", "sweep": sweep, "data": TIMES})
    law = fit.isel(model=0)
    assert (law["lower"] < law["estimate"]).all()
    assert (law["estimate"] < law["upper"]).all()


ELASTIC: dict[str, Any] = {
    "models": ["kuwabara-kono-1987", "tsuji-1992"],
    "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "e": {"fit": [0.5, 1.0]}},
    "model": {"kuwabara-kono-1987": {"A": 1e-4}},
    "solver": QUICK,
    "data": {"columns": {"e_out": [1.0, 1.0004, 1.0, 0.9999, 1.0002]}, "sigma": 0.01},
}


@pytest.mark.slow
def test_a_law_at_a_limit_of_the_physics_is_ranked_by_its_criterion(tmp_path: Path) -> None:
    """e = 1 is the end of the allowed values: the interval ends there, and the best config is of that law."""
    fit = impact.calibrate(ELASTIC, best=tmp_path / "best.toml")
    first = fit.isel(model=0)
    assert fit["model"].values.tolist() == ["tsuji-1992", "kuwabara-kono-1987"]
    assert fit["fit_status"].attrs["flag_meanings"].split()[int(first["fit_status"])] == "at_limit"
    assert fit["weight"].values.tolist() == [pytest.approx(1.0), pytest.approx(0.0, abs=1e-12)]
    law = first.sel(parameter="e")
    assert (law["estimate"].item(), law["upper"].item()) == (1.0, 1.0)
    assert law["lower"].item() == pytest.approx(1.0 - 1.959964 * 0.01 / np.sqrt(5.0), abs=2e-4)
    swept = impact.sweep(tmp_path / "best.toml")
    assert (swept["model"].item(), swept["e"].item()) == ("tsuji-1992", 1.0)


def test_a_law_without_a_parameter_to_fit_is_first_where_one_more_parameter_improves_the_fit_little(
    tmp_path: Path,
) -> None:
    """AICc, not the reduced chi2, ranks: e improves chi2 by 1.9 and costs 2 + 4/3."""
    data = {"columns": {"e_out": [0.939, 0.945, 0.951, 0.957, 0.963]}, "sigma": 0.01}
    fit = impact.calibrate(ELASTIC | {"data": data}, best=tmp_path / "second.toml", model="tsuji-1992")
    # the law that was asked for, although it is not the first
    assert impact.sweep(tmp_path / "second.toml")["model"].item() == "tsuji-1992"
    assert fit["model"].values.tolist() == ["kuwabara-kono-1987", "tsuji-1992"]
    assert (fit["chi2_reduced"][0] > fit["chi2_reduced"][1]).item()
    assert fit["aicc"].diff("model").item() == pytest.approx(2.0 + 4.0 / 3.0 - 5 * 0.63**2, abs=0.01)


def test_the_best_config_has_the_law_that_fits_best_at_a_bound_too(tmp_path: Path) -> None:
    """A search that ends at 0.96 is still nearer to the data than a law without a parameter to fit."""
    change = {"sweep": ELASTIC["sweep"] | {"e": {"fit": [0.5, 0.96]}}}
    fit = impact.calibrate(ELASTIC | change, best=tmp_path / "best.toml")
    first = fit.isel(model=0)
    assert fit["fit_status"].attrs["flag_meanings"].split()[int(first["fit_status"])] == "at_bound"
    assert first["aicc"] < fit["aicc"][1]
    assert impact.sweep(tmp_path / "best.toml")["model"].item() == first["model"].item() == "tsuji-1992"
    # no parameter of the other law
    assert "model" not in tomllib.loads((tmp_path / "best.toml").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_measured_restitutions_beyond_0_and_1_are_fitted_as_they_are() -> None:
    """Leaving them out would bias the mean."""
    values = [1.0004, 0.95, 0.97, -0.001, 0.02]
    for part in (values[:3], values[3:]):
        data = {"columns": {"e_out": part}, "sigma": 0.01}
        sweep = LINEAR["sweep"] | {"e": {"fit": [0.0, 1.0]}}
        fit = impact.calibrate(LINEAR | {"data": data, "sweep": sweep, "solver": QUICK})
        assert fit["estimate"].item() == pytest.approx(np.mean(part), abs=1e-5)


def write_specimens(folder: Path, header: str = "e_out, sigma, specimen") -> Path:
    """Four specimens of five values each, as a CSV file, and its config."""
    random = np.random.default_rng(5)
    values = 0.5 + 0.03 * random.standard_normal((4, 1)) + 0.01 * random.standard_normal((4, 5))
    rows = [f"{value:.5f}, 0.01, ball {name}" for name, row in zip("abcd", values, strict=True) for value in row]
    (folder / "beads.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    text = 'models = "anagnostopoulos-1988"\n[data]\nfile = "beads.csv"\n[sweep]\nv1 = 1.0\nm1 = 1.0\nm2 = 1.0\n'
    text += "K = 1e6\nn = 1\ne = { fit = [0.0, 1.0] }\n[solver]\nrtol = 1e-6\n"
    (folder / "fit.toml").write_text(text, encoding="utf-8")
    return folder / "fit.toml"


@pytest.mark.slow
def test_a_column_specimen_gives_each_specimen_a_deviation(tmp_path: Path) -> None:
    """The interval is that of the means of four specimens, in a stored file too."""
    config = write_specimens(tmp_path)
    fit = impact.calibrate(config, output=tmp_path / "fit.h5")
    means = fit["measured"].values.reshape(4, 5).mean(axis=1)
    half = stats.t.ppf(0.975, 3) * means.std(ddof=1) / 2.0
    law = impact.load(tmp_path / "fit.h5").isel(model=0, parameter=0)
    assert law["estimate"].item() == pytest.approx(means.mean(), abs=1e-5)
    assert (law["upper"] - law["lower"]).item() == pytest.approx(2.0 * half, rel=1e-4)
    assert law["specimen"].values.tolist() == [f"ball {name}" for name in "abcd" for _ in range(5)]
    assert law.attrs["noise"] == "excess"
    other = {"labels (specimen)": fit.assign_coords(specimen=("point", ["x"] * 20))}
    for headline, dataset in other.items():
        assert impact.compare(dataset, fit).headline == f"not equal: {headline}"


@pytest.mark.slow
def test_a_calibration_with_specimens_is_repeated_from_its_file(cli: Run, tmp_path: Path) -> None:
    impact.calibrate(write_specimens(tmp_path), output=tmp_path / "fit.h5")
    assert cli("rerun", "fit.h5", cwd=tmp_path).returncode == 0


@pytest.mark.slow
def test_excess_without_specimens_says_that_points_repeat(cli: Run, tmp_path: Path) -> None:
    config = write_specimens(tmp_path)
    text = (tmp_path / "beads.csv").read_text(encoding="utf-8").replace(", specimen", "")
    (tmp_path / "beads.csv").write_text(re.sub(r", ball .", "", text), encoding="utf-8")
    done = cli("calibrate", config, "--set", 'data.noise="excess"')
    assert "without a column specimen, each measured value has an excess deviation of its own" in done.stdout
    assert "20 of 20 points repeat the inputs of another" in done.stdout


BALLS_ON_STEEL = """
models = "kuwabara-kono-1987"
data = { file = "balls.csv", sigma = 0.01, fit = true }
sweep = { R1 = "2.5 mm", m2 = inf, material = "steel" }
"""


@pytest.mark.slow
def test_specimens_that_all_deviate_to_one_side_are_named(cli: Run, tmp_path: Path) -> None:
    """A law with too little change within each specimen fits it at restitutions that none of them has."""
    rows = ["1,a,0.9", "1,a,0.91", "2,a,0.85", "1,b,0.95", "2,b,0.9", "1,c,0.88", "2,c,0.83"]
    text = "\n".join(["v1 [m/s],specimen,e_out", *rows, ""])
    (tmp_path / "balls.csv").write_text(text, encoding="utf-8")
    (tmp_path / "fit.toml").write_text(BALLS_ON_STEEL, encoding="utf-8")
    done = cli("calibrate", tmp_path / "fit.toml")
    assert "the specimens deviate from kuwabara-kono-1987 to one side, by 0." in done.stdout


@pytest.mark.slow
def test_specimens_that_agree_with_a_law_do_not_deviate_to_one_side(cli: Run, tmp_path: Path) -> None:
    """The rounding of exact values is the same for all specimens, and far below sigma."""
    inputs = {"R1": "2.5 mm", "m2": math.inf, "material": "steel", "kuwabara-kono-1987.A": 1e-6}
    law = impact.prepare(model="kuwabara-kono-1987", at=inputs)
    exact = {v1: law(v1=v1)["e_out"] for v1 in (0.5, 1.0, 2.0, 3.0)}
    rows = [f"{v1},{specimen},{e + 1e-9!r}" for specimen in "abcd" for v1, e in exact.items()]
    (tmp_path / "balls.csv").write_text("\n".join(["v1 [m/s],specimen,e_out", *rows, ""]), encoding="utf-8")
    (tmp_path / "fit.toml").write_text(BALLS_ON_STEEL, encoding="utf-8")
    done = cli("calibrate", tmp_path / "fit.toml")
    assert (done.returncode, "to one side" in done.stdout) == (0, False)


@pytest.mark.slow
def test_a_rejected_law_and_its_largest_residuals_are_named(cli: Run, tmp_path: Path) -> None:
    config = write_specimens(tmp_path)
    (tmp_path / "beads.csv").write_text("e_out, sigma\n0.5, 0.01\n0.51, 0.01\n0.49, 0.01\n0.7, 0.01\n", "utf-8")
    done = cli("calibrate", config)
    assert "the best law is rejected (p < 0.001)" in done.stdout
    # of n equal values the residual without one is n/(n-1) of that in the mean, with sigma^2 n/(n-1)
    assert "beads.csv:5 (17.3), beads.csv:4 (-6.9), beads.csv:2 (-5.8)" in done.stdout
    data = json.loads(cli("calibrate", config, "--json").stdout)
    assert data["models"][0]["p_value"] < 1e-60
    first = data["largest_residuals"][0]
    assert (first["place"], first["output"], first["measured"]) == ("beads.csv:5", "e_out", 0.7)
    robust = cli("calibrate", config, "--set", 'data.loss="huber"').stdout
    assert "rejected" not in robust
    # that loss has no p
    heading = next(line for line in robust.splitlines() if line.startswith("law"))
    assert heading.split()[4:7] == ["%", "chi2/dof", "AICc"]
    assert 0.5 < float(re.search(r" e +([0-9.]+)", robust)[1]) < 0.51  # type: ignore[index]


@pytest.mark.slow
def test_the_table_has_the_numbers_of_the_result(cli: Run, tmp_path: Path) -> None:
    fit = impact.calibrate(write_specimens(tmp_path)).isel(model=0, parameter=0)
    row = next(line for line in cli("calibrate", tmp_path / "fit.toml").stdout.splitlines() if "anagno" in line)
    words = row.split()
    shown = [float(word) for word in (words[2], words[3], words[5], words[6], words[7])]
    expected = [float(fit[name]) for name in ("estimate", "lower", "upper", "chi2_reduced", "aicc")]
    np.testing.assert_allclose(shown, expected, rtol=5e-3)


SPEEDS = np.linspace(0.5, 3.0, 8)


def fit_contact_times(mass: float, **data: Any) -> tuple[xr.Dataset, Any, list[float]]:
    """Fit K and A to contact times with a noise of 1 %; also returns chi2 of both, and bounds of A."""
    A = 0.15 * (mass / 1e6) ** 0.4  # in units of time
    sweep, bounds = {"m1": mass, "m2": np.inf}, [A / 10, A * 10]
    config = {"models": "kuwabara-kono-1987", "sweep": {**sweep, "K": 1e6, "v1": 1.0}}
    times = impact.prepare({**config, "model": {"kuwabara-kono-1987": {"A": A}}}, outputs="contact_time")
    exact = times(v1=SPEEDS)["contact_time"]
    sigma = 0.01 * float(exact.mean())
    measured = exact + sigma * np.random.default_rng(4).standard_normal(8)
    columns = {"v1": SPEEDS.tolist(), "contact_time": measured.tolist()}
    if data.pop("has_sigma"):
        columns["sigma"] = [sigma] * 8
    config = {**config, "sweep": {**sweep, "K": {"fit": [1e6 / 30, 30e6]}}, "data": {"columns": columns, **data}}
    fit = impact.calibrate({**config, "model": {"kuwabara-kono-1987": {"A": {"fit": bounds}}}})

    def chi2(K: float, A: float) -> float:
        return float((((times(v1=SPEEDS, K=K, A=A)["contact_time"] - measured) / sigma) ** 2).sum())

    return fit, chi2, bounds


def test_an_end_of_an_interval_where_the_other_parameter_is_at_a_bound() -> None:
    fit, chi2, (least, _) = fit_contact_times(0.01, has_sigma=True)
    K, damping = fit["estimate"].values[0]
    assert damping > 2.0 * least
    assert chi2(fit["upper"].values[0, 0], least) - chi2(K, damping) == pytest.approx(
        stats.chi2.ppf(0.95, 1), rel=1e-3
    )


def test_small_values_without_deviations_are_fitted_as_those_with_one() -> None:
    """Contact times of a microsecond."""
    with_sigma, *_ = fit_contact_times(1e-9, has_sigma=True, noise="scale")
    without, chi2, _ = fit_contact_times(1e-9, has_sigma=False)
    for name in ("estimate", "lower", "upper", "aicc"):
        np.testing.assert_allclose(without[name], with_sigma[name], rtol=1e-5, err_msg=name)
    sigma = float(np.sqrt(without["chi2_reduced"].item() / with_sigma["chi2_reduced"].item()))
    assert without["loo"].item() == pytest.approx(sigma * with_sigma["loo"].item(), rel=1e-4)
    assert 6.0 * with_sigma["chi2_reduced"].item() == pytest.approx(chi2(*without["estimate"].values[0]), rel=1e-9)


def test_spins_of_balls_that_stick_do_not_identify_mu() -> None:
    """They are 2/7 of what rolling on the plate would change, whatever mu is."""
    angles = [0.1, 0.3, 0.5, 0.7]
    spins = [-100.0 / 1.4 * float(np.tan(angle)) for angle in angles]
    sweep = {"v1": 1.0, "m1": 1.0, "m2": np.inf, "R1": 0.01, "R2": np.inf, "K": 1e6, "mu": {"fit": [0.0, 2.0]}}
    columns = {"angle": angles, "omega1_post": spins, "sigma": [0.1] * 4}
    result = impact.calibrate(
        {"models": "hertz", "frictions": "coulomb-1785", "sweep": sweep, "data": {"columns": columns}}
    )
    np.testing.assert_allclose(np.abs(result["predicted"].values[0]), np.abs(spins), rtol=1e-9)
    assert result["identifiable"].item() == 0
    assert np.isnan(result["lower"].item())


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


@pytest.mark.slow
def test_the_json_has_the_names_of_the_contract(cli: Run) -> None:
    data = json.loads(cli("calibrate", FOLDER / "dashpot.toml", "--set", "solver.rtol=1e-6", "--json").stdout)
    (law,) = data["models"]
    assert {"model", "rank", "status", "parameters", "chi2_reduced", "aicc", "weight", "loo"} <= law.keys()
    assert law["parameters"].keys() == {"sweep.K", "model.kelvin-voigt.C"}
    of_spring = law["parameters"]["sweep.K"]
    assert of_spring.keys() == {"estimate", "lower", "upper", "identifiable"}
    assert (of_spring["lower"], of_spring["upper"], of_spring["identifiable"]) == (None, None, False)
    assert law["determined"] == ["C/sqrt(m K)"]
    printed = cli("calibrate", FOLDER / "dashpot.toml", "--set", "solver.rtol=1e-6").stdout
    assert "kelvin-voigt: K, C: only C/sqrt(m K) is determined" in " ".join(printed.split())


def test_what_is_determined_has_no_dimension_whether_or_not_its_units_have_a_mass() -> None:
    """The law depends on A v0^(1/5) (K/m)^(2/5), a time times a power of a stiffness."""
    key = "kuwabara-kono-1987"
    config = read_config(
        {
            "models": key,
            "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": {"fit": [1e6, 1e8]}},
            "model": {key: {"A": {"fit": [1e-7, 1e-3]}}},
            "data": {"columns": {"e_out": [0.9, 0.9, 0.9]}},
        },
        purpose="calibrate",
    )
    assert list(config.fits) == ["K", f"{key}.A"]
    bounds = Bounds(*np.transpose(list(config.fits.values())))
    points = DataPoints(np.full(3, 1e-2), np.full(3, 1e-4), "given")
    problem = FitProblem(lambda rows: np.repeat(rows[:, :1] ** 0.4 * rows[:, 1:], 3, axis=1), bounds, points)
    (fit,) = fit_all([problem])
    groups = determined_groups(config, find(key), list(config.fits), fit)
    assert groups == ["(v0^(1/5) K^(2/5) A)/m^(2/5)"]


@pytest.mark.parametrize(
    ("sweep", "columns", "expected"),
    [
        ({"n": 1.0}, {}, "d/sqrt(m K)"),
        ({}, {"n": [1.0, 1.0, 1.0]}, "d/sqrt(m K)"),
        # no powers of the mass and the speed are right for more than one exponent
        ({}, {"n": [1.0, 1.5, 2.0]}, "d/sqrt(K)"),
        ({"n": {"fit": [1.0, 1.001]}}, {}, "d/sqrt(K)"),
    ],
)
def test_what_is_determined_has_no_dimension_at_every_exponent_of_the_data(
    sweep: dict[str, Any], columns: dict[str, list[float]], expected: str
) -> None:
    key = "modelica-elastogap"
    config = read_config(
        {
            "models": key,
            "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": {"fit": [1e4, 1e8]}, **sweep},
            "model": {key: {"d": {"fit": [1.0, 1e5]}}},
            "data": {"columns": {"e_out": [0.9, 0.9, 0.9], **columns}},
        },
        purpose="calibrate",
    )
    names = ["K", f"{key}.d"]
    bounds = Bounds(*np.transpose([config.fits[name] for name in names]))
    points = DataPoints(np.full(3, 0.01), np.full(3, 1e-4), "given")
    problem = FitProblem(lambda rows: np.repeat(rows[:, 1:] / np.sqrt(rows[:, :1]), 3, axis=1), bounds, points)
    (fit,) = fit_all([problem])
    assert determined_groups(config, find(key), names, fit) == [expected]


def test_what_is_determined_of_a_parameter_that_may_be_zero_is_no_product() -> None:
    """The law depends on d/sqrt(K), but d has no logarithm from 0 on."""
    key = "modelica-elastogap"
    config = read_config(
        {
            "models": key,
            "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": {"fit": [1e4, 1e8]}, "n": 1.0},
            "model": {key: {"d": {"fit": [0.0, 1e5]}}},
            "data": {"columns": {"e_out": [0.9, 0.9, 0.9]}},
        },
        purpose="calibrate",
    )
    names = ["K", f"{key}.d"]
    bounds = Bounds(*np.transpose([config.fits[name] for name in names]))
    points = DataPoints(np.full(3, 1.0), np.full(3, 1e-2), "given")
    problem = FitProblem(lambda rows: np.repeat(rows[:, 1:] / np.sqrt(rows[:, :1]), 3, axis=1), bounds, points)
    (fit,) = fit_all([problem])
    assert not fit.identifiable.any()
    assert determined_groups(config, find(key), names, fit) == []


def test_what_is_determined_of_a_law_with_exponents_in_its_units_has_no_dimension() -> None:
    """With p = 2 the unit of c, N s^p/m^(n + p), is that of K/v0²."""
    key = "recurdyn-exponents"
    config = {
        "models": key,
        "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": {"fit": [1e4, 1e8]}, "n": 1.5},
        "model": {key: {"c": {"fit": [1.0, 1e5]}, "damping_exponent": 2.0, "indentation_exponent": 1.5}},
        "data": {"columns": {"e_out": [0.49, 0.5, 0.51], "sigma": [0.01, 0.01, 0.01]}},
        "solver": {"rtol": 1e-4},
    }
    result = impact.calibrate(config)
    assert result["determined"].values.tolist() == ["(v0^2 c)/K"]
    # a parameter is named without its law, as in the table
    assert unidentified_notes(result) == [f"{key}: K, c: only (v0^2 c)/K is determined"]


def test_only_what_the_data_determine_of_parameters_counts() -> None:
    """Of K and C restitutions determine C/sqrt(K), and beside e nothing of K: n - 1 degrees of freedom remain."""
    e, sigma = np.array([0.48, 0.5, 0.51, 0.49, 0.53]), 0.01
    sweep = {**LINEAR["sweep"], "K": {"fit": [1e4, 1e8]}}
    squares, half = 4.0 * e.var(ddof=1), stats.t.ppf(0.975, 4) * e.std(ddof=1) / math.sqrt(5.0)
    data = {"columns": {"e_out": e.tolist(), "sigma": [sigma] * 5}}
    of_spring = {"sweep": {**sweep, "e": 0.5}, "model": {"kelvin-voigt": {"C": {"fit": [1.0, 1e5]}}}}
    fit = impact.calibrate({"models": "kelvin-voigt", **of_spring, "data": data})
    assert fit["identifiable"].values.tolist() == [[0, 0]]
    assert fit["chi2_reduced"].item() == pytest.approx(squares / sigma**2 / 4.0, rel=1e-7)
    assert fit["p_value"].item() == pytest.approx(stats.chi2.sf(squares / sigma**2, 4), rel=1e-7)
    likelihood = -0.5 * (squares / sigma**2 + 5.0 * math.log(2.0 * math.pi * sigma**2))
    assert fit["aicc"].item() == pytest.approx(2.0 - 2.0 * likelihood + 4.0 / 3.0, rel=1e-7)
    scaled = impact.calibrate({**LINEAR, "sweep": sweep, "data": {"columns": {"e_out": e.tolist()}}})
    interval = [scaled[name].sel(parameter="e").item() for name in ("lower", "upper")]
    assert interval == pytest.approx([e.mean() - half, e.mean() + half], abs=1e-6)


@pytest.mark.slow
def test_the_bytes_of_a_result_do_not_depend_on_the_number_of_processes(cli: Run, tmp_path: Path) -> None:
    laws = ("--set", 'models=["anagnostopoulos-1988", "hunt-crossley-1975"]', "--set", "solver.rtol=1e-6")
    for name, jobs in (("a.h5", "1"), ("b.h5", "2")):
        done = cli("calibrate", FOLDER / "drops.toml", *laws, "-j", jobs, "-o", tmp_path / name)
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


@pytest.mark.slow
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


def test_a_changed_plug_in_is_a_note_beside_calibrations_that_differ() -> None:
    stored = impact.load(ROOT / "tests" / "data" / "release_1_0_0" / "calibration.h5")
    new, old = (
        stored.assign_attrs(plugins=json.dumps({"mine": {"file": "my.py", "sha256": digit * 64}}))
        for digit in "ab"
    )
    assert "the code of mine changed" in impact.compare(new, old).notes
    assert impact.compare(new, new).notes == ()


def test_inputs_of_calibrations_that_differ_are_named_in_one_order() -> None:
    stored = impact.load(ROOT / "tests" / "data" / "release_1_0_0" / "calibration.h5")
    changed = stored.assign_coords({name: stored[name] + 1.0 for name in ("v2", "m2", "K", "v1", "m1")})
    assert [fault.name for fault in impact.compare(changed, stored).faults] == ["K", "m1", "m2", "v1", "v2"]


def test_laws_are_compared_by_name_whatever_their_rank(drops: xr.Dataset) -> None:
    assert impact.compare(drops.isel(model=[1, 0]), drops).equal
    # nor does the order of the parameters matter
    verdict = impact.compare(drops.isel(parameter=[1, 0], other_parameter=[1, 0]), drops)
    assert verdict.equal, str(verdict)
    nothing = impact.compare(drops.isel(model=[0]), drops.isel(model=[1]), subset=True)
    assert nothing.headline == "not equal: nothing in common"
    assert "the two have no law in common" in {fault.text for fault in nothing.faults}
    only_one = impact.compare(drops.isel(model=[0]), drops)
    assert only_one.headline == "not equal: labels (model)"
    assert impact.compare(drops.isel(model=[0]), drops, subset=True).equal


def test_curves_of_calibrations_are_compared_at_equal_inputs(drops: xr.Dataset) -> None:
    part = drops.isel(grid=[2, 0])
    assert impact.compare(part, drops).headline == "not equal: labels (grid)"
    assert impact.compare(part, drops, subset=True).equal
    changed = drops.assign(curve=drops["curve"] + (drops["grid"] == drops["grid"][2]))
    assert impact.compare(part, changed, subset=True).headline == "not equal: values (curve)"
    other = impact.compare(part, drops.isel(grid=[1]), subset=True)
    assert other.headline == "not equal: nothing in common (grid)"


@pytest.mark.slow
def test_a_rerun_repeats_the_laws_and_the_curves_of_the_file(tmp_path: Path) -> None:
    whole = impact.calibrate(FOLDER / "drops.toml", overrides=["solver.rtol=1e-6"])
    for number, part in enumerate(({"model": [0, 2]}, {"model": [3]}, {"grid": slice(3)})):
        impact.save(whole.isel(part), tmp_path / f"{number}.h5")
        verdict = impact.rerun(tmp_path / f"{number}.h5")
        assert verdict.equal, str(verdict)


@pytest.mark.slow
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


def test_the_table_of_a_fit_names_parameters_without_their_law_and_has_two_digits_of_p(drops: xr.Dataset) -> None:
    (key, name, *_, p_value, _, _, _, _), *_ = fit_rows(drops)
    assert (key, name) == ("kuwabara-kono-1987", "A [s]")
    assert float(p_value) == pytest.approx(drops["p_value"].values[0], rel=0.05)
    assert len(p_value.lstrip("0.").partition("e")[0].replace(".", "")) <= 2


def test_the_unit_of_a_parameter_has_the_exponent_of_the_law_unless_it_is_fitted() -> None:
    sweep = {"m1": 0.1, "m2": 1.0, "e": 0.8, "K": {"fit": [1e5, 1e7]}}
    data = {"columns": {"v1": [0.5, 1.0, 2.0], "contact_time": [1e-3, 9e-4, 8e-4]}, "sigma": 1e-5}
    for n, names in ((1.5, ["K [N/m^1.5]"]), ({"fit": [1.1, 2.0]}, ["n", "K [N/m^n]"])):
        fits = impact.calibrate({"models": "hertz", "sweep": {"n": n, **sweep}, "data": data, "solver": QUICK})
        assert [row[1] for row in fit_rows(fits)] == names


def test_a_law_of_the_best_config_that_is_not_fitted_is_refused_before_the_fit(tmp_path: Path) -> None:
    fit, best = tmp_path / "fit.h5", tmp_path / "best.toml"
    with pytest.raises(impact.UsageError, match="hertz"):
        impact.calibrate(FOLDER / "drops.toml", output=fit, best=best, model="hertz")
    assert not fit.exists()


def test_the_best_config_is_integrated_as_in_the_fit(tmp_path: Path) -> None:
    sweep = {"m1": 1.0, "m2": 1.0, "v1": 1.0, "K": 1e6, "e": {"fit": [0.1, 1.0]}}
    config = {"models": "hunt-crossley-1975", "sweep": sweep, "solver": {"rtol": 1e-5, "core": "numpy"}}
    fit = impact.calibrate({**config, "data": {"columns": {"e_out": [0.6, 0.7]}}}, best=tmp_path / "best.toml")
    predicted = fit["predicted"].values[0, 0]
    for source in (tmp_path / "best.toml", fit):
        assert impact.run(source).values["e_out"] == pytest.approx(predicted, rel=1e-12)


@pytest.mark.slow
def test_the_best_config_gives_the_predictions(cli: Run, tmp_path: Path) -> None:
    words = ("--set", 'models=["kuwabara-kono-1987"]', "--set", "solver.rtol=1e-8")
    done = cli(
        "calibrate", FOLDER / "drops.toml", *words, "--best", tmp_path / "best.toml", "-o", tmp_path / "fit.h5"
    )
    assert done.returncode == 0, done.stderr
    *note, fit_line, best_line = done.stderr.splitlines()
    assert " ".join(note).endswith("drops.toml: sweep.e: no law takes it, and it is not fitted")
    assert [fit_line, best_line] == [f"{tmp_path / 'fit.h5'}: written", f"{tmp_path / 'best.toml'}: written"]
    fit, swept = impact.load(tmp_path / "fit.h5").isel(model=0), impact.sweep(tmp_path / "best.toml")
    assert swept["model"].values.tolist() == ["kuwabara-kono-1987"]
    np.testing.assert_allclose(swept["e_out"].values.ravel(), fit["predicted"], atol=1e-7)


@pytest.mark.parametrize(
    "sets_of_a_law", [pytest.param(20, marks=pytest.mark.slow), pytest.param(67, marks=pytest.mark.long)]
)
def test_the_law_that_made_the_data_is_ranked_first_in_nine_of_ten_sets(sets_of_a_law: int) -> None:
    """Or within 2 of the least AICc; sets of 20 points of three laws, within four standard errors."""
    from impact.config.load import read_config
    from impact.config.measurements import fitted_parameters
    from impact.inverse.calibrate import prediction
    from impact.inverse.fit import Bounds, DataPoints, FitProblem, fit_all

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
    sets = [(key, values[key] + 0.01 * random.standard_normal(speeds.size)) for key in [*truths] * sets_of_a_law]
    problems = [
        FitProblem(
            functions[model.key],
            Bounds(*np.array([config.fits[name] for name in names[model.key]]).T),
            DataPoints(measured, np.full(speeds.size, 0.01), "given"),
        )
        for _, measured in sets
        for model in models
    ]
    aicc = np.array([fit.aicc for fit in fit_all(problems, leave_one_out=False)]).reshape(-1, 3)
    truth = np.array([[model.key for model in models].index(key) for key, _ in sets])
    near = aicc[np.arange(truth.size), truth] <= aicc.min(axis=1) + 2.0
    print(f"ranked first or within 2: {near.mean():.3f} of {truth.size}")
    assert near.mean() >= 0.9 - 4.0 * np.sqrt(0.9 * 0.1 / truth.size)
