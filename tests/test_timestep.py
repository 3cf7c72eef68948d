"""`impact timestep` predicts what an explicit code delivers at a fixed time step."""

from __future__ import annotations

import json
import math
import shlex
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import impact
from impact.contact.fixed_step import collide_at_fixed_step
from impact.contact.models import find
from impact.errors import UsageError
from impact.formatting import number
from impact.inverse.timestep import FixedStepLaw

from .conftest import Run, assert_refused, assert_same_output, examples_of

LINEAR = "anagnostopoulos-1988"
Array = NDArray[np.float64]


def linear_map(e: Array, steps_per_contact: Array, phase: Array) -> tuple[Array, Array]:
    """Restitution of a linear spring and dashpot at a fixed step, in closed form, and the step."""
    zeta = -np.log(e) / np.hypot(np.pi, np.log(e))
    h = np.pi / np.sqrt(1.0 - zeta**2) / steps_per_contact
    c, k = 2.0 * zeta * h, h * h
    r = np.sqrt(1.0 - c)
    theta = np.arccos((2.0 - k - c) / (2.0 * r))
    x0 = phase * h
    x1 = (1.0 - k) * x0 + h * (1.0 - c)
    b = (x1 / r - x0 * np.cos(theta)) / np.sin(theta)
    last = np.ceil((np.pi - np.arctan2(x0, b)) / theta)

    def position(number: Array) -> Array:
        return r**number * (x0 * np.cos(number * theta) + b * np.sin(number * theta))

    return -(position(last) - position(last - 1.0)) / h, h


def test_the_loop_agrees_with_the_closed_form_in_3000_random_cases() -> None:
    random = np.random.default_rng(20260724)
    e, steps = random.uniform(0.05, 1.0, 3000), random.uniform(8.0, 300.0, 3000)
    phase = random.uniform(1e-3, 1.0, 3000)
    exact, h = linear_map(e, steps, phase)
    result = collide_at_fixed_step(find(LINEAR), 1.0, {"e": e}, h, phase, 10_000)
    assert np.max(np.abs(result.e_out - exact)) < 1e-12


@pytest.mark.parametrize(
    ("e", "steps", "mean", "least", "largest"),
    [
        (0.9, 10, 0.9000, 0.894, 0.921),
        (0.9, 20, 0.8999, 0.898, 0.909),
        (0.5, 10, 0.491, 0.454, 0.542),
        (0.5, 20, 0.4945, 0.480, 0.519),
        (0.5, 50, 0.4976, 0.493, 0.507),
        (0.1, 10, 0.060, 0.037, 0.072),
        (0.1, 20, 0.080, 0.067, 0.089),
    ],
)
def test_table_of_a_linear_contact(e: float, steps: int, mean: float, least: float, largest: float) -> None:
    (row,) = impact.timestep(LINEAR, at={"e": e}, steps_per_contact=[steps]).rows
    assert row.e_mean == pytest.approx(mean, abs=6e-4)
    assert (row.e_least, row.e_largest) == pytest.approx((least, largest), abs=6e-4)


@pytest.mark.parametrize(("e", "first_enough", "steps"), [(0.9, 21, 21.20), (0.5, 74, 162.34), (0.1, 654, 862.54)])
def test_number_of_steps_from_which_every_phase_is_within_one_percent(
    e: float, first_enough: int, steps: float
) -> None:
    """By the closed form: the first whole number that is enough, and the last number that is not."""
    result = impact.timestep(LINEAR, at={"e": e}, steps_per_contact=[first_enough - 1, first_enough], tol=0.01)
    too_long, enough = (max(row.e_largest - e, e - row.e_least) for row in result.rows)
    assert enough <= 0.01 * e < too_long
    phase = (np.arange(400) + 0.5) / 400
    last, tried = (np.array([[steps], [steps + 0.02]]), np.arange(steps + 0.02, 3.0 * steps, 0.17)[:, None])
    errors = [np.abs(linear_map(np.array([[e]]), some, phase)[0] - e).max(axis=1) for some in (last, tried)]
    assert errors[0][0] > 0.01 * e >= errors[1].max()
    assert result.needed is not None
    assert steps < result.needed.steps_per_contact < 1.05 * steps
    assert result.needed.dt == pytest.approx(result.contact_time / result.needed.steps_per_contact)


@pytest.mark.parametrize(("e", "steps", "to_ask"), [(0.5, 20, 0.5054), (0.5, 50, 0.5024), (0.1, 20, 0.1202)])
def test_the_e_to_ask_gives_the_mean_that_is_wanted(e: float, steps: int, to_ask: float) -> None:
    wanted = impact.timestep(LINEAR, at={"e": e}, steps_per_contact=[steps])
    assert wanted.rows[0].e_to_ask == pytest.approx(to_ask, abs=1e-4)
    # the step stays the same while the e that is asked for changes
    asked = impact.timestep(LINEAR, at={"e": wanted.rows[0].e_to_ask}, dt=[wanted.rows[0].dt])
    assert asked.rows[0].e_mean == pytest.approx(e, abs=1e-3)


def test_the_range_over_the_phase_is_of_third_order_without_damping() -> None:
    rows = impact.timestep(LINEAR, at={"e": 1.0}, steps_per_contact=[10, 20, 40]).rows
    halves = [0.5 * (row.e_largest - row.e_least) for row in rows]
    assert halves == pytest.approx([1.99e-3, 2.50e-4, 3.14e-5], rel=0.01)


@pytest.mark.parametrize(
    ("model", "parameters"),
    [
        ("hertz", {}),
        pytest.param("tsuji-1992", {}, marks=pytest.mark.slow),
        pytest.param("tsuji-1992-no-tension", {}, marks=pytest.mark.slow),
        pytest.param("hunt-crossley-1975", {}, marks=pytest.mark.slow),
        ("bilinear", {}),
        ("luding-2008", {"k2": 5.0}),
        ("thornton-1997", {}),
    ],
)
def test_small_steps_deliver_what_the_continuous_law_delivers(model: str, parameters: dict[str, float]) -> None:
    at = {"e": 0.6} if "e" in find(model).quantities else {}
    at |= {f"{model}.{name}": value for name, value in parameters.items()}
    overrides = [f"model.{model}.{name}={value}" for name, value in parameters.items()]
    overrides.append("materials.table1.yield_strength='1 GPa'")
    result = impact.timestep(model, at=at, overrides=overrides, steps_per_contact=[1000], phases=4)
    (row,) = result.rows
    assert row.e_least == pytest.approx(result.e_continuous, abs=2e-3)
    assert row.e_largest == pytest.approx(result.e_continuous, abs=2e-3)


def test_a_law_without_an_e_has_none_to_ask_for(cli: Run) -> None:
    done = cli("timestep", "--model", "mujoco-solref", "--steps-per-contact", "20", "--phases", "8", "--json")
    printed = json.loads(done.stdout)
    assert (printed["e"], printed["rows"][0]["e_to_ask"], printed["needed"]) == (None, None, None)


@pytest.mark.slow
def test_json_of_the_command(cli: Run) -> None:
    words = ("--steps-per-contact", "20", "--dt", "1e-6", "--phases", "8", "--tol", "5%", "--json")
    printed = json.loads(cli("timestep", "--model", LINEAR, "--at", "e=0.5", *words).stdout)
    assert printed["model"] == LINEAR
    assert printed["e"] == 0.5
    assert [row["steps_per_contact"] for row in printed["rows"]] == [
        20.0,
        pytest.approx(printed["contact_time"] / 1e-6),
    ]
    assert printed["needed"].keys() == {"tol", "steps_per_contact", "dt"}


def test_the_first_values_of_axes_are_named(cli: Run, tmp_path: Path) -> None:
    """The slowest impact of the source may need the least steps."""
    config = tmp_path / "speeds.toml"
    config.write_text(
        'models = "hertz"\n[sweep]\nv1 = { geomspace = ["0.01 m/s", "2 m/s", 7] }\nm1 = 1\nm2 = inf\n'
        "n = 1.5\nK = [1e6, 2e6]\n",
        encoding="utf-8",
    )
    command = ("timestep", config, "--model", "hertz", "--phases", "8", "--at")
    line = "first value of each axis of the source: v1 = 10 mm/s"
    assert line in cli(*command, "K=1e6").stdout.splitlines()
    assert json.loads(cli(*command, "v1=2", "--json").stdout)["first_value_of"] == ["K"]
    # one value each, and nothing is said
    assert "first value" not in cli("timestep", "--model", LINEAR, "--at", "e=0.5", "--phases", "8").stdout


@pytest.mark.parametrize("steps", [0.5, 1.0, 2.0, 3.0])
def test_a_step_has_the_status_and_the_failures_of_a_sweep(steps: float) -> None:
    """At two steps per contact some phases rebound faster than twice their approach, and others do not."""
    phases = 40
    (row,) = impact.timestep(LINEAR, at={"e": 0.5}, steps_per_contact=[steps], phases=phases).rows
    swept = impact.sweep(
        {
            "models": LINEAR,
            "sweep": {
                "e": 0.5,
                "v1": 1.0,
                "m1": 1.0,
                "m2": 1.0,
                "K": 1e6,
                "n": 1.0,
                "steps_per_contact": steps,
                "phase": ((np.arange(phases) + 0.5) / phases).tolist(),
            },
            "solver": {"integrator": "kick-drift"},
        }
    ).isel(model=0)
    failed = swept["status"].values >= 10
    assert row.failed == failed.sum()
    assert (row.status, math.isnan(row.e_mean)) == (("unstable", True) if failed.any() else ("ok", False))
    assert row.e_mean == pytest.approx(swept["e_out"].mean("phase", skipna=False).item(), rel=1e-9, nan_ok=True)


def test_a_row_is_the_same_beside_other_steps() -> None:
    """The surfaces part after 50 contact times, at which a collision is given up."""
    at = {"K": 1e6, "C": 2e4, "v1": 1.0, "m1": 1.0, "m2": 1.0}
    alone, beside = (
        impact.timestep("kelvin-voigt-no-tension", at=at, steps_per_contact=steps, phases=4).rows[0]
        for steps in ([20], [20, 1000])
    )
    assert (alone.status, alone.failed) == (beside.status, beside.failed) == ("not_separated", 4)


@pytest.mark.slow
def test_a_step_that_is_too_long_is_no_restitution_and_ends_with_exit_code_3(cli: Run) -> None:
    words = ("timestep", "--model", LINEAR, "--at", "e=0.5", "--steps-per-contact", "1", "--tol", "1%")
    table, printed = cli(*words), cli(*words, "--json")
    assert (table.returncode, printed.returncode) == (3, 3)
    assert "unstable        –          –           –" in table.stdout
    assert "unstable at 338 of 400 phases, the step is too long" in table.stderr
    # also where another step is short enough
    assert cli(*words, "--steps-per-contact", "50").returncode == 3
    result = json.loads(printed.stdout)
    (row,) = result["rows"]
    assert (row["status"], row["failed"]) == ("unstable", 338)
    assert {row[name] for name in ("e_mean", "e_least", "e_largest", "e_to_ask")} == {None}
    # a step that fails keeps no phase within the tolerance
    assert result["needed"]["steps_per_contact"] == 166


@pytest.mark.slow
def test_the_rayleigh_time_is_the_smaller_one_and_belongs_to_laws_with_moduli() -> None:
    radii, glass = {"R1": 2.5e-3, "R2": 5e-3}, {"material": "glass", "e": 0.5}
    E, nu, rho = (impact.materials()["glass"][name] for name in ("E", "nu", "rho"))
    expected = math.pi * 2.5e-3 * math.sqrt(rho * 2 * (1 + nu) / E) / (0.1631 * nu + 0.8766)
    result = impact.timestep("hertz", at={**radii, "material": "glass"}, phases=2)
    assert result.rayleigh_time == pytest.approx(expected, rel=1e-14)
    assert "dt / T_R" in str(result)
    # the mass that is stated decides the density
    heavy = impact.timestep("tsuji-1992", at={**radii, **glass, "m1": 1.0, "m2": 8.0}, phases=2)
    volume = 4 / 3 * math.pi * 2.5e-3**3
    assert heavy.rayleigh_time == pytest.approx(expected * math.sqrt(1.0 / volume / rho), rel=1e-14)
    for other in (
        impact.timestep("tsuji-1992", at={"K": 1e9, "e": 0.5}),
        impact.timestep("mujoco-solref", at={"e": 0.5}),
    ):
        assert math.isnan(other.rayleigh_time)
        assert "T_R" not in str(other)


@pytest.mark.slow
def test_the_page_prints_what_the_commands_print(cli: Run) -> None:
    examples = examples_of("docs/timestep.md")
    assert examples
    for command, printed in examples:
        done = cli(*shlex.split(command))
        assert_same_output(done.stdout + done.stderr, printed)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--steps-per-contact", "0"), "--steps-per-contact: got 0.0, expected a number > 0"),
        (("--dt", "-1e-6"), "--dt: got -1e-06, expected a number > 0 s"),
        (("--dt", "1e-12"), "--dt: got 2.90209e+08 steps per contact, expected at most 131,072"),
        (("--at", "e=0"), "has no rebound at these inputs"),
        (("--phases", "0"), "expected a whole number of at least 1"),
        (("--phases", "1000000000"), "--phases: got 1000000000, expected at most 10,000"),
    ],
)
def test_bad_input_is_one_line(cli: Run, words: tuple[str, ...], message: str) -> None:
    assert_refused(cli("timestep", "--model", LINEAR, *words), message)


@pytest.mark.slow
def test_no_steps_are_tried_where_surfaces_part_later_than_a_collision_is_followed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    outputs = FixedStepLaw.outputs

    def few_steps(law: FixedStepLaw, dt: NDArray[np.float64], *names: str, **options: Any) -> list[NDArray[Any]]:
        assert (law.contact_time / dt).max() < 1000
        return outputs(law, dt, *names, **options)

    monkeypatch.setattr(FixedStepLaw, "outputs", few_steps)
    result = impact.timestep("kelvin-voigt-no-tension", at={"e": 0.001}, scheme="pybullet", tol=0.01, phases=4)
    assert (result.needed, {row.status for row in result.rows}) == (None, {"not_separated"})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "e", "tol"), [(LINEAR, 0.5, 0.01), ("bilinear", 0.744, 0.02), ("tsuji-1992", 0.671, 0.02)]
)
def test_every_step_below_the_needed_one_is_within_the_tolerance(model: str, e: float, tol: float) -> None:
    """The error rises and falls with the fraction of a step in which a contact ends."""
    needed = impact.timestep(model, at={"e": e}, tol=tol).needed
    assert needed is not None
    shares = np.random.default_rng(1).uniform(1.0, 3.0, 100)
    rows = impact.timestep(model, at={"e": e}, dt=[needed.dt, *(needed.dt / shares).tolist()]).rows
    assert max(max(row.e_largest - e, e - row.e_least) for row in rows) <= tol * e
    # not many fewer are enough
    rows = impact.timestep(model, at={"e": e}, dt=(needed.dt * np.linspace(1.0, 1.2, 50)).tolist()).rows
    assert max(max(row.e_largest - e, e - row.e_least) for row in rows) > tol * e


def test_a_law_that_is_nearly_a_tolerance_off_needs_many_steps() -> None:
    at = {"e": 0.95}
    law = impact.timestep("lankarani-nikravesh-1990", at=at, steps_per_contact=[100])
    tol = 1.005 * abs(law.e_continuous - 0.95) / 0.95
    needed = impact.timestep("lankarani-nikravesh-1990", at=at, tol=tol).needed
    assert needed is not None
    (row,) = impact.timestep("lankarani-nikravesh-1990", at=at, dt=[needed.dt]).rows
    assert max(row.e_largest - 0.95, 0.95 - row.e_least) <= 0.95 * tol


def test_a_step_that_cannot_be_changed_needs_a_time_constant(cli: Run) -> None:
    """At 2 ms MuJoCo delivers 0.7 at every phase from a time constant of about 0.235 s on, in 84 ms of contact."""
    words = ("timestep", "--model", "mujoco-solref", "--at", "e=0.7", "--at", "v1=1", "--tol", "1%")
    done = cli(*words, "--dt", "2 ms", "--for", "timeconst", "--json")
    assert done.returncode == 0, done.stderr
    data = json.loads(done.stdout)
    assert data["e"] == 0.7
    assert data["solved"] == {"dampratio": pytest.approx(0.1222, abs=1e-4)}
    needed = data["for"]
    assert list(needed) == ["parameter", "value", "contact_time", "peak_indentation", "tol"]
    assert (needed["parameter"], needed["tol"]) == ("timeconst", 0.01)
    assert needed["value"] == pytest.approx(0.2356, rel=1e-3)
    assert needed["contact_time"] == pytest.approx(0.084, rel=1e-5)
    # it is enough, and nine tenths of it are not
    for factor, is_enough in ((1.0, True), (0.9, False)):
        at = {"timeconst": factor * needed["value"], **data["solved"]}
        (row,) = impact.timestep("mujoco-solref", at=at, dt=["2 ms"]).rows
        assert (max(row.e_largest - 0.7, 0.7 - row.e_least) <= 0.007 * (1.0 + 1e-9)) == is_enough


def test_without_an_e_nothing_is_solved_for() -> None:
    data = impact.timestep("mujoco-solref", at={"dampratio": 0.12}, steps_per_contact=[20], phases=20).as_dict()
    assert math.isnan(data["e"])
    assert (data["solved"], data["for"]) == (None, None)
    with pytest.raises(UsageError, match="at: got e and dampratio, expected one of the two"):
        impact.timestep("mujoco-solref", at={"e": 0.7, "dampratio": 0.12})
    with pytest.raises(UsageError, match=r"at\[\"e\"\]: hertz has no e, and no parameter that sets it"):
        impact.timestep("hertz", at={"e": 0.7})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "at", "parameter", "power"),
    [
        # the contact time of a linear spring falls with the root of its stiffness, that of a sphere with E^(2/5)
        (LINEAR, {"e": 0.8, "K": 1e6}, "K", 0.5),
        ("tsuji-1992", {"e": 0.8}, "materials.table1.E", 0.4),
        ("kelvin-voigt", {"e": 0.8, "K": 1e6, "n": 1.0}, "K", 0.5),
    ],
)
def test_a_softer_contact_lasts_long_enough(
    model: str, at: dict[str, float], parameter: str, power: float
) -> None:
    result = impact.timestep(model, at=at, dt=[1e-3], tol=0.02, parameter=parameter, phases=50)
    needed, steps = result.needed_parameter, result.needed
    assert needed is not None
    assert steps is not None
    value = {"K": 1e6, "materials.table1.E": 56e9}[parameter]
    assert needed.contact_time == pytest.approx(steps.steps_per_contact * 1e-3, rel=1e-5)
    assert needed.contact_time / result.contact_time == pytest.approx((value / needed.value) ** power, rel=1e-4)
    assert not needed.is_least
    unit = {"K": "N/m", "materials.table1.E": "Pa"}[parameter]
    assert str(needed).split(f" {parameter} = ")[1].split()[1].rstrip(":") == unit
    # e is kept where it was solved for: the damping constant falls with the root of the stiffness
    if result.solved:
        (constant,) = result.solved.values()
        assert f"with C = {number(constant * (needed.value / value) ** 0.5, 4)} N s/m" in str(needed)


@pytest.mark.slow
def test_the_relaxation_time_of_drakes_sap_is_named_beside_a_stiffness() -> None:
    """Drake takes C/K in place of C; other schemes have no such parameter."""
    result = impact.timestep(
        "kelvin-voigt-no-tension",
        at={"e": 0.8, "K": 1e6, "n": 1.0},
        dt=[1e-3],
        tol=0.02,
        parameter="K",
        phases=50,
        scheme="drake-sap",
    )
    needed = result.needed_parameter
    assert needed is not None
    assert result.solved is not None
    # e is kept: C falls with the root of K
    relaxation_time = result.solved["C"] / math.sqrt(1e6 * needed.value)
    assert needed.as_dict()["relaxation_time"] == pytest.approx(relaxation_time, rel=1e-6)
    assert str(needed).endswith(f", relaxation_time = C/K = {number(relaxation_time, 4)} s")
    other = replace(needed, relaxation_time=math.nan)
    assert "relaxation_time" not in {*other.as_dict(), *str(other).split()}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "at", "dt", "parameter"),
    [
        ("mujoco-solref", {"e": 0.6}, 2e-4, "timeconst"),
        ("liggghts-hertz", {"e": 0.7, "K": 1e9}, 2e-5, "K"),
        ("liggghts-hertz", {"e": 0.8, "K": 1e9}, 2e-5, "K"),
        ("anagnostopoulos-1988", {"e": 0.8, "K": 1e6}, 1e-3, "K"),
        # the contact time is no power of K
        ("kuwabara-kono-1987", {"kuwabara-kono-1987.A": 1e-4, "K": 1e8}, 1e-3, "K"),
    ],
)
def test_the_value_that_is_printed_is_enough(model: str, at: dict[str, float], dt: float, parameter: str) -> None:
    """It has four digits, and is rounded to the side where every phase is within the tolerance."""
    found = impact.timestep(model, at=at, dt=[dt], tol=0.01, parameter=parameter).needed_parameter
    printed = float(str(found).split(f"{parameter} = ")[1].split()[0])
    assert found is not None
    assert printed == pytest.approx(found.value, rel=1e-3)
    needed = impact.timestep(model, at={**at, parameter: printed}, dt=[dt], tol=0.01).needed
    assert needed is not None
    assert needed.dt >= dt


SAP = ("--model", "kelvin-voigt-no-tension", "--scheme", "drake-sap", "--at", "n=1", "--at", "K=1e6")


@pytest.mark.slow
def test_the_relaxation_time_of_drakes_sap_is_found_with_its_stiffness(cli: Run) -> None:
    """From that time on every phase is within the tolerance at the step, and a tenth below it is not."""
    words = ("timestep", *SAP, "--at", "e=0.7", "--dt", "2 ms", "--tol", "5%", "--for")
    done = cli(*words, "relaxation_time", "--json")
    assert done.returncode == 0, done.stderr
    needed = json.loads(done.stdout)["for"]
    assert list(needed) == ["parameter", "value", "contact_time", "peak_indentation", "tol", "K"]
    for factor, is_enough in ((1.0, True), (1.5, True), (4.0, True), (0.9, False), (0.5, False)):
        # at the same e, K falls with the square of the relaxation time
        relaxation_time, stiffness = factor * needed["value"], needed["K"] / factor**2
        result = impact.timestep(
            "kelvin-voigt-no-tension",
            at={"n": 1.0, "K": stiffness, "C": relaxation_time * stiffness},
            dt=["2 ms"],
            scheme="drake-sap",
        )
        (row,) = result.rows
        assert result.e_continuous == pytest.approx(0.7, abs=1e-8)
        assert (max(row.e_largest - 0.7, 0.7 - row.e_least) <= 0.035 * (1.0 + 1e-9)) == is_enough
    # the same impact is found from the side of the stiffness
    other = json.loads(cli(*words, "K", "--json").stdout)["for"]
    assert (other["value"], other["relaxation_time"]) == (needed["K"], needed["value"])
    text = cli(*words, "relaxation_time").stdout.splitlines()[-1]
    assert "every phase is within 5 % from relaxation_time = 0.01424 s with K = 147.4 N/m: contact of" in text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((*SAP, "--at", "C=100"), "sets e at a given K, and not the contact time: expected --at e=0.8 or another"),
        ((*SAP, "--at", "e=1"), "sets e at a given K, and not the contact time: expected --at e=0.8 or another"),
        (
            ("--model", "drake-point-contact", "--at", "e=0.7"),
            "is C/K of Drake's SAP: impact timestep --model kelvin-voigt-no-tension --scheme drake-sap finds it",
        ),
    ],
)
def test_a_relaxation_time_needs_an_e_to_keep_and_the_scheme_of_sap(
    cli: Run, words: tuple[str, ...], message: str
) -> None:
    done = cli("timestep", *words, "--dt", "2 ms", "--tol", "1%", "--for", "relaxation_time")
    assert_refused(done, message)


@pytest.mark.slow
def test_a_parameter_that_does_not_set_the_time_scale_is_refused(cli: Run) -> None:
    words = ("timestep", "--model", "mujoco-solref", "--at", "dampratio=0.1", "--dt", "2ms")
    for parameter, tol, message in (
        ("timeconstant", "1%", '--for: mujoco-solref has no parameter "timeconstant"; did you mean "timeconst"?'),
        ("timeconst", None, "--for: expected one --dt and --tol as well"),
    ):
        done = cli(*words, "--for", parameter, *(["--tol", tol] if tol else []))
        assert_refused(done, message)
    expected = "parameter: dampratio does not set the contact time of mujoco-solref, expected timeconst"
    with pytest.raises(UsageError, match=expected):
        impact.timestep("mujoco-solref", at={"e": 0.7}, dt=[2e-3], tol=0.01, parameter="dampratio")
    # e changes the contact time of a law of Hertz
    with pytest.raises(UsageError, match=r"contact time of liggghts-hertz, expected materials\.table1\.E"):
        impact.timestep("liggghts-hertz", at={"e": 0.7}, dt=[2e-5], tol=0.01, parameter="e", phases=9)
    with pytest.raises(UsageError, match=r'got E, expected that of a material: "materials\.table1\.E"'):
        impact.timestep("liggghts-hertz", dt=[2e-5], tol=0.01, parameter="E", phases=9)
    refused = cli("timestep", "--model", "mujoco-solref", "--dt", "2 m")
    assert (refused.returncode, refused.stderr) == (2, '--dt: got "2 m", expected a unit of s, such as "1 s"\n')


def test_a_recommended_step_longer_than_the_rayleigh_time_is_for_one_impact() -> None:
    """The contact of an elastic ball is long, and a few steps of it are enough."""
    note = "this dt is longer than the Rayleigh time, 5.358e-05 s: for one impact alone; packings commonly take"
    for e, is_longer in ((0.99, True), (0.5, False)):
        given = {"at": {"e": e, "v1": 0.01}}
        result = impact.timestep("liggghts-hertz", tol=0.01, phases=8, **given)
        assert result.needed is not None
        assert (result.needed.dt > result.rayleigh_time, note in str(result)) == (is_longer, is_longer)
        header = impact.export("liggghts", code_version="3.8.0", **given).header
        assert any(line.startswith(note) for line in header) == is_longer
    # the stiffness of the user has no Rayleigh time
    stiff = impact.timestep("liggghts-hertz", at={"e": 0.99, "v1": 0.01, "K": 1e6}, tol=0.01, phases=8)
    assert "Rayleigh" not in str(stiff)


@pytest.mark.slow
def test_a_step_longer_than_the_contact_is_a_warning(cli: Run) -> None:
    done = cli("timestep", "--model", LINEAR, "--at", "e=0.5", "--dt", "1 ms", "--dt", "1 us", "--phases", "9")
    expected = "warning: dt = 0.001 s: longer than the contact of 0.000290209 s"
    first, second = done.stderr.splitlines()
    assert (first, second[:56]) == (expected, "warning: dt = 0.001 s: unstable at 9 of 9 phases, the st")
    exported = impact.export("lammps", dt="1 ms", code_version="22Jul2025")
    assert any(warning.startswith("dt = 0.001 s: longer than the contact of ") for warning in exported.warnings)


def test_many_steps_take_the_memory_of_few() -> None:
    tracemalloc.start()
    rows = impact.timestep("tsuji-1992", steps_per_contact=[*range(5, 45)]).rows
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert rows[7:8] == impact.timestep("tsuji-1992", steps_per_contact=[12]).rows
    assert peak < 200_000_000
