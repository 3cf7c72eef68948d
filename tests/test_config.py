"""A config is read, or refused with one line for each problem: file, line, key, what it got, what it expected."""
# ruff: noqa: E501 (messages are kept whole, so that they can be searched for)

import json
import math
import re
import subprocess
import sys
import tomllib
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import impact
from impact.config.load import Config, parse_config, read_config
from impact.config.tables import Output, Solver, expand_laws
from impact.contact.materials import Material
from impact.contact.model import Parameter
from impact.contact.models import catalogue
from impact.errors import ConfigError
from impact.formatting import escape_controls, safe_text

from .conftest import ROOT, new_law, problems_of
from .test_schema_agrees import schema_of_configs, validator_of_configs

# what a user of the command line reads
pytestmark = pytest.mark.usefixtures("command_line_words")

FIGURE6 = ROOT / "configs" / "figure6.toml"
STARTER = ROOT / "src" / "impact" / "config" / "starter.toml"

GOOD = """\
title = "Good"
models = ["lankarani-nikravesh-1990"]
[sweep]
e = 0.5
v1 = 1.0
m1 = 1.0
m2 = 2.0
material = "steel"
[materials.steel]
E = 210e9
nu = 0.3
rho = 7850
"""


# models that need a yield strength or a radius, with another exponent, and with parameters
PLASTIC = new_law("test-plastic", lambda elastic, yield_strength1, yield_strength2: elastic + 0 * yield_strength1)
RADIUS = new_law("test-radius", lambda elastic, R1: elastic * R1)
LINEAR = new_law("test-linear", lambda elastic: elastic, exponent=1.0)
SQUARE = new_law("test-square", lambda elastic: elastic, exponent=2.0)
DRIVEN = new_law(
    "test-driven",
    lambda elastic, S, c: elastic * S * c,
    parameters=(
        Parameter("S", "N/m^n", "stiffness of the test", least=1.0),
        Parameter("c", "1", "ratio", 2.0, 1, 9),
    ),
)
PLUGINS = (PLASTIC, RADIUS, LINEAR, SQUARE, DRIVEN)


def changed(old: str = "", new: str = "") -> str:
    assert old in GOOD
    return GOOD.replace(old, new, 1)


def read(text: str, *overrides: str) -> Config:
    return parse_config(text, overrides, PLUGINS, name="x.toml")


def problems(text: str, *overrides: str) -> list[str]:
    return problems_of(read, text, *overrides)


E_EXPECTED = "expected a number from 0 to 1"
MASS = "expected a number > 0 kg, or inf"
SPEED = "expected a finite number of m/s"
UNIT = ', bare or with a unit, such as "1 m/s"'
KNOWN = ", ".join(sorted(impact.materials()))
MANY = "more than 1,000,000,000,000,000,000"
LONG = "1" + "0" * 400

# a text of GOOD, its replacement, and the lines of the error
BAD = [
    # a number that is none, or is not in its interval
    ("e = 0.5", "e = 1.4", [f"x.toml:4: sweep.e: got 1.4, {E_EXPECTED}"]),
    ("e = 0.5", "e = -1e-9", [f"x.toml:4: sweep.e: got -1e-09, {E_EXPECTED}"]),
    ("e = 0.5", "e = nan", [f"x.toml:4: sweep.e: got nan, {E_EXPECTED}"]),
    ("e = 0.5", "e = true", [f"x.toml:4: sweep.e: got true, {E_EXPECTED}"]),
    ("e = 0.5", 'e = "0.5"', [f'x.toml:4: sweep.e: got "0.5", {E_EXPECTED}, without quotes']),
    ("e = 0.5", "e = 2020-01-01", [f"x.toml:4: sweep.e: got 2020-01-01, {E_EXPECTED}"]),
    ("e = 0.5", "e = 07:32:00", [f"x.toml:4: sweep.e: got 07:32:00, {E_EXPECTED}"]),
    ("v1 = 1.0", "v1 = 1e400", [f"x.toml:5: sweep.v1: got inf, {SPEED}"]),
    ("v1 = 1.0", f"v1 = {LONG}", [f"x.toml:5: sweep.v1: got an integer of 1329 bits, {SPEED}"]),
    ("m1 = 1.0", "m1 = 0", [f"x.toml:6: sweep.m1: got 0, {MASS}"]),
    ("m1 = 1.0", "m1 = -inf", [f"x.toml:6: sweep.m1: got -inf, {MASS}"]),
    ("m1 = 1.0", "m1 = nan", [f"x.toml:6: sweep.m1: got nan, {MASS}"]),
    ("m1 = 1.0", "m1 = 1\nR1 = 0", ["x.toml:7: sweep.R1: got 0, expected a number > 0 m, or inf"]),
    ("e = 0.5", "alpha = inf", ["x.toml:4: sweep.alpha: got inf, expected a number >= 0 s/m"]),
    ("e = 0.5", "e = 0.5\nK = inf", ["x.toml:5: sweep.K: got inf, expected a number > 0 N/m^n"]),
    ("e = 0.5", "e = 0.5\nn = 0.9", ["x.toml:5: sweep.n: got 0.9, expected a number from 1 to 10"]),
    ("nu = 0.3", "nu = 0.7",
     ["x.toml:11: materials.steel.nu: got 0.7, expected a number > -1 and <= 0.5"]),
    ("nu = 0.3", "nu = -1",
     ["x.toml:11: materials.steel.nu: got -1, expected a number > -1 and <= 0.5"]),
    ("E = 210e9", "E = [1e9, 0]", ["x.toml:10: materials.steel.E[1]: got 0, expected a number > 0 Pa"]),
    ("rho = 7850", "rho = inf", ["x.toml:12: materials.steel.rho: got inf, expected a number > 0 kg/m^3"]),
    ("rho = 7850", "rho = 7850\nyield_strength = 0",
     ["x.toml:13: materials.steel.yield_strength: got 0, expected a number > 0 Pa"]),
    # a string with a unit
    ("v1 = 1.0", 'v1 = "1"',
     [f'x.toml:5: sweep.v1: got "1", {SPEED}, without quotes or with a unit, such as "1 m/s"']),
    ("m1 = 1.0", 'm1 = "inf"',
     [f'x.toml:6: sweep.m1: got "inf", {MASS}, without quotes or with a unit, such as "1 kg"']),
    ("v1 = 1.0", 'v1 = "fast"', [f'x.toml:5: sweep.v1: got "fast", {SPEED}{UNIT}']),
    ("v1 = 1.0", 'v1 = "1 kg"', ['x.toml:5: sweep.v1: got "1 kg", expected a unit of m/s, such as "1 m/s"']),
    ("v1 = 1.0", 'v1 = "nan m"', ['x.toml:5: sweep.v1: got "nan m", expected a unit of m/s, such as "1 m/s"']),
    ("v1 = 1.0", 'v1 = "1e400 m/s"', [f'x.toml:5: sweep.v1: got "1e400 m/s", {SPEED}']),
    ("v1 = 1.0", 'v1 = "20 degC"',
     ['x.toml:5: sweep.v1: got "20 degC", expected a unit of m/s, such as "1 m/s"; "degC" is not a known unit']),
    ("v1 = 1.0", 'v1 = "2,5 m/s"',
     ['x.toml:5: sweep.v1: got "2,5 m/s", expected a number with a decimal point and no comma']),
    ("v1 = 1.0", 'v1 = "1 foo/s"',
     ['x.toml:5: sweep.v1: got "1 foo/s", expected a unit of m/s, such as "1 m/s"; "foo/s" is not a known unit']),
    ("v1 = 1.0", 'v1 = "1 m/s**1e9"',
     ['x.toml:5: sweep.v1: got "1 m/s**1e9", expected a unit of m/s, such as "1 m/s"; ' '"m/s**1e9" is not a known unit']),
    ("v1 = 1.0", "v1 = \"__import__('os')\"",
     [f"x.toml:5: sweep.v1: got \"__import__('os')\", {SPEED}{UNIT}"]),
    ("v1 = 1.0", f'v1 = "1 {"(" * 40}m{")" * 40}"',
     [f'x.toml:5: sweep.v1: got "1 {"(" * 40}m{")" * 16}…", expected at most 64 characters']),
    ("v1 = 1.0", f'v1 = "1 {"(" * 9}m/s{")" * 9}"',
     [f'x.toml:5: sweep.v1: got "1 {"(" * 9}m/s{")" * 9}", expected a unit of m/s, such as "1 m/s"; ' f'"{"(" * 9}m/s{")" * 9}" is not a known unit']),
    ("e = 0.5", 'e = "1 m"', ['x.toml:4: sweep.e: got "1 m", expected a bare number']),
    ("e = 0.5", 'e = "3 dB"',
     ['x.toml:4: sweep.e: got "3 dB", expected a bare number; "dB" is not a known unit']),
    ("e = 0.5", 'e = 0.5\nK = "1 N/m"',
     ['x.toml:5: sweep.K: got "1 N/m", expected a unit of N/m^n with n = 1.5']),
    ("e = 0.5", 'e = 0.5\nK = "1 N/m^2"\nn = [1.5, 2]',
     ['x.toml:5: sweep.K: got "1 N/m^2", expected a bare number: its unit N/m^n depends on n, which varies',
      "x.toml:5: sweep.K: its unit N/m^n depends on n, which is an axis; expected one K for each n, zipped with it"]),
    # lists and ranges
    ("e = 0.5", "e = []",
     [f"x.toml:4: sweep.e: got an empty list, expected a list of at least one: {E_EXPECTED[9:]}"]),
    ("e = 0.5", "e = [\n  0.5,\n  1.5, [1],\n  true]",
     [f"x.toml:6: sweep.e[1]: got 1.5, {E_EXPECTED}",
      f"x.toml:6: sweep.e[2]: got a list, {E_EXPECTED}",
      f"x.toml:7: sweep.e[3]: got true, {E_EXPECTED}"]),
    ("m2 = 2.0", "m2 = [1, 2, 1.0]", ["x.toml:7: sweep.m2[2]: got 1.0 twice, expected each value once"]),
    ("e = 0.5", "e = [0.0, -0.0]", ["x.toml:4: sweep.e[1]: got 0.0 twice, expected each value once"]),
    ('"steel"', '["steel", "steel"]',
     ['x.toml:8: sweep.material[1]: got "steel" twice, expected each value once']),
    ("e = 0.5", "e = {}",
     ["x.toml:4: sweep.e: got an empty table, expected one of linspace = [first, last, count], " "geomspace = [first, last, count], arange = [first, stop, step]"]),
    ("e = 0.5", "e = { linspace = [0, 1, 3], arange = [0, 1, 1] }",
     ["x.toml:4: sweep.e: got linspace and arange, expected one of linspace = [first, last, count], " "geomspace = [first, last, count], arange = [first, stop, step]"]),
    ("e = 0.5", "e = { linspac = [0, 1, 3] }",
     ['x.toml:4: sweep.e.linspac: unknown key; did you mean "linspace"?']),
    ("e = 0.5", "e = { logspace = [0, 1, 3] }",
     ['x.toml:4: sweep.e.logspace: unknown key; did you mean "geomspace"?']),
    ("e = 0.5", "e = { linspace = [0, 1] }",
     ["x.toml:4: sweep.e.linspace: got a list of 2, expected [first, last, count]"]),
    ("e = 0.5", "e.arange = 3", ["x.toml:4: sweep.e.arange: got 3, expected [first, stop, step]"]),
    ("e = 0.5", "e = { linspace = [0, 1.5, 2.5] }",
     [f"x.toml:4: sweep.e.linspace[1]: got 1.5, {E_EXPECTED}",
      "x.toml:4: sweep.e.linspace[2]: got 2.5, expected a whole number of at least 1"]),
    ("m1 = 1.0", "m1 = { linspace = [1, inf, 3] }",
     ["x.toml:6: sweep.m1.linspace[1]: got inf, expected a number > 0 kg"]),
    ("e = 0.5", "e = { linspace = [1, 1, 3] }",
     ["x.toml:4: sweep.e.linspace: got 1.0 twice, expected each value once"]),
    ("v1 = 1.0", "v1 = { linspace = [-1e308, 1e308, 3] }",
     ["x.toml:5: sweep.v1.linspace: got -1e+308 to 1e+308, expected a range that does not overflow"]),
    ("e = 0.5", "e = { geomspace = [0, 1, 3] }",
     ["x.toml:4: sweep.e.geomspace: got 0 to 1, expected two ends of the same sign, neither of them 0"]),
    ("v1 = 1.0", "v1 = { geomspace = [-1, 1, 3] }",
     ["x.toml:5: sweep.v1.geomspace: got -1 to 1, expected two ends of the same sign, neither of them 0"]),
    ("e = 0.5", "e = { arange = [0, 1, 0] }",
     ["x.toml:4: sweep.e.arange[2]: got 0, expected a step other than 0"]),
    ("e = 0.5", "e = { arange = [0, 1, nan] }",
     ["x.toml:4: sweep.e.arange[2]: got nan, expected a finite number"]),
    ("e = 0.5", "e = { arange = [0, 1, -0.1] }",
     ["x.toml:4: sweep.e.arange: got no value from 0 to 1 by -0.1, expected at least one"]),
    ("e = 0.5", "e = { arange = [0, 3, 0.5] }", [f"x.toml:4: sweep.e.arange: got a value 2.5, {E_EXPECTED}"]),
    # more points than there can be, refused before any of them exists
    ("e = 0.5", "e = { linspace = [0, 1, 1e12] }",
     ["x.toml:4: sweep.e.linspace: got 1,000,000,000,000 values, expected at most 10,000,000 on an axis"]),
    ("e = 0.5", f"e = {{ linspace = [0, 1, {LONG}] }}",
     [f"x.toml:4: sweep.e.linspace: got {MANY} values, expected at most 10,000,000 on an axis"]),
    ("e = 0.5", "e = { arange = [0, 1, 1e-320] }",
     [f"x.toml:4: sweep.e.arange: got {MANY} values, expected at most 10,000,000 on an axis"]),
    # names
    ('title = "Good"', "title = 3", ["x.toml:1: title: got 3, expected text"]),
    ('["lankarani-nikravesh-1990"]', '["hetrz"]',
     ['x.toml:2: models[0]: got "hetrz", expected a model; did you mean "hertz"?']),
    ('["lankarani-nikravesh-1990"]', '"family:hystersis"',
     ['x.toml:2: models: got "family:hystersis", expected a family of models; did you mean "hysteresis"?']),
    ('["lankarani-nikravesh-1990"]', '["hertz", "x-*", 3]',
     ['x.toml:2: models[1]: got "x-*", expected a pattern that some model matches',
      "x.toml:2: models[2]: got 3, expected the name of a model"]),
    ('["lankarani-nikravesh-1990"]', "[]",
     ['x.toml:2: models: got an empty list, expected a model, or a list of models; "all" are all']),
    ('"steel"', '"stell"',
     ['x.toml:8: sweep.material: got "stell", expected a material of [materials]; did you mean "steel"?']),
    ('"steel"', "3", ["x.toml:8: sweep.material: got 3, expected the name of a material of [materials]"]),
    # unknown, missing and misplaced keys
    ("e = 0.5", "e = 0.5\nmasss1 = 3", ['x.toml:5: sweep.masss1: unknown key; did you mean "m1"?']),
    ("e = 0.5", "e = 0.5\nmodel = 'hertz'\nfrictons = 'none'",
     ['x.toml:5: sweep.model: unknown key; did you mean "models", before all tables?',
      'x.toml:6: sweep.frictons: unknown key; did you mean "frictions", before all tables?']),
    ("m1 = 1.0", "m1 = 1.0\nr1 = 3", ['x.toml:7: sweep.r1: unknown key; did you mean "R1"?']),
    ("[materials", "[materails",
     ['x.toml:9: materails: unknown key; did you mean "materials"?']),
    ("nu = 0.3", "nuu = 0.3",
     ["x.toml:9: materials.steel.nu: missing, expected a number > -1 and <= 0.5: Poisson's ratio",
      'x.toml:11: materials.steel.nuu: unknown key; did you mean "nu"?']),
    ("m2 = 2.0\n", "",
     ["x.toml:3: sweep.m2: missing, expected a number > 0 kg, or inf: mass of ball 2; or R2 and a material with rho"]),
    ("[sweep]\n", "",
     ['x.toml: sweep: missing, expected a table [sweep] of what to sweep: e or alpha, v1, m1, m2, material, ...',
      *(f"x.toml:{line}: {key}: unknown key; it belongs under [sweep]" for line, key in ((3, "e"), (4, "v1"), (5, "m1"), (6, "m2"))),
      'x.toml:7: material: unknown key; it belongs under [sweep]']),
    ("e = 0.5", "E = 1e9\nrtol = 1e-9\ntitle = 'x'\nC = 3\nk_t = 1e6\ne = 0.5",
     [f"x.toml:{line}: sweep.{key}: unknown key; it belongs {home}" for line, key, home in (
         (4, "E", "under [materials.NAME]"), (5, "rtol", "under [solver]"), (6, "title", "before all tables"),
         (7, "C", "under [model.KEY], where KEY is that of its law"),
         (8, "k_t", "under [friction.KEY], where KEY is that of its law"))]),
    ("nu = 0.3", "nu = 0.3\nK = 1e9", ["x.toml:12: materials.steel.K: unknown key; it belongs under [sweep]"]),
    ("rho = 7850", "rho = 7850\n[solver]\ncollapse = 1",
     ["x.toml:14: solver.collapse: got 1, expected true or false"]),
    ("rho = 7850", "rho = 7850\n[solver]\nrtol = 1\nmax_steps = 0\nrotl = 1",
     ["x.toml:14: solver.rtol: got 1, expected a number from 1e-13 to 0.0001",
      "x.toml:15: solver.max_steps: got 0, expected a whole number from 1 to 1,000,000,000",
      'x.toml:16: solver.rotl: unknown key; did you mean "rtol"?']),
    ("rho = 7850", "rho = 7850\n[output]\nvariables = [1]",
     ["x.toml:14: output.variables[0]: got 1, expected the name of a variable of the result"]),
    ("rho = 7850", 'rho = 7850\n[output]\nvariables = ["e_ut"]',
     ['x.toml:14: output.variables[0]: got "e_ut", expected a variable of the result; did you mean "e_out"?']),
    ("rho = 7850", "rho = 7850\n[[solver]]", ["x.toml:13: solver: got a list, expected a table"]),
    ("rho = 7850", "rho = 7850\n[materials]\nsteal = 3",
     ["x.toml:14: materials.steal: got 3, expected a table"]),
    # rules between keys
    ("e = 0.5", "e = 0.5\nalpha = 0.1", ["x.toml:5: sweep.alpha: set together with e, expected one of the two"]),
    ("e = 0.5\n", "",
     ["x.toml:3: sweep.e: missing, expected e or alpha (used by lankarani-nikravesh-1990), or other models"]),
    ('material = "steel"\n', "",
     ["x.toml:3: sweep.material: missing, expected a material of [materials], or K"]),
    ("material =", "material1 =",
     ["x.toml:3: sweep.material2: missing, expected both, as material1 is set; or material for both balls"]),
    ('"steel"', '"steel"\nmaterial2 = "steel"',
     ["x.toml:9: sweep.material2: set together with material, expected either material, or material1 and material2"]),
    ('["lankarani-nikravesh-1990"]\n[sweep]', '["hertz", "test-linear"]\n[sweep]\nK = 1',
     ["x.toml:4: sweep.K: got a stiffness for n = 1.5, but test-linear has n = 1; "
      "expected n = 1 under [sweep], K under [model.test-linear], or no K"]),
    ('["lankarani-nikravesh-1990"]\n[sweep]', '["test-linear", "test-square"]\n[sweep]\nK = 1',
     [f"x.toml:4: sweep.K: got a stiffness for n = 1.5, but {key} has n = {n}; expected K under [model.{key}], or no K"
      for key, n in (("test-linear", 1), ("test-square", 2))]),
    ('["lankarani-nikravesh-1990"]\n[sweep]', '["test-linear"]\n[sweep]\nK = 1\nn = [1, 2]',
     ["x.toml:4: sweep.K: its unit N/m^n depends on n, which is an axis; expected one K for each n, zipped with it",
      "x.toml:4: sweep.K: got a stiffness for an axis n, but test-linear has n = 1; " "expected K under [model.test-linear], or no K"]),
    ('["lankarani-nikravesh-1990"]', '["test-plastic"]',
     ["x.toml:9: materials.steel.yield_strength: missing, expected a number > 0 Pa (used by test-plastic), "
      "or other models"]),
    ('["lankarani-nikravesh-1990"]', '["test-driven"]',
     ["x.toml:2: model.test-driven.S: missing, expected a number >= 1 N/m^n: stiffness of the test"]),
    ("rho = 7850\n", "",
     ["x.toml:9: materials.steel.rho: missing, expected a number > 0 kg/m^3, or R1 and R2 under [sweep]: "
      "lankarani-nikravesh-1990 needs a radius"]),
    # zip
    ("e = 0.5", "e = [0, 1]\nzip = 3",
     ['x.toml:5: sweep.zip: got 3, expected a list of groups of names, such as [["m1", "m2"]]']),
    ("e = 0.5", 'e = [0, 1]\nzip = [["e"], "m1", ["e", 1]]',
     ["x.toml:5: sweep.zip[0]: got a list, expected a group of at least two names",
      'x.toml:5: sweep.zip[1]: got "m1", expected a group of at least two names',
      "x.toml:5: sweep.zip[2][1]: got 1, expected a name"]),
    ("e = 0.5\nv1 = 1.0", 'e = [0, 1]\nv1 = [1, 2, 3]\nzip = [["e", "v1"], ["m1", "e"], ["v9", "m2"]]',
     ["x.toml:6: sweep.zip[0]: got e of 2, v1 of 3 values, expected axes of one length",
      'x.toml:6: sweep.zip[1][0]: got "m1", which is a scalar, expected an axis: a list or a range',
      'x.toml:6: sweep.zip[1][1]: got "e" twice, expected each name once',
      'x.toml:6: sweep.zip[2][0]: got "v9", expected an axis; known: e, v1',
      'x.toml:6: sweep.zip[2][1]: got "m2", which is a scalar, expected an axis: a list or a range']),
    ("e = 0.5", 'e = [0, 1]\nzip = [["e", "materials.steel.E"]]',
     ['x.toml:5: sweep.zip[0][1]: got "materials.steel.E", which is a scalar, expected an axis: a list or a range']),
    # parameters of models, also of those that are not chosen
    ("rho = 7850", "rho = 7850\n[model.hetrz]",
     ['x.toml:13: model.hetrz: unknown key; did you mean "hertz"?']),
    ("rho = 7850", "rho = 7850\n[model.hertz]\nS = 1",
     ["x.toml:14: model.hertz.S: unknown key; none are defined"]),
    ("rho = 7850", 'rho = 7850\n[model.test-driven]\nS = "1 N/m"\nc = [1, 10]\nd = 1',
     ['x.toml:14: model.test-driven.S: got "1 N/m", expected a unit of N/m^n with n = 1.5',
      "x.toml:15: model.test-driven.c[1]: got 10, expected a number from 1 to 9",
      "x.toml:16: model.test-driven.d: unknown key; known: S, c"]),
    # what is not TOML, or not worth parsing
    ("e = 0.5", "e = ", ["x.toml:4: not TOML: Invalid value: e ="]),
    ("e = 0.5", "e = 0.5\ne = 0.6", ["x.toml:5: not TOML: Cannot overwrite a value: e = 0.6"]),
    ("e = 0.5", "e = 0.5\a",
     ["x.toml:4: not TOML: Expected newline or end of document after a statement: e = 0.5\\x07"]),
    ("e = 0.5", "e = " + "1" * 5000, ["x.toml:4: not TOML: a number of thousands of digits"]),
    ("e = 0.5", "e" + ".e" * 20_000 + " = 1", [f"x.toml:4: a key of more than 64 dots: {'e.' * 19}e…"]),
    ("e = 0.5", "e = { e" + ' . "\\""' * 20_000 + " = 1 }",
     ["x.toml:4: a key of more than 64 dots: e" + ' . "\\""' * 5 + " . …"]),
    ("e = 0.5", "e = " + "[" * 100_000, ["x.toml:4: nested too deeply, expected at most 8 levels"]),
    ("e = 0.5", "e = " + "{e=" * 100_000, ["x.toml:4: nested too deeply, expected at most 8 levels"]),
    ("e = 0.5", "e = " + "[" * 9 + "]" * 9,
     ["x.toml:4: sweep.e[0][0][0][0][0][0]: nested too deeply, expected at most 8 levels"]),
    ("e = 0.5", "e = 0.5\n#" + "x" * 1_000_000, ["x.toml: larger than 1,000,000 characters"]),
    # characters that steer a terminal, or that no file can store
    ('"Good"', '"a\\u0000"', ['x.toml:1: title: got "a\\x00", expected text without NUL and lone surrogates']),
    ('"steel"', '"\\u001b[31m\\u202e"',
     ['x.toml:8: sweep.material: got "\\x1b[31m\\u202e", expected a material of [materials]; known: ' + KNOWN]),
    ("e = 0.5", 'e = 0.5\n"\\u001b]0;" = 1',
     ['x.toml:5: sweep."\\x1b]0;": unknown key; ' "known: K, R1, R2, alpha, angle, cases, dt, e, inertia_factor1, inertia_factor2, m1, m2, material, material1, "
      "material2, mu, n, omega1, omega2, phase, speed, steps_per_contact, u1, u2, v1, v2, zip"]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "lines"), BAD, ids=[f"{i}-{new[:30]}" for i, (_, new, _) in enumerate(BAD)]
)
def test_a_wrong_config_is_refused_with_a_line_for_each_problem(old: str, new: str, lines: list[str]) -> None:
    assert problems(changed(old, new)) == lines


def test_points_are_bounded_where_all_of_them_are_stored() -> None:
    text = changed("e = 0.5\nv1 = 1.0", "e = { linspace = [0, 1, 50000] }\nv1 = { geomspace = [1, 2, 50000] }")
    assert problems(text, 'output.layout="full"') == [
        "x.toml:3: sweep: got 2,500,000,000 points (axes times models), up to 400 GB, expected at most 1,000,000,000 "
        'points in layout "full" (--max-points); layout = "factored" stores any number'
    ]
    assert len(read(text).axes) == 2


def test_all_problems_come_in_file_order_and_then_those_of_overrides() -> None:
    text = changed("v1 = 1.0\nm1 = 1.0", "v1 = []\nm1 = -1").replace("nu = 0.3", "nu = 3")
    assert problems(text, "title=1", "sweep.m2=0", "nonsense", "sweep.x y=1") == [
        f"x.toml:5: sweep.v1: got an empty list, expected a list of at least one: {SPEED[9:]}",
        f"x.toml:6: sweep.m1: got -1, {MASS}",
        "x.toml:11: materials.steel.nu: got 3, expected a number > -1 and <= 0.5",
        "--set title=1: title: got 1, expected text",
        f"--set sweep.m2=0: sweep.m2: got 0, {MASS}",
        "--set nonsense: expected PATH=VALUE, such as sweep.e=0.5",
        "--set sweep.x y=1: expected PATH=VALUE, such as sweep.e=0.5",
    ]


def test_many_problems_are_cut_short() -> None:
    lines = problems(changed("e = 0.5", "e = 0.5\n" + "\n".join(f"x{i} = 1" for i in range(1000))))
    assert len(lines) == 101
    assert lines[-1] == "and 900 more"


OVERRIDDEN = [
    (["sweep.e=1.4"], f"--set sweep.e=1.4: sweep.e: got 1.4, {E_EXPECTED}"),
    (["sweep.e=[0,\n2]"], f"--set sweep.e=[0,\\x0a2]: sweep.e[1]: got 2, {E_EXPECTED}"),
    (["sweep.e.linspace=[0,2,3]"], f"--set sweep.e.linspace=[0,2,3]: sweep.e.linspace[1]: got 2, {E_EXPECTED}"),
    (["sweep.e.linspace=[0,0,3]"],
     "--set sweep.e.linspace=[0,0,3]: sweep.e.linspace: got 0.0 twice, expected each value once"),
    (["sweep.e.linspace=[0,1"],
     '--set sweep.e.linspace=[0,1: sweep.e.linspace: got "[0,1", expected [first, last, count]'),
    (["sweep.m1=3\nv2=2"],
     '--set sweep.m1=3\\x0av2=2: sweep.m1: got "3\\x0av2=2", expected a unit of kg, such as "1 kg"; '
     '"v2=2" is not a known unit'),
    (["sweep.material=cooper"],
     '--set sweep.material=cooper: sweep.material: got "cooper", expected a material of [materials]; did you mean "copper"?'),
    (["sweep.e=3", "sweep.e=4"], f"--set sweep.e=4: sweep.e: got 4, {E_EXPECTED}"),
    (["sweep.e=" + "[" * 9 + "]" * 9],
     f"--set sweep.e={'[' * 9}{']' * 9}: sweep.e[0][0][0][0][0][0]: nested too deeply, expected at most 8 levels"),
    (["sweep=3"], "--set sweep=3: sweep: got 3, expected a table"),
    (["solver.rtol.x=1"], "--set solver.rtol.x=1: solver.rtol: got a table, expected a number from 1e-13 to 0.0001"),
    (["materials.\"a.b\"={E=1}"],
     '--set materials."a.b"={E=1}: materials."a.b".nu: missing, '
     "expected a number > -1 and <= 0.5: Poisson's ratio"),
    # a key missing in a table that an override created has no line in the file
    (["materials.new.E=1e9"],
     "x.toml: materials.new.nu: missing, expected a number > -1 and <= 0.5: Poisson's ratio"),
]  # fmt: skip


@pytest.mark.parametrize(("overrides", "line"), OVERRIDDEN, ids=[str(case[0])[:40] for case in OVERRIDDEN])
def test_a_wrong_override_is_refused_with_its_text(overrides: list[str], line: str) -> None:
    assert problems(GOOD, *overrides) == [line]


def test_overrides_replace_values() -> None:
    config = read(
        changed("e = 0.5", "e = { linspace = [0, 1, 3] }"),
        "sweep.e.arange=[0, 1, 0.5]",
        "sweep.v1 = 2 # m/s",
        "sweep.m1=1e3 g",
        'sweep."m2"=[1, 2]',
        "title=Of a shell",
        "solver.rtol=1e-6",
    )
    assert [(axis.name, axis.columns[axis.name]) for axis in config.axes] == [("e", (0, 0.5)), ("m2", (1, 2))]
    assert (config.title, config.scalars["v1"], config.scalars["m1"]) == ("Of a shell", 2.0, 1.0)
    assert config.solver == Solver(1e-6, 10_000)
    assert read(GOOD, "sweep.e.linspace=[0,1,11]").axes[0].size == 11
    assert read(GOOD, "sweep.e.linspace=[0,1,11]", "sweep.e=0.1").scalars["e"] == 0.1


def test_replaced_values_are_not_read() -> None:
    assert read(changed("e = 0.5", "e = [\n7,\n8]"), "sweep.e=1").scalars["e"] == 1.0
    assert problems(changed("e = 0.5", "e = [\n7,\n8]"), "sweep.e=[1, 9]") == [
        f"--set sweep.e=[1, 9]: sweep.e[1]: got 9, {E_EXPECTED}"
    ]


def test_figure6_is_table_1() -> None:
    config = read_config(FIGURE6)
    assert [model.key for model in config.models] == [
        "lankarani-nikravesh-1994", "lankarani-nikravesh-1990", "gharib-hurmuzlu-2012",
    ]  # fmt: skip
    assert config.scalars == {"v1": 1, "v2": 0, "m1": 1, "m2": 1, "material": "table1", "n": 1.5}
    assert [dict(axis.columns) for axis in config.axes] == [{"e": tuple(index / 100 for index in range(101))}]
    assert config.materials == {"table1": Material(56e9, 0.3, 2712)}
    assert config.solver == Solver(rtol=1e-10)
    assert config.output == Output()
    assert config.text == FIGURE6.read_text()
    assert config.overrides == ()


def test_starter_is_table_1_too() -> None:
    starter, figure6 = read_config(STARTER), read_config(FIGURE6)
    assert starter.text.splitlines()[0] == figure6.text.splitlines()[0] == "#:schema impact.schema.json"
    for name in ("models", "scalars", "axes", "materials", "solver", "output"):
        assert getattr(starter, name) == getattr(figure6, name)


OBLIQUE = ("frictions", "mu", "angle", "speed", "omega1", "omega2", "inertia_factor1")


def test_every_option_of_the_starter_works() -> None:
    text = STARTER.read_text()
    shown = re.findall(r"^# (\[.*\]|\w+ = .*)$", text, re.MULTILINE)
    assert len(shown) > 15
    # options that exclude each other or existing keys are tested one at a time
    alone = {"alpha": "e", "material1": "material", "m2": "m2", "K": "", "zip": "m1 =", "R2": ""}
    alone["dt"] = "steps_per_contact"
    # friction laws have no scheme with a fixed step
    start = shown.index("[friction.lammps-mindlin-force]")
    oblique = [line for line in shown[:start] if line.split(" = ")[0] in OBLIQUE] + shown[start:]
    rest = text
    for line in shown:
        if line.split(" = ")[0] not in (*alone, "material2") and line not in oblique:
            rest = rest.replace(f"# {line}\n", f"{line}\n", 1)
    config = read_config_text(rest)
    assert config.solver == Solver(1e-10, 10_000, integrator="kick-drift")
    assert set(config.materials) == {"table1", "steel"}
    assert config.output == Output(("v1_post", "v2_post", "e_out", "status"), "float32", "gzip", {"e": 50}, "full")
    # without e as an axis there is nothing to cut along it
    rest = re.sub(r"^chunks = .*\n", "", rest, flags=re.MULTILINE)
    one_by_one = [line for line in shown if line.split(" = ")[0] in ("alpha", "m2", "K", "R2", "dt")]
    for line in one_by_one:
        key = line.split(" = ")[0]
        without = re.sub(rf"^({alone[key] or key}) = .*\n", "", rest, flags=re.MULTILINE)
        assert read_config_text(without.replace("[sweep]", f"[sweep]\n{line}", 1)).models
    both = re.sub(r"^material = .*\n", "", rest, flags=re.MULTILINE)
    both = both.replace("# material1", "material1").replace("# material2", "material2")
    assert [axis.name for axis in read_config_text(both).axes][:2] == ["e", "material2"]
    zipped = re.sub(r"^(m[12]) = .*\n", r"\1 = [1, 2]\n", rest, flags=re.MULTILINE).replace("# zip", "zip")
    assert tuple(read_config_text(zipped).axes[1].columns) == ("m1", "m2")
    with_friction = re.sub(r"^v1 = .*\n", "", text, flags=re.MULTILINE)
    for line in oblique:
        with_friction = with_friction.replace(f"# {line}\n", f"{line}\n", 1)
    read = read_config_text(with_friction)
    assert [law.key for law in read.frictions] == ["coulomb-1785", "lammps-mindlin-force"]
    assert read.scalars["friction.lammps-mindlin-force.xt"] == 0.0
    assert [axis.name for axis in read.axes] == ["e", "mu", "angle"]


def read_config_text(text: str) -> Config:
    return parse_config(text, name="starter.toml")


def test_a_zip_group_is_named_by_its_first_member_without_repeated_values() -> None:
    text = changed("e = 0.5\nv1 = 1.0\nm1 = 1.0", "e = [0, 0]\nv1 = [1, 2]\nm1 = [3, 3]\nm2 = [1, 1]\nzip = ZIP")
    text = text.replace("m2 = 2.0\n", "")
    axes = read(text.replace("ZIP", '[["e", "v1"], ["m1", "m2"]]')).axes
    assert [(axis.name, list(axis.columns)) for axis in axes] == [("v1", ["v1", "e"]), ("case", ["m1", "m2"])]
    assert axes[1].labels == (0, 1)
    axes = read(text.replace("ZIP", '[["m2", "m1"], ["e", "v1"]]').replace("[1, 2]", "[1, 1]")).axes
    assert [axis.name for axis in axes] == ["case", "case_2"]
    # a single axis still has each value once
    assert problems(changed("e = 0.5", "e = [0.5, 0.5]")) == [
        "x.toml:4: sweep.e[1]: got 0.5 twice, expected each value once"
    ]


EXAMPLE = """\
#:schema impact.schema.json
title  = "Example"
models = ["lankarani-nikravesh-1994", "lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]

[sweep]
e  = { linspace = [0.01, 1.0, 100] }
v1 = "1 m/s"
v2 = 0.0
m1 = 1.0
m2 = [0.5, 1.0, 2.0]
material1 = "table1"
material2 = ["table1", "steel"]

[materials.table1]
E = "56 GPa"
nu = 0.3
rho = 2712

[materials.steel]
E = "210 GPa"
nu = 0.3
rho = 7850

[solver]
rtol = 1e-10

[model.ismail-stronge-2008]
gamma = 1.25
"""


def test_axes_come_in_config_order() -> None:
    config = parse_config(EXAMPLE)
    assert [(axis.name, axis.size) for axis in config.axes] == [("e", 100), ("m2", 3), ("material2", 2)]
    assert config.scalars == {"v1": 1, "v2": 0, "m1": 1, "material1": "table1", "n": 1.5}
    assert config.materials["table1"].E == 56e9
    text = changed("e = 0.5\nv1 = 1.0\n", 'm1x = 1\nv1 = [1, 2]\ne = [0, 1]\nzip = [["m2", "v1"]]\n')
    text = text.replace("m1x = 1\n", "").replace("m2 = 2.0", "m2 = { arange = [1, 3, 1] }\nv2 = [-1]")
    assert [tuple(axis.columns.items()) for axis in read(text).axes] == [
        (("e", (0.0, 1.0)),),
        (("m2", (1.0, 2.0)), ("v1", (1.0, 2.0))),
        (("v2", (-1.0,)),),
    ]


@pytest.mark.parametrize("value", ["-2.0", "nan", "true", '"2 m"', "[3.0]"])
def test_a_wrong_value_in_a_later_axis_of_a_zip_group_is_the_error_of_that_value(value: str) -> None:
    text = changed("m1 = 1.0\nm2 = 2.0", f'm1 = [1.0, 2.0]\nm2 = [1.0, {value}]\nzip = [["m1", "m2"]]')
    (problem,) = problems(text)
    assert problem.startswith("x.toml:7: sweep.m2[1]: got ")


def test_later_columns_of_a_zip_group_may_repeat_values() -> None:
    text = changed("e = 0.5\nv1 = 1.0", 'e = [0, 1]\nv1 = [1, 1]\nzip = [["e", "v1"]]')
    assert read(text).axes[0].columns == {"e": (0, 1), "v1": (1, 1)}


def test_parameters_of_models_are_scalars_and_axes_by_dotted_name() -> None:
    text = GOOD.replace('["lankarani-nikravesh-1990"]', '["test-driven", "hertz"]').replace("e = 0.5\n", "")
    config = read(text + "[model.test-driven]\nS = [1, 2]\n[model.test-linear]\n")
    assert [(axis.name, axis.columns["test-driven.S"]) for axis in config.axes] == [("test-driven.S", (1, 2))]
    assert config.scalars["test-driven.c"] == 2.0
    assert read(text + '[model.test-driven]\nS = "2 kN/m^1.5"').scalars["test-driven.S"] == 2000
    # of a model that is not chosen the values are checked, and ignored
    ignored = read(GOOD + "[model.test-driven]\nc = [1, 2]\n")
    assert not ignored.axes
    assert not any("." in name for name in ignored.scalars)


@pytest.mark.parametrize(
    ("models", "keys"),
    [
        ('"hertz"', ["hertz"]),
        ('["test-linear", "hertz", "test-linear"]', ["test-linear", "hertz"]),
        ('"lankarani-nikravesh-199?"', ["lankarani-nikravesh-1990", "lankarani-nikravesh-1994"]),
        ('["hertz", "*-1990", "family:elastic"]', ["hertz", "lankarani-nikravesh-1990"]),
    ],
)
def test_models_are_named_in_many_ways(models: str, keys: list[str]) -> None:
    assert [model.key for model in read(changed('["lankarani-nikravesh-1990"]', models)).models] == keys


def test_all_models_are_selected_once_under_their_first_name() -> None:
    config = read_config({**tomllib.loads(GOOD), "models": "all"}, plugins=(), overrides=ALL_NEEDS)
    # a law that has two names is run once
    expected = [key for key, model in catalogue().items() if not model.same_as]
    assert [model.key for model in config.models] == expected


# what some built-in models ask for beyond the rest
ALL_NEEDS = [
    "materials.steel.yield_strength=1e8",
    *(
        f"model.{model.key}.{parameter.name}={min(max(1.0, parameter.least), parameter.most)}"
        for model in catalogue().values()
        for parameter in model.parameters
        if parameter.default is None
    ),
]


GOOD_ENTRIES = [
    ("m1 = 1.0", "m1 = inf", {"m1": math.inf}),
    ("m1 = 1.0", 'm1 = "inf kg"', {"m1": math.inf}),
    ("m1 = 1.0", 'm1 = "500 g"', {"m1": 0.5}),
    ("v1 = 1.0", "v1 = -3", {"v1": -3.0}),
    ("v1 = 1.0", 'v1 = "36 km/h"', {"v1": 10.0}),
    ("v1 = 1.0", 'v1 = "1209.6 km/fortnight"', {"v1": 1.0}),
    ("v1 = 1.0", 'v1 = "2 m·s⁻¹"', {"v1": 2.0}),
    ("e = 0.5", "e = 1", {"e": 1.0}),
    ("e = 0.5", 'e = "35 %"', {"e": 0.35}),
    ("e = 0.5", 'alpha = "2 ms/mm"', {"alpha": 2.0}),
    ("e = 0.5", 'e = 0.5\nR1 = "35 mm"\nR2 = inf', {"R1": 0.035, "R2": math.inf}),
    ("e = 0.5", 'e = 0.5\nK = "6 GN/m^1.5"', {"K": 6e9}),
    ("e = 0.5", 'e = 0.5\nK = "6 GN/m^(3/2)"', {"K": 6e9}),
    ("e = 0.5", 'e = 0.5\nK = "6 MN/m"\nn = 1', {"K": 6e6, "n": 1.0}),
    ("e = 0.5", 'e = 0.5\nK = "6 kg m^(-0.5) s^-2"', {"K": 6.0}),
    ('material = "steel"', 'material1 = "steel"\nmaterial2 = "steel"', {"material1": "steel", "material2": "steel"}),
    ('material = "steel"', "K = 1e9", {"K": 1e9}),
    ('["lankarani-nikravesh-1990"]\n[sweep]', '["test-linear"]\n[sweep]\nK = 1\nn = 1', {"K": 1.0}),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "scalars"), GOOD_ENTRIES, ids=[new for _, new, _ in GOOD_ENTRIES])
def test_a_scalar_is_converted_to_si(old: str, new: str, scalars: dict[str, float | str]) -> None:
    assert scalars.items() <= read(changed(old, new)).scalars.items()


def test_a_model_that_depends_on_the_material_needs_it_beside_K() -> None:
    text = changed('material = "steel"', "K = 1e9")
    assert read(text.replace("lankarani-nikravesh-1990", "hertz")).scalars["K"] == 1e9
    expected = "missing, expected a material of [materials]"
    for key in ("test-radius", "test-plastic"):
        line = f"x.toml:3: sweep.material: {expected} (used by {key})"
        assert problems(text.replace("lankarani-nikravesh-1990", key)) == [line]
    with_radii = text.replace("K = 1e9", "K = 1e9\nR1 = 0.1\nR2 = 0.1")
    assert read(with_radii.replace("lankarani-nikravesh-1990", "test-radius")).scalars["R1"] == 0.1


def test_a_density_is_required_only_where_a_radius_is_derived_from_it() -> None:
    bare = changed("rho = 7850\n")
    radii = "R1 = 0.1\nR2 = inf"
    assert read(bare.replace("e = 0.5", f"e = 0.5\n{radii}")).materials["steel"].rho is None
    assert read(bare.replace("e = 0.5", "e = 0.5\nK = 1e9")).materials["steel"].rho is None
    # neither is that of a wall or a plane
    ball = re.sub("m[12] = .*\n", "", bare).replace("e = 0.5", "e = 0.5\nm1 = 1.0\nR1 = 0.1\n{} = inf")
    for size in ("m2", "R2"):
        assert read(ball.format(size)).materials["steel"].rho is None
    # only one radius is set, or the model depends on a radius
    needs = "x.toml:10: materials.steel.rho: missing, expected a number > 0 kg/m^3, or R{} under [sweep]: {} needs a radius"
    for line, ball, key in (("R1 = 0.1", 2, "hertz"), ("R2 = 0.1", 1, "hertz"), ("K = 1e9", 1, "test-radius")):
        text = bare.replace("e = 0.5", f"e = 0.5\n{line}").replace("lankarani-nikravesh-1990", key)
        assert problems(text) == [needs.format(ball, key)]
    validator = validator_of_configs()
    assert validator.is_valid(tomllib.loads(bare))


def test_a_sweep_with_both_radii_has_the_same_bits_without_a_density() -> None:
    text = changed("e = 0.5", "e = 0.5\nR1 = 0.1\nR2 = inf")
    both = [
        impact.sweep(tomllib.loads(config), overrides=["solver.rtol=1e-4"])
        for config in (text, text.replace("rho = 7850\n", ""))
    ]
    assert both[0].drop_attrs().identical(both[1].drop_attrs())
    assert np.isfinite(both[1]["e_out"]).all()


@pytest.mark.parametrize(
    ("entry", "values"),
    [
        ("[1]", [1]),
        ('[1, "2 m/s"]', [1, 2]),
        ("{ linspace = [0, 1, 1] }", [0]),
        ('{ linspace = ["0 m/s", "36 km/h", 7] }', np.linspace(0, 10, 7)),
        ("{ linspace = [1, -1, 5.0] }", np.linspace(1, -1, 5)),
        ("{ geomspace = [1e-3, 1e3, 13] }", np.geomspace(1e-3, 1e3, 13)),
        ("{ geomspace = [-1, -8, 4] }", np.geomspace(-1, -8, 4)),
        ("{ arange = [0, 1, 0.1] }", np.arange(0, 1, 0.1)),
        ("{ arange = [1, 0, -0.3] }", np.arange(1, 0, -0.3)),
        ('{ arange = [0, 1, "1 dm/s"] }', np.arange(0, 1, 0.1)),
    ],
)
def test_a_list_or_range_is_an_axis_of_numpy_s_values_to_15_digits(entry: str, values: object) -> None:
    (axis,) = read(changed("v1 = 1.0", f"v1 = {entry}")).axes
    assert axis.name == "v1"
    assert list(axis.columns["v1"]) == [float(f"{value:.15g}") for value in np.asarray(values, float)]


def test_typed_values_keep_all_digits() -> None:
    first, last = 0.12345678901234568, 0.9876543210987654
    for entry in (f"[{first}, {last}]", f"{{ linspace = [{first}, {last}, 2] }}"):
        assert read(changed("e = 0.5", f"e = {entry}")).axes[0].columns["e"] == (first, last)
    values = read(changed("e = 0.5", f"e = {{ linspace = [{first}, {last}, 3] }}")).axes[0].columns["e"]
    assert values == (first, 0.555555555055556, last)
    assert 0.35 in read(changed("e = 0.5", "e = { linspace = [0.0, 1.0, 101] }")).axes[0].columns["e"]


def test_a_mapping_is_kept_as_json_and_read_again() -> None:
    data = tomllib.loads(EXAMPLE)
    data["sweep"] |= {"e": np.linspace(0.1, 1, 4), "m2": (np.float64(1), math.inf)}
    config = read_config(data, ["sweep.m1=3"])
    assert config.text.startswith('{"title":"Example","models":["lankarani-nikravesh-1994",')
    assert '"e":[0.1,0.4,0.7,1.0]' in config.text
    assert parse_config(config.text, config.overrides) == config
    assert config.axes[1].columns == {"m2": (1.0, math.inf)}
    # the mapping itself is not touched
    assert data["sweep"]["m1"] == 1.0
    assert problems_of(read_config, data | {"title": None, "models": object()}, ["sweep.m1=-3"]) == [
        "config: title: got nothing, expected text",
        'config: models: got an object, expected a model, or a list of models; "all" are all',
        f"--set sweep.m1=-3: sweep.m1: got -3, {MASS}",
    ]


def test_a_mapping_of_anything_is_refused() -> None:
    endless: dict[str, object] = {}
    endless["sweep"] = endless
    for data in (endless, {1: 2}, {"\ud800": 1}, {"sweep": {"e": b"1"}}, {}):
        with pytest.raises(ConfigError, match=r"^config: "):
            read_config(data)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (None, ": cannot be read: No such file or directory"),
        (b"title = 1\n# \xff", ":2: not UTF-8: byte 0xff"),
        (b"#" * 1_000_001, ": larger than 1,000,000 bytes"),
    ],
)
def test_a_file_that_cannot_be_read_is_an_error_of_one_line(
    tmp_path: Path, content: bytes | None, line: str
) -> None:
    path = tmp_path / "x.toml"
    if content is not None:
        path.write_bytes(content)
    assert problems_of(read_config, path) == [f"{path}{line}"]


def test_only_regular_files_are_opened(tmp_path: Path) -> None:
    for path in (tmp_path, Path("/dev/zero"), Path("a\0b"), Path("x" * 5000)):
        (line,) = problems_of(read_config, path)
        assert line.startswith(escape_controls(str(path))[:1000])
        assert re.search(": (not a regular file|cannot be read)", line)


def test_a_table_in_place_of_a_config_is_named(tmp_path: Path) -> None:
    path = tmp_path / "drops.csv"
    path.write_text("v1 [m/s],e_out\n1.0,0.8\n", encoding="utf-8")
    names = '[data] file = "drops.csv" or [sweep] cases = "drops.csv"'
    expected = f"is a CSV file, expected a TOML file, which may have {names}"
    assert problems_of(read_config, path) == [f"{path}: {expected}"]


def test_a_file_with_byte_order_mark_and_crlf_is_read(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").replace("e = 0.5", "e = 5").encode())
    with pytest.raises(ConfigError, match=re.escape(f"{path}:4: sweep.e: got 5, {E_EXPECTED}")):
        read_config(path)


def test_the_schema_is_valid_and_accepts_the_configs() -> None:
    validator = validator_of_configs()
    validator.check_schema(schema_of_configs())
    for text in (FIGURE6.read_text(), STARTER.read_text(), EXAMPLE, GOOD):
        validator.validate(tomllib.loads(text))
    for text in ('"all"', '"family:hysteresis"', '["hertz", "lankarani-*"]'):
        validator.validate(tomllib.loads(changed('["lankarani-nikravesh-1990"]', text)))
    assert json.loads(json.dumps(schema_of_configs(), allow_nan=False)) == schema_of_configs()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("e = 0.5", "e = 1.4"),
        ("e = 0.5", 'e = "half"'),
        ("e = 0.5", "e = []"),
        ("e = 0.5", "e = { linspace = [0, 1] }"),
        ("e = 0.5", "e = { linspace = [0, 1, 2.5] }"),
        ("e = 0.5", "e = { linspac = [0, 1, 2] }"),
        ("e = 0.5", "e = true"),
        ("m1 = 1.0", "m1 = 0"),
        ("nu = 0.3", "nu = 0.6"),
        ("nu = 0.3", "nuu = 0.3"),
        ("m1 = 1.0\n", ""),
        ("m1 = 1.0", "m1 = 1.0\nm3 = 1"),
        ('"steel"', "3"),
        ('["lankarani-nikravesh-1990"]', '["hetrz"]'),
        ("rho = 7850", "rho = 7850\n[solver]\nrtol = 1"),
        ("rho = 7850", "rho = 7850\n[model.hetrz]"),
        ("rho = 7850", "rho = 7850\n[model.hertz]\nS = 1"),
    ],
)
def test_the_schema_refuses(old: str, new: str) -> None:
    text = changed(old, new)
    assert problems(text)
    assert not validator_of_configs().is_valid(tomllib.loads(text))


@pytest.mark.parametrize(
    ("models", "accepted"),
    [
        ('["all", "!hertz"]', True),
        ('["all", "!family:hysteresis"]', True),
        ('["all", "hertz", "!lankarani-*"]', True),
        ('["hertz", "[l]ankarani-*", "!hertz"]', True),
        ('"!hertz"', False),
        ('["!hertz", "all"]', False),
        ('["all", "!hetrz"]', False),
        ('["all", "!family:hystersis"]', False),
        ('["all", "!!hertz"]', False),
        ('["all", "!!h*"]', False),
        ('["all", "!"]', False),
        ('"family:hyst*"', False),
        ('["all", "!family:hyst*"]', False),
    ],
)
def test_the_schema_accepts_the_models_that_the_reader_accepts(models: str, accepted: bool) -> None:
    data = tomllib.loads(changed('["lankarani-nikravesh-1990"]', models))
    faults = expand_laws(data["models"], catalogue())[1]
    assert (not faults) is accepted
    assert validator_of_configs().is_valid(data) is accepted


def test_the_schema_names_every_key_with_its_unit() -> None:
    sweep = schema_of_configs()["$defs"]["Sweep"]["properties"]  # type: ignore[index]
    assert sweep["alpha"]["description"].endswith("e = 1 - alpha v0 [s/m]")
    assert all(entry["description"] for entry in sweep.values())
    models = schema_of_configs()["properties"]["models"]["anyOf"][0]["enum"]  # type: ignore[index]
    assert {*catalogue(), "all", "family:hysteresis"} <= set(models)


@pytest.mark.slow
def test_pint_is_imported_only_for_a_unit() -> None:
    code = (
        "import sys; from pathlib import Path; from impact.config.load import read_config\n"
        "read_config(Path(sys.argv[1]))\n"
        "assert 'pint' not in sys.modules\n"
        "read_config(Path(sys.argv[1]), ['sweep.v1=1 m/s'])\n"
        "assert 'pint' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, FIGURE6], check=True)


@settings(max_examples=30)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_unit_scales_exactly(value: float) -> None:
    config = read(changed("v1 = 1.0", f'v1 = "{value!r} mm/s"'))
    assert config.scalars["v1"] == float(Fraction(repr(value)) / 1000)
    assert read(changed("v1 = 1.0", f'v1 = "{value!r} m/s"')).scalars["v1"] == value


UNSAFE = re.compile("[\x00-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\ud800-\udfff]")
PIECES = st.one_of(
    st.text(max_size=20),
    st.text(alphabet='[]{}="\'.,#\n e1m-', max_size=20),
    st.sampled_from(["[", "{", '"""', "'''", "nan", "1e999", "[sweep]", "e.e.e", "\n", '"\\u202e"', "zip = [['e', 'v1']]"]),
)  # fmt: skip


@pytest.mark.slow
@settings(max_examples=75, deadline=None)
@given(st.integers(0, len(GOOD)), st.integers(0, 30), PIECES, st.lists(PIECES, max_size=2))
def test_any_text_gives_a_config_or_safe_lines(at: int, cut: int, piece: str, overrides: list[str]) -> None:
    lines: tuple[str, ...] = ()
    config = None
    try:
        config = read(GOOD[:at] + piece + GOOD[at + cut :], *overrides)
    except ConfigError as error:
        lines = error.problems
    assert (config is None) == bool(lines)
    assert not any(UNSAFE.search(line) for line in lines)
    assert all(line.startswith(("x.toml", "--set", "and ")) for line in lines)
    assert config is None or parse_config(config.text, config.overrides, PLUGINS) == config


NUMBERS = {
    "e": st.floats(0, 1),
    "v1": st.floats(-1e300, 1e300),
    "v2": st.floats(-1e300, 1e300),
    "m1": st.floats(0, exclude_min=True, allow_infinity=True),
    "m2": st.floats(0, exclude_min=True, allow_infinity=True),
    "R1": st.floats(0, exclude_min=True, allow_infinity=True),
    "K": st.floats(0, exclude_min=True, allow_infinity=False),
    "n": st.floats(1, 10),
}


@st.composite
def sweeps(draw: st.DrawFn) -> dict[str, object]:
    names = draw(st.permutations(list(NUMBERS)))
    unique = {name: st.lists(values, min_size=1, max_size=3, unique=True) for name, values in NUMBERS.items()}
    # a K beside an axis of n would have to be zipped with it
    return {name: draw(NUMBERS[name] if name == "n" else NUMBERS[name] | unique[name]) for name in names}


@settings(max_examples=30)
@given(sweeps())
def test_every_value_is_in_the_config_once_and_in_order(sweep: dict[str, object]) -> None:
    config = read_config({"models": "hertz", "sweep": sweep})
    lists = {name: tuple(value) for name, value in sweep.items() if isinstance(value, list)}
    assert [(axis.name, axis.columns[axis.name]) for axis in config.axes] == list(lists.items())
    assert config.scalars == {name: value for name, value in sweep.items() if name not in lists}
    assert parse_config(config.text) == config


@given(st.text(), st.integers(2, 50))
def test_safe_text_is_short_and_has_no_invisible_characters(text: str, limit: int) -> None:
    shown = safe_text(text, limit)
    assert len(shown) <= limit
    assert not UNSAFE.search(shown)
    assert safe_text(shown, limit) == shown
