"""The joint integration of normal motion and slip agrees with reference numbers, closed forms and itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from impact.contact.model import ForceModel
from impact.contact.models import find
from impact.contact.tangential import (
    LIMIT_POSITIVE,
    SLIP,
    TANGENTIAL_DAMPING,
    TANGENTIAL_STIFFNESS,
    TangentialForm,
    TangentialResult,
    simulate_friction,
)

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
    status = np.ones(g0.size, np.int8)
    return simulate_friction(Pair(model, form), values["n"], values, status, rtol=rtol, max_steps=100_000)


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
