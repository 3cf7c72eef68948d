"""`impact export` writes a law in the units and conventions of a code, with what the code delivers."""

from __future__ import annotations

import json
import math
import re
import shlex
from pathlib import Path

import pytest

import impact
from impact.errors import UsageError
from impact.exporters.codes import CODES

from .conftest import ROOT, Run, default_law

# two balls whose effective mass is 0.75 kg and whose effective radius is 0.03 m
BALLS = {"v1": 1.0, "v2": 0.0, "m1": 1.0, "m2": 3.0, "R1": 0.04, "R2": 0.12}
SOFT = {"E": 1e9, "nu": 0.3}
HARD = {"E": 5e9, "nu": 0.2}


def source(*materials: str, **values: float) -> dict[str, object]:
    """A config of one impact, with materials or with a stiffness."""
    named = {f"material{i}": name for i, name in enumerate(materials, 1)}
    return {
        "models": "hertz",
        "materials": {"soft": SOFT, "hard": HARD},
        "sweep": BALLS | {"e": 0.5} | named | values,
    }


def test_the_law_is_the_first_of_the_source_that_the_code_has() -> None:
    hooke, hertz = "lammps-coeff-restitution-hooke", "lammps-coeff-restitution-hertz"
    config = source("soft", "soft") | {"models": ["gonthier-2004", hooke, hertz]}
    assert impact.export("lammps", source=config).model == hooke
    assert impact.export("lammps", hertz, source=config).model == hertz
    with pytest.raises(UsageError, match="has none of the laws gonthier-2004"):
        impact.export("lammps", source=config | {"models": "gonthier-2004"})


def test_the_stiffness_of_lammps_hertz_is_per_root_of_the_effective_radius() -> None:
    export = impact.export("lammps", default_law("lammps"), source=source(K=1e8), code_version="22Jul2025")
    assert export.parameters == {"k_n": pytest.approx(1e8 / math.sqrt(0.03), rel=1e-15), "e": 0.5}


def test_lammps_takes_the_moduli_of_both_types_of_two_materials() -> None:
    export = impact.export(
        "lammps", default_law("lammps"), source=source("soft", "hard"), code_version="22Jul2025"
    )
    assert [line.split()[1:7] for line in export.lines if line.startswith("pair_coeff")] == [
        ["1", "1", "hertz/material", "1000000000.0", "0.5", "0.3"],
        ["2", "2", "hertz/material", "5000000000.0", "0.5", "0.2"],
    ]


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


def test_liggghts_takes_the_properties_of_each_type_and_pair() -> None:
    parameters = impact.export(
        "liggghts", default_law("liggghts"), source=source("soft", "hard"), code_version="3.8.0"
    ).parameters
    assert parameters["youngsModulus"] == "peratomtype 1000000000.0 5000000000.0"
    assert parameters["poissonsRatio"] == "peratomtype 0.3 0.2"
    assert parameters["coefficientRestitution"] == "peratomtypepair 2 0.5 0.5 0.5 0.5"


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


def test_opensees_gets_the_effective_mass_and_the_damping_of_its_documentation() -> None:
    export = impact.export("opensees", "opensees-jankowski-impact", source=source(K=1e8))
    # 9 sqrt(5)/2 (1 - e^2)/(e (e (9 pi - 16) + 16)) at e = 0.5
    assert export.parameters["xi"] == pytest.approx(0.6816, abs=1e-3)
    assert (export.parameters["Kh"], export.parameters["Meff"]) == (1e8, pytest.approx(0.75, rel=1e-15))
    hertzdamp = impact.export("opensees", "opensees-hertzdamp", source=source(K=1e8))
    assert hertzdamp.parameters["xiNorm"] == pytest.approx(1.6, rel=1e-15)


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
    assert impact.export("lammps", "tsuji-1992").model == "lammps-coeff-restitution-hertz"


def test_what_is_delivered_at_dt_is_that_of_timestep() -> None:
    at = {"e": 0.5, "v1": 1.0}
    export = impact.export("lammps", at=at, dt=2e-5, code_version="22Jul2025")
    (row,) = impact.timestep("lammps-coeff-restitution-hertz", at=at, dt=[2e-5]).rows
    assert export.at_dt == row


def test_the_json_has_the_names_of_the_contract(cli: Run) -> None:
    data = json.loads(cli("export", "--to", "mujoco", "--at", "e=0.6", "--json").stdout)
    assert {"code", "version", "model", "e_continuous", "contact_time", "e_at_dt", "parameters", "lines"} <= set(
        data
    )
    assert set(data["e_at_dt"]) == {"dt", "mean", "least", "largest"}
    assert data["e_at_dt"]["dt"] == pytest.approx(data["contact_time"] / 50)


def test_the_output_is_a_file_that_is_not_replaced_silently(cli: Run, tmp_path: Path) -> None:
    words = ("export", "--to", "lammps", "--script", "-o", tmp_path / "in.balls")
    first = cli(*words)
    assert (first.returncode, first.stdout) == (0, "")
    assert "e_out = " in (tmp_path / "in.balls").read_text(encoding="utf-8")
    assert cli(*words).returncode == 2
    assert cli(*words, "--overwrite").returncode == 0


@pytest.mark.parametrize("name", CODES)
def test_every_law_of_a_code_is_in_the_list(cli: Run, name: str) -> None:
    listed = {code["code"]: code for code in json.loads(cli("export", "--list", "--json").stdout)}
    assert listed[name]["laws"] == dict(CODES[name].laws)
    assert listed[name]["laws"].keys() <= impact.models().keys()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "--to: expected a code; impact export --list shows them"),
        (("--to", "lamps"), '--to: no code "lamps"; did you mean "lammps"?'),
        (("--to", "mujoco", "--model", "hertz"), 'MuJoCo has no law "hertz"; known: mujoco-solref'),
        (("--to", "lammps", "--script", "--at", "m2=inf"), "--script: m2: got inf, expected a finite value"),
        (("--to", "lammps", "--dt", "0"), "--dt: got 0, expected a finite number > 0"),
        (("--to", "lammps", "--code-version", "new"), '--code-version: got "new", expected the date of a release'),
        (
            ("--to", "lammps", "--code-version", "29Aug2019"),
            "has no coeff_restitution, expected 20240601 or later",
        ),
        (
            ("--to", "lammps", "--verify", "--program", "/nowhere"),
            '"/nowhere": no LAMMPS, pair style granular there',
        ),
        (("--to", "liggghts", "--at", "e=0.01"), "e: got 0.01, expected 0.05 < e <= 1"),
        (("--to", "liggghts", "--at", "K=1e8"), "expected a material, not K"),
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
    done = cli("export", *words)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


EXAMPLES = re.findall(
    r"\$ impact (.*)\n((?:.*\n)+?)```", (ROOT / "docs" / "export.md").read_text(encoding="utf-8")
)


def numbers_and_text(line: str) -> tuple[list[float], str]:
    """The numbers in a line, and the line without them."""
    pattern = r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])"
    return [float(text) for text in re.findall(pattern, line)], re.sub(pattern, "#", line.rstrip())


# each takes a second
QUICK_EXAMPLES = ("export --to lammps", "export --to mujoco")


@pytest.mark.parametrize(
    ("command", "printed"),
    [
        pytest.param(
            *example, id=example[0], marks=() if example[0].startswith(QUICK_EXAMPLES) else pytest.mark.slow
        )
        for example in EXAMPLES
    ],
)
def test_the_page_prints_what_the_commands_print(cli: Run, command: str, printed: str) -> None:
    """The last digits of a number that was solved for depend on the processor."""
    done = cli(*shlex.split(command))
    for line, expected in zip((done.stdout + done.stderr).splitlines(), printed.splitlines(), strict=True):
        numbers, text = numbers_and_text(line)
        expected_numbers, expected_text = numbers_and_text(expected)
        assert text == expected_text
        assert numbers == pytest.approx(expected_numbers, rel=1e-9)


def test_the_list_of_codes_leaves_no_file_in_the_folder(cli: Run, tmp_path: Path) -> None:
    """LIGGGHTS, if it is installed, writes a log when it is asked for its version."""
    assert cli("export", "--list", cwd=tmp_path).returncode == 0
    assert list(tmp_path.iterdir()) == []


def test_the_page_has_an_example_of_each_code() -> None:
    shown = {word for command, _ in EXAMPLES for word in re.findall(r"--to (\S+)", command)}
    assert shown == CODES.keys()
