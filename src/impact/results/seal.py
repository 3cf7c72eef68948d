"""Seals of files: 512 bytes with the format, the schema version and the SHA-256 of everything after them.

The seal is checked before the HDF5 library parses a byte, so that every changed bit and every truncation is found.
It is also the identity of a result: equal inputs give equal files within one installation.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from ..config.files import RESULT_MAGIC, file_hint
from ..errors import MissingFileError, ResultError
from .schema import SCHEMA_VERSION

# bytes at the start of an HDF5 file that the format leaves to applications: its "user block"
USER_BLOCK_BYTES = 512
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
SWEEP_AGAIN = "sweep its config again: impact sweep CONFIG.toml -o RESULT --overwrite"


def render_header(seal: str) -> bytes:
    """The first bytes of a sealed file.

    >>> render_header("0" * 64)[:24], len(render_header("0" * 64))
    (b'impact result\\nschema 2\\ns', 512)
    """
    return RESULT_MAGIC + f"schema {SCHEMA_VERSION}\nsha256 {seal}\n".encode().ljust(
        USER_BLOCK_BYTES - len(RESULT_MAGIC), b"\0"
    )


def write_seal(file: Any) -> str:
    """Seal a file that is open for reading and writing and has an empty user block; returns the seal."""
    seal = _digest(file)
    file.seek(0)
    file.write(render_header(seal))
    return seal


def check_seal(path: Path) -> str:
    """Return the seal of a file; raise a ResultError for one that is damaged or not a result of this schema."""
    if not path.exists():
        raise MissingFileError("does not exist")
    if not path.is_file():
        raise ResultError("is not a regular file")
    # also a file of the system such as /proc/kmsg, of which reading might never end
    if not path.stat().st_size:
        raise ResultError("is not a readable result (empty: it does not begin with the header of a sealed file)")
    with path.open("rb") as file:
        header = file.read(USER_BLOCK_BYTES)
        if header.startswith(HDF5_MAGIC):
            raise ResultError(
                f"is of schema version 1, or no result of impact; expected version {SCHEMA_VERSION}: {SWEEP_AGAIN}"
            )
        if not header.startswith(RESULT_MAGIC):
            no_result = "is not a readable result (it does not begin with the header of a sealed file)"
            raise ResultError(file_hint(path, header) or no_result)
        version = header[len(RESULT_MAGIC) :].partition(b"\n")[0].removeprefix(b"schema ")
        if version.isdigit() and int(version) != SCHEMA_VERSION and len(version) < 5:
            raise ResultError(
                f"has schema version {int(version)}, this program reads {SCHEMA_VERSION}; {SWEEP_AGAIN}"
            )
        seal = _digest(file)
    if header != render_header(seal):
        raise ResultError("is damaged: the SHA-256 of its content differs from its seal")
    return seal


def is_result(path: Path, begins: tuple[bytes, ...] = (RESULT_MAGIC, HDF5_MAGIC)) -> bool:
    """Check whether a file begins like a result of this schema version or, by default, of version 1."""
    if not path.is_file() or not path.stat().st_size:
        return False
    with path.open("rb") as file:
        return file.read(len(RESULT_MAGIC)).startswith(begins)


def _digest(file: Any) -> str:
    file.seek(USER_BLOCK_BYTES)
    return hashlib.file_digest(file, "sha256").hexdigest()
