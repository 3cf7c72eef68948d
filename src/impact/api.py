"""The Python interface; each command of the command line calls a function of this module."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from .atomic import check_outputs, write_file
from .comparison.bless import bless as bless
from .comparison.compare import compare as compare
from .comparison.verdict import Verdict as Verdict
from .config.library import records
from .config.load import json_schema

# a name imported "as itself" is public, see `impact.__all__`
from .contact.evidence import Evidence as Evidence
from .contact.model import ForceModel as ForceModel, Parameter as Parameter
from .contact.models import catalogue
from .contact.models.hysteresis import hysteresis as hysteresis
from .contact.powers import power as power
from .engine.plan import Plan
from .engine.plugins import read_plugins
from .errors import ImpactError as ImpactError, UsageError, did_you_mean
from .results.single_impact import STARTER_CONFIG, Impact as Impact, histories, run_single_impact, single_point
from .results.xarray_backend import load as load, save as save
from .text import html_table, safe_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from ipywidgets import VBox
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .contact.checks import Finding
    from .exporters.export import Export
    from .plots.kinds import Choice, PlotData


class PlotFiles(NamedTuple):
    """Pictures in files and their data, by kind, and the reason why a kind was left out."""

    pictures: dict[str, Path]
    plot_data: dict[str, PlotData]
    left_out: dict[str, str]


def run(
    source: str | Path | Mapping[str, object] | None = None,
    *,
    model: str | None = None,
    at: Mapping[str, float | str] | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    times: int | None = None,
) -> Impact:
    """Run one impact and record its time history.

    Parameters
    ----------
    source : a TOML file, a mapping, or a result; by default the two balls of Table 1 of the paper, at e = 0.5
    model : key of the model; by default the first one of the source
    at : values by config name, such as `{"e": 0.05}`; the default of an axis is its first value
    overrides : changes to the config, such as `"sweep.m2=2"`
    plugins : plug-in models, and paths of Python files with such models; a result that was computed with them
        needs them again, and a changed one gives a warning with both hashes
    times : number of points of the history, uniform from first contact to release; by default the steps of the
        integrator

    Raises
    ------
    ConfigError, UsageError, ModelError, ResultError : the source, a plug-in, a name or a value is invalid

    >>> import impact
    >>> shot = impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.5})
    >>> round(shot.values["e_out"], 6), round(shot.e_energetic, 6)
    (0.41072, 0.41072)
    """
    if times is not None and times < 2:
        raise UsageError(f"times: got {times}, expected a whole number >= 2")
    plugin_set = read_plugins(plugins)
    config, first = single_point(source, overrides, plugin_set, model, at)
    return run_single_impact(Plan(config, plugin_set.of(config.models)), first, times)


def export(
    to: str,
    model: str | None = None,
    *,
    source: str | Path | Mapping[str, object] | None = None,
    at: Mapping[str, float | str] | None = None,
    dt: float | None = None,
    code_version: str | None = None,
    script: bool = False,
    verify: bool = False,
    program: str | None = None,
    output: str | Path | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] = (),
) -> Export:
    """Write a law as a code takes it, with the restitution that the code delivers at its time step.

    Parameters
    ----------
    to : name of the code, see `export_codes`
    model : a law that the code has, by its key; by default the first one of the source, or without a source the
        first one of `export_codes`, that the release of the code has
    source, overrides : see `solve`
    at : values of inputs by config name; an e for a law that takes none is reached by its damping parameter
    dt : time step [s]; by default the contact time of the continuous law over 50
    code_version : release of the code, letters, digits, spaces and `._+()-`; by default that of the program, or
        else the newest known one
    script : write a complete input with two balls that prints the e that it measures
    verify : run such inputs at four phases, and compare their e with the prediction
    program : what runs scripts, such as the file of lmp, or of a Python with the code's package; by default found
    output : file to write the lines or the script to
    overwrite : replace the output if it exists

    Returns
    -------
    Export : parameters, lines, script and what the code delivers; `text` is what is written to `output`

    Raises
    ------
    UsageError : the code or the law is unknown, no damping gives the e, the code is not installed, or the output
        exists
    ConfigError : see `sweep`

    What LAMMPS takes for a restitution of 0.6:

    >>> import impact
    >>> law, at = "lammps-coeff-restitution-hooke", {"e": 0.6, "K": 1e6}
    >>> export = impact.export("lammps", law, at=at, code_version="22Jul2025")
    >>> export.lines[1]
    'pair_coeff      * * hooke 1000000.0 0.6 damping coeff_restitution tangential linear_nohistory 0.0 0.0'
    >>> round(export.at_dt.e_mean, 4)
    0.5985
    """
    # its modules import scipy.optimize, which other functions do without
    from .exporters.codes import find_code
    from .exporters.export import write_export
    from .exporters.problem import prepare_export
    from .exporters.verify import choose_version

    # before a program is run
    check_outputs([output], [source], overwrite=overwrite)
    code = find_code(to)
    found, version = choose_version(code, program, code_version, verify=verify)
    problem = prepare_export(code, model, version, source, at or {}, overrides)
    check_outputs([output], [source, *problem.config.files], overwrite=overwrite)
    result = write_export(problem, dt, found if verify else None, with_script=script)
    if output is not None:
        write_file(Path(output), result.text.encode(), overwrite=overwrite)
    return result


def export_codes() -> list[dict[str, Any]]:
    """The codes to which laws are exported, each with its laws, by key of the catalogue.

    Returns
    -------
    list : for each code a dict of its name "code", "title", the "installed" and the "newest" known version,
        the "scheme" of its time step, what was "tested", and what it calls each of its "laws"

    >>> import impact
    >>> (mujoco,) = (code for code in impact.export_codes() if code["code"] == "mujoco")
    >>> mujoco["laws"]["mujoco-solref"]
    'solref, standard format'
    """
    from .exporters.codes import CODES
    from .exporters.verify import installed_version

    return [
        {
            "code": code.name,
            "title": code.title,
            "installed": installed_version(code),
            "newest": code.newest,
            "scheme": code.scheme,
            "tested": code.tested,
            "laws": dict(code.laws),
        }
        for code in CODES.values()
    ]


class Models(dict[str, ForceModel]):
    """Models by key, which a notebook shows as a table."""

    def __repr__(self) -> str:
        return f"{len(self)} models: {', '.join(self)}"

    def _repr_html_(self) -> str:
        rows = (
            (key, model.family, model.equation, ", ".join(p.name for p in model.parameters), model.domain_text)
            for key, model in self.items()
        )
        return html_table(("model", "family", "equation", "parameters", "stated domain"), rows)


def models(
    plugins: Sequence[ForceModel | str | Path] = (),
    *,
    pattern: str = "*",
    family: str | None = None,
    search: str | None = None,
) -> Models:
    """The catalogue of contact force models, by key, or a part of it.

    Parameters
    ----------
    plugins : plug-in models, and paths of Python files with such models, which come last
    pattern : pattern of the keys, such as "lammps-*", or a family as in a config, such as "family:hysteresis"
    family : name of the family; by default all families
    search : words that all have to occur in the key, title, year, equation, reference or DOI, in any case

    Raises
    ------
    UsageError : no model matches the pattern or the words, or there is no such family
    ModelError : a plug-in cannot be read or is invalid

    >>> import impact
    >>> impact.models()["gharib-hurmuzlu-2012"].equation
    'F = K δⁿ (1 + χ δ̇/v₀),  χ = 1/e  (28)'
    >>> list(impact.models(pattern="lankarani-*"))
    ['lankarani-nikravesh-1990', 'lankarani-nikravesh-1994']
    """
    all_models = catalogue(read_plugins(plugins).models)
    families = sorted({model.family for model in all_models.values()})
    if pattern.startswith("family:"):
        pattern, family = "*", pattern.removeprefix("family:")
    if family is not None and family not in families:
        raise UsageError(f'--family: no family "{safe_text(family)}"; {did_you_mean(family, families)}')
    of_family = {key: model for key, model in all_models.items() if family in (None, model.family)}
    matching = {key: model for key, model in of_family.items() if fnmatchcase(key, pattern)}
    if not matching:
        raise UsageError(
            f'no model matches "{safe_text(pattern)}"; {did_you_mean(pattern.strip("*?"), list(of_family))}'
        )
    if search is not None:
        words = search.casefold().split()
        matching = {key: model for key, model in matching.items() if _contains(model, words)}
        if not matching:
            raise UsageError(
                f'--search: no model has "{safe_text(search, 60)}" in its title, equation or reference'
            )
    return Models(matching)


def _contains(model: ForceModel, words: Sequence[str]) -> bool:
    """Whether all words occur in what is written about a model."""
    about = (model.key, model.family, model.title, str(model.year), model.equation, model.reference, model.doi)
    text = " ".join(about).casefold()
    return all(word in text for word in words)


def check_model(model: ForceModel) -> list[Finding]:
    """Check a model, such as a plug-in, against every clause of the contract, with forty dissimilar impacts.

    Returns
    -------
    list of Finding : the clause, the largest deviation, its bound, and whether the clause holds

    Warns
    -----
    UserWarning : a formula raised an error, with its file, line and text

    >>> import impact
    >>> all(finding.holds for finding in impact.check_model(impact.models()["bilinear"]))
    True
    """
    # its module integrates, which a program that only imports impact does without
    from .contact.checks import contract

    return list(contract(model))


def plot(
    dataset: xr.Dataset | Impact,
    *,
    kind: str | None = None,
    x: str | None = None,
    y: str | None = None,
    variable: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
    log: str = "",
    points: str | Path | pd.DataFrame | xr.Dataset | None = None,
    width: float | str | None = None,
    height: float | str | None = None,
    style: str | Path | None = None,
    title: bool = True,
    labels: Mapping[str, str] | None = None,
    equations: bool = False,
    ax: Axes | Sequence[Axes] | None = None,
    plugins: Sequence[ForceModel | str | Path] = (),
) -> Figure:
    """Draw a result; by default the final-velocity comparison, Figure 6 of the paper.

    Parameters
    ----------
    dataset : a result, a time history, or an impact of `run`
    kind : one of `impact.plots.kinds.KINDS`; by default "final-velocities", "uncertainty" for samples of uncertain
        inputs, "loop" for an impact, or "calibration" or "sensitivity" for the result of that function
    x : the coordinate to draw over; by default e, else the first numeric axis
    y : second axis of a map, or of the kind validity; by default the next one
    variable : name of the variable that a map or a band shows; by default e_error for a map, e_out for a band
    sel : values of the other axes, such as `{"m2": 1.0}`; the default is the first value. A loop, a history
        or an impulse may be at a point that is not on the grid
    models : keys of the models to show; by default all
    log : which axes are logarithmic, such as "x" or "xy"; axes with logarithmic spacing are in any case
    points : measured points over the curves: a CSV file, or a table of pandas or xarray, whose columns have names
        such as "v1 [m/s]", "e_out" and "sigma"
    width : width of the figure [in], or a length such as "84mm", "single" or "double"; by default that of rcParams
        if it was changed, else "double"
    height : height of the figure [in], or a length; by default it depends on the kind
    style : a style sheet of matplotlib, or the name of one; rcParams changed by the user are respected in any case
    title : write the title and the conditions
    labels : texts by the name of an axis, of a variable whose name is beside its curve, the key of a law,
        "reference" or "title"
    equations : name the laws with the numbers of their equations in the paper
    ax : axes of an existing figure to draw into, one for each panel, in the style of that figure
    plugins : plug-in models that the result was computed with, needed to draw a loop, a history or an impulse

    Returns
    -------
    matplotlib.figure.Figure : `figure.savefig("results.png")` writes it; a notebook shows it

    Raises
    ------
    UsageError : the result does not contain what the arguments select

    >>> import impact
    >>> figure = impact.plot(impact.sweep("configs/figure6.toml"))
    >>> figure.axes[0].get_xlabel()
    'Coefficient of restitution $e$'
    """
    from .plots.kinds import Choice, default_kind, draw

    if isinstance(dataset, Impact):
        if dataset.history is None:
            raise UsageError(f"no motion to draw: {dataset.why_no_history}")
        dataset = dataset.history
    choice = Choice(x, y, variable, sel, models, log, equations)
    plot_data = get_plot_data(dataset, kind or default_kind(dataset), choice, plugins)
    return draw(plot_data, width, height, style=style, title=title, labels=labels, points=points, ax=ax)


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
    from .plots.explore import explore as show_controls

    return show_controls(dataset, partial(plot, dataset, plugins=plugins))


def plot_to_files(
    result: str | Path,
    output: str | Path | None = None,
    *,
    kinds: Sequence[str] = (),
    x: str | None = None,
    y: str | None = None,
    variable: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
    log: str = "",
    points: str | Path | None = None,
    width: float | str | None = None,
    height: float | str | None = None,
    style: str | Path | None = None,
    title: bool = True,
    labels: Mapping[str, str] | None = None,
    equations: bool = False,
    data: str | Path | None = None,
    data_form: str = "wide",
    overwrite: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
) -> PlotFiles:
    """Draw a stored result into a file for each kind of picture.

    Kinds that the result does not have the data for are left out; it is an error if none can be drawn. Of
    several kinds, one that `sel` leaves no axis, while another is drawn, is drawn over the whole axis.

    Parameters
    ----------
    result : file of a result, or of a time history
    output : the picture, with the ending of its format; by default the result's name with .png. The name of each
        of several kinds has the kind in it
    kinds : see `impact.plots.kinds.KINDS`
    data : file for the numbers behind the picture: .csv, .tex or .parquet
    data_form : "wide", a column for each curve, or "long", a row for each point
    overwrite : replace existing files
    x, y, variable, sel, models, log, points, width, height, style, title, labels, equations, plugins : see `plot`

    Returns
    -------
    PlotFiles : by kind the picture and its data, and the reason why a kind is left out

    Raises
    ------
    UsageError : no kind can be drawn, an argument is invalid, or a file exists
    ResultError : the result is not readable
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/r.h5")
    ...     [path.name for path in impact.plot_to_files(f"{folder}/r.h5").pictures.values()]
    ['r.png']
    """
    from .plots.data import check_table, encode_table, read_points
    from .plots.kinds import Choice, check_kind, data_of_kinds, default_kind, draw, label_keys
    from .plots.labels import check_labels
    from .plots.style import check_picture, length, save_figure

    choice = Choice(x, y, variable, sel, models, log, equations)
    kinds = list(dict.fromkeys(kinds))
    for kind in kinds:
        check_kind(kind)
    size = length(width, "--width"), length(height, "--height")
    result = Path(result)
    output = Path(output) if output is not None else result.with_suffix(".png")
    check_picture(output)
    if data is not None:
        check_table(Path(data), data_form)

    def path_of(kind: str, path: str | Path) -> Path:
        path = Path(path)
        return path if len(kinds) < 2 else path.with_name(f"{path.stem}-{kind}{path.suffix}")

    # the default depends on the result, which is read after the paths are checked
    pictures = {kind: path_of(kind, output) for kind in kinds or [""]}
    tables = {kind: path_of(kind, data) for kind in pictures} if data is not None else {}
    check_outputs([*pictures.values(), *tables.values()], [result, points], overwrite=overwrite)
    measured = None if points is None else read_points(points)
    dataset = load(result)
    if not kinds:
        kinds = [default_kind(dataset)]
        pictures = dict.fromkeys(kinds, pictures[""])
        tables = dict.fromkeys(kinds, tables[""]) if tables else {}
    of_kinds, left_out = data_of_kinds(kinds, dataset, choice, _histories_of(dataset, choice, plugins))
    if of_kinds:
        check_labels(labels or {}, label_keys(of_kinds.values(), title=title))
    drawn: dict[str, PlotData] = {}
    for kind, plot_data in of_kinds.items():
        keys = label_keys([plot_data], title=title)
        of_picture = {key: text for key, text in (labels or {}).items() if key in keys}
        try:
            figure = draw(plot_data, *size, style=style, title=title, labels=of_picture, points=measured)
            table = encode_table(plot_data, tables[kind].suffix.lower(), data_form) if tables else b""
        except UsageError as error:
            left_out[kind] = str(error)
            continue
        save_figure(figure, pictures[kind], overwrite=overwrite, style=style)
        if tables:
            write_file(tables[kind], table, overwrite=overwrite)
        drawn[kind] = plot_data
    if not drawn:
        raise UsageError(*dict.fromkeys(left_out.values()))
    return PlotFiles({kind: pictures[kind] for kind in drawn}, drawn, left_out)


def get_plot_data(
    dataset: xr.Dataset, kind: str, choice: Choice, plugins: Sequence[ForceModel | str | Path] = ()
) -> PlotData:
    """The data of a picture; see `plot`."""
    from .plots.kinds import plot_data_of

    return plot_data_of(kind, dataset, choice, _histories_of(dataset, choice, plugins))


def _histories_of(
    dataset: xr.Dataset, choice: Choice, plugins: Sequence[ForceModel | str | Path]
) -> Callable[[], list[xr.Dataset]]:
    """A function that integrates the chosen point of a result again."""
    plugin_set = read_plugins(plugins)
    return lambda: histories(dataset, choice.models, choice.sel or {}, plugin_set)


def materials() -> dict[str, dict[str, float | str]]:
    """Common materials in SI units, which a config can name without a table [materials.NAME].

    Returns
    -------
    By name: E [Pa], nu, rho [kg/m3], yield_strength [Pa] if known, about, source

    >>> materials()["glass"]["E"]
    72000000000.0
    """
    return {name: dict(record) for name, record in records().items()}


def report(
    dataset: xr.Dataset | str | Path,
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
) -> str:
    """A result as one page of HTML, which needs no network and runs no scripts.

    Parameters
    ----------
    dataset : a result, or the file of one
    output : file to write the page to as well, whose name ends in .html
    overwrite : replace the output if it exists
    plugins : plug-in models that the result was computed with; without them the figures of a motion are left out

    Raises
    ------
    UsageError, ResultError : it is a time history, or its attributes are not those of a result; the output exists,
        or has another ending

    >>> import impact
    >>> result = impact.sweep("configs/figure6.toml", overrides=["models=hertz", "sweep.e=[0.5, 1.0]"])
    >>> "<h1>Final velocities comparison</h1>" in impact.report(result)
    True
    """
    from .reporting.page import page

    if output is not None:
        output = Path(output)
        if output.suffix.lower() not in (".html", ".htm"):
            raise UsageError(f"{safe_text(str(output))}: expected a name that ends in .html")
        check_outputs([output], [dataset, *plugins], overwrite=overwrite)
    result = load(dataset) if isinstance(dataset, str | Path) else dataset
    text = page(result, lambda kind, choice: get_plot_data(result, kind, choice, plugins))
    if output is not None:
        write_file(output, text.encode(), overwrite=overwrite)
    return text


def init(path: str | Path = "config.toml", *, overwrite: bool = False) -> None:
    """Write a commented starter config, ready to sweep.

    Raises
    ------
    UsageError : the file exists, or cannot be written there
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.init(f"{folder}/config.toml")
    ...     impact.estimate(f"{folder}/config.toml").points > 0
    True
    """
    write_file(Path(path), STARTER_CONFIG.read_bytes(), overwrite=overwrite)


def schema(output: str | Path | None = None, *, overwrite: bool = False) -> dict[str, Any]:
    """The JSON Schema of a config, from which editors complete and check it.

    Parameters
    ----------
    output : file to write it to as well
    overwrite : replace the output if it exists

    Raises
    ------
    UsageError : the output exists, or cannot be written there
    StoreError : the disk is full or failed

    >>> import impact
    >>> impact.schema()["required"]
    ['models', 'sweep']
    """
    content = json_schema()
    if output is not None:
        text = json.dumps(content, indent=2, ensure_ascii=False) + "\n"
        write_file(Path(output), text.encode(), overwrite=overwrite)
    return content
