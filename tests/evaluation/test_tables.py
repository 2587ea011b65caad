"""Tables: means of what is defined, and a word on the rest."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from baselines.evaluation.episode_spec import Setup, episode_specs, play
from baselines.evaluation.results import EpisodeResult
from baselines.evaluation.tables import lowest, mean_and_deviation, summary_table


def test_a_slack_cable_and_episodes_without_a_release_are_told() -> None:
    (spec,) = episode_specs(["manual"], ["table1:1"], [0], Setup(max_steps=700))
    released = play(spec).metrics()
    unreleased = dataclasses.replace(released, release_drift=math.nan)
    slack = dataclasses.replace(released, slack_time=0.4)
    for played, count, note in (
        ([released, released], "0", False),
        ([released, unreleased], "0", True),
        ([slack, released], "1", False),
    ):
        table = summary_table([EpisodeResult(spec, metrics, 0.0) for metrics in played])
        assert ("1 of 2 episodes have no release" in str(table.caption)) == note
        (cells,) = [list(one.cells) for one in table.columns if one.header == "slack\ncable"]
        assert cells == [count]


def test_the_lowest_value_wins_and_ties_and_gaps_are_fair() -> None:
    assert lowest({"a": 2.0, "b": 1.0, "c": float("nan")}) == {"b"}
    assert lowest({"a": 1.0, "b": 1.0}) == {"a", "b"}
    assert lowest({"a": 1.0, "b": float("nan")}) == set()


def test_the_spread_is_the_sample_standard_deviation() -> None:
    assert mean_and_deviation(np.array([1.0, 2.0, 3.0]), 2) == "2.00 ± 1.00"
    assert mean_and_deviation(np.array([1.0]), 2) == "1.00"
    assert mean_and_deviation(np.array([]), 2) == "-"
