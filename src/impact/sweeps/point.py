"""One point of a sweep: its config with a single value for every axis."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from ..errors import ConfigError, UsageError, did_you_mean
from ..text import safe_text
from .config import Axis, Config
from .rules import SWEEP

Read = Callable[[Sequence[str]], Config]


def one_point(
    read: Read,
    model: str | None = None,
    at: Mapping[str, float | str] | None = None,
    picked: Mapping[str, float | str] | None = None,
) -> tuple[Config, tuple[str, ...]]:
    """The config of a single impact.

    Parameters
    ----------
    read : from overrides to the config with them
    model : key of the model; by default the config's first
    at : values by config name, which need not be on the grid; those of a zip group have to be, since they vary
        together
    picked : values by config name for the axes among them, where `at` says nothing

    Returns
    -------
    (Config, names) : a config without axes, and the names of the axes that were not named: they took their first
        value

    Raises
    ------
    ConfigError, UsageError : a name is not known here, or a value is not allowed
    """
    # each override, and how it is called in a message: as it was asked for
    asked = {} if model is None else {f"models={json.dumps([model])}": f"--model {model}"}
    config = _read(read, asked)
    varied = {name for axis in config.axes for name in axis.columns}
    if at and {"e", "alpha"} <= at.keys():
        raise UsageError("--at alpha: got alpha beside e, expected one of the two")
    at = {**{name: value for name, value in (picked or {}).items() if name in varied}, **(at or {})}
    zipped = {name for axis in config.axes if len(axis.columns) > 1 for name in axis.columns}
    known = [*(name for axis in config.axes for name in axis.columns), *config.scalars]
    for name, value in at.items():
        if name not in known and name not in SWEEP:
            raise UsageError(f'no input "{safe_text(name)}" here; {did_you_mean(name, known)}')
        if name not in zipped:
            key, _, parameter = name.rpartition(".")
            path = f"model.{key}.{parameter}" if key else f"sweep.{name}"
            asked[f"{path}={json.dumps(value) if isinstance(value, str) else repr(value)}"] = (
                f"--at {name}={value}"
            )
    config = _read(read, asked)

    scalars = dict(config.scalars)
    first: list[str] = []
    for axis in config.axes:
        scalars |= {name: values[_place(axis, at)] for name, values in axis.columns.items()}
        if axis.size > 1 and not any(name in at for name in axis.columns):
            first += axis.columns
    return replace(config, axes=(), scalars=scalars, models=config.models[:1]), tuple(first)


def _read(read: Read, asked: Mapping[str, str]) -> Config:
    try:
        return read(list(asked))
    except ConfigError as error:
        names = {f"--set {override}:": f"{name}:" for override, name in asked.items()}
        raise ConfigError([_renamed(line, names) for line in error.problems]) from None


def _renamed(line: str, names: Mapping[str, str]) -> str:
    """A line that begins with one of the names, beginning with what it stands for."""
    return next((safe_text(new) + line[len(old) :] for old, new in names.items() if line.startswith(old)), line)


def _place(axis: Axis, at: Mapping[str, float | str]) -> int:
    """The place on a zipped axis where its columns have the values asked for."""
    for place in range(axis.size):
        if all(axis.columns[name][place] == value for name, value in at.items() if name in axis.columns):
            return place
    asked = ", ".join(f"{name} = {value}" for name, value in at.items() if name in axis.columns)
    raise UsageError(f"{safe_text(asked)}: not on the zipped axis {axis.name}; these values vary together")
