"""Exit codes: turns the errors and signals of a command into a line on stderr and an exit code."""

from __future__ import annotations

import contextlib
import errno
import functools
import io
import mmap
import os
import re
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import NoReturn, TextIO

from typer import TyperException

from ..errors import ImpactError, Interruption, InUseError, StoreError, UnfinishedError
from ..formatting import escape_controls, name_options, safe_text

# a shell reports 130 and 143 for a process that SIGINT or SIGTERM ended
EXIT_OK, EXIT_NOT_EQUAL, EXIT_USAGE, EXIT_POINTS_FAILED, EXIT_STORAGE, EXIT_IN_USE = 0, 1, 2, 3, 4, 5
EXIT_INTERNAL, EXIT_INTERRUPTED, EXIT_TERMINATED = 70, 130, 143
ERROR_EXIT_CODES = {StoreError: EXIT_STORAGE, InUseError: EXIT_IN_USE}
# bytes that a process can always allocate unless memory is short
PROBE_BYTES = 2**26
# errors of a write: the disk is full or broken, or a quota or a limit is exceeded
WRITE_ERRNOS = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}


class Interrupted(Interruption):
    """A signal was received; the message contains the finished work."""

    def __init__(self, number: int, done: str) -> None:
        by_user = number == signal.SIGINT
        self.code = EXIT_INTERRUPTED if by_user else EXIT_TERMINATED
        super().__init__(f"{'interrupted' if by_user else 'terminated'}; {done}")


def stop(number: int, frame: FrameType | None) -> NoReturn:
    """Handle a signal by an exception, so that programs that were started end and their folders are removed."""
    # another signal would interrupt that
    signal.signal(number, signal.SIG_IGN)
    raise Interrupted(number, "stopped immediately")


@contextlib.contextmanager
def catch_signals() -> Iterator[Callable[[], bool]]:
    """Handle SIGINT and SIGTERM by a flag; yields a function that returns whether a signal came.

    An `UnfinishedError` inside becomes `Interrupted`. A handler does not raise, because an exception inside a
    callback of HDF5 is lost. Only the third signal raises, for a force function that never returns.
    """
    came: list[int] = []

    def take(number: int, frame: FrameType | None) -> None:
        came.append(number)
        if len(came) > 2:
            stop(number, frame)

    before = {number: signal.signal(number, take) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(came)
    except UnfinishedError as unfinished:
        raise Interrupted(came[0], str(unfinished)) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def print_line(line: str, *, error: bool = False) -> None:
    """Print a line on stderr, escaped; an error is red if the terminal shows colours."""
    line = escape_controls(line)
    red = error and sys.stderr.isatty() and not os.environ.get("NO_COLOR")
    try:
        print(f"\x1b[31m{line}\x1b[0m" if red else line, file=sys.stderr, flush=True)
    except OSError:
        # the reader is gone or the disk is full: neither ends the command or changes its exit code
        _discard_output(sys.stderr)


def write_utf8() -> None:
    """Write what other programs read on stdout, such as XML, in UTF-8 as in files, unless it is a terminal."""
    # in a notebook or a test it may be another object
    if isinstance(sys.stdout, io.TextIOWrapper) and not sys.stdout.isatty():
        sys.stdout.reconfigure(encoding="utf-8", errors="backslashreplace")


def print_written(*paths: Path | None) -> None:
    """Name the files that were written, on stderr."""
    for path in filter(None, paths):
        print_line(f"{path}: written")


def run_command_line(command: Callable[[], object], *, debug: bool) -> int:
    """Run the command line and return its exit code; expected errors are printed without a traceback."""
    name_options()
    # output to a stream that was closed before the start is discarded
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError):
            # a locale that cannot encode a formula shows escapes instead of a traceback
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    # each line once: the filters of `warnings` forget what was shown when a library changes them
    print_once = functools.cache(print_line)
    warnings.showwarning = lambda message, *_, **__: print_once(f"note: {safe_text(str(message), 1000)}")
    code = _exit_code(command, debug=debug)
    try:
        # a failing flush at the exit of the interpreter would change the exit code
        sys.stdout.flush()
    except OSError as error:
        _discard_output(sys.stdout)
        if error.errno in WRITE_ERRNOS:
            print_line(f"cannot write: {error.strerror}", error=True)
            return EXIT_STORAGE
    return code


def _exit_code(command: Callable[[], object], *, debug: bool) -> int:
    """Run the command line, print its errors, and return its exit code."""
    try:
        code = _call_command(command)
        sys.stdout.flush()
        return code
    except Interrupted as signalled:
        print_line(str(signalled), error=True)
        return signalled.code
    except TyperException as error:
        # without a message the help was shown
        if error.format_message():
            print_line(_usage_message(error), error=True)
        return EXIT_USAGE
    except ImpactError as error:
        for problem in error.problems:
            print_line(problem, error=True)
        return next((code for kind, code in ERROR_EXIT_CODES.items() if isinstance(error, kind)), EXIT_USAGE)
    except BrokenPipeError:
        _discard_output(sys.stdout)
        return EXIT_OK
    except Exception as error:
        if _is_out_of_memory(error):
            # with the size that NumPy tried to allocate
            size = f": {safe_text(str(error))}" if isinstance(error, MemoryError) and str(error) else ""
            print_line(f"out of memory{size}", error=True)
            return EXIT_STORAGE
        # `tempfile` finds no folder to which it can write, such as on a full disk
        lacks_folder = str(getattr(error, "strerror", "")).startswith("No usable temporary directory")
        if isinstance(error, OSError) and (error.errno in WRITE_ERRNOS or lacks_folder):
            print_line(f"cannot write: {error.strerror}", error=True)
            return EXIT_STORAGE
        library, reason = _library_at_import(error), safe_text(f"{type(error).__name__}: {error}")
        if debug:
            for line in traceback.format_exc().splitlines():
                print_line(line)
        elif library:
            print_line(f"{library} cannot be imported: {reason}", error=True)
        else:
            print_line(f"internal error: {reason}; report: {_write_traceback()}; --debug shows it", error=True)
        return EXIT_USAGE if library else EXIT_INTERNAL


def _library_at_import(error: BaseException) -> str | None:
    """Find the library whose import failed, such as one that refuses an environment variable."""
    frames = (frame for frame, _ in traceback.walk_tb(error.__traceback__) if frame.f_code.co_name == "<module>")
    # code of exec and eval has this name, too, but belongs to no module that is imported
    names = (frame.f_globals["__name__"].partition(".")[0] for frame in frames if frame.f_globals.get("__spec__"))
    return next((name for name in names if name != "impact"), None)


def _is_out_of_memory(error: BaseException) -> bool:
    """Whether an exception, or one of its causes, is a lack of memory."""
    chain: BaseException | None = error
    while chain is not None:
        if isinstance(chain, MemoryError) or (isinstance(chain, OSError) and chain.errno == errno.ENOMEM):
            return True
        # the loader has no memory for a library
        if isinstance(chain, ImportError) and re.search("failed to map|[Cc]annot (allocate|apply)", str(chain)):
            return True
        chain = chain.__cause__ or chain.__context__
    # libraries fail in many ways without memory
    try:
        mmap.mmap(-1, PROBE_BYTES).close()
    except (OSError, MemoryError):
        return True
    return False


def _usage_message(error: TyperException) -> str:
    context = getattr(error, "ctx", None)
    at = context.command_path if context else "impact"
    message = " ".join(safe_text(error.format_message(), 1000).split())
    return f"{at}: {message.rstrip('. ')}; see {at} -h"


def _call_command(command: Callable[[], object]) -> int:
    """Run a command; returns its exit code, which it returns or raises as SystemExit."""
    try:
        code = command()
    except SystemExit as leaving:
        if isinstance(leaving.__context__, OSError):
            # typer exits this way when the reader of the output is gone
            raise leaving.__context__ from None
        code = leaving.code
    if code == EXIT_INTERRUPTED:
        print_line("interrupted", error=True)
    return code if isinstance(code, int) else EXIT_OK


@contextlib.contextmanager
def ignore_broken_pipe(stream: TextIO | None = None) -> Iterator[None]:
    """Print to a reader that may close the pipe, such as `head -1`, without changing the exit code."""
    stream = stream or sys.stdout
    try:
        yield
        stream.flush()
    except OSError as error:
        # output to stderr is optional: the exit code has the same meaning
        if stream is not sys.stderr and not isinstance(error, BrokenPipeError):
            raise
        _discard_output(stream)
    except SystemExit as leaving:
        # rich exits this way when the reader is gone
        if not isinstance(leaving.__context__, BrokenPipeError):
            raise
        _discard_output(stream)


def _discard_output(stream: TextIO) -> None:
    """Redirect a stream to the null device, so that later writes do not fail."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _write_traceback() -> str:
    """Write the traceback to a temporary file; returns its name, or why it was not written."""
    try:
        with tempfile.NamedTemporaryFile("w", prefix="impact-error-", suffix=".txt", delete=False) as file:
            traceback.print_exc(file=file)
    except OSError as error:
        return f"not written ({error.strerror})"
    return file.name
