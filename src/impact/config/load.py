"""A config read and checked: from a TOML file or a mapping to a frozen `Config`, or all of its problems."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from ..contact.materials import Material
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..contact.numba.dispatch import is_installed
from ..contact.outputs import BY_DEFAULT
from ..errors import ConfigError
from .cases import expand_cases, inline_files
from .files import apply_overrides, load, plain, read_override, read_text, toml_key, toml_text
from .grid import MAX_POINTS, Axis, chunk_faults, lay_out, name_of, path_of
from .library import library
from .lines import Places, faults_of, key_lines, lines_of
from .quantities import Column, Context, Fault, KeyPath, Names, Numbers, Table
from .rules import Given, cross_faults
from .tables import (
    DEFAULT_RTOL,
    DEFAULTS,
    MATERIAL_KEYS,
    MATERIAL_QUANTITIES,
    SWEEP_QUANTITIES,
    Document,
    MaterialTable,
    Output,
    Solver,
    document_type,
    expand_models,
    json_schema,
    model_quantities,
)

__all__ = ["DEFAULT_RTOL", "Axis", "Config", "Output", "Solver", "json_schema", "parse_config", "read_config"]


@dataclass(frozen=True)
class Config:
    """A sweep as it was asked for, checked, in SI units.

    Parameters
    ----------
    title : of the sweep
    models : the contact force models, in the order asked for
    scalars : what does not vary, by config name ("v1", "material1", "KEY.name" for a model's parameter),
        with defaults filled in; a mass or radius that is not given is derived from the other and the density
    axes : the dimensions of the grid in config order: those of [sweep], of materials ("materials.steel.E"), of
        models
    materials : by name, those of the library that are used among them; what is an axis is NaN for E and nu, and
        None for rho and yield_strength
    solver : tolerances
    output : which variables are stored, and how
    text : the TOML text verbatim, or a mapping as JSON
    overrides : PATH=VALUE strings in order; `text` is without them. Those that were asked for stand after those
        that hold the materials of the library that the config uses, and before those that hold the values of the
        CSV files that it names: text and overrides say it all, wherever they are read again
    """

    title: str
    models: tuple[ForceModel, ...]
    scalars: Mapping[str, float | str]
    axes: tuple[Axis, ...]
    materials: Mapping[str, Material]
    solver: Solver
    output: Output
    text: str
    overrides: tuple[str, ...]


def read_config(
    source: Path | Mapping[str, object],
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel] = (),
    max_points: int = MAX_POINTS,
) -> Config:
    """The config of a TOML file or a mapping.

    Parameters
    ----------
    source : path of a TOML file, or what such a file says as a mapping; files that it names are relative to the
        folder of the former, or for a mapping to the working directory
    overrides : strings such as "sweep.e.linspace=[0,1,11]"
    plugins : models that are not built in
    max_points : how many it may have, of all models together; more are refused before there is an array

    Raises
    ------
    ConfigError : with every problem, one a line

    >>> steel = {"E": "210 GPa", "nu": 0.3, "rho": 7850}
    >>> sweep = {"e": [0.5, 1], "v1": 1, "m1": 1, "m2": 1, "material": "steel"}
    >>> read_config({"models": "hertz", "sweep": sweep, "materials": {"steel": steel}}).axes
    (Axis(columns={'e': (0.5, 1.0)}, numbered='', numbers=()),)
    """
    reader = _Reader(catalogue(plugins), tuple(overrides), max_points, Path())
    if isinstance(source, Mapping):
        return reader.read(source, None, "config")
    path = Path(source)
    text = read_text(path)
    return replace(reader, folder=path.parent).read(load(text, str(path)), text, str(path))


def parse_config(
    text: str,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel] = (),
    name: str = "<text>",
    max_points: int = MAX_POINTS,
) -> Config:
    """The config of a TOML text, or of a JSON text, which starts with a brace; otherwise as `read_config`.

    It reads no files: a text may be that of a result from anywhere.
    """
    return _Reader(catalogue(plugins), tuple(overrides), max_points, None).read(load(text, name), text, name)


@dataclass(frozen=True)
class _Reader:
    """Reads one config.

    Parameters
    ----------
    known : all models by key
    overrides, max_points : see `read_config`
    folder : where files are that the config names; None where none may be read
    """

    known: Mapping[str, ForceModel]
    overrides: tuple[str, ...]
    max_points: int
    folder: Path | None

    def read(self, source: object, text: str | None, name: str) -> Config:
        """The config, or every problem of its overrides, files and values; `text` is None for a mapping."""
        given, faults = plain(source)
        places, config = Places(name), None
        problems: list[str] = []
        if not faults:
            overrides = (*_of_library(given, self.overrides), *self.overrides)
            data, overridden, problems = apply_overrides(given, overrides)
            places = Places(name, overrides=overrides, overridden=overridden)
            data, faults = plain(data)
        if not faults:
            if text is None:
                text = json.dumps(given, separators=(",", ":"), default=str)
            n = read_exponent(_dict(data.get("sweep")))
            data, inlined, unread = inline_files(data, self.folder, self.known, n)
            config, faults = self._config(data, text, (*overrides, *inlined))
            problems = [*unread, *problems]
        if config is None or problems:
            if text is not None and not text.lstrip().startswith("{"):
                places = replace(places, lines=key_lines(text))
            raise ConfigError([*lines_of(faults, places), *problems])
        return config

    def _config(
        self, data: Mapping[str, Any], text: str, overrides: Sequence[str]
    ) -> tuple[Config | None, list[Fault]]:
        """The config that plain data gives, or what is wrong with it."""
        data, used = _with_library(data)
        data, cases, faults = expand_cases(data, self.known)
        sweep, parameters = _dict(data.get("sweep")), _dict(data.get("model"))
        n = read_exponent(sweep)
        models, _ = expand_models(data.get("models"), self.known)
        given = Given(sweep, _dict(data.get("materials")), parameters, models, data.get("models"), n)
        context = Context(n, tuple({**given.materials, **library()}), self.known)
        document, wrong = self._validated(data, context)
        faults += wrong
        if isinstance(data.get("sweep"), dict):
            faults += cross_faults(given)
        if "cases" in sweep:
            # what cases that cannot be read would give is not missing
            faults = [(path, message) for path, message in faults if not message.startswith("missing")]
        if document is None:
            return None, _of_cases(faults, cases)
        chosen = {f"{model.key}.{name}": q for model in models for name, q in model_quantities(model).items()}
        entries = _entries(document, given, chosen)
        names = [name for name in sweep if name not in ("zip", "cases")]
        names += [f"materials.{key}.{name}" for key, table in given.materials.items() for name in _dict(table)]
        names += [f"{key}.{name}" for key, table in parameters.items() for name in _dict(table)]
        quantities = (
            SWEEP_QUANTITIES
            | chosen
            | {
                name: MATERIAL_QUANTITIES[name.rpartition(".")[2]]
                for name in entries
                if name.startswith("materials.")
            }
        )
        output = document.output
        in_full = output.layout == "full" or (output.layout == "auto" and bool(output.chunks))
        grid = lay_out(
            entries,
            quantities,
            document.sweep.zip,
            tuple(cases),
            names,
            len(models),
            self.max_points,
            in_full=in_full,
        )
        faults += grid.faults
        if not faults:
            faults += _settings_faults(document, grid.axes, len(models))
        if faults:
            return None, _of_cases(faults, cases)
        defaults = DEFAULTS | {
            f"{model.key}.{parameter.name}": parameter.default
            for model in models
            for parameter in model.parameters
            if parameter.default is not None
        }
        return Config(
            title=document.title,
            models=tuple(models),
            scalars={**grid.scalars, **{name: value for name, value in defaults.items() if name not in entries}},
            axes=grid.axes,
            materials={name: _material(table) for name, table in document.materials.items()},
            solver=document.solver,
            output=output,
            text=text,
            overrides=(*used, *overrides),
        ), []

    def _validated(self, data: Mapping[str, Any], context: Context) -> tuple[Document | None, list[Fault]]:
        """What pydantic makes of the data, or of that part of it in which nothing is wrong; and what is wrong."""
        kind = document_type(self.known, [key for key in _dict(data.get("model")) if key in self.known])
        try:
            return kind.model_validate(data, context=context), []
        except ValidationError as error:
            faults = list(faults_of(error, self.known))
        try:
            return kind.model_validate(_without(data, [path for path, _ in faults]), context=context), faults
        except ValidationError:
            return None, faults


def read_exponent(sweep: Mapping[str, Any]) -> float | None:
    """The sweep's n, which the unit of K contains: None for an axis, NaN where it cannot be read."""
    n = sweep.get("n", DEFAULTS["n"])
    if isinstance(n, list | dict) or "n" in _dict(sweep.get("cases")):
        return None
    try:
        return SWEEP_QUANTITIES["n"].read(n)
    except PydanticCustomError:
        return math.nan


def _of_library(given: Mapping[str, Any], overrides: Sequence[str]) -> list[str]:
    """Overrides that give the materials of the library a table of which other overrides change a key."""
    paths = [path for path, _ in map(read_override, overrides) if path[:1] == ("materials",)]
    names = dict.fromkeys(str(path[1]) for path in paths if len(path) > 2)
    return [_as_override(name, library()[name]) for name in names if _is_in_library(name, given, paths)]


def _is_in_library(name: str, data: Mapping[str, Any], paths: Sequence[KeyPath] = ()) -> bool:
    """Whether a material is that of the library: there is one, and no table takes its place."""
    return name in library() and name not in _dict(data.get("materials")) and ("materials", name) not in paths


def _as_override(name: str, table: Mapping[str, object]) -> str:
    return f"materials.{toml_key(name)}={toml_text(dict(table))}"


def _with_library(data: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The data with tables for the materials of the library that a ball has, and the overrides that make them."""
    sweep = _dict(data.get("sweep"))
    cases = _dict(sweep.get("cases"))
    named = dict.fromkeys(
        name for key in MATERIAL_KEYS for table in (sweep, cases) for name in _listed(table.get(key))
    )
    named |= {str(path[1]): None for path in map(path_of, cases) if path[0] == "materials"}
    tables = {
        # a column of cases takes the place of a number
        name: {key: value for key, value in library()[name].items() if f"materials.{name}.{key}" not in cases}
        for name in named
        if _is_in_library(name, data) and isinstance(data.get("materials", {}), dict)
    }
    new = {**data, "materials": {**data.get("materials", {}), **tables}} if tables else dict(data)
    return new, [_as_override(name, table) for name, table in tables.items()]


def _listed(value: object) -> list[str]:
    """The names in a name or a list of names."""
    return [name for name in (value if isinstance(value, list) else [value]) if isinstance(name, str)]


def _without(data: Mapping[str, Any], paths: Sequence[KeyPath]) -> dict[str, Any]:
    """The data without the keys in which something is wrong, and without materials that miss one."""
    depth = {"model": 3}
    out = {path[: 1 if path[0] in ("solver", "output") else depth.get(str(path[0]), 2)] for path in paths if path}

    def kept(table: Any, path: KeyPath) -> Any:
        if not isinstance(table, dict) or len(path) > 2:
            return table
        return {key: kept(item, (*path, key)) for key, item in table.items() if (*path, key) not in out}

    rest: dict[str, Any] = kept(data, ())
    return rest


def _entries(document: Document, given: Given, chosen: Mapping[str, object]) -> dict[str, Numbers | Names]:
    """What could be read, by config name: the keys of [sweep], axes of the materials used, and parameters."""
    sweep = _values(document.sweep)
    entries = {name: sweep[name] for name in given.sweep if name in sweep and name not in ("zip", "cases")}
    balls = {name for ball in "12" for name in given.material_of(ball)}
    for key, table in document.materials.items():
        for name, value in _values(table).items() if key in balls else ():
            if not isinstance(value, float):
                entries[f"materials.{key}.{name}"] = value
    tables = _values(document.model)
    for key in given.parameters:
        # what a model that is not chosen asks for was checked, and is not part of the grid
        own = {f"{key}.{name}": value for name, value in _values(tables.get(key)).items()}
        entries |= {name: value for name, value in own.items() if name in chosen}
    # the file of a column could not be read
    return {name: value for name, value in entries.items() if not isinstance(value, Column)}


def _values(table: Table | None) -> dict[str, Any]:
    """What was given in a table, by key in its order of definition."""
    if table is None:
        return {}
    fields = type(table).model_fields
    return {fields[name].alias or name: getattr(table, name) for name in fields if name in table.model_fields_set}


def _material(table: MaterialTable) -> Material:
    """A material, of which an axis is left out."""
    numbers = {name: value for name, value in _values(table).items() if isinstance(value, float)}
    return Material(**({"E": math.nan, "nu": math.nan} | numbers))


def _settings_faults(document: Document, axes: Sequence[Axis], models: int) -> list[Fault]:
    """What of [solver] and [output] does not go with the rest, or with what is installed."""
    output = document.output
    faults: list[Fault] = []
    if document.solver.core == "numba" and not is_installed():
        expected = 'numba, which is not installed (pip install "impact-sweep[fast]"), or "auto"'
        faults.append((("solver", "core"), f'got "numba", expected {expected}'))
    count = len({"status", *(output.variables or BY_DEFAULT)})
    faults += chunk_faults(output.chunks, axes, models, count)
    if output.chunks and output.layout == "factored":
        faults.append((("output", "chunks"), 'got chunks beside layout = "factored", expected layout = "full"'))
    return faults


def _of_cases(faults: Sequence[Fault], cases: Mapping[str, str]) -> list[Fault]:
    """The faults, those of a column of cases with its path."""

    def located(path: KeyPath) -> KeyPath:
        end = 2 if path[:1] == ("sweep",) else 3
        column = cases.get(name_of(path[:end])) if len(path) >= end else None
        return path if column is None else ("sweep", "cases", column, *path[end:])

    return [(located(path), message) for path, message in faults]


def _dict(value: object) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}
