"""Where a result comes from: the config of its sweep, and the models that computed it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import xarray as xr

from ..config.draft import Draft, Overrides, open_text, settings_of
from ..config.grid import MAX_POINTS
from ..config.load import Config, Purpose, build
from ..engine.plugins import Plugins
from ..errors import ResultError, UsageError
from ..formatting import argument, safe_text
from .attributes import PluginRecord, read_attribute
from .selection import match_labels


def stored_config(
    attributes: Mapping[str, object],
    overrides: Overrides,
    plugins: Plugins,
    name: str,
    max_points: int = MAX_POINTS,
    *,
    allow_changed_plugins: bool = False,
    purpose: Purpose = "sweep",
) -> Config:
    """Read the config of the sweep or the calibration that a result with these attributes came from."""
    draft = stored_draft(attributes, plugins, name)
    if not allow_changed_plugins:
        for reason in (*changed_plugins(attributes, plugins, name), *unknown_plugins(attributes, plugins, name)):
            raise UsageError(reason)
    return build(draft.with_settings(settings_of(overrides)), max_points, purpose)


def stored_draft(attributes: Mapping[str, object], plugins: Plugins, name: str) -> Draft:
    """Open the config that a result came from."""
    text = attributes.get("config")
    if text is None:
        raise UsageError(f"{name}: contains no config, it is a time history")
    if not isinstance(text, str):
        raise ResultError(f"{name}: its attribute config is not text")
    check_plugins(attributes, plugins, name)
    stored = read_attribute(attributes, "config_set", name, required=True)
    return open_text(text, name, plugins.models).with_settings(settings_of(stored))


def config_of_part(config: Config, dataset: xr.Dataset) -> Config:
    """Reduce the axes of a config to the values that are labels of a result.

    An axis without a common value keeps its first value, so that a comparison shows the difference.
    """
    axes = []
    for axis in config.axes:
        labels_of = {axis.name: axis.labels} if axis.numbered else axis.columns
        stored = {name: dataset.coords[name] for name in labels_of if name in dataset.coords}
        first = next(iter(stored.values()), None)
        names = [name for name, labels in stored.items() if first is not None and labels.dims == first.dims]
        values = [np.asarray(labels_of[name]) for name in names]
        labels = [np.ravel(stored[name].values) for name in names]
        positions = sorted(match_labels(values, labels)[0].tolist()) if names else []
        chosen = np.array(positions or [0])
        columns = {name: tuple(np.asarray(v)[chosen].tolist()) for name, v in axis.columns.items()}
        numbers = tuple(axis.labels[position] for position in chosen) if axis.numbered else ()
        axes.append(replace(axis, columns=columns, numbers=numbers))
    return replace(config, axes=tuple(axes))


def check_plugins(attributes: Mapping[str, object], plugins: Plugins, name: str) -> None:
    """Raise an error if a plug-in that a result was made with is missing.

    Nothing is imported because a result names it: the names are only compared and reported.

    >>> check_plugins({"plugins": '{"mine": {"file": "my.py", "sha256": "12ab"}}'}, Plugins(), "results.h5")
    Traceback (most recent call last):
    impact.errors.UsageError: results.h5: made with mine of my.py; give it again with plugins=["FILE"]
    """
    # hashes of files and of Python values differ: a model supplied in another way cannot be compared
    missing = {
        key: record
        for key, record, current in _stored_and_current(attributes, plugins, name)
        if current is None or _how_to_supply(current) != _how_to_supply(record)
    }
    if missing:
        origins = {key: record.package or record.file or "a Python value" for key, record in missing.items()}
        named = ", ".join(f"{key} of {origin}" for key, origin in origins.items())
        ways = " and ".join(sorted({_how_to_supply(record) for record in missing.values()}))
        again = "it" if len(missing) == 1 else "them"
        raise UsageError(f"{name}: made with {safe_text(named)}; give {again} again with {ways}")


def changed_plugins(attributes: Mapping[str, object], plugins: Plugins, name: str) -> tuple[str, ...]:
    """List, in a sentence each, the plug-ins whose current version differs from that of a result."""
    return tuple(
        f"{safe_text(name)}: was made with another version of "
        f"{safe_text(record.package or record.file or f'the model {key}')}: "
        f"its SHA-256 is {safe_text(record.sha256, 64)}, this one's is {current.sha256}"
        for key, record, current in _stored_and_current(attributes, plugins, name)
        if current and current.sha256 and record.sha256 and record.sha256 != current.sha256
    )


def unknown_plugins(attributes: Mapping[str, object], plugins: Plugins, name: str) -> tuple[str, ...]:
    """List, in a sentence each, the plug-ins without a hash, which cannot be compared with that of a result."""
    return tuple(
        f"{safe_text(name)}: the model {safe_text(key)} is a Python value that no file defines, so that it cannot "
        "be known to be the one that the result was made with; expected a model in a Python file"
        for key, record, current in _stored_and_current(attributes, plugins, name)
        if not (current and current.sha256 and record.sha256)
    )


def _stored_and_current(
    attributes: Mapping[str, object], plugins: Plugins, name: str
) -> Iterator[tuple[str, PluginRecord, PluginRecord | None]]:
    """Yield the key of each plug-in of a result, its record there, and that of the one given now."""
    current = {key: PluginRecord(**record) for key, record in plugins.record.items()}
    for key, record in read_attribute(attributes, "plugins", name, required=True).items():
        yield key, record, current.get(key)


def _how_to_supply(record: PluginRecord) -> str:
    """State how a user supplies a plug-in."""
    if record.package:
        return "the package installed"
    return "plugins=[...]" if record.file is None else argument("plugins", ["FILE"])
