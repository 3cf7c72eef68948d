"""Material properties are axes like other inputs, and a mass may follow from a radius and a density."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact
from impact.config.grid import Axis
from impact.contact.materials import Material
from impact.contact.variables import CENTRAL_OUTPUTS
from impact.engine.plan import Plan
from impact.engine.run import Run
from impact.errors import ModelError, UsageError
from impact.results.sweep import read_plan, sweep_in_memory, sweep_into

from .conftest import assert_same_array

STEEL = {"E": 210e9, "nu": 0.3, "rho": 7850.0, "yield_strength": 0.8e9}
BRASS = {"E": 100e9, "nu": 0.34, "rho": 8500.0, "yield_strength": 0.3e9}
PROPERTIES: dict[str, list[float]] = {
    "E": [5e9, 70e9, 210e9],
    "nu": [-0.2, 0.0, 0.3],
    "rho": [1000.0, 2700.0, 7850.0],
    "yield_strength": [0.1e9, 0.4e9, 1e9],
}
LAYOUTS = ("full", "factored")
EVERYTHING = [*CENTRAL_OUTPUTS]
# a stiffness by Hertz, one with a yield strength, one with its own rule for K, and another one by Hertz
LAWS = ["gharib-hurmuzlu-2012", "thornton-1997", "liggghts-hooke", "bilinear"]


def config(sweep: dict[str, Any], materials: dict[str, dict[str, float]], models: list[str] = LAWS) -> Any:
    return {
        "models": models,
        "sweep": {"e": [0.3, 0.9], "v1": [0.5, 2.0], **sweep},
        "materials": materials,
        "solver": {"rtol": 1e-4},
        "output": {"variables": EVERYTHING},
    }


def with_axes(plan: Plan, *axes: Axis) -> Plan:
    """The plan with more axes; their inputs are removed from the scalars and from the table of materials."""
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


MASSES = {"m1": 1.0, "m2": [0.5, float("inf")]}
RADII = {"R1": 0.02, "R2": [0.01, float("inf")]}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "second", "balls"),
    [(first, second, RADII if second == "rho" else MASSES) for first in PROPERTIES for second in PROPERTIES],
)
def test_a_sweep_over_properties_equals_the_sweeps_at_each_value(
    tmp_path: Path, first: str, second: str, balls: dict[str, Any]
) -> None:
    # ball 1 is of both materials, so that a property of steel matters at some points only
    sweep = {**balls, "material1": ["steel", "brass"], "material2": "brass"}
    mixed = _prepared(config(sweep, {"steel": STEEL, "brass": BRASS}))
    axes = {f"materials.steel.{first}": PROPERTIES[first][1:], f"materials.brass.{second}": PROPERTIES[second][:2]}
    plan = with_axes(mixed, *(Axis({name: tuple(values)}) for name, values in axes.items()))
    tables = [
        {"steel": {**STEEL, first: value}, "brass": {**BRASS, second: other}}
        for value in PROPERTIES[first][1:]
        for other in PROPERTIES[second][:2]
    ]
    singles = [sweep_in_memory(_prepared(config(sweep, table))) for table in tables]
    for layout in LAYOUTS:
        stored = replace(plan, config=replace(plan.config, output=replace(plan.config.output, layout=layout)))
        outcome = sweep_into(tmp_path / layout, stored, Run(overwrite=True))
        assert outcome.summary.points == plan.points
        result = impact.load(tmp_path / layout)
        assert result["materials.steel." + first].attrs["units"]
        for number, single in enumerate(singles):
            i, j = divmod(number, 2)
            part = result.isel({f"materials.steel.{first}": i, f"materials.brass.{second}": j})
            for name in EVERYTHING:
                assert_same_array(part[name], single[name])


def _prepared(config: Any) -> Plan:
    """The plan of a config in which masses may be missing: it is read with masses, which are then removed."""
    missing = {f"m{ball}": 1.0 for ball in "12" if f"m{ball}" not in config["sweep"]}
    plan = read_plan({**config, "sweep": {**config["sweep"], **missing}})
    scalars = {name: value for name, value in plan.config.scalars.items() if name not in missing}
    return replace(plan, config=replace(plan.config, scalars=scalars))


BALLS = {"v1": 1.0, "e": [0.3, 0.9]}
LAW = ["gharib-hurmuzlu-2012"]


def test_a_mass_comes_from_a_radius_and_a_density() -> None:
    balls = {**BALLS, "R1": [0.01, 0.02], "R2": float("inf"), "material": "steel"}
    result = sweep_in_memory(_prepared(config(balls, {"steel": STEEL}, LAW)))
    masses = [4.0 / 3.0 * np.pi * radius**3 * STEEL["rho"] for radius in (0.01, 0.02)]
    assert result["m1"].dims == ("R1",)
    assert result["m1"].attrs["units"] == "kg"
    np.testing.assert_allclose(result["m1"], masses, rtol=1e-15)
    assert result["m2"].item() == np.inf
    for position, mass in enumerate(masses):
        single = impact.sweep(
            config({**balls, "R1": [0.01, 0.02][position], "m1": mass, "m2": float("inf")}, {"steel": STEEL}, LAW)
        )
        np.testing.assert_allclose(result["e_out"].isel(R1=position), single["e_out"], rtol=1e-13)
        np.testing.assert_allclose(result["contact_time"].isel(R1=position), single["contact_time"], rtol=1e-13)


@pytest.mark.slow
def test_a_derived_mass_varies_with_its_radius_and_density(tmp_path: Path) -> None:
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
        assert_same_array(full[name], factored[name])
    assert_same_array(full["m1"], factored["m1"])
    assert impact.compare(factored, full).equal
    # the worst point is described by inputs of the config, not by derived masses
    assert {*impact.recommend(full).models[0].at} == {"e", "R1", "materials.steel.rho"}


def test_mass_radius_and_density_may_be_set_together() -> None:
    balls = {**BALLS, "R1": 0.01, "R2": 0.01, "m1": 1.0, "m2": 2.0, "material": "steel"}
    result = impact.sweep(config(balls, {"steel": STEEL}, LAW))
    lighter = impact.sweep(config(balls, {"steel": {**STEEL, "rho": 1.0}}, LAW))
    assert (result["m1"].item(), result["m2"].item()) == (1.0, 2.0)
    assert_same_array(result["e_out"], lighter["e_out"])


def test_a_missing_mass_is_an_error() -> None:
    balls = {**BALLS, "R1": 0.01, "R2": 0.01, "K": 1e9, "material": "steel"}
    plan = _prepared(config(balls, {"steel": STEEL}, LAW))
    without = replace(plan, config=replace(plan.config, materials={"steel": Material(210e9, 0.3)}))
    with pytest.raises(ModelError, match="m1: missing, expected m1, or R1 and the density rho of its material"):
        sweep_in_memory(without)


def test_a_material_name_with_a_space_is_refused_before_integration() -> None:
    balls = {**BALLS, "m1": 1.0, "m2": 1.0, "material": "soft steel"}
    plan = with_axes(
        read_plan(config(balls, {"soft steel": STEEL}, LAW)), Axis({"materials.soft steel.E": (1e9, 2e9)})
    )
    with pytest.raises(UsageError, match=r"materials\.soft steel\.E: expected a material name without spaces"):
        sweep_in_memory(plan)


def test_a_file_has_the_unit_of_a_swept_property_and_no_value_in_its_table(tmp_path: Path) -> None:
    balls = {**BALLS, "m1": 1.0, "m2": 1.0, "material": "steel"}
    plan = with_axes(read_plan(config(balls, {"steel": STEEL}, LAW)), Axis({"materials.steel.E": (1e9, 2e9)}))
    sweep_into(tmp_path / "r.h5", plan)
    with xr.open_dataset(tmp_path / "r.h5", engine="h5netcdf") as stored:
        E = stored["materials.steel.E"]
        assert (E.dims, E.attrs["units"]) == (("materials.steel.E",), "Pa")
        assert E.attrs["long_name"] == "Young's modulus of steel"
        assert json.loads(stored.attrs["materials"])["steel"] == {**STEEL, "E": None}


def test_a_sweep_over_a_property_is_compared_with_a_sweep_at_one_value() -> None:
    balls = {**BALLS, "m1": 1.0, "m2": 1.0, "material": "steel"}
    single = impact.sweep(config(balls, {"steel": STEEL}, LAW))
    plan = read_plan(config(balls, {"steel": STEEL}, LAW))
    swept = sweep_in_memory(with_axes(plan, Axis({"materials.steel.E": (1e9, STEEL["E"])})))
    assert impact.compare(single, swept, subset=True).equal
    assert impact.compare(swept.sel({"materials.steel.E": STEEL["E"]}), single).equal
    other = impact.compare(swept.sel({"materials.steel.E": 1e9}), single)
    assert "materials.steel.E is 1000000000, in BASELINE 210000000000" in str(other)


def test_a_model_without_material_is_not_integrated_for_each_property() -> None:
    # a bilinear law with its own stiffness does not depend on the material
    sweep = {**BALLS, "m1": 1.0, "m2": 1.0, "material": "steel"}
    document = {
        **config(sweep, {"steel": STEEL}, ["bilinear", "thornton-1997"]),
        "model": {"bilinear": {"K": 1e6}},
    }
    plan = with_axes(read_plan(document), Axis({"materials.steel.yield_strength": (0.1e9, 0.2e9, 0.3e9)}))
    assert [trajectories.count for trajectories in plan.maps] == [2, 3]


@pytest.mark.parametrize("layout", ["full", pytest.param("factored", marks=pytest.mark.slow)])
def test_values_of_a_property_are_added_to_a_result(tmp_path: Path, layout: str) -> None:
    def swept(**properties: Any) -> dict[str, Any]:
        sweep = {"e": [0.3, 0.9], "v1": 1.0, "R1": 0.01, "R2": 0.02, "material1": "steel", "material2": "brass"}
        document = config(sweep, {"steel": {**STEEL, **properties}, "brass": BRASS}, ["thornton-1997", "bilinear"])
        return {**document, "output": {"layout": layout}}

    sweep_into(tmp_path / "r.h5", read_plan(swept(yield_strength=[0.1e9, 0.8e9])))
    # another value of an axis, and a scalar that becomes an axis
    overrides = ["materials.steel.yield_strength=[3e8]", "materials.steel.rho=[7850, 1000]"]
    impact.extend_to_file(tmp_path / "r.h5", overrides, output=tmp_path / "more.h5")
    more = impact.load(tmp_path / "more.h5")
    whole = impact.sweep(swept(yield_strength=[0.1e9, 0.8e9, 0.3e9], rho=[7850.0, 1000.0]))
    for name in whole.data_vars:
        assert_same_array(more[name].transpose(*whole[name].dims), whole[name])
    assert impact.rerun(tmp_path / "more.h5").equal
    # a point of the grid, and another one
    for strength in (0.8e9, 0.5e9):
        at = {"materials.steel.yield_strength": strength, "materials.steel.rho": 1000.0, "e": 0.9}
        single_impact = impact.run(tmp_path / "more.h5", model="thornton-1997", at=at)
        single = impact.sweep(swept(yield_strength=strength, rho=1000.0)).sel(model="thornton-1997", e=0.9)
        assert single_impact.values["e_out"] == single["e_out"].item()


def test_an_impact_names_a_property_that_varies_once() -> None:
    balls = {**BALLS, "m1": 1.0, "m2": 1.0, "material": "steel"}
    steel: dict[str, Any] = {**STEEL, "E": [70e9, 210e9]}
    shot = impact.run(config(balls, {"steel": steel}, LAW))
    (line,) = [line for line in str(shot).splitlines() if line.startswith("materials.steel.E ")]
    assert "70 GPa" in line
    assert "first value of its axis" in line
