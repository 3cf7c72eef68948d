"""Newton: spheres, and a plane as the wall, with SolverSemiImplicit on the processor, in single precision."""

from __future__ import annotations

import math
from typing import Any

STEPS_BEFORE, CONTACTS = 1, 2.0
# over the suggested contact time and step, so that single precision resolves the motion within a step
SLOWER = 4.0
# the slip that sticks decays over so many steps
FRICTION_STEPS = 5.0
# by the number of balls: the phases of the search for contacts, whose kernels take longer to make than a collision
PHASES: dict[int, dict[str, Any]] = {}


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision whose balls touch, side by side, after the first step."""
    from importlib.metadata import version

    import newton
    import warp as wp
    from linear_contact import damping_ratio, half_time

    wp.config.quiet = True
    wp.set_device("cpu")
    numbers = "1" if c["m2"] is None else "12"
    step, contact_time = SLOWER * c["dt"], SLOWER * c["contact_time"]
    masses = [1.0 / c[f"m{number}"] for number in numbers]
    turning = [c[f"R{number}"] ** 2 / c[f"inertia{number}"] for number in numbers]
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
    for number, side in zip(numbers, (-1.0, 1.0), strict=False):
        mass, R, inertia, v, u, omega = (c[f"{name}{number}"] for name in ("m", "R", "inertia", "v", "u", "omega"))
        before = STEPS_BEFORE * step
        pose = wp.transform((side * R - v * before, -u * before, 0), wp.quat_identity())
        moments = wp.mat33(inertia, 0, 0, 0, inertia, 0, 0, 0, inertia)
        body = builder.add_body(xform=pose, mass=mass, inertia=moments)
        builder.add_shape_sphere(body, radius=R, cfg=contact)
        speeds.append((v, u, 0, 0, 0, omega))
    if len(numbers) == 1:
        builder.add_shape_plane((-1.0, 0.0, 0.0, 0.0), width=0, length=0, cfg=contact)
    model = builder.finalize()
    solver = newton.solvers.SolverSemiImplicit(model, angular_damping=0.0)
    state, following, control = model.state(), model.state(), model.control()
    state.body_qd.assign(speeds)
    pipeline = newton.CollisionPipeline(model, **PHASES.get(len(numbers), {}))
    PHASES[len(numbers)] = {"broad_phase": pipeline.broad_phase, "narrow_phase": pipeline.narrow_phase}
    contacts = pipeline.contacts()
    # a recorded step takes a twentieth of the time
    with wp.ScopedCapture() as capture:
        state.clear_forces()
        pipeline.collide(state, contacts)
        solver.step(state, following, control, contacts, step)
        state.assign(following)
    for _ in range(STEPS_BEFORE + math.ceil(CONTACTS * contact_time / step)):
        wp.capture_launch(capture.graph)
    answer = {"id": c["id"], "version": version("newton"), "kind": "compliant"}
    answer["precision"] = "float32"
    for number, (v, u, _, _, _, omega) in zip(numbers, state.body_qd.numpy().tolist(), strict=True):
        answer |= {f"v{number}": v, f"u{number}": u, f"omega{number}": omega}
    return answer
