"""One variable of two aligned results: how many tolerances apart at every point, and where it is worst."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..contact.material import effective_mass
from ..contact.status import Status
from ..results.replay import own
from ..results.schema import Variable, is_input
from .verdict import Judged

Array = NDArray[Any]

# what a law may not have, or a sweep without e: NaN where all went well
OPTIONAL = ("damping_ratio", "lambda", "closed_form_error", "e_error", "v1_error", "v2_error")


def judge(one: Variable, new: xr.Dataset, baseline: xr.Dataset, tol: float) -> tuple[Judged, xr.Variable]:
    """One variable at all points: |new - baseline| in tolerances, inf where nothing is allowed."""
    # bare variables, because a DataArray carries all its coordinates along at every step
    reference = baseline.variables[one.name]
    dims = tuple(map(str, reference.dims))
    a, b = new.variables[one.name].transpose(*dims).values, reference.values
    with np.errstate(all="ignore"):
        difference = np.where(a == b, 0.0, np.abs(a.astype(float) - b.astype(float)))
        scale = np.broadcast_to(_scale(one, baseline), b.shape)
        # what was stored in fewer digits has lost the others
        lost = sum(float(np.finfo(values.dtype).eps) for values in (a, b) if values.dtype == np.float32)
        allowed = tol * scale + (lost * np.maximum(np.abs(a), np.abs(b)) if lost else 0.0)
        if one.judged == "bounded by 10 rtol":
            # a residual is noise: it is fine below its bound, wherever it was
            counted = np.minimum(difference, np.maximum(np.abs(a), np.abs(b)))
        else:
            counted = difference
        if one.judged in ("exact", "reported"):
            ratio = np.where(difference == 0.0, 0.0, np.inf)
            tol = math.nan
        else:
            # of an infinite scale every difference would be a small part
            has_measure = (allowed > 0.0) & np.isfinite(scale) & np.isfinite(counted)
            ratio = np.where(counted == 0.0, 0.0, np.where(has_measure, counted / allowed, np.inf))
    missing = np.isnan(a.astype(float)), np.isnan(b.astype(float))
    ratio = np.where(missing[0] | missing[1], np.inf, ratio)
    if (missing[0] & missing[1]).any():
        ratio = np.where(missing[0] & missing[1] & _may_be_missing(one, new, baseline), 0.0, ratio)
    different = ratio > 1.0
    judged = Judged(
        name=one.name, judged=one.judged, tolerance=tol, points=b.size, different=int(different.sum()),
        **_worst(one, dims, ratio, difference, new, a, b),
    )  # fmt: skip
    return judged, xr.Variable(dims, ratio)


def _worst(
    one: Variable, dims: tuple[str, ...], ratio: Array, difference: Array, new: xr.Dataset, a: Array, b: Array
) -> dict[str, Any]:
    """The point with the largest ratio, among equals the one with the largest difference.

    Of flags, which are not more or less different, the first. Its labels are those of the new result: with them a
    config, read again here, has the point.
    """
    if not ratio.size or not ratio.max():
        return {"worst": 0.0, "times": 0.0, "at": {}, "new": math.nan, "baseline": math.nan}
    sizes = np.ones_like(ratio) if one.judged == "exact" else np.nan_to_num(difference, nan=np.inf)
    index = np.unravel_index(int(np.argmax(np.where(ratio == ratio.max(), sizes, -1.0))), ratio.shape)
    at = {
        name: new.variables[name].values[place].item()
        for dim, place in zip(dims, index, strict=True)
        for name in [dim, *(str(n) for n in new.coords if n != dim and is_input(str(n)))]
        if new.variables[name].dims == (dim,) and not (name == "e" and "alpha" in new.coords)
    }
    plain = {name: float(one) if isinstance(one, int | float) else str(one) for name, one in own(at).items()}
    return {
        "worst": float(difference[index]), "times": float(ratio[index]), "at": plain,
        "new": float(a[index]), "baseline": float(b[index]),
    }  # fmt: skip


def _scale(one: Variable, baseline: xr.Dataset) -> Array:
    """What a variable's tolerance is relative to, at every point, in its own unit."""
    template = baseline.variables[one.name]

    def along(name: str) -> Array:
        laid_out = baseline.variables[name].set_dims(dict(template.sizes))  # type: ignore[no-untyped-call]
        return np.asarray(laid_out.values, float)

    match one.judged:
        case "scaled by v0":
            return np.asarray(np.abs(along("v1") - along("v2")))
        case "scaled by m v0^2/2":
            v0 = along("v1") - along("v2")
            return np.asarray(0.5 * effective_mass(along("m1"), along("m2")) * v0 * v0)
        case "scaled by the peak" if "peak_indentation" in baseline:
            return np.asarray(np.abs(along("peak_indentation")))
        case "scaled by itself" | "scaled by the peak":
            return np.asarray(np.abs(template.values))
    return np.ones(template.shape)


def _may_be_missing(one: Variable, new: xr.Dataset, baseline: xr.Dataset) -> Array | bool:
    """Where NaN in both is no difference: both points ended alike, and not with an answer that has this value."""
    if one.per == "axes" or "status" not in new or "status" not in baseline:
        return True
    dims = baseline.variables[one.name].dims
    ours, others = (dataset.variables["status"].transpose(*dims).values for dataset in (new, baseline))
    return np.asarray((ours == others) & ((others != Status.OK) | (one.name in OPTIONAL)))
