"""Properties of materials are axes like any other, and a mass may come from a radius and a density."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import impact
from impact.api import execute, prepare
from impact.config.load import Axis
from impact.contact.materials import Material
from impact.engine.plan import Plan
from impact.engine.trajectories import trajectory_maps
from impact.errors import ModelError, UsageError
from impact.results.schema import SCHEMA
from impact.results.sweep import sweep_into

from .conftest import Run

STEEL = {"E": 210e9, "nu": 0.3, "rho": 7850.0, "yield_strength": 0.8e9}
BRASS = {"E": 100e9, "nu": 0.34, "rho": 8500.0, "yield_strength": 0.3e9}
PROPERTIES: dict[str, list[float]] = {
    "E": [5e9, 70e9, 210e9], "nu": [-0.2, 0.0, 0.3], "rho": [1000.0, 2700.0, 7850.0],
    "yield_strength": [0.1e9, 0.4e9, 1e9],
}  # fmt: skip
LAYOUTS = ("full", "factored")
EVERYTHING = [variable.name for variable in SCHEMA]
# by Hertz, by yield strength, with a rule of K of its own, and another one by Hertz
LAWS = ["gharib-hurmuzlu-2012", "thornton-1997", "liggghts-hooke", "bilinear"]


def config(sweep: dict[str, Any], materials: dict[str, dict[str, float]], models: list[str] = LAWS) -> Any:
    given = {"e": [0.3, 0.9], "v1": [0.5, 2.0], **sweep}
    known = impact.models()
    return {
        "models": [key for key in models if key in known], "sweep": given, "materials": materials,
        "solver": {"rtol": 1e-6}, "output": {"variables": EVERYTHING},
    }  # fmt: skip


def with_axes(plan: Plan, *axes: Axis) -> Plan:
    """The plan with more axes; what they vary is unknown in the table of materials, and no scalar."""
    names = {name for axis in axes for name in axis.columns}
    materials = {
        name: replace(
            material,
            **{
                key: np.nan if key in ("E", "nu") else None
                for key in PROPERTIES
                if f"materials.{name}.{key}" in names
            },
        )
        for name, material in plan.config.materials.items()
    }
    scalars = {name: value for name, value in plan.config.scalars.items() if name not in names}
    changed = replace(plan.config, axes=(*plan.config.axes, *axes), materials=materials, scalars=scalars)
    return replace(plan, config=changed)


def same_bits(one: xr.DataArray, other: xr.DataArray) -> None:
    assert one.dims == other.dims
    assert one.dtype == other.dtype
    assert one.values.tobytes() == other.values.tobytes(), one.name


@settings(max_examples=4, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([*PROPERTIES]), st.sampled_from([*PROPERTIES]),
    st.sampled_from([{"m1": 1.0, "m2": [0.5, float("inf")]}, {"R1": 0.02, "R2": [0.01, float("inf")]}]),
)  # fmt: skip
def test_a_sweep_over_properties_is_the_sweeps_at_each_of_their_values(
    tmp_path: Path, first: str, second: str, balls: dict[str, Any]
) -> None:
    # the first ball is of either material, so that a property of steel matters for some points only
    sweep = {**balls, "material1": ["steel", "brass"], "material2": "brass"}
    mixed = _prepared(config(sweep, {"steel": STEEL, "brass": BRASS}))
    axes = {f"materials.steel.{first}": PROPERTIES[first], f"materials.brass.{second}": PROPERTIES[second][:2]}
    plan = with_axes(mixed, *(Axis({name: tuple(values)}) for name, values in axes.items()))
    tables = [
        {"steel": {**STEEL, first: value}, "brass": {**BRASS, second: other}}
        for value in PROPERTIES[first]
        for other in PROPERTIES[second][:2]
    ]
    singles = [execute(_prepared(config(sweep, table))) for table in tables]
    for layout in LAYOUTS:
        stored = replace(plan, config=replace(plan.config, output=replace(plan.config.output, layout=layout)))
        outcome = sweep_into(tmp_path / layout, stored, overwrite=True)
        assert outcome.summary.points == plan.points
        result = impact.load(tmp_path / layout)
        assert result["materials.steel." + first].attrs["units"]
        for number, single in enumerate(singles):
            i, j = divmod(number, 2)
            part = result.isel({f"materials.steel.{first}": i, f"materials.brass.{second}": j})
            for name in EVERYTHING:
                same_bits(part[name], single[name])


def _prepared(config: Any) -> Plan:
    """The plan of a config in which masses may be left out: it is read with some, which are then taken out."""
    missing = {f"m{ball}": 1.0 for ball in "12" if f"m{ball}" not in config["sweep"]}
    plan = prepare({**config, "sweep": {**config["sweep"], **missing}})
    scalars = {name: value for name, value in plan.config.scalars.items() if name not in missing}
    return replace(plan, config=replace(plan.config, scalars=scalars))


BALLS = {"v1": 1.0, "e": [0.3, 0.9]}
LAW = ["gharib-hurmuzlu-2012"]


def test_a_mass_comes_from_a_radius_and_a_density() -> None:
    balls = {**BALLS, "R1": [0.01, 0.02], "R2": float("inf"), "material": "steel"}
    result = execute(_prepared(config(balls, {"steel": STEEL}, LAW)))
    masses = [4.0 / 3.0 * np.pi * radius**3 * STEEL["rho"] for radius in (0.01, 0.02)]
    assert result["m1"].dims == ("R1",)
    assert result["m1"].attrs["units"] == "kg"
    np.testing.assert_allclose(result["m1"], masses, rtol=1e-15)
    assert result["m2"].item() == np.inf
    for place, mass in enumerate(masses):
        single = impact.sweep(config({**balls, "R1": [0.01, 0.02][place], "m1": mass, "m2": float("inf")},
                                     {"steel": STEEL}, LAW))  # fmt: skip
        np.testing.assert_allclose(result["e_out"].isel(R1=place), single["e_out"], rtol=1e-13)
        np.testing.assert_allclose(result["contact_time"].isel(R1=place), single["contact_time"], rtol=1e-13)


def test_a_derived_mass_varies_with_all_that_it_comes_from(tmp_path: Path) -> None:
    plan = with_axes(
        _prepared(config({**BALLS, "R1": [0.01, 0.02], "R2": 0.01, "material": "steel"}, {"steel": STEEL}, LAW)),
        Axis({"materials.steel.rho": (1000.0, 7850.0)}),
    )
    for layout in LAYOUTS:
        stored = replace(plan, config=replace(plan.config, output=replace(plan.config.output, layout=layout)))
        sweep_into(tmp_path / layout, stored)
    full, factored = (impact.load(tmp_path / layout) for layout in LAYOUTS)
    assert full["m1"].dims == ("R1", "materials.steel.rho")
    assert full["m2"].dims == ("materials.steel.rho",)
    for name in EVERYTHING:
        same_bits(full[name], factored[name])
    same_bits(full["m1"], factored["m1"])
    assert impact.compare(factored, full).equal
    # where the worst point lies is said by what a config has, and not by what follows from it
    assert {*impact.recommend(full).models[0].at} == {"e", "R1", "materials.steel.rho"}


def test_mass_radius_and_density_together_are_taken_as_they_are() -> None:
    balls = {**BALLS, "R1": 0.01, "R2": 0.01, "m1": 1.0, "m2": 2.0, "material": "steel"}
    result = impact.sweep(config(balls, {"steel": STEEL}, LAW))
    lighter = impact.sweep(config(balls, {"steel": {**STEEL, "rho": 1.0}}, LAW))
    assert (result["m1"].item(), result["m2"].item()) == (1.0, 2.0)
    same_bits(result["e_out"], lighter["e_out"])


def test_a_mass_that_nothing_gives_is_refused() -> None:
    balls = {**BALLS, "R1": 0.01, "R2": 0.01, "K": 1e9, "material": "steel"}
    plan = _prepared(config(balls, {"steel": STEEL}, LAW))
    without = replace(plan, config=replace(plan.config, materials={"steel": Material(210e9, 0.3)}))
    with pytest.raises(ModelError, match="m1: missing, expected m1, or R1 and the density rho of its material"):
        execute(without)


def test_a_material_that_cannot_name_a_variable_is_refused_before_anything_is_integrated() -> None:
    balls = {**BALLS, "m1": 1.0, "m2": 1.0, "material": "soft steel"}
    plan = with_axes(
        prepare(config(balls, {"soft steel": STEEL}, LAW)), Axis({"materials.soft steel.E": (1e9, 2e9)})
    )
    with pytest.raises(UsageError, match=r"materials\.soft steel\.E: expected a material name without spaces"):
        execute(plan)


def test_a_file_names_the_property_with_its_unit_and_no_value_in_its_table(tmp_path: Path) -> None:
    balls = {**BALLS, "m1": 1.0, "m2": 1.0, "material": "steel"}
    plan = with_axes(prepare(config(balls, {"steel": STEEL}, LAW)), Axis({"materials.steel.E": (1e9, 2e9)}))
    sweep_into(tmp_path / "r.h5", plan)
    with xr.open_dataset(tmp_path / "r.h5", engine="h5netcdf") as stored:
        E = stored["materials.steel.E"]
        assert (E.dims, E.attrs["units"]) == (("materials.steel.E",), "Pa")
        assert E.attrs["long_name"] == "Young's modulus of steel"
        assert json.loads(stored.attrs["materials"])["steel"] == {**STEEL, "E": None}


def test_a_sweep_over_a_property_is_compared_with_a_sweep_at_one_value() -> None:
    balls = {**BALLS, "m1": 1.0, "m2": 1.0, "material": "steel"}
    single = impact.sweep(config(balls, {"steel": STEEL}, LAW))
    plan = prepare(config(balls, {"steel": STEEL}, LAW))
    swept = execute(with_axes(plan, Axis({"materials.steel.E": (1e9, STEEL["E"])})))
    assert impact.compare(single, swept, subset=True).equal
    assert impact.compare(swept.sel({"materials.steel.E": STEEL["E"]}), single).equal
    other = impact.compare(swept.sel({"materials.steel.E": 1e9}), single)
    assert "materials.steel.E is 1000000000, in BASELINE 210000000000" in str(other)


def test_a_law_that_asks_for_no_property_is_not_integrated_again() -> None:
    # a bilinear law with its own stiffness knows no material
    sweep = {**BALLS, "m1": 1.0, "m2": 1.0, "material": "steel"}
    given = {**config(sweep, {"steel": STEEL}, ["bilinear", "thornton-1997"]), "model": {"bilinear": {"K": 1e6}}}
    plan = with_axes(prepare(given), Axis({"materials.steel.yield_strength": (0.1e9, 0.2e9, 0.3e9)}))
    assert [own.count for own in trajectory_maps(plan)] == [2, 3]


@pytest.mark.parametrize("layout", LAYOUTS)
def test_values_of_a_property_are_added_to_a_result(tmp_path: Path, cli: Run, layout: str) -> None:
    def swept(**properties: Any) -> dict[str, Any]:
        sweep = {"e": [0.3, 0.9], "v1": 1.0, "R1": 0.01, "R2": 0.02, "material1": "steel", "material2": "brass"}
        given = config(sweep, {"steel": {**STEEL, **properties}, "brass": BRASS})
        return {**given, "output": {"layout": layout}}

    sweep_into(tmp_path / "r.h5", prepare(swept(yield_strength=[0.1e9, 0.8e9])))
    # an axis with another value, and a scalar that becomes an axis
    words = ["--set", "materials.steel.yield_strength=[3e8]", "--set", "materials.steel.rho=[7850, 1000]"]
    assert cli("extend", tmp_path / "r.h5", *words, "-o", tmp_path / "more.h5", "-q").returncode == 0
    more = impact.load(tmp_path / "more.h5")
    whole = impact.sweep(swept(yield_strength=[0.1e9, 0.8e9, 0.3e9], rho=[7850.0, 1000.0]))
    for name in whole.data_vars:
        same_bits(more[name].transpose(*whole[name].dims), whole[name])
    assert impact.rerun(tmp_path / "more.h5").equal
    # a point of the file, and one that is not on its grid
    for strength in (0.8e9, 0.5e9):
        at = [
            "--at",
            f"materials.steel.yield_strength={strength}",
            "--at",
            "materials.steel.rho=1000",
            "--at",
            "e=0.9",
        ]
        run = json.loads(cli("run", tmp_path / "more.h5", "--model", "thornton-1997", *at, "--json").stdout)
        single = impact.sweep(swept(yield_strength=strength, rho=1000.0)).sel(model="thornton-1997", e=0.9)
        assert run["outputs"]["e_out"] == single["e_out"].item()
