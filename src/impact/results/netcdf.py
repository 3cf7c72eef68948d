"""Results as netCDF-4 files in HDF5: written slab by slab, and validated before they are read.

HDF5 can refer to data in other files, declare data that is missing, and give several names to one dataset. A
result does none of that: it has datasets of numbers and bytes in one group, and small attributes.
"""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any

import h5netcdf
import h5py
import numpy as np
import xarray as xr
from h5py import h5a, h5d, h5l, h5o, h5s, h5t, h5z
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from ..atomic import Sink
from ..config.tables import Output
from ..errors import ResultError
from ..formatting import safe_text
from .schema import SCHEMA_VERSION
from .seal import USER_BLOCK_BYTES, ReadBytes, check_object
from .slabs import slabs
from .trajectory_table import check_memory
from .validation import TABLE_VARIABLES, is_name

Region = tuple[int | slice, ...]
# the name of a variable, a region of it and its values there
RegionValues = tuple[str, Region, NDArray[Any]]
# values per chunk of a compressed variable, if the config does not set chunks
CHUNK_VALUES = 2**16
# limits that are far above every result
MAX_DATASETS = 1_000
MAX_ATTRIBUTES = 10_000
MAX_ATTRIBUTE_VALUES = 64  # values of one attribute
MAX_ATTRIBUTE_BYTES = 80_000_000  # bytes of all attributes; a config may have 64 MB
MAX_LABEL_BYTES = 4_000_000  # bytes of all labels
MAX_CHUNKS_OF_FILE = 200_000  # of all datasets together
# uncompressed bytes per byte of the file, about the most that deflate can reach, and bytes that are always allowed
MAX_COMPRESSION_RATIO, ALWAYS_ALLOWED_BYTES = 1_100, 2**26
# attributes that netCDF itself writes
SKIPPED_ATTRIBUTES = frozenset({"NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties", "coordinates"})
NETCDF_ATTRIBUTES = SKIPPED_ATTRIBUTES | {"CLASS", "_Netcdf4Dimid", "_Netcdf4Coordinates", "_Encoding"}


def write_dataset(sink: Sink, template: xr.Dataset, values: Iterable[RegionValues], output: Output) -> None:
    """Write the coordinates and attributes of a template, and values in regions of its variables."""
    # track_order: variables stay in the order of their creation
    with (
        h5py.File(sink, "w", track_order=True, userblock_size=USER_BLOCK_BYTES) as plain,
        h5netcdf.File(plain, "w") as file,
    ):
        texts = {name: encode_text(variable) for name, variable in template.coords.items() if is_text(variable)}
        file.dimensions = {
            **{str(name): size for name, size in template.sizes.items()},
            **{f"string{width}": width for width in sorted(text.shape[-1] for text in texts.values())},
        }
        coordinates = {
            str(name): {*variable.dims}
            for name, variable in template.coords.variables.items()
            if name not in template.dims
        }
        for name, variable in template.coords.items():
            values_of_file, dims, encoding = variable.values, variable.dims, {}
            if name in texts:
                values_of_file, encoding = texts[name], {"_Encoding": "utf-8"}
                dims = (*dims, f"string{values_of_file.shape[-1]}")
            added = file.create_variable(str(name), dims, values_of_file.dtype, data=values_of_file)
            _set_attributes(added, {**variable.attrs, **encoding})
        for name, variable in template.data_vars.items():
            storage = _storage_options(variable, output)
            added = file.create_variable(str(name), variable.dims, variable.dtype, **storage)
            related = " ".join(other for other, dims in coordinates.items() if dims <= {*variable.dims})
            named = {} if name in TABLE_VARIABLES else {"coordinates": related}
            _set_attributes(added, {**variable.attrs, **named})
        _set_attributes(file, dict(template.attrs))
        sink.check()

        # written by h5py directly, which has less overhead per call
        datasets = {str(name): plain[str(name)] for name in template.data_vars}
        for name, region, array in values:
            datasets[name][region or ...] = array
            sink.check()
    sink.check()


def is_text(variable: xr.DataArray | xr.Variable) -> bool:
    return variable.dtype.kind not in "fiub"


def encode_text(variable: xr.DataArray) -> NDArray[np.bytes_]:
    """Encode text as an array of single bytes with one more axis, the netCDF classic convention."""
    encoded = [str(text).encode() for text in np.asarray(variable.values, object).reshape(-1)]
    width = max(1, *map(len, encoded)) if encoded else 1
    return np.array(encoded, f"S{width}").reshape(variable.shape)[..., np.newaxis].view("S1")


def _set_attributes(holder: Any, attributes: Mapping[Any, Any]) -> None:
    """Set attributes; text has a fixed length in bytes, which a reader can check before it reads."""
    for name, value in attributes.items():
        holder.attrs[str(name)] = encode_attribute(value) if isinstance(value, str) else value


def encode_attribute(text: str) -> NDArray[Any]:
    """Encode text as a string of a fixed number of bytes."""
    encoded = text.encode()
    return np.array(encoded, h5py.string_dtype("utf-8", max(len(encoded), 1)))


def _storage_options(variable: xr.DataArray, output: Output) -> dict[str, Any]:
    """Choose the options of a variable: contiguous unless the config sets compression or chunks."""
    if not variable.ndim or (output.compression == "none" and not output.chunks):
        return {}
    lengths = {"model": 1, **output.chunks}
    sizes = {dim: min(lengths.get(str(dim), size), size) for dim, size in variable.sizes.items()}
    # by default whole along the last axes, of length one along the first
    chunk = sizes if output.chunks else {dim: part.stop for dim, part in next(slabs(sizes, CHUNK_VALUES)).items()}
    packed = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
    return {"chunks": tuple(chunk.values()), **(packed if output.compression == "gzip" else {})}


class StoredArray(BackendArray):
    """A variable of a file, read when it is indexed."""

    def __init__(self, name: str, dataset: h5py.Dataset, file: h5py.File) -> None:
        self.name, self.dataset = name, dataset
        # of a Python stream, which only a file that is being written has, there is no descriptor
        self.file = file.id if file.driver == "sec2" else None
        self.shape, self.dtype = dataset.shape, dataset.dtype
        self._checked: set[tuple[int, ...]] = set()

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        support = indexing.IndexingSupport.OUTER_1VECTOR
        return indexing.explicit_indexing_adapter(key, self.shape, support, self.read)

    def read(self, key: tuple[Any, ...]) -> NDArray[Any]:
        """Read values; `key` has an integer, a slice or an integer array for each axis."""
        # an array of all positions would take longer than to read a few values
        positions = [
            range(size)[part] if isinstance(part, slice) else np.atleast_1d(part)
            for size, part in zip(self.shape, key, strict=True)
        ]
        check_memory(self.name, [*map(len, positions)], self.dtype)
        try:
            self._check_chunks(positions)
            if len(key) == 1 and isinstance(key[0], np.ndarray) and key[0].size:
                # a list of positions as a key of h5py takes ten times as long
                values, space = np.empty(key[0].size, self.dtype), self.dataset.id.get_space()
                space.select_elements(key[0][:, np.newaxis].astype(np.uint64))
                self.dataset.id.read(h5s.create_simple(values.shape), space, values)
            else:
                values = np.asarray(self.dataset[key])
            # HDF5 reads zeros beyond the end
            if self.file and os.fstat(self.file.get_vfd_handle()).st_size < self.file.get_filesize():
                raise ValueError("the file was truncated since it was opened")
            return values
        except (OSError, RuntimeError, ValueError, zlib.error) as error:
            path = safe_text(str(self.dataset.file.filename)) if self.dataset else "the result"
            reason = f"{safe_text(self.name, 40)}: {safe_text(str(error), 80)}"
            raise ResultError(f"{path}: is not a readable result ({reason})") from error

    def _check_chunks(self, positions: Sequence[range | NDArray[np.intp]]) -> None:
        """Check the sizes of chunks: HDF5 decompresses to any size, and reads beyond a short chunk."""
        if not self.dataset.compression:
            return
        chunks = self.dataset.chunks
        size = math.prod(chunks) * self.dtype.itemsize
        starts = (np.unique(np.asarray(p) // c * c).tolist() for p, c in zip(positions, chunks, strict=True))
        for corner in product(*starts):
            if corner not in self._checked:
                unfiltered, packed = self.dataset.id.read_direct_chunk(corner)
                if unfiltered or len(zlib.decompressobj().decompress(packed, size + 1)) != size:
                    raise ValueError("a chunk of unexpected size")
                self._checked.add(corner)


def read_variables(
    file: h5py.File, read: ReadBytes
) -> tuple[dict[str, xr.Variable], dict[str, object], tuple[str, ...]]:
    """Read variables, whose numbers are read when indexed, attributes, and names that are not part of a result."""
    _check_schema_version(file)
    datasets, stored_chunks = _open_datasets(file, read)
    _check_sizes(file, datasets, stored_chunks)
    dims = _dims_by_dataset(datasets)
    accepted = {name: dataset for name, dataset in datasets.items() if is_name(name)}
    # a dimension without coordinates is a dataset in the file as well, without values
    unknown = [
        name
        for name, dataset in datasets.items()
        if name not in accepted and (dims[name] != (name,) or dataset.id.get_storage_size())
    ]
    holders = {"": file, **accepted}
    if sum(h5a.get_num_attrs(holder.id) for holder in holders.values()) > MAX_ATTRIBUTES:
        raise _unreadable(f"more than {MAX_ATTRIBUTES:,} attributes")
    if sum(_attribute_text_bytes(name, holder) for name, holder in holders.items()) > MAX_ATTRIBUTE_BYTES:
        raise _unreadable(f"more than {MAX_ATTRIBUTE_BYTES:,} bytes of text")
    variables = {}
    for name, dataset in accepted.items():
        if not dataset.id.get_storage_size():
            raise _unreadable("declares data that the file does not contain", name)
        attributes = _read_attributes(dataset)
        if dataset.dtype.kind == "S":
            values = StoredArray(name, dataset, file).read((slice(None),) * dataset.ndim)
            texts = values.view(f"S{values.shape[-1]}")[..., 0]
            variables[name] = xr.Variable(dims[name][:-1], np.char.decode(texts, "utf-8"), attributes)
        else:
            array = indexing.LazilyIndexedArray(StoredArray(name, dataset, file))
            chunks = {"chunksizes": dataset.chunks} if dataset.chunks else None
            variables[name] = xr.Variable(dims[name], array, attributes, chunks)
    return variables, _read_attributes(file), tuple(sorted(unknown))


def _unreadable(what: str, name: str = "") -> ResultError:
    return ResultError(f"is not a readable result ({safe_text(name, 40)}{': ' if name else ''}{what})")


def _check_schema_version(file: h5py.File) -> None:
    if not h5a.exists(file.id, b"schema_version"):
        raise ResultError("is not a result of impact")
    attribute = h5a.open(file.id, b"schema_version")
    if not _is_number_type(attribute.get_type()) or attribute.shape not in ((), (1,)):
        raise _unreadable("schema_version: not a number")
    version = np.ravel(file.attrs["schema_version"])[0]
    if version != SCHEMA_VERSION:
        raise ResultError(f"has schema version {version}, this program reads {SCHEMA_VERSION}")


def _open_datasets(file: h5py.File, read: ReadBytes) -> tuple[dict[str, h5py.Dataset], dict[str, int | None]]:
    """Open the datasets, and count their stored chunks; follow only checked hard links to different objects."""
    root = file.id
    if root.get_num_objs() > MAX_DATASETS:
        raise _unreadable(f"more than {MAX_DATASETS:,} datasets")
    datasets, stored_chunks = dict[str, h5py.Dataset](), dict[str, int | None]()
    objects = set()
    for link in root:
        name = link.decode(errors="surrogateescape")
        info = root.links.get_info(link)
        if info.type != h5l.TYPE_HARD:
            raise _unreadable("not a hard link", name)
        objects.add(info.u)
        stored_chunks[name] = check_object(read, info.u, name)
        opened = h5o.open(root, link)
        if not isinstance(opened, h5d.DatasetID):
            raise _unreadable("not a dataset", name)
        datasets[name] = h5py.Dataset(opened)
    if len(objects) < len(datasets):
        raise _unreadable("a dataset with two names")
    return datasets, stored_chunks


def _check_sizes(
    file: h5py.File, datasets: Mapping[str, h5py.Dataset], stored_chunks: Mapping[str, int | None]
) -> None:
    """Check that the file itself holds all data."""
    size, declared = file.id.get_filesize(), {name: _declared_bytes(name, d.id) for name, d in datasets.items()}
    compressed = sum(declared[name] for name, dataset in datasets.items() if dataset.compression)
    chunks = {
        name: math.prod(-(-n // c) for n, c in zip(dataset.shape, dataset.chunks, strict=True))
        for name, dataset in datasets.items()
        if dataset.chunks
    }
    is_plain_in_file = sum(declared.values()) - compressed <= size
    if not is_plain_in_file or compressed > max(ALWAYS_ALLOWED_BYTES, MAX_COMPRESSION_RATIO * size):
        raise _unreadable("declares more data than a file of this size can contain")
    if sum(chunks.values()) > MAX_CHUNKS_OF_FILE:
        raise _unreadable(f"more than {MAX_CHUNKS_OF_FILE:,} chunks")
    for name, count in chunks.items():
        # missing chunks would be read as zeros, at no cost in the file
        if stored_chunks[name] != count:
            raise _unreadable("declares data that the file does not contain", name)
    if sum(declared[name] for name, dataset in datasets.items() if dataset.dtype.kind == "S") > MAX_LABEL_BYTES:
        raise _unreadable(f"more than {MAX_LABEL_BYTES:,} bytes of labels")


def _is_number_type(kind: h5t.TypeID) -> bool:
    """Check for an integer or floating-point type in a standard format."""
    plain = isinstance(kind, h5t.TypeIntegerID | h5t.TypeFloatID) and kind.get_size() <= 8
    return plain and h5t.py_create(kind.dtype).equal(kind)


def _is_string_type(kind: h5t.TypeID) -> bool:
    """Check for a string of a fixed length."""
    return isinstance(kind, h5t.TypeStringID) and not kind.is_variable_str()


def _declared_bytes(name: str, dataset: h5d.DatasetID) -> int:
    """Count the bytes of a dataset, which must be stored in the file itself, contiguous or in chunks."""
    kind, shape = dataset.get_type(), dataset.shape
    if not (_is_number_type(kind) or (_is_string_type(kind) and kind.get_size() == 1 and shape)):
        raise _unreadable("expected numbers or labels", name)
    plist = dataset.get_create_plist()
    declared = math.prod(shape) * kind.get_size() if shape is not None else 0
    if plist.get_layout() == h5d.CHUNKED:
        filters = [plist.get_filter(number)[0] for number in range(plist.get_nfilters())]
        whole = shape == dataset.get_space().get_simple_extent_dims(maxdims=True)
        # a chunk larger than the dataset would be decompressed to the size of the chunk
        fits = whole and all(c <= n for c, n in zip(plist.get_chunk(), shape, strict=True))
        stored = fits and filters in ([], [h5z.FILTER_DEFLATE], [h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE])
    else:
        # the dataset of a dimension without values is never written
        size_matches = dataset.get_storage_size() in (0, declared)
        stored = plist.get_layout() == h5d.CONTIGUOUS and not plist.get_external_count() and size_matches
    if not stored or not declared:
        raise _unreadable("not stored in this file, in one piece or in chunks of one size", name)
    return declared if dataset.get_storage_size() else 0


def _dim_ids(dataset: h5py.Dataset, name: str) -> list[int] | None:
    """Read an attribute of dimension IDs; None without it.

    It is not looked up in vain: the text of that error of HDF5 was once unreadable (h5py 3.16.0, HDF5 2.0.0).
    """
    return np.ravel(dataset.attrs[name]).tolist() if name in dataset.attrs else None


def _dims_by_dataset(datasets: Mapping[str, h5py.Dataset]) -> dict[str, tuple[str, ...]]:
    """Find the dimensions of each dataset by the dimension IDs of netCDF."""
    numbers = {name: _dim_ids(dataset, "_Netcdf4Coordinates") or [] for name, dataset in datasets.items()}
    scales: dict[int, str] = {}
    for name, dataset in datasets.items():
        if "CLASS" in dataset.attrs and dataset.attrs["CLASS"] == b"DIMENSION_SCALE":
            ids = _dim_ids(dataset, "_Netcdf4Dimid")
            scales |= dict.fromkeys((numbers[name] if ids is None else ids)[:1], name)
    sizes = {name: datasets[name].shape[0] for name in scales.values() if datasets[name].shape}
    dims = {}
    for name, dataset in datasets.items():
        dataset_dims = tuple(scales.get(number, "") for number in numbers[name])
        if not dataset_dims and name in sizes:
            dataset_dims = (name,)
        shape = tuple(sizes.get(dim) for dim in dataset_dims)
        if len({*dataset_dims}) != len(dataset_dims) or shape != dataset.shape:
            raise _unreadable("its axes are not those of the file", name)
        dims[name] = dataset_dims
    return dims


def _attribute_text_bytes(name: str, holder: h5py.File | h5py.Dataset) -> int:
    """Count the bytes of text of the attributes that are read, and check their types and sizes."""
    total = 0
    for key in (key for key in holder.attrs if key not in SKIPPED_ATTRIBUTES):
        attribute = holder.attrs.get_id(key)
        kind, shape = attribute.get_type(), attribute.shape
        if _is_string_type(kind) and shape == ():
            total += kind.get_size()
        elif not _is_number_type(kind) or shape is None or math.prod(shape) > MAX_ATTRIBUTE_VALUES:
            raise _unreadable("an attribute of unexpected type or size", f"{name}@{key}")
    return total


def _read_attributes(holder: h5py.File | h5py.Dataset) -> dict[str, object]:
    """Read the attributes that `_set_attributes` sets."""
    attributes: dict[str, object] = {}
    for name in holder.attrs:
        if name not in NETCDF_ATTRIBUTES:
            value = holder.attrs[name]
            array = np.ravel(value)
            number_or_array = array[0] if array.size == 1 else value
            attributes[name] = value.decode() if isinstance(value, bytes) else number_or_array
    return attributes
