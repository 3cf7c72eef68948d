"""Run the programs of other codes: find one, ask for its version, and run a script in it."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import IO, Any

from ..formatting import number

# time that a program has to report its version
VERSION_TIMEOUT_S = 60
# LAMMPS and LIGGGHTS with Open MPI would start a daemon, in a session of its own that `kill` does not reach
WITHOUT_DAEMON = {"OMPI_MCA_ess_singleton_isolated": "1"}
# a program that prints more than the first is stopped; of its output, the end is kept
MAX_OUTPUT_BYTES, KEPT_OUTPUT_BYTES = 2**26, 2**20
POLL_INTERVAL_S = 0.05


@dataclass(frozen=True)
class Program:
    """What runs the scripts of a code.

    Parameters
    ----------
    name : of its file; "python" for an interpreter that has a package
    install : how to get it
    version_of : the version that a program reports, as it writes it; None if the program or the package is missing
    command : the command that runs a script, from the program and the file
    """

    name: str
    install: str
    version_of: Callable[[str], str | None]
    command: Callable[[str, str], Sequence[str]] = lambda program, file: (program, file)

    def find(self, requested: str | None = None) -> tuple[str | None, str | None]:
        """Find the requested program, or the one that is installed, and its version; None where it is missing."""
        path = find_program(self.name, requested)
        return path, None if path is None else self.version_of(path)


def find_program(name: str, requested: str | None = None) -> str | None:
    """Find a program: the requested one, this interpreter for "python", else the one next to it or on the path."""
    if requested is not None:
        path = shutil.which(requested)
        # it is run in another folder
        return None if path is None else str(Path(path).absolute())
    if name == "python":
        return sys.executable
    return shutil.which(name, path=str(Path(sys.executable).parent)) or shutil.which(name)


def output_of(command: Sequence[str]) -> str:
    """Return what a command prints on stdout, run in an empty folder; "" if it cannot be run."""
    try:
        # LIGGGHTS writes a log into the folder in which it is asked for its help
        with tempfile.TemporaryDirectory(prefix="impact-version-") as folder:
            return run_program(command, folder, VERSION_TIMEOUT_S).stdout
    except (OSError, subprocess.SubprocessError):
        return ""


def printed_version(option: str, pattern: str) -> Callable[[str], str | None]:
    """Make a function that searches the version of a program, the first group of a pattern, in what it prints."""

    def version_of(program: str) -> str | None:
        match = re.search(pattern, output_of([program, option]))
        return match[1] if match else None

    return version_of


def package_version(package: str) -> str | None:
    """Find the version of a package that this interpreter has; None if it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def python_package(package: str) -> Program:
    """Describe a Python interpreter that has a package."""

    def version_of(program: str) -> str | None:
        if program == sys.executable:
            return package_version(package)
        words = f"from importlib.metadata import version; print(version({package!r}))"
        printed = output_of([program, "-c", words]).strip()
        # a program that is no Python prints something else; what follows the digit is checked as a release
        return printed if printed[:1].isdigit() else None

    return Program("python", f"pip install {package}", version_of)


def run_program(command: Sequence[str], folder: str, timeout_s: float) -> subprocess.CompletedProcess[str]:
    """Run a command without input, and return the end of its output, which goes through files to save memory."""
    deadline = time.monotonic() + timeout_s
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = start(command, folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err)
        try:
            while process.poll() is None:
                if time.monotonic() > deadline:
                    raise subprocess.SubprocessError(f"stopped after {number(timeout_s)} s")
                if any(os.fstat(file.fileno()).st_size > MAX_OUTPUT_BYTES for file in (out, err)):
                    raise subprocess.SubprocessError(f"stopped after it printed {MAX_OUTPUT_BYTES >> 20} MiB")
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(POLL_INTERVAL_S)
        except BaseException:
            kill(process)
            raise
        return subprocess.CompletedProcess(command, process.returncode, end_of(out), end_of(err))


def start(command: Sequence[str], folder: str | None, **streams: Any) -> subprocess.Popen[bytes]:
    """Start a command in a session of its own, so that `kill` also reaches what it starts."""
    env = os.environ | WITHOUT_DAEMON
    return subprocess.Popen(command, cwd=folder, env=env, start_new_session=True, **streams)


def kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a process that was started in a session of its own, and what it has started; only itself on Windows."""
    with contextlib.suppress(ProcessLookupError):
        if sys.platform == "win32":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def end_of(file: IO[bytes]) -> str:
    """Read the last KEPT_OUTPUT_BYTES of a file."""
    file.seek(max(0, os.fstat(file.fileno()).st_size - KEPT_OUTPUT_BYTES))
    return file.read(KEPT_OUTPUT_BYTES).decode("utf-8", errors="replace")
