"""Drake: spheres on planar joints, and a half space as the wall; point contact with the solvers TAMSI and SAP."""

from __future__ import annotations

import math
from typing import Any

SETTINGS = "point contact, TAMSI, dissipation for e at the closing speed, stiction tolerance 1e-4 of it, dt/4"
SETTINGS_SAP = "point contact, SAP, relaxation_time for e, stiction tolerance 1e-4 of the closing speed, dt/4"
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
    return run(c, "kTamsi", math.pi / c["contact_time"], dissipation=dissipation(c["e"]) / speed)


def collide_sap(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision by SAP, with the force k (x + t v)."""
    from two_balls import damping_ratio, half_time

    z = damping_ratio(c["e"])
    frequency = 2.0 * half_time(z) / c["contact_time"]
    # those of both bodies add
    return run(c, "kSap", frequency, relaxation_time=z / frequency)


def run(c: dict[str, Any], solver: str, frequency: float, **damping: float) -> dict[str, Any]:
    """Run a collision whose balls touch, side by side, after the first step."""
    import pydrake.all as drake
    from two_balls import answer_of, balls_of, harmonic

    balls = balls_of(c)
    stiffness = frequency**2 * harmonic(ball.m for ball in balls)
    step, speed = PART_OF_STEP * c["dt"], abs(c["v1"] - c["v2"])
    material = drake.ProximityProperties()
    friction = drake.CoulombFriction(c["mu"], c["mu"])
    # the springs of both bodies are in series
    if "relaxation_time" in damping:
        material.AddProperty("material", "relaxation_time", damping.pop("relaxation_time"))
    drake.AddContactMaterial(point_stiffness=2.0 * stiffness, friction=friction, properties=material, **damping)
    builder = drake.DiagramBuilder()
    plant, _ = drake.AddMultibodyPlantSceneGraph(builder, time_step=step)
    plant.set_contact_model(drake.ContactModel.kPoint)
    plant.set_discrete_contact_approximation(getattr(drake.DiscreteContactApproximation, solver))
    plant.set_stiction_tolerance(STICTION * (speed or 1.0))
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    joints = []
    for ball in balls:
        unit = drake.UnitInertia.TriaxiallySymmetric(ball.inertia / ball.m)
        body = plant.AddRigidBody(f"ball{ball.number}", drake.SpatialInertia(ball.m, [0, 0, 0], unit))
        joint = drake.PlanarJoint(f"joint{ball.number}", plant.world_frame(), body.body_frame(), [0, 0, 0])
        joints.append(plant.AddJoint(joint))
        pose = drake.RigidTransform()
        plant.RegisterCollisionGeometry(body, pose, drake.Sphere(ball.R), f"sphere{ball.number}", material)
    if len(balls) == 1:
        pose = drake.HalfSpace.MakePose([-1, 0, 0], [0, 0, 0])
        plant.RegisterCollisionGeometry(plant.world_body(), pose, drake.HalfSpace(), "wall", material)
    plant.Finalize()
    simulator = drake.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    before = STEPS_BEFORE * step
    for ball, joint in zip(balls, joints, strict=True):
        joint.set_translation(context, ball.start(before))
        joint.set_translational_velocity(context, [ball.v, ball.u])
        joint.set_angular_velocity(context, ball.omega)
    simulator.AdvanceTo(before + CONTACTS * c["contact_time"])
    motions = (
        (*joint.get_translational_velocity(context), joint.get_angular_velocity(context)) for joint in joints
    )
    return answer_of(c, motions, "compliant")
