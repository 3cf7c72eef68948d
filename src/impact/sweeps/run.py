"""Run a plan: a generator of finished blocks, from which progress, storage and pictures fall out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

from ..contact.collide import Contact, collide
from .plan import BLOCK, Block, Plan


def run(plan: Plan, block_size: int = BLOCK) -> Iterator[tuple[Block, Contact]]:
    """Collide block after block, in order.

    Parameters
    ----------
    plan : what to run
    block_size : points integrated at a time; changes no bit of the result
    """
    solver = plan.config.solver
    for block in plan.blocks(block_size):
        model = plan.models[block.model]
        lanes = plan.lanes(model, block.start, block.stop)
        yield block, collide(model, lanes, **asdict(solver))
