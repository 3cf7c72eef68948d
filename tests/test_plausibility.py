"""Values that are allowed and hardly meant give a note on stderr and in the report; ordinary ones give none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import impact

from .conftest import ROOT
from .fork_server import ForkServer

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
MODULUS = "config.toml: materials.steel.E: got {}"
LIMIT, SMALL = "peak indentation above 10% of the smaller radius", "Hertz theory assumes small indentation"
NONE = "none of 4 points is an impact: v1 <= v2, the balls do not approach"


@pytest.mark.parametrize(
    ("change", "notes"),
    [
        ("sweep.m2=2", []),
        ('materials.steel.E="50 MPa"', []),
        ("materials.steel.E=2.1e14", [MODULUS.format("2.1e+14 Pa; no material is as stiff")]),
        ("materials.steel.E=999.0", [MODULUS.format("999 Pa; did you mean 999 GPa?")]),
        ("sweep.v1=-1", [NONE]),
        ("sweep.v1=400", []),
    ],
)
def test_a_note_for_what_is_implausible(forked: ForkServer, tmp_path: Path, change: str, notes: list[str]) -> None:
    (tmp_path / "config.toml").write_text(SWEEP, encoding="utf-8")
    done = forked("sweep", "config.toml", "--set", change, "--json", cwd=tmp_path)
    assert done.returncode == 0
    # the smaller ball is ball 1, whose radius comes from its mass
    depth = impact.load(tmp_path / "results.h5")["peak_indentation"] / np.cbrt(3 / (4 * np.pi * 7850))
    deep = int((depth > 0.1).sum())
    if deep:
        notes = [*notes, f"{LIMIT} at {deep} of 4 points, at most {depth.max():.0%}; {SMALL}"]
    assert (deep > 0) is (change in ("sweep.v1=400", "materials.steel.E=999.0"))
    assert [line[6:] for line in done.stderr.splitlines() if line.startswith("note: ")] == notes
    assert json.loads(done.stdout)["points"] == 4
    again = forked("sweep", "config.toml", "--set", change, "--overwrite", "--quiet", cwd=tmp_path)
    assert (again.returncode, again.stderr) == (0, "")


def test_a_modulus_that_is_an_axis_is_no_implausible_number(forked: ForkServer, tmp_path: Path) -> None:
    (tmp_path / "config.toml").write_text(SWEEP.replace('E = "210 GPa"', 'E = ["70 GPa", "210 GPa"]'))
    done = forked("sweep", "config.toml", cwd=tmp_path)
    assert (done.returncode, done.stderr.count("note: ")) == (0, 0)


def test_an_implausible_modulus_among_the_values_of_an_axis_is_noted(forked: ForkServer, tmp_path: Path) -> None:
    (tmp_path / "config.toml").write_text(SWEEP.replace('E = "210 GPa"', 'E = ["70 GPa", 210]'))
    done = forked("sweep", "config.toml", cwd=tmp_path)
    note = MODULUS.format("210 Pa; did you mean 210 GPa?")
    assert [line[6:] for line in done.stderr.splitlines() if MODULUS[12:30] in line] == [note]
    page = impact.report(impact.load(tmp_path / "results.h5"))
    assert "<p>Note: materials.steel.E: got 210 Pa; did you mean 210 GPa?</p>" in page


def test_the_configs_of_the_project_give_no_note(forked: ForkServer, tmp_path: Path) -> None:
    for config in sorted((ROOT / "configs").glob("*.toml")):
        done = forked("sweep", config, "-o", f"{config.stem}.h5", "--allow-failed", cwd=tmp_path)
        assert done.returncode == 0
        assert "note: " not in done.stderr


def test_the_report_has_the_notes() -> None:
    sweep = {"e": [0.2, 0.8], "v1": -1.0, "m1": 1.0, "m2": 2.0, "material": "steel"}
    materials = {"steel": {"E": 210.0, "nu": 0.3, "rho": 7850.0}}
    result = impact.sweep({"models": ["hertz", "bilinear"], "sweep": sweep, "materials": materials})
    page = impact.report(result)
    assert "<p>Note: materials.steel.E: got 210 Pa; did you mean 210 GPa?</p>" in page
    assert "<p>Note: none of 4 points is an impact: v1 &lt;= v2, the balls do not approach</p>" in page
