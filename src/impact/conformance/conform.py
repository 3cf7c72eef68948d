"""Ask an engine the collisions of a set, and judge its answers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ..atomic import check_outputs
from ..contact.models import catalogue
from ..errors import UsageError, did_you_mean, require_known
from ..formatting import argument, number
from ..reporting.report import report
from ..results.board import CHECKS, Board, EngineChecks, board_dataset, excess_of
from ..results.schema import CHECK_STATUSES
from ..results.sweep import sweep
from ..results.xarray_backend import save
from . import checks
from .adapters import DEFAULT_TIMEOUT_S, Ask, Facts, open_adapter, read_answer, read_facts
from .registry import find_engine
from .suite import ANSWER_KEYS, DEFAULT_SUITE, Question, Trial, read_suite

PAGE_SUFFIXES, BOARD_SUFFIXES = (".html", ".htm"), (".h5", ".hdf5", ".nc")


def conform(
    engine: str | Sequence[str] = (),
    *,
    adapter: str | Callable[[Question], object] | Sequence[str | Callable[[Question], object]] = (),
    suite: str = DEFAULT_SUITE,
    only: str | Sequence[str] = (),
    tol: float | Mapping[str, float] | None = None,
    timeout: float = DEFAULT_TIMEOUT_S,
    program: str | None = None,
    output: str | Path | None = None,
    overwrite: bool = False,
) -> Board:
    """Run a fixed set of impacts of two balls in engines, and judge each answer.

    Parameters
    ----------
    engine : names of engines that the program has adapters for, see `impact conform --list`
    adapter : adapters of other engines: `FILE.py:FUNCTION`, the command line of a program, or a function; see
        docs/conform.md for the protocol
    suite : name of the set
    only : ids of collisions to judge; by default all. Those from which they follow are asked as well
    tol : tolerance of all checks, or by name, "all" for the others
    timeout : time that an adapter has for an answer [s]
    program : the Python interpreter that has the packages of the engines, by default this one; or the program
        of an engine that has none (LIGGGHTS, YADE), by default that on the path
    output : file to write as well, a page (.html) or a sealed file (.h5)
    overwrite : replace the output if it exists

    Returns
    -------
    Board : the checks; `board.passed` is whether none failed

    Raises
    ------
    UsageError : an engine is not installed, or an adapter does not answer as the protocol says

    >>> import impact
    >>> def ghost(collision):
    ...     return collision  # the balls go through each other
    >>> board = impact.conform(adapter=ghost, only="normal-e50-middle-equal")
    >>> [check["check"] for check in board.as_dict()["checks"] if check["status"] == "fail"]
    ['separates', 'restitution']
    """
    names = [engine] if isinstance(engine, str) else list(engine)
    adapters = [adapter] if isinstance(adapter, str) or callable(adapter) else list(adapter)
    if not names and not adapters:
        raise UsageError(f"expected the name of an engine, see impact conform --list, or {argument('adapter')}")
    if program is not None and not names:
        raise UsageError(f"{argument('program')}: set without an engine of impact conform --list")
    if not timeout > 0.0:
        raise UsageError(f"{argument('timeout')}: got {number(timeout)}, expected a number of seconds > 0")
    requested = _check_tolerances(tol)
    path = None if output is None else Path(output)
    if path is not None and path.suffix.lower() not in PAGE_SUFFIXES + BOARD_SUFFIXES:
        raise UsageError(f"{path}: expected a name that ends in .html, for a page, or in .h5")
    check_outputs([path], [], overwrite=overwrite)
    trials = read_suite(suite)
    only = [only] if isinstance(only, str) else only
    require_known(only, trials, f"{argument('only')}: no collision")
    judged = [trial for trial in trials.values() if not only or trial.id in only]
    commands: list[tuple[str, object, str]] = [(name, *find_engine(name).command(program)) for name in names]
    commands += [(_adapter_name(word), word, "") for word in adapters]
    checked = [(trial, name) for trial in judged for name in checks.checks_of(trial)]
    engines: list[EngineChecks] = []
    for position, (name, command, version) in enumerate(commands):
        # engines of the package may leave files where they run
        with TemporaryDirectory(prefix="impact-") as empty:
            folder = empty if position < len(names) else None
            with open_adapter(command, timeout, folder) as ask:
                facts, answers, again = _ask_all(ask, judged)
        # an adapter may name its engine; names are labels of the board
        label = facts.engine or name
        alike = sum(other.engine == label or other.engine.startswith(f"{label} #") for other in engines)
        label += f" #{alike + 1}" if alike else ""
        facts = replace(facts, engine=label, version=facts.version or version)
        engines.append(_judge(facts, checked, answers, again, requested))
    board = Board(board_dataset(suite, [(trial.id, name) for trial, name in checked], engines))
    if path is not None and path.suffix.lower() in PAGE_SUFFIXES:
        report(board.dataset, output=path, overwrite=overwrite)
    elif path is not None:
        save(board.dataset, path, overwrite=overwrite)
    return board


def _check_tolerances(tol: float | Mapping[str, float] | None) -> dict[str, float]:
    """Return tolerances by check, "all" for the others."""
    requested = dict(tol) if isinstance(tol, Mapping) else {} if tol is None else {"all": tol}
    known = ["all", *(name for name in CHECKS if name not in checks.EXACT)]
    for name, value in requested.items():
        origin = argument("tol", key=str(name))
        if name not in known:
            raise UsageError(f"{origin}: not a check with a tolerance; {did_you_mean(str(name), known)}")
        if not 0.0 <= value < float("inf"):
            raise UsageError(f"{origin}: got {value}, expected a number >= 0, such as 1e-6")
    return {name: float(value) for name, value in requested.items()}


def _adapter_name(word: object) -> str:
    """Name an adapter by what it was called, without folders."""
    if isinstance(word, str):
        return re.sub(r"[^\s'\"]*/", "", word)
    return str(getattr(word, "__name__", type(word).__name__))


def _ask_all(
    ask: Ask, judged: Sequence[Trial]
) -> tuple[Facts, dict[str, checks.Answer | None], dict[str, checks.Answer | None]]:
    """Ask for all collisions in their order, then in reverse; an answer is None where it is not supported."""
    needed = {link.id: link.question for trial in judged for link in reversed(trial.chain)}
    start = next(iter(needed))
    first = ask(dict(needed[start]))
    answers = {start: read_answer(needed[start], first)}
    facts = read_facts(first)
    answers |= {key: read_answer(needed[key], ask(dict(needed[key]))) for key in needed if key != start}
    # another collision comes before each, so that what is kept from it shows
    again = {key: read_answer(needed[key], ask(dict(needed[key]))) for key in reversed(needed)}
    return facts, answers, again


@np.errstate(all="ignore")
def _judge(
    facts: Facts,
    checked: Sequence[tuple[Trial, str]],
    answers: Mapping[str, checks.Answer | None],
    again: Mapping[str, checks.Answer | None],
    tol: Mapping[str, float],
) -> EngineChecks:
    """Judge the answers of one engine; a check that needs an answer which is not supported is not supported."""
    tolerance = checks.tolerances(facts.kind, float32=facts.is_float32, tol=tol)
    with_friction = [trial.question for trial, name in checked if name == "friction"]
    betas: Mapping[str, float] = {}
    if facts.law and with_friction:
        betas = betas_of_law(with_friction, facts.law, facts.model, facts.parameters)
    rows = []
    for trial, name in checked:
        chain = trial.chain[: checks.CHAIN_LENGTHS.get(name, 1)]
        rebounds = [checks.Rebound.of(link, answer) for link in chain if (answer := answers[link.id]) is not None]
        further = {"repeat": (again[trial.id] or {},), "friction": (betas.get(trial.id),)}.get(name, ())
        if len(rebounds) == len(chain):
            asked, delivered = checks.CHECK_OF[name](*rebounds, *further)
            # NaN never passes
            word = "pass" if excess_of(name, asked, delivered) <= tolerance[name] else "fail"
        else:
            word, delivered = "not_supported", float("nan")
            # what is asked for is independent of the answer, but for friction
            silent = checks.Rebound.of(trial, dict.fromkeys(ANSWER_KEYS, delivered))
            asked = delivered if name in checks.CHAIN_LENGTHS else checks.CHECK_OF[name](silent)[0]
        rows.append((asked, delivered, tolerance[name], CHECK_STATUSES[word]))
    return EngineChecks(facts.engine, facts.version, facts.kind, *zip(*rows, strict=True))


def betas_of_law(
    questions: Sequence[Question], law: str, model: str, parameters: Mapping[str, float | str]
) -> dict[str, float]:
    """Compute beta = -g1/g0 of a friction law of the catalogue with a contact force, by the id of the collision.

    Raises
    ------
    ConfigError : a parameter is none of the law, or the law is not combinable with the contact force
    """
    n = catalogue()[model].exponent or 1.5
    inputs = [_inputs(question, n) for question in questions]
    cases = {name: [values[name] for values in inputs] for name in inputs[0]}
    table = {law: dict(parameters)}
    result = sweep({"models": model, "frictions": law, "sweep": {"cases": cases, "n": n}, "friction": table})
    return dict(zip((str(question["id"]) for question in questions), result["beta"].values.ravel(), strict=True))


def _inputs(question: Question, n: float) -> dict[str, float]:
    """Write a collision as the inputs of a config.

    The stiffness is that of a spring K x^n with the contact time of the collision, of n = 1 with its dashpot,
    K = m (pi^2 + ln^2 e)/t^2; beta depends on it only if a parameter of the law has a unit.
    """
    names = ("v1", "v2", "u1", "u2", "omega1", "omega2", "e", "mu", "contact_time")
    values = {name: float(question[name] or 0.0) for name in names}
    for ball in "12":
        mass, radius = (float(question[f"{name}{ball}"] or math.inf) for name in ("m", "R"))
        inertia = question[f"inertia{ball}"]
        factor = 0.4 if inertia is None else float(inertia) / (mass * radius**2)
        values |= {f"m{ball}": mass, f"R{ball}": radius, f"inertia_factor{ball}": factor}
    contact_time = values.pop("contact_time") * math.pi / math.hypot(math.pi, math.log(values["e"]))
    m, v0 = 1.0 / (1.0 / values["m1"] + 1.0 / values["m2"]), values["v1"] - values["v2"]
    # the contact time in units of the peak indentation over v0; pi for n = 1
    ratio = 2.0 * math.sqrt(math.pi) * math.gamma(1.0 + 1.0 / (n + 1.0)) / math.gamma(0.5 + 1.0 / (n + 1.0))
    peak = contact_time * v0 / ratio
    return values | {"K": 0.5 * (n + 1.0) * m * v0**2 / peak ** (n + 1.0)}
