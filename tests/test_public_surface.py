"""The public surface is that of `tests/data/public_surface.txt`, so that a change of it is seen in a diff.

`python -m tests.test_public_surface` writes the file anew after an intended change.
"""

from __future__ import annotations

import inspect
import json
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

import impact
from impact.cli import main as program
from impact.config.tables import Output
from impact.display import Displayed

from .conftest import ROOT, Run
from .fork_server import start_fork_server

SURFACE = Path(__file__).parent / "data" / "public_surface.txt"
CONFIG = """\
models = ["anagnostopoulos-1988", "hertz"]
[sweep]
e = [0.5, 0.8]
v1 = 1.0
m1 = 1.0
m2 = 1.0
K = 1e6
n = 1.0
"""
UNCERTAIN = CONFIG.replace("v1 = 1.0", "v1 = { normal = [1.0, 0.1] }").replace("[0.5, 0.8]", "0.5")
UNCERTAIN += """\
[design]
n = 64
"""
FIT = """\
models = "anagnostopoulos-1988"
[sweep]
e = { fit = [0.1, 1.0] }
v1 = 1.0
m1 = 1.0
m2 = 1.0
K = 1e6
n = 1.0
[data.columns]
e_out = [0.49, 0.5, 0.51]
sigma = [0.01, 0.01, 0.01]
"""
# words of the command whose --json is described; some write a file that a later one reads
COMMANDS = (
    ("sweep", "config.toml", "-o", "r.h5", "--json"),
    ("sweep", "config.toml", "-o", "m.h5", "--shard", "1/2", "--json"),
    ("sweep", "config.toml", "-o", "m.h5", "--shard", "2/2", "--json"),
    ("merge", "m.h5.1-of-2.work", "m.h5.2-of-2.work", "-o", "m.h5", "--json"),
    ("extend", "r.h5", "--set", "sweep.e=[0.9]", "-o", "x.h5", "--json"),
    ("info", "r.h5", "--json"),
    ("recommend", "r.h5", "--json"),
    ("plot", "r.h5", "-o", "p.svg", "--json"),
    ("run", "--model", "anagnostopoulos-1988", "--at", "e=0.6", "--json"),
    ("solve", "--model", "mujoco-solref", "--for", "dampratio", "--target", "e_out=0.6", "--json"),
    ("timestep", "--model", "anagnostopoulos-1988", "--at", "e=0.6", "--steps-per-contact", "20", "--json"),
    ("export", "--to", "lammps", "--at", "e=0.6", "--json"),
    ("export", "--list", "--json"),
    ("calibrate", "fit.toml", "-o", "c.h5", "--json"),
    ("sensitivity", "uncertain.toml", "--of", "e_out", "-o", "u.h5", "--json"),
    ("info", "c.h5", "--json"),
    ("info", "u.h5", "--json"),
    ("compare", "r.h5", "r.h5", "--format", "json"),
    ("conform", "--adapter", "rigid.py:collide", "-o", "b.h5", "--json"),
    ("info", "b.h5", "--json"),
    ("models", "hertz", "--json"),
    ("materials", "glass", "--json"),
)


def functions() -> Iterator[str]:
    """Give a line for each public name: the parameters of a function, the public members of a class."""
    for name in sorted(impact.__all__):
        member = getattr(impact, name)
        if inspect.isclass(member):
            fields = getattr(member, "__dataclass_fields__", {})
            # what all results have is not repeated
            bases = [base for base in member.__mro__ if base.__module__.startswith("impact") and base != Displayed]
            public = {*fields, *(key for base in bases for key in vars(base) if not key.startswith("_"))}
            yield f"class {name}: {' '.join(sorted(public))}"
        else:
            parameters = inspect.signature(member).parameters.values()
            yield f"{name}({', '.join(map(describe_parameter, parameters))})"


def describe_parameter(parameter: inspect.Parameter) -> str:
    """Write a parameter without its annotation; what follows `*` is by keyword."""
    mark = "*" if parameter.kind is inspect.Parameter.KEYWORD_ONLY else ""
    if parameter.default is parameter.empty:
        return mark + parameter.name
    default = parameter.default
    return f"{mark}{parameter.name}={'...' if callable(default) else repr(default)}"


def options() -> Iterator[str]:
    """Give a line for each command: its arguments and options, and the defaults of those that have one."""
    for name in sorted(program.COMMANDS):
        words = []
        for option in program.load_command(name).params:
            word, default = "/".join([*option.opts, *option.secondary_opts]), option.default
            has_default = not callable(default) and default not in (None, False, "", (), [])
            words.append(f"{word}={default}" if has_default else word)
        yield f"{name}: {' '.join(words)}"


def config_keys(schema: dict[str, Any]) -> Iterator[str]:
    """Give the keys of each table of the JSON Schema of a config."""
    yield f"(top): {' '.join(sorted(schema['properties']))}"
    # a table of a range, distribution or fit has the same keys whatever the unit in its name
    tables = {
        re.sub(r".*?(Range|Distribution|Fit)_of_.*", r"\1", name): " ".join(sorted(table["properties"]))
        for name, table in schema["$defs"].items()
        if "properties" in table
    }
    yield from (f"{name}: {keys}" for name, keys in sorted(tables.items()))


def paths(value: object, stem: str = "") -> set[str]:
    """Return the paths to the values of nested JSON, with [] for any item of a list."""
    if isinstance(value, dict) and value:
        return {path for key, item in value.items() for path in paths(item, f"{stem}.{key}" if stem else key)}
    if isinstance(value, list):
        # an empty list counts too, so that what this machine warns of does not matter
        return {path for item in value for path in paths(item, f"{stem}[]")} or {f"{stem}[]"}
    return {stem}


def surface(run: Run, folder: Path) -> str:
    """Describe the public surface, in text that is compared line by line."""
    (folder / "config.toml").write_text(CONFIG, encoding="utf-8")
    (folder / "uncertain.toml").write_text(UNCERTAIN, encoding="utf-8")
    (folder / "fit.toml").write_text(FIT, encoding="utf-8")
    rigid = Path(__file__).parent.parent / "docs" / "conform" / "rigid.py"
    (folder / "rigid.py").write_text(rigid.read_text(encoding="utf-8"), encoding="utf-8")
    lines = ["# functions and classes", *functions(), "", "# options of commands", *options()]
    lines += ["", "# keys of a config", *config_keys(impact.schema())]
    for words in COMMANDS:
        done = run(*words, cwd=folder)
        assert done.returncode == 0, (words, done.stderr)
        keys = {re.sub(r"^variables\.[^.]+", "variables.*", path) for path in paths(json.loads(done.stdout))}
        lines += ["", f"# impact {' '.join(words)}", *sorted(keys)]
    for name in ("r.h5", "c.h5", "u.h5", "b.h5"):
        dataset = impact.load(folder / name)
        lines += ["", f"# variables of {name}", *sorted(map(str, dataset.variables))]
        lines += [f"attribute {key}" for key in sorted(dataset.attrs)]
    history = impact.run(model="anagnostopoulos-1988", at={"e": 0.6}).history
    assert history is not None
    lines += ["", "# variables of a history", *sorted(map(str, history.variables))]
    return "\n".join(lines) + "\n"


def test_the_public_surface_is_the_recorded_one(cli: Run, tmp_path: Path) -> None:
    assert surface(cli, tmp_path).splitlines() == SURFACE.read_text(encoding="utf-8").splitlines()


def test_help_names_each_public_name_once_by_its_purpose() -> None:
    listed = re.findall(r"^[A-Z][\w ]+: ((?:\w+,?\s)+)$", impact.__doc__ or "", re.MULTILINE)
    assert sorted(name for names in listed for name in re.findall(r"\w+", names)) == sorted(impact.__all__)


def test_no_signature_shows_an_object_by_its_address() -> None:
    members = [getattr(impact, name) for name in impact.__all__]
    shown_members = [member for member in members if inspect.isfunction(member) or is_dataclass(member)]
    signatures = {member.__name__: str(inspect.signature(member)) for member in shown_members}
    shown = ("<", " at 0x", "Plan", "Output(")
    assert [name for name, signature in signatures.items() if any(text in signature for text in shown)] == []


@pytest.mark.parametrize(
    ("call", "keyword"),
    [
        (lambda: impact.bless("", "", reason="", show=print), "bless: show"),
        (lambda: impact.rerun("no.h5", execute=print), "rerun: execute"),  # type: ignore[arg-type]
        (lambda: impact.sensitivity({}, execute=print), "sensitivity: execute"),  # type: ignore[arg-type]
        (lambda: impact.sensitivities({}, [], execute=print), "sensitivities: execute"),  # type: ignore[arg-type]
        (lambda: impact.save(xr.Dataset(), "r.h5", output=Output()), "save: output"),
    ],
)
def test_a_deprecated_keyword_is_a_warning(call: Callable[[], object], keyword: str) -> None:
    """Docstrings and docs/stability.md name it."""
    function, name = keyword.split(": ")
    text = inspect.getdoc(getattr(impact, function.replace("sensitivities", "sensitivity")))
    assert f"\n{name} : deprecated" in (text or "")
    assert f"`{name}`" in (ROOT / "docs" / "stability.md").read_text(encoding="utf-8")
    with (
        pytest.warns(DeprecationWarning, match=f"^{keyword} is deprecated") as caught,
        suppress(impact.ImpactError),
    ):
        call()
    assert caught[0].filename == __file__


def main() -> None:
    """Record the surface."""
    with start_fork_server() as forked, tempfile.TemporaryDirectory() as folder:
        SURFACE.write_text(surface(forked, Path(folder)), encoding="utf-8")


if __name__ == "__main__":
    main()
