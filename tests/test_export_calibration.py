"""A calibration is a source of single impacts: each law comes with its fitted parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import impact
from impact.errors import UsageError
from impact.exporters.registry import CODES
from impact.formatting import number

from .conftest import Run

# calibrations of several laws: `make test-faults` runs them
pytestmark = pytest.mark.slow

SPEEDS = [0.2, 0.6, 1.5, 3.0]
TSUJI = "lammps-coeff-restitution-hertz"
DROPS: dict[str, Any] = {
    "models": ["kuwabara-kono-1987", "lammps-tsuji", "tsuji-1992", "kelvin-voigt"],
    "sweep": {"m1": 1e-3, "m2": 2e-3, "R1": 0.01, "R2": 0.02, "material": "ball", "e": {"fit": [0.2, 1.0]}},
    "materials": {"ball": {"E": 2e9, "nu": 0.4}},
    "model": {
        "kuwabara-kono-1987": {"A": {"fit": [1e-6, 1e-4]}},
        "kelvin-voigt": {"C": {"fit": [0.01, 100.0]}},
    },
    "solver": {"rtol": 1e-6},
    # what the law of Kuwabara and Kono delivers with A = 1e-5 s, to three digits
    "data": {"columns": {"v1": SPEEDS, "e_out": [0.683, 0.627, 0.578, 0.538]}, "sigma": 0.01},
}


@pytest.fixture(scope="module")
def fit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fit") / "fit.h5"
    impact.calibrate(DROPS, output=path, best=path.with_name("kelvin.toml"), model="lammps-velocity-hooke")
    return path


def estimate(path: Path, law: str, name: str) -> float:
    fitted = impact.load(path).sel(model=law)
    return float(fitted["estimate"].sel(parameter=name))


def test_the_best_law_that_the_code_has_is_exported_with_its_fitted_parameters(fit: Path) -> None:
    export = impact.export("lammps", source=fit, at={"v1": 1.0}, code_version="22Jul2025")
    dataset = impact.load(fit)
    ranks = {law: rank for rank, law in enumerate(dataset["model"].values.tolist(), 1)}
    weights = {law: f"{law}, weight {number(dataset['weight'].sel(model=law).item(), 3)}" for law in ranks}
    assert ranks["kuwabara-kono-1987"] == 1
    # LAMMPS of 2025 has another law under the name lammps-tsuji
    assert export.model == TSUJI
    assert export.parameters["e"] == estimate(fit, "tsuji-1992", "e")
    assert f"{fit}: {weights['tsuji-1992']}, law {ranks['tsuji-1992']} of 4 by AICc" in export.header
    (warning,) = export.warnings
    assert warning in export.header
    assert (
        warning == f"the law that fits best, {weights['kuwabara-kono-1987']}, is none of {CODES['lammps'].title}"
    )
    assert f'model="KEY" exports another law that was fitted: {weights["kelvin-voigt"]}' in export.header
    # a later release has the law that was fitted
    part = dataset.sel(model=["lammps-tsuji", "tsuji-1992"])
    newer = impact.export("lammps", source=part, at={"v1": 1.0}, code_version="1Sep2026")
    assert (newer.model, newer.warnings) == ("lammps-tsuji", ())


def test_another_law_is_exported_by_any_of_its_names(fit: Path) -> None:
    for name in ("kelvin-voigt", "lammps-velocity-hooke"):
        export = impact.export("lammps", name, source=fit, at={"v1": 1.0}, code_version="22Jul2025")
        # its parameters move to the table of its other name
        assert export.model == "lammps-velocity-hooke"
        assert export.parameters["eta_n0"] == estimate(fit, "kelvin-voigt", "kelvin-voigt.C")


def test_a_law_that_was_not_fitted_is_refused_with_those_that_were(cli: Run, fit: Path) -> None:
    done = cli("export", fit, "--to", "lammps", "--model", "lammps-tsuji", "--code-version", "22Jul2025")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert 'fit.h5: no fit of "lammps-tsuji-without-root"; did you mean "lammps-tsuji"?' in done.stderr
    with pytest.raises(UsageError, match="YADE has none of the laws kuwabara-kono-1987; fit one of its own, see"):
        impact.export("yade", source=impact.load(fit).isel(model=[0]), code_version="2023.02a")
    # a release before September 2013 has the law of tsuji-1992
    with pytest.raises(UsageError, match=r"YADE 2023.02a has none of the laws .* and 1 more; fit one of its own"):
        impact.export("yade", source=fit, code_version="2023.02a")
    assert impact.export("yade", source=fit, at={"v1": 1.0}, code_version="2012.01").model == "yade-en-pulling"


def test_every_command_of_one_impact_takes_a_calibration(cli: Run, fit: Path) -> None:
    shot = impact.run(fit, at={"v1": 1.5})
    assert (shot.model.key, shot.point["v1"]) == ("kuwabara-kono-1987", 1.5)
    predicted = impact.load(fit)["predicted"].isel(model=0).values[SPEEDS.index(1.5)]
    assert shot.values["e_out"] == pytest.approx(predicted, abs=1e-6)
    result = impact.timestep("tsuji-1992", source=fit, at={"v1": 1.0}, steps_per_contact=[20], phases=20)
    assert result.e == estimate(fit, "tsuji-1992", "e")
    root = impact.solve("kelvin-voigt", "C", {"e_out": 0.6}, source=fit, at={"v1": 1.0}).roots[0].value
    assert 0.1 < root / estimate(fit, "kelvin-voigt", "kelvin-voigt.C") < 10.0
    done = cli("run", fit, "--model", "hertz")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert 'no fit of "hertz"; known: kelvin-voigt, kuwabara-kono-1987, ' in done.stderr


def test_a_setting_changes_the_config_of_the_fitted_law(fit: Path) -> None:
    shot = impact.run(fit, overrides=["sweep.m2=inf", "sweep.v1=1"])
    assert (shot.point["m2"], shot.point["v1"]) == (float("inf"), 1.0)


def test_the_config_of_another_law_than_the_best_is_written(fit: Path, tmp_path: Path) -> None:
    swept = impact.sweep(fit.with_name("kelvin.toml"), overrides=["sweep.v1=[0.6]"])
    assert swept["model"].item() == "kelvin-voigt"
    assert swept["kelvin-voigt.C"].item() == estimate(fit, "kelvin-voigt", "kelvin-voigt.C")
    # refused before anything is fitted
    with pytest.raises(UsageError, match='model: no fit of "kelvin"; did you mean "kelvin-voigt"'):
        impact.calibrate(DROPS, best=tmp_path / "other.toml", model="kelvin")
    with pytest.raises(UsageError, match='model: set without best="FILE"'):
        impact.calibrate(DROPS, model="kelvin-voigt")


def test_a_law_without_an_estimate_is_refused(fit: Path) -> None:
    dataset = impact.load(fit)
    lost = dataset.assign(estimate=dataset["estimate"].where(dataset["model"] != "tsuji-1992"))
    with pytest.raises(UsageError, match="tsuji-1992: the fit has no estimate, its status is ok"):
        impact.export("lammps", source=lost, code_version="22Jul2025")


def test_laws_without_an_aicc_have_no_weight_and_none_is_named(tmp_path: Path) -> None:
    """Three points are too few for the correction of AICc with a parameter and the scale of the noise."""
    few = {"columns": {name: values[:3] for name, values in DROPS["data"]["columns"].items()}, "noise": "scale"}
    path = tmp_path / "few.h5"
    result = impact.calibrate({**DROPS, "models": DROPS["models"][:3], "data": few}, output=path)
    assert result["aicc"].isnull().all()
    assert result["weight"].isnull().all()
    export = impact.export("lammps", source=path, at={"v1": 1.0}, code_version="22Jul2025", model="tsuji-1992")
    assert not any("weight" in line or "AICc" in line for line in (*export.header, *export.warnings))
