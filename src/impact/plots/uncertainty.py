"""The picture of uncertain inputs: the median and a band of an output over an axis, or its distribution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from ..config.grid import SAMPLE
from ..contact.variables import OUTPUTS
from ..errors import UsageError
from ..formatting import argument, safe_text
from ..results.selection import select
from ..results.sensitivity import distribution_texts
from .curves import Curve, CurveData, Panel, curve_of, x_axis_fields
from .kinds import Choice, Kind
from .labels import split_by_law, with_model, words_of
from .restitution import read_line, requested_curve
from .slices import conditions_of, numeric_axes

# ends of the band, and points of a distribution function that are drawn
BAND, MAX_DRAWN_PROBABILITIES = (0.05, 0.95), 401


def uncertainty_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Compute an output's median and band over an axis, or, without one, its distribution function."""
    if SAMPLE not in dataset.dims:
        raise UsageError("this result has no samples; sweep a config with distributions and a table [design]")
    name = choice.variable or "e_out"
    if name not in dataset.data_vars:
        raise UsageError(f'no variable "{name}" in this result')
    x = choice.x or _free_axis(select(dataset, choice.sel or {}))
    if x in dataset.coords and dataset[x].dims == (SAMPLE,):
        raise UsageError(f"{argument('x', x)}: is an uncertain input, expected another axis")
    keep = (SAMPLE, "friction") if "friction" in dataset[name].dims else (SAMPLE,)
    line, x_name, not_drawn, is_ordered = read_line(dataset, replace(choice, x=x or SAMPLE), name, keep=keep)
    meaning = "Delivered restitution" if name == "e_out" else words_of(line[name].attrs, name).capitalize()
    curves: list[Curve] = []
    for law in split_by_law(line, numbered=choice.equations):
        samples = np.asarray(law.data[name].transpose(..., SAMPLE).values, float)
        if x is None:
            # the distribution function
            count = min(samples.size, MAX_DRAWN_PROBABILITIES)
            share = (np.arange(count) + 0.5) / count
            quantiles = np.quantile(samples, share, method="hazen")
            curves.append(curve_of(law, quantiles, share, name))
        else:
            # NaN where a sample has no result
            least, median, largest = np.quantile(samples, (BAND[0], 0.5, BAND[1]), axis=-1)
            curves.append(curve_of(law, law.data[x], median, name, band=(least, largest)))
        failed = int(np.isnan(samples).sum())
        not_drawn += (f"{law.law}, where {failed:,} samples have no result",) if failed else ()
    if not any(np.isfinite([curve.x, curve.y]).all(axis=0).any() for curve in curves):
        raise UsageError(f"nothing to draw: {'; '.join(not_drawn)}")
    if x is None:
        unit = OUTPUTS[name].unit
        panel = Panel(meaning, "Share of samples below", tuple(curves), unit, x_name=name, y_name="share")
    else:
        # the requested restitution, unless it depends on the sample
        has_e = name == "e_out" and "e" in line.coords and SAMPLE not in line["e"].dims
        requested = requested_curve(line, line[x]) if has_e and np.isfinite(line["e"].values).all() else []
        panel = Panel(
            y_label=meaning,
            curves=(*requested, *curves),
            y_unit=OUTPUTS[name].unit,
            y_name=name,
            band_name="5 to 95 % of the samples",
            joined=is_ordered,
            **x_axis_fields(line[x]),
        )
    title = safe_text(str(dataset.attrs.get("title", "")), 140)
    conditions = ", ".join(filter(None, (*distribution_texts(dataset), conditions_of(line, x_name))))
    conditions = with_model(conditions, line, numbered=choice.equations)
    return CurveData(
        f"Uncertain inputs: {meaning[0].lower()}{meaning[1:]}",
        ": ".join(filter(None, (title, conditions))),
        (panel.with_log_axes(choice.log),),
        not_drawn,
    )


def _free_axis(dataset: xr.Dataset) -> str | None:
    """Find e, else the first axis of several numbers, which an uncertain input is not."""
    free = [name for name, values in numeric_axes(dataset).items() if values.dims != (SAMPLE,)]
    return "e" if "e" in free else next(iter(free), None)


def choose_axis(dataset: xr.Dataset, keys: Sequence[str]) -> Choice:
    """Choose to draw over an axis."""
    return Choice(_free_axis(dataset), models=keys)


UNCERTAINTY = Kind(
    "Delivered restitution: median, and 5 to 95 % of the samples of uncertain inputs.",
    uncertainty_curves,
    choose_axis,
    along=("x", SAMPLE),
    source="samples",
)
