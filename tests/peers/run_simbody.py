"""Two spheres on sliders in OpenSim, whose HuntCrossleyForce is that of Simbody."""

from __future__ import annotations

import opensim
from runner import serve


def collide(
    stiffness: float, c: float, m1: float, m2: float, R1: float, R2: float, v1: float, v2: float, gap: float,
    step: float, count: int,
) -> tuple[float, float]:  # fmt: skip
    model = opensim.Model()
    model.setGravity(opensim.Vec3(0))
    contact = opensim.HuntCrossleyForce()
    contact.setName("contact")
    contact.setTransitionVelocity(1.0)
    bodies = []
    for name, mass, radius, x, speed in (("1", m1, R1, -R1 - gap, v1), ("2", m2, R2, R2, v2)):
        body = opensim.Body(f"body{name}", mass, opensim.Vec3(0), opensim.Inertia(0.4 * mass * radius**2))
        joint = opensim.SliderJoint(f"joint{name}", model.getGround(), body)
        joint.updCoordinate().setDefaultValue(x)
        joint.updCoordinate().setDefaultSpeedValue(speed)
        sphere = opensim.ContactSphere(radius, opensim.Vec3(0), body, f"sphere{name}")
        model.addBody(body)
        model.addJoint(joint)
        model.addContactGeometry(sphere)
        bodies.append(joint)
    contact.addGeometry("sphere1")
    contact.addGeometry("sphere2")
    contact.setStiffness(stiffness)
    contact.setDissipation(c)
    contact.setStaticFriction(0.0)
    contact.setDynamicFriction(0.0)
    contact.setViscousFriction(0.0)
    model.addForce(contact)
    state = model.initSystem()
    manager = opensim.Manager(model)
    manager.setIntegratorMethod(opensim.Manager.IntegratorMethod_RungeKutta3)
    manager.setIntegratorFixedStepSize(step)
    manager.initialize(state)
    state = manager.integrate(count * step)
    return tuple(joint.getCoordinate().getSpeedValue(state) for joint in bodies)


opensim.Logger.setLevelString("Error")
serve(opensim.GetVersion(), collide)
