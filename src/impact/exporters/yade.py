"""YADE, contacts of Hertz and Mindlin and viscoelastic contacts."""

from __future__ import annotations

import math
import re

from ..contact.closed_forms.dashpot import gap_damping
from ..errors import UsageError
from .code import Code, Collision, Lines, Parameters, keyword_arguments
from .programs import Program, printed_version

# the law of each option by the release, or month, that it begins with; the oldest first
HISTORY = (
    (("", "yade-en-pulling"), ("2013.09", "yade-en-clamped"), ("2023.02a", "yade-en")),
    (("", "yade-betan-pulling"), ("2013.09", "yade-betan")),
    (("", "yade-viscoelastic-pulling"), ("2014.01", "yade-viscoelastic")),
)
# the first release in which it was seen that a wall can be hertzian
HERTZIAN_SINCE = "2023.02a"
# radius of a wall in R*, in radii of the ball: without and with hertzian=True
WALL_RADII = (1.0, 1e8)
# the normal is along x, the tangent along y, so that spins are about z
TEMPLATE = """\
{{ lines }}
{% if has_friction %}
for x, y, radius, mass, speed, u, spin, material in (
{% else %}
for x, radius, mass, speed, material in (
{% endif %}
{% for ball in balls %}
{% if has_friction %}
    ({{ [ball.x, ball.y, ball.R, ball.m, ball.v, ball.u, ball.omega, ball.material] | join(", ") }}),
{% else %}
    ({{ [ball.x, ball.R, ball.m, ball.v, ball.material] | join(", ") }}),
{% endif %}
{% endfor %}
):
{% set y, u = ("y", "u") if has_friction else ("0", "0") %}
    ball = O.bodies[O.bodies.append(utils.sphere((x, {{ y }}, 0), radius, material=material))]
    ball.state.mass = mass
    ball.state.vel = (speed, {{ u }}, 0)
{% if has_friction %}
    ball.state.inertia = ({{ solid }} * mass * radius**2,) * 3
    ball.state.angVel = (0, 0, spin)
{% endif %}
{% if has_wall %}
O.bodies.append(utils.wall(0, axis=0, material={{ material2 }}))
{% endif %}
O.run({{ steps }}, True)
v1, v2 = {{ each("ball.state.vel[0]", "ball in O.bodies", v2) }}
{% if has_friction %}
u1, u2 = {{ each("ball.state.vel[1]", "ball in O.bodies", u2) }}
omega1, omega2 = {{ each("ball.state.angVel[2]", "ball in O.bodies", "0.0") }}
{% endif %}
{{ print_beta }}print("e_out =", (v2 - v1) / {{ v0 }})
"""
# the laws that a friction law is combined with; beside en, betas is ignored
LAWS_WITH = {"yade-mindlin": "yade-betan", "yade-viscoelastic": "yade-viscoelastic"}


def read_version(text: str) -> str:
    if not re.fullmatch(r"\d{4}\.\d{2}[a-z]?", text):
        raise UsageError(f'got "{text}", expected a release such as 2023.02a, or its year and month')
    return text


def law_for_version(key: str, version: str) -> str:
    """Find the law of an option in a version.

    >>> law_for_version("yade-en", "2022.01a"), law_for_version("yade-betan", "2011.05")
    ('yade-en-clamped', 'yade-betan-pulling')
    """
    for periods in HISTORY:
        if key in dict(map(reversed, periods)):  # type: ignore[arg-type]
            return [law for since, law in periods if since <= version][-1]
    return key


def parameters(c: Collision) -> dict[str, float | str]:
    """Arguments of the material and of the functor that makes the contact.

    Those of viscoelastic contacts are of each ball, whose springs and dashpots act in series. The tangential
    stiffness of the other contacts is 8 G* a.
    """
    angle = {"frictionAngle": math.atan(c["mu"])} if c.friction else {}
    if "viscoelastic" in c.model.key:
        values: dict[str, float | str] = {"kn": 2.0 * c["K"], "cn": 2.0 * c["C"], "ks": 0.0, "cs": 0.0}
        if c.friction:
            k_t = c["kt_over_kn"] * c["K"] if math.isnan(c["k_t"]) else c["k_t"]
            values |= {"ks": 2.0 * k_t, "cs": 2.0 * c["c_t"]}
        return values | angle
    c.require_materials("YADE takes Young's modulus and Poisson's ratio")
    values = {"young": c["E1"], "poisson": c["nu1"]}
    if not c.has_one_material:
        values |= {"young2": c["E2"], "poisson2": c["nu2"]}
    if c.model.key.startswith("yade-en"):
        return values | {"en": c["e"]}
    # ζ of the law is √1.2 β
    beta = float(gap_damping(c["e"]))
    values["betan"] = c["betan"] if c.model.key == "yade-betan-direct" else beta
    if c.friction:
        for name in ("k_t", "kt_over_kn"):
            if not math.isnan(c[name]):
                raise UsageError(
                    f"{name}: YADE has none with its MindlinPhys, whose tangential stiffness is 8 G* a"
                )
        values["betas"] = beta if math.isnan(c["betas"]) else c["betas"]
    return values | angle


def lines(collision: Collision, parameters: Parameters) -> Lines:
    remaining = dict(parameters)
    angle = {"frictionAngle": remaining.pop("frictionAngle", 0)}
    second = {name: remaining.pop(f"{name}2") for name in ("young", "poisson") if f"{name}2" in remaining}
    if "kn" in remaining:
        material = f"ViscElMat({keyword_arguments(remaining | angle)})"
        physics = "Ip2_ViscElMat_ViscElMat_ViscElPhys()"
        law = "Law2_ScGeom_ViscElPhys_Basic()"
    else:
        elastic = {name: remaining.pop(name) for name in ("young", "poisson")}
        material = f"FrictMat({keyword_arguments(elastic | angle)})"
        physics = f"Ip2_FrictMat_FrictMat_MindlinPhys({keyword_arguments(remaining)})"
        law = "Law2_ScGeom_MindlinPhys_Mindlin()"
    yield f"material1 = O.materials.append({material})"
    if second:
        yield f"material2 = O.materials.append(FrictMat({keyword_arguments(second | angle)}))"
    bounds, geometries = "Bo1_Sphere_Aabb()", "Ig2_Sphere_Sphere_ScGeom()"
    if collision.has_wall:
        bounds += ", Bo1_Wall_Aabb()"
        geometries += f", Ig2_Wall_Sphere_ScGeom({'hertzian=True' if collision.version >= HERTZIAN_SINCE else ''})"
    yield "O.engines = ["
    yield "    ForceResetter(),"
    yield f"    InsertionSortCollider([{bounds}]),"
    yield f"    InteractionLoop([{geometries}], [{physics}], [{law}]),"
    yield "    NewtonIntegrator(damping=0),"
    yield "]"
    yield f"O.dt = {collision.dt!r}"


def notes(collision: Collision) -> Lines:
    yield "in SI; NewtonIntegrator(damping=0): its default of 0.2 damps every motion"
    if collision.friction:
        yield "frictionAngle is atan(mu), of both materials"
        yield "friction acts at less than the radius from the centre, by a part of the indentation"
    if "viscoelastic" in collision.model.key:
        yield "kn, cn, ks and cs are of one ball: two balls act in series, and they are twice those of the contact"
        yield "en of ViscElMat finds its damping only roughly; kn and cn are exact"
        yield "the force is never negative (since January 2014)"
        return
    if collision.has_wall:
        by_default = "hertzian=True: by default " if collision.version >= HERTZIAN_SINCE else ""
        yield f"{by_default}a wall has R* = R1/2, 0.7071 of a plane's K, and 1.149 of its contact time"
    yield "two materials: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; en and betan are set for each pair by MatchMaker"
    yield "set en or betan, not both; en of 2023.02a is by Thornton and others, before that by Tsuji and others"
    remark = "the force is never negative (since September 2013)"
    if collision.friction:
        yield remark
        yield "unset, betas is betan; beside en it is ignored: betas=0 gave a beta of 0.097 where 0.279 was due"
    else:
        yield f"{remark}; frictionAngle=0: replace it by yours"


PROGRAM = Program(
    "yade",
    "on Debian: apt-get install yade",
    printed_version("--version", r"(\d{4}\.\d{2}[a-z]?)"),
    lambda program, file: (program, "-j1", "-n", "-x", file),
)
CODE = Code(
    title="YADE",
    laws={
        "yade-en": "Law2_ScGeom_MindlinPhys_Mindlin, en",
        "yade-en-clamped": "Law2_ScGeom_MindlinPhys_Mindlin, en before 2023.02a",
        "yade-en-pulling": "Law2_ScGeom_MindlinPhys_Mindlin, en before September 2013",
        "yade-betan": "Law2_ScGeom_MindlinPhys_Mindlin, betan by the formula of a linear spring",
        "yade-betan-pulling": "Law2_ScGeom_MindlinPhys_Mindlin, the same before September 2013",
        "yade-betan-direct": "Law2_ScGeom_MindlinPhys_Mindlin, betan",
        "yade-viscoelastic": "Law2_ScGeom_ViscElPhys_Basic, kn and cn",
        "yade-viscoelastic-pulling": "Law2_ScGeom_ViscElPhys_Basic, kn and cn before January 2014",
    },
    newest="2023.02a",
    tested="scripts were run in YADE 2023.02a",
    scheme="kick-drift",
    parameters=parameters,
    lines=lines,
    law_for_version=law_for_version,
    read_version=read_version,
    notes=notes,
    template=TEMPLATE,
    frictions={
        "yade-mindlin": "Law2_ScGeom_MindlinPhys_Mindlin, betas",
        "yade-viscoelastic": "Law2_ScGeom_ViscElPhys_Basic, ks and cs",
    },
    # betas is ignored beside en
    has_friction=lambda key, friction: key.startswith(LAWS_WITH[friction]),
    shortens_arms=True,
    wall_inputs=lambda key, version, values: {"R2": WALL_RADII[version >= HERTZIAN_SINCE] * values["R1"]},
    program=PROGRAM,
)
