"""The dataset of a sensitivity study, and what it says: indices of inputs, and the distribution of an output."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ..config.input_names import InputName
from ..contact.units import names_in, with_numbers
from ..contact.variables import LAW_DIMS, OUTPUTS
from ..display import Block, DisplayedDataset, Table
from ..formatting import NO_BREAK, decimals, number, quantity, safe_text, scaled_unit
from .attributes import read_attribute
from .provenance import describe_point
from .schema import parts_of_laws

# probabilities of the quantiles
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
# with fewer samples the intervals are too short: at 16 independent ones 87 % of them hold the index
MIN_SAMPLES = 64
# indices from the first half of the samples
HALF = ("first_half", "total_half")
# numbers of an uncertain input in JSON
INDICES = ("first", "first_lower", "first_upper", "total", "total_lower", "total_upper", *HALF)


def distribution_texts(dataset: xr.Dataset) -> Iterator[str]:
    """Write the uncertain inputs of a result with their distributions, each in one line without a break."""
    for name, distribution in read_attribute(dataset.attrs, "design").get("distributions", {}).items():
        ((kind, numbers),) = distribution.items()
        parsed = InputName.parse(name)
        # a parameter of a law may have its own n, and other names in the exponents of its unit
        unit = "1" if parsed.model and names_in(parsed.unit) else parsed.unit
        if "n" in dataset.coords and dataset["n"].ndim == 0 and not parsed.owner:
            unit = with_numbers(unit, {"n": float(dataset["n"])})
        # degrees for rad, but a geometric standard deviation has no unit; no prefix for others
        size, unit = scaled_unit(unit, 1.0)
        sizes = (size, 1.0 if kind == "lognormal" else size, size)
        shown = ", ".join(number(value / of) for value, of in zip(numbers, sizes, strict=False))
        shown += ", …" if len(numbers) > len(sizes) else ""
        text = f"{name} = {kind}({shown}){'' if unit == '1' else unit if unit == '°' else f' {unit}'}"
        yield safe_text(text, 80).replace(" ", NO_BREAK)


def describe_design(dataset: xr.Dataset) -> str:
    """Describe how the samples of a result were drawn, in a sentence without a full stop; "" without samples."""
    design = read_attribute(dataset.attrs, "design")
    if not design:
        return ""
    drawn = f"{design['n']:,} samples ({design['method']}, seed {design['seed']})"
    return f"{drawn} of {', '.join(distribution_texts(dataset))}"


def _iterate_studies(dataset: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield each study as plain data: of each law at each point, once along parameters of other laws."""
    dims, design = list(map(str, dataset["mean"].dims)), read_attribute(dataset.attrs, "design")
    for _, law in parts_of_laws(dataset, dims, first=0):
        axes = [dim for dim in dims if dim in law.dims]
        for index in np.ndindex(*(law.sizes[dim] for dim in axes)):
            study = law.isel(dict(zip(axes, index, strict=True)))
            point = {dim: study[dim].item() for dim in dims if dim in LAW_DIMS or dim in axes}
            probabilities = [f"{probability:g}" for probability in np.ravel(study["quantile"])]
            columns = (study[name].values.tolist() for name in ("input", *INDICES))
            yield {
                **{dim: point.pop(dim) for dim in LAW_DIMS if dim in point},
                "at": point,
                "of": dataset.attrs["of"],
                **{name: design[name] for name in ("n", "method", "seed")},
                "failed": int(study["failed"]),
                "mean": float(study["mean"]),
                "sd": float(study["sd"]),
                "quantiles": dict(zip(probabilities, np.ravel(study["quantiles"]).tolist(), strict=True)),
                "indices": [
                    dict(zip(("input", *INDICES), row, strict=True)) for row in zip(*columns, strict=True)
                ],
            }


INDEX_HEADINGS = ("input", "first-order", "95 %", "total", "95 %", "first-order, n/2", "total, n/2")


def _index_rows(study: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Write a row for each input that matters, the largest total index first, under INDEX_HEADINGS."""

    def index(row: Mapping[str, float], name: str) -> tuple[str, str]:
        lower, upper = (row[f"{name}_{end}"] for end in ("lower", "upper"))
        return decimals(row[name]), "–" if lower != lower else f"{decimals(lower)} to {decimals(upper)}"

    return [
        (row["input"], *index(row, "first"), *index(row, "total"), *(decimals(row[name]) for name in HALF))
        for row in sorted(study["indices"], key=lambda row: -np.nan_to_num(row["total"]))
        # NaN without a result
        if abs(row["total"]) > 0.0
    ]


def _describe_study(study: Mapping[str, Any]) -> str:
    """Describe the distribution of the output of one study, in a sentence without a full stop."""
    of, mean, failed = study["of"], study["mean"], study["failed"]
    if failed:
        return f"{of}: {failed:,} points have no result, so there are no indices; narrow the distributions"
    if math.isnan(mean):
        # a study has no status of its points
        or_pair = ", or the friction law is not combinable with the model" if OUTPUTS[of].of_friction else ""
        return f"{of}: the law has none{or_pair}"
    # degrees for rad; no prefix for others
    size, unit = scaled_unit(OUTPUTS[of].unit, 1.0)
    mean_text, totals = quantity(mean / size, unit), {row["input"]: row["total"] for row in study["indices"]}
    if not any(map(math.isfinite, totals.values())):
        return f"{of}: {mean_text}; it does not depend on the uncertain inputs"
    text = f"{of}: mean {mean_text}, sd {number(study['sd'] / size, 3)}"
    for probability in (0.05, 0.5, 0.95):
        # a part of a study may lack some
        if f"{probability:g}" in study["quantiles"]:
            text += f", {100 * probability:g} % {number(study['quantiles'][f'{probability:g}'] / size)}"
    irrelevant = [name for name, total in totals.items() if total == 0.0]
    if irrelevant:
        text += f"; it does not depend on {', '.join(irrelevant)}"
    if study["n"] < MIN_SAMPLES:
        text += f"; the intervals need at least {MIN_SAMPLES} samples"
    return text


def study_texts(dataset: xr.Dataset) -> Iterator[tuple[str, str, list[tuple[str, ...]]]]:
    """Yield the point of each study, the distribution of the output, and the rows under INDEX_HEADINGS."""
    for study in _iterate_studies(dataset):
        laws = {dim: study[dim] for dim in LAW_DIMS if dim in study}
        yield describe_point(laws | study["at"]), _describe_study(study), _index_rows(study)


class Studies(DisplayedDataset):
    """The sensitivity of an output: a study for each model and each point of the other axes."""

    def as_dict(self) -> dict[str, Any]:
        """The studies with the distribution of the output and the indices of each uncertain input."""
        return {"studies": list(_iterate_studies(self.dataset))}

    def records(self) -> Sequence[Mapping[str, Any]]:
        """A row for each uncertain input of each study."""
        return [
            {dim: study[dim] for dim in LAW_DIMS if dim in study} | {**study["at"], "of": study["of"], **indices}
            for study in _iterate_studies(self.dataset)
            for indices in study["indices"]
        ]

    def sections(self, width: int) -> Iterator[Block]:
        """The design, and the distribution and a table of indices of each study."""
        yield describe_design(self.dataset)
        for point, sentence, rows in study_texts(self.dataset):
            yield from ("", point, sentence)
            if rows:
                yield Table(rows, INDEX_HEADINGS)
