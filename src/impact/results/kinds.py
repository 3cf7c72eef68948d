"""What a dataset is: the result of a sweep, a calibration or a sensitivity study."""

from __future__ import annotations

import xarray as xr

from ..errors import UsageError


def is_calibration(dataset: xr.Dataset) -> bool:
    """Whether a dataset is the result of a calibration."""
    return "parameter" in dataset.dims


def is_sensitivity(dataset: xr.Dataset) -> bool:
    """Whether a dataset is the result of a sensitivity study."""
    return "input" in dataset.dims


def require_sweep(dataset: xr.Dataset, command: str) -> None:
    """Raise a UsageError where a command takes the result of a sweep, and got that of another command."""
    for kind, is_kind in (("calibration", is_calibration), ("sensitivity study", is_sensitivity)):
        if is_kind(dataset):
            raise UsageError(f"{command}: this is a {kind}, expected the result of a sweep")
