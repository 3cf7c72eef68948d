"""Springs with a damping proportional to another power of the indentation: the restitution depends on speed."""

from __future__ import annotations

from typing import Literal, Unpack

from ...formatting import polynomial
from ..closed_forms.viscoelastic import PADE_DENOMINATOR, PADE_NUMERATOR, pade_damping
from ..evidence import derived, not_verified, seen
from ..force_expressions import dragged
from ..formula_calls import Formula
from ..model import About, ForceModel, Parameter
from ..powers import power, powers
from .cited_sources import DEMLAB_VISCOELASTIC
from .dashpot import damping


def drag(
    key: str,
    *,
    c: Formula,
    q: float,
    release: Literal["gap", "force"] = "force",
    coordinate_power: int = 2,
    **about: Unpack[About],
) -> ForceModel:
    """Make a law of the form F = K δⁿ + c δ^q δ̇, n = 3/2 by default."""
    about.setdefault("family", "rate-dependent")
    about.setdefault("exponent", 1.5)
    return ForceModel(
        key,
        **about,
        coefficients={"c": c, "q": lambda: q},
        force=lambda elastic, x, v, c: dragged(elastic, power(x, q), v, c),
        release=release,
        velocity_coordinate="force",
        coordinate_power=coordinate_power,
    )


KUWABARA_KONO_1987 = drag(
    "kuwabara-kono-1987",
    title="Kuwabara and Kono",
    year=1987,
    equation="F = K(δ^(3/2) + (3/2) A δ^(1/2) δ̇), to F = 0",
    reference="Kuwabara G, Kono K (1987) Restitution coefficient in a collision between two spheres. Jpn. J. "
    "Appl. Phys. 26, 1230; Brilliantov NV, Spahn F, Hertzsch JM, Pöschel T (1996) Phys. Rev. E 53, 5382; Ramírez "
    "R, Pöschel T, Brilliantov NV, Schwager T (1999) Phys. Rev. E 60, 4465",
    doi="10.1143/JJAP.26.1230",
    evidence=seen(
        "kuwt/MercuryDPM_fork, HertzianBSHPViscoelasticInteraction.cc @e548763b (2023); rlrangel/DEMLab @23e741d "
        "(2024)",
        doi=DEMLAB_VISCOELASTIC,
    ),
    parameters=(damping("A", "s", "dissipative constant of the material"),),
    c=lambda A, K: 1.5 * A * K,
    q=0.5,
)

LEE_HERRMANN_1993 = drag(
    "lee-herrmann-1993",
    title="Lee and Herrmann",
    year=1993,
    equation="F = K δ^(3/2) + γ m δ̇, to F = 0",
    reference="Lee J, Herrmann HJ (1993) Angle of repose and angle of marginal stability: molecular dynamics of "
    "granular particles. J. Phys. A 26, 373",
    doi="10.1088/0305-4470/26/2/021",
    evidence=seen(DEMLAB_VISCOELASTIC, doi=DEMLAB_VISCOELASTIC),
    parameters=(damping("gamma", "1/s", "damping γ per effective mass"),),
    c=lambda gamma, m: gamma * m,
    q=0.0,
)

KUWABARA_KONO_AT_SPEED = drag(
    "kuwabara-kono-at-speed",
    title="Kuwabara and Kono, for a restitution at a speed",
    year=2011,
    equation="F = K(δ^(3/2) + (3/2) A δ^(1/2) δ̇), to F = 0,  A = (2/3) w² v_e^(−1/5) (K/m)^(−2/5),  e = P(w),  "
    f"P(w) = ({polynomial(PADE_NUMERATOR, 'w')})/({polynomial(PADE_DENOMINATOR, 'w')})",
    reference="Müller P, Pöschel T (2011) Phys. Rev. E 84, 021302; Brilliantov NV, Spahn F, Hertzsch JM, Pöschel "
    "T (1996) Model for collisions in granular gases. Phys. Rev. E 53, 5382",
    doi="10.1103/PhysRevE.84.021302",
    evidence=seen(
        "c61292558/yade4deepin, a copy of YADE 2025.2.0, pkg/dem/HertzMindlin.cpp @f1486c0 (2025); the form P "
        "also in the self tests of MercuryDPM (2023)",
        doi="kuwt/MercuryDPM_fork, HertzianBSHPViscoelasticInteraction @e548763b (2023)",
        note="delivers e at the speed v_e to 7e-4",
    ),
    parameters=(Parameter("ve", "m/s", "closing speed v_e at which e is wanted", default=1.0, least=1e-9),),
    # A K (3/2), with g = w² of the speed v_e
    c=lambda e, ve, m, K: pade_damping(e) * m * power(K / m, 0.6) / power(ve, 0.2),
    q=0.5,
)

HERTZ_POWER_DAMPING = ForceModel(
    key="hertz-power-damping",
    title="Hertz with a damping C δ^q δ̇ of your own, without tension",
    year=2026,
    equation="F = K δ^(3/2) + C δ^q δ̇, to F = 0",
    reference="the general form of lee-herrmann-1993 (q = 0), tsuji-1992-no-tension (1/4) and kuwabara-kono-1987 "
    "(1/2)",
    evidence=derived("the form itself, for a damping of the user"),
    parameters=(
        damping("C", "N s/m^(q+1)", "damping coefficient"),
        Parameter("q", "1", "exponent of the indentation in the damping", default=0.5, least=0.0, most=10.0),
    ),
    force=lambda elastic, x, v, C, q: elastic + C * powers(x, q) * v,
    release="force",
    coordinate_power=4,
    exponent=1.5,
    family="rate-dependent",
)

BORDBAR_HYPPANEN_2007 = drag(
    "bordbar-hyppanen-2007",
    title="Damping δ^0.65, ascribed to Bordbar and Hyppänen",
    year=2007,
    equation="F = K δ^(3/2) + C δ^0.65 δ̇, to F = 0",
    reference="Bordbar MH, Hyppänen T (2007) Modeling of binary collision between multisize viscoelastic spheres. "
    "J. Numer. Anal. Ind. Appl. Math. 2, 115",
    evidence=not_verified(
        note="the paper is in lists of references; the formula was seen nowhere; hertz-power-damping with q = "
        "0.65 is the same",
    ),
    parameters=(damping("C", "N s/m^1.65", "damping constant"),),
    c=lambda C: C,
    q=0.65,
    coordinate_power=4,
)
