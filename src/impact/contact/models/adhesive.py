"""Adhesive laws: the balls stick below a speed, e_out = 0; see also `luding-2008` in `elastoplastic`."""

from __future__ import annotations

import numpy as np

from ...array_types import Array
from ..closed_forms.plastic import edinburgh_adhesion, edinburgh_restitution, jkr_restitution, jkr_root
from ..evidence import seen
from ..force_expressions import spring
from ..model import ForceModel, Parameter
from ..powers import integer_power, power
from .elastoplastic import E_OF_K

JKR_1971 = ForceModel(
    key="jkr-1971",
    title="Johnson, Kendall and Roberts, by Thornton and Ning",
    year=1971,
    equation="F = 4E* a³/(3R*) − √(8π Γ E* a³),  δ = a²/R* − √(2π Γ a/E*), from δ = 0 to the pull-off at δ = "
    "−(3/4)(π² Γ² R*/E*²)^(1/3)",
    reference="Thornton C, Ning Z (1998) A theoretical model for the stick/bounce behaviour of adhesive, "
    "elastic-plastic spheres. Powder Technol. 99, 154; Johnson KL, Kendall K, Roberts AD (1971)",
    doi="10.1016/S0032-5910(98)00099-0",
    evidence=seen(
        "lammps/lammps, doc/src/pair_granular.rst @02dde6e35f (2019), whose γ is Γ/2; the restitution in a public "
        "digest (2026) of Thornton and Ning (1998), equations (49) to (57)",
        doi="the same digest",
        note="elastic: all that is lost is the work of the neck",
    ),
    parameters=(Parameter("gamma", "N/m", "work of adhesion Γ", least=0.0, typical=0.01),),
    coefficients={
        "E": E_OF_K,
        "b": lambda gamma, E: np.sqrt(2 * np.pi * gamma / E),
    },
    # with y = √a: δ = y⁴/R* − b y and F = E* (4y⁶/(3R*) − 2b y³)
    force=lambda x, E, R_eff, b: jkr_force(x, E, R_eff, b),
    unloading=lambda x, E, R_eff, b: jkr_force(x, E, R_eff, b),
    # the pull-off, where δ as a function of y is least
    residual=lambda R_eff, b: -0.75 * b * np.cbrt(0.25 * b * R_eff),
    oracle=lambda m, v0, E, R_eff, b: jkr_restitution(m * v0 * v0, E, R_eff, b),
    exponent=1.5,
    family="adhesive",
)


def jkr_force(x: Array, E: Array, R_eff: Array, b: Array) -> Array:
    """Compute the force at an indentation x, negative where the neck pulls; any shape."""
    y = jkr_root(x, R_eff, b)
    cube = integer_power(y, 3)
    return np.asarray(E * cube * (4 / 3 * cube / R_eff - 2 * b))


LIGGGHTS_EDINBURGH = ForceModel(
    key="liggghts-edinburgh",
    title="LIGGGHTS edinburgh, elasto-plastic adhesive (3.8.0)",
    year=2017,
    equation="F = K δⁿ;  back F = max(k₂(δⁿ − δₚⁿ), −k_a δ^χ) to δₚ, with Γ > 0 to δ = 0,  "
    "δₚ = (1 − K/k₂)^(1/n) δₘ,  k_a = f/d^χ,  f = min((3/2)π Γ a, k₂ δₚⁿ/2),  a the radius of the "
    "spheres' intersection at δₚ,  d = δₚ/2 where f is limited to k₂ δₚⁿ/2, else (δₚⁿ − f/k₂)^(1/n);  "
    "K = 2E* R* for n = 1, else (4/3)E* √R*",
    reference="LIGGGHTS-PUBLIC, model edinburgh by Mohanty R and Zorec TM (2017), with coefficientRestitution 1, "
    "fixKc off and no pullOffForce",
    evidence=seen(
        "CFDEMproject/LIGGGHTS-PUBLIC, src/normal_model_edinburgh.h @84ba3d76 (3.8.0, 2017)",
        note="without the dashpot that may stand beside it; unless n = 1 the two values of d differ where f "
        "reaches its limit, so that e jumps there, as in LIGGGHTS; a wall is the limit of two spheres, while "
        "LIGGGHTS 3.8.0 does not adhere to a wall",
    ),
    parameters=(
        Parameter("k2", "1", "unloading stiffness k₂ over K, UnloadingStiffness", least=1.0),
        Parameter("gamma", "N/m", "surface energy Γ", least=0.0, typical=100.0),
        Parameter("adhesion_exponent", "1", "exponent χ of the adhesive branch", 1.0, 1.0, 10.0),
    ),
    force=spring,
    unloading=lambda x, peak, K, n, k2, gamma, adhesion_exponent, R1, R2: np.maximum(
        *edinburgh_branches(x, peak, K, n, k2, gamma, adhesion_exponent, R1, R2)
    ),
    # without adhesion the balls separate at δₚ
    residual=lambda peak, n, k2, gamma: np.where(gamma > 0, 0.0, peak * np.power(1 - 1 / k2, 1 / n)),
    unloading_breakpoints=(
        lambda x, peak, K, n, k2, gamma, adhesion_exponent, R1, R2: np.where(
            gamma > 0,
            np.subtract(*edinburgh_branches(x, peak, K, n, k2, gamma, adhesion_exponent, R1, R2)),
            np.nan,
        ),
    ),
    oracle=lambda K, m, v0, n, k2, gamma, adhesion_exponent, R1, R2: edinburgh_restitution(
        m * v0 * v0, K, n, k2, gamma, adhesion_exponent, R1, R2
    ),
    stiffness=lambda n, E_eff, R_eff: np.where(n == 1.0, 2 * np.sqrt(R_eff), 4 / 3) * np.sqrt(R_eff) * E_eff,
    family="adhesive",
)


def edinburgh_branches(
    x: Array, peak: Array, K: Array, n: float, k2: Array, gamma: Array, exponent: Array, R1: Array, R2: Array
) -> tuple[Array, Array]:
    """Compute the elastic and the adhesive branch of the unloading, whose larger value is the force; any shape."""
    adhesion = edinburgh_adhesion(peak, K, n, k2, gamma, exponent, R1, R2)
    return K * k2 * (power(x, n) - (1 - 1 / k2) * power(peak, n)), -adhesion * np.power(x, exponent)
