"""Run the command line in hundreds of processes: a server imports the modules once and forks for each command.

The server reads requests from standard input, one JSON object per line: {"start": {...}}, whose reply is a process
id, or {"wait": {...}}, whose reply is what became of the process. It has a single thread: a lock held by another
thread at the fork would never be released in the child.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import io
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import asdict, dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

ROOT = Path(__file__).parent.parent
POLL_INTERVAL_S = 0.002  # between checks whether a child has ended
TIMEOUT_S = 60.0  # limit of a wait of a test
READY = "the server is ready\n"
SCRIPT_SERVER = Path(__file__).parent / "peers" / "serve_scripts.py"


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

    def ask(self, request: object) -> Any:
        assert self.server.stdin is not None
        assert self.server.stdout is not None
        print(json.dumps(request), file=self.server.stdin, flush=True)
        return json.loads(self.server.stdout.readline())

    def start(
        self,
        *words: str | Path | int,
        cwd: Path = ROOT,
        code: str = "",
        stdout: str = "",
        stderr: str = "",
        **environment: str,
    ) -> int:
        """Start a command line; return its process id, which stays reserved until `wait`.

        `code` is Python code that the child executes first. `stdout` and `stderr` are paths of files or terminals;
        without a path the output is captured.
        """
        request = {
            "argv": [str(word) for word in words],
            "cwd": str(cwd),
            "code": code,
            "stdout": stdout,
            "stderr": stderr,
            "environment": environment,
        }
        return int(self.ask({"start": request}))

    def wait(self, pid: int, limit: float) -> CompletedCommand:
        """Wait for the end of a command; after `limit` seconds it is killed."""
        return CompletedCommand(**self.ask({"wait": {"pid": pid, "limit": limit}}))

    def __call__(self, *words: str | Path, limit: float = 30.0, **options: Any) -> CompletedCommand:
        """Run a command line to its end; see `start` for the options."""
        return self.wait(self.start(*words, **options), limit)


@contextmanager
def start_fork_server(*command: str) -> Iterator[ForkServer]:
    """Start a server, by default that of this module; it ends with the context."""
    # threads that a library starts before the fork do not exist in the child
    single_thread = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    with subprocess.Popen(
        command or [sys.executable, "-m", "tests.fork_server"],
        cwd=ROOT,
        env={**os.environ, **single_thread},
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as server:
        try:
            assert server.stdout is not None
            # the program of a server may greet first
            if READY not in server.stdout:
                raise RuntimeError(f"{command}: no server")
            yield ForkServer(server)
        finally:
            assert server.stdin is not None
            server.stdin.close()


# the code of a fork: it runs a script
RUN = """import __main__, runpy
runpy.run_path({file!r}, __main__.names, "__main__")
raise SystemExit
"""
_servers_of_scripts = ExitStack()


@cache
def _server_of(*command: str) -> ForkServer:
    return _servers_of_scripts.enter_context(start_fork_server(*command))


def end_servers_of_scripts() -> None:
    """End the servers of `run_script_in_fork`."""
    _servers_of_scripts.close()
    _server_of.cache_clear()


def run_script_in_fork(
    program: Sequence[str], script: Path, *words: str, folder: Path, limit: float
) -> CompletedCommand:
    """Run a script in a fork of a process that has imported what it imports, which may take seconds.

    The program is Python, or YADE, whose own threads only wait. Raises RuntimeError if a module is not installed.
    """
    modules = re.findall(r"^(?:import|from) ([\w.]+)", script.read_text(encoding="utf-8"), re.MULTILINE)
    server = _server_of(*program, str(SCRIPT_SERVER), *modules)
    return server(*words, cwd=folder, code=RUN.format(file=str(script)), limit=limit)


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
    # which Windows lacks
    import fcntl
    import pty
    import termios

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


def wait_until(condition: Callable[[], bool]) -> None:
    start = time.monotonic()
    while not condition():
        assert time.monotonic() - start < TIMEOUT_S
        time.sleep(POLL_INTERVAL_S)


def serve(warm_up: Callable[[], None]) -> None:
    """Answer requests until standard input is closed."""
    warm_up()
    # the garbage collector of a child would visit the shared objects, and so copy their memory
    gc.freeze()
    # a TemporaryDirectory would be removed by the first child that ends
    folder = tempfile.mkdtemp()
    print(READY, end="", flush=True)
    for line in sys.stdin:
        ((name, request),) = json.loads(line).items()
        reply = _start(folder, **request) if name == "start" else asdict(_wait(folder, **request))
        print(json.dumps(reply), flush=True)
    shutil.rmtree(folder)


def _start(folder: str, environment: dict[str, str], **request: Any) -> int:
    """In the server: fork a child that executes a command line; what it prints is captured in files of its id."""
    child = os.fork()
    if child == 0:
        os.environ |= environment
        for name in ("stdout", "stderr"):
            path = request[name] or f"{folder}/{os.getpid()}.{name}"
            request[name] = os.open(path, os.O_WRONLY | (0 if request[name] else os.O_CREAT))
        run_command(**request)
    return child


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
# and imports these, with SciPy's statistics, which take longer than what most tests do with them
WARM_UP_MODULES = (
    "impact.inverse.calibrate",
    "impact.inverse.solve",
    "impact.uncertainty.sensitivity",
    "impact.exporters.export",
    "impact.reporting.report",
    "impact.results.extend",
    "impact.results.shards",
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
    for name in WARM_UP_MODULES:
        import_module(name)
    assert threading.active_count() == 1


def run_command(argv: list[str], cwd: str, code: str, stdout: int, stderr: int) -> NoReturn:
    """In the child: execute a command line and exit as the interpreter does."""
    status: object = 99
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(stdout, 1)
        os.dup2(stderr, 2)
        # the streams of the server may be files, which have positions, unlike a terminal
        sys.stdout = os.fdopen(1, "w", closefd=False)
        sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
        os.chdir(cwd)
        sys.argv = ["impact", *argv]
        exec(code, {})
        # which the Python of another server may not have
        from impact.cli.main import main

        main()
    except SystemExit as leaving:
        status = leaving.code or 0
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except OSError:
                # the exit status of the interpreter if it cannot flush
                status = 120
        atexit._run_exitfuncs()
        # HDF5 closes its files when a process ends, and can crash then; what other libraries do then takes longer
        if h5 := sys.modules.get("h5py.h5"):
            ctypes.CDLL(h5.__file__).H5close()
        os._exit(status if isinstance(status, int) else 99)
    raise AssertionError("not reached")


def _wait(folder: str, pid: int, limit: float) -> CompletedCommand:
    """In the server: wait for a child, and kill it after the time limit."""
    start = time.monotonic()
    timed_out = False
    while True:
        ended_pid, status, usage = os.wait4(pid, os.WNOHANG)
        if ended_pid:
            break
        if not timed_out and time.monotonic() - start > limit:
            os.kill(pid, signal.SIGKILL)
            timed_out = True
        time.sleep(POLL_INTERVAL_S)
    texts = []
    for name in ("stdout", "stderr"):
        # a stream that was sent to a file or a terminal is not captured
        captured = Path(folder, f"{pid}.{name}")
        texts.append(captured.read_bytes().decode(errors="backslashreplace") if captured.exists() else "")
        captured.unlink(missing_ok=True)
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
    serve(_warm_up)
