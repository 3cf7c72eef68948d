"""Coulomb's friction, and the spring of Cundall and Strack."""

from __future__ import annotations

from dataclasses import replace

from ..evidence import Evidence
from ..friction import FrictionLaw
from ..models.cited_sources import DEMLAB_VISCOELASTIC, YADE_2025
from .parameters import CONSTANT_STIFFNESS, limit

COULOMB_1785 = FrictionLaw(
    key="coulomb-1785",
    title="Coulomb",
    year=1785,
    equation="f = μ N sgn g until g = 0, then 0",
    reference="Coulomb CA (1785) Théorie des machines simples. Mém. Math. Phys. Acad. R. Sci. 10, 161",
    kind="coulomb",
    evidence=Evidence("not verified", note="the memoir was not seen; the law is that of textbooks"),
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
    evidence=Evidence(
        "seen",
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
    evidence=Evidence(
        "seen",
        f"{YADE_2025}, ElasticContactLaw.cpp",
        note="its first year was not seen; its own contact force is K δ",
    ),
    parameters=(*CONSTANT_STIFFNESS, limit("positive")),
)
