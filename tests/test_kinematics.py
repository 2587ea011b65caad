"""Kinematics of the payload."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crane_env.kinematics import payload_position, payload_velocity

angles = st.floats(-1.5, 1.5)
lengths = st.floats(1.0, 12.0)
rates = st.floats(-2.0, 2.0)


@given(rates, lengths, rates, angles, rates)
def test_the_payload_velocity_is_the_slope_of_the_payload_position(
    v: float, length: float, rate: float, sway: float, sway_rate: float
) -> None:
    def position(t: float) -> float:
        return payload_position(v * t, length + rate * t, sway + sway_rate * t)

    slope = (position(1e-5) - position(-1e-5)) / 2e-5
    assert payload_velocity(v, length, rate, sway, sway_rate) == pytest.approx(slope, abs=1e-6)


def test_arrays_and_floats_agree() -> None:
    rows = np.random.default_rng(0).uniform(-1, 1, (5, 9))
    many = payload_velocity(*rows)
    for k in range(9):
        assert payload_velocity(*(float(x) for x in rows[:, k])) == pytest.approx(
            float(many[k]), rel=1e-14
        )
