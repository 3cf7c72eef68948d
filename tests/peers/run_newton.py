"""Two spheres in Newton's SolverSemiImplicit, on a CPU."""

from __future__ import annotations

import newton
from newton_worlds import Speed, add_ball, serve_worlds


def add_balls(
    builder: newton.ModelBuilder, ke: list[float], kd: list[float], m1: float, m2: float, R1: float, R2: float,
    v1: float, v2: float, gap: float, step: float, count: int,
) -> list[Speed]:  # fmt: skip
    add_ball(builder, m1, R1, -R1 - gap, 0.0, ke=ke[0], kd=kd[0], mu=0.0)
    add_ball(builder, m2, R2, R2, 0.0, ke=ke[1], kd=kd[1], mu=0.0)
    return [(v1, 0, 0, 0, 0, 0), (v2, 0, 0, 0, 0, 0)]


serve_worlds(add_balls, lambda balls: tuple(speed[0] for speed in balls))
