"""Springs with a dashpot of constant damping ratio, F = K δⁿ + α √(m K) δ^((n−1)/2) δ̇: e does not depend on speed.

Such a force pulls before the balls separate, so that the end of the contact is part of the law: zero indentation
("gap") or, without tension, zero force ("force").
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, Literal, Unpack

import numpy as np

from ...array_types import Array
from ...formatting import polynomial
from ..closed_forms.dashpot import force_damping, force_restitution, gap_damping, gap_restitution
from ..evidence import derived, seen
from ..force_expressions import dragged
from ..formula_calls import Formula
from ..model import About, ForceModel, Parameter
from ..powers import power
from .cited_sources import CHRONO, DEMLAB_VISCOELASTIC, LIGGGHTS, MAPLESIM_HELP, YADE_2025, YADE_BIBLIOGRAPHY

# by where the contact ends: its words in an equation, and the closed form of the restitution
ENDS: dict[str, tuple[str, Formula]] = {
    "gap": ("to δ = 0", gap_restitution),
    "force": ("to F = 0", force_restitution),
}


def drag_exponent(n: float) -> float:
    """The exponent of the indentation in the damping."""
    return (n - 1) / 2


def dashpot_force(elastic: Array, x: Array, v: Array, n: float, c: Array) -> Array:
    """K δⁿ + c δ^((n−1)/2) δ̇, shared by all laws: those with the same c have the same motion."""
    return dragged(elastic, power(x, drag_exponent(n)), v, c)


def dashpot(
    key: str, *, zeta: Formula, release: Literal["gap", "force"] = "gap", **about: Unpack[About]
) -> ForceModel:
    """Make a law of a spring and a dashpot, from the formula of its damping ratio ζ = α/√(2(n+1)).

    >>> law = dashpot("mine", title="Mine", year=2026, equation="ζ = 1 − e", reference="", zeta=lambda e: 1 - e,
    ...               release="force", exponent=1.0)
    >>> print(law.force(elastic=1.0, x=1.0, v=0.5, n=1.0, c=2.0))
    2.0
    """
    about.setdefault("family", "dashpot")
    return ForceModel(
        key,
        **about,
        coefficients={
            "zeta": zeta,
            "c": lambda zeta, n, m, K: zeta * np.sqrt(2 * (n + 1) * m * K),
            "q": drag_exponent,
        },
        force=dashpot_force,
        release=release,
        velocity_coordinate="force",
        oracle=ENDS[release][1],
        # with n = 3/2 the dashpot is proportional to the fourth root of the indentation
        coordinate_power=2 if about.get("exponent") == 1.0 else 4,
    )


def with_release(law: ForceModel, release: Literal["gap", "force"], **changes: Any) -> ForceModel:
    """Change where the contact of a law made by `dashpot` ends, with the same damping ratio."""
    end, oracle = ENDS[release]
    equation = law.equation.replace(ENDS[law.release][0], end)
    return replace(law, release=release, equation=equation, oracle=oracle, **changes)


# the forces and damping ratios as texts of `equation`
LINEAR_DASHPOT = "F = K δ + 2 ζ √(m K) δ̇"
HERTZIAN_DASHPOT = "F = K δ^(3/2) + α √(m K) δ^(1/4) δ̇"
GENERAL_DASHPOT = "F = K δⁿ + α √(m K) δ^((n−1)/2) δ̇"
ZETA_BY_LOGARITHM = "ζ = −ln e/√(π² + ln² e)"
# a parameter that sets the restitution of a law without an e
damping = partial(Parameter, least=0.0, is_damping=True)
DASHPOT_CONSTANT = (damping("C", "N s/m", "damping constant of the dashpot"),)
# coefficients of the polynomial p(e) of Thornton, Cummins and Cleary, from the zeroth power of e
THORNTON_POLYNOMIAL = (
    -6.918798, -16.41105, 146.8049, -796.4559, 2928.711, -7206.864, 11494.29, -11342.18, 6276.757, -1489.915,
)  # fmt: skip
THORNTON_EQUATION = (
    "F = K δ^(3/2) + 2 β √(m S) δ̇,  S = (3/2) K δ^(1/2),  β = √(1/(1 − (1 + e)² exp(e p(e))) − 1), to F = 0;  "
    f"p(e) = {polynomial(THORNTON_POLYNOMIAL, 'e')}"
)

KELVIN_VOIGT = dashpot(
    "kelvin-voigt",
    title="Kelvin and Voigt",
    year=1960,
    equation="F = K δ + C δ̇, to δ = 0",
    reference="Cundall PA, Strack ODL (1979) A discrete numerical model for granular assemblies. Géotechnique "
    "29, 47; Goldsmith W (1960) Impact. Arnold, London",
    doi="10.1680/geot.1979.29.1.47",
    evidence=seen(
        "OpenSees/OpenSees, SRC/material/uniaxial/ViscoelasticGap.cpp @2890cb36f (2026), after Goldsmith (1960)",
        doi=DEMLAB_VISCOELASTIC,
    ),
    parameters=DASHPOT_CONSTANT,
    zeta=lambda C, m, K: C / (2 * np.sqrt(m * K)),
    exponent=1.0,
)

KELVIN_VOIGT_NO_TENSION = with_release(
    KELVIN_VOIGT,
    "force",
    key="kelvin-voigt-no-tension",
    title="Kelvin and Voigt, without tension",
    evidence=seen(MAPLESIM_HELP, doi=DEMLAB_VISCOELASTIC),
)

ANAGNOSTOPOULOS_1988 = dashpot(
    "anagnostopoulos-1988",
    title="Anagnostopoulos",
    year=1988,
    equation=f"{LINEAR_DASHPOT},  {ZETA_BY_LOGARITHM}, to δ = 0",
    reference="Anagnostopoulos SA (1988) Pounding of buildings in series during earthquakes. EESD 16, 443",
    doi="10.1002/eqe.4290160311",
    evidence=seen(
        f"{LIGGGHTS}normal_model_hooke.h",
        doi="koreascience.or.kr, JAKO201832853252619, references",
        note="no source of the formula names the paper",
    ),
    zeta=gap_damping,
    exponent=1.0,
)

ANAGNOSTOPOULOS_1988_NO_TENSION = with_release(
    ANAGNOSTOPOULOS_1988,
    "force",
    key="anagnostopoulos-1988-no-tension",
    title="Anagnostopoulos, without tension",
    evidence=seen(
        CHRONO,
        doi="koreascience.or.kr, JAKO201832853252619, references",
        note="the end at zero force is that of codes",
    ),
)

TSUJI_1992 = dashpot(
    "tsuji-1992",
    title="Tsuji, Tanaka and Ishida",
    year=1992,
    equation=f"{HERTZIAN_DASHPOT},  α = −√5 ln e/√(π² + ln² e), to δ = 0",
    reference="Tsuji Y, Tanaka T, Ishida T (1992) Lagrangian numerical simulation of plug flow of cohesionless "
    "particles in a horizontal pipe. Powder Technol. 71, 239; Antypov D, Elliott JA (2011) On an analytical "
    "solution for the damped Hertzian spring. EPL 94, 50004",
    doi="10.1016/0032-5910(92)88030-L",
    evidence=seen(
        f"{LIGGGHTS}normal_model_hertz.h; equations (10) and (17) of Antypov and Elliott (2011) in "
        "Azeko2xo/woodem, pkg/dem/Hertz.cpp @f94485c (2015)",
        doi=DEMLAB_VISCOELASTIC,
    ),
    zeta=gap_damping,
    exponent=1.5,
)

TSUJI_1992_NO_TENSION = with_release(
    TSUJI_1992,
    "force",
    key="tsuji-1992-no-tension",
    title="Tsuji, Tanaka and Ishida, without tension",
    evidence=seen(
        "Azeko2xo/woodem, pkg/dem/Hertz.cpp @f94485c (2015), noAttraction; projectchrono/chrono, ChContactSMC.cpp "
        "@7689fbc02d (2026)",
        doi=DEMLAB_VISCOELASTIC,
        note="the end at zero force is that of codes",
    ),
)

SCHWAGER_POSCHEL_2007 = dashpot(
    "schwager-poschel-2007",
    title="Schwager and Pöschel",
    year=2007,
    equation=f"{LINEAR_DASHPOT},  e = exp(−2 ζ acos(ζ)/√(1 − ζ²)), to F = 0",
    reference="Schwager T, Pöschel T (2007) Coefficient of restitution and linear-dashpot model revisited. "
    "Granul. Matter 9, 465",
    doi="10.1007/s10035-007-0065-z",
    evidence=seen(
        f"{YADE_2025}, ViscoelasticPM.cpp, after equation (21) of the paper, whose sign it corrects",
        doi=YADE_BIBLIOGRAPHY,
    ),
    zeta=force_damping,
    release="force",
    exponent=1.0,
)

THORNTON_CUMMINS_CLEARY_2013 = dashpot(
    "thornton-cummins-cleary-2013",
    title="Thornton, Cummins and Cleary",
    year=2013,
    equation=THORNTON_EQUATION,
    reference="Thornton C, Cummins SJ, Cleary PW (2013) An investigation of the comparative behaviour of "
    "alternative contact force models during inelastic collisions. Powder Technol. 233, 30",
    doi="10.1016/j.powtec.2012.08.012",
    evidence=seen(
        f"{YADE_2025}, HertzMindlin.cpp, after (B6), (B7) and Table 2 of the paper",
        doi=YADE_BIBLIOGRAPHY,
    ),
    zeta=lambda e: thornton_zeta(e),
    release="force",
    exponent=1.5,
)


def thornton_zeta(e: Array) -> Array:
    """ζ [-] of Thornton, Cummins and Cleary, whose β is √(5/6) ζ, since α = 2 β √(3/2); e of any shape."""
    exponent = e * np.polyval(THORNTON_POLYNOMIAL[::-1], e)
    beta = np.sqrt(1 / (1 - (1 + e) * (1 + e) * np.exp(exponent)) - 1)
    return np.asarray(2 * np.sqrt(1.5) * beta / np.sqrt(5.0))


FENG_2026 = dashpot(
    "feng-2026",
    title="Feng",
    year=2026,
    equation=f"{GENERAL_DASHPOT},  α = −√(2(n + 1)) ln e/√(π² + ln² e), to δ = 0",
    reference="Feng YT (2026) Exact phase-space analytical solution for the power-law damped contact oscillator. "
    "arXiv:2603.27764",
    evidence=seen("arXiv:2603.27764"),
    zeta=gap_damping,
)

EXACT_DASHPOT_NO_TENSION = dashpot(
    "exact-dashpot-no-tension",
    title="Exact dashpot, without tension",
    year=2026,
    equation=f"{GENERAL_DASHPOT},  α = ζ √(2(n + 1)),  e = exp(−2 ζ acos(ζ)/√(1 − ζ²)), to F = 0",
    reference="Schwager T, Pöschel T (2007) Granul. Matter 9, 465, for n = 1; Feng YT (2026) arXiv:2603.27764",
    evidence=derived("src/impact/contact/closed_forms/dashpot.py"),
    zeta=force_damping,
    release="force",
)
