"""The work folder of a sweep: one file for each finished range of trajectories, so that no work is ever lost.

While a sweep runs, the folder `results.h5.work/` next to the output `results.h5` contains the plan, a lock, and a
file for each finished range, which is written to a temporary name, synced and renamed. The folder is removed when
the result is complete.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout

from ..atomic import atomic_write, sync_folder
from ..contact.records import CollisionResult, Record
from ..contact.tangential import TangentialResult
from ..errors import ImpactError, InUseError, StoreError, UsageError
from ..formatting import argument, safe_text
from .plan import Plan
from .run import Run
from .trajectories import RANGE_TRAJECTORIES, TrajectoryRange

PLAN_FILE, LOCK_FILE = "plan.json", "lock"
MAX_DIFFERENCES = 3  # between two sweeps, in a message


def work_folder_of(output: Path) -> Path:
    """Name the work folder of an output."""
    return output.with_name(f"{output.name}.work")


def partial_file_of(output: Path) -> Path:
    """Name the temporary file of an output that is being written."""
    return output.with_name(f"{output.name}.part")


@dataclass(frozen=True)
class WorkFolder:
    """A work folder that this process has locked; `key` identifies the sweep of its ranges."""

    folder: Path
    key: str

    def path(self, trajectory_range: TrajectoryRange) -> Path:
        return self.folder / f"{trajectory_range.number:08d}.npz"

    def _header(self, trajectory_range: TrajectoryRange) -> str:
        """Identify the sweep and the range of a file by a line of text."""
        fields = trajectory_range.number, trajectory_range.model, trajectory_range.start, trajectory_range.stop
        return " ".join(map(str, (*fields, self.key)))

    def store(self, trajectory_range: TrajectoryRange, collisions: Record) -> None:
        """Store a finished range; raises a `StoreError` if the disk is full or failed."""
        path = self.path(trajectory_range)
        with atomic_write(path, overwrite=True, part=self.folder / "block.part") as sink:
            write_range(sink, self._header(trajectory_range), collisions)

    def load(self, trajectory_range: TrajectoryRange) -> Record | None:
        """Load a finished range; None if it is missing or damaged."""
        path, record = self.path(trajectory_range), trajectory_range.record
        # reading something other than a regular file might never end
        if not path.is_file():
            return None
        try:
            with np.load(path, allow_pickle=False) as stored:
                if stored["of"].item() != self._header(trajectory_range):
                    return None
                loaded = record(**{name: stored[name] for name in record.columns()})
        except MemoryError:
            raise
        # numpy and zipfile raise almost any exception on a damaged file
        except Exception:
            return None
        return None if loaded.misfit(trajectory_range.size) else loaded


@contextlib.contextmanager
def open_work_folder(folder: Path, plan: Plan, run: Run) -> Iterator[WorkFolder]:
    """Create or reopen the work folder of a plan, and lock it."""
    _check_is_work_folder(folder)
    record = _sweep_record(plan)
    with _locked(folder, record) as work_folder:
        _prepare_folder(folder, record, run)
        yield work_folder


def lock_work_folder(folder: Path, plan: Plan) -> contextlib.AbstractContextManager[WorkFolder]:
    """Lock an existing work folder of a plan without changing it; a `UsageError` if it is of another sweep."""
    record = _sweep_record(plan)
    if difference := _difference_from(folder, record):
        raise UsageError(f"{folder}: {difference}; expected the folders of one sweep")
    return _locked(folder, record)


def remove_stale_work_folder(output: Path, plan: Plan) -> None:
    """Remove the work folder of a sweep that was killed after its result was complete, if it is not locked."""
    folder = work_folder_of(output)
    with contextlib.suppress(ImpactError, Timeout, OSError):
        if folder.is_dir():
            _check_is_work_folder(folder)
            with FileLock(folder / LOCK_FILE, timeout=0):
                if os.path.lexists(folder / PLAN_FILE) and _difference_from(folder, _sweep_record(plan)):
                    return
                partial_file_of(output).unlink(missing_ok=True)
                remove_work_folder(folder)


def _check_is_work_folder(folder: Path) -> None:
    """Refuse a file, link or foreign folder that has the name of a work folder."""
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise UsageError(f"{folder}: is not a folder, and is not modified")
    if folder.is_dir() and not os.path.lexists(folder / PLAN_FILE):
        names = [path.name for path in folder.iterdir()]
        foreign = [name for name in names if name != LOCK_FILE and not name.endswith(".part")]
        if foreign:
            raise UsageError(f"{folder}: contains {foreign[0]} and no {PLAN_FILE}, and is not modified")


def remove_work_folder(folder: Path) -> None:
    """Remove the folder of a complete result; files that cannot be removed, and files of others, are left."""
    with contextlib.suppress(OSError):
        _remove_files(folder, plan=True)
        (folder / LOCK_FILE).unlink()
        folder.rmdir()


@contextlib.contextmanager
def _locked(folder: Path, record: Mapping[str, Any]) -> Iterator[WorkFolder]:
    """Create the folder of a sweep if it is missing, and lock it."""
    lock = FileLock(folder / LOCK_FILE, timeout=0)
    try:
        try:
            folder.mkdir(exist_ok=True)
            sync_folder(folder.parent)
            lock.acquire()
        except Timeout:
            raise InUseError(f"{folder.with_suffix('')}: is being written by another process") from None
        except OSError as error:
            raise StoreError(f"{folder}: {error.strerror}") from error
        yield WorkFolder(folder, hashlib.sha256(json.dumps(record).encode()).hexdigest())
    finally:
        lock.release()


def _prepare_folder(folder: Path, record: Mapping[str, Any], run: Run) -> None:
    """Write the plan to a folder, and remove ranges that are not resumed."""
    try:
        has_leftovers = any(path.name != LOCK_FILE for path in folder.iterdir())
        if has_leftovers and not run.resume and not run.overwrite:
            raise UsageError(
                f"{folder}: is left of an interrupted sweep; use {argument('resume', True)} to continue or "
                f"{argument('overwrite', True)} to start again"
            )
        # without a plan, the sweep was interrupted before its first range
        if run.resume and os.path.lexists(folder / PLAN_FILE):
            if difference := _difference_from(folder, record):
                again = f"another output, or {argument('overwrite', True)} to start again"
                raise UsageError(f"{folder}: {difference}; give the sweep that it is of, {again}")
            return
        _remove_files(folder)
        # after a power cut, removed ranges must not reappear next to the new plan
        sync_folder(folder)
        with atomic_write(folder / PLAN_FILE, overwrite=True) as sink:
            sink.write(json.dumps(record).encode())
    except OSError as error:
        raise StoreError(f"{folder}: {error.strerror}") from error


def _sweep_record(plan: Plan) -> dict[str, Any]:
    """Collect everything that the finished ranges of a sweep depend on."""
    solver = plan.solver
    return {
        "schema": CollisionResult.columns(),
        **({"friction_schema": TangentialResult.columns()} if plan.frictions else {}),
        "block": RANGE_TRAJECTORIES,
        "collapse": solver.collapse,
        "core": solver.core,
        "physics": plan.physics,
        **({"extends": plan.extends} if plan.extends else {}),
    }


def _remove_files(folder: Path, plan: bool = False) -> None:
    """Remove the finished and partial ranges, and with `plan` the plan."""
    for path in (*folder.glob("*.npz"), *folder.glob("*.part"), *([folder / PLAN_FILE] if plan else [])):
        path.unlink(missing_ok=True)


def _difference_from(folder: Path, record: Mapping[str, Any]) -> str | None:
    """State how the sweep of a folder differs from the one of a record; None if they are the same."""
    unknown = [key for key, digest in record["physics"]["plugins"].items() if digest is None]
    if unknown:
        return f"the model {unknown[0]} has no file, so it cannot be compared"
    try:
        if not (folder / PLAN_FILE).is_file():
            raise ValueError
        stored = json.loads((folder / PLAN_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return f"its {PLAN_FILE} cannot be read"
    differences = list(record_differences(stored, json.loads(json.dumps(record))))
    more = f" and {len(differences) - MAX_DIFFERENCES} more" if len(differences) > MAX_DIFFERENCES else ""
    return f"belongs to another sweep: {'; '.join(differences[:MAX_DIFFERENCES])}{more}" if differences else None


def write_range(file: Any, header: str, collisions: Record) -> None:
    """Write the results of a range, with the header that identifies it, to a binary file."""
    np.savez(file, of=header, **vars(collisions))


def record_differences(stored: object, current: object, path: str = "") -> Iterator[str]:
    """List the differences between two records, each with its path."""
    if isinstance(stored, dict) and isinstance(current, dict):
        for key in dict.fromkeys((*stored, *current)):
            name = key if path in ("", "physics") else f"{path}.{key}"
            yield from record_differences(stored.get(key), current.get(key), str(name))
    elif isinstance(stored, list) and isinstance(current, list) and len(stored) == len(current):
        for index, (stored_element, current_element) in enumerate(zip(stored, current, strict=True)):
            yield from record_differences(stored_element, current_element, f"{path}[{index}]")
    elif stored != current and not (stored != stored and current != current):
        yield f"{path}: {_short_json(stored)} there, {_short_json(current)} here"


def _short_json(value: object) -> str:
    text = f"{len(value)} values" if isinstance(value, list) else json.dumps(value)
    return safe_text(text, 60)
