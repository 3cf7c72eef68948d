"""What Python users pass: values of other libraries, results by file, changes by path; what they keep: pickles."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pandas as pd
import pint
import pytest
import xarray as xr
from rich.cells import cell_len

import impact

from .conftest import ROOT, Run, assert_same_bits

unit = pint.get_application_registry()
BASE = {
    "models": ["hertz", "tsuji-1992"],
    "sweep": {"e": [0.25, 0.5], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9},
}


@pytest.fixture(scope="module")
def result() -> xr.Dataset:
    return impact.sweep(BASE)


@pytest.mark.parametrize(
    "half",
    [
        np.float64(0.5),
        np.longdouble(0.5),
        np.array(0.5),
        Fraction(1, 2),
        Decimal("0.5"),
        0.5 * unit.dimensionless,
        xr.DataArray(0.5),
    ],
    ids=lambda value: type(value).__name__,
)
def test_a_number_of_any_library_is_an_input(half: object, result: xr.Dataset) -> None:
    here = impact.sweep(BASE, overrides={"sweep.e": half})
    assert here["e_out"].values.tolist() == result["e_out"].sel(e=0.5).values.tolist()
    assert impact.run(model="tsuji-1992", at={"e": half, "v1": 100 * unit.cm / unit.s}).point["v1"] == 1.0


@pytest.mark.parametrize(
    "axis",
    [
        np.array([0.25, 0.5]),
        np.array([0.25, 0.5], np.longdouble),
        pd.Series([0.25, 0.5]),
        pd.Index([0.25, 0.5]),
        xr.DataArray([0.25, 0.5], dims="e"),
        np.array([0.25, 0.5]) * unit.dimensionless,
        (0.25, 0.5),
    ],
    ids=lambda value: type(value).__name__,
)
def test_a_sequence_of_any_library_is_an_axis(axis: object, result: xr.Dataset) -> None:
    assert impact.sweep(BASE, overrides={"sweep.e": axis})["e_out"].equals(result["e_out"])


def test_a_range_and_lengths_with_units_are_axes() -> None:
    speeds = impact.sweep({**BASE, "sweep": {**BASE["sweep"], "v1": range(1, 3), "m1": [1, 2] * unit.g}})  # type: ignore[dict-item]
    assert speeds["v1"].values.tolist() == [1.0, 2.0]
    assert speeds["m1"].values.tolist() == [0.001, 0.002]


@pytest.mark.parametrize("source", [(), [1], pd.DataFrame({"e": [0.1]}), b"x", 5], ids=lambda v: type(v).__name__)
def test_another_type_is_named(source: object) -> None:
    with pytest.raises(impact.UsageError, match=f"^source: got an? {type(source).__name__}, expected a mapping"):
        impact.sweep(source)  # type: ignore[arg-type]
    with pytest.raises(impact.UsageError, match=f"^dataset: got an? {type(source).__name__}, expected xr.Dataset"):
        impact.plot(source)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: impact.run(at=[("e", 0.5)]), "at: got a list, expected Mapping[str, object] | None"),
        (lambda: impact.run(model=["hertz"]), "model: got a list, expected str | None"),
        (lambda: impact.solve("hertz", "K", 0.5), "target: got a float, expected Mapping[str, object]"),
        (lambda: impact.solve("hertz", "K", "e_out=0.5"), "target: got a str, expected Mapping[str, object]"),
        (
            lambda: impact.plot(impact.sweep(BASE), models=[1]),  # type: ignore[list-item]
            "models: got a list with an int, expected Sequence[str] | None",
        ),
        (
            lambda: impact.recommend(impact.sweep(BASE), models=[1]),  # type: ignore[list-item]
            "models: got a list with an int, expected str | Sequence[str] | None",
        ),
        (
            lambda: impact.plot(impact.sweep(BASE), sel={1: 2}),  # type: ignore[dict-item]
            "sel: got a dict with an int, expected Mapping[str, object] | None",
        ),
        (
            lambda: impact.solve("hertz", "K", {1: 0.5}),  # type: ignore[dict-item]
            "target: got a dict with an int, expected Mapping[str, object]",
        ),
        (
            lambda: impact.sweep(BASE, overrides=[1]),  # type: ignore[list-item]
            "overrides: got a list with an int, expected Sequence[str] | Mapping[str, object]",
        ),
        (
            lambda: impact.plot(impact.sweep(BASE), kind="restitution", labels={"hertz": 3}),  # type: ignore[dict-item]
            "labels: got a dict with an int, expected Mapping[str, str] | None",
        ),
        (
            lambda: impact.plot(impact.sweep(BASE), kind="loop", sel={"v1": "1 kg"}),
            'sel["v1"]: sweep.v1: got "1 kg", expected a unit of m/s',
        ),
        (
            lambda: impact.cite("hertz", 5),
            "laws: got an int, expected str | Path | xr.Dataset | ForceModel | FrictionLaw",
        ),
        (lambda: impact.check_model("hertz"), "model: got a str, expected ForceModel"),
        (lambda: impact.info(5), "result: got an int, expected xr.Dataset | str | Path"),
        (lambda: impact.load(5), "path: got an int, expected str | Path"),
        (lambda: impact.estimate(BASE, jobs=0), "jobs: got 0, expected a whole number >= 1"),
        (lambda: impact.estimate(BASE, jobs=1.5), "jobs: got a float, expected int"),  # type: ignore[arg-type]
        (lambda: impact.run(times=np.array(1)), "times: got 1, expected a whole number >= 2"),  # type: ignore[arg-type]
        (lambda: impact.sweep(impact.sweep(BASE)), "source: got a Dataset, expected a mapping"),
        (lambda: impact.calibrate(impact.sweep(BASE)), "source: got a Dataset, expected a mapping"),  # type: ignore[arg-type]
        (
            lambda: impact.plot(impact.sweep(BASE), width=xr.DataArray(0.5)),  # type: ignore[arg-type]
            "width: got 0.5, expected a length from 26mm",
        ),
        (lambda: impact.merge([], "r.h5"), "folders: got none, expected the work folders of all shards"),
        (lambda: impact.run("hertz"), 'No such file or directory; did you mean model="hertz"?'),
        (lambda: impact.sweep("hertz"), 'No such file or directory; did you mean models="hertz"?'),
        (lambda: impact.models("hertz"), "did you mean pattern='hertz'?"),
        (lambda: impact.run(at={"e": 2}), 'at["e"]: sweep.e: got 2, expected'),
        (lambda: impact.run(overrides={"sweep.e": 2}), 'overrides["sweep.e"]: sweep.e: got 2, expected'),
        (lambda: impact.run(overrides=["sweep.e=2"]), 'overrides="sweep.e=2": sweep.e: got 2, expected'),
        (lambda: impact.solve("hertz", "A", {"e_out": 0.5}), "name: hertz has no parameter"),
        (lambda: impact.solve("tsuji-1992", "e", {"e_out": "x"}), 'target["e_out"]: got "x", expected'),
        (lambda: impact.timestep("tsuji-1992", steps_per_contact=-1), "steps_per_contact: got -1, expected"),
        (lambda: impact.timestep("tsuji-1992", parameter="K"), "parameter: expected one dt and tol as well"),
        (lambda: impact.export("lamps"), 'to: no code "lamps"; did you mean "lammps"?'),
        (lambda: impact.plot(impact.sweep(BASE), kind="foo"), 'kind: no kind "foo"'),
        (lambda: impact.plot(impact.sweep(BASE), sel={"e": [1, 2]}), 'sel={"e": [1, 2]}: got no single value'),
        (
            lambda: impact.plot(impact.sweep(BASE), sel={"e": xr.DataArray([1, 2])}),
            'sel={"e": [1, 2]}: got no single value',
        ),
        (lambda: impact.save(impact.sweep(BASE), ROOT / "README.md"), "or overwrite it (overwrite=True)"),
    ],
)
def test_a_message_names_the_argument_as_python_does(call: Callable[[], object], message: str) -> None:
    with pytest.raises(impact.ImpactError) as refusal:
        call()
    assert message in str(refusal.value)
    assert "--" not in str(refusal.value)


@pytest.mark.parametrize("function", [impact.plot, impact.recommend, impact.report, impact.run, impact.prepare])
def test_a_dataset_of_another_program_is_not_a_result(function: Callable[[xr.Dataset], object]) -> None:
    with pytest.raises(impact.UsageError, match="not a result of impact: it has no coordinate model"):
        function(xr.Dataset({"a": ("x", [1.0])}))


@pytest.mark.parametrize("act", [impact.recommend, impact.report, impact.page])
def test_an_axis_that_no_sweep_has_is_refused(act: Callable[[xr.Dataset], object], result: xr.Dataset) -> None:
    stacked = result.stack(p=("model", "e"))
    for other in (stacked, result.stack(p=("e",)), xr.concat([result, result], "p"), result.rename(e="p")):
        with pytest.raises(
            impact.UsageError, match=r"p: expected an axis of a sweep|expected the result of a sweep"
        ):
            act(other)
    with pytest.raises(impact.UsageError, match="model is not an axis"):
        impact.compare(stacked, result)


@pytest.mark.parametrize("default", ["D", "~P", "L"])
def test_quantities_of_pint_have_their_units(default: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unit.formatter, "default_format", default)
    speeds = unit.Quantity([[100.0, 300.0], [200.0, 400.0]], "mm/s")
    stiffness = unit.Quantity(1e9, "N / m**1.5")
    problem = impact.prepare(model="hertz", at={"K": stiffness}, outputs="peak_force")
    expected = problem(K=1e9, v1=[[0.1, 0.3], [0.2, 0.4]])["peak_force"]
    for v1 in (speeds, xr.DataArray(speeds, dims=("x", "y"))):
        np.testing.assert_allclose(problem(v1=v1)["peak_force"], expected, rtol=1e-12)
    swept = impact.sweep(models="hertz", v1=xr.DataArray(speeds[0], dims="x"), e=unit.Quantity(1.0, ""))
    assert (swept["v1"].values.tolist(), swept["e"].item()) == ([0.1, 0.3], 1.0)


def test_a_data_array_has_the_unit_of_its_attribute() -> None:
    table = xr.Dataset({"v1": ("drop", [100.0, 200.0], {"units": "mm/s"})})
    for swept in (impact.sweep(models="hertz", cases=table), impact.sweep(BASE, v1=table["v1"])):
        assert swept["v1"].values.tolist() == [0.1, 0.2]
    assert impact.run(BASE, at={"v1": table["v1"][1]}).point["v1"] == 0.2
    problem = impact.prepare(BASE, outputs="peak_force")
    assert problem(v1=table["v1"])["peak_force"].tolist() == problem(v1=[0.1, 0.2])["peak_force"].tolist()
    with pytest.raises(impact.ConfigError, match=r"got .100\.0 mm/s., expected"):
        impact.sweep(BASE, m1=table["v1"])
    stiffness = xr.DataArray([1e9, 2e9], attrs={"units": "N m-1.5"})
    assert impact.sweep(BASE, K=stiffness)["K"].values.tolist() == [1e9, 2e9]
    assert impact.sweep(BASE, K=stiffness.assign_attrs(units="mN m-1.5"))["K"].values.tolist() == [1e6, 2e6]
    with pytest.raises(impact.ConfigError, match=r"got .1000000000\.0 N m-1\.5., expected a unit of m/s"):
        impact.sweep(BASE, v1=stiffness)
    with pytest.raises(impact.ConfigError, match='"foo" is not a known unit'):
        impact.sweep(BASE, v1=table["v1"].assign_attrs(units="foo"))


def test_a_data_array_with_an_si_unit_of_another_dimension_is_refused() -> None:
    problem = impact.prepare(model="hertz", outputs="peak_force")
    speeds = xr.DataArray([[1.0, 2.0], [3.0, 4.0]], dims=("x", "y"))
    masses = speeds.assign_attrs(units="kg")
    for act in (
        lambda: impact.run(model="hertz", at={"v1": masses[0, 0]}),
        lambda: impact.sweep(BASE, v1=masses[0]),
        lambda: problem(v1=masses),
    ):
        with pytest.raises(impact.ImpactError, match=r'got "1\.0 kg", expected a unit of m/s, such as "1 m/s"$'):
            act()
    for units in ("", "1", "m/s", "m s-1"):
        of_units = speeds.assign_attrs(units=units)
        assert problem(v1=of_units)["peak_force"].tolist() == problem(v1=speeds.values)["peak_force"].tolist()
        assert impact.sweep(BASE, v1=of_units[0])["v1"].values.tolist() == [1.0, 2.0]


def test_a_data_array_of_long_doubles_or_texts_with_a_unit_is_read() -> None:
    for values in (np.array([100.0, 200.0], np.longdouble), ["0.1 m/s", "20 cm/s"]):
        swept = impact.sweep(BASE, v1=xr.DataArray(values, attrs={"units": "mm/s"}))
        assert swept["v1"].values.tolist() == [0.1, 0.2]


@pytest.fixture(scope="module")
def fits() -> xr.Dataset:
    changes = {"models": ["kelvin-voigt"], "solver.rtol": 1e-6}
    return impact.calibrate(ROOT / "docs" / "calibrate" / "drops.toml", overrides=changes)


def test_a_result_that_was_changed_is_taken_where_it_can_be_read_and_else_refused(fits: xr.Dataset) -> None:
    sweep = impact.sweep({**BASE, "models": ["hertz", "tsuji-1992"]})
    halves = [sweep.isel(model=[number]) for number in range(2)]
    show = (impact.info, impact.plot, impact.report)
    for result, kind, violation, refusing in (
        (sweep.drop_vars("title"), "sweep", "title of the models is missing", show[1:]),
        (sweep.drop_vars("doi"), "sweep", "doi of the models is missing", show[2:]),
        (xr.concat(halves, "model", data_vars="all"), "sweep", "v1_reference: lies along model", show[1:]),
        (fits.isel(model=0).drop_vars("title"), "calibration", "title of the models is missing", show[1:]),
        (fits.drop_vars("fit_status"), "calibration", "fit_status: got none, expected model", show),
        (fits.where(False), "calibration", "identifiable: got float32, expected int8", show),
    ):
        for function in show:
            if function in refusing:
                line = f"this {kind} was changed: {violation}; select parts by sel or isel only"
                with pytest.raises(impact.UsageError, match=f"^{re.escape(line)}$"):
                    function(result)
            else:
                function(result)


def test_inputs_and_titles_that_became_variables_are_taken_for_coordinates() -> None:
    result = impact.sweep(BASE)
    names = [name for name in result.coords if name not in result.dims]
    for show in (impact.page, impact.report, impact.info):
        assert str(show(result.reset_coords(names))) == str(show(result))
    # v1 is an input, and a variable over time
    lines = str(impact.info(impact.run(model="hertz", at={"e": 0.5}).history)).splitlines()
    assert any(line.startswith("v1 ") and " t " in line for line in lines)


def test_a_result_of_which_no_values_are_left_is_refused(fits: xr.Dataset) -> None:
    result = impact.sweep(BASE)
    for function in (impact.info, impact.report, impact.page, impact.plot, impact.run):
        with pytest.raises(impact.UsageError, match="this result has no values along model"):
            function(result.isel(model=slice(0, 0)))
    with pytest.raises(impact.UsageError, match="this result has no values along model"):
        impact.describe(fits.isel(model=slice(0, 0)))


def test_one_law_of_a_calibration_or_of_a_study_may_be_selected() -> None:
    models = ["anagnostopoulos-1988-no-tension", "kelvin-voigt-no-tension"]
    law = {"models": models, "model": {"kelvin-voigt-no-tension": {"C": 30.0}}}
    sweep = {"n": 1.0, "K": 1e6, "m1": 1.0, "m2": 1.0, "e": 0.8}
    pairs = {"frictions": ["coulomb-1785"], "sweep": {**sweep, "R1": 0.01, "R2": 0.01, "mu": {"fit": [0.01, 1.0]}}}
    columns = {"v1": [1.0, 2.0, 3.0], "u1": [2.0, 4.0, 7.0], "beta": [-0.5, -0.5, -0.6]}
    study = {"sweep": {**sweep, "v1": 1.0, "e": {"uniform": [0.5, 0.9]}}, "design": {"n": 16}}
    quick = law | {"solver": {"rtol": 1e-6}}
    fits = impact.calibrate(quick | pairs | {"data": {"columns": columns, "sigma": 0.1}})
    for result in (fits, impact.sensitivity(quick | study)):
        text = str(impact.describe(result.isel(model=[0])))
        law_alone = result.isel(model=0)
        assert str(impact.describe(law_alone)) == text
        assert impact.report(law_alone) == impact.report(result.isel(model=[0]))
        assert str(impact.info(law_alone)) == str(impact.info(result.isel(model=[0])))
        assert len(impact.plot(law_alone).axes) == len(impact.plot(result.isel(model=[0])).axes)
    assert str(impact.run(fits.isel(model=0))) == str(impact.run(fits.isel(model=[0])))
    assert impact.compare(fits.isel(model=0), fits.isel(model=[0])).equal
    assert impact.compare(fits.isel(model=0), fits).headline == "not equal: labels (model)"


@pytest.mark.parametrize("name", ["run", "prepare", "solve", "timestep", "export"])
def test_a_result_is_a_source_to_type_checkers_too(name: str) -> None:
    assert xr.Dataset in get_args(get_type_hints(getattr(impact, name))["source"])


def test_a_number_that_is_no_status_is_named() -> None:
    result = impact.sweep(BASE)
    for changed in (result.assign(status=result["status"] + 76), result.where(result["m1"] < 0.0)):
        for function in (impact.info, impact.report):
            with pytest.raises(
                impact.ResultError, match="status: got a number that is no status; select points with sel"
            ):
                function(changed)


def test_what_fails_for_another_reason_stays_the_error_that_it_is(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="unexpected keyword argument 'modle'"):
        impact.run(modle="hertz")  # type: ignore[call-arg]
    with pytest.raises(ZeroDivisionError):
        impact.sweep(BASE, executor=Broken())
    with pytest.raises(ZeroDivisionError):
        # a type with an argument that is no element
        impact.sweep_to_file(BASE, tmp_path / "r.h5", backend=broken_backend())


@contextmanager
def broken_backend() -> Iterator[Any]:
    raise ZeroDivisionError
    yield


class Broken(Executor):
    """An executor that fails."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        raise ZeroDivisionError


@pytest.mark.parametrize(
    "words", [["run", "hertz"], ["solve", "hertz", "--model", "hertz", "--for", "K", "--target", "e_out=1"]]
)
def test_the_command_line_names_options(cli: Run, words: list[str]) -> None:
    done = cli(*words)
    hint = "did you mean --model hertz?"
    assert (done.returncode, done.stderr) == (2, f"hertz: cannot be read: No such file or directory; {hint}\n")


def test_the_command_line_names_a_wrong_value_of_sel(cli: Run, result: xr.Dataset, tmp_path: Path) -> None:
    impact.save(result, tmp_path / "r.h5")
    done = cli("plot", "r.h5", "--kind", "loop", "--sel", "v1=1 kg", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith('--sel v1=1 kg: sweep.v1: got "1 kg", expected a unit of m/s')


def test_public_functions_are_pickled_by_their_name() -> None:
    for name in impact.__all__:
        assert pickle.loads(pickle.dumps(getattr(impact, name))) is getattr(impact, name)


@pytest.mark.parametrize("times", [np.int64(5), np.array(5)])
def test_the_number_of_points_of_a_history_is_an_integer_of_any_library(times: Any) -> None:
    history, expected = (impact.run(model="hertz", times=number).history for number in (times, 5))
    assert history is not None
    assert expected is not None
    assert_same_bits(history, expected)


@pytest.mark.slow
@pytest.mark.parametrize("target", [0.5, "50 %", np.float32(0.5), 0.5 * unit.dimensionless, xr.DataArray(0.5)])
def test_a_target_is_a_number_of_any_library(target: object) -> None:
    (root,) = impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": target}).roots
    assert root.value == pytest.approx(0.697958, abs=1e-5)
    assert impact.recommend(impact.sweep(BASE), target={"e_out": target})[0].model == "tsuji-1992"


@pytest.mark.slow
def test_a_selected_value_is_a_number_of_any_library(result: xr.Dataset) -> None:
    titles = [
        impact.plot(result, kind="loop", models=["tsuji-1992"], sel={"e": half}).axes[0].get_title()
        for half in (0.5, "50 %", np.array(0.5), Fraction(1, 2), 0.5 * unit.dimensionless, result["e"][1])
    ]
    assert len(set(titles)) == 1


@pytest.mark.slow
def test_an_extension_takes_values_by_path(tmp_path: Path) -> None:
    impact.sweep(BASE, output=tmp_path / "r.h5")
    extended = impact.extend(tmp_path / "r.h5", {"sweep.e": np.array([0.25, 0.5, 0.75])})
    assert extended["e"].values.tolist() == [0.25, 0.5, 0.75]


def test_an_extension_names_a_value_that_is_no_input(tmp_path: Path) -> None:
    impact.sweep(BASE, output=tmp_path / "r.h5")
    with pytest.raises(impact.ConfigError, match=r'^overrides\["sweep.v1"\]: sweep.v1: got a generator, expected'):
        impact.extend(tmp_path / "r.h5", {"sweep.v1": (v for v in (1.0, 2.0))})


def test_a_result_may_be_given_by_its_file(result: xr.Dataset, tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    impact.save(result, path)
    assert impact.recommend(str(path)) == impact.recommend(path) == impact.recommend(result)
    assert impact.plot(path).axes


def test_a_selected_model_is_a_result(result: xr.Dataset) -> None:
    selected, listed = result.sel(model="tsuji-1992"), result.sel(model=["tsuji-1992"])
    assert list(impact.recommend(selected)) == list(impact.recommend(listed))
    assert [text.get_text() for text in impact.plot(selected, kind="restitution").texts] == [
        text.get_text() for text in impact.plot(listed, kind="restitution").texts
    ]


def test_a_ranking_is_a_sequence(result: xr.Dataset) -> None:
    ranking = impact.recommend(result)
    assert len(ranking) == 2
    assert ranking[0] is ranking.models[0]
    assert [row.model for row in ranking[:1]] == [ranking.models[0].model]


@pytest.mark.slow
@pytest.mark.parametrize(
    "make",
    [
        lambda: impact.run(model="hertz"),
        lambda: impact.models(),
        lambda: impact.frictions(),
        lambda: impact.recommend(impact.sweep(BASE)),
        lambda: impact.solve("kuwabara-kono-1987", "A", {"e_out": 0.6}),
        lambda: impact.cite("hertz"),
    ],
    ids=["run", "models", "frictions", "recommend", "solve", "cite"],
)
def test_results_can_be_pickled(make: Callable[[], object]) -> None:
    before = make()
    after = pickle.loads(pickle.dumps(before))
    assert str(after) == str(before)


@pytest.mark.parametrize(
    "read",
    [
        lambda name, result: impact.run(name),
        lambda name, result: impact.solve("hertz", "K", {"contact_time": 1e-3}, source=name),
        lambda name, result: impact.plot(result, style=name),
        lambda name, result: impact.conform(adapter=f"{name}.py:collide"),
        lambda name, result: impact.save(result, f"{name}/r.h5"),
    ],
    ids=["run", "solve", "plot", "conform", "save"],
)
def test_a_name_that_no_file_can_have_is_named(
    read: Callable[[str, xr.Dataset], object], result: xr.Dataset
) -> None:
    name = "x" * 300
    with pytest.raises((impact.ConfigError, impact.UsageError), match=name[:50]):
        read(name, result)


def test_results_with_other_values_are_not_equal() -> None:
    adapters = (lambda collision: collision), str(ROOT / "docs/conform/rigid.py:collide")
    boards = [impact.conform(adapter=adapter, only="normal-e50-middle-equal") for adapter in adapters]
    assert boards[0] != boards[1]
    sweep = {"v1": {"uniform": [0.8, 1.2]}, "m1": 1.0, "m2": 1.0, "K": 1e6}
    uncertain = {"models": "hertz", "sweep": sweep, "design": {"n": 2}}
    studies = [impact.sensitivity(uncertain, of=name) for name in ("peak_force", "contact_time")]
    laws = {"models": "anagnostopoulos-1988", "sweep": {**sweep, "v1": 1.0, "n": 1.0, "e": {"fit": [0.1, 1.0]}}}
    data = [{"columns": {"e_out": [e, e + 0.1], "sigma": [0.01, 0.01]}} for e in (0.4, 0.6)]
    fits = [impact.calibrate({**laws, "data": columns}) for columns in data]
    for first, second in (studies, fits):
        assert impact.describe(first) != impact.describe(second)
        assert impact.describe(first) == impact.describe(first.copy(deep=True))


@pytest.mark.parametrize("kind", ["restitution", "animation"])
def test_figures_can_be_pickled(result: xr.Dataset, kind: str) -> None:
    figure = impact.plot(result, kind=kind)
    again = pickle.loads(pickle.dumps(figure))
    again.canvas.draw()
    figure.canvas.draw()
    assert [tick.get_text() for tick in again.axes[0].get_xticklabels()] == [
        tick.get_text() for tick in figure.axes[0].get_xticklabels()
    ]


def test_a_law_of_the_catalogue_is_the_same_law_after_pickling() -> None:
    law = impact.models()["tsuji-1992"]
    assert pickle.loads(pickle.dumps(law)) is law


def damped(e: float) -> float:
    """The damping of a law of this module."""
    return 1.0 - e


def test_a_law_of_a_module_is_pickled() -> None:
    law = impact.hysteresis("mine-2026", title="Mine", year=2026, equation="", reference="", chi=damped)
    assert pickle.loads(pickle.dumps(impact.run(model="mine-2026", plugins=[law]))).model.key == "mine-2026"


def test_a_law_of_a_plug_in_file_is_pickled_as_its_file_and_key(tmp_path: Path) -> None:
    path = tmp_path / "plug.py"
    text = "import impact\nabout = {'title': '', 'year': 1, 'equation': '', 'reference': ''}\n"
    text += "LAW = impact.hysteresis('mine', **about, chi=lambda e: 1 - e)\n"
    path.write_text(text, encoding="utf-8")
    pickled = pickle.dumps(impact.run(model="mine", plugins=[path]))
    assert pickle.loads(pickled).model.coefficients["chi"](0.25) == 0.75
    path.write_text(text.replace("1 - e", "2 - e"), encoding="utf-8")
    with pytest.warns(impact.ImpactWarning, match="has changed since the model mine was pickled"):
        assert pickle.loads(pickled).model.coefficients["chi"](0.25) == 1.75


def test_the_text_of_a_result_has_100_columns() -> None:
    for text in map(
        str,
        (
            impact.models(),
            impact.frictions(),
            impact.run(friction="coulomb-1785", at={"mu": 0.3, "angle": "45 deg"}),
        ),
    ):
        # a dot above a letter takes no column
        assert 90 < max(map(cell_len, text.splitlines())) <= 100


def test_a_text_has_no_colours_where_the_environment_forces_them(
    result: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = str(impact.recommend(result))
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert str(impact.recommend(result)) == text


@pytest.mark.slow
def test_a_result_at_a_prompt_is_its_text(result: xr.Dataset) -> None:
    results = impact.run(model="hertz"), impact.recommend(result), impact.compare(result, result)
    described = impact.cite("hertz"), impact.info(result), impact.check_model(impact.models()["hertz"])
    for value in (*results, *described):
        assert repr(value) == str(value)
    assert repr(impact.models()["hertz"]) == "<ForceModel hertz: F = K δⁿ  (10)>"


def test_errors_are_those_of_python() -> None:
    with pytest.raises(ValueError, match=r"got 1\.4"):
        impact.run(at={"e": 1.4})
    with pytest.raises(FileNotFoundError, match=r"^no\.toml: cannot be read"):
        impact.sweep("no.toml")
    # also the errors of their kind, as before
    with pytest.raises(FileNotFoundError, match=r"^no\.h5: does not exist") as missing:
        impact.load("no.h5")
    assert isinstance(missing.value, impact.ResultError)
    with pytest.raises(FileNotFoundError, match=r"^no\.py: cannot be read") as missing:
        impact.run(plugins=["no.py"])
    assert isinstance(missing.value, impact.UsageError)
    drops = {"models": "hertz", "sweep": {"cases": "no.csv"}}
    fit = {"models": "hertz", "sweep": {"K": {"fit": [1e6, 1e9]}}, "data": {"file": "no.csv"}}
    for call, config in ((impact.sweep, drops), (impact.run, drops), (impact.calibrate, fit)):
        with pytest.raises(FileNotFoundError, match=r"(?m)^no\.csv: cannot be read: No such file or directory$"):
            call(config)
    error = pickle.loads(pickle.dumps(impact.ConfigError("a", "b\n")))
    assert (type(error), error.problems) == (impact.ConfigError, ("a", "b\\x0a"))


def test_implausible_inputs_and_results_are_warnings_at_the_line_of_the_user() -> None:
    steel = {"E": 210, "nu": 0.3, "rho": 7800}
    sweep = {"v1": -1.0, "R1": 0.01, "R2": 0.01, "material": "x"}
    with pytest.warns(impact.ImpactWarning) as caught:
        impact.sweep({"models": "hertz", "sweep": sweep, "materials": {"x": steel}})
    assert [str(warning.message) for warning in caught] == [
        "materials.x.E: got 210 Pa; did you mean 210 GPa?",
        "none of 1 points is an impact: v1 <= v2, the balls do not approach",
    ]
    assert {warning.filename for warning in caught} == {__file__}
    with pytest.warns(impact.ImpactWarning, match="peak indentation above 10% of the smaller radius"):
        impact.sweep({"models": "hertz", "sweep": {**sweep, "v1": 2000.0, "material": "steel"}})


def broken(e: np.ndarray) -> np.ndarray:
    raise NameError("no such name")


BROKEN = impact.hysteresis("broken-2026", title="Broken", year=2026, equation="", reference="", chi=broken)
INCOMPLETE = {
    "models": "anagnostopoulos-1988",
    "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "e": {"fit": [0.1, 1.0]}},
    "data": {"columns": {"e_out": [0.49, "NA", 0.51], "sigma": [0.01, 0.01, 0.01]}},
}


@pytest.mark.parametrize(
    ("call", "note"),
    [
        (lambda: impact.calibrate(INCOMPLETE), "1 of 3 rows has no e_out"),
        (
            lambda: impact.sweep(models="broken-2026", plugins=[BROKEN]),
            "model broken-2026: NameError: no such name",
        ),
        (lambda: impact.run(model="broken-2026", plugins=[BROKEN]), "model broken-2026: NameError: no such name"),
        (lambda: impact.check_model(BROKEN), "model broken-2026: NameError: no such name"),
        (
            lambda: impact.plot(
                impact.sweep(BASE), points=pd.DataFrame({"e": [0.5], "v1_post": [0.4], "batch": [1]})
            ),
            "columns without use: batch",
        ),
    ],
)
def test_a_note_is_a_warning_at_the_line_of_the_user(call: Callable[[], object], note: str) -> None:
    with pytest.warns(impact.ImpactWarning, match=note) as caught:
        call()
    assert {warning.filename for warning in caught} == {__file__}


@pytest.mark.parametrize("dt", ["2 us", 2e-6, np.float64(2e-6), 2 * unit.us, np.array([2e-6]), ["0.002 ms"]])
def test_a_step_is_a_number_or_several_with_or_without_a_unit(dt: Any) -> None:
    (row,) = impact.timestep("anagnostopoulos-1988", at={"e": 0.5}, dt=dt, tol="2%", phases=4).rows
    assert row.dt == pytest.approx(2e-6, rel=1e-15)


def test_a_tolerance_may_be_a_percentage(result: xr.Dataset) -> None:
    changed = result.assign(v1_post=result["v1_post"] + 0.005)
    for tol in ("1%", 0.01 * unit.dimensionless, {"all": "1%"}, {"v1_post": np.float32(0.01)}):
        assert impact.compare(changed, result, tol=tol).equal  # type: ignore[arg-type]
    assert not impact.compare(changed, result, tol="0.1%").equal
    assert impact.recommend(result, tol="2%").tol == impact.recommend(result, tol=0.02).tol == 0.02


def test_a_width_may_be_a_quantity(result: xr.Dataset) -> None:
    widths = [impact.plot(result, width=width).get_figwidth() for width in ("84mm", 84 * unit.mm, 84 / 25.4)]
    assert widths == pytest.approx([84 / 25.4] * 3, rel=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("half", [np.array([0.5]), pd.Series([0.5]), xr.DataArray([0.5], dims="e"), [0.5]])
def test_an_array_of_one_element_is_a_value(half: object, result: xr.Dataset) -> None:
    assert impact.run(at={"e": half}).point["e"] == 0.5
    assert impact.recommend(result, sel={"e": half})[0].points == 1
    assert impact.solve("mujoco-solref", "dampratio", {"e_out": half}).roots


@pytest.mark.slow
@pytest.mark.parametrize("collect", [np.array, pd.Series, pd.Index, xr.DataArray])
def test_models_may_be_an_array_of_keys(collect: Callable[[list[str]], Any], result: xr.Dataset) -> None:
    keys = collect(["tsuji-1992", "hertz"])
    assert impact.sweep(models=keys)["model"].values.tolist() == ["tsuji-1992", "hertz"]
    assert len(impact.recommend(result, models=keys)) == 2
    assert impact.plot(result, models=keys).axes
    assert impact.explore(result, models=keys).children
    assert "tsuji-1992" in impact.page(result, models=keys)
    assert "tsuji-1992" in impact.report(result.isel(e=[0]), models=keys, sections=["models"])


def test_one_model_may_be_named_without_a_list(result: xr.Dataset) -> None:
    assert [row.model for row in impact.recommend(result, models="hertz")] == ["hertz"]


@pytest.mark.parametrize(
    ("cases", "message"),
    [
        (
            {"v1": [1.0], "v1 [mm/s]": [1.0]},
            'sweep.cases."v1 [mm/s]": set together with "v1", expected one of the two',
        ),
        (
            {"v1": [1.0], "material [mm]": ["steel"]},
            'sweep.cases."material [mm]": got a unit, expected "material"',
        ),
    ],
)
def test_a_column_that_would_be_ignored_is_refused(cases: dict[str, object], message: str) -> None:
    with pytest.raises(impact.ConfigError) as refusal:
        impact.sweep({"models": ["hertz"], "sweep": {"m1": 1.0, "m2": 1.0, "K": 6e9, "e": 0.5, "cases": cases}})
    assert message in str(refusal.value)


def test_columns_of_cases_may_have_units() -> None:
    names = ("e", "v1 [mm/s]", "m1", "m2", "K")
    cases = pd.DataFrame([[0.5, 100.0, 1.0, 1.0, 6e9], [0.5, 200.0, 1.0, 1.0, 6e9]], columns=names)
    swept = impact.sweep({"models": ["hertz"], "sweep": {"cases": cases}})
    assert swept["v1"].values.tolist() == [0.1, 0.2]


def test_a_sweep_takes_its_inputs_by_name() -> None:
    """Without a source the others are those of the starter config; with one they are changes of it."""
    here = impact.sweep(models="tsuji-1992", e=np.array([0.25, 0.5]), v1="50 cm/s", overrides={"sweep.m2": 2.0})
    expected = impact.run(model="tsuji-1992", at={"e": 0.25, "v1": 0.5, "m2": 2.0}).values
    assert here["v1_post"].sel(e=0.25).item() == pytest.approx(expected["v1_post"], rel=1e-9)
    assert (
        impact.sweep(BASE, e=0.5)["e_out"].values.tolist()
        == impact.sweep(BASE)["e_out"].sel(e=0.5).values.tolist()
    )
    assert dict(impact.sweep(models="hertz", frictions="coulomb-1785", e=0.5, u1=0.3, mu=[0.1, 0.2]).sizes) == {
        "model": 1,
        "friction": 1,
        "mu": 2,
    }


@pytest.mark.parametrize("overrides", [{"sweep.e": 0.7}, ["sweep.e=0.7"], {"sweep.e.linspace": [0.1, 0.7, 2]}])
def test_an_input_is_given_once(overrides: Any) -> None:
    with pytest.raises(impact.UsageError, match=r"^e: set together with overrides.*sweep.e"):
        impact.sweep(e=0.5, overrides=overrides)
    with pytest.raises(impact.UsageError, match=r"^models: set together with overrides"):
        impact.sweep(models="hertz", overrides={"models": "tsuji-1992"})


@pytest.mark.parametrize("huge", [Fraction(10**400), Decimal("sNaN")])
def test_a_number_that_no_float_holds_is_named(huge: object) -> None:
    with pytest.raises(impact.ConfigError, match=f"m2: got a {type(huge).__name__}, expected a number > 0 kg"):
        impact.sweep(m2=huge)


def test_a_radius_replaces_the_mass_of_the_starter_config() -> None:
    swept = impact.sweep(models="hertz", e=0.5, R1=0.01, R2=0.01)
    expected = impact.run(model="hertz", at={"e": 0.5, "R1": 0.01, "R2": 0.01}).values
    assert swept["contact_time"].item() == pytest.approx(expected["contact_time"], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("inputs", "dims"),
    [
        ({"cases": pd.DataFrame({"v1 [cm/s]": [50.0, 100.0], "e": [0.5, 0.6], "m1": 2.0})}, {"case": 2}),
        ({"cases": {"alpha": [0.1, 0.2]}}, {"case": 2}),
        ({"cases": {"R1": [0.1, 0.2], "R2": [0.1, 0.1], "e": [0.5, 0.6]}}, {"case": 2}),
        ({"cases": {"material1": ["steel", "glass"], "e": [0.5, 0.6]}, "material2": "steel"}, {"case": 2}),
        ({"e": 0.5, "speed": 2.0, "angle": "30 deg", "mu": 0.3, "frictions": "coulomb-1785"}, {"friction": 1}),
    ],
    ids=["cases", "alpha", "radii", "materials", "speed"],
)
def test_inputs_replace_those_of_the_starter_config(
    inputs: dict[str, Any], dims: dict[str, int], tmp_path: Path
) -> None:
    """Also where the result is repeated from its file."""
    swept = impact.sweep(models="hertz", output=tmp_path / "r.h5", **inputs)
    assert dict(swept.sizes) == {"model": 1, **dims}
    assert impact.rerun(tmp_path / "r.h5").equal


def test_cases_of_a_file_replace_inputs_of_the_starter_config(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text("v1 [m/s],e\n0.5,0.5\n1.0,0.6\n", encoding="utf-8")
    swept = impact.sweep(models="hertz", cases=str(tmp_path / "c.csv"))
    assert swept["v1"].values.tolist() == [0.5, 1.0]
    with pytest.raises(impact.ConfigError, match="set together with"):
        impact.sweep(models="hertz", cases=str(tmp_path / "c.csv"), v1=2.0)


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"overide": ["a"]}, "overide: sweep.overide: unknown key; known: K, "),
        ({"model": "hertz"}, 'model: sweep.model: unknown key; did you mean "models", before all tables?'),
        ({"e": 2}, "e: sweep.e: got 2, expected a number from 0 to 1"),
        ({"models": "hert"}, 'models: got "hert", expected a model; did you mean "hertz"?'),
    ],
)
def test_an_input_that_is_none_is_refused(inputs: dict[str, Any], message: str) -> None:
    with pytest.raises(impact.ConfigError) as refusal:
        impact.sweep(**inputs)
    assert str(refusal.value).startswith(message)


def test_a_law_in_place_of_its_key_is_asked_for_among_the_plugins() -> None:
    hertz, expected = impact.models()["hertz"], 'got a ForceModel, expected its key, "hertz"'
    mine, more = replace(hertz, title="mine"), ", and the law itself among the plugins"
    choices = {"models": (mine, more), "models[0]": ([mine], more), "models[1]": (["flores-2011", hertz], "")}
    for place, (models, end) in choices.items():
        with pytest.raises(impact.ConfigError) as refusal:
            impact.sweep(models=models, e=0.5)
        assert str(refusal.value) == f"{place}: {expected}{end}"
