"""Plug-ins are Python values or files that the caller names; a file that a data file names is never imported."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import xarray as xr

import impact
from impact.contact.models import catalogue
from impact.engine.plugins import Plugins, read_plugins
from impact.errors import ConfigError, ModelError, ResultError, UsageError
from impact.results.provenance import check_plugins

from .conftest import CHI, PLUGIN
from .fork_server import ForkServer

CONFIG = """models = ["hertz", "mine-2026"]
[solver]
rtol = 1e-4
[sweep]
e = [0.2, 0.8]
v1 = 1.0
m1 = 1.0
m2 = 1.0
K = 6e9
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a sweep, and the file of the model that it names."""
    (tmp_path / "config.toml").write_text(CONFIG, encoding="utf-8")
    _write(tmp_path / "my_model.py")
    return tmp_path


def _write(path: Path, chi: str = CHI) -> Path:
    path.write_text(PLUGIN.format(chi=chi), encoding="utf-8")
    return path


def _value() -> impact.ForceModel:
    return impact.hysteresis(
        "mine-2026", title="Mine", year=2026, equation="", reference="", chi=lambda e: (1 - e * e) / e
    )


def test_a_file_and_the_same_model_as_a_value_give_the_same_bits(forked: ForkServer, folder: Path) -> None:
    done = forked("sweep", "config.toml", "--plugin", "my_model.py", cwd=folder)
    assert done.returncode == 0, done.stderr
    by_file = impact.load(folder / "results.h5")
    by_value = impact.sweep(folder / "config.toml", plugins=[_value()])
    xr.testing.assert_equal(by_file, by_value)
    for name in by_file.variables:
        assert by_file[name].values.tobytes() == by_value[name].values.tobytes() or by_file[name].dtype.kind == "O"
    # only the origin of the model differs, and the fingerprint, which depends on it
    differing = {name for name in by_file.attrs if by_file.attrs[name] != by_value.attrs[name]}
    assert differing == {"plugins", "fingerprint"}


def test_the_result_has_the_name_and_hash_of_the_file_but_no_folder(folder: Path) -> None:
    attributes = impact.sweep(folder / "config.toml", plugins=[folder / "my_model.py"]).attrs
    sha256 = hashlib.sha256((folder / "my_model.py").read_bytes()).hexdigest()
    assert json.loads(attributes["plugins"]) == {"mine-2026": {"file": "my_model.py", "sha256": sha256}}
    assert str(folder) not in json.dumps({name: str(value) for name, value in attributes.items()})


def test_functions_accept_the_path_of_a_plug_in(folder: Path) -> None:
    path = folder / "my_model.py"
    assert "mine-2026" in impact.models([str(path)])
    assert "mine-2026" not in impact.models()
    swept = impact.sweep(folder / "config.toml", plugins=[path])
    single = impact.run(folder / "config.toml", model="mine-2026", at={"e": 0.8}, plugins=[str(path)])
    assert single.values["e_out"] == float(swept["e_out"].sel(model="mine-2026", e=0.8))


def test_a_run_accepts_several_plug_ins(forked: ForkServer, folder: Path) -> None:
    other = _write(folder / "other.py").read_text(encoding="utf-8").replace("mine-2026", "other")
    (folder / "other.py").write_text(other, encoding="utf-8")
    words = ["--plugin", "my_model.py", "--plugin", "other.py"]
    both = [
        json.loads(forked("run", "config.toml", "--model", key, *words, "--json", cwd=folder).stdout)
        for key in ("mine-2026", "other")
    ]
    assert both[0]["outputs"] == both[1]["outputs"]


def test_each_new_model_at_the_top_level_of_a_file_is_read_once(tmp_path: Path) -> None:
    text = (
        "from __future__ import annotations\n"
        "import dataclasses\n"
        "from impact.contact.models.adhesive import *\n"
        "from impact.contact.models.hysteresis import GHARIB_HURMUZLU_2012 as BASE\n"
        "@dataclasses.dataclass\nclass Point:\n    x: float = 0.0\n"
        "A = dataclasses.replace(BASE, key='a')\n"
        "B = ALIAS = dataclasses.replace(BASE, key='b')\n"
    )
    (tmp_path / "two.py").write_text(text, encoding="utf-8")
    plugins = read_plugins([tmp_path / "two.py"])
    assert [model.key for model in plugins.models] == ["a", "b"]
    assert [plugin.record["file"] for plugin in plugins.items] == ["two.py", "two.py"]


def test_reading_a_plug_in_changes_neither_sys_nor_the_folder(folder: Path) -> None:
    before = list(sys.path)
    (model,) = read_plugins([folder / "my_model.py"]).models
    assert sys.path == before
    assert "my_model" not in sys.modules
    assert sorted(p.name for p in folder.iterdir()) == ["config.toml", "my_model.py"]
    import inspect

    # a traceback shows the lines of the file
    assert CHI in inspect.getsource(model.coefficients["chi"])


def test_a_plug_in_imports_no_file_beside_it(forked: ForkServer, folder: Path) -> None:
    (folder / "code").mkdir()
    (folder / "code" / "beside.py").write_text("FACTOR = 1.0\n", encoding="utf-8")
    (folder / "code" / "my.py").write_text("from beside import FACTOR\n", encoding="utf-8")
    done = forked("sweep", "config.toml", "--plugin", "code/my.py", cwd=folder)
    assert (done.returncode, done.stderr) == (2, "code/my.py:1: ModuleNotFoundError: No module named 'beside'\n")


@pytest.mark.slow
def test_a_sweep_is_repeated_only_if_its_plug_in_changed(forked: ForkServer, folder: Path) -> None:
    words = ["sweep", "config.toml", "--plugin", "my_model.py"]
    forked(*words, cwd=folder)
    before = (folder / "results.h5").read_bytes()
    again = forked(*words, cwd=folder)
    assert (again.returncode, again.stderr) == (0, "results.h5: already contains this sweep; nothing to do\n")
    # the name of the file does not count, what is in it does
    (folder / "my_model.py").rename(folder / "renamed.py")
    again = forked("sweep", "config.toml", "--plugin", "renamed.py", cwd=folder)
    assert (again.returncode, again.stderr) == (0, "results.h5: already contains this sweep; nothing to do\n")
    _write(folder / "my_model.py", "0.5 * (1 - e * e) / e")
    changed = forked(*words, cwd=folder)
    assert changed.returncode == 2
    assert changed.stderr == "results.h5: exists; give another name, or overwrite it (--overwrite)\n"
    assert (folder / "results.h5").read_bytes() == before


# the content of bad.py, and the start of the error message
BAD = {
    "syntax": ("X = 1\ndef f(:\n", "bad.py:2: not Python: invalid syntax: def f(:"),
    "indentation": ("if True:\nX = 1\n", "bad.py:2: not Python: expected an indented block"),
    "nul": ("X = 1\0\n", "bad.py:1: not Python: "),
    "not utf-8": (b"X = '\xff'\n", "bad.py:1: not Python: "),
    "nesting": (f"X = {'(' * 1000}\n", "bad.py:1: not Python: too many nested parentheses"),
    "exception": ("def f():\n    return 1 / 0\n\nf()\n", "bad.py:2: ZeroDivisionError: division by zero"),
    "elsewhere": ("import json\n\njson.loads('[')\n", "bad.py:3: JSONDecodeError: Expecting value"),
    "empty": ("", "bad.py: contains no model, expected a ForceModel at its top level"),
    "in a list": (f"{PLUGIN.format(chi=CHI)}MINE = [MINE]\n", "bad.py: contains no model"),
    "wish": (PLUGIN.format(chi="e").replace("lambda e", "lambda delta"),
             'bad.py:3: model mine-2026: its coefficient chi asks for "delta"; known: E1'),
    "key": (PLUGIN.format(chi="e").replace("mine-2026", "Mine"),
            'bad.py:3: model key "Mine": expected kebab-case'),
    "built in": (PLUGIN.format(chi="e").replace("mine-2026", "hertz"),
                 "bad.py: model hertz: there are two models of this key, the other one built in; expected"),
    "text": (PLUGIN.format(chi="e").replace('"Mine"', '"a\\0"'),
             r'bad.py: model mine-2026: title: got "a\x00", expected text without NUL'),
    "year": (PLUGIN.format(chi="e").replace("=2026", "='x'"),
             'bad.py: model mine-2026: year: got "x", expected a year, such as 2026'),
    "exit": ("import sys\nsys.exit(0)\n", "bad.py:2: SystemExit: 0; expected a file that only declares"),
    "quit": ("raise SystemExit\n", "bad.py:1: SystemExit; expected"),
    "generator": ("raise GeneratorExit()\n", "bad.py:1: GeneratorExit"),
    "controls": ("raise ValueError('\\x1b[31m\\u202e\\n[red]')\n",
                 r"bad.py:1: ValueError: \x1b[31m\u202e\x0a[red]"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_bad_plug_in_is_one_line_and_nothing_is_written(forked: ForkServer, folder: Path, name: str) -> None:
    content, line = BAD[name]
    path = folder / "bad.py"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    before = sorted(p.name for p in folder.iterdir())
    # both commands read plug-ins in the same way: every other case is enough for each
    words = ["sweep", "-o", "o.h5"] if list(BAD).index(name) % 2 else ["run"]
    done = forked(*words, "config.toml", "--plugin", "bad.py", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(line), done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert sorted(p.name for p in folder.iterdir()) == before


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("absent.py", "absent.py: cannot be read: No such file or directory"),
        ("folder.py", "folder.py: not a regular file, expected a Python file"),
        ("fifo.py", "fifo.py: not a regular file, expected a Python file"),
        ("config.toml", "config.toml: its name does not end in .py, expected a Python file"),
        ("my_model", "my_model: its name does not end in .py, expected a Python file"),
        ("a\x1b[31m\u202e.py", r"a\x1b[31m\u202e.py: cannot be read: No such file"),
        ("x" * 300 + ".py", "x" * 300 + ".py: cannot be read: File name too long"),
    ],
)
def test_a_path_that_is_no_python_file_is_an_error(forked: ForkServer, folder: Path, path: str, line: str) -> None:
    (folder / "folder.py").mkdir()
    os.mkfifo(folder / "fifo.py")
    done = forked("sweep", "config.toml", "--plugin", path, cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(line), done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (folder / "results.h5").exists()


def test_two_plug_ins_with_the_same_key_are_an_error(forked: ForkServer, folder: Path) -> None:
    _write(folder / "other.py")
    done = forked("sweep", "config.toml", "--plugin", "my_model.py", "--plugin", "other.py", cwd=folder)
    assert (done.returncode, done.stderr) == (
        2,
        "other.py: model mine-2026: there are two models of this key, the other one in my_model.py; expected "
        "another key\n",
    )


def test_a_plug_in_that_is_neither_a_model_nor_a_path_is_an_error() -> None:
    for wrong in ([3], [SimpleNamespace(key="mine")]):
        with pytest.raises(UsageError, match=r"plugins\[0\]: got .*, expected a ForceModel or the path"):
            impact.models(wrong)  # type: ignore[arg-type]
    for no_list in ("my_model.py", _value()):
        with pytest.raises(UsageError, match="expected a list"):
            impact.models(no_list)  # type: ignore[arg-type]


def test_an_output_never_overwrites_the_plug_in(forked: ForkServer, folder: Path) -> None:
    before = (folder / "my_model.py").read_text(encoding="utf-8")
    for words in (["sweep", "config.toml", "-o"], ["run", "config.toml", "--history"]):
        refused = forked(*words, "my_model.py", "--plugin", "my_model.py", "--overwrite", cwd=folder)
        assert (refused.returncode, refused.stderr) == (
            2,
            "my_model.py: is the file to be read, and is not modified\n",
        )
    assert (folder / "my_model.py").read_text(encoding="utf-8") == before


@pytest.mark.slow
def test_a_run_of_a_result_needs_the_plug_in_of_the_sweep(forked: ForkServer, folder: Path) -> None:
    forked("sweep", "config.toml", "--plugin", "my_model.py", cwd=folder)
    words = ["run", "results.h5", "--model", "mine-2026", "--at", "e=0.8", "--json"]
    (folder / "my_model.py").rename(folder / "moved.py")
    done = forked(*words, "--plugin", "moved.py", cwd=folder)
    assert done.returncode == 0, done.stderr
    stored = impact.load(folder / "results.h5").sel(model="mine-2026", e=0.8)
    assert json.loads(done.stdout)["outputs"]["e_out"] == float(stored["e_out"])

    # also for another model: the config names the plug-in
    for missing in (forked(*words, cwd=folder), forked("run", "results.h5", "--model", "hertz", cwd=folder)):
        message = "results.h5: made with mine-2026 of my_model.py; give it again with --plugin FILE\n"
        assert (missing.returncode, missing.stdout, missing.stderr) == (2, "", message)

    original = hashlib.sha256((folder / "moved.py").read_bytes()).hexdigest()
    other = hashlib.sha256(_write(folder / "my_model.py", "1 - e").read_bytes()).hexdigest()
    changed = forked(*words, "--plugin", "my_model.py", cwd=folder)
    assert (changed.returncode, changed.stderr) == (
        0,
        "note: results.h5: was made with another version of my_model.py: "
        f"its SHA-256 is {original}, this one's is {other}\n",
    )
    assert json.loads(changed.stdout)["outputs"]["e_out"] != float(stored["e_out"])


def test_a_run_of_a_calibration_with_a_changed_plug_in_has_a_warning(folder: Path) -> None:
    config = {
        "models": "mine-2026",
        "solver": {"rtol": 1e-4},
        "sweep": {"e": {"fit": [0.1, 1.0]}, "v1": 1.0, "m1": 1.0, "m2": 2.0, "K": 1e6},
        "data": {"columns": {"e_out": [0.5, 0.52]}},
    }
    plugin, path = folder / "my_model.py", folder / "fit.h5"
    impact.calibrate(config, plugins=[plugin], output=path)
    assert impact.run(path, plugins=[plugin]).e_kinematic == pytest.approx(0.51, abs=1e-3)
    _write(plugin, "1 - e")
    with pytest.warns(UserWarning, match=r"fit\.h5: was made with another version of my_model\.py: its SHA"):
        changed = impact.run(path, plugins=[plugin])
    assert changed.e_kinematic > 0.6


@pytest.mark.slow
def test_a_run_of_a_result_needs_the_python_value_of_the_sweep(forked: ForkServer, folder: Path) -> None:
    path = folder / "results.h5"
    impact.save(impact.sweep(folder / "config.toml", plugins=[_value()]), path)
    assert impact.run(path, model="mine-2026", plugins=[_value()]).model.title == "Mine"
    for words in ([], ["--plugin", "my_model.py"]):
        done = forked("run", "results.h5", *words, cwd=folder)
        message = "results.h5: made with mine-2026 of a Python value; give it again with plugins=[...]\n"
        assert (done.returncode, done.stderr) == (2, message)
    other = dataclasses.replace(_value(), title="Another")
    with pytest.warns(UserWarning, match="was made with another version of the model mine-2026: its SHA-256 is"):
        impact.run(path, plugins=[other])


def test_a_run_of_a_result_accepts_a_further_model(folder: Path) -> None:
    impact.sweep_to_file(folder / "config.toml", folder / "results.h5", overrides=['models=["hertz"]'])
    single = impact.run(folder / "results.h5", model="mine-2026", plugins=[folder / "my_model.py"])
    assert single.model.key == "mine-2026"


HOSTILE = [
    "",
    "no JSON",
    "[" * 100_000,
    "[]",
    "3",
    "null",
    '"mine"',
    '{"mine": 3}',
    '{"mine": "12ab"}',
    '{"mine": {}}',
    '{"mine": {"file": 3, "sha256": "12ab"}}',
    '{"mine": {"file": "my.py", "sha256": 3}}',
    "9" * 5000,
]


@pytest.mark.parametrize("attribute", HOSTILE, ids=range(len(HOSTILE)))
def test_an_invalid_attribute_is_reported_in_one_line(attribute: str) -> None:
    for attributes in ({"plugins": attribute}, {"plugins": attribute.encode()}, {}):
        with pytest.raises(ResultError, match=r"^r\.h5: attribute plugins: [^\n]*$"):
            check_plugins(attributes, Plugins(), "r.h5")


@pytest.mark.slow
def test_hostile_names_in_a_result_are_escaped(forked: ForkServer, folder: Path) -> None:
    result = impact.sweep(folder / "config.toml", overrides=['models="hertz"'])
    bad = "\x1b[31m\u202e\n[red]" + "x" * 5000
    for plugins, words, code in (
        ({bad: {"file": bad, "sha256": bad}}, "made with", 2),
        ({"mine-2026": {"file": bad, "sha256": bad}}, "was made with another version", 0),
    ):
        impact.save(result.assign_attrs(plugins=json.dumps(plugins)), folder / "bad.h5", overwrite=True)
        done = forked("run", "bad.h5", "--plugin", "my_model.py", cwd=folder)
        assert done.returncode == code
        assert words in done.stderr
        assert len(done.stderr.splitlines()) == 1
        assert not re.search("[\x1b\u202e]", done.stderr)
        assert len(done.stderr) < 600


@pytest.mark.slow
def test_nothing_that_a_data_file_names_is_imported(
    forked: ForkServer, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    marker = folder / "marker"
    evil = folder / "evil.py"
    evil.write_text(f"open({str(marker)!r}, 'w').close()\n{PLUGIN.format(chi=CHI)}", encoding="utf-8")
    # the caller names it: it is imported, and makes the marker
    impact.sweep_to_file(folder / "config.toml", folder / "evil.h5", plugins=[evil])
    marker.unlink()

    # a result of that sweep, and one with an attribute that names the path
    result = impact.load(folder / "evil.h5")
    entry = {"mine-2026": {"file": str(evil), "sha256": hashlib.sha256(evil.read_bytes()).hexdigest()}}
    impact.save(result.assign_attrs(plugins=json.dumps(entry), plugin=str(evil)), folder / "path.h5")
    for name in ("evil.h5", "path.h5"):
        assert forked("run", name, "--model", "mine-2026", cwd=folder).returncode == 2
        assert forked("info", name, cwd=folder).returncode == 0
        with pytest.raises(UsageError, match="made with mine-2026"):
            impact.run(folder / name)

    monkeypatch.chdir(folder)
    for line in ('plugin = "evil.py"', 'plugins = ["evil.py"]', 'models = ["evil.py"]', 'models = "evil"'):
        text = CONFIG.split("\n", 1)[1]
        models = "" if line.startswith("models") else 'models = ["mine-2026"]\n'
        Path("names.toml").write_text(f"{line}\n{models}{text}", encoding="utf-8")
        for command in (impact.sweep, impact.run):
            with pytest.raises(ConfigError):
                command("names.toml")
        assert forked("sweep", "names.toml", cwd=folder).returncode == 2
    for override in ('plugins=["evil.py"]', 'model.evil.plugin="evil.py"'):
        with pytest.raises(ConfigError):
            impact.sweep("config.toml", overrides=[override])
        assert forked("sweep", "config.toml", "--set", override, "-o", "o.h5", cwd=folder).returncode == 2
    assert not marker.exists()
    assert "mine-2026" not in catalogue()


def test_a_failed_plug_in_is_no_loaded_module(tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text("1 / 0\n", encoding="utf-8")
    with pytest.raises(ModelError, match="ZeroDivisionError"):
        read_plugins([tmp_path / "bad.py"])
    files = [str(getattr(module, "__file__", "")) for module in sys.modules.values()]
    assert not [file for file in files if str(tmp_path) in file]


VALUES = """
import functools
from impact import ForceModel, hysteresis
from impact.engine.plugins import read_plugins

FACTOR = 1.0

def scaled(e, factor=2.0):
    return factor * (1 - e)

def half(e): return FACTOR * (1 - e)
def whole(e): return 2 * FACTOR * (1 - e)

def closing(factor):
    return lambda e: factor * (1 - e)

def hashed(chi, title=""):
    law = hysteresis("mine", title=title, year=1, equation="", reference="", chi=chi)
    return read_plugins([law]).hashes["mine"]

session = {}
exec("typed = lambda e: 1 - e", session)
first, second = lambda e: 1 - e, lambda e: 2 - e
print(hashed(half), hashed(whole), hashed(half, "Half"), hashed(first), hashed(second))
print(*map(hashed, (scaled, functools.partial(scaled, factor=3.0), closing(2.0), session["typed"])))
"""


@pytest.fixture
def scripts(tmp_path: Path) -> tuple[Path, Path]:
    """The script VALUES in a file, and with another content in another folder."""
    paths = (tmp_path / "original" / "values.py", tmp_path / "changed" / "values.py")
    for path, text in zip(paths, (VALUES, VALUES.replace("FACTOR = 1.0", "FACTOR = 1.5")), strict=True):
        path.parent.mkdir()
        path.write_text(text, encoding="utf-8")
    return paths


def test_the_hash_of_a_python_value_is_that_of_its_file(forked: ForkServer, scripts: tuple[Path, Path]) -> None:
    code = "".join(f"import runpy; runpy.run_path({str(path)!r}, run_name='__main__')\n" for path in scripts)
    lines = forked("--version", code=code).stdout.splitlines()
    original, unknown, changed = (line.split() for line in lines[:3])
    # two functions of a file, and two titles, are different models
    assert len({*original}) == 5
    assert not {*changed} & {*original}
    # values that are not in the file may differ: such a model has no hash
    assert unknown == ["None"] * 4


@pytest.mark.slow
def test_every_process_computes_the_same_hash_of_a_python_value(scripts: tuple[Path, Path]) -> None:
    command = [sys.executable, str(scripts[0])]
    first, second = (subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(2))
    assert len(first.splitlines()) == 2
    assert first == second


@pytest.mark.slow
def test_a_value_without_a_file_never_counts_as_the_same_model(folder: Path) -> None:
    def law(factor: float) -> impact.ForceModel:
        return impact.hysteresis(
            "mine-2026", title="Mine", year=2026, equation="", reference="", chi=lambda e: factor * (1 - e)
        )

    path, same = folder / "r.h5", law(1.0)
    impact.save(impact.sweep(folder / "config.toml", plugins=[same]), path)
    assert json.loads(impact.load(path).attrs["plugins"]) == {"mine-2026": {"file": None, "sha256": None}}
    for value in (same, law(2.0)):
        with pytest.warns(UserWarning, match="mine-2026 is a Python value that no file defines"):
            impact.run(path, plugins=[value])
        with pytest.raises(UsageError, match="mine-2026 is a Python value that no file defines"):
            impact.extend(path, ["sweep.e=[0.2, 0.5, 0.8]"], plugins=[value])
    again = impact.rerun(path, plugins=[same])
    assert again.equal
    assert any("cannot be known to be the one that the result was made with" in note for note in again.notes)
    assert not impact.rerun(path, plugins=[law(2.0)]).equal


BRANCHING = """\
import numpy as np
from impact import ForceModel, Parameter

def helper(e):
    if e > 0.5:
        return 1.0
    return 2.0

def force(elastic, v, e):
    return elastic * (1 + helper(e) * v)

def partly(elastic, e):
    if (e < 0.3).any():
        raise KeyError("no such e")
    return np.linalg.solve(np.zeros((2, 2)), np.ones(2)) if (e > 0.7).any() else elastic

BRANCHING = ForceModel("branching", "Branching", 2026, "F", "", force=force)
PARTLY = ForceModel("partly", "Partly", 2026, "F", "", force=partly)
# enough trajectories that other processes and threads integrate some
MANY = ForceModel(
    "many", "Many", 2026, "F", "", force=lambda elastic, e, c: elastic + 0 * e * c,
    parameters=(Parameter("c", "1", "c"),),
)
"""
AMBIGUOUS = (
    "note: branching.py:5: model branching: ValueError: The truth value of an array with more than one element is "
    "ambiguous. Use a.any() or a.all(); formulas work on arrays: use np.where instead of if"
)


@pytest.mark.slow
@pytest.mark.parametrize("words", [(), ("--threads", "2"), ("--jobs", "2")])
def test_an_error_in_a_formula_is_printed_once_with_file_and_line(
    forked: ForkServer, folder: Path, words: list[str]
) -> None:
    (folder / "branching.py").write_text(BRANCHING, encoding="utf-8")
    changes = (
        'models=["branching", "partly", "many"]', "sweep.e.linspace=[0.01,0.99,20]",
        "model.many.c.linspace=[1,2,1700]", "solver.rtol=1e-4",
    )  # fmt: skip
    sets = [word for change in changes for word in ("--set", change)]
    done = forked("sweep", "config.toml", *sets, "--plugin", "branching.py", *words, cwd=folder)
    assert done.returncode == 3
    notes = sorted(line for line in done.stderr.splitlines() if line.startswith("note: "))
    assert notes == [
        "note: branching.py:14: model partly: KeyError: 'no such e'",
        "note: branching.py:15: model partly: LinAlgError: Singular matrix",
        AMBIGUOUS,
    ]


def test_the_replay_of_a_failed_point_fails_in_the_same_way(forked: ForkServer, folder: Path) -> None:
    (folder / "branching.py").write_text(BRANCHING, encoding="utf-8")
    words = ("config.toml", "--set", 'models=["branching"]', "--plugin", "branching.py", "--allow-failed")
    done = forked("sweep", *words, "--json", cwd=folder)
    assert done.returncode == 0
    again = shlex.split(json.loads(done.stdout)["first_failed"][0]["replay"])
    done = forked(*again[1:], cwd=folder)
    assert (done.returncode, done.stderr) == (3, AMBIGUOUS + "\n")
    assert "model_error" in done.stdout or "raised an error" in done.stdout


@pytest.mark.slow
def test_garbage_is_collected_while_a_command_runs(folder: Path) -> None:
    (folder / "my_model.py").write_text(
        "import gc\nassert gc.isenabled()\n" + PLUGIN.format(chi=CHI), encoding="utf-8"
    )
    words = [sys.executable, "-m", "impact", "sweep", "config.toml", "--plugin", "my_model.py", "-q"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
