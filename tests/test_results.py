"""A result has the variables, dimensions, units and attributes of the SCHEMA, and the correct numbers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import impact
from impact.config.load import parse_config
from impact.config.measurements import MEASURED_OUTPUTS
from impact.contact.output_formulas import FORMULAS
from impact.contact.status import Status
from impact.contact.variables import CENTRAL_OUTPUTS, OUTPUTS, default_variables
from impact.engine.execute import integrate_ranges
from impact.engine.plan import Plan
from impact.engine.run import DEFAULT_RUN
from impact.engine.trajectories import trajectory_ranges
from impact.plots.labels import symbol
from impact.results.schema import dataset_template, stored_variables, udunits
from impact.results.trajectory_table import TrajectoryTable, in_memory, lazy_dataset

from .conftest import WIDE

BY_DEFAULT = default_variables(of_friction=False)
TABLE1 = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6.118486349e9}


def test_every_output_has_a_formula() -> None:
    assert OUTPUTS.keys() <= FORMULAS.keys()


def test_measurements_and_pictures_follow_from_the_entry_of_an_output() -> None:
    assert {name for name, output in OUTPUTS.items() if output.measured} == MEASURED_OUTPUTS.keys()
    assert {name: symbol(name) for name, output in OUTPUTS.items() if output.symbol} == {
        name: f"${output.symbol}$" for name, output in OUTPUTS.items() if output.symbol
    }


def test_variables_dimensions_and_units(wide: xr.Dataset) -> None:
    axes = ("e", "v1", "m1", "material2", "ismail-stronge-2008.gamma")
    assert dict(wide.sizes) == {"model": 4, "e": 3, "v1": 2, "m1": 2, "material2": 2, axes[-1]: 2}
    assert tuple(wide.data_vars) == BY_DEFAULT
    for name in BY_DEFAULT:
        entry, variable = OUTPUTS[name], wide[name]
        assert variable.dims == (("model", *axes) if entry.per_model else axes)
        assert variable.dtype == np.dtype(entry.dtype)
        assert variable.attrs["units"] == udunits(entry.unit)
        assert variable.attrs["long_name"]
        assert variable.attrs["equation"]


ON_REQUEST = {"e_kinetic": "1", "e_energetic": "1", "lambda": "N s m-(n+1)", "separation_time": "s"}


def test_variables_stored_on_request_only() -> None:
    assert [name for name in CENTRAL_OUTPUTS if OUTPUTS[name].on_request] == list(ON_REQUEST)
    sweep = {"e": [0.0, 0.25, 0.8], "v1": 2.0, "m1": 1.0, "m2": 3.0, "K": 6e9}
    config = {"models": ["gharib-hurmuzlu-2012", "gharib-hurmuzlu-2012-energetic"], "sweep": sweep}
    assert not ON_REQUEST.keys() & set(impact.sweep(config).data_vars)
    result = impact.sweep(config | {"output": {"variables": ["e_out", "contact_time", *ON_REQUEST]}})
    assert list(result.data_vars) == ["e_out", "contact_time", "status", *ON_REQUEST]
    assert {name: result[name].attrs["units"] for name in ON_REQUEST} == ON_REQUEST
    for name in ("e_kinetic", "e_energetic"):
        np.testing.assert_allclose(result[name], result["e_out"], rtol=0.0, atol=1e-9)
    damped, permanent = (result.sel(model=key) for key in config["models"])
    # lambda = chi K/v0 = K/(e v0), in N s/m^2.5
    np.testing.assert_allclose(damped["lambda"], [np.nan, 6e9 / 0.5, 6e9 / 1.6], rtol=1e-14)
    assert np.isnan(permanent["lambda"]).all()
    # without a later contact, the balls separate when the force ends
    for result in (damped, permanent):
        np.testing.assert_array_equal(result["separation_time"], result["contact_time"])


def test_variables_stored_on_request_are_in_the_json_schema_and_in_suggestions() -> None:
    known = impact.schema()["$defs"]["Output"]["properties"]["variables"]["items"]["enum"]
    assert ON_REQUEST.keys() <= set(known)
    with pytest.raises(impact.ImpactError, match='did you mean "separation_time"'):
        impact.sweep({"models": "hertz", "sweep": TABLE1, "output": {"variables": ["separation_tim"]}})


def test_coordinates(wide: xr.Dataset) -> None:
    assert wide["m2"].dims == ("m1",)
    assert wide["m2"].values.tolist() == [1.0, np.inf]
    assert wide["material2"].values.tolist() == ["soft", "hard"]
    assert wide["v2"].values == -1.0
    assert wide["exponent"].values.tolist() == [1.5, 1.5, 1.0, 1.0]
    for name in ("title", "year", "equation", "reference", "doi"):
        assert wide[name].dims == ("model",)
    assert wide["v1"].attrs["units"] == "m s-1"


def test_each_cell_is_the_impact_of_its_coordinates(wide: xr.Dataset) -> None:
    # impulse and momentum by hand: a wall, v0 = 3 m/s, e = 0.6
    cell = {"e": 0.6, "v1": 2.0, "m1": 3.0, "material2": "hard"}
    point = wide.sel(cell).isel({"ismail-stronge-2008.gamma": 0})
    assert float(point["v1_reference"]) == pytest.approx(-1.0 - 0.6 * 3.0, abs=1e-15)
    assert float(point["v2_reference"]) == -1.0
    assert float(point["v1_post"].sel(model="hertz")) == pytest.approx(-4.0, abs=1e-9)
    assert float(point["e_out"].sel(model="bilinear")) == pytest.approx(0.6, abs=1e-9)
    # one model depends on gamma and not on e; the others are constant along gamma
    gamma = wide["e_out"].isel(e=0, v1=0, m1=0, material2=0)
    assert gamma.sel(model="ismail-stronge-2008").values == pytest.approx([1 / 1.5, 1 / 4.0], abs=1e-9)
    bilinear = gamma.sel(model="bilinear").values
    assert bilinear[0] == bilinear[1]
    # a single run is the same impact
    alone = impact.run(_config(wide), model="lankarani-nikravesh-1990", at=cell)
    assert alone.values["e_out"] == float(point["e_out"].sel(model="lankarani-nikravesh-1990"))


def _config(dataset: xr.Dataset) -> dict[str, object]:
    import tomllib

    return tomllib.loads(dataset.attrs["config"])


def test_the_stiffness_of_a_non_hertzian_law_is_the_secant_at_the_hertz_peak(wide: xr.Dataset) -> None:
    cell = wide.isel(e=0, v1=0, m1=0, material2=0).isel({"ismail-stronge-2008.gamma": 0})
    hertz, linear = cell.sel(model="hertz"), cell.sel(model="bilinear")
    peak = float(hertz["peak_indentation"])
    assert float(linear["stiffness"]) == pytest.approx(float(hertz["stiffness"]) * peak**0.5, rel=1e-9)


def test_e_is_computed_from_alpha_and_the_speed() -> None:
    result = impact.sweep(
        {
            "models": ["bilinear", "gharib-hurmuzlu-2012"],
            "sweep": {"alpha": [0.1, 0.5], "v1": [0, 1.0, 3.0], "v2": -1.0, "m1": 1, "m2": 1, "material": "a"},
            "materials": {"a": {"E": 56e9, "nu": 0.3, "rho": 2712}},
        }
    )
    assert result["e"].dims == ("alpha", "v1")
    assert result["e"].values == pytest.approx(np.array([[0.9, 0.8, 0.6], [0.5, 0.0, -1.0]]))
    status = result["status"].sel(model="bilinear").values
    assert status.tolist() == [[1, 1, 1], [1, Status.LIMIT, Status.INVALID_PARAMETER]]
    failed = result.sel(model="bilinear", alpha=0.5, v1=3.0)
    for name in (
        "v1_post",
        "v1_reference",
        "v1_error",
        "e_out",
        "contact_time",
        "energy_loss",
        "closed_form_error",
    ):
        assert np.isnan(failed[name]), name


def test_without_e_there_is_no_reference() -> None:
    result = impact.sweep(
        {
            "models": ["hertz", "ismail-stronge-2008"],
            "sweep": {"v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "material": "a"},
            "materials": {"a": {"E": 56e9, "nu": 0.3, "rho": 2712}},
            "model": {"ismail-stronge-2008": {"gamma": 2.0}},
        }
    )
    for name in ("v1_reference", "v2_error", "e_error"):
        assert np.isnan(result[name]).all(), name
    assert result["e_out"].values == pytest.approx(np.array([[1.0, 1.0], [0.5, 0.5]]), abs=1e-9)


def test_balls_that_do_not_approach_keep_their_velocities() -> None:
    result = impact.sweep({"models": "hertz", "sweep": {"e": 1.0, **TABLE1, "v1": [1.0, 2.0, 3.0], "v2": 2.0}})
    hertz = result.isel(model=0)
    assert hertz["status"].values.tolist() == [Status.NO_IMPACT, Status.NO_IMPACT, Status.OK]
    assert hertz["v1_post"].values[:2].tolist() == [1.0, 2.0]
    assert hertz["v2_post"].values[:2].tolist() == [2.0, 2.0]
    for name in ("peak_indentation", "peak_force", "contact_time", "energy_loss", "v1_error"):
        assert hertz[name].values[:2].tolist() == [0.0, 0.0], name
    assert np.isnan(hertz["e_out"].values[:2]).all()


def test_an_axis_of_exponents() -> None:
    both = {"n": [1.0, 1.5], "K": [1e6, 6e9], "zip": [["n", "K"]]}
    result = impact.sweep({"models": "hertz", "sweep": {"e": 1.0, **TABLE1, **both}})
    assert result["exponent"].dims == ("model", "n")
    assert result["e_out"].values == pytest.approx(np.ones((1, 2)), abs=1e-9)


@pytest.mark.parametrize(
    ("size", "collapse"),
    [
        (7, "true"),
        (1000, "true"),
        (1000, "false"),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in ((7, "false"), (1, "true"), (1, "false"))),
    ],
)
def test_the_size_and_order_of_ranges_change_no_bit(wide: xr.Dataset, size: int, collapse: str) -> None:
    # ranges of this size, shuffled
    plan = Plan(parse_config(WIDE, [f"solver.collapse={collapse}"]))
    ranges = sorted(trajectory_ranges(plan.maps, size), key=lambda part: hash((part.number, "shuffled")))
    finished = {(part.model, part.start): columns for part, columns in integrate_ranges(plan, ranges, DEFAULT_RUN)}
    table = TrajectoryTable(
        plan.inputs, plan.models, plan.maps, lambda model, part: finished[model, part.start], segment=size
    )
    # the overrides of the config are an attribute
    template = dataset_template(plan).assign_attrs(config_set=wide.attrs["config_set"])
    dataset = lazy_dataset(template, table, stored_variables(plan))
    assert in_memory(dataset).identical(wide)
    # a part has the numbers of the whole
    part = {"e": [2, 0], "v1": slice(None, None, -1), "material2": 1}
    assert dataset.isel(part).load().identical(wide.isel(part))
    points = {"model": xr.DataArray([0, 3, 2], dims="point"), "e": xr.DataArray([1, 1, 0], dims="point")}
    assert dataset.isel(points).load().identical(wide.isel(points))


def test_the_chosen_variables_and_the_status_are_stored() -> None:
    config = {"models": "hertz", "sweep": {"e": 1.0, **TABLE1}, "output": {"variables": ["contact_time", "e_out"]}}
    assert list(impact.sweep(config).data_vars) == ["e_out", "contact_time", "status"]


def test_attributes(figure6: xr.Dataset) -> None:
    text = (Path(__file__).parent.parent / "configs" / "figure6.toml").read_text(encoding="utf-8")
    assert figure6.attrs["config"] == text
    assert figure6.attrs["config_set"] == "[]"
    assert figure6.attrs["schema_version"] == 2
    assert figure6.attrs["impact_version"] == impact.__version__
    assert figure6.attrs["rtol"] == 1e-10
    assert {"title", "fingerprint", "max_steps", "packages"} <= figure6.attrs.keys()
    assert figure6.attrs["plugins"] == "{}"


def test_the_materials_of_the_balls_are_an_attribute(wide: xr.Dataset, figure6: xr.Dataset) -> None:
    soft = {"E": 2e9, "nu": 0.4, "rho": 1000.0, "yield_strength": None}
    hard = {"E": 210e9, "nu": 0.3, "rho": 7850.0, "yield_strength": None}
    assert json.loads(wide.attrs["materials"]) == {"hard": hard, "soft": soft}
    more = ["materials.idle={E=1e9, nu=0.3, rho=1}", 'materials.hard.yield_strength="250 MPa"']
    materials = json.loads(dataset_template(Plan(parse_config(WIDE, more))).attrs["materials"])
    assert materials == {"hard": {**hard, "yield_strength": 250e6}, "soft": soft}
    assert list(json.loads(figure6.attrs["materials"])) == ["table1"]
    without = impact.sweep({"models": "hertz", "sweep": {"e": 1.0, **TABLE1}})
    assert without.attrs["materials"] == "{}"


def test_the_fingerprint_does_not_depend_on_order_and_unused_materials() -> None:
    base = Plan(parse_config(WIDE)).fingerprint
    reordered = WIDE.replace("v2 = -1.0\n", "").replace('material1 = "soft"', 'material1 = "soft"\nv2 = -1.0')
    assert reordered != WIDE
    assert Plan(parse_config(reordered)).fingerprint == base
    assert Plan(parse_config(WIDE, ["materials.new={E=1e9, nu=0.3, rho=1}"])).fingerprint == base


def test_the_fingerprint_depends_on_values_and_not_on_comments() -> None:
    base = Plan(parse_config(WIDE)).fingerprint
    assert Plan(parse_config("# a comment\n" + WIDE)).fingerprint == base
    assert Plan(parse_config(WIDE, ["sweep.v2=-1.5"])).fingerprint != base
    assert Plan(parse_config(WIDE, ["solver.rtol=1e-9"])).fingerprint != base


def test_the_chunks_of_all_stored_variables_are_counted() -> None:
    from impact.config.load import read_config

    def read(*variables: str) -> None:
        sweep = {**TABLE1, "v1": {"linspace": [1.0, 2.0, 50_000]}}
        read_config({"models": "hertz", "sweep": sweep, "output": {"variables": variables, "chunks": {"v1": 1}}})

    read("e_out")
    with pytest.raises(impact.ImpactError, match="got 150,000 chunks of 1 points"):
        read("e_out", "separation_time")
