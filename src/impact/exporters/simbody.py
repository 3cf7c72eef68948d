"""Simbody, by the HuntCrossleyForce of OpenSim."""

from __future__ import annotations

from .code import Code, Collision, Lines, Parameters
from .programs import python_package

TEMPLATE = '''\
import opensim

opensim.Logger.setLevelString("Error")
# Python has no class for the parameters of one sphere
with open("contact.xml", "w") as file:
    file.write("""<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
<HuntCrossleyForce name="contact">
<HuntCrossleyForce::ContactParametersSet name="contact_parameters">
<objects>
{{ lines }}
</objects>
</HuntCrossleyForce::ContactParametersSet>
<transition_velocity>1</transition_velocity>
</HuntCrossleyForce>
</OpenSimDocument>
""")
contact = opensim.HuntCrossleyForce.safeDownCast(opensim.OpenSimObject.makeObjectFromFile("contact.xml"))
model = opensim.Model()
model.setGravity(opensim.Vec3(0))
joints = []
for name, mass, radius, x, speed in (
{% for ball in balls %}
    ("{{ ball.number }}", {{ ball.m }}, {{ ball.R }}, {{ ball.x }}, {{ ball.v }}),
{% endfor %}
):
    body = opensim.Body("body" + name, mass, opensim.Vec3(0), opensim.Inertia({{ solid }} * mass * radius**2))
    joint = opensim.SliderJoint("joint" + name, model.getGround(), body)
    joint.updCoordinate().setDefaultValue(x)
    joint.updCoordinate().setDefaultSpeedValue(speed)
    sphere = opensim.ContactSphere(radius, opensim.Vec3(0), body, "sphere" + name)
    model.addBody(body)
    model.addJoint(joint)
    model.addContactGeometry(sphere)
    joints.append(joint)
{% if has_wall %}
{# it is where x > 0 #}
wall = opensim.ContactHalfSpace(opensim.Vec3(0), opensim.Vec3(0), model.getGround(), "wall")
model.addContactGeometry(wall)
{% endif %}
model.addForce(contact)
state = model.initSystem()
manager = opensim.Manager(model)
manager.setIntegratorMethod(opensim.Manager.IntegratorMethod_RungeKutta3)
manager.setIntegratorFixedStepSize({{ dt }})
manager.initialize(state)
state = manager.integrate({{ steps }} * {{ dt }})
v1, v2 = {{ each("joint.getCoordinate().getSpeedValue(state)", "joint in joints", v2) }}
print("e_out =", (v2 - v1) / {{ v0 }})
'''


def parameters(c: Collision) -> dict[str, float | str]:
    """Write stiffness and dissipation of each sphere; the stiffness is the modulus of plane strain."""
    c.require_materials("Simbody takes the moduli of both spheres")
    values: dict[str, float | str] = {}
    for i in (1, 2):
        values[f"stiffness{i}"] = c[f"E{i}"] / (1.0 - c[f"nu{i}"] ** 2)
        values[f"dissipation{i}"] = c[f"c{i}"] if c.model.key == "simbody-hunt-crossley-mixed" else c["c"]
    return values


def lines(collision: Collision, parameters: Parameters) -> Lines:
    for i in (1, 2):
        yield "<HuntCrossleyForce::ContactParameters>"
        yield f"  <geometry>{'wall' if i == 2 and collision.has_wall else f'sphere{i}'}</geometry>"
        yield f"  <stiffness>{parameters[f'stiffness{i}']!r}</stiffness>"
        yield f"  <dissipation>{parameters[f'dissipation{i}']!r}</dissipation>"
        yield "  <static_friction>0</static_friction>"
        yield "  <dynamic_friction>0</dynamic_friction>"
        yield "  <viscous_friction>0</viscous_friction>"
        yield "</HuntCrossleyForce::ContactParameters>"


def notes(collision: Collision) -> Lines:
    yield "in SI; stiffness is the modulus of plane strain E/(1 - nu^2) of a sphere, not E and not K"
    yield "dissipation is c of F = K x^1.5 (1 + 1.5 c v), in s/m: the restitution depends on the speed"
    yield "two materials: c = (c1 k2 + c2 k1)/(k1 + k2), where k1 and k2 are the stiffnesses to the power 2/3"
    yield "the force is never negative"


CODE = Code(
    title="Simbody in OpenSim",
    laws={
        "simbody-hunt-crossley": "HuntCrossleyForce, equal materials",
        "simbody-hunt-crossley-mixed": "HuntCrossleyForce, two materials",
    },
    newest="4.6",
    tested="scripts were run in OpenSim 4.6, RungeKutta3 with a fixed step",
    parameters=parameters,
    lines=lines,
    comment=("<!-- ", " -->"),
    notes=notes,
    template=TEMPLATE,
    program=python_package("opensim"),
)
