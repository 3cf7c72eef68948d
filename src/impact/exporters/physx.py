"""PhysX, compliant contacts; Isaac Sim and Isaac Lab have them too."""

from __future__ import annotations

from .code import Code, Collision, Lines, Parameters


def parameters(collision: Collision) -> dict[str, float | str]:
    """Write the attributes of PhysxMaterialAPI; a negative restitution is the stiffness in the C++ interface."""
    return {"compliantContactStiffness": collision["K"], "compliantContactDamping": collision["C"]}


def lines(collision: Collision, parameters: Parameters) -> Lines:
    stiffness, damping = parameters.values()
    yield f"PxMaterial* material = physics->createMaterial(0.0f, 0.0f, -{stiffness!r});"
    yield f"material->setDamping({damping!r});"
    yield "sceneDesc.solverType = PxSolverType::ePGS;"
    yield f"scene->simulate({collision.dt!r});"
    yield "// in USD, on the material:"
    yield from (f"//   float physxMaterial:{name} = {value!r}" for name, value in parameters.items())
    yield "// in Isaac Lab, of RigidBodyMaterialCfg:"
    yield f"//   compliant_contact_stiffness={stiffness!r}, compliant_contact_damping={damping!r}"


def notes(collision: Collision) -> Lines:
    return [
        "in SI; two materials: by default the mean of both; with a rigid one, the values of the compliant one",
        "a restitution from 0 to 1 is another law, rigid, without rebound below bounceThresholdVelocity (0.2 m/s)",
        "compliantContactAccelerationSpring: values are per effective mass; it is off by default",
        "the force is that at the end of the step, never negative; each step takes energy, so that e is smaller",
        "PGS, and contactOffset less than dt times the speed: impact timestep --model kelvin-voigt-no-tension "
        "--scheme drake-sap predicts it",
        "the default contactOffset, 0.02 m, lets the force act a step earlier; TGS divides the step",
    ]


CODE = Code(
    title="PhysX, Isaac Sim and Isaac Lab",
    laws={"kelvin-voigt-no-tension": "compliant contact"},
    newest="5.6.1",
    tested="not run by us; read in NVIDIA-Omniverse/PhysX @a3d8a641 (2026), DyContactPrepShared.h, PxMaterial.h, "
    "PxShape.h, PxSceneDesc.h and isaac-sim/IsaacLab @046b71b8, physics_materials_cfg.py",
    comment=("// ", ""),
    parameters=parameters,
    lines=lines,
    notes=notes,
)
