"""The texts of a dataset, read from the bytes of the file.

HDF5 keeps them in heaps that have no checksum: where a bit in one is wrong, the library makes room for 4 GB, or
looks at the same place for ever. Here a heap is read once, from its beginning to its end. The format is that of
the HDF5 File Format Specification, III.E, "Global Heap".
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator, Mapping
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

# a text of a dataset: its length, the place of its heap, and its number there
LABEL = np.dtype([("length", "<u4"), ("address", "<u8"), ("number", "<u4")])
MAX_HEAPS = 8_000_000  # bytes
HEAP = struct.Struct("<4sB3xQ")  # signature, version, size of the whole
OBJECT = struct.Struct("<HHIQ")  # number, references, nothing, size of what follows


def labels(stream: BinaryIO, place: int, size: int) -> NDArray[np.void]:
    """What a dataset of texts holds itself: for each text where it is."""
    stream.seek(place)
    return np.frombuffer(stream.read(size), LABEL)


def texts(stream: BinaryIO, found: Mapping[str, NDArray[np.void]]) -> dict[str, list[str]]:
    """The texts themselves, of all datasets, each heap of which is read once.

    Raises
    ------
    ValueError : a text is not where its label says, or is no UTF-8
    """
    places = {place for one in found.values() for length, place, _ in one.tolist() if length}
    sizes = {place: _size(stream, place) for place in places}
    if sum(sizes.values()) > MAX_HEAPS:
        raise ValueError(f"more than {MAX_HEAPS:,} bytes of heaps")
    heaps = {place: dict(_objects(stream, place, size)) for place, size in sizes.items()}
    return {
        name: [_text(heaps[place], length, number) if length else "" for length, place, number in one.tolist()]
        for name, one in found.items()
    }


def _text(heap: dict[int, bytes], length: int, number: int) -> str:
    stored = heap.get(number, b"")
    if len(stored) != length:
        raise ValueError(f"a text of {length:,} bytes is stored as {len(stored):,}")
    return stored.decode()


def _size(stream: BinaryIO, place: int) -> int:
    stream.seek(place)
    signature, version, size = HEAP.unpack(stream.read(HEAP.size))
    if (signature, version) != (b"GCOL", 1):
        raise ValueError("texts without a heap")
    return int(size)


def _objects(stream: BinaryIO, place: int, size: int) -> Iterator[tuple[int, bytes]]:
    """The objects of a heap, each with its number."""
    stream.seek(place + HEAP.size)
    left = size - HEAP.size
    while left >= OBJECT.size:
        number, _, _, length = OBJECT.unpack(stream.read(OBJECT.size))
        # each begins at a multiple of eight bytes
        left -= OBJECT.size + length + -length % 8
        if left < 0:
            return
        yield number, stream.read(length)
        stream.seek(-length % 8, os.SEEK_CUR)
