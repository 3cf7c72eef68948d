"""The grid of a config: its axes and scalars, made from the entries that could be read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..contact.collide import BY_DEFAULT
from .ranges import MAX_FAULTS, Entry, written_out
from .values import Fault, KeyPath, Problem, Quantity, nearest, show

# of all models together, where nothing else is said
MAX_POINTS = 10**9
# that can be counted, where they are not stored one by one
MOST_POINTS = 2**62
# HDF5 has arrays of 32 dimensions, one of which is that of the models
MAX_AXES = 31
FULL = ' in layout "full" (--max-points); layout = "factored" stores any number'
# chunks of a result, and points of a chunk: a reader opens each, and holds it as a whole
MAX_CHUNKS, MAX_CHUNK_POINTS = 100_000, 2**22
# bytes that the outputs of a point take at most, by default
WIDTH = 8 * len(BY_DEFAULT)

Values = tuple[float, ...] | tuple[str, ...]


@dataclass(frozen=True)
class Axis:
    """One dimension of the grid: the columns of a zip group, or one column; the first names it.

    >>> Axis({"m1": (1.0, 2.0), "m2": (2.0, 4.0)}).name
    'm1'
    """

    columns: Mapping[str, Values]

    @property
    def name(self) -> str:
        return next(iter(self.columns))

    @property
    def size(self) -> int:
        return len(self.columns[self.name])


@dataclass(frozen=True)
class Grid:
    """Scalars by name, axes in config order, and what is wrong with them."""

    scalars: Mapping[str, float | str]
    axes: tuple[Axis, ...]
    faults: tuple[Fault, ...]


def lay_out(
    entries: Mapping[str, Entry],
    quantities: Mapping[str, Quantity],
    groups: Sequence[Sequence[str]],
    given: Sequence[str],
    models: int,
    max_points: int = MAX_POINTS,
    *,
    in_full: bool = True,
) -> Grid:
    """The grid of some entries.

    Parameters
    ----------
    entries : by config name, in config order
    quantities : what each number has to be
    groups : names that vary together
    given : the names under [sweep], whether their entries could be read or not
    models : how many there are
    max_points : how many points are allowed
    in_full : whether all of them are to be stored; else what is integrated is bounded, see `impact.api.prepare`
    """
    member_of, faults = _zipped(groups, entries, given)
    scalars = {name: entry.given[0] for name, entry in entries.items() if entry.kind == "scalar"}
    swept = [name for name in entries if name not in scalars]
    # a group stands where its first member does
    leaders = [name for name in swept if member_of.get(name, (name,))[0] == name]
    points = math.prod(entries[name].size for name in leaders) * models
    if len(leaders) > MAX_AXES:
        faults.append((("sweep",), f"got {len(leaders)} axes, expected at most {MAX_AXES}"))
    most = max_points if in_full else MOST_POINTS
    if points > most:
        size = f"{points:,} points (axes times models), up to {WIDTH * points / 1e9:,.0f} GB"
        faults.append((("sweep",), f"got {size}, expected at most {most:,} points" + FULL * in_full))
    columns: dict[str, Values] = {}
    for name in swept:
        entry = entries[name]
        if entry.kind == "list":
            columns[name] = entry.given
            # the first column names the points of the axis; the others may repeat themselves
            if name in leaders:
                faults += _repeated(name, entry.given)
        elif points <= most:
            try:
                columns[name] = written_out(entry, quantities[name])
            except Problem as problem:
                faults += problem.under(*path_of(name))
    members = [member_of.get(name, (name,)) for name in leaders]
    # a member whose entry could not be read has no column; its fault is reported where it was read
    is_complete = not faults and all(name in columns for group in members for name in group)
    axes = tuple(Axis({name: columns[name] for name in group}) for group in members) if is_complete else ()
    return Grid(scalars, axes, tuple(faults))


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
    if size > MAX_CHUNK_POINTS or count > MAX_CHUNKS:
        wants = f"wants at most {MAX_CHUNKS:,} of at most {MAX_CHUNK_POINTS:,}"
        return [(path, f"got {count:,} chunks of {size:,} points, {wants}")]
    return []


def path_of(name: str) -> KeyPath:
    """The path of a config name: of `v1`, or of a model's parameter such as `bilinear.K`.

    >>> path_of("v1"), path_of("bilinear.K")
    (('sweep', 'v1'), ('model', 'bilinear', 'K'))
    """
    return ("model", *name.split(".", 1)) if "." in name else ("sweep", name)


def _zipped(
    groups: Sequence[Sequence[str]], entries: Mapping[str, Entry], given: Sequence[str]
) -> tuple[dict[str, Sequence[str]], list[Fault]]:
    """The group of each zipped name, and what is wrong: no axis, named twice, of another length.

    Parameters
    ----------
    groups : names that vary together
    entries : the entries that could be read
    given : the names that were given, whether they could be read or not
    """
    member_of: dict[str, Sequence[str]] = {}
    faults: list[Fault] = []
    for place, group in enumerate(groups[:MAX_FAULTS]):
        sizes: dict[str, int] = {}
        for member, name in enumerate(group[:MAX_FAULTS]):
            path = ("sweep", "zip", place, member)
            if name not in given:
                faults.append((path, f"got {show(name)}, wants an axis; {nearest(name, list(given))}"))
            elif name in member_of:
                faults.append((path, f"got {show(name)} twice, wants each name once"))
            elif name in entries and entries[name].kind == "scalar":
                faults.append((path, f"got {show(name)}, which is a scalar, wants an axis: a list or a range"))
            elif name in entries:
                sizes[name] = entries[name].size
            member_of.setdefault(name, group)
        if len(set(sizes.values())) > 1:
            lengths = ", ".join(f"{name} of {size}" for name, size in sizes.items())
            faults.append((("sweep", "zip", place), f"got {lengths} values, wants axes of one length"))
    return member_of, faults


def _repeated(name: str, values: Values) -> list[Fault]:
    """The first value of a list that comes a second time."""
    seen: set[object] = set()
    for place, value in enumerate(values):
        if value in seen:
            return [((*path_of(name), place), f"got {show(value)} twice, wants each value once")]
        seen.add(value)
    return []
