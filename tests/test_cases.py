"""Numbered points, and parameters that belong to one law: what they give and what they cost."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import impact
from impact.api import execute, prepare
from impact.cli.summary import summary_json
from impact.config.load import Axis
from impact.engine.plan import MAX_FULL_REPEATED, Plan
from impact.engine.trajectories import trajectory_maps
from impact.errors import UsageError
from impact.results.provenance import config_of_part
from impact.results.ranking import ranking
from impact.results.schema import SCHEMA
from impact.results.selection import select
from impact.results.summary import summarize
from impact.results.sweep import sweep_into

LAYOUTS = ("full", "factored")
EVERYTHING = [variable.name for variable in SCHEMA]
MATERIALS = {
    "steel": {"E": 210e9, "nu": 0.3, "rho": 7850.0, "yield_strength": 0.8e9},
    "brass": {"E": 100e9, "nu": 0.34, "rho": 8500.0, "yield_strength": 0.3e9},
}
MODELS = ["gharib-hurmuzlu-2012", "thornton-1997", "ismail-stronge-2008"]
COLUMNS: dict[str, list[Any]] = {
    "v1": [0.5, 1.0, 2.0, -1.0], "m1": [1.0, 2.0, float("inf")], "e": [0.1, 0.5, 0.9],
    "material1": ["steel", "brass"], "ismail-stronge-2008.gamma": [1.0, 2.0], "materials.brass.E": [50e9, 100e9],
}  # fmt: skip


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
    plan = prepare({
        "models": models, "sweep": inputs, "materials": MATERIALS, "solver": {"rtol": 1e-6},
        "output": {"variables": EVERYTHING},
    })  # fmt: skip
    config = plan.config
    scalars = {name: value for name, value in config.scalars.items() if name not in columns}
    cases = Axis({name: tuple(values) for name, values in columns.items()}, numbered="case")
    return replace(plan, config=replace(config, scalars=scalars, axes=(cases, *config.axes)))


def in_layout(plan: Plan, layout: Any) -> Plan:
    return replace(plan, config=replace(plan.config, output=replace(plan.config.output, layout=layout)))


def same_bits(one: xr.DataArray, other: xr.DataArray) -> None:
    assert (one.dims, one.dtype) == (other.dims, other.dtype)
    assert one.values.tobytes() == other.values.tobytes(), one.name


@st.composite
def tables(draw: st.DrawFn) -> dict[str, list[Any]]:
    """Tables of cases, some of them alike."""
    names = draw(st.lists(st.sampled_from([*COLUMNS]), min_size=1, max_size=4, unique=True))
    size = draw(st.integers(1, 4))
    return {name: [draw(st.sampled_from(COLUMNS[name])) for _ in range(size)] for name in names}


@settings(max_examples=8)
@given(tables())
def test_a_case_is_what_a_sweep_with_its_values_gives(columns: dict[str, list[Any]]) -> None:
    plan = plan_of(columns)
    result = execute(plan)
    assert result["case"].values.tolist() == list(range(len(next(iter(columns.values())))))
    for case in result["case"].values.tolist():
        row = {name: values[case] for name, values in columns.items()}
        single = execute(one_row(plan, row))
        for name in EVERYTHING:
            same_bits(result[name].isel(case=case), single[name])


def one_row(plan: Plan, row: dict[str, Any]) -> Plan:
    """The plan of one case alone, whose values are scalars."""
    config = replace(plan.config, axes=plan.config.axes[1:], scalars={**plan.config.scalars, **row})
    return replace(plan, config=config)


@pytest.fixture(scope="module")
def cases() -> dict[str, list[Any]]:
    return {
        "v1": [0.5, 1.0, 0.5, 1.0],
        "material1": ["steel", "steel", "brass", "steel"],
        "e": [0.5, 0.9, 0.5, 0.9],
    }


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
        # both are stored again, and a part as well
        impact.save(result.isel(case=[1, 3]), tmp_path / "part.h5", overwrite=True)
        assert impact.load(tmp_path / "part.h5")["case"].values.tolist() == [1, 3]


def test_cases_are_selected_by_number_or_by_what_several_have(cases: dict[str, list[Any]]) -> None:
    result = execute(plan_of(cases))
    assert select(result, {"case": 2})["material1"].item() == "brass"
    assert select(result, {"case": "2"})["material1"].item() == "brass"
    assert select(result, {"v1": 0.5})["case"].values.tolist() == [0, 2]
    assert select(result, {"v1": 0.5, "material1": "brass"})["case"].item() == 2
    with pytest.raises(UsageError, match="no case = 4 in this result"):
        select(result, {"case": 4})


def test_cases_are_compared_by_their_numbers(cases: dict[str, list[Any]]) -> None:
    result = execute(plan_of(cases))
    reversed_cases = result.isel(case=[3, 2, 1, 0])
    assert impact.compare(reversed_cases, result).equal
    assert impact.compare(result.isel(case=[1, 2]), result, subset=True).equal
    fewer = impact.compare(result.isel(case=[1, 2]), result)
    assert "case: 2 of 4 in BASELINE only: 0, 3" in str(fewer)
    other = execute(plan_of({**cases, "v1": [0.5, 1.0, 0.7, 1.0]}))
    assert "v1 is 0.7 at case 2, in BASELINE 0.5" in str(impact.compare(other, result))


def test_a_part_of_the_cases_is_repeated_under_their_numbers(cases: dict[str, list[Any]]) -> None:
    plan = plan_of(cases)
    held = execute(plan).isel(case=[1, 2])
    again = execute(replace(plan, config=config_of_part(plan.config, held)))
    assert again["case"].values.tolist() == [1, 2]
    assert impact.compare(again, held).equal


@pytest.mark.parametrize("layout", LAYOUTS)
def test_cases_are_appended_and_keep_their_numbers(tmp_path: Path, layout: str) -> None:
    def config(**cases: Any) -> dict[str, Any]:
        sweep = {"cases": cases, "e": [0.3, 0.9], "m1": 1.0, "m2": 1.0, "material": "steel"}
        return {
            "models": ["thornton-1997", "gharib-hurmuzlu-2012"], "sweep": sweep, "materials": MATERIALS,
            "solver": {"rtol": 1e-6}, "output": {"layout": layout},
        }  # fmt: skip

    sweep_into(tmp_path / "r.h5", prepare(config(v1=[1.0, 0.5, 1.0])))
    whole = impact.sweep(config(v1=[1.0, 0.5, 1.0, 2.0]))
    for wrong in ("[1.0, 2.0, 1.0, 2.0]", "[1.0, 0.5]"):
        with pytest.raises(UsageError, match="expected the cases that the result has, in their order"):
            impact.extend(tmp_path / "r.h5", [f"sweep.cases={{v1={wrong}}}"])
    extended = impact.extend(tmp_path / "r.h5", ["sweep.cases={v1=[1.0, 0.5, 1.0, 2.0]}"])
    assert extended["case"].values.tolist() == [0, 1, 2, 3]
    for name in whole.data_vars:
        same_bits(extended[name], whole[name])


def test_cases_of_which_several_are_alike_are_integrated_once(cases: dict[str, list[Any]]) -> None:
    plan = plan_of(cases, models=["gharib-hurmuzlu-2012"], m2=1.0)
    # that law knows e only
    assert trajectory_maps(plan)[0].count == 2


# laws with a parameter of their own, which is an axis
OWN = {
    "kelvin-voigt": "C", "kuwabara-kono-1987": "A", "hertz-power-damping": "C", "ismail-stronge-2008": "gamma",
    "johnson-1985": "c", "thornton-1997": "c", "recurdyn": "c", "modelica-elastogap": "d",
    "mujoco-solref": "dampratio", "lammps-viscoelastic-hertz": "eta",
}  # fmt: skip
VALUES = [1.0, 1.5, 2.0, 3.0]
SPEEDS = [0.5, 1.0]


def own_axes(keys: list[str], **output: Any) -> Plan:
    """Several laws, each with an axis of its own parameter, over two speeds."""
    return prepare({
        "models": keys, "materials": MATERIALS, "solver": {"rtol": 1e-6}, "output": output,
        "sweep": {"e": 0.5, "v1": SPEEDS, "m1": 1.0, "m2": 1.0, "material": "steel"},
        "model": {key: {OWN[key]: VALUES} for key in keys},
    })  # fmt: skip


@pytest.fixture(scope="module")
def ten() -> tuple[Plan, xr.Dataset]:
    plan = own_axes([*OWN])
    return plan, execute(plan)


def test_ten_laws_with_axes_of_their_own_cost_what_each_alone_does(ten: tuple[Plan, xr.Dataset]) -> None:
    plan, result = ten
    assert plan.points == len(OWN) * len(VALUES) * len(SPEEDS) == summarize(result).points
    assert plan.stored_points == len(OWN) * len(VALUES) ** len(OWN) * len(SPEEDS)
    # what is stored is bounded
    assert plan.stored_points > MAX_FULL_REPEATED
    assert plan.layout == "factored"
    for own, key in zip(trajectory_maps(plan), OWN, strict=True):
        (alone,) = trajectory_maps(own_axes([key]))
        assert own.count == alone.count <= len(VALUES) * len(SPEEDS)


def test_a_law_is_what_it_is_alone_at_any_place_on_the_axes_of_others(ten: tuple[Plan, xr.Dataset]) -> None:
    _, result = ten
    for place, key in enumerate(OWN):
        alone = execute(own_axes([key]))
        others = {f"{other}.{name}": place % len(VALUES) for other, name in OWN.items() if other != key}
        for name in alone.data_vars:
            dims = {dim: at for dim, at in others.items() if dim in result[name].dims}
            part = result[name].isel(dims)
            whole = part.isel(model=[place]) if "model" in part.dims else part
            same_bits(whole.transpose(*alone[name].dims), alone[name])


def test_a_law_without_collapse_is_integrated_at_its_own_points() -> None:
    plan = own_axes(["kelvin-voigt", "ismail-stronge-2008"])
    solver = replace(plan.config.solver, collapse=False)
    plan = replace(plan, config=replace(plan.config, solver=solver))
    assert [own.count for own in trajectory_maps(plan)] == [len(VALUES) * len(SPEEDS)] * 2


def test_points_are_counted_alike_in_every_place(tmp_path: Path, cli: Any) -> None:
    plan = own_axes(["kelvin-voigt", "ismail-stronge-2008", "johnson-1985"])
    assert plan.layout == "full"
    for layout in LAYOUTS:
        outcome = sweep_into(tmp_path / f"{layout}.h5", in_layout(plan, layout))
        counts = summary_json(outcome, tmp_path / f"{layout}.h5")
        assert counts["points"] == sum(counts["status"].values()) == plan.points == 24
        stored = impact.load(tmp_path / f"{layout}.h5")
        assert summarize(stored).counts == outcome.summary.counts
        assert json.loads(cli("info", tmp_path / f"{layout}.h5", "--json").stdout)["points"] == 24


def test_a_failed_point_is_named_without_parameters_of_other_laws(tmp_path: Path) -> None:
    plan = own_axes(["kelvin-voigt", "johnson-1985"])
    solver = replace(plan.config.solver, max_steps=3)
    plan = replace(plan, config=replace(plan.config, solver=solver))
    counts = summary_json(sweep_into(tmp_path / "r.h5", plan), tmp_path / "r.h5")
    assert counts["first_failed"]
    for failure in counts["first_failed"]:
        key = failure["at"]["model"]
        assert {*failure["at"]} == {"model", "v1", f"{key}.{OWN[key]}"}
        assert failure["replay"].count("--at") == 2


def test_a_ranking_takes_the_best_values_of_each_law(ten: tuple[Plan, xr.Dataset]) -> None:
    ranked = {one.model: one for one in ranking(ten[1], tol=0.05).models}
    assert ranked.keys() == OWN.keys()
    for key, name in OWN.items():
        alone = execute(own_axes([key]))
        each = [ranking(alone, tol=0.05, sel={f"{key}.{name}": value}).models[0] for value in VALUES]
        best = min(each, key=lambda one: (-one.share, one.max_error))
        one = ranked[key]
        assert one.parameters == {f"model.{key}.{name}": VALUES[each.index(best)]}
        assert (one.points, one.within, one.max_error) == (len(SPEEDS), best.within, best.max_error)
        assert one.at == {"v1": best.at["v1"], f"{key}.{name}": VALUES[each.index(best)], "e": 0.5}


def test_an_axis_of_own_and_shared_columns_is_shared() -> None:
    plan = own_axes(["kelvin-voigt", "johnson-1985"])
    axes = (Axis({"v1": (0.5, 1.0), "johnson-1985.c": (1.0, 2.0)}), plan.config.axes[1])
    plan = replace(plan, config=replace(plan.config, axes=axes))
    assert plan.points == 2 * len(VALUES) + 2
    names = {one.model: one.parameters for one in ranking(execute(plan)).models}
    assert names["johnson-1985"] == {}
    assert [*names["kelvin-voigt"]] == ["model.kelvin-voigt.C"]
