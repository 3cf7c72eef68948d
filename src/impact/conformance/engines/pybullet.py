"""PyBullet: spheres, and a plane as the wall; restitution and friction of a pair are products."""

from __future__ import annotations

from typing import Any

STEPS = 3


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision of balls that touch."""
    from importlib.metadata import version

    import pybullet as bullet

    bullet.connect(bullet.DIRECT)
    bullet.setTimeStep(c["dt"])
    # no impulses that push an overlap apart, and a bounce at any speed
    bullet.setPhysicsEngineParameter(
        contactSlop=0, contactERP=0, erp=0, frictionERP=0, restitutionVelocityThreshold=0
    )
    bullet.setPhysicsEngineParameter(numSolverIterations=200, solverResidualThreshold=0)
    balls = []
    for number, side in (("1", -1.0), ("2", 1.0)):
        mass, R, inertia, v, u, omega = (c[f"{name}{number}"] for name in ("m", "R", "inertia", "v", "u", "omega"))
        if mass is None:
            body = bullet.createMultiBody(
                0, bullet.createCollisionShape(bullet.GEOM_PLANE, planeNormal=[-1, 0, 0])
            )
        else:
            shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=R)
            body = bullet.createMultiBody(mass, shape, basePosition=[side * R, 0, 0])
            bullet.changeDynamics(body, -1, localInertiaDiagonal=[inertia] * 3)
            bullet.resetBaseVelocity(body, [v, u, 0], [0, 0, omega])
            balls.append(body)
        restitution, friction = (c["e"], c["mu"]) if number == "1" else (1.0, 1.0)
        bullet.changeDynamics(body, -1, restitution=restitution, lateralFriction=friction)
        bullet.changeDynamics(body, -1, linearDamping=0, angularDamping=0, maxJointVelocity=1e9)
        bullet.changeDynamics(body, -1, contactProcessingThreshold=0, rollingFriction=0, spinningFriction=0)
    for _ in range(STEPS):
        bullet.stepSimulation()
    answer = {"id": c["id"], "version": version("pybullet"), "kind": "impulse"}
    for number, body in zip("12", balls, strict=False):
        (v, u, _), (_, _, omega) = bullet.getBaseVelocity(body)
        answer |= {f"v{number}": v, f"u{number}": u, f"omega{number}": omega}
    bullet.disconnect()
    return answer
