"""The dimension of a unit is that of its factors, with exponents that may be formulas."""

from __future__ import annotations

import re

import pytest

from impact.contact.model import Parameter
from impact.contact.units import dimension
from impact.errors import ModelError

from .conftest import new_law

UNITS = {
    "m^(-n)": (0.0, -1.5, 0.0),
    "kg^-2": (-2.0, 0.0, 0.0),
    "s^(n-p)": (0.0, 0.0, -0.5),
    "N/m^n": (1.0, -0.5, -2.0),
    "Pa s^((n+p)/2)": (1.0, -1.0, -0.25),
    "m^(2*p)": (0.0, 4.0, 0.0),
    "J/m": (1.0, 1.0, -2.0),
    "Hz m": (0.0, 1.0, -1.0),
}


@pytest.mark.parametrize("unit", UNITS)
def test_dimension(unit: str) -> None:
    assert dimension(unit, {"n": 1.5, "p": 2.0}) == UNITS[unit]


@pytest.mark.parametrize("unit", ["lb", "N/ft^n", "N+m"])
def test_a_unit_of_a_parameter_that_is_no_product_of_powers_of_si_units_is_refused(unit: str) -> None:
    with pytest.raises(ModelError, match=re.escape(f'unit "{unit}": expected powers of 1, rad, kg')):
        new_law("dashpot", lambda elastic, v, c: elastic + c * v, parameters=(Parameter("c", unit, "damping"),))
