"""What this program runs with: versions of packages, the compiled core, and the codes that are installed."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import Any

from .._version import __version__
from ..contact.numba.dispatch import is_installed
from ..display import Block, Displayed, Table
from .programs import find_program, package_version
from .registry import CODES, installed_version

DISTRIBUTION = "impact-sweep"
# a package that users of the program may need: its name, unless an extra for development requires it
PACKAGE = re.compile(rf"(?!{DISTRIBUTION})([\w.-]+)(?!.*extra == ['\"](?:dev|peers|site)['\"])")


@dataclass(frozen=True)
class Environment(Displayed):
    """Versions of what is installed here.

    Parameters
    ----------
    impact, python, platform : the program, the interpreter, and the system
    packages : version of each package that the program can use; None for one that is not installed
    core : version of "numba", and "cache", the folder of its machine code; both None without the compiled core
    codes : "code", "version" and "program" of each simulation code that scripts run in; None if it is not there
    """

    impact: str
    python: str
    platform: str
    packages: dict[str, str | None]
    core: dict[str, str | None]
    codes: list[dict[str, str | None]]

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)

    def sections(self, width: int) -> Iterator[Block]:
        yield Table([("impact", self.impact), ("Python", self.python), ("system", self.platform)])
        yield ""
        rows = [(name, version or "not installed") for name, version in self.packages.items()]
        yield Table(rows, ("package", "version"), text=(0, 1))
        yield ""
        if self.core["numba"] is None:
            yield "compiled core: none; pip install 'impact-sweep[fast]'"
        else:
            yield f"compiled core: numba {self.core['numba']}, machine code in {self.core['cache'] or 'no folder'}"
        yield ""
        codes = [(code["code"], code["version"] or "not installed", code["program"] or "") for code in self.codes]
        yield Table(codes, ("code", "version", "program"), text=(0, 1, 2))


def doctor() -> Environment:
    """Find the versions of this program, of its packages and of the simulation codes that are installed.

    Returns
    -------
    Environment : versions by name, None for what is not installed

    >>> import impact
    >>> found = impact.doctor()
    >>> found.impact == impact.__version__ and found.packages["numpy"] is not None
    True
    """
    # a source tree that is not installed is no distribution, and requires nothing
    installed = metadata.distributions(name=DISTRIBUTION)
    required = (PACKAGE.match(words) for distribution in installed for words in distribution.requires or ())
    packages = {name[1]: package_version(name[1]) for name in required if name}
    codes = []
    for code in CODES.values():
        if code.program:
            version = installed_version(code)
            program = find_program(code.program.name) if version else None
            codes.append({"code": code.name, "version": version, "program": program})
    core: dict[str, str | None] = {"numba": None, "cache": None}
    if is_installed():
        from ..contact.numba.compile_cache import cache_folder

        core = {"numba": package_version("numba"), "cache": cache_folder()}
    return Environment(__version__, platform.python_version(), platform.platform(), packages, core, codes)
