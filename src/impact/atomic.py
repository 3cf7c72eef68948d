"""Atomic writes: a file is written under a temporary name, and renamed when it is complete and on the disk."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import re
import stat
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from secrets import token_hex
from typing import Any

from .errors import StoreError, UsageError
from .formatting import argument, safe_text

try:
    import fcntl
except ImportError:  # Windows: files are not locked, and none is removed
    fcntl = None  # type: ignore[assignment]

# errors of opening or syncing a folder on file systems where files can still be written and synced
UNSYNCABLE_ERRNOS = {
    errno.EINVAL,
    errno.EACCES,
    errno.EPERM,
    errno.ENOTSUP,
    errno.EOPNOTSUPP,
    errno.ENOSYS,
    errno.EISDIR,
}
# endings of the names of files that this program reads or writes, and that are no results
FILE_SUFFIXES = (".toml", ".json", ".py", ".csv", ".tex", ".parquet", ".html", ".htm")
PICTURE_SUFFIXES = (".png", ".svg", ".pdf", ".eps", ".pgf", ".gif")
# age of a temporary file from which on it may be left by a process that was killed
MIN_STALE_S = 60.0
# longest wait for other processes that give files of a folder their names
MAX_PUBLISH_S = 1.0


class Sink(io.FileIO):
    """A new file that records the first I/O error instead of raising it; `check` raises it.

    HDF5 on a full disk may report success, or crash the process at its end. So writes always report success here,
    and after the first error nothing more is written.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path, "x+")
        self.error: BaseException | None = None

    def write(self, content: Any, /) -> int:
        remaining = memoryview(content).cast("B")
        # a system call may write only a part
        while self.error is None and remaining:
            try:
                remaining = remaining[super().write(remaining) :]
            except BaseException as error:
                self.error = error
        return memoryview(content).nbytes

    def truncate(self, size: int | None = None, /) -> int:
        try:
            if self.error is None:
                super().truncate(size)
        except BaseException as error:
            self.error = error
        return size or 0

    def flush(self) -> None:
        pass

    def inherit(self, path: Path) -> None:
        """Copy the permissions, and where allowed the owner and group, of the file that is to be replaced."""
        try:
            replaced = path.lstat()
        except FileNotFoundError:
            return
        if not stat.S_ISREG(replaced.st_mode):
            return
        descriptor = self.fileno()
        # a file system without owners or permissions must not prevent the output, nor Windows
        for uid, gid in ((-1, replaced.st_gid), (replaced.st_uid, -1)):
            with contextlib.suppress(OSError, AttributeError):
                os.fchown(descriptor, uid, gid)
        with contextlib.suppress(OSError, AttributeError):
            os.fchmod(descriptor, stat.S_IMODE(replaced.st_mode))

    def lock(self) -> None:
        """Mark the file as in use until `finish` or the end of the process, where files can be locked."""
        with contextlib.suppress(OSError, AttributeError):
            fcntl.flock(self.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)

    def finish(self) -> None:
        """Close the file, as Windows needs to rename it; a recent time of change protects it until then."""
        with contextlib.suppress(OSError, TypeError):
            os.utime(self.fileno())
        self.close()

    def check(self) -> None:
        """Raise the first error, if any."""
        if self.error is not None:
            raise self.error


@contextlib.contextmanager
def atomic_write(
    path: Path, *, overwrite: bool, part: Path | None = None, check: Callable[[], None] = lambda: None
) -> Iterator[Sink]:
    """Open a file that gets its name when the block ends without an error, and then survives a power cut.

    Parameters
    ----------
    path : the file
    overwrite : whether it may replace another file
    part : the temporary name; by default a unique one, and files that killed processes left under such names are
        removed
    check : called just before the file gets its name, by one process at a time; an exception prevents it

    Raises
    ------
    UsageError : the file was created by another process meanwhile, and `overwrite` is not set
    StoreError : the disk is full or failed; no file is left under either name, unless the message says that the
        file is written
    """
    try:
        if part is None:
            _remove_stale_parts(path)
            part = path.with_name(f"{path.name}.{token_hex(4)}.part")
        else:
            # a file left under this name may be a link, or a hard link to a complete result
            part.unlink(missing_ok=True)
        sink = Sink(part)
        try:
            if overwrite:
                sink.inherit(path)
            sink.lock()
            yield sink
            sink.check()
            os.fsync(sink.fileno())
            sink.finish()
            with _alone_in(path.parent):
                check()
                _publish(part, path, overwrite=overwrite)
        finally:
            sink.close()
            with contextlib.suppress(FileNotFoundError):
                part.unlink()
    except FileExistsError:
        raise UsageError(f"{path}: was created by another process, and is not modified") from None
    except OSError as error:
        raise StoreError(f"{path}: not written: {error.strerror}") from error
    try:
        sync_folder(path.parent)
    except OSError as error:
        raise StoreError(
            f"{path}: written, but its name may not be on the disk: {error.strerror}; a power cut may undo it"
        ) from error


@contextlib.contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Wait until no other process publishes a file in a folder, where folders can be locked, for a time."""
    with contextlib.ExitStack() as at_end:
        with contextlib.suppress(OSError, AttributeError):
            descriptor = os.open(folder, os.O_RDONLY)
            at_end.callback(os.close, descriptor)
            # a script may have locked the folder for all of this command
            end = time.monotonic() + MAX_PUBLISH_S
            while time.monotonic() < end:
                with contextlib.suppress(BlockingIOError):
                    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    break
                time.sleep(0.005)
        yield


def check_output(path: Path, *sources: Path, overwrite: bool) -> None:
    """Raise a UsageError, before any work, for an output that cannot be written or is a file to be read."""
    folder = path.parent
    if not os.path.isdir(folder):
        raise UsageError(f"{path}: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"{path}: the folder {folder} cannot be written to")
    _check_name_length(path)
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    if not stat.S_ISREG(mode):
        raise UsageError(f"{path}: is not a regular file, and is not modified")
    if any(os.path.exists(source) and path.samefile(source) for source in sources):
        raise UsageError(f"{path}: is the file to be read, and is not modified")
    if not overwrite:
        raise UsageError(f"{path}: exists; give another name, or overwrite it ({argument('overwrite', True)})")


def check_outputs(outputs: Iterable[str | Path | None], inputs: Iterable[object], *, overwrite: bool) -> None:
    """Check several outputs, but those that are None, against each path among the inputs; see `check_output`."""
    paths = [Path(output) for output in outputs if output is not None]
    sources = [Path(source) for source in inputs if isinstance(source, str | Path)]
    for path in paths:
        check_output(path, *sources, overwrite=overwrite)
    for path in {path for path in paths if paths.count(path) > 1}:
        raise UsageError(f"{path}: is named for two outputs")


def check_result_name(path: str | Path | None) -> None:
    """Raise a UsageError, before any work, for a result with a name of another kind of file, such as a table."""
    if path is not None and Path(path).suffix.lower() in FILE_SUFFIXES + PICTURE_SUFFIXES:
        example = safe_text(Path(path).with_suffix(".h5").name, 60)
        tables = "impact plot --data and to_dataframe make tables"
        raise UsageError(f"{path}: expected the name of a result, such as {example}; {tables}")


def _check_name_length(path: Path) -> None:
    """Refuse a name that is too long for the temporary files next to it, such as RESULT.12345678.part."""
    try:
        most = os.pathconf(path.parent, "PC_NAME_MAX") - len(".12345678.part")
    except (OSError, ValueError, AttributeError):
        return
    length = len(os.fsencode(path.name))
    if length > most:
        raise UsageError(f"{safe_text(str(path), 60)}: got a name of {length} bytes, expected at most {most}")


def write_file(path: Path, content: bytes | memoryview, *, overwrite: bool) -> None:
    """Write a file atomically: its name appears when it is complete, and it survives a power failure."""
    check_output(path, overwrite=overwrite)
    with atomic_write(path, overwrite=overwrite) as sink:
        sink.write(content)


def _remove_stale_parts(path: Path) -> None:
    """Remove temporary files of an output that a killed process left: old, and locked by no process."""
    name = re.compile(re.escape(path.name) + r"\.[0-9a-f]{8}\.part")
    # a folder may be writable and not readable
    with contextlib.suppress(OSError):
        for part in [part for part in path.parent.iterdir() if name.fullmatch(part.name)]:
            with contextlib.suppress(OSError, AttributeError):
                status = part.lstat()
                if stat.S_ISREG(status.st_mode) and time.time() - status.st_mtime > MIN_STALE_S:
                    with part.open("rb") as file:
                        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                        part.unlink()


def sync_folder(folder: Path) -> None:
    """Flush the names in a folder to the disk.

    Warns
    -----
    UserWarning : the file system cannot sync folders, or the user may not open it; the names exist nevertheless
    """
    if os.name == "nt":
        # which opens no folders
        return
    try:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        if error.errno not in UNSYNCABLE_ERRNOS:
            raise
        _warn_unsynced(error.strerror)


@cache
def _warn_unsynced(reason: str) -> None:
    """Warn once per process."""
    warnings.warn(
        f"folders cannot be synced here ({reason}): a power cut may undo what was just written", stacklevel=3
    )


def _publish(part: Path, path: Path, *, overwrite: bool) -> None:
    """Rename a complete file; without `overwrite`, never over a file that was created meanwhile."""
    if overwrite:
        part.replace(path)
        return
    try:
        os.link(part, path)
    except OSError:
        # the file exists; or the file system has no hard links: check for the file, then rename
        if os.path.lexists(path):
            raise FileExistsError from None
        part.rename(path)
