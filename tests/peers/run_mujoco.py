"""Two spheres on slides in MuJoCo."""

from __future__ import annotations

import mujoco
from runner import serve

WORLD = """
<mujoco>
  <option timestep="{step}" gravity="0 0 0" integrator="{integrator}"/>
  <default><geom type="sphere" condim="1" solref="{solref}" solimp="0.9 0.9 0.001 0.5 2"/></default>
  <worldbody>
    <body pos="{x1} 0 0"><joint type="slide" axis="1 0 0"/><geom size="{R1}" mass="{m1}"/></body>
    <body pos="{x2} 0 0"><joint type="slide" axis="1 0 0"/><geom size="{R2}" mass="{m2}"/></body>
  </worldbody>
</mujoco>
"""


def collide(
    solref: str, integrator: str, m1: float, m2: float, R1: float, R2: float, v1: float, v2: float, gap: float,
    step: float, count: int,
) -> tuple[float, float]:  # fmt: skip
    model = mujoco.MjModel.from_xml_string(
        WORLD.format(
            x1=-R1 - gap, x2=R2, R1=R1, R2=R2, m1=m1, m2=m2, solref=solref, integrator=integrator, step=step
        )
    )
    data = mujoco.MjData(model)
    data.qvel[:] = v1, v2
    mujoco.mj_step(model, data, count)
    return float(data.qvel[0]), float(data.qvel[1])


serve(mujoco.__version__, collide)
