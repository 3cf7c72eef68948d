"""`impact doctor`: versions of what is installed."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import pytest

import impact

from .conftest import Run


def test_versions_are_those_of_the_packages(cli: Run) -> None:
    found = json.loads(cli("doctor", "--json").stdout)
    assert list(found) == ["impact", "python", "platform", "packages", "core", "codes"]
    assert found["impact"] == impact.__version__
    assert found["python"] == sys.version.split()[0]
    assert found["packages"]["h5py"] == metadata.version("h5py")
    assert "pytest" not in found["packages"]
    assert (found["core"]["numba"] is None) == (find_spec("numba") is None)
    assert {code["code"]: code["version"] for code in found["codes"]} == {
        code["code"]: code["installed"] for code in impact.export_codes() if code["code"] in str(found["codes"])
    }


def test_the_text_has_parts_for_the_program_its_packages_the_compiled_core_and_the_codes(cli: Run) -> None:
    program, packages, core, codes = (
        [" ".join(line.split()) for line in part.splitlines()] for part in cli("doctor").stdout.split("\n\n")
    )
    assert program[:2] == [f"impact {impact.__version__}", f"Python {sys.version.split()[0]}"]
    assert packages[0] == "package version"
    assert f"h5py {metadata.version('h5py')}" in packages
    assert [line.startswith("compiled core: ") for line in core] == [True]
    assert codes[0] == "code version program"
    assert any(line.startswith("lammps ") for line in codes)


def test_a_source_tree_that_is_not_installed_has_versions_too() -> None:
    # without the folders of packages there is no metadata, as if only the sources were on the path
    words = "import sys, impact; doctor = impact.doctor; sys.path[:] = []; print(doctor().impact)"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, encoding="utf-8")
    assert done.stdout.strip() == impact.__version__, done.stderr


@pytest.mark.slow
def test_a_code_on_the_path_is_found_with_its_version(cli: Run, tmp_path: Path) -> None:
    program = tmp_path / "lmp"
    program.write_text(
        '#!/bin/sh\necho "Large-scale Atomic/Molecular Massively Parallel Simulator - 22 Jul 2025"\n'
    )
    program.chmod(0o755)
    done = cli("doctor", "--json", PATH=f"{tmp_path}:/usr/bin:/bin")
    lammps = json.loads(done.stdout)["codes"][0]
    assert lammps["code"] == "lammps"
    if not (Path(sys.executable).parent / "lmp").exists():
        assert lammps == {"code": "lammps", "version": "20250722", "program": str(program)}
    text = cli("doctor", PATH=f"{tmp_path}:/usr/bin:/bin").stdout
    assert " ".join(map(str, lammps.values())) in [" ".join(line.split()) for line in text.splitlines()]
