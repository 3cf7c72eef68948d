"""Shards: a sweep in parts that know nothing of each other, for job arrays without a scheduler of our own.

Shard K of N has the blocks K, K + N, K + 2N, ... in a work folder that stays; those of all shards make the result.
A block is a pure function of its plan, so that it may be in several folders: it has the same bits.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..atomic import appearing
from ..engine.checkpoint import working
from ..engine.execute import never, settled
from ..engine.executors import ALONE, Team
from ..engine.plan import Plan
from ..engine.progress import Gauge, Tell, kept
from ..engine.trajectories import Stretch, stretches, trajectories
from ..errors import UsageError
from ..text import safe_text
from .schema import outline
from .sweep import fill

# what a folder says of its shard, beside the plan
FILE = "shard.json"
ATTRIBUTES = ("config", "config_set", "plugins", "fingerprint")


@dataclass(frozen=True)
class Shard:
    """One of the parts of a sweep, counted from 1."""

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> Shard:
        """The shard of a text such as "3/16".

        Raises
        ------
        UsageError : it is none

        >>> Shard.parse("3/16")
        Shard(number=3, of=16)
        """
        found = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
        shard = cls(*map(int, found.groups())) if found else cls(0, 0)
        if not 1 <= shard.number <= shard.of:
            raise UsageError(f"--shard {safe_text(text)}: wants K/N with K from 1 to N, such as 3/16")
        return shard

    def has(self, stretch: Stretch) -> bool:
        return stretch.number % self.of == self.number - 1

    def folder(self, output: Path) -> Path:
        """Its work folder."""
        return output.with_name(f"{output.name}.{self.number}-of-{self.of}.work")

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"


@dataclass(frozen=True)
class Share:
    """What a shard has finished."""

    folder: Path
    blocks: int
    of_blocks: int
    trajectories: int
    failed: int


def sweep_shard(
    output: Path,
    plan: Plan,
    shard: Shard,
    command: Sequence[str],
    *,
    overwrite: bool = False,
    team: Team = ALONE,
    tell: Tell = lambda progress: None,
    stopping: Callable[[], bool] = never,
) -> Share:
    """Integrate a shard of a plan into its work folder, and go on with what is there.

    Parameters
    ----------
    output : the result that it is to be part of, beside which the folder stands
    plan : of the whole
    shard : which part
    command : words that sweep the whole; what makes a shard that is missing is told by them
    overwrite : begin anew
    team, tell, stopping : see `impact.results.sweep.sweep_into`

    Raises
    ------
    UsageError, InUseError, StoreError, UnfinishedError : see there
    """
    found = trajectories(plan)
    plan = settled(plan, found)
    blocks = list(stretches(found))
    own = [one for one in blocks if shard.has(one)]
    gauge = Gauge.begin(sum(one.size for one in own), plan.points, tell)
    folder = shard.folder(output)
    with working(folder, plan, resume=not overwrite, overwrite=overwrite) as work:
        attributes = outline(plan).attrs
        about = {
            "shard": [shard.number, shard.of],
            "command": list(command),
            "core": plan.config.solver.core,
            "attributes": {name: attributes[name] for name in ATTRIBUTES},
        }
        with appearing(folder / FILE, overwrite=True) as sink:
            sink.write(json.dumps(about).encode())
        with kept(folder, gauge, "the same command", lambda error: []):
            fill(work, plan, found, own, gauge, team, stopping)
    return Share(folder, len(own), len(blocks), gauge.at.trajectories, gauge.at.failed)
