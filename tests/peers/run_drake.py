"""Two spheres on prismatic joints in Drake, with point contact."""

from __future__ import annotations

from importlib.metadata import version

from pydrake.geometry import AddContactMaterial, ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
)
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from runner import serve

APPROXIMATIONS = {
    "tamsi": DiscreteContactApproximation.kTamsi,
    "lagged": DiscreteContactApproximation.kLagged,
    "similar": DiscreteContactApproximation.kSimilar,
    "sap": DiscreteContactApproximation.kSap,
}


def collide(
    scheme: str, k: list[float], d: list[float], m1: float, m2: float, R1: float, R2: float, v1: float, v2: float,
    gap: float, step: float, count: int, tau: tuple[float, float] = (0.0, 0.0),
) -> tuple[float, float]:  # fmt: skip
    discrete = scheme in APPROXIMATIONS
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, step if discrete else 0.0)
    plant.set_contact_model(ContactModel.kPoint)
    if discrete:
        plant.set_discrete_contact_approximation(APPROXIMATIONS[scheme])
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    joints = []
    for i, mass, radius in ((0, m1, R1), (1, m2, R2)):
        body = plant.AddRigidBody(f"body{i}", SpatialInertia.SolidSphereWithMass(mass, radius))
        joints.append(
            plant.AddJoint(PrismaticJoint(f"joint{i}", plant.world_frame(), body.body_frame(), [1, 0, 0]))
        )
        properties = ProximityProperties()
        AddContactMaterial(
            dissipation=d[i], point_stiffness=k[i], friction=CoulombFriction(0, 0), properties=properties
        )
        properties.AddProperty("material", "relaxation_time", tau[i])
        plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(radius), f"sphere{i}", properties)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    for joint, x, speed in zip(joints, (-R1 - gap, R2), (v1, v2), strict=True):
        joint.set_translation(context, x)
        joint.set_translation_rate(context, speed)
    if not discrete:
        ResetIntegratorFromFlags(simulator, scheme, step).set_fixed_step_mode(True)
    simulator.AdvanceTo(count * step)
    return joints[0].get_translation_rate(context), joints[1].get_translation_rate(context)


serve(version("drake"), collide)
