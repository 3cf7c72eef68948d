"""A time history as a labelled dataset, stored as a result is."""

from __future__ import annotations

import json
from collections.abc import Mapping

import xarray as xr

from .._version import __version__
from ..contact.history import History
from .schema import SCHEMA_VERSION

# name, unit, meaning
HISTORY = (
    ("delta", "m", "indentation"),
    ("v", "m s-1", "rate of the indentation"),
    ("F", "N", "contact force"),
    ("x1", "m", "displacement of ball 1 since first contact"),
    ("x2", "m", "displacement of ball 2 since first contact"),
    ("v1", "m s-1", "velocity of ball 1"),
    ("v2", "m s-1", "velocity of ball 2"),
)


def history_dataset(history: History, model: str, point: Mapping[str, float | str]) -> xr.Dataset:
    """The time history of one impact, over the time t since first contact.

    Parameters
    ----------
    history : the history
    model : key of the model
    point : the inputs of the impact by their config names, kept in the attribute `inputs`
    """
    dataset = xr.Dataset(
        {
            name: ("t", getattr(history, name), {"units": unit, "long_name": meaning})
            for name, unit, meaning in HISTORY
        },
        coords={"t": ("t", history.t, {"units": "s", "long_name": "time since first contact"}), "model": model},
    )
    dataset.attrs = {
        "title": f"Time history of one impact, {model}",
        "schema_version": SCHEMA_VERSION,
        "impact_version": __version__,
        "inputs": json.dumps(dict(point)),
        "e_kinetic": history.e_kinetic,
        "e_energetic": history.e_energetic,
    }
    return dataset
