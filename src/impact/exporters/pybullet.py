"""PyBullet, contacts with contactStiffness and contactDamping."""

from __future__ import annotations

import math

from ..errors import UsageError
from ..formatting import number
from .code import Code, Collision, Lines, Parameters, keyword_arguments
from .programs import python_package

# moment of inertia [kg m^2] of the bodies that do not turn: that of 0.11 mm and 4e-8 kg did not, of 0.12 mm did
LEAST_INERTIA = 2.0**-52
# the normal is along x, the tangent along y, so that spins are about z
TEMPLATE = """\
import pybullet as bullet

bullet.connect(bullet.DIRECT)
{{ lines }}
balls = []
{% if has_friction %}
for m, R, x, y, v, u, omega in (
{% for ball in balls %}
    ({{ ball.m }}, {{ ball.R }}, {{ ball.x }}, {{ ball.y }}, {{ ball.v }}, {{ ball.u }}, {{ ball.omega }}),
{% endfor %}
):
{% set y, u, spin = "y", "u", ", [0, 0, omega]" %}
{% else %}
for m, R, x, v in {{ tuples("m", "R", "x", "v") }}:
{% set y, u, spin = "0", "0", "" %}
{% endif %}
    shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=R)
    balls.append(bullet.createMultiBody(m, shape, basePosition=[x, {{ y }}, 0]))
    bullet.changeDynamics(balls[-1], -1, **contact)
    bullet.resetBaseVelocity(balls[-1], [v, {{ u }}, 0]{{ spin }})
{% if has_wall %}
plane = bullet.createCollisionShape(bullet.GEOM_PLANE, planeNormal=[-1, 0, 0])
balls.append(bullet.createMultiBody(0, plane))
bullet.changeDynamics(balls[-1], -1, **contact)
{% endif %}
for _ in range({{ steps }}):
    bullet.stepSimulation()
{% if has_friction %}
(v1, u1), (v2, u2) = (bullet.getBaseVelocity(ball)[0][:2] for ball in balls)
omega1, omega2 = (bullet.getBaseVelocity(ball)[1][2] for ball in balls)
{% else %}
v1, v2 = (bullet.getBaseVelocity(ball)[0][0] for ball in balls)
{% endif %}
{{ print_beta }}print("e_out =", (v2 - v1) / {{ v0 }})
"""


def parameters(c: Collision) -> dict[str, float | str]:
    """Write the arguments of changeDynamics for each of two bodies, whose springs act in series."""
    normal = {"contactStiffness": 2.0 * c["K"], "contactDamping": 0.5 * c["C"]}
    for ball in ("1", "2") if c.friction else ():
        if c[f"inertia_factor{ball}"] * c[f"m{ball}"] * c[f"R{ball}"] ** 2 <= LEAST_INERTIA:
            raise UsageError(
                f"R{ball} and m{ball}: expected a moment of inertia above {number(LEAST_INERTIA, 2)} kg m^2: "
                "PyBullet never turns a smaller body; write the impact in smaller units"
            )
    # the coefficient of a contact is the product of those of both bodies
    return {**normal, "lateralFriction": math.sqrt(c["mu"])} if c.friction else {**normal}


def lines(collision: Collision, parameters: Parameters) -> Lines:
    smooth = "angularDamping=0" if collision.friction else "lateralFriction=0"
    yield f"bullet.setTimeStep({collision.dt!r})"
    yield "bullet.setPhysicsEngineParameter(contactSlop=0)"
    yield f"contact = dict({keyword_arguments(parameters)}, restitution=0, contactProcessingThreshold=0)"
    yield f"contact |= dict({smooth}, linearDamping=0, maxJointVelocity=1e9)"


def notes(collision: Collision) -> Lines:
    yield "in SI, of each of two equal bodies; two bodies: K = 1/(1/k1 + 1/k2), C = c1 + c2"
    yield "contact is passed to changeDynamics of both bodies; stiffness and damping only together"
    yield "a body without them is rigid and adds its default damping of 0.1 N s/m"
    yield "contactSlop=0: by default the force begins at an indentation of 1e-5 m, and the rebound is slower"
    yield "contactProcessingThreshold=0: by default shapes other than two spheres push a step before they touch"
    yield "restitution=0: a value above 0 acts too where the speed is above restitutionVelocityThreshold (0.2 m/s)"
    yield "linearDamping=0: its default of 0.04 damps every motion"
    yield "maxJointVelocity=1e9: by default a body, a free one too, is never faster than 100 m/s"
    yield "the force is that at the end of the step, never negative; each step takes energy, so that e is smaller"
    if collision.friction:
        yield "lateralFriction is sqrt(mu): a contact has the product of those of both bodies; unset it is 0.5"
        yield "angularDamping=0: its default of 0.04 damps every spin"
    else:
        yield "no friction: replace lateralFriction by yours; unset it is 0.5"


CODE = Code(
    title="PyBullet",
    laws={"kelvin-voigt-no-tension": "contactStiffness and contactDamping"},
    newest="3.2.7",
    tested="scripts were run in PyBullet 3.2.7; read in bulletphysics/bullet3 @6c888f4a (2025)",
    scheme="pybullet",
    parameters=parameters,
    lines=lines,
    notes=notes,
    template=TEMPLATE,
    frictions={"coulomb-1785": "lateralFriction"},
    program=python_package("pybullet"),
)
