"""The impulse-momentum solution, the reference for every law: equations (4) to (9)."""

from __future__ import annotations

import numpy as np

from ..array_types import Array
from .impacts import Impacts
from .powers import all_within

MAX_FLOAT = float(np.finfo(float).max)


def velocities_at(impacts: Impacts, impulse: Array) -> tuple[Array, Array]:
    """Compute v1, v2 [m/s] once an impulse tau [N s] has passed: equations (8) and (9), shape (n,).

    (9) as printed has a minus, an erratum. An infinite mass (a wall) keeps its velocity.
    """
    return impacts.v1 - impulse / impacts.m1, impacts.v2 + impulse / impacts.m2


def velocities_after(impacts: Impacts, e: Array) -> tuple[Array, Array]:
    """Compute v1+, v2+ [m/s] after an impact of restitution e: equations (6) and (7), shape (n,).

    Balls that do not approach keep their velocities; an impulse that overflows gives NaN.
    """
    impulse = (1.0 + e) * impacts.m * impacts.v0
    if not impacts.all_approach:
        impulse = np.where(impacts.v0 > 0.0, impulse, 0.0)
    if not all_within(impulse, -MAX_FLOAT, MAX_FLOAT):
        impulse = np.where(np.isfinite(impulse), impulse, np.nan)
    return velocities_at(impacts, impulse)
