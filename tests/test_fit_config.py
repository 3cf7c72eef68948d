"""A calibration reads measurements and parameters to fit, or refuses them with file, line and key in one line each."""
# ruff: noqa: E501 (messages are kept whole, so that they can be searched for)

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import impact
from impact.config.load import Config, parse_config, read_config
from impact.config.measurements import MEASURED_OUTPUTS, Measurements, fitted_parameters
from impact.engine.plan import Plan
from impact.engine.plugins import Plugins
from impact.errors import ConfigError
from impact.results.provenance import stored_config
from impact.results.schema import SCHEMA, dataset_template, plain_unit

TEXT = """\
models = ["lankarani-nikravesh-1990", "kuwabara-kono-1987"]
[data]
file = "drops.csv"
[sweep]
m1 = "2.7 g"
m2 = inf
R1 = "5 mm"
material1 = "nylon"
material2 = "steel"
e = { fit = [0, 1] }
[model.kuwabara-kono-1987]
A = { fit = ["0.1 us", "1e-2 s"] }
"""
CSV = "v1 [mm/s], e_out, sigma\n1000,0.8,0.01\n\n2000,0.7,0.02\n"
WITHOUT_SIGMA = "v1 [m/s],e_out\n1,0.8\n2,0.7\n"
TAKES = "use impact calibrate, which takes [data] and { fit = [least, most] }"


def calibration(folder: Path, text: str = TEXT, csv: str = CSV, *overrides: str) -> Config:
    (folder / "fit.toml").write_text(text)
    (folder / "drops.csv").write_text(csv)
    return read_config(folder / "fit.toml", overrides, purpose="calibrate")


def refused(folder: Path, text: str = TEXT, csv: str = CSV, *overrides: str) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        calibration(folder, text, csv, *overrides)
    lines = [line.replace(f"{folder}/", "") for line in caught.value.problems]
    assert not any("\n" in line for line in lines)
    return lines


def measurements(config: Config) -> Measurements:
    assert config.data is not None
    return config.data


def with_data(lines: str) -> str:
    return TEXT.replace("[sweep]", f"{lines}\n[sweep]")


def test_measurements_and_bounds_are_read_in_si(tmp_path: Path) -> None:
    config = calibration(tmp_path)
    assert config.fits == {"e": (0.0, 1.0), "kuwabara-kono-1987.A": (1e-7, 1e-2)}
    assert config.data == Measurements(
        file="drops.csv",
        lines=(2, 4),
        inputs={"v1": (1.0, 2.0)},
        outputs={"e_out": (0.8, 0.7)},
        sigma={"e_out": (0.01, 0.02)},
        noise="given",
    )
    assert config.axes == ()


def test_a_parameter_to_fit_is_a_scalar_between_its_bounds_so_that_a_plan_can_be_made(tmp_path: Path) -> None:
    config = calibration(tmp_path)
    assert config.scalars["e"] == 0.5
    assert config.scalars["kuwabara-kono-1987.A"] == pytest.approx(math.sqrt(1e-7 * 1e-2), rel=1e-15)
    assert config.scalars["v1"] == 1.0
    assert calibration(tmp_path, TEXT, CSV, "sweep.e.fit=[0.01, 0.99]").scalars["e"] == 0.5
    plan = Plan(config, Plugins())
    assert set(dataset_template(plan).sizes) == {"model"}


def test_properties_of_materials_are_fitted_or_measured(tmp_path: Path) -> None:
    nylon = '[materials.nylon]\nE = { fit = ["1 GPa", "5 GPa"] }\nnu = 0.39\n'
    csv = "v1 [m/s],materials.steel.E [GPa],contact_time [us]\n1,200,30\n2,210,20\n3,220,10\n"
    config = calibration(tmp_path, TEXT + nylon, csv)
    assert list(config.fits) == ["e", "materials.nylon.E", "kuwabara-kono-1987.A"]
    assert config.fits["materials.nylon.E"] == (1e9, 5e9)
    assert (config.scalars["materials.nylon.E"], config.scalars["materials.steel.E"]) == (3e9, 200e9)
    assert measurements(config).inputs["materials.steel.E"] == (200e9, 210e9, 220e9)
    assert measurements(config).outputs == {"contact_time": (30e-6, 20e-6, 10e-6)}
    assert math.isnan(config.materials["nylon"].E)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("{ fit = [1, 0] }", "e.fit: got 1 to 0, expected [least, most] with least < most"),
        ("{ fit = [0.5, 0.5] }", "e.fit: got 0.5 to 0.5, expected [least, most] with least < most"),
        ("{ fit = [0] }", "e.fit: got a list of 1, expected [least, most]"),
        ("{ fit = [0, 0.5, 1] }", "e.fit: got a list of 3, expected [least, most]"),
        ("{ fit = 1 }", "e.fit: got 1, expected [least, most]"),
        ("{ fit = [0, 2] }", "e.fit[1]: got 2, expected a number from 0 to 1"),
        ('{ fit = [0, "1 m"] }', 'e.fit[1]: got "1 m", expected a bare number'),
        ("{ fit = [0, nan] }", "e.fit[1]: got nan, expected a number from 0 to 1"),
        ("{ fit = [0, 1], step = 2 }", "e.step: unknown key; known: fit"),
        ("{ fitt = [0, 1] }", 'e.fitt: unknown key; did you mean "fit"?'),
        ("[0.5, 0.6]", "e: got an axis, expected a single value, a column of [data] or { fit = [least, most] }"),
        ("{ linspace = [0, 1, 3] }", "e: got an axis, expected a single value, a column of [data] or { fit = [least, most] }"),
    ],
)  # fmt: skip
def test_bounds_are_refused_with_file_line_and_key(tmp_path: Path, value: str, message: str) -> None:
    assert refused(tmp_path, TEXT.replace("{ fit = [0, 1] }", value))[0] == f"fit.toml:10: sweep.{message}"


def test_bounds_are_finite_and_have_the_dimension_of_their_parameter(tmp_path: Path) -> None:
    assert refused(tmp_path, TEXT.replace("m2 = inf", "m2 = { fit = [1, inf] }")) == [
        "fit.toml:6: sweep.m2.fit[1]: got inf, expected a number > 0 kg"
    ]
    assert refused(tmp_path, TEXT.replace('"1e-2 s"', '"1 kg"')) == [
        'fit.toml:12: model.kuwabara-kono-1987.A.fit[1]: got "1 kg", expected a unit of s, such as "1 s"'
    ]


def test_a_material_cannot_be_fitted(tmp_path: Path) -> None:
    assert refused(tmp_path, TEXT.replace('"nylon"', '{ fit = ["nylon", "steel"] }')) == [
        "fit.toml:8: sweep.material1: got a table, expected the name of a material of [materials]"
    ]


def test_n_and_k_are_fitted_together_as_bare_numbers(tmp_path: Path) -> None:
    both = TEXT.replace(', "kuwabara-kono-1987"', "").replace(
        "e = {", "n = { fit = [1, 2] }\nK = { fit = [1e5, 1e9] }\ne = {"
    )
    csv = "v1 [m/s],e_out\n1,0.5\n2,0.5\n3,0.5\n"
    assert calibration(tmp_path, both, csv).fits == {"n": (1.0, 2.0), "K": (1e5, 1e9), "e": (0.0, 1.0)}
    assert refused(tmp_path, both.replace("[1e5, 1e9]", '["1 N/m", 2]'), csv) == [
        'fit.toml:11: sweep.K.fit[0]: got "1 N/m", expected a bare number: its unit N/m^n depends on n, which varies'
    ]


@pytest.mark.parametrize(
    ("csv", "messages"),
    [
        ("v1,e_out\n1,0.5\n", ['1: v1: got no unit, expected one in brackets, such as "v1 [m/s]"']),
        ("v1 [m/s],contact_time\n1,0.5\n", ['1: contact_time: got no unit, expected one in brackets, such as "contact_time [s]"']),
        ("v1 [m],e_out\n1,0.5\n", ['1: v1: got [m], expected a unit of m/s, such as "1 m/s"']),
        ("v1 [m/s],e_out [%]\n1,50\n", ['1: e_out: got [%], expected a fraction: divide the column by 100 and write "e_out"']),
        ("v1 [m/s],e_out\n1,60%\n2,0.5\n", ['2: e_out: got "60%", expected a fraction, such as 0.6']),
        ("v1 [m/s],e_out\n1,1.2\n2,-0.1\n", ["2: e_out: got 1.2, expected a number from 0 to 1", "3: e_out: got -0.1, expected a number from 0 to 1"]),
        ("v1 [m/s],e_out,sigma\n1,0.5,0\n2,0.5,-1\n", ["2: sigma: got 0.0, expected a number > 0", "3: sigma: got -1.0, expected a number > 0"]),
        ("v1 [m/s],e_out\n1,\n", ["2: e_out: got nothing, expected a number from 0 to 1"]),
        ("v1 [m/s],e_out\n1,nan\ninf,0.5\n", ['3: v1: got "inf m/s", expected a finite number of m/s', "2: e_out: got nan, expected a number from 0 to 1"]),
        ("v1 [m/s],e_out\n1,0.5,3\n", ["2: got 3 values, expected 2, one for each column"]),
        ("v1 [m/s],e_oot\n1,0.5\n", ['1: e_oot: no such input or output; did you mean "e_out"?']),
        ("v1 [m/s],e_out,kuwabara-kono-1987.AA [s]\n1,0.5,1\n", ['1: kuwabara-kono-1987.AA: no such input; did you mean "kuwabara-kono-1987.A"?']),
        ("v1 [m/s],e_out,\n1,0.5,\n", ["1: got a column without a name, expected that of an input or an output"]),
        ("v1 [m/s]\n1\n", ["1: got no column of an output, expected one, such as e_out or contact_time"]),
        ("v1 [m/s],v1 [mm/s],e_out\n1,1,0.5\n", ['1: got "v1" twice, expected each column once']),
        ("v1 [m/s],e_out,sigma,sigma_e_out\n1,0.5,1,1\n", ['1: sigma_e_out: got a second column of e_out, beside "sigma", expected one']),
        ("v1 [m/s],m1 [g],e_out\n1,1,0.5\n", ["1: m1: set together with sweep.m1, expected one of the two"]),
        ("v1 [m/s],e,e_out\n1,1,0.5\n", ["1: e: set together with sweep.e, expected one of the two"]),
        ("v1 [m/s],material1,e_out\n1,steel,0.5\n", ["1: material1: got names of materials, expected numbers; all points have the materials of [sweep]"]),
        ("v1 [m/s],e_out,sigma_contact_time [s]\n1,0.5,1\n", ["1: sigma_contact_time: got no column contact_time, expected one beside its standard deviation"]),
        ("v1 [m/s],e_out,contact_time [s],sigma\n1,0.5,1,1\n", ["1: sigma: got 2 outputs, expected sigma_e_out or sigma_contact_time"]),
    ],
)  # fmt: skip
def test_columns_are_refused_with_file_and_line(tmp_path: Path, csv: str, messages: list[str]) -> None:
    assert refused(tmp_path, TEXT, csv) == [f"drops.csv:{message}" for message in messages]


def test_fewer_measured_values_than_parameters_are_refused_with_both_numbers(tmp_path: Path) -> None:
    text = TEXT.replace('R1 = "5 mm"', 'R1 = { fit = ["1 mm", "9 mm"] }')
    assert refused(tmp_path, text, "v1 [m/s],e_out\n1,0.5\n") == [
        "fit.toml:3: data.file: got 1 measured value, expected at least 2, the number of parameters to fit of lankarani-nikravesh-1990"
    ]
    # both values of a point count
    two = "v1 [m/s],e_out,contact_time [us],sigma_e_out,sigma_contact_time\n1,0.5,20,0.1,1\n"
    config = calibration(tmp_path, text, two)
    counts = [fitted_parameters(config.fits, model) for model in config.models]
    # kuwabara-kono-1987 does not take e
    assert counts == [("R1", "e"), ("R1", "kuwabara-kono-1987.A")]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("sigma = { fit = [0, 1] }", 'sigma: got a fit, expected noise = "scale", which estimates sigma, or "excess", which adds to it'),
        ("sigma = 0", "sigma: got 0, expected a number > 0 in the unit of the output, or a list of one for each point"),
        ("sigma = [0.1]", "sigma: got 1 values, expected 2, one for each point"),
        ('sigma = "5 %"', 'sigma: got "5 %", expected a fraction, such as 0.05'),
        ('sigma = "1 m"', 'sigma: got "1 m", expected a bare number'),
        ('sigma = ["0.1 m", 1]', 'sigma[0]: got "0.1 m", expected a bare number'),
        ('noise = "given"', 'noise: got "given" without standard deviations, expected a column sigma or the key sigma, or noise = "scale"'),
        ('noise = "excess"', 'noise: got "excess" without standard deviations, expected a column sigma or the key sigma, or noise = "scale"'),
        ('noise = "normal"', 'noise: got "normal", expected a kind of noise; known: excess, given, scale'),
        ("columns = { v1 = [1, 2], e_out = [0.5, 0.6] }", "columns: set together with file, expected one of the two"),
        ("weights = 1", "weights: unknown key; known: columns, file, lines, noise, sigma"),
    ],
)  # fmt: skip
def test_keys_of_data_are_refused_with_file_line_and_key(tmp_path: Path, line: str, message: str) -> None:
    assert refused(tmp_path, with_data(line), WITHOUT_SIGMA) == [f"fit.toml:4: data.{message}"]


def test_the_kind_of_noise_depends_on_the_standard_deviations(tmp_path: Path) -> None:
    def noise(line: str, csv: str) -> tuple[object, ...]:
        data = measurements(calibration(tmp_path, with_data(line), csv))
        return data.noise, data.sigma

    assert noise("", WITHOUT_SIGMA) == ("scale", {})
    assert noise("", CSV) == ("given", {"e_out": (0.01, 0.02)})
    assert noise('noise = "scale"', CSV) == ("scale", {"e_out": (0.01, 0.02)})
    assert noise("sigma = 0.1", WITHOUT_SIGMA) == ("given", {"e_out": (0.1, 0.1)})
    assert noise('noise = "excess"\nsigma = [0.1, 0.2]', WITHOUT_SIGMA) == ("excess", {"e_out": (0.1, 0.2)})
    forces = "v1 [m/s],peak_force [kN]\n1,2\n2,3\n"
    assert noise('sigma = "50 N"', forces) == ("given", {"peak_force": (50.0, 50.0)})
    assert refused(tmp_path, with_data("sigma = 0.1"), CSV) == [
        "fit.toml:4: data.sigma: set together with a column for e_out, expected one of the two"
    ]
    assert refused(tmp_path, TEXT, "v1 [m/s],e_out,contact_time [us],sigma_e_out\n1,0.5,4,0.1\n") == [
        "fit.toml:2: data: got no standard deviation of contact_time, expected a column sigma_contact_time: each of several outputs needs one"
    ]


def test_a_column_of_sigma_has_the_unit_of_its_output_or_its_own(tmp_path: Path) -> None:
    for unit, sigma in (("", 1e-6), (" [ns]", 1e-9)):
        csv = f"v1 [m/s],contact_time [us],sigma{unit}\n1,20,1\n2,20,1\n"
        assert measurements(calibration(tmp_path, TEXT, csv)).sigma == {"contact_time": (sigma, sigma)}


def test_values_may_be_in_the_config(tmp_path: Path) -> None:
    inline = TEXT.replace('file = "drops.csv"', 'columns = { v1 = ["5 mm/s", 2], e_out = [0.5, 0.6] }')
    data = measurements(calibration(tmp_path, inline))
    assert (data.file, data.lines, data.inputs) == ("", (1, 2), {"v1": (0.005, 2.0)})
    for old, new, message in (
        ("0.6]", '"60 %"]', 'data.columns.e_out[1]: got "60 %", expected a fraction, such as 0.6'),
        ("0.6]", "1.6]", "data.columns.e_out[1]: got 1.6, expected a number from 0 to 1"),
        ("0.6]", "0.6, 0.7]", "data.columns.e_out: got 3 values, expected 2, as in the first column"),
        (
            "e_out =",
            "m1 = [1, 2], e_out =",
            "data.columns.m1: set together with sweep.m1, expected one of the two",
        ),
        ("e_out =", "v_1 =", 'data.columns.v_1: no such input or output; did you mean "v1"?'),
    ):
        assert refused(tmp_path, inline.replace(old, new)) == [f"fit.toml:3: {message}"]


def test_a_calibration_needs_measurements_and_a_parameter_to_fit(tmp_path: Path) -> None:
    assert refused(
        tmp_path, TEXT.replace('[data]\nfile = "drops.csv"\n', "").replace("[sweep]", "[sweep]\nv1 = 1")
    ) == ['fit.toml: data: missing, expected a table [data] of measurements, such as file = "drops.csv"']
    fixed = TEXT.replace("{ fit = [0, 1] }", "0.5").replace('{ fit = ["0.1 us", "1e-2 s"] }', "1e-5")
    assert refused(tmp_path, fixed) == [
        "fit.toml:4: sweep: got no parameter to fit, expected at least one { fit = [least, most] }"
    ]
    # the parameter of a law that is not among the models is not fitted
    assert refused(tmp_path, TEXT.replace("{ fit = [0, 1] }", "0.5").replace(', "kuwabara-kono-1987"', "")) == [
        "fit.toml:12: model.kuwabara-kono-1987.A: got a fit, expected a value: no model and no ball of this config uses it"
    ]
    assert refused(tmp_path, with_data("noise = 3"), "v1,e_out\n1,1\n") == [
        "fit.toml:4: data.noise: got 3, expected the name of a kind of noise",
        'drops.csv:1: v1: got no unit, expected one in brackets, such as "v1 [m/s]"',
    ]


def test_a_missing_file_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "fit.toml").write_text(TEXT)
    with pytest.raises(ConfigError) as caught:
        read_config(tmp_path / "fit.toml", purpose="calibrate")
    assert list(caught.value.problems) == [f"{tmp_path}/drops.csv: cannot be read: No such file or directory"]


def test_every_other_reader_refuses_a_calibration_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "fit.toml").write_text(TEXT)
    only_fits = tmp_path / "fits.toml"
    only_fits.write_text(TEXT.replace('[data]\nfile = "drops.csv"\n', ""))
    for read in (read_config, impact.sweep, impact.run):
        with pytest.raises(ConfigError) as caught:
            read(tmp_path / "fit.toml")  # type: ignore[operator]
        assert list(caught.value.problems) == [
            f"{tmp_path}/fit.toml:2: data: got measurements, expected a sweep; {TAKES}"
        ]
    with pytest.raises(ConfigError) as caught:
        impact.sweep(only_fits)
    assert list(caught.value.problems) == [
        f"{only_fits}:8: sweep.e: got a fit, expected a value or an axis; {TAKES}"
    ]


@pytest.mark.parametrize("overrides", [(), ("data.noise=scale", "sweep.e.fit=[0.2, 0.9]")])
def test_a_stored_config_needs_no_file(tmp_path: Path, overrides: tuple[str, ...]) -> None:
    config = calibration(tmp_path, TEXT, CSV, *overrides)
    (tmp_path / "drops.csv").unlink()
    attributes = {"config": config.text, "config_set": json.dumps(config.overrides), "plugins": "{}"}
    assert stored_config(attributes, [], Plugins(), "fit.h5", purpose="calibrate") == config
    with pytest.raises(ConfigError, match="got measurements, expected a sweep"):
        stored_config(attributes, [], Plugins(), "fit.h5")
    with pytest.raises(ConfigError, match="not read; a stored config contains values"):
        parse_config(config.text, purpose="calibrate")


def test_a_mapping_is_read_like_a_file() -> None:
    config = read_config(
        {
            "models": "lankarani-nikravesh-1990",
            "data": {"columns": {"v1": [1.0, 2.0], "e_out": [0.5, 0.6], "sigma": [0.01, 0.01]}},
            "sweep": {"e": {"fit": [0, 1]}, "m1": 1, "m2": 1, "material": "steel"},
        },
        purpose="calibrate",
    )
    assert parse_config(config.text, config.overrides, purpose="calibrate") == config


def test_measured_outputs_have_the_units_of_results() -> None:
    units = {variable.name: plain_unit(variable.unit) for variable in SCHEMA if variable.dtype == "f8"}
    for name, quantity in MEASURED_OUTPUTS.items():
        assert quantity.unit == units[name]
        assert quantity.read(f"0.5 {quantity.unit}" if quantity.unit != "1" else 0.5) == 0.5
