"""pymunk: circles, and a segment as the wall; the elasticity and the friction of a pair are products."""

from __future__ import annotations

from typing import Any

SETTINGS = "collision_slop = 0; e and mu are those of the pair"
# of the radius, so that the first step finds the contact whatever the rounding is
OVERLAP = 1e-9
STEPS = 3


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision whose balls touch, side by side, after the first step."""
    import pymunk
    from two_balls import answer_of, balls_of

    space = pymunk.Space()
    space.collision_slop = 0.0
    shapes = []
    for ball in balls_of(c):
        body = pymunk.Body(ball.m, ball.inertia)
        # positions are those before the step
        body.position = ball.side * ball.R * (1.0 - OVERLAP) - ball.v * c["dt"], -ball.u * c["dt"]
        body.velocity, body.angular_velocity = (ball.v, ball.u), ball.omega
        shapes.append(pymunk.Circle(body, ball.R))
        space.add(body)
    bodies = list(space.bodies)
    if len(bodies) == 1:
        shapes.append(pymunk.Segment(space.static_body, (0.0, -100.0 * c["R1"]), (0.0, 100.0 * c["R1"]), 0.0))
    for shape, values in zip(shapes, ((c["e"], c["mu"]), (1.0, 1.0)), strict=True):
        shape.elasticity, shape.friction = values
        space.add(shape)
    for _ in range(STEPS):
        space.step(c["dt"])
    return answer_of(c, ((*body.velocity, body.angular_velocity) for body in bodies), "impulse")
