"""A sphere and a half space, or a second sphere at rest, in Drake with the discrete solver TAMSI."""

from __future__ import annotations

import math
from importlib.metadata import version

from pydrake.geometry import AddContactMaterial, HalfSpace, ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
)
from pydrake.multibody.tree import PlanarJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from runner import serve


def collide(
    k: float, d: float, mu: float, stiction: float, m1: float, R1: float, v1: float, u1: float, omega1: float,
    gap: float, step: float, count: int, m2: float = math.inf, R2: float = math.inf,
) -> tuple[float, float, float]:  # fmt: skip
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, step)
    plant.set_contact_model(ContactModel.kPoint)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kTamsi)
    plant.set_stiction_tolerance(stiction)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    material = ProximityProperties()
    # the springs act in series
    AddContactMaterial(dissipation=d, point_stiffness=2 * k, friction=CoulombFriction(mu, mu), properties=material)
    balls = [(m1, R1)] if math.isinf(R2) else [(m1, R1), (m2, R2)]
    joints = []
    for i, (mass, radius) in enumerate(balls):
        body = plant.AddRigidBody(f"body{i}", SpatialInertia.SolidSphereWithMass(mass, radius))
        joints.append(plant.AddJoint(PlanarJoint(f"joint{i}", plant.world_frame(), body.body_frame())))
        plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(radius), f"sphere{i}", material)
    if math.isinf(R2):
        pose = HalfSpace.MakePose([-1, 0, 0], [0, 0, 0])
        plant.RegisterCollisionGeometry(plant.world_body(), pose, HalfSpace(), "wall", material)
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    # the normal is along x at the first touch, the tangent along y
    for joint, place, velocity, spin in zip(
        joints, ([-R1 - gap, -u1 * gap / v1], [R2, 0.0]), ([v1, u1], [0.0, 0.0]), (omega1, 0.0), strict=False
    ):
        joint.set_translation(context, place)
        joint.set_translational_velocity(context, velocity)
        joint.set_angular_velocity(context, spin)
    simulator.AdvanceTo(count * step)
    v, u = joints[0].get_translational_velocity(context)
    return v, u, joints[0].get_angular_velocity(context)


serve(version("drake"), collide)
