"""A model of one's own comes from a Python file that the command line names, never from one that a file names."""

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
from impact.errors import ModelError, ResultError, UsageError
from impact.results.provenance import check_plugins

from .fork_server import ForkServer

CHI = "(1 - e * e) / e"
PLUGIN = """\
from impact import hysteresis

MINE = hysteresis("mine-2026", title="Mine", year=2026, equation="", reference="", chi=lambda e: {chi})
"""
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
    ours = impact.load(folder / "results.h5")
    theirs = impact.sweep(folder / "config.toml", plugins=[_value()])
    xr.testing.assert_equal(ours, theirs)
    for name in ours.variables:
        assert ours[name].values.tobytes() == theirs[name].values.tobytes() or ours[name].dtype.kind == "O"
    # what tells them apart is where the model is from, and what follows from it
    told = {"plugins", "fingerprint"}
    assert {name for name in ours.attrs if ours.attrs[name] != theirs.attrs[name]} == told


def test_the_result_says_the_files_name_and_hash_and_no_folder(forked: ForkServer, folder: Path) -> None:
    forked("sweep", "config.toml", "--plugin", folder / "my_model.py", cwd=folder)
    attributes = impact.load(folder / "results.h5").attrs
    sha256 = hashlib.sha256((folder / "my_model.py").read_bytes()).hexdigest()
    assert json.loads(attributes["plugins"]) == {"mine-2026": {"file": "my_model.py", "sha256": sha256}}
    assert str(folder) not in json.dumps({name: str(value) for name, value in attributes.items()})


def test_from_python_by_name_too(folder: Path) -> None:
    path = folder / "my_model.py"
    assert "mine-2026" in impact.models([str(path)])
    assert "mine-2026" not in impact.models()
    swept = impact.sweep(folder / "config.toml", plugins=[path])
    shot = impact.run(folder / "config.toml", model="mine-2026", at={"e": 0.8}, plugins=[str(path)])
    assert shot.values["e_out"] == float(swept["e_out"].sel(model="mine-2026", e=0.8))


def test_run_and_several_plug_ins(forked: ForkServer, folder: Path) -> None:
    other = _write(folder / "other.py").read_text(encoding="utf-8").replace("mine-2026", "other")
    (folder / "other.py").write_text(other, encoding="utf-8")
    words = ["--plugin", "my_model.py", "--plugin", "other.py"]
    both = [
        json.loads(forked("run", "config.toml", "--model", key, *words, "--json", cwd=folder).stdout)
        for key in ("mine-2026", "other")
    ]
    assert both[0]["outputs"] == both[1]["outputs"]


def test_every_model_at_the_top_level_is_taken_once_and_built_in_ones_are_not(tmp_path: Path) -> None:
    text = (
        "from __future__ import annotations\n"
        "import dataclasses\n"
        "from impact.contact.models.elastic import *\n"
        "from impact.contact.models.hysteresis import GHARIB_HURMUZLU_2012 as BASE\n"
        "@dataclasses.dataclass\nclass Point:\n    x: float = 0.0\n"
        "A = dataclasses.replace(BASE, key='a')\n"
        "B = ALIAS = dataclasses.replace(BASE, key='b')\n"
    )
    (tmp_path / "two.py").write_text(text, encoding="utf-8")
    found = read_plugins([tmp_path / "two.py"])
    assert [model.key for model in found.models] == ["a", "b"]
    assert [one.record["file"] for one in found.items] == ["two.py", "two.py"]


def test_a_plug_in_leaves_no_trace_but_its_models(folder: Path) -> None:
    before = list(sys.path)
    (model,) = read_plugins([folder / "my_model.py"]).models
    assert sys.path == before
    assert "my_model" not in sys.modules
    assert sorted(p.name for p in folder.iterdir()) == ["config.toml", "my_model.py"]
    import inspect

    # a traceback shows the line
    assert CHI in inspect.getsource(model.coefficients["chi"])


def test_what_is_hashed_is_all_there_is(forked: ForkServer, folder: Path) -> None:
    (folder / "code").mkdir()
    (folder / "code" / "beside.py").write_text("FACTOR = 1.0\n", encoding="utf-8")
    (folder / "code" / "my.py").write_text("from beside import FACTOR\n", encoding="utf-8")
    done = forked("sweep", "config.toml", "--plugin", "code/my.py", cwd=folder)
    assert (done.returncode, done.stderr) == (2, "code/my.py:1: ModuleNotFoundError: No module named 'beside'\n")


def test_the_same_sweep_twice_and_with_a_changed_plug_in(forked: ForkServer, folder: Path) -> None:
    words = ["sweep", "config.toml", "--plugin", "my_model.py"]
    forked(*words, cwd=folder)
    before = (folder / "results.h5").read_bytes()
    again = forked(*words, cwd=folder)
    assert (again.returncode, again.stderr) == (0, "results.h5: already holds this sweep; nothing to do\n")
    # the name of the file does not count, what is in it does
    (folder / "my_model.py").rename(folder / "renamed.py")
    again = forked("sweep", "config.toml", "--plugin", "renamed.py", cwd=folder)
    assert (again.returncode, again.stderr) == (0, "results.h5: already holds this sweep; nothing to do\n")
    _write(folder / "my_model.py", "0.5 * (1 - e * e) / e")
    changed = forked(*words, cwd=folder)
    assert (changed.returncode, changed.stderr) == (
        2, "results.h5: exists; give another name, or overwrite it (--overwrite)\n",
    )  # fmt: skip
    assert (folder / "results.h5").read_bytes() == before


# what is in the file bad.py, and the line that it is refused with
BAD = {
    "syntax": ("X = 1\ndef f(:\n", "bad.py:2: not Python: invalid syntax: def f(:"),
    "indentation": ("if True:\nX = 1\n", "bad.py:2: not Python: expected an indented block"),
    "nul": ("X = 1\0\n", "bad.py:1: not Python: "),
    "not utf-8": (b"X = '\xff'\n", "bad.py:1: not Python: "),
    "nesting": (f"X = {'(' * 1000}\n", "bad.py:1: not Python: too many nested parentheses"),
    "exception": ("def f():\n    return 1 / 0\n\nf()\n", "bad.py:2: ZeroDivisionError: division by zero"),
    "elsewhere": ("import json\n\njson.loads('[')\n", "bad.py:3: JSONDecodeError: Expecting value"),
    "empty": ("", "bad.py: no model in it, expected a ForceModel at its top level"),
    "in a list": (f"{PLUGIN.format(chi=CHI)}MINE = [MINE]\n", "bad.py: no model in it"),
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
    "exit": ("import sys\nsys.exit(0)\n", "bad.py:2: SystemExit: 0; expected a file that declares"),
    "quit": ("raise SystemExit\n", "bad.py:1: SystemExit; expected"),
    "controls": ("raise ValueError('\\x1b[31m\\u202e\\n[red]')\n",
                 r"bad.py:1: ValueError: \x1b[31m\u202e\x0a[red]"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_bad_plug_in_is_one_line_and_nothing_is_written(forked: ForkServer, folder: Path, name: str) -> None:
    content, line = BAD[name]
    path = folder / "bad.py"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    before = sorted(p.name for p in folder.iterdir())
    # the two commands do not differ in this: each in turn is enough
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
        ("x" * 300 + ".py", "x" * 199 + "…: cannot be read: File name too long"),
    ],
)
def test_what_is_no_python_file_is_refused(forked: ForkServer, folder: Path, path: str, line: str) -> None:
    (folder / "folder.py").mkdir()
    os.mkfifo(folder / "fifo.py")
    done = forked("sweep", "config.toml", "--plugin", path, cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(line), done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (folder / "results.h5").exists()


def test_two_plug_ins_with_one_key_are_refused(forked: ForkServer, folder: Path) -> None:
    _write(folder / "other.py")
    done = forked("sweep", "config.toml", "--plugin", "my_model.py", "--plugin", "other.py", cwd=folder)
    assert (done.returncode, done.stderr) == (
        2,
        "other.py: model mine-2026: there are two models of this key, the other one in my_model.py; expected "
        "another key\n",
    )


def test_what_is_neither_a_model_nor_a_path_is_refused() -> None:
    for wrong in ([3], [SimpleNamespace(key="mine")]):
        with pytest.raises(UsageError, match=r"plugins\[0\]: got .*, expected a ForceModel or the path"):
            impact.models(wrong)  # type: ignore[arg-type]
    for alone in ("my_model.py", _value()):
        with pytest.raises(UsageError, match="expected a list"):
            impact.models(alone)  # type: ignore[arg-type]


def test_an_output_is_never_the_plug_in(forked: ForkServer, folder: Path) -> None:
    before = (folder / "my_model.py").read_text(encoding="utf-8")
    for words in (["sweep", "config.toml", "-o"], ["run", "config.toml", "--history"]):
        refused = forked(*words, "my_model.py", "--plugin", "my_model.py", "--overwrite", cwd=folder)
        assert (refused.returncode, refused.stderr) == (
            2,
            "my_model.py: is the file to be read, and is not modified\n",
        )
    assert (folder / "my_model.py").read_text(encoding="utf-8") == before


def test_a_result_needs_its_plug_in_again(forked: ForkServer, folder: Path) -> None:
    forked("sweep", "config.toml", "--plugin", "my_model.py", cwd=folder)
    words = ["run", "results.h5", "--model", "mine-2026", "--at", "e=0.8", "--json"]
    (folder / "my_model.py").rename(folder / "moved.py")
    given = forked(*words, "--plugin", "moved.py", cwd=folder)
    assert given.returncode == 0, given.stderr
    stored = impact.load(folder / "results.h5").sel(model="mine-2026", e=0.8)
    assert json.loads(given.stdout)["outputs"]["e_out"] == float(stored["e_out"])

    # also where another model is asked for: the config names it
    for missing in (forked(*words, cwd=folder), forked("run", "results.h5", "--model", "hertz", cwd=folder)):
        assert (missing.returncode, missing.stdout, missing.stderr) == (
            2, "", "results.h5: made with mine-2026 of my_model.py; give it again with --plugin FILE\n",
        )  # fmt: skip

    made = hashlib.sha256((folder / "moved.py").read_bytes()).hexdigest()
    other = hashlib.sha256(_write(folder / "my_model.py", "1 - e").read_bytes()).hexdigest()
    changed = forked(*words, "--plugin", "my_model.py", cwd=folder)
    assert (changed.returncode, changed.stderr) == (
        0, "note: results.h5: was made with another version of my_model.py: "
        f"its SHA-256 is {made}, this one's is {other}\n",
    )  # fmt: skip
    assert json.loads(changed.stdout)["outputs"]["e_out"] != float(stored["e_out"])


def test_a_result_needs_its_value_again(forked: ForkServer, folder: Path) -> None:
    path = folder / "results.h5"
    impact.save(impact.sweep(folder / "config.toml", plugins=[_value()]), path)
    assert impact.run(path, model="mine-2026", plugins=[_value()]).model.title == "Mine"
    for words in ([], ["--plugin", "my_model.py"]):
        done = forked("run", "results.h5", *words, cwd=folder)
        assert (done.returncode, done.stderr) == (
            2, "results.h5: made with mine-2026 of a Python value; give it again with plugins=[...]\n",
        )  # fmt: skip
    other = dataclasses.replace(_value(), title="Another")
    with pytest.warns(UserWarning, match="was made with another version of the model mine-2026: its SHA-256 is"):
        impact.run(path, plugins=[other])


def test_a_model_more_than_the_result_was_made_with_is_welcome(forked: ForkServer, folder: Path) -> None:
    forked("sweep", "config.toml", "--set", 'models=["hertz"]', cwd=folder)
    done = forked("run", "results.h5", "--plugin", "my_model.py", "--model", "mine-2026", "--json", cwd=folder)
    assert json.loads(done.stdout)["model"] == "mine-2026"


HOSTILE = [
    "", "no JSON", "[" * 100_000, "[]", "3", "null", '"mine"', '{"mine": 3}', '{"mine": "12ab"}', '{"mine": {}}',
    '{"mine": {"file": 3, "sha256": "12ab"}}', '{"mine": {"file": "my.py", "sha256": 3}}',
    "9" * 5000,
]  # fmt: skip


@pytest.mark.parametrize("attribute", HOSTILE, ids=range(len(HOSTILE)))
def test_an_attribute_from_anywhere_is_reported_in_a_line(attribute: str) -> None:
    for attributes in ({"plugins": attribute}, {"plugins": attribute.encode()}, {}):
        with pytest.raises(ResultError, match=r"^r\.h5: attribute plugins: [^\n]*$"):
            check_plugins(attributes, Plugins(), "r.h5")


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


def test_nothing_that_a_file_names_is_imported(forked: ForkServer, folder: Path) -> None:
    marker = folder / "marker"
    evil = folder / "evil.py"
    evil.write_text(f"open({str(marker)!r}, 'w').close()\n{PLUGIN.format(chi=CHI)}", encoding="utf-8")
    # the command line imports it: the marker can be made
    assert forked("sweep", "config.toml", "-o", "evil.h5", "--plugin", "evil.py", cwd=folder).returncode == 0
    marker.unlink()

    # a result made with it, and one that says so of itself by a path
    own = impact.load(folder / "evil.h5")
    entry = {"mine-2026": {"file": str(evil), "sha256": hashlib.sha256(evil.read_bytes()).hexdigest()}}
    impact.save(own.assign_attrs(plugins=json.dumps(entry), plugin=str(evil)), folder / "path.h5")
    for name in ("evil.h5", "path.h5"):
        assert forked("run", name, "--model", "mine-2026", cwd=folder).returncode == 2
        assert forked("info", name, cwd=folder).returncode == 0
        with pytest.raises(UsageError, match="made with mine-2026"):
            impact.run(folder / name)

    for line in ('plugin = "evil.py"', 'plugins = ["evil.py"]', 'models = ["evil.py"]', 'models = "evil"'):
        text = CONFIG.split("\n", 1)[1]
        own_models = "" if line.startswith("models") else 'models = ["mine-2026"]\n'
        (folder / "names.toml").write_text(f"{line}\n{own_models}{text}", encoding="utf-8")
        for command in ("sweep", "run"):
            assert forked(command, "names.toml", cwd=folder).returncode == 2
    for override in ('plugins=["evil.py"]', 'model.evil.plugin="evil.py"'):
        assert forked("sweep", "config.toml", "--set", override, "-o", "o.h5", cwd=folder).returncode == 2
    assert not marker.exists()
    assert "mine-2026" not in catalogue()


def test_a_failed_plug_in_is_forgotten(tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text("1 / 0\n", encoding="utf-8")
    with pytest.raises(ModelError, match="ZeroDivisionError"):
        read_plugins([tmp_path / "bad.py"])
    assert not [one for one in sys.modules.values() if str(tmp_path) in str(getattr(one, "__file__", ""))]


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
one, other = lambda e: 1 - e, lambda e: 2 - e
print(hashed(half), hashed(whole), hashed(half, "Half"), hashed(one), hashed(other))
print(*map(hashed, (scaled, functools.partial(scaled, factor=3.0), closing(2.0), session["typed"])))
"""


def test_a_value_is_known_by_the_file_that_defines_it(tmp_path: Path) -> None:
    def hashes(text: str) -> tuple[list[str], list[str]]:
        (tmp_path / "values.py").write_text(text, encoding="utf-8")
        command = [sys.executable, str(tmp_path / "values.py")]
        lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
        return lines[0].split(), lines[1].split()

    known, unknown = hashes(VALUES)
    # two functions of one file, and two titles, are other models; the next process finds the same hashes
    assert len({*known}) == 5
    assert hashes(VALUES)[0] == known
    # what a formula takes from elsewhere is in no file: it has no hash that could equal another
    assert unknown == ["None"] * 4
    assert not {*hashes(VALUES.replace("FACTOR = 1.0", "FACTOR = 1.5"))[0]} & {*known}


def test_a_value_without_a_file_is_never_taken_for_the_same(folder: Path) -> None:
    def law(factor: float) -> impact.ForceModel:
        return impact.hysteresis(
            "mine-2026", title="Mine", year=2026, equation="", reference="", chi=lambda e: factor * (1 - e)
        )

    path, same = folder / "r.h5", law(1.0)
    impact.save(impact.sweep(folder / "config.toml", plugins=[same]), path)
    assert json.loads(impact.load(path).attrs["plugins"]) == {"mine-2026": {"file": None, "sha256": None}}
    for given in (same, law(2.0)):
        with pytest.warns(UserWarning, match="mine-2026 is a Python value that no file defines"):
            impact.run(path, plugins=[given])
        with pytest.raises(UsageError, match="mine-2026 is a Python value that no file defines"):
            impact.extend(path, ["sweep.e=[0.2, 0.5, 0.8]"], plugins=[given])
    assert impact.rerun(path, plugins=[same]).equal
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
# enough trajectories that others integrate too
MANY = ForceModel(
    "many", "Many", 2026, "F", "", force=lambda elastic, e, c: elastic + 0 * e * c,
    parameters=(Parameter("c", "1", "c"),),
)
"""
AMBIGUOUS = (
    "note: branching.py:5: model branching: ValueError: The truth value of an array with more than one element is "
    "ambiguous. Use a.any() or a.all(); formulas work on arrays: use np.where instead of if"
)


@pytest.mark.parametrize("words", [(), ("--jobs", "2"), ("--threads", "2")])
def test_an_error_of_a_law_is_printed_once_with_its_place(
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


def test_the_replay_of_a_law_that_branches_fails_as_the_sweep_did(forked: ForkServer, folder: Path) -> None:
    (folder / "branching.py").write_text(BRANCHING, encoding="utf-8")
    words = ("config.toml", "--set", 'models=["branching"]', "--plugin", "branching.py", "--allow-failed")
    done = forked("sweep", *words, "--json", cwd=folder)
    assert done.returncode == 0
    again = shlex.split(json.loads(done.stdout)["first_failed"][0]["replay"])
    done = forked(*again[1:], cwd=folder)
    assert (done.returncode, done.stderr) == (3, AMBIGUOUS + "\n")
    assert "model_error" in done.stdout or "raised an error" in done.stdout
