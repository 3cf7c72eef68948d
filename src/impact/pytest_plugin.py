"""The pytest plug-in: the fixture `impact_regression` compares a result, or a sweep, with a baseline.

pytest loads this module through the entry point `pytest11`; nothing else imports it. It imports the rest of the
package when a test uses the fixture, so that other test runs do not wait for it.
"""

from __future__ import annotations

import hashlib
import os
import re
import shlex
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, SupportsFloat

import pytest

import impact

if TYPE_CHECKING:
    import xarray as xr

    from .comparison.compare import Tolerances
    from .comparison.verdict import Verdict
    from .contact.model import ForceModel
    from .results.board import Board

# the properties of a test that bring its baselines to the summary, also from workers of pytest-xdist
WRITTEN, OLD_NAME = "impact baseline", "impact baseline with an old name"
COLLECTED = pytest.StashKey[list[pytest.Item]]()
MAX_NAME_LENGTH = 150  # of a default baseline without .h5; file systems allow 255 bytes


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option --impact-bless."""
    parser.getgroup("impact", "regression tests of impact").addoption(
        "--impact-bless",
        metavar="REASON",
        help="Write the baselines of impact_regression that are missing or differ; the reason is stored in them.",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Check the reason before any test runs."""
    reason = config.getoption("--impact-bless")
    # without a reason, the next argument of the command line would be taken for it
    if reason is not None and (not reason.strip() or os.path.exists(reason.partition("::")[0])):
        raise pytest.UsageError(f'--impact-bless: got "{reason}", expected the reason for the change')


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep all tests, also those that -k deselects: they may have a baseline of the same old name."""
    config.stash[COLLECTED] = list(items)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print which baselines were written, and how to rename those with an old name."""
    lines = [
        f"written: {value}" if name == WRITTEN else f"old name, to be renamed: {value}"
        for reports in terminalreporter.stats.values()
        for report in reports
        if getattr(report, "when", "") == "call"
        for name, value in report.user_properties
        if name in (WRITTEN, OLD_NAME)
    ]
    if lines:
        terminalreporter.section("baselines of impact")
        for line in dict.fromkeys(lines):
            terminalreporter.line(line)


@pytest.fixture
def impact_regression(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> ImpactRegression:
    """Compare a result, or the sweep of a config, with a stored baseline.

    `impact_regression(source, baseline=None, *, tol=None, subset=False, overrides=(), plugins=(),
    allow_failed=False)` fails the test with the verdict of `impact.compare` unless they are equal. With
    --impact-bless REASON a baseline that is missing or differs is written.
    """
    return ImpactRegression(request, tmp_path_factory)


@dataclass(frozen=True)
class ImpactRegression:
    """The value of the fixture `impact_regression`, a function with access to its test."""

    request: pytest.FixtureRequest
    tmp_path_factory: pytest.TempPathFactory

    def __call__(
        self,
        source: str | Path | Mapping[str, object] | xr.Dataset | Board,
        baseline: str | Path | None = None,
        *,
        tol: SupportsFloat | str | Tolerances | None = None,
        subset: bool = False,
        overrides: Sequence[str] = (),
        plugins: Sequence[ForceModel | str | Path] = (),
        allow_failed: bool = False,
    ) -> Verdict | None:
        """Compare with a baseline; fail the test if they are not equal.

        Relative paths start at the folder of the test file.

        Parameters
        ----------
        source : a config, as a mapping or the path of a TOML file, which is swept; or a result, as a dataset or
            the path of its file, which may be a calibration or a board
        baseline : the file of the baseline; by default baselines/FILE-TEST.h5, see `baseline_name`
        tol, subset : see `impact.compare`
        overrides, plugins : of the sweep, see `impact.sweep`
        allow_failed : write a baseline even if some of its points failed; a calibration and a board have none

        Returns
        -------
        Verdict : the comparison; None if there was no baseline and --impact-bless wrote it
        """
        from filelock import FileLock

        __tracebackhide__ = True
        try:
            path = self._path(
                baseline if baseline is not None else f"baselines/{baseline_name(self.request.node)}"
            )
            reason = self.request.config.getoption("--impact-bless")
            new = self._result_file(source, overrides, plugins)
            if reason is not None:
                with FileLock(f"{self._mark(path)}.lock"):
                    return self._bless(new, path, reason, tol=tol, subset=subset, allow_failed=allow_failed)
            if not path.exists():
                path = self._baseline_with_old_name(path, is_default=baseline is None)
            verdict = impact.compare(new, path, tol=tol, subset=subset)
        except (impact.ImpactError, OSError) as error:
            raise pytest.fail.Exception(str(error), pytrace=False) from None
        if not verdict.equal:
            hint = self._hint("why the numbers change")
            pytest.fail(f"{verdict}\nnew result: {new}\nbaseline: {path}\n{hint}", pytrace=False)
        return verdict

    def _baseline_with_old_name(self, path: Path, *, is_default: bool) -> Path:
        """Find the baseline of a test whose own does not exist under its old name, or fail the test."""
        __tracebackhide__ = True
        old = self._path(f"baselines/{_old_name(self.request.node)}")
        if not is_default or not old.exists() or self._is_shared(old):
            shared = f"; {old} may be that of another test" if is_default and old.exists() else ""
            pytest.fail(f"{path}: no baseline{shared}\n{self._hint('first baseline')}", pytrace=False)
        command = shlex.join(["mv", str(old), str(path)])
        self.request.node.user_properties.append((OLD_NAME, command))
        return old

    def _bless(
        self, new: Path, baseline: Path, reason: str, *, tol: Any, subset: bool, allow_failed: bool
    ) -> Verdict | None:
        """Write a baseline unless it is equal to the result, so that version control shows real changes only."""
        from .comparison.compare import calibration_tolerances
        from .results.schema import kind_of
        from .results.xarray_backend import save_with_attributes

        result, verdict = impact.load(new), None
        is_study = kind_of(result) in ("calibration", "board")
        if is_study:
            # the next run would refuse it
            calibration_tolerances(tol)
        # bless, which no study needs, reports the same error and how to proceed
        with nullcontext() if is_study else suppress(impact.ImpactError):
            if baseline.exists():
                verdict = impact.compare(new, baseline, tol=tol, subset=subset)
        if verdict is not None and verdict.equal:
            return verdict
        if self._mark(baseline).exists():
            raise impact.UsageError(
                f"{baseline}: was written from another result in this run; name a baseline for each result"
            )
        baseline.parent.mkdir(parents=True, exist_ok=True)
        if is_study:
            save_with_attributes(new, baseline, str(result.encoding["seal"]), {"reason": reason})
        else:
            verdict = impact.bless(new, baseline, reason=reason, tol=tol, allow_failed=allow_failed)
        self._mark(baseline).touch()
        self.request.node.user_properties.append((WRITTEN, str(baseline)))
        return verdict

    def _result_file(
        self,
        source: str | Path | Mapping[str, object] | xr.Dataset | Board,
        overrides: Sequence[str],
        plugins: Sequence[ForceModel | str | Path],
    ) -> Path:
        """The file of the new result; pytest keeps its folder, so that commands in a verdict can be repeated."""
        import xarray as xr

        if isinstance(source, impact.Board):
            source = source.dataset
        path = self._path(source) if isinstance(source, str | Path) else None
        is_result = path.suffix.lower() != ".toml" if path is not None else isinstance(source, xr.Dataset)
        if is_result and (overrides or plugins):
            raise TypeError("got overrides or plugins and a result, expected them with a config")
        if is_result and path is not None:
            return path
        new = self.tmp_path_factory.mktemp("impact_regression") / "new.h5"
        if isinstance(source, xr.Dataset):
            impact.save(source, new)
        else:
            files = [self._path(plugin) if isinstance(plugin, str | Path) else plugin for plugin in plugins]
            impact.sweep(path or source, output=new, overrides=overrides, plugins=files)
        return new

    def _path(self, path: str | Path) -> Path:
        """A path relative to the folder of the test file, whatever the working directory is."""
        return Path(os.path.normpath(self.request.path.parent / path))

    def _mark(self, baseline: Path) -> Path:
        """The name of a file that exists once this run wrote a baseline, also in a worker of pytest-xdist."""
        folder = self.tmp_path_factory.getbasetemp()
        # each worker has its own folder in that of the run
        folder = folder.parent if hasattr(self.request.config, "workerinput") else folder
        return folder / f"impact-{hashlib.sha256(os.fsencode(baseline)).hexdigest()}"

    def _is_shared(self, old: Path) -> bool:
        """Whether another test may have a baseline of this old name."""
        if any("::" in word for word in self.request.config.args):
            # not all tests of the file were collected
            return True
        items = self.request.config.stash.get(COLLECTED, [])
        return sum(item.path == self.request.path and _old_name(item) == old.name for item in items) != 1

    def _hint(self, reason: str) -> str:
        """How to accept the new result."""
        path, folder = self.request.path, self.request.config.invocation_params.dir
        file = path.relative_to(folder) if path.is_relative_to(folder) else path
        # a node id starts at the rootdir, an argument of pytest at the working directory
        test = shlex.quote(f"{file}::{self.request.node.nodeid.partition('::')[2]}")
        return f'to accept the new result: pytest {test} --impact-bless "{reason}"'


def baseline_name(item: pytest.Item) -> str:
    """The name of the default baseline of a test: FILE-TEST.h5, or FILE-CLASS-TEST-HASH.h5.

    The hash of the file's name, the classes and the test with its parameters makes the name unique, also where a
    file system does not distinguish upper and lower case. A function with a short name in lower case needs none.
    """
    names = [node.name for node in item.listchain() if isinstance(node, pytest.Class)]
    parts = [item.path.stem, *names, item.name]
    plain = "-".join(parts)
    readable = re.sub(r"[^\w.=+-]+", "_", plain, flags=re.ASCII).strip("_")[:MAX_NAME_LENGTH]
    if readable == plain and not names and re.fullmatch(r"[a-z0-9_]+", item.name):
        return f"{readable}.h5"
    digest = hashlib.sha256("::".join(parts).encode()).hexdigest()[:8]
    return f"{readable}-{digest}.h5"


def _old_name(item: pytest.Item) -> str:
    """The name of the default baseline up to version 1.0.0, without classes, which several tests might share."""
    return re.sub(r"[^\w.=+-]+", "_", f"{item.path.stem}-{item.name}").strip("_") + ".h5"
