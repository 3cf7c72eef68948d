"""Controls in a notebook that draw a result: the kind of picture, the laws, and a slider for each axis."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..config.grid import SAMPLE
from ..contact.model import ForceModel
from ..errors import UsageError
from ..formatting import quantity, safe_text
from ..results.xarray_backend import result_of
from .draw import plot
from .kinds import STUDIES, default_kind, find_kind, kinds_of, source_of
from .slices import unit_of, x_axis

if TYPE_CHECKING:
    import xarray as xr
    from ipywidgets import VBox

DPI = 110


def explore(dataset: xr.Dataset | str | Path, *, plugins: Sequence[ForceModel | str | Path] = ()) -> VBox:
    """Show a result with controls in a notebook: the kind of picture, the models, and a slider for each axis.

    Parameters
    ----------
    dataset : a result, or its file
    plugins : see `plot`

    Returns
    -------
    ipywidgets.VBox : a notebook shows it as the value of a cell; needs the extra `notebook`

    Raises
    ------
    UsageError : it is not a result with models, or ipywidgets is not installed

    >>> import impact
    >>> controls = impact.explore(impact.sweep("configs/figure6.toml"))
    """
    try:
        import ipywidgets
    except ImportError:
        raise UsageError('needs ipywidgets; pip install "impact-sweep[notebook]"') from None
    dataset = result_of(dataset)
    if "model" not in dataset.dims:
        raise UsageError("expected the result of a sweep, with models; impact.plot draws a time history")

    axes = axes_of(dataset)
    keys = [str(key) for key in dataset["model"].values]
    kind = ipywidgets.Dropdown(
        options=kinds_to_offer(dataset), value=default_kind(dataset).name, description="kind"
    )
    models = ipywidgets.SelectMultiple(options=keys, value=keys, description="models", rows=min(len(keys), 8))
    # none to choose from where there is no friction
    laws = [str(key) for key in dataset["friction"].values] if "friction" in dataset.dims else []
    frictions = ipywidgets.SelectMultiple(
        options=laws, value=laws, description="frictions", rows=min(len(laws), 8)
    )
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
        found = find_kind(kind.value)
        drawn = found.inputs_along(x.value, y.value)
        x.disabled, y.disabled = "x" not in found.along, "y" not in found.along
        for name, slider in sliders.items():
            slider.disabled = name in drawn
        sel = {name: slider.value for name, slider in sliders.items() if name not in drawn}
        try:
            figure = plot(
                dataset,
                kind=kind.value,
                x=None if x.disabled else x.value,
                y=None if y.disabled else y.value,
                sel=sel,
                models=list(models.value),
                frictions=list(frictions.value),
                plugins=plugins,
            )
        except UsageError as error:
            message.value = escape(safe_text(str(error), 400))
            return
        png = BytesIO()
        figure.savefig(png, dpi=DPI)
        picture.value, message.value = png.getvalue(), ""

    controls = [kind, models, *([frictions] if laws else []), x, y, *sliders.values()]
    for control in controls:
        control.observe(update, names="value")
    update()
    return ipywidgets.VBox([ipywidgets.HBox([ipywidgets.VBox(controls), picture]), message])


def kinds_to_offer(dataset: xr.Dataset) -> list[str]:
    """List the kinds of picture that apply to a result.

    >>> import impact
    >>> kinds_to_offer(impact.sweep("configs/figure6.toml"))
    ['final-velocities', 'restitution', 'error', 'loop', 'history', 'impulse']
    """
    # a kind may apply to one model alone, such as a map over one of its parameters
    one_key = [str(key) for key in dataset["model"].values[:1]]
    return [kind.name for kind in kinds_of(dataset) if kind.default(dataset, one_key) is not None]


def axes_of(dataset: xr.Dataset) -> list[str]:
    """List the axes with values to select: not the samples, and none of a calibration or a sensitivity study.

    >>> import impact
    >>> axes_of(impact.sweep("configs/figure6.toml"))
    ['e']
    """
    if source_of(dataset) in STUDIES:
        return []
    return [str(dim) for dim in dataset.dims if dim not in ("model", "friction", SAMPLE) and dim in dataset.coords]


def _shown_values(coordinate: xr.DataArray) -> list[tuple[str, Any]]:
    """List the texts and values of the positions of an axis."""
    return [(safe_text(quantity(value, unit_of(coordinate))), value) for value in coordinate.values.tolist()]
