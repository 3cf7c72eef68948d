"""Friction laws of LAMMPS, LIGGGHTS, YADE and Kratos, with the names that these codes have for them."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

from ..evidence import seen
from ..fixed_step import KICK_DRIFT
from ..friction import FrictionLaw
from ..model import Parameter
from ..models.cited_sources import KRATOS, LIGGGHTS, YADE_2025
from .textbook import CONSTANT_STIFFNESS, KT_OVER_KN, MINDLIN_STIFFNESS, XT, choice, limit, optional, stiffness

# ---- LAMMPS

LAMMPS = "lammps/lammps, src/GRANULAR/gran_sub_mod_tangential.cpp @079d233c (2026)"
LAMMPS_LIMIT = "|f| ≤ μ |F|, where it slips the spring takes what the dashpot leaves"


def lammps(
    option: str, equation: str, *stiffness: Parameter, hint: str = "", source: str = LAMMPS, **fields: Any
) -> FrictionLaw:
    """Make the law of an option of LAMMPS, with a hint after its reference."""
    return FrictionLaw(
        key=f"lammps-{re.sub('[_/]', '-', option)}",
        title=f"LAMMPS {option}",
        year=2019,
        equation=equation,
        reference=f"LAMMPS, pair style granular, tangential {option}{hint}",
        evidence=seen(source, note="its first year was not seen"),
        damping="xt",
        parameters=(*stiffness, XT, limit("abs")),
        **fields,
    )


LAMMPS_LINEAR = (
    lammps(
        "linear_history",
        f"f = k_t ξ + xₜ c_n g,  ξ̇ = g,  {LAMMPS_LIMIT}",
        *CONSTANT_STIFFNESS,
        kind="spring",
        stiffness="constant",
    ),
    lammps("linear_nohistory", "f = min(xₜ c_n |g|, μ |F|) sgn g", kind="dashpot"),
)
LAMMPS_MINDLIN = tuple(
    lammps(
        option,
        f"{equation},  a = √(R* δ),  {LAMMPS_LIMIT}",
        *MINDLIN_STIFFNESS,
        hint=", whose coefficient [Pa] is k_t/√R*, NULL for 8 G*",
        source=f"{LAMMPS}, and gran_sub_mod.cpp @07b704ca (2026)",
        kind="spring",
        stiffness="mindlin",
        memory=memory,
    )
    for option, equation, memory in (
        ("mindlin", "f = 8 G* a ξ + xₜ c_n g,  ξ̇ = g", (1.0, 1.0)),
        ("mindlin/force", "f = f_e + xₜ c_n g,  ḟ_e = 8 G* a g", (0.0, 0.0)),
        ("mindlin_rescale", "f = 8 G* a ξ + xₜ c_n g,  ξ̇ = g,  and ξ ∝ a on unloading", (1.0, 2.0)),
        ("mindlin_rescale/force", "f = f_e + xₜ c_n g,  ḟ_e = 8 G* a g,  and f_e ∝ a on unloading", (0.0, 1.0)),
    )
)

# only a fixed step has the displacement that a slip leaves
LAMMPS_CLASSIC = replace(
    LAMMPS_MINDLIN[0],
    key="lammps-classic-2025",
    title="LAMMPS fix wall/gran hooke/history and hertz/history (22 July 2025)",
    year=2025,
    equation="f = k_t a ξ + xₜ c_n g,  ξ̇ = g,  |f| ≤ μ |F|, where it slips ξ = (f − xₜ c_n g)/k_t, without a, so "
    "that f depends on the unit of length",
    reference="LAMMPS, fix wall/gran, linear_history_classic and mindlin_classic",
    evidence=seen(
        LAMMPS,
        note="that version has neither the a of hooke/history nor the a left out; both were found in runs of the "
        "release of 22 July 2025",
    ),
    parameters=(
        stiffness("k_t", "N/m^2", "stiffness over the radius of the contact, K_t of the code"),
        replace(XT, default=0.5),
        limit("abs"),
    ),
    stiffness="classic",
    scheme=KICK_DRIFT,
)

# ---- LIGGGHTS

LIGGGHTS_DAMPING = "c = 2√(5/6) b √(8 G* a m), b = −ln e/√(π² + ln² e) for n = 3/2, c_n for n = 1"
LIGGGHTS_NORMAL_MODELS = "normal_model_hertz.h, normal_model_hooke.h and global_properties.cpp"
DAMPING_SWITCH = choice("tangential_damping", "whether there is a tangential damping", ("off", "on"), "on")

LIGGGHTS_HISTORY = FrictionLaw(
    key="liggghts-history",
    title="LIGGGHTS history (3.8.0)",
    year=2014,
    equation="f = k ξ + c g,  k = 8 G* a for n = 3/2, K for n = 1,  ξ̇ = g,  |k ξ| ≤ μ |F|, where it slips "
    f"f = μ |F|,  {LIGGGHTS_DAMPING}",
    reference="LIGGGHTS-PUBLIC, tangential history",
    kind="spring",
    evidence=seen(
        f"{LIGGGHTS}tangential_model_history.h, {LIGGGHTS_NORMAL_MODELS}",
        note="also @25fc3965; tangential_reduce is ktToKnUser there, with the number 0.285714286",
    ),
    parameters=(
        KT_OVER_KN,
        DAMPING_SWITCH,
        choice("tangential_reduce", "whether k is 2K/7 for n = 1", ("off", "on"), "off"),
        limit("abs"),
    ),
    stiffness="liggghts",
    damping="liggghts",
    memory=(1.0, 1.0),
    cap="spring",
)

LIGGGHTS_NO_HISTORY = FrictionLaw(
    key="liggghts-no-history",
    title="LIGGGHTS no_history (3.8.0)",
    year=2014,
    equation=f"f = min(c |g|, μ |F|) sgn g,  {LIGGGHTS_DAMPING}",
    reference="LIGGGHTS-PUBLIC, tangential no_history",
    kind="dashpot",
    evidence=seen(f"{LIGGGHTS}tangential_model_no_history.h, {LIGGGHTS_NORMAL_MODELS}"),
    parameters=(KT_OVER_KN, DAMPING_SWITCH, limit("abs")),
    stiffness="liggghts",
    damping="liggghts",
)

# ---- YADE

YADE_LIMIT = "|f_e| ≤ μ max(F, 0), where it slips f = μ max(F, 0)"

YADE_MINDLIN = FrictionLaw(
    key="yade-mindlin",
    title="YADE HertzMindlin (state of 2025)",
    year=2010,
    equation=f"f = f_e + c g,  ḟ_e = 8 G* a g,  c = 2 β_s √(8 G* a m),  {YADE_LIMIT}",
    reference="YADE, Law2_ScGeom_MindlinPhys_Mindlin, without adhesion",
    kind="spring",
    evidence=seen(
        f"{YADE_2025}, HertzMindlin.cpp",
        note="betas is by default −ln e/√(π² + ln² e) here, in YADE the betan of its contact force",
    ),
    parameters=(
        *MINDLIN_STIFFNESS,
        optional("betas", "1", "damping ratio β_s of the tangential stiffness; unset, −ln e/√(π² + ln² e)"),
        limit("positive"),
    ),
    stiffness="mindlin",
    damping="betas",
    cap="spring",
)

YADE_VISCOELASTIC = FrictionLaw(
    key="yade-viscoelastic",
    title="YADE viscoelastic (since January 2014)",
    year=2014,
    equation=f"f = k_t ξ + c_t g,  ξ̇ = g,  {YADE_LIMIT.replace('f_e', 'k_t ξ')}",
    reference="YADE, Law2_ScGeom_ViscElPhys_Basic, ks and cs",
    kind="spring",
    evidence=seen(f"{YADE_2025}, ViscoelasticPM.cpp", note="the year is that of its contact force"),
    parameters=(
        *CONSTANT_STIFFNESS,
        Parameter("c_t", "N s/m", "tangential damping", default=0.0, least=0.0),
        limit("positive"),
    ),
    stiffness="constant",
    damping="c_t",
    cap="spring",
)

# ---- Kratos

# only a fixed step: its slip below the limit of the spring is not among the modes of `impact.contact.slip_motion`
KRATOS_VISCOUS_COULOMB = FrictionLaw(
    key="kratos-viscous-coulomb",
    title="Kratos DEM, viscous Coulomb (10.4.4)",
    year=2015,
    equation="f = f_e + c_n √κ g,  ḟ_e = κ n K δⁿ⁻¹ g,  κ = 4 G*/E*,  and f_e ∝ δⁿ⁻¹ on unloading,  "
    "|f_e| ≤ μ max(F, 0), |f| ≤ μ max(F, 0)",
    reference="Kratos DEM, DEM_D_Hertz_viscous_Coulomb and DEM_D_Linear_viscous_Coulomb",
    kind="spring",
    evidence=seen(
        f"{KRATOS}, custom_constitutive/DEM_D_Hertz_viscous_Coulomb_CL.cpp @03f57bf0, "
        "DEM_D_Linear_viscous_Coulomb_CL.cpp @013f9253 and DEM_D_Linear_viscous_Coulomb_CL.h @016af01b",
        note="for STATIC_FRICTION = DYNAMIC_FRICTION; a spring beyond the limit is not cut back while the dashpot "
        "opposes it",
    ),
    parameters=(limit("positive"),),
    stiffness="kratos",
    damping="kratos",
    memory=(0.0, 1.0),
    cap="both",
    scheme=KICK_DRIFT,
)
