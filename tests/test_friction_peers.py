"""Codes deliver at an oblique impact what the map of their scheme predicts: velocities and spins.

A sphere meets a plane, or a sphere at rest, at angles from 10 to 80 degrees, with and without a spin, at 12, 31
and 1000 steps per contact, or 200 of a code that Python calls for each step, and two phases of a step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

import impact

from .test_fixed_step_slip import cone
from .test_peers import KRATOS, LAMMPS, LIGGGHTS, YADE, Code, Values, betan, run_code

pytestmark = pytest.mark.peers

ANGLES, MUS, SPINS, STEPS, PHASES = (
    (10.0, 30.0, 45.0, 60.0, 80.0),
    (0.1, 0.5),
    (0.0, -10.0, 25.0),
    (12, 31, 1000),
    (0.125, 0.625),
)
# of codes that Python calls for each step
STEPS_OF_PYTHON = (12, 31, 200)
BALL: Values = {"v1": 1.0, "m1": 0.01, "R1": 0.05}
MATERIAL = {"E": 1e9, "nu": 0.3, "rho": 1000.0}
# so stiff that the indentation is a hundred thousandth of the radius
HARD = 1e15
MATERIALS = {"materials": {"soft": MATERIAL, "hard": MATERIAL | {"E": HARD}}}
# between a code whose lever arm is the radius and the map, relative to the speed before the impact
TOLERANCE = 1e-10
# the part of the impacts that may differ by more where a code alternates, and by how much
RARE, LARGEST = 0.03, 0.05


@dataclass(frozen=True)
class Pairing:
    """A contact force and a friction law, and how a code is made to run both.

    `model` is the key of the contact force, `sweep` its inputs; `parameters` returns what the runner needs, from
    the parameters of the friction law and mu.
    """

    friction: str
    model: str
    code: Code
    sweep: Values
    values: Values
    parameters: Callable[[Values, float], Values]
    scheme: str = "kick-drift"
    # whether the lever arm of friction is less than the radius, by a part of the indentation
    shortens_arms: bool = False
    # whether the code alternates between slip and stick: a shorter arm may change one of those steps
    alternates: bool = False
    # the mass and radius of a second ball at rest; empty for a plane
    second: Values = field(default_factory=dict)
    steps: tuple[int, ...] = STEPS
    # error of a code of single precision, or that finds its damping roughly
    slack: float = 0.0

    @property
    def name(self) -> str:
        values = ", ".join(f"{name}={value}" for name, value in (self.values | self.second).items())
        return f"{self.friction}-{self.model}-{values}"


HOOKE: Values = {"e": 0.7, "K": 1e6, "n": 1.0}
HERTZ: Values = {"e": 0.7, "material": "soft"}
VISCOELASTIC: Values = {"K": 1e6, "n": 1.0, "yade-viscoelastic.C": 30.0}
LAMMPS_WALL = replace(LAMMPS, runner="run_lammps_wall.py")


def lammps_hooke(line: str, K: float = HOOKE["K"]) -> Callable[[Values, float], Values]:
    """The line of fix wall/gran for a linear spring."""
    normal = f"granular hooke {K!r} {HOOKE['e']} damping coeff_restitution tangential"
    return lambda values, mu: {"pair": f"{normal} {line.format(**values)} {mu}"}


def lammps_hertz(name: str, E: float = MATERIAL["E"]) -> Callable[[Values, float], Values]:
    """The line of fix wall/gran for materials."""
    normal = f"granular hertz/material {E!r} {HERTZ['e']} {MATERIAL['nu']} damping coeff_restitution"
    return lambda values, mu: {"pair": f"{normal} tangential {name} NULL {values['xt']} {mu}"}


# of a law in which the strength of the damping is that of fix wall/gran hooke/history, and hertz/history
CLASSIC = {
    "hooke": ("lammps-mass-velocity-hooke", "gamma", {"K": 1e6, "n": 1.0}, 1e6, 2e3),
    "hertz": ("lammps-viscoelastic-hertz", "eta", {"K": 1e9 * math.sqrt(BALL["R1"])}, 1e9, 1e6),
}


def lammps_classic(spring: str) -> Callable[[Values, float], Values]:
    """The line of fix wall/gran of old, with a switch for the tangential damping at its end."""
    *_, k_n, gamma = CLASSIC[spring]
    return lambda values, mu: {
        "pair": f"{spring}/history {k_n!r} {values['k_t']!r} {gamma!r} {values['xt'] * gamma!r} {mu} 1"
    }


LIGGGHTS_WALL = replace(LIGGGHTS, runner="run_liggghts_wall.py")


def liggghts(
    model: str, tangential: str, options: str, E: float = MATERIAL["E"]
) -> Callable[[Values, float], Values]:
    """The models of fix wall/gran, with the properties of both materials."""
    properties = {**MATERIAL, "E": E, "e": HERTZ["e"], "vc": 1.0}
    del properties["rho"]
    return lambda values, mu: {
        "model": model,
        "tangential": tangential,
        "options": options,
        **properties,
        "mu": mu,
    }


YADE_WALL = replace(YADE, runner="run_yade_wall.py")


def yade_viscoelastic(values: Values, mu: float, normal: Values = VISCOELASTIC) -> Values:
    """ViscElMat of one ball; two of them act in series."""
    springs = {"kn": 2 * normal["K"], "cn": 2 * normal["yade-viscoelastic.C"]}
    tangential = {"ks": 2 * values["k_t"], "cs": 2 * values["c_t"]}
    return {"law": "viscoelastic", "options": springs | tangential, "mu": mu}


def yade_mindlin(values: Values, mu: float, E: float = MATERIAL["E"]) -> Values:
    """Ip2_FrictMat_FrictMat_MindlinPhys, with a damping of the tangential force of its own."""
    return {"law": "mindlin", "options": MATERIAL | {"E": E} | {"betan": betan(HERTZ), **values}, "mu": mu}


MUJOCO_WALL = Code("MuJoCo", "run_mujoco_wall.py", forks=True)
# so stiff that the indentation is a millionth of the radius, which is then the lever arm
STIFF = BALL["v1"] / (1e-6 * BALL["R1"])


def mujoco(values: Values, mu: float, solref: str = f"{-(STIFF**2)!r} {-0.2 * STIFF!r}") -> Values:
    """The attributes of a pair of geoms; 0 0 for a friction of the stiffness and damping of the contact."""
    return {
        "solref": solref,
        "solreffriction": f"-1 {-values['b_t']!r}" if "b_t" in values else "0 0",
        "impratio": values.get("impratio", 1.0),
        "d": values.get("impedance", 0.9),
        "mu": mu,
    }


MINDLIN = {
    "lammps-mindlin": "mindlin",
    "lammps-mindlin-force": "mindlin/force",
    "lammps-mindlin-rescale": "mindlin_rescale",
    "lammps-mindlin-rescale-force": "mindlin_rescale/force",
}
PAIRINGS = (
    *(
        Pairing(
            "lammps-linear-history",
            "lammps-coeff-restitution-hooke",
            LAMMPS_WALL,
            HOOKE,
            {"k_t": ratio * HOOKE["K"], "xt": xt},
            lammps_hooke("linear_history {k_t} {xt}"),
        )
        for ratio, xt in ((0.2, 0.0), (2 / 7, 0.5), (0.8, 1.0))
    ),
    *(
        Pairing(
            "lammps-linear-nohistory",
            "lammps-coeff-restitution-hooke",
            LAMMPS_WALL,
            HOOKE,
            {"xt": xt},
            lammps_hooke("linear_nohistory {xt}"),
        )
        for xt in (0.5, 1.0)
    ),
    *(
        Pairing(key, "lammps-coeff-restitution-hertz", LAMMPS_WALL, HERTZ, {"xt": xt}, lammps_hertz(name))
        for key, name in MINDLIN.items()
        for xt in (0.0, 0.6)
    ),
    *(
        Pairing(
            "lammps-classic-2025",
            CLASSIC[spring][0],
            LAMMPS_WALL,
            CLASSIC[spring][2] | {f"{CLASSIC[spring][0]}.{CLASSIC[spring][1]}": CLASSIC[spring][4]},
            {"k_t": ratio * CLASSIC[spring][3], "xt": xt},
            lammps_classic(spring),
        )
        for spring, ratio, xt in (
            ("hooke", 2 / 7, 0.5),
            ("hooke", 50.0, 0.1),
            ("hooke", 2000.0, 0.0),
            ("hertz", 2 / 7, 0.5),
            ("hertz", 1.0, 0.0),
        )
    ),
    *(
        Pairing(
            "mujoco-elliptic",
            "mujoco-solref-direct",
            MUJOCO_WALL,
            {"mujoco-solref-direct.k": STIFF**2, "mujoco-solref-direct.b": 0.2 * STIFF},
            values,
            mujoco,
            scheme="mujoco-cone",
            shortens_arms=True,
            second=second,
            steps=STEPS_OF_PYTHON,
        )
        for values, second in (
            ({}, {}),
            ({"impratio": 5.0}, {}),
            ({"b_t": 0.02 * STIFF, "impratio": 0.2}, {}),
            ({"b_t": STIFF, "impedance": 0.5}, {}),
            ({"b_t": 0.2 * STIFF, "impratio": 3.0}, {"m2": 0.03, "R2": 0.08}),
        )
    ),
    *(
        Pairing(
            f"liggghts-{tangential.replace('_', '-')}",
            f"liggghts-{model}",
            LIGGGHTS_WALL,
            HERTZ,
            values,
            liggghts(model, tangential, " ".join(f"{name} {word}" for name, word in values.items())),
            shortens_arms=True,
            alternates=values == {"tangential_damping": "on"},
        )
        for model in ("hooke", "hertz")
        for tangential, values in (
            ("history", {"tangential_damping": "off"}),
            ("history", {"tangential_damping": "on"}),
            ("no_history", {}),
        )
    ),
    *(
        Pairing(
            "yade-viscoelastic",
            "yade-viscoelastic",
            YADE_WALL,
            VISCOELASTIC,
            {"k_t": ratio * VISCOELASTIC["K"], "c_t": c_t},
            yade_viscoelastic,
            shortens_arms=True,
        )
        for ratio, c_t in ((2 / 7, 0.0), (0.8, 5.0), (1.5, 0.0))
    ),
    *(
        Pairing("yade-mindlin", "yade-betan", YADE_WALL, HERTZ, {"betas": betas}, yade_mindlin, shortens_arms=True)
        for betas in (0.0, 0.1)
    ),
)


STANDARD = {"timeconst": 10.0 / STIFF, "dampratio": 0.1}
PAIRINGS += (
    Pairing(
        "mujoco-elliptic",
        "mujoco-solref",
        MUJOCO_WALL,
        {f"mujoco-solref.{name}": value for name, value in STANDARD.items()},
        {},
        lambda values, mu: mujoco(values, mu, " ".join(map(repr, STANDARD.values()))),
        scheme="mujoco-cone",
        shortens_arms=True,
        steps=STEPS_OF_PYTHON,
    ),
)
PYBULLET_WALL = Code("PyBullet", "run_pybullet_wall.py")


def pybullet(K: float, C: float, second: Values) -> Pairing:
    """A spring and a dashpot; against a plane the lever arm of friction is the radius."""
    return Pairing(
        "coulomb-1785",
        "kelvin-voigt-no-tension",
        PYBULLET_WALL,
        {"K": K, "n": 1.0, "kelvin-voigt-no-tension.C": C},
        {},
        lambda values, mu: {"k": K, "c": C, "mu": mu},
        scheme="pybullet",
        shortens_arms=bool(second),
        second=second,
    )


# the normal of two balls turns while they touch: no map agrees closer with a code than with a shorter arm
SECOND: Values = {"m2": 0.03, "R2": 0.08}
HARD_HOOKE, HARD_HERTZ = HOOKE | {"K": 1e12}, HERTZ | {"material": "hard"}
HARD_VISCOELASTIC = VISCOELASTIC | {"K": 1e12, "yade-viscoelastic.C": 3e4}
PAIRINGS += (
    pybullet(1e6, 30.0, {}),
    pybullet(1e12, 3e4, SECOND),
    Pairing(
        "lammps-linear-history",
        "lammps-coeff-restitution-hooke",
        LAMMPS_WALL,
        HARD_HOOKE,
        {"k_t": 2e11, "xt": 0.5},
        lammps_hooke("linear_history {k_t} {xt}", 1e12),
        shortens_arms=True,
        second=SECOND,
    ),
    *(
        Pairing(
            key,
            "lammps-coeff-restitution-hertz",
            LAMMPS_WALL,
            HARD_HERTZ,
            {"xt": 0.6},
            lammps_hertz(name, HARD),
            shortens_arms=True,
            second=SECOND,
        )
        for key, name in MINDLIN.items()
    ),
    *(
        Pairing(
            f"liggghts-{tangential.replace('_', '-')}",
            "liggghts-hertz",
            LIGGGHTS_WALL,
            HARD_HERTZ,
            values,
            liggghts("hertz", tangential, " ".join(f"{name} {word}" for name, word in values.items()), HARD),
            shortens_arms=True,
            second=SECOND,
        )
        for tangential, values in (("history", {"tangential_damping": "off"}), ("no_history", {}))
    ),
    Pairing(
        "yade-viscoelastic",
        "yade-viscoelastic",
        YADE_WALL,
        HARD_VISCOELASTIC,
        {"k_t": 2e11, "c_t": 0.0},
        lambda values, mu: yade_viscoelastic(values, mu, HARD_VISCOELASTIC),
        shortens_arms=True,
        second=SECOND,
    ),
    Pairing(
        "yade-mindlin",
        "yade-betan",
        YADE_WALL,
        HARD_HERTZ,
        {"betas": 0.1},
        lambda values, mu: yade_mindlin(values, mu, HARD),
        shortens_arms=True,
        second=SECOND,
    ),
)
# of two spheres, and of a sphere and a rigid face
KRATOS_LAWS = {"hertz": "DEM_D_Hertz_viscous_Coulomb", "linear": "DEM_D_Linear_viscous_Coulomb"}


def kratos(name: str, E: float) -> Callable[[Values, float], Values]:
    """The variables of both materials and of their relation."""
    inputs = {"law": KRATOS_LAWS[name], "E": E, "nu": MATERIAL["nu"], "e": HERTZ["e"]}
    return lambda values, mu: inputs | {"mu": mu}


PAIRINGS += tuple(
    Pairing(
        "kratos-viscous-coulomb",
        f"kratos-{name}",
        KRATOS,
        HERTZ | {"material": material},
        {},
        kratos(name, E),
        shortens_arms=True,
        second=second,
        steps=STEPS_OF_PYTHON,
        # Kratos finds the damping ratio by bisection to 1e-4
        slack=1e-4 if name == "linear" else 0.0,
    )
    for name in KRATOS_LAWS
    for material, E in (("soft", MATERIAL["E"]), ("hard", HARD))
    for second in ({}, SECOND)
)
# below this slip TAMSI takes less friction than mu N
DRAKE_WALL, STICTION = Code("Drake", "run_drake_wall.py", forks=True), 1e-6
PAIRINGS += tuple(
    Pairing(
        "coulomb-1785",
        "drake-point-contact",
        DRAKE_WALL,
        {"K": K, "n": 1.0, "drake-point-contact.d": 0.5},
        {},
        lambda values, mu, K=K: {"k": K, "d": 0.5, "mu": mu, "stiction": STICTION},
        scheme="drake-tamsi",
        shortens_arms=True,
        second=second,
        steps=STEPS_OF_PYTHON,
    )
    for K in (1e6, 1e12)
    for second in ({}, SECOND)
)
# of single precision, which a soft contact resolves; each of its steps takes a millisecond
SOFT = {"K": 1e5, "n": 1.0, "newton-semi-implicit.kd": 20.0}
PAIRINGS += tuple(
    Pairing(
        "coulomb-1785",
        "newton-semi-implicit",
        Code("Newton", "run_newton_wall.py", forks=True),
        SOFT,
        {},
        lambda values, mu: {"ke": SOFT["K"], "kd": SOFT["newton-semi-implicit.kd"], "mu": mu},
        # against a plane its lever arm is the radius
        shortens_arms=bool(second),
        second=second,
        steps=(12, 31),
        slack=1e-3,
    )
    for second in ({}, SECOND)
)


def config_of(pairing: Pairing, sweep: Values, solver: Values) -> Values:
    """The config of a pairing."""
    second = pairing.second or {"m2": math.inf, "R2": math.inf}
    own = {name.split(".")[1]: value for name, value in pairing.sweep.items() if "." in name}
    inputs = {name: value for name, value in pairing.sweep.items() if "." not in name}
    return {
        "models": pairing.model,
        "frictions": pairing.friction,
        "model": {pairing.model: own},
        "sweep": {**BALL, **second, **inputs, "mu": [*MUS], **sweep},
        **MATERIALS,
        "friction": {pairing.friction: pairing.values},
        "solver": solver,
    }


def predicted(pairing: Pairing) -> tuple[float, float, np.ndarray]:
    """The contact time [s], the indentation [m], and v1, u1 and R1 omega1 after the impacts of all axes."""
    config = config_of(pairing, {}, {})
    sweep = {name: value for name, value in config["sweep"].items() if name != "mu"}
    continuous = impact.sweep({"models": pairing.model, "model": config["model"], "sweep": sweep} | MATERIALS)
    axes = {
        "angle": [f"{angle} deg" for angle in ANGLES],
        "omega1": [*SPINS],
        "steps_per_contact": [*pairing.steps],
        "phase": [*PHASES],
    }
    result = impact.sweep(config_of(pairing, axes, {"integrator": pairing.scheme}))
    dims = ("mu", *axes)
    assert (result.friction_status == 1).all()
    after = [result.v1_post, result.u1_post, BALL["R1"] * result.omega1_post]
    columns = [
        variable.isel(model=0, friction=0, missing_dims="ignore")
        .expand_dims({dim: result.sizes[dim] for dim in dims if dim not in variable.dims})
        .transpose(*dims)
        .values
        for variable in after
    ]
    values = (float(continuous[name].squeeze()) for name in ("contact_time", "peak_indentation"))
    return *values, np.stack(columns, axis=-1)


def runs_of(pairing: Pairing, contact_time: float) -> list[Values]:
    """The runs of a code in the order of `predicted`."""
    return [
        BALL
        | pairing.second
        | pairing.parameters(pairing.values, mu)
        | {
            "u1": BALL["v1"] * math.tan(math.radians(angle)),
            "omega1": spin,
            "gap": (3 - phase) * contact_time / steps * BALL["v1"],
            "step": contact_time / steps,
            "count": math.ceil(2.5 * steps),
        }
        for mu in MUS
        for angle in ANGLES
        for spin in SPINS
        for steps in pairing.steps
        for phase in PHASES
    ]


@pytest.mark.parametrize("pairing", PAIRINGS, ids=lambda pairing: pairing.name)
def test_a_code_delivers_velocities_and_spins_of_the_map_of_its_scheme(
    pairing: Pairing, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    contact_time, indentation, ours = predicted(pairing)
    R1, R2 = BALL["R1"], pairing.second.get("R2", math.inf)
    # the angle by which the normal of two balls turns meanwhile, at the speed of the impact
    turn = contact_time * BALL["v1"] / (R1 + R2)
    tolerance = 4.0 * indentation * (1.0 / R1 + 1.0 / R2) + turn if pairing.shortens_arms else TOLERANCE
    tolerance += pairing.slack
    version, answers = run_code(pairing.code, pairing.name, runs_of(pairing, contact_time), tmp_path)
    theirs = np.array(answers).reshape(ours.shape) * (1.0, 1.0, BALL["R1"])
    speed = BALL["v1"] / np.cos(np.radians(ANGLES)).reshape(1, -1, 1, 1, 1, 1)
    differences = (np.abs(theirs - ours) / speed).max(axis=-1)
    rare = differences > tolerance
    difference = float(differences.max())
    variant = ", ".join(f"{name} {value}" for name, value in (pairing.values | pairing.second).items())
    key = f"{pairing.model} with {pairing.friction}"
    record_property("peer", (pairing.code.name, version, key, variant, ours[..., 0].size, difference, tolerance))
    if pairing.alternates:
        assert np.count_nonzero(rare) <= RARE * rare.size
        tolerance = LARGEST
    assert difference <= tolerance


def test_the_lever_arm_of_mujoco_is_the_radius_without_half_of_the_indentation(tmp_path: Path) -> None:
    k, b, h = 4e5, 300.0, 4e-4
    runs = [
        BALL | mujoco({"b_t": 500.0, "impratio": 3.0}, mu, f"{-k!r} {-b!r}")
        | {"u1": u1, "omega1": spin, "gap": (3 - phase) * h * BALL["v1"], "step": h, "count": 40}
        for mu in MUS for u1 in (0.2, 1.0, -5.0) for spin in SPINS for phase in PHASES
    ]  # fmt: skip
    _, answers = run_code(MUJOCO_WALL, "mujoco", runs, tmp_path)
    for shortening, tolerance in ((0.5, 1e-12), (0.0, 4.0 * BALL["v1"] / math.sqrt(k) / BALL["R1"])):
        ours = [
            cone(run["u1"], run["omega1"], run["mu"], h, 3 - run["gap"] / h, k, b, 500.0, 0.9, 3.0, shortening)
            for run in runs
        ]
        differences = np.abs(np.array(ours) - answers).max()
        assert differences <= tolerance
    # the indentation is a thirtieth of the radius, which is seen
    assert differences > 1e-3
