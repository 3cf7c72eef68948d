"""Attributes of a result that hold JSON; the file may come from anywhere."""

from __future__ import annotations

import json
from typing import Any

import xarray as xr

from ..errors import ResultError


def json_object(dataset: xr.Dataset, attribute: str) -> dict[str, Any]:
    """What an attribute holds as JSON."""
    try:
        return dict(json.loads(dataset.attrs.get(attribute, "{}")))
    except (ValueError, TypeError, RecursionError):
        raise ResultError(f"the attribute {attribute} is not that of a result") from None


def json_table(dataset: xr.Dataset, attribute: str) -> dict[str, dict[str, Any]]:
    """The same, where each entry is a table again."""
    found = json_object(dataset, attribute)
    if not all(isinstance(one, dict) for one in found.values()):
        raise ResultError(f"the attribute {attribute} is not that of a result")
    return found
