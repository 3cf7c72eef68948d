"""The grid of a config: its axes and scalars."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pydantic import ValidationError

from ..contact.outputs import BY_DEFAULT
from .quantities import MAX_FAULTS, Fault, KeyPath, Names, Numbers, Quantity, Range, nearest, show

# of all models together, where nothing else is said
MAX_POINTS = 10**9
# that can be counted, where they are not stored one by one
MAX_COUNTED_POINTS = 2**62
# HDF5 has arrays of 32 dimensions, one of which is that of the models
MAX_AXES = 31
FULL = ' in layout "full" (--max-points); layout = "factored" stores any number'
# chunks of a result, and points of a chunk: a reader opens each, and holds it as a whole
MAX_STORED_CHUNKS, MAX_CHUNK_POINTS = 100_000, 2**22
# bytes that the outputs of a point take at most, by default
WIDTH = 8 * len(BY_DEFAULT)

Values = tuple[float, ...] | tuple[str, ...]


@dataclass(frozen=True)
class Axis:
    """One dimension of the grid: the columns of a zip group or of a table of cases, or one column.

    Parameters
    ----------
    columns : values by config name, all of one length
    numbered : name of a dimension whose points are numbered from 0, since no column names them: that of a table
        of cases, or of a group with repeated values; empty where the first column names the points
    numbers : those of its points, where it is a part of such a dimension; empty for the whole

    >>> Axis({"m1": (1.0, 2.0), "m2": (2.0, 4.0)}).name
    'm1'
    >>> Axis({"v1": (1.0, 1.0)}, numbered="case").labels
    (0, 1)
    """

    columns: Mapping[str, Values]
    numbered: str = ""
    numbers: tuple[int, ...] = ()

    @property
    def name(self) -> str:
        """Of the dimension."""
        return self.numbered or next(iter(self.columns))

    @property
    def size(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def labels(self) -> tuple[float, ...] | tuple[str, ...]:
        """What names its points: the values of the first column, or their numbers."""
        return (self.numbers or tuple(range(self.size))) if self.numbered else self.columns[self.name]


@dataclass(frozen=True)
class Grid:
    """Scalars by name, axes in config order, and what is wrong with them."""

    scalars: Mapping[str, float | str]
    axes: tuple[Axis, ...]
    faults: tuple[Fault, ...]


def lay_out(
    entries: Mapping[str, Numbers | Names],
    quantities: Mapping[str, Quantity],
    groups: Sequence[Sequence[str]],
    cases: Sequence[str],
    given: Sequence[str],
    models: int,
    max_points: int = MAX_POINTS,
    *,
    in_full: bool = True,
) -> Grid:
    """The grid of some entries.

    Parameters
    ----------
    entries : what could be read, by config name, in config order
    quantities : what each number has to be
    groups : config names that vary together
    cases : the names of the columns of a table of cases
    given : the names that were given, whether they could be read or not
    models : how many there are
    max_points : how many points are allowed
    in_full : whether all of them are to be stored; else what is integrated is bounded, see `impact.api.prepare`
    """
    sizes = {name: _size(entry) for name, entry in entries.items()}
    scalars = {name: entry for name, entry in entries.items() if isinstance(entry, float | str)}
    member_of, faults = _zipped(groups, sizes, cases, given)
    together = [name for name in entries if name in cases]
    member_of |= dict.fromkeys(together, together)
    swept = [name for name in entries if name not in scalars]
    # a group stands where its first member does
    leaders = [name for name in swept if member_of.get(name, (name,))[0] == name]
    points = math.prod(sizes[name] or 1 for name in leaders) * models
    if len(leaders) > MAX_AXES:
        faults.append((("sweep",), f"got {len(leaders)} axes, expected at most {MAX_AXES}"))
    most = max_points if in_full else MAX_COUNTED_POINTS
    if points > most:
        size = f"{points:,} points (axes times models), up to {WIDTH * points / 1e9:,.0f} GB"
        faults.append((("sweep",), f"got {size}, expected at most {most:,} points" + FULL * in_full))
    columns: dict[str, Values] = {}
    for name in swept:
        entry = entries[name]
        if isinstance(entry, tuple):
            columns[name] = entry
            if name not in member_of:
                faults += _repeated(name, entry)
        elif isinstance(entry, Range) and points <= most:
            try:
                columns[name] = entry.values(quantities[name])
            except ValidationError as error:
                faults += [((*path_of(name), *item["loc"]), item["msg"]) for item in error.errors()]
    # a member whose entry could not be read has no column; its fault is reported where it was read
    groups = [member_of.get(name, (name,)) for name in leaders]
    is_complete = not faults and all(name in columns for group in groups for name in group)
    return Grid(scalars, _axes(groups, columns, cases) if is_complete else (), tuple(faults))


def _size(entry: Numbers | Names) -> int | None:
    """The number of values of an axis; None for a scalar."""
    match entry:
        case tuple():
            return len(entry)
        case Range():
            return entry.size
    return None


def _axes(
    groups: Sequence[Sequence[str]], columns: Mapping[str, Values], cases: Sequence[str]
) -> tuple[Axis, ...]:
    """The dimensions of some groups: a group is named by its first member without repeated values.

    The points of cases, and of a group without such a member, are numbered: "case", then "case_2" and so on.
    """
    axes: list[Axis] = []
    numbered = 1 if cases else 0
    for group in groups:
        naming = [name for name in group if len(set(columns[name])) == len(columns[name])]
        dimension = ""
        if group[0] in cases:
            dimension = "case"
        elif not naming:
            numbered += 1
            dimension = "case" if numbered == 1 else f"case_{numbered}"
        names = group if dimension else (naming[0], *(name for name in group if name != naming[0]))
        axes.append(Axis({name: columns[name] for name in names}, dimension))
    return tuple(axes)


def chunk_faults(chunks: Mapping[str, int], axes: Sequence[Axis], models: int, variables: int) -> list[Fault]:
    """What is wrong with the chunks that a result is to be stored in: no such axis, too small or too large.

    Parameters
    ----------
    chunks : their lengths, by axis; along the others they are whole
    axes, models : of the grid
    variables : number of those that are stored
    """
    sizes, path = {axis.name: axis.size for axis in axes}, ("output", "chunks")
    unknown = [name for name in chunks if name not in sizes]
    if unknown or not chunks:
        return [((*path, name), f"no axis of this sweep; {nearest(name, list(sizes))}") for name in unknown]
    size = math.prod(min(chunks.get(name, whole), whole) for name, whole in sizes.items())
    count = math.prod(-(-whole // chunks.get(name, whole)) for name, whole in sizes.items())
    count *= models * variables
    if size > MAX_CHUNK_POINTS or count > MAX_STORED_CHUNKS:
        expected = f"expected at most {MAX_STORED_CHUNKS:,} of at most {MAX_CHUNK_POINTS:,}"
        return [(path, f"got {count:,} chunks of {size:,} points, {expected}")]
    return []


def path_of(name: str) -> KeyPath:
    """The path of a config name: of an input, of a parameter of a model or of a material.

    >>> path_of("v1"), path_of("bilinear.K"), path_of("model.bilinear.K"), path_of("materials.steel.E")
    (('sweep', 'v1'), ('model', 'bilinear', 'K'), ('model', 'bilinear', 'K'), ('materials', 'steel', 'E'))
    """
    table, _, key = name.removeprefix("model.").rpartition(".")
    if table.startswith("materials."):
        return ("materials", table.removeprefix("materials."), key)
    return ("model", table, key) if table else ("sweep", name)


def name_of(path: KeyPath) -> str:
    """The config name of a path, which is also the name of its column in a result.

    >>> name_of(path_of("model.bilinear.K"))
    'bilinear.K'
    """
    return ".".join(map(str, path[0 if path[0] == "materials" else 1 :]))


def _zipped(
    groups: Sequence[Sequence[str]], sizes: Mapping[str, int | None], cases: Sequence[str], given: Sequence[str]
) -> tuple[dict[str, Sequence[str]], list[Fault]]:
    """The group of each zipped name, and what is wrong: no axis, named twice, of another length.

    Parameters
    ----------
    groups : names that vary together
    sizes : of what could be read; None for a scalar
    cases : names that vary together already
    given : the names that were given, whether they could be read or not
    """
    member_of: dict[str, Sequence[str]] = {}
    faults: list[Fault] = []
    for place, group in enumerate(groups[:MAX_FAULTS]):
        lengths: dict[str, int] = {}
        names = [name_of(path_of(name)) for name in group[:MAX_FAULTS]]
        for member, name in enumerate(names):
            path = ("sweep", "zip", place, member)
            size = sizes.get(name)
            if name not in given:
                axes = [key for key in given if sizes.get(key) is not None]
                faults.append((path, f"got {show(name)}, expected an axis; {nearest(name, axes or list(given))}"))
            elif name in member_of:
                faults.append((path, f"got {show(name)} twice, expected each name once"))
            elif name in cases:
                faults.append((path, f"got {show(name)}, a column of cases, which vary together already"))
            elif name in sizes and size is None:
                faults.append((path, f"got {show(name)}, which is a scalar, expected an axis: a list or a range"))
            elif size is not None:
                lengths[name] = size
            member_of.setdefault(name, names)
        if len(set(lengths.values())) > 1:
            of_each = ", ".join(f"{name} of {size}" for name, size in lengths.items())
            faults.append((("sweep", "zip", place), f"got {of_each} values, expected axes of one length"))
    return member_of, faults


def _repeated(name: str, values: Values) -> list[Fault]:
    """The first value of a list that comes a second time."""
    seen: set[object] = set()
    for place, value in enumerate(values):
        if value in seen:
            return [((*path_of(name), place), f"got {show(value)} twice, expected each value once")]
        seen.add(value)
    return []
