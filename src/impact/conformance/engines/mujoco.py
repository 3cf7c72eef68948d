"""MuJoCo: spheres on two slides and a hinge, and a plane as the wall; the contact is a pair of geoms."""

from __future__ import annotations

import math
from typing import Any

SETTINGS = (
    "Euler, elliptic cone, constant impedance, solref for e and the contact time, a tenth of it in solreffriction"
)
WORLD = """
<mujoco>
  <option timestep="{dt}" gravity="0 0 0" integrator="Euler" cone="elliptic" iterations="100" tolerance="0">
    <flag autoreset="disable"/>
  </option>
  <worldbody>{balls}</worldbody>
  <contact>
    <pair geom1="geom1" geom2="geom2" condim="3" friction="{mu} {mu} 0 0 0" solref="{timeconst} {dampratio}"
      solreffriction="{friction_time} 1" solimp="0.9 0.9 0.001 0.5 2"/>
  </contact>
</mujoco>
"""
BALL = """
<body pos="{x} {y} 0">
  <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>
  <inertial pos="0 0 0" mass="{m}" diaginertia="{inertia} {inertia} {inertia}"/>
  <geom name="geom{number}" type="sphere" size="{R}"/>
</body>
"""
WALL = '<geom name="geom2" type="plane" size="1 1 1" zaxis="-1 0 0"/>'
# the slip decays in this part of the contact
FRICTION_TIME = 0.1
# steps before the contact, and contact times that are run
STEPS_BEFORE, CONTACTS = 1, 3.0


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision whose balls touch, side by side, after the first step."""
    import mujoco
    from two_balls import answer_of, balls_of, damping_ratio, half_time

    z = damping_ratio(c["e"])
    frequency = 2.0 * half_time(z) / c["contact_time"]
    bodies, speeds = [], []
    for ball in balls_of(c):
        x, y = ball.start(STEPS_BEFORE * c["dt"])
        bodies.append(BALL.format(x=x, y=y, m=ball.m, inertia=ball.inertia, R=ball.R, number=ball.number))
        speeds += [ball.v, ball.u, ball.omega]
    if len(bodies) == 1:
        bodies.append(WALL)
    model = mujoco.MjModel.from_xml_string(
        WORLD.format(
            balls="".join(bodies), dt=c["dt"], mu=c["mu"], timeconst=1.0 / (frequency * z), dampratio=z,
            friction_time=max(FRICTION_TIME * c["contact_time"], 2.0 * c["dt"]),
        )
    )  # fmt: skip
    data = mujoco.MjData(model)
    data.qvel[:] = speeds
    mujoco.mj_step(model, data, STEPS_BEFORE + math.ceil(CONTACTS * c["contact_time"] / c["dt"]))
    return answer_of(c, data.qvel.reshape(-1, 3).tolist(), "compliant")
