"""LIGGGHTS, pair style gran."""

from __future__ import annotations

import math
import re

from ..errors import UsageError
from ..formatting import number
from .code import Code, Collision, Lines, Parameters
from .lammps import PRINT_BETA, RUN
from .programs import Program, printed_version

# model of pair style gran, and its options, by key of the catalogue
OPTIONS = {
    "liggghts-hertz": ("hertz", ""),
    "liggghts-hertz-limit-force": ("hertz", " limitForce on"),
    "liggghts-hooke": ("hooke", ""),
    "liggghts-hooke-limit-force": ("hooke", " limitForce on"),
    "liggghts-edinburgh": ("edinburgh", ""),
}
# tangential model, by key of the catalogue
FRICTIONS = {"liggghts-history": "history", "liggghts-no-history": "no_history"}
# LIGGGHTS refuses a restitution of this or less, and a characteristic velocity [m/s] below this
LEAST_E, LEAST_SPEED = 0.05, 0.01
# Young's moduli [Pa] below the first and above the second have to be allowed
SOFT, HARD = 5e6, 1e9
TEMPLATE = (
    """\
units           si
atom_style      granular
atom_modify     map array
boundary        f f f
newton          off
communicate     single vel yes
region          box block -{{ reach }} {{ reach }} -{{ reach }} {{ reach }} -{{ reach }} {{ reach }} units box
create_box      2 box
neighbor        {{ skin }} bin
neigh_modify    delay 0
{{ lines }}
{% for ball in balls %}
create_atoms    {{ ball.number }} single {{ ball.x }} {{ ball.y }} 0
{% endfor %}
{% for ball in balls %}
set             atom {{ ball.number }} diameter {{ ball.d }} mass {{ ball.m }} vx {{ ball.v }} vy {{ ball.u }} vz 0
{% if has_friction %}
set             atom {{ ball.number }} omegaz {{ ball.omega }}
{% endif %}
{% endfor %}
fix             move all nve/sphere
"""
    + RUN
    + PRINT_BETA
    + """\
variable        e_out equal ({{ v2 if has_wall else "vx[2]" }}-vx[1])/{{ v0 }}
print           "e_out = ${e_out}"
"""
)


def read_version(text: str) -> str:
    if not re.fullmatch(r"\d+\.\d+\.\d+", text):
        raise UsageError(f'got "{text}", expected a release such as 3.8.0')
    if tuple(map(int, text.split("."))) < (3, 0, 0):
        raise UsageError(f"got {text}, expected 3.0.0 or later, whose laws were read")
    return text


def parameters(c: Collision) -> dict[str, float | str]:
    """Write the words after each property of fix property/global: its kind, and values by (pair of) types."""
    c.require_materials("LIGGGHTS takes Young's modulus and Poisson's ratio")
    if c.friction and not math.isnan(c["kt_over_kn"]):
        raise UsageError("kt_over_kn: LIGGGHTS has none; tangential_reduce = on of model hooke is 2/7")
    e = 1.0 if c.model.key == "liggghts-edinburgh" else c["e"]
    if not LEAST_E < e <= 1.0:
        raise UsageError(f"e: got {number(e)}, expected {LEAST_E} < e <= 1: LIGGGHTS refuses others")
    for name in ("nu1", "nu2"):
        if c[name] < 0.0:
            raise UsageError(f"{name}: got {number(c[name])}, expected 0 or more: LIGGGHTS refuses it")

    def pairs(value: float) -> str:
        return "peratomtypepair 2 " + " ".join([repr(value)] * 4)

    properties: dict[str, float | str] = {
        "youngsModulus": f"peratomtype {c['E1']!r} {c['E2']!r}",
        "poissonsRatio": f"peratomtype {c['nu1']!r} {c['nu2']!r}",
        "coefficientRestitution": pairs(e),
        "coefficientFriction": pairs(c["mu"] if c.friction else 0.0),
    }
    model, _ = OPTIONS[c.model.key]
    if model == "hooke":
        if c["vc"] < LEAST_SPEED:
            raise UsageError(f"vc: got {number(c['vc'])}, expected {LEAST_SPEED} m/s or more: LIGGGHTS refuses it")
        properties["characteristicVelocity"] = f"scalar {c['vc']!r}"
    if model == "edinburgh":
        properties |= {
            "UnloadingStiffness": pairs(c["k2"]),
            "surfaceEnergy": pairs(c["gamma"]),
            "pullOffForce": pairs(0.0),
            "coefficientAdhesionStiffness": pairs(0.0),
            "overlapExponent": f"scalar {c['n']!r}",
            "adhesionExponent": f"scalar {c['adhesion_exponent']!r}",
            # for the check of inputs only
            "characteristicVelocity": "scalar 1.0",
        }
    return properties


def lines(collision: Collision, parameters: Parameters) -> Lines:
    model, options = OPTIONS[collision.model.key]
    moduli = collision["E1"], collision["E2"]
    contact = f"gran model {model} tangential {FRICTIONS.get(collision.friction, 'no_history')}"
    if collision.friction:
        is_reduced = collision["n"] == 1.0 and collision.values.get("tangential_reduce", 0.0)
        options += "" if collision["tangential_damping"] else " tangential_damping off"
        options += " ktToKnUser on" if is_reduced else ""
    if min(moduli) < SOFT:
        yield "soft_particles  yes"
    if max(moduli) > HARD:
        yield "hard_particles  yes"
    for position, (name, words) in enumerate(parameters.items(), 1):
        yield f"fix             m{position} all property/global {name} {words}"
    yield f"pair_style      {contact}{options}"
    yield "pair_coeff      * *"
    if collision.has_wall:
        yield f"fix             wall all wall/{contact} primitive type 2 xplane 0.0{options}"
    yield f"timestep        {collision.dt!r}"


def notes(collision: Collision) -> Lines:
    model, options = OPTIONS[collision.model.key]
    yield "in SI (units si); the two atom types are those of ball 1 and ball 2"
    yield "two materials: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; coefficientRestitution is of each pair of types"
    yield f"refused: e <= {LEAST_E}, and Young's moduli outside 5e6 to 1e9 Pa without soft_ or hard_particles yes"
    if collision.has_wall:
        yield "the wall has the properties of type 2"
    if model == "hooke":
        yield "the stiffness follows from characteristicVelocity: set it to your speed of contact"
    if model == "edinburgh" and collision.has_wall:
        yield "a wall does not adhere, whatever its surfaceEnergy is: 0 here"
    if model == "edinburgh":
        yield "without its dashpot: coefficientRestitution is 1; UnloadingStiffness is k2/K"
    else:
        yield (
            "limitForce on: the force is never negative"
            if options
            else "the force becomes attractive before separation; limitForce on removes this and changes the law"
        )
    if not collision.friction:
        yield "no friction: replace tangential no_history and coefficientFriction by yours"
        return
    yield "tangential_damping is on by default; ktToKnUser on: the tangential stiffness is 2/7 of that of hooke"
    yield "friction acts at less than the radius from the centre, by a part of the indentation"


def warnings(collision: Collision) -> Lines:
    if collision.friction == "liggghts-history" and collision["tangential_damping"]:
        yield (
            "tangential history with damping alternates between slip and stick from step to step: 3 of 240 runs "
            "differed by up to 0.02 of the speed from what is predicted; with tangential_damping off none did"
        )


PROGRAM = Program(
    "liggghts",
    "on Debian: apt-get install liggghts",
    printed_version("-help", r"LIGGGHTS-PUBLIC ([\d.]+)"),
    lambda program, file: (program, "-in", file, "-log", "none"),
)
CODE = Code(
    title="LIGGGHTS, pair style gran",
    laws={key: f"model {model}{options}" for key, (model, options) in OPTIONS.items()},
    newest="3.8.0",
    tested="scripts were run in LIGGGHTS 3.8.0",
    scheme="kick-drift",
    parameters=parameters,
    lines=lines,
    read_version=read_version,
    notes=notes,
    warnings=warnings,
    template=TEMPLATE,
    frictions=FRICTIONS,
    # the stiffness of Edinburgh's tangential model is another one
    has_friction=lambda key, friction: key != "liggghts-edinburgh",
    shortens_arms=True,
    wall_inputs=lambda key, version, values: {f"{key}.gamma": 0.0} if key == "liggghts-edinburgh" else {},
    suffix=".in",
    program=PROGRAM,
)
