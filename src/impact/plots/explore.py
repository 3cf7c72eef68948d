"""Controls in a notebook that draw a result: the kind of picture, the laws, and a slider for each axis."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ..config.files import to_plain_value
from ..config.grid import SAMPLE, Axis
from ..config.input_names import InputName
from ..config.load import Config
from ..contact.model import ForceModel
from ..engine.plan import Plan
from ..engine.plugins import Plugins, read_plugins
from ..errors import ImpactError, UsageError, require_known
from ..formatting import prefixed, safe_text
from ..results.provenance import changed_plugins, config_of_part, stored_config
from ..results.schema import kind_of, numbered_unit, require_axes
from ..results.selection import chosen_laws, in_si, select, select_laws
from ..results.sweep import sweep_in_memory
from ..results.xarray_backend import result_of
from .draw import plot
from .kinds import STUDIES, default_kind, find_kind, kinds_of, source_of
from .slices import choose_line
from .style import DRAWING, is_geometric

if TYPE_CHECKING:
    from ipywidgets import VBox

# of a picture whose texts are legible at half of its size, on a phone; also the largest width on a page
WIDTH_INCHES, DPI = 4.5, 160
# a change is drawn after this time without another one
DELAY_S = 0.1
COMPUTING = "<b>computing …</b>"
# of the label beside a control; the rest of a longer one appears under the mouse
MAX_LABEL_LETTERS = 11
# points that are integrated again at values that are not on the grid, in some seconds
MAX_POINTS_AGAIN = 100_000


def explore(
    dataset: xr.Dataset | str | Path,
    *,
    kind: str | None = None,
    sel: Mapping[str, object] | None = None,
    models: Sequence[str] | None = None,
    plugins: Sequence[ForceModel | str | Path] = (),
) -> VBox:
    """Show a result with controls in a notebook: the kind of picture, the models, and a slider for each axis.

    A slider takes any number between the values of its axis, also typed into the field beside it; at a number that
    is not on the grid the laws are integrated again. An axis whose inputs vary together keeps to its values.

    Parameters
    ----------
    dataset : a result, or its file
    kind : the first kind of picture, see `plot`
    sel : the first values of axes, such as `{"m2": 1.0}`; those of others are the first of the grid
    models : keys of the models that are selected first; by default all
    plugins : see `plot`

    Returns
    -------
    ipywidgets.VBox : a notebook shows it as the value of a cell; needs the extra `notebook`

    Raises
    ------
    UsageError : it is not a result with models, it does not contain what the arguments select, or ipywidgets is
        not installed

    >>> import impact
    >>> controls = impact.explore(impact.sweep("configs/figure6.toml"), kind="restitution")
    """
    try:
        import ipywidgets
    except ImportError:
        raise UsageError('needs ipywidgets; pip install "impact-sweep[notebook]"') from None
    dataset = result_of(dataset)
    require_axes(dataset)
    if "model" not in dataset.dims:
        is_board = kind_of(dataset) == "board"
        advice = "impact.report writes the page of a board" if is_board else "impact.plot draws a time history"
        raise UsageError(f"expected the result of a sweep, with models; {advice}")
    kinds, axes, plugin_set = kinds_to_offer(dataset), axes_of(dataset), read_plugins(plugins)
    require_known([] if kind is None else [kind], kinds, "kind: no kind", " of this result")
    laws = {"models": (chosen_laws(None, dataset), chosen_laws(models, dataset))}
    if "friction" in dataset.dims:
        laws["frictions"] = (chosen_laws(None, dataset, "friction"),) * 2
    swept = [name for name in axes if dataset.sizes[name] > 1]
    config, reasons = _config_and_reasons(dataset, swept, plugin_set)
    require_known(sel or {}, swept, "sel: no axis", " to select along")

    first = choose_line(dataset, laws["models"][0]).x
    first = first if first in axes else next(iter(axes), None)
    # by the names of the arguments of `plot`
    menus = {
        "kind": ipywidgets.Dropdown(options=kinds, value=kind or default_kind(dataset).name),
        **{
            # with a row for the scroll bar below names that are wider than the list
            name: ipywidgets.SelectMultiple(options=options, value=value, rows=min(len(options) + 1, 8))
            for name, (options, value) in laws.items()
        },
        "x": ipywidgets.Dropdown(options=axes, value=first),
        "y": ipywidgets.Dropdown(options=axes, value=next((name for name in axes if name != first), first)),
    }
    for name, menu in menus.items():
        menu.description = name
    sliders = {name: _slider(dataset, name, name not in reasons, (sel or {}).get(name)) for name in swept}
    controls = menus | sliders
    picture = ipywidgets.Image(
        format="png", layout={"width": "100%", "max_width": f"{WIDTH_INCHES * DPI:.0f}px", "margin": "0"}
    )
    message = ipywidgets.HTML(layout={"min_height": "2em"})

    def draw() -> None:
        # JupyterLab handles changes in several threads, and each draws the present values
        with DRAWING:
            message.value = COMPUTING
            kind = find_kind(menus["kind"].value)
            along = kind.inputs_along(menus["x"].value, menus["y"].value)
            for name, control in controls.items():
                control.disabled = name in along or name in {"x", "y"}.difference(kind.along)
            chosen = {name: control.value for name, control in controls.items() if not control.disabled}
            at = {name: value_shown(chosen.pop(name), dataset[name].values) for name in sliders if name in chosen}
            off_grid = {name: value for name, value in at.items() if value not in dataset[name].values}
            try:
                result = dataset
                if off_grid and config and kind.source != "history":
                    of_laws = select_laws(dataset, chosen["models"], chosen.get("frictions"))
                    result = integrate_at(of_laws, config, at, plugin_set)
                figure = plot(result, sel=at, width=WIDTH_INCHES, plugins=plugins, **chosen)
                figure.savefig(png := BytesIO(), dpi=DPI)
            except Exception as error:
                message.value = escape(safe_text(str(error) or repr(error), 400))
                if isinstance(error, ImpactError):
                    return
                raise
            picture.value = png.getvalue()
            values = ", ".join(f"{name} = {value:.6g}" for name, value in off_grid.items())
            message.value = escape(f"{values}: between values of the grid, integrated again") if values else ""

    waiting: list[asyncio.TimerHandle] = []

    def update(change: object) -> None:
        message.value = COMPUTING
        while waiting:
            waiting.pop().cancel()
        try:
            # changes that arrived while a picture was drawn are handled first, so that only the last one is drawn
            waiting.append(asyncio.get_running_loop().call_later(DELAY_S, draw))
        except RuntimeError:
            draw()

    # ch: the width of a digit in the font of the page
    longest = min(max(len(control.description) for control in controls.values()), MAX_LABEL_LETTERS)
    for control in controls.values():
        control.layout.width, control.style.description_width = "auto", f"{longest + 1}ch"
        control.tooltip = control.description
        control.observe(update, names="value")
    notes = ["Click a number to type another one."] if len(reasons) < len(swept) else []
    notes += [f"{name} keeps to the grid: {reason}." for name, reason in reasons.items()]
    shown_notes = ipywidgets.HTML("".join(f"<p style='line-height: 1.4'>{escape(note)}</p>" for note in notes))
    draw()
    # the picture goes below the controls where both do not fit side by side
    columns = [
        ipywidgets.VBox([*controls.values(), shown_notes], layout={"flex": "1 1 280px", "min_width": "0"}),
        ipywidgets.VBox([message, picture], layout={"flex": "3 1 440px", "min_width": "0"}),
    ]
    box = ipywidgets.Box(columns, layout={"flex_flow": "row wrap", "width": "100%", "grid_gap": "4px 16px"})
    return ipywidgets.VBox([box])


def _slider(dataset: xr.Dataset, name: str, is_free: bool, value: object) -> Any:
    """Make the slider of an axis, of any number in its range with a field or of its values, at a value."""
    import ipywidgets

    values, label = dataset[name].values, axis_label(name, numbered_unit(dataset, name))
    first = values[0].item() if value is None else in_si(dataset, name, to_plain_value(value))
    if not (is_free and isinstance(first, float | int) and values.min() <= first <= values.max()):
        # one of the grid, or the message that there is no such value
        first = select(dataset, {name: first})[name].values.ravel()[0].item()
    common = {"value": first, "description": label, "continuous_update": False}
    if not is_free:
        return ipywidgets.SelectionSlider(options=shown_values(dataset, name), **common)
    is_log = is_geometric(np.sort(values))
    least, most = (math.log10(end) if is_log else float(end) for end in (values.min(), values.max()))
    return (ipywidgets.FloatLogSlider if is_log else ipywidgets.FloatSlider)(
        min=least,
        max=most,
        # at least a hundred positions, at round numbers
        step=0.01 if is_log else 10.0 ** math.floor(math.log10((most - least) / 100.0)),
        # six digits, without zeros at the end
        readout_format=".6",
        **common,
    )


def axis_label(name: str, unit: str = "1") -> str:
    """Name an axis beside its control: the parameter before its law, which may be cut.

    >>> axis_label("kuwabara-kono-1987.A", "s")
    'A [s], kuwabara-kono-1987'
    """
    parsed = InputName.parse(name)
    return ", ".join(filter(None, (parsed.key if unit == "1" else f"{parsed.key} [{unit}]", parsed.owner)))


def value_shown(value: Any, grid: np.ndarray) -> Any:
    """Round a number to what a slider shows of it; a value of the grid, or shown as one is, is that value.

    >>> value_shown(0.333333, np.array([1 / 3, 0.5])) == 1 / 3, value_shown(0.4000000001, np.array([0.5]))
    (True, 0.4)
    """
    if value in grid:
        return value
    nearest = float(grid[np.argmin(np.abs(grid - value))])
    return nearest if f"{nearest:.6g}" == f"{value:.6g}" else float(f"{value:.6g}")


def _config_and_reasons(
    dataset: xr.Dataset, axes: Sequence[str], plugins: Plugins
) -> tuple[Config | None, dict[str, str]]:
    """Read the config of a result, and find why some axes take values of the grid only."""
    try:
        config = stored_config(dataset.attrs, (), plugins, "the result", allow_changed_plugins=True)
        for changed in changed_plugins(dataset.attrs, plugins, "the result"):
            raise UsageError(changed)
        by_name = {axis.name: axis for axis in config_of_part(config, dataset).axes}
        if any(name not in by_name or by_name[name].size != dataset.sizes[name] for name in axes):
            raise UsageError("the axes of the result are not those of its config")
    except ImpactError as error:
        return None, dict.fromkeys(axes, safe_text(str(error), 200))
    return config, {name: reason for name in axes if (reason := _why_on_grid(by_name[name]))}


def _why_on_grid(axis: Axis) -> str:
    """Explain why an axis takes values of the grid only; empty if it takes any number between them."""
    if axis.numbered or len(axis.columns) > 1:
        return f"{', '.join(axis.columns)} vary together"
    word = InputName.parse(axis.name).word
    if any(isinstance(word(value), str) for value in axis.labels):
        return "its values are words"
    return "" if np.isfinite(np.asarray(axis.labels, float)).all() else "it has an infinite value"


def integrate_at(dataset: xr.Dataset, config: Config, at: Mapping[str, Any], plugins: Plugins) -> xr.Dataset:
    """Integrate a result, or some laws of one, again at values of axes that need not be on its grid.

    Each of these is then the only value of its axis; other axes are those of the result. More points than
    MAX_POINTS_AGAIN are a UsageError.

    >>> import impact
    >>> from impact.engine.plugins import Plugins
    >>> result = impact.sweep("configs/figure6.toml")
    >>> config = stored_config(result.attrs, (), Plugins(), "result")
    >>> part = integrate_at(result.sel(model=["gharib-hurmuzlu-2012"]), config, {"e": 0.333}, Plugins())
    >>> shot = impact.run("configs/figure6.toml", model="gharib-hurmuzlu-2012", at={"e": 0.333})
    >>> part["e_out"].item() == shot.values["e_out"]
    True
    """
    on_grid = {name: value for name, value in at.items() if value in dataset[name].values}
    off_grid = {name: {name: (value,)} for name, value in at.items() if name not in on_grid}
    axes = config_of_part(config, select(dataset, on_grid)).axes
    # an axis of a law needs that law
    keys = {InputName.parse(axis.name).owner for axis in axes}.union(
        chosen_laws(None, dataset), chosen_laws(None, dataset, "friction")
    )
    part = replace(
        config,
        axes=tuple(replace(axis, columns=off_grid.get(axis.name, axis.columns)) for axis in axes),
        models=tuple(law for law in config.models if law.key in keys),
        frictions=tuple(law for law in config.frictions if law.key in keys),
    )
    plan = Plan(part, plugins.of(part.models))
    if plan.points > MAX_POINTS_AGAIN:
        raise UsageError(
            f"got {plan.points:,} points to integrate, expected at most {MAX_POINTS_AGAIN:,} at values "
            "that are not on the grid; select fewer models"
        )
    return sweep_in_memory(plan)


def kinds_to_offer(dataset: xr.Dataset) -> list[str]:
    """List the kinds of picture that apply to a result.

    >>> import impact
    >>> kinds_to_offer(impact.sweep("configs/figure6.toml"))
    ['final-velocities', 'restitution', 'error', 'loop', 'history', 'impulse']
    """
    # a kind may apply to one model alone, such as a map over one of its parameters
    one_key = chosen_laws(None, dataset)[:1]
    # a picture of an animation is one frame of it, which shows less than a loop
    kinds = [kind for kind in kinds_of(dataset) if kind.name != "animation"]
    return [kind.name for kind in kinds if kind.default(dataset, one_key) is not None]


def axes_of(dataset: xr.Dataset) -> list[str]:
    """List the axes with values to select: not the samples, and none of a calibration or a sensitivity study.

    >>> import impact
    >>> axes_of(impact.sweep("configs/figure6.toml"))
    ['e']
    """
    if source_of(dataset) in STUDIES:
        return []
    return [str(dim) for dim in dataset.dims if dim not in ("model", "friction", SAMPLE) and dim in dataset.coords]


def shown_values(dataset: xr.Dataset, name: str) -> list[tuple[str, Any]]:
    """List the texts and values of the positions of an axis."""
    word, unit = InputName.parse(name).word, numbered_unit(dataset, name)
    values = dataset[name].values.tolist()
    return [("∞" if value == math.inf else safe_text(prefixed(word(value), unit)), value) for value in values]
