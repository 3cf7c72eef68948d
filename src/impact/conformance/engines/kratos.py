"""Kratos, application DEM: spheres, and a rigid face as the wall, with the law DEM_D_Linear_viscous_Coulomb."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

SETTINGS = "DEM_D_Linear_viscous_Coulomb, Symplectic_Euler, YOUNG_MODULUS for the time, no rolling friction"
NU = 0.3
# the stiffness is this times E* R*, between two spheres 1.432 as much
STIFFNESS = 0.31225 * math.pi
STEPS_BEFORE, CONTACTS = 1, 2.0


def block(head: str, *lines: str) -> str:
    """Write a block of a mesh."""
    return "\n".join((f"Begin {head}", *lines, f"End {head.split()[0]}", ""))


def part(name: str, nodes: str, kind: str, number: str) -> str:
    """Write the part of a ball or of the wall, whose nodes have numbers of one digit."""
    return block(f"SubModelPart {name}", block("SubModelPartNodes", *nodes), block(f"SubModelPart{kind}", number))


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision whose balls touch, side by side, after the first step."""
    # two spheres are no work for threads
    os.environ["OMP_NUM_THREADS"] = "1"
    import KratosMultiphysics as Kratos
    from KratosMultiphysics.DEMApplication.DEM_analysis_stage import DEMAnalysisStage
    from two_balls import answer_of, balls_of, damping_ratio, half_time, harmonic

    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    balls, steps = balls_of(c), STEPS_BEFORE + math.ceil(CONTACTS * c["contact_time"] / c["dt"])
    if not all(ball.is_solid for ball in balls):
        return answer_of(c, (), "compliant", error="particles are solid spheres")
    effective_mass, radius = harmonic(ball.m for ball in balls), harmonic(ball.R for ball in balls)
    frequency = 2.0 * half_time(damping_ratio(c["e"])) / c["contact_time"]
    stiffness = STIFFNESS * (1.432 if len(balls) == 2 else 1.0)
    # E* of two equal materials is E/(2 (1 - nu^2))
    modulus = 2.0 * (1.0 - NU**2) * effective_mass * frequency**2 / (stiffness * radius)
    starts = {ball.number: ball.start(STEPS_BEFORE * c["dt"]) for ball in balls}
    mesh = [
        block("Properties 0"),
        block("Nodes", *(f"{number} {x!r} {y!r} 0" for number, (x, y) in starts.items())),
        block("Elements SphericParticle3D", *(f"{number} 0 {number}" for number in starts)),
        block("NodalData RADIUS", *(f"{ball.number} 0 {ball.R!r}" for ball in balls)),
        *(part(f"ball{number}", number, "Elements", number) for number in starts),
    ]
    Path("ballsDEM.mdpa").write_text("".join(mesh), encoding="utf-8")
    Path("ballsDEM_FEM_boundary.mdpa").unlink(missing_ok=True)
    if len(balls) == 1:
        reach = 10.0 * c["R1"]
        wall = [
            block("Properties 0"),
            block("Nodes", f"3 0 -{reach} -{reach}", f"4 0 {reach} -{reach}", f"5 0 0 {reach}"),
            block("Conditions RigidFace3D3N", "1 0 3 4 5"),
            part("wall", "345", "Conditions", "1"),
        ]
        Path("ballsDEM_FEM_boundary.mdpa").write_text("".join(wall), encoding="utf-8")
    relation = {
        "COEFFICIENT_OF_RESTITUTION": c["e"],
        "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": "DEM_D_Linear_viscous_Coulomb",
        "STATIC_FRICTION": c["mu"],
        "DYNAMIC_FRICTION": c["mu"],
        "FRICTION_DECAY": 500.0,
        "ROLLING_FRICTION": 0.0,
    }
    parts = [f"SpheresPart.ball{ball.number}" for ball in balls] + ["RigidFacePart.wall"] * (2 - len(balls))
    settings = {
        "materials": [
            {
                "material_name": f"material{i}",
                "material_id": i,
                "Variables": {
                    "PARTICLE_DENSITY": ball.m / (4 / 3 * math.pi * ball.R**3),
                    "YOUNG_MODULUS": modulus,
                    "POISSON_RATIO": NU,
                },
            }
            for i, ball in enumerate((balls[0], balls[-1]), 1)
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
        "FinalTime": steps * c["dt"],
        "solver_settings": {
            "strategy": "sphere_strategy",
            "material_import_settings": {"materials_filename": "MaterialsDEM.json"},
        },
    }
    stage = DEMAnalysisStage(Kratos.Model(), Kratos.Parameters(json.dumps(parameters)))
    stage.Initialize()
    nodes = [stage.spheres_model_part.Nodes[int(ball.number)] for ball in balls]
    quantities = (Kratos.VELOCITY_X, Kratos.VELOCITY_Y, Kratos.ANGULAR_VELOCITY_Z)
    for ball, node in zip(balls, nodes, strict=True):
        for variable, value in zip(quantities, (ball.v, ball.u, ball.omega), strict=True):
            node.SetSolutionStepValue(variable, value)
    solver = stage._GetSolver()
    for _ in range(steps):
        stage.time = solver.AdvanceInTime(stage.time)
        solver.Predict()
        solver.SolveSolutionStep()
    motions = [[node.GetSolutionStepValue(variable) for variable in quantities] for node in nodes]
    stage.Finalize()
    return answer_of(c, motions, "compliant")
