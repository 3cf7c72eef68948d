"""LIGGGHTS: linear springs, model hooke with tangential history; each collision is a process of the program."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

# Young's moduli outside 5e6 to 1e9 Pa have to be allowed: here, they follow from the contact time
SCRIPT = """
units si
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
hard_particles yes
soft_particles yes
region box block -{reach} {reach} -{reach} {reach} -{reach} {reach} units box
create_box 1 box
neighbor {skin} bin
neigh_modify delay 0
fix 1 all property/global youngsModulus peratomtype {modulus}
fix 2 all property/global poissonsRatio peratomtype {nu}
fix 3 all property/global coefficientRestitution peratomtypepair 1 {e}
fix 4 all property/global coefficientFriction peratomtypepair 1 {mu}
fix 5 all property/global characteristicVelocity scalar {speed}
pair_style {contact}
pair_coeff * *
{balls}
{wall}
timestep {dt}
fix integrate all nve/sphere
dump 1 all custom {steps} velocities id vx vy omegaz
dump_modify 1 format "%d %.17g %.17g %.17g"
run {steps}
"""
# ktToKnUser on: the tangential spring is 2/7 of the normal one, both have the same period for solid balls
CONTACT = "gran model hooke tangential history"
OPTIONS = "tangential_damping off ktToKnUser on"
NU = 0.3
# the balls touch after half of a step, and three contact times are run
PHASE, CONTACTS = 0.5, 3.0
SOLID = 0.4
# one process needs neither the network for which MPI would look each time, nor the daemon that it would start
ALONE = {"OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self", "OMPI_MCA_ess_singleton_isolated": "1"}
ENVIRONMENT = os.environ | ALONE


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision in the program that, before its version, ends the command."""
    program, version = sys.argv[-2:]
    facts: dict[str, Any] = {
        "version": version,
        "kind": "compliant",
        "law": "liggghts-history",
        "model": "liggghts-hooke",
        "parameters": {"tangential_damping": "off", "tangential_reduce": "on"},
    }
    numbers = "1" if c["m2"] is None else "12"
    if any(abs(c[f"inertia{n}"] / (SOLID * c[f"m{n}"] * c[f"R{n}"] ** 2) - 1.0) > 1e-9 for n in numbers):
        return {"id": c["id"], "error": "atoms are solid spheres", **facts}
    balls = ""
    for number in numbers:
        mass, R, v, u, omega = (c[f"{name}{number}"] for name in ("m", "R", "v", "u", "omega"))
        x = (-R if number == "1" else R) - v * PHASE * c["dt"]
        balls += f"create_atoms 1 single {x!r} {-u * PHASE * c['dt']!r} 0\n"
        balls += f"set atom {number} diameter {2.0 * R!r} mass {mass!r} vx {v!r} vy {u!r} vz 0\n"
        balls += f"set atom {number} omegaz {omega!r}\n"
    mass, radius = (1.0 / sum(1.0 / c[f"{name}{number}"] for number in numbers) for name in ("m", "R"))
    # any speed gives the stiffness that the contact time needs, with a modulus of its own
    speed = radius / c["contact_time"]
    k = mass * (math.pi**2 + math.log(c["e"]) ** 2) / c["contact_time"] ** 2
    # k = A^(4/5) (m speed^2)^(1/5) with A = 16/15 sqrt(R) E*, and E* = E/(2 (1 - nu^2)) of one material
    effective_modulus = (k**5 / (mass * speed**2)) ** 0.25 * 15.0 / (16.0 * math.sqrt(radius))
    largest = max(c[f"R{number}"] for number in numbers)
    script = SCRIPT.format(
        reach=10.0 * largest,
        skin=0.1 * largest,
        modulus=repr(2.0 * (1.0 - NU**2) * effective_modulus),
        nu=NU,
        e=c["e"],
        mu=c["mu"],
        speed=repr(speed),
        contact=f"{CONTACT} {OPTIONS}",
        balls=balls,
        wall="" if len(numbers) == 2 else f"fix wall all wall/{CONTACT} primitive type 1 xplane 0.0 {OPTIONS}",
        dt=repr(c["dt"]),
        steps=math.ceil(CONTACTS * c["contact_time"] / c["dt"]),
    )
    Path("velocities").unlink(missing_ok=True)
    process = subprocess.run(
        [program, "-log", "none"], input=script, capture_output=True, text=True, check=False, env=ENVIRONMENT
    )
    if process.returncode or "ERROR" in process.stdout:
        raise RuntimeError((process.stdout + process.stderr)[-2000:])
    rows = Path("velocities").read_text(encoding="utf-8").splitlines()[-len(numbers) :]
    answer = {"id": c["id"], **facts}
    for number, v, u, omega in map(str.split, rows):
        answer |= {f"v{number}": float(v), f"u{number}": float(u), f"omega{number}": float(omega)}
    return answer
