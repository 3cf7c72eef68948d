"""Files that do harm, each a genuine result in which one thing is wrong, and the words that refuse it.

Each is sealed after it was changed, so that the seal refuses nothing: anyone can seal a file.
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
from h5py import h5a, h5d, h5p, h5s, h5t, h5z
from scipy.io import netcdf_file

from impact.results.seal import write_seal

SECRET = b"the secret 1234567"
UTF8 = h5py.string_dtype()
HERE = "not stored in this file, in one piece or in chunks of one size"
MUCH = "declares more data than a file of this size may hold"
KIND = "expected numbers or labels"
HOLDS = "declares data that the file does not hold"
NO_SEAL = "does not begin with the header of a sealed file"
CHUNK = "a chunk of unexpected size"
AXES = "its axes are not those of the file"
ODD = "an attribute of unexpected type or size"
Make = Callable[[Path], object]
Change = Callable[[h5py.File], object]


def _netcdf3(path: Path) -> None:
    with netcdf_file(path, "w") as file:
        file.createDimension("e", 3)
        file.schema_version = 1


NOT_SEALED: dict[str, tuple[Make, str]] = {
    "empty": (lambda path: path.write_bytes(b""), NO_SEAL),
    "text": (lambda path: path.write_bytes(SECRET), NO_SEAL),
    "png": (lambda path: path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(1000)), NO_SEAL),
    "netCDF-3": (_netcdf3, NO_SEAL),
    "magic": (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n"), "is of schema version 1"),
    "magic and zeros": (
        lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(9999)), "is of schema version 1"),
    "FIFO": (os.mkfifo, "is not a regular file"),
    "device": (lambda path: path.symlink_to("/dev/zero"), "is not a regular file"),
    "folder": (lambda path: path.mkdir(), "is not a regular file"),
    "link to a folder": (lambda path: path.symlink_to("."), "is not a regular file"),
    "link to nothing": (lambda path: path.symlink_to("nothing"), "does not exist"),
    "link to itself": (lambda path: path.symlink_to(path.name), "bad.h5: "),
}  # fmt: skip


def seal(path: Path) -> None:
    """Seal a file as it is now."""
    with path.open("r+b") as file:
        write_seal(file)


def anew(file: h5py.File, name: str, **how: object) -> h5py.Dataset:
    """Store a variable again, with the same numbers, axes and attributes, but in another way."""
    old = file[name]
    values, attributes = old[()], {key: old.attrs[key] for key in old.attrs if key != "DIMENSION_LIST"}
    scales = [dimension[0].name for dimension in old.dims]
    del file[name]
    new = file.create_dataset(name, **({"data": values} | how))
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


def _soft_link(file: h5py.File) -> None:
    file.move("v1_post", "duration_")
    file["v1_post"] = h5py.SoftLink("/duration_")


def _external_storage(file: h5py.File, name: str) -> None:
    values = file["v1_post"][()]
    _beside(file, "secret.bin").write_bytes(values.tobytes() + SECRET)
    how = {"data": None, "shape": values.shape, "dtype": "f8", "external": "secret.bin"}
    anew(file, name, **how) if name in file else file.create_dataset(name, **how)


def _virtual(file: h5py.File, source: str) -> None:
    values = file["v1_post"][()]
    with h5py.File(_beside(file, "secret.h5"), "w") as other:
        other["v1_post"] = values
    layout = h5py.VirtualLayout(values.shape, "f8")
    layout[:] = h5py.VirtualSource(source, "v1_post", values.shape)
    file.create_virtual_dataset("other", layout)


def _compact(file: h5py.File) -> None:
    plan = h5p.create(h5p.DATASET_CREATE)
    plan.set_layout(h5d.COMPACT)
    h5d.create(file.id, b"other", h5t.IEEE_F64LE, h5s.create_simple((3,)), plan)


def _in_chunks(file: h5py.File, content: bytes | None = None, mask: int = 0) -> None:
    """A variable in packed chunks, of which the first holds this; the others are right, or none is there."""
    values = file["v1_post"][()]
    new = anew(file, "v1_post", data=None, shape=values.shape, dtype="f8", compression="gzip", chunks=(1, 3, 2))
    if content is not None:
        new[1:] = values[1:]
    if content:
        new.id.write_direct_chunk((0, 0, 0), content, mask)


def _bomb(file: h5py.File) -> None:
    """A chunk of six numbers that unpacks to a gigabyte."""
    pack = zlib.compressobj(9)
    _in_chunks(file, b"".join([*(pack.compress(bytes(2**20)) for _ in range(2**10)), pack.flush()]))


def _packed(file: h5py.File, filters: list[int]) -> None:
    """A dataset in a chunk on which filters work."""
    plan = h5p.create(h5p.DATASET_CREATE)
    plan.set_chunk((3,))
    for code in filters:
        plan.set_filter(code, 0, (4,) if code == h5z.FILTER_DEFLATE else ())
    h5d.create(file.id, b"other", h5t.IEEE_F64LE, h5s.create_simple((3,)), plan)


def _long_axis(file: h5py.File, **how: object) -> None:
    """A variable along an axis of many values, of which the file holds no more than a few."""
    attributes = dict(file["e"].attrs)
    del file["e"], file["v1_post"]
    axis = file.create_dataset("e", shape=(10**9,), dtype="f8", **how)
    if axis.chunks:
        axis[: axis.chunks[0]] = 0.5
    for key in ("CLASS", "NAME", "_Netcdf4Dimid"):
        axis.attrs.create(key, attributes[key])


def _of_kind(file: h5py.File, kind: h5t.TypeID) -> None:
    plan = h5p.create(h5p.DATASET_CREATE)
    plan.set_alloc_time(h5d.ALLOC_TIME_EARLY)
    h5d.create(file.id, b"other", kind, h5s.create_simple((3,)), plan)


def _seven_bits() -> h5t.TypeID:
    kind = h5t.STD_I8LE.copy()
    kind.set_precision(7)
    return kind


def _nested(file: h5py.File) -> None:
    group = file
    for _ in range(3000):
        group = group.create_group("g")


def _many_links(file: h5py.File) -> None:
    for number in range(100_000):
        file.id.links.create_hard(b"x%d" % number, file.id, b"e")


def _many_attributes(file: h5py.File) -> None:
    for number in range(10_000):
        file["e"].attrs.create(f"x{number}", 1)


def _bare(file: h5py.File, name: str, **how: object) -> None:
    file.create_dataset(name, **how)


def _null(file: h5py.File) -> None:
    h5a.create(file["v1_post"].id, b"x", h5t.IEEE_F64LE, h5s.create(h5s.NULL))


def _numbered(file: h5py.File, name: str, numbers: object) -> None:
    file[name].attrs["_Netcdf4Coordinates"] = numbers


def _unknown_axis(file: h5py.File) -> None:
    file["x"] = [1.0, 2.0, 3.0]
    file["x"].make_scale("x")
    _numbered(file, "x", [7])
    _numbered(file, "v1_post", [0, 7, 2])


def _set(file: h5py.File, holder: str, name: str, value: object, dtype: object = None) -> None:
    (file[holder] if holder else file).attrs.create(name, value, dtype=dtype)


def _without(file: h5py.File, name: str) -> None:
    del file.attrs[name]


BROKEN = b"caf\xe9"
CHANGES: dict[str, tuple[Change, str]] = {
    "no schema": (partial(_without, name="schema_version"), "is not a result of impact"),
    "later schema": (lambda f: _set(f, "", "schema_version", 99), "schema version 99"),
    "huge schema": (lambda f: _set(f, "", "schema_version", 2**64 - 1, "u8"), "version 18446744073709551615"),
    "schema of text": (lambda f: _set(f, "", "schema_version", "1"), "not a number"),
    "schema of two": (lambda f: _set(f, "", "schema_version", [1, 1]), "not a number"),
    "schema of a million": (lambda f: _set(f, "", "schema_version", np.ones(8000, int)), "not a number"),
    "external link": (_link_to_hdf5, "not a hard link"),
    "external link to text": (_link_to_text, "not a hard link"),
    "soft link": (_soft_link, "not a hard link"),
    "dangling link": (lambda f: f.__setitem__("other", h5py.SoftLink("/nowhere")), "not a hard link"),
    "second name": (lambda f: f.__setitem__("other", f["v1_post"]), "a dataset with two names"),
    "a group": (lambda f: f.create_group("other"), "not a dataset"),
    "3,000 groups": (_nested, "not a dataset"),
    "a type": (lambda f: f.__setitem__("other", np.dtype("f8")), "not a dataset"),
    "100,000 links": (_many_links, "more than 1,000 datasets"),
    "external storage": (partial(_external_storage, name="v1_post"), HERE),
    "external storage of another": (partial(_external_storage, name="other"), HERE),
    "virtual": (partial(_virtual, source="secret.h5"), HERE),
    "virtual without source": (partial(_virtual, source="nowhere.h5"), HERE),
    "growing": (partial(anew, name="v1_post", maxshape=(None, None, None), chunks=True), HERE),
    "another filter": (partial(anew, name="v1_post", compression="lzf"), HERE),
    "checksums": (partial(anew, name="v1_post", fletcher32=True), HERE),
    "a million chunks": (partial(_bare, name="other", shape=10**6, dtype="i1", chunks=(1,)), "200,000 chunks"),
    "zip bomb": (
        partial(_bare, name="other", shape=10**8, dtype="f8", compression="gzip", chunks=(10**6,)), HOLDS),
    "zip bomb in a chunk": (_bomb, CHUNK),
    "short chunk": (partial(_in_chunks, content=zlib.compress(b"short")), CHUNK),
    "damaged chunk": (partial(_in_chunks, content=b"not zlib"), "not a readable result"),
    "unpacked chunk": (partial(_in_chunks, content=bytes(48), mask=1), CHUNK),
    "packed twice": (lambda f: _packed(f, [h5z.FILTER_DEFLATE] * 2), HERE),
    "shuffled alone": (lambda f: _packed(f, [h5z.FILTER_SHUFFLE]), HERE),
    "no chunks": (_in_chunks, HOLDS),
    "a chunk is missing": (partial(_in_chunks, content=b"", mask=-1), HOLDS),
    "compact": (_compact, HERE),
    "1e15 numbers": (partial(_bare, name="other", shape=(10**15,), dtype="f8"), AXES),
    "1e15 labels": (partial(_bare, name="other", shape=(10**15,), dtype="S1"), AXES),
    "1e9 numbers of an axis": (_long_axis, "not a readable result"),
    "1e9 numbers of an axis in chunks": (partial(_long_axis, chunks=(10**4,)), MUCH),
    "1e9 numbers of an axis, packed": (partial(_long_axis, chunks=(10**4,), compression="gzip"), MUCH),
    "1e15 numbers of a known name": (
        lambda f: anew(f, "v1_post", data=None, shape=(10**5,) * 3, dtype="f8"), AXES),
    "no numbers": (partial(_bare, name="other", shape=(0,), dtype="f8"), HERE),
    "null": (partial(_bare, name="other", data=h5py.Empty("f8")), HERE),
    **{f"{name} as {kind}": (
        lambda f, name=name, kind=kind: anew(f, name, data=f[name][()].astype(kind)),
        f"{name}: got {np.dtype(kind)}")
       for name, kind in (("e_out", "i4"), ("status", "f8"), ("status", "i4"), ("steps", "f8"), ("v1_post", "i8"))
    },
    "compound": (partial(_bare, name="other", data=np.zeros(3, "f8,i4")), KIND),
    "complex": (partial(_bare, name="other", data=np.zeros(3, complex)), KIND),
    "enum": (partial(_bare, name="other", data=np.zeros(3, bool)), KIND),
    "opaque": (partial(_bare, name="other", data=np.zeros(3, "V8")), KIND),
    "reference": (partial(_bare, name="other", shape=3, dtype=h5py.ref_dtype), KIND),
    "region": (partial(_bare, name="other", shape=3, dtype=h5py.regionref_dtype), KIND),
    "array": (partial(_of_kind, kind=h5t.array_create(h5t.IEEE_F64LE, (4,))), KIND),
    "lists": (partial(_bare, name="other", shape=3, dtype=h5py.vlen_dtype(float)), KIND),
    "bits": (partial(_of_kind, kind=h5t.STD_B8LE), KIND),
    "fixed text": (partial(_bare, name="other", data=np.array([b"abc"])), KIND),
    "long double": (partial(_bare, name="other", data=np.zeros(3, np.longdouble)), KIND),
    "seven bits": (lambda f: _of_kind(f, _seven_bits()), KIND),
    "10 MB of labels": (
        lambda f: anew(f, "doi", data=np.full((2, 5_000_000), b"x", "S1")), "more than 4,000,000 bytes of labels"),
    "labels of any length": (
        lambda f: anew(f, "title", data=np.array([["a"], ["b"]], object), dtype=UTF8), KIND),
    "labels of letters in pairs": (lambda f: anew(f, "title", data=np.full((2, 9), b"ab", "S2")), KIND),
    "labels in a single place": (partial(_bare, name="other", data=np.array(b"x", "S1")), KIND),
    "many attributes": (_many_attributes, "more than 10,000 attributes"),
    "text of any length": (lambda f: _set(f, "v1_post", "x", "x", UTF8), ODD),
    "not UTF-8": (lambda f: _set(f, "", "title", BROKEN, h5py.string_dtype(length=4)), "not a readable result"),
    "labels not UTF-8": (lambda f: f["title"].__setitem__((0, slice(0, 1)), b"\xe9"), "can't decode"),
    "100 MB of text": (
        lambda f: [_set(f, "", name, np.bytes_(b"x" * 50_000_000)) for name in "xy"], "bytes of text"),
    "texts": (lambda f: _set(f, "v1_post", "x", ["a"] * 1000, UTF8), ODD),
    "fixed texts": (lambda f: _set(f, "v1_post", "x", np.full(1000, b"abc")), ODD),
    "65 numbers": (lambda f: _set(f, "v1_post", "x", np.zeros(65)), ODD),
    "numbers in a table": (lambda f: _set(f, "", "x", np.zeros((9, 9))), ODD),
    "compound attribute": (lambda f: _set(f, "v1_post", "x", np.zeros(3, "f8,i4")), ODD),
    "bool attribute": (lambda f: _set(f, "v1_post", "x", True), ODD),
    "reference attribute": (lambda f: _set(f, "", "x", f["e"].ref, h5py.ref_dtype), ODD),
    "null attribute": (_null, ODD),
    "axes without a name": (lambda f: f["v1_post"].attrs.__delitem__("_Netcdf4Coordinates"), AXES),
    "axis of no number": (partial(_numbered, name="v1_post", numbers=[0, 1, 99]), AXES),
    "axes of one number": (partial(_numbered, name="v1_post", numbers=[0, 1, 0]), AXES),
    "axes of two lengths": (partial(_numbered, name="v1_post", numbers=[0, 2, 1]), AXES),
    "axes of texts": (partial(_numbered, name="v1_post", numbers=np.bytes_(b"012")), AXES),
    "axis along another": (partial(_numbered, name="year", numbers=[2]), "year of the models is missing"),
    "axis of another name": (lambda f: [_numbered(f, "e", [2]), _numbered(f, "m2", [1])], AXES),
    "unknown axis": (_unknown_axis, AXES),
}  # fmt: skip


def swap(path: Path, was: bytes, becomes: bytes, times: int = 1) -> None:
    """Change bytes that stand in a file so many times."""
    assert len(was) == len(becomes)
    # in place: a file may be larger than its bytes on the disk
    with path.open("r+b") as file, mmap.mmap(file.fileno(), 0) as whole:
        places = [found.start() for found in re.finditer(re.escape(was), whole)]
        assert len(places) == times, (was, places)
        for place in places:
            whole[place : place + len(was)] = becomes


def _wraps(path: Path) -> None:
    """A dataset whose size in bytes is 8 again, where it is counted in 64 bits."""
    with h5py.File(path, "r+") as file:
        file["other"] = np.zeros(12_347)
    swap(path, struct.pack("<Q", 12_347), struct.pack("<Q", 2**61 + 1), 2)
    swap(path, struct.pack("<Q", 8 * 12_347), struct.pack("<Q", 8))


def _one_place(path: Path) -> None:
    """Datasets that all have their numbers at the same place of the file."""
    lengths = range(12_000, 12_004)
    with h5py.File(path, "r+") as file:
        file["other"] = np.zeros(12_347)
        place = file["other"].id.get_offset()
        for length in lengths:
            file.create_dataset(f"x{length}", shape=length, dtype="f8")
    for length in lengths:
        swap(path, struct.pack("<QQ", 2**64 - 1, 8 * length), struct.pack("<QQ", place, 8 * length))


def _attribute(path: Path, name: str, value: object, dtype: object) -> None:
    """An attribute whose length, 777, is said to be 4 GB."""
    with h5py.File(path, "r+") as file:
        # one that is made anew has no checksum
        anew(file, "v1_post").attrs.create(name, value, dtype=dtype)
    whole = path.read_bytes()
    place = whole.rindex(struct.pack("<I", 777))
    path.write_bytes(whole[:place] + b"\xff" * 4 + whole[place + 4 :])


def _references(path: Path) -> None:
    with h5py.File(path) as file:
        listed = np.empty(3, object)
        listed[:] = [np.array([file["e"].ref] * 777, h5py.ref_dtype)] * 3
    _attribute(path, "DIMENSION_LIST", listed, h5py.vlen_dtype(h5py.ref_dtype))


PATCHES: dict[str, tuple[Make, str]] = {
    "a length that wraps around": (_wraps, "not a readable result"),
    "data of one place": (_one_place, MUCH),
    "attribute of 4 GB": (partial(_attribute, name="x", value="y" * 777, dtype=UTF8), ODD),
    "fixed attribute of 4 GB": (
        partial(_attribute, name="x", value=b"y" * 777, dtype="S777"), "not a readable result"),
}  # fmt: skip

# what other readers would fall for, and is not read here
HARMLESS: dict[str, Make] = {
    "references of 34 GB": _references,
}


def _json(file: h5py.File, attribute: str, change: Callable[[Any], object]) -> None:
    """What an attribute holds as JSON, changed in place or returned anew."""
    held = json.loads(file.attrs[attribute])
    text = json.dumps(change(held) or held).encode()
    file.attrs.create(attribute, np.bytes_(text))


def change_law(file: h5py.File, **about: object) -> None:
    """What a factored file says of its first law."""
    _json(file, "laws", lambda laws: laws["bilinear"].update(about))


def _put(file: h5py.File, name: str, place: int, value: float) -> None:
    file[name][place] = value


FIT = "its laws do not fit its table"
JSON = "not JSON of the expected type"
LAWS = "laws: not those of its models"
GRID = "axes: not those of its grid"
WITNESSES = "its witnesses expand to other numbers"
# what is wrong with a factored file
FACTORED: dict[str, tuple[Change, str]] = {
    "laws of text": (lambda f: _set(f, "", "laws", np.bytes_(b"x")), JSON),
    "laws in a list": (lambda f: _json(f, "laws", list), JSON),
    "laws without an end": (lambda f: _set(f, "", "laws", np.bytes_(b"[" * 100_000)), JSON),
    "a law less": (lambda f: _json(f, "laws", lambda laws: {"bilinear": laws["bilinear"]}), LAWS),
    "laws in another order": (lambda f: _json(f, "laws", lambda laws: dict(reversed(laws.items()))), LAWS),
    "a law of nothing": (lambda f: _json(f, "laws", lambda laws: laws.update(bilinear=None)), JSON),
    "a law without its axes": (
        lambda f: _json(f, "laws", lambda laws: laws["bilinear"].pop("axes") and None), FIT),
    "a law along no axis": (partial(change_law, axes=["twice"]), FIT),
    "a law along an axis twice": (partial(change_law, axes=["alpha", "alpha"]), FIT),
    "a law along a number": (partial(change_law, axes=[0]), FIT),
    "a law along fewer axes": (partial(change_law, axes=["alpha"]), FIT),
    "a law of a domain in a list": (partial(change_law, domain=[1, 2]), FIT),
    "an exponent of text": (partial(change_law, exponent="x"), FIT),
    "another exponent": (partial(change_law, exponent=1.5), WITNESSES),
    "one trajectory more": (partial(change_law, trajectories=4), FIT),
    "one trajectory less": (partial(change_law, trajectories=2), FIT),
    "fewer trajectories than none": (partial(change_law, trajectories=-1), FIT),
    "1e30 trajectories": (partial(change_law, trajectories=10**30), FIT),
    "trajectories of text": (partial(change_law, trajectories="three"), FIT),
    "trajectories that are not shared": (partial(change_law, is_shared=False), FIT),
    "a rule of K without values": (partial(change_law, stiffness_axes=["alpha"]), FIT),
    "axes of text": (lambda f: _set(f, "", "axes", np.bytes_(b"x")), JSON),
    "axes in a table": (lambda f: _json(f, "axes", lambda axes: dict.fromkeys(axes, 1)), JSON),
    "an unknown axis": (lambda f: _json(f, "axes", lambda axes: [*axes, "twice"]), GRID),
    "an axis twice": (lambda f: _json(f, "axes", lambda axes: [*axes, axes[0]]), GRID),
    "an axis less": (lambda f: _json(f, "axes", lambda axes: axes[:1]), "does not lie along one axis"),
    "axes in another order": (lambda f: _json(f, "axes", lambda axes: axes[::-1]), WITNESSES),
    "axes without an end": (lambda f: _set(f, "", "axes", np.bytes_(b"[" * 100_000)), JSON),
    "materials in a list": (lambda f: _set(f, "", "materials", np.bytes_(b"[]")), "materials: not JSON"),
    "no materials": (lambda f: _set(f, "", "materials", np.bytes_(b"{}")), "not a readable result"),
    "a material of text": (lambda f: _set(f, "", "materials", np.bytes_(b'{"a": "x"}')), "materials: not JSON"),
    "a trajectory that is not there": (partial(_put, name="trajectory_of_cell", place=5, value=3), FIT),
    "a trajectory before the first": (partial(_put, name="trajectory_of_cell", place=5, value=-1), FIT),
    "trajectories in fractions": (
        lambda f: anew(f, "trajectory_of_cell", data=f["trajectory_of_cell"][()].astype(float)), FIT),
    "a table less": (lambda f: f.__delitem__("trajectory_peak"), FIT),
    "a table of cells less": (lambda f: f.__delitem__("trajectory_of_cell"), FIT),
    "a table of text": (
        lambda f: anew(f, "trajectory_peak", data=np.full(6, b"x", "S1")), "not a readable result"),
    "an unknown status": (partial(_put, name="trajectory_status", place=5, value=99), FIT),
    "a status of its own kind": (
        lambda f: anew(f, "trajectory_status", data=f["trajectory_status"][()].astype("i2")), FIT),
    "witnesses elsewhere": (partial(_put, name="witness_index", place=5, value=4), "its witnesses are not at"),
    "no index of witnesses": (lambda f: f.__delitem__("witness_index"), "not a readable result"),
    "no witnesses": (
        lambda f: [f.__delitem__(name) for name in list(f) if name.startswith("witness_")], "not a readable"),
    "another witness": (lambda f: _put(f, "witness_v1_post", 5, f["witness_v1_post"][5] + 1e-6), WITNESSES),
    "another last witness": (lambda f: _put(f, "witness_v1_post", 7, f["witness_v1_post"][7] - 1e-6), WITNESSES),
    "a witness that is no number": (partial(_put, name="witness_e_out", place=3, value=np.nan), WITNESSES),
    "a number for NaN": (partial(_put, name="witness_damping_ratio", place=0, value=0.5), WITNESSES),
    "another status of a witness": (partial(_put, name="witness_status", place=2, value=2), WITNESSES),
    "another trajectory": (partial(_put, name="trajectory_e_out", place=0, value=0.123), WITNESSES),
    "witnesses as text": (
        lambda f: anew(f, "witness_e_out", data=np.full(8, b"x", "S1")), "not a readable result"),
    "steps as fractions": (
        lambda f: anew(f, "witness_steps", data=f["witness_steps"][()].astype(float)), "steps: got float64"),
}  # fmt: skip
# values that a law cannot have
JUNK = (None, True, -1, 10**30, float("inf"), 0.5, "", "alpha", [], ["v1"], ["alpha", "v1", "alpha"], {}, {"e": 1},
        {"e": [0, "x"]}, [[]], {"e": [0.0, 1.0]})  # fmt: skip
