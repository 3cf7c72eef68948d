"""A sweep into a file: what is finished is kept, the file is a function of it, and appears when it is whole."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from pathlib import Path

import xarray as xr

from ..atomic import appearing
from ..contact.strike import Rebound
from ..engine.checkpoint import Work, folder_of, part_of, remove, working
from ..engine.execute import never, run, settled
from ..engine.executors import ALONE, Team
from ..engine.finished import Finished
from ..engine.plan import Plan
from ..engine.points import Rows, boxes_of
from ..engine.progress import Gauge, Tell, kept
from ..engine.trajectories import BLOCK, Stretch, Trajectories, stretches, trajectories
from ..errors import StoreError, UnfinishedError
from ..text import safe_text
from .assembly import Part, assemble, parts, parts_as_finished
from .digest import Taken, content_digest
from .schema import outline
from .store import check_output, vet_own
from .summary import Survey, Tally
from .writer import writing

# bytes that a result takes besides its values, about
OVERHEAD = 2**16
# points up to which a sweep of one block keeps nothing: it is done again sooner than it is read
FEW = 2**20


def sweep_into(
    output: Path,
    plan: Plan,
    *,
    resume: bool = False,
    overwrite: bool = False,
    team: Team = ALONE,
    tell: Tell = lambda progress: None,
    stopping: Callable[[], bool] = never,
) -> Survey:
    """Run a plan, and store its result.

    Parameters
    ----------
    output : the file
    plan : what to run
    resume : go on with the work folder that an interrupted sweep left
    overwrite : replace the file if it exists, and a work folder if it is not to be resumed
    team : who integrates
    tell : is told how far it is, now and then
    stopping : whether to stop; what was begun is finished and kept

    Raises
    ------
    UsageError : the output, or the work folder, is not to be touched
    InUseError : another process writes the output
    StoreError : the disk is full or failed, or processes were killed; what is finished is kept
    UnfinishedError : it was told to stop; likewise
    """
    check_output(output, overwrite=overwrite)
    found = trajectories(plan)
    plan = settled(plan, found)
    blocks = list(stretches(found))
    total = sum(one.count for one in found)
    gauge = Gauge.begin(total, plan.points, tell)
    if total <= BLOCK and plan.points <= FEW and not os.path.lexists(folder_of(output)):
        finished = {}
        for stretch, rebound in run(plan, found, blocks):
            finished[stretch.number] = rebound
            gauge.count(stretch, rebound)
        rows = Finished(found, finished.__getitem__).rows
        try:
            return assembled(output, plan, found, rows, None, overwrite, gauge, stopping)
        except UnfinishedError:
            raise UnfinishedError("nothing was written") from None

    folder = folder_of(output)
    with working(folder, plan, resume=resume, overwrite=overwrite) as work:
        # another may have stored it since
        check_output(output, overwrite=overwrite)
        # without the other word a result that is to be replaced would be in the way
        again = "--resume --overwrite" if os.path.lexists(output) else "--resume"
        with kept(folder, gauge, again, lambda error: _room(error, output, plan, gauge)):
            fill(work, plan, found, blocks, gauge, team, stopping)
            rows = Finished(found, lambda number: again_loaded(work, blocks[number])).rows
            survey = assembled(output, plan, found, rows, part_of(output), overwrite, gauge, stopping)
        remove(folder)
    return survey


def fill(
    work: Work,
    plan: Plan,
    found: Sequence[Trajectories],
    blocks: Sequence[Stretch],
    gauge: Gauge,
    team: Team,
    stopping: Callable[[], bool],
) -> None:
    """Have all of some blocks in a work folder.

    Raises
    ------
    StoreError, UsageError : see `sweep_into`
    UnfinishedError : it was told to stop
    """
    todo: list[Stretch] = []
    for stretch in blocks:
        one = None if stopping() else work.load(stretch)
        if one is None:
            todo.append(stretch)
        else:
            gauge.count(stretch, one)
    gauge.say()
    for stretch, rebound in run(plan, found, todo, team=team, stopping=stopping):
        work.store(stretch, rebound)
        gauge.count(stretch, rebound)
        gauge.say()
    if not gauge.is_full:
        raise UnfinishedError


def in_memory(plan: Plan, *, team: Team = ALONE, tell: Tell, stopping: Callable[[], bool]) -> xr.Dataset:
    """Run a plan, and hold its result; for the parameters see `sweep_into`.

    Raises
    ------
    UnfinishedError : it was told to stop; nothing is kept
    """
    found = trajectories(plan)
    plan = settled(plan, found)
    gauge = Gauge.begin(sum(one.count for one in found), plan.points, tell)

    def finished() -> Iterator[tuple[Stretch, Rebound]]:
        for stretch, rebound in run(plan, found, stretches(found), team=team, stopping=stopping):
            gauge.count(stretch, rebound)
            gauge.say()
            yield stretch, rebound
        if not gauge.is_full or stopping():
            raise UnfinishedError("nothing was written")

    return assemble(plan, parts_as_finished(plan, found, finished()))


def again_loaded(work: Work, stretch: Stretch) -> Rebound:
    """A block that was finished.

    Raises
    ------
    StoreError : it is damaged
    """
    rebound = work.load(stretch)
    if rebound is None:
        raise StoreError(f"{safe_text(str(work.path(stretch.number)))}: cannot be read any more")
    return rebound


def _room(error: Exception, output: Path, plan: Plan, gauge: Gauge) -> list[str]:
    """On a full disk, how much more room it takes."""
    cause = error.__cause__
    if not isinstance(cause, OSError) or cause.errno not in (errno.ENOSPC, errno.EDQUOT):
        return []
    wanted = (
        outline(plan).nbytes
        + OVERHEAD
        + (gauge.at.of_trajectories - gauge.at.trajectories)
        * sum(getattr(Rebound.blank(1), one.name).nbytes for one in fields(Rebound))
    )
    free = shutil.disk_usage(output.parent).free
    return [f"it takes {wanted:,} bytes more, {free:,} are free"]


def assembled(
    output: Path,
    plan: Plan,
    found: Sequence[Trajectories],
    rows: Rows,
    part: Path | None,
    overwrite: bool,
    gauge: Gauge,
    stopping: Callable[[], bool],
) -> Survey:
    """Write the result of finished trajectories, and give it its name."""
    at = gauge.at
    made, output_of = outline(plan), plan.config.output
    tally, digests = Tally(), {str(name): Taken() for name in made.data_vars}
    along_model = {name for name in digests if "model" in made[name].dims}
    with appearing(output, overwrite=overwrite, part=part) as sink:
        with writing(sink, made, output_of) as (put, seal):

            def store(one: Part) -> None:
                for name, values in one.values.items():
                    put(name, one.where(name in along_model), values)

            def check() -> None:
                gauge.tell(replace(at, points=max(tally.points, stored), failed=tally.failed or at.failed))
                if stopping():
                    raise UnfinishedError

            stored = 0
            if output_of.chunks:
                # each piece is packed once; the digest is of another order, and what it is of is made again
                lengths = [output_of.chunks.get(axis.name, axis.size) for axis in plan.config.axes]
                for one in parts(plan, found, rows, boxes_of(len(plan.models), plan.shape, lengths)):
                    store(one)
                    stored += one.box.size
                    check()
            for one in parts(plan, found, rows):
                if not output_of.chunks:
                    store(one)
                for name, values in one.values.items():
                    digests[name].add(values)
                start = [along.start for along in one.box.where]
                tally.add(one.values, one.box.model, start, one.radius)
                check()
            digest = content_digest(made, {name: taken.hexdigest() for name, taken in digests.items()})
            seal(digest)
        vet_own(sink, output)
    return Survey(made.assign_attrs(content_digest=digest), tally, at.of_trajectories)
