"""Mutated configs and CSV files end in a result or a message; scripts/fuzz_configs.py runs thousands of them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from .conftest import ROOT
from .fork_server import ForkServer

sys.path.insert(0, str(ROOT / "scripts"))

from fuzz_configs import Outcomes, fuzz, judge, write_files


@pytest.mark.parametrize(
    ("count", "n_fits"),
    [
        pytest.param(300, 6, marks=pytest.mark.slow),
        pytest.param(1000, 20, marks=pytest.mark.long),
    ],
    ids=["300", "1000"],
)
def test_every_mutated_config_ends_as_documented(
    tmp_path: Path, forked: ForkServer, count: int, n_fits: int
) -> None:
    outcomes = fuzz(2, range(count), n_fits, tmp_path, forked)
    assert not outcomes.failures
    assert outcomes.counts["calibrated"] == n_fits
    assert outcomes.counts["command line: exit code 2"] + outcomes.counts["command line: exit code 0"] == -(
        -count // 100
    )
    # mutations that only ever break a config would test nothing but the first check
    assert outcomes.counts["planned"] + outcomes.counts["planned and timed"] > count / 5
    assert outcomes.counts["refused: config"] > count / 5


def test_an_internal_error_is_a_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise KeyError("of our own")

    outcomes, text = Outcomes(), 'models = "hertz"\n[sweep]\nv1 = 1\nm1 = 1\nm2 = 1\nK = 1e6\n'
    path = write_files(tmp_path, text, {})
    assert judge(outcomes, 0, path, timed=False, with_fit=False) == "planned"
    assert not outcomes.failures
    monkeypatch.setattr("impact.results.sweep.Plan", broken)
    assert judge(outcomes, 7, path, timed=False, with_fit=False) == "failed: KeyError"
    assert outcomes.failures[0].startswith("7: KeyError: 'of our own'")
