"""Two spheres in YADE, whose own interpreter runs this."""

from __future__ import annotations

import sys
from pathlib import Path

from yade import (
    Bo1_Sphere_Aabb,
    ForceResetter,
    FrictMat,
    Ig2_Sphere_Sphere_ScGeom,
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
    law: str, options: dict[str, float], m1: float, m2: float, R1: float, R2: float, v1: float, v2: float,
    gap: float, step: float, count: int,
) -> tuple[float, float]:  # fmt: skip
    O.reset()
    if law == "mindlin":
        material = FrictMat(young=options["E"], poisson=options["nu"], frictionAngle=0, density=options["rho"])
        damping = {name: options[name] for name in ("en", "betan") if name in options}
        physics, contact = Ip2_FrictMat_FrictMat_MindlinPhys(**damping), Law2_ScGeom_MindlinPhys_Mindlin()
    else:
        material = ViscElMat(frictionAngle=0, **options)
        physics, contact = Ip2_ViscElMat_ViscElMat_ViscElPhys(), Law2_ScGeom_ViscElPhys_Basic()
    O.materials.append(material)
    for x, radius, mass, speed in ((-R1 - gap, R1, m1, v1), (R2, R2, m2, v2)):
        body = O.bodies[O.bodies.append(utils.sphere((x, 0, 0), radius, material=material))]
        body.state.mass, body.state.vel = mass, (speed, 0, 0)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()]),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [physics], [contact]),
        NewtonIntegrator(damping=0, gravity=(0, 0, 0)),
    ]
    O.dt = step
    # O.run looks every 40 ms whether it is over
    for _ in range(count):
        O.step()
    return O.bodies[0].state.vel[0], O.bodies[1].state.vel[0]


serve(config.version, collide)
