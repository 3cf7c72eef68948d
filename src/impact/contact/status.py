"""The status of a point: below 10 it has a result, from 10 on its result is NaN."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """The status of a point; `meaning` describes it."""

    OK = 1
    NO_IMPACT = 2
    LIMIT = 3
    NOT_SEPARATED = 10
    MAX_STEPS = 11
    STEP_UNDERFLOW = 12
    NOT_FINITE = 13
    INVALID_PARAMETER = 14
    OUT_OF_RANGE = 15
    MODEL_ERROR = 16
    UNSTABLE = 17

    @property
    def meaning(self) -> str:
        return MEANINGS[self]


class FrictionStatus(IntEnum):
    """The status of the tangential motion of a point; `meaning` describes it. Numbers are shared with `Status`."""

    OK = 1
    NO_IMPACT = 2
    LIMIT = 3
    SLOW_LIMIT = 4
    NOT_SEPARATED = 10
    MAX_STEPS = 11
    STEP_UNDERFLOW = 12
    NOT_FINITE = 13
    INVALID_PARAMETER = 14
    OUT_OF_RANGE = 15
    MODEL_ERROR = 16
    UNSTABLE = 17
    NOT_COMBINABLE = 18

    @property
    def meaning(self) -> str:
        return FRICTION_MEANINGS[self]


MEANINGS = {
    Status.OK: "integrated to the end of the contact",
    Status.NO_IMPACT: "the balls do not approach (v1 <= v2): velocities unchanged",
    Status.LIMIT: "closed-form limit, the balls stay together; what is infinite there is NaN",
    Status.NOT_SEPARATED: "the balls never part: the force holds them, or is too weak to stop them",
    Status.MAX_STEPS: "not finished within solver.max_steps",
    Status.STEP_UNDERFLOW: "the step became too small to advance",
    Status.NOT_FINITE: "the force is not finite",
    Status.INVALID_PARAMETER: "a value that arises here is out of its range, such as e = 1 - alpha v0 below 0",
    Status.OUT_OF_RANGE: "a derived quantity is not finite, such as K of two planes or m of two walls",
    Status.MODEL_ERROR: "the force raised an error or returned the wrong shape",
    Status.UNSTABLE: "the step is too long for the scheme: the balls rebound faster than twice their approach",
}
FRICTION_MEANINGS = {
    **{FrictionStatus(status): meaning for status, meaning in MEANINGS.items()},
    FrictionStatus.NO_IMPACT: "the balls do not approach (v1 <= v2): velocities and spins unchanged",
    FrictionStatus.LIMIT: "the normal motion is at a limit, where only Coulomb's friction has an answer",
    FrictionStatus.INVALID_PARAMETER: "a value that arises here is out of its range, such as mu_d above mu",
    FrictionStatus.SLOW_LIMIT: "the limit of small steps, which a code with fixed steps reaches slowly",
    FrictionStatus.NOT_COMBINABLE: "the contact force lacks what the friction law needs",
}
STATUSES, FRICTION_STATUSES = tuple(map(int, Status)), tuple(map(int, FrictionStatus))
# an array is compared with a plain number eight times as fast as with a member of an enum
STATUS_OK, NO_IMPACT, LIMIT, FIRST_FAILURE = map(
    int, (Status.OK, Status.NO_IMPACT, Status.LIMIT, Status.NOT_SEPARATED)
)
