"""A sphere and a plane in YADE, whose own interpreter runs this; the plane is z = 0, the sphere above it.

A finite R2 replaces the plane by a second sphere at rest, below z = 0.
"""

from __future__ import annotations

import sys
from math import atan, inf, isfinite
from pathlib import Path

from yade import (
    Bo1_Sphere_Aabb,
    Bo1_Wall_Aabb,
    ForceResetter,
    FrictMat,
    Ig2_Sphere_Sphere_ScGeom,
    Ig2_Wall_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_FrictMat_FrictMat_MindlinPhys,
    Ip2_ViscElMat_ViscElMat_ViscElPhys,
    Law2_ScGeom_MindlinPhys_Mindlin,
    Law2_ScGeom_ViscElPhys_Basic,
    NewtonIntegrator,
    O,
    ViscElMat,
    config,
    utils,
)  # fmt: skip

sys.path.insert(0, str(Path(sys.argv[0]).parent))
from runner import serve


def collide(
    law: str, options: dict[str, float], mu: float, m1: float, R1: float, v1: float, u1: float, omega1: float,
    gap: float, step: float, count: int, m2: float = inf, R2: float = inf,
) -> tuple[float, float, float]:  # fmt: skip
    O.reset()
    if law == "mindlin":
        material = FrictMat(
            young=options["E"], poisson=options["nu"], frictionAngle=atan(mu), density=options["rho"]
        )
        damping = {name: options[name] for name in ("betan", "betas")}
        physics, contact = Ip2_FrictMat_FrictMat_MindlinPhys(**damping), Law2_ScGeom_MindlinPhys_Mindlin()
    else:
        material = ViscElMat(frictionAngle=atan(mu), **options)
        physics, contact = Ip2_ViscElMat_ViscElMat_ViscElPhys(), Law2_ScGeom_ViscElPhys_Basic()
    O.materials.append(material)
    ball = O.bodies[O.bodies.append(utils.sphere((-u1 * gap / v1, 0, R1 + gap), R1, material=material))]
    # the normal points down to the plane, the tangent along x, so that spins are about -y
    ball.state.mass, ball.state.inertia = m1, (0.4 * m1 * R1**2,) * 3
    ball.state.vel, ball.state.angVel = (u1, 0, -v1), (0, -omega1, 0)
    if isfinite(R2):
        second = O.bodies[O.bodies.append(utils.sphere((0, 0, -R2), R2, material=material))]
        second.state.mass, second.state.inertia = m2, (0.4 * m2 * R2**2,) * 3
    else:
        O.bodies.append(utils.wall(0, axis=2, material=material))
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom(hertzian=True)], [physics], [contact]),
        NewtonIntegrator(damping=0, gravity=(0, 0, 0)),
    ]
    O.dt = step
    # O.run looks every 40 ms whether it is over
    for _ in range(count):
        O.step()
    return -ball.state.vel[2], ball.state.vel[0], -ball.state.angVel[1]


serve(config.version, collide)
