"""`impact solve` finds the values of an input that give a wanted output, and reports if there is none."""

from __future__ import annotations

import json
import math
import re
import shlex

import numpy as np
import pytest

import impact

from .conftest import ROOT, Run

# two glass beads of 5 mm
RADIUS = 2.5e-3
MASS = 2500.0 * 4.0 / 3.0 * math.pi * RADIUS**3
BEADS = {
    "models": "hertz",
    "sweep": {"v1": 1.0, "m1": MASS, "m2": MASS, "R1": RADIUS, "R2": RADIUS, "material": "bead"},
    "materials": {"bead": {"E": 65e9, "nu": 0.22, "rho": 2500.0}},
}
VISCOELASTIC = "lammps-viscoelastic-hertz"


def linear_restitution(zeta: float) -> float:
    """Restitution of a linear spring and dashpot up to zero indentation, in closed form."""
    return math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))


@pytest.mark.parametrize("speed", [0.1, pytest.param(30.0, marks=pytest.mark.slow)])
def test_the_damping_ratio_of_a_linear_contact_depends_on_no_speed(speed: float) -> None:
    (root,) = impact.solve("mujoco-solref", "dampratio", {"e_out": 0.6}, at={"v1": speed}).roots
    again = impact.run(model="mujoco-solref", at={"v1": speed, "mujoco-solref.dampratio": root.value})
    assert root.value == pytest.approx(0.1808583084, rel=1e-8)
    assert again.values["e_out"] == pytest.approx(0.6, abs=1e-10)


def test_a_root_agrees_with_the_closed_form_of_the_linear_dashpot() -> None:
    (root,) = impact.solve("kelvin-voigt", "C", {"e_out": 0.6}, at={"m1": 1.0, "m2": 1.0}).roots
    stiffness = impact.run(model="kelvin-voigt", overrides=[f"model.kelvin-voigt.C={root.value!r}"]).values[
        "stiffness"
    ]
    zeta = root.value / (2.0 * math.sqrt(stiffness * 0.5))
    assert linear_restitution(zeta) == pytest.approx(0.6, abs=1e-9)


@pytest.mark.parametrize(
    ("model", "e"),
    [("chrono-smc-hertz", 0.561), ("yade-betan-pulling", 0.628), ("yade-betan", 0.591)],
)
def test_the_restitution_to_ask_for_to_get_0_6(model: str, e: float) -> None:
    (root,) = impact.solve(model, "e", {"e_out": 0.6}).roots
    assert root.value == pytest.approx(e, abs=5e-4)


def test_an_unreachable_target_has_no_root_and_names_the_range() -> None:
    result = impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": 0.6})
    assert (result.status, result.roots) == ("no_root", ())
    assert result.attainable == pytest.approx((0.0, 0.593624), abs=1e-6)


def test_a_target_at_the_end_of_the_allowed_values_is_a_bound() -> None:
    result = impact.solve("tsuji-1992", "e", {"e_out": 1.0})
    assert (result.status, result.roots[0].value) == ("at_bound", 1.0)


def test_several_roots_are_all_found() -> None:
    law = impact.ForceModel(
        key="two-minima",
        title="Damping that vanishes twice",
        year=2026,
        equation="F = K δ + c(p) δ̇",
        reference="",
        force=lambda K, x, v, c: K * x + c * v,
        coefficients={"c": lambda p: 0.4 * (p - 1.0) ** 2},
        parameters=(impact.Parameter("p", "1", "a number", default=0.5, least=0.0, most=3.0),),
        exponent=1.0,
    )
    result = impact.solve("two-minima", "p", {"e_out": 0.8}, plugins=[law])
    values = [root.value for root in result.roots]
    assert result.status == "several_roots"
    assert np.subtract(1.0, values) == pytest.approx([abs(1.0 - values[0]), -abs(1.0 - values[0])], abs=1e-8)


@pytest.mark.slow
def test_one_value_over_a_range_of_speeds_has_equal_distances_at_both_ends() -> None:
    speeds = {"linspace": [0.1, 3.0, 5]}
    result = impact.solve(VISCOELASTIC, "eta", {"e_out": 0.6}, source=BEADS, over={"v1": speeds})
    assert result.over is not None
    first, last = result.over[0], result.over[-1]
    assert (first["v1"], last["v1"], len(result.over)) == (0.1, 3.0, 5)
    # a faster impact loses more, so that the least largest distance is the same at both ends
    assert first["e_out"] - 0.6 == pytest.approx(0.6 - last["e_out"], abs=1e-6)
    assert result.roots[0].e_out == pytest.approx(np.mean([condition["e_out"] for condition in result.over]))


def test_restitution_of_glass_beads_at_a_given_damping() -> None:
    """LAMMPS itself gives 0.6939, 0.5635 and 0.4908 at this eta."""
    config = {
        **BEADS,
        "models": VISCOELASTIC,
        "sweep": {**BEADS["sweep"], "v1": [0.1, 1.0, 3.0]},
        "model": {VISCOELASTIC: {"eta": 1.384e9}},
    }
    assert impact.sweep(config)["e_out"].values[0] == pytest.approx([0.6939, 0.5635, 0.4908], abs=1e-4)


def test_json_of_the_command(cli: Run) -> None:
    words = ("--model", "mujoco-solref", "--for", "dampratio", "--target", "e_out=0.6", "--at", "v1=1", "--json")
    printed = json.loads(cli("solve", *words).stdout)
    assert (printed["model"], printed["for"]) == ("mujoco-solref", "dampratio")
    assert printed["target"] == {"e_out": 0.6}
    assert (printed["status"], printed["over"]) == ("ok", None)
    assert printed["roots"] == [{"value": pytest.approx(0.1808583084, rel=1e-8), "e_out": pytest.approx(0.6)}]


@pytest.mark.slow
def test_the_page_prints_what_the_commands_print(cli: Run) -> None:
    page = (ROOT / "docs" / "solve.md").read_text(encoding="utf-8")
    examples = re.findall(r"\$ impact (.*)\n((?:.+\n)+?)```", page)
    assert len(examples) == 4
    for command, printed in examples:
        assert cli(*shlex.split(command)).stdout == printed


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--for", "dampratios", "--target", "e_out=0.6"), '--for: mujoco-solref has no parameter "dampratios"'),
        (("--for", "dampratio", "--target", "e_ot=0.6"), '--target: no output "e_ot"; did you mean "e_out"?'),
        (("--for", "dampratio", "--target", "e_out"), 'got "e_out", expected NAME=NUMBER'),
        (("--for", "dampratio", "--target", "e_out=0.6", "--over", "v1=1:2"), "expected NAME=FIRST:LAST:COUNT"),
        (("--for", "dampratio", "--target", "e_out=0.6", "--over", "v9=1:2:3"), "v9"),
        (("--for", "dampratio", "--target", "e_out=0.6", "--at", "v1=-1"), "the balls do not approach"),
    ],
)
def test_bad_input_is_one_line(cli: Run, words: tuple[str, ...], message: str) -> None:
    done = cli("solve", "--model", "mujoco-solref", *words)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
