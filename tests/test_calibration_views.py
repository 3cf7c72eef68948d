"""The picture and the report of a calibration, and the commands that take no calibration."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import impact
from impact.errors import UsageError

from .conftest import ROOT, Run

FOLDER = ROOT / "docs" / "calibrate"
QUICK = ("solver.rtol=1e-6",)


@pytest.fixture(scope="module")
def drops() -> xr.Dataset:
    models = 'models=["kuwabara-kono-1987", "hunt-crossley-1975"]'
    return impact.calibrate(FOLDER / "drops.toml", overrides=[models, *QUICK])


@pytest.mark.slow
def test_the_picture_has_measured_values_curves_bands_and_residuals(drops: xr.Dataset) -> None:
    figure = impact.plot(drops)
    values, residuals = figure.axes
    assert values.get_ylabel().startswith("Delivered restitution")
    assert residuals.get_ylabel() == "Residual in σ"
    (bars,) = values.containers
    np.testing.assert_array_equal(bars.lines[0].get_xdata(), drops["v1"])
    np.testing.assert_array_equal(bars.lines[0].get_ydata(), drops["measured"])
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert any("ΔAICc = 0.0" in name for name in names)
    assert any("at bound" in name for name in names)
    assert {"Measured", "Band of 95 %"} <= set(names)
    drawn = next(line for line in residuals.lines if len(line.get_xdata()) == drops.sizes["point"])
    expected = drops.isel(model=0)["residual"] / drops["sigma"]
    np.testing.assert_allclose(drawn.get_ydata(), expected)


@pytest.mark.slow
def test_the_axes_are_logarithmic_as_asked_or_as_the_input_is_spaced(drops: xr.Dataset) -> None:
    def scales(fit: xr.Dataset, **options: str) -> list[tuple[str, str]]:
        return [(axes.get_xscale(), axes.get_yscale()) for axes in impact.plot(fit, **options).axes]

    linear, log = "linear", "log"
    # the speeds of the drops are in geometric progression, from 0.1 to 3 m/s
    assert scales(drops) == [(log, linear), (log, linear)]
    assert scales(drops, log="x") == [(log, linear), (log, linear)]
    # residuals have both signs; another axis stays as the input is spaced
    assert scales(drops, log="y") == [(log, log), (log, linear)]
    even = drops.assign_coords(v1=drops["v1"].copy(data=np.linspace(0.1, 3.0, drops.sizes["point"])))
    assert scales(even) == [(linear, linear), (linear, linear)]
    grid = drops["grid"]
    geometric = even.assign_coords(grid=grid.copy(data=np.geomspace(grid[0], grid[-1], grid.size)))
    assert scales(geometric) == [(log, linear), (log, linear)]
    assert scales(even, log="y") == [(linear, log), (linear, linear)]


@pytest.mark.parametrize(("speeds", "scale"), [([0.1, 0.3, 0.9, 2.7], "log"), ([0.1, 1.0, 1.8, 2.7], "linear")])
def test_the_axis_of_an_input_has_the_scale_of_its_values(speeds: list[float], scale: str) -> None:
    sweep = {"m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "e": {"fit": [0.1, 1.0]}}
    data = {"columns": {"v1": speeds, "e_out": [0.5, 0.51, 0.49, 0.5]}}
    fit = impact.calibrate({"models": "anagnostopoulos-1988", "sweep": sweep, "data": data}, overrides=QUICK)
    assert [axes.get_xscale() for axes in impact.plot(fit).axes] == [scale, scale]


def test_without_a_varied_input_the_values_are_over_their_number() -> None:
    sweep = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "e": {"fit": [0.1, 1.0]}}
    data = {"noise": "scale", "columns": {"e_out": [0.49, 0.5, 0.52]}}
    fit = impact.calibrate({"models": "anagnostopoulos-1988", "sweep": sweep, "data": data}, overrides=QUICK)
    values, residuals = impact.plot(fit).axes
    assert residuals.get_xlabel() == "Number of the measured value"
    (bars,) = values.containers
    assert bars.lines[0].get_xdata().tolist() == [1, 2, 3]
    assert {tick % 1.0 for tick in residuals.get_xticks()} == {0.0}
    # with noise "scale" and no sigma, the standard deviation is that of the values
    lengths = np.diff([segment[:, 1] for segment in bars.lines[2][0].get_segments()]).ravel()
    np.testing.assert_allclose(lengths, 2.0 * fit["measured"].values.std(ddof=1), rtol=1e-6)


def test_inputs_that_differ_between_the_values_are_no_conditions_of_the_picture() -> None:
    sweep = {"m1": 1.0, "K": 1e6, "n": 1.0, "e": {"fit": [0.1, 1.0]}}
    data = {"columns": {"v1": [1.0, 2.0, 3.0], "m2": [1.0, 2.0, 2.0], "v2": [0.5] * 3, "e_out": [0.49, 0.5, 0.52]}}
    fit = impact.calibrate({"models": "anagnostopoulos-1988", "sweep": sweep, "data": data}, overrides=QUICK)
    conditions = impact.plot(fit).header[1].get_text()
    assert "m_1" in conditions
    assert "v_2" in conditions
    assert not re.search("v_1|m_2", conditions)


@pytest.mark.slow
def test_the_table_of_a_picture_has_curves_residuals_and_measured_values(
    cli: Run, drops: xr.Dataset, tmp_path: Path
) -> None:
    impact.save(drops, tmp_path / "fit.h5")
    drawn = cli("plot", "fit.h5", "-o", "a.svg", "--data", "a.csv", "--json", cwd=tmp_path)
    (values, _) = json.loads(drawn.stdout)["calibration"]["measured"]
    assert values["columns"]["e_out"] == drops["measured"].values.tolist()
    table = pd.read_csv(tmp_path / "a.csv")
    for law in drops["model"].values:
        curve = drops.sel(model=law, output_name="e_out")["curve"]
        np.testing.assert_array_equal(table[f"v1 {law} [m/s]"].dropna(), drops["grid"])
        np.testing.assert_array_equal(table[f"e_out {law}"].dropna(), curve)
        np.testing.assert_array_equal(table[f"v1 e_out_residual {law} [m/s]"].dropna(), drops["v1"])
        assert table[f"e_out_residual {law}"].count() == drops.sizes["point"]
    np.testing.assert_array_equal(table["v1 e_out measured [m/s]"].dropna(), drops["v1"])
    np.testing.assert_array_equal(table["e_out measured"].dropna(), drops["measured"])
    np.testing.assert_array_equal(table["sigma e_out measured"].dropna(), drops["sigma"])
    cli("plot", "fit.h5", "-o", "b.svg", "--data", "b.csv", "--data-form", "long", cwd=tmp_path)
    rows = pd.read_csv(tmp_path / "b.csv")
    measured = rows[rows["curve"] == "Measured"]
    np.testing.assert_array_equal(measured["y"], drops["measured"])
    # a number in the wide table for each row of the long one
    assert len(rows) == sum(table[name].count() for name in table if not name.startswith("v1 "))


def test_the_differences_of_two_calibrations_are_drawn(cli: Run, drops: xr.Dataset, tmp_path: Path) -> None:
    for name, factor in (("old.h5", 1.0), ("new.h5", 1.01)):
        impact.save(drops.assign(estimate=factor * drops["estimate"]), tmp_path / name)
    done = cli("compare", "new.h5", "old.h5", "--plot", "differences.png", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (1, "differences.png: where the differences lie\n")
    assert (tmp_path / "differences.png").exists()
    # the covariance is symmetric, and has one panel
    along = impact.compare(tmp_path / "new.h5", tmp_path / "old.h5").worst_along
    assert "parameter" in along
    assert "other_parameter" not in along


def test_models_chooses_the_laws(drops: xr.Dataset) -> None:
    figure = impact.plot(drops, models=["hunt-crossley-1975"])
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert not any("Kuwabara" in name for name in names)
    with pytest.raises(UsageError, match="did you mean"):
        impact.plot(drops, models=["hunt-crossley"])


@pytest.mark.parametrize("kind", ["error", "map", "loop"])
def test_a_calibration_has_one_kind_of_picture(drops: xr.Dataset, kind: str) -> None:
    with pytest.raises(UsageError, match="has the kind calibration"):
        impact.plot(drops, kind=kind)
    with pytest.raises(UsageError, match="impact calibrate writes those"):
        impact.plot(
            impact.sweep(ROOT / "configs" / "figure6.toml", overrides=["sweep.e=[0.5]"]), kind="calibration"
        )


@pytest.mark.slow
def test_a_report_shows_the_picture(drops: xr.Dataset) -> None:
    page = impact.report(drops)
    assert "2 laws, 12 measured values, noise given" in page
    assert "Failed points" not in page
    assert "at_bound" in page
    assert "Measured values, the laws that fit them" in page
    assert page.count("<img") == 1


@pytest.mark.parametrize(("loss", "has_p"), [("linear", True), ("huber", False)])
def test_a_report_has_a_column_of_p_where_a_law_has_one(loss: str, has_p: bool) -> None:
    changes = ['models=["hunt-crossley-1975"]', f'data.loss="{loss}"', *QUICK]
    page = impact.report(impact.calibrate(FOLDER / "drops.toml", overrides=changes))
    headings = {name: "number" in kind for kind, name in re.findall(r"<th([^>]*)>([^<]*)</th>", page)}
    assert "p" in headings if has_p else "p" not in headings
    # numbers are aligned, words are not
    assert [headings[name] for name in ("AICc", "weight", "loo", "status")] == [True, True, True, False]


@pytest.mark.slow
def test_commands_that_take_a_sweep_refuse_a_calibration_in_one_line(
    cli: Run, drops: xr.Dataset, tmp_path: Path
) -> None:
    impact.save(drops, tmp_path / "fit.h5")
    for words in (
        ("recommend", "fit.h5"),
        ("expand", "fit.h5", "-o", "full.h5"),
        ("bless", "fit.h5", "baseline.h5", "--reason", "first"),
        ("extend", "fit.h5", "--set", "sweep.m1=1"),
    ):
        done = cli(*words, cwd=tmp_path)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), (words, done.stderr)
        assert "this is a calibration, expected the result of a sweep" in done.stderr
    shown = cli("info", "fit.h5", cwd=tmp_path)
    assert re.search(r"^points +12 *$", shown.stdout, re.MULTILINE)
    assert cli("plot", "fit.h5", cwd=tmp_path).returncode == 0


def test_a_damaged_calibration_is_refused_in_one_line(drops: xr.Dataset, tmp_path: Path) -> None:
    damaged = {
        "estimate: got parameter, model": drops.assign(estimate=drops["estimate"].transpose()),
        "lower: got none": drops.drop_vars("lower"),
        "fit_status: got float64": drops.assign(fit_status=drops["fit_status"].astype(float)),
        "no outcome of a fit": drops.assign(fit_status=drops["fit_status"] + np.int8(9)),
        "noise": drops.assign_attrs(noise=3),
        "fit_paths: expected a config path for each parameter": drops.assign_attrs(fit_paths="[]"),
        "measured: expected a coordinate along point": drops.drop_vars("measured"),
    }
    for number, (message, dataset) in enumerate(damaged.items()):
        with pytest.raises(UsageError, match=message) as refused:
            impact.save(dataset, tmp_path / f"{number}.h5")
        assert "\n" not in str(refused.value)
