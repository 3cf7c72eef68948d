"""Two spheres in Kratos, application DEM."""

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

MESH = """
Begin Properties 0
End Properties
Begin Nodes
1 {x1!r} 0 0
2 {x2!r} 0 0
End Nodes
Begin Elements SphericParticle3D
1 0 1
2 0 2
End Elements
Begin NodalData RADIUS
1 0 {R1!r}
2 0 {R2!r}
End NodalData
Begin SubModelPart ball1
Begin SubModelPartNodes
1
End SubModelPartNodes
Begin SubModelPartElements
1
End SubModelPartElements
End SubModelPart
Begin SubModelPart ball2
Begin SubModelPartNodes
2
End SubModelPartNodes
Begin SubModelPartElements
2
End SubModelPartElements
End SubModelPart
"""


def collide(
    law: str, E: float, nu: float, e: float, m1: float, m2: float, R1: float, R2: float, v1: float, v2: float,
    gap: float, step: float, count: int,
) -> tuple[float, float]:  # fmt: skip
    Path("ballsDEM.mdpa").write_text(MESH.format(x1=-R1 - gap, x2=R2, R1=R1, R2=R2), encoding="utf-8")
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
            for i, (mass, radius) in enumerate(((m1, R1), (m2, R2)), 1)
        ],
        "material_relations": [
            {
                "material_names_list": [f"material{i}", f"material{j}"],
                "material_ids_list": [i, j],
                "Variables": {
                    "STATIC_FRICTION": 0.0,
                    "DYNAMIC_FRICTION": 0.0,
                    "FRICTION_DECAY": 500.0,
                    "ROLLING_FRICTION": 0.0,
                    "COEFFICIENT_OF_RESTITUTION": e,
                    "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": law,
                },
            }
            for i, j in ((1, 1), (1, 2), (2, 2))
        ],
        "material_assignation_table": [[f"SpheresPart.ball{i}", f"material{i}"] for i in (1, 2)],
    }
    Path("MaterialsDEM.json").write_text(json.dumps(materials), encoding="utf-8")
    parameters = {
        "problem_name": "balls",
        "do_print_results_option": False,
        "dem_inlet_option": False,
        "GravityZ": 0.0,
        "RotationOption": False,
        "SearchTolerance": 0.01,
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
    balls = [stage.spheres_model_part.Nodes[i] for i in (1, 2)]
    for ball, speed in zip(balls, (v1, v2), strict=True):
        ball.SetSolutionStepValue(Kratos.VELOCITY_X, speed)
    solver = stage._GetSolver()
    for _ in range(count):
        stage.time = solver.AdvanceInTime(stage.time)
        solver.Predict()
        solver.SolveSolutionStep()
    velocities = tuple(ball.GetSolutionStepValue(Kratos.VELOCITY_X) for ball in balls)
    stage.Finalize()
    return velocities


Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
serve(version("KratosDEMApplication"), collide)
