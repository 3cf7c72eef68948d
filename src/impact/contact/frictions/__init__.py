"""The catalogue: every `FrictionLaw` that is a variable, or in a tuple, of a module of this package."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import get_args

from ..catalogue import by_key, declared_laws, look_up, pickle_by_key
from ..friction import FrictionLaw
from ..slip_motion import FrictionKind


@cache
def frictions() -> Mapping[str, FrictionLaw]:
    """Collect the friction laws by key, in the order of their kinds.

    >>> list(frictions())[:2]
    ['coulomb-1785', 'cundall-strack-1979']
    """
    laws, kinds = declared_laws(__name__, __path__, FrictionLaw), get_args(FrictionKind)
    return by_key(sorted(laws, key=lambda law: (kinds.index(law.kind), law.year, law.key)), "friction law")


def find_friction(key: str) -> FrictionLaw:
    """Find the friction law of a key.

    Raises
    ------
    ModelError : no friction law has this key; the message names the nearest one
    """
    return look_up(frictions(), key, "friction law")


pickle_by_key(FrictionLaw, find_friction)
