"""Models of installed packages: entry points of the group `impact.models`, each a model or a module of some.

A package says in its pyproject.toml

    [project.entry-points."impact.models"]
    my-laws = "my_package.laws"

and its models are in the catalogue wherever it is installed. Packages are imported whenever models that are not
built in may be asked for, whatever a data file says: none is imported because one names it.
"""

from __future__ import annotations

import hashlib
import sys
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..errors import NOT_OF_A_PLUGIN, ModelError
from ..text import safe_text

GROUP = "impact.models"


class Installed(NamedTuple):
    """A model, the SHA-256 of the file that it was found in, no source, and the package with its version."""

    model: ForceModel
    sha256: str
    source: None
    package: str


@cache
def installed() -> tuple[Installed, ...]:
    """The models of all installed packages.

    Raises
    ------
    ModelError : a package cannot be imported, or what it names is no model; it wants to be mended or uninstalled
    """
    found: dict[int, Installed] = {}
    for point in sorted(entry_points(group=GROUP), key=lambda one: (one.value, one.name)):
        for one in _of_point(point):
            found.setdefault(id(one.model), one)
    return tuple(found.values())


def _of_point(point: EntryPoint) -> list[Installed]:
    package = f"{point.dist.name} {point.dist.version}" if point.dist else "a package without a name"
    where = safe_text(f"{package}: entry point {point.name} = {point.value}")
    try:
        loaded = point.load()
    except NOT_OF_A_PLUGIN:
        raise
    except BaseException as error:
        told = safe_text(f"{type(error).__name__}: {error}", 300)
        raise ModelError(f"{where}: {told}; wants a package that works, or none") from None
    held = vars(loaded).values() if isinstance(loaded, ModuleType) else [loaded]
    # one that it imported, to make its own from, is not its own
    known = {id(model) for model in catalogue().values()}
    models = [one for one in held if isinstance(one, ForceModel) and id(one) not in known]
    if not models:
        raise ModelError(f"{where}: no model in it, wants a ForceModel, or a module that holds some")
    file = getattr(sys.modules.get(point.module), "__file__", None)
    sha256 = hashlib.sha256(Path(file).read_bytes() if file else b"").hexdigest()
    return [Installed(model, sha256, None, package) for model in models]
