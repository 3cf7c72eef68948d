"""`impact solve` finds the values of an input that give a wanted output, and reports if there is none."""

from __future__ import annotations

import json
import math
import re
import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import impact
from impact.errors import UsageError

from .conftest import Run, assert_refused, examples_of, new_law

# two glass beads of 5 mm
RADIUS = 2.5e-3
MASS = 2500.0 * 4.0 / 3.0 * math.pi * RADIUS**3
BEADS = {
    "models": "hertz",
    "sweep": {"v1": 1.0, "m1": MASS, "m2": MASS, "R1": RADIUS, "R2": RADIUS, "material": "bead"},
    "materials": {"bead": {"E": 65e9, "nu": 0.22, "rho": 2500.0}},
}
Array = NDArray[np.float64]
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


@pytest.mark.slow
def test_a_target_that_only_impacts_of_many_steps_reach_is_attained() -> None:
    """The more damping the longer a contact lasts, and its integration takes more steps than a scan allows."""
    model, at = "lammps-viscoelastic-hooke", {"v1": 5.356721}
    solver = ["solver.rtol=1e-6", "solver.max_steps=1500"]
    solved = impact.solve(model, "eta", {"contact_time": 4e-3}, at=at, overrides=solver)
    at["eta"] = solved.roots[0].value
    problem = impact.prepare(model=model, at=at, outputs="contact_time", overrides=solver)
    assert problem()["contact_time"] == pytest.approx(4e-3, rel=1e-5)
    assert solved.attainable[1] >= 4e-3
    over = {"v1": [5.0, at["v1"]]}
    best = impact.solve(model, "eta", {"contact_time": 4e-3}, over=over, overrides=solver).roots[0].value
    contact_times = problem(eta=best, v1=over["v1"])["contact_time"]
    assert contact_times == pytest.approx([4e-3, 4e-3], rel=0.01)
    # at 0.5 m/s impacts of few steps attain the target, too; what is too long there and too short here balances
    over = {"v1": [0.5, 5.7]}
    best = impact.solve(model, "eta", {"contact_time": 3.2e-3}, over=over, overrides=solver).roots[0].value
    longer, shorter = problem(eta=best, v1=over["v1"])["contact_time"]
    assert longer - 3.2e-3 == pytest.approx(3.2e-3 - shorter, rel=1e-3)


@pytest.mark.slow
def test_a_root_agrees_with_the_closed_form_of_the_linear_dashpot() -> None:
    (root,) = impact.solve("kelvin-voigt", "C", {"e_out": 0.6}, at={"m1": 1.0, "m2": 1.0}).roots
    stiffness = impact.run(model="kelvin-voigt", overrides=[f"model.kelvin-voigt.C={root.value!r}"]).values[
        "stiffness"
    ]
    zeta = root.value / (2.0 * math.sqrt(stiffness * 0.5))
    assert linear_restitution(zeta) == pytest.approx(0.6, abs=1e-9)


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_target_at_the_end_of_the_allowed_values_is_a_bound() -> None:
    result = impact.solve("tsuji-1992", "e", {"e_out": 1.0})
    assert (result.status, result.roots[0].value) == ("at_bound", 1.0)


def test_several_roots_are_all_found() -> None:
    law = law_of(lambda p: 0.4 * (p - 1.0) ** 2)
    result = impact.solve("damped", "p", {"e_out": 0.8}, plugins=[law])
    values = [root.value for root in result.roots]
    assert result.status == "several_roots"
    assert np.subtract(1.0, values) == pytest.approx([abs(1.0 - values[0]), -abs(1.0 - values[0])], abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wanted", "roots"),
    [
        (0.64, [1.46682e-4, 1.62186e-4]),
        pytest.param(0.6395, [1.48783e-4, 1.60035e-4], marks=pytest.mark.slow),
        pytest.param(0.642, [1.4134150e-4, 1.6772915e-4], marks=pytest.mark.slow),
    ],
)
def test_both_roots_beside_a_minimum_between_two_values_of_the_scan_are_found(
    wanted: float, roots: list[float]
) -> None:
    """The least e_out is 0.6389431042, at d = 1.543805e-4 m; that of the scan is 0.640553."""
    result = impact.solve("muthukumar-2003", "d", {"e_out": wanted}, at={"e": 0.5, "v1": 1.0})
    assert result.status == "several_roots"
    assert [root.value for root in result.roots] == pytest.approx(roots, rel=5e-6)
    assert result.attainable == (0.638943, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wanted", "roots"),
    [
        (573.0, [361.680, 387.604]),
        (600.0, [201.263755, 538.515748]),
        (572.8, []),
    ],
)
def test_the_least_peak_force_of_a_dashpot_is_right_to_six_digits(wanted: float, roots: list[float]) -> None:
    result = impact.solve("kelvin-voigt", "C", {"peak_force": wanted}, at={"K": 1e6, "n": 1.0})
    assert [root.value for root in result.roots] == pytest.approx(roots, rel=2e-6)
    assert result.attainable[0] == 572.845


AT_FIXED_STEPS = {
    "models": "damped",
    "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "steps_per_contact": 20, "phase": 0.5},
    "solver": {"integrator": "kick-drift"},
}


def law_of(damping: Callable[[Array], Array]) -> impact.ForceModel:
    """A linear contact whose dashpot is a function of a number p from 0 to 3."""
    return new_law(
        "damped",
        lambda K, x, v, c: K * x + c * v,
        coefficients={"c": lambda p: damping(p)},
        parameters=(impact.Parameter("p", "1", "a number", default=0.5, least=0.0, most=3.0),),
        exponent=1.0,
    )


def roots_at_fixed_steps(law: impact.ForceModel, p: float) -> list[float]:
    """The values of p with the e_out that the law delivers at this one."""
    target = impact.run(AT_FIXED_STEPS, at={"damped.p": p}, plugins=[law]).values["e_out"]
    result = impact.solve("damped", "p", {"e_out": target}, source=AT_FIXED_STEPS, plugins=[law])
    return [root.value for root in result.roots]


def test_a_parameter_without_a_least_value_is_solved_for() -> None:
    law = law_of(lambda p: 0.3 + 0.2 * np.tanh(p))
    law = replace(law, parameters=(impact.Parameter("p", "1", "a number"),))
    (root,) = impact.solve("damped", "p", {"e_out": linear_restitution(0.1)}, plugins=[law]).roots
    assert root.value == pytest.approx(-math.atanh(0.5), abs=1e-6)


def test_a_root_is_right_to_more_digits_than_the_polynomial_that_finds_it() -> None:
    """A polynomial may be wrong by 1e-10, which hides a ripple of the damping."""
    law, target = law_of(lambda p: 0.3 * p + 3e-11 * np.cos(300.0 * (p - 0.5))), linear_restitution(0.075)
    (root,) = impact.solve("damped", "p", {"e_out": target}, plugins=[law]).roots
    assert root.e_out == pytest.approx(target, rel=1e-12)


@pytest.mark.parametrize(
    ("place", "half_width"),
    [(1.0075, 0.1), (2.9875, 0.1), (2.5025, 0.02)],
    ids=["inside", "beside the last value", "narrow"],
)
def test_with_a_fixed_step_the_least_value_lies_between_two_values_of_the_scan(
    place: float, half_width: float
) -> None:
    """These are at multiples of 0.015 up to 3; a polynomial would miss the narrow minimum."""
    law = law_of(lambda p: 0.5 - 0.2 * np.minimum(np.abs(p - place) / half_width, 1.0) ** 2)
    result = impact.solve("damped", "p", {"e_out": 0.3}, source=AT_FIXED_STEPS, plugins=[law])
    least = impact.run(AT_FIXED_STEPS, at={"damped.p": place}, plugins=[law]).values["e_out"]
    assert result.status == "no_root"
    assert result.attainable[0] == pytest.approx(least, abs=1e-6)


@pytest.mark.slow
def test_roots_beside_a_minimum_that_is_not_the_least_are_found_halfway_between_two_values_of_the_scan() -> None:
    """The minimum is at 1.0125, as far from 1.005 as from 1.02; the least value is at 3."""
    law = law_of(lambda p: 0.5 - 20.0 * np.minimum(np.abs(p - 1.0125), 0.1) ** 2 + np.maximum(p - 2.0, 0.0))
    assert roots_at_fixed_steps(law, 1.0085)[:2] == pytest.approx([1.0085, 1.0165], abs=1e-6)


@pytest.mark.slow
def test_roots_beside_a_peak_over_the_whole_range_are_found_beyond_the_values_of_the_scan() -> None:
    """Only one of these, 1.005, is on the peak, which is at 1.0075."""
    law = law_of(lambda p: 0.5 - 8.0 * np.maximum(0.01 - np.abs(p - 1.0075), 0.0))
    assert roots_at_fixed_steps(law, 1.006) == pytest.approx([1.006, 1.009], abs=1e-6)


@pytest.mark.slow
def test_roots_between_two_powers_of_ten_of_the_scan_are_found_by_its_even_steps_between_the_bounds() -> None:
    """The damping is less from 2.55 to 2.65 only."""
    law = law_of(lambda p: 0.5 - 8.0 * np.maximum(0.05 - np.abs(p - 2.6), 0.0))
    assert roots_at_fixed_steps(law, 2.575) == pytest.approx([2.575, 2.625], abs=1e-6)


@pytest.mark.slow
def test_the_ends_of_an_interval_that_gives_the_target_are_the_roots() -> None:
    law = law_of(lambda p: 0.4 * np.maximum(np.abs(p - 1.5) - 0.6213, 0.0))
    result = impact.solve("damped", "p", {"e_out": 1.0}, plugins=[law])
    assert result.status == "several_roots"
    assert [root.value for root in result.roots] == pytest.approx([1.5 - 0.6213, 1.5 + 0.6213], abs=1e-6)


@pytest.mark.slow
def test_a_jump_across_the_target_is_neither_a_root_nor_an_extremum() -> None:
    law = law_of(lambda p: np.where(p < 1.2345, 0.1 * p, 0.6 - 0.1 * p))
    result = impact.solve("damped", "p", {"e_out": 0.65}, plugins=[law])
    assert result.status == "no_root"
    # the damping just after the jump is the largest
    least = linear_restitution((0.6 - 0.12345) / 2.0)
    assert result.attainable == pytest.approx((least, 1.0), abs=1e-6)


@pytest.mark.slow
def test_an_extremum_that_touches_the_target_is_one_root() -> None:
    law = law_of(lambda p: 0.2 + 0.4 * (p - 1.0) ** 2)
    largest = linear_restitution(0.1)
    result = impact.solve("damped", "p", {"e_out": largest}, plugins=[law])
    assert result.status == "ok"
    assert result.roots[0].value == pytest.approx(1.0, abs=1e-4)


@pytest.mark.slow
def test_a_value_that_fails_hides_no_root_between_its_neighbours() -> None:
    """One value of the scan needs more steps than a scan takes."""
    result = impact.solve("bordbar-hyppanen-2007", "C", {"e_out": 0.9972}, at={"v1": 1.0})
    assert [root.e_out for root in result.roots] == pytest.approx([0.9972], abs=1e-9)


def test_the_stiffness_for_a_contact_time_is_that_of_the_closed_form() -> None:
    """Hertz' contact time is 3.2181 (m²/(K² v))^0.2."""
    at = {"m1": 1.0, "m2": 1.0, "v1": 2.0, "v2": 0.0}
    (root,) = impact.solve("hertz", "K", {"contact_time": 1e-3}, at=at).roots
    factor = 1.25**0.4 * 4.0 * math.sqrt(math.pi) * math.gamma(0.4) / (5.0 * math.gamma(0.9))
    mass, speed = 0.5, 2.0
    assert factor == pytest.approx(3.2181, abs=1e-4)
    assert root.value == pytest.approx(math.sqrt((factor / 1e-3) ** 5 * mass**2 / speed), rel=1e-8)


@pytest.mark.slow
def test_the_best_value_over_a_range_is_that_of_the_best_of_several_basins() -> None:
    """The scan is nearer to the worse one, at p = 1."""
    law = law_of(lambda p: np.minimum(0.01 + 0.1 * np.abs(p - 1.0), 3.0 * np.abs(p - 2.0025)))
    result = impact.solve("damped", "p", {"e_out": 1.0}, over={"v1": [1.0, 2.0]}, plugins=[law])
    assert result.roots[0].value == pytest.approx(2.0025, abs=1e-6)
    assert result.attainable == pytest.approx((1.0, 1.0), abs=1e-6)


@pytest.mark.slow
def test_the_best_value_over_a_range_may_be_the_largest_of_the_allowed_values() -> None:
    law = law_of(lambda p: 0.4 - 0.1 * p)
    result = impact.solve(
        "damped", "p", {"e_out": 1.0}, source=AT_FIXED_STEPS, over={"v1": [1.0, 2.0]}, plugins=[law]
    )
    assert (result.status, [root.value for root in result.roots]) == ("at_bound", [3.0])


@pytest.mark.parametrize("target", [{}, {"e_out": 0.5, "peak_force": 100.0}])
def test_a_target_is_one_output(target: dict[str, float]) -> None:
    with pytest.raises(UsageError, match=f"got {len(target)} targets, expected one"):
        impact.solve("mujoco-solref", "dampratio", target)


@pytest.mark.parametrize("name", ["steps", "status", "v1_reference"])
def test_a_count_a_status_or_a_value_without_a_law_is_no_target(name: str) -> None:
    with pytest.raises(UsageError, match=f'no output "{name}"; known: '):
        impact.solve("mujoco-solref", "dampratio", {name: 5.0})


def test_an_output_of_friction_is_a_target_with_a_friction_law_only() -> None:
    with pytest.raises(UsageError, match="got no friction law, expected friction"):
        impact.solve("hertz", "K", {"beta": 0.4})


def test_the_command_ends_well_without_a_root(cli: Run) -> None:
    done = cli("solve", "--model", "gharib-hurmuzlu-2012", "--for", "e", "--target", "e_out=0.6")
    assert (done.returncode, done.stderr) == (0, "")
    assert "no value of e gives e_out = 0.6; e_out is from 0 to 0.593624" in done.stdout


def test_the_ends_of_a_range_of_materials_are_named() -> None:
    range_of = {"material1": ["steel", "glass"]}
    result = impact.solve("tsuji-1992", "e", {"e_out": 0.6}, over=range_of)
    assert str(result) == "e = 0.6: e_out from 0.6 at material1 = steel to 0.6 at material1 = glass"
    assert [condition["material1"] for condition in result.over or ()] == range_of["material1"]


def test_a_stiffness_is_found_over_a_range_of_masses() -> None:
    masses = [1.0, 2.0]
    result = impact.solve("hertz", "K", {"contact_time": 1e-3}, over={"m1": masses})
    shots = [impact.run(model="hertz", at={"K": result.roots[0].value, "m1": m1}) for m1 in masses]
    assert np.mean([shot.values["contact_time"] for shot in shots]) == pytest.approx(1e-3, rel=1e-6)


def test_a_range_that_does_not_count_is_refused() -> None:
    with pytest.raises(UsageError, match="over: alpha does not count if e is solved for"):
        impact.solve("tsuji-1992", "e", {"e_out": 0.6}, over={"alpha": [0.1, 0.2]})


@pytest.mark.parametrize("value", [1.0, "1 m/s", np.float64(1.0)])
def test_a_range_of_one_value_is_refused(value: object) -> None:
    with pytest.raises(UsageError, match=re.escape('over["v1"]: got one value, expected a list or a range')):
        impact.solve("tsuji-1992", "e", {"e_out": 0.6}, over={"v1": value})


@pytest.mark.slow
def test_the_text_has_a_line_for_each_root() -> None:
    result = impact.solve("mujoco-solref", "dampratio", {"contact_time": 0.01})
    (root,) = result.roots
    assert str(result) == f"dampratio = {root.value:.10g}: contact_time = 10 ms, e_out = {root.e_out:.6g}"


@pytest.mark.slow
def test_a_range_of_toml_is_a_range_of_the_option(cli: Run) -> None:
    words = ("solve", "--model", "hunt-crossley-1975", "--for", "e", "--target", "e_out=0.6", "--over")
    printed = [cli(*words, over).stdout for over in ("v1=0.1:3:3", "v1={linspace=[0.1, 3, 3]}")]
    assert printed[0].startswith("e = 0.")
    assert printed[0] == printed[1]


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


@pytest.mark.slow
def test_json_of_the_command(cli: Run) -> None:
    words = ("--model", "mujoco-solref", "--for", "dampratio", "--target", "e_out=0.6", "--at", "v1=1", "--json")
    printed = json.loads(cli("solve", *words).stdout)
    assert (printed["model"], printed["for"]) == ("mujoco-solref", "dampratio")
    assert printed["target"] == {"e_out": 0.6}
    assert (printed["status"], printed["over"]) == ("ok", None)
    assert printed["roots"] == [{"value": pytest.approx(0.1808583084, rel=1e-8), "e_out": pytest.approx(0.6)}]


@pytest.mark.slow
def test_the_page_prints_what_the_commands_print(cli: Run) -> None:
    examples = examples_of("docs/solve.md")
    assert len(examples) == 5
    for command, printed in examples:
        assert cli(*shlex.split(command)).stdout == printed


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--for", "dampratios", "--target", "e_out=0.6"), '--for: mujoco-solref has no parameter "dampratios"'),
        (("--for", "dampratio", "--target", "e_ot=0.6"), '--target: no output "e_ot"; did you mean "e_out"?'),
        (("--for", "dampratio", "--target", "e_out"), 'got "e_out", expected NAME=VALUE, such as e_out=0.6'),
        (("--for", "dampratio", "--target", "e_out=0.6 m"), '--target e_out: got "0.6 m", expected a bare number'),
        (("--for", "dampratio", "--target", "e_out=0.6", "--over", "v1=1:2"), "expected NAME=FIRST:LAST:COUNT"),
        (("--for", "dampratio", "--target", "e_out=0.6", "--over", "v9=1:2:3"), "v9"),
        (("--for", "dampratio", "--target", "e_out=0.6", "--at", "v1=-1"), "the balls do not approach"),
        (
            ("--model", "kuwabara-kono-1987", "--for", "A", "--target", "e_out=0.6", "--at", "v1=1e300"),
            "no e_out at any value of A: a derived quantity is not finite",
        ),
    ],
)
def test_bad_input_is_one_line(cli: Run, words: tuple[str, ...], message: str) -> None:
    assert_refused(cli("solve", "--model", "mujoco-solref", *words), message)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "at", "note"),
    [
        ("C", {"kelvin-voigt.C": 1.0}, "C is solved for, and this value changes nothing"),
        ("C", {"C": 1.0}, "C is solved for, and this value changes nothing"),
        ("C", {"e": 0.7}, "e is not an input of kelvin-voigt, and changes nothing"),
    ],
)
def test_a_given_value_that_changes_nothing_is_noted(name: str, at: dict[str, float], note: str) -> None:
    without = impact.solve("kelvin-voigt", name, {"e_out": 0.6})
    with pytest.warns(impact.ImpactWarning, match=re.escape(note)):
        result = impact.solve("kelvin-voigt", name, {"e_out": 0.6}, at=at)
    assert result.roots == without.roots


@pytest.mark.parametrize("joint", ["zip", "cases"])
def test_a_parameter_that_varies_with_another_input_is_solved_for_at_its_value(joint: str, tmp_path: Path) -> None:
    """The value that stands in for the unknown is none of the joint values, and selects none of them."""
    law, m1, A = "kuwabara-kono-1987", [0.1, 0.2], [1e-6, 2e-6]
    fixed = {"m2": math.inf, "K": 1e9, "v1": 1.0}
    config: dict[str, Any] = {"sweep": {**fixed, "m1": m1, "zip": [["m1", f"{law}.A"]]}, "model": {law: {"A": A}}}
    if joint == "cases":
        path = tmp_path / "cases.csv"
        path.write_text("\n".join(["m1,kuwabara-kono-1987.A", *map("{},{}".format, m1, A)]))
        config = {"sweep": {**fixed, "cases": str(path)}}
    config |= {"models": [law], "solver": {"rtol": 1e-6}}
    [root] = impact.solve(law, "A", {"e_out": 0.7}, source=config, at={"m1": 0.2}).roots
    alone = {**config, "sweep": {**fixed, "m1": 0.2}, "model": {}}
    [expected] = impact.solve(law, "A", {"e_out": 0.7}, source=alone).roots
    assert root == expected
    with pytest.warns(impact.ImpactWarning, match="A is solved for, and this value changes nothing"):
        assert impact.solve(law, "A", {"e_out": 0.7}, source=config, at={"m1": 0.2, "A": 3.0}).roots == (root,)
    # also where a law without an e gets its damping
    step = impact.timestep(law, source=config, at={"m1": 0.2, "e": 0.7})
    assert step.solved == pytest.approx({"A": expected.value}, rel=1e-9)
