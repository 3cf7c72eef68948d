"""Blocks: what is integrated at a time, here or anywhere else, where no more is loaded than it needs."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..contact.compiled import is_installed
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..contact.power import Array
from ..contact.strike import Rebound
from ..contact.trajectories import integrate_all
from ..errors import UsageError
from ..sweeps.settings import Solver
from ..text import safe_text


@dataclass(frozen=True)
class Block:
    """What is integrated, in the contact's own units: numbers and names only, so that it can be sent anywhere.

    Parameters
    ----------
    number : of its stretch
    key : of the model
    n : compliance exponents, shape (k,)
    given : what the law asks for by name, each of shape (k,)
    status : what is known beforehand, shape (k,)
    """

    number: int
    key: str
    n: Array
    given: dict[str, Array]
    status: NDArray[np.int8]


@dataclass(frozen=True)
class Kit:
    """What a block is integrated with where nothing of its sweep is known: numbers, names and source.

    Parameters
    ----------
    version : of this package
    solver : how
    sources : name and content of the Python files that models of one's own are in
    hashes : key and SHA-256 of the models that are not built in
    """

    version: str
    solver: Solver
    sources: tuple[tuple[str, bytes], ...] = ()
    hashes: tuple[tuple[str, str], ...] = ()


def integrated(model: ForceModel, block: Block, solver: Solver) -> tuple[Rebound, dict[str, str]]:
    """What becomes of a block by the law of its model, and a line for each distinct error that the law raised."""
    errors: dict[str, str] = {}
    rebound = integrate_all(
        model, block.n, block.given, block.status,
        rtol=solver.rtol, max_steps=solver.max_steps, collapse=solver.collapse, core=solver.core, errors=errors,
    )  # fmt: skip
    return rebound, errors


def work(block: Block, kit: Kit) -> tuple[Rebound, dict[str, str]]:
    """What becomes of a block, see `integrated`; a pure function of both, which may be done anywhere, and twice.

    Raises
    ------
    UsageError : this place has another version, no numba where that is wanted, or not the same models
    """
    return integrated(_models(kit)[block.key], block, kit.solver)


# the models of the sweeps of which this place was sent something last
@lru_cache(maxsize=4)
def _models(kit: Kit) -> Mapping[str, ForceModel]:
    from .. import __version__

    here = socket.gethostname()
    if kit.version != __version__:
        raise UsageError(other_version(here, __version__, kit.version))
    if kit.solver.core == "numba" and not is_installed():
        raise UsageError(
            f'{here}: has no numba, which the sweep is integrated by; wants it there, or solver.core = "numpy"'
        )
    if not kit.hashes:
        return catalogue()
    from .plugins import Source, read_plugins

    plugins = read_plugins([Source(*one) for one in kit.sources])
    lacking = [key for key, sha256 in kit.hashes if plugins.hashes.get(key) != sha256]
    if lacking:
        raise UsageError(
            f"{here}: {safe_text(', '.join(lacking))}: wants the package that has it, in the version that is here"
        )
    return catalogue(plugins.models)


def other_version(place: str, there: str, here: str) -> str:
    """What is said of a place that has another version."""
    return f"{place}: has impact {safe_text(there)}, this is {here}; wants the same"
