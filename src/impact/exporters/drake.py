"""Drake, point contact with the discrete solver TAMSI."""

from __future__ import annotations

from .code import Code, Collision, Lines, Parameters
from .programs import python_package

# slip over the closing speed below which TAMSI takes less friction than mu N
STICTION = 1e-5
# the normal is along x, the tangent along y, so that spins are about z
TEMPLATE = """\
{% set joint_class = "PlanarJoint" if has_friction else "PrismaticJoint" %}
from pydrake.geometry import AddContactMaterial, {{ "HalfSpace, " if has_wall else "" }}ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
)
from pydrake.multibody.tree import {{ joint_class }}, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

builder = DiagramBuilder()
{{ lines }}
plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
joints = []
for ball, m, R, material in {{ tuples("number", "m", "R", "material") }}:
    body = plant.AddRigidBody(f"ball{ball}", SpatialInertia.SolidSphereWithMass(m, R))
{% set axis = "" if has_friction else ", [1, 0, 0]" %}
    joint = {{ joint_class }}(f"joint{ball}", plant.world_frame(), body.body_frame(){{ axis }})
    joints.append(plant.AddJoint(joint))
    plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(R), f"sphere{ball}", material)
{% if has_wall %}
pose = HalfSpace.MakePose([-1, 0, 0], [0, 0, 0])
plant.RegisterCollisionGeometry(plant.world_body(), pose, HalfSpace(), "wall", {{ material2 }})
{% endif %}
plant.Finalize()
simulator = Simulator(builder.Build())
context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
{% if has_friction %}
for joint, xy, v, omega in zip(
    joints, {{ tuples("x", "y") }}, {{ tuples("v", "u") }}, {{ tuples("omega") }}
):
    joint.set_translation(context, xy)
    joint.set_translational_velocity(context, v)
    joint.set_angular_velocity(context, omega)
simulator.AdvanceTo({{ steps }} * {{ dt }})
{% set speeds_of_wall = "(" ~ v2 ~ ", " ~ u2 ~ ")" %}
(v1, u1), (v2, u2) = {{ each("joint.get_translational_velocity(context)", "joint in joints", speeds_of_wall) }}
omega1, omega2 = {{ each("joint.get_angular_velocity(context)", "joint in joints", "0.0") }}
{% else %}
for joint, x, v in zip(joints, {{ tuples("x") }}, {{ tuples("v") }}):
    joint.set_translation(context, x)
    joint.set_translation_rate(context, v)
simulator.AdvanceTo({{ steps }} * {{ dt }})
v1, v2 = {{ each("joint.get_translation_rate(context)", "joint in joints", v2) }}
{% endif %}
{{ print_beta }}print("e_out =", (v2 - v1) / {{ v0 }})
"""


def parameters(c: Collision) -> dict[str, float | str]:
    """Point stiffness [N/m] and dissipation [s/m] of each ball; those of one where both are the same.

    The stiffnesses act in series. A stiffness of the contact that the user sets replaces theirs, at their ratio.
    """
    k1, k2 = c["k1"], c["k2"]
    if c.has_user_stiffness:
        k1, k2 = c["K"] * (1.0 + k1 / k2), c["K"] * (1.0 + k2 / k1)
    if c.model.key == "drake-point-contact":
        d1 = d2 = c["d"]
    else:
        d1, d2 = c["d1"], c["d2"]
    values: dict[str, float | str] = {"point_stiffness1": k1, "dissipation1": d1}
    if c.friction:
        values |= {"friction": c["mu"], "stiction_tolerance": STICTION * c["v0"]}
    return values if (k1, d1) == (k2, d2) else {**values, "point_stiffness2": k2, "dissipation2": d2}


def lines(collision: Collision, parameters: Parameters) -> Lines:
    mu = parameters.get("friction", 0.0)
    for ball in ("1", "2") if "point_stiffness2" in parameters else ("1",):
        yield f"material{ball} = ProximityProperties()"
        yield "AddContactMaterial("
        yield f"    dissipation={parameters[f'dissipation{ball}']!r},"
        yield f"    point_stiffness={parameters[f'point_stiffness{ball}']!r},"
        yield f"    friction=CoulombFriction({mu}, {mu}),"
        yield f"    properties=material{ball},"
        yield ")"
    yield f"plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step={collision.dt!r})"
    yield "plant.set_contact_model(ContactModel.kPoint)"
    yield "plant.set_discrete_contact_approximation(DiscreteContactApproximation.kTamsi)"
    if collision.friction:
        yield f"plant.set_stiction_tolerance({parameters['stiction_tolerance']!r})"


def notes(collision: Collision) -> Lines:
    return [
        "point_stiffness [N/m] is of one ball, two equal balls act with half of it; dissipation is in s/m",
        "two materials: k = k1 k2/(k1 + k2), dissipation d = (k2 d1 + k1 d2)/(k1 + k2)",
        "unset, dissipation is 50 s/m and point_stiffness 1e6 N/m (since 1.36.0): 50 s/m is e = 0.02 at 1 m/s",
        "unset, the contact model is hydroelastic with fallback: point_stiffness holds only where it falls back",
        "unset, the approximation is LAGGED, which gives the same restitution",
        "SAP has relaxation_time instead of dissipation; unset it is 0.1 s for each ball, which stops any rebound",
        "the force is that at the end of the step, never negative; each step takes energy, so that e is smaller",
        "time_step=0 with the integrator semi_explicit_euler loses less: impact timestep --scheme kick-drift",
        "below the stiction tolerance, 1e-5 of the closing speed here, 1e-3 m/s unset, friction is less than mu N"
        if collision.friction
        else "no friction: replace CoulombFriction(0, 0) by yours; unset, both coefficients are 0.5",
    ]


def warnings(collision: Collision) -> Lines:
    if collision.friction:
        yield (
            "friction only with TAMSI: at 12 steps, mu = 0.3, 80 degrees friction changed e_out of SAP from 0.114 "
            "to 0.826, of SIMILAR from 0.607 to 0.656, and beta of LAGGED differed by 0.012"
        )


CODE = Code(
    title="Drake",
    laws={
        "drake-point-contact": "point contact, one material",
        "drake-point-contact-mixed": "point contact, two materials",
    },
    newest="1.51.1",
    tested="scripts were run in Drake 1.51.1, TAMSI",
    scheme="drake-tamsi",
    parameters=parameters,
    lines=lines,
    notes=notes,
    warnings=warnings,
    template=TEMPLATE,
    frictions={"coulomb-1785": "CoulombFriction, TAMSI"},
    shortens_arms=True,
    program=python_package("drake"),
)
