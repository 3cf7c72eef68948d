"""Results on disk: written whole or not at all, read only when they are whole."""

from __future__ import annotations

import contextlib
import math
import os
import stat
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, cast

import h5py
import xarray as xr

from ..atomic import Sink, appearing
from ..errors import ResultError, UsageError
from ..sweeps.config import Output
from ..text import safe_text
from . import guard
from .digest import content_digest
from .form import misfit
from .reader import read
from .writer import writing

PLAIN = Output()


def check_output(path: Path, *, overwrite: bool, source: Path | None = None) -> None:
    """Refuse an output that cannot be written, before any work is done; and one that is its own source.

    Raises
    ------
    UsageError : it exists and is not to be overwritten, is no regular file, or its folder cannot be written to
    """
    shown = safe_text(str(path))
    folder = path.parent
    if not folder.is_dir():
        raise UsageError(f"{shown}: the folder {safe_text(str(folder))} does not exist")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"{shown}: the folder {safe_text(str(folder))} cannot be written to")
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    except OSError as error:
        raise UsageError(f"{shown}: {error.strerror}") from None
    if not stat.S_ISREG(mode):
        raise UsageError(f"{shown}: is not a regular file, and is left alone")
    if source is not None and source.exists() and path.samefile(source):
        raise UsageError(f"{shown}: is what is read from, and is left alone")
    if not overwrite:
        raise UsageError(f"{shown}: exists; give another name, or overwrite it (--overwrite)")


def write_whole(path: Path, content: bytes | memoryview, *, overwrite: bool) -> None:
    """Write a file so that its name appears only when it is complete, and stays after a power cut.

    Raises
    ------
    UsageError : see `check_output`
    StoreError : the disk is full or failed; nothing is left under the name
    """
    check_output(path, overwrite=overwrite)
    with appearing(path, overwrite=overwrite) as sink:
        sink.write(content)


def save(dataset: xr.Dataset, path: str | Path, *, overwrite: bool = False, output: Output = PLAIN) -> None:
    """Store a dataset as netCDF-4 in HDF5.

    Parameters
    ----------
    dataset : a result, or a part of one; it is stored with the digest of what it holds
    path : the file
    overwrite : replace a file that exists
    output : how it is stored

    Raises
    ------
    UsageError : the file exists, its folder cannot be written to, or the dataset is no result
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> result = impact.sweep("configs/figure6.toml")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(result.sel(model=["gharib-hurmuzlu-2012"]), f"{folder}/one.h5")
    ...     impact.load(f"{folder}/one.h5").sizes["model"]
    1
    """
    path = Path(path)
    if "schema_version" not in dataset.attrs:
        raise UsageError(
            f"{safe_text(str(path))}: this dataset is not a result of impact: it has no schema_version"
        )
    odd = misfit(dataset)
    if odd:
        raise UsageError(f"{safe_text(str(path))}: {odd}; dataset.to_netcdf(path) stores anything")
    check_output(path, overwrite=overwrite)
    dataset = dataset.assign_attrs(content_digest=content_digest(dataset))
    with appearing(path, overwrite=overwrite) as sink:
        with writing(sink, dataset, output) as (put, seal):
            for name, one in dataset.data_vars.items():
                put(str(name), (), one.values)
            seal(str(dataset.attrs["content_digest"]))
        vet_own(sink, path)


def vet_own(sink: Sink, path: Path) -> None:
    """Refuse to give its name to a file that would not be read again."""
    try:
        with h5py.File(sink, "r") as file:
            guard.vet(file, cast(BinaryIO, sink), math.inf)
    except ResultError as error:
        raise UsageError(f"{safe_text(str(path))}: would not be read again: {error}") from None


def load(path: str | Path) -> xr.Dataset:
    """Read a result into memory and verify its content digest.

    Parameters
    ----------
    path : a file that `impact sweep` or `impact run --history` wrote

    Raises
    ------
    ResultError : it does not exist, is no result, is damaged, or is of another schema version

    Warns
    -----
    UserWarning : it holds more than a result does, which is passed over

    >>> import impact
    >>> impact.load("README.md")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    impact.errors.ResultError: README.md: is not a readable result ...
    """
    path = Path(path)
    with reading(path) as (file, stream, contents):
        dataset = read(file, stream, contents.axes)
        check(dataset, content_digest(dataset))
    if contents.unknown:
        names = safe_text(", ".join(contents.unknown))
        warnings.warn(f"{safe_text(str(path))}: passed over what is no part of a result: {names}", stacklevel=2)
    return dataset


@contextlib.contextmanager
def reading(path: Path, most: float = guard.MAX_BYTES) -> Iterator[tuple[h5py.File, BinaryIO, guard.Contents]]:
    """A file that was looked at, its bytes, and what may be read of it; `most` bytes of data at once.

    Raises
    ------
    ResultError : it is not a readable result, or turns out not to be one while it is read
    """
    shown = safe_text(str(path))
    try:
        # by its path: a signal that comes while h5py calls a Python stream is lost
        with guard.opened(path) as stream, h5py.File(path, "r", driver="sec2") as file:
            yield file, stream, guard.vet(file, stream, most)
    except ResultError as error:
        raise ResultError(f"{shown}: {error}") from None
    except MemoryError:
        raise
    except Exception as error:
        # h5py and xarray raise almost anything on a damaged file
        raise ResultError(f"{shown}: is not a readable result ({safe_text(str(error), 80)})") from error


def check(dataset: xr.Dataset, digest: str) -> None:
    """Refuse what has another digest than it carries, or is like no result.

    Raises
    ------
    ResultError : so it is
    """
    if digest != str(dataset.attrs["content_digest"]):
        raise ResultError("is damaged: its content does not have the digest that it carries")
    odd = misfit(dataset)
    if odd:
        raise ResultError(f"is not a readable result ({odd})")
