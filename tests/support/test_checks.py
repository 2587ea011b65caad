"""Checks and fields: NumPy's numbers are numbers, and all else is one ValueError."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crane_env.support import checks
from crane_env.support.fields import check_fields, from_fields, with_fields


class Nameless:
    def __repr__(self) -> str:
        raise RuntimeError("no name")


@pytest.mark.parametrize("two", [2, 2.0, np.int8(2), np.float32(2), np.uint64(2), Fraction(2)])
def test_every_real_scalar_is_a_number(two: Any) -> None:
    for number in (checks.real("x", two), checks.positive("x", two), checks.within("x", two, 1, 2)):
        assert (type(number), number) == (float, 2.0)


NO_NUMBERS = (True, np.True_, "2", b"2", None, [2], np.array([2]), {2: 2, "2": 2}, Nameless())
NO_FINITE_ONES = (2j, math.nan, math.inf, 10**400, Decimal(2))


@pytest.mark.parametrize("other", [*NO_NUMBERS, *NO_FINITE_ONES])
def test_nothing_else_is(other: Any) -> None:
    for check in (checks.real, checks.positive, checks.not_negative):
        with pytest.raises(ValueError, match=r"^x must be .* number, not "):
            check("x", other)
    with pytest.raises(ValueError, match=r"^A seed must be a whole number of at least 0 and below"):
        checks.seed(other)


@dataclass(frozen=True)
class Inner:
    low: float = 0.0
    high: float = 1.0

    def __post_init__(self) -> None:
        check_fields(self, checks.within, ("low", "high"), 0.0, 9.0, "m")


@dataclass(frozen=True)
class Outer:
    first: Inner = Inner(high=5.0)
    second: Inner = field(default_factory=Inner)


def replaced(changes: Any) -> Outer:
    return with_fields(Outer(), changes, must_be="An outer must be a mapping", unknown="outer")


def test_a_mapping_replaces_nested_fields_and_keeps_the_others() -> None:
    assert replaced({"first": {"low": np.int64(2)}}) == Outer(first=Inner(2.0, 5.0))
    assert replaced({}) == Outer()
    for wrong, message in (
        ([], "An outer must be a mapping, not list"),
        ({1: 2, "first": 3}, "Unknown outer 1; valid: first, second"),
        ({"first": None}, "first must be a mapping, not NoneType"),
        ({"first": {"low": 10}}, "low must be from 0 to 9 m, not 10"),
        ({"first": {"up": 1}}, "Unknown first field 'up'; valid: low, high"),
    ):
        with pytest.raises(ValueError, match=message):
            replaced(wrong)


@given(st.recursive(st.none() | st.floats() | st.text(), lambda v: st.dictionaries(st.text(), v)))
def test_any_json_value_is_a_dataclass_or_a_value_error(value: Any) -> None:
    with contextlib.suppress(ValueError):
        assert isinstance(from_fields(Inner, value, must_be="It is", unknown="field"), Inner)
