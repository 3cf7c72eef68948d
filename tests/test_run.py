"""`impact run` shows radii, stiffnesses, impulses and works at any e, and the exponent of the law."""

from __future__ import annotations

import json
import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impact
from impact.contact.models import find
from impact.contact.output_formulas import collide
from impact.contact.status import Status
from impact.errors import UsageError

from .conftest import Run
from .problems import EACH_LAW, LAWS, table1_impacts, with_parameters
from .test_deduplicate import DASHPOT

RTOL = 1e-10
# Table 1: radius [m], stiffness [N/m^1.5], peak indentation [m]
RADIUS, STIFFNESS, PEAK = 0.0444843486, 6.118486349e9, 1.008542975e-4


# one law of each form
QUICK_LAWS = [key for key in EACH_LAW if isinstance(key, str)]


@pytest.mark.parametrize(
    "keys", [QUICK_LAWS, pytest.param(LAWS, marks=pytest.mark.slow)], ids=["one law of each form", "all laws"]
)
def test_the_three_restitutions_of_every_law_are_equal(keys: list[str]) -> None:
    e = np.array([0.2, 0.9])
    spreads_by_e = [dict[str, float](), dict[str, float]()]
    for key in keys:
        impacts = with_parameters(find(key), table1_impacts(find(key).exponent or 1.5, e=e), 0.5)
        outputs = collide(find(key), impacts, rtol=RTOL, max_steps=100_000)
        restitutions = np.array([outputs[name] for name in ("e_out", "e_kinetic", "e_energetic")])
        status = np.broadcast_to(outputs["status"], e.shape)
        for index in range(e.size):
            if status[index] in (Status.OK, Status.LIMIT):
                spreads_by_e[index][key] = np.ptp(restitutions[:, index])
    for spreads in spreads_by_e:
        assert len(spreads) > 0.9 * len(keys)
        assert max(spreads.values()) <= 10 * RTOL, max(spreads, key=lambda key: spreads[key])


# m = 1/2 kg, K = 1 MN/m and v0 = 2 m/s: zeta is the damping over critical damping
@pytest.mark.parametrize("zeta", [0.05, 0.5, 0.95])
def test_surfaces_separate_after_the_force_of_a_dashpot_vanishes(zeta: float) -> None:
    m, K = 0.5, 1e6
    omega, c = math.sqrt(K / m), 2.0 * zeta * math.sqrt(K * m)
    config = {
        "models": "dashpot",
        "sweep": {"v1": 2.0, "m1": 1.0, "m2": 1.0, "K": K, "n": 1.0},
        "model": {"dashpot": {"c": c}},
        "output": {"variables": ["e_out", "e_energetic", "contact_time", "separation_time"]},
    }
    result = impact.sweep(config, plugins=[DASHPOT])
    # the force of the damped sine vanishes at 2 acos(zeta), at the indentation 2 (zeta/omega) e v0 = (c/K) e v0
    phase, free = 2.0 * math.acos(zeta), math.sqrt(1.0 - zeta**2)
    e = math.exp(-zeta / free * phase)
    assert result["e_out"].item() == pytest.approx(e, rel=0, abs=1e-9)
    assert result["e_energetic"].item() == pytest.approx(e, rel=0, abs=1e-9)
    assert result["contact_time"].item() == pytest.approx(phase / (omega * free), rel=1e-8)
    assert result["separation_time"].item() == pytest.approx(phase / (omega * free) + c / K, rel=1e-8)


def test_the_remaining_indentation_of_an_overdamped_law_adds_to_the_separation_time() -> None:
    config = {"v1": 2.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0}
    collision = impact.run(
        {"models": "kelvin-voigt-no-tension", "sweep": config, "model": {"kelvin-voigt-no-tension": {"C": 3e3}}}
    )
    rest = collision.values["permanent_indentation"] / (collision.values["v2_post"] - collision.values["v1_post"])
    assert collision.values["separation_time"] == pytest.approx(collision.values["contact_time"] + rest, rel=1e-14)
    assert rest > 0.5 * collision.values["contact_time"]


def test_table_1_is_printed_in_groups_with_prefixes_and_meanings(cli: Run) -> None:
    lines = cli("run").stdout.splitlines()
    rows = [re.split(r"  +", line.strip()) for line in lines]
    values = {row[0]: row[1:] for row in rows}
    assert values["materials.table1.E"] == ["56 GPa", "Young's modulus"]
    assert values["R1"] == ["44.4843 mm", "radius of ball 1"]
    assert values["m"] == ["0.5 kg", "effective mass (17)"]
    assert values["stiffness"] == ["6.118 GN/m^1.5", "contact stiffness used"]
    assert values["peak_indentation"] == ["100.9 µm", "largest indentation"]
    assert values["tau_c"][0] == "0.5 N s"
    assert values["W_r"][0] == "-62.5 mJ"
    # inputs, what the law delivers, and how sure that is stand apart
    names = [row[0] for row in rows]
    inputs, outputs, checks = (names.index(heading) for heading in ("Inputs", "Outputs", "Checks"))
    assert inputs < names.index("R1") < outputs < names.index("e_out") < names.index("tau_c") < checks
    assert checks < names.index("energy_residual")
    # every output has a description, and what the law lacks has no line
    assert all(len(row) == 3 for row in rows[outputs + 1 : checks] if row[0])
    assert "damping_ratio" not in names
    assert json.loads(cli("run", "--json").stdout)["outputs"]["peak_indentation"] == pytest.approx(PEAK, rel=1e-9)


@pytest.mark.parametrize("key", ["lankarani-nikravesh-1994", "gharib-hurmuzlu-2012-energetic"])
def test_unloading_stiffness(key: str) -> None:
    derived = impact.run(model=key, at={"e": 0.4}).derived
    assert derived["K_r"] == pytest.approx(STIFFNESS / 0.4**3, rel=1e-8)
    assert math.isnan(derived["rebound_speed_bound"])
    assert impact.run(model=key, at={"e": 0.0}).derived["K_r"] == math.inf


def test_unloading_stiffness_of_a_force_that_jumps_at_the_peak() -> None:
    shot = impact.run(model="kelvin-voigt-hysteretic", at={"e": 0.4})
    assert shot.derived["K_r"] == pytest.approx(0.4 * shot.values["stiffness"], rel=1e-12)


@pytest.mark.parametrize("e", [0.1, 0.5, 1.0])
def test_the_rebound_is_slower_than_its_bound(e: float) -> None:
    collision = impact.run(model="gharib-hurmuzlu-2012", at={"e": e, "v1": 2.0})
    # with (28) the bound (26) is the requested rebound speed
    assert collision.derived["rebound_speed_bound"] == pytest.approx(e * 2.0, rel=1e-14)
    assert collision.values["v2_post"] - collision.values["v1_post"] < e * 2.0
    assert collision.damping == collision.values["lambda"] == pytest.approx(STIFFNESS / (e * 2.0), rel=1e-9)


def test_impulses_and_works_balance_momentum_and_energy() -> None:
    for key in ("hertz", "gharib-hurmuzlu-2012", "bilinear", "tsuji-1992"):
        collision = impact.run(model=key, at={"e": 0.3, "m2": 3.0, "v1": 2.0})
        derived, values, energy = collision.derived, collision.values, 0.5 * 0.75 * 2.0**2
        assert derived["tau_c"] == pytest.approx(0.75 * 2.0, rel=1e-8)
        assert derived["tau_c"] + derived["tau_r"] == pytest.approx(2.0 - values["v1_post"], rel=1e-8)
        assert derived["W_c"] == pytest.approx(energy, rel=1e-8)
        # the work of the integrator, energy_loss + energy_residual, is that of both phases
        work = values["energy_loss"] + values["energy_residual"] * energy
        assert derived["W_c"] + derived["W_r"] == pytest.approx(work, rel=0, abs=1e-8 * energy)
        assert collision.e_energetic**2 == pytest.approx(-derived["W_r"] / derived["W_c"], rel=1e-14)
        assert collision.e_kinetic == pytest.approx(derived["tau_r"] / derived["tau_c"], rel=1e-14)


def test_a_history_conserves_momentum_at_all_times() -> None:
    collision = impact.run(model="hunt-crossley-1975", at={"e": 0.6, "v1": 2.0, "v2": -1.0, "m1": 1.0, "m2": 3.0})
    history = collision.history
    assert history is not None
    t, delta, v, x1, x2, v1, v2 = (history[name].values for name in ("t", "delta", "v", "x1", "x2", "v1", "v2"))
    assert v1 + 3.0 * v2 == pytest.approx(np.full_like(t, -1.0), abs=1e-12)
    assert x1 + 3.0 * x2 == pytest.approx(-t, abs=1e-15)
    assert v1 - v2 == pytest.approx(v, abs=1e-12)
    assert x1 - x2 == pytest.approx(delta, abs=1e-15)
    assert (v1[-1], v2[-1]) == pytest.approx((collision.values["v1_post"], collision.values["v2_post"]), abs=1e-8)


def test_the_kinematic_restitution_is_relative_to_the_closing_speed() -> None:
    collision = impact.run(model="exact-hysteresis", at={"e": 0.6, "v1": 3.0, "v2": -1.0})
    assert collision.e_kinematic == pytest.approx(0.6, abs=1e-8)


def test_a_stiffness_at_the_exponent_of_the_law_is_that_of_all_laws_whatever_the_order() -> None:
    at = {"K": 1e6, "n": 1.0, "e": 0.5}
    for values in (at, dict(reversed(at.items()))):
        inputs = impact.run(model="bilinear", at=values).as_dict()["inputs"]
        assert ("K" in inputs, "bilinear.K" in inputs) == (True, False)


@pytest.mark.parametrize("key", ["exact-hysteresis", "gharib-hurmuzlu-2012", "lankarani-nikravesh-1994"])
def test_limits_of_restitutions_impulses_and_works_at_e_0(key: str) -> None:
    collision = impact.run(model=key, at={"e": 0.0})
    assert collision.status == Status.LIMIT
    assert (collision.e_kinematic, collision.e_kinetic, collision.e_energetic) == (0.0, 0.0, 0.0)
    assert [collision.derived[name] for name in ("tau_c", "tau_r", "W_c", "W_r")] == [0.5, 0.0, 0.25, 0.0]
    if key in ("exact-hysteresis", "gharib-hurmuzlu-2012"):
        assert collision.derived["rebound_speed_bound"] == 0.0


def test_rounding_is_printed_as_zero_and_stored_as_it_is() -> None:
    shot = impact.run(at={"e": 0.5})
    rows = {name: text.partition("  ")[0] for name, text in shot.rows().items()}
    for name, shown in (("v1_error", "0 m/s"), ("v2_error", "0 m/s"), ("e_error", "0")):
        assert 0.0 < abs(shot.as_dict()["outputs"][name]) < 1e-9
        assert rows[name] == shown
    # a velocity that is as small, but as large as the speed of the impact
    slow = impact.run(at={"e": 0.5, "v1": 1e-11})
    assert slow.rows()["v1_post"].startswith("2.5 pm/s")
    # accuracy follows the tolerance: the error of this law is larger
    assert not impact.run(model="gharib-hurmuzlu-2012").rows()["v1_error"].startswith("0 m/s")


def test_text_and_json_have_the_same_names(cli: Run) -> None:
    arguments = ("run", "--model", "gharib-hurmuzlu-2012", "--at", "e=0.2")
    text = cli(*arguments).stdout
    output = json.loads(cli(*arguments, "--json").stdout)
    shown = {line.partition(" ")[0] for line in text.splitlines()}
    numbers = {name for name, value in {**output["outputs"], **output["derived"]}.items() if value is not None}
    assert numbers - {"in_domain"} <= shown
    assert {"e_kinematic", "e_kinetic", "e_energetic", *output["inputs"]} <= shown
    assert output["materials"]["table1"] == {"E": 56e9, "nu": 0.3, "rho": 2712.0, "yield_strength": None}


def test_parameters_have_units(cli: Run) -> None:
    arguments = ("--set", "model.bordbar-hyppanen-2007.C=1e5")
    output = " ".join(cli("run", "--model", "bordbar-hyppanen-2007", *arguments).stdout.split())
    assert "bordbar-hyppanen-2007.C 100 kN s/m^1.65" in output
    arguments = ("--set", "model.adams-impact.c=1e5", "--set", "model.adams-impact.d=1e-5")
    output = " ".join(cli("run", "--model", "adams-impact", *arguments).stdout.split())
    assert "adams-impact.c 100 kN s/m " in output
    assert "adams-impact.d 10 µm " in output
    assert "n 1.5 " in output


@pytest.mark.parametrize("key", ["bilinear", "gharib-hurmuzlu-2012"])
def test_balls_that_do_not_collide_have_no_phases(cli: Run, key: str) -> None:
    derived = impact.run(model=key, at={"v1": -1.0}).derived
    assert derived["m"] == 0.5
    assert all(math.isnan(value) for name, value in derived.items() if name not in ("m1", "m2", "R1", "R2", "m"))
    process = cli("run", "--model", key, "--at", "v1=-1")
    assert process.returncode == 0, process.stderr
    assert not {"tau_c", "W_c", "K_r"} & {line.partition(" ")[0] for line in process.stdout.splitlines()}


# ---- exponents and parameters of a law


@pytest.mark.parametrize("key", ["bilinear", "ismail-stronge-2008"])
def test_a_linear_law_shows_its_exponent(cli: Run, key: str) -> None:
    collision = impact.run(model=key)
    assert collision.point["n"] == collision.exponent == 1.0
    assert json.loads(collision.history.attrs["inputs"])["n"] == 1.0  # type: ignore[union-attr]
    output_lines = [line.split()[:3] for line in cli("run", "--model", key).stdout.splitlines()]
    assert ["n", "1", "compliance"] in output_lines
    assert ["stiffness", "61.45", "MN/m"] in output_lines


def test_selecting_a_parameter_changes_only_the_loop_of_its_model() -> None:
    config = {
        "models": ["kelvin-voigt", "bilinear"],
        "sweep": {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0},
        "model": {"kelvin-voigt": {"C": [10.0, 200.0]}},
        "solver": {"rtol": 1e-4},
    }
    result = impact.sweep(config)

    def peaks(sel: dict[str, float]) -> list[float]:
        figure = impact.plot(result, kind="loop", sel=sel)
        return [max(line.get_ydata()) for line in figure.axes[0].lines if len(line.get_xdata()) > 2]

    first, second = peaks({}), peaks({"kelvin-voigt.C": 200.0})
    assert first[0] != second[0]
    assert first[1] == second[1]
    with pytest.raises(impact.ImpactError, match=r'no input "kelvin-voight\.C"'):
        impact.plot(result, kind="loop", sel={"kelvin-voight.C": 200.0})


# ---- e and alpha


def test_a_stiffness_that_a_law_replaces_keeps_the_exponent_of_the_others() -> None:
    """The K of the sweep is that of laws with another n than this one has."""
    settings = {"model.kelvin-voigt": {"K": 1e5, "C": 1.0}}
    result = impact.sweep(models=["kelvin-voigt", "hertz"], K=2e6, m1=1.0, m2=1.0, overrides=settings)
    rows = {key: impact.run(result, model=key).groups()["Inputs"] for key in ("kelvin-voigt", "hertz")}
    units = {key: {name: value for name, value, _ in row} for key, row in rows.items()}
    assert (units["kelvin-voigt"]["K"], units["kelvin-voigt"]["kelvin-voigt.K"]) == ("2 MN/m^n", "100 kN/m")
    assert units["hertz"]["K"] == "2 MN/m^1.5"


def test_the_inputs_of_the_first_law_are_not_those_of_the_others() -> None:
    sweep = {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "n": 1.0, "K": 1e6}
    models = ["anagnostopoulos-1988", "kelvin-voigt", "walton-braun-variable"]
    tables = {"kelvin-voigt": {"C": [1.0, 2.0]}, "walton-braun-variable": {"S": 1.0}}
    result = impact.run({"models": models, "sweep": sweep, "model": tables})
    assert (result.point.keys(), result.first) == (sweep.keys() | {"v2"}, ())


def test_alpha_replaces_e_and_e_replaces_alpha(cli: Run) -> None:
    process = cli("run", "--at", "alpha=0.3", "--at", "v1=2", "--json")
    assert process.returncode == 0, process.stderr
    output = json.loads(process.stdout)
    assert (output["inputs"]["alpha"], output["inputs"]["e"]) == (0.3, 0.4)
    sweep = {"alpha": [0.1, 0.2], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    collision = impact.run({"models": "bilinear", "sweep": {**sweep, "n": 1.0}}, at={"e": 0.7})
    assert "alpha" not in collision.point
    assert collision.values["e_out"] == pytest.approx(0.7, abs=1e-9)
    overridden = impact.run(model="bilinear", overrides=["sweep.e=0.9"], at={"alpha": 0.25})
    assert overridden.point["e"] == 0.75


def test_inputs_of_the_user_replace_those_of_table_1_and_not_each_other() -> None:
    inputs = impact.run(model="hertz", overrides=["sweep.m1=2.0", "sweep.R1=0.02"]).point
    assert (inputs["m1"], inputs["R1"]) == (2.0, 0.02)
    oblique = {"speed": 2.0, "angle": 0.5, "mu": 0.3, "R1": 0.05, "R2": 0.05}
    assert impact.run(model="hertz", friction="coulomb-1785", at=oblique).closing_speed == 2.0 * math.cos(0.5)


def test_alpha_replaces_the_e_of_a_stored_sweep(tmp_path: Path) -> None:
    config = {
        "models": "bilinear",
        "sweep": {"e": [0.2, 0.4], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9, "n": 1.0},
    }
    impact.save(impact.sweep(config, overrides=["sweep.e=0.5"]), tmp_path / "stored.h5")
    assert impact.run(tmp_path / "stored.h5", at={"alpha": 0.25}).point["e"] == 0.75


def test_alpha_beside_e_is_refused(cli: Run) -> None:
    process = cli("run", "--at", "alpha=0.3", "--at", "e=0.5")
    assert (process.returncode, process.stderr) == (2, "--at alpha: got alpha and e, expected one of the two\n")


CASES = """models = ["gharib-hurmuzlu-2012"]
[sweep]
cases = "cases.csv"
m1 = 1.0
m2 = 1.0
material = "steel"
[materials.steel]
E = [200e9, 210e9]
nu = 0.3
rho = 7850
[solver]
rtol = 1e-4
"""


@pytest.mark.slow
def test_at_selects_a_case_by_its_number_and_a_material_by_its_property(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(CASES, encoding="utf-8")
    (tmp_path / "cases.csv").write_text("e,v1\n0.5,1.0\n0.5,2.0\n0.9,2.0\n", encoding="utf-8")
    result = impact.sweep(tmp_path / "c.toml")
    impact.save(result, tmp_path / "r.h5")
    expected = result["e_out"].squeeze("model").sel({"case": 2, "materials.steel.E": 210e9}).item()
    for source in ("c.toml", "r.h5"):
        arguments = ["run", source, "--at", "case=2", "--at", "materials.steel.E=210e9", "--json"]
        output = json.loads(cli(*arguments, cwd=tmp_path).stdout)
        assert (output["inputs"]["e"], output["inputs"]["v1"], output["first_value_of"]) == (0.9, 2.0, [])
        assert output["materials"]["steel"]["E"] == 210e9
        assert output["outputs"]["e_out"] == expected
    # all values of a case select it as well
    assert impact.run(tmp_path / "r.h5", at={"e": 0.5, "v1": 2.0}).first == ("materials.steel.E",)
    for at, message in (
        ({"case": 3.0}, "case = 3.0: not on the zipped axis case; these values vary together"),
        ({"case": 1.0, "e": 0.9}, "case = 1.0, e = 0.9: not on the zipped axis case"),
        ({"materials.steel.E": -1.0}, 'at["materials.steel.E"]: materials.steel.E: got -1.0, expected'),
        ({"materials.steel.G": 1.0}, 'no input "materials.steel.G" here; did you mean'),
    ):
        with pytest.raises(impact.ImpactError, match=f"^{re.escape(message)}"):
            impact.run(tmp_path / "r.h5", at=at)
    process = cli("run", "r.h5", "--at", "case=3", cwd=tmp_path)
    assert (process.returncode, process.stderr[:10]) == (2, "case = 3.0")
    # a result with a single case is run at that case
    collision = impact.run(result.isel(case=1))
    assert collision.point["v1"] == 2.0
    assert collision.first == ("materials.steel.E",)


def test_at_selects_a_point_of_a_zip_group_by_a_word() -> None:
    sweep = {
        "e": 0.5,
        "u1": 1.0,
        "mu": [0.2, 0.3],
        "R1": 0.1,
        "R2": 0.1,
        "m1": 1.0,
        "m2": 2.0,
        "K": 1e8,
        "v1": 1.0,
    }
    limits = {"coulomb-1785": {"limit": ["abs", "positive"]}}
    zipped = {**sweep, "zip": [["mu", "friction.coulomb-1785.limit"]]}
    source = {"models": ["tsuji-1992"], "frictions": ["coulomb-1785"], "sweep": zipped, "friction": limits}
    word = {"friction.coulomb-1785.limit": "positive"}
    for at in (word, {**word, "mu": 0.3}):
        assert impact.run(source, at=at).point["mu"] == 0.3
    with pytest.raises(UsageError, match=r"limit = positive, mu = 0\.2: not on"):
        impact.run(source, at={**word, "mu": 0.2})


def test_at_fixes_an_uncertain_input() -> None:
    uncertain = {"e": {"normal": [0.8, 0.02]}, "v1": {"uniform": [0.5, 1.5]}, "m1": 0.1, "m2": 0.2, "K": 1e8}
    source = {"models": ["tsuji-1992"], "sweep": uncertain, "design": {"n": 16}}
    fixed = {"models": ["tsuji-1992"], "sweep": {**uncertain, "e": 0.7, "v1": 2.0}}
    runs = (impact.run(source, at={"e": 0.7, "v1": 2.0}), impact.run(fixed))
    # as text, in which NaN is equal to NaN
    assert len({json.dumps(run.as_dict()) for run in runs}) == 1
    some = impact.run(impact.sweep(source), at={"e": 0.7})
    assert (some.point["e"], some.first) == (0.7, ("v1",))
    assert 0.5 <= some.point["v1"] <= 1.5


def test_values_of_numpy_are_values() -> None:
    e, speeds = np.float64(0.6), np.array([1.0, 2.0])
    assert impact.run(model="bilinear", at={"e": e}).point == impact.run(model="bilinear", at={"e": 0.6}).point
    roots = [
        impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": 0.5}, over={"v1": over}).roots
        for over in (speeds, speeds.tolist())
    ]
    assert roots[0] == roots[1] != ()
    with pytest.raises(impact.ImpactError, match=r"^at\[\"e\"\]: sweep\.e: got 1\.5, expected"):
        impact.run(model="bilinear", at={"e": np.float64(1.5)})


@pytest.mark.parametrize(
    "values", [(0.2, 0.3), [0.2, 0.3], np.array([0.2, 0.3]), {"linspace": [0, 1, 3]}], ids=repr
)
def test_several_values_of_an_input_are_refused_in_one_line(values: Any) -> None:
    with pytest.raises(UsageError, match=r"^at=\{\"e\": [^\n]*\}: got several values, expected one$"):
        impact.run(model="hertz", at={"e": values})


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (["E=65 GPa"], """--set 'materials.table1.E="65 GPa"'"""),
        (["rho=2500", "material=glass"], "--set materials.glass.rho=2500.0"),
        (["materials.glass.E=65e9"], "--set materials.glass.E=65000000000.0 with --at material=glass"),
        (["materials.ice.E=9 GPa"], """--set 'materials.ice.E="9 GPa"' with nu, rho and --at material=ice"""),
    ],
)
def test_a_property_that_is_no_axis_is_told_how_to_set_it(cli: Run, words: list[str], advice: str) -> None:
    refused = cli("run", *(word for setting in words for word in ("--at", setting)))
    name = words[0].partition("=")[0]
    assert (refused.returncode, refused.stderr) == (2, f'no input "{name}" here; write {advice}\n')


def test_a_property_of_an_axis_is_named() -> None:
    source = {"models": "hertz", "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "steel"}}
    with pytest.raises(UsageError, match=r'^no input "E" here; did you mean "materials.steel.E"\?$'):
        impact.run(source, overrides={"materials.steel.E": [1e9, 2e9]}, at={"E": 2e9})
    two = {"sweep.material": ["steel", "glass"]}
    with pytest.raises(UsageError, match=r'^no input "E" here; write overrides=\["materials.NAME.E=2.0"\]$'):
        impact.run(source, overrides=two, at={"E": 2.0})
    # a picture of a result takes no settings
    with pytest.raises(UsageError, match=r'^no input "nu" here; known: '):
        impact.plot(impact.sweep(source, overrides=two), kind="loop", sel={"nu": 0.2})


@pytest.mark.parametrize("name", ["materials..v1", "materials..E"])
def test_a_property_of_no_material_is_an_unknown_input(name: str) -> None:
    with pytest.raises(UsageError, match=f'^no input "{name}" here'):
        impact.run(model="hertz", at={name: 0.3})


SPHERES: dict[str, Any] = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "steel"}
IGNORED = "e = 0.6 is not an input of mujoco-solref, which delivers 0.135335; impact solve --model mujoco-solref "
LINEAR_LAW = "anagnostopoulos-1988"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "sweep", "at", "notes"),
    [
        ("mujoco-solref", {"e": 0.6}, {}, 3),
        # --at e is solved for by export and timestep
        ("mujoco-solref", {"e": [0.1, 0.6]}, {"e": 0.6}, 1),
        ("mujoco-solref", {}, {}, 0),
        ("mujoco-solref", {"e": [0.1, 0.6]}, {}, 0),
        (LINEAR_LAW, {"e": 0.6}, {}, 0),
        # the e of the starter config is the choice of nobody
        ("mujoco-solref", None, {}, 0),
    ],
)
def test_an_e_of_the_user_that_a_law_ignores_is_a_note(
    law: str, sweep: dict[str, Any] | None, at: dict[str, float], notes: int
) -> None:
    source = None if sweep is None else {"models": [law], "sweep": {**SPHERES, **sweep}}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        impact.run(source, model=law, at=at)
        impact.timestep(law, source=source, at=at, phases=4)
        if law != LINEAR_LAW:
            impact.export("mujoco", source=source, at=at, code_version="3.3.0")
    shown = [str(warning.message) for warning in caught if "not an input" in str(warning.message)]
    way = f"{IGNORED}--for dampratio --target e_out=0.6, with the same inputs, finds the parameter"
    assert shown == [way] * notes


def test_an_e_that_is_set_without_a_config_is_the_choice_of_the_user() -> None:
    with pytest.warns(impact.ImpactWarning, match="e = 0.4 is not an input of mujoco-solref"):
        impact.run(model="mujoco-solref", overrides=["sweep.e=0.4"])


def test_an_elastic_law_is_compared_at_an_e_without_a_note() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert impact.run(model="hertz", at={"e": 0.4}).values["e_out"] == pytest.approx(1.0)


@pytest.mark.parametrize("act", ["run", "timestep", "export"])
def test_an_indentation_that_is_large_beside_a_ball_is_noted(act: str) -> None:
    at = {"R1": 0.001, "R2": 0.002, "m1": 0.1, "m2": 0.1, "v1": 2.0, "K": 1e6, "e": 0.8}
    acts = {
        "run": lambda **inputs: impact.run(model="lammps-tsuji", **inputs),
        "timestep": lambda **inputs: impact.timestep("lammps-tsuji", **inputs),
        "export": lambda **inputs: impact.export("lammps", "lammps-tsuji", **inputs),
    }
    with pytest.warns(impact.ImpactWarning, match="peak indentation of .* mm is [0-9]{3}% of the smaller radius"):
        acts[act](at=at)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        acts[act](at={"R1": 0.1, "R2": 0.1, "v1": 0.1, "e": 0.8})


@pytest.mark.parametrize("act", ["run", "timestep", "export"])
def test_a_normal_that_turns_while_two_balls_touch_is_noted(act: str) -> None:
    law, friction = "lammps-tsuji", "lammps-mindlin-force"
    acts = {
        "run": lambda **inputs: impact.run(model=law, friction=friction, **inputs),
        "timestep": lambda **inputs: impact.timestep(law, friction=friction, **inputs),
        "export": lambda **inputs: impact.export("lammps", law, friction=friction, **inputs),
    }
    overrides = {"materials.soft": {"E": 5e6, "nu": 0.22, "rho": 2500.0}, "sweep.material": "soft"}
    # the balls have a mean velocity, which turns nothing
    at = {"e": 0.9, "R1": 0.001, "R2": 0.001, "v1": 0.7, "u1": 10.5, "u2": 9.8, "mu": 0.15}
    touch = impact.run(model=law, at={"e": 0.9, "R1": 0.001, "R2": 0.001, "v1": 0.7}, overrides=overrides)
    turn = 0.7 * touch.values["contact_time"] / 0.002
    assert turn > 0.1
    words = f"normal turns by {turn:.2g} rad .*, and is taken as fixed: errors of about {turn:.0%} of the speed"
    with pytest.warns(impact.ImpactWarning, match=words):
        acts[act](at=at, overrides=overrides)
    # that of a plane does not turn, and these balls move slowly along the tangent
    for other in ({"R2": math.inf, "m2": math.inf}, {"u1": 9.9}):
        with warnings.catch_warnings():
            warnings.filterwarnings("error", "the normal turns")
            acts[act](at=at | other, overrides=overrides)


def test_a_part_of_a_result_runs_a_law_without_the_parameters_of_the_others(tmp_path: Path, cli: Run) -> None:
    sweep = {
        "e": [0.3, 0.6],
        "v1": 1.0,
        "m1": 1.0,
        "m2": 2.0,
        "R1": 0.01,
        "R2": 0.02,
        "K": 1e6,
        "u1": 0.4,
        "mu": 0.2,
    }
    config = {
        "models": ["tsuji-1992", "kuwabara-kono-1987"],
        "frictions": ["coulomb-1785", "cundall-strack-1979"],
        "sweep": sweep,
        "model": {"kuwabara-kono-1987": {"A": [1e-5, 1e-4]}},
        "friction": {"cundall-strack-1979": {"k_t": [1e3, 1e5]}},
    }
    result = impact.sweep(config)
    part = result.isel({"e": 1, "kuwabara-kono-1987.A": 1, "friction.cundall-strack-1979.k_t": 1})
    for model in part["model"].values.tolist():
        for friction in part["friction"].values.tolist():
            values = impact.run(part, model=model, friction=friction).values
            for name in ("e_out", "beta"):
                laws = {"model": model, "friction": friction}
                expected = part[name].sel({dim: laws[dim] for dim in part[name].dims}).item()
                assert values[name] == pytest.approx(expected, rel=1e-9)
    impact.save(result, tmp_path / "whole.h5")
    impact.expand(tmp_path / "whole.h5", tmp_path / "part.h5", sel={"kuwabara-kono-1987.A": 1e-4})
    process = cli("run", "part.h5", "--model", "tsuji-1992", "--friction", "coulomb-1785", cwd=tmp_path)
    assert process.returncode == 0


def test_what_the_starter_config_lacks_is_named_without_a_line() -> None:
    message = "^the starter config: sweep.mu: missing, expected a number >= 0: coefficient of friction$"
    with pytest.raises(impact.ConfigError, match=message):
        impact.run(model="hertz", friction="coulomb-1785")
