"""A linear spring with a dashpot that never pulls: what an adapter needs to ask for e and a contact time.

The contact ends where the force vanishes. With the damping ratio z and the frequency w of the undamped spring its
time is 2 half_time(z)/w, and e = exp(-2 z half_time(z)).
"""

from __future__ import annotations

import math


def half_time(z: float) -> float:
    """Half of the contact time, and the time of the approach, in units of 1/w.

    >>> half_time(0.0) == math.pi / 2, half_time(1.0)
    (True, 1.0)
    """
    if z == 1.0:
        return 1.0
    return math.acos(z) / math.sqrt(1.0 - z * z) if z < 1.0 else math.acosh(z) / math.sqrt(z * z - 1.0)


def damping_ratio(e: float) -> float:
    """Find the damping ratio that delivers e; with a dashpot that acts on approach only, that of e^2 does.

    >>> z = damping_ratio(0.5)
    >>> round(math.exp(-2.0 * z * half_time(z)), 12)
    0.5
    """
    low, high = 0.0, 1.0 / e
    for _ in range(100):
        z = (low + high) / 2.0
        low, high = (z, high) if 2.0 * z * half_time(z) < -math.log(e) else (low, z)
    return (low + high) / 2.0
