"""PyBullet, contacts with contactStiffness and contactDamping."""

from __future__ import annotations

from .code import Code, Collision, Parameters
from .programs import python_package_version

TWO_BALLS = """\
import pybullet as bullet

bullet.connect(bullet.DIRECT)
{lines}
balls = []
for m, R, x, v in (({m1}, {R1}, {x1}, {v1}), ({m2}, {R2}, {x2}, {v2})):
    shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=R)
    balls.append(bullet.createMultiBody(m, shape, basePosition=[x, 0, 0]))
    bullet.changeDynamics(balls[-1], -1, **contact)
    bullet.resetBaseVelocity(balls[-1], [v, 0, 0])
for _ in range({steps}):
    bullet.stepSimulation()
v1, v2 = (bullet.getBaseVelocity(ball)[0][0] for ball in balls)
print("e_out =", (v2 - v1) / {v0})
"""


def parameters(collision: Collision) -> dict[str, float | str]:
    """Write the arguments of changeDynamics for each of two bodies, whose springs act in series."""
    c = collision
    return {"contactStiffness": 2.0 * c["K"], "contactDamping": 0.5 * c["C"]}


def lines(collision: Collision, parameters: Parameters) -> list[str]:
    values = ", ".join(f"{name}={value!r}" for name, value in parameters.items())
    return [
        f"bullet.setTimeStep({collision.dt!r})",
        "bullet.setPhysicsEngineParameter(contactSlop=0)",
        f"contact = dict({values}, restitution=0, contactProcessingThreshold=0)",
        "contact |= dict(lateralFriction=0, linearDamping=0, maxJointVelocity=1e9)",
    ]


def notes(collision: Collision) -> list[str]:
    return [
        "in SI, of each of two equal bodies; two bodies: K = 1/(1/k1 + 1/k2), C = c1 + c2",
        "contact is passed to changeDynamics of both bodies; stiffness and damping only together",
        "a body without them is rigid and adds its default damping of 0.1 N s/m",
        "contactSlop=0: by default the force begins at an indentation of 1e-5 m, and the rebound is slower",
        "contactProcessingThreshold=0: by default shapes other than two spheres push a step before they touch",
        "restitution=0: a value above 0 acts too where the speed is above restitutionVelocityThreshold (0.2 m/s)",
        "linearDamping=0: its default of 0.04 damps every motion",
        "maxJointVelocity=1e9: by default a body, a free one too, is never faster than 100 m/s",
        "the force is that at the end of the step, never negative; each step takes energy, so that e is smaller",
        "no friction: replace lateralFriction by yours; unset it is 0.5",
    ]


CODE = Code(
    name="pybullet",
    title="PyBullet",
    laws={"kelvin-voigt-no-tension": "contactStiffness and contactDamping"},
    newest="3.2.7",
    tested="scripts were run in PyBullet 3.2.7; read in bulletphysics/bullet3 @6c888f4a (2025)",
    # both have the force at the end of a step in which the balls overlap at the start
    scheme="drake-sap",
    parameters=parameters,
    lines=lines,
    notes=notes,
    template=TWO_BALLS,
    wall={
        " ({m2}, {R2}, {x2}, {v2})": "",
        "for _ in": (
            "plane = bullet.createCollisionShape(bullet.GEOM_PLANE, planeNormal=[-1, 0, 0])\n"
            "balls.append(bullet.createMultiBody(0, plane))\n"
            "bullet.changeDynamics(balls[-1], -1, **contact)\n"
            "for _ in"
        ),
    },
    program="python",
    install="pip install pybullet",
    version_of=python_package_version("pybullet"),
)
