"""What the runners of Newton share: collisions of the same time step are worlds of one model, on a CPU."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import newton
import warp as wp
from runner import serve_all

wp.config.quiet = True
wp.set_device("cpu")

Speed = tuple[float, ...]


def add_ball(
    builder: newton.ModelBuilder, mass: float, radius: float, x: float, y: float, **contact: float
) -> None:
    """Add a solid sphere of a mass [kg] and a radius [m], with parameters of its contact."""
    moment = 0.4 * mass * radius**2
    inertia = wp.mat33(moment, 0, 0, 0, moment, 0, 0, 0, moment)
    body = builder.add_body(xform=wp.transform((x, y, 0), wp.quat_identity()), mass=mass, inertia=inertia)
    builder.add_shape_sphere(body, radius=radius, cfg=newton.ModelBuilder.ShapeConfig(density=0, **contact))


def serve_worlds(
    add_balls: Callable[..., list[Speed]], answer: Callable[[list[Speed]], tuple[float, ...]]
) -> None:
    """Serve collisions in worlds of a model: a step takes hardly longer for all of them than for one.

    Parameters
    ----------
    add_balls
        Adds the balls of a collision to a builder, and returns their velocities and spins [m/s, rad/s] (x, y, z,
        about x, about y, about z).
    answer
        Makes the answer of those after the contact.
    """

    def collide(collisions: list[dict[str, Any]]) -> list[tuple[float, ...]]:
        builder = newton.ModelBuilder(gravity=(0, 0, 0))
        speeds = []
        for collision in collisions:
            # balls of different worlds do not touch
            builder.begin_world()
            speeds.append(add_balls(builder, **collision))
            builder.end_world()
        model = builder.finalize()
        solver = newton.solvers.SolverSemiImplicit(model)
        state, following, control = model.state(), model.state(), model.control()
        state.body_qd.assign([speed for balls in speeds for speed in balls])
        pipeline = newton.CollisionPipeline(model)
        contacts = pipeline.contacts()
        # a recorded step takes a twentieth of the time
        with wp.ScopedCapture() as capture:
            state.clear_forces()
            pipeline.collide(state, contacts)
            solver.step(state, following, control, contacts, collisions[0]["step"])
            state.assign(following)
        for _ in range(collisions[0]["count"]):
            wp.capture_launch(capture.graph)
        after = iter(state.body_qd.numpy().tolist())
        return [answer([next(after) for _ in balls]) for balls in speeds]

    def collide_all(collisions: list[dict[str, Any]]) -> list[tuple[float, ...]]:
        groups: dict[tuple[float, int], list[int]] = {}
        for i, collision in enumerate(collisions):
            groups.setdefault((collision["step"], collision["count"]), []).append(i)
        answers = {}
        for members in groups.values():
            answers |= dict(zip(members, collide([collisions[i] for i in members]), strict=True))
        return [answers[i] for i in range(len(collisions))]

    serve_all(version("newton"), collide_all)
