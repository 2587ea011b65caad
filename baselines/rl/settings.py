"""Training settings: all that determines a training run, as plain data."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from baselines.rl.rewards import REWARDS
from crane_env.environment.randomisation import Randomisation
from crane_env.operators.registry import make_operator
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost

TRAINING_SEEDS = 10_000_000
"""Training seed s has the environment seeds from `TRAINING_SEEDS` + s * `SEED_STRIDE` on. The test
set is the manoeuvres of seeds 0 to 999, validation has seeds of its own, and none of them meet."""

COUNTS = (
    "episode_steps",
    "action_hold",
    "evaluation_interval",
    "checkpoint_interval",
    "validation_manoeuvres",
)

SEED_STRIDE = 10_000
"""Most environments that one training run can have."""

LENGTHS = (6.5, 11.0)
"""Initial cable lengths of the training episodes [m]: an agent that has only seen one length has
only learnt that one."""

DOMAIN = Randomisation(
    payload_mass=(50.0, 200.0),
    cable_length_initial=LENGTHS,
    cable_stiffness=(5e5, 2e6),
    drive_bandwidth=(300.0, 1000.0),
)
"""Cranes of the episodes with domain randomisation."""

EPISODE_STEPS = 600
"""Control steps of a training episode: 12 s, in which a press at 1 m/s stays within the rails."""

STEP_RESPONSE = {
    "name": "manoeuvre",
    "travel_press_min": 0.0,
    "travel_press_delay": 0.0,
    "travel_press_max": 0.0,
    "lift_press_min": 0.0,
    "lift_press_max": 4.0,
    "travel_release_min": 15.0,
    "travel_release_max": 15.0,
    "lower_press_min": 8.0,
    "lower_press_max": 11.0,
    "backward_probability": 0.5,
}
"""Operator of the training episodes: travel pressed at once, for longer than the episode, with a
lift and a lowering meanwhile. A press or release in the midst of an episode would be a surprise:
what it costs has nothing to do with the action before it, and is a hundred times what that action
was worth. And there is nothing to learn from it: to a feedback of w - s' a release is a press."""

SHORT_MANOEUVRE = {
    "name": "manoeuvre",
    "travel_press_min": 0.0,
    "travel_press_delay": 0.8,
    "travel_press_max": 3.0,
    "lift_press_min": 0.0,
    "lift_press_max": 2.0,
    "travel_release_min": 5.0,
    "travel_release_max": 9.0,
    "lower_press_min": 6.0,
    "lower_press_max": 9.0,
    "backward_probability": 0.5,
}
"""Operator for policies that are no such feedback: all that is in a manoeuvre, within an episode.
What has never seen the buttons released may do anything then."""


@dataclass(frozen=True, kw_only=True)
class Algorithm:
    """How Stable-Baselines3 trains by default.

    Attributes:
        steps: environment steps of a run, all environments together.
        environments: cranes that step together.
        operator: who presses the buttons in the training episodes.
        hyperparameters: arguments of the algorithm's class.
    """

    steps: int
    environments: int
    operator: Mapping[str, Any]
    hyperparameters: Mapping[str, Any]


ALGORITHMS: dict[str, Algorithm] = {
    "ppo": Algorithm(
        steps=1_000_000,
        environments=64,
        operator=STEP_RESPONSE,
        hyperparameters={
            "learning_rate": 1e-3,
            "n_steps": 64,
            "batch_size": 1024,
            "n_epochs": 10,
            "gamma": 0.998,
            "gae_lambda": 0.96,
        },
    ),
    "sac": Algorithm(
        steps=400_000,
        environments=16,
        operator=SHORT_MANOEUVRE,
        hyperparameters={
            "learning_rate": 1e-3,
            "buffer_size": 400_000,
            "learning_starts": 10_000,
            "batch_size": 256,
            "train_freq": 4,
            "gradient_steps": 8,
            "gamma": 0.998,
        },
    ),
    "a2c": Algorithm(
        steps=2_000_000, environments=64, operator=STEP_RESPONSE, hyperparameters={"gamma": 0.998}
    ),
    "ddpg": Algorithm(
        steps=400_000, environments=16, operator=SHORT_MANOEUVRE, hyperparameters={"gamma": 0.998}
    ),
    "td3": Algorithm(
        steps=400_000, environments=16, operator=SHORT_MANOEUVRE, hyperparameters={"gamma": 0.998}
    ),
}
"""Algorithms by name; PPO and SAC are tuned for the crane, the others as their library has them."""


@dataclass(frozen=True, kw_only=True)
class TrainingSettings:
    """One training run.

    Attributes:
        algorithm: one of `ALGORITHMS`.
        seed: of everything drawn in the run, from 0 on.
        steps: environment steps, all environments together; None: the algorithm's.
        environments: cranes that step together; None: the algorithm's.
        reward: one of `REWARDS`.
        randomise: whether the episodes' cranes differ as in `DOMAIN`; their initial lengths do
            anyway.
        operator: who presses the buttons in the training episodes, as `make_operator` takes it;
            None: the algorithm's.
        episode_steps: control steps of a training episode.
        acceleration_scale: the policy's output of 1 [m/s^2]; it can ask for no more.
        action_hold: control periods for which an action is held in training.
        hyperparameters: arguments of the algorithm's class, beyond or instead of its defaults.
        parameters: the crane.
        cost: weights of the stage cost.
        evaluation_interval: steps between evaluations on the validation manoeuvres.
        checkpoint_interval: steps between checkpoints.
        validation_manoeuvres: number of manoeuvres in an evaluation.

    Raises:
        ValueError: an unknown name, or a value out of range; the message says what is allowed.
    """

    algorithm: str = "ppo"
    seed: int = 0
    steps: int | None = None
    environments: int | None = None
    reward: str = "stage-cost"
    randomise: bool = False
    operator: str | Mapping[str, Any] | None = None
    episode_steps: int = EPISODE_STEPS
    acceleration_scale: float = 5.0
    action_hold: int = 4
    hyperparameters: Mapping[str, Any] = field(default_factory=dict)
    parameters: CraneParameters = field(default_factory=CraneParameters)
    cost: StageCost = field(default_factory=StageCost)
    evaluation_interval: int = 100_000
    checkpoint_interval: int = 100_000
    validation_manoeuvres: int = 20

    def __post_init__(self) -> None:
        """Fills in the algorithm's defaults and refuses settings that make no sense."""
        if self.algorithm not in ALGORITHMS:
            raise ValueError(
                f"Unknown algorithm {self.algorithm!r}; valid: {', '.join(ALGORITHMS)}."
            )
        if self.reward not in REWARDS:
            raise ValueError(f"Unknown reward {self.reward!r}; valid: {', '.join(REWARDS)}.")
        default = ALGORITHMS[self.algorithm]
        for name in ("steps", "environments", "operator"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, getattr(default, name))
        for name in ("steps", "environments", *COUNTS):
            _check_whole(name, getattr(self, name), least=1)
        _check_whole("seed", self.seed, least=0)
        if self.count > SEED_STRIDE:
            raise ValueError(f"environments must be at most {SEED_STRIDE}, not {self.count}.")
        make_operator(self.buttons)
        object.__setattr__(self, "parameters", CraneParameters.of(self.parameters))
        object.__setattr__(self, "cost", StageCost.of(self.cost))
        limit = self.parameters.acceleration_max
        if not 0.0 < self.acceleration_scale <= limit:
            raise ValueError(
                f"acceleration_scale must be above 0 and at most the crane's {limit} m/s^2, "
                f"not {self.acceleration_scale!r}."
            )
        merged = {**default.hyperparameters, **self.hyperparameters}
        object.__setattr__(self, "hyperparameters", merged)

    @classmethod
    def of(cls, mapping: Mapping[str, Any]) -> TrainingSettings:
        """Reads what `as_dict` and JSON made of settings.

        Raises:
            ValueError: an unknown field, or a value out of range.
        """
        unknown = sorted(set(mapping) - set(cls.__dataclass_fields__))
        if unknown:
            valid = ", ".join(cls.__dataclass_fields__)
            raise ValueError(f"Unknown training setting {unknown[0]!r}; valid: {valid}.")
        return cls(**mapping)

    def as_dict(self) -> dict[str, Any]:
        """Plain data, with every default filled in."""
        return dataclasses.asdict(self)

    @property
    def total_steps(self) -> int:
        """Environment steps of the run."""
        assert self.steps is not None, "filled in on construction"
        return self.steps

    @property
    def decisions(self) -> int:
        """Actions of the learner in the run; each is held."""
        return -(-self.total_steps // self.action_hold)

    @property
    def buttons(self) -> str | Mapping[str, Any]:
        """Operator of the training episodes."""
        assert self.operator is not None, "filled in on construction"
        return self.operator

    @property
    def count(self) -> int:
        """Cranes that step together."""
        assert self.environments is not None, "filled in on construction"
        return self.environments

    @property
    def environment_seed(self) -> int:
        """Seed of the first of the run's environments."""
        return TRAINING_SEEDS + self.seed * SEED_STRIDE

    @property
    def randomisation(self) -> Randomisation:
        """Ranges of the episodes' cranes."""
        return DOMAIN if self.randomise else Randomisation(cable_length_initial=LENGTHS)


def _check_whole(name: str, value: object, *, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ValueError(f"{name} must be a whole number of at least {least}, not {value!r}.")
