"""Models and their network: mirror-symmetric, and still where nothing is asked."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import crane_env  # noqa: F401  registers OILCrane-v0
from baselines.rl.network import CraneFeatures, GainScheduledPolicy
from baselines.rl.settings import ALGORITHMS, TrainingSettings
from baselines.rl.training import new_model
from crane_env.observation import observation_space
from crane_env.parameters import CraneParameters


def test_a_mirrored_observation_gets_the_mirrored_action_and_the_same_value() -> None:
    model = new_model(TrainingSettings(environments=16))
    policy = model.policy
    assert isinstance(policy, GainScheduledPolicy)
    torch.manual_seed(1)
    for parameter in policy.mlp_extractor.parameters():
        torch.nn.init.normal_(parameter)
    space = observation_space(CraneParameters())
    rng = np.random.default_rng(2)
    seen = rng.uniform(np.maximum(space.low, -1.0), np.minimum(space.high, 5.0), (50, 8))
    mirror = np.array([-1, -1, 1, 1, -1, -1, -1, 1])
    there, here = (torch.as_tensor(o) for o in (seen * mirror, seen))
    with torch.no_grad():
        actions, value, _ = policy(here, deterministic=True)
        mirrored, same, _ = policy(there, deterministic=True)
    assert actions.abs().max() > 0.1
    torch.testing.assert_close(mirrored, -actions)
    torch.testing.assert_close(same, value)
    assert CraneFeatures(space)(here.float()).shape == (50, 17)


def test_a_crane_at_rest_and_one_that_moves_as_asked_are_left_alone() -> None:
    policy = new_model(TrainingSettings(environments=16)).policy
    for parameter in policy.mlp_extractor.parameters():  # type: ignore[union-attr,operator]
        torch.nn.init.normal_(parameter)
    for w in (-1.0, 0.0, 1.0):
        action, _ = policy.predict(np.array([3.0, w, 6.0, 0.0, 0.0, 0.0, w, 0.0]), None, None, True)
        assert action[0] == 0.0


def test_unknown_hyperparameters_are_refused() -> None:
    with pytest.raises(ValueError, match=r"ppo refuses its hyperparameters: .*magic"):
        new_model(TrainingSettings(environments=2, hyperparameters={"magic": 1}))


@pytest.mark.parametrize("name", [name for name in ALGORITHMS if name not in ("ppo", "sac")])
def test_the_other_algorithms_can_be_built_by_name(name: str) -> None:
    model = new_model(TrainingSettings(algorithm=name, environments=2))
    assert type(model).__name__ == name.upper()
