"""What is checked of a file before the HDF5 library reads it: its seal, and the structures that it follows.

The seal is 512 bytes with the format, the schema version and the SHA-256 of everything after them, so that every
changed bit and every truncation is found. It is also the identity of a result: equal inputs give equal files
within one installation.

In a malicious file a B-tree, a header or a type may contain itself, or a B-tree more records than it declares; the
library then recurses until the process is killed, or writes beyond its memory. Files of this program have only a
few of the structures of the format (version 3 of its specification): groups of the second version, and chunks that
are indexed by a B-tree of version 1. All others are refused, and these are followed here first. Addresses are
relative to the end of the user block.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import itertools
import math
import re
import struct
from bisect import bisect_right
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..config.files import RESULT_MAGIC, file_hint
from ..errors import MissingFileError, ResultError
from ..formatting import argument, safe_text
from .schema import SCHEMA_VERSION

# bytes at the start of an HDF5 file that the format leaves to applications: its "user block"
USER_BLOCK_BYTES = 512
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
SWEEP_AGAIN = "sweep its config again: impact sweep CONFIG.toml -o RESULT --overwrite"

# returns bytes of a file: `read(address, size)`
ReadBytes = Callable[[int, int], bytes]

UNDEFINED = 2**64 - 1
# limits that are far above every result
MAX_HEADER_BYTES = 2**22
MAX_NODE_BYTES, MAX_B_TREE_2_DEPTH = 2**16, 4
MAX_CHUNK_ENTRIES = 64  # of a node; fixed by superblocks of version 0
# types of messages in the header of an object
LINK_INFO, LAYOUT, ATTRIBUTE, CONTINUATION, SYMBOL_TABLE, ATTRIBUTE_INFO = 0x02, 0x08, 0x0C, 0x10, 0x11, 0x15
IS_SHARED = 2  # flag of a message that is stored elsewhere
IS_STORED_ELSEWHERE = 3  # flags of the type and the shape of an attribute
CHUNKED = 2
IN_BLOCK, HUGE = 0, 1  # where an object of a heap is stored

# versions, sizes of offsets and lengths, base address, driver, root object and what is cached of it
SUPERBLOCK = struct.Struct("<8sB4xBB9xQ16xQ8xQI")
# signature, bytes of filters, address of the B-tree of huge objects; blocks in a row, sizes of the first and the
# largest blocks, bits of an offset, address of the root, rows of blocks
FRACTAL_HEAP = struct.Struct("<4s3xH13xQ80xHQQH2xQH")
# signature, bytes of a node and of a record, depth, address of the root, its records, all records
B_TREE_2 = struct.Struct("<4s2xIHH2xQHQ")
# signature, type, level, number of entries
B_TREE_1 = struct.Struct("<4sBBH16x")


def render_header(seal: str) -> bytes:
    """The first bytes of a sealed file.

    >>> render_header("0" * 64)[:24], len(render_header("0" * 64))
    (b'impact result\\nschema 2\\ns', 512)
    """
    return (RESULT_MAGIC + f"schema {SCHEMA_VERSION}\nsha256 {seal}\n".encode()).ljust(USER_BLOCK_BYTES, b"\0")


def write_seal(file: Any) -> str:
    """Seal a file that is open for reading and writing and has an empty user block; returns the seal."""
    seal = digest(file)
    file.seek(0)
    file.write(render_header(seal))
    return seal


def check_seal(path: Path) -> str:
    """Return the seal of a file; raise a ResultError for one that is damaged or not a result of this schema."""
    if not path.is_file():
        raise _error_without_file(path)
    # also a file of the system such as /proc/kmsg, of which reading might never end
    if not path.stat().st_size:
        raise ResultError("is not a readable result (empty: it does not begin with the header of a sealed file)")
    with path.open("rb") as file:
        header = file.read(USER_BLOCK_BYTES)
        if header.startswith(HDF5_MAGIC):
            raise ResultError(
                "is of schema version 1, or no result of impact, such as a file of to_netcdf in place of "
                f"impact.save; expected version {SCHEMA_VERSION}: {SWEEP_AGAIN}"
            )
        if not header.startswith(RESULT_MAGIC):
            no_result = "is not a readable result (it does not begin with the header of a sealed file)"
            raise ResultError(file_hint(path, header) or no_result)
        version = header[len(RESULT_MAGIC) :].partition(b"\n")[0].removeprefix(b"schema ")
        if version.isdigit() and int(version) != SCHEMA_VERSION and len(version) < 5:
            raise ResultError(
                f"has schema version {int(version)}, this program reads {SCHEMA_VERSION}; {SWEEP_AGAIN}"
            )
        seal = digest(file)
    if header != render_header(seal):
        raise ResultError("is damaged: the SHA-256 of its content differs from its seal")
    return seal


def _error_without_file(path: Path) -> ResultError:
    """Make the error of a path that is no file; a sweep may have left work there, or beside it."""
    # few readers of a result need a lock
    from ..engine.checkpoint import PLAN_FILE, work_folder_of

    resumed = f"which impact sweep continues with {argument('resume', True)}"
    if not path.exists():
        work = work_folder_of(path)
        hint = f"; {work.name} has its unfinished work, {resumed}" if (work / PLAN_FILE).is_file() else ""
        return MissingFileError(f"does not exist{hint}")
    if path.suffix == ".work" and (path / PLAN_FILE).is_file():
        if re.search(r"\.[0-9]+-of-[0-9]+$", path.stem):
            return ResultError("is a part of a sweep, which impact merge joins with the others")
        return ResultError(f"is the unfinished work of {path.stem}, {resumed}")
    return ResultError("is not a regular file")


def has_seal(path: Path, seal: str) -> bool:
    """Check whether a file is the intact result of a seal, whatever else it may be."""
    try:
        return check_seal(path) == seal
    except ResultError:
        return False


def is_result(path: Path, begins: tuple[bytes, ...] = (RESULT_MAGIC, HDF5_MAGIC)) -> bool:
    """Check whether a file begins like a result of this schema version or, by default, of version 1."""
    # what cannot be opened is no result, and whatever reads it says why
    with contextlib.suppress(OSError, ValueError):
        if path.is_file() and path.stat().st_size:
            with path.open("rb") as file:
                return file.read(len(RESULT_MAGIC)).startswith(begins)
    return False


def digest(file: Any) -> str:
    """Compute what the seal of a file has to be."""
    file.seek(USER_BLOCK_BYTES)
    return hashlib.file_digest(file, "sha256").hexdigest()


def byte_reader(file: Any) -> ReadBytes:
    """Return a function that reads bytes of a file behind its user block."""

    def read(address: int, size: int) -> bytes:
        file.seek(USER_BLOCK_BYTES + address)
        content: bytes = file.read(size)
        if len(content) < size:
            raise ValueError
        return content

    return read


def check_root(read: ReadBytes) -> None:
    """Raise a ResultError unless the superblock and the root group are as this program writes them."""
    try:
        magic, version, *sizes, base, driver, root, cached = SUPERBLOCK.unpack(read(0, SUPERBLOCK.size))
        expected = (HDF5_MAGIC, 0, [8, 8], USER_BLOCK_BYTES, UNDEFINED, 0)
        if (magic, version, sizes, base, driver, cached) != expected:
            raise ValueError
    except (ValueError, OverflowError, OSError, struct.error):
        raise ResultError("is not a readable result (not an HDF5 file as this program writes it)") from None
    check_object(read, root)


def check_object(read: ReadBytes, address: int, name: str = "") -> int | None:
    """Count the stored chunks of an object; raise a ResultError for another structure than this program's."""
    chunks = None
    try:
        for kind, flags, body in _messages(read, address):
            if flags & IS_SHARED or kind == SYMBOL_TABLE:
                raise ValueError
            if kind in (LINK_INFO, ATTRIBUTE_INFO):
                _check_dense_storage(read, body, kind)
            elif kind == ATTRIBUTE:
                _check_attribute(body)
            elif kind == LAYOUT:
                chunks = _count_stored_chunks(read, body)
    except (ValueError, OverflowError, OSError, struct.error, IndexError, ZeroDivisionError):
        what = f"{safe_text(name, 40)}{': ' if name else ''}a structure that this program does not write"
        raise ResultError(f"is not a readable result ({what})") from None
    return chunks


def _messages(read: ReadBytes, address: int) -> Iterator[tuple[int, int, bytes]]:
    """Yield the messages of the header of an object: type, flags, content."""
    head = read(address, 16)
    is_second_version = head[:4] == b"OHDR"
    if is_second_version:
        flags = head[5]
        # times and limits of attributes are optional
        position = address + 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        blocks = [(position + width, int.from_bytes(read(position, width), "little"))]
        prefix = struct.Struct("<BHB2x" if flags & 4 else "<BHB")
    elif head[0] == 1:
        blocks, prefix = [(address + 16, struct.unpack_from("<I", head, 8)[0])], struct.Struct("<HHB3x")
    else:
        raise ValueError
    starts, total = set(), 0
    while blocks:
        start, size = blocks.pop()
        total += size
        if start in starts or total > MAX_HEADER_BYTES:
            raise ValueError
        starts.add(start)
        content = io.BytesIO(read(start, size))
        while len(begin := content.read(prefix.size)) == prefix.size:
            kind, length, flags = prefix.unpack(begin)
            body = content.read(length)
            if kind == CONTINUATION:
                start_of_next, size_of_next = struct.unpack_from("<QQ", body)
                # a signature and a checksum
                frame = (4, 8) if is_second_version else (0, 0)
                blocks.append((start_of_next + frame[0], size_of_next - frame[1]))
            yield kind, flags, body


def _check_attribute(head: bytes) -> None:
    """Refuse an attribute whose type or shape is stored elsewhere, from the first bytes of its message."""
    if not 1 <= head[0] <= 3 or (head[0] > 1 and head[1] & IS_STORED_ELSEWHERE):
        raise ValueError


def _check_dense_storage(read: ReadBytes, body: bytes, kind: int) -> None:
    """Check the heap and the B-trees of many links or attributes."""
    flags, order_bytes = body[1], 8 if kind == LINK_INFO else 2
    heap, *trees = struct.unpack_from("<QQQ" if flags & 2 else "<QQ", body, 2 + (order_bytes if flags & 1 else 0))
    indices = [_records(read, tree) for tree in trees if tree != UNDEFINED]
    # the library allocates memory for the number of records of one tree, and fills it from the other
    if len({len(records) for records in indices}) > 1:
        raise ValueError
    if heap == UNDEFINED:
        return
    signature, filters, tree, width, smallest, largest, bits, root, rows = FRACTAL_HEAP.unpack(
        read(heap, FRACTAL_HEAP.size)
    )
    # more rows would have blocks of blocks
    if signature != b"FRHP" or filters or rows > math.log2(largest / smallest) + 2:
        raise ValueError
    huge = _records(read, tree) if tree != UNDEFINED else []
    if kind == LINK_INFO:
        return
    offset_bytes = (bits + 7) // 8
    addresses: tuple[int, ...] = (root,)
    if rows:
        start, children = root + 13 + offset_bytes, width * rows
        addresses = struct.unpack(f"<{children}Q", read(start, 8 * children))
    # blocks of the first two rows have the smallest size, those of each further row twice that of the one before
    sizes = (smallest << max(n // width - 1, 0) for n in range(len(addresses)))
    offsets = [0, *itertools.accumulate(sizes)]
    for record in itertools.chain(*indices):
        place, offset = record[0] >> 4, int.from_bytes(record[1 : 1 + offset_bytes], "little")
        if place == IN_BLOCK:
            block = bisect_right(offsets, offset) - 1
            _check_attribute(read(addresses[block] + offset - offsets[block], 2))
        elif place != HUGE:
            raise ValueError
    for record in huge:
        _check_attribute(read(int.from_bytes(record[:8], "little"), 2))


def _records(read: ReadBytes, address: int) -> list[bytes]:
    """Read the records of a B-tree of version 2, which must be a tree with as many records as it declares."""
    signature, node_bytes, record_bytes, depth, root, n_root, total = B_TREE_2.unpack(read(address, B_TREE_2.size))
    if signature != b"BTHD" or depth > MAX_B_TREE_2_DEPTH or node_bytes > MAX_NODE_BYTES:
        raise ValueError
    # numbers take as many bytes as the largest number of records in a node, or below it, needs
    limits = [(node_bytes - 10) // record_bytes]
    below, widths = limits[0], [0]
    for _ in range(depth):
        pointer_bytes = 8 + _width(limits[0]) + widths[-1]
        limits.append((node_bytes - 10 - pointer_bytes) // (record_bytes + pointer_bytes))
        below = (limits[-1] + 1) * below + limits[-1]
        widths.append(_width(below))
    addresses: set[int] = set()
    records: list[bytes] = []

    def follow(address: int, level: int, n: int) -> None:
        content = io.BytesIO(read(address, node_bytes))
        signature = content.read(6)[:4]
        if signature != (b"BTIN" if level else b"BTLF") or n > limits[level] or address in addresses:
            raise ValueError
        addresses.add(address)
        records.extend(content.read(record_bytes) for _ in range(n))
        for _ in range(n + 1 if level else 0):
            child, n_child, n_below = (
                int.from_bytes(content.read(size), "little") for size in (8, _width(limits[0]), widths[level - 1])
            )
            before = len(records)
            follow(child, level - 1, n_child)
            if level > 1 and len(records) - before != n_below:
                raise ValueError

    if root != UNDEFINED:
        follow(root, depth, n_root)
    if len(records) != total:
        raise ValueError
    return records


def _width(number: int) -> int:
    """Count the bytes that a number needs."""
    return (number.bit_length() + 7) // 8


def _count_stored_chunks(read: ReadBytes, layout: bytes) -> int | None:
    """Count the chunks in the B-tree of a dataset, which must be a tree; None without chunks."""
    version, kind = layout[:2]
    if version != 3:
        raise ValueError
    if kind != CHUNKED:
        return None
    rank, root = struct.unpack_from("<BQ", layout, 2)
    if root == UNDEFINED:
        return 0
    # a key, and the address of a node or a chunk
    entry = struct.Struct(f"<{8 + 8 * rank}xQ")
    chunks, addresses, nodes = 0, set(), [(root, -1)]
    while nodes:
        address, expected_level = nodes.pop()
        signature, kind, level, entries = B_TREE_1.unpack(read(address, B_TREE_1.size))
        is_node = (signature, kind) == (b"TREE", 1) and expected_level in (-1, level)
        if not is_node or not 0 < entries <= MAX_CHUNK_ENTRIES or address in addresses:
            raise ValueError
        addresses.add(address)
        if level == 0:
            chunks += entries
        else:
            children = entry.iter_unpack(read(address + B_TREE_1.size, entries * entry.size))
            nodes.extend((child, level - 1) for (child,) in children)
    return chunks
