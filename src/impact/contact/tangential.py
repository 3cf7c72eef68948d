"""The tangential motion of a contact: the slip under friction, integrated together with the normal motion.

In the contact's own units, with G = (m_t/m) g/(mu v0) and phi = f/mu, the slip obeys G' = -phi, whatever mu, angle
and inertia are: they enter by the slip at first contact, G0, alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array
from .formula_calls import Formula
from .records import Record

FrictionKind = Literal["coulomb", "spring", "dashpot", "regularized"]

# names of the values of a tangential problem, which no value of a law has: the size of the slip at first contact,
# stiffness and damping of the tangential spring per power of x, 1 where only a pressing force limits friction, and
# the factor from G to the slip y of a coefficient of friction that depends on it
PREFIX = "friction."
SLIP, TANGENTIAL_STIFFNESS, TANGENTIAL_DAMPING, LIMIT_POSITIVE, SLIP_SCALE = (
    f"{PREFIX}{name}" for name in ("G0", "k", "c", "positive", "slip_scale")
)


@dataclass(frozen=True)
class TangentialForm:
    """What all tangential trajectories of a pair at one exponent n have in common.

    Parameters
    ----------
    kind : see `impact.contact.friction.FrictionLaw`
    stiffness_power, damping_power : powers of x in the tangential stiffness k x^kp and damping c x^q
    memory : r on loading and on unloading; while the contact grows or shrinks, 0 keeps the force, 1 the
        displacement
    cap : what mu N limits, the "total" force, or that of the "spring" alone
    coefficient : of kind "regularized": the coefficient of friction over mu as a formula of y, which is
        `SLIP_SCALE` abs(G), and of other values of the problem, by their names without `PREFIX`
    """

    kind: FrictionKind
    stiffness_power: float = 0.0
    damping_power: float = 0.0
    memory: tuple[float, float] = (0.0, 0.0)
    cap: Literal["total", "spring"] = "total"
    coefficient: Formula | None = None


@dataclass(frozen=True)
class TangentialResult(Record):
    """Tangential trajectories, in the contact's own units; arrays of shape (n,).

    `slip` is G at the end for a positive G0; works are in units of mu^2 (m v0)^2/m_t; `sliding_impulse` is the
    integral of the limiting normal force, Lambda; `exact` is `slip` in closed form, NaN without one. For the kind
    "coulomb" there is only `sliding_impulse`, and the slip follows from it.
    """

    slip: Array
    sliding_impulse: Array
    slip_work: Array
    damping_work: Array
    memory_work: Array
    elastic_left: Array
    regime: NDArray[np.int8]
    slip_changes: NDArray[np.int32]
    exact: Array
    steps: NDArray[np.int32]
    status: NDArray[np.int8]
