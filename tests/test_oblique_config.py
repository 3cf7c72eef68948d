"""Configs of oblique impacts: what each mistake is told, units, defaults and axes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impact
from impact.config.load import Config, read_config
from impact.errors import ConfigError

HEAD = (
    'models = "tsuji-1992"\nfrictions = "coulomb-1785"\n[sweep]\n'
    "e = 0.8\nm1 = 0.057\nR1 = 0.033\nm2 = inf\nK = 1e6\n"
)
MINDLIN = HEAD.replace("coulomb-1785", "lammps-mindlin")


def config(**sweep: Any) -> Config:
    """A valid config of one oblique impact with some values replaced; None removes one."""
    values = {
        "e": 0.8,
        "m1": 0.057,
        "R1": 0.033,
        "m2": math.inf,
        "K": 1e6,
        "v1": 2.0,
        "u1": 1.0,
        "mu": 0.3,
    } | sweep
    given = {name: value for name, value in values.items() if value is not None}
    return read_config({"models": "tsuji-1992", "frictions": "coulomb-1785", "sweep": given})


@pytest.mark.parametrize(
    ("text", "problems"),
    [
        (HEAD + "v1 = 2\nmu = 0.3\nangle = 30", ['x.toml:11: sweep.angle: got 30 rad; did you mean "30 deg"?']),
        (HEAD + "v1 = 2\nmu = 0.3\nangle = [10, 20]", [
            'x.toml:11: sweep.angle[0]: got 10 rad; did you mean "10 deg"?',
            'x.toml:11: sweep.angle[1]: got 20 rad; did you mean "20 deg"?',
        ]),
        (HEAD + "v1 = 2\nmu = 0.3\nangle = { linspace = [1, 85, 85] }",
         ['x.toml:11: sweep.angle.linspace[1]: got 85 rad; did you mean "85 deg"?']),
        (HEAD + 'v1 = 2\nmu = 0.3\nangle = "90 deg"',
         ['x.toml:11: sweep.angle: got "90 deg", expected an angle from 0 to below 90 deg']),
        (HEAD + 'v1 = 2\nspeed = 3\nmu = 0.3\nangle = "30 deg"',
         ["x.toml:9: sweep.v1: set together with speed, expected one of the two"]),
        (HEAD + "speed = 3\nmu = 0.3",
         ["x.toml:3: sweep.angle: missing, expected an angle from 0 to below 90 deg: angle of the impact from the "
          "normal; or v1 and u1 in place of speed"]),
        (HEAD + 'speed = 3\nmu = 0.3\nangle = "30 deg"\nu1 = 2',
         ["x.toml:12: sweep.u1: set together with angle, expected one of the two"]),
        (HEAD + 'speed = 3\nmu = 0.3\nangle = "30 deg"\nu2 = 2',
         ["x.toml:12: sweep.u2: set together with speed, expected one of the two"]),
        (HEAD + "v1 = 2\nu1 = 2\nmu = inf", ["x.toml:11: sweep.mu: got inf, expected a number >= 0"]),
        (HEAD + "v1 = 2\nu1 = 2\nmu = nan", ["x.toml:11: sweep.mu: got nan, expected a number >= 0"]),
        (HEAD + "v1 = 2\nu1 = 2\nmu = -0.1", ["x.toml:11: sweep.mu: got -0.1, expected a number >= 0"]),
        (HEAD + "v1 = 2\nu1 = 2",
         ["x.toml:3: sweep.mu: missing, expected a number >= 0: coefficient of friction"]),
        (HEAD + "v1 = 2\nu1 = 2\nmu = 0.3\nomega2 = 10",
         ["x.toml:12: sweep.omega2: got the spin of a wall, which does not turn, expected none"]),
        (HEAD.replace("m2 = inf", "m2 = 1\nR2 = inf") + "v1 = 2\nu1 = 2\nmu = 0.3\nomega2 = 10",
         ["x.toml:13: sweep.omega2: got the spin of a plane, which does not turn, expected none"]),
        (HEAD.replace("R1 = 0.033\n", "") + "v1 = 2\nu1 = 2\nmu = 0.3\nomega1 = 10",
         ["x.toml:3: sweep.R1: missing, expected a number > 0 m, or inf: radius of ball 1, which its spin needs; "
          "or a material with rho"]),
        (HEAD.replace("m2 = inf", "m2 = [1, inf]\nR2 = 1") + "v1 = 2\nu1 = 2\nmu = 0.3\nomega2 = 10",
         ["x.toml:13: sweep.omega2: got the spin of a wall, which does not turn, expected none"]),
        (HEAD.replace("m2 = inf", "m2 = [1, inf]\nR2 = 1")
         + 'v1 = 2\nu1 = 2\nmu = 0.3\nomega2 = [0, 10]\nzip = [["m2", "omega2"]]',
         ["x.toml:13: sweep.omega2: got the spin of a wall, which does not turn, expected none"]),
        (HEAD.replace("m2 = inf\n", "") + "v1 = 2\nu1 = 2\nmu = 0.3\ncases = { m2 = [1, inf], omega2 = [0, 10] }",
         ["x.toml:11: sweep.cases.omega2: got the spin of a wall, which does not turn, expected none"]),
        (HEAD + "v1 = 2\nu1 = 2\nmu = 0.3\n[friction.lammps-mindlin]\nxt = 0",
         ["x.toml:12: friction.lammps-mindlin: set for a friction law that is not among frictions, expected it "
          "there as well"]),
        (HEAD + 'v1 = 2\nmu = 0.3\nangle = "30 rad"',
         ['x.toml:11: sweep.angle: got 30 rad; did you mean "30 deg"?']),
        (HEAD + "v1 = 2\nmu = 0.3\nangle = 90",
         ["x.toml:11: sweep.angle: got 90 rad, expected an angle from 0 to below 90 deg"]),
        (HEAD + 'v1 = 2\nmu = 0.3\nangle = { arange = ["0 deg", "95 deg", "10 deg"] }',
         ["x.toml:11: sweep.angle.arange: got a value 1.5707963267949 rad, expected an angle from 0 to below 90 "
          "deg"]),
        (HEAD + "v1 = 2\nmu = 0.3\nangle = { arange = [0, 90, 10] }",
         ['x.toml:11: sweep.angle.arange: got a value 80 rad; did you mean "80 deg"?']),
        (HEAD + 'v1 = 2\nmu = 0.3\nangle = "30 %"',
         ['x.toml:11: sweep.angle: got "30 %", expected a unit of rad, such as "1 rad"']),
        (HEAD + 'v1 = 2\nu1 = 2\nmu = "17 deg"', ['x.toml:11: sweep.mu: got "17 deg", expected a bare number']),
        (HEAD + 'v1 = 2\nu1 = 2\nmu = 0.3\nomega1 = "10 1/s"',
         ['x.toml:12: sweep.omega1: got "10 1/s", expected a unit of rad/s, such as "1 rad/s"; 1/s may be turns '
          "or radians per second"]),
        (HEAD + "v1 = 2\nu1 = 2\nfriction = 0.3",
         ["x.toml:3: sweep.mu: missing, expected a number >= 0: coefficient of friction",
          'x.toml:11: sweep.friction: unknown key; did you mean "mu"?']),
        (HEAD + 'v1 = 2\nmu = 0.3\n[design]\nn = 8\n[sweep.angle]\nnormal = ["80 deg", "10 deg"]',
         ["x.toml:13: sweep.angle: got 1 of 8 samples such as 1.5980409300203702, expected a distribution whose "
          "values are each an angle from 0 to below 90 deg"]),
        (HEAD + 'v1 = 2\nu1 = 2\nmu = 0.3\n[friction.coulomb-1785]\nlimit = ["abs", "abs"]',
         ['x.toml:13: friction.coulomb-1785.limit[1]: got "abs" twice, expected each value once']),
        (HEAD + 'v1 = 2\nu1 = 2\nmu = 0.3\n[friction.coulomb-1785]\nlimit = ["abs", 1]',
         ['x.toml:13: friction.coulomb-1785.limit[1]: got 1, expected "abs" or "positive"']),
        (HEAD + 'v1 = 2\nu1 = 2\nmu = 0.3\n[solver]\nintegrator = "kickdrift"',
         ['x.toml:13: solver.integrator: got "kickdrift", expected an integrator; did you mean "kick-drift"?']),
        (HEAD.replace("e = 0.8\n", "").replace("tsuji-1992", "hertz").replace("coulomb-1785", "yade-mindlin")
         + "v1 = 2\nu1 = 2\nmu = 0.3\n[friction.yade-mindlin]\nkt_over_kn = 0.8",
         ["x.toml:3: sweep.e: missing, expected e or alpha (used by yade-mindlin), or other frictions"]),
        (HEAD.replace("coulomb-1785", "cundall-strack-1979") + "v1 = 2\nu1 = 2\nmu = 0.3",
         ["x.toml:2: friction.cundall-strack-1979.k_t: missing, expected a stiffness [N/m], such as 1e6; or "
          "kt_over_kn"]),
        (HEAD.replace('frictions = "coulomb-1785"\n', "") + "v1 = 2\n[friction.coulomb-1785]\nlimit = \"abs\"",
         ["x.toml:9: friction.coulomb-1785: set without a friction law, expected frictions as well, such as "
          'frictions = ["coulomb-1785"]']),
        (HEAD.replace('"coulomb-1785"', "[]") + "v1 = 2\nu1 = 2\nmu = 0.3",
         ['x.toml:2: frictions: got an empty list, expected a friction law, or a list of friction laws; "all" are '
          "all but those of one scheme"]),
        (HEAD + 'v1 = 2\nu1 = 2\nmu = 0.3\nomega1 = "10 Hz"',
         ['x.toml:12: sweep.omega1: got "10 Hz", expected a unit of rad/s, such as "1 rad/s"; 1/s may be turns or '
          "radians per second"]),
        (HEAD + 'v1 = 2\nu1 = 2\nmu = 0.3\n[friction.coulomb-1785]\nlimit = "pos"',
         ['x.toml:13: friction.coulomb-1785.limit: got "pos", expected "abs" or "positive"']),
        (HEAD + "v1 = 2\nu1 = 2\nmu = 0.3\n[friction.coulomb-1785]\nxt = 1",
         ["x.toml:13: friction.coulomb-1785.xt: unknown key; known: limit"]),
        (HEAD + "v1 = 2\nu1 = 2\nmu = 0.3\n[friction.coulmb-1785]\nxt = 1",
         ['x.toml:12: friction.coulmb-1785: unknown key; did you mean "coulomb-1785"?']),
        (HEAD + "v1 = 2\nu1 = 2\nmu = 0.3\ninertia_factor1 = 0",
         ["x.toml:12: sweep.inertia_factor1: got 0, expected a number > 0, or inf"]),
        (HEAD.replace("coulomb-1785", "drake-regularized") + "v1 = 2\nu1 = 2\nmu = 0.3\nsteps_per_contact = 12\n"
         '[solver]\nintegrator = "kick-drift"',
         ['x.toml:14: solver.integrator: scheme "kick-drift" does not take the friction law drake-regularized, '
          "expected coulomb-1785 or one with a spring or a dashpot, such as cundall-strack-1979"]),
        (HEAD.replace('frictions = "coulomb-1785"\n', "") + "v1 = 2\nu1 = 2\nmu = 0.3",
         [f"x.toml:{line}: sweep.{name}: set without a friction law, expected frictions as well, such as "
          'frictions = ["coulomb-1785"]' for line, name in ((9, "u1"), (10, "mu"))]),
        (HEAD.replace('frictions = "coulomb-1785"\n', "") + 'v1 = 2\n[output]\nvariables = ["beta"]',
         ['x.toml:10: output.variables[0]: got "beta", which needs frictions = [...]']),
        (HEAD.replace("coulomb", "coloumb") + "v1 = 2\nu1 = 2\nmu = 0.3",
         ['x.toml:2: frictions: got "coloumb-1785", expected a friction law; did you mean "coulomb-1785"?']),
        (HEAD.replace('"coulomb-1785"', '"hertz"') + "v1 = 2\nu1 = 2\nmu = 0.3",
         ['x.toml:2: frictions: got "hertz", expected a friction law; it is a model, of the key models']),
        (HEAD.replace("tsuji-1992", "coulomb-1785") + "v1 = 2\nu1 = 2\nmu = 0.3",
         ['x.toml:1: models: got "coulomb-1785", expected a model; it is a friction law, of the key frictions']),
        (MINDLIN + "v1 = 2\nu1 = 2\nmu = 0.3",
         ["x.toml:2: friction.lammps-mindlin.k_t: missing, expected k_t or kt_over_kn: K is set, so that 8 G* a "
          "may not belong to it"]),
        (MINDLIN + "v1 = 2\nu1 = 2\nmu = 0.3\n[friction.lammps-mindlin]\nk_t = 1e6\nkt_over_kn = 0.8",
         ["x.toml:13: friction.lammps-mindlin.k_t: set together with kt_over_kn, expected one of the two"]),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_with_its_place(tmp_path: Path, text: str, problems: list[str]) -> None:
    path = tmp_path / "x.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as error:
        read_config(path)
    assert [problem.removeprefix(f"{tmp_path}/") for problem in error.value.problems] == problems


def test_a_config_without_a_pair_that_can_be_combined_is_refused() -> None:
    sweep = {"e": 0.8, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "v1": 2.0, "u1": 1.0, "mu": 0.3}
    refused = {"models": "bilinear", "frictions": "lammps-linear-nohistory", "sweep": sweep}
    with pytest.raises(ConfigError, match=r"bilinear with lammps-linear-nohistory: .* no dashpot"):
        impact.sweep(refused)
    both = impact.sweep(refused | {"frictions": ["lammps-linear-nohistory", "coulomb-1785"]})
    assert both["friction_status"].values.tolist() == [[18, 1]]


@pytest.mark.parametrize(
    ("columns", "line", "problem"),
    [
        ("omega1 = [0, 3]\nu1 = [1, 2]", 3,
         "sweep.R1: missing, expected a number > 0 m, or inf: radius of ball 1, which its spin needs; or a "
         "material with rho"),
        ("u1 = [1, 2]\nomega2 = [0, 3]", 12,
         "data.columns.omega2: got the spin of a wall, which does not turn, expected none"),
        ("angle = [0.1, 30]", 11, 'data.columns.angle[1]: got 30 rad; did you mean "30 deg"?'),
        ('u1 = [1, 2]\n"friction.coulomb-1785.limit" = [0, 1]', 12,
         'data.columns."friction.coulomb-1785.limit": got words, expected numbers; all points have one limit'),
        ("angle = [0.1, 0.2]\nu1 = [1, 2]", 12,
         "data.columns.u1: set together with angle, expected one of the two"),
    ],
)  # fmt: skip
def test_measured_inputs_follow_the_rules_at_all_points(
    tmp_path: Path, columns: str, line: int, problem: str
) -> None:
    path = tmp_path / "x.toml"
    head = HEAD.replace("R1 = 0.033\n", "")
    path.write_text(f"{head}v1 = 2\n[data.columns]\nbeta = [0.1, 0.2]\n{columns}\n[sweep.mu]\nfit = [0.01, 1]\n")
    with pytest.raises(ConfigError) as error:
        read_config(path, purpose="calibrate")
    assert error.value.problems == (f"{path}:{line}: {problem}",)


def test_measured_columns_have_units_of_angles(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text(
        "angle [deg],omega1 [rpm],rebound_angle [deg],omega1_post [rev/s],sigma_rebound_angle,sigma_omega1_post\n"
        "10,30,12,40,1,2\n60,-60,50,80,1,3\n"
    )
    path = tmp_path / "x.toml"
    path.write_text(HEAD + 'v1 = 2\nmu = { fit = [0.01, 1] }\n[data]\nfile = "x.csv"\n')
    data = read_config(path, purpose="calibrate").data
    assert data is not None
    degree, turn = math.pi / 180.0, 2.0 * math.pi
    assert data.inputs["angle"] == pytest.approx((10.0 * degree, 60.0 * degree), rel=4e-16)
    assert data.inputs["omega1"] == pytest.approx((0.5 * turn, -turn), rel=4e-16)
    assert data.outputs["rebound_angle"] == pytest.approx((12.0 * degree, 50.0 * degree), rel=4e-16)
    assert data.sigma["omega1_post"] == pytest.approx((2.0 * turn, 3.0 * turn), rel=4e-16)


def test_cases_have_angles_with_units_and_words(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("angle [deg],friction.coulomb-1785.limit\n10,abs\n80,positive\n")
    path = tmp_path / "x.toml"
    path.write_text(HEAD + 'v1 = 2\nmu = 0.3\ncases = "x.csv"\n')
    result = impact.sweep(path)
    limit = result["friction.coulomb-1785.limit"]
    assert limit.values.tolist() == [0.0, 1.0]
    assert limit.attrs["long_name"].endswith("; 0 is abs, 1 is positive")
    table = {"angle": result["angle"].values.tolist(), "friction.coulomb-1785.limit": ["abs", "positive"]}
    sweep = {"e": 0.8, "m1": 0.057, "R1": 0.033, "m2": math.inf, "K": 1e6, "v1": 2.0, "mu": 0.3, "cases": table}
    again = impact.sweep({"models": "tsuji-1992", "frictions": "coulomb-1785", "sweep": sweep})
    assert np.array_equal(again["beta"].values, result["beta"].values)
    (tmp_path / "x.csv").write_text("angle [deg],friction.coulomb-1785.limit\n10,abs\n80,pos\n")
    with pytest.raises(ConfigError, match=r'x.csv:3: friction.coulomb-1785.limit: got "pos", expected "abs" or'):
        impact.sweep(path)


def test_a_wall_may_be_zipped_with_no_spin() -> None:
    sweep = {"m2": [1.0, math.inf], "omega2": [10.0, 0.0], "R2": 1.0, "zip": [["m2", "omega2"]]}
    assert config(**sweep).axes[0].columns == {"m2": (1.0, math.inf), "omega2": (10.0, 0.0)}
    assert config(omega2="0 rad/s").scalars["omega2"] == 0.0


def test_a_stiffness_of_one_model_does_not_forbid_that_of_materials_of_another() -> None:
    source = {
        "models": ["hertz", "bilinear"],
        "frictions": ["lammps-mindlin"],
        "sweep": {"e": 0.8, "R1": 0.01, "R2": 0.01, "material": "steel", "v1": 1.0, "u1": 1.0, "mu": 0.3},
        "model": {"bilinear": {"K": 1e6}},
    }
    result = impact.sweep(source)
    assert result["friction_status"].values.tolist() == [[1], [18]]


def test_a_setting_of_frictions_leaves_the_tables_of_other_laws() -> None:
    source = {
        "models": "hertz",
        "frictions": ["coulomb-1785", "cundall-strack-1979"],
        "sweep": {"e": 0.8, "m1": 1.0, "m2": 1.0, "K": 1e6, "v1": 2.0, "u1": 1.0, "mu": 0.3},
        "friction": {"cundall-strack-1979": {"k_t": [1e5, 1e6]}},
    }
    read = read_config(source, ["frictions=coulomb-1785"])
    assert [law.key for law in read.frictions] == ["coulomb-1785"]
    assert not read.axes


def test_a_restitution_of_the_speed_varies_with_speed_and_angle() -> None:
    sweep = {"e": None, "alpha": 0.05, "v1": None, "u1": None, "speed": [2.0, 3.0], "angle": ["0 deg", "60 deg"]}
    read = {name: value for name, value in {"m1": 1.0, "m2": 1.0, "K": 1e6, "mu": 0.3, **sweep}.items() if value}
    result = impact.sweep({"models": "hertz", "frictions": "coulomb-1785", "sweep": read})
    assert result["e"].dims == ("speed", "angle")
    assert result["e"].values == pytest.approx(np.array([[0.9, 0.95], [0.85, 0.925]]), rel=1e-12)


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("angle", "30 deg", math.pi / 6.0),
        ("angle", "0.5 rad", 0.5),
        ("omega1", "600 rpm", 20.0 * math.pi),
        ("omega1", "-90 deg/s", -0.5 * math.pi),
        ("omega1", "10 rev/s", 20.0 * math.pi),
        ("omega1", "-3 rev/min", -0.1 * math.pi),
        ("u1", "36 km/h", 10.0),
        ("mu", "30 %", 0.3),
    ],
)
def test_units_are_read_to_the_last_bits(name: str, text: str, value: float) -> None:
    scalars = config(**{"u1": None, name: text}).scalars
    assert scalars[name] == pytest.approx(value, rel=4e-16)


def test_defaults_are_those_of_a_solid_sphere_that_does_not_spin() -> None:
    scalars = config(u1=None).scalars
    assert {name: scalars[name] for name in ("u1", "u2", "omega1", "omega2")} == dict.fromkeys(
        ("u1", "u2", "omega1", "omega2"), 0.0
    )
    assert scalars["inertia_factor1"] == scalars["inertia_factor2"] == 0.4
    # with an angle u1 follows from it
    assert "u1" not in config(u1=None, angle="30 deg").scalars


def test_a_speed_and_an_angle_give_both_velocities() -> None:
    sweep = {"e": 1.0, "m1": 1.0, "m2": math.inf, "K": 1e6, "speed": 3.0, "angle": ["0 deg", "60 deg"], "mu": 0.0}
    result = impact.sweep({"models": "hertz", "frictions": "coulomb-1785", "sweep": sweep})
    assert result["v1"].values == pytest.approx([3.0, 1.5], rel=1e-15)
    assert result["u1_post"].values.ravel() == pytest.approx([0.0, 1.5 * math.sqrt(3.0)], rel=1e-15, abs=0.0)


@pytest.mark.slow
def test_parameters_of_friction_laws_are_axes_as_those_of_models_are() -> None:
    law = "cundall-strack-1979"
    sweep = {"e": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "v1": 1.0, "u1": 1.0, "mu": 0.3}
    source = {"models": "hertz", "frictions": ["coulomb-1785", law], "sweep": sweep}
    result = impact.sweep(source | {"friction": {law: {"kt_over_kn": [0.5, 0.8]}}})
    beta = result["beta"].sel(friction=law).values.ravel()
    assert beta[0] != beta[1]
    # the other law does not depend on it
    assert np.ptp(result["beta"].sel(friction="coulomb-1785").values) == 0.0
    for value, alone in zip((0.5, 0.8), beta, strict=True):
        single = impact.sweep(source | {"friction": {law: {"kt_over_kn": value}}})
        assert single["beta"].sel(friction=law).item() == alone


def test_words_of_a_friction_law_choose_as_their_numbers_do() -> None:
    sweep = {"e": 0.3, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "v1": 1.0, "u1": 9.0, "mu": 0.3}
    source = {
        "models": "kelvin-voigt",
        "model": {"kelvin-voigt": {"C": 300.0}},
        "frictions": "coulomb-1785",
        "sweep": sweep,
    }
    result = impact.sweep(source | {"friction": {"coulomb-1785": {"limit": ["abs", "positive"]}}})
    # what pulls counts for the limit by the size of the force alone
    ratio = result["impulse_ratio"].values.ravel()
    assert ratio[0] > 0.3 > 0.0
    assert ratio[1] < ratio[0]


def test_all_and_patterns_select_friction_laws_as_models() -> None:
    sweep = {"e": 0.8, "m1": 1.0, "m2": 1.0, "K": 1e6, "v1": 2.0, "u1": 1.0, "mu": 0.3}
    chosen = ["lammps-*", "!lammps-mindlin*"]
    parameters = {"lammps-linear-history": {"k_t": 1e6}}
    read = read_config({"models": "hertz", "frictions": chosen, "sweep": sweep, "friction": parameters})
    assert [friction.key for friction in read.frictions] == ["lammps-linear-history", "lammps-linear-nohistory"]
