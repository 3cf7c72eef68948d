"""The codes that laws are exported to, the release that lines are written for, and the laws that it has."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module

from ..contact.models import original_key
from ..errors import UsageError, did_you_mean
from ..formatting import argument
from .code import Code

# the modules of the codes, in their order
MODULES = (
    # scripts were run
    "lammps liggghts yade mujoco drake kratos opensees simbody pybullet exudyn newton "
    # text only
    "chrono mercurydpm modelica adams simscape physx"
)
CODES: dict[str, Code] = {
    name: replace(import_module(f".{name}", __package__).CODE, name=name) for name in MODULES.split()
}
# releases as codes write them; the text becomes part of a comment in the lines and the script
RELEASE = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+() -]{0,49}")


def find_code(name: str) -> Code:
    """Find a code by its key; the error for a word of its title names the key."""
    if name not in CODES:
        key = next((key for key, code in CODES.items() if name.lower() in code.title.lower().split()), name)
        raise UsageError(f'{argument("to")}: no code "{name}"; {did_you_mean(key, list(CODES))}')
    return CODES[name]


def read_release(code: Code, text: str, origin: str) -> str:
    """Read a version into the form in which versions are compared, and that is safe in a comment of any code."""
    try:
        if RELEASE.fullmatch(text) is None:
            raise UsageError(f'got "{text}", expected a release, such as {code.newest}')
        return code.read_version(text)
    except UsageError as error:
        raise UsageError(f"{origin}: {error}") from None


def installed_version(code: Code) -> str | None:
    """Find the version of a code that is installed here; None also for a program that reports no release."""
    with contextlib.suppress(UsageError):
        return _find_release(code, None)[1]
    return None


def _find_release(code: Code, program: str | None) -> tuple[str | None, str | None]:
    """Find what runs scripts, and its version in the form in which versions are compared."""
    path, text = code.program.find(program) if code.program else (None, None)
    return path, None if text is None else read_release(code, text, f"version of {path}")


def choose_version(
    code: Code, program: str | None, version: str | None, *, verify: bool
) -> tuple[str | None, str]:
    """Choose the program that runs scripts, None if there is none, and the version that lines are written for."""
    if version is not None:
        version = read_release(code, version, argument("code_version"))
        if not verify:
            return None, version
    must_run = verify or program is not None
    if not code.program and must_run:
        raise UsageError(f"{argument('verify')}: no script for {code.title}: {code.tested}")
    path, installed = _find_release(code, program)
    if code.program and installed is None and must_run:
        name = "" if program is None else f'"{program}": '
        raise UsageError(f"{name}no {code.title} there; {code.program.install}, or {argument('program', 'FILE')}")
    if verify and version is not None and version != installed:
        origin, verified = argument("code_version"), argument("verify")
        raise UsageError(f"{origin}: got {version}, but {installed} is what {verified} runs")
    return path, version or installed or code.newest


def law_of_code(code: Code, model: str, version: str) -> str:
    """Find the key of a code's law for a key of the catalogue, in a version of the code.

    >>> law_of_code(find_code("lammps"), "tsuji-1992", "20250722")
    'lammps-coeff-restitution-hertz'
    """
    if model not in code.laws:
        aliases = [key for key in code.laws if original_key(key) == original_key(model)]
        if not aliases:
            raise UsageError(f'{code.title} has no law "{model}"; {did_you_mean(model, list(code.laws))}')
        model = aliases[0]
    return code.law_for_version(model, version)


def has_law(code: Code, key: str, version: str, model: str | None = None) -> bool:
    """Whether a version of a code has a law as it is, or writes it for another `model` of the catalogue.

    >>> [has_law(find_code("lammps"), "lammps-tsuji", version) for version in ("20260901", "20250722")]
    [True, False]
    >>> has_law(find_code("yade"), "yade-viscoelastic", "2023.02a", "kelvin-voigt")
    True
    """
    with contextlib.suppress(UsageError):
        return original_key(law_of_code(code, model or key, version)) == original_key(key)
    return False


def first_law(code: Code, models: Sequence[str], version: str, *, is_fitted: bool = False) -> str:
    """Find the law of a code for the first of some models that a version of it has; a fitted one only as it is.

    >>> lammps = find_code("lammps")
    >>> [first_law(lammps, tuple(lammps.laws), version) for version in ("20250722", "20210929")]
    ['lammps-coeff-restitution-hertz', 'lammps-tsuji-without-root']
    """
    laws = {original_key(key) for key in code.laws}
    common = [key for key in models if original_key(key) in laws]
    for key in common:
        with contextlib.suppress(UsageError):
            law = law_of_code(code, key, version)
            if not is_fitted or has_law(code, key, version):
                return law
    if common and not is_fitted:
        return law_of_code(code, common[0], version)
    shown = ", ".join(models[:3]) + (f" and {len(models) - 3} more" if len(models) > 3 else "")
    way = "fit one of its own" if is_fitted else f"{argument('model')} names one of its own"
    # another release may have one of them
    title = f"{code.title} {version}" if common else code.title
    raise UsageError(f"{title} has none of the laws {shown}; {way}, see impact export --list")
