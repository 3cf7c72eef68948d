"""The exceptions of the program, all under one root.

    ImpactError
    ├── ConfigError    the sweep asked for cannot be run: every problem, one a line
    ├── ModelError     a contact force model is declared wrongly
    ├── UsageError     a request that the data or the file system cannot meet as it was put
    ├── ResultError    a file is not a readable result
    ├── StoreError     the result could not be stored, or not computed; what was finished is kept
    ├── InUseError     another process writes the output
    └── UnfinishedError  a signal ended a sweep; what was finished is kept

They say what is wrong, where, what was got and what is wanted. They become exit codes in one place,
`impact.cli.exits`.
"""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches

from .text import safe_text


class ImpactError(Exception):
    """The root: an error that the program expected, with a message for its user.

    >>> import impact
    >>> try:
    ...     impact.run(at={"e": 1.4})
    ... except impact.ImpactError as error:
    ...     print(error)
    --at e=1.4: sweep.e: got 1.4, expected a number from 0 to 1
    """


class ConfigError(ImpactError):
    """The config of a sweep has problems; `problems` holds one line for each."""

    def __init__(self, problems: Sequence[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(self.problems))


class ModelError(ImpactError):
    """A contact force model is declared wrongly, or is not in the catalogue."""


class UsageError(ImpactError):
    """A request that cannot be met as it was put: an unknown coordinate, an output that exists."""


class ResultError(ImpactError):
    """A file is not a readable result: foreign, damaged, or of another schema version."""


class StoreError(ImpactError):
    """The result could not be stored: the disk is full, or the device failed."""


class InUseError(ImpactError):
    """Another process is writing the output."""


class UnfinishedError(ImpactError):
    """A sweep was told to stop; what it has finished is kept, as the message says."""


class Interruption(BaseException):
    """A signal ends the program at once; the message says what is kept."""


# exceptions that are never the fault of a plug-in, whatever it was doing when they were raised
NOT_OF_A_PLUGIN = (KeyboardInterrupt, GeneratorExit, MemoryError, Interruption)


def did_you_mean(word: str, known: Sequence[str]) -> str:
    """The end of a message about an unknown name: the nearest known one, else all of them.

    >>> did_you_mean("hetrz", ["hertz", "bilinear"])
    'did you mean "hertz"?'
    >>> did_you_mean("x", ["hertz", "bilinear"])
    'known: bilinear, hertz'
    """
    near = get_close_matches(word, known, n=1, cutoff=0.6)
    return safe_text(f'did you mean "{near[0]}"?' if near else f"known: {', '.join(sorted(known))}", 800)
