"""Models that are not built in: values from Python, Python files that a caller names, and installed packages.

A package offers models by an entry point of the group `impact.models`, a model or a module of some:

    [project.entry-points."impact.models"]
    my-laws = "my_package.laws"

Its models are in the catalogue wherever it is installed. Packages are imported whenever models that are not
built in may be asked for, whatever a data file says: none is imported because one names it.
"""

from __future__ import annotations

import hashlib
import re
import sys
import traceback
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from ..config.quantities import show
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..errors import NOT_OF_A_PLUGIN, ImpactError, ModelError, UsageError
from ..text import safe_text

GROUP = "impact.models"
# characters of the message of a plug-in's error: one that lists what is known is long
MAX_MESSAGE = 1000
# attributes of a function that hold values which its file may not tell
HELD_BY_FUNCTIONS = ("__closure__", "__defaults__", "__kwdefaults__", "__self__")


class Source(NamedTuple):
    """A Python file that was read: its name, and the content that was executed, whatever it holds now."""

    name: str
    content: bytes


@dataclass(frozen=True)
class Plugin:
    """A model that is not built in, where it is from, and what tells its versions.

    `source` is the Python file that was given, or `package` the name and version of an installed one; where both
    are None, the model was given as a value. `sha256` is that of the file that defines the model, see `value_hash`
    for a value; None where no file does.
    """

    model: ForceModel
    sha256: str | None
    source: Source | None = None
    package: str | None = None

    @property
    def is_value(self) -> bool:
        """It can be sent to no other process, and no command can give it again."""
        return self.source is None and self.package is None

    @property
    def record(self) -> dict[str, str | None]:
        """What a result says of it: the file's name without a folder, or the package."""
        file = None if self.source is None else Path(self.source.name).name
        about = {"file": file, "sha256": self.sha256}
        return about if self.package is None else {**about, "package": self.package}


@dataclass(frozen=True)
class Plugins:
    """The models that are not built in, in the order given."""

    items: tuple[Plugin, ...] = ()

    @property
    def models(self) -> tuple[ForceModel, ...]:
        return tuple(one.model for one in self.items)

    @property
    def sources(self) -> tuple[Source, ...]:
        """The files that were read for them."""
        return tuple(dict.fromkeys(one.source for one in self.items if one.source is not None))

    @property
    def hashes(self) -> dict[str, str | None]:
        """SHA-256 by key: what the fingerprint is over, which a file's name is not."""
        return {one.model.key: one.sha256 for one in self.items}

    @property
    def record(self) -> dict[str, dict[str, str | None]]:
        """What a result says of them, by key."""
        return {one.model.key: one.record for one in self.items}

    def of(self, models: Sequence[ForceModel]) -> Plugins:
        """Those among some models."""
        keys = {model.key for model in models}
        return Plugins(tuple(one for one in self.items if one.model.key in keys))


def read_plugins(sources: Sequence[ForceModel | str | Path | Source]) -> Plugins:
    """The models of installed packages, and those given as values or in Python files.

    The packages are imported and the files executed: give none that a data file names.

    Parameters
    ----------
    sources : models, and Python files by their paths or as they were read elsewhere; of a file, every `ForceModel`
        at its top level is taken

    Raises
    ------
    UsageError : a file is not there, cannot be read or is no Python file
    ModelError : it, or a package, is not Python, fails, or holds no model, or one whose key is taken

    >>> law = ForceModel("mine", "Mine", 2026, "F = K δⁿ", "", force=lambda elastic: elastic)
    >>> read_plugins([law]).record["mine"]["file"] is None
    True
    """
    if isinstance(sources, str | Path | ForceModel):
        raise UsageError(f"plugins: got {safe_text(repr(sources))}, expected a list of such")
    origins = dict.fromkeys(catalogue(), "built in")
    plugins: list[Plugin] = []
    named = [(str(plugin.package), plugin) for plugin in installed()]
    for place, source in enumerate(sources):
        named += _of_source(source, f"plugins[{place}]")
    for origin, plugin in named:
        name, key = safe_text(origin), plugin.model.key
        _check_storable(plugin.model, name)
        if key in origins:
            raise ModelError(
                f"{name}: model {key}: there are two models of this key, the other one {origins[key]}; expected "
                "another key"
            )
        origins[key] = f"in {name}"
        plugins.append(plugin)
    return Plugins(tuple(plugins))


def _of_source(source: object, place: str) -> list[tuple[str, Plugin]]:
    """The models of a source, each with the name that messages call it by."""
    match source:
        case ForceModel():
            return [(place, Plugin(source, value_hash(source)))]
        case Source():
            return [(source.name, plugin) for plugin in _of_file(source)]
        case str() | Path():
            return [(str(source), plugin) for plugin in _of_file(_read(Path(source)))]
    raise UsageError(f"{place}: got {safe_text(repr(source))}, expected a ForceModel or the path of a Python file")


@cache
def installed() -> tuple[Plugin, ...]:
    """The models of all installed packages.

    Raises
    ------
    ModelError : a package cannot be imported, or what it names is no model; it has to be fixed or uninstalled
    """
    plugins: dict[int, Plugin] = {}
    for point in sorted(entry_points(group=GROUP), key=lambda point: (point.value, point.name)):
        for plugin in _of_entry_point(point):
            plugins.setdefault(id(plugin.model), plugin)
    return tuple(plugins.values())


def _of_entry_point(point: EntryPoint) -> list[Plugin]:
    package = f"{point.dist.name} {point.dist.version}" if point.dist else "a package without a name"
    where = safe_text(f"{package}: entry point {point.name} = {point.value}")
    try:
        loaded = point.load()
    except NOT_OF_A_PLUGIN:
        raise
    except BaseException as error:
        message = safe_text(f"{type(error).__name__}: {error}", 300)
        raise ModelError(f"{where}: {message}; expected a package that works, or none") from None
    models = _models_among(vars(loaded).values() if isinstance(loaded, ModuleType) else [loaded])
    if not models:
        raise ModelError(f"{where}: no model in it, expected a ForceModel, or a module that holds some")
    file = getattr(sys.modules.get(point.module), "__file__", None)
    sha256 = hashlib.sha256(Path(file).read_bytes()).hexdigest() if file else None
    return [Plugin(model, sha256, package=package) for model in models]


def _models_among(values: Iterable[object]) -> list[ForceModel]:
    """The models among some values, each once; one that was imported, to make others from, is left out."""
    built_in = {id(model) for model in catalogue().values()}
    models = {id(value): value for value in values if isinstance(value, ForceModel)}
    return [model for identity, model in models.items() if identity not in built_in]


def _check_storable(model: ForceModel, name: str) -> None:
    """Refuse what a result cannot hold now, not when all the work is done."""
    texts = {field: getattr(model, field) for field in ("title", "equation", "reference", "doi")}
    texts |= {f"meaning of {parameter.name}": parameter.meaning for parameter in model.parameters}
    for field, text in texts.items():
        if not isinstance(text, str) or re.search("[\0\ud800-\udfff]", text):
            raise ModelError(
                f"{name}: model {model.key}: {safe_text(field)}: got {show(text)}, expected text without NUL and "
                "lone surrogates"
            )
    if not isinstance(model.year, int) or not 0 <= model.year <= 9999:
        raise ModelError(f"{name}: model {model.key}: year: got {show(model.year)}, expected a year, such as 2026")


def _of_file(source: Source) -> list[Plugin]:
    """The models at the top level of a Python file, in their order."""
    name = safe_text(source.name)
    sha256 = hashlib.sha256(source.content).hexdigest()
    models = _models_among(vars(_executed(source, name, sha256)).values())
    if not models:
        raise ModelError(f"{name}: no model in it, expected a ForceModel at its top level")
    return [Plugin(model, sha256, source) for model in models]


def _read(path: Path) -> Source:
    """A file that may be Python."""
    name = safe_text(str(path))
    if path.suffix != ".py":
        raise UsageError(f"{name}: its name does not end in .py, expected a Python file")
    try:
        # what is not a regular file might never end
        if path.exists() and not path.is_file():
            raise UsageError(f"{name}: not a regular file, expected a Python file")
        return Source(str(path), path.read_bytes())
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise UsageError(f"{name}: cannot be read: {safe_text(reason)}") from None


def _executed(source: Source, name: str, sha256: str) -> ModuleType:
    """The module that a source is, executed; exactly the bytes that were hashed, and no bytecode is kept of them.

    Its folder is not searched for modules: a plug-in is one file, so that its hash is over all of it.
    """
    file = str(Path(source.name).absolute())
    try:
        code = compile(source.content, file, "exec", dont_inherit=True)
    except Exception as error:
        # a SyntaxError, and what the compiler raises for NUL bytes and absurd nesting
        line = getattr(error, "lineno", None) or 1
        text = safe_text((getattr(error, "text", None) or "").strip(), 60)
        message = error.msg if isinstance(error, SyntaxError) else f"{type(error).__name__}: {error}"
        raise ModelError(f"{name}:{line}: not Python: {safe_text(message)}{text and f': {text}'}") from None
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
        raise ModelError(f"{name}:{line}: {_message(error)}") from None
    return module


def _message(error: BaseException) -> str:
    """What an error of a plug-in says."""
    text = safe_text(str(error), MAX_MESSAGE)
    if isinstance(error, ImpactError):
        return text
    kind = type(error).__name__ + (f": {text}" if text else "")
    return f"{kind}; expected a file that declares models and ends" if isinstance(error, SystemExit) else kind


def value_hash(model: ForceModel) -> str | None:
    """SHA-256 over the file that defines a model's formulas, where in it they stand, and the model's other fields.

    None where that does not tell the model from another: a formula was typed into a session, takes values from
    where it was made (a closure, defaults, a callable object), or its file cannot be read.

    >>> session = {}
    >>> exec("formula = lambda elastic: elastic", session)
    >>> value_hash(ForceModel("mine", "Mine", 2026, "", "", force=session["formula"])) is None
    True
    """
    digest = hashlib.sha256()
    for name, value in vars(model).items():
        parts = value.values() if isinstance(value, Mapping) else value if isinstance(value, tuple) else (value,)
        formulas = [part for part in parts if callable(part)]
        if not formulas:
            digest.update(f"{name} = {value!r}\n".encode())
        for formula in formulas:
            code = getattr(formula, "__code__", None)
            if code is None or any(getattr(formula, held, None) for held in HELD_BY_FUNCTIONS):
                return None
            module = str(formula.__module__)
            digest.update(f"{name}: {module}.{code.co_qualname}\n".encode())
            if module.startswith("impact."):
                # the version of this program is recorded beside it
                continue
            digest.update(repr([*code.co_positions()]).encode())
            try:
                digest.update(Path(code.co_filename).read_bytes())
            except (OSError, ValueError):
                return None
    return digest.hexdigest()
