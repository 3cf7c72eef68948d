"""Another force on restitution than on approach: asymmetric laws; permanent indentation, equations (29)-(43)."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np

from ..closed_forms.dashpot import approach_damping, approach_restitution
from ..closed_forms.hysteresis import approach_damped_restitution
from ..evidence import derived, not_verified, seen
from ..force_expressions import damped, spring, unload_to_residual, unload_with_stiffness
from ..formula_calls import Formula
from ..model import About, ForceModel, Parameter
from ..powers import power
from .cited_sources import DEMLAB_PLASTIC, DYS, GHARIB_HURMUZLU, OPENSEES_JANKOWSKI, RAILWAY
from .dashpot import dashpot


def approach_dashpot(key: str, *, zeta: Formula, **about: Unpack[About]) -> ForceModel:
    """Make a law of a spring and a dashpot that acts on approach only, from the formula of its damping ratio."""
    about.setdefault("family", "asymmetric")
    law = dashpot(key, zeta=zeta, **about)
    return replace(law, unloading=spring, oracle=approach_restitution)


JANKOWSKI_2006 = approach_dashpot(
    "jankowski-2006",
    title="Jankowski",
    year=2006,
    equation="F = K δ^(3/2) + 2 ξ √(m K) δ^(1/4) δ̇, then F = K δ^(3/2),  ξ = (9√5/2)(1 − e²)/(e(e(9π − 16) + 16))",
    reference="Jankowski R (2006) Analytical expression between the impact damping ratio and the coefficient of "
    "restitution in the non-linear viscoelastic model of structural pounding. EESD 35, 517; Jankowski R (2005) "
    "Non-linear viscoelastic modelling of earthquake-induced structural pounding. EESD 34, 595",
    doi="10.1002/eqe.537",
    evidence=seen(OPENSEES_JANKOWSKI, doi=OPENSEES_JANKOWSKI),
    zeta=lambda e: 9 * np.divide(1 - e * e, e * (e * (9 * np.pi - 16) + 16)),
    exponent=1.5,
)

MAHMOUD_JANKOWSKI_2011 = approach_dashpot(
    "mahmoud-jankowski-2011",
    title="Mahmoud and Jankowski",
    year=2011,
    equation="F = K δ + 2 ξ √(m K) δ̇, then F = K δ,  ξ = (1 − e²)/(e(e(π − 2) + 2))",
    reference="Mahmoud S, Jankowski R (2011) Modified linear viscoelastic model of earthquake-induced structural "
    "pounding. Iran. J. Sci. Technol. C 35, 51",
    evidence=not_verified(note="the formula is within 0.0072 of the exact one"),
    zeta=lambda e: np.divide(1 - e * e, e * (e * (np.pi - 2) + 2)),
    exponent=1.0,
)

EXACT_APPROACH_DASHPOT = approach_dashpot(
    "exact-approach-dashpot",
    title="Exact dashpot on approach",
    year=2026,
    equation="F = K δⁿ + α √(m K) δ^((n−1)/2) δ̇, then F = K δⁿ,  α = ζ √(2(n + 1)),  e = exp(−ζ acos(ζ)/√(1 − "
    "ζ²))",
    reference="the limit that Jankowski (2006) and Mahmoud and Jankowski (2011) approximate",
    evidence=derived("src/impact/contact/closed_forms/dashpot.py"),
    zeta=approach_damping,
)

PANT_WIJEYEWICKREMA_2012 = ForceModel(
    key="pant-wijeyewickrema-2012",
    title="Pant and Wijeyewickrema",
    year=2012,
    equation="F = K δ (1 + χ δ̇/v₀), then F = K δ,  χ = 3(1 − e²)/(2e²)",
    reference="Pant DR, Wijeyewickrema AC (2012) Structural performance of a base-isolated reinforced concrete "
    "building subjected to seismic pounding. EESD 41, 1709",
    evidence=not_verified(
        RAILWAY,
        note="that code has the χ, but over the whole contact; here it damps the approach only",
    ),
    coefficients={"chi": lambda e: np.divide(1.5 * (1 - e * e), e * e)},
    force=damped,
    unloading=spring,
    oracle=approach_damped_restitution,
    velocity_coordinate="log",
    exponent=1.0,
    family="asymmetric",
)

KELVIN_VOIGT_HYSTERETIC = ForceModel(
    key="kelvin-voigt-hysteretic",
    title="Kelvin and Voigt, hysteretic",
    year=2012,
    equation="F = K δ, then F = e K δ",
    reference="Machado M, Moreira P, Flores P, Lankarani HM (2012) Compliant contact force models in multibody "
    "dynamics: evolution of the Hertz contact theory. Mech. Mach. Theory 53, 99",
    doi="10.1016/j.mechmachtheory.2012.02.010",
    evidence=seen(DYS, doi="two public bibliographies (2026)", note="the paper may have e²"),
    force=spring,
    coefficients={"Kr": lambda K, e: e * K},
    unloading=unload_with_stiffness,
    oracle=lambda e: np.sqrt(e),
    exponent=1.0,
    family="asymmetric",
)

# ---- a permanent indentation

LANKARANI_NIKRAVESH_1994 = ForceModel(
    key="lankarani-nikravesh-1994",
    title="Lankarani and Nikravesh, permanent indentation",
    year=1994,
    equation="F = K δⁿ, then F = fₘ((δ − δₚ)/(δₘ − δₚ))ⁿ,  δₚ = (n + 1) m v₀² (1 − e²)/(2 fₘ)  (29)-(32)",
    reference="Lankarani HM, Nikravesh PE (1994) Continuous contact force models for impact analysis in "
    "multibody systems. Nonlinear Dyn. 5, 193",
    doi="10.1007/BF00045676",
    evidence=seen(
        f"{GHARIB_HURMUZLU}, equations (29) to (32)",
        doi="modelica/ModelicaStandardLibrary, ElastoGap.mo @b756f9deed (2026)",
    ),
    force=spring,
    unloading=unload_to_residual,
    # equation (32) is δₘ (1 − e²) by (31) and fₘ = K δₘⁿ, for the integrated peak
    recovered=lambda e, peak: peak * (e * e),
    oracle=lambda e: e,
    family="permanent",
)

GHARIB_HURMUZLU_2012_ENERGETIC = replace(
    LANKARANI_NIKRAVESH_1994,
    key="gharib-hurmuzlu-2012-energetic",
    title="Gharib and Hurmuzlu, energetic",
    year=2012,
    equation="F = K δⁿ, then F = Kᵣ(δ − δₚ)ⁿ,  Kᵣ = K/e²ⁿ,  δₚ = δₘ(1 − e²)  (33)-(42)",
    reference="Gharib M, Hurmuzlu Y (2012) A new contact force model for low coefficient of restitution impact. "
    "J. Appl. Mech. 79, 064506",
    doi="10.1115/1.4006494",
    evidence=seen(
        f"{GHARIB_HURMUZLU}, equations (33) to (42)",
        doi=GHARIB_HURMUZLU,
        note="(39) as printed has K in the place of Kᵣ",
    ),
    coefficients={"Kr": lambda K, n, e: K / power(e * e, n)},
    unloading=unload_with_stiffness,
)

BILINEAR = ForceModel(
    key="bilinear",
    title="Bilinear",
    year=1986,
    equation="F = K δ, then F = Kᵣ(δ − δₚ),  Kᵣ = K/e²  (43)",
    reference="Walton OR, Braun RL (1986) Viscosity, granular-temperature, and stress calculations for shearing "
    "assemblies of inelastic, frictional disks. J. Rheol. 30, 949",
    doi="10.1122/1.549893",
    evidence=seen(
        f"{GHARIB_HURMUZLU}, equation (43); rlrangel/DEMLab, ContactForceN_ElastoPlasticLinear.m @23e741d (2024)",
        doi=DEMLAB_PLASTIC,
    ),
    exponent=1.0,
    force=spring,
    coefficients={"Kr": lambda K, e: K / (e * e)},
    unloading=unload_with_stiffness,
    recovered=lambda K, Kr, peak: peak * (K / Kr),
    oracle=lambda e: e,
    family="permanent",
)

ISMAIL_STRONGE_2008 = replace(
    BILINEAR,
    key="ismail-stronge-2008",
    title="Ismail and Stronge",
    year=2008,
    equation="F = K δ, then F = Kᵣ(δ − δₚ),  Kᵣ = γ² K,  e = 1/γ  (43)",
    reference="Ismail KA, Stronge WJ (2008) Impact of viscoplastic bodies: dissipation and restitution. "
    "J. Appl. Mech. 75, 061011",
    doi="",
    evidence=seen(f"{GHARIB_HURMUZLU}, equation (43)", note="the paper itself was not seen"),
    parameters=(Parameter("gamma", "1", "plastic loss factor γ", 2.0, 1.0),),
    coefficients={"Kr": lambda K, gamma: gamma * gamma * K},
    oracle=lambda gamma: np.divide(1.0, gamma),
)
