"""Newton: spheres, and a plane as the wall, with SolverSemiImplicit on the processor, in single precision."""

from __future__ import annotations

import math
from typing import Any

SETTINGS = "SolverSemiImplicit, kd for e, kf that ends a slip in five steps, no angular_damping, 4 dt"
STEPS_BEFORE, CONTACTS = 1, 2.0
# over the suggested contact time and step, so that single precision resolves the motion within a step
SLOWER = 4.0
# the slip that sticks decays over so many steps
FRICTION_STEPS = 5.0
# by the number of balls: the phases of the search for contacts, whose kernels take longer to make than a collision
PHASES: dict[int, dict[str, Any]] = {}


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision whose balls touch, side by side, after the first step."""
    import newton
    import warp as wp
    from two_balls import answer_of, balls_of, damping_ratio, half_time

    wp.config.quiet = True
    wp.set_device("cpu")
    balls = balls_of(c)
    step, contact_time = SLOWER * c["dt"], SLOWER * c["contact_time"]
    masses = [1.0 / ball.m for ball in balls]
    turning = [ball.R**2 / ball.inertia for ball in balls]
    # its damping acts on approach only
    z = damping_ratio(c["e"] ** 2)
    frequency = (half_time(z) + math.pi / 2.0) / contact_time
    m, m_t = 1.0 / sum(masses), 1.0 / sum(masses + turning)
    contact = newton.ModelBuilder.ShapeConfig(
        density=0,
        ke=m * frequency**2,
        kd=2.0 * z * m * frequency,
        kf=m_t / (FRICTION_STEPS * step),
        mu=c["mu"],
        mu_torsional=0.0,
        mu_rolling=0.0,
    )
    builder = newton.ModelBuilder(gravity=(0, 0, 0))
    speeds = []
    for ball in balls:
        pose = wp.transform((*ball.start(STEPS_BEFORE * step), 0), wp.quat_identity())
        moments = wp.mat33(ball.inertia, 0, 0, 0, ball.inertia, 0, 0, 0, ball.inertia)
        body = builder.add_body(xform=pose, mass=ball.m, inertia=moments)
        builder.add_shape_sphere(body, radius=ball.R, cfg=contact)
        speeds.append((ball.v, ball.u, 0, 0, 0, ball.omega))
    if len(balls) == 1:
        builder.add_shape_plane((-1.0, 0.0, 0.0, 0.0), width=0, length=0, cfg=contact)
    model = builder.finalize()
    solver = newton.solvers.SolverSemiImplicit(model, angular_damping=0.0)
    state, following, control = model.state(), model.state(), model.control()
    state.body_qd.assign(speeds)
    pipeline = newton.CollisionPipeline(model, **PHASES.get(len(balls), {}))
    PHASES[len(balls)] = {"broad_phase": pipeline.broad_phase, "narrow_phase": pipeline.narrow_phase}
    contacts = pipeline.contacts()
    # a recorded step takes a twentieth of the time
    with wp.ScopedCapture() as capture:
        state.clear_forces()
        pipeline.collide(state, contacts)
        solver.step(state, following, control, contacts, step)
        state.assign(following)
    for _ in range(STEPS_BEFORE + math.ceil(CONTACTS * contact_time / step)):
        wp.capture_launch(capture.graph)
    motions = state.body_qd.numpy()[:, [0, 1, 5]].tolist()
    return answer_of(c, motions, "compliant", precision="float32")
