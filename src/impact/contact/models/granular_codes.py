"""Laws of granular codes other than LAMMPS, and of Chrono's smooth contacts."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...array_types import Array
from ..closed_forms.dashpot import force_damping, gap_damping
from ..evidence import seen
from ..model import Parameter
from ..powers import power
from .aliases import in_code, same_law
from .cited_sources import CHRONO, DEMLAB_VISCOELASTIC, KRATOS, LIGGGHTS, YADE_2025
from .dashpot import (
    ANAGNOSTOPOULOS_1988,
    HERTZIAN_DASHPOT,
    KELVIN_VOIGT,
    KELVIN_VOIGT_NO_TENSION,
    LINEAR_DASHPOT,
    SCHWAGER_POSCHEL_2007,
    THORNTON_EQUATION,
    TSUJI_1992,
    TSUJI_1992_NO_TENSION,
    ZETA_BY_LOGARITHM,
    damping,
    dashpot,
    thornton_zeta,
    with_release,
)
from .viscoelastic import KUWABARA_KONO_AT_SPEED

TANGENT_DASHPOT = "F = K δ^(3/2) + 2 β √(m S) δ̇,  S = (3/2) K δ^(1/2)"
# at this closing speed the linear spring absorbs as much energy as Hertz's
CHARACTERISTIC_SPEED = (Parameter("vc", "m/s", "characteristic speed of the stiffness", default=1.0, least=1e-9),)
STIFFNESS_BY_SPEED = "K = (16/15) E* √R* (15 m v_c²/(16 E* √R*))^(1/5)"
# springs of exponent 1 and 3/2 with a dashpot
linear_dashpot, hertzian_dashpot = (partial(dashpot, exponent=n, family="codes") for n in (1.0, 1.5))


def stiffness_by_speed(E_eff: Array, R_eff: Array, m: Array, vc: Array) -> Array:
    """Compute K [N/m] of a linear spring from E* [Pa], R* [m], m [kg] and a characteristic speed [m/s]."""
    root = np.sqrt(R_eff) * E_eff
    return 16 / 15 * root * power(15 * m * vc * vc / (16 * root), 0.2)


# ---- LIGGGHTS

LIGGGHTS_REFERENCE = "LIGGGHTS-PUBLIC, pair style gran, model"
OF_HERTZ = f"{LIGGGHTS_REFERENCE} hertz", f"{LIGGGHTS}normal_model_hertz.h"
OF_HOOKE = f"{LIGGGHTS_REFERENCE} hooke, without the option viscous", f"{LIGGGHTS}normal_model_hooke.h"
in_liggghts = partial(in_code, "LIGGGHTS")

LIGGGHTS_HERTZ = in_liggghts(TSUJI_1992, "hertz", "hertz (3.0.0 to 3.8.0)", 2014, *OF_HERTZ)
LIGGGHTS_HERTZ_LIMIT = in_liggghts(
    TSUJI_1992_NO_TENSION, "hertz-limit-force", "hertz, limitForce (3.0.0 to 3.8.0)", 2014, *OF_HERTZ
)

LIGGGHTS_HOOKE = linear_dashpot(
    "liggghts-hooke",
    title="LIGGGHTS hooke (3.0.0 to 3.8.0)",
    year=2014,
    equation=f"{LINEAR_DASHPOT},  {ZETA_BY_LOGARITHM}, to δ = 0;  {STIFFNESS_BY_SPEED}",
    reference=OF_HOOKE[0],
    evidence=seen(OF_HOOKE[1]),
    parameters=CHARACTERISTIC_SPEED,
    zeta=gap_damping,
    stiffness=stiffness_by_speed,
)

CHRONO_SMC_HOOKE = with_release(
    LIGGGHTS_HOOKE,
    "force",
    key="chrono-smc-hooke",
    title="Chrono SMC, Hooke (sequential core, 2016 to 2026)",
    year=2016,
    reference="Project Chrono, ChContactSMC; LIGGGHTS hooke with limitForce has it too",
    evidence=seen(CHRONO, note="the multicore solver does not cut the tension off"),
)

LIGGGHTS_HOOKE_LIMIT = in_liggghts(
    CHRONO_SMC_HOOKE, "hooke-limit-force", "hooke, limitForce (3.0.0 to 3.8.0)", 2014, *OF_HOOKE
)

# ---- Lethe

LETHE = (
    "chaos-polymtl/lethe, include/dem/particle_particle_contact_force.h @0092035b and effective_properties.h "
    "@8bf81c3b, doc/source/theory/dem/dem.rst @023e4352"
)
LETHE_LAWS = tuple(
    same_law(
        law, key, title=f"Lethe, {method} (2026)", year=2020, family="codes",
        reference="Lethe, particle particle contact force method",
        evidence=seen(LETHE, note=f"its year is that of the licence; {note}"),
    )
    for law, key, method, note in (
        (TSUJI_1992, "lethe-hertz", "hertz and hertz_mindlin_limit_overlap, _force", "its K is 3e-5 smaller"),
        (LIGGGHTS_HOOKE, "lethe-linear", "linear", "its v_c is always 1 m/s, its K 3e-5 larger"),
    )
)  # fmt: skip

# ---- Chrono

CHRONO_HERTZ = in_code(
    "Chrono",
    TSUJI_1992_NO_TENSION,
    "smc-hertz",
    "SMC, Hertz (sequential core, 2016 to 2026)",
    2016,
    "Project Chrono, ChContactSMC",
    CHRONO,
    "the multicore solver does not cut the tension off, as in tsuji-1992",
)

CHRONO_SMC_PLAINCOULOMB = hertzian_dashpot(
    "chrono-smc-plaincoulomb",
    title="Chrono SMC, PlainCoulomb (sequential core, 2016 to 2026)",
    year=2016,
    equation=f"{HERTZIAN_DASHPOT},  α = −√5 ln e/√(π² + ln² e), to F = 0;  K = (4/3) E* √(1 m)",
    reference="Project Chrono, ChContactSMC",
    evidence=seen(
        CHRONO,
        note="its stiffness lacks the radius; the multicore solver does not cut the tension off",
    ),
    zeta=gap_damping,
    release="force",
    stiffness=lambda E_eff: 4 / 3 * E_eff,
)

# ---- YADE

HERTZ_MINDLIN, VISCO_ELASTIC = "YADE, Law2_ScGeom_MindlinPhys_Mindlin", "YADE, Law2_ScGeom_ViscElPhys_Basic"
MINDLIN, VISCO_PM = f"{YADE_2025}, HertzMindlin.cpp", f"{YADE_2025}, ViscoelasticPM.cpp"
CLAMPED = "YADE, pkg/dem/HertzMindlin.cpp, commit 45c86581d (September 2013)"
PULLING = "YADE, pkg/dem/HertzMindlin.cpp, commit ddb7a1a19 (January 2011)"
WITH_LIMIT = "YADE, pkg/dem/ViscoelasticPM.cpp, commit fe8647e14 (January 2014), which adds the limit"
EN_OF_TSUJI = f"{HERTZ_MINDLIN}, en, with the damping of Tsuji and others"
EN_AT_SPEED, KN_AND_CN = f"{HERTZ_MINDLIN}, en at the speed vn", f"{VISCO_ELASTIC}, kn and cn"
in_yade = partial(in_code, "YADE")

YADE_RENAMED = (
    in_yade(
        TSUJI_1992_NO_TENSION,
        "en-clamped",
        "HertzMindlin en (September 2013 to 2022.01a)",
        2013,
        EN_OF_TSUJI,
        CLAMPED,
    ),
    in_yade(TSUJI_1992, "en-pulling", "HertzMindlin en (2011 to September 2013)", 2011, EN_OF_TSUJI, PULLING),
    in_yade(
        KUWABARA_KONO_AT_SPEED,
        "en-at-speed",
        "HertzMindlin en and vn (since 2024.02a)",
        2024,
        EN_AT_SPEED,
        MINDLIN,
    ),
    in_yade(
        KELVIN_VOIGT_NO_TENSION, "viscoelastic", "viscoelastic (since January 2014)", 2014, KN_AND_CN, VISCO_PM
    ),
    in_yade(
        KELVIN_VOIGT, "viscoelastic-pulling", "viscoelastic (2009 to January 2014)", 2009, KN_AND_CN, WITH_LIMIT
    ),
    in_yade(
        SCHWAGER_POSCHEL_2007,
        "viscoelastic-en",
        "viscoelastic, en with young (since June 2015)",
        2015,
        f"{VISCO_ELASTIC}, en with young and poisson",
        VISCO_PM,
        "YADE finds the damping to 1 % of en, this law exactly",
    ),
)

YADE_EN = hertzian_dashpot(
    "yade-en",
    title="YADE HertzMindlin en (since 2023.02a)",
    year=2023,
    equation=THORNTON_EQUATION.replace("to F = 0", "β = 0 at e = 1, to F = 0"),
    reference=f"{HERTZ_MINDLIN}, en, by (B6), (B7) and Table 2 of Thornton, Cummins and Cleary (2013)",
    evidence=seen(MINDLIN),
    zeta=lambda e: np.where(e < 1.0, thornton_zeta(np.minimum(e, np.nextafter(1.0, 0.0))), 0.0),
    release="force",
)
YADE_BETAN = hertzian_dashpot(
    "yade-betan",
    title="YADE HertzMindlin betan, by the traditional formula (since September 2013)",
    year=2013,
    equation=f"{TANGENT_DASHPOT},  β = −ln e/√(π² + ln² e), to F = 0",
    reference=f"{HERTZ_MINDLIN}, betan, which YADE leaves to the user, by the formula of a linear spring",
    evidence=seen(MINDLIN),
    # 2 β √(3/2) is α
    zeta=lambda e: np.sqrt(1.2) * gap_damping(e),
    release="force",
)
YADE_BETAN_PULLING = with_release(
    YADE_BETAN,
    "gap",
    key="yade-betan-pulling",
    title="YADE HertzMindlin betan, by the traditional formula (2010 to September 2013)",
    year=2010,
    evidence=seen(f"{CLAMPED}, whose removed lines pull"),
)
YADE_BETAN_DIRECT = hertzian_dashpot(
    "yade-betan-direct",
    title="YADE HertzMindlin betan (since September 2013)",
    year=2013,
    equation=f"{TANGENT_DASHPOT}, to F = 0",
    reference=f"{HERTZ_MINDLIN}, betan",
    evidence=seen(MINDLIN),
    parameters=(damping("betan", "1", "damping ratio β of the tangent stiffness"),),
    zeta=lambda betan: np.sqrt(1.2) * betan,
    release="force",
)

# ---- MFiX

MFIX = "soufiane92/MFiX-21.3.2, model/check_data/check_solids_dem.f and model/des/calc_force_dem.f @e8a0d92 (2021)"
MFIX_LSD = in_code(
    "MFiX", ANAGNOSTOPOULOS_1988, "lsd", "DEM, LSD (2016 to 21.3.2)", 2016, "MFiX, DES_COLL_MODEL LSD", MFIX
)
MFIX_HERTZ = hertzian_dashpot(
    "mfix-hertz",
    title="MFiX DEM, Hertzian (2014 to 21.3.2)",
    year=2014,
    equation=f"{HERTZIAN_DASHPOT},  α = −2 ln e/√(π² + ln² e), to δ = 0",
    reference="MFiX, DES_COLL_MODEL HERTZIAN, whose α has 2 in the place of √5",
    evidence=seen(MFIX),
    zeta=lambda e: 2 / np.sqrt(5.0) * gap_damping(e),
)

# ---- Kratos

# sphere_strategy.py replaces an e below the first by it, and has no damping above the second
KRATOS_MIN_E, KRATOS_MAX_E = 0.001, 0.999

KRATOS_HERTZ = hertzian_dashpot(
    "kratos-hertz",
    title="Kratos DEM, Hertz with viscous damping (law files of 2015)",
    year=2015,
    equation=THORNTON_EQUATION.replace("to F = 0", "e from 0.001, β = 0 above e = 0.999, to F = 0"),
    reference="Kratos DEM, DEM_D_Hertz_viscous_Coulomb",
    evidence=seen(
        f"{KRATOS}, custom_constitutive/DEM_D_Hertz_viscous_Coulomb_CL.cpp @72b6f58f and "
        "python_scripts/sphere_strategy.py @4ddf9200",
        note="when the damping of e was added was not seen; the law file @03f57bf0 has δ², by a slip",
    ),
    zeta=lambda e: np.where(e <= KRATOS_MAX_E, thornton_zeta(np.clip(e, KRATOS_MIN_E, KRATOS_MAX_E)), 0.0),
    release="force",
)
KRATOS_LINEAR = linear_dashpot(
    "kratos-linear",
    title="Kratos DEM, linear with viscous damping (law files of 2015)",
    year=2015,
    equation=f"{LINEAR_DASHPOT},  e = exp(−2 ζ acos(ζ)/√(1 − ζ²)), e from 0.001, ζ = 0 above e = 0.999, "
    "to F = 0;  K = 1.432 π 0.31225 E* R*, against a wall without 1.432",
    reference="Kratos DEM, DEM_D_Linear_viscous_Coulomb",
    evidence=seen(
        f"{KRATOS}, custom_constitutive/DEM_D_Linear_viscous_Coulomb_CL.cpp @013f9253 and "
        "python_scripts/sphere_strategy.py @4ddf9200",
        note="Kratos finds ζ by bisection to 1e-4, this law exactly; when the damping of e was added was not seen",
    ),
    zeta=lambda e: np.where(e <= KRATOS_MAX_E, force_damping(np.maximum(e, KRATOS_MIN_E)), 0.0),
    release="force",
    stiffness=lambda E_eff, R_eff, R1, R2: (
        np.where(np.isinf(R1) | np.isinf(R2), 1.0, 1.432) * np.pi * 0.31225 * E_eff * R_eff
    ),
)

# ---- MercuryDPM and DEMLab

MERCURYDPM_LINEAR = in_code(
    "MercuryDPM",
    ANAGNOSTOPOULOS_1988,
    "linear-viscoelastic",
    "LinearViscoelastic (state of 2015)",
    2013,
    "MercuryDPM, kernel",
    "gladk/MercuryDPM, Kernel/Interactions/NormalForceInteractions/LinearViscoelasticInteraction.cc @c50970e "
    "(2015)",
    "its first year was not seen",
)

DEMLAB_TTI = hertzian_dashpot(
    "demlab-tti",
    title="DEMLab TTI (2021 to 2024)",
    year=2021,
    equation=f"{HERTZIAN_DASHPOT},  α = −2.2664 ln e/√(10.1354 + ln² e), to F = 0",
    reference="Rangel R, DEMLab, contact law of Tsuji, Tanaka and Ishida with remove_cohesion, its default",
    evidence=seen(
        DEMLAB_VISCOELASTIC,
        note="its first year was not seen",
    ),
    zeta=lambda e: 2.2664 / np.sqrt(5.0) / np.sqrt(1.0 + 10.1354 / np.square(np.log(e))),
    release="force",
)
