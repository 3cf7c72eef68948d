"""Drake: spheres on planar joints, and a half space as the wall; point contact with the solvers TAMSI and SAP."""

from __future__ import annotations

import math
from typing import Any

# of the closing speed, below which friction is regularized
STICTION = 1e-4
STEPS_BEFORE, CONTACTS = 1, 3.0
# its force is that at the end of a step, which takes energy: e falls by 0.004 with this part of a step
PART_OF_STEP = 0.25


def dissipation(e: float) -> float:
    """Find d v0 of the force k x (1 + d v) that delivers e: y - ln(1 + y) = -e y - ln(1 - e y)."""
    low, high = 1e-9, (1.0 - 1e-15) / e
    for _ in range(200):
        y = (low + high) / 2.0
        low, high = (y, high) if y - math.log1p(y) > -e * y - math.log1p(-e * y) else (low, y)
    return (low + high) / 2.0


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision by TAMSI, with the force k x (1 + d v)."""
    speed = abs(c["v1"] - c["v2"]) or 1.0
    stiffness = (math.pi / c["contact_time"]) ** 2 * effective_mass(c)
    return run(c, "kTamsi", stiffness, dissipation=dissipation(c["e"]) / speed)


def collide_sap(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision by SAP, with the force k (x + t v)."""
    from linear_contact import damping_ratio, half_time

    z = damping_ratio(c["e"])
    frequency = 2.0 * half_time(z) / c["contact_time"]
    # those of both bodies add
    return run(c, "kSap", frequency**2 * effective_mass(c), relaxation_time=z / frequency)


def effective_mass(c: dict[str, Any]) -> float:
    """Effective mass [kg]."""
    m1, m2 = c["m1"], c["m2"]
    return float(m1 if m2 is None else m1 * m2 / (m1 + m2))


def run(c: dict[str, Any], solver: str, stiffness: float, **damping: float) -> dict[str, Any]:
    """Run a collision whose balls touch, side by side, after the first step."""
    from importlib.metadata import version

    from pydrake.geometry import AddContactMaterial, HalfSpace, ProximityProperties, Sphere
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import (
        AddMultibodyPlantSceneGraph,
        ContactModel,
        CoulombFriction,
        DiscreteContactApproximation,
    )
    from pydrake.multibody.tree import PlanarJoint, SpatialInertia, UnitInertia
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    numbers = "1" if c["m2"] is None else "12"
    step, speed = PART_OF_STEP * c["dt"], abs(c["v1"] - c["v2"])
    material = ProximityProperties()
    friction = CoulombFriction(c["mu"], c["mu"])
    # the springs of both bodies are in series
    if "relaxation_time" in damping:
        material.AddProperty("material", "relaxation_time", damping.pop("relaxation_time"))
    AddContactMaterial(point_stiffness=2.0 * stiffness, friction=friction, properties=material, **damping)
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=step)
    plant.set_contact_model(ContactModel.kPoint)
    plant.set_discrete_contact_approximation(getattr(DiscreteContactApproximation, solver))
    plant.set_stiction_tolerance(STICTION * (speed or 1.0))
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    joints = []
    for number in numbers:
        mass, R, inertia = (c[f"{name}{number}"] for name in ("m", "R", "inertia"))
        unit = UnitInertia.TriaxiallySymmetric(inertia / mass)
        body = plant.AddRigidBody(f"ball{number}", SpatialInertia(mass, [0, 0, 0], unit))
        joint = PlanarJoint(f"joint{number}", plant.world_frame(), body.body_frame(), [0, 0, 0])
        joints.append(plant.AddJoint(joint))
        plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(R), f"sphere{number}", material)
    if len(numbers) == 1:
        pose = HalfSpace.MakePose([-1, 0, 0], [0, 0, 0])
        plant.RegisterCollisionGeometry(plant.world_body(), pose, HalfSpace(), "wall", material)
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    before = STEPS_BEFORE * step
    for number, joint, side in zip(numbers, joints, (-1.0, 1.0), strict=False):
        v, u = c[f"v{number}"], c[f"u{number}"]
        joint.set_translation(context, [side * c[f"R{number}"] - v * before, -u * before])
        joint.set_translational_velocity(context, [v, u])
        joint.set_angular_velocity(context, c[f"omega{number}"])
    simulator.AdvanceTo(before + CONTACTS * c["contact_time"])
    answer = {"id": c["id"], "version": version("drake"), "kind": "compliant"}
    for number, joint in zip(numbers, joints, strict=True):
        v, u = joint.get_translational_velocity(context)
        answer |= {f"v{number}": v, f"u{number}": u, f"omega{number}": joint.get_angular_velocity(context)}
    return answer
