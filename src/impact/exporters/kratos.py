"""Kratos, application DEM."""

from __future__ import annotations

import json

from .code import Code, Collision, Lines, Parameters
from .programs import python_package

LAWS = {
    "kratos-hertz": "DEM_D_Hertz_viscous_Coulomb",
    "kratos-linear": "DEM_D_Linear_viscous_Coulomb",
}
# the normal is along x at the first touch, the tangent along y, so that spins are about z
TEMPLATE = '''\
import json
import math
import os

# two spheres are no work for threads
os.environ["OMP_NUM_THREADS"] = "1"
import KratosMultiphysics as Kratos
from KratosMultiphysics.DEMApplication.DEM_analysis_stage import DEMAnalysisStage

Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
with open("ballsDEM.mdpa", "w") as mesh:
    mesh.write("""
Begin Properties 0
End Properties
Begin Nodes
{% for ball in balls %}
{{ ball.number }} {{ ball.x }} {{ ball.y if has_friction else "0" }} 0
{% endfor %}
End Nodes
Begin Elements SphericParticle3D
{% for ball in balls %}
{{ ball.number }} 0 {{ ball.number }}
{% endfor %}
End Elements
Begin NodalData RADIUS
{% for ball in balls %}
{{ ball.number }} 0 {{ ball.R }}
{% endfor %}
End NodalData
{% for ball in balls %}
Begin SubModelPart ball{{ ball.number }}
Begin SubModelPartNodes
{{ ball.number }}
End SubModelPartNodes
Begin SubModelPartElements
{{ ball.number }}
End SubModelPartElements
End SubModelPart
{% endfor %}
""")

{% if has_wall %}
{# a triangle around the origin #}
with open("ballsDEM_FEM_boundary.mdpa", "w") as mesh:
    mesh.write("""
Begin Properties 0
End Properties
Begin Nodes
3 0 -{{ reach }} -{{ reach }}
4 0 {{ reach }} -{{ reach }}
5 0 0 {{ reach }}
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
""")

{% endif %}
{{ lines }}

materials = {
    "materials": [
        {
            "material_name": f"material{i}",
            "material_id": i,
            "Variables": {**elastic, "PARTICLE_DENSITY": mass / (4 / 3 * math.pi * radius**3)},
        }
        for i, (elastic, mass, radius) in enumerate(
{% set second = [m1, R1] if has_wall else [m2, R2] %}
            ((material1, {{ m1 }}, {{ R1 }}), (material2, {{ second | join(", ") }})), 1
        )
    ],
    "material_relations": [
        {
            "material_names_list": [f"material{i}", f"material{j}"],
            "material_ids_list": [i, j],
            "Variables": relation,
        }
        for i, j in ((1, 1), (1, 2), (2, 2))
    ],
{% if has_wall %}
    "material_assignation_table": [["SpheresPart.ball1", "material1"], ["RigidFacePart.wall", "material2"]],
{% else %}
    "material_assignation_table": [[f"SpheresPart.ball{i}", f"material{i}"] for i in (1, 2)],
{% endif %}
}
with open("MaterialsDEM.json", "w") as file:
    json.dump(materials, file)
stage = DEMAnalysisStage(Kratos.Model(), Kratos.Parameters(json.dumps({
    **parameters,
    "problem_name": "balls",
    "FinalTime": {{ steps }} * parameters["MaxTimeStep"],
    "do_print_results_option": False,
    "dem_inlet_option": False,
    "GravityZ": 0.0,
    "RotationOption": {{ has_friction }},
    "SearchTolerance": {{ reach }},
{% if has_wall %}
    "search_tolerance_against_walls": {{ reach }},
{% endif %}
    "NeighbourSearchFrequency": 100,
    "solver_settings": {
        "strategy": "sphere_strategy",
        "material_import_settings": {"materials_filename": "MaterialsDEM.json"},
    },
})))
stage.Initialize()
balls = [stage.spheres_model_part.Nodes[i] for i in {{ tuples("number") }}]
{% if has_friction %}
for ball, speed, u, omega in zip(balls, {{ tuples("v") }}, {{ tuples("u") }}, {{ tuples("omega") }}):
    ball.SetSolutionStepValue(Kratos.VELOCITY_Y, u)
    ball.SetSolutionStepValue(Kratos.ANGULAR_VELOCITY_Z, omega)
{% else %}
for ball, speed in zip(balls, {{ tuples("v") }}):
{% endif %}
    ball.SetSolutionStepValue(Kratos.VELOCITY_X, speed)
solver = stage._GetSolver()
for _ in range({{ steps }}):
    stage.time = solver.AdvanceInTime(stage.time)
    solver.Predict()
    solver.SolveSolutionStep()
{% set value = ("balls[0]" if has_wall else "ball") ~ ".GetSolutionStepValue" %}
v1, v2 = {{ each(value ~ "(Kratos.VELOCITY_X)", "ball in balls", v2) }}
{% if has_friction %}
u1, u2 = {{ each(value ~ "(Kratos.VELOCITY_Y)", "ball in balls", u2) }}
omega1, omega2 = {{ each(value ~ "(Kratos.ANGULAR_VELOCITY_Z)", "ball in balls", "0.0") }}
{% endif %}
{{ print_beta }}print("e_out =", (v2 - v1) / {{ v0 }}, flush=True)
# not to end with the messages of Kratos
os._exit(0)
'''


def parameters(c: Collision) -> dict[str, float | str]:
    """Variables of the materials and of their relation, by their names in Kratos."""
    c.require_materials("Kratos takes Young's modulus and Poisson's ratio")
    values: dict[str, float | str] = {"YOUNG_MODULUS": c["E1"], "POISSON_RATIO": c["nu1"]}
    if not c.has_one_material:
        values |= {"YOUNG_MODULUS2": c["E2"], "POISSON_RATIO2": c["nu2"]}
    if c.friction:
        values |= {"STATIC_FRICTION": c["mu"], "DYNAMIC_FRICTION": c["mu"]}
    return values | {
        "COEFFICIENT_OF_RESTITUTION": c["e"],
        "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": LAWS[c.model.key],
    }


def lines(collision: Collision, parameters: Parameters) -> Lines:
    elastic = ("YOUNG_MODULUS", "POISSON_RATIO")
    for i in ("1", "2"):
        material = {name: parameters.get(f"{name}{i}", parameters[name]) for name in elastic}
        yield f"material{i} = {json.dumps(material)}"
    law = ("COEFFICIENT_OF_RESTITUTION", "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME")
    relation = {name: parameters.get(name, 0.0) for name in (*law, "STATIC_FRICTION", "DYNAMIC_FRICTION")}
    relation |= {"FRICTION_DECAY": 500.0, "ROLLING_FRICTION": 0.0}
    yield "relation = {"
    yield from (f"    {json.dumps(name)}: {json.dumps(value)}," for name, value in relation.items())
    yield "}"
    project = {"TranslationalIntegrationScheme": "Symplectic_Euler", "MaxTimeStep": collision.dt}
    yield f"parameters = {json.dumps(project)}"


def notes(collision: Collision) -> Lines:
    yield "in SI; material1 and material2 are Variables of materials in MaterialsDEM.json, relation of their pair"
    yield "parameters are keys of ProjectParametersDEM.json"
    yield "two materials: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; the restitution is that of the pair"
    yield "an e below 0.001 is raised to it, and above 0.999 there is no damping; the force is never negative"
    if collision.has_wall:
        yield "material2 is of the rigid face; it is found within search_tolerance_against_walls, unset 0"
    if collision.friction:
        yield "the tangential stiffness follows from nu: k_t/k_n = 4 G*/E*, 2 (1 - nu)/(2 - nu) of equal materials"
        yield "RotationOption is true: without it balls slide, but do not spin"
        yield "friction acts at less than the radius from the centre, by a part of the indentation"
    else:
        yield "no friction: replace STATIC_FRICTION and DYNAMIC_FRICTION by yours"
    if collision.model.key == "kratos-linear":
        yield "Kratos finds the damping ratio by bisection to 1e-4"
    yield "a sphere finds its neighbours only every NeighbourSearchFrequency steps, within SearchTolerance"


CODE = Code(
    title="Kratos DEM",
    laws=LAWS,
    newest="10.4.4",
    tested="scripts were run in Kratos DEM 10.4.4",
    scheme="kick-drift",
    # Kratos finds the damping ratio of this law by bisection to 1e-4
    uncertainty={"kratos-linear": 1e-4},
    parameters=parameters,
    lines=lines,
    notes=notes,
    template=TEMPLATE,
    frictions={"kratos-viscous-coulomb": "STATIC_FRICTION and DYNAMIC_FRICTION, the same"},
    shortens_arms=True,
    program=python_package("KratosDEMApplication"),
)
