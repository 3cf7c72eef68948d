"""The status of a point: below 10 it has a result, from 10 on its result is NaN."""

from __future__ import annotations

from enum import IntEnum
from typing import Self


class StatusWithMeaning(IntEnum):
    """A status whose members are declared by their number and their `meaning`."""

    meaning: str

    def __new__(cls, number: int, meaning: str = "") -> Self:
        member = int.__new__(cls, number)
        member._value_ = number
        member.meaning = meaning
        return member


class Status(StatusWithMeaning):
    """The status of a point."""

    OK = 1, "integrated to the end of the contact"
    NO_IMPACT = 2, "the balls do not approach (v1 <= v2): velocities unchanged"
    LIMIT = 3, "closed-form limit, the balls stay together; what is infinite there is NaN"
    NOT_SEPARATED = 10, "the balls never part: the force holds them, or is too weak to stop them"
    MAX_STEPS = 11, "not finished within solver.max_steps"
    STEP_UNDERFLOW = 12, "the step became too small to advance"
    NOT_FINITE = 13, "the force is not finite"
    INVALID_PARAMETER = 14, "a value that arises here is out of its range, such as e = 1 - alpha v0 below 0"
    OUT_OF_RANGE = 15, "a derived quantity is not finite, such as K of two planes or m of two walls"
    MODEL_ERROR = 16, "the force raised an error or returned the wrong shape"
    UNSTABLE = 17, "the step is too long for the scheme: the balls rebound faster than twice their approach"


class FrictionStatus(StatusWithMeaning):
    """The status of the tangential motion of a point. Numbers are shared with `Status`."""

    OK = 1, Status.OK.meaning
    NO_IMPACT = 2, "the balls do not approach (v1 <= v2): velocities and spins unchanged"
    LIMIT = 3, "the normal motion is at a limit, where only Coulomb's friction has an answer"
    SLOW_LIMIT = 4, "the limit of small steps, which a code with fixed steps reaches slowly"
    NOT_SEPARATED = 10, Status.NOT_SEPARATED.meaning
    MAX_STEPS = 11, Status.MAX_STEPS.meaning
    STEP_UNDERFLOW = 12, Status.STEP_UNDERFLOW.meaning
    NOT_FINITE = 13, Status.NOT_FINITE.meaning
    INVALID_PARAMETER = 14, "a value that arises here is out of its range, such as mu_d above mu"
    OUT_OF_RANGE = 15, Status.OUT_OF_RANGE.meaning
    MODEL_ERROR = 16, Status.MODEL_ERROR.meaning
    UNSTABLE = 17, Status.UNSTABLE.meaning
    NOT_COMBINABLE = 18, "the contact force lacks what the friction law needs"


# an array is compared with a plain number eight times as fast as with a member of an enum
STATUS_OK, NO_IMPACT, LIMIT, FIRST_FAILURE = map(
    int, (Status.OK, Status.NO_IMPACT, Status.LIMIT, Status.NOT_SEPARATED)
)
