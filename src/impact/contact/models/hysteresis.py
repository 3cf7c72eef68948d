"""The hysteresis family, F = K δⁿ (1 + χ δ̇/v₀): equation (18) and the coefficients of (19) to (28)."""

from __future__ import annotations

from typing import Unpack

import numpy as np

from ..forms import damped
from ..formula import Formula
from ..model import About, ForceModel
from ..oracles import delivered_restitution, exact_damping_ratio
from ..power import power

MEMORY = "formula as printed in Gharib and Hurmuzlu (2012); DOI from memory"
RECALLED = "formula and DOI from memory"


def hysteresis(key: str, *, chi: Formula, **about: Unpack[About]) -> ForceModel:
    """A member of the hysteresis family, from the formula of its damping ratio χ = λ v₀/K.

    Parameters
    ----------
    key, about : see `ForceModel`
    chi : χ [-] as a function of what it asks for by name, such as `lambda e: 1 / e`

    >>> law = hysteresis("mine", title="Mine", year=2026, equation="χ = 1 − e", reference="", chi=lambda e: 1 - e)
    >>> law.force(elastic=1.0, v=0.5, v0=1.0, chi=1.0)
    1.5
    """
    return ForceModel(
        key,
        **about,
        force=damped,
        coefficients={"chi": chi},
        oracle=lambda chi: delivered_restitution(chi),
        momentum="log",
        family="hysteresis",
    )


HUNT_CROSSLEY_1975 = hysteresis(
    "hunt-crossley-1975",
    title="Hunt and Crossley",
    year=1975,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 3(1 − e)/2  (19)",
    reference="Hunt KH, Crossley FRE (1975) Coefficient of restitution interpreted as damping in vibroimpact. "
    "J. Appl. Mech. 42, 440",
    doi="10.1115/1.3423596",
    evidence=MEMORY,
    chi=lambda e: 1.5 * (1 - e),
)

HERBERT_MCWHANNELL_1977 = hysteresis(
    "herbert-mcwhannell-1977",
    title="Herbert and McWhannell",
    year=1977,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 6(1 − e)/((2e − 1)² + 3)  (20)",
    reference="Herbert RG, McWhannell DC (1977) Shape and frequency composition of pulses from an impact pair. "
    "J. Eng. Ind. 99, 513",
    doi="10.1115/1.3439270",
    evidence=MEMORY,
    chi=lambda e: 6 * (1 - e) / ((2 * e - 1) * (2 * e - 1) + 3),
)

LEE_WANG_1983 = hysteresis(
    "lee-wang-1983",
    title="Lee and Wang",
    year=1983,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 3(1 − e)/4  (21)",
    reference="Lee TW, Wang AC (1983) On the dynamics of intermittent-motion mechanisms, part 1. "
    "J. Mech. Transm. Autom. Des. 105, 534",
    doi="10.1115/1.3267392",
    evidence=MEMORY,
    chi=lambda e: 0.75 * (1 - e),
)

LANKARANI_NIKRAVESH_1990 = hysteresis(
    "lankarani-nikravesh-1990",
    title="Lankarani and Nikravesh",
    year=1990,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 3(1 − e²)/4  (22)",
    reference="Lankarani HM, Nikravesh PE (1990) A contact force model with hysteresis damping for impact "
    "analysis of multibody systems. J. Mech. Des. 112, 369",
    doi="10.1115/1.2912617",
    evidence=MEMORY,
    domain={"e": (0.9, 1.0)},
    chi=lambda e: 0.75 * (1 - e * e),
)

EXACT_HYSTERESIS = hysteresis(
    "exact-hysteresis",
    title="Exact hysteresis",
    year=2004,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ(1 + e) = ln[(1 + χ)/(1 − e χ)]  (23)",
    reference="Zhang Y, Sharf I (2004) Compliant force modelling for impact analysis. ASME DETC2004-57220; "
    "Gonthier Y, McPhee J, Lange C, Piedboeuf JC (2004) Multibody Syst. Dyn. 11, 209",
    doi="10.1023/B:MUBO.0000029392.21648.bc",
    evidence="formula derived here; equation (23) as printed in Gharib and Hurmuzlu (2012) lacks a factor v₀; "
    "references and DOI from memory",
    domain={"e": (0.0, 1.0)},
    chi=lambda e: exact_damping_ratio(e),
)

GONTHIER_2004 = hysteresis(
    "gonthier-2004",
    title="Gonthier, McPhee, Lange and Piedboeuf",
    year=2004,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = (1 − e²)/e",
    reference="Gonthier Y, McPhee J, Lange C, Piedboeuf JC (2004) A regularized contact model with asymmetric "
    "damping and dwell-time dependent friction. Multibody Syst. Dyn. 11, 209",
    doi="10.1023/B:MUBO.0000029392.21648.bc",
    evidence=RECALLED,
    domain={"e": (0.0, 1.0)},
    chi=lambda e: np.divide(1 - e * e, e),
)

ZHIYING_QISHAO_2006 = hysteresis(
    "zhiying-qishao-2006",
    title="Qin and Lu",
    year=2006,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = (3/4)(1 − e²) exp(2(1 − e))",
    reference="Qin Z, Lu Q (2006) Analysis of impact process model based on restitution coefficient. J. Dyn. "
    "Control 4, 294",
    evidence="formula from memory; no DOI known",
    chi=lambda e: 0.75 * (1 - e * e) * np.exp(2 * (1 - e)),
)

YE_2009_KELVIN = hysteresis(
    "ye-2009-kelvin",
    title="Ye, Li and Zhu, modified Kelvin",
    year=2009,
    equation="F = K δ (1 + χ δ̇/v₀),  χ = 3(1 − e)/(2e)",
    reference="Ye K, Li L, Zhu H (2009) A modified Kelvin impact model for pounding simulation of base-isolated "
    "building with adjacent structures. Earthq. Eng. Eng. Vib. 8, 433",
    doi="10.1007/s11803-009-8045-4",
    evidence=RECALLED,
    domain={"e": (0.0, 1.0)},
    exponent=1.0,
    chi=lambda e: np.divide(1.5 * (1 - e), e),
)

FLORES_2011 = hysteresis(
    "flores-2011",
    title="Flores, Machado, Silva and Martins",
    year=2011,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 8(1 − e)/(5e)",
    reference="Flores P, Machado M, Silva MT, Martins JM (2011) On the continuous contact force models for soft "
    "materials in multibody dynamics. Multibody Syst. Dyn. 25, 357",
    doi="10.1007/s11044-010-9237-4",
    evidence=RECALLED,
    domain={"e": (0.0, 1.0)},
    chi=lambda e: np.divide(8 * (1 - e), 5 * e),
)

GHARIB_HURMUZLU_2012 = hysteresis(
    "gharib-hurmuzlu-2012",
    title="Gharib and Hurmuzlu",
    year=2012,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 1/e  (28)",
    reference="Gharib M, Hurmuzlu Y (2012) A new contact force model for low coefficient of restitution impact. "
    "J. Appl. Mech. 79, 064506",
    doi="10.1115/1.4006494",
    evidence="formula and DOI seen in the paper",
    domain={"e": (0.0, 0.3)},
    chi=lambda e: np.divide(1.0, e),
)

HU_GUO_2015 = hysteresis(
    "hu-guo-2015",
    title="Hu and Guo",
    year=2015,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 3(1 − e)/(2e)",
    reference="Hu S, Guo X (2015) A dissipative contact force model for impact analysis in multibody dynamics. "
    "Multibody Syst. Dyn. 35, 131",
    doi="10.1007/s11044-015-9453-z",
    evidence="DOI seen; formula from memory: one public code has 3(1 − e)/(4e), whose slope at e = 1 is wrong",
    domain={"e": (0.0, 1.0)},
    chi=lambda e: np.divide(1.5 * (1 - e), e),
)

CARVALHO_MARTINS_2019 = hysteresis(
    "carvalho-martins-2019",
    title="Carvalho and Martins",
    year=2019,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = (3/2)(1 − e)(11 − e)/(1 + 9e)",
    reference="Carvalho AS, Martins JM (2019) Exact restitution and generalizations for the Hunt-Crossley contact "
    "model. Mech. Mach. Theory 139, 174",
    doi="10.1016/j.mechmachtheory.2019.03.028",
    evidence=RECALLED,
    domain={"e": (0.0, 1.0)},
    chi=lambda e: 1.5 * (1 - e) * (11 - e) / (1 + 9 * e),
)

SAFAEIFAR_FARSHIDIANFAR_2020 = hysteresis(
    "safaeifar-farshidianfar-2020",
    title="Safaeifar and Farshidianfar",
    year=2020,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 5(1 − e)/(4e)",
    reference="Safaeifar H, Farshidianfar A (2020) A new model of the contact force for the collision between two "
    "solid bodies. Multibody Syst. Dyn. 50, 233",
    doi="10.1007/s11044-020-09732-2",
    evidence="DOI seen; formula from memory, with some doubt",
    domain={"e": (0.0, 1.0)},
    chi=lambda e: np.divide(5 * (1 - e), 4 * e),
)

ZHANG_2020 = hysteresis(
    "zhang-2020",
    title="Zhang, Li, Zhao and He",
    year=2020,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 3(1 − e)/(2 e^0.89)",
    reference="Zhang J, Li W, Zhao L, He G (2020) A continuous contact force model for impact analysis in "
    "multibody dynamics. Mech. Mach. Theory 153, 103946",
    doi="10.1016/j.mechmachtheory.2020.103946",
    evidence=RECALLED,
    domain={"e": (0.0, 1.0)},
    chi=lambda e: np.divide(1.5 * (1 - e), power(e, 0.89)),
)
