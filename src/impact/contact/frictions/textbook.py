"""Coulomb's friction, the spring of Cundall and Strack, and the parameters that several laws have."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from ..evidence import not_verified, seen
from ..friction import FrictionLaw
from ..model import Parameter
from ..models.cited_sources import DEMLAB_VISCOELASTIC, YADE_2025


def choice(name: str, meaning: str, words: tuple[str, ...], default: str) -> Parameter:
    """Make a parameter that is one of some words."""
    last = float(len(words) - 1)
    return Parameter(name, "1", meaning, float(words.index(default)), 0.0, last, choices=words)


def limit(default: str) -> Parameter:
    """Make the choice of the normal force that limits friction."""
    meaning = 'N of the limit μ N: "abs" is |F|, also where the contact pulls; "positive" is max(F, 0)'
    return choice("limit", meaning, ("abs", "positive"), default)


XT = Parameter("xt", "1", "tangential damping over the damping of the contact force", default=1.0, least=0.0)
stiffness = partial(Parameter, least=1e-9, optional=True)
# one that may be left unset
optional = partial(Parameter, least=0.0, optional=True)
KT_OVER_KN = stiffness("kt_over_kn", "1", "stiffness over that of the contact at the same indentation, n K δⁿ⁻¹")
# one of the two has to be set, or 8 G* a is taken
CONSTANT_STIFFNESS = (stiffness("k_t", "N/m", "tangential stiffness"), KT_OVER_KN)
MINDLIN_STIFFNESS = (
    stiffness("k_t", "N/m^1.5", "tangential stiffness over √δ, in the place of 8 G* √R*"),
    KT_OVER_KN,
)

COULOMB_1785 = FrictionLaw(
    key="coulomb-1785",
    title="Coulomb",
    year=1785,
    equation="f = μ N sgn g until g = 0, then 0",
    reference="Coulomb CA (1785) Théorie des machines simples. Mém. Math. Phys. Acad. R. Sci. 10, 161",
    kind="coulomb",
    evidence=not_verified(note="the memoir was not seen; the law is that of textbooks"),
    parameters=(limit("abs"),),
)

CUNDALL_STRACK_1979 = FrictionLaw(
    key="cundall-strack-1979",
    title="Cundall and Strack",
    year=1979,
    equation="f = k_t ξ, |f| ≤ μ N,  ξ̇ = g while it sticks",
    reference="Cundall PA, Strack ODL (1979) A discrete numerical model for granular assemblies. Géotechnique "
    "29, 47",
    doi="10.1680/geot.1979.29.1.47",
    kind="spring",
    evidence=seen(
        f"{YADE_2025}, ElasticContactLaw.cpp, after the paper",
        doi=DEMLAB_VISCOELASTIC,
        note="the paper was not seen; it has a dashpot, which acts while the contact sticks",
    ),
    parameters=(*CONSTANT_STIFFNESS, limit("abs")),
    stiffness="constant",
)

YADE_CUNDALL_STRACK = replace(
    CUNDALL_STRACK_1979,
    key="yade-cundall-strack",
    title="YADE FrictPhys CundallStrack (state of 2025)",
    year=2008,
    equation="f = k_t ξ, |f| ≤ μ max(F, 0),  ξ̇ = g while it sticks",
    reference="YADE, Law2_ScGeom_FrictPhys_CundallStrack",
    doi="",
    evidence=seen(
        f"{YADE_2025}, ElasticContactLaw.cpp",
        note="its first year was not seen; its own contact force is K δ",
    ),
    parameters=(*CONSTANT_STIFFNESS, limit("positive")),
)
