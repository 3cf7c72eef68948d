"""The impulse-momentum solution, which every law is compared with: equations (4) to (9)."""

from __future__ import annotations

import numpy as np

from .lanes import Lanes
from .power import Array


def velocities_after(lanes: Lanes, e: Array) -> tuple[Array, Array]:
    """Velocities v1+, v2+ [m/s] after an impact of restitution e: equations (6) and (7), shape (n,).

    Written as v1+ = v1 - (1 + e)(m/m1) v0, v2+ = v2 + (1 + e)(m/m2) v0, which an infinite mass (a wall) does
    not disturb. Balls that do not approach keep their velocities.
    """
    impulse = (1.0 + e) * lanes.m * lanes.v0
    impulse = np.where(lanes.v0 > 0.0, impulse, 0.0)
    return lanes.v1 - impulse / lanes.m1, lanes.v2 + impulse / lanes.m2
