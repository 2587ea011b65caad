"""Training settings: all that determines a training run, as plain data.

A learner maximises one of three rewards, functions of the three terms of the environment's reward,
which is minus the stage cost of eq. (6) times the control period T_s:

    "stage-cost"        the environment's reward: -((y - w)^2 + lambda_1 d^2 + lambda_u u^2) T_s
    "absolute-error"    -(|y - w| + lambda_1 d^2 + lambda_u u^2) T_s, whose first term sums to IAE
    "tracking"          -((y - w)^2 + lambda_u u^2) T_s, the sway left to itself
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane_env.environment.randomisation import Randomisation
from crane_env.operators.registry import make_operator
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from crane_env.support.checks import SEED_LIMIT, choice, positive, shown, whole
from crane_env.support.fields import check_fields, from_fields

Terms = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""`reward_tracking`, `reward_sway` and `reward_acceleration` of the cranes, shape (N,) each."""

REWARDS: dict[str, Callable[[Terms, float], NDArray[np.float64]]] = {
    "stage-cost": lambda terms, period: terms[0] + terms[1] + terms[2],
    # The tracking term is -(y - w)^2 T_s.
    "absolute-error": lambda terms, period: -np.sqrt(-terms[0] * period) + terms[1] + terms[2],
    "tracking": lambda terms, period: terms[0] + terms[2],
}
"""Rewards of the cranes, shape (N,), from the terms and the control period [s], by name."""

TRAINING_SEEDS = 10_000_000
"""Training seed s has the environment seeds from `TRAINING_SEEDS` + s * `SEED_STRIDE` on. The test
set is the manoeuvres of seeds 0 to 999, validation has seeds of its own, and none of them meet."""

SEED_STRIDE = 10_000
"""Most environments that one training run can have."""

WHOLE: dict[str, tuple[int, int]] = {
    "seed": (0, 2**32),
    "steps": (1, SEED_LIMIT),
    "environments": (1, SEED_STRIDE + 1),
    "episode_steps": (1, SEED_LIMIT),
    "action_hold": (1, SEED_LIMIT),
    "evaluation_interval": (1, SEED_LIMIT),
    "checkpoint_interval": (1, SEED_LIMIT),
    "validation_manoeuvres": (1, SEED_STRIDE + 1),
}
"""Settings that are whole numbers: the least of them, and what they are below. A seed is also one
of NumPy's first generator; cranes fit into memory, and the rest into a float."""

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
        default = ALGORITHMS[choice("algorithm", self.algorithm, ALGORITHMS)]
        choice("reward", self.reward, REWARDS)
        for name in ("steps", "environments", "operator"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, getattr(default, name))
        for name, (least, below) in WHOLE.items():
            check_fields(self, whole, (name,), least, below)
        if not isinstance(self.randomise, bool):
            raise ValueError(f"randomise must be True or False, not {shown(self.randomise)}.")
        make_operator(self.buttons)
        object.__setattr__(self, "parameters", CraneParameters.of(self.parameters))
        object.__setattr__(self, "cost", StageCost.of(self.cost))
        check_fields(self, positive, ("acceleration_scale",))
        if self.acceleration_scale > self.parameters.acceleration_max:
            raise ValueError(
                "acceleration_scale must be at most the crane's "
                f"{self.parameters.acceleration_max} m/s^2, not {self.acceleration_scale}."
            )
        if not isinstance(self.hyperparameters, Mapping):
            raise ValueError(
                "hyperparameters must map the names of the algorithm's arguments to values, "
                f"not {shown(self.hyperparameters)}."
            )
        merged = {**default.hyperparameters, **self.hyperparameters}
        object.__setattr__(self, "hyperparameters", merged)

    @classmethod
    def of(cls, value: TrainingSettings | Mapping[str, Any] | None) -> TrainingSettings:
        """Reads what `as_dict` and JSON made of settings.

        Raises:
            ValueError: an unknown field, or a value out of range.
        """
        return from_fields(
            cls,
            value,
            must_be="Training settings must be TrainingSettings or a mapping",
            unknown="training setting",
        )

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
