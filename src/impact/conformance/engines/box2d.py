"""Box2D: circles, and an edge as the wall, in units in which the radius of ball 1 is 1, in single precision."""

from __future__ import annotations

from typing import Any

# of the radius, so that the first step finds the contact in single precision
OVERLAP = 1e-6
ITERATIONS = 50


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run the step of a collision of balls that touch."""
    from importlib.metadata import version

    import Box2D

    length = c["R1"]
    # an edge has a skin, which the ball touches
    skin = 2.0 * Box2D.b2_linearSlop if c["m2"] is None else 0.0
    world = Box2D.b2World(gravity=(0, 0), doSleep=False)
    world.continuousPhysics = False
    balls = []
    for number, side in (("1", -1.0), ("2", 1.0)):
        mass, R, inertia, v, u, omega = (c[f"{name}{number}"] for name in ("m", "R", "inertia", "v", "u", "omega"))
        if mass is None:
            shape = Box2D.b2EdgeShape(vertices=[(0, -100), (0, 100)])
            body = world.CreateStaticBody()
        else:
            shape = Box2D.b2CircleShape(radius=R / length)
            body = world.CreateDynamicBody(
                position=(side * R / length * (1.0 - OVERLAP) - skin, 0),
                linearVelocity=(v / length, u / length),
                angularVelocity=omega,
                linearDamping=0,
                angularDamping=0,
            )
            balls.append(body)
        # the restitution of a pair is the larger one, its friction the root of the product
        body.CreateFixture(shape=shape, density=1, restitution=c["e"], friction=c["mu"])
        if mass is not None:
            body.massData = Box2D.b2MassData(mass=mass, center=(0, 0), I=inertia / length**2)
    world.Step(c["dt"], ITERATIONS, 1)
    answer = {"id": c["id"], "version": version("Box2D"), "kind": "impulse", "precision": "float32"}
    for number, body in zip("12", balls, strict=False):
        answer |= {f"v{number}": length * body.linearVelocity.x, f"u{number}": length * body.linearVelocity.y}
        answer[f"omega{number}"] = body.angularVelocity
    return answer
