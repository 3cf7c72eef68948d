"""Merging: the result of a sweep from the folders of its shards, or what they lack."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from ..engine.checkpoint import Work, held, part_of
from ..engine.execute import never
from ..engine.finished import Finished
from ..engine.plan import Plan
from ..engine.plugins import Plugins
from ..engine.progress import Gauge, Tell
from ..engine.trajectories import Stretch, stretches, trajectories
from ..errors import ResultError, StoreError, UnfinishedError, UsageError
from ..sweeps.settings import CORES
from ..text import safe_text
from .provenance import stored_config
from .shards import ATTRIBUTES, FILE, Shard
from .store import check_output
from .summary import Survey
from .sweep import again_loaded, assembled

TOLD = 5  # shards that are missing


@dataclass(frozen=True)
class _Told:
    """What a folder says of its shard."""

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
    tell: Tell = lambda progress: None,
    stopping: Callable[[], bool] = never,
) -> tuple[Survey, int]:
    """Store the result that shards make; their folders stay as they are.

    Parameters
    ----------
    folders : of the shards, in any order
    output : the file
    plugins : the models of one's own that they were made with
    overwrite : replace the file if it exists
    tell, stopping : see `impact.results.sweep.sweep_into`

    Returns
    -------
    The result, and how many blocks were in more than one folder, where they have the same bits.

    Raises
    ------
    UsageError : a folder is no shard, or of another sweep; or shards are missing or unfinished, each of which is
        told with the command that makes it
    ResultError : a block is in two folders, and they differ
    InUseError : a shard is still being made
    StoreError, UnfinishedError : nothing was stored; the folders have all of it
    """
    check_output(output, overwrite=overwrite)
    told = {folder: _told(folder) for folder in {one.resolve(): one for one in folders}.values()}
    first, about = next(iter(told.items()))
    config = stored_config(about.attributes, [], plugins, str(first))
    # the core that it was settled on, whichever is here
    config = replace(config, solver=replace(config.solver, core=about.core))
    plan = Plan(config, plugins.of(config.models))
    found = trajectories(plan)
    blocks = list(stretches(found))
    gauge = Gauge.begin(sum(one.count for one in found), plan.points, tell)
    with ExitStack() as stack:
        works = [stack.enter_context(held(folder, plan)) for folder in told]
        for folder, one in told.items():
            if one.attributes["fingerprint"] != about.attributes["fingerprint"]:
                raise UsageError(
                    f"{safe_text(str(folder))}: its title or output is not that of {safe_text(str(first))}; wants "
                    "the folders of one sweep"
                )
        where, twice = _places(works, blocks, gauge, stopping)
        lacking = [one for one in blocks if one.number not in where]
        if lacking:
            raise UsageError("\n".join(_missing(output, lacking, told)))
        rows = Finished(found, lambda number: again_loaded(where[number], blocks[number])).rows
        try:
            return assembled(output, plan, found, rows, part_of(output), overwrite, gauge, stopping), twice
        except (StoreError, UnfinishedError) as error:
            raise type(error)(
                "; ".join(filter(None, [str(error), "the folders have all that is finished"]))
            ) from error


def _told(folder: Path) -> _Told:
    """What a folder says of its shard; it may come from anywhere.

    Raises
    ------
    UsageError : it is no shard
    """
    try:
        if not (folder / FILE).is_file():
            raise ValueError
        found = json.loads((folder / FILE).read_text(encoding="utf-8"))
        number, of = found["shard"]
        command, core, attributes = found["command"], found["core"], found["attributes"]
        right = (
            isinstance(number, int) and isinstance(of, int) and 1 <= number <= of
            and isinstance(command, list) and all(isinstance(one, str) for one in command)
            and core in CORES and {*ATTRIBUTES} <= attributes.keys()
        )  # fmt: skip
        if not right:
            raise ValueError
    except (OSError, ValueError, TypeError, AttributeError, KeyError, RecursionError):
        shown = safe_text(str(folder))
        raise UsageError(f"{shown}: is no shard, wants a folder that impact sweep --shard K/N makes") from None
    return _Told(Shard(number, of), tuple(command), core, attributes)


def _places(
    works: Sequence[Work], blocks: Sequence[Stretch], gauge: Gauge, stopping: Callable[[], bool]
) -> tuple[dict[int, Work], int]:
    """In which folder each block is, and how many are in several."""
    where: dict[int, Work] = {}
    twice = 0
    for stretch in blocks:
        if stopping():
            raise UnfinishedError("nothing was written")
        found = [(work, one) for work in works if (one := work.load(stretch)) is not None]
        for (work, one), (other, another) in pairwise(found):
            if any(getattr(one, name).tobytes() != values.tobytes() for name, values in vars(another).items()):
                raise ResultError(
                    f"{safe_text(str(other.path(stretch.number)))}: differs from "
                    f"{safe_text(str(work.path(stretch.number)))}; wants both of processors of one kind"
                )
        if found:
            where[stretch.number] = found[0][0]
            twice += len(found) > 1
            gauge.count(stretch, found[0][1])
            gauge.say()
    return where, twice


def _missing(output: Path, lacking: Sequence[Stretch], told: Mapping[Path, _Told]) -> list[str]:
    """A line for each shard that is missing or unfinished, with what makes it."""
    about = next(iter(told.values()))
    folders = {one.shard: folder for folder, one in told.items()}
    blocks: dict[Shard, int] = {}
    for stretch in lacking:
        shard = Shard(stretch.number % about.shard.of + 1, about.shard.of)
        blocks[shard] = blocks.get(shard, 0) + 1
    lines = []
    for shard in sorted(blocks, key=lambda one: one.number)[:TOLD]:
        again = safe_text(shlex.join([*about.command, "--shard", str(shard)]), 500)
        lacks = f"lacks {blocks[shard]:,} block{'' if blocks[shard] == 1 else 's'}"
        if shard in folders:
            lines.append(f"{safe_text(str(folders[shard]))}: shard {shard} {lacks}; {again} finishes it")
        else:
            lines.append(f"{safe_text(str(output))}: shard {shard} is missing; {again} makes it")
    return [*lines, f"and {len(blocks) - TOLD:,} more shards"] if len(blocks) > TOLD else lines
