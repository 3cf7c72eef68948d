"""The checks of an answer: each gives what is asked for and what was delivered, both dimensionless.

Impulses are those on ball 1: P_n = m1 (v1 - v1') along the normal and P = m1 (u1 - u1') along the tangent, where a
prime marks the answer. docs/conform.md states the formula of each check.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from ..results.board import CHECKS
from .suite import ANSWER_KEYS, RELATIONS, Question, Trial, transform

Answer = Mapping[str, float]
# reads a velocity or spin, before or after the impact
Read = Callable[[str], float]
Kind = Literal["impulse", "compliant"]
# what is asked for, and what was delivered
Delivered = tuple[float, float]


@dataclass(frozen=True)
class Rebound:
    """A collision and its answer; a wall has no mass, spin or velocity of its own.

    Parameters
    ----------
    trial : the collision
    answer : the velocities and spins after the impact, those of ball 2 only if it is no wall
    """

    trial: Trial
    answer: Answer

    def before(self, name: str) -> float:
        """Return a number of the question; that of a wall is 0."""
        value = self.trial.question[name]
        return 0.0 if value is None else float(value)

    def after(self, name: str) -> float:
        """Return a velocity or spin after the impact; that of a wall is 0."""
        return self.answer.get(name, 0.0)

    @property
    def balls(self) -> str:
        return balls_of(self.trial.question)

    @cached_property
    def m(self) -> float:
        """Effective mass [kg]."""
        return 1.0 / sum(1.0 / self.before(f"m{ball}") for ball in self.balls)

    @cached_property
    def m_t(self) -> float:
        """Effective tangential mass [kg]."""
        turning = sum(self.before(f"R{ball}") ** 2 / self.before(f"inertia{ball}") for ball in self.balls)
        return 1.0 / (1.0 / self.m + turning)

    @property
    def v0(self) -> float:
        """Closing speed [m/s]."""
        return self.before("v1") - self.before("v2")

    @property
    def separation(self) -> float:
        """Speed of separation [m/s]."""
        return self.after("v2") - self.after("v1")

    def slip(self, read: Read) -> float:
        """Compute the slip of the contact points [m/s], before or after the impact."""
        rims = sum(self.before(f"R{ball}") * read(f"omega{ball}") for ball in self.balls)
        return read("u1") - read("u2") + rims

    @property
    def g0(self) -> float:
        return self.slip(self.before)

    @property
    def normal_impulse(self) -> float:
        return self.before("m1") * (self.before("v1") - self.after("v1"))

    def tangential_impulse(self, ball: str = "1") -> float:
        """Return the impulse of friction [N s] against g > 0, from the motion of a ball."""
        change = self.before(f"m{ball}") * (self.before(f"u{ball}") - self.after(f"u{ball}"))
        return change if ball == "1" else -change

    @cached_property
    def speed(self) -> float:
        """The speed to which differences are relative [m/s]: v0 + |g0|, else the largest before.

        Where nothing moves it is a thousandth of R1 per contact time.
        """
        largest = max(abs(self.before(name)) for name in ("v1", "v2", "u1", "u2"))
        return self.v0 + abs(self.g0) or largest or 1e-3 * self.before("R1") / self.before("contact_time")

    def total(self, read: Read, part: Callable[[Read, str], float]) -> float:
        """Sum a part of the balls, before or after the impact."""
        return sum(part(read, ball) for ball in self.balls)

    def change(self, part: Callable[[Read, str], float]) -> float:
        """Sum a part of the balls after the impact less that before."""
        return self.total(self.after, part) - self.total(self.before, part)


def balls_of(question: Question) -> str:
    """Return "12", or "1" where ball 2 is a wall."""
    return "1" if question["m2"] is None else "12"


def finite(rebound: Rebound) -> Delivered:
    """Count the numbers of the answer that are finite."""
    values = [rebound.after(f"{name}{ball}") for name in ("v", "u", "omega") for ball in rebound.balls]
    return float(len(values)), float(sum(map(math.isfinite, values)))


def momentum(rebound: Rebound) -> Delivered:
    """Give the larger change of the momenta along n and t, relative to the sum of m (|v| + |u|) before."""

    def size(read: Read, ball: str) -> float:
        return rebound.before(f"m{ball}") * (abs(read(f"v{ball}")) + abs(read(f"u{ball}")))

    def change(name: str) -> float:
        return abs(rebound.change(lambda read, ball: rebound.before(f"m{ball}") * read(f"{name}{ball}")))

    scale = rebound.total(rebound.before, size) or rebound.m * rebound.speed
    return 0.0, float(np.max([change("v"), change("u")])) / scale


def angular_momentum(rebound: Rebound) -> Delivered:
    """Give the change of the angular momentum about the contact, relative to that of the parts before.

    L = I1 omega1 - m1 R1 u1 + I2 omega2 + m2 R2 u2; the scale is the sum of I |omega| + m R (|v| + |u|).
    """

    def part(read: Read, ball: str) -> float:
        lever = rebound.before(f"R{ball}") * (-1.0 if ball == "1" else 1.0)
        spinning = rebound.before(f"inertia{ball}") * read(f"omega{ball}")
        return spinning + rebound.before(f"m{ball}") * lever * read(f"u{ball}")

    def size(read: Read, ball: str) -> float:
        moving = rebound.before(f"m{ball}") * (abs(read(f"v{ball}")) + abs(read(f"u{ball}")))
        spinning = rebound.before(f"inertia{ball}") * abs(read(f"omega{ball}"))
        return spinning + rebound.before(f"R{ball}") * moving

    scale = rebound.total(rebound.before, size) or rebound.before("R1") * rebound.m * rebound.speed
    return 0.0, abs(rebound.change(part)) / scale


def energy(rebound: Rebound) -> Delivered:
    """Give the kinetic energy after the impact over that before."""

    def part(read: Read, ball: str) -> float:
        # a power of a large number would raise
        v, u, omega = (read(f"{name}{ball}") for name in ("v", "u", "omega"))
        return rebound.before(f"m{ball}") * (v * v + u * u) + rebound.before(f"inertia{ball}") * (omega * omega)

    scale = rebound.total(rebound.before, part) or rebound.m * rebound.speed * rebound.speed
    return 1.0, 1.0 + rebound.change(part) / scale


def separates(rebound: Rebound) -> Delivered:
    """Give the speed of separation; a negative one is that of balls that go through each other."""
    return 0.0, rebound.separation / rebound.speed


def restitution(rebound: Rebound) -> Delivered:
    """Give e and the speed of separation over the closing speed; balls at rest relative to each other stay so."""
    if rebound.v0 == 0.0:
        return 0.0, rebound.separation / rebound.speed
    return rebound.before("e"), rebound.separation / rebound.v0


def friction(rebound: Rebound, beta: float | None = None) -> Delivered:
    """Give beta = -g1/g0; asked for is `beta`, or that of rigid balls with the delivered normal impulse."""
    g0 = rebound.g0
    if beta is None:
        bound = rebound.before("mu") * max(rebound.normal_impulse, 0.0)
        beta = min(bound / (rebound.m_t * abs(g0)), 1.0) - 1.0
    return beta, -rebound.slip(rebound.after) / g0


def friction_bound(rebound: Rebound) -> Delivered:
    """Give |P|/(mu P_n), which is at most 1; |P| over m (v0 + |g0|) where the bound is 0."""
    impulse, bound = abs(rebound.tangential_impulse()), rebound.before("mu") * rebound.normal_impulse
    if bound <= 0.0:
        return 0.0, impulse / (rebound.m * rebound.speed)
    return 1.0, impulse / bound


def spin(rebound: Rebound) -> Delivered:
    """Give how far the spins are from those that follow from P: I (omega' - omega)/R + P, over m (v0 + |g0|).

    P is that of the same ball; the ball with the larger difference counts.
    """

    def difference(ball: str) -> float:
        change = rebound.after(f"omega{ball}") - rebound.before(f"omega{ball}")
        impulse = rebound.before(f"inertia{ball}") * change / rebound.before(f"R{ball}")
        return abs(impulse + rebound.tangential_impulse(ball))

    return 0.0, float(np.max([*map(difference, rebound.balls)])) / (rebound.m * rebound.speed)


def related(rebound: Rebound, base: Rebound) -> Delivered:
    """Give how far the answer is from that which follows from the answer to another collision.

    It is the largest difference of velocities and R omega, over v0 + |g0|.
    """
    expected: dict[str, float] = transform(rebound.trial.relation, rebound.trial.change, base.answer)

    def difference(name: str) -> float:
        length = rebound.before(f"R{name[-1]}") if name.startswith("omega") else 1.0
        return length * abs(rebound.answer[name] - expected[name])

    return 0.0, float(np.max([*map(difference, rebound.answer)])) / rebound.speed


def repeat(rebound: Rebound, again: Answer) -> Delivered:
    """Count the numbers that differ in any bit, or are missing, if the same question is asked again."""
    # the text of a NaN is always the same
    differ = (repr(value) != repr(again.get(name)) for name, value in rebound.answer.items())
    return 0.0, float(sum(differ))


def step(fine: Rebound, middle: Rebound, coarse: Rebound) -> Delivered:
    """Give how much the answer changes from h to h/2, and from h/2 to h/4, which is asked to be less."""
    return related(middle, coarse)[1], related(fine, middle)[1]


# of checks that compare answers: how many of the chain, the first of which `repeat` compares when asked again
CHAIN_LENGTHS: Mapping[str, int] = {**dict.fromkeys(RELATIONS, 2), "step": 3, "repeat": 1}
FUNCTIONS: tuple[Callable[..., Delivered], ...] = (
    *(finite, momentum, angular_momentum, energy, separates, restitution, friction, friction_bound, spin),
    *(step, repeat),
)
CHECK_OF: Mapping[str, Callable[..., Delivered]] = {
    **dict.fromkeys(RELATIONS, related),
    **{function.__name__: function for function in FUNCTIONS},
}
# judged exactly, and to rounding whatever the engine is
EXACT, CONSERVED = ("finite", "repeat"), ("momentum", "energy", "separates")
CONSERVED_TOLERANCE, FLOAT32_TOLERANCE = 1e-9, 1e-5
KIND_TOLERANCES: Mapping[Kind, float] = {"impulse": 1e-6, "compliant": 0.02}


def tolerances(kind: Kind, *, float32: bool, tol: Mapping[str, float]) -> dict[str, float]:
    """Choose the tolerance of each check: the one that was passed by its name or for "all", else the default.

    >>> tolerances("compliant", float32=True, tol={"spin": 0.1})["momentum"]
    1e-05
    """
    chosen = {}
    for name in CHECKS:
        default = CONSERVED_TOLERANCE if name in CONSERVED else KIND_TOLERANCES[kind]
        default = max(default, FLOAT32_TOLERANCE) if float32 else default
        chosen[name] = 0.0 if name in EXACT else tol.get(name, tol.get("all", default))
    return chosen


def checks_of(trial: Trial) -> list[str]:
    """List the checks that a collision has, in the order of a board."""
    rebound = Rebound(trial, dict.fromkeys(ANSWER_KEYS, 0.0))
    without = {str(name) for name in RELATIONS if name != trial.relation}
    if rebound.balls == "1":
        without.add("momentum")
    if rebound.g0 == 0.0 or rebound.v0 == 0.0:
        # beta is not defined
        without.add("friction")
    if len(trial.chain) == 2:
        # a half of a step has nothing that could fall
        without.add("step")
    return [name for name in CHECKS if name not in without]
