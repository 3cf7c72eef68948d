"""Two spheres on sliders in OpenSim, whose HuntCrossleyForce is that of Simbody."""

from __future__ import annotations

from pathlib import Path

import opensim
from runner import serve

# Python has no class for the parameters of one sphere
CONTACT = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
<HuntCrossleyForce name="contact">
<HuntCrossleyForce::ContactParametersSet name="contact_parameters">
<objects>{spheres}</objects>
</HuntCrossleyForce::ContactParametersSet>
<transition_velocity>1</transition_velocity>
</HuntCrossleyForce>
</OpenSimDocument>
"""
SPHERE = """
<HuntCrossleyForce::ContactParameters>
<geometry>sphere{i}</geometry>
<stiffness>{stiffness!r}</stiffness>
<dissipation>{dissipation!r}</dissipation>
<static_friction>0</static_friction>
<dynamic_friction>0</dynamic_friction>
<viscous_friction>0</viscous_friction>
</HuntCrossleyForce::ContactParameters>
"""


def collide(
    stiffness: list[float], c: list[float], m1: float, m2: float, R1: float, R2: float, v1: float, v2: float,
    gap: float, step: float, count: int,
) -> tuple[float, float]:  # fmt: skip
    model = opensim.Model()
    model.setGravity(opensim.Vec3(0))
    spheres = "".join(SPHERE.format(i=i + 1, stiffness=stiffness[i], dissipation=c[i]) for i in (0, 1))
    Path("contact.xml").write_text(CONTACT.format(spheres=spheres), encoding="utf-8")
    contact = opensim.HuntCrossleyForce.safeDownCast(opensim.OpenSimObject.makeObjectFromFile("contact.xml"))
    joints = []
    for name, mass, radius, x, speed in (("1", m1, R1, -R1 - gap, v1), ("2", m2, R2, R2, v2)):
        body = opensim.Body(f"body{name}", mass, opensim.Vec3(0), opensim.Inertia(0.4 * mass * radius**2))
        joint = opensim.SliderJoint(f"joint{name}", model.getGround(), body)
        joint.updCoordinate().setDefaultValue(x)
        joint.updCoordinate().setDefaultSpeedValue(speed)
        sphere = opensim.ContactSphere(radius, opensim.Vec3(0), body, f"sphere{name}")
        model.addBody(body)
        model.addJoint(joint)
        model.addContactGeometry(sphere)
        joints.append(joint)
    model.addForce(contact)
    state = model.initSystem()
    manager = opensim.Manager(model)
    manager.setIntegratorMethod(opensim.Manager.IntegratorMethod_RungeKutta3)
    manager.setIntegratorFixedStepSize(step)
    manager.initialize(state)
    state = manager.integrate(count * step)
    return tuple(joint.getCoordinate().getSpeedValue(state) for joint in joints)


opensim.Logger.setLevelString("Error")
serve(opensim.GetVersion(), collide)
