"""EXUDYN, contacts of CreateSphereSphereContact."""

from __future__ import annotations

from .code import Code, Collision, Parameters
from .programs import python_package_version

# impactModel of each law; linear damping is added to the other two where it is not 0
IMPACT_MODELS = {"exudyn-carvalho-gonthier": 2, "hunt-crossley-1975": 1, "kelvin-voigt": 0}
TWO_BALLS = """\
import exudyn

system = exudyn.SystemContainer()
mbs = system.AddSystem()
{lines}
balls = [
    mbs.CreateMassPoint(referencePosition=[x, 0, 0], initialVelocity=[v, 0, 0], mass=m)
    for m, x, v in (({m1}, {x1}, {v1}), ({m2}, {x2}, {v2}))
]
mbs.CreateSphereSphereContact(itemNumbers=balls, spheresRadii=[{R1}, {R2}], **contact)
mbs.Assemble()
settings = exudyn.SimulationSettings()
settings.solution.file.write = False
settings.timeIntegration.numberOfSteps = {steps}
settings.timeIntegration.endTime = {steps} * dt
mbs.SolveDynamic(settings)
v1, v2 = (mbs.GetObjectOutputBody(ball, exudyn.OutputVariableType.Velocity)[0] for ball in balls)
print("e_out =", (v2 - v1) / {v0})
"""


def parameters(collision: Collision) -> dict[str, float | str]:
    """Write the arguments of CreateSphereSphereContact."""
    c = collision
    values: dict[str, float | str] = {
        "impactModel": IMPACT_MODELS[c.model.key],
        "contactStiffness": c["K"],
        "contactStiffnessExponent": c["n"],
    }
    if c.model.key == "kelvin-voigt":
        return {**values, "contactDamping": c["C"]}
    return {**values, "contactDamping": 0.0, "restitutionCoefficient": c["e"]}


def lines(collision: Collision, parameters: Parameters) -> list[str]:
    return [
        "contact = dict(",
        *(f"    {name}={value!r}," for name, value in parameters.items()),
        ")",
        f"dt = {collision.dt!r}",
    ]


def notes(collision: Collision) -> list[str]:
    remarks = [
        "in SI, of the pair: each contact of CreateSphereSphereContact has its own values, without any mixing",
        "contactStiffness is in N/m^n; unset, the exponent n is 1",
    ]
    if collision.model.key == "kelvin-voigt":
        return [*remarks, "the force pulls before the contact ends; restitutionCoefficient is not used"]
    return [
        *remarks,
        "unset, restitutionCoefficient is 1 and impactModel 0, which has contactDamping only; e has to be above 0",
        "begin with a gap: a contact in the first step has no impact velocity, thus no damping, and e is 1",
        "minimumImpactVelocity, by default 0: a slower impact has the damping of that speed, and rebounds faster",
        "contactDamping adds to the damping of the impact model",
    ]


CODE = Code(
    name="exudyn",
    title="EXUDYN",
    laws={key: f"impactModel {number}" for key, number in IMPACT_MODELS.items()},
    damping={"kelvin-voigt": "C"},
    newest="1.13.6",
    tested="scripts were run in EXUDYN 1.13.6, generalized alpha; read in jgerstmayr/EXUDYN @e44aca1b (2026)",
    parameters=parameters,
    lines=lines,
    notes=notes,
    template=TWO_BALLS,
    program="python",
    install="pip install exudyn",
    version_of=python_package_version("exudyn"),
)
