"""`impact.__all__` is the public API, and a model from Python runs, is stored and is distinguished from others."""

from __future__ import annotations

import builtins
import functools
import inspect
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import impact
from impact.config.load import build, read_config
from impact.contact.status import Status
from impact.engine.checkpoint import open_work_folder
from impact.engine.plan import Plan
from impact.engine.plugins import read_plugins
from impact.engine.run import Run
from impact.errors import ModelError, UsageError
from impact.results.sweep import find_finished

from .conftest import ROOT

SWEEP = {"e": [0.2, 0.8], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
COARSE = {"rtol": 1e-4}


def _mine(chi: object = lambda e: (1 - e * e) / e) -> impact.ForceModel:
    return impact.hysteresis("mine-2026", title="Mine", year=2026, equation="", reference="", chi=chi)


def test_each_public_function_documents_what_it_returns() -> None:
    functions = filter(inspect.isfunction, (getattr(impact, name) for name in impact.__all__))
    returning = [function for function in functions if inspect.signature(function).return_annotation != "None"]
    assert [f.__name__ for f in returning if "Returns\n-------\n" not in (inspect.getdoc(f) or "")] == []
    assert "Raises\n------\n" in (inspect.getdoc(impact.load) or "")


def test_types_of_results_and_errors_are_public() -> None:
    """Users annotate their functions with them, and catch them."""
    for name in impact.__all__:
        function = getattr(impact, name)
        if inspect.isfunction(function):
            for kind in re.findall(r"\w+", str(inspect.signature(function).return_annotation)):
                member = inspect.unwrap(function).__globals__.get(kind)
                is_own = inspect.isclass(member) and member.__module__.startswith("impact.")
                assert not is_own or kind in impact.__all__, f"{name} returns {kind}"
            raised = re.findall(r"\b[A-Z][a-zA-Z]+Error\b", function.__doc__ or "")
            assert set(raised) <= {*impact.__all__, *vars(builtins)}, name


def test_all_is_exactly_what_is_public() -> None:
    assert sorted(set(dir(impact)) - {"__version__"}) == sorted(impact.__all__)
    for name in impact.__all__:
        member = getattr(impact, name)
        text = inspect.getdoc(member) or ""
        # a result is shown in the example of the function that returns it
        assert ">>> " in text if inspect.isfunction(member) else text, f"{name} shows no example"
        if inspect.isfunction(member):
            hints = inspect.signature(member)
            assert hints.return_annotation is not inspect.Signature.empty, name
            assert all(p.annotation is not p.empty for p in hints.parameters.values()), name
    with pytest.raises(AttributeError, match="swep"):
        _ = impact.swep  # type: ignore[attr-defined]


def test_importing_loads_no_numpy() -> None:
    code = "import sys, impact; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_function_is_the_same_in_threads_that_use_it_first() -> None:
    code = """
import sys, impact
from concurrent.futures import ThreadPoolExecutor
sys.setswitchinterval(1e-6)
names = [name for name in dir(impact) if name.islower()] * 8
with ThreadPoolExecutor(8) as pool:
    members = list(pool.map(lambda name: getattr(impact, name), names))
sys.exit(any(member is not getattr(impact, name) for name, member in zip(names, members)))
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_model_from_python_is_run_and_recorded() -> None:
    result = impact.sweep({"models": ["mine-2026", "exact-hysteresis"], "sweep": SWEEP}, plugins=[_mine()])
    assert np.abs(result["closed_form_error"]).max() < 1e-9
    recorded = json.loads(result.attrs["plugins"])["mine-2026"]
    assert recorded["file"] is None
    assert re.fullmatch("[0-9a-f]{64}", recorded["sha256"])
    assert (
        impact.run({"models": ["mine-2026"], "sweep": SWEEP, "solver": COARSE}, plugins=[_mine()]).model.title
        == "Mine"
    )
    with pytest.raises(impact.ImpactError, match='got "mine-2026", expected a model'):
        impact.sweep({"models": ["mine-2026"], "sweep": SWEEP, "solver": COARSE})


def test_the_force_of_a_hysteresis_law_is_that_of_its_formula_at_any_closing_speed() -> None:
    assert _mine().force(elastic=3.0, v=0.5, v0=2.0, chi=0.8) == pytest.approx(3.0 * (1.0 + 0.8 * 0.5 / 2.0))


def test_a_changed_model_has_another_fingerprint() -> None:
    def fingerprint(model: impact.ForceModel) -> str:
        return impact.sweep({"models": [model.key], "sweep": SWEEP, "solver": COARSE}, plugins=[model]).attrs[
            "fingerprint"
        ]

    assert fingerprint(_mine()) == fingerprint(_mine())
    assert fingerprint(_mine()) != fingerprint(_mine(chi=lambda e: (1 - e * e) / e / 2))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"force": lambda delta: delta}, 'its force asks for "delta"; known: E1'),
        ({"force": lambda elastik: elastik}, 'its force asks for "elastik"; did you mean "elastic"?'),
        ({"residual": lambda x: x}, 'its residual asks for "x"'),
        ({"coefficients": {"a": lambda b: b, "b": lambda e: e}}, 'its coefficient a asks for "b"'),
        ({"key": "Mine"}, 'model key "Mine": expected kebab-case'),
        ({"release": "tension"}, 'release: got \'tension\', expected "gap" or "force"'),
        ({"coordinate_power": 3}, "coordinate_power: got 3, expected 2, 4, 6 or 8"),
        ({"exponent": -1.0}, "exponent: got -1.0"),
        ({"domain": {"foo": (0, 1)}}, 'domain of "foo"'),
        ({"domain": {"e": (1, 0)}}, "domain of e: got (1, 0), expected (least, most)"),
        ({"parameters": ("c",)}, "expected a tuple of Parameter"),
        ({"coefficients": {"K": lambda e: e}}, '"K" is the name of a quantity'),
        (
            {"parameters": (impact.Parameter("2c", "1", ""),)},
            'got the name "2c", expected letters, digits and "_"',
        ),
        ({"parameters": (impact.Parameter("status", "1", ""),)}, '"status" is the name of a quantity'),
        ({"parameters": (impact.Parameter("c", "1", ""),) * 2}, 'parameters: got "c" twice, expected it once'),
        (
            {"parameters": (impact.Parameter("c", "1", "", default=-1.0, least=0.0, most=2.0),)},
            "parameter c: got the default -1, expected a number from 0 to 2",
        ),
        (
            {"velocity_coordinate": "log"},
            'velocity_coordinate "log": expected a coefficient chi, a force of elastic and chi',
        ),
        (
            {"velocity_coordinate": "force"},
            'velocity_coordinate "force": expected a coefficient c and a coefficient q, a force of elastic and c',
        ),
        (
            {
                "velocity_coordinate": "force",
                "parameters": (impact.Parameter("p", "1", ""),),
                "coefficients": {"c": lambda: 1.0, "q": lambda p: p},
                "force": lambda elastic, x, v, c, q: elastic + c * x**q * v,
            },
            'its coefficient q asks for "p"; known: n',
        ),
        ({"velocity_coordinate": "w"}, 'velocity_coordinate: got \'w\', expected "v", "log" or "force"'),
    ],
)
def test_an_invalid_model_is_refused_on_construction(change: dict[str, object], words: str) -> None:
    fields = {
        "key": "mine",
        "title": "",
        "year": 2026,
        "equation": "",
        "reference": "",
        "force": lambda elastic: elastic,
    }
    with pytest.raises(impact.ImpactError) as caught:
        impact.ForceModel(**(fields | change))  # type: ignore[arg-type]
    assert words in str(caught.value)


def test_two_models_of_one_key_are_refused() -> None:
    twin = impact.hysteresis("hertz", title="", year=1, equation="", reference="", chi=lambda e: e)
    with pytest.raises(impact.ImpactError, match="two models of this key"):
        impact.models([twin])


def test_the_message_for_a_law_instead_of_its_key_names_the_plugins() -> None:
    with pytest.raises(
        impact.ImpactError, match='expected its key, "mine-2026", and the law itself among the plug'
    ):
        impact.sweep({"models": [_mine()], "sweep": SWEEP})


def test_a_stiffness_may_be_a_parameter_of_a_law() -> None:
    result = impact.sweep(
        {
            "models": ["hertz", "bilinear"],
            "sweep": {**SWEEP, "e": 0.5},
            "model": {"bilinear": {"K": [1e6, 4e6]}},
        }
    )
    linear = result.sel(model="bilinear")
    assert linear["stiffness"].values.tolist() == [1e6, 4e6]
    # half the period of a linear oscillator on approach, half of that again, times e, on restitution
    half = np.pi / 2 * np.sqrt(0.5 / linear["stiffness"].values)
    np.testing.assert_allclose(linear["contact_time"].values, half * 1.5, rtol=1e-8)
    assert result.sel(model="hertz")["stiffness"].values.tolist() == [6e9, 6e9]


@pytest.mark.slow
def test_a_model_that_closes_over_values_is_never_the_same_as_another(tmp_path: Path) -> None:
    closed = [_mine(chi=lambda e, c=c: c * (1 - e)) for c in (1.0, 2.0)]
    partly = _mine(chi=functools.partial(lambda e, c: c * (1 - e), c=1.0))
    config = {"models": closed[0].key, "sweep": SWEEP, "solver": COARSE}
    impact.save(impact.sweep(config, plugins=closed[:1]), tmp_path / "result.h5")
    for model in (*closed, partly):
        plan = Plan(read_config(config, (), [model]), read_plugins([model]))
        assert find_finished(tmp_path / "result.h5", plan) is None
        with open_work_folder(tmp_path / "work", plan, Run(overwrite=True)):
            pass
        with (
            pytest.raises(UsageError, match="mine-2026 has no file, so it cannot be compared"),
            open_work_folder(tmp_path / "work", plan, Run(resume=True)),
        ):
            pass
    in_a_file = Plan(read_config({**config, "models": "hertz"}))
    impact.save(impact.sweep({**config, "models": "hertz"}), tmp_path / "hertz.h5")
    assert find_finished(tmp_path / "hertz.h5", in_a_file) is not None


def test_a_force_of_the_wrong_shape_is_an_error_of_the_model() -> None:
    texts = {"key": "short", "title": "", "year": 1, "equation": "", "reference": ""}
    short = impact.ForceModel(**texts, force=lambda elastic, e: (elastic * e)[:1])  # type: ignore[arg-type]
    with pytest.warns(UserWarning, match=r"^model short: the force has shape \(1,\), expected \(2,\)$"):
        status = impact.sweep({"models": "short", "sweep": SWEEP, "solver": COARSE}, plugins=[short])[
            "status"
        ].values
    assert status.tolist() == [[Status.MODEL_ERROR, Status.MODEL_ERROR]]


def test_errors_of_a_law_are_reported_in_the_order_of_the_impacts() -> None:
    kinds = [ValueError, KeyError, TypeError, IndexError, OSError, ArithmeticError, LookupError, RuntimeError]

    def force(elastic: Any, e: Any) -> Any:
        raise kinds[round(10 * e[0])]

    law = impact.ForceModel(key="raises", title="", year=1, equation="", reference="", force=force)
    sweep = {**SWEEP, "e": [0.1 * number for number in range(len(kinds))]}
    with pytest.warns(UserWarning, match="^.*model raises: ") as warned:
        impact.sweep({"models": "raises", "sweep": sweep, "solver": COARSE}, plugins=[law])
    assert [str(warning.message).split(": ")[-2] for warning in warned] == [kind.__name__ for kind in kinds]


def _in_place(e: Any) -> Any:
    e *= 0.999
    return e


ROLES: dict[str, dict[str, Any]] = {
    "force": {"force": lambda elastic, e: elastic * _in_place(e)},
    "force of the motion": {"force": lambda elastic, e: _in_place(elastic)},
    "coefficient": {"coefficients": {"chi": _in_place}, "force": lambda elastic, chi: elastic},
    "unloading": {"unloading": lambda elastic, e: elastic * _in_place(e)},
    "unloading of the peak": {"unloading": lambda elastic, peak: elastic * _in_place(peak)},
    "residual": {"residual": lambda peak: 0.1 * _in_place(peak)},
    "recovered": {"recovered": lambda peak: _in_place(peak)},
    "bend": {"breakpoints": (lambda e: 0.1 * _in_place(e),)},
    "bend of the motion": {"breakpoints": (lambda x, e: x - 0.1 * _in_place(e),)},
    "unloading bend": {
        "unloading": lambda elastic: elastic,
        "unloading_breakpoints": (lambda peak: 0.1 * _in_place(peak),),
    },
    "oracle": {"oracle": _in_place},
}


@pytest.mark.parametrize("formulas", ROLES.values(), ids=ROLES)
def test_a_formula_that_writes_to_its_arguments_is_an_error_of_the_model(formulas: dict[str, Any]) -> None:
    texts = {"key": "writes", "title": "", "year": 1, "equation": "", "reference": ""}
    law = impact.ForceModel(**{**texts, "force": lambda elastic, e: elastic, **formulas})
    with pytest.warns(UserWarning, match="model writes: ValueError: .*read-only"):
        result = impact.sweep({"models": ["writes", "hertz"], "sweep": SWEEP, "solver": COARSE}, plugins=[law])
    assert result["status"].sel(model="writes").values.tolist() == [Status.MODEL_ERROR] * 2
    assert result["status"].sel(model="hertz").values.tolist() == [Status.OK] * 2


def test_a_stiffness_that_writes_to_its_arguments_is_refused() -> None:
    texts = {"key": "writes", "title": "", "year": 1, "equation": "", "reference": ""}
    law = impact.ForceModel(**texts, force=lambda elastic: elastic, stiffness=_in_place_E1)  # type: ignore[arg-type]
    steel = {"E": 2e11, "nu": 0.3, "rho": 7850.0}
    sweep = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "steel"}
    with pytest.raises(ModelError, match="read-only"):
        impact.sweep({"models": "writes", "sweep": sweep, "materials": {"steel": steel}}, plugins=[law])


def _in_place_E1(E1: Any) -> Any:
    return _in_place(E1)


WRONG_TYPES = {
    "nothing": lambda elastic: None,
    "nothing in a list": lambda elastic: [None] * elastic.size,
    "text": lambda elastic: "1.0",
    "complex": lambda elastic: elastic + 1j,
    "date": lambda elastic: np.full(elastic.shape, "2026-01-01", "datetime64[D]"),
}


@pytest.mark.parametrize("force", WRONG_TYPES.values(), ids=WRONG_TYPES)
def test_a_force_that_returns_no_real_numbers_is_an_error_of_the_model(force: Any) -> None:
    texts = {"key": "odd", "title": "", "year": 1, "equation": "", "reference": ""}
    law = impact.ForceModel(**texts, force=force)  # type: ignore[arg-type]
    with pytest.warns(UserWarning, match="model odd: "):
        status = impact.sweep({"models": "odd", "sweep": SWEEP, "solver": COARSE}, plugins=[law])["status"].values
    assert status.tolist() == [[Status.MODEL_ERROR, Status.MODEL_ERROR]]


def test_a_force_may_have_any_real_type() -> None:
    texts = {"title": "", "year": 1, "equation": "", "reference": ""}
    laws = [
        impact.ForceModel(key, force=force, **texts)  # type: ignore[arg-type]
        for key, force in {
            "plain": lambda elastic: elastic,
            "objects": lambda elastic: elastic.astype(object),
            "longdouble": lambda elastic: elastic.astype(np.longdouble),
            "list": lambda elastic: elastic.tolist(),
        }.items()
    ]
    result = impact.sweep({"models": [law.key for law in laws], "sweep": SWEEP, "solver": COARSE}, plugins=laws)
    assert len({result["e_out"].sel(model=law.key).values.tobytes() for law in laws}) == 1


class _Panic(BaseException):
    """As extensions written in Rust raise it."""


@pytest.mark.parametrize("error", [_Panic, GeneratorExit, SystemExit])
def test_an_exception_of_any_class_is_an_error_of_the_model(error: type[BaseException]) -> None:
    def panics(elastic: Any) -> Any:
        raise error("called `Option::unwrap()` on a `None` value")

    texts = {"key": "panics", "title": "", "year": 1, "equation": "", "reference": ""}
    law = impact.ForceModel(**texts, force=panics)  # type: ignore[arg-type]
    with pytest.warns(UserWarning, match=f"model panics: {error.__name__}: called"):
        status = impact.sweep({"models": ["panics", "hertz"], "sweep": SWEEP, "solver": COARSE}, plugins=[law])[
            "status"
        ].values
    assert status.tolist() == [[Status.MODEL_ERROR] * 2, [Status.OK] * 2]


@pytest.mark.parametrize("error", [MemoryError, KeyboardInterrupt])
def test_lack_of_memory_and_an_interrupt_are_no_errors_of_the_model(error: type[BaseException]) -> None:
    def ends(elastic: Any) -> Any:
        raise error

    texts = {"key": "ends", "title": "", "year": 1, "equation": "", "reference": ""}
    law = impact.ForceModel(**texts, force=ends)  # type: ignore[arg-type]
    with pytest.raises(error):
        impact.sweep({"models": "ends", "sweep": SWEEP, "solver": COARSE}, plugins=[law])


def test_an_error_of_the_program_is_not_reported_as_one_of_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise KeyError("of our own")

    monkeypatch.setattr("impact.contact.simulate.integrate_collisions", broken)
    with pytest.raises(KeyError, match="of our own"):
        impact.sweep({"models": "hertz", "sweep": SWEEP, "solver": COARSE})


@pytest.mark.parametrize(
    "act",
    [
        lambda: impact.run(model="bilinear", at={"K": 1e6, "e": 0.5}),
        lambda: impact.run(ROOT / "configs" / "figure6.toml", at={"e": 0.5}),
        lambda: impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": 0.5}, at={"v1": 2.0}),
        lambda: impact.timestep("anagnostopoulos-1988", at={"e": 0.5}, steps_per_contact=[20]),
        lambda: impact.export("opensees", "kelvin-voigt", at={"K": 1e6, "e": 0.6}),
    ],
    ids=["run", "run of a file", "solve", "timestep", "export"],
)
def test_an_act_reads_the_config_once(act: Callable[[], object]) -> None:
    readings = 0

    def count(frame: FrameType, event: str, _: object) -> None:
        nonlocal readings
        readings += event == "call" and frame.f_code is build.__code__

    sys.setprofile(count)
    try:
        act()
    finally:
        sys.setprofile(None)
    assert readings == 1
