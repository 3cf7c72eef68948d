"""Where a result comes from: the config of its sweep, one point of that, and the models that it was made by."""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import xarray as xr

from ..config.grid import MAX_POINTS, Axis, path_of
from ..config.load import Config, parse_config, read_config
from ..config.tables import SWEEP_QUANTITIES
from ..engine.plan import Plan, owner_of
from ..engine.plugins import Plugins
from ..errors import ConfigError, ResultError, UsageError, did_you_mean
from ..text import safe_text
from .attributes import PluginRecord, read_attribute
from .backend import open_result
from .impact import impact_of
from .sealed import is_result
from .select import matched

STARTER = files("impact") / "config" / "starter.toml"

Source = str | Path | Mapping[str, object] | xr.Dataset | None
# from overrides to the config with them
Read = Callable[[Sequence[str]], Config]


def stored_config(
    attributes: Mapping[str, object],
    overrides: Sequence[str],
    plugins: Plugins,
    name: str,
    max_points: int = MAX_POINTS,
    *,
    allow_changed_plugins: bool = False,
) -> Config:
    """The config of the sweep that a result came from.

    Parameters
    ----------
    attributes : of the result
    overrides : changes to its config, after those that it was made with
    plugins : models that are not built in, those that it was made with among them
    name : of the result, for messages
    max_points : refuse a sweep of more points
    allow_changed_plugins : accept another version of a model of one's own; see `changed_plugins`

    Raises
    ------
    UsageError : it is a time history, or was made with a model that is not given, or is another version
    ResultError, ConfigError : what it carries cannot be read, or is no config here
    """
    text = attributes.get("config")
    if text is None:
        raise UsageError(f"{safe_text(name)}: holds no config; it is a time history")
    if not isinstance(text, str):
        raise ResultError(f"{safe_text(name)}: its attribute config is no text")
    check_plugins(attributes, plugins, name)
    if not allow_changed_plugins:
        for reason in (*changed_plugins(attributes, plugins, name), *unknown_plugins(attributes, plugins, name)):
            raise UsageError(reason)
    stored = read_attribute(attributes, "config_set", name, required=True)
    return parse_config(text, [*stored, *overrides], plugins.models, name, max_points)


def single_point(
    source: Source,
    overrides: Sequence[str],
    plugins: Plugins,
    model: str | None = None,
    at: Mapping[str, float | str] | None = None,
) -> tuple[Config, tuple[str, ...]]:
    """The config of a single impact.

    Parameters
    ----------
    source : path of a TOML file or of a result, a mapping of the shape of the former, a result, or None for the
        starter at e = 0.5; a part of a result stands for the values that it was taken at
    overrides : changes to its config
    plugins : models that are not built in; one that has changed since the result was made gives a warning
    model : key of the model; by default the config's first
    at : values by config name, which need not be on the grid. Those that vary together, in a zip group or in
        numbered cases, have to be; the number of a case is chosen by the name of its dimension

    Returns
    -------
    (Config, names) : a config without axes, and the names of the axes that were not named: they took their first
        value

    Raises
    ------
    ConfigError, UsageError : a name is not known here, or a value is not allowed
    ResultError : what a result carries cannot be read
    """
    read, parted = _reader(source, overrides, plugins)
    # each override, and how it is called in a message: as it was asked for
    asked = {} if model is None else {f"models={json.dumps([model])}": f"--model {model}"}
    config = _read(read, asked)
    columns = [_columns(axis) for axis in config.axes]
    varied = {name for names in columns for name in names}
    if at and {"e", "alpha"} <= at.keys():
        raise UsageError("--at alpha: got alpha beside e, expected one of the two")
    at = {**{name: value for name, value in parted.items() if name in varied}, **(at or {})}
    together = {name for names in columns if len(names) > 1 for name in names}
    known = [*(name for names in columns for name in names), *config.scalars]
    for name, value in at.items():
        if name not in known and name not in SWEEP_QUANTITIES:
            raise UsageError(f'no input "{safe_text(name)}" here; {did_you_mean(name, known)}')
        if name not in together:
            asked[f"{_override_path(name)}={_toml(value)}"] = f"--at {name}={value}"
    config = _read(read, asked)

    scalars = dict(config.scalars)
    first: list[str] = []
    for axis in config.axes:
        scalars |= {name: values[_place(axis, at)] for name, values in axis.columns.items()}
        if axis.size > 1 and not any(name in at for name in _columns(axis)):
            first += axis.columns
    return replace(config, axes=(), scalars=scalars, models=config.models[:1]), tuple(first)


def _reader(source: Source, overrides: Sequence[str], plugins: Plugins) -> tuple[Read, dict[str, float | str]]:
    """How the config of a source is read, and the single values of a part of a result."""
    if source is None:
        text = STARTER.read_text(encoding="utf-8")
        first = ["sweep.e=0.5", *overrides]
        return lambda more: parse_config(text, [*first, *more], plugins.models, name="starter"), {}
    if isinstance(source, str | Path) and is_result(Path(source)):
        with open_result(source) as stored:
            return _stored_reader(stored, overrides, plugins, str(source))
    if isinstance(source, xr.Dataset):
        return _stored_reader(source, overrides, plugins, "the result")
    path_or_table = Path(source) if isinstance(source, str) else source
    return lambda more: read_config(path_or_table, [*overrides, *more], plugins.models), {}


def _stored_reader(
    dataset: xr.Dataset, overrides: Sequence[str], plugins: Plugins, name: str
) -> tuple[Read, dict[str, float | str]]:
    attributes = dict(dataset.attrs)
    single = {str(key): label.values.item() for key, label in dataset.coords.items() if label.ndim == 0}
    if "config" in attributes:
        check_plugins(attributes, plugins, name)
        for note in (*changed_plugins(attributes, plugins, name), *unknown_plugins(attributes, plugins, name)):
            warnings.warn(note, stacklevel=4)

    def read(more: Sequence[str]) -> Config:
        return stored_config(attributes, [*overrides, *more], plugins, name, allow_changed_plugins=True)

    return read, {key: value for key, value in single.items() if key != "model"}


def _columns(axis: Axis) -> dict[str, Sequence[float | str]]:
    """The values along an axis by the names that choose a point of it: its columns, and the number of a case."""
    return {**({axis.numbered: axis.labels} if axis.numbered else {}), **axis.columns}


def _place(axis: Axis, at: Mapping[str, float | str]) -> int:
    """The place on an axis where its columns have the values asked for."""
    columns = _columns(axis)
    for place in range(axis.size):
        if all(columns[name][place] == value for name, value in at.items() if name in columns):
            return place
    asked = ", ".join(f"{name} = {value}" for name, value in at.items() if name in columns)
    raise UsageError(f"{safe_text(asked)}: not on the zipped axis {axis.name}; these values vary together")


def _override_path(name: str) -> str:
    """The path of an input in an override, as TOML writes it.

    >>> _override_path("v1"), _override_path("bilinear.K"), _override_path("materials.soft steel.E")
    ('sweep.v1', 'model.bilinear.K', 'materials."soft steel".E')
    """
    parts = map(str, path_of(name))
    return ".".join(part if re.fullmatch("[A-Za-z0-9_-]+", part) else _toml(part) for part in parts)


def _toml(value: float | str) -> str:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def _read(read: Read, asked: Mapping[str, str]) -> Config:
    """A config whose problems are called by what was asked for, not by the overrides that stand for it."""
    try:
        return read(list(asked))
    except ConfigError as error:
        names = {f"--set {override}:": f"{name}:" for override, name in asked.items()}
        raise ConfigError([_renamed(line, names) for line in error.problems]) from None


def _renamed(line: str, names: Mapping[str, str]) -> str:
    """A line that begins with one of the names, beginning with what it stands for."""
    return next((safe_text(new) + line[len(old) :] for old, new in names.items() if line.startswith(old)), line)


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
    at : values of the axes, which need not be on the grid; one that is not named takes its first value. A
        parameter of one model is no input of the others
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
    check_plugins(dataset.attrs, plugins, "the result")
    for changed in changed_plugins(dataset.attrs, plugins, "the result"):
        # the motion of another law is not that of the result
        raise UsageError(changed)
    followed: list[xr.Dataset] = []
    ends: dict[str, str] = {}
    first: dict[str, float | str] = {}
    for key in dict.fromkeys(models or known):
        others = {str(name) for name in dataset.coords if owner_of(str(name)) not in ("", key)}
        of_model = {name: value for name, value in at.items() if name not in others}
        config, names = single_point(dataset, (), plugins, key, of_model)
        impact = impact_of(Plan(config, plugins.of(config.models)), names)
        first |= {name: impact.point[name] for name in names}
        if impact.history is None:
            ends[key] = impact.status.meaning
        else:
            followed.append(impact.history)
    if not followed:
        where = ", ".join(f"{name} = {value}" for name, value in {**first, **at}.items())
        reason = next(iter(ends.values()))
        raise UsageError(f"no motion to draw at {safe_text(where)}: {reason}; choose a point, such as --sel e=0.5")
    return followed


def part_of(config: Config, dataset: xr.Dataset) -> Config:
    """The part of a config that a result holds: its axes with the values that are labels there.

    An axis without such a value keeps its first one, at which a comparison shows the difference.
    """
    axes = []
    for axis in config.axes:
        labels_of = {axis.name: axis.labels} if axis.numbered else axis.columns
        held = {name: dataset.coords[name] for name in labels_of if name in dataset.coords}
        first = next(iter(held.values()), None)
        names = [name for name, labels in held.items() if first is not None and labels.dims == first.dims]
        values = [np.asarray(labels_of[name]) for name in names]
        labels = [np.ravel(held[name].values) for name in names]
        places = sorted(matched(values, labels)[0].tolist()) if names else []
        chosen = np.array(places or [0])
        columns = {name: tuple(np.asarray(v)[chosen].tolist()) for name, v in axis.columns.items()}
        numbers = tuple(axis.labels[place] for place in chosen) if axis.numbered else ()
        axes.append(replace(axis, columns=columns, numbers=numbers))
    return replace(config, axes=tuple(axes))


def check_plugins(attributes: Mapping[str, object], plugins: Plugins, name: str) -> None:
    """Refuse if a model of one's own that a result was made with is not given again.

    Nothing is imported because a result names it: what it names is compared with what is given, and reported.

    Parameters
    ----------
    attributes : of the result
    plugins : what is given now; more than the result was made with is no fault
    name : of the result, for messages

    Raises
    ------
    UsageError : one is missing
    ResultError : the attribute cannot be read

    >>> check_plugins({"plugins": '{"mine": {"file": "my.py", "sha256": "12ab"}}'}, Plugins(), "results.h5")
    Traceback (most recent call last):
    impact.errors.UsageError: results.h5: made with mine of my.py; give it again with --plugin FILE
    """
    made = _made_with(attributes, name)
    given = _given(plugins)
    # the hash of a file is not that of a value: given in another way, a model cannot be known to be the same
    missing = {key: record for key, record in made.items() if key not in given or _way(given[key]) != _way(record)}
    if missing:
        named = ", ".join(f"{key} of {_origin(record) or 'a Python value'}" for key, record in missing.items())
        ways = " and ".join(sorted({_way(record) for record in missing.values()}))
        again = "it" if len(missing) == 1 else "them"
        raise UsageError(f"{safe_text(name)}: made with {safe_text(named)}; give {again} again with {ways}")


def changed_plugins(attributes: Mapping[str, object], plugins: Plugins, name: str) -> tuple[str, ...]:
    """A sentence for each model that a result was made with and that is given in another version.

    Parameters
    ----------
    attributes : of the result
    plugins : what is given now, all that the result was made with among them
    name : of the result, for messages
    """
    given = _given(plugins)
    return tuple(
        f"{safe_text(name)}: was made with another version of {safe_text(_origin(record) or f'the model {key}')}: "
        f"its SHA-256 is {safe_text(record.sha256, 64)}, this one's is {given[key].sha256}"
        for key, record in _made_with(attributes, name).items()
        if record.sha256 and given[key].sha256 and record.sha256 != given[key].sha256
    )


def unknown_plugins(attributes: Mapping[str, object], plugins: Plugins, name: str) -> tuple[str, ...]:
    """A sentence for each model of which no hash says whether it is the one that a result was made with.

    Parameters are those of `changed_plugins`.
    """
    given = _given(plugins)
    return tuple(
        f"{safe_text(name)}: the model {safe_text(key)} is a Python value that no file defines, so that it cannot "
        "be known to be the one that the result was made with; expected a model in a Python file"
        for key, record in _made_with(attributes, name).items()
        if not (record.sha256 and given[key].sha256)
    )


def _made_with(attributes: Mapping[str, object], name: str) -> dict[str, PluginRecord]:
    records: dict[str, PluginRecord] = read_attribute(attributes, "plugins", name, required=True)
    return records


def _given(plugins: Plugins) -> dict[str, PluginRecord]:
    return {key: PluginRecord(**record) for key, record in plugins.record.items()}


def _origin(record: PluginRecord) -> str | None:
    """The file or the package of a model."""
    return record.package or record.file


def _way(record: PluginRecord) -> str:
    """How a model is given again."""
    if record.package:
        return "the package installed"
    return "plugins=[...]" if record.file is None else "--plugin FILE"
