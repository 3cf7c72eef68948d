"""A sweep whose scheduler does not answer ends with one line, after a time limit or at the first signal."""

from __future__ import annotations

import os
import re
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from .clusters import LARGE_CONFIG, TIMEOUT_S, ClusterServer, processes_of_group, start_new_sweep

# starts many processes: run by `make test-faults`
pytestmark = pytest.mark.slow

pytest.importorskip("distributed")
# dask's setting of its connection timeout
TIMEOUT = "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT"
SHORT = LARGE_CONFIG.replace("200000", "50000")
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}


@pytest.fixture
def silent() -> Iterator[socket.socket]:
    """A host that accepts connections and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(TIMEOUT_S)
        yield server


def address(server: socket.socket) -> str:
    return f"tcp://127.0.0.1:{server.getsockname()[1]}"


def test_a_host_that_never_answers_is_reported_after_the_time_limit(
    silent: socket.socket, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(TIMEOUT, "4s")
    printed = start_new_sweep(tmp_path, "--scheduler", address(silent)).wait(2)
    expected = "expected the address of a scheduler of dask, such as tcp://host:8786"
    assert (
        printed
        == f"{address(silent)}: no answer within 4 s; {expected} (dask: distributed.comm.timeouts.connect)\n"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["c.toml"]


@pytest.mark.parametrize("number", CODES)
def test_the_first_signal_ends_the_wait_for_a_host(
    silent: socket.socket, tmp_path: Path, number: signal.Signals
) -> None:
    running = start_new_sweep(tmp_path, "--scheduler", address(silent))
    connection, _ = silent.accept()
    with connection:
        start = time.monotonic()
        running.process.send_signal(number)
        printed = running.wait(CODES[number])
    assert time.monotonic() - start < 5.0
    assert printed == f"{'interrupted' if number == signal.SIGINT else 'terminated'}; nothing was integrated\n"


def test_a_scheduler_that_stops_answering_is_reported_after_the_time_limit(
    clusters: ClusterServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with clusters.start_cluster(tmp_path / "cluster", "a") as cluster:
        monkeypatch.setenv(TIMEOUT, "4s")
        running = start_new_sweep(tmp_path / "sweep", "--scheduler", cluster.address, config=SHORT)
        running.wait_for_blocks(1)
        cluster.children["scheduler"].send_signal(signal.SIGSTOP)
        printed = running.wait(4)
    line = (
        rf"{cluster.address}: the scheduler has not answered for 4 s; [\d,]+ of 100,000 trajectories are kept in"
    )
    assert re.match(line, printed.splitlines()[-1]), printed
    assert printed.endswith("--resume continues\n")
    assert "Traceback" not in printed


def test_the_first_signal_ends_a_sweep_whose_scheduler_stopped(clusters: ClusterServer, tmp_path: Path) -> None:
    with clusters.start_cluster(tmp_path / "cluster", "a") as cluster:
        running = start_new_sweep(tmp_path / "sweep", "--scheduler", cluster.address)
        running.wait_for_blocks(1)
        cluster.children["scheduler"].send_signal(signal.SIGSTOP)
        start = time.monotonic()
        running.process.send_signal(signal.SIGTERM)
        printed = running.wait(143)
    assert time.monotonic() - start < 15.0
    assert re.search(
        r"[\d,]+ of 400,000 trajectories are kept in results.h5.work; --resume continues\n$", printed
    ), printed
    assert "Traceback" not in printed


def listening(group: int) -> set[str]:
    """The addresses on which the processes of a group listen, in hexadecimal."""
    sockets = set()
    for process in processes_of_group(group):
        for path in Path(f"/proc/{process}/fd").iterdir():
            match = re.fullmatch(r"socket:\[(\d+)\]", os.readlink(path)) if path.is_symlink() else None
            sockets |= {match[1]} if match else set()
    rows = [
        line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/net/{name}").read_text().splitlines()
    ]
    return {row[1].split(":")[0] for row in rows if row[3] == "0A" and row[9] in sockets}


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux's list of sockets")
def test_a_local_cluster_listens_on_this_machine_only(clusters: ClusterServer, tmp_path: Path) -> None:
    running = clusters.start_sweep(tmp_path, "--scheduler", "local")
    running.wait_for_blocks(1)
    addresses = listening(running.process.pid)
    running.process.send_signal(signal.SIGINT)
    running.wait(130)
    assert addresses == {"0100007F"}
