"""Names under which a law of the catalogue was published again; their results are equal bit for bit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..evidence import not_verified, seen
from ..model import ForceModel
from .cited_sources import OPENSEES_HERTZDAMP
from .dashpot import KELVIN_VOIGT
from .hysteresis import EXACT_HYSTERESIS, FLORES_2011, HUNT_CROSSLEY_1975, LANKARANI_NIKRAVESH_1990


def same_law(law: ForceModel, key: str, *, doi: str = "", **about: Any) -> ForceModel:
    """Give a law another name, with other fields that describe it; its domain is that of the first name alone."""
    return replace(law, key=key, doi=doi, domain={}, domain_source="", same_as=law.key, **about)


def in_code(
    code: str, law: ForceModel, key: str, title: str, year: int, reference: str, source: str, note: str = ""
) -> ForceModel:
    """Make a law of the catalogue under the name that a code has for it, with the law's own rule for K.

    The key and the title of the law begin with the name of the code.
    """
    about: dict[str, Any] = {"year": year, "reference": reference, "evidence": seen(source, note=note)}
    return same_law(law, f"{code.lower()}-{key}", title=f"{code} {title}", family="codes", **about)


MARHEFKA_ORIN_1999 = same_law(
    HUNT_CROSSLEY_1975,
    "marhefka-orin-1999",
    title="Marhefka and Orin",
    year=1999,
    reference="Marhefka DW, Orin DE (1999) A compliant contact model with nonlinear damping for simulation of "
    "robotic systems. IEEE Trans. Syst. Man Cybern. A 29, 566",
    doi="10.1109/3468.798060",
    evidence=seen(
        "JuliaRobotics/RigidBodyDynamics.jl, src/contact.jl @d6df4ebe (2024)",
        doi="superAngGao/robot_simulator, docs/restitution_impedance_research_2026-04-07.md @cc6a33f (2026)",
    ),
)

MUTHUKUMAR_DESROCHES_2006 = same_law(
    LANKARANI_NIKRAVESH_1990,
    "muthukumar-desroches-2006",
    title="Muthukumar and DesRoches, Hertzdamp",
    year=2006,
    reference="Muthukumar S, DesRoches R (2006) A Hertz contact model with non-linear damping for pounding "
    "simulation. EESD 35, 811",
    doi="10.1002/eqe.557",
    evidence=not_verified(
        doi=OPENSEES_HERTZDAMP,
        note="that it had a formula for e which Ye, Li and Zhu (2009) call incorrect was seen; the material of "
        "OpenSees takes χ itself",
    ),
)

YE_2009_HERTZ = same_law(
    FLORES_2011,
    "ye-2009-hertz",
    title="Ye, Li and Zhu, corrected Hertzdamp",
    year=2009,
    reference="Ye K, Li L, Zhu H (2009) A note on the Hertz contact model with nonlinear damping for pounding "
    "simulation. EESD 38, 1135",
    doi="10.1002/eqe.883",
    evidence=seen(OPENSEES_HERTZDAMP, doi="the first page of the paper"),
)

KHATIWADA_2014 = same_law(
    EXACT_HYSTERESIS,
    "khatiwada-2014",
    title="Khatiwada, Chouw and Butterworth",
    year=2014,
    reference="Khatiwada S, Chouw N, Butterworth JW (2014) A generic structural pounding model using numerically "
    "exact displacement proportional damping. Eng. Struct. 62-63, 33",
    evidence=not_verified(note="neither the paper nor its formula was seen anywhere"),
)

JACOBS_WALDRON_2015 = same_law(
    EXACT_HYSTERESIS,
    "jacobs-waldron-2015",
    title="Jacobs and Waldron",
    year=2015,
    reference="Jacobs DA, Waldron KJ (2015) Modeling inelastic collisions with the Hunt-Crossley model using the "
    "energetic coefficient of restitution. J. Comput. Nonlinear Dyn. 10, 021001",
    doi="10.1115/1.4028473",
    evidence=not_verified(
        doi="the publisher's page",
        note="by its abstract the paper prints an approximation, which this exact relation is not",
    ),
)

SCHAFER_1996 = same_law(
    KELVIN_VOIGT,
    "schafer-1996",
    title="Schäfer, Dippel and Wolf",
    year=1996,
    reference="Schäfer J, Dippel S, Wolf DE (1996) Force schemes in simulations of granular materials. J. Phys. "
    "I 6, 5",
    doi="10.1051/jp1:1996129",
    evidence=not_verified(
        doi="the publisher's page", note="the formula is that of every linear spring and dashpot"
    ),
)
