"""A sphere and a plane, or a second sphere at rest, in Newton's SolverSemiImplicit, on a CPU."""

from __future__ import annotations

import math
from importlib.metadata import version

import newton
import warp as wp
from runner import serve

wp.config.quiet = True
wp.set_device("cpu")


def collide(
    ke: float, kd: float, mu: float, m1: float, R1: float, v1: float, u1: float, omega1: float, gap: float,
    step: float, count: int, m2: float = math.inf, R2: float = math.inf,
) -> tuple[float, float, float]:  # fmt: skip
    # with which the friction kf g stops the slip of solid spheres in one step, if it is within mu N
    kf = 2 / 7 / (1 / m1 + 1 / m2) / step
    contact = newton.ModelBuilder.ShapeConfig(density=0, ke=ke, kd=kd, kf=kf, mu=mu)
    builder = newton.ModelBuilder(gravity=(0, 0, 0))
    # the normal is along x at the first touch, the tangent along y
    balls = [(m1, R1, -R1 - gap, -u1 * gap / v1), (m2, R2, R2, 0.0)]
    for mass, radius, x, y in balls[: 1 if math.isinf(R2) else 2]:
        moment = 0.4 * mass * radius**2
        inertia = wp.mat33(moment, 0, 0, 0, moment, 0, 0, 0, moment)
        body = builder.add_body(xform=wp.transform((x, y, 0), wp.quat_identity()), mass=mass, inertia=inertia)
        builder.add_shape_sphere(body, radius=radius, cfg=contact)
    if math.isinf(R2):
        builder.add_shape_plane((-1.0, 0.0, 0.0, 0.0), width=0, length=0, cfg=contact)
    model = builder.finalize()
    solver = newton.solvers.SolverSemiImplicit(model)
    state, following, control = model.state(), model.state(), model.control()
    still = [(0, 0, 0, 0, 0, 0)] * (0 if math.isinf(R2) else 1)
    state.body_qd.assign([(v1, u1, 0, 0, 0, omega1), *still])
    pipeline = newton.CollisionPipeline(model)
    contacts = pipeline.contacts()
    for _ in range(count):
        state.clear_forces()
        pipeline.collide(state, contacts)
        solver.step(state, following, control, contacts, step)
        state, following = following, state
    v, u, *_, omega = state.body_qd.numpy()[0].tolist()
    return v, u, omega


serve(version("newton"), collide)
