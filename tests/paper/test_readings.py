"""Readings: walks that change one point at a time, and what a reading makes of the setup."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

from baselines.evaluation.episode_spec import Setup
from baselines.paper.readings import (
    DEFAULT,
    LEVELS,
    POINTS,
    Reading,
    own_horizons,
    turned_point,
    walks,
)


def test_each_step_of_a_walk_changes_one_point_and_each_point_once() -> None:
    for walk in walks(20, np.random.default_rng(1)):
        steps = [turned_point(a, b) for a, b in pairwise(walk)]
        assert sorted(steps) == sorted(POINTS)
        for reading in walk:
            assert all(getattr(reading, p) in levels for p, levels in LEVELS.items())


def test_walks_come_to_every_level_of_every_point_and_are_the_same_again() -> None:
    found = walks(50, np.random.default_rng(0))
    assert found == walks(50, np.random.default_rng(0))
    for point, levels in LEVELS.items():
        assert {getattr(r, point) for walk in found for r in walk} == set(levels)


def test_the_defaults_are_the_default_setup_and_among_the_papers_own_horizons() -> None:
    assert DEFAULT.setup == Setup()
    assert DEFAULT.name == "defaults"
    own = own_horizons()
    assert DEFAULT in own
    assert len(set(own)) == len(own) == 8 * 8 * 3
    assert {(r.prediction_horizon, r.control_horizon, r.cost_term) for r in own} == {
        (100, 10, "displacement")
    }


@pytest.mark.parametrize(
    ("model", "length"), [("l0", 10.0), ("l0 - 4 m", 6.0), ("l0 - 2 m", 8.0), ("4 m", 4.0)]
)
def test_the_models_length_is_coupled_to_the_cable_or_free(model: str, length: float) -> None:
    reading = Reading(initial_length=10.0, model_length=model)
    assert reading.setup.settings.model_cable_length == length
    assert reading.shared.setup.settings.model_cable_length == 10.0


def test_a_reading_changes_in_the_setup_what_it_says() -> None:
    for point, levels in LEVELS.items():
        for value in levels:
            reading = dataclasses.replace(DEFAULT, **{point: value})
            same = value == getattr(DEFAULT, point)
            # The model at 8 m is at the initial length by default.
            assert (reading.setup == Setup()) == (same or value == "8 m")
            assert (reading.name == "defaults") == same


def test_moves_that_are_held_fit_into_the_horizon() -> None:
    assert Reading(control_horizon=20, held_periods=5, prediction_horizon=50).moves == 10
    assert Reading(held_periods=5).moves == 10
    assert Reading(held_periods=5).setup.settings.control_horizon == 50
