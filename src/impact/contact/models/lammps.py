"""LAMMPS, pair style granular: every damping with a linear and a Hertzian spring, without and with limit_damping.

By default the force pulls until the indentation is zero; with limit_damping the contact ends at zero force.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...formatting import polynomial
from ..evidence import seen
from ..model import ForceModel
from .aliases import same_law
from .dashpot import (
    ANAGNOSTOPOULOS_1988,
    ANAGNOSTOPOULOS_1988_NO_TENSION,
    DASHPOT_CONSTANT,
    KELVIN_VOIGT,
    KELVIN_VOIGT_NO_TENSION,
    TSUJI_1992,
    TSUJI_1992_NO_TENSION,
    damping,
    dashpot,
)
from .viscoelastic import LEE_HERRMANN_1993, drag

# of the polynomial p(e) of α that LAMMPS calls tsuji and credits to Marshall (2009), equation 53, in powers of e
TSUJI_POLYNOMIAL = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)
P = f"p(e),  p(e) = {polynomial(TSUJI_POLYNOMIAL, 'e')}"
DAMPING_KERNEL_SOURCE = "lammps/lammps, src/GRANULAR/gran_sub_mod_damping_kernel.h @07b704ca (2026)"
DAMPING_SOURCE = "lammps/lammps, src/GRANULAR/gran_sub_mod_damping.cpp @07b704ca (2026)"
DAMPING_SOURCE_2024 = "LAMMPS release of 29 August 2024, src/GRANULAR/gran_sub_mod_damping.cpp"
# limit_damping: pull request 2698, first in patch_8Apr2021
LIMIT_YEAR = 2021
MASS_VELOCITY = LEE_HERRMANN_1993.parameters
VISCOELASTIC = (damping("eta", "1/m/s", "damping η per effective mass and contact radius"),)

# make a law, from fields of ForceModel, that ends at zero indentation, and one that ends at zero force
MakeLaws = Iterable[Callable[..., ForceModel]]


def renamed(*laws: ForceModel) -> MakeLaws:
    """Make laws of the catalogue under another name; the formulas stay the same."""
    return [partial(same_law, law) for law in laws]


def both_releases(make: Callable[..., ForceModel], **about: Any) -> MakeLaws:
    """Make laws that differ in where the contact ends."""
    return [partial(make, release=release, **about) for release in ("gap", "force")]


def with_and_without_limit(
    option: str,
    damping: str,
    laws: MakeLaws,
    *,
    key: str = "",
    since: str = "since March 2019",
    year: int = 2019,
    source: str = DAMPING_KERNEL_SOURCE,
    note: str = "",
) -> Iterator[ForceModel]:
    """Make the laws of one option of LAMMPS: the default, and the one with limit_damping.

    `since` names the releases that have it, `year` is that of the first. By default the key is that of the option.
    """
    key = key or re.sub("[_, ]+", "-", f"lammps-{option}")
    spring = "F = K δ" if option.endswith("hooke") else "F = K δ^(3/2)"
    # limit_damping is newer than the oldest of these options
    limited = re.sub(r"(March )?2019", f"April {LIMIT_YEAR}", since)
    of_release = (
        ("", option, "δ = 0", since, year),
        ("-limit", f"{option}, limit_damping", "F = 0", limited, max(year, LIMIT_YEAR)),
    )
    for make, (suffix, keywords, end, releases, first_year) in zip(laws, of_release, strict=True):
        yield make(
            key=key + suffix,
            title=f"LAMMPS {keywords} ({releases})",
            year=first_year,
            equation=f"{spring} + {damping}, to {end}",
            reference="LAMMPS, pair style granular",
            evidence=seen(source, note=note),
            family="codes",
        )


def tsuji(root: float, exponent: float) -> MakeLaws:
    """Make the dashpot α √(m K) δ^((n−1)/2) δ̇ with α = root p(e)."""
    scale = root / np.sqrt(2 * (exponent + 1))
    return both_releases(dashpot, zeta=lambda e: scale * np.polyval(TSUJI_POLYNOMIAL[::-1], e), exponent=exponent)


def viscoelastic(exponent: float) -> MakeLaws:
    """Make the damping η m a δ̇ with the contact radius a = √(R* δ), which LAMMPS also has for a linear spring."""
    return both_releases(
        drag,
        c=lambda eta, m, R_eff: eta * m * np.sqrt(R_eff),
        q=0.5,
        # with a linear spring the number of steps grows in proportion to a strong damping
        parameters=(replace(VISCOELASTIC[0], typical=1e3),) if exponent == 1.0 else VISCOELASTIC,
        exponent=exponent,
    )


LOGARITHM = "−ln e/√(π² + ln² e)"
WITH_ROOT: dict[str, Any] = {
    "since": "sources of July 2026",
    "year": 2026,
    "source": DAMPING_SOURCE,
    "note": "the source credits the polynomial to Marshall (2009), equation 53; the factor √2 is of pull request "
    "5113, and the first release with it was not seen",
}
WITHOUT_ROOT: dict[str, Any] = {
    "since": "releases from March 2019 to mid-2026",
    "source": DAMPING_SOURCE_2024,
    "note": "where e = 0.5 is asked for LAMMPS itself delivers 0.616 with hertz, 0.581 with hooke, by default",
}
COEFF_RESTITUTION: dict[str, Any] = {"since": "since June 2024", "year": 2024, "source": DAMPING_SOURCE}

LAMMPS_MODELS: tuple[ForceModel, ...] = (
    *with_and_without_limit(
        "coeff_restitution, hertz", f"α √(m K) δ^(1/4) δ̇,  α = √5 ζ,  ζ = {LOGARITHM}",
        renamed(TSUJI_1992, TSUJI_1992_NO_TENSION), **COEFF_RESTITUTION,
    ),
    *with_and_without_limit(
        "coeff_restitution, hooke", f"2 ζ √(m K) δ̇,  ζ = {LOGARITHM}",
        renamed(ANAGNOSTOPOULOS_1988, ANAGNOSTOPOULOS_1988_NO_TENSION), **COEFF_RESTITUTION,
    ),
    *with_and_without_limit(
        "tsuji, hertz", f"α √(m K) δ^(1/4) δ̇,  α = √2 {P}", tsuji(np.sqrt(2.0), 1.5),
        key="lammps-tsuji", **WITH_ROOT,
    ),
    *with_and_without_limit("tsuji, hooke", f"α √(m K) δ̇,  α = √2 {P}", tsuji(np.sqrt(2.0), 1.0), **WITH_ROOT),
    *with_and_without_limit(
        "tsuji, hertz", f"α √(m K) δ^(1/4) δ̇,  α = {P}", tsuji(1.0, 1.5),
        key="lammps-tsuji-without-root", **WITHOUT_ROOT,
    ),
    *with_and_without_limit(
        "tsuji, hooke", f"α √(m K) δ̇,  α = {P}", tsuji(1.0, 1.0),
        key="lammps-tsuji-hooke-without-root", **WITHOUT_ROOT,
    ),
    *with_and_without_limit(
        "velocity, hertz", "C δ̇", both_releases(drag, c=lambda C: C, q=0.0, parameters=DASHPOT_CONSTANT),
    ),
    *with_and_without_limit("velocity, hooke", "C δ̇", renamed(KELVIN_VOIGT, KELVIN_VOIGT_NO_TENSION)),
    *with_and_without_limit(
        "mass_velocity, hertz", "γ m δ̇",
        (partial(replace, LEE_HERRMANN_1993, release="gap", doi=""), partial(same_law, LEE_HERRMANN_1993)),
        since="since 2019",
    ),
    *with_and_without_limit(
        "mass_velocity, hooke", "γ m δ̇",
        both_releases(
            dashpot, zeta=lambda gamma, m, K: 0.5 * gamma * np.sqrt(m / K), parameters=MASS_VELOCITY, exponent=1.0
        ),
        since="since 2019",
    ),
    *with_and_without_limit(
        "viscoelastic, hertz", "η m √(R* δ) δ̇", viscoelastic(1.5), note="pair style gran/hertz/history has it too",
    ),
    *with_and_without_limit("viscoelastic, hooke", "η m √(R* δ) δ̇", viscoelastic(1.0)),
)  # fmt: skip
