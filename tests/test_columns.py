"""Columns of measurements: one reader for the CSV files that laboratories have, for mappings and for tables."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import impact
from impact.config.draft import Measurements
from impact.config.load import Config, read_config
from impact.errors import ConfigError
from impact.plots.data import read_points

from .conftest import Run, assert_refused, problems_of

SWEEP = {"m1": "2.7 g", "m2": math.inf, "K": 1e6}
BALLS: dict[str, Any] = {"models": "hunt-crossley-1975", "sweep": {**SWEEP, "e": {"fit": [0.05, 1]}}}
PLAIN = "v1 [cm/s],e_out,sigma,specimen\n12.5,0.91,0.01,a\n100,0.85,0.01,a\n250.25,0.8,0.02,b\n"
DIALECTS = {
    "comma": PLAIN,
    "semicolon": PLAIN.replace(",", ";"),
    "tab": PLAIN.replace(",", "\t"),
    "decimal comma": PLAIN.replace(",", ";").replace(".", ","),
    "tab and decimal comma": PLAIN.replace(",", "\t").replace(".", ","),
    "quoted decimal comma": "v1 [cm/s],e_out,sigma,specimen\n"
    '"12,5","0,91","0,01",a\n100,"0,85","0,01",a\n"250,25","0,8","0,02",b\n',
    "byte order mark": "\ufeff" + PLAIN,
    "carriage returns": PLAIN.replace("\n", "\r\n"),
    "comments and blank lines": "# drops; of 3 balls, 2 of them new\n\n"
    + PLAIN.replace("100,", "\n  # a pause, 5 min\n100,")
    + "\n# end\n\n",
    "quotes and spaces": '"v1 [cm/s]", "e_out" ,"sigma","specimen"\n'.replace(" ,", ",")
    + ' 12.5, "0.91", 0.01, "a"\n100 ,0.85,0.01, a\n 250.25,0.8,0.02,b \n',
    "round brackets": PLAIN.replace("[cm/s]", "(cm/s)"),
    "percent": "v1 [cm/s],e_out [%],sigma [%],specimen\n12.5,91,1,a\n100,85,1,a\n250.25,80,2,b\n",
    "percent in a cell": PLAIN.replace("0.91", "91 %"),
    "other columns": "Nr.;v1 [cm/s];e_out;sigma;specimen;Bemerkung;\n"
    "1;12,5;0,91;0,01;a;;\n2;100;0,85;0,01;a;kalt, 2.5 mm;\n3;250,25;0,8;0,02;b;;\n",
    "spaces around quotes": re.sub("[^,\n]+", ' "\\g<0>" ', PLAIN).replace(",", ";"),
    "separator line": "sep=;\n" + PLAIN.replace(",", ";"),
    "slash before a unit": PLAIN.replace("[cm/s]", "/ (cm/s)"),
    "slash and no brackets": PLAIN.replace(" [cm/s]", "/cm/s"),
    "word before a unit": PLAIN.replace("[cm/s]", "in cm/s"),
    "spaces": PLAIN.replace(",", "  "),
    "line break in the first cell": PLAIN.replace("v1 [cm/s]", '"v1\n[cm/s]"'),
}


def read(data: Mapping[str, Any], **changes: Any) -> Config:
    return read_config({**BALLS, **changes, "data": data}, purpose="calibrate")


def measurements(data: Mapping[str, Any], **changes: Any) -> Measurements:
    found = read(data, **changes).data
    assert found is not None
    return found


def values(found: Measurements) -> tuple[object, ...]:
    return found.inputs, found.outputs, found.sigma, found.specimens


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(csv: str | bytes, **data: Any) -> list[str]:
    Path("a.csv").write_bytes(csv if isinstance(csv, bytes) else csv.encode())
    return problems_of(read, {"file": "a.csv", **data})


EXPECTED = (
    {"v1": (0.125, 1.0, 2.5025)},
    {"e_out": (0.91, 0.85, 0.8)},
    {"e_out": (0.01, 0.01, 0.02)},
    ("a", "a", "b"),
)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_the_same_measurements_have_the_same_bits_in_every_dialect(folder: Path, dialect: str) -> None:
    (folder / "a.csv").write_text(DIALECTS[dialect], encoding="utf-8", newline="")
    assert values(measurements({"file": "a.csv"})) == EXPECTED


@pytest.mark.parametrize("form", [{}, {"delimiter": ","}, {"delimiter": ";", "fmt": "%.4f"}])
def test_a_file_of_numpy_has_its_names_in_a_comment(folder: Path, form: dict[str, Any]) -> None:
    names = form.get("delimiter", " ").join(("v1 [cm/s]", "e_out", "sigma"))
    rows = [[12.5, 0.91, 0.01], [100.0, 0.85, 0.01], [250.25, 0.8, 0.02]]
    np.savetxt(folder / "a.csv", rows, header=f"drops of 3 balls\n{names}", **form)
    assert values(measurements({"file": "a.csv"}))[:3] == EXPECTED[:3]


def test_a_comment_without_names_is_no_header(folder: Path) -> None:
    assert refused("# two balls\n1.0,0.5\n2.0,0.4\n") == [
        "a.csv:2: got no known column, expected names of inputs or outputs, such as v1 [m/s] or e_out"
    ]
    # a ratio of masses is another column, not a mass in square metres
    (folder / "a.csv").write_text(PLAIN.replace("specimen", "m1/m2"), encoding="utf-8")
    assert values(measurements({"file": "a.csv"}))[:3] == EXPECTED[:3]


def test_a_mapping_and_a_data_frame_have_the_bits_of_a_file() -> None:
    lists = {
        "v1 [cm/s]": [12.5, 100, 250.25],
        "e_out [%]": [91.0, 85.0, 80.0],
        "sigma (%)": [1.0, 1.0, 2.0],
        "specimen": ["a", "a", "b"],
        "remark": [None, "cold", None],
    }
    for columns in (lists, pd.DataFrame(lists), {name: pd.Series(column) for name, column in lists.items()}):
        assert values(measurements({"columns": columns})) == EXPECTED


def test_a_table_of_excel_may_be_in_windows_1252(folder: Path) -> None:
    text = DIALECTS["semicolon"].replace("\n", ";Prüfer °\n", 1)
    first, *rows = text.splitlines()
    text = "\n".join([first, *(f"{row};Jürgen" if row else row for row in rows)])
    (folder / "a.csv").write_bytes(text.encode("cp1252"))
    assert values(measurements({"file": "a.csv"})) == EXPECTED


def test_every_reader_of_columns_knows_the_dialects(folder: Path) -> None:
    text = "v1 (cm/s);m1 [g]\n# two cases\n12,5;2,5\n25;5\n"
    (folder / "cases.csv").write_text("\ufeff" + text, encoding="utf-8")
    balls = {"m2": 1.0, "K": 1e6, "e": 0.5}
    expected = {"v1": (0.125, 0.25), "m1": (0.0025, 0.005)}
    for cases in ("cases.csv", {"file": "cases.csv", "separator": ";", "decimal": ","}):
        (axis,) = read_config({"models": "hertz", "sweep": {**balls, "cases": cases}}).axes
        assert axis.columns == expected
    columns = {name: {"file": "cases.csv", "column": name} for name in expected}
    sweep = {**balls, **columns, "zip": [["v1", "m1"]]}
    assert read_config({"models": "hertz", "sweep": sweep}).axes[0].columns == expected
    assert read_points("cases.csv").columns == expected
    assert read_points({"v1 (cm/s)": [12.5, 25.0], "m1 [g]": [2.5, 5]}).columns == expected
    with pytest.raises(
        impact.ConfigError, match="points: e_out: got 1 values, expected 2, as in the first column"
    ):
        read_points({"v1": [1.0, 2.0], "e_out": [0.5]})


def test_a_data_frame_with_two_columns_of_one_name_is_refused() -> None:
    frame = pd.DataFrame([[1.0, 2.0, 0.5]], columns=["v1", "v1", "e_out"])
    balls = {"m1": 1.0, "m2": 1.0, "K": 1e6, "e": 0.5}
    with pytest.raises(ConfigError, match='cases: got the column "v1" twice, expected each once'):
        read_config({"models": "hertz", "sweep": {**balls, "cases": frame[["v1"]]}})
    with pytest.raises(ConfigError, match='points: got "v1" twice, expected each column once'):
        read_points(frame)
    with pytest.raises(impact.UsageError, match="v1: got a table, expected a finite number of m/s"):
        impact.prepare(model="hertz")(frame[["v1"]])


def test_a_column_of_a_file_leaves_out_rows_without_a_value_and_counts_them(folder: Path) -> None:
    """Axes that vary together have the values of the same rows, so that none is left out."""
    (folder / "a.csv").write_text("v1 [cm/s];e\n10;0,9\n20;\n;0,7\n30;0,6\n", encoding="utf-8")
    sweep = {"m1": 1.0, "m2": 1.0, "K": 1e6, **{name: {"file": "a.csv", "column": name} for name in ("v1", "e")}}
    config = read_config({"models": "hertz", "sweep": sweep})
    assert [axis.columns for axis in config.axes] == [{"v1": (0.1, 0.2, 0.3)}, {"e": (0.9, 0.7, 0.6)}]
    assert config.notes == ("a.csv: 1 of 4 rows has no v1: left out", "a.csv: 1 of 4 rows has no e: left out")
    problems = problems_of(read_config, {"models": "hertz", "sweep": {**sweep, "zip": [["v1", "e"]]}})
    assert problems == ["a.csv:4: v1: got nothing, expected a value", "a.csv:3: e: got nothing, expected a value"]


GERMAN = (
    "Probe;Geschwindigkeit [cm/s];Restitution (gemessen);Datum\n"
    "1;12,5;0,91;1.2.24\n1;100;0,85;\n2;250,25;;\n2;300;0,75;\n"
)


def test_columns_of_any_name_are_mapped_and_the_others_named_once(folder: Path) -> None:
    (folder / "a.csv").write_text(GERMAN, encoding="utf-8")
    columns = {"v1": "Geschwindigkeit", "e_out": "Restitution (gemessen)", "specimen": "Probe"}
    config = read({"file": "a.csv", "columns": columns, "sigma": 0.01})
    assert config.data is not None
    assert values(config.data) == (
        {"v1": (0.125, 1.0, 3.0)},
        {"e_out": (0.91, 0.85, 0.75)},
        {"e_out": (0.01,) * 3},
        ("1", "1", "2"),
    )
    assert config.data.lines == (2, 3, 5)
    notes = ("a.csv: 1 of 4 rows has no e_out: left out", "a.csv: columns without use: Datum")
    assert config.notes == notes
    # a stored config needs no file, and has nothing to note
    again = impact.config.load.parse_config(config.text, config.overrides, purpose="calibrate")
    assert (again.data, again.notes) == (config.data, ())


def test_rows_without_any_value_are_blank_lines(folder: Path) -> None:
    (folder / "a.csv").write_text("v1 [m/s];e_out;Bemerkung\n1;0,9;\n;;\n2;0,8;\n ; ;\n", encoding="utf-8")
    config = read({"file": "a.csv", "missing": "error"})
    assert config.data is not None
    assert config.data.lines == (2, 4)
    assert config.notes == ("a.csv: columns without use: Bemerkung",)
    (folder / "a.csv").write_text("v1 [m/s];e_out\n;\n", encoding="utf-8")
    assert refused("v1 [m/s];e_out\n;\n") == refused("v1 [m/s];e_out\n")


@pytest.mark.parametrize("mark", ["-", "–", "—", "n.a.", "k.A.", "NA", " "])
def test_a_mark_of_a_missing_value_leaves_out_its_row(folder: Path, mark: str) -> None:
    (folder / "a.csv").write_text(f"v1 [m/s];e_out\n1;0,9\n2;{mark}\n{mark};0,8\n", encoding="utf-8")
    for table in ({"file": "a.csv"}, {"columns": {"v1": [1.0, 2.0, mark], "e_out": [0.9, mark, 0.8]}}):
        config = read(table)
        assert config.data is not None
        assert values(config.data)[:2] == ({"v1": (1.0,)}, {"e_out": (0.9,)})
        assert "".join(config.notes).endswith("1 of 3 rows has no v1, 1 has no e_out: left out")


@pytest.mark.parametrize(
    ("text", "notes"),
    [
        ("10;12\n20;24\n30;36", ("a.csv: all 3 restitutions are above 1; are the columns exchanged?",)),
        ("10;12", ("a.csv: the restitution is above 1; are the columns exchanged?",)),
        ("10;12\n20;20\n30;36", ()),
    ],
)
def test_restitutions_above_1_ask_whether_the_columns_are_exchanged(
    folder: Path, text: str, notes: tuple[str, ...]
) -> None:
    (folder / "a.csv").write_text(f"drop_height [cm];rebound_height [cm]\n{text}\n", encoding="utf-8")
    assert read({"file": "a.csv"}, sweep=BALLS["sweep"]).notes == notes


@pytest.mark.slow
def test_a_calibration_prints_what_is_left_out_as_notes(folder: Path, cli: Run) -> None:
    (folder / "a.csv").write_text(GERMAN, encoding="utf-8")
    text = """models = "hunt-crossley-1975"
    [data]
    file = "a.csv"
    sigma = "1 %"
    columns = { v1 = "Geschwindigkeit", e_out = "Restitution (gemessen)" }
    [sweep]
    m1 = "2.7 g"
    m2 = inf
    K = 1e6
    e = { fit = [0.05, 1] }
    """
    (folder / "fit.toml").write_text(text, encoding="utf-8")
    done = cli("calibrate", "fit.toml", cwd=folder)
    notes = ["note: a.csv: 1 of 4 rows has no e_out: left out", "note: a.csv: columns without use: Probe, Datum"]
    assert (done.returncode, done.stderr.splitlines()) == (0, notes)
    (folder / "fit.toml").write_text(text.replace("[data]", '[data]\nmissing = "error"'), encoding="utf-8")
    assert_refused(cli("calibrate", "fit.toml", cwd=folder), "a.csv:4: Restitution (gemessen): expected a value")


V = "v1 [m/s],e_out\n"
REFUSED = {
    # the findings of users who came with tables of their own
    "unknown columns": (
        "Probe;Geschwindigkeit [cm/s];e\n" + "1;2,5;0,8\n" * 36,
        {},
        "a.csv:1: e: set together with sweep.e, expected one of the two; a measured restitution is e_out",
    ),
    "no known column": ("Kennwort;geheim\n1;2\n", {}, "a.csv:1: got no known column, expected names of inputs"),
    "rows of another length": (
        V + "1,2,0,5\n" * 36,
        {},
        "a.csv:2: got 4 values, expected 2, one for each column; also in 35 other rows; a decimal",
    ),
    "texts": (
        V + "1,high\n" * 36,
        {},
        'a.csv:2: e_out: got "high", expected a number from -0.5 to 1.5; also in 35',
    ),
    "missing values": (
        V + "1,0.5\n1,NA\n1,\n",
        {"missing": "error"},
        "a.csv:3: e_out: got nothing, expected a value; also in 1 other row",
    ),
    "only missing values": (
        V + "1,NA\n1,\n",
        {},
        "a.csv:2: e_out: got nothing, expected a value in each column of",
    ),
    "percent": (
        V + "1,0.5\n2,60\n3,55\n",
        {},
        'a.csv:3: e_out: got "60", expected a fraction: percent? name the unit, as in "e_out [%]"; also in 1',
    ),
    "near misses": (
        "v1 [m/s],e_out,simga,m2_\n1,0.5,1,1\n",
        {},
        'a.csv:1: simga: no such input or output; did you mean "sigma"?',
    ),
    "no unit": ("v1,e_out\n1,0.5\n", {}, 'a.csv:1: v1: got no unit, expected one in brackets, such as "v1 [m/s]"'),
    "two separators": (
        "v1 [m/s];e_out,m1 [kg]\n1;0.5,0.1\n",
        {},
        'a.csv:1: got columns separated by "," into 2 or by ";" into 2, expected one; separator = "," or',
    ),
    "two decimal signs": (
        "v1 [m/s];e_out\n1,5;0.5\n",
        {},
        'a.csv:2: got a decimal comma, and a point in line 2, expected one of them; decimal = "," or decimal',
    ),
    "thousands": (
        "m1 [g];e_out\n1,250;1\n",
        {},
        'a.csv:2: got 1,250, which may be decimal or separate thousands; decimal = "," settles it',
    ),
    "thousands beside a unit": (
        "drop_height [mm];rebound_height [mm]\n100,5;60,2\n1.300,25;775,5\n",
        {},
        'a.csv:3: drop_height: got "1.300,25", expected a number without marks between thousands',
    ),
    "another decimal sign": (
        "v1 [m/s];e_out\n1;0.5\n",
        {"decimal": ","},
        'a.csv:2: got a number with ".", expected ","',
    ),
    "another encoding": (
        "v1 [m/s];e_out;Prüfer\n1;1;1\n".encode("utf-16"),
        {},
        "a.csv:1: not UTF-8: byte 0xff; save it as UTF-8",
    ),
    "a workbook": (
        b"PK\x03\x04\x14\0\x06\0",
        {},
        "a.csv: not a text file, expected a CSV file; save a table as CSV",
    ),
    "no such header": (
        V + "1,1\n",
        {"columns": {"m1": "masse"}},
        'a.csv:1: got "masse", expected one of its columns',
    ),
    "no such name": (
        V + "1,1\n",
        {"columns": {"eout": "e_out"}},
        "a.csv:1: eout: no such input or output; did you mean",
    ),
    "another unit": (
        V + "1,1\n",
        {"columns": {"v1": "v1 [cm/s]"}},
        'a.csv:1: got "v1 [cm/s]", expected [m/s] as in its',
    ),
    "an open quote": (V + '1,"1\n', {}, "a.csv:2: not CSV: unexpected end of data"),
    "text after a quote": (
        'v1;e_out\n1;"0,5" x\n',
        {},
        "a.csv:2: not CSV: ';' expected after '\"'",
    ),
    "a wrong key": (
        V + "1,1\n",
        {"separator": "|"},
        'config: data.separator: got "|", expected ",", ";" or "\\t"',
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_each_cause_has_one_message(folder: Path, name: str) -> None:
    csv, data, message = REFUSED[name]
    found = refused(csv, **data)
    assert found[0].startswith(message), found
    assert len(found) == (2 if name == "near misses" else 1), found


def test_the_key_of_the_message_settles_what_an_ambiguous_file_means(folder: Path) -> None:
    (folder / "a.csv").write_text("m1 [g];e_out\n1,250;1\n2,500;1\n", encoding="utf-8")
    sweep = {"v1": 1.0, "m2": math.inf, "K": 1e6, "e": {"fit": [0.05, 1]}}
    data = {"file": "a.csv", "decimal": ","}
    assert measurements(data, sweep=sweep).inputs == {"m1": (0.00125, 0.0025)}
    (folder / "a.csv").write_text("v1 [m/s];e_out,sigma\n1;0.5\n2;0.25\n", encoding="utf-8")
    found = measurements({"file": "a.csv", "separator": ";", "columns": {"e_out": "e_out,sigma"}})
    assert found.outputs == {"e_out": (0.5, 0.25)}


@pytest.mark.parametrize(
    ("csv", "data"),
    [
        # only one sign separates all rows alike, or names that are looked for
        ("v1 [m/s];e_out;ball,e\n1;0.5;2\n2;1;2\n", {}),
        ("v1 [m/s];e_out;remark, by hand\n1;0.5;good, clean\n2;1;bad, dusty\n", {}),
        # the sign of a column without use does not matter
        ("v1 [m/s];e_out in %;version\n1;50;1.2\n2;100;1.3\n", {"decimal": ","}),
    ],
)
def test_columns_without_use_do_not_decide_how_a_file_is_written(
    folder: Path, csv: str, data: dict[str, str]
) -> None:
    (folder / "a.csv").write_text(csv, encoding="utf-8")
    read = measurements({"file": "a.csv", **data})
    assert (read.inputs, read.outputs) == ({"v1": (1.0, 2.0)}, {"e_out": (0.5, 1.0)})


def test_a_stiffness_of_cases_has_no_unit_where_the_exponent_is_one_of_their_columns(folder: Path) -> None:
    (folder / "cases.csv").write_text("n,K [N/m^1.5]\n1.5,1e6\n2,1e6\n", encoding="utf-8")
    sweep = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "cases": "cases.csv"}
    with pytest.raises(impact.ConfigError, match=r"K: got \[N/m\^1.5\], .* depends on n, which varies"):
        read_config({"models": "hertz", "sweep": sweep})


def test_messages_contain_nothing_of_a_file_that_a_config_guesses(folder: Path) -> None:
    """A config of unknown origin may name any file, and even the headers of well-known ones."""
    for text in ("user,SECRET1\nSECRET2,SECRET3\n", "user;SECRET1\n1,5;SECRET3\n1.5;SECRET\n", "user\nSECRET\n"):
        found = refused(text, columns={"e_out": "user"})
        assert found[0].startswith("a.csv")
        assert "SECRET" not in "".join(found)


G = 9.80665


def test_heights_give_the_velocity_and_the_restitution_with_its_deviation(folder: Path) -> None:
    header = "drop_height [cm],rebound_height [cm],sigma_drop_height [mm],sigma_rebound_height"
    text = f"{header}\n100,64,2,0.5\n50,18,2,0.5\n"
    (folder / "a.csv").write_text(text, encoding="utf-8")
    found = measurements({"file": "a.csv"})
    assert found.inputs == {"v1": pytest.approx((math.sqrt(2 * G), math.sqrt(G)), rel=1e-15)}
    assert found.outputs == {"e_out": pytest.approx((0.8, 0.6), rel=1e-15)}
    sigma = [e / 2 * math.hypot(0.5 / h2, 0.2 / h1) for e, h1, h2 in ((0.8, 100, 64), (0.6, 50, 18))]
    assert found.sigma == {"e_out": pytest.approx(sigma, rel=1e-14)}
    on_the_moon = measurements({"file": "a.csv", "g": "162 cm/s^2"})
    assert on_the_moon.inputs == {"v1": pytest.approx((math.sqrt(3.24), math.sqrt(1.62)), rel=1e-15)}
    assert measurements({"columns": {"drop_height": [1.0], "e_out": [0.8]}}).inputs["v1"] == found.inputs["v1"][:1]
    points = read_points("a.csv").columns
    assert (points["v1"], points["e_out"]) == (found.inputs["v1"], found.outputs["e_out"])
    assert points["sigma_e_out"] == found.sigma["e_out"]


def test_flight_times_of_one_ball_give_a_restitution_for_each_impact(folder: Path) -> None:
    """A row of another specimen, or without a time, ends the flights of a ball."""
    rows = "a,500,1\na,400,1\na,300,1\nb,600,1\nb,300,1\nb,,\nb,500,1\nb,250,1\n"
    text = f"specimen,flight_time [ms],sigma_flight_time\n{rows}"
    (folder / "a.csv").write_text(text, encoding="utf-8")
    found = measurements({"file": "a.csv"})
    assert found.inputs == {"v1": pytest.approx([G * t / 2 for t in (0.5, 0.4, 0.6, 0.5)], rel=1e-15)}
    assert found.outputs == {"e_out": pytest.approx((0.8, 0.75, 0.5, 0.5), rel=1e-15)}
    sigma = [b / a * math.hypot(1 / a, 1 / b) for a, b in ((500, 400), (400, 300), (600, 300), (500, 250))]
    assert found.sigma == {"e_out": pytest.approx(sigma, rel=1e-14)}
    assert (found.specimens, found.lines) == (("a", "a", "b", "b"), (2, 3, 5, 8))
    assert found.noise == "excess"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "flight_time [ms]\n500\n900\n",
            "a.csv:3: flight_time: got 0.9 s after 0.5 s, an e_out of 1.8, expected at most 1.5; a column "
            "specimen separates balls",
        ),
        (
            "drop_height [cm],rebound_height [cm]\n10,8\n10,30\n10,40\n",
            "a.csv:3: rebound_height: got 0.3 m after 0.1 m, an e_out of 1.73205, expected at most 1.5; "
            "also in 1 other row",
        ),
        (
            "specimen,flight_time [ms]\na,500\nb,400\n",
            "a.csv:2: flight_time: got no two successive flights of one ball, expected at least two rows of it",
        ),
        (
            "drop_height [cm],rebound_height [cm]\n10 cm,8\n9 cm,8\n",
            'a.csv:2: drop_height: got "10 cm", expected a number without a unit: the column is in cm; also in 1 '
            "other row",
        ),
        (
            "drop_height [cm],rebound_height [cm],sigma_drop_height [mm]\n10,8,1\n10,0,1\n",
            "a.csv:3: rebound_height: got 0 next to a standard deviation, from which none of e_out follows, "
            "expected a column sigma_e_out in place of those of heights",
        ),
        ("drop_height [cm],rebound_height [cm]\n0,0\n", "a.csv:2: drop_height: got"),
        (
            "v1 [cm/s],e_out\n1,0.8\n-10,0.8\n0,0.8\n",
            "a.csv:3: v1: got -0.1 m/s with v2 = 0 m/s, expected v1 > v2; also",
        ),
        (
            "v1 [m/s],v2 [m/s],e_out\n-1,-2,0.8\n1,2,0.8\n",
            "a.csv:3: v1: got 1 m/s with v2 = 2 m/s, expected v1 > v2",
        ),
    ],
)
def test_rows_without_a_restitution_that_can_be_fitted_are_one_line(folder: Path, text: str, line: str) -> None:
    (found,) = refused(text)
    assert found.startswith(line), found


def test_a_wrong_row_is_named_by_the_header_of_the_file(folder: Path) -> None:
    columns = {"flight_time": "Flug [ms]"}
    (line,) = refused("Flug [ms],mu\n500,0\n900,0\n", columns=columns)
    assert line.startswith("a.csv:3: Flug [ms]: got 0.9 s after 0.5 s, ")
    # it may be any file, of which messages contain nothing
    (line,) = refused("Flug [ms]\n500\n900\n", columns=columns)
    assert line == "a.csv:3: Flug [ms]: expected at most 1.5; a column specimen separates balls"


def test_a_ball_that_does_not_rebound_has_a_restitution_of_0(folder: Path) -> None:
    text = "drop_height [cm],rebound_height [cm],sigma_e_out\n10,8,.1\n10,0,.1\n"
    (folder / "a.csv").write_text(text, encoding="utf-8")
    found = measurements({"file": "a.csv"})
    assert found.outputs == {"e_out": pytest.approx((math.sqrt(0.8), 0.0))}


@pytest.mark.parametrize("unit", ["", " [%]"])
def test_a_standard_deviation_without_a_unit_has_that_of_its_output_with_a_note(folder: Path, unit: str) -> None:
    (folder / "a.csv").write_text(f"v1 [m/s],e_out [%],sigma{unit}\n1,80,1\n", encoding="utf-8")
    config = read({"file": "a.csv"})
    assert config.notes == (() if unit else ("a.csv: sigma: got no unit, read in [%] as e_out",))
    assert config.data is not None
    assert config.data.sigma == {"e_out": (0.01,)}


def test_propagated_deviations_are_those_of_random_errors() -> None:
    import numpy as np

    from impact.config.measurements import derive_impacts

    random = np.random.default_rng(3)
    h1, h2 = random.normal(1.0, 0.004, 40_000), random.normal(0.64, 0.005, 40_000)
    rows, names = range(h1.size), [""] * h1.size
    noisy, _ = derive_impacts({"drop_height": h1.tolist(), "rebound_height": h2.tolist()}, rows, names, G)
    exact = {"drop_height": [1.0], "rebound_height": [0.64]}
    deviations = {"sigma_drop_height": [0.004], "sigma_rebound_height": [0.005]}
    propagated, _ = derive_impacts(exact | deviations, [0], [""], G)
    # four standard errors of an estimated standard deviation
    assert np.std(noisy["e_out"]) == pytest.approx(propagated["sigma_e_out"][0], rel=4 / math.sqrt(2 * h1.size))


@pytest.mark.parametrize(
    ("header", "change", "message"),
    [
        (
            "drop_height [m],rebound_height [m]",
            {"m2": 1.0},
            "drop_height: got m2 = 1.0, expected m2 = inf in [sweep]",
        ),
        (
            "drop_height [m],rebound_height [m]",
            {"v2": 0.1},
            "drop_height: got v2 = 0.1, expected v2 = 0 in [sweep]",
        ),
        ("drop_height [m],rebound_height [m]", {"v1": 1.0}, "drop_height: set together with sweep.v1"),
        ("rebound_height [m],v1 [m/s]", {}, "rebound_height: got no column drop_height, expected one next to it"),
        ("flight_time [s],v1 [m/s]", {}, "v1: set together with flight_time, from which it follows"),
        ("flight_time [s],e_out", {}, "e_out: set together with flight_time, from which it follows"),
        ("drop_height [m],flight_time [s]", {}, "drop_height: set together with flight_time"),
        ("drop_height [s],e_out", {}, "drop_height: got [s], expected a unit of m"),
        ("drop_height,e_out", {}, "drop_height: got no unit, expected one in brackets"),
    ],
)
def test_heights_and_times_that_are_not_of_a_falling_ball_are_refused(
    folder: Path, header: str, change: dict[str, object], message: str
) -> None:
    (folder / "a.csv").write_text(f"{header}\n1,0.5\n1,0.5\n", encoding="utf-8")
    sweep = {**BALLS["sweep"], **change}
    (line,) = problems_of(read, {"file": "a.csv"}, sweep=sweep)
    assert line.startswith(f"a.csv:1: {message}"), line


def test_points_have_the_unit_of_a_stiffness_that_data_of_the_picture_have(folder: Path) -> None:
    sweep = {"K": [1e6, 1e8], "e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0}
    impact.sweep({"models": ["hertz"], "sweep": sweep}, output="r.h5")
    impact.plot_to_files("r.h5", "p.png", kinds=["final-velocities"], data="d.csv")
    heading = Path("d.csv").read_text(encoding="utf-8").partition(",")[0]
    assert heading == "K [N/m^1.5]"
    for unit, size in ((heading, 1.0), ("K [kN/m^1.5]", 1e3)):
        points = {unit: [1e6 / size, 1e8 / size], "v1_post": [0.3, 0.4]}
        (axes,) = impact.plot("r.h5", kind="final-velocities", points=points).axes
        np.testing.assert_allclose(np.asarray(axes.lines[-1].get_xdata(), float), [1e6, 1e8], rtol=1e-15)
    points = {"K [N/mm]": [1e3, 1e5], "v1_post": [0.3, 0.4]}
    with pytest.raises(ConfigError, match=r"K: got \[N/mm\], expected a unit of N/m\^n with n = 1\.5"):
        impact.plot("r.h5", kind="final-velocities", points=points)


def test_points_of_a_laboratory_table_are_drawn_with_a_note_of_what_is_left_out(folder: Path) -> None:
    text = "Nr;v1 [cm/s];e_out [%];sigma_e_out [%]\n1;50;90;1\n2;100;;1\n"
    (folder / "a.csv").write_text(text, encoding="utf-8")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        points = read_points("a.csv")
    assert points.columns == {"v1": (0.5,), "e_out": (0.9,), "sigma_e_out": (0.01,)}
    assert [str(warning.message) for warning in caught] == [
        "a.csv: 1 of 2 rows has no e_out: left out",
        "a.csv: columns without use: Nr",
    ]
    (folder / "a.csv").write_text("v1 [cm/s];simga;e_out\n1;1;1\n", encoding="utf-8")
    with pytest.raises(ConfigError, match='simga: no such input or variable; did you mean "sigma"'):
        read_points("a.csv")
    (folder / "a.csv").write_text("v1 [cm/s];e_out\n1;90\n2;80\n", encoding="utf-8")
    (line,) = problems_of(read_points, "a.csv")
    percent = 'expected a fraction: percent? name the unit, as in "e_out [%]"; also in 1 other row'
    assert line == f'a.csv:2: e_out: got "90", {percent}'


def test_fit_true_is_the_natural_range_of_what_the_laws_lack() -> None:
    """A parameter that the config has keeps its value or its bounds."""
    laws = ["hunt-crossley-1975", "kuwabara-kono-1987", "lammps-viscoelastic-hertz"]
    data = {"fit": True, "columns": {"v1": [0.1, 0.3, 1.0], "e_out": [0.9, 0.8, 0.7]}}
    balls = {**SWEEP, "R1": 0.01, "R2": math.inf, "material": "steel"}
    source = {"models": laws, "sweep": balls, "data": data, "model": {"lammps-viscoelastic-hertz": {"eta": 1e6}}}
    config = read_config(source, purpose="calibrate")
    assert list(config.fits) == ["e", "kuwabara-kono-1987.A"]
    assert config.fits["e"] == (0.0, 1.0)
    (line,) = problems_of(read_config, {**source, "sweep": {**balls, "m1": {"fit": True}}}, purpose="calibrate")
    assert line == "config: sweep.m1: got fit = true, expected fit = [least, most]: it has no natural range"


def test_the_natural_range_is_about_the_size_in_units_of_the_contact() -> None:
    """A time of the law is of the order of v0^(-1/5) (m/K)^(2/5), in which the stiffness counts."""
    from impact.inverse.calibrate import NATURAL_RATIO, natural_bounds

    data = {"fit": True, "columns": {"v1": [1.0, 2.0], "e_out": [0.9, 0.8]}}
    sizes = []
    for stiffness in (1e6, 1e11):
        sweep = {**SWEEP, "m1": 1.0, "K": stiffness}
        config = read_config({"models": "kuwabara-kono-1987", "sweep": sweep, "data": data}, purpose="calibrate")
        ((lower, upper),) = natural_bounds(config).values()
        assert upper / lower == pytest.approx(NATURAL_RATIO**2)
        sizes.append(math.sqrt(lower * upper))
    assert sizes[0] / sizes[1] == pytest.approx(100.0)


@pytest.mark.slow
def test_the_natural_range_of_a_damping_of_lammps_contains_that_of_small_balls() -> None:
    """The damping per contact radius of a bead is a million times that of a ball of 1 kg."""
    from impact.inverse.calibrate import natural_bounds

    beads = {"m1": "0.16 g", "m2": math.inf, "R1": "2.5 mm", "R2": math.inf, "material": "glass"}
    data = {"fit": True, "columns": {"v1": [0.5, 1.0], "e_out": [0.7, 0.6]}}
    for law in ("lammps-viscoelastic-hooke", "lammps-viscoelastic-hertz"):
        config = read_config({"models": law, "sweep": beads, "data": data}, purpose="calibrate")
        ((lower, upper),) = natural_bounds(config).values()
        source = {"models": law, "sweep": {**beads, "v1": 1.0}}
        (root,) = impact.solve(law, "eta", {"e_out": 0.6}, source=source).roots
        assert 10.0 * lower < root.value < 0.1 * upper


def test_the_natural_range_of_a_slip_speed_of_friction_is_about_the_speed_of_the_impact() -> None:
    from impact.inverse.calibrate import natural_bounds

    law = {
        "models": "hertz",
        "frictions": "drake-regularized",
        "friction": {"drake-regularized": {"v_s": {"fit": True}}},
    }
    balls = {**SWEEP, "v1": 1e-3, "angle": 0.7, "mu": 0.3, "R1": 0.01, "R2": math.inf}
    config = read_config({**law, "sweep": balls, "data": {"columns": {"beta": [-0.5]}}}, purpose="calibrate")
    ((lower, upper),) = natural_bounds(config).values()
    assert math.sqrt(lower * upper) == pytest.approx(1e-3)


@pytest.mark.slow
def test_a_fit_over_the_natural_range_finds_what_bounds_of_the_user_find(folder: Path) -> None:
    source = {"sweep": {**SWEEP, "m1": "2.7 g"}, "models": "kuwabara-kono-1987"}
    columns = {"v1": [0.1, 0.3, 1.0, 3.0], "e_out": [0.9, 0.85, 0.8, 0.7], "sigma": [0.01] * 4}
    natural = impact.calibrate({**source, "data": {"columns": columns, "fit": True}})
    law = {"kuwabara-kono-1987": {"A": {"fit": ["1e-7 s", "1e-2 s"]}}}
    given = impact.calibrate({**source, "data": {"columns": columns}, "model": law})
    assert natural["estimate"].item() == pytest.approx(given["estimate"].item(), rel=1e-6)
    assert natural["fit_status"].item() == given["fit_status"].item()
