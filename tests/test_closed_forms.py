"""The closed forms are accurate to rounding over their whole range, compared with 80-digit arithmetic."""

import math

import mpmath as mp
import numpy as np
import pytest

from impact.contact.closed_forms.hysteresis import (
    SERIES_BELOW_CHI,
    SERIES_FROM_E,
    delivered_restitution,
    exact_damping_ratio,
    peak_indentation,
)

from .problems import contact_time_ratio, damped_peak_indentation

DIGITS = 80
EXPONENTS = (1.0, 1.3, 1.5, 2.0, 3.0)
# dense where a series replaces another form
CHI = np.unique(
    [
        *np.logspace(-10, 8, 181),
        *np.linspace(0.005, 3.0, 200),
        *np.nextafter(SERIES_BELOW_CHI, [0.0, 1.0]),
        *np.nextafter(0.01, [0.0, 1.0]),
    ]
)
E = np.unique(
    [
        *np.logspace(-12, 0, 121),
        *(1.0 - np.logspace(-15, -1, 60)),
        *np.linspace(0.01, 1.0, 100),
        *np.nextafter(SERIES_FROM_E, [0.0, 1.0]),
    ]
)


def exact_restitution(chi: float) -> mp.mpf:
    with mp.workdps(DIGITS):
        a = 1 + mp.mpf(float(chi))
        return (1 + mp.lambertw(-a * mp.exp(-a)).real) / mp.mpf(float(chi))


def exact_damping(e: float) -> mp.mpf:
    with mp.workdps(DIGITS):
        if e == 1:
            return mp.mpf(0)
        e = mp.mpf(float(e))
        chi = min(mp.mpf(1.5) * (1 - e) / e ** mp.mpf(0.89), 1 / e)
        for _ in range(12):
            decay = mp.exp(-(1 + e) * chi)
            chi -= (e * chi - 1 + (1 + chi) * decay) / (e - decay * (e + (1 + e) * chi))
        # the logarithmic relation, where 1 - e chi is not cancelled
        if e > mp.mpf(0.1):
            assert abs(chi * (1 + e) - mp.log((1 + chi) / (1 - chi * e))) < mp.mpf(10) ** -50
        return chi


def exact_damped_peak(chi: float, n: float) -> mp.mpf:
    with mp.workdps(DIGITS):
        chi, n = mp.mpf(float(chi)), mp.mpf(n)
        return ((n + 1) * (chi - mp.log(1 + chi)) / chi**2) ** (1 / (n + 1))


def largest_relative_error(values: np.ndarray, expected: list) -> float:
    pairs = zip(values.tolist(), expected, strict=True)
    return max(float(abs(value - exact) / abs(exact)) if exact else abs(value) for value, exact in pairs)


def test_delivered_restitution_is_accurate_to_rounding():
    assert largest_relative_error(delivered_restitution(CHI), [exact_restitution(chi) for chi in CHI]) < 1e-13


def test_exact_damping_ratio_is_accurate_to_rounding():
    assert largest_relative_error(exact_damping_ratio(E), [exact_damping(e) for e in E]) < 2e-13


@pytest.mark.parametrize("n", EXPONENTS)
def test_damped_peak_is_accurate_to_rounding(n):
    assert (
        largest_relative_error(damped_peak_indentation(CHI, n), [exact_damped_peak(chi, n) for chi in CHI]) < 2e-13
    )


def test_damping_and_restitution_are_inverse():
    assert np.abs(delivered_restitution(exact_damping_ratio(E)) / E - 1.0).max() < 1e-13
    assert np.all(np.abs(exact_damping_ratio(delivered_restitution(CHI)) - CHI) < 3e-13 * np.maximum(1.0, CHI))


@pytest.mark.parametrize(
    ("formula", "threshold"),
    [
        (delivered_restitution, SERIES_BELOW_CHI),
        (exact_damping_ratio, SERIES_FROM_E),
        (lambda chi: damped_peak_indentation(chi, 1.5), 0.01),
    ],
    ids=["delivered_restitution", "exact_damping_ratio", "damped_peak_indentation"],
)
def test_series_and_other_form_agree_at_the_threshold(formula, threshold):
    below, at = formula(np.array([np.nextafter(threshold, 0.0), threshold]))
    assert below == pytest.approx(at, rel=2e-13)


def test_restitution_falls_with_damping():
    coarse = np.sort(np.concatenate([np.logspace(-6, 8, 500), np.linspace(0.05, 0.07, 100)]))
    assert np.all(np.diff(delivered_restitution(coarse)) < 0.0)
    assert np.all(delivered_restitution(coarse) <= 1.0 / coarse)


@pytest.mark.parametrize(
    ("chi", "e"),
    [(0.0, 1.0), (0.75, 0.662962200002), (1.0, 0.593624260040), (1.5, 0.487741256015), (np.inf, 0.0)],
)
def test_limits_of_the_restitution(chi, e):
    assert float(delivered_restitution(chi)) == pytest.approx(e, rel=0, abs=6e-13)


@pytest.mark.parametrize(("e", "chi"), [(0.0, np.inf), (1.0, 0.0)])
def test_limits_of_the_damping(e, chi):
    assert float(exact_damping_ratio(e)) == chi


def test_damping_of_a_small_restitution_is_its_reciprocal():
    # (23) and (28) are the same there, but for a rounding of the last bit
    e = np.logspace(-12, math.log10(0.025), 200)
    assert np.all(np.abs(exact_damping_ratio(e) - 1.0 / e) <= np.spacing(1.0 / e))


def test_values_of_arrays_and_of_single_numbers_have_the_same_bits():
    assert [float(exact_damping_ratio(e)) for e in E] == exact_damping_ratio(E).tolist()
    assert [float(delivered_restitution(chi)) for chi in CHI] == delivered_restitution(CHI).tolist()


@pytest.mark.parametrize("n", EXPONENTS)
def test_limits_of_the_damped_peak(n):
    undamped, huge, infinite = damped_peak_indentation(np.array([0.0, 1e8, np.inf]), n)
    assert undamped == pytest.approx(float(peak_indentation(1.0, 1.0, 1.0, n)), rel=1e-15)
    assert huge == pytest.approx(((n + 1.0) / 1e8) ** (1.0 / (n + 1.0)), rel=1e-6)
    assert infinite == 0.0


@pytest.mark.parametrize(("n", "ratio"), [(1.0, math.pi), (1.5, 2.943275184324706)])
def test_contact_time_ratio(n, ratio):
    assert contact_time_ratio(n) == pytest.approx(ratio, rel=1e-15)


@pytest.mark.parametrize("n", EXPONENTS)
def test_contact_time_is_twice_the_time_to_the_peak(n):
    # dt = dx/v with v² = 1 - z^(n+1), z = x/δₘ
    with mp.workdps(30):
        time = 2 * mp.quad(lambda z: 1 / mp.sqrt(1 - z ** (mp.mpf(n) + 1)), mp.linspace(0, 1, 3))
    assert contact_time_ratio(n) == pytest.approx(float(time), rel=1e-14)


def test_linear_contact_lasts_half_a_period():
    m, v0, K = 0.7, 3.0, 250.0
    time = contact_time_ratio(1.0) * peak_indentation(m, v0, K, 1.0) / v0
    assert time == pytest.approx(math.pi / math.sqrt(K / m), rel=1e-15)
