"""OpenSees, uniaxial materials for pounding."""

from __future__ import annotations

import math

from .code import Code, Collision, Lines, Parameters
from .programs import python_package

MATERIALS = {
    "opensees-hertzdamp": "Hertzdamp",
    "opensees-jankowski-impact": "JankowskiImpact",
    "opensees-impact-material": "ImpactMaterial",
    "kelvin-voigt": "ViscoelasticGap",
}
# yield displacement over the indentation that ImpactMaterial is designed for
YIELD_SHARE = 0.1
TEMPLATE = """\
import openseespy.opensees as ops

ops.model("basic", "-ndm", 1, "-ndf", 1)
for tag, mass in ((1, {{ m1 }}), (2, {{ "0.0" if has_wall else m2 }})):
    ops.node(tag, 0.0)
    ops.mass(tag, mass)
{% if has_wall %}
ops.fix(2, 1)
{% endif %}
gap = -{{ gap }}
{{ lines }}
# only now: the element subtracts the velocities that its nodes have when it is made
ops.setNodeVel(1, 1, {{ v1 }}, "-commit")
{% if not has_wall %}
ops.setNodeVel(2, 1, {{ v2 }}, "-commit")
{% endif %}
ops.constraints("Plain")
ops.numberer("Plain")
ops.system("FullGeneral")
ops.test("NormDispIncr", 1e-13 * {{ v0 }} * {{ dt }} * {{ steps }}, 50)
ops.algorithm("Newton")
ops.integrator("Newmark", 0.5, 0.25)
ops.analysis("Transient")
if ops.analyze({{ steps }}, {{ dt }}):
    raise SystemExit("no convergence")
v1, v2 = ops.nodeVel(1, 1), ops.nodeVel(2, 1)
print("e_out =", (v2 - v1) / {{ v0 }})
"""


def parameters(c: Collision) -> dict[str, float | str]:
    """Arguments of the material, except for the gap."""
    match MATERIALS[c.model.key]:
        case "Hertzdamp":
            return {"Kh": c["K"], "xiNorm": 8.0 * (1.0 - c["e"]) / (5.0 * c["e"]), "n": c["n"]}
        case "JankowskiImpact":
            e = c["e"]
            xi = 9.0 * math.sqrt(5.0) / 2.0 * (1.0 - e**2) / (e * (e * (9.0 * math.pi - 16.0) + 16.0))
            return {"Kh": c["K"], "xi": xi, "Meff": c["m"], "n": c["n"]}
        case "ImpactMaterial":
            # of equal energy and loss as a spring K x^n with the indentation d
            secant, loss = c["K"] * c["d"] ** (c["n"] - 1.0), (1.0 - c["e"] ** 2) / (c["n"] + 1.0)
            ratio = 1.0 / YIELD_SHARE
            return {
                "K1": secant * (1.0 + ratio * loss),
                "K2": secant * (1.0 - ratio * loss / (ratio - 1.0)),
                "delta_y": -YIELD_SHARE * c["d"],
            }
    return {"K": c["K"], "C": c["C"]}


def lines(collision: Collision, parameters: Parameters) -> Lines:
    values = [repr(value) for value in parameters.values()]
    # only an exponent follows the gap
    values.insert(-1 if "n" in parameters else len(values), "gap")
    yield f'ops.uniaxialMaterial("{MATERIALS[collision.model.key]}", 1, {", ".join(values)})'
    yield 'ops.element("zeroLength", 1, 1, 2, "-mat", 1, "-dir", 1)'


def notes(collision: Collision) -> Lines:
    names = list(parameters(collision))
    names.insert(-1 if "n" in names else len(names), "gap")
    yield f"in SI; the order of the arguments is that of the element: {', '.join(names)}"
    yield "compression is negative: the gap, and delta_y, are numbers below 0; set the gap to yours"
    if collision.model.key == "opensees-jankowski-impact":
        yield "Meff is the effective mass m1 m2/(m1 + m2), not the sum"
    if collision.model.key == "opensees-impact-material":
        yield "a bilinear spring for one indentation d only: another speed gives another restitution"
    if collision.model.key == "kelvin-voigt":
        yield "the force pulls before the gap opens"
    yield "make the element before the nodes have velocities, which it would subtract"


CODE = Code(
    title="OpenSees",
    laws={key: f'uniaxialMaterial "{name}"' for key, name in MATERIALS.items()},
    newest="3.7.1.2",
    tested="scripts were run in openseespy 3.7.1.2, Newmark with 0.5 and 0.25",
    parameters=parameters,
    lines=lines,
    notes=notes,
    template=TEMPLATE,
    program=python_package("openseespy"),
)
