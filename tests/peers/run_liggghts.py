"""Two spheres in LIGGGHTS, pair style gran; each collision is a process."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

from runner import serve

# one process needs no network, for which MPI would look each time
ENVIRONMENT = os.environ | {"OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self"}
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


def collide(
    model: str, options: str, E: float, nu: float, e: float, vc: float,
    m1: float, m2: float, R1: float, R2: float, v1: float, v2: float, gap: float, step: float, count: int,
    properties: Sequence[str] = (),
) -> tuple[float, float]:  # fmt: skip
    more = "\n".join(f"fix p{i} all property/global {words}" for i, words in enumerate(properties))
    script = SCRIPT.format(
        model=model, options=options, E=E, nu=nu, e=e, vc=vc, x1=-R1 - gap, x2=R2, d1=2 * R1, d2=2 * R2,
        m1=m1, m2=m2, v1=v1, v2=v2, step=step, count=count, properties=more,
    )  # fmt: skip
    process = subprocess.run(
        ["liggghts", "-log", "none"], input=script, capture_output=True, text=True, check=False, env=ENVIRONMENT
    )
    if process.returncode or "ERROR" in process.stdout:
        raise RuntimeError(process.stdout + process.stderr)
    last = dict(line.split() for line in Path("velocities").read_text(encoding="utf-8").splitlines()[-2:])
    return float(last["1"]), float(last["2"])


words = subprocess.run(["liggghts", "-help"], capture_output=True, text=True, check=False).stdout
serve(re.search(r"LIGGGHTS-PUBLIC ([\d.]+)", words)[1], collide)  # type: ignore[index]
