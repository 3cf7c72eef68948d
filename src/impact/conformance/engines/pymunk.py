"""pymunk: circles, and a segment as the wall; the elasticity and the friction of a pair are products."""

from __future__ import annotations

from typing import Any

# of the radius, so that the first step finds the contact whatever the rounding is
OVERLAP = 1e-9
STEPS = 3


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run a collision whose balls touch, side by side, after the first step."""
    import pymunk

    space = pymunk.Space()
    space.collision_slop = 0.0
    balls = []
    for number, side in (("1", -1.0), ("2", 1.0)):
        mass, R, inertia, v, u, omega = (c[f"{name}{number}"] for name in ("m", "R", "inertia", "v", "u", "omega"))
        if mass is None:
            shape: Any = pymunk.Segment(space.static_body, (0.0, -100.0 * c["R1"]), (0.0, 100.0 * c["R1"]), 0.0)
        else:
            body = pymunk.Body(mass, inertia)
            # positions are those before the step
            body.position = side * R * (1.0 - OVERLAP) - v * c["dt"], -u * c["dt"]
            body.velocity, body.angular_velocity = (v, u), omega
            shape = pymunk.Circle(body, R)
            space.add(body)
            balls.append(body)
        shape.elasticity, shape.friction = (c["e"], c["mu"]) if number == "1" else (1.0, 1.0)
        space.add(shape)
    for _ in range(STEPS):
        space.step(c["dt"])
    answer = {"id": c["id"], "version": pymunk.version, "kind": "impulse"}
    for number, body in zip("12", balls, strict=False):
        answer |= {f"v{number}": body.velocity.x, f"u{number}": body.velocity.y}
        answer[f"omega{number}"] = body.angular_velocity
    return answer
