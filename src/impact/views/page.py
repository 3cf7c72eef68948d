"""A result as one page of HTML: it needs no network, runs nothing, and shows what a file says as text only."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any
from urllib.parse import quote
from xml.etree import ElementTree

import matplotlib
import numpy as np
from numpy.typing import NDArray

from ..contact.models import catalogue
from ..contact.status import FIRST_FAILURE, Status
from ..data.align import is_input
from ..data.attributes import json_object, json_table
from ..data.ranking import Ranked, ranking
from ..data.replay import own
from ..data.results import plain_unit
from ..data.tally import Tally, tally_of
from ..errors import ImpactError, UsageError
from ..sweeps.rules import MATERIAL
from ..text import safe_text
from .kinds import Choice, Numbers, draw
from .look import METADATA, STYLE
from .names import WIDTHS

if TYPE_CHECKING:
    import xarray as xr

# nothing is fetched and nothing is run, whatever should get into the page
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
CSS = files(__package__) / "page.css"
# of more than MANY models the figures show the BEST; at most so many failed points, values and letters are shown
MANY, BEST, FAILED, VALUES, LETTERS = 12, 8, 20, 8, 2000
# elements after which the line goes on
INLINE = frozenset({"a", "code", "span", "td", "th"})
# the figures, and what each shows
FIGURES = {
    "final-velocities": "Velocities after the impact, beside the impulse-momentum solution.",
    "restitution": "Restitution delivered, beside what was asked for.",
    "error": "Error of the restitution: signed above, absolute below.",
    "map": "Error of the restitution over two axes, a panel for each model.",
    "validity": "Which model is closest to what was asked for, and how close it is.",
    "loop": "Force over indentation at one point: the area of a loop is the energy that is lost.",
}
PLANES = ("map", "validity")


class Markup(str):
    """Text that is HTML already; all other text is escaped when it gets into the page."""


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
    title, tally = str(dataset.attrs.get("title", "")) or "Impact of two balls", tally_of(dataset)
    keys, answer = _answer(dataset)
    sections = {
        "What was swept": _swept(dataset), "The answer": answer, "Figures": _figures(dataset, keys, figures),
        "Failed points": _failed(dataset, tally.failed), "How it was computed": _computed(dataset),
        "The models": _models(dataset), "The config": _config(dataset),
    }  # fmt: skip
    return "\n".join([
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        _tag("title", title) + _tag("style", Markup(CSS.read_text(encoding="utf-8"))),
        "</head>\n<body>",
        _tag("header", *_summary(dataset, title, tally)),
        _tag("main", *(_tag("section", _tag("h2", name), *parts) for name, parts in sections.items())),
        "</body>\n</html>\n",
    ])  # fmt: skip


def _summary(dataset: xr.Dataset, title: str, tally: Tally) -> Iterator[Markup]:
    """The title, what this is, and how the points ended."""
    models, axes = dataset.sizes["model"], [str(dim) for dim in dataset.sizes if dim != "model"]
    points, over = int(np.prod(list(dataset.sizes.values()))), f" over {', '.join(axes)}" if axes else ""
    yield _tag("h1", title)
    yield _tag("p", f"{models:,} model{_s(models)} of the impact of two balls{over}, judged by the "
               f"impulse-momentum solution: {points:,} point{_s(points)}.")  # fmt: skip
    ends = (f"{tally.counts[one]:,} {one.name.lower()}: {one.meaning}" for one in sorted(tally.counts))
    yield _tag("ul", *(_tag("li", end) for end in ends))


def _swept(dataset: xr.Dataset) -> Iterator[Markup]:
    """The axes, and what has a single value."""
    heads = ("axis", "meaning", "unit", "#from", "#to", "#values", "spacing")
    rows = [(name, *_about(dataset[name]), *_range(dataset[name])) for name in _columns(dataset)]
    yield _table("What was swept", heads, rows) if rows else _tag("p", "Nothing was varied but the model.")
    single = []
    for name, one in dataset.coords.items():
        if one.ndim == 0 and is_input(str(name)):
            meaning, unit = _about(one)
            single.append((str(name), f"{_shown(one.values.item())} {unit}".removesuffix(" –"), meaning))
    units = {key: one.unit.removesuffix("1") for key, one in MATERIAL.items()}
    for name, material in json_table(dataset, "materials").items():
        given = (f"{key} = {_shown(value)} {units.get(key, '')}".strip() for key, value in material.items()
                 if value is not None)  # fmt: skip
        single.append((name, ", ".join(given), "material"))
    if single:
        yield _tag("h3", "Single values")
        yield _table("Single values", ("name", "value", "meaning"), single)


def _columns(dataset: xr.Dataset) -> list[str]:
    """The inputs that vary: the axes, each with what varies along it, then what varies along several."""
    varying = {str(name): one.dims for name, one in dataset.coords.items()
               if one.ndim and "model" not in one.dims and is_input(str(name))}  # fmt: skip
    along = [name for dim in dataset.dims for name in (str(dim), *varying) if varying.get(name) == (dim,)]
    return list(dict.fromkeys([*along, *varying]))


def _about(coordinate: xr.DataArray) -> tuple[str, str]:
    """Meaning and unit of a coordinate."""
    meaning, unit = (str(coordinate.attrs.get(name, "")) for name in ("long_name", "units"))
    return meaning, plain_unit(unit) if unit not in ("", "1") else "–"


def _range(coordinate: xr.DataArray) -> tuple[str, str, str, str]:
    """From, to, how many, and how the values are spaced."""
    values, ends = coordinate.values.ravel(), ("–", "–")
    if values.dtype.kind == "f":
        ends = _shown(float(np.fmin.reduce(values))), _shown(float(np.fmax.reduce(values)))
    spacing = str(coordinate.attrs.get("equation", "")) or _spacing(values)
    if coordinate.name not in coordinate.dims:
        spacing = f"varies with {' and '.join(map(str, coordinate.dims))}: {spacing}"
    return *ends, f"{values.size:,}", spacing


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
        ranked = ranking(dataset)
    except UsageError as error:
        return keys, [_tag("p", f"The models are not ranked: {error}.")]
    rows = [
        (one.model, one.percent, _brief(one.mean_error), _brief(one.max_error), _served(one), f"{one.failed:,}")
        for one in ranked.models
    ]
    heads = ("model", f"#within {ranked.tol:g}", "#mean |e_error|", "#max |e_error|", "serves e", "#failed")
    return [one.model for one in ranked.models], [
        _tag("p", re.sub("^no ", "No ", f"{ranked.headline}."), class_="headline"),
        _table("Models, the best first", heads, rows),
        _tag("p", "e_error is e_out − e, at the points where an e was asked for and the balls meet. "
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


def _figures(dataset: xr.Dataset, keys: list[str], figures: Callable[[str, Choice], Numbers]) -> Iterator[Markup]:
    """The figures; of those that cannot be drawn, the reason."""
    if len(keys) > MANY:
        yield _tag("p", f"The figures show {BEST} of the {len(keys)} models: {', '.join(keys[:BEST])}.")
        shown = keys[:BEST]
    else:
        shown = [str(key) for key in dataset["model"].values]
    drawn, reasons = [], []
    for kind, choice in _choices(dataset, shown):
        try:
            drawn.append(_figure(kind, figures(kind, choice), str(dataset.attrs.get("title", ""))))
        except ImpactError as error:
            reason = "; ".join(str(error).splitlines())
            reasons.append(_tag("p", f"The figure {kind} is left out: {reason}"))
    yield _tag("div", *drawn, class_="figures")
    yield from reasons


def _choices(dataset: xr.Dataset, keys: list[str]) -> Iterator[tuple[str, Choice]]:
    """The figures of a result: over e, else the first axis of several numbers; the loop is at the middle of it."""
    along = {name: dataset[name] for name in _columns(dataset) if dataset[name].ndim == 1}
    along = {name: one for name, one in along.items() if one.dtype.kind == "f" and _different(one.values) > 1}
    x = "e" if "e" in along else next(iter(along), None)
    y = next((name for name in along if x and along[name].dims != along[x].dims), None)
    for kind in FIGURES:
        drawn = [along[name].dims[0] for name in ((x, y) if kind in PLANES else (x,)) if name]
        at = _answered(dataset, keys, drawn)
        if kind == "loop" and x:
            values, dim = along[x].values, str(drawn[0])
            at[dim] = dataset[dim].values[np.argsort(values, kind="stable")[values.size // 2]].item()
            # a parameter of one model is no input of the others
            at = {name: value for name, value in at.items() if "." not in name or len(keys) == 1}
        if y or kind not in PLANES:
            yield kind, Choice(None if kind == "loop" else x, y if kind in PLANES else None, sel=at, models=keys)


def _different(values: NDArray[Any]) -> int:
    return np.unique(values[np.isfinite(values)]).size


def _answered(dataset: xr.Dataset, keys: list[str], drawn: Sequence[Hashable]) -> dict[str, float | str]:
    """Values of the axes that are not drawn over: the first at which the balls meet and a model has an answer."""
    if "status" not in dataset:
        return {}
    status = dataset.sel(model=keys)["status"]
    found = ((status < FIRST_FAILURE) & (status != Status.NO_IMPACT)).any({"model", *drawn} & {*status.dims})
    places = np.unravel_index(int(np.argmax(found.values)), found.shape) if found.ndim else ()
    return {str(dim): dataset[dim].values[at].item() for dim, at in zip(found.dims, places, strict=True)}


def _figure(kind: str, numbers: Numbers, title: str) -> Markup:
    """A figure of the page, and what it shows in words, without the title of them all."""
    buffer = io.BytesIO()
    with matplotlib.rc_context(fname=str(STYLE)):
        # narrow, so that its text is legible on a phone; a wider page has two beside each other
        draw(numbers, WIDTHS["single"]).savefig(buffer, format="svg", metadata=METADATA["svg"])
    conditions = numbers.conditions.removeprefix(f"{safe_text(title, 140)}: ")
    told = [FIGURES[kind], *([f"At {conditions}."] if conditions else [])]
    told += [f"Not drawn: {'; '.join(numbers.not_drawn)}."] if numbers.not_drawn else []
    return _tag("figure", _inline(buffer.getvalue(), kind), _tag("figcaption", " ".join(told)))


def _inline(svg: bytes, kind: str) -> Markup:
    """A picture as an element of a page that has others: its ids are its own, and it has no style for all."""
    root = ElementTree.fromstring(svg)
    for node in list(root.iter()):
        node.tag = node.tag.rpartition("}")[2]
        node[:] = [inner for inner in node if not inner.tag.endswith(("}metadata", "}style"))]
        for name in list(node.attrib):
            plain, value = name.rpartition("}")[2], node.attrib.pop(name)
            refers = {"id": "^", "href": "^#"}.get(plain, r"(?<=url\()#")
            node.attrib[plain] = re.sub(refers, f"{'' if plain == 'id' else '#'}{kind}-", value)
    root.attrib = {"viewBox": root.attrib["viewBox"], "role": "img", "aria-label": FIGURES[kind]}
    return Markup(ElementTree.tostring(root, encoding="unicode"))


def _failed(dataset: xr.Dataset, failed: int) -> Iterator[Markup]:
    """The first points that failed, and how many more there are."""
    if not failed:
        yield _tag(
            "p", "No point failed." if "status" in dataset else "The result does not tell which points failed."
        )
        return
    rows: list[tuple[str, str, str]] = []
    columns = [name for name in _columns(dataset) if {*dataset[name].dims} <= {*dataset["status"].dims}]
    for model in range(dataset.sizes["model"]):
        status = dataset.isel(model=model)["status"]
        for places in np.argwhere(status.values >= FIRST_FAILURE)[: FAILED - len(rows)].tolist():
            point = status.isel(dict(zip(status.dims, places, strict=True)))
            at = own({"model": point["model"].item(), **{name: point[name].item() for name in columns}})
            where = ", ".join(f"{name}\u00a0=\u00a0{_shown(at[name])}" for name in at if name != "model")
            rows.append((at["model"], where or "–", Status(int(point.item())).meaning))
    yield _table("Failed points", ("model", "where", "why"), rows)
    if failed > len(rows):
        yield _tag("p", f"and {failed - len(rows):,} more")


def _computed(dataset: xr.Dataset) -> Iterator[Markup]:
    """By which program and settings, and what tells this result from others."""
    attributes, settings = dataset.attrs, ("rtol", "max_steps")
    facts = {
        "program": f"impact {attributes.get('impact_version', '')}",
        "packages": ", ".join(f"{name} {one}" for name, one in json_object(dataset, "packages").items()),
        "solver": ", ".join(f"{name} {attributes[name]:g}" for name in settings if name in attributes),
        "core": attributes.get("core", ""),
        "fingerprint": attributes.get("fingerprint", ""),
        "content digest": attributes.get("content_digest", ""),
        "reason": attributes.get("reason", ""),
        **{f"plug-in {key}": ", ".join(f"{name} {text}" for name, text in one.items() if text is not None)
           for key, one in json_table(dataset, "plugins").items()},
    }  # fmt: skip
    yield _table("How it was computed", (), [fact for fact in facts.items() if fact[1]])


def _models(dataset: xr.Dataset) -> Iterator[Markup]:
    """Where each model comes from, and what the catalogue knows of it."""
    for place in range(dataset.sizes["model"]):
        one = dataset.isel(model=place)
        key, title, year, equation, reference, doi = (
            str(one[name].item()) for name in ("model", "title", "year", "equation", "reference", "doi")
        )
        about = [_tag("p", equation), _tag("p", reference, " ", _doi(doi))]
        known = catalogue().get(key)
        # a plug-in, or another version of the program, may mean another law by this name
        if known is not None and known.equation == equation:
            about += [_tag("p", f"Claimed for {known.domain_text}.")] if known.domain_text else []
            about += [_tag("p", f"Evidence: {known.evidence}", class_="soft")] if known.evidence else []
        yield _tag("article", _tag("h3", f"{title} ({year}) ", _tag("span", key, class_="soft")), *about)


def _doi(doi: str) -> str:
    """A link to a publication, of what is a DOI; text of what is not."""
    if not re.fullmatch(r"10\.[0-9]{4,}/\S+", doi):
        return doi
    return _tag("a", doi, href=f"https://doi.org/{quote(doi, safe='/', errors='replace')}", rel="noreferrer")


def _config(dataset: xr.Dataset) -> Iterator[Markup]:
    """The config, line by line as it was, and what was changed in it."""
    changes = json.loads(str(dataset.attrs.get("config_set", "[]")))
    lines = str(dataset.attrs.get("config", "")).replace("\r\n", "\n").expandtabs(4).split("\n")
    yield _tag("pre", Markup("\n".join(escape(safe_text(line, 100_000)) for line in lines)))
    if changes:
        yield _tag("p", "Changed by:")
        yield _tag("ul", *(_tag("li", _tag("code", f"--set {one}")) for one in changes))


def _table(label: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Markup:
    """A table whose first column names its rows; a column of numbers has a # before its heading."""
    columns = [(head.removeprefix("#"), {"class_": "number"} if head.startswith("#") else {}) for head in heads]
    lines = []
    for first, *others in rows:
        cells = [_tag("td", cell, data_head=name, **look)
                 for cell, (name, look) in zip(others, columns[1:] or [("", {})], strict=True)]  # fmt: skip
        lines.append(_tag("tr", _tag("th", first, scope="row"), *cells))
    top = _tag("thead", _tag("tr", *(_tag("th", name, scope="col", **look) for name, look in columns)))
    table = _tag("table", *([top] if heads else []), _tag("tbody", *lines))
    # on a narrow screen each row is a card
    return _tag(
        "div", table, class_="scroll cards" if heads else "scroll", tabindex="0", role="region", aria_label=label
    )


def _tag(name: str, *inside: str, **attributes: str) -> Markup:
    """An element; what is inside it and its attributes are escaped unless they are markup.

    >>> _tag("span", "a < b", class_="soft")
    '<span class="soft">a &lt; b</span>'
    """
    words = "".join(f' {key.rstrip("_").replace("_", "-")}="{_escaped(one)}"' for key, one in attributes.items())
    end = "" if name in INLINE else "\n"
    return Markup(f"<{name}{words}>{''.join(map(_escaped, inside))}</{name}>{end}")


def _escaped(text: str) -> str:
    return text if isinstance(text, Markup) else escape(safe_text(text, LETTERS))


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
