"""The numbers of a dataset that is stored in pieces, read from the bytes of the file.

HDF5 unpacks what a piece holds to its end, however long that is; here it is as long as it has to be.
"""

from __future__ import annotations

import math
import zlib
from typing import Any, BinaryIO

import numpy as np
from h5py import h5d, h5z
from numpy.typing import NDArray


def count(dataset: h5d.DatasetID) -> int:
    """How many pieces a dataset has."""
    lengths = dataset.get_create_plist().get_chunk()
    return math.prod(-(-size // length) for size, length in zip(dataset.shape, lengths, strict=True))


def read_pieces(dataset: h5d.DatasetID, stream: BinaryIO) -> NDArray[Any]:
    """All numbers of a dataset.

    Raises
    ------
    ValueError : a piece is missing, is there twice, or does not hold what it has to
    """
    plan = dataset.get_create_plist()
    lengths, dtype = plan.get_chunk(), dataset.get_type().dtype
    filters = [plan.get_filter(place)[0] for place in range(plan.get_nfilters())]
    places: dict[tuple[int, ...], Any] = {}

    def found(piece: Any) -> None:
        places[tuple(piece.chunk_offset)] = piece

    dataset.chunk_iter(found)
    if len(places) != count(dataset):
        raise ValueError(f"{len(places)} pieces, wants {count(dataset)}")
    values = np.empty(dataset.shape, dtype)
    for start, piece in places.items():
        if piece.filter_mask or any(at % length for at, length in zip(start, lengths, strict=True)):
            raise ValueError("a piece at an odd place")
        stream.seek(piece.byte_offset)
        content = _unpacked(stream.read(piece.size), filters, dtype.itemsize, math.prod(lengths) * dtype.itemsize)
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
