"""Where a result comes from: the config of its sweep, its models, and the command that runs a point again."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr

from ..config.draft import Draft, Overrides, open_text
from ..config.grid import MAX_POINTS
from ..config.input_names import InputName
from ..config.load import Config, Purpose, build
from ..contact.units import names_in
from ..engine.plugins import Plugins
from ..errors import ResultError, UsageError
from ..formatting import argument, prefixed, safe_text
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
    return build(draft.with_settings(overrides), max_points, purpose)


def stored_draft(attributes: Mapping[str, object], plugins: Plugins, name: str) -> Draft:
    """Open the config that a result came from."""
    text = attributes.get("config")
    if text is None:
        raise UsageError(f"{name}: contains no config, it is a time history")
    if not isinstance(text, str):
        raise ResultError(f"{name}: its attribute config is not text")
    check_plugins(attributes, plugins, name)
    stored = read_attribute(attributes, "config_set", name, required=True)
    return open_text(text, name, plugins.models).with_settings(stored)


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


def command_start(path: str, dataset: xr.Dataset, act: str = "run") -> tuple[str, ...]:
    """Start the command that runs a point of a result again, or plots it; empty for a dataset without a file.

    Also empty if a model is a Python value, which no command line can name.

    >>> command_start("new.h5", xr.Dataset(attrs={"plugins": '{"mine": {"file": "my.py", "sha256": ""}}'}))
    ('impact', 'run', 'new.h5', '--plugin', 'my.py')
    """
    files = [record.file for record in read_attribute(dataset.attrs, "plugins").values() if not record.package]
    if not path or None in files:
        return ()
    return ("impact", act, path, *(word for file in dict.fromkeys(files) for word in ("--plugin", str(file))))


def inputs_of_model(at: Mapping[str, Any]) -> dict[str, Any]:
    """Leave out the parameters of other models and friction laws.

    >>> inputs_of_model({"model": "mine", "e": 0.5, "mine.c": 2.0, "other.c": 3.0, "materials.steel.E": 2e11})
    {'model': 'mine', 'e': 0.5, 'mine.c': 2.0, 'materials.steel.E': 200000000000.0}
    """
    keys = [str(at.get(dim, "")) for dim in ("model", "friction")]
    return {name: value for name, value in at.items() if InputName.parse(name).applies_to(*keys)}


def inputs_at(values: xr.DataArray, position: Iterable[int]) -> dict[str, Any]:
    """Look up the inputs of a point of a variable, with its laws and without the parameters of others."""
    point = values.isel(dict(zip(values.dims, position, strict=True)))
    return inputs_of_model({str(dim): point[dim].values.item() for dim in values.dims})


def describe_point(
    at: Mapping[str, float | str], digits: int = 12, units: Mapping[str, str] = MappingProxyType({})
) -> str:
    """List the inputs of a point for a message, with words and their units, of which some may be given by path.

    >>> describe_point({"model": "hertz", "e": 0.1 + 0.2, "v1": 0.005, "friction.coulomb-1785.limit": 1.0})
    'model=hertz, e=0.3, v1=5 mm/s, friction.coulomb-1785.limit=positive'
    """
    texts = []
    for text, value in at.items():
        name = InputName.parse(text)
        # an exponent n has a value for each law
        unit = units.get(name.config_key, "1" if names_in(name.unit) else name.unit)
        texts.append(f"{safe_text(text)}={safe_text(prefixed(name.word(value), unit, digits), 60)}")
    return ", ".join(texts)


def replay_command(start: Sequence[str], at: Mapping[str, object]) -> str:
    """Complete the command by the model, the friction law and the inputs of the point.

    >>> replay_command(("impact", "run", "new.h5"), {"model": "hertz", "case": 3})
    'impact run new.h5 --model hertz --at case=3'
    >>> replay_command(("impact", "run", "new.h5"), {"model": "hertz", "e": 0.5, "material": "soft steel"})
    "impact run new.h5 --model hertz --at e=0.5 --at 'material=soft steel'"
    """
    command = list(start)
    for name, value in at.items():
        text = repr(value) if isinstance(value, float) else str(value)
        command += [f"--{name}", text] if name in ("model", "friction") else ["--at", f"{name}={text}"]
    return safe_text(shlex.join(command), 2000)
