"""A point of a result, followed through time again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from ..engine.plan import Plan
from ..engine.plugins import Plugins
from ..errors import UsageError, did_you_mean
from ..sweeps.point import one_point
from ..text import safe_text
from .impact import impact_of
from .provenance import stored_config

if TYPE_CHECKING:
    import xarray as xr


def histories(
    dataset: xr.Dataset,
    models: Sequence[str] | None,
    at: Mapping[str, float | str],
    plugins: Plugins,
) -> list[xr.Dataset]:
    """Time histories of one point by several models; of a time history, itself.

    Parameters
    ----------
    dataset : a result, or a time history
    models : keys; by default all
    at : values of the axes, which need not be on the grid; one that is not named takes its first value
    plugins : models that are not built in

    Raises
    ------
    UsageError : a model or an axis is not in the result, or no model has a motion to follow there
    """
    if "t" in dataset.dims:
        return [dataset]
    known = [str(key) for key in dataset["model"].values.ravel()]
    for key in models or ():
        if key not in known:
            raise UsageError(f'no model "{safe_text(key)}" in this result; {did_you_mean(key, known)}')
    single = {str(name): one.values.item() for name, one in dataset.coords.items() if one.ndim == 0}
    picked = {name: value for name, value in single.items() if name != "model"}
    found: list[xr.Dataset] = []
    ends: dict[str, str] = {}
    first: dict[str, float | str] = {}
    for key in dict.fromkeys(models or known):
        config, names = one_point(
            lambda more: stored_config(dataset.attrs, more, plugins, "the result"), key, at, picked
        )
        impact = impact_of(Plan(config, plugins.of(config.models)), names)
        first |= {name: impact.point[name] for name in names}
        if impact.history is None:
            ends[key] = impact.status.meaning
        else:
            found.append(impact.history)
    if not found:
        where = ", ".join(f"{name} = {value}" for name, value in {**first, **at}.items())
        reason = next(iter(ends.values()))
        raise UsageError(f"no motion to draw at {safe_text(where)}: {reason}; choose a point, such as --sel e=0.5")
    return found
