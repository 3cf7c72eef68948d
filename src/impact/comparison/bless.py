"""Replace a baseline by a new result, with the reason for the change."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import SupportsFloat

import xarray as xr

from ..atomic import check_output
from ..errors import InUseError, ResultError, UsageError
from ..formatting import argument, safe_text
from ..results.provenance import command_start, describe_point, inputs_at
from ..results.schema import kind_of
from ..results.seal import has_seal
from ..results.summary import summarize
from ..results.xarray_backend import load, save_with_attributes
from .compare import Tolerances, check_comparable, compare, effective_tolerances
from .verdict import Verdict


def bless(
    new: str | Path,
    baseline: str | Path,
    *,
    reason: str,
    tol: SupportsFloat | str | Tolerances | None = None,
    allow_failed: bool = False,
    show: Callable[[Verdict], None] | None = None,
) -> Verdict | None:
    """Replace a baseline by a result, and store the reason and the tolerances in it.

    Parameters
    ----------
    new, baseline : files; the baseline need not exist yet
    reason : why the numbers changed
    tol : see `compare`; stored in the new baseline, so that a coarser solver does not loosen later comparisons
    allow_failed : accept a result with failed points
    show : deprecated; called with the verdict before anything is written; an exception prevents the replacement

    Returns
    -------
    Verdict or None : the comparison with the old baseline; None if there was none

    Raises
    ------
    ResultError : one of the files is not a readable result
    UsageError : the reason is empty, a tolerance is invalid, both paths are the same file, or points failed
    InUseError : another process changed the baseline meanwhile
    StoreError : the disk is full or failed; the baseline is unchanged

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/new.h5")
    ...     impact.bless(f"{folder}/new.h5", f"{folder}/baseline.h5", reason="first")
    ...     impact.load(f"{folder}/baseline.h5").attrs["reason"]
    'first'
    """
    if not reason.strip():
        raise UsageError(f"{argument('reason')}: got an empty text, expected the reason for the change")
    if re.search("[\0\ud800-\udfff]", reason):
        raise UsageError(f'{argument("reason")}: got "{safe_text(reason, 60)}", expected UTF-8 text without NUL')
    new, baseline = Path(new), Path(baseline)
    check_output(baseline, new, overwrite=True)
    result = load(new)
    kind = kind_of(result)
    if kind in ("calibration", "board"):
        advice = f"impact compare takes two {kind}s as they are"
        raise UsageError(f"{new}: this is a {kind}, expected the result of a sweep; {advice}")
    check_comparable(result, str(new))
    if not allow_failed:
        _check_no_failures(result, new)
    verdict, attributes, old_seal = None, result.attrs, ""
    if baseline.exists():
        try:
            old_baseline = load(baseline)
        except ResultError as error:
            raise ResultError(f"{error}; it is not modified, remove it to create a new baseline") from None
        attributes, old_seal = old_baseline.attrs, str(old_baseline.encoding["seal"])
        comparison = compare(result, old_baseline, tol=tol)
        repeats = command_start(str(new), result)
        verdict = replace(comparison, new=str(new), baseline=str(baseline), repeats=repeats)
        if show is not None:
            show(verdict)
    added = {"reason": reason, "tolerances": json.dumps(effective_tolerances(tol, attributes))}

    def check() -> None:
        is_same = has_seal(baseline, old_seal) if old_seal else not baseline.exists()
        if not is_same:
            raise InUseError(f"{baseline}: was changed while it was compared, and is not modified; bless it again")

    # what was compared is copied
    save_with_attributes(new, baseline, str(result.encoding["seal"]), added, check)
    return verdict


def _check_no_failures(result: xr.Dataset, path: Path) -> None:
    """Refuse a result with failed points, since later failures would equal their NaNs."""
    names = [name for name in ("status", "friction_status") if name in result]
    summary = summarize(result[names] if names else result)
    if summary.not_counted:
        count = f"{summary.not_counted:,} points are too many to look for failures"
        raise UsageError(f"{path}: {count}; expected fewer, or {argument('allow_failed', True)}")
    if summary.failed:
        count = f"{summary.failed:,} of {summary.points:,} points failed"
        first = ""
        for name, status, laws, indices in summary.first_failed[:1]:
            at = describe_point(inputs_at(result[name], (*laws, *indices)))
            first = f", the first at {at} ({status.name.lower()})"
        raise UsageError(f"{path}: {count}{first}; expected none, or {argument('allow_failed', True)}")
