"""What a dataset is: the result of a sweep, a calibration, a sensitivity study, a board, or a time history."""

from __future__ import annotations

from typing import Literal

import xarray as xr

from ..errors import UsageError

Kind = Literal["sweep", "history", "calibration", "sensitivity study", "board"]

# kinds of results that are neither a sweep nor a single impact
STUDIES: tuple[Kind, ...] = ("calibration", "sensitivity study", "board")


def kind_of(dataset: xr.Dataset) -> Kind:
    """Find the kind of a dataset by its dimensions."""
    if "t" in dataset.dims:
        return "history"
    if "parameter" in dataset.dims:
        return "calibration"
    if "check" in dataset.dims:
        return "board"
    return "sensitivity study" if "input" in dataset.dims else "sweep"


def require_result(dataset: xr.Dataset) -> None:
    """Raise a UsageError for a dataset of another program, which has no laws."""
    if kind_of(dataset) == "sweep" and "model" not in dataset.coords:
        raise UsageError("this dataset is not a result of impact: it has no coordinate model")


def require_sweep(dataset: xr.Dataset, command: str) -> None:
    """Raise a UsageError where a command takes the result of a sweep, and got that of another command."""
    kind = kind_of(dataset)
    if kind in STUDIES:
        raise UsageError(f"{command}: this is a {kind}, expected the result of a sweep")
