"""Where a config comes from: a TOML file, a mapping, the starter, or the sweep that a result came from."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..engine.plugins import Plugins
from ..errors import ResultError, UsageError
from ..sweeps.config import Axis, Config, parse_config, read_config
from ..sweeps.grid import MAX_POINTS
from ..text import safe_text
from .backend import open_result
from .sealed import is_result
from .select import matched

STARTER = files("impact") / "sweeps" / "starter.toml"


def config_of(
    source: str | Path | Mapping[str, object] | None, overrides: Sequence[str], plugins: Plugins
) -> Config:
    """The config of a TOML file, a mapping, the starter, or of the sweep that a result came from."""
    if source is None:
        overrides = ["sweep.e=0.5", *overrides]
        return parse_config(STARTER.read_text(encoding="utf-8"), overrides, plugins.models, name="starter")
    if isinstance(source, Mapping):
        return read_config(source, overrides, plugins.models)
    path = Path(source)
    if is_result(path):
        with open_result(path) as stored:
            attributes = stored.attrs
        config = stored_config(attributes, overrides, plugins, str(path), allow_changed_plugins=True)
        for note in changed_plugins(attributes, plugins, str(path)):
            warnings.warn(note, stacklevel=2)
        return config
    return read_config(path, overrides, plugins.models)


def picked_out(source: str | Path | Mapping[str, object] | None) -> dict[str, float | str]:
    """The single values of a result; where its sweep varied one of them, the result is the part at that value."""
    if not isinstance(source, str | Path) or not is_result(Path(source)):
        return {}
    with open_result(source) as stored:
        single = {str(name): one for name, one in stored.coords.items() if one.ndim == 0}
    return {name: one.values.item() for name, one in single.items() if name != "model"}


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
    check_plugins(attributes, plugins, name)
    changed = () if allow_changed_plugins else changed_plugins(attributes, plugins, name)
    if changed:
        raise UsageError(changed[0])
    stored = _json(attributes, "config_set", name)
    if not (isinstance(text, str) and isinstance(stored, list) and all(isinstance(one, str) for one in stored)):
        raise ResultError(f"{safe_text(name)}: its attributes config and config_set are not those of a result")
    return parse_config(text, [*stored, *overrides], plugins.models, name, max_points)


def part_of(config: Config, dataset: xr.Dataset) -> Config:
    """The part of a config that a result holds: its axes with the values that are labels there.

    An axis without such a value keeps its first one, at which a comparison shows the difference.
    """
    axes = []
    for axis in config.axes:
        held = {name: dataset.coords[name] for name in axis.columns if name in dataset.coords}
        first = next(iter(held.values()), None)
        names = [name for name, labels in held.items() if first is not None and labels.dims == first.dims]
        values = [np.asarray(axis.columns[name]) for name in names]
        labels = [np.ravel(held[name].values) for name in names]
        places = sorted(matched(values, labels)[0].tolist()) if names else []
        chosen = np.array(places or [0])
        axes.append(Axis({name: tuple(np.asarray(v)[chosen].tolist()) for name, v in axis.columns.items()}))
    return replace(config, axes=tuple(axes))


def check_plugins(attributes: Mapping[str, object], plugins: Plugins, name: str) -> None:
    """Refuse if a model of one's own that a result was made with is not given again.

    Nothing is imported because a result names it: what it names is compared with what is given, and told.

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
    shown = safe_text(name)
    given = plugins.record
    # the hash of a file is not that of a value: given in another way, a model cannot be known to be the same
    missing = [key for key, one in made.items() if key not in given or _way(given[key]) != _way(one)]
    if missing:
        told = ", ".join(f"{key} of {_origin(made[key]) or 'a Python value'}" for key in missing)
        ways = {_way(made[key]) for key in missing}
        again = "it" if len(missing) == 1 else "them"
        raise UsageError(
            f"{shown}: made with {safe_text(told)}; give {again} again with {' and '.join(sorted(ways))}"
        )


def changed_plugins(attributes: Mapping[str, object], plugins: Plugins, name: str) -> tuple[str, ...]:
    """A sentence for each model that a result was made with and that is given in another version.

    Parameters
    ----------
    attributes : of the result
    plugins : what is given now, all that the result was made with among them
    name : of the result, for messages
    """
    given = plugins.record
    return tuple(
        f"{safe_text(name)}: was made with another version of {safe_text(_origin(one) or f'the model {key}')}: "
        f"its SHA-256 is {safe_text(str(one['sha256']), 64)}, this one's is {given[key]['sha256']}"
        for key, one in _made_with(attributes, name).items()
        if one["sha256"] != given[key]["sha256"]
    )


def _origin(one: Mapping[str, str | None]) -> str | None:
    """The file or the package of a model."""
    return one.get("package") or one["file"]


def _way(one: Mapping[str, str | None]) -> str:
    """How a model is given again."""
    if one.get("package"):
        return "the package installed"
    return "plugins=[...]" if one["file"] is None else "--plugin FILE"


def _made_with(attributes: Mapping[str, object], name: str) -> dict[str, dict[str, str | None]]:
    """What a result says of the models that are not built in, in the shape of `Plugins.record`."""
    made = _json(attributes, "plugins", name)
    right = isinstance(made, dict) and all(
        isinstance(one, dict)
        and {"file", "sha256"} <= one.keys() <= {"file", "sha256", "package"}
        and isinstance(one["sha256"], str)
        and isinstance(one["file"], str | None)
        and isinstance(one.get("package"), str | None)
        for one in made.values()
    )
    if not right:
        raise ResultError(
            f"{safe_text(name)}: its attribute plugins is not that of a result, wants a file and a sha256 by key"
        )
    found: dict[str, dict[str, str | None]] = made
    return found


def _json(attributes: Mapping[str, object], attribute: str, name: str) -> Any:
    """What an attribute of a result holds as JSON; it may come from anywhere."""
    try:
        return json.loads(str(attributes[attribute]))
    except (KeyError, ValueError, RecursionError):
        raise ResultError(f"{safe_text(name)}: its attribute {attribute} is missing, or is not JSON") from None
