"""Text of a file, a name or a value controls no terminal and forges no line of a message."""

from __future__ import annotations

import pickle
import re
import traceback
from collections.abc import Callable
from pathlib import Path

import pytest

import impact
from impact.errors import MAX_PROBLEM, ConfigError, ImpactError

from .conftest import Run

HOSTILE = "a\x1b[31m\x07\u202e\u2028\x85b\r\nOK: equal"
SMALL = 'models = "hertz"\n[sweep]\ne = 0.5\nv1 = 1.0\nm1 = 1.0\nm2 = 1.0\nK = 1e6\n'
# what must not be printed: control and bidi characters, and a line that begins with the forged text
FORGED = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028\u202e]|^OK: equal", re.MULTILINE)


@pytest.mark.parametrize(
    "words",
    [
        ["sweep", HOSTILE],
        ["sweep", "hostile.toml"],
        ["sweep", "small.toml", "--set", f"sweep.{HOSTILE}=1"],
        ["sweep", "small.toml", "-o", f"{HOSTILE}/x.h5"],
        ["merge", HOSTILE, "-o", "x.h5"],
        ["run", "--model", HOSTILE],
        ["run", "--at", f"{HOSTILE}=1"],
        ["run", "--at", f"e={HOSTILE}"],
        ["run", "--plugin", HOSTILE],
        ["run", "--plugin", "hostile.py"],
        ["solve", "--model", HOSTILE, "--for", "e", "--target", "e_out=0.5"],
        ["timestep", "--model", "hertz", "--scheme", HOSTILE],
        ["export", "--to", HOSTILE],
        ["export", "--to", "lammps", "--code-version", HOSTILE],
        ["export", "--to", "lammps", "--model", HOSTILE],
        ["calibrate", HOSTILE],
        ["info", HOSTILE],
        ["plot", HOSTILE],
        ["compare", HOSTILE, HOSTILE],
        ["bless", HOSTILE, HOSTILE, "--reason", HOSTILE],
        ["models", HOSTILE],
        ["models", "--family", HOSTILE],
    ],
    ids=lambda words: " ".join(words).replace(HOSTILE, "HOSTILE"),
)
def test_a_command_prints_no_control_character_and_no_forged_line(
    cli: Run, tmp_path: Path, words: list[str]
) -> None:
    (tmp_path / "hostile.toml").write_text('models = "a\\u001b[31m\\nOK: equal"\n[sweep]\ne = 0.5\n', "utf-8")
    (tmp_path / "small.toml").write_text(SMALL, "utf-8")
    (tmp_path / "hostile.py").write_text(f"raise ValueError({HOSTILE!r})\n", "utf-8")
    done = cli(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert "a\\x1b[31m" in done.stderr
    assert not FORGED.search(done.stdout + done.stderr)


@pytest.mark.parametrize(
    "act",
    [
        lambda: impact.sweep({"models": HOSTILE, "sweep": {"e": 0.5, HOSTILE: 1.0}}),
        lambda: impact.run(model=HOSTILE),
        lambda: impact.load(HOSTILE),
        lambda: impact.export(HOSTILE),
        lambda: impact.models(plugins=[HOSTILE]),
        lambda: impact.recommend(impact.sweep("configs/figure6.toml"), models=[HOSTILE]),
    ],
    ids=["sweep", "run", "load", "export", "models", "recommend"],
)
def test_a_traceback_shows_it_escaped(act: Callable[[], object]) -> None:
    with pytest.raises(ImpactError) as caught:
        act()
    lines = "".join(traceback.format_exception_only(caught.value))
    assert "a\\x1b[31m" in lines
    assert not FORGED.search(lines)
    assert not FORGED.search(str(caught.getrepr(style="line")))


def test_each_problem_is_one_line_also_in_another_process_and_in_another_error() -> None:
    error = ConfigError(f"x.toml:1: {HOSTILE}", "x.toml:2: e")
    assert len(str(error).splitlines()) == len(error.problems) == 2
    for again in (pickle.loads(pickle.dumps(error)), ConfigError(*error.problems)):
        assert again.problems == error.problems
        assert str(again) == str(error)


def test_a_long_problem_still_says_what_was_expected() -> None:
    (problem,) = ImpactError(f"x.toml:1: got {'x' * 10 * MAX_PROBLEM}, expected a number").problems
    assert len(problem) == MAX_PROBLEM
    assert problem.startswith("x.toml:1: got x")
    assert problem.endswith("x, expected a number")
