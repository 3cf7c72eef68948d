"""PyBullet, contacts with contactStiffness and contactDamping."""

from __future__ import annotations

import math

from .code import PRINT_BETA, Code, Collision, Parameters
from .programs import python_package

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
# the normal is along x, the tangent along y, so that spins are about z
OBLIQUE = {
    "for m, R, x, v in (({m1}, {R1}, {x1}, {v1}), ({m2}, {R2}, {x2}, {v2})):": (
        "for m, R, x, y, v, u, omega in (\n"
        "    ({m1}, {R1}, {x1}, {y1}, {v1}, {u1}, {omega1}),\n"
        "    ({m2}, {R2}, {x2}, {y2}, {v2}, {u2}, {omega2}),\n"
        "):"
    ),
    "[x, 0, 0]": "[x, y, 0]",
    "[v, 0, 0])": "[v, u, 0], [0, 0, omega])",
    "v1, v2 = (bullet.getBaseVelocity(ball)[0][0] for ball in balls)": (
        "(v1, u1), (v2, u2) = (bullet.getBaseVelocity(ball)[0][:2] for ball in balls)\n"
        "omega1, omega2 = (bullet.getBaseVelocity(ball)[1][2] for ball in balls)"
    ),
    'print("e_out ="': PRINT_BETA,
}


def parameters(collision: Collision) -> dict[str, float | str]:
    """Write the arguments of changeDynamics for each of two bodies, whose springs act in series."""
    c = collision
    normal = {"contactStiffness": 2.0 * c["K"], "contactDamping": 0.5 * c["C"]}
    # the coefficient of a contact is the product of those of both bodies
    return {**normal, "lateralFriction": math.sqrt(c["mu"])} if c.friction else {**normal}


def lines(collision: Collision, parameters: Parameters) -> list[str]:
    values = ", ".join(f"{name}={value!r}" for name, value in parameters.items())
    smooth = "angularDamping=0" if collision.friction else "lateralFriction=0"
    return [
        f"bullet.setTimeStep({collision.dt!r})",
        "bullet.setPhysicsEngineParameter(contactSlop=0)",
        f"contact = dict({values}, restitution=0, contactProcessingThreshold=0)",
        f"contact |= dict({smooth}, linearDamping=0, maxJointVelocity=1e9)",
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
        *(
            (
                "lateralFriction is sqrt(mu): a contact has the product of those of both bodies; unset it is 0.5",
                "angularDamping=0: its default of 0.04 damps every spin",
            )
            if collision.friction
            else ("no friction: replace lateralFriction by yours; unset it is 0.5",)
        ),
    ]


CODE = Code(
    name="pybullet",
    title="PyBullet",
    laws={"kelvin-voigt-no-tension": "contactStiffness and contactDamping"},
    newest="3.2.7",
    tested="scripts were run in PyBullet 3.2.7; read in bulletphysics/bullet3 @6c888f4a (2025)",
    scheme="pybullet",
    parameters=parameters,
    lines=lines,
    notes=notes,
    template=TWO_BALLS,
    wall={
        " ({m2}, {R2}, {x2}, {v2})": "",
        "    ({m2}, {R2}, {x2}, {y2}, {v2}, {u2}, {omega2}),\n": "",
        "for _ in": (
            "plane = bullet.createCollisionShape(bullet.GEOM_PLANE, planeNormal=[-1, 0, 0])\n"
            "balls.append(bullet.createMultiBody(0, plane))\n"
            "bullet.changeDynamics(balls[-1], -1, **contact)\n"
            "for _ in"
        ),
    },
    frictions={"coulomb-1785": "lateralFriction"},
    oblique=OBLIQUE,
    program=python_package("pybullet"),
)
