"""Polynomials stand for the integration of collisions only where both agree to 1e-10."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import impact
from impact.contact.impacts import Impacts
from impact.contact.interpolant import Interpolant, InterpolatedCollisions, motion_key
from impact.contact.models import find
from impact.contact.output_formulas import collide
from impact.contact.simulate import simulate
from impact.contact.status import Status

from .conftest import new_law

Array = NDArray[np.float64]
SETTINGS: dict[str, Any] = {"rtol": 1e-10, "max_steps": 100_000}


def interpolated(model: impact.ForceModel, outputs: tuple[str, ...] = ("e_out",)) -> InterpolatedCollisions:
    return InterpolatedCollisions(model, outputs, core="numpy", **SETTINGS)


def delivered(model: impact.ForceModel, name: str, values: Array, n: float, **options: Any) -> Array:
    ok = np.ones(values.size, np.int8)
    result = simulate(model, np.full(values.size, n), {name: values}, ok, **SETTINGS, **options)
    return np.stack([result.e_out, result.status.astype(float)])


@pytest.mark.parametrize(
    ("key", "name", "n"),
    [("kuwabara-kono-1987", "A", 1.5), ("hunt-crossley-1975", "e", 1.5), ("bilinear", "e", 1.0)],
)
def test_polynomials_agree_with_the_integration(key: str, name: str, n: float) -> None:
    values = np.random.default_rng(3).uniform(0.02, 1.0, 60)
    model = find(key)
    compute = interpolated(model)
    expected = delivered(model, name, values, n)
    np.testing.assert_allclose(delivered(model, name, values, n, compute=compute), expected, rtol=0, atol=1e-10)
    assert compute.group is not None
    assert any(interval.coefficients is not None for interval in compute.group[1].intervals)


def test_samples_are_values_of_the_function_with_its_extrema() -> None:
    interpolant = Interpolant(lambda x: np.sin(3.0 * x)[:, None], [0.1, 1.0, 3.0], np.ones(1))
    interpolant(np.array([0.5, 2.0]))
    x, values = interpolant.samples()
    np.testing.assert_allclose(values, np.sin(3.0 * x), rtol=0, atol=1e-10)
    for extremum in np.pi / 6.0 * np.array([1.0, 3.0, 5.0]):
        assert np.abs(x - extremum).min() < 1e-8


@pytest.mark.slow
def test_a_limit_and_what_is_beside_it_have_their_status() -> None:
    """At C = 2 in the contact's own units the dashpot is critically damped."""
    values = np.array([0.5, 1.5, 2.0, 2.5, 40.0])
    model = find("kelvin-voigt")
    expected = delivered(model, "C", values, 1.0)
    assert set(expected[1].tolist()) == {1.0, 3.0}
    computed = delivered(model, "C", values, 1.0, compute=interpolated(model))
    np.testing.assert_allclose(computed, expected, rtol=0, atol=1e-10)


def test_a_jump_of_a_law_is_not_smoothed() -> None:
    jumping = new_law(
        "jumping",
        lambda K, x, v, p: K * x + np.where(p < 0.3, 0.1, 0.4) * v,
        parameters=(impact.Parameter("p", "1", "a number", default=0.5, least=0.0),),
        exponent=1.0,
    )
    values = np.array([0.11, 0.2, 0.299999, 0.3, 0.300001, 0.7])
    expected = delivered(jumping, "p", values, 1.0)
    computed = delivered(jumping, "p", values, 1.0, compute=interpolated(jumping))
    np.testing.assert_allclose(computed, expected, rtol=0, atol=1e-10)


@pytest.mark.slow
def test_values_do_not_depend_on_what_was_asked_for_before() -> None:
    model, values = find("kuwabara-kono-1987"), np.geomspace(1e-3, 2.0, 30)
    once, compute = delivered(model, "A", values, 1.5, compute=interpolated(model)), interpolated(model)
    delivered(model, "A", np.array([0.5]), 1.5, compute=compute)
    np.testing.assert_array_equal(delivered(model, "A", values, 1.5, compute=compute), once)


def test_what_varies_beside_the_group_is_integrated() -> None:
    """This law has two parameters; the polynomials are those of the first value of the other one."""
    model = find("hertz-power-damping")
    count = 12
    values = {"C": np.geomspace(0.01, 1.0, count), "q": np.full(count, 0.5)}
    compute, ok, n = interpolated(model), np.ones(count, np.int8), np.full(count, 1.5)
    simulate(model, n, values, ok, compute=compute, **SETTINGS)
    assert compute.group is not None
    values["q"][6:] = 1.0
    expected = simulate(model, n, values, ok, **SETTINGS).e_out
    np.testing.assert_allclose(
        simulate(model, n, values, ok, compute=compute, **SETTINGS).e_out, expected, atol=1e-10
    )


@pytest.mark.parametrize("function", [np.abs, np.sign])
def test_only_a_small_interval_around_a_kink_or_a_jump_has_no_polynomial(
    function: Callable[[Array], Array],
) -> None:
    interpolant = Interpolant(lambda x: function(x - 0.3)[:, None], [0.1, 1.0], np.ones(1))
    x = np.linspace(0.1, 1.0, 1001)
    values = interpolant(x)[:, 0]
    is_known = ~np.isnan(values)
    assert np.abs(x[~is_known] - 0.3).max() < 0.03
    np.testing.assert_allclose(values[is_known], function(x - 0.3)[is_known], atol=1e-12)


def test_threads_that_divide_intervals_at_the_same_time_have_the_values_of_one() -> None:
    def function(x: Array) -> Array:
        return np.asarray(np.abs(x - 0.5))[:, None]

    points = np.random.default_rng(0).uniform(0.01, 3.9, (8, 4))
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as executor:
            for _ in range(100):
                interpolant = Interpolant(function, np.linspace(0.001, 4.001, 5), np.ones(1))
                for x, values in zip(points, executor.map(interpolant, points), strict=True):
                    known = ~np.isnan(values)
                    np.testing.assert_allclose(values[known], function(x)[known], atol=1e-9)
    finally:
        sys.setswitchinterval(before)


def test_an_interval_that_is_not_needed_is_not_divided() -> None:
    interpolant = Interpolant(
        lambda x: np.abs(x - 0.3)[:, None], [0.1, 1.0], np.ones(1), is_needed=lambda values: values.min() > 0.5
    )
    assert np.isnan(interpolant(np.array([0.11, 0.99]))).all()


def test_a_value_for_which_a_law_raises_has_a_status_and_leaves_the_others_their_polynomials() -> None:
    def force(K: Array, x: Array, v: Array, p: Array) -> Array:
        if (p > 0.3).any():
            raise ValueError("no such material")
        return K * x + p * v

    parameter = impact.Parameter("p", "1", "a number", default=0.5, least=0.0)
    model = new_law("raising", force, parameters=(parameter,), exponent=1.0)
    values = np.array([0.002, 0.05, 0.2, 0.31, 0.9])
    compute = interpolated(model)
    computed = delivered(model, "p", values, 1.0, compute=compute)
    assert computed[1].tolist() == [*[Status.OK] * 3, *[Status.MODEL_ERROR] * 2]
    np.testing.assert_allclose(computed, delivered(model, "p", values, 1.0), rtol=0, atol=1e-10)
    assert compute.group is not None
    assert any(interval.coefficients is not None for interval in compute.group[1].intervals)


def test_laws_of_the_same_motion_share_their_polynomials() -> None:
    assert motion_key(find("hunt-crossley-1975")) == motion_key(find("lankarani-nikravesh-1990"))
    assert motion_key(find("tsuji-1992")) != motion_key(find("tsuji-1992-no-tension"))
    assert motion_key(find("jkr-1971")) != motion_key(find("thornton-1997"))
    # the power of x in the damping is beside the formulas
    tsuji = find("tsuji-1992")
    other = replace(tsuji, coefficients={**tsuji.coefficients, "q": lambda n: 0.5})
    assert motion_key(other) != motion_key(tsuji)


def test_outputs_in_si_follow_from_polynomials() -> None:
    model, count = find("kelvin-voigt"), 20
    fields = dict.fromkeys(("e", "v2", "R1", "R2", "E1", "nu1", "yield_strength1", "E2", "nu2", "yield_strength2"))
    missing = {name: np.full(count, np.nan) for name in fields} | {"v2": np.zeros(count)}
    impacts = Impacts(
        **missing,
        v1=np.linspace(0.5, 3.0, count),
        m1=np.ones(count),
        m2=np.full(count, np.inf),
        K=np.geomspace(1e4, 1e6, count),
        n=np.ones(count),
        parameters={"C": np.full(count, 20.0)},
    )
    names = ("e_out", "contact_time", "peak_force", "e_energetic")
    expected = collide(model, impacts, names=names, **SETTINGS)
    computed = collide(model, impacts, names=names, compute=interpolated(model, names), **SETTINGS)
    for name in names:
        np.testing.assert_allclose(computed[name], expected[name], rtol=1e-9)
