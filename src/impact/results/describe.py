"""What a calibration, a sensitivity study, a board or a law says: its text, its tables and its plain data."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from ..contact.friction import FrictionLaw
from ..contact.model import ForceModel
from ..display import Block, Displayed, Table
from ..engine.law_catalogue import FrictionDescription, ModelDescription
from ..errors import UsageError
from . import calibration, sensitivity
from .attributes import read_attribute
from .board import Board
from .kinds import kind_of
from .replay_command import describe_point
from .xarray_backend import result_of

# numbers of a law in JSON
CRITERIA = ("chi2_reduced", "p_value", "excess", "aicc", "weight", "loo")
# numbers of an uncertain input in JSON
INDICES = ("first", "first_lower", "first_upper", "total", "total_lower", "total_upper", *sensitivity.HALF)


@dataclass(frozen=True)
class Fits(Displayed):
    """The fits of a calibration, the best law first."""

    dataset: xr.Dataset

    def as_dict(self) -> dict[str, Any]:
        """The laws with their parameters by config path, and the largest residuals."""
        residuals = [asdict(residual) for residual in calibration.largest_residuals(self.dataset)]
        return {"models": list(self._models()), "largest_residuals": residuals}

    def _models(self) -> Iterator[dict[str, Any]]:
        paths = json.loads(self.dataset.attrs["fit_paths"])
        for rank, key in enumerate(map(str, self.dataset["model"].values), 1):
            law = self.dataset.sel(model=key)
            parameters = {}
            for position, path in enumerate(paths):
                parameter = law.isel(parameter=position)
                if int(parameter["identifiable"]) >= 0:
                    numbers = {name: float(parameter[name]) for name in ("estimate", "lower", "upper")}
                    parameters[path] = {**numbers, "identifiable": bool(parameter["identifiable"])}
            yield {
                "model": key,
                "rank": rank,
                "status": calibration.fit_status(law),
                "parameters": parameters,
                "determined": [group for group in str(law["determined"].item()).split("; ") if group],
                **{name: float(law.get(name, math.nan)) for name in CRITERIA},
            }

    def records(self) -> Sequence[Mapping[str, Any]]:
        """A row for each parameter of each law."""
        return [
            {"model": law["model"], "parameter": path, **numbers, "status": law["status"]}
            | {name: law[name] for name in CRITERIA}
            for law in self._models()
            for path, numbers in law["parameters"].items()
        ]

    def sections(self, width: int) -> Iterator[Block]:
        """A row for each law and parameter, and what to know besides."""
        yield calibration.describe_data(self.dataset)
        yield ""
        yield Table(calibration.fit_rows(self.dataset), calibration.FIT_HEADINGS, text=(0, 1, -1))
        yield from calibration.fit_notes(self.dataset)


@dataclass(frozen=True)
class Studies(Displayed):
    """The sensitivity of an output: a study for each model and each point of the other axes."""

    dataset: xr.Dataset

    def as_dict(self) -> dict[str, Any]:
        """The studies with the distribution of the output and the indices of each uncertain input."""
        return {"studies": list(self._studies())}

    def _studies(self) -> Iterator[dict[str, Any]]:
        design = read_attribute(self.dataset.attrs, "design")
        for point, study in sensitivity.iterate_studies(self.dataset):
            probabilities = [f"{probability:g}" for probability in study["quantile"].values]
            rows = (study.isel(input=position) for position in range(study.sizes["input"]))
            yield {
                **{dim: point.pop(dim) for dim in ("model", "friction") if dim in point},
                "at": point,
                "of": self.dataset.attrs["of"],
                **{name: design[name] for name in ("n", "method", "seed")},
                "failed": int(study["failed"]),
                "mean": float(study["mean"]),
                "sd": float(study["sd"]),
                "quantiles": dict(zip(probabilities, map(float, study["quantiles"].values), strict=True)),
                "indices": [
                    {"input": str(row["input"].item())} | {name: float(row[name]) for name in INDICES}
                    for row in rows
                ],
            }

    def records(self) -> Sequence[Mapping[str, Any]]:
        """A row for each uncertain input of each study."""
        return [
            {dim: study[dim] for dim in ("model", "friction") if dim in study}
            | {**study["at"], "of": study["of"], **indices}
            for study in self._studies()
            for indices in study["indices"]
        ]

    def sections(self, width: int) -> Iterator[Block]:
        """The design, and the distribution and a table of indices of each study."""
        yield sensitivity.describe_design(self.dataset)
        for point, study in sensitivity.iterate_studies(self.dataset):
            yield ""
            yield describe_point(point)
            yield sensitivity.describe_study(study)
            if study["total"].notnull().any():
                yield Table(sensitivity.index_rows(study), sensitivity.INDEX_HEADINGS)


def describe(
    item: xr.Dataset | str | Path | ForceModel | FrictionLaw,
) -> Fits | Studies | Board | ModelDescription | FrictionDescription:
    """Describe a calibration, a sensitivity study, a board or a law, as its command prints it and a notebook does.

    Returns
    -------
    Fits, Studies, Board, ModelDescription or FrictionDescription : with `records`, `as_dict` and `to_dataframe`

    Raises
    ------
    UsageError : the dataset is another result

    >>> import impact
    >>> study = impact.sensitivity({
    ...     "models": "hertz",
    ...     "sweep": {"v1": {"uniform": [0.8, 1.2]}, "m1": 1.0, "m2": 1.0, "K": {"uniform": [5e5, 1.5e6]}},
    ...     "design": {"n": 1024},
    ... }, of="peak_force")
    >>> impact.describe(study).to_dataframe()[["input", "first", "total"]].round(2).values.tolist()
    [['sweep.v1', 0.56, 0.57], ['sweep.K', 0.43, 0.44]]
    """
    if isinstance(item, ForceModel):
        return ModelDescription(item)
    if isinstance(item, FrictionLaw):
        return FrictionDescription(item)
    result = result_of(item)
    match kind_of(result):
        case "calibration":
            return Fits(result)
        case "sensitivity study":
            return Studies(result)
        case "board":
            return Board(result)
    raise UsageError("expected the result of a calibration, of a sensitivity study, or a board")
