"""The hysteresis family, F = K δⁿ (1 + χ δ̇/v₀): equations (10), without damping, (18), and (19) to (28) for χ."""

from __future__ import annotations

from typing import Unpack

import numpy as np

from ...array_types import Array
from ..closed_forms.hysteresis import delivered_restitution, exact_damping_ratio
from ..evidence import derived, disputed, not_verified, seen
from ..force_expressions import damped, spring
from ..formula_calls import Formula
from ..model import About, ForceModel
from ..powers import power
from .cited_sources import (
    DEMLAB_VISCOELASTIC,
    DYS,
    GHARIB_HURMUZLU,
    MBDYN,
    MODIA3D_DOCUMENTATION,
    OPENSEES_HERTZDAMP,
    RAILWAY,
)


def hysteresis(key: str, *, chi: Formula, **about: Unpack[About]) -> ForceModel:
    """Make a law of the hysteresis family, from the formula of its damping ratio χ = λ v₀/K.

    Parameters
    ----------
    key, about : see `ForceModel`
    chi : formula of χ [-], such as `lambda e: 1 / e`

    Returns
    -------
    ForceModel : a law of the force F = K δⁿ (1 + χ v/v0) [N], for arrays of any shape

    Raises
    ------
    ModelError : the law is not valid, see `ForceModel`

    >>> law = hysteresis("mine", title="Mine", year=2026, equation="χ = 1 − e", reference="", chi=lambda e: 1 - e)
    >>> law.force(elastic=1.0, v=0.5, v0=1.0, chi=1.0)
    1.5
    """
    about.setdefault("family", "hysteresis")
    return ForceModel(
        key,
        **about,
        force=damped,
        coefficients={"chi": chi},
        oracle=delivered_restitution,
        velocity_coordinate="log",
    )


def flores_chi(e: Array) -> Array:
    """χ [-] of Flores and others (2011), 8(1 − e)/(5e)."""
    return np.asarray(np.divide(8.0 * (1.0 - e), 5.0 * e))


HERTZ = ForceModel(
    key="hertz",
    title="Hertz",
    year=1882,
    equation="F = K δⁿ  (10)",
    reference="Hertz H (1882) Über die Berührung fester elastischer Körper. J. reine angew. Math. 92, 156",
    domain_source="by definition",
    doi="10.1515/crll.1882.92.156",
    evidence=seen(
        f"{GHARIB_HURMUZLU}, equation (10)",
        doi=DEMLAB_VISCOELASTIC,
    ),
    force=spring,
    domain={"e": (1.0, 1.0)},
    oracle=lambda: 1.0,
    family="elastic",
)

HUNT_CROSSLEY_1975 = hysteresis(
    "hunt-crossley-1975",
    title="Hunt and Crossley",
    year=1975,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 3(1 − e)/2  (19)",
    reference="Hunt KH, Crossley FRE (1975) Coefficient of restitution interpreted as damping in vibroimpact. "
    "J. Appl. Mech. 42, 440",
    domain_source="Zhang and Sharf, quoted by Gharib and Hurmuzlu 2012",
    domain={"e": (0.95, 1.0)},
    doi="10.1115/1.3423596",
    evidence=seen(f"{GHARIB_HURMUZLU}, equation (19)", doi="Rahuldrabit/MBDyn, manual/mybib.bib @db248e0 (2025)"),
    chi=lambda e: 1.5 * (1 - e),
)

HERBERT_MCWHANNELL_1977 = hysteresis(
    "herbert-mcwhannell-1977",
    title="Herbert and McWhannell",
    year=1977,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 6(1 − e)/((2e − 1)² + 3)  (20)",
    reference="Herbert RG, McWhannell DC (1977) Shape and frequency composition of pulses from an impact pair. "
    "J. Eng. Ind. 99, 513",
    evidence=seen(f"{GHARIB_HURMUZLU}, equation (20); {DYS}", note="the paper's title was not seen"),
    chi=lambda e: 6 * (1 - e) / ((2 * e - 1) * (2 * e - 1) + 3),
)

LEE_WANG_1983 = hysteresis(
    "lee-wang-1983",
    title="Lee and Wang",
    year=1983,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 3(1 − e)/4  (21)",
    reference="Lee TW, Wang AC (1983) On the dynamics of intermittent-motion mechanisms, part 1: Dynamic model "
    "and response. J. Mech. Transm. Autom. Des. 105, 534",
    evidence=seen(f"{GHARIB_HURMUZLU}, equation (21); {DYS}", note="the paper's title was not seen"),
    chi=lambda e: 0.75 * (1 - e),
)

LANKARANI_NIKRAVESH_1990 = hysteresis(
    "lankarani-nikravesh-1990",
    title="Lankarani and Nikravesh",
    year=1990,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 3(1 − e²)/4  (22)",
    reference="Lankarani HM, Nikravesh PE (1990) A contact force model with hysteresis damping for impact "
    "analysis of multibody systems. J. Mech. Des. 112, 369",
    domain_source="Gharib and Hurmuzlu 2012",
    doi="10.1115/1.2912617",
    evidence=seen(f"{GHARIB_HURMUZLU}, equation (22)", doi=OPENSEES_HERTZDAMP),
    domain={"e": (0.9, 1.0)},
    chi=lambda e: 0.75 * (1 - e * e),
)

EXACT_HYSTERESIS = hysteresis(
    "exact-hysteresis",
    title="Exact hysteresis",
    year=2002,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ(1 + e) = ln[(1 + χ)/(1 − e χ)]  (23)",
    reference="Gonthier Y, McPhee J, Lange C, Piedboeuf JC (2002) CSME Forum, Queen's University; Gonthier Y "
    "and others (2004) Multibody Syst. Dyn. 11, 209",
    evidence=derived(
        "the first integral of the motion, docs/paper.md",
        note="equation (23) as printed in Gharib and Hurmuzlu (2012), who give it to their reference 14, lacks a "
        "factor v₀; of that entry only the end was seen, its authors are inferred; Zhang and Sharf (2004) were "
        "not seen",
    ),
    chi=exact_damping_ratio,
)

GONTHIER_2004 = hysteresis(
    "gonthier-2004",
    title="Gonthier, McPhee, Lange and Piedboeuf",
    year=2004,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = (1 − e²)/e",
    reference="Gonthier Y, McPhee J, Lange C, Piedboeuf JC (2004) A regularized contact model with asymmetric "
    "damping and dwell-time dependent friction. Multibody Syst. Dyn. 11, 209",
    doi="10.1023/B:MUBO.0000029392.21648.bc",
    evidence=seen(DYS, doi="a bibliography checked at Crossref in October 2026"),
    chi=lambda e: np.divide(1 - e * e, e),
)

ZHIYING_QISHAO_2006 = hysteresis(
    "zhiying-qishao-2006",
    title="Qin and Lu",
    year=2006,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = (3/4)(1 − e²) exp(2(1 − e))",
    reference="Qin Z, Lu Q (2006) Analysis of impact process model based on restitution coefficient. J. Dyn. "
    "Control 4, 294",
    evidence=seen(DYS),
    chi=lambda e: 0.75 * (1 - e * e) * np.exp(2 * (1 - e)),
)

YE_2009_KELVIN = hysteresis(
    "ye-2009-kelvin",
    title="Ye, Li and Zhu, modified Kelvin",
    year=2009,
    equation="F = K δ (1 + χ δ̇/v₀),  χ = 3(1 − e)/(2e)",
    reference="Ye K, Li L, Zhu H (2009) A modified Kelvin impact model for pounding simulation of base-isolated "
    "building with adjacent structures. Earthq. Eng. Eng. Vib. 8, 433",
    evidence=seen(RAILWAY, note="the abstract of the paper was seen, without the formula"),
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
    evidence=seen(f"{DYS}; {MBDYN}", doi=MODIA3D_DOCUMENTATION),
    chi=flores_chi,
)

GHARIB_HURMUZLU_2012 = hysteresis(
    "gharib-hurmuzlu-2012",
    title="Gharib and Hurmuzlu",
    year=2012,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 1/e  (28)",
    reference="Gharib M, Hurmuzlu Y (2012) A new contact force model for low coefficient of restitution impact. "
    "J. Appl. Mech. 79, 064506",
    domain_source="Gharib and Hurmuzlu 2012",
    doi="10.1115/1.4006494",
    evidence=seen(f"{GHARIB_HURMUZLU}, equation (28)", doi=GHARIB_HURMUZLU),
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
    evidence=disputed(
        "3(1 − e)/(2e) in a Python port of Multi_Con_250812.m, a wheel-rail code whose repository is not known, "
        f"and by the slope at e = 1; 3(1 − e)/(4e) in {DYS}",
        doi="the address of a page whose title was not shown",
        note="the formula of the paper was not seen",
    ),
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
    evidence=seen(
        "jgerstmayr/EXUDYN, docs/RST/items/ObjectContactSphereSphere.rst @7de98d35, impactModel 2, and "
        "main/src/Objects/CObjectContactSphereSphere.cpp @e4b8e513",
        doi="two public bibliographies (2026)",
        note="EXUDYN takes it for e > 1/3, below that gonthier-2004; the paper was not seen; the formula agrees "
        "with the exact law to 5e-4 above e = 0.45",
    ),
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
    evidence=not_verified(
        doi="the address of a page whose title was not shown",
        note="its slope at e = 1 is 0.833, which is wrong for small losses",
    ),
    chi=lambda e: np.divide(5 * (1 - e), 4 * e),
)

ZHANG_2020 = hysteresis(
    "zhang-2020",
    title="Zhang, Li, Zhao and He",
    year=2020,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = 3(1 − e)/(2 e^0.89)",
    reference="Zhang J, Li W, Zhao L, He G (2020) A continuous contact force model for impact analysis in "
    "multibody dynamics. Mech. Mach. Theory 153, 103946",
    evidence=not_verified(note="the formula agrees with the exact law to 0.0083"),
    chi=lambda e: np.divide(1.5 * (1 - e), power(e, 0.89)),
)
