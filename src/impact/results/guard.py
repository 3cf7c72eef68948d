"""A file from elsewhere is looked at before anything is read: what is odd in it is refused here.

HDF5 can name other files as the place of its data, can declare what it does not hold, and can hold a little under
many names. A result does none of that: datasets of numbers and labels, in one group, and
attributes whose size stands beside them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np
from h5py import h5a, h5d, h5l, h5o, h5t, h5z

from ..errors import ResultError
from ..text import safe_text
from .heap import LABEL, labels
from .names import is_name
from .pieces import count
from .schema import SCHEMA_VERSION

MAGIC = b"\x89HDF\r\n\x1a\n"
# what no result comes near
MAX_DATASETS = 1_000
MAX_ATTRIBUTES = 10_000
MAX_NUMBERS = 64  # of an attribute
MAX_TEXT = 80_000_000  # bytes of all attributes; a config may have 64 MB
MAX_LABELS = 4_000_000  # bytes of all datasets of text
MAX_BYTES = 16 * 2**30
MAX_PIECES = 200_000  # of all datasets together
# what is packed may be so many times the file, which is as much as deflate can, where it is more than little
EXPANSION, SMALL = 1_100, 2**26
# what netCDF tells other readers, and is not read here
UNREAD = frozenset({"NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties", "coordinates"})
NETCDF = UNREAD | {"CLASS", "_Netcdf4Dimid", "_Netcdf4Coordinates"}


@dataclass(frozen=True)
class Contents:
    """What may be read: the names of a result, each with its axes; and the names that are passed over."""

    axes: Mapping[str, tuple[str, ...]]
    unknown: tuple[str, ...]


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """The file, opened to read; what is no regular file, or is not HDF5, does not reach the library."""
    if not path.is_file():
        raise ResultError("is not a regular file" if path.exists() else "does not exist")
    with path.open("rb") as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise ResultError("is not a readable result (not an HDF5 file)")
        yield stream


def vet(file: h5py.File, stream: BinaryIO, most: float = MAX_BYTES) -> Contents:
    """What may be read from a file; `stream` has its bytes.

    Parameters
    ----------
    file, stream : the file, and its bytes
    most : bytes of data that are to be held at once

    Raises
    ------
    ResultError : it is no result, is of another schema version, or holds what a result never does
    """
    _check_schema(file)
    datasets = _datasets(file)
    size = file.id.get_filesize()
    held = {name: _held(name, dataset) for name, dataset in datasets.items()}
    packed = sum(held[name] for name, one in datasets.items() if is_in_pieces(one))
    if sum(held.values()) - packed > size or packed > max(SMALL, EXPANSION * size):
        raise _odd("more data than such a file may hold")
    if sum(held.values()) > most:
        raise ResultError(
            f"has {sum(held.values()):,} bytes, more than are read at once (xarray reads parts of it)"
        )
    if sum(count(one) for one in datasets.values() if is_in_pieces(one)) > MAX_PIECES:
        raise _odd(f"more than {MAX_PIECES:,} pieces")
    texts = {name: one for name, one in datasets.items() if _is_text(one.get_type())}
    if sum(_labels(one, held[name], stream) for name, one in texts.items()) > MAX_LABELS:
        raise _odd(f"more than {MAX_LABELS:,} bytes of labels")
    known = {name: h5py.Dataset(one) for name, one in datasets.items() if is_name(name)}
    holders = {"": file, **known}
    if sum(h5a.get_num_attrs(holder.id) for holder in holders.values()) > MAX_ATTRIBUTES:
        raise _odd(f"more than {MAX_ATTRIBUTES:,} attributes")
    if sum(_text(name, holder) for name, holder in holders.items()) > MAX_TEXT:
        raise _odd(f"more than {MAX_TEXT:,} bytes of text")
    return Contents(_axes(known), tuple(sorted(datasets.keys() - known)))


def _odd(what: str, name: str = "") -> ResultError:
    return ResultError(f"is not a readable result ({safe_text(name, 40)}{': ' if name else ''}{what})")


def _check_schema(file: h5py.File) -> None:
    if not all(h5a.exists(file.id, name) for name in (b"schema_version", b"content_digest")):
        raise ResultError("is not a result of impact")
    attribute = h5a.open(file.id, b"schema_version")
    if not _is_number(attribute.get_type()) or attribute.shape not in ((), (1,)):
        raise _odd("schema_version: not a number")
    found = np.ravel(file.attrs["schema_version"])[0]
    if found != SCHEMA_VERSION:
        raise ResultError(f"has schema version {found}, this program reads {SCHEMA_VERSION}")


def _datasets(file: h5py.File) -> dict[str, h5d.DatasetID]:
    """The datasets of the file, by name; no link is followed out of it, or to the same thing twice."""
    root = file.id
    if root.get_num_objs() > MAX_DATASETS:
        raise _odd(f"more than {MAX_DATASETS:,} datasets")
    found: dict[str, h5d.DatasetID] = {}
    places = set()
    for link in root:
        name = link.decode(errors="surrogateescape")
        info = root.links.get_info(link)
        if info.type != h5l.TYPE_HARD:
            raise _odd("a link to somewhere else", name)
        places.add(info.u)
        found[name] = h5o.open(root, link)
        if not isinstance(found[name], h5d.DatasetID):
            raise _odd("not a dataset", name)
    if len(places) < len(found):
        raise _odd("a dataset of two names")
    return found


def _is_number(kind: h5t.TypeID) -> bool:
    """Whether it is an integer or floating-point number of the usual bits."""
    plain = isinstance(kind, h5t.TypeIntegerID | h5t.TypeFloatID) and kind.get_size() <= 8
    return plain and h5t.py_create(kind.dtype).equal(kind)


def _is_text(kind: h5t.TypeID) -> bool:
    return isinstance(kind, h5t.TypeStringID)


def _held(name: str, dataset: h5d.DatasetID) -> int:
    """The bytes of a dataset, all of which the file itself holds in one piece."""
    kind, shape = dataset.get_type(), dataset.shape
    if _is_text(kind) and kind.is_variable_str():
        width = LABEL.itemsize
    elif _is_number(kind):
        width = kind.get_size()
    else:
        raise _odd("neither numbers nor labels", name)
    plan = dataset.get_create_plist()
    pieces = is_in_pieces(dataset) and not _is_text(kind)
    # what is virtual, may grow, or is packed in another way is not
    if plan.get_external_count() or not (pieces or plan.get_layout() == h5d.CONTIGUOUS):
        raise _odd("not stored in this file, in one piece or in pieces of one size", name)
    # the product by HDF5 itself could wrap around
    declared = math.prod(shape) * width if shape is not None else 0
    if not declared or not (pieces or dataset.get_storage_size() == declared):
        raise _odd("declares other data than the file holds", name)
    return declared


def is_in_pieces(dataset: h5d.DatasetID) -> bool:
    """Whether a dataset is stored in pieces of one size that may be packed, and can be read by `chunks`."""
    plan = dataset.get_create_plist()
    filters = {plan.get_filter(place)[0] for place in range(plan.get_nfilters())}
    if plan.get_layout() != h5d.CHUNKED or not filters <= {h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE}:
        return False
    shape, most = dataset.shape, dataset.get_space().get_simple_extent_dims(maxdims=True)
    lengths = plan.get_chunk()
    # a piece that is larger than the whole would be unpacked to its own size
    return (
        shape == most and len(lengths) == len(shape) and all(a <= b for a, b in zip(lengths, shape, strict=True))
    )


def _labels(dataset: h5d.DatasetID, declared: int, stream: BinaryIO) -> int:
    """The memory that the texts of a dataset take where each has the room of the longest, by what they claim."""
    if declared > MAX_LABELS:
        return declared
    lengths = labels(stream, dataset.get_offset(), declared)["length"]
    return declared + lengths.size * int(lengths.max())


def _text(name: str, holder: h5py.File | h5py.Dataset) -> int:
    """The bytes of text of the attributes that are read; each has a kind and a size that one may read."""
    total = 0
    for key in (key for key in holder.attrs if key not in UNREAD):
        attribute = holder.attrs.get_id(key)
        kind, shape = attribute.get_type(), attribute.shape
        if _is_text(kind) and not kind.is_variable_str() and shape == ():
            total += kind.get_size()
        elif not _is_number(kind) or shape is None or math.prod(shape) > MAX_NUMBERS:
            raise _odd("an attribute of an unusual kind or size", f"{name}@{key}")
    return total


def _axes(known: Mapping[str, h5py.Dataset]) -> dict[str, tuple[str, ...]]:
    """The axes of each dataset, by the numbers that netCDF gives to them and to the datasets of their values."""
    numbers = {name: np.ravel(one.attrs.get("_Netcdf4Coordinates", ())).tolist() for name, one in known.items()}
    scales = [name for name, one in known.items() if one.attrs.get("CLASS") == b"DIMENSION_SCALE"]
    named = {number: name for name in scales for number in numbers[name]}
    axes = {name: tuple(named.get(number, "") for number in own) for name, own in numbers.items()}
    for name, own in axes.items():
        lengths = tuple(known[axis].size if axis else None for axis in own)
        if len(set(own)) != len(own) or lengths != known[name].shape:
            raise _odd("its axes are not those of the file", name)
    return axes
