"""The door: what a command's errors become, as a line on stderr and an exit code."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable
from types import FrameType

from ..errors import ImpactError, StoreError

# the exit codes; a shell sees 130 and 143 for the signals of the same meaning
OK, USAGE, LANES_FAILED, STORAGE, INTERNAL, INTERRUPTED, TERMINATED = 0, 2, 3, 4, 70, 130, 143


def say(line: str, *, error: bool = False) -> None:
    """A line on stderr; an error is red where the terminal shows colours."""
    red = error and sys.stderr.isatty() and not os.environ.get("NO_COLOR")
    print(f"\x1b[31m{line}\x1b[0m" if red else line, file=sys.stderr)


def enter(command: Callable[[], object], *, debug: bool) -> int:
    """Run the command line and return its exit code; an error that was expected is told without a traceback."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError):
            # a locale that cannot show a formula shows its escapes, not a traceback
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    signal.signal(signal.SIGTERM, _terminated)
    try:
        command()
        return OK
    except SystemExit as leaving:
        if leaving.code == INTERRUPTED:
            say("interrupted; nothing was written", error=True)
        return _flushed(leaving.code if isinstance(leaving.code, int) else OK)
    except ImpactError as error:
        for line in str(error).splitlines():
            say(line, error=True)
        return STORAGE if isinstance(error, StoreError) else USAGE
    except BrokenPipeError:
        return _let_go(OK)
    except Exception as error:
        if debug:
            traceback.print_exc()
        else:
            say(
                f"internal error: {type(error).__name__}: {error}; report: {_report()}; --debug shows it",
                error=True,
            )
        return INTERNAL


def _flushed(code: int) -> int:
    """The exit code, with all output written."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        return _let_go(code)
    return code


def _let_go(code: int) -> int:
    """The exit code where the reader of our output has seen enough: nothing may be written at exit either."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return code


def _terminated(number: int, frame: FrameType | None) -> None:
    say("terminated; nothing was written", error=True)
    raise SystemExit(TERMINATED)


def _report() -> str:
    """The traceback in a file of its own; its name."""
    with tempfile.NamedTemporaryFile("w", prefix="impact-error-", suffix=".txt", delete=False) as file:
        traceback.print_exc(file=file)
    return file.name
