"""The joint integration of normal motion and slip agrees with reference numbers, closed forms and itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from impact.contact.model import ForceModel
from impact.contact.models import find
from impact.contact.status import FrictionStatus
from impact.contact.tangential import (
    LIMIT_POSITIVE,
    SLIP,
    SLIP_SCALE,
    TANGENTIAL_DAMPING,
    TANGENTIAL_STIFFNESS,
    TangentialForm,
    TangentialResult,
    simulate_friction,
)

from . import friction_reference

RTOL = 1e-10
# the inputs of the reference numbers, with K = m = v0 = 1
M_T, MU, C, HERTZ = 2.0 / 7.0, 0.3, 2.0 * 0.1128084507, 1.2352941176
POSITIVE = 1.0


@dataclass(frozen=True)
class Pair:
    """A contact force model with the form of a tangential problem."""

    model: ForceModel
    of_n: TangentialForm
    key: str = "pair"

    def form(self, n: float) -> TangentialForm:
        return self.of_n


def spring(
    kp: float = 0.0, q: float = 0.0, memory: tuple[float, float] = (0.0, 0.0), cap: Any = "total"
) -> TangentialForm:
    return TangentialForm("spring", kp, q, memory, cap)


def simulate(key: str, form: TangentialForm, g0: Any, **inputs: Any) -> TangentialResult:
    """Simulate impacts with K = m = v0 = 1 and slips g0; k and c are those of the tangential spring."""
    model = find(key)
    defaults = {"e": 1.0, "n": model.exponent or 1.5, "mu": MU, "m_t": M_T, "k": 0.0, "c": 0.0, "limit": 0.0}
    inputs = {"rtol": RTOL, "K": 1.0, "m": 1.0, "v0": 1.0, **defaults, **inputs}
    rtol = inputs.pop("rtol")
    names = list(inputs)
    g0, *arrays = np.broadcast_arrays(np.atleast_1d(g0), *inputs.values())
    values = {name: np.array(array, float) for name, array in zip(names, arrays, strict=True)}
    m_t, mu = values.pop("m_t"), values.pop("mu")
    values[SLIP] = m_t * g0 / mu
    values[TANGENTIAL_STIFFNESS] = values.pop("k") / m_t
    values[TANGENTIAL_DAMPING] = values.pop("c") / m_t
    values[LIMIT_POSITIVE] = values.pop("limit")
    if "scale" in values:
        values[SLIP_SCALE] = values.pop("scale")
    status = np.ones(g0.size, np.int8)
    return simulate_friction(Pair(model, form), values["n"], values, status, rtol=rtol, max_steps=10_000)


def beta(result: TangentialResult, g0: Any, m_t: Any = M_T, mu: Any = MU) -> Any:
    return -result.slip * mu / (m_t * np.asarray(g0))


ZETA, BOUNCY = "yade-viscoelastic-pulling", "yade-viscoelastic"
REFERENCE: list[tuple[str, TangentialForm, dict[str, float], dict[float, float]]] = [
    ("hertz", spring(), {"n": 1.0, "k": 0.8}, {0.2: -0.2755047382, 1.0: 0.4769459935}),
    ("hertz", spring(), {"n": 1.0, "k": M_T}, {0.5: 1.0, 1.5: 0.4, 3.0: -0.3}),
    (ZETA, spring(), {"C": C, "k": M_T}, {0.2: 0.9460191833, 1.0: 0.6169228848}),
    (BOUNCY, spring(), {"C": C, "k": M_T}, {0.2: 0.9710510743, 1.0: 0.6332468100}),
    (ZETA, spring(), {"C": C, "k": M_T, "c": C}, {0.2: 0.3349560103, 1.0: 0.2487924863}),
    (ZETA, spring(cap="spring"), {"C": C, "k": M_T, "c": C}, {0.2: 0.2843498352, 1.0: 0.3383276283}),
    (
        ZETA,
        spring(cap="spring"),
        {"C": C, "k": M_T, "c": C, "limit": POSITIVE},
        {0.2: 0.349907081229, 1.0: 0.416329528871},
    ),
    (ZETA, TangentialForm("dashpot"), {"C": C, "c": C}, {0.2: -0.0837190762}),
    (ZETA, TangentialForm("dashpot"), {"C": C, "c": C, "limit": POSITIVE}, {0.2: -0.099380624399}),
    ("bilinear", spring(), {"n": 1.0, "e": 0.7, "k": M_T}, {0.2: 0.8754247215, 1.0: 0.7250747576}),
    (
        "hertz",
        spring(0.5, memory=(1.0, 1.0)),
        {"k": HERTZ},
        {0.2: -0.9382452227, 0.6: 0.1381289427, 1.2: 0.3494952312},
    ),
    (
        "hertz",
        spring(0.5, memory=(0.0, 0.0)),
        {"k": HERTZ},
        {0.2: -0.6550129277, 0.6: 0.0878103927, 1.2: 0.3899764294},
    ),
    (
        "hertz",
        spring(0.5, memory=(1.0, 2.0)),
        {"k": HERTZ},
        {0.2: -0.6235853858, 0.6: 0.1460639875, 1.2: 0.3168336644},
    ),
    (
        "hertz",
        spring(0.5, memory=(0.0, 1.0)),
        {"k": HERTZ},
        {0.2: -0.4813614900, 0.6: 0.0954038379, 1.2: 0.3494952312},
    ),
    ("tsuji-1992", spring(0.5), {"e": 0.8, "k": HERTZ}, {0.6: 0.1853585578}),
    ("tsuji-1992", spring(0.5, memory=(0.0, 1.0)), {"e": 0.8, "k": HERTZ}, {0.6: 0.1906659020}),
]


@pytest.mark.parametrize(("key", "form", "inputs", "expected"), REFERENCE)
def test_agrees_with_reference_numbers(
    key: str, form: TangentialForm, inputs: dict[str, float], expected: dict[float, float]
) -> None:
    result = simulate(key, form, list(expected), **inputs)
    assert (result.status == 1).all()
    np.testing.assert_allclose(beta(result, list(expected)), list(expected.values()), rtol=0.0, atol=1e-9)


# mindlin with damping of the same power as the normal damping, cap total
MINDLIN = spring(0.5, 0.25, (1.0, 1.0))


def test_a_slip_within_a_step_whose_ends_stick_is_found() -> None:
    mu, k, g0 = 0.23993550754806486, 4.547180681446862, np.tan(np.radians(27.12447285847138))
    result = simulate("hertz", spring(0.5, memory=(1.0, 2.0)), g0, k=k, mu=mu)
    np.testing.assert_allclose(beta(result, g0, mu=mu), -0.113860514635, rtol=0.0, atol=1e-9)


def test_the_last_change_between_stick_and_slip_before_the_release_is_found() -> None:
    """The numbers are those of the independent solver, of a spring with a limit and a dashpot beside it."""
    result = simulate("hertz", spring(cap="spring"), 0.044, k=0.3, c=0.24, mu=0.14, m_t=0.36)
    np.testing.assert_allclose(beta(result, 0.044, m_t=0.36, mu=0.14), 0.3790938552, rtol=0.0, atol=2e-8)
    assert result.slip_changes.tolist() == [4]


def test_rebound_with_more_energy_than_before_is_reported() -> None:
    inputs = {"C": 0.491935, "q": 0.25, "k": 0.617647, "mu": 0.5}
    result = simulate("hertz-power-damping", spring(0.5, memory=(1.0, 1.0)), 0.796214, **inputs)
    assert beta(result, 0.796214, mu=0.5)[0] > 1.0
    np.testing.assert_allclose(beta(result, 0.796214, mu=0.5), 1.0288303, rtol=0.0, atol=2e-7)
    assert result.memory_work[0] < 0.0


@pytest.mark.parametrize(
    ("c", "q", "mu", "xt", "g0", "expected"),
    [
        (0.3, 0.25, 0.3, 1.0, 1.0, 0.2192436193264),
        (0.3, 0.25, 0.63, 0.656, 1.1 * 0.63 / 0.656, 0.3544288604517),
        (0.3, 0.5, 0.3, 1.0, 1.0, 0.1758545196360),
    ],
)
def test_slow_limits(c: float, q: float, mu: float, xt: float, g0: float, expected: float) -> None:
    inputs = {"C": c, "q": q, "k": HERTZ, "c": xt * c, "mu": mu}
    result = simulate("hertz-power-damping", spring(0.5, q, (1.0, 1.0)), g0, **inputs)
    np.testing.assert_allclose(beta(result, g0, mu=mu), expected, rtol=0.0, atol=1e-9)
    assert result.status[0] == (FrictionStatus.SLOW_LIMIT if q < 0.5 else FrictionStatus.OK)


def test_closed_forms_of_slips_that_never_stick_or_never_slip() -> None:
    result = simulate("hertz", spring(), [0.5, 1.5, 20.0], n=1.0, k=M_T)
    assert list(result.regime) == [1, 2, 2]
    np.testing.assert_allclose(result.slip, result.exact, rtol=0.0, atol=50 * RTOL * 20.0)
    # with any normal damping to F = 0, and a limit that is never reached
    result = simulate(BOUNCY, spring(), 1.0, C=0.3, k=0.1, mu=1e9)
    half, root = 0.15, np.sqrt(1.0 - 0.15**2)
    duration = np.arctan2(2.0 * half * root, 2.0 * half**2 - 1.0) / root
    expected = -np.cos(np.sqrt(0.1 / M_T) * duration)
    np.testing.assert_allclose(beta(result, 1.0, mu=1e9), expected, atol=50 * RTOL)
    sticks = simulate("hertz", spring(), 0.2, n=1.0, k=M_T)
    np.testing.assert_allclose(sticks.slip, -M_T * 0.2 / MU, rtol=50 * RTOL)
    assert sticks.regime[0] == 1


@pytest.mark.parametrize(("limit", "expected"), [(0.0, -0.0827963), (POSITIVE, -0.0948511)])
def test_the_limit_empties_the_spring_at_zero_force_for_every_mu(limit: float, expected: float) -> None:
    result = simulate(ZETA, spring(), 1.0, C=0.3, k=0.8, mu=1e7, limit=limit)
    np.testing.assert_allclose(beta(result, 1.0, mu=1e7), expected, rtol=0.0, atol=1e-6)


def test_sliding_impulse_has_closed_forms() -> None:
    zeta, form = 0.15, TangentialForm("coulomb")
    root = np.sqrt(1.0 - zeta**2)
    to_force = np.exp(-zeta / root * np.arctan2(2.0 * zeta * root, 2.0 * zeta**2 - 1.0))
    to_gap = np.exp(-np.pi * zeta / root)
    assert simulate(BOUNCY, form, 1.0, C=2.0 * zeta).sliding_impulse[0] == pytest.approx(1.0 + to_force, abs=5e-9)
    for limit, expected in ((0.0, 1.0 + 2.0 * to_force - to_gap), (POSITIVE, 1.0 + to_force)):
        result = simulate(ZETA, form, 1.0, C=2.0 * zeta, limit=limit)
        assert result.sliding_impulse[0] == pytest.approx(expected, abs=5e-9)
        assert np.isnan(result.slip[0])


def test_a_held_spring_forgets_the_past() -> None:
    # cap spring with c > 0 may end at F = 0 with g1 = -mu (K/k_t) e_out v0
    result = simulate(
        BOUNCY, spring(cap="spring"), [0.848, 0.9], C=1.351, k=0.637, c=0.93 * 1.351, mu=0.282, m_t=0.322
    )
    impulse = simulate(BOUNCY, TangentialForm("coulomb"), 1.0, C=1.351).sliding_impulse
    expected = -0.282 / 0.637 * (impulse[0] - 1.0)
    slips = result.slip * 0.282 / 0.322
    np.testing.assert_allclose(slips, expected, rtol=1e-8)


@pytest.mark.parametrize(
    ("q", "k", "mu", "m_t", "g0", "damping", "memory"),
    [
        (1.5, 1.0, 0.3, 0.3, [1.05, 1.1], [0.1170461913, 0.1178336498], [0.0009241581, 0.0002307919]),
        (0.25, 0.7, 0.1, 0.4, [0.26, 0.27], [0.0564244898, 0.0420244899], [0.0, 0.0]),
    ],
)
def test_a_spring_that_is_held_to_the_end_of_a_fading_force_determines_the_last_slip(
    q: float, k: float, mu: float, m_t: float, g0: list[float], damping: list[float], memory: list[float]
) -> None:
    """k_t x^(1/2) g = mu d(K x^(3/2))/dt gives g1 = -(3/2) mu (K/k_t) v0, although 0 = 0 at the end."""
    form = spring(0.5, q, (0.0, 0.0), "spring")
    result = simulate("hertz", form, g0, k=k, c=1.0, mu=mu, m_t=m_t)
    assert result.status.tolist() == [1, 1]
    np.testing.assert_allclose(result.slip, -1.5 * m_t / k, rtol=1e-6)
    # the works of `friction_reference`
    np.testing.assert_allclose(result.damping_work, damping, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(result.memory_work, memory, rtol=0.0, atol=1e-7)


def test_smooth_regularized_friction() -> None:
    def smooth(y: Any) -> Any:
        y = np.minimum(y, 1.0)
        return y**3 * (10.0 - 15.0 * y + 6.0 * y * y)

    form = TangentialForm("regularized", coefficient=smooth)
    result = simulate("hertz", form, 0.5, n=1.0, scale=MU / M_T / 0.01)
    np.testing.assert_allclose(beta(result, 0.5), -0.0003627776, rtol=0.0, atol=1e-9)
    assert result.regime[0] == 0
    loss = 0.5 * ((M_T * 0.5 / MU) ** 2 - result.slip**2)
    np.testing.assert_allclose(result.slip_work, loss, rtol=50 * RTOL)


LAWS: list[tuple[str, TangentialForm]] = [
    ("hertz", spring(0.5, memory=(1.0, 2.0))),
    ("hertz", spring()),
    ("tsuji-1992", spring(0.5, 0.25, (0.0, 1.0))),
    ("tsuji-1992", spring(0.5, 0.25, (0.0, 0.0))),
    ("tsuji-1992", MINDLIN),
    ("tsuji-1992", spring(0.5, 0.25, (1.0, 2.0), "spring")),
    ("tsuji-1992", TangentialForm("dashpot", damping_power=0.25)),
    (ZETA, spring(cap="spring")),
    (BOUNCY, spring()),
    # some of these contacts end where the spring is held at its limit
    (BOUNCY, spring(0.5, 0.25, cap="both")),
    ("bilinear", spring()),
]


def random_inputs(key: str, count: int, seed: int) -> tuple[Any, dict[str, Any]]:
    """Random slips and inputs of friction for a normal law."""
    random = np.random.default_rng(seed)
    uniform = random.uniform
    inputs = {
        "mu": uniform(0.05, 0.8, count),
        "m_t": uniform(0.2, 0.4, count),
        "e": uniform(0.2, 0.98, count),
        "k": uniform(0.4, 1.5, count),
        "limit": random.integers(0, 2, count),
        "c": np.where(uniform(size=count) < 0.5, 0.0, uniform(0.0, 0.5, count)),
    }
    if key in (ZETA, BOUNCY):
        inputs["C"] = uniform(0.02, 1.5, count)
    elif key != "tsuji-1992":
        inputs["c"] = 0.0
    if key == "bilinear":
        inputs["n"] = 1.0
    return np.tan(np.radians(uniform(3.0, 85.0, count))), inputs


@pytest.mark.slow
@pytest.mark.parametrize(("key", "form"), LAWS)
def test_works_balance(key: str, form: TangentialForm) -> None:
    g0, inputs = random_inputs(key, 100, 2)
    result = simulate(key, form, g0, **inputs)
    assert np.isin(result.status, (1, 4)).all()
    start = inputs["m_t"] * g0 / inputs["mu"]
    loss = 0.5 * (start**2 - result.slip**2)
    works = result.slip_work + result.damping_work + result.memory_work + result.elastic_left
    np.testing.assert_allclose(works / start**2, loss / start**2, rtol=0.0, atol=50 * RTOL)
    closed = np.isfinite(result.exact)
    np.testing.assert_allclose(result.slip[closed], result.exact[closed], rtol=50 * RTOL)


@pytest.mark.parametrize("memory", [0.0, 0.5, 1.0])
def test_the_energy_left_in_a_spring_that_sticks_to_the_end_is_finite(memory: float) -> None:
    # the dashpot pulls at x = 0, where the stiffness vanishes and the limit does not
    form, g0 = spring(0.5, memory=(memory, memory)), np.array([0.05, 0.2])
    result = simulate("kelvin-voigt", form, g0, C=0.4, mu=5.0, k=1.0, n=1.0)
    start = M_T * g0 / 5.0
    loss = 0.5 * (start**2 - result.slip**2) / start**2
    slip, memory_work, left = (
        work / start**2 for work in (result.slip_work, result.memory_work, result.elastic_left)
    )
    np.testing.assert_allclose(slip + memory_work + left, loss, rtol=0.0, atol=50 * RTOL)
    if memory == 0.5:
        # the stiffness changes at a constant energy
        np.testing.assert_allclose(memory_work, 0.0, rtol=0.0, atol=50 * RTOL)
        assert (left > 1e-3).all()
    else:
        # an energy that vanishes, or grows without bound, with the stiffness is in the memory work
        np.testing.assert_allclose(left, 0.0, rtol=0.0, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("key", "form"), LAWS)
def test_values_do_not_depend_on_the_batch(key: str, form: TangentialForm) -> None:
    g0, inputs = random_inputs(key, 40, 3)
    together = simulate(key, form, g0, **inputs)
    order = np.random.default_rng(4).permutation(40)
    shuffled = simulate(key, form, g0[order], **{name: at(value, order) for name, value in inputs.items()})
    alone = simulate(key, form, g0[7], **{name: at(value, 7) for name, value in inputs.items()})
    for name in TangentialResult.columns():
        values = getattr(together, name)
        np.testing.assert_array_equal(getattr(shuffled, name), values[order])
        np.testing.assert_array_equal(getattr(alone, name), values[[7]])


def at(value: Any, index: Any) -> Any:
    return value if np.ndim(value) == 0 else value[index]


@pytest.mark.parametrize(("key", "form"), LAWS)
def test_agrees_with_the_independent_solver(key: str, form: TangentialForm) -> None:
    g0, inputs = random_inputs(key, 2, 6)
    result = simulate(key, form, g0, **inputs)
    n = inputs.get("n", find(key).exponent or 1.5)
    for i in range(2):
        case = {name: float(at(value, i)) for name, value in inputs.items()}
        values = {name: case[name] for name in ("e", "C") if name in case}
        normal = (
            friction_reference.spring_dashpot(n)
            if key == "hertz"
            else friction_reference.normal_law(find(key), n, values)
        )
        friction = friction_reference.Friction(
            form.kind,
            case["mu"],
            case["m_t"],
            case["k"],
            form.stiffness_power,
            form.memory,
            case["c"],
            form.damping_power,
            form.cap,
            bool(case["limit"]),
        )
        expected = friction_reference.solve(normal, friction, g0[i])
        scale = case["mu"] / case["m_t"]
        assert result.slip[i] * scale == pytest.approx(expected.g, rel=0.0, abs=2e-9 * g0[i])
        assert result.sliding_impulse[i] == pytest.approx(expected.sliding_impulse, abs=1e-9)
        assert (result.status[i] == FrictionStatus.SLOW_LIMIT) == expected.slow


@pytest.mark.parametrize("form", [spring(), spring(cap="both"), TangentialForm("dashpot")])
def test_a_slip_is_the_same_on_both_sides_of_the_damping_from_which_on_it_counts_as_strong(
    form: TangentialForm,
) -> None:
    """The normal motion is integrated in v up to C = 2, and in a coordinate for strong damping from there."""
    g0 = np.array([0.2, 1.0, 3.0])
    weak, strong = (simulate(BOUNCY, form, g0, C=C, k=M_T, c=0.3) for C in (2.0, np.nextafter(2.0, 3.0)))
    assert (strong.steps != weak.steps).all()
    np.testing.assert_allclose(strong.slip, weak.slip, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(strong.sliding_impulse, weak.sliding_impulse, rtol=1e-9)


def test_impacts_without_slip_or_friction_are_not_integrated() -> None:
    with np.errstate(divide="ignore"):
        result = simulate("hertz", spring(), [0.0, 1.0, 1.0], n=1.0, k=M_T, mu=[0.3, 0.0, 0.3])
    assert list(result.status) == [1, 1, 1]
    assert list(result.steps > 0) == [False, False, True]
    assert list(np.isnan(result.slip)) == [True, True, False]


def test_a_failing_trajectory_affects_no_other() -> None:
    good = simulate("hertz", spring(), [0.2, 1.0], n=1.0, k=0.8)
    mixed = simulate("hertz", spring(), [0.2, 0.5, 1.0], n=1.0, k=[0.8, np.inf, 0.8])
    assert list(mixed.status) == [1, FrictionStatus.OUT_OF_RANGE, 1]
    assert np.isnan(mixed.slip[1])
    np.testing.assert_array_equal(mixed.slip[[0, 2]], good.slip)


LAST_SLIP = {
    "a minimum of the margin above zero": (
        "gharib-hurmuzlu-2012",
        spring(q=1.0, memory=(1.0, 1.0), cap="spring"),
        {
            "g0": 4.797981727357671,
            "mu": 0.331957510566265,
            "m_t": 0.3143561998840895,
            "n": 1.0,
            "k": 2.0 / 7.0,
            "c": 1.0,
            "limit": POSITIVE,
        },
        1e-5,
    ),
    "a margin that does not change near the release": (
        "hertz",
        spring(cap="spring"),
        {
            "g0": 0.03096514152958941,
            "mu": 0.06992666378583981,
            "m_t": 1.0,
            "k": 0.2923938506043898,
            "c": 0.4298572093255685,
            "limit": POSITIVE,
        },
        1e-4,
    ),
    "a margin that falls from the start of a mode and grows again": (
        "lammps-coeff-restitution-hooke",
        TangentialForm("dashpot"),
        {
            "e": 0.16275942134468757,
            "g0": 0.6245434412472585,
            "mu": 0.2835482173411002,
            "m_t": 0.28978945163322134,
            "c": 1.3623441679044879,
        },
        1e-4,
    ),
}


@pytest.mark.parametrize("name", LAST_SLIP)
def test_the_changes_of_mode_are_the_same_at_a_loose_tolerance(name: str) -> None:
    key, form, inputs, rtol = LAST_SLIP[name]
    loose, tight = (simulate(key, form, **inputs, rtol=tolerance) for tolerance in (rtol, RTOL))

    assert loose.slip_changes[0] == tight.slip_changes[0]
    assert abs(loose.slip[0] - tight.slip[0]) < 10.0 * rtol
