"""Align two boards of `impact conform` engine by engine and check by check."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..formatting import safe_text
from ..results.schema import BOARD
from .align import Alignment, align_studies
from .verdict import Difference

MAX_NAMED = 3


def align_boards(new: xr.Dataset, baseline: xr.Dataset, *, subset: bool) -> Alignment:
    """Align two boards by the labels of engines and checks, whose order does not matter."""
    faults = []
    suites = [dataset.attrs["suite"] for dataset in (new, baseline)]
    if suites[0] != suites[1]:
        text = safe_text(f"suite is {suites[0]}, in BASELINE {suites[1]}")
        faults.append(Difference("physics config", "suite", text))
    common = {}
    for dim in ("engine", "check"):
        labels = [list(map(str, dataset[dim].values)) for dataset in (new, baseline)]
        common[dim] = [label for label in labels[1] if label in labels[0]]
        for own, side in ((labels[0], "NEW"), (labels[1], "BASELINE")):
            only = [label for label in own if label not in common[dim]]
            if only and not subset:
                named = ", ".join(only[:MAX_NAMED]) + (", ..." if len(only) > MAX_NAMED else "")
                text = f"{dim}: {len(only)} of {len(own)} in {side} only: {named}"
                faults.append(Difference("labels", dim, safe_text(text, 400)))
        if not common[dim]:
            faults.append(Difference("nothing in common", dim, f"the two have no {dim} in common"))
    names = list(BOARD) if all(common.values()) and suites[0] == suites[1] else []
    new, baseline = (dataset.sel(common) for dataset in (new, baseline))
    # all numbers are dimensionless; what is not supported in one of them differs by its status
    scales = {name: np.maximum(1.0, np.abs(np.nan_to_num(baseline[name].values.astype(float)))) for name in names}
    return align_studies(new, baseline, scales, faults)


def version_notes(new: xr.Dataset, baseline: xr.Dataset) -> list[str]:
    """Name the engines whose version or kind differs."""
    notes = []
    for engine in [str(label) for label in baseline["engine"].values if label in new["engine"].values]:
        for name in ("engine_version", "engine_kind"):
            a, b = (str(dataset[name].sel(engine=engine).item()) for dataset in (new, baseline))
            if a != b:
                word = name.removeprefix("engine_")
                notes.append(
                    safe_text(f"the {word} of {engine} is {a or 'unknown'}, in BASELINE {b or 'unknown'}")
                )
    return notes
