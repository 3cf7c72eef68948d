"""LAMMPS, pair style granular."""

from __future__ import annotations

import math
import re
from datetime import datetime

import numpy as np

from ..contact.frictions.granular_codes import LAMMPS_LINEAR, LAMMPS_MINDLIN
from ..contact.materials import effective_shear_modulus
from ..contact.models.lammps import LAMMPS_MODELS
from ..errors import UsageError
from ..formatting import argument, number
from .code import Code, Collision, Lines, Parameters
from .programs import Program, printed_version


def words_of(key: str) -> tuple[str, str, str]:
    """Find the normal model, the damping model and the option that a key names; tsuji alone is of hertz.

    >>> words_of("lammps-mass-velocity-hooke-limit"), words_of("lammps-tsuji-without-root")
    (('hooke', 'mass_velocity', ' limit_damping'), ('hertz', 'tsuji', ''))
    """
    damping = re.sub("^lammps-|-(hertz|hooke|without-root|limit)", "", key).replace("-", "_")
    return "hooke" if "-hooke" in key else "hertz", damping, " limit_damping" if key.endswith("-limit") else ""


OPTIONS = {law.key: words_of(law.key) for law in LAMMPS_MODELS}
# pull request 5113 with the factor √2 was last discussed on this day; releases since then have it
ROOT_SINCE = "20260729"
# the first releases with coeff_restitution and with limit_damping, by month
COEFF_RESTITUTION_SINCE, LIMIT_SINCE = "20240601", "20210408"
# the first release that was seen in which hertz/material is right at a wall and for two materials. Those of 29
# September 2021 and 23 June 2022 were seen to have 1.3 times the stiffness at a wall for nu = 0.3, and to mix two
# materials to a force by which two balls separate twenty times as fast as they met
MATERIAL_SINCE = "20240829"
# the forms of a date, and how `datetime` calls them
DATES = (
    (r"^(\d{4})(\d\d)(\d\d)$", "%Y %m %d"),
    (r"(\d{1,2}) ?([A-Z][a-z]{2})[a-z]* ?(\d{4})", "%d %b %Y"),
    (r"^(\d{4})[.-](\d{1,2})[.-](\d{1,2})", "%Y %m %d"),
)
# tangential model of pair style granular, by key of the catalogue
FRICTIONS = {law.key: law.title.removeprefix("LAMMPS ") for law in (*LAMMPS_LINEAR, *LAMMPS_MINDLIN)}
# of LAMMPS and LIGGGHTS; the normal is along x, the tangent along y, so that spins are about z. A compute has a
# value after the run if it was printed at the last step
RUN = """\
{% if has_friction %}
compute         spin all property/atom omegaz
{% for ball in balls %}
group           ball{{ ball.number }} id {{ ball.number }}
compute         spin{{ ball.number }} ball{{ ball.number }} reduce sum c_spin
variable        omega{{ ball.number }} equal c_spin{{ ball.number }}
{% endfor %}
{% if has_wall %}
variable        omega2 equal 0.0
{% endif %}
thermo_style    custom step v_omega1 v_omega2
thermo          1000000000
{% endif %}
run             {{ steps }}
"""
PRINT_BETA = """\
{% if has_friction %}
variable        u1 equal vy[1]
variable        u2 equal {{ u2 if has_wall else "vy[2]" }}
variable        beta equal -(v_u1+{{ R1 }}*v_omega1-v_u2+{{ rim2 }}*v_omega2)/{{ slip }}
print           "beta = ${beta}"
print           "omega1 = ${omega1}"
print           "omega2 = ${omega2}"
{% endif %}
"""
TEMPLATE = (
    """\
units           si
atom_style      sphere
atom_modify     map array
comm_modify     vel yes
boundary        f f f
region          box block -{{ reach }} {{ reach }} -{{ reach }} {{ reach }} -{{ reach }} {{ reach }}
create_box      {{ balls | length }} box
{% for ball in balls %}
create_atoms    {{ ball.number }} single {{ ball.x }} {{ ball.y }} 0
{% endfor %}
{% for ball in balls %}
{% set size = "diameter " ~ ball.d ~ " mass " ~ ball.m %}
{% set spin = " omega 0 0 " ~ ball.omega if has_friction else "" %}
set             atom {{ ball.number }} {{ size }} vx {{ ball.v }} vy {{ ball.u }} vz 0{{ spin }}
{% endfor %}
neighbor        {{ skin }} bin
{{ lines }}
fix             1 all nve/sphere
{% if not has_friction %}
thermo          1000000000
{% endif %}
"""
    + RUN
    + """\
variable        v1 equal vx[1]
variable        v2 equal {{ v2 if has_wall else "vx[2]" }}
"""
    + PRINT_BETA
    + """\
variable        e_out equal (v_v2-v_v1)/{{ v0 }}
print           "e_out = $(v_e_out:%.17g)"
quit
"""
)


def read_version(text: str) -> str:
    """Read the date of a release as YYYYMMDD, from any form in which LAMMPS and its packages write it.

    >>> read_version("22 Jul 2025"), read_version("stable_29Aug2024_update1"), read_version("2025.7.22.4.0")
    ('20250722', '20240829', '20250722')
    """
    for pattern, form in DATES:
        if match := re.search(pattern, text):
            try:
                return datetime.strptime(" ".join(match.groups()), form).date().isoformat().replace("-", "")
            except ValueError:
                # a day that no month has, or a month that no year has
                break
    raise UsageError(f'got "{text}", expected the date of a release, such as 22Jul2025')


def law_for_version(key: str, version: str) -> str:
    """Find the tsuji of a version, with the factor √2 or without it, and any other law that the version has.

    >>> law_for_version("lammps-tsuji", "20250722"), law_for_version("lammps-tsuji-without-root-limit", "20260901")
    ('lammps-tsuji-without-root', 'lammps-tsuji-limit')
    """
    _, damping, limit = OPTIONS[key]
    for name, since in (("coeff_restitution", COEFF_RESTITUTION_SINCE), ("limit_damping", LIMIT_SINCE)):
        if name in (damping, limit.strip()) and version < since:
            # the version may be that of the installed program
            origin = argument("code_version")
            raise UsageError(f"LAMMPS {version} has no {name}, expected {origin} {since} or later")
    if damping != "tsuji":
        return key
    stem = key.removesuffix("-limit").removesuffix("-without-root")
    return stem + ("" if version >= ROOT_SINCE else "-without-root") + ("-limit" if key.endswith("-limit") else "")


def parameters(collision: Collision) -> dict[str, float | str]:
    """Write the numbers of pair_coeff; of hertz, k_n is K/√R*."""
    spring, option, _ = OPTIONS[collision.model.key]
    if option == "coeff_restitution" and collision["e"] == 0.0:
        raise UsageError("e: got 0, expected e > 0: LAMMPS takes its logarithm, and all velocities become NaN")
    damping = collision.model.damping
    # LAMMPS names every damping constant eta_n0
    strength: dict[str, float | str] = {"eta_n0": collision[damping]} if damping else {"e": collision["e"]}
    if takes_moduli(collision):
        of_normal = {"E": collision["E1"], **strength, "nu": collision["nu1"]} | (
            {} if collision.has_one_material else {"E2": collision["E2"], "nu2": collision["nu2"]}
        )
    else:
        k = collision["K"] if spring == "hooke" else collision["K"] / math.sqrt(collision.effective_radius)
        of_normal = {"k_n": k, **strength}
    return {**of_normal, **friction_parameters(collision)}


def friction_parameters(collision: Collision) -> dict[str, float | str]:
    """Write the numbers of the tangential model.

    That of Mindlin has a stiffness per contact radius; NULL is 8 G* of the material of
    hertz/material, and another stiffness where LAMMPS mixes two of them.
    """
    if not collision.friction:
        return {}
    last: dict[str, float | str] = {"x_gammat": collision["xt"], "mu": collision["mu"]}
    if collision.friction == "lammps-linear-nohistory":
        return last
    k_t, is_linear = collision["k_t"], collision.friction == "lammps-linear-history"
    if math.isnan(k_t) and not math.isnan(collision["kt_over_kn"]):
        k_t = collision["kt_over_kn"] * collision["n"] * collision["K"]
    if math.isnan(k_t) and takes_moduli(collision) and collision.has_one_material:
        return {"k_t": "NULL", **last}
    if math.isnan(k_t):
        moduli = (np.array(collision[name]) for name in ("E1", "nu1", "E2", "nu2"))
        return {"k_t": 8.0 * float(effective_shear_modulus(*moduli)), **last}
    return {"k_t": k_t if is_linear else k_t / math.sqrt(collision.effective_radius), **last}


def takes_moduli(collision: Collision) -> bool:
    """Return whether hertz/material has the stiffness; a wall is of the material of the ball there."""
    if OPTIONS[collision.model.key][0] != "hertz" or not collision.has_materials:
        return False
    if collision.version < MATERIAL_SINCE:
        return collision.has_one_material and not collision.has_wall
    return collision.has_one_material or not collision.has_wall


def lines(collision: Collision, parameters: Parameters) -> Lines:
    spring, damping, limit = OPTIONS[collision.model.key]
    # without friction the tangential force is zero
    names = [name for name in ("k_t", "x_gammat", "mu") if name in parameters]
    numbers = " ".join(str(parameters[name]) for name in names) if collision.friction else "0.0 0.0"
    rest = f"damping {damping} tangential {FRICTIONS.get(collision.friction, 'linear_nohistory')} {numbers}{limit}"
    of_normal = [repr(value) for name, value in parameters.items() if name not in names]
    by_types = {"* *": of_normal}
    if "E2" in parameters:
        E, strength, nu, E2, nu2 = of_normal
        by_types = {"1 1": [E, strength, nu], "2 2": [E2, strength, nu2]}
    model = "hertz/material" if "E" in parameters else spring
    if not collision.has_wall:
        yield "pair_style      granular"
    for types, words in by_types.items():
        contact = f"{model} {' '.join(words)} {rest}"
        if collision.has_wall:
            yield f"fix             wall all wall/gran granular {contact} xplane NULL 0.0"
        else:
            yield f"pair_coeff      {types} {contact}"
    yield f"timestep        {collision.dt!r}"


def notes(collision: Collision) -> Lines:
    spring, damping, limit = OPTIONS[collision.model.key]
    yield "in SI (units si, atom_style sphere); R* and m are the effective radius and mass, 1/(1/R1 + 1/R2)"
    if collision.version < MATERIAL_SINCE and spring == "hertz" and not takes_moduli(collision):
        yield "hertz/material has another stiffness at a wall and for two materials in old releases"
    elif collision.has_wall and spring == "hertz":
        yield "hertz/material takes one material, of the ball and the wall; hertz with k_n takes two into account"
    if takes_moduli(collision) and not collision.has_wall:
        yield (
            "two materials: E* = 1/((1 - nu1^2)/E1 + (1 - nu2^2)/E2); damping is the geometric mean of both types"
        )
    if spring == "hertz" and not takes_moduli(collision):
        yield f"k_n = K/sqrt(R*), for R* = {number(collision.effective_radius)} m; hertz/material takes E and nu"
    if damping == "viscoelastic":
        yield "eta_n0 is per effective mass and contact radius, in 1/(m s)"
    if damping == "mass_velocity":
        yield "eta_n0 is per effective mass, in 1/s"
    if damping == "velocity":
        yield "eta_n0 is the damping constant, in N s/m"
    yield (
        "limit_damping: the force is never negative"
        if limit
        else "the force becomes attractive before separation; limit_damping removes this and changes the law"
    )
    if not collision.friction:
        yield "no friction: replace the tangential model by yours; comm_modify vel yes is needed in any case"
        return
    yield "x_gammat multiplies the damping of the normal model; comm_modify vel yes is needed"
    if collision.has_wall:
        yield from (
            "fix wall/gran hooke/history and hertz/history of 22 July 2025: their friction depends on the unit of",
            "length, and 13 of 41 impacts had another beta than their law; in that of 23 June 2022 none had",
        )
    else:
        yield "the normal of two balls turns during the contact, by some indentation/radius; here it is fixed"


def warnings(collision: Collision) -> Lines:
    if OPTIONS[collision.model.key][1] == "tsuji" and collision.version < ROOT_SINCE:
        other = (
            f"use {argument('model', 'lammps-coeff-restitution-hertz')}"
            if collision.version >= COEFF_RESTITUTION_SINCE
            else f"releases since {COEFF_RESTITUTION_SINCE} have coeff_restitution"
        )
        yield (
            f"damping tsuji of LAMMPS {collision.version} lacks the factor sqrt(2) of pull request 5113 (July "
            f"2026): where e = 0.5 is asked for, hertz delivers 0.616; {other}"
        )
    elif collision.friction == "lammps-mindlin" and collision["xt"]:
        yield (
            "tangential mindlin with damping comes to its limit slowly: with x_gammat = 1, beta is off by 0.03 at "
            "100 steps per contact; use a variant"
        )


CODE = Code(
    title="LAMMPS, pair style granular",
    laws={key: f"{spring}, damping {damping}{limit}" for key, (spring, damping, limit) in OPTIONS.items()},
    newest="20250722",
    tested="scripts were run in LAMMPS 22 July 2025",
    scheme="kick-drift",
    parameters=parameters,
    lines=lines,
    law_for_version=law_for_version,
    read_version=read_version,
    notes=notes,
    warnings=warnings,
    template=TEMPLATE,
    frictions=FRICTIONS,
    suffix=".in",
    program=Program(
        "lmp",
        "pip install lammps mpich",
        printed_version("-help", r"Simulator - (\d+ \w+ \d+)"),
        lambda program, file: (program, "-in", file, "-log", "none"),
    ),
)
