"""Run the command line in hundreds of processes: a server imports the modules once and forks for each command.

The server reads requests from standard input, one JSON object per line, such as
{"argv": [...], "cwd": "...", "limit": seconds, "environment": {...}}, and writes one reply per line to standard
output. It has a single thread: a lock held by another thread at the fork would never be released in the child.
"""

from __future__ import annotations

import atexit
import ctypes
import fcntl
import gc
import io
import json
import os
import pty
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, NoReturn

ROOT = Path(__file__).parent.parent
POLL_INTERVAL_S = 0.002  # between checks whether a child has ended


@dataclass(frozen=True)
class CompletedCommand:
    """Result of a command line: a negative returncode is a signal; CPU time [s] and peak memory [bytes]."""

    returncode: int
    seconds: float
    memory: int
    timed_out: bool
    stdout: str
    stderr: str


@dataclass(frozen=True)
class ForkServer:
    """The client: `forked("info", path)` runs `impact info PATH` in a separate process."""

    server: subprocess.Popen[str]

    def __call__(
        self,
        *words: str | Path,
        cwd: Path = ROOT,
        limit: float = 30.0,
        code: str = "",
        stdout: str = "",
        stderr: str = "",
        **environment: str,
    ) -> CompletedCommand:
        """Run a command line.

        `code` is Python code that the child executes first. `stdout` and `stderr` are paths of files or terminals;
        without a path the output is captured. After `limit` seconds the child is killed.
        """
        assert self.server.stdin is not None
        assert self.server.stdout is not None
        request = {
            "argv": [str(word) for word in words],
            "cwd": str(cwd),
            "limit": limit,
            "environment": environment,
            "code": code,
            "stdout": stdout,
            "stderr": stderr,
        }
        print(json.dumps(request), file=self.server.stdin, flush=True)
        return CompletedCommand(**json.loads(self.server.stdout.readline()))


@contextmanager
def start_fork_server() -> Iterator[ForkServer]:
    """Start a server; it ends with the context."""
    # threads that a library starts before the fork do not exist in the child
    single_thread = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    command = [sys.executable, "-m", "tests.fork_server"]
    with subprocess.Popen(
        command,
        cwd=ROOT,
        env={**os.environ, **single_thread},
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as server:
        try:
            yield ForkServer(server)
        finally:
            assert server.stdin is not None
            server.stdin.close()


@contextmanager
def abandoned_pipe(folder: Path) -> Iterator[str]:
    """Yield the path of a pipe whose reader closes it as soon as a writer has opened it."""
    path = folder / "pipe"
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: os.close(os.open(path, os.O_RDONLY)))
    reader.start()
    yield str(path)
    reader.join()
    path.unlink()


def printed_on_terminal(
    forked: ForkServer,
    *words: str | Path,
    stream: str = "stdout",
    width: int = 80,
    cwd: Path = ROOT,
    code: str = "",
    **environment: str,
) -> tuple[CompletedCommand, str]:
    """Run a command line with one stream on a terminal; return its result and what the terminal shows."""
    driver, terminal = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 50, width, 0, 0))
    # environment variables would override the width of the terminal
    unset = "import os\nfor name in {'COLUMNS', 'LINES', 'TERM'} - {*%r}:\n    os.environ.pop(name, None)\n"
    printed = b""

    def read() -> None:
        nonlocal printed
        with suppress(OSError):
            while True:
                printed += os.read(driver, 10_000)

    reader = threading.Thread(target=read)
    reader.start()
    streams = {stream: os.ttyname(terminal)}
    completed = forked(*words, cwd=cwd, code=unset % [*environment] + code, **streams, **environment)
    os.close(terminal)
    reader.join()
    os.close(driver)
    return completed, printed.decode()


def serve() -> None:
    """Answer requests until standard input is closed."""
    _warm_up()
    for line in sys.stdin:
        request = json.loads(line)
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            child = os.fork()
            if child == 0:
                os.environ |= request["environment"]
                streams = [
                    os.open(request[name], os.O_WRONLY) if request[name] else file.fileno()
                    for name, file in (("stdout", out), ("stderr", err))
                ]
                run_command(request["argv"], request["cwd"], request["code"], *streams)
            completed = _wait(child, request["limit"], out, err)
        print(json.dumps(asdict(completed)), flush=True)


# the server runs these commands once: modules are then loaded and caches filled in every child
WARM_UP_COMMANDS = (
    "sweep warm.toml -o warm.h5 --quiet",
    "info warm.h5",
    "run warm.h5",
    "recommend warm.h5",
    "plot warm.h5",
    "compare warm.h5 warm.h5",
    "rerun warm.h5",
    "models",
    "expand warm.h5 -o full.h5",
    "timestep --model hertz --steps-per-contact 9 --phases 1",
)
WARM_UP_CONFIG = """models = ["hertz", "gharib-hurmuzlu-2012"]
[sweep]
e = [0.5, 1.0]
v1 = ["1 m/s", "2 m/s"]
m1 = 1.0
m2 = 1.0
K = 6e9
"""


def _warm_up() -> None:
    """Import all modules that commands use, also those that libraries import on first use."""
    from impact.cli.main import app

    before, silence = os.getcwd(), io.StringIO()
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(silence), redirect_stderr(silence):
        os.chdir(folder)
        Path("warm.toml").write_text(WARM_UP_CONFIG, encoding="utf-8")
        for words in WARM_UP_COMMANDS:
            assert not app(words.split(), standalone_mode=False, prog_name="impact"), words
        os.chdir(before)
    assert threading.active_count() == 1
    # the garbage collector of a child would visit the shared objects, and so copy their memory
    gc.freeze()


def run_command(argv: list[str], cwd: str, program: str, stdout: int, stderr: int) -> NoReturn:
    """In the child: execute a command line and exit as the interpreter does."""
    from impact.cli.main import main

    code: object = 99
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(stdout, 1)
        os.dup2(stderr, 2)
        # the streams of the server may be files, which have positions, unlike a terminal
        sys.stdout = os.fdopen(1, "w", closefd=False)
        sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
        os.chdir(cwd)
        sys.argv = ["impact", *argv]
        exec(program, {})
        main()
    except SystemExit as leaving:
        code = leaving.code or 0
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except OSError:
                # the exit status of the interpreter if it cannot flush
                code = 120
        # libraries close their files at exit and can crash there; os._exit would hide that
        atexit._run_exitfuncs()
        ctypes.CDLL(None).exit(code if isinstance(code, int) else 99)
    raise AssertionError("not reached")


def _wait(child: int, limit: float, out: IO[bytes], err: IO[bytes]) -> CompletedCommand:
    """In the server: wait for the child, and kill it after the time limit."""
    start = time.monotonic()
    timed_out = False
    while True:
        pid, status, usage = os.wait4(child, os.WNOHANG)
        if pid:
            break
        if not timed_out and time.monotonic() - start > limit:
            os.kill(child, signal.SIGKILL)
            timed_out = True
        time.sleep(POLL_INTERVAL_S)
    texts = []
    for stream in (out, err):
        stream.seek(0)
        texts.append(stream.read().decode(errors="backslashreplace"))
    # ru_maxrss is in units of 1024 bytes, on macOS in bytes
    unit = 1 if sys.platform == "darwin" else 1024
    return CompletedCommand(
        os.waitstatus_to_exitcode(status),
        usage.ru_utime + usage.ru_stime,
        usage.ru_maxrss * unit,
        timed_out,
        *texts,
    )


if __name__ == "__main__":
    serve()
