"""The compiled core takes the same steps as the NumPy core, and is chosen for many trajectories."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.contact.impacts import Impacts
from impact.contact.model import ForceModel
from impact.contact.models import catalogue, find
from impact.contact.numba.dispatch import is_installed, serves
from impact.contact.output_formulas import Outputs, collide
from impact.contact.status import FIRST_FAILURE
from impact.contact.variables import CENTRAL_OUTPUTS
from impact.engine.plan import NUMBA_MIN_TRAJECTORIES
from impact.errors import ConfigError, UsageError
from impact.results.sweep import read_plan

from .conftest import ROOT, Run, assert_same_bits
from .problems import table1_impacts, with_parameters

RTOL, CORE_TOLERANCE = 1e-10, 1e-12
needs_numba = pytest.mark.skipif(not is_installed(), reason='numba is not installed (extra "fast")')
COMPILED_LAWS = [
    (key, n)
    for key, model in catalogue().items()
    if not model.same_as
    for n in ([model.exponent] if model.exponent else [1.0, 1.5, 2.0, 3.0])
    if any(serves(model, n))
]
# a law of every form and coordinate: undamped, hysteresis, damping with either release, an unloading branch
ONE_LAW_PER_FORM = [
    "hertz",
    "flores-2011",
    "tsuji-1992",
    "kuwabara-kono-1987",
    "gharib-hurmuzlu-2012-energetic",
    "thornton-1997",
]


def outputs_of(
    model: ForceModel, impacts: Impacts, core: str, rtol: float = RTOL, max_steps: int = 10_000
) -> Outputs:
    return collide(model, impacts, rtol=rtol, max_steps=max_steps, collapse=False, core=core)


def impacts_by(key: str, n: float, e: np.ndarray) -> Impacts:
    """Impacts by a law, from strong damping to none."""
    model, impacts = find(key), table1_impacts(n, e=e)
    return with_parameters(model, impacts, np.geomspace(0.01, 30.0, e.size)) if model.parameters else impacts


def output_distances(impacts: Impacts, outputs: Outputs, other: Outputs) -> dict[str, np.ndarray]:
    """The differences between outputs, each in units of its size."""
    size = {
        "peak_indentation": impacts.length,
        "permanent_indentation": impacts.length,
        "contact_time": outputs["contact_time"],
        "peak_force": outputs["peak_force"],
        "energy_loss": 0.5 * impacts.m * impacts.v0**2,
    }
    names = ("e_out", "v1_post", "v2_post", "energy_residual", "closed_form_error", *size)
    return {name: np.abs(outputs[name] - other[name]) / size.get(name, 1.0) for name in names}


@needs_numba
@pytest.mark.parametrize(("key", "n"), COMPILED_LAWS)
def test_both_cores_agree(key: str, n: float) -> None:
    impacts = impacts_by(key, n, np.linspace(0.001, 1.0, 70))
    by_numpy, by_numba = (outputs_of(find(key), impacts, core) for core in ("numpy", "numba"))
    np.testing.assert_array_equal(by_numpy["status"], by_numba["status"])
    same_steps = by_numpy["steps"] == by_numba["steps"]
    # rounding rarely changes the number of steps, except in trajectories of thousands of steps
    assert np.mean(same_steps | (by_numpy["steps"] > 1000)) > 0.9
    assert np.all(np.abs(by_numpy["steps"] - by_numba["steps"]) <= np.maximum(2, 0.005 * by_numpy["steps"]))
    for name, distance in output_distances(impacts, by_numpy, by_numba).items():
        assert np.array_equal(np.isnan(by_numpy[name]), np.isnan(by_numba[name])), name
        assert np.nanmax(distance[same_steps], initial=0.0) <= CORE_TOLERANCE, name
        assert np.nanmax(distance, initial=0.0) <= 10 * RTOL, name


@needs_numba
@pytest.mark.parametrize("key", ONE_LAW_PER_FORM)
@pytest.mark.parametrize(("rtol", "max_steps"), [(1e-4, 10_000), (1e-13, 10_000), (1e-10, 30)])
def test_both_cores_agree_at_any_tolerance_and_on_impacts_that_exceed_max_steps(
    key: str, rtol: float, max_steps: int
) -> None:
    impacts = impacts_by(key, find(key).exponent or 1.5, np.linspace(0.05, 1.0, 40))
    by_numpy, by_numba = (outputs_of(find(key), impacts, core, rtol, max_steps) for core in ("numpy", "numba"))
    np.testing.assert_array_equal(by_numpy["status"], by_numba["status"])
    np.testing.assert_allclose(by_numpy["e_out"], by_numba["e_out"], rtol=0.0, atol=max(CORE_TOLERANCE, 10 * rtol))
    if max_steps == 30:
        assert np.any(by_numpy["status"] >= FIRST_FAILURE)


@needs_numba
@pytest.mark.parametrize("key", ONE_LAW_PER_FORM)
def test_an_impact_has_the_same_bits_in_any_batch(key: str) -> None:
    model, impacts = find(key), impacts_by(key, find(key).exponent or 1.5, np.linspace(0.001, 1.0, 300))
    whole = outputs_of(model, impacts, "numba")
    for size in (1, 7, 64, 100):
        for first in range(0, 300, 100):
            indices = np.arange(first, first + size)
            alone = outputs_of(model, impacts[indices], "numba")
            for name in CENTRAL_OUTPUTS:
                expected = np.broadcast_to(whole[name], impacts.shape)
                assert np.broadcast_to(alone[name], size).tobytes() == expected[indices].tobytes(), name
    # in reverse order as well
    reversed_outputs = outputs_of(model, impacts[np.arange(300)[::-1]], "numba")
    assert reversed_outputs["e_out"][::-1].tobytes() == whole["e_out"].tobytes()


SWEEP = {
    "models": ["gharib-hurmuzlu-2012", "tsuji-1992-no-tension", "thornton-1997", "kogut-etsion-2005"],
    "sweep": {
        "e": {"linspace": [0.05, 1.0, 40]},
        "v1": {"geomspace": [0.01, 10.0, 300]},
        "m1": 1.0,
        "m2": 1.0,
        "material": "steel",
    },
    "materials": {"steel": {"E": 2.1e11, "nu": 0.3, "rho": 7850.0, "yield_strength": 3e8}},
}


@needs_numba
def test_results_agree_across_cores_threads_and_collapse() -> None:
    numpy = impact.sweep(SWEEP, overrides=['solver.core="numpy"'])
    numba = impact.sweep(SWEEP, overrides=['solver.core="numba"'])
    assert (numpy.attrs["core"], numba.attrs["core"]) == ("numpy", "numba")
    assert impact.compare(numba, numpy).equal
    assert not np.array_equal(numpy["e_out"].values, numba["e_out"].values)
    threads = impact.sweep(SWEEP, overrides=['solver.core="numba"'], threads=3)
    separate = impact.sweep(SWEEP, overrides=['solver.core="numba"', "solver.collapse=false"], threads=2)
    for other in (threads, separate):
        assert_same_bits(other, numba)
    assert impact.compare(separate, numpy).equal


@needs_numba
def test_threads_and_processes_write_the_same_file(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(
        'models = ["kuwabara-kono-1987"]\n[sweep]\nv1 = { geomspace = [0.01, 10.0, 20000] }\nm1 = 1.0\nm2 = 1.0\n'
        'K = 6e9\n[solver]\ncore = "numba"\n[model.kuwabara-kono-1987]\nA = 1e-6\n'
    )
    for words in ((), ("--threads", "2"), ("--jobs", "2")):
        process = cli(
            "sweep", "c.toml", "-o", f"{len(words)}{words[:1]}.h5".replace("'", ""), *words, cwd=tmp_path
        )
        assert process.returncode == 0, process.stderr
    files = [path.read_bytes() for path in tmp_path.glob("*.h5")]
    assert (len(files), len({*files})) == (3, 1)


def test_processes_and_threads_together_are_refused() -> None:
    with pytest.raises(UsageError, match="got jobs = 2 and threads = 2, expected one of them"):
        impact.sweep(SWEEP, overrides=['solver.core="numpy"'], jobs=2, threads=2)


# ---- choice of the core


def test_auto_chooses_numba_if_installed_and_above_a_number_of_trajectories() -> None:
    def core(count: int, key: str) -> str:
        v1 = {"geomspace": [0.1, 1.0, count]}
        plan = read_plan(
            {
                "models": key,
                "sweep": {"v1": v1, "m1": 1.0, "m2": 1.0, "K": 6e9},
                "model": {key: {"A": 1e-6}} if key == "kuwabara-kono-1987" else {},
            }
        )
        return plan.solver.core

    assert core(NUMBA_MIN_TRAJECTORIES - 1, "kuwabara-kono-1987") == "numpy"
    assert core(NUMBA_MIN_TRAJECTORIES, "kuwabara-kono-1987") == ("numba" if is_installed() else "numpy")
    # hertz has a single trajectory, whatever the speed
    assert core(NUMBA_MIN_TRAJECTORIES, "hertz") == "numpy"


@pytest.mark.skipif(is_installed(), reason="numba is installed")
def test_numba_is_refused_if_it_is_not_installed() -> None:
    with pytest.raises(
        ConfigError, match=r'solver.core: got "numba", expected numba, which is not installed \(pip'
    ):
        impact.sweep(SWEEP, overrides=['solver.core="numba"'])


def test_an_unknown_core_is_refused() -> None:
    with pytest.raises(ConfigError, match=r'solver\.core: got "fortran", expected one of auto, numpy, numba'):
        impact.sweep(SWEEP, overrides=['solver.core="fortran"'])


def test_the_core_of_a_law_depends_on_its_form_and_exponent(cli: Run) -> None:
    def core_of(key: str) -> str:
        return " ".join(cli("models", key).stdout.split("integrated by")[1].splitlines()[0].split())

    assert core_of("flores-2011") == "numba, where n is 1, 1.5, 2, 2.5, 3"
    assert core_of("exact-dashpot-no-tension") == "numba, where n is 1, 1.5, 2, 2.5, 3"
    assert core_of("thornton-1997") == "numba on restitution, numpy else"
    assert core_of("simscape-contact") == "numpy"
    # a user-defined law of the hysteresis family has its form
    model = impact.hysteresis(
        "mine", title="Mine", year=2026, equation="χ = 1 − e", reference="", chi=lambda e: 1 - e
    )
    assert serves(model, 1.5) == (True, True)
    assert serves(model, 1.3) == (False, False)


# ---- cache of compiled code, and the same code in plain Python

FORMS = """
import numpy as np
from impact.contact.output_formulas import collide
from impact.contact.models import find
from tests.problems import table1_impacts
for key in ("flores-2011", "exact-dashpot-no-tension", "gharib-hurmuzlu-2012-energetic"):
    e = np.linspace(1e-4, 1.0, {count})
    by_numpy, by_numba = (collide(find(key), table1_impacts(1.5, e=e), rtol={rtol}, max_steps=10_000, core=core)
                  for core in ("numpy", "numba"))
    assert np.array_equal(by_numpy["status"], by_numba["status"])
    assert np.array_equal(by_numpy["steps"], by_numba["steps"])
    assert np.abs(by_numpy["e_out"] - by_numba["e_out"]).max() <= 1e-12
    assert np.abs(by_numpy["peak_force"] / by_numba["peak_force"] - 1).max() <= 1e-12
from impact.contact.numba.kernel import KERNELS
"""
COUNTS = (
    "print(sum(sum(kernel.stats.cache_hits.values()) for kernel in KERNELS.values()), "
    "sum(sum(kernel.stats.cache_misses.values()) for kernel in KERNELS.values()))"
)


def run_python(program: str, **environment: str) -> str:
    """The output of a Python program in a new process."""
    process = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stderr
    return process.stdout


@needs_numba
def test_the_next_process_uses_the_cache_of_compiled_code(tmp_path: Path) -> None:
    program = FORMS.format(count=50, rtol=1e-10) + COUNTS
    assert run_python(program, NUMBA_CACHE_DIR=str(tmp_path)).split() == ["0", "10"]
    assert run_python(program, NUMBA_CACHE_DIR=str(tmp_path)).split() == ["10", "0"]


@needs_numba
def test_the_kernel_in_plain_python_agrees_with_numpy() -> None:
    program = (
        FORMS.format(count=3, rtol=1e-6) + "print(any(hasattr(kernel, 'stats') for kernel in KERNELS.values()))"
    )
    assert run_python(program, NUMBA_DISABLE_JIT="1").split() == ["False"]


# the cache of the kernels with a function that compiles fast; without capabilities root cannot write everywhere
TWICE = """
import ctypes
ctypes.CDLL(None).capset((ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)())
from impact.contact.numba.compile_cache import compiled

@compiled
def twice(x):
    return 2.0 * x

assert (twice(2.0), twice(3)) == (4.0, 6.0)
print(sum(twice.stats.cache_hits.values()))
"""


def run_compiling(folder: Path, home: str = "/dev/null") -> tuple[int, str, list[str]]:
    """The exit code, the cache hits and the notes of a process that compiles."""
    (folder / "twice.py").exists() or (folder / "twice.py").write_text(TWICE, encoding="utf-8")
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    process = subprocess.run(
        [sys.executable, "twice.py"],
        cwd=folder,
        capture_output=True,
        text=True,
        env={**environment, "HOME": home, "XDG_CACHE_HOME": f"{home}/cache"},
    )
    return (
        process.returncode,
        process.stdout.strip(),
        [line for line in process.stderr.splitlines() if "Warning: " in line],
    )


@needs_numba
def test_without_a_writable_folder_for_the_cache_code_is_compiled_with_one_note(tmp_path: Path) -> None:
    assert run_compiling(tmp_path)[:2] == (0, "0")
    shutil.rmtree(tmp_path / "__pycache__")
    tmp_path.chmod(0o555)
    code, hits, notes = run_compiling(tmp_path)
    tmp_path.chmod(0o755)
    assert (code, hits, len(notes)) == (0, "0", 1)
    assert "compiled code is not kept: no folder for it can be written to" in notes[0]


@needs_numba
@pytest.mark.parametrize(("suffix", "how"), [(".nbc", "truncated"), (".nbc", "flipped"), (".nbi", "truncated")])
def test_damaged_compiled_code_is_compiled_again_with_a_note(tmp_path: Path, suffix: str, how: str) -> None:
    assert run_compiling(tmp_path) == (0, "0", [])
    for path in tmp_path.rglob(f"*{suffix}"):
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 0x10
        path.write_bytes(content if how == "flipped" else content[: len(content) // 2])
    code, hits, notes = run_compiling(tmp_path)
    assert (code, hits, len(notes)) == (0, "0", 1)
    assert "is damaged and is compiled again" in notes[0]
    assert run_compiling(tmp_path) == (0, "2", [])


@needs_numba
def test_a_number_of_threads_that_numba_refuses_is_reported(cli: Run, tmp_path: Path) -> None:
    words = ("sweep", ROOT / "configs" / "figure6.toml", "-o", tmp_path / "r.h5", "--set", 'solver.core="numba"')
    done = cli(*words, NUMBA_NUM_THREADS="0")
    reason = "ValueError: Number of threads specified must be > 0."
    assert (done.returncode, done.stderr) == (2, f"numba cannot be imported: {reason}\n")
