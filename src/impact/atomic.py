"""Files that appear whole: what is written goes to a part, which gets its name when it is complete."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import stat
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from secrets import token_hex
from typing import Any

from .errors import StoreError, UsageError
from .text import safe_text

# what opening or syncing a folder fails with although files in it can be written and synced
NO_SYNC = {errno.EINVAL, errno.EACCES, errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EISDIR}


class Sink(io.RawIOBase):
    """A file that takes what is written to it and never fails; what went wrong is told when it is asked for.

    HDF5 on a full disk may report success, or bring the process down when it ends: it is told that all is well,
    and the first error is kept. After one, nothing more is written.
    """

    def __init__(self, path: Path, mode: str) -> None:
        self._file = io.FileIO(path, mode)
        self.error: BaseException | None = None

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET, /) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def readinto(self, buffer: Any, /) -> int:
        return self._file.readinto(buffer) or 0

    def write(self, content: Any, /) -> int:
        left = memoryview(content).cast("B")
        # one system call may take less than all
        while self.error is None and left:
            try:
                left = left[self._file.write(left) :]
            except BaseException as error:
                self.error = error
        return memoryview(content).nbytes

    def truncate(self, size: int | None = None, /) -> int:
        try:
            if self.error is None:
                self._file.truncate(size)
        except BaseException as error:
            self.error = error
        return size or 0

    def flush(self) -> None:
        pass

    def inherit(self, path: Path) -> None:
        """Take the permissions, and where it is allowed the owner and group, of a file that is to be replaced."""
        try:
            before = path.lstat()
        except FileNotFoundError:
            return
        if not stat.S_ISREG(before.st_mode):
            return
        number = self._file.fileno()
        # a file system that keeps neither is no reason to lose the output
        for uid, gid in ((-1, before.st_gid), (before.st_uid, -1)):
            with contextlib.suppress(OSError):
                os.fchown(number, uid, gid)
        with contextlib.suppress(OSError):
            os.fchmod(number, stat.S_IMODE(before.st_mode))

    def sync(self) -> None:
        """Have everything on the disk.

        Raises
        ------
        OSError : something could not be written, now or before
        """
        self.check()
        os.fsync(self._file.fileno())

    def check(self) -> None:
        """Raise what went wrong so far."""
        if self.error is not None:
            raise self.error

    def close(self) -> None:
        self._file.close()
        super().close()


@contextlib.contextmanager
def atomic_write(path: Path, *, overwrite: bool, part: Path | None = None) -> Iterator[Sink]:
    """A file to write to, which has its name when the block ends without an error, and then survives a power cut.

    Parameters
    ----------
    path : the file
    overwrite : whether it may take the place of another
    part : its name until then; by default one that no other has

    Raises
    ------
    UsageError : the file appeared meanwhile, and is not to be overwritten
    StoreError : the disk is full or failed; nothing is left under either name
    """
    shown = safe_text(str(path))
    try:
        if part is None:
            part = path.with_name(f"{path.name}.{token_hex(4)}.part")
        else:
            # what was left under this name may be a link, or another name of a whole result
            part.unlink(missing_ok=True)
        sink = Sink(part, "x+")
        try:
            if overwrite:
                sink.inherit(path)
            yield sink
            sink.sync()
            _publish(part, path, overwrite=overwrite)
        finally:
            sink.close()
            with contextlib.suppress(FileNotFoundError):
                part.unlink()
        sync_folder(path.parent)
    except FileExistsError:
        raise UsageError(f"{shown}: appeared while this ran, and is not modified") from None
    except OSError as error:
        raise StoreError(f"{shown}: not written: {error.strerror}") from error


def sync_folder(folder: Path) -> None:
    """Have the names in a folder on the disk.

    Warns
    -----
    UserWarning : the file system cannot sync a folder, or this user may not open it; the names are there anyway
    """
    try:
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)
    except OSError as error:
        if error.errno not in NO_SYNC:
            raise
        _note_unsynced(error.strerror)


@cache
def _note_unsynced(reason: str) -> None:
    """Warn once in a process, however many blocks it stores."""
    warnings.warn(
        f"folders cannot be synced here ({reason}): a power cut may undo what was just written", stacklevel=3
    )


def _publish(part: Path, path: Path, *, overwrite: bool) -> None:
    """Give a complete file its name; without `overwrite` never in the place of a file that appeared meanwhile."""
    if overwrite:
        part.replace(path)
        return
    try:
        os.link(part, path)
    except FileExistsError:
        raise
    except OSError:
        # a file system without hard links: what is left is to look before the rename
        if path.exists():
            raise FileExistsError from None
        part.rename(path)
