"""Tables of text that fit, and in files: siunitx columns, chosen rows and digits, decimal commas."""

from __future__ import annotations

import io
import locale
import math
import re
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd
import pytest

import impact
from impact.display import Table, TableForm, encode_frame, print_blocks
from impact.errors import UsageError
from impact.plots.data import read_points
from impact.plots.kinds import Look

from .conftest import ROOT, Run

FORCES = [1.0, -22.5, 3.25e-12, float("nan"), float("inf")]
FRAME = pd.DataFrame({"x": [0.0, 0.5, 1.0, 1.5, 2.0], "F_m [N/m^1.5]": FORCES})


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tables") / "r.h5"
    impact.save(impact.sweep(ROOT / "configs" / "figure6.toml", overrides=["solver.rtol=1e-4"]), path)
    return path


def test_a_latex_table_has_s_columns_that_fit_their_widest_number() -> None:
    lines = encode_frame(FRAME, ".tex").decode().splitlines()
    assert lines[0] == r"\begin{tabular}{S[table-format=1.1]S[table-format=-2.2e-2]}"
    # a heading is in braces, so that siunitx does not read it as a number
    assert lines[2] == r"{x} & {F\_m [\unit{N/m^{1.5}}]} \\"
    assert lines[4:9] == [
        r"0 & 1 \\",
        r"0.5 & -22.5 \\",
        r"1 & 3.25e-12 \\",
        r"1.5 &  \\",
        r"2 & {$\infty$} \\",
    ]


def test_rows_are_spread_evenly_and_include_both_ends() -> None:
    lines = encode_frame(FRAME, ".csv", TableForm(rows=3)).decode().splitlines()
    assert [line.partition(",")[0] for line in lines] == ["x", "0.0", "1.0", "2.0"]
    assert len(encode_frame(FRAME, ".csv", TableForm(rows=9)).splitlines()) == 6


def test_digits_are_significant_and_all_without_a_choice() -> None:
    frame = pd.DataFrame({"x": [1.0 / 3.0]})
    assert encode_frame(frame, ".csv").decode() == f"x\n{1.0 / 3.0!r}\n"
    assert encode_frame(frame, ".csv", TableForm(digits=3)).decode() == "x\n0.333\n"
    assert "\n0.333333 \\\\" in encode_frame(frame, ".tex").decode()


@pytest.mark.slow
def test_a_table_with_decimal_commas_is_read_again(stored: Path, cli: Run, tmp_path: Path) -> None:
    words = ["--model", "gharib-hurmuzlu-2012", "--kind", "restitution", "-o", "a.png", "--data", "a.csv"]
    done = cli("plot", stored, *words, "--decimal", "comma", "--rows", "11", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "a.csv").read_text(encoding="utf-8")
    assert text.splitlines()[0].startswith("e;")
    # the column of the law, under the name that measured points have
    law = text.splitlines()[0].split(";").index("e_out gharib-hurmuzlu-2012")
    cells = [line.split(";") for line in text.splitlines()[1:]]
    assert [row[0] for row in cells[:3]] == ["0,0", "0,1", "0,2"]
    lines = ["e;e_out", *(f"{row[0]};{row[law]}" for row in cells)]
    (tmp_path / "b.csv").write_text("\n".join(lines), encoding="utf-8")
    points = read_points(tmp_path / "b.csv")
    assert points.columns["e"] == pytest.approx([0.1 * row for row in range(11)])
    assert 0.0 < points.columns["e_out"][5] < 0.5


def test_all_numbers_of_a_picture_have_the_comma(stored: Path) -> None:
    result = impact.load(stored)
    figure = impact.plot(result, kind="error", decimal="comma")
    figure.draw_without_rendering()
    texts = [text.get_text() for text in figure.findobj(plt.Text) if text.get_visible()]
    assert not [text for text in texts if re.search(r"\d\.\d", text)]
    assert {"0,05", "0,01"} <= set(texts)
    assert any("1,5" in text for text in texts)


def test_a_table_without_headings_is_not_printed_in_parts() -> None:
    stream = io.StringIO()
    print_blocks([Table([["name", 30 * "a", 30 * "b"]])], stream, 40)
    assert stream.getvalue().count("name") == 1


def test_the_name_of_a_panel_has_the_comma() -> None:
    sweep = {"v1": [1.0, 2.0], "m1": [1.0, 2.0], "m2": 1.0, "e": 0.5, "K": 1e6}
    models = {"models": ["hertz", "kuwabara-kono-1987"], "model": {"kuwabara-kono-1987": {"A": 2.5e-6}}}
    figure = impact.plot(impact.sweep({**models, "sweep": sweep}), kind="map", x="v1", y="m1", decimal="comma")
    assert figure.axes[1].get_title(loc="left").endswith("\N{NO-BREAK SPACE}2,5\N{NO-BREAK SPACE}µs")


def test_texts_of_the_user_keep_their_points_beside_numbers_with_commas(stored: Path) -> None:
    _, ax = plt.subplots()
    ax.set_title("Version 1.5")
    impact.plot(impact.load(stored), kind="restitution", decimal="comma", ax=ax)
    ax.figure.draw_without_rendering()
    assert ax.get_title() == "Version 1.5"
    assert "0,2" in [text.get_text() for text in ax.get_yticklabels()]
    plt.close(ax.figure)


def test_the_version_of_a_code_in_a_legend_keeps_its_points() -> None:
    models = ["mujoco-solref", "yade-en-clamped"]
    sweep = {"e": [0.1, 0.5], "v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "steel"}
    figure = impact.plot(impact.sweep({"models": models, "sweep": sweep}), kind="restitution", decimal="comma")
    names = " ".join(text.get_text() for text in figure.legends[0].get_texts())
    for version in ("since 2.1", "to 2022.01a"):
        assert version in " ".join(names.split())


@pytest.mark.skipif(sys.platform == "win32", reason="the locale is not that of the environment")
def test_the_locale_chooses_the_decimal_separator_and_is_not_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, decimal in (("C", "point"), ("no_SUCH.locale", "point"), ("de_DE.utf8", "comma")):
        monkeypatch.setenv("LC_ALL", name)
        before = locale.setlocale(locale.LC_NUMERIC)
        if decimal == "comma":
            try:
                locale.setlocale(locale.LC_NUMERIC, name)
            except locale.Error:
                pytest.skip(f"the locale {name} is not installed")
            locale.setlocale(locale.LC_NUMERIC, before)
        assert (TableForm(decimal="locale").decimal, Look(decimal="locale").decimal) == (decimal, decimal)
        assert locale.setlocale(locale.LC_NUMERIC) == before
        # a point is the default in every locale
        assert TableForm().decimal == "point"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--decimal", "dot"], "--decimal: got dot, expected point, comma or locale"),
        (["--rows", "1"], "--rows: got 1, expected a whole number >= 2"),
        (["-o", "a.txt"], "--output a.txt: expected a name that ends in .csv, .tex or .parquet"),
        # not ignored in silence
        (["--digits", "3"], "--digits: set without a table, expected --output FILE.csv"),
        (["--decimal", "comma"], "--decimal: set without a table, expected --output FILE.csv"),
    ],
)
def test_a_wrong_form_of_a_table_is_one_line_and_writes_nothing(
    stored: Path, cli: Run, tmp_path: Path, words: list[str], message: str
) -> None:
    done = cli("recommend", stored, *words, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, f"{message}\n")
    assert not list(tmp_path.iterdir())


def test_rows_of_a_picture_without_numbers_are_refused(stored: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="rows: set without a table, expected data="):
        impact.plot_to_files(stored, output=tmp_path / "a.png", rows=5)
    with pytest.raises(UsageError, match="data_form: set without a table, expected data="):
        impact.plot_to_files(stored, output=tmp_path / "a.png", data_form="long")
    with pytest.raises(UsageError, match="data_form: got tall, expected wide or long"):
        impact.plot_to_files(stored, output=tmp_path / "a.png", data_form="tall")
    # the separator is that of the picture
    assert impact.plot_to_files(stored, output=tmp_path / "a.png", decimal="comma").pictures


def test_an_angle_of_a_latex_table_is_in_degrees() -> None:
    frame = pd.DataFrame({"angle [rad]": [math.pi / 6.0, math.pi / 3.0], "omega [rad/s]": [1.0, 2.0]})
    lines = encode_frame(frame, ".tex").decode().splitlines()
    assert lines[2] == r"{angle [\unit{\degree}]} & {omega [\unit{rad/s}]} \\"
    assert lines[4:6] == [r"30 & 1 \\", r"60 & 2 \\"]
    assert encode_frame(frame, ".csv").decode().splitlines()[1].startswith("0.523598")


def test_a_latex_table_of_a_picture_has_the_labels(stored: Path, cli: Run, tmp_path: Path) -> None:
    words = ["--label", "e=Stoßzahl $e$", "--label", "v1_post=$v_1$", "--label", "gharib-hurmuzlu-2012=G & H"]
    for suffix, headings in (
        ("tex", [r"{Stoßzahl $e$} &", r"& {$v_1$ G \& H [\unit{m/s}]} &"]),
        ("csv", ["e,", ",v1_post gharib-hurmuzlu-2012 [m/s],"]),
    ):
        done = cli("plot", stored, "-o", f"{suffix}.png", "--data", f"numbers.{suffix}", *words, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        text = (tmp_path / f"numbers.{suffix}").read_text(encoding="utf-8")
        assert all(heading in text for heading in headings)


def test_a_column_without_numbers_is_text() -> None:
    frame = pd.DataFrame({"p": [math.nan, math.inf], "x": [-1.0, math.nan]})
    assert encode_frame(frame, ".tex").decode().startswith("\\begin{tabular}{lS[table-format=-1.0]}\n")


@pytest.mark.slow
def test_a_ranking_and_steps_are_tables_of_latex_and_csv(stored: Path, cli: Run, tmp_path: Path) -> None:
    done = cli("recommend", stored, "-o", "r.tex", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "r.tex: written\n")
    lines = (tmp_path / "r.tex").read_text(encoding="utf-8").splitlines()
    assert lines[2].startswith("{model} & {points} & {within}")
    assert lines[4].startswith("lankarani-nikravesh-1994 & 101 & 101 & 0 & ")
    assert "0 to 1" in lines[4]
    assert cli("recommend", stored, "-o", "comma.tex", "--decimal", "comma", cwd=tmp_path).returncode == 0
    assert " & 0,92 to 1 & " in (tmp_path / "comma.tex").read_text(encoding="utf-8")
    words = ["timestep", "--model", "tsuji-1992", "--at", "e=0.5", "--phases", "20"]
    assert cli(*words, "-o", "t.csv", cwd=tmp_path).returncode == 0
    again = cli(*words, "-o", "t.csv", cwd=tmp_path)
    assert (again.returncode, again.stderr.count("\n")) == (2, 1)
    table = pd.read_csv(tmp_path / "t.csv")
    assert table["steps_per_contact"].tolist() == [10.0, 20.0, 50.0, 100.0]
    assert table["e_mean"].between(0.45, 0.55).all()


def test_a_table_without_room_is_folded_at_spaces_and_the_widest_column_first() -> None:
    pair = "lankarani-nikravesh-1994 with cundall-strack-1979"
    table = Table([[pair, "kt_over_kn", "0.0967 to 0.1033", 1.25e-12]], ("law", "parameter", "95 %", "chi2/dof"))
    lines = {}
    for width in (100, 66, 46, 24):
        stream = io.StringIO()
        print_blocks([table], stream, width)
        lines[width] = [line.rstrip() for line in stream.getvalue().splitlines()]
        assert max(map(len, lines[width])) <= width
    assert len(lines[100]) == 2
    assert lines[100][1].split("  ")[0] == pair
    words = {*pair.split(), "kt_over_kn", "0.0967", "to", "0.1033", "1.25e-12"}
    for width in (66, 46):
        assert words <= {word for line in lines[width] for word in line.split()}
    # numbers keep their line as long as texts give way
    assert any("0.0967 to 0.1033" in line for line in lines[66])
    # where the words of all columns do not fit, each part has the law and a column, and a line is between parts
    assert lines[46].count("") == 2
    assert [line.split() for line in lines[46] if line.startswith("law")] == [
        ["law", "parameter"],
        ["law", "95", "%"],
        ["law", "chi2/dof"],
    ]
    # where even those of two columns do not fit they are broken, and all characters are there
    repeated = 2 * f"law{pair}".replace(" ", "")
    assert sorted("".join(lines[24]).replace(" ", "")) == sorted("".join(lines[100]).replace(" ", "") + repeated)
