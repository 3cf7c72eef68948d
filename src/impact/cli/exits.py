"""Exit codes: what errors and signals of a command become, as a line on stderr and an exit code."""

from __future__ import annotations

import contextlib
import errno
import mmap
import os
import re
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from types import FrameType
from typing import TextIO

from typer import TyperException

from ..errors import ImpactError, Interruption, InUseError, StoreError, UnfinishedError
from ..text import safe_text

# the exit codes; a shell sees 130 and 143 for the signals of the same meaning
OK, NOT_EQUAL, USAGE, LANES_FAILED, STORAGE, IN_USE = 0, 1, 2, 3, 4, 5
INTERNAL, INTERRUPTED, TERMINATED = 70, 130, 143
CODES = {StoreError: STORAGE, InUseError: IN_USE}
# bytes that a process can always get which is not short of memory
ROOM = 2**26
# what a write fails with on a disk that is full or broken, and over a quota or a limit
NOT_WRITTEN = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}


class Interrupted(Interruption):
    """A signal came; the message says what it found done."""

    def __init__(self, number: int, done: str) -> None:
        by_user = number == signal.SIGINT
        self.code = INTERRUPTED if by_user else TERMINATED
        super().__init__(f"{'interrupted' if by_user else 'terminated'}; {done}")


@contextlib.contextmanager
def signals() -> Iterator[Callable[[], bool]]:
    """Take SIGINT and SIGTERM as flags, and give a function that returns whether one has come.

    What then ends unfinished is `Interrupted`. An exception raised by a handler can land in a callback of HDF5,
    where it is lost; a flag cannot. The third signal raises all the same, for a force that never returns.
    """
    came: list[int] = []

    def take(number: int, frame: FrameType | None) -> None:
        came.append(number)
        if len(came) > 2:
            raise Interrupted(number, "given up at once")

    before = {number: signal.signal(number, take) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(came)
    except UnfinishedError as unfinished:
        raise Interrupted(came[0], str(unfinished)) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def say(line: str, *, error: bool = False) -> None:
    """A line on stderr; an error is red where the terminal shows colours."""
    red = error and sys.stderr.isatty() and not os.environ.get("NO_COLOR")
    try:
        print(f"\x1b[31m{line}\x1b[0m" if red else line, file=sys.stderr, flush=True)
    except OSError:
        # nobody listens, or the disk is full: no reason to stop, or to end otherwise
        _let_go(sys.stderr)


def enter(command: Callable[[], object], *, debug: bool) -> int:
    """Run the command line and return its exit code; an error that was expected is printed without a traceback."""
    # a stream that was closed before we began takes what is written, and forgets it
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError):
            # a locale that cannot show a formula shows its escapes, not a traceback
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    warnings.showwarning = _note
    code = _code_of(command, debug=debug)
    try:
        # what is left in the buffer would fail at the exit of the interpreter, which has a code of its own
        sys.stdout.flush()
    except OSError as error:
        _let_go(sys.stdout)
        if error.errno in NOT_WRITTEN:
            say(f"cannot write: {error.strerror}", error=True)
            return STORAGE
    return code


def _code_of(command: Callable[[], object], *, debug: bool) -> int:
    """The exit code of the command line, whose errors are printed."""
    try:
        code = _run(command)
        sys.stdout.flush()
        return code
    except Interrupted as signalled:
        say(str(signalled), error=True)
        return signalled.code
    except TyperException as error:
        # without a message it has shown the help
        if error.format_message():
            say(_usage(error), error=True)
        return USAGE
    except ImpactError as error:
        for line in str(error).splitlines():
            say(line, error=True)
        return next((code for kind, code in CODES.items() if isinstance(error, kind)), USAGE)
    except BrokenPipeError:
        _let_go(sys.stdout)
        return OK
    except Exception as error:
        if _is_out_of_memory(error):
            say(_out_of_memory(error), error=True)
            return STORAGE
        if isinstance(error, OSError) and error.errno in NOT_WRITTEN:
            say(f"cannot write: {error.strerror}", error=True)
            return STORAGE
        if debug:
            for line in traceback.format_exc().splitlines():
                say(line)
        else:
            what = safe_text(f"{type(error).__name__}: {error}")
            say(f"internal error: {what}; report: {_report()}; --debug shows it", error=True)
        return INTERNAL


def _is_out_of_memory(error: BaseException) -> bool:
    """Whether an exception, or one that it came from, is of a lack of memory."""
    chain: BaseException | None = error
    while chain is not None:
        if isinstance(chain, MemoryError) or (isinstance(chain, OSError) and chain.errno == errno.ENOMEM):
            return True
        # a library that the loader has no room for
        if isinstance(chain, ImportError) and re.search("failed to map|[Cc]annot (allocate|apply)", str(chain)):
            return True
        chain = chain.__cause__ or chain.__context__
    # libraries fail in many ways where there is no room
    try:
        mmap.mmap(-1, ROOM).close()
    except (OSError, MemoryError):
        return True
    return False


def _out_of_memory(error: Exception) -> str:
    """One line about a lack of memory; NumPy says how much it asked for."""
    what = safe_text(str(error)) if isinstance(error, MemoryError) else ""
    return "out of memory" + (f": {what}" if what else "")


def _note(message: Warning | str, *_: object, **__: object) -> None:
    """A warning, of ours or of a library, is a line on stderr too."""
    say(f"note: {safe_text(str(message), 1000)}")


def _usage(error: TyperException) -> str:
    """What is wrong with the words of a command."""
    context = getattr(error, "ctx", None)
    at = context.command_path if context else "impact"
    message = " ".join(safe_text(error.format_message(), 1000).split())
    return f"{at}: {message.rstrip('. ')}; see {at} -h"


def _run(command: Callable[[], object]) -> int:
    """The exit code of a command, which returns it, or leaves by SystemExit, if it has one."""
    try:
        code = command()
    except SystemExit as leaving:
        if isinstance(leaving.__context__, OSError):
            # typer leaves by this when the reader of our output has gone
            raise leaving.__context__ from None
        code = leaving.code
    if code == INTERRUPTED:
        say("interrupted", error=True)
    return code if isinstance(code, int) else OK


@contextlib.contextmanager
def readers_may_leave(stream: TextIO | None = None) -> Iterator[None]:
    """Print to a reader who may have seen enough, `| head -1`: the exit code is still that of what was found."""
    stream = stream or sys.stdout
    try:
        yield
        stream.flush()
    except OSError as error:
        # of stderr nothing is missed that the exit code does not say
        if stream is not sys.stderr and not isinstance(error, BrokenPipeError):
            raise
        _let_go(stream)
    except SystemExit as leaving:
        # rich leaves by this when the reader has gone
        if not isinstance(leaving.__context__, BrokenPipeError):
            raise
        _let_go(stream)


def _let_go(stream: TextIO) -> None:
    """Nothing more can be written there: not at exit either."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _report() -> str:
    """The traceback in a file of its own; its name, or why there is none."""
    try:
        with tempfile.NamedTemporaryFile("w", prefix="impact-error-", suffix=".txt", delete=False) as file:
            traceback.print_exc(file=file)
    except OSError as error:
        return f"not written ({error.strerror})"
    return file.name
