"""Material properties as axes, masses from radii, tables of cases and built-in materials are read or refused."""
# ruff: noqa: E501 (messages are kept whole, so that they can be searched for)

from __future__ import annotations

import math
import os
import re
import warnings
from pathlib import Path

import pandas as pd
import pytest

import impact
from impact.config.files import set_value
from impact.config.input_names import InputName, input_values
from impact.config.load import Config, parse_config, read_config
from impact.contact.materials import Material
from impact.engine.run import Run
from impact.errors import ConfigError
from impact.plots.data import read_points
from impact.results.sweep import read_plan

from .conftest import problems_of
from .fork_server import ForkServer

# what a user of the command line reads
pytestmark = pytest.mark.usefixtures("command_line_words")

TEXT = """\
models = ["hertz", "kelvin-voigt"]
[sweep]
v1 = 1.0
m1 = 1.0
m2 = 2.0
material = "block"
[model.kelvin-voigt]
C = 5.0
[materials.block]
E = 210e9
nu = 0.3
rho = 7850
[materials.other]
E = [1e9, 2e9]
nu = 0.3
"""
CASES = TEXT.replace("v1 = 1.0\nm1 = 1.0\n", 'e = [0.5, 0.9]\ncases = "cases.csv"\n').replace("C = 5.0\n", "")
CSV = """\
v1 [mm/s],"m1 [g]",model.kelvin-voigt.C [N s/m],materials.block.yield_strength [GPa]
1000,100,5,1

2000,1e2,6.5,1
"""


def read(text: str, *overrides: str) -> Config:
    return parse_config(text, overrides, name="x.toml")


def problems(text: str, *overrides: str) -> list[str]:
    return problems_of(read, text, *overrides)


def cases(folder: Path, csv: str | bytes = CSV, *overrides: str, text: str = CASES) -> Config:
    (folder / "x.toml").write_text(text)
    (folder / "cases.csv").write_bytes(csv if isinstance(csv, bytes) else csv.encode())
    return read_config(folder / "x.toml", overrides)


def refused(folder: Path, csv: str | bytes, *overrides: str, text: str = CASES) -> list[str]:
    lines = problems_of(cases, folder, csv, *overrides, text=text)
    return [line.replace(f"{folder}/", "") for line in lines]


def test_a_property_of_a_material_is_an_axis_between_those_of_the_sweep_and_of_models() -> None:
    config = read(
        TEXT,
        "model.kelvin-voigt.C=[1, 2]",
        'materials.block.E.linspace=["70 GPa","210 GPa",3]',
        "materials.block.yield_strength=[1e8, 2e8]",
        "sweep.e=[0.5, 1]",
    )
    assert [axis.name for axis in config.axes] == [
        "e", "materials.block.E", "materials.block.yield_strength", "kelvin-voigt.C",
    ]  # fmt: skip
    assert config.axes[1].columns == {"materials.block.E": (70e9, 140e9, 210e9)}
    assert math.isnan(config.materials["block"].E)
    assert (config.materials["block"].yield_strength, config.materials["block"].rho) == (None, 7850.0)
    # properties of an unused material are not axes
    assert "other" in config.materials
    assert read(TEXT).axes == ()


def test_a_mass_follows_from_a_radius_and_a_density() -> None:
    without = TEXT.replace("m1 = 1.0\n", "")
    assert "m1" not in read(without, "sweep.R1=0.1").scalars
    needs = "x.toml:2: sweep.m1: missing, expected a number > 0 kg, or inf: mass of ball 1; or "
    assert problems(without) == [f"{needs}R1 and a material with rho"]
    assert problems(
        without.replace('material = "block"\n', ""), "sweep.R1=0.1", "sweep.K=1e9", "models=hertz"
    ) == [f"{needs}R1 and a material with rho"]
    assert problems(without.replace("rho = 7850\n", ""), "sweep.R1=0.1", "sweep.R2=0.1") == [
        "x.toml:8: materials.block.rho: missing, expected a number > 0 kg/m^3, or m1 under [sweep]: "
        "the mass of ball 1 is not set"
    ]
    # mass, radius and density may be set together
    assert read(TEXT, "sweep.R1=0.1").scalars["m1"] == 1.0


def test_parameters_and_properties_are_zipped_by_their_paths() -> None:
    lists = ("sweep.m1=[1, 2]", "model.kelvin-voigt.C=[3, 4]", "materials.block.E=[5e9, 6e9]")
    for parameter in ("model.kelvin-voigt.C", "kelvin-voigt.C"):
        (axis,) = read(TEXT, *lists, f'sweep.zip=[["m1", "{parameter}", "materials.block.E"]]').axes
        assert axis.columns == {"m1": (1, 2), "kelvin-voigt.C": (3, 4), "materials.block.E": (5e9, 6e9)}
    assert problems(TEXT, *lists, 'sweep.zip=[["m1", "kelvin-voigt.D"]]') == [
        '--set sweep.zip=[["m1", "kelvin-voigt.D"]]: sweep.zip[0][1]: got "kelvin-voigt.D", expected an axis; '
        'did you mean "kelvin-voigt.C"?'
    ]


@pytest.mark.parametrize("name", ["kelvin-voigt.C", "materials.other.E"])
def test_a_zip_group_keeps_its_inputs_where_a_law_or_a_material_of_it_is_not_selected(name: str) -> None:
    lists = ("sweep.v1=[1, 2]", "model.kelvin-voigt.C=[3, 4]", "models=hertz")
    (axis,) = read(TEXT, *lists, f'sweep.zip=[["{name}", "v1"]]').axes
    assert axis.columns == {"v1": (1, 2)}


def test_a_table_of_cases_is_one_axis_and_crosses_the_others(tmp_path: Path) -> None:
    config = cases(tmp_path)
    assert [axis.name for axis in config.axes] == ["e", "case"]
    assert config.axes[1].columns == {
        "v1": (1.0, 2.0),
        "m1": (0.1, 0.1),
        "materials.block.yield_strength": (1e9, 1e9),
        "kelvin-voigt.C": (5.0, 6.5),
    }
    assert config.axes[1].labels == (0, 1)
    assert read(TEXT, "sweep.cases={v2 = [-1, -1]}").axes[0].columns == {"v2": (-1.0, -1.0)}


def test_cases_without_a_value_and_columns_without_use_are_left_out_with_a_note(tmp_path: Path) -> None:
    csv = "v1,m1,Note,kelvin-voigt.C\n1,1,,1\n2,,dry,2\n3,3,wet,NA\n4,4,,4\n"
    config = cases(tmp_path, csv)
    columns = {"v1": (1.0, 4.0), "m1": (1.0, 4.0), "kelvin-voigt.C": (1.0, 4.0)}
    assert {name: config.axes[1].columns[name] for name in columns} == columns
    notes = ["1 of 4 rows has no m1, 1 has no kelvin-voigt.C: left out", "columns without use: Note"]
    assert list(config.notes) == [f"{tmp_path}/cases.csv: {note}" for note in notes]
    shown: list[str] = []
    read_plan(tmp_path / "x.toml", run=Run(on_note=shown.append))
    assert shown[:2] == list(config.notes)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        impact.run(tmp_path / "x.toml")
    assert [str(warning.message) for warning in caught][:2] == list(config.notes)


def test_a_stored_config_needs_no_csv_file(tmp_path: Path) -> None:
    column = 'sweep.m2={file="cases.csv", column="m1"}'
    config = cases(tmp_path, CSV.replace("1e2", "200"), column, "sweep.zip=[]")
    assert config.text == CASES
    (tmp_path / "cases.csv").unlink()
    again = parse_config(config.text, config.overrides)
    assert repr(again) == repr(config)
    assert again.axes[-1].columns == {"m2": (0.1, 0.2)} or again.axes[1].columns == {"m2": (0.1, 0.2)}
    # a config that is passed as text opens no file
    assert problems(CASES) == ["cases.csv: not read; a stored config contains values, not file names"]


def test_a_mapping_names_files_of_the_working_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("drops.csv").write_text("v1 [mm/s], m1\n1,1\n2,2\n")
    column = {"file": "drops.csv"}
    sweep = {
        "v1": {**column, "column": "v1"}, "m1": {**column, "column": "m1"}, "m2": 1, "K": 1e9,
        "zip": [["v1", "m1"]],
    }  # fmt: skip
    (axis,) = read_config({"models": "hertz", "sweep": sweep}).axes
    assert axis.columns == {"v1": (0.001, 0.002), "m1": (1.0, 2.0)}


C = ",kelvin-voigt.C\n"
BAD_CSV = [
    ("v1 [kg],m1" + C + "1,1,1\n", ['cases.csv:1: v1: got [kg], expected a unit of m/s, such as "1 m/s"']),
    ("v1 [furlog],m1" + C + "1,1,1\n",
     ['cases.csv:1: v1: got [furlog], expected a unit of m/s, such as "1 m/s"; "furlog" is not a known unit']),
    ("v1,m1_" + C + "1,1,1\n", ['cases.csv:1: m1_: no such input; did you mean "m1"?']),
    ("v1,kelvin-voigt.D\n1,1\n", ['cases.csv:1: kelvin-voigt.D: no such input; did you mean "kelvin-voigt.K"?']),
    ("v1,hetrz.D\n1,1\n", ['cases.csv:1: hetrz.D: no such input; did you mean "hertz"?']),
    ("v1,materials.block.Y\n1,1\n",
     ['cases.csv:1: materials.block.Y: no such input; did you mean "materials.block.E"?']),
    ("v1,v1" + C + "1,1,1\n", ['cases.csv:1: got "v1" twice, expected each column once']),
    ("v1,m1" + C + "1,2,1\nfast,-1,inf\n",
     ["cases.csv:3: v1: got \"fast\", expected a finite number of m/s, bare or with a unit, such as \"1 m/s\"",
      "cases.csv:3: m1: got -1.0, expected a number > 0 kg, or inf",
      "cases.csv:3: kelvin-voigt.C: got inf, expected a number >= 0 N s/m"]),
    ("v1,m1" + C + "1,,1\n,1,nan\n",
     [f"cases.csv:{line}: {name}: got nothing, expected a value in each column of at least one row"
      for line, name in ((3, "v1"), (2, "m1"), (3, "kelvin-voigt.C"))]),
    ("v1,m1" + C + "1,1\n1,2\n1,3\n1\n",
     ["cases.csv:2: got 2 values, expected 3, one for each column; also in 2 other rows",
      "cases.csv:5: got 1 value, expected 3, one for each column"]),
    ("Probe;e_out\n" + "1;0,8\n" * 36,
     ["cases.csv:1: got no column of an input, expected one, such as v1 [m/s]"]),
    ("v1,m1\n1,1,1\n",
     ["cases.csv:2: got 3 values, expected 2, one for each column; a decimal comma needs another separator, or quotes"]),
    ("v1 (cm/s),m1 (furlog),m3 (kg)\n1,1,1\n",
     ['cases.csv:1: m1 (furlog): no such input; did you mean "m1"?']),
    ("", ["cases.csv: empty, expected a CSV file"]),
    ("v1,m1" + C, ["cases.csv: got one line, expected a line of names and at least one of values"]),
    ('v1,m1\n"1,2\n', ["cases.csv:2: not CSV: unexpected end of data"]),
    (b"v1\n\xff\n", ['cases.csv:2: v1: got "\u00ff", expected a finite number of m/s, bare or with a unit, such as "1 m/s"']),
    (b"v1\n\x81\n", ["cases.csv:2: not UTF-8: byte 0x81; save it as UTF-8"]),
    ("#" * 2_000_001, ["cases.csv: larger than 2,000,000 bytes"]),
]  # fmt: skip


@pytest.mark.parametrize(("csv", "lines"), BAD_CSV, ids=range(len(BAD_CSV)))
def test_a_wrong_table_of_cases_is_an_error_with_line_and_column(
    tmp_path: Path, csv: str | bytes, lines: list[str]
) -> None:
    assert refused(tmp_path, csv) == lines


@pytest.mark.parametrize(
    "content",
    [
        "TOKEN=SECRET1\nKEY=SECRET2\n",
        "SECRET1,SECRET1\n1,SECRET2\n",
        "SECRET1\nSECRET2,2\n",
        "SECRET1\n5 SECRET2\n",
    ],
)
def test_no_message_contains_a_file_without_a_known_column(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("env").write_text(content, encoding="utf-8")
    guessed = {"file": "env", "column": content.splitlines()[0]}
    balls = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e9}
    tables: list[dict[str, object]] = [
        {"sweep": {"cases": "env"}},
        {"sweep": {**balls, "v1": {"file": "env", "column": "SECRET"}}},
        {"sweep": {**balls, "v1": guessed}},
        {"sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "material1": guessed, "material2": "steel"}},
        {"sweep": {**balls, "v1": {"empirical": "env"}}, "design": {"n": 8}},
        {"sweep": {**balls, "K": {"fit": [1e5, 1e7]}}, "data": {"file": "env"}},
    ]
    for table in tables:
        purpose = "calibrate" if "data" in table else "sweep"
        found = problems_of(read_config, {"models": "hertz", **table}, purpose=purpose)
        lines = [line for line in found if line.startswith("env")]
        assert lines
        # the config contains the guessed name itself
        assert not re.search("SECRET[12]", "".join(lines).replace(f'got "{guessed["column"]}"', ""))
    with pytest.raises(ConfigError, match=r"^env:") as error:
        read_points("env")
    assert "SECRET" not in str(error.value)


@pytest.mark.parametrize("text", ["v1", "bilinear.K", "materials.steel.E", "materials.steel.2.E"])
def test_the_name_of_an_input_is_parsed_without_loss(text: str) -> None:
    name = InputName.parse(text)
    assert str(name) == text
    assert InputName.parse(name.config_key.removeprefix("sweep.")) == name
    data, _ = set_value({}, name.path, 1.0)
    assert [*input_values(data)] == [(name, 1.0)]


def test_a_column_means_the_same_in_a_file_and_in_a_table(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("v1 [mm/s],e_out\n500,0.5\n 35,0.25\n", encoding="utf-8")
    frame = pd.DataFrame({"v1": ["500 mm/s", "35 mm/s"], "e_out [%]": [50.0, 25.0]})
    for points in (tmp_path / "points.csv", frame):
        columns = read_points(points).columns
        assert {name: list(column) for name, column in columns.items()} == {
            "v1": [0.5, 0.035],
            "e_out": [0.5, 0.25],
        }


@pytest.mark.skipif(not os.access("/proc/kmsg", os.R_OK), reason="needs Linux, and root")
def test_a_file_of_the_system_that_never_ends_is_not_read(forked: ForkServer, tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text(CASES.replace("cases.csv", "/proc/kmsg"), encoding="utf-8")
    for name, kind in (("/proc/kmsg", "TOML"), ("x.toml", "CSV")):
        done = forked("sweep", "--dry-run", name, cwd=tmp_path, limit=20)
        assert (done.returncode, done.stderr) == (2, f"/proc/kmsg: empty, expected a {kind} file\n")
    done = forked("info", "/proc/kmsg", limit=20)
    assert done.returncode == 2
    assert (
        done.stderr
        == "/proc/kmsg: is not a readable result (empty: it does not begin with the header of a sealed file)\n"
    )
    assert forked("run", "/proc/kmsg", limit=20).returncode == 2


@pytest.mark.parametrize(
    ("override", "line"),
    [
        ('sweep.cases="none.csv"', "none.csv: cannot be read: No such file or directory"),
        ('sweep.cases="."', ": not a regular file, expected a CSV file"),
        ("sweep.v1=1", "x.toml:4: sweep.cases.v1: set together with sweep.v1, expected one of the two"),
        ('sweep.e={file="cases.csv", column="model.kelvin-voigt.c"}',
         'cases.csv:1: got "model.kelvin-voigt.c", expected one of its columns; did you mean "model.kelvin-voigt.C"?'),
        ('sweep.e={file="cases.csv"}',
         '--set sweep.e={file="cases.csv"}: sweep.e.column: missing, expected a name in its first line'),
        ('sweep.e={file="cases.csv", column="m1", unit="g"}',
         '--set sweep.e={file="cases.csv", column="m1", unit="g"}: sweep.e.unit: unknown key; known: column, decimal, file, separator'),
        ('sweep.e={file="cases.csv", column="m1", separator="x"}',
         '--set sweep.e={file="cases.csv", column="m1", separator="x"}: sweep.e.separator: got "x", expected ",", ";" or "\\t"'),
        ('sweep.cases={file="cases.csv", separator=""}',
         '--set sweep.cases={file="cases.csv", separator=""}: sweep.cases.separator: got "", expected ",", ";" or "\\t"'),
        ('sweep.cases={file="cases.csv", decimal="x"}',
         '--set sweep.cases={file="cases.csv", decimal="x"}: sweep.cases.decimal: got "x", expected "." or ","'),
        ('sweep.zip=[["e", "v1"]]',
         '--set sweep.zip=[["e", "v1"]]: sweep.zip[0][1]: got "v1", a column of cases; those vary together already'),
        ("sweep.cases=3",
         "--set sweep.cases=3: sweep.cases: got 3, expected the name of a CSV file, or a table of lists by config name, "
         "such as { v1 = [1.0, 2.0] }"),
        ("sweep.cases={v1 = 3}",
         "--set sweep.cases={v1 = 3}: sweep.cases.v1: got 3, expected a list of values"),
    ],
)  # fmt: skip
def test_a_file_without_the_values_is_an_error_of_one_line(tmp_path: Path, override: str, line: str) -> None:
    (problem,) = refused(tmp_path, CSV, override)
    assert problem.removeprefix(str(tmp_path)) == line


def test_values_of_cases_are_checked_with_their_line() -> None:
    assert problems(TEXT.replace("v1 = 1.0\n", "cases = { v1 = [\n1,\ntrue], v2 = [1] }\n")) == [
        "x.toml:5: sweep.cases.v2: got 1 value, expected 2, as in the first column",
        "x.toml:5: sweep.cases.v1[1]: got true, expected a finite number of m/s",
    ]


def test_built_in_materials_need_no_table() -> None:
    text = TEXT.replace("block", "steel")
    config = read(text)
    assert config.materials["steel"] == Material(210e9, 0.3, 7850.0)
    assert config.overrides == ()
    text = text[: text.index("[materials")]
    config = read(text, 'sweep.material=["steel", "glass"]')
    steel = impact.materials()["steel"]
    assert config.materials["steel"] == Material(steel["E"], steel["nu"], steel["rho"], steel["yield_strength"])  # type: ignore[arg-type]
    assert set(config.materials) == {"steel", "glass"}
    # the stored config does not depend on the built-in materials
    assert config.overrides[0].startswith("materials.steel={E = 210000000000.0, nu = 0.3")
    assert parse_config(config.text, config.overrides) == config
    changed = read(text, "materials.steel.E=[1e9, 2e9]")
    assert changed.axes[0].name == "materials.steel.E"
    assert changed.materials["steel"].rho == steel["rho"]
    assert repr(parse_config(changed.text, changed.overrides)) == repr(changed)
    (line,) = problems(text, "sweep.material=stel")
    assert line.endswith('got "stel", expected a material of [materials]; did you mean "steel"?')


def test_every_built_in_material_has_a_source_and_can_be_used() -> None:
    for name, record in impact.materials().items():
        assert record["source"]
        assert read_config({"models": "hertz", "sweep": {"v1": 1, "R1": 1, "m2": 1, "material": name}}).models


def test_a_column_is_found_by_its_name_and_has_the_unit_in_round_brackets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("drops.csv").write_text("Geschwindigkeit (cm/s)\n1\n", encoding="utf-8")
    column = {"file": "drops.csv", "column": "Geschwindigkeit"}
    (axis,) = read_config({"models": "hertz", "sweep": {"v1": column, "m1": 1.0, "m2": 1.0, "K": 1e9}}).axes
    assert axis.columns == {"v1": (0.01,)}
