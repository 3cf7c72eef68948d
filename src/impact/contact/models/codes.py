"""Laws of engineering codes, in the parameters that those codes use.

Where no K is given it is that of equation (12), or by the code's own rule.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..formula import Formula
from ..model import ForceModel, Parameter
from ..oracles import force_restitution, limited_restitution
from ..power import Array, power, powers
from .hysteresis import hysteresis

LINEAR_DAMPING = "F = K δⁿ (1 + χ δ̇/v₀)"


def of_code(law: ForceModel, stiffness: Formula | None = None) -> ForceModel:
    """A law of some form as that of a code, with its rule for K."""
    return replace(law, family="codes", stiffness=stiffness)


def series(a: Array, b: Array) -> Array:
    """Two springs, one behind the other."""
    return a * b / (a + b)


def step(t: Array) -> Array:
    """The cubic from 0 at 0 to 1 at 1, level at both."""
    t = np.minimum(t, 1.0)
    return t * t * (3.0 - 2.0 * t)


ADAMS_IMPACT = ForceModel(
    key="adams-impact",
    title="Adams IMPACT",
    year=1990,
    equation="F = max(0, K δⁿ + c s(δ/d) δ̇),  s(t) = t²(3 − 2t) to t = 1, then 1",
    reference="MSC Adams, function IMPACT; so have MotionSolve and SolidWorks Motion",
    evidence="formula seen in the documentation of all three; no DOI",
    parameters=(
        Parameter("c", "N s/m", "largest damping", least=0.0),
        Parameter("d", "m", "penetration at which the damping is full", least=1e-9),
    ),
    # below n = 2 the spring outlasts the damping as the gap closes, and pushes once more after the force was zero
    force=lambda elastic, x, v, c, d: np.maximum(elastic + c * step(x / d) * v, 0),
    # where the force begins or ceases to be zero; over the spring, so that it does not fade with the indentation
    bends=(lambda d: d, lambda elastic, x, v, c, d: 1 + c * step(x / d) * v / elastic),
    family="codes",
)

RECURDYN = of_code(
    hysteresis(
        "recurdyn",
        title="RecurDyn",
        year=2000,
        equation=f"{LINEAR_DAMPING},  χ = c v₀/K",
        reference="FunctionBay RecurDyn, standard contact, with the damping exponents m₂ = 1 and m₃ = m₁",
        evidence="names of the parameters seen in the documentation, formula from memory; no DOI",
        parameters=(Parameter("c", "N s/m^(n+1)", "damping coefficient", least=0.0),),
        chi=lambda c, v0, K: c * v0 / K,
    )
)

RECURDYN_EXPONENTS = ForceModel(
    key="recurdyn-exponents",
    title="RecurDyn, free exponents",
    year=2000,
    equation="F = K δⁿ + c sgn(δ̇)|δ̇|^m₂ δ^m₃",
    reference="FunctionBay RecurDyn, standard contact, whose stiffness exponent m₁ is n",
    evidence="names of the parameters seen in the documentation, formula from memory; no DOI",
    parameters=(
        Parameter(
            "c", "N s^damping_exponent/m^(damping_exponent+indentation_exponent)", "damping coefficient", least=0.0
        ),
        Parameter("damping_exponent", "1", "damping exponent m₂, of δ̇", 1.0, 1.0, 4.0),
        Parameter("indentation_exponent", "1", "indentation exponent m₃, of δ", 1.0, 0.0, 10.0),
    ),
    force=lambda elastic, x, v, c, damping_exponent, indentation_exponent: (
        elastic + c * np.sign(v) * powers(np.abs(v), damping_exponent) * powers(x, indentation_exponent)
    ),
    smooth=4,
    family="codes",
)

SIMBODY_HUNT_CROSSLEY = of_code(
    hysteresis(
        "simbody-hunt-crossley",
        title="Simbody and OpenSim HuntCrossleyForce",
        year=2008,
        equation="F = K δ^(3/2) (1 + χ δ̇/v₀),  χ = (3/2) c v₀",
        reference="Sherman MA, Seth A, Delp SL (2011) Simbody: multibody dynamics for biomedical research. "
        "Procedia IUTAM 2, 241",
        evidence="formula seen in the source, which mixes materials by powers 2/3 of their moduli; that these are "
        "those of plane strain, E/(1 − ν²), from memory; no DOI known",
        parameters=(Parameter("c", "s/m", "dissipation, the slope of e over a small speed", least=0.0),),
        exponent=1.5,
        chi=lambda c, v0: 1.5 * c * v0,
    ),
    stiffness=lambda E1, E2, nu1, nu2, R1, R2: (
        4
        / 3
        * np.sqrt(1 / (1 / R1 + 1 / R2))
        * series(power(E1 / (1 - nu1 * nu1), 2 / 3), power(E2 / (1 - nu2 * nu2), 2 / 3)) ** 1.5
    ),
)

DRAKE_POINT_CONTACT = of_code(
    hysteresis(
        "drake-point-contact",
        title="Drake, point contact",
        year=2019,
        equation="F = K δ (1 + χ δ̇/v₀),  χ = d v₀",
        reference="Drake, module contact_model_doxygen.h, and the defaults of SceneGraphConfig",
        evidence="formula seen in the source; no DOI",
        parameters=(
            Parameter("d", "s/m", "Hunt-Crossley dissipation of the pair", default=20.0, least=0.0),
            Parameter("k1", "N/m", "point stiffness k₁ of ball 1, where no K is given", default=1e6, least=1e-9),
            Parameter("k2", "N/m", "point stiffness k₂ of ball 2", default=1e6, least=1e-9),
        ),
        exponent=1.0,
        chi=lambda d, v0: d * v0,
    ),
    stiffness=lambda k1, k2: series(k1, k2),
)

MODELICA_ELASTOGAP = ForceModel(
    key="modelica-elastogap",
    title="Modelica ElastoGap",
    year=2008,
    equation="F = max(0, K δⁿ + min(d δ̇, K δⁿ))",
    reference="Modelica Standard Library, Mechanics.Translational.Components.ElastoGap",
    evidence="formula seen in the source; no DOI",
    parameters=(Parameter("d", "N s/m", "damping constant", least=0.0),),
    force=lambda elastic, v, d: elastic + np.minimum(d * v, elastic),
    bends=(lambda elastic, v, d: np.where(v > 0, elastic - d * v, np.nan),),
    release="force",
    family="codes",
)

MAPLESIM_LIMITED = ForceModel(
    key="maplesim-linear-limited",
    title="MapleSim, linear with limited damper",
    year=2015,
    equation="F = max(0, K δ + min(d δ̇, K δ))",
    reference="MapleSim, contact of the linear spring with a limited damper",
    evidence="that the damping is limited by the spring was seen in the documentation, the formula is that of "
    "modelica-elastogap; no DOI",
    parameters=(Parameter("d", "N s/m", "damping constant", least=0.0),),
    force=lambda elastic, v, d: elastic + np.minimum(d * v, elastic),
    bends=(lambda elastic, v, d: np.where(v > 0, elastic - d * v, np.nan),),
    oracle=lambda d, m, K: limited_restitution(d / (2 * np.sqrt(m * K))),
    release="force",
    exponent=1.0,
    family="codes",
)

MODIA3D = of_code(
    hysteresis(
        "modia3d",
        title="Modia3D",
        year=2018,
        equation="F = K δ^(3/2) (1 + χ δ̇/v₀),  χ = min(d v₀, 8(1 − ε)/(5ε)),  ε = e + (0.01 − e) 0.01^(v₀/v_s)",
        reference="Neumayr A, Otter M (2018) Collision handling with elastic response calculation in Modia3D; "
        "source",
        evidence="formula seen in the source; the default of v_s from memory; no DOI",
        domain={"e": (0.0, 1.0)},
        parameters=(
            Parameter("vs", "m/s", "speed v_s below which e falls to 0.01", default=0.01, least=1e-9),
            Parameter("d", "s/m", "largest damping", default=1000.0, least=0.0),
        ),
        exponent=1.5,
        chi=lambda e, v0, vs, d: np.minimum(d * v0, flores(e + (0.01 - e) * np.exp(np.log(0.01) * v0 / vs))),
    )
)

CHRONO_SMC_FLORES = of_code(
    hysteresis(
        "chrono-smc-flores",
        title="Chrono SMC, Flores",
        year=2019,
        equation="F = K δ^(3/2) (1 + χ δ̇/v₀),  χ = 8(1 − ε)/(5ε) v₀/v_c,  ε = max(e, 0.01)",
        reference="Project Chrono, multicore, ChSystemMulticoreSMC; v_c is the speed at contact in its MultiStep "
        "mode only",
        evidence="formula seen in the source; no DOI",
        parameters=(Parameter("vc", "m/s", "characteristic speed v_c", least=1e-9),),
        exponent=1.5,
        chi=lambda e, v0, vc: flores(np.maximum(e, 0.01)) * v0 / vc,
    )
)


def flores(e: Array) -> Array:
    """χ of Flores and others (2011)."""
    return np.asarray(8.0 * (1.0 - e) / (5.0 * e))


MUJOCO_SOLREF = ForceModel(
    key="mujoco-solref",
    title="MuJoCo solref",
    year=2014,
    equation="F = m(δ/(τ ζ)² + 2 δ̇/τ), to F = 0",
    reference="Todorov E (2014) Convex and analytically-invertible dynamics with contacts and constraints. ICRA; "
    "documentation of MuJoCo",
    evidence="formula from memory; for a constant impedance and in continuous time, a time step changes it; no "
    "DOI",
    parameters=(
        Parameter("timeconst", "s", "time constant τ", default=0.02, least=1e-9),
        Parameter("dampratio", "1", "damping ratio ζ", default=1.0, least=1e-3),
    ),
    # a spring of its own: K sets no more than the units
    force=lambda x, v, m, timeconst, dampratio: (
        m * (x / (timeconst * timeconst * dampratio * dampratio) + 2.0 * v / timeconst)
    ),
    oracle=lambda dampratio: force_restitution(dampratio),
    release="force",
    exponent=1.0,
    family="codes",
)

SIMSCAPE_CONTACT = ForceModel(
    key="simscape-contact",
    title="Simscape Spatial Contact Force",
    year=2020,
    equation="F = max(0, s(δ/w)(K δ + b δ̇)),  s(t) = t²(3 − 2t) to t = 1, then 1",
    reference="MathWorks Simscape Multibody, block Spatial Contact Force",
    evidence="the documentation seen, formula from memory; no DOI",
    parameters=(
        Parameter("b", "N s/m", "damping", least=0.0),
        Parameter("w", "m", "transition region width", least=1e-9),
    ),
    force=lambda elastic, x, v, b, w: step(x / w) * (elastic + b * v),
    bends=(lambda w: w,),
    release="force",
    exponent=1.0,
    family="codes",
)
