"""The package imports and works where the modules and functions of POSIX are missing, as on Windows."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from .conftest import CONTACT, ROOT

# modules that the standard library has on Unix only
POSIX_MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"}
# what Windows lacks of the modules that it has
POSIX_NAMES = {
    "os": ("fchmod", "fchown", "fork", "getuid", "geteuid", "killpg", "mkfifo", "pathconf", "setsid", "sysconf"),
    "signal": ("SIGKILL", "SIGXFSZ", "pthread_sigmask", "alarm", "setitimer"),
    "time": ("tzset",),
}
AS_ON_WINDOWS = f"""
import os, signal, sys, time
for module, names in {POSIX_NAMES!r}.items():
    for name in names:
        if hasattr(sys.modules[module], name):
            delattr(sys.modules[module], name)
# subprocess and multiprocessing of the interpreter use some of them
sys.modules |= dict.fromkeys({POSIX_MODULES - {"posix"}!r})
"""


def imports_at_import(path: Path) -> Iterator[str]:
    """Yield the modules that are imported when a file is, unless an ImportError is expected."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module or ""


def test_no_module_of_the_package_or_the_quick_tests_imports_modules_of_posix() -> None:
    # run by tests that are marked or that skip where there is no fork
    posix_only = {"faults.py", "test_faults.py"}
    paths = [*(ROOT / "src").rglob("*.py"), *(ROOT / "tests").glob("*.py")]
    found = {
        path.name: modules
        for path in paths
        if path.name not in posix_only and (modules := POSIX_MODULES.intersection(imports_at_import(path)))
    }
    assert not found


@pytest.mark.slow
def test_the_package_works_without_the_functions_of_posix(tmp_path: Path) -> None:
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    code = (
        AS_ON_WINDOWS
        + """
from impact.cli.main import app
for words in (
    "sweep contact.toml -o r.h5 --quiet",
    "sweep contact.toml -o r.h5 --quiet --overwrite --jobs 2",
    "info r.h5",
    "plot r.h5 -o r.png",
    "compare r.h5 r.h5",
    "rerun r.h5",
    "run r.h5 --model hertz --history h.h5",
    "solve --model kelvin-voigt --for C --target e_out=0.6 --at m1=1 --at m2=1 --at K=1e6 --at v1=1",
    "export --to yade --code-version 2023.02a --at v1=1 --at e=0.6",
    "timestep --model hertz --steps-per-contact 9 --phases 2",
):
    assert not app(words.split(), standalone_mode=False, prog_name="impact"), words
print("all ran")
"""
    )
    file = tmp_path / "as_on_windows.py"
    file.write_text(f"if __name__ == '__main__':\n    exec({code!r})\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, file], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.stdout.endswith("all ran\n"), done.stdout + done.stderr
