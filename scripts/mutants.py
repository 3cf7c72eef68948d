"""Change the code in one place at a time, and report which tests notice, by default the quick ones.

A random sample of mutants is drawn: a comparison, an operator or a condition is inverted, a number is changed,
two arguments are exchanged, a statement is removed. Modules for numba, annotations, decorators and texts stay as
they are. A package with four times as many places has twice as many mutants. The tests of a mutant are those
that execute its lines, with the doctests of the module (if it is executed at import, those that execute anything
in functions of its module, or else of its package): first those within the process, the quickest first, until
one fails or the time limit is over. Which tests execute which lines is recorded once for each file of tests and
state of the code, with coverage.py (`pip install coverage`), also in forked commands.

    python scripts/mutants.py [--count 200] [--seed 0] [--packages inverse cli] [--tests tests/test_solve.py ...]
                              [--limit 60] [--only INDEX ...] [--slow] [--folder build/mutants]

Everything runs in a copy of the checkout in the folder, in one process at a time, which is forked from one that
has the libraries. FOLDER/mutants.md has a table and a list, FOLDER/mutants.json the same as data, both also
after an interruption. A mutant is killed (by a test that passes without it), stopped (a test did not end in
time), not covered, or it survived; one that survived may mean the same as the code. `--only` repeats some of the
same sample, such as those that survived after tests were added; with `--slow` the slow tests judge, too, which
takes hours for all files.
"""

from __future__ import annotations

import argparse
import ast
import functools
import gc
import hashlib
import importlib
import itertools
import json
import os
import pkgutil
import random
import re
import shutil
import signal
import subprocess
import sys
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("inverse", "uncertainty", "exporters", "contact", "results", "cli")
LIBRARIES = (
    "scipy.stats scipy.optimize xarray pandas h5netcdf matplotlib.pyplot typer rich jinja2 pydantic pint dask"
)
RECORD_S = 120.0  # for a file of tests; the later tests of a slow file are not used
START_S = 0.05  # of a test in addition to its recorded cost
GRACE_S = 60.0  # beyond the limit, for the last test that began within it
SERVERS = {"forked", "cli", "sweeps"}  # fixtures that start another interpreter
# selects what `make test` and `make test-faults` run
SLOW_TOO = ["-m", "not long and not peers"]
OUTCOMES = ("killed", "stopped", "survived", "not covered")

OPPOSITES: dict[Any, Any] = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.Is: ast.IsNot,
    ast.In: ast.NotIn,
}
OPPOSITES |= {ast.Add: ast.Sub, ast.Mult: ast.Div, ast.And: ast.Or}
OPPOSITES |= {new: old for old, new in OPPOSITES.items()} | {ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult}
OTHER_NAMES = {"min": "max", "any": "all", "minimum": "maximum"}
OTHER_NAMES |= {new: old for old, new in OTHER_NAMES.items()}
REMOVABLE = (ast.Expr, ast.AugAssign, ast.Raise, ast.Continue, ast.Break)
UNCHANGED = (ast.JoinedStr, ast.Assert, ast.Import, ast.ImportFrom)

# fields of nodes; `exc` is the text of a message, and the keyword `strict` of zip only guards
FIXED = {"annotation", "returns", "decorator_list", "exc", "pattern"}


@dataclass(frozen=True)
class Mutant:
    """A place, by its offsets in bytes, the new text there, and the lines that execute it, () at import."""

    package: str
    path: str
    line: int
    start: int
    stop: int
    before: str
    after: str
    lines: tuple[int, ...]


@dataclass(frozen=True)
class Outcome:
    """One of OUTCOMES, the test that noticed, and how many of the covering tests passed."""

    outcome: str
    test: str = ""
    passed: int = 0
    covering: int = 0
    seconds: float = 0.0


def changes(node: ast.AST) -> Iterator[tuple[Any, str]]:
    """Nodes to replace, this one or its condition, and the new text."""
    new: ast.expr | None = None
    match node:
        case ast.Compare(left, [operator], right) if type(operator) in OPPOSITES:
            new = ast.Compare(left, [OPPOSITES[type(operator)]()], right)
        case ast.BinOp(left, operator, right) if type(operator) in OPPOSITES:
            new = ast.BinOp(left, OPPOSITES[type(operator)](), right)
        case ast.BoolOp(operator, values):
            new = ast.BoolOp(OPPOSITES[type(operator)](), values)
        case ast.UnaryOp(ast.USub() | ast.Not(), operand):
            new = operand
        case ast.Constant(value) if isinstance(value, int | float):
            new = ast.Constant(not value if isinstance(value, bool) else value + 1)
        case ast.Call(ast.Name(name) | ast.Attribute(_, name)) if name in OTHER_NAMES:
            owner = node.func
            other = OTHER_NAMES[name]
            function = ast.Name(other) if isinstance(owner, ast.Name) else ast.Attribute(owner.value, other)
            new = ast.Call(function, node.args, node.keywords)
        case ast.Call(function, [first, second, *rest], keywords):
            if not isinstance(first, ast.Starred) and not isinstance(second, ast.Starred):
                new = ast.Call(function, [second, first, *rest], keywords)
        case ast.If(test) | ast.While(test) | ast.IfExp(test):
            yield test, f"(not ({ast.unparse(test)}))"
    if new is not None:
        yield node, ast.unparse(new) if isinstance(new, ast.Call) else f"({ast.unparse(new)})"
    if isinstance(node, REMOVABLE) and not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
        yield node, "pass"


Place = tuple[ast.AST, Any, bool]


def places(node: ast.AST, statement: ast.stmt | None = None, in_function: bool = False) -> Iterator[Place]:
    """The nodes that may change, with the statements that they are in, and whether these are in a function."""
    statement = node if isinstance(node, ast.stmt) else statement
    if isinstance(node, UNCHANGED) or (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)):
        return
    yield node, statement, in_function
    for name, value in ast.iter_fields(node):
        if name in FIXED or getattr(node, "arg", "") == "strict":
            continue
        is_body = name == "body" and isinstance(node, ast.FunctionDef | ast.Lambda)
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from places(child, statement, in_function or is_body)


def mutants_of(package: str, file: Path) -> Iterator[Mutant]:
    """All mutants of a module."""
    source = file.read_bytes()
    starts = [0]
    for row in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(row))
    path = str(file.relative_to(ROOT))
    for node, statement, in_function in places(ast.parse(source)):
        for old, after in changes(node):
            start, stop = starts[old.lineno - 1] + old.col_offset, starts[old.end_lineno - 1] + old.end_col_offset
            lines = {*range(old.lineno, old.end_lineno + 1), statement.lineno} if in_function else ()
            before = source[start:stop].decode()
            yield Mutant(package, path, old.lineno, start, stop, before, after, tuple(sorted(lines)))


def mutated(mutant: Mutant) -> bytes:
    source = (ROOT / mutant.path).read_bytes()
    return source[: mutant.start] + mutant.after.encode() + source[mutant.stop :]


def sample(packages: list[str], count: int, seed: int) -> list[Mutant]:
    """A random sample in random order, with at most one mutant for a line."""
    generator = random.Random(seed)
    groups: list[list[Mutant]] = []
    for package in packages:
        group: list[Mutant] = []
        for file in sorted((ROOT / "src" / "impact" / package).rglob("*.py")):
            if file.parent.name != "numba":
                group += mutants_of(package, file)
        generator.shuffle(group)
        groups.append(list({(mutant.path, mutant.line): mutant for mutant in group}.values()))
    total = sum(len(group) ** 0.5 for group in groups)
    chosen = [mutant for group in groups for mutant in group[: round(count * len(group) ** 0.5 / total)]]
    generator.shuffle(chosen)
    return chosen


def in_child(function: Callable[[], object], log: Path, limit: float, source: Path) -> bool:
    """Call a function in a forked process, which imports the code of a folder; return whether it ended in time."""
    child = os.fork()
    if child == 0:
        try:
            os.setsid()
            os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644), 1)
            os.dup2(1, 2)
            sys.path.insert(0, str(source))
            os.environ["PYTHONPATH"] = os.pathsep.join([str(source), os.environ.get("PYTHONPATH", "")])
            function()
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            os._exit(0)
    end, has_ended = time.monotonic() + limit, False
    while not has_ended and time.monotonic() < end:
        time.sleep(0.02)
        has_ended = os.waitpid(child, os.WNOHANG)[0] != 0
    # with the processes that tests have left
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if not has_ended:
        os.waitpid(child, 0)
    return has_ended


# for interpreters that tests start: their forked processes record their lines for the current test
SITECUSTOMIZE = """\
import atexit, json, os
import coverage

def start():
    folder = os.environ["MUTANTS_RECORD"]
    with open(folder + "/current") as stream:
        context = stream.read()
    measured = coverage.Coverage(data_file=None, config_file=False, include=[os.environ["MUTANTS_SOURCE"] + "/*"])
    measured.set_option("run:disable_warnings", ["no-data-collected"])
    measured.start()

    def save():
        measured.stop()
        data = measured.get_data()
        lines = {file: data.lines(file) for file in data.measured_files()}
        with open(f"{folder}/{os.getpid()}.json", "w") as stream:
            json.dump([context, lines], stream)

    atexit.register(save)

os.register_at_fork(after_in_child=start)
"""


class Recorder:
    """A plug-in of pytest: the lines that each test, and each fixture that several tests share, executes."""

    def __init__(self, coverage: Any, source: Path, folder: Path) -> None:
        self.coverage, self.source, self.folder, self.context = coverage, source, folder, ""
        self.end = time.monotonic() + RECORD_S
        self.seconds: dict[str, float] = {}
        self.fixtures: dict[str, list[str]] = {}

    def switch(self, context: str) -> None:
        self.context = context
        self.coverage.switch_context(context)
        (self.folder / "current").write_text(context, encoding="utf-8")

    def pytest_collection_finish(self) -> None:
        # what is executed at import belongs to no test
        for module in pkgutil.walk_packages([str(self.source)], "impact."):
            if not module.name.endswith(("__main__", ".numba")):
                importlib.import_module(module.name)
        self.coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Iterator[None]:
        self.fixtures[item.nodeid] = item.fixturenames
        self.switch(item.nodeid)
        if time.monotonic() > self.end:
            item.session.shouldstop = "time limit"
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
        before = self.context
        self.switch(before if fixturedef.scope == "function" else fixturedef.argname)
        try:
            return (yield)
        finally:
            self.switch(before)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" and report.passed:
            self.seconds[report.nodeid] = report.duration


def record(copy: Path, test_file: str, marks: list[str], to: Path) -> None:
    """In a child: run tests of a file, chosen by marks; write their costs, and which lines each executes."""
    import coverage

    folder, source = to.with_suffix(""), copy / "src" / "impact"
    folder.mkdir(exist_ok=True)
    (folder / "sitecustomize.py").write_text(SITECUSTOMIZE, encoding="utf-8")
    os.environ |= {"MUTANTS_RECORD": str(folder), "MUTANTS_SOURCE": str(source)}
    os.environ["PYTHONPATH"] = os.pathsep.join([str(folder), os.environ["PYTHONPATH"]])
    measured = coverage.Coverage(data_file=None, config_file=False, include=[f"{source}/*"])
    recorder = Recorder(measured, source, folder)
    pytest.main([test_file, *marks, "-p", "no:cacheprovider"], plugins=[recorder])
    measured.stop()
    data = measured.get_data()
    executed: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
    for file in data.measured_files():
        for line, contexts in data.contexts_by_lineno(file).items():
            executed[file][line].update(contexts)
    for part in folder.glob("*.json"):
        context, files = json.loads(part.read_bytes())
        for file, numbers in files.items():
            for line in numbers:
                executed[file][line].add(context)
    users: dict[str, list[int]] = defaultdict(list)
    for index, test in enumerate(recorder.seconds):
        for name in (test, *recorder.fixtures[test]):
            users[name].append(index)
    lines = {
        str(Path(file).relative_to(copy)): {
            line: sorted({index for context in contexts for index in users[context]})
            for line, contexts in rows.items()
        }
        for file, rows in executed.items()
    }
    costs = [(not SERVERS.isdisjoint(recorder.fixtures[test]), cost) for test, cost in recorder.seconds.items()]
    to.write_text(json.dumps({"tests": list(recorder.seconds), "costs": costs, "lines": lines}), encoding="utf-8")
    shutil.rmtree(folder)


class Judge:
    """A plug-in of pytest: the tests of each mutant run in a child of the process that collected them."""

    def __init__(self, copy: Path, judged: dict[int, Mutant], records: list[dict[str, Any]], limit: float) -> None:
        self.copy, self.judged, self.records, self.limit, self.passed = copy, judged, records, limit, 0
        self.to = copy.parent / "outcome.json"
        self.outcomes: dict[int, Outcome] = {}

    def write(self, outcome: str, test: str) -> None:
        self.to.write_text(json.dumps([outcome, test, self.passed]), encoding="utf-8")

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self.items = {item.nodeid: item for item in session.items}
        self.passes_unchanged = functools.cache(lambda test: self.run(None, [test])[0] == "survived")
        gc.unfreeze()  # frozen objects cannot be listed
        for index, mutant in self.judged.items():
            outcome = self.outcomes[index] = self.judge(mutant, index)
            print(
                f"{index} {mutant.path}:{mutant.line} {outcome.outcome} {outcome.test} {outcome.seconds:.0f} s",
                file=sys.__stderr__,
                flush=True,
            )
            results = [{"index": i, **asdict(self.judged[i]), **asdict(self.outcomes[i])} for i in self.outcomes]
            self.copy.with_name("mutants.json").write_text(json.dumps(results, indent=1), encoding="utf-8")
            text = as_markdown(self.judged, self.outcomes)
            self.copy.with_name("mutants.md").write_text(text, encoding="utf-8")
        return True

    def judge(self, mutant: Mutant, index: int) -> Outcome:
        """Put a mutant into the copy and run its tests; those that fail without it too are left out."""
        left, begin = self.covering_tests(mutant), time.monotonic()
        covering, file = len(left), self.copy / mutant.path
        while left:
            file.write_bytes(mutated(mutant))
            os.utime(file, (index + 1, index + 1))  # bytecode of another mutant is not that of this one
            outcome, test, passed = self.run(mutant, left) if mutant.lines else self.run_anew(left)
            shutil.copy2(ROOT / mutant.path, file)
            if outcome != "killed" or test == "import" or self.passes_unchanged(test):
                return Outcome(outcome, test, passed, covering, time.monotonic() - begin)
            left.remove(test)
        return Outcome("not covered")

    def covering_tests(self, mutant: Mutant) -> list[str]:
        """The tests that execute a mutant, the doctests of its module first, the tests of commands last."""
        costs = {test: (False, 0.0) for test in self.items if test.startswith(f"{mutant.path}::")}
        costs |= self.costs_of_tests(mutant.path, mutant.lines)
        if not (costs or mutant.lines):  # a module of data
            folder = f"{mutant.path.rpartition('/')[0]}/"
            neighbours = {path for record in self.records for path in record["lines"] if path.startswith(folder)}
            for path in neighbours:
                costs |= self.costs_of_tests(path, ())
        tests = sorted(costs.keys() & self.items.keys(), key=lambda test: (costs[test], test))
        if mutant.lines:
            return tests
        # these run in a new interpreter, which cannot be told to begin no test after the limit
        ends = itertools.accumulate(costs[test][1] + START_S for test in tests)
        return [test for test, end in zip(tests, ends, strict=True) if end < self.limit]

    def costs_of_tests(self, path: str, lines: Collection[int]) -> dict[str, tuple[bool, float]]:
        """The costs of the tests that execute lines, or any line, of functions of a module."""
        costs: dict[str, tuple[bool, float]] = {}
        for record in self.records:
            rows = record["lines"].get(path, {})
            for line in map(str, lines) if lines else rows:
                costs |= {record["tests"][index]: tuple(record["costs"][index]) for index in rows.get(line, ())}
        return costs

    def run(self, mutant: Mutant | None, tests: list[str]) -> tuple[str, str, int]:
        """Run tests in a child until one fails; return the outcome, the test that noticed, and how many passed."""

        def run_tests() -> None:
            if mutant is not None:
                exchange_code(mutant, self.copy)
            end, items = time.monotonic() + self.limit, [self.items[test] for test in tests]
            for item in items:
                if time.monotonic() < end:
                    self.write("killed", item.nodeid)  # if the process dies
                    item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)

        has_ended = in_child(run_tests, self.copy.with_name("log"), self.limit + GRACE_S, self.copy / "src")
        outcome, test, passed = json.loads(self.to.read_bytes())
        return outcome if has_ended else "stopped", test, passed

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.write("killed", report.nodeid)
            os._exit(0)
        if report.when == "teardown":
            self.passed += 1
            self.write("survived", "")

    def run_anew(self, tests: list[str]) -> tuple[str, str, int]:
        """Do the same in a new interpreter, which imports the code."""
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(self.copy / "src"), *sys.path])}
        words = [
            sys.executable,
            "-m",
            "pytest",
            "-x",
            "-p",
            "no:cacheprovider",
            "--tb=no",
            "-rf",
            # or pytest would leave out slow tests, although they are named
            *SLOW_TOO,
            *tests,
        ]
        try:
            done = subprocess.run(
                words, env=environment, capture_output=True, text=True, timeout=self.limit + GRACE_S
            )
        except subprocess.TimeoutExpired:
            return "stopped", "", 0
        failed = re.search(r"^FAILED (.*?)( - .*)?$", done.stdout, re.MULTILINE)
        return (
            ("killed", failed[1] if failed else "import", 0) if done.returncode else ("survived", "", len(tests))
        )


def exchange_code(mutant: Mutant, copy: Path) -> None:
    """Give the functions that contain a mutant its code."""
    path = str(copy / mutant.path)
    codes: dict[tuple[str, int], CodeType] = {}

    def collect(code: CodeType) -> None:
        codes[code.co_qualname, code.co_firstlineno] = code
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                collect(constant)

    collect(compile(mutated(mutant), path, "exec", dont_inherit=True))
    for function in gc.get_objects():
        if isinstance(function, FunctionType) and function.__code__.co_filename == path:
            key = function.__code__.co_qualname, function.__code__.co_firstlineno
            if key in codes and key[1] <= mutant.line:
                function.__code__ = codes[key]


def as_markdown(mutants: dict[int, Mutant], outcomes: dict[int, Outcome]) -> str:
    """A table of the packages, and a list of the mutants, those that no test noticed first."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for index, outcome in outcomes.items():
        for name in (mutants[index].package, "all"):
            counts[name][outcome.outcome] += 1
    rows = [f"| package | mutants | {' | '.join(OUTCOMES)} | noticed |", "|---|" + "---:|" * 6]
    for name, count in sorted(counts.items(), key=lambda pair: (pair[0] == "all", pair[0])):
        noticed = (count["killed"] + count["stopped"]) / count.total()
        numbers = " | ".join(str(count[outcome]) for outcome in OUTCOMES)
        rows.append(f"| {name} | {count.total()} | {numbers} | {noticed:.0%} |")
    for kind in reversed(OUTCOMES):
        rows += ["", f"## {kind.capitalize()}", ""]
        for index in sorted(outcomes, key=lambda index: (mutants[index].path, mutants[index].line)):
            mutant, outcome = mutants[index], outcomes[index]
            if outcome.outcome == kind:
                before, after = (" ".join(text.split())[:100] for text in (mutant.before, mutant.after))
                by = outcome.test or f"{outcome.passed} of {outcome.covering} tests"
                rows.append(f"- {index}: {mutant.path}:{mutant.line}: `{before}` → `{after}`: {by}")
    return "\n".join(rows) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--packages", nargs="+", default=PACKAGES, metavar="PACKAGE")
    parser.add_argument("--tests", nargs="+", metavar="FILE", help="by default all")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for the tests of a mutant")
    parser.add_argument("--only", type=int, nargs="+", metavar="INDEX", help="some mutants of the sample")
    parser.add_argument("--slow", action="store_true", help="run the slow tests, too")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "mutants")
    options = parser.parse_args()
    folder = options.folder.resolve()
    copy = folder / "checkout"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(
        ROOT, copy, ignore=shutil.ignore_patterns(".git", ".*venv*", ".*_cache", "build", "dist", "__pycache__")
    )
    os.chdir(copy)
    os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = str(folder / "hypothesis")
    for library in LIBRARIES.split():
        importlib.import_module(library)

    code = hashlib.sha256()
    for file in (*sorted(Path("src").rglob("*.py")), Path("tests/conftest.py"), Path("tests/fork_server.py")):
        code.update(file.read_bytes())
    records, marks = [], SLOW_TOO if options.slow else []
    files = [Path(file) for file in options.tests or sorted(Path("tests").glob("test_*.py"))]
    for file in files:
        key = hashlib.sha256(code.digest() + file.read_bytes() + "".join(marks).encode()).hexdigest()[:16]
        to = folder / f"{file.stem}-{key}.json"
        if not to.exists():
            begin = time.monotonic()
            in_child(
                functools.partial(record, copy, str(file), marks, to), to.with_suffix(".log"), 600.0, copy / "src"
            )
            print(f"{file}: recorded in {time.monotonic() - begin:.0f} s", flush=True)
        if to.exists():
            records.append(json.loads(to.read_bytes()))

    mutants = sample(list(options.packages), options.count, options.seed)
    judged = {index: mutants[index] for index in options.only or range(len(mutants))}
    plugin = Judge(copy, judged, records, options.limit)
    sys.path.insert(0, str(copy / "src"))
    os.environ["PYTHONPATH"] = os.pathsep.join([str(copy / "src"), os.environ.get("PYTHONPATH", "")])
    doctests = {mutant.path for mutant in judged.values()}
    pytest.main([*map(str, files), *doctests, *marks, "-p", "no:cacheprovider"], plugins=[plugin])


if __name__ == "__main__":
    main()
