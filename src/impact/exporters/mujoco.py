"""MuJoCo, contacts with a constant impedance."""

from __future__ import annotations

import math

from ..errors import UsageError
from ..formatting import argument
from .code import Code, Collision, Lines, Parameters
from .programs import python_package

# least and largest impedance are equal: with the default, 0.9 and 0.95, the restitution depends on the indentation
SOLIMP = "{d!r} {d!r} 0.001 0.5 2"
# the normal is along x, the tangent along y, so that spins are about z; of friction only a pair of geoms has a
# solreffriction of its own
TEMPLATE = '''\
import mujoco

WORLD = """
<mujoco>
{% set cone = ' cone="elliptic" impratio="' ~ impratio ~ '"' if has_friction else "" %}
  <option timestep="{{ dt }}" gravity="0 0 0" integrator="Euler"{{ cone }}/>
  <default>
{% if has_friction %}
    <pair condim="3" friction="{{ friction }}" solref="{{ solref }}" solreffriction="{{ solreffriction }}"
{#- #} solimp="{{ solimp }}"/>
{% else %}
    <geom type="sphere" condim="1" solref="{{ solref }}" solimp="{{ solimp }}"/>
{% endif %}
  </default>
  <worldbody>
{% for ball in balls %}
{% if has_friction %}
{% set y, joint, name = ball.y, "<freejoint/>", 'name="ball' ~ ball.number ~ '" ' %}
{% else %}
{% set y, joint, name = 0, '<joint type="slide" axis="1 0 0"/>', "" %}
{% endif %}
    <body pos="{{ ball.x }} {{ y }} 0">{{ joint }}<geom {{ name }}size="{{ ball.R }}" mass="{{ ball.m }}"/></body>
{% endfor %}
{% if has_wall %}
    <geom {{ 'name="wall" ' if has_friction else "" }}type="plane" size="1 1 1" zaxis="-1 0 0"/>
{% endif %}
  </worldbody>
{% if has_friction %}
  <contact><pair geom1="ball1" geom2="{{ "wall" if has_wall else "ball2" }}"/></contact>
{% endif %}
</mujoco>
"""
model = mujoco.MjModel.from_xml_string(WORLD)
data = mujoco.MjData(model)
{% if not has_friction %}
data.qvel[:] = {{ balls | join(", ", "v") }}
mujoco.mj_step(model, data, {{ steps }})
v1, v2 = {{ "float(data.qvel[0]), " ~ v2 if has_wall else "map(float, data.qvel)" }}
{% elif has_wall %}
data.qvel[:] = {{ v1 }}, {{ u1 }}, 0, 0, 0, {{ omega1 }}
mujoco.mj_step(model, data, {{ steps }})
v1, u1, _, _, _, omega1 = map(float, data.qvel)
v2, u2, omega2 = {{ v2 }}, {{ u2 }}, 0.0
{% else %}
data.qvel[:] = {{ v1 }}, {{ u1 }}, 0, 0, 0, {{ omega1 }}, {{ v2 }}, {{ u2 }}, 0, 0, 0, {{ omega2 }}
mujoco.mj_step(model, data, {{ steps }})
v1, u1, _, _, _, omega1, v2, u2, _, _, _, omega2 = map(float, data.qvel)
{% endif %}
{{ print_beta }}print("e_out =", (v2 - v1) / {{ v0 }})
'''
OF_FRICTION = (
    "geom1 and geom2 are names of geoms; a pair has all values of a contact, and only a pair has a solreffriction",
    "solreffriction of friction -1 -b_t has the damping b_t; its stiffness does not matter; 0 0 is that of solref",
    "friction changes e, at small steps too; with b_t dt of 2 or more a sliding ball may leave faster than before",
    "the arm of friction is the radius less half of the indentation; MuJoCo raises a mu below 1e-5 to it",
)


def parameters(c: Collision) -> dict[str, float | str]:
    """Write the attributes of a geom; solref holds numbers per effective mass."""
    if c.model.key == "mujoco-solref":
        if c["timeconst"] < 2.0 * c.dt:
            raise UsageError(
                f"{argument('dt')}: got {c.dt!r}, expected at most half of timeconst = {c['timeconst']!r}: MuJoCo "
                "raises a smaller timeconst to 2 dt (flag refsafe)"
            )
        solref = f"{c['timeconst']!r} {c['dampratio']!r}"
    else:
        solref = f"{-c['k']!r} {-c['b']!r}"
    if not c.friction:
        return {"solref": solref, "solimp": SOLIMP.format(d=0.9)}
    mu, b_t = c["mu"], c["b_t"]
    return {
        "solref": solref,
        # 0 0 is that of solref
        "solreffriction": "0 0" if math.isnan(b_t) else f"-1 {-b_t!r}",
        "solimp": SOLIMP.format(d=c["impedance"]),
        "friction": f"{mu!r} {mu!r} 0 0 0",
        "impratio": c["impratio"],
    }


def lines(collision: Collision, parameters: Parameters) -> Lines:
    names = [name for name in ("friction", "solref", "solreffriction", "solimp") if name in parameters]
    values = " ".join(f'{name}="{parameters[name]}"' for name in names)
    cone = f' cone="elliptic" impratio="{parameters["impratio"]}"' if collision.friction else ""
    yield f'<option timestep="{collision.dt!r}" integrator="Euler"{cone}/>'
    yield "<default>"
    yield f'  <pair condim="3" {values}/>' if collision.friction else f"  <geom {values}/>"
    yield "</default>"
    if collision.friction:
        yield "<contact>"
        yield f'  <pair geom1="ball1" geom2="{"wall" if collision.has_wall else "ball2"}"/>'
        yield "</contact>"


def notes(collision: Collision) -> Lines:
    if collision.model.key == "mujoco-solref":
        yield "timeconst >= 2 dt: MuJoCo raises a smaller one to 2 dt (flag refsafe)"
    yield "solref is per effective mass: the restitution does not depend on the masses, nor on the speed"
    yield "unset, solref is 0.02 1, critical damping: e is 0.135 at any speed; a timeconst below 2 dt is raised"
    yield "these lines assume constant solimp; the default, 0.9 0.95 0.001 0.5 2, gives a different restitution"
    yield "two geoms: their solref and solimp are averaged by solmix, or those of the higher priority are taken"
    yield "the force is never negative; a geom margin above 0 begins the contact earlier"
    if collision.friction:
        yield from OF_FRICTION


def warnings(collision: Collision) -> Lines:
    if collision.friction and math.isnan(collision["b_t"]):
        yield (
            "solreffriction is unset, and thus that of solref, whose damping is small where e is large: with "
            "e = 0.8, mu = 0.3, 40 degrees, 31 steps a ball kept 0.62 of its slip, and with rigid friction none; "
            "with a b_t of 1/dt it kept none, and its e was 0.35 to 0.39"
        )


CODE = Code(
    title="MuJoCo",
    laws={"mujoco-solref": "solref, standard format", "mujoco-solref-direct": "solref, direct format"},
    newest="4.0.0",
    tested="scripts were run in MuJoCo 4.0.0, integrator Euler",
    scheme="kick-drift",
    parameters=parameters,
    lines=lines,
    comment=("<!-- ", " -->"),
    notes=notes,
    warnings=warnings,
    template=TEMPLATE,
    frictions={"mujoco-elliptic": "elliptic cone, solreffriction"},
    shortens_arms=True,
    program=python_package("mujoco"),
)
