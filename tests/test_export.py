"""`impact export` writes a law in the units and conventions of a code, with what the code delivers."""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.errors import ConfigError, UsageError
from impact.exporters.code import Code
from impact.exporters.export import comment_lines
from impact.exporters.programs import run_program
from impact.exporters.registry import CODES, first_law, installed_version
from impact.exporters.verification import Verification, extrapolate

from .conftest import Run, assert_refused, assert_same_output, default_law, examples_of, write_program
from .fork_server import ForkServer

# two balls whose effective mass is 0.75 kg and whose effective radius is 0.03 m
BALLS = {"v1": 1.0, "v2": 0.0, "m1": 1.0, "m2": 3.0, "R1": 0.04, "R2": 0.12}
SOFT = {"E": 1e9, "nu": 0.3}
HARD = {"E": 5e9, "nu": 0.2}
# parameters of default laws that have no default
OWN_PARAMETERS = {
    "simbody": {"simbody-hunt-crossley.c": 0.3},
    "modelica": {"modelica-elastogap.d": 1e3},
    "adams": {"adams-impact.c": 1e3, "adams-impact.d": 1e-5},
    "simscape": {"simscape-contact.b": 1e3, "simscape-contact.w": 1e-5},
    "newton": {"newton-semi-implicit.kd": 1e3},
    **{name: {"kelvin-voigt-no-tension.C": 1e3} for name in ("pybullet", "physx")},
}


def source(*materials: str, **values: float) -> dict[str, object]:
    """A config of one impact, with materials or with a stiffness."""
    named = {f"material{i}": name for i, name in enumerate(materials, 1)}
    return {
        "models": "hertz",
        "materials": {"soft": SOFT, "hard": HARD},
        "sweep": BALLS | {"e": 0.5} | named | values,
    }


def test_a_result_with_a_law_of_the_user_is_exported_with_the_file_of_that_law(tmp_path: Path, cli: Run) -> None:
    fields = 'title="Mine", year=2026, equation="", reference="", chi=lambda e: 1 - e'
    law = f'from impact import hysteresis\nMINE = hysteresis("mine", {fields})\n'
    (tmp_path / "law.py").write_text(law, encoding="utf-8")
    config = source(K=1e6) | {"models": ["mine", "lammps-coeff-restitution-hertz"]}
    impact.save(impact.sweep(config, plugins=[tmp_path / "law.py"]), tmp_path / "r.h5")
    words = ("export", "r.h5", "--to", "lammps", "--code-version", "22Jul2025")
    assert_refused(cli(*words, cwd=tmp_path), "made with mine of law.py; give it again with --plugin FILE")
    done = cli(*words, "--plugin", "law.py", cwd=tmp_path)
    assert (done.returncode, "damping coeff_restitution" in done.stdout) == (0, True)
    done = cli(*words, "--plugin", "law.py", "-o", "law.py", "--overwrite", cwd=tmp_path)
    assert (done.returncode, (tmp_path / "law.py").read_text(encoding="utf-8")) == (2, law)


@pytest.mark.slow
def test_materials_of_the_user_replace_that_of_table_1() -> None:
    """Each ball keeps the default until it has its own; a material of both replaces those of each."""
    at, key = {"material1": "glass", "material2": "steel"}, "lammps-coeff-restitution-hertz"
    for fields in ({"at": at}, {"overrides": {f"sweep.{ball}": name for ball, name in at.items()}}):
        export = impact.export("lammps", key, code_version="22Jul2025", **fields)
        assert "defaults of Table 1 of the paper: v1 = 1 m/s, m1 = 1 kg, m2 = 1 kg" in export.header
        assert {name: impact.run(model="hertz", **fields).point[name] for name in at} == at
    export = impact.export("lammps", key, at={"material2": "steel"}, code_version="22Jul2025")
    assert (
        "defaults of Table 1 of the paper: v1 = 1 m/s, m1 = 1 kg, m2 = 1 kg, material1 = table1" in export.header
    )
    point = impact.run(
        model="hertz", overrides={f"sweep.{ball}": name for ball, name in at.items()}, at={"material": "steel"}
    ).point
    assert {name for name in point if "material" in name} == {"material"}


def test_a_parameter_that_cannot_be_found_is_reported() -> None:
    at, fields = {"e": 0.7, "v1": 1.0}, {"code_version": "3.8.0", "dt": "20 us"}
    with pytest.raises(UsageError, match="parameter: e does not set the contact time of liggghts-hertz"):
        impact.export("liggghts", at=at, parameter="e", **fields)
    with pytest.raises(UsageError, match='parameter: liggghts-hertz has no parameter ""'):
        impact.export("liggghts", at=at, parameter="", **fields)
    missing = impact.export(
        "lammps",
        "lammps-tsuji-without-root",
        at=at,
        dt="20 us",
        code_version="29Sep2021",
        parameter="materials.table1.E",
    )
    assert "no value of materials.table1.E keeps every phase within 1 % at the step" in missing.header


@pytest.mark.slow
def test_the_law_is_the_first_of_the_source_that_the_code_has() -> None:
    hooke, hertz = "lammps-coeff-restitution-hooke", "lammps-coeff-restitution-hertz"
    config = source("soft", "soft") | {"models": ["gonthier-2004", hooke, hertz]}
    assert impact.export("lammps", source=config, code_version="22Jul2025").model == hooke
    assert impact.export("lammps", hertz, source=config, code_version="22Jul2025").model == hertz
    assert impact.export("lammps", overrides=[f'models="{hooke}"'], code_version="22Jul2025").model == hooke
    with pytest.raises(UsageError, match="has none of the laws gonthier-2004"):
        impact.export("lammps", source=config | {"models": "gonthier-2004"})


def test_the_default_law_is_the_first_that_the_installed_release_has(cli: Run, tmp_path: Path) -> None:
    """LAMMPS of 2021, which Debian has, lacks the damping of the default law; the header says so."""
    lmp = write_program(tmp_path / "lmp", 'echo "Massively Parallel Simulator - 29 Sep 2021 - Update 2"')
    done = cli("export", "--to", "lammps", "--at", "e=0.6", "--at", "v1=1", "--dt", "5e-6", "--program", lmp)
    assert done.returncode == 0
    assert "\n# law: lammps-tsuji-without-root, " in done.stdout
    assert (
        "\n# release 20210929 lacks the default law of 20250722, lammps-coeff-restitution-hertz\n" in done.stdout
    )
    assert "use --model lammps-coeff-restitution-hertz" not in done.stderr
    models = ["lammps-coeff-restitution-hooke", "lammps-velocity-hooke"]
    config = source("soft", "soft") | {"models": models, "model": {models[1]: {"C": 10.0}}}
    assert impact.export("lammps", source=config, program=str(lmp)).model == models[1]
    with pytest.raises(
        UsageError, match="LAMMPS 20210929 has no coeff_restitution, expected code_version 20240601 or"
    ):
        impact.export("lammps", source=config | {"models": models[0]}, program=str(lmp))


@pytest.mark.parametrize("name", CODES)
def test_the_default_law_of_the_newest_release_is_the_first_of_the_list(name: str) -> None:
    code = CODES[name]
    assert first_law(code, list(code.laws), code.newest) == default_law(name)


def test_without_a_temporary_folder_the_release_is_not_asked_for(forked: ForkServer, tmp_path: Path) -> None:
    code = "import tempfile\ntempfile.tempdir = '/no/such/folder'"
    done = forked("export", "--to", "lammps", cwd=tmp_path, code=code)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
def test_a_config_that_is_not_valid_is_not_exported_with_another_law() -> None:
    viscoelastic = "lammps-viscoelastic-hertz"
    config = source("soft", "soft") | {"models": viscoelastic}
    with pytest.raises(ConfigError, match="eta: missing"):
        impact.export("lammps", source=config)
    assert impact.export("lammps", source=config, at={"e": 0.6}).model == viscoelastic
    # a stiffness of a linear spring
    hooke = source(n=1.5) | {"models": "lammps-coeff-restitution-hooke"}
    export = impact.export("lammps", source=hooke, at={"K": 1e6}, code_version="22Jul2025")
    assert (export.model, export.parameters["k_n"]) == ("lammps-coeff-restitution-hooke", 1e6)
    with pytest.raises(ConfigError, match='did you mean "hertz"'):
        impact.export("lammps", source=config | {"models": "hetrz"})


def test_the_stiffness_of_lammps_hertz_is_per_root_of_the_effective_radius() -> None:
    export = impact.export("lammps", default_law("lammps"), source=source(K=1e8), code_version="22Jul2025")
    assert export.parameters == {"k_n": pytest.approx(1e8 / math.sqrt(0.03), rel=1e-15), "e": 0.5}
    assert any("no friction: replace the tangential model" in remark for remark in export.header)
    assert "k_n = K/sqrt(R*), for R* = 0.03 m; hertz/material takes E and nu" in export.header


def test_lammps_takes_the_moduli_of_both_types_of_two_materials() -> None:
    export = impact.export(
        "lammps", default_law("lammps"), source=source("soft", "hard"), code_version="22Jul2025"
    )
    assert [line.split()[1:7] for line in export.lines if line.startswith("pair_coeff")] == [
        ["1", "1", "hertz/material", "1000000000.0", "0.5", "0.3"],
        ["2", "2", "hertz/material", "5000000000.0", "0.5", "0.2"],
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "expected"),
    [
        # ζ = −ln 0.5/√(π² + ln² 0.5) of a linear spring that pulls, K = 1e6 N/m and m = 0.75 kg
        ("lammps-velocity-hooke", 2.0 * 0.2154537620 * math.sqrt(0.75e6)),
        ("lammps-mass-velocity-hooke", 2.0 * 0.2154537620 * math.sqrt(1e6 / 0.75)),
    ],
)
def test_the_damping_of_a_law_without_e_is_solved_for(key: str, expected: float) -> None:
    export = impact.export("lammps", key, source=source(), at={"e": 0.5, "K": 1e6}, code_version="22Jul2025")
    assert export.parameters["eta_n0"] == pytest.approx(expected, rel=1e-8)
    assert export.e_continuous == pytest.approx(0.5, abs=1e-9)
    fields = export.as_dict()
    assert fields["e"] == 0.5
    (name,) = fields["solved"]
    assert fields["solved"][name] == export.parameters["eta_n0"]


def test_liggghts_takes_the_properties_of_each_type_and_pair() -> None:
    parameters = impact.export(
        "liggghts", default_law("liggghts"), source=source("soft", "hard"), code_version="3.8.0"
    ).parameters
    assert parameters["youngsModulus"] == "peratomtype 1000000000.0 5000000000.0"
    assert parameters["poissonsRatio"] == "peratomtype 0.3 0.2"
    assert parameters["coefficientRestitution"] == "peratomtypepair 2 0.5 0.5 0.5 0.5"


@pytest.mark.parametrize(("ball2", "walls"), [({"m2": math.inf}, 0), ({"m2": math.inf, "R2": math.inf}, 1)])
def test_liggghts_gets_a_wall_where_the_second_ball_is_one(ball2: dict[str, float], walls: int) -> None:
    config = source("soft", "hard", **ball2)
    lines = impact.export("liggghts", default_law("liggghts"), source=config, code_version="3.8.0").lines
    assert sum(line.startswith("fix             wall all wall/") for line in lines) == walls


def test_liggghts_hooke_remarks_on_its_characteristic_velocity_and_on_attraction() -> None:
    free, limited = (
        impact.export(
            "liggghts", key, source=source("soft", "soft") | {"models": key}, code_version="3.8.0"
        ).header
        for key in ("liggghts-hooke", "liggghts-hooke-limit-force")
    )
    assert any("follows from characteristicVelocity" in remark for remark in free)
    assert any("becomes attractive" in remark for remark in free)
    assert "limitForce on: the force is never negative" in limited


@pytest.mark.parametrize(
    ("moduli", "expected"),
    [
        ((5e6, 1e9), []),
        ((4.9e6, 1e9), ["soft_particles"]),
        ((1e9, 4.9e6), ["soft_particles"]),
        ((5e6, 1.1e9), ["hard_particles"]),
        ((1.1e9, 4.9e6), ["soft_particles", "hard_particles"]),
    ],
)
def test_liggghts_is_told_of_moduli_outside_its_range(moduli: tuple[float, float], expected: list[str]) -> None:
    config = source("first", "second")
    config["materials"] = {name: {"E": E, "nu": 0.3} for name, E in zip(("first", "second"), moduli, strict=True)}
    lines = impact.export("liggghts", default_law("liggghts"), source=config, code_version="3.8.0").lines
    assert [line.split() for line in lines if "_particles" in line] == [[name, "yes"] for name in expected]


@pytest.mark.parametrize(
    ("version", "key"), [("2011.05", "yade-en-pulling"), ("2022.01a", "yade-en-clamped"), ("2023.02a", "yade-en")]
)
def test_the_law_of_en_depends_on_the_version_of_yade(version: str, key: str) -> None:
    export = impact.export("yade", default_law("yade"), source=source("soft", "soft"), code_version=version)
    assert (export.model, export.parameters["en"]) == (key, 0.5)


def test_yade_gets_twice_the_spring_and_dashpot_of_the_contact_for_each_ball() -> None:
    export = impact.export(
        "yade", "yade-viscoelastic", source=source(), at={"K": 1e6, "yade-viscoelastic.C": 300.0}
    )
    assert (export.parameters["kn"], export.parameters["cn"]) == (2e6, 600.0)


def test_the_law_of_another_release_has_the_parameters_of_the_config() -> None:
    config = {
        "models": ["kelvin-voigt"],
        "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0},
        "model": {"kelvin-voigt": {"C": 300.0}},
    }
    export = impact.export("yade", source=config, code_version="2023.02a")
    assert (export.model, export.parameters["cn"]) == ("yade-viscoelastic", 600.0)


WALL = {"m2": math.inf, "R2": math.inf}


@pytest.mark.slow
@pytest.mark.parametrize("name", [code.name for code in CODES.values() if code.template])
def test_a_script_with_a_wall_has_one_ball(name: str) -> None:
    """Each template has a wall, nothing that is infinite is written, and a wall is at rest."""
    code = CODES[name]
    assert "has_wall" in code.template
    config = source("soft", "soft", v2=-0.5, **WALL) | {"models": default_law(name)}
    at = OWN_PARAMETERS.get(name, {})
    script = impact.export(name, source=config, at=at, script=True, code_version=code.newest).script
    assert script is not None
    assert (
        "ball 2 is a plane wall: m = m1, R* = 0.04 m; in a script it is at rest, and ball 1 has v1 - v2" in script
    )
    body = "\n".join(line for line in script.splitlines() if not line.startswith(code.comment[0]))
    assert not re.search(r"\b(inf|nan)\b|-0\.5", body)


@pytest.mark.slow
def test_a_wall_of_yade_before_hertzian_has_half_the_effective_radius() -> None:
    older, newer = (
        impact.export("yade", "yade-betan", source=source("soft", "soft", **WALL), dt=5e-6, code_version=version)
        for version in ("2022.01a", "2023.02a")
    )
    assert older.contact_time == pytest.approx(newer.contact_time * 2**0.2, rel=1e-7)
    assert any("Ig2_Wall_Sphere_ScGeom()" in line for line in older.lines)
    assert any("Ig2_Wall_Sphere_ScGeom(hertzian=True)" in line for line in newer.lines)
    assert older.e_continuous == pytest.approx(newer.e_continuous, rel=1e-9)
    assert older.at_dt.e_mean != newer.at_dt.e_mean


def test_a_wall_of_the_edinburgh_model_does_not_adhere() -> None:
    law = "liggghts-edinburgh"
    dry, adhesive = (
        impact.export(
            "liggghts",
            source=source("soft", "soft", n=1.5, **WALL) | {"models": law, "model": {law: pair}},
            code_version="3.8.0",
        )
        for pair in ({"k2": 2.0, "gamma": 0.0}, {"k2": 2.0, "gamma": 2e3})
    )
    assert adhesive.lines == dry.lines
    assert adhesive.e_continuous == dry.e_continuous
    assert "a wall does not adhere, whatever its surfaceEnergy is: 0 here" in adhesive.header


def test_a_wall_of_another_material_is_a_stiffness_in_lammps() -> None:
    law = "lammps-coeff-restitution-hertz"
    one, two = (
        impact.export("lammps", law, source=source("soft", other, **WALL), code_version="22Jul2025")
        for other in ("soft", "hard")
    )
    modulus = 1.0 / ((1.0 - 0.3**2) / 1e9 + (1.0 - 0.2**2) / 5e9)
    assert one.lines[0].startswith(
        "fix             wall all wall/gran granular hertz/material 1000000000.0 0.5 0.3"
    )
    assert two.parameters["k_n"] == pytest.approx(4.0 / 3.0 * modulus)
    assert two.lines[0].endswith("xplane NULL 0.0")


@pytest.mark.parametrize("spring", ["hertz", "hooke"])
def test_a_remark_on_hertz_material_at_a_wall_is_for_hertz_alone(spring: str) -> None:
    law = f"lammps-coeff-restitution-{spring}"
    export = impact.export("lammps", law, source=source("soft", "hard", **WALL), code_version="22Jul2025")
    assert any("hertz/material" in remark for remark in export.header) == (spring == "hertz")


@pytest.mark.parametrize(
    ("other", "at", "version", "spring"),
    [
        ("soft", {}, "20210929", "hertz/material"),
        # releases whose hertz/material has another stiffness at a wall and for two materials
        ("hard", {}, "20220623", "hertz"),
        ("soft", WALL, "20220623", "hertz"),
        ("hard", {}, "20240829", "hertz/material"),
        ("soft", WALL, "20240829", "hertz/material"),
    ],
)
def test_old_releases_of_lammps_take_moduli_of_two_balls_of_one_material(
    other: str, at: dict[str, float], version: str, spring: str
) -> None:
    export = impact.export(
        "lammps", "lammps-tsuji-without-root", source=source("soft", other, **at), code_version=version
    )
    (first, *_) = (line for line in export.lines if " damping " in line)
    assert spring in first.split()
    assert any("in old releases" in remark for remark in export.header) == (spring == "hertz")


def test_an_e_of_zero_is_the_critical_damping_of_yade() -> None:
    export = impact.export("yade", "yade-betan", source=source("soft", "soft", e=0.0))
    assert export.parameters["betan"] == 1.0


def test_opensees_gets_the_effective_mass_and_the_damping_of_its_documentation() -> None:
    export = impact.export("opensees", "opensees-jankowski-impact", source=source(K=1e8))
    # 9 sqrt(5)/2 (1 - e^2)/(e (e (9 pi - 16) + 16)) at e = 0.5
    assert export.parameters["xi"] == pytest.approx(0.6816, abs=1e-3)
    assert (export.parameters["Kh"], export.parameters["Meff"]) == (1e8, pytest.approx(0.75, rel=1e-15))
    hertzdamp = impact.export("opensees", "opensees-hertzdamp", source=source(K=1e8, n=1.2))
    assert hertzdamp.parameters["xiNorm"] == pytest.approx(1.6, rel=1e-15)
    # the exponent of the law comes after the gap
    for lines, n in ((export.lines, 1.5), (hertzdamp.lines, 1.2)):
        assert lines[0].endswith(f", gap, {n})")


@pytest.mark.parametrize("n", [1.5, 1.2])
def test_the_impact_material_of_opensees_has_the_peak_force_and_the_loss_of_a_spring(n: float) -> None:
    """At the indentation d it has the force K d^n, and its loop has the energy that the spring loses to e."""
    K, e, d = 1e8, 0.6, 1e-4
    at = {"opensees-impact-material.d": d}
    export = impact.export("opensees", "opensees-impact-material", source=source(K=K, e=e, n=n), at=at)
    assert any("another speed gives another restitution" in line for line in export.header)
    numbers = export.parameters
    first, second, end = (float(numbers[name]) for name in ("K1", "K2", "delta_y"))
    # compression is negative there
    assert end == pytest.approx(-0.1 * d, rel=1e-15)
    assert first * -end + second * (d + end) == pytest.approx(K * d**n, rel=1e-14)
    loop = (first - second) * -end * (d + end)
    assert loop == pytest.approx(K * d ** (n + 1.0) / (n + 1.0) * (1.0 - e**2), rel=1e-13)


@pytest.mark.parametrize("R2", [BALLS["R2"], 3.0])
def test_newton_says_how_well_its_single_precision_resolves_the_indentation(R2: float) -> None:
    law, at = default_law("newton"), {"newton-semi-implicit.kd": 0.0, "v1": 2.0, "R2": R2}
    config = source(K=1e6, n=1.0, m1=0.5)
    export = impact.export("newton", law, source=config, at=at)
    peak = impact.run(config, model=law, at=at).values["peak_indentation"]
    share = 2.0**-23 * max(BALLS["R1"], R2) / peak
    assert any(f"is resolved to {share:.2g} of its peak" in line for line in export.header)


def test_simbody_gets_the_modulus_of_plane_strain_of_each_sphere() -> None:
    export = impact.export(
        "simbody", default_law("simbody"), source=source("soft", "soft"), at={"simbody-hunt-crossley.c": 0.3}
    )
    assert export.parameters["stiffness1"] == pytest.approx(1e9 / 0.91, rel=1e-15)
    assert export.parameters["dissipation2"] == 0.3


def test_kratos_gets_the_restitution_in_the_relation_of_the_materials() -> None:
    export = impact.export("kratos", default_law("kratos"), source=source("soft", "hard"))
    assert (export.parameters["YOUNG_MODULUS"], export.parameters["YOUNG_MODULUS2"]) == (1e9, 5e9)
    assert '    "COEFFICIENT_OF_RESTITUTION": 0.5,' in export.lines


@pytest.mark.parametrize(("friction", "mu"), [(None, 0.0), ("kratos-viscous-coulomb", 0.3)])
def test_the_relation_of_kratos_has_the_friction_of_the_config(friction: str | None, mu: float) -> None:
    config = source("soft", "soft", **({"mu": mu, "angle": "40 deg"} if friction else {}))
    law, version = default_law("kratos"), "10.4.4"
    lines = impact.export("kratos", law, source=config, friction=friction, code_version=version).lines
    assert [line for line in lines if "_FRICTION" in line] == [
        f'    "{name}_FRICTION": {value},' for name, value in (("STATIC", mu), ("DYNAMIC", mu), ("ROLLING", 0.0))
    ]


@pytest.mark.parametrize("friction", [None, "kratos-viscous-coulomb"])
def test_the_export_to_kratos_says_what_its_friction_follows_from(friction: str | None) -> None:
    config = source("soft", "soft", **({"mu": 0.3, "angle": "40 deg"} if friction else {}))
    header = impact.export(
        "kratos", default_law("kratos"), source=config, friction=friction, code_version="10.4.4"
    ).header
    for words, is_of_friction in (
        ("the tangential stiffness follows from nu", True),
        ("RotationOption is true", True),
        ("no friction: replace STATIC_FRICTION", False),
    ):
        assert any(words in line for line in header) is (is_of_friction == bool(friction))


@pytest.mark.slow
def test_mujoco_gets_a_damping_ratio_and_a_constant_impedance() -> None:
    export = impact.export("mujoco", at={"e": 0.6})
    timeconst, dampratio = map(float, str(export.parameters["solref"]).split())
    assert (timeconst, dampratio) == (0.02, pytest.approx(0.1808583084, abs=1e-9))
    assert export.parameters["solimp"] == "0.9 0.9 0.001 0.5 2"


def test_drake_gets_the_stiffness_and_dissipation_of_each_ball() -> None:
    key = "drake-point-contact-mixed"
    at = {f"{key}.{name}": value for name, value in {"k1": 2e6, "k2": 6e6, "d1": 0.5, "d2": 2.0}.items()}
    own = impact.export("drake", key, at=at, code_version="1.51.1").parameters
    assert own == {"point_stiffness1": 2e6, "dissipation1": 0.5, "point_stiffness2": 6e6, "dissipation2": 2.0}
    # 1/(1/k1 + 1/k2) = 3e6 N/m for k1 : k2 = 1 : 3; d is weighted by that ratio
    scaled = impact.export("drake", key, at=at | {"K": 3e6}, code_version="1.51.1").parameters
    assert (scaled["point_stiffness1"], scaled["point_stiffness2"]) == pytest.approx((4e6, 12e6), rel=1e-15)


def test_drake_is_asked_for_the_dissipation_that_gives_the_e_of_the_continuous_law_and_delivers_less() -> None:
    export = impact.export("drake", at={"e": 0.9, "v1": 1.0, "K": 1e6}, code_version="1.51.1")
    # d v0 of e = 0.9, from its closed form
    assert export.parameters["dissipation1"] == pytest.approx(0.16648195, abs=1e-7)
    assert export.parameters["point_stiffness1"] == 2e6
    assert (export.scheme, export.at_dt.e_mean) == ("drake-tamsi", pytest.approx(0.8213, abs=1e-3))


def test_a_tsuji_before_the_factor_is_another_law_and_warned_about() -> None:
    export = impact.export("lammps", "lammps-tsuji", at={"e": 0.5}, code_version="22Jul2025")
    assert export.model == "lammps-tsuji-without-root"
    assert export.e_continuous == pytest.approx(0.616076, abs=1e-6)
    assert "lammps-coeff-restitution-hertz" in export.warnings[0]
    corrected = impact.export("lammps", "lammps-tsuji", at={"e": 0.5}, code_version="1Sep2026")
    assert corrected.model == "lammps-tsuji"
    assert corrected.e_continuous == pytest.approx(0.5, abs=0.005)


def test_a_law_of_the_catalogue_is_exported_under_the_name_of_the_code() -> None:
    export = impact.export("lammps", "tsuji-1992", code_version="22Jul2025")
    assert export.model == "lammps-coeff-restitution-hertz"


def test_a_law_exported_under_the_name_of_the_code_keeps_its_parameters() -> None:
    law = "kelvin-voigt-no-tension"
    tables = {"model": {law: {"K": 1e6, "C": [20.0, 30.0]}}, "materials": {"a": {"E": 1e9, "nu": 0.3, "rho": 1e3}}}
    config = {"models": law, "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "a"}, **tables}
    assert [impact.export("yade", source=config).parameters[name] for name in ("kn", "cn")] == [2e6, 40.0]
    part = impact.sweep(config).sel({f"{law}.C": 30.0})
    assert impact.export("yade", source=part).parameters["cn"] == 60.0


def test_what_is_delivered_at_dt_is_that_of_timestep() -> None:
    at = {"e": 0.5, "v1": 1.0}
    export = impact.export("lammps", at=at, dt=2e-5, code_version="22Jul2025")
    (row,) = impact.timestep("lammps-coeff-restitution-hertz", at=at, dt=[2e-5]).rows
    assert export.at_dt.as_dict(False) == row.as_dict(False)


@pytest.mark.slow
def test_an_unstable_step_delivers_no_restitution(cli: Run) -> None:
    """The scheme then gives an e of thousands."""
    done = cli("export", "--to", "lammps", "--at", "e=0.6", "--dt", "0.1", "--code-version", "22Jul2025")
    assert done.returncode == 0
    assert (
        " of the Rayleigh time: unstable at 400 of 400 phases, the step is too long for the scheme" in done.stdout
    )
    assert "mean e" not in done.stdout
    assert "recommended: dt <= 9.28e-06 s" in done.stdout
    assert "warning: dt = 0.1 s: unstable at 400 of 400 phases" in done.stderr
    row = impact.export("lammps", at={"e": 0.6}, dt=0.1).at_dt
    assert all(math.isnan(e) for e in (row.e_mean, row.e_least, row.e_largest))


def test_an_e_in_percent_is_solved_for() -> None:
    export = impact.export("lammps", "lammps-velocity-hooke", at={"e": "60 %"}, code_version="22Jul2025")
    assert export.e_continuous == pytest.approx(0.6, abs=1e-9)


def test_the_axes_of_a_source_take_their_first_values_and_the_header_says_so() -> None:
    config = source("soft", "soft", v1=[1.0, 2.0], e=[0.4, 0.5])
    export = impact.export(
        "lammps", default_law("lammps"), source=config, at={"v1": 2.0}, code_version="22Jul2025"
    )
    assert export.e == 0.4
    assert "first value of each axis of the source: e = 0.4" in export.header


@pytest.mark.slow
def test_the_default_step_is_a_fiftieth_of_the_contact_time(cli: Run) -> None:
    data = json.loads(cli("export", "--to", "mujoco", "--at", "e=0.6", "--json").stdout)
    assert data["e_at_dt"]["dt"] == pytest.approx(data["contact_time"] / 50)


@pytest.mark.slow
def test_the_output_is_a_file_that_is_not_replaced_silently(cli: Run, tmp_path: Path) -> None:
    words = ("export", "--to", "lammps", "--script", "-o", tmp_path / "in.balls")
    first = cli(*words)
    assert (first.returncode, first.stdout) == (0, "")
    assert "e_out = " in (tmp_path / "in.balls").read_text(encoding="utf-8")
    assert cli(*words).returncode == 2
    assert cli(*words, "--overwrite").returncode == 0


def test_every_law_of_a_code_is_in_the_list(cli: Run) -> None:
    listed = {code["code"]: code["laws"] for code in json.loads(cli("export", "--list", "--json").stdout)}
    assert listed == {name: dict(code.laws) for name, code in CODES.items()}
    assert all(laws.keys() <= impact.models().keys() for laws in listed.values())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "--to: expected a code; impact export --list shows them"),
        (("--list", "--to", "lammps"), "--list: got more than this option, expected it alone"),
        (("--to", "lamps"), '--to: no code "lamps"; did you mean "lammps"?'),
        (("--to", "isaac"), '--to: no code "isaac"; did you mean "physx"?'),
        (("--to", "mujoco", "--model", "hertz"), 'MuJoCo has no law "hertz"; known: mujoco-solref'),
        (("--to", "lammps", "--script", "--at", "m1=inf"), "a script: m1: got inf, expected m2 = inf for a wall"),
        (
            ("--to", "lammps", "--script", "--at", "m2=inf", "--at", "R2=1"),
            "a script: m2: got inf, expected a finite value, or m2 = R2 = inf for a wall",
        ),
        (("--to", "lammps", "--dt", "0"), "--dt: got 0.0, expected a number > 0 s"),
        (("--to", "lammps", "--code-version", "new"), '--code-version: got "new", expected the date of a release'),
        (
            ("--to", "lammps", "--model", "lammps-coeff-restitution-hertz", "--code-version", "29Aug2019"),
            "has no coeff_restitution, expected --code-version 20240601 or later",
        ),
        (
            ("--to", "lammps", "--verify", "--program", "/nowhere"),
            '"/nowhere": no LAMMPS, pair style granular there',
        ),
        (("--to", "lammps", "-o", ""), ".: is not a regular file, and is not modified"),
        (("--to", "lammps", "-o", "/nowhere/in.balls"), "the folder /nowhere does not exist"),
        *(
            (("--to", "mujoco", "--at", f"e={e}"), f"--at e={shown}: sweep.e: got ")
            for e, shown in (("abc", "abc"), ("2", "2.0"), ("nan", "nan"), ("\x1b[31m", "\\x1b[31m"))
        ),
        (("--to", "liggghts", "--at", "e=0.01"), "e: got 0.01, expected 0.05 < e <= 1"),
        (
            ("--to", "lammps", "--model", "tsuji-1992-no-tension", "--code-version", "22Jul2025", "--at", "e=0"),
            "e: got 0, expected e > 0: LAMMPS takes its logarithm",
        ),
        (
            ("--to", "liggghts", "--model", "liggghts-hooke", "--at", "e=0.5", "--at", "vc=0.005"),
            "vc: got 0.005, expected 0.01 m/s or more",
        ),
        (
            ("--to", "liggghts", "--at", "e=0.5", "--set", "materials.table1.nu=-0.2"),
            "nu1: got -0.2, expected 0 or more",
        ),
        (("--to", "liggghts", "--at", "K=1e8"), "expected a material, not K"),
        *(
            (("--to", "lammps", "--code-version", version), f'--code-version: got "{version}", expected the date')
            for version in ("31Feb2025", "99Foo2025", "20259999", "2025.99.99")
        ),
        (("--to", "chrono", "--code-version", f"9.{'9' * 5000}"), "expected a release, such as 10.0.0"),
        (
            ("--to", "yade", "--code-version", "new"),
            '--code-version: got "new", expected a release such as 2023.02a',
        ),
        (("--to", "mujoco", "--at", "e=0.6", "--dt", "0.015"), "expected at most half of timeconst = 0.02"),
        (("--to", "mujoco", "--at", "e=0.6", "--at", "mujoco-solref.dampratio=1"), "expected one of the two"),
        (
            ("--to", "drake", "--model", "drake-point-contact-mixed", "--at", "e=0.9"),
            "drake-point-contact-mixed deliv",
        ),
    ],
)
def test_bad_input_is_one_line(cli: Run, words: tuple[str, ...], message: str) -> None:
    assert_refused(cli("export", *words), message)


# ---- text of the caller is no code

HOSTILE = (
    '\nopen("PWNED", "w")\n#',
    "\rPWNED",
    '"PWNED',
    "'PWNED",
    "-->PWNED<!--",
    "*/PWNED",
    "#PWNED",
    "%PWNED",
    "\x1b[31mPWNED",
    "\u2028PWNED",
    "\u202ePWNED",
    "\\\nPWNED",
    " &\nPWNED",
    "$(PWNED)",
)


@pytest.mark.parametrize("name", CODES)
def test_a_release_with_text_that_would_be_code_is_refused(name: str) -> None:
    release = CODES[name].newest
    for version in ("", " ", "x" * 60, "9" * 5000, *HOSTILE, *(release + hostile for hostile in HOSTILE)):
        with pytest.raises(UsageError, match=r"^code_version: got [ -~…]*$"):
            impact.export(name, at={"e": 0.6}, code_version=version)


def test_kratos_gets_the_moduli_of_both_balls() -> None:
    at = {"e": 0.6, "material1": "steel", "material2": "brass"}
    materials = [line for line in impact.export("kratos", at=at).lines if line.startswith("material")]
    assert materials == [
        'material1 = {"YOUNG_MODULUS": 210000000000.0, "POISSON_RATIO": 0.3}',
        'material2 = {"YOUNG_MODULUS": 100000000000.0, "POISSON_RATIO": 0.34}',
    ]


def test_the_oldest_release_of_liggghts_whose_laws_were_read_is_3_0_0() -> None:
    assert impact.export("liggghts", at={"e": 0.6}, code_version="3.0.0").version == "3.0.0"
    with pytest.raises(impact.UsageError, match=r"got 2\.9\.9, expected 3\.0\.0 or later"):
        impact.export("liggghts", at={"e": 0.6}, code_version="2.9.9")


@pytest.mark.parametrize(("R1", "R2"), [(0.005, 0.05), (0.05, 0.005)])
def test_lammps_searches_for_neighbours_within_a_tenth_of_the_smaller_radius(R1: float, R2: float) -> None:
    script = impact.export("lammps", at={"e": 0.6, "R1": R1, "R2": R2}, script=True).script
    assert script is not None
    (skin,) = re.findall(r"^neighbor +(\S+) bin$", script, re.MULTILINE)
    assert float(skin) == pytest.approx(5e-4, rel=1e-12)


@pytest.mark.parametrize("other", [{"R2": 1.0}, {"m2": math.inf}])
def test_kratos_searches_as_far_as_a_large_fast_ball_is_away_at_the_start(other: dict[str, float]) -> None:
    at = {"e": 0.6, "v1": 20.0, "R1": 1.0, **other}
    script = impact.export("kratos", at=at, overrides={"materials.table1.E": 1e8}, script=True).script
    assert script is not None
    tolerances = re.findall(
        r"^ +\"(?:SearchTolerance|search_tolerance_against_walls)\": (\S+),$", script, re.MULTILINE
    )
    (x1,) = re.findall(r"^1 (\S+) 0 0$", script, re.MULTILINE)
    assert len(tolerances) == 1 + ("m2" in other)
    assert all(float(tolerance) > -float(x1) - 1.0 > 0.01 for tolerance in tolerances)


@pytest.mark.parametrize("materials", [("soft", "soft"), ("soft", "hard")])
def test_a_script_of_yade_makes_the_materials_that_its_balls_have(materials: tuple[str, str]) -> None:
    config = source(*materials) | {"models": default_law("yade")}
    script = impact.export("yade", source=config, script=True).script
    assert script is not None
    made = {*re.findall(r"(material\d) = ", script)}
    assert made == {*re.findall(r"(material\d)\b(?! = )", script)}
    assert len(made) == len({*materials})


def test_the_balls_of_a_script_stay_within_its_box() -> None:
    balls = {"e": 0.6, "v1": 1.0, "v2": -1.0, "m1": 0.1, "m2": 0.1, "R1": 0.01, "R2": 0.01, "K": 1e3}
    script = impact.export("lammps", at=balls, script=True).script
    assert script is not None
    (reach,) = re.findall(r"^region +box block -(\S+) ", script, re.MULTILINE)
    (dt,) = re.findall(r"^timestep +(\S+)", script, re.MULTILINE)
    (steps,) = re.findall(r"^run +(\d+)", script, re.MULTILINE)
    assert float(reach) > 0.02 + 1.0 * float(dt) * int(steps)


@pytest.mark.slow
@pytest.mark.parametrize("name", CODES)
def test_of_the_texts_of_a_caller_only_the_release_is_written(name: str) -> None:
    """Neither the title of a config, nor the name of a material; in the lines and in the script."""
    code = CODES[name]
    hostile = "".join(HOSTILE)
    sweep = BALLS | {"e": 0.6, "material1": hostile, "material2": hostile}
    config = {"title": hostile, "models": default_law(name), "materials": {hostile: SOFT}, "sweep": sweep}
    export = impact.export(
        name,
        source=config,
        at=OWN_PARAMETERS.get(name),
        code_version=code.newest,
        script=bool(code.template),
    )
    for text in {export.text, replace(export, script=None).text}:
        assert code.newest in text.partition("\n")[0]
        assert "PWNED" not in text
        assert text.replace("\n", "").isprintable()


@pytest.mark.parametrize("name", CODES)
def test_a_comment_stays_a_comment_whatever_its_text(name: str) -> None:
    for begin, end in {CODES[name].comment, ("# ", "")}:
        for line, hostile in zip(comment_lines(HOSTILE, begin, end), HOSTILE, strict=True):
            assert line.isprintable(), hostile
            assert line.startswith(begin)
            assert line.endswith(end)
            # XML allows no "--" in a comment
            assert not end or "--" not in line.removeprefix(begin).removesuffix(end)


def test_a_release_that_would_be_code_is_one_line(cli: Run) -> None:
    done = cli(
        "export", "--to", "mujoco", "--at", "e=0.6", "--script", "--code-version", "4.0\x1b\nopen('x', 'w')\n#"
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "--code-version: got \"4.0\\x1b\\x0aopen('x', 'w')\\x0a#\", expected a release, such as 4.0.0\n"
    )


@pytest.mark.parametrize("reported", ["4.0.0\\nopen('PWNED')", "4.0.0\\033[31m", "4.0.0 -->"])
def test_a_release_that_a_program_reports_is_refused_too(tmp_path: Path, reported: str) -> None:
    python = write_program(tmp_path / "python", f'printf "{reported}"')
    with pytest.raises(UsageError, match=r"^version of [ -~]*: got [ -~]*, expected a release, such as 4.0.0$"):
        impact.export("mujoco", at={"e": 0.6}, program=str(python))


# ---- a program that stands in for LAMMPS: it reports a release, and runs a script by other commands

RELEASE = 'case $1 in -help) echo "Parallel Simulator - 22 Jul 2025"; exit;; esac\n'
LAMMPS = ("export", "--to", "lammps", "--at", "e=0.6", "--at", "v1=1", "--verify", "--program")


def lammps_that_prints(folder: Path, values: Sequence[object]) -> Path:
    """A program that prints one restitution after the other."""
    (folder / "values").write_text("".join(f"{value}\n" for value in values), encoding="utf-8")
    run = 'cd "${0%/*}"; echo "e_out = $(head -n 1 values)"; sed -i 1d values'
    return write_program(folder / "lmp", RELEASE + run)


@pytest.fixture(scope="module")
def predicted(tmp_path_factory: pytest.TempPathFactory) -> tuple[float, ...]:
    """What --verify predicts at the four phases."""
    program = lammps_that_prints(tmp_path_factory.mktemp("predicted"), [0.5] * 4)
    verification = impact.export(
        "lammps", at={"e": 0.6, "v1": 1.0}, verify=True, program=str(program)
    ).verification
    assert verification is not None
    assert verification.measured == (0.5,) * 4
    return tuple(verification.predicted)


@pytest.mark.slow
def test_verify_exits_with_0_for_the_predicted_restitutions_and_with_1_for_others(
    cli: Run, tmp_path: Path, predicted: tuple[float, ...]
) -> None:
    agreeing = cli(*LAMMPS, lammps_that_prints(tmp_path, predicted))
    assert (agreeing.returncode, agreeing.stderr) == (0, "")
    headline, empty, *_, verdict = agreeing.stdout.splitlines()
    assert headline == "lammps 20250722, lammps-coeff-restitution-hertz, 50 steps per contact"
    assert (empty, verdict) == ("", "agrees: largest difference 0, uncertainty 1e-09")
    others = (*predicted[:2], predicted[2] + 1e-8, predicted[3])
    differing = cli(*LAMMPS, lammps_that_prints(tmp_path, others))
    assert (differing.returncode, differing.stderr) == (1, "")
    *_, first, second, third, fourth, _, verdict = differing.stdout.splitlines()
    assert verdict == "DIFFERS: largest difference 1e-08, uncertainty 1e-09"
    assert [row.split()[-1] for row in (first, second, third, fourth)] == ["0", "0", "1e-08", "0"]


@pytest.mark.slow
def test_without_slip_the_header_has_no_beta() -> None:
    export = impact.export("newton", friction="coulomb-1785", at={"e": 0.6, "mu": 0.2, "angle": 0.0})
    assert "friction: coulomb-1785, no beta without slip" in export.header


def test_with_friction_the_rows_have_the_tangential_restitution_as_well() -> None:
    normal = Verification("LAMMPS", (1e-6,) * 2, (0.25, 0.75), (0.5, 0.6), (0.5, 0.6), 1e-9)
    oblique = replace(normal, beta_measured=(0.1, 0.2), beta_predicted=(0.1, 0.3))
    rows = [dict(row) for row in normal.records()]
    rows[0] |= {"beta_measured": 0.1, "beta_predicted": 0.1}
    rows[1] |= {"beta_measured": 0.2, "beta_predicted": 0.3}
    assert oblique.as_dict()["rows"] == rows


def test_verify_runs_the_script_that_is_exported(tmp_path: Path) -> None:
    """The program prints the number of its lines."""
    program = write_program(tmp_path / "lmp", RELEASE + 'echo "e_out = $(wc -l < "$2")"')
    export = impact.export("lammps", at={"e": 0.6}, verify=True, script=True, program=str(program))
    assert export.verification is not None
    # a comment comes before it
    lines = sum(not line.startswith("#") for line in export.script.splitlines())
    assert export.verification.measured == (lines,) * 4


def test_a_program_with_open_mpi_starts_no_daemon_which_would_outlive_it(tmp_path: Path) -> None:
    program = write_program(tmp_path / "lmp", RELEASE + 'echo "e_out = 0.$OMPI_MCA_ess_singleton_isolated"')
    verification = impact.export("lammps", at={"e": 0.6}, verify=True, program=str(program)).verification
    assert verification is not None
    assert verification.measured == (0.1,) * 4


def test_verify_allows_for_the_rounding_of_coordinates_where_the_indentation_is_small(tmp_path: Path) -> None:
    """LAMMPS of 22 July 2025 differs by 6e-9 at this speed, with the balls of Table 1 of the paper."""
    program, at = lammps_that_prints(tmp_path, [0.5] * 4), {"e": 0.6, "v1": 1e-6, "R1": 0.05, "R2": 0.04}
    verification = impact.export("lammps", at=at, verify=True, program=str(program)).verification
    assert verification is not None
    peak = impact.run(model=default_law("lammps"), at=at).values["peak_indentation"]
    rounding = 2.0**-52 * 0.05 / peak
    assert verification.uncertainty == pytest.approx(10.0 * rounding, rel=1e-9)


@pytest.mark.slow
def test_the_tolerance_on_beta_is_four_indentations_over_the_effective_radius_and_a_turn(tmp_path: Path) -> None:
    """The normal of two balls turns, which adds a part of the speed to the slip; that of a wall does not.

    The beta of LAMMPS of 22 July 2025 differs by 0.019 at 80 degrees, with the balls of Table 1 of the paper.
    """
    program = write_program(tmp_path / "lmp", RELEASE + 'echo "beta = 0.5"; echo "e_out = 0.6"')

    def verify(angle: float, **inputs: float) -> tuple[Verification, float]:
        laws = {"models": default_law("lammps"), "frictions": "lammps-mindlin"}
        config = source("soft", "soft", v1=0.5, mu=0.3, angle=angle, **inputs) | laws
        verification = impact.export("lammps", source=config, verify=True, program=str(program)).verification
        assert verification is not None
        result = impact.sweep(config)
        turn = 0.5 * math.tan(angle) * result["contact_time"].item() / (BALLS["R1"] + BALLS["R2"])
        return verification, max(result["peak_indentation"].item() / 0.03, turn / 4.0)

    for angle in (0.1, 0.8, 1.5):
        balls, indentation = verify(angle)
        assert balls.beta_measured == (0.5,) * 4
        assert balls.uncertainty == pytest.approx(4.0 * indentation / math.cos(angle), rel=1e-9)
        # beta is a ratio of slips: the smaller the slip, the larger the tolerance
        assert balls.beta_uncertainty == pytest.approx(4.0 * indentation / math.sin(angle), rel=1e-9)
    wall, _ = verify(0.1, R2=math.inf, m2=math.inf)
    assert wall.beta_uncertainty == wall.uncertainty == 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("release", "radius"), [("2020.01a", 0.02), ("2023.02a", 0.04)])
def test_the_normal_of_a_wall_of_yade_does_not_turn(tmp_path: Path, release: str, radius: float) -> None:
    """A wall of the older release has an R* of half the radius of the ball."""
    run = f'case $1 in --version) echo {release}; exit;; esac; echo "beta = 0"; echo "e_out = 0.5"'
    program = write_program(tmp_path / "yade", run)
    laws = {"models": "yade-betan", "frictions": "yade-mindlin"}
    config = source("soft", "soft", mu=0.3, angle=1.5, **WALL) | laws
    verification = impact.export("yade", source=config, verify=True, program=str(program)).verification
    assert verification is not None
    at = {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": math.inf, "R1": 2.0 * radius, "R2": 2.0 * radius}
    overrides = {"materials.soft": SOFT, "sweep.material": "soft"}
    peak = impact.run(model="yade-betan", at=at, overrides=overrides).values["peak_indentation"]
    assert verification.beta_uncertainty == pytest.approx(4.0 * peak / radius / math.sin(1.5), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("error", "verdict"), [(0.0, "UNDECIDED"), (-0.002, "agrees"), (0.002, "DIFFERS")])
def test_what_the_turn_of_the_normal_explains_at_a_grazing_impact_is_undecided(
    tmp_path: Path, error: float, verdict: str
) -> None:
    """What LAMMPS of 29 September 2021 prints: its normal turns by 0.0011 rad, and 0.0026 of beta with it."""
    measured = (0.9564011, 0.9563275, 0.9562544, 0.9561820), (-0.1553312, -0.1553630, -0.1550527, -0.1542641)
    rows = (f"{e} {beta - error}\n" for e, beta in zip(*measured, strict=True))
    (tmp_path / "values").write_text("".join(rows))
    run = 'cd "${0%/*}"; read e beta < values; echo "beta = $beta"; echo "e_out = $e"; sed -i 1d values'
    program = write_program(tmp_path / "lmp", RELEASE + run)
    law, friction = "lammps-tsuji-hooke-without-root", "lammps-linear-history"
    at = {"K": 1e7, "R1": 1e-3, "R2": 1e-3, "m1": 1e-5, "m2": 1e-5, "speed": 1.0, "angle": "80 deg", "e": 0.95}
    at |= {"mu": 0.7, f"friction.{friction}.kt_over_kn": 0.2857}
    export = impact.export("lammps", law, friction=friction, at=at, verify=True, program=str(program))
    verification = export.verification
    assert verification is not None
    assert verification.beta_difference == pytest.approx(0.00255 + error, abs=1e-5)
    text = "\n".join(str(verification).split("\n")[-2:])
    assert f"{verdict}: " in text
    assert ("the normal of two balls turns" in text) == (verdict == "UNDECIDED")
    assert (verification.agrees, verification.differs) == (verdict == "agrees", verdict == "DIFFERS")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("modulus", "measured", "verdict", "exit_code"),
    [
        ("5 GPa", 0.9, "agrees", 0),
        ("5 MPa", 0.9, "UNDECIDED", 0),
        ("5 MPa", 0.1, "DIFFERS", 1),
    ],
)
def test_an_uncertainty_with_which_no_script_could_fail_does_not_agree(
    cli: Run, tmp_path: Path, modulus: str, measured: float, verdict: str, exit_code: int
) -> None:
    """The normal of soft balls turns by 0.1 rad while they touch."""
    config = tmp_path / "balls.toml"
    config.write_text(
        'models = "lammps-coeff-restitution-hertz"\nfrictions = "lammps-mindlin"\n'
        f'[materials.glass]\nE = "{modulus}"\nnu = 0.22\nrho = 2500\n'
        '[sweep]\nmaterial = "glass"\nR1 = "1 mm"\nR2 = "1 mm"\n'
        'speed = "1 m/s"\nangle = "45 deg"\nmu = 0.15\nomega1 = 500\ne = 0.9\n',
        encoding="utf-8",
    )
    beta = impact.export("lammps", source=config).at_dt.beta_mean
    program = write_program(tmp_path / "lmp", RELEASE + f'echo "beta = {beta}"; echo "e_out = {measured}"')
    command = ("export", config, "--to", "lammps", "--verify", "--program", program)
    done = cli(*command)
    assert done.returncode == exit_code
    assert f"\n{verdict}: largest difference" in done.stdout
    explanation = "\nan uncertainty above 0.05 shows nothing: the normal of two balls turns while they touch; try "
    assert (explanation in done.stdout) == (verdict == "UNDECIDED")
    verification = json.loads(cli(*command, "--json").stdout)["verification"]
    assert (verification["agrees"], verification["differs"]) == (verdict == "agrees", verdict == "DIFFERS")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "run"), [("lammps", r"^run +(\d+)$"), ("mujoco", r"^mujoco.mj_step\(model, data, (\d+)\)$")]
)
def test_a_script_runs_until_two_contact_times_after_the_first_contact(code: str, run: str) -> None:
    """The balls begin up to three steps before the contact."""
    contact_time = impact.export(code, at={"e": 0.5}).as_dict()["contact_time"]
    for steps_per_contact in (7, 100):
        script = impact.export(code, at={"e": 0.5}, dt=contact_time / steps_per_contact, script=True).script
        (steps,) = re.findall(run, script, re.MULTILINE)
        assert 3 + 2 * steps_per_contact <= int(steps) <= 3 + 3 * steps_per_contact


def test_a_script_of_an_impact_with_hardly_any_rebound_runs_until_the_end_of_its_contact() -> None:
    """At 7 steps per contact the pull of the dashpot holds the balls for up to 25 steps."""
    law, at = "lammps-coeff-restitution-hooke", {"e": 0.051, "K": 1e6}
    step = impact.timestep(law, at=at, steps_per_contact=[7]).rows[0].dt
    export = impact.export("lammps", law, at=at, dt=step, script=True, code_version="22Jul2025")
    (steps,) = re.findall(r"^run +(\d+)$", str(export.script), re.MULTILINE)
    steps_and_phases = {"steps_per_contact": 7.0, "phase": {"linspace": [0.01, 1, 100]}}
    sweep = {**at, "n": 1.0, "m1": 1.0, "m2": 1.0, "v1": 1.0, **steps_and_phases}
    result = impact.sweep({"models": law, "sweep": sweep, "solver": {"integrator": "kick-drift"}})
    assert int(steps) > 3 + result["steps"].values.max() > 3 + 2.5 * 7


@pytest.mark.slow
@pytest.mark.parametrize(("phase", "value"), list(enumerate(["nan", "inf", "-nan", "nan"])))
def test_a_restitution_that_is_no_number_differs_at_any_phase(
    tmp_path: Path, predicted: tuple[float, ...], phase: int, value: str
) -> None:
    program = lammps_that_prints(tmp_path, [*predicted[:phase], value, *predicted[phase + 1 :]])
    verification = impact.export(
        "lammps", at={"e": 0.6, "v1": 1.0}, verify=True, program=str(program)
    ).verification
    assert verification is not None
    assert not verification.agrees
    assert f"at the phase {(phase + 0.5) / 4} of dt" in verification.not_numbers


@pytest.mark.slow
def test_verify_exits_with_1_and_names_the_phase_of_a_restitution_that_is_no_number(
    cli: Run, tmp_path: Path, predicted: tuple[float, ...]
) -> None:
    program = lammps_that_prints(tmp_path, [predicted[0], "nan", "nan", "nan"])
    done = cli(*LAMMPS, program)
    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.splitlines()[-1].startswith(
        "DIFFERS: at the phase 0.375 of dt = 6.31676e-06 s e_out is nan, "
    )
    lammps_that_prints(tmp_path, [predicted[0], "nan", "nan", "nan"])
    data = json.loads(cli(*LAMMPS, program, "--json").stdout)["verification"]
    assert (data["agrees"], data["rows"][1]["measured"]) == (False, None)


@pytest.mark.slow
def test_with_friction_only_two_balls_may_differ_by_the_turn_of_their_normal(tmp_path: Path) -> None:
    law, friction = "lammps-coeff-restitution-hooke", "lammps-linear-history"
    at = {"mu": 0.3, "angle": "40 deg", "v1": 1.0, "e": 0.8, "R1": 0.05, "K": 1e9, f"friction.{friction}.k_t": 1e9}
    uncertainties, betas = [], []
    for other in ({"R2": 0.05}, {"m2": math.inf}):
        program = str(lammps_that_prints(tmp_path, [0.5] * 4))
        export = impact.export("lammps", law, at=at | other, friction=friction, verify=True, program=program)
        assert export.verification is not None
        uncertainties.append(export.verification.uncertainty)
        betas.append(export.verification.beta_uncertainty)
    # the normal turns by about the indentation over R*
    both = impact.run(model=law, friction=friction, at=at | {"R2": 0.05})
    turn = both.values["peak_indentation"] / 0.025
    assert turn < uncertainties[0] < betas[0] < 10.0 * turn
    assert (uncertainties[1], betas[1]) == (1e-9, 1e-9)


@pytest.mark.parametrize(
    ("means", "exact"),
    [
        *(
            [[0.5 + 0.016 * 2.0 ** (-order * halved) for halved in range(3)], 0.5]
            for order in (0.7, 1.0, 1.5, 2.0, 3.0)
        ),
        # EXUDYN, exudyn-carvalho-gonthier at e = 0.2 and 0.25: another order from h to h/2 than from h/2 to h/4
        ([0.20468863, 0.2046397, 0.20461688], 0.20460905),
        ([0.25538557, 0.25528339, 0.25524083], 0.25522753),
    ],
)
def test_the_uncertainty_of_an_extrapolation_covers_its_error(means: list[float], exact: float) -> None:
    value, uncertainty = extrapolate(np.array(means)[:, None])
    assert abs(value - exact) <= uncertainty <= 2.0 * abs(means[0] - exact)


def test_a_code_without_a_scheme_that_measures_no_number_differs(tmp_path: Path) -> None:
    """The stand-in of a Python with openseespy; nothing is extrapolated from what is no number."""
    python = write_program(tmp_path / "python", 'case $1 in -c) echo 3.7.1.2;; *) echo "e_out = nan";; esac')
    at = {"e": 0.6, "v1": 1.0}
    verification = impact.export("opensees", at=at, verify=True, program=str(python)).verification
    assert verification is not None
    assert not verification.agrees
    assert len(verification.measured) == 12
    # at a step, its half and its quarter
    assert verification.dt == tuple(verification.dt[0] / part for part in (1, 2, 4) for _ in range(4))
    assert verification.not_numbers.startswith("at the phase 0.125 of dt")


def test_a_code_without_a_scheme_that_measures_another_restitution_differs(tmp_path: Path) -> None:
    """The stand-in of a Python with openseespy; a restitution at every step has no uncertainty."""
    python = write_program(tmp_path / "python", 'case $1 in -c) echo 3.7.1.2;; *) echo "e_out = 0.9";; esac')
    export = impact.export("opensees", at={"e": 0.6, "v1": 1.0}, verify=True, program=str(python))
    assert export.verification is not None
    assert (export.verification.measured, export.verification.agrees) == ((0.9,), False)
    # a number of the first run alone is not extrapolated
    first = f'[ -e {tmp_path}/ran ] && echo "e_out = nan" || {{ touch {tmp_path}/ran; echo "e_out = 0.6"; }}'
    write_program(python, f"case $1 in -c) echo 3.7.1.2;; *) {first};; esac")
    export = impact.export("opensees", at={"e": 0.6, "v1": 1.0}, verify=True, program=str(python))
    assert export.verification is not None
    assert len(export.verification.measured) == 12


@pytest.mark.slow
@pytest.mark.parametrize(
    ("run", "message"),
    [
        ("echo e_out = abc", "ended with exit code 0: e_out = abc"),
        ("echo e_out = 0.6; echo more", "ended with exit code 0: more"),
        ("", "ended with exit code 0: no output"),
        ("echo e_out = 0.6; exit 3", "ended with exit code 3: e_out = 0.6"),
        (
            "echo 'ERROR: no\033[31m such fix' >&2; echo last >&2; exit 1",
            "exit code 1: ERROR: no\\x1b[31m such fix",
        ),
        ("printf 'e_out = \\377'", "ended with exit code 0: e_out = "),
        ("kill -9 $$", "ended with exit code -9: no output"),
        ("yes", "stopped after it printed 64 MiB"),
        ("yes >&2", "stopped after it printed 64 MiB"),
    ],
)
def test_a_script_that_fails_is_one_line(cli: Run, tmp_path: Path, run: str, message: str) -> None:
    done = cli(*LAMMPS, write_program(tmp_path / "lmp", RELEASE + run))
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    # LAMMPS of a few thousand bytes or of gigabytes takes the same memory
    assert done.memory < 500 * 2**20


def wait_until_ended(pid: str) -> None:
    """A killed process ends a moment later."""
    status = Path("/proc", pid, "stat")

    def runs() -> bool:
        try:
            return status.read_text(encoding="utf-8").split()[2] != "Z"
        except (FileNotFoundError, ProcessLookupError):
            return False

    # it would sleep for a minute
    end = time.monotonic() + 10.0
    while runs() and time.monotonic() < end:
        time.sleep(0.01)
    assert not runs()


@pytest.mark.slow
def test_a_script_that_does_not_end_is_stopped(tmp_path: Path) -> None:
    """With what a wrapper has started."""
    command = ["/bin/sh", "-c", "sleep 60 & echo $! > pid; wait"]
    with pytest.raises(subprocess.SubprocessError, match=r"^stopped after 0\.5 s$"):
        run_program(command, str(tmp_path), 0.5)
    pid = (tmp_path / "pid").read_text(encoding="utf-8").strip()
    wait_until_ended(pid)


@pytest.mark.slow
def test_a_script_ends_with_the_command_that_is_terminated(tmp_path: Path) -> None:
    """A script runs in another session, which a signal to the group of the command does not reach."""
    program = write_program(
        tmp_path / "lmp", RELEASE + f"echo $$ > {tmp_path}/part; mv {tmp_path}/part {tmp_path}/pid; sleep 60"
    )
    words = [sys.executable, "-m", "impact", *LAMMPS, str(program)]
    (tmp_path / "folders").mkdir()
    env = os.environ | {"TMPDIR": str(tmp_path / "folders")}
    command = subprocess.Popen(words, env=env, stderr=subprocess.PIPE, text=True)
    while not (tmp_path / "pid").exists():
        assert command.poll() is None
        time.sleep(0.01)
    command.terminate()
    _, stderr = command.communicate(timeout=60)
    assert (command.returncode, stderr) == (143, "terminated; stopped immediately\n")
    wait_until_ended((tmp_path / "pid").read_text(encoding="utf-8").strip())
    assert not [*(tmp_path / "folders").iterdir()]


def test_a_signal_that_the_caller_ignores_stays_ignored_and_another_thread_handles_none() -> None:
    program = """
import contextlib, signal, sys, threading
from impact.cli.main import main
sys.argv = ["impact", "--version"]
def run():
    with contextlib.suppress(SystemExit):
        main()
thread = threading.Thread(target=run)
thread.start()
thread.join()
assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
signal.signal(signal.SIGTERM, signal.SIG_IGN)
run()
assert signal.getsignal(signal.SIGTERM) == signal.SIG_IGN
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("impact") == 2


@pytest.mark.parametrize("reported", ["31 Feb 2025", "99 Foo 2025"])
def test_a_program_that_reports_no_release_is_one_line(cli: Run, tmp_path: Path, reported: str) -> None:
    lmp = write_program(tmp_path / "lmp", f'echo "Parallel Simulator - {reported}"')
    done = cli("export", "--to", "lammps", "--at", "e=0.6", "--program", lmp)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f'version of {lmp}: got "{reported}", expected the date of a release, such as 22Jul2025\n'
    )
    code = CODES["lammps"]
    assert code.program is not None
    assert installed_version(replace(code, program=replace(code.program, name=str(lmp)))) is None


@pytest.mark.slow
@pytest.mark.parametrize(("code", "e"), [("mujoco", 0.9), ("liggghts", 0.5)])
def test_the_step_that_is_recommended_is_small_enough_as_it_is_printed(cli: Run, code: str, e: float) -> None:
    """It has three digits, rounded down; rounded to the nearest, both would be too long."""
    done = cli("export", "--to", code, "--at", f"e={e}", "--at", "v1=1")
    dt = float(re.findall(r"recommended: dt <= (\S+) s", done.stdout)[0])
    (row,) = impact.timestep(default_law(code), at={"e": e, "v1": 1.0}, dt=[dt]).rows
    assert max(row.e_largest - e, e - row.e_least) <= 0.01 * e


EXAMPLES = examples_of("docs/export.md")


@pytest.mark.slow
@pytest.mark.parametrize(("command", "printed"), [pytest.param(*example, id=example[0]) for example in EXAMPLES])
def test_the_page_prints_what_the_commands_print(cli: Run, command: str, printed: str) -> None:
    done = cli(*shlex.split(command))
    assert_same_output(done.stdout + done.stderr, printed)


def test_the_list_of_codes_leaves_no_file_in_the_folder(cli: Run, tmp_path: Path) -> None:
    """LIGGGHTS, if it is installed, writes a log when it is asked for its version."""
    assert cli("export", "--list", cwd=tmp_path).returncode == 0
    assert list(tmp_path.iterdir()) == []


def test_the_page_has_an_example_of_each_code() -> None:
    shown = {word for command, _ in EXAMPLES for word in re.findall(r"--to (\S+)", command)}
    assert shown == CODES.keys()


OBLIQUE = {"mu": 0.3, "angle": "40 deg", "v1": 1.0, "e": 0.8, "m1": 1.0, "m2": math.inf, "R1": 0.05}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("friction", "parameters", "expected"),
    [
        ("lammps-linear-history", {"k_t": 2e5, "xt": 0.5}, "linear_history 200000.0 0.5 0.3"),
        # k_t = kappa K for n = 1
        ("lammps-linear-history", {"kt_over_kn": 0.25}, "linear_history 2500000.0 1.0 0.3"),
        ("lammps-linear-nohistory", {"xt": 0.5}, "linear_nohistory 0.5 0.3"),
        ("lammps-mindlin", {}, "mindlin NULL 1.0 0.3"),
        # the coefficient is per contact radius, k_t/sqrt(R*)
        ("lammps-mindlin-rescale", {"k_t": 1e9, "xt": 0.0}, f"mindlin_rescale {1e9 / math.sqrt(0.05)} 0.0 0.3"),
    ],
)
def test_lammps_takes_the_numbers_of_a_friction_law(
    friction: str, parameters: dict[str, float], expected: str
) -> None:
    is_linear = friction.startswith("lammps-linear")
    key = "lammps-coeff-restitution-hooke" if is_linear else "lammps-coeff-restitution-hertz"
    stiffness = {"K": 1e7} if is_linear else {}
    at = {**OBLIQUE, **stiffness, **{f"friction.{friction}.{name}": value for name, value in parameters.items()}}
    export = impact.export("lammps", key, at=at, friction=friction, code_version="22Jul2025", script=True)
    (line,) = (line for line in export.lines if "tangential" in line)
    assert f" tangential {expected} xplane" in line
    assert not any("no friction" in remark for remark in export.header)
    assert export.as_dict()["beta_at_dt"]["mean"] == pytest.approx(export.beta_continuous, abs=0.2)
    assert "omega 0 0 0.0" in str(export.script)


def test_the_lines_for_liggghts_say_which_properties_their_wall_has() -> None:
    ball, wall = (
        impact.export("liggghts", "liggghts-hertz", source=source("soft", "hard", **change), code_version="3.8.0")
        for change in ({}, WALL)
    )
    remark = "the wall has the properties of type 2"
    assert (remark in ball.header, remark in wall.header) == (False, True)


@pytest.mark.parametrize("code", [code for code in CODES.values() if code.program is not None])
def test_a_program_that_runs_scripts_says_how_to_install_it(code: Code) -> None:
    assert code.program is not None
    assert "install" in code.program.install
    assert "install" not in code.program.name


def test_the_tangential_stiffness_of_two_materials_is_a_number_in_lammps() -> None:
    config = source("soft", "hard", mu=0.3, angle="40 deg")
    export = impact.export(
        "lammps", default_law("lammps"), source=config, friction="lammps-mindlin", code_version="22Jul2025"
    )
    # 1/G* = (2 - nu1)/G1 + (2 - nu2)/G2 with G = E/(2 (1 + nu))
    shear = 1.0 / (2.0 * (2.0 - 0.3) * 1.3 / 1e9 + 2.0 * (2.0 - 0.2) * 1.2 / 5e9)
    assert export.parameters["k_t"] == pytest.approx(8.0 * shear, rel=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "friction", "parameters", "expected"),
    [
        ("liggghts-hooke", "liggghts-history", {}, "hooke tangential history"),
        ("liggghts-hooke", "liggghts-history", {"tangential_reduce": "on"}, "history ktToKnUser on"),
        # only model hooke has that setting
        ("liggghts-hertz", "liggghts-history", {"tangential_reduce": "on"}, "hertz tangential history"),
        (
            "liggghts-hertz-limit-force",
            "liggghts-no-history",
            {"tangential_damping": "off"},
            "tangential no_history limitForce on tangential_damping off",
        ),
    ],
)
def test_liggghts_takes_the_settings_of_a_friction_law(
    key: str, friction: str, parameters: dict[str, str], expected: str
) -> None:
    config = source("soft", "soft", mu=0.3, angle="40 deg") | {"friction": {friction: parameters}}
    export = impact.export("liggghts", key, source=config, friction=friction, code_version="3.8.0", script=True)
    (line,) = (line for line in export.lines if line.startswith("pair_style"))
    assert line.endswith(expected)
    assert export.parameters["coefficientFriction"] == "peratomtypepair 2 0.3 0.3 0.3 0.3"
    assert not any("no friction" in remark for remark in export.header)
    alternates = friction == "liggghts-history"
    assert any("3 of 240 runs differed by up to 0.02" in text for text in export.warnings) == alternates
    ratio = config | {"friction": {friction: {"kt_over_kn": 0.5}}}
    with pytest.raises(UsageError, match="kt_over_kn: LIGGGHTS has none"):
        impact.export("liggghts", key, source=ratio, friction=friction, code_version="3.8.0")


@pytest.mark.slow
def test_yade_takes_the_tangential_springs_of_each_ball_and_an_angle_of_friction() -> None:
    key = "yade-viscoelastic"
    at = {"K": 1e6, f"{key}.C": 30.0, "mu": 0.3, "angle": "40 deg"}
    own = {f"friction.{key}.k_t": 3e5, f"friction.{key}.c_t": 20.0}
    export = impact.export("yade", key, source=source(), at=at | own, friction=key, code_version="2023.02a")
    assert (export.parameters["ks"], export.parameters["cs"]) == (6e5, 40.0)
    assert math.tan(float(export.parameters["frictionAngle"])) == pytest.approx(0.3, rel=1e-15)
    assert f"frictionAngle={math.atan(0.3)!r})" in export.lines[0]
    ratio = {f"friction.{key}.kt_over_kn": 0.25}
    again = impact.export("yade", key, source=source(n=1.0), at=at | ratio, friction=key, code_version="2023.02a")
    assert again.parameters["ks"] == 5e5
    mindlin = source("soft", "hard", mu=0.3, angle="40 deg") | {"friction": {"yade-mindlin": {}}}
    export = impact.export("yade", "yade-betan", source=mindlin, friction="yade-mindlin", code_version="2023.02a")
    # by default that of the contact force
    assert export.parameters["betas"] == export.parameters["betan"]
    assert sum("frictionAngle=0.29" in line for line in export.lines) == 2
    assert not any("frictionAngle=0:" in remark for remark in export.header)
    with pytest.raises(UsageError, match="k_t: YADE has none with its MindlinPhys"):
        impact.export("yade", "yade-betan", source=mindlin | {"friction": {"yade-mindlin": {"k_t": 1e8}}},
                      friction="yade-mindlin", code_version="2023.02a")  # fmt: skip
    with pytest.raises(UsageError, match='YADE has no "yade-mindlin" with yade-en, but with yade-betan'):
        impact.export("yade", "yade-en", source=mindlin, friction="yade-mindlin", code_version="2023.02a")


def test_drake_takes_coulomb_friction_with_tamsi() -> None:
    at = {"K": 1e6, "mu": 0.3, "angle": "40 deg", "v1": 2.0, "drake-point-contact.d": 0.5}
    key, version = "drake-point-contact", "1.51.1"
    export = impact.export("drake", key, at=at, friction="coulomb-1785", code_version=version)
    assert "    friction=CoulombFriction(0.3, 0.3)," in export.lines
    assert export.lines[-1] == "plant.set_stiction_tolerance(2e-05)"
    assert any("SAP from 0.114 to 0.826" in text for text in export.warnings)
    assert not any("no friction" in remark for remark in export.header)
    with pytest.raises(UsageError, match='Drake has no "drake-regularized"; known: coulomb-1785'):
        impact.export("drake", key, at=at, friction="drake-regularized", code_version=version)
    straight = {name: value for name, value in at.items() if name not in ("mu", "angle")}
    central = impact.export("drake", key, at=straight, code_version=version)
    assert "    friction=CoulombFriction(0.0, 0.0)," in central.lines
    assert not any("stiction" in line for line in central.lines)


@pytest.mark.parametrize(("key", "solref"), [("mujoco-solref", "0.02 0.07"), ("mujoco-solref-direct", "-1e6 -80")])
def test_mujoco_takes_the_cone_of_a_pair_of_geoms(key: str, solref: str) -> None:
    law, version = "mujoco-elliptic", "4.0.0"
    numbers = [abs(float(word)) for word in solref.split()]
    own = dict(zip(("timeconst", "dampratio") if key == "mujoco-solref" else ("k", "b"), numbers, strict=True))
    at = {name: value for name, value in OBLIQUE.items() if name != "e"} | own
    cone = at | {"b_t": 4000.0, "impratio": 4.0, "impedance": 0.8}
    export = impact.export("mujoco", key, at=cone, friction=law, code_version=version)
    assert export.parameters["solreffriction"] == "-1 -4000.0"
    assert export.parameters["solimp"] == "0.8 0.8 0.001 0.5 2"
    assert 'cone="elliptic" impratio="4.0"/>' in export.lines[0]
    assert 'friction="0.3 0.3 0 0 0"' in export.lines[2]
    # friction changes the restitution, and no step delivers that of the continuous law
    assert export.scheme == "mujoco-cone"
    assert abs(export.at_dt.e_mean - export.e_continuous) > 0.05
    assert not any("recommended" in remark for remark in export.header)
    assert math.isnan(export.beta_continuous)
    assert export.warnings == ()
    # unset, solreffriction is that of solref
    unset = impact.export("mujoco", key, at=at, friction=law, code_version=version)
    assert unset.parameters["solreffriction"] == "0 0"
    assert any("kept 0.62 of its slip" in text for text in unset.warnings)
    central = impact.export("mujoco", key, at={**own, "v1": 1.0}, code_version=version)
    assert (central.scheme, central.warnings) == ("kick-drift", ())
    assert not any("pair" in line for line in central.lines)
    with pytest.raises(UsageError, match='MuJoCo has no "coulomb-1785"; known: mujoco-elliptic'):
        impact.export("mujoco", key, at=at, friction="coulomb-1785", code_version=version)


@pytest.mark.slow
def test_pybullet_takes_the_root_of_a_coefficient_and_newton_a_friction_that_stops_the_slip_in_a_step() -> None:
    at = {"K": 1e6, "mu": 0.3, "angle": "40 deg", "v1": 1.0, "m1": 1.0, "m2": 3.0, "R1": 0.05, "R2": 0.08}
    law, friction = "kelvin-voigt-no-tension", "coulomb-1785"
    export = impact.export("pybullet", law, at=at | {"C": 60.0}, friction=friction, code_version="3.2.7")
    assert f"lateralFriction={math.sqrt(0.3)!r}" in export.lines[2]
    assert (export.scheme, export.parameters["lateralFriction"]) == ("pybullet", math.sqrt(0.3))
    central = impact.export("pybullet", law, at={"K": 1e6, "C": 60.0}, code_version="3.2.7")
    assert "lateralFriction=0," in central.lines[3]
    # the restitution is that without friction
    without = impact.export("pybullet", law, at={**at, "C": 60.0, "mu": 0.0}, friction=friction,
                            code_version="3.2.7")  # fmt: skip
    assert export.at_dt.e_mean == without.at_dt.e_mean
    assert without.at_dt.beta_mean == -1.0
    export = impact.export("newton", at=at | {"kd": 60.0}, friction=friction, dt=1e-4, code_version="1.8.0")
    # m_t of solid balls is 2/7 of the effective mass
    assert export.parameters["kf"] == pytest.approx(2.0 / 7.0 * 0.75 / 1e-4, rel=1e-14)
    assert export.lines[0].endswith(f"kf={export.parameters['kf']!r}, mu=0.3)")
    assert "kf" not in impact.export("newton", at={"K": 1e6, "kd": 60.0}, code_version="1.8.0").parameters
    # a plane of finite mass does not turn: 1/m_t = 7/2 + 1/3
    plane = at | {"kd": 60.0, "R2": math.inf}
    export = impact.export("newton", at=plane, friction=friction, dt=1e-4, code_version="1.8.0")
    assert export.parameters["kf"] == pytest.approx(6.0 / 23.0 / 1e-4, rel=1e-14)
    for name in ("pybullet", "newton"):
        with pytest.raises(UsageError, match='has no "drake-regularized"; known: coulomb-1785'):
            impact.export(name, at=at, friction="drake-regularized", code_version=CODES[name].newest)


@pytest.mark.parametrize("m2", [4e-8, math.inf])
def test_a_ball_that_pybullet_never_turns_is_refused(m2: float) -> None:
    at = {"K": 1e5, "kelvin-voigt-no-tension.C": 0.0, "mu": 0.3, "angle": "40 deg", "m1": 4e-8, "m2": m2}
    export = impact.export("pybullet", at=at | {"R1": 1.2e-4}, friction="coulomb-1785", code_version="3.2.7")
    assert export.friction == "coulomb-1785"
    with pytest.raises(
        UsageError, match=r"R1 and m1: expected a moment of inertia above 2.2e-16 kg m\^2: PyBullet"
    ):
        impact.export("pybullet", at=at | {"R1": 1.1e-4}, friction="coulomb-1785", code_version="3.2.7")


def test_scripts_have_solid_balls() -> None:
    config = source("soft", "soft", mu=0.3, angle="40 deg", inertia_factor2=0.6)
    with pytest.raises(UsageError, match=r"inertia_factor2: got 0\.6, expected 0\.4: balls of scripts are solid"):
        impact.export("liggghts", "liggghts-hertz", source=config, friction="liggghts-history",
                      code_version="3.8.0", script=True)  # fmt: skip


@pytest.mark.slow
def test_friction_that_a_code_does_not_have_is_refused_or_left_out_with_a_warning() -> None:
    at = {**OBLIQUE, "K": 1e7}
    with pytest.raises(
        UsageError, match='LAMMPS, pair style granular has no "lammps-mindln"; did you mean "lammps-'
    ):
        impact.export("lammps", default_law("lammps"), at=at, friction="lammps-mindln", code_version="22Jul2025")
    message = f'{CODES["exudyn"].title} has no "coulomb-1785"; no friction is written for it: none of it was run'
    with pytest.raises(UsageError, match=message) as refusal:
        impact.export("exudyn", at=OBLIQUE, friction="coulomb-1785", code_version=CODES["exudyn"].newest)
    assert "\n" not in str(refusal.value)
    with pytest.raises(UsageError, match='Kratos DEM has no "coulomb-1785"; known: kratos-viscous-coulomb'):
        impact.export("kratos", at=OBLIQUE, friction="coulomb-1785", code_version="10.4.4")
    # no friction law of YADE is combined with its default law
    with pytest.raises(UsageError, match='YADE has no "coulomb-1785"; known: yade-mindlin, yade-viscoelastic'):
        impact.export("yade", at=OBLIQUE, friction="coulomb-1785", code_version="2023.02a")
    known = "known: liggghts-history, liggghts-no-history"
    with pytest.raises(UsageError, match=f'has no "coulomb-1785"; {known}'):
        impact.export("liggghts", at=OBLIQUE, friction="coulomb-1785", code_version="3.8.0")
    # the law, and why it is not combined with a friction law that the code has
    with pytest.raises(UsageError, match='no "liggghts-history" with liggghts-edinburgh, but with liggghts-'):
        impact.export("liggghts", "liggghts-edinburgh", friction="liggghts-history", code_version="3.8.0")
    law = "lammps-linear-nohistory"
    with pytest.raises(UsageError, match=f"friction.{law}.limit: LAMMPS, pair style granular has only abs"):
        impact.export("lammps", "lammps-coeff-restitution-hooke", at={**at, f"friction.{law}.limit": "positive"},
                      friction=law, code_version="22Jul2025")  # fmt: skip
    config = {"models": "lammps-coeff-restitution-hooke", "frictions": "coulomb-1785", "sweep": {**at, "n": 1.0}}
    export = impact.export("lammps", source=config, code_version="22Jul2025")
    assert any(text.startswith("coulomb-1785: LAMMPS") and "no friction" in text for text in export.warnings)
    assert "friction" not in export.as_dict()
    straight = {**at, "angle": 0.0}
    with pytest.raises(UsageError, match="there is no slip before the impact, and so no beta"):
        impact.export("lammps", "lammps-coeff-restitution-hooke", at=straight, friction="lammps-linear-nohistory",
                      code_version="22Jul2025", script=True)  # fmt: skip
