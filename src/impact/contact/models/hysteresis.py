"""The hysteresis family, F = K δⁿ (1 + χ δ̇/v₀): equation (18) and the coefficients of (19) to (28)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..model import ForceModel, Formula
from ..oracles import delivered_restitution, exact_damping_ratio

MEMORY = "formula as printed in Gharib and Hurmuzlu (2012); DOI from memory"


def hysteresis(
    key: str,
    *,
    title: str,
    year: int,
    equation: str,
    reference: str,
    chi: Formula,
    doi: str = "",
    evidence: str = "",
    domain: Mapping[str, tuple[float, float]] | None = None,
) -> ForceModel:
    """A member of the hysteresis family, from the formula of its damping ratio χ = λ v₀/K.

    Parameters
    ----------
    key, title, year, equation, reference, doi, evidence, domain : see `ForceModel`
    chi : χ [-] as a function of what it asks for by name, such as `lambda e: 1 / e`

    >>> law = hysteresis("mine", title="Mine", year=2026, equation="χ = 1 − e", reference="", chi=lambda e: 1 - e)
    >>> law.force(elastic=1.0, v=0.5, v0=1.0, chi=1.0)
    1.5
    """
    return ForceModel(
        key=key,
        title=title,
        year=year,
        equation=equation,
        reference=reference,
        doi=doi,
        evidence=evidence,
        domain=domain or {},
        force=lambda elastic, v, v0, chi: elastic * (1 + chi * v / v0),
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
