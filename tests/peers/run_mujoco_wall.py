"""A sphere and a plane in MuJoCo, with an elliptic cone: the plane is z = 0, the sphere above it.

A finite R2 replaces the plane by a second sphere at rest, below z = 0.
"""

from __future__ import annotations

import math

import mujoco
from runner import serve

# only a pair of geoms has a solreffriction of its own
WORLD = """
<mujoco>
  <option timestep="{step}" gravity="0 0 0" integrator="Euler" cone="elliptic" impratio="{impratio}"
    tolerance="0"/>
  <worldbody>
    {second}
    <body pos="{x} 0 {z}"><freejoint/><geom name="ball" type="sphere" size="{R1}" mass="{m1}"/></body>
  </worldbody>
  <contact>
    <pair geom1="second" geom2="ball" condim="3" friction="{mu} {mu} 0 0 0" solref="{solref}"
      solreffriction="{solreffriction}" solimp="{d} {d} 0.001 0.5 2"/>
  </contact>
</mujoco>
"""
PLANE = '<geom name="second" type="plane" size="1 1 1"/>'
SPHERE = '<body pos="0 0 {z}"><freejoint/><geom name="second" type="sphere" size="{R2}" mass="{m2}"/></body>'


def collide(
    solref: str, solreffriction: str, impratio: float, d: float, mu: float, m1: float, R1: float, v1: float,
    u1: float, omega1: float, gap: float, step: float, count: int, m2: float = math.inf, R2: float = math.inf,
) -> tuple[float, float, float]:  # fmt: skip
    model = mujoco.MjModel.from_xml_string(
        WORLD.format(
            second=PLANE if math.isinf(R2) else SPHERE.format(z=-R2, R2=R2, m2=m2),
            # so that the normal is along z at the first touch
            x=-u1 * gap / v1, z=R1 + gap, R1=R1, m1=m1, mu=mu, solref=solref, solreffriction=solreffriction,
            impratio=impratio, d=d, step=step,
        )
    )  # fmt: skip
    data = mujoco.MjData(model)
    # the normal points down to the plane, the tangent along x, so that spins are about -y
    data.qvel[-6:] = u1, 0.0, -v1, 0.0, -omega1, 0.0
    mujoco.mj_step(model, data, count)
    return -float(data.qvel[-4]), float(data.qvel[-6]), -float(data.qvel[-2])


serve(mujoco.__version__, collide)
