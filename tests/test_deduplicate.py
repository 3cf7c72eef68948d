"""Impacts with the same dimensionless parameters are integrated once, with the bits of separate integrations."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st

import impact
from impact.config.load import read_config
from impact.contact.impacts import Impacts
from impact.engine import trajectories as trajectories_module
from impact.engine.execute import integrate_columns
from impact.engine.inputs import build_impacts
from impact.engine.plan import Plan
from impact.engine.run import Run
from impact.results.estimate import estimate
from impact.results.sweep import read_plan

from .conftest import ROOT, assert_same_bits, new_law

DASHPOT = new_law(
    "dashpot",
    lambda K, x, v, c: K * x + c * v,
    exponent=1.0,
    release="force",
    parameters=(impact.Parameter("c", "N s/m", "damping constant", default=30.0, least=0.0),),
)
SPEED = new_law(
    "speed",
    lambda elastic, v, a: elastic * (1.0 + a * v),
    coefficients={"a": lambda v_y, v0: 0.3 * v_y / (v_y + v0)},
    parameters=(impact.Parameter("v_y", "m/s", "a speed", default=1.0, least=0.1),),
)
OPTIONAL_PARAMETERS = {"dashpot": {"c": [0.0, 40.0]}, "speed": {"v_y": [0.5, 2.0]}}
# parameters without a default, with the values of a baseline; the unit of c of recurdyn depends on n
BASELINE_PARAMETERS = tomllib.loads((ROOT / "tests" / "data" / "every_model.toml").read_text(encoding="utf-8"))[
    "model"
]
REQUIRED_PARAMETERS = {
    key: BASELINE_PARAMETERS[model.same_as or key]
    for key, model in impact.models().items()
    if (model.same_as or key) in BASELINE_PARAMETERS
}
REQUIRED_PARAMETERS["recurdyn"] = {"c": 1e4}

# a few values of each, so that many points are equal, or differ only in scale or in a material
VALUES: dict[str, list[object]] = {
    "e": [0.0, 0.1, 0.5, 1.0],
    "v1": [-1.0, 0.5, 1.0, 2.0],
    "v2": [0.0, -1.0],
    "m1": [1.0, 2.0, float("inf")],
    "m2": [0.5, 1.0, float("inf")],
    "material": ["soft", "hard"],
    "n": [1.0, 1.5, 2.0],
    "R1": [0.05, float("inf")],
    "alpha": [0.0, 0.4, 2.0],
}
MATERIALS = {
    "soft": {"E": 2e9, "nu": 0.4, "rho": 1000.0, "yield_strength": 1e7},
    "hard": {"E": 2.1e11, "nu": 0.3, "rho": 7850.0, "yield_strength": 3e8},
}


@st.composite
def configs(draw: st.DrawFn) -> dict[str, object]:
    driver = draw(st.sampled_from(["e", "alpha"]))
    names = [driver, "v1", "m1", "m2", "material", *draw(st.sets(st.sampled_from(["v2", "n", "R1"])))]
    sweep = {
        name: draw(
            st.sampled_from(VALUES[name]) | st.lists(st.sampled_from(VALUES[name]), min_size=2, unique=True)
        )
        for name in draw(st.permutations(names))
    }
    known = [*sorted(impact.models()), *OPTIONAL_PARAMETERS]
    models = draw(st.lists(st.sampled_from(known), min_size=1, max_size=3, unique=True))
    parameters = {
        key: OPTIONAL_PARAMETERS[key] for key in models if key in OPTIONAL_PARAMETERS and draw(st.booleans())
    }
    parameters |= {key: REQUIRED_PARAMETERS[key] for key in models if key in REQUIRED_PARAMETERS}
    return {
        "models": models,
        "sweep": sweep,
        "materials": MATERIALS,
        "solver": {"rtol": 1e-4},
        "model": parameters,
    }


def sweep_with_plugins(config: dict[str, object], *overrides: str) -> xr.Dataset:
    return impact.sweep(config, overrides=overrides, plugins=[DASHPOT, SPEED])


@settings(max_examples=15)
@given(configs())
def test_deduplication_changes_no_bit_of_a_result(config: dict[str, object]) -> None:
    assert_same_bits(sweep_with_plugins(config), sweep_with_plugins(config, "solver.collapse=false"))


@pytest.mark.slow
@settings(max_examples=10)
@given(configs())
def test_deduplication_within_blocks_changes_no_bit_of_a_result(config: dict[str, object]) -> None:
    deduplicated = sweep_with_plugins(config)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trajectories_module, "MAX_CELLS", 0)
        assert_same_bits(deduplicated, sweep_with_plugins(config))


@settings(max_examples=15)
@given(configs())
def test_the_impacts_of_a_grid_are_those_of_its_points(config: dict[str, object]) -> None:
    plan = read_plan(config, plugins=[DASHPOT, SPEED])
    at = np.ix_(*map(np.arange, plan.inputs.shape)) if plan.inputs.shape else ()
    flat = tuple(np.unravel_index(np.arange(plan.inputs.cells), plan.inputs.shape)) if plan.inputs.shape else ()
    for model in plan.models:
        grid, points = (build_impacts(plan.inputs, model, index) for index in (at, flat))
        for name in ("e", "v0", "m", "K", "n", "length", "R1", "E2"):
            with np.errstate(all="ignore"):
                on_grid, at_points = getattr(grid, name), getattr(points, name)
            flattened = np.broadcast_to(on_grid, plan.inputs.shape or (1,)).reshape(-1)
            assert flattened.tobytes() == np.broadcast_to(at_points, flattened.shape).tobytes(), name


def trajectory_counts(sweep: dict[str, object], *models: str, **more: object) -> list[int]:
    """The trajectories of each model."""
    config = {"models": list(models), "sweep": sweep, "materials": MATERIALS, **more}
    return [model_map.count for model_map in read_plan(config, plugins=[DASHPOT, SPEED]).maps]


GRID = {"e": [0.1, 0.5, 0.9], "v1": [1.0, 2.0], "m1": [1.0, 4.0], "m2": [1.0, 4.0], "material": ["soft", "hard"]}


def test_the_number_of_trajectories() -> None:
    # a law that depends on e has one for each e, a law without e has one
    assert trajectory_counts(GRID, "gharib-hurmuzlu-2012", "bilinear", "hertz") == [3, 3, 1]
    assert trajectory_counts({**GRID, "n": [1.5, 2.0]}, "gharib-hurmuzlu-2012", "bilinear", "hertz") == [6, 3, 2]
    # the law depends on v_y over v0, which is equal in two of four pairs, whatever the balls are
    parameters = {"model": {"speed": {"v_y": [0.5, 1.0]}}}
    assert trajectory_counts(GRID, "speed", **parameters) == [3]
    # the law depends on c over the root of K m
    linear = {**GRID, "e": 0.5, "K": 1e6, "n": 1.0}
    assert trajectory_counts(linear, "dashpot", model={"dashpot": {"K": 1e6}}) == [3]
    # e = 1 - alpha v0
    alpha = {name: GRID[name] for name in ("v1", "m1", "m2", "material")} | {"alpha": [0.1, 0.2]}
    assert trajectory_counts(alpha, "gharib-hurmuzlu-2012") == [3]
    zipped = {**GRID, "v1": [1.0, 2.0, 3.0], "zip": [["e", "v1"]]}
    assert trajectory_counts(zipped, "gharib-hurmuzlu-2012", "hertz") == [3, 1]
    assert trajectory_counts(GRID, "gharib-hurmuzlu-2012", "hertz", solver={"collapse": False}) == [48, 48]


@pytest.mark.parametrize(
    ("unit", "n", "p", "axes"),
    [
        ("m^(n-1)", [1.0, 1.0, 2.0], 1.0, (0, 1)),
        ("m^(n-p)/s^(n-p)", [1.5, 1.5, 1.0], 1.5, (0, 1)),
        ("N s^p/m^(n+p)", [1.0, 1.0, 2.0], [0.0, 2.0, 1.0], (0, 1, 2)),
        ("s^(p-1)", [1.0, 1.0, 1.0], 1.0, (0,)),
    ],
)
def test_a_unit_whose_exponent_is_zero_at_the_first_values_hides_no_axis(
    unit: str, n: list[float], p: object, axes: tuple[int, ...]
) -> None:
    power_law = new_law(
        "powers",
        lambda elastic, v, c: elastic * (1.0 + v * c / (1.0 + c)),
        parameters=(impact.Parameter("c", unit, "", least=0.0), impact.Parameter("p", "1", "an exponent")),
    )
    config = {
        "models": ["powers"],
        "materials": MATERIALS,
        "solver": {"rtol": 1e-4},
        "sweep": {
            "e": [0.1, 0.5, 0.9],
            "n": n,
            "v1": [1.0, 2.0, 3.0],
            "m1": 1.0,
            "m2": 1.0,
            "material": "hard",
            "zip": [["e", "n"]],
        },
        "model": {"powers": {"c": 0.3, "p": p}},
    }
    (model_map,) = read_plan(config, plugins=[power_law]).maps
    assert model_map.axes == axes
    deduplicated, separate = (
        impact.sweep(config, overrides=[f"solver.collapse={word}"], plugins=[power_law])
        for word in ("true", "false")
    )
    assert_same_bits(deduplicated, separate)


def test_the_trajectories_of_a_plan_of_any_size_are_counted() -> None:
    long = {"geomspace": [0.1, 10.0, 10_000]}
    sweep = {"e": {"linspace": [0.01, 1.0, 100]}, "v1": long, "m1": long, "m2": long, "material": ["soft", "hard"]}
    config = {"models": ["gharib-hurmuzlu-2012", "speed"], "sweep": sweep, "materials": MATERIALS}
    plan = read_plan(config, plugins=[SPEED], run=Run(max_points=10**15))
    assert plan.points == 4 * 10**14
    assert [model_map.count for model_map in plan.maps] == [100, 10_000]
    estimated = estimate(config, plugins=[SPEED], max_points=10**15)
    assert (estimated.points, estimated.trajectories) == (plan.points, 10_100)
    # a row of the table for each trajectory, and an index of the same length
    assert 50 * 10_100 < estimated.bytes < 100 * 10_100 + 500_000
    full = estimate({**config, "output": {"layout": "full"}}, plugins=[SPEED], max_points=10**15)
    assert full.bytes > 100 * plan.points
    # all points are written in the full layout only; a point takes more than 1 ns
    assert full.seconds > 1e-9 * plan.points > estimated.seconds
    assert [model.axes for model in estimated.models] == [("e",), ("v1",)]


def test_the_time_is_estimated_from_a_model_of_many_trajectories(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []

    def integrate(*inputs: Any) -> Any:
        collisions, others = integrate_columns(*inputs)
        sizes.append(collisions.status.size)
        return collisions, others

    monkeypatch.setattr("impact.results.estimate.integrate_columns", integrate)
    sweep = {"e": {"linspace": [0.1, 0.9, 50]}, "v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 6e9}
    estimate({"models": ["lankarani-nikravesh-1990", "hertz", "tsuji-1992"], "sweep": sweep})
    assert sizes == [50, 50]


def test_an_exponent_gives_the_same_bits_beside_other_exponents() -> None:
    # numpy computes the powers 1/2, 2 and -1 of a whole array by other functions, with different last bits
    rng = np.random.default_rng(7)

    def impacts_of(n: list[float]) -> Impacts:
        count = len(n)
        sizes = {name: rng_values[:count] for name, rng_values in columns.items()}
        unknown = np.full(count, np.nan)
        return Impacts(
            e=unknown,
            **sizes,
            n=np.array(n),
            R1=unknown,
            R2=unknown,
            E1=unknown,
            nu1=unknown,
            E2=unknown,
            nu2=unknown,
            yield_strength1=unknown,
            yield_strength2=unknown,
        )

    columns = {name: rng.uniform(0.1, 9.0, 400) for name in ("v1", "m1", "m2", "K")} | {"v2": np.zeros(400)}
    for n in (1.0, 1.5, 2.0, 3.0):
        alone, mixed = impacts_of([n] * 400).length, impacts_of([n] * 399 + [2.5]).length
        assert alone[:399].tobytes() == mixed[:399].tobytes()


def test_deduplication_is_no_part_of_the_fingerprint() -> None:
    config = {"models": "hertz", "sweep": {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}}
    deduplicated, separate = (Plan(read_config(config, [f"solver.collapse={word}"])) for word in ("true", "false"))
    assert (deduplicated.config.solver.collapse, separate.config.solver.collapse) == (True, False)
    assert deduplicated.fingerprint == separate.fingerprint
