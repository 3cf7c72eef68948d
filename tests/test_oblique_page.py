"""The numbers of docs/oblique.md and of its figures are those of the program."""

from __future__ import annotations

import math
import tomllib
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact

from .conftest import ROOT, code_blocks
from .friction_reference import Friction, kick_drift, spring_dashpot

FOLDER = ROOT / "docs" / "oblique"
# a line break of the page is a space
PAGE = " ".join((ROOT / "docs" / "oblique.md").read_text(encoding="utf-8").split())
SPRINGS = ["lammps-mindlin", "lammps-mindlin-force", "lammps-mindlin-rescale", "lammps-mindlin-rescale-force"]


def one_ball(models: list[str], friction: str, parameters: dict[str, float], **sweep: Any) -> xr.Dataset:
    """A solid ball of unit mass and K = 1 hits a wall at 1 m/s."""
    ball = {"v1": 1.0, "m1": 1.0, "m2": math.inf, "K": 1.0}
    config = {"models": models, "frictions": [friction], "sweep": ball | sweep}
    return impact.sweep(config | ({"friction": {friction: parameters}} if parameters else {})).squeeze("friction")


@pytest.mark.slow
def test_the_config_of_the_page_has_all_points() -> None:
    (toml,) = code_blocks((ROOT / "docs" / "oblique.md").read_text(encoding="utf-8"), "toml")
    result = impact.sweep(tomllib.loads(toml))
    assert result["friction_status"].values.tolist() == np.ones(result["beta"].shape, int).tolist()


def test_what_sliding_friction_is_where_the_force_pulls() -> None:
    slides = one_ball(["anagnostopoulos-1988"], "coulomb-1785", {}, u1=30.0, mu=0.3, n=1.0, e=[0.9, 0.5, 0.1])
    excess = (slides["impulse_ratio"] / 0.3 - 1.0).values.ravel()
    assert "0.2 % at e = 0.9, by 6.7 % at e = 0.5 and by 28 % at e = 0.1" in PAGE
    assert [round(part, digits) for part, digits in zip(excess, (3, 3, 2), strict=True)] == [0.002, 0.067, 0.28]


def test_the_impact_that_makes_energy() -> None:
    config = {
        "models": ["hertz-power-damping"],
        "frictions": ["lammps-mindlin"],
        "sweep": {"v1": 1.0, "m1": 1.0, "m2": math.inf, "K": 1.0, "u1": 0.796214, "mu": 0.5},
        "model": {"hertz-power-damping": {"C": 0.491935, "q": 0.25}},
        "friction": {"lammps-mindlin": {"k_t": 0.617647, "xt": 0.0}},
    }
    result = impact.sweep(config)
    assert f"it has β = {result['beta'].item():.4f}" in PAGE
    assert result["friction_loss"].item() < 0.0


@pytest.mark.parametrize(
    ("friction", "count"),
    [("coulomb-1785", 1), pytest.param("lammps-mindlin-force", 4250, marks=pytest.mark.slow)],
)
def test_how_many_trajectories_a_sweep_over_angle_mu_and_spin_has(friction: str, count: int) -> None:
    sweep = {"v1": 3.9, "e": 0.9, "R1": 0.0025, "m2": math.inf, "material": "steel"}
    sweep |= {"angle": {"linspace": ["1 deg", "85 deg", 85]}, "mu": {"linspace": [0.1, 0.55, 10]}}
    sweep["omega1"] = [0.0, 50.0, 100.0, 150.0, 200.0]
    config = {"models": ["tsuji-1992"], "frictions": [friction], "sweep": sweep}
    if friction != "coulomb-1785":
        config["friction"] = {friction: {"xt": 0.0}}
    assert impact.estimate(config).trajectories == 1 + count
    assert "one normal trajectory, and at most 4,250 tangential ones, with `coulomb-1785` a single one" in PAGE


@pytest.mark.slow
def test_what_the_page_says_of_the_balls_of_kharaz() -> None:
    result = impact.sweep(ROOT / "configs" / "oblique.toml").squeeze("model")
    angle, e_t = result["angle"].values, result["e_t"]
    springs = list(map(str, result["friction"].values[1:]))
    slides = angle >= np.radians(33.0) - 1e-9
    assert np.ptp(e_t.transpose("friction", "angle").values[:, slides], axis=0).max() < 2e-5
    measured = np.loadtxt(FOLDER / "kharaz.csv", delimiter=",", skiprows=1)

    def off(key: str, at: float) -> float:
        (row,) = (row for row in measured if round(row[0]) == at)
        return float(np.interp(np.radians(row[0]), angle, e_t.sel(friction=key))) - row[1]

    assert all(abs(off(key, at)) < 0.008 for key in ("coulomb-1785", *springs) for at in (39, 50, 60))
    assert all(abs(off(key, 30)) < 0.002 for key in springs)
    assert round(off("coulomb-1785", 30), 3) == 0.026
    least = [float(e_t.sel(friction=key).min()) for key in springs]
    assert f"0.596 at 20°, is {min(least):.3f} to 0.619 by the springs" in PAGE
    at_20 = [float(e_t.sel(friction=key).sel(angle=np.radians(20.0), method="nearest")) for key in springs]
    assert (round(min(at_20), 3), round(max(at_20), 3)) == (0.608, 0.619)
    near_normal = [off(key, 4) + 0.745 for key in springs]
    assert 0.86 < min(near_normal) < max(near_normal) < 1.0
    assert round(off("coulomb-1785", 4) + 0.745, 3) == 0.714


@pytest.mark.slow
def test_what_the_page_says_of_mindlins_springs() -> None:
    result = impact.sweep(FOLDER / "psi.toml").squeeze("model")
    kappa = 1.4 / 1.7
    np.testing.assert_allclose(result["psi1"].sel(friction=SPRINGS[0]), kappa / 0.1 * result["u1"], rtol=1e-12)
    assert f"κ = 2(1 − ν)/(2 − ν) = {kappa:.4f}" in PAGE
    assert f"ψ₁ = 7 κ = {7 * kappa:.2f} on" in PAGE
    step = float(np.diff(result["psi1"].sel(friction=SPRINGS[0])).max())
    bounds = {key: 7 * kappa - 1 + r / 3 for key, r in zip(SPRINGS, (1, 0, 2, 1), strict=True)}
    for key, bound in bounds.items():
        pair = result.sel(friction=key)
        slides = pair["psi1"].values[pair["contact_regime"].values == 2]
        assert bound <= slides.min() < bound + step
        assert f"{bound:.2f}" in PAGE
        assert (pair["psi1"].values >= bound).sum() == slides.size
        # the slip reverses for a small one only
        assert pair["psi2"].values[-1] > 0.0 > pair["psi2"].min()
    largest = [f"{float(result['beta'].sel(friction=key).max()):.3f}" for key in SPRINGS]
    assert "The largest β is {1}, {0} and {2} for these.".format(*largest) in PAGE
    assert largest[0] == largest[3]


@pytest.mark.slow
def test_what_the_page_says_of_the_slow_limit() -> None:
    zeta, mu, slips = 0.3 / math.sqrt(5.0), 0.3, np.array([0.97, 1.03, 1.1]) * 0.3
    e = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))
    k_t = 1.5 * 1.4 / 1.7
    result = one_ball(
        ["tsuji-1992-no-tension"], "lammps-mindlin", {"k_t": k_t, "xt": 1.0}, u1=slips.tolist(), mu=mu, e=e
    )
    assert result["friction_status"].values.ravel().tolist() == [1, 4, 4]
    before, after, limit = (f"{beta:+.2f}".replace("-", "−") for beta in result["beta"].values.ravel())
    assert f"β is {before} at ρ = 0.97 and {after} at ρ = 1.03" in PAGE
    friction = Friction("spring", mu, k_t=k_t, kp=0.5, memory=(1.0, 1.0), c_t=0.3, q=0.25)
    duration = result["contact_time"].values.ravel()[0]
    normal = spring_dashpot(1.5, 0.3, 0.25, "force")
    coarse, fine = (-kick_drift(normal, friction, slips[2], duration / n) / slips[2] for n in (500, 5000))
    words = f"500 steps per contact delivers {coarse:.2f}, one with 5,000 steps {fine:.2f}, and the limit is"
    assert f"{words} {limit}".replace("-", "−") in PAGE
    for key in ("lammps-mindlin-force", "lammps-mindlin-rescale-force"):
        kept = one_ball(["tsuji-1992-no-tension"], key, {"k_t": k_t, "xt": 1.0}, u1=slips.tolist(), mu=mu, e=e)
        assert (kept["friction_status"] == 1).all()
