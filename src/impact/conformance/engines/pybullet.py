"""PyBullet: spheres, and a plane as the wall; restitution and friction of a pair are products."""

from __future__ import annotations

from typing import Any

SETTINGS = "restitution and lateralFriction, contactERP = 0, restitutionVelocityThreshold = 0, 200 iterations"
STEPS = 3


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision of balls that touch."""
    import pybullet as bullet
    from two_balls import answer_of, balls_of

    bullet.connect(bullet.DIRECT)
    bullet.setTimeStep(c["dt"])
    # no impulses that push an overlap apart, and a bounce at any speed
    bullet.setPhysicsEngineParameter(
        contactSlop=0, contactERP=0, erp=0, frictionERP=0, restitutionVelocityThreshold=0
    )
    bullet.setPhysicsEngineParameter(numSolverIterations=200, solverResidualThreshold=0)
    balls, bodies = balls_of(c), []
    for ball in balls:
        shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=ball.R)
        body = bullet.createMultiBody(ball.m, shape, basePosition=[ball.side * ball.R, 0, 0])
        bullet.changeDynamics(body, -1, localInertiaDiagonal=[ball.inertia] * 3)
        bullet.resetBaseVelocity(body, [ball.v, ball.u, 0], [0, 0, ball.omega])
        bodies.append(body)
    if len(balls) == 1:
        shape = bullet.createCollisionShape(bullet.GEOM_PLANE, planeNormal=[-1, 0, 0])
        bodies.append(bullet.createMultiBody(0, shape))
    for body, (restitution, friction) in zip(bodies, ((c["e"], c["mu"]), (1.0, 1.0)), strict=True):
        bullet.changeDynamics(body, -1, restitution=restitution, lateralFriction=friction)
        bullet.changeDynamics(body, -1, linearDamping=0, angularDamping=0, maxJointVelocity=1e9)
        bullet.changeDynamics(body, -1, contactProcessingThreshold=0, rollingFriction=0, spinningFriction=0)
    for _ in range(STEPS):
        bullet.stepSimulation()
    velocities = [bullet.getBaseVelocity(body) for body in bodies[: len(balls)]]
    bullet.disconnect()
    return answer_of(c, ((v, u, omega) for (v, u, _), (_, _, omega) in velocities), "impulse")
