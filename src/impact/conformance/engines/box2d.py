"""Box2D: circles, and an edge as the wall, in units in which the radius of ball 1 is 1, in single precision."""

from __future__ import annotations

from typing import Any

SETTINGS = "lengths over the radius of ball 1, 50 iterations, no continuous collision, one step"
# of the radius, so that the first step finds the contact in single precision
OVERLAP = 1e-6
ITERATIONS = 50


def collide(c: dict[str, Any]) -> dict[str, Any]:
    """Run the step of a collision of balls that touch."""
    import Box2D
    from two_balls import answer_of, balls_of

    length = c["R1"]
    # an edge has a skin, which the ball touches
    skin = 2.0 * Box2D.b2_linearSlop if c["m2"] is None else 0.0
    world = Box2D.b2World(gravity=(0, 0), doSleep=False)
    world.continuousPhysics = False
    # the restitution of a pair is the larger one, its friction the root of the product
    surface = {"density": 1, "restitution": c["e"], "friction": c["mu"]}
    bodies = []
    for ball in balls_of(c):
        body = world.CreateDynamicBody(
            position=(ball.side * ball.R / length * (1.0 - OVERLAP) - skin, 0),
            linearVelocity=(ball.v / length, ball.u / length),
            angularVelocity=ball.omega,
            linearDamping=0,
            angularDamping=0,
        )
        body.CreateFixture(shape=Box2D.b2CircleShape(radius=ball.R / length), **surface)
        body.massData = Box2D.b2MassData(mass=ball.m, center=(0, 0), I=ball.inertia / length**2)
        bodies.append(body)
    if len(bodies) == 1:
        world.CreateStaticBody().CreateFixture(shape=Box2D.b2EdgeShape(vertices=[(0, -100), (0, 100)]), **surface)
    world.Step(c["dt"], ITERATIONS, 1)
    motions = ((*(length * v for v in body.linearVelocity), body.angularVelocity) for body in bodies)
    return answer_of(c, motions, "impulse", precision="float32")
