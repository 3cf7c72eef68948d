"""Datasets that are not valid results are neither stored nor read, even if their seal is valid."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from h5netcdf.utils import CompatibilityError

import impact
from impact.errors import ResultError, UsageError
from impact.results import xarray_backend

from .conftest import ROOT

Change = Callable[[xr.Dataset], xr.Dataset]
DEEP = "[" * 100_000
KIND = "expected numbers or labels"


def _attribute(name: str, **attributes: object) -> Change:
    return lambda result: result.assign({name: result[name].assign_attrs(attributes)})


RESULTS: dict[str, tuple[Change, str]] = {
    "unknown axis": (lambda r: r.rename(e="twice"), "twice: not a variable of a result"),
    "bare axis": (lambda r: r.drop_vars("e"), "its axis e has no values"),
    "nothing": (lambda r: r.isel(e=slice(0, 0)), "its axis e has no values"),
    "axis of text": (lambda r: r.assign_coords(e=r["e"].astype(str)), f"e: {KIND}"),
    "numbers of text": (lambda r: r.assign(e_out=r["e_out"].astype(str)), f"e_out: {KIND}"),
    "truths": (lambda r: r.assign(e_out=r["e_out"] > 0.5), f"e_out: {KIND}"),
    "models of numbers": (lambda r: r.assign_coords(model=[1.0, 2.0, 3.0]), f"model: {KIND}"),
    "unit of numbers": (_attribute("e_out", units=5), "e_out: units or long_name is not text"),
    "meaning of numbers": (_attribute("e_out", long_name=np.ones(3)), "e_out: units or long_name"),
    "one model": (lambda r: r.isel(model=0), "sel(model=[...])"),
    "a model twice": (lambda r: r.assign_coords(model=["a", "b", "a"]), "a model occurs twice"),
    **{
        name: (lambda r, name=name: r.drop_vars(name), f"{name} of the models is missing")
        for name in ("title", "equation", "reference", "doi", "year")
    },
    "title of all": (lambda r: r.assign_coords(title="x"), "title of the models is missing"),
    "reference by model": (lambda r: r.assign(v1_reference=r["v1_post"]), "v1_reference: lies along model"),
    "unknown status": (lambda r: r.assign(status=r["status"] + 70), "status: got a number that is no status"),
    "no config": (lambda r: r.drop_attrs(deep=False).assign_attrs(schema_version=2, title="x"), "no config"),
    "config of numbers": (lambda r: r.assign_attrs(config=5), "no config, or not as text"),
    "tolerance of text": (lambda r: r.assign_attrs(rtol="x"), "no rtol, or not as a number"),
    "config_set": (lambda r: r.assign_attrs(config_set="{}"), "config_set: not JSON of the expected type"),
    "plugins": (lambda r: r.assign_attrs(plugins="{}x"), "plugins: not JSON of the expected type"),
    "no hash": (lambda r: r.assign_attrs(plugins='{"mine": {"file": "my.py"}}'), "plugins: not JSON of the"),
    "deep plugins": (lambda r: r.assign_attrs(plugins=DEEP), "plugins: not JSON of the expected type"),
    "materials": (lambda r: r.assign_attrs(materials=1.0), "materials: not JSON of the expected type"),
}
HISTORIES: dict[str, tuple[Change, str]] = {
    "another axis": (lambda h: h.expand_dims(e=[1.0]), "expected t as its only axis"),
    "inputs": (lambda h: h.assign_attrs(inputs=DEEP), "inputs: not JSON of the expected type"),
}


@pytest.fixture(scope="module")
def result() -> xr.Dataset:
    """Three models at three restitutions."""
    variables = '["v1_post", "v1_reference", "e_out", "status"]'
    overrides = ["sweep.e=[0.2, 0.5, 0.8]", "solver.rtol=1e-4", f"output.variables={variables}"]
    return impact.sweep(ROOT / "configs" / "figure6.toml", overrides=overrides)


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    history = impact.run(overrides=["solver.rtol=1e-4"]).history
    assert history is not None
    return history


def check(dataset: xr.Dataset, words: str, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A dataset is not stored, and if it is stored without validation it is not read."""
    with pytest.raises(UsageError, match=re.escape(words)):
        impact.save(dataset, path)
    assert not path.exists()
    with monkeypatch.context() as patch:
        patch.setattr(xarray_backend, "schema_violation", lambda _: None)
        try:
            impact.save(dataset, path)
        except (UsageError, TypeError, CompatibilityError):
            # another check refuses it, or netCDF cannot store it
            return
    with pytest.raises(ResultError) as refused:
        impact.load(path)
    assert words in str(refused.value)


@pytest.mark.parametrize("name", RESULTS)
def test_an_invalid_result_is_neither_stored_nor_read(
    result: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    change, words = RESULTS[name]
    check(change(result), words, tmp_path / "odd.h5", monkeypatch)


@pytest.mark.parametrize("name", HISTORIES)
def test_an_invalid_history_is_neither_stored_nor_read(
    history: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    change, words = HISTORIES[name]
    check(change(history), words, tmp_path / "odd.h5", monkeypatch)


def test_a_history_is_stored_and_read(history: xr.Dataset, tmp_path: Path) -> None:
    impact.save(history, tmp_path / "history.h5")
    xr.testing.assert_identical(impact.load(tmp_path / "history.h5"), history)


def test_variables_that_a_result_cannot_have_are_not_stored(result: xr.Dataset, tmp_path: Path) -> None:
    for odd, words in (
        (result.assign(twice=result["e_out"]), r"twice: not a variable of a result; dataset\.to_netcdf\(path\)"),
        (result.assign(e_out=result["e_out"] * 1j), f"e_out: {KIND}"),
    ):
        with pytest.raises(UsageError, match=words):
            impact.save(odd, tmp_path / "odd.h5")


def test_an_attribute_that_could_not_be_read_is_not_stored(result: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="@x: an attribute of unexpected type or size"):
        impact.save(result.assign_attrs(x=np.zeros(65)), tmp_path / "odd.h5")
    assert list(tmp_path.iterdir()) == []
