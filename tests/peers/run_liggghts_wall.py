"""A sphere and a plane in LIGGGHTS, fix wall/gran; the plane is z = 0.

A finite R2 replaces the plane by a second sphere at rest, below z = 0.
"""

from __future__ import annotations

import math

from liggghts import serve_scripts

SCRIPT = """
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
hard_particles yes
region box block -1 1 -1 1 -1 1 units box
create_box 2 box
neighbor 0.01 bin
neigh_modify delay 0
fix 1 all property/global youngsModulus peratomtype {E} {E}
fix 2 all property/global poissonsRatio peratomtype {nu} {nu}
fix 3 all property/global coefficientRestitution peratomtypepair 2 {e} {e} {e} {e}
fix 4 all property/global coefficientFriction peratomtypepair 2 {mu} {mu} {mu} {mu}
fix 5 all property/global characteristicVelocity scalar {vc}
pair_style gran model {model} tangential {tangential} {options}
pair_coeff * *
timestep {step}
create_atoms 1 single {x} 0 {z}
set atom 1 diameter {d} mass {m} vx {u} vy 0 vz {vz}
set atom 1 omegay {spin}
fix 6 all nve/sphere
{second}
dump 1 all custom {count} velocities id vx vz omegay
dump_modify 1 format "%d %.17g %.17g %.17g"
run {count}
"""


SPHERE = """create_atoms 1 single 0 0 {z}
set atom 2 diameter {d} mass {m} vx 0 vy 0 vz 0"""


def script(
    model: str, tangential: str, options: str, E: float, nu: float, e: float, vc: float, mu: float,
    m1: float, R1: float, v1: float, u1: float, omega1: float, gap: float, step: float, count: int,
    m2: float = math.inf, R2: float = math.inf,
) -> str:  # fmt: skip
    second = f"fix 7 all wall/gran model {model} tangential {tangential} primitive type 2 zplane 0.0 {options}"
    if math.isfinite(R2):
        second = SPHERE.format(z=-R2, d=2 * R2, m=m2)
    # the normal points down to the plane, the tangent along x, so that spins are about -y
    return SCRIPT.format(
        model=model, tangential=tangential, options=options, E=E, nu=nu, e=e, vc=vc, mu=mu, x=-u1 * gap / v1,
        z=R1 + gap, d=2 * R1, m=m1, u=u1, vz=-v1, spin=-omega1, step=step, count=count, second=second,
    )  # fmt: skip


def rebound(velocities: dict[str, list[float]]) -> tuple[float, float, float]:
    u, vz, spin = velocities["1"]
    return -vz, u, -spin


serve_scripts(script, rebound)
