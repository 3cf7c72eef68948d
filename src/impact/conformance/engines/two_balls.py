"""What adapters share: the balls of a collision, its answer, and a linear spring with a dashpot that never pulls.

That contact ends where the force vanishes. With the damping ratio z and the frequency w of the undamped spring its
time is 2 half_time(z)/w, and e = exp(-2 z half_time(z)).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

SOLID = 0.4
# the balls touch after half of a step, and three contact times are run
PHASE, CONTACTS = 0.5, 3.0


class Ball(NamedTuple):
    """A ball of a collision: ball 1 is on the left, its side is -1, that of ball 2 is 1."""

    number: str
    side: float
    m: float
    R: float
    inertia: float
    v: float
    u: float
    omega: float

    @property
    def is_solid(self) -> bool:
        """Whether it is a solid sphere."""
        return abs(self.inertia / (SOLID * self.m * self.R * self.R) - 1.0) <= 1e-9

    def start(self, time: float) -> tuple[float, float]:
        """Find the centre at a time before the balls touch, side by side, at the origin.

        >>> Ball("1", side=-1.0, m=1.0, R=0.5, inertia=0.1, v=2.0, u=1.0, omega=0.0).start(0.25)
        (-1.0, -0.25)
        """
        return self.side * self.R - self.v * time, -self.u * time


def balls_of(c: dict[str, Any]) -> list[Ball]:
    """List the balls of a collision: one where the other is a wall."""
    return [
        Ball(number, side, *(c[f"{name}{number}"] for name in Ball._fields[2:]))
        for number, side in (("1", -1.0), ("2", 1.0))
        if c[f"m{number}"] is not None
    ]


def harmonic(values: Iterable[float]) -> float:
    """Combine masses, or radii, of the balls to the effective one."""
    return 1.0 / sum(1.0 / value for value in values)


def answer_of(c: dict[str, Any], motions: Iterable[Iterable[float]], kind: str, **facts: Any) -> dict[str, Any]:
    """Make an answer of v, u and omega of each ball, and of what it states about the engine."""
    answer = {"id": c["id"], "kind": kind, **facts}
    for number, motion in zip("12", motions, strict=False):
        answer |= zip((f"v{number}", f"u{number}", f"omega{number}"), motion, strict=True)
    return answer


def granular_script(script: str, atom: str, c: dict[str, Any], **values: Any) -> str:
    """Fill a script of LAMMPS or LIGGGHTS, and the lines of each atom: x, y, its diameter, and the ball."""
    balls = balls_of(c)
    largest = max(ball.R for ball in balls)
    atoms = [atom.format(*ball.start(PHASE * c["dt"]), 2.0 * ball.R, ball=ball) for ball in balls]
    steps = math.ceil(CONTACTS * c["contact_time"] / c["dt"])
    values |= {"balls": "".join(atoms), "dt": repr(c["dt"]), "steps": steps}
    return script.format(reach=10.0 * largest, skin=0.1 * largest, **values)


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

    >>> [round(math.exp(-2.0 * z * half_time(z)), 12) for z in map(damping_ratio, (0.1, 0.5))]
    [0.1, 0.5]
    """
    low, high = 0.0, 1.0 / e
    for _ in range(100):
        z = (low + high) / 2.0
        low, high = (z, high) if 2.0 * z * half_time(z) < -math.log(e) else (low, z)
    return (low + high) / 2.0
