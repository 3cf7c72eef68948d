"""The contents of a result or a time history, as plain data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from .kinds import is_calibration, is_sensitivity
from .schema import count_points
from .summary import Extremes, Summary, counts_by_name, extremes_of, summarize, worst_by_model
from .xarray_backend import open_result


def info(result: xr.Dataset | str | Path) -> dict[str, Any]:
    """The contents of a result or a time history of any size, as plain data.

    Returns
    -------
    dict : points; layout and seal of the file, None in memory; dimensions; coordinates; units, dims, smallest and
        largest value and number of missing values of each variable; counts of points by status; largest errors by
        variable and model; attributes. A value is None, or missing, where a summary would evaluate too many
        points; `not_evaluated` counts the points without a status

    Raises
    ------
    ResultError : the file is not a readable result

    >>> import impact
    >>> impact.info(impact.sweep("configs/figure6.toml"))["status"]
    {'ok': 301, 'limit': 2}
    """
    if isinstance(result, str | Path):
        # not loaded, so that a summary in the file is used
        with open_result(result) as opened:
            return info(opened)
    summary = summarize(result) if "model" in result.dims else Summary()
    variables: dict[str, Any] = {}
    for name, variable in result.items():
        extremes = extremes_of(result, str(name))
        variables[str(name)] = {
            "units": variable.attrs.get("units"),
            "dims": list(variable.dims),
            **(extremes._asdict() if extremes else dict.fromkeys(Extremes._fields)),
        }
    return {
        "points": _count_points(result),
        # of a result in memory neither is known
        **{name: result.encoding.get(name) for name in ("layout", "seal")},
        "dimensions": {str(name): size for name, size in result.sizes.items()},
        "coordinates": [str(name) for name in result.coords],
        "variables": variables,
        "status": counts_by_name(summary.counts),
        "not_evaluated": summary.not_counted,
        "worst": worst_by_model(summary, result),
        "attributes": {
            str(name): value if isinstance(value, str) else np.asarray(value).tolist()
            for name, value in result.attrs.items()
        },
    }


def _count_points(dataset: xr.Dataset) -> int:
    """Count the points of a sweep, the measured values of a calibration, or the studies of a sensitivity study."""
    if is_calibration(dataset):
        return dataset.sizes["point"]
    return int(dataset["mean"].size) if is_sensitivity(dataset) else count_points(dataset)
