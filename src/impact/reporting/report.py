"""The report: a result as one page of HTML, without network access or scripts; texts of a file are escaped.

`report.html.j2` is the template, `board.html.j2` that of a board; this module gives them plain values.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup
from numpy.typing import NDArray

from ..atomic import check_outputs, write_file
from ..config.draft import Setting
from ..config.input_names import InputName, is_input
from ..config.library import library
from ..config.tables import MATERIAL_QUANTITIES
from ..contact.evidence import Evidence
from ..contact.frictions import frictions
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..contact.variables import LAW_DIMS
from ..engine.plan import Plan
from ..engine.plugins import read_plugins
from ..errors import ImpactError, UsageError, require_known
from ..formatting import argument, law_name, number, prefixed, safe_text, scaled_unit, with_year
from ..plots.slices import varying_inputs
from ..results.attributes import read_attribute
from ..results.board import BOARD_HEADINGS, Board, board_rows, check_rows, engine_headline, failure_lines
from ..results.calibration import calibration_title, describe_data, fit_notes, fit_table
from ..results.provenance import stored_config
from ..results.ranking import DEFAULT_TOL, Ranking, rank_laws
from ..results.schema import (
    FIT_STATUSES,
    MODEL_METADATA,
    count_points,
    exponents_of,
    kind_of,
    numbered_unit,
    require_axes,
)
from ..results.selection import select_laws
from ..results.sensitivity import INDEX_HEADINGS, describe_design, study_texts
from ..results.slabs import MAX_SUMMARY_POINTS, is_large
from ..results.summary import Summary, extremes_of, input_notes, inputs_of, result_notes, summarize, with_depths
from ..results.xarray_backend import result_to_show
from .figures import Drawing, Figure, at_text, coordinate_text

# the most that is shown: letters of a text and of a line of the config, values of an axis, failed points
MAX_TEXT_LETTERS, MAX_LINE_LETTERS, MAX_VALUES, MAX_FAILED = 2000, 100_000, 8, 20
# of the page of a result, in their order
SECTIONS = ("inputs", "answer", "figures", "friction", "failures", "computed", "models", "config", "commands")
# letters of the title at the top of a printed page
MAX_RUNNING_LETTERS = 80
# with more than MAX_FIGURE_MODELS models the figures show the BEST_MODELS best
MAX_FIGURE_MODELS, BEST_MODELS = 12, 8


def report(
    dataset: xr.Dataset | str | Path,
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
    models: Sequence[str] | None = None,
    sections: Sequence[str] | None = None,
) -> str:
    """Write a result as one page of HTML, which needs no network and runs no scripts.

    Parameters
    ----------
    dataset : a result, or the file of one
    output : file to write the page to as well, whose name ends in .html
    overwrite : replace the output if it exists
    plugins : plug-in models that the result was computed with; without them the figures of a motion are left out
    models : keys of the models to show; by default all
    sections : names of SECTIONS, of which those are written that the result has; by default all. Figures of
        friction are in the section friction

    Returns
    -------
    str : the page, as HTML

    Raises
    ------
    UsageError, ResultError : it is a time history, or its attributes are not those of a result; there is no such
        model or section; the output exists, or has another ending

    >>> import impact
    >>> result = impact.sweep("configs/figure6.toml", overrides=["models=hertz", "sweep.e=[0.5, 1.0]"])
    >>> "<h1>Final velocities comparison</h1>" in impact.report(result)
    True
    """
    check_page_path(output, [dataset, *plugins], overwrite=overwrite)
    # the error of one that cannot be read would leave out every figure
    read_plugins(plugins)
    with result_to_show(dataset) as result:
        text = _report_of(result, plugins, models, sections)
    if output is not None:
        write_file(Path(output), text.encode(), overwrite=overwrite)
    return text


def check_page_path(output: str | Path | None, inputs: Sequence[object], *, overwrite: bool) -> None:
    """Refuse a page that would replace a file, or whose name is not that of a page."""
    if output is None:
        return
    if Path(output).suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"{output}: expected a name that ends in .html")
    check_outputs([Path(output)], inputs, overwrite=overwrite)


def _report_of(
    dataset: xr.Dataset,
    plugins: Sequence[ForceModel | str | Path],
    models: Sequence[str] | None,
    sections: Sequence[str] | None,
) -> str:
    """Write a result as one page of HTML; for errors see `report`."""
    require_known(sections or (), SECTIONS, f"{argument('sections')}: no section")
    if kind_of(dataset) == "board":
        for name, value in (("models", models), ("sections", sections)):
            if value:
                raise UsageError(f"{argument(name)}: does not apply to the page of a board")
        return _board_page(dataset)
    if "model" not in dataset.dims:
        raise UsageError("got a time history, expected the result of a sweep")
    require_axes(dataset)
    model_count, part_notes = dataset.sizes["model"], []
    dataset = select_laws(dataset, models)
    if dataset.sizes["model"] < model_count:
        part_notes = [f"this page shows {dataset.sizes['model']} of the {model_count} models of the result"]
    if {*(sections or ())} == {"friction"} and "friction" not in dataset.dims:
        raise UsageError(f"{argument('sections', 'friction')}: this result has no friction")
    sections = sections or SECTIONS
    summary = with_depths(summarize(dataset, MAX_FAILED), dataset)
    fits = _fits_section(dataset) if kind_of(dataset) == "calibration" else None
    studies = list(study_texts(dataset)) if kind_of(dataset) == "sensitivity study" else []
    ranked, headline = (None, "") if fits or studies else _rank_models(dataset)
    keys = [str(key) for key in dataset["model"].values]
    selection = ""
    if len(keys) > MAX_FIGURE_MODELS:
        best = [row.model for row in ranked.models] if ranked else keys
        selection = f"The figures show {BEST_MODELS} of the {len(keys)} models: {', '.join(best[:BEST_MODELS])}."
        keys = best[:BEST_MODELS]
    drawn, left_out = list[Figure](), list[str]()
    if {"figures", "friction", "commands"} & {*sections}:
        name = Path(str(dataset.encoding.get("source", ""))).name
        drawn, left_out = Drawing(dataset, keys, plugins, name, model_count).figures()
    descriptions = [_model_section(dataset.isel(model=index)) for index in range(dataset.sizes["model"])]
    friction = _friction_section(dataset, summary) if "friction" in dataset.dims else None
    inputs, changes = inputs_of(dataset), read_attribute(dataset.attrs, "config_set")
    lines = str(dataset.attrs.get("config", "")).replace("\r\n", "\n").expandtabs(4).split("\n")
    return template("report.html.j2").render(
        title=page_title(dataset),
        summary=f"{describe_data(dataset)}." if fits else "" if studies else _summary_sentence(dataset),
        fits=fits,
        studies=studies,
        index_headings=INDEX_HEADINGS,
        design=describe_design(dataset),
        sections=list(sections),
        notes=[
            *part_notes,
            *(input_notes(inputs) if inputs else ()),
            *_pair_notes(dataset, plugins),
            *result_notes(summary),
        ],
        outcomes=list(_outcomes(summary)),
        axes=[_axis_row(dataset, name) for name in varying_inputs(dataset)],
        single_values=list(_single_values(dataset)),
        ranking=ranked,
        headline=headline,
        selection=selection,
        figures=drawn,
        left_out=left_out,
        running_title=_css_text(page_title(dataset)),
        failures=_failures_section(dataset, summary),
        friction=friction,
        facts=_facts(dataset),
        models=descriptions,
        evidence=[row for part in (*descriptions, *filter(None, [friction])) for row in part["evidence"]],
        config=Markup("\n").join(safe_text(line, MAX_LINE_LETTERS) for line in lines),
        changes=[change for change in changes if not _library_material(change)],
        library_materials=", ".join(filter(None, map(_library_material, changes))),
    )


def _library_material(change: str) -> str:
    """Name the material of the library that a change sets: a result has it, because the library may change.

    >>> [_library_material(change) for change in ("materials.steel={nu = 0.3}", "sweep.v1=2.0")]
    ['steel', '']
    """
    with suppress(ImpactError):
        setting = Setting.parse(change)
        name, value = ".".join(map(str, setting.path[1:])), setting.value
        if setting.path[:1] == ("materials",) and isinstance(value, dict) and name in library():
            return name if value.items() <= library()[name].items() else ""
    return ""


def _board_page(dataset: xr.Dataset) -> str:
    """Write a board as one page of HTML."""
    engines = Board(dataset).engines
    return template("board.html.j2").render(
        title=page_title(dataset),
        engines=engines,
        board_rows=board_rows(engines),
        headline=engine_headline,
        headings=list(BOARD_HEADINGS),
        check_rows=check_rows,
        failure_lines=failure_lines,
        facts=_facts(dataset),
        running_title=_css_text(page_title(dataset)),
    )


def _css_text(text: str) -> Markup:
    """Write a text as a string of a style sheet: all but letters and digits of ASCII are escaped.

    >>> str(_css_text('a "</style>'))
    '"a\\\\000020\\\\000022\\\\00003c\\\\00002fstyle\\\\00003e"'
    """
    shown = safe_text(text, MAX_RUNNING_LETTERS)
    return Markup('"{}"').format(
        Markup("").join(c if c.isascii() and c.isalnum() else f"\\{ord(c):06x}" for c in shown)
    )


def page_title(dataset: xr.Dataset) -> str:
    if kind_of(dataset) == "calibration":
        return calibration_title(dataset) or "Calibration"
    if kind_of(dataset) == "sensitivity study":
        return f"Which uncertain input matters for {dataset.attrs['of']}"
    return str(dataset.attrs.get("title", "")) or "Impact of two balls"


def _fits_section(dataset: xr.Dataset) -> dict[str, Any]:
    """Rank the laws of a calibration; explain what the data do not determine, and the columns."""
    headings, rows = fit_table(dataset)
    return {
        "headings": headings,
        "rows": [[row[0] or "″", *row[1:]] for row in rows],
        "notes": fit_notes(dataset),
        "statuses": [f"{name}: {meaning}" for name, meaning in FIT_STATUSES.items() if name != "ok"],
    }


def _pair_notes(dataset: xr.Dataset, plugins: Sequence[ForceModel | str | Path]) -> list[str]:
    """Note the pairs of a model and a friction law that have no meaning at some points, as the sweep did."""
    if "friction" not in dataset.dims:
        return []
    try:
        plugin_set = read_plugins(plugins)
        config = stored_config(dataset.attrs, (), plugin_set, "the result")
        return Plan(config, plugin_set.of(config.models)).pair_notes("frictions")
    except ImpactError:
        # without its plug-ins, or its config, a result has no law to ask
        return []


def template(name: str) -> Template:
    """Load a template, which escapes all values."""

    def text(value: object) -> str:
        return value if isinstance(value, Markup) else safe_text(str(value), MAX_TEXT_LETTERS)

    environment = Environment(
        loader=PackageLoader(__package__, ""),
        autoescape=True,
        finalize=text,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(name)


def _summary_sentence(dataset: xr.Dataset) -> str:
    models, axes = dataset.sizes["model"], [str(dim) for dim in dataset.sizes if dim not in ("model", "friction")]
    points, over = count_points(dataset), f" over {', '.join(axes)}" if axes else ""
    return (
        f"{models:,} model{'s' * (models != 1)} of the impact of two balls{over}, compared with the "
        f"impulse-momentum solution: {points:,} point{'s' * (points != 1)}."
    )


def _friction_section(dataset: xr.Dataset, summary: Summary) -> dict[str, Any]:
    """Describe the friction laws, and where they were read, and count the points of pairs by friction status."""
    laws = [(key, frictions().get(key)) for key in dataset["friction"].values.tolist()]
    return {
        "laws": [
            (key, with_year(law.title, law.year), law.equation, law.reference) if law else (key, "–", "–", "–")
            for key, law in laws
        ],
        "statuses": [
            (status.name.lower(), f"{count:,}", status.meaning)
            for status, count in sorted(summary.friction_counts.items())
        ],
        "evidence": [_evidence_row(key, law.evidence) for key, law in laws if law],
    }


def _evidence_row(key: str, seen: Evidence) -> tuple[str, str, str]:
    """Describe where the formulas of a law were read."""
    source = [seen.source, f"DOI seen in {seen.doi}" if seen.doi else "", seen.note]
    return key, seen.state, "; ".join(filter(None, source)) or "–"


def _outcomes(summary: Summary) -> Iterator[str]:
    """Write the number of points by status."""
    for status in sorted(summary.counts):
        yield f"{summary.counts[status]:,} {status.name.lower()}: {status.meaning}"
    if summary.not_counted:
        yield f"{summary.not_counted:,} not evaluated: too many different points to count them for a report"


def _single_values(dataset: xr.Dataset) -> Iterator[tuple[str, str, str]]:
    """List name, value and meaning of the inputs and materials that have a single value."""
    for name, coordinate in dataset.coords.items():
        if coordinate.ndim == 0 and is_input(name):
            value = (exponents_of(dataset) if name == "n" else None) or coordinate_text(dataset, str(name))
            yield str(name), value, str(coordinate.attrs.get("long_name", ""))
    units = {key: rule.unit for key, rule in MATERIAL_QUANTITIES.items()}
    for name, material in read_attribute(dataset.attrs, "materials").items():
        values = (
            f"{key} = {prefixed(value, units.get(key, '1'))}"
            for key, value in material.items()
            if value is not None
        )
        yield name, ", ".join(values), "material"


def _axis_row(dataset: xr.Dataset, name: str) -> tuple[str, ...]:
    """Describe a coordinate: name, meaning, unit, ends, number of values, and how they are spaced."""
    coordinate, unit = dataset[name], numbered_unit(dataset, name)
    attributes = coordinate.attrs
    ends: Sequence[object] = ()
    if is_large(coordinate.variable):
        extremes = extremes_of(coordinate.to_dataset(name="values"), "values")
        ends, spacing = (extremes.smallest, extremes.largest) if extremes else (), "–"
    else:
        values = coordinate.values.ravel()
        if values.dtype.kind == "f":
            largest = np.max(np.abs(values), initial=0.0, where=np.isfinite(values))
            size, unit = scaled_unit(unit, float(largest))
            values = values / size
            ends = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))
        spacing = _spacing(values)
    spacing = str(attributes.get("equation", "")) or spacing
    if name not in coordinate.dims:
        spacing = f"varies with {' and '.join(map(str, coordinate.dims))}: {spacing}"
    unit, (low, high) = "" if unit == "1" else unit, map(_number, ends or ("", ""))
    return name, str(attributes.get("long_name", "")), unit, low, high, f"{coordinate.size:,}", spacing


def _spacing(values: NDArray[Any]) -> str:
    """Write the spacing of values, or the values.

    >>> _spacing(np.array([0.0, 0.5, 1.0])), _spacing(np.array([1.0, 10.0, 100.0])), _spacing(np.array([2.0, 1.0]))
    ('even, by 0.5', 'geometric, by 10', '2, 1')
    """
    if values.dtype.kind == "f" and values.size > 2 and np.isfinite(values).all():
        step = (values[-1] - values[0]) / (values.size - 1)
        if np.allclose(np.diff(values), step, rtol=1e-6, atol=0.0):
            return f"even, by {number(step)}"
        if (values > 0.0).all():
            ratio = np.log(values[-1] / values[0]) / (values.size - 1)
            if np.allclose(np.diff(np.log(values)), ratio, rtol=1e-6, atol=0.0):
                return f"geometric, by {number(float(np.exp(ratio)))}"
    return ", ".join(map(_number, values[:MAX_VALUES].tolist())) + (", …" if values.size > MAX_VALUES else "")


def _number(value: object) -> str:
    return "∞" if value == np.inf else number(value)


def _rank_models(dataset: xr.Dataset) -> tuple[Ranking | None, str]:
    """Rank the models, if possible, and write the answer in a sentence."""
    try:
        ranked = rank_laws(dataset, DEFAULT_TOL, max_points=MAX_SUMMARY_POINTS)
    except UsageError as error:
        return None, f"The models are not ranked: {error}."
    return ranked, re.sub("^no ", "No ", f"{ranked.headline}.")


def _failures_section(dataset: xr.Dataset, summary: Summary) -> dict[str, Any]:
    """Describe failed points: sentences, the first points, and the number of the others."""
    if "status" not in dataset:
        return {"sentences": ["The result does not contain the status of the points."], "points": [], "more": ""}
    sentences = [f"The status of {summary.not_counted:,} points was not evaluated."] if summary.not_counted else []
    if not summary.failed:
        sentences.append("No other point failed." if summary.not_counted else "No point failed.")
    points = []
    for variable, status, laws, index in summary.first_failed:
        axes = [dim for dim in dataset[variable].dims if dim not in LAW_DIMS]
        point = dataset.isel(dict(zip((*LAW_DIMS[: len(laws)], *axes), (*laws, *index), strict=True)))
        keys = [str(point[dim].item()) for dim in LAW_DIMS[: len(laws)]]
        inputs = [name for name in varying_inputs(dataset) if InputName.parse(name).applies_to(*keys)]
        points.append((law_name(*keys), at_text(point, inputs) or "–", status.meaning))
    more = summary.failed - len(points)
    return {"sentences": sentences, "points": points, "more": f"{more:,}" if more > 0 else ""}


def _facts(dataset: xr.Dataset) -> list[tuple[str, str]]:
    """List what a result was computed with, its fingerprint and its seal."""
    attributes, settings = dataset.attrs, ("rtol", "max_steps")
    packages = read_attribute(attributes, "packages")
    facts = {
        "program": f"impact {attributes.get('impact_version', '')}",
        "packages": ", ".join(f"{name} {version}" for name, version in packages.items()),
        "solver": ", ".join(f"{name} {number(attributes[name])}" for name in settings if name in attributes),
        **{name: attributes.get(name, "") for name in ("integrator", "core", "fingerprint")},
        "seal": dataset.encoding.get("seal") or "",
        "reason": attributes.get("reason", ""),
        **{
            f"plug-in {key}": ", ".join(f"{name} {text}" for name, text in plugin if text is not None)
            for key, plugin in read_attribute(dataset.attrs, "plugins").items()
        },
    }
    return [(name, str(fact)) for name, fact in facts.items() if fact]


def _model_section(model_data: xr.Dataset) -> dict[str, Any]:
    """Describe a model: its reference, and its domain and evidence from the catalogue."""
    texts = {name: str(model_data[name].item()) for name in ("model", *MODEL_METADATA)}
    key, doi = texts["model"], texts["doi"]
    declaration = catalogue().get(key)
    # a plug-in, or another version of the program, may use this key for another law
    declaration = declaration if declaration is not None and declaration.equation == texts["equation"] else None
    is_doi = re.fullmatch(r"10\.[0-9]{4,}/\S+", doi)
    return {
        **texts,
        "key": key,
        "title": with_year(texts["title"], texts["year"]),
        "link": f"https://doi.org/{quote(doi, safe='/', errors='replace')}" if is_doi else "",
        "domain": declaration.domain_text if declaration else "",
        "evidence": [_evidence_row(key, declaration.evidence)] if declaration else [],
    }
