"""The JSON Schema accepts and refuses the same values as the reader, key by key.

A schema cannot express rules between keys, names of materials, units in strings and the values with them, and the
number of values of a range.
"""
# ruff: noqa: E501 (messages are kept on one line)

from __future__ import annotations

import copy
import json
import re
from functools import cache
from typing import Any

import jsonschema
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import impact
from impact.config.load import parse_config, read_config
from impact.config.quantities import DISTRIBUTION_FORMS
from impact.errors import ConfigError

GOOD: dict[str, Any] = {
    "models": ["lankarani-nikravesh-1990"],
    "sweep": {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 2.0, "R1": 0.1, "R2": 0.1, "material": "block"},
    "materials": {"block": {"E": 210e9, "nu": 0.3, "rho": 7850.0}},
}
TABLES = {"sweep": "Sweep", "materials.block": "MaterialTable", "solver": "Solver", "output": "Output"}
KEYS = [
    "sweep.e", "sweep.v1", "sweep.m1", "sweep.R1", "sweep.n", "sweep.material", "sweep.zip", "sweep.cases",
    "materials.block.nu", "materials.block.rho", "solver.rtol", "solver.max_steps", "solver.collapse", "output.dtype",
    "output.variables", "output.chunks", "model.kelvin-voigt.C", "title", "models", "frictions", "sweep.angle",
    "sweep.omega1", "sweep.mu", "sweep.inertia_factor1", "friction.coulomb-1785.limit", "friction.lammps-mindlin.k_t",
]  # fmt: skip
# messages about conditions that a schema cannot express
BEYOND = re.compile(
    r"sweep\.cases\.|a unit of|a bare number|got \"\s*[-+.0-9]+[^\"]*[^\"0-9.]|\\x|a material of|on an axis|twice|overflow|two ends|a step other"
    r"|got no value|got a value|an axis|a scalar|no axis|chunks of|no such input|one length|set together with|missing"
    r"|as in the first|not read|cannot be read|not a regular|some model matches|models to exclude|left out again|NUL|64 characters"
    r"|samples such as|in ascending order|expected a median|which needs frictions|without a friction law|did you mean \"[^ ]* deg|friction law|some friction"
)
NUMBERS = st.integers(-3, 12) | st.floats(-2.0, 11.0) | st.floats(allow_nan=False, allow_infinity=False)
ATOMS = (
    NUMBERS | st.booleans() | st.sampled_from(["steel", "1 m/s", "0.5", "1e5", "1 %", "all", "!hertz", "h*", ""])
)
LISTS = st.lists(ATOMS, max_size=4)
ANYTHING = st.one_of(
    ATOMS,
    LISTS,
    st.dictionaries(
        st.sampled_from(["linspace", "arange", "file", "v2", "uniform", "normal", "empirical"]),
        ATOMS | LISTS,
        max_size=2,
    ),
    st.tuples(NUMBERS, NUMBERS, NUMBERS).map(lambda ends: {"linspace": list(ends)}),
)


# not at import: it takes as long as the collection of many tests
@cache
def schema_of_configs() -> dict[str, Any]:
    return impact.schema()


@cache
def validator_of_configs() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(schema_of_configs())


def test_bounds_of_numbers_are_written_alike() -> None:
    """Types are cached, and 0 = 0.0: the text would depend on which was asked for first."""
    objects = re.findall(r'{[^{}]*"type": "number"[^{}]*}', json.dumps(schema_of_configs()))
    bounds = {bound for text in objects for bound in re.findall(r'[mM](?:in|ax)imum": ([^,}]+)', text)}
    assert "0.0" in bounds
    assert not [bound for bound in bounds if re.fullmatch(r"-?[0-9]+", bound)]


def values(schema: dict[str, Any], definitions: dict[str, Any]) -> st.SearchStrategy[Any]:
    """Values that a schema of the kinds used here accepts."""
    if "$ref" in schema:
        return values(definitions[schema["$ref"].rpartition("/")[2]], definitions)
    choices = schema.get("anyOf") or schema.get("oneOf")
    if choices:
        return st.one_of([values(choice, definitions) for choice in choices])
    if "enum" in schema:
        return st.sampled_from(schema["enum"])
    match schema["type"]:
        case "number":
            above = schema.get("exclusiveMinimum")
            low, high = schema.get("minimum", above), schema.get("maximum")
            below = schema.get("exclusiveMaximum")
            ends = {"exclude_min": above is not None, "exclude_max": below is not None}
            return st.floats(low, below if high is None else high, allow_nan=False, allow_infinity=False, **ends)
        case "integer":
            return st.integers(schema.get("minimum"), schema.get("maximum"))
        case "boolean":
            return st.booleans()
        case "string":
            return st.from_regex(schema["pattern"]) if "pattern" in schema else st.text(max_size=9)
        case "array" if "prefixItems" in schema:
            return st.tuples(*(values(item, definitions) for item in schema["prefixItems"])).map(list)
        case "array":
            return st.lists(values(schema["items"], definitions), min_size=schema.get("minItems", 0), max_size=4)
    if "properties" not in schema:
        rest = values(schema["additionalProperties"], definitions)
        return st.dictionaries(
            st.sampled_from(["e", "v2"]), rest, min_size=schema.get("minProperties", 0), max_size=2
        )
    entries = {name: values(entry, definitions) for name, entry in schema["properties"].items()}
    if schema.get("maxProperties") == 1:
        return st.one_of([st.fixed_dictionaries({name: entry}) for name, entry in entries.items()])
    return st.fixed_dictionaries(entries)


def part(key: str) -> dict[str, Any]:
    """The schema of a key, with the definitions that it refers to."""
    table, _, name = key.rpartition(".")
    whole = schema_of_configs()
    by_name = whole["$defs"]
    table = TABLES.get(table, table.removeprefix("model.").replace("friction.", "friction_"))
    schema = (by_name[table] if table else whole)["properties"][name]
    definitions = {used: by_name[used] for used in re.findall(r"#/\$defs/([^']*)'", str(schema))}
    return {**schema, "$defs": definitions}


def with_value(key: str, value: object) -> dict[str, Any]:
    data = copy.deepcopy(GOOD)
    table = data
    *tables, name = key.split(".")
    for step in tables:
        table = table.setdefault(step, {})
    table[name] = value
    if isinstance(value, dict) and not DISTRIBUTION_FORMS.keys().isdisjoint(value):
        data["design"] = {"n": 4}
    return data


def faults_at(key: str, data: dict[str, Any]) -> list[str]:
    """The problems of a key."""
    try:
        read_config(data)
    except ConfigError as error:
        lines = [line.removeprefix("config: ") for line in error.problems]
        # a missing file is named without its key
        return [line for line in lines if line.startswith(key) or "cannot be read" in line or "regular" in line]
    return []


@pytest.mark.parametrize("key", KEYS)
def test_reader_and_schema_agree_on_a_key(key: str, tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    schema = part(key)
    validator = jsonschema.Draft202012Validator(schema)

    @settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))
    @given(values(schema, schema_of_configs()["$defs"]) | ANYTHING)
    def check(value: object) -> None:
        data = with_value(key, value)
        faults = faults_at(key, data)
        if not validator.is_valid(value):
            assert faults, "the schema refuses what the reader accepts"
        else:
            beyond = [line for line in faults if not BEYOND.search(line)]
            assert not beyond, "the reader refuses what the schema accepts"

    check()


@pytest.mark.parametrize(
    "table",
    ["", "sweep", "materials.block", "solver", "output", "model", "model.kelvin-voigt", "friction.coulomb-1785"],
)
def test_an_unknown_key_is_refused_by_both(table: str) -> None:
    key = f"{table}.x9" if table else "x9"
    data = with_value(key, 1)
    assert not validator_of_configs().is_valid(data)
    assert any("x9: unknown key" in line for line in faults_at(key, data))


def test_schema_requires_what_the_reader_requires() -> None:
    for key in ("models", "sweep", "sweep.v1", "sweep.m1", "materials.block.E", "materials.block.nu"):
        data = copy.deepcopy(GOOD)
        data["sweep"].pop("R1")
        table: Any = data
        *tables, name = key.split(".")
        for step in tables:
            table = table[step]
        del table[name]
        assert not validator_of_configs().is_valid(data), key
        with pytest.raises(ConfigError, match=f"{key}: missing|models: got nothing"):
            read_config(data)


def test_a_stored_table_of_cases_is_in_the_schema() -> None:
    data = copy.deepcopy(GOOD)
    data["sweep"] |= {"cases": {"v1": [1.0, 2.0], "m1": ["1 g", "2 g"]}}
    del data["sweep"]["v1"], data["sweep"]["m1"]
    assert validator_of_configs().is_valid(data)
    config = read_config(data)
    assert parse_config(config.text, config.overrides) == config


DATA_NUMBERS = st.integers(-1, 3) | st.floats(-1.0, 2.0) | st.sampled_from(["0.5", "1 s", "x", True, None])
FIT_VALUES: dict[str, Any] = {
    "e": st.fixed_dictionaries({"fit": st.lists(DATA_NUMBERS, max_size=3) | DATA_NUMBERS}, optional={"x9": st.just(1)}),
    "sigma": DATA_NUMBERS | st.lists(DATA_NUMBERS, max_size=3) | st.just({"fit": [0, 1]}),
    "noise": st.sampled_from(["given", "scale", "excess", "normal", 1]),
    "loss": st.sampled_from(["linear", "huber", "cauchy", "square", 1]),
    "file": st.sampled_from(["drops.csv", 1, ["drops.csv"]]),
    "lines": st.lists(st.integers(-1, 9), max_size=3) | DATA_NUMBERS,
    "columns": st.dictionaries(st.sampled_from(["v1", "e_out"]), DATA_NUMBERS | st.lists(DATA_NUMBERS, max_size=3), max_size=2),
}  # fmt: skip
# conditions that a JSON Schema does not express
BEYOND_DATA = (
    "least < most",
    "a bare number",
    "a unit of",
    "values, expected",
    "no column of an output",
    "not read",
    "got headers, expected a file",
    "got nothing, expected a value",
    "percent?",
)
BEYOND_DATA += (
    "without standard deviations",
    "set together with",
    'got "',
    "number from -0.5 to 1.5",
    "expected a fraction",
    "missing, expected",
    "expected v1 > v2",
)


@pytest.mark.slow
@pytest.mark.parametrize("key", FIT_VALUES)
def test_reader_and_schema_agree_on_a_calibration(key: str) -> None:
    @settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
    @given(FIT_VALUES[key])
    def check(value: object) -> None:
        data: dict[str, Any] = {"columns": {"v1": [1.0, 2.0], "e_out": [0.5, 0.5]}}
        fits: object = {"fit": [0, 1]}
        if key == "e":
            fits = value
        elif key == "file":
            data = {"file": value}
        else:
            data[key] = value
        config = {
            "models": "lankarani-nikravesh-1990",
            "data": data,
            "sweep": {"e": fits, "m1": 1.0, "m2": 1.0, "R1": 1.0, "R2": 1.0, "material": "steel"},
        }
        problems: list[str] = []
        try:
            parse_config(json.dumps(config), purpose="calibrate")
        except ConfigError as error:
            problems = list(error.problems)
        if validator_of_configs().is_valid(config):
            unexpected = [line for line in problems if not any(text in line for text in BEYOND_DATA)]
            assert not unexpected, "the reader refuses what the schema accepts"
        else:
            assert problems, "the schema refuses what the reader accepts"

    check()


def test_schema_requires_the_speed_of_a_sweep_but_not_of_measurements() -> None:
    sweep = {"e": 0.5, "m1": 1.0, "m2": 1.0, "material": "steel"}
    config: dict[str, Any] = {"models": "hertz", "sweep": sweep}
    assert not validator_of_configs().is_valid(config)
    assert validator_of_configs().is_valid({**config, "data": {"file": "drops.csv"}})
    assert not validator_of_configs().is_valid({**config, "data": {"noise": "scale"}})
