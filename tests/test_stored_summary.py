"""A large factored file contains the summary of its points, so that `impact info` reads no trajectory."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import impact
from impact.results.slabs import is_computed
from impact.results.summary import summarize
from impact.results.xarray_backend import open_result

from .malicious_files import seal

# points of several statuses, and a parameter of one model
CONFIG = {
    "title": "Summary",
    "models": ["tsuji-1992", "gharib-hurmuzlu-2012", "ismail-stronge-2008"],
    "sweep": {"e": [0.0, 0.1, 0.6, 1.0], "v1": [-1.0, 0.5, 1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 1e9},
    "model": {"ismail-stronge-2008": {"gamma": [1.1, 2.0], "K": 1e7}},
    "solver": {"max_steps": 46, "rtol": 1e-8},
    "output": {"layout": "factored"},
}
# values of the masses: every variable is evaluated, and most vary over more than 2^26 points
SIZES = {"evaluated": 120, "not evaluated": 2_100}


@pytest.fixture(scope="module", params=SIZES)
def large(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("large") / "large.h5"
    masses = {name: {"geomspace": [0.01, 1.0, SIZES[request.param]]} for name in ("m1", "m2")}
    impact.sweep_to_file(CONFIG | {"sweep": CONFIG["sweep"] | masses}, path)
    return path


def change_summary(path: Path, copy: Path, change: Callable[[h5py.AttributeManager], object]) -> Path:
    shutil.copy(path, copy)
    with h5py.File(copy, "r+") as file:
        change(file.attrs)
    seal(copy)
    return copy


@pytest.fixture(scope="module")
def without(large: Path) -> Path:
    """The same file without its summary, as version 1.0.0 wrote it."""
    return change_summary(large, large.with_name("without.h5"), lambda attrs: attrs.__delitem__("summary"))


def described(dataset: xr.Dataset) -> str:
    return json.dumps({name: value for name, value in impact.info(dataset).items() if name != "seal"})


@pytest.mark.slow
def test_the_summary_in_a_file_is_the_summary_of_its_points(large: Path, without: Path) -> None:
    with open_result(large) as stored, open_result(without) as computed:
        summary = summarize(computed)
        assert {status.name for status in summary.counts} >= {"OK", "NO_IMPACT", "LIMIT", "MAX_STEPS"}
        assert len(summary.failed_at) == 3
        for count in (1, 3, 10):
            assert repr(summarize(stored, count)) == repr(summarize(computed, count))
        assert described(stored) == described(computed)


@pytest.mark.slow
def test_info_prints_the_summary_in_the_file(large: Path, tmp_path: Path) -> None:
    def change(attrs: h5py.AttributeManager) -> None:
        summary = json.loads(attrs["summary"])
        assert summary["extremes"]["e_out"][1] < 2.0
        summary["extremes"]["e_out"][1] = 7.0
        attrs["summary"] = np.bytes_(json.dumps(summary).encode())

    with open_result(change_summary(large, tmp_path / "changed.h5", change)) as changed:
        assert impact.info(changed)["variables"]["e_out"]["largest"] == 7.0
        assert "summary" not in changed.attrs


@pytest.mark.slow
@pytest.mark.parametrize("large", ["evaluated"], indirect=True)
@pytest.mark.parametrize(
    "select",
    [
        lambda result: result.isel(e=[2] * 4),
        lambda result: result.isel(model=[1, 0], e=slice(0, 3), m1=slice(0, 3), m2=slice(0, 3)),
    ],
)
def test_a_selection_has_its_own_summary(
    large: Path, without: Path, select: Callable[[xr.Dataset], xr.Dataset]
) -> None:
    with open_result(large) as stored, open_result(without) as computed:
        assert all(is_computed(variable) for variable in stored.variables.values() if variable.ndim > 2)
        assert described(select(stored)) == described(select(computed))
