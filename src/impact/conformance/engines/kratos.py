"""Kratos, application DEM: spheres, and a rigid face as the wall, with the law DEM_D_Linear_viscous_Coulomb."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

NU = 0.3
# the stiffness is this times E* R*, between two spheres 1.432 as much
STIFFNESS = 0.31225 * math.pi
STEPS_BEFORE, CONTACTS = 1, 2.0
SOLID = 0.4
BALL = """
Begin SubModelPart ball{number}
Begin SubModelPartNodes
{number}
End SubModelPartNodes
Begin SubModelPartElements
{number}
End SubModelPartElements
End SubModelPart
"""
WALL = """
Begin Properties 0
End Properties
Begin Nodes
3 0 -{reach} -{reach}
4 0 {reach} -{reach}
5 0 0 {reach}
End Nodes
Begin Conditions RigidFace3D3N
1 0 3 4 5
End Conditions
Begin SubModelPart wall
Begin SubModelPartNodes
3
4
5
End SubModelPartNodes
Begin SubModelPartConditions
1
End SubModelPartConditions
End SubModelPart
"""


def mesh(c: dict[str, Any], numbers: str, before: float) -> str:
    """Write the balls as a mesh of particles that touch after a time."""
    sides = {"1": -1.0, "2": 1.0}
    places = {n: (sides[n] * c[f"R{n}"] - c[f"v{n}"] * before, -c[f"u{n}"] * before) for n in numbers}
    nodes = "".join(f"{number} {x!r} {y!r} 0\n" for number, (x, y) in places.items())
    elements = "".join(f"{number} 0 {number}\n" for number in numbers)
    radii = "".join(f"{number} 0 {c[f'R{number}']!r}\n" for number in numbers)
    return (
        f"Begin Properties 0\nEnd Properties\nBegin Nodes\n{nodes}End Nodes\n"
        f"Begin Elements SphericParticle3D\n{elements}End Elements\nBegin NodalData RADIUS\n{radii}End NodalData\n"
    ) + "".join(BALL.format(number=number) for number in numbers)


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision whose balls touch, side by side, after the first step."""
    from importlib.metadata import version

    # two spheres are no work for threads
    os.environ["OMP_NUM_THREADS"] = "1"
    import KratosMultiphysics as Kratos
    from KratosMultiphysics.DEMApplication.DEM_analysis_stage import DEMAnalysisStage
    from linear_contact import damping_ratio, half_time

    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    facts = {"version": version("KratosDEMApplication"), "kind": "compliant"}
    numbers, steps = ("1" if c["m2"] is None else "12"), math.ceil(CONTACTS * c["contact_time"] / c["dt"])
    if any(abs(c[f"inertia{n}"] / (SOLID * c[f"m{n}"] * c[f"R{n}"] ** 2) - 1.0) > 1e-9 for n in numbers):
        return {"id": c["id"], "error": "particles are solid spheres", **facts}
    effective_mass, radius = (1.0 / sum(1.0 / c[f"{name}{n}"] for n in numbers) for name in ("m", "R"))
    frequency = 2.0 * half_time(damping_ratio(c["e"])) / c["contact_time"]
    stiffness = STIFFNESS * (1.432 if len(numbers) == 2 else 1.0)
    # E* of two equal materials is E/(2 (1 - nu^2))
    modulus = 2.0 * (1.0 - NU**2) * effective_mass * frequency**2 / (stiffness * radius)
    Path("ballsDEM.mdpa").write_text(mesh(c, numbers, STEPS_BEFORE * c["dt"]), encoding="utf-8")
    Path("ballsDEM_FEM_boundary.mdpa").unlink(missing_ok=True)
    if len(numbers) == 1:
        Path("ballsDEM_FEM_boundary.mdpa").write_text(WALL.format(reach=10.0 * c["R1"]), encoding="utf-8")
    relation = {
        "COEFFICIENT_OF_RESTITUTION": c["e"],
        "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": "DEM_D_Linear_viscous_Coulomb",
        "STATIC_FRICTION": c["mu"],
        "DYNAMIC_FRICTION": c["mu"],
        "FRICTION_DECAY": 500.0,
        "ROLLING_FRICTION": 0.0,
    }
    materials = [(c[f"m{n}"], c[f"R{n}"]) for n in (numbers if len(numbers) == 2 else "11")]
    parts = [f"SpheresPart.ball{n}" for n in numbers] + ["RigidFacePart.wall"] * (2 - len(numbers))
    settings = {
        "materials": [
            {
                "material_name": f"material{i}",
                "material_id": i,
                "Variables": {
                    "PARTICLE_DENSITY": mass / (4 / 3 * math.pi * R**3),
                    "YOUNG_MODULUS": modulus,
                    "POISSON_RATIO": NU,
                },
            }
            for i, (mass, R) in enumerate(materials, 1)
        ],
        "material_relations": [
            {
                "material_names_list": [f"material{i}", f"material{j}"],
                "material_ids_list": [i, j],
                "Variables": relation,
            }
            for i, j in ((1, 1), (1, 2), (2, 2))
        ],
        "material_assignation_table": [[part, f"material{i}"] for i, part in enumerate(parts, 1)],
    }
    Path("MaterialsDEM.json").write_text(json.dumps(settings), encoding="utf-8")
    parameters = {
        "problem_name": "balls",
        "do_print_results_option": False,
        "dem_inlet_option": False,
        "GravityZ": 0.0,
        "RotationOption": True,
        "SearchTolerance": 0.1 * c["R1"],
        "search_tolerance_against_walls": 0.1 * c["R1"],
        "NeighbourSearchFrequency": 100,
        "TranslationalIntegrationScheme": "Symplectic_Euler",
        "MaxTimeStep": c["dt"],
        "FinalTime": (STEPS_BEFORE + steps) * c["dt"],
        "solver_settings": {
            "strategy": "sphere_strategy",
            "material_import_settings": {"materials_filename": "MaterialsDEM.json"},
        },
    }
    stage = DEMAnalysisStage(Kratos.Model(), Kratos.Parameters(json.dumps(parameters)))
    stage.Initialize()
    balls = [stage.spheres_model_part.Nodes[int(number)] for number in numbers]
    quantities = {"v": Kratos.VELOCITY_X, "u": Kratos.VELOCITY_Y, "omega": Kratos.ANGULAR_VELOCITY_Z}
    for number, ball in zip(numbers, balls, strict=True):
        for name, variable in quantities.items():
            ball.SetSolutionStepValue(variable, c[f"{name}{number}"])
    solver = stage._GetSolver()
    for _ in range(STEPS_BEFORE + steps):
        stage.time = solver.AdvanceInTime(stage.time)
        solver.Predict()
        solver.SolveSolutionStep()
    answer = {"id": c["id"], **facts}
    for number, ball in zip(numbers, balls, strict=True):
        answer |= {f"{name}{number}": ball.GetSolutionStepValue(variable) for name, variable in quantities.items()}
    stage.Finalize()
    return answer
