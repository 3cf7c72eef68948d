"""The command `doctor`: versions of what is installed."""

from __future__ import annotations

import impact

from ..display import show
from .options import JsonOption


def doctor(as_json: JsonOption = False) -> None:
    """Show the versions of impact, its packages, the compiled core and the simulation codes."""
    show(impact.doctor(), as_json=as_json)
