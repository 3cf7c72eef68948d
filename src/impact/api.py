"""The Python interface; each command of the command line calls a function of this module."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .atomic import check_outputs, write_file
from .comparison.bless import bless as bless
from .comparison.compare import compare as compare
from .comparison.verdict import Verdict as Verdict
from .config.grid import MAX_POINTS
from .config.library import records
from .config.load import json_schema, read_config

# a name imported "as itself" is public, see `impact.__all__`
from .contact.evidence import Evidence as Evidence
from .contact.model import ForceModel as ForceModel, Parameter as Parameter
from .contact.models import catalogue, find
from .contact.models.hysteresis import hysteresis as hysteresis
from .contact.powers import power as power
from .engine.plan import Plan
from .engine.plugins import read_plugins
from .engine.run import Run
from .errors import ImpactError as ImpactError, UsageError, did_you_mean
from .results.single_impact import STARTER_CONFIG, Impact as Impact, run_single_impact, single_point
from .results.sweep import prepare, sweep_in_memory
from .results.xarray_backend import load as load, save as save
from .text import html_table, safe_text

if TYPE_CHECKING:
    import xarray as xr

    from .contact.checks import Finding
    from .exporters.export import Export
    from .inverse.solve import SolveResult
    from .inverse.timestep import TimestepResult


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


def solve(
    model: str,
    name: str,
    target: Mapping[str, float],
    *,
    source: str | Path | Mapping[str, object] | None = None,
    at: Mapping[str, float | str] | None = None,
    over: Mapping[str, object] | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
) -> SolveResult:
    """Find the value of an input of a law that gives a wanted output: which coefficient gives the rebound I want?

    Parameters
    ----------
    model : key of the law
    name : what to solve for: a parameter of the law, the restitution "e" to ask it for, or the stiffness "K"
    target : the wanted value of one output, such as `{"e_out": 0.6}`
    source : a TOML file, a mapping, or a result; by default the two balls of Table 1 of the paper
    at : values of the other inputs by config name, such as `{"v1": 1.0}`
    over : values of one input, such as `{"v1": {"linspace": [0.1, 3, 30]}}`, for which one value is found, with
        the least largest distance from the target
    overrides, plugins : see `sweep`

    Returns
    -------
    SolveResult : the status, the roots with the e_out of each, the range of the target that was found, and the
        outputs over the range of inputs

    Raises
    ------
    UsageError : the law has no such parameter, or the target is no output
    ConfigError, ModelError : see `sweep`

    The law of Gharib and Hurmuzlu delivers less than it is asked for, and never 0.6:

    >>> import impact
    >>> round(impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": 0.5}).roots[0].value, 6)
    0.697958
    >>> impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": 0.6}).status
    'no_root'
    """
    # its module imports scipy.optimize, which other functions do without
    from .inverse.solve import placeholder_override, solve_input, unknown_of

    if over is not None and len(over) != 1:
        raise UsageError(f"--over: got {len(over)} inputs, expected one")
    plugin_set = read_plugins(plugins)
    law = find(model, plugin_set.models)
    unknown = unknown_of(law, name)
    changes = [*placeholder_override(law, unknown), *overrides]
    config, _ = single_point(source, changes, plugin_set, model, at, over)
    return solve_input(config, plugin_set.of(config.models), unknown, target)


def timestep(
    model: str,
    *,
    source: str | Path | Mapping[str, object] | None = None,
    at: Mapping[str, float | str] | None = None,
    steps_per_contact: Sequence[float] = (),
    dt: Sequence[float] = (),
    phases: int = 400,
    tol: float | None = None,
    scheme: str | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
) -> TimestepResult:
    """What a code with a fixed time step delivers: mean, least and largest restitution over the phase.

    The phase is the part of a step in which the contact begins: a code sees an overlap at its first step after it.
    The scheme "kick-drift" is that of LAMMPS, LIGGGHTS, YADE and MuJoCo, "drake-tamsi" and "drake-sap" are those
    of Drake's discrete solvers; `impact.contact.timestep.SCHEMES` has what they do in a step.

    Parameters
    ----------
    model : key of the law
    source, at, overrides, plugins : see `solve`
    steps_per_contact : contact times of the continuous law over dt; by default 10, 20, 50 and 100
    dt : further time steps [s]
    phases : number of phases, (i + 1/2)/phases
    tol : relative tolerance for which the smallest number of steps per contact is found
    scheme : its name; by default "drake-tamsi" for the laws of Drake, "kick-drift" for all others

    Returns
    -------
    TimestepResult : a row for each step, those of `steps_per_contact` first, and the number of steps needed; a row
        at which the collision fails at some phase has a status and no restitution

    Raises
    ------
    UsageError : a step is not positive, the scheme does not take the law, or the law has no rebound at these
        inputs
    ConfigError, ModelError : see `sweep`

    A linear spring and dashpot that is asked for 0.5, with twenty steps per contact:

    >>> import impact
    >>> (row,) = impact.timestep("anagnostopoulos-1988", at={"e": 0.5}, steps_per_contact=[20]).rows
    >>> round(row.e_mean, 4), round(row.e_least, 3), round(row.e_largest, 3), round(row.e_to_ask, 4)
    (0.4945, 0.48, 0.519, 0.5054)
    """
    # its module imports scipy.optimize, which other functions do without
    from .inverse.timestep import timestep_study

    config, _ = single_point(source, overrides, read_plugins(plugins), model, at)
    return timestep_study(
        config, steps_per_contact=steps_per_contact, dt=dt, phases=phases, tol=tol, scheme=scheme
    )


def calibrate(
    source: str | Path | Mapping[str, object],
    *,
    output: str | Path | None = None,
    best: str | Path | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    jobs: int = 1,
) -> xr.Dataset:
    """Fit laws to measurements: which law fits, with which parameters, and what the data cannot determine.

    Parameters
    ----------
    source : a TOML file, or a mapping with the same keys, with `[data]` and values `{ fit = [least, most] }`
    output : result file to write
    best : TOML file to write, with the config of the best law and its parameters, for `sweep` and `export`
    overwrite : replace files that exist
    overrides, plugins : see `sweep`
    jobs : number of processes; the result has the same bits for any number

    Returns
    -------
    Dataset : of dimensions model, parameter and point, the best law first; see docs/calibrate.md

    Raises
    ------
    ConfigError : with one line for each problem
    UsageError, StoreError : a file exists or cannot be written

    The restitution that a linear spring and dashpot was asked for, from three measurements of it:

    >>> import impact
    >>> fit = impact.calibrate({
    ...     "models": "anagnostopoulos-1988",
    ...     "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "e": {"fit": [0.1, 1.0]}},
    ...     "data": {"columns": {"e_out": [0.49, 0.5, 0.51], "sigma": [0.01, 0.01, 0.01]}},
    ... })
    >>> round(fit["estimate"].item(), 6), round(fit["chi2_reduced"].item(), 6)
    (0.5, 1.0)
    """
    # its modules import scipy.optimize, which other functions do without
    from .inverse.calibrate import best_config, calibrate_config, calibration_dataset

    plugin_set = read_plugins(plugins)
    read = Path(source) if isinstance(source, str) else source
    config = read_config(read, overrides, plugin_set.models, purpose="calibrate")
    check_outputs([output, best], [source, *plugins, *config.files], overwrite=overwrite)
    of_config = plugin_set.of(config.models)
    calibration = calibrate_config(config, of_config, jobs)
    result = calibration_dataset(calibration, of_config)
    if output is not None:
        save(result, output, overwrite=overwrite)
    if best is not None:
        write_file(Path(best), best_config(calibration).encode(), overwrite=overwrite)
    return result


def sensitivity(
    source: str | Path | Mapping[str, object],
    *,
    of: str = "e_out",
    output: str | Path | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    max_points: int = MAX_POINTS,
    execute: Callable[[Plan], xr.Dataset] = sweep_in_memory,
) -> xr.Dataset:
    """Which uncertain input matters: Sobol indices of an output, its mean and quantiles, for every model.

    For n samples of d uncertain inputs, n (d + 2) points are computed for each model and each point of the other
    axes.

    Parameters
    ----------
    source : a TOML file, or a mapping with the same keys, with distributions and `[design]`
    of : name of the output
    output : result file to write
    overwrite : replace it if it exists
    overrides, plugins : see `sweep`
    max_points : the largest number of points
    execute : function that runs a plan; by default it is run in this process

    Returns
    -------
    Dataset : of dimensions model, the axes of the config, and input; see docs/uncertainty.md

    Raises
    ------
    ConfigError : with one line for each problem; there is no design, or its n is no power of two from 2 on
    UsageError, StoreError : there is no such output, or the file exists or cannot be written

    The peak force of Hertz' law is proportional to K^0.4 v^1.2:

    >>> import impact
    >>> study = impact.sensitivity({
    ...     "models": "hertz",
    ...     "sweep": {"v1": {"uniform": [0.8, 1.2]}, "m1": 1.0, "m2": 1.0, "K": {"uniform": [5e5, 1.5e6]}},
    ...     "design": {"n": 1024},
    ... }, of="peak_force")
    >>> study["first"].values.round(2).tolist()
    [[0.56, 0.43]]
    """
    (result,) = sensitivities(
        source,
        of=[of],
        output=output,
        overwrite=overwrite,
        overrides=overrides,
        plugins=plugins,
        max_points=max_points,
        execute=execute,
    )
    return result


def sensitivities(
    source: str | Path | Mapping[str, object],
    *,
    of: Sequence[str],
    output: str | Path | None,
    overwrite: bool,
    overrides: Sequence[str],
    plugins: Sequence[ForceModel | str | Path],
    max_points: int,
    execute: Callable[[Plan], xr.Dataset],
) -> list[xr.Dataset]:
    """The `sensitivity` of several outputs, whose points are computed once; one of them may be written."""
    # its modules import scipy.stats, which other functions do without
    from .uncertainty.sensitivity import check_output_name, sensitivity_of, sensitivity_plan

    for name in of:
        check_output_name(name)
    if output is not None and len(of) > 1:
        raise UsageError(f"--output: got {len(of)} outputs (--of), expected one for a file")
    name = safe_text(str(source)) if isinstance(source, str | Path) else "config"
    plan = sensitivity_plan(prepare(source, overrides, plugins, Run(max_points=max_points)), of, max_points, name)
    check_outputs([output], [source, *plugins, *plan.config.files], overwrite=overwrite)
    swept = execute(plan)
    results = [sensitivity_of(plan, of_study, swept) for of_study in of]
    if output is not None:
        save(results[0], output, overwrite=overwrite)
    return results


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


def materials() -> dict[str, dict[str, float | str]]:
    """Common materials in SI units, which a config can name without a table [materials.NAME].

    Returns
    -------
    By name: E [Pa], nu, rho [kg/m3], yield_strength [Pa] if known, about, source

    >>> materials()["glass"]["E"]
    72000000000.0
    """
    return {name: dict(record) for name, record in records().items()}


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
