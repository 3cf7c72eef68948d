"""The stored baselines are reproduced, and cover all models, kinds of axes and statuses."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import impact
from impact.contact.status import FrictionStatus, Status
from impact.results.summary import summarize

from .conftest import ROOT

DATA = ROOT / "tests" / "data"
BASELINES = sorted(DATA.glob("*.h5"))


@pytest.fixture(scope="module")
def baselines() -> list[xr.Dataset]:
    return [impact.load(path) for path in BASELINES]


def test_each_config_has_a_baseline_and_each_baseline_a_config() -> None:
    configs = [*DATA.glob("*.toml"), *(ROOT / "configs").glob("*.toml")]
    assert sorted(path.stem for path in configs) == [path.stem for path in BASELINES]


def config_of(path: Path) -> Path:
    (config,) = (*DATA.glob(f"{path.stem}.toml"), *(ROOT / "configs").glob(f"{path.stem}.toml"))
    return config


@pytest.mark.parametrize("path", BASELINES, ids=lambda path: path.stem)
def test_a_config_says_what_its_baseline_was_swept_from(path: Path) -> None:
    """So that a rerun of the baseline, which reads the config that it stores, is a sweep of the file."""
    stored = tomllib.loads(impact.load(path).attrs["config"])
    assert tomllib.loads(config_of(path).read_text(encoding="utf-8")) == stored


# `make regress` repeats them, too, with the compiled core in CI
@pytest.mark.slow
@pytest.mark.parametrize("path", BASELINES, ids=lambda path: path.stem)
def test_a_rerun_of_a_baseline_is_equal(path: Path) -> None:
    verdict = impact.rerun(path)
    assert verdict.equal, str(verdict)


def test_every_model_is_in_a_baseline(baselines: list[xr.Dataset]) -> None:
    laws = {key for key, model in impact.models().items() if not model.same_as}
    assert laws == {key for baseline in baselines for key in baseline["model"].values.tolist()}


def test_every_continuous_friction_law_and_status_is_in_a_baseline(baselines: list[xr.Dataset]) -> None:
    of_friction = [baseline for baseline in baselines if "friction" in baseline.dims]
    laws = {key for key, law in impact.frictions().items() if not law.scheme}
    assert laws == {key for baseline in of_friction for key in baseline["friction"].values}
    statuses = {int(status) for baseline in of_friction for status in np.unique(baseline["friction_status"])}
    assert statuses == {
        FrictionStatus.OK,
        FrictionStatus.NO_IMPACT,
        FrictionStatus.LIMIT,
        FrictionStatus.SLOW_LIMIT,
        FrictionStatus.NOT_COMBINABLE,
    }


def test_every_kind_of_axis_is_in_a_baseline(baselines: list[xr.Dataset]) -> None:
    axes = {str(dim) for baseline in baselines for dim in baseline.dims}
    assert {
        "e",
        "alpha",
        "v1",
        "v2",
        "m1",
        "m2",
        "n",
        "K",
        "material2",
        "dt",
        "phase",
        "angle",
        "mu",
        "u1",
        "friction.lammps-linear-history.xt",
        "ismail-stronge-2008.gamma",
    } <= axes
    zipped = [baseline for baseline in baselines if "m1" in baseline.dims and baseline["m2"].dims == ("m1",)]
    walls = [baseline for baseline in baselines if np.isinf(baseline["m2"]).any()]
    dissimilar = [
        baseline
        for baseline in baselines
        if "material1" in baseline.coords and "rubber" in baseline["material2"].values
    ]
    assert all((zipped, walls, dissimilar))


def test_every_status_that_a_config_can_cause_is_in_a_baseline(baselines: list[xr.Dataset]) -> None:
    statuses = {status for baseline in baselines for status in summarize(baseline).counts}
    assert statuses == {
        Status.OK,
        Status.NO_IMPACT,
        Status.LIMIT,
        Status.NOT_SEPARATED,
        Status.MAX_STEPS,
        Status.NOT_FINITE,
        Status.INVALID_PARAMETER,
        Status.OUT_OF_RANGE,
        Status.UNSTABLE,
    }
