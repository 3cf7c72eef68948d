"""The numbers of a dataset that is stored in pieces, read from the bytes of the file.

HDF5 unpacks what a piece holds to its end, however long that is; here it is as long as it has to be. And where a
tree of pieces leads back to itself, HDF5 follows it until the process dies: that happens in a process of its own.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import zlib
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from h5py import h5d, h5z
from numpy.typing import NDArray

TIME = 60.0  # s in which pieces are found
FINDER = """
import json, sys
import h5py
found = {}
with h5py.File(sys.argv[1], "r") as file:
    for name, count in json.loads(sys.argv[2]).items():
        rows = found[name] = []
        def add(piece):
            rows.append([*piece.chunk_offset, piece.byte_offset, piece.size, piece.filter_mask])
            if len(rows) > count:
                raise ValueError
        file[name].id.chunk_iter(add)
print(json.dumps(found))
"""


def count(dataset: h5d.DatasetID) -> int:
    """How many pieces a dataset has."""
    lengths = dataset.get_create_plist().get_chunk()
    return math.prod(-(-size // length) for size, length in zip(dataset.shape, lengths, strict=True))


def find(path: str, counts: Mapping[str, int]) -> dict[str, list[list[int]]]:
    """Where the pieces of some datasets are: of each its place along the axes and in the file, its size, its mask.

    Parameters
    ----------
    path : of the file
    counts : how many pieces there are, by the name of the dataset

    Raises
    ------
    ValueError : they cannot be found, or are not as many
    """
    if not counts:
        return {}
    words = [sys.executable, "-I", "-c", FINDER, path, json.dumps(counts)]
    try:
        done = subprocess.run(words, capture_output=True, timeout=TIME, check=False)
        found: dict[str, list[list[int]]] = json.loads(done.stdout)
    except (OSError, ValueError, subprocess.TimeoutExpired):
        raise ValueError("its pieces cannot be found") from None
    for name, count in counts.items():
        if len(found[name]) != count:
            raise ValueError(f"{len(found[name])} pieces, wants {count}")
    return found


def read_pieces(dataset: h5d.DatasetID, stream: BinaryIO, places: list[list[int]]) -> NDArray[Any]:
    """All numbers of a dataset, from where its pieces are.

    Raises
    ------
    ValueError : a piece is missing, or does not hold what it has to
    """
    plan = dataset.get_create_plist()
    lengths, dtype = plan.get_chunk(), dataset.get_type().dtype
    filters = [plan.get_filter(place)[0] for place in range(plan.get_nfilters())]
    values = np.empty(dataset.shape, dtype)
    if len({tuple(start) for *start, _, _, _ in places}) < len(places):
        raise ValueError("two pieces at one place")
    for *start, byte, size, mask in places:
        if mask or any(at % length for at, length in zip(start, lengths, strict=True)):
            raise ValueError("a piece at an odd place")
        stream.seek(byte)
        content = _unpacked(stream.read(size), filters, dtype.itemsize, math.prod(lengths) * dtype.itemsize)
        where = tuple(slice(at, at + length) for at, length in zip(start, lengths, strict=True))
        whole = np.frombuffer(content, dtype).reshape(lengths)
        values[where] = whole[tuple(slice(0, size) for size in values[where].shape)]
    return values


def _unpacked(content: bytes, filters: list[int], width: int, size: int) -> bytes:
    """The bytes of a piece before its filters were applied, last first."""
    for one in reversed(filters):
        if one == h5z.FILTER_DEFLATE:
            content = zlib.decompressobj().decompress(content, size)
        else:
            content = np.frombuffer(content, np.uint8).reshape(width, -1).T.tobytes()
    if len(content) != size:
        raise ValueError(f"a piece of {len(content):,} bytes, wants {size:,}")
    return content
