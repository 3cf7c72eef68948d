"""Project Chrono, smooth contacts (SMC)."""

from __future__ import annotations

import math
import re

from ..contact.closed_forms.dashpot import gap_damping
from ..contact.models.cited_sources import CHRONO
from ..errors import UsageError
from ..formatting import number, quantity
from .code import Code, Collision, Lines, Parameters

# system, contact force model, and whether coefficients follow from the properties of the material
SETTINGS = {
    "chrono-smc-hertz": ("ChSystemSMC", "Hertz", True),
    "chrono-smc-hooke": ("ChSystemSMC", "Hooke", True),
    "chrono-smc-plaincoulomb": ("ChSystemSMC", "PlainCoulomb", True),
    "kelvin-voigt-no-tension": ("ChSystemSMC", "Hooke", False),
    "kuwabara-kono-1987": ("ChSystemSMC", "Hertz", False),
    "tsuji-1992": ("ChSystemMulticoreSMC", "Hertz", True),
    "liggghts-hooke": ("ChSystemMulticoreSMC", "Hooke", True),
    "chrono-smc-flores": ("ChSystemMulticoreSMC", "Flores", True),
}
# the default of ChContactMaterialSMC, taken where only the stiffness of the contact is known
POISSON_RATIO = 0.3
# major releases: the oldest whose sources were read, and that with new names of the material and ChCollisionInfo
OLDEST, RENAMED_SINCE = 6, 9
# mass of a fixed body over the mass of the other one
FIXED_MASS_RATIO = 1e9


def read_version(text: str) -> str:
    """Read a release as Chrono writes it.

    >>> read_version("v9.0.1")
    '9.0.1'
    """
    match = re.fullmatch(r"v?((\d+)\.\d+(\.\d+)?)", text)
    if match is None:
        raise UsageError(f'got "{text}", expected a release, such as 9.0.1')
    if int(match[2]) < OLDEST:
        raise UsageError(f"got {match[1]}, expected 6.0.0 or later: older releases were not read")
    return match[1]


def from_material(collision: Collision) -> bool:
    """Return whether coefficients follow from Young's modulus; a linear spring of its own stiffness has none."""
    _, force, of_material = SETTINGS[collision.model.key]
    return of_material and not (force == "Hooke" and collision.has_user_stiffness)


def parameters(c: Collision) -> dict[str, float | str]:
    """Write the properties of the material, or the coefficients kn and gn, and the settings of the system."""
    system, force, _ = SETTINGS[c.model.key]
    settings: dict[str, float | str] = {"ContactForceModel": force}
    if not from_material(c):
        return settings | coefficients(c)
    if c.has_materials:
        moduli = {"YoungModulus": c["E1"], "PoissonRatio": c["nu1"]}
        if not c.has_one_material:
            moduli |= {"YoungModulus2": c["E2"], "PoissonRatio2": c["nu2"]}
    else:
        root = 1.0 if force == "PlainCoulomb" else math.sqrt(c.effective_radius)
        modulus = 0.75 * c["K"] / root
        moduli = {"YoungModulus": 2.0 * (1.0 - POISSON_RATIO**2) * modulus, "PoissonRatio": POISSON_RATIO}
    settings |= moduli | {"Restitution": c["e"]}
    if force in ("Hooke", "Flores"):
        settings["CharacteristicImpactVelocity"] = c["vc"]
    if force != "PlainCoulomb" and system == "ChSystemSMC":
        settings["EffectiveCurvatureRadius"] = c.effective_radius
    return settings


def coefficients(c: Collision) -> dict[str, float | str]:
    """kn and gn: Hooke multiplies gn by m, Hertz multiplies kn by R* √δ and gn by R* √δ m."""
    K, m = c["K"], c["m"]
    if c.model.key == "kuwabara-kono-1987":
        radius = c.effective_radius
        return {"Kn": K / radius, "Gn": 1.5 * c["A"] * K / (radius * m), "EffectiveCurvatureRadius": radius}
    if c.model.key == "kelvin-voigt-no-tension":
        return {"Kn": K, "Gn": c["C"] / m}
    return {"Kn": K, "Gn": 2.0 * float(gap_damping(c["e"])) * math.sqrt(K / m)}


def lines(collision: Collision, parameters: Parameters) -> Lines:
    system, force, _ = SETTINGS[collision.model.key]
    new_names = int(collision.version.partition(".")[0]) >= RENAMED_SINCE
    material_class = "ChContactMaterialSMC" if new_names else "ChMaterialSurfaceSMC"
    info = "ChCollisionInfo" if new_names else "collision::ChCollisionInfo"
    names = ["material1", "material2"] if "YoungModulus2" in parameters else ["material"]
    for name, suffix in zip(names, ("", "2"), strict=False):
        yield f"auto {name} = chrono_types::make_shared<{material_class}>();"
        for setter in ("YoungModulus", "PoissonRatio", "Restitution", "Kn", "Gn"):
            value = parameters.get(setter + suffix, parameters.get(setter))
            if value is not None:
                yield f"{name}->Set{setter}({value!r});"
    properties = str(from_material(collision)).lower()
    yield f"{system} sys;"
    if system == "ChSystemSMC":
        set_speed = "sys.SetCharacteristicImpactVelocity({!r});"
        yield f"sys.UseMaterialProperties({properties});"
        yield f"sys.SetContactForceModel(ChSystemSMC::{force});"
    else:
        set_speed = "sys.GetSettings()->solver.characteristic_vel = {!r};"
        yield f"sys.GetSettings()->solver.use_material_properties = {properties};"
        yield f"sys.GetSettings()->solver.contact_force_model = ChSystemSMC::{force};"
        yield "sys.GetSettings()->solver.tangential_displ_mode = ChSystemSMC::OneStep;"
    if "CharacteristicImpactVelocity" in parameters:
        yield set_speed.format(parameters["CharacteristicImpactVelocity"])
    if "EffectiveCurvatureRadius" in parameters:
        yield f"{info}::SetDefaultEffectiveCurvatureRadius({parameters['EffectiveCurvatureRadius']!r});"
    masses = (collision["m1"], collision["m2"])
    if math.inf in masses:
        yield f"wall->SetMass({FIXED_MASS_RATIO * min(masses)!r});"
    yield f"sys.DoStepDynamics({collision.dt!r});"


def notes(collision: Collision) -> Lines:
    system, force, _ = SETTINGS[collision.model.key]
    multicore = system == "ChSystemMulticoreSMC"
    yield "in SI, C++; the material keeps its values in single precision"
    if from_material(collision):
        yield "two materials: E* = 1/((1 - nu1^2)/E1 + (1 - nu2^2)/E2), and the smaller restitution"
        if not collision.has_materials:
            yield f"the modulus gives K = {number(collision['K'])} with a Poisson ratio of {POISSON_RATIO}"
    else:
        yield "two materials: the arithmetic means of Kn and of Gn"
        factors = "Gn by m" if force == "Hooke" else "Kn by R* sqrt(delta), Gn by R* sqrt(delta) m"
        yield f"the system multiplies {factors}, with m = m1 m2/(m1 + m2)"
    if force == "Hooke" and from_material(collision):
        yield "the stiffness follows from the characteristic impact velocity, by default 1 m/s"
    if force == "PlainCoulomb":
        yield "the stiffness does not depend on the radii"
    elif not multicore and (force == "Hertz" or from_material(collision)):
        yield "with Bullet, R* is one value for all contacts, by default 0.1 m, not that of the shapes"
    if force == "Flores":
        yield from (
            "the damping is divided by characteristic_vel, in MultiStep by the larger of it and the closing speed",
            "ChSystemSMC has no Flores; it takes Hooke instead",
        )
    yield (
        "the force may become attractive before separation; ChSystemSMC removes this and changes the law"
        if multicore
        else "the force is never negative, but for adhesion, by default 0; ChSystemMulticoreSMC lets it pull"
    )
    yield "no speed switches the restitution off; SetMinBounceSpeed is of the other contact method, NSC"
    if math.inf in (collision["m1"], collision["m2"]):
        yield "m is taken with the mass of a fixed body too, by default 1 kg: it has to be large"
    yield "the same law in 6.0.0 to 10.0.0; before 9.0.0 the material was ChMaterialSurfaceSMC"


def warnings(c: Collision) -> Lines:
    if c.model.key == "chrono-smc-flores" and abs(c["vc"] / c["v0"] - 1.0) > 0.01:
        yield (
            f"Flores takes characteristic_vel = {quantity(c['vc'], 'm/s')} for the closing speed, which is "
            f"{quantity(c['v0'], 'm/s')}: the restitution depends on their ratio"
        )


CODE = Code(
    title="Project Chrono, SMC",
    laws={
        key: f"{system}, {force}" + ("" if of_material else ", kn and gn")
        for key, (system, force, of_material) in SETTINGS.items()
    },
    newest="10.0.0",
    tested=f"not run by us; read in {CHRONO}",
    read_version=read_version,
    comment=("// ", ""),
    parameters=parameters,
    lines=lines,
    notes=notes,
    warnings=warnings,
)
