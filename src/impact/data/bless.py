"""A new baseline in the place of an old one, with the reason why."""

from __future__ import annotations

import json
from pathlib import Path

from ..errors import UsageError
from .compare import check_result, compare
from .store import check_output, load, save
from .tolerances import Tolerances, chosen
from .verdict import Verdict


def bless(
    new: str | Path, baseline: str | Path, *, reason: str, tol: float | Tolerances | None = None
) -> Verdict | None:
    """Let a result take the place of a baseline, which then carries the reason and the tolerances chosen.

    Parameters
    ----------
    new, baseline : files; the baseline need not exist yet
    reason : why the numbers changed
    tol : see `compare`; kept in the baseline, beside those that it has chosen before

    Returns
    -------
    Verdict, or None : how the two differed; None where there was no baseline

    Raises
    ------
    ResultError : one of the files is not a readable result
    UsageError : the reason is empty, a tolerance is not right, or the two are one file
    StoreError : the disk is full or failed; the baseline is as it was

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/new.h5")
    ...     impact.bless(f"{folder}/new.h5", f"{folder}/baseline.h5", reason="first")
    ...     impact.load(f"{folder}/baseline.h5").attrs["reason"]
    'first'
    """
    if not reason.strip():
        raise UsageError("--reason: empty, wants why the numbers changed")
    new, baseline = Path(new), Path(baseline)
    check_output(baseline, overwrite=True, source=new)
    result = load(new)
    check_result(result, str(new))
    verdict = compare(new, baseline, tol=tol) if baseline.exists() else None
    kept = chosen(tol, result.attrs if verdict is None else load(baseline).attrs)
    save(result.assign_attrs(reason=reason, tolerances=json.dumps(kept)), baseline, overwrite=True)
    return verdict
