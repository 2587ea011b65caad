"""Validation: what has failed costs infinitely, whatever else drives beside it."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest

import crane_env  # noqa: F401  registers OILCrane-v0
from baselines.rl import validation
from baselines.rl.checkpoint import (
    Progress,
)
from baselines.rl.recorder import Recorder
from baselines.rl.settings import TrainingSettings
from baselines.rl.training import new_model
from baselines.rl.validation import VALIDATION, Validation, drive
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost


def test_a_crane_that_diverges_costs_infinitely_and_leaves_the_others_validation_untouched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def policy(observations: Any) -> Any:
        seen = Observation(*observations.T)
        return 2.0 * (seen.travel_reference - seen.trolley_velocity)[:, None]

    def play(spoil: Any = None, policy: Any = policy) -> Any:
        made = []

        def make_and_keep(*arguments: Any, **settings: Any) -> Any:
            made.append(gymnasium.make_vec(*arguments, max_episode_steps=400, **settings))
            return made[0]

        steps = iter(range(400))

        def drive_and_spoil(observations: Any) -> Any:
            if next(steps) == 150 and spoil is not None:
                made[0].unwrapped.plant._velocity[1, 2] = 1e11
            return policy(observations)

        monkeypatch.setattr(validation, "gymnasium", SimpleNamespace(make_vec=make_and_keep))
        return drive(drive_and_spoil, [VALIDATION] * 3, 7, CraneParameters(), StageCost())

    def without_a_number(observations: Any) -> Any:
        answers = policy(observations)
        answers[1] = np.nan
        return answers

    whole = play()
    assert np.isfinite(whole["stage_cost"]).all()
    for broken in (play(spoil=True), play(policy=without_a_number)):
        for name, values in broken.items():
            assert values[1] == math.inf
            np.testing.assert_array_equal(values[[0, 2]], whole[name][[0, 2]])


def test_a_policy_that_failed_is_never_the_best_of_several(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    costs = iter([math.inf, 3.0, math.inf])
    monkeypatch.setattr(
        "baselines.rl.recorder.validate",
        lambda *_, steps, **__: Validation(steps, 0.0, None, next(costs), 0.0, 0.0, 0.0),
    )
    settings = TrainingSettings(environments=16)
    recorder = Recorder(settings, tmp_path, Progress(), lambda *_: None)
    recorder.model = new_model(settings)
    kept = []
    for bias in (1.0, 2.0, 3.0):
        recorder.model.policy.value_net.bias.data.fill_(bias)
        recorder._validate()
        kept.append(recorder.progress.best["value_net.bias"].item())
    assert kept == [1.0, 2.0, 2.0]
