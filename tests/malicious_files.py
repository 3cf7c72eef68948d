"""Malicious result files: each is a valid result with a single defect, listed with the expected error message.

A file is sealed again after the change: the seal is no protection, since anyone can seal a file.
"""

from __future__ import annotations

import json
import mmap
import os
import re
import struct
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5o, h5p, h5s, h5t, h5z
from scipy.io import netcdf_file

from impact.results.seal import write_seal

SECRET = b"the secret 1234567"
UTF8 = h5py.string_dtype()
UNSUPPORTED_STORAGE = "not stored in this file, in one piece or in chunks of one size"
TOO_MUCH_DATA = "declares more data than a file of this size can contain"
WRONG_TYPE = "expected numbers or labels"
MISSING_DATA = "declares data that the file does not contain"
NO_SEAL = "does not begin with the header of a sealed file"
WRONG_CHUNK = "a chunk of unexpected size"
WRONG_AXES = "its axes are not those of the file"
WRONG_ATTRIBUTE = "an attribute of unexpected type or size"
WRONG_STRUCTURE = "a structure that this program does not write"
CreateFile = Callable[[Path], object]
ChangeFile = Callable[[h5py.File], object]


def _write_netcdf3(path: Path) -> None:
    with netcdf_file(path, "w") as file:
        file.createDimension("e", 3)
        file.schema_version = 1


NOT_SEALED: dict[str, tuple[CreateFile, str]] = {
    "empty": (lambda path: path.write_bytes(b""), NO_SEAL),
    "text": (lambda path: path.write_bytes(SECRET), NO_SEAL),
    "png": (lambda path: path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(1000)), NO_SEAL),
    "netCDF-3": (_write_netcdf3, NO_SEAL),
    "magic": (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n"), "is of schema version 1"),
    "magic and zeros": (
        lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(9999)),
        "is of schema version 1",
    ),
    "FIFO": (os.mkfifo, "is not a regular file"),
    "device": (lambda path: path.symlink_to("/dev/zero"), "is not a regular file"),
    "folder": (lambda path: path.mkdir(), "is not a regular file"),
    "link to a folder": (lambda path: path.symlink_to("."), "is not a regular file"),
    "link to nothing": (lambda path: path.symlink_to("nothing"), "does not exist"),
    "link to itself": (lambda path: path.symlink_to(path.name), "bad.h5: "),
}


def seal(path: Path) -> None:
    """Seal a file with its present content."""
    with path.open("r+b") as file:
        write_seal(file)


def replace_variable(file: h5py.File, name: str, **options: object) -> h5py.Dataset:
    """Store a variable again with the same axes and attributes, in another way or with other values."""
    old = file[name]
    values, attributes = old[()], {key: old.attrs[key] for key in old.attrs if key != "DIMENSION_LIST"}
    scales = [dimension[0].name for dimension in old.dims]
    del file[name]
    new = file.create_dataset(name, **({"data": values} | options))
    for key, value in attributes.items():
        new.attrs.create(key, value, dtype=None if not isinstance(value, bytes) else f"S{len(value)}")
    for dimension, scale in zip(new.dims, scales, strict=True):
        dimension.attach_scale(file[scale])
    return new


def _beside(file: h5py.File, name: str) -> Path:
    return Path(file.filename).with_name(name)


def _link_to_hdf5(file: h5py.File) -> None:
    with h5py.File(_beside(file, "secret.h5"), "w") as other:
        other["v1_post"] = file["v1_post"][()]
    del file["v1_post"]
    file["v1_post"] = h5py.ExternalLink("secret.h5", "v1_post")


def _link_to_text(file: h5py.File) -> None:
    _beside(file, "secret.txt").write_bytes(SECRET)
    file["other"] = h5py.ExternalLink("secret.txt", SECRET.decode())


def _replace_by_soft_link(file: h5py.File) -> None:
    file.move("v1_post", "duration_")
    file["v1_post"] = h5py.SoftLink("/duration_")


def _store_externally(file: h5py.File, name: str) -> None:
    values = file["v1_post"][()]
    _beside(file, "secret.bin").write_bytes(values.tobytes() + SECRET)
    options = {"data": None, "shape": values.shape, "dtype": "f8", "external": "secret.bin"}
    replace_variable(file, name, **options) if name in file else file.create_dataset(name, **options)


def _add_virtual(file: h5py.File, source: str) -> None:
    values = file["v1_post"][()]
    with h5py.File(_beside(file, "secret.h5"), "w") as other:
        other["v1_post"] = values
    layout = h5py.VirtualLayout(values.shape, "f8")
    layout[:] = h5py.VirtualSource(source, "v1_post", values.shape)
    file.create_virtual_dataset("other", layout)


def _add_compact(file: h5py.File) -> None:
    plan = h5p.create(h5p.DATASET_CREATE)
    plan.set_layout(h5d.COMPACT)
    h5d.create(file.id, b"other", h5t.IEEE_F64LE, h5s.create_simple((3,)), plan)


def _store_in_chunks(file: h5py.File, content: bytes | None = None, mask: int = 0) -> None:
    """Store a variable in compressed chunks; the first has this content; without content there is no chunk."""
    values = file["v1_post"][()]
    new = replace_variable(
        file, "v1_post", data=None, shape=values.shape, dtype="f8", compression="gzip", chunks=(1, 3, 2)
    )
    if content is not None:
        new[1:] = values[1:]
    if content:
        new.id.write_direct_chunk((0, 0, 0), content, mask)


def _add_zip_bomb(file: h5py.File) -> None:
    """A chunk of six numbers that decompresses to a gigabyte of zeros."""
    size, repetitions = 2**20, 2**10
    compressor = zlib.compressobj(9)
    header = compressor.compress(b"") + compressor.flush(zlib.Z_FULL_FLUSH)
    # after a full flush the compressed bytes do not depend on what was before: they can be repeated
    block = compressor.compress(bytes(size)) + compressor.flush(zlib.Z_FULL_FLUSH)
    checksum = (size * repetitions % 65521 << 16) + 1
    _store_in_chunks(file, header + block * repetitions + b"\x03\x00" + checksum.to_bytes(4, "big"))


def _add_filtered(file: h5py.File, filters: list[int]) -> None:
    """Add a dataset in a chunk with filters."""
    plan = h5p.create(h5p.DATASET_CREATE)
    plan.set_chunk((3,))
    for code in filters:
        plan.set_filter(code, 0, (4,) if code == h5z.FILTER_DEFLATE else ())
    h5d.create(file.id, b"other", h5t.IEEE_F64LE, h5s.create_simple((3,)), plan)


def _lengthen_axis(file: h5py.File, **options: object) -> None:
    """Declare an axis with many values, of which the file holds only a few."""
    attributes = dict(file["e"].attrs)
    del file["e"], file["v1_post"]
    axis = file.create_dataset("e", shape=(10**9,), dtype="f8", **options)
    if axis.chunks:
        axis[: axis.chunks[0]] = 0.5
    for key in ("CLASS", "NAME", "_Netcdf4Dimid"):
        axis.attrs.create(key, attributes[key])


def _add_typed(file: h5py.File, kind: h5t.TypeID) -> None:
    plan = h5p.create(h5p.DATASET_CREATE)
    plan.set_alloc_time(h5d.ALLOC_TIME_EARLY)
    h5d.create(file.id, b"other", kind, h5s.create_simple((3,)), plan)


def _seven_bit_type() -> h5t.TypeID:
    kind = h5t.STD_I8LE.copy()
    kind.set_precision(7)
    return kind


def _nest_groups(file: h5py.File) -> None:
    group = file
    for _ in range(3000):
        group = group.create_group("g")


def _add_many_links(file: h5py.File) -> None:
    for number in range(100_000):
        file.id.links.create_hard(b"x%d" % number, file.id, b"e")


def _add_many_attributes(file: h5py.File) -> None:
    # by the low-level interface, which takes a fifth of the time
    holder, scalar = file["e"].id, h5s.create(h5s.SCALAR)
    for number in range(10_000):
        h5a.create(holder, b"x%d" % number, h5t.STD_I8LE, scalar)


def _add_dataset(file: h5py.File, name: str, **options: object) -> None:
    file.create_dataset(name, **options)


def _add_null_attribute(file: h5py.File) -> None:
    h5a.create(file["v1_post"].id, b"x", h5t.IEEE_F64LE, h5s.create(h5s.NULL))


def _set_axis_numbers(file: h5py.File, name: str, numbers: object) -> None:
    file[name].attrs["_Netcdf4Coordinates"] = numbers


def _add_unknown_axis(file: h5py.File) -> None:
    file["x"] = [1.0, 2.0, 3.0]
    file["x"].make_scale("x")
    _set_axis_numbers(file, "x", [7])
    _set_axis_numbers(file, "v1_post", [0, 7, 2])


def _set_attribute(file: h5py.File, holder: str, name: str, value: object, dtype: object = None) -> None:
    (file[holder] if holder else file).attrs.create(name, value, dtype=dtype)


def _delete_attribute(file: h5py.File, name: str) -> None:
    del file.attrs[name]


NOT_UTF8 = b"caf\xe9"
CHANGES: dict[str, tuple[ChangeFile, str]] = {
    "no schema": (partial(_delete_attribute, name="schema_version"), "is not a result of impact"),
    "later schema": (lambda f: _set_attribute(f, "", "schema_version", 99), "schema version 99"),
    "huge schema": (
        lambda f: _set_attribute(f, "", "schema_version", 2**64 - 1, "u8"),
        "version 18446744073709551615",
    ),
    "schema of text": (lambda f: _set_attribute(f, "", "schema_version", "1"), "not a number"),
    "schema of two": (lambda f: _set_attribute(f, "", "schema_version", [1, 1]), "not a number"),
    "schema of a million": (lambda f: _set_attribute(f, "", "schema_version", np.ones(8000, int)), "not a number"),
    "external link": (_link_to_hdf5, "not a hard link"),
    "external link to text": (_link_to_text, "not a hard link"),
    "soft link": (_replace_by_soft_link, "not a hard link"),
    "dangling link": (lambda f: f.__setitem__("other", h5py.SoftLink("/nowhere")), "not a hard link"),
    "second name": (lambda f: f.__setitem__("other", f["v1_post"]), "a dataset with two names"),
    "a group": (lambda f: f.create_group("other"), WRONG_STRUCTURE),
    "3,000 groups": (_nest_groups, WRONG_STRUCTURE),
    "a type": (lambda f: f.__setitem__("other", np.dtype("f8")), "not a dataset"),
    "100,000 links": (_add_many_links, WRONG_STRUCTURE),
    "external storage": (partial(_store_externally, name="v1_post"), UNSUPPORTED_STORAGE),
    "external storage of another": (partial(_store_externally, name="other"), UNSUPPORTED_STORAGE),
    "virtual": (partial(_add_virtual, source="secret.h5"), WRONG_STRUCTURE),
    "virtual without source": (partial(_add_virtual, source="nowhere.h5"), WRONG_STRUCTURE),
    "growing": (
        partial(replace_variable, name="v1_post", maxshape=(None, None, None), chunks=True),
        UNSUPPORTED_STORAGE,
    ),
    "another filter": (partial(replace_variable, name="v1_post", compression="lzf"), UNSUPPORTED_STORAGE),
    "checksums": (partial(replace_variable, name="v1_post", fletcher32=True), UNSUPPORTED_STORAGE),
    "a million chunks": (
        partial(_add_dataset, name="other", shape=10**6, dtype="i1", chunks=(1,)),
        "200,000 chunks",
    ),
    "zip bomb": (
        partial(_add_dataset, name="other", shape=10**8, dtype="f8", compression="gzip", chunks=(10**6,)),
        MISSING_DATA,
    ),
    "zip bomb in a chunk": (_add_zip_bomb, WRONG_CHUNK),
    "short chunk": (partial(_store_in_chunks, content=zlib.compress(b"short")), WRONG_CHUNK),
    "damaged chunk": (partial(_store_in_chunks, content=b"not zlib"), "not a readable result"),
    "unpacked chunk": (partial(_store_in_chunks, content=bytes(48), mask=1), WRONG_CHUNK),
    "packed twice": (lambda f: _add_filtered(f, [h5z.FILTER_DEFLATE] * 2), UNSUPPORTED_STORAGE),
    "shuffled alone": (lambda f: _add_filtered(f, [h5z.FILTER_SHUFFLE]), UNSUPPORTED_STORAGE),
    "no chunks": (_store_in_chunks, MISSING_DATA),
    "a chunk is missing": (partial(_store_in_chunks, content=b"", mask=-1), MISSING_DATA),
    "compact": (_add_compact, UNSUPPORTED_STORAGE),
    "1e15 numbers": (partial(_add_dataset, name="other", shape=(10**15,), dtype="f8"), WRONG_AXES),
    "1e15 labels": (partial(_add_dataset, name="other", shape=(10**15,), dtype="S1"), WRONG_AXES),
    "1e9 numbers of an axis": (_lengthen_axis, "not a readable result"),
    "1e9 numbers of an axis in chunks": (partial(_lengthen_axis, chunks=(10**4,)), TOO_MUCH_DATA),
    "1e9 numbers of an axis, packed": (
        partial(_lengthen_axis, chunks=(10**4,), compression="gzip"),
        TOO_MUCH_DATA,
    ),
    "1e15 numbers of a known name": (
        lambda f: replace_variable(f, "v1_post", data=None, shape=(10**5,) * 3, dtype="f8"),
        WRONG_AXES,
    ),
    "no numbers": (partial(_add_dataset, name="other", shape=(0,), dtype="f8"), UNSUPPORTED_STORAGE),
    "null": (partial(_add_dataset, name="other", data=h5py.Empty("f8")), UNSUPPORTED_STORAGE),
    **{
        f"{name} as {kind}": (
            lambda f, name=name, kind=kind: replace_variable(f, name, data=f[name][()].astype(kind)),
            f"{name}: got {np.dtype(kind)}",
        )
        for name, kind in (("e_out", "i4"), ("status", "f8"), ("status", "i4"), ("steps", "f8"), ("v1_post", "i8"))
    },
    "compound": (partial(_add_dataset, name="other", data=np.zeros(3, "f8,i4")), WRONG_TYPE),
    "complex": (partial(_add_dataset, name="other", data=np.zeros(3, complex)), WRONG_TYPE),
    "enum": (partial(_add_dataset, name="other", data=np.zeros(3, bool)), WRONG_TYPE),
    "opaque": (partial(_add_dataset, name="other", data=np.zeros(3, "V8")), WRONG_TYPE),
    "reference": (partial(_add_dataset, name="other", shape=3, dtype=h5py.ref_dtype), WRONG_TYPE),
    "region": (partial(_add_dataset, name="other", shape=3, dtype=h5py.regionref_dtype), WRONG_TYPE),
    "array": (partial(_add_typed, kind=h5t.array_create(h5t.IEEE_F64LE, (4,))), WRONG_TYPE),
    "lists": (partial(_add_dataset, name="other", shape=3, dtype=h5py.vlen_dtype(float)), WRONG_TYPE),
    "bits": (partial(_add_typed, kind=h5t.STD_B8LE), WRONG_TYPE),
    "fixed text": (partial(_add_dataset, name="other", data=np.array([b"abc"])), WRONG_TYPE),
    "long double": (partial(_add_dataset, name="other", data=np.zeros(3, np.longdouble)), WRONG_TYPE),
    "seven bits": (lambda f: _add_typed(f, _seven_bit_type()), WRONG_TYPE),
    "10 MB of labels": (
        lambda f: replace_variable(f, "doi", data=np.full((2, 5_000_000), b"x", "S1")),
        "more than 4,000,000 bytes of labels",
    ),
    "labels of any length": (
        lambda f: replace_variable(f, "title", data=np.array([["a"], ["b"]], object), dtype=UTF8),
        WRONG_TYPE,
    ),
    "labels of letters in pairs": (
        lambda f: replace_variable(f, "title", data=np.full((2, 9), b"ab", "S2")),
        WRONG_TYPE,
    ),
    "labels in a scalar": (partial(_add_dataset, name="other", data=np.array(b"x", "S1")), WRONG_TYPE),
    "many attributes": (_add_many_attributes, "more than 10,000 attributes"),
    "text of any length": (lambda f: _set_attribute(f, "v1_post", "x", "x", UTF8), WRONG_ATTRIBUTE),
    "not UTF-8": (
        lambda f: _set_attribute(f, "", "title", NOT_UTF8, h5py.string_dtype(length=4)),
        "not a readable result",
    ),
    "labels not UTF-8": (lambda f: f["title"].__setitem__((0, slice(0, 1)), b"\xe9"), "can't decode"),
    "100 MB of text": (
        lambda f: [_set_attribute(f, "", name, np.bytes_(b"x" * 50_000_000)) for name in "xy"],
        "bytes of text",
    ),
    "texts": (lambda f: _set_attribute(f, "v1_post", "x", ["a"] * 1000, UTF8), WRONG_ATTRIBUTE),
    "fixed texts": (lambda f: _set_attribute(f, "v1_post", "x", np.full(1000, b"abc")), WRONG_ATTRIBUTE),
    "65 numbers": (lambda f: _set_attribute(f, "v1_post", "x", np.zeros(65)), WRONG_ATTRIBUTE),
    "numbers in a table": (lambda f: _set_attribute(f, "", "x", np.zeros((9, 9))), WRONG_ATTRIBUTE),
    "compound attribute": (lambda f: _set_attribute(f, "v1_post", "x", np.zeros(3, "f8,i4")), WRONG_ATTRIBUTE),
    "bool attribute": (lambda f: _set_attribute(f, "v1_post", "x", True), WRONG_ATTRIBUTE),
    "reference attribute": (lambda f: _set_attribute(f, "", "x", f["e"].ref, h5py.ref_dtype), WRONG_ATTRIBUTE),
    "null attribute": (_add_null_attribute, WRONG_ATTRIBUTE),
    "axes without a name": (lambda f: f["v1_post"].attrs.__delitem__("_Netcdf4Coordinates"), WRONG_AXES),
    "axis of no number": (partial(_set_axis_numbers, name="v1_post", numbers=[0, 1, 99]), WRONG_AXES),
    "axes of one number": (partial(_set_axis_numbers, name="v1_post", numbers=[0, 1, 0]), WRONG_AXES),
    "axes of two lengths": (partial(_set_axis_numbers, name="v1_post", numbers=[0, 2, 1]), WRONG_AXES),
    "axes of texts": (partial(_set_axis_numbers, name="v1_post", numbers=np.bytes_(b"012")), WRONG_AXES),
    "axis along another": (partial(_set_axis_numbers, name="year", numbers=[2]), "year of the models is missing"),
    "axis of another name": (
        lambda f: [_set_axis_numbers(f, "e", [2]), _set_axis_numbers(f, "m2", [1])],
        WRONG_AXES,
    ),
    "unknown axis": (_add_unknown_axis, WRONG_AXES),
}


def _replace_bytes(path: Path, old: bytes, new: bytes, times: int = 1) -> None:
    """Replace all occurrences of some bytes, of which there are `times`."""
    assert len(old) == len(new)
    # a memory map: the file may be sparse and large
    with path.open("r+b") as file, mmap.mmap(file.fileno(), 0) as whole:
        positions = [match.start() for match in re.finditer(re.escape(old), whole)]
        assert len(positions) == times, (old, positions)
        for position in positions:
            whole[position : position + len(old)] = new


def _overflow_size(path: Path) -> None:
    """Declare a dataset whose size in bytes overflows to 8 in 64 bits."""
    with h5py.File(path, "r+") as file:
        file["other"] = np.zeros(12_347)
    _replace_bytes(path, struct.pack("<Q", 12_347), struct.pack("<Q", 2**61 + 1), 2)
    _replace_bytes(path, struct.pack("<Q", 8 * 12_347), struct.pack("<Q", 8))


def _share_offset(path: Path) -> None:
    """Declare datasets that all have their values at the same position of the file."""
    lengths = range(12_000, 12_004)
    with h5py.File(path, "r+") as file:
        file["other"] = np.zeros(12_347)
        position = file["other"].id.get_offset()
        for length in lengths:
            file.create_dataset(f"x{length}", shape=length, dtype="f8")
    for length in lengths:
        _replace_bytes(path, struct.pack("<QQ", 2**64 - 1, 8 * length), struct.pack("<QQ", position, 8 * length))


def _enlarge_attribute(path: Path, name: str, value: object, dtype: object) -> None:
    """Change the declared length of an attribute from 777 bytes to 4 GB."""
    with h5py.File(path, "r+") as file:
        # a variable that is stored again has no checksum
        replace_variable(file, "v1_post").attrs.create(name, value, dtype=dtype)
    whole = path.read_bytes()
    position = whole.rindex(struct.pack("<I", 777))
    path.write_bytes(whole[:position] + b"\xff" * 4 + whole[position + 4 :])


def _enlarge_references(path: Path) -> None:
    with h5py.File(path) as file:
        listed = np.empty(3, object)
        listed[:] = [np.array([file["e"].ref] * 777, h5py.ref_dtype)] * 3
    _enlarge_attribute(path, "DIMENSION_LIST", listed, h5py.vlen_dtype(h5py.ref_dtype))


PATCHES: dict[str, tuple[CreateFile, str]] = {
    "a length that wraps around": (_overflow_size, "not a readable result"),
    "data at one position": (_share_offset, TOO_MUCH_DATA),
    "attribute of 4 GB": (partial(_enlarge_attribute, name="x", value="y" * 777, dtype=UTF8), WRONG_ATTRIBUTE),
    "fixed attribute of 4 GB": (
        partial(_enlarge_attribute, name="x", value=b"y" * 777, dtype="S777"),
        "not a readable result",
    ),
}

USER_BLOCK = 512
# (position, level) of a node of a B-tree in the bytes of a file
Node = tuple[int, int]


def _set_child(content: bytearray, node: Node, child: int, target: Node) -> None:
    """Set the address of a child of a node in the B-tree of the chunks of a dataset with one axis."""
    key_bytes = 24
    struct.pack_into("<Q", content, node[0] + 24 + key_bytes + child * (key_bytes + 8), target[0] - USER_BLOCK)


def _set_level(content: bytearray, node: Node, level: int) -> None:
    content[node[0] + 5] = level


def _change_chunk_tree(path: Path, change: Callable[[bytearray, Node, list[Node]], object]) -> None:
    """Add a dataset of 100 chunks, and change the B-tree of these: `change(content, root, leaves)`."""
    with h5py.File(path, "r+") as file:
        file.create_dataset("other", data=np.arange(100.0), chunks=(1,))
    content = bytearray(path.read_bytes())
    nodes = [(match.start(), content[match.start() + 5]) for match in re.finditer(b"TREE\x01", content)]
    (root,) = (node for node in nodes if node[1] == 1)
    change(content, root, [node for node in nodes if node[1] == 0])
    path.write_bytes(content)


def _make_two_nodes_parents_of_each_other(content: bytearray, root: Node, leaves: list[Node]) -> None:
    _set_level(content, leaves[0], 1)
    _set_child(content, leaves[0], 0, root)


def _make_a_leaf_its_own_child(content: bytearray, _: Node, leaves: list[Node]) -> None:
    _set_level(content, leaves[0], 1)
    _set_child(content, leaves[0], 0, leaves[0])


def _close_a_loop_over_three_levels(content: bytearray, root: Node, leaves: list[Node]) -> None:
    _set_level(content, root, 2)
    _set_level(content, leaves[0], 1)
    _set_child(content, leaves[0], 0, leaves[1])
    _set_child(content, leaves[1], 0, root)


def _store_with_old_groups(path: Path) -> None:
    """Store the objects in a group of the first version, whose B-tree has itself as a child."""
    old = path.rename(path.with_name("old.h5"))
    with h5py.File(old) as source, h5py.File(path, "w", userblock_size=USER_BLOCK, track_order=False) as file:
        for name in source:
            source.copy(name, file)
        for name, value in source.attrs.items():
            file.attrs.create(name, value)
    old.unlink()
    content = bytearray(path.read_bytes())
    node = content.index(b"TREE\x00")
    content[node + 5] = 1
    struct.pack_into("<Q", content, node + 32, node - USER_BLOCK)
    path.write_bytes(content)


def _hide_old_groups(path: Path) -> None:
    """The same, and the superblock says that nothing is known of the root group."""
    _store_with_old_groups(path)
    content = bytearray(path.read_bytes())
    struct.pack_into("<I", content, USER_BLOCK + 72, 0)
    path.write_bytes(content)


def _continue_a_header_in_itself(path: Path) -> None:
    """Let the continuation of an object header contain a continuation in itself."""
    with h5py.File(path, "r+") as file:
        # unlike the variables, its header has no checksum; the header after it prevents that it grows
        other, _ = (file.create_dataset(name, data=np.zeros(9)) for name in ("other", "more"))
        for name in "xyz":
            other.attrs[name] = np.zeros(20)
        address = h5o.get_info(other.id).addr
    content = bytearray(path.read_bytes())

    def messages(start: int, size: int) -> dict[int, int]:
        """The messages of a block: the position of each by its type."""
        positions, at = {}, start + USER_BLOCK
        while at + 8 <= start + size + USER_BLOCK:
            kind, length = struct.unpack_from("<HH", content, at)
            positions[kind] = at
            at += 8 + length
        return positions

    continuation, attribute = 0x10, 0x0C
    (size,) = struct.unpack_from("<I", content, address + USER_BLOCK + 8)
    block = struct.unpack_from("<QQ", content, messages(address + 16, size)[continuation] + 8)
    position = messages(*block)[attribute]
    struct.pack_into("<H", content, position, continuation)
    struct.pack_into("<QQ", content, position + 8, *block)
    path.write_bytes(content)


def _add_type_in_itself(path: Path, holder: str) -> None:
    """Add an attribute with a type that is stored in another object, which says that it is stored in itself."""
    kind = np.dtype([(name, "f8") for name in "abc"])
    with h5py.File(path, "r+") as file:
        file["other"] = kind
        file[holder].attrs.create("x", np.zeros(1, kind), dtype=file["other"])
        address = h5o.get_info(file["other"].id).addr
        del file["other"]
    content = bytearray(path.read_bytes())
    # the header of the object has no checksum; its first message is the type
    message = address + USER_BLOCK + 16
    shared, in_an_object = 2, struct.pack("<BBQ", 3, 2, address)
    content[message + 4] = shared
    content[message + 8 : message + 8 + len(in_an_object)] = in_an_object
    path.write_bytes(content)


def _jenkins(content: bytes) -> int:
    """The checksum of HDF5, "lookup3" by Bob Jenkins."""

    def rotated(x: int, k: int) -> int:
        return (x << k | x >> 32 - k) & mask

    mask, size = 2**32 - 1, len(content)
    a = b = c = (0xDEADBEEF + size) & mask
    while size > 12:
        x, y, z = struct.unpack_from("<III", content, len(content) - size)
        a, b, c, size = a + x & mask, b + y & mask, c + z & mask, size - 12
        for k in (4, 6, 8, 16, 19, 4):
            a, c = (a - c & mask) ^ rotated(c, k), c + b & mask
            a, b, c = b, c, a
    x, y, z = struct.unpack("<III", content[len(content) - size :].ljust(12, b"\0"))
    a, b, c = a + x & mask, b + y & mask, c + z & mask
    for k in (14, 11, 25, 16, 4, 14, 24):
        c = (c ^ b) - rotated(b, k) & mask
        a, b, c = b, c, a
    return b if size else c


def _add_bifurcating_links(path: Path, depth: int = 40) -> None:
    """Index the links by a B-tree of 2^depth leaves in a few nodes: both children of a node are the same."""
    content = bytearray(path.read_bytes())
    (header,) = (match.start() for match in re.finditer(b"BTHD\x00\x05", content))
    node_bytes, record_bytes, _, _, _, leaf, n, total = struct.unpack_from("<IHHBBQHQ", content, header + 6)
    record = bytes(content[leaf + USER_BLOCK + 6 :][:record_bytes])
    # numbers take as many bytes as the largest number of records below a node needs
    in_leaf = (node_bytes - 10) // record_bytes
    below, width, child = in_leaf, 0, leaf
    for _ in range(depth):
        pointer = struct.pack("<QB", child, n if child == leaf else 1) + (total if width else 0).to_bytes(
            width, "little"
        )
        node = b"BTIN\x00\x05" + record + 2 * pointer
        child = len(content) - USER_BLOCK
        content += (node + struct.pack("<I", _jenkins(node))).ljust(node_bytes, b"\0")
        records = (node_bytes - 10 - len(pointer)) // (record_bytes + len(pointer))
        below = ((records + 1) * below + records) % 2**64
        width = (below.bit_length() + 7) // 8
    struct.pack_into("<HBBQHQ", content, header + 12, depth, 100, 40, child, 1, total)
    struct.pack_into("<I", content, header + 34, _jenkins(bytes(content[header : header + 34])))
    struct.pack_into("<Q", content, USER_BLOCK + 40, len(content))
    path.write_bytes(content)


def _add_newer_index(path: Path, **options: object) -> None:
    """Add a dataset whose chunks have an index of a later version of HDF5."""
    with h5py.File(path, "r+", libver="latest") as file:
        file.create_dataset("other", data=np.arange(100.0), **options)


# structures that the HDF5 library follows for ever, or until its stack overflows
CYCLES: dict[str, tuple[CreateFile, str]] = {
    **{
        name: (partial(_change_chunk_tree, change=change), WRONG_STRUCTURE)
        for name, change in {
            "a node is its first child": lambda content, root, _: _set_child(content, root, 0, root),
            "a node is its last child": lambda content, root, _: _set_child(content, root, 1, root),
            "two nodes are children of each other": _make_two_nodes_parents_of_each_other,
            "a leaf is its own child": _make_a_leaf_its_own_child,
            "a loop over three levels": _close_a_loop_over_three_levels,
            "a node is two children": lambda content, root, leaves: [
                _set_child(content, root, child, leaves[0]) for child in (0, 1)
            ],
            "a node with too many children": lambda content, root, _: struct.pack_into(
                "<H", content, root[0] + 6, 65_535
            ),
            "a leaf with too many chunks": lambda content, _, leaves: struct.pack_into(
                "<H", content, leaves[0][0] + 6, 65
            ),
        }.items()
    },
    "a group is its own child": (_store_with_old_groups, "not an HDF5 file as this program writes it"),
    "a hidden group is its own child": (_hide_old_groups, WRONG_STRUCTURE),
    "a header continues in itself": (_continue_a_header_in_itself, WRONG_STRUCTURE),
    "a type of a variable is stored in itself": (partial(_add_type_in_itself, holder="v1_post"), WRONG_STRUCTURE),
    "a type of the file is stored in itself": (partial(_add_type_in_itself, holder="/"), WRONG_STRUCTURE),
    "2^40 links in 40 nodes": (_add_bifurcating_links, WRONG_STRUCTURE),
    "links that are listed twice": (partial(_add_bifurcating_links, depth=1), WRONG_STRUCTURE),
    **{
        f"chunks in {name}": (partial(_add_newer_index, **options), WRONG_STRUCTURE)
        for name, options in {
            "a fixed array": {"chunks": (1,)},
            "an extensible array": {"chunks": (1,), "maxshape": (None,)},
            "one piece": {"chunks": (100,)},
        }.items()
    },
}

# defects that impact does not read
HARMLESS: dict[str, CreateFile] = {
    "references of 34 GB": _enlarge_references,
}


def _change_json(file: h5py.File, attribute: str, change: Callable[[Any], object]) -> None:
    """Change the JSON value of an attribute; `change` modifies it or returns a new value."""
    value = json.loads(file.attrs[attribute])
    text = json.dumps(change(value) or value).encode()
    file.attrs.create(attribute, np.bytes_(text))


def change_law(file: h5py.File, **entries: object) -> None:
    """Change entries of the first law in a factored file."""
    _change_json(file, "laws", lambda laws: laws["bilinear"].update(entries))


def _set_value(file: h5py.File, name: str, position: int, value: float) -> None:
    file[name][position] = value


LAWS_MISFIT = "its laws do not fit its table"
NOT_JSON = "not JSON of the expected type"
WRONG_LAWS = "laws: not those of its models"
WRONG_GRID = "axes: not those of its grid"
WRONG_WITNESSES = "its witnesses have other values"
SUMMARY = {"status": {"ok": 8}, "not_evaluated": 0, "worst": {}, "failed_at": [], "extremes": {}}


def _set_summary(file: h5py.File, **entries: object) -> None:
    _set_attribute(file, "", "summary", np.bytes_(json.dumps(SUMMARY | entries).encode()))


WRONG_SUMMARY = "summary: not that of its points"
# defects of a factored file
FACTORED: dict[str, tuple[ChangeFile, str]] = {
    "laws of text": (lambda f: _set_attribute(f, "", "laws", np.bytes_(b"x")), NOT_JSON),
    "laws in a list": (lambda f: _change_json(f, "laws", list), NOT_JSON),
    "laws without an end": (lambda f: _set_attribute(f, "", "laws", np.bytes_(b"[" * 100_000)), NOT_JSON),
    "a law less": (lambda f: _change_json(f, "laws", lambda laws: {"bilinear": laws["bilinear"]}), WRONG_LAWS),
    "laws in another order": (
        lambda f: _change_json(f, "laws", lambda laws: dict(reversed(laws.items()))),
        WRONG_LAWS,
    ),
    "a law of nothing": (lambda f: _change_json(f, "laws", lambda laws: laws.update(bilinear=None)), NOT_JSON),
    "a law without its axes": (
        lambda f: _change_json(f, "laws", lambda laws: laws["bilinear"].pop("axes") and None),
        NOT_JSON,
    ),
    "a law along no axis": (partial(change_law, axes=["twice"]), LAWS_MISFIT),
    "a law along an axis twice": (partial(change_law, axes=["alpha", "alpha"]), LAWS_MISFIT),
    "a law along a number": (partial(change_law, axes=[0]), NOT_JSON),
    "a law along fewer axes": (partial(change_law, axes=["alpha"]), LAWS_MISFIT),
    "a law of a domain in a list": (partial(change_law, domain=[1, 2]), NOT_JSON),
    "an exponent of text": (partial(change_law, exponent="x"), NOT_JSON),
    "another exponent": (partial(change_law, exponent=1.5), WRONG_WITNESSES),
    "one trajectory more": (partial(change_law, trajectories=4), LAWS_MISFIT),
    "one trajectory less": (partial(change_law, trajectories=2), LAWS_MISFIT),
    "fewer trajectories than none": (partial(change_law, trajectories=-1), LAWS_MISFIT),
    "1e30 trajectories": (partial(change_law, trajectories=10**30), LAWS_MISFIT),
    "trajectories of text": (partial(change_law, trajectories="three"), NOT_JSON),
    "trajectories that are not shared": (partial(change_law, is_shared=False), LAWS_MISFIT),
    "a rule of K without values": (partial(change_law, stiffness_axes=["alpha"]), LAWS_MISFIT),
    "axes of text": (lambda f: _set_attribute(f, "", "axes", np.bytes_(b"x")), NOT_JSON),
    "axes in a table": (lambda f: _change_json(f, "axes", lambda axes: dict.fromkeys(axes, 1)), NOT_JSON),
    "an unknown axis": (lambda f: _change_json(f, "axes", lambda axes: [*axes, "twice"]), WRONG_GRID),
    "an axis twice": (lambda f: _change_json(f, "axes", lambda axes: [*axes, axes[0]]), WRONG_GRID),
    "an axis less": (lambda f: _change_json(f, "axes", lambda axes: axes[:1]), "does not lie along one axis"),
    "axes in another order": (lambda f: _change_json(f, "axes", lambda axes: axes[::-1]), WRONG_WITNESSES),
    "axes without an end": (lambda f: _set_attribute(f, "", "axes", np.bytes_(b"[" * 100_000)), NOT_JSON),
    "a summary of text": (lambda f: _set_attribute(f, "", "summary", np.bytes_(b"x")), NOT_JSON),
    "a summary in a list": (lambda f: _set_attribute(f, "", "summary", np.bytes_(b"[]")), NOT_JSON),
    "a summary of fewer points than none": (partial(_set_summary, status={"ok": 9, "limit": -1}), NOT_JSON),
    "a summary of other points": (partial(_set_summary, status={"ok": 9}), WRONG_SUMMARY),
    "a summary of more points than evaluated ones": (
        partial(_set_summary, status={"ok": 9}, not_evaluated=1),
        WRONG_SUMMARY,
    ),
    "a summary of an unknown status": (partial(_set_summary, status={"good": 8}), WRONG_SUMMARY),
    "a summary of another model": (partial(_set_summary, worst={"e_error": {"hertz": 1.0}}), WRONG_SUMMARY),
    "a summary of a point that is not there": (
        partial(_set_summary, failed_at=[["max_steps", "bilinear", [0, 2]]]),
        WRONG_SUMMARY,
    ),
    "a summary of a point along one axis": (
        partial(_set_summary, failed_at=[["max_steps", "bilinear", [0]]]),
        WRONG_SUMMARY,
    ),
    "materials in a list": (lambda f: _set_attribute(f, "", "materials", np.bytes_(b"[]")), "materials: not JSON"),
    "no materials": (lambda f: _set_attribute(f, "", "materials", np.bytes_(b"{}")), "not a readable result"),
    "a material of text": (
        lambda f: _set_attribute(f, "", "materials", np.bytes_(b'{"a": "x"}')),
        "materials: not JSON",
    ),
    "a trajectory that is not there": (
        partial(_set_value, name="trajectory_of_cell", position=5, value=3),
        LAWS_MISFIT,
    ),
    "a trajectory before the first": (
        partial(_set_value, name="trajectory_of_cell", position=5, value=-1),
        LAWS_MISFIT,
    ),
    "trajectories in fractions": (
        lambda f: replace_variable(f, "trajectory_of_cell", data=f["trajectory_of_cell"][()].astype(float)),
        LAWS_MISFIT,
    ),
    "a table less": (lambda f: f.__delitem__("trajectory_peak"), LAWS_MISFIT),
    "a table of cells less": (lambda f: f.__delitem__("trajectory_of_cell"), LAWS_MISFIT),
    "a table of text": (
        lambda f: replace_variable(f, "trajectory_peak", data=np.full(6, b"x", "S1")),
        "not a readable result",
    ),
    "an unknown status": (partial(_set_value, name="trajectory_status", position=5, value=99), LAWS_MISFIT),
    "a status of its own kind": (
        lambda f: replace_variable(f, "trajectory_status", data=f["trajectory_status"][()].astype("i2")),
        LAWS_MISFIT,
    ),
    "witnesses elsewhere": (
        partial(_set_value, name="witness_index", position=5, value=4),
        "its witnesses are not at",
    ),
    "no index of witnesses": (lambda f: f.__delitem__("witness_index"), "not a readable result"),
    "no witnesses": (
        lambda f: [f.__delitem__(name) for name in list(f) if name.startswith("witness_")],
        "not a readable",
    ),
    "another witness": (
        lambda f: _set_value(f, "witness_v1_post", 5, f["witness_v1_post"][5] + 1e-6),
        WRONG_WITNESSES,
    ),
    "another last witness": (
        lambda f: _set_value(f, "witness_v1_post", 7, f["witness_v1_post"][7] - 1e-6),
        WRONG_WITNESSES,
    ),
    "a witness that is no number": (
        partial(_set_value, name="witness_e_out", position=3, value=np.nan),
        WRONG_WITNESSES,
    ),
    "a number for NaN": (
        partial(_set_value, name="witness_damping_ratio", position=0, value=0.5),
        WRONG_WITNESSES,
    ),
    "another status of a witness": (
        partial(_set_value, name="witness_status", position=2, value=2),
        WRONG_WITNESSES,
    ),
    "another trajectory": (partial(_set_value, name="trajectory_e_out", position=0, value=0.123), WRONG_WITNESSES),
    "witnesses as text": (
        lambda f: replace_variable(f, "witness_e_out", data=np.full(8, b"x", "S1")),
        "not a readable result",
    ),
    "steps as fractions": (
        lambda f: replace_variable(f, "witness_steps", data=f["witness_steps"][()].astype(float)),
        "steps: got float64",
    ),
}
# invalid values of an entry of a law
INVALID_LAW_VALUES = (
    None,
    True,
    -1,
    10**30,
    float("inf"),
    0.5,
    "",
    "alpha",
    [],
    ["v1"],
    ["alpha", "v1", "alpha"],
    {},
    {"e": 1},
    {"e": [0, "x"]},
    [[]],
    {"e": [0.0, 1.0]},
)
