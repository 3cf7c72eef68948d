"""Elastic-plastic laws: yielding on approach, elastic recovery on restitution; the restitution falls with speed.

The yield strength is that of the softer ball. E* is computed from the stiffness K by equation (12), 3 K/(4 √R*),
so that it agrees with a K set by the user.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ...array_types import Array
from ..closed_forms.plastic import luding_restitution, muthukumar_restitution, thornton_restitution
from ..evidence import not_verified, seen
from ..force_expressions import spring, unload_to_residual
from ..formula_calls import Formula
from ..model import ForceModel, Parameter
from ..powers import power
from .cited_sources import DEMLAB_PLASTIC, IMPACT_MATERIAL, YADE_BIBLIOGRAPHY

# formula of E* for the laws that use it
E_OF_K: Formula = lambda K, R_eff: 0.75 * K / np.sqrt(R_eff)  # noqa: E731
elastic_plastic = partial(ForceModel, family="elastic-plastic")
# whose elastic parts are those of Hertz
hertzian_plastic = partial(elastic_plastic, unloading=unload_to_residual, exponent=1.5)


def yield_indentation(E: Array, R_eff: Array, pressure: Array) -> Array:
    """Indentation at which the largest pressure of a Hertz contact, (2E*/π) √(δ/R*), reaches a pressure."""
    root = np.pi * pressure / (2 * E)
    return root * root * R_eff


WALTON_BRAUN_VARIABLE = elastic_plastic(
    key="walton-braun-variable",
    title="Walton and Braun, variable unloading",
    year=1986,
    equation="F = K δ, then F = K₂(δ − δₚ),  K₂ = K + S Fₘ,  δₚ = δₘ(1 − K/K₂)",
    reference="Walton OR, Braun RL (1986) Viscosity, granular-temperature, and stress calculations for shearing "
    "assemblies of inelastic, frictional disks. J. Rheol. 30, 949",
    doi="10.1122/1.549893",
    evidence=seen(
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
)

LUDING_2008 = elastic_plastic(
    key="luding-2008",
    title="Luding, adhesive",
    year=2008,
    equation="F = K δ to δ*, then k₂(δ − (1 − K/k₂)δ*);  back F = max(k(δ − δ₀), −k_c δ) to δ₀, with k_c > 0 to "
    "δ = 0,  k = K + (k₂ − K) δₘ/δ*, at most k₂,  δ₀ = (1 − K/k) min(δₘ, δ*),  δ* = k₂/(k₂ − K) φ 2R*",
    reference="Luding S (2008) Cohesive, frictional powders: contact models for tension. Granul. Matter 10, 235",
    doi="10.1007/s10035-008-0099-x",
    evidence=seen(
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
)


def unloading_ratio(peak: Array, k2: Array, shallow: Array) -> Array:
    """Compute the unloading stiffness of Luding's law over K, which grows with the peak up to k₂."""
    return 1 + (k2 - 1) * np.minimum(peak * shallow, 1)


THORNTON_1997 = hertzian_plastic(
    key="thornton-1997",
    title="Thornton",
    year=1997,
    equation="F = K δ^(3/2) to δ_y, then F_y + π p_y R*(δ − δ_y);  back F = (4/3)E* √Rₚ (δ − δₚ)^(3/2),  "
    "δ_y = (π p_y/(2E*))² R*,  Rₚ = (4E*/(3Fₘ))((2Fₘ + F_y)/(2π p_y))^(3/2),  p_y = c Y,  F_y = K δ_y^(3/2)",
    reference="Thornton C (1997) Coefficient of restitution for collinear collisions of elastic-perfectly plastic "
    "spheres. J. Appl. Mech. 64, 383; Thornton C, Ning Z (1998) Powder Technol. 99, 154",
    evidence=seen(
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
    residual=lambda peak, force_at_peak, R_eff, E, py, dy, Fy: np.where(
        peak <= dy,
        0.0,
        peak - power(0.75 * force_at_peak / (E * np.sqrt(thornton_radius(force_at_peak, E, py, Fy))), 2 / 3),
    ),
    oracle=lambda K, m, v0, dy: thornton_restitution(np.sqrt(0.8 * K / m * power(dy, 2.5)) / v0),
)


def thornton_radius(force_at_peak: Array, E: Array, py: Array, Fy: Array) -> Array:
    """Compute the radius of curvature Rₚ after the plastic flow."""
    return 4 * E / (3 * force_at_peak) * power((2 * force_at_peak + Fy) / (2 * np.pi * py), 1.5)


JOHNSON_1985 = hertzian_plastic(
    key="johnson-1985",
    title="Johnson, fully plastic",
    year=1985,
    equation="F = 2π R* p_d δ,  p_d = c Y;  back F = Fₘ((δ − δₚ)/(δₘ − δₚ))^(3/2),  δₘ − δₚ = 3Fₘ/(4 a E*), at "
    "most δₘ,  a² = 2R*δₘ;  F = K δ^(3/2) where v₀ ≤ V_y,  (1/2) m V_y² = (2/5) K δ_y^(5/2),  "
    "δ_y = (1.6π Y/(2E*))² R*",
    reference="Johnson KL (1985) Contact mechanics, chapter 11. Cambridge University Press",
    evidence=not_verified(
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
)


# ---- fits of finite elements, and a bilinear law of pounding


def softer_poisson_ratio(nu1: Array, nu2: Array, yield_strength1: Array, yield_strength2: Array) -> Array:
    """Poisson's ratio of the ball that yields; of two equally strong balls that of the one that yields first."""
    of_equal_strength = np.where(yield_strength1 > yield_strength2, nu2, np.minimum(nu1, nu2))
    return np.where(yield_strength1 < yield_strength2, nu1, of_equal_strength)


JACKSON_GREEN_2010 = hertzian_plastic(
    key="jackson-green-2010",
    title="Jackson, Green and Marghitu",
    year=2010,
    equation="F = F_c w^(3/2) to w = 1.9, then F_c[exp(−w^(5/12)/4) w^(3/2) + (4H/(C Y))(1 − exp(−w^(5/9)/25)) "
    "w];  back F = Fₘ((δ − δₚ)/(δₘ − δₚ))^(3/2),  δₚ = 1.02 δₘ(1 − ((wₘ + 5.9)/6.9)^−0.54), at "
    "least δₘ(1 − K δₘ^(3/2)/Fₘ), 0 to wₘ = 1.9;  w = δ/δ_c,  δ_c = (π C Y/(2E*))² R*,  C = 1.295 exp(0.736 ν),  "
    "F_c = K δ_c^(3/2),  H/Y = 2.84 − 0.92(1 − cos(π a/R*)),  a² = R* δ (w/1.9)^B,  B = 0.14 exp(23 Y/E*)",
    reference="Jackson RL, Green I (2005) A finite element study of elasto-plastic hemispherical contact against "
    "a rigid flat. J. Tribol. 127, 343, the loading; Jackson RL, Chusoipin I, Green I (2005), the residual; "
    "Jackson RL, Green I, Marghitu DB (2010) Nonlinear Dyn. 60, 217",
    evidence=seen(
        "tmd-lab/microslip-rough-contact, SPHERE_PLASTIC_PRE2.m and test_plastic_contact_unload.m @21706045 "
        "(2022)",
        note="the year of Jackson, Chusoipin and Green was not seen; no loss below w = 1.9, where the fit of e in "
        "the paper has one from w = 1 on: this is up to 0.04 above that fit there, and within 0.009 of it beyond; "
        "the least δₚ, of the work of an elastic contact, is derived here: with the published one alone more "
        "energy may come back just above w = 1.9 than went in; the fits are continued: from w = 10,018 on the "
        "residual is the whole indentation, and e_out is 0",
    ),
    coefficients={
        "E": E_OF_K,
        "nu": softer_poisson_ratio,
        "C": lambda nu: 1.295 * np.exp(0.736 * nu),
        "dc": lambda E, R_eff, Y_min, C: np.pi * C * Y_min / (2 * E) * (np.pi * C * Y_min / (2 * E)) * R_eff,
        "Fc": lambda K, dc: K * power(dc, 1.5),
        "B": lambda E, Y_min: 0.14 * np.exp(np.minimum(23 * Y_min / E, 700)),
    },
    breakpoints=(lambda dc: 1.9 * dc,),
    force=lambda elastic, x, R_eff, C, dc, Fc, B: np.where(
        x < 1.9 * dc, elastic, Fc * jackson_green(np.maximum(x / dc, 1.9), x / R_eff, C, B)
    ),
    # the force jumps up at w = 1.9: the second bound is that of the work of an elastic contact
    residual=lambda peak, force_at_peak, K, dc: np.where(
        peak > 1.9 * dc,
        peak
        * np.maximum(
            1.02 * (1 - np.power((np.maximum(peak / dc, 1.9) + 5.9) / 6.9, -0.54)),
            1 - K * power(peak, 1.5) / force_at_peak,
        ),
        0,
    ),
)


def jackson_green(w: Array, slope: Array, C: Array, B: Array) -> Array:
    """F/F_c beyond w = 1.9, with slope = δ/R; H falls with the contact radius a, a² = R δ (w/1.9)^B."""
    ratio = np.sqrt(slope * np.exp(B * np.log(w / 1.9)))
    hardness = 2.84 - 0.92 * (1 - np.cos(np.pi * ratio))
    plastic = 4 * hardness / C * (1 - np.exp(-np.power(w, 5 / 9) / 25)) * w
    return np.asarray(np.exp(-np.power(w, 5 / 12) / 4) * power(w, 1.5) + plastic)


# w = δ/δ_c at which the second branch of Kogut and Etsion meets the elastic one
KOGUT_ETSION_MEET = 1.03 ** (1 / 0.075)
# w of the peak above which the unloading returns less than the loading, where 2.5(1 − δₚ/δₘ) = 1 + 1.5 w^−0.0331
KOGUT_ETSION_LOSES = 1.1141655329037452

KOGUT_ETSION_2005 = hertzian_plastic(
    key="kogut-etsion-2005",
    title="Kogut and Etsion, with Etsion, Kligerman and Kadin",
    year=2005,
    equation="F = F_c w^(3/2) to w = 1.48, F_c 1.03 w^1.425 to w = 6, then F_c 1.40 w^1.263;  "
    "back F = Fₘ((δ − δₚ)/(δₘ − δₚ))^(1.5 wₘ^−0.0331),  δₚ = δₘ(1 − wₘ^−0.28)(1 − wₘ^−0.69),  "
    "elastic to wₘ = 1.114;  w = δ/δ_c,  δ_c = (π (0.454 + 0.41 ν) 2.8 Y/(2E*))² R*,  F_c = K δ_c^(3/2)",
    reference="Kogut L, Etsion I (2002) Elastic-plastic contact analysis of a sphere and a rigid flat. J. Appl. "
    "Mech. 69, 657; Etsion I, Kligerman Y, Kadin Y (2005) Unloading of an elastic-plastic loaded spherical "
    "contact. Int. J. Solids Struct. 42, 3716",
    evidence=not_verified(
        "the loading was seen in TaoYang1999/SCHC-framework, asperity_f_cal.m @98b786e, which goes on with "
        "2π R w H beyond w = 110",
        note="the unloading was not seen, public code has another one under the names of Etsion, Kligerman and "
        "Kadin; printed is a second branch from w = 1, where it lies 3 % above the first, and more energy would "
        "come back than went in: here it begins where the two meet, and the unloading at w = 1.114, below which "
        "it would return up to 5e-4 more too; the fits are continued beyond w = 110",
    ),
    coefficients={
        "E": E_OF_K,
        "nu": softer_poisson_ratio,
        # the hardness is 2.8 Y
        "dc": lambda E, R_eff, Y_min, nu: np.square(np.pi * (0.454 + 0.41 * nu) * 2.8 * Y_min / (2 * E)) * R_eff,
        "Fc": lambda K, dc: K * power(dc, 1.5),
    },
    breakpoints=(lambda dc: KOGUT_ETSION_MEET * dc, lambda dc: 6 * dc),
    force=lambda elastic, x, dc, Fc: np.where(
        x < KOGUT_ETSION_MEET * dc,
        elastic,
        Fc * kogut_etsion(np.maximum(x / dc, KOGUT_ETSION_MEET)),
    ),
    unloading=lambda x, peak, residual, force_at_peak, dc: (
        force_at_peak
        * np.power(
            np.maximum(x - residual, 0) / (peak - residual), 1.5 * np.power(kogut_etsion_peak(peak, dc), -0.0331)
        )
    ),
    residual=lambda peak, dc: peak * kogut_etsion_residual(kogut_etsion_peak(peak, dc)),
)


def kogut_etsion(w: Array) -> Array:
    """F/F_c beyond the elastic branch."""
    return np.where(w < 6, 1.03 * np.power(w, 1.425), 1.40 * np.power(w, 1.263))


def kogut_etsion_peak(peak: Array, dc: Array) -> Array:
    """w = δₘ/δ_c of the unloading, 1 where it is elastic."""
    return np.where(peak > KOGUT_ETSION_LOSES * dc, peak / dc, 1)


def kogut_etsion_residual(w: Array) -> Array:
    """δₚ/δₘ [-] at the peak w = δₘ/δ_c."""
    return np.asarray((1 - np.power(w, -0.28)) * (1 - np.power(w, -0.69)))


MUTHUKUMAR_2003 = elastic_plastic(
    key="muthukumar-2003",
    title="Muthukumar, bilinear",
    year=2003,
    equation="F = K₁ δ to d/10, then K₂;  back K₁ to the line K₂ δ, then along it;  K₁ = K d^(n−1) + 10 D,  "
    "K₂ = K d^(n−1) − (10/9) D,  D = K d^(n−1)(1 − e²)/(n + 1)",
    reference="Muthukumar S (2003) A contact element approach with hysteresis damping for the analysis and design "
    "of pounding in bridges. PhD thesis, Georgia Institute of Technology",
    evidence=seen(
        f"{IMPACT_MATERIAL}, and OpenSees/OpenSees, SRC/material/uniaxial/ImpactMaterial.cpp @2890cb36f (2026)",
    ),
    parameters=(Parameter("d", "m", "indentation that the law is designed for", least=1e-9),),
    coefficients={
        "loss": lambda e, n: (1 - e * e) / (n + 1),
        "base": lambda K, n, d: K * power(d, n - 1),
        "K1": lambda base, loss: base * (1 + 10 * loss),
        "K2": lambda base, loss: base * (1 - 10 * loss / 9),
    },
    breakpoints=(lambda d: 0.1 * d,),
    force=lambda x, K1, K2, d: K2 * x + (K1 - K2) * np.minimum(x, 0.1 * d),
    unloading=lambda x, peak, force_at_peak, K1, K2: np.maximum(force_at_peak - K1 * (peak - x), K2 * x),
    unloading_breakpoints=(lambda peak, force_at_peak, K1, K2: (K1 * peak - force_at_peak) / (K1 - K2),),
    oracle=lambda m, v0, K1, K2, d: muthukumar_restitution(v0 * np.sqrt(m), K1, K2, 0.1 * d),
)
