"""YADE, whose own interpreter runs this: viscoelastic contacts, with a friction angle and tangential springs."""

from __future__ import annotations

import math
from typing import Any

# over that of the normal spring: both have the same period for solid balls
TANGENTIAL_STIFFNESS = 2.0 / 7.0
# the balls touch after half of a step, and three contact times are run
PHASE, CONTACTS = 0.5, 3.0


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision, in a scene of its own."""
    from linear_contact import damping_ratio, half_time
    from yade import (
        Bo1_Sphere_Aabb,
        Bo1_Wall_Aabb,
        ForceResetter,
        Ig2_Sphere_Sphere_ScGeom,
        Ig2_Wall_Sphere_ScGeom,
        InsertionSortCollider,
        InteractionLoop,
        Ip2_ViscElMat_ViscElMat_ViscElPhys,
        Law2_ScGeom_ViscElPhys_Basic,
        NewtonIntegrator,
        O,
        ViscElMat,
        config,
        utils,
    )  # fmt: skip

    numbers = "1" if c["m2"] is None else "12"
    mass = 1.0 / sum(1.0 / c[f"m{number}"] for number in numbers)
    # the force is never negative
    z = damping_ratio(c["e"])
    frequency = 2.0 * half_time(z) / c["contact_time"]
    # the springs and dashpots of the two bodies act in series
    kn, cn = 2.0 * mass * frequency**2, 2.0 * 2.0 * z * mass * frequency
    O.reset()
    material = ViscElMat(kn=kn, cn=cn, ks=TANGENTIAL_STIFFNESS * kn, cs=0.0, frictionAngle=math.atan(c["mu"]))
    O.materials.append(material)
    for number in numbers:
        m, R, inertia, v, u, omega = (c[f"{name}{number}"] for name in ("m", "R", "inertia", "v", "u", "omega"))
        place = ((-R if number == "1" else R) - v * PHASE * c["dt"], -u * PHASE * c["dt"], 0.0)
        state = O.bodies[O.bodies.append(utils.sphere(place, R, material=material))].state
        state.mass, state.inertia = m, (inertia,) * 3
        state.vel, state.angVel = (v, u, 0.0), (0.0, 0.0, omega)
    if len(numbers) == 1:
        O.bodies.append(utils.wall(0, axis=0, material=material))
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
            [Ip2_ViscElMat_ViscElMat_ViscElPhys()],
            [Law2_ScGeom_ViscElPhys_Basic()],
        ),
        NewtonIntegrator(damping=0),
    ]
    O.dt = c["dt"]
    # O.run looks every 40 ms whether it is over
    for _ in range(math.ceil(CONTACTS * c["contact_time"] / c["dt"])):
        O.step()
    answer = {
        "id": c["id"],
        "version": config.version,
        "kind": "compliant",
        "law": "yade-viscoelastic",
        "model": "schwager-poschel-2007",
        "parameters": {"kt_over_kn": TANGENTIAL_STIFFNESS},
    }
    for number in numbers:
        state = O.bodies[int(number) - 1].state
        answer |= {f"v{number}": state.vel[0], f"u{number}": state.vel[1], f"omega{number}": state.angVel[2]}
    return answer
