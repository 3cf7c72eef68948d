"""Compiled code on disk: numba's cache of functions, with checksums, and without failures."""

from __future__ import annotations

import hashlib
import pickle
import warnings
from contextlib import suppress
from functools import cache

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile

DIGEST_BYTES = hashlib.sha256().digest_size


class DamagedError(Exception):
    """The content of a cache file differs from what was written."""


class CheckedFile(IndexDataCacheFile):
    """The cache files of a function, each with its SHA-256: damaged machine code could crash the process."""

    def _dump(self, obj):
        content = super()._dump(obj)
        return hashlib.sha256(content).digest() + content

    def _load_index(self):
        try:
            with open(self._index_path, "rb") as file:
                version, content = pickle.load(file), file.read()
        except FileNotFoundError:
            return {}
        except Exception as error:
            raise DamagedError from error
        if version != self._version:
            return {}
        stamp, overloads = _unpickle_checked(content)
        return overloads if stamp == self._source_stamp else {}

    def _load_data(self, name):
        with open(self._data_path(name), "rb") as file:
            return _unpickle_checked(file.read())


def _unpickle_checked(content):
    if hashlib.sha256(content[DIGEST_BYTES:]).digest() != content[:DIGEST_BYTES]:
        raise DamagedError
    return pickle.loads(content[DIGEST_BYTES:])


class CheckedCache(FunctionCache):
    """The cache of a function; damaged code is compiled again, and a failure to store it is only a warning."""

    def __init__(self, function):
        super().__init__(function)
        # these names differ from those of files without a checksum
        self._cache_file = CheckedFile(
            cache_path=self._cache_path,
            filename_base=f"{self._impl.filename_base}-sha256",
            source_stamp=self._impl.locator.get_source_stamp(),
        )

    def load_overload(self, sig, target_context):
        try:
            return super().load_overload(sig, target_context)
        except DamagedError:
            _warn_once(f"compiled code in {self._cache_path} is damaged and is compiled again")
            with suppress(OSError):
                self.flush()
        except OSError as error:
            _warn_once(
                f"compiled code in {self._cache_path} cannot be read ({error.strerror}) and is compiled again"
            )
        return None

    def save_overload(self, sig, data):
        try:
            super().save_overload(sig, data)
        except (DamagedError, OSError) as error:
            _warn_once(f"compiled code is not kept in {self._cache_path}: {getattr(error, 'strerror', 'damaged')}")


def cache_folder() -> str | None:
    """Find the folder of the compiled code of this package, None where no folder can be written to."""
    try:
        return str(CheckedCache(cache_folder).cache_path)
    except (RuntimeError, OSError):
        return None


def compiled(function, **options):
    """As `numba.njit`, with the machine code in a cache on disk where possible."""
    dispatcher = njit(**options)(function)
    # with NUMBA_DISABLE_JIT=1 njit returns the function itself
    if dispatcher is not function:
        try:
            dispatcher._cache = CheckedCache(function)
        except (RuntimeError, OSError):
            _warn_once("compiled code is not kept: no folder for it can be written to; NUMBA_CACHE_DIR names one")
    return dispatcher


@cache
def _warn_once(text):
    warnings.warn(text, stacklevel=2)
