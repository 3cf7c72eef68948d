"""The names that a result, or a time history, may have; `load` passes over others, `save` refuses them."""

from __future__ import annotations

import re

from ..sweeps.rules import MATERIALS, SWEEP
from .history import HISTORY
from .schema import SCHEMA

COMPUTED = frozenset(one.name for one in SCHEMA)
FOLLOWED = frozenset(name for name, _, _ in HISTORY)  # over the time t
ABOUT_MODELS = ("title", "equation", "reference", "doi", "year")
TEXTS = frozenset({"model", *ABOUT_MODELS, *MATERIALS} - {"year"})
NAMES = COMPUTED | FOLLOWED | TEXTS | {"t", "year", "exponent", *SWEEP}
# a parameter of a model's own: the key of the model, and a name of Python
OWN = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*\.[^\W\d]\w*")


def is_name(name: str) -> bool:
    """Whether a variable of a result may be called this.

    >>> is_name("e_out"), is_name("ismail-stronge-2008.gamma"), is_name("twice")
    (True, True, False)
    """
    return name in NAMES or OWN.fullmatch(name) is not None


def is_quantity(name: str, axes: tuple[str, ...]) -> bool:
    """Whether it was computed; what was given is a coordinate. A velocity of a ball is one or the other."""
    return name in COMPUTED or (name in FOLLOWED and axes == ("t",))
