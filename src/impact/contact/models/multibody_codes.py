"""Laws of multibody, robotics and structural codes, in the parameters that those codes use.

Where the user sets no K it is that of equation (12), or follows the code's own rule.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ...array_types import Array
from ..closed_forms.dashpot import force_restitution, limited_restitution
from ..evidence import not_verified, seen
from ..model import ForceModel, Parameter
from ..powers import power, powers
from .aliases import in_code, same_law
from .asymmetric import JANKOWSKI_2006, approach_dashpot
from .cited_sources import (
    IMPACT_MATERIAL,
    MAPLESIM_HELP,
    MBDYN,
    MODIA3D_DOCUMENTATION,
    OPENSEES_HERTZDAMP,
    OPENSEES_JANKOWSKI,
    SIMBODY,
)
from .dashpot import KELVIN_VOIGT_NO_TENSION, damping
from .elastoplastic import MUTHUKUMAR_2003
from .hysteresis import (
    CARVALHO_MARTINS_2019,
    FLORES_2011,
    GONTHIER_2004,
    HUNT_CROSSLEY_1975,
    LANKARANI_NIKRAVESH_1990,
    flores_chi,
    hysteresis,
)

code_law, code_hysteresis = partial(ForceModel, family="codes"), partial(hysteresis, family="codes")


def springs_in_series(k1: Array, k2: Array) -> Array:
    """Compute the stiffness of two springs in series."""
    return k1 * k2 / (k1 + k2)


def smooth_step(t: Array) -> Array:
    """Compute the cubic from 0 at t = 0 to 1 at t = 1, with zero slope at both; 1 beyond."""
    t = np.minimum(t, 1.0)
    return t * t * (3.0 - 2.0 * t)


ADAMS_IMPACT = code_law(
    key="adams-impact",
    title="Adams IMPACT; MotionSolve and SolidWorks Motion",
    year=1990,
    equation="F = max(0, K δⁿ + c s(δ/d) δ̇),  s(t) = t²(3 − 2t) to t = 1, then 1",
    reference="MSC Adams, function IMPACT; MotionSolve and SolidWorks Motion have it too",
    evidence=seen(
        "the SolidWorks help, r_function_impact (2012 to 2025); the Adams help, functions IMPACT and STEP",
        note="the cubic follows from the words of the help, cubic and with continuous slopes; its year was not "
        "seen",
    ),
    parameters=(
        damping("c", "N s/m", "largest damping"),
        Parameter("d", "m", "penetration at which the damping is full", least=1e-9),
    ),
    # below n = 2 the damping vanishes faster than the spring as δ goes to zero, which then pushes once more
    force=lambda elastic, x, v, c, d: np.maximum(elastic + c * smooth_step(x / d) * v, 0),
    # the second one is where the force becomes zero or positive; it is divided by the spring force to stay finite
    breakpoints=(lambda d: d, lambda elastic, x, v, c, d: 1 + c * smooth_step(x / d) * v / elastic),
)

RECURDYN_EVIDENCE = not_verified(
    "the RecurDyn help and FAQ name k, c, m₁, m₂ and m₃, but show the formula as a picture that was not stored",
    note="its first year was not seen",
)

RECURDYN = code_hysteresis(
    "recurdyn",
    title="RecurDyn",
    year=2000,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = c v₀/K",
    reference="FunctionBay RecurDyn, standard contact, with the damping exponents m₂ = 1 and m₃ = m₁",
    evidence=RECURDYN_EVIDENCE,
    parameters=(damping("c", "N s/m^(n+1)", "damping coefficient"),),
    chi=lambda c, v0, K: c * v0 / K,
)

RECURDYN_EXPONENTS = code_law(
    key="recurdyn-exponents",
    title="RecurDyn, free exponents",
    year=2000,
    equation="F = K δⁿ + c sgn(δ̇)|δ̇|^m₂ δ^m₃",
    reference="FunctionBay RecurDyn, standard contact, whose stiffness exponent m₁ is n",
    evidence=RECURDYN_EVIDENCE,
    parameters=(
        damping("c", "N s^damping_exponent/m^(damping_exponent+indentation_exponent)", "damping coefficient"),
        Parameter("damping_exponent", "1", "damping exponent m₂, of δ̇", 1.0, 1.0, 4.0),
        Parameter("indentation_exponent", "1", "indentation exponent m₃, of δ", 1.0, 0.0, 10.0),
    ),
    force=lambda elastic, x, v, c, damping_exponent, indentation_exponent: (
        elastic + c * np.sign(v) * powers(np.abs(v), damping_exponent) * powers(x, indentation_exponent)
    ),
    coordinate_power=4,
)


def simbody_stiffness(E1: Array, E2: Array, nu1: Array, nu2: Array, R_eff: Array) -> Array:
    """K of Simbody, which combines the plane strain moduli by their powers 2/3."""
    k1, k2 = power(E1 / (1 - nu1 * nu1), 2 / 3), power(E2 / (1 - nu2 * nu2), 2 / 3)
    return 4 / 3 * np.sqrt(R_eff) * springs_in_series(k1, k2) ** 1.5


def simbody_dissipation(c1: Array, c2: Array, E1: Array, E2: Array, nu1: Array, nu2: Array) -> Array:
    """Compute the dissipation of a pair: that of each body is weighted by the stiffness of the other."""
    k1, k2 = power(E1 / (1 - nu1 * nu1), 2 / 3), power(E2 / (1 - nu2 * nu2), 2 / 3)
    return (c1 * k2 + c2 * k1) / (k1 + k2)


SIMBODY_HUNT_CROSSLEY = code_hysteresis(
    "simbody-hunt-crossley",
    title="Simbody and OpenSim HuntCrossleyForce (2010 to 2026)",
    year=2010,
    equation="F = K δ^(3/2) (1 + χ δ̇/v₀),  χ = (3/2) c v₀;  K = (4/3) √R* (k₁ k₂/(k₁ + k₂))^(3/2),  "
    "k = (E/(1 − ν²))^(2/3)",
    reference="Sherman MA, Seth A, Delp SL (2011) Simbody: multibody dynamics for biomedical research. Procedia "
    "IUTAM 2, 241",
    doi="10.1016/j.piutam.2011.04.023",
    evidence=seen(SIMBODY, doi="simbody/simbody, CONTRIBUTING.md @f312d0dd (2026)"),
    parameters=(damping("c", "s/m", "dissipation of the pair, the slope of e over a small speed"),),
    exponent=1.5,
    chi=lambda c, v0: 1.5 * c * v0,
    stiffness=simbody_stiffness,
)

SIMBODY_HUNT_CROSSLEY_MIXED = replace(
    SIMBODY_HUNT_CROSSLEY,
    key="simbody-hunt-crossley-mixed",
    title="Simbody and OpenSim HuntCrossleyForce, two materials (2010 to 2026)",
    equation="F = K δ^(3/2) (1 + χ δ̇/v₀),  χ = (3/2) c v₀,  c = (c₁ k₂ + c₂ k₁)/(k₁ + k₂);  "
    "K = (4/3) √R* (k₁ k₂/(k₁ + k₂))^(3/2),  k = (E/(1 − ν²))^(2/3)",
    parameters=(
        damping("c1", "s/m", "dissipation of the material of ball 1"),
        Parameter("c2", "s/m", "dissipation of the material of ball 2", least=0.0),
    ),
    coefficients={
        "chi": lambda c1, c2, E1, E2, nu1, nu2, v0: 1.5 * simbody_dissipation(c1, c2, E1, E2, nu1, nu2) * v0
    },
)

POINT_STIFFNESS = (
    Parameter("k1", "N/m", "point stiffness k₁ of ball 1, where no K is given", default=1e6, least=1e-9),
    Parameter("k2", "N/m", "point stiffness k₂ of ball 2", default=1e6, least=1e-9),
)

DRAKE_POINT_CONTACT = code_hysteresis(
    "drake-point-contact",
    title="Drake, point contact (defaults since v1.36.0, December 2024)",
    year=2019,
    equation="F = K δ (1 + χ δ̇/v₀),  χ = d v₀;  K = k₁ k₂/(k₁ + k₂)",
    reference="Drake, contact_model_doxygen.h, and the defaults of SceneGraphConfig since v1.36.0 (December 2024)",
    evidence=seen(
        "RobotLocomotion/drake, multibody/plant/contact_model_doxygen.h and geometry/scene_graph_config.h "
        "@be259df724 (2026)",
        note="of the discrete approximations TAMSI, SIMILAR and LAGGED in the limit of small steps; SAP has "
        "another law",
    ),
    parameters=(
        damping("d", "s/m", "Hunt-Crossley dissipation of the pair", default=50.0),
        *POINT_STIFFNESS,
    ),
    exponent=1.0,
    chi=lambda d, v0: d * v0,
    stiffness=springs_in_series,
)

DRAKE_POINT_CONTACT_MIXED = replace(
    DRAKE_POINT_CONTACT,
    key="drake-point-contact-mixed",
    title="Drake, point contact of two materials (defaults since v1.36.0, December 2024)",
    equation="F = K δ (1 + χ δ̇/v₀),  χ = d v₀,  d = (k₂ d₁ + k₁ d₂)/(k₁ + k₂);  K = k₁ k₂/(k₁ + k₂)",
    parameters=(
        damping("d1", "s/m", "Hunt-Crossley dissipation d₁ of ball 1", default=50.0),
        Parameter("d2", "s/m", "Hunt-Crossley dissipation d₂ of ball 2", default=50.0, least=0.0),
        *POINT_STIFFNESS,
    ),
    coefficients={"chi": lambda d1, d2, k1, k2, v0: (k2 * d1 + k1 * d2) / (k1 + k2) * v0},
)

MODELICA_ELASTOGAP = code_law(
    key="modelica-elastogap",
    title="Modelica ElastoGap (state of 2026)",
    year=2008,
    equation="F = max(0, K δⁿ + min(d δ̇, K δⁿ))",
    reference="Modelica Standard Library, Mechanics.Translational.Components.ElastoGap",
    evidence=seen(
        "modelica/ModelicaStandardLibrary, Modelica/Mechanics/Translational/Components/ElastoGap.mo @b756f9deed "
        "(2026)",
        note="its first year was not seen",
    ),
    parameters=(damping("d", "N s/m", "damping constant"),),
    force=lambda elastic, v, d: elastic + np.minimum(d * v, elastic),
    breakpoints=(lambda elastic, v, d: np.where(v > 0, elastic - d * v, np.nan),),
    release="force",
)

MAPLESIM_EVIDENCE = seen(MAPLESIM_HELP, note="its first year was not seen")
MAPLESIM_LINEAR = same_law(
    KELVIN_VOIGT_NO_TENSION,
    "maplesim-linear",
    title="MapleSim, linear",
    year=2015,
    reference="MapleSim, contact of the linear spring and damper",
    evidence=MAPLESIM_EVIDENCE,
    family="codes",
)

MAPLESIM_LIMITED = replace(
    MODELICA_ELASTOGAP,
    key="maplesim-linear-limited",
    title="MapleSim, linear with limited damper",
    year=2015,
    equation="F = max(0, K δ + min(d δ̇, K δ))",
    reference="MapleSim, contact of the linear spring with a limited damper, its default",
    evidence=MAPLESIM_EVIDENCE,
    oracle=lambda d, m, K: limited_restitution(d / (2 * np.sqrt(m * K))),
    exponent=1.0,
)

MODIA3D = "ModiaSim/Modia3D.jl, src/Composition/responseCalculation/elasticCollisionResponse.jl"
SMALL_SPEED = Parameter("vs", "m/s", "speed v_s up to which e is reduced", default=0.01, least=1e-9)

MODIA3D_PRESENT = code_hysteresis(
    "modia3d",
    title="Modia3D (v0.6.0 to v0.12.3, since February 2022)",
    year=2022,
    equation="F = K δ^(3/2) (1 + χ δ̇/v₀),  χ = min(d v₀, 8(1 − ε)/(5ε)),  ε = e where v₀ > v_s, else 0",
    reference="Neumayr A, Otter M (2019) Collision handling with elastic response calculation and zero-crossing "
    "functions. EOOLT '19, 57",
    doi="10.1145/3365984.3365986",
    evidence=seen(
        f"{MODIA3D} @a418027 (v0.12.3, 2026)",
        doi=MODIA3D_DOCUMENTATION,
    ),
    parameters=(SMALL_SPEED, Parameter("d", "s/m", "largest damping", default=2000.0, least=0.0)),
    exponent=1.5,
    chi=lambda e, v0, vs, d: np.minimum(d * v0, flores_chi(np.where(v0 > vs, e, 0.0))),
)

MODIA3D_EXPONENTIAL = replace(
    MODIA3D_PRESENT,
    key="modia3d-exponential",
    title="Modia3D (v0.4.0 to v0.5.2, 2019 to 2021)",
    year=2019,
    equation="F = K δ^(3/2) (1 + χ δ̇/v₀),  χ = min(d v₀, 8(1 − ε)/(5ε) v₀/r),  ε = e + (0.01 − e) "
    "0.01^(v₀/v_s),  r = v₀ from v_s on, below it v_s/3 + (v₀²/v_s)(1 − v₀/(3 v_s))",
    evidence=seen(
        f"{MODIA3D} at v0.4.0 (2019) and v0.5.2 (2021)",
        doi=MODIA3D_DOCUMENTATION,
    ),
    parameters=(SMALL_SPEED, Parameter("d", "s/m", "largest damping", default=1000.0, least=0.0)),
    coefficients={
        "chi": lambda e, v0, vs, d: np.minimum(
            d * v0,
            flores_chi(e + (0.01 - e) * np.exp(np.log(0.01) * v0 / vs)) * v0 / modia3d_regularized_speed(v0, vs),
        )
    },
)


def modia3d_regularized_speed(v0: Array, vs: Array) -> Array:
    """Compute the speed [m/s] that Modia3D divides by, which is at least v_s/3."""
    return np.where(v0 >= vs, v0, v0 * (v0 / vs) * (1 - v0 / (3 * vs)) + vs / 3)


CHRONO_SMC_FLORES = code_hysteresis(
    "chrono-smc-flores",
    title="Chrono SMC, Flores (multicore, since 5.0.0, February 2020)",
    year=2020,
    equation="F = K δ^(3/2) (1 + χ δ̇/v₀),  χ = 8(1 − ε)/(5ε) v₀/v_c,  ε = max(e, 0.01)",
    reference="Project Chrono, ChIterativeSolverMulticoreSMC.cpp; v_c is the characteristic speed, in its "
    "MultiStep mode the larger of it and the speed at contact",
    evidence=seen(
        "projectchrono/chrono, src/chrono_multicore/solver/ChIterativeSolverMulticoreSMC.cpp @7689fbc02d (2026)",
        note="the sequential core has no Flores law and takes that of Hooke instead",
    ),
    parameters=(Parameter("vc", "m/s", "characteristic speed v_c", least=1e-9),),
    exponent=1.5,
    chi=lambda e, v0, vc: flores_chi(np.maximum(e, 0.01)) * v0 / vc,
)

MUJOCO_SOLREF = code_law(
    key="mujoco-solref",
    title="MuJoCo solref, standard format (since 2.1)",
    year=2014,
    equation="F = m(δ/(τ ζ)² + 2 δ̇/τ), to F = 0",
    reference="Todorov E (2014) Convex and analytically-invertible dynamics with contacts and constraints: Theory "
    "and implementation in MuJoCo. ICRA, 6054; documentation of MuJoCo, Modeling, Solver parameters",
    doi="10.1109/ICRA.2014.6907751",
    evidence=seen(
        "google-deepmind/mujoco, doc/modeling.rst and src/engine/engine_core_constraint.c @a7255075b (2026)",
        doi="google-deepmind/mujoco, python/LQR.ipynb @a7255075b",
        note="for a constant impedance, which the default solimp is not, and in the limit of small time steps",
    ),
    parameters=(
        Parameter("timeconst", "s", "time constant τ", default=0.02, least=1e-9),
        Parameter("dampratio", "1", "damping ratio ζ", default=1.0, least=1e-3, is_damping=True),
    ),
    # the spring does not depend on K: a K set by the user only changes the contact's own units
    stiffness=lambda m, timeconst, dampratio: m / (timeconst * timeconst * dampratio * dampratio),
    force=lambda x, v, m, timeconst, dampratio: (
        m * (x / (timeconst * timeconst * dampratio * dampratio) + 2.0 * v / timeconst)
    ),
    oracle=lambda dampratio: force_restitution(dampratio),
    release="force",
    exponent=1.0,
)

MUJOCO_SOLREF_DIRECT = replace(
    MUJOCO_SOLREF,
    key="mujoco-solref-direct",
    title="MuJoCo solref, direct format (since 2.0)",
    year=2018,
    equation="F = m(k δ + b δ̇), to F = 0",
    parameters=(
        Parameter("k", "1/s^2", "stiffness per effective mass, the negative first number of solref", least=1e-9),
        damping("b", "1/s", "damping per effective mass, the negative second number"),
    ),
    stiffness=lambda m, k: m * k,
    force=lambda x, v, m, k, b: m * (k * x + b * v),
    oracle=lambda k, b: force_restitution(b / (2.0 * np.sqrt(k))),
)

SIMSCAPE_CONTACT = code_law(
    key="simscape-contact",
    title="after Simscape Spatial Contact Force (R2019b)",
    year=2019,
    equation="F = max(0, s(δ/w)(K δ + b δ̇)),  s(t) = t²(3 − 2t) to t = 1, then 1",
    reference="MathWorks Simscape Multibody, block Spatial Contact Force, from R2019b on",
    evidence=not_verified(
        "the MathWorks documentation gives no formula for s, only its ends and that they are level",
        note="the cubic and the limit at zero are ours",
    ),
    parameters=(
        damping("b", "N s/m", "damping"),
        Parameter("w", "m", "transition region width", least=1e-9),
    ),
    force=lambda elastic, x, v, b, w: smooth_step(x / w) * (elastic + b * v),
    # the second one is where the force becomes zero: a small damping pulls only where s has nearly vanished
    breakpoints=(lambda w: w, lambda elastic, v, b: elastic + b * v),
    release="force",
    exponent=1.0,
)


def in_mbdyn(law: ForceModel, formulation: str) -> ForceModel:
    """Make a law of the catalogue under its name in MBDyn."""
    return in_code(
        "MBDyn",
        law,
        formulation.replace(" ", "-"),
        f"continuous contact, {formulation} (since 1.5.0)",
        2015,
        f"MBDyn, module-cont-contact, law continuous contact, formulation {formulation}; no damping at a speed of "
        "contact up to EpsPrimeTol, by default 1e-6",
        MBDYN,
        "its first year was not seen",
    )


MBDYN_FLORES = in_mbdyn(FLORES_2011, "flores")
MBDYN_HUNT_CROSSLEY = in_mbdyn(HUNT_CROSSLEY_1975, "hunt crossley")
MBDYN_LANKARANI_NIKRAVESH = in_mbdyn(LANKARANI_NIKRAVESH_1990, "lankarani nikravesh")

CARVALHO_CHI, GONTHIER_CHI = (law.coefficients["chi"] for law in (CARVALHO_MARTINS_2019, GONTHIER_2004))

EXUDYN_CARVALHO_GONTHIER = code_hysteresis(
    "exudyn-carvalho-gonthier",
    title="EXUDYN ObjectContactSphereSphere, impactModel 2 (1.13.6)",
    year=2025,
    equation="F = K δⁿ (1 + χ δ̇/v₀),  χ = (3/2)(1 − e)(11 − e)/(1 + 9e) for e > 1/3, else (1 − e²)/e",
    reference="EXUDYN, ObjectContactSphereSphere, which has carvalho-martins-2019 and gonthier-2004; v₀ is at "
    "least minimumImpactVelocity",
    evidence=seen(
        "jgerstmayr/EXUDYN, main/src/Objects/CObjectContactSphereSphere.cpp @e44aca1b (2026)",
        note="its first year was not seen",
    ),
    # both have 8/3 at e = 1/3
    chi=lambda e: np.where(e > 1 / 3, np.asarray(CARVALHO_CHI(e)), np.asarray(GONTHIER_CHI(e))),
)

NEWTON_SEMI_IMPLICIT = approach_dashpot(
    "newton-semi-implicit",
    title="Newton SolverSemiImplicit and SolverFeatherstone (1.8.0); warp.sim",
    year=2025,
    equation="F = K δ + k_d δ̇, then F = K δ;  e = exp(−ζ acos(ζ)/√(1 − ζ²)),  ζ = k_d/(2 √(K m))",
    reference="Newton, eval_body_contact; K and k_d are the means of ke and kd of both shapes",
    evidence=seen(
        "newton 1.8.0, newton/_src/solvers/semi_implicit/kernels_contact.py",
        note="its year is that of the licence; of warp.sim a copy of its kernel was seen",
    ),
    parameters=(damping("kd", "N s/m", "damping on approach, the mean of kd of both shapes"),),
    zeta=lambda kd, m, K: kd / (2 * np.sqrt(m * K)),
    exponent=1.0,
    family="codes",
)


def in_opensees(law: ForceModel, key: str, title: str, year: int, inputs: str, documented: str) -> ForceModel:
    """Make a law for the pounding of buildings and bridges under the name of its material in OpenSees."""
    file = f"SRC/material/uniaxial/{title.partition(',')[0]}.cpp"
    source = f"OpenSees/OpenSees, {file} @2890cb36f (2026), the force; {documented}"
    return in_code("OpenSees", law, key, title, year, f"OpenSees, {file} by {inputs}", source)


OPENSEES_HERTZDAMP_MATERIAL = in_opensees(
    FLORES_2011,
    "hertzdamp",
    "Hertzdamp, as its documentation recommends (since 2020)",
    2019,
    "PJ Hughes, whose input xiNorm is χ; recommended is 8(1 − e)/(5e)",
    f"{OPENSEES_HERTZDAMP}, the χ it recommends",
)
OPENSEES_JANKOWSKI_IMPACT = in_opensees(
    JANKOWSKI_2006,
    "jankowski-impact",
    "JankowskiImpact, as its documentation recommends (since 2020)",
    2019,
    "PJ Hughes, whose input is ξ",
    f"{OPENSEES_JANKOWSKI}, the ξ it recommends",
)
OPENSEES_IMPACT_MATERIAL = in_opensees(
    MUTHUKUMAR_2003,
    "impact-material",
    "ImpactMaterial, with K₁, K₂ and δ_y of its documentation (since 2008)",
    2008,
    "M Dryden, whose inputs are K₁, K₂ and δ_y",
    f"{IMPACT_MATERIAL}, its inputs",
)
