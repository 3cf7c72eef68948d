"""Pictures of a sweep over one axis: velocities, restitution and its error, and the restitution of fixed steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from ..errors import UsageError
from ..formatting import argument, number, safe_text
from .curves import Curve, CurveData, Panel, curve_of, law_curves, x_axis_fields
from .kinds import Choice, Kind
from .labels import REFERENCE, LawPart, NamedLaw, split_by_law, with_model
from .slices import Line, choose_line, conditions_of, numeric_axes, read_line

FIGURE_6 = "Final velocities comparison"
# distances from zero that are shaded, the widest first
BANDS = (0.05, 0.01)
# the smallest |e_error| on a logarithmic axis: smaller ones are errors of the solver
MIN_DRAWN_ERROR = 1e-9
# the axes of a picture of fixed steps, and the message about a result without one
STEP_AXES = ("steps_per_contact", "dt")
NEEDS_STEPS = 'timestep needs an axis steps_per_contact or dt, with solver.integrator = "kick-drift"'
# values of e of a picture of fixed steps
MAX_RESTITUTIONS = 8


def velocity_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the post-impact velocities of every model and of the impulse-momentum solution, Figure 6."""
    line = read_line(dataset, choice, "v1_post", "v2_post", "v1_reference", "v2_reference")
    reference = NamedLaw(f"{REFERENCE} (6), (7)" if choice.equations else REFERENCE)
    ends = {"v1_post": "v₁⁺", "v2_post": "v₂⁺"}
    references = [
        curve_of(reference, line.coordinate, line.data[name.replace("post", "reference")], name, end)
        for name, end in ends.items()
    ]
    all_curves = (*_without_empty(references), *_law_curves(line, choice, ends))
    panel = Panel("", "Velocity after the impact", all_curves, y_unit="m/s", y_name="v_post")
    return complete(line, FIGURE_6, [panel], choice)


def restitution_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the delivered restitution of every model and the requested one; see `velocity_curves`."""
    line = read_line(dataset, choice, "e_out")
    curves = (*requested_curve(line.data, line.coordinate), *_law_curves(line, choice, {"e_out": ""}))
    panel = Panel("", "Delivered restitution", curves, y_name="e_out")
    return complete(line, "Delivered restitution", [panel], choice)


def error_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the error of every model's restitution, signed and absolute; see `velocity_curves`."""
    line = read_line(dataset, choice, "e_error")
    signed = _law_curves(line, choice, {"e_error": ""})
    if not _without_empty(signed):
        if requested_curve(line.data, line.coordinate):
            raise UsageError(f"no model has a restitution here; choose other values ({argument('sel')})")
        raise UsageError("this result has no error of the restitution, which needs a requested e; sweep e")
    panel = Panel("", "Error", tuple(signed), bands=BANDS, y_name="e_error")
    absolute = replace(
        panel,
        y_label="Absolute error",
        curves=tuple(replace(c, y=tuple(np.abs(c.y).tolist()), variable="abs_e_error") for c in signed),
        y_log=True,
        y_floor=MIN_DRAWN_ERROR,
        y_name="abs_e_error",
    )
    return complete(line, "Error of the restitution", [panel, absolute], choice)


def timestep_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Compute the mean, the least and the largest restitution over the phase, at fixed steps."""
    if "phase" not in dataset.coords:
        raise UsageError(f"this result is of the continuous law; {NEEDS_STEPS}")
    along = [name for name in STEP_AXES if name in dataset.coords and dataset[name].ndim == 1]
    if choice.x is None and not along:
        raise UsageError(f"this result has a single step; {NEEDS_STEPS}")
    line = read_line(dataset, replace(choice, x=choice.x or along[0]), "e_out", keep=("phase", "e"))
    cases = _split_by_restitution(line)
    curves = [
        replace(guide, case=name, is_guide=True)
        for name, case in cases
        for guide in requested_curve(case, line.coordinate)
    ]
    for index, law in enumerate(split_by_law(line.data, numbered=choice.equations)):
        by_case = [(name, _curve_over_phase(law, line, case["e_out"].isel(model=index))) for name, case in cases]
        first, *others = (np.array([row for _, row in curve.rows_of_values()]) for _, curve in by_case)
        # a law that does not depend on e has one curve
        if all(np.array_equal(first, other, equal_nan=True) for other in others):
            by_case = [("", by_case[0][1])]
        curves += [replace(curve, case=name) for name, curve in by_case]
    band_name = "Least to largest over the phase"
    panel = Panel("", "Delivered restitution", tuple(curves), y_name="e_out", band_name=band_name)
    title = f"Restitution at fixed steps, {safe_text(str(dataset.attrs.get('integrator', '')), 40)}"
    x_axis: dict[str, Any] = {"x_log": True} if line.x in STEP_AXES else {}
    return complete(line, title, [panel], choice, **x_axis)


def _law_curves(line: Line, choice: Choice, ends: Mapping[str, str]) -> list[Curve]:
    return law_curves(split_by_law(line.data, numbered=choice.equations), line.coordinate, ends)


def requested_curve(data: xr.Dataset, x: xr.DataArray) -> list[Curve]:
    """Make the curve of the requested restitution, where there is one."""
    e = [data["e"]] if "e" in data.coords else []
    return _without_empty([curve_of(NamedLaw("Requested"), x, values, "e") for values in e])


def _split_by_restitution(line: Line) -> list[tuple[str, xr.Dataset]]:
    """Split a line at fixed steps at each value of e that is neither along x nor along the phase; names each."""
    taken = {*line.data[line.x].dims, *line.data["phase"].dims}
    dim = next((dim for dim in (line.data["e"].dims if "e" in line.data.coords else ()) if dim not in taken), None)
    count = line.data.sizes[dim] if dim else 1
    if count > MAX_RESTITUTIONS:
        use = argument("sel", {"e": "VALUE"})
        raise UsageError(f"got {count} values of e, expected at most {MAX_RESTITUTIONS} to draw; use {use}")
    cases = [line.data.isel({dim: index}) for index in range(count)] if dim else [line.data]
    return [
        (f"e = {number(case['e'].item(), None)}" if "e" in case.coords and not case["e"].ndim else "", case)
        for case in cases
    ]


def _curve_over_phase(law: LawPart, line: Line, values: xr.DataArray) -> Curve:
    """Compute the mean over the phase, and a band from the least to the largest value of several phases."""
    (x_dim,) = line.data[line.x].dims
    by_phase = np.asarray(values.transpose(x_dim, ...).values, float).reshape(values.sizes[x_dim], -1)
    band = (by_phase.min(axis=1), by_phase.max(axis=1)) if by_phase.shape[1] > 1 else ()
    return curve_of(law, line.coordinate, by_phase.mean(axis=1), "e_out", band=band)


def _without_empty(curves: list[Curve]) -> list[Curve]:
    """Drop the curves without a finite value, such as a reference without a requested restitution."""
    return [curve for curve in curves if np.isfinite(curve.y).any()]


def complete(
    line: Line, title: str, panels: Sequence[Panel], choice: Choice, facts: Iterable[str] = (), **x_axis: Any
) -> CurveData:
    """Complete panels with the x axis of their line, or other fields, and add the title and the conditions."""
    heading = safe_text(str(line.data.attrs.get("title", "")), 140)
    conditions = ", ".join(filter(None, (*facts, conditions_of(line.data, line.x))))
    conditions = with_model(conditions, line.data, numbered=choice.equations)
    if heading and title != FIGURE_6:
        heading, conditions = title, ": ".join(filter(None, (heading, conditions)))
    x_axis = {**x_axis_fields(line.data, line.x), "joined": line.is_ordered, **x_axis}
    panels = [replace(panel, **x_axis).with_log_axes(choice.log) for panel in panels]
    empty = {c.law: None for panel in panels for c in panel.curves if c.law and not np.isfinite(c.y).any()}
    # unless it is said why
    silent = [key for key in empty if not any(text.startswith(f"{key}, ") for text in line.not_drawn)]
    without_value = tuple(f"{key}, which has no point here" for key in silent)
    return CurveData(heading or title, conditions, tuple(panels), (*line.not_drawn, *without_value))


def choose_steps(dataset: xr.Dataset, keys: Sequence[str]) -> Choice | None:
    """Choose to draw over the steps, at the first e if it has too many values; None without steps."""
    axes = numeric_axes(dataset)
    steps = next((name for name in STEP_AXES if name in axes), None)
    has_many = "e" in axes and axes["e"].size > MAX_RESTITUTIONS
    sel = {"e": float(axes["e"].values[0])} if has_many else {}
    return Choice(steps, sel=sel, models=keys) if steps else None


_over_line = partial(Kind, default=choose_line)
FINAL_VELOCITIES = _over_line("Velocities after the impact, and the impulse-momentum solution.", velocity_curves)
RESTITUTION = _over_line("Delivered over requested restitution.", restitution_curves)
ERROR = _over_line("Error of the restitution: signed above, absolute below.", error_curves)
TIMESTEP = Kind(
    "Restitution at fixed steps: mean, least and largest over the phase.",
    timestep_curves,
    choose_steps,
    along=(*STEP_AXES, "phase", "e"),
)
