"""A result as one page of HTML: it needs no network, runs nothing, and shows what a file says as text only."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..contact.models import catalogue
from ..errors import UsageError
from ..results.attributes import json_object, json_table
from ..results.plausibility import material_notes, result_notes
from ..results.ranking import Ranked, ranking
from ..results.replay import own
from ..results.schema import exponents_of, is_input, plain_unit
from ..results.slabs import MAX_SUMMARY_POINTS, is_large
from ..results.summary import Tally, extremes_of, tally_of
from ..sweeps.rules import MATERIAL
from ..text import safe_text, with_year
from .kinds import Choice, Numbers
from .markup import Markup, doi_link, table, tag
from .page_figures import figures_of, varying

if TYPE_CHECKING:
    import xarray as xr

# nothing is fetched and nothing is run, whatever should get into the page
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
CSS = files(__package__) / "page.css"
# at most so many failed points and values are shown
MAX_FAILED_AT, VALUES = 20, 8


def page(dataset: xr.Dataset, figures: Callable[[str, Choice], Numbers]) -> str:
    """A result as one page of HTML.

    Parameters
    ----------
    dataset : a result
    figures : the numbers of a figure, of its kind and of what it shows

    Raises
    ------
    UsageError : it is a time history
    ResultError : its attributes are not those of a result
    """
    if "model" not in dataset.dims:
        raise UsageError("this is a time history; a report is made of the result of a sweep")
    title = str(dataset.attrs.get("title", "")) or "Impact of two balls"
    tally = tally_of(dataset, MAX_FAILED_AT)
    keys, answer = _answer(dataset)
    sections = {
        "What was swept": _swept(dataset), "The answer": answer, "Figures": figures_of(dataset, keys, figures),
        "Failed points": _failed(dataset, tally), "How it was computed": _computed(dataset),
        "The models": _models(dataset), "The config": _config(dataset),
    }  # fmt: skip
    return "\n".join([
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        tag("title", title) + tag("style", Markup(CSS.read_text(encoding="utf-8"))),
        "</head>\n<body>",
        tag("header", *_summary(dataset, title, tally)),
        tag("main", *(tag("section", tag("h2", name), *parts) for name, parts in sections.items())),
        "</body>\n</html>\n",
    ])  # fmt: skip


def _summary(dataset: xr.Dataset, title: str, tally: Tally) -> Iterator[Markup]:
    """The title, what this is, and how the points ended."""
    models, axes = dataset.sizes["model"], [str(dim) for dim in dataset.sizes if dim != "model"]
    points, over = math.prod(dataset.sizes.values()), f" over {', '.join(axes)}" if axes else ""
    yield tag("h1", title)
    yield tag("p", f"{models:,} model{_s(models)} of the impact of two balls{over}, judged by the "
               f"impulse-momentum solution: {points:,} point{_s(points)}.")  # fmt: skip
    for note in (*material_notes(json_table(dataset, "materials")), *result_notes(tally)):
        yield tag("p", f"Note: {note}")
    ends = [f"{tally.counts[status]:,} {status.name.lower()}: {status.meaning}" for status in sorted(tally.counts)]
    if tally.not_counted:
        ends.append(f"{tally.not_counted:,} not evaluated: too many different points to count them for a report")
    yield tag("ul", *(tag("li", end) for end in ends))


def _swept(dataset: xr.Dataset) -> Iterator[Markup]:
    """The axes, and what has a single value."""
    heads = ("axis", "meaning", "unit", "#from", "#to", "#values", "spacing")
    rows = [(name, *_about(dataset[name]), *_range(dataset[name])) for name in varying(dataset)]
    yield table("What was swept", heads, rows) if rows else tag("p", "Nothing was varied but the model.")
    single = []
    for name, one in dataset.coords.items():
        if one.ndim == 0 and is_input(str(name)):
            meaning, unit = _about(one)
            value = (exponents_of(dataset) if name == "n" else None) or _shown(one.values.item())
            single.append((str(name), f"{value} {unit}".removesuffix(" –"), meaning))
    units = {key: one.unit.removesuffix("1") for key, one in MATERIAL.items()}
    for name, material in json_table(dataset, "materials").items():
        given = (f"{key} = {_shown(value)} {units.get(key, '')}".strip() for key, value in material.items()
                 if value is not None)  # fmt: skip
        single.append((name, ", ".join(given), "material"))
    if single:
        yield tag("h3", "Single values")
        yield table("Single values", ("name", "value", "meaning"), single)


def _about(coordinate: xr.DataArray) -> tuple[str, str]:
    """Meaning and unit of a coordinate."""
    meaning, unit = (str(coordinate.attrs.get(name, "")) for name in ("long_name", "units"))
    return meaning, plain_unit(unit) if unit not in ("", "1") else "–"


def _range(coordinate: xr.DataArray) -> tuple[str, str, str, str]:
    """From, to, how many, and how the values are spaced."""
    ends, large = ("–", "–"), is_large(coordinate.variable)
    if large:
        extremes = extremes_of(coordinate.to_dataset(name="values"), "values")
        ends = (_shown(extremes.smallest), _shown(extremes.largest)) if extremes else ends
    elif coordinate.dtype.kind == "f":
        smallest, largest = (end.reduce(coordinate.values, axis=None) for end in (np.fmin, np.fmax))
        ends = _shown(float(smallest)), _shown(float(largest))
    spacing = str(coordinate.attrs.get("equation", "")) or ("–" if large else _spacing(coordinate.values.ravel()))
    if coordinate.name not in coordinate.dims:
        spacing = f"varies with {' and '.join(map(str, coordinate.dims))}: {spacing}"
    return *ends, f"{coordinate.size:,}", spacing


def _spacing(values: NDArray[Any]) -> str:
    """How values are spaced, or which they are.

    >>> _spacing(np.array([0.0, 0.5, 1.0])), _spacing(np.array([1.0, 10.0, 100.0])), _spacing(np.array([2.0, 1.0]))
    ('even, by 0.5', 'geometric, by 10', '2, 1')
    """
    if values.dtype.kind == "f" and values.size > 2 and np.isfinite(values).all():
        step = (values[-1] - values[0]) / (values.size - 1)
        if np.allclose(np.diff(values), step, rtol=1e-6, atol=0.0):
            return f"even, by {step:.6g}"
        if (values > 0.0).all():
            ratio = np.log(values[-1] / values[0]) / (values.size - 1)
            if np.allclose(np.diff(np.log(values)), ratio, rtol=1e-6, atol=0.0):
                return f"geometric, by {np.exp(ratio):.6g}"
    return ", ".join(map(_shown, values[:VALUES].tolist())) + (", …" if values.size > VALUES else "")


def _answer(dataset: xr.Dataset) -> tuple[list[str], list[Markup]]:
    """The keys of the models, the best first if they can be ranked, and the answer in a sentence and a table."""
    keys = [str(key) for key in dataset["model"].values]
    try:
        ranked = ranking(dataset, max_points=MAX_SUMMARY_POINTS)
    except UsageError as error:
        return keys, [tag("p", f"The models are not ranked: {error}.")]
    rows = [
        (one.model, one.percent, _brief(one.mean_error), _brief(one.max_error), _served(one), f"{one.failed:,}")
        for one in ranked.models
    ]
    heads = ("model", f"#within {ranked.tol:g}", "#mean |e_error|", "#max |e_error|", "serves e", "#failed")
    return [one.model for one in ranked.models], [
        tag("p", re.sub("^no ", "No ", f"{ranked.headline}."), class_="headline"),
        table("Models, the best first", heads, rows),
        tag("p", "e_error is e_out − e, at the points where an e was asked for and the balls meet. "
             "A model serves an e if it is within the tolerance at all of its points.", class_="soft"),
    ]  # fmt: skip


def _brief(error: float) -> str:
    return "–" if np.isnan(error) else f"{error:.3g}"


def _served(one: Ranked) -> str:
    """The ranges of e that a model serves."""
    if one.served is None:
        return "–"
    ranges = [_shown(least) + (f" to {_shown(most)}" if most > least else "") for least, most in one.served]
    more = f" and {len(ranges) - VALUES:,} more" if len(ranges) > VALUES else ""
    return ", ".join(ranges[:VALUES]) + more or "nowhere"


def _failed(dataset: xr.Dataset, tally: Tally) -> Iterator[Markup]:
    """The first points that failed, and how many more there are."""
    if "status" not in dataset:
        yield tag("p", "The result does not tell which points failed.")
        return
    if tally.not_counted:
        yield tag("p", f"The status of {tally.not_counted:,} points was not evaluated.")
    if not tally.failed:
        yield tag("p", "No other point failed." if tally.not_counted else "No point failed.")
        return
    rows: list[tuple[str, str, str]] = []
    columns = [name for name in varying(dataset) if {*dataset[name].dims} <= {*dataset["status"].dims}]
    axes = [dim for dim in dataset["status"].dims if dim != "model"]
    for status, model, places in tally.failed_at:
        point = dataset.isel(model=model)["status"].isel(dict(zip(axes, places, strict=True)))
        at = own({"model": point["model"].item(), **{name: point[name].item() for name in columns}})
        where = ", ".join(f"{name}\u00a0=\u00a0{_shown(at[name])}" for name in at if name != "model")
        rows.append((at["model"], where or "–", status.meaning))
    yield table("Failed points", ("model", "where", "why"), rows)
    if tally.failed > len(rows):
        yield tag("p", f"and {tally.failed - len(rows):,} more")


def _computed(dataset: xr.Dataset) -> Iterator[Markup]:
    """By which program and settings, and what tells this result from others."""
    attributes, settings = dataset.attrs, ("rtol", "max_steps")
    facts = {
        "program": f"impact {attributes.get('impact_version', '')}",
        "packages": ", ".join(f"{name} {one}" for name, one in json_object(dataset, "packages").items()),
        "solver": ", ".join(f"{name} {attributes[name]:g}" for name in settings if name in attributes),
        "core": attributes.get("core", ""),
        "fingerprint": attributes.get("fingerprint", ""),
        "seal": dataset.encoding.get("seal") or "",
        "reason": attributes.get("reason", ""),
        **{f"plug-in {key}": ", ".join(f"{name} {text}" for name, text in one.items() if text is not None)
           for key, one in json_table(dataset, "plugins").items()},
    }  # fmt: skip
    yield table("How it was computed", (), [fact for fact in facts.items() if fact[1]])


def _models(dataset: xr.Dataset) -> Iterator[Markup]:
    """Where each model comes from, and what the catalogue knows of it."""
    for place in range(dataset.sizes["model"]):
        one = dataset.isel(model=place)
        key, title, year, equation, reference, doi = (
            str(one[name].item()) for name in ("model", "title", "year", "equation", "reference", "doi")
        )
        about = [tag("p", equation), tag("p", reference, " ", doi_link(doi))]
        known = catalogue().get(key)
        # a plug-in, or another version of the program, may mean another law by this name
        if known is not None and known.equation == equation:
            about += [tag("p", f"Said to hold for {known.domain_text}.")] if known.domain_text else []
            about += [tag("p", f"Evidence: {known.evidence}.", class_="soft")]
        yield tag("article", tag("h3", f"{with_year(title, year)} ", tag("span", key, class_="soft")), *about)


def _config(dataset: xr.Dataset) -> Iterator[Markup]:
    """The config, line by line as it was, and what was changed in it."""
    changes = json.loads(str(dataset.attrs.get("config_set", "[]")))
    lines = str(dataset.attrs.get("config", "")).replace("\r\n", "\n").expandtabs(4).split("\n")
    yield tag("pre", Markup("\n".join(escape(safe_text(line, 100_000)) for line in lines)))
    if changes:
        yield tag("p", "Changed by:")
        yield tag("ul", *(tag("li", tag("code", f"--set {one}")) for one in changes))


def _s(number: int) -> str:
    return "" if number == 1 else "s"


def _shown(value: object) -> str:
    """A coordinate without the digits that rounding left, and without many zeros.

    >>> _shown(0.1 + 0.2), _shown(6e9), _shown(1234567.0)
    ('0.3', '6e+09', '1234567')
    """
    if not isinstance(value, float):
        return str(value)
    short, long = f"{value:.6g}", f"{value:.12g}"
    return short if float(short) == float(long) else long
