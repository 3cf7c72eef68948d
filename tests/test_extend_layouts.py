"""An extended result holds what the sweep done at once holds, whichever layouts the two have."""

from __future__ import annotations

from pathlib import Path

import pytest

import impact

from .conftest import Run

CONFIG = """
models = ["hertz", "gharib-hurmuzlu-2012"]
[solver]
rtol = 1e-4
[sweep]
e = [0.2, 0.5]
v1 = 1.0
m1 = 1.0
m2 = [1.0, 2.0]
K = 1e9
[output]
layout = "{layout}"
"""
MORE = "sweep.e=[0.2, 0.5, 0.9]"


@pytest.mark.parametrize("before", ["full", "factored"])
@pytest.mark.parametrize("after", ["full", "factored"])
def test_between_layouts(before: str, after: str, cli: Run, tmp_path: Path) -> None:
    (tmp_path / "config.toml").write_text(CONFIG.format(layout=before), encoding="utf-8")
    layout = ("--set", f'output.layout="{after}"')
    assert cli("sweep", "config.toml", "-o", "smaller.h5", cwd=tmp_path).returncode == 0
    assert cli("sweep", "config.toml", "-o", "once.h5", "--set", MORE, *layout, cwd=tmp_path).returncode == 0
    done = cli("extend", "smaller.h5", "-o", "larger.h5", "--set", MORE, *layout, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    larger, once = (impact.load(tmp_path / name) for name in ("larger.h5", "once.h5"))
    assert larger.encoding["layout"] == once.encoding["layout"] == after
    # the attributes tell of the extension
    assert larger.drop_attrs(deep=False).identical(once.drop_attrs(deep=False))


def test_what_is_stored_of_a_point_stays(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "config.toml").write_text(CONFIG.format(layout="full"), encoding="utf-8")
    assert cli("sweep", "config.toml", "-o", "r.h5", cwd=tmp_path).returncode == 0
    before = (tmp_path / "r.h5").read_bytes()
    for change in ('output.dtype="float32"', 'output.variables=["e_out"]'):
        done = cli("extend", "r.h5", "--set", MORE, "--set", change, cwd=tmp_path)
        assert done.returncode == 2
        assert done.stderr.startswith(f"r.h5: --set changes {change.partition('=')[0]}, expected more values")
    assert (tmp_path / "r.h5").read_bytes() == before
