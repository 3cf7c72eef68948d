"""LIGGGHTS: linear springs, model hooke with tangential history; each collision is a process of the program."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

SETTINGS = "hooke with tangential history, ktToKnUser on for k_t = 2/7 k_n, tangential_damping off"
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
ATOM = """\
create_atoms 1 single {0!r} {1!r} 0
set atom {ball.number} diameter {2!r} mass {ball.m!r} omegaz {ball.omega!r}
set atom {ball.number} vx {ball.v!r} vy {ball.u!r} vz 0
"""
# ktToKnUser on: the tangential spring is 2/7 of the normal one, both have the same period for solid balls
CONTACT = "gran model hooke tangential history"
OPTIONS = "tangential_damping off ktToKnUser on"
FACTS: dict[str, Any] = {
    "law": "liggghts-history",
    "model": "liggghts-hooke",
    "parameters": {"tangential_damping": "off", "tangential_reduce": "on"},
}
NU = 0.3
# one process needs no network, for which Open MPI would look each time
ALONE = {"OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self"}


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision in the program that ends the command."""
    from two_balls import answer_of, balls_of, granular_script, harmonic

    balls = balls_of(c)
    if not all(ball.is_solid for ball in balls):
        return answer_of(c, (), "compliant", error="atoms are solid spheres", **FACTS)
    mass, radius = harmonic(ball.m for ball in balls), harmonic(ball.R for ball in balls)
    # any speed gives the stiffness that the contact time needs, with a modulus of its own
    speed = radius / c["contact_time"]
    k = mass * (math.pi**2 + math.log(c["e"]) ** 2) / c["contact_time"] ** 2
    # k = A^(4/5) (m speed^2)^(1/5) with A = 16/15 sqrt(R) E*, and E* = E/(2 (1 - nu^2)) of one material
    effective_modulus = (k**5 / (mass * speed**2)) ** 0.25 * 15.0 / (16.0 * math.sqrt(radius))
    script = granular_script(
        SCRIPT,
        ATOM,
        c,
        modulus=repr(2.0 * (1.0 - NU**2) * effective_modulus),
        nu=NU,
        e=c["e"],
        mu=c["mu"],
        speed=repr(speed),
        contact=f"{CONTACT} {OPTIONS}",
        wall="" if len(balls) == 2 else f"fix wall all wall/{CONTACT} primitive type 1 xplane 0.0 {OPTIONS}",
    )
    Path("velocities").unlink(missing_ok=True)
    process = subprocess.run(
        [sys.argv[-1], "-log", "none"],
        input=script,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | ALONE,
    )
    if process.returncode or "ERROR" in process.stdout:
        raise RuntimeError((process.stdout + process.stderr)[-2000:])
    rows = Path("velocities").read_text(encoding="utf-8").splitlines()[-len(balls) :]
    motions = (map(float, row.split()[1:]) for row in sorted(rows))
    return answer_of(c, motions, "compliant", **FACTS)
