"""MuJoCo, contacts with a constant impedance."""

from __future__ import annotations

from ..errors import UsageError
from ..formatting import argument
from .code import Code, Collision, Parameters
from .programs import python_package_version

# least and largest impedance are equal: with the default, 0.9 and 0.95, the restitution depends on the indentation
SOLIMP = "0.9 0.9 0.001 0.5 2"
TWO_BALLS = '''\
import mujoco

WORLD = """
<mujoco>
  <option timestep="{dt}" gravity="0 0 0" integrator="Euler"/>
  <default>
    <geom type="sphere" condim="1" solref="{solref}" solimp="{solimp}"/>
  </default>
  <worldbody>
    <body pos="{x1} 0 0"><joint type="slide" axis="1 0 0"/><geom size="{R1}" mass="{m1}"/></body>
    <body pos="{x2} 0 0"><joint type="slide" axis="1 0 0"/><geom size="{R2}" mass="{m2}"/></body>
  </worldbody>
</mujoco>
"""
model = mujoco.MjModel.from_xml_string(WORLD)
data = mujoco.MjData(model)
data.qvel[:] = {v1}, {v2}
mujoco.mj_step(model, data, {steps})
v1, v2 = map(float, data.qvel)
print("e_out =", (v2 - v1) / {v0})
'''


def parameters(collision: Collision) -> dict[str, float | str]:
    """Write the attributes of a geom; solref holds numbers per effective mass."""
    c = collision
    if c.model.key == "mujoco-solref":
        if c["timeconst"] < 2.0 * c.dt:
            raise UsageError(
                f"{argument('dt')}: got {c.dt!r}, expected at most half of timeconst = {c['timeconst']!r}: MuJoCo "
                "raises a smaller timeconst to 2 dt (flag refsafe)"
            )
        solref = f"{c['timeconst']!r} {c['dampratio']!r}"
    else:
        solref = f"{-c['k']!r} {-c['b']!r}"
    return {"solref": solref, "solimp": SOLIMP}


def lines(collision: Collision, parameters: Parameters) -> list[str]:
    return [
        f'<option timestep="{collision.dt!r}" integrator="Euler"/>',
        "<default>",
        f'  <geom solref="{parameters["solref"]}" solimp="{parameters["solimp"]}"/>',
        "</default>",
    ]


def notes(collision: Collision) -> list[str]:
    is_standard = collision.model.key == "mujoco-solref"
    return [
        *(["timeconst >= 2 dt: MuJoCo raises a smaller one to 2 dt (flag refsafe)"] if is_standard else []),
        "solref is per effective mass: the restitution does not depend on the masses, nor on the speed",
        "unset, solref is 0.02 1, critical damping: e is 0.135 at any speed; a timeconst below 2 dt is raised",
        "these lines assume constant solimp; the default, 0.9 0.95 0.001 0.5 2, gives a different restitution",
        "two geoms: their solref and solimp are averaged by solmix, or those of the higher priority are taken",
        "the force is never negative; a geom margin above 0 begins the contact earlier",
    ]


CODE = Code(
    name="mujoco",
    title="MuJoCo",
    laws={"mujoco-solref": "solref, standard format", "mujoco-solref-direct": "solref, direct format"},
    newest="4.0.0",
    tested="scripts were run in MuJoCo 4.0.0, integrator Euler",
    scheme="kick-drift",
    parameters=parameters,
    lines=lines,
    comment=("<!-- ", " -->"),
    notes=notes,
    template=TWO_BALLS,
    wall={
        '<body pos="{x2} 0 0"><joint type="slide" axis="1 0 0"/><geom size="{R2}" mass="{m2}"/></body>': (
            '<geom type="plane" size="1 1 1" zaxis="-1 0 0"/>'
        ),
        "data.qvel[:] = {v1}, {v2}": "data.qvel[:] = {v1}",
        "v1, v2 = map(float, data.qvel)": "v1, v2 = float(data.qvel[0]), {v2}",
    },
    program="python",
    install="pip install mujoco",
    version_of=python_package_version("mujoco"),
)
