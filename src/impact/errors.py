"""The exceptions of the program, all under one root.

    ImpactError
    ├── ConfigError    the config of a sweep is invalid: all problems, one per line; a ValueError
    ├── ModelError     the definition of a contact force model is invalid
    ├── UsageError     an argument does not fit the data or the file system; a ValueError
    ├── ResultError    a file is not a readable result
    ├── MissingFileError  a file that was named does not exist: all of these three, and a FileNotFoundError
    ├── StoreError     the result could not be computed or stored; finished ranges are kept
    ├── InUseError     another process writes the output
    └── UnfinishedError  a signal stopped a sweep; finished ranges are kept

A message states the error and its location, the invalid value and the expected form. It may quote any file, name
or value: the constructor escapes what could forge a line or control a terminal. `impact.cli.exits` maps
exceptions to exit codes.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Collection, Iterable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType

from .formatting import escape_controls, safe_text

# characters of a problem; a longer one is cut in its middle, since its end says what was expected
MAX_PROBLEM = 2000
PACKAGE = str(Path(__file__).parent)


class ImpactError(Exception):
    """Base class of all expected errors; `problems` holds the lines of the message for the user, escaped.

    >>> import impact
    >>> try:
    ...     impact.run(at={"e": 1.4})
    ... except impact.ImpactError as error:
    ...     print(error)
    at["e"]: sweep.e: got 1.4, expected a number from 0 to 1
    """

    def __init__(self, *problems: str) -> None:
        # a second time changes nothing: an error may quote another one, or be copied to another process
        self.problems = tuple(_shorten(escape_controls(problem)) for problem in problems)
        super().__init__(*self.problems)

    def __str__(self) -> str:
        return "\n".join(self.problems)


def _shorten(problem: str) -> str:
    half = MAX_PROBLEM // 2
    return problem if len(problem) <= MAX_PROBLEM else f"{problem[:half]}…{problem[1 - half :]}"


class ConfigError(ImpactError, ValueError):
    """The config of a sweep is invalid; `problems` holds one line for each problem."""


class ModelError(ImpactError):
    """The definition of a contact force model is invalid, or a model is not in the catalogue."""


class UsageError(ImpactError, ValueError):
    """An argument does not fit the data or the file system: an unknown coordinate, an output that exists."""


class ResultError(ImpactError):
    """A file is not a readable result: foreign, damaged, or of another schema version."""


class MissingFileError(ConfigError, UsageError, ResultError, FileNotFoundError):
    """A file that was named does not exist: a config, a plug-in, a table of numbers or a result."""


class StoreError(ImpactError):
    """The result could not be stored: the disk is full, or the device failed."""


class InUseError(ImpactError):
    """Another process is writing the output."""


class UnfinishedError(ImpactError):
    """A sweep was stopped; the message contains the finished work that is kept."""


class ImpactWarning(UserWarning):
    """An input or a result is probably not what was intended."""


def warn(*texts: str) -> None:
    """Warn of each text, at the line outside of this package that called it."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(PACKAGE):
        frame, level = frame.f_back, level + 1
    for text in texts:
        warnings.warn(escape_controls(text), ImpactWarning, stacklevel=level)


class Interruption(BaseException):
    """A signal ends the program at once; the message contains the finished work that is kept."""


# exceptions that a plug-in does not cause, even if they are raised while it runs; Python raises KeyboardInterrupt
# for Ctrl-C inside the function that is running, so that one raised by a plug-in cannot be distinguished from it
NOT_OF_A_PLUGIN = (KeyboardInterrupt, MemoryError, Interruption)


def did_you_mean(word: str, choices: Sequence[str], synonyms: Mapping[str, str] = MappingProxyType({})) -> str:
    """End a message about an unknown name: with the most similar choice, also by a synonym, or all choices.

    >>> did_you_mean("Hetrz", ["hertz", "bilinear"]), did_you_mean("masss1", ["m1", "v1"], {"mass1": "m1"})
    ('did you mean "hertz"?', 'did you mean "m1"?')
    >>> did_you_mean("E1", ["e", "m1"])
    'known: e, m1'
    """
    if not choices:
        return "none are defined"
    spellings = {name.lower(): name for name in choices[:1000]}
    spellings |= {synonym: name for synonym, name in synonyms.items() if name in choices}
    # a name of one or two letters is near to many others: only its case may differ
    cutoff = 0.6 if len(word) > 2 else 1.0
    matches = get_close_matches(word[:64].lower(), spellings, n=1, cutoff=cutoff)
    all_choices = f"known: {', '.join(sorted(choices[:1000]))}"
    return safe_text(f'did you mean "{spellings[matches[0]]}"?' if matches else all_choices, 800)


def require_known(names: Iterable[str], known: Collection[str], what: str, where: str = "") -> None:
    """Refuse the first name that is not known, such as `no output "..." of this law`, with the nearest name."""
    for name in names:
        if name not in known:
            raise UsageError(f'{what} "{name}"{where}; {did_you_mean(name, list(known))}')
