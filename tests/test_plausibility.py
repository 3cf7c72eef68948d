"""Valid but implausible values give a note on stderr and in the report; ordinary values give none."""

from __future__ import annotations

import html
import json
import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.results.summary import result_notes

from .conftest import ROOT, Run

SWEEP = """models = ["hertz", "gharib-hurmuzlu-2012"]
[solver]
rtol = 1e-4
[sweep]
e = [0.2, 0.8]
v1 = 1.0
m1 = 1.0
m2 = 2.0
material = "steel"
[materials.steel]
E = "210 GPa"
nu = 0.3
rho = 7850
"""
MASS = "m2: got 2 kg, but a sphere of R2 = 1 m and 7850 kg/m^3 has 3.288e+04 kg; without m2 the mass follows"
MODULUS = "materials.steel.E: got {}"
LIMIT, SMALL = "peak indentation above 10% of the smaller radius", "Hertz theory assumes small indentation"
NO_IMPACT = "none of 4 points is an impact: v1 <= v2, the balls do not approach"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "notes"),
    [
        ("sweep.m2=2", []),
        ('materials.steel.E="50 MPa"', []),
        ("materials.steel.E=2.1e14", [MODULUS.format("2.1e+14 Pa; no material is as stiff")]),
        ("materials.steel.E=999.0", [MODULUS.format("999 Pa; did you mean 999 GPa?")]),
        ("sweep.v1=-1", [NO_IMPACT]),
        ("sweep.v1=400", []),
        ("sweep.R2=1", [MASS]),
        ("sweep.R2=0.0394", []),
    ],
)
def test_an_implausible_value_gives_a_note(tmp_path: Path, change: str, notes: list[str]) -> None:
    path = tmp_path / "results.h5"
    received, points = sweep_with_notes(SWEEP, path, change)
    # ball 1 is the smaller one, and its radius follows from its mass
    depth = impact.load(path)["peak_indentation"] / np.cbrt(3 / (4 * np.pi * 7850))
    deep = int((depth > 0.1).sum())
    if deep:
        notes = [*notes, f"{LIMIT} at {deep} of 4 points, at most {depth.max():.0%}; {SMALL}"]
    assert (deep > 0) is (change in ("sweep.v1=400", "materials.steel.E=999.0"))
    assert received == notes
    assert points == 4


def sweep_with_notes(text: str, path: Path, *overrides: str) -> tuple[list[str], int]:
    """Sweep a config; its notes, in the order in which the command prints them, and the number of points."""
    notes: list[str] = []
    outcome = impact.sweep_to_file(tomllib.loads(text), path, overrides=overrides, on_note=notes.append)
    return [*notes, *result_notes(outcome.summary)], outcome.summary.points


@pytest.mark.slow
def test_the_command_prints_notes_unless_it_is_quiet(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "config.toml").write_text(SWEEP, encoding="utf-8")
    words = ("sweep", "config.toml", "--set", "materials.steel.E=2.1e14", "--set", "sweep.v1=-1", "--overwrite")
    completed = cli(*words, "--json", cwd=tmp_path)
    assert (completed.returncode, json.loads(completed.stdout)["points"]) == (0, 4)
    notes = [line[6:] for line in completed.stderr.splitlines() if line.startswith("note: ")]
    assert notes == [f"config.toml: {MODULUS.format('2.1e+14 Pa; no material is as stiff')}", NO_IMPACT]
    quiet = cli(*words, "--quiet", cwd=tmp_path)
    assert (quiet.returncode, quiet.stderr) == (0, "")


@pytest.mark.slow
def test_a_quiet_study_prints_no_notes(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "config.toml").write_text(SWEEP + "[design]\nn = 2\n", encoding="utf-8")
    changes = ("materials.steel.E=2.1e14", "sweep.v1.uniform=[1, 2]")
    words = ("sensitivity", "config.toml", *(word for change in changes for word in ("--set", change)))
    # the server of the tests ignores these warnings
    loud, quiet = (cli(*words, *more, cwd=tmp_path, PYTHONWARNINGS="") for more in ((), ("--quiet",)))
    assert "no material is as stiff" in loud.stderr
    assert (quiet.returncode, quiet.stderr) == (0, "")


def test_what_a_material_of_the_library_lacks_is_named_with_the_line_of_its_name(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(
        'models = "johnson-1985"\n[sweep]\nv1 = 1.0\nR1 = 0.01\nR2 = 0.01\nmaterial = "glass"\n', encoding="utf-8"
    )
    with pytest.raises(impact.ConfigError, match=r"c\.toml:6: materials\.glass\.yield_strength: missing"):
        impact.sweep(tmp_path / "c.toml")


def test_plausible_values_of_an_axis_give_no_note(tmp_path: Path) -> None:
    text = SWEEP.replace('E = "210 GPa"', 'E = ["70 GPa", "210 GPa"]')
    assert sweep_with_notes(text, tmp_path / "results.h5")[0] == []


@pytest.mark.slow
def test_an_implausible_modulus_of_an_axis_gives_a_note(tmp_path: Path) -> None:
    text = SWEEP.replace('E = "210 GPa"', 'E = ["70 GPa", 210]')
    notes, _ = sweep_with_notes(text, tmp_path / "results.h5", "sweep.e=0.5", "models=hertz")
    note = MODULUS.format("210 Pa; did you mean 210 GPa?")
    assert [line for line in notes if line.startswith("materials.steel.E")] == [note]
    page = impact.report(impact.load(tmp_path / "results.h5"))
    assert f"<p>Note: {note}</p>" in page


def test_a_calibration_gives_the_notes_of_what_is_not_fitted() -> None:
    sweep = {"m1": 2.0, "R1": 0.01, "m2": 2.0, "R2": 0.01, "material1": "soft", "material2": "steel", "v1": 1.0}
    steel = {"E": 210e9, "nu": 0.3, "rho": 7850.0}
    config = {
        "models": "hertz",
        "sweep": {**sweep, "m1": {"fit": [1.0, 3.0]}},
        "materials": {"steel": steel, "soft": {**steel, "E": 210.0}},
        "data": {"columns": {"contact_time": [1e-4, 1.1e-4, 1.2e-4]}},
    }
    with pytest.warns(impact.ImpactWarning) as caught:
        impact.calibrate(config)
    notes = [str(warning.message) for warning in caught]
    assert notes[0] == "materials.soft.E: got 210 Pa; did you mean 210 GPa?"
    assert notes[1].startswith("m2: got 2 kg, but a sphere of R2 = 0.01 m and 7850 kg/m^3 has 0.03288 kg")
    assert not any(note.startswith("m1: ") for note in notes)


@pytest.mark.slow
def test_the_configs_of_the_project_give_no_note(tmp_path: Path) -> None:
    configs = sorted((ROOT / "configs").glob("*.toml"))
    assert configs
    for config in configs:
        text = config.read_text(encoding="utf-8")
        assert sweep_with_notes(text, tmp_path / f"{config.stem}.h5", "solver.rtol=1e-4")[0] == []


@pytest.mark.slow
def test_the_report_has_the_notes() -> None:
    sweep = {"e": [0.2, 0.8], "v1": -1.0, "m1": 1.0, "m2": 2.0, "material": "steel"}
    materials = {"steel": {"E": 210.0, "nu": 0.3, "rho": 7850.0}}
    config = {"models": "hertz", "sweep": sweep, "materials": materials, "solver": {"rtol": 1e-4}}
    page = impact.report(impact.sweep(config))
    assert "<p>Note: materials.steel.E: got 210 Pa; did you mean 210 GPa?</p>" in page
    assert "<p>Note: none of 2 points is an impact: v1 &lt;= v2, the balls do not approach</p>" in page


def test_a_factored_result_of_more_than_a_million_points_has_the_note_on_depth(tmp_path: Path) -> None:
    """Their statuses are counted in another way."""
    axes = {"m1": {"geomspace": [1.0, 10.0, 1025]}, "v1": {"geomspace": [1.0, 100.0, 1024]}}
    sweep = {"e": 0.5, **axes, "m2": 1.0, "R1": 0.05, "R2": 0.05, "material": "soft"}
    materials = {"soft": {"E": 5e6, "nu": 0.49}}
    config = {"models": "tsuji-1992", "sweep": sweep, "materials": materials, "output": {"layout": "factored"}}
    outcome = impact.sweep_to_file(config, tmp_path / "large.h5")
    deep = int((outcome.dataset["peak_indentation"].values > 0.1 * 0.05).sum())
    (note,) = result_notes(outcome.summary)
    assert note.startswith(f"{LIMIT} at {deep:,} of {1024 * 1025:,} points, at most 304%")


MANY_AXES = {
    "models": ["hertz", "gharib-hurmuzlu-2012", "kelvin-voigt"],
    "solver": {"rtol": 1e-4},
    "sweep": {
        "e": [0.2, 0.8],
        "v1": [1.0, 50.0, 400.0],
        "m1": [1.0, 0.001],
        "m2": [2.0, math.inf],
        "R2": [0.01, math.inf],
        "zip": [["m2", "R2"]],
        "material1": ["steel", "rubber"],
        "material2": "steel",
    },
    "model": {"kelvin-voigt": {"C": [10.0, 100.0]}},
    "materials": {
        "steel": {"E": 210.0, "nu": 0.3, "rho": 7850.0},
        "rubber": {"E": 5e6, "nu": 0.45, "rho": [900.0, 1200.0]},
    },
}


def test_a_mass_is_noted_in_any_row_of_a_table_of_masses_and_radii(tmp_path: Path) -> None:
    change = "sweep.zip=[['m2', 'R2']]", "sweep.R2=[0.1, 0.2, 0.3]", "sweep.m2=[32.88, 263.1, 800.0]"
    notes: list[str] = []
    (tmp_path / "c.toml").write_text(SWEEP, encoding="utf-8")
    impact.sweep_to_file(tmp_path / "c.toml", tmp_path / "r.h5", overrides=change, on_note=notes.append)
    assert [note.partition(",")[0] for note in notes] == ["m2: got 800 kg"]


def notes_of(page: str) -> list[str]:
    """The notes of a report."""
    return [html.unescape(note) for note in re.findall("<p>Note: (.*?)</p>", page)]


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["full", "factored"])
def test_the_report_has_every_note_of_the_sweep(cli: Run, tmp_path: Path, layout: str) -> None:
    (tmp_path / "c.json").write_text(json.dumps(MANY_AXES), encoding="utf-8")
    done = cli("sweep", "c.json", "-o", "r.h5", "--set", f"output.layout={layout}", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    mass = "m2: got 2 kg, but a sphere of R2 = 0.01 m and 7850 kg/m^3 has 0.03288 kg; without m2 the mass follows"
    printed = [line.removeprefix("note: ") for line in done.stderr.splitlines() if line.startswith("note: ")]
    assert [line.partition(" at ")[0] for line in printed] == [
        "c.json: materials.steel.E: got 210 Pa; did you mean 210 GPa?",
        f"c.json: {mass}",
        LIMIT,
    ]
    result = impact.load(tmp_path / "r.h5")
    assert notes_of(impact.report(result, sections=["inputs"])) == [
        line.removeprefix("c.json: ") for line in printed
    ]
    # a part of a result has the number of its own points
    single = {"e": 0, "v1": 2, "m1": 1, "m2": 0, "material1": 1, "materials.rubber.rho": 1, "kelvin-voigt.C": 0}
    part = result.isel(single)
    depth = part["peak_indentation"].values / np.cbrt(3 * 0.001 / (4 * np.pi * 1200.0))
    note = f"{LIMIT} at {(depth > 0.1).sum()} of 3 points, at most {depth.max():.0%}; {SMALL}"
    assert notes_of(impact.report(part, sections=["inputs"]))[1:] == [mass, note]
    # without the values, or what the radii follow from, there is none
    without = (result.drop_vars("peak_indentation"), result.assign_attrs(materials="{}"))
    assert [len(notes_of(impact.report(each, sections=["inputs"]))) for each in without] == [2, 0]


def test_the_material_of_the_starter_config_contradicts_no_mass(recwarn: pytest.WarningsRecorder) -> None:
    """A note names a density only if the user chose the material."""
    ball = {"m1": "45 g", "R1": "21.3 mm", "R2": math.inf}
    impact.run(at=ball)
    impact.sweep(models="hertz", **ball)
    assert not [str(warning.message) for warning in recwarn if "a sphere of" in str(warning.message)]
    with pytest.warns(match=r"^m1: got 0.045 kg, but a sphere of R1 = 0.0213 m and 7800 kg/m\^3 has"):
        impact.run(at={**ball, "material": "steel"})
    with pytest.warns(match=r"^m1: got 0.045 kg, but a sphere of R1 = 0.0213 m and 2700 kg/m\^3 has"):
        impact.sweep(models="hertz", overrides={"materials.table1.rho": 2700}, **ball)


def test_a_result_of_the_starter_config_contradicts_no_mass(recwarn: pytest.WarningsRecorder) -> None:
    result = impact.sweep(models="hertz", e=[0.1, 0.9], m1="45 g", R1="21.3 mm", R2=math.inf)
    assert notes_of(impact.report(result, sections=["inputs"])) == []
    impact.run(result)
    assert not [str(warning.message) for warning in recwarn if "a sphere of" in str(warning.message)]
