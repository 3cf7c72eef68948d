"""The work folder: what a sweep has finished, kept block by block, so that nothing completed is ever lost.

Beside the output `results.h5` stands `results.h5.work/` while a sweep runs: the plan, a lock, and a file for each
finished block, written to another name, synced, renamed. It goes when the result is whole.
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
from ..contact.simulate import TABLE_COLUMNS, CollisionResult
from ..errors import ImpactError, InUseError, StoreError, UsageError
from ..text import safe_text
from .execute import with_core
from .plan import Plan
from .trajectories import RANGE_TRAJECTORIES, TrajectoryRange, trajectory_maps

PLAN, LOCK = "plan.json", "lock"
ELSE = "give the sweep that it is of, another output, or --overwrite to start again"
TOLD = 3  # differences


def work_folder_of(output: Path) -> Path:
    """The work folder of an output."""
    return output.with_name(f"{output.name}.work")


def partial_file_of(output: Path) -> Path:
    """The name of an output while it is assembled."""
    return output.with_name(f"{output.name}.part")


@dataclass(frozen=True)
class WorkFolder:
    """A work folder that this process has locked; `key` tells what its blocks are of."""

    folder: Path
    key: str

    def path(self, number: int) -> Path:
        return self.folder / f"{number:08d}.npz"

    def _of(self, part: TrajectoryRange) -> str:
        """What a block says of itself."""
        return f"{part.number} {part.model} {part.start} {part.stop} {self.key}"

    def store(self, part: TrajectoryRange, rebound: CollisionResult) -> None:
        """Keep a finished block.

        Raises
        ------
        StoreError : the disk is full or failed
        """
        with atomic_write(self.path(part.number), overwrite=True, part=self.folder / "block.part") as sink:
            write_block(sink, self._of(part), rebound)

    def load(self, part: TrajectoryRange) -> CollisionResult | None:
        """A finished block; None if it is not there, or not whole."""
        # what is no regular file might never end
        if not self.path(part.number).is_file():
            return None
        return read_block(self.path(part.number), self._of(part), part.size)


@contextlib.contextmanager
def open_work_folder(
    folder: Path, plan: Plan, *, resume: bool, overwrite: bool, extends: str = ""
) -> Iterator[WorkFolder]:
    """A work folder, locked.

    Parameters
    ----------
    folder : where
    plan : what it runs
    resume : go on with what a leftover folder holds
    overwrite : throw away what a leftover folder holds, unless it is resumed
    extends : the seal of the result that is extended, if one is: the folder then lacks what that holds

    Raises
    ------
    InUseError : another process works there
    UsageError : a leftover folder is neither to be resumed nor overwritten, or is of another sweep
    StoreError : the disk is full or failed
    """
    _check(folder)
    record = _record(plan, extends)
    lock = FileLock(folder / LOCK, timeout=0)
    try:
        _lock(lock, folder)
        _prepare(folder, record, resume=resume, overwrite=overwrite)
        yield WorkFolder(folder, _key(record))
    finally:
        lock.release()


@contextlib.contextmanager
def lock_work_folder(folder: Path, plan: Plan) -> Iterator[WorkFolder]:
    """A work folder of a plan as it is, locked.

    Raises
    ------
    InUseError, StoreError : see `open_work_folder`
    UsageError : it is of another sweep
    """
    record = _record(plan)
    told = _told_apart(folder, record)
    if told:
        raise UsageError(f"{safe_text(str(folder))}: {told}; wants the folders of one sweep")
    lock = FileLock(folder / LOCK, timeout=0)
    try:
        _lock(lock, folder)
        yield WorkFolder(folder, _key(record))
    finally:
        lock.release()


def remove_stale_work_folder(output: Path, plan: Plan) -> None:
    """Remove what a sweep has left that was killed when its result was whole, if nobody works there."""
    folder = work_folder_of(output)
    with contextlib.suppress(ImpactError, Timeout, OSError):
        if folder.is_dir():
            _check(folder)
            plan = with_core(plan, trajectory_maps(plan))
            with FileLock(folder / LOCK, timeout=0):
                if not os.path.lexists(folder / PLAN) or _is_of(folder, _record(plan), resume=True):
                    partial_file_of(output).unlink(missing_ok=True)
                    remove_work_folder(folder)


def _check(folder: Path) -> None:
    """Refuse what has the name of a work folder, and is none."""
    shown = safe_text(str(folder))
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise UsageError(f"{shown}: is not a folder, and is not modified")
    if folder.is_dir() and not os.path.lexists(folder / PLAN):
        strange = [one.name for one in folder.iterdir() if one.name != LOCK and not one.name.endswith(".part")]
        if strange:
            raise UsageError(f"{shown}: holds {safe_text(strange[0])}, and no {PLAN}; it is not modified")


def remove_work_folder(folder: Path) -> None:
    """Remove a folder whose result is whole; what cannot be, and what others have put there, does no harm."""
    with contextlib.suppress(OSError):
        _clear(folder, plan=True)
        (folder / LOCK).unlink()
        folder.rmdir()


def _lock(lock: FileLock, folder: Path) -> None:
    try:
        folder.mkdir(exist_ok=True)
        sync_folder(folder.parent)
        lock.acquire()
    except Timeout:
        raise InUseError(
            f"{safe_text(str(folder.with_suffix('')))}: is being written by another process"
        ) from None
    except OSError as error:
        raise StoreError(f"{safe_text(str(folder))}: {error.strerror}") from error


def _prepare(folder: Path, record: Mapping[str, Any], *, resume: bool, overwrite: bool) -> None:
    """Have a folder with the plan, and with the blocks of it that are to be gone on with."""
    shown = safe_text(str(folder))
    try:
        left = any(one.name != LOCK for one in folder.iterdir())
        if left and not resume and not overwrite:
            raise UsageError(
                f"{shown}: is left of an interrupted sweep; use --resume to continue or --overwrite to start again"
            )
        if left and _is_of(folder, record, resume=resume):
            return
        _clear(folder)
        # what is removed must not come back beside another plan
        sync_folder(folder)
        with atomic_write(folder / PLAN, overwrite=True) as sink:
            sink.write(json.dumps(record).encode())
    except OSError as error:
        raise StoreError(f"{shown}: {error.strerror}") from error


def _record(plan: Plan, extends: str = "") -> dict[str, Any]:
    """What a folder is of: all that the finished blocks depend on."""
    solver = plan.config.solver
    return {"schema": TABLE_COLUMNS, "block": RANGE_TRAJECTORIES, "collapse": solver.collapse, "core": solver.core,
            "physics": plan.physics, **({"extends": extends} if extends else {})}  # fmt: skip


def _key(record: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(record).encode()).hexdigest()


def _clear(folder: Path, plan: bool = False) -> None:
    """Remove the finished blocks, and what was left half written."""
    for one in (*folder.glob("*.npz"), *folder.glob("*.part"), *([folder / PLAN] if plan else [])):
        one.unlink(missing_ok=True)


def _is_of(folder: Path, record: Mapping[str, Any], *, resume: bool) -> bool:
    """Whether a folder has finished blocks of a sweep to go on with.

    Raises
    ------
    UsageError : it is to be resumed, and is of another sweep, which is told
    """
    if not resume or not os.path.lexists(folder / PLAN):
        # without a plan it was interrupted before anything was done
        return False
    told = _told_apart(folder, record)
    if told:
        raise UsageError(f"{safe_text(str(folder))}: {told}; {ELSE}")
    return True


def _told_apart(folder: Path, record: Mapping[str, Any]) -> str | None:
    """In what a folder is of another sweep; None if it is of this one."""
    unknown = [key for key, digest in record["physics"]["plugins"].items() if digest is None]
    if unknown:
        return f"the model {safe_text(unknown[0])} is in no file, so that it cannot be known to be the same"
    try:
        if not (folder / PLAN).is_file():
            raise ValueError
        stored = json.loads((folder / PLAN).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return f"its {PLAN} cannot be read"
    told = list(record_differences(stored, json.loads(json.dumps(record))))
    more = f" and {len(told) - TOLD} more" if len(told) > TOLD else ""
    return f"is of another sweep: {'; '.join(told[:TOLD])}{more}" if told else None


def write_block(file: Any, of: str, rebound: CollisionResult) -> None:
    """Write a block.

    Parameters
    ----------
    file : a binary one, to be written to
    of : what it says of itself
    rebound : what is in it
    """
    np.savez(file, of=of, **{name: getattr(rebound, name) for name in TABLE_COLUMNS})


def read_block(path: Path, of: str, size: int) -> CollisionResult | None:
    """A block of so many trajectories; None if it is of something else, or not whole."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            if stored["of"].item() != of:
                return None
            arrays = {name: stored[name] for name in TABLE_COLUMNS}
    except MemoryError:
        raise
    # numpy and zipfile raise almost anything on a damaged file
    except Exception:
        return None
    blank = CollisionResult.blank(size)
    right = all(
        (one.shape, one.dtype) == (getattr(blank, name).shape, getattr(blank, name).dtype)
        for name, one in arrays.items()
    )
    return CollisionResult(**arrays) if right else None


def record_differences(there: object, here: object, path: str = "") -> Iterator[str]:
    """In what two records differ, each with its place."""
    if isinstance(there, dict) and isinstance(here, dict):
        for key in dict.fromkeys((*there, *here)):
            name = key if path in ("", "physics") else f"{path}.{key}"
            yield from record_differences(there.get(key), here.get(key), str(name))
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for place, (one, other) in enumerate(zip(there, here, strict=True)):
            yield from record_differences(one, other, f"{path}[{place}]")
    elif there != here and not (there != there and here != here):
        yield f"{safe_text(path)}: {_shown(there)} there, {_shown(here)} here"


def _shown(value: object) -> str:
    text = f"{len(value)} values" if isinstance(value, list) else json.dumps(value)
    return safe_text(text, 60)
