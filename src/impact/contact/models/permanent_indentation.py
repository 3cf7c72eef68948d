"""Permanent indentation: a force on approach, a stiffer one on restitution; equations (29) to (43)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..evidence import seen
from ..force_expressions import spring, unload_to_residual, unload_with_stiffness
from ..model import ForceModel, Parameter
from ..powers import power
from .cited_sources import DEMLAB_PLASTIC, GHARIB_HURMUZLU

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
