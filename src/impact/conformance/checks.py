"""The checks of an answer: each gives what is asked for and what was delivered, both dimensionless.

Impulses are those on ball 1: P_n = m1 (v1 - v1') along the normal and P = m1 (u1 - u1') along the tangent, where a
prime marks the answer. docs/conform.md states the formula of each check.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..array_types import Array
from ..results.board import CHECKS
from .suite import ANSWER_KEYS, RELATIONS, Question, Trial, transform

Answer = Mapping[str, float]
Kind = Literal["impulse", "compliant"]
# what is asked for, and what was delivered
Delivered = tuple[float, float]
MOTION = ("v", "u", "omega")


@dataclass(frozen=True)
class Rebound:
    """A collision and its answer; arrays have a value for each ball, and none for a wall.

    Parameters
    ----------
    trial : the collision
    answer : the velocities and spins after the impact, those of ball 2 only if it is no wall
    m, R, inertia : masses [kg], radii [m] and moments of inertia [kg m^2] of the balls, shape (balls,)
    before, after : their velocities v and u [m/s] and spins omega [rad/s], shape (3, balls)
    """

    trial: Trial
    answer: Answer
    m: Array
    R: Array
    inertia: Array
    before: Array
    after: Array

    @classmethod
    def of(cls, trial: Trial, answer: Answer) -> Rebound:
        """Collect what a collision and its answer say of each ball."""
        bodies = of_balls(("m", "R", "inertia"), trial.question, trial)
        motions = (of_balls(MOTION, values, trial) for values in (trial.question, answer))
        return cls(trial, answer, *bodies, *motions)

    def number(self, name: str) -> float:
        """Return a number of the question that is not of a ball."""
        return float(self.trial.question[name] or 0.0)

    @property
    def sides(self) -> Array:
        """1 of ball 1 and -1 of ball 2."""
        return np.array([1.0, -1.0])[: self.m.size]

    @property
    def m_n(self) -> float:
        """Effective mass [kg]."""
        return 1.0 / float(sum(1.0 / self.m))

    @property
    def m_t(self) -> float:
        """Effective tangential mass [kg]."""
        return float(1.0 / (1.0 / self.m_n + sum(self.R**2 / self.inertia)))

    @property
    def v0(self) -> float:
        """Closing speed [m/s]."""
        return -separation(self.before[0])

    @property
    def separation(self) -> float:
        """Speed of separation [m/s]."""
        return separation(self.after[0])

    def slip(self, motion: Array) -> float:
        """Compute the slip of the contact points [m/s], before or after the impact."""
        return float(sum(self.R * motion[2])) - separation(motion[1])

    @property
    def g0(self) -> float:
        return self.slip(self.before)

    @property
    def impulses(self) -> Array:
        """The impulses on ball 1 along the normal and the tangent [N s], from the motion of each ball."""
        return self.sides * self.m * (self.before - self.after)[:2]

    @property
    def speed(self) -> float:
        """The speed to which differences are relative [m/s]: v0 + |g0|, else the largest before.

        Where nothing moves it is a thousandth of R1 per contact time.
        """
        largest = np.abs(self.before[:2]).max()
        return self.v0 + abs(self.g0) or largest or 1e-3 * self.R[0] / self.number("contact_time")


def balls_of(question: Question) -> str:
    """Return "12", or "1" where ball 2 is a wall."""
    return "1" if question["m2"] is None else "12"


def of_balls(names: Sequence[str], values: Mapping[str, object], trial: Trial) -> Array:
    """Collect quantities of the balls of a collision, shape (names, balls)."""
    balls = balls_of(trial.question)
    return np.array([[values[f"{name}{ball}"] for ball in balls] for name in names], float)


def separation(velocities: Array) -> float:
    """Subtract the velocity of ball 1 from that of ball 2; that of a wall is 0."""
    first, second = np.append(velocities, 0.0)[:2]
    return float(second - first)


def finite(rebound: Rebound) -> Delivered:
    """Count the numbers of the answer that are finite."""
    return float(rebound.after.size), float(np.isfinite(rebound.after).sum())


def momentum(rebound: Rebound) -> Delivered:
    """Give the larger change of the momenta along n and t, relative to the sum of m (|v| + |u|) before."""
    momenta, changed = (np.sum(rebound.m * motion[:2], axis=1) for motion in (rebound.before, rebound.after))
    scale = sum(rebound.m * np.abs(rebound.before[:2]).sum(axis=0)) or rebound.m_n * rebound.speed
    return 0.0, np.abs(changed - momenta).max() / scale


def angular_momentum(rebound: Rebound) -> Delivered:
    """Give the change of the angular momentum about the contact, relative to that of the parts before.

    L = I1 omega1 - m1 R1 u1 + I2 omega2 + m2 R2 u2; the scale is the sum of I |omega| + m R (|v| + |u|).
    """
    m, R, inertia = rebound.m, rebound.R, rebound.inertia
    before, after = (
        sum(inertia * omega - m * (rebound.sides * R) * u) for _, u, omega in (rebound.before, rebound.after)
    )
    v, u, omega = np.abs(rebound.before)
    scale = sum(inertia * omega + R * (m * (v + u))) or R[0] * rebound.m_n * rebound.speed
    return 0.0, abs(after - before) / scale


def energy(rebound: Rebound) -> Delivered:
    """Give the kinetic energy after the impact over that before."""
    before, after = (
        sum(rebound.m * (v * v + u * u) + rebound.inertia * (omega * omega))
        for v, u, omega in (rebound.before, rebound.after)
    )
    return 1.0, 1.0 + (after - before) / (before or rebound.m_n * rebound.speed * rebound.speed)


def separates(rebound: Rebound) -> Delivered:
    """Give the speed of separation; a negative one is that of balls that go through each other."""
    return 0.0, rebound.separation / rebound.speed


def restitution(rebound: Rebound) -> Delivered:
    """Give e and the speed of separation over the closing speed; balls at rest relative to each other stay so."""
    if rebound.v0 == 0.0:
        return 0.0, rebound.separation / rebound.speed
    return rebound.number("e"), rebound.separation / rebound.v0


def friction(rebound: Rebound, beta: float | None = None) -> Delivered:
    """Give beta = -g1/g0; asked for is `beta`, or that of rigid balls with the delivered normal impulse."""
    g0 = rebound.g0
    if beta is None:
        bound = rebound.number("mu") * max(rebound.impulses[0, 0], 0.0)
        beta = min(bound / (rebound.m_t * abs(g0)), 1.0) - 1.0
    return beta, -rebound.slip(rebound.after) / g0


def friction_bound(rebound: Rebound) -> Delivered:
    """Give |P|/(mu P_n), which is at most 1; |P| over m (v0 + |g0|) where the bound is 0."""
    normal, tangential = rebound.impulses[:, 0]
    impulse, bound = abs(tangential), rebound.number("mu") * normal
    if bound <= 0.0:
        return 0.0, impulse / (rebound.m_n * rebound.speed)
    return 1.0, impulse / bound


def spin(rebound: Rebound) -> Delivered:
    """Give how far the spins are from those that follow from P: I (omega' - omega)/R + P, over m (v0 + |g0|).

    P is that of the same ball; the ball with the larger difference counts.
    """
    changes = rebound.inertia * (rebound.after[2] - rebound.before[2]) / rebound.R
    return 0.0, np.abs(changes + rebound.impulses[1]).max() / (rebound.m_n * rebound.speed)


def related(rebound: Rebound, base: Rebound) -> Delivered:
    """Give how far the answer is from that which follows from the answer to another collision.

    It is the largest difference of velocities and R omega, over v0 + |g0|.
    """
    expected = transform(rebound.trial.relation, rebound.trial.change, base.answer)
    differences = np.abs(rebound.after - of_balls(MOTION, expected, rebound.trial))
    differences[2] *= rebound.R
    return 0.0, differences.max() / rebound.speed


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
    rebound = Rebound.of(trial, dict.fromkeys(ANSWER_KEYS, 0.0))
    without = {str(name) for name in RELATIONS if name != trial.relation}
    if rebound.m.size == 1:
        without.add("momentum")
    if rebound.g0 == 0.0 or rebound.v0 == 0.0:
        # beta is not defined
        without.add("friction")
    if len(trial.chain) == 2:
        # a half of a step has nothing that could fall
        without.add("step")
    return [name for name in CHECKS if name not in without]
