"""Models that are not built in: values from Python, Python files that a caller names, and installed packages.

A package provides models by an entry point of the group `impact.models`, a model or a module that defines some:

    [project.entry-points."impact.models"]
    my-laws = "my_package.laws"

Its models are in the catalogue wherever the package is installed. All such packages are imported when models that
are not built in may be needed; no package is imported because a data file names it.
"""

from __future__ import annotations

import hashlib
import re
import sys
import traceback
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from ..config.files import read_bytes
from ..config.quantities import as_text
from ..contact.catalogue import look_up
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..errors import NOT_OF_A_PLUGIN, ImpactError, ModelError, UsageError, warn
from ..formatting import safe_text

ENTRY_POINT_GROUP = "impact.models"
# characters of the error message of a plug-in: a message that lists all known names is long
MAX_ERROR_LENGTH = 1000
# attributes of a function with values that its file does not determine
HELD_BY_FUNCTIONS = ("__closure__", "__defaults__", "__kwdefaults__", "__self__")


class PythonFile(NamedTuple):
    """A Python file: its name, and the content that was executed, even if the file has changed since."""

    name: str
    content: bytes


@dataclass(frozen=True)
class Plugin:
    """A model that is not built in, with the Python file, or the name and version of the package, that has it."""

    model: ForceModel
    # of the file that defines the model, or `value_hash`; None if no file defines it
    sha256: str | None
    source: PythonFile | None = None
    package: str | None = None

    @property
    def record(self) -> dict[str, str | None]:
        """The record in a result: the name of the file without its folder, or the package, and the hash."""
        file = None if self.source is None else Path(self.source.name).name
        record = {"file": file, "sha256": self.sha256}
        return record if self.package is None else {**record, "package": self.package}


@dataclass(frozen=True)
class Plugins:
    """The models that are not built in, in the order of the caller."""

    items: tuple[Plugin, ...] = ()

    @property
    def models(self) -> tuple[ForceModel, ...]:
        return tuple(plugin.model for plugin in self.items)

    @property
    def sources(self) -> tuple[PythonFile, ...]:
        """The Python files that define them."""
        return tuple(dict.fromkeys(plugin.source for plugin in self.items if plugin.source is not None))

    @property
    def hashes(self) -> dict[str, str | None]:
        """SHA-256 by key, which is part of the fingerprint; names of files are not."""
        return {plugin.model.key: plugin.sha256 for plugin in self.items}

    @property
    def record(self) -> dict[str, dict[str, str | None]]:
        """The records in a result, by key."""
        return {plugin.model.key: plugin.record for plugin in self.items}

    def of(self, models: Sequence[ForceModel]) -> Plugins:
        """Keep those that are among `models`."""
        keys = {model.key for model in models}
        return Plugins(tuple(plugin for plugin in self.items if plugin.model.key in keys))


def read_plugins(sources: Sequence[ForceModel | str | Path | PythonFile]) -> Plugins:
    """Collect the models of installed packages, those of `sources`, and all at the top level of its files.

    The packages are imported and the files executed: never pass files that a data file names.

    >>> law = ForceModel("mine", "Mine", 2026, "F = K δⁿ", "", force=lambda elastic: elastic)
    >>> read_plugins([law]).record["mine"]["file"] is None
    True
    """
    if isinstance(sources, str | Path | ForceModel):
        hint = (
            f"; did you mean pattern={sources!r}?" if isinstance(sources, str) and sources in catalogue() else ""
        )
        raise UsageError(f"plugins: got {sources!r}, expected a list of models and paths{hint}")
    origins = dict.fromkeys(catalogue(), "built in")
    named_plugins = [(str(plugin.package), plugin) for plugin in installed()]
    for index, source in enumerate(sources):
        named_plugins += _plugins_of_source(source, f"plugins[{index}]")
    for name, plugin in named_plugins:
        key = plugin.model.key
        _check_storable(plugin.model, name)
        if key in origins:
            raise ModelError(
                f"{name}: model {key}: there are two models of this key, the other one {origins[key]}; expected "
                "another key"
            )
        origins[key] = f"in {name}"
    return Plugins(tuple(plugin for _, plugin in named_plugins))


def _plugins_of_source(source: object, argument: str) -> list[tuple[str, Plugin]]:
    """Read the plug-ins of a source, each with the name of the source in messages."""
    match source:
        case ForceModel():
            return [(argument, Plugin(source, value_hash(source)))]
        case PythonFile():
            return [(source.name, plugin) for plugin in _plugins_of_file(source)]
        case str() | Path():
            return [(str(source), plugin) for plugin in _plugins_of_file(_read_source(Path(source)))]
    raise UsageError(f"{argument}: got {source!r}, expected a ForceModel or the path of a Python file")


@cache
def installed() -> tuple[Plugin, ...]:
    """Import the models of all installed packages; a `ModelError` names a package that has to be repaired."""
    plugins: dict[int, Plugin] = {}
    for point in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda point: (point.value, point.name)):
        for plugin in _plugins_of_entry_point(point):
            plugins.setdefault(id(plugin.model), plugin)
    return tuple(plugins.values())


def _plugins_of_entry_point(point: EntryPoint) -> list[Plugin]:
    package = f"{point.dist.name} {point.dist.version}" if point.dist else "a package without a name"
    location = f"{package}: entry point {point.name} = {point.value}"
    try:
        loaded = point.load()
    except NOT_OF_A_PLUGIN:
        raise
    except BaseException as error:
        message = safe_text(f"{type(error).__name__}: {error}", 300)
        raise ModelError(f"{location}: {message}; repair the package or uninstall it") from None
    models = _models_among(vars(loaded).values() if isinstance(loaded, ModuleType) else [loaded])
    if not models:
        raise ModelError(f"{location}: contains no model, expected a ForceModel or a module of them")
    file = getattr(sys.modules.get(point.module), "__file__", None)
    sha256 = hashlib.sha256(Path(file).read_bytes()).hexdigest() if file else None
    return [Plugin(model, sha256, package=package) for model in models]


def _models_among(values: Iterable[object]) -> list[ForceModel]:
    """Find the models among some values, each once, without built-in models, which a file may import to modify."""
    built_in = {id(model) for model in catalogue().values()}
    models = {id(value): value for value in values if isinstance(value, ForceModel)}
    return [model for identity, model in models.items() if identity not in built_in]


def _check_storable(model: ForceModel, name: str) -> None:
    """Refuse texts and years that a result cannot store, before the sweep is integrated."""
    texts = {field: getattr(model, field) for field in ("title", "equation", "reference", "doi")}
    texts |= {f"meaning of {parameter.name}": parameter.meaning for parameter in model.parameters}
    for field, text in texts.items():
        if not isinstance(text, str) or re.search("[\0\ud800-\udfff]", text):
            raise ModelError(
                f"{name}: model {model.key}: {field}: got {as_text(text)}, expected text without NUL and "
                "lone surrogates"
            )
    if not isinstance(model.year, int) or not 0 <= model.year <= 9999:
        raise ModelError(
            f"{name}: model {model.key}: year: got {as_text(model.year)}, expected a year, such as 2026"
        )


def _plugins_of_file(source: PythonFile) -> list[Plugin]:
    """Execute a Python file, and take the models at its top level, in order of definition."""
    sha256 = hashlib.sha256(source.content).hexdigest()
    models = _models_among(vars(_execute_module(source, sha256)).values())
    if not models:
        raise ModelError(f"{source.name}: contains no model, expected a ForceModel at its top level")
    file = str(Path(source.name).absolute())
    for model in models:
        # no field: it does not belong to the law
        object.__setattr__(model, "read_again", (law_of_file, (file, sha256, model.key)))
    return [Plugin(model, sha256, source) for model in models]


def law_of_file(file: str, sha256: str, key: str) -> ForceModel:
    """Read a law that was pickled from its file again."""
    plugins = _plugins_of_file(_read_source(Path(file)))
    if plugins[0].sha256 != sha256:
        warn(f"{file}: has changed since the model {key} was pickled")
    return look_up({plugin.model.key: plugin.model for plugin in plugins}, key, "model")


def _read_source(path: Path) -> PythonFile:
    """Read a Python file."""
    if path.suffix != ".py":
        raise UsageError(f"{path}: its name does not end in .py, expected a Python file")
    return PythonFile(str(path), read_bytes(path, "Python", -1, UsageError))


def _execute_module(source: PythonFile, sha256: str) -> ModuleType:
    """Execute exactly the bytes that were hashed as a module, without storing bytecode."""
    # the folder is not searched for modules: a plug-in is a single file, so that the hash covers all of it
    file = str(Path(source.name).absolute())
    try:
        code = compile(source.content, file, "exec", dont_inherit=True)
    except Exception as error:
        # a SyntaxError, or other errors of the compiler for NUL bytes and very deep nesting
        line = getattr(error, "lineno", None) or 1
        text = safe_text((getattr(error, "text", None) or "").strip(), 60)
        message = error.msg if isinstance(error, SyntaxError) else f"{type(error).__name__}: {error}"
        raise ModelError(f"{source.name}:{line}: not Python: {message}{text and f': {text}'}") from None
    module = ModuleType(f"_impact_plugin_{sha256[:16]}")
    module.__file__ = file
    # dataclasses and inspect look a module up by its name
    sys.modules[module.__name__] = module
    try:
        exec(code, module.__dict__)
    except NOT_OF_A_PLUGIN:
        raise
    except BaseException as error:
        sys.modules.pop(module.__name__, None)
        frames = traceback.walk_tb(error.__traceback__)
        line = [number for frame, number in frames if frame.f_code.co_filename == file][-1]
        text, kind = safe_text(str(error), MAX_ERROR_LENGTH), type(error).__name__
        if not isinstance(error, ImpactError):
            text = f"{kind}: {text}" if text else kind
        if isinstance(error, SystemExit):
            text += "; expected a file that only declares models"
        raise ModelError(f"{source.name}:{line}: {text}") from None
    return module


def value_hash(model: ForceModel) -> str | None:
    """SHA-256 over the files that define a model's formulas, their positions there, and the other fields.

    None where these do not identify the model: a formula was typed into a session, uses values from its
    surroundings (a closure, defaults, a callable object), or its file cannot be read.

    >>> session = {}
    >>> exec("formula = lambda elastic: elastic", session)
    >>> value_hash(ForceModel("mine", "Mine", 2026, "", "", force=session["formula"])) is None
    True
    """
    digest = hashlib.sha256()
    for name, value in ((field.name, getattr(model, field.name)) for field in fields(model)):
        parts = value.values() if isinstance(value, Mapping) else value if isinstance(value, tuple) else (value,)
        formulas = [part for part in parts if callable(part)]
        if not formulas:
            digest.update(f"{name} = {value!r}\n".encode())
        for formula in formulas:
            code = getattr(formula, "__code__", None)
            if code is None or any(getattr(formula, attribute, None) for attribute in HELD_BY_FUNCTIONS):
                return None
            module = str(formula.__module__)
            digest.update(f"{name}: {module}.{code.co_qualname}\n".encode())
            if module.startswith("impact."):
                # the version of this package is recorded beside the hash
                continue
            digest.update(repr([*code.co_positions()]).encode())
            try:
                digest.update(Path(code.co_filename).read_bytes())
            except (OSError, ValueError):
                return None
    return digest.hexdigest()
