"""The examples of docs/storage.md print what the page shows, and its limits are those of the code."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import h5py
import pytest

import impact
from impact.comparison.values import MAX_COMPARED_POINTS as MAX_COMPARED
from impact.config.grid import MAX_AXES, MAX_CHUNK_POINTS, MAX_COUNTED_POINTS, MAX_POINTS, MAX_STORED_CHUNKS
from impact.config.quantities import MAX_AXIS_VALUES
from impact.engine.plan import MAX_FULL_POINTS
from impact.plots.slices import MAX_DRAWN
from impact.results.layouts import N_WITNESSES, WITNESS_TOLERANCE
from impact.results.netcdf import MAX_LABEL_BYTES
from impact.results.ranking import MAX_RANKED_POINTS
from impact.results.slabs import MAX_SUMMARY_POINTS
from impact.results.trajectory_table import MAX_STIFFNESS_VALUES
from impact.results.xarray_backend import MAX_LOADED_BYTES

from .conftest import ROOT, Run

PAGE = (ROOT / "docs" / "storage.md").read_text(encoding="utf-8")
# last digits, seals, sizes of files and of the memory are those of a machine and of what is installed on it
OF_A_MACHINE = re.compile(r"[\d.]+e-1\d|[0-9a-f]{64}|[\d,]+(?= bytes$)|(?<=at most )[\d,]+")


def blocks() -> list[tuple[str, str]]:
    """All code blocks of the page in order: language and text."""
    return re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)


def shell(line: str, cli: Run, folder: Path) -> str:
    """What a line of a shell block prints; nothing where its program is not installed."""
    program, *words = shlex.split(line)
    if program in ("ncdump", "h5ls") and not shutil.which(program):
        return ""
    if program == "impact":
        done = cli(*words, cwd=folder)
    else:
        bash = ["bash", "-c", line]
        done = subprocess.run(bash, cwd=folder, capture_output=True, text=True, errors="replace", check=False)
    assert done.returncode == 0, (line, done.stderr)
    return done.stdout + done.stderr


@pytest.mark.slow
def test_the_examples_print_what_the_page_shows(cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with h5py.File("old.h5", "w") as old:
        for name, text in {"config": "models = 'hertz'", "config_set": '["sweep.e=0.5"]'}.items():
            old.attrs.create(name, text, dtype=h5py.string_dtype("utf-8", len(text)))
    printed, ran = "", 0
    for language, text in blocks():
        if language == "toml" and "[sweep]" in text:
            Path("large.toml").write_text(text, encoding="utf-8")
        elif language == "sh":
            printed = "".join(shell(line, cli, tmp_path) for line in text.splitlines())
            ran += 1
        elif language == "python":
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                exec(text, {})
            printed = out.getvalue()
            ran += 1
        elif language == "text":
            shown = {OF_A_MACHINE.sub("*", line.rstrip()) for line in printed.splitlines()}
            for line in text.splitlines():
                assert OF_A_MACHINE.sub("*", line.rstrip()) in shown, (line, printed)
    assert ran == 10
    (size,) = re.findall(r"writes a file of ([\d.]+) MB", PAGE)
    assert f"{Path('large.h5').stat().st_size / 1e6:.1f}" == size
    # the last block prints the config of a file of version 1
    assert printed == "models = 'hertz'\n[\"sweep.e=0.5\"]\n"


@pytest.mark.slow
def test_the_layouts_hold_the_same_values(cli: Run, tmp_path: Path) -> None:
    (chosen,) = (text for language, text in blocks() if language == "toml" and "[output]" in text)
    config = (ROOT / "configs" / "figure6.toml").read_text(encoding="utf-8") + "\n[solver]\nrtol = 1e-4\n"
    (tmp_path / "factored.toml").write_text(config + chosen, encoding="utf-8")
    (tmp_path / "full.toml").write_text(config, encoding="utf-8")
    results = {}
    for layout in ("factored", "full"):
        assert cli("sweep", f"{layout}.toml", "-o", f"{layout}.h5", cwd=tmp_path).returncode == 0
        results[layout] = impact.load(tmp_path / f"{layout}.h5")
        assert results[layout].encoding["layout"] == layout
    full, factored = (result.drop_attrs(deep=False) for result in results.values())
    assert full.identical(factored)


def test_a_law_that_cannot_be_factored_is_refused_before_it_is_integrated(cli: Run, tmp_path: Path) -> None:
    config = """
    models = ["mujoco-solref"]
    [sweep]
    v1 = 1.0
    m1 = {{ linspace = [1.0, 2.0, {size}] }}
    m2 = {{ linspace = [1.0, 2.0, 1000] }}
    [output]
    layout = "factored"
    """
    (tmp_path / "config.toml").write_text(config.format(size=1001), encoding="utf-8")
    for words in ((), ("--shard", "1/2")):
        done = cli("sweep", "config.toml", *words, cwd=tmp_path)
        assert done.returncode == 2
        reason = "mujoco-solref has a rule of K that takes more than 1,000,000 values"
        assert done.stderr.startswith(f"output.layout: {reason}")
        assert [path.name for path in tmp_path.iterdir()] == ["config.toml"]


def test_the_limits_of_the_page_are_those_of_the_code() -> None:
    assert (MAX_FULL_POINTS, MAX_POINTS, MAX_COMPARED, MAX_STIFFNESS_VALUES) == (10**7, 10**9, 10**10, 10**6)
    assert (MAX_SUMMARY_POINTS, MAX_RANKED_POINTS, MAX_DRAWN, MAX_COUNTED_POINTS) == (2**26, 2**30, 2**24, 2**62)
    assert (MAX_LOADED_BYTES, MAX_LABEL_BYTES, MAX_AXES, WITNESS_TOLERANCE) == (512 * 2**20, 4 * 10**6, 31, 1e-12)
    shown = "10^7 10^9 10^10 10^6 2^26 2^30 2^24 2^62 1e-12"
    for text in ("512 MB", "4 MB", "| 31;", *shown.split()):
        assert text in PAGE
    for number in (MAX_AXIS_VALUES, N_WITNESSES, MAX_STORED_CHUNKS, MAX_CHUNK_POINTS):
        assert f"{number:,}" in PAGE


def test_the_page_names_all_variables_of_a_factored_file(tmp_path: Path) -> None:
    from impact.results.validation import TABLE_VARIABLES

    named = set(re.findall(r"`(\w+)`", PAGE.partition("## Other readers")[2].partition("## Witnesses")[0]))
    for name in TABLE_VARIABLES:
        group, _, rest = name.partition("_")
        assert name in named or f"_{rest}" in named or (group == "witness" and "witness_e_out" in named), name
