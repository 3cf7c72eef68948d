"""LAMMPS, pair style granular: each damping of each linear and Hertzian spring, by default and with limit_damping.

By default the force pulls until the gap closes; with limit_damping the contact ends when the force does.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..evidence import Evidence
from ..model import ForceModel, Parameter
from ..powers import Array
from .dashpot import (
    ANAGNOSTOPOULOS_1988,
    ANAGNOSTOPOULOS_1988_NO_TENSION,
    CONSTANT,
    KELVIN_VOIGT,
    KELVIN_VOIGT_NO_TENSION,
    TSUJI_1992,
    TSUJI_1992_NO_TENSION,
    dashpot,
)
from .rate_dependent import LEE_HERRMANN_1993, drag

# of the polynomial of α that LAMMPS calls tsuji and credits to Marshall (2009), equation 53, in powers of e
TSUJI_POLYNOMIAL = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)
KERNEL = "lammps/lammps, src/GRANULAR/gran_sub_mod_damping_kernel.h @07b704ca (2026)"
DAMPING = "lammps/lammps, src/GRANULAR/gran_sub_mod_damping.cpp @07b704ca (2026)"
DAMPING_2024 = "LAMMPS release of 29 August 2024, src/GRANULAR/gran_sub_mod_damping.cpp"
# limit_damping: pull request 2698, first in patch_8Apr2021
LIMIT_YEAR = 2021
MASS_VELOCITY = (Parameter("gamma", "1/s", "damping γ per effective mass", least=0.0),)
VISCOELASTIC = (Parameter("eta", "1/m/s", "damping η per effective mass and contact radius", least=0.0),)

# makes the law that ends at zero indentation ("gap") or at zero force ("force")
Maker = Callable[..., ForceModel]


def tsuji_polynomial(e: Array) -> Array:
    """The polynomial of LAMMPS for α of Tsuji and others, without a factor √2."""
    total = np.zeros_like(e)
    for coefficient in reversed(TSUJI_POLYNOMIAL):
        total = total * e + coefficient
    return total


def renamed(pulling: ForceModel, limited: ForceModel) -> Maker:
    """Two laws of the catalogue under other names; they are the same to the bit."""
    laws = {"gap": pulling, "force": limited}

    def make(key: str, *, release: str, **about: Any) -> ForceModel:
        return replace(laws[release], key=key, doi="", domain={}, same_as=laws[release].key, **about)

    return make


def entries(
    key: str, option: str, since: str, year: int, equation: str, make: Maker, source: str = KERNEL, note: str = ""
) -> Iterator[ForceModel]:
    """An option of LAMMPS as it is by default, and with limit_damping.

    Parameters
    ----------
    key : of the default; "-limit" is appended for limit_damping
    option : the words of the pair style
    since : the releases that have it
    year : of the first one
    equation : the force
    make : the law by where the contact ends
    source, note : see `Evidence`
    """
    # limit_damping came later than the oldest of these
    limited = re.sub(r"(March )?2019", f"April {LIMIT_YEAR}", since)
    for release, suffix, words, end, years, first in (
        ("gap", "", option, "δ = 0", since, year),
        ("force", "-limit", f"{option}, limit_damping", "F = 0", limited, max(year, LIMIT_YEAR)),
    ):
        law = make(
            key + suffix,
            release=release,
            title=f"LAMMPS {words} ({years})",
            year=first,
            equation=f"{equation}, to {end}",
            reference="LAMMPS, pair style granular",
            evidence=Evidence("seen", source, note=note),
        )
        yield replace(law, family="codes")


def mass_velocity_hertz(key: str, *, release: str, **about: Any) -> ForceModel:
    """K δ^(3/2) + γ m δ̇, which is the law of Lee and Herrmann where it ends at zero force."""
    if release == "force":
        return replace(LEE_HERRMANN_1993, key=key, doi="", same_as=LEE_HERRMANN_1993.key, **about)
    return drag(
        key,
        c=lambda gamma, m: gamma * m,
        q=0.0,
        release="gap",
        parameters=MASS_VELOCITY,
        exponent=1.5,
        **about,
    )


def tsuji(root: float, exponent: float) -> Maker:
    """α √(m K) δ^((n−1)/2) δ̇ with α = root p(e)."""
    scale = root / np.sqrt(2 * (exponent + 1))
    return partial(dashpot, zeta=lambda e: scale * tsuji_polynomial(e), exponent=exponent)


def viscoelastic(exponent: float) -> Maker:
    """η m a δ̇ with the contact radius a = √(R* δ), which LAMMPS has for a linear spring too."""
    return partial(
        drag,
        c=lambda eta, m, R_eff: eta * m * np.sqrt(R_eff),
        q=0.5,
        # a linear spring is slow to overcome so strong a damping, which takes steps in proportion to it
        parameters=(replace(VISCOELASTIC[0], typical=1e3),) if exponent == 1.0 else VISCOELASTIC,
        exponent=exponent,
    )


OLD = "releases from March 2019 to mid-2026"
WITHOUT_ROOT = "where e = 0.5 is asked for LAMMPS itself delivers 0.616 with hertz, 0.581 with hooke, by default"
WITH_ROOT = (
    "the source credits the polynomial to Marshall (2009), equation 53; the factor √2 is of pull request 5113, "
    "and the first release with it was not seen"
)
SPRING, HERTZ = "F = K δ", "F = K δ^(3/2)"
LOGARITHM = "−ln e/√(π² + ln² e)"

MODELS: tuple[ForceModel, ...] = (
    *entries(
        "lammps-velocity-hooke", "velocity, hooke", "since March 2019", 2019, f"{SPRING} + C δ̇",
        renamed(KELVIN_VOIGT, KELVIN_VOIGT_NO_TENSION),
    ),
    *entries(
        "lammps-velocity-hertz", "velocity, hertz", "since March 2019", 2019, f"{HERTZ} + C δ̇",
        partial(drag, c=lambda C: C, q=0.0, parameters=CONSTANT, exponent=1.5),
    ),
    *entries(
        "lammps-mass-velocity-hooke", "mass_velocity, hooke", "since 2019", 2019, f"{SPRING} + γ m δ̇",
        partial(
            dashpot, zeta=lambda gamma, m, K: 0.5 * gamma * np.sqrt(m / K), parameters=MASS_VELOCITY, exponent=1.0
        ),
    ),
    *entries(
        "lammps-mass-velocity-hertz", "mass_velocity, hertz", "since 2019", 2019, f"{HERTZ} + γ m δ̇",
        mass_velocity_hertz,
    ),
    *entries(
        "lammps-viscoelastic-hooke", "viscoelastic, hooke", "since March 2019", 2019,
        f"{SPRING} + η m √(R* δ) δ̇", viscoelastic(1.0),
    ),
    *entries(
        "lammps-viscoelastic-hertz", "viscoelastic, hertz", "since March 2019", 2019,
        f"{HERTZ} + η m √(R* δ) δ̇", viscoelastic(1.5), note="pair style gran/hertz/history has it too",
    ),
    *entries(
        "lammps-tsuji-hooke", "tsuji, hooke", "sources of July 2026", 2026, f"{SPRING} + α √(m K) δ̇,  α = √2 "
        "p(e)",
        tsuji(np.sqrt(2.0), 1.0), DAMPING, WITH_ROOT,
    ),
    *entries(
        "lammps-tsuji-hooke-without-root", "tsuji, hooke", OLD, 2019, f"{SPRING} + α √(m K) δ̇,  α = p(e)",
        tsuji(1.0, 1.0), DAMPING_2024, WITHOUT_ROOT,
    ),
    *entries(
        "lammps-tsuji", "tsuji, hertz", "sources of July 2026", 2026,
        f"{HERTZ} + α √(m K) δ^(1/4) δ̇,  α = √2 p(e), p of degree six",
        tsuji(np.sqrt(2.0), 1.5), DAMPING, WITH_ROOT,
    ),
    *entries(
        "lammps-tsuji-without-root", "tsuji, hertz", OLD, 2019,
        f"{HERTZ} + α √(m K) δ^(1/4) δ̇,  α = p(e), p of degree six",
        tsuji(1.0, 1.5), DAMPING_2024, WITHOUT_ROOT,
    ),
    *entries(
        "lammps-coeff-restitution-hooke", "coeff_restitution, hooke", "since June 2024", 2024,
        f"{SPRING} + 2 ζ √(m K) δ̇,  ζ = {LOGARITHM}",
        renamed(ANAGNOSTOPOULOS_1988, ANAGNOSTOPOULOS_1988_NO_TENSION), DAMPING,
    ),
    *entries(
        "lammps-coeff-restitution-hertz", "coeff_restitution, hertz", "since June 2024", 2024,
        f"{HERTZ} + α √(m K) δ^(1/4) δ̇,  α = √5 ζ,  ζ = {LOGARITHM}",
        renamed(TSUJI_1992, TSUJI_1992_NO_TENSION), DAMPING,
    ),
)  # fmt: skip
