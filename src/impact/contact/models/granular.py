"""Laws of granular codes that no paper has under its own name: springs and dashpots of other damping."""

from __future__ import annotations

import numpy as np

from ..model import Parameter
from ..oracles import gap_damping
from ..power import Array, power
from .codes import of_code
from .dashpot import BY_LOGARITHM, CONSTANT, HERTZIAN, LINEAR, dashpot
from .rate_dependent import drag

# LAMMPS, damping tsuji: of the polynomial of α, from the zeroth power of e
TSUJI_FIT = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)
LAMMPS = "LAMMPS, pair style granular, damping tsuji"
IN_SOURCE = "formula seen in the source; no DOI"


def tsuji_fit(e: Array) -> Array:
    """The polynomial of Tsuji and others' α."""
    total = np.zeros_like(e)
    for coefficient in reversed(TSUJI_FIT):
        total = total * e + coefficient
    return total


LAMMPS_TSUJI = of_code(
    dashpot(
        "lammps-tsuji",
        title="LAMMPS tsuji",
        year=2019,
        equation=f"{HERTZIAN},  α = √2 p(e), p of degree six, to δ = 0",
        reference=LAMMPS,
        evidence=f"{IN_SOURCE}; the factor √2 came later, see lammps-tsuji-without-root",
        domain={"e": (0.0, 1.0)},
        zeta=lambda e: np.sqrt(2.0) * tsuji_fit(e) / np.sqrt(5.0),
        release="gap",
        exponent=1.5,
    )
)

LAMMPS_TSUJI_LIMIT = of_code(
    dashpot(
        "lammps-tsuji-limit",
        title="LAMMPS tsuji with limit_damping",
        year=2019,
        equation=f"{HERTZIAN},  α = √2 p(e), p of degree six, to F = 0",
        reference=LAMMPS,
        evidence=IN_SOURCE,
        zeta=lambda e: np.sqrt(2.0) * tsuji_fit(e) / np.sqrt(5.0),
        release="force",
        exponent=1.5,
    )
)

LAMMPS_TSUJI_WITHOUT_ROOT = of_code(
    dashpot(
        "lammps-tsuji-without-root",
        title="LAMMPS tsuji of older versions",
        year=2019,
        equation=f"{HERTZIAN},  α = p(e), p of degree six, to δ = 0",
        reference=LAMMPS,
        evidence="formula seen in older sources; the release of July 2025 still does so, by a comparison; no DOI",
        zeta=lambda e: tsuji_fit(e) / np.sqrt(5.0),
        release="gap",
        exponent=1.5,
    )
)

LAMMPS_TSUJI_WITHOUT_ROOT_LIMIT = of_code(
    dashpot(
        "lammps-tsuji-without-root-limit",
        title="LAMMPS tsuji of older versions with limit_damping",
        year=2019,
        equation=f"{HERTZIAN},  α = p(e), p of degree six, to F = 0",
        reference=LAMMPS,
        evidence="formula seen in older sources; the release of July 2025 still does so, by a comparison; no DOI",
        zeta=lambda e: tsuji_fit(e) / np.sqrt(5.0),
        release="force",
        exponent=1.5,
    )
)

MASS_VELOCITY = (Parameter("gamma", "1/s", "damping γ per effective mass", least=0.0),)
VISCOELASTIC = (Parameter("eta", "1/m/s", "damping η per effective mass and contact radius", least=0.0),)
RATE = "LAMMPS, pair style granular, damping"

LAMMPS_MASS_VELOCITY_HOOKE = of_code(
    dashpot(
        "lammps-mass-velocity-hooke",
        title="LAMMPS mass_velocity, hooke",
        year=2019,
        equation="F = K δ + γ m δ̇, to δ = 0",
        reference=f"{RATE} mass_velocity",
        evidence=IN_SOURCE,
        parameters=MASS_VELOCITY,
        zeta=lambda gamma, m, K: 0.5 * gamma * np.sqrt(m / K),
        release="gap",
        exponent=1.0,
    )
)

LAMMPS_MASS_VELOCITY_HOOKE_LIMIT = of_code(
    dashpot(
        "lammps-mass-velocity-hooke-limit",
        title="LAMMPS mass_velocity, hooke, limit_damping",
        year=2019,
        equation="F = K δ + γ m δ̇, to F = 0",
        reference=f"{RATE} mass_velocity",
        evidence=IN_SOURCE,
        parameters=MASS_VELOCITY,
        zeta=lambda gamma, m, K: 0.5 * gamma * np.sqrt(m / K),
        release="force",
        exponent=1.0,
    )
)

LAMMPS_MASS_VELOCITY_HERTZ = of_code(
    drag(
        "lammps-mass-velocity-hertz",
        title="LAMMPS mass_velocity, hertz",
        year=2019,
        equation="F = K δ^(3/2) + γ m δ̇, to δ = 0",
        reference=f"{RATE} mass_velocity",
        evidence=IN_SOURCE,
        parameters=MASS_VELOCITY,
        c=lambda gamma, m: gamma * m,
        q=0.0,
        release="gap",
        exponent=1.5,
    )
)

LAMMPS_VELOCITY_HERTZ = of_code(
    drag(
        "lammps-velocity-hertz",
        title="LAMMPS velocity, hertz",
        year=2019,
        equation="F = K δ^(3/2) + C δ̇, to δ = 0",
        reference=f"{RATE} velocity",
        evidence=IN_SOURCE,
        parameters=CONSTANT,
        c=lambda C: C,
        q=0.0,
        release="gap",
        exponent=1.5,
    )
)

LAMMPS_VELOCITY_HERTZ_LIMIT = of_code(
    drag(
        "lammps-velocity-hertz-limit",
        title="LAMMPS velocity, hertz, limit_damping",
        year=2019,
        equation="F = K δ^(3/2) + C δ̇, to F = 0",
        reference=f"{RATE} velocity",
        evidence=IN_SOURCE,
        parameters=CONSTANT,
        c=lambda C: C,
        q=0.0,
        release="force",
        exponent=1.5,
    )
)

LAMMPS_VISCOELASTIC_HERTZ = of_code(
    drag(
        "lammps-viscoelastic-hertz",
        title="LAMMPS viscoelastic, hertz",
        year=2019,
        equation="F = K δ^(3/2) + η m √(R* δ) δ̇, to δ = 0",
        reference=f"{RATE} viscoelastic; so has pair style gran/hertz/history",
        evidence=IN_SOURCE,
        parameters=VISCOELASTIC,
        c=lambda eta, m, R1, R2: eta * m * np.sqrt(1 / (1 / R1 + 1 / R2)),
        q=0.5,
        release="gap",
        exponent=1.5,
    )
)

LAMMPS_VISCOELASTIC_HERTZ_LIMIT = of_code(
    drag(
        "lammps-viscoelastic-hertz-limit",
        title="LAMMPS viscoelastic, hertz, limit_damping",
        year=2019,
        equation="F = K δ^(3/2) + η m √(R* δ) δ̇, to F = 0",
        reference=f"{RATE} viscoelastic",
        evidence=IN_SOURCE,
        parameters=VISCOELASTIC,
        c=lambda eta, m, R1, R2: eta * m * np.sqrt(1 / (1 / R1 + 1 / R2)),
        q=0.5,
        release="force",
        exponent=1.5,
    )
)

# the stiffness of a linear spring that takes as much energy as Hertz's at a characteristic speed
CHARACTERISTIC = (Parameter("vc", "m/s", "characteristic speed of the stiffness", default=1.0, least=1e-9),)
BY_SPEED = "K = (16/15) E* √R* (15 m v_c²/(16 E* √R*))^(1/5)"


def by_speed(E1: Array, E2: Array, nu1: Array, nu2: Array, R1: Array, R2: Array, m: Array, vc: Array) -> Array:
    """K of a linear spring from moduli, radii and a characteristic speed."""
    root = np.sqrt(1 / (1 / R1 + 1 / R2)) / ((1 - nu1 * nu1) / E1 + (1 - nu2 * nu2) / E2)
    return 16 / 15 * root * power(15 * m * vc * vc / (16 * root), 0.2)


LIGGGHTS_HOOKE = of_code(
    dashpot(
        "liggghts-hooke",
        title="LIGGGHTS hooke",
        year=2012,
        equation=f"{LINEAR},  {BY_LOGARITHM}, to δ = 0;  {BY_SPEED}",
        reference="LIGGGHTS-PUBLIC, normal_model_hooke.h",
        evidence=IN_SOURCE,
        domain={"e": (0.0, 1.0)},
        parameters=CHARACTERISTIC,
        zeta=lambda e: gap_damping(e),
        release="gap",
        exponent=1.0,
    ),
    stiffness=by_speed,
)

CHRONO_SMC_HOOKE = of_code(
    dashpot(
        "chrono-smc-hooke",
        title="Chrono SMC, Hooke",
        year=2016,
        equation=f"{LINEAR},  {BY_LOGARITHM}, to F = 0;  {BY_SPEED}",
        reference="Project Chrono, ChContactSMC.h; so has LIGGGHTS hooke with limitForce",
        evidence=IN_SOURCE,
        parameters=CHARACTERISTIC,
        zeta=lambda e: gap_damping(e),
        release="force",
        exponent=1.0,
    ),
    stiffness=by_speed,
)

CHRONO_SMC_PLAINCOULOMB = of_code(
    dashpot(
        "chrono-smc-plaincoulomb",
        title="Chrono SMC, PlainCoulomb",
        year=2016,
        equation=f"{HERTZIAN},  α = −√5 ln e/√(π² + ln² e), to F = 0;  K = (4/3) E* √(1 m)",
        reference="Project Chrono, ChContactSMC.h",
        evidence=f"{IN_SOURCE}; its stiffness lacks the radius",
        zeta=lambda e: gap_damping(e),
        release="force",
        exponent=1.5,
    ),
    stiffness=lambda E1, E2, nu1, nu2: 4 / 3 / ((1 - nu1 * nu1) / E1 + (1 - nu2 * nu2) / E2),
)

YADE_BETAN = of_code(
    dashpot(
        "yade-betan",
        title="YADE HertzMindlin betan",
        year=2010,
        equation="F = K δ^(3/2) + 2 β √(m S) δ̇,  S = (3/2) K δ^(1/2),  β = −ln e/√(π² + ln² e), to δ = 0",
        reference="YADE, HertzMindlin, betan by the traditional formula of a linear spring",
        evidence=IN_SOURCE,
        # 2 β √(3/2) is α
        zeta=lambda e: np.sqrt(1.2) * gap_damping(e),
        release="gap",
        exponent=1.5,
    )
)

DEMLAB_TTI = of_code(
    dashpot(
        "demlab-tti",
        title="DEMLab TTI",
        year=2021,
        equation=f"{HERTZIAN},  α = −2.2664 ln e/√(10.1354 + ln² e), to δ = 0",
        reference="Rangel R, DEMLab, contact law of Tsuji, Tanaka and Ishida",
        evidence=IN_SOURCE,
        domain={"e": (0.0, 1.0)},
        zeta=lambda e: 2.2664 / np.sqrt(5.0) / np.sqrt(1.0 + 10.1354 / np.square(np.log(e))),
        release="gap",
        exponent=1.5,
    )
)
