"""Controls in a notebook that draw a result: the kind of picture, the models, and a slider for each axis."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..config.grid import SAMPLE
from ..contact.model import ForceModel
from ..errors import UsageError
from ..formatting import quantity
from ..results.schema import plain_unit
from ..text import safe_text
from .curves import STEP_AXES
from .draw import plot
from .kinds import KINDS, MAP_KINDS, MOTION_KINDS, STUDY_KINDS, default_kind
from .slices import x_axis

if TYPE_CHECKING:
    import xarray as xr
    from ipywidgets import VBox

DPI = 110


def explore(dataset: xr.Dataset, *, plugins: Sequence[ForceModel | str | Path] = ()) -> VBox:
    """Show a result with controls in a notebook: the kind of picture, the models, and a slider for each axis.

    Parameters
    ----------
    dataset : a result
    plugins : see `plot`

    Returns
    -------
    ipywidgets.VBox : a notebook shows it as the value of a cell; needs the extra `notebook`

    Raises
    ------
    UsageError : it is no result with models, or ipywidgets is not installed

    >>> import impact
    >>> controls = impact.explore(impact.sweep("configs/figure6.toml"))
    """
    try:
        import ipywidgets
    except ImportError:
        raise UsageError('needs ipywidgets; pip install "impact-sweep[notebook]"') from None
    if "model" not in dataset.dims:
        raise UsageError("expected the result of a sweep, with models; impact.plot draws a time history")

    kinds, axes = kinds_of(dataset), axes_of(dataset)
    keys = [str(key) for key in dataset["model"].values]
    kind = ipywidgets.Dropdown(options=kinds, value=default_kind(dataset), description="kind")
    models = ipywidgets.SelectMultiple(options=keys, value=keys, description="models", rows=min(len(keys), 8))
    first = x_axis(dataset, None) if axes else None
    first = first if first in axes else next(iter(axes), None)
    others = [name for name in axes if name != first]
    x = ipywidgets.Dropdown(options=axes, value=first, description="x")
    y = ipywidgets.Dropdown(options=axes, value=others[0] if others else first, description="y")
    sliders = {
        name: ipywidgets.SelectionSlider(
            options=_shown_values(dataset[name]), description=name, continuous_update=False
        )
        for name in axes
        if dataset.sizes[name] > 1
    }
    picture = ipywidgets.Image(format="png")
    message = ipywidgets.HTML()

    def update(change: object = None) -> None:
        drawn = drawn_axes(kind.value, x.value, y.value)
        x.disabled, y.disabled = x.value not in drawn, y.value not in drawn or kind.value not in MAP_KINDS
        for name, slider in sliders.items():
            slider.disabled = name in drawn
        sel = {name: slider.value for name, slider in sliders.items() if name not in drawn}
        along_x, along_y, *_ = (None, None) if kind.value == "timestep" else (*drawn, None, None)
        try:
            figure = plot(
                dataset,
                kind=kind.value,
                x=along_x,
                y=along_y,
                sel=sel,
                models=list(models.value),
                plugins=plugins,
            )
        except UsageError as error:
            message.value = escape(safe_text(str(error), 400))
            return
        png = BytesIO()
        figure.savefig(png, dpi=DPI)
        picture.value, message.value = png.getvalue(), ""

    controls = [kind, models, x, y, *sliders.values()]
    for control in controls:
        control.observe(update, names="value")
    update()
    return ipywidgets.VBox([ipywidgets.HBox([ipywidgets.VBox(controls), picture]), message])


def kinds_of(dataset: xr.Dataset) -> list[str]:
    """The kinds of pictures of a result.

    >>> import impact
    >>> kinds_of(impact.sweep("configs/figure6.toml"))[:3]
    ['final-velocities', 'restitution', 'error']
    """
    default = default_kind(dataset)
    if default in STUDY_KINDS:
        return [default]
    left_out = {*STUDY_KINDS}
    if SAMPLE not in dataset.dims:
        left_out.add("uncertainty")
    if "phase" not in dataset.coords:
        left_out.add("timestep")
    return [kind for kind in KINDS if kind not in left_out]


def axes_of(dataset: xr.Dataset) -> list[str]:
    """The axes with values to select: not the samples, and none of a calibration or a sensitivity study.

    >>> import impact
    >>> axes_of(impact.sweep("configs/figure6.toml"))
    ['e']
    """
    if default_kind(dataset) in STUDY_KINDS:
        return []
    return [str(dim) for dim in dataset.dims if dim not in ("model", SAMPLE) and dim in dataset.coords]


def drawn_axes(kind: str, x: str | None, y: str | None) -> tuple[str, ...]:
    """The axes along which a kind of picture draws; the others have a value.

    >>> drawn_axes("loop", "e", "m2"), drawn_axes("error", "e", "m2"), drawn_axes("map", "e", "m2")
    ((), ('e',), ('e', 'm2'))
    """
    if kind in MOTION_KINDS or x is None:
        return ()
    if kind == "timestep":
        return (*STEP_AXES, "phase", "e")
    return (x, y) if kind in MAP_KINDS and y is not None else (x,)


def _shown_values(coordinate: xr.DataArray) -> list[tuple[str, Any]]:
    """Texts and values of the positions of an axis."""
    unit = plain_unit(str(coordinate.attrs.get("units", "1")))
    return [(safe_text(quantity(value, unit)), value) for value in coordinate.values.tolist()]
