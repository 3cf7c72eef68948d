"""Two spheres in LIGGGHTS, pair style gran."""

from __future__ import annotations

from collections.abc import Sequence

from liggghts import serve_scripts

SCRIPT = """
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
region box block -1 1 -1 1 -1 1 units box
create_box 2 box
neighbor 0.01 bin
neigh_modify delay 0
fix 1 all property/global youngsModulus peratomtype {E} {E}
fix 2 all property/global poissonsRatio peratomtype {nu} {nu}
fix 3 all property/global coefficientRestitution peratomtypepair 2 {e} {e} {e} {e}
fix 4 all property/global coefficientFriction peratomtypepair 2 0 0 0 0
fix 5 all property/global characteristicVelocity scalar {vc}
{properties}
pair_style gran model {model} tangential no_history {options}
pair_coeff * *
timestep {step}
create_atoms 1 single {x1} 0 0
create_atoms 2 single {x2} 0 0
set atom 1 diameter {d1} mass {m1} vx {v1} vy 0 vz 0
set atom 2 diameter {d2} mass {m2} vx {v2} vy 0 vz 0
fix 6 all nve/sphere
dump 1 all custom {count} velocities id vx
dump_modify 1 format "%d %.17g"
run {count}
"""


def script(
    model: str, options: str, E: float, nu: float, e: float, vc: float,
    m1: float, m2: float, R1: float, R2: float, v1: float, v2: float, gap: float, step: float, count: int,
    properties: Sequence[str] = (),
) -> str:  # fmt: skip
    more = "\n".join(f"fix p{i} all property/global {words}" for i, words in enumerate(properties))
    return SCRIPT.format(
        model=model, options=options, E=E, nu=nu, e=e, vc=vc, x1=-R1 - gap, x2=R2, d1=2 * R1, d2=2 * R2,
        m1=m1, m2=m2, v1=v1, v2=v2, step=step, count=count, properties=more,
    )  # fmt: skip


serve_scripts(script, lambda velocities: (*velocities["1"], *velocities["2"]))
