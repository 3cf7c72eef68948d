"""MercuryDPM, species of viscoelastic contacts."""

from __future__ import annotations

import math

from ..formatting import quantity
from .code import Code, Collision, Lines, Parameters

SPECIES = {
    "mercurydpm-linear-viscoelastic": "LinearViscoelasticSpecies",
    "tsuji-1992": "HertzianViscoelasticSpecies",
    "kuwabara-kono-1987": "HertzianBSHPViscoelasticSpecies",
}


def parameters(c: Collision) -> dict[str, float | str]:
    """Write the arguments of the setters; the mass is twice the effective one."""
    if c.model.key == "mercurydpm-linear-viscoelastic":
        return {"stiffness": c["K"], "restitution": c["e"], "mass": 2.0 * c["m"]}
    loss = {"restitution": c["e"]} if c.model.key == "tsuji-1992" else {"dissipation": c["A"]}
    return {"effectiveElasticModulus": 0.75 * c["K"] / math.sqrt(c.effective_radius), **loss}


def lines(collision: Collision, parameters: Parameters) -> Lines:
    name = SPECIES[collision.model.key]
    values = [repr(value) for value in parameters.values()]
    yield f"{name} species;"
    if name == "LinearViscoelasticSpecies":
        yield f"species.setStiffnessAndRestitutionCoefficient({', '.join(values)});"
    elif name == "HertzianViscoelasticSpecies":
        yield f"species.setEffectiveElasticModulusAndRestitutionCoefficient({', '.join(values)});"
    else:
        yield f"species.setEffectiveElasticModulus({values[0]});"
        yield f"species.setDissipation({values[1]});"
    yield f"setTimeStep({collision.dt!r});"


def notes(c: Collision) -> Lines:
    yield "in SI, C++; the values are those of the pair"
    if c.model.key == "mercurydpm-linear-viscoelastic":
        yield "two species: the mixed one has the harmonic means 2/(1/a + 1/b) of stiffness and dissipation"
        yield f"the mass is twice the effective one: 2 m1 m2/(m1 + m2) = {quantity(2.0 * c['m'], 'kg')}"
        yield "the setter stores a dissipation constant: other masses of the same species have another restitution"
        yield "after setConstantRestitution (since 2021) stiffness and dissipation are per mass 2 m1 m2/(m1 + m2)"
    else:
        yield "the modulus is E* = 1/((1 - nu1^2)/E1 + (1 - nu2^2)/E2)"
        yield "two species: the mixed one has the harmonic means 2/(1/a + 1/b), which is right for their own E*"
    if c.model.key == "tsuji-1992":
        yield "before September 2021 the setter was setElasticModulusAndRestitutionCoefficient"
    if c.model.key == "kuwabara-kono-1987":
        yield "the force is never negative; the species exists since September 2022"
    else:
        yield "the force pulls before the contact ends"
    yield "no speed switches the restitution off"


CODE = Code(
    title="MercuryDPM",
    laws=SPECIES,
    newest="1.0 (trunk of July 2024)",
    tested="not run by us; read in kuwt/MercuryDPM_fork, Kernel @fb0ebf1d (2024)",
    comment=("// ", ""),
    parameters=parameters,
    lines=lines,
    notes=notes,
)
