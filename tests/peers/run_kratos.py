"""Two spheres in Kratos, application DEM, or a sphere and a rigid face.

The impact is central, and the velocities of both are returned; or oblique, where u1 is given, with a second sphere
at rest, and v1, u1 and omega1 are returned.
"""

from __future__ import annotations

import json
import math
import os
from importlib.metadata import version
from pathlib import Path

# two spheres are no work for threads
os.environ["OMP_NUM_THREADS"] = "1"

import KratosMultiphysics as Kratos
from KratosMultiphysics.DEMApplication.DEM_analysis_stage import DEMAnalysisStage
from runner import serve

BALL = """Begin SubModelPart ball{i}
Begin SubModelPartNodes
{i}
End SubModelPartNodes
Begin SubModelPartElements
{i}
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


def mesh(places: list[tuple[float, float]], radii: list[float]) -> str:
    """Write particles at places of the plane z = 0."""
    balls = range(1, len(places) + 1)
    nodes = "".join(f"{i} {x!r} {y!r} 0\n" for i, (x, y) in zip(balls, places, strict=True))
    elements = "".join(f"{i} 0 {i}\n" for i in balls)
    sizes = "".join(f"{i} 0 {R!r}\n" for i, R in zip(balls, radii, strict=True))
    return (
        f"Begin Properties 0\nEnd Properties\nBegin Nodes\n{nodes}End Nodes\n"
        f"Begin Elements SphericParticle3D\n{elements}End Elements\nBegin NodalData RADIUS\n{sizes}End NodalData\n"
    ) + "".join(BALL.format(i=i) for i in balls)


def collide(
    law: str, E: float, nu: float, e: float, m1: float, R1: float, v1: float, gap: float, step: float, count: int,
    m2: float = math.inf, R2: float = math.inf, v2: float = 0.0, mu: float = 0.0, u1: float | None = None,
    omega1: float = 0.0,
) -> tuple[float, ...]:  # fmt: skip
    has_wall, is_oblique = math.isinf(R2), u1 is not None
    u1 = u1 or 0.0
    # the normal is along x at the first touch, the tangent along y, so that spins are about z
    places, masses, radii = [(-R1 - gap, -u1 * gap / v1 if v1 else 0.0)], [m1], [R1]
    Path("ballsDEM_FEM_boundary.mdpa").unlink(missing_ok=True)
    if has_wall:
        Path("ballsDEM_FEM_boundary.mdpa").write_text(WALL.format(reach=100.0 * R1 + 2.0 * abs(places[0][1])))
        masses, radii = [m1, m1], [R1, R1]
    else:
        places, masses, radii = [*places, (R2, 0.0)], [m1, m2], [R1, R2]
    Path("ballsDEM.mdpa").write_text(mesh(places, radii[: len(places)]), encoding="utf-8")
    parts = [f"SpheresPart.ball{i}" for i in range(1, len(places) + 1)] + ["RigidFacePart.wall"] * has_wall
    materials = {
        "materials": [
            {
                "material_name": f"material{i}",
                "material_id": i,
                "Variables": {
                    "PARTICLE_DENSITY": mass / (4 / 3 * math.pi * radius**3),
                    "YOUNG_MODULUS": E,
                    "POISSON_RATIO": nu,
                },
            }
            for i, (mass, radius) in enumerate(zip(masses, radii, strict=True), 1)
        ],
        "material_relations": [
            {
                "material_names_list": [f"material{i}", f"material{j}"],
                "material_ids_list": [i, j],
                "Variables": {
                    "STATIC_FRICTION": mu,
                    "DYNAMIC_FRICTION": mu,
                    "FRICTION_DECAY": 500.0,
                    "ROLLING_FRICTION": 0.0,
                    "COEFFICIENT_OF_RESTITUTION": e,
                    "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": law,
                },
            }
            for i, j in ((1, 1), (1, 2), (2, 2))
        ],
        "material_assignation_table": [[part, f"material{i}"] for i, part in enumerate(parts, 1)],
    }
    Path("MaterialsDEM.json").write_text(json.dumps(materials), encoding="utf-8")
    parameters = {
        "problem_name": "balls",
        "do_print_results_option": False,
        "dem_inlet_option": False,
        "GravityZ": 0.0,
        "RotationOption": is_oblique,
        "SearchTolerance": 0.01,
        "search_tolerance_against_walls": 0.01,
        "NeighbourSearchFrequency": 100,
        "TranslationalIntegrationScheme": "Symplectic_Euler",
        "MaxTimeStep": step,
        "FinalTime": count * step,
        "solver_settings": {
            "strategy": "sphere_strategy",
            "material_import_settings": {"materials_filename": "MaterialsDEM.json"},
        },
    }
    stage = DEMAnalysisStage(Kratos.Model(), Kratos.Parameters(json.dumps(parameters)))
    stage.Initialize()
    balls = [stage.spheres_model_part.Nodes[i] for i in range(1, len(places) + 1)]
    for ball, speed in zip(balls, (v1, v2), strict=False):
        ball.SetSolutionStepValue(Kratos.VELOCITY_X, speed)
    if is_oblique:
        balls[0].SetSolutionStepValue(Kratos.VELOCITY_Y, u1)
        balls[0].SetSolutionStepValue(Kratos.ANGULAR_VELOCITY_Z, omega1)
    solver = stage._GetSolver()
    for _ in range(count):
        stage.time = solver.AdvanceInTime(stage.time)
        solver.Predict()
        solver.SolveSolutionStep()
    of_first = (Kratos.VELOCITY_X, Kratos.VELOCITY_Y, Kratos.ANGULAR_VELOCITY_Z)
    answer = (
        [balls[0].GetSolutionStepValue(variable) for variable in of_first]
        if is_oblique
        else [ball.GetSolutionStepValue(Kratos.VELOCITY_X) for ball in balls]
    )
    stage.Finalize()
    return tuple(answer)


Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
serve(version("KratosDEMApplication"), collide)
