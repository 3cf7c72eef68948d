"""Springs with a damping that goes as another power of the indentation: the restitution depends on the speed."""

from __future__ import annotations

from typing import Literal, Unpack

from ..forms import dragged
from ..formula import Formula
from ..model import About, ForceModel, Parameter
from ..power import power


def drag(
    key: str, *, c: Formula, q: float, release: Literal["gap", "force"], smooth: int = 2, **about: Unpack[About]
) -> ForceModel:
    """A spring and a damping of its own power, F = K δⁿ + c δ^q δ̇.

    Parameters
    ----------
    key, smooth, about : see `ForceModel`
    c : the damping coefficient as a function of what it asks for by name
    q : exponent of the indentation in the damping
    release : where the contact ends
    """
    return ForceModel(
        key,
        **about,
        coefficients={"c": c, "q": lambda: q},
        force=lambda elastic, x, v, c: dragged(elastic, power(x, q), v, c),
        release=release,
        momentum="force",
        smooth=smooth,
        family="rate-dependent",
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
    evidence="formula and DOI from memory; the paper of 1999 seen",
    parameters=(Parameter("A", "s", "dissipative constant of the material", least=0.0),),
    exponent=1.5,
    c=lambda A, K: 1.5 * A * K,
    q=0.5,
    release="force",
)

LEE_HERRMANN_1993 = drag(
    "lee-herrmann-1993",
    title="Lee and Herrmann",
    year=1993,
    equation="F = K δ^(3/2) + γ m δ̇, to F = 0",
    reference="Lee J, Herrmann HJ (1993) Angle of repose and angle of marginal stability. J. Phys. A 26, 373; "
    "Ristow GH (1992) Simulating granular flow with molecular dynamics. J. Phys. I 2, 649",
    doi="10.1088/0305-4470/26/2/021",
    evidence="formula and DOI from memory",
    parameters=(Parameter("gamma", "1/s", "damping γ per effective mass", least=0.0),),
    exponent=1.5,
    c=lambda gamma, m: gamma * m,
    q=0.0,
    release="force",
)

BORDBAR_HYPPANEN_2007 = drag(
    "bordbar-hyppanen-2007",
    title="Bordbar and Hyppänen",
    year=2007,
    equation="F = K δ^(3/2) + C δ^0.65 δ̇, to F = 0",
    reference="Bordbar MH, Hyppänen T (2007) Modeling of binary collision between multisize viscoelastic spheres. "
    "J. Numer. Anal. Ind. Appl. Math. 2, 115",
    evidence="formula from memory; no DOI known",
    parameters=(Parameter("C", "N s/m^1.65", "damping constant", least=0.0),),
    exponent=1.5,
    c=lambda C: C,
    q=0.65,
    release="force",
    smooth=4,
)
