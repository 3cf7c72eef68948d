"""EXUDYN, contacts of CreateSphereSphereContact."""

from __future__ import annotations

from .code import Code, Collision, Lines, Parameters, keyword_arguments
from .programs import python_package

# impactModel of each law; linear damping is added to the other two where it is not 0
IMPACT_MODELS = {"exudyn-carvalho-gonthier": 2, "hunt-crossley-1975": 1, "kelvin-voigt": 0}
TEMPLATE = """\
import exudyn

system = exudyn.SystemContainer()
mbs = system.AddSystem()
{{ lines }}
balls = [
    mbs.CreateMassPoint(referencePosition=[x, 0, 0], initialVelocity=[v, 0, 0], mass=m)
    for m, x, v in {{ tuples("m", "x", "v") }}
]
{% if has_wall %}
balls.append(mbs.CreateGround())
{# the diagonal, along which the quad is split, is 4 radii away #}
corners = [[0, y * {{ R1 }}, z * {{ R1 }}] for y, z in ((-9, -9), (-9, 27), (9, 27), (9, -9))]
mbs.CreateSphereQuadContact(itemNumbers=balls, sphereRadius={{ R1 }}, quadPoints=corners, **contact)
{% else %}
mbs.CreateSphereSphereContact(itemNumbers=balls, spheresRadii=[{{ R1 }}, {{ R2 }}], **contact)
{% endif %}
mbs.Assemble()
settings = exudyn.SimulationSettings()
settings.solution.file.write = False
# steps are cut where the contact begins and ends
settings.timeIntegration.minimumStepSize = 1e-6 * dt
settings.timeIntegration.numberOfSteps = {{ steps }}
settings.timeIntegration.endTime = {{ steps }} * dt
mbs.SolveDynamic(settings)
v1, v2 = (mbs.GetObjectOutputBody(ball, exudyn.OutputVariableType.Velocity)[0] for ball in balls)
print("e_out =", (v2 - v1) / {{ v0 }})
"""


def parameters(c: Collision) -> dict[str, float | str]:
    """Write the arguments of CreateSphereSphereContact."""
    number = IMPACT_MODELS[c.model.key]
    loss = {"restitutionCoefficient": c["e"]} if number else {"contactDamping": c["C"]}
    return {"impactModel": number, "contactStiffness": c["K"], "contactStiffnessExponent": c["n"], **loss}


def lines(collision: Collision, parameters: Parameters) -> Lines:
    return [f"contact = dict({keyword_arguments(parameters)})", f"dt = {collision.dt!r}"]


def notes(collision: Collision) -> Lines:
    return [
        "in SI, of the pair: each contact of CreateSphereSphereContact has its own values, without any mixing",
        "contactStiffness is in N/m^n; unset, the exponent n is 1, impactModel 0 and restitutionCoefficient 1",
        "impactModel 0 takes no restitutionCoefficient and pulls at the end; 1 and 2 add contactDamping, if given",
        "1 and 2: begin with a gap; a contact in the first step has no impact velocity, no damping, and e is 1",
        "steps are cut at the contact: the solver stops if minimumStepSize, by default 1e-8 s, is near dt",
        "1 and 2: impacts below minimumImpactVelocity (0) have the damping of that speed, and rebound faster",
    ]


CODE = Code(
    title="EXUDYN",
    laws={key: f"impactModel {number}" for key, number in IMPACT_MODELS.items()},
    newest="1.13.6",
    tested="scripts were run in EXUDYN 1.13.6, generalized alpha; read in jgerstmayr/EXUDYN @e44aca1b (2026)",
    parameters=parameters,
    lines=lines,
    notes=notes,
    template=TEMPLATE,
    program=python_package("exudyn"),
)
