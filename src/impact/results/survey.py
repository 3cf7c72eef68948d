"""What is in a result of any size: verified and counted part after part, in little memory."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np
import xarray as xr

from ..engine.plan import Plan
from ..engine.points import boxes
from ..engine.trajectories import trajectories
from ..errors import ResultError
from .assembly import Part
from .digest import Taken, content_digest
from .guard import is_in_pieces
from .pieces import count, find, read_pieces
from .reader import read
from .store import check, reading
from .summary import Survey, Tally


def held(path: Path, plan: Plan) -> Survey | None:
    """What a file holds, if it is the whole result of a plan."""
    if path.is_symlink() or not path.is_file():
        return None
    try:
        found = _survey(path, plan.fingerprint)
        return found and replace(found, trajectories=sum(one.count for one in trajectories(plan)))
    except ResultError:
        return None


def outlined(path: Path) -> xr.Dataset:
    """The outline of a result, which was verified: its coordinates and attributes, without the values.

    Raises
    ------
    ResultError : it is not a readable result
    """
    with reading(path, math.inf) as (file, stream, contents):
        outline = read(file, stream, contents.axes, outline=True)
        _verify(file, stream, outline)
    return outline


def _survey(path: Path, fingerprint: str) -> Survey | None:
    with reading(path, math.inf) as (file, stream, contents):
        outline = read(file, stream, contents.axes, outline=True)
        if outline.attrs.get("fingerprint") != fingerprint:
            return None
        axes = outline["status"].dims[1:]
        if any(one.dims not in (axes, ("model", *axes)) for one in outline.data_vars.values()):
            # not as a sweep writes it
            return None
        return Survey(outline, _verify(file, stream, outline))


def _verify(file: h5py.File, stream: BinaryIO, outline: xr.Dataset) -> Tally:
    """Check a result, variable after variable and part after part, and count its points."""
    packed = {str(name): count(file[name].id) for name in outline.data_vars if is_in_pieces(file[name].id)}
    pieces = find(file.filename, packed)
    tally, digests = Tally(), {}
    for name, one in outline.data_vars.items():
        taken, has_model = Taken(), one.dims[:1] == ("model",)
        shape = one.shape[1:] if has_model else one.shape
        # what is packed is one part, unpacked as a whole
        whole = read_pieces(file[name].id, stream, pieces[str(name)]) if str(name) in pieces else None
        for box in boxes(one.shape[0] if has_model else 1, shape):
            part = Part(box, {})
            where = part.where(has_model) or ()
            part.values[str(name)] = np.asarray(file[name][where] if whole is None else whole[where])
            taken.add(part.values[str(name)])
            if has_model:
                tally.add(part.values, box.model, [along.start for along in box.where])
        digests[str(name)] = taken.hexdigest()
    check(outline, content_digest(outline, digests))
    return tally
