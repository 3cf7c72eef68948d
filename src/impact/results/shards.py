"""Shards: parts of a sweep that run independently, for example in a job array, and are merged into one result.

Shard K of N has the ranges K, K + N, K + 2N, ... of trajectories in a work folder that stays; those of all shards
make the result. A range is a pure function of its plan: it may be in several folders, with the same bits.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..atomic import atomic_write, check_output
from ..config.tables import CORES
from ..engine.checkpoint import WorkFolder, lock_work_folder, open_work_folder
from ..engine.execute import never_stop, with_core
from ..engine.executors import SERIAL, Backend
from ..engine.plan import Plan
from ..engine.plugins import Plugins
from ..engine.progress import ProgressCallback, ProgressCounter, report_kept_blocks
from ..engine.trajectories import TrajectoryRange, trajectory_maps, trajectory_ranges
from ..errors import ResultError, StoreError, UnfinishedError, UsageError
from ..text import safe_text
from .provenance import stored_config
from .schema import dataset_template
from .summary import SweepOutcome
from .sweep import check_storable, complete_ranges, range_reader, reload_range, store_result
from .trajectory_table import table_of

# describes the shard of a work folder, beside the plan
SHARD_FILE_NAME = "shard.json"
MAX_LISTED_SHARDS = 5  # missing shards that a message lists
RECORDED_ATTRIBUTES = ("config", "config_set", "plugins", "fingerprint")


@dataclass(frozen=True)
class Shard:
    """One of the parts of a sweep, counted from 1."""

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Parse a text such as "3/16".

        Raises
        ------
        UsageError : it is not a shard

        >>> Shard.parse("3/16")
        Shard(number=3, of=16)
        """
        match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
        shard = cls(*map(int, match.groups())) if match else cls(0, 0)
        if not 1 <= shard.number <= shard.of:
            raise UsageError(f"--shard {safe_text(text)}: expected K/N with K from 1 to N, such as 3/16")
        return shard

    def has(self, part: TrajectoryRange) -> bool:
        return part.number % self.of == self.number - 1

    def folder(self, output: Path) -> Path:
        """Its work folder."""
        return output.with_name(f"{output.name}.{self.number}-of-{self.of}.work")

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"


@dataclass(frozen=True)
class ShardProgress:
    """The finished part of a shard."""

    folder: Path
    blocks: int
    of_blocks: int
    trajectories: int
    failed: int
    shard: Shard


def sweep_shard(
    output: Path,
    plan: Plan,
    shard: Shard,
    command: Sequence[str],
    *,
    overwrite: bool = False,
    backend: Backend = SERIAL,
    on_progress: ProgressCallback = lambda progress: None,
    should_stop: Callable[[], bool] = never_stop,
) -> ShardProgress:
    """Integrate a shard of a plan into its work folder, and resume it if the folder exists.

    Parameters
    ----------
    output : the result that the shards make; the work folder is beside it
    plan : of the whole sweep
    shard : the part to integrate
    command : words of the command that runs the whole sweep, for messages about missing shards
    overwrite : start again
    backend, on_progress, should_stop : see `impact.results.sweep.sweep_into`

    Raises
    ------
    UsageError, InUseError, StoreError, UnfinishedError : see there
    """
    check_storable(plan)
    maps = trajectory_maps(plan)
    plan = with_core(plan, maps)
    blocks = list(trajectory_ranges(maps))
    shard_blocks = [block for block in blocks if shard.has(block)]
    counter = ProgressCounter.start(sum(block.size for block in shard_blocks), plan.points, on_progress)
    folder = shard.folder(output)
    with open_work_folder(folder, plan, resume=not overwrite, overwrite=overwrite) as work_folder:
        attributes = dataset_template(plan).attrs
        record = {
            "shard": [shard.number, shard.of],
            "command": list(command),
            "core": plan.config.solver.core,
            "attributes": {name: attributes[name] for name in RECORDED_ATTRIBUTES},
        }
        with atomic_write(folder / SHARD_FILE_NAME, overwrite=True) as sink:
            sink.write(json.dumps(record).encode())
        with report_kept_blocks(folder, counter, "the same command", lambda error: []):
            complete_ranges(work_folder, plan, maps, shard_blocks, counter, backend, should_stop)
    progress = counter.progress
    return ShardProgress(folder, len(shard_blocks), len(blocks), progress.trajectories, progress.failed, shard)


@dataclass(frozen=True)
class _ShardRecord:
    """The record of a shard in its work folder."""

    shard: Shard
    command: tuple[str, ...]
    core: str
    attributes: Mapping[str, Any]


def merge(
    folders: Sequence[Path],
    output: Path,
    plugins: Plugins,
    *,
    overwrite: bool = False,
    on_progress: ProgressCallback = lambda progress: None,
    should_stop: Callable[[], bool] = never_stop,
) -> tuple[SweepOutcome, int]:
    """Merge shards into a result; their work folders are not modified.

    Parameters
    ----------
    folders : of the shards, in any order
    output : the file
    plugins : models that are not built in, including those of the sweep
    overwrite : replace the file if it exists
    on_progress, should_stop : see `impact.results.sweep.sweep_into`

    Returns
    -------
    The result, and the number of blocks that several folders have, with the same bits.

    Raises
    ------
    UsageError : a folder is not a shard, or of another sweep; or shards are missing or unfinished: the message has
        the command for each of them
    ResultError : two folders have the same block with different bits
    InUseError : a shard is still running
    StoreError, UnfinishedError : nothing was stored; the folders keep all finished trajectories
    """
    check_output(output, overwrite=overwrite)
    records = {folder: _read_record(folder) for folder in {path.resolve(): path for path in folders}.values()}
    first, first_record = next(iter(records.items()))
    config = stored_config(first_record.attributes, [], plugins, str(first))
    # the core that the shards were integrated by, which may not be the default of this machine
    config = replace(config, solver=replace(config.solver, core=first_record.core))
    plan = Plan(config, plugins.of(config.models))
    maps = trajectory_maps(plan)
    blocks = list(trajectory_ranges(maps))
    counter = ProgressCounter.start(sum(trajectory_map.count for trajectory_map in maps), plan.points, on_progress)
    for folder, record in records.items():
        if record.attributes["fingerprint"] != first_record.attributes["fingerprint"]:
            # a difference in the trajectories is reported first, by its name
            with lock_work_folder(folder, plan):
                raise UsageError(
                    f"{safe_text(str(folder))}: its title or output differs from that of {safe_text(str(first))}; "
                    "expected the folders of one sweep"
                )
    # folders are locked one after the other: there may be more of them than the limit of open files
    where, n_repeated = _locate_ranges([*records], plan, blocks, counter, should_stop)
    missing = [part for part in blocks if part.number not in where]
    if missing:
        raise UsageError(*_missing_shards(output, missing, records))
    table = table_of(plan, maps, range_reader(maps, lambda number: reload_range(where[number], blocks[number])))
    try:
        return store_result(output, plan, table, None, overwrite, counter, should_stop), n_repeated
    except (StoreError, UnfinishedError) as error:
        raise type(error)(
            "; ".join(filter(None, [str(error), "the work folders keep all finished trajectories"]))
        ) from error


def _read_record(folder: Path) -> _ShardRecord:
    """Read the record of a shard, validated since the folder may come from anywhere.

    Raises
    ------
    UsageError : the folder is not a shard
    """
    try:
        if not (folder / SHARD_FILE_NAME).is_file():
            raise ValueError
        fields = json.loads((folder / SHARD_FILE_NAME).read_text(encoding="utf-8"))
        number, of = fields["shard"]
        command, core, attributes = fields["command"], fields["core"], fields["attributes"]
        is_valid = (
            isinstance(number, int)
            and isinstance(of, int)
            and 1 <= number <= of
            and isinstance(command, list)
            and all(isinstance(word, str) for word in command)
            and core in CORES
            and {*RECORDED_ATTRIBUTES} <= attributes.keys()
        )
        if not is_valid:
            raise ValueError
    except (OSError, ValueError, TypeError, AttributeError, KeyError, RecursionError):
        shown = safe_text(str(folder))
        raise UsageError(f"{shown}: is not a shard; expected a work folder of impact sweep --shard K/N") from None
    return _ShardRecord(Shard(number, of), tuple(command), core, attributes)


def _locate_ranges(
    folders: Sequence[Path],
    plan: Plan,
    blocks: Sequence[TrajectoryRange],
    counter: ProgressCounter,
    should_stop: Callable[[], bool],
) -> tuple[dict[int, WorkFolder], int]:
    """The work folder of each range, and the number of ranges that are in several folders."""
    where: dict[int, WorkFolder] = {}
    repeated: set[int] = set()
    for folder in folders:
        with lock_work_folder(folder, plan) as work_folder:
            for part in blocks:
                if should_stop():
                    raise UnfinishedError("nothing was written")
                trajectories = work_folder.load(part)
                if trajectories is None:
                    continue
                if part.number not in where:
                    where[part.number] = work_folder
                    counter.count(part, trajectories)
                    counter.report()
                    continue
                repeated.add(part.number)
                other = reload_range(where[part.number], part)
                if any(
                    values.tobytes() != vars(other)[name].tobytes() for name, values in vars(trajectories).items()
                ):
                    raise ResultError(
                        f"{safe_text(str(work_folder.path(part.number)))}: differs from "
                        f"{safe_text(str(where[part.number].path(part.number)))}; expected both to "
                        "be computed on the same type of processor"
                    )
    return where, len(repeated)


def _missing_shards(
    output: Path, missing: Sequence[TrajectoryRange], records: Mapping[Path, _ShardRecord]
) -> list[str]:
    """A line for each shard that is missing or unfinished, with the command that completes it."""
    first_record = next(iter(records.values()))
    folders = {record.shard: folder for folder, record in records.items()}
    blocks: dict[Shard, int] = {}
    for part in missing:
        shard = Shard(part.number % first_record.shard.of + 1, first_record.shard.of)
        blocks[shard] = blocks.get(shard, 0) + 1
    lines = []
    for shard in sorted(blocks, key=lambda shard: shard.number)[:MAX_LISTED_SHARDS]:
        again = safe_text(shlex.join([*first_record.command, "--shard", str(shard)]), 500)
        lacks = f"lacks {blocks[shard]:,} block{'' if blocks[shard] == 1 else 's'}"
        if shard in folders:
            lines.append(f"{safe_text(str(folders[shard]))}: shard {shard} {lacks}; {again} finishes it")
        else:
            lines.append(f"{safe_text(str(output))}: shard {shard} is missing; {again} computes it")
    return (
        [*lines, f"and {len(blocks) - MAX_LISTED_SHARDS:,} more shards"]
        if len(blocks) > MAX_LISTED_SHARDS
        else lines
    )
