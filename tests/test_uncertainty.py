"""Uncertain inputs: samples from distributions, Sobol indices beside closed forms, and what is refused."""

from __future__ import annotations

import json
import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import stats

import impact
from impact.config.grid import unit_samples
from impact.config.tables import Design
from impact.errors import ConfigError, UsageError
from impact.uncertainty.sensitivity import indices_of, mixed_rows

from .conftest import ROOT, Run, problems_of

# inputs of Hertz' law with closed forms, and the powers with which they enter the peak force and the contact time
ENDS = {"m1": (0.9, 1.1), "K": (0.5, 1.5), "v1": (0.8, 1.2)}
POWERS = {"peak_force": (0.6, 0.4, 1.2), "contact_time": (0.4, -0.4, -0.2)}
MEAN_FACTOR = {"peak_force": 1.25**0.6}
TEXT = """
models = ["gonthier-2004", "tsuji-1992"]
[design]
n = 64
[sweep]
e = [0.3, 0.6]
v1 = { normal = ["1 m/s", 0.05] }
K = { lognormal = ["2 MN/m^1.5", 1.2] }
m1 = 1
m2 = 1
"""


def hertz(method: str = "sobol", n: int = 2**14, seed: int = 0) -> dict[str, Any]:
    return {
        "models": "hertz",
        "design": {"method": method, "n": n, "seed": seed},
        "sweep": {"m2": math.inf} | {name: {"uniform": list(ends)} for name, ends in ENDS.items()},
        "output": {"variables": ["peak_force"]},
    }


def mean_power(least: float, most: float, power: float) -> float:
    """The mean of x^power of a uniform x."""
    return (most ** (power + 1) - least ** (power + 1)) / ((power + 1) * (most - least))


def closed_form(of: str) -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices of a product of powers: V_i/D and V_i prod(1 + V_j)/D."""
    means = [
        (mean_power(*ends, p), mean_power(*ends, 2 * p)) for ends, p in zip(ENDS.values(), POWERS[of], strict=True)
    ]
    v = np.array([square / mean**2 - 1.0 for mean, square in means])
    d = np.prod(1.0 + v) - 1.0
    return v / d, v * np.prod(1.0 + v) / (1.0 + v) / d


@pytest.mark.slow
@pytest.mark.parametrize("of", POWERS)
def test_indices_are_those_of_the_closed_forms(of: str) -> None:
    study = impact.sensitivity(hertz(), of=of).isel(model=0)
    first, total = closed_form(of)
    if of == "peak_force":
        np.testing.assert_allclose(first, [0.03427839, 0.41174665, 0.54494422], atol=1e-8)
        np.testing.assert_allclose(total, [0.03543821, 0.42012213, 0.55347986], atol=1e-8)
    np.testing.assert_allclose(study["first"], first, atol=1e-3)
    np.testing.assert_allclose(study["total"], total, atol=1e-3)
    for name, exact in (("first", first), ("total", total)):
        assert (study[f"{name}_lower"] < exact).all()
        assert (exact < study[f"{name}_upper"]).all()
    assert study["input"].values.tolist() == ["sweep.m1", "sweep.K", "sweep.v1"]
    # the points that were computed for it are not part of it
    assert "sample" not in study.dims


def hunt_crossley(c: np.ndarray, v1: np.ndarray) -> np.ndarray:
    """The restitution of F = K δⁿ (1 + 3/2 c δ̇): b - ln(1 + b) = -b e - ln(1 - b e) with b = 3/2 c v1."""
    b = 1.5 * c * v1
    least, most = np.zeros_like(b), np.minimum(1.0, 1.0 / b)
    with np.errstate(divide="ignore"):
        for _ in range(50):
            e = 0.5 * (least + most)
            is_less = -b * e - np.log1p(-b * e) < b - np.log1p(b)
            least, most = np.where(is_less, e, least), np.where(is_less, most, e)
    return e


def test_indices_do_not_depend_on_the_size_of_an_output() -> None:
    soft = hertz(n=64)
    stiff = soft | {"sweep": soft["sweep"] | {"K": {"uniform": [1e12 * end for end in ENDS["K"]]}}}
    of_soft, of_stiff = (impact.sensitivity(config, of="contact_time") for config in (soft, stiff))
    assert float(of_stiff["mean"].squeeze()) < 1e-4
    for name in ("first", "total"):
        np.testing.assert_allclose(of_stiff[name], of_soft[name], rtol=1e-6)


def test_an_input_that_matters_in_some_samples_alone_has_indices() -> None:
    # the balls yield, and e depends on the speed, from some 0.06 m/s on
    config = {
        "models": "johnson-1985",
        "design": {"n": 32},
        "materials": {"steel": {"E": 2e11, "nu": 0.3, "rho": 7800.0, "yield_strength": 1e9}},
        "sweep": {"material": "steel", "R1": 0.01, "R2": 0.01, "v1": {"uniform": [0.001, 1.0]}},
    }
    assert float(impact.sensitivity(config)["total"].squeeze()) > 0.5


def test_an_input_that_changes_the_output_by_errors_of_the_integration_has_an_index_of_zero() -> None:
    """The restitution of this law does not depend on n; its smallest sample is far below the others."""
    config = {
        "models": "exact-hysteresis",
        "design": {"n": 16},
        "sweep": {"v1": 1.0, "R1": 0.01, "R2": 0.01, "material": "steel"}
        | {"e": {"uniform": [1e-6, 1.0]}, "n": {"uniform": [1.0, 2.0]}},
        "solver": {"rtol": 1e-4},
    }
    study = impact.sensitivity(config).isel(model=0)
    of_e, of_n = study["total"].values
    assert (of_e > 0.5, of_n) == (True, 0.0)


def test_an_output_that_is_an_error_of_the_integration_depends_on_nothing() -> None:
    """Of equal masses the first one stops, to the errors of v0."""
    config = {
        "models": "hertz",
        "frictions": ["coulomb-1785"],
        "design": {"n": 16},
        "sweep": {"v1": {"uniform": [0.8, 1.2]}, "m1": 1.0, "m2": 1.0, "R1": 0.1, "R2": 0.1, "K": 1e6, "n": 1.5}
        | {"angle": 0.1, "mu": 0.9},
    }
    for study in impact.sensitivities(config, ["v1_post", "energy_loss", "slip_post"]):
        assert abs(float(study["mean"].squeeze())) < 1e-9
        assert np.isnan(study["total"]).all()


def test_a_law_without_the_output_has_not_failed(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT.replace('"gonthier-2004"', '"hertz"'))
    done = cli("sensitivity", "c.toml", "--of", "damping_ratio", "--quiet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "damping_ratio: the law has none" in done.stdout


@pytest.mark.parametrize(("of", "angle"), [("psi1", 0.1), ("beta", 0.0)])
def test_a_friction_law_without_the_output_has_not_failed(of: str, angle: float) -> None:
    """Coulomb's friction has no spring, and beta needs a slip."""
    balls = {"m1": 1.0, "m2": 1.0, "R1": 0.1, "R2": 0.1, "K": 1e6, "n": 1.5}
    sweep = {"v1": {"uniform": [0.8, 1.2]}, **balls, "angle": angle, "mu": 0.3}
    config = {"models": "hertz", "frictions": ["coulomb-1785"], "design": {"n": 16}, "sweep": sweep}
    study = impact.sensitivity(config, of=of)
    assert study["failed"].item() == 0
    assert f"{of}: the law has none" in str(impact.describe(study))


def test_samples_without_the_output_beside_others_are_counted() -> None:
    balls = {"m1": 1.0, "m2": 1.0, "R1": 0.1, "R2": 0.1, "K": 1e6, "n": 1.5}
    sweep = {"v1": 1.0, **balls, "u1": {"empirical": [0.0, 1.0]}, "mu": 0.3}
    config = {"models": "hertz", "frictions": ["coulomb-1785"], "design": {"n": 16}, "sweep": sweep}
    assert 0 < impact.sensitivity(config, of="beta")["failed"].item() < 48


def test_a_study_says_how_many_points_a_code_with_fixed_steps_reaches_slowly() -> None:
    """As a sweep does; e_out of the same impacts has no such limit."""
    sweep = {"v1": 1.0, "angle": {"uniform": [0.1, 1.2]}, "mu": 0.3, "e": 0.6, "m2": math.inf, "R1": 0.01}
    config = {"models": "tsuji-1992", "frictions": ["lammps-mindlin"], "sweep": {**sweep, "material": "steel"}}
    design = {"design": {"n": 16}}
    slow = int((impact.sweep({**config, **design})["friction_status"] == 4).sum())
    assert 0 < slow < 16
    with pytest.warns(impact.ImpactWarning, match=r"^beta of \d+ of 48 points is the limit of small steps"):
        impact.sensitivities({**config, **design}, ["e_out", "beta"])
    with warnings.catch_warnings(action="error"):
        impact.sensitivity({**config, **design}, of="e_out")


def test_an_angle_of_a_study_is_in_degrees() -> None:
    """As in the config and in tables of other commands; the dataset is in rad."""
    balls = {"m1": 1.0, "m2": math.inf, "R1": 0.1, "K": 1e6}
    sweep = {"v1": 1.0, "angle": {"uniform": ["20 deg", "40 deg"]}, "mu": 0.3, **balls}
    config = {"models": "hertz", "frictions": ["coulomb-1785"], "design": {"n": 64}, "sweep": sweep}
    study = impact.sensitivity(config, of="rebound_angle")
    assert study["mean"].attrs["units"] == "rad"
    mean, sd = (math.degrees(study[name].item()) for name in ("mean", "sd"))
    low, *_, high = np.degrees(study["quantiles"].values.ravel())
    text = str(impact.describe(study))
    assert f"rebound_angle: mean {mean:.6g}°, sd {sd:.3g}, 5 % {low:.6g}, 50 % " in text
    assert f", 95 % {high:.6g}" in text


def test_a_picture_of_samples_marks_the_limit_of_small_steps() -> None:
    """As pictures over an angle do; the restitution has no such limit."""
    sweep = {"v1": 1.0, "angle": {"uniform": [0.1, 1.2]}, "mu": 0.3, "e": 0.6, "m2": math.inf, "R1": 0.01}
    laws = {"models": ["tsuji-1992", "hunt-crossley-1975"], "frictions": ["lammps-mindlin"]}
    samples = impact.sweep({**laws, "sweep": {**sweep, "material": "steel"}, "design": {"n": 16}})
    marked = {}
    for name in ("beta", "e_out"):
        texts = impact.plot(samples, variable=name).legends[0].get_texts()
        marked[name] = [text.get_text().endswith("limit of small steps") for text in texts]
    assert sorted(marked["beta"]) == [False, True]
    assert not any(marked["e_out"])


SIMBODY_ENDS = {"c": (0.01, 3.0), "v1": (0.05, 3.0)}


def by_quadrature() -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices of the restitution of Hunt and Crossley, which is not additive."""
    x, weights = np.polynomial.legendre.leggauss(200)
    c, v1 = (least + 0.5 * (1.0 + x) * (most - least) for least, most in SIMBODY_ENDS.values())
    e, weights = hunt_crossley(c[:, None], v1), 0.5 * weights
    mean = weights @ e @ weights
    alone = np.array([weights @ (e @ weights - mean) ** 2, weights @ (weights @ e - mean) ** 2])
    variance = weights @ (e - mean) ** 2 @ weights
    return alone / variance, 1.0 - alone[::-1] / variance


@pytest.mark.slow
def test_indices_of_inputs_that_act_together_are_those_of_a_quadrature() -> None:
    c, v1 = ({"uniform": list(ends)} for ends in SIMBODY_ENDS.values())
    config = {
        "models": "simbody-hunt-crossley",
        "design": {"n": 2**13},
        "sweep": {"v1": v1, "m1": 1.0, "m2": 1.0, "K": 1e6},
        "model": {"simbody-hunt-crossley": {"c": c}},
    }
    study = impact.sensitivity(config).isel(model=0)
    first, total = by_quadrature()
    np.testing.assert_allclose([first, total], [[0.5216, 0.4539], [0.5461, 0.4784]], atol=1e-4)
    paths = ["model.simbody-hunt-crossley.c", "sweep.v1"]
    np.testing.assert_allclose(study["first"].sel(input=paths), first, atol=2e-3)
    np.testing.assert_allclose(study["total"].sel(input=paths), total, atol=2e-3)


def product_of_powers(*factors: np.ndarray) -> np.ndarray:
    return np.prod([x**power for x, power in zip(factors, POWERS["peak_force"], strict=True)], axis=0)


CASES = {"hertz": (product_of_powers, ENDS), "hunt-crossley": (hunt_crossley, SIMBODY_ENDS)}


def indices_of_case(case: str, design: Design, seed: int | None) -> tuple[dict[str, Any], np.ndarray]:
    """The indices of a closed form, and its values."""
    law, ends = CASES[case]
    u = unit_samples(design, 2 * len(ends))
    rows = mixed_rows(*np.split(u, 2, axis=1))
    of_inputs = zip(rows.T, ends.values(), strict=True)
    values = law(*(least + of_input * (most - least) for of_input, (least, most) in of_inputs))
    values = values.reshape(1, len(ends) + 2, design.n)
    return indices_of(values, seed), values


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "n"),
    [
        pytest.param(
            case, n, marks=() if (case, n) in (("hertz", 256), ("hunt-crossley", 64)) else pytest.mark.long
        )
        for case in CASES
        for n in (64, 128, 256)
    ],
)
def test_intervals_of_random_samples_hold_the_index_in_95_percent_of_200_cases(case: str, n: int) -> None:
    exact = closed_form("peak_force") if case == "hertz" else by_quadrature()
    holds = []
    for seed in range(200):
        indices, _ = indices_of_case(case, Design(method="random", n=n, seed=seed), seed)
        first = (indices["first_lower"][0] <= exact[0]) & (exact[0] <= indices["first_upper"][0])
        total = (indices["total_lower"][0] <= exact[1]) & (exact[1] <= indices["total_upper"][0])
        holds.append([first, total])
    # four standard errors of a share of 0.95
    assert np.abs(np.mean(holds, axis=0) - 0.95).max() <= 4.0 * math.sqrt(0.95 * 0.05 / 200)


def test_indices_are_those_of_scipy() -> None:
    indices, values = indices_of_case("hunt-crossley", Design(n=256), None)
    a, b, *mixed = values[0]
    of_scipy = stats.sobol_indices(func={"f_A": a, "f_B": b, "f_AB": np.array(mixed)[:, None]}, n=256)
    np.testing.assert_allclose(indices["first"][0], of_scipy.first_order, rtol=1e-12)
    np.testing.assert_allclose(indices["total"][0], of_scipy.total_order, rtol=1e-12)
    assert np.isnan(indices["first_lower"]).all()


def test_the_unit_of_an_output_is_written_as_in_a_config() -> None:
    sweep = {"v1": {"uniform": [0.8, 1.2]}, "m1": 1.0, "m2": 2.0, "K": 1e6}
    study = impact.sensitivity({"models": "hertz", "sweep": sweep, "design": {"n": 64}}, of="v2_post")
    assert re.search(r"mean [0-9.]+ m/s, sd", str(impact.describe(study)))


def test_one_uncertain_input_explains_the_whole_variance() -> None:
    config = hertz(n=2**10)
    config["sweep"] |= {"m1": 1.0, "K": 1e6}
    study = impact.sensitivity(config, of="peak_force").isel(model=0)
    assert study["input"].values.tolist() == ["sweep.v1"]
    assert (study["first"].item(), study["total"].item()) == pytest.approx((1.0, 1.0), abs=1e-3)
    # an index is not above 1, and so is no end of its interval
    assert study["first_upper"].item() == study["total_upper"].item() == 1.0


def test_the_reference_of_impulse_and_momentum_has_a_study_for_each_model() -> None:
    config = {**hertz(n=64), "models": ["hertz", "exact-hysteresis"]}
    config["sweep"] |= {"e": 0.5}
    study, of_exact = (impact.sensitivity(config, of=of) for of in ("v1_reference", "v1_post"))
    assert study["first"].dims == ("model", "input")
    # exact-hysteresis delivers the requested restitution
    for model in config["models"]:
        indices = study["first"].sel(model=model)
        np.testing.assert_allclose(indices, of_exact["first"].sel(model="exact-hysteresis"), atol=1e-6)


def test_inputs_that_change_nothing_are_named_and_few_samples_are_noted(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)
    words = ("sensitivity", "c.toml", "--set", "sweep.e.uniform=[0.3, 0.6]", "--set", "models='tsuji-1992'")
    printed = cli(*words, "--set", "design.n=32", cwd=tmp_path).stdout
    assert "; it does not depend on sweep.v1, sweep.K; the intervals need at least 64 samples\n" in printed
    (row,) = [line for line in printed.splitlines() if line.startswith("sweep.")]
    assert row.startswith("sweep.e ")


@pytest.mark.slow
def test_several_outputs_of_one_run_have_the_studies_of_each(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)
    changes = ["sweep.e=0.6", "models='kuwabara-kono-1987'", "model.kuwabara-kono-1987.A=5e-4", "design.n=16"]
    words = ("sensitivity", "c.toml", *(word for change in changes for word in ("--set", change)))
    outputs = ("peak_force", "e_out")
    both = [word for of in outputs for word in ("--of", of)]
    studies = json.loads(cli(*words, *both, "--json", cwd=tmp_path).stdout)
    assert [study["of"] for study in studies] == list(outputs)
    for study in studies:
        alone = impact.sensitivity(tmp_path / "c.toml", of=study["of"], overrides=changes).isel(model=0)
        assert study["mean"] == alone["mean"].item()
        assert [row["total"] for row in study["indices"]] == alone["total"].values.tolist()
    printed = cli(*words, *both, cwd=tmp_path).stdout
    assert [line.partition(":")[0] for line in printed.splitlines() if ": mean " in line] == list(outputs)
    # the table of each output begins with the input of the largest total index
    rows = [line.split()[0] for line in printed.splitlines() if line.startswith("sweep.")]
    ranked = [sorted(study["indices"], key=lambda row: -row["total"]) for study in studies]
    assert rows == [row["input"] for indices in ranked for row in indices]
    done = cli(*words, *both, "-o", "s.h5", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "--output: got 2 outputs (--of), expected one for a file\n")
    assert not (tmp_path / "s.h5").exists()


@pytest.mark.slow
def test_mean_and_quantiles_of_a_study_are_those_of_the_samples() -> None:
    study = impact.sensitivity(hertz(n=2**12), of="peak_force").isel(model=0)
    exact = MEAN_FACTOR["peak_force"] * math.prod(
        mean_power(*ends, p) for ends, p in zip(ENDS.values(), POWERS["peak_force"], strict=True)
    )
    assert float(study["mean"]) == pytest.approx(exact, rel=1e-4)
    swept = impact.sweep(hertz(n=2**14))["peak_force"]
    assert float(study["sd"]) == pytest.approx(float(swept.std()), rel=2e-3)
    np.testing.assert_allclose(study["quantiles"], np.quantile(swept, study["quantile"]), rtol=5e-3)


@pytest.mark.slow
def test_the_error_of_a_mean_falls_faster_with_sobol_than_with_random_samples() -> None:
    exact = MEAN_FACTOR["peak_force"] * math.prod(
        mean_power(*ends, p) for ends, p in zip(ENDS.values(), POWERS["peak_force"], strict=True)
    )
    sizes = 2 ** np.arange(5, 12)

    def rate(method: str) -> float:
        """The power of n with which the root mean square of the error over seeds falls."""
        errors = [
            [float(impact.sweep(hertz(method, int(n), seed))["peak_force"].mean()) - exact for seed in range(6)]
            for n in sizes
        ]
        rms = np.sqrt(np.mean(np.square(errors), axis=1))
        return float(np.polyfit(np.log(sizes), np.log(rms), 1)[0])

    assert rate("sobol") < -0.8
    assert rate("random") > -0.8


def test_a_latin_hypercube_has_a_sample_in_each_stratum() -> None:
    swept = impact.sweep(hertz("lhs", n=100, seed=3))
    for name, (least, most) in ENDS.items():
        strata = np.floor((swept[name].values - least) / (most - least) * 100).astype(int)
        assert sorted(strata.tolist()) == list(range(100)), name


# the largest rank correlation of two inputs: four standard errors of 1,024 samples, or less
METHODS = {"sobol": 0.02, "halton": 0.02, "lhs": 0.125, "random": 0.125}
DISTRIBUTIONS: dict[str, tuple[dict[str, Any], Any]] = {
    "v1": ({"uniform": ["1 km/h", "2 m/s"]}, stats.uniform(1 / 3.6, 2.0 - 1 / 3.6)),
    "K": ({"normal": [1.0, 0.1]}, stats.norm(1.0, 0.1)),
    "m1": ({"lognormal": ["1000 g", 1.5]}, stats.lognorm(math.log(1.5))),
    "m2": ({"triangular": [0.5, 0.6, 1.5]}, stats.triang(0.1, 0.5, 1.0)),
    "e": ({"triangular": [0.0, 0.0, "100 %"]}, stats.triang(0.0, 0.0, 1.0)),
}


@pytest.mark.parametrize(("method", "largest_correlation"), METHODS.items())
def test_samples_have_their_distribution_and_are_not_correlated(method: str, largest_correlation: float) -> None:
    config = hertz(method, n=1024)
    config["sweep"] = {name: value for name, (value, _) in DISTRIBUTIONS.items()}
    swept = impact.sweep(config)
    for name, (_, distribution) in DISTRIBUTIONS.items():
        assert swept[name].dims == ("sample",)
        distance = stats.kstest(swept[name].values, distribution.cdf)
        # a standard deviation that is wrong by a tenth has a distance of 0.02
        assert distance.pvalue > 1e-3 if method == "random" else distance.statistic < 0.01, name
    assert swept["v2"].ndim == 0
    correlations = stats.spearmanr(np.column_stack([swept[name].values for name in DISTRIBUTIONS])).statistic
    assert np.abs(correlations - np.eye(len(DISTRIBUTIONS))).max() < largest_correlation


@pytest.mark.slow
def test_empirical_values_come_from_a_file_with_a_unit(tmp_path: Path) -> None:
    (tmp_path / "speeds.csv").write_text("v1 [km/h], other\n3.6, 1\n7.2, 2\n18, 3\n")
    text = TEXT.replace('{ normal = ["1 m/s", 0.05] }', '{ empirical = "speeds.csv" }')
    (tmp_path / "c.toml").write_text(text)
    swept = impact.sweep(tmp_path / "c.toml", output=tmp_path / "r.h5")
    values, counts = np.unique(swept["v1"], return_counts=True)
    np.testing.assert_allclose(values, [1.0, 2.0, 5.0])
    assert counts.min() >= 20
    # the values are stored, so that the file is not needed again
    (tmp_path / "speeds.csv").unlink()
    assert impact.rerun(tmp_path / "r.h5").equal


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_with_any_number_of_jobs(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)
    for words in (["sweep", "c.toml"], ["sensitivity", "c.toml", "--of", "peak_force"]):
        for name, jobs in (("1.h5", "1"), ("2.h5", "2")):
            done = cli(*words, "-j", jobs, "-o", name, "--overwrite", cwd=tmp_path)
            assert done.returncode == 0, done.stderr
        assert (tmp_path / "1.h5").read_bytes() == (tmp_path / "2.h5").read_bytes()
    one, other = (impact.sweep(tmp_path / "c.toml", overrides=[f"design.seed={seed}"]) for seed in (0, 1))
    assert not np.array_equal(one["v1"], other["v1"])


def test_a_result_says_how_its_samples_were_drawn(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)
    design = json.loads(impact.sweep(tmp_path / "c.toml").attrs["design"])
    assert {name: design[name] for name in ("method", "n", "seed")} == {"method": "sobol", "n": 64, "seed": 0}
    assert design["distributions"] == {"v1": {"normal": [1.0, 0.05]}, "K": {"lognormal": [2e6, 1.2]}}


@pytest.mark.slow
def test_samples_are_an_axis_for_every_command(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)

    def run(*words: str) -> str:
        done = cli(*words, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    run("sweep", "c.toml", "-o", "r.h5")
    assert run("rerun", "r.h5").startswith("equal: ")
    for part in ("1/2", "2/2"):
        run("sweep", "c.toml", "--shard", part, "-o", "m.h5")
    run("merge", "m.h5.1-of-2.work", "m.h5.2-of-2.work", "-o", "m.h5")
    assert (tmp_path / "m.h5").read_bytes() == (tmp_path / "r.h5").read_bytes()
    run("sweep", "c.toml", "-o", "f.h5", "--set", "output.layout=factored")
    run("extend", "r.h5", "--set", "design.n=128", "-o", "x.h5")
    run("sweep", "c.toml", "-o", "y.h5", "--set", "design.n=128")
    for new, old in (("f.h5", "r.h5"), ("x.h5", "y.h5")):
        assert run("compare", new, old).startswith("equal: ")
    swept = impact.load(tmp_path / "r.h5")
    point = swept.sel(model="tsuji-1992", e=0.6).isel(sample=17)
    shot = json.loads(run("run", "r.h5", "--model", "tsuji-1992", "--at", "e=0.6", "--at", "sample=17", "--json"))
    assert shot["outputs"]["peak_force"] == point["peak_force"].item()
    assert shot["inputs"]["v1"] == point["v1"].item()


def test_material_properties_and_parameters_of_models_may_be_uncertain() -> None:
    swept = impact.sweep(
        {
            "models": ["kuwabara-kono-1987", "hertz"],
            "design": {"n": 16},
            "materials": {
                "soft": {"E": {"lognormal": ["1 GPa", 1.3]}, "nu": {"uniform": [0.2, 0.4]}, "rho": 1000}
            },
            "sweep": {"v1": 1.0, "R1": 0.01, "R2": 0.01, "material": "soft"},
            "model": {"kuwabara-kono-1987": {"A": {"uniform": ["1 us", "3 us"]}}},
        }
    )
    for name in ("materials.soft.E", "materials.soft.nu", "kuwabara-kono-1987.A"):
        assert swept[name].dims == ("sample",)
        assert np.unique(swept[name]).size == 16
    by_model = swept["e_out"].std("sample")
    assert by_model.sel(model="kuwabara-kono-1987") > 1e-3
    assert by_model.sel(model="hertz") < 1e-9


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("design.n=1000", "design.n: got 1000, expected a power of two for sobol: 512 or 1024"),
        ("design.method=grid", 'design.method: got "grid", expected a method; known: halton, lhs, random, sobol'),
        ("design.n=0", "design.n: got 0, expected a whole number from 1 to 4,194,304"),
        ("design.m=4", "design.m: unknown key; known: method, n, seed"),
        ("sweep.v1.normal=[1.0, 0.0]", "sweep.v1.normal[1]: got 0.0, expected a number > 0 m/s"),
        ("sweep.v1.uniform=[2, 1]", "sweep.v1.uniform: got 2 to 1, expected [least, most] in ascending order"),
        ("sweep.v1.triangular=[1, 2]", "sweep.v1.triangular: got a list of 2, expected [least, mode, most]"),
        ("sweep.v1.lognormal=[1, 0.5]", "sweep.v1.lognormal[1]: got 0.5, expected a number > 1"),
        ("sweep.v1.lognormal=[-1, 1.5]", "sweep.v1.lognormal[0]: got -1, expected a median > 0"),
        ("sweep.v1.gauss=[1, 2]", "sweep.v1.gauss: unknown key"),
        ("sweep.v1.empirical=[]", "sweep.v1.empirical: got an empty list, expected a list of at least one"),
        ("sweep.v1.empirical=no.csv", "no.csv: cannot be read"),
        (
            "sweep.v1.empirical=5",
            "sweep.v1.empirical: got 5, expected the name of a CSV file, or a list of numbers",
        ),
        ("sweep.m1.normal=[1.0, 1.0]", "sweep.m1: got 10 of 64 samples such as"),
        ('sweep.zip=[["v1", "e"]]', 'got "v1", an uncertain input; those vary together already'),
        (
            "sweep.v1={uniform=[1, 2], normal=[1, 2]}",
            "sweep.v1: got uniform and normal, expected one distribution",
        ),
    ],
)
def test_a_wrong_design_is_one_line_with_its_place(change: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)
    (line,) = problems_of(impact.sweep, tmp_path / "c.toml", overrides=[change])
    assert message in line


@pytest.mark.slow
@pytest.mark.parametrize("design", ["{}", "{ m = 4 }", '{ method = "lhs" }'])
def test_a_design_without_a_number_of_samples_is_one_line(design: str, cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT.replace("[design]\nn = 64\n", f"design = {design}\n"))
    words = "c.toml:3: design.n: missing, expected the number of samples; a power of two for sobol, such as 1024\n"
    for command in (("sweep", "c.toml"), ("sweep", "c.toml", "--dry-run"), ("sensitivity", "c.toml")):
        done = cli(*command, cwd=tmp_path)
        assert done.returncode == 2
        assert words in done.stderr


def test_the_first_value_of_a_file_without_a_name_is_not_taken_for_one(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)
    (tmp_path / "speeds.csv").write_text("0.9\n1.0\n1.3\n")
    (line,) = problems_of(impact.sweep, tmp_path / "c.toml", overrides=["sweep.v1.empirical=speeds.csv"])
    assert "speeds.csv:1: got a number, expected the name of the column" in line


def test_one_sample_has_no_index(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)
    done = cli("sensitivity", "c.toml", "--set", "design.n=1", cwd=tmp_path)
    expected = "c.toml: design.n: got 1, expected a power of two from 2 on for Sobol indices: 2 or 4\n"
    assert (done.returncode, done.stderr) == (2, expected)


def test_distributions_and_the_table_design_need_each_other(tmp_path: Path) -> None:
    path = tmp_path / "c.toml"
    path.write_text(TEXT.replace("[design]\nn = 64\n", ""))
    with pytest.raises(ConfigError, match=r"c.toml:5: sweep.v1: got a distribution, expected a table \[design\]"):
        impact.sweep(path)
    path.write_text(TEXT)
    with pytest.raises(ConfigError, match=r"c.toml:3: design: got a design without an uncertain input"):
        impact.sweep(path, overrides=["sweep.v1=1", "sweep.K=1e6"])
    with pytest.raises(ConfigError, match="got no uncertain input, expected a design and distributions"):
        impact.sensitivity(ROOT / "configs" / "figure6.toml")
    with pytest.raises(
        ConfigError, match=r"design.n: got 100, expected a power of two for Sobol indices: 64 or 128"
    ):
        impact.sensitivity(path, overrides=["design.method=lhs", "design.n=100"])
    with pytest.raises(
        ConfigError, match="got an uncertain input, which impact sweep and impact sensitivity take"
    ):
        impact.calibrate(path, overrides=["sweep.e.fit=[0.1, 1.0]", "data.columns={e_out=[0.5]}"])
    with pytest.raises(UsageError, match='no output "peakforce"; did you mean "peak_force"'):
        impact.sensitivity(path, of="peakforce")


@pytest.mark.slow
def test_failed_samples_are_counted_and_not_averaged(cli: Run, tmp_path: Path) -> None:
    """A speed of mean and deviation 0.05 is negative for a sixth of the samples, where the balls do not meet."""
    (tmp_path / "c.toml").write_text(TEXT)
    slow = ("--set", "sweep.v1.normal=[0.05, 0.05]", "--set", "sweep.e=0.6")
    done = cli("sensitivity", "c.toml", *slow, "--json", cwd=tmp_path)
    assert done.returncode == 3
    for study in json.loads(done.stdout):
        assert study["failed"] > 10
        assert study["mean"] is None
        assert {index["total"] for index in study["indices"]} == {None}
    swept = impact.sweep(tmp_path / "c.toml", overrides=["sweep.v1.normal=[0.05, 0.05]"])
    with pytest.raises(UsageError, match=r"nothing to draw: gonthier-2004, where \d+ samples have no result"):
        impact.plot(swept)
    # a band has a gap
    is_first = (swept["model"] == "gonthier-2004") & (swept["e"] == 0.3) & (swept["sample"] == 5)
    good = impact.sweep(tmp_path / "c.toml")
    (axes,) = impact.plot(good.assign(e_out=good["e_out"].where(~is_first))).axes
    requested, gap, *edges, whole, _, _ = (line.get_ydata() for line in axes.lines if len(line.get_xdata()) == 2)
    assert np.isfinite([requested, whole]).all()
    assert np.isnan([gap, *edges])[:, 0].all()
    assert np.isfinite([gap, *edges])[:, 1].all()


def test_the_json_names_the_output_the_law_and_the_inputs(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)
    words = ("--of", "peak_force", "--set", 'models="tsuji-1992"', "--set", "sweep.e=0.6", "--json")
    study = json.loads(cli("sensitivity", "c.toml", *words, cwd=tmp_path).stdout)
    assert (study["of"], study["n"], study["model"]) == ("peak_force", 64, "tsuji-1992")
    assert [index["input"] for index in study["indices"]] == ["sweep.v1", "sweep.K"]


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    path = tmp_path_factory.mktemp("uncertain") / "c.toml"
    path.write_text(TEXT)
    return impact.sweep(path)


def test_the_band_of_a_picture_is_that_of_the_samples(samples: xr.Dataset) -> None:
    (axes,) = impact.plot(samples, variable="peak_force").axes
    values = samples["peak_force"].sel(model="gonthier-2004")
    lines = [line for line in axes.lines if line.get_xdata().size == 2]
    np.testing.assert_allclose(lines[0].get_ydata(), values.median("sample"))
    np.testing.assert_allclose(lines[1].get_ydata(), values.quantile(0.05, "sample"))
    np.testing.assert_allclose(lines[2].get_ydata(), values.quantile(0.95, "sample"))


def test_without_another_axis_the_picture_is_the_distribution_function(samples: xr.Dataset) -> None:
    (axes,) = impact.plot(samples, variable="peak_force", sel={"e": 0.6}).axes
    values = np.sort(samples["peak_force"].sel(model="gonthier-2004", e=0.6))
    np.testing.assert_allclose(axes.lines[0].get_xdata(), values)
    np.testing.assert_allclose(axes.lines[0].get_ydata(), (np.arange(64) + 0.5) / 64)


def test_numbers_of_a_distribution_are_apart_from_their_decimal_commas(samples: xr.Dataset) -> None:
    point, comma = (impact.plot(samples, decimal=decimal).texts[1].get_text() for decimal in ("point", "comma"))
    of_v1, of_K = re.findall(r"normal\((.*?)\)", point)
    assert of_v1.replace(",", ";").replace(".", ",") in comma
    assert of_K.replace(",", ";").replace(".", ",") in comma


def test_the_table_of_a_distribution_function_has_the_values_and_their_shares(
    samples: xr.Dataset, tmp_path: Path
) -> None:
    impact.save(samples, tmp_path / "s.h5")
    impact.plot_to_files(tmp_path / "s.h5", kinds=["uncertainty"], sel={"e": 0.6}, data=tmp_path / "s.csv")
    table = pd.read_csv(tmp_path / "s.csv")
    key = samples["model"].values[0]
    np.testing.assert_allclose(table[f"e_out {key}"], np.sort(samples["e_out"].sel(model=key, e=0.6)))
    np.testing.assert_allclose(table[f"share {key}"], (np.arange(64) + 0.5) / 64)
    # a measured value has no share, and is not drawn at its own number
    with pytest.raises(UsageError, match="the picture shows e_out and share, and the points have e_out"):
        impact.plot(samples, sel={"e": 0.6}, points=pd.DataFrame({"e_out": [0.5]}))


def test_a_part_of_a_study_is_described_and_drawn() -> None:
    sweep = {"v1": {"uniform": [0.5, 1.5]}, "m1": {"uniform": [1, 2]}, "m2": 1.0, "K": 1e6, "n": 1.5}
    study = impact.sensitivity({"models": ["hertz"], "design": {"n": 8}, "sweep": sweep}, of="peak_force")
    text = str(impact.describe(study.isel(quantile=[0])))
    assert ", 5 % " in text
    assert "50 %" not in text
    assert "5 % " in str(impact.describe(study.isel(quantile=0)))
    (axes,) = impact.plot(study, sel={"input": "sweep.m1"}).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["$m_1$"]


def test_intervals_of_a_picture_end_where_the_study_says() -> None:
    """An index of few samples is above 1, where its interval ends."""
    sweep = {"e": {"uniform": [0.4, 0.8]}, "v1": {"normal": [1.0, 0.1]}, "K": 1e6, "m1": 1.0, "m2": 1.0}
    config = {"models": ["hunt-crossley-1975"], "design": {"n": 128}, "sweep": sweep}
    study = impact.sensitivity(config).isel(model=0)
    assert study["first"].max() > study["first_upper"].max() == 1.0
    (axes,) = impact.plot(study).axes
    drawn = [segment[:, 0] for lines in axes.collections for segment in lines.get_segments()]
    ends = [np.stack([study[f"{index}_lower"], study[f"{index}_upper"]], axis=1) for index in ("first", "total")]
    assert np.array(drawn) == pytest.approx(np.concatenate(ends))


def test_the_bars_of_every_panel_are_within_the_picture() -> None:
    """An index of few samples is below 0, and with one friction law more so than with another."""
    sweep = {"v1": 1.0, "angle": {"uniform": [0.2, 1.3]}, "mu": {"uniform": [0.1, 0.4]}, "e": 0.6}
    contact = {"K": 1e6, "n": 1, "m1": 1.0, "m2": math.inf, "R1": 0.1}
    config = {
        "models": ["anagnostopoulos-1988"],
        "frictions": ["coulomb-1785", "cundall-strack-1979"],
        "sweep": {**sweep, **contact},
        "friction": {"cundall-strack-1979": {"kt_over_kn": 0.5}},
        "design": {"n": 8, "seed": 1},
    }
    study = impact.sensitivity(config, of="omega1_post")
    left, right = impact.plot(study).axes[0].get_xlim()
    indices = np.stack([study["first"], study["total"]])
    assert left <= indices.min() < -0.3
    assert 1.2 < indices.max() <= right


def test_a_law_has_no_studies_along_parameters_of_other_laws() -> None:
    config = {
        "models": ["kelvin-voigt", "kuwabara-kono-1987"],
        "design": {"n": 2},
        "sweep": {"v1": {"uniform": [1.0, 2.0]}, "m1": 1.0, "m2": 1.0, "R1": 0.1, "R2": 0.1, "material": "steel"},
        "model": {"kelvin-voigt": {"K": 1e6, "C": [50.0, 80.0]}, "kuwabara-kono-1987": {"A": [1e-6, 2e-6, 3e-6]}},
    }
    studies = impact.describe(impact.sensitivity(config)).as_dict()["studies"]
    assert [study["at"] for study in studies] == [
        *({"kelvin-voigt.C": value} for value in (50.0, 80.0)),
        *({"kuwabara-kono-1987.A": value} for value in (1e-6, 2e-6, 3e-6)),
    ]


@pytest.mark.slow
def test_a_study_is_stored_drawn_and_reported(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TEXT)
    study = impact.sensitivity(
        tmp_path / "c.toml", of="peak_force", output=tmp_path / "s.h5", overrides=["sweep.e=0.6"]
    )
    xr.testing.assert_identical(impact.load(tmp_path / "s.h5").load(), study)
    figure = impact.plot(study)
    widths = [bar.get_width() for bar in figure.axes[0].patches]
    np.testing.assert_allclose(widths, [*study["first"][0], *study["total"][0]])
    axes = impact.plot(study, labels={"K": "Stiffness", "v1": "Speed", "index": "Share"}).axes[-1]
    names = {tick.get_text() for tick in axes.get_yticklabels()}
    assert (names, axes.get_xlabel()) == ({"Stiffness", "Speed"}, "Share")
    assert cli("plot", "s.h5", cwd=tmp_path).returncode == 0
    assert cli("report", "s.h5", "-o", "s.html", cwd=tmp_path).returncode == 0
    page = (tmp_path / "s.html").read_text(encoding="utf-8")
    assert f"{float(study['total'][0, 0]):.4f}" in page
    assert page.count("<img") == 1
    assert "64 samples (sobol, seed 0)" in cli("info", "s.h5", cwd=tmp_path).stdout


@pytest.mark.slow
def test_a_report_of_an_uncertain_e_has_the_band_over_another_axis() -> None:
    inputs = {"e": {"uniform": [0.5, 0.7]}, "v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 1e6}
    result = impact.sweep({"models": "gonthier-2004", "sweep": inputs, "design": {"n": 16}})
    assert "plot RESULT.h5 --kind=uncertainty --x=v1" in impact.report(result)


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    ["recommend s.h5", "rerun s.h5", "extend s.h5 --set sweep.m1=1", "run s.h5", "compare s.h5 s.h5",
     "expand s.h5 -o f.h5", "bless s.h5 b.h5 --reason first"],
)  # fmt: skip
def test_commands_that_take_a_sweep_refuse_a_study_in_one_line(cli: Run, tmp_path: Path, words: str) -> None:
    impact.sensitivity(hertz(n=16), of="peak_force", output=tmp_path / "s.h5")
    done = cli(*words.split(), cwd=tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert "this is a sensitivity study, expected the result of a sweep" in done.stderr


def test_a_damaged_study_is_refused_in_one_line(tmp_path: Path) -> None:
    study = impact.sensitivity(hertz(n=16), of="peak_force")
    damaged = {
        "total: got none": study.drop_vars("total"),
        "first: got input, model": study.assign(first=study["first"].transpose()),
        "of: expected the name of an output": study.assign_attrs(of="nothing"),
        "no design": study.assign_attrs(design="{}"),
    }
    for number, (message, dataset) in enumerate(damaged.items()):
        with pytest.raises(UsageError, match=message):
            impact.save(dataset, tmp_path / f"{number}.h5")


def test_the_page_explains_every_distribution_and_method() -> None:
    from impact.config.quantities import DISTRIBUTION_FORMS
    from impact.config.tables import DESIGN_METHODS

    page = (ROOT / "docs" / "uncertainty.md").read_text(encoding="utf-8")
    for name in DISTRIBUTION_FORMS:
        assert f"{{ {name} = " in page
    for method in DESIGN_METHODS:
        assert f'"{method}"' in page
