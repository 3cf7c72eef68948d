"""Shards: parts of a sweep that run independently, for example in a job array, and are merged into one result.

Shard K of N has the ranges K, K + N, K + 2N, ... of trajectories in a work folder that stays; those of all shards
make the result. A range is a pure function of its plan: it may be in several folders, with the same bits.
"""

from __future__ import annotations

import json
import re
import shlex
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from ..atomic import atomic_write, check_outputs, check_result_name
from ..config.draft import settings_of
from ..config.grid import MAX_POINTS
from ..config.tables import CORES
from ..contact.model import ForceModel
from ..display import Block, Displayed
from ..engine.checkpoint import WorkFolder, lock_work_folder, open_work_folder
from ..engine.executors import SERIAL, ExecutorSpec
from ..engine.plan import Plan
from ..engine.plugins import read_plugins
from ..engine.run import ProgressCallback, ProgressCounter, Run, ignore, never, report_kept_ranges
from ..engine.trajectories import TrajectoryRange
from ..errors import ResultError, StoreError, UnfinishedError, UsageError, warn
from ..formatting import argument
from .provenance import stored_config
from .schema import dataset_template
from .summary import SweepOutcome
from .sweep import check_storable, complete_ranges, read_plan, reload_range, store_result
from .trajectory_table import table_of_ranges

# describes the shard of a work folder, next to the plan
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

        >>> Shard.parse("3/16")
        Shard(number=3, of=16)
        """
        match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
        shard = cls(*map(int, match.groups())) if match else cls(0, 0)
        if not 1 <= shard.number <= shard.of:
            raise UsageError(f"{argument('shard', text)}: expected K/N with K from 1 to N, such as 3/16")
        return shard

    @property
    def suffix(self) -> str:
        """The end of the name of its work folder, after that of the result."""
        return f".{self.number}-of-{self.of}.work"

    def folder(self, output: Path) -> Path:
        """Name its work folder."""
        return output.with_name(output.name + self.suffix)

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"


@dataclass(frozen=True)
class ShardProgress(Displayed):
    """The finished part of a shard."""

    folder: Path
    blocks: int
    of_blocks: int
    trajectories: int
    failed: int
    shard: Shard

    def as_dict(self) -> dict[str, Any]:
        """The counts as plain data."""
        return {**vars(self), "folder": str(self.folder), "shard": str(self.shard)}

    def sections(self, width: int) -> Iterator[Block]:
        """What is finished, and the command that joins all shards."""
        failed = f", {self.failed:,} failed" if self.failed else ""
        name = self.folder.name.removesuffix(self.shard.suffix)
        output = self.folder.with_name(name)
        folders = self.folder.with_name(f"{shlex.quote(name)}.*-of-{self.shard.of}.work")
        yield (
            f"{self.folder}: {self.blocks:,} of {self.of_blocks:,} blocks, {self.trajectories:,} "
            f"trajectories{failed}; with all {self.shard.of:,} shards: impact merge {folders} "
            f"-o {shlex.quote(str(output))}"
        )


def sweep_shard(
    source: str | Path | Mapping[str, object],
    shard: str,
    output: str | Path,
    *,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    backend: AbstractContextManager[ExecutorSpec] | None = None,
    max_points: int = MAX_POINTS,
    overwrite: bool = False,
    on_progress: ProgressCallback | None = None,
    on_note: Callable[[str], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> ShardProgress:
    """Integrate one shard of a sweep into its work folder; `merge` joins the folders of all shards.

    Parameters
    ----------
    shard : "K/N", the part K of N, such as "3/16"
    output : file of the whole result; the work folder is next to it
    overwrite : start the shard again
    source, overrides, plugins, max_points, backend, on_progress, on_note, should_stop : see `sweep_to_file`

    Returns
    -------
    ShardProgress : the work folder, and its finished part

    Raises
    ------
    ConfigError, UsageError, ModelError, InUseError, StoreError, UnfinishedError : see `sweep_to_file`

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.sweep_shard("configs/figure6.toml", "1/1", f"{folder}/results.h5").trajectories
    303
    """
    check_outputs([output], plugins, overwrite=True)
    check_result_name(output)
    told = on_progress or ignore, on_note or warn, should_stop or never
    run = Run(backend or SERIAL, not overwrite, overwrite, max_points, *told)
    plan = read_plan(source, overrides, plugins, run)
    chosen = Shard.parse(shard)
    # the command of the whole sweep: `merge` reports it for a missing shard
    config = str(source) if isinstance(source, str | Path) else "CONFIG.toml"
    command = ["impact", "sweep", config, "-o", str(output)]
    command += [word for setting in settings_of(overrides) for word in ("--set", setting.override)]
    command += [word for path in plugins if isinstance(path, str | Path) for word in ("--plugin", str(path))]
    check_storable(plan)
    ranges = [part for part in plan.ranges if part.number % chosen.of == chosen.number - 1]
    folder, attributes = chosen.folder(Path(output)), dataset_template(plan).attrs
    record = {
        "shard": [chosen.number, chosen.of],
        "command": command,
        "core": plan.solver.core,
        "attributes": {name: attributes[name] for name in RECORDED_ATTRIBUTES},
    }
    with run.connected() as connected, open_work_folder(folder, plan, connected) as work_folder:
        counter = ProgressCounter(ranges, plan.points, connected)
        with atomic_write(folder / SHARD_FILE_NAME, overwrite=True) as sink:
            sink.write(json.dumps(record).encode())
        with report_kept_ranges(folder, counter, "the same command", lambda error: []):
            complete_ranges(work_folder, plan, ranges, counter)
    run.check_stop(f"{folder} is complete")
    progress = counter.progress
    return ShardProgress(folder, len(ranges), len(plan.ranges), progress.trajectories, progress.failed, chosen)


class _ShardRecord(BaseModel):
    """The record of a shard in its work folder; it is validated, since the folder may come from anywhere."""

    model_config = ConfigDict(strict=True, frozen=True)

    shard: Annotated[Shard, BeforeValidator(lambda numbers: Shard.parse("/".join(map(str, numbers))))]
    command: tuple[str, ...]
    core: Annotated[str, Field(pattern=f"^({'|'.join(CORES)})$")]
    attributes: dict[str, Any]


def merge(
    folders: str | Path | Sequence[str | Path],
    output: str | Path,
    *,
    plugins: Sequence[ForceModel | str | Path] = (),
    overwrite: bool = False,
    on_progress: ProgressCallback | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> SweepOutcome:
    """Join the shards of a sweep into a file, and summarize it; the work folders are kept.

    Parameters
    ----------
    folders : the work folders of all shards, in any order
    output : the file
    plugins : the plug-in models that the shards were integrated with
    overwrite : replace the file if it exists
    on_progress, should_stop : see `sweep_to_file`

    Returns
    -------
    SweepOutcome : counts of points by status, largest errors, first failed points

    Raises
    ------
    UsageError : a folder is not a shard, or of another sweep; or shards are missing or unfinished
    ResultError : a range is in two folders, with different bits
    InUseError, StoreError, UnfinishedError : see `sweep_to_file`

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     output = f"{folder}/results.h5"
    ...     shards = [impact.sweep_shard("configs/figure6.toml", f"{k}/2", output) for k in (1, 2)]
    ...     impact.merge([shard.folder for shard in shards], output).summary.points
    303
    """
    check_outputs([output], plugins, overwrite=overwrite)
    check_result_name(output)
    output = Path(output)
    run = Run(overwrite=overwrite, on_progress=on_progress or ignore, should_stop=should_stop or never)
    plugin_set = read_plugins(plugins)
    listed = [folders] if isinstance(folders, str | Path) else folders
    distinct = {Path(folder).resolve(): Path(folder) for folder in listed}.values()
    if not distinct:
        raise UsageError("folders: got none, expected the work folders of all shards")
    records = {folder: _read_record(folder) for folder in distinct}
    first, first_record = next(iter(records.items()))
    config = stored_config(first_record.attributes, [], plugin_set, str(first))
    # the core that the shards were integrated by, which may not be the default of this machine
    config = replace(config, solver=replace(config.solver, core=first_record.core))
    plan = Plan(config, plugin_set.of(config.models))
    counter = ProgressCounter(plan.ranges, plan.points, run)
    for folder, record in records.items():
        if record.attributes["fingerprint"] != first_record.attributes["fingerprint"]:
            # a difference in the trajectories is reported first, by its name
            with lock_work_folder(folder, plan):
                raise UsageError(
                    f"{folder}: its title or output differs from that of {first}; "
                    "expected the folders of one sweep"
                )
    # folders are locked one after the other: there may be more of them than the limit of open files
    folder_of, repeated = _locate_ranges([*records], plan, counter)
    missing = [trajectory_range for trajectory_range in plan.ranges if trajectory_range not in folder_of]
    if missing:
        raise UsageError(*_missing_shards(output, missing, records))
    table = table_of_ranges(plan, lambda finished: reload_range(folder_of[finished], finished))
    try:
        outcome = store_result(output, plan, table, counter, run)
    except (StoreError, UnfinishedError) as error:
        raise type(error)(
            "; ".join(filter(None, [str(error), "the work folders keep all finished trajectories"]))
        ) from error
    run.check_stop(f"{output} is complete")
    return replace(outcome, repeated_blocks=repeated)


def _read_record(folder: Path) -> _ShardRecord:
    """Read the record of a shard."""
    try:
        if not (folder / SHARD_FILE_NAME).is_file():
            raise ValueError
        record = _ShardRecord.model_validate_json((folder / SHARD_FILE_NAME).read_bytes())
        if not {*RECORDED_ATTRIBUTES} <= record.attributes.keys():
            raise ValueError
    except (OSError, ValueError, TypeError):
        raise UsageError(f"{folder}: is not a shard; expected a work folder of impact sweep --shard K/N") from None
    return record


def _locate_ranges(
    folders: Sequence[Path], plan: Plan, counter: ProgressCounter
) -> tuple[dict[TrajectoryRange, WorkFolder], int]:
    """Find the work folder of each range, and count the ranges that are in several folders."""
    folder_of: dict[TrajectoryRange, WorkFolder] = {}
    repeated: set[TrajectoryRange] = set()
    for folder in folders:
        with lock_work_folder(folder, plan) as work_folder:
            for trajectory_range in plan.ranges:
                counter.run.check_stop("nothing was written")
                collisions = work_folder.load(trajectory_range)
                if collisions is None:
                    continue
                if trajectory_range not in folder_of:
                    folder_of[trajectory_range] = work_folder
                    counter.count(trajectory_range, collisions)
                    counter.report()
                    continue
                repeated.add(trajectory_range)
                other = vars(reload_range(folder_of[trajectory_range], trajectory_range))
                if any(values.tobytes() != other[name].tobytes() for name, values in vars(collisions).items()):
                    raise ResultError(
                        f"{work_folder.path(trajectory_range)}: differs from "
                        f"{folder_of[trajectory_range].path(trajectory_range)}; expected both to be computed on "
                        "the same type of processor"
                    )
    return folder_of, len(repeated)


def _missing_shards(
    output: Path, missing: Sequence[TrajectoryRange], records: Mapping[Path, _ShardRecord]
) -> Iterator[str]:
    """List the shards that are missing or unfinished, each with the command that completes it."""
    first_record = next(iter(records.values()))
    folders = {record.shard: folder for folder, record in records.items()}
    n_shards = first_record.shard.of
    counts = Counter(trajectory_range.number % n_shards + 1 for trajectory_range in missing)
    for number in sorted(counts)[:MAX_LISTED_SHARDS]:
        shard = Shard(number, n_shards)
        again = shlex.join([*first_record.command, "--shard", str(shard)])
        lacks = f"lacks {counts[number]:,} block{'' if counts[number] == 1 else 's'}"
        if shard in folders:
            yield f"{folders[shard]}: shard {shard} {lacks}; {again} finishes it"
        else:
            yield f"{output}: shard {shard} is missing; {again} computes it"
    if len(counts) > MAX_LISTED_SHARDS:
        yield f"and {len(counts) - MAX_LISTED_SHARDS:,} more shards"
