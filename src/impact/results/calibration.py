"""The dataset of a calibration, and what it says: parameters of laws, how well they fit, and the measurements."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import xarray as xr

from ..array_types import Array
from ..config.files import toml_document
from ..config.input_names import InputName
from ..config.load import Config
from ..config.quantities import KeyPath
from ..config.tables import DEFAULT_TITLE, Solver
from ..contact.models import original_key
from ..contact.units import names_in, with_numbers
from ..contact.variables import OUTPUTS
from ..display import Block, DisplayedDataset, Table
from ..engine.plan import Plan
from ..engine.plugins import Plugins
from ..engine.trajectories import PlanLaw, keys_of, model_of
from ..errors import UsageError, did_you_mean
from ..formatting import decimals, law_keys, law_name, number, safe_text
from . import schema

# probability of chi2 below which a law is called rejected
REJECTED_P = 1e-3
# probability below which the mean deviation of the specimens is not called chance
OFFSET_P = 1e-2
# residuals that are named
NAMED_RESIDUALS = 3
# numbers of a law in JSON
CRITERIA = ("chi2_reduced", "p_value", "excess", "aicc", "weight", "loo")
FIT_HEADINGS = ("law", "parameter", "estimate", "95 %", "chi2/dof", "p", "AICc", "weight", "loo", "status")


def fit_status(law: xr.Dataset) -> str:
    """Read the outcome of the fit of one law, one of FIT_STATUSES."""
    return str(law["fit_status"].attrs["flag_meanings"]).split()[int(law["fit_status"])]


def fitted_laws(dataset: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield the laws as plain data, the best first, with their parameters by path in the config."""
    paths = json.loads(dataset.attrs["fit_paths"])
    for rank, key in enumerate(map(str, dataset["model"].values), 1):
        law = dataset.sel(model=key)
        parameters = {}
        for position, path in enumerate(paths):
            parameter = law.isel(parameter=position)
            if int(parameter["identifiable"]) >= 0:
                numbers = {name: float(parameter[name]) for name in ("estimate", "lower", "upper")}
                parameters[path] = {**numbers, "identifiable": bool(parameter["identifiable"])}
        yield {
            "model": key,
            "rank": rank,
            "status": fit_status(law),
            "parameters": parameters,
            "determined": [group for group in str(law["determined"].item()).split("; ") if group],
            **{name: float(law.get(name, math.nan)) for name in CRITERIA},
        }


def fit_rows(dataset: xr.Dataset) -> list[tuple[str, ...]]:
    """Write a row for each parameter of each law with its unit, the best law first, under FIT_HEADINGS."""
    rows: list[tuple[str, ...]] = []
    # an n that is fitted or measured has no number in units
    has_n = {"n", "exponent"} <= dataset.coords.keys() and dataset["n"].ndim == 0
    for law in fitted_laws(dataset):
        quality = (
            number(law["chi2_reduced"], 3),
            number(law["p_value"], 2),
            decimals(law["aicc"], 1),
            decimals(law["weight"], 3),
            number(law["loo"], 3),
            law["status"],
        )
        n = {"n": float(dataset["exponent"].sel(model=law["model"]))} if has_n else {}
        parameters = [
            (_name_with_unit(law["model"], path, n), *_estimate_texts(**numbers))
            for path, numbers in law["parameters"].items()
        ]
        first, *others = parameters or [("",) * 3]
        rows.append((law["model"], *first, *quality))
        rows += [("", *parameter, *("",) * len(quality)) for parameter in others]
    return rows


def fit_table(dataset: xr.Dataset) -> tuple[list[str], list[list[str]]]:
    """Write the headings and rows of the table of a calibration; without p where no law has a p-value."""
    rows, p = fit_rows(dataset), FIT_HEADINGS.index("p")
    # only the noise "given" has a p-value, which a file of version 1.0.0 lacks
    shown = [i for i in range(len(FIT_HEADINGS)) if i != p or {row[p] for row in rows} - {"", "–"}]
    return [FIT_HEADINGS[i] for i in shown], [[row[i] for i in shown] for row in rows]


def _own_name(law: str, path: str) -> str:
    """Write the path of a parameter, its name alone in [sweep] and in the table of a law of its own."""
    tables = ("sweep.", *map("{}.{}.".format, ("model", "friction"), law_keys(law)))
    return path.rpartition(".")[2] if path.startswith(tables) else path


def _name_with_unit(law: str, path: str, exponents: Mapping[str, float]) -> str:
    """Write the name of a parameter with its unit, such as "A [s]"."""
    unit = InputName.parse(path.removeprefix("sweep.")).unit
    unit = with_numbers(unit, exponents) if names_in(unit) <= exponents.keys() else unit
    return _own_name(law, path) + (f" [{unit}]" if unit != "1" else "")


def _estimate_texts(estimate: float, lower: float, upper: float, identifiable: bool) -> tuple[str, str]:
    """Write an estimate and its interval; of a value that others replace, the further digits are arbitrary."""
    if not identifiable:
        return number(estimate, 3), "not identified"
    return number(estimate, 5), "–" if lower != lower else f"{number(lower, 5)} to {number(upper, 5)}"


def unidentified_notes(dataset: xr.Dataset) -> list[str]:
    """List for each law the parameters that the data do not determine."""
    notes = []
    for law in fitted_laws(dataset):
        parameters = law["parameters"].items()
        names = [_own_name(law["model"], path) for path, numbers in parameters if not numbers["identifiable"]]
        if names:
            groups = "; ".join(law["determined"])
            only = f"only {groups} is determined" if groups else "the data do not determine them"
            notes.append(f"{law['model']}: {', '.join(names)}: {only}")
    return notes


def fit_notes(dataset: xr.Dataset) -> list[str]:
    """List what a reader has to know besides the table, one line for each note."""
    best = dataset.isel(model=0)
    notes = [*_noise_notes(dataset)]
    is_linear = dataset.attrs.get("loss", "linear") == "linear"
    if is_linear and float(best.get("p_value", math.nan)) < REJECTED_P:
        notes.append(
            f"the best law is rejected (p < {REJECTED_P:g}): try other laws, "
            'noise = "excess" with a column specimen where specimens differ, or loss = "huber" against outliers'
        )
    if residuals := largest_residuals(dataset):
        parts = [f"{residual['place']} ({decimals(residual['standardized'], 1)})" for residual in residuals]
        notes.append(
            f"largest residuals of {best['model'].item()}, each in the fit without the point and in its standard "
            f"deviations: {', '.join(parts)}"
        )
    return notes + unidentified_notes(dataset)


def _noise_notes(dataset: xr.Dataset) -> Iterator[str]:
    """Explain the noise "excess" without specimens, or with specimens that the best law does not describe."""
    if dataset.attrs["noise"] != "excess":
        return
    if "specimen" in dataset.coords:
        from scipy.special import stdtrit

        best = dataset.isel(model=0)
        values = best[["residual"]].assign(variance=best["sigma"] ** 2).groupby("specimen")
        means, counts = values.mean(), values.count()
        offsets, freedom = means["residual"].values, means.sizes["specimen"] - 1
        # with two specimens one side is no evidence
        if freedom < 2:
            return
        mean = float(offsets.mean())
        # by chance specimens may agree better than their measurements
        variance = max(float(offsets.var(ddof=1)), float((means["variance"] / counts["variance"]).mean()))
        if abs(mean) > stdtrit(freedom, 1.0 - OFFSET_P / 2.0) * math.sqrt(variance / offsets.size):
            yield (
                f"the specimens deviate from {best['model'].item()} to one side, by {number(mean, 2)} on average: "
                "the law fits how their values change, not the values; try other laws"
            )
        return
    yield "without a column specimen, each measured value has an excess deviation of its own"
    inputs = [
        np.asarray(coordinate.values)
        for name, coordinate in dataset.coords.items()
        if coordinate.dims == ("point",) and name not in schema.STUDY_COORDINATES["calibration"]
    ]
    rows = list(zip(*inputs, strict=True)) or [()] * dataset.sizes["point"]
    repeated = sum(rows.count(row) > 1 for row in rows)
    if repeated:
        yield (
            f"{repeated} of {len(rows)} points repeat the inputs of another: name their specimens in a column "
            "specimen if they share a deviation, as the intervals are too short otherwise"
        )


def largest_residuals(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Find the largest residuals of the best law, the largest first, with the places of the measured values.

    Each is that in the fit without the value, in standard deviations of its own.
    """
    if "loo_residual" not in dataset:
        return []
    best = dataset.isel(model=0)
    residuals = np.nan_to_num(np.asarray(best["loo_residual"].values, float))
    largest = np.argsort(-np.abs(residuals), kind="stable")[:NAMED_RESIDUALS]
    file = safe_text(str(dataset.attrs["data_file"]))
    has_several_outputs = len({*map(str, best["output"].values)}) > 1
    found = []
    for point in (best.isel(point=index) for index in largest.tolist()):
        line, output = int(point["line"]), str(point["output"].item())
        place = (f"{file}:{line}" if file else f"value {line}") + (f" {output}" if has_several_outputs else "")
        if np.isfinite(point["loo_residual"]):
            numbers = {"measured": float(point["measured"]), "standardized": float(point["loo_residual"])}
            found.append({"place": place, "output": output, **numbers})
    return found


def calibration_title(dataset: xr.Dataset) -> str:
    """Read the title of the config; "" for its default, which is that of a sweep."""
    title = str(dataset.attrs.get("title", ""))
    return "" if title == DEFAULT_TITLE else title


def describe_data(dataset: xr.Dataset) -> str:
    """Describe the data to which the laws were fitted, in a sentence without a full stop."""
    laws, points = dataset.sizes["model"], dataset.sizes["point"]
    plural = "" if laws == 1 else "s"
    return f"{laws} law{plural}, {points} measured values, noise {dataset.attrs['noise']}; the best law first"


class Fits(DisplayedDataset):
    """The fits of a calibration, the best law first."""

    def as_dict(self) -> dict[str, Any]:
        """The laws with their parameters by config path, and the largest residuals."""
        return {"models": list(fitted_laws(self.dataset)), "largest_residuals": largest_residuals(self.dataset)}

    def records(self) -> Sequence[Mapping[str, Any]]:
        """A row for each parameter of each law."""
        return [
            {"model": law["model"], "parameter": path, **numbers, "status": law["status"]}
            | {name: law[name] for name in CRITERIA}
            for law in fitted_laws(self.dataset)
            for path, numbers in law["parameters"].items()
        ]

    def sections(self, width: int) -> Iterator[Block]:
        """A row for each law and parameter, and what to know besides."""
        yield describe_data(self.dataset)
        yield ""
        headings, rows = fit_table(self.dataset)
        yield Table(rows, headings, text=(0, 1, -1))
        yield from fit_notes(self.dataset)


def calibration_template(
    config: Config, laws: Sequence[PlanLaw], plugins: Plugins, varied: tuple[str, Array]
) -> xr.Dataset:
    """Build the dataset of a calibration of some laws with placeholders for its results.

    `varied` is the input of the curves and its values; "" for none.
    """
    data = config.data
    assert data is not None
    models = tuple(map(model_of, laws))
    distinct = {model.key: model for model in models}
    plan = Plan(replace(config, models=tuple(distinct.values())), plugins)
    # with friction laws, a position along `model` is a pair
    of_laws = Plan(replace(config, models=models, frictions=()), plugins)
    coordinates: dict[str, object] = {
        str(name): coordinate
        for name, coordinate in schema.plan_coordinates(of_laws).variables.items()
        # with a speed, v1 follows from the angle, which may be measured
        if name not in config.fits and name not in data.inputs and not (name == "v1" and "speed" in config.scalars)
    }

    def add(name: str, dim: str, values: Any, meaning: str) -> None:
        coordinates[name] = (dim, values, {"long_name": meaning})

    if config.frictions:
        add("model", "model", [law.key for law in laws], "contact force model and friction law")
        add("friction", "model", [keys_of(law)[1] for law in laws], "friction law")
    parameters, outputs, rows = list(config.fits), list(data.outputs), len(data.lines)
    sigmas = [data.sigma.get(name, np.full(rows, np.nan)) for name in outputs]
    add("parameter", "parameter", parameters, "fitted parameter, by its config name")
    add("other_parameter", "other_parameter", parameters, "fitted parameter, by its config name")
    add("point", "point", np.arange(1, rows * len(outputs) + 1), "number of the measured value")
    add("line", "point", np.tile(data.lines, len(outputs)), "line of the file")
    add("output", "point", np.repeat(outputs, rows), "measured output")
    add("measured", "point", np.concatenate([*data.outputs.values()]), "measured value")
    add("sigma", "point", np.concatenate(sigmas), "standard deviation of the measured value")
    if data.specimens:
        add("specimen", "point", list(data.specimens), "specimen of the measured value")
    for name, column in data.inputs.items():
        coordinates[name] = ("point", np.tile(column, len(outputs)), schema.coordinate_attributes(plan, name))
    name, grid = varied
    if name:
        coordinates["grid"] = ("grid", grid, schema.coordinate_attributes(plan, name))
        units = " ".join(schema.udunits(OUTPUTS[output].unit) for output in outputs)
        coordinates["output_name"] = ("output_name", outputs, {"long_name": "measured output", "units": units})
    attributes = schema.provenance_attributes(plan) | {
        "noise": data.noise,
        "loss": data.loss,
        "data_file": data.file,
        "varied": name,
        "fit_paths": json.dumps([InputName.parse(name).config_key for name in parameters]),
        "fit_bounds": json.dumps({name: list(ends) for name, ends in config.fits.items()}),
    }
    coords = xr.Coordinates(coordinates)
    return xr.Dataset(schema.template(schema.CALIBRATION.values(), coords.sizes, ()), coords, attributes)


def position_of_law(laws: Sequence[str], wanted: str, origin: str) -> int:
    """Find the first of some laws, each MODEL or MODEL with FRICTION, that is the wanted one, by whatever name.

    >>> position_of_law(["hertz", "tsuji-1992 with coulomb-1785"], "liggghts-hertz", "--model")
    1
    """
    model, *friction = law_keys(wanted)
    for position, law in enumerate(laws):
        key, *other = law_keys(law)
        if original_key(key) == original_key(model) and friction in ([], other):
            return position
    raise UsageError(f'{origin}: no fit of "{wanted}"; {did_you_mean(wanted, list(laws))}')


def fitted_config(config: Config, law: xr.Dataset) -> str:
    """Write a config of its own in SI units with one fitted law; inputs that vary in the data are axes."""
    assert config.data is not None
    keys = law_keys(str(law["model"].item()))
    fitted = law.isel(parameter=law["identifiable"].values >= 0)
    estimates = dict(zip(map(str, fitted["parameter"].values), fitted["estimate"].values.tolist(), strict=True))
    if any(value != value for value in estimates.values()):
        raise UsageError(f"{law_name(*keys)}: the fit has no estimate, its status is {fit_status(law)}")
    columns = {name: sorted(set(column)) for name, column in config.data.inputs.items()}
    laws = {name: [key] for name, key in zip(("models", "frictions"), keys, strict=False)}
    tables: dict[KeyPath, dict[str, object]] = {(): {**laws, "title": config.title}, ("sweep",): {}}
    solver = dict(sorted(asdict(config.solver).items() - asdict(Solver()).items()))
    if solver:
        tables["solver",] = solver
    for name, material in config.materials.items():
        known = {field: value for field, value in asdict(material).items() if value is not None and value == value}
        tables["materials", name] = known
    values = {**config.scalars, **columns, **estimates}
    for name, value in values.items():
        parsed = InputName.parse(name)
        if not parsed.applies_to(*keys) or (name in config.fits and name not in estimates):
            continue
        if name == "u2" and "speed" in values:
            # it follows from the speed
            continue
        value = parsed.word(value) if isinstance(value, float) else value
        if isinstance(value, list) and len(value) == 1:
            (value,) = value
        tables.setdefault(parsed.path[:-1], {})[parsed.key] = value
    return toml_document(tables)
