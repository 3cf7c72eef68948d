"""Laws of granular codes that no paper has under its own name: dashpots by fits of the damping ratio."""

from __future__ import annotations

import numpy as np

from ..oracles import gap_damping
from ..power import Array
from .codes import of_code
from .dashpot import HERTZIAN, dashpot

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
