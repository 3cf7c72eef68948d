"""A finished block as a file of its own, which carries a checksum and says what it is of."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ..contact.strike import Rebound

FIELDS = tuple(one.name for one in fields(Rebound))


def pack(file: Any, of: str, rebound: Rebound) -> None:
    """Write a block.

    Parameters
    ----------
    file : a binary one, to be written to
    of : what it says of itself
    rebound : what is in it
    """
    np.savez(file, of=of, **{name: getattr(rebound, name) for name in FIELDS})


def unpack(path: Path, of: str, size: int) -> Rebound | None:
    """A block of so many trajectories; None if it is of something else, or not whole."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            if stored["of"].item() != of:
                return None
            arrays = {name: stored[name] for name in FIELDS}
    except MemoryError:
        raise
    # numpy and zipfile raise almost anything on a damaged file
    except Exception:
        return None
    blank = Rebound.blank(size)
    right = all(
        (one.shape, one.dtype) == (getattr(blank, name).shape, getattr(blank, name).dtype)
        for name, one in arrays.items()
    )
    return Rebound(**arrays) if right else None
