"""Blocks: what is integrated at a time, here or in a process of its own, which loads no more than it needs."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..contact.power import Array
from ..contact.strike import Rebound
from ..contact.trajectories import integrate_all
from ..errors import ImpactError, UsageError
from ..text import safe_text
from .settings import Solver

# the models of a worker process, by key; they are made there, since functions cannot be sent
_models: dict[str, ForceModel] = {}
# why it cannot have them: an error while it begins would only end it
_troubles: list[str] = []


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


def integrated(model: ForceModel, block: Block, solver: Solver) -> Rebound:
    """What becomes of a block by the law of its model."""
    return integrate_all(
        model, block.n, block.given, block.status,
        rtol=solver.rtol, max_steps=solver.max_steps, collapse=solver.collapse, core=solver.core,
    )  # fmt: skip


def begin(files: Sequence[Path], hashes: dict[str, str]) -> None:
    """What a worker does first: learn the models, leave signals to the driver, and end when that does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    driver = multiprocessing.parent_process()
    if driver is not None:

        def follow() -> None:
            multiprocessing.connection.wait([driver.sentinel])
            os._exit(1)

        threading.Thread(target=follow, daemon=True).start()
    _models.update(catalogue())
    if hashes:
        from .plugins import read_plugins

        try:
            plugins = read_plugins(files)
        except ImpactError as error:
            _troubles.append(str(error))
            return
        changed = [key for key, sha256 in hashes.items() if plugins.hashes.get(key) != sha256]
        if changed:
            _troubles.append(
                f"{safe_text(', '.join(map(str, files or changed)))}: was changed while the sweep ran"
            )
            return
        _models.update(catalogue(plugins.models))


def work(block: Block, solver: Solver) -> Rebound:
    """What becomes of a block; a pure function of it.

    Raises
    ------
    UsageError : a plug-in is not what it was
    """
    if _troubles:
        raise UsageError(_troubles[0])
    return integrated(_models[block.key], block, solver)
