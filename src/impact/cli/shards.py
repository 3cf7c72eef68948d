"""Shards of a sweep: `impact sweep --shard K/N` does one, the command `merge` makes the result of all."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import UnfinishedError
from ..text import safe_text
from . import door
from .options import AllowFailed, Json, Output, Overwrite, Plugins, Quiet
from .who import Who
from .words import dump

if TYPE_CHECKING:
    from ..engine.plan import Plan


def do(
    plan: Plan,
    shard: str,
    command: list[str],
    output: Path,
    who: Who,
    *,
    overwrite: bool,
    quiet: bool,
    as_json: bool,
    should_stop: Callable[[], bool],
) -> None:
    """Do a shard of a plan.

    Parameters
    ----------
    plan : of the whole
    shard : which, such as "3/16"
    command : words that sweep the whole into the output
    """
    from ..results.shards import Shard, sweep_shard
    from .progress import progress

    part = Shard.parse(shard)
    with who.team(quiet=quiet, should_stop=should_stop) as team, progress(quiet=quiet) as tell:
        done = sweep_shard(
            output, plan, part, command, overwrite=overwrite, team=team, tell=tell, should_stop=should_stop
        )
    if should_stop():
        raise UnfinishedError(f"{safe_text(str(done.folder))} has the whole shard")
    if as_json:
        print(dump({**asdict(done), "folder": str(done.folder), "shard": str(part)}))
    if not quiet:
        failed = f", {done.failed:,} failed" if done.failed else ""
        every = output.with_name(f"{shlex.quote(output.name)}.*-of-{part.of}.work")
        door.say(
            f"{safe_text(str(done.folder))}: {done.blocks:,} of {done.of_blocks:,} blocks, {done.trajectories:,} "
            f"trajectories{failed}; with all {part.of:,} shards: impact merge {safe_text(str(every))} "
            f"-o {safe_text(shlex.quote(str(output)))}"
        )


def merge(
    folders: Annotated[list[Path], typer.Argument(help="Work folders that `impact sweep --shard K/N` has made.")],
    output: Output = Path("results.h5"),
    plugins: Plugins = None,
    overwrite: Overwrite = False,
    allow_failed: AllowFailed = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Make the result of a sweep from all of its shards; their folders stay."""
    with door.signals() as stopping:
        from ..engine.plugins import read_plugins
        from ..results.shards import merge as merge_shards
        from . import progress, summary

        with progress.progress(quiet=quiet) as tell:
            found, twice = merge_shards(
                folders, output, read_plugins(plugins or ()), overwrite=overwrite, tell=tell, should_stop=stopping
            )
        if stopping():
            raise UnfinishedError(f"{safe_text(str(output))} was stored whole")
    if twice and not quiet:
        door.say(f"{twice:,} blocks were in more than one folder, with the same bits")
    summary.conclude(found, output, fresh=True, quiet=quiet, as_json=as_json, allow_failed=allow_failed)
