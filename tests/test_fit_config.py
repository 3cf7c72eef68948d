"""The config of a calibration: parameters to fit and measured values, with one line for each problem."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from impact.config.load import parse_config, read_config
from impact.errors import ConfigError

from .conftest import Run, assert_refused

CONFIG = """
models = "kuwabara-kono-1987"
[data]
file = "drops.csv"
[sweep]
m1 = "2.7 g"
m2 = 1.0
K = 1e6
e = { fit = [0.05, 1] }
[model.kuwabara-kono-1987]
A = { fit = ["1 us", "1 ms"] }
"""
CSV = "v1 [m/s], e_out, sigma\n1, 0.5, 0.01\n200 , 0.4, 0.02\n3, 0.3, 0.03\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "fit.toml").write_text(CONFIG, encoding="utf-8")
    (tmp_path / "drops.csv").write_text(CSV, encoding="utf-8")
    return tmp_path


def test_bounds_and_measurements_are_read_in_si(folder: Path) -> None:
    config = read_config(folder / "fit.toml", purpose="calibrate")
    assert config.fits == {"e": (0.05, 1.0), "kuwabara-kono-1987.A": (1e-6, 1e-3)}
    assert config.data is not None
    assert (config.data.file, config.data.lines, config.data.noise) == ("drops.csv", (2, 3, 4), "given")
    assert config.data.inputs == {"v1": (1.0, 200.0, 3.0)}
    assert config.data.outputs == {"e_out": (0.5, 0.4, 0.3)}
    assert config.data.sigma == {"e_out": (0.01, 0.02, 0.03)}


def test_the_acceleration_of_gravity_is_that_of_heights_and_times(folder: Path) -> None:
    (folder / "fit.toml").write_text(CONFIG.replace("[data]", "[data]\ng = 1.62"), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"drops.csv:1: got data.g without heights and times of flight"):
        read_config(folder / "fit.toml", purpose="calibrate")


def test_units_of_columns_are_converted(folder: Path) -> None:
    text = "v1 [mm/s], contact_time [us], sigma_contact_time [ns]\n1000, 20, 5\n2000, 10, 5\n500, 30, 5\n"
    (folder / "drops.csv").write_text(text, encoding="utf-8")
    data = read_config(folder / "fit.toml", purpose="calibrate").data
    assert data is not None
    assert data.inputs == {"v1": (1.0, 2.0, 0.5)}
    assert data.outputs["contact_time"] == pytest.approx((2e-5, 1e-5, 3e-5))
    assert data.sigma["contact_time"] == pytest.approx((5e-9,) * 3)


def test_a_column_without_a_dimension_may_say_so(folder: Path) -> None:
    units = CSV.replace("e_out, sigma", "e_out [-], sigma [1]")
    (folder / "drops.csv").write_text(units, encoding="utf-8")
    data = read_config(folder / "fit.toml", purpose="calibrate").data
    assert data is not None
    assert (data.outputs, data.sigma) == ({"e_out": (0.5, 0.4, 0.3)}, {"e_out": (0.01, 0.02, 0.03)})


@pytest.mark.parametrize("unit", ["[1]", "(-)"])
def test_a_deviation_that_says_that_it_has_no_unit_is_not_in_that_of_its_column(folder: Path, unit: str) -> None:
    csv = f"v1 [m/s], e_out [%], sigma {unit}\n1, 50, 0.01\n2, 40, 0.02\n"
    (folder / "drops.csv").write_text(csv, encoding="utf-8")
    data = read_config(folder / "fit.toml", purpose="calibrate").data
    assert data is not None
    assert (data.outputs, data.sigma) == ({"e_out": (0.5, 0.4)}, {"e_out": (0.01, 0.02)})


def test_a_stored_config_needs_no_file(folder: Path) -> None:
    config = read_config(folder / "fit.toml", purpose="calibrate")
    (folder / "drops.csv").unlink()
    again = parse_config(config.text, config.overrides, purpose="calibrate")
    assert again.data is not None
    assert config.data is not None
    assert (again.fits, again.data.inputs, again.data.outputs) == (
        config.fits,
        config.data.inputs,
        config.data.outputs,
    )


def test_the_lines_of_rows_that_are_left_out_are_left_out() -> None:
    columns = {"v1": [1.0, 2.0, 3.0], "e_out": [0.5, "-", 0.7]}
    data = {"columns": columns, "lines": [2, 5, 9], "fit": True}
    source = {"models": "tsuji-1992", "data": data, "sweep": {"m1": 1.0, "m2": 1.0, "K": 1e6}}
    config = read_config(source, purpose="calibrate")
    assert config.data is not None
    assert (config.data.lines, config.data.inputs) == ((2, 9), {"v1": (1.0, 3.0)})


@pytest.mark.parametrize(
    ("csv", "message"),
    [
        ("v1, e_out\n1, 0.5\n", 'drops.csv:1: v1: got no unit, expected one in brackets, such as "v1 [m/s]"'),
        ("v1 [s], e_out\n1, 0.5\n", "drops.csv:1: v1: got [s], expected"),
        ("v1 [m/s], e_out [kg]\n1, 50\n", "drops.csv:1: e_out: got [kg], expected a bare number"),
        ("v1 [m/s], e_out\n1, 160%\n", 'drops.csv:2: e_out: got "160%", expected a number from -0.5 to 1.5'),
        (
            "v1 [m/s], e_out\n1, 0.5\n2, 60\n3, 55\n",
            'drops.csv:3: e_out: got "60", expected a fraction: percent? name the unit, as in "e_out [%]"',
        ),
        ("v1 [m/s], e_out\n1, -0.6\n", "drops.csv:2: e_out: got -0.6, expected a number from -0.5 to 1.5"),
        ("v1 [m/s], e_out\n1, nan\n", "drops.csv:2: e_out: got nothing, expected a value in each column"),
        ("v1 [m/s], e_out\n1,\n", "drops.csv:2: e_out: got nothing, expected a value in each column"),
        ("v1 [m/s], eout\n1, 0.5\n", 'drops.csv:1: eout: no such input or output; did you mean "e_out"?'),
        (
            "v1 [m/s], e_out, sigma\n1, 0.5, 0\n",
            "drops.csv:2: sigma: got 0.0, expected a number from 1e-30 to 1e+100",
        ),
        (
            "v1 [m/s], e_out, sigma\n1, 0.5, 1e-160\n",
            "drops.csv:2: sigma: got 1e-160, expected a number from 1e-30 to 1e+100",
        ),
        ("v1 [m/s], m1 [kg], e_out\n1, 1, 0.5\n", "drops.csv:1: m1: set together with sweep.m1"),
        (
            "v1 [m/s], peak_force [N]\n1, 1e308\n",
            'drops.csv:2: peak_force: got "1e308 N", expected a number > 0 and <= 1e+100',
        ),
        ("v1 [m/s]\n1\n", "no column of an output"),
        (
            "e_out, sigma, specimen\n0.5, 0.1,\n0.4, 0.1,\n",
            "drops.csv:2: specimen: got nothing, expected a value in each column",
        ),
        ("e_out, sigma, specimen\n0.5, 0.1, a\n0.4, 0.1, a\n", "data: got one specimen, expected at least two"),
        # not "scale", which takes no specimens
        (
            "e_out, specimen\n0.5, a\n0.4, b\n",
            "data: got a column specimen without standard deviations, expected a column sigma or the key sigma",
        ),
        ("v1 [m/s], e_out, specimn\n1, 0.5, a\n", 'specimn: no such input or output; did you mean "specimen"?'),
    ],
)
def test_a_wrong_table_is_refused_with_its_line(folder: Path, cli: Run, csv: str, message: str) -> None:
    (folder / "drops.csv").write_text(csv, encoding="utf-8")
    assert_refused(cli("calibrate", "fit.toml", cwd=folder), message)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[0.05, 1]", "[1, 0.05]", "sweep.e.fit"),
        ("[0.05, 1]", "[0.05, 1.5]", "sweep.e.fit"),
        ("[0.05, 1]", "[0.05]", "sweep.e.fit"),
        (
            '"1 us", "1 ms"',
            '"1e-200 s", "1e200 s"',
            "A.fit: got 1e-200 to 1e+200, expected bounds that are closer",
        ),
        ('"1 us"', '"1 kg"', "model.kuwabara-kono-1987.A.fit"),
        ('m1 = "2.7 g"', "m1 = [1.0, 2.0]", "sweep.m1: got an axis"),
        ('file = "drops.csv"', 'file = "drops.csv"\nnoise = "white"', "data.noise"),
        (
            'file = "drops.csv"',
            'file = "drops.csv"\nsigma = 1e-320',
            "data.sigma: got 1e-320, expected a number from 1e-30 to 1e+100",
        ),
        ('file = "drops.csv"', 'noise = "scale"', "data: got neither file nor columns"),
        (
            'file = "drops.csv"',
            'decimal = ","\ncolumns = { e_out = [0.4, 0.5, 0.6] }',
            "data.decimal: set without a file, whose form it is",
        ),
        ('file = "drops.csv"', 'file = "drops.csv"\nloss = "square"', "data.loss"),
        (
            "[model.kuwabara-kono-1987]",
            'steps_per_contact = 12\n[solver]\nintegrator = "kick-drift"\n[model.kuwabara-kono-1987]',
            'solver.integrator: got "kick-drift", expected "exact": measurements have no time step',
        ),
        ('file = "drops.csv"', 'file = "drops.csv"\nloss = "huber"\nnoise = "scale"', "data.loss"),
    ],
)
def test_a_wrong_config_is_refused_with_its_line(folder: Path, old: str, new: str, message: str) -> None:
    (folder / "fit.toml").write_text(CONFIG.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError) as refused:
        read_config(folder / "fit.toml", purpose="calibrate")
    assert all("fit.toml:" in line for line in refused.value.problems)
    assert any(message in line for line in refused.value.problems)


def test_fewer_points_than_parameters_are_refused_with_both_numbers() -> None:
    sweep = {"v1": 1.0, "m1": {"fit": [0.1, 1.0]}, "m2": 1.0, "K": 1e6, "n": 1.5, "e": {"fit": [0.1, 1.0]}}
    with pytest.raises(ConfigError, match=r"got 1 .*at least 2, the number of parameters"):
        read_config(
            {"models": "hunt-crossley-1975", "sweep": sweep, "data": {"columns": {"e_out": [0.5]}}},
            purpose="calibrate",
        )


def test_each_output_of_a_point_counts_and_an_e_that_the_friction_law_takes() -> None:
    fits = {"e": {"fit": [0.1, 1.0]}, "mu": {"fit": [0.05, 1.0]}}
    sweep = {"v1": 1.0, "angle": 0.5, "m1": 1.0, "m2": math.inf, "R1": 0.05, "material": "steel", **fits}
    pair = {"models": "hertz", "frictions": "yade-mindlin", "sweep": sweep}
    columns = {"beta": [0.2], "sigma_beta": [0.01]}
    with pytest.raises(ConfigError, match=r"got 1 .*at least 2, .* of hertz with yade-mindlin"):
        read_config({**pair, "data": {"columns": columns}}, purpose="calibrate")
    columns |= {"e_t": [0.9], "sigma_e_t": [0.01]}
    assert read_config({**pair, "data": {"columns": columns}}, purpose="calibrate").fits.keys() == fits.keys()


@pytest.mark.parametrize("change", [{"data": {"columns": {"e_out": [0.5]}}}, {}])
def test_a_sweep_refuses_what_only_a_calibration_takes(change: dict[str, Any]) -> None:
    sweep = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "e": {"fit": [0.1, 1.0]} if not change else 0.5}
    with pytest.raises(ConfigError, match="impact calibrate"):
        read_config({"models": "hunt-crossley-1975", "sweep": sweep, **change})
