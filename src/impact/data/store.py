"""Results on disk: written whole or not at all, read only when they are whole."""

from __future__ import annotations

import contextlib
import io
import os
import stat
import warnings
from pathlib import Path
from secrets import token_hex

import h5py
import numpy as np
import xarray as xr

from ..errors import ResultError, StoreError, UsageError
from ..text import safe_text
from . import guard
from .digest import content_digest
from .form import misfit
from .reader import read


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
    part = path.with_name(f"{path.name}.{token_hex(4)}.part")
    try:
        with part.open("xb") as file:
            try:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
                _publish(part, path, overwrite=overwrite)
            finally:
                with contextlib.suppress(FileNotFoundError):
                    part.unlink()
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except FileExistsError:
        raise UsageError(f"{safe_text(str(path))}: appeared while this ran, and is left alone") from None
    except OSError as error:
        raise StoreError(
            f"{safe_text(str(path))}: not written: {error.strerror} ({len(content)} bytes)"
        ) from error


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


def save(dataset: xr.Dataset, path: str | Path, *, overwrite: bool = False) -> None:
    """Store a dataset as netCDF-4 in HDF5.

    The file is made in memory and written by plain system calls, because HDF5 on a full disk may report success.

    Parameters
    ----------
    dataset : a result, or a part of one; it is stored with the digest of what it holds
    path : the file
    overwrite : replace a file that exists

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
    # how a file that the dataset came from was packed is not how a result is stored
    dataset = dataset.drop_encoding()
    dataset = _fixed(dataset.assign_attrs(content_digest=content_digest(dataset)))
    buffer = io.BytesIO()
    plain = {name: {"_FillValue": None} for name, v in dataset.variables.items() if v.dtype.kind == "f"}
    dataset.to_netcdf(buffer, engine="h5netcdf", encoding=plain)
    try:
        with h5py.File(buffer, "r") as file:
            guard.vet(file, buffer)
    except ResultError as error:
        raise UsageError(f"{safe_text(str(path))}: would not be read again: {error}") from None
    write_whole(path, buffer.getbuffer(), overwrite=overwrite)


def _fixed(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with its attributes of text as so many bytes, a number that a reader knows beforehand."""

    def fixed(value: object) -> object:
        if not isinstance(value, str):
            return value
        written = value.encode()
        return np.array(written, h5py.string_dtype("utf-8", max(len(written), 1)))

    made = dataset.copy()
    for holder in (made, *(made[name] for name in made.variables)):
        holder.attrs = {name: fixed(value) for name, value in holder.attrs.items()}
    return made


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
    shown = safe_text(str(path))
    try:
        # by its path: a signal that comes while h5py calls a Python stream is lost
        with guard.opened(path) as stream, h5py.File(path, "r", driver="sec2") as file:
            contents = guard.vet(file, stream)
            dataset = read(file, stream, contents.axes)
        digest = content_digest(dataset)
        odd = misfit(dataset)
    except ResultError as error:
        raise ResultError(f"{shown}: {error}") from None
    except Exception as error:
        # h5py and xarray raise almost anything on a damaged file
        raise ResultError(f"{shown}: is not a readable result ({safe_text(str(error), 80)})") from error
    if digest != str(dataset.attrs["content_digest"]):
        raise ResultError(f"{shown}: is damaged: its content does not have the digest that it carries")
    if odd:
        raise ResultError(f"{shown}: is not a readable result ({odd})")
    if contents.unknown:
        names = safe_text(", ".join(contents.unknown))
        warnings.warn(f"{shown}: passed over what is no part of a result: {names}", stacklevel=2)
    return dataset


def held(path: Path, fingerprint: str) -> xr.Dataset | None:
    """What a file holds, if it is a whole result with this fingerprint."""
    if path.is_symlink() or not path.is_file():
        return None
    try:
        dataset = load(path)
    except ResultError:
        return None
    return dataset if dataset.attrs.get("fingerprint") == fingerprint else None
