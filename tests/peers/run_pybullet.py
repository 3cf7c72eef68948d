"""Two spheres in PyBullet, each with a stiffness and a damping of its own."""

from __future__ import annotations

from importlib.metadata import version

import pybullet
from runner import serve


def collide(
    k: list[float], c: list[float], m1: float, m2: float, R1: float, R2: float, v1: float, v2: float,
    gap: float, step: float, count: int,
) -> tuple[float, float]:  # fmt: skip
    pybullet.connect(pybullet.DIRECT)
    pybullet.setTimeStep(step)
    pybullet.setPhysicsEngineParameter(contactSlop=0)
    balls = []
    for i, mass, radius, x, speed in ((0, m1, R1, -R1 - gap, v1), (1, m2, R2, R2, v2)):
        shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius)
        balls.append(pybullet.createMultiBody(mass, shape, basePosition=[x, 0, 0]))
        pybullet.changeDynamics(balls[i], -1, contactStiffness=k[i], contactDamping=c[i], linearDamping=0)
        pybullet.resetBaseVelocity(balls[i], [speed, 0, 0])
    for _ in range(count):
        pybullet.stepSimulation()
    first, second = (pybullet.getBaseVelocity(ball)[0][0] for ball in balls)
    pybullet.disconnect()
    return first, second


serve(version("pybullet"), collide)
