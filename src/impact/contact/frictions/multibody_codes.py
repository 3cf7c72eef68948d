"""Friction laws of multibody codes: the coefficient of friction is a function of the slip, or a cone."""

from __future__ import annotations

import numpy as np

from ...array_types import Array
from ..evidence import seen
from ..fixed_step import MUJOCO_CONE
from ..friction import FrictionLaw
from ..model import Parameter
from ..models.cited_sources import SIMBODY
from ..models.multibody_codes import MUJOCO_SOLREF, SIMBODY_HUNT_CROSSLEY as SIMBODY_FORCE
from .textbook import limit, optional

DYNAMIC_FRICTION = optional("mu_d", "1", "dynamic coefficient of friction, at most μ, the static one; unset, μ")


def smooth_step(t: Array) -> Array:
    """Compute the polynomial of degree five from 0 at t = 0 to 1 at t = 1, without slope and curvature there."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t * t * t * (10.0 + t * (6.0 * t - 15.0)))


DRAKE_REGULARIZED = FrictionLaw(
    key="drake-regularized",
    title="Drake, continuous plants",
    year=2018,
    equation="f = μ(g) F sgn g,  μ(g) = μ S(y) to y = 1, then μ − (μ − μ_d) S((y − 1)/2) to y = 3, then μ_d,  "
    "y = |g|/v_s,  S(t) = t³(10 − 15 t + 6 t²)",
    reference="Drake, MultibodyPlant with time_step 0",
    kind="regularized",
    evidence=seen(
        "RobotLocomotion/drake, multibody/plant/multibody_plant.cc @b6a7cfc8, StribeckModel, and "
        "multibody_plant_config.h @007f5fc9, the default of v_s",
        note="its first year was not seen",
    ),
    parameters=(
        Parameter("v_s", "m/s", "stiction tolerance, the slip of the largest friction", default=1e-3, least=1e-12),
        DYNAMIC_FRICTION,
        limit("positive"),
    ),
    coefficient=lambda y, ratio: smooth_step(y) - (1.0 - ratio) * smooth_step(0.5 * (y - 1.0)),
)

SIMBODY_HUNT_CROSSLEY = FrictionLaw(
    key="simbody-hunt-crossley",
    title="Simbody and OpenSim HuntCrossleyForce (2010 to 2026)",
    year=2010,
    equation="f = μ(g) F sgn g,  μ(g) = min(y, 1)(μ_d + 2(μ − μ_d)/(1 + y²)) + μ_v |g|,  y = |g|/v_t",
    reference=SIMBODY_FORCE.reference,
    doi=SIMBODY_FORCE.doi,
    kind="regularized",
    evidence=seen(f"{SIMBODY}; also @178eb211", doi=SIMBODY_FORCE.evidence.doi),
    parameters=(
        Parameter(
            "v_t", "m/s", "transition velocity, the slip of the largest friction", default=0.01, least=1e-12
        ),
        DYNAMIC_FRICTION,
        Parameter("mu_v", "s/m", "viscous friction", default=0.0, least=0.0),
        limit("positive"),
    ),
    coefficient=lambda y, ratio, viscous: (
        np.minimum(y, 1.0) * (ratio + 2.0 * (1.0 - ratio) / (1.0 + y * y)) + viscous * y
    ),
)

MUJOCO_ELLIPTIC = FrictionLaw(
    key="mujoco-elliptic",
    title="MuJoCo, elliptic cone, integrator Euler (4.0.0)",
    year=2014,
    equation="f = m b_t g/D,  |f| ≤ μ N,  N = F, where it slips N = max(0, F + μ m b_t |g|)/(1 + μ² D),  "
    "D = d m/m_t + (1 − d)/i,  with the impedance d and i = impratio",
    reference=MUJOCO_SOLREF.reference,
    kind="cone",
    doi=MUJOCO_SOLREF.doi,
    evidence=seen(
        "google-deepmind/mujoco, src/engine/engine_core_constraint.c @00010f58",
        doi=MUJOCO_SOLREF.evidence.doi,
        note="the closed form for one contact was derived from it, and agrees with runs of MuJoCo 4.0.0",
    ),
    parameters=(
        Parameter("impratio", "1", "impedance of friction over that of the contact", default=1.0, least=1e-9),
        Parameter("impedance", "1", "constant impedance d of solimp", default=0.9, least=1e-4, most=0.9999),
        optional(
            "b_t",
            "1/s",
            "damping of solreffriction: 2/timeconst, or its negative second number; unset, as in MuJoCo, that of "
            "solref",
        ),
    ),
    damping="cone",
    scheme=MUJOCO_CONE,
)
