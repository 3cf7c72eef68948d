"""Models of one's own: values given from Python, and Python files that the command line or a caller names."""

from __future__ import annotations

import functools
import hashlib
import inspect
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..errors import NOT_OF_A_PLUGIN, ImpactError, ModelError, UsageError
from ..sweeps.values import show
from ..text import safe_text
from .installed import installed

# of the message of a plug-in's error: one that lists what is known is long
LONG = 1000


class Source(NamedTuple):
    """A Python file that was read: its name, and the content that was executed, whatever it holds now."""

    name: str
    content: bytes


@dataclass(frozen=True)
class Plugin:
    """A model that is not built in, where it is from, and what tells its versions.

    `source` is the Python file that was given, or `package` the name and version of an installed one; where both
    are None, the model was given as a value. `sha256` is over the bytes of the file, or over the value's source.
    """

    model: ForceModel
    sha256: str
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
    def hashes(self) -> dict[str, str]:
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


def read_plugins(given: Sequence[ForceModel | str | Path | Source]) -> Plugins:
    """The models of installed packages, those given, and those in the files given.

    The packages are imported and the files executed: give none that a data file names.

    Parameters
    ----------
    given : models, and Python files by their paths or as they were read elsewhere; of a file, every `ForceModel`
        at its top level is taken

    Raises
    ------
    UsageError : a file is not there, cannot be read or is no Python file
    ModelError : it, or a package, is not Python, fails, or holds no model, or one whose key is taken

    >>> law = ForceModel("mine", "Mine", 2026, "F = K δⁿ", "", force=lambda elastic: elastic)
    >>> read_plugins([law]).record["mine"]["file"] is None
    True
    """
    if isinstance(given, str | Path | ForceModel):
        raise UsageError(f"plugins: got {safe_text(repr(given))}, wants a list of such")
    read = [(one.package, [Plugin(*one)]) for one in installed()]
    for place, one in enumerate(given):
        if isinstance(one, ForceModel):
            read.append((f"plugins[{place}]", [Plugin(one, _source_hash(one))]))
        elif isinstance(one, Source):
            read.append((one.name, _of_source(one)))
        elif isinstance(one, str | Path):
            read.append((str(one), _of_source(_read(Path(one)))))
        else:
            wants = "a ForceModel or the path of a Python file"
            raise UsageError(f"plugins[{place}]: got {safe_text(repr(one))}, wants {wants}")
    origins = dict.fromkeys(catalogue(), "built in")
    for origin, plugins in read:
        name = safe_text(origin)
        for plugin in plugins:
            _check_storable(plugin.model, name)
            key = plugin.model.key
            if key in origins:
                raise ModelError(
                    f"{name}: model {key}: there are two models of this key, the other one {origins[key]}; wants "
                    "another key"
                )
            origins[key] = f"in {name}"
    return Plugins(tuple(plugin for _, plugins in read for plugin in plugins))


def _check_storable(model: ForceModel, name: str) -> None:
    """Refuse what a result cannot hold now, not when all the work is done."""
    texts = {field: getattr(model, field) for field in ("title", "equation", "reference", "doi")}
    texts |= {f"meaning of {parameter.name}": parameter.meaning for parameter in model.parameters}
    for field, text in texts.items():
        if not isinstance(text, str) or re.search("[\0\ud800-\udfff]", text):
            wants = "text without NUL and lone surrogates"
            raise ModelError(f"{name}: model {model.key}: {safe_text(field)}: got {show(text)}, wants {wants}")
    if not isinstance(model.year, int) or not 0 <= model.year <= 9999:
        raise ModelError(f"{name}: model {model.key}: year: got {show(model.year)}, wants a year, such as 2026")


def _of_source(source: Source) -> list[Plugin]:
    """The models at the top level of a Python file, in their order."""
    name = safe_text(source.name)
    sha256 = hashlib.sha256(source.content).hexdigest()
    module = _executed(source, name, sha256)
    # one that the file imported, to make its own from, is not its own
    known = {id(model) for model in catalogue().values()}
    found = {id(v): v for v in vars(module).values() if isinstance(v, ForceModel) and id(v) not in known}
    if not found:
        raise ModelError(f"{name}: no model in it, wants a ForceModel at its top level")
    return [Plugin(model, sha256, source) for model in found.values()]


def _read(path: Path) -> Source:
    """A file that may be Python."""
    name = safe_text(str(path))
    if path.suffix != ".py":
        raise UsageError(f"{name}: its name does not end in .py, wants a Python file")
    try:
        # what is not a regular file might never end
        if path.exists() and not path.is_file():
            raise UsageError(f"{name}: not a regular file, wants a Python file")
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
        raise ModelError(f"{name}:{line}: {_told(error)}") from None
    return module


def _told(error: BaseException) -> str:
    """What an error of a plug-in says."""
    text = safe_text(str(error), LONG)
    if isinstance(error, ImpactError):
        return text
    kind = type(error).__name__ + (f": {text}" if text else "")
    return f"{kind}; wants a file that declares models and ends" if isinstance(error, SystemExit) else kind


def _source_hash(model: ForceModel) -> str:
    """SHA-256 over a model's declaration: its fields, and the source of its formulas with what they close over."""
    parts: list[str] = []
    for name, value in vars(model).items():
        several = value.values() if name == "coefficients" else value if name.endswith("bends") else [value]
        parts += (_source(one) if callable(one) else repr(one) for one in several)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _source(formula: Callable[..., object], above: tuple[object, ...] = ()) -> str:
    """What tells a formula from another: its source or code, its defaults, and the values it closes over.

    `above` are the functions that close over this one, which may close over them in turn.
    """
    if any(formula is one for one in above):
        return "above"
    above = (*above, formula)
    if isinstance(formula, functools.partial):
        # its own text has an address in it, which is another in the next process
        return f"{_source(formula.func, above)}\n{formula.args!r}\n{formula.keywords!r}"
    code = getattr(formula, "__code__", None)
    if code is None:
        return repr(formula)
    try:
        text = inspect.getsource(formula)
    except (OSError, TypeError):
        text = repr((code.co_code, code.co_names, code.co_consts))
    cells = [cell.cell_contents for cell in getattr(formula, "__closure__", None) or ()]
    closed = [_source(one, above) if callable(one) else repr(one) for one in cells]
    return "\n".join([text, repr(getattr(formula, "__defaults__", None)), *closed])
