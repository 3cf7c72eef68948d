"""The command line in hundreds of real processes: a server imports what the commands need once, and forks.

Its standard input has a request a line, {"argv": [...], "cwd": "...", "limit": seconds, "environment": {...}}; its
standard output a reply a line. The server has one thread, so that a child finds no lock held by a thread that it
has not got.
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
PAUSE = 0.002  # s between two looks whether a child has ended


@dataclass(frozen=True)
class Done:
    """How a command line ended: a negative returncode is a signal; CPU time [s] and largest memory [bytes]."""

    returncode: int
    seconds: float
    memory: int
    timed_out: bool
    stdout: str
    stderr: str


@dataclass(frozen=True)
class Forked:
    """The client's side: `forked("info", path)` runs `impact info PATH` in a process of its own."""

    server: subprocess.Popen[str]

    def __call__(
        self, *words: str | Path, cwd: Path = ROOT, limit: float = 30.0, code: str = "", stdout: str = "",
        stderr: str = "", **environment: str,
    ) -> Done:  # fmt: skip
        """Run a command line, after some Python code, with streams that may go to a file or a terminal."""
        assert self.server.stdin is not None
        assert self.server.stdout is not None
        request = {"argv": [str(word) for word in words], "cwd": str(cwd), "limit": limit,
                   "environment": environment, "code": code, "stdout": stdout, "stderr": stderr}  # fmt: skip
        print(json.dumps(request), file=self.server.stdin, flush=True)
        return Done(**json.loads(self.server.stdout.readline()))


@contextmanager
def forking() -> Iterator[Forked]:
    """A server for as long as it is needed."""
    # a pool of threads made before the fork would be missing after it
    alone = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    command = [sys.executable, "-m", "tests.forked"]
    with subprocess.Popen(
        command, cwd=ROOT, env={**os.environ, **alone}, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as server:
        try:
            yield Forked(server)
        finally:
            assert server.stdin is not None
            server.stdin.close()


@contextmanager
def abandoned_pipe(folder: Path) -> Iterator[str]:
    """The path of a pipe whose reader leaves as soon as there is a writer."""
    path = folder / "pipe"
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: os.close(os.open(path, os.O_RDONLY)))
    reader.start()
    yield str(path)
    reader.join()
    path.unlink()


def printed_on_terminal(
    forked: Forked,
    *words: str | Path,
    stream: str = "stdout",
    width: int = 80,
    cwd: Path = ROOT,
    code: str = "",
    **environment: str,
) -> tuple[Done, str]:
    """Run a command line of which a stream is a terminal; how it ended and what the terminal shows."""
    driver, terminal = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 50, width, 0, 0))
    # the width of the terminal counts only where no variable has another
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
    done = forked(*words, cwd=cwd, code=unset % [*environment] + code, **streams, **environment)
    os.close(terminal)
    reader.join()
    os.close(driver)
    return done, printed.decode()


def serve() -> None:
    """Answer requests until there are no more."""
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
                _command(request["argv"], request["cwd"], request["code"], *streams)
            done = _wait(child, request["limit"], out, err)
        print(json.dumps(asdict(done)), flush=True)


# what the server does once, so that its children find modules loaded and caches filled
WARM_UP = (
    "sweep warm.toml -o warm.h5 --quiet", "info warm.h5", "run warm.h5", "recommend warm.h5", "plot warm.h5",
    "compare warm.h5 warm.h5", "rerun warm.h5", "models", "expand warm.h5 -o full.h5",
)  # fmt: skip
WARM = """models = ["hertz", "gharib-hurmuzlu-2012"]
[sweep]
e = [0.5, 1.0]
v1 = [1.0, 2.0]
m1 = 1.0
m2 = 1.0
K = 6e9
"""


def _warm_up() -> None:
    """Import what the commands import, and what their libraries import on first use."""
    from impact.cli.main import app

    before, silence = os.getcwd(), io.StringIO()
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(silence), redirect_stderr(silence):
        os.chdir(folder)
        Path("warm.toml").write_text(WARM, encoding="utf-8")
        for words in WARM_UP:
            assert not app(words.split(), standalone_mode=False, prog_name="impact"), words
        os.chdir(before)
    assert threading.active_count() == 1
    # objects that all children share are not examined again in each of them, which would copy their memory
    gc.freeze()


def _command(argv: list[str], cwd: str, program: str, stdout: int, stderr: int) -> NoReturn:
    """In the child: become the command, and leave as a program does."""
    from impact.cli.main import main

    code: object = 99
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(stdout, 1)
        os.dup2(stderr, 2)
        # the streams of the server may be of files, at places that a terminal does not have
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
                # as the interpreter leaves where it cannot flush
                code = 120
        # libraries close their files at the exit, and can crash there: os._exit would hide it
        atexit._run_exitfuncs()
        ctypes.CDLL(None).exit(code if isinstance(code, int) else 99)
    raise AssertionError("not reached")


def _wait(child: int, limit: float, out: IO[bytes], err: IO[bytes]) -> Done:
    """In the server: how the child ended; one that takes too long is killed."""
    begun = time.monotonic()
    timed_out = False
    while True:
        ended, status, usage = os.wait4(child, os.WNOHANG)
        if ended:
            break
        if not timed_out and time.monotonic() - begun > limit:
            os.kill(child, signal.SIGKILL)
            timed_out = True
        time.sleep(PAUSE)
    texts = []
    for stream in (out, err):
        stream.seek(0)
        texts.append(stream.read().decode(errors="backslashreplace"))
    # the kernel counts memory in units of 1024 bytes, but macOS in bytes
    unit = 1 if sys.platform == "darwin" else 1024
    return Done(
        os.waitstatus_to_exitcode(status),
        usage.ru_utime + usage.ru_stime,
        usage.ru_maxrss * unit,
        timed_out,
        *texts,
    )


if __name__ == "__main__":
    serve()
