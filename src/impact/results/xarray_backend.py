"""Save, open and load result files; the xarray backend that opens them."""

from __future__ import annotations

import contextlib
import math
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import xarray as xr
from xarray.backends import BackendEntrypoint

from ..atomic import Sink, atomic_write, check_output, check_outputs, check_result_name
from ..config.files import RESULT_MAGIC
from ..config.grid import MAX_POINTS
from ..config.input_names import is_input
from ..config.tables import Output
from ..errors import ImpactError, ResultError, UnfinishedError, UsageError, warn
from ..formatting import argument, safe_text, type_of
from .layouts import read_layout
from .netcdf import RegionValues, encode_attribute, read_variables, write_dataset
from .schema import MODEL_METADATA, SCHEMA, kind_of, require_result, require_sweep
from .seal import byte_reader, check_root, check_seal, digest, is_result, write_seal
from .selection import select, select_laws
from .slabs import slabs
from .trajectory_table import in_memory, table_of_result
from .validation import schema_violation

# larger results are not loaded into memory
MAX_LOADED_BYTES = 2**29


def write_sealed(
    sink: Sink, path: Path, template: xr.Dataset, values: Iterable[RegionValues], output: Output
) -> str:
    """Write and seal a dataset of the coordinates and attributes of a template; return the seal."""
    write_dataset(sink, template, values, output)
    seal = write_seal(sink)
    check_readable(sink, path)
    return seal


def save(
    dataset: xr.Dataset,
    path: str | Path,
    *,
    overwrite: bool = False,
    output: Output | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> None:
    """Store a dataset as a sealed netCDF-4 file, with all of its values.

    Parameters
    ----------
    dataset : a result, or a part of one; a lazy one is read slab by slab
    path : the file
    overwrite : replace a file that exists
    output : deprecated; dtype, compression and chunks, which `[output]` of a config sets
    should_stop : called before each slab; writing stops if it returns True

    Returns
    -------
    None : the file is complete; after an error it is as it was before

    Raises
    ------
    UsageError : the file exists, its folder cannot be written to, or the dataset is not a result
    StoreError : the disk is full or failed
    UnfinishedError : writing was stopped; nothing was written

    >>> import impact, tempfile
    >>> result = impact.sweep("configs/figure6.toml")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(result.sel(model=["gharib-hurmuzlu-2012"]), f"{folder}/one.h5")
    ...     impact.load(f"{folder}/one.h5").sizes["model"]
    1
    """
    path = Path(path)
    check_result_name(path)
    if "schema_version" not in dataset.attrs:
        raise UsageError(f"{path}: this dataset is not a result of impact: it has no schema_version")
    if violation := schema_violation(dataset):
        raise UsageError(f"{path}: {violation}; dataset.to_netcdf(path) stores any dataset")
    check_output(path, overwrite=overwrite)

    def parts() -> Iterator[RegionValues]:
        for name, variable in dataset.data_vars.items():
            for slab in slabs(variable.sizes):
                if should_stop is not None and should_stop():
                    raise UnfinishedError("nothing was written")
                yield str(name), tuple(slab.values()), variable.isel(slab).values

    with atomic_write(path, overwrite=overwrite) as sink:
        write_sealed(sink, path, dataset, parts(), output or Output())


def save_with_attributes(
    source: Path, path: Path, seal: str, attributes: Mapping[str, str], check: Callable[[], None] = lambda: None
) -> None:
    """Copy a result file of a seal and set some attributes; its layout stays, an existing file is replaced."""
    with atomic_write(path, overwrite=True, check=check) as sink, source.open("rb") as file:
        shutil.copyfileobj(file, sink)
        sink.check()
        if digest(sink) != seal:
            raise ResultError(f"{source}: was changed while it was read; {path} is not modified")
        # the bytes of a modified attribute depend on its former value: create it again
        with h5py.File(sink, "r+") as stored:
            for name, text in attributes.items():
                stored.attrs.create(name, encode_attribute(text))
        write_seal(sink)
        check_readable(sink, path)


def check_readable(sink: Sink, path: Path) -> None:
    """Refuse a file that `open_result` would refuse, before it gets its name."""
    try:
        read = byte_reader(sink)
        check_root(read)
        with h5py.File(sink, "r") as file:
            read_variables(file, read)
    except ResultError as error:
        raise UsageError(f"{path}: could not be read again: {error}") from None


def open_result(path: str | Path) -> xr.Dataset:
    """Open a result; its values are read or computed when they are indexed.

    Its seal is checked first; a file that is not a readable result raises a ResultError, and variables that are
    not part of a result a warning. `dataset.encoding` has the layout ("full" or "factored") and the seal.
    """
    path = Path(path)
    with _named_errors(path), contextlib.ExitStack() as on_error:
        seal = check_seal(path)
        with path.open("rb") as content:
            read = byte_reader(content)
            check_root(read)
            # opened by its path: a signal that arrives while h5py calls a Python stream is lost
            file = on_error.enter_context(h5py.File(path, "r", driver="sec2"))
            variables, attributes, unknown = read_variables(file, read)
        layout, dataset = read_layout(variables, attributes)
        if violation := schema_violation(dataset):
            raise ResultError(f"is not a readable result ({violation})")
        on_error.pop_all()
    if unknown:
        shown, names = safe_text(str(path)), safe_text(", ".join(unknown))
        warn(f"{shown}: ignored variables that are not part of a result: {names}")
    dataset.encoding = {"source": str(path), "seal": seal, "layout": layout}
    dataset.set_close(file.close)
    return dataset


@contextlib.contextmanager
def _named_errors(path: str | Path) -> Iterator[None]:
    """Name the file in errors; h5py and xarray raise almost any exception on a malformed one."""
    try:
        yield
    except MemoryError:
        raise
    except ResultError as error:
        if str(error).startswith(f"{safe_text(str(path))}: "):
            raise
        raise type(error)(f"{path}: {error}") from None
    except Exception as error:
        raise ResultError(f"{path}: is not a readable result ({safe_text(str(error), 80)})") from error


def load(path: str | Path) -> xr.Dataset:
    """Open a result, and read or compute all of its values if they take at most 512 MB.

    The values of a larger result are read or computed when they are indexed. Variables that are not part of a
    result are ignored with a warning.

    Parameters
    ----------
    path : the file

    Returns
    -------
    xarray.Dataset : variables, dimensions and units of docs/schema.md, with coordinates for the axes

    Raises
    ------
    ResultError : the file is not a readable result, or does not exist, which is a FileNotFoundError as well

    >>> import impact
    >>> impact.load("README.md")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    impact.errors.ResultError: README.md: is not a readable result ...
    """
    dataset = open_result(path)
    if dataset.nbytes > MAX_LOADED_BYTES:
        return dataset
    with dataset, _named_errors(path):
        return dataset.load() if table_of_result(dataset) is None else in_memory(dataset)


def result_of(result: xr.Dataset | str | Path) -> xr.Dataset:
    """Open what a function takes as a result: a dataset, or the file of one; a selected law stays a dimension."""
    if isinstance(result, str | Path):
        return load(result)
    if not isinstance(result, xr.Dataset):
        # the public function names its argument
        raise TypeError(f"got {type_of(result)}, expected a dataset, or the file of a result")
    require_result(result)
    kind = kind_of(result)
    # `reset_coords` has made variables of them
    names = [name for name in result.data_vars if name in (*MODEL_METADATA, "exponent") or is_input(name)]
    result = result.set_coords([name for name in names if name not in SCHEMA[kind]])
    # a calibration has the friction laws of its pairs along the models, and a history is of a single law
    for dim in {"sweep": ("friction", "model"), "history": ()}.get(kind, ("model",)):
        if dim in result.coords and result[dim].ndim == 0:
            along = [name for name, variable in SCHEMA[kind].items() if dim in variable.dims]
            along += ["exponent", *MODEL_METADATA] if dim == "model" else []
            along += ["friction", "determined"] if kind == "calibration" else []
            names = [dim, *(name for name in along if name in result.variables)]
            result = result.assign({name: result[name].expand_dims(dim) for name in names})
    return result


@contextlib.contextmanager
def result_to_show(result: xr.Dataset | str | Path) -> Iterator[xr.Dataset]:
    """Open what a function takes as a result; an unexpected error names what is wrong with that, if anything.

    Whatever works is taken: some functions can read what `drop_vars`, `where` and `concat` of xarray leave.
    """
    dataset = result_of(result)
    try:
        yield dataset
    except Exception as error:
        violation = None if isinstance(error, ImpactError) else schema_violation(dataset)
        if violation is None:
            raise
        kind = kind_of(dataset)
        raise UsageError(f"this {kind} was changed: {violation}; select parts by sel or isel only") from error


def expand(
    result: str | Path,
    output: str | Path,
    *,
    sel: Mapping[str, object] | None = None,
    models: Sequence[str] | None = None,
    overwrite: bool = False,
    max_points: int = MAX_POINTS,
    should_stop: Callable[[], bool] | None = None,
) -> int:
    """Write all values of a stored result, or of a part of it, as netCDF for programs that do not use impact.

    Parameters
    ----------
    result : file of the result
    output : the file to write
    sel : values of axes, such as `{"m2": 1.0}`; all values of other axes are written
    models : keys of the models to write; by default all
    overwrite : replace the output if it exists
    max_points : the largest number of points to write
    should_stop : returns whether to stop

    Returns
    -------
    int : number of points written

    Raises
    ------
    ResultError : the file is not a readable result
    UsageError : it is not the result of a sweep, it has more than `max_points` points, or the output exists
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = impact.sweep_to_file("configs/figure6.toml", f"{folder}/r.h5")
    ...     impact.expand(f"{folder}/r.h5", f"{folder}/full.h5", sel={"e": 0.5})
    3
    """
    output, shown = Path(output), safe_text(str(result))
    check_outputs([output], [result], overwrite=overwrite)
    check_result_name(output)
    opened = open_result(result)
    require_sweep(opened, "expand")
    dataset = select(opened, sel or {})
    if "model" not in dataset.dims:
        raise UsageError(f"{shown}: is a time history, expected a result of a sweep")
    dataset = select_laws(dataset, models)
    points = math.prod(dataset.sizes.values())
    if points > max_points:
        part = f"a part, such as {argument('sel', {'e': 0.5})}"
        most = f"{max_points:,} ({argument('max_points')})"
        raise UsageError(f"{shown}: got {points:,} points, expected at most {most}; select {part}")
    save(dataset, output, overwrite=overwrite, should_stop=should_stop)
    return points


class ImpactBackend(BackendEntrypoint):
    """`xarray.open_dataset(path, engine="impact")`: a result of either layout, read when it is indexed."""

    description = "Open results of impact, of any size, in xarray"
    open_dataset_parameters = ("filename_or_obj", "drop_variables")

    def open_dataset(
        self, filename_or_obj: Any, *, drop_variables: str | Iterable[str] | None = None
    ) -> xr.Dataset:
        dataset = open_result(filename_or_obj)
        rest = dataset.drop_vars(drop_variables or (), errors="ignore")
        rest.set_close(dataset.close)
        return rest

    def guess_can_open(self, filename_or_obj: Any) -> bool:
        return isinstance(filename_or_obj, str | os.PathLike) and is_result(Path(filename_or_obj), (RESULT_MAGIC,))
