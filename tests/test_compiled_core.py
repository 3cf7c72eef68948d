"""The compiled core does what the other does, step for step; and is taken where it is worth it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.api import prepare
from impact.contact.impacts import Impacts
from impact.contact.model import ForceModel
from impact.contact.models import catalogue, find
from impact.contact.numba.dispatch import is_installed, serves
from impact.contact.outputs import OUTPUTS, Outputs, collide
from impact.contact.status import FIRST_FAILURE
from impact.engine.execute import NUMBA_MIN_TRAJECTORIES, with_core
from impact.engine.trajectories import trajectory_maps
from impact.errors import ConfigError, UsageError

from .conftest import ROOT, Run
from .problems import table1_impacts, with_parameters

RTOL, EQUAL = 1e-10, 1e-12
compiled = pytest.mark.skipif(not is_installed(), reason='numba is not installed (extra "fast")')
LAWS = [
    (key, n)
    for key, model in catalogue().items()
    if not model.same_as
    for n in ([model.exponent] if model.exponent else [1.0, 1.5, 2.0, 3.0])
    if any(serves(model, n))
]
# of every form and coordinate: none, hysteresis, drag to either end, a branch of unloading
FEW = [
    "hertz",
    "flores-2011",
    "tsuji-1992",
    "kuwabara-kono-1987",
    "gharib-hurmuzlu-2012-energetic",
    "thornton-1997",
]


def struck(model: ForceModel, lanes: Impacts, core: str, rtol: float = RTOL, max_steps: int = 10_000) -> Outputs:
    return collide(model, lanes, rtol=rtol, max_steps=max_steps, collapse=False, core=core)


def of(key: str, n: float, e: np.ndarray) -> Impacts:
    """Impacts by a law, from strong damping to none."""
    model, lanes = find(key), table1_impacts(n, e=e)
    return with_parameters(model, lanes, np.geomspace(0.01, 30.0, e.size)) if model.parameters else lanes


def off(lanes: Impacts, contact: Outputs, other: Outputs) -> dict[str, np.ndarray]:
    """How far the outputs of impacts are from one another, each in a unit of its own."""
    size = {"peak_indentation": lanes.length, "permanent_indentation": lanes.length,
            "contact_time": contact["contact_time"], "peak_force": contact["peak_force"],
            "energy_loss": 0.5 * lanes.m * lanes.v0**2}  # fmt: skip
    names = ("e_out", "v1_post", "v2_post", "energy_residual", "closed_form_error", *size)
    return {name: np.abs(contact[name] - other[name]) / size.get(name, 1.0) for name in names}


@compiled
@pytest.mark.parametrize(("key", "n"), LAWS)
def test_both_cores_agree(key: str, n: float) -> None:
    lanes = of(key, n, np.linspace(0.001, 1.0, 70))
    one, other = (struck(find(key), lanes, core) for core in ("numpy", "numba"))
    np.testing.assert_array_equal(one["status"], other["status"])
    alike = one["steps"] == other["steps"]
    # rounding seldom decides about a step, but in lanes of thousands about one or the other
    assert np.mean(alike | (one["steps"] > 1000)) > 0.9
    assert np.all(np.abs(one["steps"] - other["steps"]) <= np.maximum(2, 0.005 * one["steps"]))
    for name, distance in off(lanes, one, other).items():
        assert np.array_equal(np.isnan(one[name]), np.isnan(other[name])), name
        assert np.nanmax(distance[alike], initial=0.0) <= EQUAL, name
        assert np.nanmax(distance, initial=0.0) <= 10 * RTOL, name


@compiled
@pytest.mark.parametrize("key", FEW)
@pytest.mark.parametrize(("rtol", "max_steps"), [(1e-4, 10_000), (1e-13, 10_000), (1e-10, 30)])
def test_both_cores_agree_at_any_tolerance_and_on_what_is_given_up(key: str, rtol: float, max_steps: int) -> None:
    lanes = of(key, find(key).exponent or 1.5, np.linspace(0.05, 1.0, 40))
    one, other = (struck(find(key), lanes, core, rtol, max_steps) for core in ("numpy", "numba"))
    np.testing.assert_array_equal(one["status"], other["status"])
    np.testing.assert_allclose(one["e_out"], other["e_out"], rtol=0.0, atol=max(EQUAL, 10 * rtol))
    if max_steps == 30:
        assert np.any(one["status"] >= FIRST_FAILURE)


@compiled
@pytest.mark.parametrize("key", FEW)
def test_a_lane_has_the_same_bits_in_any_company(key: str) -> None:
    model, lanes = find(key), of(key, find(key).exponent or 1.5, np.linspace(0.001, 1.0, 300))
    whole = struck(model, lanes, "numba")
    for size in (1, 7, 64, 100):
        for first in range(0, 300, 100):
            part = np.arange(first, first + size)
            alone = struck(model, lanes[part], "numba")
            for name in OUTPUTS:
                every = np.broadcast_to(whole[name], lanes.shape)
                assert np.broadcast_to(alone[name], size).tobytes() == every[part].tobytes(), name
    # nor does the order matter
    turned = struck(model, lanes[np.arange(300)[::-1]], "numba")
    assert turned["e_out"][::-1].tobytes() == whole["e_out"].tobytes()


SWEEP = {
    "models": ["gharib-hurmuzlu-2012", "tsuji-1992-no-tension", "thornton-1997", "kogut-etsion-2005"],
    "sweep": {"e": {"linspace": [0.05, 1.0, 40]}, "v1": {"geomspace": [0.01, 10.0, 300]}, "m1": 1.0, "m2": 1.0,
              "material": "steel"},
    "materials": {"steel": {"E": 2.1e11, "nu": 0.3, "rho": 7850.0, "yield_strength": 3e8}},
}  # fmt: skip


@compiled
def test_results_agree_across_cores_threads_and_collapse() -> None:
    numpy = impact.sweep(SWEEP, overrides=['solver.core="numpy"'])
    numba = impact.sweep(SWEEP, overrides=['solver.core="numba"'])
    assert (numpy.attrs["core"], numba.attrs["core"]) == ("numpy", "numba")
    assert impact.compare(numba, numpy).equal
    assert not np.array_equal(numpy["e_out"].values, numba["e_out"].values)
    threads = impact.sweep(SWEEP, overrides=['solver.core="numba"'], threads=3)
    each = impact.sweep(SWEEP, overrides=['solver.core="numba"', "solver.collapse=false"], threads=2)
    for other in (threads, each):
        for name in numba.data_vars:
            assert other[name].values.tobytes() == numba[name].values.tobytes(), name
    assert impact.compare(each, numpy).equal


@compiled
def test_files_of_threads_and_processes_are_the_same(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(
        'models = ["kuwabara-kono-1987"]\n[sweep]\nv1 = { geomspace = [0.01, 10.0, 20000] }\nm1 = 1.0\nm2 = 1.0\n'
        'K = 6e9\n[solver]\ncore = "numba"\n[model.kuwabara-kono-1987]\nA = 1e-6\n'
    )
    for words in ((), ("--threads", "2"), ("--jobs", "2")):
        done = cli("sweep", "c.toml", "-o", f"{len(words)}{words[:1]}.h5".replace("'", ""), *words, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    files = [path.read_bytes() for path in tmp_path.glob("*.h5")]
    assert (len(files), len({*files})) == (3, 1)


def test_processes_and_threads_are_one_or_the_other() -> None:
    with pytest.raises(UsageError, match="got jobs = 2 and threads = 2, expected one of them"):
        impact.sweep(SWEEP, overrides=['solver.core="numpy"'], jobs=2, threads=2)


# ---- which core


def test_auto_takes_numba_where_it_is_installed_and_worth_it() -> None:
    def core(count: int, key: str) -> str:
        v1 = {"geomspace": [0.1, 1.0, count]}
        plan = prepare({"models": key, "sweep": {"v1": v1, "m1": 1.0, "m2": 1.0, "K": 6e9},
                        "model": {key: {"A": 1e-6}} if key == "kuwabara-kono-1987" else {}})  # fmt: skip
        return with_core(plan, trajectory_maps(plan)).config.solver.core

    assert core(NUMBA_MIN_TRAJECTORIES - 1, "kuwabara-kono-1987") == "numpy"
    assert core(NUMBA_MIN_TRAJECTORIES, "kuwabara-kono-1987") == ("numba" if is_installed() else "numpy")
    # which is one impact, whatever its speed
    assert core(NUMBA_MIN_TRAJECTORIES, "hertz") == "numpy"


@pytest.mark.skipif(is_installed(), reason="numba is installed")
def test_numba_where_it_is_not_installed() -> None:
    with pytest.raises(
        ConfigError, match=r'solver.core: got "numba", expected numba, which is not installed \(pip'
    ):
        impact.sweep(SWEEP, overrides=['solver.core="numba"'])


def test_a_core_that_there_is_not() -> None:
    with pytest.raises(ConfigError, match=r'solver\.core: got "fortran", expected one of auto, numpy, numba'):
        impact.sweep(SWEEP, overrides=['solver.core="fortran"'])


def test_which_core_integrates_which_law(cli: Run) -> None:
    def told(key: str) -> str:
        return " ".join(cli("models", key).stdout.split("integrated by")[1].splitlines()[0].split())

    assert told("flores-2011") == "numba, where n is 1, 1.5, 2, 2.5, 3"
    assert told("exact-dashpot-no-tension") == "numba, where n is 1, 1.5, 2, 2.5, 3"
    assert told("thornton-1997") == "numba on restitution, numpy else"
    assert told("simscape-contact") == "numpy"
    # a law of one's own has the form of those it is made like
    mine = impact.hysteresis(
        "mine", title="Mine", year=2026, equation="χ = 1 − e", reference="", chi=lambda e: 1 - e
    )
    assert serves(mine, 1.5) == (True, True)
    assert serves(mine, 1.3) == (False, False)


# ---- what is kept of the compiler's work, and Python in its place

FORMS = """
import numpy as np
from impact.contact.outputs import collide
from impact.contact.models import find
from tests.problems import table1_impacts
for key in ("flores-2011", "exact-dashpot-no-tension", "gharib-hurmuzlu-2012-energetic"):
    e = np.linspace(1e-4, 1.0, {count})
    one, other = (collide(find(key), table1_impacts(1.5, e=e), rtol={rtol}, max_steps=10_000, core=core)
                  for core in ("numpy", "numba"))
    assert np.array_equal(one["status"], other["status"])
    assert np.array_equal(one["steps"], other["steps"])
    assert np.abs(one["e_out"] - other["e_out"]).max() <= 1e-12
    assert np.abs(one["peak_force"] / other["peak_force"] - 1).max() <= 1e-12
from impact.contact.numba.kernel import KERNELS
"""
COUNTS = "print(sum(sum(one.stats.cache_hits.values()) for one in KERNELS.values()), " \
    "sum(sum(one.stats.cache_misses.values()) for one in KERNELS.values()))"  # fmt: skip


def child(program: str, **environment: str) -> str:
    """What a process of its own prints."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@compiled
def test_what_is_compiled_is_there_for_the_next_process(tmp_path: Path) -> None:
    program = FORMS.format(count=50, rtol=1e-10) + COUNTS
    assert child(program, NUMBA_CACHE_DIR=str(tmp_path)).split() == ["0", "10"]
    assert child(program, NUMBA_CACHE_DIR=str(tmp_path)).split() == ["10", "0"]


@compiled
def test_as_plain_python_it_is_the_same() -> None:
    program = FORMS.format(count=3, rtol=1e-6) + "print(any(hasattr(one, 'stats') for one in KERNELS.values()))"
    assert child(program, NUMBA_DISABLE_JIT="1").split() == ["False"]


# the cache of the kernels, of a function that is compiled in no time; without its capabilities root may write
# only where others may
TWICE = """
import ctypes
ctypes.CDLL(None).capset((ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)())
from impact.contact.numba.compile_cache import compiled

@compiled()
def twice(x):
    return 2.0 * x

assert (twice(2.0), twice(3)) == (4.0, 6.0)
print(sum(twice.stats.cache_hits.values()))
"""


def compiling(folder: Path, home: str = "/dev/null") -> tuple[int, str, list[str]]:
    """The exit code of a process that compiles, what it found in its cache, and its notes."""
    (folder / "twice.py").exists() or (folder / "twice.py").write_text(TWICE, encoding="utf-8")
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "twice.py"], cwd=folder, capture_output=True, text=True,
        env={**environment, "HOME": home, "XDG_CACHE_HOME": f"{home}/cache"},
    )  # fmt: skip
    return done.returncode, done.stdout.strip(), [line for line in done.stderr.splitlines() if "Warning: " in line]


@compiled
def test_without_a_folder_for_its_cache_it_compiles_and_notes_that_once(tmp_path: Path) -> None:
    assert compiling(tmp_path)[:2] == (0, "0")
    shutil.rmtree(tmp_path / "__pycache__")
    tmp_path.chmod(0o555)
    code, hits, notes = compiling(tmp_path)
    tmp_path.chmod(0o755)
    assert (code, hits, len(notes)) == (0, "0", 1)
    assert "compiled code is not kept: no folder for it can be written to" in notes[0]


@compiled
@pytest.mark.parametrize(("suffix", "how"), [(".nbc", "truncated"), (".nbc", "flipped"), (".nbi", "truncated")])
def test_damaged_compiled_code_is_compiled_again_with_a_note(tmp_path: Path, suffix: str, how: str) -> None:
    assert compiling(tmp_path) == (0, "0", [])
    for path in tmp_path.rglob(f"*{suffix}"):
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 0x10
        path.write_bytes(content if how == "flipped" else content[: len(content) // 2])
    code, hits, notes = compiling(tmp_path)
    assert (code, hits, len(notes)) == (0, "0", 1)
    assert "is damaged and is compiled again" in notes[0]
    assert compiling(tmp_path) == (0, "2", [])
