"""Tables of cases and axes of model parameters give the values of separate sweeps, at the same cost."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st

import impact
from impact.config.grid import Axis
from impact.contact.variables import CENTRAL_OUTPUTS
from impact.engine.plan import MAX_FULL_REPEATED, Plan
from impact.errors import UsageError
from impact.results.provenance import config_of_part
from impact.results.ranking import recommend
from impact.results.selection import select, select_laws
from impact.results.summary import summarize
from impact.results.sweep import read_plan, sweep_in_memory, sweep_into

from .conftest import assert_same_array

LAYOUTS = ("full", "factored")
EVERYTHING = [*CENTRAL_OUTPUTS]
MATERIALS = {
    "steel": {"E": 210e9, "nu": 0.3, "rho": 7850.0, "yield_strength": 0.8e9},
    "brass": {"E": 100e9, "nu": 0.34, "rho": 8500.0, "yield_strength": 0.3e9},
}
MODELS = ["gharib-hurmuzlu-2012", "thornton-1997", "ismail-stronge-2008"]
COLUMNS: dict[str, list[Any]] = {
    "v1": [0.5, 1.0, 2.0, -1.0],
    "m1": [1.0, 2.0, float("inf")],
    "e": [0.1, 0.5, 0.9],
    "material1": ["steel", "brass"],
    "ismail-stronge-2008.gamma": [1.0, 2.0],
    "materials.brass.E": [50e9, 100e9],
}


def plan_of(columns: dict[str, list[Any]], models: list[str] = MODELS, **sweep: Any) -> Plan:
    """A plan with a table of cases beside the axes and scalars of a config."""
    inputs = {
        "e": 0.5,
        "v1": 1.0,
        "m1": 1.0,
        "m2": [0.5, 2.0],
        "material1": "steel",
        "material2": "brass",
        **sweep,
    }
    plan = read_plan(
        {
            "models": models,
            "sweep": inputs,
            "materials": MATERIALS,
            "solver": {"rtol": 1e-4},
            "output": {"variables": EVERYTHING},
        }
    )
    config = plan.config
    scalars = {name: value for name, value in config.scalars.items() if name not in columns}
    cases = Axis({name: tuple(values) for name, values in columns.items()}, numbered="case")
    return replace(plan, config=replace(config, scalars=scalars, axes=(cases, *config.axes)))


def in_layout(plan: Plan, layout: Any) -> Plan:
    return replace(plan, config=replace(plan.config, output=replace(plan.config.output, layout=layout)))


@st.composite
def tables(draw: st.DrawFn) -> dict[str, list[Any]]:
    """Tables of cases, of which some may be equal."""
    names = draw(st.lists(st.sampled_from([*COLUMNS]), min_size=1, max_size=4, unique=True))
    size = draw(st.integers(1, 4))
    return {name: [draw(st.sampled_from(COLUMNS[name])) for _ in range(size)] for name in names}


@pytest.mark.slow
@settings(max_examples=4)
@given(tables())
def test_a_case_equals_a_sweep_with_its_values(columns: dict[str, list[Any]]) -> None:
    plan = plan_of(columns)
    result = sweep_in_memory(plan)
    assert result["case"].values.tolist() == list(range(len(next(iter(columns.values())))))
    for case in result["case"].values.tolist():
        row = {name: values[case] for name, values in columns.items()}
        single = sweep_in_memory(one_row(plan, row))
        for name in EVERYTHING:
            assert_same_array(result[name].isel(case=case), single[name])


def one_row(plan: Plan, row: dict[str, Any]) -> Plan:
    """The plan of a single case, whose values are scalars."""
    config = replace(plan.config, axes=plan.config.axes[1:], scalars={**plan.config.scalars, **row})
    return replace(plan, config=config)


@pytest.fixture(scope="module")
def cases() -> dict[str, list[Any]]:
    return {
        "v1": [0.5, 1.0, 0.5, 1.0],
        "material1": ["steel", "steel", "brass", "steel"],
        "e": [0.5, 0.9, 0.5, 0.9],
    }


@pytest.fixture(scope="module")
def case_result(cases: dict[str, list[Any]]) -> xr.Dataset:
    return sweep_in_memory(plan_of(cases))


@pytest.mark.slow
def test_a_file_of_either_layout_holds_the_cases(tmp_path: Path, cases: dict[str, list[Any]]) -> None:
    plan = plan_of(cases)
    for layout in LAYOUTS:
        outcome = sweep_into(tmp_path / layout, in_layout(plan, layout))
        assert outcome.summary.points == plan.points == 24
    full, factored = (impact.load(tmp_path / layout) for layout in LAYOUTS)
    assert impact.compare(factored, full).equal
    for result in (full, factored):
        assert result.sizes["case"] == 4
        assert result["material1"].dims == result["v1"].dims == ("case",)
        assert result["material1"].values.tolist() == cases["material1"]
        # a part of either can be stored
        impact.save(result.isel(case=[1, 3]), tmp_path / "part.h5", overwrite=True)
        assert impact.load(tmp_path / "part.h5")["case"].values.tolist() == [1, 3]


def test_cases_are_selected_by_number_or_by_their_values(case_result: xr.Dataset) -> None:
    assert select(case_result, {"case": 2})["material1"].item() == "brass"
    assert select(case_result, {"case": "2"})["material1"].item() == "brass"
    assert select(case_result, {"v1": 0.5})["case"].values.tolist() == [0, 2]
    assert select(case_result, {"v1": 0.5, "material1": "brass"})["case"].item() == 2
    with pytest.raises(UsageError, match="no case = 4 in this result"):
        select(case_result, {"case": 4})


def test_cases_are_compared_by_their_numbers(cases: dict[str, list[Any]], case_result: xr.Dataset) -> None:
    reversed_cases = case_result.isel(case=[3, 2, 1, 0])
    assert impact.compare(reversed_cases, case_result).equal
    assert impact.compare(case_result.isel(case=[1, 2]), case_result, subset=True).equal
    fewer = impact.compare(case_result.isel(case=[1, 2]), case_result)
    assert "case: 2 of 4 in BASELINE only: 0, 3" in str(fewer)
    other = sweep_in_memory(plan_of({**cases, "v1": [0.5, 1.0, 0.7, 1.0]}))
    assert "v1 is 0.7 at case 2, in BASELINE 0.5" in str(impact.compare(other, case_result))


def test_a_part_of_the_cases_is_repeated_under_their_numbers(
    cases: dict[str, list[Any]], case_result: xr.Dataset
) -> None:
    plan = plan_of(cases)
    part = case_result.isel(case=[1, 2])
    repeated = sweep_in_memory(replace(plan, config=config_of_part(plan.config, part)))
    assert repeated["case"].values.tolist() == [1, 2]
    assert impact.compare(repeated, part).equal


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS)
def test_cases_are_appended_and_keep_their_numbers(tmp_path: Path, layout: str) -> None:
    def config(**cases: Any) -> dict[str, Any]:
        sweep = {"cases": cases, "e": [0.3, 0.9], "m1": 1.0, "m2": 1.0, "material": "steel"}
        return {
            "models": ["thornton-1997", "gharib-hurmuzlu-2012"],
            "sweep": sweep,
            "materials": MATERIALS,
            "solver": {"rtol": 1e-4},
            "output": {"layout": layout},
        }

    sweep_into(tmp_path / "r.h5", read_plan(config(v1=[1.0, 0.5, 1.0])))
    whole = impact.sweep(config(v1=[1.0, 0.5, 1.0, 2.0]))
    for wrong in ("[1.0, 2.0, 1.0, 2.0]", "[1.0, 0.5]"):
        with pytest.raises(UsageError, match="expected the cases that the result has, in their order"):
            impact.extend(tmp_path / "r.h5", [f"sweep.cases={{v1={wrong}}}"])
    extended = impact.extend(tmp_path / "r.h5", ["sweep.cases={v1=[1.0, 0.5, 1.0, 2.0]}"])
    assert extended["case"].values.tolist() == [0, 1, 2, 3]
    for name in whole.data_vars:
        assert_same_array(extended[name], whole[name])


def test_equal_cases_are_integrated_once(cases: dict[str, list[Any]]) -> None:
    plan = plan_of(cases, models=["gharib-hurmuzlu-2012"], m2=1.0)
    # the model depends on e only
    assert plan.maps[0].count == 2


# a parameter of each model, which is an axis
PARAMETER_OF = {
    "kelvin-voigt": "C",
    "kuwabara-kono-1987": "A",
    "hertz-power-damping": "C",
    "ismail-stronge-2008": "gamma",
    "johnson-1985": "c",
    "thornton-1997": "c",
    "recurdyn": "c",
    "modelica-elastogap": "d",
    "mujoco-solref": "dampratio",
    "lammps-viscoelastic-hertz": "eta",
}
VALUES = [1.0, 1.5, 2.0, 3.0]
SPEEDS = [0.5, 1.0]


def axes_of_parameters(keys: list[str], **output: Any) -> Plan:
    """Several models, each with an axis of one of its parameters, over two speeds."""
    return read_plan(
        {
            "models": keys,
            "materials": MATERIALS,
            "solver": {"rtol": 1e-4},
            "output": output,
            "sweep": {"e": 0.5, "v1": SPEEDS, "m1": 1.0, "m2": 1.0, "material": "steel"},
            "model": {key: {PARAMETER_OF[key]: VALUES} for key in keys},
        }
    )


@pytest.fixture(scope="module")
def ten() -> tuple[Plan, xr.Dataset]:
    plan = axes_of_parameters([*PARAMETER_OF])
    return plan, sweep_in_memory(plan)


@pytest.fixture(scope="module")
def results_alone() -> dict[str, xr.Dataset]:
    """The result of each model without the others."""
    return {key: sweep_in_memory(axes_of_parameters([key])) for key in PARAMETER_OF}


def test_ten_models_with_their_parameters_as_axes_cost_as_much_as_each_alone(ten: tuple[Plan, xr.Dataset]) -> None:
    plan, result = ten
    assert plan.points == len(PARAMETER_OF) * len(VALUES) * len(SPEEDS) == summarize(result).points
    assert plan.stored_points == len(PARAMETER_OF) * len(VALUES) ** len(PARAMETER_OF) * len(SPEEDS)
    # the number of stored points is bounded
    assert plan.stored_points > MAX_FULL_REPEATED
    assert plan.layout == "factored"
    for trajectories, key in zip(plan.maps, PARAMETER_OF, strict=True):
        (alone,) = axes_of_parameters([key]).maps
        assert trajectories.count == alone.count <= len(VALUES) * len(SPEEDS)


@pytest.mark.slow
def test_a_model_does_not_depend_on_parameters_of_other_models(
    ten: tuple[Plan, xr.Dataset], results_alone: dict[str, xr.Dataset]
) -> None:
    _, result = ten
    for position, key in enumerate(PARAMETER_OF):
        alone = results_alone[key]
        others = {
            f"{other}.{name}": position % len(VALUES) for other, name in PARAMETER_OF.items() if other != key
        }
        for name in alone.data_vars:
            dims = {dim: at for dim, at in others.items() if dim in result[name].dims}
            part = result[name].isel(dims)
            whole = part.isel(model=[position]) if "model" in part.dims else part
            assert_same_array(whole.transpose(*alone[name].dims), alone[name])


def test_a_model_without_collapse_is_integrated_along_its_own_axes_only() -> None:
    plan = axes_of_parameters(["kelvin-voigt", "ismail-stronge-2008"])
    solver = replace(plan.config.solver, collapse=False)
    plan = replace(plan, config=replace(plan.config, solver=solver))
    assert [trajectories.count for trajectories in plan.maps] == [len(VALUES) * len(SPEEDS)] * 2


@pytest.mark.slow
def test_files_summaries_and_commands_count_the_same_points(tmp_path: Path, cli: Any) -> None:
    plan = axes_of_parameters(["kelvin-voigt", "ismail-stronge-2008", "johnson-1985"])
    assert plan.layout == "full"
    for layout in LAYOUTS:
        outcome = sweep_into(tmp_path / f"{layout}.h5", in_layout(plan, layout))
        counts = outcome.as_dict()
        assert counts["points"] == sum(counts["status"].values()) == plan.points == 24
        stored = impact.load(tmp_path / f"{layout}.h5")
        assert summarize(stored).counts == outcome.summary.counts
        assert json.loads(cli("info", tmp_path / f"{layout}.h5", "--json").stdout)["points"] == 24


def test_a_failed_point_is_named_without_parameters_of_other_models(tmp_path: Path) -> None:
    plan = axes_of_parameters(["kelvin-voigt", "johnson-1985"])
    solver = replace(plan.config.solver, max_steps=3)
    plan = replace(plan, config=replace(plan.config, solver=solver))
    counts = sweep_into(tmp_path / "r.h5", plan).as_dict()
    assert counts["first_failed"]
    for failure in counts["first_failed"]:
        key = failure["at"]["model"]
        assert {*failure["at"]} == {"model", "v1", f"{key}.{PARAMETER_OF[key]}"}
        assert failure["replay"].count("--at") == 2


@pytest.mark.slow
def test_a_ranking_takes_the_best_parameters_of_each_model(
    ten: tuple[Plan, xr.Dataset], results_alone: dict[str, xr.Dataset]
) -> None:
    ranked = {entry.model: entry for entry in recommend(ten[1], tol=0.05).models}
    assert ranked.keys() == PARAMETER_OF.keys()
    for key, name in PARAMETER_OF.items():
        alone = results_alone[key]
        each = [recommend(alone, tol=0.05, sel={f"{key}.{name}": value}).models[0] for value in VALUES]
        best = min(each, key=lambda entry: (-entry.share, entry.max_error))
        entry = ranked[key]
        assert entry.parameters == {f"model.{key}.{name}": VALUES[each.index(best)]}
        assert (entry.points, entry.within, entry.max_error) == (len(SPEEDS), best.within, best.max_error)
        assert entry.at == {"v1": best.at["v1"], f"{key}.{name}": VALUES[each.index(best)], "e": 0.5}


def test_an_axis_with_a_common_input_is_common_to_all_models() -> None:
    plan = axes_of_parameters(["kelvin-voigt", "johnson-1985"])
    axes = (Axis({"v1": (0.5, 1.0), "johnson-1985.c": (1.0, 2.0)}), plan.config.axes[1])
    plan = replace(plan, config=replace(plan.config, axes=axes))
    assert plan.points == 2 * len(VALUES) + 2
    names = {entry.model: entry.parameters for entry in recommend(sweep_in_memory(plan)).models}
    assert names["johnson-1985"] == {}
    assert [*names["kelvin-voigt"]] == ["model.kelvin-voigt.C"]


def test_a_missing_value_counts_once_along_parameters_of_other_laws() -> None:
    """The balls do not meet at v1 = -1: one cell of each law, and each of its own parameter."""
    result = impact.sweep({
        "models": ["tsuji-1992", "ismail-stronge-2008"],
        "sweep": {"e": 0.5, "v1": [-1.0, 1.0], "m1": 1.0, "m2": 1.0, "K": 1e9},
        "model": {"ismail-stronge-2008": {"gamma": [1.1, 1.5, 2.0], "K": 1e7}},
    })  # fmt: skip
    assert impact.info(result)["variables"]["e_out"]["missing"] == 1 + 3


def test_words_and_laws_are_selected_and_what_is_missing_is_named() -> None:
    balls = {"m1": 1.0, "m2": 1.0, "R1": 0.05, "R2": 0.05, "K": 1e6}
    sweep = {**balls, "v1": [*range(1, 11)], "mu": 0.3, "angle": 0.5, "e": 0.5}
    limit = "friction.coulomb-1785.limit"
    friction = {"frictions": "coulomb-1785", "friction": {"coulomb-1785": {"limit": ["abs", "positive"]}}}
    result = impact.sweep({"models": ["hertz", "tsuji-1992"], "sweep": sweep, **friction})
    assert select(result, {limit: "positive"})[limit].item() == 1.0
    with pytest.raises(UsageError, match=r"no v1 = 3\.4 in this result; the nearest are 3 and 4"):
        select(result, {"v1": 3.4})
    with pytest.raises(UsageError, match='no axis "model" in this result'):
        select(result, {"model": "hertz"})
    # a stiffness has the unit that belongs to n
    stiff = impact.sweep(models=["hertz"], K=[1e6, 1e8], e=0.5, v1=1.0, m1=1.0, m2=1.0)
    assert select(stiff, {"K": "1000 kN/m^1.5"})["K"].item() == 1e6
    with pytest.raises(UsageError, match=r"no K = 1000 kN/m in this result; K is 1e\+06, 1e\+08"):
        select(stiff, {"K": "1000 kN/m"})
    assert select_laws(result, ["tsuji-1992", "tsuji-1992"]).sizes["model"] == 1
    # the law of a part is no dimension
    part = result.isel(model=0)
    assert select_laws(part, "hertz").sizes == part.sizes
