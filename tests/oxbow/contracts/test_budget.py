"""Spacings by length, and refusals of lengths that do not suffice."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from oxbow.contracts.budget import LENGTH_RESERVE, nominal_spacing_m, too_short


@given(st.floats(0.01, 1e7), st.sampled_from([LENGTH_RESERVE, 0.01]))
def test_the_length_that_is_asked_for_suffices_and_is_little_more(shortest_m, reserve):
    refusal = too_short(shortest_m / 2, shortest_m, reserve=reserve)
    found = re.search(r"expected more than ([\d.]+) m: ", refusal.message)
    assert found is not None
    least_m = float(found.group(1))
    assert shortest_m <= (1 - reserve) * least_m * (1 + 1e-12)
    assert least_m <= shortest_m / (1 - reserve) + 0.1001


def test_a_refusal_names_the_field_what_it_is_and_what_it_is_for():
    refusal = too_short(883.82, 883.32, what="the way home", where="Vehicles[1].Length")
    assert str(refusal) == (
        "Vehicles[1].Length: is 883.82 m; expected more than 884.3 m: the way home is 883.3 m long, and"
        " 0.1% is kept in reserve"
    )


@pytest.mark.parametrize("length_m", [1e-3, 123456.789])
def test_the_length_that_was_given_is_given_back(length_m):
    assert f"is {length_m} m; " in too_short(length_m, 1e9).message


def test_a_short_length_is_divided_into_spacings():
    assert nominal_spacing_m(1e6, 20_000.0) == pytest.approx(50.0)
    assert nominal_spacing_m(12e6, 1_000.0) == pytest.approx(125.0)
    assert nominal_spacing_m(1e6, 20_000.0, 80.0) == pytest.approx(80.0)
    assert math.isclose(nominal_spacing_m(1e6, 1e9), 1e-3)
