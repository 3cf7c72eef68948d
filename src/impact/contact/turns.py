"""Turns: threads that do short things one after another, where they would wait for each other at every one.

Around a compiled kernel there are hundreds of NumPy's calls of some microseconds, each of which lets go of the
interpreter and then asks for it again. Threads that make them at the same time lose more by that than they gain.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

_here = threading.local()


@contextmanager
def taken(turns: threading.Semaphore) -> Iterator[None]:
    """Wait for one of some turns, and have it here, but for what is done aside."""
    with turns:
        _here.turns = turns
        try:
            yield
        finally:
            _here.turns = None


@contextmanager
def aside() -> Iterator[None]:
    """Leave the turn that is had here, if any, to others for something long that needs no interpreter."""
    turns = getattr(_here, "turns", None)
    if turns is None:
        yield
        return
    turns.release()
    try:
        yield
    finally:
        turns.acquire()
