"""A sphere and a plane, or a second sphere, in PyBullet, with stiffness, damping and friction of their own."""

from __future__ import annotations

import math
from importlib.metadata import version

import pybullet
from runner import serve


def collide(
    k: float, c: float, mu: float, m1: float, R1: float, v1: float, u1: float, omega1: float, gap: float,
    step: float, count: int, m2: float = math.inf, R2: float = math.inf,
) -> tuple[float, float, float]:  # fmt: skip
    pybullet.connect(pybullet.DIRECT)
    pybullet.setTimeStep(step)
    pybullet.setPhysicsEngineParameter(contactSlop=0)
    sphere = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=R1)
    # the normal is along x at the first touch, the tangent along y
    bodies = [pybullet.createMultiBody(m1, sphere, basePosition=[-R1 - gap, -u1 * gap / v1, 0])]
    if math.isinf(R2):
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, planeNormal=[-1, 0, 0])
        bodies.append(pybullet.createMultiBody(0, plane))
    else:
        second = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=R2)
        bodies.append(pybullet.createMultiBody(m2, second, basePosition=[R2, 0, 0]))
    for body in bodies:
        # the springs act in series, the dashpots add, and the coefficient of friction is a product
        pybullet.changeDynamics(
            body, -1, contactStiffness=2 * k, contactDamping=c / 2, lateralFriction=math.sqrt(mu),
            contactProcessingThreshold=0, restitution=0, linearDamping=0, angularDamping=0, maxJointVelocity=1e9,
        )  # fmt: skip
    pybullet.resetBaseVelocity(bodies[0], [v1, u1, 0], [0, 0, omega1])
    for _ in range(count):
        pybullet.stepSimulation()
    velocity, spin = pybullet.getBaseVelocity(bodies[0])
    pybullet.disconnect()
    return velocity[0], velocity[1], spin[2]


serve(version("pybullet"), collide)
