"""Stage cost of eq. (6)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crane_env.stage_cost import StageCost

values = st.floats(-3.0, 3.0)


@given(values, values, st.floats(1.0, 12.0), values, values)
def test_the_terms_are_those_of_equation_6(
    y: float, w: float, length: float, theta: float, u: float
) -> None:
    assert StageCost().terms(y, w, length, theta, u) == pytest.approx(
        ((y - w) ** 2, (length * math.sin(theta)) ** 2, 0.2 * u * u)
    )
    assert StageCost(sway_term="angle").terms(y, w, length, theta, u).sway == pytest.approx(
        theta**2
    )
    assert StageCost(sway_term="printed").terms(y, w, length, theta, u).sway == pytest.approx(
        (theta - w) ** 2
    )


def test_many_stages_cost_what_each_costs() -> None:
    rng = np.random.default_rng(0)
    stages = rng.normal(size=(5, 7))
    many = StageCost().terms(*stages)
    for k in range(7):
        one = StageCost().terms(*(float(x) for x in stages[:, k]))
        assert [float(term[k]) for term in many] == pytest.approx(list(one), rel=1e-15)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"sway_weight": -1.0}, "sway_weight must be zero or a positive finite number"),
        ({"acceleration_weight": math.nan}, "acceleration_weight must be zero or a positive"),
        ({"sway_term": "sway"}, "Unknown sway_term 'sway'; valid: displacement, angle, printed"),
        ({"weight": 1.0}, "Unknown stage cost field 'weight'; valid: sway_weight"),
    ],
)
def test_nonsense_is_refused_with_a_sentence(fields: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        StageCost.of(fields)


def test_a_stage_cost_of_another_type_is_refused() -> None:
    with pytest.raises(ValueError, match="must be a StageCost or a mapping, not list"):
        StageCost.of([1.0])  # type: ignore[arg-type]
