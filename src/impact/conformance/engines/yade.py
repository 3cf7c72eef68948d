"""YADE, whose own interpreter runs this: viscoelastic contacts, with a friction angle and tangential springs."""

from __future__ import annotations

import math
from typing import Any

SETTINGS = "ViscElMat, kn and cn for e and the contact time, ks = 2/7 kn, cs = 0, NewtonIntegrator(damping=0)"
# over that of the normal spring: both have the same period for solid balls
TANGENTIAL_STIFFNESS = 2.0 / 7.0


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision, in a scene of its own."""
    import yade
    from two_balls import CONTACTS, PHASE, answer_of, balls_of, damping_ratio, half_time, harmonic
    from yade import O, utils

    balls = balls_of(c)
    mass = harmonic(ball.m for ball in balls)
    # the force is never negative
    z = damping_ratio(c["e"])
    frequency = 2.0 * half_time(z) / c["contact_time"]
    # the springs and dashpots of the two bodies act in series
    kn, cn = 2.0 * mass * frequency**2, 2.0 * 2.0 * z * mass * frequency
    O.reset()
    material = yade.ViscElMat(kn=kn, cn=cn, ks=TANGENTIAL_STIFFNESS * kn, cs=0.0, frictionAngle=math.atan(c["mu"]))
    O.materials.append(material)
    for ball in balls:
        centre = (*ball.start(PHASE * c["dt"]), 0.0)
        state = O.bodies[O.bodies.append(utils.sphere(centre, ball.R, material=material))].state
        state.mass, state.inertia = ball.m, (ball.inertia,) * 3
        state.vel, state.angVel = (ball.v, ball.u, 0.0), (0.0, 0.0, ball.omega)
    if len(balls) == 1:
        O.bodies.append(utils.wall(0, axis=0, material=material))
    O.engines = [
        yade.ForceResetter(),
        yade.InsertionSortCollider([yade.Bo1_Sphere_Aabb(), yade.Bo1_Wall_Aabb()]),
        yade.InteractionLoop(
            [yade.Ig2_Sphere_Sphere_ScGeom(), yade.Ig2_Wall_Sphere_ScGeom()],
            [yade.Ip2_ViscElMat_ViscElMat_ViscElPhys()],
            [yade.Law2_ScGeom_ViscElPhys_Basic()],
        ),
        yade.NewtonIntegrator(damping=0),
    ]
    O.dt = c["dt"]
    # O.run looks every 40 ms whether it is over
    for _ in range(math.ceil(CONTACTS * c["contact_time"] / c["dt"])):
        O.step()
    states = [O.bodies[index].state for index in range(len(balls))]
    return answer_of(
        c,
        ((state.vel[0], state.vel[1], state.angVel[2]) for state in states),
        "compliant",
        law="yade-viscoelastic",
        model="schwager-poschel-2007",
        parameters={"kt_over_kn": TANGENTIAL_STIFFNESS},
    )
