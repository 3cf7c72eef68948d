"""Texts of a picture: symbols of variables in italics, labels of axes, names of laws, conditions."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.mathtext import MathTextParser
from matplotlib.ticker import Formatter, FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from ..config.input_names import InputName
from ..contact.frictions import frictions
from ..contact.models import catalogue
from ..contact.status import FrictionStatus
from ..contact.variables import HISTORY, OUTPUTS
from ..errors import UsageError
from ..formatting import (
    NO_BREAK,
    WITH,
    argument,
    law_keys,
    law_name,
    safe_text,
    scaled_unit,
    typographic,
    with_year,
)
from ..results.schema import is_case
from .slices import Inputs, parameter_text, scalars_of
from .style import SOFT, tint

# not a point in the version of a code: since 2.1, v0.6, 3.8.0, 2022.01a
DECIMAL_POINT = r"(?<!\bsince )(?<!\bv)(?<![\d.])(\d+)\.(?=\d+(?!\.?\d|a\b))"
GREEK = "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|kappa|lambda|mu|nu|xi|rho|sigma|tau|phi|chi|psi|omega"
# symbols of the paper for names that are words; v_post and abs_e_error are each a label of several variables
MATH_SYMBOLS = {
    **{name: variable.symbol for name, variable in (OUTPUTS | HISTORY).items() if variable.symbol},
    "abs_e_error": r"|e_\mathrm{out}-e|",
    "v_post": "v_i^+",
    "dt": r"h",
    "phase": "s",
    "angle": r"\theta",
    "inertia_factor1": "q_1",
    "inertia_factor2": "q_2",
}
# more than two names at the beginning of a title
THREE_AUTHORS = r"^([\w-]+)(?:, [A-Z][\w-]+)+ and [A-Z][\w-]+"
# name of the impulse-momentum solution in the paper
REFERENCE = "Impulse-momentum"
# end of the name of a pair whose curve is far from what a code with fixed steps delivers
SLOW_LIMIT = ", limit of small steps"
# a logarithmic axis that leaves this range has powers of ten
MIN_PLAIN, MAX_PLAIN = 5e-3, 1e5
# distances of ticks of angles [deg], of which the first with a suitable number of ticks is used
ANGLE_STEPS, MIN_ANGLES, MAX_ANGLES = (5, 15, 30, 45, 90), 1, 8


@cache
def symbol(name: str) -> str:
    r"""Write a variable as mathtext; empty if its name is not a letter.

    >>> symbol("v1"), symbol("e_out"), symbol("tau_c"), symbol("contact_time"), symbol("steel.nu")
    ('$v_1$', '$e_\\mathrm{out}$', '$\\tau_c$', '', '$\\nu$')
    """
    name = InputName.parse(name).key
    if name in MATH_SYMBOLS:
        return f"${MATH_SYMBOLS[name]}$"
    parts = re.fullmatch(rf"({GREEK}|[A-Za-z])_?([A-Za-z]?|[0-9]*)", name)
    if parts is None:
        return ""
    letter = parts[1] if len(parts[1]) == 1 else rf"\{parts[1]}"
    return f"${letter}_{parts[2]}$" if parts[2] else f"${letter}$"


def escape_mathtext(text: str) -> str:
    """Escape text of a file or a user so that matplotlib shows it unchanged."""
    return text.replace("$", r"\$")


def check_labels(labels: Mapping[str, str], shown: Collection[str]) -> None:
    """Raise a UsageError if a label is for a name that is not shown, or is not valid mathtext."""
    for key, text in labels.items():
        if key not in shown:
            known = ", ".join(sorted(shown))
            raise UsageError(f'{argument("labels")}: nothing in the picture is called "{key}"; known: {known}')
        try:
            MathTextParser("path").parse(text)
        except ValueError as error:
            reason = str(error).strip().splitlines()[-1]
            raise UsageError(f"{argument('labels', {key: text})}: is not valid mathtext: {reason}") from None


def axis_text(meaning: str, name: str, unit: str, labels: Mapping[str, str]) -> str:
    """Write the label of an axis: words, symbol and unit, of which the last two stay together."""
    if name in labels:
        meaning, letter = labels[name], ""
    else:
        meaning, letter = escape_mathtext(meaning[:1].upper() + meaning[1:]), symbol(name)
    shown = f"({pretty(unit)})" if unit not in ("", "1") else ""
    return " ".join(filter(None, (meaning, NO_BREAK.join(filter(None, (letter, shown))))))


def words_of(attributes: Mapping[object, object], name: str) -> str:
    """Read the meaning of a variable in words, up to a semicolon."""
    return safe_text(str(attributes.get("long_name") or name).partition(";")[0])


def pretty(text: str) -> str:
    r"""Write units and numbers in print notation.

    >>> pretty("6e+09 N/m^1.5")
    '6·10⁹ N/m$^{1.5}$'
    """
    text = re.sub(
        r"(?<![\w.])-?\d+(?:\.\d+)?e[+-]\d+", lambda match: typographic(float(match[0])), escape_mathtext(text)
    )
    return re.sub(r"\^(-?[\d.]+|\([^)]*\))", r"$^{\1}$", text)


def pretty_conditions(text: str) -> str:
    """Write conditions with their symbols in italics; a property is that of its material, a parameter of its law.

    >>> pretty_conditions(f"kelvin-voigt.K{NO_BREAK}={NO_BREAK}1").replace(NO_BREAK, " ")
    '$K$ of kelvin-voigt = 1'
    """

    def shown(name: re.Match[str]) -> str:
        owner = InputName.parse(name[1]).owner
        return (symbol(name[1]) or name[1]) + (f"{NO_BREAK}of{NO_BREAK}{owner}" if owner else "")

    text = pretty(text).replace(f"={NO_BREAK}-", f"={NO_BREAK}−")
    return re.sub(rf"([A-Za-z][\w.-]*)(?={NO_BREAK}={NO_BREAK})", shown, text)


def law_text(title: str, year: int, equation: str, parameters: str, *, numbered: bool) -> str:
    """Write the name of a law: title, year, its parameters, and if `numbered` its equation in the paper."""
    number = re.search(r"\(\d+\)(?:-\(\d+\))?$", equation) if numbered else None
    name = safe_text(with_year(title, year), 80)
    return ", ".join(filter(None, (name, number[0] if number else "", parameters)))


def model_label(model_data: xr.Dataset, *, numbered: bool = False) -> str:
    """Write the title of a model of a result, with the values of its parameters."""
    title, year, equation = (model_data[name].values.item() for name in ("title", "year", "equation"))
    inputs = scalars_of(model_data)
    if "exponent" in model_data.coords and model_data["exponent"].ndim == 0:
        inputs["n"] = float(model_data["exponent"].values.item()), "1"
    parameters = parameter_text(str(model_data["model"].values.item()), inputs)
    return law_text(str(title), int(year), str(equation), parameters, numbered=numbered)


def legend_labels(laws: Collection[str], legend: str) -> dict[str, str]:
    """Name laws by their keys, or by the first author and year without parameters; full names are not changed.

    A single model is not named beside every friction law.

    >>> legend_labels(["flores-2011 with coulomb-1785"], "short")
    {'flores-2011 with coulomb-1785': 'Coulomb (1785)'}
    >>> legend_labels(["flores-2011 with coulomb-1785", "hertz with coulomb-1785"], "short").popitem()
    ('hertz with coulomb-1785', 'Hertz (1882) with Coulomb (1785)')
    """
    if legend not in ("keys", "short"):
        return {}
    keys = {law: law_keys(law) for law in laws}
    if len({model for model, *_ in keys.values()}) == 1:
        keys = {law: friction or [model] for law, (model, *friction) in keys.items()}

    def short(key: str) -> str:
        law = catalogue().get(key) or frictions().get(key)
        # a plug-in is not in the catalogue
        return key if law is None else re.sub(THREE_AUTHORS, r"\1 et al.", with_year(law.title, law.year))

    write = str if legend == "keys" else short
    return {law: escape_mathtext(safe_text(law_name(*map(write, parts)), 80)) for law, parts in keys.items()}


def parameters_in(label: str) -> list[str]:
    """Find the parameters in the label of a model or a pair, whose spaces do not break."""
    words = label.replace(WITH, ", ").split(", ")
    return [word for word in words if f"{NO_BREAK}={NO_BREAK}" in word]


def parameters_of_laws(laws: Mapping[str, str], names: Mapping[str, str]) -> str:
    """Write the parameters in the labels of laws, for a picture with other names that lack them.

    >>> labels = {"kuwabara-kono-1987": f"Kuwabara and Kono (1987), A{NO_BREAK}={NO_BREAK}10 µs", "hertz": "Hertz"}
    >>> parameters_of_laws(labels, {}).replace(NO_BREAK, " ")
    '$A$ = 10 µs of kuwabara-kono-1987'
    """
    owners: dict[str, dict[str, None]] = {}
    for pair, label in laws.items():
        keys = law_keys(pair)
        parts = label.rsplit(WITH, len(keys) - 1)
        # the label of a pair may lack its model, which then is in the conditions
        for law, part in zip(keys[-len(parts) :], parts, strict=True):
            parameters = " and ".join(parameters_in(part))
            name = names.get(law, escape_mathtext(law))
            owners.setdefault(pretty_conditions(parameters), {})[name] = None
    return ", ".join(
        text if len(owners) == 1 else f"{text} of {' and '.join(of)}" for text, of in owners.items() if text
    )


@dataclass(frozen=True)
class NamedLaw:
    """A law of a picture: its label, and the keys of the model, None for a reference, and of the friction law."""

    label: str
    model: str | None = None
    # not a field, since the fields of subclasses have an order in JSON
    friction = ""

    @property
    def law(self) -> str:
        """The key of its model or pair, see `impact.formatting.law_name`; empty for a reference."""
        return law_name(self.model or "", self.friction)

    @property
    def columns(self) -> dict[str, str]:
        """Both keys, for a table."""
        return {"model": self.model or "", "friction": self.friction}


@dataclass(frozen=True, kw_only=True)
class LawPart(NamedLaw):
    """What a result has for one model, or for one pair."""

    data: xr.Dataset
    friction: str = ""


def mark_slow_limit(pair: LawPart) -> LawPart:
    """Mark the name of a pair with a point that a code with fixed steps reaches slowly."""
    # outputs without friction are those of a model alone
    has_status = pair.friction and "friction_status" in pair.data
    is_slow = has_status and (pair.data["friction_status"] == FrictionStatus.SLOW_LIMIT).any()
    return replace(pair, label=pair.label + SLOW_LIMIT) if is_slow else pair


def split_by_law(data: xr.Dataset, *, numbered: bool) -> Iterator[LawPart]:
    """Split a part of a result at its models, and at its friction laws where it has that dimension."""
    has_frictions = "friction" in data.dims
    # the pairs of a calibration are along the dimension of models, and have the keys of both in one
    has_pairs = "friction" in data.coords and data["friction"].dims == ("model",)
    for index in range(data.sizes["model"]):
        of_model = data.isel(model=index)
        key, label = str(of_model.variables["model"].values.item()), model_label(of_model, numbered=numbered)
        parts = [of_model.isel(friction=i) for i in range(data.sizes["friction"])] if has_frictions else [of_model]
        for part in parts:
            friction = str(part.variables["friction"].values.item()) if has_frictions or has_pairs else ""
            # a single model is not named beside every friction law
            model = "" if has_frictions and data.sizes["model"] == 1 else label
            parameters = scalars_of(part, f"friction.{friction}.")
            shown = law_name(model, friction_text(friction, parameters) if friction else "")
            yield LawPart(shown, key, data=part, friction=friction if has_frictions else "")


def with_model(conditions: str, data: xr.Dataset, *, numbered: bool) -> str:
    """Name the single model of pairs in the conditions, since the names of `split_by_law` do not have it.

    Without friction, name that in a cone, which changes the normal motion.
    """
    if "friction" in data.dims:
        laws = [model_label(data.isel(model=0), numbered=numbered)] if data.sizes["model"] == 1 else []
    else:
        keys = dict.fromkeys(InputName.parse(name).friction for name in data.coords)
        cones = [key for key in keys if key in frictions() and frictions()[key].kind == "cone"]
        laws = [friction_text(key, scalars_of(data, f"friction.{key}.")) for key in cones]
    return ", ".join(filter(None, (*laws, conditions)))


def friction_text(key: str, inputs: Inputs) -> str:
    """Write the title of a friction law, with those of its parameters that differ from their defaults.

    >>> inputs = {"friction.lammps-mindlin.xt": (0.5, "1"), "friction.lammps-mindlin.limit": (1.0, "1")}
    >>> friction_text("lammps-mindlin", inputs).replace(NO_BREAK, " ")
    'LAMMPS mindlin, xt = 0.5, limit = positive'
    """
    law = frictions().get(key)
    if law is None:
        return safe_text(key, 80)
    chosen: dict[str, tuple[object, str]] = {}
    for parameter in law.parameters:
        name = f"friction.{key}.{parameter.name}"
        # a result has the position of a word, a time history the word
        words: dict[object, object] = dict(enumerate(parameter.choices))
        stored, unit = inputs.get(name, (None, ""))
        value, default = (words.get(each, each) for each in (stored, parameter.default))
        if value not in (None, default):
            chosen[name] = value, unit
    return ", ".join(filter(None, (law.title, parameter_text(f"friction.{key}", chosen))))


def annotate_right_edge(axes: Axes, text: str, y: float, dx: float, dy: float = 0.0, **style: Any) -> None:
    """Write a text at the right edge of axes, at y in data unless `xycoords` is given, and an offset in points."""
    place = {"xycoords": ("axes fraction", "data"), "va": "center", "fontsize": "x-small", "color": tint(SOFT)}
    axes.annotate(text, (1.0, y), (dx, dy), textcoords="offset points", **(place | style))


def label_axis(
    axis: Axis, text: str, name: str, unit: str, labels: Mapping[str, str], log: bool, values: Sequence[float] = ()
) -> None:
    """Write the label of an axis, and its numbers with the prefix of the unit for the largest value, or limit."""
    largest = max(map(abs, values or axis.get_view_interval()))
    size, scaled = (1.0, unit) if log else scaled_unit(unit, largest)
    axis.set_label_text(axis_text(text, name, scaled, labels))
    if words := InputName.parse(name).words:
        axis.set_ticks(range(len(words)), words)
    else:
        number_axis(axis, size, log=log, whole=is_whole(name))


def is_whole(name: str) -> bool:
    """Whether the values of an axis are numbers of measured values or of cases."""
    return name == "point" or is_case(name)


def number_axis(axis: Axis, size: float = 1.0, *, log: bool = False, whole: bool = False) -> None:
    """Write the numbers of an axis, in multiples of `size`; logarithmic ones are few, and never between powers."""
    low, high = sorted(axis.get_view_interval())
    # one style for all numbers of an axis
    powers = log and not (low >= MIN_PLAIN and high < MAX_PLAIN)
    # a function of a module, so that a figure can be pickled
    axis.set_major_formatter(FuncFormatter(partial(_tick_text, size=size, powers=powers)))
    if log:
        narrow = (1.0, 2.0, 5.0) if high < 1e2 * low else (1.0, 3.0)
        axis.set_major_locator(LogLocator(subs=narrow if high < 1e3 * low else (1.0,)))
        axis.set_minor_formatter(NullFormatter())
    else:
        locator = DegreeLocator if size == math.radians(1.0) else MaxNLocator
        steps, least = ([1, 2, 5, 10], 2) if whole else ([1, 2, 2.5, 5, 10], 3)
        axis.set_major_locator(locator("auto", steps=steps, min_n_ticks=least, integer=whole))


def _tick_text(value: float, position: int, *, size: float, powers: bool) -> str:
    return typographic(value / size, powers=powers)


def with_comma(text: str) -> str:
    r"""Write the numbers of a text with decimal commas; exponents in mathtext need no space after the comma.

    The version of a code, as in the names of laws, keeps its points.

    >>> with_comma("e = 0.5, n = 1.5"), with_comma("N/m$^{1.5}$")
    ('e = 0,5, n = 1,5', 'N/m$^{1{,}5}$')
    >>> with_comma("δ^0.65 (since 2.1, v0.6 to 2022.01a)")
    'δ^0,65 (since 2.1, v0.6 to 2022.01a)'
    >>> with_comma(f"normal(1,{NO_BREAK}0.1)").replace(NO_BREAK, " ")
    'normal(1; 0,1)'
    """
    # numbers of a list, such as those of a distribution, which have a comma between them
    text = re.sub(rf"(?<=[\d⁰¹²³⁴⁵⁶⁷⁸⁹]),(?={NO_BREAK}[\d−-])", ";", text)
    parts = text.split("$")
    commas = (",", "{,}")
    return "$".join(re.sub(DECIMAL_POINT, rf"\1{commas[index % 2]}", part) for index, part in enumerate(parts))


def tick_with_comma(formatter: Formatter, value: float, position: int) -> str:
    """Write the number of a tick with a decimal comma."""
    return with_comma(formatter(value, position))


class DegreeLocator(MaxNLocator):
    """Places the ticks of an axis in rad at round numbers of degrees, such as multiples of 15."""

    def tick_values(self, vmin: float, vmax: float) -> Any:
        low, high = math.degrees(vmin), math.degrees(vmax)
        # as many as fit beside each other: the numbers have two digits
        most = min(max(MIN_ANGLES, 1.5 * self.axis.get_tick_space()), MAX_ANGLES) if self.axis else MAX_ANGLES
        step = next((step for step in ANGLE_STEPS if MIN_ANGLES <= (high - low) / step <= most), None)
        if step is None:
            return np.radians(super().tick_values(low, high))
        return np.radians(np.arange(math.ceil(low / step), math.floor(high / step) + 1) * step)
