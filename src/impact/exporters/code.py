"""What an exporter knows of a code: its laws, the lines that set them, and a script that measures a rebound."""

from __future__ import annotations

import contextlib
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import IO

from ..contact.model import ForceModel
from ..errors import UsageError
from ..formatting import number
from ..text import safe_text

Parameters = Mapping[str, float | str]
# releases as codes write them; the text becomes part of a comment in the lines and the script
RELEASE = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+() -]{0,49}")
# time that a program has to report its version
VERSION_TIMEOUT_S = 60
# a program that prints more than the first is stopped; of its output, the end is kept
MAX_OUTPUT_BYTES, KEPT_OUTPUT_BYTES = 2**26, 2**20
POLL_INTERVAL_S = 0.05


@dataclass(frozen=True)
class Collision:
    """A collision of two balls on a line, as a code simulates it; everything in SI.

    Parameters
    ----------
    model : the law, the catalogue's entry of the code
    version : of the code
    values : by name: v1, v2, m1, m2, R1, R2, e, K, n, E1, nu1, E2, nu2, yield_strength1, yield_strength2, the
        effective m, R_eff, E_eff and the closing speed v0, and the law's own parameters; NaN for unknown ones
    materials : names of the materials of both balls; "" where none is given
    has_own_K : K is set in the config, and does not follow from the materials
    dt : time step
    gap : between the surfaces at the start, so that the contact begins at the wanted phase of a step
    steps : number of steps until the contact is over
    """

    model: ForceModel
    version: str
    values: Mapping[str, float]
    materials: tuple[str, str]
    has_own_K: bool
    dt: float
    gap: float
    steps: int

    def __getitem__(self, name: str) -> float:
        return self.values[name]

    @property
    def has_materials(self) -> bool:
        """Whether the stiffness follows from the materials of both balls."""
        return not self.has_own_K and all(self.materials)

    @property
    def has_one_material(self) -> bool:
        return self.materials[0] == self.materials[1]

    @property
    def effective_radius(self) -> float:
        """R* [m], of the radii that are taken where the law needs none.

        Raises
        ------
        UsageError : two planes
        """
        curvature = 1.0 / self["R1"] + 1.0 / self["R2"]
        if curvature == 0.0:
            raise UsageError("R1 and R2: got inf, expected one finite radius")
        return 1.0 / curvature

    @property
    def reach(self) -> float:
        """Distance [m] from the first point of contact that no part of a ball leaves."""
        speed = abs(self["v1"]) + abs(self["v2"])
        return 2.0 * (self["R1"] + self["R2"] + self.gap + 2.0 * speed * self.steps * self.dt)

    def script_values(self) -> dict[str, str]:
        """The values of a script, as text with all digits; ball 1 is on the left.

        x1, x2 : positions of the centres, so that the surfaces meet at the origin
        R1, R2, d1, d2 : radii and diameters
        m1, m2, v1, v2, v0 : masses, velocities and the closing speed
        dt, steps, reach : time step, number of steps, see `reach`

        Raises
        ------
        UsageError : a wall, a plane, or an input that is not known
        """
        for name in ("m1", "m2", "R1", "R2"):
            if not math.isfinite(self[name]):
                raise UsageError(f"--script: {name}: got {number(self[name])}, expected a finite value")
        values = {
            "x1": -self["R1"] - self.gap,
            "x2": self["R2"],
            "d1": 2.0 * self["R1"],
            "d2": 2.0 * self["R2"],
            "dt": self.dt,
            "steps": self.steps,
            "reach": self.reach,
        }
        values |= {name: self[name] for name in ("R1", "R2", "m1", "m2", "v1", "v2", "v0")}
        return {name: repr(value) for name, value in values.items()}


def nothing(collision: Collision) -> list[str]:
    """No lines."""
    return []


@dataclass(frozen=True)
class Code:
    """A code that simulates contacts, and how a law is written for it.

    Parameters
    ----------
    name : on the command line
    title : in words
    laws : what the code calls each of its laws, by key of the catalogue; the first is the default
    newest : the newest release whose laws were seen, taken where the code is not installed
    tested : what was run, or what was read instead
    parameters : the parameters in the units and conventions of the code, by the code's own names
    lines : lines to paste, from the parameters
    damping : the parameter that sets the restitution, of laws without an e
    scheme : name of its fixed-step scheme, see `impact.contact.timestep.SCHEMES`; None if its restitution at a
        time step is not predicted
    uncertainty : largest difference of e between the code and the map of its scheme
    rough : the same by law, where the code itself finds the damping only roughly
    entry : the entry of the catalogue that holds in a version, from the key of another one and the version; raises
        a UsageError where the version has none
    read_version : a version as the user or the program writes it, in the form in which versions are compared;
        raises a UsageError for any other text. Use `release`
    comment : what begins and ends a comment among the lines
    notes : remarks on a law: mixing of two materials, thresholds, clamps, versions
    warnings : what a user has to know before using the lines
    script : a complete input that prints `e_out = VALUE` last; None if none was ever run
    suffix : of the file of a script
    program : what runs a script; "" without one
    install : how to get it
    version_of : the version that a program reports, as it writes it; None if the program or the code is missing
    command : the command that runs a script, from the program and the file
    """

    name: str
    title: str
    laws: Mapping[str, str]
    newest: str
    tested: str
    parameters: Callable[[Collision], dict[str, float | str]]
    lines: Callable[[Collision, Parameters], list[str]]
    damping: Mapping[str, str] = field(default_factory=dict)
    scheme: str | None = None
    uncertainty: float = 1e-9
    rough: Mapping[str, float] = field(default_factory=dict)
    entry: Callable[[str, str], str] = lambda key, version: key
    read_version: Callable[[str], str] = lambda text: text
    comment: tuple[str, str] = ("# ", "")
    notes: Callable[[Collision], list[str]] = nothing
    warnings: Callable[[Collision], list[str]] = nothing
    script: Callable[[Collision, Parameters], str] | None = None
    suffix: str = ".py"
    program: str = ""
    install: str = ""
    version_of: Callable[[str], str | None] = lambda program: None
    command: Callable[[str, str], Sequence[str]] = lambda program, file: (program, file)

    def release(self, text: str, origin: str) -> str:
        """A version in the form in which versions are compared, and that is safe in a comment of any code.

        Parameters
        ----------
        text : as the user or the program writes it
        origin : what the message about a wrong text begins with

        Raises
        ------
        UsageError : it is not a release
        """
        try:
            if RELEASE.fullmatch(text) is None:
                raise UsageError(f'got "{safe_text(text, 50)}", expected a release, such as {self.newest}')
            return self.read_version(text)
        except UsageError as error:
            raise UsageError(f"{origin}: {error}") from None

    def uncertainty_of(self, key: str) -> float:
        """The largest difference of e that is no disagreement, of a law."""
        return self.rough.get(key, self.uncertainty)

    def find_program(self, program: str | None) -> str | None:
        """The program that runs a script: the given one, or else the one that is installed.

        "python" is the interpreter that runs this; others are searched for beside it and on the path.
        """
        if program is not None:
            found = shutil.which(program)
            # it is run in another folder
            return None if found is None else str(Path(found).absolute())
        if self.program == "python":
            return sys.executable
        beside = str(Path(sys.executable).parent)
        return shutil.which(self.program, path=beside) or shutil.which(self.program)


def output_of(command: Sequence[str]) -> str | None:
    """What a command prints on stdout, run in an empty folder; None if it cannot be run."""
    # LIGGGHTS writes a log into the folder in which it is asked for its help
    with tempfile.TemporaryDirectory(prefix="impact-version-") as folder:
        try:
            return run_program(command, folder, VERSION_TIMEOUT_S).stdout
        except (OSError, subprocess.SubprocessError):
            return None


def run_program(command: Sequence[str], folder: str, timeout_s: float) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder, without input, and return the end of what it prints.

    Its output goes through files, whose size is watched, so that it takes no memory.

    Raises
    ------
    OSError, subprocess.SubprocessError : it cannot be started, takes longer, or prints more than MAX_OUTPUT_BYTES
    """
    deadline = time.monotonic() + timeout_s
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err, start_new_session=True
        )
        try:
            while process.poll() is None:
                if time.monotonic() > deadline:
                    raise subprocess.SubprocessError(f"stopped after {number(timeout_s)} s")
                if any(os.fstat(file.fileno()).st_size > MAX_OUTPUT_BYTES for file in (out, err)):
                    raise subprocess.SubprocessError(f"stopped after it printed {MAX_OUTPUT_BYTES >> 20} MiB")
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(POLL_INTERVAL_S)
        except BaseException:
            # also what a wrapper has started
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            raise
        return subprocess.CompletedProcess(command, process.returncode, _end_of(out), _end_of(err))


def _end_of(file: IO[bytes]) -> str:
    """The last KEPT_OUTPUT_BYTES of a file."""
    file.seek(max(0, os.fstat(file.fileno()).st_size - KEPT_OUTPUT_BYTES))
    return file.read(KEPT_OUTPUT_BYTES).decode("utf-8", errors="replace")


def python_package_version(package: str) -> Callable[[str], str | None]:
    """A function that returns the version of a package, from the Python interpreter that has it."""

    def version_of(program: str) -> str | None:
        if program == sys.executable:
            try:
                return metadata.version(package)
            except metadata.PackageNotFoundError:
                return None
        words = f"from importlib.metadata import version; print(version({package!r}))"
        return (output_of([program, "-c", words]) or "").strip() or None

    return version_of
