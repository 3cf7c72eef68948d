"""A scheduler that does not answer ends a sweep in one line, by a time limit or the first signal."""

from __future__ import annotations

import os
import re
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from .clusters import CONFIG, PATIENCE, dask, in_group, sweep

# it starts many processes or reads many files: `make test-faults` runs it
pytestmark = pytest.mark.slow

pytest.importorskip("distributed")
# dask's own setting of how long it waits
TIMEOUT = "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT"
SHORT = CONFIG.replace("200000", "50000")
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}


@pytest.fixture
def silent() -> Iterator[socket.socket]:
    """A host that accepts connections and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE)
        yield server


def address(server: socket.socket) -> str:
    return f"tcp://127.0.0.1:{server.getsockname()[1]}"


def test_a_host_that_never_answers_is_given_up(
    silent: socket.socket, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(TIMEOUT, "4s")
    said = sweep(tmp_path, "--scheduler", address(silent)).ends(2)
    expected = "expected the address of a scheduler of dask, such as tcp://host:8786"
    assert (
        said == f"{address(silent)}: no answer within 4 s; {expected} (dask: distributed.comm.timeouts.connect)\n"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["c.toml"]


@pytest.mark.parametrize("number", CODES)
def test_the_first_signal_ends_the_wait_for_a_host(
    silent: socket.socket, tmp_path: Path, number: signal.Signals
) -> None:
    one = sweep(tmp_path, "--scheduler", address(silent))
    connection, _ = silent.accept()
    with connection:
        begun = time.monotonic()
        one.process.send_signal(number)
        said = one.ends(CODES[number])
    assert time.monotonic() - begun < 5.0
    assert said == f"{'interrupted' if number == signal.SIGINT else 'terminated'}; nothing was integrated\n"


def test_a_scheduler_that_stops_answering_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with dask(tmp_path / "cluster", "a") as cluster:
        monkeypatch.setenv(TIMEOUT, "4s")
        one = sweep(tmp_path / "sweep", "--scheduler", cluster.address, config=SHORT)
        one.until_kept(1)
        cluster.children["scheduler"].send_signal(signal.SIGSTOP)
        said = one.ends(4)
    line = (
        rf"{cluster.address}: the scheduler has not answered for 4 s; [\d,]+ of 100,000 trajectories are kept in"
    )
    assert re.match(line, said.splitlines()[-1]), said
    assert said.endswith("--resume continues\n")
    assert "Traceback" not in said


def test_the_first_signal_ends_a_sweep_whose_scheduler_stopped(tmp_path: Path) -> None:
    with dask(tmp_path / "cluster", "a") as cluster:
        one = sweep(tmp_path / "sweep", "--scheduler", cluster.address)
        one.until_kept(1)
        cluster.children["scheduler"].send_signal(signal.SIGSTOP)
        begun = time.monotonic()
        one.process.terminate()
        said = one.ends(143)
    assert time.monotonic() - begun < 15.0
    assert re.search(r"[\d,]+ of 400,000 trajectories are kept in results.h5.work; --resume continues\n$", said), (
        said
    )
    assert "Traceback" not in said


def listening(group: int) -> set[str]:
    """The addresses, as hexadecimal numbers, at which the processes of a group wait for connections."""
    sockets = set()
    for process in in_group(group):
        for path in Path(f"/proc/{process}/fd").iterdir():
            found = re.fullmatch(r"socket:\[(\d+)\]", os.readlink(path)) if path.is_symlink() else None
            sockets |= {found[1]} if found else set()
    rows = [
        line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/net/{name}").read_text().splitlines()
    ]
    return {row[1].split(":")[0] for row in rows if row[3] == "0A" and row[9] in sockets}


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux's list of sockets")
def test_a_local_cluster_listens_on_this_machine_only(tmp_path: Path) -> None:
    one = sweep(tmp_path, "--scheduler", "local")
    one.until_kept(1)
    found = listening(one.process.pid)
    one.process.send_signal(signal.SIGINT)
    one.ends(130)
    assert found == {"0100007F"}
