"""Parameters that several friction laws have."""

from __future__ import annotations

from ..model import Parameter


def choice(name: str, meaning: str, words: tuple[str, ...], default: str) -> Parameter:
    """Make a parameter that is one of some words."""
    last = float(len(words) - 1)
    return Parameter(name, "1", meaning, float(words.index(default)), 0.0, last, choices=words)


def limit(default: str) -> Parameter:
    """Make the choice of the normal force that limits friction."""
    meaning = 'N of the limit μ N: "abs" is |F|, also where the contact pulls; "positive" is max(F, 0)'
    return choice("limit", meaning, ("abs", "positive"), default)


XT = Parameter("xt", "1", "tangential damping over the damping of the contact force", default=1.0, least=0.0)
KT_OVER_KN = Parameter(
    "kt_over_kn",
    "1",
    "stiffness over that of the contact at the same indentation, n K δⁿ⁻¹",
    least=1e-9,
    optional=True,
)
# one of the two has to be set, or 8 G* a is taken
CONSTANT_STIFFNESS = (Parameter("k_t", "N/m", "tangential stiffness", least=1e-9, optional=True), KT_OVER_KN)
MINDLIN_STIFFNESS = (
    Parameter(
        "k_t", "N/m^1.5", "tangential stiffness over √δ, in the place of 8 G* √R*", least=1e-9, optional=True
    ),
    KT_OVER_KN,
)
