"""The board of `impact conform`: the checks of engines, as a dataset, as text and as plain data."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr

from .._version import __version__
from ..display import Block, DisplayedDataset, Table
from ..formatting import number
from . import schema

# names in the order of a board; what is asked for is met by a value at most, at least or equally large
CHECKS: Mapping[str, Literal["equal", "at most", "at least"]] = {
    "finite": "equal",
    "momentum": "equal",
    "angular_momentum": "equal",
    "energy": "at most",
    "separates": "at least",
    "restitution": "equal",
    "friction": "equal",
    "friction_bound": "at most",
    "spin": "equal",
    "frame": "equal",
    "mirror": "equal",
    "exchange": "equal",
    "scale": "equal",
    "step": "at most",
    "repeat": "equal",
}
BOARD_HEADINGS = ("check", "passed", "failed", "not supported", "worst", "asked", "delivered", "tolerance")
# of the collisions at which a check failed
MAX_NAMED = 4


class EngineChecks(NamedTuple):
    """The checks of one engine; arrays with one entry for each check of the board.

    `status` has positions in `schema.CHECK_STATUSES`.
    """

    engine: str
    version: str
    kind: str
    asked: Sequence[float]
    delivered: Sequence[float]
    tolerance: Sequence[float]
    status: Sequence[int]


def board_dataset(suite: str, labels: Sequence[tuple[str, str]], engines: Sequence[EngineChecks]) -> xr.Dataset:
    """Make the dataset of a board of a set of collisions; the labels are the collision and name of each check."""
    coordinates = {
        "engine": ("engine", [engine.engine for engine in engines], "engine"),
        "engine_version": ("engine", [engine.version for engine in engines], "version of the engine"),
        "engine_kind": ("engine", [engine.kind for engine in engines], "impulse or compliant"),
        "check": ("check", [f"{collision} {name}" for collision, name in labels], "collision and check"),
        "collision": ("check", [collision for collision, _ in labels], "collision of the set"),
        "criterion": ("check", [name for _, name in labels], "name of the check"),
    }
    coords = {name: (dim, values, {"long_name": text}) for name, (dim, values, text) in coordinates.items()}
    arrays = {
        name: (
            ("engine", "check"),
            np.array([getattr(engine, name.removeprefix("check_")) for engine in engines], variable.dtype),
            schema.attributes_of(variable),
        )
        for name, variable in schema.BOARD.items()
    }
    attributes = {
        "title": f"What engines deliver at the collisions of {suite}",
        "schema_version": schema.SCHEMA_VERSION,
        "suite": suite,
        "impact_version": __version__,
        "packages": json.dumps({name: version(name) for name in schema.RECORDED_PACKAGES}),
    }
    return xr.Dataset(arrays, coords, attributes)


class Board(DisplayedDataset):
    """The checks of one engine or several.

    Parameters
    ----------
    dataset : with the dimensions engine and check, see docs/schema.md
    """

    @property
    def failed(self) -> int:
        """The number of checks that failed, of all engines."""
        return int((self.dataset["check_status"] == schema.CHECK_STATUSES["fail"]).sum())

    @property
    def passed(self) -> bool:
        """Whether no check failed."""
        return self.failed == 0

    @property
    def engines(self) -> list[dict[str, Any]]:
        """The facts, the checks and the counts of each engine."""
        engines = []
        for position in range(self.dataset.sizes["engine"]):
            engine = self.dataset.isel(engine=position)
            columns = [engine[name].values.tolist() for name in ("collision", "criterion", *NUMBERS)]
            statuses = [[*COUNTED][status] for status in engine["check_status"].values.tolist()]
            names = ("id", "check", *NUMBERS, "status")
            checks = [dict(zip(names, check, strict=True)) for check in zip(*columns, statuses, strict=True)]
            engines.append(
                {
                    "engine": str(engine["engine"].item()),
                    "version": str(engine["engine_version"].item()),
                    "set": str(engine.attrs["suite"]),
                    "kind": str(engine["engine_kind"].item()),
                    "checks": checks,
                    "summary": {word: statuses.count(status) for status, word in COUNTED.items()},
                }
            )
        return engines

    def as_dict(self) -> dict[str, Any]:
        """The JSON object of the command; of several engines, those of each under "engines"."""
        engines = self.engines
        return engines[0] if len(engines) == 1 else {"engines": engines}

    def records(self) -> Sequence[Mapping[str, Any]]:
        """A row for each check of each engine."""
        return [
            {"engine": engine["engine"], "version": engine["version"]} | check
            for engine in self.engines
            for check in engine["checks"]
        ]

    def sections(self, width: int) -> Iterator[Block]:
        """The counts of each engine by check, the worst collision of each check, and the checks that failed."""
        engines = self.engines
        if len(engines) > 1:
            yield Table(board_rows(engines), ("check", *(engine["engine"] for engine in engines)))
        for engine in engines:
            if len(engines) > 1:
                yield ""
            yield engine_headline(engine)
            yield ""
            yield Table(check_rows(engine), BOARD_HEADINGS, text=(0, 4))
            if lines := failure_lines(engine):
                yield ""
                yield from lines


NUMBERS = ("asked", "delivered", "tolerance")
# the words of a summary, by status
COUNTED = {"pass": "passed", "fail": "failed", "not_supported": "not_supported"}


def engine_headline(engine: Mapping[str, Any]) -> str:
    """Describe an engine and how many of its checks failed."""
    counts, total = engine["summary"], len(engine["checks"])
    name = f"{engine['engine']} {engine['version']}".strip()
    lacking = f", {counts['not_supported']} not supported" if counts["not_supported"] else ""
    failed = f"{counts['failed']} of {total} checks failed" if counts["failed"] else f"{total} checks, none failed"
    return f"{name} ({engine['kind']}), {engine['set']}: {failed}{lacking}"


def excess_of(name: str, asked: float, delivered: float) -> float:
    """How much a value misses what a check asks for; negative where it is on the right side, NaN for NaN.

    >>> excess_of("energy", 1.0, 0.5), excess_of("restitution", 0.9, 1.0) > 0.0
    (-0.5, True)
    """
    difference = delivered - asked
    return {"equal": abs(difference), "at most": difference, "at least": -difference}[CHECKS[name]]


def _checks_by_name(engine: Mapping[str, Any]) -> Iterator[tuple[str, list[Mapping[str, Any]]]]:
    """Yield the checks of each name that an engine has, in the order of a board."""
    for name in CHECKS:
        if checks := [check for check in engine["checks"] if check["check"] == name]:
            yield name, checks


def check_rows(engine: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Write a row for each check, with its worst collision, under BOARD_HEADINGS."""
    rows = []
    for name, checks in _checks_by_name(engine):
        counts = (str(sum(check["status"] == status for check in checks)) for status in COUNTED)
        judged, place = [check for check in checks if check["status"] != "not_supported"], ("–",) * 4
        if judged:
            # the one that misses by most; one that is not a number before all
            excess = [excess_of(name, check["asked"], check["delivered"]) for check in judged]
            worst = judged[int(np.argmax(excess))]
            place = (worst["id"], *(number(worst[key], 6 if key != "tolerance" else 2) for key in NUMBERS))
        rows.append((name, *counts, *place))
    return rows


def board_rows(engines: Sequence[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    """Write a row for each check, with the numbers of passed and of judged collisions of each engine."""

    def cell(checks: Sequence[Mapping[str, Any]]) -> str:
        statuses = [check["status"] for check in checks]
        judged = len(statuses) - statuses.count("not_supported")
        mark = " ✗" if "fail" in statuses else ""
        return f"{statuses.count('pass')}/{judged}{mark}" if judged else "–"

    facts = [(key, *(engine[key] or "–" for engine in engines)) for key in ("version", "kind")]
    by_engine = [dict(_checks_by_name(engine)) for engine in engines]
    return facts + [(name, *(cell(checks.get(name, ())) for checks in by_engine)) for name in by_engine[0]]


def failure_lines(engine: Mapping[str, Any]) -> list[str]:
    """Name the collisions at which each check failed."""
    lines = []
    for name, checks in _checks_by_name(engine):
        failed = [check["id"] for check in checks if check["status"] == "fail"]
        more = f" and {len(failed) - MAX_NAMED} more" if len(failed) > MAX_NAMED else ""
        if failed:
            lines.append(f"{name} failed at {', '.join(failed[:MAX_NAMED])}{more}")
    return lines
