"""Elastic-plastic laws: yielding on approach, elastic recovery on restitution; the restitution falls with speed.

The yield strength is that of the softer ball. E* is computed from the stiffness K by equation (12), 3 K/(4 √R*),
so that it agrees with a K set by the user.
"""

from __future__ import annotations

import numpy as np

from ...array_types import Array
from ..closed_forms.plastic import luding_restitution, thornton_restitution
from ..evidence import Evidence
from ..force_expressions import spring, unload_to_residual
from ..formula_calls import Formula
from ..model import ForceModel, Parameter
from ..powers import power
from .cited_sources import DEMLAB_PLASTIC, YADE_BIBLIOGRAPHY

# formula of E* for the laws that use it
E_OF_K: Formula = lambda K, R_eff: 0.75 * K / np.sqrt(R_eff)  # noqa: E731


def yield_indentation(E: Array, R_eff: Array, pressure: Array) -> Array:
    """Indentation at which the largest pressure of a Hertz contact, (2E*/π) √(δ/R*), reaches a pressure."""
    root = np.pi * pressure / (2 * E)
    return root * root * R_eff


WALTON_BRAUN_VARIABLE = ForceModel(
    key="walton-braun-variable",
    title="Walton and Braun, variable unloading",
    year=1986,
    equation="F = K δ, then F = K₂(δ − δₚ),  K₂ = K + S Fₘ,  δₚ = δₘ(1 − K/K₂)",
    reference="Walton OR, Braun RL (1986) Viscosity, granular-temperature, and stress calculations for shearing "
    "assemblies of inelastic, frictional disks. J. Rheol. 30, 949",
    doi="10.1122/1.549893",
    evidence=Evidence(
        "seen",
        DEMLAB_PLASTIC,
        doi=DEMLAB_PLASTIC,
        note="that code keeps the residual of e, so that its force may jump at the peak",
    ),
    parameters=(Parameter("S", "1/m", "growth of the unloading stiffness with the force", least=0.0),),
    force=spring,
    unloading=unload_to_residual,
    residual=lambda peak, force_at_peak, K, S: peak * (S * force_at_peak / (K + S * force_at_peak)),
    # with ω₀ = √(K/m): e² = K/K₂, and Fₘ = K v₀/ω₀
    oracle=lambda K, m, v0, S: np.sqrt(1 / (1 + S * v0 / np.sqrt(K / m))),
    exponent=1.0,
    family="elastic-plastic",
)

LUDING_2008 = ForceModel(
    key="luding-2008",
    title="Luding, adhesive",
    year=2008,
    equation="F = K δ to δ*, then k₂(δ − δ₀*);  back F = max(k(δ − δ₀), −k_c δ),  k = K + (k₂ − K) δₘ/δ*,  "
    "δ₀ = (1 − K/k)δₘ,  δ* = k₂/(k₂ − K) φ 2R*",
    reference="Luding S (2008) Cohesive, frictional powders: contact models for tension. Granul. Matter 10, 235",
    doi="10.1007/s10035-008-0099-x",
    evidence=Evidence(
        "seen",
        "CFDEMproject/LIGGGHTS-PUBLIC @3d5c00f2 (3.8.0, 2024), src/normal_model_hooke_hysteresis.h",
        doi=YADE_BIBLIOGRAPHY,
        note="without the dashpot that may stand beside it",
    ),
    parameters=(
        Parameter("k2", "1", "largest unloading stiffness k₂ over K", least=1.0),
        Parameter("kc", "1", "adhesive stiffness k_c over K", default=0.0, least=0.0),
        Parameter("phi", "1", "plasticity depth φ", default=0.05, least=1e-6, most=10.0),
    ),
    # 1/δ*, zero where nothing yields
    coefficients={"shallow": lambda k2, R_eff, phi: (k2 - 1) / (k2 * phi * 2 * R_eff)},
    breakpoints=(lambda shallow: np.divide(1, shallow),),
    force=lambda x, K, k2, shallow: K * (x + (k2 - 1) * np.maximum(x - np.divide(1, shallow), 0)),
    unloading=lambda x, peak, force_at_peak, K, k2, kc, shallow: np.maximum(
        force_at_peak - K * unloading_ratio(peak, k2, shallow) * (peak - x), -kc * K * x
    ),
    # without adhesion the balls separate at δ₀
    residual=lambda peak, force_at_peak, K, k2, kc, shallow: np.where(
        kc > 0, 0, peak - force_at_peak / (K * unloading_ratio(peak, k2, shallow))
    ),
    unloading_breakpoints=(
        lambda peak, force_at_peak, K, k2, kc, shallow: (
            (unloading_ratio(peak, k2, shallow) * peak - force_at_peak / K)
            / (unloading_ratio(peak, k2, shallow) + kc)
        ),
    ),
    oracle=lambda K, m, v0, k2, kc, shallow: luding_restitution(v0 * np.sqrt(m / K), k2, kc, shallow),
    exponent=1.0,
    family="elastic-plastic",
)


def unloading_ratio(peak: Array, k2: Array, shallow: Array) -> Array:
    """Compute the unloading stiffness of Luding's law over K, which grows with the peak up to k₂."""
    return 1 + (k2 - 1) * np.minimum(peak * shallow, 1)


THORNTON_1997 = ForceModel(
    key="thornton-1997",
    title="Thornton",
    year=1997,
    equation="F = K δ^(3/2) to δ_y, then F_y + π p_y R*(δ − δ_y);  back F = (4/3)E* √Rₚ (δ − δₚ)^(3/2),  "
    "δ_y = (π p_y/(2E*))² R*,  Rₚ = (4E*/(3Fₘ))((2Fₘ + F_y)/(2π p_y))^(3/2)",
    reference="Thornton C (1997) Coefficient of restitution for collinear collisions of elastic-perfectly plastic "
    "spheres. J. Appl. Mech. 64, 383; Thornton C, Ning Z (1998) Powder Technol. 99, 154",
    evidence=Evidence(
        "seen",
        "a public digest (2026) of Thornton and Ning (1998), equations (2) to (46)",
        note="p_y over the yield strength is a usual value",
    ),
    parameters=(Parameter("c", "1", "contact yield pressure over the yield strength", 1.6, 0.1, 10.0),),
    coefficients={
        "E": E_OF_K,
        "py": lambda Y_min, c: c * Y_min,
        "dy": lambda E, R_eff, py: yield_indentation(E, R_eff, py),
        "Fy": lambda K, dy: K * power(dy, 1.5),
    },
    breakpoints=(lambda dy: dy,),
    force=lambda elastic, x, R_eff, py, dy, Fy: np.where(x < dy, elastic, Fy + np.pi * py * R_eff * (x - dy)),
    unloading=unload_to_residual,
    residual=lambda peak, force_at_peak, R_eff, E, py, dy, Fy: np.where(
        peak <= dy,
        0.0,
        peak - power(0.75 * force_at_peak / (E * np.sqrt(thornton_radius(force_at_peak, E, py, Fy))), 2 / 3),
    ),
    oracle=lambda K, m, v0, dy: thornton_restitution(np.sqrt(0.8 * K / m * power(dy, 2.5)) / v0),
    exponent=1.5,
    family="elastic-plastic",
)


def thornton_radius(force_at_peak: Array, E: Array, py: Array, Fy: Array) -> Array:
    """Compute the radius of curvature Rₚ after the plastic flow."""
    return 4 * E / (3 * force_at_peak) * power((2 * force_at_peak + Fy) / (2 * np.pi * py), 1.5)


JOHNSON_1985 = ForceModel(
    key="johnson-1985",
    title="Johnson, fully plastic",
    year=1985,
    equation="F = 2π R* p_d δ;  back F = Fₘ((δ − δₚ)/(δₘ − δₚ))^(3/2),  δₘ − δₚ = 3Fₘ/(4 a E*),  a² = 2R*δₘ;  "
    "F = K δ^(3/2) where v₀ ≤ V_y,  (1/2) m V_y² = (2/5) K δ_y^(5/2),  δ_y = (1.6π Y/(2E*))² R*",
    reference="Johnson KL (1985) Contact mechanics, chapter 11. Cambridge University Press",
    evidence=Evidence(
        "not verified",
        note="a public digest of Thornton and Ning (1998) gives the prefactor 1.72 of its e(V), ours is 1.7176; "
        "V_y is that of a largest pressure 1.6 Y; p_d over the yield strength is a usual value",
    ),
    parameters=(Parameter("c", "1", "dynamic yield pressure over the yield strength", 3.0, 0.1, 30.0),),
    coefficients={
        "E": E_OF_K,
        "pd": lambda Y_min, c: c * Y_min,
        "yields": lambda K, m, v0, E, R_eff, Y_min: np.where(
            m * v0 * v0 > 0.8 * K * power(yield_indentation(E, R_eff, 1.6 * Y_min), 2.5), 1.0, 0.0
        ),
    },
    force=lambda elastic, x, R_eff, pd, yields: np.where(yields > 0, 2 * np.pi * R_eff * pd * x, elastic),
    unloading=unload_to_residual,
    # a slow impact is not fully plastic: it would recover more than the peak indentation
    residual=lambda peak, force_at_peak, R_eff, E, yields: (
        yields * (peak - np.minimum(0.75 * force_at_peak / (np.sqrt(2 * R_eff * peak) * E), peak))
    ),
    # e² = (4/5)(δₘ − δₚ)/δₘ, with m v₀² = 2π R* p_d δₘ²
    oracle=lambda m, v0, R_eff, E, pd, yields: np.where(
        yields > 0,
        np.sqrt(
            0.8
            * np.minimum(
                1.5 * np.pi * pd / E * np.sqrt(R_eff / (2 * v0 * np.sqrt(m / (2 * np.pi * R_eff * pd)))), 1
            )
        ),
        1.0,
    ),
    exponent=1.5,
    family="elastic-plastic",
)
