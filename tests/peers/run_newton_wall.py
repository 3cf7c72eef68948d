"""A sphere and a plane, or a second sphere at rest, in Newton's SolverSemiImplicit, on a CPU."""

from __future__ import annotations

import math

import newton
from newton_worlds import Speed, add_ball, serve_worlds


def add_balls(
    builder: newton.ModelBuilder, ke: float, kd: float, mu: float, m1: float, R1: float, v1: float, u1: float,
    omega1: float, gap: float, step: float, count: int, m2: float = math.inf, R2: float = math.inf,
) -> list[Speed]:  # fmt: skip
    # with which the friction kf g stops the slip of solid spheres in one step, if it is within mu N
    contact = {"ke": ke, "kd": kd, "kf": 2 / 7 / (1 / m1 + 1 / m2) / step, "mu": mu}
    # the normal is along x at the first touch, the tangent along y
    add_ball(builder, m1, R1, -R1 - gap, -u1 * gap / v1, **contact)
    moving = (v1, u1, 0, 0, 0, omega1)
    if math.isinf(R2):
        plane = newton.ModelBuilder.ShapeConfig(**contact)
        builder.add_shape_plane((-1.0, 0.0, 0.0, 0.0), width=0, length=0, cfg=plane)
        return [moving]
    add_ball(builder, m2, R2, R2, 0.0, **contact)
    return [moving, (0, 0, 0, 0, 0, 0)]


serve_worlds(add_balls, lambda balls: (balls[0][0], balls[0][1], balls[0][5]))
