"""What is in a result of any size: verified and counted part after part, in little memory."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ..errors import ResultError
from ..sweeps.plan import Plan
from ..sweeps.points import boxes
from ..sweeps.trajectories import trajectories
from .assembly import Part
from .digest import Taken, content_digest
from .guard import is_in_pieces
from .reader import read
from .store import check, reading
from .tally import Survey, Tally, tally_of


def held(path: Path, plan: Plan) -> Survey | None:
    """What a file holds, if it is the whole result of a plan."""
    if path.is_symlink() or not path.is_file():
        return None
    try:
        found = _survey(path, plan.fingerprint)
        return found and replace(found, trajectories=sum(one.count for one in trajectories(plan)))
    except ResultError:
        return None


def _survey(path: Path, fingerprint: str) -> Survey | None:
    with reading(path) as (file, stream, contents):
        outline = read(file, stream, contents.axes, outline=True)
        if outline.attrs.get("fingerprint") != fingerprint:
            return None
        # as a sweep writes it
        axes = tuple(dim for dim in outline["status"].dims if dim != "model")
        shape = tuple(outline.sizes[dim] for dim in axes)
        along_model = {str(name): one.dims == ("model", *axes) for name, one in outline.data_vars.items()}
        if any(one.dims not in (axes, ("model", *axes)) for one in outline.data_vars.values()):
            return None
        if any(is_in_pieces(file[name].id) for name in along_model):
            dataset = read(file, stream, contents.axes)
            check(dataset, content_digest(dataset))
            return Survey(outline, tally_of(dataset))
        tally, digests = Tally(), {name: Taken() for name in along_model}
        for box in boxes(outline.sizes["model"], shape):
            part = Part(box, {})
            for name, along in along_model.items():
                if along or box.model == 0:
                    part.values[name] = file[name][part.where(along) or ()]
                    digests[name].add(part.values[name])
            tally.add(part)
        check(outline, content_digest(outline, {name: taken.hexdigest() for name, taken in digests.items()}))
    return Survey(outline, tally)
