"""The baselines of `make regress` cover what the program does: models, kinds of axes, points that fail."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import impact
from impact.contact.status import Status
from impact.results.summary import summarize

from .conftest import ROOT

DATA = ROOT / "tests" / "data"
BASELINES = sorted(DATA.glob("*.h5"))


@pytest.fixture(scope="module")
def baselines() -> list[xr.Dataset]:
    return [impact.load(path) for path in BASELINES]


def test_each_belongs_to_a_config_and_each_config_has_one() -> None:
    configs = [*DATA.glob("*.toml"), *(ROOT / "configs").glob("*.toml")]
    assert sorted(path.stem for path in configs) == [path.stem for path in BASELINES]


@pytest.mark.parametrize("path", BASELINES, ids=lambda path: path.stem)
def test_a_rerun_is_equal(path: Path) -> None:
    verdict = impact.rerun(path)
    assert verdict.equal, str(verdict)


def test_every_model_is_in_one(baselines: list[xr.Dataset]) -> None:
    laws = {key for key, model in impact.models().items() if not model.same_as}
    assert laws == {key for one in baselines for key in one["model"].values.tolist()}


def test_every_kind_of_axis_is_in_one(baselines: list[xr.Dataset]) -> None:
    axes = {str(dim) for one in baselines for dim in one.dims}
    assert {"e", "alpha", "v1", "v2", "m1", "m2", "n", "K", "material2", "ismail-stronge-2008.gamma"} <= axes
    zipped = [one for one in baselines if "m1" in one.dims and one["m2"].dims == ("m1",)]
    walls = [one for one in baselines if np.isinf(one["m2"]).any()]
    dissimilar = [one for one in baselines if "material1" in one.coords and "rubber" in one["material2"].values]
    assert all((zipped, walls, dissimilar))


def test_points_of_every_fate_that_a_config_can_ask_for_are_in_one(baselines: list[xr.Dataset]) -> None:
    found = {status for baseline in baselines for status in summarize(baseline).counts}
    assert found == {
        Status.OK, Status.NO_IMPACT, Status.LIMIT, Status.MAX_STEPS, Status.INVALID_PARAMETER, Status.OUT_OF_RANGE,
    }  # fmt: skip
