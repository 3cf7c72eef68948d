"""A sphere and a plane in MuJoCo, with an elliptic cone: the plane is z = 0, the sphere above it."""

from __future__ import annotations

import mujoco
from runner import serve

# only a pair of geoms has a solreffriction of its own
WORLD = """
<mujoco>
  <option timestep="{step}" gravity="0 0 0" integrator="Euler" cone="elliptic" impratio="{impratio}"
    tolerance="0"/>
  <worldbody>
    <geom name="plane" type="plane" size="1 1 1"/>
    <body pos="0 0 {z}"><freejoint/><geom name="ball" type="sphere" size="{R1}" mass="{m1}"/></body>
  </worldbody>
  <contact>
    <pair geom1="plane" geom2="ball" condim="3" friction="{mu} {mu} 0 0 0" solref="{solref}"
      solreffriction="{solreffriction}" solimp="{d} {d} 0.001 0.5 2"/>
  </contact>
</mujoco>
"""


def collide(
    solref: str, solreffriction: str, impratio: float, d: float, mu: float, m1: float, R1: float, v1: float,
    u1: float, omega1: float, gap: float, step: float, count: int,
) -> tuple[float, float, float]:  # fmt: skip
    model = mujoco.MjModel.from_xml_string(
        WORLD.format(
            z=R1 + gap, R1=R1, m1=m1, mu=mu, solref=solref, solreffriction=solreffriction, impratio=impratio, d=d,
            step=step,
        )
    )  # fmt: skip
    data = mujoco.MjData(model)
    # the normal points down to the plane, the tangent along x, so that spins are about -y
    data.qvel[:] = u1, 0.0, -v1, 0.0, -omega1, 0.0
    mujoco.mj_step(model, data, count)
    return -float(data.qvel[2]), float(data.qvel[0]), -float(data.qvel[4])


serve(mujoco.__version__, collide)
