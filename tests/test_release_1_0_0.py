"""Results of version 1.0.0 are opened, compared, repeated and extended.

The files of tests/data/release_1_0_0 were written with that version by `write_files(FOLDER)`.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact
from impact.results.calibration import fit_rows, largest_residuals

from .conftest import ROOT

FOLDER = ROOT / "tests" / "data" / "release_1_0_0"
COMMON = {"title": "Release 1.0.0", "solver": {"rtol": 1e-6}}
OUTPUTS = ["v1_post", "e_out", "e_error", "peak_force", "contact_time"]
SWEEP: dict[str, Any] = COMMON | {
    "models": ["hertz", "hunt-crossley-1975", "bilinear"],
    "sweep": {"e": [0.2, 0.6], "v1": [0.5, 1.0], "m1": 1.0, "m2": 2.0, "K": 1e6, "n": 1.5},
    "model": {"bilinear": {"K": [1e5, 1e6]}},
}
CALIBRATION = COMMON | {
    "models": ["anagnostopoulos-1988"],
    "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "e": {"fit": [0.1, 1.0]}},
    "data": {"columns": {"e_out": [0.49, 0.5, 0.51], "sigma": [0.01, 0.01, 0.01]}},
}
STUDY = COMMON | {
    "models": ["hertz"],
    "design": {"method": "sobol", "n": 16, "seed": 0},
    "output": {"variables": ["peak_force"]},
    "sweep": {
        "m2": 1.0,
        "m1": {"uniform": [0.9, 1.1]},
        "K": {"uniform": [0.5, 1.5]},
        "v1": {"uniform": [0.8, 1.2]},
    },
}
LAYOUTS = ("full", "factored")
ATTRIBUTES_ADDED_SINCE = {"loss"}


def new_result(name: str) -> xr.Dataset:
    """Compute what a file of this name holds with the present version."""
    if name == "calibration":
        return impact.calibrate(CALIBRATION)
    if name == "sensitivity":
        return impact.sensitivity(STUDY, of="peak_force")
    return impact.sweep(SWEEP | {"output": {"variables": OUTPUTS, "layout": name}})


def write_files(folder: Path) -> None:
    for layout in LAYOUTS:
        config = SWEEP | {"output": {"variables": OUTPUTS, "layout": layout}}
        impact.sweep_to_file(config, folder / f"{layout}.h5")
    for name in ("calibration", "sensitivity"):
        impact.save(new_result(name), folder / f"{name}.h5")


@pytest.mark.parametrize("name", [*LAYOUTS, "calibration"])
def test_a_file_of_the_release_has_the_values_of_a_new_result(name: str) -> None:
    stored = impact.load(FOLDER / f"{name}.h5")
    assert stored.attrs["impact_version"] == "1.0.0"
    verdict = impact.compare(new_result(name), stored)
    assert verdict.equal, str(verdict)


@pytest.mark.parametrize("name", [*LAYOUTS, "calibration", "sensitivity"])
def test_a_new_result_has_the_attributes_of_the_release(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # the fingerprint of a work folder has the version
    monkeypatch.setattr("impact.engine.plan.__version__", "1.0.0")
    stored, new = impact.load(FOLDER / f"{name}.h5").attrs, new_result(name).attrs
    assert [key for key in new if key not in ATTRIBUTES_ADDED_SINCE] == list(stored)
    of_the_version = ("impact_version", "packages")
    assert all(new[key] == stored[key] for key in stored if key not in of_the_version)


def test_a_study_of_the_release_has_the_values_of_a_new_one() -> None:
    xr.testing.assert_allclose(impact.load(FOLDER / "sensitivity.h5"), new_result("sensitivity"), rtol=1e-9)


def test_the_layouts_of_the_release_hold_the_same_values() -> None:
    full, factored = (impact.load(FOLDER / f"{layout}.h5").drop_attrs(deep=False) for layout in LAYOUTS)
    assert full.identical(factored)
    with xr.open_dataset(FOLDER / "factored.h5", engine="impact") as lazy:
        np.testing.assert_array_equal(lazy["e_out"].isel(e=1), full["e_out"].isel(e=1))


@pytest.mark.parametrize("name", [*LAYOUTS, "calibration"])
def test_a_file_of_the_release_is_repeated(name: str) -> None:
    verdict = impact.rerun(FOLDER / f"{name}.h5")
    assert verdict.equal, str(verdict)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_file_of_the_release_is_extended(layout: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # a later version refuses to add to values that it did not compute
    for module in ("results.extend", "engine.plan"):
        monkeypatch.setattr(f"impact.{module}.__version__", "1.0.0")
    old, new = FOLDER / f"{layout}.h5", tmp_path / "new.h5"
    outcome = impact.extend_to_file(old, ["sweep.e=[0.2, 0.4, 0.6]"], output=new)
    assert outcome.extended_layout == layout
    verdict = impact.compare(impact.load(new), impact.load(old), subset=True)
    assert verdict.equal, str(verdict)


def test_a_file_of_the_release_is_used_in_place(tmp_path: Path) -> None:
    path = shutil.copy(FOLDER / "factored.h5", tmp_path)
    assert impact.info(path)["status"] == {"ok": 16}
    assert impact.expand(path, tmp_path / "part.h5", sel={"v1": 1.0}) == 12
    assert impact.recommend(impact.load(path)).models[0].model == "bilinear"


def test_a_calibration_without_the_variables_added_since_is_read() -> None:
    stored = impact.load(FOLDER / "calibration.h5")
    assert not {"p_value", "loo_residual"} & set(stored.variables)
    assert [(row[2], row[5]) for row in fit_rows(stored)] == [("0.5", "–")]
    assert largest_residuals(stored) == []
    table = impact.describe(stored).to_dataframe()
    assert np.isnan(table["p_value"]).all()
    assert not np.isnan(table["aicc"]).any()
