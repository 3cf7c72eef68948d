"""Read, plan and calibrate thousands of mutated configs, and count how they end.

The configs of this repository, and some that use what those do not, are mutated with their CSV files: values,
keys, lines, tables, cells, headers and bytes. Each is read and planned as by `impact sweep`, or read as by `impact
calibrate`; some are also timed as by --dry-run, calibrated, or run by the command line in a process of its own.
A config fails if it ends in anything but a result or an error of this package, if a library warns, if a message
contains control characters, if it takes more than 20 s of CPU time, or if the exit code of the command line does
not stand for how it ended. The table shows how many ended in which way, and the longest CPU times.

    python scripts/fuzz_configs.py [--count 10000] [--calibrate 300] [--seed 0] [--only INDEX]

`--only` repeats a single config, and prints it.
"""

from __future__ import annotations

import argparse
import random
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import impact
from impact.config.load import read_config
from impact.errors import ConfigError, Interruption
from impact.results.sweep import read_plan

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

from tests.fork_server import ForkServer, start_fork_server  # noqa: E402

MAX_CPU_S = 20.0
MAX_FITS = 200  # laws x points x parameters of a calibration, to which its time is proportional
EXIT_CODES = {0, 2, 3, 4}
# one in so many configs is also timed as by a dry run, and run by the command line
TIMED, COMMAND = 5, 100
CONFIG, FOLDERS = "config.toml", ("configs", "docs", "tests/data", "src/impact/config")

Mutation = Callable[[random.Random, str, "Corpus"], str]

# what the shipped configs do not use; their CSV files are among the `TABLES`
EXTRA = (
    'models = ["hertz", "tsuji-1992"]\n[sweep]\ncases = "cases.csv"\nK = 1e6\n',
    'models = ["hertz", "bilinear"]\nfrictions = ["coulomb-1785", "cundall-strack-1979"]\n[sweep]\ne = [0.5, 1]\n'
    'speed = 2\nangle = { linspace = ["0 deg", "80 deg", 3] }\nmu = [0, 0.3]\nomega1 = "90 rpm"\nR1 = "2 cm"\n'
    'm1 = 1\nm2 = inf\nK = 1e6\n[friction.cundall-strack-1979]\nk_t = [1e5, "1 MN/m"]\nlimit = "positive"\n',
    'models = "tsuji-1992"\nfrictions = ["*-mindlin", "drake-*"]\n[design]\nn = 8\n[sweep]\ncases = "spins.csv"\n'
    'e = 0.9\nv1 = 2\nR1 = "2 cm"\nR2 = inf\nm2 = inf\nmaterial = "steel"\ninertia_factor1 = "40 %"\n'
    "mu = { uniform = [0.1, 0.3] }\n[friction.drake-regularized]\nv_s = [1e-4, 1e-3]\n",
    'models = "hertz"\nfrictions = "cundall-strack-1979"\n[sweep]\nm1 = 1\nR1 = 1\nm2 = inf\nK = 1e6\nn = 1\n'
    "v1 = 1\nmu = { fit = [0.01, 1] }\n[friction.cundall-strack-1979]\nkt_over_kn = { fit = [0.1, 2] }\n"
    "[data.columns]\nbeta = [-0.2, 0.1, 0.3]\nu1 = [2, 1, 0.5]\nomega1 = [0, 0.1, 0]\n",
    'models = "hertz"\n[sweep]\ncases = { e = [0.1, 0.9], v1 = ["1 m/s", 2], m1 = [1, 2] }\nm2 = inf\nK = 1e6\n',
    'models = "hertz"\n[sweep]\ne = 0.5\nv1 = { file = "cases.csv", column = "v1" }\nm1 = 1\nm2 = 1\nK = 1e6\n',
    'models = "hertz"\n[design]\nmethod = "random"\nn = 8\n[sweep]\nv1 = { empirical = "speeds.csv" }\n'
    "m1 = { uniform = [1, 2] }\nm2 = 1\nK = { triangular = [1e6, 2e6, 4e6] }\n",
    'models = "anagnostopoulos-1988"\n[design]\nmethod = "lhs"\nn = 16\nseed = 3\n[sweep]\n'
    "e = { uniform = [0.5, 0.9] }\nv1 = { normal = [1, 0.1] }\nm1 = 1\nm2 = 1\nK = 1e6\nn = 1\n",
    'models = "anagnostopoulos-1988"\n[sweep]\nv1 = 1\nm1 = 1\nm2 = 1\nK = 1e6\nn = 1\ne = { fit = [0.1, 1] }\n'
    '[data]\nnoise = "excess"\n[data.columns]\ne_out = [0.49, 0.5, 0.52]\nsigma = [0.01, 0.01, 0.02]\n',
    'models = ["kelvin-voigt", "anagnostopoulos-1988"]\n[sweep]\nm1 = "2.7 g"\nm2 = inf\nn = 1\nK = 1e6\n'
    'e = { fit = [0.05, 1] }\n[model.kelvin-voigt]\nC = { fit = [0.01, "1000 N s/m"] }\n'
    '[data]\nfile = "drops.csv"\nnoise = "scale"\n',
    'models = "hertz"\n[sweep]\nm1 = 1\nm2 = 1\nK = { fit = [1e5, 1e7] }\n[data]\nsigma = 0.001\n'
    "columns = { contact_time = [0.01, 0.0098], v1 = [1, 1.1] }\n",
)
TABLES = {
    "cases.csv": "e,v1 [m/s],m1 [kg],m2\n0.1,1,1,1\n0.5,2,1,inf\n0.9,0.5,2,2\n",
    "spins.csv": "angle [deg],omega1 [rpm],friction.yade-mindlin.limit\n0,0,abs\n30,90,positive\n80,-3,abs\n",
    "speeds.csv": "v1 [mm/s]\n900\n1000\n1150\n",
}
VALUES = (
    *("nan", "inf", "-inf", "0", "-0.0", "1e-320", "1e-300", "1e300", "1e308", "1e400", "-1", "1", "0.5", "2"),
    *("true", "false", '"0.5"', '"5 m/s"', '"5 %"', '"inf"', '"1e400 m/s"', '""', '"all"', '"*"', '"steel"'),
    *("[]", "{}", "[[]]", "[1, 2]", "[0.5, 0.5]", '["a"]', "[nan]", "[{}]", "2020-01-01", "12:00:00", "0x10"),
    *("{ linspace = [0, 1, 3] }", "{ linspace = [0, 1, 1000000000000] }", "{ geomspace = [0.1, 1, 3] }"),
    *("{ fit = [0.1, 0.9] }", "{ fit = [0.9, 0.1] }", "{ fit = [0, inf] }", "{ fit = [1e-300, 1e300] }"),
    *("{ normal = [1, 0.1] }", "{ uniform = [0.1, 0.9] }", "{ lognormal = [1, 1.1] }", "{ empirical = [1, 2] }"),
    *('{ file = "cases.csv", column = "e" }', '{ empirical = "speeds.csv" }', '"cases.csv"', '"drops.csv"'),
    *('"\\u0000"', '"\\u001b[31m"', '"\u202e"', "9" * 20, "9" * 5000, "[" * 500, f'"{"x" * 300}"'),
    *('"30 deg"', '"90 deg"', '"90 rpm"', '"10 Hz"', '"positive"', '["abs", "positive"]', '"coulomb-1785"'),
    *('"sobol"', '"random"', '"given"', '"scale"', '"excess"', '"full"', '"factored"', "4096", "1000000000"),
)
CELLS = (
    *("", " ", "nan", "inf", "-1", "0", "1e-320", "1e-9", "1e300", "1e400", "1.0004", "60", "5 %", "x"),
    *("1,5", "#", '"', "0.5 m/s", "\x00", "\x1b[31m", "é", "\u202e", "1_0", "0x1", "=1+1", "1;2", "true", "steel"),
)
HEADERS = (
    *("e_out", "e_out [%]", "sigma", "sigma_e_out", "v1", "v1 [m/s]", "v1 [cm/s]", "v1 (m/s)", "v1 [kg]"),
    *("e", "n", "m1 [g]", "m2 [kg]", "contact_time [us]", "peak_force [N]", "material", "hertz.K", ""),
    *("kelvin-voigt.C", "  ", "materials.steel.E [GPa]", "v2 [m/s]", "K [N/m^n]", "specimen", "v1 []", "models"),
    *("angle [deg]", "angle", "omega1 [rpm]", "omega2 [Hz]", "mu", "beta", "rebound_angle [deg]", "u1 [m/s]"),
    *("friction.coulomb-1785.limit", "friction.cundall-strack-1979.k_t [N/m]"),
    *("\x1b[31m", "x" * 300),
)
LETTERS = "\x00\x1b\t\r\n \"'#=,.;[]{}\\_-+eE0199xé\u202e\ufeff"


@dataclass(frozen=True)
class Corpus:
    """The configs that are mutated, their CSV files by name, and what they consist of."""

    configs: Sequence[str]
    tables: dict[str, str]
    lines: Sequence[str]
    keys: Sequence[str]
    values: Sequence[str]


@dataclass
class Outcomes:
    """How many configs ended in which way, the failures, and the CPU times [s] by index."""

    counts: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)
    seconds: dict[int, float] = field(default_factory=dict)

    def fail(self, index: int, problem: str) -> None:
        """Record and print a failure."""
        self.failures.append(f"{index}: {problem}")
        print(f"config {self.failures[-1]}", file=sys.stderr, flush=True)


class TooSlowError(Interruption):
    """The limit of CPU time is exceeded."""


def read_corpus() -> Corpus:
    """The shipped configs without comments, and the configs above."""
    files = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.toml"))]
    # a library of materials is no config
    texts = [path.read_text(encoding="utf-8") for path in files if path.name != "materials.toml"]
    configs = [re.sub(r"(?m)^\s*#.*\n|\s+#[^\"'\n]*$", "", text) for text in (*texts, *EXTRA)]
    tables = {
        path.name: path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").rglob("*.csv"))
    } | TABLES
    lines = sorted({line for text in configs for line in text.splitlines() if line})
    pairs = [line.split(" = ", 1) for line in lines if " = " in line and not line.startswith((" ", "{"))]
    return Corpus(configs, tables, lines, sorted({pair[0] for pair in pairs}), sorted({pair[1] for pair in pairs}))


def replace_value(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Replace the value of a key."""
    new = rng.choice(corpus.values if rng.random() < 0.4 else VALUES)
    return _replace_match(rng, r"(?m)(?<== ).+$", text, new)


def replace_token(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Replace a number or a text inside a value."""
    return _replace_match(rng, r'(?<=[\[ ,])(-?[\d.][\w.+-]*|"[^"\n]*")', text, rng.choice(VALUES))


def swap_value(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Replace the value of a key by another value of this key."""
    line = rng.choice(corpus.lines)
    key = re.escape(line.partition(" = ")[0])
    return re.sub(rf"(?m)^{key} = .*$", lambda match: line, text)


def scale_number(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Multiply a number."""
    numbers = list(re.finditer(r"(?<=[\[ ,\"])-?\d[\d.]*(e[+-]?\d+)?(?=[\] ,\n\"])", text))
    if not numbers:
        return text
    match = rng.choice(numbers)
    scaled = float(match[0]) * rng.choice((0.5, 0.9, 1.1, 2.0, -1.0, 1e3, 1e-3, 1e9, 1e-9))
    return text[: match.start()] + repr(scaled) + text[match.end() :]


def replace_key(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Rename a key."""
    return _replace_match(rng, r"(?m)^[\w.-]+(?= =)", text, rng.choice(corpus.keys))


def change_lines(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Remove, repeat, move or insert a line."""
    lines = text.splitlines() or [""]
    position, kind = rng.randrange(len(lines)), rng.randrange(4)
    line = lines.pop(position) if kind in (0, 1) else rng.choice(lines if kind == 2 else corpus.lines)
    if kind:
        lines.insert(rng.randrange(len(lines) + 1), line)
    return "\n".join(lines) + "\n"


def change_letter(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Insert, replace or remove a character, or cut the text."""
    position = rng.randrange(len(text) + 1)
    if rng.random() < 0.1:
        return text[:position]
    return text[:position] + rng.choice(("", rng.choice(LETTERS))) + text[position + rng.randrange(2) :]


def replace_cell(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Replace a cell below the header of a CSV file."""
    head, newline, rows = text.partition("\n")
    return head + newline + _replace_match(rng, r"[^,\n]+", rows, rng.choice(CELLS))


def replace_header(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Replace the name of a column."""
    head, newline, rows = text.partition("\n")
    return _replace_match(rng, r"[^,\n]+", head, rng.choice(HEADERS)) + newline + rows


def change_table(rng: random.Random, text: str, corpus: Corpus) -> str:
    """Change the separator, or remove, repeat or append rows."""
    return rng.choice(
        (
            lambda: text.replace(",", rng.choice((";", "\t", " ", ",,"))),
            lambda: "\n".join(rng.choices(text.splitlines() or [""], k=rng.randrange(12))) + "\n",
            lambda: text + rng.choice(("\n\n", "# end\n", ",,\n", '"\n', "1\n")),
            lambda: rng.choice(("# drops\n", "\n", "\ufeff")) + text,
            lambda: text.replace("\n", rng.choice(("\r\n", "\r"))),
        )
    )()


CONFIG_MUTATIONS: Sequence[Mutation] = (
    *(replace_value, replace_token, scale_number, scale_number, scale_number, swap_value, swap_value, swap_value),
    *(replace_key, change_lines, change_letter),
)
TABLE_MUTATIONS: Sequence[Mutation] = (replace_cell, replace_cell, replace_header, change_table, change_letter)


def _replace_match(rng: random.Random, pattern: str, text: str, new: str) -> str:
    matches = list(re.finditer(pattern, text))
    if not matches:
        return text
    match = rng.choice(matches)
    return text[: match.start()] + new + text[match.end() :]


def mutated(rng: random.Random, corpus: Corpus) -> tuple[str, dict[str, str]]:
    """A config and its CSV files, with one to four mutations."""
    text, tables = rng.choice(corpus.configs), dict(corpus.tables)
    # the time of a calibration is proportional to the laws and the points
    tables["drops.csv"] = "".join(tables["drops.csv"].splitlines(keepends=True)[: rng.choice((4, 8, 12))])
    if "[data]" in text and rng.random() < 0.8:
        text = re.sub(r"models = \[(.*)\]", lambda match: f"models = {rng.choice(match[1].split(', '))}", text)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 4))):
        named = [name for name in tables if name in text]
        if named and rng.random() < 0.4:
            name = rng.choice(named)
            tables[name] = rng.choice(TABLE_MUTATIONS)(rng, tables[name], corpus)
        else:
            text = rng.choice(CONFIG_MUTATIONS)(rng, text, corpus)
    return text, tables


def write_files(folder: Path, text: str, tables: dict[str, str]) -> Path:
    """Write a config and its CSV files; returns the path of the config."""
    for name, content in {**tables, CONFIG: text}.items():
        (folder / name).write_bytes(content.encode("utf-8", "replace"))
    return folder / CONFIG


def run_config(path: Path, *, timed: bool, with_fit: bool) -> str:
    """Read and plan a config, and time or calibrate it; returns how far it came."""
    if "[data" not in path.read_text(encoding="utf-8"):
        if timed:
            impact.estimate(path)
            return "planned and timed"
        read_plan(path)
        return "planned"
    config = read_config(path, purpose="calibrate")
    assert config.data is not None
    points = len(config.data.lines)
    if with_fit and len(config.models) * points * len(config.fits) <= MAX_FITS:
        impact.calibrate(path)
        return "calibrated"
    return "read as measurements"


def judge(outcomes: Outcomes, index: int, path: Path, *, timed: bool, with_fit: bool) -> str:
    """Run a config within the limit of CPU time, and record how it ended; returns that."""
    start = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, MAX_CPU_S)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            ended = run_config(path, timed=timed, with_fit=with_fit)
    except impact.ImpactError as error:
        caught = []
        ended = "refused: config" if isinstance(error, ConfigError) else f"refused: {type(error).__name__}"
        if not str(error) or any(not line.isprintable() for line in str(error).split("\n")):
            outcomes.fail(index, f"message {str(error)[:200]!r}")
    except TooSlowError:
        caught, ended = [], "too slow"
        outcomes.fail(index, f"more than {MAX_CPU_S:g} s of CPU time")
    except Exception as error:
        caught, ended = [], f"failed: {type(error).__name__}"
        where = traceback.extract_tb(error.__traceback__)[-1]
        location = f"{where.filename}:{where.lineno}"
        outcomes.fail(index, f"{type(error).__name__}: {str(error)[:200]} ({location})")
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    outcomes.seconds[index] = time.process_time() - start
    # what this package notes
    foreign = (warning for warning in caught if warning.category not in (UserWarning, impact.ImpactWarning))
    for line in dict.fromkeys(f"{w.category.__name__}: {w.message} ({w.filename}:{w.lineno})" for w in foreign):
        outcomes.fail(index, line)
    outcomes.counts[ended] += 1
    return ended


def judge_command(outcomes: Outcomes, index: int, forked: ForkServer, path: Path, ended: str) -> None:
    """Run a config by the command line, in a process of its own."""
    is_fit = "[data" in path.read_text(encoding="utf-8")
    words = ["calibrate", CONFIG] if is_fit else ["sweep", "--dry-run", CONFIG]
    done = forked(*words, cwd=path.parent, limit=300)
    outcomes.counts[f"command line: exit code {done.returncode}"] += 1
    problem = ""
    if done.returncode not in EXIT_CODES or ended.startswith("refused") != (done.returncode == 2):
        problem = f"exit code {done.returncode} where the config was {ended}"
    elif "Traceback" in done.stderr or "internal error" in done.stderr:
        problem = done.stderr
    elif done.seconds > MAX_CPU_S:
        problem = f"{done.seconds:.1f} s of CPU time"
    if problem:
        outcomes.fail(index, f"{' '.join(words)}: {problem[:300]}")


def fuzz(seed: int, indices: Sequence[int], n_fits: int, folder: Path, forked: ForkServer | None) -> Outcomes:
    """Mutate and run configs; each depends on the seed and its index alone."""
    corpus, outcomes = read_corpus(), Outcomes()

    def stop(number: int, frame: FrameType | None) -> None:
        raise TooSlowError

    previous = signal.signal(signal.SIGPROF, stop)
    for done, index in enumerate(indices, 1):
        path = write_files(folder, *mutated(random.Random(f"{seed}:{index}"), corpus))
        # the calibrations are spread over all configs
        with_fit = outcomes.counts["calibrated"] < n_fits * done / len(indices)
        ended = judge(outcomes, index, path, timed=index % TIMED == 0, with_fit=with_fit)
        if forked is not None and index % COMMAND == 0:
            judge_command(outcomes, index, forked, path, ended)
        if done % 1000 == 0:
            print(f"{done} configs, {len(outcomes.failures)} failures", file=sys.stderr, flush=True)
    signal.signal(signal.SIGPROF, previous)
    return outcomes


def main() -> int:
    """Print a table; returns 1 if a config failed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=10_000, help="number of configs")
    parser.add_argument("--calibrate", type=int, default=300, help="number of calibrations")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="index of a single config, which is printed")
    options = parser.parse_args()
    indices = range(options.count) if options.only is None else [options.only]
    n_fits = options.calibrate if options.only is None else 1
    with tempfile.TemporaryDirectory() as name, start_fork_server() as forked:
        outcomes = fuzz(options.seed, indices, n_fits, Path(name), None if options.only is not None else forked)
        if options.only is not None:
            text = (Path(name) / CONFIG).read_text(encoding="utf-8")
            for file in sorted(Path(name).iterdir()):
                if file.name == CONFIG or file.name in text:
                    print(f"--- {file.name}\n{file.read_bytes().decode('utf-8', 'replace')}")
    for ended, count in sorted(outcomes.counts.items()):
        print(f"{count:7d}  {ended}")
    slowest = sorted(outcomes.seconds.items(), key=lambda item: -item[1])[:3]
    total = sum(outcomes.seconds.values())
    print(f"CPU time: {total:.0f} s; the longest: " + ", ".join(f"{s:.2f} s (config {i})" for i, s in slowest))
    print(f"peak memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    for failure in outcomes.failures:
        print(f"seed {options.seed}, config {failure}")
    return 1 if outcomes.failures else 0


if __name__ == "__main__":
    sys.exit(main())
