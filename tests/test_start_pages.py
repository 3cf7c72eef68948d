"""The first pages of the site: five minutes, troubleshooting, and how wide the lines of tutorials are."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from .conftest import ROOT, Run, code_blocks, examples_of

DOCS = ROOT / "docs"
START = (DOCS / "start.md").read_text(encoding="utf-8")
# characters of a line of code that fit at a width of the window of 1,280 px
FIT = 121


@pytest.mark.slow
def test_the_commands_of_five_minutes_run_in_their_order(cli: Run, tmp_path: Path) -> None:
    (config,) = code_blocks(START, "toml")
    (tmp_path / "first.toml").write_text(config, encoding="utf-8")
    for line in "".join(code_blocks(START, "sh")).splitlines():
        done = cli(*shlex.split(line)[1:], cwd=tmp_path)
        assert done.returncode == 0, (line, done.stderr)
        if line.startswith("impact run"):
            assert re.search(r"e_out +0\.7119", done.stdout)
    assert {path.name for path in tmp_path.iterdir()} >= {"first.h5", "first.png", "first.html"}


@pytest.mark.slow
def test_the_python_of_five_minutes(tmp_path: Path) -> None:
    (code,) = code_blocks(START, "python")
    words = [sys.executable, "-W", "error", "-c", code]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
def test_the_messages_of_troubleshooting_are_those_of_its_commands(cli: Run, tmp_path: Path) -> None:
    """In the order of the page, whose commands use the files of those before; `...` stands for other lines."""
    (tmp_path / "docs").symlink_to(DOCS)
    examples = examples_of("docs/troubleshooting.md")
    assert len(examples) >= 8
    for command, printed in examples:
        done = cli(*shlex.split(command), cwd=tmp_path)
        lines = iter([*done.stderr.splitlines(), *done.stdout.splitlines()])
        if "..." not in printed:
            assert [line.split() for line in lines] == [line.split() for line in printed.splitlines()]
        else:
            for wanted in printed.splitlines():
                assert wanted == "..." or any(wanted.split() == line.split() for line in lines), (command, wanted)
        has_answer = re.search("note: peak|no_impact|no value", printed)
        assert done.returncode == (0 if has_answer else 2), command


def long_lines(page: Path) -> Iterator[str]:
    """Lines that a browser would cut or break; comments in what a command prints may be broken."""
    for language in ("console", "sh", "toml", "text", "python"):
        for line in "".join(code_blocks(page.read_text(encoding="utf-8"), language)).splitlines():
            if len(line) > FIT and not line.startswith(("# ", "<!--", "at dt", "largest residuals")):
                yield line


@pytest.mark.parametrize(
    "page", [*sorted((DOCS / "tutorials").glob("*.md")), DOCS / "start.md"], ids=lambda p: p.stem
)
def test_the_commands_of_a_tutorial_fit_a_window(page: Path) -> None:
    assert [*long_lines(page)] == []
