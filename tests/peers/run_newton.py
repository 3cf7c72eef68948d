"""Two spheres in Newton's SolverSemiImplicit, on a CPU."""

from __future__ import annotations

from importlib.metadata import version

import newton
import warp as wp
from runner import serve

wp.config.quiet = True
wp.set_device("cpu")


def collide(
    ke: list[float], kd: list[float], m1: float, m2: float, R1: float, R2: float, v1: float, v2: float,
    gap: float, step: float, count: int,
) -> tuple[float, float]:  # fmt: skip
    builder = newton.ModelBuilder(gravity=(0, 0, 0))
    for i, mass, radius, x in ((0, m1, R1, -R1 - gap), (1, m2, R2, R2)):
        moment = 0.4 * mass * radius**2
        inertia = wp.mat33(moment, 0, 0, 0, moment, 0, 0, 0, moment)
        body = builder.add_body(xform=wp.transform((x, 0, 0), wp.quat_identity()), mass=mass, inertia=inertia)
        shape = newton.ModelBuilder.ShapeConfig(density=0, ke=ke[i], kd=kd[i], mu=0)
        builder.add_shape_sphere(body, radius=radius, cfg=shape)
    model = builder.finalize()
    solver = newton.solvers.SolverSemiImplicit(model)
    state, following, control = model.state(), model.state(), model.control()
    state.body_qd.assign([(v1, 0, 0, 0, 0, 0), (v2, 0, 0, 0, 0, 0)])
    pipeline = newton.CollisionPipeline(model)
    contacts = pipeline.contacts()
    for _ in range(count):
        state.clear_forces()
        pipeline.collide(state, contacts)
        solver.step(state, following, control, contacts, step)
        state, following = following, state
    first, second = state.body_qd.numpy()[:, 0]
    return float(first), float(second)


serve(version("newton"), collide)
